//! How probable it is that jobs are late, from how probable it is that executions take longer than the times of a level.
//!
//! Let all times be those of one level, and the *excess* of an execution what it takes beyond its time. Let H be a task with
//! those that may delay it on its CPU, M(t) what H executes at most in a window of length t at these times, and Δ > 0 such that the
//! task meets its deadline even if a job of Δ, of the highest priority, is released once in any window that matters. Let L be a
//! length with M(L) + Δ ≤ L.
//!
//! **A late job needs an excess of more than Δ within L.** Take a busy interval of H, from an instant s before which nothing of H is
//! open. If the jobs that are released in \[s, s + L) have a total excess of at most Δ, then at most M(L) + Δ ≤ L is to be executed in
//! it, so it ends by s + L and has no other jobs. For each instant t of it, at most M(t) + Δ was released since s: the job of Δ
//! released at s delays the task no less. So none of its jobs is late.
//!
//! **A mission** that starts with nothing open has late jobs only if there is such an s. Each \[s, s + L) is within one of the windows
//! \[kL, (k + 2)L), of which a mission of length X has at most X/L + 1. So P(a late job) ≤ (X/L + 1)·P(the jobs of a window of 2L have a
//! total excess of more than Δ).
//!
//! **One job** with the nominal instant N is late, and the job before it was not. That one ended by N if D ≤ T. If no other task has its
//! priority, nothing of H was open at its end: a busy interval with N begins after N − T, at N + J at the latest. So the job is late
//! only if the jobs that are released in \[N − T, N + J + L) have a total excess of more than Δ. Nothing less will do: that no
//! job was late before says nothing of how long others have been executing (T = 10, an execution of 1, or of 109 with 1e-3, above
//! T = 1000, D = 10, an execution of 1: late with 1.2 %, which is the probability of an excess in 120, not in 2L = 20). Nor is there such
//! a probability for a task that data or an interrupt releases: it may be released just when others take long.
//!
//! **The probability of an excess.** The n jobs of a task in a window execute programs one after another. The only assumption is
//! that each execution exceeds a time with at most the probability of its level *whatever was before it*. Which programs they
//! execute, and when jobs are released, may depend on what was before: the sum of n such jobs is above x with at most the probability of
//! the n-fold convolution of the least upper envelope of their tails, by induction over n from the last one. The same holds
//! for the sum over the tasks.
//!
//! Late jobs after the first one are not counted. Times are exact; excesses are rounded up to one of 256 to 511 parts of Δ.

use crate::tasks::TaskKind;
use crate::{
    Bound, CpuSet, Method, Options, Priority, StateMachine, Task, Tasks, Time, TraceBound, response_times,
};

/// How much longer an execution may take than its time at a level, and how probable that is.
///
/// `[(0, 1e-4), (2 ms, 1e-5)]`: it takes longer than the time with probability 1e-4 at most, and more than 2 ms longer with 1e-5;
/// how much longer then is not known. Ascending excesses, descending probabilities. Without a step, it never takes longer.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Excess {
    /// The excesses with the probabilities that they are exceeded.
    pub steps: Vec<(Time, f64)>,
}

/// What the jobs of a task execute: for each kind of job, how often which [`Excess`] occurs, by index.
pub type Executions = Vec<Vec<(usize, u64)>>;

/// How probable it is that a task is late.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Lateness {
    /// Δ, the excess that the task tolerates.
    pub tolerated: Time,
    /// L, the length within which it must occur.
    pub window: Time,
    /// The probability that more occurs within two windows.
    pub probability: f64,
    /// The probability that a job is late, and the job of the task before it was not. `None` if the task is not released every T, has
    /// a deadline beyond T, or shares its priority.
    pub per_job: Option<f64>,
}

impl Lateness {
    /// Returns the probability that a job is late in a mission of a length that starts with nothing open; at most 1.
    pub fn within(&self, mission: Time) -> f64 {
        let windows = mission.as_nanos() as f64 / self.window.as_nanos() as f64 + 1.0;
        (windows * self.probability).min(1.0)
    }
}

/// Why the probability is not computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NoLateness {
    /// The task, or one that may delay it, may run on several CPUs, or a property of it is unknown.
    SeveralCpus,
    /// One of them waits.
    Waits,
    /// One of them uses a lock, or a job on their CPU is not preempted.
    Locks,
    /// One of them sends or executes calls of operations.
    Calls,
    /// Its deadline is not met at the level.
    Late,
    /// The overhead of jobs depends on the level.
    Overhead,
    /// The time of an execution at the level is not known, or not the only one.
    Times,
}

