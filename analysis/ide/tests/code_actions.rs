//! Every action that is offered, at random places of the sample robots and of random models: its edits lie in their files, it
//! makes no syntax error, and a refactoring makes no error at all and leaves every response time as it is.
//!
//! `MAUVE_ACTIONS=1000 cargo test --release -p mauve-ide --test main code_actions::` tries more models, `MAUVE_SEED=7` others.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::PathBuf;

use mauve_diagnostics::{Severity, workspace_diagnostics};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Workspace, is_model, names_of, projects};
use mauve_ide::{ActionKind, ActionQuestion, Change, Changes, code_actions};
use mauve_syntax::{SyntaxKind, TextRange, TextSize, WalkEvent};
use mauve_tests::{Random, char_boundary, models, models_of_pages, random_model, search, texts_moved};
use mauve_timing::{Rounding, Time, Unit};
use mauve_wcrt::{Query, response_times};

use crate::project_with;

type Texts = BTreeMap<PathBuf, String>;

const ALL: &[ActionKind] =
    &[ActionKind::QuickFix, ActionKind::Rewrite, ActionKind::OrganizeUses, ActionKind::FixAll];

#[test]
fn every_action_leaves_a_valid_model() {
    let seed = 1 + search::seed();
    let mut random = Random(seed);
    let mut offered: BTreeMap<(ActionKind, String), usize> = BTreeMap::new();
    for robot in ["p3dx", "p3dx_entry"] {
        try_actions(
            &texts_moved(&models().join(robot), "/").into_iter().collect(),
            40,
            &mut random,
            &mut offered,
        );
    }
    for model in 0..search::cases("MAUVE_ACTIONS", 40) {
        let texts = random_model(seed.wrapping_mul(1_000_003).wrapping_add(model)).texts();
        try_actions(&texts.into_iter().collect(), 60, &mut random, &mut offered);
    }
    let count =
        |kind: ActionKind| offered.iter().filter(|((of, _), _)| *of == kind).map(|(_, it)| it).sum::<usize>();
    let refactorings = [ActionKind::Rewrite, ActionKind::OrganizeUses];
    let timing = offered.iter().filter(|((_, title), _)| title == "timing").map(|(_, it)| it).sum::<usize>();
    let least = search::share(10) as usize;
    assert!(timing >= least / 2, "{offered:#?}");
    assert!(refactorings.iter().all(|kind| count(*kind) >= least), "{offered:#?}");
    if std::env::var_os("MAUVE_ACTIONS").is_some() {
        println!("{offered:#?}");
    }
}

/// What a refactoring must leave as it is.
struct State {
    syntax_errors: usize,
    errors: BTreeMap<String, usize>,
    response_times: String,
}

fn state(db: &Database, workspace: Workspace) -> State {
    let mut errors: BTreeMap<String, usize> = BTreeMap::new();
    for finding in workspace_diagnostics(db, workspace) {
        if finding.severity == Severity::Error {
            *errors.entry(finding.diagnostic.code.name.to_owned()).or_default() += 1;
        }
    }
    let mut response_times = String::new();
    for &project in projects(db, workspace) {
        for &decl in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
            for it in &self::response_times(db, project, decl, Query::shown(db, project, decl)).activities {
                let (name, verdict) = (&it.instance, it.verdict.name());
                let _ = writeln!(response_times, "{name} {verdict} {:?} {:?}", it.own, it.response);
            }
        }
    }
    let syntax_errors = errors.get("syntax-error").copied().unwrap_or_default();
    State { syntax_errors, errors, response_times }
}

