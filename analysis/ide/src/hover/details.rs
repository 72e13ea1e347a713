//! What a hover shows of a name beyond its declaration: the values of a property, the connections of a port, the execution times
//! of a state, the timing table of a codel and how far its time may grow.

use std::fmt::Write as _;

use mauve_diagnostics::{timing_reason, type_name};
use mauve_hir::item_tree::{Feature, HookKind, Kind, Name, NameRef, SourceId};
use mauve_hir::{
    Decl, FeatureOf, Flat, FlatInstance, Location, ModelDb, ProgramId, Project, core, flat_of,
    inference_of_core, line_of, names_of, product_of, ros2_of, shell, type_of, values_in_effect,
};
use mauve_syntax::TextSize;
use mauve_timing::Time;
use mauve_wcrt::{TableSet, files_of, level_shown, psm_of, table, table_files, table_sets};
use rustc_hash::FxHashSet;

use super::format::{HoverContext, and_more};
use super::summary::{self, by_tables};
use crate::document_symbols::SymbolKind;
use crate::inlay_hints::components_of;
use crate::markdown;
use crate::occurrences::{Definition, FoundName, each_once, grouped};
use crate::sensitivity::limits_of_codel;

const MOST_LINES: usize = 12;

/// Returns the details of `found` in Markdown, empty for most names. `shown` is the Markdown so far; `explained` is the deployment
/// whose activity the hover explains.
pub(super) fn details<'db>(
    cx: &HoverContext<'_, 'db>,
    found: &FoundName<'db>,
    shown: &str,
    explained: Option<Decl<'db>>,
) -> String {
    let HoverContext { db, project, .. } = *cx;
    if let Definition::Declaration(decl) = found.definition
        && decl.kind(db) == Kind::Codel
    {
        let mut out = table_of_codel(db, project, decl);
        for line in limits_of_codel(db, project, decl) {
            let _ = writeln!(out, "{line}\n");
        }
        return out;
    }
    if let Definition::Declaration(decl) = found.definition {
        return summary::of_declaration(cx, decl);
    }
    let Definition::At(Location::Source(of, id)) = found.definition else { return String::new() };
    match found.kind {
        SymbolKind::Port => block([connections(db, project, of, id), topics(db, project, of, id)].concat()),
        SymbolKind::Operation => block(connections(db, project, of, id)),
        SymbolKind::Property | SymbolKind::Constant => {
            resolved_type(db, project, of, id, shown) + &block(values(db, project, of, id))
        }
        SymbolKind::Variable => {
            let product = (of.kind(db) == Kind::Core).then(|| product_of(db, project, of));
            let values = product.and_then(|product| product.values.iter().find(|(it, _)| *it == id));
            let values = values.map_or_else(String::new, |(_, values)| format!("values: {values}\n\n"));
            resolved_type(db, project, of, id, shown) + &values
        }
        SymbolKind::Instance => {
            let (connections, responses) = summary::of_instance(cx, (of, id), explained);
            match block(connections) {
                connections if responses.is_empty() => connections,
                connections => format!("{connections}\n{responses}"),
            }
        }
        SymbolKind::State | SymbolKind::Transition | SymbolKind::Hook => block(programs(db, project, of, id)),
        _ => String::new(),
    }
}

fn block(mut lines: Vec<String>) -> String {
    lines.dedup();
    if lines.is_empty() {
        return String::new();
    }
    markdown::block("text", &and_more(lines, MOST_LINES).join("\n"))
}

/// Returns `from timing/robot.toml, line 3` for each table with a time of the codel; for tables of a deployment, with its name.
fn table_of_codel<'db>(db: &'db dyn ModelDb, project: Project<'db>, codel: Decl<'db>) -> String {
    let workspace = project.workspace(db);
    let names = names_of(db, project);
    let using = table_sets(db, project);
    let mut out = String::new();
    for &file in &table_files(db, workspace).files {
        for entry in &table(db, file).codels {
            if !entry.key.ends_with(codel.name(db).as_str())
                || !names.by_key(Kind::Codel, &entry.key).contains(&codel)
            {
                continue;
            }
            let path = file.path(db);
            let path = path.strip_prefix(workspace.folder(db)).unwrap_or(path).display().to_string();
            let line = line_of(db, file, TextSize::new(entry.key_span.start as u32));
            let using = using.iter().filter(|tables| files_of(db, **tables).contains(&file));
            let using: Vec<Option<String>> = using.map(|tables| tables.label(db)).collect();
            let sections: Vec<&str> = using.iter().flatten().map(String::as_str).collect();
            let of_which = match sections.join(", ") {
                _ if using.is_empty() => " (used by no deployment)".to_owned(),
                none if none.is_empty() => none,
                sections if using.contains(&None) => format!(" (also times of {sections})"),
                sections => format!(" (times of {sections})"),
            };
            let _ = writeln!(out, "from {}, line {line}{of_which}\n", markdown::code(&path));
        }
    }
    out
}

