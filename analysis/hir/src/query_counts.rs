//! How often each query was executed, for the status of the server.
//!
//! Counting is optional, since salsa then calls a function for each event, also where a value is only read.

use std::sync::{Mutex, MutexGuard, PoisonError};

use rustc_hash::FxHashMap;
use salsa::{DatabaseKeyIndex, IngredientIndex};

/// The counts of a database, see [`crate::Database::with_counts`].
#[derive(Debug, Default)]
pub struct QueryCounts(Mutex<FxHashMap<IngredientIndex, QueryCount>>);

/// How often a query was executed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QueryCount {
    /// The name of its function.
    pub name: String,
    /// Since the database was created.
    pub executed: u64,
    /// Since the last [`QueryCounts::note_change`].
    pub since_change: u64,
}

impl QueryCounts {
    /// Returns the counts, the greatest first.
    pub fn all(&self) -> Vec<QueryCount> {
        let mut all: Vec<QueryCount> = self.lock().values().cloned().collect();
        all.sort_by(|one, other| other.executed.cmp(&one.executed).then_with(|| one.name.cmp(&other.name)));
        all
    }

    /// Begins to count the executions after a change.
    pub fn note_change(&self) {
        self.lock().values_mut().for_each(|count| count.since_change = 0);
    }

    pub(crate) fn note_execution(&self, query: DatabaseKeyIndex) {
        let mut counts = self.lock();
        let count = counts.entry(query.ingredient_index()).or_insert_with(|| {
            let name = format!("{query:?}");
            let name = name.split('(').next().unwrap_or_default().to_owned();
            QueryCount { name, executed: 0, since_change: 0 }
        });
        count.executed += 1;
        count.since_change += 1;
    }

    fn lock(&self) -> MutexGuard<'_, FxHashMap<IngredientIndex, QueryCount>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
