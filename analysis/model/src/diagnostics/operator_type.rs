//! # operator-type
//!
//! An operator does not take these values. Numbers are calculated with and compared by order, strings are joined with `+`,
//! conditions by `&&`, `||` and `!`, and `==` compares values of one type. The status of a port (`no_data`, `old_data`,
//! `new_data`) and of a call (`failure`, `not_ready`, `success`) are different types.
//!
//! ```mauve
//! shell S { input port scan: int }
//! core C(S) {
//!   var n: int = 0
//!   var ok: bool = true
//!   update = {
//!     ok = n + ok > 2;   // error
//!     ok = read(scan, n) == success;   // error
//!     ok = read(scan, n) == new_data && n % 2 == 0;
//!     n = -ok;   // error
//!   }
//! }
//! ```

use super::*;

code!(OPERATOR_TYPE, Error, "operator-type");

/// Where an operator does not take its operands, or what they give has no value.
pub(crate) fn wrong<'db>(
    at: Place<'db>,
    wrong: Wrong,
    operator: &str,
    operands: &[&Type],
) -> Diagnostic<'db> {
    match (wrong, operands) {
        (Wrong::NoValue(why), _) => constant_expression::report(at, why),
        (Wrong::Takes(takes), [left, right]) => binary(at, operator, takes, [left, right]),
        (Wrong::Takes(takes), operands) => {
            let found = operands.first().map_or_else(String::new, |found| format!(", and this is {found}"));
            Diagnostic::new(&OPERATOR_TYPE, at, format!("`{operator}` takes {takes}{found}"))
        }
    }
}

fn binary<'db>(
    at: Place<'db>,
    operator: &str,
    takes: &str,
    [left, right]: [&Type; 2],
) -> Diagnostic<'db> {
    let found = match (left, right) {
        (Type::Unknown, known) | (known, Type::Unknown) => format!("one is {known}"),
        (left, right) => format!("these are {left} and {right}"),
    };
    let message = format!("`{operator}` takes {takes}, and {found}");
    Diagnostic::new(&OPERATOR_TYPE, at, message)
}
