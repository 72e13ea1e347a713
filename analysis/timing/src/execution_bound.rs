//! What a task executes at most in a window, when its last job can execute no longer than since its release (the interference
//! bound function of Guan, Gu, Stigge, Deng and Yi, RTSS 2014).

use crate::cycle_mean::Adjacency;
use crate::trace_bound::{Laps, Recurrence};
use crate::{NoBoundReason, StateMachine};

/// g(n, r), the greatest execution of n consecutive jobs of a machine, if the last job executes for at most r:
/// max over the edges (a, b) of zₙ₋₁\[a\] + min(δ(a, b), r), where zₙ\[a\] is the greatest total of *at most* n edges that end
/// at a.
///
/// The source has the total xₙ\[a\] of *exactly* n edges instead, which does not exist for a state that nothing enters. The
/// two give the same g: a shorter path followed by (a, b) is also the beginning of a path of n − 1 edges, which has the whole
/// edge (a, b) in it, and so is not less. With zₙ, every entry is a number: it is the recurrence of
/// [`TraceBound`](crate::TraceBound) over the reversed machine, with one more state that has an edge of cost 0 to itself and
/// that every state has an edge of cost 0 to.
///
/// M(n) = g(n, r) for r ≥ every δ, so g(n, r) ≤ M(n).
pub(crate) struct ExecutionBound<'a> {
    machine: &'a StateMachine,
    interrupt: &'a dyn Fn(),
    /// The greatest cost of an edge out of each state.
    last: Vec<u64>,
    /// For n − 1 = 0, 1, …: the entries that can be the greatest.
    fronts: Vec<Vec<BoundEntry>>,
    recurrence: Option<Recurrence>,
    period: Option<Laps<Vec<Growing>>>,
}

/// A state after n − 1 jobs: min(`before` + `last`, `before` + r) of the job n that leaves it.
#[derive(Clone, Copy, PartialEq, Debug)]
struct BoundEntry {
    before: u64,
    last: u64,
}

/// An [`BoundEntry`] whose `before` grows by `gain` in each lap.
#[derive(Clone, Copy)]
struct Growing {
    entry: BoundEntry,
    gain: u64,
}

/// g(n, r) as a function of r, from one r on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct BoundPiece {
    /// g(n, r).
    pub(crate) time: u64,
    /// The greatest r for which g(n, r) is the same, or up to which it rises by at least 1 for each 1 ns;
    /// `None` if g(n, r) is the same for every greater r.
    pub(crate) until: Option<u64>,
    /// Whether g(n, r) rises up to `until`.
    pub(crate) rises: bool,
}

impl<'a> ExecutionBound<'a> {
    pub(crate) fn new(machine: &'a StateMachine, interrupt: &'a dyn Fn()) -> ExecutionBound<'a> {
        ExecutionBound {
            machine,
            interrupt,
            last: Vec::new(),
            fronts: Vec::new(),
            recurrence: None,
            period: None,
        }
    }

    /// Returns g(`jobs`, `r`) for `jobs` ≥ 1. The errors are those of [`TraceBound::demand`](crate::TraceBound::demand).
    pub(crate) fn execution(&mut self, jobs: u64, r: u64) -> Result<BoundPiece, NoBoundReason> {
        let before = jobs.saturating_sub(1);
        if self.machine.greatest_repeats() {
            let last = self.machine.greatest_cost().as_nanos();
            last.checked_mul(jobs).ok_or(NoBoundReason::Overflow)?;
            return Ok(execution(&[BoundEntry { before: last * before, last }], r));
        }
        loop {
            let known = usize::try_from(before).ok().and_then(|before| self.fronts.get(before));
            if let Some(front) = known {
                return Ok(execution(front, r));
            }
            if let Some(period) = &self.period {
                let (growing, laps) = period.at(before);
                let entries = growing.iter().map(|it| {
                    let before = it.gain.checked_mul(laps)?.checked_add(it.entry.before)?;
                    before.checked_add(it.entry.last)?;
                    Some(BoundEntry { before, last: it.entry.last })
                });
                let entries: Option<Vec<BoundEntry>> = entries.collect();
                return Ok(execution(&entries.ok_or(NoBoundReason::Overflow)?, r));
            }
            self.step()?;
        }
    }

    fn step(&mut self) -> Result<(), NoBoundReason> {
        if self.fronts.is_empty() {
            self.last = vec![0; self.machine.states() as usize];
            for edge in self.machine.edges() {
                let last = &mut self.last[edge.source as usize];
                *last = edge.cost.as_nanos().max(*last);
            }
            self.fronts.push(front(self.last.iter().map(|&last| BoundEntry { before: 0, last })));
        }
        let recurrence =
            self.recurrence.get_or_insert_with(|| Recurrence::new(Adjacency::reversed(self.machine)));
        let greatest = self.machine.greatest_cost().as_nanos();
        let last = self.fronts.last().and_then(|front| front.first()).map_or(0, |entry| entry.before);
        // Two costs above the greatest total: that of the next step, and that of the job after it.
        if greatest.checked_mul(2).and_then(|two| last.checked_add(two)).is_none() {
            return Err(NoBoundReason::Overflow);
        }
        recurrence.step(self.interrupt)?;
        let entries = recurrence.values().iter().zip(&self.last);
        self.fronts.push(front(entries.map(|(&before, &last)| BoundEntry { before, last })));
        self.period = recurrence.look_for_period().map(|period| {
            period.laps(|values| {
                let growing = |((before, gain), &last)| Growing { entry: BoundEntry { before, last }, gain };
                growing_front(values.zip(&self.last).map(growing))
            })
        });
        Ok(())
    }
}

