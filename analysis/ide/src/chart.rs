//! An axis of a drawing: from values to positions, and the values of its ticks.

/// A linear or logarithmic axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axis {
    /// The values at its ends; both are positive on a logarithmic axis.
    low: f64,
    high: f64,
    /// The positions of these values.
    start: f64,
    end: f64,
    is_logarithmic: bool,
}

impl Axis {
    /// Returns the linear axis from `low` to `high`; a part of `padding` is added at each end.
    pub(crate) fn linear((low, high): (f64, f64), padding: f64, (start, end): (f64, f64)) -> Axis {
        let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (0.0, 1.0) };
        // A single value is in the middle.
        let room = if high > low { (high - low) * padding } else { (low.abs() * 0.1).max(0.5) };
        // Times are not negative.
        let least = if low >= 0.0 { (low - room).max(0.0) } else { low - room };
        Axis { low: least, high: high + room, start, end, is_logarithmic: false }
    }

    /// Returns the logarithmic axis from `low` to `high`.
    pub(crate) fn logarithmic((low, high): (f64, f64), (start, end): (f64, f64)) -> Axis {
        let low = if low.is_finite() && low > 0.0 { low } else { f64::MIN_POSITIVE };
        let high = if high.is_finite() && high > low { high } else { low * 10.0 };
        Axis { low, high, start, end, is_logarithmic: true }
    }

    pub(crate) fn is_logarithmic(&self) -> bool {
        self.is_logarithmic
    }

    /// Returns the values at the ends.
    pub(crate) fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    pub(crate) fn has(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// Returns the position of a value; a value beyond an end is at the end.
    pub(crate) fn at(&self, value: f64) -> f64 {
        let value = if value.is_nan() { self.low } else { value.clamp(self.low, self.high) };
        let part = if self.is_logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.start + (self.end - self.start) * part
    }

    /// Returns the values of at most about `most` ticks, ascending: 1, 2 or 5 times a power of ten.
    ///
    /// The second value is the number of decimal places that tell the ticks apart, where a tick is divided by `unit`.
    pub(crate) fn ticks(&self, most: f64, unit: f64) -> (Vec<f64>, usize) {
        let (low, high) = (self.low / unit, self.high / unit);
        if self.is_logarithmic {
            let ticks = logarithmic_ticks(low, high, most);
            return (ticks.iter().map(|tick| tick * unit).collect(), 0);
        }
        let step = step((high - low) / most.max(1.0));
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        // The step is at least the length by `most`, so there are few ticks.
        let ticks = (first..=last.min(first.saturating_add(100))).map(|index| index as f64 * step * unit);
        (ticks.collect(), (-step.log10()).ceil().clamp(0.0, 12.0) as usize)
    }
}

/// Returns the least of 1, 2 and 5 times a power of ten that is at least `least`.
pub(crate) fn step(least: f64) -> f64 {
    if !(least.is_finite() && least > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|it| *it >= least * 0.999_999)
        .unwrap_or(10.0 * power)
}

fn logarithmic_ticks(low: f64, high: f64, most: f64) -> Vec<f64> {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let decades = (high / low).log10();
    let factors: &[f64] = if decades <= 0.8 {
        &[1.0, 2.0, 3.0, 5.0, 7.0]
    } else if decades <= 2.0 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    let every = ((decades / most.max(1.0)).ceil() as usize).max(1);
    let powers = (first..=last).step_by(every);
    let ticks = powers.flat_map(|power| factors.iter().map(move |factor| factor * 10_f64.powi(power)));
    ticks.filter(|tick| low * 0.999_999 <= *tick && *tick <= high * 1.000_001).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        let axis = Axis::linear((0.0, 97.0), 0.0, (0.0, 100.0));
        assert_eq!(axis.ticks(5.0, 1.0), (vec![0.0, 20.0, 40.0, 60.0, 80.0], 0));
        let narrow = Axis::linear((10_001_200.0, 10_003_400.0), 0.0, (0.0, 100.0));
        let (ticks, decimals) = narrow.ticks(4.0, 1e6);
        assert_eq!(ticks.len(), 2);
        assert_eq!(decimals, 3);
        let wide = Axis::logarithmic((1.0, 1e9), (0.0, 100.0));
        assert_eq!(wide.ticks(5.0, 1.0).0.len(), 5);
        let decade = Axis::logarithmic((8.0, 60.0), (0.0, 100.0));
        assert_eq!(decade.ticks(6.0, 1.0).0, [10.0, 20.0, 50.0]);
    }

    #[test]
    fn positions_stay_on_the_axis() {
        for range in [(3.0, 3.0), (0.0, 0.0), (f64::NAN, 1.0), (0.0, f64::INFINITY), (1.0, 1e300)] {
            for axis in [Axis::linear(range, 0.05, (10.0, 90.0)), Axis::logarithmic(range, (90.0, 10.0))] {
                for value in [-1.0, 0.0, 1.0, 3.0, 1e300, f64::NAN, f64::INFINITY] {
                    let at = axis.at(value);
                    assert!((10.0..=90.0).contains(&at), "{value} at {at} of {axis:?}");
                }
                assert!(axis.ticks(6.0, 1e6).0.len() <= 102);
            }
        }
        assert_eq!(Axis::linear((3.0, 3.0), 0.05, (0.0, 100.0)).at(3.0), 50.0);
    }
}
