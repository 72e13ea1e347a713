//! The probabilistic worst-case execution time of one codel or program, from its measured executions.

use crate::checks::{Check, CheckKind, adjust, checks};
use crate::convergence::{Convergence, convergence};
use crate::counted::{counted_bound, counted_bounds, counted_from};
use crate::distributions::chi_square;
use crate::gpd::Gpd;
use crate::hold_out::{HoldOut, hold_out};
use crate::order::{SortedTimes, resolution};
use crate::refusal::{EstimateRefusal, NoBound, NoEstimate, greatest_ratio};
use crate::tail::{ACCEPTED, LEAST_EXECUTIONS, Tail, excesses};

/// What an estimate is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateOptions {
    /// The levels: probabilities that an execution takes longer, each in (0, 1).
    pub levels: Vec<f64>,
    /// The seed of all random numbers: the same seed gives the same estimate on each machine.
    pub seed: u64,
}

/// An estimate, with everything that it rests on. Times are in nanoseconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// How many executions were measured.
    pub count: usize,
    /// The least time.
    pub least: u64,
    /// The greatest time: the high-water mark.
    pub greatest: u64,
    /// The mean time.
    pub mean: f64,
    /// What all differences of times are multiples of.
    pub resolution: u64,
    /// How many distinct times there are.
    pub distinct: usize,
    /// The tail.
    pub tail: Tail,
    /// The tests of the assumptions.
    pub checks: Vec<Check>,
    /// What the first half promises, counted in the second.
    pub hold_out: Vec<HoldOut>,
    /// The estimates from parts of the sample.
    pub convergence: Vec<Convergence>,
    /// The times of the levels, in the order of [`EstimateOptions::levels`].
    pub levels: Vec<LevelEstimate>,
    /// The fitted tail with its confidence band, for a drawing.
    pub curve: Vec<CurvePoint>,
    /// What a reader must know before using the times; [`warnings_at`](Self::warnings_at) has those of one level.
    pub warnings: Vec<Warning>,
}

impl Estimate {
    /// Returns what is known against the bound of a level, by the index of the level: a verdict at a level is for these.
    ///
    /// A bound that is counted needs no tail, so what is wrong with the tail is no warning there.
    pub fn warnings_at(&self, index: usize) -> Vec<Warning> {
        let Some(at) = self.levels.get(index) else { return Vec::new() };
        let mut warnings = self.warnings.clone();
        warnings.retain(|warning| match warning {
            Warning::Far { level, .. } | Warning::NotConverged { level, .. } => at.level <= *level,
            Warning::Rejected(check) if check.kind != CheckKind::LightTail => true,
            Warning::Few { .. } => true,
            _ => at.is_extrapolated,
        });
        if at.is_extrapolated && at.bound.is_ok() {
            let needed = counted_from(at.level);
            warnings.push(Warning::Extrapolated { level: at.level, needed });
        }
        warnings
    }
}

/// The time of one level, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelEstimate {
    /// The probability that an execution takes longer.
    pub level: f64,
    /// The estimate: on perfect data, too low in half of all cases.
    pub point: f64,
    /// The 95 % upper confidence bound: the time for tables, rounded up to the resolution of the clock; or why there is none.
    pub bound: Result<f64, NoBound>,
    /// Whether it is extrapolated from the tail, not counted in the sample.
    pub is_extrapolated: bool,
    /// The level times the number of executions: how many of them should exceed the time.
    pub depth: f64,
}

/// A point of the fitted tail: times that an execution exceeds with a probability, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// The probability.
    pub probability: f64,
    /// The lower end of the 95 % confidence interval.
    pub lower: f64,
    /// The estimate.
    pub point: f64,
    /// The upper end.
    pub upper: f64,
}

