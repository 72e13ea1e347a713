//! The budgets of codels: the greatest time of each with which all deadlines of the project are met.

use std::collections::BTreeMap;
use std::path::Path;

use mauve_hir::Database;
use mauve_timing::{Level, Time};
use mauve_wcrt::{Limit, Query, sensitivity};

use crate::analysis_document::deployments;
use crate::load::load;

/// The budgets of a project.
pub(super) struct Budgets {
    /// The level of the project: budgets are compared with the times of this level.
    pub(super) level: Level,
    /// The least budget of each codel and program in all deployments.
    greatest: BTreeMap<String, Time>,
}

impl Budgets {
    pub(super) fn of(&self, key: &str) -> Option<Time> {
        self.greatest.get(key).copied()
    }
}

/// Computes the budgets of the project at `path`, with the present times of all other codels.
pub(super) fn budgets(path: &Path, allows_outside: bool) -> Result<Budgets, String> {
    let mut db = Database::default();
    let workspaces = load(&mut db, &[path.to_owned()], allows_outside)?;
    let mut budgets = Budgets { level: Level::TEN_TO_MINUS_FOUR, greatest: BTreeMap::new() };
    for (project, deployment) in deployments(&db, &workspaces, None)? {
        let query = Query::shown(&db, project);
        budgets.level = query.level;
        for it in sensitivity(&db, project, deployment, query).times {
            let limit = match it.limit {
                Limit::Last(time) | Limit::Proved(time) => time,
                // Even a time of 0 misses a deadline: the fault is elsewhere.
                Limit::NotFound | Limit::Any | Limit::NotAnalysed(_) | Limit::Exhausted => continue,
            };
            let least = budgets.greatest.entry(it.key(&db)).or_insert(limit);
            *least = limit.min(*least);
        }
    }
    Ok(budgets)
}
