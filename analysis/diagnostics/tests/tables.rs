//! The highlighters and the reference list the fields of an activity, and the keys of `mauve.toml` and of timing tables, as
//! the tables of `mauve-hir` and `mauve-timing` do.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use expect_test::expect_file;
use mauve_diagnostics::{codes, summary};
use mauve_hir::ACTIVITY_FIELDS;
use mauve_hir::config_keys::{Key, KeyKind, SECTIONS};
use mauve_syntax::keywords::ActivityField;
use mauve_timing::table_keys;
use mauve_timing::toml_key::{ANY_NAME, ValueKind};

/// `UPDATE_EXPECT=1 cargo test -p mauve-diagnostics --test main tables::` writes the lists.
#[test]
fn highlighters_list_the_fields() {
    check_list("editors/emacs/mauve.el", "\"", " ");
    check_list("editors/nvim/syntax/mauve.vim", "", " ");
    check_list("editors/tree-sitter/queries/highlights.scm", "\"", " ");
    check_list("editors/tree-sitter/queries/helix/highlights.scm", "\"", " ");
    check_list("editors/vscode/syntaxes/mauve.tmLanguage.json", "", "|");
}

/// `UPDATE_EXPECT=1 cargo test -p mauve-diagnostics --test main tables::` writes the table and the rule of the grammar.
#[test]
fn the_reference_has_the_table_of_fields() {
    const FILE: &str = "tests/spec/deployments.md";
    const HEADER: &str = "| field | meaning | default |\n|---|---|---|\n";
    let (path, text) = read(FILE);
    let (before, table) = text.split_once(HEADER).expect("the reference has the table");
    let (_, after) = table.split_once("\n\n").expect("a paragraph follows");
    let mut rows = String::new();
    for it in &ACTIVITY_FIELDS {
        let default = it.default.unwrap_or("none: required");
        writeln!(rows, "| `{}` | {} | {default} |", it.field.keyword(), it.meaning).unwrap();
    }
    expect_file![path].assert_eq(&format!("{before}{HEADER}{rows}\n{after}"));
    check_list(FILE, "\"", " | ");
}

/// `UPDATE_EXPECT=1 cargo test -p mauve-diagnostics --test main tables::` writes severities and summaries; new codes are added by hand.
#[test]
fn the_reference_has_each_diagnostic_once() {
    let (path, text) = read("tests/spec/diagnostics.md");
    let mut listed = Vec::new();
    let line = |line: &str| {
        let code = codes().find(|code| line.starts_with(&format!("| `{}` |", code.name)));
        let Some(code) = code else { return format!("{line}\n") };
        listed.push(code.name);
        format!("| `{}` | {} | {} |\n", code.name, code.severity.name(), summary(code.name))
    };
    let expected: String = text.lines().map(line).collect();
    expect_file![path].assert_eq(&expected);
    let mut all: Vec<_> = codes().map(|code| code.name).collect();
    all.sort_unstable();
    listed.sort_unstable();
    assert_eq!(listed, all);
}

#[test]
fn the_reference_has_every_key() {
    let table = |page: &str, header: &str| {
        let (_, text) = read(&format!("tests/spec/{page}.md"));
        let (_, behind) = text.split_once(&format!("\n{header}\n")).expect("the reference has the table");
        behind.split_once("\n\n").expect("a paragraph follows").0.to_owned()
    };
    // A row without a section continues that of the row above.
    let mut documented: Vec<String> = Vec::new();
    for row in table("configuration", "| section | key | value | default |").lines().skip(1) {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").map(str::trim).collect();
        let above = documented.last().and_then(|line| line.split(' ').next()).unwrap_or_default().to_owned();
        let section = quoted(cells[0]).next().unwrap_or(&above).to_owned();
        documented.extend(quoted(cells[1]).map(|key| format!("{section} {key}")));
    }
    let mut keys: Vec<String> = Vec::new();
    for section in &SECTIONS {
        add_keys(section.name, section, &mut keys);
    }
    assert_eq!(documented, keys);
    let first_of = |page: &str, header: &str| -> Vec<String> {
        let table = table(page, header);
        table.lines().skip(1).filter_map(|row| quoted(row).next().map(str::to_owned)).collect()
    };
    let others = keys.iter().filter_map(|it| it.strip_prefix("[[platform.other]] "));
    assert_eq!(first_of("computer", "| key | value | default |"), others.collect::<Vec<_>>());
    let of_table =
        table_keys::KEYS.iter().map(|key| key.kind.header().map_or(key.name, |(label, _)| label).to_owned());
    assert_eq!(first_of("timing-tables", "| key of a table | |"), of_table.collect::<Vec<_>>());
}

/// Adds the keys of a table, each behind its header: of a table with any names, only those below the names.
fn add_keys(header: &str, table: &Key, all: &mut Vec<String>) {
    let is_list = matches!(&table.kind, KeyKind::Table(table) if table.is_list);
    for key in table.kind.keys() {
        let below = key.kind.keys();
        match key.name {
            ANY_NAME if below.is_empty() && header == "lints" => all.push(format!("[{header}] CODE")),
            ANY_NAME if below.is_empty() => {
                all.push(header.rsplit_once('.').map(|(of, key)| format!("[{of}] {key}")).unwrap())
            }
            ANY_NAME if header == "ros2.topics" => add_keys(&format!("{header}.PORT"), key, all),
            ANY_NAME => add_keys(&format!("{header}.NAME"), key, all),
            name if !below.is_empty() => add_keys(&format!("{header}.{name}"), key, all),
            name if is_list => all.push(format!("[[{header}]] {name}")),
            name => all.push(format!("[{header}] {name}")),
        }
    }
}

/// Returns the words in backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Checks the list of fields in a file: the words, each in `quote`, that begin with the first field.
fn check_list(file: &str, quote: &str, separator: &str) {
    let words = ActivityField::KEYWORDS.map(|word| format!("{quote}{word}{quote}"));
    let (path, text) = read(file);
    let start = text.find(&format!("{}{separator}", words[0])).expect("the file lists the fields");
    let mut rest = behind_word(&text[start..], quote).expect("it was found");
    while let Some(next) = rest.strip_prefix(separator).and_then(|rest| behind_word(rest, quote)) {
        rest = next;
    }
    expect_file![path].assert_eq(&format!("{}{}{rest}", &text[..start], words.join(separator)));
}

/// Returns the text behind a word in `quote`.
fn behind_word<'t>(text: &'t str, quote: &str) -> Option<&'t str> {
    let word = text.strip_prefix(quote)?;
    word.trim_start_matches(|letter: char| letter.is_ascii_lowercase()).strip_prefix(quote)
}

fn read(file: &str) -> (PathBuf, String) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(file);
    let text = fs::read_to_string(&path).expect("a file of this project");
    (path, text)
}
