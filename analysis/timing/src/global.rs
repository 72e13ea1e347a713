//! Tasks that may use each of several CPUs: another bound, the lesser counts.
//!
//! Let m CPUs have tasks with this set of CPUs, and besides only tasks on one of them. Whenever a task i of the set waits for a
//! CPU, each of the m executes a task of hp(i). Suppose that a job of i has not ended L after its release. Then it has waited for
//! more than y = L − Cᵢ, and if the tasks of hp(i) execute for at most W₁, W₂, … in L, at most y of each can be meanwhile: so
//! Σ min(Wⱼ, y) ≥ m·y, also for any lesser y. The response time is the least L for which this is false (M. Bertogna, M. Cirinei,
//! RTSS 2007). It is used where all jobs of i end before the next one is released: then a job finds no earlier one.
//!
//! **Wⱼ.** Each job of j ends within Rⱼ, its bound, so that ⌈(L + Rⱼ)/Tⱼ⌉ = n jobs at most execute in L. The first of n jobs
//! executes until Rⱼ after its release and the last one from its own on, so both together in at most L + Rⱼ − (n − 1)·Tⱼ: see
//! [`LaneMember::carried`]. A task without a bound, or one that executes calls of
//! operations between its jobs, may execute all the time. Waits of j are no execution: only Rⱼ has them.
//!
//! **Carry-in.** Let L begin earlier, at the first instant from which on all m CPUs execute hp(i) until the release. Just before it,
//! one CPU does not. So fewer than m tasks of higher priority than i that may use this CPU are ready (N. Guan et al., RTSS 2009):
//! at most m − 1 have an unfinished job, all others release their jobs in L. A task that is not ready may have one too, where it
//! waits for something else than a CPU, and so may one on another CPU only, one of equal priority, which the job before of i may
//! delay, and one whose thread executes other tasks: these count with carry-in, each until the whole thread has ended.
//!
//! **Vⱼ.** While i waits, m − 1 CPUs execute others than j. In the Rⱼ of a job of j, that is for Vⱼ at most: the greatest y with
//! Σ min(Wₖ(Rⱼ), y) ≥ (m − 1)·y over the others. So no job of j counts more than Vⱼ.
//!
//! Real-time throttling is no task here: Linux does not move a thread away from a CPU that is throttled.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use crate::lane::LaneMember;
use crate::response_time::{Lanes, better};
use crate::{
    Bound, Counted, CpuRule, CpuSet, Interference, Method, NoBoundReason, Priority, Response, Task, Time,
    Window,
};

/// The budget of all tasks, shared equally, in visited members of hp(i).
const BUDGET: u64 = 1 << 19;
const BRIEF_BUDGET: u64 = 1 << 15;

/// The maximum number of tasks of hp(i) for which V is computed.
const MOST_FOR_OVERLAP: usize = 48;

const KEPT_ITERATIONS: usize = 32;

/// A task of hp(i).
struct Other {
    /// Its index in all members.
    member: usize,
    /// R, if that is known.
    response: Option<u64>,
    /// Whether it counts with carry-in in any case, beside the m − 1 others.
    always_carries: bool,
    /// V: the most that a job of it executes while the task waits.
    most_of_job: u64,
}

/// What a task of hp(i) executes in a window, and the number of jobs.
struct WindowWork {
    without_carry: (u64, u64),
    with_carry: (u64, u64),
}

/// A task i and hp(i).
pub(crate) struct Global<'m, 'a> {
    members: &'m mut [LaneMember<'a>],
    own: usize,
    cpus: CpuSet,
    method: Method,
    others: Vec<Other>,
    interrupt: &'m dyn Fn(),
}

impl<'a> Lanes<'a> {
    /// Replaces the best responses by those on all CPUs of a set, where these are less.
    pub(crate) fn use_all_cpus(&mut self, best: &mut [Option<Response>]) {
        let sets = self.members.iter().map(|member| member.task.cpus());
        let sets: BTreeSet<CpuSet> = sets.filter(|cpus| cpus.len() > 1).collect();
        for cpus in sets {
            let is_equal = |task: &Task| {
                let is_on_one = task.cpus().is_one() && task.priority != Priority::Unknown;
                task.cpus() == cpus || is_on_one || !task.cpus().meets(cpus)
            };
            if self.tasks.iter().all(is_equal) {
                self.use_cpus(cpus, best);
            }
        }
    }

