//! What the tests of features have in common: files in a text, `$0` where the cursor is.

use std::path::PathBuf;

use mauve_model::{Database, File, Workspace};
use mauve_syntax::TextSize;

/// A workspace of a fixture (see [`mauve_tests::fixture`]).
pub(crate) struct Fixture {
    pub(crate) db: Database,
    pub(crate) workspace: Workspace,
    /// The file with the cursor; without one, the first.
    pub(crate) file: File,
    pub(crate) offset: TextSize,
}

impl Fixture {
    pub(crate) fn new(text: &str) -> Fixture {
        let mut cursor = None;
        let mut texts: Vec<(PathBuf, String)> = Vec::new();
        for (path, text) in mauve_tests::fixture(text) {
            if let Some(offset) = text.find("$0") {
                cursor = Some((texts.len(), TextSize::new(offset as u32)));
            }
            texts.push((path.into(), text.replace("$0", "")));
        }
        let (index, offset) = cursor.unwrap_or_default();
        let path = texts[index].0.clone();
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let file = workspace.file(&db, &path).unwrap();
        Fixture { db, workspace, file, offset }
    }
}
