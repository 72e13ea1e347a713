//! Makes `src/generated/` again from `mauve.ungram`, and fails where the committed files differ.
//!
//! `UPDATE_EXPECT=1 cargo test -p mauve-syntax --test main generated::` writes them.

use std::fmt::Write as _;

use ungrammar::{Grammar, Node, Rule};

#[test]
fn the_generated_files_are_those_of_the_grammar() {
    let grammar: Grammar = include_str!("../mauve.ungram").parse().expect("mauve.ungram is a grammar");
    let kinds = kinds(&grammar);
    let sets = keyword_sets(&grammar);
    let nodes = nodes(&grammar);
    expect_test::expect_file!["../src/generated/kinds.rs"].assert_eq(&kinds);
    expect_test::expect_file!["../src/generated/keywords.rs"].assert_eq(&sets);
    expect_test::expect_file!["../src/generated/nodes.rs"].assert_eq(&nodes);
}

#[test]
fn editors_highlight_every_keyword() {
    let grammar: Grammar = include_str!("../mauve.ungram").parse().expect("mauve.ungram is a grammar");
    let vim = include_str!("../../editors/nvim/syntax/mauve.vim");
    let text_mate = include_str!("../../editors/vscode/syntaxes/mauve.tmLanguage.json");
    let emacs = include_str!("../../editors/emacs/mauve.el");
    for (editor, rules) in [("vim", vim), ("TextMate", text_mate), ("Emacs", emacs)] {
        // An escape such as `\zs` is no part of the word behind it.
        let rules = rules.replace(r"\zs", " ").replace(r"\\b", " ");
        let words: Vec<&str> =
            rules.split(|letter: char| !letter.is_alphanumeric() && letter != '_').collect();
        for keyword in keywords(&grammar) {
            assert!(words.contains(&keyword.as_str()), "the {editor} grammar has no `{keyword}`");
        }
    }
}

const PUNCTUATION: &[(&str, &str)] = &[
    ("{", "L_CURLY"),
    ("}", "R_CURLY"),
    ("(", "L_PAREN"),
    (")", "R_PAREN"),
    ("[", "L_BRACK"),
    ("]", "R_BRACK"),
    (",", "COMMA"),
    (";", "SEMICOLON"),
    (":", "COLON"),
    ("::", "COLON2"),
    (".", "DOT"),
    ("->", "ARROW"),
    ("=", "EQ"),
    ("==", "EQ2"),
    ("!=", "NEQ"),
    ("<", "LT"),
    ("<=", "LTEQ"),
    (">", "GT"),
    (">=", "GTEQ"),
    ("+", "PLUS"),
    ("-", "MINUS"),
    ("*", "STAR"),
    ("/", "SLASH"),
    ("%", "PERCENT"),
    ("!", "BANG"),
    ("&&", "AMP2"),
    ("||", "PIPE2"),
];

