//! `mauve tune`: what to change in a deployment so that every deadline is met, or met with more room.
//!
//! | file | holds |
//! |---|---|
//! | `tune/trials.rs` | what may change, and the analysis of a deployment with other values |
//! | `tune/order.rs` | priorities |
//! | `tune/placement.rs` | CPUs |
//! | `tune/periods.rs` | periods |
//! | `tune/conflict.rs` | why no values are found: the activities that cannot be scheduled together |
//! | `tune/goals.rs` | [`tune`] |
//!
//! Every proposal is a list of values that has been analysed like a text with these values: so its figures are those of the edited
//! text. Budgets are counted in steps, so that the same model has the same answers everywhere.

mod conflict;
mod goals;
mod order;
mod periods;
mod placement;
mod trials;

pub use goals::tune;

use mauve_hir::item_tree::Name;
use mauve_timing::Time;

use crate::reason::Refusal;
use crate::what_if::WhatIfField;

/// What [`tune`] may change, and what for.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct TuneRequest {
    /// Whether priorities may change.
    pub priorities: bool,
    /// Whether activities may move to another CPU of their host.
    pub cpus: bool,
    /// Whether periods may change: they become as short as the deadlines allow.
    pub periods: bool,
    /// What is best among the values that meet every deadline.
    pub aim: TuneAim,
    /// The instances whose activities stay as they are.
    pub pins: Vec<Name>,
    /// Whether deadlines are given up, where not all can be met: those of the greatest utilisation first.
    pub partly: bool,
    /// So many activities are analysed at most, those of each analysis counted.
    pub most_steps: usize,
}

impl TuneRequest {
    /// The budget of a command: ten activities are analysed 40,000 times. That takes a second; with locks, or on several CPUs, some.
    pub const STEPS_OF_COMMAND: usize = 400_000;

    /// The budget of an editor: some tens of milliseconds.
    pub const STEPS_OF_EDITOR: usize = 8192;
}

/// What is best among the values that meet every deadline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TuneAim {
    /// Nothing more: the first values that are found.
    #[default]
    Deadlines,
    /// The least slack, as a part of the deadline, is as great as possible.
    Slack,
    /// The declared chains, without them all chains, are as short as possible: first the worst part of a limit, then the sum.
    Latency,
}

/// The result of [`tune`].
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Tuned {
    /// The values that change. Empty where the present ones are as good as any that were found.
    pub fields: Vec<WhatIfField>,
    /// Whether every deadline is met with them.
    pub is_met: bool,
    /// How far the search went.
    pub search: SearchKind,
    /// Why a deadline is not met.
    pub conflict: Option<Conflict>,
    /// The instances whose deadlines are given up, and missed: with the values, all others are met.
    pub given_up: Vec<Name>,
}

/// How far a search went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SearchKind {
    /// Nothing better exists: where no values are found, that is a proof.
    Exact,
    /// Something better may exist: the response times depend on each other, and the possible values are too many to analyse all.
    Heuristic,
    /// The budget was exhausted: something better may exist.
    Exhausted,
}

/// Activities that cannot be scheduled together, however they are placed and ordered as far as the request allows.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Conflict {
    /// The first instance of each activity.
    pub activities: Vec<Name>,
    /// How small it is.
    pub kind: ConflictKind,
    /// For each, what it would have to be so that every deadline of the deployment is met.
    pub remedies: Vec<Remedy>,
}

/// How small a conflict is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConflictKind {
    /// No set of fewer activities is a conflict.
    Smallest,
    /// Without any one of its activities, the others can be scheduled.
    Minimal,
    /// Fewer of its activities may be a conflict: the budget was exhausted.
    Some,
}

/// What one activity of a conflict would have to be, all else as it is.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Remedy {
    /// The instance.
    pub instance: Name,
    /// The greatest execution time of its jobs now, without their waits, and the greatest with which every deadline is found to be met;
    /// none where not even 0 is enough.
    pub time: Option<[Time; 2]>,
    /// Its period now, and the least with which every deadline is met; none where not even 64 times the period is enough.
    pub period: Option<[Time; 2]>,
}

/// Why an activity keeps a deployment from being tuned: it is not analysed, whatever its priority and CPU.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Untunable<'db> {
    /// The instance; none where the whole deployment is not analysed.
    pub instance: Option<Name>,
    /// The reasons.
    pub refusals: Vec<Refusal<'db>>,
}
