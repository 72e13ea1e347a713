//! What is wrong with the response times of a deployment: codels without a time, with the time that each may take, and missed
//! deadlines.

use std::cell::Cell;

use mauve_timing::{Level, Status, Time};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::fact::{Budget, Missed, MissingTime, Overload, TimingFact, TimingFactKind};
use crate::psm::{Psm, psm_of, psm_with, table_of_greatest_time};
use crate::reason::{Reason, Refusal, Timed, UnusableTime};
use crate::report::{ActivityReport, Query, Verdict};
use crate::response::response_times;
use crate::system::{Priority, ResolvedActivity, System, system_of};
use crate::task_set::activity_set;
use crate::timetable::{incomplete_tables, timetable_of};
use mauve_hir::{Decl, Location, ModelDb, Project, config_file, config_of};

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
    let missing = missing_times(db, project, deployment, query.level);
    let system: &System<'db> = system_of(db, project, deployment);
    if missing.len() > MOST_BUDGETS || !system.not_analysed.is_empty() {
        return Vec::new();
    }
    let untimed: FxHashSet<Decl<'db>> = system
        .activities
        .iter()
        .filter_map(ResolvedActivity::executed)
        .filter(|&component| psm_of(db, project, component, query.level).is_err())
        .collect();
    let left = Cell::new(MOST_ANALYSED / system.activities.len().max(1));
    // Whether every deadline is proved where `codel` takes `time`: `None` where that is unknown.
    let holds = |codel: Decl<'db>, time: Time| -> Option<bool> {
        left.set(left.get().checked_sub(1)?);
        let what_if = |of: Decl<'db>| {
            let is_missing = missing.iter().any(|it| it.codel == of);
            is_missing.then_some(if of == codel { time } else { Time::ZERO })
        };
        let psm = |&component| (component, psm_with(db, project, component, query.level, &what_if));
        let changed: FxHashMap<Decl<'db>, Result<Psm<'db>, Vec<Refusal<'db>>>> =
            untimed.iter().map(psm).collect();
        let psms = system.activities.iter().map(|activity| {
            let component = activity.executed()?;
            changed.get(&component).or_else(|| Some(psm_of(db, project, component, query.level)))
        });
        let set = activity_set(db, project, system, &psms.collect::<Vec<_>>(), query.method);
        let analysis = set.response_times(&query.options(true), &|| db.unwind_if_revision_cancelled());
        let responses = set.activities.iter().zip(&analysis.responses);
        let statuses: Vec<Status> = responses
            .filter_map(|(it, response)| Some(response.as_ref()?.status(it.deadline.unwrap_or_default())))
            .collect();
        match statuses.contains(&Status::Missed) || statuses.contains(&Status::Unbounded) {
            _ if statuses.contains(&Status::NotAnalysed) => None,
            true => Some(false),
            // A search that was given up proves neither.
            false => (!statuses.contains(&Status::NoBound)).then_some(true),
        }
    };
    let longest = system.activities.iter().filter_map(|it| it.deadline).max().unwrap_or_default();
    let mut budgets = Vec::new();
    for &MissingTime { codel, .. } in &missing {
        let time = match holds(codel, Time::ZERO) {
            // The deployment is not analysed for another reason too.
            None => continue,
            Some(false) => None,
            Some(true) => {
                // The analysis is monotone in every time: bisect between what holds and what cannot.
                let (mut good, mut bad) = (0, longest.as_nanos().saturating_add(1));
                while bad - good > 1 {
                    let middle = good + (bad - good) / 2;
                    match holds(codel, Time::from_nanos(middle)) {
                        Some(true) => good = middle,
                        // No steps are left: nothing is claimed.
                        None if left.get() == 0 => return budgets,
                        Some(false) | None => bad = middle,
                    }
                }
                Some(Time::from_nanos(good))
            }
        };
        budgets.push(Budget { codel, time, alone: missing.len() == 1 });
    }
    budgets
}

fn missing_times<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    level: Level,
) -> Vec<MissingTime<'db>> {
    let mut missing: Vec<MissingTime<'db>> = Vec::new();
    let mut index: FxHashMap<Decl<'db>, usize> = FxHashMap::default();
    for activity in &system_of(db, project, deployment).activities {
        let Some(component) = activity.executed() else { continue };
        let Err(refusals) = psm_of(db, project, component, level) else { continue };
        for refusal in refusals {
            let (codel, at_other_levels) = match &refusal.reason {
                Reason::NoTime(codel) => (*codel, false),
                Reason::Table(UnusableTime::OtherLevels(Timed::Codel(codel), ..)) => (*codel, true),
                _ => continue,
            };
            let user = (activity.instance.clone(), activity.at.clone());
            let at = *index.entry(codel).or_insert(missing.len());
            match missing.get_mut(at) {
                Some(known) => known.users.push(user),
                None => missing.push(MissingTime { codel, at_other_levels, users: vec![user] }),
            }
        }
    }
    missing
}

