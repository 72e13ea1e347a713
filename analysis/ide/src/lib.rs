//! What an editor or a terminal shows of a model, in plain data: no feature knows who shows it.
//!
//! | file | shows |
//! |---|---|
//! | `inlay_hints.rs` | response times beside activities, and what is left out |
//! | `hover.rs` | what stands under the cursor, and where a response time comes from |
//! | `markdown.rs` | texts that may have come from a stranger, in a hover: comments, names of files |
//! | `occurrences.rs` | every name in a text, and what it stands for |
//! | `code_lens.rs` | lines above declarations: deadlines that are met, levels, instances, files |
//! | `definition.rs`, `declaration.rs` | where a name is declared, or what it does |
//! | `type_definition.rs`, `implementation.rs` | where its type is declared, and what makes it happen |
//! | `call_hierarchy.rs`, `type_hierarchy.rs` | who calls whom, and which shells extend which |
//! | `hierarchy.rs` | how what is in them is found again after an edit |
//! | `references.rs` | where a name is used |
//! | `rename.rs`, `rename/`, `rename_files.rs` | what another name for something, or for a file, changes |
//! | `document_symbols.rs` | what a file declares |
//! | `workspace_symbols.rs` | the declarations of all files that a few letters may mean |
//! | `document_links.rs` | the files that a file names |
//! | `folding_ranges.rs`, `selection_ranges.rs` | what can be folded; what belongs together around the cursor |
//! | `semantic_tokens.rs` | what each name is, for colours |
//! | `formatting.rs` | white space as it should be |
//! | `code_actions.rs`, `code_actions/` | what can be done about a place: fixes, refactorings |
//! | `completion.rs`, `completion/` | what may stand where the cursor is |
//! | `signature_help.rs` | what a call takes, while its arguments are typed |
//! | `program.rs` | signatures of what programs call, and what is expected behind a half-typed token |
//! | `change.rs` | what a rename, a fix or a refactoring replaces |
//! | `explanation.rs` | where a response time comes from, in words |
//! | `levels.rs` | the significance levels that may be shown |
//! | `project.rs` | which projects a file is part of, and what they are called |
//! | `drawing.rs` | what drawings in DOT and SVG have in common |
//! | `graph.rs` | an architecture as a graph, with load and response times, as DOT and as SVG |
//! | `machine_view.rs` | a component's state machine with its places, for a panel |
//! | `timing_actions.rs` | other priorities, CPUs and periods, with what they give |
//! | `state_machine.rs` | a component's periodic state machine, as DOT and as SVG |
//!
//! Places are offsets in a file's text. This crate knows no protocol and no terminal.

mod call_hierarchy;
mod change;
mod code_actions;
mod code_lens;
mod completion;
mod declaration;
mod definition;
mod document_links;
mod document_symbols;
mod drawing;
mod explanation;
#[cfg(test)]
mod fixture;
mod folding_ranges;
mod formatting;
mod graph;
mod hierarchy;
mod hover;
mod implementation;
mod inlay_hints;
mod levels;
mod machine_view;
mod markdown;
mod occurrences;
mod program;
mod project;
mod references;
mod rename;
mod rename_files;
mod selection_ranges;
mod semantic_tokens;
mod signature_help;
mod state_machine;
mod timing_actions;
mod type_definition;
mod type_hierarchy;
mod workspace_symbols;

pub use call_hierarchy::{Calls, call_items, incoming_calls, outgoing_calls};
pub use change::{Change, FileChange};
pub use code_actions::{ActionKind, ActionQuestion, Changes, CodeAction, code_actions};
pub use code_lens::{CodeLens, Lens, LensAction, LensKind, code_lens_at, code_lenses, resolve_code_lens};
pub use completion::{Completion, CompletionKind, Completions, Subject, completions, documentation};
pub use declaration::declaration;
pub use definition::{Navigation, Target, definition};
pub use document_links::{DocumentLink, document_links};
pub use document_symbols::{Symbol, SymbolKind, document_symbols};
pub use drawing::Drawing;
pub use explanation::{explain_response, explain_response_of};
pub use folding_ranges::{FoldingKind, FoldingRange, folding_ranges};
pub use formatting::{formatting, formatting_on_type};
pub use graph::{Graph, GraphEdge, GraphNode, GraphsOf, draw_graph, graph, graphs_meant};
pub use hierarchy::HierarchyItem;
pub use hover::{Hover, hover};
pub use implementation::implementation;
pub use inlay_hints::{HintKinds, InlayHint, inlay_hints};
pub use levels::known_levels;
pub use machine_view::{MachineEdge, MachineState, MachineView, component_at, state_machine};
pub use project::projects_with;
pub use references::{Access, Reference, highlights, references};
pub use rename::{Renameable, prepare_rename, rename};
pub use rename_files::rename_files;
pub use selection_ranges::selection_ranges;
pub use semantic_tokens::{
    SemanticToken, TokenKind, TokenModifier, TokenModifiers, meanings_of_names, semantic_tokens,
};
pub use signature_help::{Signature, signature_help};
pub use state_machine::draw_state_machine;
pub use type_definition::type_definition;
pub use type_hierarchy::{subtypes, supertypes, type_items};
pub use workspace_symbols::{FoundSymbol, workspace_symbols};
