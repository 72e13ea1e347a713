//! A long session of everything at once: random edits of several files in several folders, half-typed text, files that come
//! and go on the disk, folders, settings, requests of every kind at sensible and absurd places, cancelled at random, from
//! a client that is now quick and now slow, and now and then breaks the protocol. Whatever happened on the way, each request
//! is answered once, nothing panics, the server knows what a fresh one would, and it holds no more memory than before.
//!
//! `MAUVE_SOAK=100000 cargo test --release -p mauve --test main soak::` goes on for so many edits, and some thousand changes of the
//! disk; `MAUVE_SEED` is the seed that a failing run has printed. Such a run looks for fewer steps that fail too, and says
//! where their session is recorded.

mod disk;
mod torture;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mauve_tests::methods::{Asked, Location, Method, able_client, methods_of};
use mauve_tests::{
    Client, Columns, Random, Text, address, char_boundary, copy, generated_project, models, scratch, search,
    wait_for_watcher, write,
};
use serde_json::{Value, json};

use disk::Repository;

use crate::MAUVE;

/// So many edits of a full search, unless `MAUVE_SOAK` says otherwise.
const EDITS: u64 = 5000;
/// So often the memory is looked at, at least; and so often the server is compared with a fresh one.
const LOOKS: usize = 40;
const COMPARISONS: usize = 4;
/// A greater session is compared each time when it has gone so many steps.
const LONGEST_WAY: usize = 2000;
/// For so many steps, the client does mostly the same.
const PHASE: usize = 50;
/// The second half of a session may hold so much more memory at its end than at its beginning, in kB: what the allocator
/// keeps comes and goes by this much.
const MARGIN: f64 = 16.0 * 1024.0;
/// The server notices changes on the disk within this time.
const PATIENCE: Duration = Duration::from_secs(6);
/// Fewer steps that fail are looked for so long.
const SHRINKING: Duration = Duration::from_secs(180);
/// [`PATIENCE`] while fewer steps are looked for.
const PATIENCE_OF_SHRINKING: Duration = Duration::from_millis(350);

/// The pieces of text that are typed, at once or letter by letter.
const PIECES: [&str; 22] = [
    " ",
    "\n",
    "\r\n",
    "}",
    "{",
    ";",
    "0",
    "1",
    "= 5",
    "x",
    "// ",
    "\u{e9}\u{1f916}",
    "activity",
    "include \"control.mal\"",
    "include \"../p3dx/components/pose.mal\"\n",
    "codel f(): int",
    "\"",
    "/*",
    "\n  activity pose { priority = 3 period = 50 }\n",
    "\n  connection hokuyo.scan -> gmapping.scan\n",
    "  transition again if (true) to Planning { write(",
    "property control.max_speed = 0.",
];

/// The folders of the client, below one; two of them share files.
const FOLDERS: [&str; 3] = ["p3dx", "p3dx_entry", "project"];

/// The files that are edited, those that matter most first.
const FILES: [&str; 15] = [
    "p3dx/deployment.mal",
    "p3dx/timing/p3dx.toml",
    "p3dx/mauve.toml",
    "p3dx/exploration_architecture.mal",
    "p3dx/exploration.mal",
    "p3dx/components/navigation.mal",
    "p3dx/components/hokuyo.mal",
    "p3dx_entry/navigation.mal",
    "p3dx_entry/exploration.mal",
    "project/root.mal",
    "project/part1.mal",
    "project/part2.mal",
    "project/times.toml",
    LINK,
    UNTITLED,
];
/// A link to the first.
const LINK: &str = "p3dx/link.mal";
/// A text without a file.
const UNTITLED: &str = "untitled:Untitled-1";

/// Permitted errors: the text was changed, the client has cancelled, the question has no subject (another file, an
/// invalid name), the server has cancelled.
const LEGITIMATE: [i64; 5] = [-32801, -32800, -32602, -32803, -32802];

#[test]
fn a_client_that_is_told_what_is_wrong() {
    soak("told", &able_client(false, &["utf-16"]));
}

#[test]
fn a_client_that_asks_what_is_wrong() {
    soak("asks", &able_client(true, &["utf-8", "utf-16"]));
}

/// An open text.
#[derive(Debug, Clone)]
struct Open {
    text: Text,
    /// When it was changed last: of two addresses of one file, the later change counts.
    touched: usize,
    /// The edits that undo the last ones, the newest last.
    undo: Vec<(Range<usize>, String)>,
}

/// The state of the client and the disk: enough to start a fresh server.
#[derive(Debug, Clone)]
struct State {
    open: BTreeMap<usize, Open>,
    /// The number of changes of texts.
    clock: usize,
    /// In the order in which the server was told of them.
    folders: Vec<usize>,
    settings: Value,
    disk: BTreeMap<PathBuf, OnDisk>,
}

#[derive(Debug, Clone)]
enum OnDisk {
    Folder,
    File(Vec<u8>),
    Link(PathBuf),
}

