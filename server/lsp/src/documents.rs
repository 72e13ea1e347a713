//! The documents that the client has open: copies of the client's texts.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use mauve_projects::address::{Home, file_of, path_of};
use mauve_projects::disk::text_of;
use mauve_projects::load::canonical_path;
use tower_lsp::lsp_types::{Position, Range, TextDocumentContentChangeEvent, TextDocumentItem, Url};

use super::position::Encoding;
use super::rope::Rope;

/// An open text.
#[derive(Debug)]
pub(crate) struct OpenDocument {
    /// Its path; a unique name if it is not a file.
    pub(crate) path: PathBuf,
    pub(crate) home: Home,
    /// The client's version number.
    pub(crate) version: i32,
    pub(crate) text: Rope,
    /// Why the text is unknown: a change could not be applied.
    pub(crate) problem: Option<String>,
    /// The time of the client's last change: of two texts of one file, the newer one is analysed.
    pub(crate) changed: Instant,
    /// The range of the text that the last change inserted, if it is that of one key.
    pub(crate) typed: Option<Range>,
    /// Whether it was not changed since it was opened or saved.
    pub(crate) is_saved: bool,
    /// Whether the database may have another text.
    pub(crate) is_dirty: bool,
}

/// Identifies a text of an open document. Clients may send two texts with one version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TextId {
    changed: Instant,
    pub(crate) version: i32,
}

/// The open documents, by their URIs.
#[derive(Debug, Default)]
pub(crate) struct Documents(pub(crate) BTreeMap<Url, OpenDocument>);

const LOST: &str = "mauve could not understand the editor's last message about this file, so its text is unknown: save the \
                    file, or close and open it";

/// Returns the message for a carriage return without a line feed; `line` counts from 1.
fn lone_return(line: usize) -> String {
    format!(
        "line {line} has a carriage return without a line feed: editors disagree whether it ends a line, so the text is \
         unknown after a change. Remove it and save the file"
    )
}

impl Documents {
    /// Opens a document, replacing an open one with the same URI.
    pub(crate) fn open(&mut self, document: TextDocumentItem) {
        let TextDocumentItem { uri, version, text, .. } = document;
        let (path, home) = path_of(&uri);
        if path.is_dir() {
            tracing::error!("{uri} is a folder");
            return;
        }
        if self.0.contains_key(&uri) {
            tracing::warn!("{uri} was already open");
        }
        // The URI of an unknown text may have been spelled differently.
        if let Some(address) =
            self.address(&uri).filter(|it| self.0.get(it).is_some_and(|it| it.problem.is_some()))
        {
            self.0.remove(&address);
        }
        self.0.insert(uri, OpenDocument::new(path, home, version, &text));
    }

    /// Returns the URI by which a document was opened: a URI has several spellings, such as `%41` for `A`.
    pub(crate) fn address(&self, uri: &Url) -> Option<Url> {
        if self.0.contains_key(uri) {
            return Some(uri.clone());
        }
        let path = file_of(uri)?;
        self.0.iter().find(|(_, open)| open.path == path).map(|(uri, _)| uri.clone())
    }

    /// Returns the document with a URI in any spelling.
    pub(crate) fn get(&self, uri: &Url) -> Option<&OpenDocument> {
        self.0.get(&self.address(uri)?)
    }

    /// Returns which text a document with a URI in any spelling has; none if it is not open.
    pub(crate) fn text_id(&self, uri: &Url) -> Option<TextId> {
        self.get(uri).map(|open| TextId { changed: open.changed, version: open.version })
    }

    /// Returns the files, with links resolved, whose text is unknown under one of their URIs, with the reasons.
    pub(crate) fn unknown(&self) -> BTreeMap<PathBuf, String> {
        let unknown = self.0.values().filter_map(|open| Some((open, open.problem.clone()?)));
        unknown.map(|(open, problem)| (canonical_path(&open.path), problem)).collect()
    }

    fn get_mut(&mut self, uri: &Url) -> Option<&mut OpenDocument> {
        let address = self.address(uri)?;
        self.0.get_mut(&address)
    }

