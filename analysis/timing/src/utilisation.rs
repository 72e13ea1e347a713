//! The utilisation of a CPU, Σ λ/T, with an exact comparison with 1.

use std::cmp::Ordering;

use num_bigint::BigUint;

use crate::{CycleMean, Time};

/// Σ λ/T over some tasks: an exact rational number.
///
/// The exact sum of fractions with the periods of many tasks has thousands of digits. So the terms are kept, with a
/// fixed-point sum that is too low by less than 2⁻⁶² for each term; the exact sum is computed only if 1 is within
/// that error.
///
/// ```
/// use mauve_timing::{StateMachine, Time, Utilisation};
///
/// let mean = StateMachine::single(Time::from_nanos(1)).greatest_cycle_mean();
/// let third = || (mean, Time::from_nanos(3));
/// let utilisation = Utilisation::new([third(), third(), third()]);
/// assert_eq!(utilisation.compare_with_one(), std::cmp::Ordering::Equal);
/// ```
#[derive(Clone, PartialEq, Eq, Hash, Default, Debug)]
pub struct Utilisation {
    shares: Vec<TaskShare>,
    /// The sum of the shares rounded down, in units of 2⁻⁶², saturating.
    lower: u128,
    /// The number of rounded shares: the sum is too low by less than this number of units.
    rounded: u64,
}

/// λ/T of one task: `cost` / `denominator`.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(crate) struct TaskShare {
    denominator: u128,
    cost: u64,
    lower: u128,
    is_rounded: bool,
}

const FRACTION_BITS: u32 = 62;
const ONE: u128 = 1 << FRACTION_BITS;

impl TaskShare {
    pub(crate) fn new(mean: CycleMean, period: Time) -> TaskShare {
        // The length is at most 2²⁴. A period is never 0; 1 keeps the division defined.
        let denominator = u128::from(mean.length).saturating_mul(u128::from(period.as_nanos())).max(1);
        let cost = mean.cost.as_nanos();
        let scaled = u128::from(cost) << FRACTION_BITS;
        let lower = scaled / denominator;
        TaskShare { denominator, cost, lower, is_rounded: lower * denominator != scaled }
    }
}

impl Utilisation {
    /// Returns Σ over `tasks` of λ / period, with periods > 0. The order does not matter.
    pub fn new(tasks: impl IntoIterator<Item = (CycleMean, Time)>) -> Utilisation {
        Utilisation::sum(tasks.into_iter().map(|(mean, period)| TaskShare::new(mean, period)))
    }

    pub(crate) fn sum(shares: impl Iterator<Item = TaskShare>) -> Utilisation {
        let mut utilisation = Utilisation::default();
        for share in shares {
            utilisation.push(share);
        }
        // Equal sums of the same tasks compare equal.
        utilisation.shares.sort_unstable();
        utilisation
    }

    /// Adds a share, for comparisons with 1 only: the sum no longer compares equal to another of the same shares.
    pub(crate) fn push(&mut self, share: TaskShare) {
        self.lower = self.lower.saturating_add(share.lower);
        self.rounded += u64::from(share.is_rounded);
        self.shares.push(share);
    }

    /// Returns the value as an `f64`, with an error of about 10⁻¹⁵. For output only:
    /// [comparisons](Self::compare_with_one) are exact.
    pub fn as_f64(&self) -> f64 {
        self.lower as f64 / ONE as f64
    }

    /// Returns whether it exceeds 1: then the CPU is overloaded, and the backlog grows without bound.
    pub fn exceeds_one(&self) -> bool {
        self.compare_with_one() == Ordering::Greater
    }

    /// Compares exactly with 1.
    pub fn compare_with_one(&self) -> Ordering {
        self.compare_roughly(None).unwrap_or_else(|| {
            let (numerator, denominator) = self.exact();
            numerator.cmp(&denominator)
        })
    }

    /// Compares with 1, optionally without one of the shares; `None` if the fixed-point sum does not decide it.
    pub(crate) fn compare_roughly(&self, without: Option<&TaskShare>) -> Option<Ordering> {
        // A saturated sum is far greater than 1, also without any single share, since each share fits.
        let (mut lower, mut doubt) = (self.lower, u128::from(self.rounded));
        if let Some(share) = without {
            lower = lower.saturating_sub(share.lower);
            doubt = doubt.saturating_sub(u128::from(share.is_rounded));
        }
        match () {
            () if lower > ONE => Some(Ordering::Greater),
            () if lower + doubt < ONE => Some(Ordering::Less),
            () if doubt == 0 => Some(Ordering::Equal),
            () => None,
        }
    }

