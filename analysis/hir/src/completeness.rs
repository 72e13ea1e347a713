//! Whether all of something is known.

use std::ops::{BitAnd, BitAndAssign};

/// Whether all of something is known, or a syntax error, an unreadable file or an unresolved name may hide some of it. What
/// rests on several things is complete where all of them are: `a & b`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, salsa::SalsaValue)]
pub enum Completeness {
    /// All of it is known.
    #[default]
    Complete,
    /// Some of it may be missing: no analysis may rest on it.
    Incomplete,
}

impl Completeness {
    /// Returns `Complete` where `is_complete` holds.
    pub fn of(is_complete: bool) -> Completeness {
        if is_complete { Completeness::Complete } else { Completeness::Incomplete }
    }

    /// Returns whether all of it is known.
    pub fn is_complete(self) -> bool {
        self == Completeness::Complete
    }

    /// Returns whether some of it may be missing.
    pub fn is_incomplete(self) -> bool {
        self == Completeness::Incomplete
    }
}

impl BitAnd for Completeness {
    type Output = Completeness;

    fn bitand(self, other: Completeness) -> Completeness {
        Completeness::of(self.is_complete() && other.is_complete())
    }
}

impl BitAndAssign for Completeness {
    fn bitand_assign(&mut self, other: Completeness) {
        *self = *self & other;
    }
}

impl FromIterator<Completeness> for Completeness {
    fn from_iter<T: IntoIterator<Item = Completeness>>(all: T) -> Completeness {
        all.into_iter().fold(Completeness::Complete, BitAnd::bitand)
    }
}
