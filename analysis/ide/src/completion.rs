//! Completion at the cursor: the grammar determines the kinds of items, then names and types select among them.
//!
//! | file | content |
//! |---|---|
//! | `at_cursor.rs` | the items at the cursor, in all projects |
//! | `declaration.rs` | declarations, their keywords, and `use` |
//! | `include.rs` | the paths of models |
//! | `names.rs` | types, messages and declarations, with the necessary `use` |
//! | `shell.rs`, `core.rs` | items of a shell; of a core, its state machine and its states |
//! | `program.rs` | statements and expressions |
//! | `architecture.rs`, `deployment.rs` | instances and their settings |
//! | `toml.rs` | keys and values of `mauve.toml` and of timing tables |
//! | `documentation.rs` | the documentation of a selected item |

mod architecture;
mod at_cursor;
mod core;
mod declaration;
mod deployment;
mod documentation;
mod include;
mod names;
mod program;
mod shell;
mod toml;

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, File, ModelDb, Project, declaration_at};
use mauve_syntax::ast::AstNode;
use mauve_syntax::format::Replacement;
use mauve_syntax::{SyntaxKind, SyntaxToken, TextRange};

pub use at_cursor::completions;
pub use documentation::{Subject, documentation};
pub(crate) use documentation::{comment, subject};

use crate::position::{Position, without_path};
use crate::program::CursorScope;

/// The items at a position.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Completions {
    /// The best item first.
    pub items: Vec<Completion>,
    /// Whether another letter may bring other items.
    pub incomplete: bool,
}

/// An item that may be inserted at a position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Completion {
    /// The text in the list.
    pub label: String,
    /// The kind of the item.
    pub kind: CompletionKind,
    /// The text after the label: `: double`, `(in scan: LaserScan): bool`. May be empty.
    pub detail: String,
    /// The origin or a property of the item. May be empty.
    pub note: String,
    /// The replaced range: the word around the cursor, on one line.
    pub replaced: TextRange,
    /// The inserted text.
    pub insert: String,
    /// The same text with placeholders, in the syntax of the protocol's snippets.
    pub snippet: Option<String>,
    /// The text that is compared with the typed word, if it is not the label.
    pub filter: Option<String>,
    /// 0 is the best rank.
    pub rank: u8,
    /// Other changes to the file: a `use`.
    pub more: Vec<Replacement>,
    /// The subject of its documentation, for [`documentation()`].
    pub subject: Option<Subject>,
}

/// The kind of an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)]
pub enum CompletionKind {
    Keyword,
    /// Several words or lines with placeholders.
    Skeleton,
    BuiltInType,
    Message,
    /// A library or a message package.
    Library,
    Codel,
    /// `read`, `write`, `status`, `send`, `collect`.
    BuiltIn,
    Shell,
    Core,
    Component,
    Architecture,
    Property,
    Constant,
    Port,
    Operation,
    Variable,
    State,
    Instance,
    Value,
    File,
    /// A key of a TOML file.
    Key,
}

impl Completion {
    pub(crate) fn new(kind: CompletionKind, label: impl Into<String>) -> Completion {
        let label = label.into();
        Completion {
            insert: label.clone(),
            label,
            kind,
            detail: String::new(),
            note: String::new(),
            replaced: TextRange::default(),
            snippet: None,
            filter: None,
            rank: 1,
            more: Vec::new(),
            subject: None,
        }
    }

    pub(crate) fn detail(mut self, detail: impl Into<String>) -> Completion {
        self.detail = detail.into();
        self
    }

    pub(crate) fn note(mut self, note: impl Into<String>) -> Completion {
        self.note = note.into();
        self
    }

    pub(crate) fn rank(mut self, rank: u8) -> Completion {
        self.rank = rank;
        self
    }

    pub(crate) fn insert(mut self, text: impl Into<String>) -> Completion {
        self.insert = text.into();
        self
    }

