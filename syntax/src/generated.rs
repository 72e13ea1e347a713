//! What `tests/generated.rs` makes from `mauve.ungram`, in terms of these macros, and the tree that it describes.

/// Declares the kinds of token and node in the order of their numbers: first the tokens that always have the same text.
macro_rules! syntax_kinds {
    (
        texts { $($token:ident $text:tt;)* }
        others { $($(#[$($attribute:tt)*])* $kind:ident;)* }
    ) => {
        /// What a token or a node of the syntax tree is.
        #[allow(missing_docs, non_camel_case_types, clippy::upper_case_acronyms)]
        #[derive(logos::Logos, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum SyntaxKind {
            /// The end of the text: never in a tree.
            EOF,
            $(#[token($text)] $token,)*
            $($(#[$($attribute)*])* $kind,)*
        }

        impl SyntaxKind {
            /// All kinds, in the order of their numbers.
            pub(crate) const ALL: &'static [SyntaxKind] =
                &[SyntaxKind::EOF, $(SyntaxKind::$token,)* $(SyntaxKind::$kind),*];

            /// Returns the text of a token that always has the same one.
            pub fn text(self) -> Option<&'static str> {
                Some(match self {
                    $(SyntaxKind::$token => $text,)*
                    _ => return None,
                })
            }
        }
    };
}

/// Declares a set of keywords as an enum, each with its word and the kind of its token.
macro_rules! keyword_set {
    ($(#[$doc:meta])* $set:ident { $($keyword:ident $word:literal $kind:ident;)* }) => {
        $(#[$doc])*
        #[allow(missing_docs)]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $set {
            $($keyword,)*
        }

        impl $set {
            /// All of them, in the order of the grammar.
            pub const ALL: [$set; [$($word),*].len()] = [$($set::$keyword),*];

            /// Their keywords, in the same order.
            pub const KEYWORDS: [&'static str; [$($word),*].len()] = [$($word),*];

            /// Returns the keyword.
            pub fn keyword(self) -> &'static str {
                Self::KEYWORDS[self as usize]
            }

            /// Returns the one with `keyword`.
            pub fn from_keyword(keyword: &str) -> Option<$set> {
                Self::ALL.into_iter().find(|it| it.keyword() == keyword)
            }

            /// Returns the one whose keyword is a token of `kind`.
            pub fn from_kind(kind: SyntaxKind) -> Option<$set> {
                match kind {
                    $(SyntaxKind::$kind => Some($set::$keyword),)*
                    _ => None,
                }
            }
        }
    };
}

/// Declares the typed view of a node, with an accessor for each token and node in it.
macro_rules! node {
    ($node:ident $kind:ident { $($accessor:ident: $what:ident $ty:ident $($position:literal)?;)* }) => {
        #[derive(Debug, Clone, PartialEq, Eq, Hash)]
        pub struct $node(pub(crate) SyntaxNode);

        impl AstNode for $node {
            fn can_cast(kind: SyntaxKind) -> bool {
                kind == $kind
            }

            fn cast(node: SyntaxNode) -> Option<Self> {
                Self::can_cast(node.kind()).then_some($node(node))
            }

            fn syntax(&self) -> &SyntaxNode {
                &self.0
            }
        }

        impl $node {
            $(node!(@ $accessor $what $ty $($position)?);)*
        }
    };
    (@ $accessor:ident token $kind:ident) => {
        pub fn $accessor(&self) -> Option<SyntaxToken> {
            token(&self.0, $kind)
        }
    };
    (@ $accessor:ident child $ty:ident) => {
        pub fn $accessor(&self) -> Option<$ty> {
            child(&self.0)
        }
    };
    (@ $accessor:ident child $ty:ident $position:literal) => {
        pub fn $accessor(&self) -> Option<$ty> {
            nth_child(&self.0, $position)
        }
    };
    (@ $accessor:ident children $ty:ident) => {
        pub fn $accessor(&self) -> impl Iterator<Item = $ty> {
            children(&self.0)
        }
    };
}

/// Declares the typed view of a node that is one of several.
macro_rules! one_of {
    ($name:ident { $($node:ident $kind:ident;)* }) => {
        #[derive(Debug, Clone, PartialEq, Eq, Hash)]
        pub enum $name {
            $($node($node),)*
        }

        impl AstNode for $name {
            fn can_cast(kind: SyntaxKind) -> bool {
                matches!(kind, $($kind)|*)
            }

            fn cast(node: SyntaxNode) -> Option<Self> {
                Some(match node.kind() {
                    $($kind => $name::$node($node(node)),)*
                    _ => return None,
                })
            }

            fn syntax(&self) -> &SyntaxNode {
                match self {
                    $($name::$node(it) => it.syntax(),)*
                }
            }
        }
    };
}

pub mod keywords;
pub(crate) mod kinds;
pub(crate) mod nodes;

use kinds::SyntaxKind;

/// Ties rowan's untyped kinds to [`SyntaxKind`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Mauve {}

impl rowan::Language for Mauve {
    type Kind = SyntaxKind;

    fn kind_from_raw(raw: rowan::SyntaxKind) -> SyntaxKind {
        SyntaxKind::ALL.get(usize::from(raw.0)).copied().unwrap_or(SyntaxKind::ERROR)
    }

    fn kind_to_raw(kind: SyntaxKind) -> rowan::SyntaxKind {
        rowan::SyntaxKind(kind as u16)
    }
}

/// A node of the tree, with its position in the file.
pub type SyntaxNode = rowan::SyntaxNode<Mauve>;
/// A token of the tree, with its position in the file.
pub type SyntaxToken = rowan::SyntaxToken<Mauve>;
/// A node or a token.
pub type SyntaxElement = rowan::SyntaxElement<Mauve>;

/// A typed view of a node of one kind, or of one of several kinds.
pub trait AstNode: Sized {
    /// Returns whether this view exists for nodes of a kind.
    fn can_cast(kind: SyntaxKind) -> bool;

    /// Returns the typed view of `node`, if its kind is right.
    fn cast(node: SyntaxNode) -> Option<Self>;

    /// The node itself.
    fn syntax(&self) -> &SyntaxNode;

    /// Returns the first token that is in no node below it: a keyword, an operator, or what a literal consists of.
    fn own_token(&self) -> Option<SyntaxToken> {
        own_tokens(self.syntax()).find(|token| !token.kind().is_trivia())
    }
}

pub(crate) fn child<N: AstNode>(parent: &SyntaxNode) -> Option<N> {
    parent.children().find_map(N::cast)
}

pub(crate) fn nth_child<N: AstNode>(parent: &SyntaxNode, index: usize) -> Option<N> {
    parent.children().filter_map(N::cast).nth(index)
}

pub(crate) fn children<N: AstNode>(parent: &SyntaxNode) -> impl Iterator<Item = N> + use<N> {
    parent.children().filter_map(N::cast)
}

pub(crate) fn token(parent: &SyntaxNode, kind: SyntaxKind) -> Option<SyntaxToken> {
    own_tokens(parent).find(|token| token.kind() == kind)
}

fn own_tokens(parent: &SyntaxNode) -> impl Iterator<Item = SyntaxToken> + use<> {
    parent.children_with_tokens().filter_map(rowan::NodeOrToken::into_token)
}