    /// Applies the changes of one message, one after the other.
    pub(crate) fn change(
        &mut self,
        uri: &Url,
        version: i32,
        changes: impl IntoIterator<Item = TextDocumentContentChangeEvent>,
        encoding: Encoding,
    ) {
        if self.get(uri).is_none() {
            tracing::warn!("a change of {uri}, which is not open");
            self.lost(uri);
        }
        let Some(open) = self.get_mut(uri) else { return };
        if version <= open.version {
            // The changes are in order, whatever their versions.
            tracing::warn!("{uri}: version {version} after {}", open.version);
        }
        open.version = version;
        open.note_change();
        let changes: Vec<TextDocumentContentChangeEvent> = changes.into_iter().collect();
        open.typed = match changes.as_slice() {
            [change] => typed(change),
            _ => None,
        };
        for change in changes {
            // For tests: a defect.
            #[cfg(debug_assertions)]
            assert!(!change.text.contains("mauve/debug/panicMainLoop"), "asked for");
            match change.range {
                None => {
                    open.text = Rope::new(&change.text);
                    open.problem = None;
                }
                Some(range) => {
                    let (start, is_within) = open.text.place(range.start, encoding);
                    let (end, is_end_within) = open.text.place(range.end, encoding);
                    // Editors treat these line ends differently.
                    if let Some(line) = open.text.line_with_lone_return() {
                        open.problem = Some(lone_return(line));
                    } else if end < start || is_within || is_end_within {
                        open.problem = Some(LOST.to_owned());
                    }
                    open.text.replace(start, end.max(start), &change.text);
                }
            }
        }
    }

    /// Compares the copy with the text that the client has saved.
    pub(crate) fn saved(&mut self, uri: &Url, text: Option<String>) {
        let Some(open) = self.get_mut(uri) else { return };
        open.is_saved = true;
        let Some(text) = text else { return };
        if !open.text.is(&text) || open.problem.is_some() {
            tracing::error!("{uri}: the text differed from the client's");
            open.text = Rope::new(&text);
            open.problem = None;
            open.note_change();
            open.is_saved = true;
        }
    }

    /// Marks the text of a document as unknown after an invalid message about it, whether or not the document was
    /// open. The last known text, or the text on the disk, is used until the client sends a valid one. Ignores
    /// folders.
    pub(crate) fn lost(&mut self, uri: &Url) {
        let known = self.address(uri);
        if known.is_none() && path_of(uri).0.is_dir() {
            return;
        }
        let address = known.unwrap_or_else(|| uri.clone());
        let open = self.0.entry(address).or_insert_with(|| {
            let (path, home) = path_of(uri);
            let is_file = home == Home::File;
            let text = if is_file { text_of(&canonical_path(&path)).0 } else { String::new() };
            OpenDocument::new(path, home, 0, &text)
        });
        open.problem = Some(LOST.to_owned());
        open.note_change();
    }
}

impl OpenDocument {
    fn new(path: PathBuf, home: Home, version: i32, text: &str) -> OpenDocument {
        OpenDocument {
            path,
            home,
            version,
            text: Rope::new(text),
            problem: None,
            changed: Instant::now(),
            typed: None,
            is_saved: true,
            is_dirty: true,
        }
    }

    fn note_change(&mut self) {
        self.changed = Instant::now();
        self.is_saved = false;
        self.is_dirty = true;
    }
}

