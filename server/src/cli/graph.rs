//! `mauve graph [PATH]`: the instances and connections of an architecture; for a deployment, with response times and
//! utilisations. By default, those of the only deployment, otherwise of the only architecture.

use clap::ValueEnum;
use mauve_diagnostics::errors_of;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Project, Workspace, names_of, projects, target_of};
use mauve_ide::{Drawing, draw_graph, graph};
use mauve_wcrt::Query;

use super::wcrt::say_errors;
use crate::cli::options::{Outside, Paths, level};
use crate::graph_document::graph_document;
use crate::load::load;
use crate::output::{Output, say};

#[derive(Debug, clap::Args)]
pub(crate) struct Graph {
    #[command(flatten)]
    paths: Paths,
    #[command(flatten)]
    outside: Outside,
    /// Show this architecture, without times.
    #[arg(long, value_name = "NAME", conflicts_with = "deployment")]
    architecture: Option<String>,
    /// Show this deployment, with its response times.
    #[arg(long, value_name = "NAME")]
    deployment: Option<String>,
    /// The significance level of the execution times; by default that of mauve.toml, otherwise 1e-4.
    #[arg(long, value_name = "LEVEL")]
    significance: Option<f64>,
    /// How to show it.
    #[arg(long, value_enum, default_value = "text")]
    format: GraphFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum GraphFormat {
    /// A drawing for terminals.
    Text,
    /// A drawing for browsers.
    Svg,
    /// A drawing for Graphviz.
    Dot,
    /// The instances and connections.
    Json,
}

impl Graph {
    pub(crate) fn run(self) -> Result<Output, String> {
        let level = level(self.significance)?;
        let mut db = Database::default();
        let workspaces = load(&mut db, &self.paths.paths, self.outside.allow_outside)?;
        let (project, of) = self.selected(&db, &workspaces)?;
        let shown = Query::shown(&db, project);
        let query = Query { level: level.unwrap_or(shown.level), ..shown };
        let found = graph(&db, project, of, query);
        let graph = found.ok_or_else(|| format!("the architecture of {} is unknown", of.name(&db)))?;
        for missing in &graph.missing {
            say(&format!("incomplete: {missing}"));
        }
        let text = match self.format {
            GraphFormat::Text => draw_graph(&graph, Drawing::Text),
            GraphFormat::Svg => draw_graph(&graph, Drawing::Svg),
            GraphFormat::Dot => draw_graph(&graph, Drawing::Dot),
            GraphFormat::Json => crate::json::text(&graph_document(&db, (project, of), query, &graph))?,
        };
        let errors = errors_of(&db, project);
        say_errors(errors);
        let code = u8::from(errors > 0 || !graph.missing.is_empty());
        Ok(match self.format {
            GraphFormat::Text => Output::escaped(text, code),
            _ => Output::verbatim(text, code),
        })
    }

    /// Returns the deployment or architecture to show, with the first project that has it.
    fn selected<'db>(
        &self,
        db: &'db Database,
        workspaces: &[Workspace],
    ) -> Result<(Project<'db>, Decl<'db>), String> {
        let mut all: Vec<(Project<'db>, Decl<'db>)> = Vec::new();
        for &workspace in workspaces {
            for &project in projects(db, workspace) {
                for &of in names_of(db, project).all.iter() {
                    let is_graph = matches!(of.kind(db), Kind::Deployment | Kind::Architecture);
                    // Several projects may include the same file.
                    if is_graph && !all.iter().any(|(_, known)| *known == of) {
                        all.push((project, of));
                    }
                }
            }
        }
        let of_kind = |kind: Kind| all.iter().copied().filter(move |(_, of)| of.kind(db) == kind);
        let (kind, word, name) = match (&self.architecture, &self.deployment) {
            (Some(name), _) => (Kind::Architecture, "architecture", Some(name)),
            (None, Some(name)) => (Kind::Deployment, "deployment", Some(name)),
            (None, None) if of_kind(Kind::Deployment).next().is_some() => {
                (Kind::Deployment, "deployment", None)
            }
            (None, None) => (Kind::Architecture, "architecture", None),
        };
        let is_named = |(_, of): &(Project<'db>, Decl<'db>)| {
            name.is_none_or(|name| *of.name(db) == *name.as_str() || of.qualified(db) == *name)
        };
        let known: Vec<String> = of_kind(kind).map(|(_, of)| of.qualified(db)).collect();
        let found: Vec<(Project<'db>, Decl<'db>)> = of_kind(kind).filter(is_named).collect();
        match (found.as_slice(), name) {
            ([one], _) => Ok(*one),
            ([], None) => Err("no deployment and no architecture in these models".to_owned()),
            ([], Some(name)) if known.is_empty() => {
                Err(format!("no {word} `{name}`: these models have none"))
            }
            ([], Some(name)) => Err(format!("no {word} `{name}`: there is {}", known.join(", "))),
            (several, _) => {
                // Deployments whose architecture is unknown have no drawing, so that they are no choice.
                let drawn: Vec<(Project<'db>, Decl<'db>)> = (several.iter().copied())
                    .filter(|&(project, of)| {
                        kind == Kind::Architecture || target_of(db, project, of).is_some()
                    })
                    .collect();
                match drawn.as_slice() {
                    [one] => Ok(*one),
                    _ => Err(format!("several {word}s: choose one with --{word}: {}", known.join(", "))),
                }
            }
        }
    }
}
