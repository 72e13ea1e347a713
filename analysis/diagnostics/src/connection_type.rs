//! # connection-type
//!
//! A connection's output port and input port have different types. Values are not converted on the way: declare both
//! ports with the same type, or connect another port.
//!
//! ```mauve
//! shell S { output port scan: int  input port near: bool  input port far: int }
//! core C(S) { update = { } }
//! component K(S, C)
//! architecture A {
//!   instance a: K
//!   instance b: K
//!   connection a.scan -> b.near   // error
//!   connection a.scan -> b.far
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, ends: &[(String, Type, Location<'db>); 2]) -> Diagnostic<'db> {
    let [(from, source, source_at), (to, target, target_at)] = ends;
    let (source, target) = (type_name(source), type_name(target));
    let message = format!("ports of different types: `{from}` is {source}, `{to}` is {target}");
    Diagnostic::new(&CONNECTION_TYPE, at, message)
        .related(source_at, format!("declared as {source} here"))
        .related(target_at, format!("declared as {target} here"))
}
