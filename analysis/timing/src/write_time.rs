//! The response time to a write: how long after the release of its job a task has written at the latest.
//!
//! If the first job of a busy window with all of hp(i) ends before the next own one may be released, f(1) + J ≤ T, then no window
//! has a second job: at f(1) it has ended, and with it all demand in the window, since that is at most f(1). So the write has ended
//! at the least t that is what the job executes up to the write, and B, and what hp(i) executes in a window of length t; and
//! it is J + t after the nominal release at most. The jobs before it in its thread count as execution of the job. In other cases
//! the response time bounds it.

use crate::lane::{JobCounts, Lane};
use crate::lane_analysis::MOST_TIGHTENED;
use crate::response_time::Lanes;
use crate::{CpuRule, Method, Options, Tasks, Time};

/// The maximum number of visited members for one fixed point.
const BUDGET: u64 = 1 << 16;

/// A write of a task.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ChainWrite {
    /// The index of the task.
    pub task: usize,
    /// All that the job executes, and waits for, up to the end of the write: with calls of operations, and with what a dispatch
    /// costs.
    pub cost: Time,
    /// The response time of the task.
    pub response: Time,
}

impl Tasks {
    /// Returns the response time to each of these writes, counted from the nominal release. These must be the analysed tasks,
    /// [`SetAnalysis::tasks`](crate::SetAnalysis::tasks). To cancel, `interrupt` unwinds.
    ///
    /// ```
    /// use mauve_timing::*;
    ///
    /// let ns = Time::from_nanos;
    /// let tasks = Tasks::new(vec![Task { jitter: ns(1), ..Task::new(1, ns(20), StateMachine::single(ns(10))) }]);
    /// let options = Options { method: Method::Best, is_brief: false };
    /// let write = ChainWrite { task: 0, cost: ns(4), response: ns(11) };
    /// assert_eq!(tasks.write_times(&[write], &options, &|| ()), [ns(5)]);
    /// ```
    pub fn write_times(&self, writes: &[ChainWrite], options: &Options, interrupt: &dyn Fn()) -> Vec<Time> {
        let mut lanes = Lanes::new(&self.all, options, interrupt);
        let of_write = |write: &ChainWrite| write_time(&mut lanes, write).unwrap_or(write.response);
        writes.iter().map(of_write).collect()
    }
}

/// Returns the response time to a write; none where that of the whole job bounds it.
fn write_time(lanes: &mut Lanes<'_>, write: &ChainWrite) -> Option<Time> {
    let cpu = lanes.tasks.get(write.task)?.cpus.filter(|cpus| cpus.is_one())?;
    let (plan, place) = lanes.find(write.task, CpuRule::Cpu(cpu.first()?))?;
    let mut lane = lanes.wants(plan, write.task).then(|| lanes.lane(plan))?;
    let member = lane.members.at(place);
    let (next_release, jitter, own) = (member.release(2).ok()?, member.jitter, member.demand(1).ok()?);
    let by_jobs = lane.options.method.min(Method::Psm);
    let of_thread = lane.demand(place, 1, true).ok()?;
    let others = lane.interfering(place);
    let whole = lane.first_window(place, &others, of_thread, by_jobs)?.checked_add(jitter)?;
    if whole > next_release {
        return None;
    }
    let before = lane.demand(place, 1, false).ok()?.saturating_sub(own.max(1));
    let best =
        if lane.members_of_all <= MOST_TIGHTENED { lane.options.method.min(Method::Ibf) } else { by_jobs };
    let of_write = write.cost.as_nanos().min(own).max(1).checked_add(before)?;
    let time = lane.first_window(place, &others, of_write, best)?.checked_add(jitter)?;
    Some(Time::from_nanos(time).min(write.response))
}