fn try_actions(
    texts: &Texts,
    tries: usize,
    random: &mut Random,
    offered: &mut BTreeMap<(ActionKind, String), usize>,
) {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), texts.clone());
    let before = state(&db, workspace);
    // An action is an edit here.
    let mut new = Database::default();
    let changed = Workspace::of_texts(&new, "/".into(), texts.clone());
    let paths: Vec<&PathBuf> = texts.keys().collect();
    let mut applied: BTreeSet<Vec<(PathBuf, String)>> = BTreeSet::new();
    for _ in 0..tries {
        let path = *random.of(&paths);
        let file = workspace.file(&db, path).unwrap();
        let range = random_range(&texts[path], is_model(path), random);
        let question = ActionQuestion { file, range, diagnostics: &[], kinds: ALL, changes: Changes::All };
        let actions = code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question);
        // What is only offered is the same, without changes.
        let without = code_actions(
            &db,
            &[workspace],
            project_with(&db, workspace, question.file),
            ActionQuestion { changes: Changes::None, ..question },
        );
        assert!(without.iter().all(|it| it.change.is_none()));
        assert!(without.iter().map(|it| &it.title).eq(actions.iter().map(|it| &it.title)));
        for action in actions {
            assert_eq!(action.change.is_none(), action.disabled.is_some(), "{}", action.title);
            let Some(change) = &action.change else { continue };
            let made = made(&db, texts, change);
            let what = || format!("{} at {range:?} of {}", action.title, path.display());
            assert!(!made.is_empty(), "{} changes nothing", what());
            if !applied.insert(made.clone()) {
                continue;
            }
            let title = action.title.split(['`', '(']).next().unwrap_or_default().to_owned();
            *offered.entry((action.kind, title)).or_default() += 1;
            let mut after = texts.clone();
            after.extend(made.clone());
            let workspace = changed;
            for (path, text) in &after {
                let file = workspace.file(&new, path).unwrap();
                if **file.text(&new) != **text {
                    file.set_text(&mut new, text.as_str().into());
                }
            }
            let after = state(&new, workspace);
            if action.title == "Convert to a state machine" {
                let file = workspace.file(&new, path).unwrap();
                let question =
                    ActionQuestion { file, range, diagnostics: &[], kinds: ALL, changes: Changes::All };
                let back =
                    code_actions(&new, &[workspace], project_with(&new, workspace, question.file), question);
                let back = back.iter().find(|it| it.title == "Convert to `update`").unwrap();
                let back = back.change.as_ref().unwrap().applied(&new, file);
                assert_eq!(back, texts[path], "{}", what());
                *offered.entry((ActionKind::Rewrite, "update and back".to_owned())).or_default() += 1;
            }
            assert!(after.syntax_errors <= before.syntax_errors, "syntax errors: {} {made:#?}", what());
            let effect = action.title.split_once(": ").map(|it| it.1).filter(|it| it.contains(" met"));
            if effect.is_some() {
                assert!(
                    is_seen(&action.title, &before, &after),
                    "{}\n{}{made:#?}",
                    what(),
                    after.response_times
                );
                *offered.entry((action.kind, "timing".to_owned())).or_default() += 1;
            }
            if matches!(action.kind, ActionKind::QuickFix | ActionKind::FixAll) {
                // Another priority may be one that misses a deadline.
                let count = |of: &State| {
                    let all = of.errors.iter().filter(|(code, _)| *code != "deadline-missed");
                    all.map(|(_, count)| count).sum::<usize>()
                };
                assert!(count(&after) <= count(&before), "{} {made:#?}", what());
            } else if effect.is_some() {
                assert!(after.errors.values().sum::<usize>() <= before.errors.values().sum(), "{}", what());
            } else {
                let show = || {
                    let all = workspace_diagnostics(&new, workspace);
                    let errors = all.iter().filter(|it| it.severity == Severity::Error);
                    errors.map(|it| it.diagnostic.message.clone() + "\n").collect::<String>()
                };
                assert_eq!(after.errors, before.errors, "{}\n{}{made:#?}", what(), show());
                assert!(after.response_times == before.response_times, "{} {made:#?}", what());
            }
        }
    }
}

