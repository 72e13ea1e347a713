//! Records the execution of traced programs: a separate session daemon, and babeltrace2 as the reader.
//!
//! Needs `lttng-tools` and `babeltrace2`, but neither a kernel module nor root: root has one daemon for the whole
//! system, so under root everything runs as `nobody`.

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A daemon, and a folder that goes with it.
pub struct Recorder {
    folder: PathBuf,
    /// Of all its programs, and of the daemon.
    variables: Vec<(&'static str, PathBuf)>,
    daemon: Option<Child>,
    /// How many sessions there were.
    sessions: u32,
}

/// An event, as it was recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// When, in nanoseconds of a clock that never goes back.
    pub time: u64,
    /// The system's number of the thread.
    pub thread: u64,
    /// `mauve_motion`
    pub provider: String,
    /// `codel`
    pub name: String,
    /// Names and values, texts without their quotes.
    pub fields: BTreeMap<String, String>,
}

/// From the event where something began to the one where it ended, both of one thread.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Span {
    /// The event of the beginning.
    pub begin: Event,
    /// In how many other spans.
    pub depth: usize,
    /// The CPU time that the thread used, in nanoseconds.
    pub cpu: u64,
    /// The time that passed, in nanoseconds.
    pub elapsed: u64,
}

impl Recorder {
    /// Starts a daemon, and waits until it answers.
    pub fn start() -> Recorder {
        Recorder::start_with(|_| Vec::new())
    }

    /// The same, where the daemon and all programs have environment variables. Their files may be made in the given folder.
    pub fn start_with(variables: impl FnOnce(&Path) -> Vec<(&'static str, PathBuf)>) -> Recorder {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        // Paths of sockets must be short, and `nobody` needs access: a folder of cargo may be unsuitable.
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("mauve-lttng-{}-{number}", std::process::id()));
        let home = folder.join("home");
        std::fs::create_dir_all(&home).unwrap_or_else(|error| panic!("no {}: {error}", home.display()));
        if is_root() {
            std::os::unix::fs::chown(&home, Some(NOBODY), Some(NOBODY))
                .unwrap_or_else(|error| panic!("{} cannot be given away: {error}", home.display()));
        }
        let variables = variables(&folder);
        let mut recorder = Recorder { folder, variables, daemon: None, sessions: 0 };
        let mut daemon = recorder.command("lttng-sessiond");
        let daemon = daemon.arg("--no-kernel").stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        recorder.daemon = Some(daemon.unwrap_or_else(|error| panic!("setpriv does not run: {error}")));
        let begin = Instant::now();
        while !recorder.lttng(&["list"]).1 {
            let ended = recorder.daemon.as_mut().is_some_and(|it| it.try_wait().is_ok_and(|it| it.is_some()));
            let is_late = begin.elapsed() > Duration::from_secs(60);
            assert!(!ended && !is_late, "no lttng-sessiond answers; tests/orocos/install installs it");
            // The daemon is another program: only its answer tells that it has started.
            sleep(Duration::from_millis(50));
        }
        recorder
    }

    /// A folder whose files the recorded programs can read. It goes with the recorder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A program that is recorded while a session is, and that ends with the thread that starts it.
    pub fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        self.command_with(&[], program)
    }

    /// The same, with the rights to real-time priorities and to locked memory: root gives them, another user needs them already.
    pub fn real_time_command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let rights = ["--inh-caps=+sys_nice,+ipc_lock", "--ambient-caps=+sys_nice,+ipc_lock"];
        self.command_with(if is_root() { &rights } else { &[] }, program)
    }

    fn command_with(&self, rights: &[&str], program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new("setpriv");
        command.arg("--pdeathsig=TERM").args(rights);
        if is_root() {
            command.args([format!("--reuid={NOBODY}"), format!("--regid={NOBODY}")]).arg("--clear-groups");
        }
        command.arg("--").arg(program.as_ref()).stdin(Stdio::null()).current_dir(&self.folder);
        let home = self.folder.join("home");
        command.env("HOME", &home).env("LTTNG_HOME", &home).env("LTTNG_UST_REGISTER_TIMEOUT", "60000");
        command.envs(self.variables.iter().map(|(name, value)| (name, value)));
        command
    }

    /// Begins a session that records all events of MAUVE, with their threads.
    pub fn record(&mut self) {
        self.record_events("mauve*", &["vtid"]);
    }

    /// Begins a session that records these events, each with contexts.
    pub fn record_events(&mut self, events: &str, contexts: &[&str]) {
        self.sessions += 1;
        let output = format!("--output={}", self.output().display());
        self.must(&["create", "mauve", &output]);
        // A program with LTTNG_UST_ALLOW_BLOCKING waits where a buffer is full.
        let waits = "--blocking-timeout=inf";
        self.must(&["enable-channel", "-u", "--subbuf-size=4M", "--num-subbuf=4", waits, "events"]);
        for context in contexts {
            self.must(&["add-context", "-u", "-c", "events", "-t", context]);
        }
        self.must(&["enable-event", "-u", "-c", "events", events]);
        self.must(&["start"]);
    }

    /// Completes a chunk of the recording, and begins the next one.
    pub fn rotate(&self) {
        self.must(&["rotate"]);
    }

    /// Ends the recording. After a rotation, its events are in chunks.
    pub fn end(&self) {
        self.must(&["stop"]);
        self.must(&["destroy"]);
    }

    /// Ends the recording; returns the recorded events in the order of time.
    pub fn stop(&self) -> Vec<Event> {
        self.end();
        let output = self.output();
        // A session without any program has no trace at all.
        if !output.join("ust").is_dir() {
            return Vec::new();
        }
        let read = Command::new("babeltrace2").args(["--no-delta", "--clock-cycles"]).arg(output).output();
        let read = read.unwrap_or_else(|error| panic!("babeltrace2 does not run: {error}"));
        let warnings = String::from_utf8_lossy(&read.stderr);
        assert!(read.status.success() && !warnings.contains("discarded"), "babeltrace2 says {warnings}");
        String::from_utf8_lossy(&read.stdout).lines().map(event).collect()
    }

    /// The folder of the last session.
    pub fn output(&self) -> PathBuf {
        self.folder.join("home").join(format!("trace{}", self.sessions))
    }

    fn must(&self, arguments: &[&str]) {
        let (said, fine) = self.lttng(arguments);
        assert!(fine, "lttng {arguments:?}: {said}");
    }

    fn lttng(&self, arguments: &[&str]) -> (String, bool) {
        let run = self.command("lttng").arg("--no-sessiond").args(arguments).output();
        let run = run.unwrap_or_else(|error| panic!("lttng does not run: {error}"));
        let said =
            [run.stdout, run.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
        (said, run.status.success())
    }
}

