//! Facts about the order of priorities: equal priorities, an order that is not deadline-monotonic, outdated data.

use std::cmp::Reverse;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::fact::{DeadlineAndPriority, TimingFact, TimingFactKind};
use crate::system::{ResolvedActivity, activities_of};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Location, ModelDb, Project, deployed};
use mauve_syntax::keywords::ActivityField;
use mauve_timing::{CpuSet, Task};

/// Returns what may be wrong with the priorities of `activities`, those of the deployment or of a what-if question.
pub fn priority_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    activities: &[ResolvedActivity<'db>],
) -> Vec<TimingFact<'db>> {
    let mut ranked: Vec<Ranked<'_, 'db>> =
        activities.iter().filter_map(|activity| Some((activity.priority.real_time()?, activity))).collect();
    let stale = stale(db, project, of, &ranked);
    // The instances of one thread count once.
    let mut threads = FxHashSet::default();
    ranked.retain(|(_, it)| it.thread.is_none_or(|thread| threads.insert((thread, it.priority))));
    let declared = activities_of(db, of);
    let priority_at = |instance: &Name| {
        let field = declared.get(instance)?.field(ActivityField::Priority)?;
        Some(Location::Source(of, field.value_id))
    };
    let mut by_priority: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
    for (index, (priority, _)) in ranked.iter().enumerate() {
        by_priority.entry(*priority).or_default().push(index);
    }
    let mut found = Vec::new();
    let mut reported: FxHashSet<&Name> = FxHashSet::default();
    for (index, &(priority, activity)) in ranked.iter().enumerate() {
        let Some(at) = priority_at(&activity.instance) else { continue };
        // Reported once for all activities that have the priority, at the second of them.
        let equal = by_priority.get(&priority).into_iter().flatten();
        let same = equal.filter_map(|&other| Some((other, ranked.get(other)?.1)));
        let same = same.filter(|(other, it)| *other != index && share_cpu(activity, it));
        let mut before = same.clone().take_while(|(other, _)| *other < index).peekable();
        if before.peek().is_some() && !before.any(|(_, it)| reported.contains(&it.instance)) {
            let others = same
                .filter_map(|(_, other)| Some((other.activity.clone(), priority_at(&other.instance)?)))
                .collect();
            let instance = activity.activity.clone();
            reported.insert(&activity.instance);
            let equal = TimingFactKind::EqualPriorities { instance, priority, others };
            found.push(TimingFact::new(at.clone(), equal));
        }
    }
    found.extend(out_of_order(&ranked, &priority_at));
    found.extend(stale);
    found
}

type Ranked<'a, 'db> = (u32, &'a ResolvedActivity<'db>);

/// Returns the activities whose priority is out of order: on each CPU the fewest without which the others are
/// deadline-monotonic, that is, all but a longest sequence of rising priorities and falling deadlines.
fn out_of_order<'db>(
    ranked: &[Ranked<'_, 'db>],
    priority_at: &dyn Fn(&Name) -> Option<Location<'db>>,
) -> Vec<TimingFact<'db>> {
    let cpus: CpuSet = ranked.iter().filter_map(|(_, it)| it.cpus).collect();
    let mut reported = vec![false; ranked.len()];
    let mut seen = FxHashSet::default();
    for cpu in cpus.iter() {
        let is_here = |index: &usize| ranked[*index].1.cpus.is_some_and(|cpus| cpus.contains(cpu));
        let here: Vec<usize> = (0..ranked.len()).filter(|index| !reported[*index]).filter(is_here).collect();
        // Several CPUs have the same activities where no affinity is written.
        if seen.insert(here.clone()) {
            removed_for_order(ranked, here).into_iter().for_each(|index| reported[index] = true);
        }
    }
    let found = (0..ranked.len()).filter(|index| reported[*index]);
    found.filter_map(|index| order_fact(ranked, index, &reported, priority_at)).collect()
}