impl Lane<'_, '_> {
    /// Returns the end of a demand of a first job in a window that begins with the release of all tasks.
    fn first_window(&mut self, place: usize, others: &[usize], own: u64, method: Method) -> Option<u64> {
        let mut counts = JobCounts::new(self.members.len());
        others.iter().for_each(|&other| counts.include(other, &mut self.members, method));
        let mut budget = BUDGET;
        self.window(place, 1, own, &mut counts, method, &mut budget).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::simple;
    use crate::{CpuSet, Task, Waits};

    fn ns(time: u64) -> Time {
        Time::from_nanos(time)
    }

    fn times(tasks: Vec<Task>, writes: &[(usize, u64, u64)], method: Method) -> Vec<u64> {
        let options = Options { method, is_brief: false };
        let write = |&(task, cost, response)| ChainWrite { task, cost: ns(cost), response: ns(response) };
        let writes: Vec<ChainWrite> = writes.iter().map(write).collect();
        let found = Tasks::new(tasks).write_times(&writes, &options, &|| ());
        found.into_iter().map(Time::as_nanos).collect()
    }

    #[test]
    fn a_write_before_the_end() {
        let tasks = || vec![simple(2, 10, 4), simple(1, 30, 11)];
        // Until 10, the task executes for 6; then the other one does again.
        let writes = [(1, 0, 19), (1, 1, 19), (1, 6, 19), (1, 7, 19), (1, 11, 19), (1, 99, 19), (0, 2, 4)];
        for method in [Method::Classic, Method::Psm, Method::Best] {
            assert_eq!(times(tasks(), &writes, method), [5, 5, 10, 15, 19, 19, 2]);
        }
        let mut late = tasks();
        late[0].jitter = ns(1);
        late[1].jitter = ns(2);
        assert_eq!(times(late, &[(1, 5, 25), (1, 6, 25)], Method::Psm), [11, 16]);
        let mut blocked = tasks();
        blocked[1].blocking = ns(2);
        assert_eq!(times(blocked, &[(1, 4, 25), (1, 5, 25)], Method::Psm), [10, 15]);
    }

    #[test]
    fn the_response_time_where_a_window_may_have_two_jobs() {
        let writes = [(1, 1, 118)];
        assert_eq!(times(vec![simple(2, 70, 26), simple(1, 100, 62)], &writes, Method::Psm), [118]);
        // A response time that is known to be less, and one of several CPUs.
        assert_eq!(times(vec![simple(2, 10, 4), simple(1, 30, 11)], &[(1, 7, 12)], Method::Psm), [12]);
        let two = Task { cpus: Some(CpuSet(3)), ..simple(1, 30, 11) };
        assert_eq!(times(vec![simple(2, 10, 4), two], &[(1, 1, 19), (7, 1, 3)], Method::Psm), [19, 3]);
    }

    #[test]
    fn the_tasks_before_it_in_its_thread() {
        let thread = |cost| Task { thread: Some(1), ..simple(1, 30, cost) };
        let tasks = || vec![simple(2, 10, 4), thread(2), thread(3), thread(6)];
        let writes = [(1, 2, 6), (2, 1, 9), (2, 3, 9), (3, 1, 19), (3, 4, 19)];
        assert_eq!(times(tasks(), &writes, Method::Best), [6, 7, 9, 10, 17]);
        // A second period of the thread may be in the window, and a second job of a burst.
        let mut late = tasks();
        late[1..].iter_mut().for_each(|task| task.period = Some(ns(18)));
        assert_eq!(times(late, &[(1, 1, 6)], Method::Best), [6]);
        let burst = Task { burst: 2, ..simple(1, 30, 2) };
        assert_eq!(times(vec![burst], &[(0, 1, 4)], Method::Best), [4]);
    }

    #[test]
    fn waits_and_full_cpus_end() {
        let executed = crate::StateMachine::single(ns(1));
        let (demand, waits) = Waits::with_demand(executed, &[ns(9)], Some(1), None).unwrap();
        let waiting = Task { demand, waits, ..simple(2, 10, 0) };
        assert_eq!(times(vec![waiting, simple(1, 30, 5)], &[(1, 1, 29)], Method::Best), [29]);
    }
}
