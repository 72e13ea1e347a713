//! What is measured: components, programs and codels by instance, each with a number.

use std::collections::HashMap;

use super::error::TraceError;

/// Bounds the memory that names of a hostile trace need.
const MOST_NAMES: usize = 1 << 17;

/// What a span is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SpanKind {
    /// One period of an instance.
    Period,
    /// A program of a component.
    Program,
    /// A call of a codel.
    Codel,
}

/// What was executed, and by which instance.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Name {
    /// What it is.
    pub kind: SpanKind,
    /// Of a codel and of a program, its key in a timing table: `nav.plan`, `nav.Pilot/Moving.lost.guard`. Empty for a period.
    pub key: String,
    /// The instance that executed it; empty where the trace does not name it.
    pub instance: String,
}

/// The number of a [`Name`] in its [`Names`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NameId(pub(super) u32);

impl NameId {
    /// Returns the number as an index: names are numbered from 0 in the order in which they appear.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The names in a trace.
#[derive(Debug, Default)]
pub struct Names {
    all: Vec<Name>,
    ids: HashMap<Name, NameId>,
    /// The same names as the trace writes them. Several texts can be one name.
    texts: HashMap<Box<[u8]>, NameId>,
}

impl Names {
    /// Returns a name.
    pub fn get(&self, id: NameId) -> &Name {
        const UNKNOWN: &Name = &Name { kind: SpanKind::Codel, key: String::new(), instance: String::new() };
        self.all.get(id.index()).unwrap_or(UNKNOWN)
    }

    /// Returns all names, in the order of their numbers.
    pub fn ids(&self) -> impl Iterator<Item = NameId> + use<> {
        (0..self.all.len() as u32).map(NameId)
    }

    /// Returns the number of names.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Returns whether the trace has named nothing yet.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Returns the id of a name that the trace writes as `text`; `name` reads it where it is new.
    pub(super) fn of_text(
        &mut self,
        text: &[u8],
        name: impl FnOnce() -> Result<Name, TraceError>,
    ) -> Result<NameId, TraceError> {
        if let Some(id) = self.texts.get(text) {
            return Ok(*id);
        }
        let id = self.of(name()?)?;
        if self.texts.len() >= MOST_NAMES {
            return Err(TraceError::TooManyNames);
        }
        self.texts.insert(text.into(), id);
        Ok(id)
    }

    fn of(&mut self, name: Name) -> Result<NameId, TraceError> {
        if let Some(id) = self.ids.get(&name) {
            return Ok(*id);
        }
        let id = u32::try_from(self.all.len()).map(NameId).map_err(|_| TraceError::TooManyNames)?;
        self.all.push(name.clone());
        self.ids.insert(name, id);
        Ok(id)
    }
}
