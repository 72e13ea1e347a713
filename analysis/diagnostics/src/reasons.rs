//! The reasons why a core, an activity or a deployment is not analysed or has no response time, in words: one table.
//!
//! A reason has a message, for diagnostics, explanations and exported files, and a short form for hints.

use mauve_hir::fact::{self, CorePart, CoreReason, Incomplete, MayHide};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, File, ModelDb, Names, Project, declaration_map, features_of, names_of, parse};
use mauve_syntax::{SyntaxError, SyntaxErrorKind, TextRange};
use mauve_timing::{CpuSet, MachineError, NoBoundReason};
use mauve_wcrt::{
    ActivityReport, CallsReason, IncompleteTable, LockReason, NoSuchCpu, Reason, Share, ThreadReason,
    TooLong, UnknownPriority, UnusableTime, file_name,
};

use super::lists::{each_once, enumerated};
use super::table_reasons::{table_fault, table_levels, unusable_time};
use super::{duplicate_activity, duplicate_field, render, unknown_field};

/// A reason in words.
struct ReasonWords {
    message: String,
    /// About 18 characters, and more where names are longer.
    short: String,
}

fn words(message: impl Into<String>, short: impl Into<String>) -> ReasonWords {
    ReasonWords { message: message.into(), short: short.into() }
}

/// Returns the message of a reason.
pub fn timing_reason<'db>(db: &'db dyn ModelDb, reason: &Reason<'db>) -> String {
    in_words(db, reason).message
}

/// Returns a reason in a few words, such as `no time for plan`.
pub fn short_reason<'db>(db: &'db dyn ModelDb, reason: &Reason<'db>) -> String {
    in_words(db, reason).short
}

/// What is said of an activity for which a better method did not end.
pub const EXHAUSTED: &str = "the budget of a better method is exhausted: the response time may be shorter";

fn thread(db: &dyn ModelDb, why: &ThreadReason) -> ReasonWords {
    match why {
        ThreadReason::NoActivity { id, timer, file } => words(
            match timer {
                Some(timer) => format!("`{timer}` of the thread `{id}` may delay it, and has no activity"),
                None => {
                    let file = file_name(db, *file);
                    format!("the thread `{id}` of {file} may delay it, and no activity has it")
                }
            },
            "a thread has no activity",
        ),
        ThreadReason::Deadline => words(
            "its thread has the policy SCHED_DEADLINE, which is not analysed: use SCHED_FIFO",
            "SCHED_DEADLINE",
        ),
        ThreadReason::SharedRoundRobin(priority) => words(
            format!(
                "threads of SCHED_RR with one priority take turns, which is not analysed, and another thread may have its priority of {priority}: use SCHED_FIFO, or other priorities"
            ),
            "SCHED_RR is shared",
        ),
        ThreadReason::Repeated => words("two entries have the id of its thread", "repeated thread"),
    }
}

/// Returns the message of the reason why a core or an architecture is not analysed.
pub fn model_reason<'db>(db: &'db dyn ModelDb, reason: &fact::ModelReason<'db>) -> String {
    of_model(db, reason).message
}

/// Returns the reasons why an activity has no response time, each once: an error may have several locations.
pub fn reasons_of<'db>(db: &'db dyn ModelDb, activity: &ActivityReport<'db>) -> Vec<String> {
    each_once(activity.reasons.iter().map(|it| timing_reason(db, &it.reason)))
}

