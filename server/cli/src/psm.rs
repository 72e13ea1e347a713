//! `mauve psm [PATH] [COMPONENT]`: the periodic state machine of a component with its execution times, or the list of the
//! components.

use std::path::{Path, PathBuf};

use mauve_diagnostics::{errors_of_text, times_of, timing_reason};
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Database, Decl, Host, Project, hosts_of, names_of, projects, similar};
use mauve_ide::{MachineTitle, draw_state_machine, state_machine};
use mauve_projects::analysis_document::{deployments, deployments_of, milliseconds};
use mauve_projects::load::Outside;
use mauve_projects::load::load;
use mauve_projects::output::{Output, say};
use mauve_timing::{Level, Time};
use mauve_wcrt::{
    Query, Refusal, TableSet, first_tables, level_shown, psm_of, system_of, tables_for, tables_in, tables_of,
    tables_of_host,
};
use serde_json::{Value, json};

use crate::errors::{host_called, missing, names_in, say_errors};
use crate::options::{DrawingFormat, level};
use crate::text::{columns, wrapped};

#[derive(Debug, clap::Args)]
#[command(override_usage = "mauve psm [OPTIONS] [PATH] [COMPONENT]")]
pub struct PsmCommand {
    /// A model, a folder or a mauve.toml (by default the current folder), then the component. Without a component, draws
    /// the only one, or lists them.
    #[arg(value_name = "[PATH] COMPONENT", num_args = 0..=2)]
    component: Vec<String>,
    #[command(flatten)]
    outside: Outside,
    /// The deployment whose times are shown, if it has its own timing tables.
    #[arg(long, value_name = "NAME")]
    deployment: Option<String>,
    /// The host of the deployment whose times are shown, if it has its own timing tables.
    #[arg(long, value_name = "NAME", requires = "deployment")]
    host: Option<String>,
    /// The significance level of the times; by default that of mauve.toml, otherwise 1e-4.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    significance: Option<Level>,
    /// How to show it.
    #[arg(long, value_enum, default_value = "dot")]
    format: DrawingFormat,
}

/// A component, with the timing tables and the level of its times.
type FoundMachine<'db> = (TableSet<'db>, Decl<'db>, Level);

impl PsmCommand {
    pub(crate) fn run(self) -> Result<Output, String> {
        let (path, name) = match self.component.as_slice() {
            [] => (".", None),
            [path] if Path::new(path).exists() => (path.as_str(), None),
            [name] => (".", Some(name)),
            [path, name, ..] => (path.as_str(), Some(name)),
        };
        let mut db = Database::default();
        let workspaces = load(&mut db, &[PathBuf::from(path)], self.outside.allow_outside)?;
        let only = self.deployment.as_deref();
        let of_deployments = match only {
            Some(_) => deployments(&db, &workspaces, only)?,
            None => Vec::new(),
        };
        let mut found: Vec<FoundMachine<'_>> = Vec::new();
        for &workspace in &workspaces {
            for &project in projects(&db, workspace) {
                let of = of_deployments.iter().filter(|(having, _)| *having == project);
                let mut of = of.map(|&(_, deployment)| deployment);
                // None for the tables of the deployments that execute a component.
                let chosen = of.next();
                if let Some(name) = only {
                    let Some(first) = chosen else { continue };
                    if of.any(|it| tables_of(&db, project, it) != tables_of(&db, project, first)) {
                        return Err(format!(
                            "several deployments `{name}` have different timing tables: write the library before the name"
                        ));
                    }
                }
                let level = self.significance.unwrap_or_else(|| match chosen {
                    Some(deployment) => Query::shown(&db, project, deployment).level,
                    None => level_shown(&db, project),
                });
                let host = match (chosen, self.host.as_deref()) {
                    (Some(deployment), Some(name)) => host_called(&db, (project, deployment), Some(name))?,
                    _ => None,
                };
                for component in names_of(&db, project).of_kind(&db, Kind::Component) {
                    // A file that several projects include is listed once.
                    if found.iter().any(|(_, known, _)| *known == component) {
                        continue;
                    }
                    let tables = match (chosen, host) {
                        (Some(of), Some(_)) => Some(tables_of_host(&db, project, of, host)),
                        (Some(of), None) => tables_in(&db, project, of, component).into_iter().next(),
                        (None, _) => None,
                    };
                    let tables = tables.unwrap_or_else(|| first_tables(&db, project, component));
                    found.push((tables, component, level));
                }
            }
        }
        let errors = errors_of_text(&db, &workspaces);
        if let Some(name) = name {
            let known: Vec<Name> =
                found.iter().map(|(_, component, _)| component.name(&db).clone()).collect();
            found.retain(|(_, component, _)| component.is_called(&db, name));
            if found.is_empty() {
                let near = similar(name, &known)
                    .map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
                return Err(missing(format!("no component `{name}`{near}"), errors));
            }
            if found.len() > 1 {
                let names = names_in(&db, &declared(&db, &found)).join(", ");
                return Err(format!(
                    "several components are called `{name}`: choose one with its library and the path of its project: {names}"
                ));
            }
        }
        if found.is_empty() {
            return Err(missing(format!("no components in `{path}`"), errors));
        }
        say_errors(errors);
        for &(tables, component, _) in &found {
            note_other_tables(&db, tables, component);
        }
        match found.as_slice() {
            &[(tables, component, level)] => show(&db, tables, component, level, self.format),
            several => list(&db, several, self.format),
        }
    }
}

