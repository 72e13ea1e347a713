//! Forms of other languages. The parser recognises them where the grammar does not allow them, and reports each as one
//! error that shows the form in MAUVE.
//!
//! A word of these tables, or of a rule in `grammar/foreign.rs`, is a name wherever the grammar allows a name. The parser
//! reads no other words, only kinds of tokens.

use crate::SyntaxKind::{self, *};

/// A form of another language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foreign {
    /// MAUVE has another spelling for the next tokens: `and`, `<>`, `->` in a transition.
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
    /// `switch` and similar.
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
    /// `let n = 3;`
    Untyped,
    /// `a ? b : c`
    Ternary,
    /// `33 ms`
    Unit,
    /// `1.` or `.5`
    Fraction,
    /// The first comma between the items of a list.
    Comma,
    /// A transition without a name.
    UnnamedTransition,
    /// `transition go to There if (x)`
    GuardLast,
    /// `state initial There`
    InitialLast,
    /// `component X { … }`
    ComponentBody,
    /// `core C: S` or `core C extends S`.
    CoreHeader,
    /// `activity pilot: priority = 1, period = 100`
    ActivityBody,
    /// A branch of an `if` without braces.
    Braces,
    /// An array, a pointer or a type with arguments.
    TypeSuffix,
    /// `connection a.b -> c.d, e.f`
    SecondReader,
    /// `const Pose& goal` as a parameter of a codel.
    Reference,
    /// A parameter that is a type only: `reset(bool)`.
    NamelessParameter,
    /// `codel bool read(Imu& imu)`: the whole signature has the form of C++.
    Signature,
    /// `(int) n`
    Cast,
    /// `affinity = [2]` or `affinity = {1, 2}`
    CpuList,
    /// `operation plan()` in a shell.
    ShellOperation,
    /// `transition go [ready] -> There`
    TransitionForm,
    /// `property rate: int in [1, 400]`
    Interval,
    /// `instance laser: Laser(rate = 2)`
    InstanceValues,
    /// `use a, b`
    Packages,
    /// `use robot.mal`
    UsedFile,
    /// `from a import b`
    ImportFrom,
    /// `const int n = 3;` in a program.
    ConstantVariable,
}

/// The role of several words in other languages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Word {
    /// A binary operator.
    Operator(SyntaxKind),
    ElseIf,
    /// It begins a guard.
    Guard,
    /// It comes before the target of a transition.
    Target,
    Loop,
    /// It leaves a loop, or does nothing.
    Jump,
    Switch,
    /// It begins a variable that has no type.
    Untyped,
    /// It opens or closes a block, or is all of one.
    Brace,
    Unit,
    /// It comes before the shell of a core.
    ForShell,
    /// A keyword that begins an item of an architecture or a shell.
    Keyword(SyntaxKind),
}

/// The roles with their words. A word may have several: `const` has two.
const WORDS: &[(Word, &[&str])] = &[
    (Word::Operator(AMP2), &["and"]),
    (Word::Operator(PIPE2), &["or"]),
    (Word::Operator(EQ2), &["is"]),
    (Word::Operator(PERCENT), &["mod"]),
    (Word::ElseIf, &["elif", "elsif", "elseif"]),
    (Word::Guard, &["when", "on"]),
    (Word::Target, &["goto", "go"]),
    (Word::Loop, &["for", "foreach", "while", "do", "loop", "repeat"]),
    (Word::Jump, &["break", "continue"]),
    (Word::Brace, &["pass", "begin", "end", "endif", "fi"]),
    (Word::Switch, &["switch", "match", "case", "default"]),
    (Word::Untyped, &["let", "auto", "const"]),
    (Word::Unit, &["ns", "us", "ms", "s", "sec", "min", "Hz", "kHz", "mm", "cm", "m", "rad", "deg"]),
    (Word::ForShell, &["of", "implements"]),
    (Word::Keyword(CONNECTION_KW), &["connect", "link"]),
    (Word::Keyword(LIBRARY_KW), &["namespace", "package", "module"]),
    (Word::Keyword(PROPERTY_KW), &["param", "parameter"]),
    (Word::Keyword(CONSTANT_KW), &["const"]),
    (Word::Keyword(CONFIGURE_KW), &["configureHook"]),
    (Word::Keyword(START_KW), &["startHook"]),
    (Word::Keyword(UPDATE_KW), &["updateHook"]),
    (Word::Keyword(STOP_KW), &["stopHook"]),
    (Word::Keyword(CLEANUP_KW), &["cleanupHook"]),
];

/// Types that are written in lower case.
const SCALARS: &[&str] = &[
    "bool", "boolean", "byte", "char", "double", "float", "int", "integer", "long", "real", "short",
    "size_t", "str", "string", "uint", "unsigned", "void",
];

/// Returns the roles of `word` in other languages.
pub(crate) fn meanings(word: &str) -> impl Iterator<Item = Word> {
    WORDS.iter().filter(move |(_, words)| words.contains(&word)).map(|(meaning, _)| *meaning)
}

/// Returns whether `word` looks like a type and not like the name of a variable: `int`, `uint8_t`, `Pose`.
pub(crate) fn looks_like_type(word: &str) -> bool {
    let scalar =
        word.strip_suffix("_t").unwrap_or(word).trim_end_matches(|letter: char| letter.is_ascii_digit());
    SCALARS.contains(&word)
        || SCALARS.contains(&scalar)
        || word.starts_with(|letter: char| letter.is_ascii_uppercase())
}

/// Returns whether `word` is a type without fields in many languages: `int`, `double`.
pub(crate) fn is_scalar(word: &str) -> bool {
    SCALARS.contains(&word)
}