/// How often a request was answered, and how.
#[derive(Debug, Default)]
struct Count {
    results: usize,
    nothing: usize,
    modified: usize,
    cancelled: usize,
    refused: usize,
}

struct Session {
    seed: u64,
    top: PathBuf,
    capabilities: Value,
    originals: Vec<String>,
    client: Client,
    methods: Vec<&'static Method>,
    columns: Columns,
    state: State,
    /// A git repository of the files, where git is installed.
    repository: Option<Repository>,
    /// The requests that are to be refused.
    tortures: HashSet<u64>,
    /// How many changes of texts the server was told of, and how often the disk was changed.
    edits: usize,
    disk_operations: usize,
    /// The requests that are not answered yet.
    asked: HashMap<u64, (&'static str, Location)>,
    /// The newest answers that other requests follow.
    answers: HashMap<&'static str, (Location, Value)>,
    counts: BTreeMap<&'static str, Count>,
    /// Within which time the server notices changes on the disk.
    patience: Duration,
    /// For so many steps more, nothing is read of what the server says.
    unread: usize,
}

fn soak(name: &str, capabilities: &Value) {
    let seed = 0x9e37_79b9 + search::seed();
    let edits: usize = search::cases("MAUVE_SOAK", EDITS);
    println!("seed {seed}, MAUVE_SOAK={edits}");
    let top = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("soak_{name}_{seed}_{}", std::process::id()));
    let mut session = Session::new(seed, &top, capabilities);
    let look = (edits / LOOKS).clamp(1, 500);
    let way = (edits / COMPARISONS).clamp(look, LONGEST_WAY);
    let begin = Instant::now();
    let mut memory = Vec::new();
    let mut checkpoint = session.state();
    let (mut since, mut last) = (0, 0);
    while session.edits < edits || since < last {
        let (first, is_end) = (last, session.edits >= edits);
        last += if is_end { 0 } else { look };
        let is_compared = is_end || last - since >= way;
        if let Err(fault) = session.run(first..last, is_compared) {
            // Shrinking takes minutes.
            let found = format!("seed {seed}, steps {since} to {last}: {fault}");
            println!("{found}");
            let shrunk = shrink(&mut session, &checkpoint, (since..last).collect(), &fault);
            panic!("{found}\n{shrunk}");
        }
        memory.extend(session.client.memory().map(|kilobytes| (last as f64, kilobytes as f64)));
        if is_compared {
            println!(
                "{last} steps, {} edits, {} changes of the disk, {:.0} s, as a fresh server: {}",
                session.edits,
                session.disk_operations,
                begin.elapsed().as_secs_f64(),
                described(&memory)
            );
            checkpoint = session.state();
            since = last;
        }
    }
    println!(
        "{:<40} {:>8} {:>8} {:>8} {:>9} {:>8}",
        "", "results", "nothing", "modified", "cancelled", "refused"
    );
    for (method, it) in &session.counts {
        println!(
            "{method:<40} {:>8} {:>8} {:>8} {:>9} {:>8}",
            it.results, it.nothing, it.modified, it.cancelled, it.refused
        );
    }
    assert_eq!(session.client.shut_down(), Some(0));
    std::fs::remove_dir_all(&top).unwrap();
    let _ = std::fs::remove_dir_all(top.with_extension("git"));
    let second_half: Vec<(f64, f64)> = memory.split_off(memory.len() / 2);
    let grown = slope(&second_half) * (last / 2) as f64;
    println!("memory over the second half: {:+.1} MB", grown / 1024.0);
    assert!(
        grown <= MARGIN,
        "the server's memory grows by {grown:.0} kB in {} steps: {second_half:?}",
        last / 2
    );
}

fn described(memory: &[(f64, f64)]) -> String {
    memory.last().map_or("no figure of memory here".to_owned(), |(_, kilobytes)| {
        format!("{:.1} MB", kilobytes / 1024.0)
    })
}

/// The rise of the line that lies best among points: that of the least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len().max(1) as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|it| it.0), mean(|it| it.1));
    let spread: f64 = points.iter().map(|it| (it.0 - x).powi(2)).sum();
    let together: f64 = points.iter().map(|it| (it.0 - x) * (it.1 - y)).sum();
    if spread > 0.0 { together / spread } else { 0.0 }
}

