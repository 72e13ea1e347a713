//! Reachability and topological order of graphs.

use std::hash::Hash;

use rustc_hash::FxHashSet;

/// Returns `start` and the nodes reachable from it, in breadth-first order.
pub(crate) fn closure<T: Copy + Eq + Hash, I: IntoIterator<Item = T>>(
    start: T,
    mut successors: impl FnMut(T) -> I,
) -> Vec<T> {
    let mut reached = vec![start];
    let mut seen = FxHashSet::from_iter([start]);
    let mut next = 0;
    while let Some(&node) = reached.get(next) {
        next += 1;
        reached.extend(successors(node).into_iter().filter(|&successor| seen.insert(successor)));
    }
    reached
}

/// Returns, for each node, whether it is reachable from `start`.
pub(crate) fn reachable(successors: &[Vec<usize>], start: usize) -> Vec<bool> {
    let mut reached = vec![false; successors.len()];
    closure(start, |node| successors[node].iter().copied()).into_iter().for_each(|node| reached[node] = true);
    reached
}

/// Returns the nodes that reach no cycle, each after all its successors; and, for each node, whether it is in a cycle or on
/// a path between two cycles.
pub(crate) fn topological_order(successors: &[Vec<usize>]) -> (Vec<usize>, Vec<bool>) {
    let mut predecessors = vec![Vec::new(); successors.len()];
    for (node, others) in successors.iter().enumerate() {
        for &other in others {
            predecessors[other].push(node);
        }
    }
    let order = without_cycles(successors, &predecessors);
    let mut in_cycle = vec![order.len() < successors.len(); successors.len()];
    // The nodes that no cycle reaches are not in a cycle either.
    order.iter().chain(&without_cycles(&predecessors, successors)).for_each(|&node| in_cycle[node] = false);
    (order, in_cycle)
}

/// Returns the nodes that reach no cycle, each after all its successors (Kahn's algorithm).
fn without_cycles(successors: &[Vec<usize>], predecessors: &[Vec<usize>]) -> Vec<usize> {
    let mut remaining: Vec<usize> = successors.iter().map(Vec::len).collect();
    let mut order: Vec<usize> = (0..remaining.len()).filter(|&node| remaining[node] == 0).collect();
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        next += 1;
        for &predecessor in &predecessors[node] {
            remaining[predecessor] -= 1;
            if remaining[predecessor] == 0 {
                order.push(predecessor);
            }
        }
    }
    order
}
