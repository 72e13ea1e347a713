//! `mauve verify FILE…`: checks certificates of response times; `mauve wcrt --certificate FILE` writes them.

use std::path::PathBuf;

use mauve_diagnostics::reasons_of_chain;
use mauve_projects::analysis_document::{Analysed, Deployed};
use mauve_projects::disk::{LONGEST, read, text_in};
use mauve_projects::harmless::harmless_line;
use mauve_projects::output::Output;
use mauve_timing::Time;
use mauve_verify::{CertifiedChain, RefusedClaim, Summary, verify};
use mauve_wcrt::chains::ChainReport;
use mauve_wcrt::{certificate_of, certificate_of_file};
use serde_json::{Map, Value};

use crate::text::{assumptions, counted, wrapped};

/// The longest certificate; it has a number for each job of each busy window.
const LONGEST_CERTIFICATE: u64 = 4 * LONGEST;

#[derive(Debug, clap::Args)]
pub struct Verify {
    /// Certificates.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Exit with 0 although some deadline is not proved by the certificate.
    #[arg(long)]
    allow_partial: bool,
}

impl Verify {
    pub(crate) fn run(self) -> Result<Output, String> {
        let (mut text, mut code) = (String::new(), 0);
        for path in &self.files {
            let shown = path.display();
            let (json, problem) = text_in(read(path, LONGEST_CERTIFICATE));
            if let Some(problem) = problem {
                return Err(format!("`{shown}`: {problem}"));
            }
            match verify(&json) {
                Ok(systems) => {
                    let is_partial = systems.iter().any(|it| !it.not_certified.is_empty());
                    let proves_nothing = systems.iter().all(|it| it.met.is_empty());
                    code = u8::from(proves_nothing || is_partial && !self.allow_partial).max(code);
                    let verdict = match (proves_nothing, is_partial) {
                        (true, _) => "nothing is proved",
                        (false, true) => "accepted in part",
                        (false, false) => "accepted",
                    };
                    text += &line(&format!("{shown}: {verdict}"));
                    systems.iter().for_each(|it| text += &said(it));
                }
                Err(RefusedClaim::Unreadable(why)) => {
                    // Of a key of the file, a line break would begin another message.
                    return Err(harmless_line(&format!("`{shown}` is not a certificate: {why}")));
                }
                Err(RefusedClaim::False(why)) => {
                    code = 1;
                    text += &line(&format!("{shown}: refused: {why}"));
                }
            }
        }
        text += "Checked: each inequality, from the task set in the file. Not checked: the execution times and the model are taken from the file.\n";
        Ok(Output::escaped(wrapped(&text), code))
    }
}

/// Returns why something is not certified.
fn in_words(reason: &str) -> &str {
    match reason {
        "no-form" => {
            "it is met only by combinations of paths, synchronised clocks, or waits that leave the CPU to others"
        }
        "by-writers" => {
            "data releases it, or what delays it, less often than `least` says, which has no form in a certificate"
        }
        "several-cpus" => "its jobs may run on several CPUs",
        "too-many-jobs" => "its busy window has too many jobs, or that of a task that it depends on",
        "not-by-steps" => "its steps alone do not show its latency, or that it is within its limit",
        "released-by-data" => {
            "data releases an activity on its way (`trigger`), which has no form in a certificate"
        }
        "no-claim" => "a response time in it has no claim",
        "not-claimed" => "its deadline is not claimed to be met",
        other => other,
    }
}

/// Returns a line. Names are from the file: their line breaks are escaped.
fn line(text: &str) -> String {
    harmless_line(text) + "\n"
}

