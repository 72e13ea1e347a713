//! Bounds that are counted in a sample, without a model of the tail: order statistics.
//!
//! The number of executions that exceed the quantile of a level has a binomial distribution, whatever the distribution of the times.
//! So some rank of the sample is above the quantile with a given confidence, as long as enough executions should exceed it:
//!
//! ```
//! // 200,000 executions, of which 40 took 21 µs and the others 10 to 20 µs, by a clock with steps of 1 µs.
//! let executions: Vec<u64> = (0..200_000).map(|it| if it % 5000 == 0 { 21_000 } else { 10_000 + it % 11 * 1000 }).collect();
//! let bounds = mauve_pwcet::counted_bounds(&executions, &[1e-3, 1e-4, 1e-5]);
//! assert_eq!(bounds, [Some(21_000.0), Some(22_000.0), None]);
//! ```

use statrs::function::beta::beta_reg;

use crate::dependence::ExcessDependence;
use crate::order::{SortedTimes, resolution};

/// The confidence of bounds without a tail.
const CONFIDENCE: f64 = 0.95;

/// The confidence where enough executions exceed the level, which is that of one side of an interval with 95 %, as the fitted bounds have
/// it: the dependence is estimated as well, and takes a part of it.
const ONE_SIDE: f64 = 0.975;

/// Returns for each level the 95 % upper bound of the time that an execution exceeds with that probability: an order statistic, and
/// one step of the clock. `None` for a level that so few executions do not support: fewer than about 3 should exceed its time.
///
/// `executions` and bounds are in nanoseconds. The executions must be independent and have one distribution.
pub fn counted_bounds(executions: &[u64], levels: &[f64]) -> Vec<Option<f64>> {
    let step = resolution(executions) as f64;
    let times = SortedTimes::of(executions.iter().map(|&time| time as f64).collect());
    levels.iter().map(|&level| Some(counted_bound(&times, level)? + step)).collect()
}

/// Returns the order statistic that is the 95 % upper bound of the time of a level; `None` if there is none.
///
/// Where long executions come in groups, there are fewer independent ones; where they become more frequent, the level is theirs.
pub(crate) fn counted_bound(times: &SortedTimes, level: f64) -> Option<f64> {
    let count = times.count();
    upper_rank(count, level, CONFIDENCE)?;
    let exceeding = (level * count as f64) as usize;
    let dependence = ExcessDependence::of_longest(times, exceeding);
    let effective = (count as f64 / dependence.inflation) as usize;
    let rank = |confidence| upper_rank(effective, level / dependence.rise, confidence);
    let rank = rank(ONE_SIDE).or_else(|| rank(CONFIDENCE))?;
    let beyond = ((effective - rank) as f64 * dependence.inflation) as usize;
    times.ascending.get(count.checked_sub(beyond + 1)?).copied()
}

/// Returns how many executions a level needs for a bound that is counted: with them, one exceeds its time in 95 of 100 samples.
pub fn counted_from(level: f64) -> u64 {
    ((1.0 - CONFIDENCE).ln() / (-level).ln_1p()).ceil() as u64
}

/// Returns the rank, from 1, of the least of `count` times that is above the quantile with the confidence: the number of times below
/// the quantile has a binomial distribution. `None` if no time is.
pub(crate) fn upper_rank(count: usize, probability: f64, confidence: f64) -> Option<usize> {
    // P(X ≤ rank − 1), where X counts the times below the quantile.
    let reached = |rank: usize| {
        if rank > count { 1.0 } else { beta_reg((count - rank + 1) as f64, rank as f64, probability) }
    };
    let (mut low, mut high) = (0, count + 1);
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if reached(middle) >= confidence { high = middle } else { low = middle }
    }
    (high <= count).then_some(high)
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;
    use crate::random::{generator, uniform};

    /// P(X ≤ rank − 1), by a sum of binomial probabilities.
    #[test]
    fn ranks_have_their_confidence() {
        for (probability, confidence) in [(0.3, 0.975), (0.5, 0.95), (0.9, 0.975), (0.25, 0.95)] {
            let rank = upper_rank(400, probability, confidence).expect("enough times");
            let up_to = |rank: usize| {
                let mut term = f64::powi(probability, 400);
                let mut sum = term;
                for below in 1..rank {
                    term *= (401 - below) as f64 / below as f64 * (1.0 - probability) / probability;
                    sum += term;
                }
                sum
            };
            assert!(up_to(rank) >= confidence && up_to(rank - 1) < confidence, "{rank} at {probability}");
        }
    }

    /// All 400 times are below the quantile with (1 − p)⁴⁰⁰: 95 % need p ≥ 1 − 0.05^(1/400) = 0.00746.
    #[test]
    fn a_level_needs_three_exceedances() {
        assert_eq!(upper_rank(400, 0.007_47, 0.95), Some(400));
        assert_eq!(upper_rank(400, 0.007_45, 0.95), None);
        assert_eq!(upper_rank(0, 0.5, 0.95), None);
        for level in [0.5, 0.007_47, 1e-4] {
            let needed = counted_from(level) as usize;
            assert!(
                upper_rank(needed, level, 0.95).is_some() && upper_rank(needed - 1, level, 0.95).is_none()
            );
        }
        assert_eq!(counted_bounds(&[], &[0.5]), [None]);
        assert_eq!(counted_bounds(&[u64::MAX; 9], &[0.5, 0.1]), [Some(u64::MAX as f64), None]);
    }

    /// A clock that shows whole microseconds of exponential times: the bounds are above the true times in at least 95 of 100 samples.
    #[test]
    fn bounds_of_a_coarse_clock_hold() {
        for level in [0.1, 0.01, 0.002] {
            let holds = |seed| {
                let mut random = generator(seed, 0);
                let time = |_| (5000.0 - 1000.0 * uniform(&mut random).ln()) as u64 / 1000 * 1000;
                let executions: Vec<u64> = (0..2000).map(time).collect();
                // A group by chance may take the bound of 4 expected exceedances away.
                counted_bounds(&executions, &[level])[0]
                    .is_none_or(|it| it >= 5000.0 - 1000.0 * f64::ln(level))
            };
            let covered = (0..300).filter(|&seed| holds(seed)).count();
            assert!(covered >= 285, "{covered} of 300 at {level}");
        }
    }
    /// Exponential times that grow by 0.3 σ: too little to be seen at once, and much beside the margin of 50 exceedances.
    #[test]
    fn bounds_of_a_slow_drift_hold() {
        let holds = |seed: &u64| {
            let mut random = generator(*seed, 0);
            let time = |index: u64| (5e6 - 1e6 * uniform(&mut random).ln() + 6.0 * index as f64) as u64;
            let executions: Vec<u64> = (0..50_000).map(time).collect();
            counted_bounds(&executions, &[1e-3])[0].is_none_or(|it| it >= 5.3e6 - 1e6 * f64::ln(1e-3))
        };
        let covered = (0..200_u64).into_par_iter().filter(holds).count();
        assert!(covered >= 190, "{covered} of 200");
    }
}
