//! Computes the edits that format the white space of a tree.
//!
//! **Only white space changes**: no token, no comment, no `;`. The formatter chooses the white space of each gap
//! between two tokens or comments, so a formatted text has the same tree apart from white space.
//!
//! Rules:
//! - Two spaces of indentation for each enclosing block. Inside a line one space, or none by convention: `f(a, b): T`,
//!   `a.b -> [4] c.d`, `x = -y + 1;`. Two spaces between neighbours on a line that no `;` or `}` separates.
//! - A block on one line stays on one line, unless it ends beyond column 120. In any other block, each item begins a
//!   line, and the closing brace has its own line. `{` and `else` stay on the line of their owner; an empty block is
//!   `{}`.
//! - Other line breaks are kept. A continuation line is aligned with the first token after the open parenthesis; it is
//!   indented by two spaces if the parenthesis ends its line, and by four spaces without a parenthesis.
//! - Blank lines are reduced to one, and removed at the beginning and the end of a block or of the file.
//! - A comment stays on its line. A comment on its own line is indented like the next item. Trailing `//` comments of
//!   consecutive lines are aligned in one column: the author's column if they share one, otherwise the smallest
//!   possible column. A comment below them continues their column.
//! - The activities of a deployment that take one line each are a table: its columns are as wide as necessary.
//! - Line breaks have the form of the majority. A byte order mark stays. The file ends with a line break.
//!
//! **Text with errors is not formatted**: behind an error, the parser recovers at the beginnings of lines, and the
//! intended structure is unknown. In an `ERROR` node, between the tokens beside it, and in an unclosed block, all white
//! space is kept. Elsewhere a line is broken or joined only where the nodes on both sides have no error: there the
//! parser ignores line breaks.

use std::collections::HashMap;
use std::ops::Range;

use rowan::{NodeOrToken, TextRange, TextSize, WalkEvent};

use crate::SyntaxKind::{self, *};
use crate::{Parse, SyntaxNode, is_closed_comment};

/// The maximal width of a line that is one block.
const WIDTH: usize = 120;

/// The number of tokens after the first one of a line that the parser examines.
const LOOK_AHEAD: usize = 2;

/// The replacement of a range of a text; the formatter replaces white space by white space.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replacement {
    /// The replaced range; empty for an insertion.
    pub range: TextRange,
    /// The new text of the range.
    pub text: String,
}

/// Returns the replacements that format a whole file: in text order, without overlaps, and each with an effect. Calls
/// `interrupt` often; it may unwind.
///
/// ```
/// let parse = mauve_syntax::parse("codel f( a:int ):int\n");
/// let tidy = mauve_syntax::format::format(&parse, &|| ());
/// assert_eq!(tidy.len(), 4);
/// ```
pub fn format(parse: &Parse, interrupt: &dyn Fn()) -> Vec<Replacement> {
    let text = parse.syntax().text().to_string();
    Layout::new(&parse.syntax(), &text, interrupt).replacements()
}

/// Returns the formatted text. Formatting is idempotent.
///
/// ```
/// let text = "shell S{input port goal:Pose;provide park( ):bool}";
/// let tidy = "shell S { input port goal: Pose; provide park(): bool }\n";
/// assert_eq!(mauve_syntax::format::formatted(text), tidy);
/// ```
pub fn formatted(text: &str) -> String {
    // A text that is too long is not parsed.
    if text.len() > crate::LONGEST_TEXT {
        return text.to_owned();
    }
    applied(text, &format(&crate::parse(text), &|| ()))
}

/// Returns the replacements of [`format`](fn@format) in the lines of `range`. A range that ends at the beginning of a
/// line does not include that line.
pub fn format_range(parse: &Parse, range: TextRange, interrupt: &dyn Fn()) -> Vec<Replacement> {
    let text = parse.syntax().text().to_string();
    let lines = lines_of(&text, range);
    let mut found = Layout::new(&parse.syntax(), &text, interrupt).replacements();
    found.retain(|it| lines.contains_range(it.range));
    found
}

