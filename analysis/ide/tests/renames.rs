//! Names changed at random, in the sample robots and in random models: the model stays what it was, but for the name.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, File, Workspace, names_of, projects};
use mauve_ide::{Change, definition, prepare_rename, references, rename};
use mauve_syntax::{TextRange, TextSize};
use mauve_tests::{Random, models, random_model, search, texts_moved};
use mauve_wcrt::{Query, response_times};

use crate::project_of;

type Texts = BTreeMap<PathBuf, String>;

/// The folder of each workspace.
const FOLDER: &str = "/w";
/// No model has it.
const FRESH: &str = "quite_another_9";

struct Opened {
    db: Database,
    workspace: Workspace,
}

fn open(texts: &Texts) -> Opened {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, FOLDER.into(), texts.clone());
    Opened { db, workspace }
}

impl Opened {
    fn file(&self, path: &Path) -> File {
        self.workspace.file(&self.db, path).unwrap()
    }

    fn rename(&self, path: &Path, at: usize, name: &str) -> Result<Change, String> {
        rename(&self.db, &[self.workspace], self.file(path), TextSize::new(at as u32), name)
    }

    fn after(&self, change: &Change) -> Texts {
        let text = |(path, &file): (&PathBuf, &File)| (path.clone(), change.applied(&self.db, file));
        self.workspace.files(&self.db).iter().map(text).collect()
    }

    /// What is wrong, by line, and every response time; each with `from` written as `to`.
    fn says(&self, from: &str, to: &str) -> Vec<String> {
        let db = &self.db;
        let mut said = Vec::new();
        for finding in workspace_diagnostics(db, self.workspace) {
            let found = &finding.diagnostic;
            // Some names are words of C++, and others are not.
            if found.code.name == "reserved-name" {
                continue;
            }
            let (file, range) = (found.at.file(db), found.at.range(db));
            let line = file.text(db)[..range.start().into()].matches('\n').count();
            let mut message = replaced(&found.message, from, to);
            // It lists ports in the order of their names.
            if found.code.name == "unconnected-input" {
                let mut words: Vec<&str> = message.split([' ', ',']).collect();
                words.sort_unstable();
                message = words.join(" ");
            }
            said.push(format!("{}:{line} {} {message}", file.path(db).display(), found.code.name));
        }
        for &project in projects(db, self.workspace) {
            for &decl in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Deployment) {
                for activity in &response_times(db, project, decl, Query::shown(db, project, decl)).activities
                {
                    let of = replaced(&activity.instance, from, to);
                    let (own, response) = (activity.own, activity.response);
                    said.push(format!("{of}: {own:?} {response:?} {}", activity.verdict.name()));
                }
            }
        }
        said.sort();
        said
    }

    /// Where each other name leads.
    fn leads(&self, texts: &Texts, moved: &dyn Fn(&Path, usize) -> usize) -> Vec<String> {
        let mut all = Vec::new();
        for (path, text) in texts {
            for (at, _) in words(text) {
                let found = definition(
                    &self.db,
                    project_of(&self.db, self.workspace, self.file(path)),
                    self.file(path),
                    TextSize::new(at as u32),
                );
                for target in found.iter().flat_map(|found| &found.targets) {
                    let (to, start) = (target.file.path(&self.db), usize::from(target.name.start()));
                    let (at, start) = (moved(path, at), moved(to, start));
                    all.push(format!("{} {at} -> {} {start}", path.display(), to.display()));
                }
            }
        }
        all.sort();
        all
    }
}

/// The words of a text, and where they begin.
fn words(text: &str) -> Vec<(usize, &str)> {
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let mut found = Vec::new();
    let mut start = 0;
    for piece in text.split(|letter| !is_part(letter)) {
        if piece.starts_with(|first: char| !first.is_ascii_digit()) {
            found.push((start, piece));
        }
        start += piece.len();
        start += text[start..].chars().next().map_or(0, char::len_utf8);
    }
    found
}

/// A text with another word for one.
fn replaced(text: &str, from: &str, to: &str) -> String {
    let mut out = String::new();
    let mut end = 0;
    for (start, word) in words(text).into_iter().filter(|(_, word)| *word == from) {
        out += &text[end..start];
        out += to;
        end = start + word.len();
    }
    out + &text[end..]
}

/// The models and tables of a sample, as they stand beside the folder of the workspace or in it.
fn folder(name: &str) -> Texts {
    let inside = texts_moved(&models().join(name), FOLDER);
    let beside = if name == "p3dx" { Vec::new() } else { texts_moved(&models().join("p3dx"), "/p3dx") };
    inside.into_iter().chain(beside).collect()
}

fn random(seed: u64) -> Texts {
    let written = random_model(seed).written();
    written.files.into_iter().map(|(path, text)| (PathBuf::from(format!("{FOLDER}{path}")), text)).collect()
}