    pub(crate) fn snippet(mut self, snippet: impl Into<String>) -> Completion {
        let snippet = snippet.into();
        self.insert = plain(&snippet);
        self.snippet = Some(snippet);
        self
    }

    /// Adds a snippet, unless its text already follows the cursor.
    pub(crate) fn completed(self, is_followed: bool, snippet: String) -> Completion {
        if is_followed { self } else { self.snippet(snippet) }
    }

    pub(crate) fn subject(mut self, subject: Subject) -> Completion {
        self.subject = Some(subject);
        self
    }
}

/// Returns a snippet without placeholders: their default texts stay, and a step of indentation is two spaces.
fn plain(snippet: &str) -> String {
    let mut out = String::with_capacity(snippet.len());
    let mut rest = snippet;
    while let Some((head, tail)) = rest.split_once('$') {
        out += head;
        let digits = |text: &str| text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
        if let Some(place) = tail.strip_prefix('{') {
            let (inner, after) = place.split_once('}').unwrap_or((place, ""));
            out += inner.split_once(':').map_or("", |(_, proposed)| proposed);
            rest = after;
        } else {
            rest = tail.get(digits(tail)..).unwrap_or_default();
        }
    }
    (out + rest).replace('\t', "  ")
}

/// Returns whether `name` contains the letters of `typed`, in this order.
pub(crate) fn may_be(typed: &str, name: &str) -> bool {
    let mut letters = name.chars().map(|letter| letter.to_ascii_lowercase());
    typed.chars().all(|typed| letters.any(|letter| letter == typed.to_ascii_lowercase()))
}

pub(crate) struct Completer<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    at: &'a Position,
    decl: Option<Decl<'db>>,
    library: Option<Name>,
    found: Vec<Completion>,
    incomplete: bool,
}

impl<'a, 'db> Completer<'a, 'db> {
    fn new(db: &'db dyn ModelDb, project: Project<'db>, file: File, at: &'a Position) -> Self {
        let library = at.around(SyntaxKind::LIBRARY);
        let name =
            library.and_then(|library| library.children().find(|node| node.kind() == SyntaxKind::NAME));
        let library = name.map(|name| name.text().to_string().into());
        let decl = at.left.as_ref().and_then(|left| declaration_at(db, file, left.text_range()));
        Completer { db, project, file, at, decl, library, found: Vec::new(), incomplete: false }
    }

    fn complete(&mut self) {
        let (rest, path) = without_path(&self.at.item);
        let kinds: Vec<SyntaxKind> = rest.iter().map(SyntaxToken::kind).collect();
        match self.at.list.kind() {
            SyntaxKind::SHELL => self.shell_item(&kinds, &path),
            SyntaxKind::CORE => self.core_item(&kinds, &path),
            SyntaxKind::STATE_MACHINE => self.state_machine_item(&kinds, &path),
            SyntaxKind::STATE => self.state_item(),
            SyntaxKind::BLOCK => self.statement(&kinds, &path),
            SyntaxKind::ARCHITECTURE => self.architecture_item(&kinds, &path),
            SyntaxKind::DEPLOYMENT => self.deployment_item(&kinds, &path),
            SyntaxKind::ACTIVITY => self.activity_field(),
            _ => self.declaration(&kinds, &path),
        }
    }

    fn add(&mut self, item: Completion) {
        self.found.push(item);
    }

    fn keyword(&mut self, keyword: &str) {
        self.add(Completion::new(CompletionKind::Keyword, keyword));
    }

    fn skeleton(&mut self, keyword: &str, snippet: &str) {
        let shown = plain(snippet).split_whitespace().collect::<Vec<_>>().join(" ");
        self.add(Completion::new(CompletionKind::Skeleton, keyword).snippet(snippet).note(shown));
    }

    /// Returns the texts of these names, except the one at the cursor.
    fn others<N: AstNode>(&self, names: impl Iterator<Item = N>) -> Vec<String> {
        let others = names.filter(|name| name.syntax().text_range() != self.at.word);
        others.map(|name| name.syntax().text().to_string()).collect()
    }

