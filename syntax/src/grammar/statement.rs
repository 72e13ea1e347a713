//! `{ … }`: programs, and the statements in them.

use super::*;

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
    list(p, List::Block);
    p.depth -= 1;
    m.complete(p, BLOCK);
}

pub(super) fn statement(p: &mut Parser<'_>) {
    let next = p.nth(1);
    match p.current() {
        VAR_KW if next.is_word() && p.nth(2) == COLON => core::variable(p),
        IF_KW if next != EQ => if_(p),
        RETURN_KW if next != EQ => return_(p),
        L_CURLY => {
            let m = p.start();
            block(p);
            m.complete(p, BLOCK_STATEMENT);
        }
        kind if kind.is_word() && next == EQ => assignment(p),
        kind if starts_expression(kind) => {
            let m = p.start();
            expression(p);
            p.expect(SEMICOLON);
            m.complete(p, EXPR_STATEMENT);
        }
        _ => unknown(p, List::Block),
    }
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
        p.too_deep(|p| p.at(R_CURLY) || p.previous() == R_CURLY && !p.at(ELSE_KW));
        m.complete(p, IF_STATEMENT);
        return;
    }
    p.bump();
    expression(p);
    // A forgotten `then` is one mistake: the block is there.
    if p.expect(THEN_KW) || p.at(L_CURLY) {
        block(p);
        if p.at(ELSE_KW) && !matches!(p.nth(1), EQ | L_PAREN) {
            else_(p);
        }
    }
    m.complete(p, IF_STATEMENT);
}

fn else_(p: &mut Parser<'_>) {
    node(p, ELSE, |p| match p.current() {
        IF_KW => {
            p.depth += 1;
            if_(p);
            p.depth -= 1;
        }
        L_CURLY => block(p),
        _ => p.missing(Expected::BlockOrIf),
    });
}

fn return_(p: &mut Parser<'_>) {
    node(p, RETURN_STATEMENT, |p| {
        if !p.at(SEMICOLON) && starts_expression(p.current()) && !p.at_item() {
            expression(p);
        }
        p.expect(SEMICOLON);
    });
}

fn assignment(p: &mut Parser<'_>) {
    let m = p.start();
    // The first word of a statement: it begins its line, and is a name all the same.
    any_word(p, NAME_REF);
    p.bump();
    expression(p);
    p.expect(SEMICOLON);
    m.complete(p, ASSIGN_STATEMENT);
}
