//! Codels without a time, once for a project, and the time that each may take.

use mauve_timing::{Status, Time};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::bisection::ProofBoundary;
use crate::fact::{Budget, MissingTime, TimingFact, TimingFactKind};
use crate::psm::psm_of;
use crate::reason::{Reason, Timed, UnusableTime};
use crate::report::Query;
use crate::response::response_times;
use crate::system::{System, system_of};
use crate::table_set::{TableSet, all_tables_of, table_sets};
use crate::timetable::{incomplete_tables, timetable_of};
use crate::variants::{Variants, statuses};
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, Location, ModelDb, Project, config_file, config_of, names_of};

/// With more codels without a time, the budget of one while all others take nothing is of little use, and each budget needs
/// an analysis for each of its bits.
const MOST_BUDGETS: usize = 8;

/// So many activities are analysed for all budgets, those of each analysis counted.
const MOST_ANALYSED: usize = 1 << 12;

/// Computes the budgets of the codels without a time of a deployment: none where the deployment is not analysed for
/// another reason, or where very many codels have no time.
#[salsa::tracked(returns(ref))]
pub fn budgets<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<Budget<'db>> {
    let missing = missing_times(db, project, deployment, query);
    let system: &System<'db> = system_of(db, project, deployment);
    if missing.len() > MOST_BUDGETS || !system.not_analysed.is_empty() {
        return Vec::new();
    }
    let untimed: FxHashSet<Decl<'db>> = system
        .activities
        .iter()
        .filter_map(|it| Some((it.executed()?, it.tables)))
        .filter(|&(component, tables)| psm_of(db, tables, component, query.level).is_err())
        .map(|(component, _)| component)
        .collect();
    let variants = Variants::new(db, project, deployment, query, MOST_ANALYSED);
    let with = |codel: Decl<'db>, time: Time| {
        let what_if = |of: &Timed<'db>| {
            let is_missing = missing.iter().any(|it| *of == Timed::Codel(it.codel));
            is_missing.then_some(if *of == Timed::Codel(codel) { time } else { Time::ZERO })
        };
        variants.with_times(&untimed, &what_if)
    };
    // The statuses where `codel` takes `time`; the outer `None` where no steps are left, the inner one where the deployment is not
    // analysed for another reason too, or where a search was given up, which proves nothing.
    let with_time = |codel: Decl<'db>, time: Time, is_brief: bool| -> Option<Option<Vec<Status>>> {
        let set = with(codel, time);
        let statuses = statuses(&set, &variants.analysed(&set, is_brief)?);
        Some((!statuses.contains(&Status::NotAnalysed)).then_some(statuses))
    };
    let is_late = |it: &Status| matches!(it, Status::Missed | Status::Unbounded);
    let longest = system.activities.iter().filter_map(|it| it.deadline).max().unwrap_or_default();
    let mut budgets = Vec::new();
    for MissingTime { codel, users, .. } in &missing {
        let codel = *codel;
        let Some(at_zero) = with_time(codel, Time::ZERO, true).flatten() else { continue };
        if at_zero.contains(&Status::NoBound) {
            continue;
        }
        let is_user = |name: &Name| users.iter().any(|(user, _)| user == name);
        let late = || system.activities.iter().zip(&at_zero).filter(|(_, it)| is_late(it));
        let further = late().next().is_some();
        // The smaller budget may prove less.
        if further && !variants.is_missed(&with(codel, Time::ZERO)) {
            continue;
        }
        let time = match late().any(|(activity, _)| is_user(&activity.instance)) {
            true => None,
            false => {
                let keeps = |time: Time, is_brief: bool| {
                    let Some(statuses) = with_time(codel, time, is_brief)? else { return Some(false) };
                    let mut changes = at_zero.iter().zip(&statuses);
                    Some(!changes.any(|(before, after)| {
                        !is_late(before) && (is_late(after) || *after == Status::NoBound)
                    }))
                };
                // The analysis is monotone in every time.
                let end = longest.as_nanos().saturating_add(1);
                let mut found = ProofBoundary::between(0, end, |time| keeps(time, true));
                // The whole analysis, with the next time too: the smaller budget may prove less.
                if keeps(Time::from_nanos(found.bad), false) != Some(false) {
                    found = ProofBoundary::between(found.good, end, |time| keeps(time, false));
                }
                if !found.is_complete() || keeps(Time::from_nanos(found.bad), false) != Some(false) {
                    return budgets;
                }
                Some(Time::from_nanos(found.good))
            }
        };
        budgets.push(Budget { codel, time, further, alone: missing.len() == 1 });
    }
    budgets
}

/// Returns the codels without a time that the activities of a deployment execute.
fn missing_times<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<MissingTime<'db>> {
    let mut missing: Vec<MissingTime<'db>> = Vec::new();
    let mut index: FxHashMap<(Decl<'db>, TableSet<'db>), usize> = FxHashMap::default();
    let reports = &response_times(db, project, deployment, query).activities;
    // The reasons of a report include those of the state machine of the component.
    for (activity, report) in system_of(db, project, deployment).activities.iter().zip(reports) {
        for refusal in &report.reasons {
            let (codel, at_other_levels) = match &refusal.reason {
                Reason::NoTime(codel) => (*codel, false),
                Reason::Table(UnusableTime::OtherLevels(Timed::Codel(codel), ..)) => (*codel, true),
                _ => continue,
            };
            let user = (activity.instance.clone(), activity.at.clone());
            let tables = activity.tables;
            let at = *index.entry((codel, tables)).or_insert(missing.len());
            match missing.get_mut(at) {
                // Its periods and the operations that it executes may need one codel.
                Some(known) if known.users.last() == Some(&user) => {}
                Some(known) => known.users.push(user),
                None => missing.push(MissingTime { tables, codel, at_other_levels, users: vec![user] }),
            }
        }
    }
    missing
}

