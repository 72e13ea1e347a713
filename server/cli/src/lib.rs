//! The commands of the command line: each a file with a function from its arguments to an [`Output`]. `options.rs` has the options,
//! `text.rs` the formatting that several of them share.
//!
//! This crate must never know the language server.

/// Declares commands, each with its arguments, whose `run` has the same result.
macro_rules! commands {
    ($(#[$about_all:meta])* $name:ident: $($(#[$about:meta])* $command:ident($arguments:ty),)*) => {
        $(#[$about_all])*
        #[derive(Debug, Subcommand)]
        pub enum $name {
            $($(#[$about])* $command($arguments)),*
        }

        impl $name {
            /// Runs the command; an `Err` is a message for standard error, and exit code 2.
            pub fn run(self) -> Result<Output, String> {
                match self {
                    $(Self::$command(it) => it.run()),*
                }
            }
        }
    };
}

mod analysis_stats;
mod chains;
mod check;
mod comparison;
mod date;
mod diff;
mod edited_files;
mod editor;
mod errors;
mod explain;
mod fmt;
mod generate;
mod graph;
mod import;
mod lines;
mod measure;
mod new;
mod options;
mod own_output;
mod parse;
mod platform;
mod probability;
mod psm;
mod pwcet;
mod report;
mod run;
mod sample_file;
mod schema;
mod sensitivity;
mod simulate;
mod text;
mod trace;
mod trace_events;
mod tune;
mod verify;
mod wcrt;

use clap::Subcommand;
use mauve_projects::output::Output;

commands! {
    /// A command of the command line.
    Command:

    /// Report errors and warnings in models, then the response times.
    Check(check::CheckCommand),
    /// Compute worst-case response times.
    Wcrt(wcrt::Wcrt),
    /// Check certificates of response times, without the analysis that wrote them.
    ///
    /// `mauve wcrt --certificate FILE` writes a certificate: the task set, and why each deadline is met. The checker recomputes each
    /// inequality from the task set. It takes the execution times and the model from the file: that they describe the robot is not
    /// checked. Exit codes: 0 every claim is proved; 1 a claim is not, or, without --allow-partial, the deadline of an activity is met
    /// for a reason that cannot be checked; 2 wrong usage, or a file that is not a certificate.
    Verify(verify::Verify),
    /// Search for priorities, CPUs and periods with which every deadline is met.
    ///
    /// Shows the change of the deployment as a diff, with the figures before and after it; writes nothing without --apply. Every
    /// figure is that of the analysis of the changed text. Budgets are counted in steps, so that the same model has the same
    /// answer everywhere.
    ///
    /// Exit codes: 0 every deadline is met with these values; 1 one is not, or the models have errors; 2 wrong usage, or a file
    /// that cannot be read or written.
    Tune(tune::Tune),
    /// Show how long data takes from sensors to actuators, or why there is no bound.
    ///
    /// Exit codes: 0 each chain with a limit in mauve.toml keeps it; 1 one does not, or the models have errors; 2 wrong
    /// usage, or a file that cannot be read.
    Chains(chains::ChainsCommand),
    /// Show what changed in response times and latencies between two revisions, or since one.
    ///
    /// Without arguments: HEAD and the working folder. Git is read without running hooks or anything else that the repository names.
    /// Installed message packages, and the models in MAUVE_MODELS, are those of today in both states.
    ///
    /// Exit codes: 0 nothing got worse; 1 a figure is later by more than --tolerance, is no longer met, or is gone, or nothing is proved
    /// any more; 2 wrong usage, or a state that cannot be read.
    Diff(diff::Diff),
    /// Write one page for a review or a CI job: the verdict, drawings, response times and what they depend on, and what changed.
    ///
    /// The page is one HTML file without scripts, for screens and paper. The same models give the same bytes.
    ///
    /// Exit codes: 0 every deadline is proved; 1 one is not, or the models have errors, as for `mauve check`: the page says which; 2
    /// wrong usage, or a file that cannot be read or written.
    Report(report::ReportCommand),
    /// Show a component's periodic state machine with its times.
    Psm(psm::PsmCommand),
    /// Draw the instances and connections of an architecture; of a deployment, with response times and utilisations.
    Graph(graph::GraphCommand),
    /// Simulate a schedule, and compare its response times with their bounds.
    ///
    /// The releases, the paths through the state machines and the execution times are random. Exit codes: 0 each simulated
    /// deadline was met; 1 a deadline was missed, the models have errors, or nothing could be simulated; 2 wrong usage, or a
    /// file that cannot be read.
    Simulate(simulate::Simulate),
    /// Generate Orocos packages from models: C++ components, scripts and launch files.
    ///
    /// Each library becomes one package. Only files that change are written. The files in src/codels are
    /// yours: the generator writes them as stubs, and none that you have edited. When the prototype of a codel changes,
    /// the new stub is written next to your file, as CODEL.cpp.new: update your file, or remove the
    /// .new file when you do not need it. The generator owns all other files: while a generated file has
    /// been edited, nothing is written without --force.
    ///
    /// Exit codes: 0 all files are up to date; 1 errors in the models, edits that only --force would
    /// overwrite, or, with --check, any file that is out of date; 2 a path that cannot be read
    /// or written: nothing was changed.
    #[command(verbatim_doc_comment)]
    Generate(generate::GenerateCommand),
    /// Build the program of a deployment, which needs no Orocos, and run it on this computer.
    ///
    /// Exit codes: 0 each deadline was met; 1 a deadline was missed, a component stopped because of an exception, or the models
    /// have errors; 2 the program cannot be built or started.
    Run(run::RunCommand),
    /// Make a project from a recording of a system of ROS 2.
    ///
    /// A RECORDING is a folder that `ros2 trace` has recorded, with the events ros2:*, those of CARET, and sched_switch of the kernel, as far
    /// as they were enabled: without sched_switch, times are elapsed ones. Shows what each callback took, and what the recording does
    /// not say. With -o, writes a model of its callbacks and topics, their times, and a deployment. Files that the folder has are kept;
    /// the executions are added to its sample file.
    ///
    /// Exit codes: 0 the recordings were read; 2 one cannot be read or has no callback, or a file cannot be written.
    Import(import::Import),
    /// Import recorded executions, compare them with the model, or show them in a viewer.
    #[command(subcommand)]
    Trace(trace::Trace),
    /// Execute codels alone, many times, and add their execution times to a sample file.
    ///
    /// For codels that run too rarely in the robot. Builds a program that calls each CODEL, and runs it on one CPU: blocks of
    /// executions one after the other, with warm caches, alternate with executions before each of which other data fill the caches.
    /// Both are measured as in a robot, and have the instances `(alone warm)` and `(alone cold)`.
    ///
    /// Exit codes: 0 the executions are in SAMPLES; 1 the models have errors; 2 a codel cannot run alone, the program cannot be built
    /// or failed, or a file cannot be read or written.
    Measure(measure::Measure),
    /// Estimate probabilistic worst-case execution times from measured executions.
    ///
    /// For each codel and each level, the estimate is a time that an execution exceeds with the probability of the level. The
    /// table gets its 95 % upper confidence bound. Warnings say what the measurement lacks.
    ///
    /// Exit codes: 0 each codel has an estimate within its budget; 1 a codel has none, or exceeds its budget, an execution took
    /// longer than an entry that stays, or a deadline of the project is not proved; 2 wrong usage, or a file that cannot be read
    /// or written.
    Pwcet(pwcet::Pwcet),
    /// Check what response times assume of this computer, or read what was measured of it.
    #[command(subcommand)]
    Platform(platform::PlatformCommand),
    /// Explain a diagnostic code.
    Explain(explain::Explain),
    /// Format models: changes white space only.
    Fmt(fmt::Fmt),
    /// Show the syntax tree of a file.
    Parse(parse::ParseCommand),
    /// Print the JSON schema of `mauve.toml`, of timing tables or of task sets, for editors.
    Schema(schema::Schema),
    /// Measure the running time of each analysis stage.
    AnalysisStats(analysis_stats::AnalysisStats),
    /// Create a small project to start from.
    New(new::New),
    /// Install or remove the support for an editor.
    #[command(subcommand)]
    Editor(editor::Editor),
}
