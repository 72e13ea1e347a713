//! The methods of the protocol. Each puts what it was given on the main loop's channel before it waits for anything, so
//! that everything happens in the client's order; answers are made by workers, in `handlers/`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock, mpsc};

use salsa::{CancellationToken, Database as _};
use serde::Deserialize as _;
use tokio::sync::oneshot;
use tower_lsp::jsonrpc::{Error, Request, Result};
use tower_lsp::lsp_types::*;
use tower_lsp::{LanguageServer, LspServiceBuilder};

use super::capabilities::Capabilities;
use super::handlers;
use super::handlers::status::{Status, status};
use super::main_loop::Event;
use super::snapshot::{Snapshot, attempt};

/// The server as tower-lsp sees it.
pub(crate) struct Backend {
    pub(crate) main_loop: mpsc::Sender<Event>,
}

/// The methods that are ours alone.
pub(crate) fn with_custom_methods(build: LspServiceBuilder<Backend>) -> LspServiceBuilder<Backend> {
    let build = build.custom_method("mauve/status", Backend::status);
    #[cfg(debug_assertions)]
    let build = build
        .custom_method("mauve/debug/panic", Backend::debug_panic)
        .custom_method("mauve/debug/work", Backend::debug_work);
    build
}

impl Backend {
    /// Looks at a message before its method does: a change that is none must not be dropped in silence, since the text
    /// is another one from there on.
    pub(crate) fn notice(&self, request: &Request) {
        if request.method() != "textDocument/didChange" {
            return;
        }
        let params = request.params().unwrap_or(&serde_json::Value::Null);
        if let Err(error) = DidChangeTextDocumentParams::deserialize(params) {
            tracing::error!("a change that means nothing: {error}");
            let uri = params.pointer("/textDocument/uri").and_then(|uri| uri.as_str());
            self.send(Event::Lost(uri.and_then(|uri| Url::parse(uri).ok())));
        }
    }

    /// A message was lost, and it may have been a change of any text.
    pub(crate) fn lost(&self) {
        self.send(Event::Lost(None));
    }

    fn send(&self, event: Event) {
        // Where the main loop has ended, so does the process.
        let _ = self.main_loop.send(event);
    }

    async fn status(&self) -> Result<Status> {
        self.answer(status).await
    }

    /// For tests: a handler with a defect.
    #[cfg(debug_assertions)]
    #[allow(clippy::panic, reason = "that is what it is for")]
    async fn debug_panic(&self) -> Result<()> {
        self.answer(|_| panic!("asked for")).await
    }

    /// For tests: work that only an edit or a cancellation ends.
    #[cfg(debug_assertions)]
    async fn debug_work(&self) -> Result<()> {
        self.answer(|snapshot| {
            loop {
                snapshot.db.unwind_if_revision_cancelled();
                std::thread::yield_now();
            }
        })
        .await
    }

    /// Answers a request by a worker: an edit overtakes it, and the client can cancel it.
    async fn answer<T: Send + 'static>(
        &self,
        handler: impl Fn(&Snapshot) -> Result<T> + Send + 'static,
    ) -> Result<T> {
        let (reply, answer) = oneshot::channel();
        let cancel = CancelOnDrop::default();
        let cancelled = Arc::clone(&cancel.0);
        self.send(Event::Job(Box::new(move |snapshot| {
            let _ = cancelled.token.set(snapshot.db.cancellation_token());
            if cancelled.flag.load(Ordering::SeqCst) {
                return;
            }
            let answer = attempt(|| handler(&snapshot));
            // The answer may bring an edit, which waits for all snapshots.
            drop(snapshot);
            let _ = reply.send(answer.unwrap_or_else(|failure| Err(failure.into_error())));
        })));
        let answer = answer.await.unwrap_or_else(|_| Err(Error::internal_error()));
        drop(cancel);
        answer
    }
}

/// Ends the work of a request whose future is dropped: that is what `$/cancelRequest` does.
#[derive(Default)]
struct CancelOnDrop(Arc<Cancelling>);

#[derive(Default)]
struct Cancelling {
    flag: AtomicBool,
    token: OnceLock<CancellationToken>,
}

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.flag.store(true, Ordering::SeqCst);
        if let Some(token) = self.0.token.get() {
            token.cancel();
        }
    }
}

