//! Links to files: includes and imports of a model, roots and tables of `mauve.toml`.

use mauve_hir::item_tree::Kind;
use mauve_hir::{
    File, Location, ModelDb, Project, Workspace, architecture, config_file, config_of, declarations,
    includes, is_model, normalised, resolve_type, source_map,
};
use mauve_syntax::{TextRange, TextSize};
use mauve_wcrt::{declared_threads, input_files, place_of_thread, system_of, table_pattern};

use crate::occurrences::{range_of, unquoted};

/// A link in a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DocumentLink {
    /// Its range: a path without quotes, or a name.
    pub range: TextRange,
    /// The target file.
    pub target: File,
    /// The target location in the file, if it is a declaration.
    pub at: Option<TextSize>,
    /// A short description of the target.
    pub tooltip: String,
}

/// Returns the links of a file of a workspace, in text order; those of imports only with a project. A path without a target, or with
/// several, gives no link.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let texts = [("/a.mal".into(), "include \"b.mal\"".to_owned()), ("/b.mal".into(), String::new())];
/// let workspace = Workspace::of_texts(&db, "/".into(), texts);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let links = mauve_ide::document_links(&db, workspace, Some(projects(&db, workspace)[0]), file);
/// assert_eq!(&file.text(&db)[links[0].range], "b.mal");
/// ```
pub fn document_links(
    db: &dyn ModelDb,
    workspace: Workspace,
    project: Option<Project<'_>>,
    file: File,
) -> Vec<DocumentLink> {
    let mut links = Vec::new();
    if is_model(file.path(db)) {
        included(db, workspace, file, &mut links);
        if let Some(project) = project {
            imported(db, project, file, &mut links);
            declared(db, project, file, &mut links);
        }
    } else if config_file(db, workspace) == Some(file) {
        configured(db, workspace, file, &mut links);
    }
    links.sort_by_key(|link| link.range.start());
    links
}

fn included(db: &dyn ModelDb, workspace: Workspace, file: File, links: &mut Vec<DocumentLink>) {
    let places = &source_map(db, file).includes;
    for (target, range) in includes(db, workspace, file).iter().zip(places) {
        let Some(target) = *target else { continue };
        links.extend(link(db, workspace, file, *range, target));
    }
}

fn imported(db: &dyn ModelDb, project: Project<'_>, file: File, links: &mut Vec<DocumentLink>) {
    let all = declarations(db, file).all.iter().filter(|decl| decl.kind(db) == Kind::Architecture);
    for &decl in all {
        for import in architecture(db, decl).into_iter().flat_map(|it| &it.imports).flatten() {
            let Ok(target) = resolve_type(db, project, decl, Kind::Architecture, Some(import)) else {
                continue;
            };
            links.push(DocumentLink {
                range: Location::Source(decl, import.id).range(db),
                target: target.file(db),
                at: Some(Location::name_of(target).range(db).start()),
                tooltip: format!("architecture {}", target.qualified(db)),
            });
        }
    }
}

/// The threads of activities in files of `[platform] threads`.
fn declared(db: &dyn ModelDb, project: Project<'_>, file: File, links: &mut Vec<DocumentLink>) {
    let declared = declared_threads(db, project.workspace(db));
    for &deployment in declarations(db, file).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
        for activity in &system_of(db, project, deployment).activities {
            let Some((index, field)) = activity.declared_thread else { continue };
            let Some(thread) = declared.all.get(index) else { continue };
            let Some(at) = place_of_thread(db, thread) else { continue };
            let range = unquoted(file.text(db), Location::Source(deployment, field).range(db));
            let (target, at) = (at.file(db), Some(at.range(db).start()));
            links.push(DocumentLink { range, target, at, tooltip: format!("thread {}", thread.id) });
        }
    }
}

fn configured(db: &dyn ModelDb, workspace: Workspace, file: File, links: &mut Vec<DocumentLink>) {
    let config = config_of(db, workspace);
    for (path, span) in &config.roots {
        let root = workspace.file(db, &normalised(&workspace.folder(db).join(path)));
        links.extend(root.and_then(|root| link(db, workspace, file, range_of(span), root)));
    }
    for (pattern, span) in config.all_patterns() {
        let Ok(glob) = table_pattern(workspace.folder(db), pattern) else { continue };
        let mut named = input_files(db, workspace).0.filter(|it| glob.is_match(it.path(db)));
        if let (Some(table), None) = (named.next(), named.next()) {
            links.extend(link(db, workspace, file, range_of(span), table));
        }
    }
}

fn link(
    db: &dyn ModelDb,
    workspace: Workspace,
    file: File,
    quoted: TextRange,
    target: File,
) -> Option<DocumentLink> {
    let range = unquoted(file.text(db), quoted);
    let path = target.path(db);
    let shown = path.strip_prefix(workspace.folder(db)).unwrap_or(path).display().to_string();
    (!range.is_empty()).then_some(DocumentLink { range, target, at: None, tooltip: shown })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_with};
    use expect_test::{Expect, expect};

    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, .. } = Fixture::new(fixture);
        let mut shown = String::new();
        for link in document_links(&db, workspace, project_with(&db, workspace, file), file) {
            let line = |at: TextSize| link.target.text(&db)[..at.into()].matches('\n').count() + 1;
            let at = link.at.map(|at| format!(":{}", line(at))).unwrap_or_default();
            let path = link.target.path(&db).display();
            shown += &format!("{} -> {path}{at} | {}\n", &file.text(&db)[link.range], link.tooltip);
        }
        expected.assert_eq(&shown);
    }

    const ROBOT: &str = r#"
//- /robot.mal
/* 🦀 é */ include "parts/laser.mal" include "nowhere.mal"
use parts
architecture A { import Base import parts.Other import Nothing }
architecture Base { }
//- /parts/laser.mal
include "../robot.mal"
library parts {
  architecture Other { }
}
"#;

    #[test]
    fn includes_and_imports() {
        check(
            ROBOT,
            expect![[r#"
                parts/laser.mal -> /parts/laser.mal | parts/laser.mal
                Base -> /robot.mal:4 | architecture Base
                parts.Other -> /parts/laser.mal:3 | architecture parts.Other
            "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        check("//- /a.mal\ninclude \"b.mal\ninclude\n//- /b.mal\nuse a\n", expect![[""]]);
    }

    #[test]
    fn roots_and_tables() {
        check(
            r#"
//- /mauve.toml
[project]
roots = ["robot.mal", 'nowhere.mal']
[timing]
tables = ["times.toml", "more/*.toml", "one/*.toml", "none.toml"]
[timing.deployment.Sea]
tables = ["sea.toml"]
//- /sea.toml
codel.e = 1
//- /robot.mal
use a
//- /times.toml
codel.a = 1
//- /more/a.toml
codel.b = 1
//- /more/b.toml
codel.c = 1
//- /one/a.toml
codel.d = 1
"#,
            expect![[r#"
                robot.mal -> /robot.mal | robot.mal
                times.toml -> /times.toml | times.toml
                one/*.toml -> /one/a.toml | one/a.toml
                sea.toml -> /sea.toml | sea.toml
            "#]],
        );
    }
}
