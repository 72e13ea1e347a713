//! `mauve man DIR`: writes a manual page for each command, for packages of distributions.

use std::path::PathBuf;

use crate::output::Output;

#[derive(Debug, clap::Args)]
pub(crate) struct Man {
    /// The folder of the pages, such as `share/man/man1`. It is created if it does not exist.
    #[arg(value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    folder: PathBuf,
}

impl Man {
    /// Writes the pages of `command`, the whole command line.
    pub(crate) fn run(self, command: clap::Command) -> Result<Output, String> {
        let folder = self.folder.display();
        let failed = |error: std::io::Error| format!("cannot write manual pages to `{folder}`: {error}");
        std::fs::create_dir_all(&self.folder).map_err(failed)?;
        // Its name for `--version` is that of the program.
        let command = command.mut_subcommand("lsp", |lsp| lsp.display_name("mauve-lsp"));
        clap_mangen::generate_to(command, &self.folder).map_err(failed)?;
        Ok(Output::verbatim("", 0))
    }
}
