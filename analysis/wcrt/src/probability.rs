//! How probable it is that an activity is late. Two rules give an upper bound; the smaller one counts.
//!
//! - *Levels* needs no independence: at the rarest level at which the deadline is met, an hour without an execution above its time has
//!   no late job, and others have at most the probability executions × level (`executions.rs`).
//! - *Excess* adds up what executions take beyond the times of a level (`mauve_timing::lateness`): each one exceeds its times with the
//!   probability of the tables whatever was before it, which is an assumption. A codel whose measurement rejects it, or that
//!   `mauve.toml` names, excludes this rule.
//!
//! Both hold for an hour that begins without unfinished jobs.

use std::collections::BTreeSet;

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, ModelDb, Project, config_of, names_of};
use mauve_timing::{CpuSet, Lateness, Level, Method, NoLateness, Priority, Status, Tasks, Time};

use crate::excesses::JobExecutions;
use crate::executions::{HOUR, executions_of};
use crate::fact::TimingFact;
use crate::locks::{declared_locks, unknown_codel};
use crate::psm::codels_of;
use crate::report::{ActivityReport, Query, Report};
use crate::response::response_times;
use crate::system::{System, system_of};
use crate::timetable::levels_of;

/// How probable it is that an activity is late.
#[derive(Debug, Clone, PartialEq, salsa::SalsaValue)]
pub struct MissProbability {
    /// At most so probable is a late job in an hour that begins without unfinished jobs.
    pub per_hour: f64,
    /// The same of one job that is late after one that was not. Only the rule of excess gives it, for periodic activities,
    /// also where the other rule gives the figure of the hour.
    pub per_job: Option<f64>,
    /// The rarest level at which the deadline is met.
    pub level: Option<Level>,
    /// What is tolerated, and beyond the times of which level, if the rule of excess gives the figure.
    pub tolerated: Option<(Level, Lateness)>,
    /// For each level of the tables, from the most probable one: the response time at it, if there is one, and how probable a longer
    /// one is in an hour.
    pub levels: Vec<(Level, Option<Time>, f64)>,
    /// Keys of the tables whose executions depend on earlier ones, for which the rule of excess is not used.
    pub dependent: Vec<String>,
    /// Why the rule of excess has no figure, if no codel excludes it.
    pub refused: Option<NoLateness>,
}

/// How probable it is that an activity responds later than a time.
#[derive(Debug, Clone, Copy, PartialEq, salsa::SalsaValue)]
pub struct LaterThan {
    /// The time.
    pub time: Time,
    /// At most so probable is it in an hour that begins without unfinished jobs.
    pub per_hour: f64,
    /// The same of one job, while the job of the activity before it ended within its period.
    pub per_job: Option<f64>,
}

impl MissProbability {
    /// Returns the name of the rule that gives the figure.
    pub fn rule(&self) -> &'static str {
        if self.tolerated.is_some() { "independent" } else { "comonotone" }
    }
}

