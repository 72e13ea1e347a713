//! `mauve editor install EDITOR`: puts the files of an editor where it looks for them.
//!
//! The files are in the binary (`embedded.rs`); only the package for VS Code, which is built by npm, is beside it. Each editor
//! has a file that says what it needs; `installation.rs` compares that with the disk and writes what differs. Nothing of the
//! user's is overwritten: a file that mauve wrote has a line that says so (`mark.rs`), and settings are written where there are none.

mod emacs;
mod embedded;
mod helix;
mod home;
mod installation;
mod mark;
mod nvim;
mod options;
mod vscode;
mod zed;

use clap::Subcommand;
use mauve_projects::output::Output;

use home::EditorHome;
use options::{EditorName, InstallOptions};

#[derive(Debug, Subcommand)]
pub enum Editor {
    /// Install the support for an editor: highlighting, the language server, response times.
    ///
    /// A second run changes nothing, and a later version of mauve updates the files. Exit codes: 0 installed, or up to date;
    /// 1 files or settings of yours are in the way: nothing was changed; 2 a path that cannot be read or written, or an editor
    /// that cannot be started.
    Install(InstallOptions),
}

impl Editor {
    pub(crate) fn run(self) -> Result<Output, String> {
        let Editor::Install(options) = &self;
        if options.editor == EditorName::Vscode {
            return vscode::install(options);
        }
        if options.vsix.is_some() || options.program.is_some() {
            return Err("--vsix and --program are for vscode only".to_owned());
        }
        let home = EditorHome::find()?;
        let wanted = match options.editor {
            EditorName::Nvim => nvim::wanted(&home),
            EditorName::Helix => helix::wanted(&home),
            EditorName::Emacs => emacs::wanted(&home),
            EditorName::Zed | EditorName::Vscode => zed::wanted(&home),
        }?;
        installation::install(wanted, options)
    }
}
