//! Locks: for how long a job of lower priority that holds one delays those of higher priority.
//!
//! Lock users are pinned to one CPU. There, a job of lower priority executes within the window of a task i only to leave a lock
//! that it took before the window began, because a job waits for this lock (or, with a ceiling, might). Which priority it then
//! has, and which locks count, depends on the [`Protocol`]:
//!
//! - With a *ceiling*, a job that holds a lock has the highest priority of all users of the lock. Only one job of lower priority
//!   can be within such locks when the window begins: B is the greatest of their times. (Where it goes from one to the next, the time of
//!   the one with the lowest ceiling contains that of the others.)
//! - With *inheritance*, it has the highest priority of the jobs that wait for the lock. Several may be within locks, each within
//!   one, and each lock is held by one: B is the lesser of Σ over the tasks of their greatest time, and Σ over the locks of the
//!   greatest time (L. Sha, R. Rajkumar, J. Lehoczky, "Priority Inheritance Protocols: An Approach to Real-Time
//!   Synchronization", IEEE Transactions on Computers 39, 1990).
//! - With *none* of them, it keeps its priority, and any task between the two delays both. Without such a task, B is that of
//!   inheritance; and a job of still lower priority delays both where it holds a lock with a ceiling that equals this priority.
//!
//! When a job leaves a lock, the job that has the CPU may take it, before one of lower priority that waits for it. (Linux lets a
//! higher priority take it first.)
//!
//! A job that is not preempted is one within a lock of its own with the highest ceiling, from its begin to its end. It takes its other
//! locks with that priority.
//!
//! A lock counts for i if i or a task of higher or equal priority uses it. While jobs of i or hp(i) wait, a job of lower priority
//! may take a lock again: see `Lane::blocking`.
//!
//! **Throttling.** While Linux throttles real-time tasks, the background executes, and may take a lock again: its part of B counts for
//! each throttling, and by the sums, whatever the protocol, since jobs with a ceiling are throttled too. If at the start of the window
//! the background is within a ceiling besides another job, a throttling has just ended, and its window has one less than is counted.
//!
//! **Unknown.** A task of unknown demand may hold its locks for ever. So may each of their other users, since it may wait for one of
//! them while it holds another: the time is unknown for all users of locks that users link.

use std::collections::BTreeMap;

use crate::not_preempted::HIGHEST;
use crate::response_time::linked_cpus;
use crate::{Blocking, CpuSet, Demand, Lock, LockUser, Method, Priority, Protocol, Task, Tasks, Time};

/// Σ over the locks, and Σ over the tasks, of the greatest time for which jobs hold a lock.
struct HeldTimes {
    of_locks: u64,
    of_lock: u64,
    of_tasks: Vec<u64>,
}

impl HeldTimes {
    fn add(&mut self, holder: usize, held: u64) {
        self.of_lock = held.max(self.of_lock);
        self.of_tasks[holder] = held.max(self.of_tasks[holder]);
    }

    fn end_lock(&mut self) {
        self.of_locks = self.of_locks.saturating_add(std::mem::take(&mut self.of_lock));
    }

    fn lesser_sum(&self) -> u64 {
        self.of_tasks.iter().copied().fold(0, u64::saturating_add).min(self.of_locks)
    }
}

/// A lock, and what all of its users have in common.
struct SharedLock<'a> {
    lock: &'a Lock,
    /// The CPU that all users run on; none if they are several, or unknown.
    cpus: Option<CpuSet>,
    /// The highest priority of a user.
    highest: Option<Priority>,
    /// The task whose jobs are within this lock from begin to end.
    whole_job_of: Option<usize>,
}

/// Returns the priority with which a task takes a lock, or waits for it.
fn priority_in_lock(task: &Task) -> Priority {
    let is_raised = task.is_not_preempted && task.priority.real_time().is_some();
    if is_raised { task.priority.max(HIGHEST) } else { task.priority }
}

