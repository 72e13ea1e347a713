//! The generalised Pareto distribution (GPD) of the excesses over a threshold, fitted by maximum likelihood.
//!
//! P(Y > y) = (1 + ξ y / σ)^(−1/ξ), and e^(−y/σ) for ξ = 0. ξ < 0 has a greatest value, ξ > 0 is heavier than any exponential,
//! ξ ≥ 1 has no mean. By Pickands (1975) and Balkema and de Haan (1974), excesses over high thresholds tend to it.
//!
//! The fit needs one unknown (Grimshaw 1993): for θ = ξ/σ, the best ξ is the mean of ln(1 + θ y).

/// A generalised Pareto distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gpd {
    /// ξ, without a unit.
    pub shape: f64,
    /// σ > 0, in the unit of the excesses.
    pub scale: f64,
}

impl Gpd {
    /// Returns P(Y > y).
    pub fn survival(&self, excess: f64) -> f64 {
        if excess <= 0.0 {
            return 1.0;
        }
        let scaled = excess / self.scale;
        if is_exponential(self.shape) {
            return (-scaled).exp();
        }
        let base = self.shape * scaled;
        if base <= -1.0 { 0.0 } else { (-base.ln_1p() / self.shape).exp() }
    }

    /// Returns the excess that is exceeded with `probability`, in (0, 1].
    ///
    /// ```
    /// let exponential = mauve_pwcet::Gpd { shape: 0.0, scale: 2.0 };
    /// assert!((exponential.exceeded_with(1e-3) - 2.0 * 1000_f64.ln()).abs() < 1e-12);
    /// ```
    pub fn exceeded_with(&self, probability: f64) -> f64 {
        self.scale * scaled_quantile(self.shape, probability)
    }

    /// Returns ln of the density at all of these excesses; −∞ where one is impossible.
    pub fn log_likelihood(&self, excesses: &[f64]) -> f64 {
        let count = excesses.len() as f64;
        if is_exponential(self.shape) {
            return -count * self.scale.ln() - excesses.iter().sum::<f64>() / self.scale;
        }
        let theta = self.shape / self.scale;
        if excesses.iter().any(|excess| 1.0 + theta * excess <= 0.0) {
            return f64::NEG_INFINITY;
        }
        -count * self.scale.ln() - (1.0 + 1.0 / self.shape) * sum_of_logs(theta, excesses)
    }

    /// Fits all shapes from −1 to 3; `None` for fewer than two distinct excesses.
    ///
    /// The likelihood has no maximum for ξ < −1, so ξ = −1 is the estimate for a uniform tail.
    pub fn fit(excesses: &[f64]) -> Option<Gpd> {
        fit(excesses, -1.0)
    }

    /// Fits with ξ ≥ 0: the tail has no end, and is exponential where the excesses suggest an end.
    pub fn fit_without_end(excesses: &[f64]) -> Option<Gpd> {
        fit(excesses, 0.0)
    }
}

/// Returns the excess that is exceeded with `probability`, for σ = 1: (p^(−ξ) − 1)/ξ. With −ln P(M ≤ x) instead of p, it is (x − μ)/σ of a
/// maximum x.
pub(crate) fn scaled_quantile(shape: f64, probability: f64) -> f64 {
    let log = -probability.ln();
    if is_exponential(shape) { log } else { (shape * log).exp_m1() / shape }
}

/// Below this, the general formulas lose more digits than ξ = 0 does.
fn is_exponential(shape: f64) -> bool {
    shape.abs() < 1e-9
}

/// Σ ln(1 + θ y), with one logarithm for eight values: their product is far from the limits of a float, as no factor exceeds 1e30.
fn sum_of_logs(theta: f64, excesses: &[f64]) -> f64 {
    let mut chunks = excesses.chunks_exact(8);
    let products = chunks.by_ref().map(|eight| eight.iter().map(|y| 1.0 + theta * y).product::<f64>().ln());
    products.sum::<f64>() + chunks.remainder().iter().map(|y| (theta * y).ln_1p()).sum::<f64>()
}

/// The greatest ξ of a fit: samples with more have neither a mean nor a meaningful estimate.
const GREATEST_SHAPE: f64 = 3.0;

