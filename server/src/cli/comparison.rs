//! Figures in two states beside each other, for people, pull requests and programs.

use std::fmt::Write as _;

use mauve_ide::{Compared, Comparison, Figure, FigureChange, Figures, markdown_code};
use mauve_timing::Time;
use serde::Serialize;

use crate::analysis_document::milliseconds;
use crate::cli::text::{columns, counted};
use crate::json::{non_empty, object};

/// Returns a table of what changed, under the name of the deployment.
pub(super) fn comparison_table(it: &Comparison) -> String {
    let mut out = format!("{} at {}: {}\n", name(it), level(it), it.verdict());
    for (head, of) in parts(it) {
        let rows: Vec<Vec<String>> = changed(of).map(|row| cells(row, name_of(row))).collect();
        if !rows.is_empty() {
            out += &columns(&[head, "before", "after", ""], &rows);
        }
    }
    out.extend(Some(unchanged(it)).filter(|it| !it.is_empty()).map(|it| format!("  {it}\n")));
    out.extend(
        utilisations(it)
            .into_iter()
            .map(|(cpu, [before, after])| format!("  {cpu} utilisation: {before} → {after}\n")),
    );
    out.extend(new_errors(it).map(|it| format!("  {it}\n")));
    out
}

#[allow(dead_code)]
/// Returns the same in Markdown, for a pull request.
pub(super) fn comparison_markdown(it: &Comparison) -> String {
    let mut out = format!("**{}** at {}: {}\n", markdown_code(name(it)), level(it), it.verdict());
    for (head, of) in parts(it) {
        let rows: Vec<&Compared> = changed(of).collect();
        if rows.is_empty() {
            continue;
        }
        let _ = write!(out, "\n| {head} | before | after | |\n|---|---|---|---|\n");
        for row in rows {
            let name = match row.was() {
                Some(was) => format!("{} (was {})", markdown_code(&row.name()), markdown_code(was)),
                None => markdown_code(&row.name()),
            };
            // A figure may quote a name of the model.
            let cells = cells(row, name.clone()).into_iter().skip(1).map(|cell| match cell.is_empty() {
                true => cell,
                false => markdown_code(&cell),
            });
            let cells: Vec<String> =
                std::iter::once(name).chain(cells).map(|it| it.replace('|', "\\|")).collect();
            let _ = writeln!(out, "| {} |", cells.join(" | "));
        }
    }
    out.extend(Some(unchanged(it)).filter(|it| !it.is_empty()).map(|it| format!("\n{it}\n")));
    out.extend(
        utilisations(it)
            .into_iter()
            .map(|(cpu, [before, after])| format!("\n{cpu} utilisation: {before} → {after}\n")),
    );
    out.extend(new_errors(it).map(|it| format!("\n{it}\n")));
    out
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
                // missed, lost, gone, new-missed, later, new, met, found, earlier, limit or same
                change: it.change().name(),
                before: figure(&it.before),
                after: figure(&it.after),
            }
        };
        of.iter().map(row).collect::<Vec<_>>()
    };
    let cpus = utilisations(it).into_iter().map(|(cpu, [before, after])| {
        object! { cpus: cpu, before: before, after: after }
    });
    object! {
        deployment: name(it).to_owned(),
        unit: "ms",
        significance: level(it),
        before: state(&it.before),
        after: state(&it.after),
        activities: rows(&it.activities),
        chains: rows(&it.chains),
        [utilisation]: non_empty(cpus),
    }
}

#[allow(dead_code)]
/// Returns a tolerance: a time, or percent of the time before, such as `5%`.
pub(super) fn tolerance(text: &str) -> Result<Tolerance, String> {
    let wrong = || "expected a time or percent, such as 2ms or 5%".to_owned();
    match text.strip_suffix('%') {
        Some(percent) => Ok(Tolerance::Percent(percent.trim().parse().map_err(|_| wrong())?)),
        None if text == "0" => Ok(Tolerance::Percent(0)),
        None => Ok(Tolerance::Time(super::options::time(text)?)),
    }
}

#[allow(dead_code)]
/// By how much a figure may be later.
#[derive(Debug, Clone, Copy)]
pub(super) enum Tolerance {
    Percent(u32),
    Time(Time),
}

#[allow(dead_code)]
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
    of.iter().filter(|it| it.change() != FigureChange::Same || it.was().is_some())
}

fn cells(row: &Compared, name: String) -> Vec<String> {
    let [before, after] = row.shown();
    vec![name, before, after, row.change().words().to_owned()]
}

fn name_of(row: &Compared) -> String {
    row.was().map_or_else(|| row.name().to_string(), |was| format!("{} (was {was})", row.name()))
}

/// Says how many rows are left out: `7 activities and 1 chain are as before`.
fn unchanged(it: &Comparison) -> String {
    let [activities, chains] = parts(it).map(|(_, of)| of.len() - changed(of).count());
    let activities = match activities {
        0 => None,
        1 => Some("1 activity".to_owned()),
        several => Some(format!("{several} activities")),
    };
    let chains = (chains > 0).then(|| counted(chains, "chain"));
    match activities.into_iter().chain(chains).collect::<Vec<_>>() {
        _ if it.is_same() => "nothing changes".to_owned(),
        left if left.is_empty() => String::new(),
        left => format!("{} as before", left.join(" and ")),
    }
}

/// Returns the utilisations that are different.
fn utilisations(it: &Comparison) -> Vec<(String, [String; 2])> {
    let of = |state: &Option<Figures>| state.as_ref().map_or_else(Vec::new, |it| it.cpus.clone());
    let (before, after) = (of(&it.before), of(&it.after));
    let find = |all: &[(String, String)], cpu: &str| {
        all.iter().find(|(name, _)| name == cpu).map_or_else(|| "0 %".to_owned(), |(_, share)| share.clone())
    };
    let mut names: Vec<&String> = before.iter().chain(&after).map(|(cpu, _)| cpu).collect();
    names.sort();
    names.dedup();
    let both = names.into_iter().map(|cpu| (cpu.clone(), [find(&before, cpu), find(&after, cpu)]));
    both.filter(|(_, [before, after])| before != after).collect()
}

/// Says why nothing is proved now, or was before.
fn new_errors(it: &Comparison) -> impl Iterator<Item = String> + '_ {
    let errors = |state: &Option<Figures>| state.as_ref().map_or(0, |it| it.errors);
    let (before, after) = (errors(&it.before), errors(&it.after));
    let said = match (before, after) {
        (_, 1..) => Some(format!("not proved: the project has {}", counted(after, "error"))),
        (1.., 0) => Some(format!("before, nothing was proved: the project had {}", counted(before, "error"))),
        (0, 0) => None,
    };
    let lost = it.after.iter().flat_map(|it| &it.not_analysed);
    said.into_iter().chain(lost.map(|why| format!("nothing is analysed: {why}")))
}

fn either(it: &Comparison) -> Option<&Figures> {
    it.after.as_ref().or(it.before.as_ref())
}

fn name(it: &Comparison) -> &str {
    either(it).map_or("", |it| &it.deployment)
}

fn level(it: &Comparison) -> String {
    either(it).map_or_else(String::new, |it| it.level.clone())
}
