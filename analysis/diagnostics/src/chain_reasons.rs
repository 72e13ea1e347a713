//! The reasons why a chain or a connection has no latency, in words: one table, with a message and a short form for hints.

use mauve_hir::item_tree::Name;
use mauve_hir::{Link, ModelDb, Overwrite, Skip, SkipCause};
use mauve_wcrt::chains::{ChainProblem, ChainReason, ChainReport};

use super::lists::{each_once, enumerated};
use super::reasons::{short_reason, timing_reason};

/// Returns the reasons why a chain has no latency, each once.
pub fn reasons_of_chain<'db>(db: &'db dyn ModelDb, chain: &ChainReport<'db>) -> Vec<String> {
    each_once(chain.reasons.iter().map(|it| chain_reason(db, chain, it)))
}

/// Returns the message of a reason why a chain has no latency.
pub fn chain_reason(db: &dyn ModelDb, chain: &ChainReport<'_>, reason: &ChainReason<'_>) -> String {
    let instances: Vec<&Name> = chain.steps.iter().map(|it| &it.instance).collect();
    in_words(db, &instances, reason).0
}

/// Returns the message of the reason why a connection has no latency, and a few words such as `guide may skip in Waiting`.
pub fn connection_reason(db: &dyn ModelDb, link: &Link<'_>, reason: &ChainReason<'_>) -> (String, String) {
    // Between hosts, two gateways are before the reader.
    let target = &link.target.0;
    in_words(db, &[&link.source.0, target, target, target], reason)
}

fn in_words<'db>(db: &'db dyn ModelDb, instances: &[&Name], reason: &ChainReason<'db>) -> (String, String) {
    let name = |step: &usize| instances.get(*step).map_or("", |it| it.as_str());
    let both = |step: &usize, why: &str, short: &str| {
        (format!("`{}` {why}", name(step)), format!("{} {short}", name(step)))
    };
    match reason {
        ChainReason::MaySkip { step, skip } => {
            let state = skip.states.first().map_or_else(String::new, |state| format!(" in {state}"));
            both(step, &may_skip(db, skip), &format!("may skip{state}"))
        }
        ChainReason::Overwrites { step, by } => {
            let why = format!("may overwrite the data before it is read: {}", overwrite(by));
            (format!("`{}` {why}", name(step)), format!("may be overwritten in {}", by.state))
        }
        ChainReason::NotAnalysed { step, refusals } => {
            let first = refusals.first();
            let why = first.map(|it| timing_reason(db, &it.reason)).unwrap_or_default();
            let short = first.map(|it| short_reason(db, &it.reason)).unwrap_or_default();
            (format!("`{}` is not analysed: {why}", name(step)), short)
        }
        ChainReason::Gateway { gateway, refusals } => {
            let why = refusals.first().map(|it| timing_reason(db, &it.reason)).unwrap_or_default();
            (format!("the gateway `{gateway}` is not analysed: {why}"), format!("see {gateway}"))
        }
        ChainReason::NoLink { hosts: [from, to] } => (
            format!(
                "how long the network from {from} to {to} takes is not known: write `[link.\"{from}-{to}\"]` with `latency`"
            ),
            format!("no latency from {from} to {to}"),
        ),
        ChainReason::BestEffort { port } => (
            format!(
                "`{port}` is a best-effort topic between two hosts, and may lose samples: make it reliable"
            ),
            format!("{port} may be lost"),
        ),
        ChainReason::NoTopic { hosts: [from, to] } => (
            format!(
                "a connection from host `{from}` to host `{to}` cannot be a topic: its diagnostic says why"
            ),
            format!("no topic from {from} to {to}"),
        ),
        ChainReason::NoBound { step } => both(step, "has no bound on its response time", "has no bound"),
        ChainReason::ReleasedByData { step, by } => {
            let by = by
                .as_ref()
                .map_or("no component writes".to_owned(), |by| format!("`{by}` may never write again"));
            both(step, &format!("is released by data that {by}"), "may not be released")
        }
        ChainReason::Background { step } => both(step, "is in the background", "is not real-time"),
        ChainReason::NoActivity { step } => both(step, "has no activity", "has no activity"),
        ChainReason::Unknown { step } => {
            both(step, "has a component that is not analysed", "is not analysed")
        }
        ChainReason::NotRead { step, .. } => both(step, "may never read the port", "may never read it"),
        ChainReason::TooLong => ("the time exceeds 584 years".to_owned(), "exceeds 584 years".to_owned()),
        ChainReason::Declaration { problem, .. } => (chain_problem(problem), "see mauve.toml".to_owned()),
    }
}

