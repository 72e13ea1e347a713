//! The tree-sitter grammar in `editors/tree-sitter` agrees with MAUVE's own parser, and its queries fit the grammar.
//!
//! Two parsers *agree* on a text if both find an error in it, or if neither does and their trees are the same: each node
//! and each token has the same kind, range and depth, and so have the comments, except for their depth. They agree on
//!
//! - each model of the repository, also in Markdown, and each text above a rule of the grammar in `syntax`: hundreds of
//!   them have errors;
//! - the files of 500 random models.
//!
//! They also agree on 2,000 random sentences of `mauve.ungram`, in which any word is a name, half of them with line breaks
//! and comments; and on 2,000 broken texts, where a token of a model is removed, repeated, exchanged with the next one, or
//! replaced. There, tree-sitter accepts more in these cases, and never less:
//!
//! - `var x:` before a line `y = 3;`. MAUVE's parser knows that the line begins a statement, so the type is missing; for
//!   tree-sitter, `y` is the type. MAUVE's parser, too, accepts the tokens on one line.
//! - `return == 1;` and `if;`. For MAUVE's parser, the operand is missing; for tree-sitter, the words are variables.
//! - `--n;`, which decrements in other languages. For tree-sitter, these are two signs.
//!
//! Other texts that only tree-sitter accepts are not tested: numbers such as `5ms` where two tokens are allowed;
//! statements such as `begin;` that consist of a word of another language; more than 256 nested blocks, parentheses or
//! operators.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use expect_test::{Expect, expect};
use mauve_syntax::{NodeOrToken, SyntaxKind, WalkEvent};
use mauve_tests::{Options, Random, files_in, fixture, random_model, random_model_of};
use tree_sitter::{Language, Parser, Query, QueryCursor, StreamingIterator as _, Tree};
use ungrammar::{Grammar, Node, Rule};

fn language() -> Language {
    mauve_tree_sitter::LANGUAGE.into()
}

/// A node or a token: its depth, kind (a token without a kind: its text) and range.
type Element = (usize, String, Range<usize>);

/// The result of a parser: without the range of the root, which may begin with white space.
#[derive(Debug, PartialEq, Eq)]
struct Parsed {
    has_error: bool,
    elements: Vec<Element>,
    comments: Vec<(String, Range<usize>)>,
}

/// Parses a text with MAUVE's parser.
fn parse(text: &str) -> Parsed {
    let parse = mauve_syntax::parse(text);
    let mut parsed =
        Parsed { has_error: !parse.errors().is_empty(), elements: Vec::new(), comments: Vec::new() };
    let mut depth = 0;
    for event in parse.syntax().preorder_with_tokens() {
        let WalkEvent::Enter(element) = event else {
            depth -= 1;
            continue;
        };
        let range = Range::<usize>::from(element.text_range());
        let name = match (element.kind(), &element) {
            (SyntaxKind::IDENT, _) => "identifier".to_owned(),
            (SyntaxKind::INT_NUMBER | SyntaxKind::FLOAT_NUMBER | SyntaxKind::STRING, _)
            | (SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT, _)
            | (_, NodeOrToken::Node(_)) => format!("{:?}", element.kind()).to_lowercase(),
            (_, NodeOrToken::Token(token)) => token.text().to_owned(),
        };
        if element.kind().is_comment() {
            parsed.comments.push((name, range));
        } else if !element.kind().is_trivia() {
            let range = if depth == 0 { 0..0 } else { range };
            parsed.elements.push((depth, name, range));
        }
        depth += 1;
    }
    parsed
}

/// A parser of tree-sitter, and the texts on which it must agree with MAUVE's.
struct Comparison {
    parser: Parser,
    texts: usize,
    with_errors: usize,
    /// The texts that only MAUVE's parser rejects.
    accepted: usize,
}

impl Comparison {
    fn new() -> Comparison {
        let mut parser = Parser::new();
        parser.set_language(&language()).unwrap();
        Comparison { parser, texts: 0, with_errors: 0, accepted: 0 }
    }

