//! Builds the tree from events and tokens, and inserts white space and comments.

use std::sync::Arc;

use rowan::{GreenNode, GreenNodeBuilder, Language as _, TextRange, TextSize, TokenAtOffset};

use crate::error::{SyntaxError, SyntaxErrorKind};
use crate::generated::nodes::SourceFile;
use crate::lexer::Lexed;
use crate::parser::{Events, ParseEvent};
use crate::{Mauve, SyntaxKind, SyntaxNode, SyntaxToken};

/// A tree, and the errors of its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parse {
    pub(crate) green: GreenNode,
    pub(crate) errors: Arc<[SyntaxError]>,
}

impl Parse {
    /// The root of the tree, a `SOURCE_FILE`.
    pub fn syntax(&self) -> SyntaxNode {
        SyntaxNode::new_root(self.green.clone())
    }

    /// The typed root.
    pub fn file(&self) -> SourceFile {
        SourceFile(self.syntax())
    }

    /// The tree as a value, without positions.
    pub fn green(&self) -> &GreenNode {
        &self.green
    }

    /// The errors in text order.
    pub fn errors(&self) -> &[SyntaxError] {
        &self.errors
    }

    /// Returns the tree as text, with one node or token per line.
    ///
    /// ```
    /// let parse = mauve_syntax::parse("use std_msgs");
    /// assert_eq!(parse.debug_dump().lines().next(), Some("SOURCE_FILE@0..12"));
    /// ```
    pub fn debug_dump(&self) -> String {
        self.debug_dump_interruptible(&|| ())
    }

    /// Returns [`Parse::debug_dump`]. Calls `interrupt` often; it may unwind. A text of more than 32 MB, such as that of a deep tree, is
    /// cut, and ends with `…`.
    pub fn debug_dump_interruptible(&self, interrupt: &dyn Fn()) -> String {
        let mut out = String::new();
        let mut depth = 0;
        for event in self.syntax().preorder_with_tokens() {
            interrupt();
            if out.len() > MOST_DUMPED {
                out += "…\n";
                break;
            }
            match event {
                rowan::WalkEvent::Enter(element) => {
                    out.extend(std::iter::repeat_n("  ", depth));
                    match element {
                        rowan::NodeOrToken::Node(node) => {
                            out += &format!("{:?}@{:?}\n", node.kind(), node.text_range());
                        }
                        rowan::NodeOrToken::Token(token) => {
                            let (kind, range) = (token.kind(), token.text_range());
                            out += &format!("{kind:?}@{range:?} {:?}\n", token.text());
                        }
                    }
                    depth += 1;
                }
                rowan::WalkEvent::Leave(_) => depth -= 1,
            }
        }
        out
    }
}

/// The bytes of a dump.
const MOST_DUMPED: usize = 32 << 20;

/// Returns whether `node` is complete: no `ERROR` is in it.
///
/// ```
/// use mauve_syntax::{is_whole, parse};
/// assert!(is_whole(&parse("codel f(): int").syntax()));
/// assert!(!is_whole(&parse("codel f(: int").syntax()));
/// ```
pub fn is_whole(node: &SyntaxNode) -> bool {
    node.kind() != SyntaxKind::ERROR && node.descendants().all(|inner| inner.kind() != SyntaxKind::ERROR)
}

pub(crate) fn too_long() -> Parse {
    let mut builder = GreenNodeBuilder::new();
    builder.start_node(Mauve::kind_to_raw(SyntaxKind::SOURCE_FILE));
    builder.start_node(Mauve::kind_to_raw(SyntaxKind::ERROR));
    builder.finish_node();
    builder.finish_node();
    let range = TextRange::empty(TextSize::new(0));
    Parse {
        green: builder.finish(),
        errors: Arc::new([SyntaxError { range, kind: SyntaxErrorKind::TooLong }]),
    }
}

