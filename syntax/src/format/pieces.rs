//! Reads a tree as a list of tokens and comments, with the blocks and the errors around them.

use std::ops::Range;

use rowan::{NodeOrToken, TextRange, WalkEvent};

use super::lines::breaks;
use crate::SyntaxKind::{self, *};
use crate::conflict::{Region, regions};
use crate::{SyntaxNode, is_closed_comment};

/// A token or comment, with the properties that determine the gap before it. The last piece is the end of the text.
pub(super) struct Piece<'a> {
    pub(super) kind: SyntaxKind,
    pub(super) text: &'a str,
    pub(super) start: usize,
    pub(super) parent: SyntaxKind,
    pub(super) depth: usize,
    /// The list of the item that begins here, and whether a line break before it is allowed.
    pub(super) item: Option<(usize, bool)>,
    /// The list that this brace opens or closes, and for a closing brace, whether a line break before it is allowed.
    pub(super) brace: Option<(usize, bool)>,
    pub(super) is_separator: bool,
    pub(super) keep: Keep,
}

impl Piece<'_> {
    pub(super) fn end(&self) -> usize {
        self.start + self.text.len()
    }

    pub(super) fn is_comment(&self) -> bool {
        self.kind.is_trivia()
    }

    /// Returns whether this is a comment that continues to the end of the text.
    pub(super) fn is_unclosed(&self) -> bool {
        self.kind == BLOCK_COMMENT && !is_closed_comment(self.text)
    }
}

/// The part of a gap that is kept.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Keep {
    Nothing,
    /// The part up to the last line break: an error is before it.
    Breaks,
    All,
}

/// `{ … }`; the first list is the file.
pub(super) struct PieceList {
    pub(super) kind: SyntaxKind,
    pub(super) outer: usize,
    /// The first piece of the owner of the block, and the braces of the block.
    pub(super) owner: usize,
    pub(super) open: usize,
    pub(super) close: usize,
    /// Whether the list and its owner have no error.
    pub(super) whole: bool,
    /// Whether the last item so far has no error.
    last_whole: bool,
    pub(super) lines: bool,
}

impl PieceList {
    /// Returns the list of a node whose opening brace is the piece `open`.
    fn new(frame: &PieceFrame, outer: usize, open: usize) -> PieceList {
        let PieceFrame { kind, first: owner, whole, .. } = *frame;
        PieceList { kind, outer, owner, open, close: usize::MAX, whole, last_whole: true, lines: false }
    }
}

/// Returns the tokens and comments of a tree, and its blocks; the first one is the file.
pub(super) fn read<'a>(
    root: &SyntaxNode,
    text: &'a str,
    interrupt: &dyn Fn(),
) -> (Vec<Piece<'a>>, Vec<PieceList>) {
    let mut errors: Vec<TextRange> = Vec::new();
    let nodes = root.descendants().inspect(|_| interrupt());
    for node in nodes.filter(|node| node.kind() == ERROR) {
        let range = node.text_range();
        if errors.last().is_none_or(|last| last.end() <= range.start()) {
            errors.push(range);
        }
    }
    let pieces = Vec::with_capacity(text.len() / 6);
    let file = PieceFrame { kind: SOURCE_FILE, first: 0, whole: errors.is_empty(), list: None };
    let file = PieceList { lines: true, ..PieceList::new(&file, 0, 0) };
    let mut reader = PieceReader {
        text,
        errors,
        pieces,
        lists: vec![file],
        keep: Keep::Nothing,
        item: None,
        open: Vec::new(),
        conflicts: regions(text),
    };
    reader.walk(root, interrupt);
    (reader.pieces, reader.lists)
}

struct PieceReader<'a> {
    text: &'a str,
    /// The ranges of errors; they are not nested.
    errors: Vec<TextRange>,
    pieces: Vec<Piece<'a>>,
    lists: Vec<PieceList>,
    /// The minimal part of the next gap that is kept.
    keep: Keep,
    item: Option<(usize, bool)>,
    /// The enclosing lists, the innermost last.
    open: Vec<usize>,
    /// The lines of conflicts.
    conflicts: Vec<Region>,
}

struct PieceFrame {
    kind: SyntaxKind,
    first: usize,
    whole: bool,
    list: Option<usize>,
}

