//! What the tests and benchmarks of several crates share: the format of fixtures, the sample robot, generated projects.
//!
//! It knows no other crate of the workspace, so that each can use it. The end-to-end tests beside it belong to `server`,
//! which builds the binary that they run.

#![allow(clippy::panic, clippy::unwrap_used, reason = "a helper of tests fails as a test does")]

pub mod axes;
mod client;
mod command;
mod counting_project;
pub mod deployer;
mod lttng;
pub mod machines;
pub mod methods;
pub mod model;
pub mod orocos;
mod random_model;
pub mod search;
pub mod sources;
mod times;
mod varied;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

pub use client::{Client, Columns, Text, address, is_answer, is_publication, wait_for_watcher, whole_text};
pub use command::{Run, copy, git, mauve, own_scratch, scratch, test_name, write};
pub use counting_project::{Counting, counting_project};
pub use lttng::{Event, Recorder, Span, spans};
pub use random_model::{Options, plain, random_model, random_model_of};
pub use times::Times;

/// The files of a fixture: `//- /path` begins a file, and text before the first such line is `/model.mal`.
///
/// ```
/// let files = mauve_tests::fixture("codel f(): int\n//- /times.toml\n[codel]\nf = 1\n");
/// assert_eq!(files[0], ("/model.mal".to_owned(), "codel f(): int\n".to_owned()));
/// assert_eq!(files[1].0, "/times.toml");
/// ```
pub fn fixture(text: &str) -> Vec<(String, String)> {
    let mut files: Vec<(String, String)> = Vec::new();
    for line in text.split_inclusive('\n') {
        if let Some(path) = line.strip_prefix("//- ") {
            files.push((path.trim().to_owned(), String::new()));
            continue;
        }
        match files.last_mut() {
            Some((_, text)) => text.push_str(line),
            None if line.trim().is_empty() => {}
            None => files.push(("/model.mal".to_owned(), line.to_owned())),
        }
    }
    files
}

/// The models of a page of `tests/mistakes`, `tests/spec` or `mauve explain`, each with the frame that its block names.
///
/// ```
/// let page = "```mauve frame=f\nshell S { $0\n}\n```\n```mauve in=f\nproperty n: int\n```\n";
/// assert_eq!(mauve_tests::models_of_page(page), ["shell S { property n: int\n}\n"]);
/// ```
pub fn models_of_page(page: &str) -> Vec<String> {
    let block = |text: &str| text.split("```").next().unwrap().to_owned();
    let blocks = page.split("```mauve").skip(1).map(|it| it.split_once('\n').unwrap());
    let all: Vec<(&str, String)> = blocks.map(|(info, rest)| (info.trim(), block(rest))).collect();
    let framed = |name: &str, model: &str| {
        let frame = all.iter().find(|(info, _)| info.strip_prefix("frame=") == Some(name)).unwrap();
        frame.1.replace("$0\n", model)
    };
    let models = all.iter().filter(|(info, _)| !info.starts_with("frame="));
    models
        .map(|(info, text)| info.strip_prefix("in=").map_or(text.clone(), |name| framed(name, text)))
        .collect()
}

/// The models of `tests/mistakes`, of `tests/spec` and of each diagnostic, each with its page and number.
pub fn models_of_pages() -> Vec<(String, String)> {
    let mut files = ["mistakes", "spec"].map(|name| files_in(&models().join("..").join(name))).concat();
    files.push(models().join("../../analysis/diagnostics/tests/near_misses.md"));
    let pages = files.into_iter().flat_map(|path| {
        let of = path.components().rev().take(2).map(|part| part.as_os_str().display().to_string());
        let name = of.collect::<Vec<_>>().into_iter().rev().collect::<Vec<_>>().join("/");
        let models = models_of_page(&std::fs::read_to_string(&path).unwrap());
        models.into_iter().enumerate().map(move |(number, model)| (format!("{name} {number}"), model))
    });
    pages.collect()
}

