//! Tests of what the estimate assumes: independent executions with one distribution.
//!
//! A test can only reject: that none rejects does not prove the assumption.

use crate::distributions::{chi_square, cramer_von_mises, holm, kolmogorov, normal_two_sided};
use crate::order::Times;

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
pub(crate) fn checks(times: &Times) -> Vec<Check> {
    let count = times.count();
    let check = |kind, (statistic, p)| Check { kind, statistic, p, adjusted: p };
    let lags = 20.min(count / 5);
    let truncation = (4.0 * (count as f64 / 100.0).powf(0.25)) as usize;
    vec![
        check(CheckKind::LjungBox { lags }, ljung_box(&times.recorded, lags)),
        check(CheckKind::Runs, runs(times)),
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
pub(crate) fn runs(times: &Times) -> (f64, f64) {
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

/// D, the greatest difference of the distributions of the halves; its p-value is that of the limit.
pub(crate) fn halves(values: &[f64]) -> (f64, f64) {
    let (first, second) = values.split_at(values.len() / 2);
    let [first, second] = [first, second].map(|half| Times::of(half.to_vec()).ascending);
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
