//! Aligns the cells of one-line activities, and the trailing comments of consecutive lines.

use std::collections::HashMap;

use super::*;

/// A comment in a sequence of trailing comments.
struct Trailing {
    piece: usize,
    /// The smallest possible column, and the chosen one.
    least: usize,
    column: usize,
    /// Whether no white space precedes it.
    tight: bool,
}

impl TextLayout<'_> {
    /// Aligns the one-line activities of each deployment as a table.
    pub(super) fn align_activities(&mut self) {
        // For each row, the pieces that end its cells, except for the last cell.
        let mut rows: Vec<(usize, Vec<&str>, Vec<usize>)> = Vec::new();
        for (index, list) in self.lists.iter().enumerate().filter(|(_, it)| it.kind == ACTIVITY && it.whole) {
            (self.interrupt)();
            let Some((deployment, _)) = self.pieces[list.owner].item else { continue };
            let begins = list.owner == 0 || self.breaks(list.owner);
            if !begins || (list.owner + 1..=list.close).any(|gap| self.breaks(gap)) {
                continue;
            }
            let fields = (list.open + 1..list.close)
                .filter(|&it| self.pieces[it].item.is_some_and(|(list, _)| list == index));
            let (mut names, mut ends) = (vec![""], vec![list.owner, list.open]);
            for field in fields {
                names.push(self.pieces[field].text);
                ends.push(field);
            }
            // The first field is not aligned: it follows its brace.
            if ends.len() > 2 {
                ends.remove(2);
            }
            rows.push((deployment, names, ends));
        }
        let mut widths: HashMap<(usize, &[&str]), usize> = HashMap::new();
        for (deployment, names, ends) in &rows {
            for (cell, pair) in ends.windows(2).enumerate() {
                let widest = widths.entry((*deployment, &names[..=cell])).or_default();
                *widest = (*widest).max(self.cell_width(pair[0], pair[1]));
            }
        }
        let mut padded = Vec::new();
        for (deployment, names, ends) in &rows {
            for (cell, pair) in ends.windows(2).enumerate() {
                let widest = widths.get(&(*deployment, &names[..=cell])).copied().unwrap_or(0);
                let padding = widest.saturating_sub(self.cell_width(pair[0], pair[1]));
                padded.push((pair[1], padding));
            }
        }
        for (piece, padding) in padded {
            if let PieceGap::Spaces(count) = &mut self.gaps[piece] {
                *count += padding;
            }
        }
    }

    /// Returns the width of the pieces `first..end` on their line.
    fn cell_width(&self, first: usize, end: usize) -> usize {
        let gap = |piece: usize| match self.gaps[piece] {
            PieceGap::Spaces(count) if piece > first => count,
            _ => 0,
        };
        (first..end).map(|piece| gap(piece) + width(self.pieces[piece].text)).sum()
    }

    /// Aligns the trailing comments of consecutive lines in one column.
    pub(super) fn align_comments(&mut self) {
        let mut pen = Pen { column: 0, indent: 0, parens: Vec::new() };
        let mut line = 0;
        let mut row: Vec<Trailing> = Vec::new();
        let (mut last, mut indent, mut was_at) = (0, 0, 0);
        for piece in 0..self.pieces.len() {
            (self.interrupt)();
            line += match self.gaps[piece] {
                PieceGap::AsIs | PieceGap::Indented(_) => breaks(self.white(piece)),
                PieceGap::Spaces(_) => 0,
                PieceGap::Line { blank, .. } => 1 + usize::from(blank),
            };
            let before = pen.column;
            self.advance(&mut pen, piece);
            let here = line;
            line += breaks(self.pieces[piece].text);
            if self.pieces[piece].kind != LINE_COMMENT {
                continue;
            }
            let column = self.column_of(piece);
            let follows = !row.is_empty() && here == last + 1;
            match self.gaps[piece] {
                PieceGap::Spaces(_) if piece > 0 => {
                    if !follows || pen.indent != indent {
                        self.align_row(&mut row);
                        indent = pen.indent;
                    }
                    row.push(Trailing {
                        piece,
                        least: before + 1,
                        column,
                        tight: self.white(piece).len() < 2,
                    });
                }
                // It continues the comment above it.
                PieceGap::Line { blank: false, .. } if follows && column == was_at => {
                    row.push(Trailing { piece, least: 0, column, tight: false });
                }
                _ => continue,
            }
            (last, was_at) = (here, column);
        }
        self.align_row(&mut row);
    }

    fn align_row(&mut self, row: &mut Vec<Trailing>) {
        let mut column = row.iter().map(|it| it.least).max().unwrap_or(0);
        // The author's column is wider.
        if let Some(first) = row.first()
            && row.iter().all(|it| it.column == first.column && !it.tight)
        {
            column = column.max(first.column);
        }
        for it in row.drain(..) {
            match &mut self.gaps[it.piece] {
                PieceGap::Spaces(count) => *count = 1 + column - it.least,
                PieceGap::Line { indent, .. } => *indent = column,
                _ => {}
            }
        }
    }
}
