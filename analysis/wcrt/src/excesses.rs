//! What the jobs of a deployment may take beyond the times of a level, for [`mauve_timing::lateness`].

use std::collections::BTreeMap;

use mauve_hir::{ModelDb, Project};
use mauve_timing::{Excess, Executions, Lateness, Level, NoLateness, Tasks, lateness};
use rustc_hash::FxHashMap;

use crate::gateway::moved;
use crate::path_fold::{PathFigure, folded};
use crate::reason::Timed;
use crate::system::{ResolvedActivity, System};
use crate::table_set::TableSet;
use crate::timetable::{Timetable, timetable_of};

/// What the jobs of each activity execute: which entries of the tables, and how often.
pub(crate) struct JobExecutions<'db> {
    /// The entries whose times depend on the level, each in its tables.
    entries: Vec<(Timed<'db>, &'db Timetable<'db>)>,
    of: Vec<Executions>,
}

/// Finds, for each entry, how often it is executed.
struct Multiset<'a, 'db>(&'a FxHashMap<Timed<'db>, usize>);

impl<'db> PathFigure<'db> for Multiset<'_, 'db> {
    type Value = BTreeMap<usize, u64>;

    fn of(&self, timed: &Timed<'db>) -> Option<Self::Value> {
        Some(BTreeMap::from([(*self.0.get(timed)?, 1)]))
    }

    fn sum(&self, parts: &[Self::Value]) -> Self::Value {
        joined(parts, u64::saturating_add)
    }

    /// Whichever is executed: no entry more often than in one of them.
    fn greatest(&self, parts: &[Self::Value]) -> Self::Value {
        joined(parts, u64::max)
    }
}

fn joined(parts: &[BTreeMap<usize, u64>], join: fn(u64, u64) -> u64) -> BTreeMap<usize, u64> {
    let mut all: BTreeMap<usize, u64> = BTreeMap::new();
    for (entry, count) in parts.iter().flatten() {
        let known = all.entry(*entry).or_default();
        *known = join(*known, *count);
    }
    all
}

impl<'db> JobExecutions<'db> {
    /// Returns what the jobs of a deployment execute, unless waits or the overhead of jobs depend on the level.
    pub(crate) fn of(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        system: &System<'db>,
    ) -> Result<Self, NoLateness> {
        let mut entries: Vec<(Timed<'db>, &'db Timetable<'db>)> = Vec::new();
        let mut all: FxHashMap<TableSet<'db>, FxHashMap<Timed<'db>, usize>> = FxHashMap::default();
        for tables in system.activities.iter().map(|it| it.tables) {
            if all.contains_key(&tables) {
                continue;
            }
            let times = timetable_of(db, tables);
            let (levelled, of_job) = times.levelled();
            if of_job > 0 {
                return Err(NoLateness::Overhead);
            }
            let of_tables = all.entry(tables).or_default();
            for (timed, count) in levelled {
                if count > 0 && matches!(timed, Timed::Wait(_)) {
                    return Err(NoLateness::Waits);
                }
                // A program with a certain time stands for none.
                let number = if count > 0 { entries.len() } else { usize::MAX };
                if count > 0 {
                    entries.push((timed.clone(), times));
                }
                of_tables.insert(timed, number);
            }
        }
        let of = |it: &ResolvedActivity<'db>| {
            let Some(numbers) = all.get(&it.tables) else { return Vec::new() };
            if let Some(gateway) = it.gateway {
                let topics = moved(db, project, gateway);
                let numbered = topics.filter_map(|(topic, samples)| {
                    Some((*numbers.get(&Timed::Topic(topic)).filter(|it| **it < entries.len())?, samples))
                });
                return vec![numbered.collect()];
            }
            let folded = it.executed().and_then(|it| folded(db, project, it, &Multiset(numbers)));
            let edges = folded.into_iter().flat_map(|it| it.edges);
            edges.map(|it| it.into_iter().filter(|(it, _)| *it < entries.len()).collect()).collect()
        };
        let of = system.activities.iter().map(of).collect();
        Ok(JobExecutions { entries, of })
    }

    /// Returns the keys of what an activity executes and whose measurement says that executions depend on earlier ones.
    pub(crate) fn dependent(&self, db: &'db dyn ModelDb, activity: usize) -> impl Iterator<Item = String> {
        let all = self.of.get(activity).into_iter().flatten().flatten();
        let entries = all.filter_map(|(entry, _)| self.entries.get(*entry));
        entries.filter(|(it, times)| times.is_dependent(it)).map(|(it, _)| it.key(db))
    }

    /// Returns how probable it is that an activity is late, from the tasks at a level.
    pub(crate) fn lateness(
        &self,
        level: Level,
        tasks: &Tasks,
        activity: usize,
        interrupt: &dyn Fn(),
    ) -> Result<Lateness, NoLateness> {
        let excess =
            |(of, times): &(Timed<'db>, &Timetable<'db>)| times.excess(of, level).ok_or(NoLateness::Times);
        let excesses: Vec<Excess> = self.entries.iter().map(excess).collect::<Result<_, _>>()?;
        lateness(tasks, activity, &excesses, &self.of, interrupt)
    }
}
