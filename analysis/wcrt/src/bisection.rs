//! The boundary between values with which deadlines are proved and values with which they are not: a deployment with other
//! times or periods, analysed within a budget of steps, and the bisection.

use std::cell::Cell;

use mauve_timing::{Response, Status, Tasks, Time};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::gateway::gateway_psm;
use crate::locks::locks_of;
use crate::psm::{OtherTimes, PsmResult, psm_of, psm_with};
use crate::report::Query;
use crate::served::served_in;
use crate::system::{System, system_of};
use crate::table_set::TableSet;
use crate::task_set::{Executables, tasks_of};
use mauve_hir::{Decl, ModelDb, Project};

/// A longer period is searched up to this many times the present one.
const MOST_LONGER: u64 = 64;

/// The variants of a deployment, whose analyses share a budget.
pub(crate) struct Variants<'db> {
    pub(crate) db: &'db dyn ModelDb,
    pub(crate) project: Project<'db>,
    pub(crate) deployment: Decl<'db>,
    pub(crate) query: Query,
    pub(crate) system: &'db System<'db>,
    /// The number of analyses that are left.
    left: Cell<usize>,
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
        let left = Cell::new(most_analysed / system.activities.len().max(1));
        Variants { db, project, deployment, query, system, left }
    }

    /// Returns the deployment where the times in `what_if` replace those of the tables. All of them are times that
    /// only `components` execute in their own periods.
    pub(crate) fn with_times(
        &self,
        components: &FxHashSet<Decl<'db>>,
        what_if: OtherTimes<'_, 'db>,
    ) -> Tasks {
        let Variants { db, project, query, system, .. } = *self;
        let changed = system.activities.iter().filter_map(|it| Some((it.executed()?, it.tables)));
        let changed: FxHashSet<_> = changed.filter(|(it, _)| components.contains(it)).collect();
        let psm = |of: (Decl<'db>, TableSet<'db>)| (of, psm_with(db, of.1, of.0, query.level, what_if));
        let changed: FxHashMap<_, PsmResult<'db>> = changed.into_iter().map(psm).collect();
        let psms = system.activities.iter().map(|activity| {
            let tables = activity.tables;
            if let Some(of) = activity.gateway {
                return Some(gateway_psm(db, tables, of.deployment, of.host, query.level));
            }
            let component = activity.executed()?;
            changed.get(&(component, tables)).or_else(|| Some(psm_of(db, tables, component, query.level)))
        });
        let psms: Vec<Option<&PsmResult<'db>>> = psms.collect();
        let served = served_in(db, project, system, query.level, what_if);
        let locks = locks_of(db, project, system, query.level, what_if);
        let executed = Executables { psms: &psms, served: &served, locks: &locks };
        tasks_of(db, project, system, executed, query.method)
    }

    /// Analyses a variant, with the smaller budget of [`mauve_timing::Options::is_brief`] or with that of the report. Returns one
    /// response for each activity; nothing where the budget of all variants is exhausted.
    pub(crate) fn analysed(&self, set: &Tasks, is_brief: bool) -> Option<Vec<Response>> {
        self.left.set(self.left.get().checked_sub(1)?);
        let interrupt = || self.db.unwind_if_revision_cancelled();
        let mut responses = set.response_times(&self.query.options(is_brief), &interrupt).responses;
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

/// The result of a bisection, in nanoseconds. They are neighbours if the search was not ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Boundary {
    /// A value with which `holds` was true.
    pub(crate) good: u64,
    /// A value with which it was false.
    pub(crate) bad: u64,
}

impl Boundary {
    /// Bisects between a value with which `holds` is true and one with which it is false, either of them the greater one. Ends
    /// where `holds` is unknown. Where `holds` is monotone, no value on the far side of `bad` is better than `good`.
    pub(crate) fn between(
        mut good: u64,
        mut bad: u64,
        mut holds: impl FnMut(Time) -> Option<bool>,
    ) -> Boundary {
        while good.abs_diff(bad) > 1 {
            let middle = good.midpoint(bad);
            match holds(Time::from_nanos(middle)) {
                Some(true) => good = middle,
                Some(false) => bad = middle,
                None => break,
            }
        }
        Boundary { good, bad }
    }

    /// Returns the first of 2, 4, 8 … [`MOST_LONGER`] times `now` with which `holds` is true, as the good value, and the one before it;
    /// the inner none where there is none. The outer none: `holds` is unknown.
    pub(crate) fn above(now: u64, mut holds: impl FnMut(Time) -> Option<bool>) -> Option<Option<Boundary>> {
        let (mut bad, mut factor) = (now, 2);
        while let Some(good) = now.checked_mul(factor).filter(|_| factor <= MOST_LONGER) {
            if holds(Time::from_nanos(good))? {
                return Some(Some(Boundary { good, bad }));
            }
            (bad, factor) = (good, factor * 2);
        }
        Some(None)
    }

    /// Returns whether the search was not ended before the two values were neighbours.
    pub(crate) fn is_complete(self) -> bool {
        self.good.abs_diff(self.bad) <= 1
    }
}

/// Returns the steps in which a time is searched for: the greatest power of ten that is at most 1 ms and a hundredth of it.
pub(crate) fn step_of(time: Time) -> u64 {
    let mut step = 1_000_000;
    while step > 1 && step > time.as_nanos() / 100 {
        step /= 10;
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_boundary_is_found_from_both_sides(low in 0_u64..1000, first in 0_u64..1000, high in 0_u64..1000) {
            let (good, bad) = (low, low + first + high + 1);
            let last = low + first;
            let boundary = Boundary::between(good, bad, |time| Some(time.as_nanos() <= last));
            prop_assert_eq!(boundary, Boundary { good: last, bad: last + 1 });
            let boundary = Boundary::between(bad, good, |time| Some(time.as_nanos() > last));
            prop_assert_eq!(boundary, Boundary { good: last + 1, bad: last });
        }
    }

    #[test]
    fn a_search_that_is_ended_claims_only_what_was_tested() {
        let mut steps = 3;
        let boundary = Boundary::between(0, 1 << 20, |time| {
            steps -= 1;
            (steps >= 0).then_some(time.as_nanos() <= 700_000)
        });
        assert_eq!(boundary, Boundary { good: 655_360, bad: 786_432 });
        assert!(!boundary.is_complete());
    }
}
