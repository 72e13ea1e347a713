//! Where generated code comes from: what its comments say of the model.

use mauve_model::{Decl, ModelDb, Place, Workspace, declaration_map, parse};
use mauve_syntax::comment_above;

use crate::escape::comment;

/// The file of something in a model, from the folder of the workspace, and its line: `components/switch.mal:8`.
pub(crate) fn origin<'db>(db: &'db dyn ModelDb, workspace: Workspace, at: &Place<'db>) -> String {
    let before = at.file(db).text(db).get(..at.range(db).start().into()).unwrap_or_default();
    format!("{}:{}", origin_file(db, workspace, at), before.matches('\n').count() + 1)
}

/// The file alone. One from outside the folder is known by its name: where it is differs from machine to machine.
pub(crate) fn origin_file<'db>(db: &'db dyn ModelDb, workspace: Workspace, at: &Place<'db>) -> String {
    let path = at.file(db).path(db);
    let own = path.strip_prefix(workspace.folder(db)).ok();
    let own = own.or_else(|| path.file_name().map(AsRef::as_ref)).unwrap_or(path);
    let parts: Vec<String> = own.iter().map(|part| comment(&part.to_string_lossy())).collect();
    parts.join("/")
}

/// The lines of the comment above a declaration, as they can stand in one of C++.
pub(crate) fn words_of(db: &dyn ModelDb, decl: Decl<'_>) -> Vec<String> {
    let Some(map) = declaration_map(db, decl) else { return Vec::new() };
    let root = parse(db, decl.file(db)).syntax();
    let found = root.text_range().contains_range(map.range).then(|| root.covering_element(map.range));
    let node = found.and_then(|found| found.ancestors().find(|node| node.text_range() == map.range));
    let words = node.map(|node| comment_above(&node)).unwrap_or_default();
    words.lines().map(|line| comment(line.trim_start_matches([' ', '\t', '*']))).collect()
}