/// Returns whether the response times in the title of a timing action, `Give laser priority 9: ✓ 62 → 40 / 50 ms, 2 of 2 met`, are
/// those of the analyses before and after.
fn is_seen(title: &str, before: &State, after: &State) -> bool {
    let (change, effect) = title.split_once(": ").expect("a title says what the change gives");
    let Some((name, figure)) = effect.split_once(['✓', '!', '✗']) else { return true };
    let named = |from: &str, to: &str| change.split_once(from)?.1.split_once(to).map(|it| it.0);
    let of_change =
        || named("Give ", " priority ").or_else(|| named("Move ", " to ")).or_else(|| named(" of ", " to "));
    let name = Some(name.trim()).filter(|it| !it.is_empty()).or_else(of_change).expect(title);
    // A long name is shortened.
    let Some((response, _)) = figure.split_once(" / ").filter(|_| !name.contains('…')) else { return true };
    let (old, new) = response.split_once(" → ").unwrap_or((response, response));
    let is_in = |text: &str, state: &State| {
        let of_activity = |line: &&str| line.starts_with(&format!("{name} "));
        let mut lines = state.response_times.lines().filter(of_activity);
        match Time::parse(text.trim(), Unit::Milliseconds, Rounding::Exact) {
            Ok(time) => lines.any(|line| line.ends_with(&format!("Some({time:?})"))),
            Err(_) => lines.any(|line| line.ends_with("None")),
        }
    };
    is_in(old, before) && is_in(new, after)
}

/// The texts that a change makes, each edit of it within its file.
fn made(db: &Database, texts: &Texts, change: &Change) -> Vec<(PathBuf, String)> {
    let mut made = Vec::new();
    for of in &change.files {
        let path = of.file.path(db).clone();
        let text = &texts[&path];
        let mut end = TextSize::new(0);
        for edit in &of.edits {
            assert!(edit.range.start() >= end, "edits overlap: {:?}", of.edits);
            assert!(text.get(std::ops::Range::<usize>::from(edit.range)).is_some(), "{:?}", edit.range);
            end = edit.range.end();
        }
        let after = change.applied(db, of.file);
        if after != *text {
            made.push((path, after));
        }
    }
    made
}

/// A place of a text, or one with refactorings.
fn random_range(text: &str, is_model: bool, random: &mut Random) -> TextRange {
    if is_model && random.below(2) == 0 {
        let wanted = |kind: SyntaxKind| {
            matches!(kind, SyntaxKind::HOOK | SyntaxKind::TYPE | SyntaxKind::STATE_MACHINE)
        };
        let events = mauve_syntax::parse(text).syntax().preorder();
        let places = events.filter_map(|event| match event {
            WalkEvent::Enter(node) if wanted(node.kind()) => Some(node.text_range().start()),
            _ => None,
        });
        let places: Vec<TextSize> = places.collect();
        if !places.is_empty() {
            return TextRange::empty(*random.of(&places));
        }
    }
    TextRange::empty(TextSize::new(char_boundary(text, random.below(text.len() + 1)) as u32))
}

#[test]
fn a_fix_leaves_fewer_mistakes() {
    let seed = 1 + search::seed();
    let mut random = Random(seed);
    let mut offered: BTreeMap<&str, usize> = BTreeMap::new();
    for model in 0..search::cases("MAUVE_ACTIONS", 40) {
        let texts = random_model(seed.wrapping_mul(1_000_003).wrapping_add(model)).texts();
        let whole: Texts = texts.into_iter().collect();
        for _ in 0..4 {
            mend(&damaged(&whole, &mut random), &mut offered);
        }
    }
    assert!(offered.len() >= if search::is_full() { 8 } else { 4 }, "{offered:#?}");
    if std::env::var_os("MAUVE_ACTIONS").is_some() {
        println!("{offered:#?}");
    }
}

