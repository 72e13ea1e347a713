//! How MAUVE writes what other languages write otherwise: the message of each [`Foreign`] form, and a fix for the common ones.
//!
//! A fix replaces, adds or removes a few tokens. A form that it would have to compose again has none, such as `a ? b : c` or
//! branches without braces: its message shows the form in MAUVE.

use mauve_hir::{PERIODS, field_entry, similar_field};
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
    let rule = || rule(form).to_owned();
    let type_first = |written: Option<(String, TextRange)>| match written {
        Some((written, range)) => {
            (format!("the type follows the name: write `{written}`"), Some(writing(range, written)))
        }
        None => (rule(), None),
    };
    match form {
        Foreign::Spelling { tokens, written } => spelling(token, tokens, written),
        Foreign::Superfluous { tokens } => superfluous(token, tokens),
        Foreign::Keyword(keyword) => {
            let message = match keyword {
                "input" => "expected `input` or `output` before `port`".to_owned(),
                keyword => format!("expected `{keyword}` before `{found}`"),
            };
            let before = TextRange::empty(token.text_range().start());
            (message, Some((format!("Write `{keyword}`"), vec![(before, format!("{keyword} "))])))
        }
        Foreign::Loop if matches!(found, "break" | "continue") => {
            (format!("MAUVE has no loops, and no `{found}`"), None)
        }
        Foreign::Function if in_core(token) => {
            let message = "a core has no functions: declare a codel outside of it, or write an operation: \
                           `provide NAME(…) = { … }`";
            (message.to_owned(), None)
        }
        Foreign::CompoundAssignment => compound_assignment(token),
        Foreign::Increment => match incremented(token) {
            Some((name, sign, range)) => {
                let written = format!("{name} = {name} {sign} 1");
                (format!("MAUVE has no `{sign}{sign}`: write `{written};`"), Some(writing(range, written)))
            }
            None => (rule(), None),
        },
        Foreign::TypeFirst => type_first(name_first(token)),
        Foreign::Reference => type_first(reference(token)),
        Foreign::ResultFirst => {
            (format!("the type of the result follows the parameters: `: {}`", mauve_type(found)), None)
        }
        Foreign::NamelessParameter => {
            (format!("a parameter has a name: `in NAME: {}`", mauve_type(found)), None)
        }
        Foreign::Unit => unit(token),
        Foreign::Untyped => (rule(), untyped(token)),
        Foreign::Comma => (rule(), commas(token)),
        _ => (rule(), None),
    }
}

