//! A simulated deployment and its activities.

use mauve_diagnostics::figure::TIGHT_SLACK;
use mauve_hir::Database;
use mauve_ide::{WayOf, WorstOf};
use mauve_timing::{LeftOut, Level, Pass, Schedule, SimulationOptions, Statistics, TaskKind, Unit};
use mauve_wcrt::{ActivityReport, DeployedTasks, Report};

/// A simulated deployment.
pub(super) struct Simulation<'db> {
    pub(super) db: &'db Database,
    pub(super) name: String,
    pub(super) level: Level,
    /// The bounds. The activities are those of the deployment, in the same order.
    pub(super) report: Report<'db>,
    pub(super) deployment: DeployedTasks<'db>,
    pub(super) options: SimulationOptions,
    pub(super) schedule: Schedule,
    /// With `--worst`.
    pub(super) worst: Option<WorstOf>,
    /// With `--worst-chain`.
    pub(super) way: Option<WayOf>,
    /// The number of errors in its project.
    pub(super) errors: usize,
}

/// An activity of a simulation.
pub(super) struct SimulationRow<'a, 'db> {
    pub(super) activity: &'a ActivityReport<'db>,
    pub(super) statistics: Option<Statistics>,
    pub(super) left_out: Option<LeftOut>,
}

impl SimulationRow<'_, '_> {
    /// Returns the greatest simulated response time as a part of the bound.
    pub(super) fn ratio(&self) -> Option<f64> {
        let greatest = self.statistics?.greatest?.as_f64(Unit::Milliseconds);
        let bound = self.activity.response?.as_f64(Unit::Milliseconds);
        (bound > 0.0).then_some(greatest / bound)
    }
}

impl<'db> Simulation<'db> {
    pub(super) fn rows(&self) -> impl Iterator<Item = SimulationRow<'_, 'db>> {
        let left_out = |index: usize| self.schedule.left_out.iter().find(|(activity, _)| *activity == index);
        let activities = self.report.activities.iter().enumerate().zip(&self.schedule.statistics);
        activities.map(move |((index, activity), statistics)| SimulationRow {
            activity,
            statistics: *statistics,
            left_out: left_out(index).map(|(_, why)| *why),
        })
    }

    /// Returns the name of an activity or of other work; none for real-time throttling.
    pub(super) fn instance(&self, activity: usize) -> Option<String> {
        let tasks = &self.deployment.tasks;
        (tasks.kind(activity) != TaskKind::Throttling).then(|| tasks.name(activity))
    }

    /// Says what `--worst` or `--worst-chain` has found.
    pub(super) fn worst_case(&self) -> Option<String> {
        let of_chain = || self.way.as_ref().map(WayOf::description);
        let worst = self.worst.as_ref();
        worst.map(|worst| worst.description(&self.deployment, &self.schedule, TIGHT_SLACK)).or_else(of_chain)
    }

    /// Returns the way of data that `--worst-chain` has found.
    pub(super) fn passes(&self) -> &[Pass] {
        self.way.as_ref().map_or(&[], |found| &found.way.passes)
    }

    /// Returns whether something was simulated, and each deadline was met.
    pub(super) fn is_fine(&self) -> bool {
        let mut statistics = self.schedule.statistics.iter().flatten().peekable();
        self.errors == 0 && statistics.peek().is_some() && statistics.all(|it| it.misses == 0)
    }
}