/// Tokens that are no fixed text: kind, regular expression or callback for logos (none: `lexer.rs` finds them).
const CLASSES: &[(&str, &str)] = &[
    ("IDENT", r##"#[regex("[A-Za-z_][A-Za-z0-9_]*", priority = 3)]"##),
    ("INT_NUMBER", r##"#[regex("[0-9]+|0[xX][0-9a-fA-F]+", priority = 5)]"##),
    (
        "FLOAT_NUMBER",
        r##"#[regex(r"[0-9]+\.[0-9]+([eE][+-]?[0-9]+)?|[0-9]+[eE][+-]?[0-9]+", priority = 6)]"##,
    ),
    ("BAD_NUMBER", r##"#[regex(r"[0-9][A-Za-z0-9_]*|[0-9]+\.[0-9]+[A-Za-z_][A-Za-z0-9_]*", priority = 4)]"##),
    ("STRING", r##"#[regex(r#""([^"\\\r\n]|\\[^\r\n])*""#)]"##),
    ("UNTERMINATED_STRING", r##"#[regex(r#""([^"\\\r\n]|\\[^\r\n])*\\?"#, priority = 2)]"##),
    ("WHITESPACE", ""),
    ("LINE_COMMENT", r##"#[regex(r"//[^\r\n]*", allow_greedy = true)]"##),
    ("BLOCK_COMMENT", r##"#[token("/*", crate::lexer::block_comment)]"##),
    ("CONFLICT", ""),
    ("ERROR_CHARACTERS", ""),
];

fn kinds(grammar: &Grammar) -> String {
    let keywords = keywords(grammar);
    let mut out = String::from(HEADER);
    out += "\nsyntax_kinds! {\n    texts {\n";
    for (text, kind) in PUNCTUATION {
        writeln!(out, "        {kind} \"{text}\";").unwrap();
    }
    for keyword in &keywords {
        writeln!(out, "        {} \"{keyword}\";", token_kind(keyword)).unwrap();
    }
    out += "    }\n    others {\n";
    for (kind, rule) in CLASSES {
        let rule = if rule.is_empty() { String::new() } else { format!("{rule} ") };
        writeln!(out, "        {rule}{kind};").unwrap();
    }
    for node in structs(grammar) {
        writeln!(out, "        {node};").unwrap();
    }
    out +=
        "        /// Something is missing here, or these tokens fit nowhere.\n        ERROR;\n    }\n}\n\n";
    out += "impl SyntaxKind {\n";
    let literals = first_words(grammar, rule_of(grammar, "Literal"));
    let literals: Vec<String> =
        literals.iter().map(|word| format!("SyntaxKind::{}", token_kind(word))).collect();
    let comments = "SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT";
    let functions = [
        (
            "Is this a word, so that it can be a name?",
            "is_word",
            format!("(SyntaxKind::{}..=SyntaxKind::IDENT).contains(&self)", token_kind(&keywords[0])),
        ),
        (
            "White space, a comment, or a part of a conflict that is not parsed.",
            "is_trivia",
            format!("matches!(self, SyntaxKind::WHITESPACE | {comments} | SyntaxKind::CONFLICT)"),
        ),
        ("A comment.", "is_comment", format!("matches!(self, {comments})")),
        (
            "A keyword that is a literal.",
            "is_literal_keyword",
            format!("matches!(self, {})", literals.join(" | ")),
        ),
    ];
    let functions = functions.map(|(docs, name, body)| {
        format!("    /// {docs}\n    #[inline]\n    pub fn {name}(self) -> bool {{\n        {body}\n    }}\n")
    });
    out + &functions.join("\n") + "}\n"
}

fn keyword_sets(grammar: &Grammar) -> String {
    let mut out = HEADER.replacen("//! ", "//! Sets of keywords.\n//!\n//! ", 1);
    out += "\nuse crate::SyntaxKind;\n";
    for node in grammar.iter().filter(|&node| is_set(grammar, node)) {
        match set(grammar, node).as_slice() {
            [(name, word)] => {
                let name = name.to_uppercase();
                writeln!(out, "\n/// `{word}`\npub const {name}: &str = {word:?};").unwrap();
            }
            words => keyword_set(&mut out, &camel(&grammar[node].name), words),
        }
    }
    let mut list = |name: &str, docs: &str, words: &[String]| {
        writeln!(out, "\n/// {docs}\npub const {name}: [&str; {}] = {words:?};", words.len()).unwrap();
    };
    list("LITERALS", "Keywords that are literals.", &first_words(grammar, rule_of(grammar, "Literal")));
    list(
        "DECLARATIONS",
        "Keywords that begin a declaration.",
        &first_words(grammar, rule_of(grammar, "Item")),
    );
    let mut all: Vec<String> = Vec::new();
    for name in ["Shell", "Core", "StateMachine", "State", "Architecture", "Deployment"] {
        let words = items(grammar, rule_of(grammar, name));
        if matches!(name, "Architecture" | "Deployment") {
            let docs = format!("Keywords that begin an item of `{}`.", lower(name));
            list(&format!("{}_ITEMS", upper(name)), &docs, &words);
        }
        all.extend(words);
    }
    all.sort();
    all.dedup();
    list("ITEMS", "Keywords that begin an item of a declaration, a state machine or a state.", &all);
    out
}

/// An enum with the keywords of a set.
fn keyword_set(out: &mut String, name: &str, words: &[(String, String)]) {
    let docs: Vec<String> = words.iter().map(|(_, word)| format!("`{word}`")).collect();
    writeln!(out, "\nkeyword_set! {{\n    /// {}.\n    {name} {{", docs.join(", ")).unwrap();
    for (variant, word) in words {
        writeln!(out, "        {} {word:?} {};", camel(variant), token_kind(word)).unwrap();
    }
    out.push_str("    }\n}\n");
}

fn nodes(grammar: &Grammar) -> String {
    let mut out = String::from(HEADER);
    out += "\n#![allow(missing_docs)]\n\nuse crate::SyntaxKind::{self, *};\n";
    out += "use crate::ast::{AstNode, children, child, nth_child, token};\n";
    out += "use crate::{SyntaxNode, SyntaxToken};\n";
    for node in grammar.iter().filter(|&node| !is_set(grammar, node)) {
        let name = &grammar[node].name;
        if is_enum(grammar, node) {
            enumeration(&mut out, grammar, node)
        } else {
            structure(&mut out, grammar, node, name)
        }
    }
    out
}

/// The tokens that somebody asks a node for: no others have accessors.
const TOKENS: &[(&str, &str)] = &[
    ("Include", "STRING"),
    ("Library", "L_CURLY"),
    ("Shell", "L_CURLY"),
    ("Core", "COLON"),
    ("Core", "L_CURLY"),
    ("Property", "CONSTANT_KW"),
    ("Port", "INPUT_KW"),
    ("OperationDeclaration", "REQUIRE_KW"),
    ("Hook", "UPDATE_KW"),
    ("StateMachine", "STATEMACHINE_KW"),
    ("Block", "L_CURLY"),
    ("State", "INITIAL_KW"),
    ("State", "STATE_KW"),
    ("State", "L_CURLY"),
    ("Method", "ENTRY_KW"),
    ("Method", "EXIT_KW"),
    ("Buffer", "INT_NUMBER"),
    ("Field", "EQ"),
];

fn structure(out: &mut String, grammar: &Grammar, node: Node, name: &str) {
    let mut fields = Vec::new();
    collect(grammar, &grammar[node].rule, None, false, &mut fields);
    writeln!(out, "\nnode!({name} {} {{", upper(name)).unwrap();
    let mut done: Vec<String> = Vec::new();
    for field in &fields {
        let (method, part) = match field {
            Field::Token(text) => {
                let kind = token_kind(text);
                if !TOKENS.contains(&(name, &kind)) {
                    continue;
                }
                let method = kind.to_lowercase().trim_end_matches("_kw").to_owned() + "_token";
                (method, format!("token {kind}"))
            }
            Field::Node { label, ty, many: true } => {
                let method = label.clone().unwrap_or_else(|| plural(&accessor(ty)));
                (method, format!("children {ty}"))
            }
            Field::Node { label, ty, many: false } => {
                let position = fields
                    .iter()
                    .filter(
                        |other| matches!(other, Field::Node { ty: other, many: false, .. } if other == ty),
                    )
                    .position(|other| std::ptr::eq(other, field))
                    .unwrap();
                let method = label.clone().unwrap_or_else(|| accessor(ty));
                let position = if position == 0 { String::new() } else { format!(" {position}") };
                (method, format!("child {ty}{position}"))
            }
        };
        if !done.contains(&method) {
            writeln!(out, "    {method}: {part};").unwrap();
            done.push(method);
        }
    }
    out.push_str("});\n");
}

fn enumeration(out: &mut String, grammar: &Grammar, node: Node) {
    let Rule::Alt(alternatives) = &grammar[node].rule else { unreachable!() };
    writeln!(out, "\none_of!({} {{", grammar[node].name).unwrap();
    for rule in alternatives {
        let Rule::Node(node) = rule else { unreachable!("checked by is_enum") };
        let name = &grammar[*node].name;
        writeln!(out, "    {name} {};", upper(name)).unwrap();
    }
    out.push_str("});\n");
}

enum Field {
    Token(String),
    Node { label: Option<String>, ty: String, many: bool },
}

fn collect(grammar: &Grammar, rule: &Rule, label: Option<&str>, many: bool, fields: &mut Vec<Field>) {
    match rule {
        Rule::Labeled { label, rule } => collect(grammar, rule, Some(label), many, fields),
        Rule::Node(node) if is_set(grammar, *node) => {
            collect(grammar, &grammar[*node].rule, None, many, fields);
        }
        Rule::Node(node) => {
            let ty = grammar[*node].name.clone();
            let same =
                |field: &Field| matches!(field, Field::Node { ty: other, label: None, .. } if *other == ty);
            if many && let Some(field) = fields.iter_mut().find(|field| same(field)) {
                *field = Field::Node { label: None, ty, many };
                return;
            }
            fields.push(Field::Node { label: label.map(str::to_owned), ty, many });
        }
        Rule::Token(token) => fields.push(Field::Token(grammar[*token].name.clone())),
        Rule::Seq(rules) | Rule::Alt(rules) => {
            rules.iter().for_each(|rule| collect(grammar, rule, label, many, fields));
        }
        Rule::Opt(rule) => collect(grammar, rule, label, many, fields),
        Rule::Rep(rule) => collect(grammar, rule, label, true, fields),
    }
}

fn keywords(grammar: &Grammar) -> Vec<String> {
    let mut keywords: Vec<String> = grammar
        .tokens()
        .map(|token| grammar[token].name.clone())
        .filter(|text| token_kind(text).ends_with("_KW"))
        .collect();
    keywords.sort();
    keywords
}

fn token_kind(text: &str) -> String {
    if let Some((_, kind)) = PUNCTUATION.iter().find(|(punctuation, _)| *punctuation == text) {
        return (*kind).to_owned();
    }
    match CLASSES.iter().find(|(kind, _)| kind.to_lowercase() == text) {
        Some((kind, _)) => (*kind).to_owned(),
        None => text.to_uppercase() + "_KW",
    }
}

fn structs(grammar: &Grammar) -> impl Iterator<Item = String> {
    let nodes = grammar.iter().filter(|&node| !is_enum(grammar, node) && !is_set(grammar, node));
    nodes.map(|node| upper(&grammar[node].name))
}

/// Is this a set of keywords, and not a node?
fn is_set(grammar: &Grammar, node: Node) -> bool {
    grammar[node].name.starts_with(char::is_lowercase)
}

/// The keywords of a set, each with its name, which is the label where there is one.
fn set(grammar: &Grammar, node: Node) -> Vec<(String, String)> {
    let mut rules = vec![&grammar[node].rule];
    if let Rule::Alt(alternatives) = &grammar[node].rule {
        rules = alternatives.iter().collect();
    }
    let named = |rule: &Rule| match rule {
        Rule::Labeled { label, rule } => (label.clone(), first_words(grammar, rule).concat()),
        rule => (first_words(grammar, rule).concat(), first_words(grammar, rule).concat()),
    };
    rules.into_iter().map(named).collect()
}

fn rule_of<'a>(grammar: &'a Grammar, name: &str) -> &'a Rule {
    let mut nodes = grammar.iter().filter(|&node| grammar[node].name == name);
    &grammar[nodes.next().unwrap()].rule
}

/// The keywords that may begin what a rule describes.
fn first_words(grammar: &Grammar, rule: &Rule) -> Vec<String> {
    match rule {
        Rule::Labeled { rule, .. } | Rule::Opt(rule) | Rule::Rep(rule) => first_words(grammar, rule),
        Rule::Node(node) => first_words(grammar, &grammar[*node].rule),
        Rule::Token(token) => {
            let word = grammar[*token].name.clone();
            if token_kind(&word).ends_with("_KW") { vec![word] } else { Vec::new() }
        }
        Rule::Alt(rules) => rules.iter().flat_map(|rule| first_words(grammar, rule)).collect(),
        Rule::Seq(rules) => {
            let is_optional = |rule: &&Rule| matches!(rule, Rule::Opt(_) | Rule::Rep(_));
            let end = rules.iter().take_while(is_optional).count() + 1;
            rules.iter().take(end).flat_map(|rule| first_words(grammar, rule)).collect()
        }
    }
}

/// The keywords that may begin an item between the braces of a rule.
fn items(grammar: &Grammar, rule: &Rule) -> Vec<String> {
    let Rule::Seq(rules) = rule else { unreachable!("a rule with braces") };
    let is_open = |rule: &Rule| matches!(rule, Rule::Token(token) if grammar[*token].name == "{");
    rules.iter().skip_while(|rule| !is_open(rule)).flat_map(|rule| first_words(grammar, rule)).collect()
}

fn is_enum(grammar: &Grammar, node: Node) -> bool {
    matches!(&grammar[node].rule, Rule::Alt(rules) if rules.iter().all(|rule| matches!(rule, Rule::Node(_))))
}

fn upper(name: &str) -> String {
    lower(name).to_uppercase()
}

fn lower(name: &str) -> String {
    let mut out = String::new();
    for (index, letter) in name.char_indices() {
        if letter.is_uppercase() && index > 0 {
            out.push('_');
        }
        out.extend(letter.to_lowercase());
    }
    out
}

/// `in_out` → `InOut`
fn camel(name: &str) -> String {
    let parts = name.split('_').map(|part| part[..1].to_uppercase() + &part[1..]);
    parts.collect()
}

/// The name of an accessor: that of the node, unless it is a word of Rust.
fn accessor(name: &str) -> String {
    match lower(name).as_str() {
        "type" => "ty".to_owned(),
        "else" => "else_branch".to_owned(),
        name => name.to_owned(),
    }
}

fn plural(name: &str) -> String {
    match name.strip_suffix('y').filter(|stem| *stem != "t") {
        Some(stem) => format!("{stem}ies"),
        None => format!("{name}s"),
    }
}

const HEADER: &str = "//! Made by `tests/generated.rs` from `mauve.ungram`: do not edit.\n#![cfg_attr(rustfmt, rustfmt_skip)]\n";
