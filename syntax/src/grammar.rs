//! The rules of the grammar, from tokens to events. A rule `foo` always makes a node or an error; `opt_foo` may make
//! none.
//!
//! A test parses the comment above a rule that begins with `test` and a name, and compares the tree with
//! `test_data/<name>.txt`: `test` has no error, `test_err` has at least one.

mod architecture;
mod core;
mod deployment;
mod expression;
mod foreign;
mod shell;
mod statement;

use crate::SyntaxKind::{self, *};
use crate::error::{Expected, SyntaxErrorKind};
use crate::foreign::Foreign;
use crate::keywords::DECLARATIONS;
use crate::lexer::lex;
use crate::list::item_keywords;
use crate::parser::{CompletedMarker, DEEPEST, Parser};
use crate::spelling::similar;
use crate::tree::{self, Parse};

use expression::{expression, opt_expression};
use statement::block;

/// The maximal length of a text that is parsed, in bytes: offsets in a tree are 32-bit numbers.
pub const LONGEST_TEXT: usize = u32::MAX as usize / 2;

/// Parses a file. Any text gives a tree with the same text.
///
/// A text of more than [`LONGEST_TEXT`] bytes gives an empty tree with one error.
pub fn parse(text: &str) -> Parse {
    if text.len() > LONGEST_TEXT {
        return tree::too_long();
    }
    let lexed = lex(text);
    let mut parser = Parser::new(text, &lexed);
    source_file(&mut parser);
    tree::build(text, &lexed, parser.finish())
}

// test source_file
// include "hokuyo.mal"
// library nav { use geometry_msgs codel f(): int }
// codel g(): int;
// test_err conflict
// core C(S) {
// <<<<<<< HEAD
//   update = { f(1); }
// =======
//   update = { f(2); }
// >>>>>>> feature
// }
// <<<<<<< HEAD
// codel f(n: int): int
// ||||||| 1a2b3c
// =======
// codel f(n: double): int
// >>>>>>> feature
fn source_file(p: &mut Parser<'_>) {
    let m = p.start();
    p.enter(SOURCE_FILE);
    let (mut declared, mut late) = (false, false);
    while !p.at_end() {
        if p.at(INCLUDE_KW) {
            // Only the first late one is reported.
            include(p, declared && !late);
            late |= declared;
        } else {
            declared |= p.word().is_some_and(|word| DECLARATIONS.contains(&word));
            item(p, SOURCE_FILE);
        }
    }
    p.leave();
    p.unterminated_comment();
    p.rest();
    m.complete(p, SOURCE_FILE);
}

// test use_
// use geometry_msgs
// use use
fn declaration(p: &mut Parser<'_>) {
    match p.current() {
        INCLUDE_KW => include(p, true),
        USE_KW => node(p, USE, |p| name_ref(p, Expected::PackageName)),
        CODEL_KW => signature(p, CODEL),
        SHELL_KW => shell::shell(p),
        CORE_KW => core::core(p),
        COMPONENT_KW => component(p),
        ARCHITECTURE_KW => named_list(p, ARCHITECTURE),
        DEPLOYMENT_KW => named_list(p, DEPLOYMENT),
        SEMICOLON => p.bump(),
        _ if foreign::opt_declaration(p) => {}
        _ => unknown(p, LIBRARY),
    }
}

// test_err include_after_declaration
// # robot
// include "a.mal"
// include components/b.mal
// codel f(): int
// include "late.mal"
// include "later.mal"
fn include(p: &mut Parser<'_>, late: bool) {
    let m = p.start();
    if late {
        p.error(SyntaxErrorKind::LateInclude);
    }
    p.bump();
    match p.current() {
        STRING | UNTERMINATED_STRING => p.bump(),
        _ if p.at_end() || p.begins_line() => p.missing(Expected::Token(STRING)),
        _ => p.skip(SyntaxErrorKind::PathWithoutQuotes, |p| p.begins_line()),
    }
    m.complete(p, INCLUDE);
}

// test library
// library nav {
//   use std_msgs;
//   codel f(): int
// }
// library nav { }
fn library(p: &mut Parser<'_>) {
    named_list(p, LIBRARY);
}

/// `keyword Name { … }`
fn named_list(p: &mut Parser<'_>, kind: SyntaxKind) {
    node(p, kind, |p| {
        name(p);
        list(p, kind);
    });
}

// test codel
// codel astar(in start: geometry_msgs::PoseStamped, goal: nav.Pose, out path: Path, inout in: int): bool
// codel in(out: int): void
/// `keyword name(parameters): Type`
fn signature(p: &mut Parser<'_>, kind: SyntaxKind) {
    node(p, kind, |p| {
        // `codel int act(…)`
        if p.at(IDENT) && p.nth(1).is_word() && p.nth(2) == L_PAREN && !p.nth_begins_line(1) {
            p.foreign(Foreign::ResultFirst);
            p.drop_tokens(1);
            name(p);
            parameters(p);
            return;
        }
        name(p);
        parameters(p);
        colon_type(p);
    });
}

