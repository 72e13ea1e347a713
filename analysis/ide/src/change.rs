//! What a rename, a fix or a refactoring does: replaced text in some files, and new files.

use std::path::PathBuf;

use mauve_model::diagnostics::Fix;
use mauve_model::{File, ModelDb};
use mauve_syntax::format::{Replacement, applied};

/// A change of a workspace, for the user to look at and to apply.
///
/// All of it is applied, or nothing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Change {
    /// Each file once, in the order in which they were met.
    pub files: Vec<FileChange>,
    /// Files that are to be made, with their text; none of them is there.
    pub created: Vec<(PathBuf, String)>,
}

/// What is replaced in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileChange {
    /// The file.
    pub file: File,
    /// In the order of the text, none overlapping another.
    pub edits: Vec<Replacement>,
    /// What an editor that groups changes calls these; none: what the change itself is called.
    pub note: Option<String>,
}

impl Change {
    /// Adds a replacement. One that is there already, or overlaps one, is left out.
    pub fn replace(&mut self, file: File, edit: Replacement) {
        let index = self.files.iter().position(|known| known.file == file).unwrap_or_else(|| {
            self.files.push(FileChange { file, edits: Vec::new(), note: None });
            self.files.len() - 1
        });
        let Some(known) = self.files.get_mut(index) else { return };
        let at = known.edits.partition_point(|other| other.range.end() <= edit.range.start());
        let overlaps = known.edits.get(at).is_some_and(|next| next.range.start() < edit.range.end());
        if !overlaps && !known.edits.contains(&edit) {
            known.edits.insert(at, edit);
        }
    }

    /// Adds another change, all of it or, where the two overlap, nothing; says which.
    pub fn join(&mut self, other: Change) -> bool {
        let is_free = |file: File, edit: &Replacement| {
            let known = self.files.iter().filter(|known| known.file == file).flat_map(|known| &known.edits);
            known.clone().all(|it| {
                // What is put at one place by both would run together, unless it is lines.
                let are_lines =
                    it.text.starts_with('\n') && edit.text.starts_with('\n') && edit.range.is_empty();
                let apart = it.range.end() <= edit.range.start() || edit.range.end() <= it.range.start();
                it == edit || (apart && (it.range != edit.range || are_lines))
            })
        };
        let is_free = other.files.iter().all(|of| of.edits.iter().all(|edit| is_free(of.file, edit)));
        if is_free {
            for FileChange { file, edits, .. } in other.files {
                edits.into_iter().for_each(|edit| self.replace(file, edit));
            }
            self.created.extend(other.created);
        }
        is_free
    }

    /// What mends a diagnostic.
    pub fn of_fix(db: &dyn ModelDb, fix: &Fix<'_>) -> Change {
        let mut change = Change::default();
        for (place, text) in &fix.edits {
            let edit = Replacement { range: place.range(db), text: text.clone() };
            change.replace(place.file(db), edit);
        }
        change
    }

    /// The text of `file` once it is applied.
    pub fn applied(&self, db: &dyn ModelDb, file: File) -> String {
        let edits = self.files.iter().find(|known| known.file == file).map_or(&[][..], |known| &known.edits);
        applied(file.text(db), edits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use mauve_syntax::TextRange;

    #[test]
    fn edits_come_in_the_order_of_the_text_and_do_not_overlap() {
        let Fixture { db, file, .. } = Fixture::new("codel f(): int");
        let mut change = Change::default();
        for (start, end, text) in [(6, 7, "g"), (0, 5, "shell"), (6, 7, "h"), (3, 8, "x"), (6, 7, "g")] {
            let range = TextRange::new(start.into(), end.into());
            change.replace(file, Replacement { range, text: text.to_owned() });
        }
        assert_eq!(change.applied(&db, file), "shell g(): int");
        assert_eq!(change.files.len(), 1);
    }
}
