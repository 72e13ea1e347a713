//! # chain-broken
//!
//! A chain of `mauve.toml` has no latency: a name in it is not on the way of the data, or a component on the way may never pass
//! the data on, or may overwrite it, or has no response time. The message is at the name, or at that of the chain.
//!
//! ```mauve
//! codel look(out n: int): bool
//! codel drive(in n: int): void
//! shell Eye { output port seen: int }
//! shell Leg { input port goal: int }
//! core EyeCore(Eye) { var n: int = 0  update = { if (look(n)) then { write(seen, n); } else { } } }
//! core LegCore(Leg) { var n: int = 0  update = { read(goal, n); drive(n); } }
//! component Camera(Eye, EyeCore)
//! component Base(Leg, LegCore)
//! architecture Robot { instance camera: Camera  instance base: Base  connection camera.seen -> base.goal }
//! deployment Bench {
//!   architecture Robot
//!   activity camera { priority = 2  period = 10 }
//!   activity base { priority = 1  period = 50 }
//! }
//! //- /mauve.toml
//! assume.codel = "1 ms"
//! [chains.follow]   # warning
//! from = "look"
//! to = "drive"
//! [chains.back]
//! from = "base"
//! to = "camera"   # warning
//! ```
//!
//! While a model has an error, this is not reported: the correction may give the chain its latency.
//!
//! A component that may do nothing for ever has no bound: `look` may return `false` in each period. If the chain is intended for the time
//! in which it returns `true`, write `answers = ["look"]`; if it is intended for some states of a component only, write them in
//! `while`. The fix does so for all components that may block.

use super::*;
use mauve_wcrt::chains::{ChainProblem, ChainReason, ChainReport};
use mauve_hir::SkipCause;
use mauve_wcrt::unblocked::{Unblocked, unblocked};

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    declared: (&Location<'db>, &mauve_hir::Chain),
    chain: &ChainReport<'db>,
    keys: Vec<KeyLine>,
) -> Diagnostic<'db> {
    let (at, config) = declared;
    let wrong = chain.reasons.iter().find_map(|reason| match reason {
        ChainReason::Declaration { at, .. } => at.clone(),
        _ => None,
    });
    let reasons: Vec<String> = chain.reasons.iter().map(|it| chain_reason(db, chain, it)).collect();
    let mut message = format!("chain `{}` has no latency: {}", chain.name, reasons.join("; "));
    message.extend(remedy(chain, &keys).map(|it| format!("; {it}")));
    let mut found = Diagnostic::new(&CHAIN_BROKEN, wrong.unwrap_or_else(|| at.clone()), message);
    for (at, why) in places(chain) {
        found = found.related(&at, why);
    }
    let edits = edits(db, at.file(db), config, &keys);
    if !keys.is_empty() && !edits.is_empty() {
        let title = format!("Write {}", joined(&keys));
        found.fixes.push(Fix { title: shortened(&title, MOST_CHARACTERS), edits });
    }
    found
}

/// Returns where the components of a chain may not pass the data on, and what they may do there.
fn places<'db>(chain: &ChainReport<'db>) -> Vec<(Location<'db>, String)> {
    let place = |reason: &ChainReason<'db>| {
        let (step, at, why) = match reason {
            ChainReason::MaySkip { step, skip } => {
                (step, Location::Source(skip.core, skip.at?), "may skip the write")
            }
            ChainReason::Overwrites { step, by } => {
                (step, Location::Source(by.core, by.at), "may overwrite it")
            }
            _ => return None,
        };
        let name = chain.steps.get(*step).map_or("it", |it| it.instance.as_str());
        Some((at, format!("`{name}` {why} here")))
    };
    chain.reasons.iter().filter_map(place).collect()
}

/// Says what to do so that the chain has a latency, where that is known.
fn remedy(chain: &ChainReport<'_>, keys: &[KeyLine]) -> Option<String> {
    let is_condition = |it: &ChainReason<'_>| matches!(it, ChainReason::MaySkip { skip, .. } if skip.cause == SkipCause::Condition);
    let parameter = "pass what the condition tests to the codel as a parameter, or write the data on both branches";
    match keys {
        [] => chain.reasons.iter().any(is_condition).then(|| parameter.to_owned()),
        _ => Some(format!("write {} if the chain is intended for that only", joined(keys))),
    }
}

