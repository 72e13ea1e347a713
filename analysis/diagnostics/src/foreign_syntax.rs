//! How MAUVE writes what other languages write otherwise: the message of each [`Foreign`] form, and a fix for the common ones.
//!
//! A fix replaces, adds or removes a few tokens. A form that it would have to compose again has none, such as branches
//! without braces: its message shows the form in MAUVE.

use mauve_hir::{field_entry, similar_field};
use mauve_syntax::ast::{AssignStatement, AstNode as _, Expr};
use mauve_syntax::keywords::ActivityField;
use mauve_syntax::{
    Foreign, SyntaxKind, SyntaxNode, SyntaxToken, TextRange, next_significant, previous_significant,
    significant_tokens,
};

/// The title of a fix, and the ranges that it replaces.
pub(super) type Rewrite = (String, Vec<(TextRange, String)>);

/// The message of an error, and the rewrite that corrects it.
pub(super) type Said = (String, Option<Rewrite>);

/// Returns the message for `form` at `token`, and its rewrite in MAUVE.
pub(super) fn said(form: Foreign, token: &SyntaxToken) -> Said {
    let found = token.text();
    let type_first = |written: Option<(String, TextRange)>, rule: &str| match written {
        Some((written, range)) => {
            (format!("the type follows the name: write `{written}`"), Some(writing(range, written)))
        }
        None => (rule.to_owned(), None),
    };
    let message = match form {
        Foreign::Spelling { tokens, written } => return spelling(token, tokens, written),
        Foreign::Superfluous { tokens } => {
            let joined = joined(token, tokens);
            let removal = removing(&format!("Remove `{joined}`"), without_gap(token, tokens));
            return (format!("unexpected `{joined}`"), Some(removal));
        }
        Foreign::Keyword(keyword) => {
            let before = TextRange::empty(token.text_range().start());
            let edits = vec![(before, format!("{keyword} "))];
            return (
                format!("expected `{keyword}` before `{found}`"),
                Some((format!("Write `{keyword}`"), edits)),
            );
        }
        Foreign::CompoundAssignment => return compound_assignment(token),
        Foreign::Increment => return increment(token),
        Foreign::TypeFirst => {
            return type_first(name_first(token), "a variable has `var` and a type, as in `var n: int = 3`");
        }
        Foreign::Reference => {
            let rule = "MAUVE has no references or pointers: write `in NAME: TYPE`, or `inout NAME: TYPE` if the codel \
                        changes the value";
            return type_first(reference(token), rule);
        }
        Foreign::Unit => return unit(token),
        Foreign::Comma => {
            return ("items are separated by white space, not by commas".to_owned(), commas(token));
        }
        Foreign::ResultFirst => {
            return (format!("the type of the result follows the parameters: `: {found}`"), None);
        }
        Foreign::Loop if matches!(found, "break" | "continue") => {
            return (format!("MAUVE has no loops, and no `{found}`"), None);
        }
        Foreign::Loop => {
            "MAUVE has no loops: write the loop in a codel, or repeat a state of a state machine, once per period"
        }
        Foreign::Switch => {
            "MAUVE has no `switch`: write `if … then { … } else if … then { … } else { … }`, or a state machine"
        }
        Foreign::Function => {
            "MAUVE declares functions as codels, outside of cores, which C++ implements: `codel NAME(in PARAMETER: TYPE): RESULT`"
        }
        Foreign::GuardLast => "the guard comes before the target: `transition NAME if GUARD to STATE`",
        Foreign::Braces => "the branches of an `if` have braces: `if … then { … } else { … }`",
        Foreign::TypeSuffix => {
            "a type is one name: MAUVE has no arrays, pointers or type arguments, but messages and external types"
        }
    };
    (message.to_owned(), None)
}

/// Returns the rewrite of one range.
pub(super) fn writing(range: TextRange, written: String) -> Rewrite {
    (format!("Write `{written}`"), vec![(range, written)])
}

/// Returns the rewrite that removes one range.
pub(super) fn removing(title: &str, range: TextRange) -> Rewrite {
    (title.to_owned(), vec![(range, String::new())])
}

// Tokens

/// `and` → `&&`, `->` in a transition → `to`, `State` → `state`
fn spelling(token: &SyntaxToken, tokens: u8, written: &'static str) -> Said {
    let found = token.text();
    let message = match tokens {
        1 if written == "==" && found == "=" => "`=` assigns: a condition compares with `==`".to_owned(),
        1 if found != written && found.eq_ignore_ascii_case(written) => {
            format!("keywords are lower case: write `{written}`")
        }
        _ => format!("MAUVE writes `{written}` instead of `{}`", joined(token, tokens)),
    };
    if written == "::" {
        return (message, message_type(token));
    }
    let range = around(token, range_of(token, tokens), written);
    (message, Some((format!("Write `{written}`"), vec![(range, padded(token, written))])))
}

/// Returns `count` tokens, from `token` on.
fn following(token: &SyntaxToken, count: u8) -> impl Iterator<Item = SyntaxToken> {
    std::iter::successors(Some(token.clone()), next_significant).take(usize::from(count))
}

