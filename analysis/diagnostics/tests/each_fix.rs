//! Each fix that is offered removes the diagnostic that it is offered for, and adds no error: in the models of the pages, of the
//! reference, of the mistakes and of the tests beside this one, and in damaged models.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use mauve_diagnostics::{Finding, Fix, Severity, codes, page, workspace_diagnostics};
use mauve_hir::{Database, Workspace};
use mauve_tests::{Random, files_in, fixture, models_of_page, models_of_pages, random_model, search};

use crate::damaged;

type Texts = BTreeMap<PathBuf, String>;

/// An edit: its file, the replaced range, and the new text.
type Edit = (PathBuf, Range<usize>, String);

/// A diagnostic in the text: where it is, and what it says.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Seen {
    code: &'static str,
    is_error: bool,
    path: PathBuf,
    range: (usize, usize),
    message: String,
}

/// The fixes after which other errors may appear: the mistake hid them, because what it is about was not read. Each has a
/// reason. The models of `tests/mistakes` have no second mistake, so that no fix of theirs is a first step.
const FIRST_STEPS: &[(&str, &str)] = &[
    ("syntax-error", "what stands in the broken text is checked once the text is read"),
    ("initial-state", "the names of states are checked in a machine that begins somewhere"),
    ("invalid-configuration", "the value of an unknown key is not read"),
    ("misspelt-name", "a value of an unknown type is of any type"),
    (
        "unresolved-architecture",
        "the activities of an unknown architecture are not compared with its instances",
    ),
    (
        "unresolved-codel",
        "the arguments of an unknown codel are of any type, and its name is guessed by its letters",
    ),
    ("unresolved-feature", "a connection with an unknown port is not compared with the other ones"),
    ("unresolved-instance", "a connection with an unknown instance is not compared with the other ones"),
    (
        "unresolved-shell",
        "a core with an unknown shell may use any name, and a second `use` may make a name ambiguous",
    ),
    ("unresolved-variable", "an unknown variable is of any type, and its name is guessed by its letters"),
    ("unused-codel", "a key of a table may name two codels, and the fix removes one of them"),
];

/// The fixes that write one sign at the end of a line, where the rest of the declaration may be missing as well: that is an
/// error of its own once the sign is there.
const AT_LINE_ENDS: [&str; 2] = ["Write `)`", "Write `;`"];

#[test]
fn each_fix_removes_its_diagnostic_and_adds_no_error() {
    let mut tried = Tried::default();
    for (name, model) in models() {
        let texts: Texts = fixture(&model).into_iter().map(|(path, text)| (path.into(), text)).collect();
        tried.check(&name, &texts);
    }
    assert!(tried.codes.len() >= 45, "codes with fixes: {:?}", tried.codes);
    let mut random = Random::of_seed(search::seed());
    for seed in search::seeds("MAUVE_FIXES", 20) {
        let texts = random_model(seed).texts();
        for _ in 0..4 {
            let mut changed = texts.clone();
            let done = mistyped(&mut changed, &mut random);
            tried.check(&format!("model {seed}: {done}"), &changed.into_iter().collect());
        }
    }
    assert!(tried.failures.is_empty(), "{}\n{} failures", tried.failures.join("\n"), tried.failures.len());
}

#[derive(Default)]
struct Tried {
    codes: BTreeSet<&'static str>,
    /// The fixes that were tried, by their texts and edits.
    known: HashSet<(Vec<Edit>, Vec<String>)>,
    failures: Vec<String>,
}

impl Tried {
    /// Applies each fix of the model alone.
    fn check(&mut self, name: &str, texts: &Texts) {
        let db = Database::default();
        let findings = workspace_diagnostics(&db, Workspace::of_texts(&db, "/".into(), texts.clone()));
        let before = seen(&db, &findings);
        // A fix is an edit here.
        let mut new = Database::default();
        let workspace = Workspace::of_texts(&new, "/".into(), texts.clone());
        for (finding, own) in findings.iter().zip(&before) {
            for fix in &finding.diagnostic.fixes {
                let edits = edits(&db, fix);
                let touched = edits.iter().map(|(path, ..)| texts[path].clone()).collect();
                if !self.known.insert((edits.clone(), touched)) {
                    continue;
                }
                self.codes.insert(own.code);
                let fixed = applied(texts, &edits);
                for (path, text) in &fixed {
                    let file = workspace.file(&new, path).unwrap();
                    if **file.text(&new) != **text {
                        file.set_text(&mut new, text.as_str().into());
                    }
                }
                let after = seen(&new, &workspace_diagnostics(&new, workspace));
                let mut complaints = still_there(own, &before, &after, &edits);
                let is_first_step = FIRST_STEPS.iter().any(|(code, _)| *code == own.code);
                if !is_first_step || name.starts_with("mistakes/") {
                    complaints.extend(new_errors(own, &before, &after, &edits));
                }
                complaints.extend(unreadable(own, fix, texts, &fixed, &edits));
                let (code, title) = (own.code, &fix.title);
                let what = format!("{code}: {title:?} for {:?} in {name}, {edits:?}", own.message);
                self.failures.extend(complaints.into_iter().map(|it| format!("{it}: {what}")));
            }
        }
    }
}

