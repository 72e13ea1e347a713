//! Threads that execute jobs in the order of their releases: a queue.
//!
//! Let a window begin when neither the thread nor a task of higher or equal priority has unfinished work. A job that is released at A
//! waits for the jobs that its thread has released until A, also at A, and for no later one of the thread. So it ends at the least t
//! with t = B + Σ over the thread of Mⱼ(releases of j in \[0, A\]) + Σ over all others of hp(i) of Mₖ(⌈(t + Jₖ)/Tₖ⌉), and responds
//! t − A after its release, J more after its nominal one. While A grows and no task of the thread is released, t stays: only the A of
//! releases count. The window has ended where the next A is at t or later.
//!
//! Without others, this is the analysis that K. Bedarkar et al. prove (*From intuition to Coq: a case study in verified response-time
//! analysis of FIFO scheduling*, RTSS 2022).

use std::collections::BTreeMap;

use crate::lane::{JobCounts, Lane};
use crate::lane_analysis::{LaneResponse, LateJob};
use crate::{Counted, Method, NoBoundReason, Order, Time};

/// The latest job of a queue.
#[derive(Clone, Copy)]
struct QueuedJob {
    release: u64,
    length: u64,
}

impl QueuedJob {
    fn response(self) -> u64 {
        self.length - self.release
    }
}

impl Lane<'_, '_> {
    /// Replaces the responses in threads with a queue by what the order of the releases leaves, where that is less.
    pub(crate) fn queue_in_order(&mut self, found: &mut [LaneResponse]) {
        let method = Method::Psm.min(self.options.method);
        // Without blocking, the latest job is the same for all tasks of a thread.
        let mut of_threads: BTreeMap<Option<u32>, QueuedJob> = BTreeMap::new();
        for found in found {
            let member = self.members.get(found.place);
            if member.task.order != Order::Fifo || found.busy.is_none_or(|busy| !busy.ends) {
                continue;
            }
            let (thread, is_alike) = (member.task.thread, member.blocking == 0);
            let known = of_threads.get(&thread).copied().filter(|_| is_alike);
            let Ok(Some(latest)) =
                known.map_or_else(|| self.latest_in_queue(found.place, method), |it| Ok(Some(it)))
            else {
                continue;
            };
            of_threads.insert(thread, latest);
            // Otherwise, the bound for any order stays.
            let _ = self.enter_queued(found, latest, method);
        }
    }

    /// Returns the latest job in the queue of the member at `place`; none if it has no queue.
    fn latest_in_queue(&mut self, place: usize, method: Method) -> Result<Option<QueuedJob>, NoBoundReason> {
        let of = self.members.get(place).task;
        let is_in_queue = |lane: &Self, it: usize| lane.members.get(it).task.is_queued_with(of);
        let all = 0..self.members.len();
        let queue: Vec<usize> = all.filter(|it| is_in_queue(self, *it)).collect();
        // A task without a thread has no queue.
        if !queue.contains(&place) || queue.iter().any(|it| self.members.get(*it).task.order != Order::Fifo) {
            return Ok(None);
        }
        let mut counts = JobCounts::new(self.members.len());
        for other in self.interfering(place) {
            if !queue.contains(&other) {
                counts.include(other, &mut self.members, method);
            }
        }
        let (mut release, mut budget) = (0, self.budget());
        let mut latest: Option<QueuedJob> = None;
        loop {
            let mut demand: u64 = 0;
            let mut next_release = u64::MAX;
            for &it in &queue {
                let member = self.members.at(it);
                let jobs = member.jobs_released(release + 1)?;
                demand = demand.checked_add(member.demand(jobs)?).ok_or(NoBoundReason::Overflow)?;
                let next = member.next_release_after(release).ok_or(NoBoundReason::Overflow)?;
                next_release = next_release.min(next);
            }
            let jobs = self.members.get(place).jobs_released(release + 1)?;
            let length = self.window(place, jobs, demand.max(1), &mut counts, method, &mut budget)?;
            let job = QueuedJob { release, length };
            if latest.is_none_or(|it| job.response() > it.response()) {
                latest = Some(job);
            }
            if next_release >= length {
                return Ok(latest);
            }
            release = next_release;
        }
    }

