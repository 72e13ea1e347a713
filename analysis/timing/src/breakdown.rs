//! The interference in the window of a response time, by task. It is computed on request: the lists of all tasks together
//! grow with the square of their number.

use crate::lane::{BusyJob, Lane, LaneMember};
use crate::not_preempted::HIGHEST;
use crate::paths::{self, TaskPath};
use crate::response_time::Lanes;
use crate::{Counted, CpuRule, Interference, Method, Options, Task, Time, Window};

/// Lists the interference of tasks.
///
/// In a window of length t, each task of hp(i) interferes with Mⱼ(⌈(t + Jⱼ)/Tⱼ⌉), or with what another
/// [`Method`] counts.
///
/// ```
/// use mauve_timing::*;
///
/// let task = |priority, period, cost| {
///     Task::new(priority, Time::from_nanos(period), StateMachine::single(Time::from_nanos(cost)))
/// };
/// let tasks = [task(2, 10, 4), task(1, 30, 11)];
/// let options = Options { method: Method::Exact, is_brief: false };
/// let pilot = &response_times(&tasks, &options, &|| ()).responses[1];
/// let mut breakdown = Breakdown::new(&tasks, &options, &|| ());
/// let laser = breakdown.of(1, pilot.rule, pilot.window.as_ref(), pilot.first_job)[0];
/// assert_eq!((laser.task, laser.jobs, laser.time), (0, 2, Time::from_nanos(8)));
/// ```
pub struct Breakdown<'a> {
    options: &'a Options,
    lanes: Lanes<'a>,
}

