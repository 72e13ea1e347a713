//! The greatest latency of data along a chain of tasks.
//!
//! A change in the world, or a write, is seen by a task in one of its next N jobs after the one in progress: that one started
//! before, so that its nominal release is before, and the job that writes what it saw is released N periods later at most. It has
//! written W after that. So the latency is N₁·T₁ + Σ (W of the task before + N·T) + W of the last task (Davare et al., DAC 2007,
//! with N = 1 and W = R). Every step but the last must keep: no later write carries less. Then the same time bounds how old what an
//! effect shows may become until it is replaced: what is older than the latency has been overwritten by something newer.
//!
//! **Priorities.** If the writer has a higher priority than the reader, both on one CPU, and neither waits nor takes locks, no job
//! of the reader starts between the release of the writer and its write. So the job in progress at the write started before that
//! release, J after the nominal one at most: J replaces W (compare Dürr et al., CASES 2019, who take W where it exceeds T).
//!
//! **Threads.** One thread executes the jobs of its tasks one after another, and no job of a later period before all of this one have
//! ended. So what a task writes is read by the job of a later task that is released with its own, and by the next job of an earlier one:
//! from release to release, 0 or exactly T.
//!
//! **Buffers.** See [`Tasks::ahead`].
//!
//! **Synchronised clocks.** The releases of tasks with an offset are known: the first job of the reader that is nominally released
//! at W after the writer's release or later sees the write; on different CPUs, strictly later, as either may be first at one
//! instant. A later write is not seen by an earlier job, so the latest instants give the greatest latency from each release of the
//! first task; their pattern repeats with the common multiple of the periods. Where a clock is not synchronised, a new stretch
//! begins, and the latencies add up (Günzel et al., RTAS 2021).
//!
//! **Triggers.** Data at the trigger port of a task releases it: see `trigger.rs`. The wait for the next release is not a period then.
//! Other ports of such a task, and its further releases, wait for the most time between two releases, if that has a bound.
//!
//! **Age at a write.** A job of the last task that reads something older than the change started before the write of the task
//! before it was visible: its nominal release is a period before the first job that sees the change. What it read is written D
//! periods later at most.
//!
//! ```
//! use mauve_timing::*;
//!
//! let ms = |time: u64| Time::from_nanos(time * 1_000_000);
//! let task = |priority, period| Task::new(priority, ms(period), StateMachine::single(ms(1)));
//! let tasks = Tasks::new(vec![task(2, 10), task(1, 20)]);
//! let step = |task, response| ChainStep {
//!     task,
//!     releases: 1,
//!     periods: Some(0),
//!     write: ms(response),
//!     response: ms(response),
//!     gap: Some(1),
//!     ..ChainStep::default()
//! };
//! let chain = [step(0, 1), step(1, 2)];
//! assert_eq!(tasks.latency(&chain, false).unwrap().latency, ms(10 + 1 + 20 + 2));
//! assert_eq!(tasks.latency(&chain, true).unwrap().latency, ms(10 + 20 + 2));
//! ```

use crate::time::least_common_multiple;
use crate::trigger::{ChainRelease, Distance, is_paced};
use crate::{CpuSet, Priority, Task, Tasks, Time};

/// The maximum number of jobs that are followed along a chain of synchronised tasks.
const MOST_JOBS: u64 = 1 << 16;

/// A task that data passes through.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct ChainStep {
    /// Its index in the tasks.
    pub task: usize,
    /// N: the most releases from the arrival of data to the job that writes it, or newer data; at least 1.
    pub releases: u32,
    /// D: the most periods from a read to the write that carries what was read.
    pub periods: Option<u32>,
    /// W: the greatest time from the nominal release of that job to the end of the write; at most the response time.
    pub write: Time,
    /// R: its response time.
    pub response: Time,
    /// The most releases until the next write of the port that the next step reads; none without a bound.
    pub gap: Option<u32>,
    /// The connection to it has a buffer.
    pub buffer: Option<ChainBuffer>,
    /// The most writes of the port before it in one job of the step before; none if that is not known, or if the buffer before a task
    /// that data releases may keep what released its first job: then it may be full.
    pub writes: Option<u32>,
    /// How data releases it; none where a clock does.
    pub released: Option<ChainRelease>,
    /// Whether it is an operation that the step before calls: a call does not arrive as data at a port does.
    pub is_call: bool,
    /// Whether each job that writes the port that the next step reads executes nothing after that.
    pub ends_with_write: bool,
}

