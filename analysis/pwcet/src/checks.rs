//! Tests of what the estimate assumes: independent executions with one distribution.
//!
//! A test can only reject: that none rejects does not prove the assumption.

use crate::distributions::{
    binomial_at_least, chi_square, cramer_von_mises, holm, kolmogorov, normal_two_sided,
};
use crate::order::SortedTimes;

/// One test, and what it says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Check {
    /// The test.
    pub kind: CheckKind,
    /// Its statistic.
    pub statistic: f64,
    /// The probability of a statistic at least as extreme if the assumption holds.
    pub p: f64,
    /// `p` adjusted for the number of tests (Holm).
    pub adjusted: f64,
}

impl Check {
    /// Whether the assumption is rejected, with an error of 5 % for all tests together.
    pub fn is_rejected(&self) -> bool {
        self.adjusted < 0.05
    }
}

/// What is tested, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CheckKind {
    /// Independence: no autocorrelation up to this lag.
    LjungBox {
        /// The number of lags.
        lags: usize,
    },
    /// Independence: as many changes of side of the median as expected.
    Runs,
    /// Independence: the longest executions do not come in groups.
    Groups,
    /// One distribution: both halves of the recording have the same (Kolmogorov–Smirnov).
    Halves,
    /// One distribution: the level stays (Kwiatkowski, Phillips, Schmidt, Shin).
    Kpss {
        /// The truncation lag of the variance.
        lags: usize,
    },
    /// The tail is not heavier than exponential (likelihood ratio).
    LightTail,
    /// The first half predicts the second.
    HoldOut,
}

/// Tests independence and identical distribution; `adjusted` is set by [`adjust`].
pub(crate) fn checks(times: &SortedTimes) -> Vec<Check> {
    let count = times.count();
    let check = |kind, (statistic, p)| Check { kind, statistic, p, adjusted: p };
    let lags = 20.min(count / 5);
    let truncation = (4.0 * (count as f64 / 100.0).powf(0.25)) as usize;
    vec![
        check(CheckKind::LjungBox { lags }, ljung_box(&times.recorded, lags)),
        check(CheckKind::Runs, runs(times)),
        check(CheckKind::Groups, groups(times)),
        check(CheckKind::Halves, halves(&times.recorded)),
        check(CheckKind::Kpss { lags: truncation }, kpss(&times.recorded, truncation)),
    ]
}

/// Adjusts the p-values of all tests of one estimate.
pub(crate) fn adjust(checks: &mut [Check]) {
    let adjusted = holm(&checks.iter().map(|check| check.p).collect::<Vec<_>>());
    for (check, adjusted) in checks.iter_mut().zip(adjusted) {
        check.adjusted = adjusted;
    }
}

/// Q = n (n + 2) Σ ρₖ²/(n − k), which has about the distribution of χ².
pub(crate) fn ljung_box(values: &[f64], lags: usize) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    let correlation = |lag: usize| {
        let products = values.iter().zip(&values[lag..]).map(|(a, b)| (a - mean) * (b - mean));
        products.sum::<f64>() / variance
    };
    let sum: f64 = (1..=lags).map(|lag| correlation(lag).powi(2) / (count - lag as f64)).sum();
    let statistic = count * (count + 2.0) * sum;
    (statistic, chi_square(statistic, lags as u32))
}

/// The number of runs above and below the median (Wald and Wolfowitz), as a normal variable.
pub(crate) fn runs(times: &SortedTimes) -> (f64, f64) {
    let count = times.count();
    let median = f64::midpoint(times.ascending[(count - 1) / 2], times.ascending[count / 2]);
    let sides: Vec<bool> = times.recorded.iter().filter(|&&x| x != median).map(|&x| x > median).collect();
    let above = sides.iter().filter(|&&side| side).count() as f64;
    let below = sides.len() as f64 - above;
    let total = above + below;
    let runs = 1.0 + sides.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
    let expected = 1.0 + 2.0 * above * below / total;
    let variance = 2.0 * above * below * (2.0 * above * below - total) / (total * total * (total - 1.0));
    let statistic = (runs - expected) / variance.sqrt();
    (statistic, normal_two_sided(statistic))
}

/// The distances to the next long execution within which they are counted.
const NEAR: [usize; 2] = [1, 10];

