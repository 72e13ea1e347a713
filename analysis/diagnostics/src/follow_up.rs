//! The follow-ups of a syntax error, which are not reported: once the error is corrected, they are gone, or appear.
//!
//! Nothing is analysed because an error is not reported: each of them is still an `ERROR` node in the tree, and the file keeps
//! at least one error.

use mauve_syntax::{SyntaxError, SyntaxKind, lex};

use super::*;

/// Returns the syntax errors of a file that are not follow-ups: the first of each line; where the braces do not match, only
/// the first, because all that is behind it may stand in another block than it seems.
pub(super) fn syntax_errors(db: &dyn ModelDb, file: File) -> Vec<SyntaxError> {
    let errors = parse(db, file).errors();
    let mut last = None;
    let errors = errors.iter().filter(|error| {
        let line = Some(line_of(db, file, error.range.start()));
        std::mem::replace(&mut last, line) != line
    });
    let most = if parse(db, file).errors().len() < 2 || braces_match(file.text(db)) { usize::MAX } else { 1 };
    errors.take(most).copied().collect()
}

/// Removes the diagnostics on lines that have a syntax error.
pub(super) fn remove_on_broken_lines<'db>(db: &'db dyn ModelDb, found: &mut Vec<Diagnostic<'db>>) {
    let mut broken: FxHashSet<(File, usize)> = FxHashSet::default();
    let line = |it: &Diagnostic<'db>| {
        let file = it.at.file(db);
        (file, line_of(db, file, it.at.range(db).start()))
    };
    broken.extend(found.iter().filter(|it| *it.code == syntax_error::SYNTAX_ERROR).map(line));
    if !broken.is_empty() {
        found.retain(|it| *it.code == syntax_error::SYNTAX_ERROR || !broken.contains(&line(it)));
    }
}

/// Does each `{` have its `}`?
fn braces_match(text: &str) -> bool {
    let tokens = lex(text);
    let mut open = 0usize;
    for index in 0..tokens.len() {
        match tokens.kind(index) {
            SyntaxKind::L_CURLY => open += 1,
            SyntaxKind::R_CURLY if open == 0 => return false,
            SyntaxKind::R_CURLY => open -= 1,
            _ => {}
        }
    }
    open == 0
}
