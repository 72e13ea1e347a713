//! Wraps generated code to lines of at most 100 columns, aligned with the enclosing bracket.
//!
//! ```text
//! found = MAUVE_TRACE_CODEL(getName(), "navigation.astar",
//!                           ::navigation::astar(here, destination, grid, resolution, route));
//! ```

use super::expression::CodeLine;
use crate::origin::{WIDTH, wrapped};

/// Tokens after which a line may be broken.
const BREAKS: [&str; 14] =
    [", ", "&& ", "|| ", " == ", " != ", " < ", " <= ", " > ", " >= ", " + ", " - ", " * ", " / ", " % "];

#[derive(Default)]
pub(super) struct CodeText {
    pub(super) out: String,
}

impl CodeText {
    pub(super) fn line(&mut self, depth: usize, line: impl AsRef<str>) {
        let (line, indent) = (line.as_ref(), 2 * depth);
        let mut lines = WrappedLines { out: String::new(), column: 0 };
        lines.pad(indent);
        match line.strip_prefix("// ") {
            Some(comment) => lines.comment(comment, indent),
            None => {
                let log = line.find(" << ").filter(|_| line.starts_with("RTT::log("));
                lines.code(line, indent + log.map_or(4, |at| at + 1), 0);
            }
        }
        self.out += &lines.out;
        self.out.push('\n');
    }

    pub(super) fn lines(&mut self, lines: &[CodeLine]) {
        lines.iter().for_each(|line| self.line(line.depth, &line.text));
    }

    /// Writes lines with aligned trailing comments.
    pub(super) fn commented(&mut self, depth: usize, lines: &[(String, String)]) {
        let width = |line: &str| line.chars().count();
        let widest = lines.iter().map(|(line, _)| width(line)).max().unwrap_or_default();
        for (line, comment) in lines {
            if line.is_empty() {
                self.line(depth, format!("// {comment}"));
                continue;
            }
            let full = format!("{line:widest$}  // {comment}");
            if 2 * depth + width(&full) <= WIDTH {
                self.line(depth, full);
            } else {
                self.line(depth, format!("// {comment}"));
                self.line(depth, line);
            }
        }
    }

    /// Writes a function, and an empty line.
    pub(super) fn function(&mut self, head: &str, body: impl FnOnce(&mut CodeText)) {
        self.line(0, format!("{head} {{"));
        body(self);
        self.line(0, "}");
        self.gap();
    }

    pub(super) fn gap(&mut self) {
        self.out.push('\n');
    }
}

struct WrappedLines {
    out: String,
    column: usize,
}

impl WrappedLines {
    fn push(&mut self, text: &str) {
        self.out += text;
        self.column += text.chars().count();
    }

    fn pad(&mut self, columns: usize) {
        self.push(&" ".repeat(columns));
    }

    fn next(&mut self, column: usize) {
        self.out.truncate(self.out.trim_end_matches(' ').len());
        self.out.push('\n');
        self.column = 0;
        self.pad(column);
    }

    fn comment(&mut self, text: &str, indent: usize) {
        for (index, line) in
            wrapped(text.split(' '), WIDTH.saturating_sub(indent + 3)).into_iter().enumerate()
        {
            if index > 0 {
                self.next(indent);
            }
            self.push(&format!("// {line}"));
        }
    }

    /// Breaks a text without other break points: a long literal becomes several literals, which C++ concatenates.
    fn words(&mut self, text: &str, tail: usize) {
        let (mut literal, mut escaped) = (None, false);
        for word in text.split_inclusive(' ') {
            // Reserves a column for the closing quotation mark.
            let is_wide = self.column + word.chars().count() + tail.max(1) > WIDTH;
            if let Some(column) = literal.filter(|column| is_wide && *column + 1 < self.column) {
                self.push("\"");
                self.next(column);
                self.push("\"");
            }
            for c in word.chars() {
                match c {
                    _ if escaped => escaped = false,
                    '\\' => escaped = literal.is_some(),
                    '"' => literal = if literal.is_some() { None } else { Some(self.column) },
                    _ => {}
                }
                self.out.push(c);
                self.column += 1;
            }
        }
    }

