//! Response times as one JSON document, for `mauve wcrt --format json`, `mauve check --format json` and the editors'
//! `mauve/analysis`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use mauve_diagnostics::{
    errors_of, exceeded, miss_conditions, missing_proof, not_independent, reasons_of, supported,
    timing_reason,
};
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Acceptance, Database, Decl, Hosts, ModelDb, Project, Workspace, accepted, names_of, projects,
};
use mauve_timing::task_set::TaskSet;
use mauve_timing::{CpuLoad, CpuRule, Level, Task, Time, Unit};
use mauve_wcrt::{
    ActivityReport, Basis, InterferenceReport, LaterThan, Limit, MissProbability, Query, Report, Sensitivity,
    Support, basis_of, distribution_of, is_throttled, levels_of, probabilities_of, response_times, support,
};
use salsa::Database as _;
use serde::Serialize;
use serde_json::Value;

use crate::json::{non_empty, object};

/// The reports of one deployment, one for each significance level.
pub struct Deployed<'db> {
    /// What the reports are read from.
    pub db: &'db Database,
    /// The name of the deployment, or of the task set.
    pub name: &'db str,
    /// Where it comes from.
    pub origin: Analysed<'db>,
    /// A report for each query, in the order of the levels.
    pub reports: Vec<(Query, &'db Report<'db>)>,
    /// The sensitivity for each report; empty where it was not requested.
    pub sensitivities: Vec<Sensitivity<'db>>,
    /// The number of errors in its project: with an error, no deadline is proved.
    pub errors: usize,
    /// Whether probabilities were requested.
    pub has_probabilities: bool,
    /// The accepted instances of `mauve.toml`.
    pub accepted: BTreeMap<Name, &'db Acceptance>,
}

/// The number of deadlines: all, those that are met, and those that are proved.
#[derive(Debug, Clone, Copy, Default)]
pub struct Proved {
    /// All deadlines.
    pub all: usize,
    /// Those that a bound meets.
    pub met: usize,
    /// Those of them whose project has no errors.
    pub proved: usize,
}

impl Proved {
    /// Counts the deadlines of deployments, over all levels.
    pub fn of(deployed: &[Deployed<'_>]) -> Proved {
        let mut sum = Proved::default();
        for it in deployed {
            for deadlines in it.reports.iter().map(|(_, report)| report.deadlines()) {
                sum.all += deadlines.all;
                sum.met += deadlines.met;
                sum.proved += if it.errors == 0 { deadlines.met } else { 0 };
            }
        }
        sum
    }
}

/// What was analysed.
#[derive(Clone, Copy)]
pub enum Analysed<'db> {
    /// A deployment of a project.
    Model(Project<'db>, Decl<'db>),
    /// A task set of the file at this path.
    File {
        /// The file.
        path: &'db Path,
        /// What it says.
        set: &'db TaskSet,
    },
}

impl<'db> Deployed<'db> {
    /// The reports of a deployment of a project.
    pub fn of_model(
        db: &'db Database,
        project: Project<'db>,
        deployment: Decl<'db>,
        queries: impl Iterator<Item = Query>,
    ) -> Deployed<'db> {
        let reports = queries.map(|query| (query, response_times(db, project, deployment, query)));
        let errors = errors_of(db, project);
        let reports: Vec<(Query, &Report<'db>)> = reports.collect();
        let activities = reports.iter().flat_map(|(_, report)| &report.activities);
        let reason = |name: &Name| Some((name.clone(), accepted(db, project, deployment, name)?));
        let accepted = activities.filter_map(|activity| reason(&activity.instance)).collect();
        Deployed {
            db,
            name: deployment.name(db),
            origin: Analysed::Model(project, deployment),
            reports,
            sensitivities: Vec::new(),
            errors,
            has_probabilities: false,
            accepted,
        }
    }

