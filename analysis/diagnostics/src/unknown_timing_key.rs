//! # unknown-timing-key
//!
//! A timing table has a time for something that no model of the workspace declares, or that several do. Keys are
//! `library.codel` or `codel`; `Component/update`, `Component/state.run`, `Component/state.transition.guard`,
//! `Component/state.transition.effect`, `Component/operation`; `Component`.
//!
//! ```mauve
//! codel plan(): int
//! codel land(): int
//! //- /mauve.toml
//! timing.tables = ["times.toml"]
//! //- /times.toml
//! [codel]
//! land = 1
//! plna = 2   # warning
//! ```
//!
//! An entry that means nothing may be a misspelt one that makes something longer. So a component with an unknown program
//! is not analysed; nothing is, while the component of a program is unknown; an unknown component keeps the classic
//! method from those that have no time as a whole; what is unknown keeps codels without a time from being assumed to take
//! that of `[assume]`; an unknown codel keeps those of the same name in other libraries from being analysed; and
//! `dispatch` and `context_switch` outside `[overhead]` say that its header was lost: nothing is analysed.

use super::*;
use mauve_hir::ProgramKey;
use mauve_wcrt::WrongProgram;

code!(UNKNOWN_TIMING_KEY, Warning, "unknown-timing-key");

/// `fixed`: the corrected key, for a fix that replaces this one.
pub(super) fn report<'db>(
    at: Location<'db>,
    kind: Kind,
    key: &str,
    near: Option<&Name>,
    fixed: Option<&str>,
) -> Diagnostic<'db> {
    if ProgramKey::parse(key).is_some() {
        let message = format!("`{key}` is the key of a program: it belongs under [program]");
        return Diagnostic::new(&UNKNOWN_TIMING_KEY, at, message);
    }
    unknown(at, &format!("no {kind} `{key}`"), near, fixed)
}

/// See [`report`] for `fixed`.
pub(super) fn of_program<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    wrong: &WrongProgram<'db>,
    near: Option<&Name>,
    fixed: Option<&str>,
) -> Diagnostic<'db> {
    unknown(at, &timing_reasons::wrong_program(db, wrong), near, fixed)
}

fn unknown<'db>(at: Location<'db>, what: &str, near: Option<&Name>, fixed: Option<&str>) -> Diagnostic<'db> {
    let near = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    let found = Diagnostic::new(&UNKNOWN_TIMING_KEY, at.clone(), format!("{what}{near}"));
    match fixed {
        Some(fixed) => found.fix(format!("Change to `{fixed}`"), at, format!("\"{fixed}\"")),
        None => found,
    }
}

pub(super) fn ambiguous<'db>(at: Location<'db>, key: &str, hint: &str) -> Diagnostic<'db> {
    let message = format!("`{key}` means several: write the library before it, as in `{hint}`");
    Diagnostic::new(&UNKNOWN_TIMING_KEY, at, message)
}
