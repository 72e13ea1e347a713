//! Durations in whole nanoseconds, read from decimal text without passing through a float.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A duration, from 0 to 2⁶⁴ − 1 nanoseconds (584 years).
///
/// ```
/// use mauve_timing::{Rounding, Time, Unit};
///
/// let time = Time::parse("0.25", Unit::Milliseconds, Rounding::Exact)?;
/// assert_eq!(time, Time::from_nanos(250_000));
/// assert_eq!(time.to_string(), "0.25 ms");
/// # Ok::<(), mauve_timing::TimeError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Debug, Serialize, Deserialize)]
pub struct Time(u64);

impl Time {
    /// No time at all.
    pub const ZERO: Time = Time(0);

    /// `nanos` nanoseconds.
    pub const fn from_nanos(nanos: u64) -> Time {
        Time(nanos)
    }

    /// The duration in nanoseconds.
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// The sum; `None` where it exceeds 2⁶⁴ − 1 ns.
    pub fn checked_add(self, other: Time) -> Option<Time> {
        self.0.checked_add(other.0).map(Time)
    }

    /// The difference; `None` where `other` is longer.
    pub fn checked_sub(self, other: Time) -> Option<Time> {
        self.0.checked_sub(other.0).map(Time)
    }

    /// `times` of this duration; `None` where that exceeds 2⁶⁴ − 1 ns.
    pub fn checked_mul(self, times: u64) -> Option<Time> {
        self.0.checked_mul(times).map(Time)
    }

    /// The value in `unit`, as the nearest `f64`. For output only: nothing may be computed from it.
    pub fn as_f64(self, unit: Unit) -> f64 {
        let nanos_per_unit = unit.nanos();
        // Both conversions are exact up to 2⁵³, so that the division is the only rounding.
        if self.0 <= 1 << 53 {
            return self.0 as f64 / nanos_per_unit as f64;
        }
        let digits = unit.decimals() as usize;
        let (whole, rest) = (self.0 / nanos_per_unit, self.0 % nanos_per_unit);
        let text = format!("{whole}.{rest:0digits$}");
        text.parse().unwrap_or(self.0 as f64 / nanos_per_unit as f64)
    }

    /// Reads `number`, a decimal number of `unit`s: `40`, `+3`, `0.5`, `1e-3`, `1_000.25`.
    ///
    /// The result is exact, digit by digit. Fractions of a nanosecond are rounded as `rounding` says.
    /// A point needs digits on both sides, and an underscore must be between two digits.
    pub fn parse(number: &str, unit: Unit, rounding: Rounding) -> Result<Time, TimeError> {
        let decimal = Decimal::read(number.trim()).ok_or(TimeError::NotANumber)?;
        if decimal.digits.is_empty() {
            return Ok(Time::ZERO);
        }
        if decimal.negative {
            return Err(TimeError::Negative);
        }
        // The value is `digits` × 10^`scale` ns; `digits` neither starts nor ends with a zero.
        let scale = decimal.exponent + i64::from(unit.decimals());
        let whole_digits = decimal.digits.len() as i64 + scale;
        if whole_digits > 20 {
            return Err(TimeError::TooLarge);
        }
        let mut nanos = 0u64;
        for position in 0..whole_digits {
            let digit = decimal.digits.get(position as usize).copied().unwrap_or(0);
            nanos = nanos
                .checked_mul(10)
                .and_then(|nanos| nanos.checked_add(u64::from(digit)))
                .ok_or(TimeError::TooLarge)?;
        }
        let is_whole = scale >= 0;
        match rounding {
            _ if is_whole => Ok(Time(nanos)),
            Rounding::Down => Ok(Time(nanos)),
            Rounding::Up => nanos.checked_add(1).map(Time).ok_or(TimeError::TooLarge),
            Rounding::Exact => Err(TimeError::TooFine),
        }
    }

