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
use mauve_syntax::{
    DEEPEST, Expected, LONGEST_TEXT, List, NodeOrToken, Parse, SyntaxError, SyntaxErrorKind, SyntaxKind,
    SyntaxNode, SyntaxToken, TextRange, TextSize, TokenError, previous_token, token_at,
};

use super::*;
use crate::configuration::alternatives;

code!(SYNTAX_ERROR, Error, "syntax-error");

pub(super) fn report<'db>(parse: &Parse, file: File, error: &SyntaxError, at: Location<'db>) -> Diagnostic<'db> {
    let found = Diagnostic::new(&SYNTAX_ERROR, at, message(parse, error));
    match chained(parse, error) {
        Some((end, middle)) => {
            let location = Location::Range(file, end.into(), end.into());
            found.fix(format!("Write `&& {middle}`"), location, format!(" && {middle}"))
        }
        None if let Some(sign) = single_equals(parse, error) => {
            let location = Location::Range(file, sign.start().into(), sign.end().into());
            found.fix("Write `==`", location, "==".to_owned())
        }
        None => match missing_token(parse, error) {
            Some((end, sign)) => {
                let location = Location::Range(file, end.into(), end.into());
                found.fix(format!("Write `{}`", sign.trim()), location, sign)
            }
            None => found,
        },
    }
}

/// Returns the message of the diagnostic.
///
/// ```
/// let parse = mauve_syntax::parse("codel f(): int { }");
/// let message = mauve_diagnostics::syntax_error_message(&parse, &parse.errors()[0]);
/// assert!(message.ends_with("or `deployment`), found `{`"));
/// ```
pub fn message(parse: &Parse, error: &SyntaxError) -> String {
    match error.kind {
        SyntaxErrorKind::Expected { expected, found, similar } => {
            let found = found.map(|kind| format!(", found {}", token(parse, error, kind)));
            let similar = similar.map(|word| format!("; did you mean `{word}`?"));
            format!(
                "expected {}{}{}",
                what(expected),
                found.unwrap_or_default(),
                similar.unwrap_or_default()
            )
        }
        SyntaxErrorKind::Token(error) => token_error(error).to_owned(),
        SyntaxErrorKind::LateInclude => "an `include` stands before all declarations of its file".to_owned(),
        SyntaxErrorKind::PathWithoutQuotes => {
            "expected a path in quotes, as in `include \"file.mal\"`".to_owned()
        }
        SyntaxErrorKind::WordAfterField => {
            "expected a field such as `period = 100`; times are milliseconds, without a unit".to_owned()
        }
        SyntaxErrorKind::ChainedComparison => {
            "comparisons do not chain: write `a < b && b < c`".to_owned()
        }
        SyntaxErrorKind::MessageField => {
            "a program does not look into a message: a codel does that".to_owned()
        }
        SyntaxErrorKind::ArrayElement => {
            "a program does not look into an array: a codel does that".to_owned()
        }
        SyntaxErrorKind::TooDeep => {
            format!("this is nested more than {DEEPEST} levels deep, and is not read")
        }
        SyntaxErrorKind::TooLong => {
            format!("this file is longer than {LONGEST_TEXT} bytes, and is not read")
        }
    }
}

/// Writes the tree of a text, a node or token a line, and its errors.
pub fn tree_of(parse: &Parse) -> String {
    let errors = parse.errors().iter();
    let errors = errors.map(|error| format!("error {:?}: {}\n", error.range, message(parse, error)));
    parse.debug_dump() + &errors.collect::<String>()
}

fn token_error(error: TokenError) -> &'static str {
    match error {
        TokenError::BadNumber => {
            "this is not a number: write digits, `0x…` or a decimal such as `1.5e-3`, without a unit"
        }
        TokenError::UnterminatedString => "this string is not closed: a string ends on its line with `\"`",
        TokenError::UnterminatedComment => "this comment is not closed: close it with `*/`",
        TokenError::UnknownEscape => {
            "unknown escape in a string: only `\\\"`, `\\\\`, `\\n` and `\\t` mean something"
        }
        TokenError::Hash => "`#` means nothing in MAUVE: a comment begins with `//`",
        TokenError::Characters => "these characters mean nothing in MAUVE outside strings and comments",
    }
}

fn what(expected: Expected) -> String {
    let what = match expected {
        Expected::Token(kind) => return token_kind(kind),
        Expected::Item(List::Block) => "a statement",
        Expected::Item(list) => {
            let keywords: Vec<_> = list.item_keywords().iter().map(|it| format!("`{it}`")).collect();
            let keywords = alternatives(&keywords);
            return match list {
                List::File | List::Library => format!("a declaration ({keywords})"),
                _ => keywords,
            };
        }
        Expected::BlockOrIf => "`{` or `if`",
        Expected::Name => "a name",
        Expected::PackageName => "the name of a library or a message package",
        Expected::ShellName => "the name of a shell",
        Expected::CoreName => "the name of a core",
        Expected::ComponentName => "the name of a component",
        Expected::ArchitectureName => "the name of an architecture",
        Expected::InstanceName => "the name of an instance",
        Expected::StateName => "the name of a state",
        Expected::Type => "a type",
        Expected::Parameters => "`(` and the parameters",
        Expected::Parameter => "a parameter",
        Expected::Argument => "an argument",
        Expected::Expression => "an expression",
    };
    what.to_owned()
}

