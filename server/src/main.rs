//! `mauve`: the command line, and the language server (`lsp.rs`).
//!
//! Results go to standard output, messages to standard error. Exit codes: 0 fine; 1 findings (an error in a model, a
//! deadline that is not proved, a file to be formatted); 2 usage, a path that cannot be read, or a result that cannot be written.
//!
//! Each command is a file in `cli/` with a function from its arguments to an [`output::Output`]; results are printed here alone, messages in `output.rs`. `load.rs` reads models from the disk for all of them,
//! `revision.rs` and `git.rs` read them from a commit,
//! `generate.rs` writes what is generated; `cli/editor.rs` writes the files of editors. Projects may be a stranger's: `disk.rs` says what of the disk is read, `folder.rs`
//! goes from folder to folder without following links, `destination.rs` says where an output may go, `harmless.rs` makes visible what a terminal would obey.

mod analysis_document;
mod cache;
mod cli;
mod destination;
mod disk;
mod folder;
mod generate;
mod git;
mod graph_document;
mod harmless;
mod holder;
mod json;
mod load;
mod lsp;
mod memory;
mod output;
mod replace;
mod revision;
mod signals;
mod verdict;

use std::io::Write as _;
use std::process::ExitCode;

use clap::Parser as _;

use output::say;

fn main() -> ExitCode {
    let command = cli::Arguments::parse();
    match command.run() {
        // A command without a result may have used standard output itself, and a thread may still hold it.
        Ok(output) if output.text.is_empty() => ExitCode::from(output.code),
        Ok(output) => {
            let mut out = anstream::stdout().lock();
            match out.write_all(output.text.as_bytes()).and_then(|()| out.flush()) {
                // A reader such as `head` may close the pipe early: that is not an error.
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    let _ = writeln!(anstream::stderr(), "mauve: cannot write the result: {error}");
                    ExitCode::from(2)
                }
                _ => ExitCode::from(output.code),
            }
        }
        Err(message) => {
            say(&message);
            ExitCode::from(2)
        }
    }
}
