//! Forms of other languages. The parser recognises them where the grammar does not allow them, and reports each as one
//! error that shows the form in MAUVE.
//!
//! A word of these tables is a name wherever the grammar allows a name. The parser reads no other words, only kinds of
//! tokens: `reads_alike` in `parser.rs` tells whether a reparse may exchange two words.

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
    /// `cpus = {1, 2}`
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

/// The role of a word in other languages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ForeignWord {
    /// A binary operator.
    Operator(SyntaxKind),
    Not,
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
    /// It begins a type that is not changed.
    Const,
    /// It is all of an empty list of parameters.
    NoParameters,
    /// It begins the use of a library.
    Using,
    From,
    /// The second word of `state machine`.
    Machine,
    /// The end of the name of a file.
    FileEnding,
    /// It begins a function.
    Function,
    /// It opens or closes a block, or is all of one.
    Brace,
    Unit,
    /// It comes before the shell of a core.
    ForShell,
    /// A keyword that begins an item of an architecture or a shell.
    Keyword(SyntaxKind),
}

/// The words with their roles.
const WORDS: &[(&str, ForeignWord)] = &[
    ("and", ForeignWord::Operator(AMP2)),
    ("or", ForeignWord::Operator(PIPE2)),
    ("is", ForeignWord::Operator(EQ2)),
    ("mod", ForeignWord::Operator(PERCENT)),
    ("not", ForeignWord::Not),
    ("elif", ForeignWord::ElseIf),
    ("elsif", ForeignWord::ElseIf),
    ("elseif", ForeignWord::ElseIf),
    ("when", ForeignWord::Guard),
    ("on", ForeignWord::Guard),
    ("goto", ForeignWord::Target),
    ("go", ForeignWord::Target),
    ("for", ForeignWord::Loop),
    ("foreach", ForeignWord::Loop),
    ("while", ForeignWord::Loop),
    ("do", ForeignWord::Loop),
    ("loop", ForeignWord::Loop),
    ("repeat", ForeignWord::Loop),
    ("break", ForeignWord::Jump),
    ("continue", ForeignWord::Jump),
    ("pass", ForeignWord::Brace),
    ("switch", ForeignWord::Switch),
    ("match", ForeignWord::Switch),
    ("case", ForeignWord::Switch),
    ("default", ForeignWord::Switch),
    ("let", ForeignWord::Untyped),
    ("auto", ForeignWord::Untyped),
    ("const", ForeignWord::Untyped),
    ("function", ForeignWord::Function),
    ("func", ForeignWord::Function),
    ("def", ForeignWord::Function),
    ("fn", ForeignWord::Function),
    ("begin", ForeignWord::Brace),
    ("end", ForeignWord::Brace),
    ("endif", ForeignWord::Brace),
    ("fi", ForeignWord::Brace),
    ("ns", ForeignWord::Unit),
    ("us", ForeignWord::Unit),
    ("ms", ForeignWord::Unit),
    ("s", ForeignWord::Unit),
    ("sec", ForeignWord::Unit),
    ("min", ForeignWord::Unit),
    ("Hz", ForeignWord::Unit),
    ("kHz", ForeignWord::Unit),
    ("mm", ForeignWord::Unit),
    ("cm", ForeignWord::Unit),
    ("m", ForeignWord::Unit),
    ("rad", ForeignWord::Unit),
    ("deg", ForeignWord::Unit),
    ("of", ForeignWord::ForShell),
    ("implements", ForeignWord::ForShell),
    ("connect", ForeignWord::Keyword(CONNECTION_KW)),
    ("link", ForeignWord::Keyword(CONNECTION_KW)),
    ("namespace", ForeignWord::Keyword(LIBRARY_KW)),
    ("package", ForeignWord::Keyword(LIBRARY_KW)),
    ("module", ForeignWord::Keyword(LIBRARY_KW)),
    ("param", ForeignWord::Keyword(PROPERTY_KW)),
    ("parameter", ForeignWord::Keyword(PROPERTY_KW)),
    ("const", ForeignWord::Keyword(CONSTANT_KW)),
    ("const", ForeignWord::Const),
    ("using", ForeignWord::Using),
    ("from", ForeignWord::From),
    ("machine", ForeignWord::Machine),
    ("mal", ForeignWord::FileEnding),
    ("configureHook", ForeignWord::Keyword(CONFIGURE_KW)),
    ("startHook", ForeignWord::Keyword(START_KW)),
    ("updateHook", ForeignWord::Keyword(UPDATE_KW)),
    ("stopHook", ForeignWord::Keyword(STOP_KW)),
    ("cleanupHook", ForeignWord::Keyword(CLEANUP_KW)),
    ("void", ForeignWord::NoParameters),
];

/// Types that are written in lower case.
const SCALARS: &[&str] = &[
    "bool", "boolean", "byte", "char", "double", "float", "int", "integer", "long", "real", "short",
    "size_t", "str", "string", "uint", "unsigned", "void",
];

/// Returns the roles of `word` in other languages. A word may have several, such as `const`.
pub(crate) fn meanings(word: &str) -> impl Iterator<Item = ForeignWord> {
    WORDS.iter().filter(move |(other, _)| *other == word).map(|(_, meaning)| *meaning)
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
