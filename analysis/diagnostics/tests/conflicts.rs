//! The regions that git marks where it cannot merge two texts: each is one error, and nothing is analysed that rests on one of
//! the texts.
//!
//! `MAUVE_CONFLICTS=20000 cargo test --release -p mauve-diagnostics --test main conflicts::` tries more.

use expect_test::expect;
use mauve_diagnostics::Severity;
use mauve_hir::{Database, Workspace};
use mauve_tests::{Random, search};

use crate::common::{diagnostics, verdicts};
use crate::damage::NAMESAKES;
use crate::damaged::{Project, Texts, responses};

/// Puts a region in place of some lines. Its other text lacks a line, has one twice, another number, or nothing.
fn conflict(texts: &mut Texts, random: &mut Random) -> Vec<String> {
    let file = random.below(texts.len());
    let (path, text) = &mut texts[file];
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let first = random.below(lines.len());
    let last = (first + 1 + random.below(5)).min(lines.len());
    let own = lines[first..last].concat();
    let line = first + random.below(last - first);
    let without = [&lines[first..line], &lines[line + 1..last]].concat().concat();
    let twice = [&lines[first..=line], &lines[line..last]].concat().concat();
    let number = own.replacen(['1', '2', '3', '5', '9'], "7", 1);
    let other = random.of(&[without, twice, number, String::new()]).clone();
    let base = if random.below(2) == 0 { "||||||| base\n{\n" } else { "" };
    let [ours, theirs] = if random.below(2) == 0 { [&own, &other] } else { [&other, &own] };
    let region = format!("<<<<<<< HEAD\n{ours}{base}=======\n{theirs}>>>>>>> other\n");
    let done = format!("lines {first}..{last} of {} in conflict", path.display());
    *text = [&lines[..first].concat(), &region, &lines[last..].concat()].map(String::as_str).concat();
    vec![done]
}

/// Returns a text with the first or the second text of its only region.
fn resolved(text: &str, second: bool) -> String {
    let mut part = 0;
    let is_kept = |line: &&str| {
        let marker = ["<<<<<<<", "|||||||", "=======", ">>>>>>>"].iter().position(|it| line.starts_with(it));
        part = marker.map_or(part, |marker| (marker + 1) % 4);
        marker.is_none() && (part == 0 || part == if second { 3 } else { 1 })
    };
    text.split_inclusive('\n').filter(is_kept).collect()
}

#[test]
fn a_figure_is_that_of_both_texts_and_a_region_is_one_error() {
    for (project, salt) in [(Project::sample("p3dx"), 0), (Project::fixture(NAMESAKES), 1)] {
        let (mut kept, mut refused) = (0, 0_u64);
        project.damage((search::cases("MAUVE_CONFLICTS", 150), salt), false, conflict, |damaged| {
            let found = damaged.responses();
            let texts: Texts = damaged
                .workspace
                .files(damaged.db)
                .iter()
                .map(|(path, file)| (path.clone(), file.text(damaged.db).to_string()))
                .collect();
            for second in [false, true] {
                let db = Database::default();
                let texts = texts.iter().map(|(path, text)| (path.clone(), resolved(text, second)));
                let workspace = Workspace::of_texts(&db, damaged.workspace.folder(damaged.db).clone(), texts);
                for (activity, response) in responses(&db, workspace) {
                    let Some(known) = found.get(&activity).copied().flatten() else {
                        refused += u64::from(response.is_some());
                        continue;
                    };
                    kept += 1;
                    assert!(
                        response.is_none_or(|it| it == known),
                        "{activity:?}: {known:?}, not {response:?}"
                    );
                }
                let errors = |all: Vec<mauve_diagnostics::Finding<'_>>| {
                    let errors = all.into_iter().filter(|it| it.diagnostic.code.severity == Severity::Error);
                    errors.map(|it| it.diagnostic.message.clone()).collect::<Vec<_>>()
                };
                if !second && errors(mauve_diagnostics::workspace_diagnostics(&db, workspace)).is_empty() {
                    let found = errors(damaged.findings());
                    assert!(found.len() == 1 && found[0].contains("conflict"), "{found:?}");
                }
            }
            damaged.compare_with_new_database();
        });
        let least = search::share(100);
        assert!(kept > least && refused > least, "{kept} kept, {refused} refused");
    }
}

