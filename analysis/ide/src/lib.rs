//! Editor and terminal features as plain data; no feature knows its client.
//!
//! | file | feature |
//! |---|---|
//! | `inlay_hints.rs` | inlay hints: response times, utilisations, defaults, execution times, values |
//! | `hover.rs` | hovers: declarations, times, explanations of response times |
//! | `html.rs`, `html.css` | pages in HTML, for screens and paper, light and dark |
//! | `markdown.rs` | escapes untrusted text in hovers: comments, names of files |
//! | `occurrences.rs` | all names of a text with their definitions |
//! | `code_lens.rs` | code lenses: met deadlines, levels, instances, implementations |
//! | `definition.rs`, `declaration.rs` | go to definition and declaration |
//! | `type_definition.rs`, `implementation.rs` | go to type definition and implementation |
//! | `call_hierarchy.rs`, `type_hierarchy.rs` | calls between programs, `extends` between shells |
//! | `hierarchy.rs` | items of both hierarchies, which survive edits |
//! | `references.rs` | references and highlights |
//! | `rename.rs`, `rename/`, `rename_files.rs` | renames of definitions and of files |
//! | `document_symbols.rs` | the outline of a file |
//! | `workspace_symbols.rs` | fuzzy search for declarations |
//! | `document_links.rs` | links to files in models and `mauve.toml` |
//! | `folding_ranges.rs`, `selection_ranges.rs` | folding, and extending a selection |
//! | `semantic_tokens.rs` | colours of names |
//! | `formatting.rs` | formatting of files, ranges and lines |
//! | `code_actions.rs`, `code_actions/` | fixes and refactorings |
//! | `completion.rs`, `completion/` | completion |
//! | `connections.rs` | the connections of an architecture in its deployments |
//! | `signature_help.rs` | signatures while arguments are typed |
//! | `position.rs` | the position of the cursor in incomplete text |
//! | `program.rs` | signatures of callables, and the expected type at a half-typed token |
//! | `change.rs` | changes of files |
//! | `cpu_budget.rs` | what each instance uses of its CPU, as data and as a drawing |
//! | `cancellation.rs` | work in a database of its own, which an edit cancels |
//! | `doc.rs` | documents, printed as Markdown, text and HTML |
//! | `explanation.rs`, `explanation/` | explanations of response times |
//! | `sensitivity.rs` | how far the time of a codel may grow, as text |
//! | `project.rs` | the projects of a file, and their names |
//! | `drawing.rs` | the formats of drawings |
//! | `svg.rs` | the one writer of SVG |
//! | `chart.rs` | axes of drawings, and their ticks |
//! | `layout.rs` | the places of boxes and lines |
//! | `text_canvas.rs` | drawings in characters |
//! | `toml_place.rs` | where an offset is in `mauve.toml`, or in a timing table |
//! | `architecture_drawing.rs` | an architecture as a drawing |
//! | `gantt.rs` | a schedule as a drawing |
//! | `chain_drawing.rs` | chains as a drawing |
//! | `worst_schedule.rs` | the schedule behind a response time, or with the longest way of data that is found |
//! | `exceedance.rs` | the execution times of a codel, or of those of an activity, at all levels, as data and as a drawing |
//! | `probability.rs` | how probable it is that an activity is late, as a drawing |
//! | `probability_plot.rs` | a probability over a time, as SVG |
//! | `comparison.rs` | the figures of a deployment in two states beside each other |
//! | `comparison_drawing.rs` | the figures of two states as a drawing |
//! | `what_if.rs` | figures of a deployment with other values |
//! | `figure.rs` | the one form of a figure: `✓ 53 / 100 ms` |
//! | `graph.rs` | the graph of an architecture, with utilisations and response times |
//! | `machine_view.rs` | the state machine of a component with locations, for a panel |
//! | `execution_report.rs`, `execution_report/` | the report of measured execution times, as HTML |
//! | `state_machine.rs` | the periodic state machine of a component as a drawing |
//!
//! Locations are offsets in a file's text. This crate knows no protocol and no terminal.

