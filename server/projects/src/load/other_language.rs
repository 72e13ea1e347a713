//! Recognises texts of the Meta Attack Language, whose files have the extension of models.

use mauve_syntax::keywords::DECLARATIONS;

/// Returns whether a `.mal` text is in the Meta Attack Language: after comments and includes, it begins with `#id:
/// "…"`, `category X {` or `associations {`, and no line begins a MAUVE declaration, which would be ignored.
pub fn is_of_another_language(text: &str) -> bool {
    let is_declaration = |line: &str| {
        let mut words = line.split_whitespace();
        // The Meta Attack Language has includes too.
        let is_ours = |word: &str| DECLARATIONS.contains(&word) && word != "include";
        words.next().is_some_and(is_ours) && words.next().is_some()
    };
    if text.lines().any(is_declaration) {
        return false;
    }
    let lexed = mauve_syntax::lex(text);
    let tokens = (0..lexed.len()).filter(|&index| !lexed.kind(index).is_trivia());
    let tokens: Vec<&str> = tokens.filter_map(|index| text.get(lexed.range(index))).collect();
    // Also after a brace, and after a line break that editors do not recognise.
    let is_word = |token: &str| token.starts_with(|letter: char| letter.is_alphabetic() || letter == '_');
    let declares = |pair: &[&str]| match pair {
        [keyword, name] => DECLARATIONS.contains(keyword) && *keyword != "include" && is_word(name),
        _ => false,
    };
    if tokens.windows(2).any(declares) {
        return false;
    }
    let mut tokens = tokens.into_iter().peekable();
    while tokens.next_if_eq(&"include").is_some() {
        tokens.next_if(|path| path.starts_with('"'));
    }
    let is_name = |word: &str| word.starts_with(char::is_alphabetic);
    match (tokens.next(), tokens.next(), tokens.next()) {
        (Some(define), ..) if define.starts_with('#') => is_define(define),
        (Some("category"), Some(name), Some("{")) => is_name(name),
        (Some("associations"), Some("{"), _) => true,
        _ => false,
    }
}

/// Returns whether a token from `#` to the end of its line is a definition of the Meta Attack Language, such as
/// `#id: "org.example.lang"`, with at most a comment after it.
fn is_define(token: &str) -> bool {
    let parts = token.strip_prefix('#').and_then(|rest| rest.split_once(':'));
    let Some((name, value)) = parts else { return false };
    let value = value.trim_start().strip_prefix('"').and_then(|value| value.split_once('"'));
    let ends = |rest: &str| rest.is_empty() || rest.starts_with("//");
    name.trim().chars().all(char::is_alphanumeric)
        && !name.trim().is_empty()
        && value.is_some_and(|(_, rest)| ends(rest.trim_start_matches([' ', '\t'])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_language_of_this_extension_is_known_by_its_beginning() {
        for text in [
            "#id: \"org.example.lang\"\n#version: \"1.0.0\"\ncategory System { asset Host { } }",
            "// a comment\ninclude \"core.mal\"\n#version: \"1.0.0\"\n",
            "category System {",
            "/* c */ associations { Host [a] * <-- }",
        ] {
            assert!(is_of_another_language(text), "{text}");
        }
        for text in [
            "",
            "include \"a.mal\"",
            "library a { }",
            "# a comment of another kind\ncodel f(): int",
            "category",
            "codel category(): int",
            "category Drivers",
            "# TODO: shorten",
            "# TODO: say \"a\" here",
            "#id: \"a\" deployment D { architecture A }",
            "#id: \"a\"\ndeployment D { architecture A }",
            "category System { }\n  component K(S, C)",
            "category X { } deployment D { architecture A }",
            "#id: \"a\"\rdeployment D { architecture A }\r",
        ] {
            assert!(!is_of_another_language(text), "{text}");
        }
    }
}