    /// Writes `text`, with continuation lines at column `base`, and reserves `tail` columns after it.
    fn code(&mut self, text: &str, base: usize, tail: usize) {
        let width = text.chars().count();
        if self.column + width + tail <= WIDTH {
            self.push(text);
            return;
        }
        let pieces = pieces(text);
        let count = pieces.len();
        for (index, piece) in pieces.into_iter().enumerate() {
            let tail = if index + 1 == count { tail } else { 0 };
            let width = piece.trim_end().chars().count() + tail;
            if self.column + width <= WIDTH {
                self.push(piece);
                continue;
            }
            if index > 0 && self.column > base {
                self.next(base);
            }
            let Some((head, inner, rest)) = split(piece).filter(|_| self.column + width > WIDTH) else {
                self.words(piece, tail);
                continue;
            };
            let behind = rest.trim_end().chars().count() + tail;
            let column = self.column + head.chars().count();
            let value = head.find(" = ").map(|at| at + " = ".len());
            match value.and_then(|at| Some((head.get(..at)?, piece.get(at..)?))) {
                // The value fits better on separate lines.
                Some((target, value)) if !fits(inner, column, behind) && fits(value, base, tail) => {
                    self.push(target);
                    self.next(base);
                    self.code(value, base, tail);
                }
                _ if !fits(inner, column, behind) && fits(inner, base, behind) && column > base => {
                    self.push(head);
                    self.next(base);
                    self.code(inner, base, behind);
                    self.push(rest);
                }
                _ => {
                    self.push(head);
                    self.code(inner, column, behind);
                    self.push(rest);
                }
            }
        }
    }
}

/// Do the parts of `text` fit on lines that begin at `column`?
fn fits(text: &str, column: usize, tail: usize) -> bool {
    let pieces = pieces(text);
    let count = pieces.len();
    let fits_line = |(index, piece): (usize, &&str)| {
        let tail = if index + 1 == count { tail } else { 0 };
        column + piece.trim_end().chars().count() + tail <= WIDTH
    };
    if count == 1 && column + text.chars().count() + tail > WIDTH {
        return split(text).is_some_and(|(head, inner, rest)| {
            fits(inner, column + head.chars().count(), rest.chars().count() + tail)
        });
    }
    pieces.iter().enumerate().all(fits_line)
}

/// Splits an expression or a list after the tokens at which a line may be broken.
fn pieces(text: &str) -> Vec<&str> {
    let mut cuts = Vec::new();
    scan(text, |at, depth| {
        if depth > 0 {
            return;
        }
        let rest = text.get(at..).unwrap_or_default();
        let behind = BREAKS.into_iter().find(|it| rest.starts_with(it));
        if let Some(found) = behind {
            cuts.push(at + found.len());
        }
        if rest.starts_with("<< ") || rest.starts_with(".doc(") || rest.starts_with(".arg(") {
            cuts.push(at);
        }
    });
    let mut found = Vec::new();
    let mut start = 0;
    for cut in cuts.into_iter().chain([text.len()]) {
        found.extend(text.get(start..cut).filter(|piece| !piece.is_empty()));
        start = cut;
    }
    found
}

/// Splits a call into `f(`, the content of the last parentheses, and `)` with the rest.
fn split(text: &str) -> Option<(&str, &str, &str)> {
    let (mut open, mut close) = (None, None);
    let mut was = 0;
    scan(text, |at, depth| {
        if depth > was && was == 0 {
            (open, close) = (Some(at), None);
        }
        if depth == 0 && was > 0 {
            close = Some(at.saturating_sub(1));
        }
        was = depth;
    });
    let (open, close) = (open?, close.unwrap_or(text.len()));
    Some((text.get(..open)?, text.get(open..close)?, text.get(close..)?))
}

/// Calls `see` for each place in a text that is not in a literal, with the number of parentheses around it.
fn scan(text: &str, mut see: impl FnMut(usize, usize)) {
    let (mut depth, mut in_literal, mut escaped) = (0_usize, false, false);
    for (at, byte) in text.bytes().enumerate() {
        if !in_literal {
            see(at, depth);
        }
        match byte {
            _ if escaped => escaped = false,
            b'\\' if in_literal => escaped = true,
            b'"' => in_literal = !in_literal,
            b'(' if !in_literal => depth += 1,
            b')' if !in_literal => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    see(text.len(), depth);
}
