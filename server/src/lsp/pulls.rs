//! What a client that asks for diagnostics was given, so that it is told to ask again where that no longer holds, and only
//! there: about a text that is another one since, it asks by itself.

use std::collections::{BTreeMap, BTreeSet};

use tower_lsp::lsp_types::Url;

/// What stands for the diagnostics of a file: the result id of the protocol.
pub(crate) type ResultId = u64;

/// The diagnostics of a file: of which version, where it is open; none where the question was not answered.
pub(crate) type Given = (Option<i32>, Option<ResultId>);

/// The pulls of a session.
#[derive(Debug, Default)]
pub(crate) struct Pulls {
    waiting: usize,
    /// The versions of the files that were asked about last.
    asked: BTreeMap<Url, Option<i32>>,
    given: BTreeMap<Url, Given>,
    /// What the last check has found, for the files that the client asks about.
    found: BTreeMap<Url, Given>,
    /// What held when the client was told to ask again: it is told once, whatever it then gets.
    told: BTreeMap<Url, Given>,
    /// A file that is not open, and in which nothing is wrong.
    nothing: Given,
}

impl Pulls {
    /// Nothing was asked yet; `nothing` stands for no diagnostics.
    pub(crate) fn new(nothing: ResultId) -> Pulls {
        Pulls { nothing: (None, Some(nothing)), ..Pulls::default() }
    }

    /// The client asks about this version of a file, or about all.
    pub(crate) fn asked(&mut self, about: Option<(Url, Option<i32>)>) {
        self.waiting += 1;
        self.asked.extend(about);
    }

    /// These were found in files that it has not asked about until now.
    pub(crate) fn found_before(&mut self, found: impl IntoIterator<Item = (Url, ResultId)>) {
        self.found.extend(found.into_iter().map(|(url, id)| (url, (None, Some(id)))));
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
        self.found = found;
        // What was told and holds no longer may be told again.
        let (found, nothing) = (&self.found, self.nothing);
        self.told.retain(|url, told| *told == found.get(url).copied().unwrap_or(nothing));
        let is_outdated = self.is_outdated();
        // Nothing is remembered of what is not there any more, once the client knows.
        let (found, nothing) = (&self.found, self.nothing);
        self.given.retain(|url, given| found.contains_key(url) || *given != nothing);
        self.told.retain(|url, _| found.contains_key(url) || self.given.contains_key(url));
        self.asked.retain(|url, _| found.contains_key(url));
        is_outdated
    }

    /// The client has closed a file. Where it asks about others as well, nobody knows what it shows of it now.
    pub(crate) fn closed(&mut self, url: &Url, asks_about_others: bool) {
        match asks_about_others {
            true => self.given.insert(url.clone(), (None, None)),
            false => self.given.remove(url),
        };
    }

    /// Whoever waits for an answer gets what holds, or is looked at when he has got it.
    fn is_outdated(&mut self) -> bool {
        if self.waiting > 0 {
            return false;
        }
        let now = |url: &Url| self.found.get(url).copied().unwrap_or(self.nothing);
        let is_another = |url: &&Url| match self.given.get(*url) {
            _ if self.told.get(*url) == Some(&now(url)) => false,
            Some(given) => given.0 == now(url).0 && given.1 != now(url).1,
            // About a file that it has opened, it is going to ask.
            None => now(url).0.is_none() && now(url) != self.nothing,
        };
        let all: BTreeSet<&Url> = self.given.keys().chain(self.found.keys()).collect();
        let told: BTreeMap<Url, Given> =
            all.into_iter().filter(is_another).map(|url| (url.clone(), now(url))).collect();
        let is_outdated = !told.is_empty();
        self.told.extend(told);
        is_outdated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stands for no diagnostics.
    const NOTHING: ResultId = 0;

    fn url(name: &str) -> Url {
        Url::parse(&format!("file:///{name}.mal")).unwrap()
    }

    fn found(name: &str, version: Option<i32>, id: ResultId) -> BTreeMap<Url, Given> {
        BTreeMap::from([(url(name), (version, Some(id)))])
    }

    #[test]
    fn an_answer_that_holds_needs_no_other() {
        let mut pulls = Pulls::new(NOTHING);
        pulls.asked(None);
        assert!(!pulls.checked(found("a", Some(1), 7)), "it is being answered");
        assert!(!pulls.answered(found("a", Some(1), 7)));
        assert!(!pulls.checked(found("a", Some(1), 7)));
        assert!(!pulls.checked(found("a", Some(2), 8)), "about another text it asks by itself");
        assert!(!pulls.checked(found("b", Some(1), 9)), "and about another file");
    }

    #[test]
    fn what_changes_elsewhere_is_to_be_asked_for_once() {
        let mut pulls = Pulls::new(NOTHING);
        pulls.asked(None);
        assert!(!pulls.answered(found("a", Some(1), 7)));
        assert!(pulls.checked(found("a", Some(1), 8)));
        assert!(!pulls.checked(found("a", Some(1), 8)), "it was told");
        pulls.asked(None);
        assert!(!pulls.answered(found("a", Some(1), 8)));
        assert!(pulls.checked(found("a", Some(1), 7)), "it was as it is before");
    }

    #[test]
    fn files_that_are_not_open() {
        let mut pulls = Pulls::new(NOTHING);
        assert!(pulls.checked(found("a", None, 9)), "it may not know");
        pulls.asked(None);
        assert!(!pulls.answered(found("a", None, 9)));
        assert!(pulls.checked(BTreeMap::new()), "what is mended is in no list");
        pulls.asked(None);
        assert!(!pulls.answered(found("a", None, NOTHING)));
        assert!(!pulls.checked(BTreeMap::new()));
        assert!(pulls.given.is_empty() && pulls.told.is_empty(), "{pulls:?}");
    }

    #[test]
    fn a_file_that_is_closed() {
        for (asks_about_others, expected) in [(true, true), (false, false)] {
            let mut pulls = Pulls::new(NOTHING);
            pulls.asked(None);
            assert!(!pulls.answered(found("a", Some(3), 7)));
            pulls.closed(&url("a"), asks_about_others);
            assert_eq!(pulls.checked(BTreeMap::new()), expected);
        }
    }

    #[test]
    fn an_old_answer_that_comes_late_and_one_that_never_came() {
        let mut pulls = Pulls::new(NOTHING);
        pulls.asked(None);
        assert!(!pulls.checked(found("a", Some(1), 8)));
        assert!(pulls.answered(found("a", Some(1), 7)));
        let mut pulls = Pulls::new(NOTHING);
        assert!(!pulls.checked(found("a", Some(1), 8)));
        pulls.asked(Some((url("a"), Some(1))));
        assert!(pulls.lost(&url("a")));
        pulls.asked(Some((url("a"), Some(1))));
        assert!(!pulls.lost(&url("a")), "it was told, and has it as it wants it");
        assert!(!pulls.checked(found("a", Some(2), 9)), "about another text it asks by itself");
    }
}