    /// The reason for which the missing proof of an activity is accepted; `None` if it is proved.
    pub fn acceptance(&self, activity: &ActivityReport<'_>) -> Option<&'db str> {
        let found = self.accepted.get(&activity.instance).filter(|it| it.holds(activity.response));
        found.map(|it| it.reason.as_str()).filter(|_| missing_proof(activity).is_some())
    }

    /// What to say of an acceptance that does not hold, since the response time is longer: `accepted until 30 ms only`.
    pub fn exceeded_acceptance(&self, activity: &ActivityReport<'_>) -> Option<String> {
        missing_proof(activity)?;
        exceeded(self.accepted.get(&activity.instance)?, || activity.response)
    }

    /// The number of missing proofs that are accepted, over all levels.
    pub fn accepted_count(&self) -> usize {
        let activities = self.reports.iter().flat_map(|(_, report)| &report.activities);
        activities.filter(|activity| self.acceptance(activity).is_some()).count()
    }

    /// The root of its project, or the file that it comes from.
    pub fn root(&self) -> &'db Path {
        match self.origin {
            Analysed::Model(project, _) => project.root(self.db).path(self.db),
            Analysed::File { path, .. } => path,
        }
    }

    /// The name of the section with its own timing tables; none for those of `[timing] tables`.
    pub fn times(&self) -> Option<&str> {
        self.reports.first().and_then(|(_, report)| report.times.as_deref())
    }

    /// Returns whether Linux throttles real-time tasks; `None` if the configuration does not say.
    pub fn rt_throttling(&self) -> Option<bool> {
        match self.origin {
            Analysed::Model(project, _) => is_throttled(self.db, project.workspace(self.db)),
            Analysed::File { set, .. } => set.rt_throttling,
        }
    }

    /// Is every deadline proved, at every level?
    pub fn schedulable(&self) -> bool {
        self.errors == 0 && self.reports.iter().all(|(_, report)| report.schedulable())
    }

    /// What its figures rest on, at the first of its levels. A task set has a time for each task.
    pub fn basis(&self) -> Option<Basis> {
        let (query, _) = self.reports.first()?;
        match self.origin {
            Analysed::Model(project, of) => Some(basis_of(self.db, project, of, query.level)),
            Analysed::File { set, .. } => {
                let assumed = self.assumed().collect::<BTreeSet<&str>>().len();
                Some(Basis { times: set.task.len(), assumed, ..Basis::default() })
            }
        }
    }

    /// Its project and declaration; none for a task set, which does not say how often its tasks execute codels.
    pub fn model(&self) -> Option<(Project<'db>, Decl<'db>)> {
        match self.origin {
            Analysed::Model(project, deployment) => Some((project, deployment)),
            Analysed::File { .. } => None,
        }
    }

    /// What the levels of its reports support, if its times depend on them.
    pub fn supports(&self) -> Vec<Support> {
        let Some((project, declared)) = self.model() else { return Vec::new() };
        let of = |level| support(self.db, project, declared, level);
        self.reports.iter().filter_map(|(query, _)| of(query.level)).collect()
    }

    /// How probable it is that each activity is late.
    pub fn probabilities(&self) -> &'db [Option<MissProbability>] {
        self.model().map_or(&[], |(project, declared)| probabilities_of(self.db, project, declared))
    }

    /// The distribution of the response time of an activity.
    fn distribution(&self, index: usize) -> &'db [LaterThan] {
        self.model().map_or(&[], |(project, declared)| distribution_of(self.db, project, declared, index))
    }

    /// The codels whose times are assumed.
    pub fn assumed(&self) -> impl Iterator<Item = &str> {
        let activities = self.reports.iter().flat_map(|(_, report)| &report.activities);
        activities.flat_map(|it| &it.assumed).map(|(codel, _)| codel.as_str())
    }
}

/// The number of interfering activities that are listed for an activity, largest first: large systems have thousands.
const MOST_INTERFERENCE: usize = 100;

