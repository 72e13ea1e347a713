//! Over the real binary: from a keystroke to published diagnostics and fresh hints. `cargo bench -p mauve --bench keystroke`
//!
//! This is no test: it prints times, median and 95th percentile. `latency.rs` has the other times.

#![allow(clippy::panic)]

use std::path::{Path, PathBuf};
use std::time::Instant;

use mauve_tests::{Client, Times, copy, generated_project, models, write};

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");
const ROUNDS: usize = 300;

fn main() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("keystroke");
    let _ = std::fs::remove_dir_all(&folder);
    let (robot, project, one) = (folder.join("robot"), folder.join("project"), folder.join("one"));
    copy(&models().join("p3dx"), &robot);
    write(&project, &generated_project(200, 10_000));
    println!("{}", Times::HEAD);
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
    let (mut published, mut hinted) = (Times::default(), Times::default());
    for round in 0..ROUNDS {
        let (old, new) = (texts[round % 2], texts[(round + 1) % 2]);
        let begin = Instant::now();
        client.replace(&mut text, at..at + old.len(), new);
        published.add(client.wait_for_diagnostics(&text) - begin);
        client.hints(&deployment.uri);
        hinted.add(begin.elapsed());
        client.forget();
    }
    println!("{}", published.row(&format!("{what}: to diagnostics")));
    println!("{}", hinted.row(&format!("{what}: to diagnostics and hints")));
}
