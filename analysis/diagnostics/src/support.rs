//! What a significance level supports, in words. Every place that shows a verdict at a level shows this beside it.

use mauve_timing::NoLateness;
use mauve_wcrt::{MissProbability, Support};

use crate::enumerated;
use crate::figure::{Round, rounded};

/// Returns what a level supports: `at 1e-4, about 12 executions an hour may exceed their times`.
pub fn supported(support: Support) -> String {
    let Support { level, .. } = support;
    match support.exceedances_per_hour() {
        number if number.is_infinite() => {
            format!("at {level}, an unknown number of executions an hour may exceed their times")
        }
        number if number > 1.0 => {
            format!(
                "at {level}, about {} executions an hour may exceed their times",
                two_digits(number, f64::ceil)
            )
        }
        number => {
            let hours = two_digits(1.0 / number, f64::floor);
            let hours = if hours == "1" { "hour".to_owned() } else { format!("about {hours} hours") };
            format!("at {level}, an execution may exceed its time once in {hours}")
        }
    }
}

/// Returns how probable it is that an activity is late: `late at most 3e-6 times an hour`.
pub fn late_at_most(of: &MissProbability) -> String {
    match of.per_hour {
        hour if hour >= 1.0 => "may be late in each hour".to_owned(),
        0.0 => "never late".to_owned(),
        hour => format!("late at most {} times an hour", probability_rounded_up(hour)),
    }
}

/// Returns the conditions of such a probability, as clauses.
pub fn miss_conditions(of: &MissProbability) -> Vec<String> {
    let mut all = vec!["the hour begins without unfinished jobs".to_owned()];
    let is_independent = of.tolerated.is_some() || of.per_job.is_some();
    let independently = if is_independent { ", whatever was executed before" } else { "" };
    all.push(format!(
        "each execution exceeds its times at most as probably as the tables say{independently}"
    ));
    if of.per_job.is_some() {
        all.push("for one job, late ones right after a late one do not count".to_owned());
    }
    all
}

/// Returns why executions are not taken to be independent, if they are not: `without independence: executions of `a` depend on
/// earlier ones`.
pub fn not_independent(of: &MissProbability) -> Option<String> {
    let codels: Vec<String> = of.dependent.iter().map(|it| format!("`{it}`")).collect();
    let why = match of.refused {
        _ if !codels.is_empty() => format!("executions of {} depend on earlier ones", enumerated(&codels)),
        None => return None,
        Some(why) => match why {
            NoLateness::SeveralCpus => "it, or what may delay it, may run on several CPUs",
            NoLateness::Waits => "it, or what may delay it, waits",
            NoLateness::Locks => "it, or what may delay it, takes a lock",
            NoLateness::Calls => "it, or what may delay it, calls operations",
            NoLateness::Late => "its deadline leaves no time at any level",
            NoLateness::Overhead => "the overhead of jobs depends on the level",
            NoLateness::Times => "a time is not known at each level",
        }
        .to_owned(),
    };
    Some(format!("without independence: {why}"))
}

/// Returns which rule gives such a probability: `the deadline is met at 1e-8`.
pub fn miss_rule(of: &MissProbability) -> String {
    match (of.tolerated, of.level) {
        (Some((level, it)), _) => {
            let (tolerated, window) = (rounded(it.tolerated, Round::Down), rounded(it.window, Round::Up));
            format!("beyond the times at {level}, {tolerated} more within {window} are tolerated")
        }
        (None, Some(level)) => format!("the deadline is met at {level}"),
        (None, None) => "the deadline is met at no level".to_owned(),
    }
}

/// Returns a probability with two digits, rounded up: `1.2e-4`, `3e-6`.
pub fn probability_rounded_up(probability: f64) -> String {
    if !(probability > 0.0 && probability < 1.0) {
        return if probability > 0.0 { "1" } else { "0" }.to_owned();
    }
    let mut exponent = (probability * (1.0 + 1e-12)).log10().floor() as i32;
    let tenths = probability / 10_f64.powi(exponent - 1);
    let mut tenths = if (tenths - tenths.round()).abs() < 1e-9 { tenths.round() } else { tenths.ceil() };
    if tenths >= 100.0 {
        (tenths, exponent) = (10.0, exponent + 1);
    }
    match tenths % 10.0 {
        _ if exponent >= 0 => "1".to_owned(),
        0.0 => format!("{:.0}e{exponent}", tenths / 10.0),
        _ => format!("{:.1}e{exponent}", tenths / 10.0),
    }
}

