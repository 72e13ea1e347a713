//! Whether information is complete.

use std::ops::{BitAnd, BitAndAssign};

/// Whether information is complete, or a syntax error, an unreadable file or an unresolved name may hide an item. The
/// operator `&` composes: `a & b` is complete if both are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, salsa::SalsaValue)]
pub enum Completeness {
    /// No error hides an item.
    #[default]
    Complete,
    /// An item may be missing: no analysis may depend on the information.
    Incomplete,
}

impl Completeness {
    /// Returns `Complete` if `is_complete`.
    pub fn of(is_complete: bool) -> Completeness {
        if is_complete { Completeness::Complete } else { Completeness::Incomplete }
    }

    /// Returns whether the information is complete.
    pub fn is_complete(self) -> bool {
        self == Completeness::Complete
    }

    /// Returns whether an item may be missing.
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
