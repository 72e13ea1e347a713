//! How many executions of a deployment may exceed their times, and so what a significance level supports: by Boole's inequality, a
//! mission without such an execution has the figures of the level, and there are at most executions × level others.
//! Also the level that `[timing] required` chooses.
//!
//! ```text
//! 10 Hz, one codel with a time for each level: 36,000 executions an hour; at 1e-4, 3.6 of them may exceed their times
//! ```
//!
//! Times that hold at every level are certain: their executions do not count. Nothing here depends on how long a time is.

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Decl, Location, ModelDb, ProgramId, Project, TimedProgram, behaviour_of, config_file, config_of, core_of,
    names_of, product_of, required_of,
};
use mauve_timing::{Edge, Level, Priority, StateMachine, Task, Time};
use rustc_hash::FxHashMap;

use crate::fact::{LackingLevel, TimingFact, TimingFactKind};
use crate::gateway::moved;
use crate::locks::{DeclaredLock, declared_locks};
use crate::path_fold::{Folded, PathFigure, folded};
use crate::psm::codels_of;
use crate::reason::Timed;
use crate::sends::{sends_of, sends_of_operation};
use crate::served::MOST_OPERATIONS;
use crate::system::{Connected, ResolvedActivity, System, system_of};
use crate::table_set::{TableSet, all_tables_of};
use crate::timetable::{levels_of, times_of, timetable_of};

/// What a significance level supports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// The level.
    pub level: Level,
    /// The greatest number of executions an hour whose times depend on the level, in the long run.
    pub executions_per_hour: f64,
}

impl Support {
    /// Returns how many executions an hour may exceed their times, on average. It bounds the probability of a miss in an hour.
    pub fn exceedances_per_hour(self) -> f64 {
        self.executions_per_hour * self.level.as_f64()
    }
}

pub(crate) const HOUR: Time = Time::from_nanos(3_600_000_000_000);

/// Returns what a level supports in a deployment; `None` if none of its times depends on the level.
pub fn support<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    level: Level,
) -> Option<Support> {
    let executions_per_hour = executions_of(db, project, deployment, HOUR).into_iter().sum();
    (executions_per_hour > 0.0).then_some(Support { level, executions_per_hour })
}

/// Returns the greatest number of executions of each activity in a mission of this length whose times depend on the level.
pub fn executions_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    mission: Time,
) -> Vec<f64> {
    let system = system_of(db, project, deployment);
    let own = |it: &ResolvedActivity<'db>| {
        if let Some(gateway) = it.gateway {
            let (levelled, of_job) = timetable_of(db, it.tables).levelled();
            let count = |(topic, samples): (Name, u64)| {
                levelled.get(&Timed::Topic(topic)).copied().unwrap_or(0).saturating_mul(samples)
            };
            let of_topics = moved(db, project, gateway).map(count).fold(of_job, u64::saturating_add);
            return Some(of_topics as f64 * jobs_in(&it.task, mission));
        }
        let component = it.component?;
        let counts = counts_of(db, it.tables, component).as_ref()?;
        match it.priority {
            // It delays others only while it holds a lock, and nothing limits how often that is.
            Priority::Background => may_hold_lock(db, project, component).then_some(f64::INFINITY),
            _ => Some(counts.of_jobs(jobs_in(&it.task, mission))),
        }
    };
    let mut found: Vec<f64> = system.activities.iter().map(|it| own(it).unwrap_or(0.0)).collect();
    if !system.connected.is_empty() {
        add_calls(db, project, system, mission, &mut found);
    }
    found
}

/// Returns whether a component may hold a lock for the time of a codel.
fn may_hold_lock<'db>(db: &'db dyn ModelDb, project: Project<'db>, component: Decl<'db>) -> bool {
    let takes = |lock: &DeclaredLock<'db>| {
        let codels = codels_of(db, project, component).as_ref();
        codels.is_none_or(|codels| codels.iter().any(|codel| lock.codels.contains(codel)))
    };
    declared_locks(db, project).all.iter().any(|lock| lock.held.is_none() && takes(lock))
}

/// Returns the greatest number of jobs of a task in a mission; 0 without a period, since then there is no figure.
pub(crate) fn jobs_in(task: &Task, mission: Time) -> f64 {
    let Some(period) = task.period.filter(|it| *it > Time::ZERO) else { return 0.0 };
    let length = u128::from(mission.as_nanos()) + u128::from(task.jitter.as_nanos());
    length.div_ceil(u128::from(period.as_nanos())) as f64 * task.burst() as f64
}

