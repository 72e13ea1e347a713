//! The position of the cursor in the grammar, from the tree and the preceding tokens: the text is usually incomplete.

use mauve_syntax::SyntaxKind::{self, *};
use mauve_syntax::{
    SyntaxNode, SyntaxToken, TextRange, TextSize, is_closed_comment, is_whole, next_token,
    previous_significant, previous_token, tokens_at,
};

/// A position in the grammar.
pub(crate) struct Position {
    /// The word around the cursor, or the empty range at the cursor.
    pub(crate) word: TextRange,
    /// The word up to the cursor.
    pub(crate) prefix: String,
    /// The token before the word.
    pub(crate) left: Option<SyntaxToken>,
    /// The kind of the token after the word; [`EOF`] at the end of the text.
    pub(crate) right: SyntaxKind,
    /// The first token of the argument after the word and its `(`, or the `)`; none if no `(` follows directly.
    pub(crate) first_argument: Option<SyntaxToken>,
    /// The innermost list of items around the cursor: a file, a library, a shell, …, a block.
    pub(crate) list: SyntaxNode,
    /// The tokens of the incomplete item, in that list, before the word; none if an item may begin.
    pub(crate) item: Vec<SyntaxToken>,
    /// The tokens of an item before the cursor's line, if it may continue or another one may begin.
    pub(crate) before: Vec<SyntaxToken>,
    /// Whether an item may begin here, although another one precedes it on the line.
    pub(crate) may_begin: bool,
    /// The item whose closing brace is directly before the cursor.
    pub(crate) closed: Option<SyntaxNode>,
}

impl Position {
    /// Returns the position of `offset`; none in comments, strings and numbers.
    pub(crate) fn at(root: &SyntaxNode, offset: TextSize) -> Option<Position> {
        let around: Vec<SyntaxToken> = tokens_at(root, offset).collect();
        if around.iter().any(|token| is_closed_to(token, offset)) {
            return None;
        }
        Some(Position::in_any_token(root, offset))
    }

    /// Returns the position of `offset`, also in comments, strings and numbers.
    pub(crate) fn in_any_token(root: &SyntaxNode, offset: TextSize) -> Position {
        let around: Vec<SyntaxToken> = tokens_at(root, offset).collect();
        let word = around.iter().find(|it| it.kind().is_word() && it.text_range().start() < offset);
        let range = word.map_or(TextRange::empty(offset), SyntaxToken::text_range);
        let prefix = word.and_then(|word| {
            let length = usize::from(offset.checked_sub(word.text_range().start())?);
            Some(word.text().get(..length)?.to_owned())
        });
        let left = around.iter().cloned().find_map(|token| before(token, range.start()));
        let right = around.last().cloned().and_then(|token| behind(token, range.end()));
        let opens =
            right.as_ref().filter(|it| it.kind() == L_PAREN && it.text_range().start() == range.end());
        let first_argument = opens.and_then(|it| behind(it.clone(), it.text_range().end()));
        let list = left.as_ref().map_or_else(|| root.clone(), |left| list_around(root, left));
        let begins_line = left.as_ref().is_none_or(|left| {
            let between = TextRange::new(left.text_range().end(), range.start());
            root.text().slice(between).contains_char('\n')
        });
        let mut position = Position {
            word: range,
            prefix: prefix.unwrap_or_default(),
            left,
            right: right.map_or(EOF, |token| token.kind()),
            first_argument,
            list,
            item: Vec::new(),
            before: Vec::new(),
            may_begin: true,
            closed: None,
        };
        position.find_item(begins_line);
        position
    }

    fn find_item(&mut self, begins_line: bool) {
        let Some(left) = &self.left else { return };
        let item = left.parent_ancestors().find(|node| node.parent().as_ref() == Some(&self.list));
        let Some(item) = item else { return };
        if left.kind() == SEMICOLON && item.kind() != PROPERTY {
            return;
        }
        if left.kind() == R_CURLY {
            self.closed = Some(item);
            return;
        }
        let tokens = item.descendants_with_tokens().filter_map(|it| it.into_token());
        let tokens = tokens.filter(|token| !token.kind().is_trivia());
        let tokens = tokens.take_while(|token| token.text_range().end() <= self.word.start()).collect();
        if begins_line && may_end_item(left) {
            self.before = tokens;
        } else {
            self.may_begin = may_end_item(left)
                && item.kind() != ERROR
                && is_whole(&item)
                && item.text_range().end() <= self.word.start();
            self.item = tokens;
        }
    }

    pub(crate) fn kinds(&self) -> Vec<SyntaxKind> {
        self.item.iter().map(SyntaxToken::kind).collect()
    }

    pub(crate) fn around(&self, kind: SyntaxKind) -> Option<SyntaxNode> {
        self.list.ancestors().find(|node| node.kind() == kind)
    }
}

