//! # unresolved-architecture
//!
//! A deployment or an import names an architecture that is not declared.
//!
//! ```mauve
//! architecture Robot { }
//! architecture Explorer { import Robt }   // error
//! deployment D { architecture Robot }
//! ```
//!
//! A name is looked up in its own library, then in the libraries that this library uses (`use nav`). Declarations outside
//! libraries see all libraries.
