//! The confidence bounds of the quantiles of a tail: the greatest and the least value that the likelihood does not reject.
//!
//! All (σ, ξ) with ξ ≥ 0 and 2 (l_max − l(σ, ξ)) ≤ χ² form a region; the bounds are the greatest and the least quantile of its
//! distributions (profile likelihood; Coles 2001, section 2.6). A quantile grows with σ, so only the greatest and the least σ of
//! each ξ count: two curves, computed once for all levels.

use crate::gpd::{Gpd, falling_root, scaled_quantile};

/// The two edges of the region.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LikelihoodRegion {
    /// For each shape, the least and the greatest scale.
    edges: Vec<(f64, [f64; 2])>,
}

/// The confidence bound of a quantile is the upper end of its 95 % likelihood interval: 2 (l_max − l) ≤ the 95 % quantile of χ²
/// with one degree of freedom.
///
/// The theory promises 97.5 % for one side of it. In simulations, 50 to 2000 excesses of heavy tails (ξ from 0.1 to 0.3) gave
/// 95 to 96 %, and light tails more (`tests/coverage.rs`); the quantile for one side, 2.71, gave 90 to 93 %.
pub(crate) const CHI_SQUARE: f64 = 3.841_458_820_694_124;

/// The number of shapes, most of them near the ends of the region, where its scales close in on one.
const SHAPES: usize = 24;

/// The relative precision of scales.
const PRECISION: f64 = 1e-6;

/// No shape above this is looked at: such a tail has neither a mean nor a usable quantile.
const GREATEST_SHAPE: f64 = 8.0;

impl LikelihoodRegion {
    /// `best` is the fit with ξ ≥ 0; `quantile` that of χ² with one degree of freedom.
    pub(crate) fn new(excesses: &[f64], best: Gpd, quantile: f64) -> LikelihoodRegion {
        let least = best.log_likelihood(excesses) - quantile / 2.0;
        let has = |shape: f64| scales(excesses, shape, best.scale, least).is_some();
        let mut outside = best.shape + 0.25;
        while outside < GREATEST_SHAPE && has(outside) {
            outside += 0.25;
        }
        let greatest = last_inside(has, best.shape, outside);
        let smallest = if has(0.0) { 0.0 } else { last_inside(has, best.shape, 0.0) };
        let turn = |step: usize| std::f64::consts::PI * step as f64 / SHAPES as f64;
        let shapes =
            (0..=SHAPES).map(|step| smallest + (greatest - smallest) * (1.0 - turn(step).cos()) / 2.0);
        let edge = |shape| Some((shape, scales(excesses, shape, best.scale, least)?));
        LikelihoodRegion { edges: shapes.filter_map(edge).collect() }
    }

    /// Returns the greatest excess that a distribution of the region exceeds with `probability`.
    pub(crate) fn greatest_exceeded_with(&self, probability: f64) -> f64 {
        let quantile =
            |(shape, [_, scale]): &(f64, [f64; 2])| (scale * scaled_quantile(*shape, probability)).ln();
        peak(&self.edges.iter().map(quantile).collect::<Vec<_>>()).exp()
    }

    /// Returns the least one.
    pub(crate) fn least_exceeded_with(&self, probability: f64) -> f64 {
        let quantile =
            |(shape, [scale, _]): &(f64, [f64; 2])| -(scale * scaled_quantile(*shape, probability)).ln();
        (-peak(&self.edges.iter().map(quantile).collect::<Vec<_>>())).exp()
    }

    /// Returns the greatest shape.
    pub(crate) fn greatest_shape(&self) -> f64 {
        self.edges.last().map_or(0.0, |&(shape, _)| shape)
    }
}

/// Returns the end of the region between a shape inside and one outside.
fn last_inside(has: impl Fn(f64) -> bool, mut inside: f64, mut outside: f64) -> f64 {
    for _ in 0..16 {
        let middle = f64::midpoint(inside, outside);
        if has(middle) { inside = middle } else { outside = middle }
    }
    inside
}

/// Returns the greatest value of the curve through equidistant values: that of the parabola through the greatest and its neighbours.
fn peak(values: &[f64]) -> f64 {
    let Some(best) = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])) else {
        return f64::NEG_INFINITY;
    };
    let middle = values[best];
    let (Some(before), Some(after)) = (best.checked_sub(1).map(|it| values[it]), values.get(best + 1)) else {
        return middle;
    };
    let curvature = 2.0 * middle - before - after;
    if curvature > 0.0 { middle + (after - before).powi(2) / (8.0 * curvature) } else { middle }
}

/// Returns the least and the greatest scale of a shape in the region; `None` if it has none.
fn scales(excesses: &[f64], shape: f64, near: f64, least: f64) -> Option<[f64; 2]> {
    let best = best_scale(excesses, shape, near);
    let above = |scale: f64| Gpd { shape, scale }.log_likelihood(excesses) - least;
    if above(best) < 0.0 {
        return None;
    }
    let mut high = best * 1.25;
    while above(high) >= 0.0 {
        high *= 1.25;
    }
    let mut low = best / 1.25;
    while above(low) >= 0.0 {
        low /= 1.25;
    }
    // Upwards, the likelihood falls from the best scale; downwards, it falls too.
    Some([
        -falling_root(|scale| above(-scale), -low * 1.25, -low, PRECISION),
        falling_root(above, high / 1.25, high, PRECISION),
    ])
}

/// Returns the most likely scale of a shape ≥ 0: there, the mean of (1 + ξ) y / (σ + ξ y) is 1.
fn best_scale(excesses: &[f64], shape: f64, near: f64) -> f64 {
    let count = excesses.len() as f64;
    let slope = |scale: f64| {
        excesses.iter().map(|y| (1.0 + shape) * y / (scale + shape * y)).sum::<f64>() / count - 1.0
    };
    let (mut low, mut high) = (near, near);
    while slope(low) < 0.0 {
        low /= 2.0;
    }
    while slope(high) > 0.0 {
        high *= 2.0;
    }
    falling_root(slope, low, high, 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{generator, uniform};

    /// The same bound by its definition: all scales and shapes of a fine grid.
    #[test]
    fn equals_a_search_of_the_whole_region() {
        let law = Gpd { shape: 0.15, scale: 4.0 };
        let mut random = generator(3, 0);
        let excesses: Vec<f64> = (0..80).map(|_| law.exceeded_with(uniform(&mut random))).collect();
        let best = Gpd::fit_without_end(&excesses).expect("a fit");
        let region = LikelihoodRegion::new(&excesses, best, 3.84);
        let least = best.log_likelihood(&excesses) - 1.92;
        let (mut greatest, mut smallest) = (0.0_f64, f64::INFINITY);
        for shape in (0..400).map(|step| f64::from(step) * 0.0025) {
            for scale in (0..800).map(|step| 1.5 + f64::from(step) * 0.01) {
                let law = Gpd { shape, scale };
                if law.log_likelihood(&excesses) >= least {
                    greatest = greatest.max(law.exceeded_with(1e-6));
                    smallest = smallest.min(law.exceeded_with(1e-6));
                }
            }
        }
        let (upper, lower) = (region.greatest_exceeded_with(1e-6), region.least_exceeded_with(1e-6));
        // The grid is inside the region.
        assert!(greatest <= upper * 1.0005 && upper <= greatest * 1.03, "{upper} beside {greatest}");
        assert!(smallest >= lower * 0.9995 && lower >= smallest * 0.97, "{lower} beside {smallest}");
    }
}
