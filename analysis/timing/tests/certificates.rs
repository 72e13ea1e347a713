//! Certificates of random systems of all kinds: the checker accepts each, and refuses each one with a claim that a change makes false.
//!
//! A change replaces a property of a task, an operation or a lock, or makes a claimed response time less. A claim is false if the analysis
//! of the changed system has a greater response time, or none. B and the numbers of calls, which follow
//! from the rest, are corrected after each change, so that an inequality of the proof must fail.
//!
//! `MAUVE_CERTIFICATES=20000 cargo test --release -p mauve-timing --test main certificates::` tries more systems.

use std::collections::BTreeMap;

use mauve_tests::search;
use mauve_timing::{Bound, Method, Options, SetAnalysis, Status, Tasks};
use mauve_verify::{RefusedClaim, verify};
use serde_json::{Value, json};

use crate::reachability::random::{Random, system_of_any_kind};
use crate::reachability::system::System;

fn systems() -> usize {
    search::cases("MAUVE_CERTIFICATES", 1500)
}

fn analyse(set: &Tasks) -> SetAnalysis {
    set.response_times(&Options { method: Method::Best, is_brief: false }, &|| ())
}

/// The tasks of a system, sometimes with other work and throttling.
fn tasks_of(system: &System, with_platform: bool) -> Tasks {
    let mut set = system.set();
    for (index, task) in set.activities_mut().iter_mut().enumerate() {
        task.name = format!("t{index}").into();
    }
    let (locks, operations) = (set.locks.clone(), set.operations.clone());
    if with_platform {
        let other = mauve_timing::Task { name: "irq".into(), deadline: None, ..set.all()[0].clone() };
        let other = mauve_timing::Task { thread: None, offset: None, waits: None, ..other };
        let machine = mauve_timing::StateMachine::single(mauve_timing::Time::from_nanos(1));
        let demand = mauve_timing::Demand::Machine { machine, whole: None };
        let period = Some(mauve_timing::Time::from_nanos(9));
        let other = mauve_timing::Task { demand, period, ..other };
        set = Tasks::new(set.activities().to_vec()).with_platform(vec![other], false);
    }
    (set.locks, set.operations) = (locks, operations);
    set
}

fn certificate(set: &Tasks) -> Value {
    let best = analyse(set);
    let status = |task: usize| best.responses[task].status(set.all()[task].deadline);
    let mut system = set.certificate(&|task| status(task) == Status::Met, &|| ());
    system.insert("deployment".to_owned(), json!("D"));
    system.insert("significance".to_owned(), json!("1e-4"));
    json!({ "version": 2, "tool": "test", "systems": [system] })
}

fn response(analysis: &SetAnalysis, task: usize) -> Option<u64> {
    match analysis.responses[task].bound {
        Bound::Response(time) => Some(time.as_nanos()),
        _ => None,
    }
}

#[test]
fn certificates_are_accepted() {
    let mut random = Random(1 + (search::seed() << 8));
    let (mut met, mut claims, mut left_out) = (0, 0, BTreeMap::<String, u64>::new());
    for number in 0..systems() {
        let system = system_of_any_kind(&mut random);
        let set = tasks_of(&system, random.one_in(8));
        let certificate = certificate(&set);
        let found = verify(&certificate.to_string());
        let summary = found.unwrap_or_else(|why| panic!("{number}: {why:?}\n{system}\n{certificate:#}"));
        let of = &summary[0];
        met += of.met.len();
        claims += certificate["systems"][0]["claims"].as_array().unwrap().len();
        of.not_certified.iter().for_each(|(_, why)| *left_out.entry(why.clone()).or_default() += 1);
    }
    println!("{} systems: {claims} claims, {met} deadlines met, not certified: {left_out:?}", systems());
    left_out.remove("not-claimed");
    let left_out: u64 = left_out.values().sum();
    assert!(met > systems() && left_out * 5 < met as u64);
}

/// Changes a property, and returns its name.
fn change(system: &mut System, random: &mut Random) -> &'static str {
    let index = random.below(system.tasks.len() as u64) as usize;
    let other = random.below(system.tasks.len() as u64) as usize;
    let more = random.within(1, 3);
    let priority = system.tasks[other].priority;
    let cpus = system.tasks[other].cpus;
    let task = &mut system.tasks[index];
    match random.below(20) {
        0 | 1 => {
            let edge = random.below(task.edges.len() as u64) as usize;
            task.edges[edge].2 += more;
            "time"
        }
        2 => {
            task.period = task.period.saturating_sub(more).max(1);
            "period"
        }
        3 => {
            task.jitter += more;
            "jitter"
        }
        4 => {
            task.priority += more as u32;
            "higher priority"
        }
        5 => {
            task.priority = task.priority.saturating_sub(more as u32);
            "lower priority"
        }
        6 => {
            task.priority = priority;
            "equal priority"
        }
        7 => {
            task.cpus = cpus;
            "CPUs of another"
        }
        8 => {
            task.cpus |= 1 << random.below(2);
            "more CPUs"
        }
        9 => {
            task.burst = Some(task.burst.unwrap_or(1) + 1);
            "burst"
        }
        10 if task.thread.is_some() => {
            task.thread = None;
            "thread"
        }
        13 if task.waits.iter().any(|it| *it > 0) => {
            let wait = random.below(task.waits.len() as u64) as usize;
            task.waits[wait] += more;
            "wait"
        }
        14 if !system.locks.is_empty() => {
            let lock = &mut system.locks[0];
            let user = random.below(lock.users.len() as u64) as usize;
            lock.users[user].1 += more;
            "held"
        }
        15 if !system.locks.is_empty() => {
            system.locks[0].protocol = match random.below(3) {
                0 => mauve_timing::Protocol::None,
                1 => mauve_timing::Protocol::Ceiling,
                _ => mauve_timing::Protocol::Inheritance,
            };
            "protocol"
        }
        16 if !system.operations.is_empty() => {
            system.operations[0].sends += more;
            "sends"
        }
        17 if !system.operations.is_empty() => {
            system.operations[0].time += more;
            "time of an operation"
        }
        18 => {
            task.is_unknown = true;
            "unknown demand"
        }
        _ => {
            task.edges.iter_mut().for_each(|edge| edge.2 += more);
            "all times"
        }
    }
}

