//! Jobs that are not preempted once they have begun: a frame on a bus, or a thread that raises its priority.
//!
//! To other tasks, such a job holds a lock with the highest ceiling until its end: see `locks.rs`. For the task itself, hp(i) counts
//! only until the job begins: the job q of a window begins s after its start at the latest, the least s with
//! s = B + Mᵢ(q − 1) + w + Σ Mⱼ(releases of j in \[0, s\]), with the wake-up w of its thread, and ends Mᵢ(q) − Mᵢ(q − 1) − w after
//! that. (Let a run execute x in its first q − 1 jobs and y in job q, x ≤ Mᵢ(q − 1) and x + y ≤ Mᵢ(q). With x in place of Mᵢ(q − 1), s
//! is less by Mᵢ(q − 1) − x at least.) Each job of the window counts: the last one may be the latest, as it delays what delays the next
//! one (R. Davis et al., *Controller Area Network (CAN) schedulability analysis: refuted, revisited and revised*, Real-Time Systems 35,
//! 2007). The window is that of jobs that are preempted: at its end, all that was released has ended.
//!
//! What has the highest priority itself, such as throttling or an interrupt, counts until the end.

use crate::lane::{JobCounts, Lane};
use crate::lane_analysis::{LaneResponse, LateJob};
use crate::{Counted, CpuRule, Method, NoBoundReason, Priority, Time};

/// The priority of a job that is not preempted.
pub(crate) const HIGHEST: Priority = Priority::RealTime(99);

impl Lane<'_, '_> {
    /// Replaces the responses of tasks that are not preempted by what counts for them, where that is less.
    pub(crate) fn begin_once(&mut self, found: &mut [LaneResponse]) {
        let mut places = 0..self.members.len();
        if !matches!(self.rule, CpuRule::Cpu(_))
            || !places.all(|it| self.members.get(it).task.cpus().is_one())
        {
            return;
        }
        let method = Method::Psm.min(self.options.method);
        for found in found {
            let of = self.members.get(found.place).task;
            let is_it = of.is_not_preempted && of.waits.is_none() && !of.has_calls;
            if is_it
                && found.busy.is_some_and(|busy| busy.ends)
                && let Ok(late) = self.latest_not_preempted(found.place, method)
            {
                // Otherwise, the bound of jobs that are preempted stays.
                let _ = self.enter_late_job(found, late, method);
            }
        }
    }

    fn latest_not_preempted(&mut self, place: usize, method: Method) -> Result<LateJob, NoBoundReason> {
        let others = self.interfering(place);
        let mut until_end = JobCounts::new(self.members.len());
        others.iter().for_each(|it| until_end.include(*it, &mut self.members, method));
        let mut until_begin = until_end.clone();
        let wake_up = self.members.get(place).task.wake_up.as_nanos();
        let mut budget = self.budget();
        let mut latest: Option<LateJob> = None;
        for job in 1.. {
            let member = self.members.at(place);
            let last = member.demand(job)?.saturating_sub(member.demand(job - 1)?);
            let (release, next_release, jitter) =
                (member.release(job)?, member.release(job + 1)?, member.jitter);
            let demand = self.demand(place, job, false)?;
            let before = demand.saturating_sub(last).saturating_add(wake_up.min(last));
            let begin = before.checked_add(1).ok_or(NoBoundReason::Overflow)?;
            let begin = self.window(place, job, begin, &mut until_begin, method, &mut budget)?;
            let length = self.end_of(place, (job, begin), demand, &others, method, &mut budget)?;
            let time = length.saturating_add(jitter).saturating_sub(release);
            if latest.is_none_or(|known| time > known.time) {
                let counted = Counted::UntilBegin(Time::from_nanos(begin - 1));
                latest = Some(LateJob { job, length, time, counted });
            }
            let whole = self.demand(place, job, true)?;
            let end = self.window(place, job, whole, &mut until_end, method, &mut budget)?;
            if end.saturating_add(jitter) <= next_release {
                break;
            }
        }
        latest.ok_or(NoBoundReason::Budget)
    }

    /// Returns the end of a job and of all that is counted before it, where activities count until `begin`.
    fn end_of(
        &mut self,
        place: usize,
        (job, begin): (u64, u64),
        demand: u64,
        others: &[usize],
        method: Method,
        budget: &mut u64,
    ) -> Result<u64, NoBoundReason> {
        let mut length = begin;
        loop {
            let mut next = u128::from(demand) + u128::from(self.blocking(place, job, length)?);
            for &other in others {
                *budget = budget.checked_sub(1).ok_or(NoBoundReason::Budget)?;
                let counted = if self.priority(other) < HIGHEST { begin } else { length };
                next += u128::from(self.members.at(other).contribution(counted, method)?.time);
            }
            let next = u64::try_from(next).map_err(|_| NoBoundReason::Overflow)?;
            if next <= length {
                return Ok(next.max(1));
            }
            length = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::simple;
    use crate::{Bound, Options, StateMachine, Task, Tasks};

    fn bounds(tasks: Vec<Task>) -> Vec<u64> {
        let options = Options { method: Method::Best, is_brief: false };
        let found = Tasks::new(tasks).response_times(&options, &|| ()).responses;
        let bound = |bound: &Bound| match bound {
            Bound::Response(time) => time.as_nanos(),
            other => panic!("{other:?}"),
        };
        found.iter().map(|it| bound(&it.bound)).collect()
    }

    fn frame(priority: u32, period: u64, cost: u64) -> Task {
        Task { is_not_preempted: true, ..simple(priority, period, cost) }
    }

    /// The example of Davis et al., figure 2, whose second frame of the last message is the latest.
    #[test]
    fn each_job_of_the_window_counts() {
        assert_eq!(bounds(vec![frame(3, 25, 10), frame(2, 35, 10), frame(1, 35, 10)]), [20, 30, 35]);
    }

    #[test]
    fn others_are_delayed_once() {
        // The first task is preempted, and delayed by the job that has begun.
        assert_eq!(bounds(vec![simple(3, 20, 3), frame(2, 40, 8), simple(1, 80, 5)]), [11, 11, 16]);
        // What has the highest priority preempts all.
        assert_eq!(bounds(vec![simple(99, 20, 3), frame(2, 40, 19)]), [22, 25]);
    }

    #[test]
    fn a_wake_up_is_preempted() {
        // A job of the first task may be released at 3 + 17 + 1, while that of the second one wakes up.
        let bounds = |wake_up| {
            let frame = Task { wake_up: Time::from_nanos(wake_up), ..frame(2, 60, 27) };
            bounds(vec![simple(3, 20, 3), frame])[1]
        };
        assert_eq!([0, 16, 17, 27].map(bounds), [30, 30, 33, 33]);
    }

    #[test]
    fn the_greatest_job_need_not_be_last() {
        let edges = crate::testing::machine(2, &[(0, 1, 6), (1, 0, 1)]);
        let of = Task { is_not_preempted: true, ..crate::testing::task(1, 10, edges) };
        let top = Task::new(2, Time::from_nanos(12), StateMachine::single(Time::from_nanos(4)));
        // 4 + 6, and 6 + 4 for the first task.
        assert_eq!(bounds(vec![top, of]), [10, 10]);
    }
}
