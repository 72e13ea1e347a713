//! # unresolved-component
//!
//! An instance names a component that is not declared.
//!
//! ```mauve
//! shell S { }
//! core C(S) { update = { } }
//! component Laser(S, C)
//! architecture A {
//!   instance front: Lazer   // error
//!   instance back: Laser
//! }
//! ```
//!
//! A name is looked up in its own library, then in the libraries that this library uses (`use nav`). Declarations outside
//! libraries see all libraries.
