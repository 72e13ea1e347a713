//! `mauve check [PATH…]`: all diagnostics of models, with excerpts; then the response times.

mod fix;
mod remedies;
mod sarif;
mod standard_input;
pub(crate) mod verdict;

use std::io::IsTerminal as _;
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};

use annotate_snippets::{AnnotationKind, Level, Message, Origin, Renderer, Snippet, Title};
use clap::ValueEnum;
use mauve_diagnostics::{
    Code, Finding, Findings, Fix, Severity, Suppression, code_named, errors_of_text, workspace_findings,
};
use mauve_hir::{Database, Location, Workspace};
use mauve_projects::analysis_document::{analysis_document, at_shown_level};
use mauve_projects::harmless::{harmless, harmless_but_for_styles};
use mauve_projects::json::{self, non_empty, object};
use mauve_projects::load::Outside;
use mauve_projects::load::load;
use mauve_projects::output::{Output, print_patch};
use serde::Serialize;

use self::fix::Fixed;
use self::remedies::remedies;
use self::standard_input::load_or_read;
use self::verdict::{Suppressed, deadlines, is_proof_missing, limits, supports};
use super::wcrt;
use crate::lines::{Lines, clamp};
use crate::options::Paths;
use crate::text::{counted, shown, wrapped};
use crate::verify::check_certificate;

#[derive(Debug, clap::Args)]
pub struct CheckCommand {
    #[command(flatten)]
    paths: Paths,
    #[command(flatten)]
    outside: Outside,
    /// The output format.
    #[arg(long, value_enum, default_value = "human")]
    format: CheckFormat,
    /// Report these diagnostics as errors: codes, separated by commas, or `warnings` for all warnings. A code that mauve.toml
    /// sets to `allow` is not reported.
    #[arg(long, value_name = "CODE", value_delimiter = ',')]
    deny: Vec<Denied>,
    /// Show all hints; more than three are only counted otherwise.
    #[arg(long, conflicts_with = "format")]
    hints: bool,
    /// Apply the fixes that need no choice, such as a misspelt name with one candidate, then report the other
    /// diagnostics. Writes only files in PATH.
    #[arg(long)]
    fix: bool,
    /// Show what --fix would change, write nothing, and exit with 1 if there is something.
    #[arg(long, conflicts_with = "format")]
    diff: bool,
    /// Let the independent checker of `mauve verify` check why deadlines are met, and exit with 1 if it refuses.
    #[arg(long, conflicts_with = "diff")]
    verify: bool,
    /// Check the text on standard input in place of this file, in its project. (`-` as PATH is standard input.)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fix", "diff"])]
    stdin_path: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CheckFormat {
    /// For people: excerpts of the text, and a table of response times.
    Human,
    /// One document.
    Json,
    /// SARIF 2.1.0, for the code scanning of a forge and for viewers.
    Sarif,
}

/// The diagnostics that `--deny` reports as errors.
#[derive(Debug, Clone, Copy)]
enum Denied {
    Warnings,
    /// The diagnostics of this code, also if they are hints.
    One(&'static Code),
}

impl std::str::FromStr for Denied {
    type Err = String;

