//! `mauve generate [PATH] --out DIR`: generates Orocos packages. Writes only files that change, and no files of the
//! user.

mod report;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use annotate_snippets::{AnnotationKind, Level};
use clap::ValueEnum;
use mauve_diagnostics::{Finding, Severity, workspace_diagnostics};
use mauve_hir::{Database, Decl, Location, Project, Workspace, projects, ros2_of};
use mauve_orocos::{GenerationProblem, configuration_problems};
use mauve_projects::analysis_document::{Deployed, Proved, deployments};
use mauve_projects::generate::{
    GenerateRefusal, GenerateRequest, Generated, Out, Selected, configured_out, generate, problem_message,
    read,
};
use mauve_projects::harmless::harmless;
use mauve_projects::json::{self, object};
use mauve_projects::load::Outside;
use mauve_projects::load::load;
use mauve_projects::output::{Output, say};
use mauve_wcrt::Query;

use super::check::{excerpt, excerpts, located, with_excerpts};
use crate::lines::Lines;
use crate::text::counted;
use report::{Doing, document, report};

#[derive(Debug, clap::Args)]
pub struct GenerateCommand {
    /// A model, a folder or a mauve.toml; the current folder when left out.
    #[arg(default_value = ".", hide_default_value = true)]
    path: PathBuf,
    #[command(flatten)]
    outside: Outside,
    /// Generate only the packages that this deployment needs.
    #[arg(long, value_name = "NAME")]
    deployment: Option<String>,
    /// The folder of the packages; by default `[generate] out` of mauve.toml.
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    out: Option<PathBuf>,
    /// Generate packages for Orocos: the default.
    #[arg(long)]
    orocos: bool,
    /// Generate a package of ROS 2 into this folder, for colcon: the programs of the deployments with their topics, and launch files.
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath, conflicts_with_all = ["orocos", "out", "standalone"])]
    ros2: Option<PathBuf>,
    /// Also generate `standalone` in the folder: programs of the deployments that need no Orocos, with their runtime.
    #[arg(long)]
    standalone: bool,
    /// Write nothing: list the files that are out of date, and exit with 1 if there are any.
    #[arg(long, conflicts_with = "force")]
    check: bool,
    /// Overwrite generated files that were edited. The files of codels are never overwritten.
    #[arg(long)]
    force: bool,
    /// The output format.
    #[arg(long, value_enum, default_value = "human")]
    format: GenerateFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum GenerateFormat {
    /// Text for people.
    Human,
    /// One JSON document.
    Json,
}

impl GenerateCommand {
    pub(crate) fn run(self) -> Result<Output, String> {
        let mut db = Database::default();
        let workspaces = load(&mut db, std::slice::from_ref(&self.path), self.outside.allow_outside)?;
        let without_project = workspaces.iter().filter(|it| projects(&db, **it).is_empty());
        let problems: Vec<_> = without_project.flat_map(|it| configuration_problems(&db, *it)).collect();
        if !problems.is_empty() {
            return self.refused(&db, &workspaces, &problems);
        }
        let request = self.request(&db, &workspaces)?;
        self.check_topics(&db, &workspaces, &request)?;
        let folders = match generate(&db, &request, &read) {
            Ok(folders) => folders,
            Err(GenerateRefusal::Problems(problems)) => return self.refused(&db, &workspaces, &problems),
            Err(GenerateRefusal::Other(why)) => return Err(why),
        };
        let selected = request.selected.iter().map(|it| (it.project, it.deployment));
        warn_of_deadlines(&db, &workspaces, &selected.collect::<Vec<_>>())?;
        let is_refused = !self.force && folders.iter().any(|it| !it.plan.edited.is_empty());
        let is_written = !self.check && !is_refused;
        if is_written {
            for (number, Generated { site, plan, .. }) in folders.iter().enumerate() {
                let written = site.iter().try_for_each(|site| site.write(&plan.steps));
                // Each folder is written as a whole, and one after the other.
                let before = folders.iter().take(number).map(|it| format!("`{}`", it.out.shown.display()));
                let before: Vec<String> = before.collect();
                written.map_err(|error| match before.is_empty() {
                    true => error,
                    false => {
                        format!("{error} there; these packages are already written: {}", before.join(" and "))
                    }
                })?;
            }
        }
        let doing = match (self.check, is_refused) {
            (true, _) => Doing::Checked,
            (_, true) => Doing::Refused,
            _ => Doing::Done,
        };
        let text = match self.format {
            GenerateFormat::Human => folders.iter().map(|it| harmless(&report(it, doing))).collect(),
            GenerateFormat::Json => {
                let folders: Vec<_> = folders.iter().map(document).collect();
                json::text(&object! { problems: [(); 0], folders: folders, written: is_written })?
            }
        };
        let is_stale = self.check && folders.iter().any(|it| !it.plan.is_settled());
        Ok(Output::verbatim(text, u8::from(is_refused || is_stale)))
    }

    /// Refuses a package of ROS 2 without topics.
    fn check_topics(
        &self,
        db: &Database,
        workspaces: &[Workspace],
        request: &GenerateRequest<'_>,
    ) -> Result<(), String> {
        let all = deployments(db, workspaces, self.deployment.as_deref())?;
        let is_selected = |project| request.selected.iter().any(|it| it.project == project);
        let mut all = all.into_iter().filter(|(project, _)| is_selected(*project));
        match self.ros2.is_none() || all.any(|(project, of)| !ros2_of(db, project, of).topics.is_empty()) {
            true => Ok(()),
            false => Err("no deployment has topics: write `[ros2]` with a `gateway` into mauve.toml, and leave a port whose type is a \
                          message without a connection, or name it in `topics`"
                .to_owned()),
        }
    }

