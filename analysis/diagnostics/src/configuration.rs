//! The messages of errors in `mauve.toml`.

use mauve_hir::MistakeKind;
use mauve_timing::{CpuSet, TimeError};

use crate::lists::alternatives;

/// Returns the message of an error in a `mauve.toml`.
pub(super) fn mistake(kind: &MistakeKind) -> String {
    match kind {
        MistakeKind::Unreadable(problem) => problem.clone(),
        MistakeKind::Conflict(names) => crate::syntax_error::conflict(names),
        MistakeKind::NotToml(error) => format!("not TOML: {error}"),
        MistakeKind::UnknownSection { section, .. } | MistakeKind::OutsideSections(section)
            if is_of_table(section) =>
        {
            format!("`{section}` belongs in a timing table, which `[timing] tables` names")
        }
        MistakeKind::UnknownSection { section, expected } => {
            format!("unknown section `[{section}]`: expected {}", alternatives(expected))
        }
        MistakeKind::UnknownKey { key, section, expected } => {
            format!("unknown key `{key}` in [{section}]: expected {}", alternatives(expected))
        }
        MistakeKind::OutsideSections(key) => {
            format!("unknown key `{key}`: expected a section such as `[timing]`")
        }
        MistakeKind::SeveralLines(key) => {
            format!(
                "the string in `{key}` spans several lines and may contain other keys: write it on one line"
            )
        }
        MistakeKind::MissingKey { key, header } => format!("{header} has no `{key}`: add it"),
        MistakeKind::RepeatedName { name, section } => {
            format!("a second [[{section}]] with the name `{name}`: give it another name")
        }
        MistakeKind::SecondClock(instance) => {
            format!("`{instance}` is on another clock already: an instance has one clock")
        }
        MistakeKind::NoSuchCpu { named, cpus, section } => {
            let available = CpuSet::first_few(*cpus);
            let lacking = *named - available;
            let found = format!("`cpus` names {lacking}, and `[{section}] cpus` has {available}");
            if section == "platform" { found } else { found + "; add `host`, the only host that has it" }
        }
        MistakeKind::NoSuchHost(host) => format!("no host `{host}`: name one of `[host.NAME]`"),
        MistakeKind::WrongValue { key, expected, error: None } => format!("`{key}` {expected}"),
        MistakeKind::WrongValue { key, expected, error: Some(error) } => {
            format!("`{key}` {expected}: {}", time_error(*error))
        }
    }
}

/// Returns whether this is a section or a key of timing tables.
fn is_of_table(name: &str) -> bool {
    mauve_timing::table_keys::KEYS.iter().any(|key| key.name == name)
}

/// Returns why a text is not a time.
pub fn time_error(error: TimeError) -> &'static str {
    match error {
        TimeError::NotANumber => "not a number: write a decimal number such as 40, 0.5 or 1e-3",
        TimeError::Negative => "a time cannot be negative",
        TimeError::TooLarge => "too large: the longest time is 584 years",
        TimeError::TooFine => "finer than a nanosecond: write a whole number of nanoseconds",
        TimeError::UnknownUnit => "unknown unit of time: write ns, us, ms or s after the number",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_names_what_is_known() {
        let (key, expected) = ("codel".to_owned(), "is a time such as \"5 ms\"".to_owned());
        let kind = MistakeKind::WrongValue { key, expected, error: Some(TimeError::Negative) };
        assert_eq!(mistake(&kind), "`codel` is a time such as \"5 ms\": a time cannot be negative");
        let kind = MistakeKind::UnknownSection {
            section: "platfrm".to_owned(),
            expected: vec!["project", "timing", "platform"],
        };
        assert_eq!(mistake(&kind), "unknown section `[platfrm]`: expected project, timing or platform");
    }
}
