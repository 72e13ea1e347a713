//! `{ … }`: programs, and the statements in them.

use super::*;
use crate::foreign::{Foreign, ForeignWord};
use crate::parser::Checkpoint;

// test block
// core C(S) { update = {
//   var n: int = read(scan, s);
//   var m: int
//   n = n + 1;
//   publish(n);
//   { inner(); };
//   ;
//   return n;
// } stop = { return; } }
pub(super) fn block(p: &mut Parser<'_>) {
    if !p.at(L_CURLY) {
        p.missing(Expected::Token(L_CURLY));
        return;
    }
    let m = p.start();
    if p.depth >= DEEPEST {
        p.too_deep(|_| true);
        m.complete(p, BLOCK);
        return;
    }
    p.depth += 1;
    list(p, BLOCK);
    p.depth -= 1;
    m.complete(p, BLOCK);
}

pub(super) fn statement(p: &mut Parser<'_>) {
    let next = p.nth(1);
    match p.current() {
        _ if foreign::opt_statement(p) => {}
        VAR_KW if next.is_word() && (p.nth(2) == COLON || !p.nth_begins_line(1)) => core::variable(p),
        IF_KW if next != EQ => if_(p, true),
        RETURN_KW if next != EQ => return_(p),
        L_CURLY => {
            let m = p.start();
            block(p);
            m.complete(p, BLOCK_STATEMENT);
        }
        kind if kind.is_word() && next == EQ => assignment(p),
        kind if starts_expression(kind) => {
            let before = p.checkpoint();
            let m = p.start();
            expression(p);
            if !end_of_statement(p, &before) {
                m.complete(p, EXPR_STATEMENT);
            }
        }
        _ => unknown(p, BLOCK),
    }
}

// test_err one_error_for_each_statement
// core C(S) { update = {
//   a b c d;
//   x = 3 = 4 = 5;
//   pose.x = 3;
//   goal.read(g);
//   f(a) g(b);
//   x = * 3;
//   y = (3 + ;
//   z = 1;
// } }
/// Takes the `;` of a statement. An error before it is one mistake with all text before the `;`. Returns whether the
/// text was not a statement: then its tokens are in other nodes.
fn end_of_statement(p: &mut Parser<'_>, before: &Checkpoint) -> bool {
    let has_failed = p.has_failed_since(before);
    if p.at(SEMICOLON) && !has_failed && !foreign::is_decrement(p, before) {
        p.bump();
        return false;
    }
    if (has_failed || !p.begins_line() || p.at(L_CURLY)) && foreign::opt_whole_statement(p, before) {
        return true;
    }
    if p.eat(SEMICOLON) {
        return false;
    }
    if !has_failed {
        p.missing(Expected::Token(SEMICOLON));
        let next = matches!(p.nth(1), EQ | L_PAREN) && p.current().is_word();
        if next || matches!(p.current(), IF_KW | RETURN_KW | VAR_KW) {
            return false;
        }
    }
    p.drop_until(foreign::ends_statement);
    false
}

pub(super) fn starts_expression(kind: SyntaxKind) -> bool {
    kind.is_word()
        || matches!(
            kind,
            INT_NUMBER | FLOAT_NUMBER | BAD_NUMBER | STRING | UNTERMINATED_STRING | L_PAREN | BANG | MINUS
        )
}

// test if_
// core C(S) { update = {
//   if (a == 1) then { f(); } else if b then { } else { g(); };
//   if a then { }
//   else = 3;
// } }
// test_err if_half_typed
// core C(S) { update = {
//   if a
//   x = 1;
//   if
//   y = 2;
//   if a then { } else
//   z = 3;
//   if b { g(); } else { }
// } }
fn if_(p: &mut Parser<'_>, needs_braces: bool) {
    let m = p.start();
    if p.depth >= DEEPEST {
        too_deep(p);
        m.complete(p, IF_STATEMENT);
        return;
    }
    p.bump();
    if_rest(p, needs_braces);
    m.complete(p, IF_STATEMENT);
}

