//! # not-strongly-connected
//!
//! The state machine cannot return to its initial state from some of its states: the component stays in them until it is
//! stopped. That may be intended, for example in a final state `Stopped`; otherwise add a transition. The response times hold in
//! both cases: the analysis covers every path from the initial state.
//!
//! ```mauve
//! shell S { }
//! core C(S) {
//!   var n: int = 0
//!   statemachine {   // warning
//!     initial state Moving { run = { n = n + 1; }  transition stop if n > 9 to Stopped }
//!     state Stopped { }
//!   }
//! }
//! ```
//!
//! ```mauve
//! shell S { }
//! core D(S) { statemachine { initial state A { transition t to B }  state B { transition t to C }  state C { } } }   // warning
//! core E(S) { statemachine { initial state A { transition t to B }  state B { transition t to A } } }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, initial: &str, states: &[(Name, Location<'db>)]) -> Diagnostic<'db> {
    let names: Vec<&str> = states.iter().map(|(name, _)| name.as_str()).collect();
    let message = format!(
        "the initial state {initial} cannot be reached again from {}: add a transition unless this is intended",
        enumerated(&names)
    );
    let found = Diagnostic::new(&NOT_STRONGLY_CONNECTED, at, message);
    states.iter().fold(found, |found, (_, at)| found.related(at, format!("{initial} cannot be reached from here")))
}