/// Returns the rule of MAUVE for a form.
fn rule(form: Foreign) -> &'static str {
    match form {
        Foreign::Spelling { .. }
        | Foreign::Superfluous { .. }
        | Foreign::Keyword(_)
        | Foreign::CompoundAssignment
        | Foreign::ResultFirst
        | Foreign::NamelessParameter
        | Foreign::Unit => "MAUVE has another spelling",
        Foreign::Loop => {
            "MAUVE has no loops: write the loop in a codel, or repeat a state of a state machine, once per period"
        }
        Foreign::Switch => {
            "MAUVE has no `switch`: write `if … then { … } else if … then { … } else { … }`, or a state machine"
        }
        Foreign::Function => {
            "MAUVE declares functions as codels, which C++ implements: `codel NAME(in PARAMETER: TYPE): RESULT`"
        }
        Foreign::Increment => "MAUVE has one assignment only: `n = n + 1;`",
        Foreign::TypeFirst => "the type follows the name: `n: int`",
        Foreign::Untyped | Foreign::ConstantVariable => {
            "a variable is declared with `var` and its type, as in `var n: int = 3`"
        }
        Foreign::Ternary => "MAUVE has no `? :`: write `if … then { … } else { … }`",
        Foreign::Fraction => "a decimal has digits on both sides of the point, as in `1.0` or `0.5`",
        Foreign::Comma => "items are separated by white space, not by commas",
        Foreign::UnnamedTransition => "a transition has a name: `transition NAME if GUARD to STATE`",
        Foreign::GuardLast => "the guard comes before the target: `transition NAME if GUARD to STATE`",
        Foreign::InitialLast => "`initial` comes before `state`",
        Foreign::ComponentBody => "a component consists of a shell and a core: `component NAME(SHELL, CORE)`",
        Foreign::CoreHeader => "a core has its shell in parentheses: `core NAME(SHELL) { … }`",
        Foreign::ActivityBody => {
            "the fields of an activity have braces: `activity NAME { priority = … period = … }`"
        }
        Foreign::Braces => "the branches of an `if` have braces: `if … then { … } else { … }`",
        Foreign::SecondReader => "a connection has one reader: write a second connection",
        Foreign::Reference => {
            "MAUVE has no references or pointers: write `in NAME: TYPE`, or `inout NAME: TYPE` if the codel changes the value"
        }
        Foreign::Signature => {
            "write the parameters and the result as in `codel NAME(in PARAMETER: TYPE): RESULT`"
        }
        Foreign::CpuList => "a list has brackets, as in `cpus = [1, 2]`",
        Foreign::ShellOperation => {
            "write `provide` or `require` instead of `operation`: a shell provides an operation to others, or requires it"
        }
        Foreign::TransitionForm => "a transition is written as `transition NAME if GUARD to STATE`",
        Foreign::Interval => "an interval has the form `[LOWEST; HIGHEST]`",
        Foreign::InstanceValues => "an instance has no values: write `property INSTANCE.PROPERTY = VALUE`",
        Foreign::Packages => "`use` takes one name: write one `use` for each",
        Foreign::UsedFile => {
            "`use` takes a library or a message package: write `include \"FILE.mal\"` for a file"
        }
        Foreign::ImportFrom => {
            "MAUVE writes `use PACKAGE` for a library or a message package, and `include \"FILE.mal\"` for a file"
        }
        Foreign::Cast => "MAUVE has no casts: a codel converts a value",
        Foreign::TypeSuffix => {
            "a type is one name: MAUVE has no arrays, pointers or type arguments, but messages and external types"
        }
    }
}

/// Returns the rewrite of one range.
pub(super) fn writing(range: TextRange, written: String) -> Rewrite {
    (format!("Write `{written}`"), vec![(range, written)])
}

/// Returns the rewrite that removes one range.
pub(super) fn removing(title: &str, range: TextRange) -> Rewrite {
    (title.to_owned(), vec![(range, String::new())])
}

/// Returns the message for the name of a value that other languages have, and how MAUVE writes the value.
pub(super) fn value(name: &str) -> Option<(String, Option<&'static str>)> {
    let written = match name {
        "True" | "TRUE" => "true",
        "False" | "FALSE" => "false",
        "newData" | "NewData" | "NEW_DATA" => "new_data",
        "oldData" | "OldData" | "OLD_DATA" => "old_data",
        "noData" | "NoData" | "NO_DATA" => "no_data",
        "null" | "NULL" | "nullptr" | "nil" | "None" | "undefined" => {
            return Some((
                format!("MAUVE has no `{name}`: a port without a value has the status `no_data`"),
                None,
            ));
        }
        _ => return None,
    };
    Some((format!("MAUVE writes `{written}` instead of `{name}`"), Some(written)))
}

