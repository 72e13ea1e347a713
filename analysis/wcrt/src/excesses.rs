//! What the jobs of a deployment may take beyond the times of a level, for [`mauve_timing::lateness`].

use std::collections::BTreeMap;

use mauve_hir::{Decl, ModelDb};
use mauve_timing::{Excess, Executions, Lateness, Level, NoLateness, Tasks, lateness};
use rustc_hash::FxHashMap;

use crate::gateway::moved;
use crate::path_fold::{Figure, folded};
use crate::reason::Timed;
use crate::system::System;
use crate::table_set::TableSet;
use crate::timetable::{Timetable, timetable_of};

/// What the jobs of each activity execute: which entries of the tables, and how often.
pub(crate) struct JobExecutions<'db> {
    times: &'db Timetable<'db>,
    /// The entries whose times depend on the level.
    entries: Vec<Timed<'db>>,
    of: Vec<Executions>,
}

/// Finds, for each entry, how often it is executed.
struct Multiset<'a, 'db>(&'a FxHashMap<Timed<'db>, usize>);

impl<'db> Figure<'db> for Multiset<'_, 'db> {
    type Value = BTreeMap<usize, u64>;

    fn of(&self, timed: &Timed<'db>) -> Option<Self::Value> {
        Some(BTreeMap::from([(*self.0.get(timed)?, 1)]))
    }

    fn sum(&self, parts: &[Self::Value]) -> Self::Value {
        let mut all = BTreeMap::new();
        for (entry, count) in parts.iter().flatten() {
            let sum: &mut u64 = all.entry(*entry).or_default();
            *sum = sum.saturating_add(*count);
        }
        all
    }

    /// Whichever is executed: no entry more often than in one of them.
    fn greatest(&self, parts: &[Self::Value]) -> Self::Value {
        let mut all = BTreeMap::new();
        for (entry, count) in parts.iter().flatten() {
            let greatest: &mut u64 = all.entry(*entry).or_default();
            *greatest = (*greatest).max(*count);
        }
        all
    }
}

impl<'db> JobExecutions<'db> {
    /// Returns what the jobs of a deployment execute, unless waits or the overhead of jobs depend on the level.
    pub(crate) fn of(
        db: &'db dyn ModelDb,
        tables: TableSet<'db>,
        system: &System<'db>,
    ) -> Result<Self, NoLateness> {
        let times = timetable_of(db, tables);
        let (levelled, of_job) = times.levelled();
        let counts = levelled.iter().filter(|(_, count)| **count > 0);
        let is_wait = |of: &Timed<'db>| matches!(of, Timed::Wait(_));
        if of_job > 0 {
            return Err(NoLateness::Overhead);
        }
        if counts.clone().any(|(of, _)| is_wait(of)) {
            return Err(NoLateness::Waits);
        }
        let entries: Vec<Timed<'db>> = counts.map(|(of, _)| of.clone()).collect();
        // A program with a certain time stands for none.
        let all: FxHashMap<Timed<'db>, usize> =
            levelled.keys().map(|it| (it.clone(), entries.len())).collect();
        let numbers = entries.iter().cloned().zip(0..);
        let all = Multiset(&all.into_iter().chain(numbers).collect());
        let of = |component: Option<Decl<'db>>| {
            let folded = component.and_then(|it| folded(db, tables.project(db), it, &all));
            let edges = folded.into_iter().flat_map(|it| it.edges);
            let kept = edges.map(|it| it.into_iter().filter(|(it, _)| *it < entries.len()).collect());
            kept.collect()
        };
        let of = system.activities.iter().map(|it| match it.gateway {
            Some(gateway) => {
                let topics = moved(db, tables, gateway);
                let numbered = topics.filter_map(|(topic, samples)| {
                    let number = entries.iter().position(|it| *it == Timed::Topic(topic.clone()))?;
                    Some((number, samples))
                });
                vec![numbered.collect()]
            }
            None => of(it.executed()),
        });
        let of = of.collect();
        Ok(JobExecutions { times, entries, of })
    }

    /// Returns the keys of what an activity executes and whose measurement says that executions depend on earlier ones.
    pub(crate) fn dependent(&self, db: &'db dyn ModelDb, activity: usize) -> impl Iterator<Item = String> {
        let all = self.of.get(activity).into_iter().flatten().flatten();
        let entries = all.filter_map(|(entry, _)| self.entries.get(*entry));
        entries.filter(|it| self.times.is_dependent(it)).map(|it| it.key(db))
    }

    /// Returns how probable it is that an activity is late, from the tasks at a level.
    pub(crate) fn lateness(
        &self,
        level: Level,
        tasks: &Tasks,
        activity: usize,
        interrupt: &dyn Fn(),
    ) -> Result<Lateness, NoLateness> {
        let excess = |of: &Timed<'db>| self.times.excess(of, level).ok_or(NoLateness::Times);
        let excesses: Vec<Excess> = self.entries.iter().map(excess).collect::<Result<_, _>>()?;
        lateness(tasks, activity, &excesses, &self.of, interrupt)
    }
}