fn in_words<'db>(db: &'db dyn ModelDb, reason: &Reason<'db>) -> ReasonWords {
    let of = |it: &Decl<'db>, predicate: &str| format!("{} {} {predicate}", it.kind(db), it.name(db));
    let unknown = |project: &Project<'db>, part: &str, of: &str, name: &str| {
        let message = unknown(names_of(db, *project), &format!("the {part} of {of} {name}"));
        words(message, format!("{part} unknown"))
    };
    match reason {
        Reason::Model(reason) => of_model(db, reason),
        Reason::ErrorIn(it, reason) => error_in(db, *it, &of_model(db, reason).message),
        Reason::Stated(text) => words(text, text),

        Reason::DamagedDeployment(it) => {
            let damage = damage(db, *it);
            words(of(it, &format!("has a {damage}: an activity may be missing in it")), damage)
        }
        Reason::DeclaredTwice(it) => {
            words(of(it, "is declared twice"), format!("{} is repeated", it.name(db)))
        }
        Reason::NoArchitecture(it) => {
            words(format!("the architecture of deployment {} is unknown", it.name(db)), "no architecture")
        }
        Reason::ImportsItself(it) => words(of(it, "imports itself"), "import cycle"),
        Reason::DamagedFile { file, problem } => damaged_file(db, *file, problem.as_deref()),
        Reason::IncompleteTables(IncompleteTable { file, error }) => {
            damaged_file(db, *file, Some(&table_fault(db, error)))
        }

        Reason::NoSuchInstance { architecture, instance } => words(
            of(architecture, &format!("has no instance `{instance}`: one may be missing in it")),
            format!("no instance {instance}"),
        ),
        Reason::SecondActivity(instance) => words(duplicate_activity::message(instance), "two activities"),
        Reason::NoActivity => words("it has no activity", "no activity"),
        Reason::UnknownInstance => words("its instance is unknown", "instance unknown"),
        Reason::SeveralInstances => words("several instances have its name", "repeated instance"),
        Reason::UnknownShell { project, component: it } => {
            unknown(project, "shell", "component", it.name(db))
        }
        Reason::UnknownCore { project, component: it } => unknown(project, "core", "component", it.name(db)),
        Reason::UnknownComponent { project, instance } => unknown(project, "component", "instance", instance),
        Reason::DamagedActivity => words("its activity has a syntax error", "syntax error"),
        Reason::UnknownField(name) => words(unknown_field::message(name), format!("unknown {name}")),
        Reason::SecondField { field, instance } => {
            words(duplicate_field::message(*field, instance), format!("repeated {}", field.keyword()))
        }
        Reason::NoField(it) => words(format!("it has no {}", it.keyword()), format!("no {}", it.keyword())),
        Reason::DamagedField(it) => words(format!("its {} has a syntax error", it.keyword()), "syntax error"),
        Reason::UnusableField(it) => {
            words(format!("its {} cannot be used", it.keyword()), format!("invalid {}", it.keyword()))
        }
        Reason::NoSuchCpu(missing) => words(no_such_cpu(*missing), "no such CPU"),
        Reason::Calls(why) => calls(why),
        Reason::Lock(why) => lock(why),
        Reason::MayServe => {
            words("it provides operations, and which connections call them is not known", "calls unknown")
        }

        Reason::Damaged(it) => words(of(it, &format!("has a {}", damage(db, *it))), damage(db, *it)),
        Reason::CoreOfOtherShell(it) => words(
            format!("the core of component {} is for another shell", it.name(db)),
            "core of other shell",
        ),
        Reason::IncompleteShell { project, shell } => incomplete_shell(db, *project, *shell),
        Reason::NoTime(it) => {
            words(format!("no time for codel `{}`", it.qualified(db)), format!("no time for {}", it.name(db)))
        }
        Reason::NoTopicTime(key) => words(
            format!("no time for a sample of a topic: write `[access]` `\"{key}\" = …`, or `[assume] codel`"),
            format!("no time for {key}"),
        ),
        Reason::Middleware(priority) => words(
            format!(
                "threads of Cyclone DDS, with priority {priority}, delay it on a CPU of the gateway, and a flood of samples can make them \
                 execute without end: give the gateway a CPU of its own, or the lowest priority there; or declare \
                 `[[platform.other]]` with `name = \"recv\"`, this priority, the CPUs of the gateway and how much they execute"
            ),
            "middleware has a higher priority",
        ),
        Reason::Thread(why) => thread(db, why),
        Reason::CpusOfHost(host) => words(
            format!(
                "how many CPUs host `{host}` has is not known: add `cpus` to `[host.{host}]`; all hosts have {} together at most",
                CpuSet::MOST
            ),
            "CPUs of a host unknown",
        ),
        Reason::NoHost => words("no host has it: add it to the `activities` of one", "no host"),
        Reason::NoCpuOfHost => words("its host does not have a CPU that it names", "no such CPU"),
        Reason::SeveralHosts => {
            words("the instances of its activity are on several hosts: a thread runs on one", "several hosts")
        }
        Reason::Table(it) => unusable(db, it),
        Reason::ComponentTime(it) => words(unusable_time(db, it), "time unusable"),
        Reason::NoOverhead { level, table } => {
            words(format!("no overhead at {level}: {}", table_levels(db, table)), "overhead unknown")
        }
        Reason::TooLong(what) => words(format!("{} exceeds 584 years", long(what)), "a time is too long"),
        Reason::NoMachine(error) => words(machine_error(*error), "no state machine"),

        Reason::DelayedBy { instances, unknown_priority, .. } => delayed_by(instances, unknown_priority),
        Reason::Overloaded { named, priority, utilisation, .. } => overload(named, *priority, *utilisation),
        Reason::NoBound(why) => no_bound(*why),
    }
}

