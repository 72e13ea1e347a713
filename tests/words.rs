//! Texts that users read avoid riddles: messages, pages, help, documentation and the comments in generated files use the
//! terms of the field.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};

use mauve_tests::sources;

/// A wording that no text for users has.
struct Avoided {
    /// The words that follow each other, in lower case, with `|` between alternatives for one word.
    words: &'static str,
    /// What a text says instead.
    instead: &'static str,
    /// Longer phrases that have these words, and are plain English.
    except: &'static [&'static str],
}

const fn avoid(words: &'static str, instead: &'static str) -> Avoided {
    Avoided { words, instead, except: &[] }
}

const fn avoid_except(
    words: &'static str,
    instead: &'static str,
    except: &'static [&'static str],
) -> Avoided {
    Avoided { words, instead, except }
}

const AVOIDED: &[Avoided] = &[
    // Terms of real-time analysis.
    avoid("how late", "response time"),
    avoid("is|are|be asked for", "utilisation, overloaded; otherwise: expected, requested"),
    avoid("than there is", "overloaded"),
    avoid("urgent|urgently|urgency", "priority: higher, lower, equal"),
    avoid("load of", "utilisation of"),
    avoid("full load", "a utilisation of 100 %"),
    avoid("loaded to", "a utilisation of"),
    avoid("fully loaded", "a utilisation of 100 %"),
    avoid("takes ≤", "≤ … per period"),
    avoid("a period at most", "at most … per period"),
    avoid("what it takes", "its execution time, interference"),
    avoid("what they take", "their execution times"),
    avoid("of all together", "at the critical instant; a simultaneous release"),
    avoid("must end within", "has a deadline of"),
    avoid("disturb|disturbs nobody", "preempts no activity"),
    // Subjects that name nothing.
    avoid("nobody", "the thing that does not act: `no component`; or the passive: `unknown`"),
    avoid("whoever", "the reader, the program: by name"),
    avoid("that which", "the thing, by name"),
    avoid_except("what is", "the thing, by name", &["what is wrong", "what is new"]),
    avoid("what are", "the things, by name"),
    avoid("whatever is|has|may", "the thing, by name"),
    avoid_except("of which", "a sentence of its own", &["each of which", "both of which", "most of which"]),
    avoid("but|before|than who", "a sentence of its own"),
    avoid("and so is|are|has|have", "`both`, or the verb again"),
    avoid("such a one", "it, or its name"),
    // Names and meanings.
    avoid("meant", "refer to, intend"),
    avoid("means nothing", "is unknown, is not part of"),
    avoid("mean|means something", "refer to another"),
    avoid("stands|stand for", "refers to"),
    avoid("stands", "is, comes"),
    avoid("nameless", "unnamed"),
    // Incomplete texts.
    avoid("doubt|doubts|doubtful", "unknown, incomplete"),
    avoid("is|are|was|were|have|has|had lost", "missing, unknown, incomplete"),
    avoid("mend|mended|mends", "fix, correct"),
    avoid("is|are whole", "complete"),
    // Requests and files.
    avoid("overtaken", "outdated, cancelled"),
    avoid("put aside", "move, rename"),
    avoid("anew", "again"),
    avoid("are|is no more", "no longer"),
    // Plain English.
    avoid_except("is no", "is not a", &["there is no", "is no longer"]),
    avoid_except("are no", "are not", &["there are no", "are no longer"]),
    avoid("sees|see to it", "ensures"),
    avoid_except(
        "nothing is left out",
        "is reported as not analysed",
        // The title of a section.
        &["nothing is left out silently"],
    ),
    avoid("no way leads|back", "no path"),
    avoid("rests|rest on", "depends on"),
    avoid("belongs|belong into", "belongs in"),
    avoid("which counts", "the value in effect"),
    avoid("is|are there twice", "duplicate"),
    avoid("settle|settles", "reach a fixed point"),
    avoid("surroundings", "the context, by name"),
];

/// A text that users read: its file below the root of the repository, the line where it begins, and what it says.
type Shown = (PathBuf, usize, String);

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// Returns the files below a folder, or the file itself, whose names end in one of `ends`.
fn files(path: &str, ends: &[&str]) -> Vec<PathBuf> {
    let path = root().join(path);
    let found = match path.metadata() {
        Ok(metadata) if metadata.is_dir() => mauve_tests::files_in(&path),
        Ok(_) => vec![path],
        // The folder of a document that is not written yet.
        Err(_) => Vec::new(),
    };
    let is_shown = |path: &PathBuf| {
        let path = path.to_string_lossy();
        !path.contains("/node_modules/")
            && !path.contains("/out/")
            && ends.iter().any(|end| path.ends_with(end))
    };
    found.into_iter().filter(is_shown).collect()
}

