//! What n jobs of a state machine demand at most.
//!
//! Each job takes one edge. zₙ\[s\] is the greatest sum of at most n edges in a row that end in s. It follows from
//! z₀ = 0 and zₙ₊₁\[t\] = max over the edges (s, t) of zₙ\[s\] + their time; a state that nothing enters keeps 0. Then n jobs
//! demand at most M(n) = max zₙ, and if the last of them executes for at most r, max over s of zₙ₋₁\[s\] + min(the longest edge
//! out of s, r).
//!
//! **Closed form.** Let zₘ₊꜀\[s\] ≤ zₘ\[s\] + K\[s\] for each state at one m, and K\[s\] ≤ K\[t\] on each edge (s, t). Then it is so
//! for m + 1: zₘ₊₁₊꜀\[t\] is some zₘ₊꜀\[s\] + time ≤ zₘ\[s\] + K\[s\] + time ≤ zₘ₊₁\[t\] + K\[t\]. So two rows and the edges are
//! all that has to be checked for every n.

use std::cell::{Cell, RefCell};

use crate::certificate::{Growth, Machine};

/// Why a check fails.
pub(crate) type Check<T> = Result<T, String>;

/// The work that one certificate may ask for, in values: some seconds.
const MOST_WORK: u64 = 1 << 26;
/// What a value in memory counts.
const STORED: u64 = 16;

#[derive(Default)]
pub(crate) struct Work(Cell<u64>);

impl Work {
    pub(crate) fn spend(&self, work: u64) -> Check<()> {
        self.0.set(self.0.get().saturating_add(work));
        match self.0.get() > MOST_WORK {
            true => Err(format!("the certificate asks for more than {MOST_WORK} steps of work")),
            false => Ok(()),
        }
    }
}

pub(crate) struct Curve<'c> {
    edges: Vec<(usize, usize, u64)>,
    /// The longest edge out of each state.
    longest: Vec<u64>,
    growth: Option<&'c Growth>,
    rows: RefCell<Vec<Vec<u64>>>,
    work: &'c Work,
}

impl<'c> Curve<'c> {
    /// Returns the demand of a machine whose edges take `extra` more; with their waits, or without.
    pub(crate) fn new(machine: &'c Machine, waits: bool, extra: u64, work: &'c Work) -> Check<Curve<'c>> {
        work.spend((machine.states as u64).saturating_mul(STORED))?;
        let mut longest = vec![None; machine.states];
        let mut edges = Vec::with_capacity(machine.edges.len());
        for &(from, to, execution, wait) in &machine.edges {
            let wait = if waits { wait } else { 0 };
            let time = execution.checked_add(wait).and_then(|it| it.checked_add(extra));
            let time = time.ok_or("the time of an edge is too long")?;
            let (Some(known), true) = (longest.get(from).copied(), to < machine.states) else {
                return Err(format!("the edge from {from} to {to} leaves the {} states", machine.states));
            };
            longest[from] = Some(time.max(known.unwrap_or(0)));
            edges.push((from, to, time));
        }
        let longest = longest.into_iter().collect::<Option<Vec<u64>>>().filter(|it| !it.is_empty());
        let longest = longest.ok_or("a state has no edge: nothing is known of what comes after it")?;
        let rows = RefCell::new(vec![vec![0; machine.states]]);
        let growth = if waits { &machine.growth } else { &machine.growth_executed };
        let curve = Curve { edges, longest, growth: growth.as_ref(), rows, work };
        curve.check_growth()?;
        Ok(curve)
    }

    fn check_growth(&self) -> Check<()> {
        let Some(growth) = self.growth else { return Ok(()) };
        if growth.period == 0 || growth.gains.len() != self.longest.len() {
            return Err("the closed form of the demand does not fit the states".to_owned());
        }
        let last = growth.from.checked_add(growth.period).ok_or("the closed form begins too late")?;
        self.extend(last)?;
        if let Some((from, to, _)) = self.edges.iter().find(|it| growth.gains[it.0] > growth.gains[it.1]) {
            return Err(format!("closed form: state {to} gains less than state {from} before it"));
        }
        let rows = self.rows.borrow();
        for (state, (gain, (before, after))) in
            growth.gains.iter().zip(rows[growth.from].iter().zip(&rows[last])).enumerate()
        {
            if after - before > *gain {
                return Err(format!("closed form: state {state} gains {}, more than {gain}", after - before));
            }
        }
        Ok(())
    }

    /// Computes the rows up to zₙ.
    fn extend(&self, n: usize) -> Check<()> {
        let mut rows = self.rows.borrow_mut();
        while rows.len() <= n {
            let row = STORED * (self.longest.len() as u64 + 4);
            self.work.spend(self.edges.len() as u64 + row)?;
            let before = &rows[rows.len() - 1];
            let mut next = vec![0; before.len()];
            for &(from, to, time) in &self.edges {
                let sum = before[from].checked_add(time).ok_or("the demand is too long")?;
                next[to] = sum.max(next[to]);
            }
            rows.push(next);
        }
        Ok(())
    }

    /// Returns zₙ.
    fn row(&self, n: u64) -> Check<Vec<u128>> {
        self.work.spend(self.longest.len() as u64)?;
        if let Some(growth) = self.growth {
            let (from, period) = (growth.from as u64, growth.period as u64);
            if n >= from {
                let (laps, row) = ((n - from) / period, growth.from + ((n - from) % period) as usize);
                let of_state = |(z, gain): (&u64, &u64)| {
                    (u128::from(*gain) * u128::from(laps)).saturating_add(u128::from(*z))
                };
                return Ok(self.rows.borrow()[row].iter().zip(&growth.gains).map(of_state).collect());
            }
        }
        let row = usize::try_from(n).map_err(|_| "without a closed form, the jobs are too many")?;
        self.extend(row)?;
        Ok(self.rows.borrow()[row].iter().map(|z| u128::from(*z)).collect())
    }

    /// M(n).
    pub(crate) fn of_jobs(&self, n: u64) -> Check<u128> {
        Ok(self.row(n)?.into_iter().max().unwrap_or(0))
    }

    /// The demand of n jobs, if the last one executes for at most `last`.
    pub(crate) fn of_jobs_until(&self, n: u64, last: u128) -> Check<u128> {
        let Some(before) = n.checked_sub(1) else { return Ok(0) };
        let with_last = |(z, longest): (u128, &u64)| z.saturating_add(u128::from(*longest).min(last));
        Ok(self.row(before)?.into_iter().zip(&self.longest).map(with_last).max().unwrap_or(0))
    }

    /// Returns (m, c, K): from m jobs on, c more jobs demand at most K more.
    pub(crate) fn regularity(&self) -> Option<(u64, u64, u64)> {
        let growth = self.growth?;
        Some((growth.from as u64, growth.period as u64, growth.gains.iter().copied().max()?))
    }
}
