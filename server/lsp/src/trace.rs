//! `$/logTrace`: the requests and checks of the server with their times, for a client that asks for them by `initialize` or
//! `$/setTrace`.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use serde_json::{Value, json};
use tokio::sync::mpsc::WeakUnboundedSender;

use super::outgoing::{Backlog, MOST_WAITING, Outgoing};

/// How much the client wants to be told, and the way to the client.
pub(crate) struct Trace {
    is_on: AtomicBool,
    is_verbose: AtomicBool,
    generation: AtomicU64,
    /// Weak, since the writer ends when there are no senders.
    outgoing: WeakUnboundedSender<Outgoing>,
    backlog: Arc<Backlog>,
}

impl Trace {
    /// Creates a trace that is off.
    pub(crate) fn new(outgoing: WeakUnboundedSender<Outgoing>, backlog: Arc<Backlog>) -> Trace {
        Trace {
            is_on: AtomicBool::new(false),
            is_verbose: AtomicBool::new(false),
            generation: AtomicU64::new(0),
            outgoing,
            backlog,
        }
    }

    /// Sets the level: `off`, `messages` or `verbose`. Other values change nothing.
    pub(crate) fn set(&self, level: &Value) {
        let (is_on, is_verbose) = match level.as_str() {
            Some("off") => (false, false),
            Some("messages") => (true, false),
            Some("verbose") => (true, true),
            _ => return tracing::warn!("unknown level of traces: {level}"),
        };
        self.is_on.store(is_on, Ordering::Relaxed);
        self.is_verbose.store(is_verbose, Ordering::Relaxed);
    }

    /// Notes the generation that requests are answered from.
    pub(crate) fn note_generation(&self, generation: u64) {
        self.generation.store(generation, Ordering::Relaxed);
    }

    /// Tells the client what was done, with the details for the level `verbose`. Tells nothing while too many messages wait.
    pub(crate) fn log(&self, done: impl FnOnce() -> String, details: impl FnOnce(u64) -> String) {
        if !self.is_on.load(Ordering::Relaxed) || self.backlog.waiting() >= MOST_WAITING {
            return;
        }
        let mut params = json!({"message": done()});
        if self.is_verbose.load(Ordering::Relaxed) {
            params["verbose"] = details(self.generation.load(Ordering::Relaxed)).into();
        }
        if let Some(outgoing) = self.outgoing.upgrade() {
            let message = json!({"jsonrpc": "2.0", "method": "$/logTrace", "params": params}).to_string();
            self.backlog.put(&outgoing, Outgoing { message, written: None });
        }
    }
}

/// Formats a time for a trace.
pub(crate) fn milliseconds(time: Duration) -> String {
    format!("{:.1} ms", time.as_secs_f64() * 1e3)
}
