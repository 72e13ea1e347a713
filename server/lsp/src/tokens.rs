//! Records the semantic tokens that the client has received, to answer with differences, and to request a refresh
//! when an edit of another document changes the tokens.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tower_lsp::lsp_types::{SemanticToken, Url};

/// The last tokens of each open document that the client has received.
#[derive(Debug, Default)]
pub(crate) struct Tokens(Mutex<BTreeMap<Url, GivenTokens>>);

#[derive(Debug)]
struct GivenTokens {
    version: i32,
    /// A hash of the tokens; `None` if the request was not answered.
    meanings: Option<u64>,
    /// All tokens and their result id, if the client has requested all.
    all: Option<(String, Arc<[SemanticToken]>)>,
}

impl Tokens {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<Url, GivenTokens>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns all tokens of a document, if this id is that of the last answer.
    pub(crate) fn previous(&self, url: &Url, id: &str) -> Option<Arc<[SemanticToken]>> {
        let all = self.lock().get(url)?.all.clone();
        all.filter(|(known, _)| known == id).map(|(_, tokens)| tokens)
    }

    /// Records the answer for this version of a document, with all tokens or some.
    pub(crate) fn gave(
        &self,
        url: &Url,
        version: i32,
        meanings: u64,
        all: Option<(String, Arc<[SemanticToken]>)>,
    ) {
        let mut given = self.lock();
        let before = given.remove(url).and_then(|given| given.all);
        let given_now = GivenTokens { version, meanings: Some(meanings), all: all.or(before) };
        given.insert(url.clone(), given_now);
    }

    /// Records an unanswered request for this version.
    pub(crate) fn lost(&self, url: &Url, version: i32) {
        let mut given = self.lock();
        // The answer for a later version may have been sent before.
        if given.get(url).is_some_and(|given| given.version > version) {
            return;
        }
        let all = given.remove(url).and_then(|given| given.all);
        given.insert(url.clone(), GivenTokens { version, meanings: None, all });
    }

    /// Records that the client has closed a document.
    pub(crate) fn closed(&self, url: &Url) {
        self.lock().remove(url);
    }

    /// Returns the documents whose tokens the client has requested.
    pub(crate) fn asked(&self) -> Vec<Url> {
        self.lock().keys().cloned().collect()
    }

    /// Returns whether a refresh is needed after a check with these hashes and versions. A refresh is requested once;
    /// after an edit, the client requests tokens by itself.
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
    fn the_last_tokens_of_a_file_are_kept() {
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
