//! # operation-signature
//!
//! A provided operation is connected to a required operation with other parameters or another result type. Connect an
//! operation with the same signature, or change one of the shells.
//!
//! ```mauve
//! shell P { provide plan(in goal: int): bool }
//! shell R { require plan(in goal: int): bool  require go(in goal: double): bool }
//! core CP(P) { provide plan(in goal: int): bool = { return true; }  update = { } }
//! core CR(R) { update = { } }
//! component KP(P, CP)
//! component KR(R, CR)
//! architecture A {
//!   instance p: KP
//!   instance r: KR
//!   operation p.plan -> r.go   // error
//!   operation p.plan -> r.plan
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, [provided, required]: &[String; 2]) -> Diagnostic<'db> {
    let message = format!("different signatures: provided `{provided}`, required `{required}`");
    Diagnostic::new(&OPERATION_SIGNATURE, at, message)
}
