//! Which activity goes before which, and whether it should.

use rustc_hash::FxHashSet;

use crate::ModelDb;
use crate::diagnostics::{self, Diagnostic};
use crate::item_tree::Name;
use crate::project::Project;
use crate::settings::deployed;
use crate::source::{Decl, Place, deployment};
use crate::system::{Priority, Row, system_of};

/// What may be better about the priorities of a deployment.
pub(crate) fn check<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Diagnostic<'db>> {
    check_rows(db, project, of, &system_of(db, project, of).rows)
}

/// The same of rows that it has, or is supposed to have.
pub(crate) fn check_rows<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    rows: &[Row<'db>],
) -> Vec<Diagnostic<'db>> {
    let ranked: Vec<(u32, &Row<'db>)> = rows
        .iter()
        .filter_map(|row| match row.priority {
            Priority::RealTime(priority) => Some((priority, row)),
            Priority::Background | Priority::Unknown => None,
        })
        .collect();
    let priority_at = |instance: &Name| {
        let activity = deployment(db, of)?.activities.iter().find(|it| it.instance.name == *instance)?;
        let field = activity.fields.iter().find(|field| field.name.name == "priority")?;
        Some(Place::Part(of, field.value_part))
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
            let others: Vec<(&str, Place<'db>)> = others
                .filter(same)
                .filter_map(|(_, other)| Some((other.instance.as_str(), priority_at(&other.instance)?)))
                .collect();
            said.insert(row.instance.clone());
            found.push(diagnostics::equal_priorities::report(at.clone(), &row.instance, priority, &others));
        }
        if let Some(other) = before_its_time(rows, row)
            && let Priority::RealTime(other_priority) = other.priority
            && let (Some(other_at), Some(short), Some(long)) =
                (priority_at(&other.instance), row.deadline, other.deadline)
        {
            let late = (row.instance.as_str(), (priority, at), short);
            let early = (other.instance.as_str(), (other_priority, other_at), long);
            found.push(diagnostics::priority_inversion::report(late, early));
        }
    }
    found.extend(stale(db, project, of, &ranked));
    found
}

/// Who goes before an activity on its CPU although he may end later: of those, the least urgent.
pub fn before_its_time<'a, 'db>(rows: &'a [Row<'db>], of: &Row<'db>) -> Option<&'a Row<'db>> {
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
) -> Vec<Diagnostic<'db>> {
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
            let names = [reader.instance.as_str(), writer.instance.as_str()];
            let (at, other) = (reader.at.clone(), writer.at.clone());
            found.push(diagnostics::stale_data::report(at, names, &link.target.1, other));
        }
    }
    found
}