    fn use_cpus(&mut self, cpus: CpuSet, best: &mut [Option<Response>]) {
        let of_unknown = self.unknown.iter().map(|&task| &self.tasks[task]);
        let unknown = of_unknown.filter(|task| task.cpus().meets(cpus)).map(|task| task.priority).max();
        let is_wanted = |member: &LaneMember<'_>| {
            let task = member.task;
            let has_own_thread = task.thread.is_none() && task.burst() == 1 && !task.has_calls;
            let is_alone = has_own_thread && member.blocking == 0;
            task.cpus() == cpus && is_alone && unknown.is_none_or(|unknown| task.priority > unknown)
        };
        let priority = |member: &usize| self.members[*member].task.priority;
        let mut wanted: Vec<usize> =
            (0..self.members.len()).filter(|it| is_wanted(&self.members[*it])).collect();
        wanted.sort_by_key(|member| Reverse(priority(member)));
        let levels: Vec<Vec<usize>> =
            wanted.chunk_by(|a, b| priority(a) == priority(b)).map(<[usize]>::to_vec).collect();
        let budget = if self.options.is_brief { BRIEF_BUDGET } else { BUDGET } / (wanted.len() as u64).max(1);
        for level in levels {
            // The second time with what was found for equal priorities.
            for _ in 0..level.len().min(2) {
                let found: Vec<(usize, Option<Response>)> = level
                    .iter()
                    .map(|&own| {
                        let task = self.members[own].index;
                        (task, self.response_on(own, cpus, best, budget))
                    })
                    .collect();
                for (task, found) in found {
                    let Some(found) = found else { continue };
                    best[task] = Some(better(best[task].take(), found));
                }
            }
        }
    }

    fn response_on(
        &mut self,
        own: usize,
        cpus: CpuSet,
        best: &[Option<Response>],
        budget: u64,
    ) -> Option<Response> {
        (self.interrupt)();
        let response = |task: usize| match best[task].as_ref()?.bound {
            Bound::Response(time) => Some(time),
            _ => None,
        };
        let known = best[self.members[own].index].clone()?;
        let mut global = self.global(own, cpus, &response);
        let (length, iterations) = global.length(budget)?;
        let member = &mut global.members[own];
        let time = Time::from_nanos(length.checked_add(member.jitter)?);
        let cost = member.demand(1).ok()?;
        let late = global.others.iter().filter_map(|other| {
            Some((global.members[other.member].index, Time::from_nanos(other.response?)))
        });
        let window = Window {
            method: global.method,
            job: 1,
            own: Time::from_nanos(cost),
            length: Time::from_nanos(length),
            start: None,
            clock: 0,
            delay: Time::ZERO,
            iterations: if Some(time) > global.members[own].task.deadline { iterations } else { Vec::new() },
            blocking: Time::ZERO,
            counted: Counted::Whole,
            late: late.collect(),
        };
        let method = global.method;
        let (bound, rule) = (Bound::Response(time), CpuRule::Global(cpus));
        // On several CPUs, no first job is that of a critical instant.
        Some(Response {
            first_job: None,
            bound,
            window: Some(window),
            method,
            is_exhausted: false,
            rule,
            ..known
        })
    }

    /// Returns a member and hp(i) on these CPUs, with the response times of tasks.
    pub(crate) fn global(
        &mut self,
        own: usize,
        cpus: CpuSet,
        response: &dyn Fn(usize) -> Option<Time>,
    ) -> Global<'_, 'a> {
        let priority = self.members[own].task.priority;
        let is_other = |member: &usize| {
            let task = self.members[*member].task;
            *member != own && task.priority >= priority && task.cpus().meets(cpus)
        };
        let other = |member: usize| {
            let it = &self.members[member];
            let is_ready = it.task.waits.is_none() && it.task.thread.is_none() && it.blocking == 0;
            // A call may be executed between two jobs.
            let has_calls = it.task.has_calls;
            // The first job of a thread has its switches, and the last of them ends with the last job.
            let of_thread = it.thread.iter().map(|&mate| response(self.members[mate].index));
            let responses = of_thread.chain([response(it.index)]);
            let response = responses.reduce(|one, other| Some(one?.max(other?))).flatten();
            Other {
                member,
                response: response.filter(|_| !has_calls).map(Time::as_nanos),
                always_carries: !is_ready
                    || has_calls
                    || it.task.cpus() != cpus
                    || it.task.priority == priority,
                most_of_job: u64::MAX,
            }
        };
        let others = (0..self.members.len()).filter(is_other).map(other).collect();
        let method = self.options.method.min(Method::Ibf);
        let mut found =
            Global { members: &mut self.members, own, cpus, method, others, interrupt: self.interrupt };
        found.limit_jobs();
        found
    }
}