/// `( [in|out|inout] name: Type, … )`
fn parameters(p: &mut Parser<'_>) {
    if !p.at(L_PAREN) {
        p.missing(Expected::Parameters);
        return;
    }
    node(p, PARAM_LIST, |p| {
        separated(p, R_PAREN, Expected::Parameter, parameter);
        p.expect(R_PAREN);
    });
}

fn parameter(p: &mut Parser<'_>) -> bool {
    if !p.at_name() {
        return false;
    }
    let m = p.start();
    // `in`, `out` and `inout` are directions only before a name.
    if matches!(p.current(), IN_KW | OUT_KW | INOUT_KW) && p.nth(1).is_word() {
        p.bump();
    }
    if !foreign::opt_parameter(p) {
        declared_type(p);
    }
    m.complete(p, PARAM);
    true
}

// test component
// component Pilot(PilotShell, nav::PilotCore)
fn component(p: &mut Parser<'_>) {
    node(p, COMPONENT, |p| {
        name(p);
        p.expect(L_PAREN);
        type_(p, Expected::ShellName);
        p.expect(COMMA);
        type_(p, Expected::CoreName);
        p.expect(R_PAREN);
    });
}

// Nodes, names, types and lists, which every rule uses

/// Makes a node of the current token and the tokens that `rest` takes after it.
fn node(p: &mut Parser<'_>, kind: SyntaxKind, rest: impl FnOnce(&mut Parser<'_>)) {
    let m = p.start();
    p.bump();
    rest(p);
    m.complete(p, kind);
}

fn name(p: &mut Parser<'_>) {
    word(p, NAME, Expected::Name);
}

fn name_ref(p: &mut Parser<'_>, what: Expected) {
    word(p, NAME_REF, what);
}

fn word(p: &mut Parser<'_>, kind: SyntaxKind, what: Expected) {
    match p.at_name() {
        true => any_word(p, kind),
        false => p.missing(what),
    }
}

/// Takes the current word as a name, also if it begins a line like an item.
fn any_word(p: &mut Parser<'_>, kind: SyntaxKind) {
    let m = p.start();
    p.bump_as(IDENT);
    m.complete(p, kind);
}

// test type_
// shell S { input port a: std_msgs.msg::Float64 }
// test_err type_without_its_last_part
// shell S { input port a: std_msgs:: }
fn type_(p: &mut Parser<'_>, what: Expected) {
    if !p.at_name() {
        p.missing(what);
        return;
    }
    let m = p.start();
    name_ref(p, what);
    let mut has_slash = false;
    loop {
        match p.current() {
            DOT | COLON2 => p.bump(),
            SLASH if p.nth(1).is_word() && !p.begins_line() => {
                if !std::mem::replace(&mut has_slash, true) {
                    p.foreign(Foreign::Spelling { tokens: 1, written: "::" });
                }
                p.drop_tokens(1);
            }
            _ => break,
        }
        name_ref(p, Expected::Name);
    }
    foreign::opt_type_suffix(p);
    m.complete(p, TYPE);
}

/// `name: Type`
fn declared_type(p: &mut Parser<'_>) {
    if !opt_type_before_name(p) {
        name(p);
        colon_type(p);
    }
}

/// Takes `int n` instead of `n: int`: the type is unknown, so no other error is reported.
fn opt_type_before_name(p: &mut Parser<'_>) -> bool {
    let is_one = p.at_type_before_name();
    if is_one {
        p.foreign(Foreign::TypeFirst);
        p.drop_tokens(1);
        name(p);
    }
    is_one
}

/// Takes `kind` or its form in other languages, or reports that it is missing.
fn expect_or_foreign(p: &mut Parser<'_>, kind: SyntaxKind) -> bool {
    p.at(kind) && p.expect(kind) || foreign::opt_instead_of(p, kind) || p.expect(kind)
}

// test_err type_without_its_colon
// codel plan(in goal Pose, out way: Path) bool
fn colon_type(p: &mut Parser<'_>) {
    // A missing colon is one mistake: the next word on the line is the type, unless it begins or names the next item.
    let is_type = |p: &Parser<'_>| p.at_name() && !p.begins_line() && !p.at_own_item() && p.nth(1) != L_CURLY;
    if expect_or_foreign(p, COLON) || is_type(p) {
        type_(p, Expected::Type);
    }
}

