//! The methods of the protocol. Each sends its event to the main loop before its first `.await`, so that the main loop
//! receives all events in the client's order; workers compute the answers, in `handlers/`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock, mpsc};

use mauve_projects::address::file_at;
use mauve_projects::json::object;
use salsa::{CancellationToken, Database as _};
use serde::Serialize;
use serde_json::{Value, from_value, json};
use tokio::sync::oneshot;
use tokio::time::timeout;
use tower_lsp::jsonrpc::{Error, Request, Result};
use tower_lsp::lsp_types::request::{self, Request as RequestType};
use tower_lsp::lsp_types::*;
use tower_lsp::{Client, LanguageServer, LspServiceBuilder};

use super::answering::REQUEST;
use super::capabilities::Capabilities;
use super::event::{LoopEvent, RequestJob};
use super::handlers::diagnostic::{Diagnosed, ask_again};
use super::handlers::execute_command::ServerCommand;
use super::handlers::generate::{GenerateDocument, GenerateMessages, GenerateParams};
use super::handlers::inlay_hints::RangeHints;
use super::handlers::*;
use super::outbox::PATIENCE;
use super::progress::ShownProgress;
use super::pulls::GivenResult;
use super::settings::{SECTION, Settings};
use super::snapshot::{Failure, Snapshot, attempt};
use super::typing;

/// The number of attempts of a request that changes cancel.
const MOST_ATTEMPTS: usize = 100;

/// The server as tower-lsp sees it.
pub(crate) struct Backend {
    main_loop: mpsc::Sender<LoopEvent>,
    /// The client's `initialize` parameters as JSON, from which each field is read by itself: an odd one costs no other.
    raw: OnceLock<Value>,
    client: Client,
    /// The client's capabilities, and the settings in its initialization options.
    session: OnceLock<(Capabilities, Settings)>,
    /// The number of requests for the client's settings, and the number of the newest answered one.
    questions: AtomicU64,
    answered: Arc<AtomicU64>,
    progress: ShownProgress,
}

/// Registers the methods that are not part of the protocol.
pub(crate) fn with_custom_methods(build: LspServiceBuilder<Backend>) -> LspServiceBuilder<Backend> {
    let build = Backend::with_own_methods(build)
        .custom_method("mauve/status", Backend::status)
        .custom_method("window/workDoneProgress/cancel", Backend::cancel_progress);
    #[cfg(debug_assertions)]
    let build = build
        .custom_method("mauve/debug/panic", Backend::debug_panic)
        .custom_method("mauve/debug/panicMainLoop", Backend::debug_panic_main_loop)
        .custom_method("mauve/debug/work", Backend::debug_work);
    build
}

/// The files that the client watches, beside the server. A table may have any name: the server watches those.
const WATCHED: &str = "**/*.{mal,toml,samples,msg,yaml,yml}";

const NOT_CONFIGURED: &str =
    "The editor has not answered mauve's request for its settings. The previous settings stay in effect.";

const LOST_FOLDERS: &str = "mauve could not understand all of the editor's message about its folders. If a \
    folder is missing, or a closed folder is still analysed, restart the server.";

const LOST_MESSAGE: &str = "mauve could not understand a message of the editor, so the texts of open files \
    are unknown: save them. If you have just opened a file, close it and open it again.";

const TEXT_NOTIFICATIONS: [&str; 4] =
    ["textDocument/didOpen", "textDocument/didChange", "textDocument/didSave", "textDocument/didClose"];

/// Returns the URI of the document that a message is about, as it is written.
fn uri_in(params: Option<&Value>) -> Option<&str> {
    params?.pointer("/textDocument/uri")?.as_str()
}

/// Declares and registers methods that are not part of the protocol, each with its handler.
macro_rules! own_methods {
    ($($name:literal: $method:ident($params:ty) -> $result:ty => $handler:path;)*) => {
        $(async fn $method(&self, params: $params) -> Result<$result> {
            self.answer(move |snapshot| $handler(snapshot, &params)).await
        })*

        fn with_own_methods(build: LspServiceBuilder<Backend>) -> LspServiceBuilder<Backend> {
            build$(.custom_method($name, Backend::$method))*
        }
    };
}