/// Adds the executions in operations that activities execute for others, as often as clients call them.
fn add_calls<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
    mission: Time,
    found: &mut [f64],
) {
    let calls = |it: &Connected| {
        let client = system.activities.get(it.client)?;
        let sends = sends_of(db, project, client.executed()?).get(&it.required)?.most;
        Some(sends as f64 * jobs_in(&client.task, mission))
    };
    let mut open: Vec<(&Connected, f64)> =
        system.connected.iter().filter_map(|it| Some((it, calls(it)?))).collect();
    // With more chains of calls, or a ring of them, no provider has a figure.
    for _ in 0..MOST_OPERATIONS {
        let Some((connected, calls)) = open.pop() else { break };
        let Some(provider) = system.activities.get(connected.provider) else { continue };
        let Some(component) = provider.component else { continue };
        if let (Some(counts), Some(found)) =
            (counts_of(db, provider.tables, component), found.get_mut(connected.provider))
        {
            *found += calls * counts.of_operation(&connected.operation);
        }
        for (required, sends) in sends_by(db, project, component, &connected.operation) {
            let next = system.connected.iter();
            let next = next.filter(|it| it.client == connected.provider && it.required == required);
            open.extend(next.map(|it| (it, calls * sends as f64)));
        }
    }
}

/// Returns how many calls one execution of an operation sends.
fn sends_by<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
    operation: &Name,
) -> Vec<(Name, u64)> {
    let Some(core) = core_of(db, project, component) else { return Vec::new() };
    let behaviour = behaviour_of(db, project, core);
    let is_it = |it: &TimedProgram<'db>| operation_of(it) == Some(operation);
    let index = behaviour.operations.iter().position(is_it);
    index.map_or_else(Vec::new, |index| sends_of_operation(behaviour, index))
}

fn operation_of<'a>(program: &'a TimedProgram<'_>) -> Option<&'a Name> {
    if let ProgramId::Operation(name) = &program.id { Some(name) } else { None }
}

/// How many executions of a component may exceed their times.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct ExecutionCounts {
    /// The greatest mean along a cycle of its state machine: in so many executions, so many jobs.
    mean: (u64, u64),
    /// The greatest number in one job.
    greatest: u64,
    /// The number of states of the machine.
    states: u64,
    /// In one execution of each operation.
    operations: Vec<(Name, u64)>,
}

impl ExecutionCounts {
    /// Returns the greatest number in so many consecutive jobs: a path consists of cycles, and of less edges than there are states.
    fn of_jobs(&self, jobs: f64) -> f64 {
        let (executions, of_jobs) = self.mean;
        let in_cycles = jobs * executions as f64 / of_jobs.max(1) as f64;
        let rest = self.states.saturating_sub(1) as f64 * self.greatest as f64;
        (in_cycles + rest).min(jobs * self.greatest as f64).ceil()
    }

    fn of_operation(&self, name: &Name) -> f64 {
        self.operations.iter().find(|(it, _)| it == name).map_or(0.0, |(_, count)| *count as f64)
    }
}

/// For each entry of the tables that concerns a component, how many executions that may exceed their times it stands for, and how
/// many there are in each job.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
struct Levelled<'db> {
    entries: FxHashMap<Timed<'db>, u64>,
    of_job: u64,
}

/// A query of its own: a changed time does not change its result.
#[salsa::tracked(returns(ref))]
fn levelled<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>, component: Decl<'db>) -> Levelled<'db> {
    let (entries, of_job) = times_of(db, tables, component).levelled();
    Levelled { entries, of_job }
}

impl<'db> PathFigure<'db> for Levelled<'db> {
    type Value = u64;

    fn of(&self, timed: &Timed<'db>) -> Option<u64> {
        self.entries.get(timed).copied()
    }

    fn sum(&self, parts: &[u64]) -> u64 {
        parts.iter().fold(0, |sum, part| sum.saturating_add(*part))
    }

    fn greatest(&self, parts: &[u64]) -> u64 {
        parts.iter().copied().max().unwrap_or(0)
    }
}

