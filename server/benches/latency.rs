//! Over the real binary: how long each request of the protocol takes, on the sample robot and in a project of 200 files, in
//! peace and right after a keystroke; how long until a session has its first diagnostics, and until a burst of typing has its
//! last; how soon what an edit or the client has made pointless ends; and the memory.
//!
//! `cargo bench -p mauve --bench latency`; behind `--`, words that the rows to be measured have in them, such as `hover`.
//!
//! This is no test: it prints times, and beside them what they are to be. On a machine that is busy they are greater.

#![allow(clippy::panic)]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mauve_tests::methods::{Asked, Location, METHODS, Method, able_client, methods_of};
use mauve_tests::{
    Client, Random, Text, Times, copy, generated_project, is_answer, long_analysis, models, whole_text, write,
};
use serde_json::{Value, json};

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");

/// So often each request is asked.
const SAMPLES: usize = 200;

/// What the 95th percentile of a request is to be, in ms.
const TARGETS: [(&str, f64); 3] =
    [("textDocument/completion", 10.0), ("textDocument/hover", 5.0), ("textDocument/definition", 5.0)];

/// So much a model of two megabytes has.
const LINES_OF_TWO_MEGABYTES: usize = 50_000;

fn main() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("latency");
    let _ = std::fs::remove_dir_all(&folder);
    let (robot, project, large, long) =
        (folder.join("robot"), folder.join("project"), folder.join("large"), folder.join("long"));
    copy(&models().join("p3dx"), &robot);
    write(&project, &generated_project(200, 10_000));
    write(&long, &long_analysis(200));
    println!("{}", Times::HEAD);
    start(&robot, "sample robot", "deployment.mal", 30, f64::NAN);
    start(&project, "200 files, 10,000 lines", "root.mal", 30, f64::NAN);
    if is_wanted("2 MB") {
        write(&large, &generated_project(200, LINES_OF_TWO_MEGABYTES));
        let bytes: u64 =
            std::fs::read_dir(&large).into_iter().flatten().flatten().map(|it| length(&it)).sum();
        start(&large, &format!("2 MB ({:.2} MB)", bytes as f64 / 1e6), "root.mal", 10, 500.0);
    }
    bursts(&robot, "sample robot", "deployment.mal", "period = 1000", 5.0);
    bursts(&project, "200 files, 10,000 lines", "part7.mal", "entry = { next = ", 10.0);
    stale(&long);
    let missing = requests(&robot, "sample robot");
    requests(&project, "200 files, 10,000 lines");
    if !missing.is_empty() {
        println!("not measured, since the server does not announce it: {}", missing.join(", "));
    }
}

fn length(entry: &std::fs::DirEntry) -> u64 {
    entry.metadata().map_or(0, |data| data.len())
}

/// Is something of this name asked for?
fn is_wanted(name: &str) -> bool {
    let mut only = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).peekable();
    only.peek().is_none() || only.any(|only| name.contains(&only))
}

fn begin(folder: &Path) -> (Client, Value) {
    let mut client = Client::start(MAUVE, &[]);
    let server = client.initialize(Some(folder), &able_client(false, &["utf-16"]));
    (client, server["capabilities"].clone())
}

fn memory(client: &Client, what: &str) {
    if let Some(kilobytes) = client.memory() {
        let megabytes = kilobytes as f64 / 1024.0;
        let is_met = if megabytes <= 150.0 { "" } else { "  MISSED" };
        println!("{:<64} {megabytes:>9.1} MB   ≤ 150 MB{is_met}", format!("{what}: resident"));
    }
}

/// From the start of the process to the answer to `initialize`, and from there to the diagnostics of a text that is opened.
fn start(folder: &Path, what: &str, deployment: &str, rounds: usize, target: f64) {
    let names = ["start to initialize", "initialize to diagnostics"].map(|name| format!("{what}: {name}"));
    if !names.iter().any(|name| is_wanted(name)) {
        return;
    }
    let (mut initialized, mut checked) = (Times::default(), Times::default());
    for round in 0..rounds {
        let start = Instant::now();
        let (mut client, _) = begin(folder);
        initialized.add(start.elapsed());
        let start = Instant::now();
        let text = client.open_file(&folder.join(deployment));
        checked.add(client.wait_for_diagnostics(&text) - start);
        if round + 1 == rounds {
            memory(&client, what);
        }
    }
    println!("{}", initialized.row_with_target(&names[0], 50.0));
    match target.is_nan() {
        true => println!("{}", checked.row(&names[1])),
        false => println!("{}", checked.row_with_target(&names[1], target)),
    }
}

/// Fifty keystrokes as a quick typist makes them, and all at once: from the last one to the diagnostics of its version.
fn bursts(folder: &Path, what: &str, file: &str, behind: &str, target: f64) {
    for distance in [20, 0] {
        let name = format!("{what}: 50 keystrokes, {distance} ms apart, to diagnostics");
        if !is_wanted(&name) {
            continue;
        }
        let mut client = begin(folder).0;
        let mut text = client.open_file(&folder.join(file));
        client.wait_for_diagnostics(&text);
        let Some(at) = text.text.find(behind).map(|at| at + behind.len()) else { panic!("no {behind}") };
        let mut times = Times::default();
        for round in 0..if distance == 0 { 100 } else { 20 } {
            let mut last = Instant::now();
            for stroke in 0..50 {
                std::thread::sleep(Duration::from_millis(distance));
                last = Instant::now();
                // A digit more, and away with it; in the end another one is there than the time before.
                match stroke % 2 {
                    0 => client.replace(&mut text, at..at, "1"),
                    _ if stroke < 49 => client.replace(&mut text, at..at + 1, ""),
                    _ => client.replace(&mut text, at..at + 2, &(round % 9 + 1).to_string()),
                }
            }
            times.add(client.wait_for_diagnostics(&text) - last);
            client.settle(Duration::from_millis(20));
            client.forget();
        }
        println!("{}", times.row_with_target(&name, target));
    }
}

