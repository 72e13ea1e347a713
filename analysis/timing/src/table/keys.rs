//! The keys and sections of a timing table: the reader, completion and the JSON schema follow this list.

use super::{Entry, Overhead, Table, Times};

/// A section of a timing table, or a key: `summary` is shown by completion, `documentation` by the schema.
#[allow(missing_docs)]
pub struct Key {
    pub name: &'static str,
    pub kind: EntryKind,
    pub summary: &'static str,
    pub documentation: &'static str,
}

/// What the value of a [`Key`] is.
pub enum EntryKind {
    /// The unit of all times.
    Unit,
    /// The significance levels.
    Levels,
    /// A section of [entries](Entry), the field that has them, and an example in JSON.
    Entries(fn(&mut Table) -> &mut Vec<Entry>, &'static str),
    /// The section with the keys of [`OVERHEAD`].
    Overhead,
    /// The section with records of the keys of [`MEASURED`], and an example in JSON.
    Measured(&'static str),
    /// A value of a record, as a type of the schema.
    Value(&'static str),
    /// A time, or one for each level, and the field that has it.
    Times(fn(&mut Overhead) -> &mut Times),
}

/// The section of waits.
pub(crate) const WAIT: &str = "wait";

/// The keys before the first section and the sections, in the order of messages and completion.
#[rustfmt::skip] // rustfmt would give each field a line of its own.
pub static KEYS: [Key; 9] = [
    Key { name: "unit", kind: EntryKind::Unit, summary: "", documentation: "The unit of all times in this table." },
    Key { name: "levels", kind: EntryKind::Levels, summary: "",
        documentation: "The significance levels of the columns of the arrays below: the probability that one execution takes \
                        longer than its time. Not needed if every time is one number." },
    Key { name: "codel", summary: "times of codels",
        kind: EntryKind::Entries(|it| &mut it.codels, r#"{ "navigation.astar": [290, 297, 310], "navigation.dist": 1 }"#),
        documentation: "By library and codel, such as \"navigation.astar\"; by the codel alone, outside libraries or if its \
                        name is unique." },
    Key { name: "program", summary: "times of whole programs",
        kind: EntryKind::Entries(|it| &mut it.programs, r#"{ "Hokuyo/update": [40, 43, 44] }"#),
        documentation: "Whole programs, in place of the sums of their codels: \"Hokuyo/update\", \
                        \"Navigation/Planning.run\", \"Navigation/Planning.arrived.guard\", or the component and the name of \
                        an operation." },
    Key { name: "component", summary: "times of whole components, for the classic method",
        kind: EntryKind::Entries(|it| &mut it.components, r#"{ "Navigation": 299 }"#),
        documentation: "Whole components, for the classic method, if they take longer than their programs." },
    Key { name: WAIT, summary: "times that codels wait, each with its wake-up latency",
        kind: EntryKind::Entries(|it| &mut it.waits, r#"{ "drivers.imu_read": 0.8, "camera.grab": { "time": 8.1, "times": 2 } }"#),
        documentation: "The greatest time that a call of a codel spends off the CPU by its own will, in addition to its execution \
                        time: for a device, another thread, or asleep. It lasts until the thread runs again on an idle CPU: its \
                        wake-up latency is part of it. With `times`, how often a call waits at most, which locks need: each wait \
                        adds two context switches." },
    Key { name: "access", summary: "times of reads and writes of ports",
        kind: EntryKind::Entries(|it| &mut it.accesses, r#"{ "Camera.frame": 0.9 }"#),
        documentation: "The execution time of a read or a write of a port, by component and port, such as \"drivers.Camera.frame\": \
                        it copies the value." },
    Key { name: "overhead", summary: "the overhead of each job", kind: EntryKind::Overhead,
        documentation: "The overhead of each period of each activity: dispatch + 2 × context_switch." },
    Key { name: "measured", summary: "where measured times come from",
        kind: EntryKind::Measured(r#"{ "navigation.astar": { "executions": 20000, "greatest": 281.5, "times": [290, 297, 310] } }"#),
        documentation: "Where measured times come from. `mauve pwcet` writes this section; it changes no response time." },
];

/// The keys of a record of `[measured]`.
#[rustfmt::skip] // rustfmt would give each field a line of its own.
pub static MEASURED: [Key; 11] = [
    Key { name: "executions", kind: EntryKind::Value(r#""integer""#), summary: "", documentation: "How many executions were measured." },
    Key { name: "greatest", kind: EntryKind::Value(r#""number""#), summary: "", documentation: "The greatest of them, the high-water mark, in `unit`." },
    Key { name: "times", kind: EntryKind::Value(r#""array""#), summary: "",
        documentation: "The measured bounds, one for each level, in `unit`. If the entry has other times, somebody edited it." },
    Key { name: "method", kind: EntryKind::Value(r#""string""#), summary: "", documentation: "The method of the estimate." },
    Key { name: "date", kind: EntryKind::Value(r#""string""#), summary: "", documentation: "When the times were estimated." },
    Key { name: "samples", kind: EntryKind::Value(r#""string""#), summary: "", documentation: "The digest of the executions." },
    Key { name: "files", kind: EntryKind::Value(r#""array""#), summary: "", documentation: "The sample files, relative to this table." },
    Key { name: "bytes", kind: EntryKind::Value(r#""integer""#), summary: "", documentation: "Their size together: it grows with each run." },
    Key { name: "source", kind: EntryKind::Value(r#""string""#), summary: "", documentation: "The source of the codel, relative to this table." },
    Key { name: "source_digest", kind: EntryKind::Value(r#""string""#), summary: "",
        documentation: "The digest of the source: if it changes, the times are outdated." },
    Key { name: "warnings", kind: EntryKind::Value(r#""array""#), summary: "", documentation: "Why the times need a look: kinds of warnings, each with a page (`mauve explain heavy-tail`)." },
];

/// The keys of `[overhead]`.
#[rustfmt::skip] // rustfmt would give each field a line of its own.
pub static OVERHEAD: [Key; 2] = [
    Key { name: "dispatch", kind: EntryKind::Times(|it| &mut it.dispatch), summary: "", documentation: "To dispatch a job." },
    Key { name: "context_switch", kind: EntryKind::Times(|it| &mut it.context_switch), summary: "",
        documentation: "For one context switch; a job takes two, and each of its waits two more." },
];

impl Key {
    /// Whether it is a section.
    pub fn is_section(&self) -> bool {
        matches!(self.kind, EntryKind::Entries(..) | EntryKind::Overhead | EntryKind::Measured(_))
    }
}

/// What the value of the key of that name is.
pub fn kind_of(name: &str, keys: &'static [Key]) -> Option<&'static EntryKind> {
    keys.iter().find(|key| key.name == name).map(|key| &key.kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_of_timing_tables() {
        let sections: Vec<&str> = KEYS.iter().filter(|key| key.is_section()).map(|key| key.name).collect();
        assert_eq!(sections, ["codel", "program", "component", "wait", "access", "overhead", "measured"]);
        assert!(!OVERHEAD.iter().any(Key::is_section));
    }
}
