//! The language server.
//!
//! ```text
//! stdin ── frame ── transport ── tower-lsp ── backend ──events──▶ main loop (owns the database)
//!                       │                        ▲                    │ snapshot
//! stdout ◀─ frame ──────┘◀── publisher ◀─────────┴──────answer──── worker (handlers, check)
//! ```
//!
//! | file | does |
//! |---|---|
//! | `frame.rs` | messages on a byte stream |
//! | `transport.rs` | order, panics, the ways in which a session ends |
//! | `backend.rs`, `event.rs` | the methods: each an event for the main loop |
//! | `answering.rs` | which text a request is about |
//! | `main_loop.rs` | one thread, one database; edits in, snapshots out |
//! | `main_loop/restart.rs` | the same with an empty database: a reload, and after a panic |
//! | `project.rs` | the project that answers for a file |
//! | `staleness.rs` | whether the workspaces and the published diagnostics are outdated |
//! | `documents.rs`, `rope.rs`, `position.rs` | the client's texts, and its positions in them |
//! | `snapshot.rs` | what a worker reads, and how its jobs end |
//! | `handlers/` | a file for each method that is answered |
//! | `capabilities.rs`, `commands.rs` | what the client can do, and the commands of client and server |
//! | `server_capabilities.rs` | what the server can do |
//! | `to_proto.rs`, `diagnostics.rs` | results in the types of the protocol |
//! | `generate.rs` | what generating Orocos packages would do to the client's files |
//! | `check.rs`, `items.rs`, `publisher.rs` | what is published after a change |
//! | `progress.rs` | that a check takes long |
//! | `outbox.rs`, `outgoing.rs` | messages that wait: those of the server, and all until they are written |
//! | `pulls.rs` | what a client was given that asks instead |
//! | `pages.rs` | the pages of the diagnostics as files, for the links behind their codes |
//! | `settings.rs` | what a user can set in his editor |
//! | `tokens.rs` | which colours of names the client was given |
//! | `watcher.rs`, `looks.rs` | files that change outside the client: events of the system, and what no event tells |
//! | `mirror.rs` | recording a session |
//! | `command.rs` | `mauve lsp` |
//!
//! Nothing waits in a handler, nothing is analysed on the thread that reads, and an edit ends whatever is outdated by it.
//!
//! This crate must never know the commands of the command line but its own, `mauve lsp`.

mod answering;
mod backend;
mod capabilities;
mod check;
mod command;
mod commands;
mod diagnostics;
mod documents;
mod event;
mod frame;
mod generate;
mod handlers;
mod items;
mod looks;
mod main_loop;
mod mirror;
mod outbox;
mod outgoing;
mod pages;
mod plain_text;
mod position;
mod progress;
mod project;
mod publisher;
mod pulls;
mod rope;
mod server_capabilities;
mod settings;
mod snapshot;
mod staleness;
mod to_proto;
mod tokens;
mod transport;
mod typing;
mod watcher;

use std::io::Write;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use tokio::sync::{mpsc as channel, oneshot, watch};
use tower_lsp::LspService;

pub use command::Lsp;

use backend::Backend;
use frame::MessageFrame;
use main_loop::MainLoop;
use mirror::{MessageSide, Mirror};
use outbox::{Outbox, Refresh};
use outgoing::{Backlog, Outgoing};
use progress::{ServerWork, ShownProgress};
use publisher::Publisher;
use transport::{SessionStreams, serve};

/// So many messages of the client are read ahead, and so many bytes.
const READ_AHEAD: usize = 1024;
const READ_BUFFER: usize = 1 << 16;

/// So many jobs run at once; more than there are processors, since one may wait for what another computes.
const WORKERS: usize = 16;

/// So many answers are made JSON at once, beside the thread that takes the client's messages: some have 100 MB.
const WRITERS: usize = 2;

/// How long to wait until the client has read the last messages.
const FAREWELL: Duration = Duration::from_secs(1);

