//! Operators, statements and items of other languages. Each one is a single error.
//!
//! These rules are tried only after a parse error, or at tokens that begin no item or statement of MAUVE, so valid
//! models parse as before.

use super::*;
use crate::foreign::{Foreign, ForeignWord};

/// Takes `tokens` tokens as one error.
fn drop_as(p: &mut Parser<'_>, form: Foreign, tokens: u8) {
    p.foreign(form);
    p.drop_tokens(usize::from(tokens));
}

/// Takes `tokens` tokens as the token of MAUVE that is written there.
pub(super) fn take_as(p: &mut Parser<'_>, tokens: u8, kind: SyntaxKind) {
    let written = match kind {
        INPUT_KW => "input port",
        OUTPUT_KW => "output port",
        ELSE_KW => "else if",
        _ => kind.text().unwrap_or_default(),
    };
    p.foreign(Foreign::Spelling { tokens, written });
    p.bump_as(kind);
    p.drop_tokens(usize::from(tokens) - 1);
}

// test_err operators_of_other_languages
// core C(S) { update = {
//   if a and not b or c then { } else { }
//   if a & b | c then { } else { }
//   if a = b && c => d && e =< f then { } else { }
//   x = a and (b);
//   x = 33 ms;
// } }
/// Returns the operator of MAUVE for one of another language behind an operand, and the number of its tokens.
pub(super) fn operator(p: &Parser<'_>) -> Option<(SyntaxKind, u8)> {
    Some(match (p.current(), p.nth(1)) {
        // In a guard, `=>` may be an arrow to a state.
        (EQ, GT) if p.in_condition && !p.nth_looks_like_type(2) => (GTEQ, 2),
        (EQ, LT) if p.in_condition => (LTEQ, 2),
        (EQ, next) if p.in_condition && next != GT => (EQ2, 1),
        // At the beginning of a line, `and (x);` may call a codel of that name.
        (IDENT, L_PAREN) if p.begins_line() && !p.in_condition => return None,
        (IDENT, next) if begins_operand(next) && !p.nth_begins_line(1) && !p.at_item() => {
            ([AMP2, PIPE2].into_iter().find(|kind| p.nth_is_instead_of(0, *kind))?, 1)
        }
        (ERROR_CHARACTERS, _) if p.at_characters("&") => (AMP2, 1),
        (ERROR_CHARACTERS, _) if p.at_characters("|") => (PIPE2, 1),
        _ => return None,
    })
}

fn begins_operand(kind: SyntaxKind) -> bool {
    statement::starts_expression(kind) && !matches!(kind, THEN_KW | TO_KW)
}

/// Returns whether this is `not` before an operand. `not(x)` is a call of a codel.
pub(super) fn at_not(p: &Parser<'_>) -> bool {
    p.nth_is_instead_of(0, BANG)
        && !p.nth_begins_line(1)
        && !matches!(p.nth(1), L_PAREN | MINUS)
        && begins_operand(p.nth(1))
}

/// Takes a unit after a number.
pub(super) fn opt_unit(p: &mut Parser<'_>) {
    let is_unit = p.nth_foreign(0) == Some(ForeignWord::Unit) && !p.begins_line();
    let is_hertz = p.may_have_hertz && p.at_hertz();
    if is_unit && !is_hertz && !matches!(p.nth(1), EQ | COLON | L_PAREN | DOT) {
        drop_as(p, Foreign::Unit, 1);
    }
}

// test_err statements_of_other_languages
// core C(S) { update = {
//   n += 1; n++; ++n; n--; --n;
//   int n = 3; Pose p;
//   for (int i = 0; i < 3; i++) { act(n); }
//   while n < 3 { n = n + 1; }
//   do { act(n); } while (n < 3);
//   switch (n) { case 1: act(n); break; }
//   void act(int v) { }
//   while(n);
//   act(n);
// } }
/// Takes a statement whose beginning is not that of a statement of MAUVE.
pub(super) fn opt_statement(p: &mut Parser<'_>) -> bool {
    match (p.current(), p.nth(1), p.nth(2)) {
        (word, PLUS | MINUS | STAR | SLASH | PERCENT, EQ) if word.is_word() => {
            // The analysis knows the assigned variable.
            let m = p.start();
            any_word(p, NAME_REF);
            drop_as(p, Foreign::CompoundAssignment, 2);
            expression(p);
            m.complete(p, ASSIGN_STATEMENT);
            p.drop_until(ends_statement);
        }
        (PLUS, PLUS, word) | (word, PLUS, PLUS) if word.is_word() => {
            p.skip_foreign(Foreign::Increment, ends_statement);
        }
        (MINUS, MINUS, word) | (word, MINUS, MINUS) if word.is_word() && p.nth(3) == SEMICOLON => {
            p.skip_foreign(Foreign::Increment, ends_statement);
        }
        (_, next, _)
            if !matches!(next, EQ | L_PAREN)
                && let Some(form) = section(p) =>
        {
            take_section(p, form);
        }
        _ => return opt_declaration(p),
    }
    true
}