/// The buffer of a connection. A write into a full one drops its oldest value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ChainBuffer {
    /// The number of values that it holds.
    pub size: u32,
    /// A: the most releases until the next read of the port; none without a bound.
    pub reads: Option<u32>,
}

/// The latency of a chain, by step. It is the sum of all parts of all steps.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct ChainLatency {
    /// The time from a change to the end of the first effect that shows it; if every step keeps, also how old what an effect shows
    /// may become until the next one.
    pub latency: Time,
    /// How old what an effect shows may be when it happens.
    pub age_at_write: Option<Time>,
    /// One for each step.
    pub parts: Vec<ChainPart>,
}

/// What a step adds to a latency.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ChainPart {
    /// From the write before it, or the change, to its next release.
    pub wait: Time,
    /// Until older values in a buffer are read, or dropped.
    pub buffer: Time,
    /// The further periods, if the first one does not write the data.
    pub periods: Time,
    /// From the release of that period to its write; 0 where the next step waits for that in any case.
    pub run: Time,
    /// What the next step may rely on.
    pub rule: ChainRule,
    /// Whether the buffer before it stays full, so that writes are lost: they are more frequent than its periods. (A read in each
    /// period is assumed.)
    pub stays_full: bool,
    /// Whether the data itself releases the step, so that it does not wait for a period.
    pub by_data: bool,
}

/// Why a release of a reader sees what a job of a writer wrote.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum ChainRule {
    /// It is after the write.
    #[default]
    AfterWrite,
    /// It is after the release of the writer, which has a higher priority on the same CPU, and does not wait.
    HigherPriority,
    /// One thread executes both, the writer before the reader: the same release.
    SameJob,
    /// One thread executes both, the reader before the writer: the next release.
    NextJob,
}

/// Why a chain has no latency: the step, by its index, and the reason.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NoLatency {
    /// The task has no period, or is not real-time.
    NoPeriod(usize),
    /// The task is not released by a clock: nothing bounds the time until its next release.
    NotPeriodic(usize),
    /// The reads of the buffer have no bound.
    NotRead(usize),
    /// The time is too long.
    TooLong,
}

impl ChainPart {
    fn total(&self) -> Option<u64> {
        let parts = [self.wait, self.buffer, self.periods, self.run].map(Time::as_nanos);
        parts.into_iter().try_fold(0u64, u64::checked_add)
    }
}

/// A step whose releases are to be followed; times in nanoseconds.
struct ReleasedStep {
    period: u64,
    /// The most time from a change, or from `run` after the release of the step before, to the first release that sees the data.
    wait: u64,
    /// The instant of a release, and the clock.
    offset: Option<(u64, u32)>,
    ahead: Ahead,
    /// The time of the releases that read what is ahead of the data.
    reads: u64,
    /// From the release of the job that reads the data to the release of the job that writes it.
    periods: u64,
    /// The time from the release of the job that writes to the first release of the next step that sees the write.
    run: u64,
    rule: ChainRule,
    /// Whether that also holds for a release at exactly this instant, of the next step.
    is_seen_at_once: bool,
    by_data: bool,
}

/// How long older values in a buffer keep a reader from data.
#[derive(Clone, Copy, Default)]
struct Ahead {
    /// The releases that read them.
    releases: u64,
    /// The time until writes have dropped them.
    delay: u64,
    stays_full: bool,
}