/// Returns the fewest of the activities `here` without which no other has a shorter deadline than one of a higher priority.
/// O(n log n).
fn removed_for_order(ranked: &[Ranked<'_, '_>], mut here: Vec<usize>) -> Vec<usize> {
    // Of equal priorities, the order is free.
    here.retain(|&index| ranked[index].1.deadline.is_some());
    here.sort_by_key(|&index| (ranked[index].0, Reverse(ranked[index].1.deadline)));
    let deadline = |index: usize| ranked[index].1.deadline;
    // The last of each shortest sequence: with the latest deadline of all sequences of that length.
    let mut last: Vec<usize> = Vec::new();
    let mut before: Vec<Option<usize>> = vec![None; ranked.len()];
    for &index in &here {
        let length = last.partition_point(|&other| deadline(other) >= deadline(index));
        before[index] = length.checked_sub(1).map(|length| last[length]);
        match last.get_mut(length) {
            Some(other) => *other = index,
            None => last.push(index),
        }
    }
    let kept: FxHashSet<usize> =
        std::iter::successors(last.last().copied(), |&index| before[index]).collect();
    here.retain(|index| !kept.contains(index));
    here
}

/// Returns the fact about one activity that is out of order, with one of those that are in order, and with a free priority
/// that puts it in order.
fn order_fact<'db>(
    ranked: &[Ranked<'_, 'db>],
    index: usize,
    reported: &[bool],
    priority_at: &dyn Fn(&Name) -> Option<Location<'db>>,
) -> Option<TimingFact<'db>> {
    let (priority, activity) = *ranked.get(index)?;
    let deadline = activity.deadline?;
    let in_order = ranked.iter().zip(reported).filter(|(_, reported)| !**reported).map(|(it, _)| *it);
    let in_order: Vec<Ranked<'_, 'db>> = in_order.filter(|(_, it)| share_cpu(activity, it)).collect();
    let later =
        in_order.iter().filter(|(_, it)| it.deadline > Some(deadline)).max_by_key(|(other, _)| *other);
    let earlier =
        in_order.iter().filter(|(_, it)| it.deadline.is_some_and(|it| it < deadline)).min_by_key(|it| it.0);
    let (above, below) = (later.map_or(0, |it| it.0), earlier.map_or(100, |it| it.0));
    // A bit for each priority, at most 99.
    let here = ranked.iter().filter(|(_, it)| share_cpu(activity, it));
    let taken: u128 = here.fold(0, |taken, (priority, _)| taken | 1 << priority);
    let is_free = |priority: &u32| taken & 1 << priority == 0;
    let mut between = above + 1..below;
    let (&(other_priority, other), free) = match later.filter(|(other, _)| *other > priority) {
        Some(later) => (later, between.find(is_free)),
        None => (earlier.filter(|(other, _)| *other < priority)?, between.rev().find(is_free)),
    };
    let (at, other_at) = (priority_at(&activity.instance)?, priority_at(&other.instance)?);
    let activity = DeadlineAndPriority { instance: activity.activity.clone(), priority, deadline };
    let instance = other.activity.clone();
    let other = DeadlineAndPriority { instance, priority: other_priority, deadline: other.deadline? };
    Some(TimingFact::new(at, TimingFactKind::NotDeadlineMonotonic { activity, other, other_at, free }))
}

/// Returns the activity on the same CPU that has a later deadline and a higher priority: of several, the one with the
/// lowest priority.
pub(crate) fn inverted<'a, 'db>(
    activities: &'a [ResolvedActivity<'db>],
    of: &ResolvedActivity<'db>,
) -> Option<&'a ResolvedActivity<'db>> {
    let own = of.priority.real_time()?;
    let ranked = activities.iter().filter_map(|it| Some((it.priority.real_time()?, it)));
    let higher = ranked.filter(|(priority, it)| *priority > own && share_cpu(of, it));
    let later = higher.filter(|(_, it)| of.deadline.zip(it.deadline).is_some_and(|(own, other)| own < other));
    later.min_by_key(|(priority, _)| *priority).map(|(_, it)| it)
}

