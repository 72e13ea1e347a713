//! Boxes, lines and texts of characters, for terminals.

use std::cmp::Ordering;

use unicode_width::UnicodeWidthChar;

use crate::layout::{Area, Placement};

/// A grid of characters; positions are columns and rows from 0.
#[derive(Debug, Default)]
pub(crate) struct TextCanvas {
    rows: Vec<Vec<Cell>>,
}

/// A character, or the directions in which lines leave the cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cell {
    Letter(char),
    /// The cell is covered by the letter before, which is wide.
    Covered,
    Lines(u8),
}

const UP: u8 = 1;
const DOWN: u8 = 2;
const LEFT: u8 = 4;
const RIGHT: u8 = 8;

/// More cells than this are not drawn: a terminal shows no line of thousands of letters.
const MOST_CELLS: usize = 4_000_000;

impl TextCanvas {
    /// Makes an empty canvas; none if it is too large.
    pub(crate) fn new(width: f64, height: f64) -> Option<TextCanvas> {
        let (width, height) = (width.max(0.0) as usize, height.max(0.0) as usize);
        let is_drawn = width.saturating_mul(height) <= MOST_CELLS;
        is_drawn.then(|| TextCanvas { rows: vec![vec![Cell::Lines(0); width]; height] })
    }

    /// Draws the borders of all boxes, then all lines; nothing if it is too large, or its lines are too long.
    pub(crate) fn of(placement: &Placement) -> Option<TextCanvas> {
        let points =
            placement.lines.iter().flat_map(|line| line.points.iter().zip(line.points.iter().skip(1)));
        let length: f64 = points.map(|(from, to)| (to.0 - from.0).abs() + (to.1 - from.1).abs()).sum();
        if length > MOST_CELLS as f64 {
            return None;
        }
        let mut canvas = TextCanvas::new(placement.width, placement.height)?;
        placement.boxes.iter().for_each(|placed| canvas.border(placed.area));
        placement.lines.iter().for_each(|line| canvas.line(&line.points));
        Some(canvas)
    }

    fn cell(&mut self, x: f64, y: f64) -> Option<&mut Cell> {
        if x < 0.0 || y < 0.0 {
            return None;
        }
        self.rows.get_mut(y as usize)?.get_mut(x as usize)
    }

    fn add(&mut self, x: f64, y: f64, directions: u8) {
        if let Some(Cell::Lines(lines)) = self.cell(x, y) {
            *lines |= directions;
        }
    }

    /// Draws a line through these points. Two consecutive points share a row or a column.
    pub(crate) fn line(&mut self, points: &[(f64, f64)]) {
        for pair in points.windows(2) {
            let [(x1, y1), (x2, y2)] = pair else { continue };
            let (x, y, is_horizontal) = (x1.min(*x2), y1.min(*y2), y1 == y2);
            let (length, backward, forward) =
                if is_horizontal { ((x1 - x2).abs(), LEFT, RIGHT) } else { ((y1 - y2).abs(), UP, DOWN) };
            let mut at = 0.0;
            while at <= length {
                let directions = if at > 0.0 { backward } else { 0 } | if at < length { forward } else { 0 };
                let (right, down) = if is_horizontal { (at, 0.0) } else { (0.0, at) };
                self.add(x + right, y + down, directions);
                at += 1.0;
            }
        }
    }

    /// Draws the border of a box.
    pub(crate) fn border(&mut self, area: Area) {
        let (right, bottom) = (area.x + area.width - 1.0, area.y + area.height - 1.0);
        let corners =
            [(area.x, area.y), (right, area.y), (right, bottom), (area.x, bottom), (area.x, area.y)];
        self.line(&corners);
    }

    /// Draws the tip of an arrow beside the box where the line ends. Those of calls are hollow.
    pub(crate) fn tip(&mut self, points: &[(f64, f64)], is_call: bool) {
        let [.., (from_x, from_y), (x, y)] = points else { return };
        let (at, [tip, hollow]) = match (from_x.total_cmp(x), from_y.total_cmp(y)) {
            (Ordering::Less, _) => ((x - 1.0, *y), ["▸", "▹"]),
            (Ordering::Greater, _) => ((x + 1.0, *y), ["◂", "◃"]),
            (_, Ordering::Greater) => ((*x, y + 1.0), ["▴", "▵"]),
            _ => ((*x, y - 1.0), ["▾", "▿"]),
        };
        self.text(at.0, at.1, if is_call { hollow } else { tip });
    }

