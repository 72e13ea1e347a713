//! Graphs of numbered nodes: what is reached, and in which order.

/// Which nodes are reached from `start`.
pub(crate) fn reachable(leads_to: &[Vec<usize>], start: usize) -> Vec<bool> {
    let mut reached = vec![false; leads_to.len()];
    let mut open = vec![start];
    while let Some(node) = open.pop() {
        if !std::mem::replace(&mut reached[node], true) {
            open.extend(&leads_to[node]);
        }
    }
    reached
}

/// Of nodes that lead to others: each after all that it leads to, but those that lead to a ring; and which are part of one,
/// or between two.
pub(crate) fn topological_order(leads_to: &[Vec<usize>]) -> (Vec<usize>, Vec<bool>) {
    let mut comes_from = vec![Vec::new(); leads_to.len()];
    for (node, others) in leads_to.iter().enumerate() {
        for &other in others {
            comes_from[other].push(node);
        }
    }
    let order = without_rings(leads_to, &comes_from);
    let mut in_ring = vec![order.len() < leads_to.len(); leads_to.len()];
    // Of what leads to a ring, some only lead to it.
    order.iter().chain(&without_rings(&comes_from, leads_to)).for_each(|&node| in_ring[node] = false);
    (order, in_ring)
}

/// The nodes that no ring can be reached from, each after all that it leads to.
fn without_rings(leads_to: &[Vec<usize>], comes_from: &[Vec<usize>]) -> Vec<usize> {
    let mut left: Vec<usize> = leads_to.iter().map(Vec::len).collect();
    let mut order: Vec<usize> = (0..left.len()).filter(|&node| left[node] == 0).collect();
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        next += 1;
        for &before in &comes_from[node] {
            left[before] -= 1;
            if left[before] == 0 {
                order.push(before);
            }
        }
    }
    order
}
