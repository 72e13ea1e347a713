//! Coverage: how often the upper bounds are above the true quantiles of synthetic laws, and how many estimates have a warning.
//!
//! `MAUVE_COVERAGE_RUNS=1000 cargo test --release -p mauve-pwcet --test main coverage:: -- --nocapture` prints the table,
//! for samples of `MAUVE_COVERAGE_COUNT` executions (5000).

use mauve_pwcet::{Estimate, Options, TailModel, estimate};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};
use rayon::prelude::*;

const LEVELS: [f64; 6] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// The nanoseconds that an execution of a law exceeds with a probability.
type Quantile = fn(f64) -> f64;

/// The tails that no exponential distribution underestimates: their bounds must hold.
const LIGHT: [(&str, Quantile); 6] = [
    ("exponential", |p| 5e6 - 1e6 * p.ln()),
    ("Gumbel", |p| 5e6 - 1e6 * (-(-p).ln_1p()).ln()),
    ("Weibull, k = 1", |p| 1e6 * weibull(p, 1.0)),
    ("Weibull, k = 1.5", |p| 5e6 + 1e6 * weibull(p, 1.5)),
    ("Weibull, k = 3", |p| 5e6 + 1e6 * weibull(p, 3.0)),
    ("uniform", |p| 5e6 + 1e6 * (1.0 - p)),
];

/// The others: what matters is how many of their estimates have a warning, or are refused.
const HEAVY: [(&str, Quantile); 7] = [
    ("Weibull, k = 0.7", |p| 5e6 + 1e6 * weibull(p, 0.7)),
    ("lognormal, σ = 0.25", |p| 5e6 * (0.25 * normal(p)).exp()),
    ("lognormal, σ = 0.5", |p| 5e6 * (0.5 * normal(p)).exp()),
    ("Pareto, ξ = 0.1", |p| 5e6 + 1e6 * (p.powf(-0.1) - 1.0) / 0.1),
    ("Pareto, ξ = 0.3", |p| 5e6 + 1e6 * (p.powf(-0.3) - 1.0) / 0.3),
    ("mixture, 1 of 20 slow", |p| mixture(p, 0.05)),
    ("mixture, 1 of 500 slow", |p| mixture(p, 0.002)),
];

fn weibull(p: f64, shape: f64) -> f64 {
    (-p.ln()).powf(1.0 / shape)
}

/// The value that a standard normal variable exceeds with probability `p`.
fn normal(p: f64) -> f64 {
    statrs::function::erf::erfc_inv(2.0 * p) * std::f64::consts::SQRT_2
}

/// Fast executions, and with a probability slow ones that take 10 ms more; both exponential.
fn mixture(p: f64, slow: f64) -> f64 {
    if p < slow { 15e6 - 1e6 * (p / slow).ln() } else { 5e6 - 5e5 * ((p - slow) / (1.0 - slow)).ln() }
}

/// What many estimates of one law gave.
struct Coverage {
    /// For each level, the share of bounds that are at least the quantile, and the mean of bound / quantile.
    levels: Vec<(f64, f64)>,
    /// The shares of all estimates that have a warning, and that were refused.
    warned: f64,
    refused: f64,
    /// The share of estimates without a warning of which a bound is too low: the worst outcome.
    wrong: f64,
}

fn coverage(law: Quantile, count: usize, runs: u64) -> Coverage {
    let options =
        Options { levels: LEVELS.into(), model: TailModel::GeneralisedPareto, seed: 1, bootstraps: 0 };
    let one = |run: u64| {
        let mut random = Pcg64Mcg::seed_from_u64(run);
        let mut execution = || law(((random.next_u64() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64) as u64;
        let executions: Vec<u64> = (0..count).map(|_| execution()).collect();
        estimate(&executions, &options).ok()
    };
    let all: Vec<_> = (0..runs).into_par_iter().map(one).collect();
    let found: Vec<_> = all.iter().flatten().collect();
    let share = |count: usize, of: usize| count as f64 / of as f64;
    let is_too_low = |it: &Estimate| it.levels.iter().any(|at| at.bound.is_ok_and(|it| it < law(at.level)));
    let level = |(index, &level): (usize, &f64)| {
        let ratios: Vec<f64> =
            found.iter().filter_map(|it| Some(it.levels[index].bound.ok()? / law(level))).collect();
        let covered = share(ratios.iter().filter(|&&it| it >= 1.0).count(), ratios.len());
        (covered, ratios.iter().sum::<f64>() / ratios.len() as f64)
    };
    Coverage {
        levels: LEVELS.iter().enumerate().map(level).collect(),
        warned: share(found.iter().filter(|it| !it.warnings.is_empty()).count(), all.len()),
        refused: share(all.len() - found.len(), all.len()),
        wrong: share(found.iter().filter(|it| it.warnings.is_empty() && is_too_low(it)).count(), all.len()),
    }
}

/// A number in the environment.
fn number(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable).map_or(otherwise, |number| number.parse().expect(variable))
}

fn print(name: &str, coverage: &Coverage) {
    let levels =
        coverage.levels.iter().map(|(covered, ratio)| format!("{:5.1} % ×{ratio:<7.3}", 100.0 * covered));
    let levels: Vec<String> = levels.collect();
    let [warned, refused, wrong] =
        [coverage.warned, coverage.refused, coverage.wrong].map(|share| 100.0 * share);
    println!(
        "{name:24} {}  warned {warned:5.1} %  refused {refused:5.1} %  too low without a warning {wrong:5.1} %",
        levels.join(" ")
    );
}

#[test]
fn bounds_of_light_tails_hold() {
    let (runs, count) = (number("MAUVE_COVERAGE_RUNS", 100), number("MAUVE_COVERAGE_COUNT", 5000));
    for (name, law) in LIGHT {
        let found = coverage(law, count as usize, runs);
        print(name, &found);
        for (level, (covered, _)) in LEVELS.iter().zip(&found.levels) {
            assert!(*covered >= 0.93, "{name}: {covered} of the bounds at {level:e} hold");
        }
        assert_eq!(found.refused, 0.0, "{name}");
        if ["exponential", "Gumbel"].contains(&name) {
            assert!(found.warned <= 0.1, "{name}: {} of the estimates have a warning", found.warned);
        }
    }
}

#[test]
fn heavy_tails_have_warnings_or_bounds_that_hold() {
    let (runs, count) = (number("MAUVE_COVERAGE_RUNS", 30), number("MAUVE_COVERAGE_COUNT", 5000));
    for (name, law) in HEAVY {
        let found = coverage(law, count as usize, runs);
        print(name, &found);
        assert!(
            found.wrong <= 0.15,
            "{name}: {} of the estimates are too low without a warning",
            found.wrong
        );
    }
}