/// Removes steps while the remaining ones still fail; returns where the remaining session is recorded.
fn shrink(session: &mut Session, checkpoint: &State, mut steps: Vec<usize>, fault: &str) -> String {
    let begin = Instant::now();
    let top = session.top.clone();
    session.patience = PATIENCE_OF_SHRINKING;
    let mut fails = |steps: &[usize], mirror: Option<&Path>| {
        session.restart(checkpoint, mirror);
        session.run(steps.iter().copied(), true).err()
    };
    let mut found = fault.to_owned();
    if fails(&steps, None).is_none() {
        return format!("It did not happen again in steps {steps:?}.");
    }
    let mut part = steps.len().div_ceil(2);
    while begin.elapsed() < SHRINKING {
        let mut is_less = false;
        let mut at = 0;
        while at < steps.len() && begin.elapsed() < SHRINKING {
            let end = (at + part).min(steps.len());
            let rest: Vec<usize> = steps[..at].iter().chain(&steps[end..]).copied().collect();
            match fails(&rest, None) {
                Some(fault) => {
                    (steps, found, is_less) = (rest, fault, true);
                }
                None => at = end,
            }
        }
        if part == 1 && !is_less {
            break;
        }
        part = part.div_ceil(2);
    }
    let record = top.with_extension("session.jsonl");
    let _ = std::fs::remove_file(&record);
    let again = fails(&steps, Some(&record)).is_some();
    format!(
        "{} steps suffice, {steps:?}: {found}\nThe session is recorded in {} ({}); the files are in {}.",
        steps.len(),
        record.display(),
        if again { "it failed" } else { "this time it did not fail" },
        top.display()
    )
}

impl Session {
    fn new(seed: u64, top: &Path, capabilities: &Value) -> Session {
        for robot in ["p3dx", "p3dx_entry"] {
            copy(&models().join(robot), &top.join(robot));
        }
        write(&top.join("project"), &generated_project(4, 200));
        std::os::unix::fs::symlink(top.join(FILES[0]), top.join(LINK)).unwrap();
        let original = |file: &&str| match *file {
            UNTITLED => models().join("p3dx/components/kinematics.mal"),
            file => top.join(file),
        };
        let originals = FILES.iter().map(|file| std::fs::read_to_string(original(file)).unwrap()).collect();
        let repository = Repository::new(top, &mut Random(mixed(seed)));
        println!("git: {}", repository.is_some());
        let state = State {
            open: BTreeMap::new(),
            clock: 0,
            folders: vec![0, 1, 2],
            settings: Value::Null,
            disk: on_disk(top),
        };
        let (mut client, server) = begin(top, capabilities, &state, None);
        let (methods, missing) = methods_of(&mut client, &server);
        println!("not in the mix, since the server does not announce it: {missing:?}");
        let columns = match server["positionEncoding"].as_str() {
            Some("utf-8") => Columns::Utf8,
            Some("utf-32") => Columns::Utf32,
            _ => Columns::Utf16,
        };
        Session {
            seed,
            top: top.to_owned(),
            capabilities: capabilities.clone(),
            originals,
            client,
            methods,
            columns,
            state,
            repository,
            tortures: HashSet::new(),
            edits: 0,
            disk_operations: 0,
            asked: HashMap::new(),
            answers: HashMap::new(),
            counts: BTreeMap::new(),
            patience: PATIENCE,
            unread: 0,
        }
    }

    fn state(&self) -> State {
        State { disk: on_disk(&self.top), ..self.state.clone() }
    }

    /// Begins again where everything was like this.
    fn restart(&mut self, state: &State, mirror: Option<&Path>) {
        put_back(&self.top, &state.disk);
        self.state = state.clone();
        self.client = begin(&self.top, &self.capabilities, state, mirror).0;
        (self.unread, self.asked, self.answers) = (0, HashMap::new(), HashMap::new());
        self.tortures.clear();
    }

    /// Executes these steps, and waits for all answers; then compares the server with a fresh one. Returns the
    /// difference.
    fn run(&mut self, steps: impl IntoIterator<Item = usize>, is_compared: bool) -> Result<(), String> {
        let run = catch_unwind(AssertUnwindSafe(|| {
            let mut last = 0;
            for step in steps {
                self.step(step)?;
                last = step;
            }
            self.be_idle()?;
            if is_compared { self.compare(last) } else { Ok(()) }
        }));
        run.unwrap_or_else(|panic| {
            let text = panic.downcast_ref::<String>().cloned();
            Err(text.unwrap_or_else(|| "a panic of the client".to_owned()))
        })
    }

    /// Executes a step. Its number and the state determine it, so that it can be executed without the previous steps.
    fn step(&mut self, step: usize) -> Result<(), String> {
        let mut random = Random(mixed(self.seed ^ (step as u64) << 20));
        match (random.below(4), mixed(self.seed ^ (step / PHASE) as u64) % 5) {
            (0 | 1, _) | (_, 0) => self.mixed_step(&mut random)?,
            (2, _) => self.ask(&mut random),
            (_, 1) => self.edit(&mut random),
            (_, 2) => self.undo_all(&mut random),
            (_, 3) => self.storm(&mut random),
            _ => self.torture(&mut random),
        }
        if self.unread > 0 {
            self.unread -= 1;
            if self.unread == 0 {
                self.client.read_on();
            }
        }
        self.hear(Duration::ZERO)
    }