    /// Parses a text with tree-sitter.
    fn parse(&mut self, text: &str) -> Parsed {
        let tree = self.parser.parse(text, None).unwrap();
        let mut parsed =
            Parsed { has_error: tree.root_node().has_error(), elements: Vec::new(), comments: Vec::new() };
        for_each_node(&tree, |depth, node| {
            let name = node.kind().to_owned();
            if node.is_extra() && !node.is_error() {
                parsed.comments.push((name, node.byte_range()));
            } else {
                let range = if depth == 0 { 0..0 } else { node.byte_range() };
                parsed.elements.push((depth, name, range));
            }
        });
        parsed
    }

    /// Checks that the parsers agree on a text, or that only MAUVE's parser rejects it and `may_accept`.
    fn check(&mut self, name: &str, text: &str, may_accept: bool) {
        let (expected, actual) = (parse(text), self.parse(text));
        self.texts += 1;
        self.with_errors += usize::from(expected.has_error);
        if expected.has_error && !actual.has_error && may_accept {
            self.accepted += 1;
            return;
        }
        let errors = (expected.has_error, actual.has_error);
        assert_eq!(errors.0, errors.1, "{name}: MAUVE's parser, tree-sitter: {errors:?}\n{text}");
        if !expected.has_error {
            let differ = expected.elements.iter().zip(&actual.elements).find(|(one, other)| one != other);
            assert_eq!(differ, None, "{name}\n{text}");
            assert_eq!(expected, actual, "{name}\n{text}");
        }
    }
}

/// Calls `visit` with each node of a tree and its depth, in text order.
fn for_each_node(tree: &Tree, mut visit: impl FnMut(usize, tree_sitter::Node<'_>)) {
    let mut cursor = tree.walk();
    let mut depth = 0;
    loop {
        visit(depth, cursor.node());
        if cursor.goto_first_child() {
            depth += 1;
            continue;
        }
        while !cursor.goto_next_sibling() {
            if !cursor.goto_parent() {
                return;
            }
            depth -= 1;
        }
    }
}

/// Returns the root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the models of the repository, with their names: files, fences in Markdown, texts above rules of the grammar.
fn models() -> Vec<(String, String)> {
    let mut found = Vec::new();
    let folders = [".github", "analysis", "editors", "server", "syntax", "tests"];
    let files = folders.iter().flat_map(|folder| files_in(&root().join(folder)));
    for path in files.chain([root().join("README.md")]) {
        let name = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
        if name.contains("/node_modules/") {
            continue;
        } else if name.ends_with(".mal") {
            found.push((name, fs::read_to_string(path).unwrap()));
        } else if name.ends_with(".md") {
            let text = fs::read_to_string(path).unwrap();
            let fences = text.split("```mauve").skip(1).filter_map(|fence| fence.split("```").next());
            let bodies = fences.filter_map(|fence| fence.split_once('\n')).map(|(_, body)| body);
            let files = bodies.flat_map(fixture).filter(|(path, _)| path.ends_with(".mal"));
            found.extend(files.map(|(path, text)| (format!("{name}: {path}"), text)));
        } else if name.starts_with("syntax/test_data/") {
            let text = fs::read_to_string(path).unwrap();
            found.push((name, text.split("\nSOURCE_FILE@").next().unwrap().to_owned()));
        }
    }
    found
}

/// Returns the files of random models, with their names.
fn random_models(count: u64) -> Vec<(String, String)> {
    let model = |seed| match seed % 4 {
        0 => random_model_of(seed, Options::components(1)),
        _ => random_model(seed),
    };
    let models = (0..count).flat_map(|seed| model(seed).texts().into_iter().map(move |file| (seed, file)));
    let files = models.filter(|(_, (path, _))| path.extension().is_some_and(|it| it == "mal"));
    files.map(|(seed, (path, text))| (format!("seed {seed}, {}", path.display()), text)).collect()
}

#[test]
fn the_parsers_agree_on_the_models_of_the_repository() {
    let mut comparison = Comparison::new();
    for (name, text) in models() {
        comparison.check(&name, &text, false);
    }
    assert!(comparison.with_errors > 50, "{} texts with errors", comparison.with_errors);
    assert!(comparison.texts > 500, "{} texts", comparison.texts);
}

#[test]
fn the_parsers_agree_on_random_models() {
    let mut comparison = Comparison::new();
    for (name, text) in random_models(500) {
        comparison.check(&name, &text, false);
    }
    assert_eq!(comparison.with_errors, 0);
}

/// A maker of random sentences of `mauve.ungram`.
struct Sentence<'a> {
    grammar: &'a Grammar,
    words: &'a [String],
    random: Random,
    tokens: Vec<String>,
}

