//! `deployment D { … }`: an activity for each instance, and values.

use super::*;

// test deployment
// deployment D {
//   architecture nav.A
//   activity laser { affinity = 0x1 priority = 9; period = 100 deadline = 80.5 jitter = 0.5 offset = 2 }
//   activity ui { priority = background }
//   property laser.device = "/dev/ttyACM0";
//   constant laser.rate = 10
// }
pub(super) fn deployment_item(p: &mut Parser<'_>) {
    match p.current() {
        ARCHITECTURE_KW => node(p, TARGET, |p| type_(p, Expected::ArchitectureName)),
        ACTIVITY_KW => node(p, ACTIVITY, activity_rest),
        PROPERTY_KW | CONSTANT_KW => architecture::setting(p),
        IDENT if p.nth(1) == L_CURLY && p.nth(2).is_word() => {
            foreign::without_keyword(p, "activity", ACTIVITY, activity_rest);
        }
        _ => unknown(p, DEPLOYMENT),
    }
}

fn activity_rest(p: &mut Parser<'_>) {
    name_ref(p, Expected::InstanceName);
    list(p, ACTIVITY);
}

// test_err activity_half_typed
// deployment D {
//   architecture A
//   activity a { priority =
//   activity b { priority = 3 period =
//     deadline = 10 }
//   activity
//   property x.y = 1
// }
/// Takes `word = expression`. Name resolution checks the field and its value.
// test_err no_value_before_the_next_field
// deployment D { architecture A  activity a { affinity = 1 priority =  period = 100 deadline = 50 } }
// test_err units
// deployment D { architecture A  activity a { period = 10 ms priority = 3 deadline = 5.5 ms } }
// test lists_and_rates
// deployment D { architecture A
//   activity drivers { instances = [imu, gps] cpus = [1, 2] priority = 1 rate = 30 Hz deadline = 1000/30 }
//   activity b { cpus = big trigger = frame least = 10; rate = 100/3 Hz
//     instances = [] }
//   activity c { trigger = any [scan, odometry] trigger = all [] least = 10 }
// }
// test_err lists_and_rates_half_typed
// deployment D { architecture A
//   activity a { cpus = [1, 2 priority = 1 }
//   activity b { cpus = [1, priority = 1 }
//   activity c { cpus = [1 2] period = 10 Hz rate = 10 ms rate = 10 Hz Hz rate = 10
//     Hz }
//   activity d { instances = [
//     priority = 1 }
// }
pub(super) fn field(p: &mut Parser<'_>) {
    if !p.current().is_word() {
        unknown(p, ACTIVITY);
        return;
    }
    let m = p.start();
    let is_rate = p.at(RATE_KW);
    // A field may begin its line: items of other lists are not allowed here.
    any_word(p, NAME_REF);
    let has_value = expect_or_foreign(p, EQ);
    if has_value && at_next_field(p) {
        // This one has no value yet.
        p.missing(Expected::Expression);
    } else if has_value && at_list(p) {
        value_list(p);
    } else if has_value {
        p.may_have_hertz = is_rate;
        expression(p);
        p.may_have_hertz = false;
        if is_rate && p.at_hertz() {
            p.bump();
        }
    }
    m.complete(p, FIELD);
    // A unit, or the name of an incomplete field: the activity is incomplete.
    if has_value && p.current().is_word() && p.nth(1) != EQ && !p.begins_line() {
        p.skip(SyntaxErrorKind::WordAfterField, |_| true);
    }
}

fn at_next_field(p: &Parser<'_>) -> bool {
    p.current().is_word() && p.nth(1) == EQ
}

fn at_list(p: &Parser<'_>) -> bool {
    !p.begins_line() && (p.at(L_BRACK) || p.at(IDENT) && p.nth(1) == L_BRACK)
}

/// Takes `[imu, gps]`, or `any [scan, odometry]`.
fn value_list(p: &mut Parser<'_>) {
    let has_word = p.at(IDENT);
    node(p, VALUE_LIST, |p| {
        if has_word {
            p.bump();
        }
        separated(p, R_BRACK, Expected::Expression, |p| !at_next_field(p) && opt_expression(p));
        p.expect(R_BRACK);
    });
}