/// Returns missed deadlines, missing times, and what is not analysed for a reason that no other diagnostic reports.
pub fn timing_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<TimingFact<'db>> {
    // An incomplete table may have the times that seem to be missing.
    let mut found = match incomplete_tables(db, project) {
        None => missing_time_facts(db, project, deployment, query),
        Some(_) => Vec::new(),
    };
    let reports = &response_times(db, project, deployment, query).activities;
    for (activity, report) in system_of(db, project, deployment).activities.iter().zip(reports) {
        let instance = activity.instance.clone();
        let kind = match report.verdict {
            // One fact for each CPU, below.
            Verdict::RealTime(Status::Unbounded) => continue,
            Verdict::RealTime(Status::Missed | Status::NoBound) => {
                let deadline = activity.deadline.unwrap_or_default();
                TimingFactKind::DeadlineMissed { instance, deadline, missed: missed(report) }
            }
            Verdict::RealTime(Status::NotAnalysed) => {
                let unreported = report.reasons.iter().filter(|it| !it.reason.is_reported());
                let reasons: Vec<Refusal<'db>> = unreported.cloned().collect();
                // Another error of the activity comes first.
                if reasons.is_empty() || activity.refusals.iter().any(|it| it.reason.is_reported()) {
                    continue;
                }
                TimingFactKind::NotAnalysed { instance, reasons }
            }
            Verdict::RealTime(Status::Met) | Verdict::Background => continue,
        };
        found.push(TimingFact::new(activity.at.clone(), kind));
    }
    found.extend(overloads(db, project, reports, query.level));
    found
}

/// Returns a fact for each overloaded CPU, at the activity that contributes most to the overload.
fn overloads<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    reports: &[ActivityReport<'db>],
    level: Level,
) -> Vec<TimingFact<'db>> {
    let mut found: Vec<(Overload<'db>, Option<Location<'db>>)> = Vec::new();
    for report in reports {
        let Some(at) = report.at.clone() else { continue };
        for Refusal { reason, .. } in &report.reasons {
            let &Reason::Overloaded { cpu, priority, utilisation } = reason else { continue };
            let unbounded = (report.instance.clone(), at.clone());
            match found.iter_mut().find(|(overload, _)| overload.cpu == cpu) {
                Some((overload, _)) => {
                    overload.unbounded.push(unbounded);
                    if priority > overload.priority {
                        (overload.priority, overload.utilisation) = (priority, utilisation);
                    }
                }
                None => {
                    let unbounded = vec![unbounded];
                    let greatest = report.instance.clone();
                    let overload = Overload {
                        cpu,
                        priority,
                        utilisation,
                        greatest,
                        share: None,
                        alone: None,
                        unbounded,
                    };
                    found.push((overload, Some(at.clone())));
                }
            }
        }
    }
    for (overload, at) in &mut found {
        let contributes = |it: &&ActivityReport<'db>| {
            let is_higher = matches!(it.priority, Priority::RealTime(own) if own >= overload.priority);
            is_higher && it.cpus == Some(overload.cpu)
        };
        let share = |it: &ActivityReport<'db>| it.share.map_or(0.0, |share| share.0);
        let contributing = reports.iter().filter(contributes);
        let Some(greatest) = contributing.max_by(|a, b| share(a).total_cmp(&share(b))) else { continue };
        (overload.greatest, overload.share) = (greatest.instance.clone(), greatest.share);
        (*at, overload.alone) = (greatest.at.clone(), None);
        if let Some((own, period)) = greatest.own.zip(greatest.period).filter(|_| share(greatest) > 1.0) {
            let table = greatest.component.and_then(|it| table_of_greatest_time(db, project, it, level));
            overload.alone = Some((own, period, table));
        }
    }
    let fact = |(overload, at)| Some(TimingFact::new(at?, TimingFactKind::Overloaded(overload)));
    found.into_iter().filter_map(fact).collect()
}

fn missed<'db>(activity: &ActivityReport<'db>) -> Missed<'db> {
    let Some(response) = activity.response else { return Missed::NoBound(activity.reasons.clone()) };
    // The window of a later job is longer than its response time.
    let later = activity.window.as_ref().filter(|window| window.job > 1);
    Missed::Late {
        response,
        heaviest: activity.interference.iter().max_by_key(|it| it.time).cloned(),
        window: later.map(|window| (window.job, window.length)),
    }
}

fn missing_time_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<TimingFact<'db>> {
    let mut found = Vec::new();
    let missing = missing_times(db, project, deployment, query.level);
    let report = response_times(db, project, deployment, query);
    let is_not_analysed = |it: &ActivityReport<'_>| it.verdict == Verdict::RealTime(Status::NotAnalysed);
    if let Some(table) = timetable_of(db, project).without_level(query.level)
        && report.activities.iter().any(is_not_analysed)
    {
        let workspace = project.workspace(db);
        let span = config_file(db, workspace).zip(config_of(db, workspace).significance_span.clone());
        // A level that was chosen elsewhere is not changed in `mauve.toml`.
        let span = span.filter(|_| workspace.significance(db).is_none());
        let at = span.map_or_else(
            || Location::name_of(deployment),
            |(file, span)| Location::Range(file, span.start as u32, span.end as u32),
        );
        found.push(TimingFact::new(at, TimingFactKind::NoTimesAtLevel(query.level, table.clone())));
    }
    if !missing.is_empty() && timetable_of(db, project).is_empty() {
        let none = TimingFactKind::NoTimes { codels: missing.len() };
        found.push(TimingFact::new(Location::name_of(deployment), none));
        return found;
    }
    let missing: Vec<MissingTime<'db>> = missing.into_iter().filter(|it| !it.at_other_levels).collect();
    if missing.is_empty() {
        return found;
    }
    let budgets = budgets(db, project, deployment, query);
    found.extend(missing.into_iter().map(|missing| {
        let budget = budgets.iter().find(|budget| budget.codel == missing.codel).cloned();
        TimingFact::new(Location::name_of(missing.codel), TimingFactKind::MissingTime(missing, budget))
    }));
    found
}