/// How many long executions have another one near before them, divided by the number that independent ones have: the greatest of
/// several shares of long executions and distances, with its binomial probability, for as many tests.
///
/// All executions may be independent of the one before them on the whole, where only long ones follow long ones.
fn groups(times: &SortedTimes) -> (f64, f64) {
    let count = times.count();
    let shares = std::iter::successors(Some(count / 20), |it| Some(it / 4)).take_while(|&it| it >= 10);
    let of_share = |long: usize| {
        let is_long = |it: &f64| *it > times.ascending[count - long - 1];
        let positions: Vec<usize> = (0..count).filter(|&it| is_long(&times.recorded[it])).collect();
        // Of equal times, none is longer than the others.
        let Some(trials @ 1..) = positions.len().checked_sub(1) else { return [(1.0, 1.0); NEAR.len()] };
        NEAR.map(|near| {
            let found = positions.windows(2).filter(|pair| pair[1] - pair[0] <= near).count();
            let chance = 1.0 - (1.0 - long as f64 / count as f64).powi(near as i32);
            (found as f64 / (trials as f64 * chance), binomial_at_least(found as u64, trials as u64, chance))
        })
    };
    let all: Vec<(f64, f64)> = shares.flat_map(of_share).collect();
    let worst = all.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((1.0, 1.0));
    (worst.0, (worst.1 * all.len().max(1) as f64).min(1.0))
}

/// D, the greatest difference of the distributions of the halves; its p-value is that of the limit.
pub(crate) fn halves(values: &[f64]) -> (f64, f64) {
    let (first, second) = values.split_at(values.len() / 2);
    let [first, second] = [first, second].map(|half| SortedTimes::of(half.to_vec()).ascending);
    let (mut i, mut j, mut greatest) = (0, 0, 0.0_f64);
    while i < first.len() && j < second.len() {
        let value = first[i].min(second[j]);
        while i < first.len() && first[i] <= value {
            i += 1;
        }
        while j < second.len() && second[j] <= value {
            j += 1;
        }
        greatest = greatest.max((i as f64 / first.len() as f64 - j as f64 / second.len() as f64).abs());
    }
    let size = (first.len() * second.len()) as f64 / (first.len() + second.len()) as f64;
    (greatest, kolmogorov(size.sqrt() * greatest))
}

/// Σ Sₜ² / (n² s²), with S the sums of the deviations and s² their long-run variance (Newey and West).
pub(crate) fn kpss(values: &[f64], lags: usize) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let deviations: Vec<f64> = values.iter().map(|x| x - mean).collect();
    let product =
        |lag: usize| deviations.iter().zip(&deviations[lag..]).map(|(a, b)| a * b).sum::<f64>() / count;
    let weighted = (1..=lags).map(|lag| (1.0 - lag as f64 / (lags as f64 + 1.0)) * product(lag));
    let variance = product(0) + 2.0 * weighted.sum::<f64>();
    let mut sum = 0.0;
    let mut squares = 0.0;
    for deviation in &deviations {
        sum += deviation;
        squares += sum * sum;
    }
    let statistic = squares / (count * count * variance);
    (statistic, cramer_von_mises(statistic))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{generator, uniform};

    /// Calm and wild phases of about 200 executions with the same median: only the longest and the shortest times come together.
    fn phases(wild: f64, seed: u64) -> SortedTimes {
        let mut random = generator(seed, 0);
        let mut scale = 1.0;
        let mut time = |_| {
            if uniform(&mut random) < 0.005 {
                scale = wild + 1.0 - scale;
            }
            let side = if uniform(&mut random) < 0.5 { -1.0 } else { 1.0 };
            side * scale * -uniform(&mut random).ln()
        };
        SortedTimes::of((0..10_000).map(&mut time).collect())
    }

    #[test]
    fn long_executions_in_groups_are_dependent() {
        let is_rejected = |wild: f64, seed: u64| {
            let mut checks = checks(&phases(wild, seed));
            adjust(&mut checks);
            let is_of_order = |it: CheckKind| {
                matches!(it, CheckKind::LjungBox { .. } | CheckKind::Runs | CheckKind::Groups)
            };
            checks.iter().any(|it| is_of_order(it.kind) && it.is_rejected())
        };
        let found = |wild: f64| (0..100).filter(|&seed| is_rejected(wild, seed)).count();
        assert!(found(2.0) >= 95, "{} of 100 with phases", found(2.0));
        // Of all tests together, at most 5.
        assert!(found(1.0) <= 5, "{} of 100 without", found(1.0));
    }

    #[test]
    fn equal_times_have_no_groups() {
        let greatest_is_frequent = |it: u32| if it.is_multiple_of(2) { 1.0 } else { 2.0 };
        for greatest_are_few in [false, true] {
            let time =
                |it: u32| if greatest_are_few { f64::from(it.min(998)) } else { greatest_is_frequent(it) };
            assert!(groups(&SortedTimes::of((0..1000).map(time).collect())).1 > 0.0);
        }
        assert_eq!(groups(&SortedTimes::of((0..1000).map(greatest_is_frequent).collect())), (1.0, 1.0));
    }

    #[test]
    fn few_executions_have_no_groups() {
        for count in [0, 1, 20, 199] {
            assert_eq!(groups(&SortedTimes::of((0..count).map(f64::from).collect())), (1.0, 1.0));
        }
    }
}
