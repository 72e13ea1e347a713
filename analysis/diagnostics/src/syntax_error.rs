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
//!
//! A region between git's conflict markers is one error. What uses a declaration in it, or around it, is not analysed until the
//! conflict is resolved: its figures would be those of one of the two texts.

use mauve_syntax::{
    DEEPEST, Expected, LONGEST_TEXT, NodeOrToken, Parse, SyntaxError, SyntaxErrorKind, SyntaxKind, SyntaxNode,
    SyntaxToken, TextRange, TextSize, TokenError, conflicts, item_keywords, next_significant, previous_significant, previous_token, token_at,
};

use super::*;
use crate::lists::alternatives;
use crate::foreign_syntax::{self, Rewrite, Said, removing, writing};

pub(super) fn report<'db>(parse: &Parse, file: File, error: &SyntaxError, at: Location<'db>) -> Diagnostic<'db> {
    let (message, rewrite) = said(parse, error);
    let mut found = Diagnostic::new(&SYNTAX_ERROR, at, message);
    found.fixes.extend(rewrite.map(|(title, edits)| {
        let location = |range: TextRange| Location::Range(file, range.start().into(), range.end().into());
        Fix { title, edits: edits.into_iter().map(|(range, text)| (location(range), text)).collect() }
    }));
    found
}

/// Returns the message of the diagnostic.
///
/// ```
/// let parse = mauve_syntax::parse("codel f(): int { }");
/// let message = mauve_diagnostics::syntax_error_message(&parse, &parse.errors()[0]);
/// assert!(message.ends_with("or `deployment`), found `{`"));
/// ```
pub fn message(parse: &Parse, error: &SyntaxError) -> String {
    said(parse, error).0
}

/// Writes the tree of a text, a node or token a line, and its errors.
pub fn tree_of(parse: &Parse, interrupt: &dyn Fn()) -> String {
    let errors = parse.errors().iter().inspect(|_| interrupt());
    let errors = errors.map(|error| format!("error {:?}: {}\n", error.range, message(parse, error)));
    parse.debug_dump_interruptible(interrupt) + &errors.collect::<String>()
}

/// Returns the message of an error, and the rewrite that corrects it, if there is one.
fn said(parse: &Parse, error: &SyntaxError) -> Said {
    let token = token_at(&parse.syntax(), error.range.start());
    let message = match error.kind {
        SyntaxErrorKind::Foreign(form) => match &token {
            Some(token) => return foreign_syntax::said(form, token),
            None => "this is not MAUVE",
        },
        SyntaxErrorKind::Token(kind) => match &token {
            Some(token) => return of_token(kind, token),
            None => token_error(kind),
        },
        SyntaxErrorKind::Expected { expected, found, similar } => {
            return missing(parse, error, expected, found, similar);
        }
        SyntaxErrorKind::MessageField => return message_field(token.as_ref()),
        SyntaxErrorKind::PathWithoutQuotes => {
            let message = "expected a path in quotes, as in `include \"file.mal\"`";
            return (message.to_owned(), token.and_then(|token| quoted_path(&token)));
        }
        SyntaxErrorKind::WordAfterField => {
            let message = "expected a field such as `period = 100`; times are in milliseconds, without a unit";
            let number = token.as_ref().and_then(previous_significant);
            let unit = number.map(|it| TextRange::new(it.text_range().end().min(error.range.end()), error.range.end()));
            return (message.to_owned(), unit.map(|unit| removing("Remove the unit", unit)));
        }
        SyntaxErrorKind::Conflict { length, .. } => {
            let region = parse.syntax().text().slice(TextRange::at(error.range.start(), length)).to_string();
            let names = conflicts(&region).into_iter().next().map(|(_, names)| names);
            return (conflict(&names.unwrap_or_default()), None);
        }
        SyntaxErrorKind::LateInclude => "an `include` comes before all declarations of its file",
        SyntaxErrorKind::ChainedComparison => "comparisons do not chain: write `a < b && b < c`",
        SyntaxErrorKind::ArrayElement => "a program does not look into an array: a codel reads its elements",
        SyntaxErrorKind::TooDeep => {
            return (format!("this is nested more than {DEEPEST} levels deep, and is not read"), None);
        }
        SyntaxErrorKind::TooLong => {
            return (format!("this file is longer than {LONGEST_TEXT} bytes, and is not read"), None);
        }
    };
    (message.to_owned(), None)
}

