//! Sends the messages that the server initiates: diagnostics and refresh requests. Only the newest diagnostics are
//! kept, so a slow client gets the state at the time when it reads.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use mauve_projects::harmless::harmless;
use tower_lsp::lsp_types::Url;

use super::diagnostics;
use super::items::{DiagnosticsByFile, Items};
use super::outbox::{Outbox, Refresh};
use super::pulls::Pulls;

/// The published diagnostics, and the messages to send.
#[derive(Default)]
pub(crate) struct Publisher {
    published: DiagnosticsByFile,
    pub(crate) hints: BTreeMap<Url, u64>,
    pub(crate) lenses: BTreeMap<Url, u64>,
    warnings: BTreeSet<String>,
    /// The answers to a client that pulls diagnostics of open files.
    pulls: Option<Pulls>,
    /// Whether the client pulls the diagnostics of all files.
    pulls_all: bool,
    pub(crate) outbox: Arc<Outbox>,
}

impl Publisher {
    /// Creates a publisher of messages that [`Outbox::next`] returns.
    pub(crate) fn new(outbox: Arc<Outbox>) -> Publisher {
        Publisher { outbox, ..Publisher::default() }
    }

    /// Switches to pulled diagnostics for open files.
    pub(crate) fn pull(&mut self) {
        self.pulls = Some(Pulls::new(Items::default().id()));
    }

    /// Records that the client pulls the diagnostics of a version of a file, or of all files; then none are published.
    pub(crate) fn asked(&mut self, about: Option<(Url, Option<i32>)>) {
        if let Some(pulls) = &mut self.pulls {
            let all = about.is_none();
            pulls.asked(about);
            if all && !self.pulls_all {
                self.pulls_all = true;
                let told: DiagnosticsByFile = std::mem::take(&mut self.published);
                pulls.found_before(told.iter().map(|(url, (_, items))| (url.clone(), items.id())));
                self.outbox.put(|waiting| {
                    waiting.diagnostics.extend(told.into_keys().map(|url| (url, (None, Items::default()))));
                });
            }
        }
    }

    /// Records the answer to a pull, or its failure.
    pub(crate) fn answered(&mut self, note: impl FnOnce(&mut Pulls) -> bool) {
        if self.pulls.as_mut().is_some_and(note) {
            self.refresh(Refresh::Diagnostics);
        }
    }

    /// Removes the pulled files from `found`, and requests a refresh if their diagnostics are new.
    fn pulled(&mut self, found: &mut DiagnosticsByFile) {
        let Some(pulls) = &mut self.pulls else { return };
        let all = self.pulls_all;
        let is_asked = |version: &Option<i32>| all || version.is_some();
        let asked = found.iter().filter(|(_, (version, _))| is_asked(version));
        let asked =
            asked.map(|(url, (version, items))| (url.clone(), (*version, Some(items.id())))).collect();
        found.retain(|_, (version, _)| !is_asked(version));
        if pulls.checked(asked) {
            self.refresh(Refresh::Diagnostics);
        }
    }

    /// Publishes the differences from the last diagnostics: changed diagnostics, new versions, and empty lists for
    /// files that are not in `found`.
    pub(crate) fn publish(&mut self, mut found: DiagnosticsByFile) {
        self.pulled(&mut found);
        let gone: Vec<Url> = self.published.keys().filter(|url| !found.contains_key(*url)).cloned().collect();
        let gone = gone.into_iter().map(|url| (url, (None, Items::default())));
        let new: DiagnosticsByFile = found
            .iter()
            .filter(|(url, found)| self.published.get(*url) != Some(*found))
            .map(|(url, found)| (url.clone(), found.clone()))
            .chain(gone)
            .collect();
        found.retain(|_, (version, items)| version.is_some() || !items.is_empty());
        self.published = found;
        self.outbox.put(|waiting| waiting.diagnostics.extend(new));
    }

    /// Returns the open documents that have no published diagnostics. A client that pulls diagnostics gets none published.
    pub(crate) fn without_diagnostics<'a>(&self, open: impl Iterator<Item = &'a Url>) -> Vec<Url> {
        open.filter(|url| self.pulls.is_none() && !self.published.contains_key(*url)).cloned().collect()
    }

    /// Publishes diagnostics of [`Publisher::without_diagnostics`], before those of all files are known.
    pub(crate) fn publish_first(&mut self, found: DiagnosticsByFile) {
        self.published.extend(found.iter().map(|(url, found)| (url.clone(), found.clone())));
        self.outbox.put(|waiting| waiting.diagnostics.extend(found));
    }

    /// Records that the client has closed a file: its displayed diagnostics are unknown from now on.
    pub(crate) fn forget(&mut self, url: &Url) {
        if let Some((version, _)) = self.published.get_mut(url) {
            *version = Some(i32::MIN);
        }
        if let Some(pulls) = &mut self.pulls {
            pulls.closed(url, self.pulls_all);
        }
    }

    /// Has the next diagnostics published again, or requested again, even unchanged ones.
    pub(crate) fn publish_all_again(&mut self) {
        self.published.values_mut().for_each(|(version, _)| *version = Some(i32::MIN));
        self.hints.clear();
        self.lenses.clear();
        if self.pulls.is_some() {
            self.refresh(Refresh::Diagnostics);
        }
    }

    /// Replaces outdated diagnostics by a message that the analysis has failed.
    pub(crate) fn panicked(&mut self, open: BTreeMap<Url, i32>, message: &str) {
        let items = Items::of([diagnostics::defect(message)]);
        let known = |(url, version)| (url, (Some(version), items.clone()));
        self.publish(open.into_iter().map(known).collect());
        self.hints.clear();
        self.lenses.clear();
        self.defect(message);
    }

    /// Shows a defect of the server to the user.
    pub(crate) fn defect(&mut self, message: &str) {
        self.warn(&format!("A defect of mauve: {message}. Please report it."));
    }

    /// Requests a refresh from the client.
    pub(crate) fn refresh(&self, what: Refresh) {
        self.outbox.lock().refreshes.insert(what);
        self.outbox.refreshes[what as usize].notify_one();
    }

    /// Shows a warning, unless it was shown before.
    pub(crate) fn warn(&mut self, message: &str) {
        let message = harmless(message);
        tracing::warn!("{message}");
        if self.warnings.insert(message.clone()) {
            self.outbox.put(|waiting| waiting.warnings.push_back(message));
        }
    }
}

/// Replaces hashes. Returns whether one is new: what the client has before the first check is unknown.
pub(crate) fn replace(known: &mut BTreeMap<Url, u64>, hashes: BTreeMap<Url, u64>) -> bool {
    let is_changed = hashes.iter().any(|(url, hash)| known.get(url) != Some(hash));
    *known = hashes;
    is_changed
}
