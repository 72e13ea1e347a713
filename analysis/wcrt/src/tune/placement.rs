//! CPUs: a placement of the activities with which every deadline is met.
//!
//! An activity moves within its host, with all instances of its thread and with all activities that take a lock with it. Where the
//! CPUs do not depend on each other, the search is exact: branch and bound over the placements, the activities with the greatest
//! utilisation first, each on its present CPU first. A set of activities that does not fit on a CPU is analysed once, and no superset
//! of it. Otherwise all placements are analysed if they are few. Beyond these, the heuristic: by falling utilisation, each activity
//! goes to the CPU with the lowest one (worst-fit decreasing); then single activities move as long as something gets better.

use mauve_timing::CpuSet;
use rustc_hash::FxHashMap;

use super::order::{ordered, quickly_ordered};
use super::trials::{Best, Score, Trials, TunePlan};
use super::{SearchKind, TuneAim};

/// So many placements are analysed one by one where CPUs depend on each other: those of seven activities on three CPUs are 2187.
const MOST_PLACEMENTS: usize = 4096;

/// Activities that are placed together.
struct Cluster {
    units: Vec<usize>,
    /// Where it may be.
    choices: Vec<CpuSet>,
    /// The CPU that is written now.
    now: Option<CpuSet>,
    utilisation: f64,
}

impl Cluster {
    fn put(&self, plan: &mut TunePlan, cpu: CpuSet) {
        self.units.iter().for_each(|unit| plan.cpus[*unit] = Some(cpu));
    }
}

/// Searches for CPUs, and with `priorities` of the request for priorities too.
pub(super) fn placed(trials: &Trials<'_>, start: &TunePlan) -> Option<Best> {
    let clusters = clusters(trials, start);
    let is_placed = start.present().iter().all(|unit| trials.units[*unit].is_placed);
    if is_placed && let Some(found) = Best::of(trials, start).filter(|it| trials.is_enough(it.score)) {
        return Some(found);
    }
    let mut found = solved(trials, &worst_fit(trials, &clusters, start, true))?;
    if trials.is_enough(found.score) {
        return Some(found);
    }
    if search(trials, &clusters, start, &mut found).is_none() {
        found.search = SearchKind::Exhausted;
    }
    if trials.request.priorities && !trials.is_enough(found.score) {
        ordered(trials, &found.plan).into_iter().for_each(|better| found.consider(better));
    }
    Some(found)
}

fn search(trials: &Trials<'_>, clusters: &[Cluster], start: &TunePlan, found: &mut Best) -> Option<()> {
    // Part of the budget stays for the exact search.
    let is_improved = trials.variants.within(trials.variants.left.get() / 3, || {
        improve(trials, clusters, found)?;
        found.consider(solved(trials, &worst_fit(trials, clusters, start, false))?);
        if trials.is_enough(found.score) { Some(()) } else { improve(trials, clusters, found) }
    });
    if trials.is_enough(found.score) {
        return Some(());
    }
    let placements = clusters.iter().try_fold(1usize, |product, it| product.checked_mul(it.choices.len()));
    if trials.has_separate_cpus() && trials.request.aim != TuneAim::Latency {
        let mut exact = ExactPlacement { trials, clusters, start, known: FxHashMap::default(), best: None };
        exact.place(0, &[])?;
        exact.best.into_iter().for_each(|best| found.consider(best));
        // What the exhausted budget of an analysis does not prove may be proved beside other activities.
        let is_free = !trials.request.priorities || trials.is_order_free(&found.plan);
        found.search = if is_free { SearchKind::Exact } else { SearchKind::Heuristic };
        if is_free || trials.is_enough(found.score) {
            return Some(());
        }
    }
    if let Some(placements) = placements.filter(|it| *it <= MOST_PLACEMENTS) {
        let is_exact = !trials.request.priorities;
        found.search = if is_exact { SearchKind::Exact } else { SearchKind::Heuristic };
        return each_placement(trials, clusters, start, placements, found);
    }
    found.search = SearchKind::Heuristic;
    is_improved
}

/// Returns a placement with its priorities.
fn solved(trials: &Trials<'_>, plan: &TunePlan) -> Option<Best> {
    if trials.request.priorities { quickly_ordered(trials, plan) } else { Best::of(trials, plan) }
}