impl Sentence<'_> {
    fn make(&mut self, rule: &Rule, depth: usize) {
        match rule {
            Rule::Labeled { rule, .. } => self.make(rule, depth),
            Rule::Node(node) => self.node(*node, depth),
            Rule::Token(token) => {
                let token = match self.grammar[*token].name.as_str() {
                    "ident" => self.random.of(self.words),
                    "int_number" => *self.random.of(&["1", "0x1F", "010"]),
                    "float_number" => *self.random.of(&["1.5", "1e-3", "1.5E+3"]),
                    "string" => *self.random.of(&["\"\"", "\"// a \\\" \\\\\""]),
                    text => text,
                };
                self.tokens.push(token.to_owned());
            }
            Rule::Seq(rules) => rules.iter().for_each(|rule| self.make(rule, depth)),
            Rule::Alt(rules) => {
                // The first alternatives are the smallest ones.
                let most = if depth > 24 { 1 + self.random.below(rules.len()) } else { rules.len() };
                let choice = self.random.below(most);
                self.make(&rules[choice], depth);
            }
            Rule::Opt(rule) => (0..self.random.below(2)).for_each(|_| self.make(rule, depth)),
            Rule::Rep(rule) => {
                let most = if depth > 20 { 2 } else { 4 };
                (0..self.random.below(most)).for_each(|_| self.make(rule, depth));
            }
        }
    }

    fn node(&mut self, node: Node, depth: usize) {
        let grammar = self.grammar;
        self.make(&grammar[node].rule, depth + 1);
    }
}

/// Returns the keywords of the grammar: its tokens that are words.
fn keywords(grammar: &Grammar) -> Vec<String> {
    let tokens = grammar.tokens().map(|token| grammar[token].name.as_str());
    tokens.filter(|text| is_keyword(text)).map(str::to_owned).collect()
}

fn is_keyword(text: &str) -> bool {
    let kind = mauve_syntax::lex(text).kind(0);
    kind.is_word() && kind != SyntaxKind::IDENT
}

fn grammar() -> Grammar {
    include_str!("../syntax/mauve.ungram").parse().unwrap()
}

/// Returns the tokens of a text, without comments.
fn tokens(text: &str) -> Vec<&str> {
    let lexed = mauve_syntax::lex(text);
    let indices = (0..lexed.len()).filter(|&index| !lexed.kind(index).is_trivia());
    indices.map(|index| &text[lexed.range(index)]).collect()
}

/// Returns whether tree-sitter may accept a text that MAUVE's parser rejects.
fn is_exception(text: &str) -> bool {
    const BINARY: [&str; 12] = ["||", "&&", "==", "!=", "<", "<=", ">", ">=", "+", "*", "/", "%"];
    let tokens = tokens(text);
    let has = |count, form: fn(&[&str]) -> bool| tokens.windows(count).any(form);
    !parse(&tokens.join(" ")).has_error
        || has(2, |it| ["if", "return"].contains(&it[0]) && BINARY.contains(&it[1]))
        || has(2, |it| it == ["if", ";"])
        || has(4, |it| it[0] == "-" && it[1] == "-" && it[3] == ";")
}

/// Returns random sentences of the grammar, as lists of tokens.
fn sentences(seeds: Range<u64>) -> Vec<Vec<String>> {
    let grammar = grammar();
    let words: Vec<String> =
        keywords(&grammar).into_iter().chain(["x", "f", "Pose"].map(str::to_owned)).collect();
    let start = grammar.iter().find(|&node| grammar[node].name == "SourceFile").unwrap();
    let sentence = |seed| {
        let random = Random::of_seed(seed);
        let mut sentence = Sentence { grammar: &grammar, words: &words, random, tokens: Vec::new() };
        sentence.node(start, 0);
        sentence.tokens
    };
    seeds.map(sentence).collect()
}

