//! Sorts the `use`s of a file, and removes duplicates and unused ones.
//!
//! A blank line, or anything other than a comment, ends a group. The order has no effect. A `use` is valid in all blocks of its
//! library, so it is needed if any of them refers to a name in it.

use std::collections::BTreeSet;

use mauve_hir::fact::{Fact, FactKind};
use mauve_hir::item_tree::Name;
use mauve_hir::{
    Decl, Location, ModelDb, Project, declaration_facts, declarations, names_of, package, parse,
    project_files,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::{NodeOrToken, SyntaxNode, TextRange};
use rustc_hash::{FxHashMap, FxHashSet};

use super::{ActionKind, Actions, with_line};
use crate::Change;
use crate::occurrences::{Definition, occurrences_of};

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    let (db, file) = (actions.db, actions.question.file);
    // Without a request, only with the cursor at a `use`, because all names of the library have to be resolved.
    let kind = if actions.wants(ActionKind::OrganizeUses) {
        ActionKind::OrganizeUses
    } else if actions.wants(ActionKind::Rewrite) && actions.node::<ast::Use>().is_some() {
        ActionKind::Rewrite
    } else {
        return;
    };
    if !mauve_hir::is_model(file.path(db)) {
        return;
    }
    let parse = parse(db, file);
    if !parse.errors().is_empty() {
        return;
    }
    let mut edits = Vec::new();
    let libraries: Vec<ProjectLibraries<'_>> =
        actions.projects.iter().map(|&project| libraries_of(db, project)).collect();
    let source = parse.file();
    let outer = uses_in(source.syntax());
    edits.extend(organise(file.text(db), &outer, |_| false));
    for library in source.syntax().children().filter_map(ast::Library::cast) {
        let uses = uses_in(library.syntax());
        let (Some(name), false) = (library.name(), uses.is_empty()) else { continue };
        let name = Name::from(name.syntax().text().to_string());
        let needed: Option<Vec<BTreeSet<Name>>> = actions
            .projects
            .iter()
            .zip(&libraries)
            .map(|(&project, of)| needed_by(db, project, of, &name))
            .collect();
        let is_for_nothing = |of: &str| {
            let is_known = actions.projects.iter().all(|&project| {
                names_of(db, project).has_library(&of.into())
                    || package(db, project.workspace(db), &of.into()).is_some()
            });
            // The uses of a file outside of all projects are unknown.
            let is_checked = is_known && !actions.projects.is_empty();
            is_checked && needed.as_ref().is_some_and(|all| all.iter().all(|needed| !needed.contains(of)))
        };
        edits.extend(organise(file.text(db), &uses, is_for_nothing));
    }
    if !edits.is_empty() {
        actions.offer(kind, "Organise the `use`s", || Change::of(file, edits));
    }
}

fn uses_in(node: &SyntaxNode) -> Vec<ast::Use> {
    node.children().filter_map(ast::Use::cast).collect()
}

/// The libraries of a project.
#[derive(Default)]
struct ProjectLibraries<'db> {
    declarations: FxHashMap<&'db Name, Vec<Decl<'db>>>,
    /// The libraries in files with a syntax error, which may hide a declaration.
    damaged: FxHashSet<&'db Name>,
}

fn libraries_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> ProjectLibraries<'db> {
    let mut libraries = ProjectLibraries::default();
    for &file in project_files(db, project) {
        let found = declarations(db, file);
        if !parse(db, file).errors().is_empty() {
            libraries.damaged.extend(&found.libraries);
        }
    }
    for &decl in &names_of(db, project).all {
        if let Some(library) = decl.library(db) {
            libraries.declarations.entry(library).or_default().push(decl);
        }
    }
    libraries
}

/// Returns the libraries and packages that a library refers to, or `None` if that is not certain.
fn needed_by<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    libraries: &ProjectLibraries<'db>,
    library: &Name,
) -> Option<BTreeSet<Name>> {
    if names_of(db, project).completeness.is_incomplete() || libraries.damaged.contains(library) {
        return None;
    }
    let mut needed = BTreeSet::new();
    for &decl in libraries.declarations.get(library).into_iter().flatten() {
        // A name that is wrong may be meant for any of them: ambiguous, misspelt, or not there yet.
        let is_uncertain =
            |fact: &Fact<'_>| fact.is_error() || matches!(fact.kind, FactKind::UnknownType { .. });
        if declaration_facts(db, project, decl).iter().any(is_uncertain) {
            return None;
        }
        for name in occurrences_of(db, project, decl) {
            match &name.definition {
                Definition::Declaration(of) | Definition::At(Location::Source(of, _)) => {
                    needed.extend(of.library(db).clone());
                }
                Definition::Library(of) | Definition::Package(of) | Definition::Message(of, _) => {
                    needed.insert(of.clone());
                }
                Definition::At(_) | Definition::Type(_) | Definition::File(_) => {}
            }
        }
    }
    Some(needed)
}

