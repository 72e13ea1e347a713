//! Random texts near to models: bytes, characters, tokens and lines of models and tables are deleted, doubled, swapped or
//! put in, files are cut, nested without end, or run together with others. Whatever comes of it, the tree's text is the file's
//! text, nothing panics, and every diagnostic stands between two characters of its file.
//!
//! `MAUVE_MUTANTS=100000 cargo test --release -p mauve-diagnostics --test main mutations::` tries more, `MAUVE_SEED=7` others.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use mauve_diagnostics::workspace_diagnostics;
use mauve_hir::{Database, Location, Workspace};
use mauve_tests::{Random, char_boundary, random_model, texts_in};

/// What is put in: words of the language, and what makes the rest of a text something else.
const JUNK: [&str; 60] = [
    "include",
    "library",
    "use",
    "codel",
    "shell",
    "extends",
    "constant",
    "property",
    "input port",
    "output",
    "require",
    "provide",
    "core",
    "var",
    "handler",
    "configure",
    "update",
    "statemachine",
    "initial state",
    "transition",
    "if",
    "then",
    "else",
    "return",
    "component",
    "architecture",
    "import",
    "instance",
    "connection",
    "operation",
    "deployment",
    "activity",
    "priority",
    "background",
    "in",
    "inout",
    "true",
    "new_data",
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    ";",
    ":",
    "::",
    ".",
    ",",
    "->",
    "=",
    "==",
    "\"",
    "/*",
    "*/",
    "//",
    "\\",
    "0x",
    "1e",
    "99999999999999999999",
];
const LETTERS: [&str; 14] = [
    "§", "é", "日本", "🤖", "e\u{301}", "\u{feff}", "\u{200d}", "\u{2028}", "\0", "\r", "\t", "\r\n", "'",
    "\u{a0}",
];

#[test]
fn mutants_neither_panic_nor_lose_a_byte() {
    let number =
        |name: &str, otherwise| std::env::var(name).map_or(otherwise, |it| it.parse().expect("a number"));
    let (mutants, seed): (u64, u64) = (number("MAUVE_MUTANTS", 1500), number("MAUVE_SEED", 1));
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let samples: Vec<Vec<(PathBuf, String)>> =
        ["p3dx", "p3dx_entry"].map(|name| texts_in(&mauve_tests::models().join(name))).into();
    let mut done = 0;
    while done < mutants {
        let texts = match random.below(4) {
            0 => random.of(&samples).clone(),
            _ => random_model(random.below(1 << 20) as u64).texts(),
        };
        let folder =
            texts.iter().find(|it| it.0.ends_with("mauve.toml")).unwrap().0.parent().unwrap().to_owned();
        let mut db = Database::default();
        let workspace = Workspace::of_texts(&db, folder, texts.iter().cloned());
        for _ in 0..25.min(mutants - done) {
            done += 1;
            let (path, text) = random.of(&texts);
            let mut mutant = text.clone();
            for _ in 0..1 + random.below(4) {
                let other = &random.of(&texts).1;
                mutant = mutated(&mutant, other, &mut random);
            }
            let anew = check_tree(&mutant);
            let file = workspace.file(&db, path).unwrap();
            file.set_text(&mut db, mutant.as_str().into());
            // The database makes it from the tree before.
            let tree = mauve_hir::parse(&db, file);
            assert!(*tree == anew, "mutant {done} of seed {seed}: another tree than parsed anew:\n{mutant}");
            let checked = catch_unwind(AssertUnwindSafe(|| check_diagnostics(&db, workspace)));
            assert!(checked.is_ok(), "mutant {done} of seed {seed}, {}:\n{mutant}", path.display());
            // Most of the time what is wrong is mended; else it gathers.
            if random.below(4) > 0 {
                file.set_text(&mut db, text.as_str().into());
            }
        }
    }
}

fn check_tree(text: &str) -> mauve_syntax::Parse {
    let parse = catch_unwind(|| mauve_syntax::parse(text));
    let Ok(parse) = parse else { panic!("the parser panics:\n{text}") };
    assert!(parse.syntax().text() == text, "the tree has another text:\n{text}");
    parse
}