/// Returns the message of a conflict between the texts of these names.
pub(crate) fn conflict(names: &[String; 2]) -> String {
    let are_short = names.iter().all(|name| (1..=80).contains(&name.len()));
    let between = if are_short { format!(" between `{}`", names.join("` and `")) } else { String::new() };
    format!(
        "unresolved merge conflict{between}: keep one of the two texts or join them, and remove the lines with `<<<<<<<`, \
         `=======` and `>>>>>>>`"
    )
}

/// Returns the message for a token or a part that is missing, and the rewrite that adds it.
fn missing(
    parse: &Parse,
    error: &SyntaxError,
    expected: Expected,
    found: Option<SyntaxKind>,
    similar: Option<&str>,
) -> Said {
    let lacks_type = lacks_type(parse, error);
    let message = match (expected, found) {
        _ if let Some((_, declaration)) = &lacks_type => match declaration {
            SyntaxKind::CODEL | SyntaxKind::OPERATION_DECLARATION => {
                "expected `:` and the type of the result: `: void` if there is none".to_owned()
            }
            _ => "expected `:` and a type before the value, as in `n: int = 3`".to_owned(),
        },
        (Expected::Token(SyntaxKind::SEMICOLON), Some(SyntaxKind::R_PAREN)) => {
            return ("this `)` closes nothing".to_owned(), Some(removing("Remove `)`", error.range)));
        }
        (Expected::Token(SyntaxKind::L_PAREN), _) => {
            "expected `(`: a core names its shell, `core NAME(SHELL)`, a component both, `component NAME(SHELL, CORE)`".to_owned()
        }
        _ => {
            let found = found.map(|kind| format!(", found {}", token(parse, error, kind)));
            let similar = similar.map(|word| format!("; did you mean `{word}`?"));
            format!("expected {}{}{}", what(expected), found.unwrap_or_default(), similar.unwrap_or_default())
        }
    };
    let added = || {
        let ty = lacks_type.and_then(|(name, declaration)| missing_type(&name, declaration));
        let (end, sign) = ty.or_else(|| missing_token(parse, error, expected, found))?;
        Some((TextRange::empty(end), sign))
    };
    (message, added().map(|(range, sign)| (format!("Write `{}`", sign.trim()), vec![(range, sign)])))
}

/// Returns the type to insert behind the name of a variable or the parameters of a codel.
fn missing_type(name: &SyntaxToken, declaration: SyntaxKind) -> Option<(TextSize, String)> {
    let written = match declaration {
        SyntaxKind::CODEL | SyntaxKind::OPERATION_DECLARATION => "void",
        _ => foreign_syntax::type_of(&next_significant(&next_significant(name)?)?)?,
    };
    Some((name.text_range().end(), format!(": {written}")))
}

