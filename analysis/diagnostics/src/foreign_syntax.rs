//! How MAUVE writes what other languages write otherwise: the messages and fixes of [`Foreign`].

use mauve_syntax::ast::{AssignStatement, AstNode as _, Expr, Transition};
use mauve_syntax::{
    Foreign, NodeOrToken, SyntaxKind, SyntaxNode, SyntaxToken, TextRange, TextSize, next_significant,
    previous_significant, significant_tokens,
};

/// The title of a fix, and the ranges that it replaces.
pub(super) type Rewrite = (String, Vec<(TextRange, String)>);

/// Returns the message for `form` at `token`.
pub(super) fn message(form: Foreign, token: &SyntaxToken) -> String {
    let found = token.text();
    match form {
        Foreign::Spelling { written: "==", tokens: 1 } if found == "=" => {
            "`=` assigns: a condition compares with `==`".to_owned()
        }
        Foreign::Spelling { written, tokens: 1 } if found != written && found.eq_ignore_ascii_case(written) => {
            format!("keywords are lower case: write `{written}`")
        }
        Foreign::Spelling { tokens, written } => {
            format!("MAUVE writes `{written}` instead of `{}`", joined(token, tokens))
        }
        Foreign::Superfluous { .. } if found == "else" => match semicolon_behind_block(token) {
            Some(_) => "this `else` belongs to no `if`: remove the `;` before it".to_owned(),
            None => "this `else` belongs to no `if`".to_owned(),
        },
        Foreign::Superfluous { .. } if found == "void" => "a signature without parameters has `()`".to_owned(),
        Foreign::Superfluous { tokens } => format!("unexpected `{}`", joined(token, tokens)),
        Foreign::Keyword("input") => "expected `input` or `output` before `port`".to_owned(),
        Foreign::Keyword(keyword) => format!("expected `{keyword}` before `{found}`"),
        Foreign::Loop if matches!(found, "break" | "continue") => format!("MAUVE has no loops, and no `{found}`"),
        Foreign::Function if in_core(token) => {
            "a core has no functions: declare a codel outside of it, or write an operation: `provide NAME(…) = { … }`"
                .to_owned()
        }
        Foreign::CompoundAssignment => {
            let target = previous_significant(token).map(|it| it.text().to_owned()).unwrap_or_default();
            format!("MAUVE has no `{found}=`: write `{target} = {target} {found} …`")
        }
        Foreign::Increment if let Some((name, sign, _)) = incremented(token) => {
            format!("MAUVE has no `{sign}{sign}`: write `{name} = {name} {sign} 1;`")
        }
        Foreign::TypeFirst if let Some((written, _)) = name_first(token) => {
            format!("the type follows the name: write `{written}`")
        }
        Foreign::ResultFirst => format!("the type of the result follows the parameters: `: {}`", mauve_type(found)),
        Foreign::NamelessParameter => format!("a parameter has a name: `in NAME: {}`", mauve_type(found)),
        Foreign::Reference if let Some((written, _)) = reference(token) => {
            format!("the type follows the name: write `{written}`")
        }
        Foreign::Unit if let Some((name, written, _)) = period_of_rate(token) => {
            format!("unknown field `{name}`: write `{written}`")
        }
        Foreign::Unit if in_field(token) => {
            "numbers have no unit: the times of an activity are in milliseconds".to_owned()
        }
        form => rule(form).to_owned(),
    }
}

