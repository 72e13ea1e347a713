//! Connects the byte streams with tower-lsp's service: passes messages to the service in order, and writes its answers.
//!
//! tower-lsp's own `Server` is not used. It stops reading at a message that is no JSON, and when four requests wait; it
//! lives on after `exit` while its input is open; a panic in a handler ends it. Here each message is called and polled
//! once before the next is looked at, so that a handler that begins by sending its event to the main loop keeps the order
//! of the client; then it waits in a task of its own, on another thread, which makes the answer JSON: a long answer delays
//! no message. Notifications about documents do not reach tower-lsp, see [`Backend::preprocess`].

use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::time::{Duration, Instant};

use futures::{FutureExt as _, Sink, SinkExt as _, StreamExt as _};
use mauve_projects::harmless::harmless;
use serde_json::Value;
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinSet;
use tower::Service as _;
use tower_lsp::jsonrpc::{Error, ErrorCode, Id, Request, Response};
use tower_lsp::lsp_types::MessageType;
use tower_lsp::lsp_types::notification::{Notification as _, ShowMessage};
use tower_lsp::{ClientSocket, LspService};

use super::answering::{Answering, REQUEST};
use super::backend::Backend;
use super::frame::MessageFrame;
use super::outbox::{Outbox, notification};
use super::outgoing::{Backlog, MOST_WAITING, Outgoing};

/// The two directions, and the signal that the main loop has ended.
pub(crate) struct SessionStreams {
    /// Messages of the client. Closed when its stream ends.
    pub(crate) incoming: mpsc::Receiver<MessageFrame>,
    /// Messages to the client. Closed when the client no longer reads.
    pub(crate) outgoing: mpsc::UnboundedSender<Outgoing>,
    /// The number of messages that are not yet written.
    pub(crate) backlog: Arc<Backlog>,
    /// Has messages that the server initiates, apart from requests.
    pub(crate) outbox: Arc<Outbox>,
    /// The client's process, if the command line names it.
    pub(crate) client: Option<u32>,
    /// Receives why the main loop has ended.
    pub(crate) main_loop: oneshot::Receiver<String>,
}

/// The interval for checking whether the client's process exists.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Serves until the client sends `exit`, closes the stream or ends. Returns the exit code: 0 for `exit` after
/// `shutdown`, 101 if the main loop has ended by itself, otherwise 1.
pub(crate) async fn serve(
    mut service: LspService<Backend>,
    socket: ClientSocket,
    mut streams: SessionStreams,
) -> u8 {
    let (mut to_client, mut from_client) = socket.split();
    let mut tasks: JoinSet<Option<Answer>> = JoinSet::new();
    let mut heartbeat = tokio::time::interval(HEARTBEAT);
    let mut clients: Vec<u32> = streams.client.into_iter().filter(|&client| is_alive(client)).collect();
    let mut is_shut_down = false;
    // Messages that the server initiates wait until the last one is written, so a client that does not read costs no
    // memory.
    let mut writing: Option<oneshot::Receiver<()>> = None;
    let code = |is_shut_down: bool| u8::from(!is_shut_down);
    loop {
        tokio::select! {
            frame = streams.incoming.recv(), if streams.backlog.waiting() + tasks.len() < MOST_WAITING => {
                let Some(frame) = frame else { return code(is_shut_down) };
                let received = received(service.inner(), &streams, &mut from_client, frame).await;
                let Some(request) = received else { continue };
                match request.method() {
                    "exit" => return code(is_shut_down),
                    "initialize" => clients.extend(process_of(&request).filter(|&process| is_alive(process))),
                    _ => {}
                }
                let Some(request) = service.inner().preprocess(request) else { continue };
                let is_shutdown = request.method() == "shutdown";
                let mut answer = Box::pin(answer(&mut service, request));
                match futures::poll!(&mut answer) {
                    std::task::Poll::Ready(answer) => {
                        // A request before `initialize` is refused, and the session continues.
                        is_shut_down |= is_shutdown && answer.as_ref().is_some_and(|it| !it.is_refused);
                        send(&streams, answer.and_then(|it| it.message));
                    }
                    std::task::Poll::Pending => {
                        tasks.spawn(answer);
                    }
                }
            }
            Some(answered) = tasks.join_next() => {
                send(&streams, answered.ok().flatten().and_then(|it| it.message));
            }
            Some(request) = to_client.next(), if writing.is_none() => {
                // After `shutdown`, requests that a refresh causes would be refused.
                if !is_shut_down {
                    writing = Some(put_one(&streams, serde_json::to_string(&request).unwrap_or_default()));
                }
            }
            message = streams.outbox.next(), if writing.is_none() && !is_shut_down => {
                writing = Some(put_one(&streams, message));
            }
            _ = async { if let Some(wait) = &mut writing { let _ = wait.await; } }, if writing.is_some() => {
                writing = None;
            }
            // Checks the condition above again.
            () = streams.backlog.less.notified(), if streams.backlog.waiting() > 0 => {}
            () = streams.outgoing.closed() => {
                tracing::warn!("the client no longer reads");
                return code(false);
            }
            ended = &mut streams.main_loop => {
                tracing::error!("the main loop has ended");
                put(&streams, Outgoing { message: last_words(&ended.unwrap_or_default()), written: None });
                return 101;
            }
            _ = heartbeat.tick() => {
                if !clients.iter().all(|&client| is_alive(client)) {
                    tracing::warn!("the client process has ended");
                    return code(false);
                }
            }
        }
    }
}

