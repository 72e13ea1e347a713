//! `mauve lsp`: the language server.

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::sync::Mutex;

use tracing::Level;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

use super::{Outside, say};
use crate::Output;
use crate::lsp::{mirror::Mirror, run};
use crate::private::private;

#[derive(Debug, clap::Args)]
pub(crate) struct Lsp {
    /// Write a log into this file.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Record everything that is said into this file, texts included, for `mauve replay`.
    #[arg(long, value_name = "FILE")]
    mirror: Option<PathBuf>,
    #[command(flatten)]
    outside: Outside,
    /// What editors say to servers that know other ways: it changes nothing.
    #[arg(long, hide = true)]
    stdio: bool,
}

impl Lsp {
    /// Serves until the client is done.
    pub(crate) fn run(self) -> Result<Output, String> {
        if let Some(path) = &self.log {
            let file = private()
                .create(true)
                .append(true)
                .open(path)
                .map_err(|error| format!("cannot write the log `{}`: {error}", path.display()))?;
            // salsa tells of every query.
            let ours = Targets::new().with_targets([("mauve", Level::DEBUG), ("tower_lsp", Level::INFO)]);
            let lines = tracing_subscriber::fmt::layer().with_writer(Mutex::new(file)).with_ansi(false);
            tracing_subscriber::registry().with(lines.with_filter(ours)).init();
        }
        if std::io::stdin().is_terminal() {
            say("the language server reads messages of an editor here, and this is a terminal");
        }
        let mirror = self.mirror.map(|path| {
            let mirror = Mirror::create(&path);
            mirror.map_err(|error| format!("cannot record into `{}`: {error}", path.display()))
        });
        let code = run(std::io::stdin(), std::io::stdout(), mirror.transpose()?, self.outside.allow_outside)?;
        Ok(Output::verbatim("", code))
    }
}
