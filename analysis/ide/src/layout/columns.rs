//! Assigns the boxes and the passing lines to columns.

use dagre::graph::{Graph, GraphOptions};
use dagre::layout::types::LabelPos;
use dagre::{EdgeLabel, LayoutOptions, NodeLabel, RankDir};

use super::*;

impl DiagramLayout<'_> {
    /// The rank of each box: greater than those to the left of its lines. There is a rank for labels between two ranks of boxes.
    pub(super) fn ranks(&self) -> Vec<usize> {
        let outgoing = self.lines_by(|(left, _)| left);
        let mut boxes: Vec<usize> = (0..self.diagram.boxes.len()).collect();
        boxes.sort_by_key(|&number| self.order[number]);
        let mut ranks = vec![0; self.diagram.boxes.len()];
        for left in boxes {
            for &line in &outgoing[left] {
                let right = self.ends_of(line).1;
                ranks[right] = ranks[right].max(ranks[left] + 2);
            }
        }
        ranks
    }

    /// The ranks between the ends of a line.
    pub(super) fn span(&self, line: usize, ranks: &[usize]) -> std::ops::Range<usize> {
        let (left, right) = self.ends_of(line);
        ranks[left] + 1..ranks[right]
    }

    /// The content of a column where a line passes, and its height.
    fn content(&self, line: usize, has_label: bool) -> (Content, f64) {
        match self.line(line).label {
            Some((_, height)) if has_label => {
                (Content::Label(line), height + self.spacing.label + self.spacing.line)
            }
            _ => (Content::Line(line), self.spacing.line),
        }
    }

    /// Fills `columns` as `dagre` proposes.
    pub(super) fn assign_by_dagre(&mut self) {
        let mut graph: Graph<NodeLabel, EdgeLabel> =
            Graph::with_options(GraphOptions { directed: true, multigraph: true, compound: false });
        for number in 0..self.diagram.boxes.len() {
            let (width, height) = self.outer_size(number);
            graph.set_node(key(number), Some(NodeLabel { width, height, ..NodeLabel::default() }));
        }
        for &line in &self.lines {
            let (left, right) = self.ends_of(line);
            let (width, height) = match self.line(line).label {
                Some((width, _)) => (width, self.content(line, true).1),
                None => (0.0, 0.0),
            };
            let edge = EdgeLabel { width, height, labelpos: LabelPos::Center, ..EdgeLabel::default() };
            graph.set_edge(key(left), key(right), Some(edge), Some(&key(line)));
        }
        let options = LayoutOptions {
            rankdir: RankDir::LR,
            nodesep: self.spacing.boxes,
            edgesep: self.spacing.lines,
            ranksep: 10.0,
            ..LayoutOptions::default()
        };
        dagre::layout(&mut graph, Some(options));
        // Items by the horizontal position of their middle, which all items of a rank share.
        let mut ranks: BTreeMap<i64, Vec<ColumnItem>> = BTreeMap::new();
        let rank = |x: f64| (x * 8.0).round() as i64;
        let mut rank_of = vec![0; self.diagram.boxes.len()];
        for (number, rank_of) in rank_of.iter_mut().enumerate() {
            let node = graph.node(&key(number));
            let (x, y) = node.and_then(|node| Some((node.x?, node.y?))).unwrap_or_default();
            let (_, height) = self.outer_size(number);
            *rank_of = rank(x);
            let item = ColumnItem { content: Content::Box(number), top: y - height / 2.0, height };
            ranks.entry(rank(x)).or_default().push(item);
        }
        for &line in &self.lines {
            let (left, right) = self.ends_of(line);
            let Some(edge) = graph.edge(&key(left), &key(right), Some(&key(line))) else {
                continue;
            };
            let label_at = edge.x.map(rank);
            for point in &edge.points {
                let at = rank(point.x);
                // The first and the last one are on the borders of the boxes.
                let is_known = ranks
                    .get(&at)
                    .is_some_and(|items| items.iter().any(|it| it.content.line() == Some(line)));
                if at > rank_of[left] && at < rank_of[right] && !is_known {
                    let (content, height) = self.content(line, label_at == Some(at));
                    ranks.entry(at).or_default().push(ColumnItem {
                        content,
                        top: point.y - height / 2.0,
                        height,
                    });
                }
            }
        }
        self.columns = ranks.into_values().collect();
    }

    /// Fills `columns` by rank, each item near those that its lines come from.
    pub(super) fn assign_simply(&mut self, ranks: &[usize]) {
        let mut columns: Vec<Vec<ColumnItem>> =
            vec![Vec::new(); ranks.iter().max().map_or(0, |most| most + 1)];
        for (number, &rank) in ranks.iter().enumerate() {
            let (_, height) = self.outer_size(number);
            columns[rank].push(ColumnItem { content: Content::Box(number), top: 0.0, height });
        }
        for &line in &self.lines {
            let span = self.span(line, ranks);
            for rank in span.clone() {
                let (content, height) = self.content(line, rank == span.start);
                columns[rank].push(ColumnItem { content, top: 0.0, height });
            }
        }
        let (outgoing, incoming) = (self.lines_by(|(left, _)| left), self.lines_by(|(_, right)| right));
        // The last height of each line, from the left.
        let mut height_of: BTreeMap<usize, f64> = BTreeMap::new();
        for items in &mut columns {
            (self.interrupt)();
            for item in items.iter_mut() {
                item.top = match item.content {
                    Content::Line(line) | Content::Label(line) => {
                        height_of.get(&line).copied().unwrap_or_default()
                    }
                    Content::Box(number) => {
                        let lines = incoming[number].iter();
                        let heights: Vec<f64> =
                            lines.filter_map(|line| height_of.get(line).copied()).collect();
                        heights.iter().sum::<f64>() / heights.len().max(1) as f64
                    }
                };
            }
            items.sort_by(|a, b| a.top.total_cmp(&b.top));
            let mut free = 0.0;
            for item in items.iter_mut() {
                item.top = free;
                free += item.height + self.spacing.boxes;
                if let Content::Line(line) | Content::Label(line) = item.content {
                    height_of.insert(line, item.top);
                }
            }
            for item in items.iter() {
                if let Content::Box(number) = item.content {
                    for &line in &outgoing[number] {
                        height_of.insert(line, item.top + item.height / 2.0);
                    }
                }
            }
        }
        self.columns = columns;
    }
}

/// Names of boxes and lines that sort like their numbers.
fn key(number: usize) -> String {
    format!("{number:09}")
}