    fn enter_queued(
        &mut self,
        found: &mut LaneResponse,
        latest: QueuedJob,
        method: Method,
    ) -> Result<(), NoBoundReason> {
        let member = self.members.get(found.place);
        let late = LateJob {
            job: member.jobs_released(latest.release + 1)?,
            length: latest.length,
            time: latest.response().checked_add(member.jitter).ok_or(NoBoundReason::Overflow)?,
            counted: Counted::UntilRelease(Time::from_nanos(latest.release)),
        };
        self.enter_late_job(found, late, method)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::simple;
    use crate::{Bound, Options, Task, response_times};

    /// Tasks of one thread, with one on top of them.
    fn bounds(order: Order, top: Option<Task>, queued: &[(u64, u64, u64)]) -> Vec<u64> {
        let of_thread = |&(period, jitter, cost): &(u64, u64, u64)| Task {
            thread: Some(1),
            order,
            jitter: Time::from_nanos(jitter),
            ..simple(1, period, cost)
        };
        let tasks: Vec<Task> = queued.iter().map(of_thread).chain(top).collect();
        let options = Options { method: Method::Best, is_brief: false };
        let found = response_times(&tasks, &options, &|| ()).responses;
        let bound = |bound: &Bound| match bound {
            Bound::Response(time) => time.as_nanos(),
            Bound::NoBound(NoBoundReason::FullyLoaded) => 0,
            other => panic!("{other:?}"),
        };
        found.iter().take(queued.len()).map(|it| bound(&it.bound)).collect()
    }

    #[test]
    fn a_job_waits_for_those_that_were_released_before() {
        let queued = [(10, 0, 2), (25, 0, 4), (40, 0, 5)];
        // All three at 0; in any order, the next job of the first task, at 10, comes before the last one.
        assert_eq!(bounds(Order::Fifo, None, &queued), [11; 3]);
        assert_eq!(bounds(Order::Any, None, &queued), [11, 13, 13]);
        // A late job is in the queue with the next one, which ends 2 + 2 + 4 + 5 after its release. The late one itself, in any order,
        // waits for one job of each: 10 + 2 + 4 + 5.
        let late = [(10, 10, 2), (25, 0, 4), (40, 0, 5)];
        assert_eq!(bounds(Order::Fifo, None, &late), [21, 13, 13]);
    }

    #[test]
    fn without_a_thread_there_is_no_queue() {
        let alone = Task { order: Order::Fifo, ..simple(1, 10, 7) };
        let options = Options { method: Method::Best, is_brief: false };
        let found = response_times(&[alone], &options, &|| ()).responses;
        assert_eq!(found[0].bound, Bound::Response(Time::from_nanos(7)));
    }

    #[test]
    fn higher_priorities_until_the_end() {
        // 2 + 4 + 5 in the queue, and 3 in each 10: 11 + 3 + 3.
        let queued = [(30, 0, 2), (30, 0, 4), (40, 0, 5)];
        assert_eq!(bounds(Order::Fifo, Some(simple(2, 10, 3)), &queued), [17; 3]);
        // One of the same priority counts until the end, too.
        assert_eq!(bounds(Order::Fifo, Some(simple(1, 10, 3)), &queued), [17; 3]);
    }

    #[test]
    fn a_later_job_may_be_the_latest() {
        // The fifth of each (Lehoczky, RTSS 1990, with his second task in two halves).
        let queued = [(100, 0, 31), (100, 0, 31)];
        assert_eq!(bounds(Order::Fifo, Some(simple(2, 70, 26)), &queued), [118; 2]);
    }
}
