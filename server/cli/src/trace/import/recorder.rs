//! Puts spans into a sample file, and shows the progress on a terminal.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::{self, IsTerminal as _, Write as _};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use mauve_projects::harmless::harmless_line;
use mauve_pwcet::samples::{SampledExecution, SamplesError, SamplesWriter, SeriesId};
use mauve_pwcet::trace::{NameId, Observation, Progress, Span, SpanKind, SpanNames, Visitor};

use super::table::ImportedSeries;

/// The time between two updates of the progress.
const PAUSE: Duration = Duration::from_millis(200);

/// Writes the executions of one run.
pub(super) struct Recorder<'a> {
    writer: &'a mut SamplesWriter,
    observation: &'a mut Observation,
    name: &'a str,
    series: BTreeMap<NameId, (SeriesId, ImportedSeries)>,
    error: Option<SamplesError>,
    is_terminal: bool,
    shown: Option<Instant>,
    begun: Instant,
}

impl<'a> Recorder<'a> {
    pub(super) fn new(
        writer: &'a mut SamplesWriter,
        observation: &'a mut Observation,
        name: &'a str,
    ) -> Recorder<'a> {
        Recorder {
            writer,
            observation,
            name,
            series: BTreeMap::new(),
            error: None,
            is_terminal: io::stderr().is_terminal(),
            shown: None,
            begun: Instant::now(),
        }
    }

    /// Returns the series that the run has, and the first error.
    pub(super) fn finish(self) -> (Vec<ImportedSeries>, Option<SamplesError>) {
        if self.shown.is_some() {
            let _ = write!(io::stderr(), "\r\x1b[K");
        }
        (self.series.into_values().map(|(_, series)| series).collect(), self.error)
    }

    /// Shows the progress on a terminal, if it is due.
    fn show(&mut self, done: impl Fn() -> String) {
        if self.is_terminal && self.shown.unwrap_or(self.begun).elapsed() >= PAUSE {
            self.shown = Some(Instant::now());
            let (name, done) = (harmless_line(self.name), done());
            let mut err = io::stderr();
            let _ = write!(err, "\r\x1b[Kmauve: importing {name}: {done}").and_then(|()| err.flush());
        }
    }

    fn add(&mut self, span: &Span, names: &SpanNames) -> Result<(), SamplesError> {
        self.observation.add(span, names);
        let name = names.get(span.name);
        if name.kind == SpanKind::Period {
            return Ok(());
        }
        let (id, series) = match self.series.entry(span.name) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                let id = self.writer.series(&name.key, &name.instance)?;
                new.insert((id, ImportedSeries::new((name.key.clone(), name.instance.clone()))))
            }
        };
        series.add(span.execution);
        // Its run is that of the writer.
        let execution =
            SampledExecution { execution: span.execution, elapsed: span.elapsed, end: span.end, run: 0 };
        self.writer.add(*id, execution)
    }
}

impl Visitor for Recorder<'_> {
    fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
        match self.add(span, names) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.error = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    /// Nothing of the recording is imported.
    fn times_are_from_tables(&mut self) -> ControlFlow<()> {
        ControlFlow::Break(())
    }

    fn work(&mut self, thread: &str, cpu: u64, elapsed: u64) {
        self.observation.add_work(thread, cpu, elapsed);
    }

    fn built(&mut self, build: &str) {
        self.observation.build = Some(build.to_owned());
    }

    fn progress(&mut self, progress: Progress) -> ControlFlow<()> {
        let part = || match progress.bytes {
            Some((done, all)) if all > 0 => format!(" ({} %)", done.saturating_mul(100) / all),
            _ => String::new(),
        };
        self.show(|| format!("{} events{}", progress.events, part()));
        ControlFlow::Continue(())
    }
}