fn error_in<'db>(db: &'db dyn ModelDb, of: Decl<'db>, why: &str) -> ReasonWords {
    let name = of.name(db);
    words(format!("error in {} {name}: {why}", of.kind(db)), format!("error in {name}"))
}

fn incomplete_shell<'db>(db: &'db dyn ModelDb, project: Project<'db>, shell: Decl<'db>) -> ReasonWords {
    let why = incomplete(features_of(db, project, shell).incomplete(names_of(db, project)));
    let name = shell.name(db);
    words(format!("{} {name} {why}", shell.kind(db)), format!("error in {name}"))
}

fn of_model<'db>(db: &'db dyn ModelDb, reason: &fact::ModelReason<'db>) -> ReasonWords {
    match reason {
        fact::ModelReason::Error(project, fact) => {
            words(render(db, *project, fact).message, "error in the model")
        }
        fact::ModelReason::Core { core, why } => {
            let short = match why {
                CoreReason::SyntaxError(_) => damage(db, *core).to_owned(),
                CoreReason::CodelNotFound(name, _) => format!("no codel {name}"),
                _ => format!("error in {}", core.name(db)),
            };
            words(format!("core {}: {}", core.name(db), core_reason(why, damage(db, *core))), short)
        }
        fact::ModelReason::SyntaxErrorIn(architecture) => {
            let name = architecture.name(db);
            let damage = damage(db, *architecture);
            let message = format!("architecture {name} has a {damage}: an instance may be missing in it");
            words(message, damage)
        }
        fact::ModelReason::TooLarge => words("the project is too large", "project too large"),
        fact::ModelReason::UnknownImport { architecture, import } => {
            let name = architecture.name(db);
            words(format!("architecture {name} imports `{import}`, which is unknown"), "import unknown")
        }
    }
}

/// Returns what is wrong in the text of an incomplete declaration.
fn damage<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> &'static str {
    let range = declaration_map(db, of).map_or_else(TextRange::default, |map| map.range);
    let is_in = |error: &SyntaxError| match error.kind {
        SyntaxErrorKind::Conflict { length, .. } => {
            error.range.start() < range.end() && range.start() < error.range.start() + length
        }
        _ => false,
    };
    if parse(db, of.file(db)).errors().iter().any(is_in) { "merge conflict" } else { "syntax error" }
}

