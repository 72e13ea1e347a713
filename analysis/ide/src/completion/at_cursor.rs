//! The items at the cursor.

use std::collections::BTreeSet;

use mauve_hir::{File, ModelDb, Project, Workspace, is_model, parse};
use mauve_syntax::{TextRange, TextSize};

use super::{Completer, Completions, include, may_be, toml};
use crate::position::Position;
use crate::project::projects_with;

/// The maximal number of items in one answer: the next letter finds others.
pub(super) const MOST_ITEMS: usize = 400;

/// Returns the completions at `offset`, in all projects that contain the file.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let files = [("/a.mal".into(), "core C(S) { statemachine { state A { transition t to  } } }".to_owned())];
/// let workspace = Workspace::of_texts(&db, "/".into(), files);
/// let file = workspace.file(&db, std::path::Path::new("/a.mal")).expect("it is there");
/// let found = mauve_ide::completions(&db, &[workspace], file, 53.into());
/// assert_eq!(found.items[0].label, "A");
/// ```
pub fn completions(db: &dyn ModelDb, workspaces: &[Workspace], file: File, offset: TextSize) -> Completions {
    let text = file.text(db);
    let mut offset = offset.min(TextSize::of(&**text));
    while !text.is_char_boundary(offset.into()) {
        offset -= TextSize::from(1);
    }
    let mut projects = projects_with(db, workspaces, file);
    if !is_model(file.path(db)) {
        return toml::completions(db, workspaces, &projects, file, offset);
    }
    if projects.is_empty() {
        // A file that no root includes is its own root.
        let home = workspaces.iter().find(|it| it.file(db, file.path(db)) == Some(file));
        projects.extend(home.map(|&workspace| Project::new(db, workspace, file)));
    }
    let root = parse(db, file).syntax();
    if let Some(found) = include::paths(db, &projects, file, &root, offset) {
        return found;
    }
    let Some(at) = Position::at(&root, offset) else { return Completions::default() };
    let mut found = Completions::default();
    let mut known = BTreeSet::new();
    for project in projects {
        let mut completer = Completer::new(db, project, file, &at);
        completer.complete();
        found.incomplete |= completer.incomplete;
        let items = completer.found.into_iter();
        found.items.extend(items.filter(|item| known.insert((item.label.clone(), item.insert.clone()))));
    }
    finish(found, at.word, &at.prefix)
}

fn finish(mut found: Completions, replaced: TextRange, prefix: &str) -> Completions {
    if found.items.len() > MOST_ITEMS {
        found.items.retain(|item| may_be(prefix, item.filter.as_ref().unwrap_or(&item.label)));
        found.incomplete = true;
    }
    // A stable sort: items of one rank keep their order.
    found.items.sort_by_key(|item| item.rank);
    found.items.truncate(MOST_ITEMS);
    for item in &mut found.items {
        item.replaced = replaced;
    }
    found
}
