//! Records the diagnostics that a client has pulled, to request a refresh when they are outdated. After an edit, the
//! client pulls by itself.

use std::collections::{BTreeMap, BTreeSet};

use tower_lsp::lsp_types::Url;

/// The result id of a file's diagnostics, in the sense of the protocol.
pub(crate) type ResultId = u64;

/// The version of a file, if it is open, and the result id of its diagnostics; `None` if the request was not answered.
pub(crate) type GivenResult = (Option<i32>, Option<ResultId>);

/// The pulls of a session.
#[derive(Debug, Default)]
pub(crate) struct Pulls {
    waiting: usize,
    /// The last requested version of each file.
    asked: BTreeMap<Url, Option<i32>>,
    given: BTreeMap<Url, GivenResult>,
    /// The results of the last check for the files that the client pulls.
    found: BTreeMap<Url, GivenResult>,
    /// The results at the last refresh request for each file: it is not repeated for the same result.
    told: BTreeMap<Url, GivenResult>,
    /// The result for a closed file without diagnostics.
    nothing: GivenResult,
}

impl Pulls {
    /// Creates an empty record; `nothing` is the result id of no diagnostics.
    pub(crate) fn new(nothing: ResultId) -> Pulls {
        Pulls { nothing: (None, Some(nothing)), ..Pulls::default() }
    }

    /// Records a request for this version of a file, or for all files.
    pub(crate) fn asked(&mut self, about: Option<(Url, Option<i32>)>) {
        self.waiting += 1;
        self.asked.extend(about);
    }

    /// Records the results for files that the client has not pulled until now.
    pub(crate) fn found_before(&mut self, found: impl IntoIterator<Item = (Url, ResultId)>) {
        self.found.extend(found.into_iter().map(|(url, id)| (url, (None, Some(id)))));
    }

    /// Records answers. Returns whether a refresh is needed.
    pub(crate) fn answered(&mut self, given: BTreeMap<Url, GivenResult>) -> bool {
        self.waiting = self.waiting.saturating_sub(1);
        self.given.extend(given);
        self.is_outdated()
    }

    /// Records an unanswered request. Returns whether a refresh is needed.
    pub(crate) fn lost(&mut self, url: &Url) -> bool {
        let version = self.asked.get(url).copied().flatten();
        self.answered(BTreeMap::from([(url.clone(), (version, None))]))
    }

    /// Records the results of a check for the pulled files. Returns whether a refresh is needed.
    pub(crate) fn checked(&mut self, found: BTreeMap<Url, GivenResult>) -> bool {
        self.found = found;
        // A refresh for an older result may be requested again.
        let (found, nothing) = (&self.found, self.nothing);
        self.told.retain(|url, told| *told == found.get(url).copied().unwrap_or(nothing));
        let is_outdated = self.is_outdated();
        // Files that no longer exist are removed from the record, once the client has their empty result.
        let (found, nothing) = (&self.found, self.nothing);
        self.given.retain(|url, given| found.contains_key(url) || *given != nothing);
        self.told.retain(|url, _| found.contains_key(url) || self.given.contains_key(url));
        self.asked.retain(|url, _| found.contains_key(url));
        is_outdated
    }

    /// Records that the client has closed a file. If it pulls all files, its displayed diagnostics are unknown.
    pub(crate) fn closed(&mut self, url: &Url, asks_about_others: bool) {
        match asks_about_others {
            true => self.given.insert(url.clone(), (None, None)),
            false => self.given.remove(url),
        };
    }

    /// Returns whether a refresh is needed. Files with a pending request are checked when it is answered.
    fn is_outdated(&mut self) -> bool {
        if self.waiting > 0 {
            return false;
        }
        let now = |url: &Url| self.found.get(url).copied().unwrap_or(self.nothing);
        let is_another = |url: &&Url| match self.given.get(*url) {
            _ if self.told.get(*url) == Some(&now(url)) => false,
            Some(given) => given.0 == now(url).0 && given.1 != now(url).1,
            // The client will pull a file that it has just opened.
            None => now(url).0.is_none() && now(url) != self.nothing,
        };
        let all: BTreeSet<&Url> = self.given.keys().chain(self.found.keys()).collect();
        let told: BTreeMap<Url, GivenResult> =
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

    fn found(name: &str, version: Option<i32>, id: ResultId) -> BTreeMap<Url, GivenResult> {
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