fn range_of(token: &SyntaxToken, count: u8) -> TextRange {
    following(token, count).fold(token.text_range(), |range, it| range.cover(it.text_range()))
}

fn joined(token: &SyntaxToken, count: u8) -> String {
    let texts: Vec<String> = following(token, count).map(|it| it.text().to_owned()).collect();
    texts.join(if token.kind().is_word() { " " } else { "" })
}

/// Returns `written` with a space behind a word or `)` that touches it.
fn padded(token: &SyntaxToken, written: &str) -> String {
    let ends =
        |it: SyntaxToken| it.text().ends_with(|last: char| last.is_alphanumeric() || "_)".contains(last));
    let touches = mauve_syntax::previous_token(token).is_some_and(ends) && written != ":";
    format!("{}{written}", if touches { " " } else { "" })
}

/// Returns `range` without the white space before `:` and after `!`.
fn around(token: &SyntaxToken, range: TextRange, written: &str) -> TextRange {
    let before = previous_significant(token).map(|it| it.text_range());
    let behind = next_significant(token).map(|it| it.text_range());
    match (written, before, behind) {
        (":", Some(before), _) => TextRange::new(before.end(), range.end()),
        ("!", _, Some(behind)) => TextRange::new(range.start(), behind.start()),
        _ => range,
    }
}

/// `nav_msgs/msg/Path` → `nav_msgs::Path`
fn message_type(token: &SyntaxToken) -> Option<Rewrite> {
    let ty = token.parent_ancestors().find_map(mauve_syntax::ast::Type::cast)?;
    let segments: Vec<String> = ty.name_refs().map(|it| it.syntax().text().to_string()).collect();
    let written = match segments.as_slice() {
        [package, folder, name] if folder == "msg" => format!("{package}::{name}"),
        segments => segments.join("::"),
    };
    Some(writing(ty.syntax().text_range(), written))
}

/// Returns the range of `count` tokens, with the white space before them on their line.
fn without_gap(token: &SyntaxToken, count: u8) -> TextRange {
    let range = range_of(token, count);
    let gap = mauve_syntax::previous_token(token).filter(|it| it.kind() == SyntaxKind::WHITESPACE);
    match gap {
        Some(gap) if !gap.text().contains('\n') => gap.text_range().cover(range),
        _ => range,
    }
}

/// Returns the type of a variable whose value begins with `token`, if that is a literal.
pub(super) fn type_of(token: &SyntaxToken) -> Option<&'static str> {
    Some(match token.kind() {
        SyntaxKind::INT_NUMBER => "int",
        SyntaxKind::FLOAT_NUMBER => "double",
        SyntaxKind::STRING => "string",
        SyntaxKind::TRUE_KW | SyntaxKind::FALSE_KW => "bool",
        SyntaxKind::MINUS => type_of(&next_significant(token)?)?,
        _ => return None,
    })
}

/// The maximum number of neighbours that a fix visits.
const MAX_NEIGHBOURS: usize = 200;

// Statements

/// `n += a` → `n = n + a`, `n *= a + b` → `n = n * (a + b)`
fn compound_assignment(operator: &SyntaxToken) -> Said {
    let target = previous_significant(operator).map(|it| it.text().to_owned()).unwrap_or_default();
    let written = format!("{target} = {target} {operator} …");
    let mut edits = vec![(range_of(operator, 2), format!("= {target} {operator}"))];
    let statement = operator.parent_ancestors().find_map(AssignStatement::cast);
    let value = statement.and_then(|statement| statement.expr());
    if let Some(value @ (Expr::BinaryExpr(_) | Expr::UnaryExpr(_))) = value {
        let range = value.syntax().text_range();
        edits.push((TextRange::empty(range.start()), "(".to_owned()));
        edits.push((TextRange::empty(range.end()), ")".to_owned()));
    }
    (format!("MAUVE has no `{operator}=`: write `{written}`"), Some((format!("Write `{written}`"), edits)))
}

/// `n++`, `--n` → `n = n + 1`, `n = n - 1`
fn increment(token: &SyntaxToken) -> Said {
    let three: Vec<SyntaxToken> = following(token, 3).collect();
    let is_name = |it: &&SyntaxToken| it.kind().is_word();
    let name = three.iter().find(is_name).map_or("n", SyntaxToken::text);
    let sign = three.iter().find(|it| !is_name(it)).map_or("+", SyntaxToken::text);
    let written = format!("{name} = {name} {sign} 1");
    (format!("MAUVE has no `{sign}{sign}`: write `{written};`"), Some(writing(range_of(token, 3), written)))
}

/// `33 ms` → `33`, and for a time of an activity `2 s` → `2000`.
fn unit(token: &SyntaxToken) -> Said {
    if let Some((written, range)) = rate(token) {
        let message = format!("`Hz` is the unit of a rate: write `{written}`");
        return (message, Some(writing(range, written)));
    }
    let field = field_name(token);
    let rewrite = previous_significant(token).and_then(|number| {
        let written = without_unit(number.text(), token.text(), field.as_deref())?;
        Some(writing(number.text_range().cover(token.text_range()), written))
    });
    (no_unit(field.is_some()), rewrite)
}

