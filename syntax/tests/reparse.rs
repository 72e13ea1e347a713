//! Any edit of any text: what is made of it in a hurry is what a full parse makes of it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::HashMap;

use mauve_syntax::{Parse, Tier, lex, parse};
use mauve_tests::{Random, generated_project, models};

/// How many edits are made in each kind of text; `REPARSE_EDITS` makes them more.
fn edits() -> usize {
    std::env::var("REPARSE_EDITS").ok().and_then(|count| count.parse().ok()).unwrap_or(1500)
}

/// What is put into a text: what the parser knows, and what the lexer stumbles over.
const PIECES: &[&str] = &[
    "a",
    "b",
    "x1",
    "_",
    "e",
    "if",
    "to",
    "in",
    "S",
    "0",
    "1",
    "9",
    ".",
    "0x",
    "1.5",
    "1e-3",
    "5ms",
    "\"",
    "\"s\"",
    "\"\\q\"",
    "\\",
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    ",",
    ";",
    ":",
    "::",
    "->",
    "-",
    ">",
    "=",
    "==",
    "<",
    "!",
    "&",
    "&&",
    "|",
    "+",
    "*",
    "/",
    "/*",
    "*/",
    "//",
    "/* c */",
    "// c\n",
    "\n",
    "\n",
    "\n  ",
    "\r\n",
    "\r",
    " ",
    "  ",
    "\t",
    "é",
    "§",
    "#",
    "\u{feff}",
    "\0",
    "𝄞",
    "{ }",
    "= { }",
    "();",
    " = 1;",
    "x = 1;",
    "f(a, b);",
    "f(a",
    "if a then { } else { }",
    "if a then {",
    "else",
    "} else {",
    "else if b then { }",
    "return x;",
    "return",
    "var v: int = 0;",
    "var v:",
    "include \"a.mal\"",
    "include",
    "library L {",
    "library",
    "use m",
    "use",
    "codel f(a: int): int",
    "codel f(",
    "shell S { }",
    "shell S extends T {",
    "property p: int = 1",
    "property p.q = 2",
    "input port i: int",
    "output port",
    "core C(S) {",
    "core C(S) { update = { f(); } }",
    "handler h: o",
    "provide f(): int",
    "provide f() = { }",
    "configure = { }",
    "update = {",
    "stop",
    "statemachine {",
    "initial state A { }",
    "initial",
    "state B {",
    "state B { }",
    "entry = { }",
    "run = { f(); }",
    "exit =",
    "transition t to B",
    "transition t if x to",
    "component C(S, T)",
    "architecture A {",
    "architecture A",
    "instance i: C",
    "instance i:",
    "connection a.b -> c.d",
    "connection a.b ->",
    "import l.A",
    "operation a.b -> c.d",
    "deployment D {",
    "activity a { priority = 1 period = 10 }",
    "activity a {",
    "period = 10",
    "deadline =",
    "true",
    "new_data",
    "background",
];

/// Some text, made longer and shorter at random places, with what was reached on the way.
struct Session {
    random: Random,
    text: String,
    parse: Parse,
    tiers: HashMap<Tier, usize>,
}

impl Session {
    fn new(seed: u64, text: &str) -> Session {
        let random = Random(seed);
        Session { random, text: text.to_owned(), parse: parse(text), tiers: HashMap::new() }
    }

    fn becomes(&mut self, text: String) {
        let (found, tier) = self.parse.reparse_by(&self.text, &text);
        let wanted = parse(&text);
        if found != wanted {
            let edit = (0..text.len().min(self.text.len()))
                .take_while(|&at| text.as_bytes()[at] == self.text.as_bytes()[at])
                .count();
            panic!(
                "{tier:?}: differs after the edit at {edit} of {:?}\nto {text:?}\n{}",
                self.text,
                difference(&found.debug_dump(), &wanted.debug_dump())
            );
        }
        *self.tiers.entry(tier).or_default() += 1;
        self.text = text;
        self.parse = found;
    }

    /// A place between two characters.
    fn place(&mut self) -> usize {
        let mut at = self.random.below(self.text.len() + 1);
        while !self.text.is_char_boundary(at) {
            at -= 1;
        }
        at
    }