impl<'a> PieceReader<'a> {
    fn walk(&mut self, root: &SyntaxNode, interrupt: &dyn Fn()) {
        let mut frames: Vec<PieceFrame> = Vec::new();
        for event in root.preorder_with_tokens() {
            interrupt();
            match event {
                WalkEvent::Enter(NodeOrToken::Node(node)) => {
                    let whole = self.is_whole(node.text_range());
                    if let Some(list) = frames.last().and_then(|frame| frame.list) {
                        self.item =
                            (node.kind() != ERROR).then_some((list, whole && self.lists[list].last_whole));
                        self.lists[list].last_whole = whole;
                    }
                    if node.kind() == ERROR && node.text_range().is_empty() {
                        self.keep = self.keep.max(Keep::Breaks);
                    }
                    let list = (node.kind() == SOURCE_FILE).then_some(0);
                    frames.push(PieceFrame { kind: node.kind(), first: self.pieces.len(), whole, list });
                }
                WalkEvent::Leave(NodeOrToken::Node(_)) => {
                    let Some(frame) = frames.pop() else { continue };
                    self.item = None;
                    if frame.kind == ERROR && frame.first < self.pieces.len() {
                        // Includes the comments above.
                        let above = self.pieces[..frame.first].iter().rposition(|piece| !piece.is_comment());
                        self.keep_all(above.map_or(0, |above| above + 1)..self.pieces.len());
                        self.keep = self.keep.max(Keep::Breaks);
                    }
                    if let Some(list) = frame.list.filter(|_| frame.kind != SOURCE_FILE) {
                        // The block is not closed, so its end is unknown.
                        self.keep_all(self.lists[list].open + 1..self.pieces.len());
                        self.lists[list].close = self.pieces.len();
                        self.open.pop();
                    }
                }
                WalkEvent::Enter(NodeOrToken::Token(token)) => {
                    let range: Range<usize> = token.text_range().into();
                    if let Some(frame) = frames.last_mut() {
                        self.token(frame, token.kind(), range);
                    }
                }
                WalkEvent::Leave(NodeOrToken::Token(_)) => {}
            }
        }
        // A line break here would become part of the comment.
        if self.pieces.last().is_some_and(Piece::is_unclosed) {
            self.keep = Keep::All;
        }
        self.push(EOF, self.text.len()..self.text.len(), SOURCE_FILE);
    }

    fn token(&mut self, frame: &mut PieceFrame, kind: SyntaxKind, range: Range<usize>) {
        if kind == WHITESPACE {
            return;
        }
        let index = self.pieces.len();
        let mut brace = None;
        match (kind, frame.list) {
            (L_CURLY, None) if frame.kind != ERROR => {
                let list = PieceList::new(frame, *self.open.last().unwrap_or(&0), index);
                brace = Some((self.lists.len(), false));
                frame.list = Some(self.lists.len());
                self.open.push(self.lists.len());
                self.lists.push(list);
            }
            (R_CURLY, Some(list)) if frame.kind != ERROR => {
                brace = Some((list, self.lists[list].last_whole));
                frame.list = None;
                let open = self.pieces[self.lists[list].open].start;
                self.lists[list].close = index;
                self.lists[list].lines = breaks(self.text.get(open..range.start).unwrap_or_default()) > 0;
                self.open.pop();
            }
            _ => {}
        }
        self.push(kind, range, frame.kind);
        if let Some(piece) = self.pieces.last_mut() {
            piece.depth -= usize::from(kind == L_CURLY && brace.is_some());
            piece.brace = brace;
            piece.is_separator = kind == SEMICOLON && frame.list.is_some();
        }
    }

    fn push(&mut self, kind: SyntaxKind, range: Range<usize>, parent: SyntaxKind) {
        let (start, text) = (range.start, self.text.get(range).unwrap_or_default());
        let mut keep = std::mem::replace(&mut self.keep, Keep::Nothing);
        let gap = self.pieces.last().map_or(0, Piece::end);
        let conflict = self.conflicts.partition_point(|region| region.other.end < gap);
        if self.conflicts.get(conflict).is_some_and(|region| region.start.start <= start) {
            keep = Keep::All;
        }
        let item = if kind.is_trivia() { None } else { self.item.take() };
        self.pieces.push(Piece {
            kind,
            text,
            start,
            parent,
            depth: self.open.len(),
            item,
            brace: None,
            is_separator: false,
            keep,
        });
    }

    fn keep_all(&mut self, pieces: Range<usize>) {
        for piece in self.pieces.get_mut(pieces).unwrap_or_default() {
            piece.keep = Keep::All;
        }
    }

    /// Returns whether no error is in this range or at its ends.
    fn is_whole(&self, range: TextRange) -> bool {
        let next = self.errors.partition_point(|error| error.start() <= range.end());
        next.checked_sub(1)
            .and_then(|last| self.errors.get(last))
            .is_none_or(|error| error.end() < range.start())
    }
}
