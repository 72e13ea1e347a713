//! The marked line of an installed file: a comment with a digest of the other lines. It says that mauve wrote the file, and
//! whether somebody edited it since.

use std::path::Path;

use mauve_timing::digest_of;

const MARK: &str = "mauve: installed ";

/// The number of digits of a digest.
const DIGITS: usize = 16;

/// Returns the text of a file with its mark.
pub(super) fn marked(path: &Path, text: &str) -> String {
    match comment(path) {
        Some((begin, end)) => format!("{text}{begin}{MARK}{}{end}\n", digest_of(text.as_bytes())),
        None => text.to_owned(),
    }
}

/// Returns whether a file was edited since mauve installed it; `None` if mauve did not.
pub(super) fn is_edited(path: &Path, bytes: &[u8]) -> Option<bool> {
    let text = str::from_utf8(bytes).ok()?;
    if comment(path).is_none() {
        // `:helptags` writes the same index of our help file.
        return text.lines().all(|line| line.contains("\tmauve.txt\t")).then_some(false);
    }
    let mark = text.rfind(MARK)?;
    let begin = text.get(..mark)?.rfind('\n').map_or(0, |at| at + 1);
    let end = text.get(mark..)?.find('\n').map_or(text.len(), |length| mark + length + 1);
    let rest = [text.get(..begin)?, text.get(end..)?].concat();
    let digest = text.get(mark + MARK.len()..)?.get(..DIGITS);
    Some(digest != Some(&digest_of(rest.as_bytes())))
}

/// Returns what begins and ends a comment; `None` for the index of a help file.
fn comment(path: &Path) -> Option<(&'static str, &'static str)> {
    Some(match path.extension()?.to_str()? {
        "c" | "h" | "rs" => ("// ", ""),
        "el" | "scm" => (";; ", ""),
        "lua" => ("-- ", ""),
        "md" => ("<!-- ", " -->"),
        "toml" => ("# ", ""),
        "vim" => ("\" ", ""),
        _ => ("", ""),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::editor::embedded::{EMACS, GRAMMAR, HELIX, HELIX_QUERIES, NVIM, NVIM_QUERIES, ZED};

    #[test]
    fn each_installed_file_has_a_mark_that_an_edit_breaks() {
        for (path, text) in [EMACS, GRAMMAR, HELIX, HELIX_QUERIES, NVIM, NVIM_QUERIES, ZED].concat() {
            let path = Path::new(path);
            let installed = marked(path, text);
            assert!(text.ends_with('\n') && installed.starts_with(text), "{}", path.display());
            assert_eq!(is_edited(path, text.as_bytes()), None);
            assert_eq!(is_edited(path, installed.as_bytes()), Some(false));
            assert_eq!(is_edited(path, format!("{installed}more\n").as_bytes()), Some(true));
            assert_eq!(is_edited(path, installed.replacen('\n', "", 1).as_bytes()), Some(true));
            assert_eq!(is_edited(path, &installed.as_bytes()[..installed.len() - 7]), Some(true));
        }
        let tags = Path::new("doc/tags");
        assert_eq!(is_edited(tags, b"a\tmauve.txt\t/*a*\n"), Some(false));
        assert_eq!(is_edited(tags, b"a\tmauve.txt\t/*a*\nb\tother.txt\t/*b*\n"), None);
    }
}
