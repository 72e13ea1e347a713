//! The project that answers for a file. A model may be part of several: two robots include one library, or a robot includes a
//! file of another folder. An editor feature answers for one of them; a code lens and hovers name the others. Diagnostics, references
//! and renames see all.

use std::cmp::Reverse;

use mauve_hir::{File, Project, Workspace, is_model, projects};
use mauve_ide::{
    CodeLens, LensAction, code_lenses, has_name_at, meanings_of_names, name_of_root, projects_with,
};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::Level;
use mauve_wcrt::levels_of_tables;

use super::snapshot::Snapshot;

/// Other projects of a file are named up to this number.
const MOST_PROJECTS: usize = 3;

impl Snapshot {
    /// Returns the projects that contain a file. The first answers for it: a project of the nearest `mauve.toml` above the file, and
    /// of several there, the project whose root is the file, otherwise the first.
    pub(crate) fn projects(&self, file: File) -> Vec<Project<'_>> {
        let db = &self.db;
        let mut found = projects_with(db, &self.workspaces, file);
        found.sort_by_cached_key(|project| {
            let folder = project.workspace(db).folder(db);
            let depth = file.path(db).starts_with(folder).then(|| folder.components().count());
            (Reverse(depth), project.root(db) != file)
        });
        found
    }

    /// Returns the project that answers for a file.
    pub(crate) fn project(&self, file: File) -> Option<Project<'_>> {
        self.projects(file).first().copied()
    }

    /// Returns the projects that answer for a file: one for a model; all of a workspace for a timing table or a configuration, which
    /// they share.
    pub(crate) fn answering(&self, file: File) -> Vec<Project<'_>> {
        let mut found = self.projects(file);
        match found.first().map(|first| first.workspace(&self.db)) {
            Some(_) if is_model(file.path(&self.db)) => found.truncate(1),
            Some(nearest) => found.retain(|project| project.workspace(&self.db) == nearest),
            None => {}
        }
        found
    }

    /// Returns the project that answers for a position: of several that do so for the file, the first that knows the name there.
    pub(crate) fn project_at(&self, file: File, offset: TextSize) -> Option<Project<'_>> {
        let all = self.answering(file);
        let has_name = |project: &&Project<'_>| has_name_at(&self.db, **project, file, offset);
        let knowing = if all.len() > 1 { all.iter().find(has_name) } else { None };
        knowing.or(all.first()).copied()
    }

    /// Returns the workspace of a file: that of the project that answers for it; for a file of no project, the first with the file.
    pub(crate) fn workspace(&self, file: File) -> Option<Workspace> {
        let has_file = |it: &&Workspace| it.file(&self.db, file.path(&self.db)) == Some(file);
        let project = self.project(file);
        project.map(|it| it.workspace(&self.db)).or_else(|| self.workspaces.iter().find(has_file).copied())
    }

    /// Returns the levels of all timing tables in descending order of probability; empty if no time depends on a level, so that any
    /// level can be selected.
    pub(crate) fn levels(&self) -> Vec<Level> {
        let projects = self.workspaces.iter().flat_map(|&workspace| projects(&self.db, workspace));
        let mut levels: Vec<Level> =
            projects.flat_map(|&project| levels_of_tables(&self.db, project)).collect();
        levels.sort_unstable_by_key(|level| Reverse(*level));
        levels.dedup();
        levels
    }

    /// Returns the lenses of a file in text order: that of its projects, if it has several, and those of its declarations.
    pub(crate) fn lenses(&self, file: File) -> Vec<CodeLens> {
        let project = self.project(file);
        let named = project
            .filter(|_| is_model(file.path(&self.db)))
            .and_then(|it| self.others_named(it, file, |name| name));
        let mut found = Vec::new();
        if let Some((title, others)) = named {
            let start = TextRange::empty(TextSize::new(0));
            let roots = others.iter().map(|project| (project.root(&self.db), start)).collect();
            found.push(CodeLens { range: start, title, action: LensAction::Show(roots) });
        }
        found.extend(code_lenses(&self.db, project, file));
        found
    }

    /// Names the project that answers for a file that several projects share, and the others; returns these, too. `shown`: writes a
    /// name.
    pub(crate) fn others_named<'a>(
        &'a self,
        answering: Project<'a>,
        file: File,
        shown: fn(String) -> String,
    ) -> Option<(String, Vec<Project<'a>>)> {
        let (db, projects) = (&self.db, self.projects(file));
        let others: Vec<Project<'_>> = projects.iter().copied().filter(|it| *it != answering).collect();
        let name = |project| shown(name_of_root(db, project, &projects));
        let (named, more) = others.split_at(others.len().min(MOST_PROJECTS));
        let mut names: Vec<String> = named.iter().map(|it| name(*it)).collect();
        if !more.is_empty() {
            names.push(format!("{} more", more.len()));
        }
        let title = format!("Project {}, also in {}", name(answering), names.join(", "));
        (!others.is_empty()).then_some((title, others))
    }

    /// Returns a value that changes whenever the kinds of a file's names change.
    pub(crate) fn meanings(&self, file: File) -> u64 {
        self.project(file).map_or(0, |project| meanings_of_names(&self.db, project, file))
    }
}
