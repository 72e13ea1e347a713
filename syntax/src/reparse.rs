//! Reparses an edited text, and reuses subtrees that the edit cannot affect.
//!
//! **The tree and the errors are exactly those of a full parse.** The parser is a function of its state (the open
//! lists, the depth, and whether it has reported an error at the current token) and of the tokens from the previous one
//! on; it examines at most the current token and [`AHEAD`] further ones. So with an equal state and equal tokens, it
//! does the same in both texts until it examines a changed token.
//!
//! - [`Tier::Token`]: only the text of one token changed. The parser examines kinds of tokens and beginnings of lines.
//!   It reads the text of a token only for an error at that token, and for words of other languages (`foreign.rs`).
//! - [`Tier::Trivia`]: white space and comments between two tokens changed; the second token begins a line in both
//!   texts, or in neither.
//! - [`Tier::Items`]: some items of one list are parsed again: from an item whose first tokens did not change, to an
//!   item behind the edit where the parser reaches the state that it had in the old text.
//! - [`Tier::Whole`]: the whole text is parsed again.

use rowan::{GreenNode, GreenToken, Language as _, NodeOrToken, TextRange, TextSize};

use crate::SyntaxKind::*;
use crate::conflict::regions;
use crate::error::{SyntaxError, SyntaxErrorKind};
use crate::grammar::{self, LONGEST_TEXT, parse};
use crate::lexer::{Lexed, lex_from};
use crate::list::item_keywords;
use crate::parser::{self, Parser, comment_error};
use crate::tree::{self, Parse};
use crate::{Mauve, SyntaxNode, SyntaxToken};

/// The part of a tree that was rebuilt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Tier {
    /// No part: the texts are equal.
    Nothing,
    /// One token.
    Token,
    /// The white space and comments between two tokens.
    Trivia,
    /// Some consecutive items of one list.
    Items,
    /// The whole tree.
    Whole,
}

/// The number of tokens after the current one that the parser examines.
const AHEAD: usize = 2;

/// The number of bytes after a token that the lexer may have read: `include` after `#`, and the next byte.
const LEXER_AHEAD: usize = 8;

/// The number of items behind an edit that are tried before another list is tried.
const TRIED: usize = 3;

impl Parse {
    /// Returns the parse of `new`, and reuses subtrees of this one, the parse of `old`.
    ///
    /// ```
    /// let (old, new) = ("use std_msgs use nav_msgs", "use std_msgs use geometry_msgs");
    /// let parse = mauve_syntax::parse(old);
    /// assert_eq!(parse.reparse(old, new), mauve_syntax::parse(new));
    /// ```
    pub fn reparse(&self, old: &str, new: &str) -> Parse {
        self.reparse_by(old, new).0
    }

    /// Does the same as [`Parse::reparse`], and returns the rebuilt part as well.
    pub fn reparse_by(&self, old: &str, new: &str) -> (Parse, Tier) {
        let is_of_old = usize::from(self.green.text_len()) == old.len();
        if !is_of_old || new.len() > LONGEST_TEXT {
            return (parse(new), Tier::Whole);
        }
        let Some(edit) = ReplacedText::between(old, new) else { return (self.clone(), Tier::Nothing) };
        // The regions of conflicts depend on all markers of a text. Each is an error of its tree.
        let is_conflict = |error: &SyntaxError| matches!(error.kind, SyntaxErrorKind::Conflict { .. });
        if self.errors().iter().any(is_conflict) || !regions(new).is_empty() {
            return (parse(new), Tier::Whole);
        }
        let before = Before { parse: self, root: self.syntax(), old, new, edit };
        let token = || Some((before.token()?, Tier::Token));
        let trivia = || Some((before.trivia()?, Tier::Trivia));
        let items = || Some((before.items()?, Tier::Items));
        token().or_else(trivia).or_else(items).unwrap_or_else(|| (parse(new), Tier::Whole))
    }
}

/// `old[start..old_end]` became `new[start..new_end]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ReplacedText {
    start: usize,
    old_end: usize,
    new_end: usize,
}

