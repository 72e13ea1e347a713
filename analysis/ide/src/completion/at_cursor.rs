//! The items at the cursor.

use std::collections::BTreeSet;

use mauve_hir::{File, ModelDb, Project, is_model, parse};
use mauve_syntax::TextSize;

use super::{Completer, Completions, include, may_be, toml};
use crate::position::Position;

/// The maximal number of items in one answer: the next letter finds others.
pub(super) const MOST_ITEMS: usize = 400;

/// Returns the completions at `offset`. In a table or a configuration, which all projects of a workspace share, those of them all.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
/// let db = Database::default();
/// let files = [("/a.mal".into(), "core C(S) { statemachine { state A { transition t to  } } }".to_owned())];
/// let workspace = Workspace::of_texts(&db, "/".into(), files);
/// let file = workspace.file(&db, std::path::Path::new("/a.mal")).expect("it is there");
/// let found = mauve_ide::completions(&db, projects(&db, workspace)[0], file, 53.into());
/// assert_eq!(found.items[0].label, "A");
/// ```
pub fn completions(db: &dyn ModelDb, project: Project<'_>, file: File, offset: TextSize) -> Completions {
    let text = file.text(db);
    let mut offset = offset.min(TextSize::of(&**text));
    while !text.is_char_boundary(offset.into()) {
        offset -= TextSize::from(1);
    }
    if !is_model(file.path(db)) {
        return toml::completions(db, project.workspace(db), file, offset);
    }
    let root = parse(db, file).syntax();
    if let Some(found) = include::paths(db, project.workspace(db), file, &root, offset) {
        return found;
    }
    let Some(at) = Position::at(&root, offset) else { return Completions::default() };
    let mut completer = Completer::new(db, project, file, &at);
    completer.complete();
    let mut found = Completions { items: completer.found, incomplete: completer.incomplete };
    let mut known = BTreeSet::new();
    found.items.retain(|item| known.insert((item.label.clone(), item.insert.clone())));
    if found.items.len() > MOST_ITEMS {
        found.items.retain(|item| may_be(&at.prefix, item.filter.as_ref().unwrap_or(&item.label)));
        found.incomplete = true;
    }
    // A stable sort: items of one rank keep their order.
    found.items.sort_by_key(|item| item.rank);
    found.items.truncate(MOST_ITEMS);
    found.items.iter_mut().for_each(|item| item.replaced = at.word);
    found
}
