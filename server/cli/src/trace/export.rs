//! `mauve trace export TRACE [PATH]`: a recording as trace events, with the bounds of the model beside it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{self, BufWriter, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mauve_hir::Database;
use mauve_hir::item_tree::Kind;
use mauve_projects::analysis_document::deployments;
use mauve_projects::load::load;
use mauve_projects::output::{Output, say};
use mauve_projects::replace::put_with;
use mauve_pwcet::trace::{Outcome, Span, SpanKind, SpanName, SpanNames, Visitor, port_of};
use mauve_timing::{CpuSet, Time};
use mauve_wcrt::observed::{ExpectedDeployment, LatestReleases};
use serde_json::{Value, json};

use super::check::{RecordingArguments, model_of, read, reader_of};
use crate::errors::several_of;
use crate::options::time;
use crate::own_output::check_own;
use crate::trace_events::{arrow, line, process, thread};

#[derive(Debug, clap::Args)]
pub struct Export {
    #[command(flatten)]
    recorded: RecordingArguments,
    /// Only what happens from this time on, such as 10s, after the begin of the recording. What began before is cut.
    #[arg(long, value_name = "TIME", value_parser = time)]
    from: Option<Time>,
    /// Only what happens before this time. What ends later is cut.
    #[arg(long, value_name = "TIME", value_parser = time)]
    to: Option<Time>,
    /// Write no more than so many megabytes: viewers need several times as much memory.
    #[arg(long, value_name = "MB", default_value_t = 500)]
    limit: u64,
    /// The file to write; standard output when left out.
    #[arg(short, long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    output: Option<PathBuf>,
}

impl Export {
    pub(crate) fn run(self) -> Result<Output, String> {
        if let Some(path) = &self.output {
            check_own(path, BEGIN, "trace of a viewer", "--output")?;
        }
        let (traces, model) = self.recorded.traces_and_model();
        let [trace] = traces.as_slice() else {
            return Err("one recording is exported at a time: name one, and then its model".to_owned());
        };
        let mut db = Database::default();
        let workspaces = load(&mut db, &[model], self.recorded.outside.allow_outside)?;
        let expected = match deployments(&db, &workspaces, self.recorded.deployment.as_deref())?.as_slice() {
            [] => {
                say("no deployment in this model: the recording is exported without bounds");
                ExpectedDeployment::default()
            }
            &[(project, deployment)] => {
                model_of(&db, project, deployment, self.recorded.host.as_deref(), self.recorded.significance)?
                    .2
            }
            several => return Err(several_of(&db, Kind::Deployment, several)),
        };
        let window = self.window()?;
        let limit = self.limit.saturating_mul(1_000_000);
        match &self.output {
            None => {
                let written = write_events(trace, expected, (window, limit), io::stdout().lock())?;
                // With a closed pipe, the reader has enough.
                if let Some(error) = written.err().filter(|it| it.kind() != io::ErrorKind::BrokenPipe) {
                    return Err(format!("cannot write standard output: {error}"));
                }
            }
            Some(path) => put_with(path, |file| {
                write_events(trace, expected, (window, limit), file)
                    .unwrap_or_else(|why| Err(io::Error::other(why)))
            })?,
        }
        Ok(Output::verbatim(String::new(), 0))
    }

    /// Returns the begin and the end of the exported part, in nanoseconds after the begin of the recording.
    fn window(&self) -> Result<[i64; 2], String> {
        let nanos = |time: Option<Time>, other: i64| time.map_or(other, |it| signed(it.as_nanos()));
        match [nanos(self.from, 0), nanos(self.to, i64::MAX / 4)] {
            [from, to] if from < to => Ok([from, to]),
            _ => Err("--from is not before --to: nothing would be exported".to_owned()),
        }
    }
}

/// What a file of trace events begins with.
const BEGIN: &str = "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n";