/// Returns the on-type formatting edits after `typed` was typed right before `offset`; none except for `}`, `;` and
/// line breaks.
///
/// `}` formats the item that ends with its block, `;` the item that it ends, and a line break the line that it ends. A
/// line break also indents the new line: this is the only replacement behind `offset`.
pub fn format_on_type(
    parse: &Parse,
    offset: TextSize,
    typed: char,
    interrupt: &dyn Fn(),
) -> Vec<Replacement> {
    let text = parse.syntax().text().to_string();
    let at = usize::from(offset).min(text.len());
    if !text.get(..at).is_some_and(|before| before.ends_with(typed)) {
        return Vec::new();
    }
    let layout = Layout::new(&parse.syntax(), &text, interrupt);
    let mut found = layout.replacements();
    match typed {
        '}' | ';' => {
            let Some(last) = layout.pieces.iter().rposition(|piece| piece.end() == at) else {
                return Vec::new();
            };
            let Some(first) = layout.first_of_item(last) else { return Vec::new() };
            let lines = lines_of(&text, range(layout.pieces[first].start..at));
            // The rest of the line is not finished.
            found.retain(|it| lines.contains_range(it.range) && it.range.end() <= offset);
        }
        '\n' | '\r' => {
            let line = text.get(..at).map_or("", |before| before.trim_end_matches(['\n', '\r']));
            // White space at the end of the finished line may be the first half of a line break.
            let finished = lines_of(&text, range(line.len()..line.len()));
            found.retain(|it| finished.contains_range(it.range));
            let rest = text.get(at..).unwrap_or_default();
            let white = rest.len() - rest.trim_start_matches([' ', '\t']).len();
            if let Some(indent) = layout.indent_at(at..at + white) {
                found.extend(replacement(at, &rest[..white], " ".repeat(indent)));
            }
        }
        _ => return Vec::new(),
    }
    found
}

/// Returns the text after the replacements, which are in text order and do not overlap.
pub fn applied(text: &str, replacements: &[Replacement]) -> String {
    let mut out = String::with_capacity(text.len() + text.len() / 8);
    let mut end = 0;
    for it in replacements {
        out += text.get(end..it.range.start().into()).unwrap_or_default();
        out += &it.text;
        end = it.range.end().into();
    }
    out += text.get(end..).unwrap_or_default();
    out
}

/// Returns the range from the beginning of the first line of `lines` to the end of the last one, without its line
/// break.
fn lines_of(text: &str, lines: TextRange) -> TextRange {
    let (start, end) = (usize::from(lines.start()).min(text.len()), usize::from(lines.end()).min(text.len()));
    let begins = |at: usize| at == 0 || matches!(text.as_bytes()[at - 1], b'\n' | b'\r');
    let first = text.as_bytes()[..start].iter().rposition(|byte| matches!(byte, b'\n' | b'\r'));
    let end = if end > start && begins(end) {
        end
    } else {
        let rest = &text.as_bytes()[end..];
        end + rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len())
    };
    range(first.map_or(0, |at| at + 1)..end)
}

fn range(of: Range<usize>) -> TextRange {
    TextRange::new(TextSize::new(of.start as u32), TextSize::new(of.end as u32))
}

/// A token or comment, with the properties that determine the gap before it. The last piece is the end of the text.
struct Piece<'a> {
    kind: SyntaxKind,
    text: &'a str,
    start: usize,
    parent: SyntaxKind,
    depth: usize,
    /// The list of the item that begins here, and whether a line break before it is allowed.
    item: Option<(usize, bool)>,
    /// The list that this brace opens or closes, and for a closing brace, whether a line break before it is allowed.
    brace: Option<(usize, bool)>,
    is_separator: bool,
    keep: Keep,
}

impl Piece<'_> {
    fn end(&self) -> usize {
        self.start + self.text.len()
    }

    fn is_comment(&self) -> bool {
        self.kind.is_comment()
    }

    /// Returns whether this is a comment that continues to the end of the text.
    fn is_unclosed(&self) -> bool {
        self.kind == BLOCK_COMMENT && !is_closed_comment(self.text)
    }
}

/// The part of a gap that is kept.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Keep {
    Nothing,
    /// The part up to the last line break: an error is before it.
    Breaks,
    All,
}

/// `{ … }`; the first list is the file.
struct List {
    kind: SyntaxKind,
    outer: usize,
    /// The first piece of the owner of the block, and the braces of the block.
    owner: usize,
    open: usize,
    close: usize,
    /// Whether the list and its owner have no error.
    whole: bool,
    /// Whether the last item so far has no error.
    last_whole: bool,
    lines: bool,
}

