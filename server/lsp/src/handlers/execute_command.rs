//! `workspace/executeCommand`.
//!
//! | command | arguments | does | gives |
//! |---|---|---|---|
//! | `mauve.setSignificance` | a level, a number such as `1e-6` or that number as text; or `null` | shows everything at this level for the rest of the session: hints, diagnostics, hovers, lenses; with `null`, at that of `mauve.toml` again | the level, or `null` |
//! | `mauve.generateOrocos` | the address of a file; then, if not all packages of its projects are meant, the name of a deployment | has the client make the edit of `mauve/generate` (see `generate.rs`) | the `folder` of the packages, and how many files are `created`, `changed` and `removed` |

use mauve_timing::Level;
use serde_json::Value;
use tower_lsp::jsonrpc::{Error, Result};
use tower_lsp::lsp_types::{ExecuteCommandParams, TextDocumentIdentifier, Url};

use super::generate::{GenerateDocument, GenerateParams, generate};
use super::rename::refused;
use crate::commands::{COMMANDS, GENERATE, RELOAD, SET_SIGNIFICANCE};
use crate::snapshot::Snapshot;

/// A parsed command.
#[derive(Debug)]
pub(crate) enum ServerCommand {
    /// Sets the level that is shown; `None` selects the level of each `mauve.toml`.
    SetSignificance(Option<Level>),
    Generate(Box<GenerateDocument>),
    Reload,
}

impl ServerCommand {
    /// Returns the result of the command for the client.
    pub(crate) fn result(&self) -> Option<Value> {
        match self {
            ServerCommand::SetSignificance(level) => level.map(|level| level.as_f64().into()),
            ServerCommand::Generate(document) => Some(document.summary()),
            ServerCommand::Reload => None,
        }
    }
}

/// Parses a command.
///
/// # Errors
///
/// The command is unknown or its arguments are invalid, as a message for the user.
pub(crate) fn read(snapshot: &Snapshot, params: &ExecuteCommandParams) -> Result<ServerCommand> {
    match params.command.as_str() {
        SET_SIGNIFICANCE => {
            snapshot.complete()?;
            let level = level(&params.arguments)?;
            let known = snapshot.levels();
            match level {
                Some(level) if !known.is_empty() && !known.contains(&level) => {
                    let known: Vec<String> = known.iter().map(Level::to_string).collect();
                    let known = known.join(", ");
                    Err(Error::invalid_params(format!("no times at {level}: the tables have {known}")))
                }
                level => Ok(ServerCommand::SetSignificance(level)),
            }
        }
        GENERATE => {
            let params = generate_params(&params.arguments)?;
            if !snapshot.capabilities.applies_edits {
                return Err(refused(
                    "this editor does not apply edits of the server: run `mauve generate`".to_owned(),
                ));
            }
            Ok(ServerCommand::Generate(Box::new(generate(snapshot, &params)?)))
        }
        RELOAD if params.arguments.is_empty() => Ok(ServerCommand::Reload),
        RELOAD => Err(Error::invalid_params(format!("{RELOAD} takes no arguments"))),
        unknown => {
            let known = COMMANDS.join(", ");
            Err(Error::invalid_params(format!("no command `{unknown}`: there are {known}")))
        }
    }
}

fn level(arguments: &[Value]) -> Result<Option<Level>> {
    let number = match arguments {
        [Value::Null] => return Ok(None),
        [Value::Number(number)] => number.as_f64(),
        [Value::String(text)] => text.trim().parse().ok(),
        _ => None,
    };
    number.and_then(Level::from_f64).map(Some).ok_or_else(|| {
        let given: Vec<String> = arguments.iter().map(Value::to_string).collect();
        Error::invalid_params(format!(
            "{SET_SIGNIFICANCE} takes one level, a number between 0 and 1 such as 1e-4, or null for the \
             level of mauve.toml; found ({})",
            given.join(", ")
        ))
    })
}

fn generate_params(arguments: &[Value]) -> Result<GenerateParams> {
    let (uri, deployment) = match arguments {
        [Value::String(uri)] | [Value::String(uri), Value::Null] => (uri, None),
        [Value::String(uri), Value::String(deployment)] => (uri, Some(deployment.clone())),
        _ => {
            return Err(Error::invalid_params(format!(
                "{GENERATE} takes the URI of a file, and optionally the name of a deployment; without a \
                 deployment, all packages of the file's projects are generated"
            )));
        }
    };
    let uri = Url::parse(uri)
        .map_err(|error| Error::invalid_params(format!("`{}` is not a URI: {error}", uri.escape_debug())))?;
    Ok(GenerateParams { text_document: TextDocumentIdentifier { uri }, deployment, write: None })
}
