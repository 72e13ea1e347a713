//! The form of a certificate: JSON, with all times in nanoseconds.

use serde::Deserialize;

/// The version of the form that this checker reads.
pub(crate) const VERSION: u32 = 1;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Certificate {
    pub(crate) version: u32,
    #[serde(rename = "tool")]
    pub(crate) _tool: String,
    pub(crate) systems: Vec<System>,
}

/// A deployment at one level.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct System {
    pub(crate) deployment: String,
    pub(crate) significance: String,
    pub(crate) tasks: Vec<Task>,
    pub(crate) locks: Vec<Lock>,
    pub(crate) operations: Vec<Operation>,
    pub(crate) claims: Vec<Claim>,
    pub(crate) not_certified: Vec<NotCertified>,
    #[serde(default)]
    pub(crate) chains: Vec<Chain>,
}

#[derive(Deserialize, PartialEq, Clone, Copy)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Kind {
    Activity,
    Other,
    Throttling,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Priority {
    Background,
    Highest,
    #[serde(untagged)]
    RealTime(u32),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Task {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) priority: Priority,
    pub(crate) period: Option<u64>,
    pub(crate) deadline: Option<u64>,
    pub(crate) jitter: u64,
    pub(crate) burst: u64,
    pub(crate) sporadic: bool,
    pub(crate) thread: Option<u32>,
    pub(crate) offset: Option<u64>,
    pub(crate) clock: u32,
    /// None: unknown, so any.
    pub(crate) cpus: Option<Vec<u32>>,
    /// None: of unknown demand.
    pub(crate) machine: Option<Machine>,
}

/// A job takes one edge.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Machine {
    pub(crate) states: usize,
    /// From, to, execution time, and wait.
    pub(crate) edges: Vec<(usize, usize, u64, u64)>,
    /// How often a job waits; none if unknown.
    pub(crate) waits: Option<u64>,
    /// The closed form of the demand with waits, and of what is executed.
    pub(crate) growth: Option<Growth>,
    pub(crate) growth_executed: Option<Growth>,
}

/// From `from` jobs on, `period` jobs more demand `gains` more, by the state in which they end.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Growth {
    pub(crate) from: usize,
    pub(crate) period: usize,
    pub(crate) gains: Vec<u64>,
}

#[derive(Deserialize, PartialEq, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Protocol {
    Inheritance,
    Ceiling,
    None,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Lock {
    pub(crate) name: String,
    pub(crate) protocol: Protocol,
    /// Task, and how long it holds the lock; none if unknown.
    pub(crate) users: Vec<(usize, Option<u64>)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Operation {
    pub(crate) provider: usize,
    pub(crate) client: usize,
    pub(crate) sends: u64,
    pub(crate) time: u64,
    pub(crate) during: Option<usize>,
    /// Counted in each job of the provider; none if unknown.
    pub(crate) calls: Option<u64>,
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Method {
    Psm,
    Ibf,
    Exact,
}

/// Which tasks delay the claim's task.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Rule {
    Cpu(u32),
    Linked(Vec<u32>),
    Global(Vec<u32>),
}

/// No job of `task` ends later than `response` after its release.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Claim {
    pub(crate) task: usize,
    pub(crate) response: u64,
    /// Whether that is within the deadline.
    pub(crate) met: bool,
    pub(crate) rule: Rule,
    pub(crate) method: Method,
    pub(crate) blocking: u64,
    /// The tasks whose waits count as jitter.
    pub(crate) late: Vec<usize>,
    /// The synchronised clock at whose releases the windows begin.
    pub(crate) clock: Option<u32>,
    pub(crate) windows: Vec<Window>,
    /// In the window of the greatest response: task, jobs, time.
    pub(crate) interference: Vec<(usize, u64, u64)>,
}

/// A busy window: how long after its start each job of the task has ended.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Window {
    pub(crate) start: Option<u64>,
    pub(crate) ends: Vec<u64>,
    /// When the thread has ended the period of the last job; none: with the last job.
    pub(crate) closes: Option<u64>,
    /// At full load: from this job on, all repeats after this time.
    pub(crate) repeats: Option<(u64, u64)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NotCertified {
    pub(crate) task: usize,
    pub(crate) reason: String,
}

/// Data takes no longer than `latency` through these steps; without it, `reason` says why that is not certified.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Chain {
    pub(crate) name: String,
    pub(crate) latency: Option<u64>,
    pub(crate) limit: Option<u64>,
    pub(crate) reason: Option<String>,
    pub(crate) steps: Vec<Step>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Step {
    pub(crate) task: usize,
    /// N, the releases from the arrival of data to the write.
    pub(crate) releases: u64,
    pub(crate) wait: u64,
    pub(crate) periods: u64,
    pub(crate) run: u64,
}
