//! The folders of the user that hold settings and data, and the path of this program.

use std::env;
use std::path::{Path, PathBuf};

use mauve_projects::destination::behind_links;
use mauve_pwcet::program::program as on_path;

/// The folders of the user, with links resolved. A folder may not exist.
pub(super) struct EditorHome {
    pub(super) home: PathBuf,
    /// `$XDG_CONFIG_HOME`, by default `~/.config`.
    pub(super) config: PathBuf,
    /// `$XDG_DATA_HOME`, by default `~/.local/share`.
    pub(super) data: PathBuf,
    /// How editors start this program.
    pub(super) program: String,
}

impl EditorHome {
    /// # Errors
    ///
    /// There is no home folder, a folder cannot be read, or the path of this program cannot be written into a file.
    pub(super) fn find() -> Result<EditorHome, String> {
        // Not the entry of the user in the system's database: a static binary cannot read every database.
        let home = env::var_os("HOME").map(PathBuf::from).filter(|it| it.is_absolute());
        let home = behind_links(&home.ok_or("no home folder: set HOME to an absolute path")?)?;
        let folder = |variable, default: &str| {
            let named = env::var_os(variable).map(PathBuf::from).filter(|it| it.is_absolute());
            behind_links(&named.unwrap_or_else(|| home.join(default)))
        };
        let (config, data) =
            (folder("XDG_CONFIG_HOME", ".config")?, folder("XDG_DATA_HOME", ".local/share")?);
        Ok(EditorHome { config, data, program: program()?, home })
    }

    /// Returns the absolute path of this program if editors would not find it as `mauve`.
    pub(super) fn program_elsewhere(&self) -> Option<&str> {
        (self.program != NAME).then_some(self.program.as_str())
    }
}

const NAME: &str = "mauve";

/// Returns `mauve` if that runs this program, else its absolute path.
fn program() -> Result<String, String> {
    let own = env::current_exe().map_err(|error| format!("the path of this program is unknown: {error}"))?;
    let real = |path: &Path| path.canonicalize().ok();
    if let Some(found) = on_path(NAME)
        && real(&found) == real(&own)
    {
        return Ok(NAME.to_owned());
    }
    let path = own.to_str().filter(|path| !path.contains(char::is_control));
    path.map(str::to_owned).ok_or_else(|| {
        format!("`{}` cannot be written into settings: move mauve to a folder of PATH", own.display())
    })
}

/// Returns a string literal, in TOML, Lua and Emacs Lisp alike. The text has no control characters.
pub(super) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', r"\\").replace('"', "\\\""))
}