/// Numbers that look random, the same ones in each run with one seed, which is not 0 (xorshift).
pub struct Random(pub u64);

impl Random {
    /// Returns the numbers of a seed, which may be 0. Seeds that are close to each other give different numbers.
    pub fn of_seed(seed: u64) -> Random {
        Random((seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// A number below `bound`.
    pub fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound.max(1) as u64) as usize
    }

    /// One of `all`, which are some.
    pub fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

/// The folder `tests/models` of the repository.
pub fn models() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/models"))
}

/// All files below a folder, in the order of their paths.
pub fn files_in(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// What all files below a folder say, by their paths.
pub fn all_texts_in(folder: &Path) -> BTreeMap<PathBuf, String> {
    let texts =
        files_in(folder).into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap()));
    texts.collect()
}

/// The models, timing tables and configurations below a folder, by their paths and in that order.
pub fn texts_in(folder: &Path) -> Vec<(PathBuf, String)> {
    let is_ours = |path: &PathBuf| path.extension().is_some_and(|it| it == "mal" || it == "toml");
    let files = files_in(folder).into_iter().filter(is_ours);
    files.map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
}

/// [`texts_in`], with the paths that the files have when the folder is `root`.
pub fn texts_moved(folder: &Path, root: &str) -> Vec<(PathBuf, String)> {
    let below = |path: &Path| path.strip_prefix(folder).unwrap().to_owned();
    texts_in(folder).into_iter().map(|(path, text)| (Path::new(root).join(below(&path)), text)).collect()
}

/// The last offset up to `at` that is between two characters of a text.
pub fn char_boundary(text: &str, at: usize) -> usize {
    (0..=at.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0)
}

/// A project of `files` models and about `lines` lines that has nothing to complain of: a root that includes all others, and for each
/// a library with codels, a shell, a core with a state machine, a component and an instance of it.
///
/// The first file is the root, `/root.mal`; `/mauve.toml` and `/times.toml` stand beside it.
pub fn generated_project(files: usize, lines: usize) -> Vec<(String, String)> {
    let parts = files.saturating_sub(1).max(1);
    let states = (lines / parts).saturating_sub(20).div_ceil(9).max(1);
    let mut root = String::new();
    let mut instances = String::from("architecture Robot {\n");
    let mut connections = String::new();
    let mut activities = String::from("deployment Run {\n  architecture Robot\n");
    let mut times = String::from("unit = \"us\"\n[codel]\n");
    let mut texts = Vec::new();
    for part in 0..parts {
        let _ = writeln!(root, "include \"part{part}.mal\"");
        let _ = writeln!(instances, "  instance i{part}: part{part}.Component{part}");
        // Periods as robots have them, priorities by falling rate, the CPUs in turn.
        let period = [10, 20, 50, 100, 1000][part * 5 / parts];
        let priority = 99 - (part / 4).min(98);
        let affinity = 1 << (part % 4);
        let next = (part + 1) % parts;
        if next > 0 {
            let _ = writeln!(connections, "  connection i{part}.command -> i{next}.measure");
        }
        let _ = writeln!(
            activities,
            "  activity i{part} {{ priority = {priority} period = {period} affinity = {affinity} }}"
        );
        for codel in ["sense", "decide", "act"] {
            let _ = writeln!(times, "\"part{part}.{codel}\" = {}", 1 + part % 20);
        }
        texts.push((format!("/part{part}.mal"), part_text(part, states)));
    }
    let root = format!("{root}\n{instances}{connections}}}\n\n{activities}}}\n");
    let config =
        "[project]\nroot = \"root.mal\"\n[timing]\ntables = [\"times.toml\"]\n[platform]\ncpus = 4\n";
    texts.insert(0, ("/root.mal".to_owned(), root));
    texts.push(("/mauve.toml".to_owned(), config.to_owned()));
    texts.push(("/times.toml".to_owned(), times));
    texts
}