impl Drop for Recorder {
    /// Ends the daemon, which ends its child processes.
    fn drop(&mut self) {
        if let Some(mut daemon) = self.daemon.take() {
            let _ = Command::new("kill").arg(daemon.id().to_string()).status();
            let _ = daemon.wait();
        }
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// Of Debian.
const NOBODY: u32 = 65534;

fn is_root() -> bool {
    std::fs::metadata("/proc/self").is_ok_and(|itself| itself.uid() == 0)
}

/// `[0000123] host mauve_motion:codel: { cpu_id = 1 }, { vtid = 7 }, { instance = "guidance", phase = 0 }`
fn event(line: &str) -> Event {
    let parsed = || {
        let (time, rest) = line.strip_prefix('[')?.split_once("] ")?;
        let (head, data) = rest.split_once(": { ")?;
        let (provider, name) = head.rsplit(' ').next()?.split_once(':')?;
        let mut fields = BTreeMap::new();
        let mut data = data;
        while let Some((key, rest)) = data.split_once(" = ") {
            let (value, rest) = match rest.strip_prefix('"') {
                Some(rest) => rest.split_once('"')?,
                None => rest.split_at(rest.find([',', ' '])?),
            };
            fields.insert(key.trim_start_matches([' ', ',', '{', '}']).to_owned(), value.to_owned());
            data = rest;
        }
        let thread = fields.remove("vtid")?.parse().ok()?;
        let (provider, name) = (provider.to_owned(), name.to_owned());
        Some(Event { time: time.parse().ok()?, thread, provider, name, fields })
    };
    parsed().unwrap_or_else(|| panic!("this is no event: {line}"))
}

impl Event {
    /// One of its fields.
    pub fn field(&self, name: &str) -> &str {
        self.fields.get(name).unwrap_or_else(|| panic!("no {name}: {self:?}"))
    }

    /// The CPU time that its thread had used, in nanoseconds.
    pub fn cpu(&self) -> u64 {
        let time = self.field("cpu_ns");
        time.parse().unwrap_or_else(|error| panic!("{time}: {error}"))
    }

    fn is_end(&self) -> bool {
        match self.field("phase") {
            "0" => false,
            "1" => true,
            other => panic!("there is no phase {other}: {self:?}"),
        }
    }

    /// All that its other half has in common with it.
    fn key(&self) -> (&str, &str, Vec<(&String, &String)>) {
        // Only the begin of a period has the scheduling of its thread, and only the end of an access what it came to.
        let own = ["cpu_id", "phase", "cpu_ns", "priority", "cpus", "waits", "outcome"];
        let fields = self.fields.iter().filter(|(name, _)| !own.contains(&name.as_str()));
        (&self.provider, &self.name, fields.collect())
    }
}

/// The spans of a trace, in the order in which they begin.
///
/// # Errors
///
/// Begins and ends are not nested, or the CPU time of a thread decreases.
pub fn spans(events: &[Event]) -> Result<Vec<Span>, String> {
    let mut spans: Vec<Option<Span>> = Vec::new();
    // For each thread the numbers of its open spans, and its CPU time.
    let mut threads: BTreeMap<u64, (Vec<usize>, u64)> = BTreeMap::new();
    let mut begins: Vec<&Event> = Vec::new();
    for event in events {
        let (open, cpu) = threads.entry(event.thread).or_default();
        if event.cpu() < *cpu {
            return Err(format!("the CPU time goes back: {event:?}"));
        }
        *cpu = event.cpu();
        if !event.is_end() {
            open.push(begins.len());
            begins.push(event);
            spans.push(None);
            continue;
        }
        let number = open.pop().ok_or_else(|| format!("this has no begin: {event:?}"))?;
        let begin = begins[number];
        if begin.key() != event.key() {
            return Err(format!("{event:?} ends within {begin:?}"));
        }
        let (cpu, elapsed) = (event.cpu() - begin.cpu(), event.time - begin.time);
        spans[number] = Some(Span { begin: begin.clone(), depth: open.len(), cpu, elapsed });
    }
    let whole = |(number, span): (usize, Option<Span>)| {
        span.ok_or_else(|| format!("this has no end: {:?}", begins[number]))
    };
    spans.into_iter().enumerate().map(whole).collect()
}