/// Lists the proved deadlines and chains of a deployment, and the others.
fn said(of: &Summary) -> String {
    let proved = counted(of.met.len(), "deadline");
    let mut text = line(&format!("  {} at {}: {proved} proved", of.deployment, of.significance));
    let is_plain = |it: &&CertifiedChain| it.limit.is_none() && it.states.is_empty() && it.answers.is_empty();
    let (plain, others): (Vec<_>, Vec<_>) = of.chains.iter().partition(is_plain);
    text.extend(others.iter().map(|it| line(&format!("    `{}`: {}", it.name, latency(it)))));
    if !others.is_empty() {
        text += "    these latencies count whole response times; `mauve chains` counts up to the write, and may have less\n";
    }
    if !plain.is_empty() {
        text += &format!("    {} without a limit: the latency is proved\n", counted(plain.len(), "chain"));
    }
    for (name, why) in &of.not_certified {
        text += &line(&format!("    {name}: not certified: {}", in_words(why)));
    }
    text
}

/// Returns the proved latency of a chain with its conditions: `55 ms within 60 ms, while the states are pilot.Steering`.
fn latency(of: &CertifiedChain) -> String {
    let time = |time: u64| Time::from_nanos(time).to_string();
    let limit = of.limit.map_or_else(String::new, |it| format!(" within {}", time(it)));
    let [states, answers] =
        [&of.states, &of.answers].map(|it| it.iter().map(String::as_str).collect::<Vec<_>>());
    let assumed = assumptions(&states, &answers);
    let assumed = if assumed.is_empty() { assumed } else { format!(", {assumed}") };
    format!("{}{limit}{assumed}", time(of.latency))
}

/// Returns the certificate of deployments, a line for each task and claim.
pub(super) fn certificate(all: &[Deployed<'_>]) -> Result<String, String> {
    let mut systems = Vec::new();
    for it in all {
        if it.errors > 0 {
            return Err(format!("no certificate: fix {} first", counted(it.errors, "error")));
        }
        for (query, report) in &it.reports {
            let mut parts = match it.origin {
                Analysed::Model(project, deployment) => {
                    let why = |chain: &ChainReport<'_>| match chain.latency.zip(chain.limit) {
                        Some((latency, limit)) => {
                            format!("its latency of {latency} exceeds its limit of {limit}")
                        }
                        None => format!("it has no latency: {}", reasons_of_chain(it.db, chain).join("; ")),
                    };
                    certificate_of(it.db, project, deployment, *query, &why)
                }
                Analysed::File { set, .. } => certificate_of_file(set, *query, report)
                    .map_err(|_| "no certificate: the task set has no times at this level".to_owned())?,
            };
            parts.insert("deployment".to_owned(), it.name.into());
            systems.push(lines(&parts));
        }
    }
    let tool = concat!("mauve ", env!("CARGO_PKG_VERSION"));
    Ok(format!("{{\"version\":2,\"tool\":\"{tool}\",\"systems\":[\n{}\n]}}\n", systems.join(",\n")))
}

fn lines(parts: &Map<String, Value>) -> String {
    let part = |(key, value): (&String, &Value)| match value.as_array() {
        Some(list) if !list.is_empty() => {
            let list: Vec<String> = list.iter().map(|it| format!("  {it}")).collect();
            format!(" \"{key}\":[\n{}]", list.join(",\n"))
        }
        _ => format!(" \"{key}\":{value}"),
    };
    format!("{{\n{}}}", parts.iter().map(part).collect::<Vec<_>>().join(",\n"))
}

/// Checks the certificate of deployments, and returns what to say of it, and whether no claim is refused.
pub(super) fn check_certificate(all: &[Deployed<'_>]) -> Result<(String, bool), String> {
    if all.iter().any(|it| it.errors > 0) {
        return Ok(("none, as the project has errors".to_owned(), true));
    }
    Ok(match verify(&certificate(all)?) {
        Ok(systems) => {
            let met = systems.iter().map(|it| it.met.len()).sum();
            let partial = systems.iter().flat_map(|it| &it.not_certified);
            let partial: String =
                partial.map(|(name, why)| format!("; not certified: {name}, {}", in_words(why))).collect();
            let said = format!("accepted, {} proved{}", counted(met, "deadline"), partial);
            (harmless_line(&said), true)
        }
        Err(RefusedClaim::False(why) | RefusedClaim::Unreadable(why)) => {
            (harmless_line(&format!("refused: {why}")), false)
        }
    })
}
