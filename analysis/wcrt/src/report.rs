//! Queries and reports: the response times of a deployment, of a model or of an exported file.

use std::cmp::Reverse;
use std::ops::Deref;
use std::sync::Arc;

use mauve_timing::{
    Breakdown, CpuLoad, CpuRule, CpuSet, Level, Lock, Method, Options, Status, Task, Tasks, Time, Window,
};

use crate::executions::chosen_level;
use crate::fact::InterferenceReport;
use crate::reason::{Refusal, Share, UnknownPriority};
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, Hosts, Location, ModelDb, Project, config_of, names_of};

/// A query to the analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Query {
    /// The significance level.
    pub level: Level,
    /// The method that bounds the demand of several jobs.
    pub method: Method,
}

impl Query {
    /// Returns the options of the analysis; the smaller budget if `is_brief`.
    pub fn options(self, is_brief: bool) -> Options {
        Options { method: self.method, is_brief }
    }

    /// Returns the query of the displayed and checked report of a deployment, with the most precise method. Its level is the
    /// user's choice, otherwise that of `mauve.toml`: of `required`, or `significance`.
    pub fn shown<'db>(db: &'db dyn ModelDb, project: Project<'db>, deployment: Decl<'db>) -> Query {
        let workspace = project.workspace(db);
        let selected = workspace.significance(db);
        let chosen = || chosen_level(db, project, deployment).as_ref().map(|it| it.level);
        let level = selected.or_else(chosen).unwrap_or_else(|| config_of(db, workspace).level());
        Query { level, method: Method::Best }
    }

    /// The same at another level, if there is one.
    pub fn at_level<'db>(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        deployment: Decl<'db>,
        level: Option<Level>,
    ) -> Query {
        let shown = Query::shown(db, project, deployment);
        Query { level: level.unwrap_or(shown.level), ..shown }
    }
}

/// Returns the level at which what belongs to no deployment is shown, such as a codel: the least probable one of the deployments.
pub fn level_shown<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Level {
    let config = config_of(db, project.workspace(db));
    let of_deployments = || {
        let all = names_of(db, project).of_kind(db, Kind::Deployment);
        all.map(|deployment| Query::shown(db, project, deployment).level).min()
    };
    let selected = project.workspace(db).significance(db);
    // Without `required`, each deployment has the same level.
    let chosen = || config.has_required().then(of_deployments).flatten();
    selected.or_else(chosen).unwrap_or_else(|| config.level())
}

/// The response times of a deployment.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Report<'db> {
    /// The name in the header `[timing.deployment.NAME]` of its own timing tables; none for those of `[timing] tables`, and in an
    /// exported file.
    pub times: Option<Name>,
    /// In the order of the deployment.
    pub activities: Vec<ActivityReport<'db>>,
    /// The CPUs that are used.
    pub cpus: Vec<CpuLoad>,
    /// Why nothing is analysed: an activity or a time may be missing.
    pub not_analysed: Vec<Refusal<'db>>,
    /// The hosts of its CPUs.
    pub hosts: Arc<Hosts>,
    pub(crate) tasks: Arc<Tasks>,
    pub(crate) options: Options,
}

/// The response time of one activity: its task, its place in the text, and its figures. It is read as its task.
/// [`Report::breakdown`] lists the interference in it.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct ActivityReport<'db> {
    /// Its task. The response time counts from the nominal release.
    pub task: Task,
    /// The instance.
    pub instance: Name,
    /// The name of its component.
    pub component_name: Name,
    /// Its component, where that is known; none in an exported file.
    pub component: Option<Decl<'db>>,
    /// The name of its thread, if that executes other activities too.
    pub thread: Option<Name>,
    /// Whether its jobs have the overhead of a wake-up: see [`ResolvedActivity::wakes`](crate::ResolvedActivity::wakes).
    pub wakes: bool,
    /// Its location; none in an exported file.
    pub at: Option<Location<'db>>,
    /// Why its priority counts as unknown although one is written.
    pub unknown_priority: Option<UnknownPriority>,
    /// The greatest cost of one of its jobs.
    pub own: Option<Time>,
    /// The utilisation of its CPU by it alone, where any CPU is overloaded.
    pub share: Option<Share>,
    /// See [`mauve_timing::Response::first_job`].
    pub first_job: Option<Time>,
    /// The greatest time from a release to the end of its job.
    pub response: Option<Time>,
    /// The status of the response time.
    pub verdict: Status,
    /// The window that gives the response time.
    pub window: Option<Window>,
    /// The method that gives the response time, and whether the budget of a better one was exhausted; none without a bound.
    pub method: Option<(Method, bool)>,
    /// The calls that are counted in each of its jobs, of operations that take time.
    pub calls: Vec<CallsReport>,
    /// The activities that are counted; none where it is not analysed.
    pub rule: Option<CpuRule>,
    /// The reasons for a missing response time: its own, then those of the deployment.
    pub reasons: Vec<Refusal<'db>>,
    /// Codels whose time is assumed, in its own component, with it.
    pub assumed: Vec<(String, Time)>,
    /// Whether a time in its own component is extrapolated.
    pub is_extrapolated: bool,
}

