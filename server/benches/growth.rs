//! Over the real binary: how the time of each operation grows with the size of a project, along each axis of
//! `mauve_tests::axes`: `mauve check`, `mauve generate`, the start of a session, a keystroke to its diagnostics and hints, and
//! each request of the protocol, in the middle of a large file, at its end, and at a name that is used often.
//!
//! `cargo bench -p mauve --bench growth`; behind `--`, words that the rows to be measured have in them, such as `states`.
//! `MAUVE_BINARY=PATH` measures another binary, such as that of the commit before.
//!
//! Each axis is doubled four times. A row has the least time of some rounds at each size, in ms, and the exponent of the
//! growth: least squares over the logarithms of the times that are long enough to be measured. Rows without a long time are
//! omitted. On Linux, a time is the time that the threads of the server have run, which other processes hardly change;
//! elsewhere it is the time that has passed. This is no test.

#![allow(clippy::panic)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mauve_tests::axes::{AXES, Axis};
use mauve_tests::methods::{Asked, Location, Method, able_client, methods_of};
use mauve_tests::{Client, Text, mauve, write};
use serde_json::{Value, json};

/// How often an axis is doubled, and one more.
const SIZES: usize = 5;

/// The greatest exponent that an operation is to have.
const TARGET: f64 = 1.15;

/// Shorter times, in ms, say nothing about growth.
const SHORTEST: f64 = 3.0;

/// An operation that took longer, in ms, is not measured at greater sizes.
const LONGEST: f64 = 1_000.0;

/// Operations are repeated until all of them together took so long; once only, if they took four times as long.
const ENOUGH: Duration = Duration::from_millis(600);

/// The least times of operations, in ms, by size.
type Row = [f64; SIZES];

fn main() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("growth-{}", std::process::id()));
    let begin = Instant::now();
    let mut growing = Vec::new();
    for axis in AXES.iter().filter(|axis| is_wanted(axis.name)) {
        let mut rows = Rows::default();
        for (column, size) in sizes(axis).enumerate() {
            let _ = std::fs::remove_dir_all(&folder);
            write(&folder, &(axis.project)(size));
            rows.column = column;
            commands(&folder, &mut rows);
            session(&folder, axis, size, &mut rows);
        }
        growing.extend(rows.print(axis));
    }
    println!(
        "\n{:.0} s; {} rows grow with an exponent > {TARGET}:",
        begin.elapsed().as_secs_f64(),
        growing.len()
    );
    growing.iter().for_each(|row| println!("{row}"));
}

fn binary() -> String {
    std::env::var("MAUVE_BINARY").unwrap_or_else(|_| env!("CARGO_BIN_EXE_mauve").to_owned())
}

/// Is an axis of this name asked for?
fn is_wanted(axis: &str) -> bool {
    let mut only = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).peekable();
    only.peek().is_none() || only.any(|only| axis.contains(&only))
}

fn sizes(axis: &Axis) -> impl Iterator<Item = usize> {
    let least = axis.least;
    (0..SIZES).map(move |double| least << double)
}

/// The times of all operations along one axis.
#[derive(Default)]
struct Rows {
    times: BTreeMap<String, Row>,
    /// The size that is measured now.
    column: usize,
}

impl Rows {
    /// Adds a time to an operation, unless it has a lesser one.
    fn add(&mut self, operation: &str, time: f64) {
        let row = self.times.entry(operation.to_owned()).or_insert([f64::NAN; SIZES]);
        row[self.column] = row[self.column].min(time);
    }

    /// Is an operation fast enough to be measured at this size?
    fn is_measured(&self, operation: &str) -> bool {
        let previous = self.column.checked_sub(1);
        let Some((row, previous)) = self.times.get(operation).zip(previous) else { return true };
        // A request that has no answer at the previous size may have one here.
        row[..=previous].iter().all(|time| time.is_nan() || *time < LONGEST)
    }

