//! `core C(S) { … }`: the behaviour of a component, and the state machines in it.

use super::*;
use crate::foreign::{Foreign, ForeignWord};

// test core
// core PilotCore(PilotShell): {
//   var speed: double = 0.5; var goal: Pose
//   handler plan: planner
//   provide reset(in hard: bool): bool = { return true; }
//   provide ping() = { }
//   configure = { return open(device); }
//   start = { }
//   update = { loop(); }
//   stop = { } ; cleanup = { }
// }
pub(super) fn core(p: &mut Parser<'_>) {
    node(p, CORE, |p| {
        name(p);
        if !foreign::opt_core_header(p) {
            p.expect(L_PAREN);
            type_(p, Expected::ShellName);
            p.expect(R_PAREN);
            p.eat(COLON);
        }
        list(p, CORE);
    });
}

pub(super) fn core_item(p: &mut Parser<'_>) {
    match p.current() {
        VAR_KW => variable(p),
        HANDLER_KW => node(p, HANDLER, declared_type),
        PROVIDE_KW => operation_definition(p),
        CONFIGURE_KW | START_KW | UPDATE_KW | STOP_KW | CLEANUP_KW => program(p, HOOK),
        STATEMACHINE_KW => node(p, STATE_MACHINE, |p| list(p, STATE_MACHINE)),
        _ if foreign::opt_state_machine(p) || foreign::opt_core_item(p) => {}
        _ => unknown(p, CORE),
    }
}

// test_err variable_continues_on_the_next_line_but_not_over_an_item
// core C(S) {
//   var a: int = 1
//     + 2
//   var b:
//   var c: int =
//   update = { }
// }
pub(super) fn variable(p: &mut Parser<'_>) {
    node(p, VAR, |p| {
        declared_type(p);
        shell::opt_initializer(p);
    });
}

fn operation_definition(p: &mut Parser<'_>) {
    node(p, OPERATION_DEFINITION, |p| {
        name(p);
        parameters(p);
        if p.at(COLON) {
            let result = p.start();
            colon_type(p);
            result.complete(p, RESULT_TYPE);
        }
        p.expect(EQ);
        block(p);
    });
}

/// `keyword = { … }`
fn program(p: &mut Parser<'_>, kind: SyntaxKind) {
    node(p, kind, |p| {
        let _ = foreign::opt_program_parentheses(p) || expect_or_foreign(p, EQ);
        block(p);
    });
}

// test state_machine
// core C(S) {
//   statemachine {
//     var n: int = 0;
//     initial state Waiting {
//       entry = { } run = { n = n + 1; } handle = { } exit = { }
//       transition go if (n > 3) to Moving { reset(n); }
//       transition again to Waiting
//     }
//     state Moving { }
//   }
// }
pub(super) fn state_machine_item(p: &mut Parser<'_>) {
    match p.current() {
        VAR_KW => variable(p),
        INITIAL_KW | STATE_KW => state(p),
        _ if foreign::opt_core_item(p) => {}
        _ => unknown(p, STATE_MACHINE),
    }
}

fn state(p: &mut Parser<'_>) {
    let m = p.start();
    // An `initial` alone on its line is incomplete: the state on the next line is not initial.
    if p.eat(INITIAL_KW) && p.at_item() {
        p.missing(Expected::Token(STATE_KW));
    } else if p.expect(STATE_KW) || p.at(IDENT) && p.nth(1) == L_CURLY {
        if p.at(INITIAL_KW) && p.nth(1).is_word() && !p.begins_line() {
            p.foreign(Foreign::InitialLast);
            p.bump();
        }
        name(p);
        list(p, STATE);
    }
    m.complete(p, STATE);
}

pub(super) fn state_item(p: &mut Parser<'_>) {
    match p.current() {
        ENTRY_KW | RUN_KW | HANDLE_KW | EXIT_KW => program(p, METHOD),
        TRANSITION_KW => transition(p),
        _ => unknown(p, STATE),
    }
}

// test_err transition_half_typed
// core C(S) {
//   statemachine {
//     initial state A {
//       transition t if
//       transition u if (x) to
//       run = { f(
//       transition v to A
//     }
//   }
// }
fn transition(p: &mut Parser<'_>) {
    node(p, TRANSITION, |p| {
        match at_nameless(p) {
            true => p.foreign(Foreign::UnnamedTransition),
            false => name(p),
        }
        if foreign::opt_transition_form(p) {
            return;
        }
        opt_guard(p);
        let to_state = expect_or_foreign(p, TO_KW) || p.at(IDENT) && !p.begins_line();
        if to_state {
            name_ref(p, Expected::StateName);
            if p.at(IF_KW) && p.nth(1) != EQ {
                p.foreign(Foreign::GuardLast);
                node(p, GUARD, expression::condition);
            }
            if p.at(L_CURLY) {
                block(p);
            }
        }
    });
}

/// Returns whether the guard or the target is at the position of the name.
fn at_nameless(p: &Parser<'_>) -> bool {
    let is_guard = p.nth_is_foreign(0, ForeignWord::Guard);
    match p.nth(1) {
        IF_KW | TO_KW => false,
        _ if p.nth_begins_line(1) => false,
        ARROW => false,
        next => {
            p.at(ARROW) || p.at(IF_KW) || p.at(TO_KW) && next.is_word() || is_guard && !matches!(next, EQ)
        }
    }
}

fn opt_guard(p: &mut Parser<'_>) {
    let is_foreign = !p.begins_line() && p.nth_is_foreign(0, ForeignWord::Guard) && p.nth(1) != TO_KW;
    if is_foreign {
        let m = p.start();
        p.foreign(Foreign::Spelling { tokens: 1, written: "if" });
        p.bump_as(IF_KW);
        expression::condition(p);
        m.complete(p, GUARD);
    } else if p.at(IF_KW) {
        node(p, GUARD, expression::condition);
    } else if p.at(L_PAREN) && !p.begins_line() {
        let m = p.start();
        p.missing(Expected::Token(IF_KW));
        expression::condition(p);
        m.complete(p, GUARD);
    }
}
