//! Replaces the uses of a local variable by its value, and removes the variable.
//!
//! ```text
//! var planned: Path = plan(goal);   →   drive(plan(goal), speed);
//! drive(planned, speed);
//! ```
//!
//! A value with a call moves only into the next statement, if that executes it first. The operands of any other value must not
//! change in between.

use mauve_hir::{Type, VariableKind};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::{SyntaxKind, SyntaxNode, TextRange, has_comment, next_significant};

use super::program::{Programs, bare, calls, statement_of};
use super::{ActionKind, Actions, with_line};
use crate::Change;
use crate::occurrences::{Definition, FoundName, Role};

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    if !actions.wants(ActionKind::Inline) {
        return;
    }
    let (db, file) = (actions.db, actions.question.file);
    let (Some(core), Some(at)) = (actions.node::<ast::Core>(), actions.selected_name()) else { return };
    // Only blocks around the cursor can declare it, so the names of the whole core are not needed.
    let mut blocks = at.parent_ancestors().filter(|it| it.kind() == SyntaxKind::BLOCK);
    let declares = |block: SyntaxNode| {
        let mut names = block.children().filter_map(ast::Var::cast).filter_map(|it| it.name());
        names.any(|name| name.syntax().text() == at.text())
    };
    if !blocks.any(declares) {
        return;
    }
    let title = format!("Inline `{}`", at.text());
    let range = at.text_range();
    actions.refactor(ActionKind::Inline, title, |project| {
        let programs = Programs::of(db, project, file, &core)?;
        let definition = programs.names_in(range).next()?.definition.clone();
        let variable = declaration(&core, &programs, &definition)?;
        let edits = inlined(file.text(db), &programs, &variable, &definition);
        edits.map(|edits| Change::of(file, edits)).transpose()
    });
}

fn declaration(core: &ast::Core, programs: &Programs<'_>, definition: &Definition<'_>) -> Option<ast::Var> {
    let Definition::At(place) = definition else { return None };
    let range = place.range(programs.db);
    let of_core = core.syntax().text_range().contains_range(range);
    let variable = core
        .syntax()
        .descendants()
        .filter_map(ast::Var::cast)
        .filter(|_| of_core)
        .find(|it| it.name().is_some_and(|name| name.syntax().text_range() == range))?;
    let is_local = variable.syntax().parent()?.kind() == SyntaxKind::BLOCK;
    (is_local && variable.initializer().is_some()).then_some(variable)
}

fn inlined<'db>(
    text: &str,
    programs: &Programs<'db>,
    variable: &ast::Var,
    definition: &Definition<'db>,
) -> Result<Vec<Replacement>, String> {
    let node = variable.syntax();
    let name = variable.name().ok_or_else(incomplete)?.syntax().text_range();
    let value = variable.initializer().and_then(|it| it.expr()).ok_or_else(incomplete)?;
    let inner = bare(&value).ok_or_else(incomplete)?;
    let block = node.parent().ok_or_else(incomplete)?;
    if has_comment(node) {
        return Err("a comment in its declaration would be removed".to_owned());
    }
    let uses: Vec<&FoundName<'_>> =
        programs.names().iter().filter(|it| it.definition == *definition && it.range != name).collect();
    if uses.is_empty() {
        return Err("the variable is never read".to_owned());
    }
    if uses.iter().any(|it| it.role != Role::Read) {
        return Err("the variable is assigned later".to_owned());
    }
    // `var half: double = 1 / 2` is 0.0, and inlined `1 / 2 / 2` would be another division.
    let declared = programs.variable(definition).filter(|it| it.kind == VariableKind::Local);
    let declared = declared.map(|it| &it.ty);
    if declared.is_none() || declared == Some(&Type::Unknown) || programs.type_of(&inner) != declared {
        return Err("its value is converted to another type".to_owned());
    }
    if matches!(inner, ast::Expr::CallExpr(_)) || calls(inner.syntax()).next().is_some() {
        check_call(programs, node, &inner, &uses)?;
    }
    check_operands(text, programs, node, &value)?;
    let shown = &text[inner.syntax().text_range()];
    let mut edits = vec![Replacement { range: with_line(text, with_semicolon(node)), text: String::new() }];
    for it in uses {
        let place = expression_at(&block, it.range).ok_or_else(incomplete)?;
        let is_operand = place
            .syntax()
            .parent()
            .is_some_and(|parent| matches!(parent.kind(), SyntaxKind::BINARY_EXPR | SyntaxKind::UNARY_EXPR));
        let needs_brackets =
            is_operand && matches!(inner, ast::Expr::BinaryExpr(_) | ast::Expr::UnaryExpr(_));
        let text = if needs_brackets { format!("({shown})") } else { shown.to_owned() };
        edits.push(Replacement { range: it.range, text });
    }
    Ok(edits)
}

fn incomplete() -> String {
    "the statement is incomplete".to_owned()
}

