//! # reserved-name
//!
//! A name is a keyword of C++, or generated components already use it: for their ports `state` and `tick`, and their
//! properties `period`, `priority`, `deadline`, `affinity`, `shell`, `core` and `statemachine`. Generated code adds `_` to the
//! name. Rename it if C++ code or scripts refer to it.
//!
//! ```mauve
//! codel delete(in n: int): void   // hint
//! shell S {
//!   input port state: int   // hint
//!   property period: int = 1   // hint
//!   property state: int = 1
//! }
//! ```

use super::*;
use mauve_hir::fact::Reserved;

pub(super) fn report<'db>(at: Location<'db>, name: &str, is: Reserved) -> Diagnostic<'db> {
    let of = match is {
        Reserved::Cpp => "a keyword of C++",
        Reserved::GeneratedPort => "a port of every generated component",
        Reserved::GeneratedProperty => "a property of every generated component",
    };
    Diagnostic::new(&RESERVED_NAME, at, format!("`{name}` is {of}: generated code uses another name for it"))
}
