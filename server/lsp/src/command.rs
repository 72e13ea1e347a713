//! `mauve lsp`: the language server.

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::sync::Mutex;

use mauve_projects::load::Outside;
use mauve_projects::output::{Output, say};
use mauve_projects::replace::append_private;
use tracing::Level;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

use crate::{mirror::Mirror, run};

/// The language server.
#[derive(Debug, clap::Args)]
pub struct Lsp {
    /// Write a log to this file, and count the executed queries for `mauve/status`.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Record all messages, including the texts of files, in this file.
    #[arg(long, value_name = "FILE")]
    mirror: Option<PathBuf>,
    #[command(flatten)]
    outside: Outside,
    /// End with this process: that of the editor, which passes it.
    #[arg(long = "clientProcessId", value_name = "NUMBER")]
    client: Option<u32>,
    /// Accepted because some editors pass it; the server always uses standard input and output.
    #[arg(long, hide = true)]
    stdio: bool,
}

impl Lsp {
    /// Serves until the client exits.
    pub fn run(self) -> Result<Output, String> {
        if let Some(path) = &self.log {
            let file = append_private(path).map_err(|why| format!("cannot write the log: {why}"))?;
            // salsa tells of every query.
            let ours = Targets::new().with_targets([("mauve", Level::DEBUG), ("tower_lsp", Level::INFO)]);
            let lines = tracing_subscriber::fmt::layer().with_writer(Mutex::new(file)).with_ansi(false);
            tracing_subscriber::registry().with(lines.with_filter(ours)).init();
        }
        if std::io::stdin().is_terminal() {
            say("the language server expects an editor on standard input, and this is a terminal");
        }
        let mirror = self
            .mirror
            .map(|path| Mirror::create(&path).map_err(|why| format!("cannot record the session: {why}")));
        let allows_outside = self.outside.allow_outside;
        let code =
            run(std::io::stdin(), std::io::stdout(), mirror.transpose()?, allows_outside, self.client)?;
        Ok(Output::verbatim("", code))
    }
}