/// Excesses are rounded up to a part of Δ; at least so many parts.
const PARTS: u64 = 256;
/// More than what is rounded while probabilities are added.
const ROUNDED: f64 = 1e-14;
/// The most steps of a search for L.
const MOST_STEPS: usize = 10_000;
/// A job of Δ is released once in so long a time: 11 days.
const ONCE: Time = Time::from_nanos(1_000_000_000_000_000);

/// Returns how probable it is that an activity is late, if its tasks' times are those of a level, `excesses` what executions may take
/// beyond them, and `executions` what the jobs of each activity execute.
///
/// # Errors
///
/// The theorem does not apply to the activity.
pub fn lateness(
    tasks: &Tasks,
    activity: usize,
    excesses: &[Excess],
    executions: &[Executions],
    interrupt: &dyn Fn(),
) -> Result<Lateness, NoLateness> {
    let members = members(tasks, activity)?;
    // With an excess, a writer may respond later, and what its data releases is released otherwise: T alone counts.
    let by_distance = |task: &Task| Task { arrivals: None, ..task.clone() };
    let mut set: Vec<Task> = members.iter().filter_map(|&it| tasks.all().get(it)).map(by_distance).collect();
    let own = members.iter().position(|&it| it == activity).ok_or(NoLateness::SeveralCpus)?;
    let tolerated = tolerated(&mut set, own, interrupt).ok_or(NoLateness::Late)?;
    let window = window(&set, tolerated).ok_or(NoLateness::Late)?;
    let of_job = set.get(own).and_then(|task| of_job(task, &set, window));
    let part = (tolerated.as_nanos() / PARTS).max(1);
    let mut all = ExcessTail::none(tolerated.as_nanos() / part);
    let mut before_job = ExcessTail::none(tolerated.as_nanos() / part);
    for (task, &index) in set.iter().zip(&members) {
        interrupt();
        let jobs = window.checked_mul(2).and_then(|both| releases(task, both)).ok_or(NoLateness::Late)?;
        let kinds = if tasks.kind(index) == TaskKind::Activity { executions.get(index) } else { None };
        let mut kinds = kinds.cloned().unwrap_or_default();
        kinds.sort_unstable();
        kinds.dedup();
        let mut greatest = ExcessTail::none(tolerated.as_nanos() / part);
        for kind in kinds {
            let mut job = ExcessTail::none(tolerated.as_nanos() / part);
            for (excess, count) in kind {
                let excess = excesses.get(excess).ok_or(NoLateness::SeveralCpus)?;
                job = job.sum(&ExcessTail::of(excess, part, tolerated.as_nanos() / part).times(count));
            }
            greatest.raise(&job);
        }
        all = all.sum(&greatest.times(jobs));
        if let Some(length) = of_job {
            let jobs = releases(task, length).ok_or(NoLateness::Late)?;
            before_job = before_job.sum(&greatest.times(jobs));
        }
    }
    let per_job = of_job.map(|_| before_job.last());
    Ok(Lateness { tolerated, window, probability: all.last(), per_job })
}

/// Returns the length of the window in which a job of the task is late only if there is an excess of more than Δ.
fn of_job(task: &Task, set: &[Task], window: Time) -> Option<Time> {
    let period = task.period?;
    let shares_priority = set.iter().filter(|it| it.priority == task.priority).nth(1).is_some();
    if !task.is_periodic() || task.deadline? > period || shares_priority {
        return None;
    }
    period.checked_add(task.jitter)?.checked_add(window)
}

/// Returns H: the activity, and the tasks that may delay it on its CPU.
fn members(tasks: &Tasks, activity: usize) -> Result<Vec<usize>, NoLateness> {
    let all = tasks.all();
    let own = all.get(activity).ok_or(NoLateness::SeveralCpus)?;
    let cpus: CpuSet = own.cpus();
    let delays = |task: &Task| task.priority >= own.priority && task.cpus().meets(cpus);
    let members: Vec<usize> = (0..all.len()).filter(|&it| all.get(it).is_some_and(delays)).collect();
    let of = |index: &usize| all.get(*index);
    let is_pinned = |task: &Task| task.cpus() == cpus && cpus.is_one() && task.is_known();
    if own.priority == Priority::Background || !members.iter().filter_map(of).all(is_pinned) {
        return Err(NoLateness::SeveralCpus);
    }
    if members.iter().filter_map(of).any(|task| task.waits.is_some()) {
        return Err(NoLateness::Waits);
    }
    let is_member = |task: usize| members.binary_search(&task).is_ok();
    let is_not_preempted = |task: &Task| task.is_not_preempted && task.cpus().meets(cpus);
    if tasks.locks.iter().flat_map(|lock| &lock.users).any(|user| is_member(user.task))
        || all.iter().any(is_not_preempted)
    {
        return Err(NoLateness::Locks);
    }
    let calls = |task: &Task| task.has_calls || task.blocking > Time::ZERO;
    if tasks.operations.iter().any(|it| is_member(it.provider) || is_member(it.client))
        || members.iter().filter_map(of).any(calls)
    {
        return Err(NoLateness::Calls);
    }
    Ok(members)
}

