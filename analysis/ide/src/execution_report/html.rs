//! Texts in HTML.

use crate::drawing::svg_text;

/// Returns a text from outside, escaped. Characters that no reader sees, or that reorder a line, are replaced.
pub(super) fn text(outside: &str) -> String {
    let is_hidden = |letter: char| {
        letter.is_control()
            || matches!(letter, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}')
    };
    svg_text(&outside.replace(is_hidden, "\u{fffd}")).replace('\'', "&#39;")
}

/// Returns a name in code, with the places where a narrow column may break it.
pub(super) fn code(name: &str) -> String {
    let mut out = "<code>".to_owned();
    for part in name.split_inclusive(['.', '/', '_', '(', ',', ':']) {
        out += &text(part);
        out += "<wbr/>";
    }
    out.truncate(out.len() - if name.is_empty() { 0 } else { "<wbr/>".len() });
    out + "</code>"
}