const TWO: &str = "codel f(): int
codel g(): int
shell S { property p: int = 1 }
core K(S) { update = { f(); } }
core L(S) { update = { g(); } }
component C(S, K)
component E(S, L)
architecture A {
  instance a: C
  instance b: E
}
deployment D {
  architecture A
  activity a { affinity = 1 priority = 5 period = 10 }
  activity b { affinity = 2 priority = 4 period = 10 }
}
//- /mauve.toml
[timing]
tables = [\"t.toml\"]
[platform]
cpus = 2
rt_throttling = false
//- /t.toml
[codel]
f = 1
g = 2
";

/// Returns what `TWO` says with a conflict between `from`, which it has, and `to`.
fn said(from: &str, to: &str) -> String {
    assert!(TWO.contains(from), "{from}");
    let model = TWO.replacen(from, &format!("<<<<<<< HEAD\n{from}=======\n{to}>>>>>>> other\n"), 1);
    verdicts(&model) + &diagnostics(&model)
}

#[test]
fn what_a_region_touches_has_no_figure_and_the_rest_keeps_its_own() {
    expect![[r#"
        a not-analysed: codel f has a merge conflict
        b met 2 ms
        /model.mal "<<<<<<< HEAD" syntax-error: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]].assert_eq(&said("codel f(): int\n", "codel f(): double\n"));
    expect![[r#"
        a not-analysed: core K: it has a merge conflict; core K: a program has a merge conflict
        b met 2 ms
        /model.mal "<<<<<<< HEAD" syntax-error: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]]
        .assert_eq(&said("core K(S) { update = { f(); } }\n", "core K(S) { update = { f(); f(); } }\n"));
    expect![[r#"
        a not-analysed: component C has a merge conflict
        b met 2 ms
        /model.mal "<<<<<<< HEAD" syntax-error: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]].assert_eq(&said("component C(S, K)\n", "component C(S, L)\n"));
    expect![[r#"
        a not-analysed: architecture A has a merge conflict: an instance may be missing in it
        b not-analysed: architecture A has a merge conflict: an instance may be missing in it
        /model.mal "<<<<<<< HEAD" syntax-error: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]].assert_eq(&said("  instance b: E\n", "  instance b: C\n"));
    expect![[r#"
        a not-analysed: deployment D has a merge conflict: an activity may be missing in it
        b not-analysed: its activity has a syntax error; deployment D has a merge conflict: an activity may be missing in it
        /model.mal "<<<<<<< HEAD" syntax-error: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]].assert_eq(&said(
        "  activity b { affinity = 2 priority = 4 period = 10 }\n",
        "  activity b { affinity = 1 priority = 9 period = 5 }\n",
    ));
    // Nothing uses the new codel.
    expect![[r#"
        a met 1 ms
        b not-analysed: component E has a merge conflict
        /model.mal "<<<<<<< HEAD" syntax-error: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]].assert_eq(&said("component E(S, L)\n", "component E(S, L)\ncodel h(): int\n"));
    expect![[r#"
        a not-analysed: model.mal has a merge conflict between its declarations: one of them may be missing
        b not-analysed: codel g has a merge conflict; model.mal has a merge conflict between its declarations: one of them may be missing
        /model.mal "<<<<<<< HEAD" syntax-error: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]].assert_eq(&said("codel g(): int\n", "library l { codel g(): int }\n"));
    expect![[r#"
        a not-analysed: t.toml: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
        b not-analysed: t.toml: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
        /t.toml "<<<<<<< HEAD" invalid-table: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]].assert_eq(&said("f = 1\n", "f = 3\n"));
    expect![[r#"
        a not-analysed: mauve.toml: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
        b not-analysed: mauve.toml: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
        /mauve.toml "<<<<<<< HEAD" invalid-configuration: unresolved merge conflict between `HEAD` and `other`: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, `=======` and `>>>>>>>`
    "#]].assert_eq(&said("cpus = 2\n", "cpus = 1\n"));
}

#[test]
fn the_other_text_of_a_region_in_an_item_may_hold_another_item() {
    let model = TWO.replacen(
        "  activity a { affinity = 1 priority = 5 period = 10 }\n",
        "  activity a { affinity = 1 period = 10\n\
         <<<<<<< HEAD\n    priority = 5\n\
         =======\n    priority = 5\n  }\n  activity c { affinity = 2 priority = 9\n\
         >>>>>>> other\n  }\n",
        1,
    );
    expect![[r#"
        a not-analysed: its period has a syntax error; its priority has a syntax error; deployment D has a merge conflict: an activity may be missing in it
        b not-analysed: deployment D has a merge conflict: an activity may be missing in it
    "#]]
    .assert_eq(&verdicts(&model));
}

#[test]
fn what_is_left_of_a_region_says_conflict_too() {
    for marker in ["<<<<<<< HEAD\n", "=======\n", ">>>>>>> other\n", "||||||| base\n"] {
        let model = TWO.replacen("component C", &format!("{marker}component C"), 1);
        assert_eq!(
            diagnostics(&model),
            format!(
                "/model.mal {:?} syntax-error: left of a merge conflict: remove this line, and the text that is not to \
                 stay\n",
                marker.trim_end()
            )
        );
        assert!(verdicts(&model).lines().all(|line| line.contains("not-analysed")), "{}", verdicts(&model));
    }
}

#[test]
fn a_conflict_in_a_comment_is_an_error_and_changes_no_figure() {
    let model =
        TWO.replacen("codel g", "/*\n<<<<<<< HEAD\nfast\n=======\nslow\n>>>>>>> other\n*/\ncodel g", 1);
    assert_eq!(verdicts(&model), verdicts(TWO));
    assert_eq!(diagnostics(&model).lines().count(), 1, "{}", diagnostics(&model));
}
