//! Chooses the white space before each token and each comment.

mod align;

use std::ops::Range;

use super::lines::{breaks, last_line, width};
use super::pieces::{Keep, Piece, PieceList, read};
use super::replacement::{Replacement, replacement};
use crate::SyntaxKind::{self, *};
use crate::SyntaxNode;
use crate::conflict::{Region, regions};

/// The maximal width of a line that is one block.
const WIDTH: usize = 120;

/// The number of tokens after the first one of a line that the parser examines.
const LOOK_AHEAD: usize = 2;

/// The white space before a piece.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PieceGap {
    AsIs,
    /// The same line breaks, and new indentation after the last one.
    Indented(usize),
    Spaces(usize),
    /// A line break, an optional blank line, and spaces.
    Line {
        blank: bool,
        indent: usize,
    },
}

/// A parenthesis that is open at the beginning of a line.
struct Paren {
    /// The columns of a continuation line, and of a line with the closing parenthesis.
    inside: usize,
    closing: usize,
}

/// The tokens and comments of a text, each with its new white space.
pub(super) struct TextLayout<'a> {
    text: &'a str,
    /// The offset of the first gap: after a byte order mark.
    origin: usize,
    line_break: &'static str,
    pieces: Vec<Piece<'a>>,
    lists: Vec<PieceList>,
    /// The indentation of each piece if it began a line.
    indents: Vec<usize>,
    gaps: Vec<PieceGap>,
    interrupt: &'a dyn Fn(),
}