/// Returns the activities that are placed together, by falling utilisation.
fn clusters(trials: &Trials<'_>, plan: &TunePlan) -> Vec<Cluster> {
    let mut sets: Vec<Vec<usize>> =
        plan.present().into_iter().filter(|it| !trials.units[*it].is_pinned).map(|it| vec![it]).collect();
    let pinned = |units: &[usize]| units.iter().copied().find(|it| trials.units[*it].is_pinned);
    let mut of_pinned: FxHashMap<usize, usize> = FxHashMap::default();
    for users in trials.sharing_locks() {
        let mut joined = Vec::new();
        for set in sets.extract_if(.., |set| set.iter().any(|it| users.contains(it))) {
            joined.extend(set);
        }
        if let Some(pin) = pinned(&users) {
            of_pinned.extend(joined.iter().map(|it| (*it, pin)));
        }
        if !joined.is_empty() {
            sets.push(joined);
        }
    }
    let cluster = |mut units: Vec<usize>| {
        units.sort_unstable();
        let first = &trials.units[units[0]];
        let pin = units.iter().find_map(|it| of_pinned.get(it)).map(|it| trials.units[*it].cpus);
        let choices = match pin {
            Some(cpus) => vec![cpus],
            None => trials.cpus_of_host(first).each().collect(),
        };
        let now = (first.is_placed && first.cpus.is_one()).then_some(first.cpus);
        let utilisation = units.iter().map(|it| trials.units[*it].utilisation).sum();
        Cluster { units, choices, now, utilisation }
    };
    let mut clusters: Vec<Cluster> = sets.into_iter().map(cluster).collect();
    clusters.sort_by(|one, other| other.utilisation.total_cmp(&one.utilisation));
    clusters
}

/// Places the clusters one after another on the CPU with the lowest utilisation; those that have a CPU stay there if `keeps`.
fn worst_fit(trials: &Trials<'_>, clusters: &[Cluster], start: &TunePlan, keeps: bool) -> TunePlan {
    let mut plan = start.clone();
    let mut load: FxHashMap<CpuSet, f64> = FxHashMap::default();
    for unit in plan.present().into_iter().filter(|it| trials.units[*it].is_pinned) {
        let cpus = trials.cpus(&plan, unit);
        let share = trials.units[unit].utilisation / f64::from(cpus.len().max(1));
        cpus.each().for_each(|cpu| *load.entry(cpu).or_default() += share);
    }
    let stays = |it: &&Cluster| keeps && it.now.is_some_and(|now| it.choices.contains(&now));
    let (staying, moving): (Vec<&Cluster>, Vec<&Cluster>) = clusters.iter().partition(stays);
    for cluster in staying.into_iter().chain(moving) {
        let least = || {
            let load = |cpu: &CpuSet| load.get(cpu).copied().unwrap_or_default();
            cluster.choices.iter().copied().min_by(|one, other| load(one).total_cmp(&load(other)))
        };
        let Some(cpu) = cluster.now.filter(|_| stays(&cluster)).or_else(least) else { continue };
        cluster.put(&mut plan, cpu);
        *load.entry(cpu).or_default() += cluster.utilisation;
    }
    plan
}

/// The priorities of the units on a CPU, and how good they are.
type Fit = (Vec<(usize, u32)>, Score);

/// The exact search.
struct ExactPlacement<'a, 'db> {
    trials: &'a Trials<'db>,
    clusters: &'a [Cluster],
    start: &'a TunePlan,
    /// For a CPU and the clusters on it; none if a deadline is not met.
    known: FxHashMap<(CpuSet, Vec<usize>), Option<Fit>>,
    best: Option<Best>,
}

impl ExactPlacement<'_, '_> {
    /// Places the clusters from this one on. None where the budget is exhausted.
    fn place(&mut self, next: usize, placed: &[(CpuSet, Vec<usize>)]) -> Option<()> {
        let Some(cluster) = self.clusters.get(next) else { return self.take(placed) };
        let utilisation = |cpu: &CpuSet| {
            let here = placed.iter().filter(|(it, _)| it == cpu).flat_map(|(_, clusters)| clusters);
            here.map(|it| self.clusters[*it].utilisation).sum::<f64>()
        };
        let mut choices = cluster.choices.clone();
        choices.sort_by(|one, other| {
            let key = |cpu: &CpuSet| Some(*cpu) != cluster.now;
            key(one).cmp(&key(other)).then(utilisation(one).total_cmp(&utilisation(other)))
        });
        let mut tried_empty: Vec<CpuSet> = Vec::new();
        for cpu in choices {
            let mut placed = placed.to_vec();
            match placed.iter_mut().find(|(it, _)| *it == cpu) {
                Some((_, clusters)) => clusters.push(next),
                None => {
                    // Of several empty CPUs that are alike, one is enough.
                    if tried_empty.iter().any(|it| self.is_alike(*it, cpu)) {
                        continue;
                    }
                    tried_empty.push(cpu);
                    placed.push((cpu, vec![next]));
                }
            }
            let Some((_, here)) = placed.iter().find(|(it, _)| *it == cpu) else { continue };
            let here = here.clone();
            let bound = self.on(cpu, &here)?;
            if bound.is_some_and(|score| self.best.as_ref().is_none_or(|best| score > best.score)) {
                self.place(next + 1, &placed)?;
            }
            if self.best.is_some() && self.trials.request.aim == TuneAim::Deadlines {
                return Some(());
            }
        }
        Some(())
    }

