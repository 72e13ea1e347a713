//! `mauve man DIR`: writes a manual page for each command, for packages of distributions.

use std::path::PathBuf;

use clap_mangen::Man as Page;
use mauve_projects::destination::destination_folder;
use mauve_projects::output::Output;
use mauve_projects::replace::put_with;

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
        std::fs::create_dir_all(destination_folder(&self.folder)?)
            .map_err(|error| format!("cannot write manual pages to `{folder}`: {error}"))?;
        // Its name for `--version` is that of the program.
        let command = command.mut_subcommand("lsp", |lsp| lsp.display_name("mauve-lsp"));
        let mut command = command.disable_help_subcommand(true);
        command.build();
        self.write(command)?;
        Ok(Output::verbatim("", 0))
    }

    /// Writes the page of a command, and those of its commands.
    fn write(&self, command: clap::Command) -> Result<(), String> {
        let inner = command.get_subcommands().filter(|it| !it.is_hide_set());
        inner.cloned().try_for_each(|it| self.write(it))?;
        let page = Page::new(command);
        put_with(&self.folder.join(page.get_filename()), |mut file| page.render(&mut file))
    }
}
