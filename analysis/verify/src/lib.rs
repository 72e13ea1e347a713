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
    /// The real-time activities without a claim.
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
    let is_activity = of.task.kind == Kind::Activity;
    if is_activity && (of.task.cpus.is_none() || matches!(of.task.priority, Priority::Highest)) {
        return Err("its CPUs or its priority are unknown".to_owned());
    }
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

    use super::*;
    use serde_json::{Value, json};

    fn task(name: &str, priority: u32, period: u64, edges: Value) -> Value {
        json!({
            "name": name, "kind": "activity", "priority": priority, "period": period, "deadline": period, "jitter": 0,
            "burst": 1, "sporadic": false, "thread": null, "offset": null, "clock": 0, "cpus": [0],
            "machine": { "states": 2, "edges": edges, "waits": null },
        })
    }

    fn claim(task: u64, response: u64, ends: &[u64], interference: Value) -> Value {
        json!({
            "task": task, "response": response, "met": true, "rule": { "cpu": 0 }, "method": "psm", "blocking": 0,
            "late": [], "clock": null, "windows": [{ "ends": ends }], "interference": interference,
        })
    }

    /// A laser of 4 in each 10, every other job 2; and a pilot of 9 in each 30, whose data takes 10 + 4 + 30 + 15.
    fn robot() -> Value {
        let mut laser = task("laser", 2, 10, json!([[0, 1, 4, 0], [1, 0, 2, 0]]));
        laser["machine"]["growth"] = json!({ "from": 1, "period": 2, "gains": [6, 6] });
        let chain = json!({
            "name": "see", "latency": 55, "limit": 60, "steps": [
                { "task": 0, "releases": 1, "wait": 10, "periods": 0, "run": 0 },
                { "task": 1, "releases": 1, "wait": 30, "periods": 0, "run": 15 },
            ],
        });
        json!({ "version": 1, "tool": "by hand", "systems": [{
            "deployment": "Robot", "significance": "1e-4", "locks": [], "operations": [], "not_certified": [],
            "tasks": [laser, task("pilot", 1, 30, json!([[0, 1, 9, 0], [1, 1, 9, 0]]))],
            "claims": [claim(0, 4, &[4], json!([])), claim(1, 15, &[15], json!([[0, 2, 6]]))],
            "chains": [chain],
        }] })
    }

    /// Returns why the robot is refused with another value at this place.
    fn with(place: &str, value: Value) -> String {
        let mut robot = robot();
        *robot.pointer_mut(&format!("/systems/0/{place}")).unwrap_or_else(|| panic!("{place}")) = value;
        match verify(&robot.to_string()) {
            Ok(_) => "accepted".to_owned(),
            Err(Refusal::False { of, why, .. }) => format!("{}: {why}", of.unwrap_or_default()),
            Err(Refusal::Unreadable(why)) => format!("unreadable: {why}"),
        }
    }

    #[test]
    fn a_robot_is_accepted() {
        let found = verify(&robot().to_string()).unwrap();
        assert_eq!(found.systems[0].met, ["laser", "pilot"]);
        assert_eq!(found.systems[0].chains, ["see"]);
        assert!(found.systems[0].not_claimed.is_empty());
        // A later end is true too.
        assert_eq!(with("claims/0/response", json!(10)), "accepted");
    }

    #[test]
    fn each_false_number_is_refused() {
        for (place, value, why) in [
            (
                "claims/1/windows/0/ends",
                json!([14]),
                "pilot: job 1 has not ended after 14 ns: up to then, 15 ns are demanded",
            ),
            ("claims/1/windows/0/ends", json!([]), "pilot: the window is open after job 0"),
            ("claims/1/windows", json!([]), "pilot: the window that begins at any instant is missing"),
            ("claims/1/response", json!(14), "pilot: job 1 ends 15 ns after its release, not 14"),
            ("tasks/1/deadline", json!(14), "pilot: the response time 15 ns exceeds the deadline 14 ns"),
            ("tasks/1/deadline", json!(null), "pilot: it has no deadline"),
            (
                "tasks/1/period",
                json!(14),
                "pilot: the window is open after job 1: 15 ns, and the next release is at 14 ns",
            ),
            ("tasks/1/jitter", json!(1), "pilot: job 1 ends 16 ns after its release, not 15"),
            ("tasks/0/jitter", json!(6), "laser: job 1 ends 10 ns after its release, not 4"),
            (
                "tasks/0/period",
                json!(7),
                "pilot: job 1 has not ended after 15 ns: up to then, 19 ns are demanded",
            ),
            ("tasks/0/burst", json!(2), "laser: the window is open after job 1"),
            ("tasks/0/machine/edges/0/2", json!(5), ": closed form: state 0 gains 7, more than 6"),
            ("tasks/0/machine/edges/1", json!([0, 1, 4, 0]), ": a state has no edge"),
            ("tasks/0/machine/edges/1/1", json!(7), ": the edge from 1 to 7 leaves the 2 states"),
            (
                "tasks/0/machine/growth/gains",
                json!([6, 7]),
                ": closed form: state 0 gains less than state 1 before it",
            ),
            ("tasks/0/machine/growth/gains", json!([5, 5]), ": closed form: state 0 gains 6, more than 5"),
            (
                "tasks/0/machine/growth/period",
                json!(0),
                ": the closed form of the demand does not fit the states",
            ),
            ("tasks/0/machine/growth/from", json!(u64::MAX / 2), ": the certificate asks for more than"),
            ("tasks/0/machine", json!(null), "laser: its demand is unknown"),
            ("tasks/0/priority", json!("background"), "laser: its demand is unknown"),
            ("tasks/0/cpus", json!([1]), "laser: the CPU of the claim is none of its own"),
            ("tasks/0/cpus", json!([128]), ": no such CPU"),
            (
                "tasks/1/priority",
                json!(2),
                "laser: job 1 has not ended after 4 ns: up to then, 13 ns are demanded",
            ),
            ("tasks/1/priority", json!("highest"), "laser: job 1 has not ended after 4 ns"),
            (
                "claims/1/interference",
                json!([]),
                "pilot: 2 jobs of `laser` with 6 ns are in its longest window, and not",
            ),
            (
                "claims/1/interference",
                json!([[0, 2, 6], [1, 1, 1]]),
                "pilot: a task is listed that does not delay it",
            ),
            ("claims/1/late", json!([0]), "accepted"),
            ("claims/1/clock", json!(0), "pilot: no task has this clock"),
            ("claims/1/task", json!(0), ": task 0 has two claims, or does not exist"),
            (
                "claims/1/rule",
                json!({ "global": [0] }),
                "pilot: the CPUs of the claim are not those of the task",
            ),
            ("claims/1/rule", json!({ "linked": [1] }), "pilot: a task that delays it may run on more CPUs"),
            (
                "locks",
                json!([{ "name": "l", "protocol": "none", "users": [[0, 1], [1, 3]] }]),
                "laser: lower priorities block it for 3 ns, not 0",
            ),
            (
                "locks",
                json!([{ "name": "l", "protocol": "ceiling", "users": [[0, 1], [2, 3]] }]),
                ": lock l has a user that does not exist",
            ),
            (
                "locks",
                json!([{ "name": "l", "protocol": "ceiling", "users": [[0, 1], [1, null]] }]),
                "laser: for how long lock l is held is unknown",
            ),
            (
                "operations",
                json!([{ "provider": 0, "client": 1, "sends": 1, "time": 1, "during": null, "calls": 0 }]),
                ": calls of `laser` by `pilot`: 0 for each job, but 1 may be sent",
            ),
            (
                "operations",
                json!([{ "provider": 0, "client": 1, "sends": 1, "time": 1, "during": null, "calls": null }]),
                "laser: its demand is unknown",
            ),
            ("chains/0/latency", json!(54), "see: its steps take 55 ns together, not 54"),
            ("chains/0/limit", json!(54), "see: its latency 55 ns exceeds its limit 54 ns"),
            ("chains/0/steps/0/wait", json!(9), "see: `laser` may wait 10 ns for its release, not 9"),
            (
                "chains/0/steps/0/releases",
                json!(2),
                "see: `laser` may wait 10 ns for its release, not 10, and 10 ns for",
            ),
            ("chains/0/steps/1/run", json!(14), "see: `pilot` writes after 15 ns, not 14"),
            ("chains/0/steps/0/task", json!(2), "see: a step has no period, or is not real-time"),
            ("chains/0/steps", json!([]), "see: it has no steps"),
            ("significance", json!(4), "unreadable: "),
        ] {
            let found = with(place, value.clone());
            assert!(found.starts_with(why), "{place} = {value}: {found}");
        }
    }

    /// At a utilisation of 1, no window ends; all repeats after 30.
    #[test]
    fn a_full_load_repeats() {
        let mut robot = robot();
        let system = &mut robot["systems"][0];
        system["chains"] = json!([]);
        let mut pilot = task("pilot", 1, 20, json!([[0, 1, 14, 0], [1, 1, 14, 0]]));
        pilot["machine"]["growth"] = json!({ "from": 1, "period": 1, "gains": [0, 14] });
        system["tasks"][1] = pilot;
        system["claims"][1] = claim(1, 20, &[20, 40, 60], json!([[0, 2, 6]]));
        let refused = |robot: &Value| verify(&robot.to_string()).is_err();
        robot["systems"][0]["claims"][1]["windows"][0]["ends"] = json!([20]);
        assert!(!refused(&robot));
        // With a jitter, the window is open.
        robot["systems"][0]["tasks"][1]["jitter"] = json!(1);
        robot["systems"][0]["tasks"][1]["deadline"] = json!(30);
        robot["systems"][0]["claims"][1]["response"] = json!(21);
        assert!(refused(&robot));
        robot["systems"][0]["claims"][1]["windows"][0]["ends"] = json!([20, 40, 60]);
        assert!(refused(&robot));
        robot["systems"][0]["claims"][1]["windows"][0]["repeats"] = json!([2, 20]);
        assert!(!refused(&robot));
        for repeats in [[1, 20], [2, 10], [2, 60], [4, 20], [0, 20], [2, 0]] {
            robot["systems"][0]["claims"][1]["windows"][0]["repeats"] = json!(repeats);
            assert!(refused(&robot), "{repeats:?}");
        }
        robot["systems"][0]["claims"][1]["windows"][0]["repeats"] = json!([2, 20]);
        robot["systems"][0]["tasks"][1]["machine"]["growth"]["gains"] = json!([15, 15]);
        assert!(refused(&robot));
    }

    #[test]
    fn what_is_no_certificate_is_unreadable() {
        for text in ["", "[]", "{}", "{\"version\":2,\"tool\":\"\",\"systems\":[]}"] {
            assert!(matches!(verify(text), Err(Refusal::Unreadable(_))), "{text}");
        }
    }

    /// Each number of the robot in turn: nothing overflows, and no work is endless.
    #[test]
    fn extreme_numbers_do_no_harm() {
        fn numbers(value: &Value, at: &str, found: &mut Vec<String>) {
            match value {
                Value::Number(_) => found.push(at.to_owned()),
                Value::Array(all) => {
                    all.iter().enumerate().for_each(|(key, it)| numbers(it, &format!("{at}/{key}"), found))
                }
                Value::Object(all) => {
                    all.iter().for_each(|(key, it)| numbers(it, &format!("{at}/{key}"), found))
                }
                _ => {}
            }
        }
        let (mut robot, mut all) = (robot(), Vec::new());
        robot["systems"][0]["locks"] =
            json!([{ "name": "l", "protocol": "ceiling", "users": [[0, 1], [1, 0]] }]);
        robot["systems"][0]["operations"] =
            json!([{ "provider": 0, "client": 1, "sends": 0, "time": 0, "during": null, "calls": 0 }]);
        robot["systems"][0]["tasks"][0]["offset"] = json!(3);
        robot["systems"][0]["tasks"][1]["machine"]["edges"][0][3] = json!(0);
        robot["systems"][0]["claims"][1]["windows"][0]["repeats"] = json!([1, 30]);
        numbers(&robot, "", &mut all);
        for place in &all {
            for value in [0, 1, 3, u64::MAX / 2, u64::MAX] {
                let mut other = robot.clone();
                *other.pointer_mut(place).unwrap() = json!(value);
                let _ = verify(&other.to_string());
            }
        }
    }
}
