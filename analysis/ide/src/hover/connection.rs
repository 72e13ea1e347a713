//! What a hover shows of a connection: how long data takes there, part by part with the rule of each, and the sums of the declared chains
//! over it.
//!
//! ```text
//! camera.seen -> base.goal: ≤ 63 ms, from a release of camera until base has used the data
//!    1 ms  camera executes up to its write
//!   50 ms  until the next release of base: its period
//!   12 ms  base executes up to its write
//! ```

use std::fmt::Write as _;

use mauve_diagnostics::{chain_reason, connection_reason, not_lasting, overwrite, steps_apart};
use mauve_hir::{ModelDb, Project, declaration_at};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{SyntaxKind, TextRange};
use mauve_timing::{ChainRule, Time};
use mauve_wcrt::chains::{ChainReport, chains_of};
use mauve_wcrt::{Query, system_of};

use super::format::HoverContext;
use crate::connections::{LinkReport, connections_in};
use crate::markdown;
use crate::occurrences::grouped;
use mauve_diagnostics::figure::{TIGHT_SLACK, chain_figure, short};

/// The most chains that are shown.
const MOST_CHAINS: usize = 3;

/// Returns the text of the connection whose keyword, arrow or target is at `offset`.
pub(super) fn of_connection(cx: &HoverContext<'_, '_>) -> Option<(TextRange, String)> {
    let HoverContext { db, project, file, .. } = *cx;
    let (token, connection) = cx.tokens().find_map(|token| {
        let connection = token.parent_ancestors().find_map(ast::Connection::cast)?;
        let target =
            connection.target().is_some_and(|it| it.syntax().text_range().contains_range(token.text_range()));
        let is_word = matches!(token.kind(), SyntaxKind::CONNECTION_KW | SyntaxKind::ARROW);
        (is_word || target && token.kind().is_word()).then_some((token, connection))
    })?;
    let range = connection.syntax().text_range();
    let architecture = declaration_at(db, file, range)?;
    let here = connections_in(db, project, architecture).into_iter();
    let here = here.filter(|it| range.contains_range(it.link.at.range(db)));
    let texts = grouped(here.map(|it| (text_of(db, project, &it), it.deployment.name(db).as_str())));
    let are_several = texts.len() > 1;
    let shown = texts.iter().map(|(text, names)| {
        let of = if are_several { format!("in {}:\n", names.join(", ")) } else { String::new() };
        markdown::block("text", (of + text).trim_end()) + "\n"
    });
    let markdown: String = shown.collect();
    (!markdown.is_empty()).then(|| (token.text_range(), markdown))
}

fn text_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, connected: &LinkReport<'db>) -> String {
    let LinkReport { deployment, index, link, report } = connected;
    let (writer, reader) = (&link.source.0, &link.target.0);
    let mut out = format!("{}: ", link);
    match (&report.latency, &report.reason) {
        (Some(latency), _) => {
            let latency = short(*latency);
            let _ = writeln!(out, "≤ {latency}, from a release of {writer} until {reader} has used the data");
        }
        (None, Some(reason)) => {
            let _ = writeln!(out, "no latency: {}", connection_reason(db, link, reason).0);
        }
        (None, None) => out += "no latency\n",
    }
    if report.latency.is_some() {
        let part = &report.part;
        let starts = match part.rule {
            ChainRule::AfterWrite | ChainRule::SameJob | ChainRule::NextJob => {
                format!("{writer} executes up to its write")
            }
            ChainRule::HigherPriority => {
                format!("{writer} has a higher priority on the same CPU: {reader} starts after its write")
            }
        };
        let runs = match part.rule {
            ChainRule::SameJob => {
                format!("{reader} executes up to its write, in the job of their thread that has run {writer}")
            }
            _ => format!("{reader} executes up to its write"),
        };
        let activities = &system_of(db, project, *deployment).activities;
        let activity = activities.iter().find(|it| it.instance == **reader);
        let waits = match (part.by_data, activity.is_none_or(|it| it.is_periodic())) {
            (true, _) => {
                format!("the data releases {reader}: at most the rest of its least time between releases")
            }
            (false, true) if part.rule == ChainRule::NextJob => {
                "until the next job of their thread: its period".to_owned()
            }
            (false, true) => format!("until the next release of {reader}: its period"),
            (false, false) => {
                format!("until other data releases {reader}: the most time between two releases")
            }
        };
        parts(
            &mut out,
            &[
                (report.write, starts),
                (part.wait, waits),
                (part.buffer, "until values before it in the buffer are read or dropped".to_owned()),
                (part.periods, format!("periods of {reader} until it writes")),
                (part.run, runs),
            ],
        );
    }
    if let Some(by) = &report.overwritten {
        let _ = writeln!(out, "{writer} may overwrite it before it is read: {}", overwrite(by));
    }
    if let Some(age) = report.stays_full {
        let _ = writeln!(
            out,
            "the buffer stays full: values are dropped, and the data that is read is at least {age} old"
        );
    }
    if let Some(values) = report.never_read {
        let _ = writeln!(out, "{} of {values} values are never read", values - 1);
    }
    if report.is_stale {
        let _ = writeln!(out, "{reader} reads before {writer} writes, in each period");
    }
    let chains = chains_of(db, project, *deployment, Query::shown(db, project, *deployment));
    let has_it = |it: &&ChainReport<'db>| {
        it.declared.is_some() && it.steps.iter().any(|step| step.connection == Some(*index))
    };
    if let Some(chain) =
        report.chain.and_then(|index| chains.all.iter().find(|it| it.declared == Some(index)))
    {
        let _ = writeln!(out, "with the assumptions of chain {}", chain.name);
    }
    for chain in chains.all.iter().filter(has_it).take(MOST_CHAINS) {
        out += &format!("\n{}", chain_text(db, chain));
    }
    out
}