/// Returns how probable it is that each activity of a deployment is late, in its order; `None` in the background, where the activity is
/// not analysed, and where no time depends on the level.
#[salsa::tracked(returns(ref), no_eq)]
pub fn probabilities_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Vec<Option<MissProbability>> {
    let system = system_of(db, project, deployment);
    let executions = executions_of(db, project, deployment, HOUR);
    let reports = reports_of(db, project, deployment);
    let depends_on_all =
        !system.connected.is_empty() || !declared_locks(db, project).all.is_empty() || has_lists(system);
    let declared = declared_dependent(db, project);
    let jobs = JobExecutions::of(db, project, system);
    let interrupt = || db.unwind_if_revision_cancelled();
    let of = |index: usize| {
        let at = |report: &&'db Report<'db>| report.activities.get(index);
        let (_, first) = reports.first()?;
        if matches!(at(first)?.verdict, Status::Background | Status::NotAnalysed)
            || executions.iter().all(|it| *it == 0.0)
        {
            return None;
        }
        let interferes =
            |other: &ActivityReport<'db>| depends_on_all || may_delay(other, at(first).unwrap_or(other));
        let delaying = || (0..).zip(&first.activities).filter(|(_, other)| interferes(other));
        let executions: f64 = delaying().filter_map(|(other, _)| executions.get::<usize>(other)).sum();
        let measured =
            jobs.iter().flat_map(|jobs| delaying().flat_map(|(other, _)| jobs.dependent(db, other)));
        let components = delaying().filter_map(|(other, _)| system.activities.get(other)?.executed());
        let codels = components.filter_map(|it| codels_of(db, project, it).as_deref()).flatten();
        let declared = codels.filter(|it| declared.contains(it)).map(|it| it.qualified(db));
        let dependent: BTreeSet<String> = measured.chain(declared).collect();
        let excess = |(level, report): &(Level, &Report<'db>)| match &jobs {
            Ok(jobs) => Ok((*level, jobs.lateness(*level, &report.tasks, index, &interrupt)?)),
            Err(why) => Err(*why),
        };
        // Where nothing depends on the level, an infinite number of other executions does not matter.
        let exceeded = |level: Level| (executions * level.as_f64()).min(1.0);
        let levels = reports
            .iter()
            .map(|(level, report)| (*level, at(report).and_then(|it| it.response), exceeded(*level)));
        let met = reports.iter().rev().find(|(_, report)| at(report).is_some_and(|it| it.verdict.is_met()));
        let level = met.map(|(level, _)| *level);
        let of_levels = level.map_or(1.0, exceeded);
        let hour = |(_, it): &(Level, Lateness)| it.within(HOUR);
        let found: Vec<_> = reports.iter().filter(|_| dependent.is_empty()).map(excess).collect();
        let excess = found.iter().flatten().min_by(|a, b| hour(a).total_cmp(&hour(b)));
        let tolerated = excess.filter(|it| hour(it) < of_levels).copied();
        let mut why = found.iter().filter_map(|it| it.err());
        let first = why.clone().next();
        let refused = why.find(|it| *it != NoLateness::Late).or(first).filter(|_| excess.is_none());
        Some(MissProbability {
            per_hour: tolerated.as_ref().map_or(of_levels, hour),
            per_job: found.iter().flatten().filter_map(|(_, it)| it.per_job).reduce(f64::min),
            level,
            tolerated,
            levels: levels.collect(),
            dependent: dependent.into_iter().collect(),
            refused,
        })
    };
    (0..system.activities.len()).map(of).collect()
}

/// The most times of a distribution.
const MOST_TIMES: u64 = 12;

/// Returns the distribution of the response time of an activity with a [`MissProbability`], for ascending times: from the response
/// time at the most probable level to a bit beyond the deadline and the rarer levels, except those far beyond it.
///
/// An activity responds later than a time if it is late with that time as its deadline.
#[salsa::tracked(returns(ref), no_eq)]
pub fn distribution_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    activity: usize,
) -> Vec<LaterThan> {
    let found = probabilities_of(db, project, deployment).get(activity).and_then(Option::as_ref);
    let reports = reports_of(db, project, deployment);
    let deadline = reports.first().and_then(|(_, it)| it.activities.get(activity)?.deadline);
    let Some((found, deadline)) = found.zip(deadline) else { return Vec::new() };
    let known = || found.levels.iter().filter_map(|(_, time, late)| Some(((*time)?, *late)));
    let Some((first, _)) = known().next() else { return Vec::new() };
    let is_near = |(time, _): &(Time, f64)| time.as_nanos() / 2 <= deadline.as_nanos();
    let last = known().filter(is_near).map(|(time, _)| time).fold(deadline, Time::max);
    // The last step is beyond it.
    let step = last.as_nanos().saturating_sub(first.as_nanos()) / (MOST_TIMES - 3);
    let step = step.max(first.as_nanos() / 100).max(1);
    // Two digits are enough.
    let digit = 10_u64.pow(step.ilog10().saturating_sub(1));
    let step = step.div_ceil(digit).saturating_mul(digit);
    let after = |steps: u64| first.as_nanos().saturating_add(step.saturating_mul(steps));
    let steps = (0..MOST_TIMES - 1).map(after).map(Time::from_nanos);
    let times: BTreeSet<Time> = steps.chain(Some(deadline.max(first))).collect();

    let system = system_of(db, project, deployment);
    let jobs = JobExecutions::of(db, project, system).ok().filter(|_| found.dependent.is_empty());
    let mut tasks: Vec<(Level, Tasks)> =
        reports.iter().map(|(level, it)| (*level, Tasks::clone(&it.tasks))).collect();
    let (mut hour, mut job) = (1.0_f64, 1.0_f64);
    let mut at = |time: Time| {
        let mut is_of_job = false;
        for (level, tasks) in &mut tasks {
            let (Some(task), Some(jobs)) = (tasks.activities_mut().get_mut(activity), &jobs) else {
                continue;
            };
            task.deadline = Some(time);
            let found = jobs.lateness(*level, tasks, activity, &|| db.unwind_if_revision_cancelled());
            let Ok(found) = found else { continue };
            hour = hour.min(found.within(HOUR));
            job = job.min(found.per_job.unwrap_or(1.0));
            is_of_job |= found.per_job.is_some();
        }
        hour = known().filter(|(of_level, _)| *of_level <= time).fold(hour, |hour, (_, late)| hour.min(late));
        // A longer response is not more probable than a shorter one.
        LaterThan { time, per_hour: hour, per_job: is_of_job.then_some(job) }
    };
    times.into_iter().map(&mut at).collect()
}

