//! Which activity goes before which, and whether it should.

use rustc_hash::FxHashSet;

use crate::fact::{DeadlineAndPriority, TimingFact, TimingFactKind};
use crate::system::{Priority, Row, system_of};
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Location, ModelDb, Project, deployed, deployment};
use mauve_syntax::keywords::ActivityField;

/// What may be better about the priorities of a deployment.
pub fn priority_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<TimingFact<'db>> {
    check_rows(db, project, of, &system_of(db, project, of).rows)
}

/// The same of rows that it has, or is supposed to have.
pub(crate) fn check_rows<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    rows: &[Row<'db>],
) -> Vec<TimingFact<'db>> {
    let ranked: Vec<(u32, &Row<'db>)> = rows
        .iter()
        .filter_map(|row| match row.priority {
            Priority::RealTime(priority) => Some((priority, row)),
            Priority::Background | Priority::Unknown => None,
        })
        .collect();
    let priority_at = |instance: &Name| {
        let activity = deployment(db, of)?.activities.iter().find(|it| it.instance.name == *instance)?;
        let field =
            activity.fields.iter().find(|field| field.name.name == ActivityField::Priority.keyword())?;
        Some(Location::Source(of, field.value_id))
    };
    let mut found = Vec::new();
    let mut said: FxHashSet<Name> = FxHashSet::default();
    for (index, &(priority, row)) in ranked.iter().enumerate() {
        let Some(at) = priority_at(&row.instance) else { continue };
        // Said once for all that have the priority, at the second of them.
        let same = |(other, it): &&(u32, &Row<'db>)| *other == priority && share(row, it);
        let is_said = ranked.iter().take(index).filter(same).any(|(_, it)| said.contains(&it.instance));
        if ranked.iter().take(index).any(|it| same(&it)) && !is_said {
            let others = ranked.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, it)| it);
            let others = others
                .filter(same)
                .filter_map(|(_, other)| Some((other.instance.clone(), priority_at(&other.instance)?)))
                .collect();
            let instance = row.instance.clone();
            said.insert(instance.clone());
            let equal = TimingFactKind::EqualPriorities { instance, priority, others };
            found.push(TimingFact::new(at.clone(), equal));
        }
        if let Some(other) = before_its_time(rows, row)
            && let Priority::RealTime(other_priority) = other.priority
            && let (Some(early_at), Some(short), Some(long)) =
                (priority_at(&other.instance), row.deadline, other.deadline)
        {
            let late = DeadlineAndPriority { instance: row.instance.clone(), priority, deadline: short };
            let instance = other.instance.clone();
            let early = DeadlineAndPriority { instance, priority: other_priority, deadline: long };
            found.push(TimingFact::new(at, TimingFactKind::PriorityInversion { late, early, early_at }));
        }
    }
    found.extend(stale(db, project, of, &ranked));
    found
}

/// Returns the activity on the same CPU that has a later deadline and a higher priority: of several, the one with the
/// lowest priority.
pub(crate) fn before_its_time<'a, 'db>(rows: &'a [Row<'db>], of: &Row<'db>) -> Option<&'a Row<'db>> {
    let Priority::RealTime(own) = of.priority else { return None };
    let inverted = rows.iter().filter_map(|it| match it.priority {
        Priority::RealTime(priority) if priority > own && share(of, it) => Some((priority, it)),
        _ => None,
    });
    let is_later =
        |it: &Row<'db>| matches!((of.deadline, it.deadline), (Some(own), Some(other)) if own < other);
    inverted.filter(|(_, it)| is_later(it)).min_by_key(|(priority, _)| *priority).map(|(_, it)| it)
}

fn share(one: &Row<'_>, other: &Row<'_>) -> bool {
    matches!((one.cpus, other.cpus), (Some(one), Some(other)) if one & other != 0)
}

/// Components that run before those of the same period whose values they read.
fn stale<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    ranked: &[(u32, &Row<'db>)],
) -> Vec<TimingFact<'db>> {
    let Some((flat, _)) = deployed(db, project, of) else { return Vec::new() };
    let find = |name: &Name| ranked.iter().find(|(_, row)| row.instance == *name);
    let mut found = Vec::new();
    for link in flat.links.iter().filter(|link| !link.operation) {
        let (Some((low, writer)), Some((high, reader))) = (find(&link.source.0), find(&link.target.0)) else {
            continue;
        };
        // Of two that read from each other, one reads what is old.
        let is_mutual = flat.links.iter().any(|other| {
            !other.operation && other.source.0 == link.target.0 && other.target.0 == link.source.0
        });
        if high > low
            && !is_mutual
            && share(writer, reader)
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