/// Returns a chain with its latency and what each component contributes, or why it has none.
fn chain_text<'db>(db: &'db dyn ModelDb, chain: &ChainReport<'db>) -> String {
    let name = &chain.name;
    let Some(latency) = chain.latency else {
        let reasons = chain.reasons.iter().map(|it| format!("  {}\n", chain_reason(db, chain, it)));
        let reasons: Vec<String> = reasons.collect();
        return format!("chain {name}: no latency\n{}", reasons.concat());
    };
    let figure = chain_figure((chain.latency, chain.limit), "", TIGHT_SLACK).full();
    let mut out = format!("chain {name}: {figure}\n");
    let sums: Vec<(Time, String)> = chain
        .steps
        .iter()
        .map(|step| {
            let part = &step.part;
            let parts = [
                (part.wait, if part.by_data { "until data may release it" } else { "until its release" }),
                (part.buffer, "in the buffer"),
                (part.periods, "until the period that writes"),
                (part.run, "until its write"),
            ];
            let parts = parts.iter().filter(|(time, _)| *time > Time::ZERO);
            let parts: Vec<String> = parts.map(|(time, what)| format!("{} {what}", short(*time))).collect();
            (step.total(), format!("{}: {}", step.instance, parts.join(" + ")))
        })
        .collect();
    parts(&mut out, &sums);
    out.extend(steps_apart(chain).map(|why| format!("  {why}\n")));
    if let Some(age) = chain.age_at_write.filter(|age| *age < latency) {
        let _ =
            writeln!(out, "  when it is written, the effect shows data that is at most {} old", short(age));
    }
    out.extend(not_lasting(chain).map(|why| format!("  {why}\n")));
    out
}

/// Writes a line for each time that is not 0, aligned.
fn parts(out: &mut String, parts: &[(Time, String)]) {
    let shown = parts.iter().filter(|(time, _)| *time > Time::ZERO);
    let lines: Vec<(String, &String)> = shown.map(|(time, what)| (short(*time), what)).collect();
    let width = lines.iter().map(|(time, _)| time.chars().count()).max().unwrap_or_default();
    for (time, what) in lines {
        let _ = writeln!(out, "  {time:>width$}  {what}");
    }
}

#[cfg(test)]
mod tests {
    use crate::fixture::Fixture;

    #[test]
    fn a_connection_has_the_parts_of_its_latency_and_the_chains_over_it() {
        let hover = |cursor: &str, config: &str| {
            let text = "
codel look(out n: int): void
codel use(in n: int): void
shell Eye { output port seen: int }
shell Leg { input port goal: int }
core EyeCore(Eye) { var n: int = 0  update = { look(n); write(seen, n); } }
core LegCore(Leg) { var n: int = 0  update = { read(goal, n); use(n); } }
component Camera(Eye, EyeCore)
component Base(Leg, LegCore)
architecture Robot { instance camera: Camera  instance base: Base
  connection camera.seen -> base.goal
}
deployment Bench {
  architecture Robot
  activity camera { affinity = 1  priority = 1  period = 10 }
  activity base { affinity = 1  priority = 2  period = 40 }
}
//- /mauve.toml
assume.codel = \"1 ms\"
"
            .to_owned()
                + config;
            let at = cursor.find('|').unwrap();
            let bare = cursor.replace('|', "");
            let text = text.replacen(&bare, &format!("{}$0{}", &bare[..at], &bare[at..]), 1);
            Fixture::new(&text).hover().map(|hover| hover.markdown).unwrap_or_default()
        };
        let chain = "[chains.follow]\nfrom = \"look\"\nto = \"use\"\nlatency = \"60 ms\"\n";
        let shown = hover("con|nection camera", chain);
        for line in [
            "camera.seen -> base.goal: ≤ 43 ms, from a release of camera until base has used the data\n",
            "   2 ms  camera executes up to its write\n",
            "  40 ms  until the next release of base: its period\n",
            "   1 ms  base executes up to its write\n",
            "with the assumptions of chain follow\n",
            "chain follow: ✓ ≤ 53 / 60 ms ▰▰▰▰▰▱ 89 %\n",
            "  12 ms  camera: 10 ms until its release + 2 ms until its write\n",
            "  41 ms  base: 40 ms until its release + 1 ms until its write\n",
        ] {
            assert!(shown.contains(line), "{line}{shown}");
        }
        assert!(hover("-|> base.goal", "").contains("≤ 43 ms"));
        assert!(!hover("camera|.seen", "").contains("from a release"));
    }
}