/// A name of a model is another one, or a token or an item is gone.
fn damaged(texts: &Texts, random: &mut Random) -> Texts {
    let mut texts = texts.clone();
    let models: Vec<PathBuf> = texts.keys().filter(|path| is_model(path)).cloned().collect();
    let text = texts.get_mut(random.of(&models)).unwrap();
    let tree = mauve_syntax::parse(text).syntax();
    let tokens = tree.descendants_with_tokens().filter_map(mauve_syntax::NodeOrToken::into_token);
    let is_name = random.below(2) > 0;
    let is_it = |token: &mauve_syntax::SyntaxToken| match is_name {
        true => token.parent().is_some_and(|it| it.kind() == SyntaxKind::NAME_REF),
        false => !token.kind().is_trivia(),
    };
    let mut ranges: Vec<TextRange> = tokens.filter(is_it).map(|token| token.text_range()).collect();
    if !is_name && random.below(4) > 0 {
        let items = [
            SyntaxKind::ACTIVITY,
            SyntaxKind::STATE,
            SyntaxKind::OPERATION_DEFINITION,
            SyntaxKind::OPERATION_DECLARATION,
            SyntaxKind::OPERATION_CONNECTION,
            SyntaxKind::CONNECTION,
        ];
        let all = tree.descendants().filter(|node| items.contains(&node.kind()));
        ranges = all.map(|node| node.text_range()).collect();
    }
    if !ranges.is_empty() {
        let range = std::ops::Range::<usize>::from(*random.of(&ranges));
        text.replace_range(range, if is_name { "unheard_of" } else { "" });
    }
    texts
}

fn mend(texts: &Texts, offered: &mut BTreeMap<&str, usize>) {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), texts.clone());
    let count = |db: &Database, workspace: Workspace| {
        let mut count: BTreeMap<(&str, String), usize> = BTreeMap::new();
        for it in workspace_diagnostics(db, workspace) {
            *count.entry((it.diagnostic.code.name, it.diagnostic.message.clone())).or_default() += 1;
        }
        count
    };
    let before = count(&db, workspace);
    let findings = workspace_diagnostics(&db, workspace);
    let is_meant = |code: &str| code.starts_with("unconnected-");
    for finding in
        findings.iter().filter(|it| it.severity == Severity::Error || is_meant(it.diagnostic.code.name))
    {
        let (file, range) = (finding.diagnostic.at.file(&db), finding.diagnostic.at.range(&db));
        let kinds = &[ActionKind::QuickFix, ActionKind::FixAll];
        let question = ActionQuestion { file, range, diagnostics: &[], kinds, changes: Changes::All };
        for action in code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question) {
            let Some(change) = &action.change else { continue };
            let made = made(&db, texts, change);
            let what = format!("{} {made:#?}", action.title);
            let mut after = texts.clone();
            after.extend(made);
            let new = Database::default();
            let workspace = Workspace::of_texts(&new, "/".into(), after);
            let after = count(&new, workspace);
            let syntax_errors = |of: &BTreeMap<(&str, String), usize>| {
                let all = of.iter().filter(|((code, _), _)| *code == "syntax-error");
                all.map(|(_, count)| count).sum::<usize>()
            };
            assert!(syntax_errors(&after) <= syntax_errors(&before), "{what}");
            let first = action.fixed.first().expect("it fixes something");
            let key = (first.diagnostic.code.name, first.diagnostic.message.clone());
            let left = after.get(&key).copied().unwrap_or_default();
            assert!(left < before[&key], "{key:?} is still there: {what}");
            *offered.entry(key.0).or_default() += 1;
        }
    }
}

