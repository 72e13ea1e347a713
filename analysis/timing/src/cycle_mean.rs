//! λ, the greatest mean cost of a cycle of a periodic state machine, in integers.

use crate::Time;

/// The edges by their source, in one array: those of state s are `first[s]..first[s + 1]`.
pub(crate) struct Adjacency {
    pub(crate) first: Vec<u32>,
    /// The target, and the cost in nanoseconds.
    pub(crate) arcs: Vec<(u32, u64)>,
}

impl Adjacency {
    pub(crate) fn states(&self) -> usize {
        self.first.len() - 1
    }

    /// The arcs of `state`, in the order of the machine's edges.
    pub(crate) fn of(&self, state: usize) -> &[(u32, u64)] {
        &self.arcs[self.first[state] as usize..self.first[state + 1] as usize]
    }
}

/// A greatest cycle: its mean, `cost` / `length`, is λ.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct CycleMean {
    /// The total cost of the cycle.
    pub cost: Time,
    /// The number of edges, and so of periods; at least 1.
    pub length: u64,
}

/// The successor of a state on the path that gave its potential; `NONE` for a state that has kept its initial one.
const NONE: u32 = u32::MAX;

/// The greatest cycle of a machine in which every state has an edge.
///
/// K/L is a candidate: the mean of an existing cycle. Potentials v with v\[s\] ≥ L·cost − K + v\[t\] on every edge
/// (s, t) prove that no cycle has a greater mean (add the inequalities along the cycle). The algorithm searches for
/// them by raising v\[s\] as in Bellman–Ford. If there is a greater cycle, they do not exist, and after at most as
/// many passes as there are states, a cycle appears in the graph of the edges that raised a potential last: a cycle
/// in that graph is always greater than K/L. It becomes the candidate. Each candidate is greater than the one before,
/// so the search ends; the first candidate, from the greatest edge of each state, is usually close.
///
/// i128 suffices: costs times states fit 64 bits (checked when a machine is made), L and the number of edges of a
/// path fit 24 each.
///
/// There is no counted budget: whether a CPU is overloaded is always known. `interrupt` is called once a pass over the
/// edges.
pub(crate) fn greatest(successors: &Adjacency, interrupt: &dyn Fn()) -> CycleMean {
    let states = successors.states();
    let mut policy = Policy::greedy(successors);
    let mut potential = vec![0i128; states];
    let mut best = policy.trace().unwrap_or(MeanCycle { cost: 0, length: 1, root: 0 });
    loop {
        let (length, cost) = (i128::from(best.length), i128::from(best.cost));
        // Potentials that make every edge of the policy tight, except where a lesser cycle of it closes.
        for cycle in &policy.cycles {
            potential[cycle.root as usize] = 0;
            if cycle.is_less_than(&best) {
                policy.next[cycle.root as usize] = NONE;
            }
        }
        for &state in &policy.order {
            let (next, edge_cost) = (policy.next[state as usize], policy.cost[state as usize]);
            potential[state as usize] = length * i128::from(edge_cost) - cost + potential[next as usize];
        }
        best = loop {
            interrupt();
            let mut has_changed = false;
            for state in 0..states {
                let mut greatest = potential[state];
                for &(target, edge_cost) in successors.of(state) {
                    let through = length * i128::from(edge_cost) - cost + potential[target as usize];
                    if through > greatest {
                        greatest = through;
                        policy.next[state] = target;
                        policy.cost[state] = edge_cost;
                    }
                }
                has_changed |= greatest > potential[state];
                potential[state] = greatest;
            }
            if !has_changed {
                return CycleMean { cost: Time::from_nanos(best.cost), length: best.length };
            }
            if let Some(cycle) = policy.trace().filter(|cycle| best.is_less_than(cycle)) {
                break cycle;
            }
            // In the order of the policy, a raised potential propagates along all edges in one pass.
            for &state in &policy.order {
                let (next, edge_cost) = (policy.next[state as usize], policy.cost[state as usize]);
                let through = length * i128::from(edge_cost) - cost + potential[next as usize];
                potential[state as usize] = potential[state as usize].max(through);
            }
        };
    }
}

/// One edge out of each state, and so a cycle that each state runs into (or a state without its edge).
struct Policy {
    next: Vec<u32>,
    cost: Vec<u64>,
    /// The states whose potential depends on that of the next state, each after its next state.
    order: Vec<u32>,
    cycles: Vec<MeanCycle>,
    /// The walk of [`trace`](Self::trace) that met the state, from 1; 0 before one does.
    walk: Vec<u32>,
    path: Vec<u32>,
}

