//! Priorities: an order of the activities on each CPU with which every deadline is met.
//!
//! Deadline-monotonic priorities first. Then Audsley's algorithm: from the lowest priority up, an activity that meets its deadline
//! below all that have no priority yet gets it. Where a response time depends only on which activities have higher priorities
//! ([`Trials::is_order_free`]), it finds an order if one exists; with the activity of the greatest slack at each priority, also the
//! order whose least slack is the greatest (R. I. Davis, A. Burns, "Robust Priority Assignment for Fixed Priority Real-Time
//! Systems", RTSS 2007). Otherwise all orders are analysed if they are few, or the best one found so far is improved by moving one
//! activity after another.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use mauve_timing::{CpuSet, sharing_cpus};

use super::trials::{Best, Score, Trials, TunePlan};
use super::{SearchKind, TuneAim};

/// So many orders are analysed one by one: those of seven activities, also around one priority that stays.
const MOST_ORDERS: u64 = 40_320;

const HIGHEST: u32 = 99;

/// Activities that may delay each other.
struct PriorityGroup {
    cpus: CpuSet,
    units: Vec<usize>,
    /// The first and the last priority below, between and above the priorities that stay, ascending.
    bands: Vec<(u32, u32)>,
    /// The present priorities of the units.
    own: BTreeSet<u32>,
}

/// An order of a group, from the lowest priority up. None is a priority that stays.
type Sequence = Vec<Option<usize>>;

/// Searches for priorities. None where the budget does not even suffice for the present ones.
pub(super) fn ordered(trials: &Trials<'_>, start: &TunePlan) -> Option<Best> {
    let mut found = Best::of(trials, start)?;
    if !trials.is_enough(found.score) && search(trials, &mut found).is_none() {
        found.search = SearchKind::Exhausted;
    }
    Some(found)
}

/// Searches with the algorithm alone: for each of many placements.
pub(super) fn quickly_ordered(trials: &Trials<'_>, start: &TunePlan) -> Option<Best> {
    let mut found = Best::of(trials, start)?;
    let is_enough = |score: Score| score.is_met() && trials.request.aim != TuneAim::Slack;
    if !is_enough(found.score) {
        by_algorithm(trials, &mut found, &is_enough)?;
    }
    Some(found)
}

fn search(trials: &Trials<'_>, found: &mut Best) -> Option<()> {
    by_algorithm(trials, found, &|score| trials.is_enough(score))?;
    let is_optimal = trials.is_order_free(&found.plan) && trials.request.aim != TuneAim::Latency;
    if is_optimal || trials.is_enough(found.score) {
        return Some(());
    }
    let groups = groups(trials, &found.plan);
    let orders = groups.iter().try_fold(1u64, |product, group| product.checked_mul(group.orders()?));
    if orders.is_some_and(|orders| orders <= MOST_ORDERS) {
        let start = found.plan.clone();
        return each_order(&groups, &start, &mut |plan| {
            found.consider(Best::of(trials, plan)?);
            Some(trials.is_enough(found.score))
        })
        .map(|_| ());
    }
    found.search = SearchKind::Heuristic;
    // Each activity moves to each other place in the order of its group.
    let moves = groups.iter().flat_map(|group| {
        let length = group.sequence(&found.plan).len();
        let places = (0..length).flat_map(move |from| (0..length).map(move |to| (from, to)));
        places.filter(|(from, to)| from != to).map(move |(from, to)| (group, from, to))
    });
    let moves: Vec<(&PriorityGroup, usize, usize)> = moves.collect();
    found.improve(trials, &moves, |plan, (group, from, to)| {
        let mut sequence = group.sequence(plan);
        let unit = sequence.remove(*from);
        sequence.insert(*to, unit);
        let mut plan = plan.clone();
        let is_possible = unit.is_some() && group.number(&mut plan, &sequence);
        if is_possible { Best::of(trials, &plan).map(Some) } else { Some(None) }
    })
}

