//! The distributions of test statistics: probabilities of values at least as great.

use std::f64::consts::{PI, SQRT_2};

use statrs::function::{beta, erf, gamma};

/// Returns P(|Z| ≥ |z|) of a standard normal variable.
pub(crate) fn normal_two_sided(z: f64) -> f64 {
    erf::erfc(z.abs() / SQRT_2)
}

/// Returns P(X ≥ x) of χ² with this many degrees of freedom.
pub(crate) fn chi_square(x: f64, degrees: u32) -> f64 {
    if x <= 0.0 { 1.0 } else { gamma::gamma_ur(f64::from(degrees) / 2.0, x / 2.0) }
}

/// Returns P(K ≥ x) of Kolmogorov's limiting distribution: 2 Σ (−1)^(j−1) e^(−2 j² x²).
pub(crate) fn kolmogorov(x: f64) -> f64 {
    if x < 0.2 {
        return 1.0;
    }
    let term = |j: i32| -2.0 * f64::from(j * j) * x * x;
    let sum: f64 = (1..=100).map(|j| if j % 2 == 1 { term(j).exp() } else { -term(j).exp() }).sum();
    (2.0 * sum).clamp(0.0, 1.0)
}

/// Returns P(ω² ≥ x) of the limiting distribution of Cramér and von Mises, which is that of KPSS for a level.
///
/// Smirnov's formula: (2/π) Σ (−1)^(k+1) ∫ √(−1/(t sin t)) e^(−x t²/2) dt, from (2k − 1)π to 2kπ.
pub(crate) fn cramer_von_mises(x: f64) -> f64 {
    if x < 0.02 {
        return 1.0;
    }
    const STEPS: u32 = 200;
    let integral = |k: u32| {
        let middle = (2.0 * f64::from(k) - 0.5) * PI;
        // t = middle − π/2 cos φ: the factor sin φ of dt cancels the poles at both ends.
        let value = |step: u32| {
            let phi = PI * (f64::from(step) + 0.5) / f64::from(STEPS);
            let t = middle - PI / 2.0 * phi.cos();
            (-1.0 / (t * t.sin())).sqrt() * (-x * t * t / 2.0).exp() * phi.sin()
        };
        (0..STEPS).map(value).sum::<f64>() * (PI / 2.0) * (PI / f64::from(STEPS))
    };
    let sum: f64 = (1..=12).map(|k| if k % 2 == 1 { integral(k) } else { -integral(k) }).sum();
    (2.0 / PI * sum).clamp(0.0, 1.0)
}

/// Returns P(X ≥ count) where each of `trials` has this probability.
pub(crate) fn binomial_at_least(count: u64, trials: u64, probability: f64) -> f64 {
    if count == 0 {
        1.0
    } else if count > trials {
        0.0
    } else {
        beta::beta_reg(count as f64, (trials - count + 1) as f64, probability)
    }
}

/// Adjusts p-values for their number (Holm 1979): those that stay at most α are rejected together with an error of at most α.
pub(crate) fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let mut adjusted = vec![1.0; p_values.len()];
    let mut greatest = 0.0_f64;
    for (rank, &index) in order.iter().enumerate() {
        greatest = greatest.max((p_values.len() - rank) as f64 * p_values[index]).min(1.0);
        adjusted[index] = greatest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(actual: f64, expected: f64) {
        assert!((actual - expected).abs() <= 2e-4 * expected, "{actual} instead of {expected}");
    }

    /// Critical values of tables: Anderson and Darling 1952 for ω²; those of Kolmogorov, and of χ².
    #[test]
    fn critical_values_equal_published_tables() {
        for (x, p) in [(0.347_30, 0.1), (0.461_36, 0.05), (0.580_61, 0.025), (0.743_46, 0.01)] {
            close(cramer_von_mises(x), p);
        }
        close(kolmogorov(1.358_10), 0.05);
        close(kolmogorov(1.627_62), 0.01);
        close(chi_square(3.841_459, 1), 0.05);
        close(chi_square(31.410_43, 20), 0.05);
        close(normal_two_sided(-1.959_964), 0.05);
        close(binomial_at_least(3, 10, 0.1), 0.070_190_826_1);
        assert_eq!(binomial_at_least(0, 10, 0.1), 1.0);
    }

    #[test]
    fn holm_is_monotone_and_restores_the_order() {
        let adjusted = holm(&[0.04, 0.01, 0.03, 0.9]);
        let expected = [0.09, 0.04, 0.09, 0.9];
        assert!(adjusted.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{adjusted:?}");
    }
}
