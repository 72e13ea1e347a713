//! Figures in two states beside each other, for people, pull requests and programs.

use std::fmt::Write as _;

use mauve_ide::{Compared, Comparison, Figure, FigureChange, Figures, markdown_code};
use mauve_timing::{Status, Time};
use serde::Serialize;

use crate::analysis_document::milliseconds;
use crate::cli::text::{columns, counted};
use crate::json::{non_empty, object};

/// Returns a table of what changed, under the name of the deployment.
pub(super) fn comparison_table(it: &Comparison) -> String {
    let mut out = format!("{}{} at {}: {}\n", name(it), was(it), it.level(), it.verdict());
    for (head, of) in parts(it) {
        let rows: Vec<Vec<String>> = changed(of).map(|row| cells(row, name_of(row))).collect();
        if !rows.is_empty() {
            out += &columns(&[head, "before", "after", ""], &rows);
        }
    }
    out.extend(unchanged(it).map(|it| format!("  {it}\n")));
    out.extend(
        utilisations(it)
            .into_iter()
            .map(|(cpu, [before, after])| format!("  {cpu} utilisation: {before} → {after}\n")),
    );
    out.extend(times(it).map(|it| format!("  {it}\n")));
    out.extend(new_errors(it).map(|it| format!("  {it}\n")));
    out
}

/// The maximum number of rows of a table in Markdown: a forge refuses long comments.
const MOST_ROWS: usize = 100;

/// Returns the same in Markdown, for a pull request.
pub(super) fn comparison_markdown(it: &Comparison) -> String {
    let (name, was) = (markdown_code(name(it)), escaped(&was(it)));
    let mut out = format!("**{name}**{was} at {}: {}\n", it.level(), it.verdict());
    for (head, of) in parts(it) {
        let rows: Vec<&Compared> = changed(of).collect();
        if rows.is_empty() {
            continue;
        }
        let _ = write!(out, "\n| {head} | before | after | |\n|---|---|---|---|\n");
        let more = rows.len().saturating_sub(MOST_ROWS);
        for row in rows.into_iter().take(MOST_ROWS) {
            let name = match row.was() {
                Some(was) => format!("{} (was {})", markdown_code(&row.name()), markdown_code(was)),
                None => markdown_code(&row.name()),
            };
            // Figures and fields may quote names of the model.
            let shown = row.shown().map(|it| if it == "–" { it } else { markdown_code(&it) });
            let why = cells(row, String::new()).pop().unwrap_or_default();
            let cells = [name].into_iter().chain(shown).map(|it| it.replace('|', "\\|"));
            let cells: Vec<String> = cells.chain([escaped(&why)]).collect();
            let _ = writeln!(out, "| {} |", cells.join(" | "));
        }
        if more > 0 {
            let _ = writeln!(out, "\n{more} more in this table: `--format json` has all");
        }
    }
    out.extend(unchanged(it).map(|it| format!("\n{it}\n")));
    out.extend(
        utilisations(it)
            .into_iter()
            .map(|(cpu, [before, after])| format!("\n{} utilisation: {before} → {after}\n", escaped(&cpu))),
    );
    out.extend(times(it).map(|it| format!("\n{}\n", escaped(&it))));
    out.extend(new_errors(it).map(|it| format!("\n{}\n", escaped(&it))));
    out
}

/// Returns a text in which Markdown finds no style, link or HTML, and no mention of a user.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            // Escapes do not keep a forge from finding users and issues: a space without width does.
            '@' | '#' => {
                out.extend(['\\', letter]);
                out += "&#8203;";
            }
            '<' => out += "&lt;",
            '&' => out += "&amp;",
            letter if letter.is_control() => out.push('\u{fffd}'),
            // `.` and `:` make an address of a word.
            letter if letter.is_ascii_punctuation() && !",.:;%()/'\"=?".contains(letter) => {
                out.extend(['\\', letter])
            }
            letter => out.push(letter),
        }
    }
    out.replace("://", ":&#47;/").replace("www.", "www&#46;")
}

