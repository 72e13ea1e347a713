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
    let m = p.start();
    p.bump();
    name(p);
    if p.at(EXTENDS_KW) {
        extends(p);
    }
    list(p, List::Shell);
    m.complete(p, SHELL);
}

fn extends(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    type_(p, Expected::ShellName);
    while p.eat(COMMA) {
        type_(p, Expected::ShellName);
    }
    m.complete(p, EXTENDS);
}

pub(super) fn shell_item(p: &mut Parser<'_>) {
    match p.current() {
        CONSTANT_KW | PROPERTY_KW => property(p),
        INPUT_KW | OUTPUT_KW => port(p),
        REQUIRE_KW | PROVIDE_KW => operation(p),
        _ => unknown(p, List::Shell),
    }
}

// test_err property_without_its_value
// shell S {
//   property a: int =
//   property b: int
// }
fn property(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    name(p);
    colon_type(p);
    if p.at(L_BRACK) {
        interval(p);
    }
    opt_initializer(p);
    m.complete(p, PROPERTY);
}

fn interval(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    expression(p);
    p.expect(SEMICOLON);
    expression(p);
    p.expect(R_BRACK);
    m.complete(p, INTERVAL);
}

pub(super) fn opt_initializer(p: &mut Parser<'_>) {
    if p.at(EQ) {
        let m = p.start();
        p.bump();
        expression(p);
        m.complete(p, INITIALIZER);
    }
}

fn port(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    p.expect(PORT_KW);
    name(p);
    colon_type(p);
    m.complete(p, PORT);
}

fn operation(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    name(p);
    parameters(p);
    colon_type(p);
    m.complete(p, OPERATION_DECLARATION);
}
