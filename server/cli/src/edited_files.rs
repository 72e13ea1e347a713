//! Files with their text before and after a change: a diff, and writing them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use mauve_projects::disk::text_of;
use mauve_projects::output::say;
use mauve_projects::replace::replace;
use similar::TextDiff;

use crate::text::shown;

/// The changed files, with their text before and after.
#[derive(Debug, Default)]
pub(super) struct EditedFiles(pub(super) Vec<(PathBuf, Arc<str>, Arc<str>)>);

impl EditedFiles {
    /// Returns the changes as a unified diff.
    pub(super) fn diff(&self, here: &Path) -> String {
        let diff = |(path, old, new): &(PathBuf, Arc<str>, Arc<str>)| {
            let name = shown(path, here);
            TextDiff::from_lines(&**old, &**new).unified_diff().header(&name, &name).to_string()
        };
        self.0.iter().map(diff).collect()
    }

    /// Writes the changed files. Returns the paths of those that were written, and whether all were.
    pub(super) fn write(&self, here: &Path) -> (Vec<String>, bool) {
        let mut written = Vec::new();
        for (path, old, new) in &self.0 {
            let name = shown(path, here);
            let (text, problem) = text_of(path);
            let result = match problem {
                Some(problem) => Err(problem),
                None if *text != **old => Err("it has changed meanwhile".to_owned()),
                None => replace(path, new).map_err(|error| error.to_string()),
            };
            match result {
                Ok(()) => written.push(name),
                Err(why) => say(&format!("`{name}` cannot be written: {why}")),
            }
        }
        let is_complete = written.len() == self.0.len();
        (written, is_complete)
    }
}
