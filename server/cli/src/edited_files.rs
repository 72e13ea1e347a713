//! Files with their text before and after a change: a diff, and writing them.

use std::fmt::Write as _;
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mauve_projects::disk::{MARK, has_mark, text_of};
use mauve_projects::output::say;
use mauve_projects::replace::replace;
use similar::TextDiff;
use similar::udiff::UnifiedHunkHeader;

use crate::text::shown;

/// The changed files, with their text before and after.
#[derive(Debug, Default)]
pub(super) struct EditedFiles(pub(super) Vec<(PathBuf, Arc<str>, Arc<str>)>);

impl EditedFiles {
    /// Returns the changes as a patch for `git apply`, with the bytes of the files: only a line feed ends a line.
    pub(super) fn diff(&self, here: &Path) -> String {
        let diff = |(path, old, new): &(PathBuf, Arc<str>, Arc<str>)| {
            let mark = if has_mark(path) { MARK } else { "" };
            let [old, new] = [old, new].map(|it| format!("{mark}{it}"));
            let [old, new] = [&old, &new].map(|it| it.split_inclusive('\n').collect::<Vec<&str>>());
            let diff = TextDiff::configure().diff_slices(&old, &new);
            let [from, to] =
                ["a", "b"].map(|side| name_in_patch(side, path.strip_prefix(here).unwrap_or(path)));
            let mut out = format!("--- {from}\n+++ {to}\n");
            for hunk in diff.grouped_ops(3) {
                let _ = writeln!(out, "{}", UnifiedHunkHeader::new(&hunk));
                for change in hunk.iter().flat_map(|it| diff.iter_changes(it)) {
                    let _ = write!(out, "{}{}", change.tag(), change.value());
                    if !change.value().ends_with('\n') {
                        out += "\n\\ No newline at end of file\n";
                    }
                }
            }
            out
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

/// Returns a path as git writes it in a patch, in quotes where a letter of it could be read as something else.
fn name_in_patch(side: &str, path: &Path) -> String {
    let path = path.strip_prefix("/").unwrap_or(path).as_os_str().as_bytes();
    let is_plain = |byte: &u8| (b' '..=b'~').contains(byte) && !b"\"\\".contains(byte);
    if path.iter().all(is_plain) {
        return format!("{side}/{}", String::from_utf8_lossy(path));
    }
    let letter =
        |byte: &u8| if is_plain(byte) { char::from(*byte).to_string() } else { format!("\\{byte:03o}") };
    format!("\"{side}/{}\"", path.iter().map(letter).collect::<String>())
}
