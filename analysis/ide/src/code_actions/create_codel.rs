//! Creates a codel for an unresolved call, with the types of its arguments.

use mauve_diagnostics::Finding;
use mauve_syntax::ast::{self, AstNode as _};

use super::program::{CorePrograms, bare, free_name};
use super::{Actions, indentation, put};

pub(super) fn offer<'db>(actions: &mut Actions<'_, 'db>, finding: &Finding<'db>) {
    let (db, file) = (actions.db, actions.question.file);
    let text = file.text(db);
    let at = finding.diagnostic.at.range(db);
    let around = (actions.around::<ast::CallExpr>(at), actions.around::<ast::Core>(at));
    let (Some(call), Some(core)) = around else { return };
    let is_it = call.name_ref().is_some_and(|name| name.syntax().text_range() == at);
    // A name that refers to something else cannot be called, even with a codel of this name.
    let is_unknown = finding.diagnostic.message.starts_with("no codel or operation");
    let Some(project) = actions.project.filter(|_| is_it && is_unknown) else { return };
    let programs = actions.programs(project, &core);
    let Some(signature) = programs.and_then(|it| signature(&it, &call)) else { return };
    let name = &text[at];
    // After the other codels of its library, or directly before the core.
    let before = core.syntax().prev_sibling().into_iter();
    let before = before.flat_map(|it| std::iter::successors(Some(it), |it| it.prev_sibling()));
    let last = before.filter_map(ast::Codel::cast).next();
    actions.offer_fix(finding, format!("Create codel `{name}{signature}`"), || match last {
        Some(last) => {
            let range = last.syntax().text_range();
            let indent = indentation(text, range.start());
            put(file, range.end(), format!("\n{indent}codel {name}{signature}"))
        }
        None => {
            let start = core.syntax().text_range().start();
            put(file, start, format!("codel {name}{signature}\n{}", indentation(text, start)))
        }
    });
}

/// `(in goal: Pose, in value: int): bool`
fn signature(programs: &CorePrograms<'_>, call: &ast::CallExpr) -> Option<String> {
    let result = programs.expected_type(call.syntax())?;
    let mut names: Vec<String> = Vec::new();
    let mut parameters = Vec::new();
    for argument in call.argument_list()?.exprs() {
        if programs.is_no_value(&argument) {
            return None;
        }
        let wanted = match bare(&argument)? {
            ast::Expr::NameExpr(name) => name.syntax().text().to_string(),
            _ => "value".to_owned(),
        };
        let name = free_name(&wanted, |name| !names.iter().any(|it| it == name));
        parameters.push(format!("in {name}: {}", programs.written_type(&argument)?));
        names.push(name);
    }
    Some(format!("({}): {result}", parameters.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::{Expect, expect};

    fn created(update: &str, expected: Expect) {
        let text = format!(
            "library l {{\n  use geometry_msgs\n  codel know(in goal: Pose): int\n\n  shell S {{ input port pose: Pose  property gain: double }}\n\n  \
             core C(S) {{\n    var goal: Pose\n    var n: int = 0\n    update = {{ {update} }}\n  }}\n}}\n"
        );
        check(&text, "Create codel", expected);
    }

    #[test]
    fn with_the_types_of_its_arguments_and_of_what_is_done_with_it() {
        created(
            "/* 🦀 é */ n = $0plan(goal, n + 1, gain, 2.5);",
            expect![[r#"
                --- /model.mal
                  codel plan(in goal: Pose, in value: int, in gain: double, in value2: double): int
            "#]],
        );
        created(
            "$0drive();",
            expect![[r#"
            --- /model.mal
              codel drive(): void
        "#]],
        );
        created(
            "if $0arrived(goal, goal) then { } else { }",
            expect![[r#"
            --- /model.mal
              codel arrived(in goal: Pose, in goal2: Pose): bool
        "#]],
        );
        created(
            "n = know($0next(n));",
            expect![[r#"
            --- /model.mal
              codel next(in n: int): Pose
        "#]],
        );
        // The types of its result and of its parameters are unknown.
        created("$0plan(other);", expect!["not offered\n"]);
        // The line has a syntax error, which is reported first.
        created("n = $0plan(n", expect!["not offered\n"]);
        created("$0n(2);", expect!["not offered\n"]);
    }
}
