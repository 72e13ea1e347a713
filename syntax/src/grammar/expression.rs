//! Expressions, by precedence climbing. All binary operators are left-associative.

use super::statement::starts_expression;
use super::*;

// test expressions
// core C(S) { update = {
//   x = a || b && c == d + e * -f % (g - 1) / 2;
//   y = !done && read(scan, s) == new_data;
//   z = 1.5e-3 + 0x1F - "text" + true;
// } }
// test_err missing_operand
// core C(S) { update = {
//   x = a +
//   y = (b
//   z = f(a,
//   w = ;
// } }
pub(super) fn expression(p: &mut Parser<'_>) {
    let found = operators(p, 1);
    height_of(p, found);
}

/// Takes an expression, and returns whether one begins here.
pub(super) fn opt_expression(p: &mut Parser<'_>) -> bool {
    operators(p, 1).is_some()
}

/// Takes the condition of an `if` or a transition, in which `=` is reported as a comparison.
pub(super) fn condition(p: &mut Parser<'_>) {
    p.in_condition = true;
    expression(p);
    p.in_condition = false;
}

/// Returns the height of the tree of an expression, or reports that the expression is missing.
fn height_of(p: &mut Parser<'_>, found: Option<(CompletedMarker, u32)>) -> u32 {
    if found.is_none() {
        p.missing(Expected::Expression);
    }
    found.map_or(0, |(_, height)| height)
}

/// Returns the precedence of an operator, from 1.
fn strength(kind: SyntaxKind) -> u8 {
    match kind {
        PIPE2 => 1,
        AMP2 => 2,
        EQ2 | NEQ => 3,
        LT | LTEQ | GT | GTEQ => 4,
        PLUS | MINUS => 5,
        STAR | SLASH | PERCENT => 6,
        _ => 0,
    }
}

const COMPARISON: u8 = 4;

/// Takes operators with a precedence of at least `weakest`, and returns the node and the height of its tree; none if no
/// expression begins here.
// test_err comparisons_do_not_chain
// core C(S) { update = { x = a < b < c; } }
fn operators(p: &mut Parser<'_>, weakest: u8) -> Option<(CompletedMarker, u32)> {
    let (mut lhs, mut height) = operand(p)?;
    loop {
        let other = foreign::operator(p);
        let strength = strength(other.map_or(p.current(), |(kind, _)| kind));
        if strength == 0 || strength < weakest {
            return Some((lhs, height));
        }
        if strength == COMPARISON && weakest == COMPARISON + 1 {
            return Some((lhs, height));
        }
        // Each operator adds a level above its left operand.
        if p.depth + height >= DEEPEST {
            let m = lhs.precede(p);
            p.too_deep(ends_expression);
            return Some((m.complete(p, BINARY_EXPR), height + 1));
        }
        let m = lhs.precede(p);
        match other {
            Some((kind, tokens)) => foreign::take_as(p, tokens, kind),
            None => p.bump(),
        }
        p.depth += 1;
        let rhs = if p.at_item() { None } else { operators(p, strength + 1) };
        p.depth -= 1;
        height = height.max(height_of(p, rhs)) + 1;
        if strength == COMPARISON && self::strength(p.current()) == COMPARISON {
            p.error(SyntaxErrorKind::ChainedComparison);
        }
        lhs = m.complete(p, BINARY_EXPR);
    }
}

fn operand(p: &mut Parser<'_>) -> Option<(CompletedMarker, u32)> {
    if !starts_expression(p.current()) || p.at_item() {
        return None;
    }
    let m = p.start();
    if p.depth >= DEEPEST && !(p.current().is_word() && p.nth(1) != L_PAREN) && !is_literal(p.current()) {
        p.too_deep(ends_expression);
        return Some((m.complete(p, PAREN_EXPR), 1));
    }
    p.depth += 1;
    let operand = match p.current() {
        kind if matches!(kind, BANG | MINUS) || foreign::at_not(p) => {
            match kind {
                BANG | MINUS => p.bump(),
                _ => foreign::take_as(p, 1, BANG),
            }
            let inner = operand(p);
            let height = height_of(p, inner);
            (m.complete(p, UNARY_EXPR), height + 1)
        }
        L_PAREN => {
            p.bump();
            let inner = operators(p, 1);
            let height = height_of(p, inner);
            p.expect(R_PAREN);
            (m.complete(p, PAREN_EXPR), height + 1)
        }
        kind if is_literal(kind) => {
            p.bump();
            if matches!(kind, INT_NUMBER | FLOAT_NUMBER) {
                foreign::opt_unit(p);
            }
            (m.complete(p, LITERAL), 1)
        }
        _ => {
            name_ref(p, Expected::Name);
            if p.at(L_PAREN) {
                let height = arguments(p);
                opt_access(p);
                (m.complete(p, CALL_EXPR), height + 2)
            } else {
                opt_access(p);
                (m.complete(p, NAME_EXPR), 2)
            }
        }
    };
    p.depth -= 1;
    Some(operand)
}

fn is_literal(kind: SyntaxKind) -> bool {
    kind.is_literal_keyword()
        || matches!(kind, INT_NUMBER | FLOAT_NUMBER | BAD_NUMBER | STRING | UNTERMINATED_STRING)
}

/// Takes `( one, two, … )`, and returns the height of its tree.
fn arguments(p: &mut Parser<'_>) -> u32 {
    let height = std::cell::Cell::new(0);
    node(p, ARGUMENT_LIST, |p| {
        separated(p, R_PAREN, Expected::Argument, |p| match operators(p, 1) {
            Some((_, inner)) => {
                height.set(height.get().max(inner));
                true
            }
            None => false,
        });
        p.expect(R_PAREN);
    });
    height.get()
}

// test_err fields_and_indices_are_for_codels
// core C(S) { update = { x = pose.x; y = scan[3] + 1; } }
fn opt_access(p: &mut Parser<'_>) {
    if p.begins_line() {
        return;
    }
    let in_program = p.is_in(BLOCK) || p.is_in(STATE);
    match p.current() {
        DOT if in_program => p.skip(SyntaxErrorKind::MessageField, |p| {
            let is_method = p.at(L_PAREN) && p.previous().is_word() && !p.begins_line();
            !(p.current().is_word() && p.previous() == DOT || p.at(DOT) || is_method)
        }),
        L_BRACK if in_program => {
            p.skip(SyntaxErrorKind::ArrayElement, |_| true);
        }
        _ => {}
    }
}

/// Returns whether the rest of an expression that is too deep ends here.
fn ends_expression(p: &Parser<'_>) -> bool {
    matches!(p.current(), SEMICOLON | COMMA | R_PAREN | R_BRACK | R_CURLY | THEN_KW | TO_KW)
        || p.at_item()
        || p.at_outer_item()
}