/// The diagnostics with the code at the place of the mended one, which is carried through the edits: one less than before.
fn still_there(own: &Seen, before: &[Seen], after: &[Seen], edits: &[Edit]) -> Vec<String> {
    let of_code = |it: &&Seen| it.code == own.code && it.path == own.path;
    let place = moved(&own.path, own.range, edits);
    let same = after.iter().filter(of_code).find(|it| touches(it.range, place) && it.message == own.message);
    let old = before.iter().filter(of_code).filter(|it| overlaps(it.range, own.range)).count();
    let left = after.iter().filter(of_code).filter(|it| overlaps(it.range, place)).count();
    // Behind a syntax error, the next one may be at the same place. So may an unknown program behind its component.
    let has_several = ["syntax-error", "unknown-timing-key"].contains(&own.code);
    let is_less = left < old || left == 0 || has_several;
    let complaint = format!("is still there, {old} and then {left}");
    (same.is_some() || !is_less).then_some(complaint).into_iter().collect()
}

/// The errors after the edits that were not there before.
fn new_errors(own: &Seen, before: &[Seen], after: &[Seen], edits: &[Edit]) -> Vec<String> {
    let mut left: Vec<&Seen> = after.iter().filter(|it| it.is_error).collect();
    for old in before.iter().filter(|it| it.is_error && *it != own) {
        let place = moved(&old.path, old.range, edits);
        let same = |it: &&Seen| it.code == old.code && it.path == old.path && touches(it.range, place);
        let exact = left.iter().position(|it| same(it) && it.message == old.message);
        if let Some(at) = exact.or_else(|| left.iter().position(same)) {
            left.remove(at);
        }
    }
    left.iter().map(|it| format!("adds {}, {:?}", it.code, it.message)).collect()
}

/// The fixed texts have fewer syntax errors after a fix of one, otherwise no other ones.
fn unreadable(own: &Seen, fix: &Fix<'_>, texts: &Texts, fixed: &Texts, edits: &[Edit]) -> Option<String> {
    let ends_line =
        |(path, range, _): &Edit| texts[path][range.end..].trim_start_matches([' ', '\r']).starts_with('\n');
    let is_end = |edit: &Edit| ends_line(edit) || texts[&edit.0][edit.1.end..].trim().is_empty();
    let is_of_line = AT_LINE_ENDS.contains(&fix.title.as_str()) && edits.iter().all(is_end);
    let count = |texts: &Texts| texts.iter().map(|(path, text)| errors_in(path, text)).sum::<usize>();
    let (old, new) = (count(texts), count(fixed));
    let is_fewer = new < old || (own.code != "syntax-error" || is_of_line) && new == old;
    (!is_fewer).then(|| format!("has {new} syntax errors, {old} before"))
}

fn errors_in(path: &Path, text: &str) -> usize {
    match damaged::is_table(path) {
        true => usize::from(text.parse::<toml::Table>().is_err()),
        false => mauve_syntax::parse(text).errors().len(),
    }
}

fn overlaps(one: (usize, usize), other: (usize, usize)) -> bool {
    one.0 < other.1 && other.0 < one.1
}

fn touches(one: (usize, usize), other: (usize, usize)) -> bool {
    one.0 <= other.1 && other.0 <= one.1
}

/// Where a range is after the edits.
fn moved(path: &Path, (start, end): (usize, usize), edits: &[Edit]) -> (usize, usize) {
    let shift = |offset: usize, is_end: bool| -> usize {
        let mut to = offset as isize;
        for (_, range, text) in edits.iter().filter(|it| it.0 == path) {
            let delta = text.len() as isize - range.len() as isize;
            if range.end < offset || (range.end == offset && (is_end || !range.is_empty())) {
                to += delta;
            } else if range.start < offset {
                // The replacement counts wholly.
                to += if is_end {
                    text.len() as isize - (offset - range.start) as isize
                } else {
                    -((offset - range.start) as isize)
                };
            }
        }
        to as usize
    };
    (shift(start, false), shift(end, true))
}