/// Corrects what follows from other parts of the certificate, as the refusal says; false if it is of something else.
fn correct(certificate: &mut Value, refusal: &str) -> bool {
    let system = &mut certificate["systems"][0];
    let (of, why) = refusal.split_once(": ").unwrap();
    let numbers: Vec<u64> =
        why.split(|it: char| !it.is_ascii_digit()).filter_map(|it| it.parse().ok()).collect();
    if why.starts_with("calls of ") {
        let (Some(calls), Some(least)) = (numbers.get(2), numbers.get(3)) else { return false };
        let operations = system["operations"].as_array_mut().unwrap();
        let it = operations.iter_mut().find(|it| it["calls"] == *calls).unwrap();
        it["calls"] = json!(least);
        return *least < 1000;
    }
    if why.starts_with("lower priorities block it for") {
        let name = of.split('`').nth(1).unwrap();
        let task = system["tasks"].as_array().unwrap().iter().position(|task| task["name"] == name);
        let claims = system["claims"].as_array_mut().unwrap();
        let claim = claims.iter_mut().find(|claim| claim["task"].as_u64() == task.map(|it| it as u64));
        claim.unwrap()["blocking"] = json!(numbers[0]);
        return true;
    }
    false
}

/// Whether the checker refuses a certificate although its B and its numbers of calls are right.
fn is_refused(mut certificate: Value) -> Result<String, Value> {
    for _ in 0..200 {
        match verify(&certificate.to_string()) {
            Ok(_) => return Err(certificate),
            Err(RefusedClaim::False(why)) if correct(&mut certificate, &why) => {}
            Err(RefusedClaim::False(why)) => {
                let why = why.split_once(": ").unwrap().1;
                let words = why.split(|it: char| it.is_ascii_digit()).next().unwrap_or_default();
                return Ok(words.split('`').next().unwrap_or_default().to_owned());
            }
            Err(RefusedClaim::Unreadable(why)) => return Ok(format!("UNREADABLE {why}")),
        }
    }
    Ok("endless".to_owned())
}

#[test]
fn false_certificates_are_refused() {
    let mut random = Random(2 + (search::seed() << 8));
    let (mut found, mut by_change, mut reasons) =
        (0, BTreeMap::<&str, u64>::new(), BTreeMap::<String, u64>::new());
    while found < systems() {
        let system = system_of_any_kind(&mut random);
        let with_platform = random.one_in(8);
        let before = certificate(&tasks_of(&system, with_platform));
        let claims = before["systems"][0]["claims"].as_array().unwrap().clone();
        let mut changed = system.clone();
        let mut certified = before.clone();
        let (name, set) = if random.one_in(6) && !claims.is_empty() {
            let claim = random.below(claims.len() as u64) as usize;
            let response = claims[claim]["response"].as_u64().unwrap();
            let less = random.within(1, 2).min(response);
            certified["systems"][0]["claims"][claim]["response"] = json!(response - less);
            ("response", tasks_of(&system, with_platform))
        } else {
            let name = change(&mut changed, &mut random);
            let set = tasks_of(&changed, with_platform);
            certified = certificate(&set);
            certified["systems"][0]["claims"] = json!(claims);
            certified["systems"][0]["not_certified"] = json!([]);
            for (to, from) in certified["systems"][0]["operations"]
                .as_array_mut()
                .unwrap()
                .iter_mut()
                .zip(before["systems"][0]["operations"].as_array().unwrap())
            {
                to["calls"] = from["calls"].clone();
            }
            (name, set)
        };
        let after = analyse(&set);
        let is_false = |claim: &Value| {
            let task = claim["task"].as_u64().unwrap() as usize;
            let greatest = response(&after, task);
            // Beside a task of unknown demand, what is late is not analysed; and where its budget is exhausted, the analysis
            // may be above what a short proof shows.
            let response_of = &after.responses[task];
            let is_unsure = response_of.is_exhausted && greatest.is_some()
                || matches!(response_of.bound, Bound::NotAnalysed { .. }) && claim["met"] == false;
            !is_unsure && greatest.is_none_or(|greatest| greatest > claim["response"].as_u64().unwrap())
        };
        if !certified["systems"][0]["claims"].as_array().unwrap().iter().any(is_false) {
            continue;
        }
        found += 1;
        *by_change.entry(name).or_default() += 1;
        match is_refused(certified) {
            Ok(why) => *reasons.entry(why).or_default() += 1,
            Err(accepted) => {
                let bounds: Vec<_> = (0..set.all().len()).map(|it| response(&after, it)).collect();
                panic!(
                    "accepted after a change of {name}; bounds {bounds:?}\n{system}\n{changed}\n{accepted:#}"
                )
            }
        }
    }
    println!("{found} false certificates by change: {by_change:#?}\nrefused because: {reasons:#?}");
}