/// Returns the form of a statement that is taken with its body: a loop or a `switch`.
pub(super) fn section(p: &Parser<'_>) -> Option<Foreign> {
    match p.nth_foreign(0) {
        Some(ForeignWord::Section(form)) => Some(form),
        _ => None,
    }
}

pub(super) fn take_section(p: &mut Parser<'_>, form: Foreign) {
    p.skip_foreign(form, ends_section);
}

/// Returns whether a statement ends here: after its `;` or its block, or with its line.
pub(super) fn ends_statement(p: &Parser<'_>) -> bool {
    p.at(R_CURLY)
        || p.begins_line()
        || p.previous() == SEMICOLON
        || p.previous() == R_CURLY && !p.at(SEMICOLON)
}

/// Returns whether a statement with a block ends here. The block may begin the next line, and `while` or `else` may follow it.
fn ends_section(p: &Parser<'_>) -> bool {
    let goes_on = p.at(ELSE_KW)
        || p.at(L_CURLY) && p.begins_line()
        || p.previous() == R_CURLY && !p.begins_line() && section(p).is_some();
    !goes_on && ends_statement(p)
}

// test_err declarations_of_other_languages
// import "laser.mal"
// import nav_msgs
// using namespace std_msgs
// void halt(int v);
// core C(S) {
//   int n = 3;
//   int twice(int v)
//   { return v; }
//   update = { }
// }
/// Takes a function, or in a core a variable, that begins with its type.
pub(super) fn opt_declaration(p: &mut Parser<'_>) -> bool {
    if !p.at(IDENT) || !p.nth(1).is_word() || p.nth_begins_line(1) {
        return false;
    }
    match p.nth(2) {
        EQ | SEMICOLON if p.is_in(CORE) => {
            let m = p.start();
            drop_as(p, Foreign::TypeFirst, 1);
            name(p);
            shell::opt_initializer(p);
            m.complete(p, VAR);
        }
        L_PAREN => take_section(p, Foreign::Function),
        _ => return false,
    }
    true
}

// test_err ports_of_other_languages
// shell S {
//   in port a: int
//   out b: int
//   input c: int
//   param d: int = 3
//   const e: int = 3
//   input port f: int
// }
/// Takes a port without `input port` or `output port`.
pub(super) fn opt_port(p: &mut Parser<'_>) -> bool {
    let direction = if matches!(p.current(), IN_KW | INPUT_KW) { INPUT_KW } else { OUTPUT_KW };
    let is_port = matches!(p.current(), IN_KW | INPUT_KW | OUT_KW | OUTPUT_KW);
    if !is_port || !p.nth(1).is_word() || p.nth_begins_line(1) {
        return false;
    }
    let m = p.start();
    take_as(p, 1 + u8::from(p.nth(1) == PORT_KW && p.nth(2).is_word()), direction);
    declared_type(p);
    m.complete(p, PORT);
    true
}

// test_err architecture_items_of_other_languages
// architecture A {
//   connect a.b -> c.d
//   a.b -> c.d
//   a.b = 3
//   laser: Laser
//   connection a.b to c.d
//   connection a.b, c.d
//   instance Laser laser
//   Laser front
// }
// deployment D { laser { priority = 1 } }
/// Takes an item of an architecture without its keyword.
pub(super) fn opt_architecture_item(p: &mut Parser<'_>) -> bool {
    match (p.current(), p.nth(1), p.nth(2)) {
        (word, DOT, feature) if word.is_word() && feature.is_word() => {
            match p.nth(3) == EQ && p.nth(4) != GT {
                true => without_keyword(p, "property", SETTING, architecture::setting_rest),
                false => without_keyword(p, "connection", CONNECTION, architecture::connection_rest),
            }
        }
        (word, COLON, component) if word.is_word() && component.is_word() => {
            without_keyword(p, "instance", INSTANCE, architecture::instance_rest);
        }
        (IDENT, ..) if p.at_type_before_name() => {
            let m = p.start();
            opt_type_before_name(p);
            m.complete(p, INSTANCE);
        }
        _ => return false,
    }
    true
}