impl<'a> TextLayout<'a> {
    pub(super) fn new(root: &SyntaxNode, text: &'a str, interrupt: &'a dyn Fn()) -> TextLayout<'a> {
        let origin = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        let (pieces, lists) = read(root, text, interrupt);
        let (indents, gaps) = (Vec::with_capacity(pieces.len()), Vec::with_capacity(pieces.len()));
        let mut layout =
            TextLayout { text, origin, line_break: "\n", pieces, lists, indents, gaps, interrupt };
        layout.lay_out();
        layout.line_break = layout.most_line_breaks();
        layout.align_activities();
        layout.align_comments();
        layout
    }

    /// Returns the present white space before a piece.
    fn white(&self, piece: usize) -> &'a str {
        let start = piece.checked_sub(1).map_or(self.origin, |previous| self.pieces[previous].end());
        self.text.get(start..self.pieces[piece].start).unwrap_or_default()
    }

    fn breaks(&self, piece: usize) -> bool {
        match self.gaps[piece] {
            PieceGap::AsIs => breaks(self.white(piece)) > 0,
            PieceGap::Spaces(_) => false,
            PieceGap::Indented(_) | PieceGap::Line { .. } => true,
        }
    }

    fn new_text(&self, piece: usize) -> String {
        let white = self.white(piece);
        match self.gaps[piece] {
            PieceGap::AsIs => white.to_owned(),
            PieceGap::Indented(indent) => white[..last_line(white)].to_owned() + &" ".repeat(indent),
            PieceGap::Spaces(count) => " ".repeat(count),
            PieceGap::Line { blank, indent } => {
                self.line_break.repeat(1 + usize::from(blank)) + &" ".repeat(indent)
            }
        }
    }

    pub(super) fn replacements(&self) -> Vec<Replacement> {
        let mut found = Vec::new();
        for (index, piece) in self.pieces.iter().enumerate() {
            (self.interrupt)();
            let (old, new) = (self.white(index), self.new_text(index));
            if old == new {
                continue;
            }
            let start = piece.start - old.len();
            // The end of a line, its line break and the beginning of the next line are separate replacements: a range
            // of lines may include only some of them.
            match (old.find(['\n', '\r']), new.find(['\n', '\r'])) {
                (Some(old_head), Some(new_head)) => {
                    let (old_tail, new_tail) = (last_line(old), last_line(&new));
                    found.extend(replacement(start, &old[..old_head], new[..new_head].to_owned()));
                    let breaks = new[new_head..new_tail].to_owned();
                    found.extend(replacement(start + old_head, &old[old_head..old_tail], breaks));
                    found.extend(replacement(start + old_tail, &old[old_tail..], new[new_tail..].to_owned()));
                }
                _ => found.extend(replacement(start, old, new)),
            }
        }
        found
    }

    /// Returns the most frequent line break among those that are kept.
    fn most_line_breaks(&self) -> &'static str {
        let (mut windows, mut all) = (0, 0);
        for (piece, gap) in self.gaps.iter().enumerate() {
            (self.interrupt)();
            let white = self.white(piece);
            let kept = match gap {
                PieceGap::Spaces(_) => "",
                // Any number of line breaks.
                PieceGap::Line { .. } => white.find('\n').and_then(|at| white.get(..=at)).unwrap_or_default(),
                PieceGap::AsIs | PieceGap::Indented(_) => white,
            };
            windows += kept.matches("\r\n").count();
            all += kept.matches('\n').count();
        }
        if windows * 2 > all { "\r\n" } else { "\n" }
    }

    /// Chooses each gap from the pieces around it.
    fn lay_out(&mut self) {
        let mut pen = Pen { column: 0, indent: 0, parens: Vec::new() };
        let mut previous = None;
        let mut first = 0;
        for next in 0..self.pieces.len() {
            (self.interrupt)();
            if self.pieces[next].is_comment() {
                continue;
            }
            self.region(&mut pen, previous, first, next);
            previous = Some(next);
            first = next + 1;
        }
    }

    /// Lays out the gaps before the token `next`. The piece `first` is the first one after the token `previous`; the
    /// pieces between are comments.
    fn region(&mut self, pen: &mut Pen, previous: Option<usize>, first: usize, next: usize) {
        let token = &self.pieces[next];
        if token.item.is_some() || token.brace.is_some() {
            pen.parens.clear();
        }
        let opened = previous.and_then(|it| self.pieces[it].brace).filter(|_| self.is(previous, L_CURLY));
        let closes = token.kind == R_CURLY && token.brace.is_some();
        let kept = (first..=next).any(|gap| self.pieces[gap].keep != Keep::Nothing);
        let between = previous.map_or(0, |it| self.pieces[it].end())..token.start;
        let broken = breaks(self.text.get(between).unwrap_or_default()) > 0;

        // Inserts a line break.
        let (list, may_break) = token.item.or(token.brace.filter(|_| closes)).unwrap_or((0, false));
        let force = may_break
            && !broken
            && !kept
            && previous.is_some()
            && self.lists[list].lines
            && (closes || self.is_known(next));
        let forced = if closes { next } else { first };
        // Removes a line break.
        let is_empty = closes && opened.is_some();
        let follows = token.item.is_none()
            && (token.kind == L_CURLY && token.brace.is_some()
                || token.kind == ELSE_KW && token.parent == ELSE);
        let join = first == next && !kept && (is_empty || follows);

        let (indent, of_comments) = self.indent(pen, next);
        let mut is_first_line = true;
        for gap in first..=next {
            let here = if gap < next { of_comments } else { indent };
            let white = self.white(gap);
            let count = breaks(white);
            let choice = match self.pieces[gap].keep {
                Keep::All => PieceGap::AsIs,
                Keep::Breaks if count == 0 => PieceGap::AsIs,
                // A continuation after an error is part of the error.
                Keep::Breaks if token.item.is_none() && !closes => PieceGap::AsIs,
                Keep::Breaks => PieceGap::Indented(here),
                Keep::Nothing if gap == 0 => PieceGap::Spaces(0),
                Keep::Nothing if self.pieces[gap].kind == EOF => PieceGap::Line { blank: false, indent: 0 },
                Keep::Nothing if !join && (count > 0 || force && gap == forced) => {
                    let at_edge = opened.is_some() && is_first_line || closes && gap == next;
                    PieceGap::Line { blank: count > 1 && !at_edge, indent: here }
                }
                Keep::Nothing => PieceGap::Spaces(self.spaces(gap)),
            };
            self.gaps.push(choice);
            self.indents.push(here);
            is_first_line &= !self.breaks(gap);
            self.advance(pen, gap);
        }
        self.open(pen, next);
    }

    /// Returns whether no error is among the tokens that tell the parser which item begins a line.
    fn is_known(&self, first: usize) -> bool {
        let mut tokens = 0;
        for piece in self.pieces.iter().skip(first + 1) {
            if piece.keep != Keep::Nothing {
                return false;
            }
            tokens += usize::from(!piece.is_comment());
            if tokens == LOOK_AHEAD {
                break;
            }
        }
        true
    }

    fn is(&self, piece: Option<usize>, kind: SyntaxKind) -> bool {
        piece.is_some_and(|it| self.pieces[it].kind == kind)
    }

    /// Returns the indentation of a token that begins a line, and that of the comments above it.
    fn indent(&self, pen: &Pen, token: usize) -> (usize, usize) {
        let piece = &self.pieces[token];
        let block = piece.depth * 2;
        if piece.kind == R_CURLY && piece.brace.is_some() {
            return (block, block + 2);
        }
        let begins = piece.item.is_some() || piece.brace.is_some() || piece.kind == EOF;
        if begins || piece.kind == ELSE_KW && piece.parent == ELSE || piece.is_separator {
            return (block, block);
        }
        match pen.parens.last() {
            Some(paren) if matches!(piece.kind, R_PAREN | R_BRACK) => (paren.closing, paren.inside),
            Some(paren) => (paren.inside, paren.inside),
            None => (block + 4, block + 4),
        }
    }

    /// Returns the number of spaces before a piece that does not begin a line.
    fn spaces(&self, piece: usize) -> usize {
        let Some(previous) = piece.checked_sub(1) else { return 0 };
        let (left, right) = (&self.pieces[previous], &self.pieces[piece]);
        let was = usize::from(!self.white(piece).is_empty());
        let is_brace = |piece: &Piece<'_>| piece.brace.is_some();
        if right.kind == LINE_COMMENT || is_brace(left) && left.kind == L_CURLY && right.is_comment() {
            return 1;
        }
        if left.is_comment() {
            return if is_brace(right) && right.kind == R_CURLY { 1 } else { was };
        }
        if right.is_comment() {
            return was;
        }
        let wanted = match (left.kind, right.kind) {
            (L_CURLY, R_CURLY) if is_brace(left) && is_brace(right) => 0,
            (L_CURLY, _) | (_, R_CURLY) => 1,
            (_, COMMA | SEMICOLON | COLON | COLON2 | DOT | R_PAREN | R_BRACK) => 0,
            _ if right.item.is_some() => match left.kind {
                _ if right.parent == NAME_REF && self.in_activity(right) => 2,
                SEMICOLON | R_CURLY => 1,
                _ => 2,
            },
            (L_PAREN | L_BRACK | DOT | COLON2, _) => 0,
            (BANG, _) => 0,
            (MINUS, _) if left.parent == UNARY_EXPR => 0,
            (_, L_PAREN) if right.parent != PAREN_EXPR => 0,
            _ => 1,
        };
        // Two tokens must not become one.
        if wanted == 0 && was > 0 && !stay_apart(left.text, right.text) { 1 } else { wanted }
    }

    fn in_activity(&self, piece: &Piece<'_>) -> bool {
        piece.item.is_some_and(|(list, _)| self.lists[list].kind == ACTIVITY)
    }

    fn advance(&self, pen: &mut Pen, piece: usize) {
        match self.gaps[piece] {
            PieceGap::Spaces(count) => pen.column += count,
            PieceGap::Line { indent, .. } | PieceGap::Indented(indent) => {
                (pen.column, pen.indent) = (indent, indent);
            }
            PieceGap::AsIs => {
                let white = self.white(piece);
                let width = width(&white[last_line(white)..]);
                if breaks(white) > 0 {
                    (pen.column, pen.indent) = (width, width);
                } else {
                    pen.column += width;
                }
            }
        }
        let text = self.pieces[piece].text;
        let last = last_line(text);
        pen.column = if last > 0 { 0 } else { pen.column } + width(&text[last..]);
    }

    /// Opens or closes the list of a brace or a parenthesis.
    fn open(&mut self, pen: &mut Pen, token: usize) {
        let piece = &self.pieces[token];
        match piece.kind {
            L_PAREN | L_BRACK => {
                let after = self.pieces.iter().skip(token + 1).find(|piece| !piece.is_comment());
                let rest = self.text.get(piece.end()..after.map_or(piece.end(), |after| after.start));
                let hangs = breaks(rest.unwrap_or_default()) > 0;
                pen.parens.push(match hangs {
                    true => Paren { inside: pen.indent + 2, closing: pen.indent },
                    false => Paren { inside: pen.column, closing: pen.column },
                });
            }
            R_PAREN | R_BRACK => {
                pen.parens.pop();
            }
            L_CURLY => {
                if let Some((list, _)) = piece.brace {
                    let it = &self.lists[list];
                    // A line break here requires one in all enclosing blocks.
                    let may_break = it.whole && self.lists[it.outer].lines;
                    let breaks = it.lines || may_break && !self.fits(pen.column, it.open..it.close);
                    self.lists[list].lines = breaks;
                }
            }
            _ => {}
        }
    }

    /// Returns whether a block on one line ends within the width if its opening brace ends at `column`.
    fn fits(&self, mut column: usize, block: Range<usize>) -> bool {
        // An empty block has no line breaks.
        if block.start + 1 >= block.end {
            return true;
        }
        for piece in block.start + 1..=block.end {
            column += self.spaces(piece) + width(self.pieces[piece].text);
            if column > WIDTH {
                return false;
            }
        }
        true
    }

    /// Returns the present column of a piece.
    fn column_of(&self, piece: usize) -> usize {
        let before = self.text.get(self.origin..self.pieces[piece].start).unwrap_or_default();
        width(&before[last_line(before)..])
    }

    /// Returns the beginning of the innermost item that contains the piece that ends at `end`.
    pub(super) fn item_before(&self, end: usize) -> Option<usize> {
        let piece = self.pieces.iter().rposition(|piece| piece.end() == end)?;
        let last = match self.pieces[piece] {
            // The owner of a block is the beginning of its item, which may contain other blocks.
            Piece { kind: R_CURLY, brace: Some((list, _)), .. } => self.lists[list].owner,
            _ => piece,
        };
        let depth = self.pieces[last].depth;
        let mut before = self.pieces[..=last].iter().rev();
        Some(before.find(|it| it.item.is_some() && it.depth <= depth)?.start)
    }

    /// Returns the column for the text of a line that has only this white space before it; none if the column is
    /// unknown.
    pub(super) fn indent_at(&self, white: Range<usize>) -> Option<usize> {
        let next = self.pieces.iter().position(|piece| piece.start >= white.start)?;
        let before = next.checked_sub(1).map(|previous| &self.pieces[previous]);
        let is_in = |it: Region| (it.start.start..it.other.end).contains(&white.start);
        // Inside a comment or a string the column is unknown.
        if regions(self.text).into_iter().any(is_in)
            || before.is_some_and(|before| before.end() > white.start || before.is_unclosed())
        {
            return None;
        }
        let piece = &self.pieces[next];
        if piece.start == white.end && piece.kind != EOF {
            return (piece.keep != Keep::All).then(|| self.indents[next]);
        }
        // The line is empty, so its text is unknown.
        let blocks = self.lists.iter().skip(1).filter(|list| list.open < next && next <= list.close).count();
        let token = self.pieces[..next].iter().rposition(|piece| !piece.is_comment());
        let goes_on = token.is_some_and(|token| CONTINUED.contains(&self.pieces[token].kind));
        let open = (0..next)
            .rev()
            .take_while(|&it| self.pieces[it].item.is_none() && self.pieces[it].brace.is_none());
        let mut closed = 0;
        for index in open {
            match self.pieces[index].kind {
                R_PAREN | R_BRACK => closed += 1,
                L_PAREN | L_BRACK if closed > 0 => closed -= 1,
                L_PAREN | L_BRACK if token == Some(index) => {
                    let start = self.text.get(..self.pieces[index].start).unwrap_or_default();
                    let line = &start[last_line(start)..];
                    return Some(line.len() - line.trim_start().len() + 2);
                }
                L_PAREN | L_BRACK => return Some(self.column_of(index) + 1),
                _ => {}
            }
        }
        Some(blocks * 2 + if goes_on { 4 } else { 0 })
    }
}

/// The tokens that never end an item.
const CONTINUED: [SyntaxKind; 16] =
    [EQ, ARROW, COMMA, EQ2, NEQ, LT, LTEQ, GT, GTEQ, PLUS, MINUS, STAR, SLASH, PERCENT, AMP2, PIPE2];

/// The state of the layout at the current piece.
struct Pen {
    column: usize,
    indent: usize,
    parens: Vec<Paren>,
}

/// Returns whether two adjacent tokens remain two tokens without white space between them.
fn stay_apart(left: &str, right: &str) -> bool {
    let lexed = crate::lex(&format!("{left}{right}"));
    lexed.len() == 2 && lexed.range(0).len() == left.len()
}