    /// A step of any kind, each as often as it happens.
    fn mixed_step(&mut self, random: &mut Random) -> Result<(), String> {
        match random.below(100) {
            0 => self.move_a_folder(random),
            1 => self.change_folders(random),
            2 => self.change_settings(random),
            3..=5 => self.change_disk(random),
            6..=7 => self.close(random),
            8..=10 => self.save(random),
            11..=12 => self.take_time(random)?,
            13..=44 => {
                for _ in 0..=random.below(4) {
                    self.ask(random);
                }
                // Half of them are answered before something changes.
                if random.below(2) == 0 && self.unread == 0 {
                    self.receive_answers()?;
                }
            }
            45..=49 => self.type_in(random)?,
            _ => self.edit(random),
        }
        Ok(())
    }

    /// Counts a change of a text.
    fn tick(&mut self) -> usize {
        self.state.clock += 1;
        self.state.clock
    }

    /// The text of a file, which is opened where it is not.
    fn opened(&mut self, file: usize, random: &mut Random) -> &mut Open {
        let touched = self.tick();
        if !self.state.open.contains_key(&file) {
            let disk = std::fs::read_to_string(self.top.join(FILES[file]));
            let text = if random.below(2) == 0 { disk.ok() } else { None };
            let text = text.unwrap_or_else(|| self.originals[file].clone());
            let mut text = self.client.open_at(&uri(&self.top, file), &text);
            text.columns = self.columns;
            self.state.open.insert(file, Open { text, touched, undo: Vec::new() });
        }
        self.state.open.get_mut(&file).unwrap()
    }

    /// Several changes in one message, a whole text, or some steps back.
    fn edit(&mut self, random: &mut Random) {
        let file = random.below(FILES.len());
        self.edit_file(random, file);
    }

    fn edit_file(&mut self, random: &mut Random, file: usize) {
        let kind = random.below(12);
        let original = self.originals[file].clone();
        let open = self.opened(file, random);
        let mut changes = Vec::new();
        match kind {
            // Repairs the text, so that the analysis has a result.
            0..=2 => {
                let all = 0..open.text.text.len();
                let mut change = open.replace(all, &original);
                if random.below(2) == 0 {
                    change.as_object_mut().unwrap().remove("range");
                }
                changes.push(change);
            }
            3 => {
                for _ in 0..=random.below(8) {
                    let Some((range, old)) = open.undo.pop() else { break };
                    changes.push(open.replace(range, &old));
                    open.undo.pop();
                }
            }
            4 => {
                for _ in 0..2 + random.below(4) {
                    let (range, piece) = random_edit(random, &open.text.text);
                    changes.push(open.replace(range, &piece));
                }
                if random.below(4) == 0 {
                    let text = format!("// \u{1f916}\r\n{original}");
                    let all = 0..open.text.text.len();
                    open.replace(all, &text);
                    changes.push(json!({"text": text}));
                }
            }
            _ => {
                let (range, piece) = random_edit(random, &open.text.text);
                let mut change = open.replace(range, &piece);
                // A column behind a line's end means that end.
                let end = &mut change["range"]["end"];
                if end["beyond"] == true {
                    end["character"] = json!(end["character"].as_u64().unwrap() + 1000);
                }
                changes.push(change);
            }
        }
        self.say_changes(file, &changes);
    }

    /// Takes the last edits back, each with a message of its own, and some of them again and again.
    fn undo_all(&mut self, random: &mut Random) {
        let file = random.below(FILES.len());
        self.opened(file, random);
        let mut undone = Vec::new();
        for _ in 0..random.below(50) {
            let Some(open) = self.state.open.get_mut(&file) else { return };
            let is_undone = random.below(3) > 0;
            let from = if is_undone { &mut open.undo } else { &mut undone };
            let Some((range, text)) = from.pop() else { continue };
            let change = open.replace(range, &text);
            if is_undone {
                undone.extend(open.undo.pop());
            }
            self.say_changes(file, &[change]);
            if random.below(8) == 0 {
                self.ask(random);
            }
        }
    }

    fn say_changes(&mut self, file: usize, changes: &[Value]) {
        let touched = self.tick();
        let Some(open) = self.state.open.get_mut(&file) else { return };
        open.touched = touched;
        open.text.version += 1;
        self.edits += 1;
        let document = json!({"uri": open.text.uri, "version": open.text.version});
        let params = json!({"textDocument": document, "contentChanges": changes});
        self.client.notify("textDocument/didChange", params);
    }

    /// Types something letter by letter, as a person with an editor does: each is asked about at once.
    fn type_in(&mut self, random: &mut Random) -> Result<(), String> {
        let file = random.below(FILES.len());
        let piece = *random.of(&PIECES);
        let open = self.opened(file, random);
        let mut at = boundary(&open.text.text, random.below(open.text.text.len() + 1));
        for letter in piece.replace('\r', "").chars() {
            let Some(open) = self.state.open.get_mut(&file) else { break };
            let change = open.replace(at..at, &letter.to_string());
            at += letter.len_utf8();
            let place = Location::of(&open.text, at..at, "x");
            self.say_changes(file, &[change]);
            let at_once = ["textDocument/completion", "textDocument/signatureHelp", "textDocument/inlayHint"];
            let methods: Vec<_> =
                self.methods.iter().filter(|it| at_once.contains(&it.name)).copied().collect();
            for method in methods {
                self.ask_at(method, place.clone(), random);
            }
            self.hear(Duration::from_millis(random.below(3) as u64))?;
        }
        Ok(())
    }