#[tower_lsp::async_trait]
impl LanguageServer for Backend {
    async fn initialize(&self, params: InitializeParams) -> Result<InitializeResult> {
        let capabilities = Capabilities::of(&params.capabilities);
        #[allow(deprecated, reason = "older clients have no folders")]
        let root = params.root_uri;
        let folders = match params.workspace_folders {
            Some(folders) => folders.into_iter().map(|folder| folder.uri).collect(),
            None => root.into_iter().collect(),
        };
        self.send(Event::Initialize { capabilities, folders });
        Ok(InitializeResult {
            capabilities: capabilities.of_server(),
            server_info: Some(ServerInfo {
                name: "mauve".to_owned(),
                version: Some(env!("CARGO_PKG_VERSION").to_owned()),
            }),
        })
    }

    async fn initialized(&self, _: InitializedParams) {
        self.send(Event::Initialized);
    }

    async fn shutdown(&self) -> Result<()> {
        Ok(())
    }

    async fn did_open(&self, params: DidOpenTextDocumentParams) {
        self.send(Event::Opened(params.text_document));
    }

    async fn did_change(&self, params: DidChangeTextDocumentParams) {
        self.send(Event::Changed(params));
    }

    async fn did_save(&self, params: DidSaveTextDocumentParams) {
        self.send(Event::Saved(params));
    }

    async fn did_close(&self, params: DidCloseTextDocumentParams) {
        self.send(Event::Closed(params.text_document.uri));
    }

    async fn did_change_watched_files(&self, params: DidChangeWatchedFilesParams) {
        let paths = params.changes.into_iter().filter_map(|change| change.uri.to_file_path().ok());
        self.send(Event::Disk { paths: paths.collect(), missed: false });
    }

    async fn did_change_workspace_folders(&self, params: DidChangeWorkspaceFoldersParams) {
        let uris = |folders: Vec<WorkspaceFolder>| folders.into_iter().map(|folder| folder.uri).collect();
        self.send(Event::Folders { added: uris(params.event.added), removed: uris(params.event.removed) });
    }

    async fn did_change_configuration(&self, _: DidChangeConfigurationParams) {
        // Everything that can be set stands in `mauve.toml`.
    }

    async fn inlay_hint(&self, params: InlayHintParams) -> Result<Option<Vec<InlayHint>>> {
        let handler = move |snapshot: &Snapshot| {
            let hints = handlers::inlay_hints::inlay_hints(snapshot, &params)?;
            Ok((hints, snapshot.generation))
        };
        match self.answer(handler).await {
            Ok((hints, generation)) => {
                self.send(Event::Hinted(Some(generation)));
                Ok(hints)
            }
            Err(error) => {
                // An edit elsewhere may have overtaken it: then nobody asks again by himself.
                if error == Error::content_modified() {
                    self.send(Event::Hinted(None));
                }
                Err(error)
            }
        }
    }

    async fn inlay_hint_resolve(&self, hint: InlayHint) -> Result<InlayHint> {
        self.answer(move |snapshot| handlers::inlay_hints::resolve(snapshot, &hint)).await
    }

    async fn completion(&self, params: CompletionParams) -> Result<Option<CompletionResponse>> {
        self.answer(move |snapshot| handlers::completion::completion(snapshot, &params)).await
    }

    async fn completion_resolve(&self, item: CompletionItem) -> Result<CompletionItem> {
        self.answer(move |snapshot| handlers::completion::resolve(snapshot, &item)).await
    }

    async fn signature_help(&self, params: SignatureHelpParams) -> Result<Option<SignatureHelp>> {
        self.answer(move |snapshot| handlers::signature_help::signature_help(snapshot, &params)).await
    }

    async fn hover(&self, params: HoverParams) -> Result<Option<Hover>> {
        self.answer(move |snapshot| handlers::hover::hover(snapshot, &params)).await
    }

    async fn goto_definition(&self, params: GotoDefinitionParams) -> Result<Option<GotoDefinitionResponse>> {
        self.answer(move |snapshot| handlers::definition::definition(snapshot, &params)).await
    }

    async fn document_symbol(&self, params: DocumentSymbolParams) -> Result<Option<DocumentSymbolResponse>> {
        self.answer(move |snapshot| handlers::document_symbols::document_symbols(snapshot, &params)).await
    }
}