/// Returns Δ, nearly the greatest one, and adds nothing to the tasks; `None` if the deadline is not met with none.
fn tolerated(set: &mut Vec<Task>, own: usize, interrupt: &dyn Fn()) -> Option<Time> {
    let (deadline, cpus) = set.get(own).map(|it| (it.deadline, it.cpus))?;
    let options = Options { method: Method::Best, is_brief: true };
    let mut with = |excess: u64| {
        let machine = StateMachine::single(Time::from_nanos(excess));
        set.push(Task {
            priority: Priority::Unknown,
            is_sporadic: true,
            cpus,
            ..Task::new(0, ONCE, machine)
        });
        let found = response_times(set, &options, interrupt).responses.into_iter().nth(own);
        set.pop();
        match found?.bound {
            Bound::Response(time) if Some(time) <= deadline => deadline?.checked_sub(time),
            _ => None,
        }
    };
    // Each unit of excess delays it by a unit or more.
    let (mut least, mut most) = (0, with(0)?.as_nanos());
    if with(most).is_some() {
        return Some(Time::from_nanos(most));
    }
    for _ in 0..8 {
        let middle = least + (most - least) / 2;
        match with(middle) {
            Some(_) => least = middle,
            None => most = middle,
        }
    }
    Some(Time::from_nanos(least))
}