    fn from_str(text: &str) -> Result<Denied, String> {
        if text == "warnings" {
            return Ok(Denied::Warnings);
        }
        code_named(text).map(Denied::One).ok_or_else(|| super::explain::unknown(text))
    }
}

impl Denied {
    fn has(self, finding: &Finding<'_>) -> bool {
        match self {
            Denied::Warnings => finding.severity == Severity::Warning,
            Denied::One(code) => code == finding.diagnostic.code,
        }
    }
}

impl CheckCommand {
    pub(crate) fn run(self) -> Result<Output, String> {
        let here = std::env::current_dir().unwrap_or_default();
        let fixed = match self.fix || self.diff {
            true => Some(self.fixed()?),
            false => None,
        };
        if let Some(fixed) = fixed.as_ref().filter(|_| self.diff) {
            let diff = fixed.files.diff(&here);
            print_patch(&diff)?;
            return Ok(Output::verbatim("", u8::from(!diff.is_empty())));
        }
        let written = fixed.as_ref().map(|fixed| fixed.files.write(&here));
        // The process ends after the command, and freeing the database would be a tenth of its time.
        let mut db = ManuallyDrop::new(Database::default());
        let (replaced, allows_outside) = (self.stdin_path.as_deref(), self.outside.allow_outside);
        let workspaces = load_or_read(&mut db, &self.paths.paths, replaced, allows_outside)?;
        let db: &Database = &db;
        let mut findings: Vec<Finding<'_>> = Vec::new();
        let mut suppressed = Vec::new();
        for &workspace in &workspaces {
            let Findings { shown, suppressed: others } = workspace_findings(db, workspace);
            findings.extend(shown);
            suppressed.extend(others);
        }
        for finding in &mut findings {
            if self.deny.iter().any(|denied| denied.has(finding)) {
                finding.severity = Severity::Error;
            }
        }
        let fixes = fixed.as_ref().map_or(0, |fixed| fixed.fixes);
        let count = |severity| findings.iter().filter(|it| it.severity == severity).count();
        let (errors, warnings, hints) =
            (count(Severity::Error), count(Severity::Warning), count(Severity::Hint));
        let deployed = at_shown_level(db, &workspaces)?;
        let verified = if self.verify { Some(check_certificate(&deployed)?) } else { None };
        let text = match self.format {
            CheckFormat::Sarif => json::text(&sarif::log(db, &here, (&findings, &suppressed), &deployed))?,
            CheckFormat::Json => {
                let lines = Lines { width: |text| text.chars().count() };
                json::text(&object! {
                    diagnostics: findings.iter().map(|it| document(db, &lines, it)).collect::<Vec<_>>(),
                    [suppressed]: non_empty(suppressed.iter().map(|it| suppressed_document(db, &lines, it))),
                    errors: errors,
                    warnings: warnings,
                    hints: hints,
                    [fixed]: fixed.as_ref().map(|_| fixes),
                    [certificate]: verified.as_ref().map(|(said, _)| said.as_str()),
                    deployments: deployed.iter().map(analysis_document).collect::<Vec<_>>(),
                })?
            }
            CheckFormat::Human => {
                let mut parts: Vec<String> =
                    written.iter().map(|(files, _)| fix::said(fixes, files) + &remedies(&deployed)).collect();
                let is_folded = hints > MOST_HINTS && !self.hints;
                let is_shown = |it: &&Finding<'_>| it.severity != Severity::Hint || !is_folded;
                let shown: Vec<&Finding<'_>> = findings.iter().filter(is_shown).collect();
                parts.extend(excerpts(&shown, |it| excerpt(db, &here, it)));
                parts.extend(wcrt::shown_tables(&wcrt::tables(&deployed)));
                let mut found = format!("{}, {}", counted(errors, "error"), counted(warnings, "warning"));
                if hints > 0 {
                    let folded = if is_folded { " (--hints shows them)" } else { "" };
                    found += &format!(", {}{folded}", counted(hints, "hint"));
                }
                if !suppressed.is_empty() {
                    found += &format!(", {} suppressed", suppressed.len());
                }
                found += &lowered(db, &workspaces, &findings, &suppressed);
                let is_tunable = |it: &&Finding<'_>| TUNABLE.contains(&it.diagnostic.code.name);
                let pages = match shown.iter().any(is_tunable) {
                    true => {
                        "`mauve explain CODE` explains a diagnostic, `mauve tune` searches for priorities, CPUs and periods.\n"
                    }
                    false if shown.is_empty() => "",
                    false => "`mauve explain CODE` explains a diagnostic.\n",
                };
                let verdict = deadlines(&deployed, &suppressed) + &supports(&deployed) + &limits(&deployed);
                let said = verified.as_ref().map(|(said, _)| format!("certificate: {}\n", harmless(said)));
                let said = said.unwrap_or_default();
                parts.push(wrapped(&format!("{found}; {verdict}\n{said}{pages}")));
                parts.join("\n")
            }
        };
        let is_written = written.is_none_or(|(_, is_complete)| is_complete);
        let is_refused = verified.is_some_and(|(_, is_accepted)| !is_accepted);
        let is_wrong = errors > 0 || is_refused || is_proof_missing(&deployed);
        let code = if is_written { u8::from(is_wrong) } else { 2 };
        Ok(Output::verbatim(text, code))
    }