/// What a response time rests on, besides times that were written by hand, or counted. The worst is the greatest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Footing {
    /// On nothing else.
    Known,
    /// On a measured time that no execution confirms at its level.
    Extrapolated,
    /// On an assumed time.
    Assumed,
}

impl Deref for ActivityReport<'_> {
    type Target = Task;

    fn deref(&self) -> &Task {
        &self.task
    }
}

impl ActivityReport<'_> {
    /// Returns the time between its response and its deadline, where that is met.
    pub fn slack(&self) -> Option<Time> {
        self.deadline?.checked_sub(self.response?)
    }

    /// Returns its response time as a part of its deadline: of two activities, the one with more has less slack. `None` for background
    /// activities, and without a response time.
    pub fn used(&self) -> Option<f64> {
        let (response, deadline) = self.response.zip(self.deadline)?;
        let is_real_time = self.verdict != Status::Background;
        is_real_time.then(|| response.as_nanos() as f64 / deadline.as_nanos().max(1) as f64)
    }
}

/// The interference in the response times of a report. It is computed on request: the lists of all activities together grow
/// with the square of their number.
pub struct ReportBreakdown<'a> {
    activities: &'a [ActivityReport<'a>],
    tasks: &'a Tasks,
    breakdown: Breakdown<'a>,
}

impl ReportBreakdown<'_> {
    /// Returns the interference in the window that determines the response time of an activity, in the order of the
    /// deployment.
    pub fn of(&mut self, activity: usize) -> Vec<InterferenceReport> {
        let Some(report) = self.activities.get(activity) else { return Vec::new() };
        let Some(rule) = report.rule else { return Vec::new() };
        let parts = self.breakdown.of(activity, rule, report.window.as_ref(), report.first_job).into_iter();
        let instance = |task: usize| self.tasks.name(task).into();
        let named = parts.filter(|it| it.jobs > 0);
        named
            .map(|it| InterferenceReport { instance: instance(it.task), jobs: it.jobs, time: it.time })
            .collect()
    }

    /// Returns the `most` activities that interfere longest with an activity, in the order of the deployment, and the
    /// number of the others.
    pub fn greatest_of(&mut self, activity: usize, most: usize) -> (Vec<InterferenceReport>, usize) {
        let mut parts: Vec<(usize, InterferenceReport)> = self.of(activity).into_iter().enumerate().collect();
        let left = parts.len().saturating_sub(most);
        if left > 0 {
            parts.select_nth_unstable_by_key(most, |(number, it)| (Reverse(it.time), *number));
            parts.truncate(most);
            parts.sort_by_key(|(number, _)| *number);
        }
        (parts.into_iter().map(|(_, it)| it).collect(), left)
    }
}

/// The calls of an operation that each job of an activity executes for a client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CallsReport {
    /// The operation.
    pub operation: Name,
    /// The instance of the client.
    pub client: Name,
    /// The number of calls.
    pub calls: u64,
    /// Their execution time.
    pub time: Time,
}

/// The utilisation of a CPU, or of several CPUs that activities may use alternatively, by what executes there.
#[derive(Debug, Clone, PartialEq)]
pub struct CpuBudget<'a> {
    /// The CPUs with their utilisation.
    pub load: &'a CpuLoad,
    /// What executes there, the largest part first; nothing of unknown demand.
    pub parts: Vec<CpuPart>,
}

/// A part of the utilisation of a CPU.
#[derive(Debug, Clone, PartialEq)]
pub struct CpuPart {
    /// An instance, other work on the platform, or real-time throttling.
    pub name: Name,
    /// The index of its activity, if it is one.
    pub activity: Option<usize>,
    /// The part of one CPU, rounded.
    pub share: f64,
}

impl<'db> Report<'db> {
    /// Returns the real-time work that is not in the model, and interferes too.
    pub fn others(&self) -> &[Task] {
        self.tasks.others()
    }

    /// Returns the locks that the activities take.
    pub fn locks(&self) -> &[Lock] {
        &self.tasks.locks
    }

    /// Returns the utilisation of a CPU by each activity alone, without its waits; none where its execution time is not known.
    pub fn utilisations(&self) -> impl Iterator<Item = Option<f64>> {
        self.tasks.shares(self.options.method)
    }

