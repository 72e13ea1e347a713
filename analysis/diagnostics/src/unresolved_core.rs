//! # unresolved-core
//!
//! A component names a core that is not declared.
//!
//! ```mauve
//! shell S { }
//! core LaserCore(S) { update = { } }
//! component Laser(S, LaserCor)   // error
//! component Good(S, LaserCore)
//! ```
//!
//! A name is looked up in its own library, then in the libraries that this library uses (`use nav`). Declarations outside
//! libraries see all libraries.
