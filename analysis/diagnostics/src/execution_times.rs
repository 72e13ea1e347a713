//! Measured execution times in words: what a test assumes, why an estimate has a warning, and why there is none.

use mauve_pwcet::{
    Check, CheckKind, EstimateRefusal, FEW_EXECUTIONS, LEAST_EXECUTIONS, NoBound, Warning, rounded_up,
};
use mauve_timing::{DEPENDENT, EXTRAPOLATED, Time};
use mauve_wcrt::Basis;

/// Returns where execution times come from, if any is measured or assumed; the others were written by hand.
///
/// ```
/// let basis = mauve_wcrt::Basis { times: 24, measured: 21, extrapolated: 5, assumed: 3, ..Default::default() };
/// let text = "21 of 24 execution times measured (5 extrapolated), 3 assumed";
/// assert_eq!(mauve_diagnostics::origins(&basis).unwrap(), text);
/// ```
pub fn origins(of: &Basis) -> Option<String> {
    let &Basis { times, measured, extrapolated, assumed, .. } = of;
    let extrapolated =
        if extrapolated > 0 { format!(" ({extrapolated} extrapolated)") } else { String::new() };
    let assumed = if assumed > 0 { format!(", {assumed} assumed") } else { String::new() };
    let times = if times == 1 { "1 execution time".to_owned() } else { format!("{times} execution times") };
    (measured > 0 || !assumed.is_empty())
        .then(|| format!("{measured} of {times} measured{extrapolated}{assumed}"))
}

/// Returns the name of a test.
///
/// ```
/// use mauve_pwcet::CheckKind;
/// assert_eq!(mauve_diagnostics::check_name(CheckKind::LjungBox { lags: 20 }), "Ljung–Box, 20 lags");
/// ```
pub fn check_name(kind: CheckKind) -> String {
    match kind {
        CheckKind::LjungBox { lags } => format!("Ljung–Box, {lags} lags"),
        CheckKind::Runs => "runs about the median".to_owned(),
        CheckKind::Groups => "distances of long executions".to_owned(),
        CheckKind::Halves => "Kolmogorov–Smirnov, two halves".to_owned(),
        CheckKind::Kpss { lags } => format!("KPSS, {lags} lags"),
        CheckKind::LightTail => "likelihood ratio of the tail".to_owned(),
        CheckKind::HoldOut => "hold-out".to_owned(),
    }
}

/// Returns what a test assumes, and may reject.
pub fn check_assumption(kind: CheckKind) -> &'static str {
    match kind {
        CheckKind::LjungBox { .. } => "executions do not depend on earlier ones",
        CheckKind::Runs => "fast and slow executions alternate at random",
        CheckKind::Groups => "long executions do not come in groups",
        CheckKind::Halves => "both halves of the measurement have one distribution",
        CheckKind::Kpss { .. } => "the mean does not change",
        CheckKind::LightTail => "the tail is not heavier than exponential",
        CheckKind::HoldOut => "the bounds of the first half hold in the second half",
    }
}

/// Returns why an estimate must not be trusted without a look, and what to do.
///
/// ```
/// use mauve_pwcet::Warning;
/// let text = mauve_diagnostics::measurement_warning(&Warning::Few { count: 300 });
/// assert_eq!(text, "only 300 executions: measure at least 500");
/// ```
pub fn measurement_warning(warning: &Warning) -> String {
    match *warning {
        Warning::Few { count } => {
            format!("only {count} executions: measure at least {FEW_EXECUTIONS}")
        }
        Warning::Rejected(check) => rejected(&check),
        Warning::PoorFit { p } => format!(
            "no threshold gives a tail that fits (Anderson–Darling, {}): the codel may have several modes, or outliers; look at the plots",
            probability(p)
        ),
        Warning::Coarse { resolution, scale } => format!(
            "the clock is coarse: {} beside a tail of {}; the resolution is added to each time",
            time(resolution as f64),
            time(scale)
        ),
        Warning::NotConverged { level, before, now } => format!(
            "not converged: the last executions raised the estimate at {level:e} to {}, above the bound of {} before them; measure more",
            time(now),
            time(before)
        ),
        Warning::Far { level, ratio } => format!(
            "the bound at {level:e} is {} times the longest execution: the measurement does not support that level; measure more",
            rounded_up(ratio)
        ),
        Warning::Extrapolated { level, needed } => format!(
            "no execution confirms the bound at {level:e}: a mode that fewer than 25 executions had may be longer; measure {needed} executions"
        ),
    }
}

