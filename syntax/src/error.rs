//! What the grammar does not allow, as facts: who shows them writes the sentences.

use rowan::TextRange;

use crate::SyntaxKind;
use crate::foreign::Foreign;
use crate::parser::List;

/// An error in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SyntaxError {
    /// The token that is wrong, or the empty range behind the token that something must follow.
    pub range: TextRange,
    /// What is wrong there.
    pub kind: SyntaxErrorKind,
}

/// The kinds of syntax error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SyntaxErrorKind {
    /// Something is missing.
    Expected {
        /// What is missing.
        expected: Expected,
        /// The kind of the token at the range; none where the line or the text ends.
        found: Option<SyntaxKind>,
        /// The keyword that is spelt like the token.
        similar: Option<&'static str>,
    },
    /// A token that is none.
    Token(TokenError),
    /// A form of another language.
    Foreign(Foreign),
    /// An `include` behind a declaration.
    LateInclude,
    /// An `include` whose path has no quotes.
    PathWithoutQuotes,
    /// A word behind the value of a field of an activity, such as a unit.
    WordAfterField,
    /// `a < b < c`
    ChainedComparison,
    /// `pose.x` in a program.
    MessageField,
    /// `scan[3]` in a program.
    ArrayElement,
    /// More than [`DEEPEST`](crate::DEEPEST) levels in one another.
    TooDeep,
    /// A text of more than [`LONGEST_TEXT`](crate::LONGEST_TEXT) bytes.
    TooLong,
}

/// What is wrong inside a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum TokenError {
    BadNumber,
    UnterminatedString,
    UnterminatedComment,
    UnknownEscape,
    Hash,
    SingleQuotes,
    Characters,
}

/// What the grammar expects at a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Expected {
    /// A token of this kind.
    Token(SyntaxKind),
    /// What stands behind `else`.
    BlockOrIf,
    /// An item of this list.
    Item(List),
    Name,
    PackageName,
    ShellName,
    CoreName,
    ComponentName,
    ArchitectureName,
    InstanceName,
    StateName,
    Type,
    Parameters,
    Parameter,
    Argument,
    Expression,
}
