//! `mauve new DIR`: a small project that shows response times at once.

use std::path::PathBuf;

use crate::Output;

#[derive(Debug, clap::Args)]
pub(crate) struct New {
    /// The folder to make. It must not exist, or be empty.
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
        let failed = |error: std::io::Error| format!("cannot make `{}`: {error}", folder.display());
        if folder.exists() && std::fs::read_dir(folder).map_err(failed)?.next().is_some() {
            return Err(format!("`{}` is not empty: nothing was written", folder.display()));
        }
        std::fs::create_dir_all(folder).map_err(failed)?;
        let mut text = String::new();
        for (name, content) in FILES {
            std::fs::write(folder.join(name), content).map_err(failed)?;
            text += &format!("wrote {}\n", folder.join(name).display());
        }
        text += &format!("\nNow try: mauve check {}\n", folder.display());
        Ok(Output::fine(text))
    }
}
