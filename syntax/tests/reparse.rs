//! Any edit of any text: what is made of it in a hurry is what a full parse makes of it.

use std::collections::HashMap;

use mauve_syntax::{Parse, SyntaxError, SyntaxErrorKind, Tier, lex, parse};
use mauve_tests::{Random, char_boundary, generated_project, models, search, texts_in};

/// How many edits are made in each kind of text; `REPARSE_EDITS` makes them more.
fn edits() -> usize {
    search::cases("REPARSE_EDITS", 1500)
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
    "'",
    "'s'",
    "and",
    "not",
    "while",
    "#include \"a.mal\"",
    "#includ",
    "elif",
    "begin",
    "break",
    "when",
    "let",
    "def",
    "ms",
    "int",
    "Pose",
    "connect",
    "?",
    "+=",
    "++",
    "n += 1;",
    "n++;",
    "int n = 3;",
    "while n < 3 { f(); }",
    "for (int i = 0; i < 3; i++) { f(); }",
    "if a then f(); else g();",
    "} elif b {",
    "transition to A",
    "transition go when x -> A",
    "a.b -> c.d",
    "priority = 1, period = 33 ms,",
    "in port p: pkg/T",
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
    /// Where the last edit was.
    at: usize,
    tiers: HashMap<Tier, usize>,
}

