//! Signature help while arguments are typed.

use mauve_hir::{File, ModelDb, Project, is_model, parse};
use mauve_syntax::{TextRange, TextSize, previous_significant, tokens_at};

use crate::completion::{comment, subject};
use crate::position::{Position, call_around, is_closed_to};
use crate::program::CursorScope;

/// A signature.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CallSignature {
    /// `astar(in origin: PoseStamped, out route: Path): bool`
    pub label: String,
    /// The ranges of its parameters in the label, in bytes.
    pub parameters: Vec<TextRange>,
    /// The index of the typed parameter, from 0; out of range if there is none.
    pub active: usize,
    /// The comment above its declaration, in Markdown.
    pub documentation: Option<String>,
}

/// Returns the signature of the innermost call around `offset`.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let text = "codel f(in a: int, out b: bool): void core C(S) { update = { f(1, ".to_owned();
/// let offset = (text.len() as u32).into();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, std::path::Path::new("/a.mal")).expect("it is there");
/// let found = mauve_ide::signature_help(&db, projects(&db, workspace)[0], file, offset).unwrap();
/// assert_eq!(found.label, "f(in a: int, out b: bool): void");
/// assert_eq!(found.active, 1);
/// ```
pub fn signature_help(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    offset: TextSize,
) -> Option<CallSignature> {
    if !is_model(file.path(db)) {
        return None;
    }
    let root = parse(db, file).syntax();
    let offset = offset.min(root.text_range().end());
    let mut around = tokens_at(&root, offset).filter(|token| token.text_range().start() < offset);
    let token = around.next()?;
    if token.kind().is_comment() && is_closed_to(&token, offset) {
        return None;
    }
    let left = if token.kind().is_trivia() { previous_significant(&token) } else { Some(token) };
    let call = call_around(&left?)?;
    let at = Position::in_any_token(&root, offset);
    let decl = mauve_hir::declaration_at(db, file, call.callee.text_range());
    let callable = CursorScope::at(db, project, decl, &at).called(&call)?;
    let (label, parameters) = callable.shown();
    Some(CallSignature {
        label,
        parameters,
        active: call.index,
        documentation: subject(db, &callable).and_then(|about| comment(db, project.workspace(db), &about)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_of};
    use expect_test::{Expect, expect};

    /// The call, with the parameter that is typed between brackets; and what is said of it.
    fn shown(statements: &str) -> String {
        let text = format!(
            "
library a {{
  use std_msgs
  // Is it near?
  codel near(in scan: Float32, in far: double): bool
  shell S {{
    // The laser.
    input port scan: Float32
    output port out: Float32
    require ask(in what: int, out found: bool): int
    provide go(in to: int): bool
  }}
  core C(S) {{
    var echo: Float32;
    handler asking: ask
    provide go(in to: int): bool = {{ return true; }}
    update = {{ {statements}"
        );
        let Fixture { db, workspace, file, offset } = Fixture::new(&text);
        let show = |signature: &CallSignature| {
            let label = &signature.label;
            let active = signature.parameters.get(signature.active);
            let shown = active.map_or(label.clone(), |active| {
                let (start, end) = (usize::from(active.start()), usize::from(active.end()));
                format!("{}⟨{}⟩{}", &label[..start], &label[start..end], &label[end..])
            });
            format!("{shown}\n{}", signature.documentation.as_deref().unwrap_or_default())
        };
        signature_help(&db, project_of(&db, workspace, file), file, offset).iter().map(show).collect()
    }

    fn check(statements: &str, expected: Expect) {
        expected.assert_eq(&shown(statements));
    }

    /// The signature that is shown for the call at the cursor.
    fn first(text: &str) -> String {
        let Fixture { db, workspace, file, offset } = Fixture::new(text);
        let found = signature_help(&db, project_of(&db, workspace, file), file, offset);
        found.map_or_else(|| "none".to_owned(), |signature| signature.label)
    }

    #[test]
    fn what_a_check_means_is_meant_here_too() {
        // The codel is in a library that is not used: the function is built in.
        let text = "
library far { codel read(in blocks: int): int }
library near {
  shell S { input port p: int }
  core C(S) { var x: int = 0  update = { read(p, x$0); } }
}";
        assert_eq!(first(text), "read(p: input port int, out variable: int): port status");
        // A variable hides the operation, and cannot be called.
        let text = "
shell S { provide park(): int }
core C(S) { var park: int = 0  provide park(): int = { return 1; }  update = { park($0); } }";
        assert_eq!(first(text), "none");
    }

    #[test]
    fn a_codel_and_which_argument_is_typed() {
        check(
            "if (near($0",
            expect![[r#"
                near(⟨in scan: Float32⟩, in far: double): bool
                Is it near?
            "#]],
        );
        check(
            "if (near(echo, $0)) then {} else {} } } }",
            expect![[r#"
                near(in scan: Float32, ⟨in far: double⟩): bool
                Is it near?
            "#]],
        );
        // Only commas of this call count, in brackets and out of them.
        check(
            "near((f(1, 2)), 3$0",
            expect![[r#"
                near(in scan: Float32, ⟨in far: double⟩): bool
                Is it near?
            "#]],
        );
        check(
            "near(/* 🦀, é, */ echo,\n\n $0 1.0); } } }",
            expect![[r#"
                near(in scan: Float32, ⟨in far: double⟩): bool
                Is it near?
            "#]],
        );
    }

    #[test]
    fn an_operation_of_the_core() {
        check(
            "go($0); } } }",
            expect![[r#"
                go(⟨in to: int⟩): bool
            "#]],
        );
    }

    #[test]
    fn what_the_language_has_takes_the_type_of_its_port() {
        check(
            "read($0",
            expect![[r#"
            read(⟨input port⟩, out variable): port status
        "#]],
        );
        check(
            "read(scan, $0",
            expect![[r#"
                read(scan: input port Float32, ⟨out variable: Float32⟩): port status
                The laser.
            "#]],
        );
        check(
            "write(out, $0); } } }",
            expect![[r#"
                write(out: output port Float32, ⟨value: Float32⟩): void
            "#]],
        );
        check(
            "status($0",
            expect![[r#"
            status(⟨input port⟩): port status
        "#]],
        );
        check(
            "asking = send(ask, $0",
            expect![[r#"
                send(ask: required operation, ⟨in what: int⟩): handler
            "#]],
        );
        check(
            "collect(asking, $0",
            expect![[r#"
                collect(asking: handler of ask, ⟨out result: int⟩, out found: bool): call status
            "#]],
        );
    }

    #[test]
    fn where_no_argument_is_typed() {
        for statements in
            ["near(echo, 1.0)$0;", "near$0(", "if ($0", "near(echo); $0", "near(echo // , $0", "unknown($0"]
        {
            assert_eq!(shown(statements), "", "{statements}");
        }
    }
}