/// A reason to distrust an estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Warning {
    /// Fewer executions than [`FEW_EXECUTIONS`].
    Few {
        /// How many there are.
        count: usize,
    },
    /// A test rejects an assumption.
    Rejected(Check),
    /// No threshold gives a tail that fits.
    PoorFit {
        /// The probability of so bad a fit.
        p: f64,
    },
    /// The clock is coarse beside the spread of the tail.
    Coarse {
        /// The resolution, in nanoseconds.
        resolution: u64,
        /// The scale of the tail, in nanoseconds.
        scale: f64,
    },
    /// The last tenth of the sample moved the estimate above its earlier upper bound.
    NotConverged {
        /// The level.
        level: f64,
        /// The upper bound without the last tenth.
        before: f64,
        /// The estimate with it.
        now: f64,
    },
    /// The bound of a level is more than [`FAR`] times the high-water mark: so few executions do not support it.
    Far {
        /// The least strict such level.
        level: f64,
        /// The bound divided by the high-water mark.
        ratio: f64,
    },
    /// The bound of a level is that of the fitted tail: so few executions cannot count it. It is no warning about the whole estimate:
    /// [`Estimate::warnings_at`] gives it.
    ///
    /// The tail is that of the mode which most of the longest executions have. A mode that fewer than 25 executions have is hardly seen
    /// among the others, and may be the longest at each level below 25/n: so at each level without a bound that is counted.
    Extrapolated {
        /// The level.
        level: f64,
        /// With so many executions, the level is counted.
        needed: u64,
    },
}

/// A bound that is so many times the high-water mark gives a warning.
pub const FAR: f64 = 10.0;

/// Fewer executions give a warning.
pub const FEW_EXECUTIONS: usize = 500;

/// An estimate needs at least as many distinct times.
pub const LEAST_DISTINCT: usize = 20;

/// Returns a time in nanoseconds with at most four significant digits, rounded up; 0 for less than that.
///
/// ```
/// assert_eq!(mauve_pwcet::rounded_up(8_123_456.7), 8_124_000);
/// assert_eq!(mauve_pwcet::rounded_up(12.3), 13);
/// ```
pub fn rounded_up(nanoseconds: f64) -> u64 {
    // A cast saturates; a value that is no number becomes 0.
    let whole = nanoseconds.ceil() as u64;
    let mut step = 1_u64;
    while whole / step >= 10_000 {
        step *= 10;
    }
    whole.div_ceil(step).saturating_mul(step)
}

/// Estimates the times that an execution exceeds with the probabilities of the levels.
///
/// `executions` are in nanoseconds, in the order in which they were measured.
///
/// # Errors
///
/// No tail fits the executions: the levels that can be counted have bounds nevertheless.
pub fn estimate(executions: &[u64], options: &EstimateOptions) -> Result<Estimate, NoEstimate> {
    let count = executions.len();
    let refused = |refusal| {
        let bounds = counted_bounds(executions, &options.levels).into_iter().zip(&options.levels);
        let bound = |(bound, &level): (Option<f64>, &f64)| {
            bound.ok_or(NoBound { refusal, needed: counted_from(level) })
        };
        Err(NoEstimate { refusal, bounds: bounds.map(bound).collect() })
    };
    if count < LEAST_EXECUTIONS {
        return refused(EstimateRefusal::TooFew { count });
    }
    let resolution = resolution(executions);
    let least = executions.iter().copied().min().unwrap_or_default();
    let greatest = executions.iter().copied().max().unwrap_or_default();
    if resolution == 0 {
        return refused(EstimateRefusal::Constant { time: greatest });
    }
    let mut values = executions.to_vec();
    values.sort_unstable();
    values.dedup();
    let distinct = values.len();
    if distinct < LEAST_DISTINCT {
        return refused(EstimateRefusal::TooCoarse { distinct, resolution });
    }
    let times = SortedTimes::new(executions, resolution, options.seed);
    let tail = match Tail::select(&times) {
        Ok(tail) => tail,
        Err(refusal) => return refused(refusal),
    };
    // Steps that hide the shape of the tail: one more of them must not give a figure.
    if resolution as f64 > tail.model.scale / 2.0 {
        return refused(EstimateRefusal::TooCoarse { distinct, resolution });
    }
    if tail.model.shape >= 1.0 {
        return refused(EstimateRefusal::InfiniteMean { shape: tail.model.shape });
    }
    let seen = SeenExecutions { count, greatest, resolution };
    let levels = level_estimates(&options.levels, &times, &tail, seen);
    let strictest = options.levels.iter().copied().fold(1e-9, f64::min);
    let curve = curve(&times, &tail, strictest);
    let hold_out = hold_out(&times);
    let checks = all_checks(&times, &tail, &hold_out);
    let convergence = convergence(&times, &options.levels);
    let mut estimate = Estimate {
        count,
        least,
        greatest,
        mean: executions.iter().map(|&time| time as f64).sum::<f64>() / count as f64,
        resolution,
        distinct,
        tail,
        checks,
        hold_out,
        convergence,
        levels,
        curve,
        warnings: Vec::new(),
    };
    estimate.warnings = warnings(&estimate);
    Ok(estimate)
}

