//! # initial-state
//!
//! A state machine starts in exactly one state: one of its states is `initial`.
//!
//! ```mauve
//! shell S { }
//! core None(S) {
//!   statemachine { state Waiting { } }   // error
//! }
//! core Several(S) {
//!   statemachine {
//!     initial state Waiting { }
//!     initial state Moving { }   // error
//!   }
//! }
//! ```
//!
//! Fixes: mark the first state as initial; keep the mark of one of several.

use super::*;

pub(super) fn none<'db>(at: Location<'db>, first: Option<&(Name, SourceId)>) -> Diagnostic<'db> {
    let message = "no state of this machine is `initial`: write `initial` before the state in which it starts";
    let found = Diagnostic::new(&INITIAL_STATE, at.clone(), message);
    match first {
        Some((first, start)) => {
            let title = format!("Start in `{first}`, the first");
            found.fix(title, beside(&at, *start), "initial ".to_owned())
        }
        None => found,
    }
}

const MOST_FIXES: usize = 16;

/// `initial`: the initial states, two or more.
pub(super) fn several<'db>(
    at: Location<'db>,
    (one, id): &(Name, SourceId),
    other: &str,
    initial: &[(Name, SourceId)],
) -> Diagnostic<'db> {
    let message = format!("both `{one}` and `{other}` are initial: a machine starts in one state");
    let found = Diagnostic::new(&INITIAL_STATE, at.clone(), message);
    let mut found = found.related(&beside(&at, *id), "the first is here");
    // More fixes make the menu too long.
    let offered = if initial.len() <= MOST_FIXES { initial } else { &[] };
    for (name, start) in offered {
        let others = initial.iter().filter(|(_, other)| other != start);
        let edits = others.map(|(_, other)| (beside(&at, *other), String::new()));
        found.fixes.push(Fix { title: format!("Start in `{name}`"), edits: edits.collect() });
    }
    found
}
