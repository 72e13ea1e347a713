//! The keys and sections of a timing table: the reader, completion and the JSON schema follow this list.

use super::{Entry, Overhead, Table, TableSection, Times};
use crate::toml_key::{ANY_NAME, TomlKey, ValueKind};

/// A key of a timing table, or a section.
pub type TableKey = TomlKey<TableKeyKind>;

/// What the value of a [`TableKey`] is.
pub enum TableKeyKind {
    /// The unit of all times.
    Unit,
    /// The significance levels.
    Levels,
    /// A section of [entries](Entry), with what completion says of it, and the field that has them.
    Entries(TableSection, &'static str, fn(&mut Table) -> &mut Vec<Entry>),
    /// A section with these keys, or a record of `[measured]`, with its header if it has one.
    Keys(Option<(&'static str, &'static str)>, &'static [TableKey]),
    /// A value of a record, as a type of the schema.
    Value(&'static str),
    /// A time, or one for each level, and the field that has it.
    Times(fn(&mut Overhead) -> &mut Times),
}

impl ValueKind for TableKeyKind {
    fn keys(&self) -> &'static [TableKey] {
        if let TableKeyKind::Keys(_, keys) = self { keys } else { &[] }
    }

    fn header(&self) -> Option<(&'static str, &'static str)> {
        match self {
            TableKeyKind::Entries(section, summary, _) => Some((section.header(), summary)),
            TableKeyKind::Keys(header, _) => *header,
            _ => None,
        }
    }
}

/// The keys before the first section and the sections, in the order of messages and completion.
#[rustfmt::skip] // rustfmt would give each field a line of its own.
pub static KEYS: [TableKey; 9] = [
    TableKey { name: "unit", kind: TableKeyKind::Unit, default: Some(r#""ms""#), examples: "",
        documentation: "The unit of all times in this table." },
    TableKey { name: "levels", kind: TableKeyKind::Levels, default: None, examples: "[[1e-3, 1e-4, 1e-5]]",
        documentation: "The significance levels of the columns of the arrays below: the probability that one execution takes \
                        longer than its time. Not needed if every time is one number." },
    TableKey { name: "codel", kind: TableKeyKind::Entries(TableSection::Codel, "times of codels", |it| &mut it.codels), default: None, examples: r#"[{ "navigation.astar": [290, 297, 310], "navigation.dist": 1 }]"#,
        documentation: "By library and codel, such as \"navigation.astar\"; by the codel alone, outside libraries or if its \
                        name is unique." },
    TableKey { name: "program", kind: TableKeyKind::Entries(TableSection::Program, "times of whole programs", |it| &mut it.programs),
        default: None, examples: r#"[{ "Hokuyo/update": [40, 43, 44] }]"#,
        documentation: "Whole programs, in place of the sums of their codels: \"Hokuyo/update\", \
                        \"Navigation/Planning.run\", \"Navigation/Planning.arrived.guard\", or the component and the name of \
                        an operation." },
    TableKey { name: "component", kind: TableKeyKind::Entries(TableSection::Component, "times of whole components, for the classic method", |it| &mut it.components),
        default: None, examples: r#"[{ "Navigation": 299 }]"#,
        documentation: "Whole components, for the classic method, if they take longer than their programs." },
    TableKey { name: "wait", kind: TableKeyKind::Entries(TableSection::Wait, "times that codels wait, each with its wake-up latency", |it| &mut it.waits),
        default: None, examples: r#"[{ "drivers.imu_read": 0.8, "camera.grab": { "time": 8.1, "waits": 2 } }]"#,
        documentation: "The greatest time that a call of a codel spends off the CPU by its own will, in addition to its execution \
                        time: for a device, another thread, or asleep. It lasts until the thread runs again on an idle CPU: its \
                        wake-up latency is part of it. With `waits`, how often a call waits at most, which locks need: each wait \
                        adds two context switches." },
    TableKey { name: "access", kind: TableKeyKind::Entries(TableSection::Access, "times of reads and writes of ports", |it| &mut it.accesses),
        default: None, examples: r#"[{ "Camera.frame": 0.9 }]"#,
        documentation: "The execution time of a read or a write of a port, by component and port, such as \"drivers.Camera.frame\": \
                        it copies the value." },
    TableKey { name: "overhead", kind: TableKeyKind::Keys(Some(("[overhead]", "the overhead of each wake-up")), &OVERHEAD),
        default: None, examples: "", documentation: "The overhead of each period of each activity: dispatch + 2 × context_switch." },
    TableKey { name: "measured", kind: TableKeyKind::Keys(Some(("[measured]", "where measured times come from")), &[
            TableKey { name: ANY_NAME, kind: TableKeyKind::Keys(None, &MEASURED), default: None, examples: "", documentation: "" },
        ]), default: None, examples: r#"[{ "navigation.astar": { "executions": 20000, "greatest": 281.5, "times": [290, 297, 310] } }]"#,
        documentation: "Where measured times come from. `mauve pwcet` writes this section; it changes no response time." },
];

/// Returns a key of a record.
const fn value(name: &'static str, schema: &'static str, documentation: &'static str) -> TableKey {
    TableKey { name, kind: TableKeyKind::Value(schema), default: None, examples: "", documentation }
}

/// The keys of a record of `[measured]`.
#[rustfmt::skip] // rustfmt would give each field a line of its own.
pub static MEASURED: [TableKey; 11] = [
    value("executions", r#""integer""#, "How many executions were measured."),
    value("greatest", r#""number""#, "The greatest of them, the high-water mark, in `unit`."),
    value("times", r#""array""#, "The measured bounds, one for each level, in `unit`. If the entry has other times, somebody edited it."),
    value("method", r#""string""#, "The method of the estimate."),
    value("date", r#""string""#, "When the times were estimated."),
    value("samples", r#""string""#, "The digest of the executions."),
    value("files", r#""array""#, "The sample files, relative to this table."),
    value("bytes", r#""integer""#, "Their size together: it grows with each run."),
    value("source", r#""string""#, "The source of the codel, relative to this table."),
    value("source_digest", r#""string""#, "The digest of the source: if it changes, the times are outdated."),
    value("warnings", r#""array""#, "Why the times need a look: kinds of warnings, each with a page (`mauve explain heavy-tail`)."),
];

/// The keys of `[overhead]`.
#[rustfmt::skip] // rustfmt would give each field a line of its own.
pub static OVERHEAD: [TableKey; 2] = [
    TableKey { name: "dispatch", kind: TableKeyKind::Times(|it| &mut it.dispatch), default: Some("0"), examples: "",
        documentation: "To dispatch a job." },
    TableKey { name: "context_switch", kind: TableKeyKind::Times(|it| &mut it.context_switch), default: Some("0"), examples: "",
        documentation: "For one context switch; a job takes two, and each of its waits two more." },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toml_key::headers;

    #[test]
    fn sections_of_timing_tables() {
        let headers: Vec<&str> =
            headers(&KEYS).into_iter().map(|(label, _)| label.trim_matches(['[', ']'])).collect();
        assert_eq!(headers, ["codel", "program", "component", "wait", "access", "overhead", "measured"]);
    }
}