impl Tasks {
    /// Returns the tasks, each with its [`Task::blocking`], and what the locks do to each of them. A task that cannot be bounded
    /// has unknown demand.
    pub(crate) fn with_blocking(self) -> (Vec<Task>, Vec<Blocking>) {
        let of_jobs = self.locks_of_jobs();
        if self.locks.is_empty() && of_jobs.is_empty() {
            return (self.all, Vec::new());
        }
        let raised = self.raised();
        let linked = linked_cpus(&raised);
        let unknown = self.unknown_holders();
        let whole_jobs = of_jobs.iter().map(|(task, lock)| SharedLock {
            highest: Some(HIGHEST),
            whole_job_of: Some(*task),
            ..self.shared(lock)
        });
        let locks: Vec<SharedLock<'_>> =
            self.locks.iter().map(|it| self.shared(it)).chain(whole_jobs).collect();
        let mut of_tasks: Vec<Vec<usize>> = vec![Vec::new(); raised.len()];
        for (lock, Lock { users, .. }) in self.locks.iter().enumerate().filter(|(_, it)| it.users.len() > 1) {
            for user in users {
                of_tasks.get_mut(user.task).into_iter().for_each(|it| it.push(lock));
            }
        }
        let numbered = of_tasks.iter().enumerate();
        let found =
            numbered.map(|(of, its)| self.blocking_of(of, its, linked[of], &raised, &unknown, &locks));
        let found: Vec<Blocking> = found.collect();
        let mut tasks = raised;
        // A job that waits for a lock is delayed after its begin.
        for (task, its) in tasks.iter_mut().zip(&of_tasks) {
            task.is_not_preempted &= its.is_empty();
        }
        for (task, blocking) in tasks.iter_mut().zip(&found) {
            match blocking {
                Blocking::Time(time, in_background) => {
                    (task.blocking, task.background_blocking) = (*time, *in_background);
                }
                _ => task.demand = Demand::Unknown,
            }
        }
        (tasks, found)
    }

    /// Returns the tasks whose jobs are not preempted, each with the lock that its jobs are within.
    pub(crate) fn locks_of_jobs(&self) -> Vec<(usize, Lock)> {
        let all = self.all.iter().enumerate();
        let is_it = |task: &Task| task.is_not_preempted && task.priority != Priority::Background;
        let lock = |(index, task): (usize, &Task)| {
            // While a job waits, others execute, and it delays them again when it goes on.
            let held = task.demand.own(Method::Classic).filter(|_| task.waits.is_none());
            let users = vec![LockUser { task: index, held }];
            (index, Lock { name: task.name.clone(), protocol: Protocol::Ceiling, users })
        };
        all.filter(|(_, task)| is_it(task)).map(lock).collect()
    }

    /// Returns the locks whose users may hold them for an unknown time, each with the task for which that is so.
    fn unknown_holders(&self) -> BTreeMap<usize, usize> {
        let shared = || self.locks.iter().enumerate().filter(|(_, lock)| lock.users.len() > 1);
        let is_unknown =
            |user: &&LockUser| user.held.is_none() || self.all.get(user.task).is_none_or(Task::is_unknown);
        let (mut found, mut of_users) = (BTreeMap::new(), BTreeMap::<usize, usize>::new());
        loop {
            let known = found.len();
            for (lock, Lock { users, .. }) in shared() {
                let itself = users.iter().find(is_unknown).map(|user| user.task);
                let linked = || users.iter().find_map(|user| of_users.get(&user.task).copied());
                if let Some(task) = itself.or_else(linked).filter(|_| !found.contains_key(&lock)) {
                    found.insert(lock, task);
                    of_users.extend(users.iter().map(|user| (user.task, task)));
                }
            }
            if found.len() == known {
                return found;
            }
        }
    }

