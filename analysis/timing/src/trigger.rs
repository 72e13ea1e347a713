//! Tasks that data releases: when data is seen, and the most time between two releases.
//!
//! A job is released when data arrives at the trigger port after the start of the job before it, or is left in its buffer at the end
//! of that job: at once, but not sooner than T after the release before it. (With a burst of b, not sooner than T after the b-th last
//! one.) Let n be the nominal release of a job of the reader, R and W the greatest times from a nominal release to the end of a job
//! and of a write, J the jitter of the writer, and S = max(T, R of the reader).
//!
//! **Data at the trigger port** that is written at a, by a job of the writer with the nominal release p, a ≤ p + W: let n be the
//! release of the last job that started before a; n ≤ a. The next job sees the data, and is released at max(a, n + S) at most: S
//! after the write. If the writer has a higher priority on the same CPU, that job started before the release of the writer: n ≤ p +
//! J, so that the next one is released by max(p + W, p + J + S).
//!
//! **Paced.** If each job of the writer writes once at most, and its releases are so far apart that b of them take T or more, and one
//! takes R of the reader, the data of each job is seen by one that is released by p + R of the writer: gaps do not add up. Each
//! release waits for data, by p' + R, for the end of the job before it, or for the gap after the b-th last one; these were for data of
//! earlier jobs of the writer, one for each release at most: with their bound, and the distance of the jobs, they end by p + R.
//!
//! From a buffer, each job has to read, also the first one: what that leaves would release a job for no datum of its own. The most
//! writes of the writer do not count as known where A may not hold for the first job ([`crate::ChainStep::writes`]).
//!
//! **Several ports.** Where data at *any* of them releases a job, all that was said of data at one port holds, except what is paced:
//! the data of other writers takes the releases too. Where a job needs data at *all* of them, that of port q comes D_q after any
//! instant at most, which is the most time between two arrivals there: a gap of releases of its writer and R of the writer. Data that
//! arrives at a waits for max(a + max D_q, n + S) then; and from a release to the next one, it takes max(T, R + max D_q) at most, over
//! all ports, as each has new data D_q after the job has started, R after its release at the latest.
//!
//! **Releases** of the reader: after the last datum that its job may see, written at a ≤ n + R, the next write is a gap of releases of
//! the writer and R of the writer later at most. If the data is paced, and the writes are more than S apart, each datum releases a job
//! at once that starts before the next one arrives: k releases take k gaps, and R of the writer once.

use crate::{Needs, Task, Tasks, Time};

/// How far apart releases are: k of them take k·each + late at most.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Distance {
    /// For each release.
    pub each: Time,
    /// Once.
    pub late: Time,
}

impl Distance {
    /// Returns the most time between two releases.
    pub fn greatest(self) -> Option<Time> {
        self.each.checked_add(self.late)
    }

    /// What [`Distance::greatest`] compares, without a limit.
    fn sum(&self) -> u128 {
        u128::from(self.each.as_nanos()) + u128::from(self.late.as_nanos())
    }
}

/// The writer of the data that releases a task.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TriggerWriter {
    /// Its index.
    pub task: usize,
    /// The time between its releases.
    pub distance: Distance,
    /// R: its response time.
    pub response: Time,
    /// The most releases until its next write of the port.
    pub gap: u32,
    /// The most writes of the port in one of its jobs; none if that is not known.
    pub writes: Option<u32>,
    /// Whether the connection has a buffer.
    pub has_buffer: bool,
}

/// The ports whose data releases a task.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Triggers {
    /// Which of them need new data.
    pub needs: Needs,
    /// The writer of each port; none where nothing bounds the time to its next write.
    pub writers: Vec<Option<TriggerWriter>>,
}

/// How data releases a task of a chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ChainRelease {
    /// The time between its releases; none without a bound. See [`Tasks::greatest_distance`].
    pub distance: Option<Distance>,
    /// Whether the data of the step before releases it: it arrives at a trigger port.
    pub by_data: bool,
    /// The most time until data has arrived at all other trigger ports as well, 0 where one is enough; none without other ports.
    pub others: Option<Time>,
}

impl TriggerWriter {
    /// Returns the most time between two arrivals of its data, as a time that repeats, and one that counts once.
    fn arrivals(&self) -> Option<Distance> {
        let each = self.distance.each.checked_mul(u64::from(self.gap.max(1)))?;
        Some(Distance { each, late: self.distance.late.checked_add(self.response)? })
    }
}

impl Tasks {
    /// Returns the time between releases of a task that data releases, and whose response time is `response`.
    pub fn greatest_distance(&self, task: usize, response: Time, by: &Triggers) -> Option<Distance> {
        let is_only = by.writers.len() == 1;
        let of_port = |it: &Option<TriggerWriter>| self.distance_by(task, response, it.as_ref()?, is_only);
        let all = by.writers.iter().map(of_port);
        match by.needs {
            Needs::Any | Needs::Each => all.flatten().min_by_key(Distance::sum),
            Needs::All => {
                let all: Option<Vec<Distance>> = all.collect();
                all?.into_iter().max_by_key(Distance::sum)
            }
        }
    }

