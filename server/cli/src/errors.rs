//! What commands say about the errors of a project, without which a figure may be missing, and about several deployments.

use std::path::Path;

use mauve_diagnostics::errors_of_text;
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Database, Decl, Project, Workspace, hosts_of, similar};
use mauve_projects::analysis_document::deployments;
use mauve_projects::output::say;

use crate::text::{argument, counted};

/// Says that a project has errors, if it has.
pub(super) fn say_errors(errors: usize) {
    if errors > 0 {
        say(&with_errors(errors));
    }
}

/// Says that there is no deployment, for which the errors may be the reason.
pub(super) fn nothing_to(doing: &str, errors: usize) -> String {
    missing(format!("no deployment in these models: nothing to {doing}"), errors)
}

/// Says that something is missing, for which the errors may be the reason.
pub(super) fn missing(what: String, errors: usize) -> String {
    if errors == 0 { what } else { format!("{what}; {}", with_errors(errors)) }
}

/// Returns the only deployment, or the only one called `name`.
///
/// # Errors
///
/// There is none, or there are several.
pub(super) fn only_deployment<'db>(
    db: &'db Database,
    workspaces: &[Workspace],
    name: Option<&str>,
    doing: &str,
) -> Result<(Project<'db>, Decl<'db>), String> {
    match deployments(db, workspaces, name)?.as_slice() {
        [one] => Ok(*one),
        [] => Err(nothing_to(doing, errors_of_text(db, workspaces))),
        several => Err(several_of(db, Kind::Deployment, several)),
    }
}

/// Returns the host of a name, by its index; none in a project without hosts.
///
/// # Errors
///
/// There is none of that name, or there are hosts, and no name.
pub(super) fn host_called(
    db: &Database,
    (project, deployment): (Project<'_>, Decl<'_>),
    name: Option<&str>,
) -> Result<Option<usize>, String> {
    let hosts = &hosts_of(db, project.workspace(db)).all;
    let names: Vec<Name> = hosts.iter().map(|it| it.name.clone()).collect();
    let of = deployment.qualified(db);
    let all = || names.iter().map(|it| it.as_str()).collect::<Vec<_>>().join(", ");
    match (name, names.first()) {
        (None, None) => Ok(None),
        (None, Some(first)) => {
            let first = argument(Path::new(first.as_str()));
            Err(format!("`{of}` runs on hosts {}: name one of them, such as `--host {first}`", all()))
        }
        (Some(name), None) => Err(format!(
            "there is no host `{name}`: the robot has one computer; omit --host, or write `[host.{name}]` into mauve.toml"
        )),
        (Some(name), Some(_)) => names.iter().position(|it| it == name).map(Some).ok_or_else(|| {
            let near = similar(name, &names).map_or_else(String::new, |it| format!("; did you mean `{it}`?"));
            format!("there is no host `{name}`: `{of}` runs on {}{near}", all())
        }),
    }
}

/// Says how to choose one of several declarations.
pub(super) fn several_of(db: &Database, kind: Kind, several: &[(Project<'_>, Decl<'_>)]) -> String {
    let path = if has_one_project(several) { "" } else { " and the path of a project" };
    format!("several {kind}s: choose one with --{kind}{path}: {}", names_in(db, several).join(", "))
}

fn has_one_project(several: &[(Project<'_>, Decl<'_>)]) -> bool {
    let first = several.first().map(|(project, _)| project);
    several.iter().all(|(project, _)| Some(project) == first)
}

/// Returns the qualified names of declarations; of several projects, each with its project.
pub(super) fn names_in(db: &Database, several: &[(Project<'_>, Decl<'_>)]) -> Vec<String> {
    let has_one_project = has_one_project(several);
    let name = |(project, decl): &(Project<'_>, Decl<'_>)| match has_one_project {
        true => decl.qualified(db),
        false => format!("{} of {}", decl.qualified(db), project.root(db).path(db).display()),
    };
    several.iter().map(name).collect()
}

fn with_errors(errors: usize) -> String {
    let them = if errors == 1 { "it" } else { "them" };
    format!("the project has {} (`mauve check` shows {them})", counted(errors, "error"))
}
