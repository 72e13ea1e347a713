//! How often data releases tasks: no more often than their writers write.
//!
//! [`TaskTrigger`](crate::TaskTrigger) says which ports release a task and who writes them. A nominal release is that of data that
//! arrived after the start of the job before, at its arrival or at the end of the least distance; the first one may need no data. Let
//! N(Δ) be the most nominal releases in a half-open window of length Δ, and η(Δ) the most messages at a port in it.
//!
//! **Readers.** N(Δ) ≤ 1 + η(Δ) if data at one port releases the task, 1 + Σ η(Δ) if data at *any* of several ports does, and
//! 1 + min η(Δ) if a job needs data at *all* of them. Let r be a release in the window that is not the first one there, and r' the
//! release before it, which is in the window too. What releases r arrived after the job of r' started, so not before r', and not after r: in
//! the window, at one of the ports, or at each of them. The data of different releases is different, since each arrived between two of them. The
//! first release of the window counts as 1: its data may have arrived before, and waited for the least distance. So nothing is
//! said of buffers: what a job leaves there releases another one, at any time later. A port with a buffer is unknown.
//!
//! **Messages.** Where each datum at any port releases a job of its own at its arrival, N(Δ) ≤ Σ η(Δ): nothing waits, also not the
//! first one. Then the least distance is one of the data, and what is released is queued.
//!
//! **Writers.** A job of a writer writes a port k times at most, from its nominal release on and within its response time R. Those that
//! write in a window of length Δ are nominally released in one of Δ + R: η(Δ) ≤ Σ k · N(Δ + R) over the writers of the port.
//!
//! **Both.** N(Δ) ≤ b·⌈Δ/T⌉ holds for all tasks, and any bound for writers gives one for readers, also if tasks release each other in a
//! circle. The depth of such bounds is limited. R depends on how often tasks are released, and that on R: every fixed point is
//! sound, as those of calls are (`operations.rs`). Where a writer has no R, T alone counts.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::Time;
use crate::time::least_common_multiple;

/// Which of several ports need new data to release a task.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Needs {
    /// One of them.
    #[default]
    Any,
    /// Each of them.
    All,
    /// One of them, and each datum releases a job of its own at its arrival, as each message does a callback of ROS 2. They come no
    /// closer together than the least distance.
    Each,
}

/// A bound for the releases of a task, from those of its writers and their response times.
/// [`Tasks::response_times`](crate::Tasks::response_times) computes it.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Arrivals {
    needs_all: bool,
    /// The most releases in a window whose data arrived before it.
    waiting: u64,
    ports: Vec<Vec<ArrivalSource>>,
    size: usize,
}

/// What a writer writes.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(crate) struct ArrivalSource {
    /// k.
    pub(crate) writes: u64,
    /// R.
    pub(crate) response: u64,
    /// T, greater than 0.
    pub(crate) period: u64,
    /// b.
    pub(crate) burst: u64,
    /// What data releases it.
    pub(crate) arrivals: Option<Arc<Arrivals>>,
}

/// A number of jobs, and the time in which there are so many in the long run.
pub(crate) type Rate = (u64, u64);

/// Rates that have no common time below this one are rounded up.
const LONGEST: u64 = 10_000_000_000_000;
/// The most steps from one release to the next; a search takes 64.
const MOST_STEPS: usize = 8;

impl Arrivals {
    /// Returns the bound for a task that data of one port, of all, or each datum releases, with the writers of each port. Without a port,
    /// there is none.
    pub(crate) fn new(needs: Needs, ports: Vec<Vec<ArrivalSource>>) -> Option<Arrivals> {
        let of_source = |it: &ArrivalSource| 1 + it.arrivals.as_ref().map_or(0, |it| it.size);
        let size = ports.iter().flatten().map(of_source).sum();
        let waiting = u64::from(needs != Needs::Each);
        (!ports.is_empty()).then_some(Arrivals { needs_all: needs == Needs::All, waiting, ports, size })
    }

