//! Go to declaration: for an operation, its declaration in the shell instead of the definition in a core.

use mauve_hir::{File, ModelDb, Workspace};
use mauve_syntax::TextSize;

use crate::definition::{Navigation, destination, names, targets};

/// Returns the declarations of the name at `offset`, in all projects with the file.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let text = "shell S { provide f(): int } core C(S) { provide f(): int = { return f(); } }".to_owned();
/// let call = text.rfind('f').unwrap() as u32;
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let found = mauve_ide::declaration(&db, &[workspace], file, call.into()).unwrap();
/// assert_eq!(u32::from(found.targets[0].name.start()), 18);
/// ```
pub fn declaration(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    offset: TextSize,
) -> Option<Navigation> {
    let names = names(db, workspaces, file, offset);
    destination(&names, |project, name| targets(db, project, &name.definition), |_, _| None)
}
