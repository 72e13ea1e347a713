//! Orders the boxes of a diagram so that most lines go forwards.

use std::cmp::Reverse;
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
    let gain = |incoming: usize, outgoing: usize| outgoing as isize - incoming as isize;
    let free = |degrees: &[usize]| (0..count).filter(|&it| degrees[it] == 0).collect::<BTreeSet<usize>>();
    let (mut first, mut last) = (free(&incoming), free(&outgoing));
    // By the lines out less the lines in.
    let mut left: BTreeSet<(isize, Reverse<usize>)> =
        (0..count).map(|it| (gain(incoming[it], outgoing[it]), Reverse(it))).collect();
    let (mut start, mut end) = (Vec::new(), Vec::new());
    while let Some(&(_, Reverse(most))) = left.last() {
        let (source, sink) = (first.first().copied(), last.last().copied());
        // Without a source and a sink, the first of those with the most lines out and the fewest in.
        let chosen = source.or(sink).unwrap_or(most);
        match source.is_none() && sink.is_some() {
            true => end.push(chosen),
            false => start.push(chosen),
        }
        first.remove(&chosen);
        last.remove(&chosen);
        left.remove(&(gain(incoming[chosen], outgoing[chosen]), Reverse(chosen)));
        let ways = [(&targets, true), (&sources, false)];
        for (&other, is_target) in ways.iter().flat_map(|(of, is)| of[chosen].iter().map(move |it| (it, *is)))
        {
            let is_left = left.remove(&(gain(incoming[other], outgoing[other]), Reverse(other)));
            let (degrees, free) =
                if is_target { (&mut incoming, &mut first) } else { (&mut outgoing, &mut last) };
            degrees[other] -= 1;
            if is_left && degrees[other] == 0 {
                free.insert(other);
            }
            if is_left {
                left.insert((gain(incoming[other], outgoing[other]), Reverse(other)));
            }
        }
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
