//! The messages of the reasons why a core or an architecture is not analysed.

use mauve_hir::fact::{CorePart, CoreReason, Incomplete, MayHide, Reason};
use mauve_hir::{ModelDb, Names};

use super::render;

/// Returns the message of a reason.
pub fn reason<'db>(db: &'db dyn ModelDb, reason: &Reason<'db>) -> String {
    match reason {
        Reason::Error(project, fact) => render(db, *project, fact).message,
        Reason::Core { core, why } => format!("core {}: {}", core.name(db), core_reason(why)),
        Reason::SyntaxErrorIn(architecture) => {
            let name = architecture.name(db);
            format!("architecture {name} has a syntax error: an instance may be missing in it")
        }
        Reason::TooLarge => "the project is too large".to_owned(),
        Reason::UnknownImport { architecture, import } => {
            format!("architecture {} imports `{import}`, which is unknown", architecture.name(db))
        }
    }
}

fn core_reason(why: &CoreReason) -> String {
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
            format!("{element} has a syntax error")
        }
        CoreReason::UndefinedOperation(name) => {
            format!("it does not define the operation `{name}`, and calls it")
        }
        CoreReason::UnknownShell => "its shell is unknown".to_owned(),
    }
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