#[derive(Clone, Copy)]
struct MeanCycle {
    cost: u64,
    length: u64,
    /// The state of the cycle that is not in [`Policy::order`].
    root: u32,
}

impl MeanCycle {
    fn is_less_than(&self, other: &MeanCycle) -> bool {
        u128::from(self.cost) * u128::from(other.length) < u128::from(other.cost) * u128::from(self.length)
    }
}

impl Policy {
    /// The greatest edge of each state.
    fn greedy(successors: &Adjacency) -> Policy {
        let states = successors.states();
        let mut policy = Policy {
            next: Vec::with_capacity(states),
            cost: Vec::with_capacity(states),
            order: Vec::with_capacity(states),
            cycles: Vec::new(),
            walk: vec![0; states],
            path: Vec::with_capacity(states),
        };
        for state in 0..states {
            let mut greatest = (NONE, 0);
            for &(target, cost) in successors.of(state) {
                if greatest.0 == NONE || cost > greatest.1 {
                    greatest = (target, cost);
                }
            }
            policy.next.push(greatest.0);
            policy.cost.push(greatest.1);
        }
        policy
    }

    /// Finds the cycles and the order, and returns the greatest cycle, if there is one.
    fn trace(&mut self) -> Option<MeanCycle> {
        self.order.clear();
        self.cycles.clear();
        self.walk.fill(0);
        let mut greatest: Option<MeanCycle> = None;
        for start in 0..self.next.len() as u32 {
            if self.walk[start as usize] != 0 {
                continue;
            }
            self.path.clear();
            let mut state = start;
            // A root is a state of a cycle, or one without an edge.
            let root = loop {
                self.walk[state as usize] = start + 1;
                self.path.push(state);
                let next = self.next[state as usize];
                if next == NONE {
                    break Some(state);
                }
                match self.walk[next as usize] {
                    0 => state = next,
                    walk if walk == start + 1 => {
                        let cycle = self.cycle_through(next);
                        self.cycles.push(cycle);
                        if greatest.is_none_or(|greatest| greatest.is_less_than(&cycle)) {
                            greatest = Some(cycle);
                        }
                        break Some(next);
                    }
                    _ => break None,
                }
            };
            self.order.extend(self.path.iter().rev().copied().filter(|&state| Some(state) != root));
        }
        greatest
    }

    fn cycle_through(&self, root: u32) -> MeanCycle {
        let mut cycle = MeanCycle { cost: self.cost[root as usize], length: 1, root };
        let mut state = self.next[root as usize];
        while state != root {
            cycle.cost += self.cost[state as usize];
            cycle.length += 1;
            state = self.next[state as usize];
        }
        cycle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::StateMachine;
    use crate::testing::{brute_force_cycle_mean, machine, machines};
    use proptest::prelude::*;

    fn check(machine: &StateMachine, cost: u64, length: u64) {
        let mean = machine.greatest_cycle_mean();
        assert_eq!(
            u128::from(mean.cost.as_nanos()) * u128::from(length),
            u128::from(cost) * u128::from(mean.length)
        );
    }

    #[test]
    fn a_greatest_edge_that_cannot_repeat() {
        check(&machine(2, &[(0, 0, 1), (0, 1, 9), (1, 0, 2)]), 11, 2);
    }

    #[test]
    fn the_greedy_cycle_is_not_the_greatest() {
        // From 0 the edge of cost 9 leads to a state that cannot be left.
        check(&machine(3, &[(0, 1, 9), (1, 1, 1), (0, 2, 8), (2, 0, 8)]), 8, 1);
    }

    #[test]
    fn two_parts_of_which_neither_reaches_the_other() {
        check(&machine(4, &[(0, 1, 9), (1, 0, 2), (2, 3, 4), (3, 2, 8)]), 12, 2);
    }

    #[test]
    fn greatest_costs_do_not_overflow() {
        check(&StateMachine::single(Time::from_nanos(u64::MAX)), u64::MAX, 1);
        check(&machine(2, &[(0, 1, u64::MAX / 2), (1, 0, u64::MAX / 2)]), u64::MAX / 2, 1);
        check(&machine(2, &[(0, 1, 0), (1, 0, 0)]), 0, 1);
    }

    #[test]
    fn the_most_expensive_parallel_edge_counts() {
        check(&machine(1, &[(0, 0, 3), (0, 0, 7), (0, 0, 5)]), 7, 1);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]
        #[test]
        fn equals_the_greatest_of_all_cycles(machine in machines(6, 12)) {
            let (cost, length) = brute_force_cycle_mean(&machine);
            check(&machine, cost, length);
        }
    }
}
