//! What the server says by itself: diagnostics, and that hints are to be asked for again. In order, and never more than the
//! newest: a client that reads slowly gets what holds when it reads.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;
use tokio::time::timeout;
use tower_lsp::Client;
use tower_lsp::lsp_types::{MessageType, Url};

use super::PATIENCE;
use super::check::{Found, result_id};
use super::pulls::{Pulls, ResultId};
use super::to_proto;
use crate::harmless::harmless;

/// What was published, and what is to be.
#[derive(Default)]
pub(crate) struct Publisher {
    published: Found,
    hints: BTreeMap<Url, u64>,
    warnings: BTreeSet<String>,
    /// Where the client asks about open files, what it was given.
    pulls: Option<Pulls>,
    /// It asks about all others too.
    pulls_all: bool,
    outbox: Arc<Outbox>,
}

/// What waits to be sent.
#[derive(Default)]
pub(crate) struct Outbox {
    waiting: Mutex<Waiting>,
    more: Notify,
    refreshes: [Notify; Refresh::ALL.len()],
}

#[derive(Default)]
struct Waiting {
    diagnostics: Found,
    warnings: Vec<String>,
    refreshes: BTreeSet<Refresh>,
    /// How many diagnostics and refresh requests were sent.
    sent: usize,
}

/// What a client may be told to ask for again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Refresh {
    Diagnostics,
    Hints,
    Lenses,
    Tokens,
}

impl Refresh {
    /// All of them.
    pub(crate) const ALL: [Refresh; 4] =
        [Refresh::Diagnostics, Refresh::Hints, Refresh::Lenses, Refresh::Tokens];
}

impl Publisher {
    /// Creates a publisher of messages that [`Outbox::send_to`] sends.
    pub(crate) fn new(outbox: Arc<Outbox>) -> Publisher {
        Publisher { outbox, ..Publisher::default() }
    }

    /// Returns what waits to be sent.
    pub(crate) fn outbox(&self) -> Arc<Outbox> {
        Arc::clone(&self.outbox)
    }

    /// For a client that asks about open files instead of being told.
    pub(crate) fn pull(&mut self) {
        self.pulls = Some(Pulls::new(result_id(&[])));
    }

    /// The client asks about a version of a file, or about all; then it is told of none any more.
    pub(crate) fn asked(&mut self, about: Option<(Url, Option<i32>)>) {
        if let Some(pulls) = &mut self.pulls {
            let all = about.is_none();
            pulls.asked(about);
            if all && !self.pulls_all {
                self.pulls_all = true;
                let told: Found = std::mem::take(&mut self.published);
                pulls.found_before(told.iter().map(|(url, (_, found))| (url.clone(), result_id(found))));
                self.outbox.put(|waiting| {
                    waiting.diagnostics.extend(told.into_keys().map(|url| (url, (None, Vec::new()))));
                });
            }
        }
    }

    /// The client was given something, or not.
    pub(crate) fn answered(&mut self, note: impl FnOnce(&mut Pulls) -> bool) {
        if self.pulls.as_mut().is_some_and(note) {
            self.refresh(Refresh::Diagnostics);
        }
    }

    /// Leaves in `found` what the client is told, and has it ask for the rest where that is new.
    fn pulled(&mut self, found: &mut Found, ids: &BTreeMap<Url, ResultId>) {
        let Some(pulls) = &mut self.pulls else { return };
        let all = self.pulls_all;
        let is_asked = |version: &Option<i32>| all || version.is_some();
        let asked = found.iter().filter(|(_, (version, _))| is_asked(version));
        let asked =
            asked.map(|(url, (version, _))| (url.clone(), (*version, ids.get(url).copied()))).collect();
        found.retain(|_, (version, _)| !is_asked(version));
        if pulls.checked(asked) {
            self.refresh(Refresh::Diagnostics);
        }
    }

    /// Publishes what is new in `found`: other diagnostics, or another version; and that files which are not in it have
    /// none any more; `ids` stand for what was found in each file. Says whether the inlay hints of a file that is still open
    /// say something else than before.
    pub(crate) fn publish(
        &mut self,
        mut found: Found,
        ids: &BTreeMap<Url, ResultId>,
        hints: BTreeMap<Url, u64>,
    ) -> bool {
        self.pulled(&mut found, ids);
        let gone: Vec<Url> = self.published.keys().filter(|url| !found.contains_key(*url)).cloned().collect();
        let gone = gone.into_iter().map(|url| (url, (None, Vec::new())));
        let new: Found = found
            .iter()
            .filter(|(url, found)| self.published.get(*url) != Some(*found))
            .map(|(url, found)| (url.clone(), found.clone()))
            .chain(gone)
            .collect();
        found.retain(|_, (version, diagnostics)| version.is_some() || !diagnostics.is_empty());
        self.published = found;
        // What the client was given before the first check is not known.
        let is_another = |(url, hash): (&Url, &u64)| self.hints.get(url) != Some(hash);
        let refresh = hints.iter().any(is_another);
        self.hints = hints;
        self.outbox.put(|waiting| waiting.diagnostics.extend(new));
        refresh
    }

    /// The client has closed a file: what it shows of it is not known any more.
    pub(crate) fn forget(&mut self, url: &Url) {
        if let Some((version, _)) = self.published.get_mut(url) {
            *version = Some(i32::MIN);
        }
        if let Some(pulls) = &mut self.pulls {
            pulls.closed(url, self.pulls_all);
        }
    }

    /// Instead of what may not hold any more, publishes that nothing is known.
    pub(crate) fn panicked(&mut self, open: BTreeMap<Url, i32>, message: &str) {
        let diagnostic = to_proto::defect(message);
        let id = result_id(std::slice::from_ref(&diagnostic));
        let ids = open.keys().map(|url| (url.clone(), id)).collect();
        let known = |(url, version)| (url, (Some(version), vec![diagnostic.clone()]));
        self.publish(open.into_iter().map(known).collect(), &ids, BTreeMap::new());
        self.defect(message);
    }

    /// Shows that something of ours went wrong.
    pub(crate) fn defect(&mut self, message: &str) {
        self.warn(&format!("A defect of mauve: {message}. Please report it."));
    }

    /// Has the client ask for something again.
    pub(crate) fn refresh(&self, what: Refresh) {
        self.outbox.lock().refreshes.insert(what);
        self.outbox.refreshes[what as usize].notify_one();
    }

    /// Shows a warning, each once.
    pub(crate) fn warn(&mut self, message: &str) {
        let message = harmless(message);
        tracing::warn!("{message}");
        if self.warnings.insert(message.clone()) {
            self.outbox.put(|waiting| waiting.warnings.push(message));
        }
    }
}

impl Outbox {
    /// Has the client ask for this again, whenever it is to: one question at a time.
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

    /// Is this still to be sent? It is counted as sent then.
    fn is_due(&self, what: Refresh) -> bool {
        let mut waiting = self.lock();
        let is_due = waiting.refreshes.remove(&what);
        waiting.sent += usize::from(is_due);
        is_due
    }

    fn put(&self, change: impl FnOnce(&mut Waiting)) {
        change(&mut self.lock());
        self.more.notify_one();
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns how many diagnostics and refresh requests were sent, or none while some wait.
    pub(crate) fn sent(&self) -> Option<usize> {
        let waiting = self.lock();
        (waiting.diagnostics.is_empty() && waiting.refreshes.is_empty()).then_some(waiting.sent)
    }

    /// Sends what is put in, as fast as the client reads.
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
            for (url, (version, diagnostics)) in diagnostics {
                client.publish_diagnostics(url, diagnostics, version).await;
            }
        }
    }
}
