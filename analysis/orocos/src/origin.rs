//! Comments in generated code that refer to the model.

use mauve_hir::{Decl, Location, ModelDb, Workspace, declaration_map, file_and_line, parse};
use mauve_syntax::comment_above;

use crate::escape::comment;

/// The longest line of generated code.
pub(crate) const WIDTH: usize = 100;

/// The maximum width of a comment in scripts.
const COMMENT_WIDTH: usize = 96;

/// Joins `words` to lines of at most `width` characters; a longer word is a line of its own.
pub(crate) fn wrapped<'a>(words: impl Iterator<Item = &'a str>, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                *line += &format!(" {word}");
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Returns the lines of a comment in a script.
pub(crate) fn comment_lines(text: &str) -> Vec<String> {
    wrapped(comment(text).split(' '), COMMENT_WIDTH)
}

/// Returns the file of a model element, relative to the workspace, and its line: `components/switch.mal:8`.
pub(crate) fn origin<'db>(db: &'db dyn ModelDb, workspace: Workspace, at: &Location<'db>) -> String {
    comment(&file_and_line(db, workspace, at))
}

/// Returns the file relative to the workspace, or the file name alone outside of it, since absolute paths differ
/// between machines.
pub(crate) fn origin_file<'db>(db: &'db dyn ModelDb, workspace: Workspace, at: &Location<'db>) -> String {
    let path = at.file(db).path(db);
    let own = path.strip_prefix(workspace.folder(db)).ok();
    let own = own.or_else(|| path.file_name().map(AsRef::as_ref)).unwrap_or(path);
    let parts: Vec<String> = own.iter().map(|part| comment(&part.to_string_lossy())).collect();
    parts.join("/")
}

/// Returns the lines of the comment above a declaration, for a C++ comment.
pub(crate) fn words_of(db: &dyn ModelDb, decl: Decl<'_>) -> Vec<String> {
    let Some(map) = declaration_map(db, decl) else { return Vec::new() };
    let root = parse(db, decl.file(db)).syntax();
    let found = root.text_range().contains_range(map.range).then(|| root.covering_element(map.range));
    let node = found.and_then(|found| found.ancestors().find(|node| node.text_range() == map.range));
    let words = node.map(|node| comment_above(&node)).unwrap_or_default();
    words.lines().map(|line| comment(line.trim_start_matches([' ', '\t', '*']))).collect()
}
