//! One file for each method: translates the parameters, calls `mauve-ide`, and translates the result. Handlers run on
//! workers, and an edit cancels them.

pub(crate) mod analysis;
pub(crate) mod chains;
pub(crate) mod code_actions;
pub(crate) mod code_lens;
pub(crate) mod completion;
pub(crate) mod cpu_budget;
pub(crate) mod definition;
pub(crate) mod diagnostic;
pub(crate) mod document_links;
pub(crate) mod document_symbols;
pub(crate) mod execute_command;
pub(crate) mod execution_times;
pub(crate) mod folding_ranges;
pub(crate) mod formatting;
pub(crate) mod generate;
pub(crate) mod graph;
pub(crate) mod hierarchies;
pub(crate) mod hover;
pub(crate) mod inlay_hints;
pub(crate) mod probability;
pub(crate) mod references;
pub(crate) mod rename;
pub(crate) mod schedule;
pub(crate) mod selection_ranges;
pub(crate) mod semantic_tokens;
pub(crate) mod signature_help;
pub(crate) mod state_machine;
pub(crate) mod status;
pub(crate) mod syntax_tree;
pub(crate) mod what_if;
pub(crate) mod workspace_symbols;

use mauve_ide::Drawing;
use mauve_timing::Level;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tower_lsp::jsonrpc::{Error, ErrorCode, Result};
use tower_lsp::lsp_types::{Position, TextDocumentIdentifier};

/// The parameters of the methods that draw, or show a tree: each says which of them it takes.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct DrawingParams {
    text_document: TextDocumentIdentifier,
    position: Option<Position>,
    name: Option<String>,
    component: Option<String>,
    codel: Option<String>,
    deployment: Option<String>,
    instance: Option<String>,
    chain: Option<String>,
    significance: Option<Level>,
    #[serde(default)]
    values: Vec<String>,
    before: Option<String>,
    #[serde(default)]
    drawing: Drawing,
    columns: Option<usize>,
}

impl DrawingParams {
    /// Returns the format; that for terminals with its width.
    fn drawing(&self) -> Drawing {
        match self.drawing {
            Drawing::Text(_) => Drawing::Text(self.columns),
            other => other,
        }
    }
}

/// Returns a document as JSON; an error for a path that is not UTF-8.
fn to_value(document: &impl Serialize) -> Result<Value> {
    serde_json::to_value(document).map_err(|error| Error {
        code: ErrorCode::InternalError,
        message: error.to_string().into(),
        data: None,
    })
}
