//! The fixes of the diagnostics at a location, of all diagnostics with the same code, and all fixes that are safe to apply
//! without a look.

use mauve_diagnostics::{Finding, Fix};
use mauve_syntax::TextRange;
use rustc_hash::{FxHashMap, FxHashSet};

use super::{
    ActionKind, Actions, CodeAction, connect, create_codel, create_project, create_state, create_variable,
    declare_operation,
};
use crate::Change;

/// The codes that an editor may fix by itself when a file is saved: their fixes guess no name and write no number. Three of them
/// leave the meaning of a text as it is; a connection with swapped ends has none, and no figure, before its fix.
const CLEAR: &[&str] = &["connection-direction", "continued-line", "header-colon", "missing-else"];

/// The codes whose fixes are offered with the response times that they give: see [`super::timing`].
const TIMED: &[&str] = &["not-deadline-monotonic"];

/// The codes that are fixed one by one: `plna` and `paln` may both be typos of `plan`, and a table with a duplicate key provides
/// no times. A time that is added changes how long the other codels may take.
const ONE_BY_ONE: &[&str] = &["missing-time", "unknown-timing-key"];

pub(super) fn offer(actions: &mut Actions<'_, '_>) {
    if actions.wants(ActionKind::QuickFix) {
        offer_selected(actions);
    }
    if !actions.wants(ActionKind::FixAll) {
        return;
    }
    let findings = actions.findings();
    let is_clear = |it: &&Finding<'_>| only_fix(it).is_some() && CLEAR.contains(&it.diagnostic.code.name);
    let all: Vec<&Finding<'_>> = findings.iter().filter(is_clear).collect();
    if !all.is_empty() {
        let title = format!("Fix all auto-fixable problems ({} in this file)", all.len());
        offer_all(actions, title, ActionKind::FixAll, &all);
    }
}

/// Offers the fixes of the selected diagnostics, and of all diagnostics with their codes.
fn offer_selected<'db>(actions: &mut Actions<'_, 'db>) {
    let db = actions.db;
    let question = actions.question;
    let findings = actions.findings();
    let shown: FxHashSet<(TextRange, &str)> =
        question.diagnostics.iter().map(|(range, code)| (*range, code.as_str())).collect();
    let is_selected = |finding: &Finding<'_>| {
        let (at, code) = (finding.diagnostic.at.range(db), finding.diagnostic.code.name);
        at.intersect(question.range).is_some() || shown.contains(&(at, code))
    };
    let selected: Vec<&Finding<'_>> = findings.iter().filter(|it| is_selected(it)).collect();
    for finding in &selected {
        let fixes = &finding.diagnostic.fixes;
        for fix in fixes.iter().filter(|_| !TIMED.contains(&finding.diagnostic.code.name)) {
            let action = CodeAction {
                // An editor may apply a preferred fix unasked, so a guess or one of several fixes is not preferred.
                preferred: fixes.len() == 1 && CLEAR.contains(&finding.diagnostic.code.name),
                fixed: vec![(*finding).clone()],
                ..CodeAction::new(ActionKind::QuickFix, fix.title.clone())
            };
            actions.push(action, || Change::of_fix(db, fix));
        }
    }
    let (mut missing_states, mut sources) = (FxHashMap::default(), connect::KnownSources::default());
    for finding in &selected {
        match finding.diagnostic.code.name {
            "unresolved-state" => create_state::offer(actions, finding, &findings, &mut missing_states),
            "missing-time" => create_project::offer(actions, finding),
            "unresolved-codel" => create_codel::offer(actions, finding),
            "unresolved-variable" => create_variable::offer(actions, finding),
            "undeclared-operation" => declare_operation::offer(actions, finding),
            "unconnected-input" | "unconnected-operation" => connect::offer(actions, finding, &mut sources),
            _ => {}
        }
    }
    let mut codes: Vec<&str> = selected.iter().map(|it| it.diagnostic.code.name).collect();
    codes.sort_unstable();
    codes.dedup();
    codes.retain(|code| !ONE_BY_ONE.contains(code) && !TIMED.contains(code));
    for code in codes {
        let same_code: Vec<&Finding<'_>> =
            findings.iter().filter(|it| it.diagnostic.code.name == code && only_fix(it).is_some()).collect();
        if same_code.len() > 1
            && selected.iter().any(|it| it.diagnostic.code.name == code && only_fix(it).is_some())
        {
            let title = format!("Fix all {} `{code}` in this file", same_code.len());
            offer_all(actions, title, ActionKind::QuickFix, &same_code);
        }
    }
}

fn only_fix<'a, 'db>(finding: &'a Finding<'db>) -> Option<&'a Fix<'db>> {
    match finding.diagnostic.fixes.as_slice() {
        [fix] => Some(fix),
        _ => None,
    }
}

