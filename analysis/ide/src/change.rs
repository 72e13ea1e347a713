//! The changes of a rename, a fix or a refactoring: replaced text in some files, and new files.

use std::path::PathBuf;
use std::sync::Arc;

use mauve_diagnostics::Fix;
use mauve_hir::{Database, File, ModelDb, Workspace};
use mauve_syntax::format::{Replacement, applied};
use rustc_hash::FxHashMap;
use salsa::Durability;

/// A change of a workspace, for the user to look at and to apply.
///
/// All of it is applied, or none.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Change {
    /// The changed files, each once, in the order in which they were added.
    pub files: Vec<FileChange>,
    /// The files to create, with their texts; none of them exists.
    pub created: Vec<(PathBuf, String)>,
}

/// The replacements in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileChange {
    /// The file.
    pub file: File,
    /// In text order, without overlaps.
    pub edits: Vec<Replacement>,
    /// A note for editors that group changes; `None`: the title of the change.
    pub note: Option<String>,
}

impl Change {
    /// Returns a change of one file, or `None` if replacements overlap.
    pub fn of(file: File, edits: impl IntoIterator<Item = Replacement>) -> Option<Change> {
        Change::of_all(edits.into_iter().map(|edit| (file, edit)))
    }

    fn of_all(edits: impl IntoIterator<Item = (File, Replacement)>) -> Option<Change> {
        let mut change = Change::default();
        edits.into_iter().all(|(file, edit)| change.replace(file, edit)).then_some(change)
    }

    /// Adds a replacement and returns `true`, also if it is already present. If it overlaps another, returns `false`: the
    /// caller then drops the whole change.
    pub fn replace(&mut self, file: File, edit: Replacement) -> bool {
        // Most changes go from file to file.
        let index = self.files.iter().rposition(|known| known.file == file).unwrap_or_else(|| {
            self.files.push(FileChange { file, edits: Vec::new(), note: None });
            self.files.len() - 1
        });
        let Some(known) = self.files.get_mut(index) else { return false };
        if at_the_same_place(&known.edits, &edit).contains(&edit) {
            return true;
        }
        let index = index_for(&known.edits, &edit);
        if let Some(index) = index {
            known.edits.insert(index, edit);
        }
        index.is_some()
    }

    /// Adds another change completely and returns `true`, or returns `false` if the two overlap.
    pub fn join(&mut self, other: Change) -> bool {
        let is_free = |file: File, edit: &Replacement| {
            let known = self.files.iter().find(|known| known.file == file);
            let known = known.map_or(&[][..], |known| known.edits.as_slice());
            let same = at_the_same_place(known, edit);
            // Two insertions at one offset would run together, unless they are lines.
            let are_lines = |it: &Replacement| it.text.starts_with('\n') && edit.text.starts_with('\n');
            let is_apart = index_for(known, edit).is_some() && same.iter().all(are_lines);
            same.contains(edit) || is_apart
        };
        let is_free = other.files.iter().all(|of| of.edits.iter().all(|edit| is_free(of.file, edit)));
        if is_free {
            for FileChange { file, edits, .. } in other.files {
                for edit in edits {
                    self.replace(file, edit);
                }
            }
            self.created.extend(other.created);
        }
        is_free
    }

    /// Returns the change of a fix, or `None` if its edits overlap.
    pub fn of_fix(db: &dyn ModelDb, fix: &Fix<'_>) -> Option<Change> {
        let edits = fix.edits.iter();
        Change::of_all(edits.map(|(place, text)| {
            (place.file(db), Replacement { range: place.range(db), text: text.clone() })
        }))
    }

    /// Adapts the line ends of the new texts to those of each file.
    pub fn with_line_ends(mut self, db: &dyn ModelDb) -> Change {
        for of in &mut self.files {
            let text = of.file.text(db);
            let is_crlf =
                text.find('\n').is_some_and(|at| text.get(..at).is_some_and(|it| it.ends_with('\r')));
            for edit in of.edits.iter_mut().filter(|_| is_crlf) {
                // Text that was copied from the file may have them already.
                edit.text = edit.text.replace("\r\n", "\n").replace('\n', "\r\n");
            }
        }
        self
    }

    /// Returns the text of `file` after the change.
    pub fn applied(&self, db: &dyn ModelDb, file: File) -> String {
        let edits = self.files.iter().find(|known| known.file == file).map_or(&[][..], |known| &known.edits);
        applied(file.text(db), edits)
    }

