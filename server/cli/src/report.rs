//! `mauve report [PATH]`: one page for a review or for the artefacts of a CI job. It is one HTML file without scripts; the same models
//! give the same bytes.
//!
//! | file | content |
//! |---|---|
//! | `report/page.rs` | the page: the verdict, what to do next, what changed, a section for each deployment |
//! | `report/deployment.rs` | a section: drawings, response times and their parts, chains, execution times, conditions |
//! | `report/rows.rs` | activities with their figures, tables and lists, for both |
//! | `report/report.css` | what it adds to the styles of all pages |

mod deployment;
mod page;
mod rows;

use std::path::PathBuf;

use mauve_diagnostics::{errors_of_text, workspace_findings};
use mauve_hir::Database;
use mauve_ide::Comparison;
use mauve_projects::analysis_document::{Deployed, deployments};
use mauve_projects::load::Outside;
use mauve_projects::load::load;
use mauve_projects::output::{Output, say};
use mauve_projects::replace::put;
use mauve_timing::Level;
use mauve_wcrt::Query;

use self::page::Page;
use super::check::verdict::{deadlines, is_proof_missing};
use super::diff::Diff;
use super::own_output::check_own;
use crate::errors::{nothing_to, say_errors};
use crate::options::level;

#[derive(Debug, clap::Args)]
pub struct ReportCommand {
    /// A model, a folder or a mauve.toml.
    #[arg(value_name = "PATH", default_value = ".", value_hint = clap::ValueHint::AnyPath)]
    path: PathBuf,
    #[command(flatten)]
    outside: Outside,
    /// The file that gets the page, which may replace an earlier one; standard output when left out.
    #[arg(short, long, value_name = "FILE.html", value_hint = clap::ValueHint::FilePath)]
    output: Option<PathBuf>,
    /// Also show what changed since this state: a revision of git or a path, as for `mauve diff`.
    #[arg(long, value_name = "REV|PATH")]
    since: Option<String>,
    /// Only this deployment.
    #[arg(long, value_name = "NAME")]
    deployment: Option<String>,
    /// The significance level of the execution times; by default that of mauve.toml, otherwise 1e-4.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    significance: Option<Level>,
}

impl ReportCommand {
    pub(crate) fn run(self) -> Result<Output, String> {
        if let Some(path) = &self.output {
            check_own(path, "<!doctype", "report", "--output")?;
        }
        let mut db = Database::default();
        let workspaces = load(&mut db, std::slice::from_ref(&self.path), self.outside.allow_outside)?;
        let errors = errors_of_text(&db, &workspaces);
        let found = deployments(&db, &workspaces, self.deployment.as_deref())?;
        if found.is_empty() {
            return Err(nothing_to("report", errors));
        }
        let deployed = found.into_iter().map(|(project, of)| {
            let query = Query::at_level(&db, project, of, self.significance);
            Deployed::of_model(&db, project, of, std::iter::once(query))
        });
        let deployed: Vec<Deployed<'_>> = deployed.collect();
        let (mut findings, mut suppressed) = (Vec::new(), Vec::new());
        for &workspace in &workspaces {
            let of = workspace_findings(&db, workspace);
            findings.extend(of.shown);
            suppressed.extend(of.suppressed);
        }
        let changes = self.since.as_ref().map(|since| {
            let path = self.path.display().to_string();
            let outside = Outside { allow_outside: self.outside.allow_outside };
            Diff::since(since, path, outside, self.deployment.clone(), self.significance).compared()
        });
        let page = Page {
            db: &db,
            path: self.path.canonicalize().unwrap_or_else(|_| self.path.clone()),
            deployed: &deployed,
            findings: &findings,
            verdict: deadlines(&deployed, &suppressed),
            changes: changes.transpose()?,
        };
        let (text, said) = (page.html(), page.verdict);
        say_errors(errors);
        let is_unread = page.changes.iter().flat_map(|(all, _)| all).any(Comparison::is_unread);
        let code = if is_unread { 2 } else { u8::from(errors > 0 || is_proof_missing(&deployed)) };
        match &self.output {
            None => Ok(Output::verbatim(text, code)),
            Some(path) => {
                put(path, &text)?;
                say(&format!("`{}` has the report: {said}", path.display()));
                Ok(Output::verbatim("", code))
            }
        }
    }
}
