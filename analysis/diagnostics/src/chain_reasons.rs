//! The reasons why a chain has no latency, in words.

use mauve_hir::{ModelDb, Overwrite, SkipCause};
use mauve_wcrt::chains::{ChainProblem, ChainReason, ChainReport};

use super::lists::enumerated;
use super::reasons::timing_reason;

/// Returns the message of a reason why a chain has no latency.
pub fn chain_reason<'db>(
    db: &'db dyn ModelDb,
    chain: &ChainReport<'db>,
    reason: &ChainReason<'db>,
) -> String {
    let of = |step: usize| chain.steps.get(step).map_or("", |it| it.instance.as_str());
    let without = |step: usize, why: &str| format!("`{}` {why}", of(step));
    match reason {
        ChainReason::MaySkip { step, skip } => {
            let states: Vec<&str> = skip.states.iter().map(|it| it.as_str()).collect();
            let states = if states.is_empty() { String::new() } else { format!(" in {}", states.join(", ")) };
            let why = match &skip.cause {
                SkipCause::NoWrite => "nothing writes it there".to_owned(),
                SkipCause::Condition => "a condition is not known".to_owned(),
                SkipCause::Answer(codel) => format!("`{}` may not return `true`", codel.qualified(db)),
                SkipCause::OtherPort(port) => format!("`{port}` may have no new data"),
                SkipCause::AlreadyRead => "an earlier read took the data".to_owned(),
                SkipCause::TooLarge => "the search was given up".to_owned(),
            };
            format!("`{}` may never pass the data on{states}: {why}", of(*step))
        }
        ChainReason::Overwrites { step, by } => {
            format!("`{}` may overwrite the data before it is read: {}", of(*step), overwrite(by))
        }
        ChainReason::NotAnalysed { step, refusals } => {
            let why = refusals.first().map(|it| timing_reason(db, &it.reason)).unwrap_or_default();
            format!("`{}` is not analysed: {why}", of(*step))
        }
        ChainReason::NoBound { step } => without(*step, "has no bound on its response time"),
        ChainReason::Background { step } => without(*step, "is in the background"),
        ChainReason::NoActivity { step } => without(*step, "has no activity"),
        ChainReason::Unknown { step } => without(*step, "has a component that is not analysed"),
        ChainReason::Lost { step } => {
            format!("the buffer before `{}` may be full, and data be lost in it", of(*step))
        }
        ChainReason::NotRead { step, .. } => without(*step, "may never read the port"),
        ChainReason::TooLong => "the time exceeds 584 years".to_owned(),
        ChainReason::Declaration { problem, .. } => chain_problem(problem),
    }
}

fn overwrite(by: &Overwrite<'_>) -> String {
    let what = if by.is_older { "older data" } else { "a value that does not come from it" };
    format!("{} writes {what}", by.program)
}

/// Returns what is wrong with the declaration of a chain.
fn chain_problem(problem: &ChainProblem) -> String {
    match problem {
        ChainProblem::NoArchitecture => {
            "the architecture of the deployment has errors, or is unknown".to_owned()
        }
        ChainProblem::Missing(key) => format!("`{key}` is missing"),
        ChainProblem::Unresolved(name) => format!("no instance, port or codel `{name}`"),
        ChainProblem::Ambiguous { codel, instances } => {
            let names: Vec<String> = instances.iter().map(|it| format!("`{it}`")).collect();
            format!("`{codel}` is called by {}", enumerated(&names))
        }
        ChainProblem::NotConnected { from, to } => format!("no connections lead from `{from}` to `{to}`"),
        ChainProblem::NotPassed { instance } => format!("`{instance}` does not pass the data on"),
        ChainProblem::SeveralWays { through } => {
            let names: Vec<String> = through.iter().map(|it| format!("`{it}`")).collect();
            format!("several ways lead there, such as through {}: write one in `through`", enumerated(&names))
        }
        ChainProblem::Twice(instance) => format!("it goes twice through `{instance}`"),
        ChainProblem::NoWay => "it ends where it begins".to_owned(),
        ChainProblem::NoState { instance, state } => {
            format!("`{instance}` has no state `{state}`, or is not in the chain")
        }
        ChainProblem::NoAnswer(name) => format!("`{name}` is not called in the chain"),
    }
}
