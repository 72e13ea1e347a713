//! The parts of a Rust source that tests look at: its code without tests, and its string literals.

/// Returns a source up to its module of tests.
pub fn without_tests(text: &str) -> &str {
    text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default()
}

/// Returns the string literals of a Rust source, each with the line where it begins, counted from 1.
///
/// Escapes are resolved; comments and character literals are skipped. The scanner handles the sources of this
/// workspace, not all of Rust: it has no nested block comments.
pub fn literals(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let (mut at, mut line) = (0, 1);
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(hashes) = raw_string(text, at) {
            let begin = hashes + 2;
            let close = format!("\"{}", "#".repeat(hashes));
            let length = rest[begin..].find(&close).unwrap_or(rest.len() - begin);
            found.push((line, rest[begin..begin + length].to_owned()));
            (begin + length + close.len()).min(rest.len())
        } else if rest.starts_with('\'') {
            character(rest)
        } else if rest.starts_with('"') {
            let (literal, length) = string(rest);
            found.push((line, literal));
            length
        } else {
            rest.chars().next().map_or(1, char::len_utf8)
        };
        line += text[at..at + length].matches('\n').count();
        at += length;
    }
    found
}

/// Returns the number of `#` of the raw string that begins at an offset, if one does.
fn raw_string(text: &str, at: usize) -> Option<usize> {
    let rest = text[at..].strip_prefix('r')?;
    let hashes = rest.len() - rest.trim_start_matches('#').len();
    let in_a_word = text[..at].ends_with(|letter: char| letter.is_alphanumeric() || letter == '_');
    (rest[hashes..].starts_with('"') && !in_a_word).then_some(hashes)
}

/// Returns the length of a character literal, or 1 for the apostrophe of a lifetime.
fn character(rest: &str) -> usize {
    let mut letters = rest.char_indices().skip(1);
    match letters.next() {
        Some((_, '\\')) => 3 + rest.get(3..).and_then(|rest| rest.find('\'')).unwrap_or(0) + 1,
        _ => letters.next().filter(|(_, letter)| *letter == '\'').map_or(1, |(end, _)| end + 1),
    }
}

/// Returns the text of a string literal, and its length in the source.
fn string(rest: &str) -> (String, usize) {
    let mut literal = String::new();
    let mut letters = rest.char_indices().skip(1).peekable();
    while let Some((at, letter)) = letters.next() {
        match letter {
            '"' => return (literal, at + 1),
            '\\' => match letters.next() {
                Some((_, 'n')) => literal.push('\n'),
                Some((_, 't')) => literal.push('\t'),
                Some((_, '\n')) => while letters.next_if(|(_, letter)| letter.is_whitespace()).is_some() {},
                Some((_, letter)) => literal.push(letter),
                None => {}
            },
            letter => literal.push(letter),
        }
    }
    (literal, rest.len())
}