/// Takes an item without the keyword that begins it.
pub(super) fn without_keyword(
    p: &mut Parser<'_>,
    keyword: &'static str,
    kind: SyntaxKind,
    rest: impl FnOnce(&mut Parser<'_>),
) {
    let m = p.start();
    p.foreign(Foreign::Keyword(keyword));
    rest(p);
    m.complete(p, kind);
}

// test_err keywords_of_other_languages
// namespace lib {
//   Codel f(): int
// }
// Shell S { Input port a: int }
/// Takes the first word of an item as the keyword that it replaces: `State`, `namespace`, `connect`.
pub(super) fn opt_item_keyword(p: &mut Parser<'_>, list: SyntaxKind) {
    let next = p.nth(1);
    let is_item = (next.is_word() || next == STRING) && !p.nth_begins_line(1)
        || list == CORE && matches!(next, EQ | L_CURLY | L_PAREN)
        || list == STATE && next == EQ;
    let keyword = match (p.current(), p.nth_foreign(0)) {
        (IMPORT_KW, _) => Some(if next == STRING { INCLUDE_KW } else { USE_KW }),
        (_, Some(ForeignWord::InsteadOf(kind))) => Some(kind),
        _ => p.in_lower_case(),
    };
    let mut words = item_keywords(list).into_iter().flatten().filter_map(|words| words.split(' ').next());
    let Some(kind) = keyword.filter(|_| is_item) else { return };
    if words.any(|word| kind.text() == Some(word)) {
        let has_namespace = kind == USE_KW && p.nth_is_instead_of(1, LIBRARY_KW) && p.nth(2).is_word();
        let tokens = 1 + u8::from(has_namespace);
        p.foreign(Foreign::Spelling { tokens, written: kind.text().unwrap_or_default() });
        p.drop_tokens(usize::from(tokens) - 1);
        p.read_as(kind);
    }
}

// test_err parameters_of_other_languages
// codel a(const nav::Pose& goal, Pose &now, n: bool): bool
// codel bool b(in n: int)
// codel c(int n) -> bool
/// Takes a parameter of C++: `const Pose& goal`.
pub(super) fn opt_parameter(p: &mut Parser<'_>) -> bool {
    let is_const = p.nth_is_instead_of(0, CONSTANT_KW) && p.nth(1).is_word();
    let mut tokens = usize::from(is_const) + 1;
    while p.nth(tokens) == COLON2 && p.nth(tokens + 1).is_word() {
        tokens += 2;
    }
    let next = p.nth(tokens);
    let is_one = p.nth_is_reference(tokens) || is_const && (next.is_word() || next == LT);
    if is_one {
        p.skip_foreign(Foreign::Reference, |p| matches!(p.current(), COMMA | R_PAREN) || p.begins_line());
    }
    is_one
}

/// Takes the tokens that other languages write instead of `expected`, and returns whether there were any.
pub(super) fn opt_instead_of(p: &mut Parser<'_>, expected: SyntaxKind) -> bool {
    if p.begins_line() {
        return false;
    }
    let tokens = match (expected, p.current(), p.nth(1)) {
        (TO_KW, ARROW | THEN_KW, next) if next != TO_KW => 1,
        (TO_KW | ARROW, EQ, GT) => 2,
        (TO_KW, IDENT, next) if next.is_word() && p.nth_is_instead_of(0, TO_KW) => 1,
        (ARROW, TO_KW | COMMA, next) if next.is_word() => 1,
        (EQ, L_PAREN, R_PAREN) if p.nth(2) == L_CURLY => 2,
        (EQ, COLON, _) => 1,
        (COLON, ARROW, next) if next.is_word() => 1,
        _ => return false,
    };
    drop_as(p, Foreign::Spelling { tokens, written: expected.text().unwrap_or_default() }, tokens);
    true
}

/// Takes `:`, `=` or `()` between a header and its `{` or `=`.
pub(super) fn opt_superfluous(p: &mut Parser<'_>, behind: SyntaxKind) {
    let tokens = match (p.current(), p.nth(1), p.nth(2)) {
        (COLON | EQ, next, _) if next == behind => 1,
        (L_PAREN, R_PAREN, next) if next == behind => 2,
        _ => return,
    };
    if !p.begins_line() {
        drop_as(p, Foreign::Superfluous { tokens }, tokens);
    }
}

// test_err types_of_other_languages
// shell S {
//   input port a: nav_msgs/msg/Path
//   input port b: vector<Pose>
//   input port c: Pose[]
//   input port Pose d
// }
/// Takes `[]`, `*`, `&` or `<…>` after a type.
pub(super) fn opt_type_suffix(p: &mut Parser<'_>) {
    match (p.current(), p.nth(1)) {
        _ if p.begins_line() => {}
        (LT, _) => {
            p.skip_foreign(Foreign::TypeSuffix, |p| p.previous() == GT || p.begins_line() || p.at(R_CURLY))
        }
        (L_BRACK, R_BRACK) => drop_as(p, Foreign::TypeSuffix, 2),
        _ if p.at(STAR) || p.at_characters("&") => drop_as(p, Foreign::TypeSuffix, 1),
        _ => {}
    }
}
