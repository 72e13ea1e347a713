//! The chains of a deployment: how long data takes from a sensor to an actuator.
//!
//! ```text
//! passages of cores, connections ─→ ways from sources to effects ─┐
//! `[chains.NAME]` ────────────────→ the way of each chain ────────┴─→ sums of one deployment
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `chains/network.rs` | passages and connections of an architecture, and the ways through them |
//! | `chains/declared.rs` | the chains of `mauve.toml`: what their names mean, and the way that they take |
//! | `chains/ways.rs` | the ways between the names of a declared chain |
//! | `chains/latency.rs` | the latency of each way and of each connection, or why there is none |
//!
//! Only the last depends on a deployment: an edit of a period computes the sums again, and no way.

#![allow(missing_docs, reason = "most fields have the names of the terms of chains")]

mod declared;
mod latency;
mod network;
mod ways;

pub(crate) use latency::{LimitedLatency, latencies_of};
pub use latency::{chains_of, connections_of};

use mauve_hir::item_tree::Name;
use mauve_hir::{Assumption, Location, ModelDb, Overwrite, PassageEnd, Skip};
use mauve_timing::{ChainPart, ChainStep, Time};

use crate::reason::Refusal;

/// The chains of a deployment.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Chains<'db> {
    /// Those that `mauve.toml` declares, in its order, then those from each source to each sink.
    pub all: Vec<ChainReport<'db>>,
    /// The number of declared ones.
    pub declared: usize,
    /// One for each connection, in the order of [`mauve_hir::Flat::links`]: those of [`connections_of`].
    pub hops: Vec<ConnectionReport<'db>>,
    /// The number of chains that are left out, at least, because they are too many: longer ones between two ends.
    pub left_out: usize,
}

/// A chain, or why it has no latency.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct ChainReport<'db> {
    /// The name in `[chains.NAME]`, or `source -> sink`.
    pub name: Name,
    /// Its index in [`mauve_hir::Config::chains`].
    pub declared: Option<usize>,
    /// Its ends; none where they do not resolve.
    pub ends: Option<[ChainEnd<'db>; 2]>,
    /// The greatest latency; none exactly where `reasons` says why.
    pub latency: Option<Time>,
    /// How old what the effect shows is when it happens, at most.
    pub age_at_write: Option<Time>,
    /// The declared limit of the latency.
    pub limit: Option<Time>,
    /// Its steps, as far as they are known.
    pub steps: Vec<ChainStepReport<'db>>,
    /// Whether the latency counts no delay of steps by other steps on their CPU, since the chain ends before it starts again.
    pub is_apart: bool,
    /// Why there is no latency.
    pub reasons: Vec<ChainReason<'db>>,
    /// The statement of the last component that may overwrite the effect by older data: the effect is not lasting. None if it keeps.
    pub overwritten: Option<Overwrite<'db>>,
}

impl ChainReport<'_> {
    /// Returns whether it is proved to be within its limit, if `mauve.toml` has one.
    pub fn is_within_limit(&self) -> bool {
        self.limit.is_none_or(|limit| self.latency.is_some_and(|latency| latency <= limit))
    }
}

/// An end of a chain.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct ChainEnd<'db> {
    /// The instance.
    pub instance: Name,
    /// Its port or codel.
    pub end: PassageEnd<'db>,
}

impl ChainEnd<'_> {
    /// Returns it as users write it: `hokuyo.scan`, `p3dx_driver.aria_drive`.
    pub fn shown(&self, db: &dyn ModelDb) -> String {
        let end = match &self.end {
            PassageEnd::Port(name) | PassageEnd::Operation(name) => name,
            PassageEnd::Codel(codel) => codel.name(db),
        };
        format!("{}.{end}", self.instance)
    }
}

/// An instance that data passes through.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct ChainStepReport<'db> {
    /// The instance.
    pub instance: Name,
    /// Its activity: an index in [`crate::Report::activities`].
    pub activity: Option<usize>,
    /// The connection that leads to it: an index in [`mauve_hir::Flat::links`]. None for the first step.
    pub connection: Option<usize>,
    /// Where data enters and leaves the component.
    pub passage: [PassageEnd<'db>; 2],
    /// N, where it has a bound.
    pub releases: Option<u32>,
    /// Whether the data decides what it writes, and is not in it.
    pub decides: bool,
    /// What its part is computed from, if all of that is known.
    pub timed: Option<ChainStep>,
    /// What it adds to the latency; zero without one.
    pub part: ChainPart,
}

impl ChainStepReport<'_> {
    /// Returns all that it adds to the latency.
    pub fn total(&self) -> Time {
        let ChainPart { wait, buffer, periods, run, .. } = self.part;
        [buffer, periods, run].into_iter().fold(wait, |sum, part| sum.checked_add(part).unwrap_or(sum))
    }
}

