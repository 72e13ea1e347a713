//! Creates a core for a shell, or a component for a core and its shell.

use mauve_hir::item_tree::{FeatureKind, Kind};
use mauve_hir::{
    Decl, File, ModelDb, Project, core_of, declaration_at, features_of, names_of, operation_skeleton,
    shell_of,
};
use mauve_syntax::ast::{self, AstNode};
use mauve_syntax::{SyntaxKind, SyntaxNode, is_whole};

use super::program::free_name;
use super::{Actions, indentation, put};
use crate::Change;

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    offer_in_header(actions, "Create a core for this shell", core_for);
    offer_in_header(actions, "Create a component of this core and its shell", component_of);
}

/// Returns the text of another declaration for a declaration, and for its node.
type Skeleton<N> = fn(&dyn ModelDb, Project<'_>, Decl<'_>, &N) -> Option<String>;

/// Offers a skeleton behind a declaration, if the selection is in its header, not in its block.
fn offer_in_header<N: AstNode>(actions: &mut Actions<'_, '_>, title: &str, skeleton: Skeleton<N>) {
    let (db, file) = (actions.db, actions.question.file);
    let Some(node) = actions.node::<N>().filter(|it| is_whole(it.syntax())) else { return };
    let brace = node.syntax().children_with_tokens().find(|it| it.kind() == SyntaxKind::L_CURLY);
    if brace.is_some_and(|brace| actions.selected().start() > brace.text_range().start()) {
        return;
    }
    actions.refactor(title, |project| {
        let decl = declaration_at(db, file, node.syntax().text_range());
        let decl = decl.filter(|it| !it.name(db).is_empty())?;
        Some(Ok(behind(db, file, node.syntax(), &skeleton(db, project, decl, &node)?)))
    });
}

fn core_for(db: &dyn ModelDb, project: Project<'_>, decl: Decl<'_>, _: &ast::Shell) -> Option<String> {
    let features = features_of(db, project, decl);
    if features.completeness.is_incomplete() || features.cycle {
        return None;
    }
    let name = name_for(db, project, decl, Kind::Core, "Shell", "Core");
    let mut text = format!("core {name}({}) {{\n", decl.name(db));
    for (name, features) in &features.by_name {
        let provided = features.first().filter(|it| it.kind == FeatureKind::Provided);
        if let Some(data) = provided.and_then(|it| it.data(db)) {
            for line in operation_skeleton(name, data)?.lines() {
                text += &format!("  {line}\n");
            }
            text += "\n";
        }
    }
    text += "  update = {\n  }\n}";
    Some(text)
}

fn component_of(db: &dyn ModelDb, project: Project<'_>, decl: Decl<'_>, core: &ast::Core) -> Option<String> {
    shell_of(db, project, decl)?;
    let mut components = names_of(db, project).of_kind(db, Kind::Component);
    if components.any(|it| core_of(db, project, it) == Some(decl)) {
        return None;
    }
    let name = name_for(db, project, decl, Kind::Component, "Core", "");
    let shell = core.ty()?.syntax().text().to_string();
    Some(format!("component {name}({shell}, {})", decl.name(db)))
}

/// Returns a free name for a declaration of that kind: the name of `of` with another ending, or with a number.
fn name_for(
    db: &dyn ModelDb,
    project: Project<'_>,
    of: Decl<'_>,
    kind: Kind,
    ending: &str,
    other: &str,
) -> String {
    let name = of.name(db).as_str();
    let stem = name.strip_suffix(ending).filter(|stem| !stem.is_empty()).unwrap_or(name);
    let (names, library) = (names_of(db, project), of.library(db).as_ref());
    free_name(&format!("{stem}{other}"), |name| names.in_library(library, kind, &name.into()).is_empty())
}

fn behind(db: &dyn ModelDb, file: File, node: &SyntaxNode, declaration: &str) -> Change {
    let indent = indentation(file.text(db), node.text_range().start());
    let lines = declaration.lines().map(|line| match line {
        "" => "\n".to_owned(),
        line => format!("\n{indent}{line}"),
    });
    let text = format!("\n{}", lines.collect::<String>());
    put(file, node.text_range().end(), text)
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    #[test]
    fn a_core_defines_what_the_shell_and_its_bases_provide() {
        check(
            "include \"base.mal\"\nlibrary l {\n  use base\n  shell $0LaserShell extends Base {\n    provide scan(in at: int, out n: double): Scan\n    require stop(): void\n  }\n  core LaserCore(Other) { }\n}\n\
             //- /base.mal\nlibrary base { shell Base { provide reset(): bool  provide halt(): void } }\n",
            "Create a core",
            expect![[r#"
                --- /model.mal

                  core LaserCore2(LaserShell) {
                    provide halt(): void = {
                    }

                    provide reset(): bool = {
                      return false;
                    }

                    provide scan(at: int, out n: double): Scan = {
                      var result: Scan;
                      return result;
                    }

                    update = {
                    }
                  }
            "#]],
        );
        check(
            "shell S$0 { provide f(: int }",
            "Create a core",
            expect![[r#"
            not offered
        "#]],
        );
        check(
            "shell S { $0provide f(): int }",
            "Create a core",
            expect![[r#"
            not offered
        "#]],
        );
    }

    #[test]
    fn a_component_where_there_is_none() {
        check(
            "shell S { }\n/* 🦀 é */ core $0LaserCore(S) { update = { } }\ncodel f(): int\n",
            "Create a component",
            expect![[r#"
                --- /model.mal

                component Laser(S, LaserCore)
            "#]],
        );
        check(
            "shell S { }\ncore $0C(S) { update = { } }\ncomponent K(S, C)",
            "Create a component",
            expect![[r#"
            not offered
        "#]],
        );
        check(
            "core $0C(S) { update = { } }",
            "Create a component",
            expect![[r#"
            not offered
        "#]],
        );
    }
}