/// Returns the message for a number with a unit.
pub(super) fn no_unit(in_field: bool) -> String {
    let of_activity = if in_field { ": the times of an activity are in milliseconds" } else { "" };
    format!("numbers have no unit{of_activity}")
}

/// `period = 10 Hz`, `frequency = 10 Hz` → `rate = 10 Hz`
fn rate(unit: &SyntaxToken) -> Option<(String, TextRange)> {
    let name = field_name(unit).filter(|_| unit.text() == "Hz")?;
    if name != "period" && similar_field(&name) != Some(ActivityField::Rate) {
        return None;
    }
    let field = unit.parent_ancestors().find(|node| node.kind() == SyntaxKind::FIELD)?;
    let number = previous_significant(unit)?;
    previous_significant(&number).filter(|it| it.kind() == SyntaxKind::EQ)?;
    let range = TextRange::new(field.text_range().start(), unit.text_range().end());
    Some((format!("rate = {} Hz", number.text()), range))
}

/// Returns the name of the field of an activity whose value contains `token`.
pub(super) fn field_name(token: &SyntaxToken) -> Option<String> {
    let field = token.parent_ancestors().find(|node| node.kind() == SyntaxKind::FIELD)?;
    Some(field.first_child()?.text().to_string())
}

/// Returns the number of `number` and its `unit`; in a field that has a time, in milliseconds.
///
/// Returns nothing where the number of milliseconds is not exact, or where the field has no time.
pub(super) fn without_unit(number: &str, unit: &str, field: Option<&str>) -> Option<String> {
    let Some(field) = field else { return Some(number.to_owned()) };
    let value: f64 = number.parse().ok().filter(|it: &f64| *it > 0.0 && *it < 1e9)?;
    ActivityField::from_keyword(field).filter(|it| field_entry(*it).kind.is_time())?;
    let milliseconds = match unit {
        "ms" => return Some(number.to_owned()),
        "s" => value * 1e3,
        "us" => value / 1e3,
        "ns" => value / 1e6,
        _ => return None,
    };
    let exact = (milliseconds * 1e6).round() / 1e6;
    let is_exact = exact > 0.0 && (milliseconds - exact).abs() <= milliseconds * 1e-12;
    is_exact.then(|| exact.to_string())
}

// Declarations

/// `int n` → `n: int`, for a variable `var n: int`. `auto` is no type.
fn name_first(ty: &SyntaxToken) -> Option<(String, TextRange)> {
    let name = next_significant(ty).filter(|_| !matches!(ty.text(), "auto" | "let" | "const"))?;
    let declaration = ty.parent()?.parent()?;
    let is_first =
        previous_significant(ty).is_none_or(|it| !declaration.text_range().contains_range(it.text_range()));
    let keyword = match declaration.kind() {
        SyntaxKind::VAR if is_first => "var ",
        SyntaxKind::INSTANCE if is_first => "instance ",
        _ => "",
    };
    let written = format!("{keyword}{}: {}", name.text(), ty.text());
    Some((written, ty.text_range().cover(name.text_range())))
}

/// `const Pose& goal` → `in goal: Pose`. Other references have no rewrite: the codel reads or changes the value.
fn reference(first: &SyntaxToken) -> Option<(String, TextRange)> {
    let error = first.parent().filter(|it| it.kind() == SyntaxKind::ERROR)?;
    let tokens: Vec<SyntaxToken> = significant_tokens(&error).collect();
    let [word, ty @ .., name] = tokens.as_slice() else { return None };
    let ty = match ty.split_last() {
        Some((last, rest)) if last.text() == "&" => rest,
        _ => ty,
    };
    let is_type = |it: &SyntaxToken| it.kind().is_word() || it.kind() == SyntaxKind::COLON2;
    let has_direction = previous_significant(word).is_some_and(|it| it.kind().is_word());
    let fits = word.text() == "const" && name.kind().is_word() && !ty.is_empty() && ty.iter().all(is_type);
    let ty: String = ty.iter().map(SyntaxToken::text).collect();
    let written = format!("in {}: {}", name.text(), ty);
    (fits && !has_direction).then(|| (written, error.text_range()))
}

/// Removes the commas between the items of a list, if it has no other error.
fn commas(first: &SyntaxToken) -> Option<Rewrite> {
    let nodes = std::iter::successors(first.parent(), SyntaxNode::next_sibling).take(MAX_NEIGHBOURS);
    let errors = nodes.filter(|it| it.kind() == SyntaxKind::ERROR).filter_map(|it| it.first_token());
    let errors: Vec<SyntaxToken> = errors.collect();
    let edits = errors.iter().map(|it| (it.text_range(), String::new())).collect();
    let are_commas = errors.iter().all(|it| it.kind() == SyntaxKind::COMMA);
    are_commas.then(|| ("Remove the commas".to_owned(), edits))
}
