//! Byte order marks: a file that begins with one gives what it gives without it, and keeps it.

use std::fs;
use std::path::{Path, PathBuf};

use mauve_tests::{mauve, scratch, test_name, write};

use crate::MAUVE;

const MARK: &str = "\u{feff}";

/// Something is wrong on the first line of most files.
const FILES: [(&str, &str); 5] = [
    ("robot/core.mal", "codel labour(a: in): int\r\nshell S { }\r\n"),
    ("robot/robot.mal", "include \"core.mal\" core K(S): { update = { laobur(1);   } }\ncomponent C(S, K)\n"),
    ("robot/only.mal", ""),
    ("robot/mauve.toml", "[timing]  tables = [\"times.toml\"]\n"),
    ("robot/times.toml", "codel.labour = [1, 2\n"),
];

/// The projects with a mark in no file, in each one, and in all.
fn subsets() -> impl Iterator<Item = Vec<bool>> {
    let one = (0..FILES.len()).map(|marked| (0..FILES.len()).map(|file| file == marked).collect());
    std::iter::once(vec![true; FILES.len()]).chain(one)
}

fn put(folder: &Path, marked: &[bool]) {
    let of = |((path, text), marked): (&(&'static str, &str), &bool)| {
        (*path, if *marked { format!("{MARK}{text}") } else { (*text).to_owned() })
    };
    let files: Vec<(&str, String)> = FILES.iter().zip(marked).map(of).collect();
    write(folder, &files.iter().map(|(path, text)| (*path, text.as_str())).collect::<Vec<_>>());
}

fn folder() -> PathBuf {
    scratch(env!("CARGO_TARGET_TMPDIR"), &test_name())
}

#[test]
fn every_output_is_that_of_the_text_without_marks() {
    let folder = folder();
    let commands: [&[&str]; 7] = [
        &["check"],
        &["check", "--format", "json"],
        &["check", "--format", "sarif"],
        &["check", "--diff"],
        &["fmt", "--check"],
        &["parse", "robot/robot.mal"],
        &["wcrt"],
    ];
    let outputs = || commands.map(|command| mauve(MAUVE, &folder, command)).map(|run| run.out + &run.err);
    put(&folder, &[false; FILES.len()]);
    let expected = outputs();
    assert!(expected.iter().all(|it| !it.is_empty()), "{expected:?}");
    for marked in subsets() {
        put(&folder, &marked);
        for ((found, expected), command) in outputs().iter().zip(&expected).zip(commands) {
            // A patch has the bytes of the files.
            let found = if command.contains(&"--diff") { &found.replace(MARK, "") } else { found };
            assert_eq!(found, expected, "{command:?} where marked: {marked:?}");
        }
    }
}

#[test]
fn a_file_that_is_written_keeps_its_mark() {
    for (command, code) in [(["fmt"].as_slice(), 0), (&["check", "--fix"], 1)] {
        let (plain, marked) = (folder().join("plain"), folder().join("marked"));
        put(&plain, &[false; FILES.len()]);
        put(&marked, &[true; FILES.len()]);
        for folder in [&plain, &marked] {
            assert_eq!(mauve(MAUVE, folder, command).code, code, "{command:?}");
        }
        let mut changed = 0;
        for (path, before) in FILES {
            let text = |folder: &Path| fs::read_to_string(folder.join(path)).unwrap();
            assert_eq!(text(&marked), format!("{MARK}{}", text(&plain)), "{command:?} {path}");
            changed += usize::from(text(&plain) != before);
        }
        assert!(changed > 0, "{command:?} changes nothing");
    }
}

#[test]
fn a_mark_inside_a_file_is_a_character_like_others_and_utf_16_is_no_text() {
    let folder = folder();
    write(&folder, &[("a.mal", &format!("{MARK}codel f(){MARK}: int\n"))]);
    let found = mauve(MAUVE, &folder, &["check"]);
    assert!(found.out.contains("--> a.mal:1:10") && found.code == 1, "{}", found.out);
    assert_eq!(mauve(MAUVE, &folder, &["fmt"]).code, 0);
    assert_eq!(fs::read_to_string(folder.join("a.mal")).unwrap(), format!("{MARK}codel f(){MARK}: int\n"));
    for bytes in [b"\xff\xfec\0o\0".as_slice(), b"\xfe\xff\0c\0o", b"\xff\xfe\0\0c\0\0\0"] {
        fs::write(folder.join("a.mal"), bytes).unwrap();
        let found = mauve(MAUVE, &folder, &["check"]);
        assert!(found.out.contains("not UTF-8 text from byte 0 on") && found.code == 1, "{}", found.out);
    }
    // Bytes count from the beginning of the file.
    fs::write(folder.join("a.mal"), b"\xef\xbb\xbfuse \xff").unwrap();
    let found = mauve(MAUVE, &folder, &["check"]);
    assert!(found.out.contains("not UTF-8 text from byte 7 on"), "{}", found.out);
}
