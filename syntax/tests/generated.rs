//! Makes `src/generated/` again from `mauve.ungram`, and fails where the committed files differ.
//!
//! `UPDATE_EXPECT=1 cargo test -p mauve-syntax --test generated` writes them.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

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
    for (editor, rules) in [("vim", vim), ("TextMate", text_mate)] {
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
    ("ERROR_CHARACTERS", ""),
];

fn kinds(grammar: &Grammar) -> String {
    let keywords = keywords(grammar);
    let mut out = String::from(HEADER);
    out += "\nuse logos::Logos;\n\n";
    out += "/// What a token or a node of the syntax tree is.\n";
    out += "#[allow(missing_docs, non_camel_case_types, clippy::upper_case_acronyms)]\n";
    out += "#[derive(Logos, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]\n#[repr(u8)]\n";
    out += "pub enum SyntaxKind {\n    /// The end of the text: never in a tree.\n    EOF,\n";
    for (text, kind) in PUNCTUATION {
        writeln!(out, "    #[token(\"{text}\")]\n    {kind},").unwrap();
    }
    for keyword in &keywords {
        writeln!(out, "    #[token(\"{keyword}\")]\n    {}_KW,", keyword.to_uppercase()).unwrap();
    }
    for (kind, rule) in CLASSES {
        if !rule.is_empty() {
            writeln!(out, "    {rule}").unwrap();
        }
        writeln!(out, "    {kind},").unwrap();
    }
    for node in structs(grammar) {
        writeln!(out, "    {node},").unwrap();
    }
    out += "    /// Something is missing here, or these tokens fit nowhere.\n    ERROR,\n}\n\n";
    out += "impl SyntaxKind {\n";
    writeln!(out, "    const LAST: u16 = SyntaxKind::ERROR as u16;\n").unwrap();
    out += "    /// All kinds, in the order of their numbers.\n";
    out += "    pub(crate) const ALL: [SyntaxKind; SyntaxKind::LAST as usize + 1] = [\n        SyntaxKind::EOF,\n";
    let tokens = PUNCTUATION.iter().map(|(_, kind)| kind.to_string());
    let words = keywords.iter().map(|keyword| format!("{}_KW", keyword.to_uppercase()));
    let classes = CLASSES.iter().map(|(kind, _)| kind.to_string());
    for kind in tokens.chain(words.clone()).chain(classes).chain(structs(grammar)) {
        writeln!(out, "        SyntaxKind::{kind},").unwrap();
    }
    out += "        SyntaxKind::ERROR,\n    ];\n\n";
    out += "    /// Is this a word, so that it can be a name?\n";
    out += "    #[inline]\n    pub fn is_word(self) -> bool {\n";
    let first = words.clone().next().unwrap();
    writeln!(out, "        (SyntaxKind::{first}..=SyntaxKind::IDENT).contains(&self)\n    }}\n").unwrap();
    out += "    /// White space or a comment.\n";
    out += "    #[inline]\n    pub fn is_trivia(self) -> bool {\n";
    out += "        matches!(self, SyntaxKind::WHITESPACE | SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT)\n    }\n\n";
    out += "    /// A comment.\n";
    out += "    #[inline]\n    pub fn is_comment(self) -> bool {\n";
    out += "        matches!(self, SyntaxKind::LINE_COMMENT | SyntaxKind::BLOCK_COMMENT)\n    }\n\n";
    let literals = first_words(grammar, rule_of(grammar, "Literal"));
    let literals: Vec<String> =
        literals.iter().map(|word| format!("SyntaxKind::{}", token_kind(word))).collect();
    out += "    /// A keyword that is a literal.\n";
    out += "    #[inline]\n    pub fn is_literal_keyword(self) -> bool {\n";
    writeln!(out, "        matches!(self, {})\n    }}\n", literals.join(" | ")).unwrap();
    out += "    /// Returns the text of a token that always has the same one.\n";
    out += "    pub fn text(self) -> Option<&'static str> {\n        Some(match self {\n";
    for (text, kind) in PUNCTUATION {
        writeln!(out, "            SyntaxKind::{kind} => \"{text}\",").unwrap();
    }
    for keyword in &keywords {
        writeln!(out, "            SyntaxKind::{}_KW => \"{keyword}\",", keyword.to_uppercase()).unwrap();
    }
    out += "            _ => return None,\n        })\n    }\n}\n";
    out
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
    let variants: Vec<String> = words.iter().map(|(variant, _)| camel(variant)).collect();
    let docs: Vec<String> = words.iter().map(|(_, word)| format!("`{word}`")).collect();
    writeln!(out, "\n/// {}.\n#[allow(missing_docs)]", docs.join(", ")).unwrap();
    writeln!(out, "#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]\npub enum {name} {{").unwrap();
    for variant in &variants {
        writeln!(out, "    {variant},").unwrap();
    }
    writeln!(out, "}}\n\nimpl {name} {{\n    /// All of them, in the order of the grammar.").unwrap();
    let all: Vec<String> = variants.iter().map(|variant| format!("{name}::{variant}")).collect();
    writeln!(out, "    pub const ALL: [{name}; {}] = [{}];\n", all.len(), all.join(", ")).unwrap();
    writeln!(out, "    /// Returns the keyword.\n    pub fn keyword(self) -> &'static str {{").unwrap();
    writeln!(out, "        match self {{").unwrap();
    for (variant, (_, word)) in all.iter().zip(words) {
        writeln!(out, "            {variant} => {word:?},").unwrap();
    }
    writeln!(out, "        }}\n    }}\n\n    /// Returns the one with `keyword`.").unwrap();
    writeln!(out, "    pub fn from_keyword(keyword: &str) -> Option<{name}> {{").unwrap();
    writeln!(out, "        Self::ALL.into_iter().find(|it| it.keyword() == keyword)\n    }}\n").unwrap();
    writeln!(out, "    /// Returns the one whose keyword is a token of `kind`.").unwrap();
    writeln!(out, "    pub fn from_kind(kind: SyntaxKind) -> Option<{name}> {{\n        match kind {{")
        .unwrap();
    for (variant, (_, word)) in all.iter().zip(words) {
        writeln!(out, "            SyntaxKind::{} => Some({variant}),", token_kind(word)).unwrap();
    }
    writeln!(out, "            _ => None,\n        }}\n    }}\n}}").unwrap();
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

fn structure(out: &mut String, grammar: &Grammar, node: Node, name: &str) {
    let kind = upper(name);
    writeln!(
        out,
        "\n#[derive(Debug, Clone, PartialEq, Eq, Hash)]\npub struct {name}(pub(crate) SyntaxNode);\n"
    )
    .unwrap();
    writeln!(out, "impl AstNode for {name} {{").unwrap();
    writeln!(out, "    fn can_cast(kind: SyntaxKind) -> bool {{\n        kind == {kind}\n    }}\n").unwrap();
    writeln!(out, "    fn cast(node: SyntaxNode) -> Option<Self> {{\n        Self::can_cast(node.kind()).then_some({name}(node))\n    }}\n").unwrap();
    writeln!(out, "    fn syntax(&self) -> &SyntaxNode {{\n        &self.0\n    }}\n}}").unwrap();
    let mut fields = Vec::new();
    collect(grammar, &grammar[node].rule, None, false, &mut fields);
    let mut methods = String::new();
    let mut done: Vec<String> = Vec::new();
    for field in &fields {
        let (method, result, body) = match field {
            Field::Token(text) => {
                let kind = token_kind(text);
                let method = kind.to_lowercase().trim_end_matches("_kw").to_owned() + "_token";
                (method, "Option<SyntaxToken>".to_owned(), format!("token(&self.0, {kind})"))
            }
            Field::Node { label, ty, many: true } => {
                let method = label.clone().unwrap_or_else(|| plural(&accessor(ty)));
                (method, format!("impl Iterator<Item = {ty}>"), "children(&self.0)".to_owned())
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
                let body = if position == 0 {
                    "child(&self.0)".to_owned()
                } else {
                    format!("nth_child(&self.0, {position})")
                };
                (method, format!("Option<{ty}>"), body)
            }
        };
        if done.contains(&method) {
            continue;
        }
        let gap = if done.is_empty() { "" } else { "\n" };
        writeln!(methods, "{gap}    pub fn {method}(&self) -> {result} {{\n        {body}\n    }}").unwrap();
        done.push(method);
    }
    if !methods.is_empty() {
        writeln!(out, "\nimpl {name} {{\n{methods}}}").unwrap();
    }
}

fn enumeration(out: &mut String, grammar: &Grammar, node: Node) {
    let name = &grammar[node].name;
    let Rule::Alt(alternatives) = &grammar[node].rule else { unreachable!() };
    let variants: Vec<&str> = alternatives
        .iter()
        .map(|rule| match rule {
            Rule::Node(node) => grammar[*node].name.as_str(),
            _ => unreachable!("checked by is_enum"),
        })
        .collect();
    writeln!(out, "\n#[derive(Debug, Clone, PartialEq, Eq, Hash)]\npub enum {name} {{").unwrap();
    for variant in &variants {
        writeln!(out, "    {variant}({variant}),").unwrap();
    }
    writeln!(out, "}}\n\nimpl AstNode for {name} {{\n    fn can_cast(kind: SyntaxKind) -> bool {{").unwrap();
    let kinds: Vec<String> = variants.iter().map(|variant| upper(variant)).collect();
    writeln!(out, "        matches!(kind, {})\n    }}\n", kinds.join(" | ")).unwrap();
    writeln!(out, "    fn cast(node: SyntaxNode) -> Option<Self> {{\n        Some(match node.kind() {{")
        .unwrap();
    for (variant, kind) in variants.iter().zip(&kinds) {
        writeln!(out, "            {kind} => {name}::{variant}({variant}(node)),").unwrap();
    }
    writeln!(out, "            _ => return None,\n        }})\n    }}\n").unwrap();
    writeln!(out, "    fn syntax(&self) -> &SyntaxNode {{\n        match self {{").unwrap();
    for variant in &variants {
        writeln!(out, "            {name}::{variant}(it) => it.syntax(),").unwrap();
    }
    writeln!(out, "        }}\n    }}\n}}").unwrap();
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