    /// Returns the tasks, where the users of a lock on several CPUs have the highest priority of all of them: that is what they may
    /// inherit while they hold it, to delay others on their CPUs.
    fn raised(&self) -> Vec<Task> {
        let mut raised = self.all.clone();
        for Lock { protocol, users, .. } in &self.locks {
            if *protocol == Protocol::None || users.len() < 2 || self.cpus_of(users).is_some() {
                continue;
            }
            let priority = |user: &LockUser| Some(priority_in_lock(self.all.get(user.task)?));
            let highest = users.iter().filter_map(priority).max().unwrap_or_default();
            for (index, task) in raised.iter_mut().enumerate() {
                // With the tasks of their threads.
                let is_it = |user: &LockUser| {
                    let shares_thread = |it: &Task| it.shares_thread(&self.all[index]);
                    user.task == index || self.all.get(user.task).is_some_and(shares_thread)
                };
                if users.iter().any(is_it) {
                    task.priority = highest.max(task.priority);
                }
            }
        }
        raised
    }

    fn blocking_of(
        &self,
        of: usize,
        its: &[usize],
        linked: Option<CpuSet>,
        raised: &[Task],
        unknown: &BTreeMap<usize, usize>,
        locks: &[SharedLock<'_>],
    ) -> Blocking {
        let Some(task) = self.all.get(of) else { return Blocking::Time(Time::ZERO, Time::ZERO) };
        for &lock in its {
            let SharedLock { lock: Lock { protocol, users, .. }, cpus, .. } = &locks[lock];
            if cpus.is_none() {
                return Blocking::SeveralCpus { lock };
            }
            let held_below = users.iter().filter(|user| self.is_below(user.task, task));
            if *protocol == Protocol::None
                && let Some((holder, between)) =
                    held_below.filter_map(|user| self.between(of, user.task, raised)).next()
            {
                return Blocking::Inversion { lock, holder, between };
            }
        }
        if task.priority == Priority::Background {
            return Blocking::Time(Time::ZERO, Time::ZERO);
        }
        self.time_of(of, task, linked, unknown, locks)
    }

    /// B of the task `of`.
    fn time_of(
        &self,
        of: usize,
        task: &Task,
        linked: Option<CpuSet>,
        unknown: &BTreeMap<usize, usize>,
        locks: &[SharedLock<'_>],
    ) -> Blocking {
        // With a ceiling: the greatest. Otherwise by lock, and by task.
        let sums = || HeldTimes { of_locks: 0, of_lock: 0, of_tasks: vec![0; self.all.len()] };
        let (mut of_ceilings, mut others, mut in_background) = (0, sums(), sums());
        let (mut first_lock, mut first_job) = (None, None);
        let unraised = self.least_unraised(task, locks);
        for (lock, shared) in locks.iter().enumerate() {
            let Lock { protocol, users, .. } = shared.lock;
            let is_unbounded = shared.whole_job_of.filter(|_| shared.cpus.is_none());
            if let Some(holder) = is_unbounded.filter(|it| *it != of && self.meets(*it, task)) {
                return Blocking::NotPreempted { holder };
            }
            // Locks that are used on other CPUs, or on several, where nothing is analysed.
            let Some(cpus) = shared.cpus.filter(|cpus| cpus.meets(task.cpus())) else { continue };
            let below = match shared.highest >= Some(task.priority) {
                true => task,
                // A ceiling may be that of a lower priority that holds a lock without a protocol.
                false => match unraised.filter(|it| shared.highest >= Some(it.priority)) {
                    Some(holder) if *protocol == Protocol::Ceiling => holder,
                    _ => continue,
                },
            };
            for &LockUser { task: holder, held } in users.iter().filter(|it| self.is_below(it.task, below)) {
                let migrates = linked.is_some() || !(task.cpus() - cpus).is_empty();
                if shared.whole_job_of.is_some() && (migrates || held.is_none()) {
                    return Blocking::NotPreempted { holder };
                }
                if migrates {
                    return Blocking::Migrates { lock };
                }
                let held = match (unknown.get(&lock), held) {
                    (None, Some(held)) => held.as_nanos(),
                    (because, _) => {
                        let because = because.copied().unwrap_or(holder);
                        return Blocking::UnknownTime { lock, holder, because };
                    }
                };
                match shared.whole_job_of {
                    Some(holder) => first_job = first_job.or(Some(holder)),
                    None => first_lock = first_lock.or(Some(lock).filter(|_| held > 0)),
                }
                if self.is_in_background(holder) {
                    in_background.add(holder, held);
                }
                match protocol {
                    Protocol::Ceiling => of_ceilings = held.max(of_ceilings),
                    Protocol::Inheritance | Protocol::None => others.add(holder, held),
                }
            }
            others.end_lock();
            in_background.end_lock();
        }
        let [blocking, in_background] = [&others, &in_background].map(HeldTimes::lesser_sum);
        let blocking = blocking.saturating_add(of_ceilings);
        let interferes = |other: &Task| other.priority >= task.priority && other.cpus().meets(task.cpus());
        let waits_often = |other: &Task| {
            interferes(other) && other.waits.as_ref().is_some_and(|waits| waits.times.is_none())
        };
        let mut waiting = std::iter::once(of).chain(0..self.all.len());
        match (waiting.find(|&it| self.all.get(it).is_some_and(waits_often)), first_lock, first_job) {
            (Some(waiting), Some(lock), _) => Blocking::UnknownWaits { lock, waiting },
            (Some(_), None, Some(holder)) => Blocking::NotPreempted { holder },
            _ => Blocking::Time(Time::from_nanos(blocking), Time::from_nanos(in_background)),
        }
    }

    fn is_in_background(&self, task: usize) -> bool {
        self.all.get(task).is_some_and(|it| it.priority == Priority::Background)
    }

    /// Returns the task of least priority that may delay `task` while it holds a lock without a protocol.
    fn least_unraised(&self, task: &Task, locks: &[SharedLock<'_>]) -> Option<&Task> {
        let is_without = |it: &&SharedLock<'_>| {
            it.lock.protocol == Protocol::None
                && it.cpus.is_some_and(|cpus| cpus.meets(task.cpus()))
                && it.highest >= Some(task.priority)
        };
        let users = locks.iter().filter(is_without).flat_map(|it| &it.lock.users);
        let below = users.filter(|user| self.is_below(user.task, task));
        below.filter_map(|user| self.all.get(user.task)).min_by_key(|holder| holder.priority)
    }

    fn shared<'a>(&self, lock: &'a Lock) -> SharedLock<'a> {
        let priorities =
            lock.users.iter().filter_map(|user| Some(priority_in_lock(self.all.get(user.task)?)));
        let highest = priorities.max();
        SharedLock { lock, cpus: self.cpus_of(&lock.users), highest, whole_job_of: None }
    }