    /// Any request anywhere.
    fn ask(&mut self, random: &mut Random) {
        let method = *random.of(&self.methods);
        let place = self.place(random);
        self.ask_at(method, place, random);
    }

    fn ask_at(&mut self, method: &'static Method, place: Location, random: &mut Random) {
        let (method, place, params) = match method.asked {
            Asked::At(params) => (method, place.clone(), params(&place)),
            Asked::With(other, params) => match self.answers.get(other) {
                Some((place, answer)) => {
                    let all = params(place, answer);
                    match all.is_empty() {
                        true => return,
                        false => (method, place.clone(), random.of(&all).clone()),
                    }
                }
                // Then it is asked first.
                None => match Method::named(other) {
                    Some(other) => return self.ask_at(other, place, random),
                    None => return,
                },
            },
        };
        let id = self.client.request(method.name, params);
        self.asked.insert(id, (method.name, place));
        if random.below(5) == 0 {
            // Requests are cancelled at different moments of the work.
            std::thread::sleep(Duration::from_micros(random.below(10) as u64 * random.below(300) as u64));
            self.client.notify("$/cancelRequest", json!({"id": id}));
        }
    }

    /// A place: mostly in a word of an open text; now and then in another file, in none, or nowhere in it.
    fn place(&self, random: &mut Random) -> Location {
        let words = ["x", "navigation", "pose", "period", "nav", "", "1x", "int", "\u{e9}"];
        let word = *random.of(&words);
        let file = random.below(FILES.len());
        let text = match self.state.open.get(&file) {
            Some(open) => open.text.clone(),
            None => {
                let (uri, text) = (uri(&self.top, file), self.originals[file].clone());
                Text { uri, version: 0, text, columns: self.columns }
            }
        };
        let mut place = place_in(&text, random, word);
        match random.below(30) {
            0 => place.uri = "file:///no/such/file.mal".to_owned(),
            1 => place.position = json!({"line": u32::MAX, "character": u32::MAX}),
            2 => place.position["character"] = json!(u32::MAX),
            3 => place.range = json!({"start": place.range["end"], "end": place.range["start"]}),
            4 => {
                place.range =
                    json!({"start": place.range["start"], "end": {"line": 4_000_000, "character": 3}})
            }
            _ => {}
        }
        place
    }

    fn close(&mut self, random: &mut Random) {
        let file = random.below(FILES.len());
        if let Some(open) = self.state.open.remove(&file) {
            self.client.notify("textDocument/didClose", json!({"textDocument": {"uri": open.text.uri}}));
        }
    }

    fn save(&mut self, random: &mut Random) {
        let file = random.below(FILES.len());
        let Some(open) = self.state.open.get(&file).filter(|_| file < FILES.len() - 2) else { return };
        // Its folder may be away.
        let _ = std::fs::write(self.top.join(FILES[file]), &open.text.text);
        let params = json!({"textDocument": {"uri": open.text.uri}, "text": open.text.text});
        self.client.notify("textDocument/didSave", params);
        self.notice(&[(file, 2)], random);
    }

    fn change_folders(&mut self, random: &mut Random) {
        let folder = random.below(FOLDERS.len());
        let told = json!([{"uri": address(&self.top.join(FOLDERS[folder])), "name": FOLDERS[folder]}]);
        let folders = &mut self.state.folders;
        let event = match folders.iter().position(|it| *it == folder) {
            Some(at) => {
                folders.remove(at);
                json!({"added": [], "removed": told})
            }
            None => {
                folders.push(folder);
                json!({"added": told, "removed": []})
            }
        };
        self.client.notify("workspace/didChangeWorkspaceFolders", json!({"event": event}));
    }

    fn change_settings(&mut self, random: &mut Random) {
        let level = *random.of(&[1e-4, 1e-3, 1e-5]);
        self.state.settings = json!({"timing": {"significance": level}});
        self.client.settings = self.state.settings.clone();
        let settings = json!({"settings": {"mauve": self.state.settings}});
        self.client.notify("workspace/didChangeConfiguration", settings);
    }

    /// The client thinks, or does not read for a while.
    fn take_time(&mut self, random: &mut Random) -> Result<(), String> {
        match random.below(4) {
            0 => {
                self.client.stop_reading();
                // A server whose output is not read stops reading.
                self.unread = 1 + random.below(50);
                Ok(())
            }
            1 => self.hear(Duration::from_millis(1)),
            _ => self.hear(Duration::from_millis(5 + random.below(40) as u64)),
        }
    }

