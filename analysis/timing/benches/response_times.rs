//! How long the analysis of random systems takes: tasks × states, and classical tasks beside another implementation.

#![allow(clippy::unwrap_used)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use mauve_timing::{
    Analysis, Bound, Demand, Edge, Method, Options, Priority, StateMachine, Status, Task, Time,
    response_times,
};
use response_time_analysis::arrival::Periodic;
use response_time_analysis::demand::RBF;
use response_time_analysis::fixed_priority::fully_preemptive::dedicated_uniproc_rta;
use response_time_analysis::time as their;
use response_time_analysis::wcet::Scalar;

const UTILISATION: f64 = 0.8;

#[derive(Clone, Copy)]
enum Periods {
    /// From 10 to 1000 ms.
    LogUniform,
    /// 10, 20, 50, 100 or 1000 ms.
    OfRobots,
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A ring, as many self-loops and as many chords, with costs of a spread from 1:1 to 1:100, such that λ = `mean` ns.
fn machine(random: &mut Random, states: u32, mean: f64) -> StateMachine {
    let spread = 100f64.powf(random.unit());
    let cost = |random: &mut Random| 1e6 * (1.0 + (spread - 1.0) * random.unit());
    let mut edges = Vec::new();
    for state in 0..states {
        let chord = random.below(u64::from(states)) as u32;
        for target in [(state + 1) % states, state, chord] {
            edges.push((state, target, cost(random)));
        }
    }
    let scaled = |factor: f64| {
        let edge = |&(source, target, cost): &(u32, u32, f64)| Edge {
            source,
            target,
            cost: Time::from_nanos((cost * factor) as u64),
        };
        StateMachine::new(states, edges.iter().map(edge).collect()).unwrap()
    };
    let unscaled = scaled(1.0).greatest_cycle_mean();
    scaled(mean / (unscaled.cost.as_nanos() as f64 / unscaled.length as f64))
}

/// Tasks with rate-monotonic priorities; their utilisations are drawn by UUniFast.
fn system(seed: u64, tasks: usize, states: u32, periods: Periods) -> Vec<Task> {
    let mut random = Random(seed);
    let mut rest = UTILISATION;
    let mut system = Vec::new();
    for index in 0..tasks {
        let others = (tasks - index - 1) as f64;
        let after = if others > 0.0 { rest * random.unit().powf(1.0 / others) } else { 0.0 };
        let utilisation = rest - after;
        rest = after;
        let period = match periods {
            Periods::LogUniform => (1e7 * 100f64.powf(random.unit())) as u64,
            Periods::OfRobots => [10, 20, 50, 100, 1000][random.below(5) as usize] * 1_000_000,
        };
        let machine = match states {
            1 => StateMachine::single(Time::from_nanos((utilisation * period as f64) as u64)),
            _ => machine(&mut random, states, utilisation * period as f64),
        };
        system.push(Task::new(0, Time::from_nanos(period), machine));
    }
    let mut by_period: Vec<usize> = (0..tasks).collect();
    by_period.sort_by_key(|&task| std::cmp::Reverse(system[task].period));
    for (priority, task) in by_period.into_iter().enumerate() {
        system[task].priority = Priority::RealTime(priority as u32);
    }
    system
}

fn analyse(tasks: &[Task], method: Method) -> Analysis {
    response_times(tasks, &Options { method, is_brief: false }, &|| ())
}

fn describe(name: &str, tasks: &[Task], method: Method) {
    let analysis = analyse(tasks, method);
    let count = |status| {
        let pairs = analysis.responses.iter().zip(tasks);
        pairs.filter(|(response, task)| response.status(task.deadline) == status).count()
    };
    let exhausted = analysis.responses.iter().filter(|response| response.is_exhausted).count();
    println!(
        "{name}, {method}: {} met, {} missed of {}; the budget of {exhausted} exhausted",
        count(Status::Met),
        count(Status::Missed),
        tasks.len()
    );
}

fn state_machines(criterion: &mut Criterion) {
    for method in [Method::Psm, Method::Ibf, Method::Exact] {
        by_method(criterion, method);
    }
}

fn by_method(criterion: &mut Criterion, method: Method) {
    let mut group = criterion.benchmark_group(method.to_string());
    group.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2)).sample_size(20);
    for (name, periods) in [("log-uniform", Periods::LogUniform), ("robot", Periods::OfRobots)] {
        for (tasks, states) in [(10, 20), (100, 20), (100, 100), (1000, 20), (1000, 100)] {
            let system = system(1, tasks, states, periods);
            let size = format!("{tasks}x{states}");
            describe(&format!("{size} {name}"), &system, method);
            let id = BenchmarkId::new(size, name);
            group.bench_function(id, |bencher| bencher.iter(|| analyse(black_box(&system), method)));
        }
    }
    group.finish();
}

fn classical(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("classical 1000");
    group.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2)).sample_size(10);
    for (name, periods) in [("log-uniform", Periods::LogUniform), ("robot", Periods::OfRobots)] {
        let mut tasks = system(2, 1000, 1, periods);
        tasks.sort_by_key(|task| std::cmp::Reverse(task.priority));
        let demands: Vec<RBF<Periodic, Scalar>> = tasks
            .iter()
            .map(|task| {
                let Demand::Machine { machine, .. } = &task.demand else { unreachable!() };
                let cost = their::Service::from(machine.greatest_cost().as_nanos());
                RBF::new(
                    Periodic::new(their::Duration::from(task.period.unwrap().as_nanos())),
                    Scalar::new(cost),
                )
            })
            .collect();
        let theirs = || -> Vec<Option<u64>> {
            let limit = their::Duration::from(10_000_000_000_000);
            (0..tasks.len())
                .map(|task| {
                    dedicated_uniproc_rta(&demands[task], &demands[..task], limit).ok().map(u64::from)
                })
                .collect()
        };
        let ours: Vec<Option<u64>> = analyse(&tasks, Method::Psm)
            .responses
            .iter()
            .map(|response| match response.bound {
                Bound::Response(time) => Some(time.as_nanos()),
                _ => None,
            })
            .collect();
        assert_eq!(ours, theirs());
        describe(name, &tasks, Method::Psm);
        group.bench_function(BenchmarkId::new("this crate", name), |bencher| {
            bencher.iter(|| analyse(black_box(&tasks), Method::Psm));
        });
        group.bench_function(BenchmarkId::new("response-time-analysis", name), |bencher| {
            bencher.iter(theirs);
        });
    }
    group.finish();
}

fn cycle_means(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("greatest cycle mean");
    group.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(1)).sample_size(20);
    for states in [20, 100] {
        let mut random = Random(3);
        let machines: Vec<StateMachine> = (0..100).map(|_| machine(&mut random, states, 1e6)).collect();
        group.bench_function(format!("100 machines of {states} states"), |bencher| {
            bencher.iter(|| machines.iter().map(|machine| machine.greatest_cycle_mean().length).sum::<u64>());
        });
    }
    group.finish();
}

#[allow(missing_docs)] // Made by the macro.
mod benches {
    use super::*;
    criterion_group!(all, state_machines, classical, cycle_means);
}

criterion_main!(benches::all);
