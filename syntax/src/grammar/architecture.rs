//! `architecture A { … }`: instances, and what connects them.

use super::*;

// test architecture
// architecture Explorer {
//   import nav.Navigation
//   instance laser: Hokuyo;
//   connection laser.scan -> [4] map.scan
//   connection laser.scan -> guidance.scan
//   operation planner.plan -> navigation.plan
//   property laser.device = "/dev/ttyACM0"
//   constant laser.rate = 10 * 2
// }
pub(super) fn architecture(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    name(p);
    list(p, List::Architecture);
    m.complete(p, ARCHITECTURE);
}

pub(super) fn architecture_item(p: &mut Parser<'_>) {
    match p.current() {
        IMPORT_KW => import(p),
        INSTANCE_KW => instance(p),
        CONNECTION_KW => connection(p),
        OPERATION_KW => operation(p),
        PROPERTY_KW | CONSTANT_KW => setting(p),
        _ => {
            unknown(p, List::Architecture);
        }
    }
}

fn import(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    type_(p, Expected::ArchitectureName);
    m.complete(p, IMPORT);
}

// test_err half_typed_items_cost_themselves_only
// architecture A {
//   instance x:
//   connection a.b ->
//   connection c.d -> e.f
//   instance
//   property y.z =
//   instance good: Laser
// }
fn instance(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    name(p);
    if p.expect(COLON) {
        type_(p, Expected::ComponentName);
    }
    m.complete(p, INSTANCE);
}

fn connection(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    endpoint(p);
    p.expect(ARROW);
    if p.at(L_BRACK) {
        let buffer = p.start();
        p.bump();
        p.expect(INT_NUMBER);
        p.expect(R_BRACK);
        buffer.complete(p, BUFFER);
    }
    endpoint(p);
    m.complete(p, CONNECTION);
}

fn operation(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    endpoint(p);
    p.expect(ARROW);
    endpoint(p);
    m.complete(p, OPERATION_CONNECTION);
}

pub(super) fn setting(p: &mut Parser<'_>) {
    let m = p.start();
    p.bump();
    endpoint(p);
    if p.expect(EQ) {
        expression(p);
    }
    m.complete(p, SETTING);
}

/// `instance.feature`
fn endpoint(p: &mut Parser<'_>) {
    if !p.at_name() {
        p.missing(Expected::InstanceName);
        return;
    }
    let m = p.start();
    name_ref(p, Expected::InstanceName);
    if p.expect(DOT) {
        name_ref(p, Expected::Name);
    }
    m.complete(p, ENDPOINT);
}
