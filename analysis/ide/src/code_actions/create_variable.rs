//! Creates an undeclared variable in the core, or a property in its shell.

use mauve_diagnostics::Finding;
use mauve_hir::shell_of;
use mauve_syntax::ast::{self, AstNode as _};

use super::{Actions, indentation, put, put_into};

pub(super) fn offer<'db>(actions: &mut Actions<'_, 'db>, finding: &Finding<'db>) {
    let (db, file) = (actions.db, actions.question.file);
    let text = file.text(db);
    let at = finding.diagnostic.at.range(db);
    let node = actions.around::<ast::NameRef>(at).map(|it| it.syntax().clone());
    let node = node.filter(|it| it.text_range() == at);
    let (Some(node), Some(of)) = (node, actions.around::<ast::Core>(at)) else { return };
    // Otherwise the name refers to something without a value.
    let is_unknown = finding.diagnostic.message.starts_with("no variable");
    let Some(project) = actions.project.filter(|_| is_unknown) else { return };
    let Some(programs) = actions.programs(project, &of) else { return };
    let Some(parent) = node.parent() else { return };
    let assigned = ast::AssignStatement::cast(parent.clone());
    let ty = match &assigned {
        Some(assigned) => assigned.expr().and_then(|value| programs.written_type(&value)),
        None => programs.expected_type(&parent),
    };
    let Some(ty) = ty.filter(|ty| ty != "void") else { return };
    let name = &text[at];
    let last = of.syntax().children().filter_map(ast::Var::cast).last().map(|it| it.syntax().text_range());
    let Some(brace) = of.l_curly_token().map(|it| it.text_range()) else { return };
    actions.offer_fix(finding, format!("Create variable `{name}: {ty}`"), || {
        let indent = match last {
            Some(last) => indentation(text, last.start()).to_owned(),
            None => format!("{}  ", indentation(text, of.syntax().text_range().start())),
        };
        put(file, last.unwrap_or(brace).end(), format!("\n{indent}var {name}: {ty}"))
    });
    // A property is read-only and has an initial value.
    let value = match ty.as_str() {
        "int" => "0",
        "double" | "float" => "0.0",
        "bool" => "false",
        "string" => "\"\"",
        _ => return,
    };
    let is_written = assigned.is_some() || programs.is_output(&parent);
    if !is_written && let Some(shell) = shell_of(db, project, programs.semantics.core) {
        let title = format!("Create property `{name}: {ty}` in {}", shell.name(db));
        actions
            .offer_fix(finding, title, || put_into(db, shell, &format!("property {name}: {ty} = {value}")));
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::{Expect, expect};

    fn created(update: &str, title: &str, expected: Expect) {
        let text = format!(
            "include \"shells.mal\"\ncodel next(in n: int, out m: int): double\ncore C(S) {{\n  update = {{ {update} }}\n}}\n\
             //- /shells.mal\nshell S {{\n  input port way: int // Where.\n}}\n"
        );
        check(&text, title, expected);
    }

    #[test]
    fn of_the_type_that_is_asked_for() {
        created(
            "/* 🦀 é */ $0speed = 2.5 * 2;",
            "Create variable",
            expect![[r#"
            --- /model.mal
              var speed: double
        "#]],
        );
        created(
            "read(way, $0speed);",
            "Create variable",
            expect![[r#"
            --- /model.mal
              var speed: int
        "#]],
        );
        created(
            "next($0speed, other);",
            "Create variable",
            expect![[r#"
            --- /model.mal
              var speed: int
        "#]],
        );
        created(
            "if next(1, n) > $0speed then { } else { }",
            "Create variable",
            expect![[r#"
            --- /model.mal
              var speed: double
        "#]],
        );
        created("$0speed = other;", "Create variable", expect!["not offered\n"]);
        created("$0speed = ;", "Create variable", expect!["not offered\n"]);
    }

    #[test]
    fn as_a_property_where_it_is_only_read() {
        created(
            "next($0speed, other);",
            "Create property",
            expect![[r#"
            --- /shells.mal
              property speed: int = 0
        "#]],
        );
        created("next(1, $0other);", "Create property", expect!["not offered\n"]);
        created("read(way, $0other);", "Create property", expect!["not offered\n"]);
        created("$0speed = 2;", "Create property", expect!["not offered\n"]);
    }
}
