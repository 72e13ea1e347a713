//! What a client that colours names was given: so that an answer says only what has changed since, and that the client is
//! told to ask again where an edit elsewhere has given the names of a text another meaning, and only there.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tower_lsp::lsp_types::{SemanticToken, Url};

/// The tokens of the open documents; of each the last that the client was given.
#[derive(Debug, Default)]
pub(crate) struct Tokens(Mutex<BTreeMap<Url, Given>>);

#[derive(Debug)]
struct Given {
    version: i32,
    /// What stands for the meaning of its names; none where the question was not answered.
    meanings: Option<u64>,
    /// All of its tokens, where it has asked for all, by their result id.
    all: Option<(String, Arc<[SemanticToken]>)>,
}

impl Tokens {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<Url, Given>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All tokens of a document, if the client was given them last by this id.
    pub(crate) fn previous(&self, url: &Url, id: &str) -> Option<Arc<[SemanticToken]>> {
        let all = self.lock().get(url)?.all.clone();
        all.filter(|(known, _)| known == id).map(|(_, tokens)| tokens)
    }

    /// The client was given tokens of this version of a document, all of them or some.
    pub(crate) fn gave(
        &self,
        url: &Url,
        version: i32,
        meanings: u64,
        all: Option<(String, Arc<[SemanticToken]>)>,
    ) {
        let mut given = self.lock();
        let before = given.remove(url).and_then(|given| given.all);
        let given_now = Given { version, meanings: Some(meanings), all: all.or(before) };
        given.insert(url.clone(), given_now);
    }

    /// It has asked about this version, and got no answer.
    pub(crate) fn lost(&self, url: &Url, version: i32) {
        let mut given = self.lock();
        // An answer about a later one may have been quicker.
        if given.get(url).is_some_and(|given| given.version > version) {
            return;
        }
        let all = given.remove(url).and_then(|given| given.all);
        given.insert(url.clone(), Given { version, meanings: None, all });
    }

    /// It has closed a document.
    pub(crate) fn closed(&self, url: &Url) {
        self.lock().remove(url);
    }

    /// The documents that the client has asked about.
    pub(crate) fn asked(&self) -> Vec<Url> {
        self.lock().keys().cloned().collect()
    }

    /// A check has found these, for these versions. Should the client ask again? Told once: for a text that is another one
    /// it asks by itself.
    pub(crate) fn is_outdated(&self, found: &BTreeMap<Url, (i32, u64)>) -> bool {
        let mut is_outdated = false;
        for (url, given) in self.lock().iter_mut() {
            if let Some((version, meanings)) = found.get(url)
                && given.version == *version
                && given.meanings != Some(*meanings)
            {
                given.meanings = Some(*meanings);
                is_outdated = true;
            }
        }
        is_outdated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn url() -> Url {
        Url::parse("file:///a.mal").unwrap()
    }

    fn found(version: i32, meanings: u64) -> BTreeMap<Url, (i32, u64)> {
        BTreeMap::from([(url(), (version, meanings))])
    }

    #[test]
    fn what_changes_elsewhere_is_to_be_asked_for_once() {
        let tokens = Tokens::default();
        assert!(!tokens.is_outdated(&found(1, 7)), "nobody has asked");
        tokens.gave(&url(), 1, 7, None);
        assert!(!tokens.is_outdated(&found(1, 7)));
        assert!(!tokens.is_outdated(&found(2, 8)), "for another text it asks by itself");
        assert!(tokens.is_outdated(&found(1, 8)));
        assert!(!tokens.is_outdated(&found(1, 8)), "it was told");
        tokens.closed(&url());
        assert!(!tokens.is_outdated(&found(1, 9)));
    }

    #[test]
    fn what_was_not_answered_is_to_be_asked_for() {
        let tokens = Tokens::default();
        tokens.lost(&url(), 3);
        assert!(!tokens.is_outdated(&found(4, 7)));
        assert!(tokens.is_outdated(&found(3, 7)));
    }

    #[test]
    fn the_last_are_kept() {
        let tokens = Tokens::default();
        let all: Arc<[SemanticToken]> = Arc::new([]);
        tokens.gave(&url(), 1, 7, Some(("a".to_owned(), Arc::clone(&all))));
        tokens.gave(&url(), 1, 7, None);
        tokens.lost(&url(), 2);
        tokens.gave(&url(), 3, 8, None);
        tokens.lost(&url(), 2);
        assert!(!tokens.is_outdated(&found(3, 8)), "the answer about the later text holds");
        assert_eq!(tokens.previous(&url(), "a"), Some(Arc::clone(&all)));
        tokens.gave(&url(), 1, 7, Some(("b".to_owned(), all)));
        assert_eq!(tokens.previous(&url(), "a"), None);
    }
}
