//! The parser that the grammar's rules use: look-ahead, markers, errors, recovery and the depth limit.

use rowan::{TextRange, TextSize};

use crate::SyntaxKind::{self, *};
use crate::error::{Expected, SyntaxError, SyntaxErrorKind, TokenError};
use crate::foreign::{self, Foreign, ForeignWord};
use crate::keywords::ActivityField;
use crate::lexer::{self, Lexed};

/// The deepest nesting of blocks, parentheses, operators and `else if`. A tree is dropped recursively, and all
/// traversals recurse: a stack overflow cannot be caught.
pub const DEEPEST: u32 = 256;

/// The parser: non-trivia tokens in, events out.
pub(crate) struct Parser<'a> {
    text: &'a str,
    lexed: &'a Lexed,
    kinds: Vec<SyntaxKind>,
    /// For each of `kinds`, its index in `lexed`.
    tokens: Vec<u32>,
    /// The first token of `lexed` that is part of the tree.
    first: usize,
    position: usize,
    events: Vec<ParseEvent>,
    errors: Vec<SyntaxError>,
    /// The token of the last error. A second error there is the same mistake, and is not reported.
    last_error: Option<usize>,
    /// The number of errors, including suppressed ones.
    found: usize,
    next_lex_error: usize,
    /// The open lists, the innermost last.
    lists: Vec<SyntaxKind>,
    pub(crate) depth: u32,
    /// In a condition, `=` is a comparison.
    pub(crate) in_condition: bool,
    /// In the value of a rate, a number may have the unit `Hz`.
    pub(crate) may_have_hertz: bool,
}

/// A state of the parser to which it can return.
pub(crate) struct Checkpoint {
    position: usize,
    events: usize,
    errors: usize,
    last_error: Option<usize>,
    found: usize,
    next_lex_error: usize,
}

/// An action of a rule, from which the tree is built.
#[derive(Debug)]
pub(crate) enum ParseEvent {
    /// A node starts. `parent` is the distance to the `Start` of a node that was wrapped around it later.
    Start { kind: SyntaxKind, parent: Option<u32> },
    /// The innermost open node ends.
    Finish,
    /// The next token, with the kind `kind`.
    Token { kind: SyntaxKind },
    /// The trivia at the end of the file.
    Rest,
    /// A start that was already added to the tree.
    Taken,
}

pub(crate) struct Events {
    pub(crate) first: usize,
    pub(crate) events: Vec<ParseEvent>,
    pub(crate) errors: Vec<SyntaxError>,
}

