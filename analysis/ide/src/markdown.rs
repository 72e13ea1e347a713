//! Markdown of untrusted texts: comments of models, names of files, texts of tables.
//!
//! Editors render hovers unasked, so the result loads no picture, has no link except visible addresses and those of [`Links`], no
//! HTML, and no code that extends beyond its own text.

use mauve_hir::{Location, ModelDb};

/// Returns the address of a location for a link, such as `file:///robot.mal#L12,5`; `None` where the client has none.
pub type Links<'a> = &'a dyn Fn(&dyn ModelDb, &Location<'_>) -> Option<String>;

/// Returns a name as code, with a link to its location if that has an address.
pub(crate) fn link(db: &dyn ModelDb, links: Links<'_>, name: &str, at: Option<&Location<'_>>) -> String {
    let Some(address) = at.and_then(|at| links(db, at)) else { return code(name) };
    // Parentheses end the address, and a bar ends the cell of a table.
    let escaped = |sign: char| match sign {
        '(' | ')' | '|' | '<' | '>' | '\\' => format!("%{:02X}", u32::from(sign)),
        sign if sign.is_whitespace() || sign.is_control() => "%20".to_owned(),
        sign => sign.to_string(),
    };
    format!("[{}]({})", code(name), address.chars().map(escaped).collect::<String>())
}

/// Returns a bar of block characters for a share of the whole, in eighths of a character; at least one eighth unless it is 0.
///
/// A bar of 20 characters is the whole.
pub(crate) fn bar(share: f64) -> String {
    const WIDTH: f64 = 20.0;
    const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    if share.is_nan() || share <= 0.0 {
        return String::new();
    }
    let eighths = ((share.min(1.0) * WIDTH * 8.0).round() as usize).max(1);
    "█".repeat(eighths / 8) + EIGHTHS.get(eighths % 8).copied().unwrap_or_default()
}

/// Returns a text as code in a line, whatever signs it has.
pub fn code(text: &str) -> String {
    let text = text.replace(char::is_control, "\u{fffd}");
    let fence = "`".repeat(longest_run(&text) + 1);
    let space = if text.starts_with('`') || text.ends_with('`') { " " } else { "" };
    format!("{fence}{space}{text}{space}{fence}")
}

pub(crate) fn block(language: &str, text: &str) -> String {
    let fence = "`".repeat(longest_run(text).max(2) + 1);
    format!("{fence}{language}\n{}\n{fence}\n", text.trim_end_matches('\n'))
}

/// Returns words of a line, with names in backquotes as code; their other marks are no Markdown.
pub(crate) fn words(text: &str) -> String {
    plain(&text.replace(['\n', '\r'], " "))
}

/// Renders a comment: emphasis, lists and code remain. Pictures, links and HTML become plain text.
pub(crate) fn comment(text: &str) -> String {
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    let mut out = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        match fence(line) {
            // Rewritten, because a list would end it early; it ends with the comment.
            Some((fence, language)) => {
                let inner: Vec<&str> = lines.by_ref().take_while(|line| !is_end(line, fence)).collect();
                out += &block(language, &inner.join("\n"));
            }
            None => {
                out += &plain(line);
                out.push('\n');
            }
        }
    }
    out.trim_end().to_owned()
}

fn fence(line: &str) -> Option<(&str, &str)> {
    let line = line.trim();
    let sign = line.chars().next().filter(|sign| matches!(sign, '`' | '~'))?;
    let (fence, rest) = line.split_at(run(line));
    // Otherwise it is inline code.
    let is_fence = fence.len() >= 3 && (sign == '~' || !rest.contains('`'));
    let is_letter = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '_' | '#');
    let language = rest.split_whitespace().next().filter(|word| word.chars().all(is_letter));
    is_fence.then_some((fence, language.unwrap_or_default()))
}

fn is_end(line: &str, fence: &str) -> bool {
    let line = line.trim();
    line.starts_with(fence) && run(line) == line.len()
}

