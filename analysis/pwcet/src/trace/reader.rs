//! Reads the chunks of a trace.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use super::babeltrace::{Babeltrace, Lost};
use super::csv;
use super::cut::Complete;
use super::error::TraceError;
use super::event::{self, BabeltraceLine, Ros2Event, SpanEvent};
use super::lines::TraceLines;
use super::names::{NameId, SpanKind, SpanName, SpanNames, lock_key};
use super::nesting::Nesting;
use super::ros2::{ROS2_LIBRARY, Ros2Graph};
use super::source::Source;
use super::{Progress, RecordedThread, Span, Totals, Visitor};

/// Events between two calls of [`Visitor::progress`].
const PROGRESS: u64 = 1 << 16;

/// Bounds the memory that a hostile trace needs.
const MOST_ORIGINS: u32 = 1 << 12;

/// Reads the chunks of one trace, in the order of time: spans may begin in one chunk and end in a later one.
///
/// ```
/// use std::ops::ControlFlow;
/// use mauve_pwcet::trace::{SpanNames, TraceReader, Span, Visitor};
///
/// struct Longest(u64);
///
/// impl Visitor for Longest {
///     fn span(&mut self, span: &Span, _: &SpanNames) -> ControlFlow<()> {
///         self.0 = self.0.max(span.execution);
///         ControlFlow::Continue(())
///     }
/// }
///
/// let text = "codel,execution_ns\nnav.plan,1200\nnav.plan,1300\n";
/// let (mut reader, mut longest) = (TraceReader::default(), Longest(0));
/// reader.read_csv(text.as_bytes(), None, &mut longest).unwrap();
/// assert_eq!((longest.0, reader.finish().spans), (1300, 2));
/// ```
#[derive(Debug, Default)]
pub struct TraceReader {
    names: SpanNames,
    summary: Totals,
    nesting: Nesting,
    origins: HashMap<Vec<u8>, u32>,
    ros2: Ros2Graph,
}

impl TraceReader {
    /// Returns a reader for which the instances with these recorded names have other names.
    pub fn renaming(instances: HashMap<String, String>) -> TraceReader {
        TraceReader { names: SpanNames::renaming(instances), ..TraceReader::default() }
    }

    /// Reads a complete source.
    ///
    /// # Errors
    ///
    /// The source cannot be read, is not a trace, or has no event of a generated package.
    pub fn read(&mut self, source: &Source, visitor: &mut dyn Visitor) -> Result<(), TraceError> {
        match source {
            Source::Csv { executions, periods } => {
                let open = |path: &PathBuf| File::open(path).map_err(|error| TraceError::io(path, error));
                let (file, periods) = (open(executions)?, periods.as_ref().map(open).transpose()?);
                let size = file.metadata().map_err(|error| TraceError::io(executions, error))?.len();
                csv::read(file, periods, Some(size), &mut self.names, &mut self.summary, visitor)
            }
            Source::Ctf { chunks, .. } => {
                for chunk in chunks {
                    self.read_chunk(chunk, visitor)?;
                }
                self.require_events()
            }
        }
    }

    /// Reads executions; `size` is the number of bytes, if it is known.
    ///
    /// # Errors
    ///
    /// The first error in the file.
    pub fn read_csv(
        &mut self,
        source: impl Read,
        size: Option<u64>,
        visitor: &mut dyn Visitor,
    ) -> Result<(), TraceError> {
        csv::read(source, None, size, &mut self.names, &mut self.summary, visitor)
    }

    /// Reads executions and the periods beside them.
    #[cfg(test)]
    pub(super) fn read_both(
        &mut self,
        executions: &[u8],
        periods: &[u8],
        visitor: &mut dyn Visitor,
    ) -> Result<(), TraceError> {
        csv::read(executions, Some(periods), None, &mut self.names, &mut self.summary, visitor)
    }