    /// Whether data releases the task less often than its period and burst allow, in the long run.
    pub(crate) fn is_slower_than(&self, period: Option<Time>, burst: u64) -> bool {
        let by_distance = (burst, period.map_or(0, Time::as_nanos));
        lesser(by_distance, self.rate()) != by_distance
    }

    /// Returns the number of writers that a count visits.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Returns N of a window, and the longest window for which that holds.
    pub(crate) fn releases(&self, window: u64) -> (u64, u64) {
        let nothing = (0, u64::MAX);
        let add = |sum: (u64, u64), it: (u64, u64)| (sum.0.saturating_add(it.0), sum.1.min(it.1));
        let of_port =
            |port: &Vec<ArrivalSource>| port.iter().map(|it| it.messages(window)).fold(nothing, add);
        let ports = self.ports.iter().map(of_port);
        let (messages, until) =
            if self.needs_all { ports.min().unwrap_or(nothing) } else { ports.fold(nothing, add) };
        (messages.saturating_add(self.waiting), until)
    }

    /// Returns the earliest nominal release of a job of a window, from 1, counted from its start.
    pub(crate) fn release_of(&self, job: u64) -> u64 {
        let is_before = |window: u64| self.releases(window).0 < job;
        if is_before(u64::MAX) {
            return u64::MAX;
        }
        let (mut low, mut high) = (0, u64::MAX);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if is_before(middle) { low = middle } else { high = middle }
        }
        low
    }

    /// The same, where the job before is released then. The next one mostly comes after a step or two.
    pub(crate) fn release_after(&self, job: u64, before: u64) -> u64 {
        let mut window = before;
        for _ in 0..MOST_STEPS {
            let Some(longer) = window.checked_add(1) else { break };
            match self.releases(longer) {
                (jobs, _) if jobs >= job => return window,
                (_, until) => window = until,
            }
        }
        self.release_of(job)
    }

    fn rate(&self) -> Rate {
        let of_port =
            |sources: &Vec<ArrivalSource>| sources.iter().map(ArrivalSource::rate).fold((0, 1), sum);
        let ports = self.ports.iter().map(of_port);
        match self.needs_all {
            true => ports.reduce(lesser).unwrap_or((0, 1)),
            false => ports.fold((0, 1), sum),
        }
    }
}

impl ArrivalSource {
    /// Returns the most messages in a window, and the longest window for which that holds.
    fn messages(&self, window: u64) -> (u64, u64) {
        let Some(length) = window.checked_add(self.response) else { return (u64::MAX, u64::MAX) };
        let bursts = length.div_ceil(self.period);
        let by_distance = (bursts.saturating_mul(self.burst), bursts.saturating_mul(self.period));
        let by_data = self.arrivals.as_ref().map(|it| it.releases(length));
        let (jobs, until) = by_data.filter(|it| it.0 < by_distance.0).unwrap_or(by_distance);
        (jobs.saturating_mul(self.writes), until.saturating_sub(self.response))
    }

    fn rate(&self) -> Rate {
        let (jobs, length) = rate(self.period, self.burst, self.arrivals.as_deref());
        (jobs.saturating_mul(self.writes), length)
    }
}

/// Returns how often a task of this period and burst is released.
pub(crate) fn rate(period: u64, burst: u64, arrivals: Option<&Arrivals>) -> Rate {
    let by_distance = (burst, period);
    arrivals.map_or(by_distance, |it| lesser(by_distance, it.rate()))
}

fn lesser(one: Rate, other: Rate) -> Rate {
    let product = |jobs: u64, length: u64| u128::from(jobs) * u128::from(length);
    if product(other.0, one.1) < product(one.0, other.1) { other } else { one }
}