/// Renders a line of a comment outside of code blocks.
///
/// Markdown renderers disagree where inline code begins and ends, for example after an address. So text in inline code is
/// escaped as well.
fn plain(line: &str) -> String {
    let mut out = String::new();
    let mut rest = line;
    let mut before = None;
    while let Some(sign) = rest.chars().next() {
        let next = rest.chars().nth(1);
        let taken = match sign {
            '`' => match code_span(rest) {
                Some(span) => {
                    out += span;
                    span.len()
                }
                None => {
                    out += &"\\`".repeat(run(rest));
                    run(rest)
                }
            },
            '~' if run(rest) >= 3 => {
                out += &"\\~".repeat(run(rest));
                run(rest)
            }
            // The replacement of `<` cannot be escaped by a preceding backslash.
            '\\' if next == Some('<') => 1,
            '\\' if next.is_some_and(|next| next.is_ascii_punctuation()) => {
                out.extend([sign].into_iter().chain(next));
                2
            }
            '<' if next.is_some_and(begins_tag) => {
                out += "&lt;";
                1
            }
            // `[text](address)` and `[text]: address`.
            '(' | ':' if before == Some(']') => {
                out.extend(['\\', sign]);
                1
            }
            _ => {
                out.push(sign);
                sign.len_utf8()
            }
        };
        let (done, left) = rest.split_at(taken);
        before = done.chars().next_back();
        rest = left;
    }
    out
}

/// Returns the inline code at the start of a line, if it ends on the line and is harmless outside of code.
fn code_span(line: &str) -> Option<&str> {
    let begin = run(line);
    let mut at = begin;
    loop {
        at += line.get(at..)?.find('`')?;
        let end = run(line.get(at..)?);
        at += end;
        if end == begin {
            return line.get(..at).filter(|span| !is_active(span));
        }
    }
}

fn is_active(text: &str) -> bool {
    text.contains("](") || text.contains("]:") || text.split('<').skip(1).any(|it| it.starts_with(begins_tag))
}

/// A tag, an address between angle brackets, or a comment of HTML.
fn begins_tag(next: char) -> bool {
    next.is_ascii_alphabetic() || matches!(next, '/' | '!' | '?')
}

/// Returns the length of the run of the first character, which is ASCII.
fn run(text: &str) -> usize {
    let first = text.chars().next();
    text.chars().take_while(|sign| Some(*sign) == first).count()
}