/// Returns the counts of a component; `None` if none of its times depends on the level, or what it executes is unknown.
#[salsa::tracked(returns(ref))]
fn counts_of<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
) -> Option<ExecutionCounts> {
    let levelled = levelled(db, tables, component);
    if levelled.of_job == 0 && levelled.entries.values().all(|it| *it == 0) {
        return None;
    }
    let project = tables.project(db);
    let Folded { edges, operations } = folded(db, project, component, levelled)?;
    let core = core_of(db, project, component)?;
    let behaviour = behaviour_of(db, project, core);
    let product = product_of(db, project, core);
    let edges = product.edges.iter().zip(edges).map(|(edge, count)| Edge {
        source: edge.source,
        target: edge.target,
        cost: Time::from_nanos(count.saturating_add(levelled.of_job)),
    });
    // The greatest number of executions of a machine is the greatest time of one that takes a nanosecond for each.
    let machine = StateMachine::new(u32::try_from(product.states.len()).ok()?, edges.collect()).ok()?;
    let mean = machine.greatest_cycle_mean();
    // Between two jobs, a call wakes the thread.
    let of_call = |count: u64| count.saturating_add(levelled.of_job);
    let operations = behaviour.operations.iter().zip(operations);
    Some(ExecutionCounts {
        mean: (mean.cost.as_nanos(), mean.length),
        greatest: machine.greatest_cost().as_nanos(),
        states: product.states.len() as u64,
        operations: operations
            .filter_map(|(it, count)| Some((operation_of(it)?.clone(), of_call(count))))
            .collect(),
    })
}

/// The level that `required` chooses for a deployment.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct ChosenLevel {
    pub(crate) level: Level,
    /// What the tables lack, if no level of theirs is rare enough; the rarest one is chosen then.
    pub(crate) lacking: Option<LackingLevel>,
}

/// Returns the level that `required` chooses for a deployment: the most probable one of its tables with which executions × level
/// is at most that. `None` without `required`, and where no time depends on the level.
#[salsa::tracked(returns(ref))]
pub(crate) fn chosen_level<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Option<ChosenLevel> {
    let required = required_of(db, project, deployment)?;
    let levels = levels_of(db, project, deployment);
    let executions: f64 = executions_of(db, project, deployment, required.mission).into_iter().sum();
    let probability = required.probability.as_f64();
    if executions == 0.0 {
        return levels.first().map(|&level| ChosenLevel { level, lacking: None });
    }
    let enough = |level: &&Level| executions * level.as_f64() <= probability;
    if let Some(&level) = levels.iter().find(enough) {
        return Some(ChosenLevel { level, lacking: None });
    }
    let exponent = (probability / executions).log10().floor().max(-300.0) as i32;
    let needed = format!("1e{exponent}").parse().ok().and_then(Level::from_f64)?;
    let tables = all_tables_of(db, project, deployment);
    let levelled = tables.iter().flat_map(|&it| &timetable_of(db, it).with_levels);
    let table = levelled.max_by_key(|it| it.levels.iter().min().copied())?.clone();
    let lacking = Some(LackingLevel { needed, executions: executions as u64, table });
    // Hosts whose tables share no level have no figures.
    let configured = || config_of(db, project.workspace(db)).level();
    Some(ChosenLevel { level: levels.last().copied().unwrap_or_else(configured), lacking })
}

