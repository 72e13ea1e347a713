//! The projects of a file.

use std::collections::HashMap;
use std::path::Path;

use mauve_hir::item_tree::{Kind, Name, NameRef};
use mauve_hir::{
    Decl, File, Location, ModelDb, Project, Workspace, architecture, config_file, names_of, project_files,
    projects, resolve_type,
};
use mauve_syntax::TextSize;
use mauve_wcrt::{Query, input_files};

use crate::occurrences::names_at;

/// A deployment of a project, and how it is analysed.
pub type DeploymentAt<'db> = (Project<'db>, Decl<'db>, Query);

/// Returns the projects that have this model, table or configuration.
pub fn projects_with<'db>(db: &'db dyn ModelDb, workspaces: &[Workspace], file: File) -> Vec<Project<'db>> {
    let mut found = Vec::new();
    for &workspace in workspaces {
        let is_shared =
            config_file(db, workspace) == Some(file) || input_files(db, workspace).0.any(|it| it == file);
        let all = projects(db, workspace).iter().copied();
        found.extend(all.filter(|&project| is_shared || project_files(db, project).contains(&file)));
    }
    found
}

/// Returns whether a project knows a definition of a name at `offset`.
pub fn has_name_at(db: &dyn ModelDb, project: Project<'_>, file: File, offset: TextSize) -> bool {
    !names_at(db, project, file, offset).is_empty()
}

/// Returns the name of a project for users: the path of its root below the workspace's folder. Where another project `among` these
/// has the same one, the name of the folder comes before it.
pub fn name_of_root(db: &dyn ModelDb, project: Project<'_>, among: &[Project<'_>]) -> String {
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

/// Returns the instances of each component, with their names.
#[salsa::tracked(returns(ref))]
pub(crate) fn instances_by_component<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> HashMap<Decl<'db>, Vec<(Name, Location<'db>)>> {
    let names = names_of(db, project);
    let mut found: HashMap<Decl<'db>, Vec<(Name, Location<'db>)>> = HashMap::new();
    for &of in &names.all {
        for instance in architecture(db, of).into_iter().flat_map(|data| &data.instances) {
            let component = resolve_type(db, project, of, Kind::Component, instance.component.as_ref());
            if let Ok(component) = component {
                let NameRef { name, id } = &instance.name;
                found.entry(component).or_default().push((name.clone(), Location::Source(of, *id)));
            }
        }
    }
    found
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
        let names = all.map(|project| name_of_root(&db, project, &all));
        assert_eq!(names, ["one/robot.mal", "two/robot.mal", "sub/arm.mal"]);
        assert_eq!(name_of_root(&db, all[0], &all[..1]), "robot.mal");
    }
}
