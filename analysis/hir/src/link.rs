//! A connection between two instances.

use crate::item_tree::Name;
use crate::source::{Decl, Location};

/// A connection.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct Link<'db> {
    /// Is it between operations, and not between ports?
    pub operation: bool,
    /// From where: instance and feature.
    pub source: (Name, Name),
    /// To where.
    pub target: (Name, Name),
    /// How many values its circular buffer holds; none where it holds the last one.
    pub buffer: Option<u32>,
    /// Where the feature that it leads to stands.
    pub at: Location<'db>,
}

impl<'db> Link<'db> {
    /// Returns whether it stands in `of`.
    pub fn is_in(&self, of: Decl<'db>) -> bool {
        matches!(self.at, Location::Source(decl, _) if decl == of)
    }
}