/// Returns the facts about missing times: each once for all deployments of the project with the same tables.
#[salsa::tracked(returns(ref))]
pub fn missing_time_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TimingFact<'db>> {
    let mut deployments: FxHashMap<TableSet<'db>, Vec<Decl<'db>>> = FxHashMap::default();
    for &decl in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
        for tables in all_tables_of(db, project, decl) {
            deployments.entry(tables).or_default().push(decl);
        }
    }
    let mut found = Vec::new();
    for &tables in table_sets(db, project) {
        let deployments = deployments.get(&tables).map_or(&[] as &[_], Vec::as_slice);
        found.extend(missing_in(db, tables, deployments));
    }
    found
}

/// Returns the facts about times that these tables of `deployments` lack.
fn missing_in<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    deployments: &[Decl<'db>],
) -> Vec<TimingFact<'db>> {
    // An incomplete table may have the times that seem to be missing.
    if incomplete_tables(db, tables).is_some() {
        return Vec::new();
    }
    let project = tables.project(db);
    let missing = |it: Decl<'db>| {
        let all = missing_times(db, project, it, Query::shown(db, project, it)).into_iter();
        all.filter(|it| it.tables == tables).collect()
    };
    let deployments = deployments.iter().map(|&it| (it, missing(it)));
    let deployments: Vec<(Decl<'db>, Vec<MissingTime<'db>>)> = deployments.collect();
    let mut found = Vec::new();
    found.extend(missing_level(db, tables, &deployments));
    let mut lacking = deployments.iter().filter(|(_, missing)| !missing.is_empty());
    if timetable_of(db, tables).is_empty()
        && let Some((first, _)) = lacking.next()
    {
        let codels: FxHashSet<Decl<'db>> =
            deployments.iter().flat_map(|(_, missing)| missing).map(|missing| missing.codel).collect();
        let others = lacking.map(|(deployment, _)| *deployment).collect();
        let none = TimingFactKind::NoTimes { tables, codels: codels.len(), others };
        found.push(TimingFact::new(Location::name_of(*first), none));
        return found;
    }
    found.extend(missing_codels(db, project, &deployments));
    found
}

/// Returns the fact that a table has no times at the level, at the level in `mauve.toml` or at the first deployment that is
/// not analysed.
fn missing_level<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    deployments: &[(Decl<'db>, Vec<MissingTime<'db>>)],
) -> Option<TimingFact<'db>> {
    let project = tables.project(db);
    let without_level = |&(deployment, _): &(Decl<'db>, _)| {
        let query = Query::shown(db, project, deployment);
        let table = timetable_of(db, tables).without_level(query.level)?;
        let mut activities = response_times(db, project, deployment, query).activities.iter();
        let is_not_analysed = activities.any(|it| it.verdict == Status::NotAnalysed);
        is_not_analysed.then_some((deployment, query.level, table))
    };
    let (first, level, table) = deployments.iter().find_map(without_level)?;
    let workspace = project.workspace(db);
    let span = config_file(db, workspace).zip(config_of(db, workspace).significance_span.clone());
    // A level that was selected elsewhere is not changed in `mauve.toml`.
    let span = span.filter(|_| workspace.significance(db).is_none());
    let at = span.map_or_else(|| Location::name_of(first), |(file, span)| Location::of_span(file, &span));
    Some(TimingFact::new(at, TimingFactKind::NoTimesAtLevel(level, table.clone())))
}

/// Returns a fact for each codel without a time at any level, with all activities that execute it. The budget is the
/// smallest of the deployments that execute the codel; none where one of them has none.
fn missing_codels<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployments: &[(Decl<'db>, Vec<MissingTime<'db>>)],
) -> Vec<TimingFact<'db>> {
    let mut found: Vec<(MissingTime<'db>, Option<Budget<'db>>)> = Vec::new();
    let mut index: FxHashMap<Decl<'db>, usize> = FxHashMap::default();
    for (deployment, missing) in deployments {
        for missing in missing.iter().filter(|it| !it.at_other_levels) {
            let budgets = budgets(db, project, *deployment, Query::shown(db, project, *deployment));
            let budget = budgets.iter().find(|budget| budget.codel == missing.codel).cloned();
            let at = *index.entry(missing.codel).or_insert(found.len());
            let Some((known, least)) = found.get_mut(at) else {
                found.push((missing.clone(), budget));
                continue;
            };
            known.users.extend(missing.users.iter().cloned());
            *least = least.take().zip(budget).map(|(one, other)| Budget {
                codel: one.codel,
                time: one.time.min(other.time),
                further: one.further || other.further,
                alone: one.alone && other.alone,
            });
        }
    }
    let fact = |(missing, budget): (MissingTime<'db>, _)| {
        TimingFact::new(Location::name_of(missing.codel), TimingFactKind::MissingTime(missing, budget))
    };
    found.into_iter().map(fact).collect()
}
