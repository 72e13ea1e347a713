//! `shell S { … }`: the interface of a component.

use super::*;

// test shell
// shell Navigation extends Base, nav::Positioned {
//   property resolution: double [0.1; 1] = 0.3;
//   constant frame: string = "map"
//   input port goal: PoseStamped
//   output port next: PoseStamped;
//   require plan(in goal: Pose, out path: Path): bool
//   provide reset(): void
// }
pub(super) fn shell(p: &mut Parser<'_>) {
    node(p, SHELL, |p| {
        name(p);
        let has_colon = p.at(COLON) && p.nth(1).is_word() && !p.begins_line();
        if p.at(EXTENDS_KW) || has_colon {
            let m = p.start();
            match has_colon {
                true => foreign::take_as(p, 1, EXTENDS_KW),
                false => p.bump(),
            }
            type_(p, Expected::ShellName);
            while p.eat(COMMA) {
                type_(p, Expected::ShellName);
            }
            m.complete(p, EXTENDS);
        }
        list(p, SHELL);
    });
}

pub(super) fn shell_item(p: &mut Parser<'_>) {
    match p.current() {
        CONSTANT_KW | PROPERTY_KW => property(p),
        INPUT_KW | OUTPUT_KW if p.nth(1) == PORT_KW || !p.nth(1).is_word() || p.nth_begins_line(1) => {
            node(p, PORT, |p| {
                p.expect(PORT_KW);
                declared_type(p);
            })
        }
        REQUIRE_KW | PROVIDE_KW => signature(p, OPERATION_DECLARATION),
        _ if foreign::opt_port(p) => {}
        _ => unknown(p, SHELL),
    }
}

// test_err property_without_its_value
// shell S {
//   property a: int =
//   property b: int
// }
fn property(p: &mut Parser<'_>) {
    node(p, PROPERTY, |p| {
        declared_type(p);
        if p.at(L_BRACK) {
            interval(p);
        }
        opt_initializer(p);
    });
}

fn interval(p: &mut Parser<'_>) {
    node(p, INTERVAL, |p| {
        expression(p);
        p.expect(SEMICOLON);
        expression(p);
        p.expect(R_BRACK);
    });
}

pub(super) fn opt_initializer(p: &mut Parser<'_>) {
    if p.at(EQ) {
        node(p, INITIALIZER, expression);
    }
}
