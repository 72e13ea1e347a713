//! Any text: formatting changes white space and nothing else, and once is enough.

use std::cell::Cell;
use std::fmt::Write as _;

use mauve_syntax::format::{Replacement, applied, format, format_on_type, format_range, formatted};
use mauve_syntax::{NodeOrToken, Parse, SyntaxErrorKind, SyntaxKind, TextRange, TextSize, WalkEvent, parse};
use mauve_tests::{char_boundary, models, texts_in};
use proptest::prelude::*;

/// A tree without its white space and without places: nodes, tokens, and what is wrong. Comments are by themselves, since
/// whose node they stand in is nobody's business.
fn meaning(parse: &Parse) -> (String, Vec<String>, Vec<SyntaxErrorKind>) {
    let (mut tree, mut comments) = (String::new(), Vec::new());
    for event in parse.syntax().preorder_with_tokens() {
        match event {
            WalkEvent::Enter(NodeOrToken::Node(node)) => writeln!(tree, "{:?} {{", node.kind()).unwrap(),
            WalkEvent::Enter(NodeOrToken::Token(token)) => match token.kind() {
                SyntaxKind::WHITESPACE => {}
                SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT => {
                    comments.push(token.text().to_owned())
                }
                kind => writeln!(tree, "{kind:?} {}", token.text()).unwrap(),
            },
            WalkEvent::Leave(NodeOrToken::Node(_)) => tree += "}\n",
            WalkEvent::Leave(_) => {}
        }
    }
    (tree, comments, parse.errors().iter().map(|error| error.kind).collect())
}

/// For each comment, whether something other than comments stands before it on its line.
fn trailing(text: &str) -> Vec<bool> {
    let lexed = mauve_syntax::lex(text);
    let mut found = Vec::new();
    let mut follows = false;
    for index in 0..lexed.len() {
        let token = &text[lexed.range(index)];
        match lexed.kind(index) {
            SyntaxKind::WHITESPACE => follows &= !token.contains(['\n', '\r']),
            SyntaxKind::LINE_COMMENT => found.push(follows),
            SyntaxKind::BLOCK_COMMENT => follows &= !token.contains(['\n', '\r']),
            _ => follows = true,
        }
    }
    found
}

fn check(text: &str) {
    let before = parse(text);
    let replacements = format(&before, &|| ());
    let tidy = applied(text, &replacements);
    assert_eq!(tidy, formatted(text));
    let after = parse(&tidy);
    assert_eq!(meaning(&after), meaning(&before), "\n{text}\n--- became ---\n{tidy}\n---");
    assert_eq!(trailing(&tidy), trailing(text), "a comment has moved: \n{text}\n--- became ---\n{tidy}\n---");
    assert_eq!(formatted(&tidy), tidy, "once is not enough:\n{text}\n--- became ---\n{tidy}\n---");
    in_order(text, &replacements);
    // An editor may ask for some of it.
    let end = TextSize::of(text);
    assert_eq!(format_range(&before, TextRange::up_to(end), &|| ()), replacements);
}

/// Replacements of white space, one after the other.
fn in_order(text: &str, replacements: &[Replacement]) {
    let mut end = TextSize::new(0);
    for it in replacements {
        assert!(it.range.start() >= end, "{replacements:?}");
        end = it.range.end();
        let old = &text[std::ops::Range::<usize>::from(it.range)];
        assert_ne!(old, it.text);
        let is_white =
            |text: &str| text.chars().all(|letter| matches!(letter, ' ' | '\t' | '\x0C' | '\r' | '\n'));
        assert!(is_white(old) && is_white(&it.text), "{it:?}");
    }
}

/// The lines from the one of `from` to the one of `to` are formatted, and no other.
fn check_range(text: &str, from: usize, to: usize) {
    let range = TextRange::new(TextSize::new(from as u32), TextSize::new(to as u32));
    let before = parse(text);
    let some = format_range(&before, range, &|| ());
    let all = format(&before, &|| ());
    assert!(some.iter().all(|it| all.contains(it)), "{some:?} of {all:?}");
    let start = text[..from].rfind(['\n', '\r']).map_or(0, |at| at + 1);
    let end = to + text[to..].find(['\n', '\r']).unwrap_or(text.len() - to);
    for it in &some {
        assert!(
            usize::from(it.range.start()) >= start && usize::from(it.range.end()) <= end,
            "{text:?} {it:?}"
        );
    }
    assert_eq!(meaning(&parse(&applied(text, &some))), meaning(&before), "{text}");
}

