//! Places the boxes and the lines of a drawing: boxes in columns, lines from left to right, with right angles.
//!
//! The crate `dagre` assigns boxes to columns and orders them so that few lines cross. This module makes positions of that which
//! hold for each diagram, whatever `dagre` returns:
//!
//! - boxes and labels do not overlap: each column is a list of items with gaps between them;
//! - no line crosses a box or a label: inside a column, each line is horizontal and is an item of its own. Lines turn only
//!   between columns, where there are neither boxes nor labels;
//! - each line ends at a slot: a place on the left or right side of a box.
//!
//! All sizes and positions are in one unit: pixels for SVG, cells of characters for text. The result depends on nothing but the
//! arguments.

mod columns;
mod order;
mod turns;

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use order::order_of;
use rustc_hash::FxHashMap;
use turns::ColumnGap;

/// A diagram without positions.
#[derive(Debug, Clone, Default)]
pub(crate) struct Diagram {
    pub(crate) boxes: Vec<BoxSize>,
    pub(crate) lines: Vec<LineEnds>,
}

/// The content of a box.
#[derive(Debug, Clone, Default)]
pub(crate) struct BoxSize {
    pub(crate) width: f64,
    /// The least height.
    pub(crate) height: f64,
    /// The height above the first slot. If left out, the slots are in the middle of the sides.
    pub(crate) head: Option<f64>,
    /// The height of a slot.
    pub(crate) row: f64,
    /// The height below the slots.
    pub(crate) foot: f64,
    /// The ports: the ends of lines. A port without a line has a slot if it has a side.
    pub(crate) ports: Vec<Option<BoxSide>>,
}

/// A side of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum BoxSide {
    Left,
    Right,
}

/// A line between two ports.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LineEnds {
    /// The box and the port.
    pub(crate) source: (usize, usize),
    /// The box and the port.
    pub(crate) target: (usize, usize),
    /// The width and the height of its label.
    pub(crate) label: Option<(f64, f64)>,
}

/// The distances of a drawing.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spacing {
    /// Between a box and the next one in its column.
    pub(crate) boxes: f64,
    /// Between a line and its neighbour in a column.
    pub(crate) lines: f64,
    /// Between two lines that turn between the same columns.
    pub(crate) turns: f64,
    /// Between a box and the first turn of a line.
    pub(crate) ends: f64,
    /// Between a label and its line.
    pub(crate) label: f64,
    /// Around the drawing.
    pub(crate) margin: f64,
    /// Above that.
    pub(crate) top: f64,
    /// The thickness of a line: 1 in cells, 0 in pixels.
    pub(crate) line: f64,
}

/// The distances of drawings in pixels, below a title.
pub(crate) const PIXELS: Spacing = Spacing {
    boxes: 26.0,
    lines: 12.0,
    turns: 9.0,
    ends: 18.0,
    label: 4.0,
    margin: 24.0,
    top: 28.0,
    line: 0.0,
};

/// The distances of drawings in characters.
pub(crate) const CELLS: Spacing =
    Spacing { boxes: 1.0, lines: 1.0, turns: 2.0, ends: 3.0, label: 0.0, margin: 0.0, top: 0.0, line: 1.0 };

/// A diagram with positions. No position is negative.
#[derive(Debug, Clone, Default)]
pub(crate) struct Placement {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) boxes: Vec<PlacedBox>,
    pub(crate) lines: Vec<PlacedLine>,
}

/// A box with its position.
#[derive(Debug, Clone, Default)]
pub(crate) struct PlacedBox {
    /// The left, the top, the width and the height.
    pub(crate) area: Area,
    /// From the top.
    pub(crate) slots: Vec<PortSlot>,
}

/// A rectangle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Area {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl From<Area> for [f64; 4] {
    fn from(Area { x, y, width, height }: Area) -> [f64; 4] {
        [x, y, width, height]
    }
}

/// The place of a port. A port has two if it has lines to both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PortSlot {
    pub(crate) port: usize,
    pub(crate) side: BoxSide,
    pub(crate) y: f64,
    pub(crate) has_line: bool,
}

/// A line with its positions.
#[derive(Debug, Clone, Default)]
pub(crate) struct PlacedLine {
    /// From the source to the target; each is above, below, left or right of the one before.
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) label: Option<Area>,
}

