//! Chains that end before they start again: their steps do not delay each other.
//!
//! **Which chains.** All that follows holds for a part of a chain too. The nominal releases of its first step s₁ are T apart at least. Only data of sₖ₋₁ releases a later step sₖ: at one port
//! without a buffer, to which a job of sₖ₋₁ writes once at most; the least distance Tₖ of its releases is at most T. So *instance* j of
//! the chain is a job of s₁, nominally released at pⱼ ≥ pⱼ₋₁ + T, and at most one job of each later step. A step is *exclusive* if
//! its job ends with the write that releases the next step, or if it is the last one.
//!
//! **Which steps do not count.** An exclusive step sᵢ *yields* to an exclusive step sₖ on its CPU if each task that may delay sₖ there,
//! other than exclusive steps, has a higher priority than sᵢ. Let Rₖ be the response time of an exclusive step among all tasks but those that
//! yield to it, of another step among all tasks, and L = ΣRₖ ≤ T.
//!
//! **Claim(j, k):** sₖ of instance j is nominally released by pⱼ + R₁ + … + Rₖ₋₁, and ends Rₖ after that release at most; so all
//! of instance j ends by pⱼ + L ≤ pⱼ₊₁. By induction on j, then k:
//!
//! - *Its release.* It waits for data, which is written by pⱼ + R₁ + … + Rₖ₋₁ after Claim(j, k − 1); for Tₖ since its last
//!   release, or for the end of that job, Rₖ after it at most: that release was by pⱼ₋₁ + R₁ + … + Rₖ₋₁ or earlier, and T ≥ Tₖ, T ≥ Rₖ.
//! - *Its end.* Until Rₖ after its release, instances before j have ended, and the next one is not released. Exclusive steps before sₖ ended
//!   with their write, and those after it are released when it ends, if it is exclusive. So up to then, at most one exclusive
//!   step has a job at any instant. When a step that yields to sₖ executes, sₖ and other exclusive steps have none,
//!   and the others that may delay sₖ would preempt it: none of them is ready. So it delays sₖ and them as a task of lower priority
//!   than all of them: not at all. Hence Rₖ holds.
//!
//! A task between them, whose priority is at least that of sₖ and at most that of sᵢ, breaks this: sᵢ delays it, and it then delays sₖ.
//! So do a lock, or a job that is not preempted, for which a task waits while one of lower priority executes, and several CPUs of a
//! task, since Linux may let it wait for one CPU while sᵢ executes on another. A thread or a call that executes for others is not a job
//! of the chain.
//!
//! ```
//! use mauve_timing::*;
//!
//! let ns = Time::from_nanos;
//! let task = |cost| Task::new(1, ns(10), StateMachine::single(ns(cost)));
//! let tasks = Tasks::new(vec![task(4), Task { is_sporadic: true, ..task(5) }]);
//! let step = |task| ChainStep { task, write: ns(9), response: ns(9), ends_with_write: true, ..ChainStep::default() };
//! let released = ChainRelease { distance: None, by_data: true, others: None };
//! let chain = [step(0), ChainStep { released: Some(released), writes: Some(1), ..step(1) }];
//! let options = Options { method: Method::Best, is_brief: false };
//! let found = tasks.steps_apart(&chain, &options, &|| ()).unwrap();
//! assert_eq!([found[0].response, found[1].response], [ns(4), ns(5)]);
//! ```

use crate::{Bound, ChainStep, CpuSet, Options, Priority, Task, Tasks, Time, response_times};

impl Tasks {
    /// Returns the steps of a chain with the response times that hold since parts of it end before they start again; none where that is
    /// not known, or makes no difference. These must be the analysed tasks, [`SetAnalysis::tasks`](crate::SetAnalysis::tasks).
    pub fn steps_apart(
        &self,
        chain: &[ChainStep],
        options: &Options,
        interrupt: &dyn Fn(),
    ) -> Option<Vec<ChainStep>> {
        let mut apart = chain.to_vec();
        for part in apart.chunk_by_mut(|_, step| self.follows(step)).filter(|part| part.len() > 1) {
            if let Some(found) = self.part_apart(part, options, interrupt) {
                part.clone_from_slice(&found);
            }
        }
        (apart != chain).then_some(apart)
    }

