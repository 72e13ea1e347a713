//! Diagnostics of the order of priorities: equal priorities, priorities against the deadlines, outdated data.

use rustc_hash::FxHashSet;

use crate::fact::{DeadlineAndPriority, TimingFact, TimingFactKind};
use crate::system::{Priority, ResolvedActivity, written_field};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Location, ModelDb, Project, deployed};
use mauve_syntax::keywords::ActivityField;

/// Returns what may be wrong with the priorities of `activities`, those of the deployment or of a what-if question.
pub fn priority_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    activities: &[ResolvedActivity<'db>],
) -> Vec<TimingFact<'db>> {
    let ranked = activities.iter().filter_map(|activity| match activity.priority {
        Priority::RealTime(priority) => Some((priority, activity)),
        Priority::Background | Priority::Unknown => None,
    });
    let ranked: Vec<Ranked<'_, 'db>> = ranked.collect();
    let priority_at = |instance: &Name| {
        let field = written_field(db, of, instance, ActivityField::Priority)?;
        Some(Location::Source(of, field.value_id))
    };
    let mut found = Vec::new();
    let mut reported: FxHashSet<&Name> = FxHashSet::default();
    for (index, &(priority, activity)) in ranked.iter().enumerate() {
        let Some(at) = priority_at(&activity.instance) else { continue };
        // Reported once for all activities that have the priority, at the second of them.
        let is_same = |(other, it): &&Ranked<'_, 'db>| *other == priority && share_cpu(activity, it);
        let mut before = ranked.iter().take(index).filter(is_same).peekable();
        if before.peek().is_some() && !before.any(|(_, it)| reported.contains(&it.instance)) {
            let others = ranked.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, it)| it);
            let others = others
                .filter(is_same)
                .filter_map(|(_, other)| Some((other.instance.clone(), priority_at(&other.instance)?)))
                .collect();
            let instance = activity.instance.clone();
            reported.insert(&activity.instance);
            let equal = TimingFactKind::EqualPriorities { instance, priority, others };
            found.push(TimingFact::new(at.clone(), equal));
        }
        if let Some(other) = inverted(activities, activity)
            && let Priority::RealTime(other_priority) = other.priority
            && let (Some(early_at), Some(short), Some(long)) =
                (priority_at(&other.instance), activity.deadline, other.deadline)
        {
            let late = DeadlineAndPriority { instance: activity.instance.clone(), priority, deadline: short };
            let instance = other.instance.clone();
            let early = DeadlineAndPriority { instance, priority: other_priority, deadline: long };
            found.push(TimingFact::new(at, TimingFactKind::PriorityInversion { late, early, early_at }));
        }
    }
    found.extend(stale(db, project, of, &ranked));
    found
}

type Ranked<'a, 'db> = (u32, &'a ResolvedActivity<'db>);

/// Returns the activity on the same CPU that has a later deadline and a higher priority: of several, the one with the
/// lowest priority.
pub(crate) fn inverted<'a, 'db>(
    activities: &'a [ResolvedActivity<'db>],
    of: &ResolvedActivity<'db>,
) -> Option<&'a ResolvedActivity<'db>> {
    let Priority::RealTime(own) = of.priority else { return None };
    let higher = activities.iter().filter_map(|it| match it.priority {
        Priority::RealTime(priority) if priority > own && share_cpu(of, it) => Some((priority, it)),
        _ => None,
    });
    let later = higher.filter(|(_, it)| of.deadline.zip(it.deadline).is_some_and(|(own, other)| own < other));
    later.min_by_key(|(priority, _)| *priority).map(|(_, it)| it)
}

fn share_cpu(one: &ResolvedActivity<'_>, other: &ResolvedActivity<'_>) -> bool {
    one.cpus.zip(other.cpus).is_some_and(|(one, other)| one & other != 0)
}

fn stale<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    ranked: &[Ranked<'_, 'db>],
) -> Vec<TimingFact<'db>> {
    let Some((flat, _)) = deployed(db, project, of) else { return Vec::new() };
    let find = |name: &Name| ranked.iter().find(|(_, it)| it.instance == *name);
    let mut found = Vec::new();
    for link in flat.links.iter().filter(|link| !link.operation) {
        let (Some((low, writer)), Some((high, reader))) = (find(&link.source.0), find(&link.target.0)) else {
            continue;
        };
        // Where two activities read from each other, one of them always reads outdated data.
        let is_mutual = flat.links.iter().any(|other| {
            !other.operation && other.source.0 == link.target.0 && other.target.0 == link.source.0
        });
        if high > low
            && !is_mutual
            && share_cpu(writer, reader)
            && reader.period.is_some()
            && reader.period == writer.period
        {
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