    fn meets(&self, other: usize, task: &Task) -> bool {
        self.all.get(other).is_some_and(|other| other.cpus().meets(task.cpus()))
    }

    /// Returns the CPU that all users of a lock run on; `None` if they are several, or unknown.
    fn cpus_of(&self, users: &[LockUser]) -> Option<CpuSet> {
        let cpus = |user: &LockUser| self.all.get(user.task)?.cpus;
        let all: CpuSet = users.iter().map(cpus).collect::<Option<_>>()?;
        Some(all).filter(|cpus| cpus.is_one())
    }

    /// Whether the task `other` may have a lower priority than `task`.
    fn is_below(&self, other: usize, task: &Task) -> bool {
        self.all.get(other).is_some_and(|other| {
            other.priority < task.priority
                || task.priority != Priority::Background && other.priority == Priority::Unknown
        })
    }

    /// Returns the tasks that preempt `holder` while it holds a lock that the task `of` waits for. `None` if there are none.
    fn between(&self, of: usize, holder: usize, raised: &[Task]) -> Option<(usize, Vec<usize>)> {
        let (task, held_by) = (self.all.get(of)?, self.all.get(holder)?);
        if self.is_in_background(holder) {
            return Some((holder, Vec::new()));
        }
        let is_between = |&(index, it): &(usize, &Task)| {
            let is_in = it.priority >= held_by.priority || held_by.priority == Priority::Unknown;
            let is_below = it.priority < task.priority || it.priority == Priority::Unknown;
            // Throttling delays all, and so is no more between than any other task of higher priority.
            let is_other = index != of && index != holder && !it.is_throttling;
            // The thread of the holder executes no other job before that of the holder.
            let is_other = is_other && !held_by.shares_thread(it);
            is_other && is_in && is_below && it.cpus().meets(held_by.cpus())
        };
        let between: Vec<usize> =
            raised.iter().enumerate().filter(is_between).map(|(index, _)| index).collect();
        (!between.is_empty()).then_some((holder, between))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::testing::simple;
    use crate::{StateMachine, Waits};

    fn lock(protocol: Protocol, users: &[(usize, Option<u64>)]) -> Lock {
        let user = |&(task, held): &(usize, Option<u64>)| LockUser { task, held: held.map(Time::from_nanos) };
        Lock { name: "bus".into(), protocol, users: users.iter().map(user).collect() }
    }

    fn blocking(tasks: Vec<Task>, locks: &[Lock]) -> Vec<Blocking> {
        Tasks { locks: locks.to_vec(), ..Tasks::new(tasks) }.with_blocking().1
    }

    fn time(time: u64) -> Blocking {
        Blocking::Time(Time::from_nanos(time), Time::ZERO)
    }

    /// The second task uses no lock.
    fn three() -> Vec<Task> {
        vec![simple(3, 100, 10), simple(2, 100, 10), simple(1, 100, 10), simple(1, 100, 10)]
    }

    #[test]
    fn the_greatest_time_or_the_sums() {
        let users = [(0, Some(1)), (2, Some(5)), (3, Some(7))];
        let others = [(0, Some(1)), (3, Some(4))];
        let locks = |protocol| [lock(protocol, &users), lock(protocol, &others)];
        assert_eq!(blocking(three(), &locks(Protocol::Ceiling)), [time(7), time(7), time(0), time(0)]);
        // By lock: 7 + 4. By task: 5 + 7.
        assert_eq!(blocking(three(), &locks(Protocol::Inheritance)), [time(11), time(11), time(0), time(0)]);
    }

    #[test]
    fn a_task_between_preempts_a_holder_without_a_protocol() {
        let locks = [lock(Protocol::None, &[(0, Some(1)), (2, Some(5))])];
        let between = |between: Vec<usize>| Blocking::Inversion { lock: 0, holder: 2, between };
        assert_eq!(blocking(three(), &locks)[0], between(vec![1, 3]));
        let mut tasks = three();
        tasks.truncate(3);
        tasks[1].priority = Priority::RealTime(3);
        assert_eq!(blocking(tasks.clone(), &locks), [time(5), time(5), time(0)]);
        // Throttling is above all of them.
        let throttled =
            Tasks { locks: locks.to_vec(), ..Tasks::new(tasks.clone()).with_platform(Vec::new(), true) };
        assert_eq!(throttled.with_blocking().1[..3], [time(5), time(5), time(0)]);
        tasks[2].priority = Priority::Background;
        assert_eq!(blocking(tasks, &locks)[0], between(Vec::new()));
    }

    #[test]
    fn the_background_takes_locks_while_tasks_are_throttled() {
        let background = |mut task: Task| {
            task.priority = Priority::Background;
            task
        };
        let tasks = vec![
            simple(3, 100, 10),
            simple(2, 100, 10),
            background(simple(0, 100, 0)),
            background(simple(0, 100, 0)),
        ];
        let both = [(0, Some(1)), (1, Some(5)), (2, Some(4)), (3, Some(3))];
        let other = [(0, Some(1)), (3, Some(2))];
        for (protocol, is_throttled, expected) in [
            // The greatest; by lock, 5 + 2, the part of the background 4 + 2.
            (Protocol::Ceiling, false, (5, 6)),
            (Protocol::Inheritance, false, (7, 6)),
            (Protocol::Inheritance, true, (7, 6)),
            (Protocol::Ceiling, true, (5, 6)),
        ] {
            let locks = vec![lock(protocol, &both), lock(protocol, &other)];
            let set = Tasks { locks, ..Tasks::new(tasks.clone()).with_platform(Vec::new(), is_throttled) };
            let [all, part] = [expected.0, expected.1].map(Time::from_nanos);
            assert_eq!(set.with_blocking().1[0], Blocking::Time(all, part), "{protocol:?} {is_throttled}");
        }
    }

    #[test]
    fn a_refused_task_leaves_no_bound_to_those_that_locks_link() {
        // The third task shares a lock with the first, and another with the last.
        let tasks = || vec![simple(4, 100, 10), simple(3, 100, 10), simple(2, 100, 10), simple(1, 100, 10)];
        let locks = [
            lock(Protocol::Ceiling, &[(0, Some(1)), (2, Some(5))]),
            lock(Protocol::Ceiling, &[(2, Some(1)), (3, Some(4))]),
        ];
        assert_eq!(blocking(tasks(), &locks), [time(5), time(5), time(4), time(0)]);
        let unknown =
            |lock: usize, holder: usize, because: usize| Blocking::UnknownTime { lock, holder, because };
        let expected = [unknown(0, 2, 3), unknown(0, 2, 3), unknown(1, 3, 3), time(0)];
        let mut set = Tasks { locks: locks.to_vec(), ..Tasks::new(tasks()) };
        set.refuse(3);
        assert_eq!(set.with_blocking().1, expected);
        // In the background, a task has no demand.
        let mut set = Tasks { locks: locks.to_vec(), ..Tasks::new(tasks()) };
        (set.all[3].priority, set.all[3].demand) = (Priority::Background, Demand::Unknown);
        let in_background = Blocking::Time(Time::from_nanos(4), Time::from_nanos(4));
        assert_eq!(set.clone().with_blocking().1, [time(5), time(5), in_background, time(0)]);
        set.refuse(3);
        assert_eq!(set.with_blocking().1, expected);
    }

    #[test]
    fn what_is_not_analysed() {
        let unknown = [lock(Protocol::Ceiling, &[(0, None), (2, None)])];
        let is_unknown = Blocking::UnknownTime { lock: 0, holder: 2, because: 0 };
        assert_eq!(blocking(three(), &unknown), [is_unknown.clone(), is_unknown, time(0), time(0)]);
        let locks = [lock(Protocol::Ceiling, &[(0, Some(1)), (2, Some(5))])];
        let mut tasks = three();
        tasks[1].cpus = Some(CpuSet(0b11));
        assert_eq!(blocking(tasks.clone(), &locks)[..2], [time(5), Blocking::Migrates { lock: 0 }]);
        tasks[2].cpus = Some(CpuSet(0b10));
        let several = Blocking::SeveralCpus { lock: 0 };
        assert_eq!(blocking(tasks, &locks), [several.clone(), time(0), several, time(0)]);
        let mut tasks = three();
        let (executed, times) = (StateMachine::single(Time::from_nanos(10)), None);
        tasks[1].waits = Some(Arc::new(Waits { executed, times }));
        let often = Blocking::UnknownWaits { lock: 0, waiting: 1 };
        assert_eq!(blocking(tasks, &locks)[..2], [time(5), often]);
    }

    #[test]
    fn a_holder_on_several_cpus_has_the_highest_priority_of_the_users() {
        let mut tasks = three();
        tasks[0].cpus = Some(CpuSet(0b10));
        let locks = [
            lock(Protocol::None, &[(2, Some(1)), (3, Some(1))]),
            lock(Protocol::Inheritance, &[(0, Some(1)), (2, Some(5))]),
        ];
        let raised = Tasks { locks: locks.to_vec(), ..Tasks::new(tasks) }.with_blocking().0;
        assert_eq!(raised[2].priority, Priority::RealTime(3));
        assert_eq!(raised[1].priority, Priority::RealTime(2));
    }
}
