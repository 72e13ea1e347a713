//! # not-strongly-connected
//!
//! From some states the machine never gets back to where it began (Property 4 of the paper asks for that). It may be meant: a
//! robot that stops for good. The analysis takes it as it is: every path from the initial state counts, also those that
//! lead where there is no way back, so that the bound holds before and after.
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

code!(NOT_STRONGLY_CONNECTED, Warning, "not-strongly-connected");

pub(super) fn report<'db>(at: Location<'db>, initial: &str, states: &[(Name, Location<'db>)]) -> Diagnostic<'db> {
    let names: Vec<&str> = states.iter().map(|(name, _)| name.as_str()).collect();
    let message = format!(
        "no way leads back to {initial} from {}: the analysis counts every path, with those that end there",
        enumerated(&names)
    );
    let found = Diagnostic::new(&NOT_STRONGLY_CONNECTED, at, message);
    states.iter().fold(found, |found, (_, at)| found.related(at, format!("no way back to {initial}")))
}