/// Returns the entries that are the greatest for some r, by decreasing `before` and increasing `before` + `last`.
fn front(entries: impl Iterator<Item = BoundEntry>) -> Vec<BoundEntry> {
    let mut entries: Vec<BoundEntry> = entries.collect();
    entries.sort_unstable_by_key(|it| (std::cmp::Reverse(it.before), std::cmp::Reverse(it.last)));
    let mut kept: Vec<BoundEntry> = Vec::new();
    for entry in entries {
        if kept.last().is_none_or(|ahead| entry.before + entry.last > ahead.before + ahead.last) {
            kept.push(entry);
        }
    }
    kept.shrink_to_fit();
    kept
}

/// Returns the entries that are the greatest for some r after some number of laps.
fn growing_front(entries: impl Iterator<Item = Growing>) -> Vec<Growing> {
    let mut entries: Vec<Growing> = entries.collect();
    let order = |it: &Growing| (it.gain, it.entry.before, it.entry.last);
    entries.sort_unstable_by_key(|it| std::cmp::Reverse(order(it)));
    let mut kept: Vec<Growing> = Vec::new();
    for it in entries {
        // Those that are kept have at least the gain.
        let is_below = |ahead: &Growing| {
            ahead.entry.before >= it.entry.before
                && ahead.entry.before + ahead.entry.last >= it.entry.before + it.entry.last
        };
        if !kept.iter().any(is_below) {
            kept.push(it);
        }
    }
    kept
}