// test_err branches_of_other_languages
// core C(S) { update = {
//   if a then { f(); } elif b { g(); } else { h(); }
//   if a then f(); else g();
//   if (a) f();
//   if a then begin f(); end
//   if a { f(); }
//   h();
// } }
/// Takes the condition and the branches of an `if`. Without `needs_braces`, branches without braces were already
/// reported.
pub(super) fn if_rest(p: &mut Parser<'_>, needs_braces: bool) {
    expression::condition(p);
    // A missing `then` is one mistake: the block is present.
    let has_then = p.eat(THEN_KW) || foreign::opt_instead_of(p, THEN_KW);
    if !has_then && (p.at(L_CURLY) || !at_branch(p)) {
        p.missing(Expected::Token(THEN_KW));
        if p.at(COLON) && !p.begins_line() {
            p.drop_tokens(1);
        }
        if !p.at(L_CURLY) {
            return;
        }
    }
    let has_braces = p.at(L_CURLY) || !at_branch(p);
    match has_braces {
        true => block(p),
        false => unbraced(p, needs_braces),
    }
    if p.at(ELSE_KW) && !matches!(p.nth(1), EQ | L_PAREN) {
        else_(p, needs_braces && has_braces);
    } else if at_foreign_else(p) {
        let m = p.start();
        p.foreign(Foreign::Spelling { tokens: 1, written: "else if" });
        p.bump_as(ELSE_KW);
        p.depth += 1;
        let nested = p.start();
        match p.depth >= DEEPEST {
            true => too_deep(p),
            false => if_rest(p, needs_braces && has_braces),
        }
        nested.complete(p, IF_STATEMENT);
        p.depth -= 1;
        m.complete(p, ELSE);
    }
}

/// Returns whether this is `elif`.
fn at_foreign_else(p: &Parser<'_>) -> bool {
    p.nth_is_foreign(0, ForeignWord::ElseIf) && !matches!(p.nth(1), EQ | L_PAREN | SEMICOLON)
}

fn too_deep(p: &mut Parser<'_>) {
    p.too_deep(|p| p.at(R_CURLY) || p.previous() == R_CURLY && !p.at(ELSE_KW) && !at_foreign_else(p));
}

/// Returns whether the branch of an `if` begins here, on its line, without braces.
fn at_branch(p: &Parser<'_>) -> bool {
    let is_statement =
        matches!(p.nth(1), EQ | L_PAREN) || p.at(RETURN_KW) || p.nth_is_foreign(0, ForeignWord::Brace);
    !p.begins_line() && p.current().is_word() && is_statement
}

/// Takes a branch without braces: one statement, and optionally the word that closes it.
fn unbraced(p: &mut Parser<'_>, needs_braces: bool) {
    if needs_braces {
        p.foreign(Foreign::Braces);
    }
    let m = p.start();
    p.depth += 1;
    p.enter(BLOCK);
    if foreign::at_brace(p) {
        p.drop_tokens(1);
    }
    if !p.at_end() && !p.at(R_CURLY) && !p.at_outer_item() {
        statement(p);
    }
    if foreign::at_brace(p) {
        p.drop_tokens(1 + usize::from(p.nth(1) == SEMICOLON));
    }
    p.leave();
    p.depth -= 1;
    m.complete(p, BLOCK);
}

/// Takes `else` and its branch.
fn else_(p: &mut Parser<'_>, needs_braces: bool) {
    node(p, ELSE, |p| match p.current() {
        IF_KW => {
            p.depth += 1;
            if_(p, needs_braces);
            p.depth -= 1;
        }
        L_CURLY => block(p),
        _ if at_branch(p) => unbraced(p, needs_braces),
        _ => p.missing(Expected::BlockOrIf),
    });
}

fn return_(p: &mut Parser<'_>) {
    let before = p.checkpoint();
    let m = p.start();
    p.bump();
    if !p.at(SEMICOLON) && starts_expression(p.current()) && !p.at_item() {
        expression(p);
    }
    if !end_of_statement(p, &before) {
        m.complete(p, RETURN_STATEMENT);
    }
}

fn assignment(p: &mut Parser<'_>) {
    let before = p.checkpoint();
    let m = p.start();
    // The first word of a statement is a name, although it begins its line.
    any_word(p, NAME_REF);
    p.bump();
    expression(p);
    if !end_of_statement(p, &before) {
        m.complete(p, ASSIGN_STATEMENT);
    }
}
