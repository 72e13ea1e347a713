//! The messages about traces and sample files.

use std::path::Path;

use mauve_pwcet::trace::{Column, CsvProblem, FileKind, Totals, TraceError};
use mauve_timing::Recording;

use super::table::{executions, incomplete};
use crate::text::{counted, duration};

/// Returns the message for a recording of a program that was built otherwise than the program of an earlier recording.
pub(super) fn other_build(observed: &Path, it: &Recording, other: &Recording) -> String {
    format!(
        "`{}` was recorded with a program of `{}`, and `{}` in `{}` with one of `{}`: the execution times of one are not those of the \
         other; use recordings of the program that the robot runs, and a sample file for each",
        it.source,
        it.build,
        other.source,
        observed.display(),
        other.build
    )
}

/// Returns the message for a trace that cannot be read.
pub(crate) fn trace_error(trace: &Path, error: &TraceError) -> String {
    let shown = trace.display();
    match error {
        TraceError::Io { path, error } => format!("cannot read `{}`: {error}", path.display()),
        TraceError::Reading(error) => format!("cannot read `{shown}`: {error}"),
        TraceError::NotATrace => format!(
            "`{shown}` is not a trace: the folder has neither `executions.csv` of `mauve run --trace` nor a file `metadata` of LTTng"
        ),
        TraceError::Unfinished(path) => format!(
            "`{}` is incomplete: the program that records it still runs, or did not end properly; wait for its end, or \
             copy the file to a name that ends in `.csv`: an incomplete last line is not used",
            path.display()
        ),
        TraceError::Recording => format!(
            "`{shown}` has no complete chunk: LTTng still records the session; stop it with `lttng destroy`, or rotate it with \
             `lttng rotate`"
        ),
        TraceError::NoBabeltrace => format!(
            "`{shown}` is a trace of LTTng, which `babeltrace2` reads, and that program was not found: install the package babeltrace2"
        ),
        TraceError::Babeltrace(said) => {
            let said = said.trim_end();
            let said = if said.is_empty() { String::new() } else { format!(":\n{said}") };
            format!(
                "babeltrace2 cannot read `{shown}`; if LTTng still records this session, end it with `lttng destroy` first{said}"
            )
        }
        TraceError::Malformed { line, text } => format!(
            "`{shown}`: line {line} in the output of babeltrace2 is not an event of MAUVE: `{text}`; regenerate the packages, or \
             report this as a defect"
        ),
        TraceError::LongLine(line) => format!("`{shown}`: line {line} is longer than 64 KiB"),
        TraceError::NoThread => format!(
            "`{shown}` does not name the threads of its events, so that begins and ends cannot be matched: record again with \
             `lttng add-context -u -t vtid -t vpid` before `lttng start`"
        ),
        TraceError::NoEvents { foreign: 0 } => format!(
            "`{shown}` has no execution of a codel or a program: build the packages with -DMAUVE_TRACING=ON, and enable the events \
             with `lttng enable-event -u 'mauve*'`"
        ),
        TraceError::NoEvents { foreign } => format!(
            "`{shown}` has no event of MAUVE, and {foreign} of other programs: build the packages with -DMAUVE_TRACING=ON, and \
             enable the events with `lttng enable-event -u 'mauve*'`"
        ),
        TraceError::TooManyNames => {
            format!(
                "`{shown}` has more than 100000 names of codels, programs and instances: it is not the trace of a robot"
            )
        }
        TraceError::Csv { file, line, problem } => {
            // Only a folder has a file of periods.
            let of_folder = if *file == FileKind::Periods { "/periods.csv" } else { "" };
            format!("`{shown}{of_folder}`, line {line}: {}", csv_problem(*file, problem))
        }
        TraceError::Stopped => format!("the import of `{shown}` was cancelled"),
    }
}

/// Returns the message for a recording whose execution times are not measured.
pub(super) fn from_tables(trace: &Path) -> String {
    format!(
        "the execution times in `{}` are those of the timing tables: `mauve run` had no codels, or simulated the time; record your \
         codels in real time, with `mauve run --codels DIR --trace DIR`",
        trace.display()
    )
}

