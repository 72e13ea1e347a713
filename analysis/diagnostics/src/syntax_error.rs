//! # syntax-error
//!
//! The grammar does not allow the text. The message says what was expected there or, for a form of another language such
//! as `and`, `while` or `n += 1`, how MAUVE writes it. The fix writes that where it is mechanical.
//!
//! ```mauve
//! codel plan(in goal Pose): Path   // error
//! codel land(): bool
//! shell S { }
//! core C(S) {
//!   var n: int = 0
//!   update = {
//!     if (n = 10) then { } else { }   // error
//!     if n == 10 and n > 3 then { } else { }   // error
//!     n += 1;   // error
//!     while n < 3 { n = n + 1; }   // error
//!   }
//! }
//! ```
//!
//! An incomplete line affects that line only: the declarations around it are read as they are. But nothing is analysed
//! that depends on the incomplete text. A program with a syntax error has no execution time, and neither has its component.
//! A deployment with one may lack an activity, so it is not analysed at all. An incomplete declaration may declare a name
//! that a program uses: until it is complete, a name that its own library lacks is not looked up in other libraries.
//! Errors that follow from an incomplete declaration, such as unresolved names that it may declare, are not reported.

use mauve_syntax::ast::{AstNode as _, BinaryExpr, Expr};
use mauve_syntax::{
    DEEPEST, Expected, Foreign, LONGEST_TEXT, List, NodeOrToken, Parse, SyntaxError, SyntaxErrorKind, SyntaxKind,
    SyntaxNode, SyntaxToken, TextRange, TextSize, TokenError, next_significant, previous_significant, previous_token,
    token_at,
};

use super::*;
use crate::lists::alternatives;
use crate::foreign_syntax::{self, Rewrite};

code!(SYNTAX_ERROR, Error, "syntax-error");

pub(super) fn report<'db>(parse: &Parse, file: File, error: &SyntaxError, at: Location<'db>) -> Diagnostic<'db> {
    let mut found = Diagnostic::new(&SYNTAX_ERROR, at, message(parse, error));
    if let Some((title, edits)) = rewrite(parse, error) {
        let location = |range: TextRange| Location::Range(file, range.start().into(), range.end().into());
        let edits = edits.into_iter().map(|(range, text)| (location(range), text)).collect();
        found.fixes.push(Fix { title, edits });
    }
    found
}

/// Returns the rewrite that corrects an error, if there is one.
fn rewrite(parse: &Parse, error: &SyntaxError) -> Option<Rewrite> {
    let token = token_at(&parse.syntax(), error.range.start());
    let rewrite = match error.kind {
        SyntaxErrorKind::Foreign(form) => return foreign_syntax::rewrite(form, &token?),
        SyntaxErrorKind::Token(error) => return token_rewrite(error, &token?),
        SyntaxErrorKind::PathWithoutQuotes => return quoted_path(&token?),
        SyntaxErrorKind::MessageField => port_call(&token?)?,
        SyntaxErrorKind::WordAfterField => {
            let number = previous_significant(token.as_ref()?)?;
            let start = number.text_range().end().min(error.range.end());
            (TextRange::new(start, error.range.end()), String::new())
        }
        SyntaxErrorKind::Expected { expected: Expected::Token(SyntaxKind::SEMICOLON), found: Some(SyntaxKind::R_PAREN), .. } => {
            let title = "Remove `)`".to_owned();
            return Some((title, vec![(error.range, String::new())]));
        }
        SyntaxErrorKind::ChainedComparison => {
            let (end, middle) = chained(parse, error)?;
            (TextRange::empty(end), format!(" && {middle}"))
        }
        _ => match single_equals(parse, error) {
            Some(sign) => (sign, "==".to_owned()),
            None => {
                let (end, sign) = missing_type(parse, error).or_else(|| missing_token(parse, error))?;
                (TextRange::empty(end), sign)
            }
        },
    };
    let title = match rewrite.1.trim() {
        "" => "Remove the unit".to_owned(),
        written => format!("Write `{written}`"),
    };
    Some((title, vec![rewrite]))
}

/// Returns the type to insert behind the name of a variable or the parameters of a codel.
fn missing_type(parse: &Parse, error: &SyntaxError) -> Option<(TextSize, String)> {
    let declaration = lacks_type(parse, error)?;
    let name = token_before_error(parse, error)?;
    let end = name.text_range().end();
    let written = match declaration {
        SyntaxKind::CODEL | SyntaxKind::OPERATION_DECLARATION => "void",
        _ => foreign_syntax::type_of(&next_significant(&next_significant(&name)?)?)?,
    };
    Some((end, format!(": {written}")))
}

