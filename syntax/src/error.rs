//! Syntax errors as data; `mauve-diagnostics` has the messages.

use rowan::{TextRange, TextSize};

use crate::SyntaxKind;
use crate::foreign::Foreign;

/// An error in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SyntaxError {
    /// The wrong token, or an empty range after the token that a missing element should follow.
    pub range: TextRange,
    /// The kind of error.
    pub kind: SyntaxErrorKind,
}

/// The kinds of syntax error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SyntaxErrorKind {
    /// Something is missing.
    Expected {
        /// The missing element.
        expected: Expected,
        /// The kind of the token at the range; none at the end of a line or of the text.
        found: Option<SyntaxKind>,
        /// A keyword with a similar spelling.
        similar: Option<&'static str>,
    },
    /// An invalid token.
    Token(TokenError),
    /// A form of another language.
    Foreign(Foreign),
    /// An `include` after a declaration.
    LateInclude,
    /// An `include` whose path has no quotes.
    PathWithoutQuotes,
    /// A word after the value of a field of an activity, such as a unit.
    WordAfterField,
    /// `a < b < c`
    ChainedComparison,
    /// `pose.x` in a program.
    MessageField,
    /// `scan[3]` in a program.
    ArrayElement,
    /// A region that git has marked because it could not merge two texts.
    Conflict {
        /// The length of the region.
        length: TextSize,
        /// Whether what comes behind the region is the same for both texts.
        is_contained: bool,
    },
    /// More than [`DEEPEST`](crate::DEEPEST) nested levels.
    TooDeep,
    /// A text of more than [`LONGEST_TEXT`](crate::LONGEST_TEXT) bytes.
    TooLong,
}

/// An error inside a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum TokenError {
    BadNumber,
    UnterminatedString,
    UnterminatedComment,
    UnknownEscape,
    Hash,
    SingleQuotes,
    /// A marker of git, without its others.
    ConflictMarker,
    Characters,
}

/// An element that the grammar expects at a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Expected {
    /// A token of this kind.
    Token(SyntaxKind),
    /// A block or an `if`, after `else`.
    BlockOrIf,
    /// An item of the list in a node of this kind.
    Item(SyntaxKind),
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
