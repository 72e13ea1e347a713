//! Escapes texts of a model as literals of the generated languages. A text may contain any character.

/// Returns a text as a C++ string literal.
///
/// Octal escapes end after three digits, wherever the text goes on; `?` may begin a trigraph.
pub(crate) fn cpp_string(text: &str) -> String {
    let mut out = String::from("\"");
    for byte in text.bytes() {
        match byte {
            b'"' | b'\\' => out.extend(['\\', byte as char]),
            b'\n' => out += "\\n",
            b'\t' => out += "\\t",
            b' '..=b'~' if byte != b'?' => out.push(byte as char),
            _ => out += &format!("\\{byte:03o}"),
        }
    }
    out + "\""
}

/// Returns a text as a literal of Lua 5.1: characters that are not printable ASCII become decimal escapes of three
/// digits.
pub(crate) fn lua_string(text: &str) -> String {
    let mut out = String::from("\"");
    for byte in text.bytes() {
        match byte {
            b'"' | b'\\' => out.extend(['\\', byte as char]),
            b' '..=b'~' => out.push(byte as char),
            _ => out += &format!("\\{byte:03}"),
        }
    }
    out + "\""
}

/// Escapes a text for XML, in an attribute or between tags. Characters that are invalid in XML 1.0 become U+FFFD.
pub(crate) fn xml(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&apos;",
            '\n' | '\t' | '\r' => out += &format!("&#{};", u32::from(c)),
            '\0'..='\x1f' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Returns a text for a comment: on one line, and without sequences that end a comment, such as `*/` and `-->`, or
/// that compilers warn about.
pub(crate) fn comment(text: &str) -> String {
    // Bidirectional control characters show the reader a different text from the one that the compiler reads.
    let is_turn =
        |c: char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let mut line: String = text.chars().map(|c| if c.is_control() || is_turn(c) { ' ' } else { c }).collect();
    // `??/` is a backslash, which would join the next line at the end of a line.
    for (pair, apart) in [("*/", "* /"), ("/*", "/ *"), ("--", "- -"), ("??", "? ?")] {
        while line.contains(pair) {
            line = line.replace(pair, apart);
        }
    }
    line.trim_end_matches(['\\', ' ']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_breaks_out_of_a_literal() {
        let hostile = "a\"; evil(\"\\\n\r\0??/é1";
        assert_eq!(cpp_string(hostile), r#""a\"; evil(\"\\\n\015\000\077\077/\303\2511""#);
        assert_eq!(lua_string(hostile), r#""a\"; evil(\"\\\010\013\000??/\195\1691""#);
        assert_eq!(xml("<a b='\"'>&\u{1}\n"), "&lt;a b=&apos;&quot;&apos;&gt;&amp;\u{fffd}&#10;");
        assert_eq!(comment("a\n*/ --> b \\ \\"), "a * / - -> b");
        assert_eq!(comment("---- ???/ /*/ \u{202e}b??/"), "- - - - ? ? ?/ / * /  b? ?/");
    }
}
