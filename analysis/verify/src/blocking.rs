//! For how long jobs of lower priority that hold a lock delay a task.
//!
//! All users of a lock have to run on one CPU. There, a job of lower priority executes while a task is busy only to leave a lock
//! that it took before, and only a lock that the task, or one of at least its priority, uses. With a ceiling, one job is within
//! such locks: B is the greatest time. With inheritance, each job is within one lock, and each lock is held by one job: B is the
//! lesser of the sums, by job and by lock. Without a protocol, this holds if no task has a priority between.

use crate::certificate::{Kind, Lock, Protocol};
use crate::demand::Check;
use crate::tasks::Tasks;

impl Tasks<'_> {
    /// Enters B of each task, and the priorities that users of locks on several CPUs may inherit.
    pub(crate) fn enter_blocking(&mut self, locks: &[Lock]) -> Check<()> {
        let users = locks.iter().flat_map(|lock| lock.users.iter().map(move |user| (lock, user.0)));
        if let Some((lock, _)) = users.clone().find(|(_, user)| *user >= self.all.len()) {
            return Err(format!("lock {} has a user that does not exist", lock.name));
        }
        for lock in locks.iter().filter(|it| it.protocol != Protocol::None && it.users.len() > 1) {
            if self.cpu_of(lock).is_none() {
                let highest = lock.users.iter().map(|it| self.all[it.0].rank).max().unwrap_or(0);
                for index in
                    lock.users.iter().flat_map(|it| self.all[it.0].thread.clone()).collect::<Vec<_>>()
                {
                    let of = &mut self.all[index];
                    of.raised = of.raised.max(highest);
                    // In the background too, it then delays others on its CPUs.
                    if of.rank == 0 && highest > 0 {
                        let cpu = |all: u128, cpu: &u32| all | 1u128.checked_shl(*cpu).unwrap_or(u128::MAX);
                        of.cpus = of.task.cpus.as_ref().map_or(u128::MAX, |it| it.iter().fold(0, cpu));
                    }
                }
            }
        }
        let found: Vec<Check<u64>> = (0..self.all.len()).map(|task| self.blocking_of(task, locks)).collect();
        self.all.iter_mut().zip(found).for_each(|(it, blocking)| it.blocking = blocking);
        Ok(())
    }

    /// Returns the CPU that all users of a lock run on.
    fn cpu_of(&self, lock: &Lock) -> Option<u128> {
        let cpus = |user: usize| {
            let of = self.all[user].task.cpus.as_ref()?;
            of.iter().try_fold(0u128, |all, cpu| Some(all | 1u128.checked_shl(*cpu)?))
        };
        let all = lock.users.iter().try_fold(0, |all, user| Some(all | cpus(user.0)?))?;
        Some(all).filter(|it| it.is_power_of_two())
    }

    /// Whether a user may have a lower priority than this.
    fn is_below(&self, user: usize, rank: u64) -> bool {
        self.all[user].rank < rank || rank > 0 && self.all[user].rank == u64::MAX
    }

    fn has_user_from(&self, lock: &Lock, rank: u64) -> bool {
        lock.users.iter().any(|user| self.all[user.0].rank >= rank)
    }

    fn blocking_of(&self, task: usize, locks: &[Lock]) -> Check<u64> {
        let of = &self.all[task];
        for lock in locks.iter().filter(|it| it.users.len() > 1 && it.users.iter().any(|user| user.0 == task))
        {
            if self.cpu_of(lock).is_none() {
                return Err(format!("lock {} is used on several CPUs", lock.name));
            }
            let below = lock.users.iter().map(|it| it.0).filter(|it| self.is_below(*it, of.rank));
            if lock.protocol == Protocol::None
                && below.into_iter().any(|holder| self.is_preempted(task, holder))
            {
                return Err(format!("lock {} is held by a job that others preempt", lock.name));
            }
        }
        if of.rank == 0 {
            return Ok(0);
        }
        let (mut ceilings, mut by_lock, mut by_task) = (0, 0u64, vec![0; self.all.len()]);
        let unraised = self.least_unraised(task, locks);
        let mut is_held = false;
        for lock in locks {
            let Some(cpu) = self.cpu_of(lock).filter(|cpu| cpu & of.cpus != 0) else { continue };
            let below = match (self.has_user_from(lock, of.rank), unraised) {
                (true, _) => of.rank,
                (_, Some(rank)) if lock.protocol == Protocol::Ceiling && self.has_user_from(lock, rank) => {
                    rank
                }
                _ => continue,
            };
            let mut of_lock = 0;
            for &(holder, held) in lock.users.iter().filter(|it| self.is_below(it.0, below)) {
                if of.cpus & !cpu != 0 || self.as_one(task).is_some() {
                    return Err(format!("lock {} may be held on another of its CPUs", lock.name));
                }
                let held =
                    held.ok_or_else(|| format!("for how long lock {} is held is unknown", lock.name))?;
                is_held |= held > 0;
                match lock.protocol {
                    Protocol::Ceiling => ceilings = held.max(ceilings),
                    _ => {
                        of_lock = held.max(of_lock);
                        by_task[holder] = held.max(by_task[holder]);
                    }
                }
            }
            by_lock = by_lock.saturating_add(of_lock);
        }
        let waits_often = |other: &crate::tasks::Member<'_>| {
            let times = other.task.machine.as_ref().and_then(|it| it.waits);
            other.rank >= of.rank && other.cpus & of.cpus != 0 && other.waits && times.is_none()
        };
        if is_held && self.all.iter().any(waits_often) {
            return Err("jobs take locks while others wait, any number of times".to_owned());
        }
        Ok(by_task.into_iter().fold(0, u64::saturating_add).min(by_lock).saturating_add(ceilings))
    }

    /// Returns the least rank of a job that holds a lock without a protocol and so may delay the task.
    fn least_unraised(&self, task: usize, locks: &[Lock]) -> Option<u64> {
        let of = &self.all[task];
        let is_one = |lock: &&Lock| {
            let cpu = self.cpu_of(lock).unwrap_or(0);
            lock.protocol == Protocol::None && cpu & of.cpus != 0 && self.has_user_from(lock, of.rank)
        };
        let users = locks.iter().filter(is_one).flat_map(|lock| &lock.users).map(|user| user.0);
        users.filter(|user| self.is_below(*user, of.rank)).map(|user| self.all[user].rank).min()
    }

    /// Whether others preempt `holder` while `task` waits for its lock without a protocol.
    fn is_preempted(&self, task: usize, holder: usize) -> bool {
        let (of, held_by) = (&self.all[task], &self.all[holder]);
        let is_between = |(index, it): (usize, &crate::tasks::Member<'_>)| {
            let is_other =
                index != task && !held_by.thread.contains(&index) && it.task.kind != Kind::Throttling;
            let is_above = it.raised >= held_by.rank || held_by.rank == u64::MAX;
            let is_below = it.raised < of.rank || it.raised == u64::MAX;
            is_other && is_above && is_below && it.cpus & held_by.cpus != 0
        };
        held_by.rank == 0 || self.all.iter().enumerate().any(is_between)
    }
}