/// Returns whether a reader reads before the writer writes, in each period.
pub(crate) fn is_stale(writer: &Task, reader: &Task) -> bool {
    let priorities = writer.priority.real_time().zip(reader.priority.real_time());
    priorities.is_some_and(|(low, high)| high > low)
        && share_cpu(writer, reader)
        && !(writer.is_sporadic || reader.is_sporadic)
        && reader.period.is_some()
        && [writer, reader].into_iter().all(Task::is_periodic)
        && reader.period == writer.period
}

fn share_cpu(one: &Task, other: &Task) -> bool {
    one.cpus.zip(other.cpus).is_some_and(|(one, other)| one.meets(other))
}

fn stale<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    ranked: &[Ranked<'_, 'db>],
) -> Vec<TimingFact<'db>> {
    let Some((flat, _)) = deployed(db, project, of) else { return Vec::new() };
    // The first activity of each instance.
    let by_instance: FxHashMap<&Name, &Ranked<'_, 'db>> =
        ranked.iter().rev().map(|ranked| (&ranked.1.instance, ranked)).collect();
    let find = |name: &Name| by_instance.get(name).copied();
    let links = || flat.links.iter().filter(|link| !link.operation);
    let ends: FxHashSet<(&Name, &Name)> = links().map(|it| (&it.source.0, &it.target.0)).collect();
    let mut found = Vec::new();
    for link in links() {
        let (Some((_, writer)), Some((_, reader))) = (find(&link.source.0), find(&link.target.0)) else {
            continue;
        };
        // Where two activities read from each other, one of them always reads outdated data.
        let is_mutual = ends.contains(&(&link.target.0, &link.source.0));
        if !is_mutual && is_stale(writer, reader) {
            let stale = TimingFactKind::StaleData {
                reader: reader.instance.clone(),
                writer: writer.instance.clone(),
                port: link.target.1.clone(),
                writer_at: writer.at.clone(),
            };
            found.push(TimingFact::new(reader.at.clone(), stale));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::system_of;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};

    /// The activities that the facts of a deployment of `a`, `b` and `c` name.
    fn named(activities: &str) -> Vec<String> {
        let db = Database::default();
        let text = format!(
            "shell S {{ }} core K(S) {{ update = {{ }} }} component C(S, K)
            architecture R {{ instance a: C instance b: C instance c: C }}
            deployment D {{ architecture R {activities} }}"
        );
        let workspace = Workspace::of_texts(&db, "/".into(), [("/robot.mal".into(), text)]);
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let activities = &system_of(&db, project, of).activities;
        let facts = priority_facts(&db, project, of, activities);
        let name = |it: &TimingFact<'_>| match &it.kind {
            TimingFactKind::EqualPriorities { instance, others, .. } => {
                let others = others.iter().map(|(other, _)| other.as_str()).collect::<Vec<_>>();
                format!("{instance} as {}", others.join(", "))
            }
            TimingFactKind::NotDeadlineMonotonic { activity, other, .. } => {
                format!("{} not {}", activity.instance, other.instance)
            }
            other => format!("{other:?}"),
        };
        facts.iter().map(name).collect()
    }

    #[test]
    fn a_thread_has_one_priority() {
        let thread = "activity drivers { instances = [a, b] priority = 2 period = 100 }";
        assert_eq!(named(&format!("{thread} activity c {{ priority = 3 period = 50 }}")), [] as [&str; 0]);
        assert_eq!(named(&format!("{thread} activity c {{ priority = 2 period = 50 }}")), ["c as drivers"]);
        assert_eq!(named(&format!("{thread} activity c {{ priority = 1 period = 50 }}")).len(), 1);
    }
}
