//! The outline of a file: its declarations as a tree.

use mauve_hir::{File, ModelDb, parse};
use mauve_syntax::SyntaxKind::*;
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{NodeOrToken, SyntaxNode, TextRange};

/// A declaration in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    /// Its name; empty if it is missing.
    pub name: String,
    /// Its type or its content as a short text; may be empty.
    pub detail: String,
    /// Its kind.
    pub kind: SymbolKind,
    /// Its full range.
    pub range: TextRange,
    /// The range of its name, or of the position where the name is missing.
    pub name_range: TextRange,
    /// The declarations in it.
    pub children: Vec<Symbol>,
}

/// The kinds of named items.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum SymbolKind {
    Library,
    Codel,
    Shell,
    Property,
    Constant,
    Port,
    Operation,
    Core,
    Variable,
    Handler,
    Hook,
    State,
    Transition,
    Component,
    Architecture,
    Instance,
    Deployment,
    Activity,
    Parameter,
    Package,
    Message,
    Type,
    File,
}

/// Returns the declarations of a file, in text order.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let text = "library robot { codel plan(): int }".to_owned();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let symbols = mauve_ide::document_symbols(&db, file);
/// assert_eq!((symbols[0].name.as_str(), symbols[0].children[0].name.as_str()), ("robot", "plan"));
/// ```
pub fn document_symbols(db: &dyn ModelDb, file: File) -> Vec<Symbol> {
    if !mauve_hir::is_model(file.path(db)) {
        return Vec::new();
    }
    symbols_in(db, parse(db, file).file().syntax())
}

/// Returns the declarations directly in `list`, those of a state machine with those of its core.
fn symbols_in(db: &dyn ModelDb, list: &SyntaxNode) -> Vec<Symbol> {
    let of_node = |node: SyntaxNode| {
        db.unwind_if_revision_cancelled();
        match node.kind() {
            STATE_MACHINE => symbols_in(db, &node),
            _ => Vec::from_iter(symbol(db, &node)),
        }
    };
    list.children().flat_map(of_node).collect()
}

fn symbol(db: &dyn ModelDb, node: &SyntaxNode) -> Option<Symbol> {
    use SymbolKind as Kind;
    let has = |token| node.children_with_tokens().any(|it| it.kind() == token);
    let either = |token, present: &str, absent: &str| if has(token) { present } else { absent }.to_owned();
    let parts = |kind| node.children().filter(move |it| it.kind() == kind).map(|it| line(&it));
    let part = |before: &str, kind| parts(kind).next().map_or_else(String::new, |it| format!("{before}{it}"));
    let (kind, detail) = match node.kind() {
        LIBRARY => (Kind::Library, String::new()),
        CODEL => (Kind::Codel, part("", PARAM_LIST) + &part(": ", TYPE)),
        SHELL => (Kind::Shell, part("", EXTENDS)),
        PROPERTY => (if has(CONSTANT_KW) { Kind::Constant } else { Kind::Property }, part("", TYPE)),
        PORT => (Kind::Port, either(INPUT_KW, "input ", "output ") + &part("", TYPE)),
        OPERATION_DECLARATION => (Kind::Operation, either(REQUIRE_KW, "required", "provided")),
        CORE => (Kind::Core, part("for ", TYPE)),
        VAR => (Kind::Variable, part("", TYPE)),
        HANDLER => (Kind::Handler, part("", TYPE)),
        OPERATION_DEFINITION => (Kind::Operation, String::new()),
        HOOK => (Kind::Hook, String::new()),
        STATE => (Kind::State, either(INITIAL_KW, "initial", "")),
        TRANSITION => (Kind::Transition, part("to ", NAME_REF)),
        COMPONENT => (Kind::Component, parts(TYPE).take(2).collect::<Vec<_>>().join(", ")),
        ARCHITECTURE => (Kind::Architecture, String::new()),
        INSTANCE => (Kind::Instance, part("", TYPE)),
        DEPLOYMENT => {
            let target = ast::Deployment::cast(node.clone())?.target().and_then(|it| it.ty());
            (Kind::Deployment, target.map(|it| format!("of {}", line(it.syntax()))).unwrap_or_default())
        }
        ACTIVITY => (Kind::Activity, parts(FIELD).collect::<Vec<_>>().join(" ")),
        _ => return None,
    };
    let name = match kind {
        Kind::Hook => ast::Hook::cast(node.clone())?.own_token().map(NodeOrToken::Token),
        // The name of an activity is that of an instance.
        Kind::Activity => node.children_with_tokens().find(|it| it.kind() == NAME_REF),
        _ => node.children_with_tokens().find(|it| it.kind() == NAME),
    };
    let range = node.text_range();
    Some(Symbol {
        name: name.as_ref().map(ToString::to_string).unwrap_or_default(),
        detail: detail.trim().to_owned(),
        kind,
        range,
        name_range: name.map_or(TextRange::empty(range.start()), |it| it.text_range()),
        children: symbols_in(db, node),
    })
}

fn line(node: &SyntaxNode) -> String {
    let text = node.text().to_string();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};

    fn check(text: &str, expected: Expect) {
        let Fixture { db, file, .. } = Fixture::new(text);
        let mut shown = String::new();
        let mut open: Vec<(usize, Symbol)> =
            document_symbols(&db, file).into_iter().rev().map(|symbol| (0, symbol)).collect();
        while let Some((depth, symbol)) = open.pop() {
            assert!(symbol.range.contains_range(symbol.name_range), "{symbol:?}");
            let detail =
                if symbol.detail.is_empty() { String::new() } else { format!(" | {}", symbol.detail) };
            shown += &format!("{}{:?} {}{detail}\n", "  ".repeat(depth), symbol.kind, symbol.name);
            open.extend(symbol.children.into_iter().rev().map(|symbol| (depth + 1, symbol)));
        }
        expected.assert_eq(&shown);
    }

    #[test]
    fn everything_that_is_declared() {
        check(
            r#"
include "other.mal"
library robot {
  use other
  codel plan(in goal: int,
    out path: int): bool
  shell S extends T { property p: int constant c: int input port i: int output port o: int require r(): int }
  core C(S) {
    var v: int;
    handler h: int
    start = { }
    statemachine { var w: int; initial state A { run = { } transition t to B } state B { } }
  }
  component P(S, C)
  architecture Arch { import Other instance one: P }
  deployment D { architecture Arch activity one { priority = 1 period = 5 } }
}
"#,
            expect![[r#"
                Library robot
                  Codel plan | (in goal: int, out path: int): bool
                  Shell S | extends T
                    Property p | int
                    Constant c | int
                    Port i | input int
                    Port o | output int
                    Operation r | required
                  Core C | for S
                    Variable v | int
                    Handler h | int
                    Hook start
                    Variable w | int
                    State A | initial
                      Transition t | to B
                    State B
                  Component P | S, C
                  Architecture Arch
                    Instance one | P
                  Deployment D | of Arch
                    Activity one | priority = 1 period = 5
            "#]],
        );
    }

    #[test]
    fn while_the_text_is_broken() {
        check(
            "library robot { codel shell S { input port } core (",
            expect![[r#"
            Library robot
              Codel shell
        "#]],
        );
    }
}
