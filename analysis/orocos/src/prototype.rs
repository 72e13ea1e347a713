//! Checks whether a file of the user defines the prototype of a codel, by comparing tokens, without a compiler.
//!
//! White space, comments and the names of parameters do not count, nor does what C++ reads as the same function: where a
//! `const` stands, a namespace before the name, a leading `::`, `inline`, attributes. A definition that is hidden behind a
//! macro or another name of a type is not found: then the user is asked once more than needed, and nothing is lost.

/// A normalised prototype.
pub(crate) struct Prototype<'a> {
    result: Vec<&'a str>,
    name: &'a str,
    parameters: Vec<Vec<&'a str>>,
    /// The names of the parameters.
    names: Vec<&'a str>,
}

impl<'a> Prototype<'a> {
    /// Reads a prototype: `double clearance(const ::sensor_msgs::LaserScan& scan, double width)`.
    pub(crate) fn read(text: &'a str) -> Option<Prototype<'a>> {
        let tokens = tokens(text);
        let open = tokens.iter().position(|token| *token == "(")?;
        let end = ends_of_parentheses(&tokens).get(open).copied().flatten()?;
        let (&name, result) = tokens.get(..open)?.split_last()?;
        let found = parameters(tokens.get(open + 1..end)?);
        let names = found.iter().filter_map(|it| it.last().copied()).collect();
        let types = found.into_iter().map(|parameter| match parameter {
            [ty @ .., name] if ty.last().is_some_and(|it| *it != "::") && may_be_a_name(name) => ty,
            unnamed => unnamed,
        });
        let parameters = types.map(normalised).collect();
        is_word(name).then(|| Prototype { result: normalised(result), name, parameters, names })
    }

    /// Returns whether two prototypes declare the same function.
    pub(crate) fn is_same(before: &str, now: &str) -> bool {
        let is_same = |(a, b): (Prototype<'_>, Prototype<'_>)| {
            (a.result, a.name, a.parameters) == (b.result, b.name, b.parameters)
        };
        before == now || Prototype::read(before).zip(Prototype::read(now)).is_some_and(is_same)
    }

    /// Returns whether the parameters of two prototypes have the same names in a different order.
    pub(crate) fn has_moved(before: &str, now: &str) -> bool {
        let names = Prototype::read(before).zip(Prototype::read(now));
        names.is_some_and(|(before, now)| is_in_another_order(&before.names, &now.names))
    }

    /// Returns whether a C++ text defines this function.
    pub(crate) fn is_defined_in(&self, text: &str) -> bool {
        let tokens = tokens(text);
        self.definitions(&tokens).any(|(before, found)| self.has(&found) && self.is_result_of(before))
    }

    fn has(&self, found: &[&[&str]]) -> bool {
        found.len() == self.parameters.len()
            && self.parameters.iter().zip(found).all(|(expected, found)| is_parameter(expected, found))
    }

    /// Returns the definitions of functions with this name: the tokens before the name, and the parameters.
    /// Definitions do not overlap.
    fn definitions<'t>(
        &self,
        tokens: &'t [&'a str],
    ) -> impl Iterator<Item = (&'t [&'a str], Vec<&'t [&'a str]>)> {
        let ends = ends_of_parentheses(tokens);
        let mut behind = 0;
        let calls = tokens.windows(2).enumerate().filter(|(_, pair)| *pair == [self.name, "("]);
        let places: Vec<usize> = calls.map(|(at, _)| at).collect();
        places.into_iter().filter_map(move |at| {
            let end = ends.get(at + 1).copied().flatten().filter(|_| at >= behind)?;
            behind = end;
            let is_defined = matches!(tokens.get(end + 1), Some(&("{" | "noexcept" | "try")));
            let inner = tokens.get(at + 2..end).filter(|inner| is_defined && inner.len() <= MOST_TOKENS)?;
            Some((tokens.get(..at)?, parameters(inner)))
        })
    }

    /// Returns the prototype of a function with this name in a text that certainly differs: its parameters have other
    /// built-in types, or their names have a different order.
    ///
    /// ```text
    /// double clearance(double range, double width)          the model
    /// double clearance(const double& range, double width)   another: it would not link
    /// double clearance(double width, double range)          another: it would link, and do something else
    /// ```
    pub(crate) fn other_in(&self, text: &str) -> Option<String> {
        let tokens = tokens(text);
        let definitions: Vec<Vec<&[&str]>> = self.definitions(&tokens).map(|(_, found)| found).collect();
        let other = match definitions.iter().find(|found| self.has(found)) {
            Some(found) => {
                let named: Vec<&str> = found.iter().filter_map(|it| it.last().copied()).collect();
                is_in_another_order(&self.names, &named).then_some(found)
            }
            // A name may refer to any type.
            None => definitions.iter().find(|found| {
                let types = found.iter().map(|it| match it.split_last() {
                    Some((name, ty)) if may_be_a_name(name) && !STANDARD_TYPES.contains(name) => ty,
                    _ => it,
                });
                let own = self.parameters.iter().map(Vec::as_slice);
                own.chain(types).flatten().all(|it| !may_be_a_name(it) || STANDARD_TYPES.contains(it))
            }),
        };
        other.map(|found| {
            let words: Vec<String> = found.iter().map(|parameter| parameter.join(" ")).collect();
            let shown = format!("{} {}({})", self.result.join(" "), self.name, words.join(", "));
            shown.replace(" :: ", "::").replace(" &", "&").replace(" *", "*")
        })
    }

    /// Returns whether the tokens before a function's name end with this result type, optionally followed by
    /// namespaces.
    fn is_result_of(&self, before: &[&str]) -> bool {
        let before = before.get(before.len().saturating_sub(MOST_WORDS)..).unwrap_or_default();
        let ends_a_declaration = |token: &&str| matches!(*token, ";" | "{" | "}" | ")" | ":");
        let start = before.iter().rposition(ends_a_declaration).map_or(0, |at| at + 1);
        let specifies = |token: &&str| *token == "inline" || *token == "extern" || token.starts_with('"');
        let mut rest: Vec<&str> =
            before.iter().skip(start).copied().filter(|token| !specifies(token)).collect();
        let mut is_qualifier = false;
        loop {
            if normalised(&rest) == self.result {
                return true;
            }
            match rest.pop() {
                Some("::") => is_qualifier = true,
                Some(word) if is_qualifier && is_word(word) => is_qualifier = false,
                _ => return false,
            }
        }
    }
}

