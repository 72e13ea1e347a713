//! Comments that suppress a diagnostic: `// mauve: allow(CODE) reason`, on the line of the diagnostic or above it. In
//! `mauve.toml` and in timing tables, such a comment begins with `#`.
//!
//! A comment hides a diagnostic and has no other effect: a hidden error prevents the analysis as well, and `mauve check` fails
//! while a deadline is not proved.

use std::ops::Range;

use mauve_hir::line_of;

use super::*;

/// The codes that no comment suppresses: behind such an error, a whole deployment may be unknown.
pub(crate) const NEVER_SUPPRESSED: [&str; 3] = ["invalid-table", "syntax-error", "unreadable-file"];

/// A comment that suppresses the diagnostics of one code on one line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Allow {
    /// The code, as it is written.
    pub(crate) code: String,
    /// The range of the code.
    pub(crate) code_span: Range<usize>,
    /// The reason; empty if there is none. Without a reason, the comment suppresses nothing.
    pub(crate) reason: String,
    /// The line of the diagnostics, from 1.
    pub(crate) line: usize,
    /// The range of the comment.
    pub(crate) span: Range<usize>,
    /// The range to delete in order to remove the comment: its line if it is alone there.
    pub(crate) deletion: Range<usize>,
}

/// The comments of a file that suppress diagnostics.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Allows {
    /// In the order of the text.
    pub(crate) all: Vec<Allow>,
    /// The indices of those that suppress something: the first for each line and code.
    by_line: FxHashMap<(usize, &'static str), usize>,
}

impl Allows {
    /// Returns the index and the reason of the comment that suppresses a diagnostic with this code on the line that contains
    /// the offset.
    pub(crate) fn at(
        &self,
        db: &dyn ModelDb,
        file: File,
        offset: TextSize,
        code: &Code,
    ) -> Option<(usize, &str)> {
        if self.by_line.is_empty() || NEVER_SUPPRESSED.contains(&code.name) {
            return None;
        }
        let index = *self.by_line.get(&(line_of(db, file, offset), code.name))?;
        Some((index, &self.all.get(index)?.reason))
    }
}

/// Returns the comments of a file that suppress diagnostics.
#[salsa::tracked(returns(ref))]
pub(crate) fn allows(db: &dyn ModelDb, file: File) -> Allows {
    let text = file.text(db);
    let mut found = Allows::default();
    if !text.contains("allow(") {
        return found;
    }
    let pieces = if is_model(file.path(db)) { pieces_of_model(text) } else { pieces_of_toml(text) };
    let line = |offset: usize| line_of(db, file, (offset as u32).into());
    for (index, piece) in pieces.iter().enumerate() {
        let Some((code_span, reason)) = piece.is_comment.then(|| parse(text, &piece.span)).flatten() else {
            continue;
        };
        let is_other = |it: &&AllowPiece| !it.is_comment;
        let before = pieces.iter().take(index).rev().find(is_other);
        let own_line = line(piece.span.start);
        let is_alone = before.is_none_or(|before| line(before.span.end) < own_line);
        let next = || pieces.iter().skip(index).find(is_other).map_or(0, |next| line(next.span.start));
        found.all.push(Allow {
            code: text.get(code_span.clone()).unwrap_or_default().to_owned(),
            code_span,
            reason: reason.to_owned(),
            line: if is_alone { next() } else { own_line },
            deletion: deletion(text, &piece.span),
            span: piece.span.clone(),
        });
    }
    for (index, allow) in found.all.iter().enumerate().filter(|(_, allow)| !allow.reason.is_empty()) {
        if let Some(code) = code_named(&allow.code) {
            found.by_line.entry((allow.line, code.name)).or_insert(index);
        }
    }
    found
}

/// A token, or a line of TOML without its comment; or a comment of one line.
struct AllowPiece {
    is_comment: bool,
    span: Range<usize>,
}

fn pieces_of_model(text: &str) -> Vec<AllowPiece> {
    let lexed = mauve_syntax::lex(text);
    let tokens = (0..lexed.len()).map(|index| (lexed.kind(index), lexed.range(index)));
    let piece = |(kind, span): (mauve_syntax::SyntaxKind, Range<usize>)| {
        let is_comment = text.get(span.clone()).is_some_and(|text| text.starts_with("//"));
        (is_comment || !kind.is_trivia()).then_some(AllowPiece { is_comment, span })
    };
    tokens.filter_map(piece).collect()
}

fn pieces_of_toml(text: &str) -> Vec<AllowPiece> {
    let mut found = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let mut quote = None;
        let comment = line.char_indices().find(|(_, letter)| {
            match (letter, quote) {
                ('"' | '\'', None) => quote = Some(*letter),
                (_, Some(open)) if open == *letter => quote = None,
                _ => {}
            }
            *letter == '#' && quote.is_none()
        });
        let content = comment.map_or(line, |(at, _)| line.get(..at).unwrap_or_default()).trim_end();
        if !content.trim().is_empty() {
            found.push(AllowPiece { is_comment: false, span: start..start + content.len() });
        }
        if let Some((at, _)) = comment {
            found.push(AllowPiece { is_comment: true, span: start + at..start + line.trim_end().len() });
        }
        start += line.len();
    }
    found
}

/// Returns the range of the code and the reason of a comment; `None` for other comments.
fn parse<'t>(text: &'t str, span: &Range<usize>) -> Option<(Range<usize>, &'t str)> {
    let comment = text.get(span.clone())?;
    let content = comment.trim_start_matches(['/', '#']).trim_start().strip_prefix("mauve:")?;
    let rest = content.trim_start().strip_prefix("allow(")?;
    let (code, reason) = rest.split_once(')')?;
    let start = span.start + (comment.len() - rest.len()) + (code.len() - code.trim_start().len());
    // A comment may follow, which is no reason.
    let reason = Some(reason.trim()).filter(|reason| !reason.starts_with("//") && !reason.starts_with('#'));
    Some((start..start + code.trim().len(), reason.unwrap_or_default()))
}

/// Returns the range of a comment with the white space before it, and with its line break if nothing else is on its line.
fn deletion(text: &str, span: &Range<usize>) -> Range<usize> {
    let before = text.get(..span.start).unwrap_or_default();
    let start = before.trim_end_matches([' ', '\t']).len();
    let is_line = start == 0 || before.get(..start).is_some_and(|before| before.ends_with('\n'));
    let rest = text.get(span.end..).unwrap_or_default();
    let line_break = rest.len() - rest.strip_prefix("\r\n").or(rest.strip_prefix('\n')).unwrap_or(rest).len();
    start..span.end + if is_line { line_break } else { 0 }
}