/// Returns the kind of a warning, which has a page: [`page`](crate::page).
///
/// ```
/// let kind = mauve_diagnostics::warning_kind(&mauve_pwcet::Warning::Few { count: 300 });
/// assert_eq!(kind, "few-executions");
/// assert!(mauve_diagnostics::page(kind).unwrap().starts_with("# few-executions\n"));
/// ```
pub fn warning_kind(warning: &Warning) -> &'static str {
    match warning {
        Warning::Few { .. } => "few-executions",
        Warning::Rejected(check) => match check.kind {
            CheckKind::LjungBox { .. } | CheckKind::Runs | CheckKind::Groups => DEPENDENT,
            CheckKind::Halves | CheckKind::Kpss { .. } => "changing-times",
            CheckKind::LightTail => "heavy-tail",
            CheckKind::HoldOut => "exceeded-bounds",
        },
        Warning::PoorFit { .. } => "poor-fit",
        Warning::Coarse { .. } => "coarse-clock",
        Warning::NotConverged { .. } => "not-converged",
        Warning::Far { .. } => "far-bound",
        Warning::Extrapolated { .. } => EXTRAPOLATED,
    }
}

/// Returns the kind of a refusal, which has a page.
pub fn refusal_kind(refusal: &EstimateRefusal) -> &'static str {
    match refusal {
        EstimateRefusal::TooFew { .. } => "too-few-executions",
        EstimateRefusal::Constant { .. } => "constant-times",
        EstimateRefusal::TooCoarse { .. } => "coarse-clock",
        EstimateRefusal::NoFit => "no-fit",
        EstimateRefusal::RareMode { .. } => "rare-mode",
        EstimateRefusal::Absurd { .. } => "absurd-bound",
        EstimateRefusal::InfiniteMean { .. } => "endless-tail",
    }
}

/// Returns the pages of the kinds of warnings about measurements, each with its name.
fn measurement_pages() -> impl Iterator<Item = (&'static str, &'static str)> {
    let pages = include_str!("measurements.md").trim_start_matches("# ").split("\n# ");
    pages.filter_map(|page| Some((page.lines().next()?, page.trim_end())))
}

/// Returns the kinds of warnings about measurements.
pub fn measurement_kinds() -> impl Iterator<Item = &'static str> {
    measurement_pages().map(|(kind, _)| kind)
}

/// Returns the page of a kind of warning about measurements.
pub(crate) fn measurement_page(kind: &str) -> Option<String> {
    let (_, page) = measurement_pages().find(|(name, _)| *name == kind)?;
    Some(format!("# {page}\n"))
}

/// Returns the probability of a test.
fn probability(p: f64) -> String {
    if p < 0.001 { "p < 0.001".to_owned() } else { format!("p = {p:.3}") }
}

fn rejected(check: &Check) -> String {
    let p = probability(check.adjusted);
    let test = check_name(check.kind);
    match check.kind {
        CheckKind::LjungBox { .. } | CheckKind::Runs | CheckKind::Groups => format!(
            "executions depend on earlier ones ({test}: {p}): the confidence is less than 95 %; measure longer, with varied inputs"
        ),
        CheckKind::Halves | CheckKind::Kpss { .. } => format!(
            "execution times change during the measurement ({test}: {p}): measure under the conditions of the mission, without start-up"
        ),
        CheckKind::LightTail => format!(
            "the tail is heavier than exponential ({test}: {p}): strict levels cost much; look for outliers and rare modes"
        ),
        CheckKind::HoldOut => format!(
            "the second half exceeds the bounds of the first more often than the levels promise ({test}: {p}): the times are too short; measure longer, with varied inputs"
        ),
    }
}

