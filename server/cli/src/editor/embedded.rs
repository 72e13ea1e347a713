//! The files of the editors, as the binary holds them: paths below `editors/EDITOR`, and texts.

/// A path and a text.
pub(super) type Embedded = (&'static str, &'static str);

/// Declares the files of an editor. Each test of a list compares it with the folder.
macro_rules! embedded {
    ($name:ident, $folder:literal: $($path:literal),* $(,)?) => {
        pub(super) const $name: &[Embedded] =
            &[$(($path, include_str!(concat!("../../../../editors/", $folder, "/", $path)))),*];
    };
}

embedded!(NVIM, "nvim":
    "doc/mauve.txt",
    "ftdetect/mauve.lua",
    "ftplugin/mauve.lua",
    "indent/mauve.lua",
    "lsp/mauve.lua",
    "lua/mauve/colours.lua",
    "lua/mauve/drawings.lua",
    "lua/mauve/figures.lua",
    "lua/mauve/generate.lua",
    "lua/mauve/health.lua",
    "lua/mauve/init.lua",
    "lua/mauve/problems.lua",
    "lua/mauve/terminal.lua",
    "plugin/mauve.lua",
    "syntax/mauve.vim",
);

// The generated parser, for editors that compile it, and the queries of each editor.
embedded!(GRAMMAR, "tree-sitter": "src/parser.c", "src/tree_sitter/parser.h");
embedded!(NVIM_QUERIES, "tree-sitter/queries": "folds.scm", "highlights.scm", "indents.scm");
embedded!(HELIX_QUERIES, "tree-sitter/queries/helix": "highlights.scm", "indents.scm");

// Files in `runtime/` go to that folder of Helix.
embedded!(HELIX, "helix":
    "config.toml",
    "languages.toml",
    "runtime/grammars/mauve.md",
    "runtime/queries/mauve-toml/highlights.scm",
    "runtime/queries/mauve-yaml/highlights.scm",
);

embedded!(EMACS, "emacs": "mauve-autoloads.el", "mauve-pkg.el", "mauve.el");

embedded!(ZED, "zed":
    "Cargo.toml",
    "extension.toml",
    "languages/mauve/config.toml",
    "src/lib.rs",
);

/// Returns the text of a file of an editor.
pub(super) fn text(files: &[Embedded], path: &str) -> &'static str {
    files.iter().find(|(name, _)| *name == path).map_or("", |(_, text)| text)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn each_file_of_an_editor_is_in_its_list() {
        for (folder, files) in [
            ("nvim", NVIM),
            ("helix", HELIX),
            ("emacs", EMACS),
            ("zed", ZED),
            ("tree-sitter/queries/helix", HELIX_QUERIES),
        ] {
            let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../editors").join(folder);
            let found = mauve_tests::files_in(&top).into_iter();
            let found = found.map(|path| path.strip_prefix(&top).unwrap().display().to_string());
            // Editors and compilers make these; a page for readers of the repository is not for an editor.
            let is_other = |path: &str| {
                [".gitignore", "README.md", "doc/tags", "Cargo.lock"].contains(&path)
                    || path.ends_with(".elc")
                    || path.starts_with("target/")
            };
            let found: Vec<String> = found.filter(|path| !is_other(path)).collect();
            let mut listed: Vec<&str> = files.iter().map(|(path, _)| *path).collect();
            listed.sort_unstable();
            assert_eq!(found, listed, "editors/{folder}, and its list in {}", file!());
        }
    }
}
