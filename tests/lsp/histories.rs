//! Random histories of what happens on the disk and in an editor: files that are written, removed and renamed, texts that are
//! opened, changed, saved and closed, and messages about them that mean nothing. Afterwards the server knows what a fresh one
//! does that is told the last texts: the state is a function of these, whatever came before.
//!
//! `MAUVE_HISTORIES=3000 cargo test --release -p mauve --test main histories` tries more; `MAUVE_SEED` is the first seed.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use mauve_tests::{Client, Random, Text, address, scratch, search, wait_for_watcher, write};
use serde_json::{Value, json};

use super::{MAUVE, is_unknown};

/// So many histories, and so many steps in each at most.
const HISTORIES: u64 = 300;
const STEPS: usize = 12;

/// What is seen is compared again until it is the same, or for so long.
const PATIENCE: Duration = Duration::from_secs(10);

const ROBOT: &str = "include \"sub/parts.mal\"
architecture A { instance pilot: parts.Pilot  instance eye: parts.Eye }
deployment D { architecture A
  activity pilot { affinity = 1 priority = 1 period = 100 }
  activity eye { affinity = 1 priority = 2 period = 50 deadline = 20 }
}
";

const PARTS: &str = "library parts {
  codel plan(): int
  codel see(in x: int): int
  shell S { }
  core P(S) { update = { plan(); } }
  core E(S) { var x: int = 0  update = { x = see(plan()); } }
  component Pilot(S, P)
  component Eye(S, E)
}
";

const ALONE: &str = "codel f(): int
shell S { }
core C(S) { update = { f(); } }
component K(S, C)
architecture B { instance k: K }
deployment Alone { architecture B  activity k { priority = 1 period = 10 } }
";

/// What may stand in each file; the first is there in the beginning, where it is anything.
const FILES: [(&str, &[&str]); 7] = [
    (
        "robot.mal",
        &[
            ROBOT,
            "include \"sub/alone.mal\"\n",
            "include \"other/parts.mal\"\ncodel x(",
            "include \"sub/parts.mal\"\n",
        ],
    ),
    (
        "sub/parts.mal",
        &[PARTS, "library parts { codel plan(): int }\n", "include \"alone.mal\"\nlibrary parts { core"],
    ),
    (
        "sub/alone.mal",
        &[ALONE, "include \"parts.mal\"\n", "codel f(): int\ndeployment Alone { architecture Missing }\n"],
    ),
    (
        "times.toml",
        &[
            "[codel]\n\"parts.plan\" = 5\n\"parts.see\" = 7\nf = 2\n",
            "[codel]\nf = [1]\n",
            "[codel]\n\"parts.plan\" = 50\n",
        ],
    ),
    (
        "mauve.toml",
        &[
            "",
            "timing.tables = [\"*.toml\"]\n",
            "project.root = \"robot.mal\"\ntiming.tables = [\"times.toml\"]\n[assume]\ncodel = \"1 ms\"\n",
            "[timing\n",
        ],
    ),
    ("sub/mauve.toml", &["", "assume.codel = \"3 ms\"\n"]),
    ("other/parts.mal", &["", PARTS]),
];

/// What the editor and the disk do.
struct History {
    top: PathBuf,
    client: Client,
    open: BTreeMap<usize, Text>,
    /// The steps, for the message of a failure.
    said: String,
}

impl History {
    fn begin(name: &str) -> History {
        let top = scratch(env!("CARGO_TARGET_TMPDIR"), name);
        for (path, texts) in FILES.iter().filter(|(_, texts)| !texts[0].is_empty()) {
            write(&top, &[(*path, texts[0])]);
        }
        fs::create_dir_all(top.join("other")).unwrap();
        let client = Client::of_folder(MAUVE, &top);
        History { top, client, open: BTreeMap::new(), said: String::new() }
    }

    fn path(&self, file: usize) -> PathBuf {
        self.top.join(FILES[file].0)
    }

