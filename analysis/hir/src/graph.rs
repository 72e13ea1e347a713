//! Reachability and topological order of graphs.

use std::hash::Hash;

use rustc_hash::FxHashSet;

/// Returns nodes and those reachable from them, in breadth-first order.
pub fn closure<T: Copy + Eq + Hash, I: IntoIterator<Item = T>>(
    starts: impl IntoIterator<Item = T>,
    mut successors: impl FnMut(T) -> I,
) -> Vec<T> {
    let mut seen = FxHashSet::default();
    let mut reached: Vec<T> = starts.into_iter().filter(|&start| seen.insert(start)).collect();
    let mut next = 0;
    while let Some(&node) = reached.get(next) {
        next += 1;
        reached.extend(successors(node).into_iter().filter(|&successor| seen.insert(successor)));
    }
    reached
}

/// Returns, for each node, whether it is reachable from one of these.
pub(crate) fn reachable(successors: &[Vec<usize>], starts: impl IntoIterator<Item = usize>) -> Vec<bool> {
    let mut reached = vec![false; successors.len()];
    closure(starts, |node| successors[node].iter().copied()).into_iter().for_each(|it| reached[it] = true);
    reached
}

/// Returns the successors of each node of a graph with `count` nodes and these edges.
pub(crate) fn successors_by(
    count: usize,
    edges: impl IntoIterator<Item = (usize, usize)>,
) -> Vec<Vec<usize>> {
    let mut successors = vec![Vec::new(); count];
    edges.into_iter().for_each(|(source, target)| successors[source].push(target));
    successors
}

/// Returns the predecessors of each node.
pub(crate) fn predecessors_by(successors: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let edges = successors.iter().enumerate();
    let edges = edges.flat_map(|(node, others)| others.iter().map(move |&other| (other, node)));
    successors_by(successors.len(), edges)
}

/// Returns the nodes that reach no cycle, each after all its successors; and, for each node, whether it is in a cycle or on
/// a path between two cycles.
pub(crate) fn topological_order(successors: &[Vec<usize>]) -> (Vec<usize>, Vec<bool>) {
    let predecessors = predecessors_by(successors);
    let order = without_cycles(successors, &predecessors);
    let mut in_cycle = vec![order.len() < successors.len(); successors.len()];
    // The nodes that no cycle reaches are not in a cycle either.
    order.iter().chain(&without_cycles(&predecessors, successors)).for_each(|&node| in_cycle[node] = false);
    (order, in_cycle)
}

/// Returns the strongly connected components, each after all that it reaches (Tarjan's algorithm).
pub(crate) fn components(successors: &[Vec<usize>]) -> Vec<Vec<usize>> {
    const UNSEEN: usize = usize::MAX;
    let (mut found, mut stack) = (Vec::new(), Vec::new());
    // The position of each node in the order of visits, the least one that it reaches, and whether it is on the stack.
    let mut nodes = vec![(UNSEEN, UNSEEN, false); successors.len()];
    let mut count = 0;
    for root in 0..successors.len() {
        let mut open = if nodes[root].0 == UNSEEN { vec![(root, 0)] } else { Vec::new() };
        while let Some((node, next)) = open.pop() {
            if next == 0 {
                nodes[node] = (count, count, true);
                count += 1;
                stack.push(node);
            } else {
                let before = nodes[successors[node][next - 1]];
                nodes[node].1 = nodes[node].1.min(if before.2 { before.1 } else { UNSEEN });
            }
            if let Some(&other) = successors[node].get(next) {
                open.push((node, next + 1));
                if nodes[other].0 == UNSEEN {
                    open.push((other, 0));
                }
            } else if nodes[node].0 == nodes[node].1 {
                let first = stack.iter().rposition(|it| *it == node).unwrap_or_default();
                let component = stack.split_off(first);
                component.iter().for_each(|it| nodes[*it].2 = false);
                found.push(component);
            }
        }
    }
    found
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
