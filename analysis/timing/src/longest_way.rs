//! A schedule in which data takes long along a chain: the longest one that a search finds.
//!
//! The search follows data from job to job: it arrives just after a job of the first task has started, so that this job does not read
//! it. The N-th job after that one writes the data, and the end of this job is the arrival at the next task.
//! Reads of older values in a buffer are not followed. What the search finds is never above [`Tasks::latency`], and may be below
//! what is possible.

use crate::simulation::{Random, release_at};
use crate::{
    ChainStep, CpuSet, Edge, Executed, Schedule, Script, ScriptedTask, SimulationOptions, Slice, Task, Tasks,
    Time,
};

/// A way of data along a chain, with the schedule in which it occurs.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Way {
    /// They simulate the schedule.
    pub options: SimulationOptions,
    /// How data passes through each task of the chain.
    pub passes: Vec<Pass>,
    /// The number of schedules that were searched.
    pub schedules: u64,
}

/// How data passes through a task.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pass {
    /// The index of the task.
    pub task: usize,
    /// When data arrives: after the change, or the write of the task before it.
    pub arrival: Time,
    /// The job that reads it: the first one that starts after its arrival.
    pub reads: u64,
    /// Its start, if it starts.
    pub start: Option<Time>,
    /// The job that writes it.
    pub writes: u64,
    /// The end of the write.
    pub write: Time,
}

impl Way {
    /// Returns the time from the change to the end of the last write.
    pub fn latency(&self) -> Time {
        latency(&self.passes)
    }
}

fn latency(passes: &[Pass]) -> Time {
    let ends = passes.last().zip(passes.first());
    ends.and_then(|(last, first)| last.write.checked_sub(first.arrival)).unwrap_or_default()
}

/// The phases of releases with which a search begins.
const STARTS: u64 = 48;
/// The jobs after which a search ends.
const MOST_JOBS: u64 = 2_000_000;

impl Tasks {
    /// Searches for a schedule in which data takes long along a `chain`. The jobs of a task with `edges`, by its index, take only these.
    /// The same `seed` finds the same one. To cancel, `interrupt` unwinds. None if a task of the chain is not simulated, or data releases
    /// it, which no schedule follows; or the chain is too long.
    ///
    /// ```
    /// use mauve_timing::*;
    ///
    /// let ns = Time::from_nanos;
    /// let task = |priority, period, cost| Task::new(priority, ns(period), StateMachine::single(ns(cost)));
    /// let tasks = Tasks::new(vec![task(2, 10, 4), task(1, 30, 11)]);
    /// let step = |task, write| ChainStep { task, releases: 1, write: ns(write), ..ChainStep::default() };
    /// let way = tasks.longest_way(&[step(0, 4), step(1, 19)], &[], 1, &|| ()).unwrap();
    /// assert_eq!(way.latency(), ns(10 + 30 + 19 - 1));
    /// ```
    pub fn longest_way(
        &self,
        chain: &[ChainStep],
        edges: &[Option<Vec<usize>>],
        seed: u64,
        interrupt: &dyn Fn(),
    ) -> Option<Way> {
        let mut search = WaySearch::new(self, chain, edges, seed)?;
        for start in 0..STARTS {
            // At first all are released together; in every other schedule, jobs take as long as possible.
            let mut phases: Vec<u64> = self.all().iter().map(|task| search.phase(task, start > 0)).collect();
            search.takes_any = start % 2 == 1;
            let mut passes = search.try_phases(&phases, interrupt);
            for round in 0..2 * chain.len() {
                let index = round % chain.len();
                for with_release in [false, true] {
                    let Some(moved) = search.moved(&phases, &passes, index, with_release) else { continue };
                    let found = search.try_phases(&moved, interrupt);
                    if latency(&found) > latency(&passes) {
                        (phases, passes) = (moved, found);
                    }
                }
            }
            if search.jobs > MOST_JOBS {
                break;
            }
        }
        search.best
    }
}

struct WaySearch<'a> {
    tasks: &'a Tasks,
    chain: &'a [ChainStep],
    edges: &'a [Option<Vec<usize>>],
    length: u64,
    random: Random,
    /// Whether jobs take any edge of their state, otherwise one of the greatest cost.
    takes_any: bool,
    /// The jobs of all schedules.
    jobs: u64,
    schedules: u64,
    best: Option<Way>,
}

