//! Go to declaration: for an operation, its declaration in the shell instead of the definition in a core.

use mauve_hir::{File, ModelDb, Project};
use mauve_syntax::TextSize;

use crate::definition::{Navigation, destination, targets};
use crate::occurrences::names_at;

/// Returns the declarations of the name at `offset`.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let text = "shell S { provide f(): int } core C(S) { provide f(): int = { return f(); } }".to_owned();
/// let call = text.rfind('f').unwrap() as u32;
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let found = mauve_ide::declaration(&db, projects(&db, workspace)[0], file, call.into()).unwrap();
/// assert_eq!(u32::from(found.targets[0].name.start()), 18);
/// ```
pub fn declaration(
    db: &dyn ModelDb,
    project: Project<'_>,
    file: File,
    offset: TextSize,
) -> Option<Navigation> {
    let names = names_at(db, project, file, offset);
    destination(&names, |name| targets(db, project, &name.definition), |_| None)
}
