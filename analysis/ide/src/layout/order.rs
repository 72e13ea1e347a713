//! Orders the boxes of a diagram so that most lines go forwards.

use std::collections::BTreeSet;

/// Returns the position of each box in an order that as many lines as possible follow from their source to their target: the
/// heuristic of Eades, Lin and Smyth (A fast and effective heuristic for the feedback arc set problem, 1993).
pub(super) fn order_of(count: usize, lines: &[(usize, usize)]) -> Vec<usize> {
    let (mut sources, mut targets) = (vec![Vec::new(); count], vec![Vec::new(); count]);
    for &(source, target) in lines {
        sources[target].push(source);
        targets[source].push(target);
    }
    // Lines to and from boxes that are left.
    let degrees = |lists: &[Vec<usize>]| lists.iter().map(Vec::len).collect::<Vec<usize>>();
    let (mut incoming, mut outgoing) = (degrees(&sources), degrees(&targets));
    let mut left: BTreeSet<usize> = (0..count).collect();
    let (mut start, mut end) = (Vec::new(), Vec::new());
    while !left.is_empty() {
        let source = left.iter().copied().find(|&number| incoming[number] == 0);
        let sink = left.iter().rev().copied().find(|&number| outgoing[number] == 0);
        let chosen = match (source, sink) {
            (Some(source), _) => source,
            (None, Some(sink)) => sink,
            // The first of those with the most lines out and the fewest in.
            (None, None) => {
                let gain = |&number: &usize| outgoing[number] as isize - incoming[number] as isize;
                left.iter().copied().rev().max_by_key(gain).unwrap_or_default()
            }
        };
        match source.is_none() && sink.is_some() {
            true => end.push(chosen),
            false => start.push(chosen),
        }
        left.remove(&chosen);
        targets[chosen].iter().for_each(|&other| incoming[other] -= 1);
        sources[chosen].iter().for_each(|&other| outgoing[other] -= 1);
    }
    let mut order = vec![0; count];
    for (position, number) in start.into_iter().chain(end.into_iter().rev()).enumerate() {
        order[number] = position;
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_lines_go_back() {
        // A pipeline with one way back, whatever the order of its boxes.
        for first in 0..5 {
            let lines: Vec<(usize, usize)> =
                (0..5).map(|it| ((it + first) % 5, (it + 1 + first) % 5)).collect();
            let order = order_of(5, &lines);
            assert_eq!(lines.iter().filter(|(a, b)| order[*a] > order[*b]).count(), 1, "{order:?}");
        }
        assert_eq!(order_of(3, &[(2, 1), (1, 0)]), [2, 1, 0]);
    }
}