fn sum(one: Rate, other: Rate) -> Rate {
    let common = least_common_multiple(one.1, other.1).filter(|it| *it <= LONGEST);
    let length = common.unwrap_or(LONGEST);
    let jobs = |(jobs, of): Rate| (u128::from(jobs) * u128::from(length)).div_ceil(u128::from(of.max(1)));
    (u64::try_from(jobs(one) + jobs(other)).unwrap_or(u64::MAX), length)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(period: u64, response: u64, writes: u64) -> ArrivalSource {
        ArrivalSource { writes, response, period, burst: 1, arrivals: None }
    }

    fn of(needs: Needs, ports: &[&[ArrivalSource]]) -> Arrivals {
        Arrivals::new(needs, ports.iter().map(|port| port.to_vec()).collect()).unwrap()
    }

    #[test]
    fn one_job_and_one_for_each_datum() {
        let (fast, slow) = ([source(10, 3, 1)], [source(50, 0, 2)]);
        let any = of(Needs::Any, &[&fast, &slow]);
        // ⌈(t + 3)/10⌉ of the one, and 2 · ⌈t/50⌉ of the other.
        assert_eq!(any.releases(7), (1 + 1 + 2, 7));
        assert_eq!(any.releases(8), (1 + 2 + 2, 17));
        assert_eq!(any.releases(48), (1 + 6 + 2, 50));
        assert_eq!([1, 4, 5, 6].map(|job| any.release_of(job)), [0, 0, 7, 17]);
        for job in 1..1000 {
            assert_eq!(any.release_after(job + 1, any.release_of(job)), any.release_of(job + 1), "{job}");
        }
        assert_eq!(any.rate(), (5 + 2, 50));
        let each = of(Needs::Each, &[&fast, &slow]);
        assert_eq!((each.releases(8), each.release_of(3), each.rate()), ((2 + 2, 17), 0, any.rate()));
        let all = of(Needs::All, &[&fast, &slow]);
        assert_eq!(all.releases(7), (1 + 1, 7));
        assert_eq!(all.releases(27), (1 + 2, 50));
        assert_eq!(all.rate(), (2, 50));
        let port = of(Needs::All, &[&[fast, slow].concat()]);
        assert_eq!((port.releases(7), port.rate()), (any.releases(7), any.rate()));
    }

    /// The reader writes each time that it is released: once in 4 at most.
    #[test]
    fn writers_that_data_releases() {
        let arrivals = Some(Arc::new(of(Needs::Any, &[&[source(20, 5, 1)]])));
        let through = of(Needs::Any, &[&[ArrivalSource { arrivals, ..source(4, 1, 1) }]]);
        // Jobs of the writer in 1 more: ⌈·/4⌉, then 1 + ⌈(· + 5)/20⌉.
        assert_eq!(through.releases(3), (1 + 1, 3));
        assert_eq!(through.releases(14), (1 + 2, 14));
        assert_eq!(through.releases(15), (1 + 3, 34));
        assert_eq!(through.rate(), (1, 20));
    }

    #[test]
    fn what_nothing_writes() {
        let never = of(Needs::Any, &[&[]]);
        assert_eq!((never.releases(u64::MAX), never.rate()), ((1, u64::MAX), (0, 1)));
        assert_eq!([1, 2].map(|job| never.release_of(job)), [0, u64::MAX]);
        assert_eq!([never.release_after(2, 0), never.release_after(3, u64::MAX)], [u64::MAX; 2]);
        assert_eq!(Arrivals::new(Needs::All, Vec::new()), None);
    }

    #[test]
    fn rates_are_rounded_up() {
        let primes = [1_000_000_007, 998_244_353, 1_000_000_009].map(|period| vec![source(period, 0, 1)]);
        let (jobs, length) = Arrivals::new(Needs::Any, primes.to_vec()).unwrap().rate();
        let exact: f64 = primes.iter().flatten().map(|it| 1.0 / it.period as f64).sum();
        let rate = jobs as f64 / length as f64;
        assert!(rate >= exact && rate < exact * 1.001, "{jobs} in {length}");
        let many = of(Needs::Any, &[&[source(1, u64::MAX, u64::MAX)], &[source(3, 1, u64::MAX)]]);
        assert_eq!((many.releases(u64::MAX).0, many.rate().0), (u64::MAX, u64::MAX));
    }
}