/// Deadline-monotonic priorities, then those of Audsley's algorithm.
fn by_algorithm(trials: &Trials<'_>, found: &mut Best, is_enough: &dyn Fn(Score) -> bool) -> Option<()> {
    let groups = groups(trials, &found.plan);
    let mut plan = found.plan.clone();
    for group in groups.iter().filter(|it| it.bands.len() == 1) {
        let sequence: Sequence = group.by_deadline(trials).into_iter().rev().map(Some).collect();
        group.number(&mut plan, &sequence);
    }
    found.consider(Best::of(trials, &plan)?);
    if is_enough(found.score) {
        return Some(());
    }
    let mut plan = found.plan.clone();
    for group in &groups {
        let (sequence, stuck) = group.audsley(trials, &plan)?;
        found.stuck.extend(stuck);
        group.number(&mut plan, &sequence);
    }
    found.consider(Best::of(trials, &plan)?);
    Some(())
}

/// Groups the units by the CPUs that they share.
fn groups(trials: &Trials<'_>, plan: &TunePlan) -> Vec<PriorityGroup> {
    let stays = |unit: &usize| trials.units[*unit].is_pinned && trials.units[*unit].priority.is_some();
    let (pinned, units): (Vec<usize>, Vec<usize>) = plan.present().into_iter().partition(stays);
    let groups = sharing_cpus(units.into_iter().map(|unit| (trials.cpus(plan, unit), unit))).into_iter();
    let group = |(cpus, units)| PriorityGroup { cpus, units, bands: Vec::new(), own: BTreeSet::new() };
    let mut groups: Vec<PriorityGroup> = groups.map(group).collect();
    let pinned = pinned.into_iter().map(|it| (plan.priorities[it], trials.cpus(plan, it)));
    let fixed: Vec<(u32, CpuSet)> = trials.fixed.iter().copied().chain(pinned).collect();
    for group in &mut groups {
        group.units.sort_unstable();
        let here = fixed.iter().filter(|(_, cpus)| cpus.meets(group.cpus));
        let numbers: BTreeSet<u32> = here.map(|(priority, _)| *priority).collect();
        let mut low = 1;
        for number in numbers {
            group.bands.push((low, number - 1));
            low = number + 1;
        }
        group.bands.push((low.min(HIGHEST), HIGHEST));
        let own: Vec<u32> = group.units.iter().filter_map(|it| trials.units[*it].priority).collect();
        group.own = own.iter().copied().collect();
        // Of equal priorities, none is kept: each activity gets its own.
        if group.own.len() < group.units.len() {
            group.own.clear();
        }
    }
    groups
}

impl PriorityGroup {
    /// Returns the units by deadline, the earliest first; those with equal deadlines in the order of their priorities.
    fn by_deadline(&self, trials: &Trials<'_>) -> Vec<usize> {
        let mut units = self.units.clone();
        units.sort_by_key(|it| (trials.units[*it].of.deadline, Reverse(trials.units[*it].priority)));
        units
    }

    /// Returns how many priorities there are in a band.
    fn room(&self, band: usize) -> usize {
        let (low, high) = self.bands[band];
        (high + 1).saturating_sub(low) as usize
    }

    /// Returns the number of orders; none if it is too great.
    fn orders(&self) -> Option<u64> {
        // Each priority that stays is at any place among the others.
        let all = self.units.len() + self.bands.len() - 1;
        let stays = (1..self.bands.len() as u64).product::<u64>().max(1);
        (1..=all as u64).try_fold(1u64, u64::checked_mul).map(|orders| orders / stays)
    }

