//! The regions that git marks where it cannot merge two texts.
//!
//! ```text
//! <<<<<<< HEAD
//! the text of this branch
//! ||||||| 1a2b3c
//! the text before both, if git is to write it
//! =======
//! the text of the other branch
//! >>>>>>> feature
//! ```
//!
//! A region is found by its lines, as git finds it: also in a comment. The parser reads the text of this branch, in which
//! nothing else is missing, and no other line of a region: each region is one error. What the other text changes is unknown, so
//! a declaration that a region touches is incomplete.

use std::ops::Range;

/// A region with its first and its last marker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Region {
    /// The line of the first marker, without its end.
    pub(crate) start: Range<usize>,
    /// From the marker behind the first text to the last marker.
    pub(crate) other: Range<usize>,
}

/// Returns the sign of the marker that a line is: seven signs, alone or before white space.
fn marker(line: &str) -> Option<char> {
    let sign = line.chars().next().filter(|sign| matches!(sign, '<' | '|' | '=' | '>'))?;
    let rest = line.trim_start_matches(sign);
    (line.len() == rest.len() + 7 && (rest.is_empty() || rest.starts_with(char::is_whitespace)))
        .then_some(sign)
}

/// Returns the marker that begins at an offset, without the end of its line.
#[inline]
pub(crate) fn marker_at(text: &str, at: usize) -> Option<Range<usize>> {
    let bytes = text.as_bytes();
    let begins_line = || at.checked_sub(1).is_none_or(|before| bytes.get(before) == Some(&b'\n'));
    if !matches!(bytes.get(at), Some(b'<' | b'|' | b'=' | b'>')) || !begins_line() {
        return None;
    }
    let line = text.get(at..)?.lines().next()?;
    marker(line).map(|_| at..at + line.len())
}

/// Returns the regions of a text, in its order. Those in the other text of a region are part of it.
pub(crate) fn regions(text: &str) -> Vec<Region> {
    let mut found = Vec::new();
    let mut open: Option<Region> = None;
    let (mut at, mut inner) = (0, 0);
    let lines = text.contains("<<<<<<<").then(|| text.split_inclusive('\n'));
    for line in lines.into_iter().flatten() {
        let end = at + line.trim_end_matches(['\r', '\n']).len();
        let is_other = open.as_ref().is_some_and(|region| !region.other.is_empty());
        match (marker(line), &mut open) {
            (Some('<'), _) if is_other => inner += 1,
            (Some('<'), _) => open = Some(Region { start: at..end, other: 0..0 }),
            (Some('|' | '='), Some(region)) if !is_other => region.other = at..end,
            (Some('>'), _) if inner > 0 => inner -= 1,
            (Some('>'), Some(region)) => {
                region.other = if is_other { region.other.start..end } else { at..end };
                found.extend(open.take());
            }
            _ => {}
        }
        at += line.len();
    }
    found
}

/// Returns the line of the first marker of each region of any text, and the two names that its markers have.
///
/// ```
/// let text = "a\n<<<<<<< HEAD\nb\n=======\n>>>>>>> feature\n";
/// assert_eq!(mauve_syntax::conflicts(text), [(2..14, ["HEAD".to_owned(), "feature".to_owned()])]);
/// ```
pub fn conflicts(text: &str) -> Vec<(Range<usize>, [String; 2])> {
    let name = |line: Option<&str>| line.and_then(|it| it.get(7..)).unwrap_or_default().trim().to_owned();
    let named = |Region { start, other }: Region| {
        let last = text.get(other).and_then(|lines| lines.lines().last());
        (start.clone(), [name(text.get(start)), name(last)])
    };
    regions(text).into_iter().map(named).collect()
}

