//! How much long executions depend on each other, and whether they become more frequent.
//!
//! Exceedances of a time are counted in batches of the recording. Where they come in groups, the counts vary more than those of
//! independent executions: n executions say as much as n/φ independent ones. Where a tenth of the recording has more of them than
//! chance explains, bounds are for the frequency in that tenth.

use crate::order::SortedTimes;
use statrs::function::beta::beta_reg;

/// What the exceedances of a time say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExcessDependence {
    /// φ ≥ 1: the variance of their number, divided by that of independent executions.
    pub(crate) inflation: f64,
    /// Their frequency in the tenth with most of them, divided by the mean; 1 if chance explains it.
    pub(crate) rise: f64,
}

/// The parts of a recording whose frequencies are compared.
const PARTS: usize = 10;

/// Differences of the parts are no chance if they are as improbable. At 1e-3, the bounds of 1e-3 from 50,000 executions that grow by
/// 0.3 σ were too low in 9 of 100 recordings: the drift is hardly seen, but takes most of the margin of a bound that is counted.
const SIGNIFICANT: f64 = 0.05;

impl ExcessDependence {
    /// Returns the worst of the `exceeding` longest executions and of four times as many, again and again: few of them show little.
    pub(crate) fn of_longest(times: &SortedTimes, exceeding: usize) -> ExcessDependence {
        let count = times.count();
        let mut worst = ExcessDependence { inflation: 1.0, rise: 1.0 };
        for exceeding in std::iter::successors(Some(exceeding), |it| Some(it * 4)) {
            let Some(&time) = count.checked_sub(exceeding + 1).and_then(|it| times.ascending.get(it)) else {
                break;
            };
            let found = dependence(&times.recorded, |it| f64::from(u8::from(it > time)));
            worst.inflation = worst.inflation.max(found.inflation);
            worst.rise = worst.rise.max(found.rise);
            if exceeding * 20 >= count {
                break;
            }
        }
        worst
    }
}

/// Returns the dependence of executions longer than `time`, by the excess of each, or by one for each.
pub(crate) fn dependence(recorded: &[f64], weight: impl Fn(f64) -> f64) -> ExcessDependence {
    let independent = ExcessDependence { inflation: 1.0, rise: 1.0 };
    let count = recorded.len();
    // About √n batches of √n executions.
    let batches = (count.isqrt() / PARTS).max(2);
    let length = count / (batches * PARTS);
    if length == 0 {
        return independent;
    }
    let (mut sum, mut squares) = (0.0, 0.0);
    for &time in recorded {
        let weight = weight(time);
        sum += weight;
        squares += weight * weight;
    }
    let mean = sum / count as f64;
    let variance = squares / count as f64 - mean * mean;
    if variance <= 0.0 {
        return independent;
    }
    let (mut within, mut between) = (0.0, 0.0);
    let mut frequencies = Vec::with_capacity(PARTS);
    // What the division leaves over is at the begin, where a recording starts.
    let first = count - length * batches * PARTS;
    for part in recorded[first..].chunks_exact(length * batches) {
        let sums = part.chunks_exact(length).map(|batch| batch.iter().map(|&time| weight(time)).sum::<f64>());
        let sums: Vec<f64> = sums.collect();
        let of_part = sums.iter().sum::<f64>() / batches as f64;
        within += sums.iter().map(|sum| (sum - of_part).powi(2)).sum::<f64>();
        between += batches as f64 * (of_part - mean * length as f64).powi(2);
        frequencies.push(of_part / length as f64);
    }
    frequencies.sort_by(|a, b| b.total_cmp(a));
    let [greatest, second, ..] = frequencies[..] else { return independent };
    let (few, many) = ((PARTS - 1) as f64, (PARTS * (batches - 1)) as f64);
    let ratio = (between / few) / (within / many).max(f64::MIN_POSITIVE);
    let is_chance = beta_reg(many / 2.0, few / 2.0, many / (many + few * ratio)) >= SIGNIFICANT;
    let varies = if is_chance { (within + between) / (few + many) } else { within / many };
    ExcessDependence {
        inflation: (varies / (variance * length as f64)).max(1.0),
        rise: if is_chance {
            1.0
        } else {
            {
                // They grow within the tenth, too: half a step more.
                ((greatest + (greatest - second) / 2.0) / mean).max(1.0)
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{generator, uniform};

    fn of_longest(time: impl FnMut(usize) -> f64) -> ExcessDependence {
        ExcessDependence::of_longest(&SortedTimes::of((0..20_000).map(time).collect()), 500)
    }

    #[test]
    fn groups_and_phases_are_seen() {
        let mut random = generator(4, 0);
        let independent = of_longest(|_| uniform(&mut random));
        assert!(independent.inflation < 1.4 && independent.rise == 1.0, "{independent:?}");
        // Each chance counts for five executions.
        let mut chance = 0.0;
        let groups = of_longest(|index| {
            if index % 5 == 0 {
                chance = uniform(&mut random);
            }
            chance + 1e-9 * uniform(&mut random)
        });
        assert!((4.0..7.5).contains(&groups.inflation) && groups.rise == 1.0, "{groups:?}");
        // Three of four long ones are in the second half.
        let faster = of_longest(|index| uniform(&mut random).powf(if index < 10_000 { 3.0 } else { 1.0 }));
        assert!((1.4..2.2).contains(&faster.rise) && faster.inflation < 1.6, "{faster:?}");
    }

    #[test]
    fn few_executions_say_nothing() {
        for count in [0, 1, 19, 40] {
            let times = SortedTimes::of((0..count).map(f64::from).collect());
            let found = ExcessDependence::of_longest(&times, 1);
            assert!(found.inflation >= 1.0 && found.rise >= 1.0, "{found:?}");
        }
    }
}
