//! Types of C++, as `[types.NAME] cpp` in `mauve.toml` names them. They go into generated code as they are, so that a text is
//! one type and nothing else:
//!
//! ```text
//! type      = ["const"] (word+ | ["::"] part ("::" part)*) "*"*
//! part      = name ["<" [argument ("," argument)*] ">"]
//! argument  = type | number
//! ```

/// The words of the types that C++ has by itself.
const WORDS: [&str; 13] = [
    "bool", "char", "char16_t", "char32_t", "double", "float", "int", "long", "short", "signed", "unsigned",
    "void", "wchar_t",
];

/// So deep are types in types at most: reading them is recursive.
const DEEPEST: usize = 16;

/// Is it a type of C++, and nothing else?
pub(super) fn is_cpp_type(text: &str) -> bool {
    let Some(tokens) = tokens(text).filter(|_| text.trim() == text) else { return false };
    let mut reader = Reader { rest: &tokens };
    reader.is_type(0) && reader.rest.is_empty()
}

/// Names, numbers and signs; nothing where there is anything else.
fn tokens(text: &str) -> Option<Vec<&str>> {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            ' ' | '<' | '>' | ',' | '*' => 1,
            ':' if rest.starts_with("::") => 2,
            _ if is_letter(first) => rest.find(|c: char| !is_letter(c)).unwrap_or(rest.len()),
            _ => return None,
        };
        let (token, after) = rest.split_at(length);
        found.extend(Some(token).filter(|token| *token != " "));
        rest = after;
    }
    Some(found)
}

/// Reads what it finds; each function says whether it has found what it is called after.
struct Reader<'t> {
    rest: &'t [&'t str],
}

impl Reader<'_> {
    fn is(&mut self, fits: impl Fn(&str) -> bool) -> bool {
        match self.rest.split_first() {
            Some((first, rest)) if fits(first) => {
                self.rest = rest;
                true
            }
            _ => false,
        }
    }

    fn is_sign(&mut self, sign: &str) -> bool {
        self.is(|token| token == sign)
    }

    fn is_type(&mut self, depth: usize) -> bool {
        self.is_sign("const");
        let count = self.rest.iter().take_while(|token| WORDS.contains(*token)).count();
        let (words, rest) = self.rest.split_at(count);
        let is_type = match count {
            0 => self.is_qualified(depth),
            _ => {
                self.rest = rest;
                is_built_in(words)
            }
        };
        while self.is_sign("*") {}
        is_type
    }

    /// `std::map<int, ns::T*>::iterator`
    fn is_qualified(&mut self, depth: usize) -> bool {
        self.is_sign("::");
        loop {
            let is_name = |token: &str| {
                let begins = token.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
                begins && token != "const" && !WORDS.contains(&token)
            };
            if !self.is(is_name) || self.is_sign("<") && !self.are_arguments(depth + 1) {
                return false;
            }
            if !self.is_sign("::") {
                return true;
            }
        }
    }

    /// What stands behind a `<`, with the `>` at its end.
    fn are_arguments(&mut self, depth: usize) -> bool {
        if depth > DEEPEST {
            return false;
        }
        if self.is_sign(">") {
            return true;
        }
        loop {
            let is_argument = self.is(|token| token.bytes().all(|byte| byte.is_ascii_digit()));
            if !is_argument && !self.is_type(depth) {
                return false;
            }
            if self.is_sign(">") {
                return true;
            }
            if !self.is_sign(",") {
                return false;
            }
        }
    }
}

/// Do these words make a type, in the order in which everybody writes them?
fn is_built_in(words: &[&str]) -> bool {
    let is_number = |words: &[&str]| {
        matches!(
            words,
            ["char" | "short" | "int" | "long"]
                | ["short" | "long", "int"]
                | ["long", "long"]
                | ["long", "long", "int"]
        )
    };
    match words {
        ["signed" | "unsigned"] => true,
        ["signed" | "unsigned", rest @ ..] => is_number(rest),
        ["bool" | "float" | "double" | "void" | "wchar_t" | "char16_t" | "char32_t"] => true,
        ["long", "double"] => true,
        _ => is_number(words),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_types() {
        for text in [
            "X",
            "ArRobot*",
            "_x",
            "::a::B",
            "std::string",
            "const char*",
            "X * *",
            "std::map<int, const ns::T *>",
            "std::array<unsigned long long, 3>",
            "a::B<c::D<E*>>::F<>::G",
            "std::vector<std::vector<double> >",
            "unsigned",
            "unsigned char",
            "long long int",
            "long double",
            "void*",
        ] {
            assert!(is_cpp_type(text), "{text}");
        }
    }

    #[test]
    fn nothing_else_is_one() {
        for text in [
            "",
            " ",
            " X",
            "X ",
            "*",
            "const",
            "3",
            "3x",
            "int x, y",
            "a:b",
            "int int",
            ":::a",
            ":: ::a",
            "a::",
            "a::*b",
            "a::int",
            "X Y",
            "unsigned X",
            "unsigned bool",
            "long float",
            "long long long",
            "const const X",
            "X const",
            "X&",
            "X, Y",
            "a<b",
            "a>b<",
            "a<b,>",
            "a<,b>",
            "a<b c>",
            "a<-1>",
            "a<b>c",
            "a<b> <c>",
            "f()",
            "X;",
            "X\n",
            "X\tY",
            "X/**/",
            "\u{e9}",
        ] {
            assert!(!is_cpp_type(text), "{text:?}");
        }
    }

    #[test]
    fn types_are_not_too_deep() {
        let nested = |depth: usize| format!("{}X{}", "X<".repeat(depth), ">".repeat(depth));
        assert!(is_cpp_type(&nested(DEEPEST)));
        assert!(!is_cpp_type(&nested(DEEPEST + 1)) && !is_cpp_type(&nested(100_000)));
    }
}
