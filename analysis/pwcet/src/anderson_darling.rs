//! The Anderson–Darling statistic A²: how far the excesses are from a fitted tail, with most weight on its two ends.

use crate::gpd::Gpd;

/// Returns A² of ascending `excesses` for a distribution.
///
/// A² = −n − (1/n) Σ (2i − 1) (ln F(yᵢ) + ln(1 − F(yₙ₊₁₋ᵢ))).
pub(crate) fn statistic(excesses: &[f64], law: &Gpd) -> f64 {
    let count = excesses.len();
    // An excess that the fit excludes is far from it, not infinitely far.
    let survivals: Vec<f64> = excesses.iter().map(|&y| law.survival(y).clamp(1e-300, 1.0 - 1e-16)).collect();
    let term = |i: usize| (2 * i + 1) as f64 * ((-survivals[i]).ln_1p() + survivals[count - 1 - i].ln());
    -(count as f64) - (0..count).map(term).sum::<f64>() / count as f64
}

/// Returns the probability of an A² of at least `statistic` if the excesses have a generalised Pareto distribution whose fit has
/// this shape.
///
/// Between 0.5 and 0.001, it is interpolated; beyond, extrapolated. As soon as there are 50 excesses, it depends on the shape only
/// (Choulakian and Stephens 2001).
pub(crate) fn p_value(statistic: f64, shape: f64) -> f64 {
    let shape = shape.clamp(SHAPES[0], SHAPES[SHAPES.len() - 1]);
    let next = SHAPES.iter().position(|&it| it >= shape).unwrap_or(0).max(1);
    let part = (shape - SHAPES[next - 1]) / (SHAPES[next] - SHAPES[next - 1]);
    let quantile =
        |column: usize| QUANTILES[next - 1][column] * (1.0 - part) + QUANTILES[next][column] * part;
    // ln p falls about linearly with A².
    let column =
        (1..PROBABILITIES.len() - 1).find(|&it| statistic < quantile(it)).unwrap_or(PROBABILITIES.len() - 1);
    let (low, high) = (quantile(column - 1), quantile(column));
    let (from, to) = (PROBABILITIES[column - 1].ln(), PROBABILITIES[column].ln());
    (from + (to - from) * (statistic - low) / (high - low)).exp().min(1.0)
}

const PROBABILITIES: [f64; 8] = [0.5, 0.25, 0.1, 0.05, 0.025, 0.01, 0.005, 0.001];
const SHAPES: [f64; 11] = [-0.5, -0.35, -0.2, -0.1, 0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0];

/// For each shape, the A² that are exceeded with these probabilities: 60,000 samples of 500 excesses each, fitted by
/// [`Gpd::fit`]. The test below draws such samples again.
const QUANTILES: [[f64; 8]; 11] = [
    [0.460, 0.675, 0.968, 1.196, 1.436, 1.775, 2.015, 2.572],
    [0.438, 0.639, 0.912, 1.125, 1.343, 1.655, 1.882, 2.413],
    [0.419, 0.606, 0.859, 1.057, 1.255, 1.542, 1.760, 2.284],
    [0.406, 0.585, 0.826, 1.013, 1.204, 1.468, 1.679, 2.138],
    [0.395, 0.566, 0.797, 0.975, 1.161, 1.404, 1.614, 2.047],
    [0.385, 0.549, 0.770, 0.940, 1.115, 1.350, 1.536, 1.978],
    [0.376, 0.535, 0.745, 0.907, 1.073, 1.298, 1.480, 1.896],
    [0.364, 0.515, 0.715, 0.869, 1.023, 1.238, 1.404, 1.811],
    [0.356, 0.499, 0.689, 0.837, 0.980, 1.187, 1.344, 1.719],
    [0.345, 0.479, 0.658, 0.792, 0.930, 1.126, 1.268, 1.615],
    [0.337, 0.466, 0.636, 0.762, 0.894, 1.075, 1.214, 1.524],
];

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;
    use crate::random::{generator, uniform};

    /// The statistics of samples of 200 excesses of a law, each for its own fit, ascending: the parametric bootstrap.
    fn drawn(law: Gpd) -> Vec<f64> {
        let draw = |stream: u64| {
            let mut random = generator(5, stream);
            let mut excesses: Vec<f64> = (0..200).map(|_| law.exceeded_with(uniform(&mut random))).collect();
            excesses.sort_by(f64::total_cmp);
            Gpd::fit(&excesses).map(|fitted| statistic(&excesses, &fitted))
        };
        let mut drawn: Vec<f64> = (0..4_000_u64).into_par_iter().filter_map(draw).collect();
        drawn.sort_by(f64::total_cmp);
        drawn
    }

    #[test]
    fn the_table_agrees_with_the_bootstrap() {
        for shape in [-0.35, -0.15, 0.0, 0.3, 0.6] {
            let drawn = drawn(Gpd { shape, scale: 3.0 });
            for probability in [0.25, 0.1, 0.05] {
                let statistic = drawn[((1.0 - probability) * drawn.len() as f64) as usize];
                let p = p_value(statistic, shape);
                assert!((p / probability).ln().abs() < 0.25, "shape {shape}: {p} for {probability}");
            }
        }
    }
}