/// What happens to data on a connection.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct ConnectionReport<'db> {
    /// The time from a release of the writer to the effect in the reader, at most; none where `reason` says why.
    pub latency: Option<Time>,
    /// From the release of the writer to its write, as far as the reader waits for that.
    pub write: Time,
    /// What the reader adds: all of the latency but `write`; with the rule that the reader may rely on.
    pub part: ChainPart,
    pub reason: Option<ChainReason<'db>>,
    /// The write that may overwrite what was written, without having been read; none with a buffer, which keeps it.
    pub overwritten: Option<Overwrite<'db>>,
    /// The buffer is always full, and drops the oldest values: data is at least as old as this.
    pub stays_full: Option<Time>,
    /// Of so many values that are written, at most one is read: at least 2.
    pub never_read: Option<u64>,
    /// It releases the reader: the most time between two writes on the average, and the least one between two releases, which is more.
    pub faster: Option<[Time; 2]>,
    /// In each period, the reader reads before the writer writes: it has a higher priority, and the same period.
    pub is_stale: bool,
    /// The declared chain whose assumptions it has.
    pub chain: Option<usize>,
}

/// Why a chain has no latency.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum ChainReason<'db> {
    /// The component of the step, by its index, may never write the data.
    MaySkip { step: usize, skip: Skip<'db> },
    /// It may overwrite the data before it is read.
    Overwrites { step: usize, by: Overwrite<'db> },
    /// Its activity is not analysed.
    NotAnalysed { step: usize, refusals: Vec<Refusal<'db>> },
    /// Its response time has no bound.
    NoBound { step: usize },
    /// Data of this instance releases its activity, and nothing bounds the time until its next release. None without a connection.
    ReleasedByData { step: usize, by: Option<Name> },
    /// Its activity is in the background.
    Background { step: usize },
    /// It has no activity.
    NoActivity { step: usize },
    /// Its component has errors, or is unknown.
    Unknown { step: usize },
    /// It may never read the buffer before it.
    NotRead { step: usize, skip: Option<Skip<'db>> },
    /// A gateway that it passes is not analysed.
    Gateway { gateway: Name, refusals: Vec<Refusal<'db>> },
    /// How long the network between two hosts takes is not known.
    NoLink { hosts: [Name; 2] },
    /// A topic between two hosts may lose samples: that of this port.
    BestEffort { port: Name },
    /// A connection between two hosts is no topic.
    NoTopic { hosts: [Name; 2] },
    /// The time is too long.
    TooLong,
    /// A name of the declaration, by its range in `mauve.toml`, is wrong.
    Declaration { at: Option<Location<'db>>, problem: ChainProblem },
}

/// What is wrong with a declared chain.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum ChainProblem {
    /// `from` or `to` is missing.
    Missing(&'static str),
    /// The architecture of the deployment has errors, or is unknown.
    NoArchitecture,
    /// No instance, codel or port has this name.
    Unresolved(Name),
    /// Several instances call this codel.
    Ambiguous { codel: Name, instances: Vec<Name> },
    /// No connections lead from this to that.
    NotConnected { from: Name, to: Name },
    /// Nothing of the input reaches the output: the component does not pass the data on.
    NotPassed { instance: Name },
    /// Several ways lead from one end to the other: `through` has to say which.
    SeveralWays { through: Vec<Name> },
    /// The ways from one end to the other are too many to follow.
    TooManyWays,
    /// It begins where it ends.
    NoWay,
    /// The instance of `while` has no such state, or is not in the chain.
    NoState { instance: Name, state: Name },
    /// The codel of `answers` is not called in the chain.
    NoAnswer(Name),
}

/// A chain of `mauve.toml` in an architecture.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
struct DeclaredChain<'db> {
    name: Name,
    /// Its index in [`mauve_hir::Config::chains`].
    index: usize,
    limit: Option<Time>,
    /// Its way, or what is wrong, and where.
    way: Result<ChainWay<'db>, (Option<Location<'db>>, ChainProblem)>,
}

/// A way of data through instances.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
struct ChainWay<'db> {
    name: Name,
    ends: [ChainEnd<'db>; 2],
    steps: Vec<WayStep<'db>>,
}

/// An instance on the way of data.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
struct WayStep<'db> {
    /// Its index in [`mauve_hir::Flat::instances`].
    instance: usize,
    /// The connection to it: an index in [`mauve_hir::Flat::links`].
    connection: Option<usize>,
    /// Where data enters and leaves it.
    ends: [PassageEnd<'db>; 2],
    /// Its passages, as indices in [`mauve_hir::Passages::all`]: the slowest counts. Empty where its component is not known, where
    /// it reads data and passes nothing on, and where it writes what comes from nowhere.
    passages: Vec<usize>,
    /// What is assumed of it.
    assumption: Assumption<'db>,
}
