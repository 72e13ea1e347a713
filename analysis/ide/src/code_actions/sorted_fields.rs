//! Sorts the fields of an activity in the order of the grammar.

use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::format::Replacement;
use mauve_syntax::has_comment;
use mauve_syntax::keywords::ActivityField;

use super::{ActionKind, Actions};
use crate::Change;

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    let (file, activity) = (actions.question.file, actions.node::<ast::Activity>());
    // A comment belongs to the field beside it.
    let is_plain = |it: &ast::Activity| mauve_syntax::is_whole(it.syntax()) && !has_comment(it.syntax());
    let Some(activity) = activity.filter(is_plain) else { return };
    let fields: Vec<ast::Field> = activity.fields().collect();
    let rank = |field: &ast::Field| field.field().map_or(ActivityField::ALL.len(), |it| it as usize);
    // The order of duplicate fields matters.
    let mut sorted: Vec<&ast::Field> = fields.iter().collect();
    sorted.sort_by_key(|field| rank(field));
    let is_unclear = sorted.windows(2).any(|pair| rank(pair[0]) == rank(pair[1]));
    if is_unclear || sorted.iter().copied().eq(&fields) {
        return;
    }
    actions.offer(ActionKind::Rewrite, "Sort the fields", || {
        let edits = fields.iter().zip(sorted).map(|(place, field)| Replacement {
            range: place.syntax().text_range(),
            text: field.syntax().text().to_string(),
        });
        Change::of(file, edits)
    });
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    #[test]
    fn only_what_is_clear_is_sorted() {
        check(
            "deployment D {\n  architecture A\n  activity a$0 { offset = 3 jitter = 1; period = 10; priority = 2  deadline = 5 affinity = 1 }\n}\n",
            "Sort the fields",
            expect![[r#"
                --- /model.mal
                  activity a { affinity = 1 priority = 2; period = 10; deadline = 5  jitter = 1 offset = 3 }
            "#]],
        );
        check(
            "deployment D { architecture A activity a$0 {\n period = 10 // often\n priority = 2\n} }",
            "Sort the fields",
            expect![[r#"
            not offered
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
