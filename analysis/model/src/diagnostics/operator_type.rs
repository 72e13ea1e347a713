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

pub(crate) fn binary<'db>(
    at: Place<'db>,
    operator: BinaryOperator,
    takes: &str,
    [left, right]: [&Type; 2],
) -> Diagnostic<'db> {
    let found = match (left, right) {
        (Type::Unknown, known) | (known, Type::Unknown) => format!("one is {known}"),
        (left, right) => format!("these are {left} and {right}"),
    };
    let message = format!("`{}` takes {takes}, and {found}", operator.text());
    Diagnostic::new(&OPERATOR_TYPE, at, message)
}

pub(crate) fn unary<'db>(at: Place<'db>, operator: UnaryOperator, takes: &str, found: &Type) -> Diagnostic<'db> {
    Diagnostic::new(&OPERATOR_TYPE, at, format!("`{}` takes {takes}, and this is {found}", operator.text()))
}