impl ReplacedText {
    /// Returns the smallest edit that changes `old` to `new`; none if they are equal.
    fn between(old: &str, new: &str) -> Option<ReplacedText> {
        if old == new {
            return None;
        }
        let shorter = old.len().min(new.len());
        let mut start = common_prefix(old.as_bytes(), new.as_bytes());
        while !(old.is_char_boundary(start) && new.is_char_boundary(start)) {
            start -= 1;
        }
        let mut after = common_suffix(old.as_bytes(), new.as_bytes()).min(shorter - start);
        while !(old.is_char_boundary(old.len() - after) && new.is_char_boundary(new.len() - after)) {
            after -= 1;
        }
        Some(ReplacedText { start, old_end: old.len() - after, new_end: new.len() - after })
    }

    /// Returns the new offset of a position behind the edit.
    fn shifted(&self, offset: usize) -> usize {
        offset - self.old_end + self.new_end
    }
}

/// Texts are compared in chunks of this size, each of them with one `memcmp`.
const CHUNK: usize = 1024;

fn common_prefix(a: &[u8], b: &[u8]) -> usize {
    let chunks = a.chunks_exact(CHUNK).zip(b.chunks_exact(CHUNK)).take_while(|(a, b)| a == b).count() * CHUNK;
    chunks + a.iter().zip(b).skip(chunks).take_while(|(a, b)| a == b).count()
}

fn common_suffix(a: &[u8], b: &[u8]) -> usize {
    let chunks =
        a.rchunks_exact(CHUNK).zip(b.rchunks_exact(CHUNK)).take_while(|(a, b)| a == b).count() * CHUNK;
    chunks + a.iter().rev().zip(b.iter().rev()).skip(chunks).take_while(|(a, b)| a == b).count()
}

struct Before<'a> {
    parse: &'a Parse,
    root: SyntaxNode,
    old: &'a str,
    new: &'a str,
    edit: ReplacedText,
}

/// A token of the old tree where the parser looked for the next item, and had reported no error.
struct ItemBoundary {
    offset: usize,
    begins_line: bool,
    /// The offset of the previous token, if any.
    previous: Option<usize>,
    /// The index of the list's child that begins with it.
    index: usize,
}

