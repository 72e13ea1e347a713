//! `mauve analysis-stats [PATH]`: measures the stages of the analysis.

use std::fmt::Write as _;
use std::time::Instant;

use crate::options::Paths;
use crate::text::counted;
use mauve_diagnostics::{declaration_diagnostics, project_diagnostics, workspace_diagnostics};
use mauve_hir::item_tree::Kind;
use mauve_hir::{
    Database, File, Project, Workspace, behaviour_of, inference_of_core, item_tree_of, names_of, parse,
    project_files, projects,
};
use mauve_projects::load::load;
use mauve_projects::memory::resident;
use mauve_projects::output::Output;
use mauve_wcrt::{Query, response_times};

#[derive(Debug, clap::Args)]
pub struct AnalysisStats {
    #[command(flatten)]
    paths: Paths,
}

impl AnalysisStats {
    pub(crate) fn run(self) -> Result<Output, String> {
        let paths = &self.paths.paths;
        let mut db = Database::default();
        let start = Instant::now();
        let workspaces = load(&mut db, paths, false)?;
        let mut out = line("load", start, &counted(workspaces.len(), "workspace"));
        out += &stages(&db, &workspaces);
        if let Some(bytes) = resident() {
            let _ = writeln!(out, "{:<16} {:>10.1} MB", "memory", bytes as f64 / 1e6);
        }
        Ok(Output::escaped(out, 0))
    }
}

fn line(stage: &str, start: Instant, result: &str) -> String {
    format!("{stage:<16} {:>10.3} ms   {result}\n", start.elapsed().as_secs_f64() * 1e3)
}

/// Runs the stages of the analysis one after the other, and returns a line for each.
fn stages(db: &Database, workspaces: &[Workspace]) -> String {
    let projects: Vec<Project<'_>> =
        workspaces.iter().flat_map(|&workspace| projects(db, workspace)).copied().collect();
    let mut files: Vec<File> =
        projects.iter().flat_map(|&project| project_files(db, project)).copied().collect();
    files.sort_by_key(|file| file.path(db).clone());
    files.dedup();
    let names = || projects.iter().flat_map(|&it| names_of(db, it).all.iter().map(move |&decl| (it, decl)));
    let of_kind = |kind| names().filter(move |(_, decl)| decl.kind(db) == kind);
    let measured = |stage: &str, run: &dyn Fn() -> String| {
        let start = Instant::now();
        let result = run();
        line(stage, start, &result)
    };
    [
        // Loading has parsed for the includes: the texts alone are parsed again.
        measured("parse", &|| {
            let start = Instant::now();
            for file in &files {
                mauve_syntax::parse(file.text(db));
            }
            let seconds = start.elapsed().as_secs_f64();
            let bytes: usize = files.iter().map(|file| file.text(db).len()).sum();
            let lines: usize = files.iter().map(|file| file.text(db).lines().count()).sum();
            let speed = bytes as f64 / 1e6 / seconds.max(1e-9);
            format!("{}, {lines} lines, {bytes} bytes, {speed:.0} MB/s", counted(files.len(), "file"))
        }),
        measured("item trees", &|| {
            files.iter().for_each(|&file| _ = parse(db, file));
            let declarations = files.iter().map(|&file| item_tree_of(db, file).data.len());
            counted(declarations.sum(), "declaration")
        }),
        measured("names", &|| format!("{} names in {}", names().count(), counted(projects.len(), "project"))),
        measured("behaviours", &|| {
            let edges = of_kind(Kind::Core).map(|(it, core)| behaviour_of(db, it, core).edges.all.len());
            counted(edges.sum(), "edge")
        }),
        measured("types", &|| {
            of_kind(Kind::Core).for_each(|(it, core)| _ = inference_of_core(db, it, core));
            counted(of_kind(Kind::Core).count(), "core")
        }),
        measured("response times", &|| {
            let reports = of_kind(Kind::Deployment)
                .map(|(it, deployment)| response_times(db, it, deployment, Query::shown(db, it, deployment)));
            format!("{} activities", reports.map(|it| it.activities.len()).sum::<usize>())
        }),
        measured("checks", &|| {
            let found = names().map(|(it, decl)| declaration_diagnostics(db, it, decl).len());
            format!("{} in declarations", found.sum::<usize>())
        }),
        measured("diagnostics", &|| {
            let found = projects.iter().map(|&it| project_diagnostics(db, it).count());
            format!("{} in projects", found.sum::<usize>())
        }),
        measured("places", &|| {
            let found = workspaces.iter().map(|&it| workspace_diagnostics(db, it).len());
            format!("{} shown", found.sum::<usize>())
        }),
    ]
    .concat()
}
