//! Diagnostics of what the user is typing wait until the user pauses: a name is unknown, and a statement incomplete, after each key
//! but the last. Diagnostics elsewhere do not wait, and solved ones disappear at once.

use std::collections::BTreeMap;
use std::time::Duration;

use tower_lsp::lsp_types::{Diagnostic, NumberOrString, Range, Url};

use super::documents::Documents;
use super::items::Items;

/// How long the diagnostics of what is being typed wait after a key.
pub(crate) const PAUSE: Duration = Duration::from_millis(400);

/// Returns the texts that users are typing, by the URIs of their documents.
pub(crate) fn typed_in(documents: &Documents) -> BTreeMap<Url, Range> {
    let typing = documents.0.iter().filter(|(_, open)| open.changed.elapsed() < PAUSE);
    typing.filter_map(|(uri, open)| Some((uri.clone(), open.typed?))).collect()
}

/// Returns the diagnostics that do not wait, and whether some do.
pub(crate) fn without_typed(items: Items, typed: Range) -> (Items, bool) {
    if items.is_empty() {
        return (items, false);
    }
    let list = items.list();
    let count = list.len();
    let shown: Vec<Diagnostic> = list.into_iter().filter(|diagnostic| !waits(diagnostic, typed)).collect();
    if shown.len() == count { (items, false) } else { (Items::of(shown), true) }
}

/// Whether a diagnostic is about what is being typed: it touches that text, or is a syntax error in its line or at the
/// beginning of the next one.
fn waits(diagnostic: &Diagnostic, typed: Range) -> bool {
    let Range { start, end } = diagnostic.range;
    let is_syntax = matches!(&diagnostic.code, Some(NumberOrString::String(code)) if code == "syntax-error");
    let line = typed.end.line;
    let is_near = start.line == line || start.line == line.saturating_add(1);
    start <= typed.end && end >= typed.start || is_syntax && is_near
}

#[cfg(test)]
mod tests {
    use tower_lsp::lsp_types::Position;

    use super::*;

    fn range(line: u32, start: u32, end: u32) -> Range {
        Range::new(Position::new(line, start), Position::new(line, end))
    }

    fn diagnostic(code: &str, range: Range) -> Diagnostic {
        let code = Some(NumberOrString::String(code.to_owned()));
        Diagnostic { code, range, message: format!("{range:?}"), ..Diagnostic::default() }
    }

    #[test]
    fn only_what_is_being_typed_waits() {
        let typed = range(3, 4, 5);
        let waiting = [
            diagnostic("unresolved-codel", range(3, 2, 5)),
            diagnostic("unresolved-codel", range(3, 5, 9)),
            diagnostic("syntax-error", range(3, 9, 10)),
            diagnostic("syntax-error", range(4, 0, 1)),
        ];
        let shown = [
            diagnostic("unresolved-codel", range(3, 6, 9)),
            diagnostic("deadline-missed", range(3, 0, 2)),
            diagnostic("deadline-missed", range(4, 0, 20)),
            diagnostic("syntax-error", range(2, 0, 9)),
        ];
        let all = Items::of(waiting.iter().chain(&shown).cloned());
        let (items, do_wait) = without_typed(all, typed);
        assert_eq!((items.list(), do_wait), (shown.to_vec(), true));
        let (items, do_wait) = without_typed(items, typed);
        assert_eq!((items.list(), do_wait), (shown.to_vec(), false));
    }
}