/// Returns the string literals of the crates that write messages or files, the pages of diagnostics, and the help texts.
fn texts_in_sources() -> Vec<Shown> {
    let mut found = Vec::new();
    for folder in [
        "analysis/diagnostics/src",
        "analysis/ide/src",
        "analysis/orocos/src",
        "server/src",
        "server/cli/src",
        "server/lsp/src",
        "server/projects/src",
    ] {
        for path in files(folder, &[".rs"]) {
            let text = fs::read_to_string(&path).unwrap();
            let text = sources::without_tests(&text);
            let marker = match folder {
                "analysis/diagnostics/src" => Some("//!"),
                "server/src" | "server/cli/src" => Some("///"),
                _ => None,
            };
            let path = path.strip_prefix(root()).unwrap().to_owned();
            found.extend(sources::literals(text).into_iter().map(|(line, text)| (path.clone(), line, text)));
            if let Some(marker) = marker {
                let documented =
                    |line: &str| line.trim_start().strip_prefix(marker).unwrap_or("\"").to_owned();
                let lines: Vec<String> = text.lines().map(documented).collect();
                found.push((path, 1, lines.join("\n")));
            }
        }
    }
    found
}

/// Returns the documents, and the texts of the editors' extensions without comments of a line.
fn documents() -> Vec<Shown> {
    let markdown = [
        "README.md",
        ".github",
        "tests/spec",
        "tests/mistakes",
        "tests/tutorial",
        "editors",
        "server/README.md",
        "analysis/README.md",
    ];
    let documents = markdown.iter().flat_map(|path| files(path, &[".md", ".yml"]));
    let editors = files("editors", &["doc/mauve.txt", "vscode/package.json", ".lua", ".ts", "mauve.json"]);
    let whole = |path: PathBuf| {
        let text = fs::read_to_string(&path).unwrap();
        let lines = text.lines().map(|line| {
            let is_comment = ["--", "//", "/*", "* "].iter().any(|it| line.trim_start().starts_with(it));
            let is_code = path.extension().is_some_and(|it| it == "lua" || it == "ts");
            if is_comment && is_code { "" } else { line }
        });
        (path.strip_prefix(root()).unwrap().to_owned(), 1, lines.collect::<Vec<_>>().join("\n"))
    };
    documents.chain(editors).map(whole).collect()
}

/// Returns the words and signs of a text in lower case, each with its line. White space and ends of lines separate words
/// only, so that a phrase may be broken between lines.
fn words(text: &str, line: usize) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    for (index, text) in text.lines().enumerate() {
        for piece in text.split_whitespace() {
            let in_word = |letter: char| letter.is_alphanumeric() || ['_', '-', '\''].contains(&letter);
            let mut word = String::new();
            for letter in piece.chars() {
                if in_word(letter) {
                    word.extend(letter.to_lowercase());
                } else {
                    found.extend(
                        Some((line + index, std::mem::take(&mut word))).filter(|it| !it.1.is_empty()),
                    );
                    found.push((line + index, letter.to_string()));
                }
            }
            found.extend(Some((line + index, word)).filter(|it| !it.1.is_empty()));
        }
    }
    found
}

/// Does a phrase begin at an index of a text?
fn begins(phrase: &str, words: &[(usize, String)], at: usize) -> bool {
    let mut phrase = phrase.split(' ').enumerate();
    phrase.all(|(index, any)| {
        words.get(at + index).is_some_and(|(_, word)| any.split('|').any(|it| it == word))
    })
}

/// Returns the lines on which a text has an avoided wording.
fn findings(avoided: &Avoided, words: &[(usize, String)]) -> Vec<usize> {
    let length = avoided.words.split(' ').count();
    let is_plain = |at: usize| {
        avoided.except.iter().any(|phrase| {
            let longer = phrase.split(' ').count() - length;
            (at.saturating_sub(longer)..=at).any(|begin| begins(phrase, words, begin))
        })
    };
    let found = (0..words.len()).filter(|at| begins(avoided.words, words, *at) && !is_plain(*at));
    found.map(|at| words[at].0).collect()
}

