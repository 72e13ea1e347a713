//! `mauve schema mauve.toml|table|task-set`: what may stand in a configuration, a timing table and a task set, as a JSON
//! schema.

use clap::ValueEnum;
use mauve_projects::output::Output;

#[derive(Debug, clap::Args)]
pub struct Schema {
    /// The kind of file that the schema describes.
    of: Of,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Of {
    /// The configuration file `mauve.toml`.
    #[value(name = "mauve.toml")]
    Configuration,
    /// A timing table.
    Table,
    /// A task set, by hand or of a generated package.
    TaskSet,
}

impl Schema {
    pub(crate) fn run(self) -> Result<Output, String> {
        let text = match self.of {
            Of::Configuration => include_str!("../../../editors/schemas/mauve.schema.json"),
            Of::Table => include_str!("../../../editors/schemas/timing-table.schema.json"),
            Of::TaskSet => include_str!("../../../editors/schemas/task-set.schema.json"),
        };
        Ok(Output::verbatim(text, 0))
    }
}
