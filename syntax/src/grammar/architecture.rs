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
pub(super) fn architecture_item(p: &mut Parser<'_>) {
    match p.current() {
        IMPORT_KW => node(p, IMPORT, |p| type_(p, Expected::ArchitectureName)),
        INSTANCE_KW => node(p, INSTANCE, instance_rest),
        CONNECTION_KW => node(p, CONNECTION, connection_rest),
        OPERATION_KW => node(p, OPERATION_CONNECTION, |p| {
            endpoint(p);
            expect_or_foreign(p, ARROW);
            endpoint(p);
        }),
        PROPERTY_KW | CONSTANT_KW => setting(p),
        _ if foreign::opt_architecture_item(p) => {}
        _ => unknown(p, ARCHITECTURE),
    }
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
pub(super) fn instance_rest(p: &mut Parser<'_>) {
    if opt_type_before_name(p) {
        return;
    }
    name(p);
    if expect_or_foreign(p, COLON) || p.at_name() && !p.begins_line() && !p.at_own_item() {
        type_(p, Expected::ComponentName);
    }
}

pub(super) fn connection_rest(p: &mut Parser<'_>) {
    endpoint(p);
    expect_or_foreign(p, ARROW);
    if p.at(L_BRACK) {
        node(p, BUFFER, |p| {
            p.expect(INT_NUMBER);
            p.expect(R_BRACK);
        });
    }
    endpoint(p);
}

pub(super) fn setting(p: &mut Parser<'_>) {
    node(p, SETTING, setting_rest);
}

pub(super) fn setting_rest(p: &mut Parser<'_>) {
    endpoint(p);
    if p.expect(EQ) {
        expression(p);
    }
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