impl<'a> WaySearch<'a> {
    fn new(
        tasks: &'a Tasks,
        chain: &'a [ChainStep],
        edges: &'a [Option<Vec<usize>>],
        seed: u64,
    ) -> Option<WaySearch<'a>> {
        let mut length = 0_u64;
        for step in chain {
            let task = tasks.activities().get(step.task)?;
            let period = task.period.filter(|_| task.is_periodic())?.as_nanos();
            length = length
                .checked_add(period.checked_mul(u64::from(step.releases) + 1)?)?
                .checked_add(step.write.as_nanos())?;
        }
        let random = Random::new(seed);
        let search = WaySearch {
            tasks,
            chain,
            edges,
            length,
            random,
            takes_any: false,
            jobs: 0,
            schedules: 0,
            best: None,
        };
        (search.jobs_of_schedule() <= MOST_JOBS).then_some(search)
    }

    fn jobs_of_schedule(&self) -> u64 {
        let jobs = |task: &Task| {
            Some((self.length / task.period?.as_nanos().max(1) + 1).saturating_mul(task.burst()))
        };
        self.tasks.all().iter().filter_map(jobs).fold(0, u64::saturating_add)
    }

    /// Returns the first task of the thread of a task: all of them are released together.
    fn first_of_thread(&self, index: usize) -> usize {
        let of = self.tasks.all().get(index);
        let is_mate = |it: &Task| of.is_some_and(|of| it.is_mate(of));
        self.tasks.all().iter().position(is_mate).unwrap_or(index)
    }

    /// Returns the nominal release of the first job of a task: at its offset, otherwise at 0 or any instant of its period.
    fn phase(&mut self, task: &Task, is_any: bool) -> u64 {
        let period = task.period.map_or(1, Time::as_nanos).max(1);
        let any = if is_any { self.random.up_to(period - 1) } else { 0 };
        let begin = Some(self.schedules).filter(|_| is_any);
        task.instant().map_or(any, |offset| release_at(offset, period, task.clock, begin))
    }

    /// Returns the phases with that of a reader moved, which then waits longest: it starts just before the end of the write, or is
    /// released just before the writer is, and delayed by it.
    fn moved(&self, phases: &[u64], passes: &[Pass], index: usize, with_release: bool) -> Option<Vec<u64>> {
        let (writer, reader) = (passes.get(index.checked_sub(1)?)?, passes.get(index)?);
        let release = |task: usize, job: u64| {
            let period = self.tasks.all().get(task)?.period?.as_nanos();
            phases.get(self.first_of_thread(task))?.checked_add(job.checked_sub(1)?.checked_mul(period)?)
        };
        let late = match with_release {
            true => release(reader.task, reader.reads)?.checked_sub(release(writer.task, writer.writes)?)?,
            false => reader.start?.checked_sub(reader.arrival)?.as_nanos(),
        };
        let task = self.tasks.all().get(reader.task).filter(|task| task.instant().is_none())?;
        let period = task.period?.as_nanos();
        let mut moved = phases.to_vec();
        let phase = moved.get_mut(self.first_of_thread(reader.task))?;
        *phase = (*phase + period - (late + 1) % period) % period;
        Some(moved)
    }

    /// Simulates a schedule with these phases, and returns the longest way in it; empty without any.
    fn try_phases(&mut self, phases: &[u64], interrupt: &dyn Fn()) -> Vec<Pass> {
        let mut tasks = Vec::new();
        for index in 0..phases.len() {
            let phase = phases.get(self.first_of_thread(index)).copied().unwrap_or_default();
            let first = Time::from_nanos(phase);
            tasks.push(self.path(index).map(|edges| ScriptedTask { first, edges, arrivals: None }));
        }
        let options = SimulationOptions {
            least_time: 100,
            script: Some(Script { start: Time::ZERO, tasks, last: usize::MAX }),
            ..SimulationOptions::new(1, Time::from_nanos(self.length))
        };
        let schedule = self.tasks.simulate(&options, interrupt);
        self.jobs += self.jobs_of_schedule();
        self.schedules += 1;
        let passes = self.longest(&schedule);
        if latency(&passes) > self.best.as_ref().map_or(Time::ZERO, Way::latency) {
            self.best = Some(Way { options, passes: passes.clone(), schedules: 0 });
        }
        if let Some(best) = &mut self.best {
            best.schedules = self.schedules;
        }
        passes
    }

    /// Returns the edges of the jobs of a task. None if it is not simulated.
    fn path(&mut self, task: usize) -> Option<Vec<usize>> {
        let of = self.tasks.all().get(task)?;
        let (machine, period) = of.demand.machine().zip(of.period)?;
        let may_take = self.edges.get(task).and_then(Option::as_deref);
        let taken: Vec<usize> =
            (0..machine.edges().len()).filter(|edge| may_take.is_none_or(|it| it.contains(edge))).collect();
        let mut path = Vec::new();
        let mut state = None;
        let bursts = self.length / period.as_nanos().max(1) + 1;
        while (path.len() as u64) < bursts.saturating_mul(of.burst()) {
            let next = taken.iter().filter_map(|&edge| Some((edge, machine.edges().get(edge)?)));
            let next: Vec<(usize, &Edge)> =
                next.filter(|(_, it)| state.is_none_or(|state| it.source == state)).collect();
            let any = usize::try_from(self.random.up_to((next.len() as u64).saturating_sub(1))).ok();
            let greatest = next.iter().max_by_key(|(_, edge)| edge.cost);
            let chosen = if self.takes_any { any.and_then(|any| next.get(any)) } else { greatest };
            // Where it cannot go on, the jobs take any edges.
            let Some((index, edge)) = chosen else { break };
            path.push(*index);
            state = Some(edge.target);
        }
        Some(path)
    }

    /// Returns the longest way in a schedule.
    fn longest(&self, schedule: &Schedule) -> Vec<Pass> {
        let jobs: Vec<Vec<Ran>> = self.chain.iter().map(|step| jobs_of(schedule, step.task)).collect();
        let first = jobs.first().map_or(&[] as &[_], |jobs| jobs);
        let ways =
            first.iter().enumerate().filter_map(|(index, job)| self.follow(&jobs, job.start, index + 1));
        ways.max_by_key(|passes| latency(passes)).unwrap_or_default()
    }

    /// Follows data that arrives just after the start of a job of the first task, by its number.
    fn follow(&self, jobs: &[Vec<Ran>], mut arrival: Time, mut started: usize) -> Option<Vec<Pass>> {
        let mut passes: Vec<Pass> = Vec::new();
        for (step, jobs) in self.chain.iter().zip(jobs) {
            if let Some(before) = passes.last() {
                let cpus =
                    [before.task, step.task].map(|task| self.tasks.all().get(task).and_then(|it| it.cpus));
                let is_one_cpu = cpus[0] == cpus[1] && cpus[0].is_some_and(CpuSet::is_one);
                // On another CPU, a job that starts with the end of the write may have read before it.
                started =
                    jobs.partition_point(|job| job.start < arrival || (job.start == arrival && !is_one_cpu));
            }
            let writes = started + step.releases as usize;
            let job = jobs.get(writes.checked_sub(1)?)?;
            let latest = job.nominal.checked_add(step.write)?;
            let write = job.end?.min(latest);
            let start = jobs.get(started).map(|job| job.start);
            passes.push(Pass {
                task: step.task,
                arrival,
                reads: started as u64 + 1,
                start,
                writes: writes as u64,
                write,
            });
            arrival = write;
        }
        Some(passes)
    }
}

