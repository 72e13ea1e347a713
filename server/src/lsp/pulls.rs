//! What a client that asks for diagnostics was given, so that it is told to ask again where that no longer holds, and only
//! there: about a text that is another one since, it asks by itself.

use std::collections::BTreeMap;

use tower_lsp::lsp_types::Url;

/// What stands for the diagnostics of a file: the result id of the protocol.
pub(crate) type ResultId = u64;

/// The diagnostics of a file: of which version, where it is open; none where the question was not answered.
pub(crate) type Given = (Option<i32>, Option<ResultId>);

/// The pulls of a session.
#[derive(Debug, Default)]
pub(crate) struct Pulls {
    /// How many questions wait for an answer.
    waiting: usize,
    /// The versions of the files that were asked about last.
    asked: BTreeMap<Url, Option<i32>>,
    /// What was given last.
    given: BTreeMap<Url, Given>,
    /// What the last check has found, for the files that the client asks about.
    found: BTreeMap<Url, Given>,
}

impl Pulls {
    /// The client asks about this version of a file, or about all.
    pub(crate) fn asked(&mut self, about: Option<(Url, Option<i32>)>) {
        self.waiting += 1;
        self.asked.extend(about);
    }

    /// It was given these. Should it ask again?
    pub(crate) fn answered(&mut self, given: BTreeMap<Url, Given>) -> bool {
        self.waiting = self.waiting.saturating_sub(1);
        self.given.extend(given);
        self.is_outdated()
    }

    /// It was given nothing about a file. Should it ask again?
    pub(crate) fn lost(&mut self, url: &Url) -> bool {
        let version = self.asked.get(url).copied().flatten();
        self.answered(BTreeMap::from([(url.clone(), (version, None))]))
    }

    /// A check has found these in the files that the client asks about. Should it ask again?
    pub(crate) fn checked(&mut self, found: BTreeMap<Url, Given>) -> bool {
        self.given.retain(|url, _| found.contains_key(url));
        self.asked.retain(|url, _| found.contains_key(url));
        self.found = found;
        self.is_outdated()
    }

    /// Whoever waits for an answer gets what holds, or is looked at when he has got it.
    fn is_outdated(&mut self) -> bool {
        let is_another = |(url, found): (&Url, &Given)| match self.given.get(url) {
            Some(given) => given.0 == found.0 && given.1 != found.1,
            // About a file that it has opened, it is going to ask.
            None => found.0.is_none(),
        };
        let is_outdated = self.waiting == 0 && self.found.iter().any(is_another);
        if is_outdated {
            // Told once. What it asks for then is noted when it gets it.
            self.given.extend(self.found.iter().map(|(url, found)| (url.clone(), *found)));
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

    fn found(name: &str, version: Option<i32>, id: ResultId) -> BTreeMap<Url, Given> {
        BTreeMap::from([(url(name), (version, Some(id)))])
    }

    #[test]
    fn an_answer_that_holds_needs_no_other() {
        let mut pulls = Pulls::default();
        pulls.asked(None);
        assert!(!pulls.checked(found("a", Some(1), 7)), "it is being answered");
        assert!(!pulls.answered(found("a", Some(1), 7)));
        assert!(!pulls.checked(found("a", Some(1), 7)));
        assert!(!pulls.checked(found("a", Some(2), 8)), "about another text it asks by itself");
        assert!(!pulls.checked(found("b", Some(1), 9)), "and about another file");
    }

    #[test]
    fn what_changes_elsewhere_is_to_be_asked_for_once() {
        let mut pulls = Pulls::default();
        pulls.asked(None);
        assert!(!pulls.answered(found("a", Some(1), 7)));
        assert!(pulls.checked(found("a", Some(1), 8)));
        assert!(!pulls.checked(found("a", Some(1), 8)), "it was told");
        pulls.asked(None);
        assert!(!pulls.answered(found("a", Some(1), 8)));
        assert!(pulls.checked(found("b", None, 9)), "of a file that is not open, it may not know");
        assert!(!pulls.checked(found("b", None, 9)));
    }

    #[test]
    fn an_old_answer_that_comes_late_and_one_that_never_came() {
        let mut pulls = Pulls::default();
        pulls.asked(None);
        assert!(!pulls.checked(found("a", Some(1), 8)));
        assert!(pulls.answered(found("a", Some(1), 7)));
        pulls.asked(Some((url("a"), Some(1))));
        assert!(pulls.lost(&url("a")));
        pulls.asked(Some((url("a"), Some(1))));
        assert!(!pulls.checked(found("a", Some(2), 9)));
        assert!(!pulls.lost(&url("a")), "about another text it asks by itself");
    }
}