fn check_diagnostics(db: &Database, workspace: Workspace) {
    for finding in workspace_diagnostics(db, workspace) {
        let diagnostic = &finding.diagnostic;
        let mut places: Vec<&Location<'_>> = vec![&diagnostic.at];
        places.extend(diagnostic.related.iter().map(|(at, _)| at));
        places.extend(diagnostic.fixes.iter().flat_map(|fix| fix.edits.iter().map(|(at, _)| at)));
        for place in places {
            let (range, text) = (place.range(db), place.file(db).text(db));
            let lies = text.get(usize::from(range.start())..usize::from(range.end())).is_some();
            assert!(lies, "{}: {range:?} of {} bytes", diagnostic.code.name, text.len());
        }
    }
}

fn mutated(text: &str, other: &str, random: &mut Random) -> String {
    match random.below(10) {
        0 => of_bytes(text, random),
        1 => of_characters(text, random),
        2..=5 => of_tokens(text, other, random),
        6 | 7 => of_lines(text, other, random),
        8 => match random.below(3) {
            0 => text[..boundary(text, random)].to_owned(),
            1 => text[boundary(text, random)..].to_owned(),
            _ => {
                let at = boundary(text, random);
                let nested = *random.of(&[
                    "{",
                    "(",
                    "if a then {",
                    "} else {",
                    "a + ",
                    "!",
                    "-",
                    "f(",
                    "/*",
                    "library x {",
                ]);
                format!("{}{}{}", &text[..at], nested.repeat(1 + random.below(600)), &text[at..])
            }
        },
        // Two that run together.
        _ => format!("{}{}", &text[..boundary(text, random)], &other[boundary(other, random)..]),
    }
}

/// Somewhere between two characters.
fn boundary(text: &str, random: &mut Random) -> usize {
    char_boundary(text, random.below(text.len() + 1))
}

/// What is no UTF-8 any more comes as the loader would read it.
fn of_bytes(text: &str, random: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len().max(1));
        match random.below(3) {
            _ if bytes.is_empty() => {}
            0 => bytes[at] = random.below(256) as u8,
            1 => bytes.insert(at, random.below(256) as u8),
            _ => {
                bytes.remove(at);
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn of_characters(text: &str, random: &mut Random) -> String {
    let at = boundary(text, random);
    let (before, behind) = text.split_at(at);
    let mut letters = behind.chars();
    match (random.below(4), letters.next()) {
        (0, Some(_)) => format!("{before}{}", letters.as_str()),
        (1, Some(letter)) => format!("{before}{letter}{behind}"),
        (2, Some(letter)) => {
            let mut rest = letters.clone();
            let next = rest.next().map(String::from).unwrap_or_default();
            format!("{before}{next}{letter}{}", rest.as_str())
        }
        _ => format!("{before}{}{behind}", random.of(&LETTERS)),
    }
}

fn of_tokens(text: &str, other: &str, random: &mut Random) -> String {
    let token = |text: &str, random: &mut Random| {
        let lexed = mauve_syntax::lex(text);
        if lexed.is_empty() { 0..0 } else { lexed.range(random.below(lexed.len())) }
    };
    let (one, two) = (token(text, random), token(text, random));
    let (first, last) = if one.start <= two.start { (one, two) } else { (two, one) };
    let replaced = |put: &str| format!("{}{put}{}", &text[..first.start], &text[first.end..]);
    match random.below(6) {
        0 => replaced(""),
        1 => replaced(&text[first.clone()].repeat(2)),
        2 => replaced(random.of::<&str>(&JUNK)),
        3 => replaced(&format!("{} {} ", &text[first.clone()], random.of::<&str>(&JUNK))),
        4 => replaced(&other[token(other, random)]),
        _ if first.end > last.start => text.to_owned(),
        _ => [
            &text[..first.start],
            &text[last.clone()],
            &text[first.end..last.start],
            &text[first.clone()],
            &text[last.end..],
        ]
        .concat(),
    }
}

fn of_lines(text: &str, other: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let others: Vec<&str> = other.split_inclusive('\n').collect();
    let (one, two) = (random.below(lines.len().max(1)), random.below(lines.len().max(1)));
    match random.below(5) {
        _ if lines.is_empty() || others.is_empty() => {}
        0 => {
            lines.remove(one);
        }
        1 => lines.insert(two, lines[one]),
        2 => lines.swap(one, two),
        3 => lines[one] = lines[one].trim_end(),
        _ => lines.insert(one, random.of::<&str>(&others)),
    }
    lines.concat()
}
