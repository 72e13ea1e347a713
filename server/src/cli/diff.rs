//! The lines in which two texts differ, as a unified diff.

use std::fmt::Write as _;

/// The number of unchanged lines around a change.
const CONTEXT: usize = 3;

/// The number of lines that are compared to find where two texts agree again.
const LONGEST_CHANGE: usize = 1000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line<'a> {
    Same(&'a str),
    Old(&'a str),
    New(&'a str),
}

/// Returns the unified diff of two texts of the file `name`; empty if they are equal.
pub(super) fn unified(name: &str, old: &str, new: &str) -> String {
    if old == new {
        return String::new();
    }
    let lines = lines(old, new);
    let mut out = format!("--- {name}\n+++ {name}\n");
    let is_near_change = |index: usize| {
        let near = lines.get(index.saturating_sub(CONTEXT)..(index + CONTEXT + 1).min(lines.len()));
        near.unwrap_or_default().iter().any(|line| !matches!(line, Line::Same(_)))
    };
    let (mut old_line, mut new_line) = (1, 1);
    let mut index = 0;
    while let Some(line) = lines.get(index) {
        if !is_near_change(index) {
            (old_line, new_line) = after(*line, old_line, new_line);
            index += 1;
            continue;
        }
        let end = (index..lines.len()).find(|&at| !is_near_change(at)).unwrap_or(lines.len());
        let hunk = lines.get(index..end).unwrap_or_default();
        let ends = hunk.iter().fold((old_line, new_line), |(old, new), line| after(*line, old, new));
        let range = |from: usize, to: usize| match to - from {
            // An empty range is named by the line before it.
            0 => format!("{},0", from - 1),
            1 => from.to_string(),
            count => format!("{from},{count}"),
        };
        let _ = writeln!(out, "@@ -{} +{} @@", range(old_line, ends.0), range(new_line, ends.1));
        for line in hunk {
            let (sign, text) = match line {
                Line::Same(text) => (' ', text),
                Line::Old(text) => ('-', text),
                Line::New(text) => ('+', text),
            };
            match text.strip_suffix('\n') {
                Some(text) => _ = writeln!(out, "{sign}{text}"),
                None => _ = writeln!(out, "{sign}{text}\n\\ No newline at end of file"),
            }
        }
        (old_line, new_line) = ends;
        index = end;
    }
    out
}

/// Returns the numbers of the next lines behind `line`.
fn after(line: Line<'_>, old: usize, new: usize) -> (usize, usize) {
    match line {
        Line::Same(_) => (old + 1, new + 1),
        Line::Old(_) => (old + 1, new),
        Line::New(_) => (old, new + 1),
    }
}

/// Returns the lines of both texts: after a difference, the nearest two equal lines are taken for the same line.
fn lines<'a>(old: &'a str, new: &'a str) -> Vec<Line<'a>> {
    let old: Vec<&str> = old.split_inclusive('\n').collect();
    let new: Vec<&str> = new.split_inclusive('\n').collect();
    let (mut from, mut to) = (0, 0);
    let mut found = Vec::new();
    while from < old.len() || to < new.len() {
        let (removed, added) = change(&old, &new, from, to);
        found.extend(old.iter().skip(from).take(removed).map(|line| Line::Old(line)));
        found.extend(new.iter().skip(to).take(added).map(|line| Line::New(line)));
        (from, to) = (from + removed, to + added);
        if let Some(line) = old.get(from).filter(|_| to < new.len()) {
            found.push(Line::Same(line));
            (from, to) = (from + 1, to + 1);
        }
    }
    found
}

/// Returns how many lines are removed and added before the texts agree again.
fn change(old: &[&str], new: &[&str], from: usize, to: usize) -> (usize, usize) {
    let (left_old, left_new) = (old.len() - from, new.len() - to);
    for distance in 0..=LONGEST_CHANGE.min(left_old + left_new) {
        for removed in 0..=distance.min(left_old) {
            let added = distance - removed;
            if added > left_new {
                continue;
            }
            let agree = match (old.get(from + removed), new.get(to + added)) {
                (Some(old), Some(new)) => old == new,
                (None, None) => true,
                _ => false,
            };
            if agree {
                return (removed, added);
            }
        }
    }
    (left_old, left_new)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn changed_lines_have_context() {
        let old = "a\nb\nc\nd\ne\nf\ng\nh\ni\n";
        let new = "a\nb\nc\nd\nE\nf\ng\nh\ni\nj";
        let expected = "--- x.mal\n+++ x.mal\n@@ -2,8 +2,9 @@\n b\n c\n d\n-e\n+E\n f\n g\n h\n i\n+j\n\\ No newline at end of file\n";
        assert_eq!(unified("x.mal", old, new), expected);
        assert_eq!(unified("x.mal", "", "a\n"), "--- x.mal\n+++ x.mal\n@@ -0,0 +1 @@\n+a\n");
        assert_eq!(unified("x.mal", old, old), "");
    }

    proptest! {
        #[test]
        fn the_lines_give_both_texts(old in "([abc]\n){0,12}[ab]?", new in "([abc]\n){0,12}[ab]?") {
            let lines = lines(&old, &new);
            let text = |wanted: fn(&Line<'_>) -> bool| -> String {
                let text = |line: &Line<'_>| match line { Line::Same(it) | Line::Old(it) | Line::New(it) => (*it).to_owned() };
                lines.iter().filter(|line| wanted(line)).map(text).collect()
            };
            prop_assert_eq!(text(|line| !matches!(line, Line::New(_))), old.as_str());
            prop_assert_eq!(text(|line| !matches!(line, Line::Old(_))), new.as_str());
        }
    }
}