impl Tasks {
    /// Returns the greatest latency of data along the `chain`, if it is sampled after all tasks began with empty buffers. Without
    /// `uses_priorities`, priorities do not matter.
    ///
    /// # Errors
    ///
    /// There is no bound.
    pub fn latency(&self, chain: &[ChainStep], uses_priorities: bool) -> Result<ChainLatency, NoLatency> {
        let mut before: Option<&ChainStep> = None;
        let mut steps: Vec<ReleasedStep> = Vec::with_capacity(chain.len());
        for (index, step) in chain.iter().enumerate() {
            let mut found = self.step(index, before, step)?;
            if let (Some(writer), Some(last)) = (before, steps.last_mut()) {
                self.relate(last, &mut found, (writer, step), uses_priorities);
                if found.by_data {
                    self.wait_for_data(last, &mut found, writer, step);
                }
            }
            steps.push(found);
            before = Some(step);
        }
        let parts = follow(&steps).ok_or(NoLatency::TooLong)?;
        let age_at_write = chain.last().zip(parts.last()).and_then(|(step, last)| {
            let (task, period) = self.real_time(step)?;
            let until_read = parts.iter().try_fold(0u64, |sum, part| sum.checked_add(part.total()?))?;
            // The time between the releases of two jobs: the last one with the old data, and the first one with the new data.
            let since = match task.is_periodic() {
                true => period,
                false if last.buffer == Time::ZERO => last.wait.as_nanos(),
                false => 0,
            };
            let of_last = [last.periods.as_nanos(), last.run.as_nanos(), since];
            let until_read = of_last.into_iter().try_fold(until_read, u64::checked_sub)?;
            let shown =
                self.further(step, u64::from(step.periods?), false)?.checked_add(step.write.as_nanos())?;
            Some(Time::from_nanos(until_read.checked_add(shown)?))
        });
        let latency = parts.iter().try_fold(0u64, |sum, part| sum.checked_add(part.total()?));
        let latency = Time::from_nanos(latency.ok_or(NoLatency::TooLong)?);
        Ok(ChainLatency { latency, age_at_write, parts })
    }

    /// Returns a step after `before`, for which the writes of no priority count.
    fn step(
        &self,
        index: usize,
        before: Option<&ChainStep>,
        step: &ChainStep,
    ) -> Result<ReleasedStep, NoLatency> {
        let (task, period) = self.real_time(step).ok_or(NoLatency::NoPeriod(index))?;
        let spacing = match before {
            Some(_) => self.spacing(step),
            None => self.distance(step).and_then(|it| Some(it.greatest()?.as_nanos())),
        };
        let spacing = spacing.ok_or(NoLatency::NotPeriodic(index))?;
        let ahead = match (before, step.buffer) {
            (Some(writer), Some(buffer)) => self.ahead((index, spacing), writer, step, buffer)?,
            _ => Ahead::default(),
        };
        let releases = u64::from(step.releases.max(1));
        let by_data = before.is_some() && is_by_data(task, step);
        if releases > 1 && self.distance(step).is_none() {
            return Err(NoLatency::NotPeriodic(index));
        }
        Ok(ReleasedStep {
            period,
            wait: spacing,
            offset: task.offset.filter(|_| task.is_periodic()).map(|it| (it.as_nanos(), task.clock)),
            ahead,
            reads: ahead.releases.checked_mul(spacing).ok_or(NoLatency::TooLong)?,
            periods: self.further(step, releases - 1, !by_data).ok_or(NoLatency::TooLong)?,
            run: step.write.as_nanos(),
            rule: ChainRule::AfterWrite,
            is_seen_at_once: false,
            by_data,
        })
    }

    fn real_time(&self, step: &ChainStep) -> Option<(&Task, u64)> {
        let task = self.all.get(step.task).filter(|task| task.priority != Priority::Background)?;
        Some((task, task.period.filter(|period| *period > Time::ZERO)?.as_nanos()))
    }

    /// Returns the time between its releases.
    fn distance(&self, step: &ChainStep) -> Option<Distance> {
        let (task, period) = self.real_time(step)?;
        let of_clock = Distance { each: Time::from_nanos(period), late: Time::ZERO };
        if task.is_periodic() { Some(of_clock) } else { step.released?.distance }
    }

    /// Returns the most time of so many releases more. The last one was `late` already, as late as it may be.
    fn further(&self, step: &ChainStep, releases: u64, is_late: bool) -> Option<u64> {
        if releases == 0 {
            return Some(0);
        }
        let Distance { each, late } = self.distance(step)?;
        let late = if is_late { Time::ZERO } else { late };
        Some(each.checked_mul(releases)?.checked_add(late)?.as_nanos())
    }

    /// Returns the most time from a release to the next one while data is at the port, unread.
    fn spacing(&self, step: &ChainStep) -> Option<u64> {
        let (task, period) = self.real_time(step)?;
        if is_by_data(task, step) {
            let awaited = others(step).map(|it| it.saturating_add(step.response.as_nanos()));
            return Some(period.max(step.response.as_nanos()).max(awaited.unwrap_or_default()));
        }
        Some(self.distance(step)?.greatest()?.as_nanos())
    }