/// How long after an edit, or when the client does not want it any more, a request is answered that takes long: the hints of
/// a deployment whose analysis does. None is counted that was done by itself.
fn stale(folder: &Path) {
    let names = [("an edit", -32801), ("$/cancelRequest", -32800)];
    for (by, code) in names.map(|(by, code)| (format!("a long request: {by} to its end"), code)) {
        if !is_wanted(&by) {
            continue;
        }
        let mut client = begin(folder).0;
        let mut text = client.open_file(&folder.join("a.mal"));
        let mut times = Times::default();
        for round in 0..100 {
            let id = client.request("textDocument/inlayHint", whole_text(&text.uri));
            std::thread::sleep(Duration::from_millis(15));
            let start = Instant::now();
            let (from, to) = if round % 2 == 0 {
                ("priority = 99", "priority = 98")
            } else {
                ("priority = 98", "priority = 99")
            };
            match code {
                -32801 => client.edit(&mut text, from, to),
                _ => client.notify("$/cancelRequest", json!({"id": id})),
            }
            let (at, answer) = client.wait("an answer", |it| is_answer(it, id));
            if answer["error"]["code"] == code {
                times.add(at - start);
            }
            if code == -32800 {
                // Another text, so that the next one begins anew.
                client.edit(&mut text, from, to);
            }
            client.forget();
        }
        println!("{}", times.row_with_target(&by, 10.0));
    }
}

/// Every request at random words of many open texts. Gives those that the server does not answer.
fn requests(folder: &Path, what: &str) -> Vec<&'static str> {
    let (mut client, server) = begin(folder);
    let (methods, missing) = methods_of(&mut client, &server);
    let wanted: Vec<&Method> =
        methods.into_iter().filter(|method| is_wanted(&format!("{what}: {}", method.name))).collect();
    if wanted.is_empty() {
        return missing.into_iter().filter(|name| is_wanted(name)).collect();
    }
    let mut random = Random(0x9e37_79b9);
    let mut texts: Vec<Text> =
        models_of(folder).iter().step_by(10).map(|path| client.open_file(path)).collect();
    for text in &texts {
        client.wait_for_diagnostics(text);
    }
    for method in wanted {
        for is_edited in [false, true] {
            let mut times = Times::default();
            let mut answered = 0;
            for round in 0..SAMPLES {
                let index = random.below(texts.len());
                let Some((place, digit)) = place(&texts[index], &mut random) else { continue };
                let params = match method.asked {
                    Asked::At(params) => params(&place),
                    Asked::With(other, params) => match before(&mut client, other, &place) {
                        Some(answer) => {
                            let all = params(&place, &answer);
                            if all.is_empty() {
                                continue;
                            }
                            random.of(&all).clone()
                        }
                        None => continue,
                    },
                };
                if is_edited {
                    let new = (round % 9 + 1).to_string();
                    client.replace(&mut texts[index], digit..digit + 1, &new);
                }
                let start = Instant::now();
                let id = client.request(method.name, params);
                let (at, answer) = client.wait("an answer", |it| is_answer(it, id));
                times.add(at - start);
                answered += usize::from(is_something(&answer["result"]));
                if is_edited {
                    client.wait_for_diagnostics(&texts[index]);
                }
                client.forget();
            }
            let when = if is_edited { ", after an edit" } else { "" };
            let name = format!("{what}: {}{when}", method.name);
            let row = match TARGETS.iter().find(|(name, _)| *name == method.name) {
                Some((_, target)) => times.row_with_target(&name, *target),
                None => times.row(&name),
            };
            println!("{row}   {answered} with a result");
        }
    }
    memory(&client, &format!("{what}, after all requests"));
    missing
}

/// The answer that another request rests on.
fn before(client: &mut Client, name: &str, place: &Location) -> Option<Value> {
    let method = METHODS.iter().find(|method| method.name == name)?;
    let Asked::At(params) = method.asked else { return None };
    client.call(name, params(place)).ok()
}

fn is_something(result: &Value) -> bool {
    match result {
        Value::Null => false,
        Value::Array(all) => !all.is_empty(),
        _ => true,
    }
}

/// The models below a folder, in their order.
fn models_of(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|it| it == "mal") {
                found.push(path);
            }
        }
    }
    // The deployment is the one to be edited.
    found
        .sort_by_key(|path| (!path.ends_with("deployment.mal") && !path.ends_with("root.mal"), path.clone()));
    found
}

/// A random word of a text, and a digit of a number that can be another one.
fn place(text: &Text, random: &mut Random) -> Option<(Location, usize)> {
    let is_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let words: Vec<usize> = text
        .text
        .match_indices(is_word)
        .map(|(at, _)| at)
        .filter(|at| !text.text[..*at].ends_with(is_word))
        // Nobody asks about a comment.
        .filter(|at| !text.text[..*at].rsplit('\n').next().is_some_and(|line| line.contains("//")))
        .collect();
    let digits: Vec<usize> = text
        .text
        .match_indices(|it: char| it.is_ascii_digit())
        .map(|(at, _)| at)
        .filter(|at| text.text[..*at].ends_with("= "))
        .collect();
    let start = *words.get(random.below(words.len()))?;
    let length = text.text[start..].find(|it| !is_word(it)).unwrap_or(0);
    let digit = digits.get(random.below(digits.len())).copied().unwrap_or(start);
    Some((Location::of(text, start..start + length, "another_name"), digit))
}
