//! The messages of the reasons why a system is not analysed, or an activity has no response time.

use mauve_timing::{CpuLoad, Level, MachineError, NoBoundReason};

use super::configuration::mistake;
use super::lists::{cpu_names, enumerated};
use super::reasons;
use super::table_error::table_error_message;
use mauve_hir::{File, ModelDb, features_of, names_of, toml_key};
use mauve_wcrt::{
    ActivityReport, IncompleteTable, LONGEST_PATTERN, NoSuchCpu, PatternError, Prose, Reason, Share,
    StrayEntry, TableFault, TableFilesError, TableLevels, Timed, TooLong, UnknownPriority, UnusableTime,
    WrongProgram, file_name, table,
};

/// The messages of reasons in exported files.
pub const PROSE: Prose = Prose { reason: timing_reason, unknown_priority };

/// Returns the message of a reason.
pub fn timing_reason<'db>(db: &'db dyn ModelDb, reason: &Reason<'db>) -> String {
    match reason {
        Reason::Model(reason) => reasons::reason(db, reason),
        Reason::ErrorIn(of, reason) => {
            format!("error in {} {}: {}", of.kind(db), of.name(db), reasons::reason(db, reason))
        }
        Reason::Stated(text) => text.clone(),

        Reason::DamagedDeployment(of) => {
            format!("deployment {} has a syntax error: an activity may be missing in it", of.name(db))
        }
        Reason::DeclaredTwice(of) => {
            format!("deployment {} is declared twice", of.name(db))
        }
        Reason::NoArchitecture(of) => {
            format!("the architecture of deployment {} is unknown", of.name(db))
        }
        Reason::ImportsItself(of) => format!("architecture {} imports itself", of.name(db)),
        Reason::DamagedFile { file, problem: Some(problem) } => {
            format!("{}: {problem}", file_name(db, *file))
        }
        Reason::DamagedFile { file, problem: None } => {
            let name = file_name(db, *file);
            format!("{name} has a syntax error between its declarations: one of them may be missing")
        }
        Reason::IncompleteTables(IncompleteTable { file, error }) => {
            format!("{}: {}", file_name(db, *file), table_fault(db, error))
        }

        Reason::NoSuchInstance { architecture, instance } => {
            let architecture = architecture.name(db);
            format!("architecture {architecture} has no instance `{instance}`: one may be missing in it")
        }
        Reason::SecondActivity(instance) => super::duplicate_activity::message(instance),
        Reason::NoActivity => "it has no activity".to_owned(),
        Reason::UnknownInstance => "its instance is unknown".to_owned(),
        Reason::SeveralInstances => "several instances have its name".to_owned(),
        Reason::UnknownShell { project, component } => reasons::unknown(
            names_of(db, *project),
            &format!("the shell of component {}", component.name(db)),
        ),
        Reason::UnknownCore { project, component } => {
            reasons::unknown(names_of(db, *project), &format!("the core of component {}", component.name(db)))
        }
        Reason::UnknownComponent { project, instance } => {
            reasons::unknown(names_of(db, *project), &format!("the component of instance {instance}"))
        }
        Reason::DamagedActivity => "its activity has a syntax error".to_owned(),
        Reason::UnknownField(name) => super::unknown_field::message(name),
        Reason::SecondField { field, instance } => super::duplicate_field::message(*field, instance),
        Reason::NoField(field) => format!("it has no {}", field.keyword()),
        Reason::DamagedField(field) => format!("its {} has a syntax error", field.keyword()),
        Reason::UnusableField(field) => format!("its {} cannot be used", field.keyword()),
        Reason::NoSuchCpu(missing) => no_such_cpu(*missing),
        Reason::UnknownCalls { operation, client } => format!(
            "it executes the operation `{operation}` for `{client}`, which is not analysed: the number of calls is unknown"
        ),
        Reason::ClientWithoutPeriod { operation, client } => format!(
            "it executes the operation `{operation}` for `{client}`, which has no period: the number of calls has no bound"
        ),
        Reason::NoResponse { operation, client } => format!(
            "it executes the operation `{operation}` for `{client}`, and one of the two has no bound on its response time: the \
             number of calls has none"
        ),
        Reason::OperationRing(operation) => format!(
            "its operation `{operation}` is executed again by a call that it sends: the number of calls has no bound"
        ),
        Reason::ManyOperations => {
            "operations send calls to other operations in more than 4096 ways: simplify the connections"
                .to_owned()
        }
        Reason::MayServe => "it provides operations, and which connections call them is not known".to_owned(),

        Reason::Damaged(of) => format!("{} {} has a syntax error", of.kind(db), of.name(db)),
        Reason::CoreOfOtherShell(of) => format!("the core of component {} is for another shell", of.name(db)),
        Reason::IncompleteShell { project, shell } => {
            let why =
                reasons::incomplete(features_of(db, *project, *shell).incomplete(names_of(db, *project)));
            format!("shell {} {why}", shell.name(db))
        }
        Reason::NoTime(codel) => format!("no time for codel `{}`", codel.qualified(db)),
        Reason::Table(unusable) | Reason::ComponentTime(unusable) => unusable_time(db, unusable),
        Reason::NoOverhead { level, table } => format!("no overhead at {level}: {}", table_levels(db, table)),
        Reason::TooLong(what) => match what {
            TooLong::Overhead => "the overhead exceeds 584 years".to_owned(),
            TooLong::Edge(program) => format!("the time of `{program}` exceeds 584 years"),
            TooLong::Program => "the time of a program exceeds 584 years".to_owned(),
        },
        Reason::NoMachine(error) => machine_error(*error),

        Reason::DelayedBy { instances, unknown_priority: unknown, .. } => {
            let names: Vec<String> = instances.iter().map(|name| format!("`{name}`")).collect();
            let verb = if names.len() == 1 { "is" } else { "are" };
            let unknown =
                unknown.as_ref().map_or_else(String::new, |it| format!(", {},", unknown_priority(it)));
            format!("{}{unknown} may preempt it and {verb} not analysed", enumerated(&names))
        }
        Reason::Overloaded { cpu, priority, utilisation } => overloaded(*cpu, *priority, *utilisation),
        Reason::NoBound(why) => format!("no bound found: {}", no_bound(*why)),
    }
}