#[test]
fn the_parsers_agree_on_random_sentences() {
    let mut comparison = Comparison::new();
    for (seed, tokens) in sentences(0..1000).into_iter().enumerate() {
        let text = tokens.join(" ");
        comparison.check(&format!("seed {seed}"), &text, is_exception(&text));
    }
    // For example, a declaration before an `include`, and chained comparisons.
    assert!((50..500).contains(&comparison.with_errors), "{} texts with errors", comparison.with_errors);
    assert!(comparison.accepted < 10, "{} exceptions", comparison.accepted);
}

#[test]
fn the_parsers_agree_on_random_sentences_with_line_breaks_and_comments() {
    let mut comparison = Comparison::new();
    let mut random = Random::of_seed(1);
    for (seed, tokens) in sentences(1000..2000).into_iter().enumerate() {
        let gaps = [" ", " ", "\t", "\n", "\r\n", " // c * /\n", "/* c\n // ** /*/", "/**/", "\n/***/\n"];
        let text: String =
            tokens.iter().map(|token| format!("{token}{}", random.of(&gaps))).collect::<String>();
        comparison.check(&format!("seed {}", seed + 1000), &text, is_exception(&text));
    }
    let complete = comparison.texts - comparison.with_errors;
    assert!(complete > 400, "{complete} texts without an error");
}

#[test]
fn the_parsers_agree_on_broken_texts() {
    let texts = models().into_iter().chain(random_models(40));
    let texts: Vec<_> = texts.filter(|(_, text)| text.len() < 4000 && !parse(text).has_error).collect();
    let mut comparison = Comparison::new();
    let mut random = Random::of_seed(1);
    while comparison.texts < 2000 {
        let (name, text) = random.of(&texts);
        let lexed = mauve_syntax::lex(text);
        let tokens: Vec<usize> = (0..lexed.len()).filter(|&at| !lexed.kind(at).is_trivia()).collect();
        if tokens.len() < 3 {
            continue;
        }
        let at = random.below(tokens.len() - 1);
        let (one, next) = (lexed.range(tokens[at]), lexed.range(tokens[at + 1]));
        let other = lexed.range(*random.of(&tokens));
        let (before, after) = (&text[..one.start], &text[one.end..]);
        let broken = match random.below(5) {
            0 | 1 => format!("{before}{after}"),
            2 => format!("{before}{0} {0}{after}", &text[one]),
            3 => format!(
                "{before}{}{}{}{}",
                &text[next.clone()],
                &text[one.end..next.start],
                &text[one],
                &text[next.end..]
            ),
            _ => format!("{before}{}{after}", &text[other]),
        };
        comparison.check(name, &broken, is_exception(&broken));
    }
    assert!(comparison.with_errors > 1000, "{} texts with errors", comparison.with_errors);
    assert!(comparison.accepted < 20, "{} exceptions", comparison.accepted);
}

/// A query file of an editor.
struct Captures {
    query: Query,
    cursor: QueryCursor,
}

impl Captures {
    fn of(file: &str) -> Captures {
        let path = root().join("editors/tree-sitter/queries").join(file);
        let text = fs::read_to_string(path).unwrap();
        let query = Query::new(&language(), &text).unwrap_or_else(|error| panic!("{file}: {error}"));
        Captures { query, cursor: QueryCursor::new() }
    }

    /// Returns the captured nodes of a text: their ranges and kinds, and the names of their captures in text order.
    fn in_text(&mut self, text: &str) -> Vec<(Range<usize>, String, String)> {
        let mut parser = Parser::new();
        parser.set_language(&language()).unwrap();
        let tree = parser.parse(text, None).unwrap();
        let names = self.query.capture_names();
        let mut captures = self.cursor.captures(&self.query, tree.root_node(), text.as_bytes());
        let mut found = Vec::new();
        while let Some((found_match, index)) = captures.next() {
            let capture = found_match.captures()[*index];
            let node = capture.node;
            found.push((node.byte_range(), node.kind().to_owned(), names[capture.index as usize].to_owned()));
        }
        found
    }
}