/// The maximum numbers of tokens in the parameters, and before the name; longer functions are not found.
const MOST_TOKENS: usize = 4096;
const MOST_WORDS: usize = 64;

/// Types of the standard library that correspond to types of models.
const STANDARD_TYPES: [&str; 11] = [
    "std", "string", "size_t", "int8_t", "int16_t", "int32_t", "int64_t", "uint8_t", "uint16_t", "uint32_t",
    "uint64_t",
];

fn is_in_another_order(some: &[&str], others: &[&str]) -> bool {
    let sorted = |names: &[&str]| {
        let mut names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        names.sort_unstable();
        names
    };
    some != others && sorted(some) == sorted(others)
}

/// Returns whether a parameter, with or without a name, has this type.
fn is_parameter(expected: &[&str], found: &[&str]) -> bool {
    let unnamed = found.split_last().filter(|(name, _)| may_be_a_name(name)).map(|(_, ty)| ty);
    normalised(found) == expected || unnamed.is_some_and(|ty| normalised(ty) == expected)
}

fn may_be_a_name(token: &str) -> bool {
    const TYPES: [&str; 11] =
        ["bool", "char", "const", "double", "float", "int", "long", "short", "signed", "unsigned", "void"];
    is_word(token) && !TYPES.contains(&token)
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Returns the index of the closing parenthesis for each opening one, if it is closed.
fn ends_of_parentheses(tokens: &[&str]) -> Vec<Option<usize>> {
    let (mut ends, mut open) = (vec![None; tokens.len()], Vec::new());
    for (at, token) in tokens.iter().enumerate() {
        match *token {
            "(" => open.push(at),
            ")" => {
                if let Some(end) = open.pop().and_then(|begin| ends.get_mut(begin)) {
                    *end = Some(at);
                }
            }
            _ => {}
        }
    }
    ends
}

/// Splits parameters at the commas.
fn parameters<'t, 'a>(tokens: &'t [&'a str]) -> Vec<&'t [&'a str]> {
    if let [] | ["void"] = tokens {
        return Vec::new();
    }
    let mut depth = 0;
    let separates = |token: &&str| {
        match *token {
            "(" | "[" | "{" | "<" => depth += 1,
            ")" | "]" | "}" | ">" => depth -= 1,
            _ => {}
        }
        *token == "," && depth == 0
    };
    tokens.split(separates).collect()
}

