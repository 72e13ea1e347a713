//! Markdown as plain text: for clients that show no Markdown in hovers, completions and signatures.

/// Returns the text of Markdown: code without its signs, links by their names, and signs instead of their escapes.
pub(crate) fn plain_text(markdown: &str) -> String {
    let mut out: Vec<String> = Vec::new();
    let mut fence: Option<&str> = None;
    for line in markdown.lines() {
        let run = line.trim_start().trim_end_matches(|sign| sign != '`').len();
        let sign = line.trim_start().get(..run).filter(|it| it.len() >= 3 && it.bytes().all(|it| it == b'`'));
        match (fence, sign) {
            (Some(open), _) if line == open => fence = None,
            (Some(_), _) => out.push(line.to_owned()),
            (None, Some(open)) => fence = Some(open),
            (None, None) => out.push(inline(line.trim_start_matches('#').trim_end())),
        }
    }
    out.join("\n").trim().to_owned()
}

/// Returns a line without the signs of code, emphasis and links.
fn inline(line: &str) -> String {
    let mut out = String::new();
    let mut rest = line;
    while let Some(sign) = rest.chars().next() {
        let (taken, left) =
            rest.split_at(rest.chars().take_while(|it| *it == sign).map(char::len_utf8).sum());
        let (text, behind) = match sign {
            '`' => code(taken, left),
            '*' | '_' => emphasised(out.chars().next_back(), taken, left),
            '[' => linked(rest),
            '&' => {
                ENTITIES.iter().find_map(|(name, sign)| Some(((*sign).to_owned(), rest.strip_prefix(name)?)))
            }
            '\\' => escaped(rest),
            _ => None,
        }
        .unwrap_or_else(|| (taken.to_owned(), left));
        out += &text;
        rest = behind;
    }
    out
}

/// A text, and what is behind it.
type Taken<'a> = Option<(String, &'a str)>;

fn escaped(text: &str) -> Taken<'_> {
    let behind = text.strip_prefix('\\')?;
    let sign = behind.chars().next().filter(char::is_ascii_punctuation)?;
    Some((sign.to_string(), behind.strip_prefix(sign)?))
}

fn code<'a>(fence: &str, behind: &'a str) -> Taken<'a> {
    let (code, behind) = behind.split_once(fence)?;
    let inner = code.strip_prefix(' ').and_then(|it| it.strip_suffix(' '));
    Some((inner.filter(|inner| inner.contains('`')).unwrap_or(code).to_owned(), behind))
}

const ENTITIES: [(&str, &str); 5] =
    [("&lt;", "<"), ("&gt;", ">"), ("&nbsp;", " "), ("&quot;", "\""), ("&amp;", "&")];

/// Takes what is between `signs` that begin and end an emphasis: not in `a * b` and `snake_case`.
fn emphasised<'a>(before: Option<char>, signs: &str, behind: &'a str) -> Taken<'a> {
    let (inner, rest) = behind.split_once(signs)?;
    let is_apart = |sign: Option<char>| sign.is_none_or(|sign| !sign.is_alphanumeric());
    let is_tight = !inner.is_empty() && inner.trim() == inner;
    (is_tight && is_apart(before) && is_apart(rest.chars().next())).then(|| (inline(inner), rest))
}

/// Takes the name of `[name](address)`.
fn linked(text: &str) -> Taken<'_> {
    let (name, rest) = text.strip_prefix('[')?.split_once("](")?;
    let (_, behind) = rest.split_once(')')?;
    (!name.contains(']')).then(|| (inline(name), behind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_of_markdown_are_gone_and_those_of_the_text_stay() {
        for (markdown, text) in [
            ("**6 ms** of `a_b` and ``x`y``, `` ` ``", "6 ms of a_b and x`y, `"),
            ("[`f`](file:///a%20b.mal#L1,7) [0; 1] m", "f [0; 1] m"),
            ("a\\_b \\*c\\* \\\\ &lt;b>&nbsp;&amp;lt;", "a_b *c* \\ <b> &lt;"),
            (
                "5 * 3 * 2, snake_case_name, *args, _never_, a*b*c",
                "5 * 3 * 2, snake_case_name, *args, never, a*b*c",
            ),
            ("a ` b, \u{e9}\u{1f980} ![x]\\(y)", "a ` b, \u{e9}\u{1f980} ![x](y)"),
            ("# Title\n\n> quoted\n- one\n\n---\nend", "Title\n\n> quoted\n- one\n\n---\nend"),
            ("```mauve\na_b * **c**\n| x |\n```\n`d`", "a_b * **c**\n| x |\nd"),
            ("````text\n```\n[x](y)\n````\nend", "```\n[x](y)\nend"),
            ("", ""),
        ] {
            assert_eq!(plain_text(markdown), text.trim(), "{markdown:?}");
        }
    }

    #[test]
    fn any_text_is_converted() {
        let pieces = [
            "`",
            "``",
            "```",
            "**",
            "_",
            "\\",
            "[",
            "](",
            ")",
            "|",
            "&lt;",
            "\n",
            "a",
            " ",
            "\u{1f980}",
            "#",
        ];
        let mut random = mauve_tests::Random(0x2545_f491_4f6c_dd1d);
        for _ in 0..20_000 {
            let text: Vec<&str> = (0..random.below(24)).map(|_| *random.of(&pieces)).collect();
            let text = text.concat();
            let plain = plain_text(&text);
            assert!(plain.matches('a').count() <= text.matches('a').count(), "{text:?}: {plain:?}");
            assert!(plain.matches('\u{1f980}').count() <= text.matches('\u{1f980}').count(), "{text:?}");
        }
    }
}
