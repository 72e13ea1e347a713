//! Times in their two orders: as they were recorded, and ascending; with ties broken at random.

use crate::random::{generator, uniform};

/// Execution times as the statistics use them.
#[derive(Debug, Clone)]
pub(crate) struct SortedTimes {
    /// In the order of recording. Where the clock is coarse, a random part of its resolution is added to each: tests and fits are
    /// for values without ties.
    pub(crate) recorded: Vec<f64>,
    /// The same, ascending.
    pub(crate) ascending: Vec<f64>,
}

impl SortedTimes {
    pub(crate) fn new(executions: &[u64], resolution: u64, seed: u64) -> SortedTimes {
        let mut random = generator(seed, u64::MAX);
        let mut smooth = |&time: &u64| time as f64 + (uniform(&mut random) - 0.5) * resolution as f64;
        SortedTimes::of(executions.iter().map(&mut smooth).collect())
    }

    pub(crate) fn of(recorded: Vec<f64>) -> SortedTimes {
        let mut ascending = recorded.clone();
        ascending.sort_unstable_by(f64::total_cmp);
        SortedTimes { recorded, ascending }
    }

    /// The first `count` of them.
    pub(crate) fn first(&self, count: usize) -> SortedTimes {
        SortedTimes::of(self.recorded[..count].to_vec())
    }

    pub(crate) fn count(&self) -> usize {
        self.recorded.len()
    }
}

/// Returns the resolution of the clock; 0 if all times are equal.
///
/// It is the greatest number that all differences of times are multiples of. A clock with ticks of, say, 52.08 ns gives differences of
/// 52 and 53 ns: where times repeat, it is at least the distance between neighbours.
pub(crate) fn resolution(executions: &[u64]) -> u64 {
    let first = executions.first().copied().unwrap_or_default();
    let divisor =
        executions.iter().fold(0, |divisor, &time| greatest_common_divisor(divisor, time.abs_diff(first)));
    let mut values = executions.to_vec();
    values.sort_unstable();
    values.dedup();
    // Few ties are chance, and there the resolution does not matter.
    if values.len() * 10 > executions.len() * 9 {
        return divisor;
    }
    let mut distances: Vec<u64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    distances.sort_unstable();
    // Not the least one: a single odd time would hide the ticks.
    let usual = distances.get(distances.len() / 20).copied().unwrap_or_default();
    divisor.max(usual)
}

fn greatest_common_divisor(mut a: u64, mut b: u64) -> u64 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coarse_clock_has_a_resolution() {
        assert_eq!(resolution(&[12_000, 8_000, 14_000]), 2_000);
        assert_eq!(resolution(&[7, 8]), 1);
        assert_eq!(resolution(&[5, 5, 5]), 0);
        assert_eq!(resolution(&[]), 0);
        // Ticks of 19.2 MHz, and one time that is no tick.
        let ticks = (0..2000_u64).map(|it| 100_000 + it * 37 % 400 * 625 / 12);
        assert_eq!(resolution(&ticks.chain([100_001]).collect::<Vec<_>>()), 52);
        assert_eq!(resolution(&[0, u64::MAX]), u64::MAX);
    }
}