pub(crate) fn build(text: &str, lexed: &Lexed, events: Events) -> Parse {
    let Events { first, mut events, errors } = events;
    let mut sink = Sink { text, lexed, next: first, builder: GreenNodeBuilder::new() };
    let mut outer = Vec::new();
    for index in 0..events.len() {
        match std::mem::replace(&mut events[index], ParseEvent::Taken) {
            ParseEvent::Taken => {}
            ParseEvent::Start { kind, parent } => {
                // A node that was wrapped later: its wrappers start first, and the last one is the outermost.
                outer.push(kind);
                let mut next = parent.map(|distance| index + distance as usize);
                while let Some(at) = next {
                    let ParseEvent::Start { kind, parent } =
                        std::mem::replace(&mut events[at], ParseEvent::Taken)
                    else {
                        break;
                    };
                    outer.push(kind);
                    next = parent.map(|distance| at + distance as usize);
                }
                for kind in outer.drain(..).rev() {
                    // White space and comments are placed before a node, never first in it. Exceptions: the root
                    // contains everything, and the mark of a missing element follows the previous token directly.
                    if !matches!(kind, SyntaxKind::SOURCE_FILE | SyntaxKind::ERROR)
                        || matches!(events.get(index + 1), Some(ParseEvent::Token { .. }))
                            && kind == SyntaxKind::ERROR
                    {
                        sink.trivia();
                    }
                    sink.builder.start_node(Mauve::kind_to_raw(kind));
                }
            }
            ParseEvent::Finish => sink.builder.finish_node(),
            ParseEvent::Token { kind } => {
                sink.trivia();
                sink.token(kind);
            }
            ParseEvent::Rest => sink.trivia(),
        }
    }
    Parse { green: sink.builder.finish(), errors: errors.into() }
}

struct Sink<'a> {
    text: &'a str,
    lexed: &'a Lexed,
    next: usize,
    builder: GreenNodeBuilder<'static>,
}

impl Sink<'_> {
    fn trivia(&mut self) {
        while self.lexed.kind(self.next).is_trivia() {
            let kind = self.lexed.kind(self.next);
            // The node around a line of a conflict is incomplete.
            if kind == SyntaxKind::CONFLICT {
                self.builder.start_node(Mauve::kind_to_raw(SyntaxKind::ERROR));
            }
            self.token(kind);
            if kind == SyntaxKind::CONFLICT {
                self.builder.finish_node();
            }
        }
    }

    fn token(&mut self, kind: SyntaxKind) {
        let text = self.text.get(self.lexed.range(self.next)).unwrap_or_default();
        self.builder.token(Mauve::kind_to_raw(kind), text);
        self.next += 1;
    }
}

/// Returns the token that contains the byte at `offset`; none at the end of the text.
///
/// A binary search: rowan's `token_at_offset` visits all siblings, and a list may have very many.
///
/// ```
/// let root = mauve_syntax::parse("codel f(): int").syntax();
/// assert_eq!(mauve_syntax::token_at(&root, 6.into()).unwrap().text(), "f");
/// assert_eq!(mauve_syntax::token_at(&root, 14.into()), None);
/// ```
pub fn token_at(root: &SyntaxNode, offset: TextSize) -> Option<SyntaxToken> {
    let byte = TextRange::at(offset, 1.into());
    root.text_range().contains_range(byte).then(|| root.covering_element(byte).into_token()).flatten()
}

/// Returns the token that ends at `offset` or contains it.
pub fn token_before(root: &SyntaxNode, offset: TextSize) -> Option<SyntaxToken> {
    token_at(root, offset.checked_sub(1.into())?)
}

/// Returns the tokens that contain or touch `offset`: two between tokens, none outside the text.
///
/// ```
/// let root = mauve_syntax::parse("a.b").syntax();
/// let texts = |offset: u32| {
///     mauve_syntax::tokens_at(&root, offset.into()).map(|token| token.text().to_owned()).collect::<Vec<_>>()
/// };
/// assert_eq!((texts(0), texts(1), texts(3)), (vec!["a".into()], vec!["a".into(), ".".into()], vec!["b".into()]));
/// ```
pub fn tokens_at(root: &SyntaxNode, offset: TextSize) -> TokenAtOffset<SyntaxToken> {
    match (token_before(root, offset), token_at(root, offset)) {
        (Some(left), Some(right)) if left == right => TokenAtOffset::Single(left),
        (Some(left), Some(right)) => TokenAtOffset::Between(left, right),
        (left, right) => left.or(right).map_or(TokenAtOffset::None, TokenAtOffset::Single),
    }
}
