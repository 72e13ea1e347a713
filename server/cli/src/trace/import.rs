//! `mauve trace import TRACE… -o SAMPLES`: adds the execution times in recorded traces to a sample file.

pub(super) mod messages;
mod observed;
mod recorder;
mod table;

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use mauve_projects::destination::destination;
use mauve_projects::output::{Output, say};
use mauve_pwcet::samples::{Run, SamplesError, SamplesWriter};
use mauve_pwcet::trace::{Observation, Source, Totals, TraceError, TraceReader};

use crate::sample_file::samples_error;
use crate::text::counted;
pub(crate) use messages::{trace_error, warnings};
use observed::Memory;
use recorder::Recorder;
use table::Imported;
pub(super) use table::executions;
pub(crate) use table::shown_key;

#[derive(Debug, clap::Args)]
pub struct TraceImport {
    /// A folder of LTTng, a folder of `mauve run --trace`, or a file of executions in comma-separated values.
    #[arg(value_name = "TRACE", required = true, value_hint = clap::ValueHint::AnyPath)]
    traces: Vec<PathBuf>,
    /// The sample file: the runs are added to those that it has.
    #[arg(short, long, value_name = "SAMPLES", value_hint = clap::ValueHint::FilePath)]
    output: PathBuf,
    /// List the executions of programs, too.
    #[arg(long)]
    programs: bool,
}

impl TraceImport {
    pub(crate) fn run(self) -> Result<Output, String> {
        let place = destination(&self.output)?;
        let writer = SamplesWriter::open(&place).map_err(|error| samples_error(&self.output, &error))?;
        if writer.removed_bytes() > 0 {
            let removed = counted(usize::try_from(writer.removed_bytes()).unwrap_or(usize::MAX), "byte");
            say(&format!(
                "`{}` ended with {removed} of an import that did not end, or that is damaged: they were removed; import that trace again",
                self.output.display()
            ));
        }
        let mut session = Session {
            output: self.output.clone(),
            writer,
            imported: Imported::default(),
            memory: Memory::default(),
        };
        match self.traces.iter().try_for_each(|trace| session.import(trace)) {
            // Nothing was imported; an earlier version may have imported it without the file of what was observed.
            Err(message) if session.imported.runs == 0 => {
                session.memory.write(&self.output)?;
                Err(message)
            }
            result => {
                let code = if result.is_ok() { 0 } else { 2 };
                result.unwrap_or_else(|message| say(&message));
                let table = session.imported.table(&self.output, session.writer.runs(), self.programs);
                let memory = session.memory.write(&self.output)?;
                Ok(Output::escaped(table + &memory, code))
            }
        }
    }
}

/// Adds recordings to a sample file. Returns the table of their executions.
pub(crate) fn import_recordings(traces: &[PathBuf], output: &Path) -> Result<Output, String> {
    let (traces, output) = (traces.to_vec(), output.to_owned());
    TraceImport { traces, output, programs: false }.run()
}

/// An open sample file, and what was added to it.
struct Session {
    output: PathBuf,
    writer: SamplesWriter,
    imported: Imported,
    /// What the traces showed, for the file beside the sample file.
    memory: Memory,
}

/// What became of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RunOutcome {
    Added,
    /// It has no execution.
    Empty,
    /// The sample file has the same executions in the run with this index.
    Known(usize),
}

/// A trace that is read. Each of its chunks is a run of the sample file.
#[derive(Default)]
struct OpenTrace {
    reader: TraceReader,
    observation: Observation,
    outcomes: Vec<RunOutcome>,
    /// Those of its runs in the sample file.
    digests: Vec<String>,
    summary: Totals,
}

