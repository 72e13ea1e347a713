//! Over the real binary: from a keystroke to published diagnostics and fresh hints. `cargo bench -p mauve --bench keystroke`
//!
//! This is no test: it prints times, median and 95th percentile, and what they are to be on a quiet machine with two cores. They
//! are the server's: the client's own parsing does not count. Behind `--`, words that the rows to be measured have in them, such
//! as `1000 files`. `MAUVE_BINARY=PATH:PATH` measures other binaries, row by row. `latency.rs` has the other times.

#![allow(clippy::panic)]

use std::path::{Path, PathBuf};
use std::time::Instant;

use mauve_tests::axes::Axis;
use mauve_tests::{
    Client, Counting, Times, copy, counting_project, generated_project, is_answer, long_file, models,
    whole_text, write,
};
use serde_json::json;

const ROUNDS: usize = 300;

fn main() {
    let robot = folder("robot");
    copy(&models().join("p3dx"), &robot);
    let robot = |what, file, texts| keystrokes(what, &robot, [file, "deployment.mal"], texts, 2.0);
    println!("{}", Times::HEAD);
    robot("sample robot, period", "deployment.mal", ["period = 1000", "period = 2000"]);
    robot("sample robot, comment in a component", "components/navigation.mal", ["//", "// so:"]);

    let literal = ["sense(value + ", "sense(value + 1"];
    let comment = ["// Part", "// The part"];
    let period = ["period = 20 ", "period = 30 "];
    let parts = [
        ("1000 lines in one core", 2, 1_000, 2.0),
        ("10000 lines in one core", 2, 10_000, 5.0),
        ("200 files", 200, 10_000, 2.0),
        ("1000 files", 1_000, 100_000, 5.0),
    ];
    for (what, files, lines, target) in parts {
        let part = format!("part{}.mal", (files - 1) / 2);
        let project = project(what, &generated_project(files, lines));
        let row = |kind: &str, file: &str, texts| {
            keystrokes(&format!("{what}, {kind}"), &project, [file, "root.mal"], texts, target);
        };
        row("literal", &part, literal);
        row("call", &part, ["next = ", "next = sense(1) + "]);
        row("comment", &part, comment);
        if files > 2 {
            row("period", "root.mal", period);
        }
    }

    let count = ["count = count + 1;", "count = count + 2;"];
    let tries = ["count >= 3", "count >= 4"];
    let period = ["period = 100 ", "period = 101 "];
    let counting = [
        ("counters in 1000 lines", Counting::Counters, 1, 165, count, 2.0),
        ("counters in 10000 lines", Counting::Counters, 1, 1_650, count, 5.0),
        ("counters in 200 files", Counting::Counters, 200, 8, count, 2.0),
        ("modes in 1000 lines", Counting::Modes, 1, 90, tries, 3.0),
        ("modes in 200 files", Counting::Modes, 200, 10, tries, 5.0),
    ];
    for (what, counting, files, states, literal, target) in counting {
        let project = project(what, &counting_project(counting, files, states));
        let part = format!("part{}.mal", files / 2);
        let row = |kind: &str, file: &str, texts| {
            keystrokes(&format!("{what}, {kind}"), &project, [file, "root.mal"], texts, target);
        };
        row("literal", &part, literal);
        row("comment", &part, ["  var count", "  /* so */ var count"]);
        row("period", "root.mal", period);
    }

    let period = ["period = 20 ", "period = 30 "];
    let activities = project("activities", &(Axis::named("activities").project)(1_000));
    keystrokes("1000 activities, period", &activities, ["model.mal", "model.mal"], period, 8.0);
    let long = project("long", &long_file(200_000));
    let texts = [": int\n", ": double\n"];
    keystrokes("10 MB and 200000 codels in a file, type", &long, ["model.mal", "model.mal"], texts, 100.0);
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("keystroke").join(name.replace(' ', "-"));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

fn project(name: &str, files: &[(String, String)]) -> PathBuf {
    let folder = folder(name);
    write(&folder, files);
    folder
}

fn is_wanted(what: &str) -> bool {
    let mut words = std::env::args().skip(1).filter(|it| !it.starts_with('-')).peekable();
    words.peek().is_none() || words.any(|it| what.contains(&it))
}

fn keystrokes(what: &str, folder: &Path, files: [&str; 2], texts: [&str; 2], target: f64) {
    if !is_wanted(what) {
        return;
    }
    let built = env!("CARGO_BIN_EXE_mauve");
    let binaries = std::env::var_os("MAUVE_BINARY").unwrap_or_else(|| built.into());
    for binary in std::env::split_paths(&binaries) {
        let (published, hinted) = measure(&binary.display().to_string(), folder, files, texts);
        let name = binary.file_name().unwrap_or_default().display();
        let what = if binary == Path::new(built) { what.to_owned() } else { format!("{name}: {what}") };
        println!("{}", published.row(&format!("{what}: to diagnostics")));
        println!("{}", hinted.row_with_target(&format!("{what}: and hints"), target));
    }
}

/// Replaces one text in the middle of the first file by the other, to and fro. Each time it waits for the diagnostics, and then
/// for the hints of the deployment, which is in the second file.
fn measure(binary: &str, folder: &Path, files: [&str; 2], texts: [&str; 2]) -> (Times, Times) {
    let [file, deployment] = files;
    let mut client = Client::of_folder(binary, folder);
    let deployed = client.open_file(&folder.join(deployment));
    client.diagnostics(&deployed);
    let mut text = if file == deployment { deployed.clone() } else { client.open_file(&folder.join(file)) };
    client.hints(&deployed.uri);
    // The first diagnostics come before the project is analysed.
    client.idle();
    let middle = text.text.len() / 2;
    let at =
        text.text[middle..].find(texts[0]).map_or_else(|| text.text.find(texts[0]), |at| Some(middle + at));
    let Some(at) = at else { panic!("no `{}` in {file}", texts[0]) };
    let (start, mut length) = (text.position(at), texts[0].len());
    let (mut published, mut hinted) = (Times::default(), Times::default());
    // A session of the longest file has fewer rounds, so that slow binaries can be measured too.
    for round in 0..ROUNDS.min(200_000_000 / text.text.len()) {
        let new = texts[(round + 1) % 2];
        let mut end = start.clone();
        end["character"] = (start["character"].as_u64().unwrap_or_default() + length as u64).into();
        length = new.len();
        text.version += 1;
        let begin = Instant::now();
        client.notify(
            "textDocument/didChange",
            json!({
                "textDocument": {"uri": text.uri, "version": text.version},
                "contentChanges": [{"range": {"start": start, "end": end}, "text": new}],
            }),
        );
        let to_diagnostics = client.wait_for_diagnostics(&text) - begin;
        let begin = Instant::now();
        let id = client.request("textDocument/inlayHint", whole_text(&deployed.uri));
        let to_hints = client.wait("hints", |it| is_answer(it, id)).0 - begin;
        published.add(to_diagnostics);
        hinted.add(to_diagnostics + to_hints);
        client.forget();
    }
    (published, hinted)
}
