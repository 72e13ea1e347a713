//! Checks the architecture: crates import only the crates that the map allows, modules have no cyclic imports, and analysis
//! crates contain no prose.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use mauve_tests::sources::literals;

/// Each crate, and the crates of the workspace that it may import.
const MAP: [(&str, &[&str]); 16] = [
    ("syntax", &[]),
    ("analysis/timing", &[]),
    ("analysis/pwcet", &[]),
    ("analysis/hir", &["mauve-syntax", "mauve-timing"]),
    // `observed` compares recordings, which `pwcet` reads, with a model.
    ("analysis/wcrt", &["mauve-syntax", "mauve-timing", "mauve-pwcet", "mauve-hir"]),
    // Checks certificates: shares no code with the analysis that it checks.
    ("analysis/verify", &[]),
    ("analysis/diagnostics", &["mauve-syntax", "mauve-timing", "mauve-pwcet", "mauve-hir", "mauve-wcrt"]),
    ("analysis/orocos", &["mauve-syntax", "mauve-timing", "mauve-hir", "mauve-wcrt", "mauve-diagnostics"]),
    (
        "analysis/ide",
        &["mauve-syntax", "mauve-timing", "mauve-pwcet", "mauve-hir", "mauve-wcrt", "mauve-diagnostics"],
    ),
    (
        "server/projects",
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
    (
        "server/cli",
        &[
            "mauve-syntax",
            "mauve-timing",
            "mauve-pwcet",
            "mauve-hir",
            "mauve-wcrt",
            "mauve-verify",
            "mauve-diagnostics",
            "mauve-orocos",
            "mauve-ide",
            "mauve-projects",
        ],
    ),
    (
        "server/lsp",
        &[
            "mauve-syntax",
            "mauve-timing",
            "mauve-hir",
            "mauve-wcrt",
            "mauve-diagnostics",
            "mauve-orocos",
            "mauve-ide",
            "mauve-projects",
        ],
    ),
    ("server", &["mauve-projects", "mauve-cli", "mauve-lsp"]),
    ("editors/tree-sitter", &[]),
    ("tests", &[]),
    ("tests/fuzz", &[]),
];

/// The crates without messages, each with its modules that contain English literals for other reasons.
///
/// The tables of keys document them for completion and schema. In `orocos`, `cpp_name` lists reserved words, and the others write
/// sentences into generated files. A literal for a file cannot be told apart from a message, so these modules are not checked;
/// those that find problems, and compare packages with a folder, are.
const WITHOUT_PROSE: [(&str, &[&str]); 6] = [
    ("syntax", &[]),
    ("analysis/pwcet", &[]),
    ("analysis/timing", &["observed", "table::keys"]),
    ("analysis/hir", &["activity_field", "config::keys"]),
    ("analysis/wcrt", &[]),
    (
        "analysis/orocos",
        &[
            "codels",
            "component::header",
            "component::obvious",
            "component::source",
            "cpp_name",
            "deployment",
            "generated_file",
            "runtime",
            "script",
            "standalone::messages",
            "standalone::program",
            "stubs",
        ],
    ),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// Returns a source up to its first module of tests.
fn without_tests(text: &str) -> &str {
    let is_module = |(at, _): &(usize, &str)| {
        let item = text[*at..].lines().find(|line| !line.starts_with("#["));
        item.is_some_and(|line| line.contains("mod ") && line.ends_with('{'))
    };
    text.match_indices("#[cfg(test)]\n").find(is_module).map_or(text, |(at, _)| &text[..at])
}

/// Returns the sources of a crate by module path (`names`, `config::cpp`), without comments and tests.
fn sources(krate: &str) -> BTreeMap<String, String> {
    let folder = root().join(krate).join("src");
    let mut found = BTreeMap::new();
    for path in mauve_tests::files_in(&folder)
        .into_iter()
        .filter(|path| path.extension().is_some_and(|it| it == "rs") && !path.ends_with("tests.rs"))
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

/// Returns the words of a text and the characters between them; `::` is one.
fn tokens(text: &str) -> Vec<&str> {
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    let mut found = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = match first {
            ':' if rest.starts_with("::") => 2,
            first if is_word(first) => rest.find(|letter| !is_word(letter)).unwrap_or(rest.len()),
            first => first.len_utf8(),
        };
        found.push(&rest[..length]);
        rest = rest[length..].trim_start();
    }
    found
}

/// Reads the paths at the beginning of `rest`, each after `prefix` and with its name: `a::{b, c as d}` has `a::b` and `a::c`, which
/// is named `d`.
fn read_paths<'a>(rest: &mut &[&'a str], prefix: &[&'a str], found: &mut Vec<(Vec<&'a str>, &'a str)>) {
    let mut path = prefix.to_vec();
    while let [first, behind @ ..] = *rest {
        *rest = behind;
        if *first == "{" {
            while !matches!(rest.first(), None | Some(&"}")) {
                read_paths(rest, &path, found);
                *rest = rest.strip_prefix(&[","]).unwrap_or(rest);
            }
            *rest = rest.strip_prefix(&["}"]).unwrap_or(rest);
            return;
        }
        path.push(first);
        let Some(behind) = rest.strip_prefix(&["::"]) else { break };
        *rest = behind;
    }
    // `a::{self}` is `a`.
    path.pop_if(|last| *last == "self" && !prefix.is_empty());
    let mut name = path.last().copied().unwrap_or_default();
    if let ["as", other, behind @ ..] = *rest {
        (name, *rest) = (other, behind);
    }
    found.push((path, name));
}

/// The paths in a module.
#[derive(Default)]
struct Paths<'a> {
    /// The imported names, each with its path.
    imported: BTreeMap<&'a str, Vec<&'a str>>,
    /// The paths that the module needs: not those that it only exports again.
    needed: BTreeSet<Vec<&'a str>>,
}

