//! `mauve check --format sarif`: what is found, as a log of the Static Analysis Results Interchange Format, version 2.1.0.
//!
//! The names are those of the standard; what is not always there is not written where it is not.

use std::path::Path;

use mauve_diagnostics::{Code, Finding, Fix, Severity, page};
use mauve_hir::{Database, Location};
use serde::Serialize;
use tower_lsp::lsp_types::Url;

use super::{Lines, RangeDocument, shown};

/// What the places of files below the current folder are relative to.
const ROOT: &str = "%SRCROOT%";

/// The log of these findings; files below `here` are named from there.
pub(super) fn log(db: &Database, here: &Path, findings: &[Finding<'_>]) -> Log {
    let mut rules: Vec<&'static Code> = Vec::new();
    for finding in findings {
        if !rules.contains(&finding.diagnostic.code) {
            rules.push(finding.diagnostic.code);
        }
    }
    let root = Url::from_directory_path(here).ok();
    let places = Places { db, root: root.as_ref(), lines: Lines::new(|text| text.encode_utf16().count()) };
    let results = results(places, here, findings, &rules);
    Log {
        schema: "https://json.schemastore.org/sarif-2.1.0.json",
        version: "2.1.0",
        runs: [Run {
            tool: Tool {
                driver: Driver {
                    name: "mauve",
                    version: env!("CARGO_PKG_VERSION"),
                    rules: rules.into_iter().map(rule).collect(),
                },
            },
            original_uri_base_ids: root.map(|root| BaseIds { root: Uri { uri: root.into() } }),
            column_kind: "utf16CodeUnits",
            results,
        }],
    }
}

fn results(
    mut places: Places<'_>,
    here: &Path,
    findings: &[Finding<'_>],
    rules: &[&'static Code],
) -> Vec<ResultOf> {
    let result = |finding: &Finding<'_>| {
        let diagnostic = &finding.diagnostic;
        let project = finding.only_in.map(|project| shown(project.root(places.db).path(places.db), here));
        let only = project.map_or_else(String::new, |root| format!(" (in the project of {root})"));
        let mut related = Vec::new();
        for (at, message) in &diagnostic.related {
            let message = (!message.is_empty()).then(|| Message::new(message));
            related.push(ResultLocation { physical_location: places.of(at), message });
        }
        ResultOf {
            rule_id: diagnostic.code.name,
            rule_index: rules.iter().position(|rule| *rule == diagnostic.code),
            level: level(finding.severity),
            message: Message::new(&format!("{}{only}", diagnostic.message)),
            locations: [ResultLocation { physical_location: places.of(&diagnostic.at), message: None }],
            related_locations: related,
            fixes: diagnostic.fixes.iter().map(|fix| places.fix(fix)).collect(),
        }
    };
    findings.iter().map(result).collect()
}

fn level(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Hint => "note",
    }
}

/// A code, with its page.
fn rule(code: &'static Code) -> Rule {
    let page = page(code.name).unwrap_or_default();
    let prose = prose(&page);
    let first = prose.split("\n\n").next().unwrap_or_default();
    Rule {
        id: code.name,
        short_description: Text { text: first.to_owned(), markdown: None },
        full_description: Text { text: prose.clone(), markdown: None },
        help: Text { text: page.clone(), markdown: Some(page) },
        default_configuration: Configuration { level: level(code.severity) },
    }
}

/// What a page says before its first example, without its title: paragraphs of one line each.
fn prose(page: &str) -> String {
    let lines = page.lines().skip_while(|line| line.starts_with('#') || line.is_empty());
    let lines: Vec<&str> = lines.take_while(|line| !line.starts_with("```")).collect();
    let paragraphs = lines.split(|line| line.is_empty()).filter(|lines| !lines.is_empty());
    paragraphs.map(|lines| lines.join(" ")).collect::<Vec<_>>().join("\n\n")
}

struct Places<'a> {
    db: &'a Database,
    root: Option<&'a Url>,
    lines: Lines,
}