/// A model with every keyword, and with names that are keywords.
const SAMPLE: &str = r#"include "laser.mal"
library nav {
  use std_msgs
  codel plan(in goal: nav.Pose, out use: std_msgs::Float64, inout n: int): bool // finds a path
  shell S extends Base {
    property rate: double [0.5; 2] = 1e0
    constant constant: string = "map"
    input port state: Pose
    output port port: Pose
    require look(): Pose
    provide stop(): void
  }
  core C(S) {
    var initial: int = 0x1F;
    handler request: look
    provide stop() = {}
    configure = { return true; }
    start = { send(look, request); }
    update = {
      if (read(state, pose) == new_data && !false) then { return; } else if old_data then {} else {}
      n = -plan(background, no_data) || collect(request, pose) != success;
      write(port, not_ready); status(state); x = failure;
    }
    stop = {}
    cleanup = {}
    statemachine {
      initial state run {
        entry = {} run = {} handle = {} exit = {}
        transition to if ready to run { to = 1; }
      }
    }
  }
  component Pilot(S, C)
  architecture A {
    import Base
    instance import: nav.Pilot /* the pilot */
    connection a.b -> [4] c.activity
    operation a.b -> c.d
    property import.rate = 2
  }
  deployment D {
    architecture nav.A
    activity import { affinity = 1 priority = background period = 10 deadline = 9 jitter = 1 offset = 2 unknown = 1 }
    constant a.constant = 1 + 2
  }
}
"#;

/// Checks the captures of a query in the sample: for each name, the beginnings of the texts.
fn check_sample(file: &str, expected: Expect) {
    let mut out = BTreeMap::<String, BTreeSet<String>>::new();
    for (range, _, name) in Captures::of(file).in_text(SAMPLE) {
        let line = SAMPLE[range].lines().next().unwrap_or_default();
        let text: String = line.chars().take(20).collect();
        out.entry(name).or_default().insert(text.trim_end().to_owned());
    }
    let lines = out.into_iter().map(|(name, texts)| {
        let texts: Vec<String> = texts.into_iter().collect();
        format!("{name}: {}\n", texts.join(" · "))
    });
    expected.assert_eq(&lines.collect::<String>());
}