    /// Reads messages until none has arrived for this time; returns an error in them.
    fn hear(&mut self, quiet: Duration) -> Result<(), String> {
        for message in self.client.take(quiet) {
            if message.get("method").is_some() {
                let text = message.to_string();
                if text.contains("internal-error") || text.contains("defect of mauve") {
                    return Err(text);
                }
                continue;
            }
            if self.is_expected(&message) {
                continue;
            }
            let Some((method, place)) = message["id"].as_u64().and_then(|id| self.asked.remove(&id)) else {
                return Err(format!("an answer to nothing, or a second one: {message}"));
            };
            let count = self.counts.entry(method).or_default();
            match message.get("error") {
                None if message["result"].is_null() => count.nothing += 1,
                None => {
                    count.results += 1;
                    if self
                        .methods
                        .iter()
                        .any(|it| matches!(it.asked, Asked::With(other, _) if other == method))
                    {
                        self.answers.insert(method, (place, message["result"].clone()));
                    }
                }
                Some(error) => match error["code"].as_i64() {
                    Some(-32801) => count.modified += 1,
                    Some(-32800) => count.cancelled += 1,
                    Some(code) if LEGITIMATE.contains(&code) => count.refused += 1,
                    _ => return Err(format!("{method} at {place:?}: {error}")),
                },
            }
        }
        Ok(())
    }

    /// Waits until every request is answered.
    fn receive_answers(&mut self) -> Result<(), String> {
        while let Some(&id) = self.asked.keys().next() {
            if !self.client.receive_answer(id) {
                return Err(format!("never answered: {:?}", self.asked));
            }
            self.hear(Duration::ZERO)?;
        }
        Ok(())
    }

    /// Waits until every request is answered and the server has nothing left to do.
    fn be_idle(&mut self) -> Result<(), String> {
        self.client.read_on();
        self.unread = 0;
        self.receive_answers()?;
        self.client.idle();
        self.hear(Duration::ZERO)
    }

    /// Compares what the server says of everything with what a fresh one says that has seen nothing of what happened.
    fn compare(&mut self, step: usize) -> Result<(), String> {
        let mut random = Random(mixed(self.seed ^ step as u64));
        let (mut fresh, _) = begin(&self.top, &self.capabilities, &self.state, None);
        let mut questions = Vec::new();
        for open in self.state.open.values() {
            for round in 0..3 {
                let place = place_in(&open.text, &mut random, "new_name");
                let methods = self.methods.iter().copied();
                // The answers to some depend on the text alone.
                let methods = methods.filter(|it| round == 0 || is_of_place(it));
                questions.extend(methods.map(|method| (method, place.clone())));
            }
        }
        wait_for_watcher(self.patience, || {
            self.client.idle();
            fresh.idle();
            fresh.forget();
            difference(&mut self.client, &mut fresh, &questions).map_or(Ok(()), Err)
        })?;
        self.hear(Duration::ZERO)
    }
}

/// Returns the first answer or publication in which two servers differ.
fn difference(client: &mut Client, fresh: &mut Client, questions: &[(&Method, Location)]) -> Option<String> {
    let answers = |client: &mut Client| -> Vec<Value> {
        questions.iter().map(|(method, place)| answer(client, method, place)).collect()
    };
    let (expected, seen) = (answers(fresh), answers(client));
    let all = questions.iter().zip(seen.iter().zip(&expected));
    let found = all.into_iter().find_map(|((method, place), (seen, expected))| {
        let found = match method.name {
            "textDocument/inlayHint" => differing_hints(seen, expected),
            // The first hints of two servers are not the same ones where a figure is older.
            "inlayHint/resolve" => None,
            _ => differing(seen, expected),
        };
        found.map(|found| format!("{} at {place:?}{found}", method.name))
    });
    found
        .or_else(|| differing(&published(client), &published(fresh)).map(|found| format!("published{found}")))
}

/// Returns whether the answer depends on the position in the text.
fn is_of_place(method: &Method) -> bool {
    match method.asked {
        Asked::With(other, _) => Method::named(other).is_some_and(is_of_place),
        Asked::At(params) => {
            let at = |number: u32| {
                let position = json!({"line": number, "character": number});
                let range = json!({"start": position, "end": position});
                Location { uri: String::new(), position, range, word: String::new() }
            };
            params(&at(0)) != params(&at(1))
        }
    }
}

/// A server with what the client and the disk have.
fn begin(top: &Path, capabilities: &Value, state: &State, mirror: Option<&Path>) -> (Client, Value) {
    let mirror = mirror.map(|path| path.display().to_string());
    let arguments: Vec<&str> = mirror.iter().flat_map(|path| ["--mirror", path]).collect();
    let mut client = Client::start(MAUVE, &arguments);
    client.settings = state.settings.clone();
    let name =
        |folder: &usize| json!({"uri": address(&top.join(FOLDERS[*folder])), "name": FOLDERS[*folder]});
    let folders: Vec<Value> = state.folders.iter().map(name).collect();
    let params = json!({
        "processId": std::process::id(), "rootUri": null, "capabilities": capabilities, "workspaceFolders": folders,
        "initializationOptions": state.settings,
    });
    let result = client.call("initialize", params).unwrap();
    client.notify("initialized", json!({}));
    let mut texts: Vec<&Open> = state.open.values().collect();
    texts.sort_by_key(|open| open.touched);
    for Open { text, .. } in texts {
        let document =
            json!({"uri": text.uri, "languageId": "mauve", "version": text.version, "text": text.text});
        client.notify("textDocument/didOpen", json!({"textDocument": document}));
    }
    (client, result["capabilities"].clone())
}

