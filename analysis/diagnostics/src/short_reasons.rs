//! The reasons why there is no response time, in few words: for hints. The messages of `timing_reasons.rs` say more.

use mauve_hir::ModelDb;
use mauve_hir::fact::{self, CoreReason};
use mauve_timing::NoBoundReason;
use mauve_wcrt::{IncompleteTable, Reason, Share, UnusableTime, file_name};

use super::{cpu_names, timing_reason};

/// Returns a reason in a few words, such as `no time for plan`. It is about 18 characters long, and longer where names are.
pub fn short_reason<'db>(db: &'db dyn ModelDb, reason: &Reason<'db>) -> String {
    match reason {
        Reason::NoTime(codel) => format!("no time for {}", codel.name(db)),
        Reason::DelayedBy { instances, .. } => match instances.as_slice() {
            [] => "others are not".to_owned(),
            [first, ..] => format!("see {first}"),
        },
        Reason::Overloaded { cpu, utilisation, .. } => {
            format!("{} overloaded ({})", cpu_names(*cpu), percent(*utilisation))
        }
        Reason::NoBound(why) => no_bound(*why).to_owned(),

        Reason::Model(reason) => of_model(db, reason),
        Reason::ErrorIn(of, _) => format!("error in {}", of.name(db)),
        Reason::Stated(_) | Reason::ManyOperations => timing_reason(db, reason),
        Reason::DamagedDeployment(_)
        | Reason::DamagedActivity
        | Reason::DamagedField(_)
        | Reason::Damaged(_)
        | Reason::DamagedFile { problem: None, .. } => "syntax error".to_owned(),
        Reason::DamagedFile { file, problem: Some(_) }
        | Reason::IncompleteTables(IncompleteTable { file, .. }) => {
            format!("{}: error", file_name(db, *file))
        }

        Reason::DeclaredTwice(of) => format!("{} is repeated", of.name(db)),
        Reason::NoArchitecture(_) => "no architecture".to_owned(),
        Reason::ImportsItself(_) => "import cycle".to_owned(),
        Reason::NoSuchInstance { instance, .. } => format!("no instance {instance}"),
        Reason::SecondActivity(_) => "two activities".to_owned(),
        Reason::NoActivity => "no activity".to_owned(),
        Reason::UnknownInstance => "instance unknown".to_owned(),
        Reason::SeveralInstances => "repeated instance".to_owned(),
        Reason::UnknownShell { .. } => "shell unknown".to_owned(),
        Reason::UnknownCore { .. } => "core unknown".to_owned(),
        Reason::UnknownComponent { .. } => "component unknown".to_owned(),
        Reason::CoreOfOtherShell(_) => "core of other shell".to_owned(),
        Reason::IncompleteShell { shell, .. } => format!("error in {}", shell.name(db)),
        Reason::UnknownField(name) => format!("unknown {name}"),
        Reason::SecondField { field, .. } => format!("repeated {}", field.keyword()),
        Reason::NoField(field) => format!("no {}", field.keyword()),
        Reason::UnusableField(field) => format!("invalid {}", field.keyword()),
        Reason::NoSuchCpu(_) => "no such CPU".to_owned(),

        Reason::UnknownCalls { .. } | Reason::MayServe => "calls unknown".to_owned(),
        Reason::ClientWithoutPeriod { .. } | Reason::NoResponse { .. } | Reason::OperationRing(_) => {
            "calls unbounded".to_owned()
        }
        Reason::Table(UnusableTime::OtherLevels(_, level, _)) => format!("no time at {level}"),
        Reason::Table(_) | Reason::ComponentTime(_) => "time unusable".to_owned(),
        Reason::NoOverhead { .. } => "overhead unknown".to_owned(),
        Reason::TooLong(_) => "a time is too long".to_owned(),
        Reason::NoMachine(_) => "no state machine".to_owned(),
    }
}

fn of_model(db: &dyn ModelDb, reason: &fact::Reason<'_>) -> String {
    match reason {
        fact::Reason::Error(..) => "error in the model".to_owned(),
        fact::Reason::Core { why: CoreReason::SyntaxError(_), .. } | fact::Reason::SyntaxErrorIn(_) => {
            "syntax error".to_owned()
        }
        fact::Reason::Core { why: CoreReason::CodelNotFound(name, _), .. } => format!("no codel {name}"),
        fact::Reason::Core { core, .. } => format!("error in {}", core.name(db)),
        fact::Reason::TooLarge => "project too large".to_owned(),
        fact::Reason::UnknownImport { .. } => "import unknown".to_owned(),
    }
}

fn no_bound(why: NoBoundReason) -> &'static str {
    match why {
        NoBoundReason::Budget => "search given up",
        NoBoundReason::Overflow => "exceeds 584 years",
        NoBoundReason::FullyLoaded => "CPU fully used",
        NoBoundReason::SeveralCpus => "CPUs overloaded",
    }
}

/// Returns an overload in percent: a slight one would round to 100.0.
fn percent(Share(share): Share) -> String {
    let percent = share * 100.0;
    if (100.0..100.05).contains(&percent) { "> 100 %".to_owned() } else { format!("{percent:.1} %") }
}
