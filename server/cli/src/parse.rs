//! `mauve parse FILE`: the syntax tree of a file.

use std::path::PathBuf;

use mauve_projects::disk::text_of;
use mauve_projects::harmless::harmless;
use mauve_projects::load::canonical_path;
use mauve_projects::output::Output;

#[derive(Debug, clap::Args)]
pub struct ParseCommand {
    /// The file to parse.
    file: PathBuf,
}

impl ParseCommand {
    pub(crate) fn run(self) -> Result<Output, String> {
        let (text, problem) = text_of(&canonical_path(&self.file));
        if let Some(problem) = problem {
            return Err(format!("`{}`: {problem}", self.file.display()));
        }
        let parse = mauve_syntax::parse(&text);
        let code = u8::from(!parse.errors().is_empty());
        Ok(Output::verbatim(harmless(&mauve_diagnostics::tree_of(&parse, &|| ())), code))
    }
}
