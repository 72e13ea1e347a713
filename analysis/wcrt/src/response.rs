//! The response times of a deployment: its system, with the state machines of its components, analysed.

use rustc_hash::{FxHashMap, FxHashSet};
use std::cell::Cell;

use mauve_timing::{
    Activity, ActivitySet, Bound, CpuLoad, Demand, Level, Method, Options, Response, Status, Time,
    Utilisation, Window,
};

use crate::fact::{Budget, InterferenceReport, Missed, MissingTime, TimingFact, TimingFactKind};
use crate::priorities::check_rows;
use crate::psm::{Psm, Refused, psm_of, psm_with};
use crate::reason::{Doubt, Reason, Refusal, Share};
use crate::system::{Priority, Row, System, read, system_of};
use crate::timetable::timetable_of;
use crate::what_if::{SupposedField, with_fields};
use mauve_hir::{
    Decl, Location, ModelDb, Project, Workspace, config_file, config_of, deployment as declared_deployment,
    names_of, platform_of,
};

/// What is asked of the analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Query {
    /// The significance level.
    pub level: Level,
    /// How the demand of several jobs is bounded.
    pub method: Method,
    /// Unsafe, for comparison with the paper only; see [`Options::horizon`].
    pub horizon: Option<Time>,
}

impl Query {
    fn options(self, is_brief: bool) -> Options {
        Options { method: self.method, horizon: self.horizon, is_brief }
    }

    /// What is shown and checked: the level that was chosen, otherwise that of `mauve.toml`, by the best method.
    pub fn shown<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Query {
        Query { level: level_shown(db, project.workspace(db)), method: Method::Psm, horizon: None }
    }
}

/// The significance level that is shown: the one that was chosen, otherwise that of `mauve.toml`.
pub fn level_shown(db: &dyn ModelDb, workspace: Workspace) -> Level {
    workspace.significance(db).unwrap_or_else(|| config_of(db, workspace).level())
}

const THROTTLING: &str = "real-time throttling";

/// The response times of a deployment.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Report<'db> {
    /// In the order of the deployment.
    pub activities: Vec<ActivityReport<'db>>,
    /// The CPUs that are used.
    pub cpus: Vec<CpuReport>,
    /// Why nothing of it is analysed: an activity may be missing in it, or a time.
    pub lost: Vec<Refusal<'db>>,
}

/// The response time of one activity, and where it comes from.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct ActivityReport<'db> {
    /// What was asked.
    pub row: Row<'db>,
    /// The greatest cost of one of its jobs.
    pub own: Option<Time>,
    /// See [`mauve_timing::Response::first_job`].
    pub first_job: Option<Time>,
    /// The greatest time from a release to the end of its job.
    pub response: Option<Time>,
    /// What that means.
    pub verdict: Verdict,
    /// What is executed before it in the window that gives the response time.
    pub interference: Vec<InterferenceReport>,
    /// The window that gives the response time.
    pub window: Option<Window>,
    /// Why there is no response time.
    pub reasons: Vec<Refusal<'db>>,
    /// Codels whose time is assumed, in its own component, with it.
    pub assumed: Vec<(String, Time)>,
}

impl ActivityReport<'_> {
    /// What interferes, the `most` that take longest, in the order of the rows.
    pub fn greatest_interference(&self, most: usize) -> Vec<&InterferenceReport> {
        let mut greatest: Vec<(usize, &InterferenceReport)> = self.interference.iter().enumerate().collect();
        if greatest.len() > most {
            greatest.sort_by_key(|(_, it)| std::cmp::Reverse(it.time));
            greatest.truncate(most);
            greatest.sort_by_key(|(number, _)| *number);
        }
        greatest.into_iter().map(|(_, it)| it).collect()
    }
}

/// What is known of an activity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// It is real-time.
    RealTime(Status),
    /// It is not.
    Background,
}

