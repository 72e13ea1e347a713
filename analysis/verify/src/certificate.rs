//! The form of a certificate: JSON, with all times in nanoseconds.

use serde::Deserialize;

/// The version of the form that this checker reads.
pub(crate) const VERSION: u32 = 2;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Certificate {
    pub(crate) version: u32,
    #[serde(rename = "tool")]
    pub(crate) _tool: String,
    pub(crate) systems: Vec<CertifiedSystem>,
}

/// A deployment at one level.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CertifiedSystem {
    pub(crate) deployment: String,
    pub(crate) significance: String,
    pub(crate) tasks: Vec<CertifiedTask>,
    pub(crate) locks: Vec<CertifiedLock>,
    pub(crate) operations: Vec<CertifiedOperation>,
    pub(crate) claims: Vec<Claim>,
    /// Activities and chains without a proof here, each with the reason. Chains have the word `chain` before their names.
    pub(crate) not_certified: Vec<(String, String)>,
    #[serde(default)]
    pub(crate) chains: Vec<CertifiedChain>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CertifiedTask {
    pub(crate) name: String,
    /// Not: other work of the computer.
    pub(crate) is_activity: bool,
    /// Not: in the background.
    pub(crate) is_real_time: bool,
    /// None: unknown, so any.
    pub(crate) priority: Option<u64>,
    pub(crate) period: Option<u64>,
    pub(crate) deadline: Option<u64>,
    pub(crate) jitter: u64,
    pub(crate) burst: u64,
    pub(crate) sporadic: bool,
    /// Whether it stands for real-time throttling: meanwhile, the background may take locks.
    #[serde(default)]
    pub(crate) throttling: bool,
    pub(crate) thread: Option<u32>,
    /// Whether a job that has begun executes before all activities.
    #[serde(default)]
    pub(crate) not_preempted: bool,
    /// None: unknown, so any.
    pub(crate) cpus: Option<Vec<u32>>,
    /// None: of unknown demand.
    pub(crate) machine: Option<CertifiedMachine>,
}

/// A job takes one edge.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CertifiedMachine {
    pub(crate) states: usize,
    /// From, to, execution time, and wait.
    pub(crate) edges: Vec<(usize, usize, u64, u64)>,
    /// How often a job waits; none if unknown.
    pub(crate) waits: Option<u64>,
    /// The closed form: from `from` jobs on, `period` jobs more demand `gains` more, by the state in which they end.
    pub(crate) from: usize,
    pub(crate) period: usize,
    pub(crate) gains: Vec<u64>,
}

#[derive(Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum CertifiedProtocol {
    Inheritance,
    Ceiling,
    None,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CertifiedLock {
    pub(crate) name: String,
    pub(crate) protocol: CertifiedProtocol,
    /// Task, and how long it holds the lock; none if unknown.
    pub(crate) users: Vec<(usize, Option<u64>)>,
}

/// Each `every` successive jobs of the client send so many calls, and its start `starting`, which the provider executes for `time` each;
/// so many are pending at most.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CertifiedOperation {
    pub(crate) provider: usize,
    pub(crate) client: usize,
    pub(crate) sends: u64,
    #[serde(default)]
    pub(crate) every: u64,
    #[serde(default)]
    pub(crate) starting: u64,
    #[serde(default)]
    pub(crate) pending: Option<u64>,
    pub(crate) time: u64,
    /// Counted in each job of the provider; none if unknown.
    pub(crate) calls: Option<u64>,
}

/// No job of `task` ends later than `response` after its release.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Claim {
    pub(crate) task: usize,
    pub(crate) response: u64,
    /// Whether that is within the deadline.
    pub(crate) met: bool,
    /// On which CPU; none: as if all that the tasks link were one.
    pub(crate) cpu: Option<u32>,
    pub(crate) blocking: u64,
    /// How long after the start of a busy window each job has ended.
    pub(crate) ends: Vec<u64>,
    /// When the thread has ended the period of the last job; none: with the last job.
    pub(crate) closes: Option<u64>,
}

/// Data takes no longer than `latency` through these steps, while the instances are in `states`, and if `answers` do: that it is so is
/// taken from the file.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CertifiedChain {
    /// Its name in `mauve.toml`.
    pub name: String,
    /// In nanoseconds, as the limit.
    pub latency: u64,
    /// Its limit, if it has one.
    pub limit: Option<u64>,
    /// Task, and N, the releases from the arrival of data to the write.
    pub(crate) steps: Vec<(usize, u64)>,
    /// The states in which N holds, as `instance.State`; any, if there is none of an instance.
    #[serde(rename = "while")]
    pub states: Vec<String>,
    /// What has to answer, so that N holds.
    pub answers: Vec<String>,
}