/// Returns a normalised type.
fn normalised<'a>(tokens: &[&'a str]) -> Vec<&'a str> {
    let mut out: Vec<&'a str> = Vec::new();
    let mut rest = tokens;
    // If one attribute is not closed, none after it is.
    let mut may_end = true;
    while let [token, after @ ..] = rest {
        rest = after;
        if let ["[", ..] = after
            && *token == "["
            && may_end
        {
            match after.windows(2).position(|pair| pair == ["]", "]"]) {
                Some(end) => {
                    rest = after.get(end + 2..).unwrap_or_default();
                    continue;
                }
                None => may_end = false,
            }
        }
        // A leading `::` does not matter here: the compiler resolves the name.
        let qualifies = out.last().is_some_and(|last| *last == ">" || (is_word(last) && *last != "const"));
        if *token != "::" || qualifies {
            out.push(token);
        }
    }
    let mut depth = 0;
    let mut is_indirect = false;
    let mut is_const = false;
    let mut unqualified: Vec<&'a str> = Vec::new();
    for token in out {
        match token {
            "<" => depth += 1,
            ">" => depth -= 1,
            "&" | "*" if depth == 0 => is_indirect = true,
            "const" if depth == 0 && !is_indirect => {
                is_const = true;
                continue;
            }
            _ => {}
        }
        unqualified.push(token);
    }
    // `const` on a value parameter does not change the function type.
    if is_const && is_indirect {
        unqualified.insert(0, "const");
    }
    unqualified
}

/// Returns the C++ tokens of a text, without comments and preprocessor lines.
fn tokens(text: &str) -> Vec<&str> {
    let mut out = Vec::new();
    let mut rest = text;
    let mut begins_line = true;
    while let Some(first) = rest.chars().next() {
        let (length, is_token) = match first {
            c if c.is_whitespace() || c == '\\' => (c.len_utf8(), false),
            '#' if begins_line => (directive(rest), false),
            '/' if rest.starts_with("//") => (rest.find('\n').unwrap_or(rest.len()), false),
            '/' if rest.starts_with("/*") => {
                let end = rest.get(2..).and_then(|it| it.find("*/"));
                (end.map_or(rest.len(), |end| end + 4), false)
            }
            '"' | '\'' => (quoted(rest, first), true),
            c if c.is_ascii_digit() => (number(rest), true),
            c if c.is_alphabetic() || c == '_' => {
                let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
                (raw_string(rest, word).unwrap_or(word), true)
            }
            ':' if rest.starts_with("::") => (2, true),
            c => (c.len_utf8(), true),
        };
        let (token, after) = rest.split_at_checked(length).unwrap_or((rest, ""));
        if is_token {
            out.push(token);
        }
        begins_line = !is_token && (begins_line || first == '\n');
        rest = after;
    }
    out
}