    fn replace(&mut self, range: std::ops::Range<usize>, with: &str) {
        let mut text = self.text.clone();
        text.replace_range(range, with);
        self.becomes(text);
    }

    fn random_edit(&mut self) {
        let at = self.place();
        let piece = *self.random.of(PIECES);
        match self.random.below(10) {
            0 | 1 => self.replace(at..at, piece),
            2 => self.replace(at..at, &format!("\n{piece}\n")),
            // One character less.
            3 => {
                let end = self.text[at..].chars().next().map_or(at, |letter| at + letter.len_utf8());
                self.replace(at..end, "");
            }
            // One token less, or another.
            4..=6 => {
                let lexed = lex(&self.text);
                let range = lexed.range(self.random.below(lexed.len()));
                let with = ["", piece, "y", " "][self.random.below(4)];
                self.replace(range, with);
            }
            // One line less, or twice.
            7 => {
                let start = self.text[..at].rfind('\n').map_or(0, |at| at + 1);
                let end = self.text[at..].find('\n').map_or(self.text.len(), |length| at + length + 1);
                let with =
                    if self.random.below(2) == 0 { String::new() } else { self.text[start..end].repeat(2) };
                self.replace(start..end, &with);
            }
            // From anywhere to somewhere near.
            8 => {
                let mut end = (at + self.random.below(60)).min(self.text.len());
                while !self.text.is_char_boundary(end) {
                    end -= 1;
                }
                self.replace(at..end, piece);
            }
            // Typed, and taken back.
            _ => {
                let mut end = at;
                for letter in piece.chars() {
                    self.replace(end..end, letter.encode_utf8(&mut [0; 4]));
                    end += letter.len_utf8();
                }
                if self.random.below(3) > 0 {
                    self.replace(at..end, "");
                }
            }
        }
    }

    fn counts(&self, tier: Tier) -> usize {
        self.tiers.get(&tier).copied().unwrap_or_default()
    }
}

fn difference(found: &str, wanted: &str) -> String {
    let same = found.lines().zip(wanted.lines()).take_while(|(a, b)| a == b).count();
    let part = |text: &str| text.lines().skip(same.saturating_sub(3)).take(12).collect::<Vec<_>>().join("\n");
    format!("found\n{}\nwanted\n{}", part(found), part(wanted))
}

/// Edits `text` again and again, from the beginning after each `length` edits, and asks that each tier was taken often.
fn edited(seed: u64, texts: &[String], length: usize) {
    let mut tiers: HashMap<Tier, usize> = HashMap::new();
    let mut random = Random(seed);
    for _ in 0..edits().div_ceil(length) {
        let text = random.of(texts).clone();
        let mut session = Session::new(random.0, &text);
        random.below(1);
        for _ in 0..length {
            session.random_edit();
        }
        for tier in [Tier::Token, Tier::Items, Tier::Whole] {
            *tiers.entry(tier).or_default() += session.counts(tier);
        }
    }
    let all: usize = tiers.values().sum();
    println!("{tiers:?}");
    for (tier, count) in &tiers {
        assert!(*count > all / 50, "{tier:?} was taken {count} times of {all}");
    }
}

#[test]
fn edits_of_real_models() {
    let mut texts = Vec::new();
    let mut folders = vec![models()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "mal") {
                texts.push(std::fs::read_to_string(path).unwrap());
            }
        }
    }
    texts.sort();
    assert!(texts.len() > 5);
    edited(1, &texts, 12);
}

#[test]
fn edits_of_generated_models() {
    let texts: Vec<String> = generated_project(4, 200)
        .into_iter()
        .filter(|(path, _)| path.ends_with(".mal"))
        .map(|(_, text)| text)
        .collect();
    edited(2, &texts, 12);
}

#[test]
fn edits_of_any_pieces() {
    let mut random = Random(3);
    let mut texts = Vec::new();
    for _ in 0..100 {
        let pieces: Vec<&str> = (0..60).map(|_| *random.of(PIECES)).collect();
        texts.push(pieces.join([" ", "\n"][random.below(2)]));
    }
    edited(4, &texts, 8);
}
