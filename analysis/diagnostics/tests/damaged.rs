//! The damage that several properties are tested on: the projects, the kinds of damage, the loop over the cases, and the
//! report of a failure.
//!
//! A case has random numbers of its own, which depend on `MAUVE_SEED`. In each case, the tree of a damaged file has the
//! file's text and equals that of a new parse, and each diagnostic that a property reads lies between two characters of its
//! file.

use std::collections::BTreeMap;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};

use mauve_diagnostics::{Finding, workspace_diagnostics};
use mauve_hir::{Database, Location, Workspace};
use mauve_tests::{Random, char_boundary, random_model, search, texts_in};
use mauve_timing::{Level, Method, Time};
use mauve_wcrt::{Query, response_times};

use crate::common::deployments;

/// The paths and texts of a project.
pub(crate) type Texts = Vec<(PathBuf, String)>;

/// A project that can be damaged.
pub(crate) struct Project {
    folder: PathBuf,
    texts: Texts,
}

/// A damaged project in a database.
pub(crate) struct Damaged<'a> {
    pub(crate) db: &'a Database,
    pub(crate) workspace: Workspace,
    /// The number of the case.
    number: u64,
    /// What was done, one after the other.
    pub(crate) done: &'a [String],
    /// Whether a timing table or `mauve.toml` is damaged.
    pub(crate) is_in_table: bool,
}

/// Checks `count` cases. Other salts are other cases.
pub(crate) fn cases(count: u64, salt: u64, mut check: impl FnMut(u64, &mut Random)) {
    let seed = search::seed();
    for case in 0..count {
        let start = ((seed << 12) + salt).wrapping_mul(1 << 40).wrapping_add(case + 1);
        let mut random = Random(0x9e37_79b9_7f4a_7c15 ^ start.wrapping_mul(0xd134_2543_de82_ef95));
        let checked = catch_unwind(AssertUnwindSafe(|| check(case, &mut random)));
        if let Err(failure) = checked {
            eprintln!("case {case} of {count} with salt {salt}");
            resume_unwind(failure);
        }
    }
}

impl Project {
    /// The sample with this name.
    pub(crate) fn sample(name: &str) -> Project {
        let folder = mauve_tests::models().join(name);
        Project { texts: texts_in(&folder), folder }
    }

    pub(crate) fn random(seed: u64) -> Project {
        Project { folder: "/".into(), texts: random_model(seed).texts() }
    }

    pub(crate) fn fixture(text: &str) -> Project {
        let texts = mauve_tests::fixture(text).into_iter().map(|(path, text)| (path.into(), text));
        Project { folder: "/".into(), texts: texts.collect() }
    }

    /// Puts each model on one line: recovery goes by lines.
    pub(crate) fn on_one_line(mut self) -> Project {
        let is_model = |path: &Path| path.extension().is_some_and(|it| it == "mal");
        for (_, text) in self.texts.iter_mut().filter(|(path, _)| is_model(path)) {
            *text = text.replace('\n', " ");
        }
        self
    }

    pub(crate) fn open(&self, db: &Database) -> Workspace {
        Workspace::of_texts(db, self.folder.clone(), self.texts.iter().cloned())
    }