    /// Enters what a release of the reader, the step `next`, relies on.
    fn relate(
        &self,
        step: &mut ReleasedStep,
        next: &mut ReleasedStep,
        (writer, reader): (&ChainStep, &ChainStep),
        uses_priorities: bool,
    ) {
        let (Some(from), Some(to)) = (self.all.get(writer.task), self.all.get(reader.task)) else { return };
        if writer.task != reader.task && from.is_mate(to) && !reader.is_call {
            step.run = 0;
            if writer.task < reader.task {
                (step.rule, step.is_seen_at_once, next.wait) = (ChainRule::SameJob, true, 0);
            } else {
                step.rule = ChainRule::NextJob;
            }
            return;
        }
        step.is_seen_at_once = from.cpus == to.cpus && from.cpus.is_some_and(CpuSet::is_one);
        // What is in the buffer before data may be written by other statements, later in their jobs.
        if reader.buffer.is_some() {
            step.run = writer.response.as_nanos();
        }
        // While a job of its thread waits, or a lock delays one, the reader may run before the writer.
        let is_of_thread = |index: usize| {
            let mate = self.all.get(index).and_then(|it| it.thread);
            index == writer.task || mate.is_some() && mate == from.thread
        };
        let takes_locks = self.locks.iter().any(|lock| lock.users.iter().any(|user| is_of_thread(user.task)));
        let waits = (0..self.all.len())
            .any(|it| is_of_thread(it) && self.all.get(it).is_some_and(|it| it.waits.is_some()));
        let is_higher =
            from.priority.real_time() > to.priority.real_time() && to.priority.real_time().is_some();
        if uses_priorities && step.is_seen_at_once && is_higher && !waits && !takes_locks {
            step.run = step.run.min(from.jitter.as_nanos());
            step.rule = ChainRule::HigherPriority;
        }
    }

    /// Enters how long after its write the data releases the `reader`. See `trigger.rs`.
    fn wait_for_data(
        &self,
        last: &mut ReleasedStep,
        found: &mut ReleasedStep,
        writer: &ChainStep,
        reader: &ChainStep,
    ) {
        let write = if reader.buffer.is_some() { writer.response } else { writer.write }.as_nanos();
        let awaited = others(reader);
        let complete = write.saturating_add(awaited.unwrap_or_default());
        let spacing = found.period.max(reader.response.as_nanos());
        let mut latest = last.run.saturating_add(spacing).max(complete);
        let reads_each = reader.buffer.is_none_or(|buffer| buffer.reads == Some(1));
        let is_first = reads_each && found.ahead.releases == 0 && found.ahead.delay == 0;
        if let (Some(from), Some(to)) = (self.all.get(writer.task), self.all.get(reader.task))
            && is_first
            && awaited.is_none()
            && is_paced(from, reader.writes, to, reader.response)
        {
            latest = latest.min(writer.response.as_nanos().max(write));
        }
        (last.run, last.rule) = (write, ChainRule::AfterWrite);
        found.wait = latest - write;
        // Where only a part of each distance counts once, the release of the writer and not that of the reader begins all of them.
        let late = reader.released.and_then(|it| it.distance).map_or(0, |it| it.late.as_nanos());
        found.periods = found.periods.saturating_sub(late.min(latest));
    }