    /// Returns the sum without one of its shares.
    pub(crate) fn without(&self, share: &TaskShare) -> Utilisation {
        let mut shares = self.shares.clone();
        if let Some(at) = shares.iter().position(|it| it == share) {
            shares.swap_remove(at);
        }
        Utilisation::sum(shares.into_iter())
    }

    /// Returns the sum as an unreduced fraction: its denominator is the product of the distinct denominators.
    fn exact(&self) -> (BigUint, BigUint) {
        let mut shares = self.shares.clone();
        shares.sort_unstable();
        let fractions: Vec<(BigUint, BigUint)> = shares
            .chunk_by(|a, b| a.denominator == b.denominator)
            .map(|same| {
                let numerator: BigUint = same.iter().map(|share| BigUint::from(share.cost)).sum();
                (numerator, BigUint::from(same.first().map_or(1, |share| share.denominator)))
            })
            .collect();
        sum(&fractions)
    }
}

/// Sums fractions by halves, so that the factors of each product have similar sizes.
fn sum(fractions: &[(BigUint, BigUint)]) -> (BigUint, BigUint) {
    match fractions {
        [] => (BigUint::ZERO, BigUint::from(1u32)),
        [fraction] => fraction.clone(),
        _ => {
            let (left, right) = fractions.split_at(fractions.len() / 2);
            let ((n1, d1), (n2, d2)) = (sum(left), sum(right));
            (n1 * &d2 + n2 * &d1, d1 * d2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(terms: &[(u64, u64, u64)], expected: Ordering) {
        let tasks = terms.iter().map(|&(cost, length, period)| {
            (CycleMean { cost: Time::from_nanos(cost), length }, Time::from_nanos(period))
        });
        let utilisation = Utilisation::new(tasks.clone());
        assert_eq!(utilisation.compare_with_one(), expected, "{terms:?}");
        assert_eq!(utilisation.exceeds_one(), expected == Ordering::Greater, "{terms:?}");
        assert_eq!(utilisation, Utilisation::new(tasks.clone().rev()));
        for left_out in 0..terms.len() {
            let others = tasks.clone().enumerate().filter(|(at, _)| *at != left_out).map(|(_, task)| task);
            let expected = Utilisation::new(others);
            let share =
                tasks.clone().nth(left_out).map(|(mean, period)| TaskShare::new(mean, period)).unwrap();
            assert_eq!(utilisation.without(&share), expected, "{terms:?} without {left_out}");
            let rough = utilisation.compare_roughly(Some(&share));
            assert!(rough.is_none_or(|it| it == expected.compare_with_one()), "{terms:?} without {left_out}");
        }
    }

    #[test]
    fn one_is_neither_less_nor_more() {
        check(&[], Ordering::Less);
        check(&[(1, 1, 1)], Ordering::Equal);
        check(&[(1, 1, 2), (1, 1, 3), (1, 1, 6)], Ordering::Equal);
        check(&[(3, 3, 7), (6, 7, 1)], Ordering::Equal);
        check(&[(1, 1, 3); 3], Ordering::Equal);
        check(&[(1, 1, 3); 4], Ordering::Greater);
        // Less than one by 1/(p·q), and more than one by as much, for p and q near 2⁶³.
        let (p, q) = ((1 << 63) - 25, (1u64 << 63) - 165);
        let half = |n: u64| n / 2;
        check(&[(half(p), 1, p), (half(q), 1, q)], Ordering::Less);
        check(&[(half(p) + 1, 1, p), (half(q), 1, q)], Ordering::Less);
        check(&[(half(p), 1, p), (half(q) + 1, 1, q)], Ordering::Greater);
        check(&[(u64::MAX - 1, 1, u64::MAX), (1, 1, u64::MAX)], Ordering::Equal);
        check(&[(u64::MAX - 1, 1, u64::MAX), (1, 1, u64::MAX), (1, 1 << 24, u64::MAX)], Ordering::Greater);
    }

    #[test]
    fn sums_of_extreme_shares_are_exact() {
        check(&[(u64::MAX, 1, 1); 100], Ordering::Greater);
        check(&[(0, 1, 1), (0, 1 << 24, u64::MAX)], Ordering::Less);
    }

    #[test]
    fn the_float_is_near() {
        let mean = CycleMean { cost: Time::from_nanos(997), length: 1 };
        let utilisation = Utilisation::new([(mean, Time::from_nanos(1000))]);
        assert!((utilisation.as_f64() - 0.997).abs() < 1e-15);
    }
}