fn execution(entries: &[BoundEntry], r: u64) -> BoundPiece {
    let time = entries.iter().map(|it| it.before + it.last.min(r)).max().unwrap_or(0);
    let rising = entries.iter().filter(|it| it.last > r && it.before + r == time).map(|it| it.last).max();
    if let Some(until) = rising {
        return BoundPiece { time, until: Some(until), rises: true };
    }
    // Another entry rises above the greatest after the r at which it is equal.
    let overtaking = entries.iter().filter(|it| it.before + it.last > time).map(|it| time - it.before);
    BoundPiece { time, until: overtaking.min(), rises: false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{machine, machines};
    use crate::{Time, TraceBound};
    use proptest::prelude::*;

    /// The definition: all paths of `jobs` edges one by one.
    fn plain(machine: &StateMachine, jobs: u64, r: u64) -> u64 {
        fn from(machine: &StateMachine, state: u32, jobs: u64, r: u64) -> u64 {
            let edges = machine.edges().iter().filter(|edge| edge.source == state);
            let totals = edges.map(|edge| match jobs {
                1 => edge.cost.as_nanos().min(r),
                _ => edge.cost.as_nanos() + from(machine, edge.target, jobs - 1, r),
            });
            totals.max().unwrap()
        }
        (0..machine.states()).map(|state| from(machine, state, jobs, r)).max().unwrap()
    }

    fn time(bound: &mut ExecutionBound<'_>, jobs: u64, r: u64) -> u64 {
        bound.execution(jobs, r).unwrap().time
    }

    #[test]
    fn the_last_job_executes_no_longer_than_since_its_release() {
        let plan = machine(2, &[(0, 0, 1), (0, 1, 9), (1, 0, 1)]);
        let mut bound = ExecutionBound::new(&plan, &|| ());
        assert_eq!(bound.execution(1, 3), Ok(BoundPiece { time: 3, until: Some(9), rises: true }));
        assert_eq!(bound.execution(1, 9), Ok(BoundPiece { time: 9, until: None, rises: false }));
        // The heavy edge first, or after a light one.
        assert_eq!(bound.execution(2, 0), Ok(BoundPiece { time: 9, until: Some(1), rises: true }));
        assert_eq!(bound.execution(2, 1), Ok(BoundPiece { time: 10, until: None, rises: false }));
    }

    #[test]
    fn a_state_that_nothing_enters_is_the_first_only() {
        let once = machine(2, &[(0, 1, 100), (1, 1, 1)]);
        let mut bound = ExecutionBound::new(&once, &|| ());
        assert_eq!([1, 2, 3].map(|jobs| time(&mut bound, jobs, 50)), [50, 101, 102]);
    }

    #[test]
    fn totals_that_do_not_fit() {
        let half = machine(2, &[(0, 1, u64::MAX / 4), (1, 0, u64::MAX / 4)]);
        let mut bound = ExecutionBound::new(&half, &|| ());
        assert!(bound.execution(2, 5).is_ok());
        assert_eq!(bound.execution(9, 5), Err(NoBoundReason::Overflow));
        let mut bound = ExecutionBound::new(&half, &|| ());
        assert_eq!(bound.execution(u64::MAX, 5), Err(NoBoundReason::Overflow));
    }

    #[test]
    fn entries_that_are_never_the_greatest_are_left_out() {
        let entry = |(before, last)| BoundEntry { before, last };
        let kept = |entries: &[(u64, u64)]| front(entries.iter().copied().map(entry));
        // The last two have the same total as one that is ahead.
        assert_eq!(kept(&[(2, 8), (6, 2), (9, 0), (4, 4), (1, 9)]), [(9, 0), (2, 8)].map(entry));
        let kept = |entries: &[(u64, u64, u64)]| {
            let growing =
                |&(before, last, gain): &(u64, u64, u64)| Growing { entry: entry((before, last)), gain };
            let kept = growing_front(entries.iter().map(growing)).into_iter();
            kept.map(|it| (it.entry.before, it.entry.last, it.gain)).collect::<Vec<_>>()
        };
        assert_eq!(kept(&[(10, 5, 3), (10, 5, 5)]), [(10, 5, 5)]);
        assert_eq!(kept(&[(9, 1, 3), (10, 0, 5)]), [(10, 0, 5)]);
        // A smaller gain, but more of the last job or before it.
        for ahead in [(10, 1, 3), (9, 2, 3), (11, 0, 3)] {
            assert_eq!(kept(&[ahead, (10, 0, 5)]), [(10, 0, 5), ahead]);
        }
    }

    proptest! {
        #[test]
        fn equals_the_greatest_of_all_paths(machine in machines(4, 10), jobs in 1..6u64, r in 0..12u64) {
            let mut bound = ExecutionBound::new(&machine, &|| ());
            prop_assert_eq!(time(&mut bound, jobs, r), plain(&machine, jobs, r));
        }

        #[test]
        fn holds_or_rises_as_it_says(machine in machines(4, 10), jobs in 1..6u64, r in 0..12u64) {
            let mut bound = ExecutionBound::new(&machine, &|| ());
            let found = bound.execution(jobs, r).unwrap();
            prop_assert!(found.until.is_none_or(|until| until >= r));
            for later in r..found.until.unwrap_or(30) + 1 {
                let grown = if found.rises { later - r } else { 0 };
                let then = time(&mut bound, jobs, later);
                let holds = if found.rises { then >= found.time + grown } else { then == found.time };
                prop_assert!(holds);
            }
            // It is not the same for longer.
            if let Some(until) = found.until.filter(|_| !found.rises) {
                prop_assert!(time(&mut bound, jobs, until + 1) > found.time);
            }
        }

        #[test]
        fn a_long_last_job_is_the_trace_bound(machine in machines(5, 12), jobs in 1..2000u64) {
            let mut bound = ExecutionBound::new(&machine, &|| ());
            let demand = TraceBound::new(&machine).demand(jobs).map(Time::as_nanos);
            prop_assert_eq!(bound.execution(jobs, 12).map(|it| it.time), demand);
            prop_assert!(bound.fronts.len() < 2000, "no period of {:?}", machine);
        }

        #[test]
        fn the_extension_equals_the_recurrence(machine in machines(5, 12), r in 0..12u64) {
            let mut extended = ExecutionBound::new(&machine, &|| ());
            let mut stepped = ExecutionBound::new(&machine, &|| ());
            while stepped.fronts.len() < 1500 {
                stepped.step().unwrap();
            }
            for jobs in (1..1500).step_by(7) {
                let plain = execution(&stepped.fronts[jobs as usize - 1], r);
                prop_assert_eq!(time(&mut extended, jobs, r), plain.time);
            }
        }
    }
}
