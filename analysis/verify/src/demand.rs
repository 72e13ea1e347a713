//! What n jobs of a state machine demand at most.
//!
//! Each job takes one edge. zₙ\[s\] is the greatest sum of at most n edges in a row that end in s. It follows from
//! z₀ = 0 and zₙ₊₁\[t\] = max over the edges (s, t) of zₙ\[s\] + their time; a state that nothing enters keeps 0. Let the last of n
//! jobs execute for at most r. Then they demand at most max over s of zₙ₋₁\[s\] + min(the longest edge out of s, r).
//!
//! **Closed form.** Let zₘ₊꜀\[s\] ≤ zₘ\[s\] + K\[s\] for each state at one m, and K\[s\] ≤ K\[t\] on each edge (s, t). Then it is so
//! for m + 1: zₘ₊₁₊꜀\[t\] is some zₘ₊꜀\[s\] + time ≤ zₘ\[s\] + K\[s\] + time ≤ zₘ₊₁\[t\] + K\[t\]. So two rows and the edges are
//! all that has to be checked for every n.

use std::cell::Cell;

use crate::certificate::CertifiedMachine;

/// Why a check fails.
pub(crate) type Checks<T> = Result<T, String>;

/// The work that each certificate may ask for, in values: some seconds.
const MOST_WORK: u64 = 1 << 26;
/// And for each byte of its text.
const WORK_OF_BYTE: u64 = 1 << 6;
/// What a value in memory counts.
const STORED: u64 = 16;

/// The work that is left.
pub(crate) struct WorkLeft(Cell<u64>);

impl WorkLeft {
    pub(crate) fn of(json: &str) -> WorkLeft {
        WorkLeft(Cell::new(MOST_WORK + WORK_OF_BYTE * json.len() as u64))
    }

    pub(crate) fn spend(&self, work: usize) -> Checks<()> {
        let left = self.0.get().checked_sub(work as u64);
        self.0.set(left.ok_or("the certificate asks for too much work")?);
        Ok(())
    }
}

pub(crate) struct TaskDemand<'c> {
    machine: &'c CertifiedMachine,
    /// The longest edge out of each state.
    longest: Vec<u64>,
    /// zₙ, up to the second row of the closed form.
    rows: Vec<Vec<u64>>,
}

impl<'c> TaskDemand<'c> {
    /// Returns the demand of a machine whose edges take `extra` more.
    pub(crate) fn new(machine: &'c CertifiedMachine, extra: u64, work: &WorkLeft) -> Checks<TaskDemand<'c>> {
        let states = machine.states;
        if machine.period == 0 || machine.gains.len() != states {
            return Err("the closed form of the demand does not fit the states".to_owned());
        }
        let mut edges = Vec::with_capacity(machine.edges.len());
        let mut longest = vec![None; states];
        for &(from, to, execution, wait) in &machine.edges {
            if from >= states || to >= states {
                return Err(format!("the edge from {from} to {to} leaves the {states} states"));
            }
            let time = execution.checked_add(wait).and_then(|it| it.checked_add(extra));
            let time = time.ok_or("the time of an edge is too long")?;
            if machine.gains[from] > machine.gains[to] {
                return Err(format!("closed form: state {to} gains less than state {from} before it"));
            }
            longest[from] = longest[from].max(Some(time));
            edges.push((from, to, time));
        }
        let longest = longest.into_iter().collect::<Option<Vec<u64>>>().filter(|it| !it.is_empty());
        let longest = longest.ok_or("a state has no edge: nothing is known of what comes after it")?;
        let last = machine.from.checked_add(machine.period).ok_or("the closed form begins too late")?;
        let mut rows = vec![vec![0u64; states]];
        while rows.len() <= last {
            work.spend(edges.len() + STORED as usize * (states + 4))?;
            let before = &rows[rows.len() - 1];
            let mut next = vec![0; states];
            for &(from, to, time) in &edges {
                let sum = before[from].checked_add(time).ok_or("the demand is too long")?;
                next[to] = sum.max(next[to]);
            }
            rows.push(next);
        }
        for (state, gain) in machine.gains.iter().enumerate() {
            let found = rows[last][state] - rows[machine.from][state];
            if found > *gain {
                return Err(format!("closed form: state {state} gains {found}, more than {gain}"));
            }
        }
        Ok(TaskDemand { machine, longest, rows })
    }

    /// The longest job.
    pub(crate) fn longest(&self) -> u64 {
        self.longest.iter().copied().max().unwrap_or(0)
    }

    /// The demand of n jobs, if the last one executes for at most `last`.
    pub(crate) fn of_jobs(&self, n: u64, last: u128, work: &WorkLeft) -> Checks<u128> {
        work.spend(self.longest.len())?;
        let Some(before) = n.checked_sub(1) else { return Ok(0) };
        let (from, period) = (self.machine.from as u64, self.machine.period as u64);
        let laps = before.saturating_sub(from) / period;
        let row = &self.rows[(before - laps * period) as usize];
        let states = row.iter().zip(&self.machine.gains).zip(&self.longest);
        let demand = states.map(|((z, gain), longest)| {
            let z = u128::from(*z) + u128::from(*gain) * u128::from(laps);
            z.saturating_add(u128::from(*longest).min(last))
        });
        Ok(demand.max().unwrap_or(0))
    }
}
