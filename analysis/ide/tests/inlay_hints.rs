//! Every hint of random deployments fits, and every title of an action; and while a model is typed, older figures stand only where the text has none.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::ops::Range;

use mauve_diagnostics::figure::HintStatus;
use mauve_diagnostics::{Extent, findings_of};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, File, Workspace, names_of, projects};
use mauve_ide::{
    ActionKind, ActionQuestion, Changes, CodeAction, EarlierFigures, HintOptions, InlayHint, code_actions,
    hash_of_hints, inlay_hints,
};
use mauve_syntax::{TextRange, TextSize};
use mauve_tests::{Random, fixture, models, random_model, search, texts_moved};
use mauve_wcrt::{Query, response_times};

use crate::{project_of, project_with};

/// The maximum length of a hint.
const MOST_CHARACTERS: usize = 32;

/// The maximum length of the title of an action.
const LONGEST_TITLE: usize = 80;

fn hints(db: &Database, workspace: Workspace, file: File, earlier: &EarlierFigures) -> Vec<InlayHint> {
    let all = TextRange::up_to(TextSize::of(&**file.text(db)));
    let of = |project| inlay_hints(db, project, file, all, HintOptions::default(), earlier);
    project_with(db, workspace, file).map(of).unwrap_or_default()
}

/// Returns a number below one of the bounds.
fn below_one_of(random: &mut Random, bounds: &[usize]) -> usize {
    let bound = *random.of(bounds);
    random.below(bound)
}

/// A deployment with short and long names, short and long times, several CPUs, and activities that are not analysed.
fn deployment(random: &mut Random) -> String {
    let (mut model, mut instances, mut activities) = (String::new(), String::new(), String::new());
    let mut times = "unit = \"ms\"\n[codel]\n".to_owned();
    for number in 0..1 + random.below(6) {
        let name = format!("{}{number}", "n".repeat(1 + below_one_of(random, &[3, 12, 40])));
        let _ = writeln!(model, "codel plan_{name}(): int\nshell S_{name} {{ property rate: double = 1.5 }}");
        let _ = writeln!(model, "core C_{name}(S_{name}) {{ update = {{ plan_{name}(); }} }}");
        let _ = writeln!(model, "component P_{name}(S_{name}, C_{name})");
        let _ = writeln!(instances, "instance {name}: P_{name}\nproperty {name}.rate = 1.0 / 3.0");
        let period = 1 + below_one_of(random, &[20, 2_000, 2_000_000]);
        let time = period * (1 + random.below(40)) / 100;
        if random.below(12) > 0 {
            let _ = writeln!(times, "plan_{name} = {time}.{:06}", random.below(1_000_000));
        }
        let affinity = 1 + below_one_of(random, &[1, 3, 255]);
        let priority = 1 + random.below(90);
        let _ = writeln!(
            activities,
            "activity {name} {{ priority = {priority} period = {period} affinity = {affinity} }}"
        );
    }
    let assumed = *random.of(&["", "", "[assume]\ncodel = \"1 ms\"\n"]);
    format!(
        "//- /robot.mal\n{model}architecture A {{\n{instances}}}\ndeployment D {{\narchitecture A\n{activities}}}\n\
         //- /mauve.toml\n[timing]\ntables = [\"times.toml\"]\n{assumed}//- /times.toml\n{times}"
    )
}

#[test]
fn every_hint_and_title_of_random_deployments_fits() {
    every_hint_and_title_fits(22, 0..15);
}

#[test]
fn every_hint_and_title_of_more_random_deployments_fits() {
    every_hint_and_title_fits(23, 15..30);
}

fn words(label: &str) -> Vec<&str> {
    label.split(' ').collect()
}