    /// The same for a part in which only data of each step releases the next one.
    fn part_apart(
        &self,
        part: &[ChainStep],
        options: &Options,
        interrupt: &dyn Fn(),
    ) -> Option<Vec<ChainStep>> {
        let (first, last) = (part.first()?, part.last()?);
        let period = |step: &ChainStep| self.all.get(step.task).filter(|task| task.burst() == 1)?.period;
        let least = period(first)?;
        let mut tasks: Vec<usize> = part.iter().map(|step| step.task).collect();
        tasks.sort_unstable();
        tasks.dedup();
        if tasks.len() < part.len() || !part.iter().all(|step| period(step).is_some_and(|it| it <= least)) {
            return None;
        }
        let is_exclusive =
            |step: &&ChainStep| (step.ends_with_write || step.task == last.task) && self.is_alone(step.task);
        let exclusive: Vec<usize> = part.iter().filter(is_exclusive).map(|step| step.task).collect();
        let mut apart = part.to_vec();
        for step in apart.iter_mut().filter(|step| exclusive.contains(&step.task)) {
            if let Some(response) = self.response_apart(step.task, &exclusive, options, interrupt) {
                step.response = step.response.min(response);
                step.write = step.write.min(response);
            }
        }
        let sum = apart.iter().try_fold(Time::ZERO, |sum, step| sum.checked_add(step.response))?;
        (sum <= least).then_some(apart)
    }

    /// Whether only data of the step before releases a step: at most once for each of its jobs.
    fn follows(&self, step: &ChainStep) -> bool {
        let is_by_data = step.released.is_some_and(|it| it.by_data && it.others.is_none());
        let is_single = step.buffer.is_none() && step.writes.is_some_and(|writes| writes <= 1);
        let is_sporadic = self.all.get(step.task).is_some_and(|it| !it.is_periodic());
        is_by_data && is_single && is_sporadic && !step.is_call
    }

    /// Whether one CPU executes a task, and nothing but its jobs, and no task there takes a lock, or is not preempted.
    fn is_alone(&self, task: usize) -> bool {
        let Some(of) = self.all.get(task) else { return false };
        let cpus = |task: &Task| task.cpus.unwrap_or(CpuSet::ALL);
        let is_there = |task: &Task| cpus(task).meets(cpus(of));
        let users = self.locks.iter().flat_map(|lock| &lock.users);
        let mut users = users.filter_map(|user| self.all.get(user.task));
        let mut not_preempted = self.all.iter().filter(|task| task.is_not_preempted);
        let is_real_time = of.priority.real_time().is_some();
        let is_only = is_real_time && of.thread.is_none() && !of.has_calls && cpus(of).is_one();
        is_only && !users.any(is_there) && !not_preempted.any(is_there)
    }