    /// Returns how data releases a task of a chain, which enters it at the port of this number, if it does so at one of them.
    pub fn release(
        &self,
        task: usize,
        response: Time,
        by: &Triggers,
        entered: Option<usize>,
    ) -> ChainRelease {
        let distance = self.greatest_distance(task, response, by);
        let rest = by.writers.iter().enumerate().filter(|(port, _)| entered != Some(*port));
        let arrival = |it: &Option<TriggerWriter>| it.as_ref()?.arrivals()?.greatest();
        let most = match (by.needs, entered) {
            (Needs::All, Some(_)) => {
                rest.map(|(_, it)| arrival(it)).try_fold(Time::ZERO, |most, it| Some(most.max(it?)))
            }
            _ => Some(Time::ZERO),
        };
        // Without a bound, what enters is not known to release it.
        let by_data = entered.is_some() && most.is_some();
        ChainRelease { distance, by_data, others: most.filter(|_| by.writers.len() > 1) }
    }

    fn distance_by(
        &self,
        task: usize,
        response: Time,
        by: &TriggerWriter,
        is_only: bool,
    ) -> Option<Distance> {
        let (reader, writer) = (self.all.get(task)?, self.all.get(by.task)?);
        let spacing = reader.period?.max(response);
        let Distance { each, late } = by.arrivals()?;
        let apart = writer.period?.checked_sub(by.response).filter(|apart| *apart > spacing);
        let is_single = writer.burst <= 1 && by.writes.is_some_and(|writes| writes <= 1);
        if apart.is_some() && is_single && !by.has_buffer && is_only {
            return Some(Distance { each, late });
        }
        let each = each.checked_add(late)?.checked_add(response)?.max(spacing);
        Some(Distance { each, late: Time::ZERO })
    }
}

/// Returns whether gaps between releases of the reader, of that response time, do not add up: for a writer that writes `writes` times
/// in a job at most.
pub(crate) fn is_paced(writer: &Task, writes: Option<u32>, reader: &Task, response: Time) -> bool {
    let (Some(apart), Some(least)) = (writer.period, reader.period) else { return false };
    let of_burst = apart.as_nanos().saturating_mul(reader.burst.max(1));
    let is_single = writer.burst <= 1 && writes.is_some_and(|writes| writes <= 1);
    is_single && of_burst >= least.as_nanos() && apart >= response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(period: u64, burst: u64) -> Task {
        Task { period: Some(Time::from_nanos(period)), burst, ..Task::default() }
    }

    /// The distance of a reader with T and R, whose writer has T = 10, R = 2, that burst, and writes that often in a job.
    fn distance([period, response]: [u64; 2], burst: u64, writes: u32, has_buffer: bool) -> (u64, u64) {
        let tasks = Tasks::new(vec![task(10, burst), task(period, 1)]);
        let time = Time::from_nanos;
        let distance = Distance { each: time(10), late: time(1) };
        let by =
            TriggerWriter { task: 0, distance, response: time(2), gap: 2, writes: Some(writes), has_buffer };
        let of = |needs, writers: &[Option<TriggerWriter>]| {
            tasks.greatest_distance(1, time(response), &Triggers { needs, writers: writers.to_vec() })
        };
        let found = of(Needs::Any, &[Some(by)]).expect("all times are known");
        assert_eq!(of(Needs::All, &[Some(by)]), Some(found));
        // With another port, no data is paced.
        let each = Some(time(period.max(response).max(2 * 10 + 1 + 2 + response)));
        let greatest =
            |needs, writers: &[Option<TriggerWriter>]| of(needs, writers).and_then(Distance::greatest);
        assert_eq!(greatest(Needs::Any, &[None, Some(by)]), each);
        assert_eq!(greatest(Needs::All, &[None, Some(by)]), None);
        let slow = TriggerWriter { gap: 9, ..by };
        assert_eq!(greatest(Needs::Any, &[Some(slow), Some(by)]), each);
        let each = Some(time(period.max(response).max(9 * 10 + 1 + 2 + response)));
        assert_eq!(greatest(Needs::All, &[Some(slow), Some(by)]), each);
        (found.each.as_nanos(), found.late.as_nanos())
    }

    #[test]
    fn data_that_comes_seldom_releases_a_job_for_each_gap_of_its_writer() {
        // Two releases of the writer, and once its lateness and response time.
        assert_eq!(distance([3, 7], 1, 1, false), (20, 3));
        assert_eq!(distance([7, 3], 1, 1, false), (20, 3));
    }

    #[test]
    fn data_that_comes_while_a_job_executes_waits_for_its_end() {
        // Both jobs count each time: 2 · 10 + 1 + 2, and R of the reader.
        assert_eq!(distance([3, 8], 1, 1, false), (31, 0));
        assert_eq!(distance([8, 4], 1, 1, false), (27, 0));
        assert_eq!(distance([3, 4], 2, 1, false), (27, 0));
        assert_eq!(distance([3, 4], 1, 2, false), (27, 0));
        assert_eq!(distance([3, 4], 1, 1, true), (27, 0));
        assert_eq!(distance([100, 4], 1, 1, false), (100, 0));
    }

    #[test]
    fn gaps_do_not_add_up_if_the_data_of_each_job_releases_one() {
        let paced = |writer: u64, writes, reader: [u64; 2], response| {
            is_paced(&task(10, writer), writes, &task(reader[0], reader[1]), Time::from_nanos(response))
        };
        assert!(paced(1, Some(1), [10, 1], 10));
        assert!(paced(1, Some(1), [20, 2], 10));
        assert!(!paced(1, Some(1), [21, 2], 10));
        assert!(!paced(1, Some(1), [10, 1], 11));
        assert!(!paced(2, Some(1), [10, 1], 10));
        assert!(!paced(1, Some(2), [10, 1], 10));
        assert!(!paced(1, None, [10, 1], 10));
    }
}
