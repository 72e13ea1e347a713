//! Forms of other languages, above all of C++. The parser recognises them where the grammar does not allow them, and
//! reports each as one error that shows the form in MAUVE.
//!
//! A word with a meaning here is a name wherever the grammar allows a name, except for `elif` behind the block of an `if`.
//! The parser reads no other words, only kinds of tokens: `reads_alike` in `parser.rs` tells whether a reparse may exchange
//! two words.

use crate::SyntaxKind::{self, *};

/// A form of another language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foreign {
    /// MAUVE has another spelling for the next tokens: `and`, `->` in a transition.
    Spelling {
        /// The number of tokens.
        tokens: u8,
        /// The spelling in MAUVE.
        written: &'static str,
    },
    /// Tokens that have no function here: `()` after the name of a shell.
    Superfluous {
        /// The number of tokens.
        tokens: u8,
    },
    /// An item without the keyword that begins it: `a.b -> c.d`.
    Keyword(&'static str),
    /// `for`, `while`, `break` and similar.
    Loop,
    /// `switch`
    Switch,
    /// A function with another keyword, or with its result type first.
    Function,
    /// `n += 1`
    CompoundAssignment,
    /// `n++`
    Increment,
    /// `codel int act()`
    ResultFirst,
    /// `int n` instead of `n: int`.
    TypeFirst,
    /// `33 ms`
    Unit,
    /// The first comma between the items of a list.
    Comma,
    /// `transition go to There if (x)`
    GuardLast,
    /// A branch of an `if` without braces.
    Braces,
    /// An array, a pointer or a type with arguments.
    TypeSuffix,
    /// `const Pose& goal` as a parameter of a codel.
    Reference,
}

/// The meaning of a word in other languages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ForeignWord {
    /// MAUVE has this token instead.
    InsteadOf(SyntaxKind),
    /// It begins a statement of this form.
    Section(Foreign),
    Unit,
}

/// Returns the meaning of `word` in other languages.
pub(crate) fn meaning(word: &str) -> Option<ForeignWord> {
    let token = match word {
        "and" => AMP2,
        "or" => PIPE2,
        "not" => BANG,
        "elif" | "elsif" | "elseif" => ELSE_KW,
        "when" => IF_KW,
        "goto" => TO_KW,
        "connect" | "link" => CONNECTION_KW,
        "namespace" | "package" => LIBRARY_KW,
        "using" => USE_KW,
        "param" | "parameter" => PROPERTY_KW,
        "const" => CONSTANT_KW,
        "configureHook" => CONFIGURE_KW,
        "startHook" => START_KW,
        "updateHook" => UPDATE_KW,
        "stopHook" => STOP_KW,
        "cleanupHook" => CLEANUP_KW,
        "for" | "while" | "do" | "break" | "continue" => return Some(ForeignWord::Section(Foreign::Loop)),
        "switch" => return Some(ForeignWord::Section(Foreign::Switch)),
        "ns" | "us" | "ms" | "s" | "Hz" | "kHz" | "mm" | "cm" | "m" | "rad" | "deg" => {
            return Some(ForeignWord::Unit);
        }
        _ => return None,
    };
    Some(ForeignWord::InsteadOf(token))
}

/// Types that are written in lower case.
const SCALARS: &[&str] = &[
    "bool", "boolean", "byte", "char", "double", "float", "int", "integer", "long", "real", "short",
    "size_t", "str", "string", "uint", "unsigned", "void",
];

/// Returns whether `word` looks like a type and not like the name of a variable: `int`, `uint8_t`, `Pose`.
pub(crate) fn looks_like_type(word: &str) -> bool {
    let scalar =
        word.strip_suffix("_t").unwrap_or(word).trim_end_matches(|letter: char| letter.is_ascii_digit());
    SCALARS.contains(&word)
        || SCALARS.contains(&scalar)
        || word.starts_with(|letter: char| letter.is_ascii_uppercase())
}