/// Serves one client on these streams until it is done; gives the exit code, see [`transport::serve`]. If it
/// `allows_outside`, projects may read files outside their folders. It ends with the process of the `client`, if that is known.
fn run(
    input: impl std::io::Read + Send + 'static,
    output: impl Write + Send + 'static,
    mirror: Option<Mirror>,
    allows_outside: bool,
    client: Option<u32>,
) -> Result<u8, String> {
    let failed = |error: std::io::Error| format!("the server cannot start: {error}");
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(WRITERS)
        .enable_time()
        .max_blocking_threads(WORKERS)
        .build()
        .map_err(failed)?;
    let (frames, incoming) = channel::channel(READ_AHEAD);
    let (outgoing, messages) = channel::unbounded_channel();
    let (ended, main_loop_ended) = oneshot::channel();
    let (events, inbox) = mpsc::channel();
    let outbox = Arc::new(Outbox::default());
    let backlog = Arc::new(Backlog::default());

    let (work, present_work) = watch::channel(ServerWork::default());
    let shown = ShownProgress::default();
    let publisher = Publisher::new(Arc::clone(&outbox));
    let (sender, workers) = (events.clone(), runtime.handle().clone());
    let main_loop = MainLoop::new(sender, workers, publisher, work, allows_outside);
    let spawn = |name: &str, thread: Box<dyn FnOnce() + Send>| {
        std::thread::Builder::new().name(name.to_owned()).spawn(thread).map_err(failed)
    };
    spawn(
        "main loop",
        Box::new(move || {
            if let Some(message) = main_loop.run(&inbox) {
                mauve_projects::output::say(&format!("a second defect of the main loop: {message}"));
                let _ = ended.send(message);
            }
        }),
    )?;
    let said = mirror.clone();
    spawn("reader", Box::new(move || read(input, &frames, said.as_ref())))?;
    let written = Arc::clone(&backlog);
    let (farewell, last_words) = mpsc::channel();
    spawn(
        "writer",
        Box::new(move || {
            write(output, messages, &written, mirror.as_ref());
            let _ = farewell.send(());
        }),
    )?;

    let code = runtime.block_on(async {
        let build = LspService::build(|client| {
            tokio::spawn(progress::show(client.clone(), present_work, shown.clone()));
            for what in Refresh::ALL {
                let (outbox, client) = (Arc::clone(&outbox), client.clone());
                tokio::spawn(async move { outbox.have_asked(what, client).await });
            }
            Backend::new(client, events, shown)
        });
        let (service, socket) = backend::with_custom_methods(build).finish();
        let main_loop = main_loop_ended;
        serve(service, socket, SessionStreams { incoming, outgoing, backlog, outbox, client, main_loop })
            .await
    });
    let _ = last_words.recv_timeout(FAREWELL);
    // Running jobs are not waited for.
    runtime.shutdown_background();
    Ok(code)
}

fn read(input: impl std::io::Read, frames: &channel::Sender<MessageFrame>, mirror: Option<&Mirror>) {
    let mut input = std::io::BufReader::with_capacity(READ_BUFFER, input);
    loop {
        match frame::read(&mut input) {
            Ok(Some(frame)) => {
                if let (Some(mirror), Ok(message)) = (mirror, &frame) {
                    mirror.record(MessageSide::Client, message);
                }
                if frames.blocking_send(frame).is_err() {
                    return;
                }
            }
            Ok(None) => return,
            Err(error) => {
                tracing::error!("the client's stream: {error}");
                mauve_projects::output::say(&format!("cannot read the editor's messages: {error}"));
                return;
            }
        }
    }
}

fn write(
    output: impl Write,
    mut messages: channel::UnboundedReceiver<Outgoing>,
    backlog: &Backlog,
    mirror: Option<&Mirror>,
) {
    let mut output = std::io::BufWriter::new(output);
    while let Some(Outgoing { message, written }) = messages.blocking_recv() {
        if let Some(mirror) = mirror
            && let Ok(message) = serde_json::from_str(&message)
        {
            mirror.record(MessageSide::Server, &message);
        }
        if let Err(error) = frame::write(&mut output, &message) {
            tracing::error!("cannot write to the client: {error}");
            return;
        }
        backlog.written();
        if let Some(written) = written {
            let _ = written.send(());
        }
    }
}
