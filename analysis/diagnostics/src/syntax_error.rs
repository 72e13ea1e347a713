//! # syntax-error
//!
//! Text that the grammar does not allow. The message says what was expected there. Where that is a sign or a keyword that is
//! always the same, the fix writes it; for a `=` in a condition, `==`.
//!
//! ```mauve
//! codel plan(in goal Pose): Path   // error
//! codel land(): bool
//! shell S { }
//! core C(S) {
//!   var n: int = 0
//!   update = {
//!     if (n = 10) then { } else { }   // error
//!     if n = 10 then { } else { }   // error
//!   }
//! }
//! ```
//!
//! A half-typed line costs that line and nothing else: the declarations around it mean what they say. But nothing is
//! analysed that rests on what was lost. A program with a syntax error has no time, so its component has none; a
//! deployment with one may lack an activity, so none of it is analysed. A half-typed declaration may be one whose name a
//! program uses: a name that its own library lacks is not looked for in others meanwhile.

use mauve_syntax::ast::{AstNode as _, BinaryExpr, Expr};
use mauve_syntax::{NodeOrToken, Parse, SyntaxError, SyntaxKind, SyntaxNode, SyntaxToken, TextRange, TextSize, previous_token, token_at};

use super::*;

code!(SYNTAX_ERROR, Error, "syntax-error");

pub(super) fn report<'db>(parse: &Parse, file: File, error: &SyntaxError, at: Location<'db>) -> Diagnostic<'db> {
    let found = Diagnostic::new(&SYNTAX_ERROR, at, error.message.clone());
    match chained(parse, error) {
        Some((end, middle)) => {
            let place = Location::Range(file, end.into(), end.into());
            found.fix(format!("Write `&& {middle}`"), place, format!(" && {middle}"))
        }
        None if let Some(sign) = single_equals(parse, error) => {
            let place = Location::Range(file, sign.start().into(), sign.end().into());
            found.fix("Write `==`", place, "==".to_owned())
        }
        None => match forgotten(parse, error) {
            Some((end, sign)) => {
                let place = Location::Range(file, end.into(), end.into());
                found.fix(format!("Write `{}`", sign.trim()), place, sign)
            }
            None => found,
        },
    }
}

/// The sign or keyword that is missing, and where it belongs: right behind what stands before it.
///
/// With it the parser goes on as if it had been there, since it is what it was about to take.
fn forgotten(parse: &Parse, error: &SyntaxError) -> Option<(TextSize, String)> {
    let (sign, found) = error.message.strip_prefix("expected `")?.split_once('`')?;
    let is_found = found.starts_with(", found ");
    if !found.is_empty() && !is_found {
        return None;
    }
    let root = parse.syntax();
    let next = match is_found {
        true => token_at(&root, error.range.start()),
        false => mauve_syntax::token_before(&root, error.range.start())?.next_token(),
    };
    let is_there = |token: &SyntaxToken| !token.kind().is_trivia();
    let next = next.and_then(|token| following(token, is_there));
    let before = match is_found {
        true => tokens_before(next.as_ref()?).find(is_there)?.text_range().end(),
        false => error.range.end(),
    };
    let text = match sign {
        // Before a value, it is rather an operator or a comma that is missing.
        ")" | "]" if is_found && next.as_ref().is_some_and(begins_value) => return None,
        ";" | ")" | "]" => sign.to_owned(),
        "}" => {
            // The brace goes where the line begins that opened it.
            let offset = mauve_syntax::token_before(&root, before)?;
            let mut lists = offset.parent_ancestors();
            let list = lists.find(|node| {
                let mut tokens = node.children_with_tokens().filter_map(NodeOrToken::into_token);
                let is_open = tokens.clone().any(|token| token.kind() == SyntaxKind::L_CURLY);
                is_open && !tokens.any(|token| token.kind() == SyntaxKind::R_CURLY)
            })?;
            format!("\n{}}}", indentation(&list))
        }
        // What follows has to be there too, or there will be another mistake.
        ":" | "=" | "->" | "." | "then" | "to" => {
            let next = next.filter(|token| is_found || token.kind() == SyntaxKind::L_CURLY)?;
            let fits = match sign {
                "then" => next.kind() == SyntaxKind::L_CURLY,
                "=" => next.kind() != SyntaxKind::COLON,
                _ => next.kind().is_word(),
            };
            match sign {
                _ if !fits => return None,
                ":" | "." => sign.to_owned(),
                _ => format!(" {sign}"),
            }
        }
        _ => return None,
    };
    Some((before, text))
}

/// The `=` in a condition, where `==` is meant.
fn single_equals(parse: &Parse, error: &SyntaxError) -> Option<TextRange> {
    if !error.message.ends_with(", found `=`") {
        return None;
    }
    let root = parse.syntax();
    let sign = token_at(&root, error.range.start())?;
    let ends = [SyntaxKind::IF_KW, SyntaxKind::SEMICOLON, SyntaxKind::L_CURLY, SyntaxKind::R_CURLY];
    let end = tokens_before(&sign).find(|token| ends.contains(&token.kind()))?;
    (sign.kind() == SyntaxKind::EQ && end.kind() == SyntaxKind::IF_KW).then(|| sign.text_range())
}

/// A condition has no more tokens: for a longer one nothing is offered.
const MOST_TOKENS: usize = 1000;

/// The tokens before `token`, backwards, the nearest of them.
fn tokens_before(token: &SyntaxToken) -> impl Iterator<Item = SyntaxToken> {
    std::iter::successors(previous_token(token), previous_token).take(MOST_TOKENS)
}

/// May a value begin with it?
fn begins_value(token: &SyntaxToken) -> bool {
    use SyntaxKind::*;
    match token.kind() {
        THEN_KW | TO_KW => false,
        INT_NUMBER | FLOAT_NUMBER | STRING | L_PAREN | BANG => true,
        kind => kind.is_word(),
    }
}

fn following(token: SyntaxToken, is_it: impl Fn(&SyntaxToken) -> bool) -> Option<SyntaxToken> {
    let all = std::iter::successors(Some(token), SyntaxToken::next_token);
    all.take(MOST_TOKENS).find(|token| is_it(token))
}

/// The white space with which the line of `node` begins.
fn indentation(node: &SyntaxNode) -> String {
    let token = node.first_token();
    let mut before = std::iter::successors(token, SyntaxToken::prev_token).take(MOST_TOKENS);
    let line = before.find(|token| token.text().contains('\n'));
    let line = line.map(|token| token.text().rsplit('\n').next().unwrap_or_default().to_owned());
    line.filter(|line| line.trim().is_empty()).unwrap_or_default()
}

/// Of `a < b < c`, where `a < b` ends, and `b`.
fn chained(parse: &Parse, error: &SyntaxError) -> Option<(TextSize, String)> {
    if !error.message.starts_with("comparisons do not chain") {
        return None;
    }
    let operator = token_at(&parse.syntax(), error.range.start())?;
    let whole = operator.parent_ancestors().find_map(BinaryExpr::cast)?;
    let Some(Expr::BinaryExpr(inner)) = whole.lhs() else { return None };
    let middle = inner.rhs()?;
    Some((inner.syntax().text_range().end(), middle.syntax().text().to_string()))
}