    /// Prints the table of an axis; gives the rows that grow faster than they are to.
    fn print(&self, axis: &Axis) -> Vec<String> {
        let heads: String = sizes(axis).map(|size| format!("{size:>9}")).collect();
        println!("\n{:<64}{heads}  exponent", format!("{}, in ms", axis.name));
        let (mut growing, mut short) = (Vec::new(), 0);
        for (operation, row) in &self.times {
            if !row.iter().any(|time| *time >= SHORTEST) {
                short += 1;
                continue;
            }
            let exponent = exponent(axis, row);
            let figure = exponent.map_or("-".to_owned(), |it| format!("{it:.2}"));
            let mark = if exponent.is_some_and(|it| it > TARGET) { "  GROWS" } else { "" };
            let times: String = row.iter().map(|time| format!("{time:>9.1}")).collect();
            println!("{:<64}{times}  {figure:>8}{mark}", format!("{}: {operation}", axis.name));
            if !mark.is_empty() {
                growing.push(format!("{:<64}{times}  {figure:>8}", format!("{}: {operation}", axis.name)));
            }
        }
        println!("{}: {short} others never take {SHORTEST} ms", axis.name);
        growing
    }
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// The slope of the logarithms of times over those of sizes; none, if fewer than three times are long.
fn exponent(axis: &Axis, row: &Row) -> Option<f64> {
    let points = sizes(axis).zip(row).filter(|(_, time)| **time >= SHORTEST);
    let points: Vec<(f64, f64)> = points.map(|(size, time)| ((size as f64).ln(), time.ln())).collect();
    if points.len() < 3 {
        return None;
    }
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |sum, it| (sum.0 + it.0 / count, sum.1 + it.1 / count));
    let (above, below) = points
        .iter()
        .fold((0.0, 0.0), |sum, it| (sum.0 + (it.0 - x) * (it.1 - y), sum.1 + (it.0 - x).powi(2)));
    Some(above / below)
}

/// The time that the threads of a process have run; where the system does not say, the time that has passed.
struct Clock {
    begin: Instant,
    threads: PathBuf,
    /// By thread: those that have ended are not listed any more.
    ran: BTreeMap<std::ffi::OsString, u64>,
}

impl Clock {
    fn of_process(id: u32) -> Clock {
        let threads = PathBuf::from(format!("/proc/{id}/task"));
        Clock { begin: Instant::now(), threads, ran: BTreeMap::new() }
    }

    /// The present time in ms.
    fn now(&mut self) -> f64 {
        for thread in std::fs::read_dir(&self.threads).into_iter().flatten().flatten() {
            let schedule = std::fs::read_to_string(thread.path().join("schedstat")).unwrap_or_default();
            if let Some(ran) = schedule.split(' ').next().and_then(|it| it.parse().ok()) {
                self.ran.insert(thread.file_name(), ran);
            }
        }
        match self.ran.is_empty() {
            true => milliseconds(self.begin.elapsed()),
            false => self.ran.values().sum::<u64>() as f64 / 1e6,
        }
    }
}

/// The time in ms that the processes have run that this one has waited for, in hundredths of a second.
fn of_commands() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = status.rsplit(')').next()?.split_whitespace().collect();
    let field = |index: usize| fields.get(index)?.parse::<f64>().ok();
    Some((field(13)? + field(14)?) * 10.0)
}

/// The commands, as processes.
fn commands(folder: &Path, rows: &mut Rows) {
    let commands: [(&str, &[&str]); 3] = [
        ("mauve check", &["check"]),
        ("mauve generate", &["generate", "--out", "out"]),
        ("mauve wcrt, all levels", &["wcrt", "--significance", "all"]),
    ];
    for (name, arguments) in commands {
        if !rows.is_measured(name) {
            continue;
        }
        // The mean of some runs, since the system's figure is coarse.
        let (begin, ran, mut runs) = (Instant::now(), of_commands(), 0.0);
        while runs == 0.0 || runs < 20.0 && begin.elapsed() < ENOUGH / 2 {
            // Into a new folder each time: the files are written.
            let _ = std::fs::remove_dir_all(folder.join("out"));
            mauve(&binary(), folder, arguments);
            runs += 1.0;
        }
        let time = ran.zip(of_commands()).map(|(before, after)| after - before);
        rows.add(name, time.unwrap_or_else(|| milliseconds(begin.elapsed())) / runs);
    }
    let _ = std::fs::remove_dir_all(folder.join("out"));
}

