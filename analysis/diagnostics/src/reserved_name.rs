//! # reserved-name
//!
//! The name is a word of C++, or one that generated components have a use of their own for: ports `state` and `tick`,
//! properties `period`, `priority`, `deadline`, `affinity`, `shell`, `core` and `statemachine`. Generated code gives it
//! another name.
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

code!(RESERVED_NAME, Hint, "reserved-name");

pub(super) fn report<'db>(at: Location<'db>, name: &str, is: Reserved) -> Diagnostic<'db> {
    let of = match is {
        Reserved::Cpp => "a word of C++",
        Reserved::GeneratedPort => "a port that generated components have",
        Reserved::GeneratedProperty => "a property that generated components have",
    };
    Diagnostic::new(&RESERVED_NAME, at, format!("`{name}` is {of}: in generated code this has another name"))
}