/// Returns L, the least length with M(L) + Δ ≤ L.
fn window(set: &[Task], tolerated: Time) -> Option<Time> {
    let mut bounds: Vec<(&Task, TraceBound<'_>)> = set
        .iter()
        .map(|task| Some((task, TraceBound::new(task.demand.machine()?))))
        .collect::<Option<_>>()?;
    let mut length = Time::from_nanos(1);
    for _ in 0..MOST_STEPS {
        let mut sum = tolerated;
        for (task, bound) in &mut bounds {
            sum = sum.checked_add(bound.demand(releases(task, length)?).ok()?)?;
        }
        if sum <= length {
            return Some(length);
        }
        length = sum;
    }
    None
}

/// Returns the greatest number of releases of a task in a half-open window.
fn releases(task: &Task, window: Time) -> Option<u64> {
    let window = window.checked_add(task.jitter)?;
    window.as_nanos().div_ceil(task.period?.as_nanos().max(1)).checked_mul(task.burst())
}

/// For each number of parts from 0, the greatest probability that an excess is above it.
struct ExcessTail {
    above: Vec<f64>,
}

impl ExcessTail {
    fn none(parts: u64) -> ExcessTail {
        ExcessTail { above: vec![0.0; parts as usize + 1] }
    }

    fn of(excess: &Excess, part: u64, parts: u64) -> ExcessTail {
        let mut tail = ExcessTail::none(parts);
        for (number, above) in (0..).zip(&mut tail.above) {
            let reached = excess.steps.iter().take_while(|(it, _)| it.as_nanos() <= number * part);
            *above = match excess.steps.is_empty() {
                true => 0.0,
                false => reached.last().map_or(1.0, |(_, probability)| *probability),
            };
        }
        tail
    }

    /// The tail of the sum of two, the second one after the first.
    fn sum(&self, other: &ExcessTail) -> ExcessTail {
        // P(X + Y > b) = P(X > b) + Σ P(X = a)·P(Y > b − a).
        let mut above = self.above.clone();
        let mut before = 1.0;
        for (first, &now) in self.above.iter().enumerate() {
            let exactly = before - now;
            before = now;
            if exactly > 0.0 {
                for (sum, of_other) in above.iter_mut().skip(first).zip(&other.above) {
                    *sum += exactly * of_other;
                }
            }
        }
        above.iter_mut().for_each(|it| *it = it.min(1.0));
        ExcessTail { above }
    }

    fn times(&self, mut count: u64) -> ExcessTail {
        let mut sum = ExcessTail::none(self.above.len() as u64 - 1);
        let mut power = ExcessTail { above: self.above.clone() };
        while count > 0 {
            if count % 2 == 1 {
                sum = power.sum(&sum);
            }
            count /= 2;
            if count > 0 {
                power = power.sum(&power);
            }
        }
        sum
    }

    /// The probability of more than Δ, with what was rounded.
    fn last(&self) -> f64 {
        (self.above.last().copied().unwrap_or(1.0) * (1.0 + 1e-9) + ROUNDED).min(1.0)
    }

    fn raise(&mut self, other: &ExcessTail) {
        self.above.iter_mut().zip(&other.above).for_each(|(it, other)| *it = it.max(*other));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::simple;

    fn nanos(count: u64) -> Time {
        Time::from_nanos(count)
    }

    fn single(steps: &[(u64, f64)]) -> Excess {
        Excess { steps: steps.iter().map(|&(excess, probability)| (nanos(excess), probability)).collect() }
    }

    fn of(tasks: Vec<Task>, activity: usize, excesses: &[Excess]) -> Result<Lateness, NoLateness> {
        let executions: Vec<Executions> = (0..tasks.len()).map(|it| vec![vec![(it, 1)]]).collect();
        lateness(&Tasks::new(tasks), activity, excesses, &executions, &|| ())
    }

    /// Each job of 9 may take 100 with probability 1e-3: two jobs are in a window of 20.
    #[test]
    fn one_task_is_late_as_often_as_it_takes_long() {
        let found = of(vec![simple(1, 10, 9)], 0, &[single(&[(0, 1e-3), (91, 0.0)])]).unwrap();
        assert_eq!((found.tolerated, found.window), (nanos(1), nanos(10)));
        assert!((found.probability - (1.0 - 0.999_f64.powi(2))).abs() < 1e-11, "{found:?}");
        assert!((found.within(nanos(1000)) - 101.0 * found.probability).abs() < 1e-12);
    }

    /// An excess of 3 is tolerated twice, not three times; beyond the last step, any time is possible.
    #[test]
    fn excesses_add_up() {
        let tasks = || vec![simple(2, 10, 2), simple(1, 20, 8)];
        let excesses = [single(&[(0, 1e-2), (3, 1e-6)]), single(&[])];
        let found = of(tasks(), 1, &excesses).unwrap();
        assert_eq!((found.tolerated, found.window), (nanos(8), nanos(20)));
        // Of four jobs, one takes any time, or three take 3 more.
        let three = 4.0 * 0.01_f64.powi(3);
        assert!(found.probability > 4e-6 && found.probability < 4e-6 + three * 1.1, "{found:?}");
        let certain = of(tasks(), 1, &[single(&[]), single(&[])]).unwrap();
        assert_eq!(certain.probability, ROUNDED);
    }

    #[test]
    fn kinds_of_jobs_are_enveloped() {
        let tasks = Tasks::new(vec![simple(1, 10, 2)]);
        let excesses = [single(&[(0, 1e-2), (5, 0.0)]), single(&[(0, 1e-3), (20, 0.0)])];
        let found = |kinds: &[&[(usize, u64)]]| {
            let kinds = kinds.iter().map(|it| it.to_vec()).collect();
            lateness(&tasks, 0, &excesses, &[kinds], &|| ()).unwrap().probability
        };
        let (often, long) = (found(&[&[(0, 1)]]), found(&[&[(1, 1)]]));
        assert!(often < 2e-4 && (long - 2e-3).abs() < 1e-5, "{often} {long}");
        let both = found(&[&[(0, 1)], &[(1, 1)]]);
        assert!(both >= long && both < found(&[&[(0, 1), (1, 1)]]) + 1e-12, "{both}");
    }

    #[test]
    fn what_the_theorem_does_not_cover_is_refused() {
        let excesses = [single(&[]), single(&[])];
        let free = Task { cpus: Some(CpuSet::first_few(2)), ..simple(2, 10, 2) };
        assert_eq!(of(vec![free, simple(1, 20, 8)], 1, &excesses), Err(NoLateness::SeveralCpus));
        assert_eq!(of(vec![simple(2, 10, 2), simple(1, 20, 18)], 1, &excesses), Err(NoLateness::Late));
        let background = Task { priority: Priority::Background, ..simple(1, 20, 2) };
        assert_eq!(of(vec![simple(2, 10, 2), background], 1, &excesses), Err(NoLateness::SeveralCpus));
    }
}
