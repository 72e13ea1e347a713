//! The boundary between values with which deadlines are proved and values with which they are not: the bisection.

use mauve_timing::Time;

/// A longer period is searched up to this many times the present one.
const MOST_LONGER: u64 = 64;

/// The result of a bisection, in nanoseconds. They are neighbours if the search was not ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ProofBoundary {
    /// A value with which `holds` was true.
    pub(crate) good: u64,
    /// A value with which it was false.
    pub(crate) bad: u64,
}

impl ProofBoundary {
    /// Bisects between a value with which `holds` is true and one with which it is false, either of them the greater one. Ends
    /// where `holds` is unknown. Where `holds` is monotone, no value on the far side of `bad` is better than `good`.
    pub(crate) fn between(
        mut good: u64,
        mut bad: u64,
        mut holds: impl FnMut(Time) -> Option<bool>,
    ) -> ProofBoundary {
        while good.abs_diff(bad) > 1 {
            let middle = good.midpoint(bad);
            match holds(Time::from_nanos(middle)) {
                Some(true) => good = middle,
                Some(false) => bad = middle,
                None => break,
            }
        }
        ProofBoundary { good, bad }
    }

    /// Returns the first of 2, 4, 8 … [`MOST_LONGER`] times `now` with which `holds` is true, as the good value, and the one before it;
    /// the inner none where there is none. The outer none: `holds` is unknown.
    pub(crate) fn above(
        now: u64,
        mut holds: impl FnMut(Time) -> Option<bool>,
    ) -> Option<Option<ProofBoundary>> {
        let (mut bad, mut factor) = (now, 2);
        while let Some(good) = now.checked_mul(factor).filter(|_| factor <= MOST_LONGER) {
            if holds(Time::from_nanos(good))? {
                return Some(Some(ProofBoundary { good, bad }));
            }
            (bad, factor) = (good, factor * 2);
        }
        Some(None)
    }

    /// Returns whether the search was not ended before the two values were neighbours.
    pub(crate) fn is_complete(self) -> bool {
        self.good.abs_diff(self.bad) <= 1
    }
}

/// Returns the steps in which a time is searched for: the greatest power of ten that is at most 1 ms and a hundredth of it.
pub(crate) fn step_of(time: Time) -> u64 {
    let mut step = 1_000_000;
    while step > 1 && step > time.as_nanos() / 100 {
        step /= 10;
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_boundary_is_found_from_both_sides(low in 0_u64..1000, first in 0_u64..1000, high in 0_u64..1000) {
            let (good, bad) = (low, low + first + high + 1);
            let last = low + first;
            let boundary = ProofBoundary::between(good, bad, |time| Some(time.as_nanos() <= last));
            prop_assert_eq!(boundary, ProofBoundary { good: last, bad: last + 1 });
            let boundary = ProofBoundary::between(bad, good, |time| Some(time.as_nanos() > last));
            prop_assert_eq!(boundary, ProofBoundary { good: last + 1, bad: last });
        }
    }

    #[test]
    fn a_search_that_is_ended_claims_only_what_was_tested() {
        let mut steps = 3;
        let boundary = ProofBoundary::between(0, 1 << 20, |time| {
            steps -= 1;
            (steps >= 0).then_some(time.as_nanos() <= 700_000)
        });
        assert_eq!(boundary, ProofBoundary { good: 655_360, bad: 786_432 });
        assert!(!boundary.is_complete());
    }
}