fn core_reason(why: &CoreReason, damage: &str) -> String {
    match why {
        CoreReason::CodelNotFound(name, hides) => {
            format!("codel `{name}` is not found: {}", may_hide(*hides))
        }
        CoreReason::IncompleteShell(why) => format!("its shell {}", incomplete(*why)),
        CoreReason::MayBeDeclared(name) => format!("`{name}` may be declared where there is an error"),
        CoreReason::MayBeOperation(name) => {
            format!("`{name}` may be an operation of its shell, which has an error")
        }
        CoreReason::RepeatedCodel(name) => format!("codel `{name}` is declared twice"),
        CoreReason::SyntaxError(element) => {
            let element = match element {
                CorePart::Core => "it",
                CorePart::Machine => "its state machine",
                CorePart::Transition => "a transition",
                CorePart::Guard => "a guard",
                CorePart::Program => "a program",
            };
            format!("{element} has a {damage}")
        }
        CoreReason::UndefinedOperation(name) => {
            format!("it does not define the operation `{name}`, and calls it")
        }
        CoreReason::UnknownShell => "its shell is unknown".to_owned(),
    }
}

/// Returns the words for a file that cannot be read for this problem, or has a syntax error.
fn damaged_file(db: &dyn ModelDb, file: File, problem: Option<&str>) -> ReasonWords {
    let name = file_name(db, file);
    match problem {
        Some(problem) => words(format!("{name}: {problem}"), format!("{name}: error")),
        None => {
            let conflicts = mauve_syntax::conflicts(file.text(db));
            let damage = if conflicts.is_empty() { "syntax error" } else { "merge conflict" };
            words(
                format!("{name} has a {damage} between its declarations: one of them may be missing"),
                damage,
            )
        }
    }
}

/// Returns the words for an activity that executes operations whose number of calls is unknown or unbounded.
fn calls(why: &CallsReason) -> ReasonWords {
    let (executed, rest, short) = match why {
        CallsReason::NotAnalysed { operation, client } => {
            ((operation, client), "which is not analysed: the number of calls is unknown", "calls unknown")
        }
        CallsReason::ClientWithoutPeriod { operation, client } => {
            ((operation, client), "which has no period: the number of calls has no bound", "calls unbounded")
        }
        CallsReason::NoResponse { operation, client } => (
            (operation, client),
            "and one of the two has no bound on its response time: the number of calls has none",
            "calls unbounded",
        ),
        CallsReason::ReleasedByData { operation, client } => (
            (operation, client),
            "and data releases it, or jobs of other activities in its thread come first: any number of calls may wait for its next job; \
             give it a period and a thread of its own, or let another instance provide the operation",
            "calls unbounded",
        ),
        CallsReason::Ring(operation) => {
            let why = "is executed again by a call that it sends: the number of calls has no bound";
            return words(format!("its operation `{operation}` {why}"), "calls unbounded");
        }
        CallsReason::ManyChains => {
            let why =
                "operations send calls to other operations in more than 4096 ways: simplify the connections";
            return words(why, why);
        }
    };
    let (operation, client) = executed;
    words(format!("it executes the operation `{operation}` for `{client}`, {rest}"), short)
}