impl<'a> Parser<'a> {
    pub(crate) fn new(text: &'a str, lexed: &'a Lexed) -> Parser<'a> {
        let mut kinds = Vec::with_capacity(lexed.len() / 2 + 1);
        let mut tokens = Vec::with_capacity(lexed.len() / 2 + 1);
        for (index, &kind) in lexed.kinds().iter().enumerate() {
            if !kind.is_trivia() {
                kinds.push(kind);
                tokens.push(index as u32);
            }
        }
        Parser {
            text,
            lexed,
            events: Vec::with_capacity(kinds.len() * 3),
            kinds,
            tokens,
            first: 0,
            position: 0,
            errors: Vec::new(),
            last_error: None,
            found: 0,
            next_lex_error: 0,
            lists: Vec::new(),
            depth: 0,
            in_condition: false,
            may_have_hertz: false,
        }
    }

    /// Returns a parser at the token at `offset`, with the open `lists`, the innermost last, and the depth `depth`. It
    /// has reported no error at this token. `lexed` begins with the previous token, or with the text.
    pub(crate) fn resume(
        text: &'a str,
        lexed: &'a Lexed,
        offset: usize,
        lists: Vec<SyntaxKind>,
        depth: u32,
    ) -> Parser<'a> {
        let mut parser = Parser::new(text, lexed);
        parser.position = parser.tokens.partition_point(|&token| lexed.range(token as usize).start < offset);
        parser.first = parser.tokens.get(parser.position).map_or(lexed.len(), |&token| token as usize);
        parser.next_lex_error = lexed.errors().partition_point(|&(token, _)| (token as usize) < parser.first);
        parser.lists = lists;
        parser.depth = depth;
        parser
    }

    pub(crate) fn finish(mut self) -> Events {
        self.errors.extend(comment_error(self.lexed));
        self.errors.extend(self.lexed.conflicts(self.text));
        self.errors.sort_by_key(|error| error.range.start());
        Events { first: self.first, events: self.events, errors: self.errors }
    }

    // Looking ahead

    #[inline]
    pub(crate) fn current(&self) -> SyntaxKind {
        self.nth(0)
    }

    #[inline]
    pub(crate) fn nth(&self, n: usize) -> SyntaxKind {
        self.kinds.get(self.position + n).copied().unwrap_or(EOF)
    }

    #[inline]
    pub(crate) fn at(&self, kind: SyntaxKind) -> bool {
        self.current() == kind
    }

    #[inline]
    pub(crate) fn at_end(&self) -> bool {
        self.position >= self.kinds.len()
    }

    pub(crate) fn previous(&self) -> SyntaxKind {
        self.position.checked_sub(1).and_then(|position| self.kinds.get(position)).copied().unwrap_or(EOF)
    }

    /// Returns whether the current token is the first one of its line.
    #[inline]
    pub(crate) fn begins_line(&self) -> bool {
        self.nth_begins_line(0)
    }

    pub(crate) fn nth_begins_line(&self, n: usize) -> bool {
        self.tokens.get(self.position + n).is_none_or(|&token| self.lexed.begins_line(token as usize))
    }

    pub(crate) fn offset(&self) -> usize {
        self.range_of(self.position).start().into()
    }

    /// Returns whether an item of the list begins here, judged by its first tokens.
    ///
    /// `whole` requires more of these tokens: enough to exclude items of lists nested in this one.
    fn item_of(&self, list: SyntaxKind, whole: bool) -> bool {
        let next = self.nth(1);
        let named = |follows: &[SyntaxKind]| next.is_word() && follows.contains(&self.nth(2));
        match list {
            SOURCE_FILE => match self.current() {
                INCLUDE_KW => matches!(next, STRING | UNTERMINATED_STRING),
                LIBRARY_KW => named(&[L_CURLY]),
                _ => self.item_of(LIBRARY, whole),
            },
            LIBRARY => match self.current() {
                USE_KW => next.is_word() && !self.nth_begins_line(1),
                CODEL_KW | CORE_KW | COMPONENT_KW => named(&[L_PAREN]),
                SHELL_KW => named(&[L_CURLY, EXTENDS_KW]),
                ARCHITECTURE_KW | DEPLOYMENT_KW => named(&[L_CURLY]),
                _ => false,
            },
            SHELL => match self.current() {
                CONSTANT_KW | PROPERTY_KW => named(&[COLON]),
                INPUT_KW | OUTPUT_KW => next == PORT_KW,
                REQUIRE_KW | PROVIDE_KW => named(&[L_PAREN]),
                _ => false,
            },
            CORE => match self.current() {
                VAR_KW | HANDLER_KW => named(&[COLON]),
                PROVIDE_KW => named(&[L_PAREN]),
                CONFIGURE_KW | START_KW | UPDATE_KW | STOP_KW | CLEANUP_KW => {
                    next == EQ && (!whole || self.nth(2) == L_CURLY)
                }
                STATEMACHINE_KW => next == L_CURLY,
                _ => false,
            },
            STATE_MACHINE => match self.current() {
                VAR_KW => named(&[COLON]),
                STATE_KW => named(&[L_CURLY]),
                INITIAL_KW => next == STATE_KW,
                _ => false,
            },
            STATE => match self.current() {
                ENTRY_KW | RUN_KW | HANDLE_KW | EXIT_KW => next == EQ && (!whole || self.nth(2) == L_CURLY),
                TRANSITION_KW => named(&[IF_KW, TO_KW]),
                _ => false,
            },
            ARCHITECTURE => match self.current() {
                IMPORT_KW => next.is_word() && !self.nth_begins_line(1),
                INSTANCE_KW => named(&[COLON]),
                CONNECTION_KW | OPERATION_KW | PROPERTY_KW | CONSTANT_KW => named(&[DOT]),
                _ => false,
            },
            DEPLOYMENT => match self.current() {
                ARCHITECTURE_KW => next.is_word() && !self.nth_begins_line(1) && self.nth(2) != L_CURLY,
                ACTIVITY_KW => named(&[L_CURLY]),
                PROPERTY_KW | CONSTANT_KW => named(&[DOT]),
                _ => false,
            },
            ACTIVITY => ActivityField::from_kind(self.current()).is_some() && next == EQ,
            _ => match self.current() {
                VAR_KW => named(&[COLON]),
                RETURN_KW => next.is_word() || matches!(next, SEMICOLON | INT_NUMBER | FLOAT_NUMBER | STRING),
                IF_KW => next.is_word() || matches!(next, L_PAREN | BANG | MINUS),
                kind => kind.is_word() && next == EQ && self.nth(2) != L_CURLY,
            },
        }
    }

    /// Returns whether this line begins an item of an enclosing list; the innermost list is then unclosed.
    pub(crate) fn at_outer_item(&self) -> bool {
        self.at_item() && !self.at_own_item()
    }

    /// Returns whether this line begins an item of any open list; it is then no name, type or expression.
    pub(crate) fn at_item(&self) -> bool {
        self.begins_line()
            && self.current().is_word()
            && match self.lists.split_last() {
                Some((&inner, outer)) => {
                    self.item_of(inner, false) || outer.iter().any(|&list| self.item_of(list, true))
                }
                None => false,
            }
    }

    /// Returns whether this word can be a name: any word can, unless it begins an item on a new line.
    pub(crate) fn at_name(&self) -> bool {
        self.current().is_word() && !self.at_item()
    }

    /// Returns whether an item of the innermost list begins here, at any position in the line.
    pub(crate) fn at_own_item(&self) -> bool {
        self.lists.last().is_some_and(|&list| self.item_of(list, false))
    }

    /// Returns whether an item of `list` begins here, at any position in the line.
    pub(crate) fn at_start_of(&self, list: SyntaxKind) -> bool {
        self.item_of(list, false)
    }

    /// Opens a list; [`Parser::leave`] closes it.
    pub(crate) fn enter(&mut self, list: SyntaxKind) {
        self.lists.push(list);
    }

    pub(crate) fn leave(&mut self) {
        self.lists.pop();
    }

    pub(crate) fn is_in(&self, list: SyntaxKind) -> bool {
        self.lists.contains(&list)
    }

    // Moving on

    pub(crate) fn start(&mut self) -> Marker {
        let position = self.events.len();
        self.events.push(ParseEvent::Start { kind: ERROR, parent: None });
        Marker { position }
    }

    pub(crate) fn bump(&mut self) {
        self.bump_as(self.current());
    }

    /// Takes the current token with the kind `kind`, for example a word as a name.
    pub(crate) fn bump_as(&mut self, kind: SyntaxKind) {
        if self.at_end() {
            return;
        }
        let broken = self.token_error();
        if let Some(error) = broken {
            self.error(SyntaxErrorKind::Token(error));
        }
        self.position += 1;
        self.events.push(ParseEvent::Token { kind });
        // A declaration or a block in the first text of a conflict is incomplete.
        if matches!(kind, CODEL_KW | COMPONENT_KW | L_CURLY | USE_KW)
            && self
                .tokens
                .get(self.position - 1)
                .is_some_and(|&token| self.lexed.is_in_conflict(token as usize))
        {
            self.mark();
        }
        if let Some(error) = broken {
            self.next_lex_error += 1;
            if error == TokenError::UnterminatedString {
                // The string may hide tokens such as `)`: a missing one would be a second error for the same mistake.
                self.last_error = Some(self.position);
            }
        }
    }

    fn token_error(&self) -> Option<TokenError> {
        let (at, error) = self.lexed.errors().get(self.next_lex_error)?;
        (self.tokens.get(self.position) == Some(at)).then_some(*error)
    }

    pub(crate) fn eat(&mut self, kind: SyntaxKind) -> bool {
        let found = self.at(kind);
        if found {
            self.bump();
        }
        found
    }

    /// Takes a token of the kind `kind`, or reports that it is missing.
    pub(crate) fn expect(&mut self, kind: SyntaxKind) -> bool {
        let found = self.eat(kind);
        if !found {
            self.missing(Expected::Token(kind));
        }
        found
    }

    /// An unterminated comment at the end of the file may hide items, so the tree is incomplete.
    pub(crate) fn unterminated_comment(&mut self) {
        if comment_error(self.lexed).is_some() {
            self.mark();
        }
    }

    /// Takes the white space and comments at the end of the file.
    pub(crate) fn rest(&mut self) {
        self.events.push(ParseEvent::Rest);
    }

    // Errors

    /// Reports a missing element, and marks the position in the tree.
    pub(crate) fn missing(&mut self, expected: Expected) {
        // After the previous token, where the user would type it, if the current token is on another line.
        if self.position > 0 && (self.at_end() || self.begins_line()) {
            let end = self.range_of(self.position - 1).end();
            let kind = SyntaxErrorKind::Expected { expected, found: None, similar: None };
            self.report(TextRange::empty(end), kind);
        } else {
            let found = Some(self.current());
            let kind = SyntaxErrorKind::Expected { expected, found, similar: None };
            self.report(self.range_of(self.position), kind);
        }
        self.mark();
    }

    /// Returns the text of the current token if it is a short word or number.
    pub(crate) fn word(&self) -> Option<&'a str> {
        let kind = self.current();
        let range: std::ops::Range<usize> = self.range_of(self.position).into();
        let text = self.text.get(range).filter(|text| text.len() <= 40);
        text.filter(|_| kind.is_word() || matches!(kind, INT_NUMBER | FLOAT_NUMBER))
    }

    /// Returns the text of the `n`th token after the current one if it is an identifier or not a token of the language.
    fn nth_text(&self, n: usize) -> Option<&'a str> {
        matches!(self.nth(n), IDENT | ERROR_CHARACTERS)
            .then(|| self.text.get(std::ops::Range::<usize>::from(self.range_of(self.position + n))))
            .flatten()
    }

    /// Returns the meaning of the `n`th token after the current one in other languages.
    pub(crate) fn nth_foreign(&self, n: usize) -> Option<ForeignWord> {
        foreign::meaning(self.nth_text(n).filter(|_| self.nth(n) == IDENT)?)
    }

    /// Returns whether the `n`th token after the current one is a word that other languages have instead of `kind`.
    pub(crate) fn nth_is_instead_of(&self, n: usize, kind: SyntaxKind) -> bool {
        self.nth_foreign(n) == Some(ForeignWord::InsteadOf(kind))
    }

    /// Returns whether the `n`th token after the current one marks a reference or a pointer: `&`, `*`.
    pub(crate) fn nth_is_reference(&self, n: usize) -> bool {
        matches!(self.nth(n), STAR | AMP2) || self.nth(n) == ERROR_CHARACTERS && self.nth_text(n) == Some("&")
    }

    /// Returns whether the current token, which is not a token of the language, has these characters.
    pub(crate) fn at_characters(&self, characters: &str) -> bool {
        self.at(ERROR_CHARACTERS) && self.nth_text(0) == Some(characters)
    }

    /// Returns whether this is the unit of a rate, on the line of its number.
    pub(crate) fn at_hertz(&self) -> bool {
        self.at(IDENT) && self.nth_text(0) == Some("Hz") && !self.begins_line()
    }

    /// Returns whether a type and then a name follow on this line, as in C.
    pub(crate) fn at_type_before_name(&self) -> bool {
        let is_name = self.nth(1).is_word() && !self.nth_begins_line(1) && !self.nth_looks_like_type(1);
        is_name && self.nth_looks_like_type(0)
    }

    pub(crate) fn nth_looks_like_type(&self, n: usize) -> bool {
        self.nth(n) == IDENT && self.nth_text(n).is_some_and(foreign::looks_like_type)
    }

    /// Returns the keyword that the current word writes with capital letters.
    pub(crate) fn in_lower_case(&self) -> Option<SyntaxKind> {
        lexer::in_lower_case(self.nth_text(0).filter(|_| self.at(IDENT))?)
    }

    /// Treats the current word, which was reported, as the keyword `kind`.
    pub(crate) fn read_as(&mut self, kind: SyntaxKind) {
        if let Some(current) = self.kinds.get_mut(self.position) {
            *current = kind;
        }
    }

    pub(crate) fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            position: self.position,
            events: self.events.len(),
            errors: self.errors.len(),
            last_error: self.last_error,
            found: self.found,
            next_lex_error: self.next_lex_error,
        }
    }

    /// Returns to a checkpoint in the same list, and discards all events and errors since then.
    pub(crate) fn rewind(&mut self, to: &Checkpoint) {
        self.position = to.position;
        self.events.truncate(to.events);
        self.errors.truncate(to.errors);
        self.last_error = to.last_error;
        self.found = to.found;
        self.next_lex_error = to.next_lex_error;
    }

    /// Returns whether an error was found since then.
    pub(crate) fn has_failed_since(&self, before: &Checkpoint) -> bool {
        self.found > before.found
    }

    /// Reports a form of another language at the current token, and marks it in the tree.
    pub(crate) fn foreign(&mut self, form: Foreign) {
        self.report_foreign(form);
        self.mark();
    }

    fn report_foreign(&mut self, form: Foreign) {
        self.found += 1;
        if self.last_error != Some(self.position) {
            self.last_error = Some(self.position);
            let range = self.range_of(self.position);
            self.errors.push(SyntaxError { range, kind: SyntaxErrorKind::Foreign(form) });
        }
    }

    /// Takes `count` tokens into an error node: they belong to an error that was already reported.
    pub(crate) fn drop_tokens(&mut self, count: usize) {
        if count == 0 {
            return;
        }
        let marker = self.start();
        for _ in 0..count {
            self.last_error = Some(self.position);
            self.bump();
        }
        marker.complete(self, ERROR);
    }

    /// Takes tokens, possibly none, up to `stop` as part of an error that was already reported.
    pub(crate) fn drop_until(&mut self, stop: impl Fn(&Parser<'_>) -> bool) {
        if self.at_end() || stop(self) {
            return;
        }
        self.last_error = Some(self.position);
        self.found += 1;
        self.skip_rest(stop);
    }

    /// Reports an error at the current token, and does not take the token.
    pub(crate) fn error(&mut self, kind: SyntaxErrorKind) {
        self.report(self.range_of(self.position), kind);
        self.mark();
    }

    /// Marks the open node as incomplete.
    fn mark(&mut self) {
        let marker = self.start();
        marker.complete(self, ERROR);
    }

    fn report(&mut self, range: TextRange, kind: SyntaxErrorKind) {
        self.found += 1;
        if self.last_error == Some(self.position) {
            return;
        }
        self.last_error = Some(self.position);
        if let Some(error) = self.token_error() {
            let range = self.range_of(self.position);
            self.errors.push(SyntaxError { range, kind: SyntaxErrorKind::Token(error) });
            return;
        }
        // After an unterminated comment, a missing element is the same mistake.
        let swallowed = self.at_end() && comment_error(self.lexed).is_some();
        if !swallowed {
            self.errors.push(SyntaxError { range, kind });
        }
    }

    fn range_of(&self, position: usize) -> TextRange {
        let range = match self.tokens.get(position) {
            Some(&token) => self.lexed.range(token as usize),
            None => self.lexed.range(self.lexed.len()),
        };
        TextRange::new(TextSize::new(range.start as u32), TextSize::new(range.end as u32))
    }

    /// Skips unexpected tokens into one error node: up to `stop`, but at least one token, and always complete pairs `{
    /// … }`, `( … )`, `[ … ]`.
    pub(crate) fn skip(&mut self, kind: SyntaxErrorKind, stop: impl Fn(&Parser<'_>) -> bool) {
        self.report(self.range_of(self.position), kind);
        self.skip_rest(stop);
    }

    /// Reports a form of another language, and skips tokens as [`Parser::skip`] does.
    pub(crate) fn skip_foreign(&mut self, form: Foreign, stop: impl Fn(&Parser<'_>) -> bool) {
        self.report_foreign(form);
        self.skip_rest(stop);
    }

    fn skip_rest(&mut self, stop: impl Fn(&Parser<'_>) -> bool) {
        let marker = self.start();
        loop {
            self.skip_balanced();
            if self.at_end() || stop(self) {
                break;
            }
        }
        // A mistake after the skipped tokens is a separate one.
        marker.complete(self, ERROR);
    }

    /// Takes one token, or all tokens from an opening bracket to its closing one, without nested nodes.
    fn skip_balanced(&mut self) {
        let mut open = 0usize;
        let mut has_braces = false;
        loop {
            has_braces |= self.at(L_CURLY);
            match self.current() {
                L_CURLY | L_PAREN | L_BRACK => open += 1,
                R_CURLY | R_PAREN | R_BRACK => open = open.saturating_sub(1),
                _ => {}
            }
            let from = self.position;
            // Errors inside skipped tokens are part of the reported error.
            self.last_error = Some(from);
            self.bump();
            if self.at_end() {
                if open > 0 {
                    // An unclosed bracket is part of the reported error.
                    self.last_error = Some(self.position);
                }
                return;
            }
            if open == 0 || self.position == from {
                return;
            }
            // Incomplete text: a declaration that begins a line is not skipped.
            if self.begins_line() && (self.item_of(SOURCE_FILE, true) || !has_braces && self.at_item()) {
                return;
            }
        }
    }

    /// Takes the rest of a construct that is too deep as tokens of one error node.
    pub(crate) fn too_deep(&mut self, stop: impl Fn(&Parser<'_>) -> bool) {
        self.skip(SyntaxErrorKind::TooDeep, stop);
    }
}

/// A node that has started and must be completed.
pub(crate) struct Marker {
    position: usize,
}

impl Marker {
    pub(crate) fn complete(self, p: &mut Parser<'_>, kind: SyntaxKind) -> CompletedMarker {
        if let Some(ParseEvent::Start { kind: slot, .. }) = p.events.get_mut(self.position) {
            *slot = kind;
        }
        p.events.push(ParseEvent::Finish);
        CompletedMarker { position: self.position }
    }
}

/// A complete node, which can still be wrapped.
pub(crate) struct CompletedMarker {
    position: usize,
}

impl CompletedMarker {
    pub(crate) fn precede(self, p: &mut Parser<'_>) -> Marker {
        let outer = p.start();
        let distance = (outer.position - self.position) as u32;
        if let Some(ParseEvent::Start { parent, .. }) = p.events.get_mut(self.position) {
            *parent = Some(distance);
        }
        outer
    }
}

/// Returns the error of an unterminated comment, which no rule of the grammar receives.
pub(crate) fn comment_error(lexed: &Lexed) -> Option<SyntaxError> {
    let (index, error) = lexed.errors().last()?;
    let range = lexed.range(*index as usize);
    // The range of the opening only: an error over the rest of the text would hide where the comment starts.
    let start = TextSize::new(range.start as u32);
    (*error == TokenError::UnterminatedComment).then(|| SyntaxError {
        range: TextRange::at(start, TextSize::new(2)),
        kind: SyntaxErrorKind::Token(*error),
    })
}

/// Returns whether the parser treats two words in the same way.
pub(crate) fn reads_alike(one: &str, other: &str) -> bool {
    let is_plain = |word| foreign::meaning(word).is_none() && lexer::in_lower_case(word).is_none();
    is_plain(one) && is_plain(other) && foreign::looks_like_type(one) == foreign::looks_like_type(other)
}
