//! Checks the architecture: crates import only the crates that the map allows, modules of the analysis crates have no
//! cyclic imports, and analysis crates contain no prose.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use mauve_tests::sources::{literals, without_tests};

/// Each crate, and the crates of the workspace that it may import.
const MAP: [(&str, &[&str]); 12] = [
    ("syntax", &[]),
    ("analysis/timing", &[]),
    ("analysis/pwcet", &[]),
    ("analysis/hir", &["mauve-syntax", "mauve-timing"]),
    // `observed` compares recordings, which `pwcet` reads, with a model.
    ("analysis/wcrt", &["mauve-syntax", "mauve-timing", "mauve-pwcet", "mauve-hir"]),
    ("analysis/diagnostics", &["mauve-syntax", "mauve-timing", "mauve-pwcet", "mauve-hir", "mauve-wcrt"]),
    ("analysis/orocos", &["mauve-syntax", "mauve-timing", "mauve-hir", "mauve-wcrt", "mauve-diagnostics"]),
    (
        "analysis/ide",
        &["mauve-syntax", "mauve-timing", "mauve-pwcet", "mauve-hir", "mauve-wcrt", "mauve-diagnostics"],
    ),
    (
        "server",
        &[
            "mauve-syntax",
            "mauve-timing",
            "mauve-pwcet",
            "mauve-hir",
            "mauve-wcrt",
            "mauve-diagnostics",
            "mauve-orocos",
            "mauve-ide",
        ],
    ),
    ("editors/tree-sitter", &[]),
    ("tests", &[]),
    ("tests/fuzz", &[]),
];

/// The crates whose modules must have no cyclic imports.
const WITHOUT_CIRCLES: [&str; 4] =
    ["analysis/pwcet", "analysis/hir", "analysis/wcrt", "analysis/diagnostics"];

