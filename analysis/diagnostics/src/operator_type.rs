//! # operator-type
//!
//! An operator does not take values of these types. Arithmetic and comparisons take numbers, `+` also joins strings, `&&`,
//! `||` and `!` take conditions, and `==` compares values of one type. The status of a port (`no_data`, `old_data`,
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
use mauve_hir::item_tree::{BinaryOperator, UnaryOperator};

pub(super) fn unary<'db>(at: Location<'db>, operator: UnaryOperator, operand: &Type) -> Diagnostic<'db> {
    let takes = match operator {
        UnaryOperator::Not => "a condition",
        UnaryOperator::Minus => "a number",
    };
    let message = format!("`{}` takes {takes}, and this is {}", operator.text(), type_name(operand));
    Diagnostic::new(&OPERATOR_TYPE, at, message)
}

pub(super) fn binary<'db>(
    at: Location<'db>,
    operator: BinaryOperator,
    operands @ [left, right]: &[Type; 2],
) -> Diagnostic<'db> {
    use BinaryOperator as Op;
    let takes = match operator {
        Op::Or | Op::And => "two conditions",
        Op::Equal | Op::NotEqual if operands.iter().any(Type::is_no_operand) => {
            "values, and not calls that are under way"
        }
        Op::Equal | Op::NotEqual => "two values of one type",
        Op::Remainder => "two whole numbers",
        Op::Add => "two numbers, or two strings",
        _ => "two numbers",
    };
    let found = match (left, right) {
        (Type::Unknown, known) | (known, Type::Unknown) => format!("one is {}", type_name(known)),
        (left, right) => format!("these are {} and {}", type_name(left), type_name(right)),
    };
    Diagnostic::new(&OPERATOR_TYPE, at, format!("`{}` takes {takes}, and {found}", operator.text()))
}
