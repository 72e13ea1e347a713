//! Escapes untrusted texts, such as file names, keys and lines of models, for the terminal and for logs of CI jobs.
//! Both would execute commands in the text: a terminal moves its cursor, a CI system sets variables.

use std::fmt::Write as _;

use mauve_diagnostics::is_obeyed;

/// Escapes the commands in a text: terminal control characters become `\u{1b}` and the like; workflow commands of
/// Azure and GitHub are broken up, as `## [` and `: :`. Line breaks and tabs are kept.
///
/// ```text
/// file \u{1b}[2J.mal        and not a screen that is cleared
/// ##vso [task.setvariable   and not a variable that is set
/// : :error::                and not an error that nobody found
/// ```
pub fn harmless(text: &str) -> String {
    made_visible(text, false)
}

/// Escapes a text within a line, such as a name: line breaks are escaped too.
pub fn harmless_line(text: &str) -> String {
    harmless(text).replace('\n', "\\u{a}")
}

/// Escapes a text that has terminal styles, and keeps these. The caller has escaped all others.
pub fn harmless_but_for_styles(text: &str) -> String {
    made_visible(text, true)
}

fn made_visible(text: &str, has_styles: bool) -> String {
    // Most texts are harmless.
    let may_be_obeyed = |letter: char| match letter.is_ascii() {
        true => letter.is_ascii_control() || letter == '#',
        false => is_obeyed(letter),
    };
    if !text.contains(may_be_obeyed) && !text.trim_start().starts_with("::") {
        return text.to_owned();
    }
    let mut out = String::with_capacity(text.len());
    for (number, line) in text.split('\n').enumerate() {
        if number > 0 {
            out.push('\n');
        }
        let mut rest = line.strip_suffix('\r').unwrap_or(line);
        let begins = rest.trim_start();
        while let Some(first) = rest.chars().next() {
            let length = match first {
                ':' if rest.len() == begins.len() && rest.starts_with("::") => {
                    out += ": ";
                    rest = rest.get(1..).unwrap_or_default();
                    continue;
                }
                '\u{1b}' if has_styles && style(rest).is_some() => style(rest).unwrap_or_default(),
                '#' if command(rest).is_some() => {
                    let name = command(rest).unwrap_or_default();
                    out += rest.get(..name).unwrap_or_default();
                    out.push(' ');
                    rest = rest.get(name..).unwrap_or_default();
                    continue;
                }
                first if is_obeyed(first) => {
                    let _ = write!(out, "\\u{{{:x}}}", u32::from(first));
                    rest = rest.get(first.len_utf8()..).unwrap_or_default();
                    continue;
                }
                first => first.len_utf8(),
            };
            let (shown, after) = rest.split_at_checked(length).unwrap_or((rest, ""));
            out += shown;
            rest = after;
        }
    }
    out
}

/// How long a style is: `␛[1;31m`.
fn style(text: &str) -> Option<usize> {
    let numbers = text.strip_prefix("\u{1b}[")?;
    let end = numbers.find(|c: char| !c.is_ascii_digit() && c != ';')?;
    numbers.get(end..)?.starts_with('m').then_some(end + 3)
}

/// How long the name of a command for a CI job is, up to its bracket: `##vso[`, `##[`.
fn command(text: &str) -> Option<usize> {
    let name = text.strip_prefix("##")?;
    let end = name.find(|c: char| !c.is_ascii_alphanumeric())?;
    name.get(end..)?.starts_with('[').then_some(end + 2)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn what_would_be_obeyed_is_shown() {
        for (text, shown) in [
            ("a\tb\nc é 机\n", "a\tb\nc é 机\n"),
            ("\u{1b}[2Ja\u{7}\u{9b}1m\r\n\rb", "\\u{1b}[2Ja\\u{7}\\u{9b}1m\n\\u{d}b"),
            ("\u{1b}[31mred", "\\u{1b}[31mred"),
            (
                "a\u{202e}b\u{2066}\u{200b}\u{feff}\u{e0041}",
                "a\\u{202e}b\\u{2066}\\u{200b}\\u{feff}\\u{e0041}",
            ),
            ("x ##vso[task.setvariable]##[error] # ##a b[", "x ##vso [task.setvariable]## [error] # ##a b["),
            ("###vso[x", "###vso [x"),
            ("::error file=x::\n  ::add-mask::y\na::b", ": :error file=x::\n  : :add-mask::y\na::b"),
        ] {
            assert_eq!(harmless(text), shown);
        }
    }

    #[test]
    fn a_name_stays_in_its_line() {
        assert_eq!(harmless_line("a\n::error::b"), "a\\u{a}: :error::b");
    }

    #[test]
    fn styles_stay_where_they_are_ours() {
        assert_eq!(harmless_but_for_styles("\u{1b}[1;31mred\u{1b}[0m"), "\u{1b}[1;31mred\u{1b}[0m");
        assert_eq!(harmless_but_for_styles("\u{1b}[2J\u{1b}]0;t\u{7}"), "\\u{1b}[2J\\u{1b}]0;t\\u{7}");
    }

    proptest! {
        #[test]
        fn nothing_is_left_to_obey(text in "([a:#\\[\u{1b}\u{202e}\u{9b}\n\r\t ]|::|##|vso|\\PC){0,40}") {
            let shown = harmless(&text);
            prop_assert!(!shown.chars().any(|c| is_obeyed(c) && c != '\n'), "{:?}", shown);
            let obeyed = |line: &str| line.trim_start().starts_with("::") || line.contains("##[") || line.contains("##vso[");
            prop_assert!(!shown.lines().any(obeyed), "{:?}", shown);
            prop_assert_eq!(harmless(&shown), shown);
        }
    }
}
