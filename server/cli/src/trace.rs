//! `mauve trace`: recorded executions of robots.

mod check;
mod export;
mod import;

use clap::Subcommand;
use mauve_projects::output::Output;

pub(super) use import::{import_recordings, shown_key, trace_error, warnings as recording_warnings};

commands! {
    Trace:

    /// Add the execution times in recorded traces to a sample file.
    ///
    /// A TRACE is a folder that LTTng has recorded, which needs the program babeltrace2; a folder of `mauve run --trace`; or a
    /// file of comma-separated values, whose first line names the columns codel and execution_ns, and optionally instance,
    /// elapsed_ns, time_ns, waits and blocked_ns. Each TRACE becomes one run in the sample file; a session of LTTng with rotation, one run for each
    /// chunk. A run is added completely or not at all, and never twice.
    ///
    /// Executions that were not recorded completely, for example because the tracer discarded events, are not imported; warnings
    /// count them.
    ///
    /// Codels that waited for something are named, with the line for a timing table. The greatest times and waits are kept beside
    /// SAMPLES, in a file that ends in .observed.toml, which `mauve check` compares with the timing tables.
    ///
    /// Exit codes: 0 all traces were imported; 2 a trace that cannot be read or has no executions, or a file that cannot be
    /// written: the traces before it were imported.
    Import(import::TraceImport),
    /// Compare recorded traces with the model: what was observed, and which assumption of the analysis fails.
    ///
    /// Shows for each instance the response times beside their bounds, the periods, and the execution times beside those of the
    /// timing tables; then what the traces and the model do not agree on: priorities and CPUs of threads, transitions, execution
    /// times, response times, activations and names; then what was not observed.
    ///
    /// A TRACE is a folder that LTTng has recorded, a folder of `mauve run --trace`, or a file of executions. The last path is the
    /// model if it ends in .mal or .toml, or is a folder without a trace.
    ///
    /// Exit codes: 0 nothing contradicts the model; 1 findings, or the model has errors; 2 a trace or a model that cannot be read.
    Check(check::TraceCheck),
    /// Write a recorded trace for a viewer, with the bounds of the model beside the response times.
    ///
    /// A CPU is a process, and each instance a thread with its periods, programs and codels; beside it, each period has a slice
    /// from its release to its bound. Marks show releases, missed deadlines and exceeded bounds. Releases that the trace does not
    /// have are the latest ones that agree with the periods so far.
    ///
    /// Exit codes: 0 the trace was written; 2 a trace or a model that cannot be read, or a file that cannot be written.
    Export(export::Export),
}
