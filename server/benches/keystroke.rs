//! Over the real binary: from a keystroke to published diagnostics and fresh hints, and how soon an edit ends what it has
//! made pointless. `cargo bench -p mauve --bench keystroke`
//!
//! This is no test: it prints times, median and 95th percentile.

#![allow(clippy::panic)]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mauve_tests::{Client, Text, copy, generated_project, is_answer, long_analysis, models, write};
use serde_json::json;

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");
const ROUNDS: usize = 300;

fn main() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("keystroke");
    let _ = std::fs::remove_dir_all(&folder);
    let (robot, project, one, long) =
        (folder.join("robot"), folder.join("project"), folder.join("one"), folder.join("long"));
    copy(&models().join("p3dx"), &robot);
    write(&project, &generated_project(200, 10_000));
    println!("{:<58} {:>9} {:>9} {:>9}", "in ms", "median", "p95", "greatest");

    start(&robot, "sample robot");
    start(&project, "200 files, 10,000 lines");
    keystrokes(&robot, "deployment.mal", "sample robot, period", ["period = 1000", "period = 2000"]);
    keystrokes(&robot, "components/navigation.mal", "sample robot, comment in a component", ["//", "// so:"]);
    keystrokes(&project, "root.mal", "200 files, period", ["period = 20 ", "period = 30 "]);
    keystrokes(&project, "part7.mal", "200 files, program of one", ["next = 0;", "next = sense(1);"]);
    keystrokes(&project, "part7.mal", "200 files, comment in one", ["// Part", "// The part"]);
    for lines in [1_000, 10_000] {
        let _ = std::fs::remove_dir_all(&one);
        write(&one, &generated_project(2, lines));
        let what = format!("a file of {lines} lines, program");
        keystrokes(&one, "part0.mal", &what, ["next = 0;", "next = sense(1);"]);
    }
    requests(&robot, "deployment.mal", "sample robot", "activity navigation");
    requests(&project, "root.mal", "200 files", "activity i150");
    write(&long, &long_analysis(200));
    overtaken(&long);
    memory(&project);
}

fn report(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let at = |share: f64| {
        let index = ((times.len() as f64 - 1.0) * share).round() as usize;
        times.get(index).map_or(f64::NAN, |time| time.as_secs_f64() * 1e3)
    };
    println!("{what:<58} {:>9.2} {:>9.2} {:>9.2}", at(0.5), at(0.95), at(1.0));
}

/// From the start of the process to the answer to `initialize`, and to the first diagnostics.
fn start(folder: &Path, what: &str) {
    let (mut initialized, mut checked) = (Vec::new(), Vec::new());
    let deployment = if what.starts_with("sample") { "deployment.mal" } else { "root.mal" };
    for _ in 0..20 {
        let begin = Instant::now();
        let mut client = Client::of_folder(MAUVE, folder);
        initialized.push(begin.elapsed());
        let text = client.open_file(&folder.join(deployment));
        client.diagnostics(&text);
        checked.push(begin.elapsed());
    }
    report(&format!("{what}: process to initialize"), initialized);
    report(&format!("{what}: process to diagnostics"), checked);
}

/// Replaces one text by the other, to and fro, and waits each time for the diagnostics and for the hints.
fn keystrokes(folder: &Path, file: &str, what: &str, texts: [&str; 2]) {
    // `cargo bench … -- 'file of 10000'` measures that alone.
    if std::env::args().skip(1).any(|only| !only.starts_with('-') && !what.contains(&only)) {
        return;
    }
    let mut client = Client::of_folder(MAUVE, folder);
    let deployment = if folder.join("deployment.mal").exists() { "deployment.mal" } else { "root.mal" };
    let deployment = client.open_file(&folder.join(deployment));
    client.diagnostics(&deployment);
    let mut text = if deployment.uri.ends_with(file) {
        deployment.clone()
    } else {
        client.open_file(&folder.join(file))
    };
    client.hints(&deployment.uri);
    let Some(at) = text.text.find(texts[0]) else { panic!("no {} in {file}", texts[0]) };
    let (mut published, mut hinted) = (Vec::new(), Vec::new());
    for round in 0..ROUNDS {
        let (old, new) = (texts[round % 2], texts[(round + 1) % 2]);
        let begin = Instant::now();
        client.replace(&mut text, at..at + old.len(), new);
        let (published_at, _) = wait_for(&mut client, &text);
        published.push(published_at - begin);
        client.hints(&deployment.uri);
        hinted.push(begin.elapsed());
        client.forget();
    }
    report(&format!("{what}: to diagnostics"), published);
    report(&format!("{what}: to diagnostics and hints"), hinted);
}

fn wait_for(client: &mut Client, text: &Text) -> (Instant, serde_json::Value) {
    client.wait("diagnostics", |it| {
        mauve_tests::is_publication(it, &text.uri) && it["params"]["version"] == text.version
    })
}

fn requests(folder: &Path, file: &str, what: &str, place: &str) {
    let mut client = Client::of_folder(MAUVE, folder);
    let text = client.open_file(&folder.join(file));
    client.diagnostics(&text);
    let mut at = text.at(place);
    if let Some(column) = at["position"]["character"].as_u64() {
        at["position"]["character"] = json!(column + "activity n".len() as u64);
    }
    for method in ["textDocument/hover", "textDocument/definition", "textDocument/documentSymbol"] {
        let mut times = Vec::new();
        for _ in 0..ROUNDS {
            let begin = Instant::now();
            let _ = client.call(method, at.clone());
            times.push(begin.elapsed());
        }
        report(&format!("{what}: {method}"), times);
    }
}

/// How long after an edit a request is answered whose analysis it has ended.
fn overtaken(folder: &Path) {
    let mut times = Vec::new();
    let mut client = Client::of_folder(MAUVE, folder);
    let mut text = client.open_file(&folder.join("a.mal"));
    let all = json!({"start": {"line": 0, "character": 0}, "end": {"line": 9999, "character": 0}});
    for round in 0..100 {
        let id = client
            .request("textDocument/inlayHint", json!({"textDocument": {"uri": text.uri}, "range": all}));
        std::thread::sleep(Duration::from_millis(15));
        let begin = Instant::now();
        let (from, to) = if round % 2 == 0 {
            ("priority = 99", "priority = 98")
        } else {
            ("priority = 98", "priority = 99")
        };
        client.edit(&mut text, from, to);
        let (at, answer) = client.wait("an answer", |it| is_answer(it, id));
        if answer["error"]["code"] == -32801 {
            times.push(at - begin);
        }
        client.forget();
    }
    report(&format!("a long analysis: edit to its end ({} of 100 overtaken)", times.len()), times);
}

fn memory(folder: &Path) {
    let mut client = Client::of_folder(MAUVE, folder);
    let text = client.open_file(&folder.join("root.mal"));
    client.diagnostics(&text);
    let status = std::fs::read_to_string(format!("/proc/{}/status", client.process())).unwrap_or_default();
    if let Some(line) = status.lines().find(|line| line.starts_with("VmRSS:")) {
        println!("200 files, 10,000 lines: {line}");
    }
}