/// Returns the range of the text that a change inserts, if it is that of one key: a character, perhaps with the bracket that
/// closes it, or the removal of one.
fn typed(change: &TextDocumentContentChangeEvent) -> Option<Range> {
    let replaced = change.range?;
    let (line, start) = (replaced.start.line, replaced.start.character);
    let is_key = replaced.end.line == line && replaced.end.character <= start.saturating_add(1);
    let length = change.text.chars().count();
    (is_key && length <= 2 && !change.text.contains(['\n', '\r'])).then(|| {
        let end = Position::new(line, start.saturating_add(length as u32));
        Range::new(replaced.start, end)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn uri() -> Url {
        Url::parse("file:///robot/a.mal").unwrap()
    }

    fn opened(text: &str) -> Documents {
        let mut documents = Documents::default();
        documents.open(TextDocumentItem::new(uri(), "mauve".to_owned(), 1, text.to_owned()));
        documents
    }

    fn change(from: (u32, u32), to: (u32, u32), text: &str) -> TextDocumentContentChangeEvent {
        let range = Range::new(Position::new(from.0, from.1), Position::new(to.0, to.1));
        TextDocumentContentChangeEvent { range: Some(range), range_length: None, text: text.to_owned() }
    }

    #[test]
    fn changes_of_one_message_follow_each_other() {
        let mut documents = opened("one\ntwo\n");
        let changes = [change((0, 0), (0, 3), "1"), change((0, 1), (1, 0), ""), change((9, 0), (9, 9), "!")];
        documents.change(&uri(), 2, changes, Encoding::Utf16);
        assert_eq!(documents.0[&uri()].text.text(), "1two\n!");
    }

    #[test]
    fn one_file_written_in_two_ways() {
        let mut documents = opened("one");
        let other = Url::parse("file:///robot/%61.mal").unwrap();
        documents.change(&other, 2, [change((0, 0), (0, 3), "two")], Encoding::Utf16);
        assert_eq!(documents.0[&uri()].text.text(), "two");
        assert_eq!(documents.address(&other), Some(uri()));
    }

    #[test]
    fn a_text_that_differs_at_saving_is_the_clients() {
        let mut documents = opened("one");
        documents.saved(&uri(), Some("two".to_owned()));
        assert_eq!(documents.0[&uri()].text.text(), "two");
    }

    #[test]
    fn a_lost_change_is_a_problem_until_the_whole_text_comes() {
        let mut documents = opened("one");
        documents.lost(&uri());
        documents.change(&uri(), 2, [change((0, 0), (0, 0), "x")], Encoding::Utf16);
        assert!(documents.0[&uri()].problem.is_some());
        let whole =
            TextDocumentContentChangeEvent { range: None, range_length: None, text: "two".to_owned() };
        documents.change(&uri(), 3, [whole], Encoding::Utf16);
        assert_eq!((documents.0[&uri()].text.text().as_str(), &documents.0[&uri()].problem), ("two", &None));
    }

    #[test]
    fn a_change_of_a_text_that_is_not_open_leaves_it_unknown_until_the_whole_text_comes() {
        let mut documents = Documents::default();
        documents.change(&uri(), 7, [change((0, 0), (0, 0), "x")], Encoding::Utf16);
        assert!(documents.0[&uri()].problem.is_some() && documents.0[&uri()].version == 7);
        documents.open(TextDocumentItem::new(uri(), "mauve".to_owned(), 8, "two".to_owned()));
        assert_eq!((documents.0[&uri()].text.text().as_str(), &documents.0[&uri()].problem), ("two", &None));
    }

    #[test]
    fn a_range_that_editors_take_differently_leaves_the_text_unknown() {
        for (text, from, to) in [
            ("one\ntwo", (1, 0), (0, 1)),
            ("\u{1f916}", (0, 1), (0, 2)),
            ("\u{1f916}", (0, 0), (0, 1)),
            ("// a\rone", (0, 0), (0, 1)),
        ] {
            let mut documents = opened(text);
            documents.change(&uri(), 2, [change(from, to, "x")], Encoding::Utf16);
            assert!(documents.0[&uri()].problem.is_some(), "{text:?} {from:?} {to:?}");
        }
        // Behind the end of a line, or of the text, is that end.
        for (text, from, to) in
            [("one\r\ntwo", (0, 9), (0, 9)), ("one\n\u{1f916}", (1, 9), (4, 1)), ("", (7, 7), (8, 8))]
        {
            let mut documents = opened(text);
            documents.change(&uri(), 2, [change(from, to, "x")], Encoding::Utf16);
            assert_eq!(documents.0[&uri()].problem, None, "{text:?} {from:?} {to:?}");
        }
    }

    #[test]
    fn a_folder_is_no_text() {
        let mut documents = Documents::default();
        let folder = Url::from_directory_path(std::env::temp_dir()).unwrap();
        documents.lost(&folder);
        documents.open(TextDocumentItem::new(folder, "mauve".to_owned(), 1, String::new()));
        assert!(documents.0.is_empty());
    }

    proptest! {
        /// Any change at all is taken: positions are brought into the text.
        #[test]
        fn no_change_is_too_wild(
            text in "[a\u{e9}\u{1f916}\r\n]{0,12}",
            from in (0..5u32, 0..9u32),
            to in (0..5u32, 0..9u32),
            new in "[b\u{1f916}\n]{0,3}",
        ) {
            for encoding in [Encoding::Utf8, Encoding::Utf16, Encoding::Utf32] {
                let mut documents = opened(&text);
                documents.change(&uri(), 2, [change(from, to, &new)], encoding);
                prop_assert!(documents.0[&uri()].text.text().contains(&new));
            }
        }
    }
}
