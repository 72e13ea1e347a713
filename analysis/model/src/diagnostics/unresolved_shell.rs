//! # unresolved-shell
//!
//! A core, a component or another shell names a shell that is not declared.
//!
//! ```mauve
//! shell LaserShell { }
//! core LaserCore(LasrShell) { update = { } }   // error
//! core Good(LaserShell) { update = { } }
//! ```
//!
//! A name is looked up in its own library, then in the libraries that it uses (`use nav`). What stands outside any
//! library sees everything.

use super::*;

code!(UNRESOLVED_SHELL, Error, "unresolved-shell");
