//! The generalised extreme value distribution (GEV) of the maxima of blocks, fitted by maximum likelihood.
//!
//! P(M ≤ x) = exp(−(1 + ξ (x − μ)/σ)^(−1/ξ)), and exp(−e^(−(x − μ)/σ)) for ξ = 0 (Gumbel). By Fisher, Tippett and Gnedenko,
//! maxima of many executions tend to it. It is shown beside the fit of the excesses, which uses more of the sample.

use std::cell::Cell;

use crate::gpd::{falling_root, scaled_quantile};
use crate::likelihood_region::CHI_SQUARE;
use crate::order::Times;
use crate::simplex::least;

/// A generalised extreme value distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gev {
    /// μ, in the unit of the maxima.
    pub location: f64,
    /// σ > 0, in the unit of the maxima.
    pub scale: f64,
    /// ξ, without a unit.
    pub shape: f64,
}

impl Gev {
    /// Returns the maximum that is exceeded with `probability`.
    pub fn exceeded_with(&self, probability: f64) -> f64 {
        self.location + self.scale * scaled_quantile(self.shape, -(-probability).ln_1p())
    }

    /// Returns ln of the density at all of these maxima; −∞ where one is impossible.
    pub fn log_likelihood(&self, maxima: &[f64]) -> f64 {
        let Gev { location, scale, shape } = *self;
        if scale.is_nan() || scale <= 0.0 {
            return f64::NEG_INFINITY;
        }
        let mut sum = -(maxima.len() as f64) * scale.ln();
        for &maximum in maxima {
            let z = (maximum - location) / scale;
            // ln of (1 + ξ z)^(−1/ξ).
            let log = if shape.abs() < 1e-9 {
                -z
            } else if shape * z <= -1.0 {
                return f64::NEG_INFINITY;
            } else {
                -(shape * z).ln_1p() / shape
            };
            // Too unlikely for a number.
            if log > 500.0 {
                return f64::NEG_INFINITY;
            }
            sum += (1.0 + shape) * log - log.exp();
        }
        sum
    }

    /// Fits shapes from −1 to 3; `None` for fewer than ten maxima, or if all are equal.
    pub fn fit(maxima: &[f64]) -> Option<Gev> {
        fit(maxima, -1.0)
    }

    /// Fits with ξ ≥ 0.
    pub fn fit_without_end(maxima: &[f64]) -> Option<Gev> {
        fit(maxima, 0.0)
    }
}

fn fit(maxima: &[f64], least_shape: f64) -> Option<Gev> {
    let count = maxima.len() as f64;
    let mean = maxima.iter().sum::<f64>() / count;
    let deviation = (maxima.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
    if maxima.len() < 10 || !(deviation > 0.0 && deviation.is_finite()) {
        return None;
    }
    // In units of the deviation, so that the search has one scale.
    let scaled: Vec<f64> = maxima.iter().map(|x| (x - mean) / deviation).collect();
    let cost = |[location, log_scale, shape]: [f64; 3]| {
        if !(least_shape..=3.0).contains(&shape) {
            return f64::INFINITY;
        }
        -Gev { location, scale: log_scale.exp(), shape }.log_likelihood(&scaled)
    };
    // Moments of Gumbel: σ = s √6/π, μ = mean − 0.5772 σ.
    let scale = 6_f64.sqrt() / std::f64::consts::PI;
    let start = |shape| [-0.577_215_7 * scale, scale.ln(), shape];
    let on_the_border = |[location, log_scale]: [f64; 2]| cost([location, log_scale, 0.0]);
    let gumbel = least(on_the_border, [start(0.0)[0], start(0.0)[1]], 0.2, 1e-11);
    let gumbel = ([gumbel.0[0], gumbel.0[1], 0.0], gumbel.1);
    let starts = [0.05, 0.3, -0.2].into_iter().filter(|&shape| shape >= least_shape);
    let found = starts.map(|shape| least(cost, [gumbel.0[0], gumbel.0[1], shape], 0.1, 1e-11));
    let ([location, log_scale, shape], _) = found.chain([gumbel]).min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Gev { location: mean + deviation * location, scale: deviation * log_scale.exp(), shape })
}

/// The maxima of blocks of executions, and their distribution.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockMaxima {
    /// How many executions a block has.
    pub block: usize,
    /// How many blocks there are; an incomplete last block is left out.
    pub blocks: usize,
    /// The fit with any shape.
    pub free: Gev,
    /// The fit with ξ ≥ 0.
    pub model: Gev,
    maxima: Vec<f64>,
}

/// The precision of likelihoods on the way to a confidence bound.
const PRECISION: f64 = 1e-3;
/// The least number of executions in a block.
const LEAST_BLOCK: usize = 20;
/// No fit uses more blocks: longer blocks are nearer to the limit.
const MOST_BLOCKS: usize = 250;
/// A fit needs as many blocks.
const LEAST_BLOCKS: usize = 25;

/// Returns the maxima of blocks; `None` if there are too few.
pub(crate) fn block_maxima(times: &Times) -> Option<BlockMaxima> {
    let block = LEAST_BLOCK.max(times.count().div_ceil(MOST_BLOCKS));
    let maxima: Vec<f64> = times
        .recorded
        .chunks_exact(block)
        .map(|block| block.iter().copied().fold(f64::MIN, f64::max))
        .collect();
    if maxima.len() < LEAST_BLOCKS {
        return None;
    }
    let (free, model) = (Gev::fit(&maxima)?, Gev::fit_without_end(&maxima)?);
    Some(BlockMaxima { block, blocks: maxima.len(), free, model, maxima })
}

impl BlockMaxima {
    /// Returns the time that one execution exceeds with `probability`, and its 95 % upper confidence bound.
    pub fn exceeded_with(&self, probability: f64) -> (f64, f64) {
        // P(M ≤ x) = (1 − p)^block.
        let rate = -(self.block as f64) * (-probability).ln_1p();
        let point = self.model.location + self.model.scale * scaled_quantile(self.model.shape, rate);
        let least = self.model.log_likelihood(&self.maxima) - CHI_SQUARE / 2.0;
        // The scale and the shape that were best for the last quantile: those of the next are near.
        let near = Cell::new([self.model.scale.ln(), self.model.shape.max(0.02)]);
        let above = |quantile: f64| self.profile(quantile, rate, &near) - least;
        let (mut low, mut high) = (point, point + self.model.scale);
        while above(high) > 0.0 && high < 1e9 * point {
            (low, high) = (high, high + 2.0 * (high - low));
        }
        (point, falling_root(above, low, high, 1e-4))
    }

    /// The greatest likelihood of the distributions with ξ ≥ 0 and this quantile.
    fn profile(&self, quantile: f64, rate: f64, near: &Cell<[f64; 2]>) -> f64 {
        let cost = |[log_scale, shape]: [f64; 2]| {
            if !(0.0..=3.0).contains(&shape) {
                return f64::INFINITY;
            }
            let scale = log_scale.exp();
            let location = quantile - scale * scaled_quantile(shape, rate);
            -Gev { location, scale, shape }.log_likelihood(&self.maxima)
        };
        let (found, value) = least(cost, near.get(), 0.05, PRECISION);
        near.set([found[0], found[1].max(0.02)]);
        let border = |[log_scale]: [f64; 1]| cost([log_scale, 0.0]);
        // Where ξ = 0 is best, the search above ends beside it.
        let on_border = if found[1] < 0.05 { least(border, [found[0]], 0.05, PRECISION).1 } else { value };
        -value.min(on_border)
    }
}
