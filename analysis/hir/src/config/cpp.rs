//! The syntax of C++ types in `[types.NAME] cpp` of `mauve.toml`. Generated code contains the text unchanged, so that it must
//! be exactly one type:
//!
//! ```text
//! type      = ["const"] (word+ | ["::"] segment ("::" segment)*) "*"*
//! segment   = name ["<" [argument ("," argument)*] ">"]
//! argument  = type | number
//! ```

/// The keywords of the built-in C++ types.
const WORDS: [&str; 13] = [
    "bool", "char", "char16_t", "char32_t", "double", "float", "int", "long", "short", "signed", "unsigned",
    "void", "wchar_t",
];

/// The maximum nesting of template arguments: the parser is recursive.
const MAX_DEPTH: usize = 16;

/// Returns whether the text is exactly one C++ type.
pub(super) fn is_cpp_type(text: &str) -> bool {
    let Some(tokens) = tokens(text).filter(|_| text.trim() == text) else { return false };
    let mut parser = CppTypeParser { rest: &tokens };
    parser.ty(0) && parser.rest.is_empty()
}

/// Splits the text into names, numbers and symbols; `None` if it contains other characters.
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

/// A recursive descent parser: each function consumes the construct that it is named after, or returns `false`.
struct CppTypeParser<'t> {
    rest: &'t [&'t str],
}

impl CppTypeParser<'_> {
    fn token(&mut self, fits: impl Fn(&str) -> bool) -> bool {
        match self.rest.split_first() {
            Some((first, rest)) if fits(first) => {
                self.rest = rest;
                true
            }
            _ => false,
        }
    }

    fn symbol(&mut self, symbol: &str) -> bool {
        self.token(|token| token == symbol)
    }

    fn ty(&mut self, depth: usize) -> bool {
        self.symbol("const");
        let count = self.rest.iter().take_while(|token| WORDS.contains(*token)).count();
        let (words, rest) = self.rest.split_at(count);
        let is_type = match count {
            0 => self.qualified_name(depth),
            _ => {
                self.rest = rest;
                is_built_in(words)
            }
        };
        while self.symbol("*") {}
        is_type
    }

    /// `std::map<int, ns::T*>::iterator`
    fn qualified_name(&mut self, depth: usize) -> bool {
        self.symbol("::");
        loop {
            let is_name = |token: &str| {
                let begins = token.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
                begins && token != "const" && !WORDS.contains(&token)
            };
            if !self.token(is_name) || self.symbol("<") && !self.arguments(depth + 1) {
                return false;
            }
            if !self.symbol("::") {
                return true;
            }
        }
    }

    /// Parses template arguments after a `<`, with the closing `>`.
    fn arguments(&mut self, depth: usize) -> bool {
        if depth > MAX_DEPTH {
            return false;
        }
        if self.symbol(">") {
            return true;
        }
        loop {
            let is_number = self.token(|token| token.bytes().all(|byte| byte.is_ascii_digit()));
            if !is_number && !self.ty(depth) {
                return false;
            }
            if self.symbol(">") {
                return true;
            }
            if !self.symbol(",") {
                return false;
            }
        }
    }
}

/// Returns whether the words are a built-in type, in the usual order.
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
    fn names_of_cpp_types_are_accepted() {
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
    fn refuses_other_texts() {
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
    fn limits_the_nesting() {
        let nested = |depth: usize| format!("{}X{}", "X<".repeat(depth), ">".repeat(depth));
        assert!(is_cpp_type(&nested(MAX_DEPTH)));
        assert!(!is_cpp_type(&nested(MAX_DEPTH + 1)) && !is_cpp_type(&nested(100_000)));
    }
}
