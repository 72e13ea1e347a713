//! Decides where lines turn between two columns.

use std::collections::BinaryHeap;

use super::*;

/// More lines than this between two columns are not ordered.
const MANY_TURNS: usize = 300;

/// Lines that share a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum NetKey {
    Port((usize, usize), BoxSide),
    Line(usize),
}

/// Lines that turn at the same horizontal position.
#[derive(Debug, Clone, Default)]
struct Net {
    lines: Vec<usize>,
    /// Where they come from on the left, and where they go to on the right.
    left: Vec<f64>,
    right: Vec<f64>,
}

impl Net {
    fn span(&self) -> (f64, f64) {
        let all = || self.left.iter().chain(&self.right).copied();
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max))
    }

    /// How much is to be said against `self` to the left of `other`: crossings, and lines on top of each other.
    fn cost_before(&self, other: &Net) -> usize {
        let crosses =
            |ys: &[f64], (top, bottom): (f64, f64)| ys.iter().filter(|&&y| y > top && y < bottom).count();
        let same =
            self.right.iter().flat_map(|a| other.left.iter().filter(move |&b| (a - b).abs() < 1.0)).count();
        crosses(&self.right, other.span()) + crosses(&other.left, self.span()) + 1000 * same
    }
}

/// The space between two columns.
#[derive(Debug, Clone)]
pub(super) struct ColumnGap {
    /// The turn of each line, from the left.
    turns: BTreeMap<usize, usize>,
    count: usize,
}

impl ColumnGap {
    fn new(mut nets: Vec<Net>, spacing: Spacing) -> ColumnGap {
        nets.sort_by(|a, b| a.span().0.total_cmp(&b.span().0));
        let is_ordered_well = nets.iter().map(|net| net.lines.len()).sum::<usize>() <= MANY_TURNS;
        for _ in 0..if is_ordered_well { nets.len() } else { 0 } {
            let mut is_ordered = true;
            for index in 1..nets.len() {
                if let [a, b] = &nets[index - 1..=index]
                    && b.cost_before(a) < a.cost_before(b)
                {
                    nets.swap(index - 1, index);
                    is_ordered = false;
                }
            }
            if is_ordered {
                break;
            }
        }
        // Nets that are apart vertically share a turn.
        let mut placed: Vec<((f64, f64), usize)> = Vec::new();
        // From the top, those that end above a net are above all that follow.
        let mut near: BinaryHeap<(usize, usize)> = BinaryHeap::new();
        let mut turns = BTreeMap::new();
        for (index, net) in nets.iter().enumerate() {
            let (top, bottom) = net.span();
            let is_near = |&&((a, b), _): &&((f64, f64), usize)| {
                top <= b + spacing.lines && bottom + spacing.lines >= a
            };
            let last = if is_ordered_well {
                placed.iter().filter(is_near).map(|(_, turn)| *turn).max()
            } else {
                while near.peek().is_some_and(|(_, above)| !is_near(&&placed[*above])) {
                    near.pop();
                }
                near.peek().map(|(turn, _)| *turn)
            };
            let turn = last.map_or(0, |turn| turn + 1);
            near.push((turn, index));
            placed.push(((top, bottom), turn));
            turns.extend(net.lines.iter().map(|&line| (line, turn)));
        }
        let count = placed.iter().map(|(_, turn)| turn + 1).max().unwrap_or_default();
        ColumnGap { turns, count }
    }

    pub(super) fn turn_of(&self, line: usize) -> Option<usize> {
        self.turns.get(&line).copied()
    }

    pub(super) fn width(&self, spacing: Spacing) -> f64 {
        2.0 * spacing.ends + self.count.saturating_sub(1) as f64 * spacing.turns
    }
}

impl DiagramLayout<'_> {
    /// Decides where lines turn between each column and the next.
    pub(super) fn gaps(&self, stops: &[Vec<LineStop>]) -> Vec<ColumnGap> {
        let mut all: Vec<BTreeMap<NetKey, Net>> = vec![BTreeMap::new(); self.columns.len().saturating_sub(1)];
        for (&line, stops) in self.lines.iter().zip(stops) {
            (self.interrupt)();
            let ends = self.line(line);
            let (side, _) = self.sides(ends);
            for (from, to) in stops.iter().zip(stops.iter().skip(1)) {
                // Lines from one port share their turn next to it.
                let at_source = match side {
                    BoxSide::Right => stops.first().is_some_and(|first| first.column == from.column),
                    BoxSide::Left => stops.last().is_some_and(|last| last.column == to.column),
                };
                let key = if at_source { NetKey::Port(ends.source, side) } else { NetKey::Line(line) };
                let Some(nets) = to.column.checked_sub(1).and_then(|gap| all.get_mut(gap)) else { continue };
                let net = nets.entry(key).or_default();
                net.lines.push(line);
                net.left.push(from.y);
                net.right.push(to.y);
            }
        }
        let gap = |nets: BTreeMap<NetKey, Net>| {
            (self.interrupt)();
            ColumnGap::new(
                nets.into_values().filter(|net| net.span().0 < net.span().1).collect(),
                self.spacing,
            )
        };
        all.into_iter().map(gap).collect()
    }
}
