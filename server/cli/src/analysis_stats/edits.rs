//! The edits of `mauve analysis-stats`: how long it takes until everything that an editor shows is known again.
//!
//! They are made in the texts of a database of their own, and taken back. No file is written.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::{Database, File, Log, Workspace, project_files, projects};
use mauve_projects::analysis_document::deployments;
use mauve_projects::load::load;
use mauve_syntax::{SyntaxKind, SyntaxNode, SyntaxToken};
use mauve_timing::Table;
use mauve_wcrt::{Query, response_times, table_files};

use crate::text::columns;

/// As many edits of one kind are measured, from all over the models.
const MOST: usize = 25;

/// A row for each kind of edit: how often it was made or taken back, the times, the executed queries.
pub(super) fn table(paths: &[PathBuf]) -> Result<String, String> {
    // The log is written while the clock runs, a line for each query.
    let mut db = Database::with_log();
    let workspaces = load(&mut db, paths, false)?;
    show(&db, &workspaces)?;
    let models = models(&db, &workspaces);
    let mut tables: Vec<File> =
        workspaces.iter().flat_map(|&workspace| table_files(&db, workspace).files.clone()).collect();
    tables.sort_by_key(|file| file.path(&db).clone());
    tables.dedup();
    let comments = models.iter().map(|&file| Edit::new(&db, file, 0..0, "// measured\n")).collect();
    let kinds: [(&str, Vec<Edit>); 4] = [
        ("a comment at the top of a model", comments),
        ("a literal in a core", models.iter().flat_map(|&file| literals(&db, file)).collect()),
        ("a period in a deployment", models.iter().flat_map(|&file| periods(&db, file)).collect()),
        ("a time in a table", tables.iter().flat_map(|&file| times(&db, file)).collect()),
    ];
    let mut rows = Vec::new();
    for (kind, edits) in kinds {
        let step = edits.len().div_ceil(MOST).max(1);
        let mut measured = Vec::new();
        for Edit { file, old, new } in edits.into_iter().step_by(step) {
            // As an editor does that opens it.
            file.set_text(&mut db, old.clone());
            show(&db, &workspaces)?;
            for text in [new, old] {
                db.take_log();
                let start = Instant::now();
                file.set_text(&mut db, text);
                show(&db, &workspaces)?;
                let elapsed = start.elapsed();
                let Log { executed, verified, nodes } = db.take_log();
                measured.push((elapsed, [executed.len(), verified.len(), nodes]));
            }
        }
        rows.push(row(kind, &measured));
    }
    Ok(columns(&["edit", "edits", "median ms", "greatest", "queries", "most", "verified", "nodes"], &rows))
}

/// Of each edit, the time, how many queries were executed and verified, and how many nodes of programs lowered and executed.
fn row(kind: &str, measured: &[(Duration, [usize; 3])]) -> Vec<String> {
    let (mut times, queries): (Vec<_>, Vec<_>) = measured.iter().copied().unzip();
    times.sort_unstable();
    let sorted = |of: usize| {
        let mut counts: Vec<usize> = queries.iter().map(|it| it[of]).collect();
        counts.sort_unstable();
        counts
    };
    let [executed, verified, nodes] = [0, 1, 2].map(sorted);
    let milliseconds = |time: Option<&Duration>| {
        time.map_or_else(|| "—".to_owned(), |time| format!("{:.3}", time.as_secs_f64() * 1e3))
    };
    let count = |count: Option<&usize>| count.map_or_else(|| "—".to_owned(), usize::to_string);
    vec![
        kind.to_owned(),
        measured.len().to_string(),
        milliseconds(times.get(times.len() / 2)),
        milliseconds(times.last()),
        count(executed.get(executed.len() / 2)),
        count(executed.last()),
        count(verified.get(verified.len() / 2)),
        count(nodes.get(nodes.len() / 2)),
    ]
}

/// What an editor asks for after a keystroke: all diagnostics, and the response times of all deployments.
fn show(db: &Database, workspaces: &[Workspace]) -> Result<(), String> {
    for &workspace in workspaces {
        workspace_diagnostics(db, workspace);
    }
    for (project, deployment) in deployments(db, workspaces, None)? {
        response_times(db, project, deployment, Query::shown(db, project, deployment));
    }
    Ok(())
}

/// Returns the files of all projects, each once.
pub(super) fn models(db: &Database, workspaces: &[Workspace]) -> Vec<File> {
    let projects = workspaces.iter().flat_map(|&workspace| projects(db, workspace));
    let mut files: Vec<File> = projects.flat_map(|&project| project_files(db, project)).copied().collect();
    files.sort_by_key(|file| file.path(db).clone());
    files.dedup();
    files
}

struct Edit {
    file: File,
    old: Arc<str>,
    new: Arc<str>,
}

