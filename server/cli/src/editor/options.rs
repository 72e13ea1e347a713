//! The options of `mauve editor install`.

use std::path::PathBuf;

use clap::ValueEnum;

#[derive(Debug, clap::Args)]
pub struct InstallOptions {
    /// The editor.
    pub(super) editor: EditorName,
    /// Change nothing: print the changes.
    #[arg(long)]
    pub(super) dry_run: bool,
    /// Also overwrite files that mauve did not write.
    #[arg(long)]
    pub(super) force: bool,
    /// The package to install in VS Code; by default the package that is installed beside mauve.
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    pub(super) vsix: Option<PathBuf>,
    /// The command of VS Code, such as code, codium or code-server; by default the first of these on PATH.
    #[arg(long, value_name = "PROGRAM", value_hint = clap::ValueHint::CommandName)]
    pub(super) program: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum EditorName {
    /// VS Code 1.91 or later, VSCodium and code-server.
    Vscode,
    /// Neovim 0.10 or later.
    Nvim,
    /// Helix 25.01 or later.
    Helix,
    /// Emacs 29 or later.
    Emacs,
    /// Zed.
    Zed,
}
