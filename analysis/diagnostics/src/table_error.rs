//! The messages of errors in a timing table.

use mauve_timing::toml_key::ValueKind;
use mauve_timing::{MOST_LEVELS, TableErrorKind, TimeError, TomlKind, table_keys};

use crate::configuration::time_error;
use crate::lists::alternatives;

const NO_NUMBER_OF_WAITS: &str = "`waits` is how often a call waits at most: a whole number greater than 0";

/// Returns the message of an error in a timing table.
///
/// ```
/// let table = mauve_timing::Table::parse("[codel]\na = -1");
/// let message = mauve_diagnostics::table_error_message(&table.errors[0].kind);
/// assert_eq!(message, "negative time -1: expected a number of ms from 0");
/// ```
pub fn table_error_message(kind: &TableErrorKind) -> String {
    const NOT_SHORTER: &str = "a stricter level has no shorter time";
    const UNITS: &str = "expected \"ns\", \"us\", \"ms\" or \"s\"";
    match kind {
        TableErrorKind::Conflict(names) => crate::syntax_error::conflict(names),
        TableErrorKind::NotToml(error) => format!("not TOML: {error}"),
        TableErrorKind::UnknownKey(name) => {
            format!("unknown section or key `{name}`: expected {}", names_of(&table_keys::KEYS))
        }
        TableErrorKind::NoSection(name) => {
            let section = if name.contains('/') { "[program]" } else { "[codel]" };
            format!("`{name}` is in no section: write its header above it, such as `{section}`")
        }
        TableErrorKind::NotASection { name, found } => {
            format!("`{name}` is {}: expected a section `[{name}]`", kind_name(*found))
        }
        TableErrorKind::UnitOfKind(found) => format!("the unit is {}: {UNITS}", kind_name(*found)),
        TableErrorKind::UnknownUnit(name) => format!("unknown unit `{name}`: {UNITS}"),
        TableErrorKind::LevelsOfKind(found) => {
            let found = kind_name(*found);
            format!("the levels are {found}: expected an array of probabilities, such as [1e-3, 1e-4]")
        }
        TableErrorKind::TooManyLevels(count) => format!("{count} levels: at most {MOST_LEVELS} are read"),
        TableErrorKind::RepeatedLevel(level) => {
            format!("a second level {level}: remove one, and its column")
        }
        TableErrorKind::NotALevel => {
            "not a significance level: expected a probability between 0 and 1, such as 1e-4".to_owned()
        }
        TableErrorKind::UnknownOverhead(name) => {
            format!("unknown overhead `{name}`: expected {}", names_of(&table_keys::OVERHEAD))
        }
        TableErrorKind::UnknownMeasured(name) => {
            format!("unknown key `{name}` of a measurement: expected {}", names_of(&table_keys::MEASURED))
        }
        TableErrorKind::MissingMeasured(name) => {
            format!("this measurement has no `{name}`: measure again with `mauve pwcet`, or remove it")
        }
        TableErrorKind::MeasuredOfKind { key, found } => {
            let found = kind_name(*found);
            format!("`{key}` of a measurement is {found}: measure again with `mauve pwcet`, or remove it")
        }
        TableErrorKind::FallingOverhead => {
            format!("the overhead is shorter at a stricter level: {NOT_SHORTER}")
        }
        TableErrorKind::FallingTime { key, before: (before, first), after: (after, second) } => {
            format!("`{key}` is {before} at {first} and only {after} at {second}: {NOT_SHORTER}")
        }
        TableErrorKind::AllFalling => {
            "all times are shorter at stricter levels: are `levels` in another order than the times?"
                .to_owned()
        }
        TableErrorKind::RepeatedKey(key) => {
            format!("a second time for `{key}`: remove one of the two entries")
        }
        TableErrorKind::NoNumberOfWaits => NO_NUMBER_OF_WAITS.to_owned(),
        TableErrorKind::NoTime(key) => format!("no time for `{key}`: write one, or remove the entry"),
        TableErrorKind::BelowSection(name) => {
            format!("move `{name}` before the first section of the table")
        }
        TableErrorKind::NoLevels { times } => {
            format!("{} but no `levels`: name them, or write one time", values(*times))
        }
        TableErrorKind::OtherCount { times, levels } => {
            let plural = if *levels == 1 { "" } else { "s" };
            format!("{} for {levels} level{plural}: expected one for each of `levels`", values(*times))
        }
        TableErrorKind::TimeWithUnit { text, unit } => {
            format!("`{text}` has a unit: write a number of {unit}; `unit` sets the unit of the table")
        }
        TableErrorKind::TimeOfKind { found, unit } => {
            format!("expected a number of {unit}, or one for each level; found {}", kind_name(*found))
        }
        TableErrorKind::InvalidTime { text, unit, error } => match error {
            TimeError::Negative => format!("negative time {text}: expected a number of {unit} from 0"),
            TimeError::TooLarge => format!("{text} {unit} is {}", time_error(*error)),
            _ => format!("{text} is not a time: expected a finite number of {unit}"),
        },
    }
}

