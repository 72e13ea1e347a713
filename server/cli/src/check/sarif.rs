//! `mauve check --format sarif`: the findings as a log of the Static Analysis Results Interchange Format, version 2.1.0.
//!
//! The keys are those of the standard.

use std::collections::BTreeMap;
use std::path::Path;

use mauve_diagnostics::{Code, Finding, Fix, Severity, Suppression, page, supported};
use mauve_hir::{Database, Location};
use mauve_projects::address::address_of;
use mauve_projects::analysis_document::Deployed;
use mauve_projects::json::{non_empty, object};
use serde::Serialize;

use super::verdict::Suppressed;
use crate::lines::{Lines, RangeDocument};
use crate::text::shown;

/// What the locations of files below the current folder are relative to.
const ROOT: &str = "%SRCROOT%";

#[derive(Serialize)]
struct SarifLog<R> {
    #[serde(rename = "$schema")]
    schema: &'static str,
    version: &'static str,
    runs: [R; 1],
}

/// Returns the log of these findings, with paths relative to `here`.
///
/// Suppressed findings are results with the reason: the standard has `inSource` for comments, and `external` for other files. If
/// one result has `suppressions`, all have.
pub(super) fn log(
    db: &Database,
    here: &Path,
    (findings, suppressed): (&[Finding<'_>], &Suppressed<'_>),
    deployed: &[Deployed<'_>],
) -> impl Serialize + use<> {
    let all = || findings.iter().chain(suppressed.iter().map(|(finding, _)| finding));
    let mut rules: Vec<&'static Code> = Vec::new();
    for finding in all() {
        if !rules.contains(&finding.diagnostic.code) {
            rules.push(finding.diagnostic.code);
        }
    }
    let root = address_of(here).map(|url| format!("{}/", url.as_str().trim_end_matches('/')));
    let artifacts =
        Artifacts { db, root: root.as_deref(), lines: Lines { width: |text| text.encode_utf16().count() } };
    let none = (!suppressed.is_empty()).then(Vec::new);
    let whys = findings.iter().map(|_| none.clone());
    let whys = whys.chain(suppressed.iter().map(|(_, why)| Some(vec![why])));
    let results = all().zip(whys).map(|(finding, why)| result(&artifacts, here, finding, (why, &rules)));
    let results: Vec<_> = results.collect();
    let supports = deployed
        .iter()
        .flat_map(|it| it.supports().into_iter().map(move |of| format!("{}: {}", it.name, supported(of))));
    SarifLog {
        schema: "https://json.schemastore.org/sarif-2.1.0.json",
        version: "2.1.0",
        runs: [object! {
            tool: object! {
                driver: object! {
                    name: "mauve",
                    version: env!("CARGO_PKG_VERSION"),
                    rules: rules.into_iter().map(rule).collect::<Vec<_>>(),
                },
            },
            [originalUriBaseIds]: root.map(|root| BTreeMap::from([(ROOT, object! { uri: root })])),
            columnKind: "utf16CodeUnits",
            // What the level of each deployment supports.
            [properties]: non_empty(supports).map(|it| object! { support: it }),
            results: results,
        }],
    }
}

fn result(
    artifacts: &Artifacts<'_>,
    here: &Path,
    finding: &Finding<'_>,
    (suppressions, rules): (Option<Vec<&Suppression>>, &[&'static Code]),
) -> impl Serialize + use<> {
    let diagnostic = &finding.diagnostic;
    let project = finding.only_in.map(|project| shown(project.root(artifacts.db).path(artifacts.db), here));
    let only = project.map_or_else(String::new, |root| format!(" (in the project of {root})"));
    let location = |at: &Location<'_>, text: Option<&str>| {
        object! { physicalLocation: artifacts.of(at), [message]: text.map(message) }
    };
    let related = diagnostic
        .related
        .iter()
        .map(|(at, text)| location(at, Some(text.as_str()).filter(|it| !it.is_empty())));
    object! {
        ruleId: diagnostic.code.name,
        [ruleIndex]: rules.iter().position(|rule| *rule == diagnostic.code),
        level: level(finding.severity),
        message: message(&format!("{}{only}", diagnostic.message)),
        locations: [location(&diagnostic.at, None)],
        [relatedLocations]: non_empty(related),
        [suppressions]: suppressions.map(|all| all.into_iter().map(suppression).collect::<Vec<_>>()),
        [fixes]: non_empty(diagnostic.fixes.iter().map(|fix| artifacts.fix(fix))),
    }
}

fn suppression(why: &Suppression) -> impl Serialize + use<> {
    let (kind, reason) = match why {
        Suppression::Comment(reason) => ("inSource", reason),
        Suppression::Accepted(reason) => ("external", reason),
    };
    object! { kind: kind, justification: reason.clone() }
}

/// Returns a message. SARIF reads braces as arguments unless they are doubled.
fn message(text: &str) -> impl Serialize + use<> {
    object! { text: text.replace('{', "{{").replace('}', "}}") }
}

fn level(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Hint => "note",
    }
}

/// Returns the description of a code, with its page.
fn rule(code: &'static Code) -> impl Serialize {
    let page = page(code.name).unwrap_or_default();
    let prose = prose(&page);
    let first = prose.split("\n\n").next().unwrap_or_default().to_owned();
    object! {
        id: code.name,
        shortDescription: object! { text: first },
        fullDescription: object! { text: prose },
        help: object! { text: page.clone(), markdown: page },
        defaultConfiguration: object! { level: level(code.severity) },
    }
}

/// What a page says before its first example, without its title: paragraphs of one line each.
fn prose(page: &str) -> String {
    let lines = page.lines().skip_while(|line| line.starts_with('#') || line.is_empty());
    let lines: Vec<&str> = lines.take_while(|line| !line.starts_with("```")).collect();
    let paragraphs = lines.split(|line| line.is_empty()).filter(|lines| !lines.is_empty());
    paragraphs.map(|lines| lines.join(" ")).collect::<Vec<_>>().join("\n\n")
}

struct Artifacts<'a> {
    db: &'a Database,
    root: Option<&'a str>,
    lines: Lines,
}

impl Artifacts<'_> {
    fn of(&self, at: &Location<'_>) -> impl Serialize + use<> {
        let (uri, base) = self.artifact(at);
        object! { artifactLocation: object! { uri: uri, [uriBaseId]: base }, region: self.region(at) }
    }

    /// Lines and columns from 1; the end is behind the last column.
    fn region(&self, at: &Location<'_>) -> impl Serialize + use<> {
        let RangeDocument { start, end } = self.lines.range(self.db, at);
        object! { startLine: start.line, startColumn: start.column, endLine: end.line, endColumn: end.column }
    }

    /// Returns the address of a file, and the base that it is relative to.
    fn artifact(&self, at: &Location<'_>) -> (String, Option<&'static str>) {
        let path = at.file(self.db).path(self.db);
        let Some(url) = address_of(path) else { return (path.display().to_string(), None) };
        match self.root.and_then(|root| url.as_str().strip_prefix(root)) {
            // A colon in the first part would end a scheme.
            Some(below) => (below.replace(':', "%3A"), Some(ROOT)),
            None => (url.into(), None),
        }
    }

    /// Returns the changes of a fix, one for each file.
    fn fix(&self, fix: &Fix<'_>) -> impl Serialize + use<> {
        let mut changes: Vec<((String, Option<&str>), Vec<_>)> = Vec::new();
        for (at, text) in &fix.edits {
            let artifact = self.artifact(at);
            let replacement =
                object! { deletedRegion: self.region(at), insertedContent: object! { text: text.clone() } };
            match changes.iter_mut().find(|(known, _)| *known == artifact) {
                Some((_, replacements)) => replacements.push(replacement),
                None => changes.push((artifact, vec![replacement])),
            }
        }
        let changes = changes.into_iter().map(|((uri, base), replacements)| {
            object! { artifactLocation: object! { uri: uri, [uriBaseId]: base }, replacements: replacements }
        });
        object! { description: message(&fix.title), artifactChanges: changes.collect::<Vec<_>>() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mauve_diagnostics::codes;

    /// What GitHub takes.
    #[test]
    fn every_code_has_descriptions_of_a_fitting_length() {
        for code in codes() {
            let rule = serde_json::json!(rule(code));
            let text = |key: &str| rule[key]["text"].as_str().unwrap();
            let (short, full) = (text("shortDescription"), text("fullDescription"));
            assert!(!short.is_empty() && !short.contains(['\n', '#']), "{}: {short}", code.name);
            assert!(full.starts_with(short) && full.len() <= 1024, "{}: {full}", code.name);
            assert!(text("help").starts_with(&format!("# {}\n", code.name)));
        }
    }
}