mod architecture_drawing;
mod call_hierarchy;
mod cancellation;
mod chain_drawing;
mod change;
mod chart;
mod code_actions;
mod code_lens;
mod comparison;
mod comparison_drawing;
mod completion;
mod connections;
mod cpu_budget;
mod declaration;
mod definition;
mod doc;
mod document_links;
mod document_symbols;
mod drawing;
mod exceedance;
mod execution_report;
mod explanation;
#[cfg(test)]
mod fixture;
mod folding_ranges;
mod formatting;
mod gantt;
mod graph;
mod hierarchy;
mod hover;
mod html;
mod implementation;
mod inlay_hints;
mod lanes;
mod layout;
mod machine_view;
mod markdown;
mod occurrences;
mod position;
mod probability;
mod probability_plot;
mod program;
mod project;
mod references;
mod rename;
mod rename_files;
mod selection_ranges;
mod semantic_tokens;
mod sensitivity;
mod signature_help;
mod state_machine;
mod svg;
mod text_canvas;
mod threads;
mod toml_place;
mod type_definition;
mod type_hierarchy;
mod what_if;
mod workspace_symbols;
mod worst_schedule;

pub use architecture_drawing::{draw_graph, instance_tree};
pub use call_hierarchy::{HierarchyCalls, call_items, incoming_calls, outgoing_calls};
pub use chain_drawing::{DrawnChain, DrawnChains, DrawnStep, draw_chains, drawn_chains};
pub use change::{Change, FileChange};
pub use code_actions::{ActionKind, ActionQuestion, Changes, CodeAction, code_actions};
pub use code_lens::{CodeLens, LensAction, LensDrawing, code_lenses};
pub use comparison::{Compared, Comparison, Figure, FigureChange, Figures};
pub use comparison_drawing::draw_comparison;
pub use completion::{Completion, CompletionKind, Completions, Subject, completions, documentation};
pub use cpu_budget::{DrawnBudget, DrawnCpu, cpu_status, draw_budget, drawn_budget};
pub use declaration::declaration;
pub use definition::{Navigation, Target, definition};
pub use doc::Doc;
pub use document_links::{DocumentLink, document_links};
pub use document_symbols::{Symbol, SymbolKind, document_symbols};
pub use drawing::Drawing;
pub use exceedance::{
    ActivityCodels, CodelOf, Exceedance, activity_codels, draw_exceedance, exceedance, exceedances_of,
    selected_codel,
};
pub use execution_report::{ExecutionReport, ReportedCodel, execution_report};
pub use explanation::{blocking_priorities, counted_cpus, explain_response, explain_response_of};
pub use folding_ranges::{FoldingKind, FoldingRange, folding_ranges};
pub use formatting::{formatting, formatting_on_type};
pub use gantt::draw_schedule;
pub use graph::{Graph, GraphEdge, GraphNode, GraphPort, GraphsOf, graph, selected_graphs};
pub use hierarchy::HierarchyItem;
pub use hover::{Hover, HoverFormat, hover};
pub use html::{code as html_code, page as html_page, text as html_text, words as html_words};
pub use implementation::{codel_file, implementation};
pub use inlay_hints::{
    EarlierFigures, HintOptions, InlayHint, hash_of_hints, hash_of_table, inlay_hints, limit_of, table_hints,
};
pub use machine_view::{MachineEdge, MachineState, MachineView, component_at, end_of_item, state_machine};
pub use markdown::{Links, code as markdown_code};
pub use probability::draw_probability;
pub use project::{DeploymentAt, has_name_at, name_of_root, projects_with};
pub use references::{Access, Reference, highlights, references};
pub use rename::{Renameable, prepare_rename, rename};
pub use rename_files::rename_files;
pub use selection_ranges::selection_ranges;
pub use semantic_tokens::{
    SemanticToken, TokenKind, TokenModifier, TokenModifiers, meanings_of_names, semantic_tokens,
};
pub use sensitivity::percentage;
pub use signature_help::{CallSignature, signature_help};
pub use state_machine::{MachineTitle, draw_state_machine};
pub use text_canvas::in_columns;
pub use threads::deployments_with_threads;
pub use type_definition::type_definition;
pub use type_hierarchy::{subtypes, supertypes, type_items};
pub use what_if::{compared, edit_of_fields, what_if, what_if_change};
pub use workspace_symbols::{FoundSymbol, workspace_symbols};
pub use worst_schedule::{WayOf, WorstOf, no_chain, no_worst_case, to_micros};