/// Returns the rule of MAUVE for a form.
fn rule(form: Foreign) -> &'static str {
    match form {
        Foreign::Spelling { .. } | Foreign::Superfluous { .. } | Foreign::Keyword(_) => {
            "MAUVE has another spelling"
        }
        Foreign::Loop => {
            "MAUVE has no loops: write the loop in a codel, or repeat a state of a state machine, once per period"
        }
        Foreign::Switch => {
            "MAUVE has no `switch`: write `if … then { … } else if … then { … } else { … }`, or a state machine"
        }
        Foreign::Function => {
            "MAUVE declares functions as codels, which C++ implements: `codel NAME(in PARAMETER: TYPE): RESULT`"
        }
        Foreign::CompoundAssignment | Foreign::Increment => "MAUVE has one assignment only: `n = n + 1;`",
        Foreign::TypeFirst => "the type follows the name: `n: int`",
        Foreign::ResultFirst => "the type of the result follows the parameters",
        Foreign::Untyped | Foreign::ConstantVariable => {
            "a variable is declared with `var` and its type, as in `var n: int = 3`"
        }
        Foreign::Ternary => "MAUVE has no `? :`: write `if … then { … } else { … }`",
        Foreign::Unit => "numbers have no unit",
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
        Foreign::NamelessParameter => "a parameter has a name: `in NAME: TYPE`",
        Foreign::Signature => {
            "write the parameters and the result as in `codel NAME(in PARAMETER: TYPE): RESULT`"
        }
        Foreign::CpuList => "expected a bit mask of CPUs: 1 is CPU 1, 2 is CPU 2, 3 is both",
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

/// Returns the rewrite of `form` at `token` in MAUVE, if it is mechanical.
pub(super) fn rewrite(form: Foreign, token: &SyntaxToken) -> Option<Rewrite> {
    let range = token.text_range();
    match form {
        Foreign::Spelling { written: "::", .. } => message_type(token),
        Foreign::Spelling { tokens, written } => {
            let range = around(token, range_of(token, tokens), written);
            Some((format!("Write `{written}`"), vec![(range, padded(token, written))]))
        }
        Foreign::Superfluous { .. } if token.text() == "else" => {
            let semicolon = semicolon_behind_block(token)?;
            Some(("Remove the `;`".to_owned(), vec![(semicolon.text_range(), String::new())]))
        }
        Foreign::Superfluous { tokens } => {
            let title = format!("Remove `{}`", joined(token, tokens));
            Some((title, vec![(without_gap(token, tokens), String::new())]))
        }
        Foreign::Keyword(keyword) => {
            let before = TextRange::empty(range.start());
            Some((format!("Write `{keyword}`"), vec![(before, format!("{keyword} "))]))
        }
        Foreign::CompoundAssignment => compound_assignment(token),
        Foreign::Increment => {
            let (name, sign, range) = incremented(token)?;
            Some(writing(range, format!("{name} = {name} {sign} 1")))
        }
        Foreign::TypeFirst => name_first(token).map(|(written, range)| writing(range, written)),
        Foreign::ResultFirst => result_last(token),
        Foreign::Untyped => {
            let name = next_significant(token)?;
            let value = next_significant(&next_significant(&name)?)?;
            let written = format!("var {}: {}", name.text(), type_of(&value)?);
            Some(writing(range.cover(name.text_range()), written))
        }
        Foreign::Ternary => ternary(token),
        Foreign::Unit => unit(token),
        Foreign::Fraction => fraction(token),
        Foreign::Comma => commas(token),
        Foreign::UnnamedTransition => transition_name(token),
        Foreign::GuardLast => guard_first(token),
        Foreign::InitialLast => {
            let state = previous_significant(token)?;
            Some(writing(state.text_range().cover(range), "initial state".to_owned()))
        }
        Foreign::CoreHeader => core_header(token),
        Foreign::ActivityBody => activity_body(token),
        Foreign::Braces => braces(token),
        Foreign::Function => prototype(token),
        Foreign::ComponentBody => component(token),
        Foreign::SecondReader => second_connection(token),
        Foreign::Reference => reference(token).map(|(written, range)| writing(range, written)),
        Foreign::Interval => interval(token),
        Foreign::Packages => packages(token),
        Foreign::UsedFile => used_file(token),
        Foreign::ConstantVariable => {
            let ty = next_significant(token)?;
            let name = next_significant(&ty)?;
            let written = format!("var {}: {}", name.text(), mauve_type(ty.text()));
            Some(writing(range.cover(name.text_range()), written))
        }
        Foreign::CpuList
        | Foreign::ShellOperation
        | Foreign::TransitionForm
        | Foreign::InstanceValues
        | Foreign::ImportFrom
        | Foreign::Loop
        | Foreign::Switch
        | Foreign::TypeSuffix
        | Foreign::NamelessParameter
        | Foreign::Signature
        | Foreign::Cast => None,
    }
}

/// Returns the rewrite of one range.
fn writing(range: TextRange, written: String) -> Rewrite {
    (format!("Write `{written}`"), vec![(range, written)])
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

/// Returns the range between two offsets, unless they are swapped.
fn span(start: TextSize, end: TextSize) -> Option<TextRange> {
    (start <= end).then(|| TextRange::new(start, end))
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
    let segments: Vec<String> = ty.segments().map(|it| it.syntax().text().to_string()).collect();
    let written = match segments.as_slice() {
        [package, folder, name] if folder == "msg" => format!("{package}::{name}"),
        segments => segments.join("::"),
    };
    Some((format!("Write `{written}`"), vec![(ty.syntax().text_range(), written)]))
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

fn in_field(token: &SyntaxToken) -> bool {
    token.parent_ancestors().any(|node| node.kind() == SyntaxKind::FIELD)
}

/// Is this the type of a variable without `var`?
fn is_variable(token: &SyntaxToken) -> bool {
    let variable = token.parent().and_then(|error| error.parent());
    let variable = variable.filter(|node| node.kind() == SyntaxKind::VAR);
    variable.is_some_and(|node| significant_tokens(&node).all(|token| token.kind() != SyntaxKind::VAR_KW))
}

/// Is this the component of an instance without `instance`?
fn is_instance(token: &SyntaxToken) -> bool {
    let instance = token.parent().and_then(|error| error.parent());
    let instance = instance.filter(|node| node.kind() == SyntaxKind::INSTANCE);
    instance
        .is_some_and(|node| significant_tokens(&node).all(|token| token.kind() != SyntaxKind::INSTANCE_KW))
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

/// `1.` → `1.0`, `.5` → `0.5`
fn fraction(point: &SyntaxToken) -> Option<Rewrite> {
    let before = previous_significant(point)?;
    let range = point.text_range();
    let (at, title) = match before.kind() {
        SyntaxKind::INT_NUMBER => (range.end(), format!("Write `{}.0`", before.text())),
        _ => (range.start(), format!("Write `0.{}`", next_significant(point)?.text())),
    };
    Some((title, vec![(TextRange::empty(at), "0".to_owned())]))
}

/// `n += a` → `n = n + a`
fn compound_assignment(token: &SyntaxToken) -> Option<Rewrite> {
    let statement = token.parent_ancestors().find_map(AssignStatement::cast)?;
    let target = statement.name_ref()?.syntax().text().to_string();
    let operator = token.text();
    let mut edits = vec![(range_of(token, 2), format!("= {target} {operator}"))];
    if let Some(value @ (Expr::BinaryExpr(_) | Expr::UnaryExpr(_))) = statement.expr() {
        let range = value.syntax().text_range();
        edits.push((TextRange::empty(range.start()), "(".to_owned()));
        edits.push((TextRange::empty(range.end()), ")".to_owned()));
    }
    Some((format!("Write `{target} = {target} {operator} …`"), edits))
}

/// Returns what `n++` increments, by which sign, and the range of that.
fn incremented(token: &SyntaxToken) -> Option<(String, String, TextRange)> {
    let three = [token.clone(), next_significant(token)?, next_significant(&next_significant(token)?)?];
    let name = three.iter().find(|it| it.kind().is_word())?;
    let sign = three.iter().find(|it| !it.kind().is_word())?;
    let range = three.iter().map(SyntaxToken::text_range).reduce(TextRange::cover)?;
    Some((name.text().to_owned(), sign.text().to_owned(), range))
}

/// `x = a ? b : c;` → `if a then { x = b; } else { x = c; }`
fn ternary(token: &SyntaxToken) -> Option<Rewrite> {
    let statement = token.parent_ancestors().find_map(AssignStatement::cast)?;
    let target = statement.name_ref()?.syntax().text().to_string();
    let text = statement.syntax().text().to_string();
    let (_, value) = text.strip_suffix(';')?.split_once('=')?;
    let (condition, branches) = value.split_once('?')?;
    let (then, otherwise) = branches.split_once(':')?;
    if branches.contains(['?', '"', ';']) || otherwise.contains(':') {
        return None;
    }
    let (condition, then, otherwise) = (condition.trim(), then.trim(), otherwise.trim());
    let written = format!("if {condition} then {{ {target} = {then}; }} else {{ {target} = {otherwise}; }}");
    Some(("Write an `if`".to_owned(), vec![(statement.syntax().text_range(), written)]))
}

/// `33 ms` → `33`, and for a time of an activity `2 s` → `2000`.
fn unit(token: &SyntaxToken) -> Option<Rewrite> {
    if let Some((_, written, range)) = period_of_rate(token) {
        return Some(writing(range, written));
    }
    let number = previous_significant(token)?;
    let written = without_unit(number.text(), token.text(), field_name(token).as_deref())?;
    let range = number.text_range().cover(token.text_range());
    Some((format!("Write `{written}`"), vec![(range, written)]))
}

/// `rate = 10 Hz` → `period = 100`. Returns the name of the field, the new text and the range of the field.
fn period_of_rate(unit: &SyntaxToken) -> Option<(String, String, TextRange)> {
    let name = field_name(unit).filter(|name| matches!(name.as_str(), "rate" | "frequency" | "freq"))?;
    let field = unit.parent_ancestors().find(|node| node.kind() == SyntaxKind::FIELD)?;
    let others = field.parent()?.children().filter(|it| it.kind() == SyntaxKind::FIELD);
    if others.take(MAX_NEIGHBOURS).filter_map(|it| it.first_child()).any(|name| name.text() == "period") {
        return None;
    }
    let number = previous_significant(unit)?;
    let milliseconds = match unit.text() {
        "Hz" => without_unit(number.text(), "Hz", Some("period"))?,
        _ => return None,
    };
    let range = span(field.text_range().start(), unit.text_range().end())?;
    Some((name, format!("period = {milliseconds}"), range))
}

/// Returns the name of the field of an activity whose value contains `token`.
pub(super) fn field_name(token: &SyntaxToken) -> Option<String> {
    let field = token.parent_ancestors().find(|node| node.kind() == SyntaxKind::FIELD)?;
    Some(field.first_child()?.text().to_string())
}

/// Returns the number of `number` and its `unit`; in the field `period` or `deadline`, in milliseconds.
///
/// Returns nothing where the number of milliseconds is not exact, or where the field has no time.
pub(super) fn without_unit(number: &str, unit: &str, field: Option<&str>) -> Option<String> {
    let Some(field) = field else { return Some(number.to_owned()) };
    let value: f64 = number.parse().ok().filter(|it: &f64| *it > 0.0 && *it < 1e9)?;
    let milliseconds = match (field, unit) {
        ("period" | "deadline", "ms") => return Some(number.to_owned()),
        ("period" | "deadline", "s" | "sec") => value * 1e3,
        ("period" | "deadline", "us") => value / 1e3,
        ("period" | "deadline", "ns") => value / 1e6,
        ("period" | "deadline", "min") => value * 6e4,
        ("period", "Hz") => 1e3 / value,
        _ => return None,
    };
    let exact = (milliseconds * 1e6).round() / 1e6;
    let is_exact = exact > 0.0 && (milliseconds - exact).abs() <= milliseconds * 1e-12;
    is_exact.then(|| exact.to_string())
}

/// Writes the braces of all branches of an `if`, and its `then`.
fn braces(token: &SyntaxToken) -> Option<Rewrite> {
    let first =
        token.parent_ancestors().filter(|node| node.kind() == SyntaxKind::IF_STATEMENT).find(|node| {
            let begin = node.children().find(|child| child.kind() == SyntaxKind::BLOCK && !has_brace(child));
            begin.is_some_and(|block| block.text_range().contains_range(token.text_range()))
                || node.children().any(|it| it.kind() == SyntaxKind::ELSE)
        })?;
    let mut edits = Vec::new();
    let mut statement = Some(first);
    while let Some(node) = statement {
        let is_keyword = |kind| significant_tokens(&node).any(|token| token.kind() == kind);
        let needs_then = node.kind() == SyntaxKind::IF_STATEMENT && !is_keyword(SyntaxKind::THEN_KW);
        if let Some(block) = node.children().find(|it| it.kind() == SyntaxKind::BLOCK && !has_brace(it)) {
            edits.extend(in_braces(&block, needs_then)?);
        }
        statement =
            node.children().find(|it| matches!(it.kind(), SyntaxKind::ELSE | SyntaxKind::IF_STATEMENT));
    }
    Some(("Write the braces".to_owned(), edits))
}

fn has_brace(block: &SyntaxNode) -> bool {
    significant_tokens(block).any(|token| token.kind() == SyntaxKind::L_CURLY)
}

/// Puts a branch into braces, instead of `begin` and `end`.
fn in_braces(block: &SyntaxNode, needs_then: bool) -> Option<Vec<(TextRange, String)>> {
    let open = if needs_then { "then {" } else { "{" };
    let is_word = |node: &SyntaxNode| {
        node.kind() == SyntaxKind::ERROR
            && node.first_token().is_some_and(|it| it.kind() == SyntaxKind::IDENT)
    };
    let range = block.text_range();
    let before = block.first_child().filter(is_word);
    let behind = block.last_child().filter(is_word);
    let open = match before {
        Some(word) => (word.text_range(), open.to_owned()),
        None => (TextRange::empty(range.start()), format!("{open} ")),
    };
    let close = match behind {
        Some(word) => (word.text_range(), "}".to_owned()),
        None => (TextRange::empty(range.end()), " }".to_owned()),
    };
    Some(vec![open, close])
}

// Declarations

/// `int n` → `n: int`, for a variable `var n: int`.
fn name_first(ty: &SyntaxToken) -> Option<(String, TextRange)> {
    let name = next_significant(ty)?;
    let keyword = match is_variable(ty) {
        true => "var ",
        false if is_instance(ty) => "instance ",
        false => "",
    };
    let written = format!("{keyword}{}: {}", name.text(), mauve_type(ty.text()));
    Some((written, ty.text_range().cover(name.text_range())))
}

/// `in [1, 400]` → `[1; 400]`
fn interval(first: &SyntaxToken) -> Option<Rewrite> {
    let error = first.parent().filter(|it| it.kind() == SyntaxKind::ERROR)?;
    let text = error.text().to_string();
    let bounds = text.trim_start_matches("in").trim().strip_prefix('[')?.strip_suffix(']')?;
    let (low, high) = bounds.split_once([',', ';'])?;
    let is_number = |bound: &str| bound.trim().parse::<f64>().is_ok();
    let written = format!("[{}; {}]", low.trim(), high.trim());
    (is_number(low) && is_number(high)).then(|| writing(error.text_range(), written))
}

/// `use a, b` → `use a use b`
fn packages(first: &SyntaxToken) -> Option<Rewrite> {
    let next = |comma: &SyntaxToken| next_significant(&next_significant(comma)?);
    let commas = std::iter::successors(Some(first.clone()), next);
    let commas = commas.take(MAX_NEIGHBOURS).take_while(|it| it.kind() == SyntaxKind::COMMA);
    Some(("Write `use`".to_owned(), commas.map(|it| (it.text_range(), " use".to_owned())).collect()))
}

/// `use robot.mal` → `include "robot.mal"`
fn used_file(dot: &SyntaxToken) -> Option<Rewrite> {
    let name = previous_significant(dot)?;
    let keyword = previous_significant(&name)?;
    let range = span(keyword.text_range().start(), next_significant(dot)?.text_range().end())?;
    Some(writing(range, format!("include \"{}.mal\"", name.text())))
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

/// `connection a.b -> c.d, e.f` → `connection a.b -> c.d connection a.b -> e.f`
fn second_connection(comma: &SyntaxToken) -> Option<Rewrite> {
    let connection = comma.parent_ancestors().find(|node| node.kind() == SyntaxKind::CONNECTION)?;
    let source = connection.children().find(|it| it.kind() == SyntaxKind::ENDPOINT)?.text().to_string();
    let has_keyword = connection.first_token()?.text() == "connection";
    let has_buffer = connection.children().any(|it| it.kind() == SyntaxKind::BUFFER);
    let commas =
        connection.children().filter(|it| it.kind() == SyntaxKind::ERROR && !it.text_range().is_empty());
    let written: Option<Vec<_>> = commas
        .map(|error| {
            let all: Vec<SyntaxToken> = significant_tokens(&error).collect();
            let [comma, instance, dot, port] = all.as_slice() else { return None };
            let target = [instance, dot, port].map(SyntaxToken::text).concat();
            let range = span(comma.text_range().start(), port.text_range().end())?;
            (comma.kind() == SyntaxKind::COMMA).then(|| (range, format!(" connection {source} -> {target}")))
        })
        .collect();
    let written = written.filter(|_| has_keyword && !has_buffer)?;
    Some(("Write a second connection".to_owned(), written))
}

/// `codel int act(…)` → `codel act(…): int`
fn result_last(ty: &SyntaxToken) -> Option<Rewrite> {
    let name = next_significant(ty)?;
    let parameters = ty.parent()?.parent()?.children().find(|it| it.kind() == SyntaxKind::PARAM_LIST)?;
    let written = format!(": {}", mauve_type(ty.text()));
    let before = span(ty.text_range().start(), name.text_range().start())?;
    let behind = TextRange::empty(parameters.text_range().end());
    Some((format!("Write `{written}`"), vec![(before, String::new()), (behind, written)]))
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

/// `core C: S`, `core C extends S` → `core C(S)`
fn core_header(token: &SyntaxToken) -> Option<Rewrite> {
    let core = token.parent()?.parent()?;
    let shell = core.children().find(|it| it.kind() == SyntaxKind::TYPE)?;
    let name = previous_significant(token)?;
    let range = span(name.text_range().end(), shell.text_range().end())?;
    Some(writing(range, format!("({})", shell.text())))
}

/// `activity pilot: priority = 1, period = 100` → `activity pilot { priority = 1 period = 100 }`
fn activity_body(colon: &SyntaxToken) -> Option<Rewrite> {
    let activity = colon.parent_ancestors().find(|node| node.kind() == SyntaxKind::ACTIVITY)?;
    let tokens = activity.descendants_with_tokens().filter_map(NodeOrToken::into_token);
    let commas =
        tokens.filter(|it| it.kind() == SyntaxKind::COMMA).map(|it| (it.text_range(), String::new()));
    let mut edits = vec![
        (colon.text_range(), " {".to_owned()),
        (TextRange::empty(activity.text_range().end()), " }".to_owned()),
    ];
    edits.extend(commas);
    Some(("Write the braces".to_owned(), edits))
}

/// `component Robot { shell S core C }` → `component Robot(S, C)`
fn component(open: &SyntaxToken) -> Option<Rewrite> {
    let body = open.parent().filter(|node| node.kind() == SyntaxKind::ERROR)?;
    let words: Vec<SyntaxToken> = significant_tokens(&body).filter(|it| it.kind().is_word()).collect();
    let [shell_keyword, shell, core_keyword, core] = words.as_slice() else { return None };
    let fits = shell_keyword.kind() == SyntaxKind::SHELL_KW && core_keyword.kind() == SyntaxKind::CORE_KW;
    let written = format!("({}, {})", shell.text(), core.text());
    let name = previous_significant(open)?;
    let range = span(name.text_range().end(), body.text_range().end())?;
    fits.then(|| (format!("Write `{written}`"), vec![(range, written)]))
}

/// Names a transition after its target.
fn transition_name(token: &SyntaxToken) -> Option<Rewrite> {
    let transition = token.parent_ancestors().find_map(Transition::cast)?;
    let target = transition.name_ref()?.syntax().text().to_string();
    let state = transition.syntax().parent()?;
    let others: Vec<String> = state
        .children()
        .filter_map(Transition::cast)
        .take(MAX_NEIGHBOURS)
        .filter_map(|it| Some(it.name()?.syntax().text().to_string()))
        .collect();
    let names = (1..=others.len() + 1).map(|number| match number {
        1 => format!("to_{target}"),
        _ => format!("to_{target}_{number}"),
    });
    let name = names.into_iter().find(|name| !others.contains(name))?;
    let (range, text) = match token.text() {
        "if" | "to" => (TextRange::empty(token.text_range().start()), format!("{name} ")),
        "->" => (token.text_range(), format!("{name} to")),
        _ => (token.text_range(), format!("{name} if")),
    };
    Some((format!("Name it `{name}`"), vec![(range, text)]))
}

/// Moves a guard before the `to` of its transition.
fn guard_first(token: &SyntaxToken) -> Option<Rewrite> {
    let transition = token.parent_ancestors().find_map(Transition::cast)?;
    let guard = transition.guard()?.syntax().clone();
    let target = transition.name_ref()?.syntax().text_range().end();
    let to = significant_tokens(transition.syntax()).find(|it| it.kind() == SyntaxKind::TO_KW)?;
    let moved = format!("{} ", guard.text());
    let edits = vec![
        (TextRange::empty(to.text_range().start()), moved),
        (span(target, guard.text_range().end())?, String::new()),
    ];
    Some(("Move the guard before `to`".to_owned(), edits))
}

/// `int act(int n);` → `codel act(in n: int): int`
fn prototype(token: &SyntaxToken) -> Option<Rewrite> {
    let error = token.parent().filter(|it| it.kind() == SyntaxKind::ERROR && !in_core(token))?;
    let all: Vec<SyntaxToken> = error
        .descendants_with_tokens()
        .filter_map(NodeOrToken::into_token)
        .filter(|it| !it.kind().is_trivia())
        .collect();
    let all = match all.split_last()? {
        (last, rest) if last.kind() == SyntaxKind::SEMICOLON => rest,
        _ => all.as_slice(),
    };
    let [result, name, _, parameters @ .., close] = all else { return None };
    if close.kind() != SyntaxKind::R_PAREN {
        return None;
    }
    let is_comma = |token: &SyntaxToken| token.kind() == SyntaxKind::COMMA;
    let parameter = |tokens: &[SyntaxToken]| match tokens {
        [ty, name] if ty.kind().is_word() && name.kind().is_word() => {
            Some(format!("in {}: {}", name.text(), mauve_type(ty.text())))
        }
        _ => None,
    };
    let parameters: Option<Vec<String>> = match parameters {
        [] => Some(Vec::new()),
        _ => parameters.split(is_comma).map(parameter).collect(),
    };
    let result = match result.text() {
        "function" | "func" | "def" | "fn" => return None,
        result => mauve_type(result),
    };
    let written = format!("codel {}({}): {result}", name.text(), parameters?.join(", "));
    Some((format!("Write `{written}`"), vec![(error.text_range(), written)]))
}