    fn scope(&self) -> CursorScope<'db> {
        CursorScope::at(self.db, self.project, self.decl, self.at)
    }
}

#[cfg(test)]
mod testing {
    use super::at_cursor::MOST_ITEMS;
    use super::*;
    use crate::fixture::{Fixture, project_of};
    use std::fmt::Write as _;

    /// Returns the first items at the cursor whose rank is at most the best one plus `most`, each with its rank, and
    /// its inserted text if that is not the label.
    pub(super) fn offered(fixture: &str, most: u8) -> String {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        let mut out = String::new();
        let found = completions(&db, project_of(&db, workspace, file), file, offset);
        for item in found.items.iter().filter(|item| item.rank <= most) {
            let _ = write!(out, "{} {}{}", item.rank, item.label, item.detail);
            if !item.note.is_empty() {
                let _ = write!(out, " ({})", item.note);
            }
            let insert = item.snippet.as_ref().unwrap_or(&item.insert);
            if *insert != item.label {
                let _ = write!(out, " ⇒ {insert:?}");
            }
            for more in &item.more {
                let _ = write!(out, " + {:?} at {:?}", more.text, more.range.start());
            }
            out.push('\n');
        }
        out
    }

    /// Returns the labels of all items.
    pub(super) fn labels(fixture: &str) -> Vec<String> {
        let Fixture { db, workspace, file, offset } = Fixture::new(fixture);
        completions(&db, project_of(&db, workspace, file), file, offset)
            .items
            .into_iter()
            .map(|item| item.label)
            .collect()
    }

    #[test]
    fn nothing_is_offered_in_comments_strings_and_numbers() {
        for text in [
            "// cod$0",
            "codel f(): int // co$0\n",
            "/* $0 */",
            "/* co$0",
            "deployment D { activity a { priority = 1$0 } }",
            "deployment D { property a.b = \"$0\" }",
            "deployment D { property a.b = \"x$0",
        ] {
            assert_eq!(labels(text), [] as [&str; 0], "{text}");
        }
        assert!(labels("/* é 🦀 */ $0").contains(&"codel".to_owned()));
    }

    #[test]
    fn the_word_around_the_cursor_is_replaced() {
        for (text, replaced) in [
            ("/* 🦀 é */ co$0del", "codel"),
            ("/* é */ $0codel", ""),
            ("core C(S) { statemachine { state Idle { /* é */ transition t to Id$0le } } }", "Idle"),
        ] {
            let Fixture { db, workspace, file, offset } = Fixture::new(text);
            let found = completions(&db, project_of(&db, workspace, file), file, offset);
            let first = found.items.first().map(|item| &file.text(&db)[item.replaced]);
            assert_eq!(first, Some(replaced), "{text}");
        }
    }

    #[test]
    fn a_plain_client_gets_what_a_snippet_proposes() {
        assert_eq!(plain("if (${1:true}) then {\n\t$0\n} else {\n}"), "if (true) then {\n  \n} else {\n}");
        assert_eq!(plain("f($1, $2)$0"), "f(, )");
        assert_eq!(plain("cost: 5$"), "cost: 5");
    }

    #[test]
    fn more_than_can_be_read_is_cut_and_asked_for_again() {
        let codels: String = (0..MOST_ITEMS + 10).map(|index| format!("codel f{index}(): void\n")).collect();
        let text = |typed: &str| format!("{codels} shell S {{}} core C(S) {{ update = {{ {typed}$0 }} }}");
        let Fixture { db, workspace, file, offset } = Fixture::new(&text(""));
        let found = completions(&db, project_of(&db, workspace, file), file, offset);
        assert_eq!((found.items.len(), found.incomplete), (MOST_ITEMS, true));
        assert!(labels(&text("f409")).contains(&"f409".to_owned()));
    }
}