/// Returns the message for the name of a function that other languages have, and how MAUVE writes it.
pub(super) fn function(name: &str) -> Option<(String, Option<&'static str>)> {
    match name {
        "not" => Some(("MAUVE writes `!` instead of `not`".to_owned(), Some("!"))),
        "publish" => {
            Some(("MAUVE writes `write(PORT, VALUE)` to send a value to an output port".to_owned(), None))
        }
        "print" | "printf" | "println" | "sleep" | "delay" | "wait" | "abs" | "min" | "max" | "sqrt"
        | "sin" | "cos" => Some((
            format!("MAUVE has no function `{name}`: declare a codel `{name}`, which C++ implements"),
            None,
        )),
        _ => None,
    }
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

/// Removes tokens, or the `;` that separates an `else` from its `if`.
fn superfluous(token: &SyntaxToken, tokens: u8) -> Said {
    match token.text() {
        "else" => match semicolon_behind_block(token) {
            Some(semicolon) => (
                "this `else` belongs to no `if`: remove the `;` before it".to_owned(),
                Some(removing("Remove the `;`", semicolon.text_range())),
            ),
            None => ("this `else` belongs to no `if`".to_owned(), None),
        },
        found => {
            let joined = joined(token, tokens);
            let message = match found {
                "void" => "a signature without parameters has `()`".to_owned(),
                _ => format!("unexpected `{joined}`"),
            };
            (message, Some(removing(&format!("Remove `{joined}`"), without_gap(token, tokens))))
        }
    }
}

/// Returns the range of `count` tokens from `token` on.
fn range_of(token: &SyntaxToken, count: u8) -> TextRange {
    let last = (1..count).try_fold(token.clone(), |token, _| next_significant(&token));
    token.text_range().cover(last.unwrap_or_else(|| token.clone()).text_range())
}

fn joined(token: &SyntaxToken, count: u8) -> String {
    let tokens = std::iter::successors(Some(token.clone()), next_significant).take(usize::from(count));
    let texts: Vec<String> = tokens.map(|token| token.text().to_owned()).collect();
    let are_words = texts.iter().all(|text| text.starts_with(|it: char| it.is_alphanumeric()));
    texts.join(if are_words { " " } else { "" })
}

/// Returns `written` with a space where a word before it would go on.
fn padded(token: &SyntaxToken, written: &str) -> String {
    let is_letter = |letter: char| letter.is_alphanumeric() || letter == '_';
    let before = mauve_syntax::previous_token(token);
    let touches = before.is_some_and(|it| it.text().ends_with(is_letter) || it.text().ends_with(')'));
    if touches && (written.starts_with(is_letter) || matches!(written, "=" | "->")) {
        format!(" {written}")
    } else {
        written.to_owned()
    }
}

/// Returns `range` with the white space that does not stand beside `written`.
fn around(token: &SyntaxToken, range: TextRange, written: &str) -> TextRange {
    let before = previous_significant(token).map(|it| it.text_range().end());
    let behind = next_significant(token).map(|it| it.text_range().start());
    match (written, before, behind) {
        (":", Some(before), _) => TextRange::new(before, range.end()),
        ("!", _, Some(behind)) => TextRange::new(range.start(), behind),
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

/// Returns the `;` before `token`, if a block ends before it.
fn semicolon_behind_block(token: &SyntaxToken) -> Option<SyntaxToken> {
    let semicolon = previous_significant(token).filter(|it| it.kind() == SyntaxKind::SEMICOLON)?;
    let is_behind_block = previous_significant(&semicolon)?.kind() == SyntaxKind::R_CURLY;
    is_behind_block.then_some(semicolon)
}

fn in_core(token: &SyntaxToken) -> bool {
    token.parent_ancestors().any(|node| node.kind() == SyntaxKind::CORE)
}

/// Returns the name of a type of another language in MAUVE.
fn mauve_type(name: &str) -> &str {
    match name {
        "boolean" | "Bool" | "Boolean" => "bool",
        "integer" | "Int" | "Integer" => "int",
        "real" | "Double" | "Real" => "double",
        "Float" => "float",
        "str" | "String" => "string",
        "unsigned" => "uint",
        name => name,
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

/// Returns what `n++` increments, by which sign, and the range of that.
fn incremented(token: &SyntaxToken) -> Option<(String, String, TextRange)> {
    let three = [token.clone(), next_significant(token)?, next_significant(&next_significant(token)?)?];
    let name = three.iter().find(|it| it.kind().is_word())?;
    let sign = three.iter().find(|it| !it.kind().is_word())?;
    let range = three.iter().map(SyntaxToken::text_range).reduce(TextRange::cover)?;
    Some((name.text().to_owned(), sign.text().to_owned(), range))
}

/// `let n = 3;` → `var n: int = 3;`
fn untyped(keyword: &SyntaxToken) -> Option<Rewrite> {
    let name = next_significant(keyword)?;
    let value = next_significant(&next_significant(&name)?)?;
    let written = format!("var {}: {}", name.text(), type_of(&value)?);
    Some(writing(keyword.text_range().cover(name.text_range()), written))
}

/// `33 ms` → `33`, and for a time of an activity `2 s` → `2000`.
fn unit(token: &SyntaxToken) -> Said {
    if let Some((name, written, range)) = rate(token) {
        let message = match name.as_str() {
            "period" => format!("a period has no unit: write `{written}`"),
            _ => format!("unknown field `{name}`: write `{written}`"),
        };
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

/// `period = 10 Hz`, `frequency = 10 Hz` → `rate = 10 Hz`. Returns the name of the field, the new text and the range of the
/// field.
fn rate(unit: &SyntaxToken) -> Option<(String, String, TextRange)> {
    let is_rate = |name: &String| similar_field(name) == Some(ActivityField::Rate) || name == "period";
    let name = field_name(unit).filter(|name| unit.text() == "Hz" && is_rate(name))?;
    let field = unit.parent_ancestors().find(|node| node.kind() == SyntaxKind::FIELD)?;
    let others = field.parent()?.children().filter(|it| it.kind() == SyntaxKind::FIELD && *it != field);
    let says_period = |name: SyntaxNode| PERIODS.iter().any(|it| name.text() == it.keyword());
    if others.take(MAX_NEIGHBOURS).filter_map(|it| it.first_child()).any(says_period) {
        return None;
    }
    let number = previous_significant(unit)?;
    previous_significant(&number).filter(|it| it.kind() == SyntaxKind::EQ)?;
    let range = TextRange::new(field.text_range().start(), unit.text_range().end());
    Some((name, format!("rate = {} Hz", number.text()), range))
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
        "s" | "sec" => value * 1e3,
        "us" => value / 1e3,
        "ns" => value / 1e6,
        "min" => value * 6e4,
        _ => return None,
    };
    let exact = (milliseconds * 1e6).round() / 1e6;
    let is_exact = exact > 0.0 && (milliseconds - exact).abs() <= milliseconds * 1e-12;
    is_exact.then(|| exact.to_string())
}

// Declarations

/// `int n` → `n: int`, for a variable `var n: int`.
fn name_first(ty: &SyntaxToken) -> Option<(String, TextRange)> {
    let name = next_significant(ty)?;
    let declaration = ty.parent().and_then(|error| error.parent());
    let keyword = declaration.map_or("", |node| {
        let has = |keyword| significant_tokens(&node).any(|token| token.kind() == keyword);
        match node.kind() {
            SyntaxKind::VAR if !has(SyntaxKind::VAR_KW) => "var ",
            SyntaxKind::INSTANCE if !has(SyntaxKind::INSTANCE_KW) => "instance ",
            _ => "",
        }
    });
    let written = format!("{keyword}{}: {}", name.text(), mauve_type(ty.text()));
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
    let written = format!("in {}: {}", name.text(), mauve_type(&ty));
    (fits && !has_direction).then(|| (written, error.text_range()))
}

/// Removes the commas between the items of a list.
fn commas(first: &SyntaxToken) -> Option<Rewrite> {
    let error = first.parent()?;
    let errors = std::iter::successors(Some(error), SyntaxNode::next_sibling).take(MAX_NEIGHBOURS);
    let commas = errors.filter_map(|error| {
        let comma = error.first_token().filter(|it| it.kind() == SyntaxKind::COMMA)?;
        (error.kind() == SyntaxKind::ERROR).then(|| (comma.text_range(), String::new()))
    });
    Some(("Remove the commas".to_owned(), commas.collect()))
}