/// Writes the events one by one; the message is for a recording that cannot be read.
fn write_events(
    trace: &Path,
    expected: ExpectedDeployment,
    (window, left): ([i64; 2], u64),
    to: impl Write,
) -> Result<io::Result<()>, String> {
    let mut reader = reader_of(&expected);
    let mut writer = TraceWriter {
        to: BufWriter::new(to),
        releases: LatestReleases::new(&expected),
        expected,
        base: None,
        window,
        numbers: BTreeMap::new(),
        written: BTreeMap::new(),
        arrows: 0,
        named: BTreeSet::new(),
        over: BTreeSet::new(),
        is_over: false,
        is_first: true,
        left,
        failure: None,
    };
    if let Err(error) = writer.to.write_all(BEGIN.as_bytes()) {
        return Ok(Err(error));
    }
    let read = read(trace, &mut reader, &mut writer);
    if let Some(error) = writer.failure {
        return Ok(Err(error));
    }
    if !writer.is_over {
        read?;
    }
    let base = writer.base.unwrap_or_default();
    let end = format!("\n],\"otherData\":{{\"zero_ns\":\"{base}\"}}}}\n");
    Ok(writer.to.write_all(end.as_bytes()).and_then(|()| writer.to.flush()))
}

/// The process for periods whose CPU is unknown.
const UNKNOWN_CPU: u32 = 65;

/// The writes of an output that arrows may begin at.
const MOST_WRITES: usize = 1 << 10;

/// Where a value was written.
struct WritePlace {
    number: Option<u64>,
    /// The process, the thread, and the time.
    at: (u32, usize, i64),
}

/// Writes spans as events. A CPU is a process, and each instance that was active on it a thread, with a thread for its bounds.
struct TraceWriter<W: Write> {
    to: BufWriter<W>,
    expected: ExpectedDeployment,
    releases: LatestReleases,
    /// The time that is 0 in the events: those of the recording have too many digits for the numbers of JSON.
    base: Option<i64>,
    /// The begin and the end of the exported part, after the begin of the recording; once that is known, as times of the recording.
    window: [i64; 2],
    /// The numbers of the instances.
    numbers: BTreeMap<String, usize>,
    /// The latest writes of each connected output, by instance and key.
    written: BTreeMap<(String, String), VecDeque<WritePlace>>,
    arrows: u64,
    named: BTreeSet<(u32, usize)>,
    /// The instances that are behind the exported part; and whether all are, so that the rest need not be read.
    over: BTreeSet<String>,
    is_over: bool,
    is_first: bool,
    /// The bytes that may still be written.
    left: u64,
    failure: Option<io::Error>,
}

impl<W: Write> Visitor for TraceWriter<W> {
    fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
        match self.span_events(span, names) {
            Ok(()) if self.is_over => ControlFlow::Break(()),
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.failure = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    fn lost(&mut self, _: u64, _: u64) {
        self.releases.interrupt();
    }
}

/// No time is later: sums of some of them are still numbers.
fn signed(time: u64) -> i64 {
    i64::try_from(time).unwrap_or(i64::MAX / 4)
}

impl<W: Write> TraceWriter<W> {
    /// Returns the time that is 0 in the events. The first span is the begin of the recording: those that began before it follow, and
    /// a second before it, few of them are before 0.
    fn base(&mut self, begin: i64) -> i64 {
        if let Some(base) = self.base {
            return base;
        }
        if self.window[0] == 0 {
            // Without --from, nothing is before it.
            self.window[0] = i64::MIN / 4;
        }
        self.window = self.window.map(|time| time.saturating_add(begin));
        *self.base.insert(begin.saturating_sub(1_000_000_000))
    }

    fn write(&mut self, event: &str) -> io::Result<()> {
        self.left = self.left.checked_sub(event.len() as u64 + 2).ok_or_else(|| {
            let advice = "viewers do not open more: --from 10s --to 12s exports two seconds, and --limit MB allows more";
            io::Error::new(io::ErrorKind::FileTooLarge, advice)
        })?;
        let separator: &[u8] = if std::mem::take(&mut self.is_first) { b"" } else { b",\n" };
        self.to.write_all(separator).and_then(|()| self.to.write_all(event.as_bytes()))
    }