impl Verdict {
    /// `met`, `missed`, `unbounded`, `no-bound`, `not-analysed` or `background`.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::RealTime(status) => status.name(),
            Verdict::Background => "background",
        }
    }

    /// Is the deadline proved?
    pub fn is_met(self) -> bool {
        matches!(self, Verdict::Background | Verdict::RealTime(Status::Met))
    }
}

/// The load of a CPU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CpuReport {
    /// Its bit.
    pub mask: u64,
    /// The share of its time that is asked for.
    pub utilisation: Utilisation,
    /// Is nothing missing in it?
    pub complete: bool,
}

impl Report<'_> {
    /// Is every deadline proved?
    pub fn schedulable(&self) -> bool {
        self.lost.is_empty() && self.activities.iter().all(|activity| activity.verdict.is_met())
    }

    /// Counts the deadlines of the real-time activities.
    pub fn deadlines(&self) -> Deadlines {
        let mut counted = Deadlines::default();
        for activity in &self.activities {
            let Verdict::RealTime(status) = activity.verdict else { continue };
            counted.all += 1;
            match status {
                // Where a part of the deployment is lost, nothing is claimed of any.
                _ if !self.lost.is_empty() => counted.unknown += 1,
                Status::NotAnalysed => counted.unknown += 1,
                Status::Met => counted.met += 1,
                Status::Missed | Status::Unbounded | Status::NoBound => {}
            }
        }
        counted
    }
}

/// How many deadlines there are, and of how many what is known. Those that are neither met nor unknown are not proved: they
/// are missed, or no bound was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Deadlines {
    /// Those that are proved.
    pub met: usize,
    /// Those of activities that are not analysed; where a part of the deployment is lost, all.
    pub unknown: usize,
    /// All, those of background activities left out: they have none.
    pub all: usize,
}

/// Computes the response times of a deployment.
#[salsa::tracked(returns(ref))]
pub fn response_times<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Report<'db> {
    let system = system_of(db, project, deployment);
    report_of(db, project, system, lost_in(db, project, deployment), query)
}

/// The response times of a deployment with other values in its activities: what [`response_times`] would give if the text
/// were changed so. Every value is read, checked and analysed as one that stands there.
pub fn response_times_if<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
    supposed: &[SupposedField],
) -> Report<'db> {
    let Some(data) = declared_deployment(db, deployment) else {
        return response_times(db, project, deployment, query).clone();
    };
    db.unwind_if_revision_cancelled();
    let system = read(db, project, deployment, &with_fields(data, supposed));
    let lost = lost_of(db, project, &system);
    report_of(db, project, &system, &lost, query)
}

/// What is wrong with the activities of a deployment with other values in them; with none, with what it has.
pub fn facts_if<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    supposed: &[SupposedField],
) -> Vec<TimingFact<'db>> {
    let Some(data) = declared_deployment(db, deployment) else { return Vec::new() };
    let system = read(db, project, deployment, &with_fields(data, supposed));
    let urgency = check_rows(db, project, deployment, &system.rows);
    system.facts.into_iter().chain(urgency).collect()
}

fn report_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
    lost: &[Refusal<'db>],
    query: Query,
) -> Report<'db> {
    let psms = psms_of(db, project, system, query.level);
    let (set, reasons) = activities_of(system, &psms, is_throttled(db, project), query);
    let assumed = |psm: &Executed<'db, 'db>| match psm {
        Some(Ok(psm)) => psm.assumed.as_slice(),
        _ => &[],
    };
    let assumed = psms.iter().map(assumed).collect();
    let known = Known { rows: &system.rows, reasons, assumed, lost };
    report(&set, known, query, &|| db.unwind_if_revision_cancelled())
}

/// Does Linux keep some time from real-time tasks?
fn is_throttled<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> bool {
    platform_of(db, project.workspace(db)).rt_throttling == Some(true)
}