    /// Reads the quotient of two decimal numbers, in `unit`s: `1000/30`. The result is exact but for fractions of a nanosecond,
    /// which are rounded as `rounding` says.
    ///
    /// ```
    /// use mauve_timing::{Rounding, Time, TimeError, Unit};
    /// let third = |rounding| Time::quotient("1", "3", Unit::Microseconds, rounding);
    /// assert_eq!(third(Rounding::Down), Ok(Time::from_nanos(333)));
    /// assert_eq!(third(Rounding::Up), Ok(Time::from_nanos(334)));
    /// assert_eq!(third(Rounding::Exact), Err(TimeError::TooFine));
    /// ```
    pub fn quotient(
        numerator: &str,
        denominator: &str,
        unit: Unit,
        rounding: Rounding,
    ) -> Result<Time, TimeError> {
        let read = |text: &str| Decimal::read(text.trim()).ok_or(TimeError::NotANumber);
        let (above, below) = (read(numerator)?, read(denominator)?);
        if below.digits.is_empty() {
            return Err(TimeError::NotANumber);
        }
        if above.digits.is_empty() {
            return Ok(Time::ZERO);
        }
        if above.negative || below.negative {
            return Err(TimeError::Negative);
        }
        // A quotient that exceeds 128 bits is too large for a time, or its divisor is too fine for one.
        let whole = |decimal: &Decimal, scale: i64| {
            let zeros = usize::try_from(scale.max(0)).ok()?;
            let digits = decimal.digits.iter().copied().chain(std::iter::repeat_n(0, zeros.min(40)));
            digits
                .into_iter()
                .try_fold(0u128, |value, digit| value.checked_mul(10)?.checked_add(digit.into()))
        };
        let scale = above.exponent - below.exponent + i64::from(unit.decimals());
        let above = whole(&above, scale).ok_or(TimeError::TooLarge)?;
        let below = whole(&below, -scale).ok_or(TimeError::TooFine)?;
        let nanos = match rounding {
            Rounding::Exact if above % below != 0 => return Err(TimeError::TooFine),
            Rounding::Up => above.div_ceil(below),
            Rounding::Exact | Rounding::Down => above / below,
        };
        u64::try_from(nanos).map(Time).map_err(|_| TimeError::TooLarge)
    }

    /// Reads a number and its unit: `5 ms`, `1000ms`, `1s`, `250 us`, `10ns`.
    pub fn parse_with_unit(text: &str, rounding: Rounding) -> Result<Time, TimeError> {
        let end_of_number =
            text.rfind(|c: char| c.is_ascii_digit() || c == '.').ok_or(TimeError::NotANumber)? + 1;
        let (number, unit) = text.split_at(end_of_number);
        let unit = Unit::parse(unit.trim()).ok_or(TimeError::UnknownUnit)?;
        Time::parse(number, unit, rounding)
    }
}

impl Time {
    /// The number of milliseconds, as short as is exact, without the unit: `83`, `0.25`, `0.000001`. A field or a table takes
    /// it so.
    pub fn number(self) -> String {
        self.number_in(Unit::Milliseconds)
    }

    /// The number of `unit`s, as short as is exact.
    ///
    /// ```
    /// use mauve_timing::{Time, Unit};
    /// assert_eq!(Time::from_nanos(1_250).number_in(Unit::Microseconds), "1.25");
    /// ```
    pub fn number_in(self, unit: Unit) -> String {
        let (whole, rest) = (self.0 / unit.nanos(), self.0 % unit.nanos());
        if rest == 0 {
            return whole.to_string();
        }
        let places = unit.decimals() as usize;
        let digits = format!("{rest:0places$}");
        format!("{whole}.{}", digits.trim_end_matches('0'))
    }
}

/// Milliseconds, as short as is exact, with the unit: `83 ms`, `0.25 ms`, `0.000001 ms`.
impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ms", self.number())
    }
}

/// A unit of time, as it is written in models and tables: `ns`, `us`, `ms`, `s`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
pub enum Unit {
    /// `ns`, 10⁻⁹ s.
    #[serde(rename = "ns")]
    Nanoseconds,
    /// `us`, 10⁻⁶ s.
    #[serde(rename = "us")]
    Microseconds,
    /// `ms`, 10⁻³ s.
    #[default]
    #[serde(rename = "ms")]
    Milliseconds,
    /// `s`.
    #[serde(rename = "s")]
    Seconds,
}

impl Unit {
    /// All units, the shortest first.
    pub const ALL: [Unit; 4] = [Unit::Nanoseconds, Unit::Microseconds, Unit::Milliseconds, Unit::Seconds];

