//! Connections between instances.

use std::fmt;

use crate::item_tree::Name;
use crate::source::{Decl, Location};

/// A connection between ports or operations.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct Link<'db> {
    /// Whether it connects operations instead of ports.
    pub operation: bool,
    /// Its source: instance and feature.
    pub source: (Name, Name),
    /// Its target: instance and feature.
    pub target: (Name, Name),
    /// The size of its circular buffer; `None` if the connection keeps only the last value.
    pub buffer: Option<u32>,
    /// The location of the feature in its target.
    pub at: Location<'db>,
}

/// As users write it, without its buffer: `laser.scan -> map.scan`.
impl fmt::Display for Link<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [(from, out), (to, into)] = [&self.source, &self.target];
        write!(f, "{from}.{out} -> {to}.{into}")
    }
}

impl<'db> Link<'db> {
    /// Returns whether `of` contains it.
    pub fn is_in(&self, of: Decl<'db>) -> bool {
        matches!(self.at, Location::Source(decl, _) if decl == of)
    }
}
