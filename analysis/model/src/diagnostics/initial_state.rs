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
//! Fixes: mark the first state; leave one of several marked.

use super::*;
use crate::item_tree::{Machine, State};

code!(INITIAL_STATE, Error, "initial-state");

pub(crate) fn none<'db>(of: Decl<'db>, machine: &Machine) -> Diagnostic<'db> {
    let message = "no state of this machine is `initial`: mark the one in which it starts";
    let found = Diagnostic::new(&INITIAL_STATE, Place::Part(of, machine.part), message.to_owned());
    match machine.states.first() {
        Some(first) => {
            let title = format!("Start in `{}`, the first", first.name.name);
            found.fix(title, Place::Part(of, first.start), "initial ".to_owned())
        }
        None => found,
    }
}

const MOST_FIXES: usize = 16;

/// `initial` are the states that are, two or more.
pub(crate) fn several<'db>(of: Decl<'db>, first: &State, second: &State, initial: &[&State]) -> Diagnostic<'db> {
    let (one, other) = (&first.name, &second.name);
    let message = format!("`{}` is initial, and so is `{}`: a machine starts in one state", other.name, one.name);
    let found = Diagnostic::new(&INITIAL_STATE, Place::Part(of, other.part), message);
    let mut found = found.related(Place::Part(of, one.part), "the first is here");
    // Nobody chooses among more.
    let offered = if initial.len() <= MOST_FIXES { initial } else { &[] };
    for state in offered {
        let others = initial.iter().filter(|other| other.start != state.start);
        let edits = others.map(|other| (Place::Part(of, other.start), String::new()));
        found.fixes.push(Fix { title: format!("Start in `{}`", state.name.name), edits: edits.collect() });
    }
    found
}