fn longest_run(text: &str) -> usize {
    text.split(|c: char| c != '`').map(str::len).max().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use mauve_tests::Random;

    #[test]
    fn code_is_code_whatever_it_says() {
        assert_eq!(code("times.toml"), "`times.toml`");
        assert_eq!(code("a`b"), "``a`b``");
        assert_eq!(code("`"), "`` ` ``");
        assert_eq!(code("a\n![x](y)"), "`a\u{fffd}![x](y)`");
        assert_eq!(block("text", "a\nb\n"), "```text\na\nb\n```\n");
        assert_eq!(block("text", "a\n```\n![x](y)"), "````text\na\n```\n![x](y)\n````\n");
    }

    #[test]
    fn a_bar_is_as_long_as_the_share() {
        assert_eq!(bar(0.0), "");
        assert_eq!(bar(0.000_1), "▏");
        assert_eq!(bar(0.225), "████▌");
        assert_eq!(bar(1.0), "█".repeat(20));
        assert_eq!(bar(1.5), "█".repeat(20));
        assert_eq!(bar(f64::NAN), "");
    }

    #[test]
    fn an_address_ends_neither_its_link_nor_its_cell() {
        let Fixture { db, file, .. } = Fixture::of_text("codel f(): int");
        let at = Location::Range(file, 6, 7);
        let address = |_: &dyn ModelDb, _: &Location<'_>| Some("file:///a (b)|c.mal#L1,7".to_owned());
        assert_eq!(link(&db, &address, "f", Some(&at)), "[`f`](file:///a%20%28b%29%7Cc.mal#L1,7)");
        assert_eq!(link(&db, &address, "f", None), "`f`");
    }

    #[test]
    fn ordinary_comments_stay_what_they_are() {
        for text in [
            "",
            "Finds a way.\nSlowly.",
            "*Never* **more** than `most`, in [0; 1] m [see below].",
            "- one\n- two `a[0]`\n\n1. three",
            "```cpp\nstd::vector<int> a; // [x](y)\n```\nand `` ` `` ~~not~~",
            "a < b && c > d: 5 <= 6, a\\*b, https://example.org/a_b",
            "# Title\n\n> quoted \u{e9}\u{1f980}",
        ] {
            assert_eq!(comment(text), text);
        }
    }

    #[test]
    fn pictures_links_and_tags_are_text() {
        for (text, shown) in [
            ("![x](https://e.org/x.png)", "![x]\\(https://e.org/x.png)"),
            ("[x](command:evil)", "[x]\\(command:evil)"),
            ("[x]: https://e.org\n![x]", "[x]\\: https://e.org\n![x]"),
            ("<img src=\"https://e.org\">", "&lt;img src=\"https://e.org\">"),
            ("</a><!-- x --><command:evil>", "&lt;/a>&lt;!-- x -->&lt;command:evil>"),
            // Somebody thinks of escapes.
            ("![x\\](https://e.org)", "![x\\]\\(https://e.org)"),
            ("[x]\\(y) \\\\<b> \\<b>", "[x]\\(y) \\\\&lt;b> &lt;b>"),
            ("https://e.org/<img>", "https://e.org/&lt;img>"),
            // What is no code to everybody.
            ("` [x](y)", "\\` [x]\\(y)"),
            ("https://e.org/` ![x](y) `", "https://e.org/\\` ![x]\\(y) \\`"),
            ("| ` | <b> ` |", "| \\` | &lt;b> \\` |"),
            ("a ` b\n`c` <b>", "a \\` b\n`c` &lt;b>"),
        ] {
            assert_eq!(comment(text), shown);
        }
    }

    #[test]
    fn code_ends_with_the_comment() {
        for (text, shown) in [
            ("```\nopen", "```\nopen\n```"),
            ("~~~~ cpp more\nopen\n~~~", "```cpp\nopen\n~~~\n```"),
            ("  ```\n[x](y)\n  ```\n[x](y)", "```\n[x](y)\n```\n[x]\\(y)"),
            ("~~~\n```\n[x](y)\n~~~", "````\n```\n[x](y)\n````"),
            // In a list it would end where the list does.
            ("- ```\n[x](y)", "- \\`\\`\\`\n[x]\\(y)"),
            ("- ~~~\n[x](y)", "- \\~\\~\\~\n[x]\\(y)"),
            ("a\r```\r[x](y)", "a\n```\n[x](y)\n```"),
        ] {
            assert_eq!(comment(text), shown);
        }
    }

    #[test]
    fn nothing_active_is_left_of_any_text() {
        let pieces = [
            "`",
            "``",
            "```",
            "~~~",
            "\\",
            "[",
            "]",
            "(",
            ")",
            ":",
            "!",
            "<",
            ">",
            "a",
            " ",
            "    ",
            "- ",
            "> ",
            "|",
            "\n",
            "\r\n",
            "\r",
            "https://e.org/",
            "b>",
            "/b>",
            "\u{e9}",
        ];
        let mut random = Random(0x2545_f491_4f6c_dd1d);
        for _ in 0..20_000 {
            let text: Vec<&str> = (0..random.below(24)).map(|_| *random.of(&pieces)).collect();
            let text = text.concat();
            let shown = comment(&text);
            let mut open: Option<&str> = None;
            for line in shown.lines() {
                match open {
                    Some(fence) if line == fence => open = None,
                    Some(_) => {}
                    None => match fence(line) {
                        Some((fence, _)) => open = Some(fence),
                        None => assert!(!is_active(line), "{text:?}\n{shown}"),
                    },
                }
            }
            assert_eq!(open, None, "{text:?}\n{shown}");
        }
    }
}
