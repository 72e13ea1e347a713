//! The ways of data through a core, and why there is none.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use std::sync::Arc;

use crate::ModelDb;
use crate::cost::CostGraph;
use crate::item_tree::{Name, SourceId};
use crate::program_id::ProgramId;
use crate::source::Decl;

/// What is assumed of a core while data passes through it.
#[salsa::interned(debug)]
pub struct Assumption<'db> {
    /// The states that it does not leave; empty for all states.
    #[returns(ref)]
    pub states: Vec<Name>,
    /// The codels that are assumed to return `true`.
    #[returns(ref)]
    pub answers: Vec<Decl<'db>>,
    /// The input ports that are assumed to have new data at each read.
    #[returns(ref)]
    pub new_data: Vec<Name>,
    /// Whether data also passes through values of external types: the handles on devices and libraries.
    #[returns(copy)]
    pub through_handles: bool,
    /// Whether a write also carries the data that decides that it is executed: by a condition in its program, or by the transition that
    /// led to its state.
    #[returns(copy)]
    pub decides: bool,
}

impl<'db> Assumption<'db> {
    /// What carries data beside values, as [`Assumption::through_handles`] and [`Assumption::decides`], in the order in which the ways
    /// of a declared chain are tried.
    pub const CARRIERS: [(bool, bool); 4] = [(false, false), (true, false), (false, true), (true, true)];

    /// Returns that nothing is assumed, and that only values carry data.
    pub fn nothing(db: &'db dyn ModelDb) -> Assumption<'db> {
        Assumption::new(db, Vec::new(), Vec::new(), Vec::new(), false, false)
    }
}

/// Where data enters or leaves a core.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum PassageEnd<'db> {
    /// An input port at the beginning, an output port at the end.
    Port(Name),
    /// A codel: at the beginning its outputs are new data, at the end its inputs are the effect.
    Codel(Decl<'db>),
    /// At the beginning, a provided operation, whose parameters are the data, or a required one, whose collected results are; at
    /// the end, a required operation that a call is sent to, or a provided one, whose results are.
    Operation(Name),
}

/// How data passes through a core.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Passages<'db> {
    /// The passages that exist, in the order of their ends in the text.
    pub all: Vec<Passage<'db>>,
    /// The most releases from any instant until the next write of each output port that is written.
    pub writes: Vec<(Name, Result<u32, Skip<'db>>)>,
    /// The most releases from any instant until the next read of each input port that is read.
    pub reads: Vec<(Name, Result<u32, Skip<'db>>)>,
    /// The input ports for which that also holds from the first job on: that job leaves nothing in a buffer.
    pub read_at_start: Vec<Name>,
}

/// The way of data through a core.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Passage<'db> {
    pub from: PassageEnd<'db>,
    pub to: PassageEnd<'db>,
    /// N: the most releases from the arrival of data, at any statement of a job, to the job that writes it or newer data, or why
    /// that may never happen.
    pub releases: Result<u32, Skip<'db>>,
    /// D: the most periods from a read to the write that carries what was read; none without a bound.
    pub periods: Option<u32>,
    /// The statement that may write less after data was written, such as older data or a constant; none if it keeps.
    pub overwritten: Option<Overwrite<'db>>,
    /// What each period that writes the data executes up to the end of its last write of it: for the response time to the write.
    /// Empty where that may be all of the period: an operation of the component may write it.
    pub written: Vec<Written<'db>>,
    /// Whether the end is a codel that passes the data to a handle: a later call with that handle may have the effect, up to the
    /// end of the period.
    pub to_handle: bool,
}

/// What a period executes up to the end of a write.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Written<'db> {
    /// The index of its edge in [`crate::Behaviour::edges`].
    pub edge: usize,
    /// The number of programs of the edge before that with the write.
    pub programs: usize,
    /// The cost of that program up to the end of the write.
    pub part: Arc<CostGraph<'db>>,
}

/// Why data may never be written: periods that can repeat for ever without a write of it.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Skip<'db> {
    /// The core.
    pub core: Decl<'db>,
    /// The states in which it repeats, in order.
    pub states: Vec<Name>,
    /// The condition or statement that lets it skip the write; none where the states have no write.
    pub at: Option<SourceId>,
    pub cause: SkipCause<'db>,
}

/// What lets a core skip a write.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum SkipCause<'db> {
    /// The states write nothing that carries the data.
    NoWrite,
    /// A branch without the write, on a condition that is not known.
    Condition,
    /// A codel may not return `true`.
    Answer(Decl<'db>),
    /// This other port may have no new data.
    OtherPort(Name),
    /// An earlier read of the same port took the data.
    AlreadyRead,
    /// Every path leaves the assumed states: the core cannot stay in them.
    Leaves,
    /// The search was too large.
    TooLarge,
}

/// A statement that writes older data, or none, after data was written.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Overwrite<'db> {
    /// The core.
    pub core: Decl<'db>,
    /// The state of the period that overwrites.
    pub state: Name,
    /// The program.
    pub program: ProgramId,
    /// The write.
    pub at: SourceId,
    /// Whether what it writes comes from the input at all; otherwise it is a constant.
    pub is_older: bool,
}