/// Returns the report at each level of the tables of a deployment, from the most probable one.
fn reports_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Vec<(Level, &'db Report<'db>)> {
    let query = |level| Query { level, method: Method::Best };
    let levels = levels_of(db, project, deployment).into_iter();
    levels.map(|level| (level, response_times(db, project, deployment, query(level)))).collect()
}

/// Returns whether an activity may use several CPUs: then others of any CPU may delay it.
fn has_lists(system: &System<'_>) -> bool {
    system
        .activities
        .iter()
        .any(|it| it.priority != Priority::Background && !it.cpus.is_some_and(CpuSet::is_one))
}

/// Returns whether the jobs of `other` may delay those of an activity, if all are pinned to CPUs.
fn may_delay(other: &ActivityReport<'_>, of: &ActivityReport<'_>) -> bool {
    other.priority >= of.priority && other.cpus == of.cpus
}

/// Returns the codels of `[timing] dependent`.
fn declared_dependent<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<Decl<'db>> {
    let declared = config_of(db, project.workspace(db)).dependent.iter();
    declared.flat_map(|(key, _)| names_of(db, project).by_key(Kind::Codel, key)).copied().collect()
}

/// Returns a fact for each key of `[timing] dependent` that names no codel.
pub fn dependent_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TimingFact<'db>> {
    let dependent = config_of(db, project.workspace(db)).dependent.iter();
    dependent.filter_map(|(key, span)| unknown_codel(db, project, None, (key, span))?).collect()
}

#[cfg(test)]
mod tests {
    use mauve_hir::{Database, Workspace, projects};

    use super::*;

    /// The probabilities of the activities of a deployment, with `table` and more lines of `mauve.toml`.
    fn of(activities: &str, table: &str, config: &str) -> Vec<Option<MissProbability>> {
        with(activities, table, config, |db, project, of| probabilities_of(db, project, of).clone())
    }

