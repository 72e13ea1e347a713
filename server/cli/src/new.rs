//! `mauve new DIR`: a small project to start from: two components, their execution times, and a deployment whose deadlines
//! are met.

use std::path::{Path, PathBuf};

use mauve_projects::destination::{destination, destination_folder};
use mauve_projects::output::Output;
use mauve_projects::replace::create;

use crate::text::argument;

#[derive(Debug, clap::Args)]
pub struct New {
    /// The folder of the new project. It must be empty, or not exist yet.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

const FILES: [(&str, &str); 3] = [
    ("mauve.toml", include_str!("new/mauve.toml")),
    ("robot.mal", include_str!("new/robot.mal")),
    ("timing.toml", include_str!("new/timing.toml")),
];

impl New {
    pub(crate) fn run(self) -> Result<Output, String> {
        let folder = &self.folder;
        let failed = |error: std::io::Error| format!("cannot create `{}`: {error}", folder.display());
        if folder.exists() && std::fs::read_dir(folder).map_err(failed)?.next().is_some() {
            return Err(format!("`{}` is not empty: nothing was written", folder.display()));
        }
        std::fs::create_dir_all(destination_folder(folder)?).map_err(failed)?;
        let text = written(folder)?;
        Ok(Output::escaped(format!("{text}\nNext: mauve check {}\n", argument(folder)), 0))
    }
}

/// Writes the files into an empty folder, and returns what to print. A file or link that somebody else created meanwhile is
/// not overwritten.
fn written(folder: &Path) -> Result<String, String> {
    let mut text = String::new();
    for (name, content) in FILES {
        let path = folder.join(name);
        create(&destination(&path)?, content)
            .map_err(|error| format!("cannot write `{}`: {error}", path.display()))?;
        text += &format!("wrote {}\n", path.display());
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn nothing_is_overwritten_and_no_link_is_followed() {
        let folder = mauve_tests::own_scratch("new");
        for inner in ["file", "link"] {
            fs::create_dir_all(folder.join(inner)).unwrap();
        }
        fs::write(folder.join("file/robot.mal"), "mine").unwrap();
        symlink("../elsewhere", folder.join("link/robot.mal")).unwrap();
        for inner in ["file", "link"] {
            let why = written(&folder.join(inner)).unwrap_err();
            assert!(
                why.contains("robot.mal` would be written through") || why.contains("robot.mal`: "),
                "{why}"
            );
        }
        assert_eq!(fs::read_to_string(folder.join("file/robot.mal")).unwrap(), "mine");
        assert!(!folder.join("elsewhere").exists());
        fs::remove_dir_all(&folder).unwrap();
    }
}