    /// Returns how long older values in the buffer keep the `reader` from data, at most.
    ///
    /// `to` is the most time between releases of the reader while the buffer has a value.
    ///
    /// Each A releases have a read, which takes the oldest value. **Never full**: let w be the most writes of a job of the writer,
    /// w·A·T_reader ≤ T_writer, and x the instant of the last write into an empty buffer, up to that of the data. If x is in a job
    /// k periods before that of the data, the data is value w·(k + 1) since x at most, and its turn comes at read w·(k + 1) − 1
    /// after x. A reader that saw x in its next release would so read it (w·(k + 1) − 1)·A releases later, which is (w − 1)·A
    /// after the release that k·T_writer later sees the data without a buffer, or before.
    ///
    /// **Otherwise** at most n − 1 older values are in it. They are gone after as many reads, of A releases each; and, since each
    /// write into a full buffer drops the oldest one, after n − 1 more writes, each a gap after the one before: from then on, the
    /// reader finds the data, or newer data, as in a connection without a buffer.
    fn ahead(
        &self,
        (index, to): (usize, u64),
        writer: &ChainStep,
        reader: &ChainStep,
        buffer: ChainBuffer,
    ) -> Result<Ahead, NoLatency> {
        let reads = u64::from(buffer.reads.ok_or(NoLatency::NotRead(index))?.max(1));
        let (Some((of_writer, from)), Some((_, least))) = (self.real_time(writer), self.real_time(reader))
        else {
            return Err(NoLatency::NoPeriod(index));
        };
        let writes =
            reader.writes.map(|writes| u64::from(writes.max(1)).saturating_mul(of_writer.burst.max(1)));
        let cycle = reads.checked_mul(to).ok_or(NoLatency::TooLong)?;
        if let Some(writes) = writes {
            let of_writer = writer.response.as_nanos();
            let most = backlog(writes, from, u128::from(cycle), of_writer, reader.response.as_nanos());
            if most.is_some_and(|most| most <= u128::from(buffer.size)) {
                let releases = (writes - 1).checked_mul(reads).ok_or(NoLatency::TooLong)?;
                return Ok(Ahead { releases, ..Ahead::default() });
            }
        }
        let older = u64::from(buffer.size.saturating_sub(1));
        let distance = self.distance(writer);
        let each = distance.and_then(|it| it.each.checked_mul(u64::from(writer.gap.unwrap_or(1).max(1))));
        // A writer that may skip writes at most so often.
        let stays_full = each.is_some_and(|each| each.as_nanos() < least);
        let dropped = each.zip(distance).filter(|_| writer.gap.is_some());
        let dropped = dropped.and_then(|(each, it)| each.checked_mul(older)?.checked_add(it.late));
        let dropped = dropped.map(Time::as_nanos);
        let read = older.checked_mul(cycle);
        match (dropped, older.checked_mul(reads)) {
            (Some(delay), _) if read.is_none_or(|read| delay < read) => {
                Ok(Ahead { delay, stays_full, releases: 0 })
            }
            (_, Some(releases)) => Ok(Ahead { releases, stays_full, delay: 0 }),
            _ => Err(NoLatency::TooLong),
        }
    }
}

fn is_by_data(task: &Task, step: &ChainStep) -> bool {
    !task.is_periodic() && step.released.is_some_and(|it| it.by_data)
}

/// Returns the most time until data has arrived at all other trigger ports; none where the task has no others.
fn others(step: &ChainStep) -> Option<u64> {
    step.released?.others.map(Time::as_nanos)
}

/// Returns the most values in a buffer. A job of the writer writes at most `writes` times, and there is a read in each
/// `cycle`, that of A releases. None if there may be ever more.
///
/// In Δ since a write into the empty buffer, at most ⌊(Δ + R_writer)/T⌋ + 1 jobs write, and at least ⌈(Δ − R_reader)/cycle⌉ − 1
/// reads have taken a value, if Δ > R_reader. It is the most for Δ = k·T − R_writer: with no read yet, that is the last such k; then
/// the first k with reads, as T ≥ writes·cycle, so that each further k adds no more writes than reads.
fn backlog(writes: u64, period: u64, cycle: u128, of_writer: u64, of_reader: u64) -> Option<u128> {
    let (writes, period) = (u128::from(writes), u128::from(period));
    if writes.checked_mul(cycle)? > period {
        return None;
    }
    let late = u128::from(of_writer) + u128::from(of_reader);
    let last = late / period;
    let without_read = writes.checked_mul(last + 1)?;
    let reads = ((last + 1).checked_mul(period)?.checked_sub(late)?).div_ceil(cycle) - 1;
    Some(without_read.max(writes.checked_mul(last + 2)?.saturating_sub(reads)))
}

/// Returns the parts of the steps; none if a time is too long.
fn follow(steps: &[ReleasedStep]) -> Option<Vec<ChainPart>> {
    let mut parts = Vec::with_capacity(steps.len());
    let mut rest = steps;
    while let Some(first) = rest.first() {
        let (length, laps) = synchronised(rest);
        let (stretch, later) = rest.split_at_checked(length)?;
        let mut worst = None;
        for lap in 0..laps {
            let change = first.offset.map_or(0, |(offset, _)| offset % first.period);
            let found = from_change(stretch, change.checked_add(lap.checked_mul(first.period)?)?)?;
            if worst.as_ref().is_none_or(|(total, _)| found.0 > *total) {
                worst = Some(found);
            }
        }
        parts.extend(worst?.1);
        rest = later;
    }
    Some(parts)
}