    /// Returns the response time of an exclusive step without those that yield to it; none if there are none.
    fn response_apart(
        &self,
        of: usize,
        exclusive: &[usize],
        options: &Options,
        interrupt: &dyn Fn(),
    ) -> Option<Time> {
        let step = self.all.get(of)?;
        let may_delay = |task: &Task| task.cpus().meets(step.cpus()) && task.priority >= step.priority;
        let known = |task: &Task| match task.priority {
            Priority::Unknown if !task.is_throttling => Priority::Background,
            priority if task.cpus().is_one() => priority,
            _ => Priority::Background,
        };
        let all = || self.all.iter().enumerate().filter(|(_, task)| may_delay(task));
        let others = all().filter(|(index, _)| !exclusive.contains(index));
        let least = others.map(|(_, task)| known(task)).min();
        let yields = |(index, task): (usize, &Task)| {
            index != of && exclusive.contains(&index) && least.is_none_or(|least| task.priority < least)
        };
        if !all().any(yields) {
            return None;
        }
        let tasks = self.all.iter().enumerate().map(|(index, task)| {
            let counts = may_delay(task) && !yields((index, task));
            Task { priority: if counts { task.priority } else { Priority::Background }, ..task.clone() }
        });
        let tasks: Vec<Task> = tasks.collect();
        match response_times(&tasks, options, interrupt).responses.get(of)?.bound {
            Bound::Response(time) => Some(time),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ChainBuffer, ChainRelease, Lock, LockUser, Method, Protocol, StateMachine};

    const OPTIONS: Options = Options { method: Method::Best, is_brief: false };

    fn ms(time: u64) -> Time {
        Time::from_nanos(time * 1_000_000)
    }

    /// The response times of the steps of a chain, tasks 1 to 5, after this change. (The offset example of pyCPA, after Palencia and
    /// González Harbour.)
    fn responses(change: &dyn Fn(&mut Tasks, &mut [ChainStep])) -> Option<Vec<u64>> {
        let of = [
            (9, 20, 4, 0),
            (5, 150, 20, 0),
            (5, 150, 25, 2),
            (5, 150, 15, 1),
            (5, 150, 34, 2),
            (5, 150, 30, 0),
        ];
        let task = |&(priority, period, cost, cpu): &(u32, u64, u64, u32)| Task {
            cpus: Some(CpuSet::of(cpu)),
            ..Task::new(priority, ms(period), StateMachine::single(ms(cost)))
        };
        let mut tasks: Vec<Task> = of.iter().chain(&[(9, 30, 5, 1)]).map(task).collect();
        tasks[2..6].iter_mut().for_each(|task| task.is_sporadic = true);
        let released = Some(ChainRelease { distance: None, by_data: true, others: None });
        let step = |task| ChainStep {
            task,
            writes: Some(1),
            released,
            ends_with_write: task < 5,
            ..ChainStep::default()
        };
        let (mut tasks, mut chain) = (Tasks::new(tasks), (1..6).map(step).collect::<Vec<_>>());
        change(&mut tasks, &mut chain);
        let found = tasks.response_times(&OPTIONS, &|| ());
        for step in &mut chain {
            let Bound::Response(response) = found.responses[step.task].bound else { panic!("no bound") };
            (step.response, step.write) = (response, response);
        }
        let apart = found.tasks.steps_apart(&chain, &OPTIONS, &|| ())?;
        Some(apart.iter().map(|step| step.response.as_nanos() / 1_000_000).collect())
    }

    #[test]
    fn the_steps_count_without_each_other() {
        // 20 + 2·4 and 30 + 2·4 on CPU 0, 15 + 5 on CPU 1.
        let apart = Some(vec![28, 25, 20, 34, 38]);
        assert_eq!(responses(&|_, _| ()), apart);
        // They end within 145.
        let with_period = |period| {
            responses(&|tasks, _| tasks.all[1..6].iter_mut().for_each(|task| task.period = Some(ms(period))))
        };
        assert_eq!((with_period(145), with_period(144)), (apart.clone(), None));
        assert_eq!(responses(&|tasks, _| tasks.locks = vec![lock(6)]), apart);
        // Linux keeps 50 from all: 20 + 50 + 5·4 and 30 + 50 + 5·4, while the chain may take 400.
        let throttled = responses(&|tasks, _| {
            tasks.all[1..6].iter_mut().for_each(|task| task.period = Some(ms(400)));
            let task = Task::new(0, ms(1000), StateMachine::single(ms(50)));
            tasks.all.push(Task { priority: Priority::Unknown, is_throttling: true, ..task });
        });
        assert_eq!(throttled, Some(vec![90, 25, 20, 34, 100]));
        // Two parts: only the first one has two steps on a CPU.
        let with_clock = responses(&|_, chain| chain[4].released = None);
        assert_eq!(with_clock, Some(vec![66, 25, 20, 34, 66]));
        // A step that goes on after its write counts for the other one on its CPU: 25 + 34 each.
        let with_rest = responses(&|tasks, chain| {
            tasks.all[1].period = Some(ms(300));
            chain[1].ends_with_write = false;
        });
        assert_eq!(with_rest, Some(vec![28, 59, 20, 59, 38]));
    }

    fn lock(task: usize) -> Lock {
        let users = vec![LockUser { task, held: Some(ms(1)) }];
        Lock { name: "map".into(), protocol: Protocol::None, users }
    }

    type Change = dyn Fn(&mut Tasks, &mut [ChainStep]);

    #[test]
    fn steps_that_may_delay_each_other() {
        let changes: &[&Change] = &[
            &|tasks, _| tasks.all[0].priority = Priority::RealTime(5),
            &|tasks, _| tasks.all[0].priority = Priority::Unknown,
            &|tasks, _| tasks.all[0].cpus = Some(CpuSet(0b1001)),
            &|tasks, _| tasks.all[1].thread = Some(1),
            &|tasks, _| tasks.all[1].has_calls = true,
            &|tasks, _| tasks.all[2].burst = 2,
            &|tasks, _| tasks.all[3].period = Some(ms(151)),
            &|tasks, _| tasks.all[4].is_sporadic = false,
            &|tasks, _| tasks.locks = vec![lock(0)],
            &|tasks, _| tasks.all[0].is_not_preempted = true,
            &|_, chain| chain[0].ends_with_write = false,
            &|_, chain| chain[3].released = None,
            &|_, chain| chain[3].released.as_mut().unwrap().by_data = false,
            &|_, chain| chain[3].released.as_mut().unwrap().others = Some(ms(1)),
            &|_, chain| chain[3].writes = None,
            &|_, chain| chain[3].writes = Some(2),
            &|_, chain| chain[3].buffer = Some(ChainBuffer { size: 2, reads: Some(1) }),
            &|_, chain| chain[3].is_call = true,
            &|_, chain| chain[3].task = 2,
        ];
        for (index, change) in changes.iter().enumerate() {
            assert_eq!(responses(*change), None, "{index}");
        }
    }
}