/// A session, and the time that its server has run.
struct Session {
    client: Client,
    clock: Clock,
    /// Whether a request has no answer within a minute: then no further ones are sent.
    is_stuck: bool,
}

/// A session: its start, and then rounds of a keystroke and all requests. So each request is computed anew.
fn session(folder: &Path, axis: &Axis, size: usize, rows: &mut Rows) {
    let mut client = Client::start(&binary(), &[]);
    let server = client.initialize(Some(folder), &able_client(false, &["utf-16"]));
    let (methods, _) = methods_of(&mut client, &server["capabilities"]);
    let mut text = client.open_file(&folder.join(axis.file.trim_start_matches('/')));
    client.wait_for_diagnostics(&text);
    let clock = Clock::of_process(client.process());
    let mut session = Session { client, clock, is_stuck: false };
    rows.add("start of a session", session.clock.now());
    session.client.forget();
    let digits = digits(&text.text, (axis.ranges)(size));
    let begin = Instant::now();
    for round in 0..5 {
        let Some(diagnostics) = session.keystroke(&mut text, &digits, round, rows) else { return };
        for (name, place) in places(&text, axis.used) {
            session.requests(&methods, name, &place, rows);
        }
        session.whole_file(&text, &diagnostics, rows);
        session.client.forget();
        let enough = if round == 0 { ENOUGH * 4 } else { ENOUGH };
        if session.is_stuck || begin.elapsed() > enough {
            break;
        }
    }
    if let Some(kilobytes) = session.client.memory() {
        rows.add("memory of a session, in MB", kilobytes as f64 / 1024.0);
    }
}

impl Session {
    /// Replaces these digits by others; returns the diagnostics of the text. None, if that takes too long at this size.
    fn keystroke(
        &mut self,
        text: &mut Text,
        digits: &[usize],
        round: usize,
        rows: &mut Rows,
    ) -> Option<Value> {
        const NAME: &str = "keystroke to diagnostics and hints";
        if !rows.is_measured(NAME) {
            return None;
        }
        let new = (round % 2 + 1).to_string();
        let changes: Vec<Value> = positions(&text.text, digits)
            .into_iter()
            .map(|(start, end)| json!({"range": {"start": start, "end": end}, "text": new}))
            .collect();
        for &at in digits {
            text.text.replace_range(at..at + 1, &new);
        }
        text.version += 1;
        let document = json!({"uri": text.uri, "version": text.version});
        let begin = self.clock.now();
        self.client
            .notify("textDocument/didChange", json!({"textDocument": document, "contentChanges": changes}));
        let diagnostics = self.client.diagnostics(text);
        rows.add("keystroke to diagnostics", self.clock.now() - begin);
        self.client.hints(&text.uri);
        rows.add(NAME, self.clock.now() - begin);
        Some(diagnostics.into())
    }

    /// Measures each request at a location. A request that needs the answer to another request uses the last item of that answer.
    fn requests(&mut self, methods: &[&Method], name: &str, place: &Location, rows: &mut Rows) {
        let mut answers: BTreeMap<&str, Value> = BTreeMap::new();
        for method in methods {
            let params = match method.asked {
                Asked::At(params) => Some(params(place)),
                Asked::With(other, params) => {
                    answers.get(other).and_then(|answer| params(place, answer).pop())
                }
            };
            let Some(params) = params else { continue };
            // A request about the whole text is the same everywhere.
            let has = |key: &str| params.get(key).is_some();
            let is_of_place = has("position")
                || has("positions")
                || has("range") && method.name != "textDocument/inlayHint";
            let row = match is_of_place || matches!(method.asked, Asked::With(..)) {
                true => format!("{}, {name}", method.name),
                false => method.name.to_owned(),
            };
            if let Some(answer) = self.ask(&row, method.name, params, rows) {
                answers.insert(method.name, answer);
            }
        }
    }