/// Returns why executions give no tail, and what to do.
///
/// ```
/// use mauve_pwcet::EstimateRefusal;
/// let text = mauve_diagnostics::measurement_refusal(&EstimateRefusal::TooFew { count: 3 });
/// assert_eq!(text, "3 executions are too few for a tail: measure at least 200, better 5000");
/// ```
pub fn measurement_refusal(refusal: &EstimateRefusal) -> String {
    match refusal {
        EstimateRefusal::TooFew { count } => format!(
            "{} too few for a tail: measure at least {LEAST_EXECUTIONS}, better 5000",
            if *count == 1 { "1 execution is".to_owned() } else { format!("{count} executions are") }
        ),
        EstimateRefusal::Constant { time: constant } => format!(
            "all executions took exactly {}: a real clock gives different times; write the time by hand if it is the worst case",
            time(*constant as f64)
        ),
        EstimateRefusal::TooCoarse { distinct, resolution } => format!(
            "only {distinct} distinct times, in steps of {}, which hide the tail: for stricter levels than those that are counted, measure more, or with a finer clock",
            time(*resolution as f64)
        ),
        EstimateRefusal::NoFit => {
            "no distribution fits the longest executions: look for outliers, several modes, or an interrupted measurement".to_owned()
        }
        EstimateRefusal::RareMode { slow } => format!(
            "the {slow} longest executions are a mode of their own, too rare for a fit: find what they have in common, and measure until there are 50 of them"
        ),
        EstimateRefusal::Absurd { ratio } => format!(
            "the estimate is {} times the longest execution, so that it is not written: measure more, with varied inputs, or leave the level out",
            rounded_up(*ratio)
        ),
        EstimateRefusal::InfiniteMean { shape } => format!(
            "the tail has no mean (ξ = {shape:.2}): no time holds; look for outliers, several modes, or an interrupted measurement"
        ),
    }
}

/// Returns why a level has no bound, and how many executions it needs.
///
/// ```
/// use mauve_pwcet::{EstimateRefusal, NoBound};
/// let text = mauve_diagnostics::no_bound(&NoBound { refusal: EstimateRefusal::Absurd { ratio: 1500.0 }, needed: 29_956 });
/// assert_eq!(text, "the estimate is 1500 times the longest execution, so that it is not written: measure more, with varied inputs, or leave the level \
///     out; 29956 executions need no tail");
/// ```
pub fn no_bound(of: &NoBound) -> String {
    format!("{}; {} executions need no tail", measurement_refusal(&of.refusal), of.needed)
}

/// Nanoseconds with four digits, rounded up.
fn time(nanoseconds: f64) -> Time {
    Time::from_nanos(rounded_up(nanoseconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_has_a_page() {
        let check = |kind| Warning::Rejected(Check { kind, statistic: 0.0, p: 0.0, adjusted: 0.0 });
        let warnings = [
            Warning::Few { count: 1 },
            Warning::PoorFit { p: 0.0 },
            Warning::Coarse { resolution: 1, scale: 1.0 },
            Warning::NotConverged { level: 0.1, before: 1.0, now: 2.0 },
            Warning::Far { level: 0.1, ratio: 20.0 },
            Warning::Extrapolated { level: 0.1, needed: 29 },
            check(CheckKind::LjungBox { lags: 1 }),
            check(CheckKind::Kpss { lags: 1 }),
            check(CheckKind::LightTail),
            check(CheckKind::HoldOut),
        ];
        let refusals = [
            EstimateRefusal::TooFew { count: 1 },
            EstimateRefusal::Constant { time: 1 },
            EstimateRefusal::TooCoarse { distinct: 1, resolution: 1 },
            EstimateRefusal::NoFit,
            EstimateRefusal::RareMode { slow: 1 },
            EstimateRefusal::Absurd { ratio: 1e6 },
            EstimateRefusal::InfiniteMean { shape: 2.0 },
        ];
        let kinds = warnings.iter().map(warning_kind).chain(refusals.iter().map(refusal_kind));
        for kind in kinds.chain(["over-budget", "unmeasured-instance", "incomplete-recording", "alone"]) {
            let page = crate::page(kind).unwrap_or_else(|| panic!("no page of {kind}"));
            assert!(page.starts_with(&format!("# {kind}\n\n")) && page.lines().count() >= 5, "{page}");
        }
        assert_eq!(measurement_kinds().count(), 20);
    }
}
