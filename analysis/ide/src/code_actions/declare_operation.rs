//! Declares an operation of a core in its shell.

use mauve_diagnostics::Finding;
use mauve_hir::{declaration_at, shell_of};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::is_whole;

use super::{Actions, put_into};

pub(super) fn offer<'db>(actions: &mut Actions<'_, 'db>, finding: &Finding<'db>) {
    let (db, file) = (actions.db, actions.question.file);
    let at = finding.diagnostic.at.range(db);
    let operation = actions.around::<ast::OperationDefinition>(at);
    let (Some(operation), Some(project)) = (operation, actions.project) else { return };
    let parts = operation.name().zip(operation.param_list()).filter(|(_, it)| is_whole(it.syntax()));
    let of = declaration_at(db, file, at);
    let shell = of.and_then(|of| shell_of(db, project, of));
    let (Some((name, parameters)), Some(shell)) = (parts, shell) else { return };
    let result = operation.result_type().and_then(|it| it.ty());
    let result = result.map_or_else(|| "void".to_owned(), |it| it.syntax().text().to_string());
    let name = name.syntax().text().to_string();
    actions.offer_fix(finding, format!("Declare `{name}` in {}", shell.name(db)), || {
        put_into(db, shell, &format!("provide {name}{}: {result}", parameters.syntax().text()))
    });
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    #[test]
    fn as_it_is_defined() {
        let text = "include \"shells.mal\"\ncore C(l.S) { provide $0reset(in n: int, out m: double): bool = { return true; } update = { } }\n\
                    //- /shells.mal\nlibrary l { shell S { } }\n";
        check(
            text,
            "Declare",
            expect![[r#"
            --- /shells.mal
            library l { shell S {
                provide reset(in n: int, out m: double): bool } }
        "#]],
        );
        check(&text.replace("n: int", "n:"), "Declare", expect!["not offered\n"]);
        check(&text.replace("(l.S)", "(l.T)"), "Declare", expect!["not offered\n"]);
    }
}