fn part_text(part: usize, states: usize) -> String {
    let mut text = format!(
        "// Part {part} of a generated robot.\nlibrary part{part} {{\n  codel sense(in frame: int): int\n  \
         codel decide(in value: int, out next: int): bool\n  codel act(in value: int, in gain: double): int\n\n  \
         shell Shell{part} {{\n    property gain: double [0; 1] = 0.5\n    input port measure: int\n    \
         output port command: int\n  }}\n\n  core Core{part}(Shell{part}) {{\n    var value: int = 0;\n    \
         var next: int = 0;\n    statemachine {{\n"
    );
    for state in 0..states {
        let initial = if state == 0 { "initial " } else { "" };
        let next = (state + 1) % states;
        let _ = write!(
            text,
            "      {initial}state S{state} {{\n        entry = {{ next = {state}; }}\n        run = {{\n          \
             if (read(measure, value) == new_data) then {{ value = sense(value + {state}); }} else {{}}\n        }}\n        \
             transition go if (decide(value, next) && value > {state}) to S{next} {{ write(command, act(next, gain)); }}\n        \
             handle = {{ write(command, value); }}\n      }}\n\n"
        );
    }
    let _ = write!(text, "    }}\n  }}\n\n  component Component{part}(Shell{part}, Core{part})\n}}\n");
    text
}

/// A project with one large file, which declares this many codels. Each has about 50 bytes. A core calls the first codel.
pub fn long_file(codels: usize) -> Vec<(String, String)> {
    let mut model = String::from("library long {\n");
    for codel in 0..codels {
        let _ = writeln!(model, "  codel work{codel}(in value: int, in gain: double): int");
    }
    model += "  shell Interface { output port command: int }\n  core Behaviour(Interface) {\n    \
              update = { write(command, work0(1, 0.5)); }\n  }\n  component Part(Interface, Behaviour)\n}\n\
              architecture Robot {\n  instance part: long.Part\n}\n\
              deployment Run {\n  architecture Robot\n  activity part { priority = 5 period = 1000 affinity = 1 }\n}\n";
    let config = "[project]\nroot = \"model.mal\"\n[timing]\ntables = [\"times.toml\"]\n";
    [
        ("/model.mal", model.as_str()),
        ("/mauve.toml", config),
        ("/times.toml", "unit = \"us\"\n[codel]\n\"long.work0\" = 1\n"),
    ]
    .map(|(path, text)| (path.to_owned(), text.to_owned()))
    .to_vec()
}

/// A project whose analysis takes long: `count` activities below one that leaves a millionth of the CPU, so that each is
/// searched for a bound until that is given up.
pub fn long_analysis(count: usize) -> Vec<(String, String)> {
    let mut model = String::from(
        "codel f(): int\ncodel g(): int\nshell S { }\ncore C(S) { update = { f(); } }\ncore E(S) { update = { g(); } }\n\
         component P(S, C)\ncomponent Q(S, E)\n",
    );
    let mut instances = String::from("architecture A {\n  instance p: P\n");
    let mut activities =
        String::from("deployment D {\n  architecture A\n  activity p { priority = 99 period = 1 }\n");
    for index in 0..count {
        let _ = writeln!(instances, "  instance q{index}: Q");
        let priority = 1 + index % 98;
        let _ = writeln!(activities, "  activity q{index} {{ priority = {priority} period = 2147483647 }}");
    }
    model += &format!("{instances}}}\n{activities}}}\n");
    let times = "unit = \"ns\"\n[codel]\nf = 999999\ng = 2000000\n";
    let config = "[timing]\ntables = [\"times.toml\"]\n[lints]\nequal-priorities = \"allow\"\n";
    [("/a.mal", model.as_str()), ("/mauve.toml", config), ("/times.toml", times)]
        .map(|(path, text)| (path.to_owned(), text.to_owned()))
        .to_vec()
}