/// Returns the message that tells the user why the main loop has ended.
fn last_words(why: &str) -> String {
    let message = harmless(&format!("mauve ends after a second defect: {why}. Please report it."));
    let params = serde_json::json!({"type": MessageType::ERROR, "message": message});
    notification(ShowMessage::METHOD, &params.to_string())
}

/// Returns the request or notification of a frame. Handles all other frames.
async fn received(
    backend: &Backend,
    streams: &SessionStreams,
    responses: &mut (impl Sink<Response> + Unpin),
    frame: MessageFrame,
) -> Option<Request> {
    let refusal = match frame.map(understood) {
        Ok(Ok(ClientMessage::Request(request))) => match request.id() {
            // tower-lsp does not answer these.
            Some(id) if request.method().starts_with("$/") => {
                Response::from_error(id.clone(), Error::method_not_found())
            }
            _ => return Some(request),
        },
        Ok(Ok(ClientMessage::Response(response))) => {
            // A response without a request is ignored.
            let answered = AssertUnwindSafe(responses.send(response)).catch_unwind().await;
            if !matches!(answered, Ok(Ok(()))) {
                tracing::warn!("an answer to an unknown request");
            }
            return None;
        }
        Ok(Err(NoMessage { response, is_answer })) => {
            if !is_answer {
                backend.texts_unknown();
            }
            response
        }
        Err(why) => {
            tracing::warn!("an invalid message: not JSON: {why}");
            backend.texts_unknown();
            let error = Error { message: format!("not JSON: {why}").into(), ..Error::parse_error() };
            Response::from_error(Id::Null, error)
        }
    };
    send(streams, json(&refusal));
    None
}

/// An answer as JSON: that of 300 MB is made beside the thread that takes messages.
struct Answer {
    is_refused: bool,
    message: Option<String>,
}

