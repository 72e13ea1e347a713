//! Which projects a file is part of.

use mauve_hir::{File, ModelDb, Project, Workspace, config_file, project_files, projects};
use mauve_wcrt::table_files;

/// The projects that have this model, table or configuration.
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

/// The root of a project as a user knows it: its path from the workspace's folder.
pub(crate) fn name_of_root(db: &dyn ModelDb, project: Project<'_>) -> String {
    let path = project.root(db).path(db);
    path.strip_prefix(project.workspace(db).folder(db)).unwrap_or(path).display().to_string()
}
