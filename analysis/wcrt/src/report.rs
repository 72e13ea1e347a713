//! Queries and reports: the response times of a deployment, of a model or of an exported file.

use std::cmp::Reverse;

use mauve_timing::task_set::Priority;
use mauve_timing::{Activity, CpuLoad, Level, Method, Options, Status, Time, Window};

use crate::fact::InterferenceReport;
use crate::reason::{Refusal, Share, UnknownPriority};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Location, ModelDb, Project, Workspace, config_of};

/// A query to the analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Query {
    /// The significance level.
    pub level: Level,
    /// The method that bounds the demand of several jobs.
    pub method: Method,
    /// Unsafe, for comparison with the paper only; see [`Options::horizon`].
    pub horizon: Option<Time>,
}

impl Query {
    pub(crate) fn options(self, is_brief: bool) -> Options {
        Options { method: self.method, horizon: self.horizon, is_brief }
    }

    /// Returns the query of the displayed and checked report: the level of [`level_shown`], with the most precise
    /// method.
    pub fn shown<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Query {
        Query { level: level_shown(db, project.workspace(db)), method: Method::Psm, horizon: None }
    }
}

/// Returns the significance level of the report: the user's choice, otherwise that of `mauve.toml`.
pub fn level_shown(db: &dyn ModelDb, workspace: Workspace) -> Level {
    workspace.significance(db).unwrap_or_else(|| config_of(db, workspace).level())
}

/// The response times of a deployment.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Report<'db> {
    /// In the order of the deployment.
    pub activities: Vec<ActivityReport<'db>>,
    /// The CPUs that are used.
    pub cpus: Vec<CpuLoad>,
    /// Why nothing is analysed: an activity or a time may be missing.
    pub not_analysed: Vec<Refusal<'db>>,
}

/// The response time of one activity, and where it comes from.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct ActivityReport<'db> {
    /// The instance.
    pub instance: Name,
    /// The name of its component.
    pub component_name: Name,
    /// Its component, where that is known; none in an exported file.
    pub component: Option<Decl<'db>>,
    /// Its location; none in an exported file.
    pub at: Option<Location<'db>>,
    /// Its priority.
    pub priority: Priority,
    /// The CPUs that it may use, a bit each; `None` where they are unknown.
    pub cpus: Option<u64>,
    /// T.
    pub period: Option<Time>,
    /// D.
    pub deadline: Option<Time>,
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
    pub verdict: Verdict,
    /// The interference in the window that determines the response time.
    pub interference: Vec<InterferenceReport>,
    /// The window that gives the response time.
    pub window: Option<Window>,
    /// The reasons for a missing response time: its own, then those of the deployment.
    pub reasons: Vec<Refusal<'db>>,
    /// Codels whose time is assumed, in its own component, with it.
    pub assumed: Vec<(String, Time)>,
}

impl ActivityReport<'_> {
    pub(crate) fn without_figures(activity: &Activity) -> Self {
        ActivityReport {
            instance: activity.name.as_str().into(),
            priority: activity.priority,
            cpus: activity.cpus,
            period: activity.period,
            deadline: activity.deadline,
            ..ActivityReport::default()
        }
    }

    /// Returns the `most` activities that interfere longest, in the order of the deployment.
    pub fn greatest_interference(&self, most: usize) -> Vec<&InterferenceReport> {
        let mut greatest: Vec<(usize, &InterferenceReport)> = self.interference.iter().enumerate().collect();
        greatest.sort_by_key(|(_, it)| Reverse(it.time));
        greatest.truncate(most);
        greatest.sort_by_key(|(number, _)| *number);
        greatest.into_iter().map(|(_, it)| it).collect()
    }
}

/// The result of the analysis of an activity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Verdict {
    /// The activity is real-time.
    RealTime(Status),
    /// The activity is not real-time.
    #[default]
    Background,
}

impl Verdict {
    /// Returns `met`, `missed`, `unbounded`, `no-bound`, `not-analysed` or `background`.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::RealTime(status) => status.name(),
            Verdict::Background => "background",
        }
    }

    /// Returns whether the deadline is proved.
    pub fn is_met(self) -> bool {
        matches!(self, Verdict::Background | Verdict::RealTime(Status::Met))
    }
}

impl Report<'_> {
    /// Returns whether every deadline is proved.
    pub fn schedulable(&self) -> bool {
        self.not_analysed.is_empty() && self.activities.iter().all(|activity| activity.verdict.is_met())
    }

    /// Counts the deadlines of the real-time activities.
    pub fn deadlines(&self) -> Deadlines {
        let mut counted = Deadlines::default();
        for activity in &self.activities {
            let Verdict::RealTime(status) = activity.verdict else { continue };
            counted.all += 1;
            match status {
                _ if !self.not_analysed.is_empty() => counted.unknown += 1,
                Status::NotAnalysed => counted.unknown += 1,
                Status::Met => counted.met += 1,
                Status::Missed | Status::Unbounded | Status::NoBound => {}
            }
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