/// Returns the words for an activity that a lock delays for an unknown time.
fn lock(why: &LockReason) -> ReasonWords {
    let (message, short) = match why {
        LockReason::UnknownCodel { lock, codel } => (
            format!("the lock `{lock}` names `{codel}`, which no model declares: any codel may take it"),
            "lock unknown",
        ),
        LockReason::Undeclared { codel, lock } => (
            format!("`{codel}` takes the lock `{lock}`, as a recording showed: declare that in mauve.toml"),
            "lock undeclared",
        ),
        LockReason::TwoLocks { codel, locks: [first, second] } => {
            let why = "in an unknown order, and may wait for ever";
            let remedy = "write `protocol = \"ceiling\"` for both, if they are such locks";
            (format!("`{codel}` takes the locks `{first}` and `{second}`, {why}: {remedy}"), "two locks")
        }
        LockReason::WaitsWithLock { codel, lock } => {
            let remedy = format!("release it before, and write `held` in `[locks.{lock}]`");
            (format!("`{codel}` waits while it holds the lock `{lock}`: {remedy}"), "waits with lock")
        }
        LockReason::UnknownTime { lock, holder, because: None } => {
            let remedy = "give its codels times, and fix first what keeps it from being analysed";
            (format!("`{holder}` may hold the lock `{lock}` for an unknown time: {remedy}"), "lock unbounded")
        }
        LockReason::UnknownTime { lock, holder, because: Some(because) } => (
            format!(
                "`{holder}` may hold the lock `{lock}` for an unknown time, since it shares locks with `{because}`, which may hold \
                 them for an unknown time"
            ),
            "lock unbounded",
        ),
        LockReason::TakenWhileThrottled { codel, locks: [first, second], by } => {
            let why = format!(
                "`{by}` may take one of them in the background while real-time threads are throttled"
            );
            let remedy = "switch that off (`kernel.sched_rt_runtime_us = -1`, `rt_throttling = false`)";
            (format!("`{codel}` takes the locks `{first}` and `{second}`, and {why}: {remedy}"), "two locks")
        }
        LockReason::SeveralCpus { lock } => {
            let remedy = "set the `affinity` of all of them to one CPU";
            (format!("the users of the lock `{lock}` may run on several CPUs: {remedy}"), "lock on CPUs")
        }
        LockReason::Migrates { lock } => {
            let why = format!("it may move to the CPU where a lower priority holds the lock `{lock}`");
            (format!("{why}: set its `affinity` to one CPU"), "lock on CPUs")
        }
        LockReason::Inversion { lock, holder, between } if between.is_empty() => (
            format!(
                "`{holder}` holds the lock `{lock}` in the background, where any process may delay it: use a lock with \
                 inheritance, and write `protocol = \"inheritance\"` in `[locks.{lock}]`"
            ),
            "lock unbounded",
        ),
        LockReason::Inversion { lock, holder, between } => {
            let names: Vec<String> = between.iter().map(|name| format!("`{name}`")).collect();
            let (verb, names) = (if names.len() == 1 { "preempts" } else { "preempt" }, enumerated(&names));
            (
                format!(
                    "{names} {verb} `{holder}` while it holds the lock `{lock}`, which has no protocol: use a lock with \
                     inheritance, and write `protocol = \"inheritance\"` in `[locks.{lock}]`"
                ),
                "lock unbounded",
            )
        }
        LockReason::NotPreempted { holder } => (
            format!(
                "`{holder}` of lower priority is not preempted, and how long or how often it delays this activity is unknown: give its \
                 codels times, let it wait for nothing, and run both on one CPU"
            ),
            "not preempted",
        ),
        LockReason::UnknownWaits { lock, waiting } => (
            format!(
                "while `{waiting}` waits, a lower priority may take the lock `{lock}` again, and how often it waits is unknown: \
                 write that in `[wait]`, as in `{{ time = 0.8, waits = 1 }}`; of operations for others, it is never known"
            ),
            "waits unknown",
        ),
    };
    words(message, short)
}

fn unusable<'db>(db: &'db dyn ModelDb, time: &UnusableTime<'db>) -> ReasonWords {
    let short = match time {
        UnusableTime::OtherLevels(_, level, _) => format!("no time at {level}"),
        _ => "time unusable".to_owned(),
    };
    words(unusable_time(db, time), short)
}

fn long(what: &TooLong) -> String {
    match what {
        TooLong::Overhead => "the overhead".to_owned(),
        TooLong::Edge(program) => format!("the time of `{program}`"),
        TooLong::Program => "the time of a program".to_owned(),
    }
}

/// Returns the words for activities that may delay this one and are not analysed.
fn delayed_by(instances: &[Name], unknown: &Option<UnknownPriority>) -> ReasonWords {
    let names: Vec<String> = instances.iter().map(|name| format!("`{name}`")).collect();
    let verb = if names.len() == 1 { "is" } else { "are" };
    let unknown = unknown.as_ref().map_or_else(String::new, |it| format!(", {},", unknown_priority(it)));
    let short = instances.first().map_or_else(|| "others are not".to_owned(), |first| format!("see {first}"));
    words(format!("{}{unknown} may preempt it and {verb} not analysed", enumerated(&names)), short)
}

