//! The messages of the reasons why timing tables, or entries of them, cannot be used.

use mauve_hir::ros2_files::{ExpectedValue, FileProblemKind};
use mauve_hir::{File, ModelDb, toml_key};
use mauve_timing::{Level, ObservedErrorKind};
use mauve_wcrt::{
    LONGEST_PATTERN, PatternError, StrayEntry, TableFault, TableFilesError, TableLevels, Timed, UnusableTime,
    WrongProgram, file_name, table,
};

use super::configuration::{mistake, time_error};
use super::lists::alternatives;
use super::table_error::{kind_name, table_error_message};

/// Returns why an entry of a timing table is unusable.
pub fn unusable_time<'db>(db: &'db dyn ModelDb, unusable: &UnusableTime<'db>) -> String {
    match unusable {
        UnusableTime::Stray(entry, of) => {
            format!(
                "{}: the unknown key `{}` may be that of {}",
                line_of(db, entry),
                entry.key,
                timed(db, of)
            )
        }
        UnusableTime::AmbiguousKey(entry) => {
            format!("{}: the key `{}` is ambiguous", line_of(db, entry), entry.key)
        }
        UnusableTime::WrongProgram(entry, program) => {
            format!("{}: {}", line_of(db, entry), wrong_program(db, program))
        }
        UnusableTime::TwoTimes(of, [first, second]) => {
            let (first, second) = (file_name(db, *first), file_name(db, *second));
            format!("{} has two times, in {first} and {second}", timed(db, of))
        }
        UnusableTime::Refuted(of @ Timed::Wait(_), observed) => {
            format!(
                "a recording showed {observed} for {}: its `[wait]` is missing, too short or of too few `waits`",
                timed(db, of)
            )
        }
        UnusableTime::Refuted(of, observed) => {
            format!("a recording refuted the time of {}: it took {observed}", timed(db, of))
        }
        UnusableTime::Damaged(of, table) => {
            format!("the time of {} in {} has an error", timed(db, of), file_name(db, *table))
        }
        UnusableTime::OtherLevels(of, level, table) => {
            format!("no time for {} at {level}: {}", timed(db, of), table_levels(db, table))
        }
    }
}

/// Returns the table and the line of an entry: `times.toml:4`.
fn line_of(db: &dyn ModelDb, entry: &StrayEntry) -> String {
    let name = file_name(db, entry.table);
    let table = table(db, entry.table);
    let mut entries = table.entries();
    let found = entries.find(|it| it.key == entry.key);
    let before = found.and_then(|it| entry.table.text(db).get(..it.key_span.start));
    match before {
        Some(before) => format!("{name}:{}", before.matches('\n').count() + 1),
        None => name,
    }
}

pub(super) fn timed<'db>(db: &'db dyn ModelDb, of: &Timed<'db>) -> String {
    match of {
        Timed::Codel(codel) => format!("codel `{}`", codel.qualified(db)),
        Timed::Program(component, key) => format!("`{}/{key}`", component.name(db)),
        Timed::Component(component) => format!("component `{}`", component.name(db)),
        Timed::Wait(codel) => format!("the wait of codel `{}`", codel.qualified(db)),
        Timed::Topic(topic) => format!("the topic of `{topic}`"),
        Timed::Access(component, port) => format!("port `{}.{port}`", component.name(db)),
    }
}

/// Returns the message for a component without a program, or with several programs, of a key.
pub(super) fn wrong_program<'db>(db: &'db dyn ModelDb, wrong: &WrongProgram<'db>) -> String {
    let what = if wrong.is_repeated { "several programs" } else { "no program" };
    format!("{} has {what} `{}`", wrong.component.name(db), wrong.program)
}

/// Returns the message with the levels of a table.
pub(super) fn table_levels(db: &dyn ModelDb, table: &TableLevels) -> String {
    let levels: Vec<String> = table.levels.iter().map(Level::to_string).collect();
    format!("{} has the levels {}", file_name(db, table.table), levels.join(", "))
}

/// Returns the message of an error in a table.
pub(super) fn table_fault(db: &dyn ModelDb, fault: &TableFault) -> String {
    match fault {
        TableFault::Configuration(kind) => mistake(kind),
        TableFault::Unreadable(problem) => problem.clone(),
        TableFault::Invalid(kind) => table_error_message(kind),
        TableFault::Files(error) => table_files_error(error),
        TableFault::UnknownDeployment(name) => {
            format!("`[timing.deployment.{}]` names no deployment, and may be for this one", toml_key(name))
        }
        TableFault::AmbiguousDeployment(name) => {
            format!("`[timing.deployment.{}]` names several deployments", toml_key(name))
        }
        TableFault::SecondOverhead(first) => {
            format!("a second [overhead]: the first is in {}", file_name(db, *first))
        }
        TableFault::NoProgramKey(key) => format!("`{key}` is not the key of a program"),
        TableFault::Repeated(key, first) => repeated(db, key, *first),
        TableFault::ManyUnknownKeys(keys) => {
            format!("{keys} unknown keys: this may be a table of another project")
        }
        TableFault::Observed(kind) => observed_error(kind),
        TableFault::Threads(kind) => file_problem(kind),
        TableFault::Throttling => "the throttling of real-time threads is analysed with 950000 us of 1000000 us, or without a limit (`runtime_us: -1`)"
            .to_owned(),
        TableFault::OfOverhead(key) => format!("move `{key}` to [overhead]"),
    }
}