fn joined(keys: &[KeyLine]) -> String {
    let written: Vec<String> = keys.iter().map(|(_, written)| format!("`{written}`")).collect();
    written.join(" and ")
}

/// Returns where a chain of `mauve.toml` that has no latency may not pass the data on, and what to do, in the words of the diagnostic.
pub fn help_of_chain<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    chain: &ChainReport<'db>,
) -> (Vec<(Location<'db>, String)>, Option<String>) {
    let config = config_of(db, project.workspace(db));
    let declared = chain.declared.and_then(|it| config.chains.get(it));
    let keys = declared.map_or_else(Vec::new, |it| keys(db, (project, deployment), it, chain));
    (places(chain), remedy(chain, &keys))
}

/// Returns whether another diagnostic reports this problem: the names in `mauve.toml` are checked for all deployments together.
pub(super) fn is_reported<'db>(db: &'db dyn ModelDb, project: Project<'db>, chain: &ChainReport<'db>) -> bool {
    chain.reasons.iter().any(|reason| match reason {
        ChainReason::Declaration { problem: ChainProblem::Unresolved(name), .. } => {
            names_of(db, project).by_key(Kind::Codel, name).is_empty()
        }
        ChainReason::Declaration { problem: ChainProblem::NoArchitecture, .. } => true,
        _ => false,
    })
}

/// A key of the section, and its line.
pub(super) type KeyLine = (&'static str, String);

/// Returns the lines that `while` and `answers` need.
pub(super) fn keys<'db>(
    db: &'db dyn ModelDb,
    (project, deployment): (Project<'db>, Decl<'db>),
    config: &mauve_hir::Chain,
    chain: &ChainReport<'db>,
) -> Vec<KeyLine> {
    let unblocked = unblocked(db, project, deployment, config, chain);
    let Some(Unblocked { states, answers }) = unblocked else { return Vec::new() };
    let line = |key: &'static str, before: &[(String, std::ops::Range<usize>)], new: Vec<String>| {
        let is_same = new.len() == before.len() && before.iter().all(|(it, _)| new.contains(it));
        let names: Vec<String> = new.iter().map(|it| format!("\"{it}\"")).collect();
        (!is_same).then(|| (key, format!("{key} = [{}]", names.join(", "))))
    };
    let lines = [line("while", &config.states, states), line("answers", &config.answers, answers)];
    lines.into_iter().flatten().collect()
}

/// Returns the edits that write these lines in the section of a chain; none if it is no section with a line for `to`.
fn edits<'db>(
    db: &'db dyn ModelDb,
    file: File,
    config: &mauve_hir::Chain,
    keys: &[KeyLine],
) -> Vec<(Location<'db>, String)> {
    let text = file.text(db);
    let line_of = |at: usize| {
        let start = text.get(..at)?.rfind('\n').map_or(0, |it| it + 1);
        let length = text.get(start..)?.find('\n').unwrap_or(text.len() - start);
        Some(start..start + length)
    };
    let begins = |line: &std::ops::Range<usize>, with: &str| {
        text.get(line.clone()).is_some_and(|line| line.trim_start().starts_with(with))
    };
    let place = || {
        line_of(config.span.start).filter(|it| begins(it, "["))?;
        line_of(config.to.as_ref()?.1.start).filter(|it| begins(it, "to"))
    };
    let Some(to) = place() else { return Vec::new() };
    let location = |range: std::ops::Range<usize>| Location::of_span(file, &range);
    let mut found = Vec::new();
    let mut new = String::new();
    for (key, line) in keys {
        let before = if *key == "while" { &config.states } else { &config.answers };
        match before.as_slice() {
            [] => new += &format!("\n{line}"),
            [(_, first), ..] => {
                // The whole list: from its key to the end of its line.
                let Some(old) = line_of(first.start).filter(|it| begins(it, key)) else { return Vec::new() };
                if before.iter().any(|(_, it)| it.end > old.end) || text.get(old.clone()).is_some_and(|it| it.contains('#')) {
                    return Vec::new();
                }
                found.push((location(old), line.clone()));
            }
        }
    }
    if !new.is_empty() {
        // A carriage return stays at the end of its line.
        let end = to.start + text.get(to.clone()).map_or(0, |line| line.trim_end_matches('\r').len());
        found.push((location(end..end), new));
    }
    found
}