/// The answer to a request, asked again while something changes, without what names a state of the server. Of a request
/// that follows another, the answers to the first few.
fn answer(client: &mut Client, method: &Method, place: &Location) -> Value {
    let mut ask = |name: &str, params: Value| {
        let end = Instant::now() + Duration::from_secs(60);
        loop {
            match client.call(name, params.clone()) {
                Ok(result) => return result,
                Err(error) if error["code"] == -32801 && Instant::now() < end => {}
                Err(error) => return json!({"error": error["code"], "message": error["message"]}),
            }
        }
    };
    let mut all = match method.asked {
        Asked::At(params) => ask(method.name, params(place)),
        Asked::With(other, params) => {
            let Some(Asked::At(before)) = Method::named(other).map(|it| it.asked) else { return Value::Null };
            let before = ask(other, before(place));
            params(place, &before).into_iter().take(2).map(|params| ask(method.name, params)).collect()
        }
    };
    forget_names(&mut all);
    all
}

/// All that is published, as [`answer`] has it.
fn published(client: &Client) -> Value {
    let mut all: Value = client.published().into_iter().collect::<serde_json::Map<_, _>>().into();
    forget_names(&mut all);
    all
}

/// Returns the first position where two answers differ, and the values there.
fn differing(seen: &Value, expected: &Value) -> Option<String> {
    let within =
        |name: String, seen, expected| differing(seen, expected).map(|found| format!("/{name}{found}"));
    match (seen, expected) {
        (Value::Array(seen), Value::Array(expected)) if seen.len() == expected.len() => {
            let mut both = seen.iter().zip(expected).enumerate();
            both.find_map(|(index, (seen, expected))| within(index.to_string(), seen, expected))
        }
        (Value::Object(seen), Value::Object(expected)) if seen.keys().eq(expected.keys()) => {
            seen.iter().find_map(|(name, seen)| within(name.clone(), seen, &expected[name]))
        }
        _ => (seen != expected).then(|| format!(": {seen}\na fresh server: {expected}")),
    }
}

/// [`differing`] for hints: a fresh server has no figures of earlier texts. On lines where this one shows them, the fresh one has
/// fewer figures or not all, and this one shows nothing else that the fresh one does not, but for the reason: where a syntax error
/// has taken an activity out of its deployment, a fresh server does not know that there was one.
fn differing_hints(seen: &Value, expected: &Value) -> Option<String> {
    let of_line = |hints: &Value, line: &Value| -> Vec<Value> {
        let all = hints.as_array().cloned().unwrap_or_default();
        all.into_iter().filter(|hint| hint["position"]["line"] == *line).collect()
    };
    let all: Vec<Value> =
        [seen, expected].into_iter().filter_map(Value::as_array).flatten().cloned().collect();
    all.iter().map(|hint| &hint["position"]["line"]).find_map(|line| {
        let (seen, expected) = (of_line(seen, line), of_line(expected, line));
        let has = |status: &str| expected.iter().any(|hint| hint["status"] == status);
        let lacks_some = expected.len() < seen.len() || has("unknown") || has("missed");
        let (older, current): (Vec<Value>, Vec<Value>) =
            seen.iter().cloned().partition(|hint| hint["status"] == "older");
        let is_of_lost =
            |hint: &Value| hint["status"] == "unknown" && ["? syntax error", "?"].contains(&end_of(hint));
        let is_known =
            |hint: &Value| expected.iter().any(|other| is_same_hint(hint, other)) || is_of_lost(hint);
        let are_known = current.iter().all(is_known);
        if !older.is_empty() && lacks_some && are_known {
            None
        } else {
            differing(&seen.into(), &expected.into())
        }
    })
}

/// The label of a hint. With an older figure beside it, the name of its subject stands before it.
fn end_of(hint: &Value) -> &str {
    hint["label"].as_str().and_then(|label| label.rsplit(": ").next()).unwrap_or_default()
}

/// Whether two hints say the same. With an older figure beside it, the label may be cut.
fn is_same_hint(one: &Value, other: &Value) -> bool {
    let [one_end, other_end] = [one, other].map(end_of);
    let is_same_label = match one_end.strip_suffix('…') {
        Some(beginning) => other_end.starts_with(beginning.trim_end()),
        None => one_end == other_end,
    };
    is_same_label && one["status"] == other["status"]
}