impl Backend {
    /// Creates a backend that sends its events to the main loop.
    pub(crate) fn new(
        client: Client,
        main_loop: mpsc::Sender<LoopEvent>,
        progress: ShownProgress,
    ) -> Backend {
        Backend {
            main_loop,
            raw: OnceLock::new(),
            client,
            session: OnceLock::new(),
            questions: AtomicU64::new(0),
            answered: Arc::default(),
            progress,
        }
    }

    /// Applies settings; without any, requests them from a client that supports that.
    fn configure(&self, given: Option<&Value>) {
        let Some(&(capabilities, initial)) = self.session.get() else { return };
        let (main_loop, client) = (self.main_loop.clone(), self.client.clone());
        let take = move |given: &Value| {
            let (settings, problems) = Settings::read(given, initial);
            let _ = main_loop.send(LoopEvent::Configured(settings, problems));
        };
        match given {
            Some(given) => take(given),
            None if capabilities.configuration => {
                let number = self.questions.fetch_add(1, Ordering::SeqCst) + 1;
                let (answered, main_loop) = (Arc::clone(&self.answered), self.main_loop.clone());
                tokio::spawn(async move {
                    let item = ConfigurationItem { scope_uri: None, section: Some(SECTION.to_owned()) };
                    let mut answer = Box::pin(client.configuration(vec![item]));
                    let answer = match timeout(PATIENCE, &mut answer).await {
                        Ok(answer) => answer,
                        Err(_) => {
                            if answered.load(Ordering::SeqCst) < number {
                                let _ = main_loop.send(LoopEvent::Warn(NOT_CONFIGURED.to_owned()));
                            }
                            answer.await
                        }
                    };
                    match answer {
                        // Answers may arrive out of order: the answer to the newest request is in effect.
                        Ok(given) if answered.fetch_max(number, Ordering::SeqCst) < number => {
                            given.iter().for_each(take);
                        }
                        Ok(_) => {}
                        Err(error) => tracing::warn!("the client does not answer with its settings: {error}"),
                    }
                });
            }
            None => {}
        }
    }

    /// Handles a message before tower-lsp does, and returns it if tower-lsp is to handle it as well.
    ///
    /// tower-lsp drops a notification whose parameters it does not understand, and refuses a session for one odd field of
    /// `initialize`. So they are read here, each field by itself. If a notification about a document is malformed, or is sent
    /// as a request, the text that it may have changed becomes unknown.
    pub(crate) fn preprocess(&self, request: Request) -> Option<Request> {
        if TEXT_NOTIFICATIONS.contains(&request.method()) {
            if request.id().is_none() {
                self.document_notification(request);
                return None;
            }
            self.text_unknown(uri_in(request.params()));
        }
        let params = request.params().unwrap_or(&Value::Null);
        if request.method() == "initialize" {
            let _ = self.raw.set(params.clone());
            let (method, id, _) = request.into_parts();
            let understood = Request::build(method).params(json!({"capabilities": {}}));
            return Some(id.into_iter().fold(understood, |it, id| it.id(id)).finish());
        }
        // Before `initialize`, the protocol has a server drop notifications.
        let is_notification = request.id().is_none() && self.session.get().is_some();
        if is_notification && self.notified(request.method(), params) { None } else { Some(request) }
    }

    /// Handles a notification that is not about a document; returns whether it is known.
    fn notified(&self, method: &str, params: &Value) -> bool {
        match method {
            "initialized" => self.initialized(),
            "mauve/focus" => self.send(LoopEvent::Focused),
            "workspace/didChangeConfiguration" => {
                // Clients that support requests for settings often send empty settings here, and some send none.
                let can_be_asked = self.session.get().is_some_and(|(it, _)| it.configuration);
                self.configure(params.get("settings").filter(|_| !can_be_asked));
            }
            "workspace/didChangeWatchedFiles" => {
                self.send(LoopEvent::Disk { paths: files_of(&params["changes"]).collect(), missed: false });
            }
            "workspace/didChangeWorkspaceFolders" => {
                let lists = ["added", "removed"].map(|list| &params["event"][list]);
                let [added, removed] = lists.map(|list| files_of(list).collect());
                self.send(LoopEvent::Folders { added, removed });
                let is_known = |it: &Value| it["uri"].as_str().is_some_and(|uri| Url::parse(uri).is_ok());
                if !lists.iter().all(|it| it.as_array().is_some_and(|list| list.iter().all(is_known))) {
                    self.warn(LOST_FOLDERS);
                }
            }
            _ => return false,
        }
        true
    }