/// Returns the length of a preprocessor line with its continuation lines.
fn directive(text: &str) -> usize {
    let mut length = 0;
    for line in text.split_inclusive('\n') {
        length += line.len();
        if !line.trim_end_matches(['\r', '\n']).ends_with('\\') {
            break;
        }
    }
    length
}

/// Returns the length of a quoted literal, which ends with its line at the latest.
fn quoted(text: &str, quote: char) -> usize {
    let mut is_escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '\n' => return at,
            _ if is_escaped => is_escaped = false,
            '\\' => is_escaped = true,
            c if c == quote => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// Returns the length of a number: `1'000.5e3`.
fn number(text: &str) -> usize {
    let mut all = text.char_indices().peekable();
    while let Some((at, c)) = all.next() {
        let goes_on = c.is_ascii_alphanumeric()
            || matches!(c, '.' | '_')
            || (c == '\'' && all.peek().is_some_and(|(_, next)| next.is_ascii_alphanumeric()));
        if !goes_on {
            return at;
        }
    }
    text.len()
}

/// Returns the length of a raw string, after a prefix of this length: `R"x(…)x"`.
fn raw_string(text: &str, word: usize) -> Option<usize> {
    let (prefix, literal) = text.split_at_checked(word)?;
    if !matches!(prefix, "R" | "LR" | "uR" | "UR" | "u8R") {
        return None;
    }
    // A delimiter has at most 16 letters; an unclosed string extends to the end of the text.
    let inner = literal.strip_prefix('"')?;
    let (at, _) = inner.char_indices().take(17).find(|(_, letter)| *letter == '(')?;
    let end = format!("){}\"", inner.get(..at)?);
    Some(literal.find(&end).map_or(text.len(), |at| word + at + end.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLEARANCE: &str = "double clearance(const ::sensor_msgs::LaserScan& scan, double width)";

    fn is_defined(prototype: &str, text: &str) -> bool {
        Prototype::read(prototype).unwrap().is_defined_in(text)
    }

    #[test]
    fn the_same_function_in_other_words() {
        for text in [
            "double clearance(const ::sensor_msgs::LaserScan& scan, double width) { return 0; }",
            "double\nclearance( const sensor_msgs::LaserScan &echoes , double /* m */ )\n{ }",
            "namespace motion {\nstatic int n; double clearance(sensor_msgs::LaserScan const& s, const double w) {",
            "#include <x>\ndouble motion::clearance(const ::sensor_msgs::LaserScan&, double) noexcept {",
            "double ::motion::clearance(const ::sensor_msgs::LaserScan&, double) {",
            "[[nodiscard]] inline double clearance(const ::sensor_msgs::LaserScan& s, [[maybe_unused]] double w) try {",
            "extern \"C\" double clearance(const ::sensor_msgs::LaserScan& s, double w) {",
            "public: double clearance(const ::sensor_msgs::LaserScan& s, double w) {",
            "double clearance(int);\ndouble clearance(const ::sensor_msgs::LaserScan& s, double w) {\r\n",
            "#define A \\\n  \"\n/* ' */ char c = '\"'; // \"\nauto r = R\"x(\" // )\" )x\"; auto n = 1'0;\n\
             double clearance(const ::sensor_msgs::LaserScan& s, double w) {",
        ] {
            assert!(is_defined(CLEARANCE, text), "{text}");
        }
        assert!(is_defined("void f()", "void f(void) {"));
        assert!(is_defined("void f(::A<::B, C>& x)", "void f(A<B,C>& y){"));
        assert!(is_defined("::ArRobot* f(unsigned long n)", "ArRobot* lib::f(unsigned long) {"));
        assert!(is_defined("::A<::B> f()", "A<B> lib::f() {"));
    }

    #[test]
    fn what_is_another_function_for_certain() {
        let other = |prototype: &str, text: &str| Prototype::read(prototype).unwrap().other_in(text);
        let gap = "double gap(double range, double width)";
        for (text, shown) in [
            (
                "double gap(const double& range, double width) {",
                "double gap(const double& range, double width)",
            ),
            ("double gap(double width, double range) {", "double gap(double width, double range)"),
            ("double gap(double) {", "double gap(double)"),
            ("double gap(std::string range, double w) {", "double gap(std::string range, double w)"),
        ] {
            assert_eq!(other(gap, text).as_deref(), Some(shown));
        }
        // Names of one's own, types that may be others of the same, another definition beside it, none at all.
        for text in [
            "double gap(double r, double w) {",
            "double gap(Metres range, double width) {",
            "double gap(int n) { }\ndouble gap(double range, double width) {",
            "GAP { }",
        ] {
            assert_eq!(other(gap, text), None);
        }
        assert!(Prototype::has_moved(gap, "double gap(double width, double range)"));
        assert!(!Prototype::has_moved(gap, "double gap(double range, double height)"));
    }

    #[test]
    fn texts_without_the_codel_have_no_prototype() {
        for text in [
            "",
            "double clearance(const ::sensor_msgs::LaserScan& scan, double width);",
            "// double clearance(const ::sensor_msgs::LaserScan& scan, double width) {",
            "/* double clearance(const ::sensor_msgs::LaserScan& scan, double width) { */",
            "auto s = \"double clearance(const ::sensor_msgs::LaserScan& scan, double width) {\";",
            "#define F double clearance(const ::sensor_msgs::LaserScan& scan, double width) {",
            "float clearance(const ::sensor_msgs::LaserScan& scan, double width) {",
            "long double clearance(const ::sensor_msgs::LaserScan& scan, double width) {",
            "double clearance2(const ::sensor_msgs::LaserScan& scan, double width) {",
            "double clearance(const ::sensor_msgs::LaserScan& scan) {",
            "double clearance(const ::sensor_msgs::LaserScan& scan, double width, int) {",
            "double clearance(const ::sensor_msgs::LaserScan& scan, float width) {",
            "double clearance(const ::sensor_msgs::LaserScan& scan, double& width) {",
            "double clearance(::sensor_msgs::LaserScan& scan, double width) {",
            "double clearance(const ::sensor_msgs::PointCloud& scan, double width) {",
            "double clearance(double width, const ::sensor_msgs::LaserScan& scan) {",
            "int x = clearance(const ::sensor_msgs::LaserScan& scan, double width) {",
            "double clearance(const ::sensor_msgs::LaserScan& scan, double",
        ] {
            assert!(!is_defined(CLEARANCE, text), "{text}");
        }
        assert!(!is_defined("void f(long n)", "void f(long long) {"));
        assert!(!is_defined("void f(::A<::B>& x)", "void f(A<C>& x) {"));
        assert!(!is_defined("void f(const ::A* x)", "void f(A* const x) {"));
        assert!(!is_defined("void f()", "unsigned f() {"));
    }

    #[test]
    fn names_of_parameters_do_not_count() {
        assert!(Prototype::is_same("void f(int a, ::B& b)", "void f(int  x, ::B &y)"));
        assert!(!Prototype::is_same("void f(int a)", "void f(double a)"));
        assert!(!Prototype::is_same("void f(int a)", "int f(int a)"));
        assert!(!Prototype::is_same("void f(int a)", "void g(int a)"));
        // What is no prototype is itself.
        assert!(Prototype::is_same("?", "?"));
        assert!(!Prototype::is_same("?", "!"));
    }

    proptest::proptest! {
        #[test]
        fn any_text_has_tokens(text in r#"([a-z:(){}<>"'/*\\#\n 1é]|//|/\*|R"x\()*"#) {
            let tokens = tokens(&text);
            proptest::prop_assert!(tokens.iter().all(|token| !token.is_empty()));
            let _ = Prototype::read(&text);
            is_defined("a b(c d)", &text);
        }
    }
}
