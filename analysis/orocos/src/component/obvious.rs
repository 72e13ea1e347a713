//! Conditions that are the same for all values: `n < n`, `n > 3 && n < 2`, `small < 256`.
//!
//! Models may have them, and the C++ compilers warn of them. A file with such a condition suppresses these warnings.

use mauve_hir::item_tree::BinaryOperator;
use mauve_hir::{Type, Value};

use super::code::{ConstantComparison, CppCode};

/// The lines that suppress the warnings.
pub(super) const MEANT: [&str; 3] = [
    "// Conditions that are always true or always false are intended: MAUVE reports them in the model.",
    "#pragma GCC diagnostic ignored \"-Wtautological-compare\"",
    "#pragma GCC diagnostic ignored \"-Wtype-limits\"",
];

/// Returns a comparison with a constant.
pub(super) fn comparison(
    operator: BinaryOperator,
    lhs: &CppCode,
    rhs: &CppCode,
) -> Option<ConstantComparison> {
    use BinaryOperator as Op;
    let mirrored = match operator {
        Op::Less => Op::Greater,
        Op::LessOrEqual => Op::GreaterOrEqual,
        Op::Greater => Op::Less,
        Op::GreaterOrEqual => Op::LessOrEqual,
        other => other,
    };
    match (number(lhs), number(rhs)) {
        (None, Some(number)) => Some((lhs.text.clone(), operator, number)),
        (Some(number), None) => Some((rhs.text.clone(), mirrored, number)),
        _ => None,
    }
}

/// The number of a constant, or of a status.
fn number(code: &CppCode) -> Option<f64> {
    match (&code.value, code.text.as_str()) {
        (Some(Value::Bool(value)), _) => Some(f64::from(u8::from(*value))),
        (Some(value), _) => value.number(),
        (None, "RTT::NoData" | "RTT::SendNotReady") => Some(0.0),
        (None, "RTT::OldData" | "RTT::SendSuccess") => Some(1.0),
        (None, "RTT::NewData") => Some(2.0),
        (None, "RTT::SendFailure") => Some(-1.0),
        _ => None,
    }
}

/// Returns whether a comparison gives the same for all values of its operands.
pub(super) fn is_obvious(operator: BinaryOperator, lhs: &CppCode, rhs: &CppCode) -> bool {
    // Compilers know that sums and products are commutative.
    let words = |code: &CppCode| {
        let mut words: Vec<String> =
            code.text.split([' ', '(', ')']).filter(|word| !word.is_empty()).map(str::to_owned).collect();
        words.sort();
        words
    };
    if words(lhs) == words(rhs) {
        return true;
    }
    let Some((_, _, number)) = comparison(operator, lhs, rhs) else { return false };
    [lhs, rhs].into_iter().filter(|code| code.value.is_none()).any(|code| match &code.ty {
        Type::Integer(integer) => {
            let (least, greatest) = integer.ends();
            number <= least as f64 || number >= greatest as f64
        }
        _ => false,
    })
}

/// Returns whether `&&` or `||` gives the same for all values of the operands.
pub(super) fn are_obvious(operator: BinaryOperator, lhs: &CppCode, rhs: &CppCode) -> bool {
    let negated = |one: &CppCode, other: &CppCode| {
        let inner = one.text.strip_prefix('!').map(|it| it.trim_matches(['(', ')']));
        inner == Some(other.text.trim_matches(['(', ')']))
    };
    if negated(lhs, rhs) || negated(rhs, lhs) {
        return true;
    }
    let (Some((what, one, a)), Some((other, two, b))) = (&lhs.compared, &rhs.compared) else { return false };
    if what != other {
        return false;
    }
    // Between these values, neither comparison changes.
    let values = [*a, *b].into_iter().flat_map(|end| [end - 1.0, end - 0.5, end, end + 0.5, end + 1.0]);
    let holds = |operator, value, number| {
        let result = Value::Double(value).binary(operator, &Value::Double(number));
        matches!(result, Ok(Some(Value::Bool(true))))
    };
    let gives = |value: f64| {
        let (one, two) = (holds(*one, value, *a), holds(*two, value, *b));
        if operator == BinaryOperator::And { one && two } else { one || two }
    };
    let mut all = values.map(gives);
    let first = all.next();
    all.all(|it| Some(it) == first)
}