    fn document_notification(&self, request: Request) {
        let (method, _, params) = request.into_parts();
        let uri = uri_in(params.as_ref()).map(str::to_owned);
        let mut params = params.unwrap_or_default();
        // The range says it as well, and some clients count otherwise.
        let changes = params.get_mut("contentChanges").and_then(Value::as_array_mut);
        for change in changes.into_iter().flatten().filter_map(Value::as_object_mut) {
            change.remove("rangeLength");
        }
        let event = match &*method {
            "textDocument/didOpen" => {
                from_value::<DidOpenTextDocumentParams>(params).map(|it| LoopEvent::Opened(it.text_document))
            }
            "textDocument/didChange" => {
                from_value::<DidChangeTextDocumentParams>(params).map(LoopEvent::Changed)
            }
            "textDocument/didSave" => from_value::<DidSaveTextDocumentParams>(params).map(LoopEvent::Saved),
            _ => from_value::<DidCloseTextDocumentParams>(params)
                .map(|it| LoopEvent::Closed(it.text_document.uri)),
        };
        match event {
            // Before `initialize`, the protocol has a server drop notifications.
            Ok(_) if self.session.get().is_none() => {}
            Ok(event) => {
                tracing::debug!("{method}");
                self.send(event);
            }
            Err(error) => {
                tracing::error!("the parameters of {method} are invalid: {error}");
                self.text_unknown(uri.as_deref());
            }
        }
    }

    /// Marks the text of a document as unknown after an invalid message about it; all texts, if the message does not name one. A
    /// document whose address is none is no document of ours.
    fn text_unknown(&self, uri: Option<&str>) {
        match uri.map(Url::parse) {
            Some(Ok(uri)) => self.send(LoopEvent::TextUnknown(Some(uri))),
            Some(Err(error)) => tracing::warn!("a text is ignored, whose address is none: {error}"),
            None => self.texts_unknown(),
        }
    }

    /// Marks the texts of all open documents as unknown: an invalid message may have been about any of them.
    pub(crate) fn texts_unknown(&self) {
        self.send(LoopEvent::TextUnknown(None));
        self.warn(LOST_MESSAGE);
    }

    /// Shows a warning, once.
    pub(crate) fn warn(&self, message: &str) {
        self.send(LoopEvent::Warn(message.to_owned()));
    }

    fn send(&self, event: LoopEvent) {
        // If the main loop has ended, the process ends as well.
        let _ = self.main_loop.send(event);
    }

    /// The server shows one progress at a time, so this cancels all work. A progress that has ended cancels nothing.
    async fn cancel_progress(&self, params: WorkDoneProgressCancelParams) {
        if self.progress.is(&params.token) {
            self.send(LoopEvent::Stop);
        }
    }

    own_methods! {
        "mauve/analysis": analysis(analysis::AnalysisParams) -> Vec<Value> => analysis::analysis;
        "mauve/chains": chains(DrawingParams) -> Value => chains::chains;
        "mauve/cpuBudget": cpu_budget(DrawingParams) -> Value => cpu_budget::cpu_budget;
        "mauve/executionTimes": execution_times(DrawingParams) -> Value => execution_times::execution_times;
        "mauve/generate": generate(GenerateParams) -> GenerateDocument => generate::generate;
        "mauve/graph": graph(DrawingParams) -> Vec<Value> => graph::graph;
        "mauve/probability": probability(DrawingParams) -> Value => probability::probability;
        "mauve/schedule": schedule(DrawingParams) -> Value => schedule::schedule;
        "mauve/stateMachine": state_machine(DrawingParams) -> Value => state_machine::state_machine;
        "mauve/syntaxTree": syntax_tree(DrawingParams) -> String => syntax_tree::syntax_tree;
        "mauve/whatIf": what_if(DrawingParams) -> Value => what_if::what_if;
    }

    async fn status(&self) -> Result<Value> {
        self.answer(status::status).await
    }

    /// For tests: a handler with a defect.
    #[cfg(debug_assertions)]
    #[allow(clippy::panic, reason = "that is what it is for")]
    async fn debug_panic(&self) -> Result<()> {
        self.answer(|_| panic!("asked for")).await
    }

    /// For tests: a defect of the main loop.
    #[cfg(debug_assertions)]
    async fn debug_panic_main_loop(&self) -> Result<()> {
        self.send(LoopEvent::Panic);
        Ok(())
    }