/// A job that was executed.
struct Ran {
    nominal: Time,
    start: Time,
    end: Option<Time>,
}

/// Returns the jobs of a task that have started, in order.
fn jobs_of(schedule: &Schedule, task: usize) -> Vec<Ran> {
    let mut starts = schedule.slices.iter().filter(|slice| slice.activity == task).peekable();
    let mut found = Vec::new();
    for job in schedule.jobs.iter().filter(|job| job.activity == task) {
        let is_start =
            |slice: &&Slice| slice.job == job.number && matches!(slice.executed, Executed::Edge(_));
        let Some(slice) = starts.find(is_start) else { break };
        found.push(Ran { nominal: job.nominal, start: slice.start, end: job.end });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{machine, simple, task};

    fn step(task: usize, releases: u32, write: u64) -> ChainStep {
        ChainStep { task, releases, write: Time::from_nanos(write), ..ChainStep::default() }
    }

    fn found(tasks: &Tasks, chain: &[ChainStep], edges: &[Option<Vec<usize>>]) -> (u64, Vec<(u64, u64)>) {
        let way = tasks.longest_way(chain, edges, 1, &|| ()).unwrap();
        // The options give that schedule again.
        let again = tasks.simulate(&way.options, &|| ());
        for pass in &way.passes {
            let job = |number| {
                *again.jobs.iter().find(|job| job.activity == pass.task && job.number == number).unwrap()
            };
            assert!(job(pass.writes).end.unwrap() >= pass.write);
            assert!(job(pass.reads).release <= pass.start.unwrap() && pass.arrival <= pass.start.unwrap());
        }
        (way.latency().as_nanos(), way.passes.iter().map(|it| (it.reads, it.writes)).collect())
    }

    #[test]
    fn a_reader_starts_just_before_the_write() {
        // On one CPU, and a reader of lower priority.
        let tasks = Tasks::new(vec![simple(2, 10, 4), simple(1, 30, 11)]);
        assert_eq!(found(&tasks, &[step(0, 1, 4), step(1, 1, 19)], &[]).0, 10 + 30 + 19 - 1);
        // On two CPUs, the run of the writer counts.
        let on = |cpus, task: Task| Task { cpus: Some(CpuSet(cpus)), ..task };
        let tasks = Tasks::new(vec![on(1, simple(2, 10, 4)), on(2, simple(1, 30, 11))]);
        assert_eq!(found(&tasks, &[step(0, 1, 4), step(1, 1, 11)], &[]).0, 10 + 4 + 30 + 11);
    }

    #[test]
    fn periods_pass_until_the_one_that_writes() {
        let tasks = Tasks::new(vec![simple(2, 10, 4), simple(1, 30, 11)]);
        let (latency, jobs) = found(&tasks, &[step(0, 3, 4), step(1, 2, 19)], &[]);
        assert_eq!(latency, 30 + 60 + 19 - 1);
        assert!(jobs[0].1 == jobs[0].0 + 2 && jobs[1].1 == jobs[1].0 + 1, "{jobs:?}");
    }

    #[test]
    fn synchronised_tasks_keep_their_offsets() {
        let at = |offset, task: Task| Task { offset: Some(Time::from_nanos(offset)), ..task };
        let tasks = Tasks::new(vec![at(0, simple(2, 10, 4)), at(6, simple(1, 10, 2))]);
        assert_eq!(found(&tasks, &[step(0, 1, 4), step(1, 1, 2)], &[]).0, 18);
    }

    #[test]
    fn jobs_take_the_edges_that_are_allowed() {
        let writer = task(1, 100, machine(2, &[(0, 0, 5), (0, 1, 60), (1, 0, 1), (1, 1, 7)]));
        let tasks = Tasks::new(vec![writer]);
        let latency = |edges: Option<Vec<usize>>| found(&tasks, &[step(0, 1, 100)], &[edges]).0;
        assert_eq!((latency(None), latency(Some(vec![0])), latency(Some(vec![3]))), (160, 105, 107));
    }

    #[test]
    fn what_cannot_be_simulated_has_no_way() {
        let tasks =
            Tasks::new(vec![simple(1, 10, 1), Task { period: None, ..simple(1, 10, 1) }, simple(2, 1, 0)]);
        let way = |chain: &[ChainStep]| tasks.longest_way(chain, &[], 1, &|| ()).is_some();
        assert!(way(&[step(0, 1, 1)]));
        assert!(!way(&[step(1, 1, 1)]) && !way(&[step(9, 1, 1)]) && !way(&[]));
        let sporadic = Tasks::new(vec![Task { is_sporadic: true, ..simple(1, 10, 1) }]);
        assert!(sporadic.longest_way(&[step(0, 1, 1)], &[], 1, &|| ()).is_none());
        assert!(!way(&[step(0, 1_000_000, 1)]) && !way(&[step(0, u32::MAX, u64::MAX)]));
    }
}
