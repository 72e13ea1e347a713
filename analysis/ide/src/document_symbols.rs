//! The outline of a file: its declarations as a tree.

use mauve_hir::{File, ModelDb, parse};
use mauve_syntax::ast::{self, AstNode};
use mauve_syntax::{SyntaxNode, TextRange};

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
    parse(db, file).file().items().filter_map(|item| symbol_of_item(db, &item)).collect()
}

fn symbol_of_item(db: &dyn ModelDb, item: &ast::Item) -> Option<Symbol> {
    db.unwind_if_revision_cancelled();
    use SymbolKind as Kind;
    let symbol = match item {
        ast::Item::Include(_) | ast::Item::Use(_) => return None,
        ast::Item::Library(it) => named(it, it.name(), Kind::Library)
            .with("", it.items().filter_map(|item| symbol_of_item(db, &item))),
        ast::Item::Codel(it) => {
            let result = it.ty().map(|ty| format!(": {}", line(ty.syntax()))).unwrap_or_default();
            let parameters = it.param_list().map(|it| line(it.syntax())).unwrap_or_default();
            named(it, it.name(), Kind::Codel).with(&(parameters + &result), [])
        }
        ast::Item::Shell(it) => {
            let detail = it.extends().map(|it| line(it.syntax())).unwrap_or_default();
            named(it, it.name(), Kind::Shell).with(&detail, it.shell_items().map(|item| feature(db, &item)))
        }
        ast::Item::Core(it) => {
            let detail = it.ty().map(|ty| format!("for {}", line(ty.syntax()))).unwrap_or_default();
            named(it, it.name(), Kind::Core)
                .with(&detail, it.core_items().flat_map(|item| of_core(db, &item)))
        }
        ast::Item::Component(it) => {
            let parts = [it.shell(), it.core()].into_iter().flatten().map(|ty| line(ty.syntax()));
            named(it, it.name(), Kind::Component).with(&parts.collect::<Vec<_>>().join(", "), [])
        }
        ast::Item::Architecture(it) => {
            let instances = it.syntax().children().filter_map(ast::Instance::cast).map(|it| {
                db.unwind_if_revision_cancelled();
                named(&it, it.name(), Kind::Instance).with(&typed(it.ty()), [])
            });
            named(it, it.name(), Kind::Architecture).with("", instances)
        }
        ast::Item::Deployment(it) => {
            let activities = it.syntax().children().filter_map(ast::Activity::cast).map(|it| {
                db.unwind_if_revision_cancelled();
                let fields: Vec<String> = it.fields().map(|field| line(field.syntax())).collect();
                let name = it.name_ref().map(|name| name.syntax().clone());
                symbol(it.syntax(), name, Kind::Activity).with(&fields.join(" "), [])
            });
            let target = it.target().and_then(|target| target.ty());
            let detail = target.map(|ty| format!("of {}", line(ty.syntax()))).unwrap_or_default();
            named(it, it.name(), Kind::Deployment).with(&detail, activities)
        }
    };
    Some(symbol)
}

fn feature(db: &dyn ModelDb, item: &ast::ShellItem) -> Symbol {
    db.unwind_if_revision_cancelled();
    match item {
        ast::ShellItem::Property(it) => {
            let is_constant = it.constant_token().is_some();
            let kind = if is_constant { SymbolKind::Constant } else { SymbolKind::Property };
            named(it, it.name(), kind).with(&typed(it.ty()), [])
        }
        ast::ShellItem::Port(it) => {
            let direction = if it.input_token().is_some() { "input" } else { "output" };
            named(it, it.name(), SymbolKind::Port).with(&format!("{direction} {}", typed(it.ty())), [])
        }
        ast::ShellItem::OperationDeclaration(it) => {
            let direction = if it.require_token().is_some() { "required" } else { "provided" };
            named(it, it.name(), SymbolKind::Operation).with(direction, [])
        }
    }
}

fn of_core(db: &dyn ModelDb, item: &ast::CoreItem) -> Vec<Symbol> {
    db.unwind_if_revision_cancelled();
    match item {
        ast::CoreItem::Var(it) => vec![variable(it)],
        ast::CoreItem::Handler(it) => {
            vec![named(it, it.name(), SymbolKind::Handler).with(&typed(it.ty()), [])]
        }
        ast::CoreItem::OperationDefinition(it) => vec![named(it, it.name(), SymbolKind::Operation)],
        ast::CoreItem::Hook(it) => {
            let mut hook = symbol(it.syntax(), None, SymbolKind::Hook);
            if let Some(keyword) = it.keyword() {
                (hook.name, hook.name_range) = (keyword.text().to_owned(), keyword.text_range());
            }
            vec![hook]
        }
        ast::CoreItem::StateMachine(it) => it
            .state_machine_items()
            .map(|item| match item {
                ast::StateMachineItem::Var(it) => variable(&it),
                ast::StateMachineItem::State(it) => {
                    db.unwind_if_revision_cancelled();
                    let transitions = it.syntax().children().filter_map(ast::Transition::cast).map(|it| {
                        let to = it.name_ref().map(|to| format!("to {}", to.syntax().text()));
                        named(&it, it.name(), SymbolKind::Transition).with(&to.unwrap_or_default(), [])
                    });
                    let initial = if it.initial_token().is_some() { "initial" } else { "" };
                    named(&it, it.name(), SymbolKind::State).with(initial, transitions)
                }
            })
            .collect(),
    }
}

fn variable(it: &ast::Var) -> Symbol {
    named(it, it.name(), SymbolKind::Variable).with(&typed(it.ty()), [])
}

fn typed(ty: Option<ast::Type>) -> String {
    ty.map(|ty| line(ty.syntax())).unwrap_or_default()
}

fn named(node: &impl AstNode, name: Option<ast::Name>, kind: SymbolKind) -> Symbol {
    symbol(node.syntax(), name.map(|name| name.syntax().clone()), kind)
}

fn symbol(node: &SyntaxNode, name: Option<SyntaxNode>, kind: SymbolKind) -> Symbol {
    let range = node.text_range();
    let name_range = name.as_ref().map_or(TextRange::empty(range.start()), SyntaxNode::text_range);
    let name = name.map(|name| name.text().to_string()).unwrap_or_default();
    Symbol { name, detail: String::new(), kind, range, name_range, children: Vec::new() }
}

impl Symbol {
    fn with(mut self, detail: &str, children: impl IntoIterator<Item = Symbol>) -> Symbol {
        self.detail = detail.trim().to_owned();
        self.children = children.into_iter().collect();
        self
    }
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