    /// Takes a complete placement.
    fn take(&mut self, placed: &[(CpuSet, Vec<usize>)]) -> Option<()> {
        let mut plan = self.start.clone();
        for (cpu, clusters) in placed {
            clusters.iter().for_each(|it| self.clusters[*it].put(&mut plan, *cpu));
            if let Some(Some((priorities, _))) = self.known.get(&(*cpu, clusters.clone())) {
                priorities.iter().for_each(|(unit, number)| plan.priorities[*unit] = *number);
            }
        }
        let found = Best::of(self.trials, &plan)?;
        if found.score.is_met() && self.best.as_ref().is_none_or(|best| found.score > best.score) {
            self.best = Some(found);
        }
        Some(())
    }

    /// Returns how good these clusters are on a CPU, without the others; none if a deadline is not met. The outer none: the budget is
    /// exhausted.
    fn on(&mut self, cpu: CpuSet, clusters: &[usize]) -> Option<Option<Score>> {
        let key = (cpu, clusters.to_vec());
        if let Some(known) = self.known.get(&key) {
            return Some(known.as_ref().map(|(_, score)| *score));
        }
        let mut plan = self.start.clone();
        let units: Vec<usize> = clusters.iter().flat_map(|it| self.clusters[*it].units.clone()).collect();
        for unit in 0..plan.left_out.len() {
            let is_here = units.contains(&unit);
            // Pinned activities stay where they are.
            plan.left_out[unit] |= !is_here && !self.trials.units[unit].is_pinned;
            if is_here {
                plan.cpus[unit] = Some(cpu);
            }
        }
        let Best { plan, score, .. } = solved(self.trials, &plan)?;
        let numbers = || units.iter().map(|unit| (*unit, plan.priorities[*unit])).collect();
        let known = score.is_met().then(|| (numbers(), score));
        self.known.insert(key, known);
        Some(score.is_met().then_some(score))
    }

    /// Returns whether nothing that stays, and nothing that is written, distinguishes two CPUs.
    fn is_alike(&self, one: CpuSet, other: CpuSet) -> bool {
        let is_on_both = |cpus: CpuSet| cpus.meets(one) == cpus.meets(other);
        let mut pinned = self.trials.units.iter().filter(|it| it.is_pinned);
        self.trials.fixed.iter().all(|(_, cpus)| is_on_both(*cpus))
            && pinned.all(|it| is_on_both(it.cpus))
            && self.clusters.iter().all(|it| it.now.is_none_or(is_on_both))
    }
}

/// Analyses all placements, until one is good enough. None where the budget is exhausted.
fn each_placement(
    trials: &Trials<'_>,
    clusters: &[Cluster],
    start: &TunePlan,
    placements: usize,
    found: &mut Best,
) -> Option<()> {
    for number in 0..placements {
        let (mut plan, mut left) = (start.clone(), number);
        // The digits of the number are the choices, that of the last cluster first.
        for cluster in clusters.iter().rev() {
            cluster.put(&mut plan, cluster.choices[left % cluster.choices.len()]);
            left /= cluster.choices.len();
        }
        found.consider(solved(trials, &plan)?);
        if trials.is_enough(found.score) {
            break;
        }
    }
    Some(())
}

/// A change of a placement.
enum PlacementChange<'a> {
    Move(&'a Cluster, CpuSet),
    Swap(&'a Cluster, &'a Cluster),
}

/// Moves one cluster after another to each CPU, and swaps it with each that follows, as long as something gets better.
fn improve(trials: &Trials<'_>, clusters: &[Cluster], found: &mut Best) -> Option<()> {
    let changes = clusters.iter().enumerate().flat_map(|(index, cluster)| {
        let moves = cluster.choices.iter().map(move |cpu| PlacementChange::Move(cluster, *cpu));
        moves.chain(clusters.iter().skip(index + 1).map(move |other| PlacementChange::Swap(cluster, other)))
    });
    let changes: Vec<PlacementChange<'_>> = changes.collect();
    found.improve(trials, &changes, |now, change| {
        let mut plan = now.clone();
        match change {
            PlacementChange::Move(cluster, cpu) => cluster.put(&mut plan, *cpu),
            PlacementChange::Swap(one, other) => {
                let cpus = [one, other].map(|it| it.units.first().and_then(|it| now.cpus[*it]));
                let [Some(of_one), Some(of_other)] = cpus else { return Some(None) };
                if one.choices.contains(&of_other) && other.choices.contains(&of_one) {
                    one.put(&mut plan, of_other);
                    other.put(&mut plan, of_one);
                }
            }
        }
        if plan == *now { Some(None) } else { solved(trials, &plan).map(Some) }
    })
}