    /// For tests: work that only an edit or a cancellation ends.
    #[cfg(debug_assertions)]
    async fn debug_work(&self) -> Result<()> {
        let work = self.run(|snapshot| -> () {
            loop {
                snapshot.db.unwind_if_revision_cancelled();
                std::thread::yield_now();
            }
        });
        work.await?.map_err(Failure::into_error)
    }

    /// Answers a request on a worker. The client can cancel it. A change of the document that the request is about makes it
    /// outdated, since its positions are those of the text before; any other change has it begin again.
    async fn answer<T: Send + 'static>(
        &self,
        handler: impl Fn(&Snapshot) -> Result<T> + Send + Sync + 'static,
    ) -> Result<T> {
        let handler = Arc::new(handler);
        for _ in 0..MOST_ATTEMPTS {
            let handler = Arc::clone(&handler);
            match self.run(move |snapshot| handler(snapshot)).await? {
                Err(Failure::Overtaken) => {}
                answer => return answer.unwrap_or_else(|failure| Err(failure.into_error())),
            }
        }
        Err(Error::content_modified())
    }

    /// Runs a job on a worker. Any change cancels it, and the client can. The outer error is that of a job that was not begun.
    async fn run<T: Send + 'static>(
        &self,
        job: impl Fn(&Snapshot) -> T + Send + 'static,
    ) -> Result<std::result::Result<T, Failure>> {
        let (reply, answer) = oneshot::channel();
        let cancel = CancelOnDrop::default();
        let cancelled = Arc::clone(&cancel.0);
        let defects = self.main_loop.clone();
        let request = REQUEST.try_with(Arc::clone).unwrap_or_default();
        let work = move |snapshot: Option<Snapshot>| {
            let Some(snapshot) = snapshot else {
                let _ = reply.send(Err(Error::content_modified()));
                return;
            };
            let _ = cancelled.token.set(snapshot.db.cancellation_token());
            if cancelled.flag.load(Ordering::SeqCst) {
                return;
            }
            let answer = attempt(|| job(&snapshot));
            if let Err(Failure::Panicked(message)) = &answer {
                let _ = defects.send(LoopEvent::Defect(message.clone()));
            }
            // After the answer, the client may send an edit, which waits for all snapshots.
            drop(snapshot);
            let _ = reply.send(Ok(answer));
        };
        self.send(LoopEvent::Job(RequestJob { request, work: Box::new(work) }));
        let answer = answer.await.unwrap_or_else(|_| Err(Error::internal_error()));
        drop(cancel);
        answer
    }

    /// Sends an edit to the client, without a timeout: the user may preview it.
    fn make(&self, edit: WorkspaceEdit, messages: GenerateMessages) {
        let client = self.client.clone();
        tokio::spawn(async move {
            let is_something = messages.nothing.is_none();
            tell(&client, messages).await;
            if !is_something {
                return;
            }
            match client.apply_edit(edit).await {
                Ok(ApplyWorkspaceEditResponse { applied: true, .. }) => {}
                Ok(answer) => {
                    let why = answer.failure_reason.map(|why| format!(": {why}")).unwrap_or_default();
                    client.show_message(MessageType::WARNING, format!("Nothing was generated{why}.")).await;
                }
                Err(error) => tracing::warn!("the client refused the edit: {error}"),
            }
        });
    }

    /// [`Backend::answer`] with semantic tokens. A client that gets none does not repeat the request.
    async fn tokens<T: Send + 'static>(
        &self,
        uri: Url,
        handler: impl Fn(&Snapshot) -> Result<T> + Send + Sync + 'static,
    ) -> Result<T> {
        let answer = self.answer(handler).await;
        let text = REQUEST.try_with(|request| request.text()).unwrap_or_default();
        if let (Err(error), Some(text)) = (&answer, text)
            && *error == Error::content_modified()
        {
            self.send(LoopEvent::TokensCancelled(uri, text.version));
        }
        answer
    }
}

async fn tell(client: &Client, messages: GenerateMessages) {
    if let Some(warning) = messages.warning {
        client.show_message(MessageType::WARNING, warning).await;
    }
    if let Some(nothing) = messages.nothing {
        client.show_message(MessageType::INFO, nothing).await;
    }
}

/// Cancels the work of a request whose future is dropped, which `$/cancelRequest` causes.
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