    /// Writes a text over whatever is there.
    pub(crate) fn text(&mut self, x: f64, y: f64, text: &str) {
        let mut at = x;
        for letter in text.chars() {
            // Letters without a width combine with others, or are control characters.
            let Some(width) = letter.width().filter(|width| *width > 0) else { continue };
            if let Some(cell) = self.cell(at, y) {
                *cell = Cell::Letter(letter);
            }
            if width == 2
                && let Some(cell) = self.cell(at + 1.0, y)
            {
                *cell = Cell::Covered;
            }
            at += width as f64;
        }
    }

    /// Returns the rows, without spaces at their ends.
    pub(crate) fn finish(self) -> String {
        let mut out = String::new();
        for row in self.rows {
            let letters = row.into_iter().filter_map(|cell| match cell {
                Cell::Letter(letter) => Some(letter),
                Cell::Covered => None,
                Cell::Lines(lines) => Some(character(lines)),
            });
            let row: String = letters.collect();
            out.push_str(row.trim_end());
            out.push('\n');
        }
        out
    }
}

fn character(lines: u8) -> char {
    const CHARACTERS: [char; 16] =
        [' ', '╵', '╷', '│', '╴', '┘', '┐', '┤', '╶', '└', '┌', '├', '─', '┴', '┬', '┼'];
    CHARACTERS.get(usize::from(lines)).copied().unwrap_or(' ')
}

/// Returns the number of cells that a text takes in a terminal.
pub(crate) fn cells(text: &str) -> f64 {
    text.chars().filter_map(UnicodeWidthChar::width).sum::<usize>() as f64
}

/// Returns a text with spaces behind it, so that it takes at least so many columns.
pub(crate) fn padded(text: &str, columns: usize) -> String {
    format!("{text}{}", " ".repeat(columns.saturating_sub(cells(text) as usize)))
}

/// Returns a text in lines of at most so many columns, each line but the first with this indentation. Words are not broken.
pub fn in_columns(text: &str, columns: Option<usize>, indentation: &str) -> String {
    in_width(text, columns.map_or(f64::INFINITY, |columns| columns as f64), indentation, cells)
}

/// Returns a text in lines that are at most so wide.
pub(crate) fn in_width(text: &str, most: f64, indentation: &str, width_of: impl Fn(&str) -> f64) -> String {
    let (mut out, mut width) = (String::new(), 0.0);
    // Code, such as a command, is one word.
    let mut is_code = false;
    let words = text.split_inclusive(|letter| {
        is_code ^= letter == '`';
        letter == ' ' && !is_code
    });
    let mut words = words.peekable();
    while let Some(word) = words.next() {
        let unit = words.peek().filter(|next| is_unit(next)).map_or("", |next| next.trim_end());
        let end = if unit.is_empty() { word.trim_end() } else { word };
        if width + width_of(end) + width_of(unit) > most && !out.trim_end().is_empty() {
            out.truncate(out.trim_end().len());
            out = out + "\n" + indentation;
            width = width_of(indentation);
        }
        out += word;
        width += width_of(word);
    }
    out
}

/// A number and its unit are in one line.
fn is_unit(word: &str) -> bool {
    ["ms", "µs", "ns", "s", "%"].contains(&word.trim_end().trim_end_matches([',', ';', '.', ':', ')']))
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect;

    #[test]
    fn lines_that_meet_are_joined() {
        let mut canvas = TextCanvas::new(30.0, 5.0).unwrap();
        canvas.border(Area { x: 0.0, y: 0.0, width: 9.0, height: 4.0 });
        canvas.border(Area { x: 20.0, y: 1.0, width: 8.0, height: 4.0 });
        canvas.line(&[(8.0, 1.0), (14.0, 1.0), (14.0, 3.0), (20.0, 3.0)]);
        canvas.line(&[(8.0, 2.0), (20.0, 2.0)]);
        canvas.text(2.0, 1.0, "laser");
        canvas.text(22.0, 2.0, "日本");
        expect![[r#"
            ┌───────┐
            │ laser ├─────┐     ┌──────┐
            │       ├─────┼─────┤ 日本 │
            └───────┘     └─────┤      │
                                └──────┘
        "#]]
        .assert_eq(&canvas.finish());
    }

    #[test]
    fn what_is_outside_is_not_drawn() {
        let mut canvas = TextCanvas::new(4.0, 1.0).unwrap();
        canvas.text(-2.0, 0.0, "abcdefgh");
        canvas.line(&[(0.0, 9.0), (9.0, 9.0)]);
        assert_eq!(canvas.finish(), "cdef\n");
        assert!(TextCanvas::new(1e9, 1e9).is_none());
    }
}
