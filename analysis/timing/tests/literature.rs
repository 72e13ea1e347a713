//! Equality with `response-time-analysis`, an implementation of analyses that were proved in Coq (Prosa), and with an example of
//! another tool.

use mauve_timing::{
    Bound, Demand, Edge, Lock, LockUser, Method, Options, Order, Protocol, StateMachine, Task, Tasks, Time,
    TraceBound, Utilisation, response_times,
};
use proptest::prelude::*;
use response_time_analysis::arrival::{Periodic, Sporadic};
use response_time_analysis::demand::{RBF, Slice};
use response_time_analysis::fifo;
use response_time_analysis::fixed_priority::fully_nonpreemptive;
use response_time_analysis::fixed_priority::fully_preemptive::dedicated_uniproc_rta;
use response_time_analysis::time::{Duration, Service};
use response_time_analysis::wcet::{Curve, Scalar};

/// For longer windows, that library reports no bound. (In debug builds it is very slow for limits up to 100,000.)
const LIMIT: u64 = 200_000;

fn task(priority: u32, period: u64, machine: StateMachine) -> Task {
    Task::new(priority, Time::from_nanos(period), machine)
}

fn bounds(tasks: &[Task], method: Method) -> Vec<Option<u64>> {
    let analysis = response_times(tasks, &Options { method, is_brief: false }, &|| ());
    let bound = |bound: &Bound| match bound {
        Bound::Response(time) => Some(time.as_nanos()),
        Bound::Unbounded { .. } | Bound::NoBound(_) => None,
        Bound::NotAnalysed { .. } | Bound::Background => panic!("every demand is known"),
    };
    analysis.responses.iter().map(|response| bound(&response.bound)).collect()
}

/// Everything at least as urgent as `tasks[index]`, but for itself.
fn interfering<T: Clone>(tasks: &[Task], index: usize, demands: &[T]) -> Vec<T> {
    (0..tasks.len())
        .filter(|&other| other != index && tasks[other].priority >= tasks[index].priority)
        .map(|other| demands[other].clone())
        .collect()
}

fn periodic(task: &Task) -> Periodic {
    Periodic::new(Duration::from(task.period.unwrap().as_nanos()))
}

fn machines() -> impl Strategy<Value = StateMachine> {
    (1..5u32).prop_flat_map(|states| {
        let first_edges = proptest::collection::vec((0..states, 1..20u64), states as usize);
        let more_edges = proptest::collection::vec((0..states, 0..states, 1..20u64), 0..6);
        (first_edges, more_edges).prop_map(move |(first_edges, more_edges)| {
            let first_edges = (0..).zip(first_edges).map(|(source, (target, cost))| (source, target, cost));
            let edges = first_edges.chain(more_edges).map(|(source, target, cost)| Edge {
                source,
                target,
                cost: Time::from_nanos(cost),
            });
            StateMachine::new(states, edges.collect()).unwrap()
        })
    })
}

fn check_equal(
    tasks: &[Task],
    index: usize,
    found: Option<u64>,
    theirs: Result<Duration, impl std::fmt::Debug>,
) -> Result<(), TestCaseError> {
    let theirs = theirs.ok().map(u64::from);
    if theirs.is_none() && found.is_some() {
        // Very near the full load, windows are longer than the limit. At exactly the full load they may never end; then
        // this crate looks for responses that repeat.
        let load = |task: &Task| match &task.demand {
            Demand::Machine { machine, .. } => (machine.greatest_cycle_mean(), task.period.unwrap()),
            Demand::Unknown => panic!("every demand is known"),
        };
        let all = interfering(tasks, index, tasks);
        let load = Utilisation::new(all.iter().chain([&tasks[index]]).map(load));
        prop_assert!(!load.exceeds_one() && load.as_f64() > 0.998);
        return Ok(());
    }
    prop_assert_eq!(found, theirs);
    Ok(())
}

