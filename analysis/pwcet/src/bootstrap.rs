//! The parametric bootstrap of the fit: how often samples of the fitted tail itself fit worse than the excesses did.

use rayon::prelude::*;

use crate::anderson_darling::statistic;
use crate::gpd::Gpd;
use crate::random::generator;

/// Draws `times` samples of `count` excesses of a law, fits each, and returns their Anderson–Darling statistics, ascending.
pub(crate) fn null_distribution(law: Gpd, count: usize, times: u64, seed: u64) -> Vec<f64> {
    let draw = |stream: u64| {
        let mut random = generator(seed, stream);
        let mut excesses: Vec<f64> = (0..count).map(|_| law.sample(&mut random)).collect();
        excesses.sort_by(f64::total_cmp);
        Gpd::fit(&excesses).map(|fitted| statistic(&excesses, &fitted))
    };
    let mut drawn: Vec<f64> = (0..times).into_par_iter().filter_map(draw).collect();
    drawn.sort_by(f64::total_cmp);
    drawn
}

/// Returns the share of bootstrapped samples whose statistic is at least `observed`, never 0: (r + 1)/(n + 1).
pub(crate) fn p_value(observed: f64, drawn: &[f64]) -> f64 {
    let below = drawn.partition_point(|&it| it < observed);
    (drawn.len() - below + 1) as f64 / (drawn.len() + 1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of `anderson_darling.rs` and this bootstrap are two ways to the same probability.
    #[test]
    fn the_table_of_anderson_and_darling_agrees() {
        for shape in [-0.35, -0.15, 0.0, 0.3, 0.6] {
            let drawn = null_distribution(Gpd { shape, scale: 3.0 }, 200, 4_000, 5);
            for probability in [0.25, 0.1, 0.05] {
                let statistic = drawn[((1.0 - probability) * drawn.len() as f64) as usize];
                let p = crate::anderson_darling::p_value(statistic, shape);
                assert!((p / probability).ln().abs() < 0.25, "shape {shape}: {p} for {probability}");
            }
        }
    }
}
