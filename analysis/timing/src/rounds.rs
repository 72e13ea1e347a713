//! Threads that execute jobs in rounds: the wait-set executor of ROS 2.
//!
//! When its thread has nothing left to execute, it looks which tasks have a released job, and executes one job of each of these: a round.
//! Periodic tasks come first, as timers do; otherwise the order is any. What is released meanwhile waits for the next round.
//!
//! Let a window begin when a job of i is released and no earlier one of i is unfinished. Each round that begins in the window has a job
//! of i, until one is released that is after the window. So job q of the window is executed in its round q, or before, and until its
//! end the thread executes q jobs of i, and q + 1 of each other task at most, since the round before may be unfinished; if i is
//! periodic and the other is not, q. Meanwhile the thread is never idle, and only what has its priority or a higher one delays it. So
//! f(q) is at most the least t with t = Mᵢ(q) + Σ over the other tasks of the thread of Mⱼ(min(q + 1, nⱼ)) + Σ over the others of hp(i)
//! of Mₖ(nₖ), where n is the number of jobs that are executed in t if each ends within its known response time: see
//! [`LaneMember::carried`]. The window has ended where the next job is released at f(q) or later.
//!
//! So does the `SingleThreadedExecutor` of rclcpp (`executor.cpp`, at 00bef4b2 and a0a2a067), which is also that of a group of the
//! callback-isolated executor of Agnocast, unless the group has callbacks of Agnocast itself.
//!
//! That no callback starves another is the idea of T. Blaß et al., *A ROS 2 response-time analysis exploiting starvation freedom and
//! execution-time variance*, RTSS 2021.

use crate::lane::{Lane, LaneMember};
use crate::lane_analysis::{LaneResponse, LateJob};
use crate::{Bound, Counted, CpuRule, Method, NoBoundReason, Order, Task, Time};

/// How often the bounds of a lane are used for better ones.
const MOST_PASSES: u32 = 8;

impl Lane<'_, '_> {
    /// Replaces the responses in threads with rounds by what these leave, where that is less.
    pub(crate) fn execute_in_rounds(&mut self, found: &mut [LaneResponse]) {
        let of = |place: usize| self.members.get(place).task;
        let mut places = 0..self.members.len();
        let is_on_one_cpu = places.clone().all(|it| of(it).cpus().is_one());
        let has_rounds = places.any(|it| of(it).order == Order::Rounds);
        if !matches!(self.rule, CpuRule::Cpu(_)) || !is_on_one_cpu || !has_rounds {
            return;
        }
        let mut known: Vec<Option<u64>> = vec![None; self.members.len()];
        for _ in 0..MOST_PASSES {
            let before = known.clone();
            for it in found.iter() {
                known[it.place] = match it.response.bound {
                    Bound::Response(time) => Some(time.as_nanos()),
                    _ => None,
                };
            }
            if known == before {
                return;
            }
            for found in found.iter_mut().filter(|it| known[it.place].is_some()) {
                // Otherwise, the bound for any order stays.
                let _ = self.enter_rounds(found, &known);
            }
        }
    }

    fn enter_rounds(&mut self, found: &mut LaneResponse, known: &[Option<u64>]) -> Result<(), NoBoundReason> {
        let place = found.place;
        let of = self.members.get(place).task;
        let is_simple = |it: &LaneMember<'_>| {
            let is_alone = it.blocking == 0 && it.background_blocking == 0 && it.task.waits.is_none();
            is_alone && !it.task.has_calls && it.task.order == Order::Rounds
        };
        let all = (0..self.members.len()).map(|it| self.members.get(it));
        let mut of_thread = all.filter(|it| it.task.is_queued_with(of)).peekable();
        if of_thread.peek().is_none() || !of_thread.all(is_simple) {
            return Ok(());
        }
        // The jobs of a thread with a list may execute until the end of its last task.
        let end_of = |other: usize| known[other].filter(|_| self.members.get(other).thread.is_empty());
        let others = self.interfering(place).into_iter().map(|it| Some((it, end_of(it)?)));
        let Some(others) = others.collect::<Option<Vec<(usize, u64)>>>() else { return Ok(()) };
        let (mut length, mut budget) = (1, self.budget());
        let mut latest: Option<LateJob> = None;
        let mut first_job = None;
        for job in 1.. {
            budget = budget.checked_sub(1).ok_or(NoBoundReason::Budget)?;
            let own = self.members.at(place).demand(job)?.max(1);
            loop {
                let mut next = own;
                for &(other, response) in &others {
                    budget = budget.checked_sub(1).ok_or(NoBoundReason::Budget)?;
                    let time = self.members.at(other).in_rounds(of, length, response, job)?.1;
                    next = next.checked_add(time).ok_or(NoBoundReason::Overflow)?;
                }
                if next <= length {
                    break;
                }
                length = next;
            }
            first_job = first_job.or(Some(Time::from_nanos(length)));
            let member = self.members.get(place);
            let end = length.checked_add(member.jitter).ok_or(NoBoundReason::Overflow)?;
            let time = end.saturating_sub(member.release(job)?);
            if latest.is_none_or(|known| time > known.time) {
                latest = Some(LateJob { job, length, time, counted: Counted::Rounds });
            }
            if end <= member.release(job + 1)? {
                break;
            }
        }
        let Some(latest) = latest else { return Ok(()) };
        self.enter_late_job(found, latest, Method::Psm.min(self.options.method))?;
        let late = others.into_iter().map(|(it, end)| (self.members.get(it).index, Time::from_nanos(end)));
        let window = found.response.window.as_mut();
        if let Some(window) = window.filter(|it| it.counted == Counted::Rounds && it.late.is_empty()) {
            window.late = late.collect();
            found.response.first_job = found.response.first_job.min(first_job);
        }
        Ok(())
    }
}

