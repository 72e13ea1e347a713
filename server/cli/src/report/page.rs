//! The page: the verdict first, what to do next, what changed, then a section for each deployment.

use std::fmt::Write as _;
use std::path::PathBuf;

use mauve_diagnostics::figure::{HintStatus, TIGHT_SLACK};
use mauve_diagnostics::{Finding, Severity, capitalised};
use mauve_hir::Database;
use mauve_ide::{Comparison, html_code, html_page, html_text, html_words};
use mauve_projects::analysis_document::Deployed;
use mauve_projects::verdict::Verdict;

use super::deployment;
use super::rows::{ReportRow, list, rows, shown, table};
use crate::check::verdict::{limits, supports};
use crate::comparison::{changed, lines, why};
use crate::lines::Lines;

/// All that the page shows.
pub(super) struct Page<'a, 'db> {
    pub(super) db: &'db Database,
    /// The file or the folder: places are relative to it.
    pub(super) path: PathBuf,
    pub(super) deployed: &'a [Deployed<'db>],
    pub(super) findings: &'a [Finding<'db>],
    /// How many deadlines are proved, and on which conditions.
    pub(super) verdict: String,
    /// What changed between two states, with their names.
    pub(super) changes: Option<(Vec<Comparison>, [String; 2])>,
}

/// The number of messages among what to do next.
const MOST_NEXT: usize = 5;

/// The number of messages in the list of all.
const MOST_MESSAGES: usize = 500;

impl Page<'_, '_> {
    /// Returns the page.
    pub(super) fn html(&self) -> String {
        let name = self.path.file_name().map(|name| name.display().to_string());
        let title = match (&name, self.deployed) {
            (Some(name), _) => format!("Timing report of {name}"),
            (None, [only]) => format!("Timing report of {}", only.name),
            (None, _) => "Timing report".to_owned(),
        };
        let mut out =
            format!("<header>\n<h1>{}</h1>\n{}</header>\n<main>\n", html_text(&title), self.verdict());
        out += &self.changes();
        for (index, it) in self.deployed.iter().enumerate() {
            out += &deployment::section(it, index);
        }
        out += &self.messages();
        let _ = write!(
            out,
            "</main>\n<footer><p class=\"note\">Response time: the greatest time from the release of a job to its end. Deadlines \
             count from the release. ✓ met, ! met with less than {TIGHT_SLACK} % slack, ✗ missed, ? not analysed. Written by mauve \
             {}.</p></footer>\n",
            env!("CARGO_PKG_VERSION")
        );
        html_page(&title, include_str!("report.css"), &out)
    }