fn declared<'db>(db: &'db Database, found: &[FoundMachine<'db>]) -> Vec<(Project<'db>, Decl<'db>)> {
    found.iter().map(|&(tables, component, _)| (tables.project(db), component)).collect()
}

/// Says on standard error that deployments have other times of a component than those that are shown.
fn note_other_tables<'db>(db: &'db Database, shown: TableSet<'db>, component: Decl<'db>) {
    let project = shown.project(db);
    let sets = tables_for(db, project, component);
    let hosts = &hosts_of(db, project.workspace(db)).all;
    let mut others: Vec<(String, String)> = Vec::new();
    for deployment in deployments_of(db, project) {
        let name = deployment.qualified(db);
        let mut known = vec![shown];
        let activities = system_of(db, project, deployment).activities.iter();
        for activity in activities.filter(|it| it.component == Some(component) && sets.contains(&it.tables)) {
            if known.contains(&activity.tables) {
                continue;
            }
            known.push(activity.tables);
            let other = match activity.host.and_then(|it| hosts.get(it)) {
                Some(Host { name: host, .. }) => {
                    (format!("{name} on host {host}"), format!("--deployment {name} --host {host}"))
                }
                None => (name.clone(), format!("--deployment {name}")),
            };
            others.push(other);
        }
    }
    if let Some((_, option)) = others.first() {
        let names: Vec<&str> = others.iter().map(|(name, _)| name.as_str()).collect();
        let (of, others) = (component.name(db), names.join(", "));
        say(&format!("`{of}` has other timing tables in {others}: `{option}` shows them"));
    }
}