fn fit(excesses: &[f64], least_shape: f64) -> Option<Gpd> {
    let count = excesses.len() as f64;
    let greatest = excesses.iter().copied().fold(0.0, f64::max);
    let least = excesses.iter().copied().fold(f64::INFINITY, f64::min);
    let mean = excesses.iter().sum::<f64>() / count;
    if excesses.len() < 2 || !(greatest > least && least >= 0.0 && greatest.is_finite()) {
        return None;
    }
    let profile = Profile { excesses, mean, count };
    // θ in units of 1/mean: from ξ(θ) = −1, or 0, up to ξ(θ) = 3, in steps that double.
    let mut grid = Vec::new();
    if least_shape < 0.0 {
        let lowest = profile.theta_of_shape(-1.0, -mean / greatest, 0.0);
        // Steps near the end of the distribution, where the likelihood changes most.
        let parts =
            [0.0, 0.005, 0.01, 0.02, 0.035, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.45, 0.6, 0.75, 0.87, 0.95];
        grid.extend(parts.map(|part| lowest * (1.0 - part)));
    }
    grid.extend([0.0, 0.01]);
    let mut theta = 0.02;
    while profile.shape(theta) < GREATEST_SHAPE && theta < 1e12 {
        grid.push(theta);
        theta *= 2.0;
    }
    grid.push(theta);
    grid.sort_by(f64::total_cmp);
    let best = (0..grid.len())
        .max_by(|&a, &b| profile.log_likelihood(grid[a]).total_cmp(&profile.log_likelihood(grid[b])))?;
    // The derivative falls through 0 at the maximum, between the neighbours of the best value.
    let mut low = grid[best.saturating_sub(1)];
    let high = grid[(best + 1).min(grid.len() - 1)];
    // Near ξ = −1, the likelihood falls before it rises to its maximum.
    while profile.slope(low) <= 0.0 && grid[best] - low > 1e-9 {
        low += (grid[best] - low) / 4.0;
    }
    let theta = if profile.slope(low) <= 0.0 {
        low
    } else if profile.slope(high) >= 0.0 {
        high
    } else {
        falling_root(|theta| profile.slope(theta), low, high, 1e-13)
    };
    let shape = profile.shape(theta);
    if is_exponential(shape) {
        return Some(Gpd { shape: 0.0, scale: mean });
    }
    Some(Gpd { shape, scale: shape / theta * mean })
}

/// The likelihood of excesses with mean 1 as a function of θ alone.
struct Profile<'a> {
    excesses: &'a [f64],
    mean: f64,
    count: f64,
}

impl Profile<'_> {
    /// The best ξ for this θ.
    fn shape(&self, theta: f64) -> f64 {
        sum_of_logs(theta / self.mean, self.excesses) / self.count
    }

    /// For each excess.
    fn log_likelihood(&self, theta: f64) -> f64 {
        let shape = self.shape(theta);
        if theta.abs() < 1e-12 { -1.0 } else { -(shape / theta).ln() - shape - 1.0 }
    }

    /// The derivative of [`log_likelihood`](Self::log_likelihood): 1/θ − ξ′(1 + 1/ξ).
    fn slope(&self, theta: f64) -> f64 {
        if theta.abs() < 1e-6 {
            // Its limit at 0: half the second moment, less 1.
            let second = self.excesses.iter().map(|y| (y / self.mean).powi(2)).sum::<f64>() / self.count;
            return second / 2.0 - 1.0;
        }
        let (factor, shape) = (theta / self.mean, self.shape(theta));
        let sum: f64 = self.excesses.iter().map(|y| y / (1.0 + factor * y)).sum();
        1.0 / theta - sum / self.mean / self.count * (1.0 + 1.0 / shape)
    }

    /// The θ with this ξ: ξ(θ) grows with θ.
    fn theta_of_shape(&self, shape: f64, mut low: f64, mut high: f64) -> f64 {
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            // Beyond the end of the distribution, it is no number.
            if self.shape(middle) >= shape { high = middle } else { low = middle }
        }
        high
    }
}

/// Returns where `function` falls through 0, to a relative precision: the Illinois method.
pub(crate) fn falling_root(
    function: impl Fn(f64) -> f64,
    mut low: f64,
    mut high: f64,
    precision: f64,
) -> f64 {
    let (mut at_low, mut at_high) = (function(low), function(high));
    for _ in 0..100 {
        let mut middle = (low * at_high - high * at_low) / (at_high - at_low);
        if !(low < middle && middle < high) {
            middle = f64::midpoint(low, high);
        }
        let value = function(middle);
        if value == 0.0 || high - low <= precision * middle.abs().max(1e-3) {
            return middle;
        }
        if value > 0.0 {
            (low, at_low) = (middle, value);
            at_high /= 2.0;
        } else {
            (high, at_high) = (middle, value);
            at_low /= 2.0;
        }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{generator, uniform};

    /// Few excesses of a tail with an end: ξ = −1, where the search begins, may be more likely than what is near it.
    #[test]
    fn no_other_distribution_is_more_likely() {
        for seed in 0..300 {
            let mut random = generator(seed, 0);
            let law = Gpd { shape: -0.4, scale: 1.0 };
            let excesses: Vec<f64> = (0..50).map(|_| law.exceeded_with(uniform(&mut random))).collect();
            let greatest = excesses.iter().copied().fold(0.0, f64::max);
            let likelihood = Gpd::fit(&excesses).expect("a fit").log_likelihood(&excesses);
            for step in 1..400 {
                let theta = -0.999 / greatest + f64::from(step) / 400.0 / greatest;
                let shape = sum_of_logs(theta, &excesses) / 50.0;
                if shape >= -1.0 {
                    let other = Gpd { shape, scale: shape / theta }.log_likelihood(&excesses);
                    assert!(other <= likelihood + 0.02, "{seed}: {other} above {likelihood} at {shape}");
                }
            }
        }
    }
}