/// What was measured, as far as the bounds depend on it.
#[derive(Clone, Copy)]
struct SeenExecutions {
    count: usize,
    greatest: u64,
    resolution: u64,
}

/// Returns the estimates of the levels.
fn level_estimates(
    all: &[f64],
    times: &SortedTimes,
    tail: &Tail,
    SeenExecutions { count, greatest, resolution }: SeenExecutions,
) -> Vec<LevelEstimate> {
    let greatest = greatest as f64;
    let (mut greatest_bound, mut is_absurd) = (0.0_f64, false);
    let mut levels = vec![None; all.len()];
    // At a stricter level, a time is never shorter.
    let mut order: Vec<usize> = (0..levels.len()).collect();
    order.sort_by(|&a, &b| all[b].total_cmp(&all[a]));
    for index in order {
        let level = all[index];
        let depth = level * count as f64;
        // Where no time of the sample is above the quantile with the confidence, the bound is not below the greatest one: the fit
        // may not know the rare mode that gave it.
        let counted = counted_bound(times, level);
        let upper =
            counted.unwrap_or_else(|| tail.upper_bound(times, level).max(greatest)) + resolution as f64;
        greatest_bound = greatest_bound.max(upper);
        let ratio = greatest_bound / greatest;
        is_absurd |= ratio > greatest_ratio(depth);
        let refusal = EstimateRefusal::Absurd { ratio };
        levels[index] = Some(LevelEstimate {
            level,
            point: tail.exceeded_with(times, level),
            bound: match is_absurd {
                false => Ok(greatest_bound),
                true => Err(NoBound { refusal, needed: counted_from(level) }),
            },
            is_extrapolated: counted.is_none(),
            depth,
        });
    }
    levels.into_iter().flatten().collect()
}

/// Returns the tail from its threshold to a probability, with four points for each power of ten.
fn curve(times: &SortedTimes, tail: &Tail, strictest: f64) -> Vec<CurvePoint> {
    let probabilities =
        (0..).map(|step| 10_f64.powf(-f64::from(step) / 4.0)).take_while(|&it| it >= strictest * 0.99);
    let point = |probability| {
        let lower = tail.lower_bound(probability)?;
        let (point, upper) = (tail.exceeded_with(times, probability), tail.upper_bound(times, probability));
        Some(CurvePoint { probability, lower, point, upper })
    };
    probabilities.filter_map(point).collect()
}

/// The tests of the assumptions, adjusted for their number.
fn all_checks(times: &SortedTimes, tail: &Tail, hold_out: &[HoldOut]) -> Vec<Check> {
    let mut checks = checks(times);
    let excesses = excesses(times, tail.excesses);
    let exponential = Gpd { shape: 0.0, scale: excesses.iter().sum::<f64>() / excesses.len() as f64 };
    let heavier = if tail.free.shape > 0.0 { tail.free } else { exponential };
    let ratio = 2.0 * (heavier.log_likelihood(&excesses) - exponential.log_likelihood(&excesses));
    // ξ = 0 is on the border of ξ ≥ 0: half of the ratios are 0 (Self and Liang 1987).
    let p = if ratio <= 0.0 { 1.0 } else { chi_square(ratio, 1) / 2.0 };
    checks.push(Check { kind: CheckKind::LightTail, statistic: ratio.max(0.0), p, adjusted: p });
    // The worst of its levels, for as many levels.
    if let Some(worst) = hold_out.iter().min_by(|a, b| a.p.total_cmp(&b.p)) {
        let p = (worst.p * hold_out.len() as f64).min(1.0);
        checks.push(Check { kind: CheckKind::HoldOut, statistic: worst.exceedances as f64, p, adjusted: p });
    }
    adjust(&mut checks);
    checks
}