/// Calls the service and returns its answer: an error after a panic, and none to a notification.
fn answer(
    service: &mut LspService<Backend>,
    request: Request,
) -> impl Future<Output = Option<Answer>> + Send + use<> {
    let (id, method, begin) = (request.id().cloned(), request.method().to_owned(), Instant::now());
    let answering = Arc::new(request.params().map_or_else(Answering::default, Answering::with));
    let answer = AssertUnwindSafe(service.call(request)).catch_unwind();
    let answer = REQUEST.scope(Arc::clone(&answering), answer);
    async move {
        let response = match answer.await {
            Ok(answer) => answer.ok().flatten(),
            Err(_) => id.map(|id| Response::from_error(id, Error::internal_error())),
        };
        let outcome = response.as_ref().and_then(Response::error);
        let outcome = outcome.map_or_else(String::new, |error| format!("{error}, "));
        tracing::debug!("{method}: {outcome}{:.1?}", begin.elapsed());
        response.map(|response| Answer {
            is_refused: response.error().is_some(),
            message: match answering.result.get().filter(|_| response.is_ok()) {
                Some(result) => with_result(response.id(), result),
                None => json(&response),
            },
        })
    }
}

fn send(streams: &SessionStreams, message: Option<String>) {
    if let Some(message) = message {
        put(streams, Outgoing { message, written: None });
    }
}

/// Returns the answer with a result that is JSON already.
fn with_result(id: &Id, result: &str) -> Option<String> {
    Some(format!(r#"{{"jsonrpc":"2.0","result":{result},"id":{}}}"#, serde_json::to_string(id).ok()?))
}

fn json(response: &Response) -> Option<String> {
    let message = serde_json::to_string(response);
    message.inspect_err(|error| tracing::error!("an answer that is not JSON: {error}")).ok()
}

/// Sends a message that the server initiates; returns the signal that it is written.
fn put_one(streams: &SessionStreams, message: String) -> oneshot::Receiver<()> {
    let (written, wait) = oneshot::channel();
    put(streams, Outgoing { message, written: Some(written) });
    wait
}

fn put(streams: &SessionStreams, message: Outgoing) {
    streams.backlog.put(&streams.outgoing, message);
}

const WITHOUT_PARAMS: [&str; 2] = ["shutdown", "mauve/status"];

enum ClientMessage {
    Request(Request),
    Response(Response),
}

/// What a message that is none is answered with.
struct NoMessage {
    response: Response,
    /// Whether it can only be an answer, which changes no text. JavaScript omits `undefined` values: an answer may have only
    /// its id.
    is_answer: bool,
}

/// Parses a JSON value as a message.
fn understood(mut message: Value) -> Result<ClientMessage, NoMessage> {
    // Some clients send `null` for missing parameters or methods.
    let takes_none = message["method"].as_str().is_some_and(|it| WITHOUT_PARAMS.contains(&it));
    if message.get("params").is_some_and(|params| params.is_null() || takes_none)
        && let Some(fields) = message.as_object_mut()
    {
        fields.remove("params");
    }
    let id = message.get("id").and_then(|id| serde_json::from_value(id.clone()).ok()).unwrap_or(Id::Null);
    let is_request = message.get("method").is_some();
    let is_answer = !is_request && message.get("id").is_some() && message.get("params").is_none();
    let understood = match is_request {
        true => serde_json::from_value(message).map(ClientMessage::Request),
        false => serde_json::from_value(message).map(ClientMessage::Response),
    };
    understood.map_err(|error| {
        let message = format!("neither a request nor an answer: {error}");
        let error = Error { code: ErrorCode::InvalidRequest, message: message.into(), data: None };
        NoMessage { response: Response::from_error(if is_request { id } else { Id::Null }, error), is_answer }
    })
}

fn process_of(initialize: &Request) -> Option<u32> {
    u32::try_from(initialize.params()?.get("processId")?.as_u64()?).ok()
}

/// Returns whether a process is there. (One in another container is not, and is no client to wait for.)
fn is_alive(process: u32) -> bool {
    let process = i32::try_from(process).ok().and_then(rustix::process::Pid::from_raw);
    // A process that may not be signalled exists as well.
    process.is_some_and(|process| rustix::process::test_kill_process(process) != Err(rustix::io::Errno::SRCH))
}
