//! Creates the missing target state of a transition, after the state of the transition.

use mauve_diagnostics::Finding;
use mauve_syntax::TextRange;
use mauve_syntax::ast::{self, AstNode as _};
use rustc_hash::FxHashMap;

use super::{Actions, indentation, put};

/// The names of the missing states of each state machine, by its range, sorted.
pub(super) type MissingStates<'a> = FxHashMap<TextRange, Vec<&'a str>>;

pub(super) fn offer<'db>(
    actions: &mut Actions<'_, 'db>,
    finding: &Finding<'db>,
    all: &[Finding<'db>],
    known: &mut MissingStates<'db>,
) {
    let (db, file) = (actions.db, actions.question.file);
    let text = file.text(db);
    let at = finding.diagnostic.at.range(db);
    let around = (actions.around::<ast::State>(at), actions.around::<ast::StateMachine>(at));
    let (Some(state), Some(machine)) = around else { return };
    let whole = state.syntax().text_range();
    let indent = indentation(text, whole.start());
    let written = |name: &str| format!("\n{indent}state {name} {{\n{indent}}}");
    let name = &text[at];
    actions.offer_fix(finding, format!("Create state `{name}`"), || put(file, whole.end(), written(name)));
    let machine = machine.syntax().text_range();
    let missing = known.entry(machine).or_insert_with(|| {
        let mut missing: Vec<&str> = all
            .iter()
            .filter(|it| it.diagnostic.code.name == "unresolved-state" && it.diagnostic.at.file(db) == file)
            .map(|it| it.diagnostic.at.range(db))
            .filter(|range| machine.contains_range(*range))
            .map(|range| &text[range])
            .collect();
        missing.sort_unstable();
        missing.dedup();
        missing
    });
    if missing.len() > 1 {
        let title = format!("Create the {} missing states", missing.len());
        actions.offer_fix(finding, title, || {
            put(file, whole.end(), missing.iter().map(|name| written(name)).collect())
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use expect_test::expect;

    const MACHINE: &str = "shell S { }\ncore C(S) {\n  statemachine {\n    /* 🦀 é */ initial state A {\n      transition t to $0B\n      \
                           transition u to Cc\n    }\n    state D { transition v to B transition w to A }\n  }\n}\n";

    #[test]
    fn one_or_all_missing_states_are_created() {
        check(
            MACHINE,
            "Create state `B`",
            expect![[r#"
            --- /model.mal
                state B {
                }
        "#]],
        );
        check(
            MACHINE,
            "Create the 2 missing states",
            expect![[r#"
            --- /model.mal
                state B {
                }
                state Cc {
                }
        "#]],
        );
        check(&MACHINE.replace("$0B", "$0D"), "Create", expect!["not offered\n"]);
        check(&MACHINE.replace("$0B", "$0"), "Create state", expect!["not offered\n"]);
    }
}
