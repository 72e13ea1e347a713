//! Extracts the selected expression into a variable, declared directly before its statement.
//!
//! ```text
//! drive(plan(goal), speed);   →   var planned: Path = plan(goal);
//!                                 drive(planned, speed);
//! ```
//!
//! The order of execution stays the same: the statement must execute the expression first.

use mauve_syntax::TextRange;
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;

use super::program::{Programs, bare, statement_of};
use super::{ActionKind, Actions, indentation};
use crate::Change;

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    if !actions.wants(ActionKind::Extract) || actions.selected().is_empty() {
        return;
    }
    let (db, file, selected) = (actions.db, actions.question.file, actions.selected());
    let (Some(core), Some(expr)) = (actions.node::<ast::Core>(), actions.node::<ast::Expr>()) else { return };
    if expr.syntax().text_range() != selected {
        return;
    }
    // A name or a number needs no variable.
    let is_worth_it = matches!(
        bare(&expr),
        Some(ast::Expr::CallExpr(_) | ast::Expr::BinaryExpr(_) | ast::Expr::UnaryExpr(_))
    );
    // Nor does a call that is a statement.
    let is_statement = expr.syntax().parent().is_some_and(|it| ast::ExprStatement::can_cast(it.kind()));
    let reads = expr.syntax().descendants().any(|it| ast::NameRef::can_cast(it.kind()));
    let Some(statement) = statement_of(expr.syntax()).filter(|_| is_worth_it && reads && !is_statement)
    else {
        return;
    };
    actions.refactor(ActionKind::Extract, "Extract a variable", |project| {
        let programs = Programs::of(db, project, file, &core)?;
        let ty = programs.written_type(&expr)?;
        if !programs.comes_first(&statement, &expr) {
            return Some(Err(
                "the statement executes other code before this expression, or executes it only in some cases"
                    .to_owned(),
            ));
        }
        let text = file.text(db);
        let range = statement.text_range();
        let wanted = match bare(&expr)? {
            ast::Expr::CallExpr(call) => format!("{}_result", call.name_ref()?.syntax().text()),
            _ => "value".to_owned(),
        };
        let name = programs.fresh(&core, &wanted);
        let value = text.get(std::ops::Range::<usize>::from(selected))?;
        let begins_line = text.get(..usize::from(range.start()))?.rsplit('\n').next()?.trim().is_empty();
        let gap =
            if begins_line { format!("\n{}", indentation(text, range.start())) } else { " ".to_owned() };
        let declaration = format!("var {name}: {ty} = {value};{gap}");
        let declaration = Replacement { range: TextRange::empty(range.start()), text: declaration };
        Change::of(file, [declaration, Replacement { range: selected, text: name }]).map(Ok)
    });
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    const PARTS: &str = "
codel plan(in goal: int): int
codel next(out goal: int): int
codel is_far(in goal: int): bool
codel drive(in way: int, in speed: double): void
shell S { output port way: int property limit: double = 1.0 }
";

    fn extracted(update: &str, expected: expect_test::Expect) {
        let core = format!("core C(S) {{\n  var goal: int = 0;\n  update = {{\n    {update}\n  }}\n}}\n");
        check(&format!("{PARTS}{core}"), "Extract a variable", expected);
    }

    #[test]
    fn a_call_and_a_calculation() {
        extracted(
            "/* 🦀 é */ drive($0plan(goal)$0, limit);",
            expect![[r#"
                --- /model.mal
                    /* 🦀 é */ var plan_result: int = plan(goal); drive(plan_result, limit);
            "#]],
        );
        extracted(
            "// To the goal.\n    drive(goal, $0(limit * 2)$0 + 1);",
            expect![[r#"
                --- /model.mal
                    var value: double = (limit * 2);
                    drive(goal, value + 1);
            "#]],
        );
        extracted(
            "if $0is_far(goal)$0 then { drive(goal, limit); } else { }",
            expect![[r#"
                --- /model.mal
                    var is_far_result: bool = is_far(goal);
                    if is_far_result then { drive(goal, limit); } else { }
            "#]],
        );
    }

    #[test]
    fn not_where_something_else_is_executed_before() {
        for update in [
            "drive(next(goal), $0limit * goal$0);",
            "goal = goal + $0next(goal)$0;",
            "if goal > 3 && $0is_far(goal)$0 then { } else { }",
        ] {
            extracted(
                update,
                expect![[r#"
                    refused: the statement executes other code before this expression, or executes it only in some cases
                "#]],
            );
        }
        // Nor where no variable can be.
        extracted(
            "if goal > 3 then { } else if $0is_far(goal)$0 then { } else { }",
            expect!["not offered\n"],
        );
        extracted("write(way, plan(goal)$0)$0;", expect!["not offered\n"]);
        extracted("goal = $0plna(goal)$0;", expect!["not offered\n"]);
        extracted("goal = $0plan(goal)$0", expect!["not offered\n"]);
    }
}
