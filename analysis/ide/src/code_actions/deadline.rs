//! Adds the default deadline of an activity, or removes a deadline that equals the period.

use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::keywords::{ActivityField, BACKGROUND};
use mauve_syntax::{has_comment, is_whole};
use mauve_timing::{Rounding, Time, Unit};

use super::{ActionKind, Actions, put, with_line};
use crate::Change;

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    let (db, file) = (actions.db, actions.question.file);
    let Some(activity) = actions.node::<ast::Activity>().filter(|it| is_whole(it.syntax())) else { return };
    let of = |field: ActivityField| {
        let mut all = activity.fields().filter(|it| it.field() == Some(field));
        all.next().filter(|_| all.next().is_none())
    };
    let value = |field: &ast::Field| Some(field.expr()?.syntax().text().to_string());
    let Some(period) = of(ActivityField::Period) else { return };
    let Some(text) = value(&period) else { return };
    let is_background =
        of(ActivityField::Priority).and_then(|it| value(&it)).is_some_and(|it| it == BACKGROUND);
    let has_deadline = activity.fields().any(|it| it.field() == Some(ActivityField::Deadline));
    let is_time = || Time::parse(&text, Unit::Milliseconds, Rounding::Exact).is_ok_and(|it| it > Time::ZERO);
    if !has_deadline && !is_background && is_time() {
        actions.offer(ActionKind::Rewrite, format!("Add `deadline = {text}`"), || {
            put(file, period.syntax().text_range().end(), format!(" deadline = {text}"))
        });
    }
    let same = of(ActivityField::Deadline)
        .filter(|it| value(it).is_some_and(|it| it == text) && !has_comment(it.syntax()));
    if let Some(deadline) = same {
        actions.offer(ActionKind::Rewrite, "Remove the deadline: it equals the period", || {
            let mut range = deadline.syntax().text_range();
            let rest = file.text(db).get(usize::from(range.end())..).unwrap_or_default();
            if rest.starts_with(';') {
                range = range.cover_offset(range.end() + mauve_syntax::TextSize::of(';'));
            }
            Change::of(file, [Replacement { range: with_line(file.text(db), range), text: String::new() }])
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    #[test]
    fn written_and_left_out() {
        let written = "Add `deadline";
        check(
            "deployment D { activity $0a { period = 2.5; priority = 1 } }",
            written,
            expect![[r#"
            --- /model.mal
            deployment D { activity a { period = 2.5 deadline = 2.5; priority = 1 } }
        "#]],
        );
        check(
            "deployment D { activity $0a { period = 2.5; priority = background } }",
            written,
            expect![[r#"
            not offered
        "#]],
        );
        check(
            "deployment D { activity $0a { period = 0; priority = 1 } }",
            written,
            expect![[r#"
            not offered
        "#]],
        );
        check(
            "deployment D { activity $0a { period = ; priority = 1 } }",
            written,
            expect![[r#"
            not offered
        "#]],
        );
        let left_out = "Remove the deadline";
        check(
            "deployment D {\n  activity $0a {\n    period = 10\n    deadline = 10;\n    priority = 1\n  }\n}\n",
            left_out,
            expect![[r#"
            --- /model.mal
        "#]],
        );
        check(
            "deployment D { activity $0a { deadline = 10 period = 10 priority = 1 } }",
            left_out,
            expect![[r#"
            --- /model.mal
            deployment D { activity a { period = 10 priority = 1 } }
        "#]],
        );
        check(
            "deployment D { activity $0a { deadline = 9 period = 10 priority = 1 } }",
            left_out,
            expect![[r#"
            not offered
        "#]],
        );
    }
}