/// Returns the same as a document, with all rows.
pub(super) fn comparison_document(it: &Comparison) -> impl Serialize + use<> {
    let state = |of: &Option<Figures>| {
        of.as_ref().map(|it| {
            let (met, all) = it.met();
            object! { met: met, deadlines: all, errors: it.errors }
        })
    };
    let figure = |of: &Option<Figure>| {
        of.as_ref().map(|it| {
            object! {
                status: it.status.name(),
                time: it.time.map(milliseconds),
                limit: it.limit.map(milliseconds),
                [reasons]: non_empty(it.reasons.iter().cloned()),
            }
        })
    };
    let rows = |of: &[Compared]| {
        let row = |it: &Compared| {
            object! {
                name: it.name().to_string(),
                // Its name before, if it was renamed.
                [was]: it.was().map(|it| it.to_string()),
                // missed, found-missed, lost, unlimited, gone, new-missed, later, tolerated, relaxed, new, met, found, earlier,
                // tightened, fields or same
                change: it.change().name(),
                // The fields of the activity that are different.
                [fields]: non_empty(it.fields()),
                before: figure(&it.before),
                after: figure(&it.after),
            }
        };
        of.iter().map(row).collect::<Vec<_>>()
    };
    let cpus = utilisations(it).into_iter().map(|(cpu, [before, after])| {
        object! { cpus: cpu, before: before, after: after }
    });
    let times = it.times().into_iter().map(|(key, [before, after])| {
        object! { key: key.to_owned(), before: before.map(milliseconds), after: after.map(milliseconds) }
    });
    object! {
        deployment: name(it).to_owned(),
        [was]: it.was().map(str::to_owned),
        unit: "ms",
        significance: it.state().and_then(|it| it.level.parse::<f64>().ok()),
        before: state(&it.before),
        after: state(&it.after),
        activities: rows(&it.activities),
        chains: rows(&it.chains),
        [utilisation]: non_empty(cpus),
        // The execution times that are different, the greatest difference first.
        [times]: non_empty(times),
    }
}

/// Returns a tolerance: a time, or percent of the time before, such as `5%`.
pub(super) fn tolerance(text: &str) -> Result<Tolerance, String> {
    let wrong = || "expected a time or percent, such as 2ms or 5%".to_owned();
    match text.strip_suffix('%') {
        Some(percent) => Ok(Tolerance::Percent(percent.trim().parse().map_err(|_| wrong())?)),
        None if text == "0" => Ok(Tolerance::Percent(0)),
        None => super::options::time(text).map(Tolerance::Time).map_err(|_| wrong()),
    }
}

/// By how much a figure may be later.
#[derive(Debug, Clone, Copy)]
pub(super) enum Tolerance {
    Percent(u32),
    Time(Time),
}

impl Tolerance {
    /// Returns by how much a figure may be later that was `before`.
    pub(super) fn of(self, before: Time) -> Time {
        match self {
            Tolerance::Time(time) => time,
            Tolerance::Percent(percent) => {
                let nanos = u128::from(before.as_nanos()) * u128::from(percent) / 100;
                Time::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
            }
        }
    }
}