/// Takes out what names a state of the server, which another server names otherwise.
fn forget_names(answer: &mut Value) {
    match answer {
        Value::Array(all) => all.iter_mut().for_each(forget_names),
        Value::Object(fields) => {
            // What else the data of a hint has is for the server.
            let status = fields.get("data").and_then(|data| data.get("status")).cloned();
            fields.retain(|name, value| name != "resultId" && (name != "data" || is_numbers(value)));
            fields.extend(status.map(|status| ("status".to_owned(), status)));
            fields.values_mut().for_each(forget_names);
        }
        _ => {}
    }
}

/// The tokens of a text are called `data` too.
fn is_numbers(value: &Value) -> bool {
    value.as_array().is_some_and(|all| all.iter().all(Value::is_number))
}

impl Open {
    /// Replaces a range of the text; returns the change for the server, and whether the line still ends at the same
    /// position.
    fn replace(&mut self, range: Range<usize>, new: &str) -> Value {
        let (start, mut end) = (self.text.position(range.start), self.text.position(range.end));
        let rest = &self.text.text[range.end..];
        if range.start != range.end && (rest.starts_with('\n') || rest.starts_with("\r\n")) {
            end["beyond"] = json!(true);
        }
        let old = self.text.text[range.clone()].to_owned();
        self.text.text.replace_range(range.clone(), new);
        self.undo.push((range.start..range.start + new.len(), old));
        if self.undo.len() > 50 {
            self.undo.remove(0);
        }
        json!({"range": {"start": start, "end": end}, "text": new})
    }
}

/// A place in a text: mostly in a word.
fn place_in(text: &Text, random: &mut Random, word: &str) -> Location {
    let mut start = boundary(&text.text, random.below(text.text.len() + 1));
    if random.below(8) == 0 {
        // Behind what begins the arguments of a call.
        start += text.text[start..].find('(').map_or(0, |at| at + 1);
    } else if random.below(4) > 0 {
        let is_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        start += text.text[start..].find(is_word).unwrap_or(0);
    }
    let end = boundary(&text.text, (start + random.below(60)).min(text.text.len())).max(start);
    Location::of(text, start..end, word)
}

/// The next place before an offset, or there, that is neither in a character nor in a line's end.
fn boundary(text: &str, offset: usize) -> usize {
    let offset = char_boundary(text, offset);
    let is_line_end = text[..offset].ends_with('\r') && text[offset..].starts_with('\n');
    if is_line_end { offset - 1 } else { offset }
}

/// Something is put in, taken out, or a digit becomes another.
fn random_edit(random: &mut Random, text: &str) -> (Range<usize>, String) {
    let start = boundary(text, random.below(text.len() + 1));
    let digits: Vec<usize> = text.match_indices(|it: char| it.is_ascii_digit()).map(|(at, _)| at).collect();
    match random.below(5) {
        0 => (start..start, (*random.of(&PIECES)).to_owned()),
        1 => {
            let end = boundary(text, (start + random.below(12)).min(text.len())).max(start);
            (start..end, String::new())
        }
        _ if digits.is_empty() => (start..start, "1".to_owned()),
        _ => {
            let at = *random.of(&digits);
            (at..at + 1, random.below(10).to_string())
        }
    }
}

fn damaged(random: &mut Random, text: &str) -> String {
    let mut text = text.to_owned();
    let (range, piece) = random_edit(random, &text);
    text.replace_range(range, &piece);
    text
}

/// Numbers that are near give others that are not (the finaliser of SplitMix64); never 0.
fn mixed(number: u64) -> u64 {
    let number = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (number ^ (number >> 31)).max(1)
}

fn uri(top: &Path, file: usize) -> String {
    if FILES[file] == UNTITLED { UNTITLED.to_owned() } else { address(&top.join(FILES[file])) }
}

/// Everything below a folder.
fn on_disk(top: &Path) -> BTreeMap<PathBuf, OnDisk> {
    let mut found = BTreeMap::new();
    let mut folders = vec![top.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let kind = path.symlink_metadata().unwrap().file_type();
            let entry = if kind.is_symlink() {
                OnDisk::Link(std::fs::read_link(&path).unwrap())
            } else if kind.is_dir() {
                folders.push(path.clone());
                OnDisk::Folder
            } else {
                OnDisk::File(std::fs::read(&path).unwrap())
            };
            found.insert(path, entry);
        }
    }
    found
}

/// Makes a folder as it was.
fn put_back(top: &Path, disk: &BTreeMap<PathBuf, OnDisk>) {
    let _ = std::fs::remove_dir_all(top);
    std::fs::create_dir_all(top).unwrap();
    // A folder precedes its contents.
    for (path, entry) in disk {
        match entry {
            OnDisk::Folder => std::fs::create_dir(path).unwrap(),
            OnDisk::File(bytes) => std::fs::write(path, bytes).unwrap(),
            OnDisk::Link(target) => std::os::unix::fs::symlink(target, path).unwrap(),
        }
    }
}