impl Global<'_, '_> {
    /// Enters V.
    fn limit_jobs(&mut self) {
        if self.others.len() > MOST_FOR_OVERLAP {
            return;
        }
        for index in 0..self.others.len() {
            let Some(length) = self.others[index].response else { continue };
            (self.interrupt)();
            let others = self.others.iter().enumerate().filter(|(other, _)| *other != index);
            let work = others.map(|(_, other)| match other.response {
                Some(response) => {
                    self.members[other.member].carried(length, response, u64::MAX).map(|it| it.1)
                }
                None => Ok(u64::MAX),
            });
            if let Ok(work) = work.collect::<Result<Vec<u64>, NoBoundReason>>() {
                self.others[index].most_of_job = executed_at_once(work, u64::from(self.cpus.len()) - 1);
            }
        }
    }

    fn work(&mut self, length: u64) -> Result<Vec<WindowWork>, NoBoundReason> {
        let work = |other: &Other| {
            let member = &mut self.members[other.member];
            let with_carry = match other.response {
                Some(response) => member.carried(length, response, other.most_of_job)?,
                None => (member.jobs_released(length)?, u64::MAX),
            };
            let released = member.contribution(length, self.method)?;
            let most = released.jobs.saturating_mul(other.most_of_job);
            let without_carry = (released.jobs, released.time.min(most));
            Ok(WindowWork {
                without_carry: if other.always_carries { with_carry } else { without_carry },
                with_carry,
            })
        };
        self.others.iter().map(work).collect()
    }

    /// Returns by how much the carry-in of a task adds to what it executes, with the index of the task: of the m − 1 for which that
    /// is most. No task counts more than `most`.
    fn carried(&self, work: &[WindowWork], most: u64) -> Vec<(u64, usize)> {
        let more = |it: &WindowWork| it.with_carry.1.min(most).saturating_sub(it.without_carry.1.min(most));
        let mut all: Vec<(u64, usize)> =
            work.iter().map(more).zip(0..).filter(|(more, _)| *more > 0).collect();
        all.sort_unstable_by_key(|&(more, index)| (Reverse(more), index));
        all.truncate(self.cpus.len() as usize - 1);
        all
    }

    fn total(&self, work: &[WindowWork], most: u64) -> u128 {
        let without: u128 = work.iter().map(|it| u128::from(it.without_carry.1.min(most))).sum();
        let carried = self.carried(work, most);
        without + carried.iter().map(|(more, _)| u128::from(*more)).sum::<u128>()
    }

