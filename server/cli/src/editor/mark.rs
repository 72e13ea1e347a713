//! The marked line of an installed file: a comment that says that mauve wrote the file.

use std::path::Path;

const MARK: &str = "mauve: installed";

/// Returns the text of a file with its mark.
pub(super) fn marked(path: &Path, text: &str) -> String {
    match comment(path) {
        Some((begin, end)) => {
            format!("{text}{begin}{MARK} by `mauve editor install`, which overwrites this file{end}\n")
        }
        None => text.to_owned(),
    }
}

/// Returns whether mauve installed a file.
pub(super) fn is_ours(path: &Path, bytes: &[u8]) -> bool {
    let Ok(text) = str::from_utf8(bytes) else { return false };
    match comment(path) {
        Some((begin, _)) => text.lines().any(|line| line.starts_with(&format!("{begin}{MARK}"))),
        // `:helptags` writes the same index of our help file.
        None => text.lines().all(|line| line.contains("\tmauve.txt\t")),
    }
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
    fn each_installed_file_has_a_mark() {
        for (path, text) in [EMACS, GRAMMAR, HELIX, HELIX_QUERIES, NVIM, NVIM_QUERIES, ZED].concat() {
            let path = Path::new(path);
            let installed = marked(path, text);
            assert!(text.ends_with('\n') && installed.starts_with(text), "{}", path.display());
            assert!(!is_ours(path, text.as_bytes()));
            assert!(is_ours(path, installed.as_bytes()));
        }
        let tags = Path::new("doc/tags");
        assert!(is_ours(tags, b"a\tmauve.txt\t/*a*\n"));
        assert!(!is_ours(tags, b"a\tmauve.txt\t/*a*\nb\tother.txt\t/*b*\n"));
    }
}