impl<'a> Paths<'a> {
    fn of(text: &'a str) -> Paths<'a> {
        let tokens = tokens(text);
        let (mut rest, mut before) = (tokens.as_slice(), "");
        let (mut paths, mut words, mut exported) = (Paths::default(), BTreeSet::new(), Vec::new());
        while let [first, behind @ ..] = rest {
            if rest.starts_with(&["pub", "(", "in"]) {
                // The path of a visibility imports nothing.
                rest = &rest[rest.iter().position(|token| *token == ")").unwrap_or(rest.len())..];
                continue;
            }
            let is_path = behind.first() == Some(&"::") && !matches!(before, "::" | "." | "$");
            let mut found = Vec::new();
            match *first {
                "use" => {
                    rest = behind;
                    read_paths(&mut rest, &[], &mut found);
                    paths.imported.extend(found.iter().map(|(path, name)| (*name, path.clone())));
                    if matches!(before, "pub" | ")") {
                        exported.append(&mut found);
                    }
                }
                _ if is_path => read_paths(&mut rest, &[], &mut found),
                _ => rest = behind,
            }
            if *first != "use" {
                words.insert(*first);
            }
            before = first;
            paths.needed.extend(found.into_iter().map(|(path, _)| path));
        }
        let used = exported.into_iter().filter(|(_, name)| words.contains(name));
        paths.needed.extend(used.map(|(path, _)| path));
        paths
    }
}

/// Returns the module that defines the last name of a path in the module `from`; none for another crate.
fn resolve(modules: &BTreeMap<String, Paths<'_>>, from: &str, path: &[&str]) -> Option<String> {
    let (mut at, mut rest) = (from.to_owned(), path);
    while let [head, behind @ ..] = rest {
        let child = format!("{at}::{head}");
        at = match *head {
            "crate" => "crate".to_owned(),
            "self" => at,
            "super" => at.rsplit_once("::")?.0.to_owned(),
            _ if modules.contains_key(&child) => child,
            _ => {
                let imported = modules[&at].imported.get(head).filter(|path| path.first() != Some(head));
                return match imported {
                    Some(path) => resolve(modules, &at, &[path, behind].concat()),
                    // The name is of an item here, or of another crate.
                    None => (rest.len() < path.len()).then_some(at),
                };
            }
        };
        rest = behind;
    }
    Some(at)
}

/// Returns the sources of a crate by the path of their module: `crate`, `crate::names`.
fn modules(krate: &str) -> BTreeMap<String, String> {
    let path = |module: String| match module.as_str() {
        "lib" | "main" => "crate".to_owned(),
        _ => format!("crate::{module}"),
    };
    sources(krate).into_iter().map(|(module, text)| (path(module), text)).collect()
}

/// Returns the imports between modules: pairs of files.
fn imports(modules: &BTreeMap<String, String>) -> BTreeSet<(String, String)> {
    let paths: BTreeMap<String, Paths<'_>> =
        modules.iter().map(|(module, text)| (module.clone(), Paths::of(text))).collect();
    let mut found = BTreeSet::new();
    for (module, of_module) in &paths {
        // In a module within a file, `super` is the file.
        let needed = of_module.needed.iter().filter(|path| !matches!(path.as_slice(), ["super", "*"]));
        let others = needed.filter_map(|path| resolve(&paths, module, path)).filter(|other| other != module);
        found.extend(others.map(|other| (module.clone(), other)));
    }
    found
}

/// Returns the imports between files. A file with `use super::*` continues its parent: the two are one.
fn between_files(
    imports: &BTreeSet<(String, String)>,
    modules: &BTreeMap<String, String>,
) -> BTreeSet<(String, String)> {
    let continues = |module: &str| modules[module].contains("\nuse super::*;");
    let whole = |module: &String| {
        let mut module = module.as_str();
        while let Some((parent, _)) = module.rsplit_once("::").filter(|_| continues(module)) {
            module = parent;
        }
        module.to_owned()
    };
    imports.iter().map(|(from, to)| (whole(from), whole(to))).filter(|(from, to)| from != to).collect()
}

/// Returns the imports between the modules of each folder at this depth. A module has the imports of the files below it.
fn between_siblings(imports: &BTreeSet<(String, String)>, depth: usize) -> BTreeSet<(String, String)> {
    let of = |(from, to): &(String, String)| {
        let [from, to] = [from, to].map(|module| module.split("::").collect::<Vec<_>>());
        let [from, to] = [from.get(..=depth)?, to.get(..=depth)?];
        let are_siblings = from != to && from[..depth] == to[..depth];
        are_siblings.then(|| (from.join("::"), to.join("::")))
    };
    imports.iter().filter_map(of).collect()
}

/// Returns a circle of imports, if there is one.
fn circle(mut imports: BTreeSet<(String, String)>) -> Option<String> {
    // Repeatedly removes the imports of modules that import none. The others lead to a circle.
    loop {
        let importing: BTreeSet<String> = imports.iter().map(|(from, _)| from.clone()).collect();
        let before = imports.len();
        imports.retain(|(_, to)| importing.contains(to));
        if imports.len() == before {
            break;
        }
    }
    let mut way = vec![&imports.first()?.0];
    loop {
        let (_, next) = imports.iter().find(|(from, _)| Some(&from) == way.last())?;
        let begin = way.iter().position(|it| *it == next);
        way.push(next);
        if let Some(begin) = begin {
            return Some(way[begin..].iter().map(|it| it.as_str()).collect::<Vec<_>>().join(" → "));
        }
    }
}

#[test]
fn no_modules_import_each_other() {
    let is_ours = |krate: &&str| !krate.starts_with("editors") && !krate.starts_with("tests");
    let mut circles = BTreeSet::new();
    for krate in MAP.map(|(krate, _)| krate).into_iter().filter(is_ours) {
        let modules = modules(krate);
        let imports = imports(&modules);
        let folders = (1..6).map(|depth| between_siblings(&imports, depth));
        let all = folders.chain([between_files(&imports, &modules)]);
        circles.extend(all.filter_map(circle).map(|circle| format!("{krate}: {circle}")));
    }
    assert!(circles.is_empty(), "modules import each other: {circles:#?}");
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
