//! The messages of the server that wait to be sent.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::Notify;
use tokio::time::timeout;
use tower_lsp::Client;
use tower_lsp::jsonrpc::Request;
use tower_lsp::lsp_types::notification::{Notification, PublishDiagnostics};
use tower_lsp::lsp_types::{MessageType, Url};

use super::items::{DiagnosticsByFile, Items};

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
    pub(crate) warnings: Vec<String>,
    pub(crate) refreshes: BTreeSet<Refresh>,
    /// How many diagnostics and refresh requests were sent.
    sent: usize,
    /// The parameters of [`Announcement`]s on their way to the client, as JSON, by their numbers.
    announced: BTreeMap<u64, String>,
    /// The number of the next [`Announcement`].
    next: u64,
}

/// `textDocument/publishDiagnostics`, with the number of its parameters in [`Waiting::announced`]: `tower-lsp` makes a tree of
/// values of parameters, which takes several times as long as writing them, and unchanged diagnostics are written already.
enum Announcement {}

impl Notification for Announcement {
    type Params = u64;
    const METHOD: &'static str = PublishDiagnostics::METHOD;
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

    /// Keeps the parameters of an [`Announcement`]; returns their number.
    fn announce(&self, url: &Url, version: Option<i32>, items: &Items) -> Option<u64> {
        let uri = serde_json::to_string(url).ok()?;
        let version = version.map_or_else(String::new, |version| format!(r#""version":{version},"#));
        let mut waiting = self.lock();
        let number = waiting.next;
        waiting.next += 1;
        let params = format!(r#"{{"uri":{uri},{version}"diagnostics":{}}}"#, items.json());
        waiting.announced.insert(number, params);
        Some(number)
    }

    /// Returns a message to the client as JSON.
    pub(crate) fn message(&self, request: &Request) -> String {
        let number = request.params().filter(|_| request.method() == Announcement::METHOD);
        let announced = number.and_then(|number| {
            let number = number.as_u64()?;
            let mut waiting = self.lock();
            let params = waiting.announced.remove(&number);
            // Earlier ones were not sent.
            waiting.announced = waiting.announced.split_off(&number);
            params
        });
        match announced {
            Some(params) => {
                format!(r#"{{"jsonrpc":"2.0","method":"{}","params":{params}}}"#, Announcement::METHOD)
            }
            None => serde_json::to_string(request).unwrap_or_default(),
        }
    }

    /// Sends messages as fast as the client reads.
    pub(crate) async fn send_to(&self, client: Client) {
        loop {
            self.more.notified().await;
            let (diagnostics, warnings) = {
                let mut waiting = self.lock();
                waiting.sent += waiting.diagnostics.len();
                (std::mem::take(&mut waiting.diagnostics), std::mem::take(&mut waiting.warnings))
            };
            for message in warnings {
                client.show_message(MessageType::WARNING, message).await;
            }
            for (url, (version, items)) in diagnostics {
                let Some(number) = self.announce(&url, version, &items) else { continue };
                client.send_notification::<Announcement>(number).await;
            }
        }
    }
}
