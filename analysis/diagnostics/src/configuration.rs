//! The messages of errors in `mauve.toml`.

use mauve_hir::{ExpectedValue, MistakeKind};
use mauve_timing::TimeError;

use crate::lists::{alternatives, cpu_names};

/// Returns the message of an error in a `mauve.toml`.
pub(super) fn mistake(kind: &MistakeKind) -> String {
    match kind {
        MistakeKind::Unreadable(problem) => problem.clone(),
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
        MistakeKind::NoSuchCpu { named, cpus } => {
            let available = u64::MAX >> (64 - cpus.clamp(&1, &64));
            format!(
                "`cpus` names {}, and `[platform] cpus` has {}",
                cpu_names(*named & !available),
                cpu_names(available)
            )
        }
        MistakeKind::WrongValue { key, expected } => format!("`{key}` {}", expected_value(key, *expected)),
    }
}

/// Returns whether this is a section or a key of timing tables.
fn is_of_table(name: &str) -> bool {
    mauve_timing::table_keys::KEYS.iter().any(|key| key.name == name)
}

/// Returns the valid values of a key, as a predicate of the key.
fn expected_value(key: &str, expected: ExpectedValue) -> String {
    let text = match expected {
        ExpectedValue::Paths => "is a path, or a list of paths",
        ExpectedValue::PathPatterns => "is a list of paths, which may have `*`",
        ExpectedValue::Instances => "is a list of instances",
        ExpectedValue::Level => "is a number between 0 and 1, such as 1e-4",
        ExpectedValue::Time(None) => "is a time with its unit, such as \"5 ms\"",
        ExpectedValue::Time(Some(error)) => {
            return format!("is a time such as \"5 ms\": {}", time_error(error));
        }
        ExpectedValue::Period(None) => "is a time greater than 0 with its unit, such as \"10 ms\"",
        ExpectedValue::Period(Some(error)) => {
            return format!("is a time such as \"10 ms\": {}", time_error(error));
        }
        ExpectedValue::Cpus => "is a list of CPUs, numbered from 1 to 64, such as [1, 2]",
        ExpectedValue::Tables => return format!("is a list of sections, such as `[[platform.{key}]]`"),
        ExpectedValue::Name => "is a name on one line, such as \"network interrupt\"",
        ExpectedValue::Integer(from, to) => return format!("is a whole number from {from} to {to}"),
        ExpectedValue::Boolean => "is true or false",
        ExpectedValue::Folder => "is the path of a folder",
        ExpectedValue::Text => "is a string",
        ExpectedValue::CppType => "is a C++ type, such as \"ArRobot*\"",
        ExpectedValue::Header => {
            "is the relative path of a C++ header, such as \"Aria/Aria.h\"; no part of it begins with `.` or `-`"
        }
        ExpectedValue::Maintainer => "is a name and an address, such as \"Ada Lovelace <ada@example.org>\"",
        ExpectedValue::License => "names a licence, such as \"BSD\"",
        ExpectedValue::TypeSection => {
            return format!("is a section: `[types.{key}]` with `cpp` and `header`");
        }
        ExpectedValue::DeploymentSection => {
            return format!("is a section: `[deployment.{key}]` with `accept`");
        }
        ExpectedValue::DeploymentTables => {
            "is a section of a deployment, such as `[timing.deployment.Sea]` with `tables`"
        }
        ExpectedValue::Reasons => {
            "is a table of instances, each with a reason that is not empty, such as { planner = \"measured by hand\" }"
        }
        ExpectedValue::Ports => "is a list of ports, such as [\"hokuyo.scan\", \"guidance.command\"]",
        ExpectedValue::Severity => {
            "has an invalid severity: expected \"allow\", \"hint\", \"warn\" or \"error\""
        }
    };
    text.to_owned()
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
        let kind =
            MistakeKind::WrongValue { key: "cpus".to_owned(), expected: ExpectedValue::Integer(1, 64) };
        assert_eq!(mistake(&kind), "`cpus` is a whole number from 1 to 64");
        let kind = MistakeKind::UnknownSection {
            section: "platfrm".to_owned(),
            expected: vec!["project", "timing", "platform"],
        };
        assert_eq!(mistake(&kind), "unknown section `[platfrm]`: expected project, timing or platform");
    }
}