    /// The unit called `name`; `None` where `name` is not one of `ns`, `us`, `ms`, `s`.
    pub fn parse(name: &str) -> Option<Unit> {
        Unit::ALL.into_iter().find(|unit| unit.name() == name)
    }

    /// `ns`, `us`, `ms` or `s`.
    pub fn name(self) -> &'static str {
        match self {
            Unit::Nanoseconds => "ns",
            Unit::Microseconds => "us",
            Unit::Milliseconds => "ms",
            Unit::Seconds => "s",
        }
    }

    fn nanos(self) -> u64 {
        10u64.pow(self.decimals())
    }

    /// The decimal places of a nanosecond in this unit.
    fn decimals(self) -> u32 {
        match self {
            Unit::Nanoseconds => 0,
            Unit::Microseconds => 3,
            Unit::Milliseconds => 6,
            Unit::Seconds => 9,
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What happens to the part of a number that is finer than a nanosecond.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Rounding {
    /// It rounds up: for execution times, which may only be overestimated.
    Up,
    /// It rounds down: for the period of a rate, and for quotients, which may only be underestimated.
    Down,
    /// An error: for periods and deadlines that are written as decimals.
    Exact,
}

/// Why a text is not a duration.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum TimeError {
    /// Not a decimal number, or not a finite one.
    NotANumber,
    /// Less than zero.
    Negative,
    /// More than 2⁶⁴ − 1 ns.
    TooLarge,
    /// Not a whole number of nanoseconds, where an exact one is needed.
    TooFine,
    /// Another unit than `ns`, `us`, `ms` and `s`, or none.
    UnknownUnit,
}

/// ± 0.d₁d₂… moved by a power of ten: `digits` × 10^`exponent`, without zeros at either end of `digits`.
struct Decimal {
    negative: bool,
    digits: Vec<u8>,
    exponent: i64,
}

impl Decimal {
    fn read(text: &str) -> Option<Decimal> {
        let (negative, text) = signed(text);
        let (mantissa, exponent) = match text.split_once(['e', 'E']) {
            Some((mantissa, exponent)) => (mantissa, Decimal::exponent(exponent)?),
            None => (text, 0),
        };
        let (whole, fraction) = match mantissa.split_once('.') {
            Some((whole, fraction)) => (digits(whole)?, digits(fraction)?),
            None => (digits(mantissa)?, Vec::new()),
        };
        let mut exponent = exponent - fraction.len() as i64;
        let mut digits: Vec<u8> = whole.into_iter().chain(fraction).skip_while(|&digit| digit == 0).collect();
        while digits.last() == Some(&0) {
            digits.pop();
            exponent += 1;
        }
        Some(Decimal { negative, digits, exponent })
    }

    /// The exponent, limited to ±10¹⁵: beyond that it only says "too large" or "too fine".
    fn exponent(text: &str) -> Option<i64> {
        const LIMIT: i64 = 1_000_000_000_000_000;
        let (negative, text) = signed(text);
        let magnitude = digits(text)?
            .into_iter()
            .fold(0i64, |value, digit| value.saturating_mul(10).saturating_add(i64::from(digit)).min(LIMIT));
        Some(if negative { -magnitude } else { magnitude })
    }
}

/// Whether `text` begins with a minus sign, and the number behind its sign.
fn signed(text: &str) -> (bool, &str) {
    match text.strip_prefix('-') {
        Some(text) => (true, text),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    }
}

/// The values of the digits of `text`: at least one, with single underscores between digits only.
fn digits(text: &str) -> Option<Vec<u8>> {
    let mut digits = Vec::with_capacity(text.len());
    let mut after_digit = false;
    for byte in text.bytes() {
        match byte {
            b'0'..=b'9' => digits.push(byte - b'0'),
            b'_' if after_digit => {}
            _ => return None,
        }
        after_digit = byte != b'_';
    }
    after_digit.then_some(digits)
}

/// Returns the least common multiple, or `None` on overflow; both numbers are greater than 0.
pub(crate) fn least_common_multiple(a: u64, b: u64) -> Option<u64> {
    (a / greatest_common_divisor(a, b).max(1)).checked_mul(b)
}

/// Returns the greatest common divisor; that of a number and 0 is the number.
pub fn greatest_common_divisor(mut a: u64, mut b: u64) -> u64 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::{Expect, expect};
    use proptest::prelude::*;

    fn check(texts: &[&str], rounding: Rounding, expected: Expect) {
        let mut found = String::new();
        for text in texts {
            let line = match Time::parse_with_unit(text, rounding) {
                Ok(time) => format!("{text:?} is {} ns, {time}\n", time.as_nanos()),
                Err(error) => format!("{text:?} {error:?}\n"),
            };
            found.push_str(&line);
        }
        expected.assert_eq(&found);
    }

    #[test]
    fn quotients() {
        let check = |above: &str, below: &str, expected: [Result<u64, TimeError>; 3]| {
            let roundings = [Rounding::Down, Rounding::Up, Rounding::Exact];
            let found = roundings.map(|it| Time::quotient(above, below, Unit::Milliseconds, it));
            assert_eq!(found.map(|it| it.map(Time::as_nanos)), expected, "{above} / {below}");
        };
        let fine = Err(TimeError::TooFine);
        check("1000", "30", [Ok(33_333_333), Ok(33_333_334), fine]);
        check("1000", "40", [Ok(25_000_000); 3]);
        check("0.1", "0.00002", [Ok(5_000_000_000); 3]);
        check("2.5", "3e2", [Ok(8_333), Ok(8_334), fine]);
        check("0", "3", [Ok(0); 3]);
        check("1", "1e9", [Ok(0), Ok(1), fine]);
        check("1", "0", [Err(TimeError::NotANumber); 3]);
        check("-1", "3", [Err(TimeError::Negative); 3]);
        check("1e30", "1", [Err(TimeError::TooLarge); 3]);
        check("1", "1e-999999999999999999", [Err(TimeError::TooLarge); 3]);
        check("1", "1e60", [fine; 3]);
        check("18446744073709.551615", "1", [Ok(u64::MAX); 3]);
        check("18446744073709551615", "3", [Err(TimeError::TooLarge); 3]);
    }

    #[test]
    fn names_of_units() {
        let units = [Unit::Nanoseconds, Unit::Microseconds, Unit::Milliseconds, Unit::Seconds];
        assert_eq!(units.map(|it| it.to_string()), ["ns", "us", "ms", "s"]);
    }

    #[test]
    fn sums_and_differences_that_do_not_fit() {
        let (one, most) = (Time::from_nanos(1), Time::from_nanos(u64::MAX));
        assert_eq!((most.checked_add(one), one.checked_add(one)), (None, Some(Time::from_nanos(2))));
        assert_eq!((one.checked_sub(most), most.checked_sub(most)), (None, Some(Time::ZERO)));
        assert_eq!((most.checked_mul(2), most.checked_mul(1)), (None, Some(most)));
    }

    #[test]
    fn numbers_are_read_exactly() {
        let texts = [
            "5 ms",
            "1000ms",
            "1s",
            "250 us",
            "10ns",
            "0.1 ms",
            "1_000.25 us",
            "+3 s",
            "1e-3 ms",
            "1E3 ns",
            "-0 s",
            "18446744073709551615 ns",
            "18446744073.709551615 s",
            "0e999999999999999999999 s",
            "00012.500 ns0",
            "12.000 ns",
            "1_0e0_1 ns",
        ];
        check(
            &texts,
            Rounding::Exact,
            expect![[r#"
                "5 ms" is 5000000 ns, 5 ms
                "1000ms" is 1000000000 ns, 1000 ms
                "1s" is 1000000000 ns, 1000 ms
                "250 us" is 250000 ns, 0.25 ms
                "10ns" is 10 ns, 0.00001 ms
                "0.1 ms" is 100000 ns, 0.1 ms
                "1_000.25 us" is 1000250 ns, 1.00025 ms
                "+3 s" is 3000000000 ns, 3000 ms
                "1e-3 ms" is 1000 ns, 0.001 ms
                "1E3 ns" is 1000 ns, 0.001 ms
                "-0 s" is 0 ns, 0 ms
                "18446744073709551615 ns" is 18446744073709551615 ns, 18446744073709.551615 ms
                "18446744073.709551615 s" is 18446744073709551615 ns, 18446744073709.551615 ms
                "0e999999999999999999999 s" is 0 ns, 0 ms
                "00012.500 ns0" UnknownUnit
                "12.000 ns" is 12 ns, 0.000012 ms
                "1_0e0_1 ns" is 100 ns, 0.0001 ms
            "#]],
        );
    }

    #[test]
    fn what_is_not_a_duration() {
        let texts = [
            "",
            "ms",
            "5",
            "5 min",
            "inf ms",
            "nan ms",
            "-1 ms",
            "1..2 ms",
            "1. ms",
            ".5 ms",
            "1__0 ms",
            "_1 ms",
            "1_ ms",
            "0x10 ms",
            "1e ms",
            "--1 ms",
            "1 2 ms",
            "18446744073709551616 ns",
            "1e30 s",
            "1e99999999999999 s",
            "0.5 ns",
            "1e-99999999999999999999 s",
            "é5 ms",
            "5 é",
        ];
        check(
            &texts,
            Rounding::Exact,
            expect![[r#"
                "" NotANumber
                "ms" NotANumber
                "5" UnknownUnit
                "5 min" UnknownUnit
                "inf ms" NotANumber
                "nan ms" NotANumber
                "-1 ms" Negative
                "1..2 ms" NotANumber
                "1. ms" NotANumber
                ".5 ms" NotANumber
                "1__0 ms" NotANumber
                "_1 ms" NotANumber
                "1_ ms" UnknownUnit
                "0x10 ms" NotANumber
                "1e ms" UnknownUnit
                "--1 ms" NotANumber
                "1 2 ms" NotANumber
                "18446744073709551616 ns" TooLarge
                "1e30 s" TooLarge
                "1e99999999999999 s" TooLarge
                "0.5 ns" TooFine
                "1e-99999999999999999999 s" TooFine
                "é5 ms" NotANumber
                "5 é" UnknownUnit
            "#]],
        );
    }

    #[test]
    fn execution_times_round_up() {
        let texts =
            ["0.5 ns", "1.0000000001 ns", "1e-99999999999999999999 s", "2.0 ns", "18446744073709551615.1 ns"];
        check(
            &texts,
            Rounding::Up,
            expect![[r#"
                "0.5 ns" is 1 ns, 0.000001 ms
                "1.0000000001 ns" is 2 ns, 0.000002 ms
                "1e-99999999999999999999 s" is 1 ns, 0.000001 ms
                "2.0 ns" is 2 ns, 0.000002 ms
                "18446744073709551615.1 ns" TooLarge
            "#]],
        );
    }

    #[test]
    fn floats_for_output_are_the_nearest() {
        assert_eq!(Time::from_nanos(100_000).as_f64(Unit::Milliseconds), 0.1);
        assert_eq!(Time::from_nanos(u64::MAX).as_f64(Unit::Nanoseconds), 18446744073709551615.0);
        assert_eq!(Time::from_nanos(9_007_199_254_740_993).as_f64(Unit::Seconds), 9007199.254740993);
        assert_eq!(Time::from_nanos(9_007_199_254_740_993).as_f64(Unit::Milliseconds), 9007199254.740993);
    }

    proptest! {
        #[test]
        fn what_is_displayed_is_read_back(nanos: u64) {
            let time = Time::from_nanos(nanos);
            prop_assert_eq!(Time::parse_with_unit(&time.to_string(), Rounding::Exact), Ok(time));
        }

        #[test]
        fn any_text_is_read_or_refused(text in "\\PC*", number in "[-+]?[0-9_]{0,25}[.]?[0-9_]{0,25}(e[-+]?[0-9]{1,3})?") {
            let _ = Time::parse_with_unit(&text, Rounding::Up);
            let up = Time::parse(&number, Unit::Microseconds, Rounding::Up);
            let exact = Time::parse(&number, Unit::Microseconds, Rounding::Exact);
            prop_assert!(exact == up || exact == Err(TimeError::TooFine));
            let plain = number.replace('_', "");
            if let (Ok(time), Ok(float)) = (up, plain.parse::<f64>()) {
                let nanos = float * 1e3;
                prop_assert!((time.as_nanos() as f64 - nanos).abs() <= 1.0 + nanos * 1e-15);
            }
        }
    }
}