/// Returns the results of a deployment as they stand in JSON: one for each level.
pub fn analysis_document(it: &Deployed<'_>) -> impl Serialize + use<> {
    let probabilities = if it.has_probabilities { it.probabilities() } else { &[] };
    let query = it.reports.first().map(|(query, _)| query);
    let results = it.reports.iter().enumerate().map(|(index, (query, report))| {
        let interrupt = || it.db.unwind_if_revision_cancelled();
        let mut breakdown = report.breakdown(&interrupt);
        let activities = report.activities.iter().enumerate();
        let activities = activities.map(|(index, activity)| {
            let probability = probabilities.get(index).and_then(Option::as_ref);
            activity_document(
                it,
                *query,
                &report.hosts,
                (activity, probability.map(|found| (found, it.distribution(index)))),
                breakdown.greatest_of(index, MOST_INTERFERENCE),
            )
        });
        object! {
            significance: query.level.as_f64(),
            schedulable: it.errors == 0 && report.schedulable(),
            // The reasons why no activity is analysed.
            [lost]: non_empty(report.not_analysed.iter().map(|lost| timing_reason(it.db, &lost.reason))),
            cpus: report.cpus.iter().map(|it| cpu_document(&report.hosts, it)).collect::<Vec<_>>(),
            activities: activities.collect::<Vec<_>>(),
            // Only with `--sensitivity`.
            [sensitivity]: it.sensitivities.get(index).map(|found| sensitivity_document(it.db, found)),
        }
    });
    let others = it.reports.first().into_iter().flat_map(|(_, report)| report.others());
    let hosts = it.reports.first().map(|(_, report)| report.hosts.clone()).unwrap_or_default();
    object! {
        deployment: it.name.to_owned(),
        // The root of its project, or the file that it comes from.
        root: it.root().display().to_string(),
        // The section with its own timing tables, where it has one.
        [times]: it.times().map(str::to_owned),
        unit: "ms",
        method: query.map_or_else(String::new, |query| query.method.to_string()),
        // Whether Linux reserves 50 ms of each second for non-real-time tasks; null if the configuration does not
        // say: then no throttling is assumed.
        rt_throttling: it.rt_throttling(),
        // The number of errors in its project: with an error, no deadline is proved.
        [errors]: Some(it.errors).filter(|errors| *errors > 0),
        // How many executions may exceed their times at the first level; a task set does not say it.
        [support]: it.model().zip(query).map(|(_, query)| {
            let support = it.supports().first().copied();
            let executions = support.map_or(0.0, |it| it.executions_per_hour);
            object! {
                level: query.level.as_f64(),
                executions_per_hour: executions,
                exceedances_per_hour: support.map_or(0.0, Support::exceedances_per_hour),
                [words]: support.map(supported),
            }
        }),
        // Real-time work that is not in the model, and interferes too.
        [other]: non_empty(others.map(|it| other_document(&hosts, it))),
        results: results.collect::<Vec<_>>(),
    }
}

fn other_document(hosts: &Hosts, other: &Task) -> impl Serialize + use<> {
    let (host, cpus) = hosts.local(other.cpus.unwrap_or_default());
    object! {
        name: other.name.to_string(),
        [host]: host.map(ToString::to_string),
        affinity: other.cpus.map(|_| cpus),
        priority: other.priority.real_time(),
        period: other.period.map(milliseconds),
        jitter: milliseconds(other.jitter),
        time: other.greatest_cost().map(milliseconds),
    }
}

/// Returns the load of a group of CPUs as it stands in JSON.
pub fn cpu_document(hosts: &Hosts, cpu: &CpuLoad) -> impl Serialize + use<> {
    let (host, mask) = hosts.local(cpu.cpus);
    object! { [host]: host.map(ToString::to_string), mask: mask, utilisation: cpu.utilisation.as_f64(), complete: cpu.complete }
}