    fn request<'db>(
        &self,
        db: &'db Database,
        workspaces: &[Workspace],
    ) -> Result<GenerateRequest<'db>, String> {
        let asked: Vec<(Project<'_>, Option<Decl<'_>>)> = match &self.deployment {
            Some(name) => {
                let found = deployments(db, workspaces, Some(name))?;
                found.into_iter().map(|(project, deployment)| (project, Some(deployment))).collect()
            }
            None => {
                let all = workspaces.iter().flat_map(|&workspace| projects(db, workspace));
                all.map(|&project| (project, None)).collect()
            }
        };
        let select = |(project, deployment): (Project<'db>, Option<Decl<'db>>)| {
            Selected::new(db, project, deployment, self.out(db, project.workspace(db)))
        };
        Ok(GenerateRequest {
            selected: asked.into_iter().map(select).collect(),
            is_whole: self.deployment.is_none()
                && workspaces.iter().all(|workspace| workspace.only(db).is_empty()),
            is_standalone: self.standalone,
            is_ros2: self.ros2.is_some(),
            is_written: !self.check,
        })
    }

    fn out(&self, db: &Database, workspace: Workspace) -> Result<Out, String> {
        match self.ros2.as_ref().or(self.out.as_ref()) {
            Some(out) if out.as_os_str().is_empty() => {
                Err("--out and --ros2 take the path of a folder".to_owned())
            }
            Some(out) => Out::named(out),
            None => configured_out(db, workspace)?.ok_or_else(|| {
                "no output folder: use `--out DIR`, or write `[generate] out = \"generated\"` in mauve.toml, \
                 relative to its folder"
                    .to_owned()
            }),
        }
    }

    fn refused(
        &self,
        db: &Database,
        workspaces: &[Workspace],
        problems: &[GenerationProblem<'_>],
    ) -> Result<Output, String> {
        let text = match self.format {
            GenerateFormat::Human => refusal_text(db, workspaces, problems),
            GenerateFormat::Json => {
                let lines = Lines { width: |text| text.chars().count() };
                let problems =
                    problems.iter().map(|it| located(db, &lines, &it.at, &problem_message(&it.kind)));
                let problems: Vec<_> = problems.collect();
                json::text(&object! { problems: problems, folders: [(); 0], written: false })?
            }
        };
        Ok(Output::verbatim(text, 1))
    }
}

/// Renders the problems that prevent generation.
pub(super) fn refusal_text(
    db: &Database,
    workspaces: &[Workspace],
    problems: &[GenerationProblem<'_>],
) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    let findings: Vec<Finding<'_>> =
        workspaces.iter().flat_map(|&workspace| workspace_diagnostics(db, workspace)).collect();
    let findings: HashMap<(&Location<'_>, &str), &Finding<'_>> =
        findings.iter().rev().map(|it| ((&it.diagnostic.at, it.diagnostic.message.as_str()), it)).collect();
    let mut parts = excerpts(problems, |it| problem_excerpt(db, &here, it, &findings));
    let errors = counted(problems.len(), "error");
    parts.push(format!("fix {errors} first: nothing was generated\n"));
    parts.join("\n")
}

/// Renders a problem as `mauve check` renders a diagnostic.
fn problem_excerpt(
    db: &Database,
    here: &Path,
    problem: &GenerationProblem<'_>,
    findings: &HashMap<(&Location<'_>, &str), &Finding<'_>>,
) -> String {
    let message = problem_message(&problem.kind);
    match findings.get(&(&problem.at, message.as_str())) {
        Some(finding) => {
            let diagnostic = finding.diagnostic.clone();
            excerpt(db, here, &Finding { diagnostic, severity: Severity::Error, only_in: finding.only_in })
        }
        None => {
            let title = Level::ERROR.primary_title(harmless(&message));
            with_excerpts(db, here, title, &[(&problem.at, "", AnnotationKind::Primary)], Vec::new())
        }
    }
}

/// Warns on standard error about deadlines that are not proved. The packages are generated nevertheless.
pub(super) fn warn_of_deadlines(
    db: &Database,
    workspaces: &[Workspace],
    selected: &[(Project<'_>, Option<Decl<'_>>)],
) -> Result<(), String> {
    for (project, deployment) in deployments(db, workspaces, None)? {
        let is_selected = |&(of, only): &(Project<'_>, Option<Decl<'_>>)| {
            of == project && only.is_none_or(|selected| selected == deployment)
        };
        if !selected.iter().any(is_selected) {
            continue;
        }
        let query = Query::shown(db, project, deployment);
        let deployed = Deployed::of_model(db, project, deployment, std::iter::once(query));
        if !deployed.schedulable() {
            let accepted = match deployed.accepted_count() {
                0 => String::new(),
                count => format!(" ({count} accepted)"),
            };
            let Proved { proved, all, .. } = Proved::of(&[deployed]);
            let name = deployment.qualified(db);
            say(&format!(
                "warning: {} not proved{accepted} (`mauve wcrt` shows why)",
                match (all - proved, all) {
                    (_, 1) => format!("the deadline of {name} is"),
                    (1, all) => format!("1 of the {all} deadlines of {name} is"),
                    (open, all) => format!("{open} of the {all} deadlines of {name} are"),
                },
            ));
        }
    }
    Ok(())
}
