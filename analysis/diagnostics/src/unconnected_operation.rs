//! # unconnected-operation
//!
//! A deployed instance requires an operation, but the architecture connects no provider: every call fails at run time.
//! Connect one with `operation PROVIDER.name -> INSTANCE.name`.
//!
//! ```mauve
//! shell P { provide plan(): bool }
//! shell R { require plan(): bool }
//! core CP(P) { provide plan() = { return true; }  update = { } }
//! core CR(R) { handler h: plan  update = { h = send(plan); collect(h); } }
//! component KP(P, CP)
//! component KR(R, CR)
//! architecture A { instance p: KP  instance near: KR  instance far: KR  operation p.plan -> near.plan }
//! deployment D {
//!   architecture A
//!   activity p { priority = 9 period = 10 affinity = 1 }
//!   activity near { priority = 8 period = 10 affinity = 1 }
//!   activity far { priority = 7 period = 10 affinity = 1 }   // warning
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, instance: &str, name: &str, declared: &Location<'db>) -> Diagnostic<'db> {
    let message = format!(
        "required operation `{name}` of `{instance}` is not connected: add `operation ….… -> {instance}.{name}`"
    );
    Diagnostic::new(&UNCONNECTED_OPERATION, at, message).related(declared, "required here")
}
