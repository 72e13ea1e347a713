//! The projects of a file.

use std::path::Path;

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

/// Returns the names of some projects `among` others for a message.
pub(crate) fn in_projects(db: &dyn ModelDb, projects: &[Project<'_>], among: &[Project<'_>]) -> String {
    let roots: Vec<String> = projects.iter().map(|&project| name_of_root(db, project, among)).collect();
    format!("in the project of {}", roots.join(", "))
}

/// Returns the name of a project for users: the path of its root below the workspace's folder. Where another project `among` these
/// has the same one, the name of the folder comes before it.
pub(crate) fn name_of_root(db: &dyn ModelDb, project: Project<'_>, among: &[Project<'_>]) -> String {
    let path = |project: Project<'_>| {
        let path = project.root(db).path(db);
        path.strip_prefix(project.workspace(db).folder(db)).unwrap_or(path)
    };
    let name = path(project);
    let is_taken = among.iter().any(|&it| it.root(db) != project.root(db) && path(it) == name);
    match project.workspace(db).folder(db).file_name().filter(|_| is_taken) {
        Some(folder) => Path::new(folder).join(name).display().to_string(),
        None => name.display().to_string(),
    }
}

#[cfg(test)]
mod tests {
    use mauve_hir::Database;

    use super::*;

    #[test]
    fn projects_with_roots_of_one_name_are_told_apart() {
        let db = Database::default();
        let of = |folder: &str, root: &str| {
            let text = (format!("{folder}/{root}").into(), "codel f(): int".to_owned());
            projects(&db, Workspace::of_texts(&db, folder.into(), [text]))[0]
        };
        let all = [of("/a/one", "robot.mal"), of("/a/two", "robot.mal"), of("/a/three", "sub/arm.mal")];
        assert_eq!(
            in_projects(&db, &all, &all),
            "in the project of one/robot.mal, two/robot.mal, sub/arm.mal"
        );
        assert_eq!(in_projects(&db, &all[..1], &all[..1]), "in the project of robot.mal");
    }
}