fn activity_document(
    of: &Deployed<'_>,
    query: Query,
    hosts: &Hosts,
    (activity, probability): (&ActivityReport<'_>, Option<(&MissProbability, &[LaterThan])>),
    (interference, interference_left): (Vec<InterferenceReport>, usize),
) -> impl Serialize + use<> {
    let (host, cpus) = hosts.local(activity.cpus.unwrap_or_default());
    let interference = interference
        .into_iter()
        .map(|it| object! { instance: it.instance.to_string(), jobs: it.jobs, time: milliseconds(it.time) });
    let window =
        activity.window.as_ref().filter(|window| window.job > 1 || window.start.is_some()).map(|it| {
            object! {
                job: it.job,
                own: milliseconds(it.own),
                length: milliseconds(it.length),
                // Where it begins, on the clock that synchronised activities share.
                [start]: it.start.map(milliseconds),
                // The response time is length − delay − (job − 1) · period + jitter.
                [delay]: it.start.map(|_| milliseconds(it.delay)),
            }
        });
    let assumed = activity.assumed.iter();
    let assumed = assumed.map(|(codel, time)| object! { codel: codel.clone(), time: milliseconds(*time) });
    let calls = activity.calls.iter().map(|it| {
        let (operation, client) = (it.operation.to_string(), it.client.to_string());
        object! { operation: operation, client: client, calls: it.calls, time: milliseconds(it.time) }
    });
    object! {
        instance: activity.instance.to_string(),
        component: activity.component_name.to_string(),
        // The computer that it runs on, where there are several: affinities are in its numbers.
        [host]: host.map(ToString::to_string),
        affinity: activity.cpus.map(|_| cpus),
        priority: activity.priority.real_time(),
        period: activity.period.map(milliseconds),
        deadline: activity.deadline.map(milliseconds),
        // The greatest delay of a release, if there is any.
        [jitter]: Some(activity.jitter).filter(|jitter| *jitter > Time::ZERO).map(milliseconds),
        // The method that gives the response time.
        method: activity.method.map_or(query.method, |(method, _)| method).to_string(),
        // Whether the budget of a better method was exhausted.
        [exhausted]: activity.method.filter(|(_, is_exhausted)| *is_exhausted).map(|_| true),
        // Whether it waits only while each of its CPUs executes an activity of higher or equal priority.
        [waits_for_all_cpus]: matches!(activity.rule, Some(CpuRule::Global(_))).then_some(true),
        // The CPUs whose activities are counted, where these are not those of the affinity.
        [counted_cpus]: activity.rule.map(CpuRule::cpus).filter(|cpus| Some(*cpus) != activity.cpus).map(|cpus| hosts.local(cpus).1),
        own: activity.own.map(milliseconds),
        // What of `own` its codels wait.
        [wait]: Some(activity.task.wait()).filter(|wait| *wait > Time::ZERO).map(milliseconds),
        // How long lower priorities that hold locks delay it.
        [blocking]: activity.window.as_ref().map(|it| it.blocking).filter(|it| *it > Time::ZERO).map(milliseconds),
        // The calls that each job executes for other activities; `own` includes them.
        [calls]: non_empty(calls),
        first_job: activity.first_job.map(milliseconds),
        response: activity.response.map(milliseconds),
        status: activity.verdict.name(),
        // Why `mauve.toml` accepts that the deadline is not proved.
        [accepted]: of.acceptance(activity).map(str::to_owned),
        [window]: window,
        interference: interference.collect::<Vec<_>>(),
        [interference_left]: Some(interference_left).filter(|left| *left > 0),
        // Codels that no table has, with the times that `[assume]` gives them.
        [assumed]: non_empty(assumed),
        // Only with `--probability`: how probable a late job is, at most: in an hour, and one after a job that was not late.
        [probability]: probability.map(|(it, distribution)| {
            let later = |it: &LaterThan| {
                object! {
                    response_ms: milliseconds(it.time),
                    per_job: it.per_job,
                    per_hour: it.per_hour,
                }
            };
            object! {
                miss_per_job: it.per_job,
                miss_per_hour: it.per_hour,
                rule: it.rule(),
                conditions: miss_conditions(it),
                // Why no rule uses independence.
                [reason]: not_independent(it),
                // How probable a longer response is.
                distribution: distribution.iter().map(later).collect::<Vec<_>>(),
            }
        }),
        reasons: reasons_of(of.db, activity),
    }
}

/// How far each time and each period may change alone.
fn sensitivity_document(db: &Database, found: &Sensitivity<'_>) -> impl Serialize + use<> {
    let not_analysed = |limit: &Limit| match limit {
        Limit::NotAnalysed(Some(instance)) => Some(instance.to_string()),
        _ => None,
    };
    let unproved = |name: &Option<Name>| name.as_ref().map(Name::to_string);
    let times = found.times.iter().map(|it| {
        object! {
            key: it.key(db),
            time: it.time.map(milliseconds),
            // The greatest time with which every deadline that it affects is proved.
            at_most: it.limit.time().map(milliseconds),
            // The same as a multiple of the present time, rounded.
            factor: it.time.zip(it.limit.time()).and_then(|(now, limit)| factor(now, limit)),
            // `last`, or `proved` if it is unknown whether a greater time misses a deadline. `any`, `not-found`, `not-analysed`
            // or `exhausted` where there is no time.
            limit: it.limit.name(),
            // The first affected activity whose deadline is not proved with the present time.
            [unproved]: unproved(&it.unproved),
            // The affected activity that is not analysed.
            [not_analysed]: not_analysed(&it.limit),
        }
    });
    let activities = found.activities.iter().map(|it| {
        object! {
            instance: it.instance.to_string(),
            period: it.period.map(milliseconds),
            // The least period with which every deadline that it affects is proved.
            at_least: it.limit.time().map(milliseconds),
            slack: it.slack.map(milliseconds),
            limit: it.limit.name(),
            // Whether a period between the two may be too short, because the activity executes operations for others.
            [serves]: it.serves.then_some(true),
            [unproved]: unproved(&it.unproved),
            [not_analysed]: not_analysed(&it.limit),
        }
    });
    object! { times: times.collect::<Vec<_>>(), activities: activities.collect::<Vec<_>>() }
}

/// Returns by which factor a time grows from `now` to `then`; none where it is 0 now.
pub fn factor(now: Time, then: Time) -> Option<f64> {
    (now > Time::ZERO).then(|| then.as_f64(Unit::Nanoseconds) / now.as_f64(Unit::Nanoseconds))
}

/// The significance levels of an analysis.
#[derive(Debug, Clone)]
pub enum Significance {
    /// All levels of the tables.
    All,
    /// These, in this order.
    These(Vec<Level>),
}

impl std::str::FromStr for Significance {
    type Err = String;

    fn from_str(text: &str) -> Result<Significance, String> {
        if text == "all" {
            return Ok(Significance::All);
        }
        let level = |text: &str| {
            let level = text.trim().parse().ok().and_then(Level::from_f64);
            level.ok_or_else(|| {
                format!(
                    "`{text}` is not a significance level: expected numbers between 0 and 1, or `all` \
                    alone"
                )
            })
        };
        let mut levels: Vec<Level> = text.split(',').map(level).collect::<Result<_, _>>()?;
        let mut seen = BTreeSet::new();
        levels.retain(|level| seen.insert(*level));
        Ok(Significance::These(levels))
    }
}

/// Returns the levels to analyse for a deployment: those requested, all levels of its tables, or the level of `mauve.toml`.
pub fn levels<'db>(
    db: &'db Database,
    project: Project<'db>,
    deployment: Decl<'db>,
    asked: Option<&Significance>,
) -> Vec<Level> {
    let shown = Query::shown(db, project, deployment).level;
    match asked {
        Some(Significance::These(levels)) => levels.clone(),
        Some(Significance::All) => {
            let levels = levels_of(db, project, deployment);
            // Times that hold at every level need one column.
            if levels.is_empty() { vec![shown] } else { levels }
        }
        None => vec![shown],
    }
}

