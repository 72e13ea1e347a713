//! The fields of an activity in the usual order: priority, period, deadline, affinity.

use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;

use super::{ActionKind, Actions};
use crate::Change;

const ORDER: [&str; 4] = ["priority", "period", "deadline", "affinity"];

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    let (file, activity) = (actions.question.file, actions.node::<ast::Activity>());
    let Some(activity) = activity.filter(|it| mauve_syntax::is_whole(it.syntax())) else { return };
    let fields: Vec<ast::Field> = activity.fields().collect();
    let rank = |field: &ast::Field| {
        let name = field.name_ref().map(|name| name.syntax().text().to_string());
        ORDER.iter().position(|it| Some(*it) == name.as_deref()).unwrap_or(ORDER.len())
    };
    // Which of two that are the same counts is a question of their order.
    let mut sorted: Vec<&ast::Field> = fields.iter().collect();
    sorted.sort_by_key(|field| rank(field));
    let is_unclear = sorted.windows(2).any(|pair| rank(pair[0]) == rank(pair[1]));
    if is_unclear || sorted.iter().copied().eq(&fields) {
        return;
    }
    actions.offer(ActionKind::Rewrite, "Sort the fields", || {
        let mut change = Change::default();
        for (place, field) in fields.iter().zip(sorted) {
            let text = field.syntax().text().to_string();
            change.replace(file, Replacement { range: place.syntax().text_range(), text });
        }
        change
    });
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    #[test]
    fn comments_stay_where_they_are() {
        check(
            "deployment D {\n  architecture A\n  activity a$0 {\n    period = 10;  // often\n    priority = 2\n    deadline = 5\n  }\n}\n",
            "Sort the fields",
            expect![[r#"
                --- /model.mal
                    priority = 2;  // often
                    period = 10
            "#]],
        );
        check(
            "deployment D { architecture A activity a$0 { priority = 2 period = 10 } }",
            "Sort the fields",
            expect![[r#"
            not offered
        "#]],
        );
        check(
            "deployment D { architecture A activity a$0 { period = 10 priority = } }",
            "Sort the fields",
            expect![[r#"
            not offered
        "#]],
        );
        check(
            "deployment D { architecture A activity a$0 { period = 1 priority = 2 period = 3 } }",
            "Sort the fields",
            expect![[r#"
            not offered
        "#]],
        );
    }
}
