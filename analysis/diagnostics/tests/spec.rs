//! The language reference in `tests/spec`: each model in it has the diagnostics that its marks say, and no others.
//!
//! A block of MAUVE is a fixture: `//- /path` begins a file in it. What a line has, its end says:
//! `// error: [code] "text"`, also `warning` and `hint`, several of them one after the other, each behind a `//` of its own
//! (`#` begins the first one in a `mauve.toml` or a timing table). The text is a part of the message, and may be left out.
//!
//! Errors and warnings are exactly those that are marked. So are hints of the codes that a block under the same heading
//! marks as hints; other hints do not matter. Every model is read five times: as it stands, indented by tabs, with CRLF,
//! without a last newline, and behind a byte order mark; that changes nothing.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use mauve_diagnostics::{codes, workspace_diagnostics};
use mauve_hir::{Database, Workspace};

/// No text of a page is a file that cannot be read, or a project that is too large.
const NO_TEXT_HAS: [&str; 2] = ["unreadable-file", "too-large"];

#[test]
fn every_model_has_what_its_marks_say() {
    let mut failures = Vec::new();
    for page in pages().into_iter().chain([near_misses()]) {
        for section in &page.sections {
            let hints = section.hints();
            for block in &section.blocks {
                let expected = block.marks();
                for (how, files) in variants(&block.text) {
                    let differences = differences(&expected, found(files), &hints);
                    if differences.is_empty() {
                        continue;
                    }
                    let mut failure = format!("{}: {}{how}\n", page.name, section.heading);
                    for (path, line, what) in differences {
                        let at = block.line_of(&path, line);
                        let _ = writeln!(failure, "  {}:{at} ({path}:{line}) {what}", page.name);
                    }
                    failures.push(failure);
                    // The other ways to write it would say the same once more.
                    break;
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}\n{} models differ", failures.join("\n"), failures.len());
}

/// `## `code``: a model that has the diagnostic, marked; last one that nearly has it.
#[test]
fn every_diagnostic_has_a_model_that_has_it_and_one_that_nearly_has_it() {
    let sections = near_misses().sections;
    let mut failures = Vec::new();
    let heading = |code: &str| format!("## `{code}`");
    for section in sections.iter().filter(|it| it.heading.starts_with("## ")) {
        if !codes().any(|code| heading(code.name) == section.heading) {
            failures.push(format!("{} is no diagnostic", section.heading));
        }
    }
    for code in codes().filter(|code| !NO_TEXT_HAS.contains(&code.name)) {
        let has = |block: &Block| block.marks().iter().any(|mark| mark.code == code.name);
        let its: Vec<_> = sections.iter().filter(|it| it.heading == heading(code.name)).collect();
        match its.as_slice() {
            [section] if matches!(section.blocks.as_slice(), [first, .., last] if has(first) && !has(last)) =>
                {}
            _ => failures
                .push(format!("{} needs one section: a model that has it, last one that has not", code.name)),
        }
    }
    assert!(failures.is_empty(), "{}\n{} in all", failures.join("\n"), failures.len());
}

#[test]
fn the_front_page_leads_to_every_page() {
    let front = std::fs::read_to_string(folder().join("README.md")).unwrap();
    let missing: Vec<String> = pages()
        .into_iter()
        .map(|page| page.name)
        .filter(|name| name != "README.md" && !front.contains(&format!("({name})")))
        .collect();
    assert!(missing.is_empty(), "README.md does not name {missing:?}");
}

struct Page {
    name: String,
    sections: Vec<Section>,
}

/// A heading, and the models below it up to the next one of any level.
struct Section {
    heading: String,
    blocks: Vec<Block>,
}

struct Block {
    /// The line of the page on which its text begins, from 1.
    line: usize,
    text: String,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Mark {
    path: String,
    line: usize,
    severity: String,
    code: String,
    /// A part of the message; all of it in what was found.
    text: String,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/spec")
}

/// The models beside this file, of each diagnostic.
fn near_misses() -> Page {
    Page::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/near_misses.md"))
}

fn pages() -> Vec<Page> {
    let files = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let pages: BTreeSet<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|it| it == "md")).collect();
    pages.iter().map(|path| Page::read(path)).collect()
}

impl Page {
    fn read(path: &Path) -> Page {
        let text = std::fs::read_to_string(path).unwrap();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let mut sections = vec![Section::new("(its beginning)")];
        // The block that is open, and whether it is a model.
        let mut open: Option<(Block, bool)> = None;
        for (index, line) in text.lines().enumerate() {
            let section = sections.last_mut().unwrap();
            match (&mut open, line.strip_prefix("```")) {
                (None, Some(language)) => {
                    open = Some((Block { line: index + 2, text: String::new() }, language == "mauve"));
                }
                (Some(_), Some(_)) => section.blocks.extend(open.take().filter(|it| it.1).map(|it| it.0)),
                (Some((block, _)), None) => block.text += &format!("{line}\n"),
                (None, None) if line.starts_with('#') => sections.push(Section::new(line)),
                (None, None) => {}
            }
        }
        assert!(open.is_none(), "{name}: a block is not closed");
        Page { name, sections }
    }
}

impl Section {
    fn new(heading: &str) -> Section {
        Section { heading: heading.to_owned(), blocks: Vec::new() }
    }

    /// The codes of hints that are compared here.
    fn hints(&self) -> BTreeSet<String> {
        let marks = self.blocks.iter().flat_map(Block::marks);
        marks.filter(|mark| mark.severity == "hint").map(|mark| mark.code).collect()
    }
}

impl Block {
    fn marks(&self) -> Vec<Mark> {
        let mut marks = Vec::new();
        for (path, text) in mauve_tests::fixture(&self.text) {
            for (index, line) in text.lines().enumerate() {
                marks.extend(marks_of(line).map(|mark| Mark { path: path.clone(), line: index + 1, ..mark }));
            }
        }
        marks
    }

    /// The line of the page that has this line of a file.
    fn line_of(&self, path: &str, line: usize) -> usize {
        let (mut file, mut at) = ("/model.mal", 0);
        for (index, text) in self.text.lines().enumerate() {
            if let Some(next) = text.strip_prefix("//- ") {
                (file, at) = (next.trim(), 0);
            } else if at > 0 || file != "/model.mal" || !text.trim().is_empty() {
                at += 1;
                if (file, at) == (path, line) {
                    return self.line + index;
                }
            }
        }
        self.line
    }
}

/// The marks at the end of a line, without their places.
fn marks_of(line: &str) -> impl Iterator<Item = Mark> {
    let begins = ["error: [", "warning: [", "hint: ["];
    let first = begins.iter().flat_map(|it| [line.find(&format!("// {it}")), line.find(&format!("# {it}"))]);
    let first = first.flatten().min();
    let all = first.map_or("", |first| line[first..].trim_start_matches(['/', '#']));
    all.split(" // ").filter(|mark| !mark.is_empty()).map(move |mark| {
        let parts = mark.trim().split_once(": [").and_then(|(it, rest)| Some((it, rest.split_once(']')?)));
        let (severity, (code, text)) = parts.expect("a mark is `severity: [code] \"text\"`");
        let text = text.trim();
        let is_quoted = text.len() > 2 && text.starts_with('"') && text.ends_with('"');
        assert!(text.is_empty() || is_quoted, "{line:?}: the text of a mark stands in quotes");
        Mark {
            path: String::new(),
            line: 0,
            severity: severity.to_owned(),
            code: code.to_owned(),
            text: text.trim_matches('"').to_owned(),
        }
    })
}

/// The files of a block, in each way in which the same lines may be written.
fn variants(block: &str) -> [(&'static str, Vec<(String, String)>); 5] {
    let files = mauve_tests::fixture(block);
    let each = |change: fn(&str) -> String| {
        files.iter().map(|(path, text)| (path.clone(), change(text))).collect::<Vec<_>>()
    };
    [
        ("", files.clone()),
        (" — indented by tabs", with_tabs(&files)),
        (" — with CRLF", each(|text| text.replace('\n', "\r\n"))),
        (" — without a last newline", each(|text| text.trim_end_matches('\n').to_owned())),
        (" — behind a byte order mark", each(|text| format!("\u{feff}{text}"))),
    ]
}

/// Indents the lines by tabs, except in YAML, which refuses them.
fn with_tabs(files: &[(String, String)]) -> Vec<(String, String)> {
    let line = |line: &str| {
        let rest = line.trim_start_matches(' ');
        let spaces = line.len() - rest.len();
        format!("{}{}{rest}", "\t".repeat(spaces / 2), " ".repeat(spaces % 2))
    };
    let indented = |(path, text): &(String, String)| {
        let text = if path.ends_with(".yaml") {
            text.clone()
        } else {
            text.split_inclusive('\n').map(line).collect()
        };
        (path.clone(), text)
    };
    files.iter().map(indented).collect()
}

/// Everything that is wrong in these files.
fn found(files: Vec<(String, String)>) -> Vec<Mark> {
    let db = Database::default();
    let texts = files.into_iter().map(|(path, text)| (PathBuf::from(path), text));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let findings = workspace_diagnostics(&db, workspace).into_iter();
    findings
        .map(|finding| {
            let diagnostic = finding.diagnostic;
            let file = diagnostic.at.file(&db);
            let text = file.text(&db);
            let start: usize = diagnostic.at.range(&db).start().into();
            // What is missing at the end of a text is missing on its last line.
            let line = text[..start].matches('\n').count() + 1;
            Mark {
                path: file.path(&db).display().to_string(),
                line: line.min(text.lines().count().max(1)),
                severity: finding.severity.name().to_owned(),
                code: diagnostic.code.name.to_owned(),
                text: diagnostic.message.clone(),
            }
        })
        .collect()
}

/// What is marked and not found, or found and not marked, each with its file and line.
fn differences(
    expected: &[Mark],
    found: Vec<Mark>,
    hints: &BTreeSet<String>,
) -> Vec<(String, usize, String)> {
    let mut left = found;
    left.retain(|it| it.severity != "hint" || hints.contains(&it.code));
    let mut missing = Vec::new();
    // Marks with a text choose first.
    let (with_text, without): (Vec<&Mark>, Vec<&Mark>) =
        expected.iter().partition(|mark| !mark.text.is_empty());
    for mark in with_text.into_iter().chain(without) {
        let is_it = |it: &Mark| {
            it.text.contains(&mark.text) && Mark { text: mark.text.clone(), ..it.clone() } == *mark
        };
        match left.iter().position(is_it) {
            Some(index) => {
                left.remove(index);
            }
            None => missing.push(mark.clone()),
        }
    }
    let show = |what: &str, mark: Mark| {
        (mark.path, mark.line, format!("{what} {}: [{}] {:?}", mark.severity, mark.code, mark.text))
    };
    let mut all: Vec<_> = missing.into_iter().map(|mark| show("expected", mark)).collect();
    all.extend(left.into_iter().map(|mark| show("found", mark)));
    all.sort();
    all
}

#[test]
fn expectations_in_comments_are_read() {
    let marks: Vec<Mark> = marks_of("  f(); // text // error: [a-b] \"no `f`\" // hint: [c]").collect();
    let shown: Vec<(&str, &str, &str)> =
        marks.iter().map(|it| (it.severity.as_str(), it.code.as_str(), it.text.as_str())).collect();
    assert_eq!(shown, [("error", "a-b", "no `f`"), ("hint", "c", "")]);
    assert_eq!(marks_of("codel error(in a: int): int // error or not").count(), 0);
    assert_eq!(marks_of("[platfrom] # error: [invalid-configuration]").count(), 1);
}

#[test]
fn a_difference_in_severity_code_line_or_number_is_a_difference() {
    let of = |text: &str| Block { line: 1, text: text.to_owned() }.marks();
    let none = BTreeSet::new();
    let one = of("x // error: [a] \"yes\"");
    let count = |found: &str| differences(&one, of(found), &none).len();
    assert_eq!(count("x // error: [a] \"oh yes, yes\""), 0);
    for other in [
        "x // error: [a] \"no\"",
        "x // error: [b] \"yes\"",
        "x // warning: [a] \"yes\"",
        "\ny\nx // error: [a] \"yes\"",
    ] {
        assert_eq!(count(other), 2, "{other}");
    }
    assert_eq!(count("x // error: [a] \"yes\" // error: [a] \"yes\""), 1);
    assert_eq!(count("x"), 1);
    assert_eq!(count("x // error: [a] \"yes\" // hint: [c]"), 0);
    let hints = BTreeSet::from(["c".to_owned()]);
    assert_eq!(differences(&one, of("x // error: [a] \"yes\" // hint: [c]"), &hints).len(), 1);
}
