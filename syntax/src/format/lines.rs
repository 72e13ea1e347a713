//! The lines of a text.

use rowan::TextRange;

use super::replacement::range;

/// Returns the range from the beginning of the first line of `lines` to the end of the last one, without its line
/// break.
pub(super) fn lines_of(text: &str, lines: TextRange) -> TextRange {
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

/// Returns the number of line breaks.
pub(super) fn breaks(text: &str) -> usize {
    text.matches(['\n', '\r']).count() - text.matches("\r\n").count()
}

/// Returns the offset of the last line.
pub(super) fn last_line(text: &str) -> usize {
    text.rfind(['\n', '\r']).map_or(0, |at| at + 1)
}

/// Returns the number of characters.
pub(super) fn width(text: &str) -> usize {
    text.chars().count()
}