/// Takes `{ item … }`. Items may be separated by `;`.
fn list(p: &mut Parser<'_>, kind: SyntaxKind) {
    foreign::opt_superfluous(p, L_CURLY);
    if !p.eat(L_CURLY) {
        p.missing(Expected::Token(L_CURLY));
        // Text between a header and its list is part of the same mistake.
        p.drop_until(|p| matches!(p.current(), L_CURLY | R_CURLY | SEMICOLON) || p.begins_line());
        if !p.eat(L_CURLY) {
            return;
        }
    }
    p.enter(kind);
    items(p, kind, |_| false);
    p.leave();
    p.expect(R_CURLY);
}

/// Takes the items of an open list, up to `done` or to the end of the list. Returns whether it was `done`.
pub(crate) fn items(p: &mut Parser<'_>, kind: SyntaxKind, done: impl Fn(&Parser<'_>) -> bool) -> bool {
    loop {
        if done(p) {
            return true;
        }
        if p.at_end() || kind != SOURCE_FILE && (p.at(R_CURLY) || p.at_outer_item()) {
            return false;
        }
        if p.at(COMMA) && has_fields(kind) && p.previous() != L_CURLY {
            commas(p, kind);
        } else if !p.eat(SEMICOLON) {
            item(p, kind);
        }
    }
}

/// Lists whose items newcomers separate by commas.
fn has_fields(kind: SyntaxKind) -> bool {
    matches!(kind, ACTIVITY | DEPLOYMENT | ARCHITECTURE | SHELL | CORE)
}

// test_err commas_between_items
// deployment D { activity a { period = 10, priority = 3, deadline = 5 } }
/// Takes items that commas separate, as one mistake.
fn commas(p: &mut Parser<'_>, kind: SyntaxKind) {
    p.foreign(Foreign::Comma);
    while p.at(COMMA) {
        p.drop_tokens(1);
        match p.at_own_item() {
            true => item(p, kind),
            false => p.drop_until(|p| p.begins_line() || matches!(p.current(), COMMA | R_CURLY)),
        }
    }
}

fn item(p: &mut Parser<'_>, kind: SyntaxKind) {
    foreign::opt_item_keyword(p, kind);
    match kind {
        SOURCE_FILE if p.at(LIBRARY_KW) => library(p),
        SOURCE_FILE | LIBRARY => declaration(p),
        SHELL => shell::shell_item(p),
        CORE => core::core_item(p),
        STATE_MACHINE => core::state_machine_item(p),
        STATE => core::state_item(p),
        ARCHITECTURE => architecture::architecture_item(p),
        DEPLOYMENT => deployment::deployment_item(p),
        ACTIVITY => deployment::field(p),
        _ => statement::statement(p),
    }
}

/// Takes `one, two, …` up to `close`, which the caller takes.
fn separated(p: &mut Parser<'_>, close: SyntaxKind, what: Expected, one: impl Fn(&mut Parser<'_>) -> bool) {
    while !p.at_end() && !p.at(close) {
        if !one(p) {
            p.missing(what);
            if !p.at(COMMA) {
                break;
            }
        }
        if !p.eat(COMMA) {
            // A missing comma is one mistake: the next word on the line is the next element.
            let next = p.current().is_word() || matches!(p.current(), INT_NUMBER | FLOAT_NUMBER | STRING);
            if !next || p.begins_line() {
                break;
            }
            p.missing(Expected::Token(COMMA));
            continue;
        }
        if p.at(close) {
            p.missing(what);
        }
    }
}

/// Takes unexpected text in a list as one error, up to the next item or the next line.
fn unknown(p: &mut Parser<'_>, list: SyntaxKind) {
    let words = item_keywords(list).into_iter().flatten().flat_map(|words| words.split(' '));
    let similar = p.word().and_then(|word| similar(word, words));
    let expected = Expected::Item(list);
    p.skip(SyntaxErrorKind::Expected { expected, found: Some(p.current()), similar }, |p| {
        // Outside all braces, a stray `}` is one mistake with the misplaced items after it.
        let outside = !p.is_in(LIBRARY) && list == LIBRARY;
        p.at_item()
            || p.at_start_of(list)
            || !outside && (p.at(R_CURLY) || p.at(SEMICOLON) || p.begins_line())
    });
}

// test every_keyword_is_contextual
// shell shell { input port map: input  output port next: to  property state: int  input port port: entry }
// core core(shell) {
//   var var: int
//   statemachine {
//     initial state entry { entry = { if = 1; return = if; } transition to if (x) to to }
//     state to { transition transition to entry }
//   }
// }
// component component(shell, core)
// architecture architecture { instance switch: component  connection connection.next -> to.map  instance instance: a }
// deployment deployment { architecture architecture activity activity { priority = background period = period } }
