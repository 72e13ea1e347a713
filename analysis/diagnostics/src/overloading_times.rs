//! # overloading-times
//!
//! With the times of this timing table, the utilisation of a CPU exceeds 100 %, so that activities of a deployment have no bounded
//! response time. The error is at the deployment; this message shows it to those who write the table, with the deployments that use it.
//!
//! ```mauve
//! codel work(): int
//! shell S { }
//! core C(S) { update = { work(); } }
//! component Imu(S, C)
//! architecture A { instance imu: Imu }
//! deployment D {
//!   architecture A
//!   activity imu { priority = 2 period = 4 }   // error
//! }
//! //- /mauve.toml
//! [timing]
//! tables = ["imu.toml"]
//! //- /imu.toml
//! [codel]
//! work = 220   # warning
//! ```
//!
//! Check the unit of the table, measure the codels again, or lengthen the periods of the deployment.

use super::*;
use mauve_wcrt::{Overload, TimingFact, TimingFactKind};

/// Returns the diagnostic in the table for that of an overload of a deployment. Several deployments have one message.
pub(super) fn in_table<'db>(
    db: &'db dyn ModelDb,
    deployment: Decl<'db>,
    fact: &TimingFact<'db>,
    overloaded: &Diagnostic<'db>,
) -> Option<Diagnostic<'db>> {
    let TimingFactKind::Overloaded(Overload { table: Some(at), .. }) = &fact.kind else { return None };
    let (message, cause) = (&overloaded.message, Cause::Overload(at.file(db)));
    let message = format!("with these times, `{}` is overloaded: {message}", deployment.name(db));
    let found = Diagnostic::new(&OVERLOADING_TIMES, at.clone(), message.clone()).related(&overloaded.at, message);
    Some(Diagnostic { accepted: overloaded.accepted.clone(), ..found }.caused_by(Some(cause)))
}