/// A request for diagnostics. The main loop is notified of its begin and its end, even if its future is dropped.
struct Pull {
    main_loop: mpsc::Sender<LoopEvent>,
    about: Option<Url>,
    given: Option<BTreeMap<Url, GivenResult>>,
}

impl Pull {
    fn new(main_loop: &mpsc::Sender<LoopEvent>, about: Option<&Url>) -> Pull {
        let _ = main_loop.send(LoopEvent::DiagnosticsRequested(about.cloned()));
        Pull { main_loop: main_loop.clone(), about: about.cloned(), given: None }
    }

    fn answered<T>(mut self, answer: Result<Diagnosed<T>>) -> Result<T> {
        let (report, given) = answer.map_err(ask_again)?;
        self.given = Some(given);
        Ok(report)
    }
}

impl Drop for Pull {
    fn drop(&mut self) {
        let event = match (self.given.take(), self.about.take()) {
            (Some(given), _) => LoopEvent::DiagnosticsGiven(given),
            (None, Some(url)) => LoopEvent::DiagnosticsNotGiven(url),
            (None, None) => LoopEvent::DiagnosticsGiven(BTreeMap::new()),
        };
        let _ = self.main_loop.send(event);
    }
}

type RequestHandler<R> = fn(&Snapshot, &<R as RequestType>::Params) -> Result<<R as RequestType>::Result>;

/// Implements the methods of the protocol: by a handler, by a handler for semantic tokens, or by a method
/// of [`Backend`].
macro_rules! language_server {
    (
        handlers: { $($method:ident: $request:ident => $handler:expr;)* }
        tokens: { $($tokens:ident: $tokens_request:ident => $tokens_handler:path;)* }
        requests: { $($own:ident: $own_request:ident;)* }
    ) => {
        #[tower_lsp::async_trait]
        impl LanguageServer for Backend {
            $(async fn $method(
                &self,
                params: <request::$request as RequestType>::Params,
            ) -> Result<<request::$request as RequestType>::Result> {
                let handler: RequestHandler<request::$request> = $handler;
                self.answer(move |snapshot| handler(snapshot, &params)).await
            })*

            $(async fn $tokens(
                &self,
                params: <request::$tokens_request as RequestType>::Params,
            ) -> Result<<request::$tokens_request as RequestType>::Result> {
                let uri = params.text_document.uri.clone();
                let answer = self.tokens(uri, move |snapshot| $tokens_handler(snapshot, &params)).await;
                answer.map(|tokens| tokens.and_then(written))
            })*

            $(async fn $own(
                &self,
                params: <request::$own_request as RequestType>::Params,
            ) -> Result<<request::$own_request as RequestType>::Result> {
                Backend::$own(self, params).await
            })*

            // lsp-types declares a different result type.
            async fn symbol(&self, params: WorkspaceSymbolParams) -> Result<Option<Vec<SymbolInformation>>> {
                self.answer(move |snapshot| workspace_symbols::workspace_symbols(snapshot, &params)).await
            }

            async fn shutdown(&self) -> Result<()> {
                Ok(())
            }
        }
    };
}