    /// Returns the greatest y with Σ min(W, y) ≥ m·y, rounded up; `longest` or more if it is not less.
    fn waited(&self, work: &[WindowWork], longest: u64) -> u64 {
        let cpus = u128::from(self.cpus.len());
        let (mut low, mut high) = (0, longest.saturating_add(1));
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if self.total(work, middle) >= cpus * u128::from(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low + u64::from(self.total(work, low) > cpus * u128::from(low))
    }

    /// Returns the length of the window, and the last values of its iteration, if it ends before the next job is released.
    fn length(&mut self, mut budget: u64) -> Option<(u64, Vec<Time>)> {
        let member = &mut self.members[self.own];
        let own = member.demand(1).ok()?.max(1);
        let longest = member.period.checked_sub(member.jitter)?;
        let mut iterations = Vec::new();
        let mut length = own;
        while length <= longest {
            // What each other task executes takes as long to compute as a pass of a lane.
            self.others.iter().for_each(|_| (self.interrupt)());
            budget = budget.checked_sub(self.others.len() as u64)?;
            iterations.push(Time::from_nanos(length));
            let work = self.work(length).ok()?;
            let next = own.checked_add(self.waited(&work, longest))?;
            if next <= length {
                let kept = iterations.len().saturating_sub(KEPT_ITERATIONS);
                return Some((length, iterations.split_off(kept)));
            }
            length = next;
        }
        None
    }

    /// Returns what executes while the task waits in a window of this length.
    pub(crate) fn interference(&mut self, length: u64) -> Vec<Interference> {
        let own = self.members[self.own].demand(1).unwrap_or_default().max(1);
        let Ok(work) = self.work(length) else { return Vec::new() };
        let most = length.saturating_sub(own);
        let carried = self.carried(&work, most);
        let parts = work.iter().zip(&self.others).enumerate().map(|(index, (work, other))| {
            let is_carried = carried.iter().any(|(_, of)| *of == index);
            let (jobs, time) = if is_carried { work.with_carry } else { work.without_carry };
            let time = Time::from_nanos(time.min(most));
            Interference { task: self.members[other.member].index, jobs, time }
        });
        parts.filter(|part| part.time > Time::ZERO).collect()
    }
}

/// Returns for how long so many CPUs execute tasks at once that execute for these times: the greatest y with Σ min(W, y) ≥ m·y,
/// rounded up. That is the least, over k < m, of the sum of all but the k greatest, divided by m − k.
fn executed_at_once(mut work: Vec<u64>, cpus: u64) -> u64 {
    work.sort_unstable();
    let sums = (0..cpus).map(|greatest| {
        let others = work.len().saturating_sub(greatest as usize);
        let sum: u128 = work.iter().take(others).map(|work| u128::from(*work)).sum();
        sum.div_ceil(u128::from(cpus - greatest))
    });
    sums.min().and_then(|least| u64::try_from(least).ok()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{machine, simple, task};
    use crate::{Breakdown, Options, response_times};

    const IBF: Options = Options { method: Method::Ibf, is_brief: false };

    fn on(cpus: u128, task: Task) -> Task {
        Task { cpus: Some(CpuSet(cpus)), ..task }
    }

    fn responses(tasks: &[Task]) -> Vec<Option<u64>> {
        let of = |response: &Response| match response.bound {
            Bound::Response(time) => Some(time.as_nanos()),
            _ => None,
        };
        response_times(tasks, &IBF, &|| ()).responses.iter().map(of).collect()
    }

    /// C and T, by descending priority, on the first CPUs.
    fn on_all(cpus: u128, tasks: &[(u64, u64)]) -> Vec<Task> {
        let numbers = (0..tasks.len() as u32).rev();
        numbers
            .zip(tasks)
            .map(|(priority, &(cost, period))| on(cpus, simple(priority, period, cost)))
            .collect()
    }

    #[test]
    fn tasks_that_only_many_others_delay() {
        // Fewer others than CPUs.
        assert_eq!(responses(&on_all(0b11, &[(6, 10), (6, 10)])), [Some(6), Some(6)]);
        // The third one waits for the half of what the others execute.
        assert_eq!(responses(&on_all(0b11, &[(2, 10), (2, 10), (3, 10)])), [Some(2), Some(2), Some(5)]);
        // It ends after the next job is released: the jobs before would delay it.
        assert_eq!(responses(&on_all(0b11, &[(9, 10), (9, 10), (3, 10)]))[2], None);
        let late = Task { jitter: Time::from_nanos(6), ..on(0b11, simple(0, 10, 3)) };
        let two = on_all(0b11, &[(2, 10), (2, 10)])
            .into_iter()
            .map(|task| Task { priority: Priority::RealTime(5), ..task });
        let tasks: Vec<Task> = two.chain([late]).collect();
        assert_eq!(responses(&tasks)[2], Some(13));
    }

    #[test]
    fn a_task_that_may_execute_all_the_time_leaves_the_other_cpus() {
        let mut tasks = on_all(0b11, &[(11, 10), (2, 10), (3, 10)]);
        assert_eq!(responses(&tasks), [None, Some(2), Some(5)]);
        tasks[0].cpus = Some(CpuSet(0b01));
        assert_eq!(responses(&tasks), [None, Some(2), Some(5)]);
    }

    #[test]
    fn where_it_is_not_used() {
        let tasks = || on_all(0b11, &[(6, 10), (6, 10)]);
        let second = |tasks: &[Task]| responses(tasks)[1];
        assert_eq!(second(&tasks()), Some(6));
        // Another set of several CPUs, also of a lower priority.
        let mut mixed = tasks();
        mixed.push(on(0b110, Task { priority: Priority::Unknown, ..simple(0, 100, 1) }));
        assert_eq!(second(&mixed), None);
        mixed[2].priority = Priority::RealTime(0);
        mixed[0].priority = Priority::RealTime(2);
        assert_eq!(second(&mixed), None);
        // Throttling of a CPU.
        let mut throttled = tasks();
        throttled.push(on(0b10, Task { priority: Priority::Unknown, ..simple(0, 100, 1) }));
        assert_eq!(second(&throttled), None);
        // A task of unknown demand.
        let mut unknown = tasks();
        unknown.push(on(0b10, Task { demand: crate::Demand::Unknown, ..simple(9, 100, 1) }));
        assert_eq!(second(&unknown), None);
        // A task that executes calls between its jobs; for others, it is one that may execute all the time.
        let mut calls = tasks();
        calls[1].has_calls = true;
        assert_eq!(second(&calls), None);
        let mut calls = on_all(0b11, &[(1, 10), (2, 10), (3, 10)]);
        assert_eq!(responses(&calls)[2], Some(4));
        calls[0].has_calls = true;
        assert_eq!(responses(&calls)[2], Some(5));
    }

    /// What the first task executes for its thread may be executed at the end, 4 after the release: two jobs of it in a window of 8.
    #[test]
    fn a_thread_that_ends_with_a_part_of_its_first_task() {
        let thread = |cost| on(0b11, Task { thread: Some(1), ..simple(1, 10, cost) });
        let tasks = [thread(1), thread(3), on(0b11, simple(0, 20, 8))];
        assert_eq!(responses(&tasks), [Some(1), Some(4), Some(10)]);
    }

    #[test]
    fn what_executes_while_the_task_waits() {
        let of = on(0b11, simple(0, 30, 9));
        let path = on(0b11, task(2, 9, machine(2, &[(0, 1, 3), (1, 0, 1)])));
        let tasks = [on(0b11, simple(3, 5, 1)), path, on(0b11, simple(1, 20, 4)), of];
        let response = response_times(&tasks, &IBF, &|| ()).responses.swap_remove(3);
        assert_eq!(response.rule, CpuRule::Global(CpuSet(0b11)));
        let window = response.window.as_ref().unwrap();
        let mut breakdown = Breakdown::new(&tasks, &IBF, &|| ());
        let parts = breakdown.of(3, response.rule, Some(window), response.first_job);
        let parts: Vec<_> = parts.iter().map(|it| (it.task, it.jobs, it.time.as_nanos())).collect();
        let waited = window.length.as_nanos() - window.own.as_nanos();
        let sum: u64 = parts.iter().map(|part| part.2).sum();
        assert_eq!((sum.div_ceil(2), parts), (waited, vec![(0, 3, 3), (1, 2, 4), (2, 1, 4)]));
    }

    #[test]
    fn the_time_for_which_several_cpus_are_busy() {
        assert_eq!(executed_at_once(vec![3, 100], 2), 3);
        assert_eq!(executed_at_once(vec![4, 3, 6], 2), 7);
        assert_eq!(executed_at_once(vec![4, 3, 8], 2), 7);
        assert_eq!(executed_at_once(vec![u64::MAX; 3], 3), u64::MAX);
        assert_eq!(executed_at_once(vec![9], 2), 0);
    }
}