/// Checks that a value with a call is executed first in the next statement.
fn check_call(
    programs: &Programs<'_>,
    node: &SyntaxNode,
    inner: &ast::Expr,
    uses: &[&FoundName<'_>],
) -> Result<(), String> {
    let next = std::iter::successors(node.next_sibling(), SyntaxNode::next_sibling)
        .find(|it| ast::Statement::can_cast(it.kind()));
    let next = next.ok_or_else(incomplete)?;
    let [only] = uses else {
        return Err("its value contains a call, and the variable is read several times".to_owned());
    };
    let place = node.parent().and_then(|block| expression_at(&block, only.range)).ok_or_else(incomplete)?;
    let may_be_put_there = statement_of(place.syntax()).as_ref() == Some(&next)
        && programs.comes_first(&next, &place)
        && !programs.changes_beside(inner.syntax(), next.text_range(), only.range);
    if !may_be_put_there {
        return Err(
            "its value contains a call, and other code is executed between the declaration and the use"
                .to_owned(),
        );
    }
    Ok(())
}

/// Checks that the operands of the value have the same values wherever the variable is read: they are neither assigned in the
/// block nor hidden.
fn check_operands<'db>(
    text: &str,
    programs: &Programs<'db>,
    node: &SyntaxNode,
    value: &ast::Expr,
) -> Result<(), String> {
    let block = node.parent().ok_or_else(incomplete)?;
    let operands: Vec<&FoundName<'_>> = programs.names_in(value.syntax().text_range()).collect();
    let is_here = |it: &&&FoundName<'_>| {
        block.text_range().contains_range(it.range) && it.range.start() > node.text_range().end()
    };
    let later = || programs.names().iter().filter(|it| is_here(&it));
    for operand in &operands {
        let changes = |it: &FoundName<'_>| !matches!(it.role, Role::Read | Role::Call | Role::Mention);
        if later().any(|it| it.definition == operand.definition && changes(it)) {
            return Err(format!(
                "`{}` is assigned between the declaration and the use",
                &text[operand.range]
            ));
        }
        if later().any(|it| it.role == Role::Declaration && text[it.range] == text[operand.range]) {
            return Err(format!(
                "another `{}` is declared between the declaration and the use",
                &text[operand.range]
            ));
        }
    }
    let calls_own = block.children().filter(|it| it.text_range().start() > node.text_range().end());
    if operands.iter().any(|it| it.role == Role::Read)
        && calls_own.into_iter().any(|it| programs.calls_own_operation(&it))
    {
        let is_local = |it: &&FoundName<'db>| {
            let kind = programs.variable(&it.definition).map(|it| it.kind);
            matches!(kind, Some(VariableKind::Local | VariableKind::Parameter(_)))
        };
        if operands.iter().filter(|it| it.role == Role::Read).any(|it| !is_local(it)) {
            return Err(
                "an operation that is called in between may change the operands of its value".to_owned()
            );
        }
    }
    Ok(())
}

fn expression_at(block: &SyntaxNode, range: TextRange) -> Option<ast::Expr> {
    block
        .descendants()
        .filter_map(ast::NameExpr::cast)
        .find(|it| it.syntax().text_range() == range)
        .map(ast::Expr::NameExpr)
}

fn with_semicolon(node: &SyntaxNode) -> TextRange {
    match node.last_token().and_then(|last| next_significant(&last)) {
        Some(sign) if sign.kind() == SyntaxKind::SEMICOLON => node.text_range().cover(sign.text_range()),
        _ => node.text_range(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::{Expect, expect};

    fn inlined(update: &str, expected: Expect) {
        let parts = "codel plan(in goal: int): int\ncodel next(out goal: int): int\ncodel drive(in way: int, in speed: int): void\n\
                     shell S { property limit: int = 1 provide reset(): void }\n";
        let core = format!(
            "core C(S) {{\n  var goal: int = 0\n  provide reset() = {{ goal = 0; }}\n  update = {{\n    {update}\n  }}\n}}\n"
        );
        check(&format!("{parts}{core}"), "Inline ", expected);
    }

    #[test]
    fn a_calculation_wherever_it_is_read() {
        inlined(
            "var $0n: int = goal + limit;\n    drive(n, n * 2);",
            expect![[r#"
                --- /model.mal
                    drive(goal + limit, (goal + limit) * 2);
            "#]],
        );
        inlined(
            "/* 🦀 é */ var n: int = limit; drive($0n, 1);",
            expect![[r#"
                --- /model.mal
                    /* 🦀 é */ drive(limit, 1);
            "#]],
        );
    }

    #[test]
    fn a_call_where_it_is_executed_next() {
        inlined(
            "var $0n: int = plan(goal);\n    drive(n, limit);",
            expect![[r#"
                --- /model.mal
                    drive(plan(goal), limit);
            "#]],
        );
        for update in [
            "var $0n: int = plan(goal);\n    goal = 2;\n    drive(n, limit);",
            "var $0n: int = plan(goal);\n    drive(next(goal), n);",
            "var $0n: int = next(goal);\n    drive(goal, n);",
        ] {
            inlined(
                update,
                expect![[r#"
                    refused: its value contains a call, and other code is executed between the declaration and the use
                "#]],
            );
        }
    }

    #[test]
    fn not_what_is_another_value_by_then() {
        inlined(
            "var $0n: int = goal; goal = 2; drive(n, 1);",
            expect![[r#"
                refused: `goal` is assigned between the declaration and the use
            "#]],
        );
        inlined(
            "var $0n: int = goal; reset(); drive(n, 1);",
            expect![[r#"
                refused: an operation that is called in between may change the operands of its value
            "#]],
        );
        inlined(
            "var $0n: int = goal; { var goal: int = 3; drive(n, goal); }",
            expect![[r#"
                refused: another `goal` is declared between the declaration and the use
            "#]],
        );
        inlined(
            "var $0n: int = goal; n = 3; drive(n, 1);",
            expect![[r#"
                refused: the variable is assigned later
            "#]],
        );
        inlined(
            "var $0n: double = goal; if n / 2 > 1 then { } else { }",
            expect![[r#"
            refused: its value is converted to another type
        "#]],
        );
        inlined(
            "var $0n: int = /* now */ goal; drive(n, 1);",
            expect![[r#"
                refused: a comment in its declaration would be removed
            "#]],
        );
        inlined("var $0n: int = goal; drive(n, );", expect!["not offered\n"]);
        inlined("var $0n: int; drive(n, 1);", expect!["not offered\n"]);
    }
}
