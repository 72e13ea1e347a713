//! `--watch`: imports a trace while it is recorded.
//!
//! A file of executions becomes one run at its end. A session of LTTng becomes a run for each chunk, when LTTng has completed it:
//! `babeltrace2` cannot read the chunk that is being written, whose metadata may still be empty. Executions that begin in one
//! chunk and end in the next are complete all the same, since one reader reads all chunks.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::thread::sleep;
use std::time::Duration;

use mauve_projects::output::say;
use mauve_projects::signals::stop_on_signal;
use mauve_pwcet::trace::{Source, TraceError, TraceReader};

use super::follow::Follow;
use super::messages::{abandoned, known_chunks, no_chunk, trace_error, waiting_for_chunk};
use super::recorder::Recorder;
use super::{OpenTrace, RunOutcome, Session};

/// The time between two looks at a folder.
const PAUSE: Duration = Duration::from_millis(500);

impl Session {
    /// Imports a trace until its recording ends, or the user ends the command.
    pub(super) fn watch(&mut self, trace: &Path) -> Result<(), String> {
        stop_on_signal(self.stop.clone())?;
        let said = |error: TraceError| trace_error(trace, &error);
        match Source::of(trace).map_err(said) {
            Ok(Source::Csv { executions, .. }) if executions == trace => self.follow(trace, trace, None),
            Ok(Source::Csv { .. }) => self.import(trace),
            Ok(Source::Growing { partial, complete }) => self.follow(trace, &partial, Some(complete)),
            // A folder without a chunk may get one.
            Ok(Source::Ctf { .. }) | Err(_) if trace.is_dir() => self.watch_chunks(trace),
            Ok(Source::Ctf { .. }) => Ok(()),
            Err(message) => Err(message),
        }
    }

    fn follow(&mut self, trace: &Path, path: &Path, complete: Option<PathBuf>) -> Result<(), String> {
        let file = Follow::open(path, complete, self.stop.clone());
        let file = file.map_err(|error| format!("cannot read `{}`: {error}", path.display()))?;
        let name = trace.display().to_string();
        let mut is_removed = false;
        let mut of = OpenTrace::default();
        let outcome = self.run(&mut of, &name, true, |reader, to| {
            let result = reader.read_csv(file, None, to);
            is_removed = matches!(&result, Err(TraceError::Reading(error)) if error.kind() == std::io::ErrorKind::NotFound);
            result
        });
        if outcome.is_ok() {
            self.end(trace, of);
        }
        match outcome {
            Ok(RunOutcome::Added) => Ok(()),
            Ok(RunOutcome::Empty) => Err(trace_error(trace, &TraceError::NoEvents { foreign: 0 })),
            Ok(RunOutcome::Known(run)) => Err(self.known(trace, run)),
            Err(_) if is_removed => Err(abandoned(path)),
            Err(message) => Err(message),
        }
    }

    fn watch_chunks(&mut self, trace: &Path) -> Result<(), String> {
        let mut of = OpenTrace::default();
        let mut read: BTreeSet<PathBuf> = BTreeSet::new();
        let mut is_said = false;
        // Between two chunks, a session may seem to have ended.
        let mut idle = 0;
        loop {
            let stops = self.stop.load(Ordering::Relaxed);
            let (chunks, is_recording) = match Source::new_chunks(trace, &read) {
                // A session without a chunk may get one.
                Ok((chunks, _)) if chunks.is_empty() && read.is_empty() => (chunks, true),
                found => found.unwrap_or((Vec::new(), true)),
            };
            if chunks.is_empty() && read.is_empty() && !is_said {
                is_said = true;
                say(&waiting_for_chunk(trace));
            }
            for chunk in chunks {
                read.insert(chunk.clone());
                idle = 0;
                let name = chunk.display().to_string();
                let read = |reader: &mut TraceReader, to: &mut Recorder<'_>| reader.read_chunk(&chunk, to);
                self.run(&mut of, &name, false, read)?;
            }
            idle += usize::from(!is_recording);
            if stops || idle > 2 {
                break;
            }
            sleep(PAUSE);
        }
        // The last chunk is committed: executions that are still open only count.
        self.imported.cut(&of.reader.finish());
        let outcomes = self.end(trace, of);
        let known = outcomes.iter().filter(|it| matches!(it, RunOutcome::Known(_))).count();
        if known > 0 {
            say(&known_chunks(trace, known));
        }
        match self.imported.runs {
            0 if read.is_empty() => Err(no_chunk(trace)),
            0 => Err(trace_error(trace, &TraceError::NoEvents { foreign: 0 })),
            _ => Ok(()),
        }
    }
}
