//! For how long jobs of lower priority that hold a lock delay a task.
//!
//! All users of a lock have to run on one CPU. There, a job of lower priority executes while a task is busy only to leave a lock
//! that it took before, and only a lock that the task, or one of at least its priority, uses. With a ceiling, one job is within
//! such locks: B is the greatest time. With inheritance, each job is within one lock, and each lock is held by one job: B is the
//! lesser of the sums, by job and by lock. Without a protocol, this holds if no task has a priority between. The time of a ceiling lasts
//! as long as the job holds it or others that are no lower.
//!
//! A job that is not preempted is within a ceiling above all activities, from its begin to its end.
//!
//! While real-time tasks are throttled, the background executes, and may take its locks again: its part of B is counted apart, by
//! the sums. A task of unknown demand, and each that shares locks with it, directly or through others, holds its locks for an unknown
//! time: a job may wait for one lock while it holds another.

use std::collections::BTreeSet;

use crate::certificate::{CertifiedLock, CertifiedProtocol};
use crate::demand::{Checks, TaskDemand};
use crate::tasks::{CheckedTask, CheckedTasks};

/// The rank of priority 99.
const HIGHEST: u64 = 100;

impl CheckedTasks<'_> {
    /// Enters B of each task, and the priorities that users of locks on several CPUs may inherit.
    pub(crate) fn enter_blocking(&mut self, locks: &[CertifiedLock]) -> Checks<()> {
        for lock in locks {
            if lock.users.iter().any(|user| user.0 >= self.all.len()) {
                return Err(format!("lock {} has a user that does not exist", lock.name));
            }
            let inherits = lock.protocol != CertifiedProtocol::None && self.cpu_of(lock).is_none();
            let highest = self.ranks(lock).max().filter(|_| inherits).unwrap_or(0);
            for user in &lock.users {
                let of = &mut self.all[user.0];
                (of.has_locks, of.raised) = (true, of.raised.max(highest));
            }
        }
        let unknown = self.unknown_locks(locks)?;
        for task in 0..self.all.len() {
            self.all[task].blocking = self.blocking_of(task, locks, &unknown);
        }
        Ok(())
    }

    /// Returns the locks that are held for an unknown time.
    fn unknown_locks(&self, locks: &[CertifiedLock]) -> Checks<BTreeSet<usize>> {
        let shared = || locks.iter().enumerate().filter(|(_, lock)| lock.users.len() > 1);
        let is_unknown = |&(task, held): &(usize, Option<u64>)| {
            let of = &self.all[task];
            held.is_none() || of.rank > 0 && (of.demand.is_none() || of.period == 0)
        };
        let mut found = BTreeSet::new();
        let mut users: BTreeSet<usize> = BTreeSet::new();
        loop {
            let known = found.len();
            for (index, lock) in shared() {
                self.work.spend(lock.users.len())?;
                if lock.users.iter().any(|user| users.contains(&user.0) || is_unknown(user)) {
                    found.insert(index);
                    users.extend(lock.users.iter().map(|user| user.0));
                }
            }
            if found.len() == known {
                return Ok(found);
            }
        }
    }

    /// Returns the CPU that all users of a lock run on.
    fn cpu_of(&self, lock: &CertifiedLock) -> Option<u128> {
        let all = lock.users.iter().fold(0, |all, user| all | self.all[user.0].cpus);
        Some(all).filter(|it| it.is_power_of_two())
    }

    fn ranks<'l>(&'l self, lock: &'l CertifiedLock) -> impl Iterator<Item = u64> + 'l {
        let rank = |of: &CheckedTask<'_>| {
            if of.task.not_preempted && of.rank > 0 { of.rank.max(HIGHEST) } else { of.rank }
        };
        lock.users.iter().map(move |user| rank(&self.all[user.0]))
    }

    /// The users of a lock that may have a lower rank than this, each with the time that it holds the lock.
    fn below<'l>(
        &'l self,
        lock: &'l CertifiedLock,
        rank: u64,
    ) -> impl Iterator<Item = (usize, Option<u64>)> + 'l {
        let is_below = move |it: u64| it < rank || it == u64::MAX;
        lock.users.iter().filter(move |user| is_below(self.all[user.0].rank)).copied()
    }

    /// Returns B, and the part of it by the background.
    fn blocking_of(
        &self,
        task: usize,
        locks: &[CertifiedLock],
        unknown: &BTreeSet<usize>,
    ) -> Checks<(u64, u64)> {
        let of = &self.all[task];
        self.work.spend(locks.iter().map(|it| it.users.len() + 1).sum())?;
        let is_user =
            |lock: &&CertifiedLock| lock.users.len() > 1 && lock.users.iter().any(|user| user.0 == task);
        for lock in locks.iter().filter(is_user) {
            if self.cpu_of(lock).is_none() {
                return Err(format!("lock {} is used on several CPUs", lock.name));
            }
            self.work.spend(self.all.len() * lock.users.len())?;
            let mut holders = self.below(lock, of.rank).filter(|_| lock.protocol == CertifiedProtocol::None);
            if holders.any(|(holder, _)| self.is_preempted(task, holder)) {
                return Err(format!("lock {} is held by a job that others preempt", lock.name));
            }
        }
        let is_here = |it: &&CertifiedLock| self.cpu_of(it).is_some_and(|cpu| cpu & of.cpus != 0);
        let is_used_from = |lock: &CertifiedLock, rank: u64| self.ranks(lock).any(|it| it >= rank);
        // A job that holds a lock without a protocol keeps its rank: it is delayed by those with the locks of others above it.
        let unraised = locks.iter().filter(|it| it.protocol == CertifiedProtocol::None && is_here(it));
        let unraised = unraised.filter(|it| is_used_from(it, of.rank)).flat_map(|it| self.below(it, of.rank));
        let least = unraised.map(|user| self.all[user.0].rank).fold(of.rank, u64::min);
        let is_alone = of.is_pinned() && !self.is_as_one(task);
        let mut ceilings = self.not_preempted_below(task, is_alone)?;
        // Of those without a ceiling, and of those in the background.
        let mut sums = [(0u64, vec![0; self.all.len()]), (0, vec![0; self.all.len()])];
        for (index, lock) in locks.iter().enumerate().filter(|it| is_here(&it.1)) {
            let is_ceiling = lock.protocol == CertifiedProtocol::Ceiling;
            let from = [of.rank, if is_ceiling { least } else { of.rank }];
            let Some(rank) = from.into_iter().find(|it| is_used_from(lock, *it)) else { continue };
            let mut of_lock = [0, 0];
            for (holder, held) in self.below(lock, rank) {
                if !is_alone {
                    return Err(format!("lock {} may be held on another of its CPUs", lock.name));
                }
                let held = held.filter(|_| !unknown.contains(&index));
                let held =
                    held.ok_or_else(|| format!("for how long lock {} is held is unknown", lock.name))?;
                if is_ceiling {
                    ceilings = held.max(ceilings);
                }
                for (which, counts) in [!is_ceiling, self.all[holder].rank == 0].into_iter().enumerate() {
                    if counts {
                        of_lock[which] = held.max(of_lock[which]);
                        sums[which].1[holder] = held.max(sums[which].1[holder]);
                    }
                }
            }
            for ((by_lock, _), of_lock) in sums.iter_mut().zip(of_lock) {
                *by_lock = by_lock.saturating_add(of_lock);
            }
        }
        let [all, in_background] =
            sums.map(|(by_lock, by_task)| by_task.into_iter().fold(0, u64::saturating_add).min(by_lock));
        Ok((all.saturating_add(ceilings), in_background))
    }

    /// Returns for how long a job of lower priority delays a task since it is not preempted.
    fn not_preempted_below(&self, task: usize, is_alone: bool) -> Checks<u64> {
        let of = &self.all[task];
        let mut longest = 0;
        for it in self.all.iter().filter(|it| it.task.not_preempted && it.cpus & of.cpus != 0) {
            let is_below = (1..of.rank).contains(&it.rank) || it.rank == u64::MAX;
            if !is_below || of.rank > HIGHEST && of.rank != u64::MAX {
                continue;
            }
            let bounded = it.demand.as_ref().filter(|_| is_alone && it.is_pinned() && it.waits == 0);
            let bounded = bounded.map(TaskDemand::longest);
            longest = bounded.ok_or_else(|| format!("`{}` is not preempted", it.task.name))?.max(longest);
        }
        Ok(longest)
    }

    /// Whether others preempt `holder` while `task` waits for its lock without a protocol.
    fn is_preempted(&self, task: usize, holder: usize) -> bool {
        let (of, held_by) = (&self.all[task], &self.all[holder]);
        let is_between = |(index, it): (usize, &CheckedTask<'_>)| {
            let is_other = index != task && !held_by.thread.contains(&index);
            let is_above = it.raised >= held_by.rank || held_by.rank == u64::MAX;
            let is_below = it.raised < of.rank || it.raised == u64::MAX;
            is_other && is_above && is_below && it.cpus & held_by.cpus != 0
        };
        held_by.rank == 0 || self.all.iter().enumerate().any(is_between)
    }
}