fn warnings(estimate: &Estimate) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let Estimate { count, tail, resolution, .. } = estimate;
    if *count < FEW_EXECUTIONS {
        warnings.push(Warning::Few { count: *count });
    }
    warnings
        .extend(estimate.checks.iter().filter(|check| check.is_rejected()).copied().map(Warning::Rejected));
    if tail.p < ACCEPTED {
        warnings.push(Warning::PoorFit { p: tail.p });
    }
    if *resolution as f64 > tail.model.scale / 4.0 {
        warnings.push(Warning::Coarse { resolution: *resolution, scale: tail.model.scale });
    }
    if let Some(before) = estimate.convergence.last().filter(|last| last.count * 10 >= count * 8) {
        // Where a bound is counted, the point of the fit beside it may be above it: the tail of the fit has no end.
        let mut levels = estimate.levels.iter().zip(&before.levels);
        let moved = levels.find(|(now, (_, upper))| now.is_extrapolated && now.point > *upper);
        warnings.extend(moved.map(|(now, &(_, before))| Warning::NotConverged {
            level: now.level,
            before,
            now: now.point,
        }));
    }
    let ratios =
        estimate.levels.iter().filter_map(|it| Some((it.level, it.bound.ok()? / estimate.greatest as f64)));
    let far = ratios.filter(|(_, ratio)| *ratio > FAR).max_by(|a, b| a.0.total_cmp(&b.0));
    warnings.extend(far.map(|(level, ratio)| Warning::Far { level, ratio }));
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{generator, uniform};

    fn options(levels: &[f64]) -> EstimateOptions {
        EstimateOptions { levels: levels.to_vec(), seed: 1 }
    }

    /// 20,000 exponential times around 4 ms. To `slow` of them, 10 ms are added.
    fn with_rare_mode(slow: usize) -> Vec<u64> {
        let mut random = generator(5, 0);
        let time = |index: usize| {
            let rare = if index % 5000 == 777 && index / 5000 < slow { 1e7 } else { 0.0 };
            (4e6 - 1e5 * uniform(&mut random).ln() + rare) as u64
        };
        (0..20_000).map(time).collect()
    }

    /// 2 of 20,000 should exceed the time of 1e-4: a bound from the other executions, below all of a rare mode, would be wrong.
    #[test]
    fn a_rare_mode_has_no_bound_from_the_other_executions() {
        let levels = [1e-3, 1.5e-4, 1e-4, 1e-5, 1e-9];
        for slow in 1..=4 {
            let executions = with_rare_mode(slow);
            let greatest = executions.iter().copied().max().unwrap() as f64;
            let refused = estimate(&executions, &options(&levels)).unwrap_err();
            assert_eq!(refused.refusal, EstimateRefusal::RareMode { slow });
            // 20 should exceed this one: the mode is rarer. 3 should exceed the next one, which may be counted.
            assert!(refused.bounds[0].unwrap() < 6e6, "{refused:?}");
            assert!(refused.bounds[1].is_err() || refused.bounds[1].unwrap() >= greatest, "{refused:?}");
            assert!(refused.bounds[2..].iter().all(Result::is_err), "{refused:?}");
        }
        let found = estimate(&with_rare_mode(0), &options(&levels)).unwrap();
        assert_eq!(found.warnings, []);
    }

    /// A mode of 1 % with a tail that is five times as long is a warning at the levels that need a tail, not at that of 20 exceedances.
    #[test]
    fn a_verdict_is_one_of_a_level() {
        let mut random = generator(8, 0);
        let mut time = |index: usize| {
            (4e6 - uniform(&mut random).ln() * if index % 100 == 3 { 5e5 } else { 1e5 }) as u64
        };
        let executions: Vec<u64> = (0..20_000).map(&mut time).collect();
        let found = estimate(&executions, &options(&[1e-6, 1e-3, 1e-4])).unwrap();
        let is_heavy = |it: &Warning| matches!(it, Warning::Rejected(it) if it.kind == CheckKind::LightTail);
        assert!(found.warnings.iter().any(is_heavy), "{:?}", found.warnings);
        assert_eq!(found.warnings_at(1), []);
        for (index, needed) in [(0, 2_995_731), (2, 29_956)] {
            let warnings = found.warnings_at(index);
            let level = found.levels[index].level;
            assert!(warnings.contains(&Warning::Extrapolated { level, needed }), "{warnings:?}");
            assert!(warnings.iter().any(is_heavy), "{warnings:?}");
        }
        assert_eq!(found.warnings_at(3), []);
    }

    /// Times of 40 steps, but a tail of two or three: its 40 distinct times are not those of a tail.
    #[test]
    fn steps_that_hide_the_tail_give_no_figure() {
        let mut random = generator(6, 0);
        let mut time = |index: u64| (index % 37 + (-uniform(&mut random).ln()) as u64) * 1000;
        let executions: Vec<u64> = (0..20_000).map(&mut time).collect();
        let refused = estimate(&executions, &options(&[1e-3, 1e-6])).unwrap_err();
        assert!(
            matches!(refused.refusal, EstimateRefusal::TooCoarse { distinct: 40.., resolution: 1000 }),
            "{refused:?}"
        );
        assert!(refused.bounds[0].is_ok() && refused.bounds[1].is_err(), "{refused:?}");
    }

    /// The quantiles of a generalised Pareto tail, in an order that looks random: with ξ = 0.9, the bound of 3000 executions at 1e-6
    /// is hundreds of times the greatest; with ξ = 0.3, it is a few times.
    #[test]
    fn a_bound_far_beyond_few_executions_is_none() {
        let of = |shape: f64, count: u64| {
            let time = |it: u64| {
                let share = ((it * 1213 % count) as f64 + 0.5) / count as f64;
                1e5 + 2e3 * (share.powf(-shape) - 1.0) / shape
            };
            let executions: Vec<u64> = (0..count).map(|it| time(it) as u64).collect();
            estimate(&executions, &options(&[1e-3, 1e-4, 1e-6])).map(|it| it.levels)
        };
        let light = of(0.3, 3001).unwrap();
        assert!(light.iter().all(|it| it.bound.is_ok()), "{light:?}");
        let heavy = of(0.9, 3001).unwrap();
        assert!(heavy[0].bound.is_ok(), "{heavy:?}");
        let Err(NoBound { refusal: EstimateRefusal::Absurd { ratio }, needed }) = heavy[2].bound else {
            panic!("{heavy:?}")
        };
        assert!((180.0..1000.0).contains(&ratio) && needed == 2_995_731, "{heavy:?}");
    }

    /// 3 of 300 executions are a hundred times as long: the deepest levels have no bound, the others keep theirs.
    #[test]
    fn an_absurd_bound_leaves_the_other_levels() {
        let executions: Vec<u64> = (0..300_u64)
            .map(|it| {
                let share = (it * 211 % 300) as f64 / 300.0 + 0.001_6;
                (1e4 - 1e4 * share.ln() + if it % 100 == 7 { 1e5 * (1.0 + it as f64 / 100.0) } else { 0.0 })
                    as u64
            })
            .collect();
        let levels = [0.02, 1e-3, 1e-4, 1e-9];
        let found = estimate(&executions, &options(&levels)).unwrap();
        let bound = |index: usize| found.levels[index].bound;
        assert!(bound(0).is_ok() && bound(1).is_ok(), "{:?}", found.levels);
        let Err(NoBound { refusal: EstimateRefusal::Absurd { ratio }, needed }) = bound(3) else {
            panic!("{:?}", found.levels)
        };
        assert!(ratio > 1000.0 && needed == 2_995_732_273, "{ratio} {needed}");
    }
}