fn offer_all<'db>(actions: &mut Actions<'_, 'db>, title: String, kind: ActionKind, all: &[&Finding<'db>]) {
    let db = actions.db;
    let fixed = all.iter().map(|it| (*it).clone()).collect();
    let action = CodeAction { fixed, ..CodeAction::new(kind, title) };
    actions.push(action, || {
        let mut change = Change::default();
        for fix in all.iter().filter_map(|it| only_fix(it)) {
            // An overlapping fix is applied next time.
            if let Some(fix) = Change::of_fix(db, fix) {
                change.join(fix);
            }
        }
        change
    });
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use super::super::{ActionQuestion, Changes, code_actions};
    use super::*;
    use crate::fixture::{Fixture, project_with};
    use expect_test::{Expect, expect};

    /// The titles of what is offered at `$0`, with the codes that each fixes; `*` is preferred.
    fn offered(fixture: &str, diagnostics: &[(TextRange, String)], kinds: &[ActionKind], expected: Expect) {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let range = TextRange::empty(offset);
        let question = ActionQuestion { file, range, diagnostics, kinds, changes: Changes::None };
        let mut shown = String::new();
        for action in code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question) {
            let codes: Vec<&str> = action.fixed.iter().map(|it| it.diagnostic.code.name).collect();
            let mark = if action.preferred { "*" } else { "" };
            shown += &format!("{mark}{} [{}]\n", action.title, codes.join(" "));
        }
        expected.assert_eq(&shown);
    }

    const MODEL: &str = "
codel plan(in goal: int): int
shell S { }
core C(S) {
  /* 🦀 é */ update = { pl$0na(1); if true then { } if false then { } }
}
component K(S, C)
architecture A { instance a: K  instance b: K }
deployment D { architecture A }
//- /mauve.toml
[timing]
significane = 1e-4
";

    #[test]
    fn fixes_are_at_the_cursor_or_of_shown_diagnostics() {
        let quick = &[ActionKind::QuickFix];
        offered(
            MODEL,
            &[],
            quick,
            expect![[r#"
            Change to `plan` [unresolved-codel]
            Create codel `plna(in value: int): void` [unresolved-codel]
        "#]],
        );
        let model = MODEL.replace("pl$0na", "plna");
        let start = model.find("if true").unwrap() as u32 - 1;
        let range = TextRange::at(start.into(), 2.into());
        offered(
            &model.replace("codel", "$0codel"),
            &[(range, "missing-else".to_owned())],
            quick,
            expect![[r#"
                *Write `else { }` [missing-else]
                Fix all 2 `missing-else` in this file [missing-else missing-else]
            "#]],
        );
        offered(&model.replace("codel", "$0codel"), &[(range, "other".to_owned())], quick, expect![""]);
        offered(
            &model.replace("codel", "$0codel"),
            &[],
            &[ActionKind::FixAll],
            expect![[r#"
                Fix all auto-fixable problems (2 in this file) [missing-else missing-else]
            "#]],
        );
    }

    #[test]
    fn all_diagnostics_of_a_code_are_fixed() {
        let model = MODEL.replace("$0", "");
        check(
            &model.replace("deployment D", "deployment $0D"),
            "Fix all 2 `missing-activity`",
            expect![[r#"
                --- /model.mal
                deployment D { architecture A
                  activity a { priority = 1 period = 100 }
                  activity b { priority = 2 period = 100 } }
            "#]],
        );
        check(
            &model,
            "Fix all auto-fixable problems",
            expect![[r#"
            --- /model.mal
              /* 🦀 é */ update = { plna(1); if true then { } else { } if false then { } else { } }
        "#]],
        );
    }

    #[test]
    fn priorities_are_not_changed_all_at_once_without_their_figures() {
        let activity = |(name, cpu, priority, period): (&str, u32, u32, u32)| {
            format!("  activity {name} {{ affinity = {cpu} priority = {priority} period = {period} }}\n")
        };
        let all = [("$0a", 1, 3, 100), ("b", 1, 5, 200), ("c", 2, 3, 100), ("d", 2, 5, 200)].map(activity);
        let model = format!(
            "shell S {{ }} codel f(): int core C(S) {{ update = {{ f(); }} }} component K(S, C)\n\
             architecture A {{ instance a: K instance b: K instance c: K instance d: K }}\n\
             deployment D {{ architecture A\n{}}}\n\
             //- /mauve.toml\ntiming.tables = [\"t.toml\"]\nplatform.cpus = 2\nplatform.rt_throttling = false\n\
             //- /t.toml\ncodel.f = 1\n",
            all.concat()
        );
        offered(
            &model,
            &[],
            &[ActionKind::QuickFix],
            expect![[r#"
            *Give a priority 6: ✓ 2 → 1 / 100 ms, 4 of 4 met [not-deadline-monotonic]
            Swap the priorities of a and b: a ✓ 2 → 1 / 100 ms, 4 of 4 met [not-deadline-monotonic]
            Order priorities by deadline: a ✓ 2 → 1 / 100 ms, 4 of 4 met [not-deadline-monotonic]
            Move a to CPU 2: ✓ 2 → 3 / 100 ms, 4 of 4 met, warnings [not-deadline-monotonic]
        "#]],
        );
    }

    #[test]
    fn in_tables_and_in_the_configuration() {
        let table = "codel plan(): int\nshell S { }\ncore C(S) { update = { plan(); } }\ncomponent K(S, C)\n\
                     //- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n//- /times.toml\n[codel]\n\"pl$0na\" = 3\n";
        offered(
            table,
            &[],
            &[ActionKind::QuickFix],
            expect![[r#"
            Change to `plan` [unknown-timing-key]
        "#]],
        );
        // Both may be meant for the same: not together.
        offered(
            &format!("{table}paln = 4\n"),
            &[],
            &[ActionKind::QuickFix],
            expect![[r#"
            Change to `plan` [unknown-timing-key]
        "#]],
        );
    }
}
