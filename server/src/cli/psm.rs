//! `mauve psm [PATH] COMPONENT`: a component's periodic state machine with its times.

use std::path::PathBuf;

use clap::ValueEnum;
use mauve_diagnostics::timing_reason;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Project, config_of, names_of, projects, similar};
use mauve_ide::{Drawing, draw_state_machine};
use mauve_timing::Level;
use mauve_wcrt::psm_of;
use serde_json::json;

use super::Outside;
use crate::Output;
use crate::analysis_document::milliseconds;
use crate::load::load;

#[derive(Debug, clap::Args)]
#[command(override_usage = "mauve psm [OPTIONS] [PATH] <COMPONENT>")]
pub(crate) struct Psm {
    /// The component, after the path of its model if that is not in the current folder.
    #[arg(value_name = "[PATH] COMPONENT", num_args = 1..=2, required = true)]
    component: Vec<String>,
    #[command(flatten)]
    outside: Outside,
    /// The significance level of the times; by default that of mauve.toml, else 1e-4.
    #[arg(long, value_name = "LEVEL")]
    significance: Option<f64>,
    /// How to show it.
    #[arg(long, value_enum, default_value = "dot")]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For Graphviz.
    Dot,
    /// For a browser.
    Svg,
    /// States and edges, with the programs of each.
    Json,
}

impl Psm {
    pub(crate) fn run(self) -> Result<Output, String> {
        let (path, name) = match self.component.as_slice() {
            [path, name] => (path.as_str(), name),
            [name] => (".", name),
            _ => return Err("expected a component".to_owned()),
        };
        let mut db = Database::default();
        let workspaces = load(&mut db, &[PathBuf::from(path)], self.outside.allow_outside)?;
        let asked = match self.significance {
            Some(level) => Some(
                Level::from_f64(level).ok_or("the significance is a number between 0 and 1, such as 1e-4")?,
            ),
            None => None,
        };
        let mut known = Vec::new();
        for &workspace in &workspaces {
            let level = asked.unwrap_or_else(|| config_of(&db, workspace).level());
            for &project in projects(&db, workspace) {
                let components = names_of(&db, project).all.iter().copied();
                for component in components.filter(|decl| decl.kind(&db) == Kind::Component) {
                    if component.name(&db) == name.as_str() || component.qualified(&db) == *name {
                        return show(&db, project, component, level, self.format);
                    }
                    known.push(component.name(&db).clone());
                }
            }
        }
        let near = similar(name, &known).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        Err(format!("no component `{name}`{near}"))
    }
}

fn show<'db>(
    db: &'db Database,
    project: Project<'db>,
    component: Decl<'db>,
    level: Level,
    format: Format,
) -> Result<Output, String> {
    let name = component.name(db);
    let psm = match psm_of(db, project, component, level) {
        Ok(psm) => psm,
        Err(refusals) => {
            let reasons: Vec<String> =
                refusals.iter().map(|refusal| timing_reason(db, &refusal.reason)).collect();
            super::say(&format!(
                "no times for the state machine of {name} at {level}: {}",
                reasons.join("; ")
            ));
            return Ok(Output::verbatim("", 1));
        }
    };
    let text = match format {
        Format::Dot => draw_state_machine(name, level, psm, Drawing::Dot),
        Format::Svg => draw_state_machine(name, level, psm, Drawing::Svg),
        Format::Json => {
            let state = |number: u32| psm.states.get(number as usize).map_or("", |name| name.as_str());
            let edges: Vec<_> = psm
                .machine
                .edges()
                .iter()
                .zip(&psm.edges)
                .map(|(edge, described)| {
                    let programs = described.programs.iter().filter_map(|&index| psm.programs.get(index));
                    let programs: Vec<_> = programs
                        .map(|(program, time)| json!({ "program": program.to_string(), "time": milliseconds(*time) }))
                        .collect();
                    json!({
                        "source": state(edge.source),
                        "target": state(edge.target),
                        "transition": described.transition.as_ref().map(|name| name.as_str()),
                        "time": milliseconds(edge.cost),
                        "programs": programs,
                    })
                })
                .collect();
            let states: Vec<&str> = psm.states.iter().map(|name| name.as_str()).collect();
            let component_time = psm.component_time.map(milliseconds);
            crate::json::text(&json!({
                "component": name.as_str(),
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