impl Before<'_> {
    // One token

    fn token(&self) -> Option<Parse> {
        let ReplacedText { start, old_end, new_end } = self.edit;
        // From a token that the lexer had finished before it read the edit, or that contains the edit, to the next
        // significant token behind it.
        let from = self.finished()?;
        let lexed =
            |text, end| lex_from(text, &[], from, 16, |kind, start| start >= end && !kind.is_trivia());
        let (old, new) = (lexed(self.old, old_end), lexed(self.new, new_end));
        let is_same = |index| old.begins_line(index) == new.begins_line(index);
        if old.kinds() != new.kinds() || old.errors() != new.errors() || !(0..old.len()).all(is_same) {
            return None;
        }
        let holds =
            |lexed: &Lexed, index, end| lexed.range(index).start <= start && end <= lexed.range(index).end;
        let index =
            (0..old.len()).find(|&index| holds(&old, index, old_end) && holds(&new, index, new_end))?;
        let is_shifted = |later| self.edit.shifted(old.range(later).start) == new.range(later).start;
        if !(0..=index).all(|earlier| old.range(earlier).start == new.range(earlier).start)
            || !(index + 1..=old.len()).all(is_shifted)
        {
            return None;
        }
        let range = old.range(index);
        if !self.errors(range.start..range.end).is_empty() {
            return None;
        }
        let is_characters = old.kind(index) == ERROR_CHARACTERS;
        let words = (self.old.get(range.clone())?, self.new.get(new.range(index))?);
        if is_characters || old.kind(index) == IDENT && !parser::reads_alike(words.0, words.1) {
            return None;
        }
        let token = self.root.covering_element(text_range(range.clone())).into_token()?;
        if token.text_range() != text_range(range.clone()) {
            return None;
        }
        let text = self.new.get(new.range(index))?;
        let green = token.replace_with(GreenToken::new(Mauve::kind_to_raw(token.kind()), text));
        Some(self.parse_of(green, range, Vec::new()))
    }

    /// Returns the start of the token that the lexer had finished before it read the edit, or that contains the edit.
    fn finished(&self) -> Option<usize> {
        match self.edit.start.checked_sub(LEXER_AHEAD) {
            Some(at) => Some(self.root.covering_element(empty(at)).into_token()?.text_range().start().into()),
            None => Some(0),
        }
    }

    // White space and comments between two tokens

    fn trivia(&self) -> Option<Parse> {
        let ReplacedText { start, old_end, .. } = self.edit;
        let first = match self.root.covering_element(empty(start)) {
            NodeOrToken::Token(token) => token,
            NodeOrToken::Node(node) => node.first_token()?,
        };
        let before = std::iter::successors(Some(first), SyntaxToken::prev_token);
        let before = before.into_iter().find(|token| !token.kind().is_trivia());
        let (last, end) = before.as_ref().map_or((0, 0), |token| bounds(token.text_range()));
        let from = last.min(self.finished()?);
        // Without trivia in the old text, only the parser knows their position in the tree.
        let next = match &before {
            Some(token) => token.next_token(),
            None => self.root.first_token(),
        };
        let gap =
            std::iter::successors(next, SyntaxToken::next_token).take_while(|token| token.kind().is_trivia());
        let gap: Vec<SyntaxToken> = gap.collect();
        let behind = bounds(gap.last()?.text_range()).1;
        let parent = gap.first()?.parent()?;
        let is_in_one_row = gap.iter().enumerate().all(|(index, token)| {
            token.parent().as_ref() == Some(&parent)
                && Some(token.index()) == gap.first().map(|it| it.index() + index)
        });
        if end > start || old_end > behind || !is_in_one_row || !self.errors(end..behind + 1).is_empty() {
            return None;
        }
        // Up to and including the next token.
        let lexed = |text, end| {
            let mut is_behind = false;
            lex_from(text, &[], from, 16, |kind, start| {
                std::mem::replace(&mut is_behind, start >= end && !kind.is_trivia())
            })
        };
        let new_behind = self.edit.shifted(behind);
        let (old, new) = (lexed(self.old, behind), lexed(self.new, new_behind));
        let solid = |lexed: &Lexed| {
            let solid = (0..lexed.len()).filter(|&index| !lexed.kind(index).is_trivia());
            solid
                .map(|index| (lexed.kind(index), lexed.range(index), lexed.begins_line(index)))
                .collect::<Vec<_>>()
        };
        let mut expected = solid(&old);
        for (_, range, _) in expected.iter_mut().filter(|(_, range, _)| range.start >= behind) {
            *range = self.edit.shifted(range.start)..self.edit.shifted(range.end);
        }
        // An unclosed comment and stray characters are errors of the text.
        if solid(&new) != expected || !old.errors().is_empty() || !new.errors().is_empty() {
            return None;
        }
        let is_between = |&index: &usize| {
            new.kind(index).is_trivia() && (end..new_behind).contains(&new.range(index).start)
        };
        let between = (0..new.len()).filter(is_between);
        let between: Option<Vec<_>> = between
            .map(|index| {
                let text = self.new.get(new.range(index))?;
                Some(NodeOrToken::Token(GreenToken::new(Mauve::kind_to_raw(new.kind(index)), text)))
            })
            .collect();
        let at = gap.first()?.index();
        let green = parent.green();
        let children = green.children().take(at).map(|child| child.to_owned());
        let rest = green.children().skip(at + gap.len()).map(|child| child.to_owned());
        let children: Vec<_> = children.chain(between?).chain(rest).collect();
        let green = parent.replace_with(GreenNode::new(green.kind(), children));
        Some(self.parse_of(green, end..behind, Vec::new()))
    }

    // Some items of a list

    fn items(&self) -> Option<Parse> {
        let covering = self.root.covering_element(text_range(self.edit.start..self.edit.old_end));
        let innermost = match covering {
            NodeOrToken::Node(node) => Some(node),
            NodeOrToken::Token(token) => token.parent(),
        };
        innermost?.ancestors().find_map(|node| self.items_of(&node))
    }

    fn items_of(&self, list: &SyntaxNode) -> Option<Parse> {
        item_keywords(list.kind())?;
        let from = self.last_before(list)?;
        let until = self.first_behind(list, from.offset)?;
        let new_offset = |until: &ItemBoundary| self.edit.shifted(until.offset);
        let last = new_offset(until.last()?);
        // The parser must examine the same tokens after the items as in the whole text.
        let mut behind = 0;
        let lexed = lex_from(self.new, &[], from.previous.unwrap_or(0), 256, |kind, start| {
            behind += usize::from(start >= last && !kind.is_trivia());
            behind > AHEAD
        });
        let kinds = list.ancestors().map(|node| node.kind());
        let mut lists: Vec<_> = kinds.filter(|kind| item_keywords(*kind).is_some()).collect();
        lists.reverse();
        let mut parser = Parser::resume(self.new, &lexed, from.offset, lists, depth(list));
        let root = parser.start();
        // An error at the previous token makes no difference: the old text has no error here.
        let arrived = |parser: &Parser<'_>| {
            let is_here = |until: &&ItemBoundary| {
                new_offset(until) == parser.offset() && until.begins_line == parser.begins_line()
            };
            until.iter().find(is_here)
        };
        if !grammar::items(&mut parser, list.kind(), |parser| arrived(parser).is_some()) {
            return None;
        }
        let until = arrived(&parser)?;
        parser.rest();
        root.complete(&mut parser, SOURCE_FILE);
        // The rules of enclosing lists report what is missing at the end of the text.
        if comment_error(&lexed).is_some() {
            return None;
        }
        let part = tree::build(self.new, &lexed, parser.finish());
        let green = list.green();
        let replaced = green.children().take(until.index).skip(from.index);
        // The allowed positions of an `include` depend on all preceding items.
        let is_include = |kind| kind == Mauve::kind_to_raw(INCLUDE);
        if list.kind() == SOURCE_FILE
            && replaced.chain(part.green.children()).any(|child| is_include(child.kind()))
        {
            return None;
        }
        let children = green.children().take(from.index);
        let children = children.chain(part.green.children()).chain(green.children().skip(until.index));
        let children: Vec<_> = children.map(|child| child.to_owned()).collect();
        let green = list.replace_with(GreenNode::new(green.kind(), children));
        Some(self.parse_of(green, from.offset..until.offset, part.errors.to_vec()))
    }

    /// Returns the last item of `list` whose first tokens the edit does not touch.
    fn last_before(&self, list: &SyntaxNode) -> Option<ItemBoundary> {
        let open = opening(list)?;
        let start = self.edit.start;
        let mut element = list.child_or_token_at_range(empty(start));
        while let Some(child) = element {
            let offset = usize::from(child.text_range().start());
            if offset < open || start - offset > self.old.len() / 2 {
                return None;
            }
            if child.kind() != ERROR && child.as_node().is_some() && self.are_ahead(offset) {
                // Includes the previous token, which is the same in both texts.
                let boundary = self.boundary(offset, child.index());
                if boundary.is_some() {
                    return boundary;
                }
            }
            element = child.prev_sibling_or_token();
        }
        None
    }

    /// Returns whether the edit touches none of the tokens that the parser examines at `offset`.
    fn are_ahead(&self, offset: usize) -> bool {
        let mut left = AHEAD + 1;
        let lexed = lex_from(self.new, &[], offset, 8, |kind, start| {
            left -= usize::from(!kind.is_trivia());
            left == 0 || start >= self.edit.start
        });
        left == 0 && lexed.range(lexed.len()).start + LEXER_AHEAD <= self.edit.start
    }

    /// Returns the first few positions behind the edit where an item of `list` begins or the list ends.
    fn first_behind(&self, list: &SyntaxNode, from: usize) -> Option<Vec<ItemBoundary>> {
        let open = opening(list)?;
        let mut found = Vec::new();
        let mut element = list.child_or_token_at_range(empty(self.edit.old_end));
        let mut index = 0;
        while let Some(child) = element {
            let offset = usize::from(child.text_range().start());
            if offset.saturating_sub(from) > self.old.len() / 2 {
                return Some(found);
            }
            let may_be = match &child {
                NodeOrToken::Node(node) => node.kind() != ERROR,
                NodeOrToken::Token(token) => token.kind() == R_CURLY,
            };
            if may_be && offset >= open && offset >= self.edit.old_end {
                found.extend(self.boundary(offset, child.index()));
                if found.len() == TRIED {
                    return Some(found);
                }
            }
            index = child.index() + 1;
            element = child.next_sibling_or_token();
        }
        if list.kind() == SOURCE_FILE {
            found.extend(self.boundary(self.old.len(), index));
        }
        Some(found)
    }

    /// Returns the token at `offset`, unless an error was reported there, or was suppressed as a second one.
    fn boundary(&self, offset: usize, index: usize) -> Option<ItemBoundary> {
        let mut begins_line = false;
        let mut at = offset;
        let previous = loop {
            if at == 0 {
                begins_line = true;
                break None;
            }
            // The token that ends here, or the mark of a missing token.
            let token = self.root.covering_element(empty(at)).into_token()?;
            at = token.text_range().start().into();
            match token.kind() {
                // Errors in the text that it hides are suppressed.
                UNTERMINATED_STRING => return None,
                // Only the first comma between items is reported.
                COMMA => return None,
                LINE_COMMENT => {}
                kind if kind.is_trivia() => begins_line |= token.text().contains(['\n', '\r']),
                _ => break Some(token.text_range()),
            }
        };
        let end = previous.map_or(0, |range| range.end().into());
        if !self.errors(end..offset + 1).is_empty() {
            return None;
        }
        let begins_line = begins_line || offset == self.old.len();
        Some(ItemBoundary {
            offset,
            begins_line,
            previous: previous.map(|range| range.start().into()),
            index,
        })
    }

    // Errors

    fn errors(&self, range: std::ops::Range<usize>) -> &[SyntaxError] {
        let errors = self.parse.errors();
        let first = errors.partition_point(|error| usize::from(error.range.start()) < range.start);
        let last = errors.partition_point(|error| usize::from(error.range.start()) < range.end);
        errors.get(first..last).unwrap_or_default()
    }

    /// Returns a tree with its errors: `errors` replaces those that started in `replaced`, and those behind it are
    /// shifted.
    fn parse_of(
        &self,
        green: GreenNode,
        replaced: std::ops::Range<usize>,
        errors: Vec<SyntaxError>,
    ) -> Parse {
        let shifted = |offset: TextSize| TextSize::new(self.edit.shifted(offset.into()) as u32);
        let later = self.errors(replaced.end..usize::MAX).iter().map(|error| SyntaxError {
            range: TextRange::new(shifted(error.range.start()), shifted(error.range.end())),
            kind: error.kind,
        });
        let earlier = self.errors(0..replaced.start).iter().copied();
        Parse { green, errors: earlier.chain(errors).chain(later).collect() }
    }
}

/// Returns the offset where the first item of a list may begin.
fn opening(list: &SyntaxNode) -> Option<usize> {
    if list.kind() == SOURCE_FILE {
        return Some(0);
    }
    let open = list.children_with_tokens().find(|child| child.kind() == L_CURLY)?;
    Some(open.text_range().end().into())
}

/// Returns the parser's `depth` in a list: the number of enclosing blocks and `else if`.
fn depth(list: &SyntaxNode) -> u32 {
    let is_deeper = |node: &SyntaxNode| match node.kind() {
        BLOCK => true,
        IF_STATEMENT => node.parent().is_some_and(|parent| parent.kind() == ELSE),
        _ => false,
    };
    list.ancestors().filter(is_deeper).count() as u32
}

fn bounds(range: TextRange) -> (usize, usize) {
    (range.start().into(), range.end().into())
}

fn empty(offset: usize) -> TextRange {
    TextRange::empty(TextSize::new(offset as u32))
}

fn text_range(range: std::ops::Range<usize>) -> TextRange {
    TextRange::new(TextSize::new(range.start as u32), TextSize::new(range.end as u32))
}
