//! Times, levels, probabilities and counts as text: at most four significant digits, and one unit for all times of a codel.

/// The unit of all times of one codel, so that its figures compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimeUnit {
    pub(super) name: &'static str,
    pub(super) nanoseconds: f64,
}

impl TimeUnit {
    /// Returns the greatest unit in which this time is at least 1.
    pub(super) fn of(nanoseconds: f64) -> TimeUnit {
        let units = [("s", 1e9), ("ms", 1e6), ("µs", 1e3)];
        let unit = units.into_iter().find(|(_, size)| nanoseconds >= *size).unwrap_or(("ns", 1.0));
        TimeUnit { name: unit.0, nanoseconds: unit.1 }
    }

    /// Returns a time without its unit.
    pub(super) fn number(&self, nanoseconds: f64) -> String {
        significant(nanoseconds / self.nanoseconds)
    }

    /// Returns a time with its unit.
    pub(super) fn time(&self, nanoseconds: f64) -> String {
        format!("{}\u{a0}{}", self.number(nanoseconds), self.name)
    }

    /// Returns a bound without its unit: rounded up, so that the text is a bound too.
    pub(super) fn bound_number(&self, nanoseconds: f64) -> String {
        let value = nanoseconds / self.nanoseconds;
        if !value.is_finite() || value <= 0.0 {
            return significant(value);
        }
        let step = 10_f64.powi(value.log10().floor() as i32 - 3);
        // A bound of four digits, such as 1.234, is not rounded up to 1.235 for an error of floating point.
        significant((value / step - 1e-6).ceil() * step)
    }

    /// Returns a bound with its unit.
    pub(super) fn bound(&self, nanoseconds: f64) -> String {
        format!("{}\u{a0}{}", self.bound_number(nanoseconds), self.name)
    }
}

/// Returns a number with four significant digits, without zeros at the end of its decimal places.
pub(super) fn significant(value: f64) -> String {
    if !value.is_finite() {
        return "∞".to_owned();
    }
    if value < 0.0 {
        return format!("−{}", significant(-value));
    }
    let scientific = format!("{value:.3e}");
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or_default();
    match exponent {
        // Four digits and zeros.
        4..=6 => grouped(digits.parse().unwrap_or(0.0) * 10_f64.powi(exponent)),
        -4..=3 => trimmed(&format!("{value:.*}", (3 - exponent) as usize)).to_owned(),
        _ => format!("{}e{exponent}", trimmed(digits)),
    }
}

fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

/// Returns a whole number with a narrow space between groups of three digits, from five digits on.
fn grouped(value: f64) -> String {
    let digits = format!("{value:.0}");
    if digits.len() < 5 {
        return digits;
    }
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// Returns a number of executions, with all digits.
pub(super) fn count(number: usize) -> String {
    grouped(number as f64)
}

/// Returns a number of things: `1 warning`, `2 warnings`.
pub(super) fn counted(number: usize, thing: &str) -> String {
    format!("{}\u{a0}{thing}{}", count(number), if number == 1 { "" } else { "s" })
}

/// Returns a level as in timing tables: `1e-4`.
pub(super) fn level(level: f64) -> String {
    format!("{level:e}")
}

/// Returns a probability that is not a level, with two digits.
pub(super) fn rate(probability: f64) -> String {
    let text = format!("{probability:.1e}");
    text.replace(".0e", "e")
}

/// Returns a number with two significant digits.
pub(super) fn rounded(value: f64) -> String {
    let scientific = format!("{value:.1e}");
    significant(scientific.parse().unwrap_or(value))
}

/// Returns the probability of a test.
pub(super) fn p_value(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

/// Returns a factor.
pub(super) fn ratio(value: f64) -> String {
    let digits = if value < 10.0 {
        format!("{value:.2}")
    } else if value < 100.0 {
        format!("{value:.1}")
    } else {
        significant(value)
    };
    format!("{digits}\u{a0}×")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_four_significant_digits() {
        let found = [0.0, 1.0, 0.5, 17.25, 123.456, 1234.5678, 98765.4, 1e-5, 1e9, f64::NAN].map(significant);
        assert_eq!(found, ["0", "1", "0.5", "17.25", "123.5", "1235", "98\u{202f}770", "1e-5", "1e9", "∞"]);
        assert_eq!(significant(999.96), "1000");
        assert_eq!(significant(-0.123_45), "−0.1235");
    }

    #[test]
    fn bounds_round_up() {
        let unit = TimeUnit::of(2_500_000.0);
        assert_eq!([unit.time(1_234_100.0), unit.bound(1_234_100.0)], ["1.234\u{a0}ms", "1.235\u{a0}ms"]);
        assert_eq!(unit.bound(1_234_000.0), "1.234\u{a0}ms");
        assert_eq!(unit.bound(9_999_900.0), "10\u{a0}ms");
        assert_eq!([999.0, 1e3, 1e6, 1e9].map(|time| TimeUnit::of(time).name), ["ns", "µs", "ms", "s"]);
    }

    #[test]
    fn counts_and_levels() {
        assert_eq!(
            [9_999, 10_000, 1_234_567].map(count),
            ["9999", "10\u{202f}000", "1\u{202f}234\u{202f}567"]
        );
        assert_eq!([1e-4, 5e-9, 0.01].map(level), ["1e-4", "5e-9", "1e-2"]);
        assert_eq!([0.000_1, 0.05].map(p_value), ["< 0.001", "0.050"]);
    }
}