/// Returns the text of the other branch in the second lines of a region.
pub(crate) fn other_text(lines: &str) -> &str {
    let is_before = |line: &&str| marker(line) != Some('=');
    let before: usize = lines.split_inclusive('\n').take_while(is_before).map(str::len).sum();
    let rest = lines.get(before..).and_then(|rest| rest.split_once('\n')).map_or("", |(_, rest)| rest);
    rest.rfind(">>>>>>>").and_then(|end| rest.get(..end)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use rowan::{TextRange, TextSize};

    use super::other_text;
    use crate::error::SyntaxError;
    use crate::format::{format_on_type, format_range, formatted};
    use crate::{Parse, SyntaxErrorKind, TokenError, parse};

    const OURS: &str = "<<<<<<< HEAD\n";
    const THEIRS: &str = "=======\n";
    const END: &str = ">>>>>>> feature\n";

    /// Returns the first line of each error, and whether what follows its region is known.
    fn errors(parse: &Parse) -> Vec<(String, Option<bool>)> {
        let of = |error: &SyntaxError| {
            let known = match error.kind {
                SyntaxErrorKind::Conflict { is_contained, .. } => Some(is_contained),
                SyntaxErrorKind::Token(TokenError::ConflictMarker) => Some(false),
                _ => None,
            };
            (parse.syntax().text().slice(error.range).to_string(), known)
        };
        parse.errors().iter().map(of).collect()
    }

    #[test]
    fn each_region_is_one_error_wherever_it_is() {
        let region = |ours: &str, theirs: &str| format!("{OURS}{ours}{THEIRS}{theirs}{END}");
        let core = |update: &str| format!("core C(S) {{\n  update = {{\n{update}  }}\n}}\n");
        for (text, regions) in [
            (region("codel f(): int\n", "codel f(): double\n"), 1),
            (region("", "codel g(): int\n") + "codel f(): int\n" + &region("shell A { }\n", ""), 2),
            (region("codel f(): int\n", "") + &region("", "codel g(): int\n"), 2),
            (core(&region("    f(1);\n", "    f(2);\n")), 1),
            (core(&format!("    n = 1 +\n{}    + 3;\n", region("      a\n", "      b\n"))), 1),
            (core(&format!("    f(\n{});\n", region("1\n", "2,\n"))), 1),
            (
                core(&region("    if a then {\n", "    if b then {\n"))
                    .replace("  }\n}\n", "} else { } }\n}\n"),
                1,
            ),
            (
                format!(
                    "{OURS}codel f(): int\n||||||| 1a2b\ncodel (\n=======\ncodel ((\n{END}shell A {{ }}\n"
                ),
                1,
            ),
            // Both texts end a shell's declaration and begin a second shell.
            (format!("shell A {{\n{}}}\n", region("}\nshell B {\n", "}\nshell C {\n")), 1),
            (format!("/* a\n{}b */\n", region("c\n", "d\n")), 1),
        ] {
            for text in [text.clone(), text.replace('\n', "\r\n"), text.trim_end().to_owned()] {
                let parse = parse(&text);
                assert_eq!(parse.syntax().to_string(), text);
                assert_eq!(errors(&parse), vec![("<<<<<<< HEAD".to_owned(), Some(true)); regions], "{text}");
            }
        }
    }

    #[test]
    fn what_follows_is_unknown_where_the_texts_do_not_end_alike() {
        for text in [
            format!("{OURS}shell A {{\n{THEIRS}shell B\n{END}}}\n"),
            format!("{OURS}library l {{\n{THEIRS}library m {{\n{END}}}\n"),
            format!("{OURS}include \"a.mal\"\n{THEIRS}{END}"),
            format!("{OURS}{THEIRS}/* a\n{END}shell A {{ }}\n"),
            format!("/*\n{OURS}a\n{THEIRS}*/\n{END} */\n"),
            // Nested in the first text.
            format!("{OURS}{OURS}shell A {{ }}\n{THEIRS}{END}{THEIRS}{END}"),
            // Unfinished, or what is left of one.
            format!("{OURS}shell A {{ }}\n"),
            format!("shell A {{ }}\n{END}"),
            format!("shell A {{ }}\n{THEIRS}shell B {{ }}\n"),
        ] {
            let found = errors(&parse(&text));
            assert!(found.iter().any(|(_, known)| *known == Some(false)), "{text}{found:?}");
        }
        // Nested in the second text: it is not parsed.
        let nested = format!("{OURS}use a\n{THEIRS}{OURS}use b\n{THEIRS}{END}{END}use c\n");
        assert_eq!(errors(&parse(&nested)).len(), 1);
        let nested = format!("{OURS}{OURS}use a\n{THEIRS}use b\n{END}{THEIRS}use c\n{END}use d\n");
        assert_eq!(errors(&parse(&nested)).len(), 4, "the region, and each marker around it");
        let unfinished = format!("{OURS}use a\n{OURS}use b\n{THEIRS}use c\n{END}");
        assert_eq!(errors(&parse(&unfinished)).len(), 2);
    }

    #[test]
    fn the_other_text_is_between_the_last_two_markers() {
        assert_eq!(other_text("||||||| base\na\n=======\nb\nc\n>>>>>>> feature"), "b\nc\n");
        assert_eq!(other_text("=======\n>>>>>>> feature"), "");
        assert_eq!(other_text(">>>>>>> feature"), "");
    }

    #[test]
    fn other_lines_are_no_markers() {
        for text in [
            "/* Title\n=======\n*/\nuse a\n",
            "/*\n<<<<<<< a\n>>>>>>>b\n*/\n",
            "use a // <<<<<<< b\n",
            "/*\n <<<<<<< a\n=======\n>>>>>>> b\n*/\n",
            "/*\n<<<<<<<< a\n========\n>>>>>>>> b\n*/\n",
        ] {
            assert_eq!(errors(&parse(text)), [], "{text}");
        }
        // Git puts the marker before a byte order mark.
        let marked = "<<<<<<< HEAD\n\u{feff}use a\n=======\n\u{feff}use b\n>>>>>>> c\n";
        assert_eq!(errors(&parse(marked)).len(), 1);
    }

    #[test]
    fn the_formatter_leaves_the_lines_of_regions_as_they_are() {
        let region = |end: &str| {
            format!(
                "<<<<<<< HEAD{end}   update={{f( 1 ) ;}} {end}{end}{end}=======  {end}\tupdate  = {{ }}{end}>>>>>>> x{end}"
            )
        };
        for end in ["\n", "\r\n"] {
            let region = region(end);
            for (before, after) in
                [("core  C(S)  {{\n", "var x:int;\n}}\n"), ("", "shell  A{{ }}\n"), ("use  a\n\n\n", "")]
            {
                let with_ends = |text: &str| text.replace("{{", "{").replace("}}", "}").replace('\n', end);
                let text = with_ends(before) + &region + &with_ends(after);
                let tidy = formatted(&text);
                assert!(tidy.contains(&region), "{text:?}\n{tidy:?}");
                let start = tidy.find(&region).unwrap();
                assert!(start == 0 || tidy[..start].ends_with('\n'), "{tidy:?}");
                assert!(before.is_empty() || tidy != text);
                assert_eq!(formatted(&tidy), tidy);
                let parse = parse(&text);
                let inside =
                    TextRange::at((text.find(&region).unwrap() as u32).into(), TextSize::of(&region));
                assert_eq!(format_range(&parse, inside, &|| ()), []);
                for (at, sign) in text
                    .match_indices([';', '}'])
                    .filter(|(at, _)| inside.contains(TextSize::new(*at as u32)))
                {
                    let typed = sign.chars().next().unwrap();
                    let found = format_on_type(&parse, TextSize::new(at as u32 + 1), typed, &|| ());
                    assert!(found.iter().all(|it| it.range.end() < inside.start()), "{found:?}");
                }
            }
        }
        // A marker that is left keeps its line too.
        for left in ["<<<<<<< HEAD", "=======", ">>>>>>> feature", "||||||| 1a2b"] {
            let tidy = formatted(&format!("core  C(S) {{\n{left}\n  update = {{ }}\n}}\n"));
            assert!(tidy.contains(&format!("\n{left}\n")), "{tidy}");
        }
    }

    /// Work that grows with the depth for each level would take hours.
    #[test]
    fn deep_nests_and_many_regions_are_read_in_linear_time() {
        let count = 40_000;
        let other = format!("{OURS}{THEIRS}").repeat(count) + &END.repeat(count);
        assert_eq!(parse(&other).errors().len(), 1);
        let many = format!("{OURS}use a\n{THEIRS}use b\n{END}").repeat(count);
        assert_eq!(parse(&many).errors().len(), count);
        let deep = OURS.repeat(count) + "use a\n" + &format!("{THEIRS}{END}").repeat(count);
        assert!(!parse(&deep).errors().is_empty() && !parse(&OURS.repeat(count)).errors().is_empty());
    }
}