fn overload(cpu: &str, priority: u32, utilisation: Share) -> ReasonWords {
    let short = format!("{cpu} overloaded ({})", percent(utilisation, "> 100 %"));
    words(overloaded(cpu, priority, utilisation), short)
}

/// Returns the message for a CPU that the activities of this priority or a higher one overload.
pub(super) fn overloaded(cpu: &str, priority: u32, utilisation: Share) -> String {
    format!("{cpu} overloaded ({} at priority ≥ {priority})", percent(utilisation, "more than 100 %"))
}

/// Returns an overload in percent: a slight one would round to 100.0.
fn percent(Share(share): Share, slight: &str) -> String {
    let percent = share * 100.0;
    match (100.0..100.05).contains(&percent) {
        true => slight.to_owned(),
        false => format!("{percent:.1} %"),
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

fn no_bound(why: NoBoundReason) -> ReasonWords {
    let (why, short) = match why {
        NoBoundReason::Budget => {
            ("the search was given up: the utilisation of the CPU is too close to 100 %", "search given up")
        }
        NoBoundReason::Overflow => ("a time exceeds 584 years", "exceeds 584 years"),
        NoBoundReason::FullyLoaded => ("the utilisation of the CPU is exactly 100 %", "CPU fully used"),
        NoBoundReason::SeveralCpus => (
            "on each of its CPUs, the activities of higher or equal priority that may run there have a utilisation of more \
             than 100 %; set `affinity` to fewer CPUs",
            "CPUs overloaded",
        ),
        NoBoundReason::Waits => (
            "with the waits of its codels and of those of higher or equal priority, and with the locks that are held meanwhile, the \
             utilisation of the CPU is more than 100 %; wait in a thread of your own, and give its result to the codel",
            "waits too long",
        ),
    };
    words(format!("no bound found: {why}"), short)
}

/// Returns why a priority is unknown, as a clause after a name.
fn unknown_priority(why: &UnknownPriority) -> String {
    match why {
        UnknownPriority::TwoActivities => "which has two activities",
        UnknownPriority::SeveralInstances => "whose name several instances have",
        UnknownPriority::PriorityAsPeriod => "whose priority may be intended as its period",
        UnknownPriority::AffinityAsPriority => "whose affinity may be intended as its priority",
        UnknownPriority::NoSuchCpu => "whose affinity is invalid and which may therefore run on this CPU",
        UnknownPriority::NoHost => "whose host is unknown and which may therefore run on this CPU",
        UnknownPriority::One => "whose priority is unknown",
        UnknownPriority::Several => "whose priorities are unknown",
        UnknownPriority::SeveralOrCpus => "whose priorities or CPUs are unknown",
    }
    .to_owned()
}

/// Returns the message for an affinity with missing CPUs.
pub(super) fn no_such_cpu(missing: NoSuchCpu) -> String {
    format!("affinity names {}, and mauve.toml has {}", missing.named, missing.available)
}

/// Returns why an operation may be missing, as a predicate of `shell X` or `its shell`.
pub(crate) fn incomplete(why: Incomplete) -> String {
    match why {
        Incomplete::UnknownBase(hides) => format!("extends a shell that is not found: {}", may_hide(hides)),
        Incomplete::Error => "has an error: an operation may be missing in it".to_owned(),
    }
}

/// Returns the message that `what` is unknown, with the possible reason if it is a missing file.
pub(crate) fn unknown(names: &Names<'_>, what: &str) -> String {
    match names.may_hide() {
        hides @ MayHide::MissingFile => format!("{what} is unknown: {}", may_hide(hides)),
        MayHide::SyntaxError => format!("{what} is unknown"),
    }
}

fn may_hide(hides: MayHide) -> &'static str {
    match hides {
        MayHide::MissingFile => "a file that may declare it is missing",
        MayHide::SyntaxError => "a syntax error may hide its declaration",
    }
}
