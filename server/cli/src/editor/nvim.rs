//! Neovim: a package that it loads by itself, below `~/.local/share/nvim/site/pack`.

use std::collections::BTreeSet;
use std::env;

use mauve_projects::destination::behind_links;

use super::embedded::{NVIM, NVIM_QUERIES, text};
use super::home::{EditorHome, quoted};
use super::installation::Wanted;

pub(super) fn wanted(home: &EditorHome) -> Result<Wanted, String> {
    let app = env::var_os("NVIM_APPNAME").filter(|name| !name.is_empty()).unwrap_or("nvim".into());
    let data = home.data.join(app);
    // The last folder is ours: if it is a link, as to a clone of the repository, files behind it are not changed.
    let folder = behind_links(&data.join("site/pack/mauve/start"))?.join("mauve");
    let mut wanted = Wanted::in_folder(&folder, NVIM);
    // For a parser that the user has compiled; without one, they have no effect.
    wanted.add_all(&folder.join("queries/mauve"), NVIM_QUERIES);
    wanted.add(&folder, "doc/tags", tags("mauve.txt", text(NVIM, "doc/mauve.txt")));
    // Neovim runs this file before `plugin/mauve.lua`, and after the user's `init.lua`.
    wanted.add(&folder, "plugin/00-mauve-server.lua", server(&home.program));
    if let Some(program) = home.program_elsewhere() {
        wanted.notes.push(format!(
            "`mauve` on PATH is another program, or missing: Neovim starts {program}, unless \
             vim.g.mauve.server.path is set"
        ));
    }
    if data.join("lazy").is_dir() {
        wanted.notes.push(format!(
            "lazy.nvim may ignore packages: if `:checkhealth mauve` is unknown, add {{ dir = {} }} to its plugins",
            quoted(&folder.display().to_string())
        ));
    }
    Ok(wanted)
}

/// Returns the plugin file that names the server.
fn server(program: &str) -> String {
    format!(
        "-- The server that `mauve editor install nvim` found, unless vim.g.mauve.server.path is set.\n\
         local settings = vim.g.mauve or {{}}\n\
         settings.server = vim.tbl_extend('keep', settings.server or {{}}, {{ path = {} }})\n\
         vim.g.mauve = settings\n",
        quoted(program)
    )
}

/// Returns the index of a help file, as `:helptags` writes it.
fn tags(file: &str, help: &str) -> String {
    let is_tag = |word: &&str| !word.is_empty() && !word.contains(['|', '*']);
    let starred = help.split_whitespace().filter_map(|word| word.strip_prefix('*')?.strip_suffix('*'));
    let names: BTreeSet<&str> = starred.filter(is_tag).collect();
    names.into_iter().map(|name| format!("{name}\t{file}\t/*{name}*\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tags_of_a_help_file() {
        let help = "*mauve.txt*  MAUVE\n   *b-c* *a* |x| a*b ** *a|b*\n";
        let expected = "a\tmauve.txt\t/*a*\nb-c\tmauve.txt\t/*b-c*\nmauve.txt\tmauve.txt\t/*mauve.txt*\n";
        assert_eq!(tags("mauve.txt", help), expected);
    }
}
