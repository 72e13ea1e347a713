//! `mauve trace`: recorded executions of robots.

mod import;

use clap::Subcommand;

use crate::Output;

#[derive(Debug, clap::Args)]
pub(crate) struct Trace {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Add the execution times in recorded traces to a sample file.
    ///
    /// A TRACE is a folder that LTTng has recorded, which needs the program babeltrace2; a folder of `mauve run --trace`; or a
    /// file of comma-separated values, whose first line names the columns codel and execution_ns, and optionally instance,
    /// elapsed_ns and time_ns. Each TRACE becomes one run in the sample file; a session of LTTng with rotation, one run for each
    /// chunk. A run is added completely or not at all, and never twice.
    ///
    /// Executions that were not recorded completely, for example because the tracer discarded events, are not imported; warnings
    /// count them.
    ///
    /// Exit codes: 0 all traces were imported; 2 a trace that cannot be read or has no executions, or a file that cannot be
    /// written: the traces before it were imported.
    Import(import::Import),
}

impl Trace {
    pub(crate) fn run(self) -> Result<Output, String> {
        match self.command {
            Command::Import(it) => it.run(),
        }
    }
}