/// The crates without messages, each with its modules that contain English literals for other reasons.
///
/// The tables of keys document them for completion and schema; the parser of JSON asks for the words that follow *expected* in
/// its errors. In `orocos`, `cpp_name` lists reserved words, and the others write sentences into generated files. A literal for
/// a file cannot be told apart from a message, so these modules are not checked; those that find problems, and compare packages
/// with a folder, are.
const WITHOUT_PROSE: [(&str, &[&str]); 6] = [
    ("syntax", &[]),
    ("analysis/pwcet", &[]),
    ("analysis/timing", &["table::keys", "task_set::json"]),
    ("analysis/hir", &["config::keys"]),
    ("analysis/wcrt", &[]),
    (
        "analysis/orocos",
        &[
            "build",
            "codels",
            "component::header",
            "component::obvious",
            "component::source",
            "cpp_name",
            "deployment",
            "generated_file",
            "launch",
            "lua",
            "ops",
            "runtime",
            "standalone",
            "standalone::messages",
            "standalone::program",
            "stubs",
            "task",
        ],
    ),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// Returns the sources of a crate by module path (`names`, `config::cpp`), without comments and tests.
fn sources(krate: &str) -> BTreeMap<String, String> {
    let folder = root().join(krate).join("src");
    let mut found = BTreeMap::new();
    for path in mauve_tests::files_in(&folder)
        .into_iter()
        .filter(|path| path.extension().is_some_and(|it| it == "rs"))
    {
        let module = path.strip_prefix(&folder).unwrap().with_extension("");
        let module: Vec<_> = module.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
        let text = fs::read_to_string(&path).unwrap();
        let lines = without_tests(&text).lines().filter(|line| !line.trim_start().starts_with("//"));
        found.insert(module.join("::"), lines.map(|line| format!("{line}\n")).collect());
    }
    found
}

#[test]
fn a_crate_imports_only_what_stands_to_its_left() {
    for (krate, allowed) in MAP {
        let Ok(manifest) = fs::read_to_string(root().join(krate).join("Cargo.toml")) else {
            assert_eq!(krate, "tests/fuzz", "{krate} is in the map and has no manifest");
            continue;
        };
        let section =
            manifest.split("\n[").find(|section| section.starts_with("dependencies]")).unwrap_or_default();
        let own = section
            .lines()
            .filter_map(|line| line.split(['.', ' ', '=']).next())
            .filter(|it| it.starts_with("mauve-"));
        for dependency in own.filter(|_| krate != "tests/fuzz") {
            assert!(allowed.contains(&dependency), "{krate} must not depend on {dependency}");
        }
    }
}

/// Returns the names that a crate's root module exports, with their modules.
fn exports(front: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for import in front.split("pub use ").skip(1) {
        let import = import.split(';').next().unwrap_or_default();
        let Some((module, names)) = import.split_once("::") else { continue };
        for name in names.trim_matches(['{', '}', ' ', '\n']).split(',') {
            // The name after `as`, if there is one.
            let name = name.split_whitespace().last().unwrap_or_default();
            found.insert(name.to_owned(), module.trim().to_owned());
        }
    }
    found
}

/// Returns the names after `crate::` in a text: modules, or names that the root module exports.
fn imported(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for rest in text.split("crate::").skip(1) {
        let names = match rest.strip_prefix('{') {
            // The first name of each item in the braces.
            Some(list) => {
                let mut depth = 1;
                let end = list.find(|letter| {
                    depth += i32::from(letter == '{') - i32::from(letter == '}');
                    depth == 0
                });
                let mut items = vec![String::new()];
                let mut depth = 0;
                for letter in list.get(..end.unwrap_or(0)).unwrap_or_default().chars() {
                    depth += i32::from(letter == '{') - i32::from(letter == '}');
                    match letter {
                        ',' if depth == 0 => items.push(String::new()),
                        letter => items.last_mut().unwrap().push(letter),
                    }
                }
                items
            }
            None => vec![rest.to_owned()],
        };
        for name in names {
            let word =
                name.trim_start().split(|letter: char| !letter.is_alphanumeric() && letter != '_').next();
            found.extend(word.filter(|word| !word.is_empty()).map(str::to_owned));
        }
    }
    found
}

#[test]
fn no_modules_import_each_other() {
    for krate in WITHOUT_CIRCLES {
        let sources = sources(krate);
        let exports = exports(sources.get("lib").map_or("", String::as_str));
        let top = |module: &str| module.split("::").next().unwrap_or_default().to_owned();
        let modules: BTreeSet<String> = sources.keys().map(|module| top(module)).collect();
        let mut imports: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (module, text) in sources.iter().filter(|(module, _)| *module != "lib") {
            let of = imports.entry(top(module)).or_default();
            for name in imported(text) {
                let name = exports.get(&name).cloned().unwrap_or(name);
                of.extend(Some(name).filter(|name| modules.contains(name) && *name != top(module)));
            }
        }
        // Repeatedly removes modules without remaining imports: modules that are left form a cycle.
        loop {
            let free: Vec<String> =
                imports.iter().filter(|(_, of)| of.is_empty()).map(|(module, _)| module.clone()).collect();
            if free.is_empty() {
                break;
            }
            for module in free {
                imports.remove(&module);
                imports.values_mut().for_each(|of| _ = of.remove(&module));
            }
        }
        assert!(imports.is_empty(), "{krate}: these modules import each other: {imports:#?}");
    }
}

#[test]
fn what_computes_says_nothing() {
    let is_word = |word: &str| word.len() > 1 && word.chars().all(|letter| letter.is_ascii_lowercase());
    for (krate, with_english) in WITHOUT_PROSE {
        for (module, text) in sources(krate) {
            // Attributes tell the compiler something.
            let text: String = text
                .lines()
                .filter(|line| !line.trim_start().starts_with("#[") && !line.trim_start().starts_with("#!["))
                .map(|line| format!("{line}\n"))
                .collect();
            let is_prose = |literal: &String| {
                let words: Vec<&str> = literal.split_whitespace().collect();
                words.windows(3).any(|three| three.iter().all(|word| is_word(word)))
            };
            let found = literals(&text).into_iter().map(|(_, literal)| literal).find(is_prose);
            // An unneeded exception fails too, so that the list stays short.
            let is_exception = with_english.contains(&module.as_str());
            assert_eq!(
                found.is_some(),
                is_exception,
                "{krate}/src/{module}.rs has a message, or is no exception: {found:?}"
            );
        }
    }
}