/// With more boxes and places where lines pass a column, `dagre` takes too long for an editor: its time grows with the square. Such a
/// diagram is drawn in a simpler way, with more crossings.
const MANY_ITEMS: usize = 600;

/// A diagram with more boxes and places where lines pass a column is not drawn: no one can read it, and editors freeze on its picture.
const MOST_ITEMS: usize = 60_000;

/// Places a diagram; nothing if it is too large. Lines whose boxes or ports do not exist have no points. Calls `interrupt` often,
/// which may unwind.
pub(crate) fn place(diagram: &Diagram, spacing: Spacing, interrupt: &dyn Fn()) -> Option<Placement> {
    let exists =
        |&(number, port): &(usize, usize)| diagram.boxes.get(number).is_some_and(|it| port < it.ports.len());
    let is_usable = |line: &LineEnds| exists(&line.source) && exists(&line.target);
    // From here on, all numbers are those of boxes, ports and lines that exist.
    let lines = (0..diagram.lines.len()).filter(|&line| is_usable(&diagram.lines[line])).collect();
    DiagramLayout::new(diagram, spacing, lines, interrupt).map(DiagramLayout::placement)
}

/// A place in the sequence of columns that a line passes: a slot, or a position in a column between.
#[derive(Debug, Clone, Copy)]
struct LineStop {
    column: usize,
    y: f64,
}

/// What a column contains.
#[derive(Debug, Clone, Copy)]
struct ColumnItem {
    content: Content,
    top: f64,
    height: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Content {
    Box(usize),
    /// A line that passes.
    Line(usize),
    /// A line that passes below its label.
    Label(usize),
}

impl Content {
    /// Returns the line that passes.
    fn line(self) -> Option<usize> {
        if let Content::Line(line) | Content::Label(line) = self { Some(line) } else { None }
    }
}

struct DiagramLayout<'a> {
    diagram: &'a Diagram,
    spacing: Spacing,
    interrupt: &'a dyn Fn(),
    /// The lines between different boxes.
    lines: Vec<usize>,
    /// The lines from a box to itself, by box.
    loops: BTreeMap<usize, Vec<usize>>,
    /// The position of each box in an order that most lines follow.
    order: Vec<usize>,
    columns: Vec<Vec<ColumnItem>>,
    /// The column of each box.
    column_of: Vec<usize>,
    /// Where a line passes a column: the index in the column, by line and column.
    passes: FxHashMap<(usize, usize), usize>,
    boxes: Vec<PlacedBox>,
}

