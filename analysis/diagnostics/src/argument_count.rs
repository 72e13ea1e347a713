//! # argument-count
//!
//! A call has too many or too few arguments. `read` takes an input port and a variable, `write` an
//! output port and a value, `status` a port. `send` takes an operation and its `in` and `inout` arguments. `collect` takes a
//! handler, and either no variables or one for each value that it returns: the result, then the `out` and `inout` parameters.
//!
//! ```mauve
//! codel plan(in goal: int, out way: int): bool
//! shell S { input port scan: int  require far(in a: int, out b: double): bool }
//! core C(S) {
//!   var n: int = 0
//!   var d: double
//!   var ok: bool
//!   handler h: far
//!   update = {
//!     plan(n);   // error
//!     plan(n, n);
//!     read(scan);   // error
//!     read(scan, n);
//!     h = send(far);   // error
//!     h = send(far, n);
//!     collect(h, ok);   // error
//!     collect(h, ok, d);
//!     collect(h);
//!   }
//! }
//! ```

use super::*;
use mauve_hir::Builtin;
use mauve_hir::fact::Takes;

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    name: &str,
    takes: &Takes,
    count: usize,
) -> Diagnostic<'db> {
    let shown_count = match count {
        0 => "none".to_owned(),
        count => count.to_string(),
    };
    let message = format!("`{name}` takes {}, found {shown_count}", shown(takes));
    let found = Diagnostic::new(&ARGUMENT_COUNT, at.clone(), message);
    if !matches!(takes, Takes::Port(Builtin::Read)) || count != 1 {
        return found;
    }
    // `n = read(scan)`
    let assignment = statement::assignment_at(db, &at);
    let call = assignment.as_ref().and_then(|it| it.value.strip_prefix("read(")?.strip_suffix(')'));
    match (&assignment, call) {
        (Some(assignment), Some(port)) if port.chars().all(|it| it.is_alphanumeric() || it == '_') => {
            let fixed = format!("read({port}, {})", assignment.target);
            let message = format!("{}; `{fixed}` assigns the value", found.message);
            assignment.replaced(Diagnostic { message, ..found }, fixed)
        }
        _ => found,
    }
}

fn shown(takes: &Takes) -> String {
    let values = |count: &usize| if *count == 1 { "1 value".to_owned() } else { format!("{count} values") };
    match takes {
        Takes::Arguments(0) => "no arguments".to_owned(),
        Takes::Arguments(1) => "1 argument".to_owned(),
        Takes::Arguments(several) => format!("{several} arguments"),
        Takes::Port(Builtin::Read) => "an input port and a variable".to_owned(),
        Takes::Port(Builtin::Write) => "an output port and a value".to_owned(),
        Takes::Port(_) => "an input port".to_owned(),
        Takes::Send { operation, values: count } => {
            format!("`{operation}`, and then {} for its `in` and `inout` parameters", values(count))
        }
        Takes::Collect { values: 0 } => "a handler".to_owned(),
        Takes::Collect { values: count } => {
            format!("a handler, and then nothing or variables for its {}", values(count))
        }
    }
}
