//! The messages of the server that wait to be sent.

use std::collections::{BTreeSet, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::Notify;
use tokio::time::timeout;
use tower_lsp::Client;
use tower_lsp::lsp_types::MessageType;
use tower_lsp::lsp_types::notification::{Notification as _, PublishDiagnostics, ShowMessage};

use super::items::DiagnosticsByFile;

/// A client that does not answer a question for so long is not waited for.
pub(crate) const PATIENCE: Duration = Duration::from_secs(30);

/// The messages that wait to be sent.
#[derive(Default)]
pub(crate) struct Outbox {
    waiting: Mutex<Waiting>,
    more: Notify,
    pub(crate) refreshes: [Notify; Refresh::ALL.len()],
}

#[derive(Default)]
pub(crate) struct Waiting {
    pub(crate) diagnostics: DiagnosticsByFile,
    pub(crate) warnings: VecDeque<String>,
    pub(crate) refreshes: BTreeSet<Refresh>,
    /// How many diagnostics and refresh requests were sent.
    sent: usize,
}

/// The kinds of data that the client can be requested to refresh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Refresh {
    Diagnostics,
    Hints,
    Lenses,
    Tokens,
}

impl Refresh {
    /// All kinds.
    pub(crate) const ALL: [Refresh; 4] =
        [Refresh::Diagnostics, Refresh::Hints, Refresh::Lenses, Refresh::Tokens];
}

impl Outbox {
    /// Sends refresh requests of one kind when they are due, one at a time.
    pub(crate) async fn have_asked(&self, what: Refresh, client: Client) {
        loop {
            self.refreshes[what as usize].notified().await;
            if !self.is_due(what) {
                continue;
            }
            let question = async {
                match what {
                    Refresh::Diagnostics => client.workspace_diagnostic_refresh().await,
                    Refresh::Hints => client.inlay_hint_refresh().await,
                    Refresh::Lenses => client.code_lens_refresh().await,
                    Refresh::Tokens => client.semantic_tokens_refresh().await,
                }
            };
            match timeout(PATIENCE, question).await {
                Ok(Ok(())) => {}
                Ok(Err(error)) => tracing::warn!("the client refused to refresh {what:?}: {error}"),
                Err(_) => tracing::warn!("the client does not answer the request to refresh {what:?}"),
            }
        }
    }

    /// Returns whether a refresh is due, and counts it as sent.
    fn is_due(&self, what: Refresh) -> bool {
        let mut waiting = self.lock();
        let is_due = waiting.refreshes.remove(&what);
        waiting.sent += usize::from(is_due);
        is_due
    }

    pub(crate) fn put(&self, change: impl FnOnce(&mut Waiting)) {
        change(&mut self.lock());
        self.more.notify_one();
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns how many diagnostics and refresh requests were sent, or none while some wait.
    pub(crate) fn sent(&self) -> Option<usize> {
        let waiting = self.lock();
        (waiting.diagnostics.is_empty() && waiting.refreshes.is_empty()).then_some(waiting.sent)
    }

    /// Waits for the next message to the client, and returns it as JSON: a warning, or the diagnostics of a file.
    pub(crate) async fn next(&self) -> String {
        loop {
            if let Some(message) = self.pop() {
                return message;
            }
            self.more.notified().await;
        }
    }

    fn pop(&self) -> Option<String> {
        let mut waiting = self.lock();
        if let Some(message) = waiting.warnings.pop_front() {
            let params = serde_json::json!({"type": MessageType::WARNING, "message": message});
            return Some(notification(ShowMessage::METHOD, &params.to_string()));
        }
        let (url, (version, items)) = waiting.diagnostics.pop_first()?;
        waiting.sent += 1;
        let uri = serde_json::to_string(&url).ok()?;
        let version = version.map_or_else(String::new, |version| format!(r#""version":{version},"#));
        // `tower-lsp` makes a tree of values of parameters, which takes several times as long as writing them, and unchanged
        // diagnostics are written already.
        let params = format!(r#"{{"uri":{uri},{version}"diagnostics":{}}}"#, items.json());
        Some(notification(PublishDiagnostics::METHOD, &params))
    }
}

/// Returns a notification with these parameters as JSON.
pub(crate) fn notification(method: &str, params: &str) -> String {
    format!(r#"{{"jsonrpc":"2.0","method":"{method}","params":{params}}}"#)
}