    /// Code actions for all of a file, as an editor requests them when everything is selected or a file is saved; and the
    /// response times at all levels.
    fn whole_file(&mut self, text: &Text, diagnostics: &Value, rows: &mut Rows) {
        const METHOD: &str = "textDocument/codeAction";
        let end = text.position(text.text.len());
        let range = json!({"start": {"line": 0, "character": 0}, "end": end});
        let contexts = [
            ("whole file", json!({"diagnostics": diagnostics})),
            ("whole file, source.fixAll", json!({"diagnostics": [], "only": ["source.fixAll"]})),
            (
                "whole file, source.organizeImports",
                json!({"diagnostics": [], "only": ["source.organizeImports"]}),
            ),
        ];
        for (name, context) in contexts {
            let params = json!({"textDocument": {"uri": text.uri}, "range": range, "context": context});
            self.ask(&format!("{METHOD}, {name}"), METHOD, params, rows);
        }
        let params = json!({"textDocument": {"uri": text.uri}, "significance": "all"});
        self.ask("mauve/analysis, all levels", "mauve/analysis", params, rows);
    }

    fn ask(&mut self, row: &str, method: &str, params: Value, rows: &mut Rows) -> Option<Value> {
        if self.is_stuck || !rows.is_measured(row) {
            return None;
        }
        let begin = self.clock.now();
        let id = self.client.request(method, params);
        self.is_stuck = !self.client.receive_answer(id);
        rows.add(row, self.clock.now() - begin);
        if self.is_stuck { None } else { self.client.answer(id).ok() }
    }
}

/// The offsets of `count` digits that are values of their own, spread over the text; the one in the middle, if it is one.
fn digits(text: &str, count: usize) -> Vec<usize> {
    let is_digit = |it: char| it.is_ascii_digit();
    let all: Vec<usize> = text
        .match_indices(is_digit)
        .map(|(at, _)| at)
        .filter(|&at| text[..at].ends_with([' ', '(']) && !text[at + 1..].starts_with(is_digit))
        .collect();
    let middle = all.get(all.len() / 2).copied();
    match count {
        1 => middle.into_iter().collect(),
        _ => all.iter().copied().step_by((all.len() / count).max(1)).take(count).collect(),
    }
}

/// The positions of these bytes, which are in their order, in a text of ASCII.
fn positions(text: &str, offsets: &[usize]) -> Vec<(Value, Value)> {
    let (mut line, mut start, mut at) = (0, 0, 0);
    let mut found = Vec::new();
    for &offset in offsets {
        for (newline, _) in text[at..offset].match_indices('\n') {
            (line, start) = (line + 1, at + newline + 1);
        }
        at = offset;
        let position = |offset: usize| json!({"line": line, "character": offset - start});
        found.push((position(offset), position(offset + 1)));
    }
    found
}

/// Where requests are asked: at the word in the middle, at the last one, and at a name that is used often.
fn places(text: &Text, used: &str) -> Vec<(&'static str, Location)> {
    let is_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let middle = text.text[text.text.len() / 2..].find('\n').map_or(0, |at| text.text.len() / 2 + at);
    let middle = text.text[middle..].find(char::is_alphabetic).map_or(0, |at| middle + at);
    let last = text.text.rfind(is_word).unwrap_or(0);
    let last = text.text[..last].rfind(|it| !is_word(it)).map_or(0, |at| at + 1);
    let used = text.text.find(used).unwrap_or_else(|| panic!("no {used} in {}", text.uri));
    let places = [("middle", middle), ("end", last), ("used name", used)].map(|(name, start)| {
        let length = text.text[start..].find(|it| !is_word(it)).unwrap_or(text.text.len() - start);
        (name, Location::of(text, start..start + length, "another_name"))
    });
    places.to_vec()
}
