//! What an editor or a terminal shows of a model, in plain data: no feature knows who shows it.
//!
//! | file | shows |
//! |---|---|
//! | `inlay_hints.rs` | response times beside activities, and what is left out |
//! | `hover.rs` | what stands under the cursor, and where a response time comes from |
//! | `occurrences.rs` | every name in a text, and what it stands for |
//! | `code_lens.rs` | lines above declarations: deadlines that are met, levels, instances, files |
//! | `definition.rs` | where a name is declared |
//! | `document_symbols.rs` | what a file declares |
//! | `code_actions.rs`, `code_actions/` | what can be done about a place: fixes, refactorings |
//! | `change.rs` | what a rename, a fix or a refactoring replaces |
//! | `explanation.rs` | where a response time comes from, in words |
//! | `levels.rs` | the significance levels that may be shown |
//! | `project.rs` | which projects a file is part of, and what they are called |
//! | `timing_actions.rs` | other priorities, CPUs and periods, with what they give |
//! | `state_machine.rs` | a component's periodic state machine, as DOT and as SVG |
//!
//! Places are offsets in a file's text. This crate knows no protocol and no terminal.

mod change;
mod code_actions;
mod code_lens;
mod definition;
mod document_symbols;
mod explanation;
#[cfg(test)]
mod fixture;
mod hover;
mod inlay_hints;
mod levels;
mod occurrences;
mod project;
mod state_machine;
mod timing_actions;

pub use change::{Change, FileChange};
pub use code_actions::{ActionKind, ActionQuestion, Changes, CodeAction, code_actions};
pub use code_lens::{CodeLens, Lens, LensAction, LensKind, code_lens_at, code_lenses, resolve_code_lens};
pub use definition::{Definition, Target, definition};
pub use document_symbols::{Symbol, SymbolKind, document_symbols};
pub use explanation::explain_response;
pub use hover::{Hover, hover};
pub use inlay_hints::{InlayHint, inlay_hints};
pub use levels::known_levels;
pub use state_machine::{Drawing, draw_state_machine};