impl Edit {
    /// Puts `text` where `range` is; nothing happens where that is not in the text.
    fn new(db: &Database, file: File, range: std::ops::Range<usize>, text: &str) -> Edit {
        let old = file.text(db).clone();
        let parts = old.get(..range.start).zip(old.get(range.end..));
        let new =
            parts.map_or_else(|| old.clone(), |(before, after)| format!("{before}{text}{after}").into());
        Edit { file, old, new }
    }
}

/// The first literal in the programs of each core becomes greater.
fn literals(db: &Database, file: File) -> Vec<Edit> {
    let in_program =
        |token: &SyntaxToken| token.parent_ancestors().any(|node| node.kind() == SyntaxKind::BLOCK);
    first_numbers(db, file, SyntaxKind::CORE, in_program)
}

/// The first period of each deployment becomes longer.
fn periods(db: &Database, file: File) -> Vec<Edit> {
    let of_period = |token: &SyntaxToken| {
        let field = token.parent_ancestors().find(|node| node.kind() == SyntaxKind::FIELD);
        let name = field.and_then(|field| field.first_token());
        name.is_some_and(|name| name.text() == "period")
    };
    first_numbers(db, file, SyntaxKind::DEPLOYMENT, of_period)
}

/// The first number that fits in each node of a kind becomes greater.
fn first_numbers(
    db: &Database,
    file: File,
    kind: SyntaxKind,
    fits: impl Fn(&SyntaxToken) -> bool,
) -> Vec<Edit> {
    let is_number =
        |token: &SyntaxToken| matches!(token.kind(), SyntaxKind::INT_NUMBER | SyntaxKind::FLOAT_NUMBER);
    let first = |node: SyntaxNode| {
        let tokens = node.descendants_with_tokens().filter_map(|element| element.into_token());
        let token = tokens.into_iter().find(|token| is_number(token) && fits(token))?;
        let number = raised(token.text())?;
        let range = token.text_range();
        Some(Edit::new(db, file, range.start().into()..range.end().into(), &number))
    };
    let root = mauve_hir::parse(db, file).syntax();
    root.descendants().filter(|node| node.kind() == kind).filter_map(first).collect()
}

/// Each entry of a timing table, with all its times raised.
fn times(db: &Database, file: File) -> Vec<Edit> {
    let text: &str = file.text(db);
    let table = Table::parse(text);
    let entries = table.codels.iter().chain(&table.programs).chain(&table.components);
    let edit = |entry: &mauve_timing::Entry| {
        let range = entry.value_span.clone();
        let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_');
        let mut new = String::new();
        let mut rest = text.get(range.clone())?;
        while let Some(start) = rest.find(is_part) {
            let end = rest[start..].find(|c| !is_part(c)).map_or(rest.len(), |end| start + end);
            new += &rest[..start];
            new += &raised(&rest[start..end])?;
            rest = &rest[end..];
        }
        Some(Edit::new(db, file, range, &(new + rest)))
    };
    entries.filter_map(edit).collect()
}

/// The number that is greater by one, so that the order of several stays; none of one that is not plainly decimal.
fn raised(number: &str) -> Option<String> {
    let (whole, fraction) = number.split_at(number.find('.').unwrap_or(number.len()));
    let is_plain = fraction.chars().skip(1).all(|c| c.is_ascii_digit());
    let whole: u64 = whole.parse().ok().filter(|_| is_plain)?;
    Some(format!("{}{fraction}", whole.checked_add(1)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mauve_hir::{config_file, normalised};

    #[test]
    fn every_kind_of_edit_leaves_a_whole_model() {
        let paths = [normalised(&std::path::absolute("../../tests/models/p3dx").unwrap_or_default())];
        let mut db = Database::default();
        let workspaces = load(&mut db, &paths, false).unwrap_or_default();
        let texts = |edits: Vec<Edit>| edits.into_iter().map(|it| it.new.to_string()).collect::<Vec<_>>();
        let models = models(&db, &workspaces);
        let of_models = |edits: fn(&Database, File) -> Vec<Edit>| {
            texts(models.iter().flat_map(|&file| edits(&db, file)).collect())
        };
        let literals = of_models(literals);
        assert!(literals.iter().any(|it| it.contains("attempts = 1;")), "{literals:?}");
        let periods = of_models(periods);
        assert!(matches!(periods.as_slice(), [one] if one.contains("period = 101 ")), "{periods:?}");
        assert!(literals.iter().chain(&periods).all(|it| mauve_syntax::parse(it).errors().is_empty()));
        for &workspace in &workspaces {
            assert!(config_file(&db, workspace).is_some());
            for &file in &table_files(&db, workspace).files {
                let edited = texts(times(&db, file));
                assert!(edited.len() > 20, "{edited:?}");
                assert!(edited.iter().all(|it| Table::parse(it).errors.is_empty()));
            }
        }
    }

    #[test]
    fn only_plain_numbers_are_raised() {
        for (number, greater) in [("9", Some("10")), ("0.25", Some("1.25")), ("1e3", None), ("0x1", None)] {
            assert_eq!(raised(number).as_deref(), greater);
        }
    }
}
