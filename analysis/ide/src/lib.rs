//! What an editor or a terminal shows of a model, in plain data: no feature knows who shows it.
//!
//! | file | shows |
//! |---|---|
//! | `inlay_hints.rs` | response times beside activities, and what is left out |
//! | `hover.rs` | what stands under the cursor, and where a response time comes from |
//! | `occurrences.rs` | every name in a text, and what it stands for |
//! | `definition.rs`, `declaration.rs` | where a name is declared, or what it does |
//! | `references.rs` | where a name is used |
//! | `document_symbols.rs` | what a file declares |
//! | `change.rs` | what a rename, a fix or a refactoring replaces |
//! | `explanation.rs` | where a response time comes from, in words |
//! | `project.rs` | which projects a file is part of, and what they are called |
//! | `state_machine.rs` | a component's periodic state machine, as DOT and as SVG |
//!
//! Places are offsets in a file's text. This crate knows no protocol and no terminal.

mod change;
mod declaration;
mod definition;
mod document_symbols;
mod explanation;
#[cfg(test)]
mod fixture;
mod hover;
mod inlay_hints;
mod occurrences;
mod project;
mod references;
mod state_machine;

pub use change::{Change, FileChange};
pub use declaration::declaration;
pub use definition::{Definition, Target, definition};
pub use document_symbols::{Symbol, SymbolKind, document_symbols};
pub use explanation::explain_response;
pub use hover::{Hover, hover};
pub use inlay_hints::{InlayHint, inlay_hints};
pub use references::{Access, Reference, highlights, references};
pub use state_machine::{Drawing, draw_state_machine};