    fn span_events(&mut self, span: &Span, names: &SpanNames) -> io::Result<()> {
        let (Some(begin), Some(end)) = (span.begin, span.end) else { return Ok(()) };
        let (begin, end) = (signed(begin), signed(end));
        let base = self.base(begin);
        let name = names.get(span.name);
        let index = self.expected.instances.iter().position(|it| it.instance == name.instance);
        let [from, to] = self.window;
        if end <= from || begin >= to {
            // The releases before the window say the later ones.
            if let Some(index) = index.filter(|_| name.kind == SpanKind::Period) {
                let _ = self.releases.release(index, span);
            }
            if begin >= to && name.kind == SpanKind::Period && self.over.insert(name.instance.clone()) {
                // The periods of an instance follow one another, and contain all that its thread executes. A span that goes on beyond
                // the exported part comes long after it, so all instances are waited for, and a recording without periods is read to
                // its end.
                let all = self.expected.instances.iter().map(|it| &it.instance);
                self.is_over = all.chain(self.numbers.keys()).all(|it| self.over.contains(it))
                    && !self.expected.instances.is_empty();
            }
            return Ok(());
        }
        let (pid, tid) = self.place(span, &name.instance, index)?;
        let cuts = [(begin < from, from), (end > to, to)];
        let (begin, end) = (begin.max(from), end.min(to));
        let (ts, dur) = (begin.saturating_sub(base), end.saturating_sub(begin));
        let execution = span.execution as f64 / 1e6;
        let (title, category) = match name.kind {
            SpanKind::Period => (name.instance.clone(), "period"),
            SpanKind::Program => {
                let program = name.key.rsplit_once('/').map_or(name.key.as_str(), |(_, program)| program);
                (program.to_owned(), "program")
            }
            SpanKind::Codel => (name.key.clone(), "codel"),
            SpanKind::Access => (port_of(&name.key).unwrap_or_default().to_owned(), "port"),
            SpanKind::Lock => return Ok(()),
        };
        let mut args = json!({ "execution_ms": execution });
        let mut instants = Vec::new();
        for (_, at) in cuts.iter().filter(|(is_cut, _)| *is_cut) {
            args["cut"] = "goes on outside of the exported time; execution_ms is that of all of it".into();
            instants.push(("cut", *at));
        }
        if let Some((index, args)) = index.filter(|_| name.kind == SpanKind::Period).zip(args.as_object_mut())
        {
            self.bound(index, span, (pid, tid), args, &mut instants)?;
        }
        let event =
            json!({ "ph": "X", "name": title, "cat": category, "pid": pid, "tid": tid, "args": args });
        self.write(&line(&[("ts", ts), ("dur", dur)], &event))?;
        if name.kind == SpanKind::Access {
            self.arrow(name, span, WritePlace { number: span.number, at: (pid, tid, ts) })?;
        }
        for (what, at) in instants.into_iter().filter(|(_, at)| (from..=to).contains(at)) {
            let event = json!({ "ph": "i", "s": "t", "name": what, "cat": what, "pid": pid, "tid": tid });
            self.write(&line(&[("ts", at.saturating_sub(base))], &event))?;
        }
        Ok(())
    }

    /// Draws an arrow from a write of a value to the read that has it as new data. Without numbers, that is the latest write.
    fn arrow(&mut self, name: &SpanName, span: &Span, place: WritePlace) -> io::Result<()> {
        let end = (name.instance.clone(), name.key.clone());
        let connections = &self.expected.connections;
        if matches!(span.outcome, Some(Outcome::Written)) && connections.iter().any(|it| it.ends[0] == end) {
            let written = self.written.entry(end).or_default();
            if written.len() >= MOST_WRITES {
                written.pop_front();
            }
            written.push_back(place);
            return Ok(());
        }
        let connection = connections.iter().find(|it| it.ends[1] == end);
        let Some(connection) = connection.filter(|_| span.outcome == Some(Outcome::NewData)) else {
            return Ok(());
        };
        let written = self.written.get(&connection.ends[0]);
        let mut latest = written.into_iter().flatten().rev();
        let Some(from) = latest.find(|it| it.number == place.number) else { return Ok(()) };
        let events = arrow(self.arrows, &connection.name, [from.at, place.at]);
        self.arrows += 1;
        events.iter().try_for_each(|event| self.write(event))
    }