/// Returns the message for a CPU that the activities of this priority or a higher one overload.
pub(super) fn overloaded(cpu: u64, priority: u32, utilisation: Share) -> String {
    format!("{} overloaded ({} at priority ≥ {priority})", cpu_names(cpu), percent(utilisation))
}

/// Returns an overload in percent: a slight one would round to 100.0.
fn percent(Share(share): Share) -> String {
    let percent = share * 100.0;
    match (100.0..100.05).contains(&percent) {
        true => "more than 100 %".to_owned(),
        false => format!("{percent:.1} %"),
    }
}

/// Returns the utilisation of a CPU: `62.0 %`. That of several CPUs together: `131.0 % of 200 %`.
pub fn utilisation(load: &CpuLoad) -> String {
    let percent = format!("{:.1} %", load.utilisation.as_f64() * 100.0);
    match load.mask.count_ones() {
        0 | 1 => percent,
        cpus => format!("{percent} of {cpus}00 %"),
    }
}

/// Returns why edges make no state machine.
pub(super) fn machine_error(error: MachineError) -> String {
    match error {
        MachineError::NoState => "a state machine has at least one state".to_owned(),
        MachineError::NoSuchState { edge } => {
            format!("edge {edge} starts or ends at a state that is not there")
        }
        MachineError::DeadEnd { state } => format!("state {state} has no outgoing edge"),
        MachineError::TooLarge => "the state machine is too large, or its times are too long".to_owned(),
    }
}

fn no_bound(why: NoBoundReason) -> &'static str {
    match why {
        NoBoundReason::Budget => "the search was given up: the utilisation of the CPU is too close to 100 %",
        NoBoundReason::Overflow => "a time exceeds 584 years",
        NoBoundReason::FullyLoaded => "the utilisation of the CPU is exactly 100 %",
        NoBoundReason::SeveralCpus => {
            "on each of its CPUs, the activities of higher or equal priority that may run there have a utilisation of more \
             than 100 %; set `affinity` to fewer CPUs"
        }
    }
}

/// Returns the reasons why an activity has no response time, each once: an error may have several locations.
pub fn reasons_of<'db>(db: &'db dyn ModelDb, activity: &ActivityReport<'db>) -> Vec<String> {
    let mut reasons: Vec<String> = Vec::new();
    for reason in activity.reasons.iter().map(|it| timing_reason(db, &it.reason)) {
        if !reasons.contains(&reason) {
            reasons.push(reason);
        }
    }
    reasons
}

/// Returns why a priority is unknown, as a clause after a name.
fn unknown_priority(why: &UnknownPriority) -> String {
    match why {
        UnknownPriority::TwoActivities => "which has two activities",
        UnknownPriority::SeveralInstances => "whose name several instances have",
        UnknownPriority::PriorityAsPeriod => "whose priority may be intended as its period",
        UnknownPriority::AffinityAsPriority => "whose affinity may be intended as its priority",
        UnknownPriority::NoSuchCpu => "whose affinity is invalid and which may therefore run on this CPU",
        UnknownPriority::Stated(text) => text,
        UnknownPriority::One => "whose priority is unknown",
        UnknownPriority::Several => "whose priorities are unknown",
        UnknownPriority::SeveralOrCpus => "whose priorities or CPUs are unknown",
    }
    .to_owned()
}

/// Returns the message for an affinity with missing CPUs.
pub(super) fn no_such_cpu(missing: NoSuchCpu) -> String {
    format!(
        "affinity names {}, and mauve.toml has {}",
        cpu_names(missing.named),
        cpu_names(missing.available)
    )
}

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
    let mut entries = table.codels.iter().chain(&table.programs).chain(&table.components);
    let found = entries.find(|it| it.key == entry.key);
    let before = found.and_then(|it| entry.table.text(db).get(..it.key_span.start));
    match before {
        Some(before) => format!("{name}:{}", before.matches('\n').count() + 1),
        None => name,
    }
}

fn timed<'db>(db: &'db dyn ModelDb, of: &Timed<'db>) -> String {
    match of {
        Timed::Codel(codel) => format!("codel `{}`", codel.qualified(db)),
        Timed::Program(component, key) => format!("`{}/{key}`", component.name(db)),
        Timed::Component(component) => format!("component `{}`", component.name(db)),
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
        TableFault::OfOverhead(key) => format!("move `{key}` to [overhead]"),
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