/// The controller of the examples of MAST (mgharbour/mast): a server that `emergency` and `planning` use for 20 ms at most, and
/// another that `planning` and `status` use for 10. A context switch, before and after each job, takes 0.25 ms.
#[test]
fn tasks_that_share_locks() {
    let us = |time: u64| Time::from_nanos(1000 * time);
    let task = |priority, period: u64, cost: u64| {
        task(priority, 1_000_000 * period, StateMachine::single(us(1000 * cost + 500)))
    };
    let tasks = vec![task(4, 50, 5), task(3, 100, 20), task(2, 150, 40), task(1, 350, 100)];
    let lock = |first: usize, second: usize, held: u64| Lock {
        name: "server".into(),
        protocol: Protocol::Ceiling,
        users: [first, second].map(|task| LockUser { task, held: Some(us(1000 * held)) }).to_vec(),
    };
    let mut set = Tasks::new(tasks);
    let bounds = |set: &Tasks| {
        let options = Options { method: Method::Psm, is_brief: false };
        let found = set.response_times(&options, &|| ()).responses;
        found
            .iter()
            .map(|it| match it.bound {
                Bound::Response(time) => time.as_nanos() / 100_000,
                _ => panic!("{it:?}"),
            })
            .collect::<Vec<u64>>()
    };
    assert_eq!(bounds(&set), [55, 260, 720, 2760]);
    set.locks = vec![lock(0, 2, 20), lock(2, 3, 10)];
    for protocol in [Protocol::Ceiling, Protocol::Inheritance] {
        set.locks.iter_mut().for_each(|lock| lock.protocol = protocol);
        assert_eq!(bounds(&set), [255, 460, 820, 2760], "{protocol:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn classical_tasks(parameters in proptest::collection::vec((0..6u32, 10..300u64, 1..60u64), 1..9)) {
        let tasks: Vec<Task> = parameters
            .iter()
            .map(|&(priority, period, cost)| task(priority, period, StateMachine::single(Time::from_nanos(cost))))
            .collect();
        let demands: Vec<_> = parameters
            .iter()
            .zip(&tasks)
            .map(|(&(_, _, cost), task)| RBF::new(periodic(task), Scalar::new(Service::from(cost))))
            .collect();
        for method in [Method::Classic, Method::Psm] {
            for (index, found) in bounds(&tasks, method).into_iter().enumerate() {
                let others = interfering(&tasks, index, &demands);
                check_equal(&tasks, index, found, dedicated_uniproc_rta(&demands[index], &others, Duration::from(LIMIT)))?;
            }
        }
    }

    #[test]
    fn state_machines(parameters in proptest::collection::vec((0..6u32, 10..100u64, machines()), 1..6)) {
        let tasks: Vec<Task> = parameters
            .iter()
            .map(|(priority, period, machine)| task(*priority, *period, machine.clone()))
            .collect();
        // Their curves are exact up to their length, and windows above that do not count.
        const JOBS: u64 = 3000;
        let demands: Vec<_> = tasks
            .iter()
            .zip(&parameters)
            .map(|(task, (_, _, machine))| {
                let mut bound = TraceBound::new(machine);
                let curve: Vec<Service> =
                    (1..=JOBS).map(|n| Service::from(bound.demand(n).unwrap().as_nanos())).collect();
                RBF::new(periodic(task), Curve::new(curve))
            })
            .collect();
        for (index, found) in bounds(&tasks, Method::Psm).into_iter().enumerate() {
            let others = interfering(&tasks, index, &demands);
            check_equal(&tasks, index, found, dedicated_uniproc_rta(&demands[index], &others, Duration::from(LIMIT)))?;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// Their bound counts from the release, and is that of each task of the queue.
    #[test]
    fn queues(parameters in proptest::collection::vec((10..300u64, 0..60u64, 1..60u64), 1..9)) {
        let queued = |&(period, jitter, cost): &(u64, u64, u64)| Task {
            thread: Some(1),
            order: Order::Fifo,
            jitter: Time::from_nanos(jitter),
            ..task(1, period, StateMachine::single(Time::from_nanos(cost)))
        };
        let tasks: Vec<Task> = parameters.iter().map(queued).collect();
        let demand = |&(period, jitter, cost): &(u64, u64, u64)| {
            let arrivals = Sporadic { min_inter_arrival: Duration::from(period), jitter: Duration::from(jitter) };
            RBF::new(arrivals, Scalar::new(Service::from(cost)))
        };
        let demands: Vec<_> = parameters.iter().map(demand).collect();
        let theirs = fifo::dedicated_uniproc_rta(&Slice::of(&demands), Duration::from(LIMIT)).ok().map(u64::from);
        for method in [Method::Classic, Method::Psm] {
            for (index, found) in bounds(&tasks, method).into_iter().enumerate() {
                match (found, theirs) {
                    // Late jobs of a task need not all be in the queue at once: any order may have a lesser bound.
                    (Some(found), Some(theirs)) if parameters[index].1 > 0 => prop_assert!(found <= theirs + parameters[index].1),
                    _ => check_equal(&tasks, index, found, theirs.map(Duration::from).ok_or(()))?,
                }
            }
        }
    }

    #[test]
    fn jobs_that_are_not_preempted(parameters in proptest::collection::vec((0..6u32, 10..300u64, 1..60u64), 1..9)) {
        let frame = |&(priority, period, cost): &(u32, u64, u64)| {
            let is_not_preempted = true;
            Task { is_not_preempted, ..task(priority, period, StateMachine::single(Time::from_nanos(cost))) }
        };
        let tasks = Tasks::new(parameters.iter().map(frame).collect());
        let demands: Vec<_> = parameters
            .iter()
            .zip(tasks.all())
            .map(|(&(_, _, cost), task)| RBF::new(periodic(task), Scalar::new(Service::from(cost))))
            .collect();
        let found = tasks.response_times(&Options { method: Method::Psm, is_brief: false }, &|| ()).responses;
        for (index, found) in found.iter().enumerate() {
            let (priority, _, cost) = parameters[index];
            let below = parameters.iter().filter(|it| it.0 < priority).map(|it| it.2).max();
            let of = fully_nonpreemptive::TaskUnderAnalysis {
                wcet: Scalar::new(Service::from(cost)),
                arrivals: &periodic(&tasks.all()[index]),
                blocking_bound: Service::from(below.unwrap_or(0)),
            };
            let others = interfering(tasks.all(), index, &demands);
            let theirs = fully_nonpreemptive::dedicated_uniproc_rta(&of, &others, Duration::from(LIMIT));
            let found = match found.bound {
                Bound::Response(time) => Some(time.as_nanos()),
                _ => None,
            };
            check_equal(tasks.all(), index, found, theirs)?;
        }
    }
}