impl Places<'_> {
    fn of(&self, at: &Location<'_>) -> PhysicalLocation {
        PhysicalLocation { artifact_location: self.artifact(at), region: self.region(at) }
    }

    fn region(&self, at: &Location<'_>) -> Region {
        let RangeDocument { start, end } = self.lines.range(self.db, at);
        Region {
            start_line: start.line,
            start_column: start.column,
            end_line: end.line,
            end_column: end.column,
        }
    }

    fn artifact(&self, at: &Location<'_>) -> Artifact {
        let path = at.file(self.db).path(self.db);
        let Ok(url) = Url::from_file_path(path) else {
            return Artifact { uri: path.display().to_string(), uri_base_id: None };
        };
        match self.root.and_then(|root| url.as_str().strip_prefix(root.as_str())) {
            // A colon in the first part would end a scheme.
            Some(below) => Artifact { uri: below.replace(':', "%3A"), uri_base_id: Some(ROOT) },
            None => Artifact { uri: url.into(), uri_base_id: None },
        }
    }

    /// A change for each file that the fix touches.
    fn fix(&mut self, fix: &Fix<'_>) -> FixDocument {
        let mut changes: Vec<Change> = Vec::new();
        for (at, text) in &fix.edits {
            let artifact_location = self.artifact(at);
            let replacement = Replacement {
                deleted_region: self.region(at),
                inserted_content: Content { text: text.clone() },
            };
            match changes.iter_mut().find(|change| change.artifact_location == artifact_location) {
                Some(change) => change.replacements.push(replacement),
                None => changes.push(Change { artifact_location, replacements: vec![replacement] }),
            }
        }
        FixDocument { description: Message::new(&fix.title), artifact_changes: changes }
    }
}

#[derive(Serialize)]
pub(super) struct Log {
    #[serde(rename = "$schema")]
    schema: &'static str,
    version: &'static str,
    runs: [Run; 1],
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Run {
    tool: Tool,
    #[serde(skip_serializing_if = "Option::is_none")]
    original_uri_base_ids: Option<BaseIds>,
    column_kind: &'static str,
    results: Vec<ResultOf>,
}

#[derive(Serialize)]
struct BaseIds {
    #[serde(rename = "%SRCROOT%")]
    root: Uri,
}

#[derive(Serialize)]
struct Uri {
    uri: String,
}

#[derive(Serialize)]
struct Tool {
    driver: Driver,
}

#[derive(Serialize)]
struct Driver {
    name: &'static str,
    version: &'static str,
    rules: Vec<Rule>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Rule {
    id: &'static str,
    short_description: Text,
    full_description: Text,
    help: Text,
    default_configuration: Configuration,
}

#[derive(Serialize)]
struct Text {
    text: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    markdown: Option<String>,
}

#[derive(Serialize)]
struct Configuration {
    level: &'static str,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct ResultOf {
    rule_id: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    rule_index: Option<usize>,
    level: &'static str,
    message: Message,
    locations: [ResultLocation; 1],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    related_locations: Vec<ResultLocation>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    fixes: Vec<FixDocument>,
}

#[derive(Serialize)]
struct Message {
    text: String,
}

impl Message {
    /// Braces stand for arguments in messages, unless they are doubled.
    fn new(text: &str) -> Message {
        Message { text: text.replace('{', "{{").replace('}', "}}") }
    }
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct ResultLocation {
    physical_location: PhysicalLocation,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<Message>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct PhysicalLocation {
    artifact_location: Artifact,
    region: Region,
}

#[derive(Serialize, PartialEq)]
#[serde(rename_all = "camelCase")]
struct Artifact {
    uri: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    uri_base_id: Option<&'static str>,
}

/// Lines and columns from 1; the end is behind the last column.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Region {
    start_line: usize,
    start_column: usize,
    end_line: usize,
    end_column: usize,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct FixDocument {
    description: Message,
    artifact_changes: Vec<Change>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Change {
    artifact_location: Artifact,
    replacements: Vec<Replacement>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Replacement {
    deleted_region: Region,
    inserted_content: Content,
}

#[derive(Serialize)]
struct Content {
    text: String,
}

#[cfg(test)]
mod tests {
    use super::*;
    use mauve_diagnostics::codes;

    /// What GitHub takes.
    #[test]
    fn every_code_has_descriptions_of_a_fitting_length() {
        for code in codes() {
            let rule = rule(code);
            let (short, full) = (rule.short_description.text, rule.full_description.text);
            assert!(!short.is_empty() && !short.contains(['\n', '#']), "{}: {short}", code.name);
            assert!(full.starts_with(&short) && full.len() <= 1024, "{}: {full}", code.name);
            assert!(rule.help.text.starts_with(&format!("# {}\n", code.name)));
        }
    }
}