    /// Returns the response times without damage, where there are no such errors.
    pub(crate) fn responses(&self, is_error: fn(&Finding<'_>) -> bool) -> Responses {
        let db = Database::default();
        let workspace = self.open(&db);
        assert_eq!(
            workspace_diagnostics(&db, workspace).into_iter().filter(is_error).collect::<Vec<_>>(),
            []
        );
        responses(&db, workspace)
    }

    /// Checks `count` cases, each with other damage. If damage gathers, some files stay damaged in the following cases.
    pub(crate) fn damage(
        &self,
        (count, salt): (u64, u64),
        gathers: bool,
        damage: impl Fn(&mut Texts, &mut Random) -> Vec<String>,
        mut check: impl FnMut(&Damaged<'_>),
    ) {
        let mut db = Database::default();
        let workspace = self.open(&db);
        cases(count, salt, |number, random| {
            let mut texts = self.texts.clone();
            let done = damage(&mut texts, random);
            let changed: Vec<_> = self.texts.iter().zip(&texts).filter(|(old, new)| old != new).collect();
            let checked = catch_unwind(AssertUnwindSafe(|| {
                for (_, (path, text)) in &changed {
                    let new = mauve_syntax::parse(text);
                    assert!(new.syntax().text() == text.as_str(), "the tree has another text");
                    let file = workspace.file(&db, path).unwrap();
                    file.set_text(&mut db, text.as_str().into());
                    assert!(*mauve_hir::parse(&db, file) == new, "a reparse gives another tree");
                }
                let is_in_table = changed.iter().any(|(old, _)| is_table(&old.0));
                check(&Damaged { db: &db, workspace, number, done: &done, is_in_table });
            }));
            if let Err(failure) = checked {
                eprintln!("{}: {}", self.folder.display(), done.join(", then "));
                changed.iter().for_each(|(_, (path, text))| eprintln!("//- {}\n{text}", path.display()));
                resume_unwind(failure);
            }
            for ((path, text), _) in changed {
                if !gathers || random.below(4) > 0 {
                    workspace.file(&db, path).unwrap().set_text(&mut db, text.as_str().into());
                }
            }
        });
    }
}

impl Damaged<'_> {
    /// Checks that the locations of all diagnostics lie in the texts, and returns the diagnostics.
    pub(crate) fn findings(&self) -> Vec<Finding<'_>> {
        let found = workspace_diagnostics(self.db, self.workspace);
        for Finding { diagnostic, .. } in &found {
            let mut locations: Vec<&Location<'_>> = vec![&diagnostic.at];
            locations.extend(diagnostic.related.iter().map(|(at, _)| at));
            locations.extend(diagnostic.fixes.iter().flat_map(|fix| fix.edits.iter().map(|(at, _)| at)));
            for at in locations {
                let (range, text) = (at.range(self.db), at.file(self.db).text(self.db));
                let is_in_text = text.get(Range::<usize>::from(range)).is_some();
                assert!(is_in_text, "{}: {range:?} of {} bytes", diagnostic.code.name, text.len());
            }
        }
        found
    }

    pub(crate) fn responses(&self) -> Responses {
        responses(self.db, self.workspace)
    }

    /// Compares response times and diagnostics with those of a new database, in every third case.
    pub(crate) fn compare_with_new_database(&self) {
        if !self.number.is_multiple_of(3) {
            return;
        }
        let texts = self.workspace.files(self.db).iter();
        let texts: Texts = texts.map(|(path, file)| (path.clone(), file.text(self.db).to_string())).collect();
        let new = Database::default();
        let workspace = Workspace::of_texts(&new, self.workspace.folder(self.db).clone(), texts);
        assert_eq!(self.responses(), responses(&new, workspace));
        let shown = |db: &Database, workspace| -> Vec<_> {
            let all = workspace_diagnostics(db, workspace).into_iter().map(|it| it.diagnostic);
            all.map(|it| (it.at.file(db).path(db).clone(), it.at.range(db), it.message.clone())).collect()
        };
        assert_eq!(shown(self.db, self.workspace), shown(&new, workspace));
    }
}

pub(crate) fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|it| it == "toml")
}

