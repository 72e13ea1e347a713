//! Checks certificates of response times, without the analysis that found them.
//!
//! `mauve wcrt --certificate FILE` writes a certificate: the task set, and for each deadline that is met why it is. This crate
//! reads it and checks each claim from the task set alone, with its own arithmetic: integers of nanoseconds, checked. It shares no code
//! with the analysis, so that a mistake there does not confirm itself here. What it does *not* check is whether the task set describes
//! the robot: the execution times and the model are taken from the file.
//!
//! What makes each claim checkable is that proofs are shorter than searches:
//!
//! | file | claim | what is in the certificate | what is checked |
//! |---|---|---|---|
//! | `demand.rs` | n jobs of a machine demand M(n) | from when, and with which period and gain, M repeats | two rows and each edge |
//! | `blocking.rs` | lower priorities block for B | B | B again, from the locks |
//! | `tasks.rs` | a job executes so many calls | their number | that clients do not send more, by their claims |
//! | `windows.rs` | each job ends within R | for each job, a time | the demand up to that time is not greater; the next job is released later |
//! | `global.rs` | the same on several CPUs at once | a time | while the task waits, all CPUs are busy: the others have less work |
//! | `chains.rs` | data takes no longer than L | what each step adds | each is enough, and so is the sum |
//!
//! The last inequality is R ≤ D. A claim may rely on the claims of other tasks (*ends within R*): all are accepted, or none.

mod blocking;
mod certificate;
mod chains;
mod demand;
mod global;
mod tasks;
mod windows;

use certificate::{Certificate, Kind, Priority, Rule, System, VERSION};
use demand::{Check, Work};
use global::Global;
use tasks::Tasks;
use windows::Windows;

/// What was checked.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// By deployment and level.
    pub systems: Vec<SystemSummary>,
}

/// What was checked of a deployment at one level.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SystemSummary {
    /// The name of the deployment.
    pub deployment: String,
    /// The significance level of the execution times.
    pub significance: String,
    /// The activities whose deadlines are met.
    pub met: Vec<String>,
    /// The activities whose deadlines may be met, but are not proved here, each with the reason.
    pub not_certified: Vec<(String, String)>,
    /// The chains whose latencies are proved, and are within their limits.
    pub chains: Vec<String>,
    /// The chains whose latencies are not proved here, each with the reason.
    pub chains_not_certified: Vec<(String, String)>,
    /// The real-time activities of which the certificate claims nothing.
    pub not_claimed: Vec<String>,
}

/// Why a certificate is not accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// It is not a certificate of this version.
    Unreadable(String),
    /// A claim is not proved.
    False {
        /// The deployment.
        deployment: String,
        /// The activity or the chain; none if the claim is one of the whole deployment.
        of: Option<String>,
        /// The inequality that fails, with both numbers.
        why: String,
    },
}

/// Checks a certificate.
///
/// # Errors
///
/// It is no certificate, or one of its claims is not proved.
pub fn verify(json: &str) -> Result<Summary, Refusal> {
    let certificate: Certificate =
        serde_json::from_str(json).map_err(|error| Refusal::Unreadable(error.to_string()))?;
    if certificate.version != VERSION {
        let found = certificate.version;
        return Err(Refusal::Unreadable(format!(
            "version {found} of certificates is unknown: this is {VERSION}"
        )));
    }
    let work = Work::default();
    let systems = certificate.systems.iter().map(|system| check(system, &work)).collect::<Result<_, _>>()?;
    Ok(Summary { systems })
}

fn check(system: &System, work: &Work) -> Result<SystemSummary, Refusal> {
    let refuse =
        |of: Option<String>, why: String| Refusal::False { deployment: system.deployment.clone(), of, why };
    let tasks = Tasks::new(system, work).map_err(|why| refuse(None, why))?;
    let name = |task: usize| system.tasks.get(task).map(|it| it.name.clone());
    let mut found = SystemSummary {
        deployment: system.deployment.clone(),
        significance: system.significance.clone(),
        ..SystemSummary::default()
    };
    for claim in &system.claims {
        check_claim(&tasks, claim).map_err(|why| refuse(name(claim.task), why))?;
    }
    for chain in &system.chains {
        let Some(latency) = chain.latency else {
            let reason = chain.reason.clone().unwrap_or_default();
            found.chains_not_certified.push((chain.name.clone(), reason));
            continue;
        };
        chains::check_chain(&tasks, system, chain, latency)
            .map_err(|why| refuse(Some(chain.name.clone()), why))?;
        found.chains.push(chain.name.clone());
    }
    for it in &system.not_certified {
        found.not_certified.extend(name(it.task).map(|name| (name, it.reason.clone())));
    }
    for (index, task) in system.tasks.iter().enumerate() {
        let is_activity = task.kind == Kind::Activity && !matches!(task.priority, Priority::Background);
        let is_met = tasks.claims.get(&index).is_some_and(|claim| claim.met);
        match is_activity {
            true if is_met => found.met.push(task.name.clone()),
            true if system.not_certified.iter().all(|it| it.task != index) => {
                found.not_claimed.push(task.name.clone());
            }
            _ => {}
        }
    }
    Ok(found)
}

fn check_claim(tasks: &Tasks<'_>, claim: &certificate::Claim) -> Check<()> {
    let of = &tasks.all[claim.task];
    if !of.is_known() {
        return Err(of.blocking.clone().err().unwrap_or_else(|| "its demand is unknown".to_owned()));
    }
    match &of.blocking {
        Ok(blocking) if *blocking > claim.blocking => {
            return Err(format!("lower priorities block it for {blocking} ns, not {}", claim.blocking));
        }
        _ => {}
    }
    match (claim.met, of.deadline) {
        (true, None) => return Err("it has no deadline".to_owned()),
        (true, Some(deadline)) if claim.response > deadline => {
            return Err(format!(
                "the response time {} ns exceeds the deadline {deadline} ns",
                claim.response
            ));
        }
        _ => {}
    }
    match &claim.rule {
        Rule::Global(_) => Global::new(tasks, claim)?.check(),
        _ => Windows::new(tasks, claim)?.check(),
    }
}