    /// Writes the bound of a period beside it.
    fn bound(
        &mut self,
        index: usize,
        span: &Span,
        (pid, tid): (u32, usize),
        args: &mut serde_json::Map<String, Value>,
        instants: &mut Vec<(&str, i64)>,
    ) -> io::Result<()> {
        let Some(release) = self.releases.release(index, span) else { return Ok(()) };
        let Some(expected) = self.expected.instances.get(index) else { return Ok(()) };
        let end = span.end.and_then(|end| i64::try_from(end).ok()).unwrap_or_default();
        let response = end.saturating_sub(release);
        let ms = |time: i64| time as f64 / 1e6;
        args.insert("response_ms".to_owned(), ms(response).into());
        instants.push(("release", release));
        let (bound, deadline) = (expected.response.map(signed), expected.deadline.map(signed));
        if deadline.is_some_and(|deadline| response > deadline) {
            instants.push(("deadline missed", release.saturating_add(deadline.unwrap_or_default())));
        }
        let Some(bound) = bound else { return Ok(()) };
        args.insert("bound_ms".to_owned(), ms(bound).into());
        if response > bound {
            instants.push(("bound exceeded", release.saturating_add(bound)));
        }
        let is_slice = expected.burst.is_none_or(|burst| burst == 1);
        if is_slice && expected.period.map(signed).is_some_and(|period| bound <= period) {
            let base = self.base.unwrap_or_default();
            let [from, to] = self.window;
            let (begin, end) = (release.max(from), release.saturating_add(bound).min(to));
            let args = json!({ "bound_ms": ms(bound), "response_ms": ms(response) });
            let event = json!({ "ph": "X", "name": "bound", "cat": "bound", "pid": pid, "tid": tid + 1, "args": args });
            if begin < end {
                let times = [("ts", begin.saturating_sub(base)), ("dur", end.saturating_sub(begin))];
                self.write(&line(&times, &event))?;
            }
        } else {
            // Slices of one thread do not overlap.
            instants.push(("bound", release.saturating_add(bound)));
        }
        Ok(())
    }

    /// Returns the process and the thread of a span, and names them the first time.
    fn place(&mut self, span: &Span, instance: &str, index: Option<usize>) -> io::Result<(u32, usize)> {
        let expected = index.and_then(|index| self.expected.instances.get(index));
        let only = expected.and_then(|it| it.cpus).filter(|cpus| cpus.is_one());
        let cpu = span.cpu.or(only.and_then(CpuSet::first)).filter(|cpu| *cpu < CpuSet::MOST);
        let priority = expected.and_then(|it| it.priority.real_time()).map_or(0, i64::from);
        let next = self.numbers.len();
        let number = *self.numbers.entry(instance.to_owned()).or_insert(next);
        let pid = cpu.map_or(UNKNOWN_CPU, |cpu| cpu + 1);
        // Viewers take a thread with the number of its process for the main one.
        let tid = 1000 + (number * 100 + pid as usize) * 2;
        if self.named.insert((pid, tid)) {
            if self.named.insert((pid, 0)) {
                let name = cpu.map_or_else(|| "unknown CPU".to_owned(), |cpu| CpuSet::of(cpu).to_string());
                process(pid, &name).iter().try_for_each(|event| self.write(event))?;
            }
            let title = match priority {
                0 => instance.to_owned(),
                priority => format!("{instance} (priority {priority})"),
            };
            let mut named = thread(pid, tid, &title, -2 * priority).to_vec();
            if self.expected.instances.iter().any(|it| it.instance == instance && it.response.is_some()) {
                named.extend(thread(pid, tid + 1, &format!("{instance}: bound"), -2 * priority + 1));
            }
            named.iter().try_for_each(|event| self.write(event))?;
        }
        Ok((pid, tid))
    }
}