    fn step(&mut self, random: &mut Random) {
        let file = random.below(FILES.len());
        let (name, texts) = FILES[file];
        let (path, text) = (self.path(file), texts[random.below(texts.len())]);
        let uri = address(&path);
        let kind = random.below(12);
        let _ = writeln!(self.said, "{kind} {name} {:?}", &text[..text.len().min(30)]);
        match (kind, self.open.remove(&file)) {
            (0 | 1, open) => {
                write(&self.top, &[(name, text)]);
                self.open.extend(open.map(|open| (file, open)));
            }
            (2, open) => {
                let _ = fs::remove_file(&path);
                self.open.extend(open.map(|open| (file, open)));
            }
            (3, open) => {
                // What no workspace has comes and goes beside it.
                let stray = path.with_file_name("stray.txt");
                fs::write(&stray, "x").unwrap();
                fs::remove_file(stray).unwrap();
                self.open.extend(open.map(|open| (file, open)));
            }
            (4, open) => {
                let other = path.with_file_name("renamed");
                let _ = fs::rename(&path, &other);
                // The server notices the new name, the old one, or both.
                std::thread::sleep(Duration::from_millis(random.below(15) as u64));
                let _ = fs::rename(other, &path);
                self.open.extend(open.map(|open| (file, open)));
            }
            (5, None) => self.bad_open(&uri, text, random),
            (6, None) => {
                let change = json!({"range": {"start": {"line": 0, "character": 0}, "end": {"line": 0, "character": 0}}, "text": " "});
                let params = json!({"textDocument": {"uri": uri, "version": 3}, "contentChanges": [change]});
                self.client.notify("textDocument/didChange", params);
                self.client.notify("textDocument/didClose", json!({"textDocument": {"uri": uri}}));
            }
            (_, None) => {
                let text = self.client.open(&path, text);
                self.open.insert(file, text);
            }
            (5 | 6, Some(_)) => {
                self.client.notify("textDocument/didClose", json!({"textDocument": {"uri": uri}}));
            }
            (7, Some(open)) => {
                // The editor saves.
                write(&self.top, &[(name, open.text.as_str())]);
                let params = json!({"textDocument": {"uri": uri}, "text": open.text});
                self.client.notify("textDocument/didSave", params);
                self.open.insert(file, open);
            }
            (8, Some(mut open)) => {
                // A change that means nothing, and the whole text.
                let bad = json!({"textDocument": {"uri": uri, "version": "x"}, "contentChanges": [{"text": "lost"}]});
                self.client.notify("textDocument/didChange", bad);
                open.version += 1;
                let change = json!({"textDocument": {"uri": uri, "version": open.version}, "contentChanges": [{"text": open.text}]});
                self.client.notify("textDocument/didChange", change);
                self.open.insert(file, open);
            }
            (_, Some(mut open)) => {
                let end = open.text.len();
                self.client.replace(&mut open, 0..end, text);
                self.open.insert(file, open);
            }
        }
        if random.below(3) == 0 {
            // Steps meet the server at different moments of its work.
            std::thread::sleep(Duration::from_millis(random.below(30) as u64));
        }
    }

    /// The text is unknown, and closed.
    fn bad_open(&mut self, uri: &str, text: &str, random: &mut Random) {
        let document = match random.below(4) {
            0 => json!({"uri": uri, "version": 1, "text": text}),
            1 => json!({"uri": uri, "languageId": "mauve", "version": "1", "text": text}),
            2 => json!({"uri": uri, "languageId": "mauve", "version": 1_u64 << 40, "text": text}),
            _ => json!({"uri": uri, "languageId": "mauve", "version": 1}),
        };
        self.client.notify("textDocument/didOpen", json!({"textDocument": document}));
        self.client.notify("textDocument/didClose", json!({"textDocument": {"uri": uri}}));
    }
}

/// What a client sees: diagnostics, hints, response times.
fn seen(client: &mut Client, top: &Path, open: &BTreeMap<usize, Text>) -> Value {
    client.idle();
    let mut hints = BTreeMap::new();
    for text in open.values() {
        // Older figures depend on the history, and may stand in place of reasons and of figures that include less.
        let is_lasting =
            |label: &str| !is_unknown(label) && !label.contains("not analysed") && !label.contains('≥');
        let all = client.hints(&text.uri).into_iter();
        hints.insert(text.uri.clone(), all.filter(|(_, label)| is_lasting(label)).collect::<Vec<_>>());
    }
    let mut figures = BTreeMap::new();
    for (path, _) in FILES.iter().filter(|(path, _)| path.ends_with(".mal")) {
        let uri = address(&top.join(path));
        let answer = client.call("mauve/analysis", json!({"textDocument": {"uri": uri}}));
        figures.insert(uri, answer.unwrap_or_else(|error| error["code"].clone()));
    }
    let published: BTreeMap<String, Value> = client.published().into_iter().collect();
    json!({"hints": hints, "figures": figures, "published": published})
}

fn run(seed: u64) {
    let mut random = Random((seed + 1).wrapping_mul(0xd134_2543_de82_ef95) | 1);
    let mut history = History::begin(&format!("histories_{seed}"));
    for _ in 0..1 + random.below(STEPS) {
        history.step(&mut random);
    }
    let History { top, mut client, open, said } = history;
    let mut fresh = Client::of_folder(MAUVE, &top);
    for (&file, text) in &open {
        fresh.open(&top.join(FILES[file].0), &text.text);
    }
    let expected = seen(&mut fresh, &top, &open);
    let found = wait_for_watcher(PATIENCE, || {
        let found = seen(&mut client, &top, &open);
        if found == expected { Ok(()) } else { Err(found) }
    });
    found.unwrap_or_else(|found| {
        panic!(
            "seed {seed}:\n{said}open: {:?}\nseen: {found:#}\na fresh server: {expected:#}",
            open.keys().map(|file| FILES[*file].0).collect::<Vec<_>>()
        )
    });
    drop((client, fresh));
    fs::remove_dir_all(top).unwrap();
}

/// One of the threads that share the histories.
fn share(of: u64, number: u64) {
    search::seeds("MAUVE_HISTORIES", HISTORIES).filter(|seed| seed % of == number).for_each(run);
}

#[test]
fn a_history_ends_like_a_fresh_server() {
    share(3, 0);
}

#[test]
fn the_second_third_of_histories_ends_like_a_fresh_server() {
    share(3, 1);
}

#[test]
fn the_last_third_of_histories_ends_like_a_fresh_server() {
    share(3, 2);
}
