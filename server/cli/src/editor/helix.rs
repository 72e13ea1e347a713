//! Helix: the language and its server in `languages.toml`, inlay hints in `config.toml`, and files for its runtime.

use mauve_projects::destination::behind_links;

use super::embedded::{GRAMMAR, HELIX, HELIX_QUERIES, text};
use super::home::{EditorHome, quoted};
use super::installation::{SettingsFile, Wanted};

const PROGRAM: &str = "command = \"mauve\"";

/// Returns the files, and the settings.
pub(super) fn wanted(home: &EditorHome) -> Result<Wanted, String> {
    let folder = behind_links(&home.config.join("helix"))?;
    let grammar = behind_links(&home.data.join("mauve/tree-sitter"))?;
    let mut wanted = Wanted::in_folder(&grammar, GRAMMAR);
    for (path, text) in HELIX.iter().filter(|(path, _)| path.starts_with("runtime/")) {
        wanted.add(&folder, path, *text);
    }
    wanted.add_all(&folder.join("runtime/queries/mauve"), HELIX_QUERIES);

    let mut languages = text(HELIX, "languages.toml").to_owned();
    if let Some(program) = home.program_elsewhere() {
        languages = languages.replace(PROGRAM, &format!("command = {}", quoted(program)));
        wanted.notes.push(format!("`mauve` on PATH is another program, or missing: Helix starts {program}"));
    }
    if let Some(path) = grammar.to_str() {
        languages += &format!("\n[[grammar]]\nname = \"mauve\"\nsource = {{ path = {} }}\n", quoted(path));
        wanted.notes.push("for highlighting, run `hx --grammar build`, which needs a C compiler".to_owned());
    }
    let config = text(HELIX, "config.toml").to_owned();
    for (file, text) in [("languages.toml", languages), ("config.toml", config)] {
        wanted.settings.push(SettingsFile { path: behind_links(&folder.join(file))?, text });
    }
    Ok(wanted)
}