fn parts(it: &Comparison) -> [(&'static str, &[Compared]); 2] {
    [("activity", &it.activities), ("chain", &it.chains)]
}

fn changed(of: &[Compared]) -> impl Iterator<Item = &Compared> {
    of.iter().filter(|it| it.change() != FigureChange::Same || it.was().is_some()).filter(|it| !is_void(it))
}

/// Returns whether this is a chain without a declaration and without a latency, before and after: there are many.
fn is_void(row: &Compared) -> bool {
    let has_nothing =
        |it: &Figure| it.status == Status::NotAnalysed && it.time.is_none() && it.limit.is_none();
    let [before, after] = [&row.before, &row.after].map(|it| it.as_ref().is_none_or(has_nothing));
    let is_chain = row.fields().is_empty();
    before && after && is_chain
}

fn cells(row: &Compared, name: String) -> Vec<String> {
    let [before, after] = row.shown();
    let change = row.change().words();
    let fields = row.fields();
    let why = std::iter::once(change).filter(|it| !it.is_empty()).chain(fields.iter().map(String::as_str));
    vec![name, before, after, why.collect::<Vec<_>>().join("; ")]
}

/// The number of execution times that are named.
const MOST_TIMES: usize = 5;

/// Says which execution times changed most: `execution times: nav.plan 21 → 30 ms, …`.
fn times(it: &Comparison) -> Option<String> {
    let times = it.times();
    let shown = |(key, [before, after]): &(&str, [Option<Time>; 2])| match (before, after) {
        (Some(before), Some(after)) => format!("{key} {} → {} ms", before.number(), after.number()),
        (None, Some(after)) => format!("{key} unknown → {} ms", after.number()),
        (Some(before), None) => format!("{key} {} ms → unknown", before.number()),
        (None, None) => key.to_string(),
    };
    let mut named: Vec<String> = times.iter().take(MOST_TIMES).map(shown).collect();
    let more = times.len().saturating_sub(MOST_TIMES);
    named.extend((more > 0).then(|| format!("{more} more")));
    (!named.is_empty()).then(|| format!("execution times: {}", named.join(", ")))
}

fn name_of(row: &Compared) -> String {
    row.was().map_or_else(|| row.name().to_string(), |was| format!("{} (was {was})", row.name()))
}

/// Says how many rows are left out: `7 activities and 1 chain are as before`.
fn unchanged(it: &Comparison) -> Option<String> {
    if it.is_same() {
        return Some("nothing changes".to_owned());
    }
    let is_same = |it: &&Compared| it.change() == FigureChange::Same && it.was().is_none();
    let [activities, chains] = parts(it).map(|(_, of)| of.iter().filter(is_same).count());
    let activities = match activities {
        0 => None,
        1 => Some("1 activity".to_owned()),
        several => Some(format!("{several} activities")),
    };
    let chains = (chains > 0).then(|| counted(chains, "chain"));
    let same: Vec<String> = activities.into_iter().chain(chains).collect();
    (!same.is_empty()).then(|| format!("{} as before", same.join(" and ")))
}

/// Returns the utilisations that are different.
fn utilisations(it: &Comparison) -> Vec<(String, [String; 2])> {
    it.utilisations().into_iter().filter(|(_, [before, after])| before != after).collect()
}

/// Says why nothing is proved now, or was before.
fn new_errors(it: &Comparison) -> impl Iterator<Item = String> + '_ {
    let errors = |state: &Option<Figures>| state.as_ref().map_or(0, |it| it.errors);
    let (before, after) = (errors(&it.before), errors(&it.after));
    let said = match (before, after) {
        (_, 1..) => {
            let first = it.after.as_ref().and_then(|it| it.error.clone()).unwrap_or_default();
            Some(format!("not proved: the project has {}: {first}", counted(after, "error")))
        }
        (1.., 0) => Some(format!("before, nothing was proved: the project had {}", counted(before, "error"))),
        (0, 0) => None,
    };
    let lost = it.after.iter().flat_map(|it| &it.not_analysed);
    let all = said.into_iter().chain(lost.map(|why| format!("nothing is analysed: {why}")));
    // A key of mauve.toml may have line breaks.
    all.map(|it| it.replace(char::is_control, "\u{fffd}"))
}

fn name(it: &Comparison) -> &str {
    it.state().map_or("", |it| &it.deployment)
}

/// Says how a renamed deployment was called.
fn was(it: &Comparison) -> String {
    it.was().map_or_else(String::new, |was| format!(" (was {was})"))
}