/// What an activity executes; none in the background, and where that is not known.
pub(crate) type Executed<'a, 'db> = Option<&'a Result<Psm<'db>, Refused<'db>>>;

/// What each activity of a deployment executes.
pub(crate) fn psms_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
    level: Level,
) -> Vec<Executed<'db, 'db>> {
    // Of lost tables no time is right: what is left is that of `[assume]`.
    let timed = is_timed(db, project);
    let executed = |row: &Row<'db>| row.executed().filter(|_| timed);
    system.rows.iter().map(|row| Some(psm_of(db, project, executed(row)?, level))).collect()
}

/// What else is known of the activities of a set, by their numbers.
pub(crate) struct Known<'a, 'db> {
    pub(crate) rows: &'a [Row<'db>],
    /// Why each itself is not analysed; whom it takes with it is decided by the analysis.
    pub(crate) reasons: Vec<Vec<Refusal<'db>>>,
    /// The codels of each whose time is assumed.
    pub(crate) assumed: Vec<&'a [(String, Time)]>,
    /// Why nothing at all is analysed.
    pub(crate) lost: &'a [Refusal<'db>],
}

/// Analyses the activities, and says of each what comes out, and why.
pub(crate) fn report<'db>(
    set: &ActivitySet,
    known: Known<'_, 'db>,
    query: Query,
    interrupt: &dyn Fn(),
) -> Report<'db> {
    let analysis = set.response_times(&query.options(false), interrupt);
    let Known { rows, reasons, assumed, lost } = known;
    let mut activities = Vec::new();
    for (index, ((row, response), reasons)) in rows.iter().zip(&analysis.responses).zip(reasons).enumerate() {
        let mut activity = background(row);
        if let Some(response) = response {
            activity.own = response.own;
            activity.assumed = assumed.get(index).map_or_else(Vec::new, |it| it.to_vec());
            activity.reasons = reasons;
            // Nothing is claimed of a deployment of which a part is unknown.
            activity.reasons.extend(lost.iter().cloned());
            // Where nothing at all is analysed, that is the reason.
            activity.reasons.extend(delayed_by(rows, row, response).filter(|_| lost.is_empty()));
            activity.verdict = Verdict::RealTime(Status::NotAnalysed);
            if activity.reasons.is_empty() {
                let overload = analysis.overloads.get(index).copied().flatten();
                bounded(rows, &mut activity, response, overload);
            }
        }
        activities.push(activity);
    }
    let cpu = |load: &CpuLoad| CpuReport {
        mask: 1 << load.cpu,
        utilisation: load.utilisation.clone(),
        complete: load.complete && lost.is_empty(),
    };
    Report { activities, cpus: analysis.cpus.iter().map(cpu).collect(), lost: lost.to_vec() }
}

/// The activities that are not analysed and may delay that of `row`, as a reason.
fn delayed_by<'db>(rows: &[Row<'db>], row: &Row<'db>, response: &Response) -> Option<Refusal<'db>> {
    let Bound::NotAnalysed { because } = &response.bound else { return None };
    let others = because.iter().filter_map(|&other| rows.get(other));
    // A second activity of its own instance is a reason already.
    let others: Vec<&Row<'db>> = others.filter(|other| other.instance != row.instance).collect();
    let first = others.first()?;
    // Two activities of one instance have one name.
    let mut seen = FxHashSet::default();
    let instances = others.iter().map(|other| &other.instance).filter(|name| seen.insert(*name));
    let instances = instances.cloned().collect();
    let delayed = Reason::DelayedBy { instances, doubt: doubt_of(&others) };
    Some(Refusal::reported(delayed, first.at.clone()))
}