/// Returns the resolved type of a variable, a property or a constant, if the declaration spells it differently.
fn resolved_type(db: &dyn ModelDb, project: Project<'_>, of: Decl<'_>, id: SourceId, shown: &str) -> String {
    let ty = if of.kind(db) == Kind::Core {
        let inference = inference_of_core(db, project, of);
        let mut variables = inference.variables();
        variables.find(|(_, it)| it.name.id == id).map(|(_, variable)| type_name(&variable.ty).into_owned())
    } else {
        let feature = shell(db, of).and_then(|data| data.features.iter().find(|it| it.name.id == id));
        feature.map(|feature| type_name(&type_of(db, project, of, feature.ty.as_ref())).into_owned())
    };
    match ty {
        Some(ty) if !shown.contains(&ty) => format!("of type {}\n\n", markdown::code(&ty)),
        _ => String::new(),
    }
}

/// Returns the deployments, or without any the architectures, each with its instances and connections.
fn deployed<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<(Decl<'db>, &'db Flat<'db>)> {
    let found = crate::connections::deployments(db, project);
    if !found.is_empty() {
        return found;
    }
    let names = names_of(db, project);
    names.of_kind(db, Kind::Architecture).map(|of| (of, flat_of(db, project, of))).collect()
}

/// Returns the deployed instances that have a feature: the deployment or architecture, the instance, and the feature's name.
fn having<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    id: SourceId,
) -> Vec<(Decl<'db>, &'db Flat<'db>, &'db Name, &'db Name)> {
    let features = || shell(db, of)?.features.iter().enumerate().find(|(_, it)| it.name.id == id);
    let Some((index, Feature { name: NameRef { name, .. }, .. })) = features() else { return Vec::new() };
    let is_it = |it: &FeatureOf<'_>| it.shell == of && it.index as usize == index;
    let has_it = |it: &FlatInstance<'db>| it.features(db, project)?.get(name).filter(|it| is_it(it));
    let mut found = Vec::new();
    for (root, flat) in deployed(db, project) {
        let instances = flat.instances.iter().filter(|it| has_it(it).is_some());
        found.extend(instances.map(|instance| (root, flat, &instance.name, name)));
    }
    found
}

/// Returns the connections of a port or operation, such as `laser.scan -> map.scan`.
fn connections(db: &dyn ModelDb, project: Project<'_>, of: Decl<'_>, id: SourceId) -> Vec<String> {
    let lines = |(flat, instance, name): (&Flat<'_>, &Name, &Name)| {
        let is_it = |end: &(Name, Name)| end.0 == *instance && end.1 == *name;
        let links = flat.links.iter().filter(|link| is_it(&link.source) || is_it(&link.target));
        let lines: Vec<String> = links.map(ToString::to_string).collect();
        if lines.is_empty() { vec![format!("{instance}.{name} is not connected")] } else { lines }
    };
    let all = having(db, project, of, id).into_iter();
    let of_each = grouped(all.map(|(root, flat, instance, name)| (root, (flat, instance, name))));
    let of_each = of_each.into_iter().map(|(root, ends)| (root, each_once(ends.into_iter().flat_map(lines))));
    summary::where_they_differ(db, of_each.collect())
}

