//! `mauve graph [PATH]`: the instances and connections of an architecture; for a deployment, with response times and
//! utilisations. By default, those of the only deployment, otherwise of the only architecture.

use std::collections::HashSet;

use mauve_diagnostics::figure::{HintStatus, TIGHT_SLACK};
use mauve_diagnostics::{errors_of, errors_of_text};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Decl, Project, Workspace, target_of};
use mauve_ide::{Drawing, draw_budget, draw_graph, drawn_budget, graph, no_chain};
use mauve_projects::analysis_document::{declared, deployments};
use mauve_projects::graph_document::{budget_document, graph_document};
use mauve_projects::load::Outside;
use mauve_projects::load::load;
use mauve_projects::output::{Output, say};
use mauve_timing::Level;
use mauve_wcrt::Query;

use crate::errors::{missing, say_errors, several_of};
use crate::options::{DrawingFormat, Paths, level};

#[derive(Debug, clap::Args)]
pub struct GraphCommand {
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
    /// Light this chain of the deployment.
    #[arg(long, value_name = "NAME", conflicts_with = "architecture")]
    chain: Option<String>,
    /// Show the CPU budget of the deployment instead: what each instance uses of its CPU, and what remains.
    #[arg(long, conflicts_with_all = ["architecture", "chain"])]
    cpus: bool,
    /// The significance level of the execution times; by default that of mauve.toml, otherwise 1e-4.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    significance: Option<Level>,
    /// How to show it.
    #[arg(long, value_enum, default_value = "text")]
    format: DrawingFormat,
}

impl GraphCommand {
    pub(crate) fn run(self) -> Result<Output, String> {
        let mut db = Database::default();
        let workspaces = load(&mut db, &self.paths.paths, self.outside.allow_outside)?;
        let (project, of) = self.selected(&db, &workspaces)?;
        let query = Query::at_level(&db, project, of, self.significance);
        if self.cpus {
            return self.budget(&db, (project, of, query));
        }
        let found = graph(&db, project, of, query, TIGHT_SLACK);
        let mut graph = found.ok_or_else(|| format!("the architecture of {} is unknown", of.name(&db)))?;
        if let Some(chain) = &self.chain
            && !graph.light(&db, (project, of, query), chain)
        {
            return Err(no_chain(chain, of.name(&db)));
        }
        for missing in &graph.missing {
            say(&format!("incomplete: {missing}"));
        }
        let text = match self.format.drawing() {
            Some(drawing) => draw_graph(&db, &graph, drawing),
            None => mauve_projects::json::text(&graph_document(&db, (project, of), query, &graph))?,
        };
        let errors = errors_of(&db, project);
        say_errors(errors);
        let code = u8::from(errors > 0 || !graph.missing.is_empty());
        Ok(match self.format {
            DrawingFormat::Text => Output::escaped(text, code),
            _ => Output::verbatim(text, code),
        })
    }

    /// The CPU budget of a deployment.
    fn budget<'db>(&self, db: &'db Database, of: (Project<'db>, Decl<'db>, Query)) -> Result<Output, String> {
        if of.1.kind(db) != Kind::Deployment {
            return Err(format!("--cpus needs a deployment, and {} is none", of.1.name(db)));
        }
        let budget = drawn_budget(db, of, TIGHT_SLACK);
        let errors = errors_of(db, of.0);
        say_errors(errors);
        let code = u8::from(errors > 0 || budget.cpus.iter().any(|it| it.status == HintStatus::Missed));
        Ok(match self.format.drawing() {
            Some(Drawing::Dot) => return Err("--cpus has the formats text, svg and json".to_owned()),
            Some(Drawing::Svg) => Output::verbatim(draw_budget(&budget, Drawing::Svg), code),
            Some(text) => Output::escaped(draw_budget(&budget, text), code),
            None => Output::verbatim(mauve_projects::json::text(&budget_document(db, of, &budget))?, code),
        })
    }

    /// Returns the deployment or architecture to show, with the first project that has it.
    fn selected<'db>(
        &self,
        db: &'db Database,
        workspaces: &[Workspace],
    ) -> Result<(Project<'db>, Decl<'db>), String> {
        let (kind, name) = match (self.architecture.as_deref(), self.deployment.as_deref()) {
            (Some(name), _) => (Kind::Architecture, Some(name)),
            (None, None) if deployments(db, workspaces, None)?.is_empty() => (Kind::Architecture, None),
            (None, name) => (Kind::Deployment, name),
        };
        let mut found = declared(db, workspaces, kind, name)?;
        // Several projects may include the same file.
        let mut seen = HashSet::new();
        found.retain(|(_, of)| seen.insert(*of));
        if found.len() > 1 && kind == Kind::Deployment {
            // Deployments whose architecture is unknown have no drawing, so that they are no choice.
            let is_drawn = |&(project, of): &_| target_of(db, project, of).is_some();
            let drawn: Vec<_> = found.iter().copied().filter(is_drawn).collect();
            if drawn.len() == 1 {
                found = drawn;
            }
        }
        match found.as_slice() {
            [one] => Ok(*one),
            [] => {
                let nothing = "no deployment and no architecture in these models".to_owned();
                Err(missing(nothing, errors_of_text(db, workspaces)))
            }
            several => Err(several_of(db, kind, several)),
        }
    }
}
