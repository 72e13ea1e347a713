//! Machines for the tests of this crate, and definitions so plain that they serve as oracles.

use proptest::prelude::*;

use crate::{Edge, StateMachine, Task, Time};

/// A machine from (source, target, cost in nanoseconds).
pub(crate) fn machine(states: u32, edges: &[(u32, u32, u64)]) -> StateMachine {
    let edges =
        edges.iter().map(|&(source, target, cost)| Edge { source, target, cost: Time::from_nanos(cost) });
    StateMachine::new(states, edges.collect()).unwrap()
}

/// A task on CPU 0 whose deadline is its period.
pub(crate) fn task(priority: u32, period: u64, machine: StateMachine) -> Task {
    Task::new(priority, Time::from_nanos(period), machine)
}

/// A [`task`] each of whose jobs executes for `cost`.
pub(crate) fn simple(priority: u32, period: u64, cost: u64) -> Task {
    task(priority, period, StateMachine::single(Time::from_nanos(cost)))
}

/// Lets one thread execute the first tasks of a set, with what the first one has; and releases the last one in bursts.
pub(crate) fn with_thread(mut tasks: Vec<Task>, mates: usize, burst: u64) -> Vec<Task> {
    let first = tasks.first().cloned().unwrap_or_default();
    for task in tasks.iter_mut().take(mates) {
        *task = Task { demand: task.demand.clone(), thread: Some(1), ..first.clone() };
    }
    if let Some(last) = tasks.last_mut().filter(|last| last.thread.is_none()) {
        (last.burst, last.offset) = (burst, None);
    }
    tasks
}

/// Machines of up to `states` states, with costs below `costs`; with one-way parts, parallel edges and self-loops.
pub(crate) fn machines(states: u32, costs: u64) -> impl Strategy<Value = StateMachine> {
    (1..=states).prop_flat_map(move |states| {
        let first_edges = proptest::collection::vec((0..states, 0..costs), states as usize);
        let more_edges = proptest::collection::vec((0..states, 0..states, 0..costs), 0..=states as usize * 2);
        (first_edges, more_edges).prop_map(move |(first_edges, more_edges)| {
            let first_edges = (0..).zip(first_edges).map(|(source, (target, cost))| (source, target, cost));
            machine(states, &first_edges.chain(more_edges).collect::<Vec<_>>())
        })
    })
}

/// The greatest total of `n` consecutive edges from `state`, over all paths one by one.
pub(crate) fn brute_force_demand(machine: &StateMachine, state: u32, n: u64) -> u64 {
    if n == 0 {
        return 0;
    }
    let from_here = machine.edges().iter().filter(|edge| edge.source == state);
    from_here
        .map(|edge| edge.cost.as_nanos() + brute_force_demand(machine, edge.target, n - 1))
        .max()
        .unwrap()
}

/// The greatest mean of all simple cycles, one by one: (cost, length).
pub(crate) fn brute_force_cycle_mean(machine: &StateMachine) -> (u64, u64) {
    fn walk(machine: &StateMachine, path: &mut Vec<u32>, cost: u64, best: &mut Option<(u64, u64)>) {
        let state = path[path.len() - 1];
        for edge in machine.edges().iter().filter(|edge| edge.source == state) {
            let cost = cost + edge.cost.as_nanos();
            if edge.target == path[0] {
                let length = path.len() as u64;
                if best.is_none_or(|(best_cost, best_length)| cost * best_length > best_cost * length) {
                    *best = Some((cost, length));
                }
            } else if !path.contains(&edge.target) {
                path.push(edge.target);
                walk(machine, path, cost, best);
                path.pop();
            }
        }
    }
    let mut best = None;
    for start in 0..machine.states() {
        walk(machine, &mut vec![start], 0, &mut best);
    }
    best.unwrap()
}