/// Returns the message of a problem in a file of ROS 2.
pub fn file_problem(kind: &FileProblemKind) -> String {
    use FileProblemKind as Kind;
    match kind {
        Kind::Syntax(error) => format!("not YAML: {error}"),
        Kind::TooLarge => "too many values, or too deep: the text behind this is not read".to_owned(),
        Kind::SecondDocument => "a second document: readers disagree whether it counts".to_owned(),
        Kind::UncertainLines => {
            "only some readers take this character for the end of a line: remove it".to_owned()
        }
        Kind::RepeatedKey(key) => format!("a second `{key}`: readers disagree which of the two counts"),
        Kind::UncertainKeys => {
            "a merge key, an alias or a collection as a key: readers disagree on the keys here".to_owned()
        }
        Kind::Alias => "an alias: the reader of parameters refuses the file".to_owned(),
        Kind::WrongKind { key, expected } if key.is_empty() => {
            format!("expected {}", expected_value(expected))
        }
        Kind::WrongKind { key, expected } => {
            format!("invalid `{key}`: expected {}", expected_value(expected))
        }
        Kind::MissingKey(key) => format!("no `{key}`: the executor refuses the file without it"),
        Kind::UnknownKey(key) => format!("the executor ignores the key `{key}`"),
        Kind::UnreadSection(name) => {
            format!(
                "`{name}` does not count: declare what delays activities as `[[platform.other]]` of mauve.toml"
            )
        }
        Kind::RepeatedId(id) => format!("a second entry of `{id}`: which of the two counts is unknown"),
        Kind::UnusualId(id) => format!(
            "no executor has a callback group `{id}`: its ids are `/ns/node@Timer(1000000)@Subscription(/topic)`"
        ),
        Kind::NameAndId => "both `name` and `id`: each version of the executor knows one of them".to_owned(),
        Kind::NiceInPriority => "newer versions of the executor want the nice value in `nice`".to_owned(),
        Kind::InvalidDeadline => "Linux refuses this: 1024 ≤ runtime ≤ deadline ≤ period, in ns".to_owned(),
        Kind::DeprecatedPriority => {
            "newer versions ignore this: move it to `async_parameters.thread_priority`".to_owned()
        }
        Kind::ParametersElsewhere => "parameters in another file are not read: write them here".to_owned(),
    }
}

fn expected_value(expected: &ExpectedValue) -> String {
    match expected {
        ExpectedValue::Mapping => "a mapping, `key: value`".to_owned(),
        ExpectedValue::List => "a list".to_owned(),
        ExpectedValue::Text => "a text that is not empty".to_owned(),
        ExpectedValue::Bool => "`true` or `false`".to_owned(),
        ExpectedValue::Integer(least, most) => {
            format!("an integer from {least} to {most}, in decimal digits")
        }
        ExpectedValue::Cpus => "a list of CPUs from 0 to 127, such as [0, 1]".to_owned(),
        ExpectedValue::OneOf(words) => alternatives(words),
    }
}

/// Returns the message of an error in a file of `[timing] observed`.
fn observed_error(kind: &ObservedErrorKind) -> String {
    match kind {
        ObservedErrorKind::NotToml(error) => format!("not TOML: {error}"),
        ObservedErrorKind::UnknownKey(key) => {
            format!("unknown key `{key}`: `mauve trace import` writes this file")
        }
        ObservedErrorKind::MissingKey(key) => {
            format!("`{key}` is missing: `mauve trace import` writes this file")
        }
        ObservedErrorKind::OfKind { key, expected, found } => {
            format!("`{key}` is {}: expected {expected}", kind_name(*found))
        }
        ObservedErrorKind::UnknownUnit(name) => {
            format!("unknown unit `{name}`: expected `ns`, `us`, `ms` or `s`")
        }
        ObservedErrorKind::InvalidTime { text, error, .. } => {
            format!("`{text}` is not a time: {}", time_error(*error))
        }
    }
}

/// Returns the message for a key that another table has too.
pub(super) fn repeated(db: &dyn ModelDb, key: &str, first: File) -> String {
    format!("a second time for `{key}`: the first is in {}", file_name(db, first))
}

/// Returns the words for the timing tables that figures are from, to be appended: `, times of Sea`; empty for those of `[timing]
/// tables`.
///
/// ```
/// assert_eq!(mauve_diagnostics::times_of(Some("Sea")), ", times of Sea");
/// assert_eq!(mauve_diagnostics::times_of(None), "");
/// ```
pub fn times_of(section: Option<&str>) -> String {
    section.map_or_else(String::new, |section| format!(", times of {section}"))
}

/// Returns the message of an error in a list of tables.
pub(super) fn table_files_error(error: &TableFilesError) -> String {
    match error {
        TableFilesError::Pattern(pattern, error) => {
            let why = match error {
                PatternError::Choice => {
                    "`{` and `[` select between names, and a file may be missing: write a pattern for each name"
                        .to_owned()
                }
                PatternError::TooLong => format!("a pattern has at most {LONGEST_PATTERN} bytes"),
                PatternError::Invalid(error) => format!("this is not a pattern of paths: {error}"),
            };
            // A long pattern is truncated.
            match pattern.char_indices().nth(80) {
                Some((end, _)) => format!("`{}…`: {why}", pattern.get(..end).unwrap_or_default()),
                None => format!("`{pattern}`: {why}"),
            }
        }
        TableFilesError::NoSuchFile(pattern) => format!("no file matches `{pattern}`"),
        TableFilesError::Unreadable(problem) => problem.clone(),
        TableFilesError::NotAllKnown(why) => format!("not all timing tables are known: {why}"),
    }
}
