//! The sample robot, edited at random: whatever happened on the way, a server knows what a fresh one would.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use mauve_tests::{Client, Random, Text, copy, models, scratch};
use serde_json::json;

const MAUVE: &str = env!("CARGO_BIN_EXE_mauve");

const STEPS: usize = 10_000;
/// So often the server is compared with a fresh one.
const COMPARISONS: usize = 5;

const PIECES: [&str; 16] = [
    " ",
    "\n",
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
    "codel f(): int",
    "\"",
    "/*",
];

/// The files that are edited, those that matter most first; the last is a link to the first.
const FILES: [&str; 8] = [
    "deployment.mal",
    "timing/p3dx.toml",
    "mauve.toml",
    "exploration_architecture.mal",
    "exploration.mal",
    "components/navigation.mal",
    "components/hokuyo.mal",
    "link.mal",
];

/// Folders that come and go.
const FOLDERS: [&str; 2] = ["timing", "components"];

#[test]
fn ten_thousand_edits_leave_what_a_fresh_server_finds() {
    let seed = std::env::var("MAUVE_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(0x9e37_79b9);
    println!("MAUVE_SEED={seed}");
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("lsp_random_{seed}"));
    copy(&models().join("p3dx"), &folder);
    let paths: Vec<PathBuf> = FILES.iter().map(|file| folder.join(file)).collect();
    std::os::unix::fs::symlink(&paths[0], &paths[7]).unwrap();
    let originals: Vec<String> = paths.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect();
    let mut random = Random(seed);
    let mut client = Client::of_folder(MAUVE, &folder);
    // With the step in which each was touched last.
    let mut open: BTreeMap<usize, (usize, Text)> = BTreeMap::new();
    for step in 1..=STEPS {
        let file = random.below(FILES.len());
        if random.below(100) == 0 {
            move_a_folder(&mut random, &folder, &originals[1]);
        }
        let path = &paths[file];
        match open.get_mut(&file) {
            None => match random.below(8) {
                // Somebody else writes it, or takes it away. Its folder may be away.
                0 => drop(std::fs::write(path, damaged(&mut random, &originals[file]))),
                1 if file != 7 => drop(std::fs::remove_file(path)),
                2 => drop(std::fs::write(path, &originals[file])),
                _ => {
                    open.insert(file, (step, client.open(path, &originals[file])));
                }
            },
            Some((touched, text)) => match random.below(20) {
                0 => {
                    client.notify("textDocument/didClose", json!({"textDocument": {"uri": text.uri}}));
                    open.remove(&file);
                }
                // What was broken is mended, so that there is something to analyse.
                1..=5 => {
                    let all = 0..text.text.len();
                    client.replace(text, all, &originals[file]);
                    *touched = step;
                }
                6 => {
                    let uri = text.uri.clone();
                    client.request("textDocument/documentSymbol", json!({"textDocument": {"uri": uri}}));
                }
                7 => {
                    let offset = boundary(&text.text, random.below(text.text.len() + 1));
                    let position = text.position(offset);
                    let at = json!({"textDocument": {"uri": text.uri}, "position": position});
                    let method = random.of(&["textDocument/hover", "textDocument/definition"]);
                    let id = client.request(method, at);
                    if random.below(4) == 0 {
                        client.notify("$/cancelRequest", json!({"id": id}));
                    }
                }
                _ => {
                    let (range, piece) = edit(&mut random, &text.text);
                    client.replace(text, range, &piece);
                    *touched = step;
                }
            },
        }
        if step % (STEPS / COMPARISONS) == 0 {
            compare(&mut client, &folder, &open);
        } else if step % 50 == 0 {
            // Let it think now and then, as people do.
            client.settle(Duration::from_millis(1));
            client.forget();
        }
    }
    assert_eq!(client.shut_down(), Some(0));
}

/// Takes a folder away, puts it back, or puts another one in its place.
fn move_a_folder(random: &mut Random, folder: &Path, table: &str) {
    let name = *random.of(&FOLDERS);
    let (here, away) = (folder.join(name), folder.join(format!("{name}.away")));
    if !here.exists() {
        std::fs::rename(away, here).unwrap();
    } else if random.below(2) == 0 && !away.exists() {
        std::fs::rename(here, away).unwrap();
    } else if name == "timing" && !away.exists() {
        std::fs::rename(&here, &away).unwrap();
        std::fs::create_dir(&here).unwrap();
        std::fs::write(here.join("p3dx.toml"), damaged(random, table)).unwrap();
        std::fs::remove_dir_all(away).unwrap();
    }
}

fn boundary(text: &str, mut offset: usize) -> usize {
    while !text.is_char_boundary(offset) {
        offset -= 1;
    }
    offset
}

/// Something is put in, taken out, or a digit becomes another.
fn edit(random: &mut Random, text: &str) -> (std::ops::Range<usize>, String) {
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
    let (range, piece) = edit(random, &text);
    text.replace_range(range, &piece);
    text
}

/// Compares all diagnostics, and all hints of open files, with those of a server that has seen nothing of what happened.
fn compare(client: &mut Client, folder: &Path, open: &BTreeMap<usize, (usize, Text)>) {
    let mut fresh = Client::of_folder(MAUVE, folder);
    // Of two addresses of one file, the one that was touched last counts.
    let mut texts: Vec<(usize, &Text)> = open.values().map(|(touched, text)| (*touched, text)).collect();
    texts.sort_by_key(|(touched, _)| *touched);
    for (_, text) in &texts {
        fresh.open_at(&text.uri, &text.text);
    }
    let hints =
        |client: &mut Client| texts.iter().map(|(_, text)| client.hints(&text.uri)).collect::<Vec<_>>();
    let expected = hints(&mut fresh);
    // What changed on the disk is noticed in its time.
    for quiet in [100, 300, 1000, 1000, 1000, 1000, 1000, 1000] {
        client.settle(Duration::from_millis(quiet));
        fresh.settle(Duration::from_millis(quiet));
        if hints(client) == expected && client.published() == fresh.published() {
            break;
        }
    }
    assert_eq!(hints(client), expected);
    assert_eq!(client.published(), fresh.published());
    client.forget();
}