/// Returns the token at an error: its text if it is a short word or a number, otherwise its kind.
fn token(parse: &Parse, error: &SyntaxError, kind: SyntaxKind) -> String {
    let is_shown = kind.is_word() || matches!(kind, SyntaxKind::INT_NUMBER | SyntaxKind::FLOAT_NUMBER);
    let token = token_at(&parse.syntax(), error.range.start());
    match token.filter(|token| is_shown && token.text().len() <= 40) {
        Some(token) => format!("`{}`", token.text()),
        None => token_kind(kind),
    }
}

fn token_kind(kind: SyntaxKind) -> String {
    use SyntaxKind::*;
    let class = match kind {
        IDENT => "a name",
        INT_NUMBER => "a whole number",
        FLOAT_NUMBER | BAD_NUMBER => "a number",
        STRING | UNTERMINATED_STRING => "a string",
        EOF => "the end of the file",
        _ => return kind.text().map_or_else(|| "this".to_owned(), |text| format!("`{text}`")),
    };
    class.to_owned()
}

/// Returns a missing symbol or keyword to insert, with its offset after the previous token.
///
/// The parser continues as if the token existed, so that the insertion corrects the error.
fn missing_token(parse: &Parse, error: &SyntaxError) -> Option<(TextSize, String)> {
    let SyntaxErrorKind::Expected { expected: Expected::Token(kind), found, .. } = error.kind else {
        return None;
    };
    let (sign, is_found) = (kind.text()?, found.is_some());
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
        // Before a value, an operator or a comma is more likely missing.
        ")" | "]" if is_found && next.as_ref().is_some_and(begins_value) => return None,
        ";" | ")" | "]" => sign.to_owned(),
        "}" => {
            // The brace has the indentation of the line of the opening brace.
            let offset = mauve_syntax::token_before(&root, before)?;
            let mut lists = offset.parent_ancestors();
            let list = lists.find(|node| {
                let mut tokens = node.children_with_tokens().filter_map(NodeOrToken::into_token);
                let is_open = tokens.clone().any(|token| token.kind() == SyntaxKind::L_CURLY);
                is_open && !tokens.any(|token| token.kind() == SyntaxKind::R_CURLY)
            })?;
            format!("\n{}}}", indentation(&list))
        }
        // Without the token that must follow, the insertion would cause another error.
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

/// Returns the `=` in a condition, to replace by `==`.
fn single_equals(parse: &Parse, error: &SyntaxError) -> Option<TextRange> {
    let SyntaxErrorKind::Expected { found: Some(SyntaxKind::EQ), .. } = error.kind else { return None };
    let root = parse.syntax();
    let sign = token_at(&root, error.range.start())?;
    let ends = [SyntaxKind::IF_KW, SyntaxKind::SEMICOLON, SyntaxKind::L_CURLY, SyntaxKind::R_CURLY];
    let end = tokens_before(&sign).find(|token| ends.contains(&token.kind()))?;
    (sign.kind() == SyntaxKind::EQ && end.kind() == SyntaxKind::IF_KW).then(|| sign.text_range())
}

/// The maximum number of tokens that a search for a fix visits.
const MAX_TOKENS: usize = 1000;

/// Returns the nearest tokens before `token`, backwards.
fn tokens_before(token: &SyntaxToken) -> impl Iterator<Item = SyntaxToken> {
    std::iter::successors(previous_token(token), previous_token).take(MAX_TOKENS)
}

/// Returns whether a value may begin with the token.
fn begins_value(token: &SyntaxToken) -> bool {
    use SyntaxKind::*;
    match token.kind() {
        THEN_KW | TO_KW => false,
        INT_NUMBER | FLOAT_NUMBER | STRING | L_PAREN | BANG => true,
        kind => kind.is_word(),
    }
}

fn following(token: SyntaxToken, fits: impl Fn(&SyntaxToken) -> bool) -> Option<SyntaxToken> {
    let all = std::iter::successors(Some(token), SyntaxToken::next_token);
    all.take(MAX_TOKENS).find(|token| fits(token))
}

/// Returns the indentation of the line on which `node` begins.
fn indentation(node: &SyntaxNode) -> String {
    let token = node.first_token();
    let mut before = std::iter::successors(token, SyntaxToken::prev_token).take(MAX_TOKENS);
    let line = before.find(|token| token.text().contains('\n'));
    let line = line.map(|token| token.text().rsplit('\n').next().unwrap_or_default().to_owned());
    line.filter(|line| line.trim().is_empty()).unwrap_or_default()
}

/// Returns, for `a < b < c`, the end of `a < b`, and `b`.
fn chained(parse: &Parse, error: &SyntaxError) -> Option<(TextSize, String)> {
    if error.kind != SyntaxErrorKind::ChainedComparison {
        return None;
    }
    let operator = token_at(&parse.syntax(), error.range.start())?;
    let outer = operator.parent_ancestors().find_map(BinaryExpr::cast)?;
    let Some(Expr::BinaryExpr(inner)) = outer.lhs() else { return None };
    let middle = inner.rhs()?;
    Some((inner.syntax().text_range().end(), middle.syntax().text().to_string()))
}