/// Returns the kind of the declaration whose type is missing, with its colon.
fn lacks_type(parse: &Parse, error: &SyntaxError) -> Option<SyntaxKind> {
    let SyntaxErrorKind::Expected { expected: Expected::Token(SyntaxKind::COLON), found, .. } = error.kind else {
        return None;
    };
    let before = token_before_error(parse, error)?;
    let declaration = before.parent_ancestors().find(|node| {
        use SyntaxKind::{CODEL, OPERATION_DECLARATION, PROPERTY, VAR};
        matches!(node.kind(), CODEL | OPERATION_DECLARATION | VAR | PROPERTY)
    })?;
    let is_type = found.is_some_and(SyntaxKind::is_word) && previous_significant(&before).is_some();
    let is_missing = match declaration.kind() {
        SyntaxKind::CODEL | SyntaxKind::OPERATION_DECLARATION => {
            before.kind() == SyntaxKind::R_PAREN && !(is_type && next_is_type(parse, error))
        }
        _ => found == Some(SyntaxKind::EQ),
    };
    is_missing.then(|| declaration.kind())
}

/// Does a type stand at the error, in the declaration that lacks the colon before it?
fn next_is_type(parse: &Parse, error: &SyntaxError) -> bool {
    let token = token_at(&parse.syntax(), error.range.start());
    token.is_some_and(|token| token.parent_ancestors().any(|node| node.kind() == SyntaxKind::TYPE))
}

/// Returns the last token before an error that is neither white space nor a comment.
fn token_before_error(parse: &Parse, error: &SyntaxError) -> Option<SyntaxToken> {
    let root = parse.syntax();
    match error.range.is_empty() {
        true => mauve_syntax::token_before(&root, error.range.start()),
        false => previous_significant(&token_at(&root, error.range.start())?),
    }
}

/// Corrects a token: a comment, a string, a number with a unit.
fn token_rewrite(error: TokenError, token: &SyntaxToken) -> Option<Rewrite> {
    let text = token.text();
    let (title, written) = match error {
        TokenError::Hash => {
            let is_include = is_before_include(token);
            let written = if is_include { String::new() } else { format!("//{}", text.trim_start_matches('#')) };
            (if is_include { "Remove `#`" } else { "Write `//`" }.to_owned(), written)
        }
        TokenError::SingleQuotes => {
            let inner = text.strip_prefix('\'')?.strip_suffix('\'')?;
            let written = format!("\"{inner}\"");
            (!inner.contains(['"', '\\'])).then(|| (format!("Write `{written}`"), written))?
        }
        TokenError::BadNumber => {
            let digits = text.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
            let unit = text.get(digits.len()..)?;
            let field = foreign_syntax::field_name(token);
            let is_number = digits.ends_with(|letter: char| letter.is_ascii_digit()) && !unit.is_empty();
            let written = foreign_syntax::without_unit(digits, unit, field.as_deref()).filter(|_| is_number && digits != "0")?;
            (format!("Write `{written}`"), written)
        }
        TokenError::UnknownEscape => {
            let written = with_escapes(text);
            (format!("Write `{written}`"), written)
        }
        TokenError::UnterminatedString | TokenError::UnterminatedComment | TokenError::Characters => return None,
    };
    Some((title, vec![(token.text_range(), written)]))
}

/// Writes `\\` for each `\` of a string that begins no escape.
fn with_escapes(string: &str) -> String {
    let mut written = String::with_capacity(string.len() + 1);
    let mut letters = string.chars();
    while let Some(letter) = letters.next() {
        written.push(letter);
        if letter == '\\' {
            let next = letters.next();
            if !matches!(next, Some('"' | '\\' | 'n' | 't')) {
                written.push('\\');
            }
            written.extend(next);
        }
    }
    written
}

/// Writes the quotes of the path of an `include`.
fn quoted_path(token: &SyntaxToken) -> Option<Rewrite> {
    let error = token.parent().filter(|node| node.kind() == SyntaxKind::ERROR)?;
    let text = error.text().to_string();
    let path = text.trim_matches(['<', '>', '\'']).trim();
    let written = format!("\"{path}\"");
    let is_path = !path.is_empty() && !path.contains(['"', ' ', ';', '\n']);
    is_path.then(|| (format!("Write `{written}`"), vec![(error.text_range(), written)]))
}

