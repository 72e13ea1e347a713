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
//! | `chains.rs` | data takes no longer than L | its steps, and how many releases each takes | the sum of the periods and of the times until the writes |
//!
//! The last inequality is R ≤ D. A claim may rely on the claims of other tasks (*ends within R*): all are accepted, or none.
//!
//! Some of what the analysis proves has no form here, and the certificate lists it with the reason: what only holds as several
//! CPUs execute at once, as synchronised clocks keep releases apart, as waits leave the CPU to others, as combinations of paths exclude
//! each other, or as a load of 100 % repeats for ever.

mod blocking;
mod certificate;
mod chains;
mod demand;
mod tasks;
mod windows;

use std::collections::BTreeSet;

pub use certificate::CertifiedChain;
use certificate::{Certificate, CertifiedSystem, Claim, VERSION};
use demand::{Checks, WorkLeft};
use tasks::CheckedTasks;

/// What was checked of a deployment at one level.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// The name of the deployment.
    pub deployment: String,
    /// The significance level of the execution times.
    pub significance: String,
    /// The activities whose deadlines are met.
    pub met: Vec<String>,
    /// The chains whose latencies are proved, and are within their limits.
    pub chains: Vec<CertifiedChain>,
    /// The other real-time activities and chains: that they meet what is asked of them is not proved here, each with the reason.
    pub not_certified: Vec<(String, String)>,
}

/// Why a certificate is not accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RefusedClaim {
    /// It is not a certificate of this version.
    Unreadable(String),
    /// A claim is not proved: the activity or the chain, the deployment, and the inequality that fails, with both numbers.
    False(String),
}

/// Checks a certificate, and returns what it proves, by deployment and level.
///
/// # Errors
///
/// It is no certificate, or one of its claims is not proved.
pub fn verify(json: &str) -> Result<Vec<Summary>, RefusedClaim> {
    let certificate: Certificate =
        serde_json::from_str(json).map_err(|error| RefusedClaim::Unreadable(error.to_string()))?;
    let found = certificate.version;
    if found != VERSION {
        let why = format!("version {found} of certificates is unknown: this is {VERSION}");
        return Err(RefusedClaim::Unreadable(why));
    }
    let work = WorkLeft::of(json);
    certificate.systems.iter().map(|system| check(system, &work)).collect()
}

fn check(system: &CertifiedSystem, work: &WorkLeft) -> Result<Summary, RefusedClaim> {
    let deployment = &system.deployment;
    let refuse = |of: &str, why: String| RefusedClaim::False(format!("{of}{deployment}: {why}"));
    let tasks = CheckedTasks::new(system, work).map_err(|why| refuse("", why))?;
    for claim in &system.claims {
        let of = format!("{} of ", tasks.name(claim.task));
        check_claim(&tasks, claim).map_err(|why| refuse(&of, why))?;
    }
    let mut found = Summary {
        deployment: deployment.clone(),
        significance: system.significance.clone(),
        not_certified: system.not_certified.clone(),
        ..Summary::default()
    };
    for chain in &system.chains {
        let of = format!("`{}` of ", chain.name);
        chains::check_chain(&tasks, chain).map_err(|why| refuse(&of, why))?;
        found.chains.push(chain.clone());
    }
    let listed: BTreeSet<&str> = system.not_certified.iter().map(|it| it.0.as_str()).collect();
    for (index, task) in system.tasks.iter().enumerate().filter(|it| it.1.is_activity && it.1.is_real_time) {
        let name = task.name.clone();
        if tasks.claims.get(&index).is_some_and(|claim| claim.met) {
            found.met.push(name);
        } else if !listed.contains(name.as_str()) {
            found.not_certified.push((name, "not-claimed".to_owned()));
        }
    }
    Ok(found)
}