    /// Applies the mechanical fixes in memory.
    fn fixed(&self) -> Result<Fixed, String> {
        let mut db = Database::default();
        let workspaces = load(&mut db, &self.paths.paths, self.outside.allow_outside)?;
        fix::fix(&mut db, &workspaces, &self.paths.paths)
    }
}

/// Says how many errors are not shown as such, by `[lints]` or by comments: with them, nothing is proved either.
fn lowered(
    db: &Database,
    workspaces: &[Workspace],
    findings: &[Finding<'_>],
    suppressed: &Suppressed<'_>,
) -> String {
    let all = errors_of_text(db, workspaces);
    let is_of_text = |it: &&Finding<'_>| it.diagnostic.code.is_of_text();
    let (errors, others): (Vec<_>, Vec<_>) =
        findings.iter().filter(is_of_text).partition(|it| it.severity == Severity::Error);
    let suppressed = suppressed.iter().map(|(finding, _)| finding).filter(is_of_text).count();
    let hidden = all.saturating_sub(errors.len() + others.len() + suppressed);
    let by_lints = match (others.len(), hidden) {
        (0, 0) => String::new(),
        (0, hidden) => format!(" ([lints] hides {})", counted(hidden, "error")),
        (lowered, 0) => format!(" ([lints] lowers {})", counted(lowered, "error")),
        (lowered, hidden) => format!(" ([lints] lowers {}, and hides {hidden})", counted(lowered, "error")),
    };
    match suppressed {
        0 => by_lints,
        count => format!("{by_lints} (comments hide {})", counted(count, "error")),
    }
}

/// The codes of what `mauve tune` may help with.
const TUNABLE: [&str; 3] = ["missing-field", "deadline-missed", "not-deadline-monotonic"];

/// The number of hints that are shown without `--hints`: more would move the errors and the table out of sight.
const MOST_HINTS: usize = 3;

/// Maximum number of excerpts in a terminal.
const MOST_EXCERPTS: usize = 500;

/// Returns the excerpts of the first findings, and the number of the others.
pub(super) fn excerpts<T>(all: &[T], excerpt: impl Fn(&T) -> String) -> Vec<String> {
    let more = all.len().saturating_sub(MOST_EXCERPTS);
    let more = (more > 0).then(|| format!("… and {more} more: `--format json` shows all\n"));
    all.iter().take(MOST_EXCERPTS).map(excerpt).chain(more).collect()
}

/// A diagnostic as people read it.
pub(super) fn excerpt(db: &Database, here: &Path, finding: &Finding<'_>) -> String {
    let diagnostic = &finding.diagnostic;
    let level = match finding.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Hint => Level::HELP.with_name(Severity::Hint.name()),
    };
    let title = level.primary_title(harmless(&diagnostic.message)).id(diagnostic.code.name);
    let mut places = vec![(&diagnostic.at, "", AnnotationKind::Primary)];
    let related = diagnostic.related.iter();
    places.extend(related.map(|(at, message)| (at, message.as_str(), AnnotationKind::Context)));
    let fixes = diagnostic.fixes.iter().filter(|fix| !is_said(&diagnostic.message, fix));
    let mut notes: Vec<_> = fixes.map(|fix| Level::HELP.message(harmless(&fix.title))).collect();
    let only = finding.only_in.map(|project| harmless(&shown(project.root(db).path(db), here)));
    notes.extend(only.map(|root| Level::NOTE.message(format!("in the project of {root}"))));
    with_excerpts(db, here, title, &places, notes)
}

/// Returns a title, and excerpts of the text at some places.
pub(super) fn with_excerpts(
    db: &Database,
    here: &Path,
    title: Title<'_>,
    places: &[(&Location<'_>, &str, AnnotationKind)],
    notes: Vec<Message<'_>>,
) -> String {
    // One snippet for each file, so that related places of one file stand in one excerpt.
    let mut files = Vec::new();
    for (at, ..) in places {
        let file = at.file(db);
        if !files.contains(&file) {
            files.push(file);
        }
    }
    let paths: Vec<String> = files.iter().map(|file| harmless(&shown(file.path(db), here))).collect();
    let mut group = annotate_snippets::Group::with_title(title);
    for (file, path) in files.iter().zip(&paths) {
        if file.is_outside(db) {
            // It was not read.
            group = group.element(Origin::path(path.as_str()));
            continue;
        }
        // The styles are ours alone: what begins one has one byte, as what stands for it.
        let text = file.text(db).replace('\u{1b}', "?");
        let mut annotations = Vec::new();
        for (at, message, kind) in places.iter().filter(|(at, ..)| at.file(db) == *file) {
            let range = at.range(db);
            let span = clamp(&text, range.start().into(), range.end().into());
            let annotation = kind.span(span);
            annotations.push(if message.is_empty() {
                annotation
            } else {
                annotation.label(harmless(message))
            });
        }
        let snippet = Snippet::source(text).path(path.as_str()).fold(true);
        group = group.element(snippet.annotations(annotations));
    }
    for note in notes {
        group = group.element(note);
    }
    let renderer = if std::io::stdout().is_terminal() { Renderer::styled() } else { Renderer::plain() };
    harmless_but_for_styles(&with_arrows(&(renderer.render(&[group]) + "\n")))
}

/// Replaces the marker `:::` of a second file, which is read as a command in a CI job.
fn with_arrows(excerpts: &str) -> String {
    let marker = |line: &str| {
        let rest = line.trim_start();
        let indent = line.len() - rest.len();
        rest.strip_prefix("::: ").map(|rest| format!("{:indent$}--> {rest}", ""))
    };
    excerpts.split_inclusive('\n').map(|line| marker(line).unwrap_or_else(|| line.to_owned())).collect()
}

/// Does the message quote what the fix would write, so that its title says no more?
fn is_said(message: &str, fix: &Fix<'_>) -> bool {
    fix.edits.iter().all(|(_, text)| !text.is_empty() && message.contains(&format!("`{text}`")))
}

fn document(db: &Database, lines: &Lines, finding: &Finding<'_>) -> impl Serialize + use<> {
    let diagnostic = &finding.diagnostic;
    let related = diagnostic.related.iter().map(|(at, message)| located(db, lines, at, message));
    object! {
        code: diagnostic.code.name,
        severity: finding.severity.name(),
        message: diagnostic.message.clone(),
        file: diagnostic.at.file(db).path(db).display().to_string(),
        range: lines.range(db, &diagnostic.at),
        related: related.collect::<Vec<_>>(),
        fixes: diagnostic.fixes.iter().map(|fix| fix.title.clone()).collect::<Vec<_>>(),
        edits: diagnostic.fixes.iter().map(|fix| edits(db, lines, fix)).collect::<Vec<_>>(),
        [only_in]: finding.only_in.map(|project| project.root(db).path(db).clone()),
    }
}

/// A finding that is not shown, and why.
fn suppressed_document(
    db: &Database,
    lines: &Lines,
    (finding, why): &(Finding<'_>, Suppression),
) -> impl Serialize + use<> {
    let (by, reason) = match why {
        Suppression::Comment(reason) => ("comment", reason),
        Suppression::Accepted(reason) => ("mauve.toml", reason),
    };
    object! { by: by, reason: reason.clone(), diagnostic: document(db, lines, finding) }
}

/// Returns the changes of a fix.
fn edits(db: &Database, lines: &Lines, fix: &Fix<'_>) -> impl Serialize + use<> {
    let change = |(at, text): &(Location<'_>, String)| {
        object! { file: at.file(db).path(db).display().to_string(), range: lines.range(db, at), text: text.clone() }
    };
    object! { title: fix.title.clone(), changes: fix.edits.iter().map(change).collect::<Vec<_>>() }
}

/// Returns a message with its location.
pub(super) fn located(
    db: &Database,
    lines: &Lines,
    at: &Location<'_>,
    message: &str,
) -> impl Serialize + use<> {
    let (message, file) = (message.to_owned(), at.file(db).path(db).display().to_string());
    object! { message: message, file: file, range: lines.range(db, at) }
}