impl Session {
    fn new(seed: u64, text: &str) -> Session {
        let random = Random(seed);
        Session { random, text: text.to_owned(), parse: parse(text), at: 0, tiers: HashMap::new() }
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

    /// A place between two characters, often near the last one.
    fn place(&mut self) -> usize {
        let at = match self.random.below(2) {
            0 => self.random.below(self.text.len() + 1),
            _ => (self.at + self.random.below(30)).saturating_sub(15),
        };
        char_boundary(&self.text, at)
    }

    fn replace(&mut self, range: std::ops::Range<usize>, with: &str) {
        self.at = range.start;
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
                let near = (0..lexed.len()).take_while(|&index| lexed.range(index).end <= at).count();
                let range = lexed.range(near);
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
                let end = char_boundary(&self.text, at + self.random.below(60));
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
fn edited(seed: u64, texts: &[String], edits: usize, length: usize) {
    let mut tiers: HashMap<Tier, usize> = HashMap::new();
    let mut random = Random(seed + (search::seed() << 8));
    for _ in 0..edits.div_ceil(length) {
        let text = random.of(texts).clone();
        let mut session = Session::new(random.0, &text);
        for _ in 0..length {
            session.random_edit();
        }
        for tier in [Tier::Token, Tier::Trivia, Tier::Items, Tier::Whole] {
            *tiers.entry(tier).or_default() += session.counts(tier);
        }
    }
    let all: usize = tiers.values().sum();
    println!("{tiers:?}");
    for (tier, count) in &tiers {
        // Few edits are of white space alone.
        let least = if *tier == Tier::Trivia { all / 500 } else { all / 50 };
        assert!(*count > least, "{tier:?} was taken {count} times of {all}");
    }
}

/// Lines of conflicts come, change and go, between comments and items.
#[test]
fn edits_of_conflicts() {
    const LINES: [&str; 14] = [
        "<<<<<<< a",
        "<<<<<<< a",
        "=======",
        "=======",
        ">>>>>>> b",
        ">>>>>>> b",
        "||||||| c\r",
        "<<<<<<<a",
        " =======",
        "/* d",
        "e */",
        "use f",
        "core C(S) {",
        "}",
    ];
    let mut conflicts = 0;
    for seed in 0..60 {
        let mut session = Session::new(seed, "use a\nshell S { }\n/* b */\nuse c\ncodel f(): int\nuse g\n");
        for _ in 0..60 {
            let at = session.random.below(session.text.len() + 1);
            let start = session.text[..at].rfind('\n').map_or(0, |at| at + 1);
            let end =
                session.text[start..].find('\n').map_or(session.text.len(), |length| start + length + 1);
            match session.random.below(4) {
                0 | 1 => {
                    let line = *session.random.of(&LINES);
                    session.replace(start..start, &format!("{line}\n"));
                }
                2 => session.replace(start..end, ""),
                // One sign less, or a line less.
                _ => session.replace(start..end.min(start + 1), ""),
            }
            let is_conflict = |error: &SyntaxError| matches!(error.kind, SyntaxErrorKind::Conflict { .. });
            conflicts += usize::from(session.parse.errors().iter().any(is_conflict));
        }
        // No line of the text is a marker: one comes into it from a comment.
        session.becomes("use a /*\n=======\n*/ use b use c use d".to_owned());
        session.becomes("use a //\n=======\n*/ use b use c use d".to_owned());
        session.becomes("use a /*\n<<<<<<< e\n=======\n*/ use b use c use d".to_owned());
        session.becomes("use a /*\n<<<<<<< e\n=======\n*/ use b use c\n>>>>>>> f\nuse d".to_owned());
    }
    assert!(conflicts > 500, "{conflicts} texts with conflicts");
}

/// Each pair shows one thing that must be looked at, in both directions.
#[test]
fn edits_that_reach_further_than_they_seem() {
    let program = |program: &str| {
        format!("core C(S) {{ update = {{ a(); b(); {program} c(); d(); e(); }} }} use m use n")
    };
    let file = |text: &str| format!("use a use b use c {text} use d use e use f use g");
    let pairs = [
        // The first tokens of an item decide where the one before ends.
        (program("if a then { } else  = 3;"), program("if a then { } else  { }")),
        (program("{ } § return = x;"), program("{ } § return x;")),
        (file("§ x shell S  { } use h"), file("§ x shell S  ; } use h")),
        (file("§ x codel f  (): int use h"), file("§ x codel f  {): int use h")),
        // Of numbers the lexer looks further than they go.
        (program("x = 1e-3;"), program("x = 1e- 3;")),
        (program("x = 1.5;"), program("x = 1. 5;")),
        (program("x = 1.5e+3;"), program("x = 1.5e+ 3;")),
        // A line that begins an item of the list around ends this one.
        (program("f(); update = { }"), program("f();\nupdate = { }")),
        (program("return f(); x = 1;"), program("return\nx = 1;")),
        (program("f() x = 1;"), program("f() /* \n */ x = 1;")),
        (file("include /* */ \"a\" use h"), file("include /* \n */ \"a\" use h")),
        // A forgotten separator is reported at the next item.
        (program("f(); g();"), program("f() g();")),
        (program("f() g(); h();"), program("f() k(); h();")),
        (program("f(\"a\"); g();"), program("f(\"a); g();")),
        (program("f(); \"a\n 5ms; g();"), program("f(); \"a\n 5m; g();")),
        (program("f(); \"a\n 5ms; g( h);"), program("f(); \"a\n 5ms; g( h h);")),
        (program("f(); \"a\n 5ms; g(); h();"), program("f(); 1;\n 5ms; g(); h();")),
        (program("f(); \"a\n g(h); g();"), program("f(); \"a\n g(); g();")),
        // A word stands in the message about it, and what it may have meant.
        (file("staet use h"), file("shel use h")),
        (program("f(a b);"), program("f(a c);")),
        (program("x = \"\\n\";"), program("x = \"\\q\";")),
        // Stray characters join.
        (program("f(); § g();"), program("f(); §§ g();")),
        (program("f(); § & g(); h();"), program("f(); §& g(); h();")),
        (file("use x § \u{feff} use h use i use j"), file("use x § \u{feff} use h use i use jj")),
        ("\u{feff}use a use b".to_owned(), " use a use b".to_owned()),
        // What swallows the rest, and what no longer does.
        (program("f(); /* g(); */"), program("f(); /* g();")),
        (program("f(); // g();\n h();"), program("f(); // g(); h();")),
        (file("shell S { } use h"), file("shell S { use h")),
        (file("shell S { }"), file("shell S }")),
        ("use a use b use c /*".to_owned(), "use a use b use cc /*".to_owned()),
        ("use a use b use c shell S {".to_owned(), "use a use b use c shell S { x".to_owned()),
        // Where an include may stand.
        (file("include \"a\" include \"b\""), file("include \"a\" use x include \"b\"")),
        ("include \"a\" include \"b\"".to_owned(), "include \"a\" use x include \"b\"".to_owned()),
        ("include \"a\" § include \"b\"".to_owned(), "include \"a\" use x include \"b\"".to_owned()),
    ];
    for (one, other) in pairs {
        let mut session = Session::new(1, &one);
        for text in [&other, &one, &other] {
            session.becomes(text.clone());
        }
    }
}

#[test]
fn edits_of_real_models() {
    let models =
        texts_in(&models()).into_iter().filter(|(path, _)| path.extension().is_some_and(|it| it == "mal"));
    let mut texts: Vec<String> = models.map(|(_, text)| text).collect();
    texts.sort();
    assert!(texts.len() > 5);
    edited(1, &texts, edits(), 12);
}

#[test]
fn edits_of_generated_models() {
    let texts: Vec<String> = generated_project(4, 200)
        .into_iter()
        .filter(|(path, _)| path.ends_with(".mal"))
        .map(|(_, text)| text)
        .collect();
    edited(2, &texts, edits(), 12);
}

/// At the cap on depth an error depends on all the blocks around it.
#[test]
fn edits_of_deep_blocks() {
    let deep = |open: &str, close: &str, count: usize| {
        let (open, close) = (open.repeat(count), close.repeat(count));
        format!(
            "core C(S) {{ update = {{\n f(); {open}\n f(); g(); x = (a + b); h();\n{close} f(); }} }}\nuse m\n"
        )
    };
    let mut texts = Vec::new();
    for count in [126, 127, 253, 254, 255, 256] {
        texts.push(deep("{ f(); g();\n", "f(); }\n", count));
        texts.push(deep("if a then { f(); g(); ", "} else { f(); }\n", count));
        texts.push(deep("if a then { } else ", "{ f(); g(); }\n", count));
        texts.push(deep("if a then { } else if b then {\nf(); g(); ", "} f();\n", count));
    }
    // Fewer edits would not reach each tier often enough.
    edited(5, &texts, edits() * 5 / 8, 4);
}

#[test]
fn edits_of_any_pieces() {
    let mut random = Random(3);
    let mut texts = Vec::new();
    for _ in 0..100 {
        let pieces: Vec<&str> = (0..60).map(|_| *random.of(PIECES)).collect();
        texts.push(pieces.join([" ", "\n"][random.below(2)]));
    }
    edited(4, &texts, edits(), 8);
}
