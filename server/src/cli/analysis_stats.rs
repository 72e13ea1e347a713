//! `mauve analysis-stats [PATH]`: how long the parts of the analysis take, and what an edit costs.

mod edits;

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use super::{Paths, counted};
use crate::Output;
use crate::analysis_document::deployments;
use crate::load::load;
use mauve_diagnostics::{declaration_diagnostics, project_diagnostics, workspace_diagnostics};
use mauve_hir::item_tree::Kind;
use mauve_hir::{
    Database, File, behaviour_of, inference_of_core, item_tree_of, names_of, parse, project_files, projects,
};
use mauve_wcrt::{Query, response_times};

#[derive(Debug, clap::Args)]
pub(crate) struct AnalysisStats {
    #[command(flatten)]
    paths: Paths,
}

impl AnalysisStats {
    pub(crate) fn run(self) -> Result<Output, String> {
        let mut db = Database::default();
        let mut out = String::new();
        let mut line = |what: &str, time: Duration, how_much: String| {
            let _ = writeln!(out, "{what:<16} {:>10.3} ms   {how_much}", time.as_secs_f64() * 1e3);
        };

        let start = Instant::now();
        let workspaces = load(&mut db, &self.paths.paths, false)?;
        line("load", start.elapsed(), counted(workspaces.len(), "workspace"));

        let projects: Vec<_> =
            workspaces.iter().flat_map(|&workspace| projects(&db, workspace)).copied().collect();
        let mut files: Vec<File> =
            projects.iter().flat_map(|&project| project_files(&db, project)).copied().collect();
        files.sort_by_key(|file| file.path(&db).clone());
        files.dedup();
        let bytes: usize = files.iter().map(|file| file.text(&db).len()).sum();
        let lines: usize = files.iter().map(|file| file.text(&db).lines().count()).sum();

        // Loading has parsed for the includes: measured again, on the texts alone.
        let start = Instant::now();
        for file in &files {
            mauve_syntax::parse(file.text(&db));
        }
        let elapsed = start.elapsed();
        let speed = bytes as f64 / 1e6 / elapsed.as_secs_f64().max(1e-9);
        line(
            "parse",
            elapsed,
            format!("{}, {lines} lines, {bytes} bytes, {speed:.0} MB/s", counted(files.len(), "file")),
        );

        let start = Instant::now();
        for &file in &files {
            parse(&db, file);
            item_tree_of(&db, file);
        }
        let declarations: usize = files.iter().map(|&file| item_tree_of(&db, file).declarations.len()).sum();
        line("item trees", start.elapsed(), counted(declarations, "declaration"));

        let start = Instant::now();
        let named: usize = projects.iter().map(|&project| names_of(&db, project).all.len()).sum();
        line("names", start.elapsed(), format!("{named} names in {}", counted(projects.len(), "project")));

        let start = Instant::now();
        let mut edges = 0;
        for &project in &projects {
            for &decl in names_of(&db, project).all.iter().filter(|decl| decl.kind(&db) == Kind::Core) {
                edges += behaviour_of(&db, project, decl).edges.len();
            }
        }
        line("behaviours", start.elapsed(), counted(edges, "edge"));

        let start = Instant::now();
        let mut typed = 0;
        for &project in &projects {
            for &decl in names_of(&db, project).all.iter().filter(|decl| decl.kind(&db) == Kind::Core) {
                inference_of_core(&db, project, decl);
                typed += 1;
            }
        }
        line("types", start.elapsed(), counted(typed, "core"));

        let start = Instant::now();
        let mut analysed = 0;
        for (project, deployment) in deployments(&db, &workspaces, None)? {
            analysed += response_times(&db, project, deployment, Query::shown(&db, project)).activities.len();
        }
        line("response times", start.elapsed(), format!("{analysed} activities"));

        let start = Instant::now();
        let mut wrong = 0;
        for &project in &projects {
            let all = names_of(&db, project).all.iter();
            wrong += all.map(|&decl| declaration_diagnostics(&db, project, decl).len()).sum::<usize>();
        }
        line("checks", start.elapsed(), format!("{wrong} in declarations"));

        let start = Instant::now();
        let found: usize = projects.iter().map(|&project| project_diagnostics(&db, project).len()).sum();
        line("diagnostics", start.elapsed(), format!("{found} in projects"));

        let start = Instant::now();
        let shown: usize =
            workspaces.iter().map(|&workspace| workspace_diagnostics(&db, workspace).len()).sum();
        line("places", start.elapsed(), format!("{shown} shown"));
        if let Some(resident) = resident_kilobytes() {
            let _ = writeln!(out, "{:<16} {:>10.1} MB", "memory", resident as f64 / 1e3);
        }
        drop(db);
        let _ = write!(out, "\n{}", edits::table(&self.paths.paths)?);
        Ok(Output::escaped(out, 0))
    }
}

/// The memory of this process, where the system says.
fn resident_kilobytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}
