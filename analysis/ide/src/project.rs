//! The projects of a file.

use mauve_hir::{File, ModelDb, Project, Workspace, config_file, project_files, projects};
use mauve_wcrt::table_files;

/// Returns the projects that have this model, table or configuration.
pub fn projects_with<'db>(db: &'db dyn ModelDb, workspaces: &[Workspace], file: File) -> Vec<Project<'db>> {
    let mut found = Vec::new();
    for &workspace in workspaces {
        let is_shared =
            config_file(db, workspace) == Some(file) || table_files(db, workspace).files.contains(&file);
        let all = projects(db, workspace).iter().copied();
        found.extend(all.filter(|&project| is_shared || project_files(db, project).contains(&file)));
    }
    found
}

/// Removes duplicates, keeping the order.
pub(crate) fn each_once<T: PartialEq>(all: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for it in all {
        if !found.contains(&it) {
            found.push(it);
        }
    }
    found
}

/// Returns the names of projects for a message.
pub(crate) fn in_projects(db: &dyn ModelDb, projects: &[Project<'_>]) -> String {
    let roots: Vec<String> = projects.iter().map(|&project| name_of_root(db, project)).collect();
    format!("in the project of {}", roots.join(", "))
}

/// Returns the name of a project for users: the path of its root below the workspace's folder.
pub(crate) fn name_of_root(db: &dyn ModelDb, project: Project<'_>) -> String {
    let path = project.root(db).path(db);
    path.strip_prefix(project.workspace(db).folder(db)).unwrap_or(path).display().to_string()
}
