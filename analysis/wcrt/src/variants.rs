//! A deployment with other values, in the fields of its activities or in execution times: analysed within a budget of steps, and
//! cancelled by a change of a text.

use std::cell::Cell;

use mauve_timing::{Response, Status, Tasks};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::locks::declared_locks;
use crate::psm::{OtherTimes, PsmResult, psm_with};
use crate::report::{Query, Report};
use crate::response::response_times_if;
use crate::system::{System, system_of};
use crate::table_set::tables_of;
use crate::task_set::{DeployedTasks, Executables, psms_of};
use crate::what_if::{WhatIfField, system_if};
use mauve_hir::{Decl, ModelDb, Project};

/// The analysis of an activity has so many passes over those of higher priority, or fewer, unless its busy window is long.
const PASSES_OF_ACTIVITY: usize = 16;

/// To find who takes the locks of so many codels, and for how long, costs as much as the analysis of an activity.
const CODELS_OF_LOCKS: usize = 2;

/// The variants of a deployment, whose analyses share a budget.
pub(crate) struct Variants<'db> {
    pub(crate) db: &'db dyn ModelDb,
    pub(crate) project: Project<'db>,
    pub(crate) deployment: Decl<'db>,
    pub(crate) query: Query,
    pub(crate) system: &'db System<'db>,
    /// The number of activities that may still be analysed, those of each analysis counted.
    pub(crate) left: Cell<usize>,
    /// What the locks cost in each analysis, as that many activities.
    of_locks: usize,
}

impl<'db> Variants<'db> {
    /// Analyses at most `most_analysed` activities, those of each analysis counted. The limit is a number of steps and no time, so
    /// that the same model has the same answers everywhere.
    pub(crate) fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        deployment: Decl<'db>,
        query: Query,
        most_analysed: usize,
    ) -> Variants<'db> {
        let system: &System<'db> = system_of(db, project, deployment);
        let locks = declared_locks(db, project).all.iter();
        let of_locks = locks.map(|lock| lock.codels.len()).sum::<usize>() / CODELS_OF_LOCKS;
        Variants { db, project, deployment, query, system, left: Cell::new(most_analysed), of_locks }
    }

    /// Takes an analysis of so many activities from the budget; `None` where the budget is exhausted.
    pub(crate) fn spend(&self, activities: usize) -> Option<()> {
        self.left.set(self.left.get().checked_sub(activities.max(1) + self.of_locks)?);
        self.db.unwind_if_revision_cancelled();
        Some(())
    }

    /// Calls `search` with at most so much of what is left of the budget.
    pub(crate) fn within<T>(&self, most: usize, search: impl FnOnce() -> T) -> T {
        let all = self.left.get();
        let part = most.min(all);
        self.left.set(part);
        let found = search();
        self.left.set(all - part + self.left.get());
        found
    }

    /// Returns the deployment where the times in `what_if` replace those of the tables. All of them are times that
    /// only `components` execute in their own periods.
    pub(crate) fn with_times(
        &self,
        components: &FxHashSet<Decl<'db>>,
        what_if: OtherTimes<'_, 'db>,
    ) -> Tasks {
        let Variants { db, project, query, system, .. } = *self;
        let changed = system.activities.iter().filter_map(|it| Some((it.executed()?, it.tables, it.wakes)));
        let changed: FxHashSet<_> = changed.filter(|(it, ..)| components.contains(it)).collect();
        let changed: FxHashMap<_, PsmResult<'db>> = changed
            .into_iter()
            .map(|of| (of, psm_with(db, of.1, of.0, query.level, of.2, what_if)))
            .collect();
        let psms = system.activities.iter().zip(psms_of(db, system, query.level));
        let psms = psms.map(|(it, psm)| {
            let other = it.executed().filter(|_| it.gateway.is_none());
            other.and_then(|component| changed.get(&(component, it.tables, it.wakes))).or(psm)
        });
        let executed = Executables::of(db, project, system, psms.collect(), query.level, what_if);
        executed.tasks(db, project, system, query.method)
    }

    /// Returns the deployment with these values in its activities.
    pub(crate) fn with_fields(&self, fields: &[WhatIfField]) -> (System<'db>, DeployedTasks<'db>) {
        let Variants { db, project, deployment, query, .. } = *self;
        let system = system_if(db, project, deployment, fields);
        let deployed = DeployedTasks::of_model(db, tables_of(db, project, deployment), &system, query);
        (system, deployed)
    }

    /// Returns the report on the deployment with these values in its activities; nothing where the budget is exhausted.
    pub(crate) fn report(&self, fields: &[WhatIfField]) -> Option<Report<'db>> {
        self.spend(self.system.activities.len())?;
        Some(response_times_if(self.db, self.project, self.deployment, self.query, fields))
    }

    /// Analyses a variant, with the smaller budget of [`mauve_timing::Options::is_brief`] or with that of the report.
    /// Takes the passes over the tasks from the budget: a long busy window has thousands.
    pub(crate) fn responses(&self, set: &Tasks, is_brief: bool) -> Vec<Response> {
        let passes = Cell::new(0_usize);
        let interrupt = || {
            passes.set(passes.get() + 1);
            self.db.unwind_if_revision_cancelled();
        };
        let responses = set.response_times(&self.query.options(is_brief), &interrupt).responses;
        let usual = PASSES_OF_ACTIVITY * set.activities().len();
        let further = passes.get().saturating_sub(usual) / PASSES_OF_ACTIVITY;
        self.left.set(self.left.get().saturating_sub(further));
        responses
    }

    /// Returns one [response](Self::responses) for each activity; nothing where the budget is exhausted.
    pub(crate) fn analysed(&self, set: &Tasks, is_brief: bool) -> Option<Vec<Response>> {
        self.spend(self.system.activities.len())?;
        let mut responses = self.responses(set, is_brief);
        responses.truncate(set.activities().len());
        Some(responses)
    }

    /// Returns whether a deadline of `set` is missed for sure, see [`is_missed`].
    pub(crate) fn is_missed(&self, set: &Tasks) -> bool {
        let Some(responses) = self.analysed(set, false) else { return false };
        statuses(set, &responses).into_iter().zip(&responses).any(|(status, it)| is_missed(status, it))
    }
}

/// Returns whether a deadline is missed, and a greater budget would not change that.
pub(crate) fn is_missed(status: Status, response: &Response) -> bool {
    matches!(status, Status::Missed | Status::Unbounded) && !response.is_exhausted
}

/// Returns the status of each activity of `set`.
pub(crate) fn statuses(set: &Tasks, responses: &[Response]) -> Vec<Status> {
    set.activities().iter().zip(responses).map(|(task, response)| response.status(task.deadline)).collect()
}