/// The code, the file and the message of a finding.
type Key = (&'static str, PathBuf, String);

/// The findings of a workspace.
fn findings(db: &Database, workspace: Workspace) -> BTreeMap<Key, (Severity, usize)> {
    let mut found = BTreeMap::new();
    for it in workspace_diagnostics(db, workspace) {
        let of = &it.diagnostic;
        let key = (of.code.name, of.at.file(db).path(db).clone(), of.message.clone());
        found.entry(key).or_insert((it.severity, 0)).1 += 1;
    }
    found
}

/// Each quick fix alone, and then all fixes that an editor may apply unasked: what they are offered for is gone, these add no
/// error, and a second run has nothing to do.
#[test]
fn quick_fixes_remove_what_they_are_offered_for_and_all_together_end() {
    let (mut alone, mut together) = (0, 0);
    for (name, model) in models_of_pages() {
        let texts: Texts =
            mauve_tests::fixture(&model).into_iter().map(|(path, text)| (path.into(), text)).collect();
        let mut db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts.clone());
        let before = findings(&db, workspace);
        let mut new = Database::default();
        let fixed_workspace = Workspace::of_texts(&new, "/".into(), texts.clone());
        let actions_in = |db: &Database, file, range, kind| -> Vec<(String, Vec<Key>, Change)> {
            let question =
                ActionQuestion { file, range, diagnostics: &[], kinds: &[kind], changes: Changes::All };
            let project = project_with(db, workspace, file);
            let all = code_actions(db, &[workspace], project, question).into_iter().filter_map(|action| {
                let of = |it: &mauve_diagnostics::Finding<'_>| {
                    let it = &it.diagnostic;
                    (it.code.name, it.at.file(db).path(db).clone(), it.message.clone())
                };
                // Created files have a test of their own.
                let change = action.change.filter(|it| it.created.is_empty())?;
                Some((action.title, action.fixed.iter().map(of).collect(), change))
            });
            all.collect()
        };
        let places: BTreeSet<(PathBuf, TextSize)> = workspace_diagnostics(&db, workspace)
            .iter()
            .map(|it| (it.diagnostic.at.file(&db).path(&db).clone(), it.diagnostic.at.range(&db).start()))
            .collect();
        let of_diagnostics: BTreeSet<String> = workspace_diagnostics(&db, workspace)
            .iter()
            .flat_map(|it| it.diagnostic.fixes.iter().map(|fix| fix.title.clone()))
            .collect();
        for (path, offset) in places {
            let file = workspace.file(&db, &path).unwrap();
            for (title, fixed, change) in
                actions_in(&db, file, TextRange::empty(offset), ActionKind::QuickFix)
            {
                // A fix is an edit here.
                for (path, text) in &texts {
                    let Some(file) = fixed_workspace.file(&new, path) else { continue };
                    let of = change.files.iter().find(|it| it.file.path(&db) == path);
                    let text = of.map_or(text.clone(), |it| change.applied(&db, it.file));
                    if **file.text(&new) != *text {
                        file.set_text(&mut new, text.into());
                    }
                }
                let after = findings(&new, fixed_workspace);
                for key in fixed {
                    let [old, left] = [&before, &after].map(|of| of.get(&key).map_or(0, |it| it.1));
                    assert!(left < old, "{title:?} leaves {key:?} in {name}\n{model}");
                }
                let errors = after.iter().filter(|(_, (severity, _))| *severity == Severity::Error);
                // The fixes of the diagnostics have a test of their own, which names first steps. A declared operation is one:
                // every core of the shell defines it then.
                let is_first_step = of_diagnostics.contains(&title)
                    || ["Declare `", "Fix all "].iter().any(|it| title.starts_with(it));
                // A better period may not be enough, and the message has its figures.
                let missed = |all: &BTreeMap<Key, (Severity, usize)>| {
                    all.iter()
                        .filter(|(key, _)| key.0 == "deadline-missed")
                        .map(|(_, it)| it.1)
                        .sum::<usize>()
                };
                for (key, (_, count)) in errors.filter(|_| !is_first_step) {
                    let is_old = match key.0 {
                        "deadline-missed" => missed(&after) <= missed(&before),
                        _ => before.get(key).is_some_and(|it| it.1 >= *count),
                    };
                    assert!(is_old, "{title:?} adds {key:?} in {name}\n{model}");
                }
                alone += 1;
            }
        }
        for path in texts.keys() {
            let Some(file) = workspace.file(&db, path) else { continue };
            let range = TextRange::empty(0.into());
            let Some((_, _, change)) = actions_in(&db, file, range, ActionKind::FixAll).pop() else {
                continue;
            };
            together += 1;
            let text = change.applied(&db, file);
            file.set_text(&mut db, text.into());
            let after = findings(&db, workspace);
            let errors = after.iter().filter(|(_, (severity, _))| *severity == Severity::Error);
            for (key, (_, count)) in errors {
                assert!(
                    before.get(key).is_some_and(|it| it.1 >= *count),
                    "{key:?} is new in {name}\n{model}"
                );
            }
            let again = actions_in(&db, file, range, ActionKind::FixAll);
            assert!(again.is_empty(), "{again:?} in {name}\n{model}");
            file.set_text(&mut db, texts[path].as_str().into());
        }
    }
    assert!(alone > 400 && together > 5, "{alone} alone, {together} together");
}
