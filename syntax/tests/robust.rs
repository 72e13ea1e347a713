//! Any text: it round-trips, nothing panics, and a half-typed item costs itself and nothing else.

use mauve_syntax::SyntaxKind::{COMMA, IDENT, LIBRARY, R_CURLY, SEMICOLON};
use mauve_syntax::{Expected, SyntaxError, SyntaxErrorKind, SyntaxKind, SyntaxNode, TokenError, parse};
use proptest::prelude::*;

fn round_trips(text: &str) {
    let parse = parse(text);
    assert_eq!(parse.syntax().text().to_string(), text);
    let lost = parse.syntax().descendants().any(|node| node.kind() == SyntaxKind::ERROR);
    // In a comment, a conflict needs no mark.
    let is_conflict = |error: &SyntaxError| matches!(error.kind, SyntaxErrorKind::Conflict { .. });
    let needs_mark = |error: &SyntaxError| !is_conflict(error);
    assert!(!lost || !parse.errors().is_empty(), "marks and errors go together: {text:?}");
    assert!(lost || !parse.errors().iter().any(needs_mark), "marks and errors go together: {text:?}");
    for error in parse.errors() {
        assert!(u32::from(error.range.end()) as usize <= text.len());
        assert!(text.is_char_boundary(u32::from(error.range.start()).try_into().unwrap()), "{text:?}");
    }
}

const WORDS: &[&str] = &[
    "include",
    "library",
    "use",
    "codel",
    "shell",
    "core",
    "component",
    "architecture",
    "deployment",
    "extends",
    "constant",
    "property",
    "input",
    "output",
    "port",
    "require",
    "provide",
    "var",
    "handler",
    "configure",
    "update",
    "statemachine",
    "initial",
    "state",
    "entry",
    "run",
    "handle",
    "exit",
    "transition",
    "if",
    "to",
    "then",
    "else",
    "return",
    "import",
    "instance",
    "connection",
    "operation",
    "activity",
    "priority",
    "period",
    "background",
    "in",
    "out",
    "true",
    "new_data",
    "a",
    "b",
    "c",
    "10",
    "1.5",
    "0x1F",
    "5ms",
    "\"s\"",
    "\"open",
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
    ".",
    "->",
    "=",
    "==",
    "<",
    "&&",
    "+",
    "-",
    "!",
    "/*",
    "*/",
    "//",
    "\n",
    "\n",
    "\n",
    "é",
    "\u{feff}",
    "\n<<<<<<< a\n",
    "\n=======\n",
    "\n>>>>>>> b\n",
    "\n||||||| c\n",
    "\0",
];

proptest! {
    #[test]
    fn any_text_round_trips(text in "\\PC*") {
        round_trips(&text);
    }

    #[test]
    fn any_tokens_round_trip(words in prop::collection::vec(prop::sample::select(WORDS), 0..120)) {
        round_trips(&words.join(" "));
        round_trips(&words.concat());
    }

    #[test]
    fn a_damaged_model_round_trips(cut in 0..MODEL.len(), length in 0..40usize, put in prop::sample::select(WORDS)) {
        let end = (cut + length).min(MODEL.len());
        let (Some(head), Some(tail)) = (MODEL.get(..cut), MODEL.get(end..)) else { return Ok(()) };
        round_trips(&format!("{head}{put}{tail}"));
    }
}

const MODEL: &str = r#"include "laser.mal"
library robot {
  use geometry_msgs
  codel plan(in goal: geometry_msgs::Pose, out path: Path): bool
  shell S extends Base { property r: double [0.1; 1] = 0.3; input port goal: Pose  provide reset(): void }
  core C(S) {
    var n: int = 0;
    handler h: plan
    provide reset() = { n = 0; }
    configure = { return true; }
    statemachine {
      initial state A {
        run = { if read(goal, g) == new_data then { plan(g, p); } else { n = n + 1; } }
        transition go if (n > 3 && !done) to B { publish(p); }
      }
      state B { transition back to A }
    }
  }
  component P(S, C)
}
architecture A { import N instance p: P connection l.scan -> [4] p.scan property p.r = 0.5 }
deployment D { architecture A activity p { affinity = 1 priority = 9 period = 100 deadline = 80 } }
"#;