/// The deployments of these workspaces, each in each of its projects; those called `only` if that is given.
pub fn deployments<'db>(
    db: &'db Database,
    workspaces: &[Workspace],
    only: Option<&str>,
) -> Result<Vec<(Project<'db>, Decl<'db>)>, String> {
    declared(db, workspaces, Kind::Deployment, only)
}

/// The same for declarations of another kind.
pub fn declared<'db>(
    db: &'db Database,
    workspaces: &[Workspace],
    kind: Kind,
    only: Option<&str>,
) -> Result<Vec<(Project<'db>, Decl<'db>)>, String> {
    let mut found = Vec::new();
    for &workspace in workspaces {
        for &project in projects(db, workspace) {
            found.extend(names_of(db, project).of_kind(db, kind).map(|decl| (project, decl)));
        }
    }
    let Some(only) = only else { return Ok(found) };
    let known: Vec<String> = found.iter().map(|(_, decl)| decl.qualified(db)).collect();
    found.retain(|(_, decl)| decl.is_called(db, only));
    if found.is_empty() {
        return Err(match known.as_slice() {
            [] => format!("no {kind} `{only}`: the project has no {kind}s"),
            known => format!("no {kind} `{only}`: there is {}", known.join(", ")),
        });
    }
    Ok(found)
}

/// The report of each deployment of these workspaces at its own level.
pub fn at_shown_level<'db>(
    db: &'db Database,
    workspaces: &[Workspace],
) -> Result<Vec<Deployed<'db>>, String> {
    let deployed = |(project, deployment)| {
        Deployed::of_model(db, project, deployment, std::iter::once(Query::shown(db, project, deployment)))
    };
    Ok(deployments(db, workspaces, None)?.into_iter().map(deployed).collect())
}

/// The deployments of a project.
pub fn deployments_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> impl Iterator<Item = Decl<'db>> + use<'db> {
    names_of(db, project).of_kind(db, Kind::Deployment)
}

/// Returns a time in milliseconds, as an integer if it is one.
pub fn milliseconds(time: Time) -> Value {
    if time.as_nanos().is_multiple_of(1_000_000) {
        (time.as_nanos() / 1_000_000).into()
    } else {
        time.as_f64(Unit::Milliseconds).into()
    }
}