impl<'a> Breakdown<'a> {
    /// Creates a breakdown of the response times of `tasks`, analysed with `options`. To cancel, `interrupt` unwinds.
    pub fn new(tasks: &'a [Task], options: &'a Options, interrupt: &'a dyn Fn()) -> Breakdown<'a> {
        Breakdown { options, lanes: Lanes::new(tasks, options, interrupt) }
    }

    /// Returns the interference of each task of hp(`of`), in the order of the tasks, in the window of its response time;
    /// without a window, until its first job ends; without either, none. The arguments are those of its
    /// [`Response`](crate::Response).
    pub fn of(
        &mut self,
        of: usize,
        rule: CpuRule,
        window: Option<&Window>,
        first_job: Option<Time>,
    ) -> Vec<Interference> {
        let (length, method) = match (window, first_job) {
            (Some(window), _) => (window.length, window.method),
            (None, Some(first_job)) => (first_job, Method::Psm.min(self.options.method)),
            (None, None) => return Vec::new(),
        };
        if length == Time::ZERO {
            return Vec::new();
        }
        if let CpuRule::Global(cpus) = rule {
            let late = window.map_or(&[] as &[_], |window| &window.late);
            let response = |of: usize| late.iter().find(|(task, _)| *task == of).map(|(_, time)| *time);
            let own = self.lanes.members.iter().position(|member| member.index == of);
            let global = own.map(|own| self.lanes.global(own, cpus, &response));
            return global.map_or_else(Vec::new, |mut global| global.interference(length.as_nanos()));
        }
        let own = self.lanes.tasks.get(of);
        let found = self.in_window(of, rule, window, |lane, place| {
            let mut found = match method {
                Method::Exact => by_paths(place, lane),
                _ => by_windows(place, lane, |member| {
                    let late = window.map_or(&[] as &[_], |window| &window.late);
                    let late = late.iter().find(|(task, _)| *task == member.index);
                    if let Some(window) = window.filter(|it| it.counted == Counted::Rounds) {
                        return member
                            .in_rounds(own?, length.as_nanos(), late?.1.as_nanos(), window.job)
                            .ok();
                    }
                    member.late = late.map(|(_, time)| time.as_nanos());
                    // The analysis computed it before.
                    let length = counted(window, own, member).unwrap_or(length.as_nanos());
                    let found = member.contribution(length, method);
                    member.late = None;
                    found.ok().map(|it| (it.jobs, it.time))
                }),
            };
            found.extend(of_thread(place, lane, window.map_or(1, |window| window.job)));
            found
        });
        let mut found = found.unwrap_or_default();
        found.retain(|it| it.jobs > 0);
        found.sort_unstable_by_key(|it| it.task);
        found
    }

    /// Returns the late job of a task, the length of its window, and the paths of the tasks of hp(`of`) in it: those that the
    /// analysis combined, otherwise the greatest of each. Different jobs may be as late: that of the paths need not be that of
    /// the window.
    pub(crate) fn paths(
        &mut self,
        of: usize,
        rule: CpuRule,
        window: &Window,
    ) -> Option<(BusyJob, Vec<TaskPath>)> {
        let has_paths = self.options.method >= Method::Exact && !matches!(rule, CpuRule::Global(_));
        self.in_window(of, rule, Some(window), |lane, place| {
            let of = lane.members.get(place).index;
            let combined = if has_paths { lane.analyse(|member| member.index == of).pop() } else { None };
            let late = combined.as_ref().and_then(|found| found.busy);
            let late =
                late.map_or(BusyJob { job: window.job, length: window.length.as_nanos() }, |busy| busy.worst);
            let mut combined = combined.map_or_else(Vec::new, |found| found.totals);
            let interfering = lane
                .interfering(place)
                .into_iter()
                .map(|other| (other, lane.members.get(other).jobs_released(late.length).unwrap_or_default()));
            let others: Vec<(usize, u64)> = interfering.chain(lane.mates(place, late.job)).collect();
            let mut paths = Vec::new();
            for (other, jobs) in others {
                let member = lane.members.at(other);
                let totals = match combined.iter_mut().find(|(place, _)| *place == other) {
                    Some((_, totals)) => std::mem::take(totals),
                    None => (1..=jobs.min(paths::LONGEST as u64))
                        .map_while(|jobs| member.demand(jobs).ok())
                        .collect(),
                };
                let first = usize::try_from(jobs).unwrap_or(usize::MAX).min(totals.len());
                let edges = paths::path(member.machine, &totals[..first]);
                paths.push(TaskPath { task: member.index, delay: Time::from_nanos(member.delay), edges });
            }
            (late, paths)
        })
    }

    /// Calls `list` with the lane that was analysed, and the place of the task `of` in it.
    fn in_window<R>(
        &mut self,
        of: usize,
        rule: CpuRule,
        window: Option<&Window>,
        list: impl FnOnce(&mut Lane<'_, 'a>, usize) -> R,
    ) -> Option<R> {
        // All members of the lane: its budget depends on their number.
        let (plan, place) = self.lanes.find(of, rule)?;
        let mut lane = Lane { lists_interference: true, ..self.lanes.lane(plan) };
        (lane.interrupt)();
        if let Some((start, clock)) = window.and_then(|window| Some((window.start?, window.clock))) {
            lane.begin_at_again((start.as_nanos(), clock), place);
        }
        let found = list(&mut lane, place);
        lane.begin_at(None, 1);
        Some(found)
    }
}

/// Returns the length of the part of a window in which the releases of a member count for `own`; none of the whole window.
fn counted(window: Option<&Window>, own: Option<&Task>, member: &LaneMember<'_>) -> Option<u64> {
    let until = match window?.counted {
        Counted::Whole | Counted::Rounds => return None,
        Counted::UntilRelease(release) => {
            Some(release).filter(|_| own.is_some_and(|own| member.task.is_queued_with(own)))
        }
        Counted::UntilBegin(begin) => Some(begin).filter(|_| member.task.priority < HIGHEST),
    };
    until?.as_nanos().checked_add(1)
}

/// Searches the combination of paths again.
fn by_paths(place: usize, lane: &mut Lane<'_, '_>) -> Vec<Interference> {
    let of = lane.members.get(place).index;
    let found = lane.analyse(|member| member.index == of);
    let interference = found.into_iter().next().map_or_else(Vec::new, |found| found.interference).into_iter();
    let interference = interference.map(|(place, jobs, time)| Interference {
        task: lane.members.get(place).index,
        jobs,
        time: Time::from_nanos(time),
    });
    interference.collect()
}

/// Returns what each task of hp(i) contributes to a window.
fn by_windows(
    place: usize,
    lane: &mut Lane<'_, '_>,
    contribution: impl Fn(&mut LaneMember<'_>) -> Option<(u64, u64)>,
) -> Vec<Interference> {
    let others = lane.interfering(place);
    let of_other = |other: usize| {
        let member = lane.members.at(other);
        let (jobs, time) = contribution(member)?;
        Some(Interference { task: member.index, jobs, time: Time::from_nanos(time) })
    };
    others.into_iter().filter_map(of_other).collect()
}

/// Returns what the other tasks of the thread execute before the end of this job of the member at `place`.
fn of_thread(place: usize, lane: &mut Lane<'_, '_>, job: u64) -> Vec<Interference> {
    let mates = lane.mates(place, job);
    let of_mate = |(mate, jobs): (usize, u64)| {
        let member = lane.members.at(mate);
        let time = Time::from_nanos(member.demand(jobs).ok()?);
        Some(Interference { task: member.index, jobs, time })
    };
    mates.into_iter().filter_map(of_mate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, machine};
    use crate::{StateMachine, response_times};

    fn task(priority: u32, period: u64, offset: Option<u64>, machine: StateMachine) -> Task {
        Task { offset: offset.map(Time::from_nanos), ..testing::task(priority, period, machine) }
    }

    fn simple(priority: u32, period: u64, offset: Option<u64>, cost: u64) -> Task {
        task(priority, period, offset, StateMachine::single(Time::from_nanos(cost)))
    }

    /// The task, the number of jobs and the time of each interference.
    fn parts(tasks: &[Task], of: usize, method: Method) -> Vec<(usize, u64, u64)> {
        let options = Options { method, is_brief: false };
        let response = response_times(tasks, &options, &|| ()).responses.swap_remove(of);
        let mut breakdown = Breakdown::new(tasks, &options, &|| ());
        let parts = breakdown.of(of, response.rule, response.window.as_ref(), response.first_job);
        parts.iter().map(|part| (part.task, part.jobs, part.time.as_nanos())).collect()
    }

    #[test]
    fn paths_list_the_tasks_of_higher_priority_only() {
        let hp = machine(3, &[(0, 1, 2), (1, 1, 1), (1, 2, 1), (2, 0, 4), (2, 2, 2)]);
        let tasks = [simple(0, 100, None, 1), simple(1, 5, None, 1), task(2, 3, None, hp)];
        assert_eq!(parts(&tasks, 1, Method::Exact), [(2, 3, 7)]);
    }

    #[test]
    fn the_tasks_of_the_same_thread() {
        let thread = |cost| Task { thread: Some(1), ..simple(1, 6, None, cost) };
        let tasks = [thread(1), thread(2), simple(2, 12, None, 4), thread(1)];
        for method in [Method::Classic, Method::Psm, Method::Exact] {
            assert_eq!(parts(&tasks, 1, method), [(0, 1, 1), (2, 1, 4)]);
            assert_eq!(parts(&tasks, 3, method), [(0, 1, 1), (1, 1, 2), (2, 1, 4)]);
        }
        // Each job of a burst, of a task that the second job of a thread also waits for.
        let burst = Task { burst: 3, ..simple(2, 12, None, 2) };
        let tasks = [thread(1), thread(1), burst];
        assert_eq!(parts(&tasks, 0, Method::Psm), [(2, 3, 6)]);
        assert_eq!(parts(&tasks, 1, Method::Psm), [(0, 1, 1), (2, 3, 6)]);
    }

    #[test]
    fn a_task_without_a_job_in_the_window_does_not_interfere() {
        let tasks = [simple(2, 10, Some(0), 4), simple(1, 10, Some(5), 4)];
        assert_eq!(parts(&tasks, 1, Method::Psm), []);
    }
}
