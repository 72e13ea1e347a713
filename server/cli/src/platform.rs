//! `mauve platform`: what the response times assume of the computer.

mod check;
mod import;
mod recordings;

use clap::Subcommand;
use mauve_projects::output::Output;

pub(crate) use check::available_cpus;

commands! {
    PlatformCommand:

    /// Check this computer: kernel, throttling, frequency, sleep, rights and clock.
    ///
    /// Response times hold on a computer that runs real-time threads at once and at one speed. One line for each property says
    /// whether this computer has it, and how to fix it.
    ///
    /// Exit codes: 0 nothing is bad; 1 a property is bad.
    Check(check::PlatformCheck),
    /// Read what `rtla` or `cyclictest` measured, and print the entries for mauve.toml and a timing table.
    ///
    /// A FILE is the output of `rtla osnoise top -q`, `rtla hwnoise -q`, `rtla timerlat top -q`, `rtla timerlat hist` or `cyclictest -q`,
    /// also with its histogram, or the file of `cyclictest --json`. Noise becomes `[[platform.other]]`, the latency of wake-ups `[overhead]`. The last lines say what was not measured.
    ///
    /// Exit codes: 0 each FILE was read; 2 a FILE that cannot be read.
    Import(import::PlatformImport),
}