#[test]
fn texts_for_users_are_plain() {
    let mut found = Vec::new();
    for (path, line, text) in texts_in_sources().into_iter().chain(documents()) {
        let words = words(&text, line);
        for avoided in AVOIDED {
            for line in findings(avoided, &words) {
                let file = path.to_string_lossy().replace('\\', "/");
                found.push(format!("{file}:{line}: \"{}\": {}", avoided.words, avoided.instead));
            }
        }
    }
    assert!(found.is_empty(), "{} wordings to replace:\n{}", found.len(), found.join("\n"));
}

/// Returns the text of a page without its blocks of code.
fn prose(page: &str) -> String {
    let mut is_code = false;
    let lines = page.lines().filter(|line| {
        is_code ^= line.starts_with("```");
        !is_code && !line.starts_with("```")
    });
    lines.map(|line| format!("{line}\n")).collect()
}

/// Returns the anchors of the headings of a page, as forges make them.
fn anchors(page: &str) -> Vec<String> {
    let headings = prose(page);
    let headings = headings.lines().filter(|line| line.starts_with('#'));
    let anchor = |heading: &str| -> String {
        let text = heading.trim_start_matches('#').trim().to_lowercase();
        let text = text.split("](").map(|part| part.split_once(')').map_or(part, |(_, behind)| behind));
        let text = text.collect::<String>().replace(' ', "-");
        text.chars().filter(|it| it.is_alphanumeric() || ['-', '_'].contains(it)).collect()
    };
    headings.map(anchor).collect()
}

/// Returns the targets of the links in a text that lead to files, each with its anchor.
fn links(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let targets = text.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0));
    targets.filter(|it| !it.contains(':')).map(|it| it.split_once('#').unwrap_or((it, "")))
}

#[test]
fn each_link_leads_to_a_file_and_a_heading() {
    let mut broken = Vec::new();
    // The package of the extension has its pictures beside the walkthrough.
    let is_checked = |path: &PathBuf| !path.to_string_lossy().contains("walkthrough");
    let pages = documents().into_iter().filter(|(path, ..)| path.extension().is_some_and(|it| it == "md"));
    for (path, _, text) in pages.filter(|(path, ..)| is_checked(path)) {
        let page = root().join(&path);
        for (target, anchor) in links(&prose(&text)) {
            let to = if target.is_empty() { page.clone() } else { page.parent().unwrap().join(target) };
            let has_anchor = || anchors(&fs::read_to_string(&to).unwrap()).iter().any(|it| it == anchor);
            if !to.exists() || !anchor.is_empty() && !has_anchor() {
                broken.push(format!("{}: {target}#{anchor}", path.display()));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn headings_have_the_anchors_of_forges() {
    let page = "# `a.toml`: *B* & C\n```sh\n# no heading\n```\n## [D](d.md) and e\n";
    assert_eq!(anchors(page), ["atoml-b--c", "d-and-e"]);
    let found: Vec<_> = links("[a](b.md#c) [d](https://e) ![f](g.png), [h](#i)").collect();
    assert_eq!(found, [("b.md", "c"), ("g.png", ""), ("", "i")]);
}

#[test]
fn a_wording_is_found_across_lines_and_beside_signs() {
    let of = |words_: &'static str, text: &str| findings(&avoid(words_, ""), &words(text, 1));
    assert_eq!(of("how late", "it says how\n  late it is"), [1]);
    assert_eq!(of("stands|stand for", "a\nb stands for: c, stand for"), [2, 2]);
    assert_eq!(of("is no", "is not, this is: no; is no-op"), [] as [usize; 0]);
    let is_no = avoid_except("is no", "", &["there is no", "is no longer"]);
    let lines = findings(&is_no, &words("There is no a\nit is no longer b\nc is no d", 1));
    assert_eq!(lines, [3]);
}

#[test]
fn literals_are_found_with_their_lines() {
    let text = "fn f<'a>() { // \"no\"\n  g('\"', \"a\\\n    b\", r#\"c \"d\" \"#); '\\'' }\n\"e\\\"\"";
    let found = sources::literals(text);
    let expected = [(2, "ab"), (3, "c \"d\" "), (4, "e\"")];
    assert_eq!(found, expected.map(|(line, text)| (line, text.to_owned())));
}