fn seen(db: &Database, findings: &[Finding<'_>]) -> Vec<Seen> {
    let all = findings.iter().map(|finding| {
        let it = &finding.diagnostic;
        let range = it.at.range(db);
        Seen {
            code: it.code.name,
            is_error: finding.severity == Severity::Error && it.code.name != "deadline-missed",
            path: it.at.file(db).path(db).clone(),
            range: (range.start().into(), range.end().into()),
            message: it.message.clone(),
        }
    });
    all.collect()
}

fn edits(db: &Database, fix: &Fix<'_>) -> Vec<Edit> {
    let edits = fix
        .edits
        .iter()
        .map(|(at, text)| (at.file(db).path(db).clone(), Range::<usize>::from(at.range(db)), text.clone()));
    let mut edits: Vec<Edit> = edits.collect();
    edits.sort_by_key(|(path, range, _)| (path.clone(), range.start, range.end));
    for pair in edits.windows(2) {
        assert!(
            pair[0].0 != pair[1].0 || pair[0].1.end <= pair[1].1.start,
            "{}: edits overlap: {edits:?}",
            fix.title
        );
    }
    edits
}

fn applied(texts: &Texts, edits: &[Edit]) -> Texts {
    let mut texts = texts.clone();
    for (path, range, text) in edits.iter().rev() {
        texts.get_mut(path).unwrap().replace_range(range.clone(), text);
    }
    texts
}

/// The models, each with its name.
fn models() -> Vec<(String, String)> {
    let mut models = models_of_pages();
    for code in codes() {
        let of_code = models_of_page(&page(code.name).unwrap());
        models.extend(of_code.into_iter().map(|model| (code.name.to_owned(), model)));
    }
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    for path in files_in(&here).iter().filter(|path| path.extension().is_some_and(|it| it == "rs")) {
        let name = path.file_name().unwrap().display().to_string();
        let literals = literals(&std::fs::read_to_string(path).unwrap());
        let is_model =
            |it: &String| ["codel ", "shell ", "core ", "deployment "].iter().any(|word| it.contains(word));
        models.extend(
            literals
                .into_iter()
                .filter(is_model)
                .enumerate()
                .map(|(number, it)| (format!("{name} {number}"), it)),
        );
    }
    models
}

/// The string literals of a Rust file, with the braces of a template written once.
fn literals(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = source;
    while let Some(at) = rest.find(['"', '\'']) {
        let is_raw = rest[..at].ends_with("r#");
        if rest[at..].starts_with('\'') {
            // A character, or a lifetime.
            let next = rest[at + 1..].chars().nth(1) == Some('\'');
            rest = &rest[at
                + if next || rest[at + 1..].starts_with("\\\"") || rest[at + 1..].starts_with("\"") {
                    3
                } else {
                    1
                }..];
            continue;
        }
        rest = &rest[at + 1..];
        let mut literal = String::new();
        if is_raw {
            let (text, after) = rest.split_once("\"#").unwrap_or((rest, ""));
            literal += text;
            rest = after;
        } else {
            let mut letters = rest.char_indices();
            let mut end = rest.len();
            while let Some((at, letter)) = letters.next() {
                match letter {
                    '"' => {
                        end = at + 1;
                        break;
                    }
                    '\\' => match letters.next().map(|it| it.1) {
                        Some('n') => literal.push('\n'),
                        Some('t') => literal.push('\t'),
                        Some('r') => literal.push('\r'),
                        Some('\n') => {
                            let skipped = letters.as_str().len() - letters.as_str().trim_start().len();
                            for _ in 0..letters.as_str()[..skipped].chars().count() {
                                letters.next();
                            }
                        }
                        Some(other) => literal.push(other),
                        None => {}
                    },
                    other => literal.push(other),
                }
            }
            rest = &rest[end.min(rest.len())..];
        }
        if literal.contains("{{") {
            literal = literal.replace("{{", "{").replace("}}", "}");
        }
        found.push(literal);
    }
    found
}

/// Mistypes a name, or writes a number in another way.
fn mistyped(texts: &mut [(PathBuf, String)], random: &mut Random) -> String {
    const NUMBERS: [&str; 14] = [
        "1.2.0", "10ms", "1,5", "0b1", "1e", ".5", "5.", "1_000", "0x", "007", "1.5.2ms", "1.5s", "3us",
        "1..2",
    ];
    let file = random.below(texts.len());
    let (path, text) = &mut texts[file];
    let lexed = mauve_syntax::lex(text);
    let words: Vec<Range<usize>> = (0..lexed.len())
        .map(|it| lexed.range(it))
        .filter(|it| text[it.clone()].starts_with(|letter: char| letter.is_ascii_alphanumeric()))
        .collect();
    if words.is_empty() {
        return String::new();
    }
    let range = random.of(&words).clone();
    let word = text[range.clone()].to_owned();
    let new = if word.starts_with(|it: char| it.is_ascii_digit()) {
        (*random.of(&NUMBERS)).to_owned()
    } else {
        let mut letters: Vec<char> = word.chars().collect();
        let at = random.below(letters.len());
        match random.below(4) {
            0 if at > 0 => letters.swap(at, at - 1),
            1 if letters.len() > 2 => {
                letters.remove(at);
            }
            2 => letters.insert(at, 'x'),
            _ => {
                letters[at] = if letters[at].is_lowercase() {
                    letters[at].to_ascii_uppercase()
                } else {
                    letters[at].to_ascii_lowercase()
                }
            }
        }
        letters.into_iter().collect()
    };
    let done = format!("{} at {}: {word} becomes {new}", path.display(), range.start);
    text.replace_range(range, &new);
    done
}