fn csv_problem(file: FileKind, problem: &CsvProblem) -> String {
    let required: Vec<String> = file.required().iter().map(|column| format!("`{}`", column.name())).collect();
    let required = match required.as_slice() {
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
        [] => String::new(),
    };
    let of = match file {
        FileKind::Executions => "executions",
        FileKind::Periods => "periods",
    };
    match problem {
        CsvProblem::NoHeader => {
            format!("the file is empty; its first line names the columns, {required} at least")
        }
        CsvProblem::Compressed => {
            "the file is compressed with gzip: decompress it with `gunzip -k` first".to_owned()
        }
        CsvProblem::Utf16 => {
            "the file is in UTF-16: convert it with `iconv -f UTF-16 -t UTF-8 FILE > NEW.csv`".to_owned()
        }
        CsvProblem::CarriageReturns => {
            "the lines end in a carriage return only: convert the file with `tr '\\r' '\\n' < FILE > NEW.csv`"
                .to_owned()
        }
        CsvProblem::Separator(separator) => format!(
            "the fields are separated by {}: convert the file with `tr '{}' ',' < FILE > NEW.csv`, if its numbers have no comma",
            if *separator == '\t' { "tabs".to_owned() } else { format!("`{separator}`") },
            separator.escape_default()
        ),
        CsvProblem::MissingColumn(column) => {
            format!("the header has no column `{}`; a file of {of} has the columns {required}", column.name())
        }
        CsvProblem::RepeatedColumn(column) => format!("the header has the column `{}` twice", column.name()),
        CsvProblem::Missing(column) => format!("no value for `{}`", column.name()),
        CsvProblem::Number(column, text) => {
            let what = match column {
                Column::Order | Column::Priority | Column::Cpus | Column::Cpu => "a number",
                _ => "a time",
            };
            let instead = if what == "a time" {
                "write nanoseconds as a decimal integer"
            } else {
                "write a decimal integer"
            };
            format!("`{text}` is not {what} for `{}`: {instead}", column.name())
        }
        CsvProblem::Fields { expected, found } => format!(
            "the line has {found} fields, and the header {expected}: write numbers without commas, and names with commas in quotes"
        ),
        CsvProblem::AfterEnd(column) => {
            format!("`{}` is later than `{}`: write both by one clock", column.name(), Column::End.name())
        }
        CsvProblem::Quotes => "a quoted field has no closing quote in this line".to_owned(),
        CsvProblem::NotUtf8 => "a name is not UTF-8 text".to_owned(),
    }
}

/// Returns the message for a trace whose executions the sample file has, from `earlier`.
pub(super) fn known(trace: &Path, samples: &Path, earlier: &str) -> String {
    format!(
        "`{}` was imported into `{}` before, from `{earlier}`: the same executions twice would falsify an estimate; nothing was added",
        trace.display(),
        samples.display()
    )
}

/// Returns the message for chunks that were imported before.
pub(super) fn known_chunks(trace: &Path, count: usize) -> String {
    let chunks = if count == 1 { "1 chunk was".to_owned() } else { format!("{count} chunks were") };
    format!("`{}`: {chunks} imported before, and not added again", trace.display())
}

/// Returns the message for a session that goes on.
pub(in crate::trace) fn still_recording(trace: &Path) -> String {
    format!(
        "LTTng still records `{}`: only its complete chunks are imported; import it again later: it adds the new ones",
        trace.display()
    )
}

/// Returns the warnings about a run that was imported.
pub(crate) fn warnings(name: &str, it: &Totals) -> Vec<String> {
    let mut found = Vec::new();
    if it.losses > 0 {
        let events = match it.lost_events {
            0 => "events (their number is unknown)".to_owned(),
            count => counted(count as usize, "event"),
        };
        found.push(format!(
            "`{name}`: the tracer discarded {events}; {} near them were not imported. Long executions are more likely to be \
             among these, so an estimate would be too low: record again with larger buffers, such as `lttng enable-channel -u \
             --subbuf-size=4M --num-subbuf=8 events`",
            incomplete(it.dropped)
        ));
    }
    found.extend(cut(&format!("`{name}`"), it));
    if it.unbalanced > 0 {
        found.push(format!(
            "`{name}`: {} have a begin without an end, or an end without a begin, and were not imported: the session was stopped \
             for a while, or a program ended abnormally",
            incomplete(it.unbalanced)
        ));
    }
    if it.clock_errors > 0 {
        found.push(format!(
            "`{name}`: a clock ran backwards at {}: those in a trace of LTTng were not imported, and those in a file have no time; \
             import files in the order of time_ns, and record on a kernel with a stable clock",
            executions(it.clock_errors)
        ));
    }
    if it.suspicious > 0 {
        found.push(format!(
            "`{name}`: {} used more CPU time than the time that passed: check the clocks of the computer, and the \
             columns execution_ns and elapsed_ns of a file",
            executions(it.suspicious)
        ));
    }
    found
}

/// Returns the warning about the work of threads that are not instances, in nanoseconds of each second.
pub(in crate::trace) fn work_elsewhere(thread: &str, per_second: u64) -> String {
    format!(
        "threads named `{thread}`, which are not instances, used {} of CPU time in each second, which no bound counts: describe it as \
         [[platform.other]] in mauve.toml",
        duration(per_second)
    )
}

/// Returns the warning about a recording, called so, that ends too early.
pub(in crate::trace) fn cut(name: &str, it: &Totals) -> Option<String> {
    (it.cuts > 0).then(|| {
        format!(
            "{name} was cut, such as by a power failure or a full disk: what was complete before the cut is used ({}), and \
             the last line without its line feed, or what `babeltrace2` could not read, is not. What the robot did then is in no \
             time; if a file was written without its last line feed, add it",
            executions(it.spans)
        )
    })
}
