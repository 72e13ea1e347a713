//! `core C(S) { … }`: the behaviour of a component, and the state machines in it.

use super::*;

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
        if p.expect(L_PAREN) {
            type_(p, Expected::ShellName);
            p.expect(R_PAREN);
            p.eat(COLON);
        } else {
            p.drop_until(|p| p.at(L_CURLY) || p.begins_line());
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
        _ if foreign::opt_declaration(p) => {}
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
        foreign::opt_superfluous(p, EQ);
        expect_or_foreign(p, EQ);
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
        _ if foreign::opt_declaration(p) => {}
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
            p.missing(Expected::Name);
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
        // `transition to There` lacks its name, but `to` is the name in `transition to to There`.
        let is_name = matches!(p.nth(1), IF_KW | TO_KW | ARROW) || p.nth_begins_line(1);
        let is_keyword = matches!(p.current(), IF_KW | TO_KW) || p.nth_is_instead_of(0, IF_KW);
        match is_keyword && !is_name {
            true => p.missing(Expected::Name),
            false => name(p),
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

fn opt_guard(p: &mut Parser<'_>) {
    let is_foreign = p.nth_is_instead_of(0, IF_KW) && p.nth(1) != TO_KW;
    if !p.at(IF_KW) && (p.begins_line() || !p.at(L_PAREN) && !is_foreign) {
        return;
    }
    let m = p.start();
    match p.current() {
        L_PAREN => p.missing(Expected::Token(IF_KW)),
        IDENT => foreign::take_as(p, 1, IF_KW),
        _ => p.bump(),
    }
    expression::condition(p);
    m.complete(p, GUARD);
}
