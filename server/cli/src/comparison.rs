//! Figures in two states beside each other, for people, pull requests and programs.

use std::fmt::Write as _;

use mauve_ide::{Compared, Comparison, Figure, FigureChange, Figures, markdown_code};
use mauve_projects::analysis_document::milliseconds;
use mauve_projects::json::{non_empty, object};
use mauve_timing::{Status, Time};
use serde::Serialize;

use crate::text::{columns, counted, wrapped};

/// Returns a table of what changed, under the name of the deployment.
pub(super) fn comparison_table(it: &Comparison) -> String {
    let mut out = format!("{}{} at {}: {}\n", name(it), was(it.was()), it.level(), it.verdict());
    for (head, rows) in changed(it) {
        let row = |row: &&Compared| {
            let [before, after] = row.shown();
            vec![format!("{}{}", row.name(), was(row.was())), before, after, why(row)]
        };
        out += &columns(&[head, "before", "after", ""], rows.iter().map(row));
    }
    out.extend(lines(it).into_iter().map(|it| format!("  {it}\n")));
    wrapped(&out)
}

/// The maximum number of rows of a table in Markdown: a forge refuses long comments.
const MOST_ROWS: usize = 100;

/// Returns the same in Markdown, for a pull request.
pub(super) fn comparison_markdown(it: &Comparison) -> String {
    let (name, was) = (markdown_code(name(it)), escaped(&was(it.was())));
    let mut out = format!("**{name}**{was} at {}: {}\n", it.level(), it.verdict());
    for (head, rows) in changed(it) {
        let _ = write!(out, "\n| {head} | before | after | |\n|---|---|---|---|\n");
        for row in rows.iter().take(MOST_ROWS) {
            let was = row.was().map_or_else(String::new, |was| format!(" (was {})", markdown_code(was)));
            // Figures and fields may quote names of the model.
            let [before, after] = row.shown().map(|it| if it == "–" { it } else { markdown_code(&it) });
            let cells = [markdown_code(row.name()) + &was, before, after].map(|it| it.replace('|', "\\|"));
            let _ = writeln!(out, "| {} | {} |", cells.join(" | "), escaped(&why(row)));
        }
        let more = rows.len().saturating_sub(MOST_ROWS);
        if more > 0 {
            let _ = writeln!(out, "\n{more} more in this table: `--format json` has all");
        }
    }
    out.extend(lines(it).into_iter().map(|it| format!("\n{}\n", escaped(&it))));
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
    let is_unread = it.is_unread();
    let state = |of: &Option<Figures>| {
        of.as_ref().filter(|_| !is_unread).map(|it| {
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
                [was]: it.was().map(str::to_owned),
                // missed, found-missed, unaccepted, lost, unlimited, gone, new-missed, later, tolerated, relaxed, new, met, found, earlier,
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
    let cpus = utilisations(it).map(|(cpu, [before, after])| {
        object! { cpus: cpu, before: before, after: after }
    });
    let times = it.times().into_iter().map(|(key, [before, after])| {
        object! { key: key.to_owned(), before: before.map(milliseconds), after: after.map(milliseconds) }
    });
    let assumptions = it.assumptions().into_iter().map(|(name, [before, after])| {
        object! { name: name.to_owned(), before: before.map(str::to_owned), after: after.map(str::to_owned) }
    });
    object! {
        deployment: name(it).to_owned(),
        [was]: it.was().map(str::to_owned),
        unit: "ms",
        significance: it.state().and_then(|it| it.level.parse::<f64>().ok()),
        before: state(&it.before),
        after: state(&it.after),
        // Why the states are not compared: the files that cannot be read.
        [unread]: non_empty(it.unread.iter().cloned()),
        activities: rows(&it.activities),
        chains: rows(&it.chains),
        [utilisation]: non_empty(cpus),
        // The execution times that are different, the greatest difference first.
        [times]: non_empty(times),
        // The assumptions that are different: of the platform, locks, waits, accesses, and times that are not measured.
        [assumptions]: non_empty(assumptions),
    }
}

/// Returns a tolerance: a time, or percent of the time before, such as `5%`.
pub(super) fn tolerance(text: &str) -> Result<Tolerance, String> {
    let wrong = || "expected a time or percent, such as 2ms or 5%".to_owned();
    let (mut time, mut percent) = (Time::ZERO, 0);
    match text.strip_suffix('%') {
        Some(text) => percent = text.trim().parse().map_err(|_| wrong())?,
        None if text == "0" => {}
        None => time = super::options::time(text).map_err(|_| wrong())?,
    }
    Ok(Tolerance { time, percent })
}

/// By how much a figure may be later.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tolerance {
    time: Time,
    percent: u32,
}

impl Tolerance {
    /// Returns by how much a figure may be later that was `before`.
    pub(super) fn of(self, before: Time) -> Time {
        let share = u128::from(before.as_nanos()) * u128::from(self.percent) / 100;
        let nanos = u128::from(self.time.as_nanos()) + share;
        Time::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }
}

/// Returns the rows that are different, under the head of their table.
pub(super) fn changed(it: &Comparison) -> impl Iterator<Item = (&'static str, Vec<&Compared>)> {
    let is_changed = |it: &&Compared| !is_same(it) && !is_void(it);
    let tables = [("activity", &it.activities), ("chain", &it.chains)];
    let tables = tables.map(|(head, of)| (head, of.iter().filter(is_changed).collect::<Vec<_>>()));
    tables.into_iter().filter(|(_, rows)| !rows.is_empty())
}

fn is_same(row: &Compared) -> bool {
    row.change() == FigureChange::Same && row.was().is_none()
}

/// Returns whether this is a chain without a declaration and without a latency, before and after: there are many.
fn is_void(row: &Compared) -> bool {
    let has_nothing =
        |it: &Figure| it.status == Status::NotAnalysed && it.time.is_none() && it.limit.is_none();
    let is_chain = row.fields().is_empty();
    is_chain && [&row.before, &row.after].iter().all(|it| it.as_ref().is_none_or(has_nothing))
}

/// Says what happened to a figure, and which fields are different.
pub(super) fn why(row: &Compared) -> String {
    let change = Some(row.change().words().to_owned()).filter(|it| !it.is_empty());
    change.into_iter().chain(row.fields()).collect::<Vec<_>>().join("; ")
}

/// Returns the lines below the tables.
pub(super) fn lines(it: &Comparison) -> Vec<String> {
    let mut lines = Vec::from_iter(unchanged(it));
    lines.extend(utilisations(it).map(|(cpu, [old, new])| format!("{cpu} utilisation: {old} → {new}")));
    lines.extend(times(it));
    let assumptions = it.assumptions();
    lines.extend(assumptions.iter().take(MOST_ROWS).map(|(name, [before, after])| {
        let [before, after] = [before, after].map(|it| it.unwrap_or("none"));
        format!("changed assumption: {name}: {before} → {after}")
    }));
    lines.extend(it.unproved());
    lines
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

/// Says how many rows are left out: `7 activities and 1 chain are as before`.
fn unchanged(it: &Comparison) -> Option<String> {
    if it.is_same() {
        return Some("nothing changes".to_owned());
    }
    let [activities, chains] =
        [&it.activities, &it.chains].map(|of| of.iter().filter(|it| is_same(it)).count());
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
fn utilisations(it: &Comparison) -> impl Iterator<Item = (String, [String; 2])> {
    it.utilisations().into_iter().filter(|(_, [before, after])| before != after)
}

/// Adds the root of its project to the name of a deployment.
pub(super) fn name_project(it: &mut Comparison, root: &str) {
    for state in [&mut it.before, &mut it.after].into_iter().flatten() {
        state.deployment = format!("{} of {root}", state.deployment);
    }
}

fn name(it: &Comparison) -> &str {
    it.state().map_or("", |it| &it.deployment)
}

/// Says how a renamed thing was called.
fn was(name: Option<&str>) -> String {
    name.map_or_else(String::new, |name| format!(" (was {name})"))
}
