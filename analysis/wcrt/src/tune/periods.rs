//! Periods: the shortest ones with which every deadline is met, or the least longer ones.
//!
//! First, all periods shrink by one factor, as far as the deadlines allow; then each alone, in the order of the deployment. Where a
//! deadline is missed now, all grow by the least factor that is enough, and each then shrinks towards its present value. A deadline that
//! equals its period follows it, and one within the period stays within it. A period that data gives stays.

use mauve_timing::Time;

use super::SearchKind;
use super::trials::{Trials, TunePlan};
use crate::bisection::{ProofBoundary, step_of};

/// The factors are multiples of one in so many.
const PARTS: u64 = 1000;

/// Returns a plan with other periods, and how far the search went. None where no factor is enough.
pub(super) fn with_shortest_periods(trials: &Trials<'_>, start: &TunePlan) -> Option<(TunePlan, SearchKind)> {
    let units: Vec<usize> = start.present().into_iter().filter(|unit| is_free(trials, *unit)).collect();
    let was_used_up = trials.analyse(start)?.slack;
    // What ends exactly at its deadline would be late with the next nanosecond.
    let holds = |plan: &TunePlan| {
        let trial = trials.analyse(plan)?;
        let has_slack = |unit: &usize| trial.slack[*unit] > 0 || was_used_up[*unit] == 0;
        Some(trial.is_met(plan) && plan.present().iter().all(has_slack))
    };
    let scaled = |parts: Time| {
        let mut plan = start.clone();
        for unit in &units {
            plan.periods[*unit] = scaled_period(trials, *unit, parts.as_nanos());
        }
        plan
    };
    let is_met = holds(start)?;
    let is_enough = |parts: Time| holds(&scaled(parts));
    let ProofBoundary { good, bad } =
        if is_met { ProofBoundary { good: PARTS, bad: 0 } } else { ProofBoundary::above(PARTS, is_enough)?? };
    let factor = ProofBoundary::between(good, bad, is_enough).good;
    let mut plan = if factor == PARTS { start.clone() } else { scaled(Time::from_nanos(factor)) };
    let mut search = SearchKind::Exact;
    for unit in units {
        let period = trials.units[unit].of.period.unwrap_or_default();
        let (step, now) = (step_of(period), period.as_nanos());
        let present = plan.periods[unit].map_or(now, Time::as_nanos);
        let with = |number: u64| {
            let mut plan = plan.clone();
            plan.periods[unit] = Some(Time::from_nanos(number * step));
            plan
        };
        // One that is longer than it was becomes what it was, if that is enough.
        let mut restored = plan.clone();
        restored.periods[unit] = None;
        if !is_met && present > now && holds(&restored).unwrap_or_default() {
            plan = restored;
            continue;
        }
        let least =
            if is_met { trials.units[unit].least_period().saturating_sub(1) / step } else { now / step };
        let found =
            ProofBoundary::between(present.div_ceil(step), least, |number| holds(&with(number.as_nanos())));
        if !found.is_complete() {
            search = SearchKind::Exhausted;
        }
        if found.good * step < present {
            plan = with(found.good);
        }
    }
    Some((plan, search))
}

/// Whether the period of a unit may change.
fn is_free(trials: &Trials<'_>, unit: usize) -> bool {
    let of = &trials.units[unit];
    of.is_periodic && !of.is_pinned && of.of.period.is_some()
}

/// Returns so many parts of the period of a unit, rounded up to its step.
fn scaled_period(trials: &Trials<'_>, unit: usize, parts: u64) -> Option<Time> {
    let period = trials.units[unit].of.period?;
    let step = step_of(period);
    let nanos = u128::from(period.as_nanos()) * u128::from(parts);
    let number = nanos.div_ceil(u128::from(PARTS) * u128::from(step)).max(1);
    let nanos = u64::try_from(number).ok()?.checked_mul(step)?;
    Some(Time::from_nanos(nanos.max(trials.units[unit].least_period())))
}
