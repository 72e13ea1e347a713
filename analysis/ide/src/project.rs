//! Which projects a file is part of.

use mauve_model::{File, ModelDb, Project, Workspace, project_files, projects, table_files};

/// The projects that have this model, table or configuration.
pub(crate) fn projects_with<'db>(
    db: &'db dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
) -> Vec<Project<'db>> {
    let mut found = Vec::new();
    for &workspace in workspaces {
        let is_table = || table_files(db, workspace).files.contains(&file);
        let all = projects(db, workspace).iter().copied();
        found.extend(all.filter(|&project| project_files(db, project).contains(&file) || is_table()));
    }
    found
}
