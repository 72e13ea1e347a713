//! What is known of a request while it is answered: by its handler, by the main loop, which starts it, and by the transport.

use std::sync::{Arc, OnceLock};

use serde_json::Value;
use tower_lsp::lsp_types::Url;

use super::documents::{Documents, TextId};

tokio::task_local! {
    /// The request that is answered.
    pub(crate) static REQUEST: Arc<Answering>;
}

/// A request while it is answered.
#[derive(Debug, Default)]
pub(crate) struct Answering {
    /// The document that the request is about.
    document: Option<Url>,
    /// The text of the document when the request came; none if it was not open.
    text: OnceLock<Option<TextId>>,
    /// The result as JSON, if its handler has written it.
    pub(crate) result: OnceLock<String>,
}

impl Answering {
    /// Returns a request with these parameters. Requests that name no document have no positions, or have them in `data`, with the
    /// version of their document.
    pub(crate) fn with(params: &Value) -> Answering {
        let uri = params.pointer("/textDocument/uri").or_else(|| params.pointer("/item/uri"));
        Answering { document: uri.and_then(|uri| uri.as_str()?.parse().ok()), ..Answering::default() }
    }

    /// Returns the text of the document when the request came; none if it was not open.
    pub(crate) fn text(&self) -> Option<TextId> {
        self.text.get().copied().flatten()
    }

    /// Returns whether the document has the text that it had when this was called for the first time.
    pub(crate) fn is_current(&self, documents: &Documents) -> bool {
        let text = self.document.as_ref().and_then(|document| documents.text_id(document));
        *self.text.get_or_init(|| text) == text
    }
}