    /// The verdict, the activities that it depends on, and what to do next.
    fn verdict(&self) -> String {
        let mut all: Vec<(&Deployed<'_>, ReportRow<'_, '_>)> =
            self.deployed.iter().flat_map(|of| rows(of).into_iter().map(move |row| (of, row))).collect();
        all.sort_by_key(|(_, row)| row.order());
        let chains: Vec<_> = self.deployed.iter().flat_map(deployment::late_chains).collect();
        let verdict = Verdict::of(self.deployed, TIGHT_SLACK);
        let (status, words) = (verdict.status(), verdict.words());
        let conditions = format!("{}{}{}", self.verdict, limits(self.deployed), supports(self.deployed));
        let mut out = format!(
            "<section class=\"verdict {}\" aria-label=\"Verdict\">\n<p class=\"headline\">{}</p>\n<p>{}.</p>\n",
            status.name(),
            html_text(&words),
            html_text(&capitalised(&conditions)),
        );
        let is_bad = |row: &ReportRow<'_, '_>| row.forms.status.rank() < HintStatus::Tight.rank();
        let shown_rows =
            all.iter().take(all.iter().filter(|(_, row)| is_bad(row)).count().clamp(1, MOST_NEXT));
        let named = shown_rows.map(|(of, row)| {
            let of =
                if self.deployed.len() > 1 { format!(" of {}", html_code(of.name)) } else { String::new() };
            format!("{}{of}: {}", html_code(&row.activity.instance), shown(&row.forms))
        });
        let late = chains
            .iter()
            .take(MOST_NEXT)
            .map(|it| format!("chain {}: {}", html_code(&it.name), deployment::chain_figure(it)));
        let named: Vec<String> = late.chain(named).collect();
        let what = if status.rank() < HintStatus::Tight.rank() { "Worst" } else { "Least slack" };
        let _ = write!(
            out,
            "<h2>{what}</h2>\n{}<h2>What next</h2>\n{}</section>\n",
            list(named),
            self.next(status)
        );
        out
    }

    /// What to do next: errors first, then warnings with what would correct them.
    fn next(&self, status: HintStatus) -> String {
        let mut found: Vec<&Finding<'_>> =
            self.findings.iter().filter(|it| it.severity != Severity::Hint).collect();
        found.sort_by_key(|it| it.severity != Severity::Error);
        let more = found.len().saturating_sub(MOST_NEXT);
        let mut items: Vec<String> = found.iter().take(MOST_NEXT).map(|it| self.message(it)).collect();
        items.extend((more > 0).then(|| format!("{more} more: see <a href=\"#messages\">Messages</a>")));
        if status == HintStatus::Missed {
            items.push("<code>mauve tune</code> searches for priorities, CPUs and periods with which more deadlines are met".to_owned());
        }
        let assumed: usize = self.deployed.iter().filter_map(Deployed::basis).map(|it| it.assumed).sum();
        items.extend(match assumed {
            0 => None,
            1 => Some("1 execution time is assumed: measure it".to_owned()),
            several => Some(format!("{several} execution times are assumed: measure them")),
        });
        if items.is_empty() {
            items.push("Nothing has to change.".to_owned());
        }
        list(items)
    }

    /// Returns a message with its place and what would correct it.
    fn message(&self, finding: &Finding<'_>) -> String {
        let diagnostic = &finding.diagnostic;
        let here = if self.path.is_dir() { Some(&*self.path) } else { self.path.parent() };
        let lines = Lines { width: |text| text.chars().count() };
        let place = lines.shown(self.db, here.unwrap_or(&self.path), &diagnostic.at);
        let fixes: String = diagnostic
            .fixes
            .iter()
            .map(|it| format!("<br/><small>possible: {}</small>", html_words(&it.title)))
            .collect();
        let severity = finding.severity.name();
        format!(
            "<b class=\"{severity}\">{severity}</b>: {} <small>{} <code>{}</code></small>{fixes}",
            html_words(&diagnostic.message),
            html_text(place.trim()),
            diagnostic.code.name
        )
    }

    /// What changed between two states.
    fn changes(&self) -> String {
        let Some((all, [before, after])) = &self.changes else { return String::new() };
        let mut out = format!(
            "<section>\n<h2>What changed</h2>\n<p class=\"note\">{} → {}</p>\n",
            html_text(before),
            html_text(after)
        );
        for it in all {
            let name = it.state().map_or("", |it| &it.deployment);
            let _ = writeln!(
                out,
                "<h3>{} at {}: {}</h3>",
                html_code(name),
                html_text(&it.level()),
                html_text(&it.verdict())
            );
            for (head, of) in changed(it) {
                let row = |row: &&mauve_ide::Compared| {
                    let [before, after] = row.shown();
                    let is_missed = row.after.as_ref().is_some_and(|it| it.hint == HintStatus::Missed);
                    let class = match row.is_worse() {
                        true if is_missed => "worse",
                        true => "warned",
                        false => "other",
                    };
                    let was = row.was().map_or_else(String::new, |was| format!(" (was {})", html_code(was)));
                    vec![
                        html_code(row.name()) + &was,
                        html_text(&before),
                        format!("<b class=\"{class}\">{}</b>", html_text(&after)),
                        html_text(&why(row)),
                    ]
                };
                out += &table(&[head, "before", "after", "what"], of.iter().map(row));
            }
            out += &list(lines(it).iter().map(|it| html_text(it)));
        }
        out + "</section>\n"
    }

    /// All messages, the errors first.
    fn messages(&self) -> String {
        let mut found: Vec<&Finding<'_>> = self.findings.iter().collect();
        found.sort_by_key(|it| match it.severity {
            Severity::Error => 0,
            Severity::Warning => 1,
            Severity::Hint => 2,
        });
        if found.is_empty() {
            return String::new();
        }
        let more = found.len().saturating_sub(MOST_MESSAGES);
        let items = found.iter().take(MOST_MESSAGES).map(|it| self.message(it));
        let more = (more > 0).then(|| format!("{more} more"));
        format!("<section id=\"messages\">\n<h2>Messages</h2>\n{}</section>\n", list(items.chain(more)))
    }
}