    /// Enters the priorities of an order, and returns whether there are enough.
    fn number(&self, plan: &mut TunePlan, sequence: &Sequence) -> bool {
        for (band, units) in sequence.split(Option::is_none).enumerate() {
            let Some(&(low, high)) = self.bands.get(band).filter(|_| units.len() <= self.room(band)) else {
                return false;
            };
            let own: Vec<u32> = self.own.range(low..=high.max(low)).copied().collect();
            let numbers = if own.len() == units.len() { own } else { (low..=HIGHEST).collect() };
            for (unit, number) in units.iter().flatten().zip(numbers) {
                plan.priorities[*unit] = number;
            }
        }
        true
    }

    /// Audsley's algorithm. Returns an order, and the units for which it found no priority: they have the highest ones, by deadline.
    fn audsley(&self, trials: &Trials<'_>, start: &TunePlan) -> Option<(Sequence, Vec<usize>)> {
        let mut plan = start.clone();
        let mut left = self.by_deadline(trials);
        let mut sequence = Sequence::new();
        let (mut band, mut placed) = (0, 0);
        while !left.is_empty() {
            let mut chosen = None;
            if placed < self.room(band) {
                let number = self.bands[band].0 + placed as u32;
                for (index, &candidate) in left.iter().enumerate().rev() {
                    left.iter().for_each(|unit| plan.priorities[*unit] = HIGHEST);
                    plan.priorities[candidate] = number;
                    let slack = trials.analyse(&plan)?.slack[candidate];
                    if slack >= 0 && chosen.is_none_or(|(_, best)| slack > best) {
                        chosen = Some((index, slack));
                    }
                    if chosen.is_some() && trials.request.aim != TuneAim::Slack {
                        break;
                    }
                }
            }
            match chosen {
                Some((index, _)) => {
                    let unit = left.remove(index);
                    plan.priorities[unit] = self.bands[band].0 + placed as u32;
                    sequence.push(Some(unit));
                    placed += 1;
                }
                None if band + 1 < self.bands.len() => {
                    sequence.push(None);
                    (band, placed) = (band + 1, 0);
                }
                None => break,
            }
        }
        sequence.extend(left.iter().rev().map(|unit| Some(*unit)));
        sequence.extend((band + 1..self.bands.len()).map(|_| None));
        Some((sequence, left))
    }

    /// Returns the order of a plan.
    fn sequence(&self, plan: &TunePlan) -> Sequence {
        let mut units: Vec<(u32, Option<usize>)> =
            self.units.iter().map(|it| (plan.priorities[*it], Some(*it))).collect();
        units.extend(self.bands.iter().skip(1).map(|(low, _)| (low - 1, None)));
        units.sort_unstable();
        units.into_iter().map(|(_, unit)| unit).collect()
    }
}

/// Analyses all orders of the first group, with each all orders of the others, until `visit` returns true.
fn each_order(
    groups: &[PriorityGroup],
    plan: &TunePlan,
    visit: &mut dyn FnMut(&TunePlan) -> Option<bool>,
) -> Option<bool> {
    let Some((group, others)) = groups.split_first() else { return visit(plan) };
    let mut sequence = Sequence::new();
    let mut left = group.sequence(plan);
    permuted(&mut sequence, &mut left, &mut |sequence| {
        let mut plan = plan.clone();
        match group.number(&mut plan, sequence) {
            true => each_order(others, &plan, visit),
            false => Some(false),
        }
    })
}

/// Calls `visit` with each order of `left` behind `sequence`, until it returns true.
fn permuted(
    sequence: &mut Sequence,
    left: &mut Sequence,
    visit: &mut dyn FnMut(&Sequence) -> Option<bool>,
) -> Option<bool> {
    if left.is_empty() {
        return visit(sequence);
    }
    for index in 0..left.len() {
        // One of equal ones is enough.
        if left[index].is_none() && left[..index].contains(&None) {
            continue;
        }
        let next = left.remove(index);
        sequence.push(next);
        let is_done = permuted(sequence, left, visit)?;
        sequence.pop();
        left.insert(index, next);
        if is_done {
            return Some(true);
        }
    }
    Some(false)
}