impl<'a> DiagramLayout<'a> {
    fn new(
        diagram: &'a Diagram,
        spacing: Spacing,
        usable: Vec<usize>,
        interrupt: &'a dyn Fn(),
    ) -> Option<DiagramLayout<'a>> {
        let ends = |line: &usize| (diagram.lines[*line].source.0, diagram.lines[*line].target.0);
        let is_loop = |line: &usize| ends(line).0 == ends(line).1;
        let (all_loops, lines): (Vec<usize>, Vec<usize>) = usable.into_iter().partition(is_loop);
        let mut loops: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        all_loops.iter().for_each(|line| loops.entry(ends(line).0).or_default().push(*line));
        if diagram.boxes.len() + diagram.lines.len() > MOST_ITEMS {
            return None;
        }
        let order = order_of(diagram.boxes.len(), &lines.iter().map(ends).collect::<Vec<_>>());
        let mut layout = DiagramLayout {
            diagram,
            spacing,
            interrupt,
            lines,
            loops,
            order,
            columns: Vec::new(),
            passes: FxHashMap::default(),
            column_of: vec![0; diagram.boxes.len()],
            boxes: vec![PlacedBox::default(); diagram.boxes.len()],
        };
        layout.make_slots();
        let ranks = layout.ranks();
        let lanes = layout.lines.iter().map(|&line| layout.span(line, &ranks).len()).sum::<usize>();
        let items = diagram.boxes.len() + lanes;
        if items > MOST_ITEMS {
            return None;
        }
        match items > MANY_ITEMS {
            true => layout.assign_simply(&ranks),
            false => layout.assign_by_dagre(),
        }
        layout.number_columns();
        Some(layout)
    }

    fn line(&self, line: usize) -> LineEnds {
        self.diagram.lines[line]
    }

    /// The left and the right box of a line.
    fn ends_of(&self, line: usize) -> (usize, usize) {
        let LineEnds { source, target, .. } = self.line(line);
        match self.sides(self.line(line)) {
            (BoxSide::Right, _) => (source.0, target.0),
            (BoxSide::Left, _) => (target.0, source.0),
        }
    }

    /// The lines of each box: `end` selects their left or their right box.
    fn lines_by(&self, end: impl Fn((usize, usize)) -> usize) -> Vec<Vec<usize>> {
        let mut lines = vec![Vec::new(); self.diagram.boxes.len()];
        for &line in &self.lines {
            lines[end(self.ends_of(line))].push(line);
        }
        lines
    }

    /// Drops columns that have lines only, orders the others, and fills `column_of`.
    fn number_columns(&mut self) {
        self.columns.retain(|items| items.iter().any(|item| !matches!(item.content, Content::Line(_))));
        for (index, items) in self.columns.iter_mut().enumerate() {
            items.sort_by(|a, b| (a.top + a.height / 2.0).total_cmp(&(b.top + b.height / 2.0)));
            for item in items.iter() {
                if let Content::Box(number) = item.content {
                    self.column_of[number] = index;
                }
            }
        }
        self.separate();
        let items = self.columns.iter().enumerate().flat_map(|(column, items)| {
            let passing =
                move |(index, item): (usize, &ColumnItem)| Some(((item.content.line()?, column), index));
            items.iter().enumerate().filter_map(passing)
        });
        self.passes = items.collect();
    }

    fn gap(&self, above: Content, below: Content) -> f64 {
        match (above, below) {
            (Content::Box(_), Content::Box(_)) => self.spacing.boxes,
            _ => self.spacing.lines,
        }
    }

    /// Moves items down until each has its distance from the one above, and the whole to the top.
    fn separate(&mut self) {
        let mut columns = std::mem::take(&mut self.columns);
        for items in &mut columns {
            let mut above: Option<ColumnItem> = None;
            for item in items.iter_mut() {
                item.top = item.top.round();
                if let Some(above) = above {
                    item.top = item.top.max(above.top + above.height + self.gap(above.content, item.content));
                }
                above = Some(*item);
            }
        }
        let first = columns.iter().flatten().map(|item| item.top).fold(f64::INFINITY, f64::min);
        if first.is_finite() {
            for item in columns.iter_mut().flatten() {
                item.top += self.spacing.top + self.spacing.margin - first;
            }
        }
        self.columns = columns;
    }

    /// The sides at which a line leaves its source and reaches its target.
    fn sides(&self, line: LineEnds) -> (BoxSide, BoxSide) {
        match self.order[line.source.0] <= self.order[line.target.0] {
            true => (BoxSide::Right, BoxSide::Left),
            false => (BoxSide::Left, BoxSide::Right),
        }
    }

    /// Makes the slots of all boxes, without positions.
    fn make_slots(&mut self) {
        let mut used: Vec<BTreeSet<(usize, BoxSide)>> = vec![BTreeSet::new(); self.diagram.boxes.len()];
        for &line in &self.lines {
            let ends = self.line(line);
            let (source, target) = self.sides(ends);
            for ((number, port), side) in [(ends.source, source), (ends.target, target)] {
                used[number].insert((port, side));
            }
        }
        for &line in self.loops.values().flatten() {
            let LineEnds { source: (number, source), target: (_, target), .. } = self.line(line);
            if self.diagram.boxes[number].head.is_some() {
                used[number].extend([(source, BoxSide::Right), (target, BoxSide::Left)]);
            }
        }
        for ((size, placed), used) in self.diagram.boxes.iter().zip(&mut self.boxes).zip(&used) {
            let with_line = used.iter().map(|&(port, side)| PortSlot { port, side, y: 0.0, has_line: true });
            let without = size.ports.iter().enumerate().filter_map(|(port, side)| {
                let has_any =
                    [BoxSide::Left, BoxSide::Right].into_iter().any(|side| used.contains(&(port, side)));
                side.filter(|_| !has_any).map(|side| PortSlot { port, side, y: 0.0, has_line: false })
            });
            placed.slots = with_line.chain(without).collect();
        }
    }

    /// The width and the height of a box without the lines to itself.
    fn size(&self, number: usize) -> (f64, f64) {
        let (size, placed) = (&self.diagram.boxes[number], &self.boxes[number]);
        let on = |side: BoxSide| placed.slots.iter().filter(|slot| slot.side == side).count();
        let rows = on(BoxSide::Left).max(on(BoxSide::Right)) as f64;
        let mut width = size.width;
        if size.head.is_none() {
            for line in self.loops_of(number) {
                width = width.max(2.0 * self.loop_reach(line) + 2.0 * self.spacing.ends + self.spacing.line);
            }
        }
        (width, size.height.max(size.head.unwrap_or_default() + rows * size.row + size.foot))
    }

    /// The lines from a box to itself, in order.
    fn loops_of(&self, number: usize) -> impl Iterator<Item = LineEnds> + '_ {
        self.loops.get(&number).into_iter().flatten().map(|&line| self.line(line))
    }

    /// The distance between the middle of a box and the ends of a line to itself below it.
    fn loop_reach(&self, line: LineEnds) -> f64 {
        let (width, _) = line.label.unwrap_or_default();
        (width / 2.0).ceil() + self.spacing.ends.min(8.0)
    }

    /// The width and the height of a box with the lines to itself.
    fn outer_size(&self, number: usize) -> (f64, f64) {
        let (width, height) = self.size(number);
        let count = self.loops_of(number).count() as f64;
        if self.diagram.boxes[number].head.is_some() {
            let side = if count > 0.0 { self.spacing.ends + count * self.spacing.turns } else { 0.0 };
            (width + 2.0 * side, height + count * (self.spacing.lines + self.spacing.line))
        } else {
            let below = |line: LineEnds| {
                line.label.map_or(self.spacing.boxes / 2.0, |(_, height)| height)
                    + 2.0 * self.spacing.label
                    + self.spacing.line
            };
            (width, height + self.loops_of(number).map(below).fold(0.0, f64::max))
        }
    }

    fn placement(mut self) -> Placement {
        self.place_tops();
        self.order_slots();
        let mut stops = self.stops();
        self.straighten(&mut stops);
        self.turn(&stops)
    }

    /// Sets the vertical positions of boxes.
    fn place_tops(&mut self) {
        for number in 0..self.boxes.len() {
            let (width, height) = self.size(number);
            self.boxes[number].area = Area { width, height, ..Area::default() };
        }
        for item in self.columns.iter().flatten() {
            if let Content::Box(number) = item.content {
                self.boxes[number].area.y = item.top;
            }
        }
    }

    /// Orders the slots of each side by the other ends of their lines, and sets their positions.
    fn order_slots(&mut self) {
        let mut others: BTreeMap<(usize, usize, BoxSide), (f64, f64)> = BTreeMap::new();
        let centre = |number: usize| self.boxes[number].area.y + self.boxes[number].area.height / 2.0;
        for &line in &self.lines {
            let ends = self.line(line);
            let (source, target) = self.sides(ends);
            // The next stop of the line says more than its other end.
            let near = |number: usize, side: BoxSide, other: usize| {
                let column = self.column_of[number];
                let next = if side == BoxSide::Right { column.checked_add(1) } else { column.checked_sub(1) };
                let item = next.and_then(|next| self.passing(line, next));
                item.map_or_else(|| centre(other), |item| item.top + item.height / 2.0)
            };
            let pairs = [
                ((ends.source.0, ends.source.1, source), near(ends.source.0, source, ends.target.0)),
                ((ends.target.0, ends.target.1, target), near(ends.target.0, target, ends.source.0)),
            ];
            for (slot, y) in pairs {
                let sum = others.entry(slot).or_default();
                *sum = (sum.0 + y, sum.1 + 1.0);
            }
        }
        for (number, (placed, size)) in self.boxes.iter_mut().zip(&self.diagram.boxes).enumerate() {
            let order = |slot: &PortSlot| {
                let mean = others.get(&(number, slot.port, slot.side)).map(|(sum, count)| sum / count);
                (slot.side, !slot.has_line, mean.unwrap_or(f64::INFINITY), slot.port)
            };
            placed.slots.sort_by(|a, b| order(a).partial_cmp(&order(b)).unwrap_or(Ordering::Equal));
            for side in [BoxSide::Left, BoxSide::Right] {
                let count = placed.slots.iter().filter(|slot| slot.side == side).count() as f64;
                let first = match size.head {
                    Some(head) => head,
                    None => ((placed.area.height - count * size.row) / 2.0).floor(),
                };
                for (index, slot) in placed.slots.iter_mut().filter(|slot| slot.side == side).enumerate() {
                    slot.y = placed.area.y + first + index as f64 * size.row + (size.row / 2.0).floor();
                }
            }
        }
    }

    /// Where a line passes a column.
    fn passing(&self, line: usize, column: usize) -> Option<ColumnItem> {
        self.columns.get(column)?.get(*self.passes.get(&(line, column))?).copied()
    }

    /// The heights of the slots, by box, port and side.
    fn slots(&self) -> FxHashMap<(usize, usize, BoxSide), f64> {
        let all = self.boxes.iter().enumerate();
        all.flat_map(|(number, it)| it.slots.iter().map(move |slot| ((number, slot.port, slot.side), slot.y)))
            .collect()
    }

    /// The stops of each line between boxes, from left to right.
    fn stops(&self) -> Vec<Vec<LineStop>> {
        let mut between: BTreeMap<usize, Vec<LineStop>> = BTreeMap::new();
        for (column, items) in self.columns.iter().enumerate() {
            for item in items {
                if let Content::Line(line) | Content::Label(line) = item.content {
                    let y = item.top + item.height - self.spacing.line;
                    between.entry(line).or_default().push(LineStop { column, y });
                }
            }
        }
        let slots = self.slots();
        let stops = self.lines.iter().map(|&line| {
            (self.interrupt)();
            let ends = self.line(line);
            let (source, target) = self.sides(ends);
            let stop = |end: (usize, usize), side: BoxSide| LineStop {
                column: self.column_of[end.0],
                y: slots.get(&(end.0, end.1, side)).copied().unwrap_or_default(),
            };
            let mut stops = vec![stop(ends.source, source), stop(ends.target, target)];
            stops.extend(between.remove(&line).unwrap_or_default());
            stops.sort_by_key(|stop| stop.column);
            stops
        });
        stops.collect()
    }

    /// Moves lines inside columns to the height of a neighbouring stop where that keeps all distances: straight lines are
    /// easier to follow.
    fn straighten(&mut self, stops: &mut [Vec<LineStop>]) {
        let mut columns = std::mem::take(&mut self.columns);
        for (&line, stops) in self.lines.iter().zip(stops) {
            (self.interrupt)();
            for index in 1..stops.len().saturating_sub(1) {
                let neighbours = [index - 1, index + 1].map(|index| stops[index].y);
                let stop = &mut stops[index];
                let items = &mut columns[stop.column];
                let Some(&at) = self.passes.get(&(line, stop.column)) else { continue };
                let item = items[at];
                let above = at.checked_sub(1).and_then(|above| items.get(above));
                let least = above.map_or(self.spacing.top + self.spacing.margin, |above| {
                    above.top + above.height + self.gap(above.content, item.content)
                });
                let below = items.get(at + 1);
                let greatest = below.map_or(f64::INFINITY, |below| {
                    below.top - self.gap(item.content, below.content) - item.height
                });
                let top = |y: f64| y - item.height + self.spacing.line;
                if let Some(y) = neighbours.into_iter().find(|&y| top(y) >= least && top(y) <= greatest) {
                    stop.y = y;
                    items[at].top = top(y);
                }
            }
        }
        self.columns = columns;
    }

    /// Sets the horizontal positions, and makes the lines.
    fn turn(mut self, stops: &[Vec<LineStop>]) -> Placement {
        let gaps = self.gaps(stops);
        // The left and the right end of each column.
        let mut ends: Vec<(f64, f64)> = Vec::new();
        let mut x = self.spacing.margin;
        for (index, items) in self.columns.iter().enumerate() {
            let width = |item: &ColumnItem| match item.content {
                Content::Box(number) => self.outer_size(number).0,
                Content::Label(line) => self.line(line).label.unwrap_or_default().0,
                Content::Line(_) => 0.0,
            };
            let width = items.iter().map(width).fold(0.0, f64::max).ceil();
            ends.push((x, x + width));
            x += width + gaps.get(index).map_or(0.0, |gap| gap.width(self.spacing));
        }
        let width = ends.last().map_or(0.0, |last| last.1) + self.spacing.margin;
        for (items, &(left, right)) in self.columns.iter().zip(&ends) {
            for item in items {
                if let Content::Box(number) = item.content {
                    let area = &mut self.boxes[number].area;
                    area.x = ((left + right - area.width) / 2.0).floor();
                }
            }
        }
        let mut lines = vec![PlacedLine::default(); self.diagram.lines.len()];
        for (&line, stops) in self.lines.iter().zip(stops) {
            (self.interrupt)();
            let points = self.points(line, stops, &gaps, &ends);
            lines[line] = PlacedLine { points, label: self.label(line, &ends) };
        }
        for (line, placed) in self.placed_loops() {
            lines[line] = placed;
        }
        let bottoms = self.columns.iter().flatten().map(|item| item.top + item.height);
        let bottom = bottoms.fold(self.spacing.top, f64::max);
        Placement { width, height: bottom + self.spacing.margin, boxes: self.boxes, lines }
    }

    fn points(
        &self,
        line: usize,
        stops: &[LineStop],
        gaps: &[ColumnGap],
        ends: &[(f64, f64)],
    ) -> Vec<(f64, f64)> {
        let (source_side, _) = self.sides(self.line(line));
        let (left, right) = self.ends_of(line);
        let (left, right) = (self.boxes[left].area, self.boxes[right].area);
        let mut points: Vec<(f64, f64)> = Vec::new();
        points.extend(stops.first().map(|first| (left.x + left.width - self.spacing.line, first.y)));
        for (from, to) in stops.iter().zip(stops.iter().skip(1)).filter(|(from, to)| from.y != to.y) {
            // All columns between have a stop, so that these two are neighbours.
            let x = gaps
                .get(from.column)
                .and_then(|gap| gap.turn_of(line))
                .map(|turn| ends[from.column].1 + self.spacing.ends + turn as f64 * self.spacing.turns);
            let x = x.unwrap_or_default();
            points.extend([(x, from.y), (x, to.y)]);
        }
        points.extend(stops.last().map(|last| (right.x, last.y)));
        if source_side == BoxSide::Left {
            points.reverse();
        }
        points
    }

    fn label(&self, line: usize, ends: &[(f64, f64)]) -> Option<Area> {
        let (width, height) = self.line(line).label?;
        let (first, last) = self.ends_of(line);
        (self.column_of[first]..self.column_of[last]).find_map(|column| {
            let item = self.passing(line, column).filter(|item| item.content == Content::Label(line))?;
            let (left, right) = ends.get(column)?;
            let x = ((left + right - width) / 2.0).floor();
            Some(Area { x, y: item.top, width, height })
        })
    }

    /// The lines from a box to itself: below it, or around it to the port on its other side.
    fn placed_loops(&self) -> Vec<(usize, PlacedLine)> {
        let slots = self.slots();
        let slot = |(number, port): (usize, usize), side| slots.get(&(number, port, side)).copied();
        let all = self.loops.values().flat_map(|of_box| of_box.iter().enumerate());
        let placed = all.map(|(index, &line)| {
            let ends = self.line(line);
            let Area { x, y, width, height } = self.boxes[ends.source.0].area;
            let (right, bottom) = (x + width - self.spacing.line, y + height - self.spacing.line);
            let count = index as f64 + 1.0;
            if self.diagram.boxes[ends.source.0].head.is_some() {
                let (from, to) = (slot(ends.source, BoxSide::Right), slot(ends.target, BoxSide::Left));
                let (from, to) = (from.unwrap_or_default(), to.unwrap_or_default());
                let side = self.spacing.ends + (count - 1.0) * self.spacing.turns;
                let below = bottom + count * (self.spacing.lines + self.spacing.line);
                let points = vec![
                    (right, from),
                    (right + side, from),
                    (right + side, below),
                    (x - side, below),
                    (x - side, to),
                    (x, to),
                ];
                return (line, PlacedLine { points, label: None });
            }
            let middle = x + (width / 2.0).floor();
            let reach = self.loop_reach(ends);
            let (label_width, label_height) = ends.label.unwrap_or((0.0, self.spacing.boxes / 2.0));
            let top = bottom + self.spacing.line + self.spacing.label;
            let below = (top + label_height + self.spacing.label).floor();
            let points = vec![
                (middle + reach, bottom),
                (middle + reach, below),
                (middle - reach, below),
                (middle - reach, bottom),
            ];
            let label = ends.label.map(|_| Area {
                x: middle - (label_width / 2.0).floor(),
                y: top,
                width: label_width,
                height: label_height,
            });
            (line, PlacedLine { points, label })
        });
        placed.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers for random diagrams: the same on each machine.
    struct Random(u64);

    impl Random {
        fn below(&mut self, end: usize) -> usize {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 33) as usize) % end.max(1)
        }
    }

    fn random_diagram(random: &mut Random, boxes: usize, has_ports: bool) -> Diagram {
        let mut diagram = Diagram::default();
        for _ in 0..boxes {
            let ports = match has_ports {
                true => (0..random.below(5) + 1)
                    .map(|port| Some([BoxSide::Left, BoxSide::Right][port % 2]))
                    .collect(),
                false => Vec::new(),
            };
            diagram.boxes.push(BoxSize {
                width: (random.below(20) + 8) as f64,
                height: 4.0,
                head: has_ports.then_some(3.0),
                row: 1.0,
                foot: 1.0,
                ports,
            });
        }
        for _ in 0..random.below(2 * boxes + 1) {
            let mut end = |is_source: bool| {
                let number = random.below(boxes);
                let ports = &mut diagram.boxes[number].ports;
                if !has_ports {
                    ports.push(None);
                    return (number, ports.len() - 1);
                }
                let side = if is_source { BoxSide::Right } else { BoxSide::Left };
                let fitting: Vec<usize> =
                    (0..ports.len()).filter(|&port| ports[port] == Some(side)).collect();
                let port = fitting.get(random.below(fitting.len())).copied().unwrap_or_else(|| {
                    ports.push(Some(side));
                    ports.len() - 1
                });
                (number, port)
            };
            let (source, target) = (end(true), end(false));
            let is_known = |line: &LineEnds| (line.source.0, line.target.0) == (source.0, target.0);
            // A state machine has one line for all transitions between two states.
            if has_ports || !diagram.lines.iter().any(is_known) {
                let label =
                    (!has_ports).then_some(((random.below(12) + 3) as f64, (random.below(3) + 1) as f64));
                diagram.lines.push(LineEnds { source, target, label });
            }
        }
        diagram
    }

    fn overlap(a: Area, b: Area) -> bool {
        a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height
    }

    /// Checks what the documentation of this module promises.
    fn check(diagram: &Diagram, spacing: Spacing) {
        let placement = place(diagram, spacing, &|| ()).unwrap();
        let boxes: Vec<Area> = placement.boxes.iter().map(|it| it.area).collect();
        let labels: Vec<Area> = placement.lines.iter().filter_map(|line| line.label).collect();
        let all: Vec<Area> = boxes.iter().chain(&labels).copied().collect();
        for (index, &a) in all.iter().enumerate() {
            assert!(a.x >= 0.0 && a.y >= 0.0, "{a:?}");
            assert!(a.x + a.width <= placement.width && a.y + a.height <= placement.height, "{a:?}");
            for &b in all.iter().skip(index + 1) {
                assert!(!overlap(a, b), "{a:?} and {b:?} in {diagram:?}");
            }
        }
        for (ends, line) in diagram.lines.iter().zip(&placement.lines) {
            assert_eq!(line.label.is_some(), ends.label.is_some());
            for pair in line.points.windows(2) {
                let [(x1, y1), (x2, y2)] = pair else { continue };
                assert!(x1 == x2 || y1 == y2, "a slanting line: {:?}", line.points);
                // As wide as it is drawn, without its ends, which touch boxes.
                let end = spacing.line.max(0.1);
                let part = Area {
                    x: x1.min(*x2) + if y1 == y2 { end } else { 0.0 },
                    y: y1.min(*y2) + if x1 == x2 { end } else { 0.0 },
                    width: ((x2 - x1).abs() - 2.0 * end).max(0.1),
                    height: ((y2 - y1).abs() - 2.0 * end).max(0.1),
                };
                for &other in &all {
                    assert!(!overlap(part, other), "{part:?} crosses {other:?}");
                }
            }
            for (point, (number, _)) in
                [(line.points.first(), ends.source), (line.points.last(), ends.target)]
            {
                let (x, y) = *point.expect("each line has points");
                let Area { x: left, y: top, width, height } = boxes[number];
                let (right, bottom) = (left + width - spacing.line, top + height - spacing.line);
                let is_on_side = (x == left || x == right) && y >= top && y <= bottom;
                let is_below = y == bottom && x >= left && x <= right;
                assert!(is_on_side || is_below, "({x}, {y}) is not on the border of {:?}", boxes[number]);
            }
        }
    }

    const CELLS: Spacing = Spacing {
        boxes: 1.0,
        lines: 1.0,
        turns: 2.0,
        ends: 3.0,
        label: 0.0,
        margin: 1.0,
        top: 0.0,
        line: 1.0,
    };
    const PIXELS: Spacing = Spacing {
        boxes: 6.0,
        lines: 4.0,
        turns: 3.0,
        ends: 5.0,
        label: 1.0,
        margin: 4.0,
        top: 0.0,
        line: 0.0,
    };

    #[test]
    fn nothing_overlaps_in_random_diagrams() {
        let mut random = Random(1);
        for round in 0..120 {
            let boxes = round % 24 + 1;
            for has_ports in [true, false] {
                let diagram = random_diagram(&mut random, boxes, has_ports);
                check(&diagram, PIXELS);
                check(&diagram, CELLS);
            }
        }
    }

    #[test]
    fn large_diagrams_are_placed() {
        let mut random = Random(2);
        for has_ports in [true, false] {
            let diagram = random_diagram(&mut random, 200, has_ports);
            check(&diagram, PIXELS);
            check(&diagram, CELLS);
        }
    }

    /// Lines between boxes, each with a port of its own for each line.
    fn diagram_of(boxes: usize, lines: impl Iterator<Item = (usize, usize)>) -> Diagram {
        let size = BoxSize { width: 8.0, height: 3.0, row: 1.0, ..BoxSize::default() };
        let mut diagram = Diagram { boxes: vec![size; boxes], lines: Vec::new() };
        for (source, target) in lines {
            let mut end = |number: usize| {
                let ports = &mut diagram.boxes[number].ports;
                ports.push(None);
                (number, ports.len() - 1)
            };
            let (source, target) = (end(source), end(target));
            diagram.lines.push(LineEnds { source, target, label: Some((4.0, 1.0)) });
        }
        diagram
    }

    /// With a method whose steps grow with the square, each of these takes minutes.
    #[test]
    fn steps_grow_with_the_size() {
        const SIZE: usize = 15_000;
        let backwards = diagram_of(SIZE, (1..SIZE).map(|it| (it, it - 1)));
        let star = diagram_of(SIZE, (1..SIZE).map(|it| (0, it)));
        let loops = diagram_of(SIZE, (0..SIZE).map(|it| (it, it)));
        let rings = diagram_of(SIZE, (0..SIZE).map(|it| (it, it ^ 1)));
        for diagram in [backwards, star, loops, rings] {
            let calls = std::cell::Cell::new(0);
            let placement = place(&diagram, CELLS, &|| calls.set(calls.get() + 1)).unwrap();
            assert!(placement.lines.iter().all(|line| line.points.len() >= 2));
            // Often enough that an edit does not wait.
            assert!(
                calls.get() >= diagram.lines.len() || diagram.lines[0].source.0 == diagram.lines[0].target.0
            );
        }
    }

    #[test]
    fn what_no_one_can_read_is_not_placed() {
        let boxes = diagram_of(MOST_ITEMS + 1, std::iter::empty());
        // Few boxes, and lines that pass many of them.
        let passing = diagram_of(400, (1..400).flat_map(|it| [(it - 1, it), (it, 0)]));
        for diagram in [boxes, passing] {
            assert!(place(&diagram, CELLS, &|| ()).is_none());
        }
    }

    #[test]
    fn sources_are_left_of_targets() {
        let boxes =
            vec![BoxSize { width: 8.0, height: 3.0, ports: vec![None, None], ..BoxSize::default() }; 3];
        let line = |source, target| LineEnds { source: (source, 0), target: (target, 1), label: None };
        let placement =
            place(&Diagram { boxes, lines: vec![line(2, 0), line(0, 1)] }, CELLS, &|| ()).unwrap();
        let x: Vec<f64> = placement.boxes.iter().map(|it| it.area.x).collect();
        assert!(x[2] < x[0] && x[0] < x[1], "{x:?}");
    }

    #[test]
    fn a_diagram_without_boxes_is_empty() {
        let placement = place(&Diagram::default(), PIXELS, &|| ()).unwrap();
        assert!(placement.boxes.is_empty() && placement.width >= 0.0 && placement.height.is_finite());
        // Lines of boxes that do not exist have no points.
        let lines = vec![LineEnds { source: (0, 0), target: (7, 3), label: None }];
        let placement = place(&Diagram { boxes: Vec::new(), lines }, PIXELS, &|| ()).unwrap();
        assert!(placement.lines[0].points.is_empty());
    }
}