/// Returns the number of steps from the first on whose releases are followed together, and that of releases of the first one
/// until all repeats.
fn synchronised(steps: &[ReleasedStep]) -> (usize, u64) {
    let (mut length, mut laps, mut common) = (0, 1, 1);
    let clock = |step: &ReleasedStep| step.offset.map(|(_, clock)| clock);
    for (index, step) in steps.iter().enumerate() {
        // Data releases it, not later than its latest instant.
        if index > 0 && step.by_data {
            length = index + 1;
            continue;
        }
        let is_of_clock = clock(step).is_some() && clock(step) == steps.first().and_then(clock);
        let lap = least_common_multiple(common, step.period);
        let of_first = lap.zip(steps.first()).map(|(lap, first)| lap / first.period);
        let jobs = of_first.and_then(|laps| laps.checked_mul(index as u64 + 1));
        match (lap, of_first, jobs) {
            (Some(lap), Some(of_first), Some(jobs)) if index == 0 || is_of_clock && jobs <= MOST_JOBS => {
                (length, laps, common) = (index + 1, of_first, lap);
            }
            _ => break,
        }
        if step.offset.is_none() {
            break;
        }
    }
    (length, laps)
}

/// Returns the total time and the parts for a change at this instant, at which the first task was just released.
fn from_change(steps: &[ReleasedStep], change: u64) -> Option<(u64, Vec<ChainPart>)> {
    let mut now = change;
    let mut before: Option<&ReleasedStep> = None;
    let mut parts = Vec::with_capacity(steps.len());
    for step in steps {
        let Ahead { delay, stays_full, .. } = step.ahead;
        let wait = match (before, step.offset) {
            (Some(before), Some((offset, _))) => {
                let release = offset % step.period;
                let now = now.checked_add(delay)?;
                let since = (now % step.period).checked_sub(release);
                let since = since.unwrap_or(now % step.period + (step.period - release));
                if since == 0 && before.is_seen_at_once { 0 } else { step.period - since }
            }
            _ => step.wait,
        };
        let part = ChainPart {
            wait: Time::from_nanos(wait),
            buffer: Time::from_nanos(step.reads.checked_add(delay)?),
            periods: Time::from_nanos(step.periods),
            run: Time::from_nanos(step.run),
            rule: step.rule,
            stays_full,
            by_data: step.by_data,
        };
        now = now.checked_add(part.total()?)?;
        parts.push(part);
        before = Some(step);
    }
    Some((now - change, parts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::StateMachine;

    fn ms(time: u64) -> Time {
        Time::from_nanos(time * 1_000_000)
    }

    /// Tasks of these priorities and periods on CPU 0.
    fn tasks(of: &[(u32, u64)]) -> Tasks {
        let task =
            |&(priority, period): &(u32, u64)| Task::new(priority, ms(period), StateMachine::single(ms(1)));
        Tasks::new(of.iter().map(task).collect())
    }

    fn step(task: usize, response: u64) -> ChainStep {
        let response = ms(response);
        ChainStep {
            task,
            releases: 1,
            periods: Some(0),
            write: response,
            response,
            gap: Some(1),
            ..ChainStep::default()
        }
    }

    fn totals(found: &ChainLatency) -> Vec<[u64; 4]> {
        let in_ms = |time: Time| time.as_nanos() / 1_000_000;
        found.parts.iter().map(|it| [it.wait, it.buffer, it.periods, it.run].map(in_ms)).collect()
    }

    /// A laser, guidance, a switch and a driver.
    #[test]
    fn priorities_and_synchronised_clocks() {
        let mut robot = tasks(&[(9, 100), (6, 100), (8, 100), (10, 100)]);
        let chain = [step(0, 53), step(1, 60), step(2, 56), step(3, 10)];
        assert_eq!(robot.latency(&chain, false).unwrap().latency, ms(579));
        let found = robot.latency(&chain, true).unwrap();
        assert_eq!((found.latency, found.age_at_write), (ms(526), Some(ms(426))));
        assert_eq!(totals(&found), [[100, 0, 0, 0], [100, 0, 0, 60], [100, 0, 0, 56], [100, 0, 0, 10]]);
        assert_eq!(found.parts[0].rule, ChainRule::HigherPriority);
        robot.all.iter_mut().for_each(|task| task.offset = Some(Time::ZERO));
        let found = robot.latency(&chain, true).unwrap();
        assert_eq!((found.latency, found.age_at_write), (ms(310), Some(ms(210))));
        assert_eq!(totals(&found), [[100, 0, 0, 0], [0, 0, 0, 60], [40, 0, 0, 56], [44, 0, 0, 10]]);
        // A clock that is not synchronised cuts the chain.
        robot.all[2].offset = None;
        assert_eq!(robot.latency(&chain, true).unwrap().latency, ms(100 + 60 + 100 + 56 + 100 + 10));
    }

    /// A camera and a base in one thread, in both orders, and a third task that waits for none of them.
    #[test]
    fn the_order_in_a_thread() {
        let mut robot = tasks(&[(2, 10), (2, 10), (1, 40)]);
        let chain = |order: [usize; 2]| [step(order[0], 1), step(order[1], 2), step(2, 3)];
        let of = |robot: &Tasks, order| robot.latency(&chain(order), true).unwrap();
        assert_eq!(of(&robot, [0, 1]).latency, ms(10 + 1 + 10 + 40 + 3));
        robot.all[..2].iter_mut().for_each(|task| task.thread = Some(7));
        let forwards = of(&robot, [0, 1]);
        assert_eq!(totals(&forwards), [[10, 0, 0, 0], [0, 0, 0, 0], [40, 0, 0, 3]]);
        assert_eq!(forwards.parts[0].rule, ChainRule::SameJob);
        let backwards = of(&robot, [1, 0]);
        assert_eq!(totals(&backwards), [[10, 0, 0, 0], [10, 0, 0, 0], [40, 0, 0, 3]]);
        assert_eq!(backwards.parts[0].rule, ChainRule::NextJob);
        // The same, released together with the third one.
        robot.all.iter_mut().for_each(|task| task.offset = Some(Time::ZERO));
        assert_eq!(
            (of(&robot, [0, 1]).latency, of(&robot, [1, 0]).latency),
            (ms(10 + 30 + 3), ms(20 + 30 + 3))
        );
        // A call is executed as between threads.
        let call = ChainStep { is_call: true, ..step(1, 2) };
        assert_eq!(robot.latency(&[step(0, 1), call], true).unwrap().latency, ms(10 + 10 + 2));
    }

    #[test]
    fn what_does_not_have_a_higher_priority_for_sure() {
        let chain = [step(0, 10), step(1, 20)];
        let of = |change: &dyn Fn(&mut Tasks)| {
            let mut pair = tasks(&[(2, 100), (1, 100)]);
            change(&mut pair);
            pair.latency(&chain, true).unwrap().latency
        };
        assert_eq!(of(&|_| ()), ms(220));
        assert_eq!(of(&|it| it.all[0].jitter = ms(3)), ms(223));
        assert_eq!(of(&|it| it.all[0].jitter = ms(30)), ms(230));
        let user = |task| crate::LockUser { task, held: Some(ms(1)) };
        let lock = crate::Lock {
            name: "map".into(),
            protocol: crate::Protocol::None,
            users: vec![user(0), user(1)],
        };
        let executed = StateMachine::single(ms(1));
        let (demand, waits) = crate::Waits::with_demand(executed, &[ms(1)], Some(1), None).unwrap();
        // Another instance in the thread of the writer.
        let with_mate = |it: &mut Tasks| {
            it.all[0].thread = Some(1);
            it.all.push(it.all[0].clone());
        };
        let of_mate = crate::Lock { users: vec![user(1), user(2)], ..lock.clone() };
        let others: [&dyn Fn(&mut Tasks); 8] = [
            &|it| {
                with_mate(it);
                (it.all[2].demand, it.all[2].waits) = (demand.clone(), waits.clone());
            },
            &|it| {
                with_mate(it);
                it.locks = vec![of_mate.clone()];
            },
            &|it| it.all[1].cpus = Some(CpuSet(2)),
            &|it| (it.all[0].cpus, it.all[1].cpus) = (Some(CpuSet(3)), Some(CpuSet(3))),
            &|it| it.all[1].priority = Priority::RealTime(2),
            &|it| it.all[0].priority = Priority::Unknown,
            &|it| (it.all[0].demand, it.all[0].waits) = (demand.clone(), waits.clone()),
            &|it| it.locks = vec![lock.clone()],
        ];
        assert_eq!(of(&with_mate), ms(220));
        for (index, other) in others.into_iter().enumerate() {
            assert_eq!(of(other), ms(230), "{index}");
        }
    }

    /// At one instant, a reader on another CPU may be first.
    #[test]
    fn releases_at_the_instant_of_a_write() {
        let mut pair = tasks(&[(1, 100), (2, 100)]);
        (pair.all[0].offset, pair.all[1].offset) = (Some(ms(230)), Some(ms(40)));
        let chain = [step(0, 10), step(1, 20)];
        assert_eq!(pair.latency(&chain, true).unwrap().latency, ms(130));
        pair.all[1].cpus = Some(CpuSet(2));
        assert_eq!(pair.latency(&chain, true).unwrap().latency, ms(230));
        // The common period is too long to follow.
        pair.all[1].period = Some(Time::from_nanos(99_999_999));
        assert_eq!(pair.latency(&chain, true).unwrap().latency, Time::from_nanos(229_999_999));
    }

    #[test]
    fn several_periods_and_a_late_write() {
        let pair = tasks(&[(1, 10), (2, 20)]);
        let later = ChainStep { releases: 3, periods: Some(2), write: ms(4), ..step(1, 9) };
        let found = pair.latency(&[step(0, 5), later.clone()], true).unwrap();
        assert_eq!((found.latency, found.age_at_write), (ms(10 + 5 + 60 + 4), Some(ms(10 + 5 + 40 + 4))));
        let found = pair.latency(&[ChainStep { periods: None, ..later }], true).unwrap();
        assert_eq!((found.latency, found.age_at_write), (ms(64), None));
        assert_eq!(pair.latency(&[], true), Ok(ChainLatency::default()));
    }

    #[test]
    fn buffers() {
        let buffered = |size, [write, read]: [u64; 2], responses: [u64; 2]| {
            let buffer = Some(ChainBuffer { size, reads: Some(1) });
            let chain =
                [step(0, responses[0]), ChainStep { buffer, writes: Some(1), ..step(1, responses[1]) }];
            let found = tasks(&[(1, write), (2, read)]).latency(&chain, true).unwrap();
            let last = found.parts[1];
            (found.latency.as_nanos() / 1_000_000, last.buffer.as_nanos() / 1_000_000, last.stays_full)
        };
        // As without a buffer, where the reader is as fast and the buffer is never full.
        assert_eq!(buffered(2, [10, 10], [3, 4]), (10 + 3 + 10 + 4, 0, false));
        assert_eq!(buffered(1, [100, 10], [10, 5]), (100 + 10 + 10 + 5, 0, false));
        // Of one value, it is a connection without a buffer.
        assert_eq!(buffered(1, [10, 10], [3, 4]), (10 + 3 + 10 + 4, 0, false));
        // A camera of 16 ms, and a tracker of 32 ms: the oldest of 100 images.
        assert_eq!(buffered(100, [16, 32], [1, 5]), (16 + 1 + 99 * 16 + 32 + 5, 99 * 16, true));
    }

    #[test]
    fn reasons() {
        let mut pair = tasks(&[(2, 10), (1, 20)]);
        let with = |size, reads, gap| {
            let buffer = Some(ChainBuffer { size, reads });
            [ChainStep { gap, ..step(0, 5) }, ChainStep { buffer, ..step(1, 5) }]
        };
        assert_eq!(pair.latency(&with(2, None, Some(1)), true), Err(NoLatency::NotRead(1)));
        // The writer may never write again: what is in the buffer is read all the same.
        assert_eq!(
            pair.latency(&with(2, Some(1), None), true).map(|it| it.latency),
            Ok(ms(10 + 20 + 20 + 5))
        );
        let most = u32::MAX;
        assert_eq!(pair.latency(&with(most, Some(most), Some(most)), true), Err(NoLatency::TooLong));
        assert_eq!(pair.latency(&[step(7, 1)], true), Err(NoLatency::NoPeriod(0)));
        pair.all[1].priority = Priority::Background;
        assert_eq!(pair.latency(&[step(0, 1), step(1, 1)], true), Err(NoLatency::NoPeriod(1)));
        pair.all[0].period = Some(Time::from_nanos(u64::MAX));
        assert_eq!(pair.latency(&[step(0, 1)], true), Err(NoLatency::TooLong));
        for (is_sporadic, burst) in [(true, 0), (false, 2)] {
            let sporadic = Task { is_sporadic, burst, ..tasks(&[(1, 20)]).all.swap_remove(0) };
            let pair = Tasks::new(vec![tasks(&[(2, 10)]).all.swap_remove(0), sporadic]);
            assert_eq!(pair.latency(&[step(0, 1), step(1, 1)], true), Err(NoLatency::NotPeriodic(1)));
        }
        pair.all[0].period = None;
        assert_eq!(pair.latency(&[step(0, 1)], true), Err(NoLatency::NoPeriod(0)));
    }
}
