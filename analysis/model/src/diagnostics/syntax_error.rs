//! # syntax-error
//!
//! Text that the grammar does not allow. The message says what was expected there.
//!
//! ```mauve
//! codel plan(in goal Pose): Path   // error
//! codel land(): bool
//! ```
//!
//! A half-typed line costs that line and nothing else: the declarations around it mean what they say. But nothing is
//! analysed that rests on what was lost. A program with a syntax error has no time, so its component has none; a
//! deployment with one may lack an activity, so none of it is analysed. A half-typed declaration may be one whose name a
//! program uses: a name that its own library lacks is not looked for in others meanwhile.

use mauve_syntax::ast::{AstNode as _, BinaryExpr, Expr};
use mauve_syntax::{Parse, SyntaxError, TextSize};

use super::*;

code!(SYNTAX_ERROR, Error, "syntax-error");

pub(super) fn report<'db>(parse: &Parse, file: File, error: &SyntaxError, at: Place<'db>) -> Diagnostic<'db> {
    let found = Diagnostic::new(&SYNTAX_ERROR, at, error.message.clone());
    match chained(parse, error) {
        Some((end, middle)) => {
            let place = Place::Range(file, end.into(), end.into());
            found.fix(format!("Write `&& {middle}`"), place, format!(" && {middle}"))
        }
        None => found,
    }
}

/// Of `a < b < c`, where `a < b` ends, and `b`.
fn chained(parse: &Parse, error: &SyntaxError) -> Option<(TextSize, String)> {
    if !error.message.starts_with("comparisons do not chain") {
        return None;
    }
    let operator = parse.syntax().token_at_offset(error.range.start()).right_biased()?;
    let whole = operator.parent_ancestors().find_map(BinaryExpr::cast)?;
    let Some(Expr::BinaryExpr(inner)) = whole.lhs() else { return None };
    let middle = inner.rhs()?;
    Some((inner.syntax().text_range().end(), middle.syntax().text().to_string()))
}
