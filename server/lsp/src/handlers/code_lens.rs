//! `textDocument/codeLens`.
//!
//! A click executes a command of the server (see `execute_command.rs`), or one of the client, if the client names it in its
//! capabilities, `experimental.commands`:
//!
//! - `mauve.chooseSignificance` lets the user choose a level. A client without it gets a lens for each other level.
//! - `mauve.showReferences` shows locations. Its arguments are an address, a position in it, and locations: what
//!   `editor.action.showReferences` of VS Code takes, as the protocol writes them. Without it, the lens does nothing.
//! - `mauve.showArchitecture`, `mauve.showSchedule`, `mauve.showStateMachine`, `mauve.showChains` and `mauve.whatIf` show drawings of
//!   the declaration at a position. Their arguments are an address and an object with the `position`. A client without them gets no such lenses.

use mauve_ide::{LensAction, LensDrawing};
use mauve_timing::Level;
use serde_json::{Value, json};
use tower_lsp::jsonrpc::Result;
use tower_lsp::lsp_types::{self, CodeLensParams, Command, Location, Range, Url};

use crate::commands::{CHOOSE_SIGNIFICANCE, GENERATE, SET_SIGNIFICANCE, SHOW_REFERENCES, drawing_command};
use crate::snapshot::Snapshot;
use crate::to_proto;

/// Returns the lenses of a file.
pub(crate) fn code_lenses(
    snapshot: &Snapshot,
    params: &CodeLensParams,
) -> Result<Option<Vec<lsp_types::CodeLens>>> {
    if !snapshot.settings.lenses || snapshot.is_stopped {
        return Ok(Some(Vec::new()));
    }
    snapshot.complete()?;
    let (file, lines) = snapshot.file(&params.text_document)?;
    let mut found = Vec::new();
    for lens in snapshot.lenses(file) {
        let range = lines.range(lens.range);
        let commands = commands(snapshot, &params.text_document.uri, range, lens.title, lens.action);
        let lens = |command| lsp_types::CodeLens { range, command: Some(command), data: None };
        found.extend(commands.into_iter().map(lens));
    }
    Ok(Some(found))
}

/// Returns the commands of a lens, each with its title: those that the client can execute.
fn commands(snapshot: &Snapshot, uri: &Url, range: Range, title: String, action: LensAction) -> Vec<Command> {
    let command = |title: String, name: &str, arguments: Vec<Value>| Command {
        title,
        command: name.to_owned(),
        arguments: Some(arguments),
    };
    let show = |title: String, locations: Vec<Location>| match snapshot.capabilities.shows_references
        && !locations.is_empty()
    {
        true => command(title, SHOW_REFERENCES, vec![json!(uri), json!(range.start), json!(locations)]),
        false => Command { title, command: String::new(), arguments: None },
    };
    match action {
        LensAction::ChooseSignificance(_) if snapshot.capabilities.chooses_significance => {
            vec![command(title, CHOOSE_SIGNIFICANCE, Vec::new())]
        }
        LensAction::ChooseSignificance(shown) => {
            let levels = snapshot.levels();
            let set =
                |level: &Level| command(format!("at {level}"), SET_SIGNIFICANCE, vec![json!(level.as_f64())]);
            other_levels(&levels, shown).map(set).collect()
        }
        // Only for clients that can generate packages.
        LensAction::Generate(_) if !snapshot.capabilities.can_generate() => Vec::new(),
        LensAction::Generate(deployment) => {
            vec![command(title, GENERATE, vec![json!(uri), json!(deployment)])]
        }
        LensAction::Draw(drawing)
            if match drawing {
                LensDrawing::Chains => snapshot.capabilities.draws_chains,
                LensDrawing::WhatIf => snapshot.capabilities.draws_what_if,
                _ => snapshot.capabilities.draws,
            } =>
        {
            let place = json!({ "position": range.start });
            vec![command(title, drawing_command(drawing), vec![json!(uri), place])]
        }
        LensAction::Draw(_) => Vec::new(),
        LensAction::Show(places) => {
            let places = places.into_iter().filter_map(|(file, range)| snapshot.location(file, range));
            vec![show(title, places.collect())]
        }
        LensAction::Open(path) => {
            let locations: Vec<Location> =
                to_proto::files_there(&[path]).map(|uri| Location { uri, range: Range::default() }).collect();
            if locations.is_empty() { Vec::new() } else { vec![show(title, locations)] }
        }
    }
}

/// Returns the levels next to the shown one, the less probable last. `levels` are in descending order of probability.
fn other_levels(levels: &[Level], shown: Level) -> impl Iterator<Item = &Level> {
    let before = levels.iter().rev().find(move |level| **level > shown);
    let after = levels.iter().find(move |level| **level < shown);
    before.into_iter().chain(after)
}