language_server! {
    handlers: {
        code_action: CodeActionRequest => code_actions::code_actions;
        completion: Completion => completion::completion;
        completion_resolve: ResolveCompletionItem => completion::resolve;
        document_highlight: DocumentHighlightRequest => references::highlights;
        document_link: DocumentLinkRequest => document_links::document_links;
        document_symbol: DocumentSymbolRequest => document_symbols::document_symbols;
        folding_range: FoldingRangeRequest => folding_ranges::folding_ranges;
        formatting: Formatting => formatting::formatting;
        goto_declaration: GotoDeclaration =>
            |it, at| definition::go_to(it, at, mauve_ide::declaration, it.capabilities.declaration_links);
        goto_definition: GotoDefinition =>
            |it, at| definition::go_to(it, at, mauve_ide::definition, it.capabilities.definition_links);
        goto_implementation: GotoImplementation =>
            |it, at| definition::go_to(it, at, mauve_ide::implementation, it.capabilities.implementation_links);
        goto_type_definition: GotoTypeDefinition =>
            |it, at| definition::go_to(it, at, mauve_ide::type_definition, it.capabilities.type_definition_links);
        hover: HoverRequest => hover::hover;
        incoming_calls: CallHierarchyIncomingCalls => hierarchies::incoming;
        on_type_formatting: OnTypeFormatting => formatting::on_type_formatting;
        outgoing_calls: CallHierarchyOutgoingCalls => hierarchies::outgoing;
        prepare_call_hierarchy: CallHierarchyPrepare => |it, params| {
            let at = &params.text_document_position_params;
            hierarchies::prepare(it, at, mauve_ide::call_items, hierarchies::call_item)
        };
        prepare_rename: PrepareRenameRequest => rename::prepare;
        prepare_type_hierarchy: TypeHierarchyPrepare => |it, params| {
            let at = &params.text_document_position_params;
            hierarchies::prepare(it, at, mauve_ide::type_items, hierarchies::type_item)
        };
        range_formatting: RangeFormatting => formatting::range_formatting;
        references: References => references::references;
        rename: Rename => rename::rename;
        selection_range: SelectionRangeRequest => selection_ranges::selection_ranges;
        signature_help: SignatureHelpRequest => signature_help::signature_help;
        subtypes: TypeHierarchySubtypes =>
            |it, params| hierarchies::related_types(it, &params.item, mauve_ide::subtypes);
        supertypes: TypeHierarchySupertypes =>
            |it, params| hierarchies::related_types(it, &params.item, mauve_ide::supertypes);
        will_rename_files: WillRenameFiles => rename::will_rename_files;
    }
    tokens: {
        semantic_tokens_full: SemanticTokensFullRequest => semantic_tokens::full;
        semantic_tokens_full_delta: SemanticTokensFullDeltaRequest => semantic_tokens::delta;
        semantic_tokens_range: SemanticTokensRangeRequest => semantic_tokens::range;
    }
    requests: {
        initialize: Initialize;
        code_action_resolve: CodeActionResolveRequest;
        code_lens: CodeLensRequest;
        diagnostic: DocumentDiagnosticRequest;
        execute_command: ExecuteCommand;
        inlay_hint: InlayHintRequest;
        inlay_hint_resolve: InlayHintResolveRequest;
        workspace_diagnostic: WorkspaceDiagnosticRequest;
    }
}

/// The methods that need more than a handler.
impl Backend {
    async fn initialize(&self, _: InitializeParams) -> Result<InitializeResult> {
        let params = self.raw.get().unwrap_or(&Value::Null);
        let (capabilities, folders) = (Capabilities::of(params), folders_of(params));
        let (settings, problems) = Settings::read(&params["initializationOptions"], Settings::default());
        let _ = self.session.set((capabilities, settings));
        self.send(LoopEvent::Initialize { capabilities, folders });
        self.send(LoopEvent::Configured(settings, problems));
        let server = object! { name: "mauve", version: env!("CARGO_PKG_VERSION") };
        let _ = written(object! { capabilities: capabilities.of_server(), serverInfo: server });
        Ok(InitializeResult::default())
    }

    fn initialized(&self) {
        self.send(LoopEvent::Initialized);
        self.configure(None);
        let Some((can, _)) = self.session.get() else { return };
        let watchers = json!([{ "globPattern": WATCHED }]);
        for (can_register, method, options) in [
            (can.configuration_registration, "didChangeConfiguration", json!({ "section": SECTION })),
            (can.files_registration, "didChangeWatchedFiles", json!({ "watchers": watchers })),
        ] {
            let (id, method) = (format!("mauve/{method}"), format!("workspace/{method}"));
            let registration = Registration { id, method, register_options: Some(options) };
            let client = self.client.clone();
            let registered = async move {
                let answer = timeout(PATIENCE, client.register_capability(vec![registration])).await;
                if !matches!(answer, Ok(Ok(()))) {
                    tracing::warn!("the client does not register a notification");
                }
            };
            can_register.then(|| tokio::spawn(registered));
        }
    }

    async fn diagnostic(&self, params: DocumentDiagnosticParams) -> Result<DocumentDiagnosticReportResult> {
        let pull = Pull::new(&self.main_loop, Some(&params.text_document.uri));
        pull.answered(self.answer(move |snapshot| diagnostic::document_diagnostic(snapshot, &params)).await)
    }

    async fn workspace_diagnostic(
        &self,
        params: WorkspaceDiagnosticParams,
    ) -> Result<WorkspaceDiagnosticReportResult> {
        let pull = Pull::new(&self.main_loop, None);
        pull.answered(self.answer(move |snapshot| diagnostic::workspace_diagnostic(snapshot, &params)).await)
    }