fn organise(text: &str, uses: &[ast::Use], is_for_nothing: impl Fn(&str) -> bool) -> Vec<Replacement> {
    let name = |it: &ast::Use| it.name_ref().map(|it| it.syntax().text().to_string()).unwrap_or_default();
    let mut edits = Vec::new();
    let mut seen = BTreeSet::new();
    let mut kept: Vec<&ast::Use> = Vec::new();
    for it in uses {
        if !seen.insert(name(it)) || is_for_nothing(&name(it)) {
            // A comment after or above it stays.
            let range = with_line(text, it.syntax().text_range());
            edits.push(Replacement { range, text: String::new() });
        } else {
            kept.push(it);
        }
    }
    let mut rest = kept.as_slice();
    while let Some((first, _)) = rest.split_first() {
        let length =
            rest.windows(2).take_while(|pair| follows(pair[0].syntax(), pair[1].syntax())).count() + 1;
        let (group, others) = rest.split_at(length.min(rest.len()));
        rest = others;
        // A comment may describe one of them or all: the group stays unchanged.
        let end = group.last().unwrap_or(first).syntax().text_range().end();
        let line = text.get(usize::from(end)..).and_then(|rest| rest.lines().next()).unwrap_or_default();
        let inside = text.get(usize::from(first.syntax().text_range().start())..usize::from(end));
        if has_mark(line) || inside.is_none_or(has_mark) {
            continue;
        }
        let mut sorted: Vec<&ast::Use> = group.to_vec();
        sorted.sort_by_key(|it| name(it));
        for (place, it) in group.iter().zip(sorted).filter(|(place, it)| name(place) != name(it)) {
            let range = place.syntax().text_range();
            edits.push(Replacement { range, text: it.syntax().text().to_string() });
        }
    }
    edits
}

fn has_mark(text: &str) -> bool {
    text.contains("//") || text.contains("/*")
}

fn follows(one: &SyntaxNode, next: &SyntaxNode) -> bool {
    let range = TextRange::new(one.text_range().end(), next.text_range().start().max(one.text_range().end()));
    let Some(parent) = one.parent() else { return false };
    let mut between = parent.descendants_with_tokens().filter_map(NodeOrToken::into_token);
    !between.any(|it| {
        let is_there = range.contains_range(it.text_range()) && !it.text_range().is_empty();
        is_there && (!it.kind().is_trivia() || it.text().matches('\n').count() > 1)
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use super::super::{ActionKind, ActionQuestion, Changes, code_actions};
    use crate::fixture::{Fixture, project_with};
    use expect_test::{Expect, expect};
    use mauve_syntax::TextRange;

    fn organised(uses: &str, expected: Expect) {
        let text = format!(
            "include \"parts.mal\"\nlibrary own {{\n{uses}\n  shell S {{ input port pose: Pose  input port scan: sensor_msgs.LaserScan }}\n}}\n\
             //- /parts.mal\nlibrary parts {{ codel f(): int }}\nlibrary own {{ core C(S) {{ update = {{ f(); }} }} }}\nlibrary third {{ }}\n"
        );
        check(&text, "Organise", expected);
    }

    #[test]
    fn sorted_once_and_needed() {
        organised(
            "  use sensor_msgs\n  use parts\n  use geometry_msgs\n  use parts\n  use third\n  use std_msgs",
            expect![[r#"
                --- /model.mal
                  use geometry_msgs
                  use parts
                  use sensor_msgs
            "#]],
        );
        // Sorted, and needed by another block of the library.
        organised("  use geometry_msgs\n  use parts", expect!["not offered\n"]);
        // What nobody knows may be anything.
        organised("  use geometry_msgs\n  use other_msgs", expect!["not offered\n"]);
    }

    #[test]
    fn comments_and_blank_lines_stay() {
        organised(
            "  use third // 🦀 é\n  // Ours.\n  use parts\n  use geometry_msgs\n\n  use sensor_msgs",
            expect![[r#"
                --- /model.mal
                  // 🦀 é
                  // Ours.
                  use geometry_msgs
                  use parts
            "#]],
        );
        organised("  use parts\n  // For poses.\n  use geometry_msgs", expect!["not offered\n"]);
        organised("  use parts\n  use geometry_msgs\n  codel g(", expect!["not offered\n"]);
    }

    #[test]
    fn a_name_that_is_wrong_may_be_meant_for_any_of_them() {
        let check = |own: &str| {
            let text = format!(
                "library front {{ shell S {{ }} }}\nlibrary rear {{ shell S {{ }} }}\nlibrary robot {{\n  use front\n  use rear\n  \
                 use std_msgs\n  {own}\n}}\n"
            );
            check(&text, "Organise", expect!["not offered\n"]);
        };
        // Ambiguous, and without one of them no longer.
        check("core C(S) { update = { } }");
        check("shell T { input port p: Heade }");
        check("core C(T) { update = { } }");
    }

    #[test]
    fn unasked_only_at_a_use() {
        let text = "library own {\n  use std_msgs\n  shell S { }\n}\n";
        for (cursor, is_offered) in [("use $0std_msgs", true), ("sh$0ell", false)] {
            let text = text.replacen(&cursor.replace("$0", ""), cursor, 1);
            let Fixture { db, workspace, file, offset } = Fixture::new(&text);
            let range = TextRange::empty(offset);
            let kinds = &[ActionKind::QuickFix, ActionKind::Rewrite];
            let question = ActionQuestion { file, range, diagnostics: &[], kinds, changes: Changes::All };
            let actions =
                code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question);
            let action = actions.iter().find(|it| it.title.starts_with("Organise"));
            assert_eq!(action.is_some(), is_offered, "{text}");
            let after = action.map(|it| it.change.as_ref().unwrap().applied(&db, file));
            assert_eq!(after, is_offered.then(|| "library own {\n  shell S { }\n}\n".to_owned()));
        }
    }
}
