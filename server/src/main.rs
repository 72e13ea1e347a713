//! `mauve`: the command line, and the language server.
//!
//! Results go to standard output, messages to standard error. Exit codes: 0 fine; 1 findings (an error in a model, a
//! deadline that is not proved, a file to be formatted); 2 usage, a path that cannot be read, or a result that cannot be written.
//!
//! | crate | is |
//! |---|---|
//! | `cli` | the commands: each a function from its arguments to an [`Output`], printed here alone |
//! | `lsp` | the language server |
//! | `projects` | what both read from the disk and write to it |

mod man;

use std::io::Write as _;
use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use mauve_projects::output::{Output, say};

/// Response times of component-based robots, from their MAUVE models.
#[derive(Debug, Parser)]
#[command(name = "mauve", version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: MainCommand,
}

#[derive(Debug, Subcommand)]
enum MainCommand {
    /// Run the language server for an editor, on standard input and output.
    #[command(version, display_name = "mauve")]
    Lsp(mauve_lsp::Lsp),
    #[command(flatten)]
    Other(mauve_cli::Command),
    /// Write a manual page for each command into a folder.
    #[command(hide = true)]
    Man(man::Man),
    /// Print the completion script for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

impl Arguments {
    /// Runs the command; an `Err` is a message for standard error, and exit code 2.
    fn run(self) -> Result<Output, String> {
        match self.command {
            MainCommand::Lsp(it) => it.run(),
            MainCommand::Other(it) => it.run(),
            MainCommand::Man(it) => it.run(command()),
            MainCommand::Completions { shell } => {
                let mut text = Vec::new();
                clap_complete::generate(shell, &mut command(), "mauve", &mut text);
                Ok(Output::verbatim(String::from_utf8_lossy(&text), 0))
            }
        }
    }
}

/// Returns the command line. The help of each command names its section of the reference.
fn command() -> clap::Command {
    let places = "Reference: `tests/spec` in the sources, `share/doc/mauve/reference` in a package.";
    Arguments::command().after_help(places).mut_subcommands(|it| {
        let section = format!("Reference: commands.md#mauve-{}", it.get_name());
        it.after_help(section)
    })
}

fn main() -> ExitCode {
    let arguments = Arguments::from_arg_matches(&command().get_matches());
    match arguments.unwrap_or_else(|error| error.exit()).run() {
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
