//! Emacs: a package in `elpa/`, which Emacs activates when it starts. No file of the user is changed.

use std::path::{Path, PathBuf};

use mauve_projects::destination::behind_links;

use super::embedded::{EMACS, text};
use super::home::{EditorHome, quoted};
use super::installation::Wanted;

pub(super) fn wanted(home: &EditorHome) -> Result<Wanted, String> {
    let emacs = user_directory(home);
    let folder = behind_links(&emacs.join("elpa"))?.join("mauve");
    let mut wanted = Wanted::in_folder(&folder, EMACS);
    if let Some(program) = home.program_elsewhere() {
        let named = format!("(defvar mauve-program {})", quoted(program));
        wanted.add(&folder, AUTOLOADS, text(EMACS, AUTOLOADS).replace(PROGRAM, &named));
        wanted.notes.push(format!(
            "`mauve` on PATH is another program, or missing: Emacs starts {program}, unless mauve-program is set"
        ));
    }
    let early = std::fs::read_to_string(emacs.join("early-init.el")).unwrap_or_default();
    let is_off = early.lines().any(|line| {
        line.split(';').next().is_some_and(|code| code.contains("package-enable-at-startup nil"))
    });
    if is_off {
        let path = folder.join(AUTOLOADS);
        wanted.notes.push(format!(
            "early-init.el switches packages off: add (load {}) to init.el",
            quoted(&path.display().to_string())
        ));
    }
    if emacs.join("package-quickstart.el").exists() {
        wanted.notes.push("run M-x package-quickstart-refresh in Emacs".to_owned());
    }
    Ok(wanted)
}

const AUTOLOADS: &str = "mauve-autoloads.el";
const PROGRAM: &str = "(defvar mauve-program \"mauve\")";

/// Returns the folder that Emacs takes for the user's: `~/.emacs.d` if that or an old init file exists, else
/// `~/.config/emacs` if that exists.
fn user_directory(home: &EditorHome) -> PathBuf {
    let old = home.home.join(".emacs.d");
    let is_init = |name: &str| home.home.join(name).exists();
    let xdg = home.config.join("emacs");
    let has_old = old.exists() || [".emacs", ".emacs.el", ".emacs.elc", "_emacs"].into_iter().any(is_init);
    if !has_old && Path::is_dir(&xdg) { xdg } else { old }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_of_the_package_can_be_replaced() {
        assert!(text(EMACS, AUTOLOADS).contains(PROGRAM));
    }
}