fn every_hint_and_title_fits(seed: u64, models: Range<u64>) {
    let mut random = Random::of_seed(seed + (search::seed() << 8));
    let mut statuses: BTreeMap<&str, u64> = BTreeMap::new();
    let mut titles = 0;
    let mut check = |texts: Vec<(String, String)>, with_titles: bool| {
        let db = Database::default();
        let paths: Vec<String> = texts.iter().map(|(path, _)| path.clone()).collect();
        let files = texts.into_iter().map(|(path, text)| (path.into(), text));
        let workspace = Workspace::of_texts(&db, "/".into(), files);
        for file in paths.iter().filter_map(|path| workspace.file(&db, path.as_ref())) {
            let shown = hints(&db, workspace, file, &EarlierFigures::default());
            // At the last activity, the priorities of the whole deployment are offered, too.
            let is_marked = |hint: &&InlayHint| hint.labels.last().is_some_and(|it| it.chars().count() == 1);
            let explained = shown.iter().filter(is_marked);
            let last = explained.filter_map(|hint| hint.explained_at).next_back();
            if let Some(offset) = last.filter(|_| with_titles) {
                let range = TextRange::empty(offset);
                let kinds = &[ActionKind::QuickFix, ActionKind::Rewrite];
                let question =
                    ActionQuestion { file, range, diagnostics: &[], kinds, changes: Changes::None };
                for CodeAction { title, .. } in
                    code_actions(&db, &[workspace], project_with(&db, workspace, question.file), question)
                {
                    assert!((1..=LONGEST_TITLE).contains(&title.chars().count()), "{title}");
                    titles += 1;
                }
            }
            for hint in shown {
                let lengths: Vec<usize> = hint.labels.iter().map(|label| label.chars().count()).collect();
                assert!(lengths.iter().all(|it| (1..=MOST_CHARACTERS).contains(it)), "{hint:?}");
                // In fewer and fewer words.
                assert!(lengths.is_sorted_by(|longer, shorter| longer > shorter), "{hint:?}");
                assert!(hint.labels.contains(&hint.label), "{hint:?}");
                // A client that knows nothing of the other labels shows the response time as well.
                if let [mark @ ("✓" | "!" | "✗"), response, "/", ..] = words(&hint.labels[0])[..] {
                    let known = [mark, response];
                    assert!(words(&hint.label).starts_with(&known), "{hint:?}");
                    *statuses.entry("response time").or_default() += 1;
                }
                let rest = &file.text(&db)[usize::from(hint.offset)..];
                assert!(rest.lines().next().unwrap_or_default().trim().is_empty(), "{hint:?} moves `{rest}`");
                *statuses.entry(hint.status.name()).or_default() += 1;
            }
        }
    };
    let deployments: u64 = search::cases("MAUVE_HINTS", 500);
    // To search for better priorities, which a title names, takes far longer than all else.
    for number in 0..deployments {
        check(fixture(&deployment(&mut random)), search::is_full() || number % 10 == 0);
    }
    for seed in models.filter(|it| search::is_searched(*it as usize)) {
        check(random_model(seed).written().files.into_iter().collect(), true);
    }
    assert!(titles > if search::is_full() { deployments } else { deployments / 10 }, "{titles}");
    for (status, least) in [
        ("met", 500),
        ("tight", 10),
        ("missed", 50),
        ("unknown", 150),
        ("value", 150),
        ("response time", 500),
    ] {
        let count = statuses.get(status).copied().unwrap_or_default();
        assert!(count * 500 >= least * deployments, "{status}: {statuses:?}");
    }
}