    /// Returns the utilisation of each CPU by what executes there, in the order of [`Report::cpus`].
    pub fn budgets(&self) -> Vec<CpuBudget<'_>> {
        let tasks = self.tasks.all().iter().zip(self.utilisations()).enumerate();
        let known = tasks.filter_map(|(index, (task, share))| Some((index, task, share?)));
        let known: Vec<(usize, &Task, f64)> = known.collect();
        let budget = |load| {
            let is_here = |task: &Task| task.cpus.unwrap_or(CpuSet::ALL).meets(load);
            let here = known.iter().filter(|(_, task, _)| is_here(task));
            let part = |&(index, _, share): &(usize, &Task, f64)| CpuPart {
                name: self.tasks.name(index).into(),
                activity: Some(index).filter(|index| *index < self.activities.len()),
                share,
            };
            let mut parts: Vec<CpuPart> = here.map(part).filter(|it| it.share > 0.0).collect();
            // A stable sort keeps the order of the deployment.
            parts.sort_by(|one, other| other.share.total_cmp(&one.share));
            parts
        };
        self.cpus.iter().map(|load| CpuBudget { load, parts: budget(load.cpus) }).collect()
    }

    /// Returns a breakdown of the response times. To cancel, `interrupt` unwinds.
    pub fn breakdown<'a>(&'a self, interrupt: &'a dyn Fn()) -> ReportBreakdown<'a> {
        let breakdown = Breakdown::new(self.tasks.all(), &self.options, interrupt);
        ReportBreakdown { activities: &self.activities, tasks: &self.tasks, breakdown }
    }

    /// Returns for each activity whether its response time is computed with assumed times: its own, or those of an
    /// activity that interferes with it.
    pub fn with_assumptions(&self) -> Vec<bool> {
        self.with(|it| !it.assumed.is_empty())
    }

    /// Returns for each activity what its response time rests on: its own times, and those of activities that interfere with it.
    pub fn footings(&self) -> Vec<Footing> {
        let both = self.with_assumptions().into_iter().zip(self.with(|it| it.is_extrapolated));
        let footing = |(is_assumed, is_extrapolated)| match (is_assumed, is_extrapolated) {
            (true, _) => Footing::Assumed,
            (_, true) => Footing::Extrapolated,
            _ => Footing::Known,
        };
        both.map(footing).collect()
    }

    /// Returns for each activity whether it has such a time, or an activity that interferes with it.
    fn with(&self, has: impl Fn(&ActivityReport<'db>) -> bool) -> Vec<bool> {
        // The highest priority with such a time on each CPU.
        let mut highest = [None; CpuSet::MOST as usize];
        for activity in self.activities.iter().filter(|it| has(it)) {
            let cpus = activity.cpus.unwrap_or_default();
            for cpu in cpus.iter() {
                let Some(highest) = highest.get_mut(cpu as usize) else { continue };
                *highest = (*highest).max(activity.priority.real_time());
            }
        }
        let interferes = |it: &ActivityReport<'db>| {
            let counted = it.rule.map_or(CpuSet::NONE, CpuRule::cpus);
            let mut highest = counted.iter().filter_map(|cpu| highest.get(cpu as usize));
            it.first_job.is_some() && highest.any(|highest| *highest >= it.priority.real_time())
        };
        self.activities.iter().map(|it| has(it) || interferes(it)).collect()
    }

    /// Returns whether every deadline is proved.
    pub fn schedulable(&self) -> bool {
        self.not_analysed.is_empty() && self.activities.iter().all(|activity| activity.verdict.is_met())
    }

    /// Returns whether a response time holds only if the clocks are synchronised that `mauve.toml` declares to be.
    pub fn assumes_clocks(&self) -> bool {
        let has_start =
            |it: &ActivityReport<'_>| it.window.as_ref().is_some_and(|window| window.start.is_some());
        self.activities.iter().any(has_start)
    }

    /// Counts the deadlines of the real-time activities.
    pub fn deadlines(&self) -> Deadlines {
        let mut counted = Deadlines::default();
        for activity in &self.activities {
            match activity.verdict {
                Status::Background => continue,
                Status::NotAnalysed => counted.unknown += 1,
                Status::Met => counted.met += 1,
                Status::Missed | Status::Unbounded | Status::NoBound => {}
            }
            counted.all += 1;
        }
        counted
    }
}

/// The number of deadlines. Those that are neither met nor unknown are not proved: they are missed, or no bound was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Deadlines {
    /// Those that are proved.
    pub met: usize,
    /// Those of activities that are not analysed.
    pub unknown: usize,
    /// All. Background activities have none.
    pub all: usize,
}