fn check_typing(text: &str, at: usize) {
    let Some(typed) = text[..at].chars().next_back() else { return };
    let before = parse(text);
    let some = format_on_type(&before, TextSize::new(at as u32), typed, &|| ());
    in_order(text, &some);
    assert_eq!(meaning(&parse(&applied(text, &some))), meaning(&before), "{text}");
    let beyond = some.iter().filter(|it| usize::from(it.range.end()) > at);
    assert!(beyond.count() <= usize::from(matches!(typed, '\n' | '\r')), "{text:?} {some:?}");
}

/// Words that make a model, with what stands between them: any text of these may be typed.
const WORDS: &str = "include library use codel shell core component architecture deployment extends constant property \
    input output port require provide var handler configure start update stop statemachine initial state entry run exit \
    transition if if to then else else return import instance connection operation activity affinity priority period \
    background in out true new_data a b c f 10 1.5 0x1F 5ms \"s\" \"open { { { } } } ( ) ( ) [ ] , ; ; : : :: . -> = = == \
    < && + - ! * /* */ /*c*/ // # é \u{feff} \0";

const BETWEEN: &[&str] = &[
    " ",
    " ",
    " ",
    " ",
    " ",
    " ",
    "",
    "  ",
    "\n",
    "\n",
    "\n  ",
    "\n\n",
    "\r\n",
    "\t",
    "\r",
    " \n\n\n",
    " // c\n",
    "/* d */",
    "\n// e\n",
    "\n<<<<<<< a\n",
    "\n=======\n",
    "\n>>>>>>> b\r\n",
];

fn words() -> Vec<&'static str> {
    WORDS.split(' ').filter(|word| !word.is_empty()).collect()
}

/// Texts of any words.
fn soup(most: usize) -> impl Strategy<Value = String> {
    let pair = (prop::sample::select(words()), prop::sample::select(BETWEEN));
    prop::collection::vec(pair, 0..most)
        .prop_map(|all| all.iter().flat_map(|(word, gap)| [*word, *gap]).collect())
}

/// A model whose white space is any other that may stand there.
fn spaced(model: &'static str) -> impl Strategy<Value = String> {
    let lexed = mauve_syntax::lex(model);
    let tokens: Vec<&str> = (0..lexed.len())
        .filter(|&index| !lexed.kind(index).is_trivia())
        .map(|index| &model[lexed.range(index)])
        .collect();
    let gaps = prop::collection::vec(prop::sample::select(BETWEEN), tokens.len());
    gaps.prop_map(move |gaps| {
        let mut text = String::new();
        for (token, gap) in tokens.iter().zip(gaps) {
            // Two words must stay two.
            let gap = if gap.is_empty() { " " } else { gap };
            text.extend([token, gap]);
        }
        text
    })
}

/// A model in which some pieces have become others.
fn damaged(model: &'static str) -> impl Strategy<Value = String> {
    let harm = (any::<prop::sample::Index>(), 0..30usize, prop::sample::select(words()));
    prop::collection::vec(harm, 1..4).prop_map(move |harms| {
        let mut text = model.to_owned();
        for (at, length, put) in harms {
            let from = char_boundary(&text, at.index(text.len() + 1));
            let to = char_boundary(&text, from + length);
            text.replace_range(from..to, put);
        }
        text
    })
}

const MODEL: &str = r#"// What this is.
include "laser.mal"   // where
library robot {
  use geometry_msgs
  codel plan(in goal: geometry_msgs::Pose,
             out path: Path /* long */): bool


  shell S extends Base { property r: double [0.1; 1] = -0.3; input port goal: Pose  provide reset(): void }
  core C(S): {
    var n: int = 0;     // one
    var long: int = 10; // two
                        // and more
    handler h: plan
    provide reset() = { n = 0; }
    configure = { return true; } ; start = { }
    statemachine {
      var m: int
      initial state A
      {
        run = { if read(goal, g) == new_data then { plan(g, p); } else { n = n + 1; } }
        // Why it goes.
        transition go if (n > 3 &&
            !done) to B { publish(p); }
        /* Several
           lines. */
        exit = { { { inner(); } }; if a then { }
                 else if b then { f(
                   x, -y); } }
      }
      state B { transition back to A  handle = { plan(aaaaaaaaaaaaaaaaaaaaaaaa, bbbbbbbbbbbbbbbbbbbbbbbb); go(cccccccccccccccc); } }
    }
  }
  component P(S, C)
}
architecture A { import N  instance p: P  connection l.scan -> [4] p.scan  operation p.a -> l.b  property p.r = 0.5 * (2 + 1) }
deployment D { architecture A
  activity p { affinity = 1 priority = 9 period = 100 deadline = 80 } // p
  activity longer { affinity = 0x10 priority = 10; period = 5 }

  activity other { priority = background } }
