//! `{ … }`: programs, and the statements in them.

use super::*;
use crate::foreign::Foreign;
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
        IF_KW if next != EQ => if_(p),
        RETURN_KW if next != EQ => return_(p),
        L_CURLY => {
            let m = p.start();
            block(p);
            m.complete(p, BLOCK_STATEMENT);
        }
        kind if kind.is_word() && next == EQ => assignment(p),
        kind if starts_expression(kind) => {
            let before = p.checkpoint();
            let form = foreign::section(p);
            let m = p.start();
            expression(p);
            let is_call = p.at(SEMICOLON) || p.begins_line() && !p.at(L_CURLY);
            match form.filter(|_| !is_call || p.has_failed_since(&before)) {
                Some(form) => {
                    p.rewind(&before);
                    foreign::take_section(p, form);
                }
                None => {
                    end_of_statement(p, &before);
                    m.complete(p, EXPR_STATEMENT);
                }
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
/// Takes the `;` of a statement. An error before it is one mistake with all text before the `;`.
fn end_of_statement(p: &mut Parser<'_>, before: &Checkpoint) {
    if p.eat(SEMICOLON) {
        return;
    }
    if !p.has_failed_since(before) {
        p.missing(Expected::Token(SEMICOLON));
        let next = matches!(p.nth(1), EQ | L_PAREN) && p.current().is_word();
        if next || matches!(p.current(), IF_KW | RETURN_KW | VAR_KW) {
            return;
        }
    }
    p.drop_until(foreign::ends_statement);
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
fn if_(p: &mut Parser<'_>) {
    let m = p.start();
    if p.depth >= DEEPEST {
        p.too_deep(|p| p.at(R_CURLY) || p.previous() == R_CURLY && !p.at(ELSE_KW) && !at_foreign_else(p));
        m.complete(p, IF_STATEMENT);
        return;
    }
    p.eat(IF_KW);
    if_rest(p);
    m.complete(p, IF_STATEMENT);
}

// test_err branches_of_other_languages
// core C(S) { update = {
//   if a then { f(); } elif (b) then { g(); } else { h(); }
//   if a then f(); else g();
//   if (a) f();
//   else { g(); }
//   if a then { f(); } else g();
//   if a { f(); }
//   h();
// } }
/// Takes the condition and the branches of an `if`.
fn if_rest(p: &mut Parser<'_>) {
    expression::condition(p);
    // A missing `then` is one mistake: the block is present.
    if !p.eat(THEN_KW) && !at_branch(p) {
        p.missing(Expected::Token(THEN_KW));
        if p.at(COLON) && !p.begins_line() {
            p.drop_tokens(1);
        }
        if !p.at(L_CURLY) {
            return;
        }
    }
    if at_branch(p) {
        foreign::take_section(p, Foreign::Braces);
        return;
    }
    block(p);
    let is_foreign = at_foreign_else(p);
    if is_foreign || p.at(ELSE_KW) && !matches!(p.nth(1), EQ | L_PAREN) {
        else_(p, is_foreign);
    }
}

/// Returns whether this is `elif`.
fn at_foreign_else(p: &Parser<'_>) -> bool {
    p.nth_is_instead_of(0, ELSE_KW) && !matches!(p.nth(1), EQ | SEMICOLON)
}

/// Returns whether the branch of an `if` begins here, on its line, without braces.
fn at_branch(p: &Parser<'_>) -> bool {
    let is_statement = matches!(p.nth(1), EQ | L_PAREN) || p.at(RETURN_KW);
    !p.begins_line() && p.current().is_word() && is_statement
}

/// Takes `else` and its branch. With `has_if`, the word replaces `else if`.
fn else_(p: &mut Parser<'_>, has_if: bool) {
    let m = p.start();
    match has_if {
        true => foreign::take_as(p, 1, ELSE_KW),
        false => p.bump(),
    }
    match p.current() {
        _ if has_if || p.at(IF_KW) => {
            p.depth += 1;
            if_(p);
            p.depth -= 1;
        }
        L_CURLY => block(p),
        _ if at_branch(p) => foreign::take_section(p, Foreign::Braces),
        _ => p.missing(Expected::BlockOrIf),
    }
    m.complete(p, ELSE);
}

fn return_(p: &mut Parser<'_>) {
    let before = p.checkpoint();
    let m = p.start();
    p.bump();
    if !p.at(SEMICOLON) && starts_expression(p.current()) && !p.at_item() {
        expression(p);
    }
    end_of_statement(p, &before);
    m.complete(p, RETURN_STATEMENT);
}

fn assignment(p: &mut Parser<'_>) {
    let before = p.checkpoint();
    let m = p.start();
    // The first word of a statement is a name, although it begins its line.
    any_word(p, NAME_REF);
    p.bump();
    expression(p);
    end_of_statement(p, &before);
    m.complete(p, ASSIGN_STATEMENT);
}