/// Enters the figures of an activity that is analysed.
fn bounded<'db>(
    rows: &[Row<'db>],
    activity: &mut ActivityReport<'db>,
    response: &Response,
    overload: Option<f64>,
) {
    let at = activity.row.at.clone();
    activity.first_job = response.first_job;
    activity.verdict = Verdict::RealTime(response.status(activity.row.deadline.unwrap_or_default()));
    activity.window = response.window.clone();
    let instance = |task: usize| rows.get(task).map_or_else(|| THROTTLING.into(), |row| row.instance.clone());
    let interference = response.interference.iter().filter(|it| it.jobs > 0);
    activity.interference = interference
        .map(|it| InterferenceReport { instance: instance(it.task), jobs: it.jobs, time: it.time })
        .collect();
    match &response.bound {
        Bound::Response(time) => activity.response = Some(*time),
        Bound::Unbounded { cpu } => {
            let utilisation = Share(overload.unwrap_or_default());
            let overloaded = Reason::Overloaded { cpu: 1 << cpu, utilisation };
            activity.reasons.push(Refusal::reported(overloaded, at));
        }
        Bound::NoBound(why) => activity.reasons.push(Refusal::reported(Reason::NoBound(*why), at)),
        Bound::NotAnalysed { .. } => {}
    }
}

/// What is unknown of those that may delay an activity: they may seem to have a lower priority.
fn doubt_of(others: &[&Row<'_>]) -> Option<Doubt> {
    let is_one = others.iter().all(|other| Some(&other.instance) == others.first().map(|it| &it.instance));
    let have = |is_it: &dyn Fn(&Row<'_>) -> bool| others.iter().all(|other| is_it(other));
    let no_priority = |row: &Row<'_>| row.priority == Priority::Unknown && row.doubt.is_none();
    let doubt = others.first().and_then(|other| other.doubt.as_ref()).filter(|_| is_one);
    match doubt {
        Some(doubt) => Some(doubt.clone()),
        None if have(&no_priority) && is_one => Some(Doubt::UnknownPriority),
        None if have(&no_priority) => Some(Doubt::UnknownPriorities),
        None if have(&|row| row.priority == Priority::Unknown) => Some(Doubt::UnknownPrioritiesOrCpus),
        None => None,
    }
}

/// The activities of a system; with the reasons why each itself is not analysed.
fn activities_of<'db>(
    system: &System<'db>,
    psms: &[Executed<'_, 'db>],
    throttled: bool,
    query: Query,
) -> (ActivitySet, Vec<Vec<Refusal<'db>>>) {
    let reasons: Vec<Vec<Refusal<'db>>> =
        system.rows.iter().zip(psms).map(|(row, psm)| own_reasons(query, row, *psm)).collect();
    let rows = system.rows.iter().zip(psms).zip(&reasons);
    let activities = rows.map(|((row, psm), reasons)| Activity {
        name: row.instance.to_string(),
        priority: row.priority,
        period: row.period,
        deadline: row.deadline,
        cpus: row.cpus,
        demand: match psm {
            Some(Ok(psm)) if reasons.is_empty() => {
                Demand::Machine { machine: psm.machine.clone(), whole: psm.whole }
            }
            _ => Demand::Unknown,
        },
    });
    (ActivitySet { activities: activities.collect(), throttled }, reasons)
}

/// Is no table lost? What reads only this is not run again for every other change of a table.
#[salsa::tracked(returns(copy))]
pub(crate) fn is_timed<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> bool {
    timetable_of(db, project).lost.is_none()
}

/// Why nothing at all can be analysed: an activity may be missing, or a time that makes every bound longer.
#[salsa::tracked(returns(ref))]
pub(crate) fn lost_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Vec<Refusal<'db>> {
    lost_of(db, project, system_of(db, project, deployment))
}

fn lost_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, system: &System<'db>) -> Vec<Refusal<'db>> {
    let mut lost = system.lost.clone();
    if let Some(tables) = &timetable_of(db, project).lost {
        lost.push(Refusal::reported(
            Reason::IncompleteTables(tables.clone()),
            Location::Range(tables.file, 0, 0),
        ));
    }
    if let Some(file) = names_of(db, project).incomplete_file {
        let problem = file.problem(db).as_ref().map(|problem| problem.message().to_owned());
        lost.push(Refusal::reported(Reason::DamagedFile { file, problem }, Location::Range(file, 0, 0)));
    }
    lost
}