/// Renames what stands there, and back; gives whether it could be renamed.
fn there_and_back(texts: &Texts, path: &Path, at: usize) -> bool {
    let before = open(texts);
    let Ok(named) =
        prepare_rename(&before.db, &[before.workspace], before.file(path), TextSize::new(at as u32))
    else {
        return false;
    };
    let what = format!("{} at {} {at}", named.name, path.display());
    let change = before.rename(path, at, FRESH).unwrap_or_else(|why| panic!("{what}: {why}"));
    // Nothing but the name changes, and that wherever it is referred to.
    let mut places = Vec::new();
    for of_file in &change.files {
        for edit in &of_file.edits {
            assert_eq!(
                (&of_file.file.text(&before.db)[edit.range], edit.text.as_str()),
                (&*named.name, FRESH)
            );
            places.push((of_file.file, edit.range));
        }
    }
    let found =
        references(&before.db, &[before.workspace], before.file(path), TextSize::new(at as u32), true);
    let mut found: Vec<(File, TextRange)> = found.iter().map(|it| (it.file, it.range)).collect();
    let key = |(file, range): &(File, TextRange)| (file.path(&before.db).clone(), range.start());
    places.sort_by_key(key);
    found.sort_by_key(key);
    assert_eq!(places, found, "{what}");
    let texts_after = before.after(&change);
    let after = open(&texts_after);
    assert_eq!(before.says(&named.name, FRESH), after.says(&named.name, FRESH), "{what}");
    let here = words(&texts_after[path]).into_iter().find(|(_, word)| *word == FRESH).unwrap().0;
    let back = after.rename(path, here, &named.name).unwrap_or_else(|why| panic!("{what}: {why}"));
    assert_eq!(&after.after(&back), texts, "{what}");
    true
}

/// Renames what stands there to a name that is in use: nothing changes its meaning, or it is refused.
fn to_another(texts: &Texts, path: &Path, at: usize, name: &str) -> Option<bool> {
    let before = open(texts);
    let at_name =
        prepare_rename(&before.db, &[before.workspace], before.file(path), TextSize::new(at as u32));
    let old = at_name.ok()?.name;
    let Ok(change) = before.rename(path, at, name) else { return Some(false) };
    let after_texts = before.after(&change);
    let after = open(&after_texts);
    let moved = |path: &Path, at: usize| {
        let edits = change.files.iter().find(|it| it.file.path(&before.db) == path).map(|it| &it.edits);
        let edits = edits.map_or(&[][..], |edits| edits);
        let before = edits.iter().filter(|edit| usize::from(edit.range.end()) <= at).count();
        (at + before * name.len()) - before * old.len()
    };
    let what = format!("{old} to {name} at {} {at}", path.display());
    assert_eq!(before.leads(texts, &moved), after.leads(&after_texts, &|_, at| at), "{what}");
    // Which it is, and where; what a message advises is another thing with other names.
    let codes = |opened: &Opened| {
        let said = opened.says("", "").into_iter();
        let mut codes: Vec<String> =
            said.map(|it| it.split(' ').take(2).collect::<Vec<_>>().join(" ")).collect();
        codes.retain(|it| it.contains(".mal:") || it.contains(".toml:"));
        codes
    };
    let (old, new) = (codes(&before), codes(&after));
    let differs = old.iter().filter(|it| !new.contains(it)).chain(new.iter().filter(|it| !old.contains(it)));
    assert_eq!(differs.collect::<Vec<_>>(), [] as [&str; 0], "{what}");
    Some(true)
}

fn all_words(texts: &Texts) -> Vec<(PathBuf, usize, String)> {
    let mut all = Vec::new();
    for (path, text) in texts {
        all.extend(words(text).into_iter().map(|(at, word)| (path.clone(), at, word.to_owned())));
    }
    all
}

fn steps(default: u64) -> usize {
    search::cases("MAUVE_RENAMES", default)
}

#[test]
fn a_robot_stays_what_it_is() {
    let mut random = Random(0x5eed + (search::seed() << 16));
    for name in ["p3dx", "p3dx_entry"] {
        let texts = folder(name);
        let all = all_words(&texts);
        let mut renamed = 0;
        for _ in 0..steps(60) {
            let (path, at, _) = random.of(&all);
            renamed += usize::from(there_and_back(&texts, path, *at));
        }
        assert!(renamed > steps(60) / 6, "{renamed} of {name}");
    }
}

#[test]
fn a_random_model_stays_what_it_is() {
    let mut chosen = Random(0x5eed + (search::seed() << 16));
    let mut renamed = 0;
    for seed in search::seeds("MAUVE_RENAMES", 40) {
        let texts = random(seed);
        let all = all_words(&texts);
        for _ in 0..6 {
            let (path, at, _) = chosen.of(&all);
            renamed += usize::from(there_and_back(&texts, path, *at));
        }
    }
    assert!(renamed > steps(40), "{renamed}");
}

#[test]
fn a_name_in_use_is_refused_or_does_no_harm() {
    let mut chosen = Random(0x5eed + (search::seed() << 16));
    let (mut done, mut refused) = (0, 0);
    for seed in search::seeds("MAUVE_RENAMES", 40) {
        let texts = if seed == 0 { folder("p3dx") } else { random(seed) };
        let all = all_words(&texts);
        for _ in 0..6 {
            let (path, at, _) = chosen.of(&all);
            // Those near it are those that matter.
            let near: Vec<&String> =
                all.iter().filter(|(of, ..)| of == path).map(|(.., word)| word).collect();
            match to_another(&texts, path, *at, near[chosen.below(near.len())]) {
                Some(true) => done += 1,
                Some(false) => refused += 1,
                None => {}
            }
        }
    }
    assert!(done > steps(40) / 4 && refused > steps(40) / 4, "{done} done, {refused} refused");
}
