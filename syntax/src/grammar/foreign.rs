//! Operators, statements and items of other languages. Each one is a single error.
//!
//! These rules are tried only after a parse error, or at tokens that begin no item or statement of MAUVE, so valid
//! models parse as before.

use super::*;
use crate::foreign::{Foreign, ForeignWord};
use crate::parser::Checkpoint;

/// Takes `tokens` tokens as one error.
fn drop_as(p: &mut Parser<'_>, form: Foreign, tokens: u8) {
    p.foreign(form);
    p.drop_tokens(usize::from(tokens));
}

fn superfluous(p: &mut Parser<'_>, tokens: u8) {
    drop_as(p, Foreign::Superfluous { tokens }, tokens);
}

/// Takes `tokens` tokens as the keyword that MAUVE writes there.
fn keyword_as(p: &mut Parser<'_>, tokens: u8, keyword: SyntaxKind) {
    p.foreign(Foreign::Spelling { tokens, written: keyword.text().unwrap_or_default() });
    p.drop_tokens(usize::from(tokens) - 1);
    p.bump_as(keyword);
}

/// Takes an item of this kind, whose keyword is written in another way.
fn item_as(
    p: &mut Parser<'_>,
    (tokens, keyword): (u8, SyntaxKind),
    kind: SyntaxKind,
    rest: impl FnOnce(&mut Parser<'_>),
) {
    let m = p.start();
    keyword_as(p, tokens, keyword);
    rest(p);
    m.complete(p, kind);
}

/// An operator of another language: the operator of MAUVE, and the number of tokens.
pub(super) struct ForeignOperator {
    pub(super) kind: SyntaxKind,
    tokens: u8,
}

impl ForeignOperator {
    /// Reports the operator, and takes its first token as the operator of MAUVE.
    pub(super) fn take(&self, p: &mut Parser<'_>) {
        p.foreign(Foreign::Spelling { tokens: self.tokens, written: self.kind.text().unwrap_or_default() });
        p.bump_as(self.kind);
        p.drop_tokens(usize::from(self.tokens) - 1);
    }
}

// test_err operators_of_other_languages
// core C(S) { update = {
//   if a and not b or c then { } else { }
//   if a & b | c then { } else { }
//   if a <> b && c === d && e !== f then { } else { }
//   if a = b then { } else { }
//   x = a and (b);
// } }
/// Returns the binary operator of another language behind an operand.
pub(super) fn operator(p: &Parser<'_>) -> Option<ForeignOperator> {
    let (kind, tokens) = match (p.current(), p.nth(1)) {
        (LT, GT) => (NEQ, 2),
        (EQ2, EQ) => (EQ2, 2),
        (NEQ, EQ) => (NEQ, 2),
        // In a guard, `=>` may be an arrow to a state.
        (EQ, GT) if p.in_condition && !p.nth_looks_like_type(2) => (GTEQ, 2),
        (EQ, LT) if p.in_condition => (LTEQ, 2),
        (EQ, next) if p.in_condition && next != GT => (EQ2, 1),
        // At the beginning of a line, `and (x);` may call a codel of that name.
        (IDENT, L_PAREN) if p.begins_line() && !p.in_condition => return None,
        (IDENT, next) if begins_operand(next) && !p.nth_begins_line(1) && !p.at_item() => {
            let operator = |word| match word {
                ForeignWord::Operator(kind) => Some(kind),
                _ => None,
            };
            (p.nth_foreign(0, operator)?, 1)
        }
        (ERROR_CHARACTERS, _) if p.at_characters("&") => (AMP2, 1),
        (ERROR_CHARACTERS, _) if p.at_characters("|") => (PIPE2, 1),
        _ => return None,
    };
    Some(ForeignOperator { kind, tokens })
}

fn begins_operand(kind: SyntaxKind) -> bool {
    statement::starts_expression(kind) && !matches!(kind, THEN_KW | TO_KW)
}

/// Returns whether this is `not` before an operand. `not(x)` is a call of a codel.
pub(super) fn at_not(p: &Parser<'_>) -> bool {
    p.at(IDENT)
        && !p.nth_begins_line(1)
        && !matches!(p.nth(1), L_PAREN | MINUS | THEN_KW | TO_KW)
        && begins_operand(p.nth(1))
        && p.nth_is_foreign(0, ForeignWord::Not)
}

/// Takes `not` as `!`.
pub(super) fn not(p: &mut Parser<'_>) {
    ForeignOperator { kind: BANG, tokens: 1 }.take(p);
}

/// Takes `.5`.
pub(super) fn point(p: &mut Parser<'_>) {
    drop_as(p, Foreign::Fraction, 2);
}

// test_err behind_an_operand
// core C(S) { update = {
//   x = a ? 1 : 2;
//   x = 1. + .5;
//   x = 33 ms;
// } }
/// Takes a unit or a decimal point after a number.
pub(super) fn opt_behind_number(p: &mut Parser<'_>) {
    if p.at(DOT) && !p.begins_line() {
        let more = u8::from(p.nth(1) == INT_NUMBER && !p.nth_begins_line(1));
        drop_as(p, Foreign::Fraction, 1 + more);
        return;
    }
    let is_hertz = p.may_have_hertz && p.at_hertz();
    if p.at(IDENT)
        && !p.begins_line()
        && !is_hertz
        && !matches!(p.nth(1), EQ | COLON | L_PAREN | DOT)
        && p.nth_is_foreign(0, ForeignWord::Unit)
    {
        drop_as(p, Foreign::Unit, 1);
    }
}

/// Takes `? a : b` behind an operand.
pub(super) fn opt_ternary(p: &mut Parser<'_>, condition: CompletedMarker) -> CompletedMarker {
    if !p.at_characters("?") {
        return condition;
    }
    let m = condition.precede(p);
    p.skip_foreign(Foreign::Ternary, expression::ends_expression);
    m.complete(p, BINARY_EXPR)
}

// test_err statements_of_other_languages
// core C(S) { update = {
//   n += 1; n++; ++n; n--; n := 3;
//   int n = 3; Pose p; let m = 4;
//   for (int i = 0; i < 3; i++) { act(n); }
//   while n < 3 { n = n + 1; }
//   do { act(n); }
//   switch (n) { case 1: act(n); break; }
//   void act(int v) { }
//   while(n);
//   act(n);
// } }
/// Takes a statement whose beginning is not that of a statement of MAUVE.
pub(super) fn opt_statement(p: &mut Parser<'_>) -> bool {
    let on_line = !p.nth_begins_line(1);
    match (p.current(), p.nth(1), p.nth(2)) {
        (word, PLUS | MINUS | STAR | SLASH | PERCENT | AMP2 | PIPE2, EQ) if word.is_word() => {
            assignment(p, Foreign::CompoundAssignment);
        }
        (word, COLON, EQ) if word.is_word() => {
            assignment(p, Foreign::Spelling { tokens: 2, written: "=" });
        }
        (PLUS, PLUS, word) if word.is_word() => p.skip_foreign(Foreign::Increment, ends_statement),
        (word, PLUS, PLUS) if word.is_word() => p.skip_foreign(Foreign::Increment, ends_statement),
        (IDENT, ..) if at_brace(p) => superfluous(p, 1),
        (IDENT, L_CURLY, _) if p.nth_foreign(0, section).is_some() => foreign_section(p),
        (IDENT, SEMICOLON | R_CURLY, _) if p.nth_is_foreign(0, ForeignWord::Jump) => {
            p.skip_foreign(Foreign::Loop, ends_statement);
        }
        (IDENT, COLON, _) if p.nth_is_foreign(0, ForeignWord::Switch) => {
            p.skip_foreign(Foreign::Switch, ends_statement);
        }
        (IDENT, INT_NUMBER, _) if on_line && p.nth_foreign(0, section).is_some() => foreign_section(p),
        (IDENT, ty, name)
            if p.nth_is_foreign(0, ForeignWord::Const)
                && on_line
                && ty.is_word()
                && name.is_word()
                && matches!(p.nth(3), EQ | SEMICOLON) =>
        {
            variable_as(p, Foreign::ConstantVariable, 2);
        }
        (IDENT, next, behind) if next.is_word() && on_line => match behind {
            _ if p.nth_foreign(0, section).is_some() => foreign_section(p),
            EQ | SEMICOLON => variable(p),
            L_PAREN => p.skip_foreign(Foreign::Function, ends_statement),
            _ => return false,
        },
        _ => return false,
    }
    true
}

/// Takes `name op= value;`: the analysis knows the assigned variable.
fn assignment(p: &mut Parser<'_>, form: Foreign) {
    let m = p.start();
    any_word(p, NAME_REF);
    drop_as(p, form, 2);
    expression(p);
    m.complete(p, ASSIGN_STATEMENT);
    p.drop_until(ends_statement);
}

// test_err variables_of_other_languages
// core C(S) {
//   int n = 3;
//   const int m = 4
//   let k = 5;
//   update = { }
// }
/// Takes `int n = 3` or `let n = 3`: a variable of unknown type.
pub(super) fn variable(p: &mut Parser<'_>) {
    let is_untyped = p.nth_is_foreign(0, ForeignWord::Untyped);
    variable_as(p, if is_untyped { Foreign::Untyped } else { Foreign::TypeFirst }, 1);
}

/// Takes a variable whose name is behind `before` tokens.
fn variable_as(p: &mut Parser<'_>, form: Foreign, before: u8) {
    let m = p.start();
    drop_as(p, form, before);
    name(p);
    shell::opt_initializer(p);
    m.complete(p, VAR);
}

/// Returns the form of a statement that is taken with its body: a loop or a `switch`.
fn section(word: ForeignWord) -> Option<Foreign> {
    match word {
        ForeignWord::Loop => Some(Foreign::Loop),
        ForeignWord::Switch => Some(Foreign::Switch),
        _ => None,
    }
}

fn foreign_section(p: &mut Parser<'_>) {
    let form = p.nth_foreign(0, section).unwrap_or(Foreign::Loop);
    p.skip_foreign(form, ends_section);
}

/// Returns whether this is `--n`, which has no effect in MAUVE.
pub(super) fn is_decrement(p: &mut Parser<'_>, before: &Checkpoint) -> bool {
    let is_one = |p: &Parser<'_>| p.at(MINUS) && p.nth(1) == MINUS && p.nth(2).is_word();
    p.taken_since(before) == 3 && p.from(before, is_one)
}

/// Reads a failed statement again as one error, if it is a form of another language.
pub(super) fn opt_whole_statement(p: &mut Parser<'_>, before: &Checkpoint) -> bool {
    let form = p.from(before, |p| match (p.current(), p.nth(1), p.nth(2)) {
        (IDENT, ..) if p.nth_foreign(0, section).is_some() => Some(ForeignWord::Loop),
        (IDENT, ..) if p.nth_is_foreign(0, ForeignWord::ElseIf) => Some(ForeignWord::ElseIf),
        (word, MINUS, MINUS) if word.is_word() => Some(ForeignWord::Jump),
        (MINUS, MINUS, word) if word.is_word() => Some(ForeignWord::Jump),
        (ELSE_KW, L_CURLY | IF_KW, _) => Some(ForeignWord::Brace),
        _ => None,
    });
    let Some(form) = form else { return false };
    p.rewind(before);
    match form {
        ForeignWord::Loop => foreign_section(p),
        ForeignWord::ElseIf => {
            let m = p.start();
            drop_as(p, Foreign::Spelling { tokens: 1, written: "else if" }, 1);
            statement::if_rest(p, true);
            m.complete(p, IF_STATEMENT);
        }
        ForeignWord::Brace => superfluous(p, 1),
        _ => p.skip_foreign(Foreign::Increment, ends_statement),
    }
    true
}

/// Returns whether this is a word that opens or closes a block in other languages, and is neither assigned nor called.
pub(super) fn at_brace(p: &Parser<'_>) -> bool {
    let next = p.nth(1);
    p.nth_is_foreign(0, ForeignWord::Brace)
        && (next.is_word() || matches!(next, SEMICOLON | L_CURLY | R_CURLY | EOF))
}

/// Returns whether a statement ends here: after its `;` or its block, or with its line.
pub(super) fn ends_statement(p: &Parser<'_>) -> bool {
    p.at(R_CURLY)
        || p.begins_line()
        || p.previous() == SEMICOLON
        || p.previous() == R_CURLY && !p.at(SEMICOLON)
}

/// Returns whether a statement with a block ends here. The block may begin the next line.
fn ends_section(p: &Parser<'_>) -> bool {
    let goes_on = p.at(L_CURLY) && p.begins_line()
        || p.previous() == R_CURLY && !p.begins_line() && p.nth_is_foreign(0, ForeignWord::Loop);
    !goes_on && ends_statement(p)
}

// Items

// test_err declarations_of_other_languages
// import "laser.mal"
// import nav_msgs
// void halt(int v);
// def act(v): pass
// codel land(): void
/// Takes a declaration of another language.
pub(super) fn opt_declaration(p: &mut Parser<'_>) -> bool {
    let on_line = !p.nth_begins_line(1);
    match (p.current(), p.nth(1), p.nth(2)) {
        (IMPORT_KW, STRING, _) if on_line => item_as(p, (1, INCLUDE_KW), INCLUDE, |p| p.bump()),
        (IMPORT_KW, next, _) if next.is_word() && on_line => item_as(p, (1, USE_KW), USE, package),
        (IDENT, ..) if on_line && p.nth_is_foreign(0, ForeignWord::Using) && p.nth(1).is_word() => {
            let has_namespace = u8::from(p.nth(2).is_word() && !p.nth_begins_line(2));
            item_as(p, (1 + has_namespace, USE_KW), USE, package);
        }
        (IDENT, ..) if on_line && p.nth_is_foreign(0, ForeignWord::From) => {
            p.skip_foreign(Foreign::ImportFrom, |p| p.begins_line());
        }
        (IDENT, next, L_PAREN) if next.is_word() && on_line => {
            p.skip_foreign(Foreign::Function, ends_declaration);
        }
        _ => return false,
    }
    true
}

fn package(p: &mut Parser<'_>) {
    name_ref(p, Expected::PackageName);
}

fn ends_declaration(p: &Parser<'_>) -> bool {
    p.at_item() || ends_section(p)
}

// test_err shell_items_of_other_languages
// shell S {
//   in port a: int
//   port out b: int
//   out c: int
//   port d: int
//   param e: int = 3
//   input port f: int
// }
pub(super) fn opt_shell_item(p: &mut Parser<'_>) -> bool {
    let direction = |kind| match kind {
        IN_KW | INPUT_KW => Some(INPUT_KW),
        OUT_KW | OUTPUT_KW => Some(OUTPUT_KW),
        _ => None,
    };
    let is_on_line = |p: &Parser<'_>| p.nth(1).is_word() && !p.nth_begins_line(1);
    if p.at(OPERATION_KW) && is_on_line(p) && p.nth(2) == L_PAREN {
        let m = p.start();
        drop_as(p, Foreign::ShellOperation, 1);
        name(p);
        parameters(p);
        colon_type(p);
        m.complete(p, ERROR);
        return true;
    }
    if let Some(keyword) =
        p.nth_foreign(0, keyword).filter(|it| is_on_line(p) && matches!(it, PROPERTY_KW | CONSTANT_KW))
    {
        item_as(p, (1, keyword), PROPERTY, shell::property_rest);
        return true;
    }
    let (keyword, before, behind) = match (p.current(), p.nth(1)) {
        (PORT_KW, next) if p.nth(2).is_word() && direction(next).is_some() => (direction(next), 1, 0),
        (PORT_KW, next) if next.is_word() => (None, 1, 0),
        (kind, PORT_KW) if p.nth(2).is_word() => (direction(kind), 0, 1),
        (kind, next) if next.is_word() => (direction(kind), 0, 0),
        _ => (None, 0, 0),
    };
    if !is_on_line(p) || keyword.is_none() && before == 0 {
        return false;
    }
    let m = p.start();
    match keyword {
        Some(keyword) => {
            let written = if keyword == INPUT_KW { "input port" } else { "output port" };
            p.foreign(Foreign::Spelling { tokens: 1 + before + behind, written });
            p.drop_tokens(usize::from(before));
            p.bump_as(keyword);
            p.drop_tokens(usize::from(behind));
        }
        None => {
            // The direction is unknown, so the item is skipped.
            p.skip_foreign(Foreign::Keyword("input"), ends_declaration);
            m.complete(p, ERROR);
            return true;
        }
    }
    declared_type(p);
    m.complete(p, PORT);
    true
}

fn keyword(word: ForeignWord) -> Option<SyntaxKind> {
    match word {
        ForeignWord::Keyword(kind) => Some(kind),
        _ => None,
    }
}

/// Takes a variable or a function of another language in a core.
pub(super) fn opt_core_item(p: &mut Parser<'_>) -> bool {
    if !p.at(IDENT) || !p.nth(1).is_word() || p.nth_begins_line(1) {
        return false;
    }
    match p.nth(2) {
        EQ | SEMICOLON => variable(p),
        L_PAREN => p.skip_foreign(Foreign::Function, ends_section),
        _ if p.nth_is_foreign(0, ForeignWord::Untyped) => superfluous(p, 1),
        _ => return false,
    }
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
//   instance laser = Laser
// }
pub(super) fn opt_architecture_item(p: &mut Parser<'_>) -> bool {
    let on_line = !p.nth_begins_line(1);
    match (p.current(), p.nth(1), p.nth(2)) {
        (IDENT, next, DOT)
            if next.is_word() && on_line && p.nth_foreign(0, keyword) == Some(CONNECTION_KW) =>
        {
            item_as(p, (1, CONNECTION_KW), CONNECTION, architecture::connection_rest);
        }
        (word, DOT, feature) if word.is_word() && feature.is_word() => {
            let m = p.start();
            let before = p.checkpoint();
            architecture::endpoint(p);
            let is_setting = p.at(EQ) && !matches!(p.nth(1), GT);
            let missing = if is_setting { "property" } else { "connection" };
            p.foreign_at(before.position, Foreign::Keyword(missing));
            if is_setting {
                p.bump();
                expression(p);
                m.complete(p, SETTING);
            } else {
                architecture::connection_target(p);
                m.complete(p, CONNECTION);
            }
        }
        (IDENT, name, _) if name.is_word() && on_line && p.at_type_before_name() => {
            let m = p.start();
            opt_type_before_name(p);
            m.complete(p, INSTANCE);
        }
        (word, COLON, component) if word.is_word() && component.is_word() => {
            let m = p.start();
            p.foreign(Foreign::Keyword("instance"));
            architecture::instance_rest(p);
            m.complete(p, INSTANCE);
        }
        _ => return false,
    }
    true
}

// test_err connections_of_other_languages
// architecture A {
//   connection a.b -> c.d, e.f, g.h
//   connection operation a.b -> c.d
// }
/// Takes `, c.d` after the reader of a connection.
pub(super) fn opt_second_reader(p: &mut Parser<'_>) {
    let is_endpoint = p.nth(1).is_word() && p.nth(2) == DOT && p.nth(3).is_word();
    if p.at(COMMA) && is_endpoint && !p.nth_begins_line(0) && !matches!(p.nth(4), ARROW | EQ) {
        p.foreign(Foreign::SecondReader);
        let is_next = |p: &Parser<'_>| p.at(COMMA) && p.nth(1).is_word() && p.nth(2) == DOT;
        while is_next(p) && p.nth(3).is_word() {
            p.drop_tokens(4);
        }
    }
}

/// Takes `connection operation a.b -> c.d` as the connection of an operation.
pub(super) fn opt_connection_operation(p: &mut Parser<'_>) -> bool {
    let is_operation = p.nth(1) == OPERATION_KW && p.nth(2).is_word() && p.nth(3) == DOT;
    if is_operation {
        item_as(p, (2, OPERATION_KW), OPERATION_CONNECTION, architecture::operation_rest);
    }
    is_operation
}

// test_err keywords_of_other_languages
// namespace lib {
//   Codel f(): int
// }
// Shell S { Input port a: int }
/// Takes the first word of an item as the keyword that it stands for: `State`, `namespace`.
pub(super) fn opt_item_keyword(p: &mut Parser<'_>, list: SyntaxKind) {
    let next = p.nth(1);
    let is_item = next.is_word() && !p.nth_begins_line(1)
        || list == CORE && matches!(next, EQ | L_CURLY | L_PAREN)
        || list == STATE && next == EQ;
    if !p.at(IDENT) || !is_item || matches!(list, BLOCK | ACTIVITY) {
        return;
    }
    let begins_item = |kind: SyntaxKind| {
        let words = item_keywords(list).into_iter().flatten().filter_map(|words| words.split(' ').next());
        kind.text().is_some_and(|text| words.into_iter().any(|word| word == text))
    };
    let fits = |kind: &SyntaxKind| match kind {
        LIBRARY_KW => list == SOURCE_FILE && p.nth(2) == L_CURLY,
        CONFIGURE_KW | START_KW | UPDATE_KW | STOP_KW | CLEANUP_KW => list == CORE && next != L_CURLY,
        _ => false,
    };
    let other = p.nth_foreign(0, keyword).filter(fits);
    if let Some(kind) = p.in_lower_case().filter(|kind| begins_item(*kind)).or(other) {
        p.foreign(Foreign::Spelling { tokens: 1, written: kind.text().unwrap_or_default() });
        p.read_as(kind);
    }
}

// test_err items_of_other_languages
// use a, b
// using namespace c
// from d import e
// use robot.mal
// shell S { operation plan(): bool  property rate: int in [1, 400] = 2 }
// core C(S) {
//   state machine { initial state A { transition go [x] -> A } }
//   update = { const int m = 3; }
// }
// architecture A { Laser front  instance back: Laser(rate = 2) }
// deployment D { activity front { affinity = {2} } }
/// Takes the packages after a comma in a `use`, or the end of the name of a file.
pub(super) fn opt_behind_use(p: &mut Parser<'_>) {
    if p.begins_line() {
        return;
    }
    if p.at(COMMA) && p.nth(1).is_word() {
        p.foreign(Foreign::Packages);
        while p.at(COMMA) && p.nth(1).is_word() {
            p.drop_tokens(1);
            name_ref(p, Expected::PackageName);
        }
    } else if p.at(DOT) && p.nth_is_foreign(1, ForeignWord::FileEnding) {
        drop_as(p, Foreign::UsedFile, 2);
    }
}

/// Takes `[ready] -> There` or `: if …` after the name of a transition.
pub(super) fn opt_transition_form(p: &mut Parser<'_>) -> bool {
    let is_form = !p.begins_line() && matches!(p.current(), L_BRACK | COLON);
    if is_form {
        p.skip_foreign(Foreign::TransitionForm, |p| p.at(R_CURLY) || p.begins_line() || p.at(SEMICOLON));
    }
    is_form
}

/// Takes the list in braces that other languages write as CPUs.
pub(super) fn opt_cpu_list(p: &mut Parser<'_>) -> bool {
    let is_list = p.at(L_CURLY) && !p.begins_line();
    if is_list {
        p.skip_foreign(Foreign::CpuList, |_| true);
    }
    is_list
}

/// Takes `in [1, 400]` or `[1, 400]` after the type of a property.
pub(super) fn opt_interval(p: &mut Parser<'_>) -> bool {
    let has_in = usize::from(p.at(IN_KW));
    let first = has_in + 1 + usize::from(p.nth(has_in + 1) == MINUS);
    let is_interval = p.nth(has_in) == L_BRACK && !p.begins_line();
    let is_foreign = is_interval && (has_in == 1 || p.nth(first + 1) == COMMA);
    if is_foreign {
        p.skip_foreign(Foreign::Interval, |p| p.previous() == R_BRACK || p.begins_line());
    }
    is_foreign
}

/// Takes values after the component of an instance.
pub(super) fn opt_instance_values(p: &mut Parser<'_>) {
    if matches!(p.current(), L_PAREN | L_CURLY) && !p.begins_line() {
        p.skip_foreign(Foreign::InstanceValues, |_| true);
    }
}

/// Takes `machine` between `state` and the list of a state machine.
pub(super) fn opt_state_machine(p: &mut Parser<'_>) -> bool {
    let is_machine = p.at(STATE_KW) && p.nth_is_foreign(1, ForeignWord::Machine) && p.nth(2) == L_CURLY;
    if is_machine {
        item_as(p, (2, STATEMACHINE_KW), STATE_MACHINE, |p| list(p, STATE_MACHINE));
    }
    is_machine
}

// test_err parameters_of_other_languages
// codel a(void): bool
// codel b(const nav::Pose& goal, Pose &now, bool): bool
// codel bool c(const Pose& goal)
// codel bool d(in n: int)
/// Takes `void` in `(void)`.
pub(super) fn opt_no_parameters(p: &mut Parser<'_>) {
    if p.nth(1) == R_PAREN && p.nth_is_foreign(0, ForeignWord::NoParameters) {
        superfluous(p, 1);
    }
}

/// Takes a parameter of C++: `const Pose& goal`, or a type without a name.
pub(super) fn opt_parameter(p: &mut Parser<'_>) -> bool {
    let is_const = p.nth_is_foreign(0, ForeignWord::Const) && p.nth(1).is_word();
    let mut tokens = usize::from(is_const) + 1;
    while p.nth(tokens) == COLON2 && p.nth(tokens + 1).is_word() {
        tokens += 2;
    }
    let form = match p.nth(tokens) {
        _ if p.nth_is_reference(tokens) => Foreign::Reference,
        next if is_const && (next.is_word() || next == LT) => Foreign::Reference,
        COMMA | R_PAREN if tokens > 1 || p.nth_looks_like_type(0) => Foreign::NamelessParameter,
        _ => return false,
    };
    p.skip_foreign(form, |p| matches!(p.current(), COMMA | R_PAREN) || p.begins_line());
    true
}

/// Takes `bool act(…)`: a signature with its result first.
pub(super) fn result_first(p: &mut Parser<'_>) {
    let before = p.checkpoint();
    drop_as(p, Foreign::ResultFirst, 1);
    name(p);
    let parameters_begin = p.checkpoint();
    parameters(p);
    if p.has_failed_since(&parameters_begin) {
        // One message for the whole signature.
        p.rewind(&before);
        drop_as(p, Foreign::Signature, 1);
        name(p);
        p.drop_until(|p| p.begins_line() || p.at_item() || matches!(p.current(), SEMICOLON | R_CURLY));
    }
}

/// Takes `(int)` before an operand.
pub(super) fn opt_cast(p: &mut Parser<'_>) {
    let is_value = p.nth(3) == L_PAREN || p.nth(3).is_word() || matches!(p.nth(3), INT_NUMBER | FLOAT_NUMBER);
    let is_operand = is_value && begins_operand(p.nth(3)) && !p.nth_begins_line(3);
    if p.at(L_PAREN) && p.nth_is_scalar(1) && p.nth(2) == R_PAREN && is_operand {
        drop_as(p, Foreign::Cast, 3);
    }
}

/// Takes `pilot { priority = 1 }`, an activity without its keyword.
pub(super) fn opt_deployment_item(p: &mut Parser<'_>) -> bool {
    let is_activity = p.at(IDENT) && p.nth(1) == L_CURLY && p.nth(2).is_word();
    if is_activity {
        let m = p.start();
        p.foreign(Foreign::Keyword("activity"));
        deployment::activity_rest(p);
        m.complete(p, ACTIVITY);
    }
    is_activity
}

/// Takes the tokens that other languages write instead of `expected`, and returns whether there were any.
pub(super) fn opt_instead_of(p: &mut Parser<'_>, expected: SyntaxKind) -> bool {
    if p.begins_line() {
        return false;
    }
    let tokens = match (expected, p.current(), p.nth(1)) {
        (TO_KW, ARROW | THEN_KW, next) if next != TO_KW => 1,
        (TO_KW | ARROW, EQ, GT) => 2,
        (TO_KW, IDENT, next) if next.is_word() && p.nth_is_foreign(0, ForeignWord::Target) => 1,
        (ARROW, MINUS, ARROW) => 2,
        (ARROW, TO_KW | COMMA | GT | COLON | EQ, next) if next.is_word() || next == L_BRACK => 1,
        (EQ, COLON, EQ) => 2,
        (EQ, COLON, _) => 1,
        (THEN_KW, COLON, L_CURLY) => 1,
        (COLON, ARROW, next) if next.is_word() => 1,
        _ => return false,
    };
    drop_as(p, Foreign::Spelling { tokens, written: expected.text().unwrap_or_default() }, tokens);
    true
}

/// Takes `()`.
pub(super) fn opt_parentheses(p: &mut Parser<'_>) {
    if p.at(L_PAREN) && p.nth(1) == R_PAREN && !p.begins_line() {
        superfluous(p, 2);
    }
}

/// Returns whether this is the colon of `shell Laser: Base`.
pub(super) fn at_colon_before_shell(p: &Parser<'_>) -> bool {
    p.at(COLON) && p.nth(1).is_word() && !p.begins_line()
}

/// Takes `extends`, or the colon that other languages write.
pub(super) fn extends(p: &mut Parser<'_>) {
    if p.at(COLON) {
        p.foreign(Foreign::Spelling { tokens: 1, written: "extends" });
    }
    p.bump_as(EXTENDS_KW);
}

/// Takes `:`, `=`, `()` or a name between a header and its `{`.
pub(super) fn opt_before_list(p: &mut Parser<'_>) {
    let tokens = match (p.current(), p.nth(1), p.nth(2)) {
        (COLON | EQ, L_CURLY, _) => 1,
        (L_PAREN, R_PAREN, L_CURLY) => 2,
        (word, L_CURLY, _) if word.is_word() => 1,
        _ => return,
    };
    if !p.begins_line() {
        superfluous(p, tokens);
    }
}

/// Takes `()` after the keyword of a program. Returns whether it replaces the `=`.
pub(super) fn opt_program_parentheses(p: &mut Parser<'_>) -> bool {
    let is_instead = p.at(L_PAREN) && p.nth(1) == R_PAREN && p.nth(2) == L_CURLY;
    if is_instead {
        drop_as(p, Foreign::Spelling { tokens: 2, written: "=" }, 2);
    } else {
        opt_parentheses(p);
    }
    is_instead
}

// test_err activity_without_braces
// deployment D { activity a: priority = 1, period = 10
//   activity b { }
// }
/// Takes the fields of an activity after a colon, on its line.
pub(super) fn opt_activity_body(p: &mut Parser<'_>) -> bool {
    let is_body = p.at(COLON) && p.nth(1).is_word() && !p.nth_begins_line(1);
    if is_body {
        drop_as(p, Foreign::ActivityBody, 1);
        while p.current().is_word() && !p.begins_line() {
            deployment::field(p);
            p.drop_until(|p| p.at(R_CURLY) || p.begins_line() || p.current().is_word());
        }
    }
    is_body
}

/// Takes `: S`, `extends S` or `for S` after the name of a core.
pub(super) fn opt_core_header(p: &mut Parser<'_>) -> bool {
    let is_word =
        p.at(IDENT) && (p.nth_is_foreign(0, ForeignWord::ForShell) || p.nth_is_foreign(0, ForeignWord::Loop));
    let is_header =
        !p.begins_line() && p.nth(1).is_word() && (matches!(p.current(), COLON | EXTENDS_KW) || is_word);
    if is_header {
        drop_as(p, Foreign::CoreHeader, 1);
        type_(p, Expected::ShellName);
    }
    is_header
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