/// Returns the call of a built-in function for `port.read(variable)`.
fn port_call(dot: &SyntaxToken) -> Option<(TextRange, String)> {
    let (port, method) = (previous_significant(dot)?, next_significant(dot)?);
    let open = next_significant(&method).filter(|open| open.kind() == SyntaxKind::L_PAREN)?;
    if !["read", "write", "status"].contains(&method.text()) {
        return None;
    }
    if !port.kind().is_word() {
        return None;
    }
    let next = next_significant(&open)?;
    let comma = if next.kind() == SyntaxKind::R_PAREN { "" } else { ", " };
    let range = port.text_range().cover(open.text_range());
    Some((range, format!("{}({}{comma}", method.text(), port.text())))
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
        SyntaxErrorKind::Foreign(form) => match token_at(&parse.syntax(), error.range.start()) {
            Some(token) => foreign_syntax::message(form, &token),
            None => "this is not MAUVE".to_owned(),
        },
        SyntaxErrorKind::Expected { .. } if let Some(declaration) = lacks_type(parse, error) => match declaration {
            SyntaxKind::CODEL | SyntaxKind::OPERATION_DECLARATION => {
                "expected `:` and the type of the result: `: void` if there is none".to_owned()
            }
            _ => "expected `:` and a type before the value, as in `n: int = 3`".to_owned(),
        },
        SyntaxErrorKind::Expected { expected: Expected::Token(SyntaxKind::SEMICOLON), found: Some(SyntaxKind::R_PAREN), .. } => {
            "this `)` closes nothing".to_owned()
        }
        SyntaxErrorKind::Expected { expected: Expected::Token(SyntaxKind::L_PAREN), .. } => {
            "expected `(`: a core names its shell, `core NAME(SHELL)`, a component both, `component NAME(SHELL, CORE)`".to_owned()
        }
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
        SyntaxErrorKind::Token(kind) => token_message(parse, error, kind),
        SyntaxErrorKind::LateInclude => "an `include` comes before all declarations of its file".to_owned(),
        SyntaxErrorKind::PathWithoutQuotes => {
            "expected a path in quotes, as in `include \"file.mal\"`".to_owned()
        }
        SyntaxErrorKind::WordAfterField => {
            "expected a field such as `period = 100`; times are in milliseconds, without a unit".to_owned()
        }
        SyntaxErrorKind::ChainedComparison => {
            "comparisons do not chain: write `a < b && b < c`".to_owned()
        }
        SyntaxErrorKind::MessageField => message_field(parse, error),
        SyntaxErrorKind::ArrayElement => {
            "a program does not look into an array: a codel reads its elements".to_owned()
        }
        SyntaxErrorKind::TooDeep => {
            format!("this is nested more than {DEEPEST} levels deep, and is not read")
        }
        SyntaxErrorKind::TooLong => {
            format!("this file is longer than {LONGEST_TEXT} bytes, and is not read")
        }
    }
}

/// Says that messages are opaque, or how ports are read and written.
fn message_field(parse: &Parse, error: &SyntaxError) -> String {
    let dot = token_at(&parse.syntax(), error.range.start());
    let call = dot.as_ref().and_then(port_call);
    let name = dot.as_ref().and_then(previous_significant).map(|it| it.text().to_owned());
    let behind = dot.as_ref().and_then(next_significant).and_then(|it| next_significant(&it));
    match call {
        Some((_, written)) => format!("a port has no methods: write `{written}…)`"),
        None if behind.is_some_and(|it| it.kind() == SyntaxKind::L_PAREN) => {
            "MAUVE has no methods: a program calls codels, as in `plan(goal)`".to_owned()
        }
        None => match name.filter(|name| name != ")") {
            Some(name) => format!(
                "a program cannot read the fields of a message: write a codel that takes `{name}` and returns the value"
            ),
            None => "a program cannot read the fields of a message: write a codel that returns the value".to_owned(),
        },
    }
}

/// Writes the tree of a text, a node or token a line, and its errors.
pub fn tree_of(parse: &Parse, interrupt: &dyn Fn()) -> String {
    let errors = parse.errors().iter().inspect(|_| interrupt());
    let errors = errors.map(|error| format!("error {:?}: {}\n", error.range, message(parse, error)));
    parse.debug_dump_interruptible(interrupt) + &errors.collect::<String>()
}

/// Is this the `#` of `#include`?
fn is_before_include(token: &SyntaxToken) -> bool {
    token.text() == "#" && next_significant(token).is_some_and(|it| it.kind() == SyntaxKind::INCLUDE_KW)
}

fn token_message(parse: &Parse, error: &SyntaxError, kind: TokenError) -> String {
    let token = token_at(&parse.syntax(), error.range.start());
    if kind == TokenError::Hash && token.as_ref().is_some_and(is_before_include) {
        return "`include` has no `#`".to_owned();
    }
    let unit = token.filter(|token| kind == TokenError::BadNumber && token_rewrite(kind, token).is_some());
    match unit {
        Some(number) => foreign_syntax::message(Foreign::Unit, &number),
        None => token_error(kind).to_owned(),
    }
}

fn token_error(error: TokenError) -> &'static str {
    match error {
        TokenError::BadNumber => {
            "this is not a number: write digits, `0x…` or a decimal such as `1.5e-3`, without a unit"
        }
        TokenError::UnterminatedString => "this string is not closed: a string ends on its line with `\"`",
        TokenError::UnterminatedComment => "this comment is not closed: close it with `*/`",
        TokenError::UnknownEscape => {
            "unknown escape in a string: the escapes are `\\\"`, `\\\\`, `\\n` and `\\t`"
        }
        TokenError::Hash => "a comment begins with `//`, not with `#`",
        TokenError::SingleQuotes => "a string is written between `\"`, not between `'`",
        TokenError::Characters => "these characters are allowed in strings and comments only",
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
        ";" if is_found && next.as_ref().is_some_and(|it| !it.kind().is_word() && it.kind() != SyntaxKind::R_CURLY) => return None,
        "," if next.as_ref().is_some_and(begins_value) => sign.to_owned(),
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
        ":" | "=" | "->" | "." | "then" | "to" | "if" | "state" | "port" => {
            let next = next.filter(|token| is_found || token.kind() == SyntaxKind::L_CURLY)?;
            let fits = match sign {
                "then" => next.kind() == SyntaxKind::L_CURLY,
                "=" => next.kind() != SyntaxKind::COLON,
                "if" => true,
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
