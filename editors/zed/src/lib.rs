//! Starts `mauve lsp` in Zed: the program in the settings, else `mauve` on PATH.

use zed_extension_api::settings::LspSettings;
use zed_extension_api::{Command, Extension, LanguageServerId, Result, Worktree, register_extension};

struct Mauve;

impl Extension for Mauve {
    fn new() -> Mauve {
        Mauve
    }

    fn language_server_command(&mut self, server: &LanguageServerId, worktree: &Worktree) -> Result<Command> {
        let settings = LspSettings::for_worktree(server.as_ref(), worktree)?.binary;
        let set = settings.as_ref().and_then(|binary| binary.path.clone());
        let command = set
            .or_else(|| worktree.which("mauve"))
            .ok_or("mauve is not on PATH: install it, or set lsp.mauve.binary.path")?;
        let args = settings.and_then(|binary| binary.arguments).unwrap_or_else(|| vec!["lsp".to_owned()]);
        Ok(Command { command, args, env: worktree.shell_env() })
    }
}

register_extension!(Mauve);