    /// Returns the workspaces that have a changed file as they would be, in a database of their own; each behind what it is now.
    pub fn scratch(
        &self,
        db: &dyn ModelDb,
        workspaces: &[Workspace],
    ) -> (Database, Vec<(Workspace, Workspace)>) {
        let scratch = Database::default();
        let mut files: FxHashMap<File, File> = FxHashMap::default();
        let mut pairs = Vec::new();
        for &workspace in workspaces {
            let known = workspace.files(db);
            let is_created = |path: &PathBuf| path.starts_with(workspace.folder(db));
            let is_changed = known.values().any(|file| self.files.iter().any(|it| it.file == *file));
            if !is_changed && !self.created.iter().any(|(path, _)| is_created(path)) {
                continue;
            }
            let mut copy = |file: File| {
                *files.entry(file).or_insert_with(|| {
                    let changed = self.files.iter().any(|it| it.file == file);
                    let text = if changed { self.applied(db, file).into() } else { file.text(db).clone() };
                    file.copied(db, &scratch, text)
                })
            };
            let copies = known.iter().map(|(path, &file)| (path.clone(), copy(file)));
            let mut copies: std::collections::BTreeMap<PathBuf, File> = copies.collect();
            for (path, text) in self.created.iter().filter(|(path, _)| is_created(path)) {
                let new = File::new(&scratch, path.clone(), text.as_str().into(), None);
                copies.insert(path.clone(), new);
            }
            let changed = Workspace::builder(
                workspace.folder(db).clone(),
                Arc::new(copies),
                workspace.model_path(db).clone(),
                workspace.only(db).iter().map(|&file| copy(file)).collect(),
                workspace.unreadable(db).clone(),
                workspace.packages(db).clone(),
            );
            let changed = changed
                .included(workspace.included(db).clone())
                .measured_files(workspace.measured_files(db).clone())
                .significance(*workspace.significance(db))
                .durability(Durability::LOW)
                .new(&scratch);
            pairs.push((workspace, changed));
        }
        (scratch, pairs)
    }
}

/// Returns the index at which `edit` is inserted in text order, or `None` if it overlaps another edit.
fn index_for(edits: &[Replacement], edit: &Replacement) -> Option<usize> {
    let at = edits.partition_point(|other| other.range.end() <= edit.range.start());
    let overlaps = edits.get(at).is_some_and(|next| next.range.start() < edit.range.end());
    (!overlaps).then_some(at)
}

/// Returns the edits with the same range as `edit`: one, or several insertions.
fn at_the_same_place<'a>(edits: &'a [Replacement], edit: &Replacement) -> &'a [Replacement] {
    let order = |it: &Replacement| (it.range.start(), it.range.end());
    let start = edits.partition_point(|other| order(other) < order(edit));
    let end = edits.partition_point(|other| order(other) <= order(edit));
    edits.get(start..end).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use mauve_syntax::TextRange;

    fn edit(start: u32, end: u32, text: &str) -> Replacement {
        Replacement { range: TextRange::new(start.into(), end.into()), text: text.to_owned() }
    }

    #[test]
    fn edits_come_in_the_order_of_the_text_and_do_not_overlap() {
        let Fixture { db, file, .. } = Fixture::new("codel f(): int");
        let mut change = Change::default();
        let edits =
            [(6, 7, "g"), (0, 5, "shell"), (6, 7, "h"), (3, 8, "x"), (6, 7, "g"), (6, 6, "a"), (6, 6, "b")];
        let added = edits.map(|(start, end, text)| change.replace(file, edit(start, end, text)));
        assert_eq!(added, [true, true, false, false, true, true, true]);
        assert_eq!(change.applied(&db, file), "shell abg(): int");
        assert_eq!(change.files.len(), 1);
        // All or nothing.
        assert_eq!(Change::of(file, [edit(0, 5, "shell"), edit(4, 6, "")]), None);
        assert!(Change::of(file, [edit(6, 7, ""), edit(0, 5, "shell")]).is_some());
    }

    #[test]
    fn what_overlaps_is_not_joined() {
        let Fixture { db, file, .. } = Fixture::new("codel f(): int");
        let of = |edits: &[(u32, u32, &str)]| {
            let edits = edits.iter().map(|&(start, end, text)| edit(start, end, text));
            Change::of(file, edits).unwrap()
        };
        let mut change = of(&[(6, 7, "g"), (14, 14, "\n1")]);
        // None of it, where one of its edits overlaps.
        assert!(!change.join(of(&[(0, 5, "shell"), (5, 7, " h")])));
        assert!(!change.join(of(&[(6, 7, "h")])));
        assert!(!change.join(of(&[(14, 14, "2")])));
        assert_eq!(change.applied(&db, file), "codel g(): int\n1");
        assert!(change.join(of(&[(0, 5, "shell"), (6, 7, "g"), (14, 14, "\n2")])));
        assert_eq!(change.applied(&db, file), "shell g(): int\n1\n2");
    }
}