impl List {
    /// Returns the list of a node whose opening brace is the piece `open`.
    fn new(frame: &Frame, outer: usize, open: usize) -> List {
        let Frame { kind, first: owner, whole, .. } = *frame;
        List { kind, outer, owner, open, close: usize::MAX, whole, last_whole: true, lines: false }
    }
}

/// The white space before a piece.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Gap {
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

/// A comment in a sequence of trailing comments.
struct Trailing {
    piece: usize,
    /// The smallest possible column, and the chosen one.
    least: usize,
    column: usize,
    /// Whether no white space precedes it.
    tight: bool,
}

struct Layout<'a> {
    text: &'a str,
    /// The offset of the first gap: after a byte order mark.
    origin: usize,
    line_break: &'static str,
    pieces: Vec<Piece<'a>>,
    lists: Vec<List>,
    /// The indentation of each piece if it began a line.
    indents: Vec<usize>,
    gaps: Vec<Gap>,
    interrupt: &'a dyn Fn(),
}

impl<'a> Layout<'a> {
    fn new(root: &SyntaxNode, text: &'a str, interrupt: &'a dyn Fn()) -> Layout<'a> {
        let origin = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        let (pieces, lists) = Reader::read(root, text, interrupt);
        let (indents, gaps) = (Vec::with_capacity(pieces.len()), Vec::with_capacity(pieces.len()));
        let mut layout = Layout { text, origin, line_break: "\n", pieces, lists, indents, gaps, interrupt };
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
            Gap::AsIs => breaks(self.white(piece)) > 0,
            Gap::Spaces(_) => false,
            Gap::Indented(_) | Gap::Line { .. } => true,
        }
    }

    fn new_text(&self, piece: usize) -> String {
        let white = self.white(piece);
        match self.gaps[piece] {
            Gap::AsIs => white.to_owned(),
            Gap::Indented(indent) => white[..last_line(white)].to_owned() + &" ".repeat(indent),
            Gap::Spaces(count) => " ".repeat(count),
            Gap::Line { blank, indent } => {
                self.line_break.repeat(1 + usize::from(blank)) + &" ".repeat(indent)
            }
        }
    }

    fn replacements(&self) -> Vec<Replacement> {
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
                Gap::Spaces(_) => "",
                // Any number of line breaks.
                Gap::Line { .. } => white.find('\n').and_then(|at| white.get(..=at)).unwrap_or_default(),
                Gap::AsIs | Gap::Indented(_) => white,
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
                Keep::All => Gap::AsIs,
                Keep::Breaks if count == 0 => Gap::AsIs,
                // A continuation after an error is part of the error.
                Keep::Breaks if token.item.is_none() && !closes => Gap::AsIs,
                Keep::Breaks => Gap::Indented(here),
                Keep::Nothing if gap == 0 => Gap::Spaces(0),
                Keep::Nothing if self.pieces[gap].kind == EOF => Gap::Line { blank: false, indent: 0 },
                Keep::Nothing if !join && (count > 0 || force && gap == forced) => {
                    let at_edge = opened.is_some() && is_first_line || closes && gap == next;
                    Gap::Line { blank: count > 1 && !at_edge, indent: here }
                }
                Keep::Nothing => Gap::Spaces(self.spaces(gap)),
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
            Gap::Spaces(count) => pen.column += count,
            Gap::Line { indent, .. } | Gap::Indented(indent) => {
                (pen.column, pen.indent) = (indent, indent);
            }
            Gap::AsIs => {
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

    /// Aligns the one-line activities of each deployment as a table.
    fn align_activities(&mut self) {
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
            if let Gap::Spaces(count) = &mut self.gaps[piece] {
                *count += padding;
            }
        }
    }

    /// Returns the width of the pieces `first..end` on their line.
    fn cell_width(&self, first: usize, end: usize) -> usize {
        let gap = |piece: usize| match self.gaps[piece] {
            Gap::Spaces(count) if piece > first => count,
            _ => 0,
        };
        (first..end).map(|piece| gap(piece) + width(self.pieces[piece].text)).sum()
    }

    /// Aligns the trailing comments of consecutive lines in one column.
    fn align_comments(&mut self) {
        let mut pen = Pen { column: 0, indent: 0, parens: Vec::new() };
        let mut line = 0;
        let mut row: Vec<Trailing> = Vec::new();
        let (mut last, mut indent, mut was_at) = (0, 0, 0);
        for piece in 0..self.pieces.len() {
            (self.interrupt)();
            line += match self.gaps[piece] {
                Gap::AsIs | Gap::Indented(_) => breaks(self.white(piece)),
                Gap::Spaces(_) => 0,
                Gap::Line { blank, .. } => 1 + usize::from(blank),
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
                Gap::Spaces(_) if piece > 0 => {
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
                Gap::Line { blank: false, .. } if follows && column == was_at => {
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
                Gap::Spaces(count) => *count = 1 + column - it.least,
                Gap::Line { indent, .. } => *indent = column,
                _ => {}
            }
        }
    }

    /// Returns the present column of a piece.
    fn column_of(&self, piece: usize) -> usize {
        let before = self.text.get(self.origin..self.pieces[piece].start).unwrap_or_default();
        width(&before[last_line(before)..])
    }

    /// Returns the first piece of the innermost item that contains the piece.
    fn first_of_item(&self, piece: usize) -> Option<usize> {
        let last = match self.pieces[piece] {
            // The owner of a block is the beginning of its item, which may contain other blocks.
            Piece { kind: R_CURLY, brace: Some((list, _)), .. } => self.lists[list].owner,
            _ => piece,
        };
        let depth = self.pieces[last].depth;
        (0..=last).rev().find(|&it| self.pieces[it].item.is_some() && self.pieces[it].depth <= depth)
    }

    /// Returns the column for the text of a line that has only this white space before it; none if the column is
    /// unknown.
    fn indent_at(&self, white: Range<usize>) -> Option<usize> {
        let next = self.pieces.iter().position(|piece| piece.start >= white.start)?;
        let before = next.checked_sub(1).map(|previous| &self.pieces[previous]);
        // Inside a comment or a string the column is unknown.
        if before.is_some_and(|before| before.end() > white.start || before.is_unclosed()) {
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

struct Reader<'a> {
    text: &'a str,
    /// The ranges of errors; they are not nested.
    errors: Vec<TextRange>,
    pieces: Vec<Piece<'a>>,
    lists: Vec<List>,
    /// The minimal part of the next gap that is kept.
    keep: Keep,
    item: Option<(usize, bool)>,
    /// The enclosing lists, the innermost last.
    open: Vec<usize>,
}

struct Frame {
    kind: SyntaxKind,
    first: usize,
    whole: bool,
    list: Option<usize>,
}

impl<'a> Reader<'a> {
    fn read(root: &SyntaxNode, text: &'a str, interrupt: &dyn Fn()) -> (Vec<Piece<'a>>, Vec<List>) {
        let mut errors: Vec<TextRange> = Vec::new();
        let nodes = root.descendants().inspect(|_| interrupt());
        for node in nodes.filter(|node| node.kind() == ERROR) {
            let range = node.text_range();
            if errors.last().is_none_or(|last| last.end() <= range.start()) {
                errors.push(range);
            }
        }
        let pieces = Vec::with_capacity(text.len() / 6);
        let file = Frame { kind: SOURCE_FILE, first: 0, whole: errors.is_empty(), list: None };
        let file = List { lines: true, ..List::new(&file, 0, 0) };
        let mut reader = Reader {
            text,
            errors,
            pieces,
            lists: vec![file],
            keep: Keep::Nothing,
            item: None,
            open: Vec::new(),
        };
        reader.walk(root, interrupt);
        (reader.pieces, reader.lists)
    }

    fn walk(&mut self, root: &SyntaxNode, interrupt: &dyn Fn()) {
        let mut frames: Vec<Frame> = Vec::new();
        for event in root.preorder_with_tokens() {
            interrupt();
            match event {
                WalkEvent::Enter(NodeOrToken::Node(node)) => {
                    let whole = self.is_whole(node.text_range());
                    if let Some(list) = frames.last().and_then(|frame| frame.list) {
                        self.item =
                            (node.kind() != ERROR).then_some((list, whole && self.lists[list].last_whole));
                        self.lists[list].last_whole = whole;
                    }
                    if node.kind() == ERROR && node.text_range().is_empty() {
                        self.keep = self.keep.max(Keep::Breaks);
                    }
                    let list = (node.kind() == SOURCE_FILE).then_some(0);
                    frames.push(Frame { kind: node.kind(), first: self.pieces.len(), whole, list });
                }
                WalkEvent::Leave(NodeOrToken::Node(_)) => {
                    let Some(frame) = frames.pop() else { continue };
                    self.item = None;
                    if frame.kind == ERROR && frame.first < self.pieces.len() {
                        // Includes the comments above.
                        let above = self.pieces[..frame.first].iter().rposition(|piece| !piece.is_comment());
                        self.keep_all(above.map_or(0, |above| above + 1)..self.pieces.len());
                        self.keep = self.keep.max(Keep::Breaks);
                    }
                    if let Some(list) = frame.list.filter(|_| frame.kind != SOURCE_FILE) {
                        // The block is not closed, so its end is unknown.
                        self.keep_all(self.lists[list].open + 1..self.pieces.len());
                        self.lists[list].close = self.pieces.len();
                        self.open.pop();
                    }
                }
                WalkEvent::Enter(NodeOrToken::Token(token)) => {
                    let range: Range<usize> = token.text_range().into();
                    if let Some(frame) = frames.last_mut() {
                        self.token(frame, token.kind(), range);
                    }
                }
                WalkEvent::Leave(NodeOrToken::Token(_)) => {}
            }
        }
        // A line break here would become part of the comment.
        if self.pieces.last().is_some_and(Piece::is_unclosed) {
            self.keep = Keep::All;
        }
        self.push(EOF, self.text.len()..self.text.len(), SOURCE_FILE);
    }

    fn token(&mut self, frame: &mut Frame, kind: SyntaxKind, range: Range<usize>) {
        if kind == WHITESPACE {
            return;
        }
        let index = self.pieces.len();
        let mut brace = None;
        match (kind, frame.list) {
            (L_CURLY, None) if frame.kind != ERROR => {
                let list = List::new(frame, *self.open.last().unwrap_or(&0), index);
                brace = Some((self.lists.len(), false));
                frame.list = Some(self.lists.len());
                self.open.push(self.lists.len());
                self.lists.push(list);
            }
            (R_CURLY, Some(list)) if frame.kind != ERROR => {
                brace = Some((list, self.lists[list].last_whole));
                frame.list = None;
                let open = self.pieces[self.lists[list].open].start;
                self.lists[list].close = index;
                self.lists[list].lines = breaks(self.text.get(open..range.start).unwrap_or_default()) > 0;
                self.open.pop();
            }
            _ => {}
        }
        self.push(kind, range, frame.kind);
        if let Some(piece) = self.pieces.last_mut() {
            piece.depth -= usize::from(kind == L_CURLY && brace.is_some());
            piece.brace = brace;
            piece.is_separator = kind == SEMICOLON && frame.list.is_some();
        }
    }

    fn push(&mut self, kind: SyntaxKind, range: Range<usize>, parent: SyntaxKind) {
        let (start, text) = (range.start, self.text.get(range).unwrap_or_default());
        let keep = std::mem::replace(&mut self.keep, Keep::Nothing);
        let item = if kind.is_comment() { None } else { self.item.take() };
        self.pieces.push(Piece {
            kind,
            text,
            start,
            parent,
            depth: self.open.len(),
            item,
            brace: None,
            is_separator: false,
            keep,
        });
    }

    fn keep_all(&mut self, pieces: Range<usize>) {
        for piece in self.pieces.get_mut(pieces).unwrap_or_default() {
            piece.keep = Keep::All;
        }
    }

    /// Returns whether no error is in this range or at its ends.
    fn is_whole(&self, range: TextRange) -> bool {
        let next = self.errors.partition_point(|error| error.start() <= range.end());
        next.checked_sub(1)
            .and_then(|last| self.errors.get(last))
            .is_none_or(|error| error.end() < range.start())
    }
}

fn breaks(text: &str) -> usize {
    let bytes = text.as_bytes();
    let ends = |index: usize| match bytes[index] {
        b'\n' => true,
        b'\r' => bytes.get(index + 1) != Some(&b'\n'),
        _ => false,
    };
    (0..bytes.len()).filter(|&index| ends(index)).count()
}

fn last_line(text: &str) -> usize {
    text.rfind(['\n', '\r']).map_or(0, |at| at + 1)
}

fn width(text: &str) -> usize {
    text.chars().count()
}

/// Returns whether two adjacent tokens remain two tokens without white space between them.
fn stay_apart(left: &str, right: &str) -> bool {
    let lexed = crate::lex(&format!("{left}{right}"));
    lexed.len() == 2 && lexed.range(0).len() == left.len()
}

fn replacement(start: usize, old: &str, new: String) -> Option<Replacement> {
    (old != new).then(|| Replacement { range: range(start..start + old.len()), text: new })
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use super::*;

    fn check(text: &str, expected: Expect) {
        expected.assert_eq(&formatted(text));
    }

    #[test]
    fn spaces_in_a_line() {
        check(
            "codel f( in a:int ,out b : x . y :: z,c:int ) : bool
shell S  extends A,B{property r:double[0.1 ;1]=-0.3;provide g( ):int}
architecture A { connection a . b->[ 4 ]c.d  property a.b=2*( 1+c ) }
core C( S ) :{ update={ x=!f( a,- 1 )&&y<=2 ; return ; } }
component P(S,C)",
            expect![[r#"
                codel f(in a: int, out b: x.y::z, c: int): bool
                shell S extends A, B { property r: double [0.1; 1] = -0.3; provide g(): int }
                architecture A { connection a.b -> [4] c.d  property a.b = 2 * (1 + c) }
                core C(S): { update = { x = !f(a, -1) && y <= 2; return; } }
                component P(S, C)
            "#]],
        );
    }

    #[test]
    fn lines_of_blocks() {
        check(
            "library a{use b use c
core C(S) {


  // First.

  var a: int
  provide f() = { } ; start = {}
  statemachine { initial state A
    {
      run = { if a then { b(); } else { } }
      transition t to A } }

}
}
shell Short { input port a: int  input port b: int }
shell Long { input port aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa: int; input port bbbbbbbbbbbbbbbbbbbbb: int; input port c: int; } // no",
            expect![[r#"
                library a {
                  use b
                  use c
                  core C(S) {
                    // First.

                    var a: int
                    provide f() = {};
                    start = {}
                    statemachine {
                      initial state A {
                        run = { if a then { b(); } else {} }
                        transition t to A
                      }
                    }
                  }
                }
                shell Short { input port a: int  input port b: int }
                shell Long {
                  input port aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa: int;
                  input port bbbbbbbbbbbbbbbbbbbbb: int;
                  input port c: int;
                } // no
            "#]],
        );
    }

    #[test]
    fn lines_of_expressions_are_the_authors() {
        check(
            "codel f(in a: int,
in b: int, // the other
out c: int): bool
core C(S) { update = {
if a(b,
c) &&
d
then { e(
f,
// why
g
); }
// otherwise
else { x = 1
+ 2; } } }",
            expect![[r#"
                codel f(in a: int,
                        in b: int, // the other
                        out c: int): bool
                core C(S) {
                  update = {
                    if a(b,
                         c) &&
                        d
                        then {
                      e(
                        f,
                        // why
                        g
                      );
                    }
                    // otherwise
                    else {
                      x = 1
                          + 2;
                    }
                  }
                }
            "#]],
        );
    }

    #[test]
    fn activities_are_a_table() {
        check(
            "deployment D {
architecture A
activity a { affinity = 1 priority = 10; period = 5 deadline = 5 }
// The slow one.
activity slow { affinity = 0x10 priority = 9 period = 1000 }

activity rest { priority = background }
activity long {
  priority = 1 period = 10
}
}",
            expect![[r#"
                deployment D {
                  architecture A
                  activity a    { affinity = 1     priority = 10;  period = 5  deadline = 5 }
                  // The slow one.
                  activity slow { affinity = 0x10  priority = 9    period = 1000 }

                  activity rest { priority = background }
                  activity long {
                    priority = 1
                    period = 10
                  }
                }
            "#]],
        );
    }

    #[test]
    fn comments_stay_where_they_stand() {
        check(
            "

// Of the file.


/* And
     more. */ library a { // trailing
use b // one
use longer    // two
              // goes on
// alone
use c       // far
use ccc     // away
/* before */ codel f(/*x*/ a: int /* y */): int
   // last

}
// end",
            expect![[r#"
                // Of the file.

                /* And
                     more. */ library a { // trailing
                  use b      // one
                  use longer // two
                             // goes on
                  // alone
                  use c     // far
                  use ccc   // away
                  /* before */ codel f(/*x*/ a: int /* y */): int
                  // last
                }
                // end
            "#]],
        );
    }

    #[test]
    fn errors_are_formatted_around() {
        check(
            "shell  S {
      input  port
   input  port a  :int
   property  b:  =  3
      property c :int
}
core  C(S) {
   update  = {
         x  =  1;
   if  a  then {
  y=2;
}
   start  = { f( a  b ) ; g( ) ; }
}
what  is   this
    codel  f( ):int",
            expect![[r#"
                shell S {
                  input port
                  input port a: int
                  property b:  = 3
                  property c: int
                }
                core C(S) {
                  update = {
                         x  =  1;
                   if  a  then {
                  y=2;
                }
                  start = { f(a  b); g(); }
                }
                what  is   this
                codel f(): int
            "#]],
        );
    }

    #[test]
    fn no_line_is_broken_where_the_parser_would_be_misled() {
        // `architecture A` at the beginning of a line would be a declaration.
        check(
            "deployment D { architecture A\n{ } }",
            expect![[r#"
            deployment D { architecture A
            { } }
        "#]],
        );
    }

    #[test]
    fn line_breaks_and_marks_of_files() {
        assert_eq!(formatted(""), "");
        assert_eq!(formatted(" \n\n"), "");
        assert_eq!(formatted("\u{feff}\n use a"), "\u{feff}use a\n");
        assert_eq!(
            formatted("use a  \r\n\r\n\r\nuse b\r\nuse c use d\n"),
            "use a\r\n\r\nuse b\r\nuse c\r\nuse d\r\n"
        );
        assert_eq!(formatted("use a /* open\n"), "use a /* open\n");
    }

    #[test]
    fn some_lines_only() {
        let text = "use  a\nuse  b\nuse  c\n";
        let parse = crate::parse(text);
        let second = applied(text, &format_range(&parse, range(8..9), &|| ()));
        assert_eq!(second, "use  a\nuse b\nuse  c\n");
        // Editors select complete lines.
        let two = applied(text, &format_range(&parse, range(0..14), &|| ()));
        assert_eq!(two, "use a\nuse b\nuse  c\n");
    }

    /// Checks the text after on-type formatting of the character before `|`.
    fn typed(text: &str, expected: &str) {
        let at = text.find('|').unwrap_or_default();
        let text = text.replacen('|', "", 1);
        let letter = text[..at].chars().next_back().unwrap_or_default();
        let found = format_on_type(&crate::parse(&text), TextSize::new(at as u32), letter, &|| ());
        assert_eq!(applied(&text, &found), expected);
    }

    #[test]
    fn while_typing() {
        // Formats the item that ends, and no text around it.
        typed("core C(S) {\nvar  a:int;|\nvar  b:int\n}", "core C(S) {\n  var a: int;\nvar  b:int\n}");
        typed(
            "core C(S) {\nupdate={\nf( a );\n}|\nstop={}\n}",
            "core C(S) {\n  update = {\n    f(a);\n  }\nstop={}\n}",
        );
        // A new line is indented like its future text.
        typed("core C(S) {\nvar  b:int\n|\n}", "core C(S) {\n  var b: int\n  \n}");
        typed("core C(S) {\n  update = {\n|", "core C(S) {\n  update = {\n    ");
        typed("core C(S) {\n  update = {\n|}\n}", "core C(S) {\n  update = {\n  }\n}");
        typed("codel f(in a: int,\n|): bool", "codel f(in a: int,\n        ): bool");
        typed("codel f(\n|", "codel f(\n  ");
        typed("core C(S) {\n  var a: int =\n|\n}", "core C(S) {\n  var a: int =\n      \n}");
        // No formatting in a comment.
        typed("/* a\n|\n*/", "/* a\n\n*/");
        typed("// a;|", "// a;");
    }
}