#[test]
fn highlights_of_the_sample() {
    assert!(!parse(SAMPLE).has_error);
    check_sample(
        "highlights.scm",
        expect![[r#"
            boolean: false · true
            comment: /* the pilot */ · // finds a path
            constant.builtin: background · failure · new_data · no_data · not_ready · old_data · success
            function: look · plan · stop
            function.builtin: collect · read · send · status · write
            function.call: plan
            keyword: activity · cleanup · configure · connection · constant · entry · exit · handle · instance · operation · port · property · run · start · state · stop · to · transition · update · var
            keyword.conditional: else · if · then
            keyword.function: codel · handler · provide · require
            keyword.import: import · include · use
            keyword.modifier: extends · in · initial · inout · input · out · output
            keyword.return: return
            keyword.type: architecture · component · core · deployment · library · shell · statemachine
            label: run · to
            module: nav · std_msgs
            number: 0x1F · 1 · 10 · 2 · 4 · 9
            number.float: 0.5 · 1e0
            operator: ! · != · && · + · - · -> · = · == · ||
            property: affinity · deadline · jitter · offset · period · priority
            punctuation.bracket: ( · ) · [ · ] · { · }
            punctuation.delimiter: , · . · : · :: · ;
            spell: /* the pilot */ · // finds a path
            string: "laser.mal" · "map"
            type: A · Base · C · D · Float64 · Pilot · Pose · S · look
            type.builtin: bool · double · int · string · void
            variable: a · c · import · initial · look · n · port · pose · ready · request · state · to · x
            variable.member: activity · b · constant · d · port · rate · state
            variable.parameter: goal · n · use
        "#]],
    );
}

#[test]
fn folds_of_the_sample() {
    check_sample(
        "folds.scm",
        expect![[r#"
            fold: () · (background, no_data · (in goal: nav.Pose, · (look, request) · (port, not_ready) · (request, pose) · (state) · (state, pose) · /* the pilot */ · activity import { af · architecture A { · core C(S) { · deployment D { · initial state run { · library nav { · shell S extends Base · statemachine { · { · { return true; } · { return; } · { send(look, request · { to = 1; } · {}
        "#]],
    );
}

#[test]
fn outline_of_the_sample() {
    check_sample(
        "zed/outline.scm",
        expect![[r#"
            context: activity · architecture · codel · component · constant · core · deployment · initial · input · instance · library · output · port · property · provide · require · shell · state · transition
            item: activity import { af · architecture A { · cleanup = {} · codel plan(in goal: · component Pilot(S, C · configure = { return · constant constant: s · core C(S) { · deployment D { · initial state run { · input port state: Po · instance import: nav · library nav { · output port port: Po · property rate: doubl · provide stop() = {} · provide stop(): void · require look(): Pose · shell S extends Base · start = { send(look, · statemachine { · stop = {} · transition to if rea · update = {
            name: A · C · D · Pilot · S · cleanup · configure · constant · import · look · nav · plan · port · rate · run · start · state · statemachine · stop · to · update
        "#]],
    );
}

#[test]
fn brackets_of_the_sample() {
    check_sample(
        "zed/brackets.scm",
        expect![[r#"
            close: ) · ] · }
            open: ( · [ · {
        "#]],
    );
}

/// Returns texts without errors, with many forms.
fn complete_texts() -> Vec<String> {
    let texts = models().into_iter().chain(random_models(20)).map(|(_, text)| text);
    let sentences = sentences(0..300).into_iter().map(|tokens| tokens.join(" "));
    let texts = texts.chain(sentences).chain([SAMPLE.to_owned()]);
    texts.filter(|text| !parse(text).has_error).collect()
}

#[test]
fn every_token_has_one_highlight_and_only_keywords_are_keywords() {
    let mut query = Captures::of("highlights.scm");
    let mut highlighted = BTreeMap::<String, BTreeSet<String>>::new();
    for text in complete_texts() {
        let mut captures = BTreeMap::<usize, Vec<(Range<usize>, String)>>::new();
        for (range, _, name) in query.in_text(&text).into_iter().filter(|(_, _, name)| name != "spell") {
            captures.entry(range.start).or_default().push((range, name));
        }
        for (depth, kind, range) in parse(&text).elements {
            let is_leaf = kind == "identifier"
                || ["int_number", "float_number", "string"].contains(&kind.as_str())
                || text[range.clone()] == kind;
            if depth == 0 || !is_leaf {
                continue;
            }
            let token = &text[range.clone()];
            let names = captures.get(&range.start).map_or([].as_slice(), |names| names);
            assert!(
                names.len() <= 1 && names.iter().all(|(it, _)| *it == range),
                "{token}: {names:?}\n{text}"
            );
            match names.first() {
                // A field without a meaning.
                None => assert_eq!(kind, "identifier", "{token} is not highlighted\n{text}"),
                Some((_, name)) if kind == "identifier" => {
                    assert!(
                        !name.starts_with("keyword"),
                        "the name {token} is highlighted as {name}\n{text}"
                    );
                    if ["property", "constant.builtin"].contains(&name.as_str()) {
                        highlighted.entry(token.to_owned()).or_default().insert(name.clone());
                    }
                }
                Some((_, name)) => {
                    highlighted.entry(token.to_owned()).or_default().insert(name.clone());
                }
            }
        }
    }
    for keyword in keywords(&grammar()) {
        let names = highlighted.get(&keyword).unwrap_or_else(|| panic!("`{keyword}` is not highlighted"));
        assert_eq!(names.len(), 1, "{keyword}: {names:?}");
    }
}

#[test]
fn helix_has_the_same_highlights_with_other_names() {
    let (mut neovim, mut helix) = (Captures::of("highlights.scm"), Captures::of("helix/highlights.scm"));
    let mut names = BTreeSet::new();
    for text in complete_texts() {
        let spelled = |(_, _, name): &(Range<usize>, String, String)| name == "spell";
        let expected: Vec<_> = neovim.in_text(&text).into_iter().filter(|it| !spelled(it)).collect();
        let actual = helix.in_text(&text);
        assert_eq!(expected.len(), actual.len());
        for (one, other) in expected.into_iter().zip(actual) {
            assert_eq!((one.0, one.1), (other.0, other.1));
            names.insert(format!("{} → {}\n", one.2, other.2));
        }
    }
    expect![[r#"
        boolean → constant.builtin.boolean
        comment → comment.block
        comment → comment.line
        constant.builtin → constant.builtin
        function → function
        function.builtin → function.builtin
        function.call → function
        keyword → keyword
        keyword.conditional → keyword.control.conditional
        keyword.function → keyword.function
        keyword.import → keyword.control.import
        keyword.modifier → keyword.storage.modifier
        keyword.return → keyword.control.return
        keyword.type → keyword.storage.type
        label → label
        module → namespace
        number → constant.numeric.integer
        number.float → constant.numeric.float
        operator → operator
        property → variable.other.member
        punctuation.bracket → punctuation.bracket
        punctuation.delimiter → punctuation.delimiter
        string → string
        type → type
        type.builtin → type.builtin
        variable → variable
        variable.member → variable.other.member
        variable.parameter → variable.parameter
    "#]]
    .assert_eq(&names.into_iter().collect::<String>());
}

#[test]
fn every_list_in_braces_folds() {
    let mut query = Captures::of("folds.scm");
    let mut parser = Parser::new();
    parser.set_language(&language()).unwrap();
    for text in complete_texts() {
        let others = ["param_list", "argument_list", "block_comment"];
        let folds = query.in_text(&text).into_iter().filter(|(_, kind, _)| !others.contains(&kind.as_str()));
        let folds: Vec<_> = folds.map(|(range, kind, _)| (range, kind)).collect();
        let mut lists = Vec::new();
        for_each_node(&parser.parse(&text, None).unwrap(), |_, node| {
            let is_list = (0..node.child_count()).any(|at| node.child(at).unwrap().kind() == "{");
            lists.extend(is_list.then(|| (node.byte_range(), node.kind().to_owned())));
        });
        assert_eq!(folds, lists, "{text}");
    }
}

/// How many levels a line is indented, as an editor counts: at most one level for each earlier line on which captured
/// nodes begin that contain the first token of this line, and one less if the line begins with a closing bracket.
fn levels(captures: &[(Range<usize>, String, String)], text: &str, token: usize, names: [&str; 2]) -> usize {
    let line_of = |at: usize| text[..at].matches('\n').count();
    let [begin, end] = names;
    let begins = captures.iter().filter(|(range, _, name)| {
        name == begin && range.start < token && token < range.end && line_of(range.start) < line_of(token)
    });
    let lines: BTreeSet<usize> = begins.map(|(range, _, _)| line_of(range.start)).collect();
    let closes = captures.iter().any(|(range, _, name)| name == end && range.start == token);
    lines.len() - usize::from(closes)
}

#[test]
fn editors_indent_as_the_formatter_does() {
    let editors = [
        ("indents.scm", ["indent.begin", "indent.branch"]),
        ("helix/indents.scm", ["indent", "outdent"]),
        ("zed/indents.scm", ["indent", "end"]),
    ];
    let texts = models().into_iter().chain(random_models(10)).filter(|(_, text)| !parse(text).has_error);
    let mut lines = 0;
    let texts: Vec<_> = texts.map(|(name, text)| (name, mauve_syntax::format::formatted(&text))).collect();
    for (file, captures) in editors {
        let mut query = Captures::of(file);
        for (name, text) in texts.iter().filter(|(_, text)| text.len() < 10_000) {
            let found = query.in_text(text);
            // The items of lists, and the braces that close these.
            let elements = parse(text).elements;
            let in_list = |at: usize| {
                let (depth, kind, _) = &elements[at];
                let before = elements[..at].iter().rev().take_while(|(other, ..)| other >= depth);
                kind == "}"
                    || *depth == 1
                    || before.filter(|(other, ..)| other == depth).any(|it| it.1 == "{")
            };
            for at in (1..elements.len()).filter(|&at| in_list(at)) {
                let start = elements[at].2.start;
                let indent = &text[text[..start].rfind('\n').map_or(0, |end| end + 1)..start];
                if indent.trim().is_empty() {
                    let levels = levels(&found, text, start, captures);
                    assert_eq!(indent.len(), 2 * levels, "{file}, {name}: {}", &text[start..]);
                    lines += 1;
                }
            }
        }
    }
    assert!(lines > 1000, "{lines} lines");
}