/// Returns the token behind which the type of a declaration is missing, with its colon, and the kind of the declaration.
fn lacks_type(parse: &Parse, error: &SyntaxError) -> Option<(SyntaxToken, SyntaxKind)> {
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
    is_missing.then(|| (before, declaration.kind()))
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

/// Returns the message for a comment, a string, a number with a unit, and the token as MAUVE writes it.
fn of_token(error: TokenError, token: &SyntaxToken) -> Said {
    let text = token.text();
    let instead = |written: String| writing(token.text_range(), written);
    let message = token_error(error).to_owned();
    match error {
        TokenError::Hash if next_significant(token).is_some_and(|it| text == "#" && it.kind() == SyntaxKind::INCLUDE_KW) => {
            ("`include` has no `#`".to_owned(), Some(removing("Remove `#`", token.text_range())))
        }
        TokenError::Hash => {
            let comment = format!("//{}", text.trim_start_matches('#'));
            (message, Some(("Write `//`".to_owned(), vec![(token.text_range(), comment)])))
        }
        TokenError::SingleQuotes => {
            let inner = text.strip_prefix('\'').and_then(|text| text.strip_suffix('\''));
            let inner = inner.filter(|inner| !inner.contains(['"', '\\']));
            (message, inner.map(|inner| instead(format!("\"{inner}\""))))
        }
        TokenError::BadNumber => {
            let digits = text.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
            let unit = text.get(digits.len()..).unwrap_or_default();
            let is_number = digits.ends_with(|letter: char| letter.is_ascii_digit()) && !unit.is_empty() && digits != "0";
            let field = foreign_syntax::field_name(token);
            match foreign_syntax::without_unit(digits, unit, field.as_deref()).filter(|_| is_number) {
                Some(written) => (foreign_syntax::no_unit(field.is_some()), Some(instead(written))),
                None => (message, None),
            }
        }
        TokenError::UnknownEscape
        | TokenError::UnterminatedString
        | TokenError::UnterminatedComment
        | TokenError::ConflictMarker
        | TokenError::Characters => (message, None),
    }
}

/// Writes the quotes of the path of an `include`.
fn quoted_path(token: &SyntaxToken) -> Option<Rewrite> {
    let error = token.parent().filter(|node| node.kind() == SyntaxKind::ERROR)?;
    let text = error.text().to_string();
    let path = text.trim_matches(['<', '>', '\'']).trim();
    let written = format!("\"{path}\"");
    let is_path = !path.is_empty() && !path.contains(['"', ' ', ';', '\n']);
    is_path.then(|| writing(error.text_range(), written))
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

/// Says that messages are opaque, or how ports are read and written.
fn message_field(dot: Option<&SyntaxToken>) -> Said {
    if let Some((range, written)) = dot.and_then(port_call) {
        let message = format!("a port has no methods: write `{written}…)`");
        return (message, Some((format!("Write `{}`", written.trim()), vec![(range, written)])));
    }
    let name = dot.and_then(previous_significant).map(|it| it.text().to_owned());
    let behind = dot.and_then(next_significant).and_then(|it| next_significant(&it));
    let message = match name.filter(|name| name != ")") {
        _ if behind.is_some_and(|it| it.kind() == SyntaxKind::L_PAREN) => {
            "MAUVE has no methods: a program calls codels, as in `plan(goal)`".to_owned()
        }
        Some(name) => format!(
            "a program cannot read the fields of a message: write a codel that takes `{name}` and returns the value"
        ),
        None => "a program cannot read the fields of a message: write a codel that returns the value".to_owned(),
    };
    (message, None)
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
        TokenError::ConflictMarker => "left of a merge conflict: remove this line, and the text that is not to stay",
        TokenError::Characters => "these characters are allowed in strings and comments only",
    }
}

fn what(expected: Expected) -> String {
    let what = match expected {
        Expected::Token(kind) => return token_kind(kind),
        Expected::Item(SyntaxKind::BLOCK) => "a statement",
        Expected::Item(list) => {
            let keywords: Vec<_> = item_keywords(list).into_iter().flatten().map(|it| format!("`{it}`")).collect();
            let keywords = alternatives(&keywords);
            return match list {
                SyntaxKind::SOURCE_FILE | SyntaxKind::LIBRARY => format!("a declaration ({keywords})"),
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
fn missing_token(
    parse: &Parse,
    error: &SyntaxError,
    expected: Expected,
    found: Option<SyntaxKind>,
) -> Option<(TextSize, String)> {
    let Expected::Token(kind) = expected else { return None };
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
    let behind = next.as_ref().and_then(next_significant).map(|it| it.kind());
    let is_next = |kind: SyntaxKind| next.as_ref().is_some_and(|it| it.kind() == kind);
    let text = match sign {
        // Before a value, an operator or a comma is more likely missing.
        ")" | "]" if is_found && next.as_ref().is_some_and(begins_value) => return None,
        // `(1,5)` is no list of arguments.
        ")" if is_next(SyntaxKind::COMMA) && !is_in_list(next.as_ref()?) => return None,
        // `initial State A` has its keyword.
        _ if next.as_ref().is_some_and(|it| it.text().eq_ignore_ascii_case(sign)) => return None,
        // `vra n: int` lacks no sign: its first word is misspelt. So is that of `fi n > 0 then`.
        ";" | ":" if behind == Some(SyntaxKind::COLON) => return None,
        "." if behind == Some(SyntaxKind::DOT) => return None,
        // The word begins no statement.
        ";" if is_next(SyntaxKind::IDENT) && !matches!(behind, Some(SyntaxKind::EQ | SyntaxKind::L_PAREN)) => return None,
        ";" if is_next(SyntaxKind::THEN_KW) => return None,
        "=" if behind == Some(SyntaxKind::EQ) => return None,
        "to" if behind == Some(SyntaxKind::L_PAREN) => return None,
        ";" if is_found && next.as_ref().is_some_and(|it| !it.kind().is_word() && it.kind() != SyntaxKind::R_CURLY) => return None,
        "," if next.as_ref().is_some_and(begins_value) => sign.to_owned(),
        ";" | "]" => sign.to_owned(),
        // One error stands for all that are missing.
        ")" => sign.repeat(open_nodes(&root, before, SyntaxKind::L_PAREN, SyntaxKind::R_PAREN).len().max(1)),
        "}" => {
            // A brace has the indentation of the line of the opening brace.
            let lists = open_nodes(&root, before, SyntaxKind::L_CURLY, SyntaxKind::R_CURLY);
            lists.iter().map(|list| format!("\n{}}}", indentation(list))).collect()
        }
        // Without the token that must follow, the insertion would cause another error.
        ":" | "=" | "->" | "." | "then" | "to" | "if" | "state" | "port" => {
            let next = next.filter(|token| is_found || token.kind() == SyntaxKind::L_CURLY)?;
            let fits = match sign {
                "then" => next.kind() == SyntaxKind::L_CURLY,
                "=" => !matches!(next.kind(), SyntaxKind::COLON | SyntaxKind::SEMICOLON),
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

/// Returns the nodes at an offset that have the token `open` and lack the token `close`, the innermost first.
fn open_nodes(root: &SyntaxNode, offset: TextSize, open: SyntaxKind, close: SyntaxKind) -> Vec<SyntaxNode> {
    let before = mauve_syntax::token_before(root, offset);
    let lists = before.iter().flat_map(SyntaxToken::parent_ancestors).filter(|node| {
        let mut tokens = node.children_with_tokens().filter_map(NodeOrToken::into_token);
        let is_open = tokens.clone().any(|token| token.kind() == open);
        is_open && !tokens.any(|token| token.kind() == close)
    });
    lists.collect()
}

/// Returns whether a comma separates arguments or parameters, instead of the digits of a number.
fn is_in_list(comma: &SyntaxToken) -> bool {
    let lists = [SyntaxKind::ARGUMENT_LIST, SyntaxKind::PARAM_LIST];
    let is_digits = |it: &SyntaxToken| it.kind() == SyntaxKind::INT_NUMBER;
    let is_in_number = previous_token(comma).is_some_and(|it| is_digits(&it))
        && mauve_syntax::next_token(comma).is_some_and(|it| is_digits(&it));
    !is_in_number && comma.parent_ancestors().any(|node| lists.contains(&node.kind()))
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