/// Returns a table of the components with the size of their state machines and the greatest execution time of a period.
fn list<'db>(
    db: &'db Database,
    found: &[FoundMachine<'db>],
    format: DrawingFormat,
) -> Result<Output, String> {
    let mut rows = Vec::new();
    let mut documents = Vec::new();
    let mut notes = String::new();
    for (&(tables, component, level), in_project) in found.iter().zip(names_in(db, &declared(db, found))) {
        let same = found.iter().filter(|(_, other, _)| other.name(db) == component.name(db)).count();
        let (name, shown) = match same {
            1 => (component.name(db).to_string(), component.name(db).to_string()),
            _ => (component.qualified(db), in_project),
        };
        let times = tables.label(db);
        match psm_of(db, tables, component, level) {
            Ok(psm) => {
                let time = psm.machine.edges().iter().map(|edge| edge.cost).max().unwrap_or(Time::ZERO);
                let (states, edges) = (psm.states.len(), psm.edges.all.len());
                let name_with_times = format!("{shown}{}", times_of(times.as_deref()));
                rows.push(vec![name_with_times, states.to_string(), edges.to_string(), time.number()]);
                documents.push(json!({
                    "component": name, "times": times, "states": states, "edges": edges, "time": milliseconds(time),
                }));
            }
            Err(refusals) => {
                let unknown = ["—"; 3].map(str::to_owned);
                notes += &format!("  {shown}: {}\n", reasons(db, refusals));
                rows.push(std::iter::once(shown).chain(unknown).collect());
                documents.push(json!({ "component": name, "reasons": reasons(db, refusals) }));
            }
        }
    }
    if format == DrawingFormat::Json {
        return Ok(Output::verbatim(
            mauve_projects::json::text(&json!({ "unit": "ms", "components": documents }))?,
            0,
        ));
    }
    let header = ["component", "states", "edges", "execution time in ms"];
    let table = columns(&header, rows);
    Ok(Output::escaped(wrapped(&format!("{table}{notes}")), 0))
}

fn reasons(db: &Database, refusals: &[Refusal<'_>]) -> String {
    let all: Vec<String> = refusals.iter().map(|refusal| timing_reason(db, &refusal.reason)).collect();
    all.join("; ")
}

fn show<'db>(
    db: &'db Database,
    tables: TableSet<'db>,
    component: Decl<'db>,
    level: Level,
    format: DrawingFormat,
) -> Result<Output, String> {
    let name = component.name(db);
    let times = tables.label(db);
    let psm = match psm_of(db, tables, component, level) {
        Ok(psm) => psm,
        Err(refusals) => {
            say(&format!("no times for the state machine of {name} at {level}: {}", reasons(db, refusals)));
            return Ok(Output::verbatim("", 1));
        }
    };
    let text = match format.drawing() {
        Some(drawing) => {
            let view = state_machine(db, tables, component, level);
            let title = MachineTitle { component: name, level, times: times.as_deref() };
            draw_state_machine(db, tables.project(db).workspace(db), title, &view, drawing)
        }
        None => {
            let programs = |indices: &[usize]| -> Vec<Value> {
                let timed = indices.iter().filter_map(|&index| psm.programs.get(index));
                timed
                    .map(|(program, time)| json!({ "program": program.to_string(), "time": milliseconds(*time) }))
                    .collect()
            };
            let states = psm.states.iter().zip(&psm.edges.first);
            let states: Vec<Value> = states
                .map(|(name, first)| json!({ "state": name.as_str(), "first": programs(first) }))
                .collect();
            let edge = |(longest, described): (Option<usize>, &mauve_hir::PeriodEdge)| {
                let edge = longest.and_then(|index| psm.machine.edges().get(index));
                let mut document = json!({
                    "source": psm.state(described.source),
                    "target": psm.state(described.target),
                    "transition": described.transition.as_ref().map(|name| name.as_str()),
                    "time": edge.map(|edge| milliseconds(edge.cost)),
                    "first": described.first,
                    "then": programs(&described.then),
                });
                // What of `time` its codels wait, if they do.
                if let Some(wait) = longest.and_then(|it| psm.wait_of(it)).filter(|wait| *wait > Time::ZERO)
                    && let Some(fields) = document.as_object_mut()
                {
                    fields.insert("wait".to_owned(), milliseconds(wait));
                }
                document
            };
            let edges = psm.longest_edges().into_iter().zip(&psm.edges.all);
            let edges: Vec<Value> = edges.map(edge).collect();
            let component_time = psm.component_time.map(milliseconds);
            mauve_projects::json::text(&json!({
                "component": name.as_str(),
                "times": times,
                "unit": "ms",
                "significance": level.as_f64(),
                "states": states,
                "initial": psm.states.get(psm.initial).map(|name| name.as_str()),
                "edges": edges,
                "whole": component_time,
                "assumed": psm.assumed.iter().map(|(codel, _)| codel).collect::<Vec<_>>(),
            }))?
        }
    };
    Ok(Output::verbatim(text, 0))
}
