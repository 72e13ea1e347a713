//! Fixtures for tests of features: several files in one text, with `$0` at the cursor.

use std::path::PathBuf;

use mauve_hir::{Database, File, Location, ModelDb, Project, Workspace, line_of};
use mauve_syntax::TextSize;

use crate::hover::{Hover, HoverFormat, hover};
use crate::project::projects_with;

/// The workspace of a fixture (see [`mauve_tests::fixture`]).
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

    /// Returns the hover at the cursor, as Markdown with the line of each link.
    pub(crate) fn hover(&self) -> Option<Hover> {
        let address = |db: &dyn ModelDb, at: &Location<'_>| {
            let (file, start) = (at.file(db), at.range(db).start());
            Some(format!("file://{}#L{}", file.path(db).display(), line_of(db, file, start)))
        };
        let format = HoverFormat::Markdown(&address);
        hover(&self.db, project_with(&self.db, self.workspace, self.file), self.file, self.offset, format)
    }

    /// Returns a workspace with this text only.
    pub(crate) fn of_text(text: &str) -> Fixture {
        let db = Database::default();
        let path = PathBuf::from("/model.mal");
        let workspace = Workspace::of_texts(&db, "/".into(), [(path.clone(), text.to_owned())]);
        let file = workspace.file(&db, &path).unwrap();
        Fixture { db, workspace, file, offset: TextSize::default() }
    }
}

/// Returns the first project with a file.
pub(crate) fn project_with(db: &Database, workspace: Workspace, file: File) -> Option<Project<'_>> {
    projects_with(db, &[workspace], file).into_iter().next()
}

/// Returns the first project with a file; without any, the file is the root of its own.
pub(crate) fn project_of(db: &Database, workspace: Workspace, file: File) -> Project<'_> {
    project_with(db, workspace, file).unwrap_or_else(|| Project::new(db, workspace, file))
}

/// Returns a text with the cursor at the first occurrence of `at`, at the position of the `$0` in it.
pub(crate) fn with_cursor(text: &str, at: &str) -> String {
    let found = at.replace("$0", "");
    assert!(text.contains(&found), "{found}");
    text.replacen(&found, at, 1)
}

/// Returns the texts of the sample models, by their paths.
pub(crate) fn sample_models() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut open = vec![mauve_tests::models()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if mauve_hir::is_model(&path) {
                let text = std::fs::read_to_string(&path).unwrap();
                found.push((path, text));
            }
        }
    }
    found.sort();
    found
}

/// Returns the sample models, and each of them cut off, and with a token removed, at every `step`th token.
pub(crate) fn broken_models(step: usize) -> impl Iterator<Item = String> {
    sample_models().into_iter().flat_map(move |(_, text)| broken(&text, step))
}

/// Returns a text, and the text cut off, and with a token removed, at every `step`th token.
pub(crate) fn broken(text: &str, step: usize) -> Vec<String> {
    let lexed = mauve_syntax::lex(text);
    let mut texts = vec![text.to_owned()];
    for range in (0..lexed.len()).step_by(step).map(|token| lexed.range(token)) {
        texts.push(text[..range.start].to_owned());
        texts.push(text[..range.start].to_owned() + &text[range.end..]);
    }
    texts
}

/// Returns the targets of a name: file, line and text of each, and other files.
pub(crate) fn shown(db: &Database, found: Option<crate::Navigation>) -> String {
    let mut shown = String::new();
    let Some(found) = found else { return shown };
    for target in found.targets {
        let text = target.file.text(db);
        let line = text[..target.name.start().into()].matches('\n').count() + 1;
        let all = text[target.range].lines().next().unwrap_or("");
        shown += &format!("{}:{line} {} | {all}\n", target.file.path(db).display(), &text[target.name]);
    }
    for file in found.files {
        shown += &format!("{}\n", file.display());
    }
    shown
}