/// Returns a positive number with two digits, such as `4,600`, `12` or `1.3`.
fn two_digits(number: f64, round: fn(f64) -> f64) -> String {
    // A number of two digits stays as it is, although its logarithm or quotient is not exact.
    let exponent = (number * (1.0 + 1e-12)).log10().floor() as i32 - 1;
    let quotient = number / 10_f64.powi(exponent);
    let nearest = quotient.round();
    let digits = if (quotient - nearest).abs() < 1e-9 { nearest } else { round(quotient) };
    if exponent < 0 {
        let decimals = usize::try_from(-exponent).unwrap_or_default();
        let text = format!("{:.decimals$}", digits * 10_f64.powi(exponent));
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    let text = format!("{:.0}", digits * 10_f64.powi(exponent));
    let mut grouped = String::new();
    for (index, digit) in text.chars().enumerate() {
        if index > 0 && (text.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;
    use mauve_timing::Level;

    fn of(executions_per_hour: f64, level: f64) -> String {
        supported(Support { level: Level::from_f64(level).unwrap(), executions_per_hour })
    }

    #[test]
    fn numbers_are_never_less_than_they_are() {
        let exceed =
            |number: &str| format!("at 1e-4, about {number} executions an hour may exceed their times");
        for (executions, number) in [
            (46_000_000.0, "4,600"),
            (45_000_001.0, "4,600"),
            (45_000_000.0, "4,500"),
            (1_800_000.0, "180"),
            (111_600.0, "12"),
            (10_001.0, "1.1"),
            (9.9999e9, "1,000,000"),
            (1e13, "1,000,000,000"),
        ] {
            assert_eq!(of(executions, 1e-4), exceed(number), "{executions}");
        }
    }

    #[test]
    fn probabilities_are_rounded_up() {
        for (probability, expected) in [
            (3e-6, "3e-6"),
            (3.01e-6, "3.1e-6"),
            (0.00012, "1.2e-4"),
            (9.99e-5, "1e-4"),
            (0.5, "5e-1"),
            (0.999, "1"),
            (1.0, "1"),
            (0.0, "0"),
        ] {
            assert_eq!(probability_rounded_up(probability), expected);
        }
    }

    #[test]
    fn rare_ones_are_told_in_hours() {
        let once = |hours: &str| format!("at 1e-9, an execution may exceed its time once in {hours}");
        for (executions, hours) in [
            (111_600.0, "about 8,900 hours"),
            (5e6, "about 200 hours"),
            (5.0001e6, "about 190 hours"),
            (7e8, "about 1.4 hours"),
            (1e9, "hour"),
        ] {
            assert_eq!(of(executions, 1e-9), once(hours), "{executions}");
        }
        assert_eq!(
            of(f64::INFINITY, 1e-9),
            "at 1e-9, an unknown number of executions an hour may exceed their times"
        );
    }

    /// The rule that multiplies probabilities is not used for it.
    #[test]
    fn a_measurement_that_rejects_independence_is_known_by_its_warning() {
        use mauve_pwcet::{Check, CheckKind, Warning};
        for (kind, expected) in [
            (CheckKind::LjungBox { lags: 20 }, true),
            (CheckKind::Runs, true),
            (CheckKind::Groups, true),
            (CheckKind::Halves, false),
            (CheckKind::LightTail, false),
            (CheckKind::HoldOut, false),
        ] {
            let rejected = Warning::Rejected(Check { kind, statistic: 9.0, p: 0.001, adjusted: 0.001 });
            let warning = crate::measurement_warning(&rejected);
            let text = format!(
                "[measured.a]\nexecutions = 500\ngreatest = 9\ntimes = 30\nmethod = \"m\"\ndate = 2026-11-26\nsamples = \"s\"\n\
                 files = []\nbytes = 1\nwarnings = [\"{warning}\"]\n"
            );
            let table = mauve_timing::Table::parse(&text);
            assert_eq!(table.measured[0].is_dependent(), expected, "{warning}");
        }
    }
}
