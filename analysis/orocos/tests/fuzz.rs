//! The properties of folders of packages that `cargo fuzz` looks for exceptions to, on some hundred texts.
//!
//! `MAUVE_FUZZ=100000 cargo test --release -p mauve-orocos --test main fuzz::` tries more.

#[path = "../../../tests/fuzz/packages.rs"]
mod packages;

use mauve_orocos::{Action, MANIFEST, plan};
use mauve_tests::Random;
use packages::{MINE, PACKAGES};
use serde_json::{Map, Value, json};
use sha2::{Digest as _, Sha256};

/// Words and pieces of manifests and of codels.
const PIECES: [&str; 28] = [
    "{",
    "}",
    "(",
    ")",
    "\"",
    ":",
    ",",
    ";",
    "null",
    "1",
    "files",
    "codels",
    "offered",
    "hash",
    "is_right",
    "../",
    "src/codels/",
    ".cpp",
    ".new",
    "user.cmake",
    "int",
    "f",
    "/*",
    "//",
    "\\",
    "R\"(",
    "\n",
    "\u{e9}",
];

/// Paths that somebody may list, beside those of generated files.
const PATHS: [&str; 12] = [
    "launch/d.launch",
    "c/c-component.hpp",
    "launch/gone.launch",
    "models/gone.json",
    "src/gone-components.cpp",
    "package.XML",
    "src/codels/f.cpp",
    "src/codels/F.cpp",
    "src/codels/gone.cpp",
    "user.cmake",
    "mine.txt",
    "../mine.txt",
];

fn count() -> usize {
    std::env::var("MAUVE_FUZZ").map_or(600, |count| count.parse().expect("a number"))
}

/// A text with something in the place of a part, or between parts, or with a part twice.
fn mutated(random: &mut Random, seeds: &[String]) -> String {
    let seed = random.of(seeds);
    let (one, other) = (random.below(seed.len() + 1), random.below(seed.len() + 1));
    let at = |at: usize| (at..seed.len()).find(|&at| seed.is_char_boundary(at)).unwrap_or(seed.len());
    let (from, to) = (at(one.min(other)), at(one.max(other)));
    let soup: Vec<&str> = (0..random.below(4)).map(|_| *random.of(&PIECES)).collect();
    let soup = soup.concat();
    match random.below(3) {
        0 => format!("{}{soup}{}", &seed[..from], &seed[to..]),
        1 => format!("{}{soup}{}", &seed[..from], &seed[from..]),
        _ => format!("{}{soup}{}", &seed[..to], &seed[from..]),
    }
}

/// A manifest that lists any files, with the hash of one of the user's or another one.
fn forged(random: &mut Random, paths: &[String], hashes: &[String]) -> String {
    let (mut files, mut codels) = (Map::new(), Map::new());
    for _ in 0..random.below(6) {
        let (path, hash) = (random.of(paths).clone(), random.of(hashes).clone());
        let offered = json!({ "prototype": "int f(int n)", "hash": hash });
        match random.below(3) {
            0 => codels.insert(path, json!({ "prototype": "int f()", "offered": offered })),
            _ => files.insert(path, Value::from(hash)),
        };
    }
    json!({ "format": 1, "files": files, "codels": codels }).to_string()
}

#[test]
fn nothing_of_the_users_is_removed_whatever_a_manifest_says() {
    let fresh = plan(&PACKAGES, &|_| Ok(None)).unwrap();
    let texts = fresh.steps.iter().filter(|step| step.path.ends_with(MANIFEST));
    let mut seeds: Vec<String> = texts
        .filter_map(|step| if let Action::Create(text) = &step.action { Some(text.clone()) } else { None })
        .collect();
    assert!(seeds.len() > 1, "{seeds:?}");
    let generated = PACKAGES.iter().flat_map(|package| &package.files).map(|file| file.path.clone());
    let paths: Vec<String> = generated.chain(PATHS.map(str::to_owned)).collect();
    let mine: String = Sha256::digest(MINE).iter().map(|byte| format!("{byte:02x}")).collect();
    let hashes = [mine, "0".to_owned()];
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    seeds.extend((0..40).map(|_| forged(&mut random, &paths, &hashes)));
    for _ in 0..count() {
        packages::manifest(&forged(&mut random, &paths, &hashes));
        packages::manifest(&mutated(&mut random, &seeds));
    }
}

#[test]
fn codels_stay_whatever_they_say() {
    let fresh = plan(&PACKAGES, &|_| Ok(None)).unwrap();
    let stubs = fresh.steps.iter().filter(|step| step.path.contains("/src/codels/"));
    let mut seeds: Vec<String> = stubs
        .filter_map(|step| if let Action::Create(text) = &step.action { Some(text.clone()) } else { None })
        .collect();
    assert!(!seeds.is_empty());
    seeds.extend(["", "int f(", "int f() { return 1; }\n", "#define f(a) /*\n"].map(str::to_owned));
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    for _ in 0..count() {
        packages::prototype(&mutated(&mut random, &seeds));
    }
}
