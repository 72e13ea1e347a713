//! What a project says of its codels: the greatest time of each with which all deadlines are met, its budget; and its source.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use mauve_diagnostics::errors_of_text;
use mauve_hir::item_tree::{Direction, Kind};
use mauve_hir::{Database, codel as codel_of, names_of, projects};
use mauve_ide::codel_file;
use mauve_projects::analysis_document::deployments;
use mauve_projects::load::load;
use mauve_timing::{Level, Status, Time};
use mauve_wcrt::{ActivityReport, Limit, Query, response_times, sensitivity};

/// The budgets of a project.
pub(super) struct Budgets {
    /// The level of the project: budgets are compared with the times of this level.
    pub(super) level: Level,
    /// The least budget of each codel and program in all deployments.
    pub(super) greatest: BTreeMap<String, Time>,
    /// The C++ files of the codels, where they exist.
    pub(super) sources: BTreeMap<String, PathBuf>,
    /// The codels that need inputs to be executed alone.
    pub(super) with_inputs: BTreeSet<String>,
    /// What to load.
    pub(super) project: PathBuf,
}

/// Computes the budgets of the project at `path`, with the present times of all other codels.
pub(super) fn budgets(path: &Path, allows_outside: bool) -> Result<Budgets, String> {
    let mut db = Database::default();
    let workspaces = load(&mut db, &[path.to_owned()], allows_outside)?;
    let mut budgets = Budgets {
        level: Level::TEN_TO_MINUS_FOUR,
        greatest: BTreeMap::new(),
        sources: BTreeMap::new(),
        with_inputs: BTreeSet::new(),
        project: path.to_owned(),
    };
    for (project, deployment) in deployments(&db, &workspaces, None)? {
        let query = Query::shown(&db, project, deployment);
        budgets.level = query.level;
        for it in sensitivity(&db, project, deployment, query).times {
            let limit = match it.limit {
                Limit::Last(time) | Limit::Proved(time) => time,
                // Even a time of 0 misses a deadline.
                Limit::NotFound => Time::from_nanos(0),
                Limit::Any | Limit::NotAnalysed(_) | Limit::Exhausted => continue,
            };
            let least = budgets.greatest.entry(it.key(&db)).or_insert(limit);
            *least = limit.min(*least);
        }
    }
    for project in workspaces.iter().flat_map(|&workspace| projects(&db, workspace)) {
        for codel in names_of(&db, *project).of_kind(&db, Kind::Codel) {
            let source = codel_file(&db, *project, codel).filter(|path| path.is_file());
            budgets.sources.extend(source.map(|path| (codel.qualified(&db), path)));
            let parameters = codel_of(&db, codel).map_or(&[][..], |it| &it.parameters);
            if parameters.iter().any(|it| it.direction != Direction::Out) {
                budgets.with_inputs.insert(codel.qualified(&db));
            }
        }
    }
    Ok(budgets)
}

/// Returns the activities whose deadlines are not proved, and the number of errors in the project. Reads the tables from the disk
/// again, since one was just written.
pub(super) fn not_proved(path: &Path, allows_outside: bool) -> Result<(Vec<String>, usize), String> {
    let mut db = Database::default();
    let workspaces = load(&mut db, &[path.to_owned()], allows_outside)?;
    let mut open = Vec::new();
    for (project, deployment) in deployments(&db, &workspaces, None)? {
        let report = response_times(&db, project, deployment, Query::shown(&db, project, deployment));
        let is_open = |it: &&ActivityReport<'_>| !matches!(it.verdict, Status::Met | Status::Background);
        open.extend(report.activities.iter().filter(is_open).map(|it| it.instance.to_string()));
    }
    Ok((open, errors_of_text(&db, &workspaces)))
}
