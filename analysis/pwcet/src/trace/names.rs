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
    /// A read or a write of a port.
    Access,
    /// From the moment when a codel has got a lock to the moment when it leaves the lock.
    Lock,
}

impl SpanKind {
    /// Returns what has this key. Parentheses are in no name of a codel, and tell apart what else recordings and sample files have:
    ///
    /// ```
    /// use mauve_pwcet::trace::SpanKind;
    ///
    /// assert_eq!(SpanKind::of("nav.plan"), SpanKind::Codel);
    /// assert_eq!(SpanKind::of("nav.Pilot/Moving.run"), SpanKind::Program);
    /// assert_eq!(SpanKind::of("(access) nav.Pilot.goal"), SpanKind::Access);
    /// assert_eq!(SpanKind::of("(lock bus) nav.plan"), SpanKind::Lock);
    /// ```
    pub fn of(key: &str) -> SpanKind {
        match key {
            _ if port_of(key).is_some() => SpanKind::Access,
            _ if lock_of(key).is_some() => SpanKind::Lock,
            _ if key.contains('/') => SpanKind::Program,
            _ => SpanKind::Codel,
        }
    }
}

/// Returns the port that a key of [`SpanKind::Access`] names: its component, a dot and its name.
pub fn port_of(key: &str) -> Option<&str> {
    key.strip_prefix("(access) ")
}

/// Returns the key of the accesses of a port.
pub fn access_key(port: &str) -> String {
    format!("(access) {port}")
}

/// Returns the lock and the codel that a key of [`SpanKind::Lock`] names.
pub fn lock_of(key: &str) -> Option<(&str, &str)> {
    key.strip_prefix("(lock ")?.split_once(") ")
}

/// Returns the key of the times for which a codel held a lock.
pub(super) fn lock_key(lock: &str, codel: &str) -> String {
    format!("(lock {lock}) {codel}")
}

/// What was executed, and by which instance.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct SpanName {
    /// What it is.
    pub kind: SpanKind,
    /// Of a codel and of a program, its key in a timing table: `nav.plan`, `nav.Pilot/Moving.lost.guard`. Of others, see
    /// [`SpanKind::of`]. Empty for a period.
    pub key: String,
    /// The instance that executed it; empty where the trace does not name it.
    pub instance: String,
}

/// The number of a [`SpanName`] in its [`SpanNames`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct NameId(pub(super) u32);

/// The names in a trace.
#[derive(Debug, Default)]
pub struct SpanNames {
    all: Vec<SpanName>,
    ids: HashMap<SpanName, NameId>,
    /// The same names as the trace writes them. Several texts can be one name.
    texts: HashMap<Box<[u8]>, NameId>,
    /// For each recorded name that differs from the name of its instance: the name of the instance.
    instances: HashMap<String, String>,
}

impl SpanNames {
    /// Returns no names yet; the instances with these recorded names have other ones.
    pub(super) fn renaming(instances: HashMap<String, String>) -> SpanNames {
        SpanNames { instances, ..SpanNames::default() }
    }

    /// Returns a name.
    pub fn get(&self, id: NameId) -> &SpanName {
        const UNKNOWN: &SpanName =
            &SpanName { kind: SpanKind::Codel, key: String::new(), instance: String::new() };
        self.all.get(id.0 as usize).unwrap_or(UNKNOWN)
    }

    /// Returns the id of a name that the trace writes as `text`; `name` reads it where it is new.
    pub(super) fn of_text(
        &mut self,
        text: &[u8],
        name: impl FnOnce() -> Result<SpanName, TraceError>,
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

    /// Returns the id of a name.
    pub(super) fn of(&mut self, mut name: SpanName) -> Result<NameId, TraceError> {
        if let Some(instance) = self.instances.get(&name.instance) {
            name.instance.clone_from(instance);
        }
        if let Some(id) = self.ids.get(&name) {
            return Ok(*id);
        }
        if self.all.len() >= MOST_NAMES {
            return Err(TraceError::TooManyNames);
        }
        let id = u32::try_from(self.all.len()).map(NameId).map_err(|_| TraceError::TooManyNames)?;
        self.all.push(name.clone());
        self.ids.insert(name, id);
        Ok(id)
    }
}