/// Returns whether `offset` is in a token in which no item begins: a comment, a string or a number.
pub(crate) fn is_closed_to(token: &SyntaxToken, offset: TextSize) -> bool {
    let range = token.text_range();
    if offset <= range.start() {
        return false;
    }
    match token.kind() {
        LINE_COMMENT | CONFLICT | UNTERMINATED_STRING | INT_NUMBER | FLOAT_NUMBER | BAD_NUMBER => true,
        BLOCK_COMMENT => offset < range.end() || !is_closed_comment(token.text()),
        STRING => offset < range.end(),
        _ => false,
    }
}

/// Returns the last significant token that ends at or before `offset`; `token` is near it.
pub(crate) fn before(token: SyntaxToken, offset: TextSize) -> Option<SyntaxToken> {
    std::iter::successors(Some(token), previous_token)
        .find(|token| token.text_range().end() <= offset && !token.kind().is_trivia())
}

/// Returns the first significant token that begins at or after `offset`.
pub(crate) fn behind(token: SyntaxToken, offset: TextSize) -> Option<SyntaxToken> {
    std::iter::successors(Some(token), next_token)
        .find(|token| token.text_range().start() >= offset && !token.kind().is_trivia())
}

fn list_around(root: &SyntaxNode, left: &SyntaxToken) -> SyntaxNode {
    const LISTS: [SyntaxKind; 9] =
        [LIBRARY, SHELL, CORE, STATE_MACHINE, STATE, ARCHITECTURE, DEPLOYMENT, ACTIVITY, BLOCK];
    let is_open = |node: &SyntaxNode| {
        let mut braces = node.children_with_tokens().filter_map(|it| it.into_token());
        let opens = braces
            .any(|brace| brace.kind() == L_CURLY && brace.text_range().start() <= left.text_range().start());
        opens && !(left.kind() == R_CURLY && left.parent().as_ref() == Some(node))
    };
    let mut nodes = left.parent_ancestors();
    nodes.find(|node| LISTS.contains(&node.kind()) && is_open(node)).unwrap_or_else(|| root.clone())
}

/// Returns whether this may be the last token of an item that has no closing token.
fn may_end_item(token: &SyntaxToken) -> bool {
    ends_operand(token.kind()) || matches!(token.kind(), BAD_NUMBER | UNTERMINATED_STRING | R_BRACK)
}

pub(crate) fn ends_operand(kind: SyntaxKind) -> bool {
    matches!(kind, IDENT | INT_NUMBER | FLOAT_NUMBER | STRING | R_PAREN) || kind.is_literal_keyword()
}

/// Returns the segments of a path `a.b::` at the end of `tokens`, and the tokens before it.
pub(crate) fn without_path(tokens: &[SyntaxToken]) -> (&[SyntaxToken], Vec<&str>) {
    let mut rest = tokens;
    let mut path = Vec::new();
    while let [head @ .., name, separator] = rest
        && matches!(separator.kind(), DOT | COLON2)
        && name.kind().is_word()
    {
        path.insert(0, name.text());
        rest = head;
    }
    (rest, path)
}

pub(crate) struct Call {
    pub(crate) callee: SyntaxToken,
    pub(crate) arguments: SyntaxNode,
    /// The index of the argument, from 0.
    pub(crate) index: usize,
}

/// Returns the innermost call that may have an argument after `left`.
pub(crate) fn call_around(left: &SyntaxToken) -> Option<Call> {
    let mut commas: Vec<(SyntaxNode, usize)> = Vec::new();
    let mut depth = 0_usize;
    for token in std::iter::successors(Some(left.clone()), previous_token) {
        match token.kind() {
            R_PAREN => depth += 1,
            L_PAREN if depth > 0 => depth -= 1,
            L_PAREN => {
                let list = token.parent()?;
                match list.kind() {
                    ARGUMENT_LIST => {
                        let callee = previous_significant(&token)?;
                        let index = commas.iter().find(|(of, _)| *of == list).map_or(0, |(_, count)| *count);
                        return Some(Call { callee, arguments: list, index });
                    }
                    // Brackets in an argument.
                    PAREN_EXPR => {}
                    _ => return None,
                }
            }
            COMMA if depth == 0 => {
                // In brackets, a comma does not separate arguments: it is an error.
                let list = token.parent()?;
                match commas.iter_mut().find(|(of, _)| *of == list) {
                    Some((_, count)) => *count += 1,
                    None => commas.push((list, 1)),
                }
            }
            SEMICOLON | L_CURLY | R_CURLY | EQ | COLON | ARROW => return None,
            // Of the keywords, only literals occur in arguments.
            kind if kind.is_word() && kind != IDENT && !kind.is_literal_keyword() => return None,
            _ => {}
        }
    }
    None
}
