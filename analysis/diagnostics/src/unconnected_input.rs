//! # unconnected-input
//!
//! An input port of a deployed instance has no connection in the architecture: `read` never gets a value from the model. That
//! may be intended: in generated code, a ROS topic feeds such a port.
//!
//! ```mauve
//! shell S { input port near: int  input port far: int  output port way: int }
//! core C(S) { update = { } }
//! component K(S, C)
//! architecture A { instance a: K  instance b: K  connection a.way -> b.near  connection a.way -> b.far }
//! deployment D {
//!   architecture A
//!   activity a { priority = 2 period = 10 }   // hint
//!   activity b { priority = 1 period = 10 }
//! }
//! ```

use super::*;

pub(super) fn report<'db>(at: Location<'db>, instance: &str, ports: &[Name]) -> Diagnostic<'db> {
    let names: Vec<String> = ports.iter().map(|port| format!("`{port}`")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (what, verb) = if ports.len() == 1 { ("input port", "has") } else { ("input ports", "have") };
    let message = format!("{what} {} of `{instance}` {verb} no connection", enumerated(&names));
    Diagnostic::new(&UNCONNECTED_INPUT, at, message)
}