    /// Reads lines as `babeltrace2` prints them.
    #[cfg(test)]
    pub(super) fn read_lines(
        &mut self,
        lines: impl Read,
        visitor: &mut dyn Visitor,
    ) -> Result<(), TraceError> {
        struct Complete<R>(R, Vec<Lost>);
        impl<R: Read> Read for Complete<R> {
            fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
                self.0.read(to)
            }
        }
        let mut lines = TraceLines::new(Complete(lines, Vec::new()));
        self.read_events(&mut lines, |it| &mut it.1, visitor)
    }

    /// Reads the next chunk of a trace of LTTng. It may have no event.
    ///
    /// # Errors
    ///
    /// `babeltrace2` is not installed or fails, or the events lack their threads.
    pub fn read_chunk(&mut self, folder: &Path, visitor: &mut dyn Visitor) -> Result<(), TraceError> {
        let before = self.summary.events;
        match self.read_folder(folder, visitor) {
            Err(TraceError::Babeltrace(said)) if self.summary.events == before => {
                let complete = Complete::of(folder).map_err(|error| TraceError::io(folder, error))?;
                // Another error of `babeltrace2`, or a recording that was cut in its first packet.
                let Some(complete) = complete else { return Err(TraceError::Babeltrace(said)) };
                self.read_folder(complete.path(), visitor)?;
            }
            // `babeltrace2` has printed what is before its error.
            Err(TraceError::Babeltrace(_)) => {}
            result => return result,
        }
        let now = self.summary.last.unwrap_or_default();
        visitor.lost(now, now);
        self.summary.cuts += 1;
        self.nesting.lose_now(&mut self.summary);
        Ok(())
    }

    /// Reads what `babeltrace2` prints of a folder.
    fn read_folder(&mut self, folder: &Path, visitor: &mut dyn Visitor) -> Result<(), TraceError> {
        let mut lines = TraceLines::new(Babeltrace::start(folder)?);
        self.read_events(&mut lines, |it| &mut it.lost, visitor)?;
        let babeltrace = lines.source();
        let result = babeltrace.finish();
        for lost in std::mem::take(&mut babeltrace.lost) {
            self.lose(lost, visitor);
        }
        result
    }

    /// Reads lines of `babeltrace2`. `lost` takes the parts that were discarded, before the lines that they concern.
    fn read_events<R: Read>(
        &mut self,
        lines: &mut TraceLines<R>,
        lost: impl Fn(&mut R) -> &mut Vec<Lost>,
        visitor: &mut dyn Visitor,
    ) -> Result<(), TraceError> {
        let mut count = 0_u64;
        while lines.advance()? {
            for lost in lost(lines.source()).drain(..) {
                self.lose(lost, visitor);
            }
            let line = lines.line();
            let mut flow = match event::parse(line) {
                BabeltraceLine::Event(event) => self.event(&event, visitor)?,
                BabeltraceLine::Ros2(event) => self.ros2_event(&event, visitor)?,
                BabeltraceLine::Switch(event) => {
                    self.summary.foreign += 1;
                    self.ros2.switch(&event);
                    ControlFlow::Continue(())
                }
                BabeltraceLine::Foreign => {
                    self.summary.foreign += 1;
                    ControlFlow::Continue(())
                }
                // `babeltrace2` was ended, which its exit code says.
                BabeltraceLine::WithoutThread | BabeltraceLine::Malformed if !lines.is_complete() => {
                    return Ok(());
                }
                BabeltraceLine::WithoutThread => return Err(TraceError::NoThread),
                BabeltraceLine::Malformed => return Err(malformed(line, lines.number())),
            };
            count += 1;
            if count.is_multiple_of(PROGRESS) && flow.is_continue() {
                flow = visitor.progress(Progress { events: self.summary.events, bytes: None });
            }
            if flow.is_break() {
                return Err(TraceError::Stopped);
            }
        }
        Ok(())
    }

    fn event(
        &mut self,
        event: &SpanEvent<'_>,
        visitor: &mut dyn Visitor,
    ) -> Result<ControlFlow<()>, TraceError> {
        let thread = RecordedThread {
            origin: self.origin_of(event.process)?,
            process: event.process_id.unwrap_or(0),
            thread: event.thread,
        };
        if let Some((elapsed, blocked)) = event.lock {
            let span = self.lock(event, thread, elapsed, blocked)?;
            return Ok(visitor.span(&span, &self.names));
        }
        let name = self.names.of_text(event.text, || {
            event::name(event.kind, event.text).ok_or_else(|| malformed(event.text, 0))
        })?;
        self.summary.events += 1;
        Ok(self.nest(event, thread, name, visitor))
    }

    /// Takes a begin or an end, and gives the span that it ends to a visitor.
    fn nest(
        &mut self,
        event: &SpanEvent<'_>,
        thread: RecordedThread,
        name: NameId,
        visitor: &mut dyn Visitor,
    ) -> ControlFlow<()> {
        self.summary.at(Some(event.time));
        let missing = self.summary.missing();
        let span = self.nesting.event(event, thread, name, &mut self.summary);
        if self.summary.missing() != missing {
            visitor.lost(event.time, event.time);
        }
        match span {
            Some(span) => {
                self.summary.spans += 1;
                visitor.span(&span, &self.names)
            }
            None => ControlFlow::Continue(()),
        }
    }

    /// Takes an event of ROS 2: a callback is a codel, and all of a period of its instance.
    fn ros2_event(
        &mut self,
        event: &Ros2Event<'_>,
        visitor: &mut dyn Visitor,
    ) -> Result<ControlFlow<()>, TraceError> {
        let origin = self.origin_of(event.process)?;
        let thread = RecordedThread { origin, process: event.process_id.unwrap_or(0), thread: event.thread };
        let Some(of) = self.ros2.event(event, thread)? else {
            self.summary.foreign += 1;
            return Ok(ControlFlow::Continue(()));
        };
        self.summary.events += 1;
        let mut kinds = [SpanKind::Period, SpanKind::Codel];
        let mut ids = self.callback_ids(of.callback)?;
        if of.is_end {
            kinds.reverse();
            ids.reverse();
        }
        let Ros2Event { time, process, process_id, thread: number, cpu, .. } = *event;
        for (kind, name) in kinds.into_iter().zip(ids) {
            let event = SpanEvent {
                time,
                process,
                process_id,
                thread: number,
                cpu,
                kind,
                text: b"",
                is_end: of.is_end,
                cpu_ns: of.cpu_ns,
                scheduling: None,
                release: of.release,
                waits: None,
                lock: None,
                outcome: None,
            };
            if self.nest(&event, thread, name, visitor).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Returns the names of the period and of the codel of a callback.
    fn callback_ids(&mut self, callback: usize) -> Result<[NameId; 2], TraceError> {
        let Some(callback) = self.ros2.callbacks.get_mut(callback) else { return Ok([NameId::default(); 2]) };
        if let Some(ids) = callback.ids {
            return Ok(ids);
        }
        let instance = &callback.name;
        let period = SpanName { kind: SpanKind::Period, key: String::new(), instance: instance.clone() };
        let key = format!("{ROS2_LIBRARY}.{instance}");
        let codel = SpanName { kind: SpanKind::Codel, key, instance: instance.clone() };
        let ids = [self.names.of(period)?, self.names.of(codel)?];
        callback.ids = Some(ids);
        Ok(ids)
    }

    /// Reads a lock that a thread leaves: its event has both ends, since locks need not be left in the order in which they were got.
    fn lock(
        &mut self,
        event: &SpanEvent<'_>,
        thread: RecordedThread,
        elapsed: u64,
        blocked: u64,
    ) -> Result<Span, TraceError> {
        let lock = event::name(event.kind, event.text).ok_or_else(|| malformed(event.text, 0))?.key;
        let codel = self.nesting.leave_lock(thread, event.waits.unwrap_or(0), blocked);
        let codel = codel.map(|id| self.names.get(id).clone());
        let (codel, instance) =
            codel.map_or_else(|| ("-".to_owned(), String::new()), |it| (it.key, it.instance));
        let name =
            self.names.of(SpanName { kind: SpanKind::Lock, key: lock_key(&lock, &codel), instance })?;
        self.summary.events += 1;
        self.summary.spans += 1;
        self.summary.at(Some(event.time));
        Ok(Span {
            name,
            thread: Some(thread),
            cpu: event.cpu,
            begin: event.time.checked_sub(elapsed),
            end: Some(event.time),
            elapsed: Some(elapsed),
            execution: event.cpu_ns,
            blocked,
            ..Span::default()
        })
    }

    fn origin_of(&mut self, process: &[u8]) -> Result<u32, TraceError> {
        if let Some(id) = self.origins.get(process) {
            return Ok(*id);
        }
        let next = u32::try_from(self.origins.len()).ok().filter(|next| *next < MOST_ORIGINS);
        let id = next.ok_or(TraceError::TooManyNames)?;
        self.origins.insert(process.to_vec(), id);
        Ok(id)
    }

    fn lose(&mut self, lost: Lost, visitor: &mut dyn Visitor) {
        let now = self.summary.last.unwrap_or_default();
        let (begin, end) = lost.gap.map_or((now, now), |gap| (gap.begin, gap.end));
        visitor.lost(begin, end);
        self.summary.losses += 1;
        self.summary.lost_events = self.summary.lost_events.saturating_add(lost.events.unwrap_or(0));
        match lost.gap {
            Some(gap) => self.nesting.lose(gap, &mut self.summary),
            None => self.nesting.lose_now(&mut self.summary),
        }
    }

    /// Returns an error if the trace of LTTng that was read has no event of a generated package.
    ///
    /// # Errors
    ///
    /// It has none.
    pub fn require_events(&self) -> Result<(), TraceError> {
        match self.summary.events {
            0 => Err(TraceError::NoEvents { foreign: self.summary.foreign }),
            _ => Ok(()),
        }
    }

    /// Returns the names so far.
    pub fn names(&self) -> &SpanNames {
        &self.names
    }

    /// Returns what the events of ROS 2 said so far.
    pub fn ros2(&self) -> &Ros2Graph {
        &self.ros2
    }

    /// Returns the summary of all that was read since the last call. Spans that are open stay so.
    pub fn take_summary(&mut self) -> Totals {
        std::mem::take(&mut self.summary)
    }

    /// Ends the trace; returns the summary since the last [`TraceReader::take_summary`].
    pub fn finish(&mut self) -> Totals {
        self.nesting.finish(&mut self.summary);
        self.take_summary()
    }
}

fn malformed(line: &[u8], number: u64) -> TraceError {
    let text = line.get(..line.len().min(200)).unwrap_or_default();
    TraceError::Malformed { line: number, text: String::from_utf8_lossy(text).into_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::nesting::LostTime;
    use super::*;

    #[derive(Default)]
    struct Keys(Vec<(String, u64)>);

    impl Visitor for Keys {
        fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
            self.0.push((names.get(span.name).key.clone(), span.execution));
            ControlFlow::Continue(())
        }
    }

    /// Gives a text in parts, and announces discarded events before one of them.
    struct Output<'a> {
        parts: Vec<(&'a str, Option<Lost>)>,
        lost: Vec<Lost>,
    }

    impl Read for Output<'_> {
        fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
            if self.parts.is_empty() {
                return Ok(0);
            }
            let (text, lost) = self.parts.remove(0);
            self.lost.extend(lost);
            to[..text.len()].copy_from_slice(text.as_bytes());
            Ok(text.len())
        }
    }

    fn read(parts: Vec<(&str, Option<Lost>)>) -> Result<(Vec<(String, u64)>, Totals), TraceError> {
        let (mut reader, mut keys) = (TraceReader::default(), Keys::default());
        let mut lines = TraceLines::new(Output { parts, lost: Vec::new() });
        reader.read_events(&mut lines, |it| &mut it.lost, &mut keys)?;
        Ok((keys.0, reader.finish()))
    }

    fn line(time: u64, thread: u64, codel: &str, phase: u32, cpu: u64) -> String {
        format!(
            "[7.{time:09}] vm mauve_x:codel: {{ cpu_id = 0 }}, {{ vtid = {thread} }}, {{ instance = \"a\", codel = \"{codel}\", phase = {phase}, cpu_ns = {cpu} }}\n"
        )
    }

    #[test]
    fn threads_are_told_apart() {
        let text = [
            line(1, 1, "f", 0, 100),
            line(2, 2, "g", 0, 500),
            "[7.000000003] vm other:event: { cpu_id = 0 }, { vtid = 1 }, { }\n".to_owned(),
            line(4, 1, "f", 1, 150),
            line(5, 2, "g", 1, 501),
        ];
        let (found, summary) = read(vec![(&text.concat(), None)]).unwrap();
        assert_eq!(found, [("f".to_owned(), 50), ("g".to_owned(), 1)]);
        assert_eq!((summary.events, summary.foreign, summary.spans), (4, 1, 2));
        assert_eq!((summary.first, summary.last), (Some(7_000_000_001), Some(7_000_000_005)));
    }

    /// The spans with their waits and times in locks.
    #[derive(Default)]
    struct Waits(Vec<(String, String, u64, Option<u64>, u64)>);

    impl Visitor for Waits {
        fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
            let name = names.get(span.name);
            let (key, instance) = (name.key.clone(), name.instance.clone());
            self.0.push((key, instance, span.execution, span.waits, span.blocked));
            ControlFlow::Continue(())
        }
    }

    #[test]
    fn a_wait_for_a_recorded_lock_is_none_of_the_codel() {
        let codel = |time: u64, phase: u32, cpu: u64, waits: u64| {
            line(time, 1, "f", phase, cpu).replace(" }\n", &format!(", waits = {waits} }}\n"))
        };
        let lock = |time: u64, thread: u64, lock: &str, waits: u64| {
            format!(
                "[7.{time:09}] vm mauve_x:lock: {{ cpu_id = 0 }}, {{ vtid = {thread} }}, {{ instance = \"-\", lock = \"{lock}\", \
                 phase = 1, cpu_ns = 20, elapsed_ns = 30, blocked_ns = {}, waits = {waits} }}\n",
                100 * waits
            )
        };
        // Locks are left in any order, and by threads that execute no codel.
        let text = [
            codel(1, 0, 10, 5),
            lock(500, 1, "bus", 1),
            lock(600, 1, "a", 0),
            lock(700, 2, "bus", 1),
            codel(900, 1, 80, 8),
        ];
        let text = text.concat();
        let (mut reader, mut found) = (TraceReader::default(), Waits::default());
        let mut lines = TraceLines::new(Output { parts: vec![(&text, None)], lost: Vec::new() });
        reader.read_events(&mut lines, |it| &mut it.lost, &mut found).unwrap();
        let of = |key: &str, instance: &str, execution, waits, blocked| {
            (key.to_owned(), instance.to_owned(), execution, waits, blocked)
        };
        assert_eq!(
            found.0,
            [
                of("(lock bus) f", "a", 20, None, 100),
                of("(lock a) f", "a", 20, None, 0),
                of("(lock bus) -", "", 20, None, 100),
                of("f", "a", 70, Some(2), 100),
            ]
        );
        assert_eq!(reader.finish().spans, 4);
    }

    #[test]
    fn discarded_events_concern_the_lines_that_follow_them() {
        let begin = [line(1, 1, "f", 0, 1), line(2, 1, "f", 1, 3), line(3, 1, "g", 0, 4)].concat();
        let end = [line(90, 1, "g", 1, 90), line(91, 1, "f", 0, 91), line(92, 1, "f", 1, 93)].concat();
        let at = |time: u64| 7_000_000_000 + time;
        let lost = Lost { events: Some(5), gap: Some(LostTime { begin: at(10), end: at(80) }) };
        let (found, summary) = read(vec![(&begin, None), (&end, Some(lost))]).unwrap();
        assert_eq!(found, [("f".to_owned(), 2), ("f".to_owned(), 2)]);
        assert_eq!((summary.lost_events, summary.losses, summary.dropped), (5, 1, 1));
        let unknown = Lost { events: None, gap: None };
        let (found, summary) = read(vec![(&begin, None), (&end, Some(unknown))]).unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!((summary.lost_events, summary.losses, summary.dropped), (0, 1, 1));
    }

    #[test]
    fn a_session_without_threads_is_refused() {
        let text = line(1, 1, "f", 0, 1).replace("{ vtid = 1 }, ", "");
        assert!(matches!(read(vec![(&text, None)]), Err(TraceError::NoThread)));
        let text = format!("{}nonsense\n", line(1, 1, "f", 0, 1));
        assert!(matches!(read(vec![(&text, None)]), Err(TraceError::Malformed { line: 2, .. })));
        assert!(matches!(TraceReader::default().require_events(), Err(TraceError::NoEvents { foreign: 0 })));
    }

    /// Prints how many events are read in a second: `cargo test --release -p mauve-pwcet -- --nocapture speed`.
    #[test]
    fn speed_of_the_parser() {
        let count: u64 = if cfg!(debug_assertions) { 20_000 } else { 4_000_000 };
        let text: String = (0..1000).map(|it| line(it, 17_726, "lib.work", (it % 2) as u32, it)).collect();
        let parts = (0..count / 1000).map(|_| (text.as_str(), None)).collect();
        let begin = std::time::Instant::now();
        let (mut reader, mut visitor) = (TraceReader::default(), Ignore);
        let mut lines = TraceLines::new(Output { parts, lost: Vec::new() });
        reader.read_events(&mut lines, |it| &mut it.lost, &mut visitor).unwrap();
        eprintln!("{:.0} events in a second", count as f64 / begin.elapsed().as_secs_f64());
        assert_eq!(reader.finish().events, count);
    }

    struct Ignore;

    impl Visitor for Ignore {
        fn span(&mut self, _: &Span, _: &SpanNames) -> ControlFlow<()> {
            ControlFlow::Continue(())
        }
    }
}
