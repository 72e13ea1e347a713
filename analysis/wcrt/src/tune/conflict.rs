//! Why no values are found: the fewest activities that cannot be scheduled together, and what each of them would have to be.
//!
//! One activity after another is left out: it belongs to the conflict if the others can be scheduled without it. What is left is
//! minimal, but a smaller conflict may exist elsewhere; where the activities are few, all smaller sets are tried too.

use mauve_timing::Time;

use super::order::ordered;
use super::placement::placed;
use super::trials::{Trials, TunePlan};
use super::{Conflict, ConflictKind, Remedy};
use crate::bisection::{ProofBoundary, step_of};

/// Of so many activities, all sets are tried.
const MOST_OF_SETS: usize = 12;

/// Returns the conflict of the `suspects`, which cannot be scheduled together.
pub(super) fn conflict_of(trials: &Trials<'_>, start: &TunePlan, suspects: &[usize]) -> Conflict {
    let name = |unit: &usize| trials.units[*unit].of.instance.clone();
    let Some((units, kind)) = fewest(trials, start, suspects) else {
        let activities = suspects.iter().map(name).collect();
        return Conflict { activities, kind: ConflictKind::Some, remedies: Vec::new() };
    };
    let remedies = units.iter().flat_map(|unit| remedies(trials, start, *unit)).collect();
    Conflict { activities: units.iter().map(name).collect(), kind, remedies }
}

/// Returns the fewest suspects that are found to be in conflict. None where the budget is exhausted.
fn fewest(trials: &Trials<'_>, start: &TunePlan, suspects: &[usize]) -> Option<(Vec<usize>, ConflictKind)> {
    let mut units = suspects.to_vec();
    for unit in suspects {
        let without: Vec<usize> = units.iter().copied().filter(|it| it != unit).collect();
        if !can_be_scheduled(trials, start, &without)? {
            units = without;
        }
    }
    let is_smallest = suspects.len() <= MOST_OF_SETS;
    for size in (1..units.len() as u32).filter(|_| is_smallest) {
        // The bits of a number are a set, that of the first suspect first.
        for set in (1..1_u32 << suspects.len()).rev().filter(|set| set.count_ones() == size) {
            let is_in = |index: &usize| set >> (suspects.len() - 1 - index) & 1 == 1;
            let set: Vec<usize> = (0..suspects.len()).filter(is_in).map(|index| suspects[index]).collect();
            if !can_be_scheduled(trials, start, &set)? {
                return Some((set, ConflictKind::Smallest));
            }
        }
    }
    Some((units, if is_smallest { ConflictKind::Smallest } else { ConflictKind::Minimal }))
}

/// Returns whether these units can be scheduled without the others.
fn can_be_scheduled(trials: &Trials<'_>, start: &TunePlan, units: &[usize]) -> Option<bool> {
    let left_out = (0..trials.units.len()).map(|it| !units.contains(&it) && !trials.units[it].is_pinned);
    is_solvable(trials, &TunePlan { left_out: left_out.collect(), ..start.clone() })
}

fn is_solvable(trials: &Trials<'_>, plan: &TunePlan) -> Option<bool> {
    let is_met = match (trials.request.cpus, trials.request.priorities) {
        (true, _) => placed(trials, plan)?.score.is_met(),
        (false, true) => ordered(trials, plan)?.score.is_met(),
        (false, false) => trials.score(plan)?.is_met(),
    };
    // Not found is no proof without a budget.
    (is_met || !trials.is_spent()).then_some(is_met)
}

/// Returns what each activity of a unit would have to be.
fn remedies(trials: &Trials<'_>, start: &TunePlan, unit: usize) -> Vec<Remedy> {
    let of = &trials.units[unit];
    let period = period(trials, start, unit);
    let remedy = |(number, member): (usize, &usize)| {
        let instance = trials.variants.system.activities.get(*member)?.instance.clone();
        let time = time(trials, start, *member);
        // The activities of a thread have one period.
        let period = period.filter(|_| number == 0);
        Some(Remedy { instance, time, period })
    };
    of.members.iter().enumerate().filter_map(remedy).collect()
}

/// Returns the greatest execution time of the jobs of an activity now, and the greatest with which every deadline is met.
fn time(trials: &Trials<'_>, start: &TunePlan, activity: usize) -> Option<[Time; 2]> {
    let now = trials.time_of(activity)?;
    let step = step_of(now);
    let holds = |number: Time| {
        let cap = Some((activity, Time::from_nanos(number.as_nanos() * step)));
        is_solvable(trials, &TunePlan { cap, ..start.clone() })
    };
    if !holds(Time::ZERO)? {
        return None;
    }
    let found = ProofBoundary::between(0, now.as_nanos().div_ceil(step), holds);
    (found.is_complete() && found.good > 0).then(|| [now, Time::from_nanos(found.good * step)])
}

/// Returns the period of a unit now, and the least with which every deadline is met.
fn period(trials: &Trials<'_>, start: &TunePlan, unit: usize) -> Option<[Time; 2]> {
    let of = &trials.units[unit];
    let now = of.of.period.filter(|_| of.is_periodic)?;
    let step = step_of(now);
    let holds = |number: Time| {
        let mut plan = start.clone();
        plan.periods[unit] = Some(Time::from_nanos(number.as_nanos().checked_mul(step)?));
        is_solvable(trials, &plan)
    };
    let longer = ProofBoundary::above(now.as_nanos() / step, holds)??;
    let found = ProofBoundary::between(longer.good, longer.bad, holds);
    found.is_complete().then(|| [now, Time::from_nanos(found.good * step)])
}