fn check_claim(tasks: &CheckedTasks<'_>, claim: &Claim) -> Checks<()> {
    let of = &tasks.all[claim.task];
    if of.task.cpus.is_none() || of.rank == u64::MAX {
        return Err("its CPUs or its priority are unknown".to_owned());
    }
    let (blocking, _) = of.blocking.clone()?;
    if blocking > claim.blocking {
        return Err(format!("lower priorities block it for {blocking} ns, not {}", claim.blocking));
    }
    match of.task.deadline {
        None if claim.met => Err("it has no deadline".to_owned()),
        Some(deadline) if claim.met && claim.response > deadline => {
            Err(format!("the response time {} ns exceeds the deadline {deadline} ns", claim.response))
        }
        _ => windows::check_window(tasks, claim),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

    use super::*;
    use serde_json::{Value, json};

    /// A job takes an edge (from, to, time, wait) of two states; `gains` come from 1 job on, each second job.
    fn task(name: &str, priority: u64, period: u64, edges: Value, gains: [u64; 2]) -> Value {
        json!({
            "name": name, "is_activity": true, "is_real_time": true, "priority": priority, "period": period,
            "deadline": period, "jitter": 0, "burst": 1, "sporadic": false, "thread": null, "cpus": [0],
            "machine": { "states": 2, "edges": edges, "waits": 0, "from": 1, "period": 2, "gains": gains },
        })
    }

    /// A task whose jobs all execute for `time`.
    fn simple(name: &str, priority: u64, period: u64, time: u64) -> Value {
        let mut task = task(name, priority, period, json!([[0, 0, time, 0]]), [0, 0]);
        task["machine"] = json!({ "states": 1, "edges": [[0, 0, time, 0]], "waits": 0, "from": 0, "period": 1, "gains": [time] });
        task
    }

    fn claim(task: u64, ends: &[u64]) -> Value {
        let response = ends.iter().max();
        json!({ "task": task, "response": response, "met": true, "cpu": 0, "blocking": 0, "ends": ends, "closes": null })
    }

    fn robot_of(tasks: &[Value], claims: &[Value]) -> Value {
        json!({ "version": 2, "tool": "by hand", "systems": [{
            "deployment": "Robot", "significance": "1e-4", "locks": [], "operations": [], "not_certified": [],
            "tasks": tasks, "claims": claims, "chains": [],
        }] })
    }

    /// A laser of 4 in each 10, every other job 2; and a pilot of 9 in each 30, whose data takes 10 + 4 + 30 + 15.
    fn robot() -> Value {
        let laser = task("laser", 2, 10, json!([[0, 1, 4, 0], [1, 0, 2, 0]]), [6, 6]);
        let mut robot = robot_of(&[laser, simple("pilot", 1, 30, 9)], &[claim(0, &[4]), claim(1, &[15])]);
        robot["systems"][0]["chains"] = json!([{ "name": "see", "latency": 55, "limit": 60, "steps": [[0, 1], [1, 1]], "while": ["pilot.Steering"], "answers": [] }]);
        robot
    }

    /// Returns why a robot is refused with other values at some places.
    fn changed(robot: &Value, changes: &[(&str, Value)]) -> String {
        let mut robot = robot.clone();
        for (place, value) in changes {
            let at = robot.pointer_mut(&format!("/systems/0/{place}"));
            *at.unwrap_or_else(|| panic!("{place}")) = value.clone();
        }
        match verify(&robot.to_string()) {
            Ok(_) => "accepted".to_owned(),
            Err(RefusedClaim::False(why)) => why.replace(" of Robot", ""),
            Err(RefusedClaim::Unreadable(why)) => format!("unreadable: {why}"),
        }
    }

    #[test]
    fn a_robot_is_accepted() {
        let found = verify(&robot().to_string()).unwrap();
        assert_eq!(found[0].met, ["laser", "pilot"]);
        let see = &found[0].chains[0];
        assert_eq!((see.name.as_str(), see.latency, see.limit), ("see", 55, Some(60)));
        // Both conditions of a chain are in each certificate, so that none is overlooked.
        assert_eq!((&*see.states, &*see.answers), (&["pilot.Steering".to_owned()][..], &[][..]));
        for key in ["while", "answers"] {
            let mut without = robot();
            without["systems"][0]["chains"][0].as_object_mut().unwrap().remove(key);
            assert!(matches!(verify(&without.to_string()), Err(RefusedClaim::Unreadable(_))), "{key}");
        }
        assert!(found[0].not_certified.is_empty());
        // A later end is true too.
        assert_eq!(changed(&robot(), &[("claims/0/response", json!(10))]), "accepted");
    }

    #[test]
    fn each_false_number_is_refused() {
        for (place, value, why) in [
            (
                "claims/1/ends",
                json!([14]),
                "`pilot`: job 1 has not ended after 14 ns: up to then, 15 ns are demanded",
            ),
            ("claims/1/ends", json!([]), "`pilot`: the window is open after job 0"),
            ("claims/1/response", json!(14), "`pilot`: job 1 ends 15 ns after its release, not 14"),
            ("tasks/1/deadline", json!(14), "`pilot`: the response time 15 ns exceeds the deadline 14 ns"),
            ("tasks/1/deadline", json!(null), "`pilot`: it has no deadline"),
            (
                "tasks/1/period",
                json!(14),
                "`pilot`: the window is open after job 1: 15 ns, and the next release is at 14 ns",
            ),
            ("tasks/1/jitter", json!(1), "`pilot`: job 1 ends 16 ns after its release, not 15"),
            ("tasks/0/jitter", json!(6), "`laser`: job 1 ends 10 ns after its release, not 4"),
            ("tasks/0/period", json!(7), "`pilot`: job 1 has not ended after 15 ns: up to then, 16 ns"),
            ("tasks/0/burst", json!(2), "`laser`: the window is open after job 1"),
            ("tasks/0/machine/edges/0/2", json!(5), "Robot: closed form: state 0 gains 7, more than 6"),
            ("tasks/0/machine/edges/1", json!([0, 1, 4, 0]), "Robot: a state has no edge"),
            ("tasks/0/machine/edges/1/1", json!(7), "Robot: the edge from 1 to 7 leaves the 2 states"),
            (
                "tasks/0/machine/gains",
                json!([6, 7]),
                "Robot: closed form: state 0 gains less than state 1 before it",
            ),
            ("tasks/0/machine/gains", json!([5, 5]), "Robot: closed form: state 0 gains 6, more than 5"),
            (
                "tasks/0/machine/gains",
                json!([6]),
                "Robot: the closed form of the demand does not fit the states",
            ),
            (
                "tasks/0/machine/period",
                json!(0),
                "Robot: the closed form of the demand does not fit the states",
            ),
            ("tasks/0/machine/from", json!(u64::MAX / 2), "Robot: the certificate asks for too much work"),
            ("tasks/0/machine", json!(null), "`laser`: `laser` delays it, and its demand is unknown"),
            ("tasks/0/period", json!(null), "`laser`: `laser` delays it, and its demand is unknown"),
            ("tasks/0/is_real_time", json!(false), "`laser`: `laser` delays it, and its demand is unknown"),
            ("tasks/0/cpus", json!([1]), "`laser`: the CPU of the claim is none of its own"),
            ("tasks/0/cpus", json!([128]), "Robot: `laser` has no CPU, or one that does not exist"),
            ("tasks/0/cpus", json!([]), "Robot: `laser` has no CPU, or one that does not exist"),
            ("tasks/0/cpus", json!(null), "`laser`: its CPUs or its priority are unknown"),
            ("tasks/0/priority", json!(null), "`laser`: its CPUs or its priority are unknown"),
            ("tasks/1/priority", json!(2), "`laser`: job 1 has not ended after 4 ns: up to then, 8 ns"),
            ("tasks/1/priority", json!(null), "`laser`: job 1 has not ended after 4 ns"),
            ("tasks/1/name", json!("laser"), "Robot: more than 4096 tasks, or two activities of one name"),
            ("claims/1/cpu", json!(1), "`pilot`: the CPU of the claim is none of its own"),
            ("claims/1/task", json!(0), "Robot: task 0 has two claims, or does not exist"),
            ("claims/1/task", json!(2), "Robot: task 2 has two claims, or does not exist"),
            (
                "locks",
                json!([{ "name": "l", "protocol": "none", "users": [[0, 1], [1, 3]] }]),
                "`laser`: lower priorities block it for 3 ns, not 0",
            ),
            (
                "locks",
                json!([{ "name": "l", "protocol": "ceiling", "users": [[0, 1], [2, 3]] }]),
                "Robot: lock l has a user that does not exist",
            ),
            (
                "locks",
                json!([{ "name": "l", "protocol": "ceiling", "users": [[0, 1], [1, null]] }]),
                "`laser`: for how long lock l is held is unknown",
            ),
            (
                "operations",
                json!([{ "provider": 0, "client": 1, "sends": 1, "time": 1, "calls": 0 }]),
                "Robot: calls of `laser` by `pilot`: 0 for each job, but 1 may be sent",
            ),
            (
                "operations",
                json!([{ "provider": 0, "client": 1, "sends": 1, "time": 1, "calls": null }]),
                "`laser`: `laser` delays it, and its demand is unknown",
            ),
            (
                "operations",
                json!([{ "provider": 0, "client": 2, "sends": 1, "time": 1, "calls": null }]),
                "Robot: an operation of a task that does not exist",
            ),
            ("chains/0/latency", json!(54), "`see`: its steps take 55 ns together, not 54"),
            ("chains/0/limit", json!(54), "`see`: its latency 55 ns exceeds its limit 54 ns"),
            ("chains/0/steps/0/1", json!(2), "`see`: its steps take 65 ns together, not 55"),
            ("chains/0/steps/0/1", json!(0), "accepted"),
            ("chains/0/steps/0/0", json!(2), "`see`: a step has no period, or is not real-time"),
            ("chains/0/steps", json!([]), "`see`: it has no steps"),
            ("significance", json!(4), "unreadable: "),
        ] {
            let found = changed(&robot(), &[(place, value.clone())]);
            assert!(found.starts_with(why), "{place} = {value}: {found}");
        }
    }

    /// Each value is the least that is accepted, or the greatest: one less, or more, is refused.
    fn least(robot: &Value, place: &str, value: u64) {
        assert_eq!(changed(robot, &[(place, json!(value))]), "accepted", "{place} = {value}");
        assert_ne!(changed(robot, &[(place, json!(value - 1))]), "accepted", "{place} = {value} - 1");
    }

    fn greatest(robot: &Value, place: &str, value: u64) {
        assert_eq!(changed(robot, &[(place, json!(value))]), "accepted", "{place} = {value}");
        assert_ne!(changed(robot, &[(place, json!(value + 1))]), "accepted", "{place} = {value} + 1");
    }

    /// 8 in each 20 below 6 in each 15, with jitters: the first job ends at 14, at 20 with two jobs of the other.
    #[test]
    fn jitter_delays_others_and_the_task_and_closes_late() {
        let mut robot = robot_of(
            &[simple("high", 2, 15, 6), simple("low", 1, 20, 8)],
            &[claim(0, &[6]), claim(1, &[14])],
        );
        // ⌈(14 + J) / 15⌉ = 1 up to J = 1.
        robot["systems"][0]["claims"][0]["response"] = json!(10);
        greatest(&robot, "tasks/0/jitter", 1);
        robot["systems"][0]["claims"][1]["response"] = json!(20);
        robot["systems"][0]["claims"][1]["ends"] = json!([20]);
        // Then the other one executes twice; and with its own jitter, the next job of `low` is released before the end.
        greatest(&robot, "tasks/0/jitter", 4);
        robot["systems"][0]["tasks"][1]["deadline"] = json!(100);
        robot["systems"][0]["claims"][1]["response"] = json!(100);
        robot["systems"][0]["claims"][1]["ends"] = json!([14]);
        greatest(&robot, "tasks/1/jitter", 6);
    }

    /// Two jobs in each 20: the second one of a burst is released with the first.
    #[test]
    fn a_burst_is_released_at_once() {
        let mut low = simple("low", 1, 20, 3);
        low["burst"] = json!(2);
        let robot = robot_of(&[simple("high", 2, 20, 6), low], &[claim(0, &[6]), claim(1, &[9, 12])]);
        least(&robot, "claims/1/ends/1", 12);
        least(&robot, "claims/1/response", 12);
        least(&robot, "tasks/1/period", 12);
        let twice = [
            ("tasks/0/burst", json!(2)),
            ("claims/0/ends", json!([6, 12])),
            ("claims/0/response", json!(12)),
        ];
        assert!(changed(&robot, &twice).contains("`low`: job 1 has not ended after 9 ns: up to then, 15 ns"));
        assert_eq!(
            changed(&robot, &[("claims/1/ends", json!([9]))]),
            "`low`: the window is open after job 1: 9 ns, and the next release is at 0 ns"
        );
    }

    #[test]
    fn a_window_has_several_jobs() {
        let mut claims = [claim(0, &[5]), claim(1, &[12, 24, 36, 43])];
        claims[1]["response"] = json!(14);
        let mut robot = robot_of(&[simple("high", 2, 15, 5), simple("low", 1, 11, 7)], &claims);
        robot["systems"][0]["tasks"][1]["deadline"] = json!(14);
        for (job, end) in [(0, 12), (1, 24), (2, 36), (3, 43)] {
            least(&robot, &format!("claims/1/ends/{job}"), end);
        }
        least(&robot, "claims/1/response", 14);
        for open in [json!([12]), json!([12, 24]), json!([12, 24, 36])] {
            assert!(changed(&robot, &[("claims/1/ends", open)]).contains("the window is open"));
        }
    }

    /// The last of two jobs of `high` begins at 10: it has executed for 2 of its 5 at 12, when it cannot have executed for more.
    #[test]
    fn no_job_executes_before_its_release() {
        let high = task("high", 1, 10, json!([[0, 1, 1, 0], [1, 0, 5, 0]]), [6, 6]);
        let mut low = simple("low", 1, 20, 4);
        low["deadline"] = json!(20);
        let robot = robot_of(&[high, low], &[claim(0, &[9]), claim(1, &[9])]);
        // Of equal priority, each delays the other.
        least(&robot, "claims/1/ends/0", 9);
        least(&robot, "claims/0/ends/0", 9);
        // 1 and then 5 from 10 on, or 5 and then 1: in 11, no more than 6.
        let more = [("tasks/1/machine", simple("", 1, 1, 5)["machine"].clone())];
        assert!(changed(&robot, &more).contains("has not ended after 9 ns: up to then, 10 ns"));
    }

    /// The thread executes `first`, `second` and `third`, one after another, each period.
    #[test]
    fn a_thread_executes_its_tasks_in_their_order() {
        let mut tasks = [simple("first", 1, 20, 3), simple("second", 1, 20, 4), simple("third", 1, 20, 5)];
        tasks.iter_mut().for_each(|it| it["thread"] = json!(7));
        let mut claims = [claim(0, &[3]), claim(1, &[7]), claim(2, &[12])];
        claims.iter_mut().for_each(|it| it["closes"] = json!(12));
        let robot = robot_of(&tasks, &claims);
        for (task, end) in [(0, 3), (1, 7), (2, 12)] {
            least(&robot, &format!("claims/{task}/ends/0"), end);
            least(&robot, &format!("claims/{task}/closes"), 12);
        }
        // The window closes with the thread, not with the task.
        assert!(
            changed(&robot, &[("claims/0/closes", json!(null))])
                .contains("the window is open after job 1: 3 ns")
        );
        for (property, value) in [
            ("period", json!(21)),
            ("jitter", json!(1)),
            ("priority", json!(2)),
            ("cpus", json!([1])),
            ("is_real_time", json!(false)),
            ("sporadic", json!(true)),
            ("burst", json!(2)),
        ] {
            let found = changed(&robot, &[(&format!("tasks/1/{property}"), value)]);
            assert!(found.contains("the tasks in the thread of `first` differ"), "{property}: {found}");
        }
        // A mate that executes calls may do so before the job.
        let calls = json!([{ "provider": 2, "client": 2, "sends": 1, "time": 1, "calls": 3 }]);
        let calls = [("operations", calls), ("tasks/2/machine/gains", json!([8]))];
        assert!(
            changed(&robot, &calls).contains("`first`: job 1 has not ended after 3 ns: up to then, 11 ns")
        );
    }

    /// A call of 2 by `high`, which waits for no one: ⌈(6 + 20 + 30)/10⌉ = 6 calls for each job of `low`.
    #[test]
    fn calls_are_those_of_the_jobs_in_reach() {
        let mut robot = robot_of(
            &[simple("high", 2, 10, 1), simple("low", 1, 30, 2)],
            &[claim(0, &[1]), claim(1, &[16])],
        );
        robot["systems"][0]["operations"] =
            json!([{ "provider": 1, "client": 0, "sends": 1, "time": 2, "calls": 5 }]);
        robot["systems"][0]["tasks"][1]["machine"]["gains"] = json!([12]);
        // 1 + 16 + 30 = 47: 5 jobs.
        least(&robot, "operations/0/calls", 5);
        least(&robot, "claims/1/ends/0", 14);
        greatest(&robot, "claims/1/response", 19);
        greatest(&robot, "claims/0/response", 4);
        // Each second job sends: 3 calls. At most one is pending: 1 + ⌈(1 + 30)/20⌉, also if `low` were later.
        let limited = |key: &str, pending: Value, calls: u64| {
            let mut robot = robot.clone();
            let operation = &mut robot["systems"][0]["operations"][0];
            (operation["every"], operation["pending"], operation["calls"]) =
                (json!(2), pending, json!(calls));
            robot["systems"][0]["tasks"][1]["machine"]["gains"] = json!([2 + 2 * calls]);
            changed(&robot, &[(key, json!(16))])
        };
        assert_eq!(limited("claims/1/response", json!(null), 3), "accepted");
        assert_ne!(limited("claims/1/response", json!(null), 2), "accepted");
        assert_eq!(limited("claims/1/response", json!(1), 3), "accepted");
        assert_ne!(limited("claims/1/response", json!(1), 2), "accepted");
        assert_ne!(changed(&robot, &[("operations/0/sends", json!(2))]), "accepted");
        assert_ne!(changed(&robot, &[("operations/0/time", json!(3))]), "accepted");
        assert_ne!(
            changed(
                &robot,
                &[
                    ("tasks/0/burst", json!(2)),
                    ("claims/0/ends", json!([1, 2])),
                    ("claims/0/response", json!(2))
                ]
            ),
            "accepted"
        );
        let unbound =
            [("tasks/1/sporadic", json!(true)), ("tasks/1/burst", json!(2)), ("tasks/0/period", json!(null))];
        for (place, value) in unbound {
            assert!(
                changed(&robot, &[(place, value)]).contains("nothing bounds when they are executed"),
                "{place}"
            );
        }
        robot["systems"][0]["claims"] = json!([claim(1, &[14])]);
        assert!(changed(&robot, &[]).contains("relies on the response time of `high`, which has no claim"));
    }

    /// Three priorities on CPU 0; the two others hold a lock with `high` for 3 and 4.
    fn with_locks() -> Value {
        let tasks = [simple("high", 3, 50, 5), simple("middle", 2, 50, 6), simple("low", 1, 50, 7)];
        robot_of(&tasks, &[claim(0, &[30]), claim(1, &[30]), claim(2, &[18])])
    }

    #[test]
    fn locks_block_as_their_protocols_say() {
        let lock = |name: &str, protocol: &str, users: Value| json!({ "name": name, "protocol": protocol, "users": users });
        let one = |protocol: &str| json!([lock("l", protocol, json!([[0, 1], [1, 3], [2, 4]]))]);
        // Two locks, each with two users.
        let two = |protocol: &str| {
            json!([
                lock("l", protocol, json!([[0, 1], [1, 3]])),
                lock("m", protocol, json!([[0, 1], [2, 4]]))
            ])
        };
        let same = |protocol: &str| {
            json!([
                lock("l", protocol, json!([[0, 1], [2, 3]])),
                lock("m", protocol, json!([[0, 1], [2, 4]]))
            ])
        };
        for (locks, blocking) in [
            (one("ceiling"), [4, 4]),
            (two("ceiling"), [4, 4]),
            (same("ceiling"), [4, 4]),
            // Once for each lock, and once for each job.
            (one("inheritance"), [4, 4]),
            (two("inheritance"), [7, 4]),
            (same("inheritance"), [4, 4]),
        ] {
            let mut robot = with_locks();
            robot["systems"][0]["locks"] = locks;
            robot["systems"][0]["claims"][1]["blocking"] = json!(4);
            least(&robot, "claims/0/blocking", blocking[0]);
            robot["systems"][0]["claims"][0]["blocking"] = json!(blocking[0]);
            least(&robot, "claims/1/blocking", blocking[1]);
            robot["systems"][0]["claims"][1]["blocking"] = json!(blocking[1]);
            least(&robot, "claims/0/ends/0", 5 + blocking[0]);
        }
        // Without a protocol, `middle` preempts the holder; unless it is of the same priority.
        let mut robot = with_locks();
        robot["systems"][0]["locks"] = json!([lock("l", "none", json!([[0, 1], [2, 4]]))]);
        robot["systems"][0]["claims"][0]["blocking"] = json!(4);
        assert!(changed(&robot, &[]).contains("lock l is held by a job that others preempt"));
        let elsewhere = [("tasks/1/cpus", json!([1])), ("claims/1/cpu", json!(1))];
        assert_eq!(changed(&robot, &elsewhere), "accepted");
        // One of the priority of the holder may run before it.
        for priority in [1, 2] {
            let found = changed(&robot, &[("tasks/1/priority", json!(priority))]);
            assert!(found.contains("lock l is held by a job that others preempt"), "{priority}: {found}");
        }
        let background =
            [&elsewhere[..], &[("tasks/2/is_real_time", json!(false)), ("claims", json!([]))]].concat();
        let background = [&background[..], &[("claims", json!([{ "task": 0, "response": 30, "met": true, "cpu": 0, "blocking": 4, "ends": [30], "closes": null }]))]].concat();
        assert!(changed(&robot, &background).contains("lock l is held by a job that others preempt"));
        // It is delayed by a lock of others above it: a ceiling of `middle` counts for `high`.
        let mut robot = with_locks();
        robot["systems"][0]["tasks"][1]["priority"] = json!(1);
        robot["systems"][0]["locks"] = json!([
            lock("l", "none", json!([[0, 1], [1, 3]])),
            lock("m", "ceiling", json!([[1, 1], [2, 4]])),
        ]);
        robot["systems"][0]["tasks"][2]["priority"] = json!(0);
        robot["systems"][0]["claims"][1]["blocking"] = json!(4);
        assert_ne!(changed(&robot, &[("claims/0/blocking", json!(3))]), "accepted");
    }

    #[test]
    fn a_lock_on_two_cpus_raises_its_users() {
        let tasks = [simple("a", 9, 50, 5), simple("b", 5, 50, 6), simple("c", 1, 50, 7)];
        let mut robot = robot_of(&tasks, &[claim(1, &[6])]);
        robot["systems"][0]["tasks"][0]["cpus"] = json!([1]);
        assert_eq!(changed(&robot, &[]), "accepted");
        for protocol in ["inheritance", "ceiling"] {
            let locks = json!([{ "name": "l", "protocol": protocol, "users": [[0, 1], [2, 7]] }]);
            let found = changed(&robot, &[("locks", locks.clone())]);
            assert!(found.contains("`b`: `c` delays it, and its demand is unknown"), "{found}");
            let background = [("locks", locks.clone()), ("tasks/2/is_real_time", json!(false))];
            assert!(changed(&robot, &background).contains("`c` delays it"));
            // A user of it has no bound.
            let own = [
                ("locks", locks),
                (
                    "claims",
                    json!([{ "task": 0, "response": 5, "met": true, "cpu": 1, "blocking": 9, "ends": [5], "closes": null }]),
                ),
            ];
            assert!(changed(&robot, &own).contains("`a`: lock l is used on several CPUs"));
        }
    }

    /// A job of `high` waits for 3 in each job: it counts as execution, and another job may take the lock meanwhile.
    #[test]
    fn waits_count_and_let_locks_be_taken() {
        let mut robot = robot_of(
            &[simple("high", 2, 50, 5), simple("low", 1, 50, 7)],
            &[claim(0, &[8]), claim(1, &[15])],
        );
        robot["systems"][0]["tasks"][0]["machine"] = json!({
            "states": 1, "edges": [[0, 0, 5, 3]], "waits": 2, "from": 0, "period": 1, "gains": [8],
        });
        least(&robot, "claims/0/ends/0", 8);
        least(&robot, "claims/1/ends/0", 15);
        robot["systems"][0]["locks"] =
            json!([{ "name": "l", "protocol": "ceiling", "users": [[0, 1], [1, 4]] }]);
        robot["systems"][0]["claims"][0]["blocking"] = json!(4);
        // Once at first, and twice while it waits.
        robot["systems"][0]["claims"][0]["response"] = json!(40);
        least(&robot, "claims/0/ends/0", 8 + 3 * 4);
        robot["systems"][0]["claims"][0]["ends"] = json!([20]);
        greatest(&robot, "tasks/0/machine/waits", 2);
        for unknown in [json!(null), json!(1u64 << 60)] {
            assert_ne!(changed(&robot, &[("tasks/0/machine/waits", unknown)]), "accepted");
        }
        // An edge that waits does so at least once.
        robot["systems"][0]["claims"][0]["ends"] = json!([12]);
        assert_ne!(changed(&robot, &[("tasks/0/machine/waits", json!(0))]), "accepted");
    }

    /// `wide` may run on another CPU while `low` waits for the lock: then each job of `low` is blocked.
    #[test]
    fn each_job_is_blocked_beside_a_task_of_several_cpus() {
        let mut tasks = [simple("wide", 3, 30, 6), simple("low", 2, 11, 7), simple("lowest", 1, 900, 9)];
        let locks = json!([{ "name": "l", "protocol": "ceiling", "users": [[1, 1], [2, 2]] }]);
        for (cpus, ends) in [(json!([0]), [15, 22]), (json!([0, 1]), [15, 24])] {
            tasks[0]["cpus"] = cpus.clone();
            let mut claim = claim(1, &ends);
            (claim["response"], claim["met"], claim["blocking"]) = (json!(15), json!(false), json!(2));
            let mut robot = robot_of(&tasks, &[claim]);
            robot["systems"][0]["locks"] = locks.clone();
            let found = changed(&robot, &[]);
            let is_closed = ends[1] <= 22;
            assert_eq!(found == "accepted", is_closed, "{cpus}: {found}");
            let less = changed(&robot, &[("claims/0/ends/1", json!(ends[1] - 1))]);
            assert!(less.contains("job 2 has not ended"), "{cpus}: {less}");
        }
    }

    /// They may be any, so that two such tasks may have different sets.
    #[test]
    fn nothing_is_proved_below_tasks_of_unknown_cpus() {
        let tasks = [simple("a", 3, 50, 5), simple("b", 2, 50, 6), simple("c", 1, 50, 7)];
        let mut robot = robot_of(&tasks, &[claim(2, &[18])]);
        assert_eq!(changed(&robot, &[]), "accepted");
        for task in 0..2 {
            robot["systems"][0]["tasks"][task]["cpus"] = json!(null);
            assert!(changed(&robot, &[]).contains("`c`: `a` delays it, and its demand is unknown"));
        }
    }

    #[test]
    fn linked_cpus_count_as_one() {
        let mut tasks = [simple("a", 3, 50, 5), simple("b", 2, 50, 6), simple("c", 1, 50, 7)];
        let robot_on = |tasks: &[Value], cpu: Value, end: u64| {
            let mut claim = claim(2, &[end]);
            claim["cpu"] = cpu;
            robot_of(tasks, &[claim])
        };
        // One set of two CPUs: the claim may be of each.
        tasks[1]["cpus"] = json!([0, 1]);
        least(&robot_on(&tasks, json!(0), 18), "claims/0/ends/0", 18);
        // Two such sets are linked: all that delays it on any of them counts.
        tasks[0]["cpus"] = json!([1, 2]);
        let found = changed(&robot_on(&tasks, json!(0), 18), &[]);
        assert!(
            found.contains("the CPU of the claim is none of its own, or sets of several CPUs differ"),
            "{found}"
        );
        least(&robot_on(&tasks, json!(null), 18), "claims/0/ends/0", 18);
        // Those of lower priority link nothing.
        tasks[2]["priority"] = json!(9);
        least(&robot_on(&tasks, json!(0), 7), "claims/0/ends/0", 7);
    }

    #[test]
    fn a_chain_waits_for_the_write() {
        let robot = robot();
        let longer = |changes: &[(&str, Value)], sum: u64| {
            let found = changed(&robot, &[changes, &[("chains/0/latency", json!(1))]].concat());
            assert_eq!(found, format!("`see`: its steps take {sum} ns together, not 1"), "{changes:?}");
        };
        longer(&[], 55);
        longer(&[("chains/0/steps/0/1", json!(0))], 55);
        longer(&[("tasks/0/jitter", json!(1)), ("claims/0/response", json!(5))], 56);
        // R of the laser, where the pilot may read before it writes.
        let on_both = [("tasks/1/cpus", json!([1])), ("claims/1/cpu", json!(1))];
        longer(&on_both, 59);
        let elsewhere = [("tasks/0/cpus", json!([1])), ("claims/0/cpu", json!(1))];
        longer(&elsewhere, 59);
        let waits = [("tasks/0/machine/edges", json!([[0, 1, 3, 1], [1, 0, 2, 0]]))];
        longer(&waits, 59);
        let lock = json!([{ "name": "l", "protocol": "ceiling", "users": [[0, 1]] }]);
        longer(&[("locks", lock)], 59);
        let lower = [
            ("tasks/0/priority", json!(0)),
            ("claims/0/ends", json!([17])),
            ("claims/0/response", json!(17)),
        ];
        let lower = [&lower[..], &[("tasks/0/period", json!(20)), ("tasks/0/deadline", json!(20))]].concat();
        longer(&lower, 20 + 17 + 30 + 15);
        assert!(
            changed(&robot, &[("tasks/1/sporadic", json!(true))])
                .contains("`pilot` is not released by a clock")
        );
        let twice = [
            ("tasks/1/burst", json!(2)),
            ("claims/1/ends", json!([15, 28])),
            ("claims/1/response", json!(28)),
        ];
        assert_eq!(changed(&robot, &twice), "`see`: `pilot` is not released by a clock");
        assert_eq!(changed(&robot, &[("chains/0/limit", json!(55))]), "accepted");
        let without = changed(&robot, &[("claims", json!([claim(0, &[4])]))]);
        assert!(without.contains("relies on the response time of `pilot`, which has no claim"), "{without}");
    }

    #[test]
    fn what_is_no_certificate_is_unreadable() {
        for text in ["", "[]", "{}", "{\"version\":1,\"tool\":\"\",\"systems\":[]}"] {
            assert!(matches!(verify(text), Err(RefusedClaim::Unreadable(_))), "{text}");
        }
    }

    #[test]
    fn what_is_not_claimed_is_said() {
        let mut robot = robot();
        let mut tasks = robot["systems"][0]["tasks"].as_array().unwrap().clone();
        for (name, is_activity) in [("irq", false), ("log", true)] {
            let mut other = simple(name, 0, 100, 1);
            (other["is_activity"], other["is_real_time"]) = (json!(is_activity), json!(!is_activity));
            tasks.push(other);
        }
        robot["systems"][0]["tasks"] = json!(tasks);
        robot["systems"][0]["claims"][1]["met"] = json!(false);
        robot["systems"][0]["not_certified"] = json!([["see", "why"]]);
        let found = &verify(&robot.to_string()).unwrap()[0];
        assert_eq!(found.met, ["laser"]);
        let pilot = ("pilot".to_owned(), "not-claimed".to_owned());
        assert_eq!(found.not_certified, [("see".to_owned(), "why".to_owned()), pilot]);
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
            json!([{ "provider": 0, "client": 1, "sends": 0, "time": 0, "calls": 0 }]);
        numbers(&robot, "", &mut all);
        for place in &all {
            for value in [0, 1, 3, u64::MAX / 2, u64::MAX] {
                let mut other = robot.clone();
                *other.pointer_mut(place).unwrap() = json!(value);
                let _ = verify(&other.to_string());
            }
        }
    }

    /// 1,500 users of one lock take no minute.
    #[test]
    fn many_users_of_a_lock_are_checked_at_once() {
        let number = 1500u64;
        let tasks: Vec<Value> = (0..number).map(|it| simple(&format!("t{it}"), it, 1 << 40, 1)).collect();
        let users: Vec<Value> = (0..number).map(|it| json!([it, 1])).collect();
        let mut robot = robot_of(&tasks, &[]);
        for protocol in ["ceiling", "inheritance", "none"] {
            robot["systems"][0]["locks"] = json!([{ "name": "l", "protocol": protocol, "users": users }]);
            let _ = verify(&robot.to_string());
        }
    }
}