/// Replays random typing in the sample robot: words and braces are removed and typed again, in a model and in its table.
#[test]
fn older_figures_stand_only_where_the_text_has_none() {
    let texts = texts_moved(&models().join("p3dx"), "/");
    let mut db = Database::default();
    let paths: Vec<_> = texts.iter().map(|(path, _)| path.clone()).collect();
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let files: Vec<File> = paths.iter().filter_map(|path| workspace.file(&db, path)).collect();
    let mut random = Random::of_seed(7);
    let mut earlier = EarlierFigures::default();
    let options = HintOptions::default();
    let (mut older, mut hidden) = (0, 0);
    // Response times, and what hints have shown as current figures.
    let mut current: BTreeSet<String> = BTreeSet::new();
    for step in 0..150 {
        let file = *random.of(&files);
        let whole = file.text(&db).to_string();
        let texts: Vec<String> = match step {
            0 => vec![whole],
            _ => typing(&whole, &mut random),
        };
        for text in texts {
            file.set_text(&mut db, text.into());
            let with_projects: Vec<_> =
                files.iter().map(|&file| (file, project_with(&db, workspace, file))).collect();
            earlier = earlier.updated(&db, &with_projects, &[], options, false);
            current.extend(responses(&db, workspace));
            for &file in &files {
                let text = file.text(&db).clone();
                let now = hints(&db, workspace, file, &EarlierFigures::default());
                let shown = hints(&db, workspace, file, &earlier);
                for label in now.iter().flat_map(|hint| hint.labels.iter()) {
                    current.extend(label.split([' ', '·']).map(str::to_owned));
                }
                for hint in &shown {
                    if hint.status != HintStatus::Older {
                        assert!(now.contains(hint), "{hint:?} is not in the text:\n{text}");
                        assert!(!hint.labels.iter().any(|it| it.contains("… ")), "{hint:?}");
                        continue;
                    }
                    older += 1;
                    let is_marked = |label: &String| label == "…" || label.contains("… ");
                    assert!(hint.labels.iter().all(is_marked), "{hint:?}");
                    assert!(hint.label.chars().count() <= MOST_CHARACTERS, "{hint:?}");
                    let figure =
                        hint.label.split(' ').find(|word| word.starts_with(|it: char| it.is_ascii_digit()));
                    assert!(figure.is_none_or(|it| current.contains(it)), "{hint:?} was never a figure");
                    // The text itself has no figure there.
                    let is_figure = |it: &&InlayHint| {
                        it.explained_at == hint.explained_at && it.label.starts_with(['✓', '!'])
                    };
                    assert_eq!(now.iter().find(is_figure), None, "{hint:?}");
                }
                hidden += now.len().saturating_sub(shown.len());
                for finding in &findings_of(&db, workspace, file, Extent::All).shown {
                    let message = &finding.diagnostic.message;
                    assert!(!message.contains("… "), "{message}");
                }
                // The hash says when hints change.
                let hash =
                    |earlier| hash_of_hints(&db, project_of(&db, workspace, file), file, options, earlier);
                if hash(&earlier) == hash(&EarlierFigures::default()) {
                    assert!(!shown.iter().any(|hint| hint.status == HintStatus::Older), "{shown:?}");
                }
            }
        }
    }
    assert!(older > 1000, "{older}");
    assert_eq!(hidden, 0, "hints without older figures are more");
}

/// Returns the response times of all deployments.
fn responses(db: &Database, workspace: Workspace) -> Vec<String> {
    let mut found = Vec::new();
    for &project in projects(db, workspace) {
        let all = names_of(db, project).all.iter().copied();
        for deployment in all.filter(|it| it.kind(db) == Kind::Deployment) {
            let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
            found.extend(report.activities.iter().filter_map(|it| Some(it.response?.number())));
        }
    }
    found
}

/// The texts while a part of `text` is removed and typed again.
fn typing(text: &str, random: &mut Random) -> Vec<String> {
    let starts: Vec<usize> = text.char_indices().map(|(index, _)| index).collect();
    let Some(&start) = starts.get(random.below(starts.len().max(1))) else { return Vec::new() };
    let end = starts
        .iter()
        .copied()
        .filter(|it| *it > start)
        .take(1 + random.below(8))
        .last()
        .unwrap_or(text.len());
    let removed = &text[start..end];
    let lengths = removed.char_indices().map(|(index, _)| index).chain([removed.len()]);
    lengths.map(|length| format!("{}{}{}", &text[..start], &removed[..length], &text[end..])).collect()
}
