//! What a client that asks for diagnostics was given, so that it is told to ask again where that no longer holds, and only
//! there.

use std::collections::BTreeMap;

use tower_lsp::lsp_types::Url;

/// What stands for the diagnostics of a file: the result id of the protocol.
pub(crate) type ResultId = u64;

/// The pulls of a session.
#[derive(Debug, Default)]
pub(crate) struct Pulls {
    /// How many questions wait for an answer.
    waiting: usize,
    /// What was given last; `None` where the question was not answered.
    given: BTreeMap<Url, Option<ResultId>>,
    /// What the last check has found, for the files that the client asks about.
    found: BTreeMap<Url, ResultId>,
}

impl Pulls {
    /// The client asks about a file, or about all.
    pub(crate) fn asked(&mut self) {
        self.waiting += 1;
    }

    /// It was given these. Should it ask again?
    pub(crate) fn answered(&mut self, given: impl IntoIterator<Item = (Url, Option<ResultId>)>) -> bool {
        self.waiting = self.waiting.saturating_sub(1);
        self.given.extend(given);
        self.is_outdated()
    }

    /// A check has found these in the files that the client asks about. Should it ask again?
    pub(crate) fn checked(&mut self, found: BTreeMap<Url, ResultId>) -> bool {
        // A file that has nothing any more may have been given something.
        self.given.retain(|url, _| found.contains_key(url));
        self.found = found;
        self.is_outdated()
    }

    /// Whoever waits for an answer gets what holds, or is looked at when he has got it.
    fn is_outdated(&mut self) -> bool {
        let is_another = |(url, found): (&Url, &ResultId)| self.given.get(url) != Some(&Some(*found));
        let is_outdated = self.waiting == 0 && self.found.iter().any(is_another);
        if is_outdated {
            // Told once. What it asks for then is noted when it gets it.
            let told = self.found.iter().map(|(url, found)| (url.clone(), Some(*found)));
            self.given.extend(told);
        }
        is_outdated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn url(name: &str) -> Url {
        Url::parse(&format!("file:///{name}.mal")).unwrap()
    }

    fn found(all: &[(&str, ResultId)]) -> BTreeMap<Url, ResultId> {
        all.iter().map(|(name, id)| (url(name), *id)).collect()
    }

    #[test]
    fn an_answer_that_holds_needs_no_other() {
        let mut pulls = Pulls::default();
        pulls.asked();
        assert!(!pulls.checked(found(&[("a", 1)])), "it is being answered");
        assert!(!pulls.answered([(url("a"), Some(1))]));
        assert!(!pulls.checked(found(&[("a", 1)])));
    }

    #[test]
    fn what_changes_elsewhere_is_to_be_asked_for_once() {
        let mut pulls = Pulls::default();
        pulls.asked();
        assert!(!pulls.answered([(url("a"), Some(1))]));
        assert!(pulls.checked(found(&[("a", 2)])));
        assert!(!pulls.checked(found(&[("a", 2)])), "it was told");
        pulls.asked();
        assert!(!pulls.answered([(url("a"), Some(2))]));
    }

    #[test]
    fn an_old_answer_that_comes_late_and_one_that_never_came() {
        let mut pulls = Pulls::default();
        pulls.asked();
        assert!(!pulls.checked(found(&[("a", 2)])));
        assert!(pulls.answered([(url("a"), Some(1))]));
        pulls.asked();
        assert!(pulls.answered([(url("a"), None)]));
    }
}