fn own_reasons<'db>(query: Query, row: &Row<'db>, psm: Executed<'_, 'db>) -> Vec<Refusal<'db>> {
    let mut reasons = row.refusals.clone();
    match psm {
        Some(Err(refused)) => reasons.extend(refused.refusals.iter().cloned()),
        Some(Ok(Psm { whole_unusable: Some(why), .. })) if query.method == Method::Classic => {
            reasons.push(Refusal::own(Reason::Table(why.clone()), row.at.clone()));
        }
        _ => {}
    }
    reasons
}

fn background<'db>(row: &Row<'db>) -> ActivityReport<'db> {
    ActivityReport {
        row: row.clone(),
        own: None,
        first_job: None,
        response: None,
        verdict: Verdict::Background,
        interference: Vec::new(),
        window: None,
        reasons: Vec::new(),
        assumed: Vec::new(),
    }
}

/// With more codels without a time than this, what one may take if all others take nothing says little, and each costs
/// an analysis for each bit of it.
const MOST_BUDGETS: usize = 8;

/// So many activities are analysed for all of them: as often as a deployment has room in it.
const MOST_SUPPOSED: usize = 1 << 12;

/// The budgets of the codels that a deployment lacks a time for; none where something else keeps it from being
/// analysed, and where very many lack one.
#[salsa::tracked(returns(ref))]
pub fn budgets<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<Budget<'db>> {
    let system: &System<'db> = system_of(db, project, deployment);
    let mut missing: Vec<Decl<'db>> = Vec::new();
    let components = real_time_components(system);
    for &component in &components {
        if let Err(refused) = psm_of(db, project, component, query.level) {
            let new =
                refused.missing.iter().map(|(codel, _)| *codel).filter(|codel| !missing.contains(codel));
            missing.extend(new.collect::<Vec<_>>());
        }
    }
    if missing.len() > MOST_BUDGETS || !lost_in(db, project, deployment).is_empty() {
        return Vec::new();
    }
    let throttled = is_throttled(db, project);
    let left = Cell::new(MOST_SUPPOSED / system.rows.len().max(1));
    let holds = |codel: Decl<'db>, time: Time| -> Option<bool> {
        left.set(left.get().checked_sub(1)?);
        let suppose = |of: Decl<'db>| {
            let supposed = if of == codel { time } else { Time::ZERO };
            missing.contains(&of).then_some(supposed)
        };
        // Only the components that lack a time are another than before.
        let mut supposed: FxHashMap<Decl<'db>, Result<Psm<'db>, Refused<'db>>> = FxHashMap::default();
        for &component in &components {
            if psm_of(db, project, component, query.level).is_err() {
                supposed.insert(component, psm_with(db, project, component, query.level, &suppose));
            }
        }
        let psm = |row: &Row<'db>| {
            let component = row.executed()?;
            supposed.get(&component).or_else(|| Some(psm_of(db, project, component, query.level)))
        };
        let psms: Vec<_> = system.rows.iter().map(psm).collect();
        let (set, _) = activities_of(system, &psms, throttled, query);
        let analysis = set.response_times(&query.options(true), &|| db.unwind_if_revision_cancelled());
        let statuses = system.rows.iter().zip(&analysis.responses);
        let statuses = statuses
            .filter_map(|(row, response)| Some(response.as_ref()?.status(row.deadline.unwrap_or_default())));
        let statuses: Vec<Status> = statuses.collect();
        let has = |status| statuses.contains(&status);
        match () {
            () if has(Status::NotAnalysed) => None,
            () if has(Status::Missed) || has(Status::Unbounded) => Some(false),
            // A search that was given up proves neither.
            () => statuses.iter().all(|status| *status == Status::Met).then_some(true),
        }
    };
    let longest = system.rows.iter().filter_map(|row| row.deadline).max().unwrap_or_default();
    let mut budgets = Vec::new();
    for &codel in &missing {
        let time = match holds(codel, Time::ZERO) {
            // Something else is in the way too.
            None => continue,
            Some(false) => None,
            Some(true) => {
                // The analysis is monotone in every time: bisect between what holds and what cannot.
                let (mut good, mut bad) = (0, longest.as_nanos().saturating_add(1));
                while bad - good > 1 {
                    let middle = good + (bad - good) / 2;
                    match holds(codel, Time::from_nanos(middle)) {
                        Some(true) => good = middle,
                        // What was not looked at is not claimed.
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

fn real_time_components<'db>(system: &System<'db>) -> Vec<Decl<'db>> {
    let mut seen = FxHashSet::default();
    system.rows.iter().filter_map(Row::executed).filter(|component| seen.insert(*component)).collect()
}

/// The codels that the real-time activities of a deployment lack a time for.
pub(crate) fn missing_times<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    level: Level,
) -> Vec<MissingTime<'db>> {
    let mut missing: Vec<MissingTime<'db>> = Vec::new();
    let mut index: FxHashMap<Decl<'db>, usize> = FxHashMap::default();
    for row in &system_of(db, project, deployment).rows {
        let Some(component) = row.executed() else { continue };
        let Err(refused) = psm_of(db, project, component, level) else { continue };
        for (codel, why) in &refused.missing {
            let user = (row.instance.clone(), row.at.clone());
            let at = *index.entry(*codel).or_insert(missing.len());
            match missing.get_mut(at) {
                Some(known) => known.users.push(user),
                None => missing.push(MissingTime {
                    codel: *codel,
                    at_other_levels: why.is_some(),
                    users: vec![user],
                }),
            }
        }
    }
    missing
}

/// Missed deadlines, missing times, and what is not analysed for a reason that nothing else reports.
pub fn timing_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
) -> Vec<TimingFact<'db>> {
    // An incomplete table may have the times that seem to be missing.
    let mut found = match is_timed(db, project) {
        true => missing_time_facts(db, project, deployment, query),
        false => Vec::new(),
    };
    for activity in &response_times(db, project, deployment, query).activities {
        let instance = activity.row.instance.clone();
        let kind = match activity.verdict {
            Verdict::RealTime(Status::Missed | Status::Unbounded | Status::NoBound) => {
                let deadline = activity.row.deadline.unwrap_or_default();
                TimingFactKind::DeadlineMissed { instance, deadline, missed: missed(activity) }
            }
            Verdict::RealTime(Status::NotAnalysed) => {
                let own = activity.reasons.iter().filter(|reason| !reason.reported);
                let reasons: Vec<Refusal<'db>> = own.cloned().collect();
                // Where something else about the activity is wrong already, that comes first.
                if reasons.is_empty() || activity.row.refusals.iter().any(|reason| reason.reported) {
                    continue;
                }
                TimingFactKind::NotAnalysed { instance, reasons }
            }
            Verdict::RealTime(Status::Met) | Verdict::Background => continue,
        };
        found.push(TimingFact::new(activity.row.at.clone(), kind));
    }
    found
}

fn missed<'db>(activity: &ActivityReport<'db>) -> Missed<'db> {
    let Some(response) = activity.response else { return Missed::NoBound(activity.reasons.clone()) };
    // Of a job that waits for others of its own, the window is longer than the response.
    let late = activity.window.as_ref().filter(|window| window.job > 1);
    Missed::Late {
        response,
        heaviest: activity.interference.iter().max_by_key(|it| it.time).cloned(),
        window: late.map(|window| (window.job, window.length)),
    }
}

/// The times that a deployment lacks.
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
        // What was chosen elsewhere is not to be changed there.
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