    async fn inlay_hint(&self, params: InlayHintParams) -> Result<Option<Vec<InlayHint>>> {
        let main_loop = self.main_loop.clone();
        self.hints(move |snapshot| {
            let RangeHints { list, figures, missing } = inlay_hints::inlay_hints(snapshot, &params)?;
            // Before the answer: an edit that follows cancels the comparison, which would have found them.
            if !figures.is_empty() {
                let _ = main_loop.send(LoopEvent::FiguresShown(snapshot.generation, figures));
            }
            if let Some(missing) = missing {
                let (main_loop, generation) = (main_loop.clone(), snapshot.generation);
                // Not while the user types.
                tokio::spawn(async move {
                    tokio::time::sleep(typing::PAUSE).await;
                    let _ = main_loop.send(LoopEvent::LimitsMissing(generation, missing));
                });
            }
            Ok(Some(list))
        })
        .await
    }

    async fn code_lens(&self, params: CodeLensParams) -> Result<Option<Vec<CodeLens>>> {
        self.hints(move |snapshot| code_lens::code_lenses(snapshot, &params)).await
    }

    async fn inlay_hint_resolve(&self, hint: InlayHint) -> Result<InlayHint> {
        self.noted(move |snapshot| inlay_hints::resolve(snapshot, &hint)).await
    }

    /// [`Backend::noted`], with the result written as JSON.
    async fn hints<T: Serialize + Send + 'static>(
        &self,
        handler: impl Fn(&Snapshot) -> Result<Option<T>> + Send + Sync + 'static,
    ) -> Result<Option<T>> {
        self.noted(handler).await.map(|hints| hints.and_then(written))
    }

    /// [`Backend::answer`] with hints or lenses, which stay on the screen: the main loop is told their generation. A client that gets
    /// none does not repeat the request.
    async fn noted<T: Send + 'static>(
        &self,
        handler: impl Fn(&Snapshot) -> Result<T> + Send + Sync + 'static,
    ) -> Result<T> {
        let answer = self.answer(move |snapshot| Ok((handler(snapshot)?, snapshot.generation))).await;
        match &answer {
            Ok((_, generation)) => self.send(LoopEvent::HintsGiven(Some(*generation))),
            Err(error) if *error == Error::content_modified() => self.send(LoopEvent::HintsGiven(None)),
            Err(_) => {}
        }
        answer.map(|(texts, _)| texts)
    }

    async fn execute_command(&self, params: ExecuteCommandParams) -> Result<Option<Value>> {
        let command = self.answer(move |snapshot| execute_command::read(snapshot, &params)).await?;
        let result = command.result();
        match command {
            ServerCommand::SetSignificance(level) => self.send(LoopEvent::Significance(level)),
            ServerCommand::Reload => self.send(LoopEvent::Reload),
            ServerCommand::Generate(document) => self.make(document.edit, document.messages),
        }
        Ok(result)
    }

    async fn code_action_resolve(&self, action: CodeAction) -> Result<CodeAction> {
        let resolved = self.answer(move |snapshot| code_actions::resolve(snapshot, &action)).await;
        let (action, messages) = resolved?;
        let client = self.client.clone();
        tokio::spawn(async move { tell(&client, messages).await });
        Ok(action)
    }
}

/// Writes a result as the JSON of the answer: a long one, since `tower-lsp` makes a tree of values of each result, which takes
/// several times as long, or one that `lsp-types` does not have. Returns it if that is impossible.
fn written<T: Serialize>(result: T) -> Option<T> {
    let json = serde_json::to_string(&result).ok();
    match REQUEST.try_with(|request| json.is_some_and(|json| request.result.set(json).is_ok())) {
        Ok(true) => None,
        Ok(false) | Err(_) => Some(result),
    }
}

/// Returns the files and folders that a list of objects with addresses names.
fn files_of(list: &Value) -> impl Iterator<Item = PathBuf> {
    list.as_array().into_iter().flatten().filter_map(|it| file_at(it["uri"].as_str()?))
}

/// Returns the folders that a client has open, in the words of this version of the protocol, else of an earlier one.
fn folders_of(params: &Value) -> Vec<PathBuf> {
    if params["workspaceFolders"].is_array() {
        return files_of(&params["workspaceFolders"]).collect();
    }
    let root = match params["rootUri"].as_str() {
        Some(uri) => file_at(uri),
        None => params["rootPath"].as_str().map(PathBuf::from).filter(|path| path.is_absolute()),
    };
    root.into_iter().collect()
}
