//! The hold-out: what the first half of a recording promises is counted in the second half.

use crate::distributions::binomial_at_least;
use crate::order::SortedTimes;
use crate::tail::Tail;

/// The bound of one level, from the first half, and how often the second half exceeds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoldOut {
    /// The level: the probability that an execution exceeds the bound.
    pub level: f64,
    /// The upper bound from the first half, in nanoseconds.
    pub bound: f64,
    /// How many executions the second half has.
    pub executions: u64,
    /// How many of them exceed the bound.
    pub exceedances: u64,
    /// The probability of at least as many, if each exceeds the bound with the probability `level`.
    pub p: f64,
}

/// Returns the hold-out at 1e-2, 1e-3, … as far as the second half should have one exceedance.
pub(crate) fn hold_out(times: &SortedTimes) -> Vec<HoldOut> {
    let half = times.count() / 2;
    let first = times.first(half);
    let second = &times.recorded[half..];
    let Ok(tail) = Tail::select(&first) else { return Vec::new() };
    let levels =
        (2..=9).map(|exponent| 10_f64.powi(-exponent)).take_while(|level| level * second.len() as f64 >= 1.0);
    let at = |level: f64| {
        let bound = tail.upper_bound(&first, level);
        let exceedances = second.iter().filter(|&&time| time > bound).count() as u64;
        let executions = second.len() as u64;
        HoldOut {
            level,
            bound,
            executions,
            exceedances,
            p: binomial_at_least(exceedances, executions, level),
        }
    };
    levels.map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{generator, uniform};

    /// A second half that is slower by a fifth exceeds the bounds of the first far too often.
    #[test]
    fn a_slower_second_half_is_seen() {
        let times = |factor: f64| {
            let mut random = generator(9, 0);
            let mut time =
                |index: usize| (10.0 - uniform(&mut random).ln()) * if index < 2000 { 1.0 } else { factor };
            SortedTimes::of((0..4000).map(&mut time).collect())
        };
        let least_p = |factor| {
            let found = hold_out(&times(factor));
            assert_eq!(found.iter().map(|it| it.level).collect::<Vec<_>>(), [1e-2, 1e-3]);
            found.iter().map(|it| it.p).fold(1.0, f64::min)
        };
        assert!(least_p(1.0) > 0.05 && least_p(1.2) < 1e-9);
    }
}
