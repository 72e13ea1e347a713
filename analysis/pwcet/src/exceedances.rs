//! How probable so many exceedances of a time are, if each execution exceeds it with a given probability.

use statrs::function::gamma::ln_gamma;

/// Returns P(X ≥ `exceeded`) for a binomial X: `executions` independent ones, each of which exceeds with this probability. From a
/// count that is no more than expected, the result is 1, an upper bound.
///
/// The sum of the terms from `exceeded` on: each is the one before it, times (n − i)/(i + 1) · p/(1 − p), which is less than 1.
pub fn exceedance_probability(executions: u64, exceeded: u64, probability: f64) -> f64 {
    let (n, k, p) = (executions as f64, exceeded as f64, probability);
    if exceeded > executions {
        return 0.0;
    }
    if exceeded == 0 || p >= 1.0 || k <= n * p {
        return 1.0;
    }
    if p <= 0.0 {
        return 0.0;
    }
    let logarithm =
        ln_gamma(n + 1.0) - ln_gamma(k + 1.0) - ln_gamma(n - k + 1.0) + k * p.ln() + (n - k) * (-p).ln_1p();
    let mut term = logarithm.exp();
    let mut sum = 0.0;
    let mut index = k;
    // Far from the mean, a few terms suffice; near it, some times √(n·p).
    while term > sum * 1e-17 && index <= n {
        sum += term;
        term *= (n - index) / (index + 1.0) * (p / (1.0 - p));
        index += 1.0;
    }
    sum.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sum of all terms, by Pascal's triangle.
    fn reference(n: usize, k: usize, p: f64) -> f64 {
        let mut row = vec![1.0];
        for _ in 0..n {
            let mut next = vec![0.0; row.len() + 1];
            for (index, value) in row.iter().enumerate() {
                next[index] += value * (1.0 - p);
                next[index + 1] += value * p;
            }
            row = next;
        }
        row[k..].iter().sum()
    }

    #[test]
    fn agrees_with_the_sum_of_all_outcomes() {
        for (n, p) in [(1, 0.5), (5, 1e-4), (40, 0.1), (300, 0.01), (300, 0.3)] {
            for k in (0..=n).filter(|k| *k == 0 || *k as f64 > n as f64 * p) {
                let (found, expected) = (exceedance_probability(n as u64, k as u64, p), reference(n, k, p));
                let close = (found - expected).abs() <= 1e-9 * expected + 1e-280;
                assert!(close, "{n} {k} {p}: {found} {expected}");
            }
        }
    }

    #[test]
    fn probabilities_of_extreme_counts() {
        assert_eq!(exceedance_probability(0, 0, 0.1), 1.0);
        assert_eq!(exceedance_probability(10, 11, 0.1), 0.0);
        assert_eq!(exceedance_probability(1_000_000_000, 100_000, 1e-4), 1.0);
        // scipy.stats.binom.sf(100999, 10**9, 1e-4)
        let found = exceedance_probability(1_000_000_000, 101_000, 1e-4);
        assert!((found - 7.96e-4).abs() < 0.2e-4, "{found}");
        assert_eq!(exceedance_probability(1000, 1000, 1e-9), 0.0);
    }
}