/// Returns the topics of ROS 2 of a port, such as `laser.scan publishes /laser/scan: sensor_msgs/msg/LaserScan`.
fn topics(db: &dyn ModelDb, project: Project<'_>, of: Decl<'_>, id: SourceId) -> Vec<String> {
    let line = |(root, _, instance, name): (Decl<'_>, _, &Name, &Name)| {
        // Without deployments, it is an architecture.
        let ros2 = ros2_of(db, project, root);
        let topic = ros2.topic(instance, name)?;
        let verb = if topic.is_published { "publishes" } else { "subscribes to" };
        let reliability = if topic.is_best_effort { "best effort" } else { "reliable" };
        let durability = if topic.is_transient_local { "transient local" } else { "volatile" };
        let host = ros2.hosts.get(topic.host).map(|it| format!(", on host {it}")).unwrap_or_default();
        Some(format!(
            "{instance}.{name} {verb} {}: {}, {reliability}, {durability}, depth {}, at most {} bytes{host}",
            topic.name, topic.ty, topic.depth, topic.max_bytes
        ))
    };
    each_once(having(db, project, of, id).into_iter().filter_map(line))
}

/// Returns the values of a property or constant, such as `laser.rate = 5 in D`.
fn values(db: &dyn ModelDb, project: Project<'_>, of: Decl<'_>, id: SourceId) -> Vec<String> {
    let value = |(root, _, instance, name): (Decl<'_>, _, &Name, &Name)| {
        let known = values_in_effect(db, project, root).get(instance)?;
        let value = known.iter().find(|it| it.name == *name).and_then(|it| it.value.as_ref());
        let value = value.map_or_else(|| "has no value".to_owned(), |value| format!("= {value}"));
        Some(format!("{instance}.{name} {value} in {}", root.name(db)))
    };
    having(db, project, of, id).into_iter().filter_map(value).collect()
}

/// Returns the execution times of `update`, a state or a transition, in each component with the core.
fn programs<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, id: SourceId) -> Vec<String> {
    let Some(data) = core(db, of) else { return Vec::new() };
    let level = level_shown(db, project);
    let declared = data.states().find_map(|state| {
        let name = &state.name.name;
        if state.name.id == id {
            return Some((name.clone(), None));
        }
        let transition = state.transitions.iter().find(|it| it.name.id == id)?;
        Some((name.clone(), Some(transition.name.name.clone())))
    });
    let is_update = data.hooks.iter().any(|hook| hook.id == id && hook.kind == HookKind::Update);
    let Some((state, transition)) = declared.or_else(|| is_update.then(|| ("update".into(), None))) else {
        return Vec::new();
    };
    let is_of_it = |program: &ProgramId| {
        let is_of_state = program.state() == Some(&state);
        let is_of_transition = transition.is_none() || program.transition() == transition.as_ref();
        if is_update { *program == ProgramId::UPDATE } else { is_of_state && is_of_transition }
    };
    let times = |tables: TableSet<'db>, component: Decl<'db>| {
        let psm = match psm_of(db, tables, component, level) {
            Ok(psm) => psm,
            Err(refusals) => {
                let why = refusals.first();
                let why = why.map_or_else(String::new, |first| timing_reason(db, &first.reason));
                return format!(": not analysed: {why}");
            }
        };
        let mut lines = vec![String::new()];
        let executed: FxHashSet<usize> = psm.edges.executed().collect();
        for (index, (program, time)) in psm.programs.iter().enumerate() {
            if is_of_it(program) && executed.contains(&index) && *time > Time::ZERO {
                lines.push(format!("  {:>12}  {program}", time.to_string()));
            }
        }
        let edges = psm.longest_times().zip(&psm.edges.all).filter(|(_, described)| {
            psm.states.get(described.source) == Some(&state)
                && (transition.is_none() || described.transition == transition)
        });
        let longest: Option<Time> = edges.filter_map(|(time, _)| time).max();
        match longest {
            Some(Time::ZERO) => lines.push("  no execution time".to_owned()),
            Some(time) => lines.push(format!("  {:>12}  longest period", time.to_string())),
            None => lines.push("  never executed".to_owned()),
        }
        if !psm.assumed.is_empty() {
            let codels: Vec<&str> = psm.assumed.iter().map(|(codel, _)| codel.as_str()).collect();
            lines.push(format!("  with assumed times: {}", codels.join(", ")));
        }
        lines.join("\n")
    };
    let mut lines = Vec::new();
    for &component in components_of(db, project, of) {
        for (found, of_which) in by_tables(db, project, |tables| times(tables, component)) {
            let text = format!("{} at {level}{of_which}{found}", component.name(db));
            lines.extend(text.lines().map(str::to_owned));
        }
    }
    lines
}