fn may_skip<'db>(db: &'db dyn ModelDb, skip: &Skip<'db>) -> String {
    let states: Vec<&str> = skip.states.iter().map(|it| it.as_str()).collect();
    let states = if states.is_empty() { String::new() } else { format!(" in {}", states.join(", ")) };
    let why = match &skip.cause {
        SkipCause::NoWrite => "nothing writes it there".to_owned(),
        SkipCause::Condition => "a condition is not known".to_owned(),
        SkipCause::Answer(codel) => format!("`{}` may not return `true`", codel.qualified(db)),
        SkipCause::OtherPort(port) => format!("`{port}` may have no new data"),
        SkipCause::AlreadyRead => "an earlier read took the data".to_owned(),
        SkipCause::Leaves => "each period leaves these states".to_owned(),
        SkipCause::TooLarge => "the search was given up".to_owned(),
    };
    format!("may never pass the data on{states}: {why}")
}

/// Returns what a write overwrites data with: `Waiting.run writes older data`.
pub fn overwrite(by: &Overwrite<'_>) -> String {
    let what = if by.is_older { "older data" } else { "a value that does not come from it" };
    format!("{} writes {what}", by.program)
}

/// Returns why an effect of a chain with a latency may be older than that: the last component shows older data, or a value that does not
/// come from it, after newer data. None if it keeps what it wrote.
pub fn not_lasting(chain: &ChainReport<'_>) -> Option<String> {
    let by = chain.overwritten.as_ref().filter(|_| chain.latency.is_some())?;
    let instance = chain.steps.last().map_or("the last component", |it| it.instance.as_str());
    Some(format!("{instance} may overwrite the effect: {}", overwrite(by)))
}

/// Returns why the latency of a chain counts less than the response times of its steps.
pub fn steps_apart(chain: &ChainReport<'_>) -> Option<&'static str> {
    chain.is_apart.then_some(
        "steps on one CPU do not delay each other: all of them end before the first one starts again",
    )
}

/// Returns what is wrong with the declaration of a chain.
fn chain_problem(problem: &ChainProblem) -> String {
    match problem {
        ChainProblem::NoArchitecture => {
            "the architecture of the deployment has errors, or is unknown".to_owned()
        }
        ChainProblem::Missing(key) => {
            format!("`{key}` is missing: write a codel, a port or an instance, such as \"hokuyo.scan\"")
        }
        ChainProblem::Unresolved(name) => {
            format!("no instance or port `{name}`, and no instance calls such a codel")
        }
        ChainProblem::Ambiguous { codel, instances } => {
            format!("`{codel}` is called by {}: write which, as `instance.codel`", list(instances))
        }
        ChainProblem::NotConnected { from, to } => format!("no connections lead from `{from}` to `{to}`"),
        ChainProblem::NotPassed { instance } => {
            format!(
                "`{instance}` does not pass the data on: nothing that leads there depends on what it reads"
            )
        }
        ChainProblem::SeveralWays { through } => {
            format!("several ways lead there, such as through {}: write one in `through`", list(through))
        }
        ChainProblem::TooManyWays => {
            "the ways from one end to the other are too many to follow: write instances on the way in `through`".to_owned()
        }
        ChainProblem::NoWay => "it ends where it begins".to_owned(),
        ChainProblem::NoState { instance, state } => {
            format!("`{instance}` has no state `{state}`, or is not in the chain")
        }
        ChainProblem::NoAnswer(name) => {
            format!("the instances in the chain call no codel `{name}`, and have no such input port")
        }
    }
}

fn list(names: &[Name]) -> String {
    let names: Vec<String> = names.iter().map(|it| format!("`{it}`")).collect();
    enumerated(&names)
}