/// A deployment, an instance, a method.
pub(crate) type Activity = (String, String, &'static str);

pub(crate) type Responses = BTreeMap<Activity, Option<Time>>;

/// Returns the response times of all activities by two methods.
pub(crate) fn responses(db: &Database, workspace: Workspace) -> Responses {
    let mut responses = BTreeMap::new();
    for (project, deployment) in deployments(db, workspace) {
        for (method, name) in [(Method::Psm, "psm"), (Method::Classic, "classic")] {
            let query = Query { level: Level::from_f64(1e-3).unwrap(), method };
            for activity in &response_times(db, project, deployment, query).activities {
                let key = (deployment.name(db).to_string(), activity.instance.to_string(), name);
                responses.insert(key, activity.response);
            }
        }
    }
    responses
}

// The kinds of damage. Each changes texts, and returns what it did.

/// Any kind.
pub(crate) fn any(texts: &mut Texts, random: &mut Random) -> String {
    match random.below(4) {
        0 => token(texts, random),
        1 => span(texts, random),
        _ => near(texts, random),
    }
}

/// Means nothing where it is put.
const JUNK: [&str; 16] =
    ["qqq", "{", "}", "(", ")", ";", "=", ".", ":", "->", "§", "\"", "/*", "\n", "if", "transition"];

/// Deletes a token, puts something in its place or before it, or cuts off its line.
pub(crate) fn token(texts: &mut Texts, random: &mut Random) -> String {
    let file = random.below(texts.len());
    let text = &texts[file].1;
    let token = token_of(text, random);
    let junk = JUNK[random.below(JUNK.len())];
    let rest = &text[token.start..];
    let (range, put) = match random.below(4) {
        0 => (token, String::new()),
        1 => (token.start..token.start, format!(" {junk} ")),
        2 => (token, junk.to_owned()),
        // From somewhere in the token on.
        _ => {
            let cut = char_boundary(rest, random.below(token.len() + 1));
            let end = rest.find('\n').unwrap_or(rest.len()).max(cut);
            (token.start + cut..token.start + end, String::new())
        }
    };
    let what = format!("{}: {:?} becomes {put:?}", place(texts, file, range.start), &text[range.clone()]);
    texts[file].1.replace_range(range, &put);
    what
}

fn token_of(text: &str, random: &mut Random) -> Range<usize> {
    let lexed = mauve_syntax::lex(text);
    if lexed.is_empty() { 0..0 } else { lexed.range(random.below(lexed.len())) }
}

fn place(texts: &Texts, file: usize, at: usize) -> String {
    let (path, text) = &texts[file];
    let line = text[..at].matches('\n').count() + 1;
    format!("{}:{line}", path.file_name().unwrap().display())
}

/// Deletes, duplicates or moves a span, or swaps it with another, within a file or across files.
pub(crate) fn span(texts: &mut Texts, random: &mut Random) -> String {
    let file = random.below(texts.len());
    let other = if random.below(4) == 0 { random.below(texts.len()) } else { file };
    let unit = random.below(3);
    let (text, other_text) = (&texts[file].1, &texts[other].1);
    let span = span_of(text, unit, random);
    let piece = text[span.clone()].to_owned();
    let from = place(texts, file, span.start);
    let deletion = (file, span.clone(), String::new());
    let (what, mut edits) = match random.below(4) {
        0 => (format!("{from}: {piece:?} is gone"), vec![deletion]),
        kind @ (1 | 2) => {
            let at = token_of(other_text, random).start;
            let is_inside = other == file && span.start < at && at < span.end;
            let at = if is_inside { span.end } else { at };
            let verb = if kind == 1 { "also stands" } else { "stands" };
            let what = format!("{from}: {piece:?} {verb} at {}", place(texts, other, at));
            let insertion = (other, at..at, format!(" {piece} "));
            (what, if kind == 1 { vec![insertion] } else { vec![insertion, deletion] })
        }
        _ => {
            let second = span_of(other_text, unit, random);
            let put = other_text[second.clone()].to_owned();
            let place = place(texts, other, second.start);
            let what = format!("{from}: {piece:?} and {place}: {put:?} are swapped");
            let overlaps = other == file && span.start < second.end && second.start < span.end;
            (what, if overlaps { vec![deletion] } else { vec![(file, span, put), (other, second, piece)] })
        }
    };
    // The last edit of a file first.
    edits.sort_by_key(|(_, range, _)| std::cmp::Reverse((range.start, range.end)));
    for (file, range, put) in edits {
        texts[file].1.replace_range(range, &put);
    }
    what
}

/// Some tokens, some lines, or what brackets enclose, at times without them.
fn span_of(text: &str, unit: usize, random: &mut Random) -> Range<usize> {
    let lexed = mauve_syntax::lex(text);
    if lexed.is_empty() {
        return 0..0;
    }
    let first = random.below(lexed.len());
    let tokens = |count: usize| {
        let last = (first + count).min(lexed.len() - 1);
        lexed.range(first).start..lexed.range(last).end
    };
    match unit {
        0 => tokens(random.below(6)),
        1 => {
            let at = lexed.range(first).start;
            let start = text[..at].rfind('\n').map_or(0, |at| at + 1);
            let count = 1 + random.below(4);
            let end =
                text[start..].match_indices('\n').nth(count - 1).map_or(text.len(), |(at, _)| start + at + 1);
            start..end
        }
        _ => {
            let bracket = |index: usize| &text[lexed.range(index)];
            let Some(open) = (first..lexed.len()).find(|&it| matches!(bracket(it), "{" | "(" | "[")) else {
                return tokens(1);
            };
            let mut depth = 0;
            let close = (open..lexed.len()).find(|&it| {
                match bracket(it) {
                    "{" | "(" | "[" => depth += 1,
                    "}" | ")" | "]" => depth -= 1,
                    _ => {}
                }
                depth == 0
            });
            let Some(close) = close else { return tokens(2) };
            let (open, close) = (lexed.range(open), lexed.range(close));
            match random.below(3) {
                0 => open.end..close.start,
                1 => open.start..close.end,
                // With what stands before it, such as `f(…)` or `state A { … }`.
                _ => {
                    let before = (0..first).rev().find(|&it| matches!(bracket(it), ";" | "{" | "}" | "\n"));
                    before.map_or(open.start, |it| lexed.range(it).end).min(open.start)..close.end
                }
            }
        }
    }
}

/// What makes the rest of a text something else.
const WORDS: &str = "include|library|use|codel|shell|extends|constant|property|input port|output|require|provide|core|var|\
    handler|configure|update|statemachine|initial state|transition|if|then|else|return|component|architecture|import|instance|\
    connection|operation|deployment|activity|priority|background|in|inout|true|new_data|{|}|(|)|[|]|;|:|::|.|,|->|=|==|\"|/*|*/|\
    //|\\|0x|1e|99999999999999999999|9|1e-3|\u{1b}";

const LETTERS: [&str; 14] = [
    "§", "é", "日本", "🤖", "e\u{301}", "\u{feff}", "\u{200d}", "\u{2028}", "\0", "\r", "\t", "\r\n", "'",
    "\u{a0}",
];

const NESTED: [&str; 10] = ["{", "(", "if a then {", "} else {", "a + ", "!", "-", "f(", "/*", "library x {"];

/// Makes another text of bytes, characters, tokens or lines, cuts or nests a text, or lets it run together with another.
pub(crate) fn near(texts: &mut Texts, random: &mut Random) -> String {
    let file = random.below(texts.len());
    let (text, other) = (&texts[file].1, &texts[random.below(texts.len())].1);
    let (what, put) = match random.below(10) {
        0 => ("bytes", of_bytes(text, random)),
        1 => ("characters", of_characters(text, random)),
        2..=5 => ("tokens", of_tokens(text, other, random)),
        6 | 7 => ("lines", of_lines(text, other, random)),
        8 => match random.below(3) {
            0 => ("its end cut off", text[..boundary(text, random)].to_owned()),
            1 => ("its start cut off", text[boundary(text, random)..].to_owned()),
            _ => {
                let (before, after) = text.split_at(boundary(text, random));
                let nested = random.of(&NESTED).repeat(1 + random.below(600));
                ("something nested", format!("{before}{nested}{after}"))
            }
        },
        _ => {
            let (start, end) = (boundary(text, random), boundary(other, random));
            ("another file at its end", format!("{}{}", &text[..start], &other[end..]))
        }
    };
    texts[file].1 = put;
    format!("{} has other text: {what}", texts[file].0.display())
}

/// Somewhere between two characters.
fn boundary(text: &str, random: &mut Random) -> usize {
    char_boundary(text, random.below(text.len() + 1))
}

/// What is no UTF-8 any more comes as the loader would read it.
fn of_bytes(text: &str, random: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len().max(1));
        match random.below(3) {
            _ if bytes.is_empty() => {}
            0 => bytes[at] = random.below(256) as u8,
            1 => bytes.insert(at, random.below(256) as u8),
            _ => {
                bytes.remove(at);
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn of_characters(text: &str, random: &mut Random) -> String {
    let at = boundary(text, random);
    let (before, behind) = text.split_at(at);
    let mut letters = behind.chars();
    match (random.below(4), letters.next()) {
        (0, Some(_)) => format!("{before}{}", letters.as_str()),
        (1, Some(letter)) => format!("{before}{letter}{behind}"),
        (2, Some(letter)) => {
            let mut rest = letters.clone();
            let next = rest.next().map(String::from).unwrap_or_default();
            format!("{before}{next}{letter}{}", rest.as_str())
        }
        _ => format!("{before}{}{behind}", random.of(&LETTERS)),
    }
}

fn of_tokens(text: &str, other: &str, random: &mut Random) -> String {
    let (one, two) = (token_of(text, random), token_of(text, random));
    let (first, last) = if one.start <= two.start { (one, two) } else { (two, one) };
    let words: Vec<&str> = WORDS.split('|').collect();
    let replaced = |put: &str| format!("{}{put}{}", &text[..first.start], &text[first.end..]);
    match random.below(6) {
        0 => replaced(""),
        1 => replaced(&text[first.clone()].repeat(2)),
        2 => replaced(random.of::<&str>(&words)),
        3 => replaced(&format!("{} {} ", &text[first.clone()], random.of::<&str>(&words))),
        4 => replaced(&other[token_of(other, random)]),
        _ if first.end > last.start => text.to_owned(),
        _ => [
            &text[..first.start],
            &text[last.clone()],
            &text[first.end..last.start],
            &text[first.clone()],
            &text[last.end..],
        ]
        .concat(),
    }
}

fn of_lines(text: &str, other: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let others: Vec<&str> = other.split_inclusive('\n').collect();
    let (one, two) = (random.below(lines.len().max(1)), random.below(lines.len().max(1)));
    match random.below(5) {
        _ if lines.is_empty() || others.is_empty() => {}
        0 => {
            lines.remove(one);
        }
        1 => lines.insert(two, lines[one]),
        2 => lines.swap(one, two),
        3 => lines[one] = lines[one].trim_end(),
        _ => lines.insert(one, random.of::<&str>(&others)),
    }
    lines.concat()
}