    fn with<R>(
        activities: &str,
        table: &str,
        config: &str,
        found: impl for<'db> FnOnce(&'db Database, Project<'db>, Decl<'db>) -> R,
    ) -> R {
        let db = Database::default();
        let model = format!(
            "codel a(): int\ncodel b(): int\nshell S {{ }}\ncore Ka(S) {{ update = {{ a(); }} }}\ncore Kb(S) {{ update = {{ b(); }} }}
            component Ca(S, Ka)\ncomponent Cb(S, Kb)\narchitecture A {{ instance a: Ca  instance b: Cb }}
            deployment D {{ architecture A {activities} }}"
        );
        let config = format!("timing.tables = [\"t.toml\"]\n{config}\n");
        let table = format!("levels = [1e-3, 1e-6, 1e-9]\n{table}");
        let files = [("/m.mal", model), ("/mauve.toml", config), ("/t.toml", table)];
        let workspace = Workspace::of_texts(&db, "/".into(), files.map(|(path, text)| (path.into(), text)));
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        found(&db, project, deployment)
    }

    const BOTH: &str = "activity a { priority = 2 period = 100 affinity = 1 } activity b { priority = 1 period = 100 affinity = 1 }";

    const DEPENDENT: &str = "timing.dependent = [\"a\", \"b\"]";

    #[test]
    fn the_rarest_level_that_is_met_counts_with_all_executions_that_delay() {
        let found = of(BOTH, "codel.a = [10, 20, 60]\ncodel.b = [30, 40, 50]\n", DEPENDENT);
        let [a, b] = &found[..] else { panic!("{found:?}") };
        let (a, b) = (a.as_ref().unwrap(), b.as_ref().unwrap());
        // 36,000 executions of each codel in an hour; a lower priority delays nobody.
        assert_eq!((a.per_hour, a.level), (36_000.0 * 1e-9, Level::from_f64(1e-9)));
        assert_eq!((b.per_hour, b.level), (72_000.0 * 1e-6, Level::from_f64(1e-6)));
        let of_level = |(_, time, late): &(Level, Option<Time>, f64)| (time.map(Time::as_nanos), *late);
        let expected =
            [(Some(40_000_000), 1.0), (Some(60_000_000), 0.072), (Some(110_000_000), 72_000.0 * 1e-9)];
        let levels: Vec<_> = b.levels.iter().map(of_level).collect();
        assert_eq!(levels[..2], expected[..2]);
        assert_eq!(levels[2].1, expected[2].1);
        assert_eq!((a.rule(), a.per_job), ("comonotone", None));
        // On another CPU, nothing delays it.
        let apart =
            BOTH.replace("priority = 1 period = 100 affinity = 1", "priority = 1 period = 100 affinity = 2");
        let b = of(&apart, "codel.a = [10, 20, 60]\ncodel.b = [30, 40, 50]\n", DEPENDENT)[1].clone().unwrap();
        assert_eq!((b.per_hour, b.level), (36_000.0 * 1e-9, Level::from_f64(1e-9)));
    }

    #[test]
    fn a_deadline_that_is_met_at_no_level_may_be_missed_in_each_hour() {
        let found = of(BOTH, "codel.a = [70, 80, 90]\ncodel.b = [40, 41, 42]\n", "");
        assert_eq!(found[1].as_ref().map(|it| (it.per_hour, it.level)), Some((1.0, None)));
        // A certain time is never exceeded, and where nothing depends on the level, there is nothing to say.
        let found = of(BOTH, "codel.a = 70\ncodel.b = [10, 20, 21]\n", "");
        assert_eq!(found[0].as_ref().map(|it| it.per_hour), Some(0.0));
        assert_eq!(of(BOTH, "codel.a = 70\ncodel.b = 10\n", ""), [None, None]);
    }

    /// 36,000 jobs an hour of each; at 1e-3, `b` responds in 40 ms and tolerates 60 more. Two windows of 100 ms have two jobs of each.
    #[test]
    fn what_executions_take_beyond_a_level_adds_up() {
        let found = of(BOTH, "codel.a = [10, 20, 60]\ncodel.b = [30, 50, 51]\n", "");
        let b = found[1].as_ref().unwrap();
        let (level, tolerated) = b.tolerated.unwrap();
        assert_eq!(
            (level, tolerated.tolerated),
            (Level::from_f64(1e-3).unwrap(), Time::from_nanos(60_000_000))
        );
        assert_eq!((b.rule(), b.level), ("independent", Level::from_f64(1e-6)));
        // One of four takes any time; or `a` takes 50 more, with 1e-6, and another one 10 or 20, with 1e-3. 10 is rounded up.
        let job = b.tolerated.unwrap().1.probability;
        let most = 4e-9 + 2.0 * 1e-6 * 3.0 * 1e-3;
        assert!(job > 0.99 * most && job < 1.01 * most, "{job}");
        assert!((b.per_hour / (36_001.0 * job) - 1.0).abs() < 1e-9, "{b:?}");
        // A dependent codel excludes the rule where it is executed.
        let found =
            of(BOTH, "codel.a = [10, 20, 60]\ncodel.b = [30, 50, 51]\n", "timing.dependent = [\"b\"]");
        let rules: Vec<_> = found.iter().flatten().map(|it| (it.rule(), it.dependent.len())).collect();
        assert_eq!(rules[1], ("comonotone", 1));
        assert_eq!(rules[0].1, 0);
    }

    /// An activity responds later than a time as probably as it is late with that deadline.
    #[test]
    fn the_distribution_is_that_of_other_deadlines() {
        let table = "codel.a = [10, 20, 60]\ncodel.b = [30, 50, 51]\n";
        for (config, is_of_job) in [("", true), (DEPENDENT, false)] {
            let found =
                with(BOTH, table, config, |db, project, of| distribution_of(db, project, of, 1).clone());
            assert!(found.len() <= 12 && found.is_sorted_by(|a, b| a.time < b.time), "{found:?}");
            assert!(found.is_sorted_by(|a, b| a.per_hour >= b.per_hour), "{found:?}");
            assert_eq!(found[0].time, Time::from_nanos(40_000_000));
            assert_eq!(found.last().unwrap().time, Time::from_nanos(107_000_000));
            let (mut hour, mut job) = (1.0_f64, 1.0_f64);
            for it in &found {
                let activities = format!(
                    "{} deadline = {} }}",
                    BOTH.trim_end_matches([' ', '}']),
                    it.time.number_in(mauve_timing::Unit::Milliseconds)
                );
                let late = of(&activities, table, config)[1].clone().unwrap();
                hour = hour.min(late.per_hour);
                assert_eq!(it.per_hour, hour, "{it:?}");
                // Later than its period, the next job does not begin with nothing open.
                assert_eq!(it.per_job.is_some(), is_of_job && it.time.as_nanos() <= 100_000_000, "{it:?}");
                if let Some(per_job) = it.per_job {
                    job = job.min(late.per_job.unwrap());
                    assert_eq!(per_job, job, "{it:?}");
                }
            }
            assert!(found.iter().any(|it| it.time == Time::from_nanos(100_000_000)), "{found:?}");
        }
    }

    #[test]
    fn why_the_rule_of_excess_has_no_figure() {
        let table = "codel.a = [10, 20, 60]\ncodel.b = [30, 50, 51]\n";
        let refused = |activities: &str, config: &str| {
            let found = of(activities, table, config);
            found[1].as_ref().map(|it| (it.refused, it.rule(), it.dependent.len())).unwrap()
        };
        assert_eq!(refused(BOTH, ""), (None, "independent", 0));
        let free = BOTH.replace("affinity = 1", "affinity = 3");
        assert_eq!(refused(&free, "").0, Some(NoLateness::SeveralCpus));
        let locks = "locks.bus.codels = [\"a\", \"b\"]\nlocks.bus.protocol = \"ceiling\"";
        assert_eq!(refused(BOTH, locks).0, Some(NoLateness::Locks));
        // With the codel as the reason, there is no other one.
        assert_eq!(refused(&free, DEPENDENT), (None, "comonotone", 2));
    }

    /// The levels alone give less in an hour, and nothing of one job.
    #[test]
    fn a_job_has_its_own_rule() {
        let found = of(BOTH, "codel.a = [10, 20, 60]\ncodel.b = [30, 40, 41]\n", "");
        let a = found[0].as_ref().unwrap();
        assert_eq!((a.rule(), a.per_hour), ("comonotone", 36_000.0 * 1e-9));
        assert!(a.per_job.is_some_and(|it| it < 1e-8), "{a:?}");
    }

    #[test]
    fn dependent_codels_are_named() {
        let table = "codel.a = [10, 20, 60]\ncodel.b = [30, 40, 50]\n";
        let of = |config: &str, more: &str| {
            of(BOTH, &format!("{table}{more}"), config)[1].clone().unwrap().dependent
        };
        assert_eq!(of("", ""), Vec::<String>::new());
        assert_eq!(of("timing.dependent = [\"b\", \"a\"]", ""), ["a", "b"]);
        let record = |warning: &str| {
            format!(
                "[measured.b]\nexecutions = 500\ngreatest = 9\ntimes = [30, 40, 50]\nmethod = \"GPD\"\ndate = 2026-11-26\n\
             samples = \"s\"\nfiles = []\nbytes = 1\nwarnings = [\"{warning}\"]\n"
            )
        };
        assert_eq!(of("", &record("executions depend on earlier ones (runs: p < 0.001)")), ["b"]);
        assert_eq!(of("", &record("only 500 executions")), Vec::<String>::new());
        // Also that of a program, and of a codel of a program with a time of its own.
        let program = "[program]\n\"Ca/update\" = [10, 20, 60]\n";
        let record = record("dependent-executions").replace("measured.b", "measured.\"Ca/update\"");
        assert_eq!(of("", &format!("{program}{record}")), ["Ca/update"]);
        assert_eq!(of("timing.dependent = [\"a\"]", program), ["a"]);
    }
}
