//! Rewrites `library.Name` as `Name`, with a `use` of the library if needed; and back.

use mauve_hir::item_tree::{Kind, Name, SourceId, TypeRef};
use mauve_hir::{Builtin, Decl, File, ModelDb, Project, Unresolved, declaration_at, names_of, resolve_type};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::{TextRange, is_whole};

use super::{ActionKind, Actions, indentation};
use crate::Change;
use crate::occurrences::{Definition, definition_of_type};

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    if !actions.wants(ActionKind::Rewrite) {
        return;
    }
    let (db, file) = (actions.db, actions.question.file);
    let Some(ty) = actions.node::<ast::Type>().filter(|it| is_whole(it.syntax())) else { return };
    let segments: Vec<String> = ty.segments().map(|it| it.syntax().text().to_string()).collect();
    match segments.as_slice() {
        [library, name] => {
            actions.refactor(ActionKind::Rewrite, format!("Shorten to `{name}`"), |project| {
                shortened(db, project, file, &ty, library, name)
            });
        }
        [name] => {
            let found = actions.project.and_then(|project| declarations_of(db, project, file, &ty));
            let library = found.and_then(|(_, decl)| decl.library(db).clone());
            let Some(library) = library else { return };
            let title = format!("Qualify as `{library}.{name}`");
            actions.refactor(ActionKind::Rewrite, title, |project| {
                let (of, decl) = declarations_of(db, project, file, &ty)?;
                let path = [library.clone(), Name::from(name.as_str())];
                let found = names_of(db, project).resolve(db, of.library(db).as_ref(), decl.kind(db), &path);
                if decl.library(db) == of.library(db) || found != Ok(decl) {
                    return None;
                }
                let range = ty.syntax().text_range();
                let text = format!("{library}.{name}");
                Change::of(file, [Replacement { range, text }]).map(Ok)
            });
        }
        _ => {}
    }
}

/// Returns the declaration that contains a type, and the declaration that the type refers to.
fn declarations_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    ty: &ast::Type,
) -> Option<(Decl<'db>, Decl<'db>)> {
    let Definition::Declaration(decl) = definition_of_type(db, project, file, ty)? else { return None };
    Some((declaration_at(db, file, ty.syntax().text_range())?, decl))
}

fn shortened(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    ty: &ast::Type,
    library: &str,
    name: &str,
) -> Option<Result<Change, String>> {
    let (of, decl) = declarations_of(db, project, file, ty)?;
    let (names, own) = (names_of(db, project), of.library(db).as_ref());
    let short = TypeRef { path: vec![name.into()], id: SourceId(0) };
    let short_name = Replacement { range: ty.syntax().text_range(), text: name.to_owned() };
    match resolve_type(db, project, of, decl.kind(db), Some(&short)) {
        Ok(found) if found == decl => return Change::of(file, [short_name]).map(Ok),
        Ok(_) => return Some(Err(format!("`{name}` refers to another {} here", decl.kind(db)))),
        Err(Unresolved::Unknown) => {}
        Err(_) => return None,
    }
    // With the `use`, all names of the library are visible: none of them may refer to something else now, or be the name of a
    // built-in function.
    for other in names.all.iter().filter(|it| it.library(db).as_deref() == Some(library)) {
        let is_built_in = other.kind(db) == Kind::Codel && Builtin::of_name(other.name(db)).is_some();
        let found = names.resolve(db, own, other.kind(db), std::slice::from_ref(other.name(db)));
        let is_taken = found.as_ref().is_ok_and(|found| found.library(db).as_ref() != own);
        if is_built_in || is_taken || found == Err(Unresolved::Ambiguous) {
            let name = other.name(db);
            return Some(Err(format!("with `use {library}`, `{name}` would refer to another definition")));
        }
    }
    let block = ty.syntax().ancestors().find_map(ast::Library::cast)?;
    let last_use = block.items().filter(|it| matches!(it, ast::Item::Use(_))).last();
    let (behind, indent) = match last_use {
        Some(last) => {
            (last.syntax().text_range(), indentation(file.text(db), last.syntax().text_range().start()))
        }
        None => (block.l_curly_token()?.text_range(), "  "),
    };
    let text = format!("\n{indent}use {library}");
    let to_use = Replacement { range: TextRange::empty(behind.end()), text };
    Change::of(file, [short_name, to_use]).map(Ok)
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::{Expect, expect};

    fn shortened(item: &str, others: &str, expected: Expect) {
        let text = format!(
            "include \"parts.mal\"\nlibrary own {{\n  {item}\n}}\n{others}\n\
             //- /parts.mal\nlibrary parts {{ shell S {{ }} core C(S) {{ update = {{ }} }} codel f(): int }}\n"
        );
        check(&text, "Shorten to", expected);
    }

    #[test]
    fn with_a_use_where_there_is_none() {
        shortened(
            "/* 🦀 é */ component K(parts.$0S, parts.C)",
            "",
            expect![[r#"
                --- /model.mal
                  use parts
                  /* 🦀 é */ component K(S, parts.C)
            "#]],
        );
        shortened(
            "use parts component K(parts.S, parts.$0C)",
            "",
            expect![[r#"
                --- /model.mal
                  use parts component K(parts.S, C)
            "#]],
        );
    }

    #[test]
    fn not_where_a_name_would_mean_something_else() {
        shortened(
            "shell S { } component K(parts.$0S, parts.C)",
            "",
            expect![[r#"
                refused: `S` refers to another shell here
            "#]],
        );
        shortened(
            "use third component K(parts.$0S, parts.C)",
            "library third { codel f(): int }",
            expect![[r#"
                refused: with `use parts`, `f` would refer to another definition
            "#]],
        );
        shortened("component K(parts.$0Q, parts.C)", "", expect!["not offered\n"]);
    }

    #[test]
    fn a_qualified_name_becomes_a_short_one() {
        let back = |text: &str, expected: Expect| {
            let parts = "//- /parts.mal\nlibrary parts { shell S { } core C(S) { update = { } } }\n";
            check(&format!("include \"parts.mal\"\n{text}\n{parts}"), "Qualify as `parts.", expected);
        };
        back(
            "library own { use parts component K($0S, parts.C) }",
            expect![[r#"
                --- /model.mal
                library own { use parts component K(parts.S, parts.C) }
            "#]],
        );
        back(
            "component K($0S, parts.C)",
            expect![[r#"
                --- /model.mal
                component K(parts.S, parts.C)
            "#]],
        );
        back("library own { component K($0S, parts.C) }", expect!["not offered\n"]);
    }
}
