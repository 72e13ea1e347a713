//! The documentation of a selected item: its declaration and the comment above it, or the fields of a message.
//!
//! An item is identified by names, not by a position: the user may type while the list is open.

use std::path::PathBuf;

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, ModelDb, Workspace, declarations, node_around, package, source_map};
use mauve_syntax::SyntaxKind::*;
use mauve_syntax::SyntaxNode;
use serde::{Deserialize, Serialize};

use crate::hover::{fields, head_and_comment, shown};
use crate::program::Callable;

/// The subject of an item's documentation.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
pub enum Subject {
    /// A declaration, or a member of one.
    Declaration {
        /// The file of the declaration.
        path: PathBuf,
        /// Its kind.
        kind: Kind,
        /// Its library.
        library: Option<Name>,
        /// Its name.
        name: Name,
        /// The feature, state or instance in it; none for the declaration itself.
        member: Option<Name>,
    },
    /// A message.
    Message {
        /// Its package.
        package: Name,
        /// Its name in the package.
        name: Name,
    },
}

impl Subject {
    pub(crate) fn of(db: &dyn ModelDb, decl: Decl<'_>, member: Option<Name>) -> Subject {
        Subject::Declaration {
            path: decl.file(db).path(db).clone(),
            kind: decl.kind(db),
            library: decl.library(db).clone(),
            name: decl.name(db).clone(),
            member,
        }
    }
}

pub(crate) fn subject<'db>(db: &'db dyn ModelDb, callable: &Callable<'db>) -> Option<Subject> {
    callable.declared.as_ref().map(|(decl, member)| Subject::of(db, *decl, member.clone()))
}

/// Returns the documentation in Markdown, from the present declaration; none if the declaration no longer exists.
pub fn documentation(db: &dyn ModelDb, workspace: Workspace, subject: &Subject) -> Option<String> {
    match subject {
        Subject::Message { package: of, name } => {
            let package = package(db, workspace, of)?;
            Some(fields(package, name, package.messages.get(name)?))
        }
        Subject::Declaration { .. } => Some(shown(&node_of(db, workspace, subject)?)),
    }
}

/// Returns the comment above a declaration in Markdown; none if there is none.
pub(crate) fn comment(db: &dyn ModelDb, workspace: Workspace, subject: &Subject) -> Option<String> {
    let (_, comment) = head_and_comment(&node_of(db, workspace, subject)?);
    (!comment.is_empty()).then_some(comment)
}

fn node_of(db: &dyn ModelDb, workspace: Workspace, subject: &Subject) -> Option<SyntaxNode> {
    let Subject::Declaration { path, kind, library, name, member } = subject else { return None };
    let file = workspace.file(db, path)?;
    let maps = &source_map(db, file).declarations;
    let is_it =
        |decl: &Decl<'_>| decl.kind(db) == *kind && decl.library(db) == library && decl.name(db) == name;
    let mut found = declarations(db, file).all.iter().zip(maps);
    let (_, map) = found.find(|(decl, _)| is_it(decl))?;
    let all = node_around(db, file, map.range)?;
    match member {
        Some(member) => member_of(&all, member),
        None => Some(all),
    }
}

fn member_of(of: &SyntaxNode, name: &str) -> Option<SyntaxNode> {
    let names = of.descendants().filter(|node| node.kind() == NAME && node.text() == name);
    let parents = names.filter_map(|node| node.parent());
    let mut members =
        parents.filter(|parent| !matches!(parent.kind(), PARAM | TRANSITION | VAR) && parent != of);
    members.next()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::completion::completions;
    use crate::fixture::{Fixture, project_of};
    use expect_test::{Expect, expect};

    fn check(fixture: &str, label: &str, expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let found = completions(&db, project_of(&db, workspace, file), file, offset);
        let item = found.items.iter().find(|item| item.label == label).unwrap();
        let found = item.subject.as_ref().and_then(|subject| documentation(&db, workspace, subject));
        expected.assert_eq(&found.unwrap_or_default());
    }

    #[test]
    fn a_declaration_says_how_it_is_declared_and_the_comment_above_it() {
        check(
            "// Finds a way.\ncodel plan(in goal: int): bool\nshell S {} core C(S) { update = { $0 } }",
            "plan",
            expect![[r#"
                ```mauve
                codel plan(in goal: int): bool
                ```

                Finds a way.
            "#]],
        );
    }

    #[test]
    fn a_feature_says_what_its_shell_says_of_it() {
        let text = "shell S {\n  // In metres.\n  property reach: double [0; 1] = 0.5\n}\ncore C(S) { update = { f($0); } }";
        check(
            text,
            "reach",
            expect![[r#"
            ```mauve
            property reach: double [0; 1] = 0.5
            ```

            In metres.
        "#]],
        );
    }

    #[test]
    fn a_comment_is_no_more_than_a_comment() {
        check(
            "// ![x](https://e.org/x.png)\n// ```\ncodel plan(in goal: int): bool\nshell S {} core C(S) { update = { $0 } }",
            "plan",
            expect![[r#"
                ```mauve
                codel plan(in goal: int): bool
                ```

                ![x]\(https://e.org/x.png)
                ```

                ```
            "#]],
        );
    }

    #[test]
    fn a_message_says_its_fields() {
        check(
            "codel f(in a: geometry_msgs.$0): int",
            "Point",
            expect![[r#"
                ```msg
                # geometry_msgs/Point
                float64 x
                float64 y
                float64 z
                ```

                built-in definition: the package is not installed on this machine
            "#]],
        );
    }
}