impl LaneMember<'_> {
    /// Returns the number of jobs that execute in a `window` if each of them ends within `response`, and for how long they do: of the
    /// thread of `own`, those of its rounds until the end of this job of `own` at most.
    pub(crate) fn in_rounds(
        &mut self,
        own: &Task,
        window: u64,
        response: u64,
        job: u64,
    ) -> Result<(u64, u64), NoBoundReason> {
        let (jobs, time) = self.carried(window, response, u64::MAX)?;
        let most = job.saturating_add(u64::from(!own.is_periodic() || self.task.is_periodic()));
        match self.task.is_queued_with(own) && jobs > most {
            true => Ok((most, self.demand(most)?.min(time))),
            false => Ok((jobs, time)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::simple;
    use crate::{Options, response_times};

    /// Returns the bounds of `of_thread`, the tasks of one thread, and of `others` on its CPU. The first `timers` tasks are periodic.
    fn bounds(order: Order, timers: usize, of_thread: &[(u64, u64)], others: &[Task]) -> Vec<u64> {
        let task = |(index, &(period, cost)): (usize, &(u64, u64))| Task {
            thread: Some(0),
            order,
            is_sporadic: index >= timers,
            ..simple(1, period, cost)
        };
        let tasks: Vec<Task> = of_thread.iter().enumerate().map(task).chain(others.iter().cloned()).collect();
        let options = Options { method: Method::Best, is_brief: false };
        let found = response_times(&tasks, &options, &|| ()).responses;
        let bound = |bound: &Bound| match bound {
            Bound::Response(time) => time.as_nanos(),
            other => panic!("{other:?}"),
        };
        found.iter().map(|it| bound(&it.bound)).collect()
    }

    #[test]
    fn each_other_task_has_one_job_in_a_round() {
        let thread = [(1000, 30), (20, 8), (25, 7)];
        // In any order, five jobs of the second task and four of the third one may come first.
        assert_eq!(bounds(Order::Any, 1, &thread, &[])[0], 30 + 5 * 8 + 4 * 7);
        // The rest of a round has one job of each, and so may the next one, before the first task.
        assert_eq!(bounds(Order::Rounds, 3, &thread, &[])[0], 30 + 2 * 8 + 2 * 7);
        assert_eq!(bounds(Order::Rounds, 0, &thread, &[])[0], 30 + 2 * 8 + 2 * 7);
        // A timer comes before what data releases: it waits for the rest of a round only.
        assert_eq!(bounds(Order::Rounds, 1, &thread, &[])[0], 30 + 8 + 7);
    }

    #[test]
    fn higher_priorities_may_be_unfinished_when_the_window_begins() {
        let thread = [(1000, 30), (20, 8)];
        assert_eq!(bounds(Order::Rounds, 1, &thread, &[])[0], 38);
        // A job that responds in 4 executes to the end in the window, and so does the next one.
        assert_eq!(bounds(Order::Rounds, 1, &thread, &[simple(2, 41, 4)])[0], 38 + 2 * 4);
        // One of the same priority may wait for long, and two of it be left.
        assert_eq!(bounds(Order::Rounds, 1, &thread, &[simple(1, 41, 4)])[0], 38 + 3 * 4);
    }

    #[test]
    fn where_a_task_uses_locks_or_other_cpus_the_bound_is_that_of_any_order() {
        let thread = [(1000, 30), (20, 8), (25, 7)];
        let mut wide = simple(2, 100_000, 1);
        wide.cpus = Some(crate::CpuSet(3));
        let both = [Order::Any, Order::Rounds].map(|order| bounds(order, 3, &thread, &[wide.clone()]));
        assert_eq!(both[0], both[1]);
    }
}