/// Every form of item, with what stands around it, a good item of the same list, and the kind of that.
/// The items are one token a space, so that they can be cut at each.
const ITEMS: &[(&str, &str, &str)] = &[
    ("", "include \"a.mal\"", "codel good ( ) : int"),
    ("", "use geometry_msgs", "codel good ( ) : int"),
    ("", "library L { codel f ( ) : int }", "shell good { }"),
    ("", "codel f ( in a : int , out b : m :: T ) : int", "component good ( S , C )"),
    ("", "shell S extends A , B { property a : int }", "codel good ( ) : int"),
    (
        "",
        "core C ( S ) : { var a : int = 1 ; update = { f ( a ) ; } }",
        "architecture good { instance a : B }",
    ),
    ("", "component C ( S , l . C )", "deployment good { architecture A }"),
    ("", "architecture A { import B instance c : D }", "core good ( S ) { update = { } }"),
    ("", "deployment D { architecture A activity a { priority = 1 } }", "component good ( S , C )"),
    ("library L {", "shell S { input port a : int }", "codel good ( ) : int"),
    ("shell S {", "property r : double [ 0.1 ; 1 ] = 0.3", "property good : int"),
    ("shell S {", "constant r : string = \"a\"", "input port good : int"),
    ("shell S {", "input port a : m . T", "output port good : int"),
    ("shell S {", "require f ( in a : int ) : int", "provide good ( ) : int"),
    ("shell S {", "provide f ( ) : int", "constant good : int = 1"),
    ("core C(S) {", "var a : int = b + 1 ;", "handler good : h"),
    ("core C(S) {", "handler a : h ;", "var good : int = 1"),
    ("core C(S) {", "provide f ( a : int ) : int = { g ( ) ; }", "update = { good ( ) ; }"),
    ("core C(S) {", "configure = { if a then { b ( ) ; } else { } return c ; }", "start = { good ( ) ; }"),
    ("core C(S) {", "statemachine { initial state A { run = { f ( ) ; } } }", "stop = { good ( ) ; }"),
    ("core C(S) { statemachine {", "var a : int = 1", "state good { run = { } }"),
    ("core C(S) { statemachine {", "initial state A { run = { f ( ) ; } }", "state good { }"),
    (
        "core C(S) { statemachine {",
        "state A { transition t if a to B { f ( ) ; } }",
        "initial state good { }",
    ),
    ("core C(S) { statemachine { state S {", "entry = { x = f ( a , b ) ; }", "run = { good ( ) ; }"),
    (
        "core C(S) { statemachine { state S {",
        "exit = { if a == b then { } else if c then { } }",
        "handle = { }",
    ),
    (
        "core C(S) { statemachine { state S {",
        "transition t if ( a < b ) && c to T { f ( ) ; }",
        "transition good to T",
    ),
    ("core C(S) { statemachine { state S {", "transition t to T", "run = { good ( ) ; }"),
    ("architecture A {", "import l . B", "instance good : T"),
    ("architecture A {", "instance a : l . T", "connection good . a -> b . c"),
    ("architecture A {", "connection a . b -> [ 4 ] c . d", "instance good : T"),
    ("architecture A {", "operation a . b -> c . d", "property good . a = 1"),
    ("architecture A {", "property a . b = c * ( 2 + 1 )", "operation good . a -> b . c"),
    ("architecture A {", "constant a . b = - 1", "import good"),
    ("deployment D {", "architecture l . A", "activity good { priority = 1 }"),
    (
        "deployment D {",
        "activity a { affinity = 1 priority = 2 ; period = 3 deadline = 4 }",
        "property good . a = 1",
    ),
    ("deployment D {", "property a . b = \"c\"", "activity good { priority = 1 }"),
    ("deployment D { activity a {", "priority = background", "period = 100"),
    ("deployment D { activity a {", "period = 100 + 1", "deadline = 100"),
    ("core C(S) { update = {", "var a : int = b ;", "good = 1 ;"),
    ("core C(S) { update = {", "a = f ( b , c ) + - d ;", "good = 1 ;"),
    ("core C(S) { update = {", "f ( a , ( b ) ) ;", "var good : int ;"),
    ("core C(S) { update = {", "if ( a ) then { b ( ) ; } else if c then { } else { d = 1 ; }", "good = 1 ;"),
    ("core C(S) { update = {", "return a && ! b ;", "good = 1 ;"),
    ("core C(S) { update = {", "{ a = 1 ; }", "var good : int ;"),
];