impl Session {
    /// Imports a complete trace.
    fn import(&mut self, trace: &Path) -> Result<(), String> {
        let said = |error: &TraceError| trace_error(trace, error);
        let source = Source::of(trace).map_err(|error| said(&error))?;
        let whole = [trace.to_owned()];
        let (chunks, is_recording) = match &source {
            Source::Ctf { chunks, is_recording } => (chunks.as_slice(), *is_recording),
            _ => (whole.as_slice(), false),
        };
        if is_recording {
            match chunks.is_empty() {
                true => return Err(said(&TraceError::Recording)),
                false => say(&messages::still_recording(trace)),
            }
        }
        let mut of = OpenTrace::default();
        for (index, chunk) in chunks.iter().enumerate() {
            let is_last = index + 1 == chunks.len();
            let read = |reader: &mut TraceReader, to: &mut Recorder<'_>| match &source {
                Source::Ctf { .. } => reader.read_chunk(chunk, to),
                _ => reader.read(&source, to),
            };
            self.run(&mut of, &chunk.display().to_string(), is_last, read)?;
        }
        let foreign = of.summary.foreign;
        let outcomes = self.end(trace, of);
        let run = |it: &RunOutcome| if let RunOutcome::Known(run) = it { Some(*run) } else { None };
        let known: Vec<usize> = outcomes.iter().filter_map(run).collect();
        match known.as_slice() {
            _ if outcomes.iter().all(|it| *it == RunOutcome::Empty) => {
                Err(said(&TraceError::NoEvents { foreign }))
            }
            [] => Ok(()),
            [first, ..] if !outcomes.contains(&RunOutcome::Added) => Err(self.known(trace, *first)),
            known => {
                say(&messages::known_chunks(trace, known.len()));
                Ok(())
            }
        }
    }

    /// Returns the message for a trace whose executions a run of the sample file has.
    fn known(&self, trace: &Path, run: usize) -> String {
        let earlier = self.writer.runs().get(run).map_or("", |run| run.source.as_str());
        messages::known(trace, &self.output, earlier)
    }

    /// Adds what `read` reads of a trace as one run. The last one ends the spans that are open.
    fn run(
        &mut self,
        of: &mut OpenTrace,
        name: &str,
        is_last: bool,
        read: impl FnOnce(&mut TraceReader, &mut Recorder<'_>) -> Result<(), TraceError>,
    ) -> Result<(), String> {
        let date = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let output = self.output.clone();
        let said = |error: SamplesError| samples_error(&output, &error);
        self.writer.begin(name, date).map_err(said)?;
        let mut recorder = Recorder::new(&mut self.writer, &mut of.observation, name);
        let result = read(&mut of.reader, &mut recorder);
        let (series, error) = recorder.finish();
        if let Some(error) = error {
            return Err(said(error));
        }
        let summary = if is_last { of.reader.finish() } else { of.reader.take_summary() };
        if summary.is_from_tables {
            return Err(messages::from_tables(Path::new(name)));
        }
        result.map_err(|error| trace_error(Path::new(name), &error))?;
        let outcome = match series.is_empty() {
            true => RunOutcome::Empty,
            false => match self.writer.commit(&summary) {
                Ok(()) => RunOutcome::Added,
                Err(SamplesError::Duplicate { run }) => RunOutcome::Known(run),
                Err(error) => return Err(said(error)),
            },
        };
        if outcome == RunOutcome::Added {
            self.imported.add(&series, &summary);
        }
        if !matches!(outcome, RunOutcome::Known(_)) {
            of.summary.add(&summary);
        }
        of.outcomes.push(outcome);
        let runs = self.writer.runs();
        of.digests.extend(match outcome {
            RunOutcome::Added => runs.last().map(Run::digest),
            RunOutcome::Known(run) => runs.get(run).map(Run::digest),
            RunOutcome::Empty => None,
        });
        Ok(())
    }

    /// Keeps what a trace showed, and says what of it was not imported, and why. Returns what became of its runs.
    fn end(&mut self, trace: &Path, of: OpenTrace) -> Vec<RunOutcome> {
        self.memory.add(trace, of.observation, &of.reader, &of.digests);
        warnings(&trace.display().to_string(), &of.summary).iter().for_each(|warning| say(warning));
        of.outcomes
    }
}