"#;

/// An edit ends the formatting of a long text: it is asked about at each token, and may unwind.
#[test]
fn formatting_can_be_interrupted_everywhere() {
    let parse = parse(&"codel f( a:int ):int // comment\n".repeat(50));
    let tokens = parse.syntax().descendants_with_tokens().filter(|it| it.as_token().is_some()).count();
    let calls = Cell::new(0);
    let all = format(&parse, &|| calls.set(calls.get() + 1));
    assert!(!all.is_empty() && calls.get() > 2 * tokens, "{} of {tokens}", calls.get());
    calls.set(0);
    parse.debug_dump_interruptible(&|| calls.set(calls.get() + 1));
    assert!(calls.get() > tokens);
}

proptest! {
    #[test]
    fn any_words(text in soup(80)) {
        check(&text);
    }

    #[test]
    fn any_words_in_a_program(text in soup(40)) {
        check(&format!("core C(S) {{ update = {{ {text} }} }}\ncodel f(): int"));
        check(&format!("deployment D {{ activity a {{ {text}"));
        check(&format!("core C(S) {{ statemachine {{ state A {{ {text} }}\nstate B {{ }} }} }}"));
    }

    #[test]
    fn any_letters(text in "\\PC*") {
        check(&text);
    }

    #[test]
    fn a_damaged_model(text in damaged(MODEL)) {
        check(&text);
        check(&text.replace('\n', "\r\n"));
    }

    #[test]
    fn a_model_with_other_white_space(text in spaced(MODEL)) {
        check(&text);
    }

    #[test]
    fn some_lines(text in damaged(MODEL), ends: (prop::sample::Index, prop::sample::Index)) {
        let at = |index: prop::sample::Index| char_boundary(&text, index.index(text.len() + 1));
        let (from, to) = (at(ends.0), at(ends.1));
        check_range(&text, from.min(to), from.max(to));
    }

    #[test]
    fn while_typing(text in prop_oneof![damaged(MODEL), soup(60)], key in prop::sample::select(&['}', ';', '\n'][..])) {
        for (at, _) in text.match_indices(key).take(20) {
            check_typing(&text, at + 1);
        }
    }
}

#[test]
fn the_sample_models_are_as_they_should_be() {
    let models =
        texts_in(&models()).into_iter().filter(|(path, _)| path.extension().is_some_and(|it| it == "mal"));
    let models: Vec<_> = models.collect();
    assert!(models.len() > 10);
    for (path, text) in models {
        assert_eq!(formatted(&text), text, "{}", path.display());
        check(&text);
        // Whatever the author's indentation and line breaks: they come out again.
        let end = |line: &str| if line.contains("//") { "\r\n" } else { "  \r\n" };
        let flat: String = text.lines().map(|line| format!("\t{}{}", line.trim_start(), end(line))).collect();
        check(&flat);
        let continued = text.contains(",\n");
        assert!(continued || formatted(&flat).replace("\r\n", "\n") == text, "{}", path.display());
    }
}

#[test]
fn texts_that_were_formatted_wrongly() {
    for text in [
        "-> /*\n",
        "library include\r\n{ extends include\n} ",
        "\u{feff} library  // include\ninclude include ",
        "deployment D { architecture A\n{ activity p { } // p\n a) priority = background } }\n",
    ] {
        check(text);
        for (at, _) in text.match_indices([';', '}', '\n']) {
            check_typing(text, at + 1);
        }
    }
}

#[test]
fn what_is_nested_deep_is_formatted() {
    let inside = |program: &str| format!("core C(S) {{ update = {{ {program} }} }}\ncodel good(): int");
    for text in [
        inside(&format!("{}{}", "{".repeat(200), "}".repeat(200))),
        inside(&format!("{}{}", "{".repeat(10_000), "}".repeat(10_000))),
        inside(&format!("x = {}1{};", "f(".repeat(200), ")".repeat(200))),
        inside(&"if a then { f(); } else { }; ".repeat(2_000)),
    ] {
        check(&text);
    }
}
