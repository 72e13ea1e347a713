//! What the server says by itself: diagnostics, and that hints are to be asked for again. In order, and never more than the
//! newest: a client that reads slowly gets what holds when it reads.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::Notify;
use tower_lsp::Client;
use tower_lsp::lsp_types::{Diagnostic, DiagnosticSeverity, MessageType, NumberOrString, Range, Url};

/// For each file, the version that was checked, if it is open, and what was found.
type Found = BTreeMap<Url, (Option<i32>, Vec<Diagnostic>)>;

/// What was published, and what is to be.
pub(crate) struct Publisher {
    published: Found,
    hints: BTreeMap<Url, u64>,
    warnings: BTreeSet<String>,
    outbox: Arc<Outbox>,
}

/// What waits to be sent.
#[derive(Default)]
pub(crate) struct Outbox {
    waiting: Mutex<Waiting>,
    more: Notify,
}

#[derive(Default)]
struct Waiting {
    diagnostics: Found,
    warnings: Vec<String>,
    refresh_hints: bool,
    refresh_lenses: bool,
}

impl Publisher {
    /// One that has published nothing; what is in `outbox` is sent by [`Outbox::send_to`].
    pub(crate) fn new(outbox: Arc<Outbox>) -> Publisher {
        Publisher { published: BTreeMap::new(), hints: BTreeMap::new(), warnings: BTreeSet::new(), outbox }
    }

    /// Publishes what is new in `found`: other diagnostics, or another version; and that files which are not in it have
    /// none any more. Says whether the inlay hints of a file that is still open say something else than before.
    pub(crate) fn publish(&mut self, mut found: Found, hints: BTreeMap<Url, u64>) -> bool {
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
    }

    /// Instead of what may not hold any more, publishes that nothing is known.
    pub(crate) fn panicked(&mut self, open: BTreeMap<Url, i32>, message: &str) {
        let diagnostic = Diagnostic {
            range: Range::default(),
            severity: Some(DiagnosticSeverity::ERROR),
            code: Some(NumberOrString::String("internal-error".to_owned())),
            source: Some("mauve".to_owned()),
            message: format!(
                "a defect of mauve: {message}. Nothing was analysed, and no response time is known; please report it"
            ),
            ..Diagnostic::default()
        };
        let known = |(url, version)| (url, (Some(version), vec![diagnostic.clone()]));
        self.publish(open.into_iter().map(known).collect(), BTreeMap::new());
        self.warn(format!("A defect of mauve: {message}. Please report it."));
    }

    /// Has the client ask for its inlay hints again.
    pub(crate) fn refresh_hints(&self) {
        self.outbox.put(|waiting| waiting.refresh_hints = true);
    }

    /// Has the client ask for its code lenses again.
    pub(crate) fn refresh_lenses(&self) {
        self.outbox.put(|waiting| waiting.refresh_lenses = true);
    }

    /// Shows a warning, each once.
    pub(crate) fn warn(&mut self, message: String) {
        tracing::warn!("{message}");
        if self.warnings.insert(message.clone()) {
            self.outbox.put(|waiting| waiting.warnings.push(message));
        }
    }
}

impl Outbox {
    fn put(&self, change: impl FnOnce(&mut Waiting)) {
        change(&mut self.waiting.lock().unwrap_or_else(PoisonError::into_inner));
        self.more.notify_one();
    }

    /// Sends what is put in, as fast as the client reads.
    pub(crate) async fn send_to(&self, client: Client) {
        loop {
            self.more.notified().await;
            let Waiting { diagnostics, warnings, refresh_hints, refresh_lenses } =
                std::mem::take(&mut *self.waiting.lock().unwrap_or_else(PoisonError::into_inner));
            for message in warnings {
                client.show_message(MessageType::WARNING, message).await;
            }
            for (url, (version, diagnostics)) in diagnostics {
                client.publish_diagnostics(url, diagnostics, version).await;
            }
            if refresh_hints {
                // The client may take its time, or never answer: nobody waits for that.
                let client = client.clone();
                tokio::spawn(async move {
                    if let Err(error) = client.inlay_hint_refresh().await {
                        tracing::warn!("inlay hints were not asked for again: {error}");
                    }
                });
            }
            if refresh_lenses {
                let client = client.clone();
                tokio::spawn(async move {
                    if let Err(error) = client.code_lens_refresh().await {
                        tracing::warn!("code lenses were not asked for again: {error}");
                    }
                });
            }
        }
    }
}