/// Returns a fact for each deployment whose tables lack the level that `required` needs.
pub fn required_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TimingFact<'db>> {
    let Some(file) = config_file(db, project.workspace(db)) else { return Vec::new() };
    let of = |deployment: Decl<'db>| {
        let required = required_of(db, project, deployment)?;
        let lacking = chosen_level(db, project, deployment).as_ref()?.lacking.clone()?;
        let kind = TimingFactKind::LackingLevel { deployment, lacking };
        Some(TimingFact::new(Location::of_span(file, &required.span), kind))
    };
    names_of(db, project).of_kind(db, Kind::Deployment).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use mauve_hir::{Database, Workspace, projects};

    use super::*;
    use crate::{Query, response_times};

    const TABLE: &str = "levels = [1e-3, 1e-6]\ncodel.light = 1\ncodel.heavy = [2, 3]\n";

    /// Calls `of` with the deployment `D` of a component whose core has this content, released every 10 ms.
    fn with<R>(
        core: &str,
        table: &str,
        config: &str,
        of: impl FnOnce(&Database, Project<'_>, Decl<'_>) -> R,
    ) -> R {
        let db = Database::default();
        let model = format!(
            "codel light(): int\ncodel heavy(): int\nshell S {{ input port goal: int }}\ncore K(S) {{ {core} }}
            component C(S, K)\narchitecture A {{ instance a: C }}
            deployment D {{ architecture A activity a {{ priority = 2 period = 10 }} }}"
        );
        let config = format!("timing.tables = [\"t.toml\"]\n{config}\n");
        let files = [("/m.mal", model.as_str()), ("/mauve.toml", &config), ("/t.toml", table)];
        let files = files.map(|(path, text)| (path.into(), text.to_owned()));
        let workspace = Workspace::of_texts(&db, "/".into(), files);
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        of(&db, project, deployment)
    }

    /// The executions of 1,000 jobs.
    fn executions(core: &str, table: &str) -> f64 {
        let mission = Time::from_nanos(10_000_000_000);
        with(core, table, "", |db, project, of| executions_of(db, project, of, mission)[0])
    }

    #[test]
    fn each_execution_counts_whose_time_depends_on_the_level() {
        let update = |program: &str| format!("var n: int = 0  update = {{ {program} }}");
        for (program, expected) in [
            ("light();", 0.0),
            ("heavy();", 1000.0),
            ("heavy(); light(); heavy();", 2000.0),
            ("if light() > 0 then { heavy(); heavy(); } else { heavy(); }", 2000.0),
            ("read(goal, n);", 0.0),
        ] {
            assert_eq!(executions(&update(program), TABLE), expected, "{program}");
        }
        let all = update("heavy(); heavy(); read(goal, n);");
        // A time of the whole program stands for one execution, or for none; an access and a wait are executions too.
        for (entry, expected) in [
            ("program.\"C/update\" = [7, 8]", 1000.0),
            ("program.\"C/update\" = 7", 0.0),
            ("access.\"C.goal\" = [1, 2]", 3000.0),
            ("wait.light = [1, 2]", 2000.0),
            ("wait.heavy = [1, 2]", 4000.0),
            ("wait.heavy = [1, 2]\nprogram.\"C/update\" = [7, 8]", 3000.0),
            ("overhead.dispatch = [1, 2]", 3000.0),
        ] {
            assert_eq!(executions(&all, &format!("{TABLE}{entry}\n")), expected, "{entry}");
        }
    }

    #[test]
    fn a_machine_has_as_many_as_its_worst_cycle() {
        let machine =
            "statemachine { initial state A { run = { heavy(); heavy(); heavy(); } transition t to B }
             state B { run = { light(); } transition u to A } }";
        // Half of the jobs, and at most one more.
        assert_eq!(executions(machine, TABLE), 1503.0);
        // A counter: every tenth period.
        let counter = "var count: int = 0
             update = { if count == 0 then { heavy(); count = 9; } else { count = count - 1; } }";
        let found = executions(counter, TABLE);
        assert!((100.0..=110.0).contains(&found), "{found}");
    }

    #[test]
    fn required_chooses_the_level() {
        let level = |required: &str| {
            let config = format!("timing.required = \"{required}\"");
            with("update = { heavy(); }", TABLE, &config, |db, project, of| {
                let query = Query::shown(db, project, of);
                assert!(response_times(db, project, of, query).schedulable());
                (query.level.to_string(), required_facts(db, project).len())
            })
        };
        // 360,000 executions an hour, 6,000 a minute.
        assert_eq!(level("0.9 per hour"), ("1e-6".into(), 0));
        assert_eq!(level("0.006 per 1 min"), ("1e-6".into(), 0));
        assert_eq!(level("0.1 per 0.5 s"), ("1e-3".into(), 0));
        assert_eq!(level("0.1 per hour"), ("1e-6".into(), 1));
    }

    #[test]
    fn a_required_level_that_the_tables_lack_is_a_fact() {
        let config = "timing.required = \"1e-6 per hour\"";
        with("update = { heavy(); }", TABLE, config, |db, project, of| {
            let [fact] = required_facts(db, project).try_into().unwrap();
            let TimingFactKind::LackingLevel { deployment, lacking } = fact.kind else { panic!("{fact:?}") };
            // 1e-6 / 360,000 = 2.8e-12.
            let found = (lacking.needed.to_string(), lacking.executions, deployment == of);
            assert_eq!(found, ("1e-12".to_owned(), 360_000, true));
        });
        // Without a time that depends on the level, each level is enough.
        with("update = { light(); }", TABLE, config, |db, project, of| {
            assert!(
                required_facts(db, project).is_empty()
                    && support(db, project, of, Level::TEN_TO_MINUS_FOUR).is_none()
            );
        });
    }
}
