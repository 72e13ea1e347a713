//! One mistake, one message: the models in `tests/mistakes`, each with one mistake, the one message that it gives, and the
//! model after the first fix.
//!
//! A section of a page there has a model, then what was found, in lines that begin with `> `, then the model after the fix
//! where there is one. `UPDATE_EXPECT=1` writes the last two. A block may name a frame of its page, the model around it:
//!
//! ````text
//! ```mauve frame=update
//! core C(S) { update = {
//! $0
//! } }
//! ```
//! ## `and`
//! ```mauve in=update
//! if a and b then { … }
//! ```
//! > error[syntax-error] at `and`: …
//! ````

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use mauve_diagnostics::{Finding, Fix, Severity, workspace_diagnostics};
use mauve_hir::{Database, Workspace};

type Texts = BTreeMap<PathBuf, String>;

#[test]
fn one_mistake_gives_one_message_and_its_fix_mends_the_model() {
    let update = std::env::var_os("UPDATE_EXPECT").is_some();
    let mut failures = Vec::new();
    let mut mistakes = 0;
    for path in pages() {
        let text = std::fs::read_to_string(&path).unwrap();
        let name = path.file_name().unwrap().to_str().unwrap();
        let mut parts = text.split("\n## ");
        let mut written = parts.next().unwrap().to_owned();
        let frames = frames(&written);
        for section in parts {
            mistakes += 1;
            let (section, complaints) = section_as_found(&frames, section);
            let title = section.lines().next().unwrap_or_default();
            failures.extend(complaints.into_iter().map(|it| format!("{name}: {title}: {it}")));
            write!(written, "\n## {section}").unwrap();
        }
        if update {
            std::fs::write(&path, &written).unwrap();
        } else if written != text {
            let first = written.lines().zip(text.lines()).find(|(found, expected)| found != expected);
            failures.push(format!("{name}: expected other text; first difference: {first:#?}"));
        }
    }
    assert!(failures.is_empty(), "{}\n{} failures", failures.join("\n"), failures.len());
    assert!(mistakes >= 300, "{mistakes} mistakes");
}

fn pages() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/mistakes");
    let mut pages: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    pages.retain(|path| path.file_name().is_some_and(|name| name != "README.md"));
    pages.sort();
    pages
}

/// The text before and after the block of a mistake, by the name of the frame.
fn frames(page: &str) -> BTreeMap<String, (String, String)> {
    let mut frames = BTreeMap::new();
    for block in page.split("```mauve frame=").skip(1) {
        let (name, rest) = block.split_once('\n').unwrap();
        let (before, after) = rest.split("```").next().unwrap().split_once("$0\n").expect("a frame has $0");
        frames.insert(name.to_owned(), (before.to_owned(), after.to_owned()));
    }
    frames
}

/// Returns a section with what is found in its model, and what is wrong with that.
fn section_as_found(frames: &BTreeMap<String, (String, String)>, section: &str) -> (String, Vec<String>) {
    let mut complaints = Vec::new();
    let (head, rest) = section.split_once("```mauve").expect("a section has a model");
    let (info, rest) = rest.split_once('\n').unwrap();
    let model = rest.split("```").next().unwrap();
    let (before, after) = match info.trim().strip_prefix("in=") {
        Some(name) => frames.get(name).unwrap_or_else(|| panic!("no frame {name}")).clone(),
        None => Default::default(),
    };
    let files = mauve_tests::fixture(&format!("{before}{model}{after}"));
    let texts: Texts = files.iter().map(|(path, text)| (path.into(), text.clone())).collect();
    let db = Database::default();
    let findings = found(&db, &texts);
    let mut written = format!("{head}```mauve{info}\n{model}```\n");
    for finding in &findings {
        write!(written, "\n> {}", said(&db, finding)).unwrap();
    }
    // The table of an overload says what its deployments, which may be closed, have.
    let is_own = |it: &&Finding<'_>| it.diagnostic.code.name != "overloading-times";
    let messages = findings.iter().filter(is_own).count();
    if messages != 1 {
        complaints.push(format!("{messages} messages"));
    }
    let fixes = findings.first().map(|finding| finding.diagnostic.fixes.as_slice()).unwrap_or_default();
    for fix in fixes {
        write!(written, "\n> fix: {}", fix.title).unwrap();
    }
    if let Some(fix) = fixes.first() {
        let fixed = applied(&db, &texts, fix);
        let fixed_db = Database::default();
        for finding in found(&fixed_db, &fixed).iter().filter(|it| it.severity != Severity::Hint) {
            complaints.push(format!("after the fix: {}", said(&fixed_db, finding)));
        }
        // In the order of the fixture, so that the frame around the model is found again.
        let header = |index, path| match index {
            0 if path == "/model.mal" => String::new(),
            _ => format!("//- {path}\n"),
        };
        let paths = files.iter().enumerate().map(|(index, (path, _))| (header(index, path), path));
        let text: String = paths.map(|(header, path)| header + &fixed[Path::new(path)]).collect();
        let text = text.strip_prefix(&before).and_then(|text| text.strip_suffix(&after)).unwrap_or(&text);
        write!(written, "\n\n```mauve{info}\n{text}```").unwrap();
    }
    written.push('\n');
    (written, complaints)
}

fn found<'db>(db: &'db Database, texts: &Texts) -> Vec<Finding<'db>> {
    workspace_diagnostics(db, Workspace::of_texts(db, "/".into(), texts.clone()))
}

fn said(db: &Database, finding: &Finding<'_>) -> String {
    let diagnostic = &finding.diagnostic;
    let text = diagnostic.at.file(db).text(db);
    let marked = &text[std::ops::Range::<usize>::from(diagnostic.at.range(db))];
    let marked = marked.lines().next().unwrap_or_default();
    let (severity, code) = (finding.severity.name(), diagnostic.code.name);
    format!("{severity}[{code}] at `{marked}`: {}", diagnostic.message.replace('\n', "\n> "))
}

fn applied(db: &Database, texts: &Texts, fix: &Fix<'_>) -> Texts {
    let mut texts = texts.clone();
    let mut edits: Vec<_> =
        fix.edits.iter().map(|(at, text)| (at.file(db).path(db).clone(), at.range(db), text)).collect();
    edits.sort_by_key(|(path, range, _)| (path.clone(), std::cmp::Reverse(range.start())));
    for (path, range, text) in edits {
        texts.get_mut(&path).unwrap().replace_range(std::ops::Range::<usize>::from(range), text);
    }
    texts
}