#[test]
fn a_cut_item_leaves_the_next_one_whole() {
    for (around, item, good) in ITEMS {
        let close = "}".repeat(around.matches('{').count());
        let whole = format!("{around}\n  {item}\n  {good}\n{close}\n");
        assert_eq!(parse(&whole).errors(), [], "{whole}");
        let wanted = node_of(&whole, good);
        let tokens: Vec<&str> = item.split(' ').collect();
        for cut in 0..tokens.len() {
            let half = tokens[..cut].join(" ");
            let text = format!("{around}\n  {half}\n  {good}\n{close}\n");
            let found = node_of(&text, good);
            assert_eq!(found, wanted, "cut at {cut}:\n{text}\n{}", parse(&text).debug_dump());
            round_trips(&text);
        }
    }
}

/// The kind of the outermost node whose text is `good`, and whether it is whole.
fn node_of(text: &str, good: &str) -> Option<(SyntaxKind, bool)> {
    let is_it = |node: &SyntaxNode| node.text() == good.trim_end_matches(" ;") || node.text() == good;
    let node = parse(text).syntax().descendants().find(is_it)?;
    Some((node.kind(), mauve_syntax::is_whole(&node)))
}

#[test]
fn what_is_nested_too_deep_is_one_error_in_a_small_stack() {
    let inside = |program: &str| format!("core C(S) {{ update = {{ {program} }} }}\ncodel good(): int");
    let texts = [
        inside(&format!("{}{}", "{".repeat(10_000), "}".repeat(10_000))),
        inside(&format!("x = {}1{};", "(".repeat(10_000), ")".repeat(10_000))),
        inside(&format!("x = {}1;", "a + ".repeat(100_000))),
        inside(&format!("x = {}a;", "!".repeat(100_000))),
        inside(&format!("x = {}a{};", "f(".repeat(10_000), ")".repeat(10_000))),
        inside(&format!("{}{{ }}", "if a then { } else ".repeat(100_000))),
        inside(&format!("{}{}", "if a then { ".repeat(10_000), "} else { }".repeat(10_000))),
        inside(&format!("if a then {{ }} {}", "elif a then { } ".repeat(100_000))),
        inside(&format!("x = {}1{};", "(a + (b + ".repeat(5_000), "))".repeat(5_000))),
    ];
    for text in texts {
        std::thread::Builder::new()
            .stack_size(2 << 20)
            .spawn(move || {
                round_trips(&text);
                let parse = parse(&text);
                let is_foreign = |it: &&SyntaxError| matches!(it.kind, SyntaxErrorKind::Foreign(_));
                let others = parse.errors().iter().filter(|it| !is_foreign(it)).count();
                assert_eq!(others, 1, "{:?}", parse.errors());
                let good = parse.syntax().children().last().unwrap();
                assert_eq!(good.text(), "codel good(): int");
                let deepest =
                    parse.syntax().descendants().map(|node| node.ancestors().count()).max().unwrap();
                assert!(deepest < 1000, "{deepest}");
            })
            .unwrap()
            .join()
            .unwrap();
    }
}

#[test]
fn one_mistake_is_one_error() {
    let one = |text: &str, kind: SyntaxErrorKind| {
        let parse = parse(text);
        let kinds: Vec<SyntaxErrorKind> = parse.errors().iter().map(|error| error.kind).collect();
        assert_eq!(kinds, [kind], "{text}\n{}", parse.debug_dump());
    };
    let expected = |expected, found| SyntaxErrorKind::Expected { expected, found, similar: None };
    let declaration = Expected::Item(LIBRARY);
    one("core C(S) { update = { f(a b, c); } }", expected(Expected::Token(COMMA), Some(IDENT)));
    one("core C(S) { update = { f(\"a); } }", SyntaxErrorKind::Token(TokenError::UnterminatedString));
    one("core C(S) { update = { f(); } /* }", SyntaxErrorKind::Token(TokenError::UnterminatedComment));
    one("core C(S) { update = { f() } }", expected(Expected::Token(SEMICOLON), Some(R_CURLY)));
    one("core C(S) { update = { f();", expected(Expected::Token(R_CURLY), None));
    one("architecture A { § instance a: B }", SyntaxErrorKind::Token(TokenError::Characters));
    one("shell S { }\n}\nstop = { }\ncodel f(): int", expected(declaration, Some(R_CURLY)));
    one("analysis { wcet = 3 { a } }\ncodel f(): int", expected(declaration, Some(IDENT)));
    one("deployment D { activity a { period = 5ms } }", SyntaxErrorKind::Token(TokenError::BadNumber));
    one("\0\0\u{1}", SyntaxErrorKind::Token(TokenError::Characters));
}
