//! # missing-link
//!
//! Data goes from one host to another, and `mauve.toml` does not say how long the network takes: its latency is unknown, so that no
//! chain through it has a bound.
//!
//! ```mauve
//! shell S { output port out: int }
//! shell T { input port into: int }
//! core C(S) { update = { write(out, 1); } }
//! core E(T) { var n: int; update = { read(into, n); } }
//! component Eye(S, C)
//! component Brain(T, E)
//! architecture A {
//!   instance eye: Eye
//!   instance brain: Brain
//!   connection eye.out -> brain.into   // hint
//! }
//! deployment D {
//!   architecture A
//!   activity eye { priority = 1 period = 100 }
//!   activity brain { priority = 1 period = 100 }
//! }
//! //- /mauve.toml
//! [lints]
//! not-analysed = "allow"
//! [ros2]
//! discovery = "subnet"
//! gateway = { priority = 20, period = "1 ms" }
//! [host.eyes]
//! activities = ["eye"]
//! [host.head]
//! activities = ["brain"]
//! ```
//!
//! ```toml
//! [link."eyes-head"]
//! latency = "2 ms"
//! ```

use super::*;
use mauve_hir::fact::Ros2Fact;

pub(super) fn report<'db>(at: Location<'db>, fact: &Ros2Fact) -> Diagnostic<'db> {
    let message = match fact {
        Ros2Fact::NoLink { hosts: [from, to], link } => format!(
            "{link} leads from host `{from}` to host `{to}`, and the latency between them is unknown: no chain through it has a bound; \
             add `[link.{}]` with its `latency` to mauve.toml",
            mauve_hir::toml_key(&format!("{from}-{to}"))
        ),
        _ => String::new(),
    };
    Diagnostic::new(&MISSING_LINK, at, message)
}
