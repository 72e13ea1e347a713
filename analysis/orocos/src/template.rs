//! Fills the templates of generated files: those in the folder `templates`.
//!
//! ```text
//! add_library({lib}-codels SHARED    {lib}: a hole: the value of `lib` replaces it
//! {codels}                           a line of its own: as many lines as the value has, so none if it is empty
//! )
//! @if messages                       the lines up to @else, or to @end: only if this value is not empty
//! @end
//! ```

use std::fmt::Display;

/// Returns a template with these values in its holes. Values are not searched for holes.
pub(crate) fn filled(template: &str, values: &[(&str, String)]) -> String {
    let value = |name: &str| values.iter().find(|(it, _)| *it == name).map(|(_, value)| value.as_str());
    // Of each condition around a line: whether it holds.
    let mut conditions: Vec<bool> = Vec::new();
    let mut out = String::new();
    for line in template.split_inclusive('\n') {
        let words = line.trim_end();
        if let Some(name) = words.strip_prefix("@if ") {
            conditions.push(value(name).is_some_and(|value| !value.is_empty()));
        } else if words == "@else" {
            conditions.last_mut().into_iter().for_each(|holds| *holds = !*holds);
        } else if words == "@end" {
            conditions.pop();
        } else if conditions.iter().all(|holds| *holds) {
            let is_hole = words.strip_prefix('{').and_then(|rest| value(rest.strip_suffix('}')?));
            if is_hole != Some("") {
                fill(line, value, &mut out);
            }
        }
    }
    out
}

/// Writes a line with its holes filled. Other braces stay.
fn fill<'v>(line: &str, value: impl Fn(&str) -> Option<&'v str>, out: &mut String) {
    let mut rest = line;
    while let Some((before, after)) = rest.split_once('{') {
        out.push_str(before);
        match after.split_once('}').and_then(|(name, behind)| Some((value(name)?, behind))) {
            Some((value, behind)) => {
                out.push_str(value);
                rest = behind;
            }
            None => {
                out.push('{');
                rest = after;
            }
        }
    }
    out.push_str(rest);
}

/// Joins lines to a value.
pub(crate) fn lines(all: impl IntoIterator<Item = impl Display>) -> String {
    let lines: Vec<String> = all.into_iter().map(|line| line.to_string()).collect();
    lines.join("\n")
}

/// Returns a value that is empty unless `holds`.
pub(crate) fn flag(holds: bool) -> String {
    if holds { "yes".to_owned() } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_are_filled_and_conditions_choose_lines() {
        let template =
            "a {x} {{x}} ${y} {z}\n{empty}\n{x}\n@if x\n@if empty\nno\n@else\nyes\n@end\n@end\nend\n";
        let values = [("x", "{y}".to_owned()), ("empty", flag(false)), ("y", lines([1, 2]))];
        assert_eq!(filled(template, &values), "a {y} {{y}} $1\n2 {z}\n{y}\nyes\nend\n");
    }
}
