//! Names and comments of an imported system, whose texts may be any.

use mauve_projects::harmless::harmless_line;

/// Returns a name that is not known yet: the name itself, or the first one with a number.
pub(super) fn unique(name: &str, is_known: impl Fn(&str) -> bool) -> String {
    let name = if name.is_empty() { "unnamed" } else { name };
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    std::iter::once(name.to_owned()).chain(numbered).find(|it| !is_known(it)).unwrap_or_default()
}

pub(super) fn camel_case(name: &str) -> String {
    let word = |word: &str| {
        let mut letters = word.chars();
        letters.next().map(|first| first.to_ascii_uppercase().to_string() + letters.as_str())
    };
    let name: String = name.split('_').filter_map(word).collect();
    if name.starts_with(|first: char| first.is_ascii_digit()) { format!("_{name}") } else { name }
}

/// Returns a text for a comment of one line, without letters that an editor or a terminal obeys.
pub(super) fn comment(text: &str) -> String {
    let text: String = text.chars().take(120).collect();
    harmless_line(&text).replace('\t', " ")
}
