//! The diagnostics of files, as the client is given them.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::{Arc, OnceLock};

use tower_lsp::lsp_types::{Diagnostic, Url};

use super::pulls::ResultId;

/// The diagnostics of a file, as JSON: a list of thousands is compared and sent as it is. A copy is cheap.
#[derive(Debug, Clone)]
pub(crate) struct Items(Arc<KeptItems>);

#[derive(Debug)]
struct KeptItems {
    json: String,
    id: OnceLock<ResultId>,
}

impl Items {
    /// Returns these diagnostics.
    pub(crate) fn of(diagnostics: impl IntoIterator<Item = Diagnostic>) -> Items {
        let mut json = String::from("[");
        for diagnostic in diagnostics {
            // Serialising plain data never fails.
            if let Ok(of_one) = serde_json::to_string(&diagnostic) {
                json.extend((json.len() > 1).then_some(','));
                json += &of_one;
            }
        }
        json.push(']');
        json.shrink_to_fit();
        Items(Arc::new(KeptItems { json, id: OnceLock::new() }))
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.json == "[]"
    }

    /// Returns the diagnostics.
    pub(crate) fn list(&self) -> Vec<Diagnostic> {
        // It was written here.
        serde_json::from_str(&self.0.json).unwrap_or_default()
    }

    /// Returns the diagnostics as JSON.
    pub(crate) fn json(&self) -> &str {
        &self.0.json
    }

    /// Returns the result id of the diagnostics: a hash.
    pub(crate) fn id(&self) -> ResultId {
        *self.0.id.get_or_init(|| {
            let mut hasher = DefaultHasher::new();
            self.json().hash(&mut hasher);
            hasher.finish()
        })
    }
}

impl Default for Items {
    fn default() -> Items {
        Items::of([])
    }
}

impl PartialEq for Items {
    fn eq(&self, other: &Items) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.json() == other.json()
    }
}

/// The version of a file, if it is open, and its diagnostics.
pub(crate) type OfFile = (Option<i32>, Items);

/// The versions and diagnostics of several files.
pub(crate) type DiagnosticsByFile = BTreeMap<Url, OfFile>;
