//! Replacements of ranges of a text.

use std::ops::Range;

use rowan::{TextRange, TextSize};

/// The replacement of a range of a text; the formatter replaces white space by white space.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replacement {
    /// The replaced range; empty for an insertion.
    pub range: TextRange,
    /// The new text of the range.
    pub text: String,
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

/// Returns the replacement of `old` at `start`, if `new` differs.
pub(super) fn replacement(start: usize, old: &str, new: String) -> Option<Replacement> {
    (old != new).then(|| Replacement { range: range(start..start + old.len()), text: new })
}

/// Returns a range of bytes as a range of the tree.
pub(super) fn range(of: Range<usize>) -> TextRange {
    TextRange::new(TextSize::new(of.start as u32), TextSize::new(of.end as u32))
}
