//! Line numbers.

use ::line_index::LineIndex;
use mauve_syntax::TextSize;

use crate::source::Location;
use crate::{File, ModelDb, Workspace};

/// Returns the starts of the lines of a file.
#[salsa::tracked(returns(ref), no_eq)]
pub fn line_index(db: &dyn ModelDb, file: File) -> LineIndex {
    LineIndex::new(file.text(db))
}

/// Returns the line of `offset`, from 1.
pub fn line_of(db: &dyn ModelDb, file: File, offset: TextSize) -> usize {
    let lines = line_index(db, file);
    lines.try_line_col(offset.min(lines.len())).map_or(1, |found| found.line as usize + 1)
}

/// Returns a location for generated files, relative to the folder of the workspace: `components/switch.mal:8`.
///
/// For a file outside the workspace, returns only its name, because its folder depends on the machine.
pub fn file_and_line<'db>(db: &'db dyn ModelDb, workspace: Workspace, at: &Location<'db>) -> String {
    let file = at.file(db);
    let path = file.path(db);
    let own = path.strip_prefix(workspace.folder(db)).ok();
    let own = own.or_else(|| path.file_name().map(AsRef::as_ref)).unwrap_or(path);
    let segments: Vec<_> = own.iter().map(|id| id.to_string_lossy()).collect();
    format!("{}:{}", segments.join("/"), line_of(db, file, at.range(db).start()))
}