/// Returns the right text in place of the marked one, where that is known.
pub(crate) fn correction(kind: &TableErrorKind) -> Option<String> {
    let similar_key = |name: &str, keys: &[table_keys::TableKey]| {
        mauve_syntax::similar(name, keys.iter().map(|key| key.name)).map(str::to_owned)
    };
    match kind {
        TableErrorKind::UnknownKey(name) => similar_key(name, &table_keys::KEYS),
        TableErrorKind::UnknownOverhead(name) => similar_key(name, &table_keys::OVERHEAD),
        TableErrorKind::UnknownMeasured(name) => similar_key(name, &table_keys::MEASURED),
        TableErrorKind::UnknownUnit(name) => {
            let unit = match name.trim_end_matches(['.', 's']) {
                "msec" | "millisec" | "millisecond" | "m" | "M" | "MS" | "Ms" => "ms",
                "usec" | "microsec" | "microsecond" | "µ" | "μ" | "u" => "us",
                "nsec" | "nanosec" | "nanosecond" | "n" => "ns",
                "sec" | "second" | "S" => "s",
                _ => return None,
            };
            Some(format!("\"{unit}\""))
        }
        TableErrorKind::TimeWithUnit { text, unit } => {
            let number = text.strip_suffix(unit.to_string().as_str())?.trim();
            number.parse::<f64>().is_ok().then(|| number.to_owned())
        }
        _ => None,
    }
}

fn names_of(keys: &[table_keys::TableKey]) -> String {
    let names =
        keys.iter().map(|key| format!("`{}`", key.kind.header().map_or(key.name, |(label, _)| label)));
    alternatives(&names.collect::<Vec<_>>())
}

fn values(count: usize) -> String {
    match count {
        0 => "no value".to_owned(),
        1 => "1 value".to_owned(),
        _ => format!("{count} values"),
    }
}

pub(super) fn kind_name(kind: TomlKind) -> &'static str {
    match kind {
        TomlKind::String => "a string",
        TomlKind::Number => "a number",
        TomlKind::Boolean => "a boolean",
        TomlKind::Datetime => "a date",
        TomlKind::Array => "an array",
        TomlKind::Table => "a table",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::{Expect, expect};

    fn check(text: &str, expected: Expect) {
        let errors = mauve_timing::Table::parse(text).errors;
        let messages = errors.iter().map(|error| table_error_message(&error.kind) + "\n");
        expected.assert_eq(&messages.collect::<String>());
    }

    #[test]
    fn each_error_has_its_message() {
        check(
            "a = = 1",
            expect![[r#"
                not TOML: extra `=`, expected nothing
            "#]],
        );
        check(
            "unit = \"min\"\nlevels = 1e-3\nprograms = 1\ncodel = 5\n[[program]]",
            expect![[r#"
                unknown unit `min`: expected "ns", "us", "ms" or "s"
                the levels are a number: expected an array of probabilities, such as [1e-3, 1e-4]
                `programs` is in no section: write its header above it, such as `[codel]`
                `codel` is a number: expected a section `[codel]`
                `program` is an array: expected a section `[program]`
            "#]],
        );
        check(
            "unit = 5\nlevels = [1e-3, 0.001, 0]\n[component]\nA = {}",
            expect![[r#"
                the unit is a number: expected "ns", "us", "ms" or "s"
                a second level 1e-3: remove one, and its column
                not a significance level: expected a probability between 0 and 1, such as 1e-4
                no time for `A`: write one, or remove the entry
            "#]],
        );
        check(
            &format!("levels = [{}]", "1e-3, ".repeat(65)),
            expect![[r#"
            65 levels: at most 64 are read
        "#]],
        );
        check(
            "unit = \"us\"\nlevels = [1e-3, 1e-4]\n[codel]\na.b = 1\n\"a.b\" = 2\nc = [1]\nd = []\ne = -1\nf = inf\n\
             g = 1e40\nh = \"5 ms\"\ni = true\nj = 2026-01-01\nk = [2, 1]\nunit = \"ms\"\n[overhead]\nswitch = 1",
            expect![[r#"
                a second time for `a.b`: remove one of the two entries
                1 value for 2 levels: expected one for each of `levels`
                no value for 2 levels: expected one for each of `levels`
                negative time -1: expected a number of us from 0
                inf is not a time: expected a finite number of us
                1e40 us is too large: the longest time is 584 years
                `5 ms` has a unit: write a number of us; `unit` sets the unit of the table
                expected a number of us, or one for each level; found a boolean
                expected a number of us, or one for each level; found a date
                `k` is 0.002 ms at 1e-3 and only 0.001 ms at 1e-4: a stricter level has no shorter time
                move `unit` before the first section of the table
                unknown overhead `switch`: expected `dispatch` or `context_switch`
            "#]],
        );
        check(
            "levels = [1e-3, 1e-4]\n[codel]\na = [2, 1]\nb = [3, 2]",
            expect![[r#"
                all times are shorter at stricter levels: are `levels` in another order than the times?
            "#]],
        );
        check(
            "levels = [1e-3]\n[codel]\na = [1, 2]\nb = { c = [[1]] }",
            expect![[r#"
                2 values for 1 level: expected one for each of `levels`
                expected a number of ms, or one for each level; found an array
            "#]],
        );
        check(
            "levels = [1e-3, 1e-4]\n[overhead]\ndispatch = [2, 1]",
            expect![[r#"
                the overhead is shorter at a stricter level: a stricter level has no shorter time
            "#]],
        );
        check(
            "[codel]\na = [1]\nb = [{}]",
            expect![[r#"
            1 value but no `levels`: name them, or write one time
        "#]],
        );
    }
}
