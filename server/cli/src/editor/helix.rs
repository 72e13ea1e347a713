//! Helix: the language and its server in `languages.toml`, inlay hints in `config.toml`, and files for its runtime.

use std::path::Path;

use mauve_projects::destination::behind_links;
use toml_edit::{Document, Item};

use super::embedded::{GRAMMAR, HELIX, HELIX_QUERIES, text};
use super::home::{Home, quoted};
use super::installation::{Settings, Wanted};

const PROGRAM: &str = "command = \"mauve\"";

/// Returns the files, and the settings with our lines.
pub(super) fn wanted(home: &Home) -> Result<Wanted, String> {
    let folder = behind_links(&home.config.join("helix"))?;
    let grammar = behind_links(&home.data.join("mauve/tree-sitter"))?;
    let mut wanted = Wanted::in_folder(&grammar, GRAMMAR);
    for (path, text) in HELIX.iter().filter(|(path, _)| path.starts_with("runtime/")) {
        wanted.add(&folder, path, *text);
    }
    wanted.add_all(&folder.join("runtime/queries/mauve"), HELIX_QUERIES);
    let mut languages = Settings::read(&folder.join("languages.toml"))?;
    let mut config = Settings::read(&folder.join("config.toml"))?;
    put_languages(&mut wanted, home, &grammar, &mut languages)?;
    put_hints(&mut wanted, &mut config)?;
    wanted.settings = vec![languages, config];
    Ok(wanted)
}

/// Puts the language and its server into `languages.toml`.
fn put_languages(
    wanted: &mut Wanted,
    home: &Home,
    grammar: &Path,
    languages: &mut Settings,
) -> Result<(), String> {
    let document = parsed(languages)?;
    let mut lines = text(HELIX, "languages.toml").to_owned();
    if let Some(program) = home.program_elsewhere() {
        lines = lines.replace(PROGRAM, &format!("command = {}", quoted(program)));
        wanted.notes.push(format!("`mauve` on PATH is another program, or missing: Helix starts {program}"));
    }
    if let Some(path) = grammar.to_str() {
        lines += &format!("\n[[grammar]]\nname = \"mauve\"\nsource = {{ path = {} }}\n", quoted(path));
        wanted.notes.push("for highlighting, run `hx --grammar build`, which needs a C compiler".to_owned());
    }
    if let Some(own) = own_entry(&document) {
        wanted.refused.push(format!(
            "`{}` has an entry of yours, {own}, which stays: remove it to install ours",
            languages.shown()
        ));
    } else {
        languages.put(languages.rest.len(), lines.clone());
        if Document::parse(languages.text()).is_err() {
            wanted.refused.push(format!(
                "`{}` has other languages in a form that cannot be continued: write them as [[language]] and \
                 [language-server.NAME], or add these lines by hand:\n{lines}",
                languages.shown()
            ));
        }
    }
    Ok(())
}

/// Puts the switch of inlay hints into `config.toml`.
fn put_hints(wanted: &mut Wanted, config: &mut Settings) -> Result<(), String> {
    let document = parsed(config)?;
    let lsp = document.get("editor").and_then(|editor| editor.get("lsp"));
    if let Some(set) = lsp.and_then(|lsp| lsp.get("display-inlay-hints")) {
        if set.as_bool() != Some(true) {
            let path = config.shown();
            wanted.notes.push(format!(
                "response times need `display-inlay-hints = true` in [editor.lsp] of `{path}`"
            ));
        }
    } else {
        let lines = text(HELIX, "config.toml");
        match lsp.and_then(|lsp| end_of_header(lsp, &config.rest)) {
            Some(at) => {
                let key = lines.lines().filter(|line| !line.starts_with('[')).map(|line| format!("{line}\n"));
                config.put(at, key.collect());
            }
            None => config.put(config.rest.len(), lines.to_owned()),
        }
        if Document::parse(config.text()).is_err() {
            wanted.refused.push(format!(
                "`{}` has `lsp` in a form that cannot be continued: add `display-inlay-hints = true` to it",
                config.shown()
            ));
        }
    }
    Ok(())
}

fn parsed(settings: &Settings) -> Result<Document<String>, String> {
    Document::parse(settings.rest.clone()).map_err(|error| {
        let line = error
            .span()
            .map_or(1, |span| settings.rest.get(..span.start).unwrap_or_default().matches('\n').count() + 1);
        let path = settings.shown();
        format!(
            "`{path}` is not TOML (line {line}: {}): correct it first; nothing was written",
            error.message()
        )
    })
}

/// Returns the user's own entry for our language or server, in words.
fn own_entry(document: &Document<String>) -> Option<&'static str> {
    let server = document.get("language-server").and_then(|servers| servers.get("mauve"));
    if server.is_some() {
        return Some("[language-server.mauve]");
    }
    let is_ours = |name: Option<&str>| matches!(name, Some("mauve" | "mauve-toml"));
    let has_ours = match document.get("language")? {
        Item::ArrayOfTables(tables) => {
            tables.iter().any(|table| is_ours(table.get("name").and_then(Item::as_str)))
        }
        item => item.as_array()?.iter().any(|language| {
            let table = language.as_inline_table();
            is_ours(table.and_then(|table| table.get("name")?.as_str()))
        }),
    };
    has_ours.then_some("[[language]] with the name mauve")
}

/// Returns the end of the line with the header of a table, if the table has one.
fn end_of_header(table: &Item, text: &str) -> Option<usize> {
    let table = table.as_table().filter(|table| !table.is_implicit() && !table.is_dotted())?;
    let start = table.span()?.start;
    let line = text.get(start..)?.split_inclusive('\n').next()?;
    line.starts_with('[').then_some(start + line.len())
}
