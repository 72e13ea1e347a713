//! The syntax tree of a file, its declarations, and their locations.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use std::ops::Range;
use std::sync::Arc;

use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{
    Parse, SyntaxKind, SyntaxNode, SyntaxToken, TextRange, TextSize, comments_above, next_significant,
    next_token, previous_token, token_at,
};
use rustc_hash::FxHashMap;

use crate::completeness::Completeness;
use crate::item_tree::{
    Activity, Data, Declaration, Deployment, Expansion, ItemTree, Kind, Name, Outline, SourceId, TypeRef,
};
use crate::lower::occurrences;
use crate::ranges::{DeclarationMap, SourceMap};
use crate::{File, ModelDb};

/// A declaration, identified by its file, kind, library and name: edits of the text around it do not change its identity.
#[salsa::interned(debug)]
pub struct Decl<'db> {
    #[returns(copy)]
    pub file: File,
    #[returns(copy)]
    pub kind: Kind,
    /// The library that contains it; `None` outside libraries.
    #[returns(ref)]
    pub library: Option<Name>,
    /// The name; empty if missing.
    #[returns(ref)]
    pub name: Name,
    /// The number of earlier declarations in the file with the same kind, library and name.
    #[returns(copy)]
    pub nth: u32,
}

impl<'db> Decl<'db> {
    /// Returns `library.name`, or the name alone outside libraries.
    pub fn qualified(self, db: &'db dyn ModelDb) -> String {
        match self.library(db) {
            Some(library) => format!("{library}.{}", self.name(db)),
            None => self.name(db).to_string(),
        }
    }

    /// Returns whether this is its name, with its library or without.
    pub fn is_called(self, db: &'db dyn ModelDb, name: &str) -> bool {
        *self.name(db) == *name || self.qualified(db) == name
    }
}

/// Parses a file. salsa does not compare the result: each new text gives a new tree.
#[salsa::tracked(returns(ref), no_eq)]
pub fn parse(db: &dyn ModelDb, file: File) -> Parse {
    db.trees().kept(file, file.text(db)).parse
}

#[salsa::tracked(returns(ref), no_eq)]
fn lowered(db: &dyn ModelDb, file: File) -> Arc<(ItemTree, SourceMap)> {
    db.trees().kept(file, file.text(db)).lowered
}

/// Returns the declarations of a file, without ranges: comments and blank lines do not change the result.
#[salsa::tracked(returns(ref))]
pub fn item_tree_of(db: &dyn ModelDb, file: File) -> ItemTree {
    lowered(db, file).0.clone()
}

/// Returns the ranges of the declarations of a file. Only queries whose results are shown to a user may call it.
pub fn source_map(db: &dyn ModelDb, file: File) -> &SourceMap {
    &lowered(db, file).1
}

/// Returns the ranges of a declaration and its sources; `None` if the file no longer contains it.
pub fn declaration_map<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> Option<&'db DeclarationMap> {
    source_map(db, decl.file(db)).declarations.get(index_of(db, decl)?)
}

/// Returns the innermost node around `range` that is more than a name: of the name of a declaration, the declaration.
pub fn node_around(db: &dyn ModelDb, file: File, range: TextRange) -> Option<SyntaxNode> {
    let root = parse(db, file).syntax();
    let element = root.text_range().contains_range(range).then(|| root.covering_element(range))?;
    element.ancestors().find(|node| !matches!(node.kind(), SyntaxKind::NAME | SyntaxKind::NAME_REF))
}

/// Returns the declaration that contains `range`. An empty range, such as a cursor, may also be at the end of the
/// declaration, unless another declaration begins there.
///
/// ```
/// use mauve_hir::{Database, Workspace, declaration_at};
/// use mauve_syntax::TextRange;
///
/// let db = Database::default();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), "shell S { }".to_owned())]);
/// let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
/// let found = declaration_at(&db, file, TextRange::empty(8.into())).unwrap();
/// assert_eq!(found.name(&db), "S");
/// ```
pub fn declaration_at<'db>(db: &'db dyn ModelDb, file: File, range: TextRange) -> Option<Decl<'db>> {
    // Declarations are sorted and do not overlap.
    let maps = &source_map(db, file).declarations;
    let index = maps.partition_point(|map| map.range.end() <= range.start());
    let contains = |&index: &usize| maps.get(index).is_some_and(|map| map.range.contains_range(range));
    let index = Some(index).filter(contains).or_else(|| index.checked_sub(1).filter(contains))?;
    declarations(db, file).all.get(index).copied()
}

/// The declarations of a file, with other fields of its [`Outline`].
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Declarations<'db> {
    /// In the order of the text.
    pub all: Vec<Decl<'db>>,
    pub completeness: Completeness,
    pub unnamed: Vec<(Option<Name>, Kind)>,
    pub possible_names: Vec<(Option<Name>, Option<Name>)>,
    pub include_completeness: Completeness,
    pub libraries: Vec<Name>,
    index: FxHashMap<Decl<'db>, usize>,
}

/// Returns the declarations of a file, without their content: a changed period does not change the result.
#[salsa::tracked(returns(ref))]
pub fn declarations<'db>(db: &'db dyn ModelDb, file: File) -> Declarations<'db> {
    let outline = file.outline(db);
    let nths = occurrences(outline);
    let declare = |(it, nth): (&Declaration, u32)| {
        Decl::new(db, file, it.kind, it.library.clone(), it.name.clone(), nth)
    };
    let all: Vec<Decl<'db>> = outline.declarations.iter().zip(nths).map(declare).collect();
    let index = all.iter().enumerate().map(|(index, &decl)| (decl, index)).collect();
    let Outline { completeness, include_completeness, unnamed, possible_names, libraries, .. } = &**outline;
    Declarations {
        all,
        completeness: *completeness,
        include_completeness: *include_completeness,
        unnamed: unnamed.clone(),
        possible_names: possible_names.clone(),
        libraries: libraries.clone(),
        index,
    }
}

fn index_of<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> Option<usize> {
    declarations(db, decl.file(db)).index.get(&decl).copied()
}

/// Returns the content of a declaration; `None` if the file no longer contains it.
#[salsa::tracked(returns(ref))]
pub fn data<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> Option<Arc<Data>> {
    let index = index_of(db, decl)?;
    item_tree_of(db, decl.file(db)).data.get(index).cloned()
}

/// Returns what a declaration adds to the size of a project.
pub(crate) fn expansion_of<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> &'db Expansion {
    static NOTHING: Expansion = Expansion { own: 0, included: Vec::new(), instances: Vec::new() };
    let declaration = index_of(db, decl).and_then(|it| decl.file(db).outline(db).declarations.get(it));
    declaration.map_or(&NOTHING, |it| &it.expansion)
}

/// A location that a diagnostic points at, independent of edits elsewhere.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Location<'db> {
    /// The source.
    Source(Decl<'db>, SourceId),
    /// An empty range before the source.
    Before(Decl<'db>, SourceId),
    /// An empty range after the source.
    Behind(Decl<'db>, SourceId),
    /// The name of the library around the declaration.
    Library(Decl<'db>),
    /// An empty range before the declaration.
    Above(Decl<'db>),
    /// An empty range after the last item within the braces of the declaration, for an additional item.
    End(Decl<'db>),
    /// An empty range after the first brace that follows the source.
    Inside(Decl<'db>, SourceId),
    /// The range to delete in order to remove the item that contains the source: see `deletion_range`.
    Item(Decl<'db>, SourceId),
    /// The include with that index.
    Include(File, u32),
    /// An empty range after the last include of the file or, without includes, at its start.
    Includes(File),
    /// A range of bytes of a file without a syntax tree, such as a table.
    Range(File, u32, u32),
}

impl<'db> Location<'db> {
    /// Returns the location of a range of bytes of a file without a syntax tree.
    pub fn of_span(file: File, span: &Range<usize>) -> Location<'db> {
        Location::Range(file, span.start as u32, span.end as u32)
    }

    /// Returns the location of the name of a declaration.
    pub fn name_of(decl: Decl<'db>) -> Location<'db> {
        Location::Source(decl, SourceId(0))
    }

    /// Returns the file that contains the location.
    pub fn file(&self, db: &'db dyn ModelDb) -> File {
        match *self {
            Location::Source(decl, _)
            | Location::Before(decl, _)
            | Location::Behind(decl, _)
            | Location::Library(decl)
            | Location::Above(decl)
            | Location::End(decl)
            | Location::Inside(decl, _)
            | Location::Item(decl, _) => decl.file(db),
            Location::Include(file, _) | Location::Includes(file) | Location::Range(file, ..) => file,
        }
    }

    /// Returns the current range if the location is in `file`.
    ///
    /// Places of one deployment may be in several files: that of a gateway is in `mauve.toml`.
    pub fn range_in(&self, db: &'db dyn ModelDb, file: File) -> Option<TextRange> {
        (self.file(db) == file).then(|| self.range(db))
    }

    /// Returns the current range in [`Self::file`]; empty, at the start of the file, if the declaration no longer exists.
    pub fn range(&self, db: &'db dyn ModelDb) -> TextRange {
        let map = |decl: Decl<'db>| declaration_map(db, decl);
        let id = |decl, id: SourceId| {
            let map = map(decl)?;
            Some(map.range_of(id).unwrap_or(map.range))
        };
        let found = match *self {
            Location::Source(decl, it) => id(decl, it),
            Location::Before(decl, it) => id(decl, it).map(|range| TextRange::empty(range.start())),
            Location::Behind(decl, it) => id(decl, it).map(|range| TextRange::empty(range.end())),
            Location::Library(decl) => map(decl).and_then(|map| {
                let node = node_around(db, decl.file(db), map.range)?;
                let library = node.ancestors().find_map(ast::Library::cast)?;
                Some(library.name()?.syntax().text_range())
            }),
            Location::Above(decl) => map(decl).map(|map| TextRange::empty(map.range.start())),
            Location::End(decl) => map(decl).and_then(|map| {
                let text = decl.file(db).text(db).get(Range::<usize>::from(map.range))?;
                // Without a closing brace, the end of the text.
                let inner = text.strip_suffix('}').unwrap_or(text).trim_end();
                Some(TextRange::empty(map.range.start() + TextSize::of(inner)))
            }),
            Location::Inside(decl, it) => id(decl, it).map(|range| {
                let root = parse(db, decl.file(db)).syntax();
                let next = token_at(&root, range.end());
                let brace =
                    std::iter::successors(next, next_token).find(|token| token.kind() == SyntaxKind::L_CURLY);
                TextRange::empty(brace.map_or(range.end(), |brace| brace.text_range().end()))
            }),
            Location::Item(decl, it) => {
                id(decl, it).map(|range| deletion_range(&parse(db, decl.file(db)).syntax(), range))
            }
            Location::Includes(file) => {
                let last = source_map(db, file).includes.last();
                let byte_order_mark = file.text(db).chars().next().filter(|&letter| letter == '\u{feff}');
                let begin = byte_order_mark.map_or(0.into(), TextSize::of);
                Some(TextRange::empty(last.map_or(begin, |last| last.end())))
            }
            Location::Include(file, index) => source_map(db, file).includes.get(index as usize).copied(),
            Location::Range(_, start, end) => Some(TextRange::new(start.into(), end.max(start).into())),
        };
        found.unwrap_or_default()
    }
}

/// Returns the range to delete in order to remove the declaration, variable, connection or field around `source`: with the
/// comments above it, and with its lines if they contain nothing else, otherwise with the white space before it.
fn deletion_range(root: &SyntaxNode, source: TextRange) -> TextRange {
    let is_item = |node: &SyntaxNode| {
        matches!(
            node.kind(),
            SyntaxKind::CODEL
                | SyntaxKind::VAR
                | SyntaxKind::HANDLER
                | SyntaxKind::CONNECTION
                | SyntaxKind::OPERATION_CONNECTION
                | SyntaxKind::FIELD
        )
    };
    let token = token_at(root, source.start());
    let Some(node) = token.and_then(|token| token.parent_ancestors().find(is_item)) else { return source };
    let is_white = |token: &SyntaxToken| token.kind() == SyntaxKind::WHITESPACE;
    let ends_line = |token: &SyntaxToken| token.text().contains(['\n', '\r']);
    let (Some(first), Some(last)) = (node.first_token(), node.last_token()) else { return source };

    // The `;` belongs to the list around the item.
    let mut end = last.text_range().end();
    let mut next = next_token(&last);
    if let Some(sign) = next_significant(&last).filter(|sign| sign.kind() == SyntaxKind::SEMICOLON) {
        end = sign.text_range().end();
        next = next_token(&sign);
    }
    // The rest of its line: empty, or a comment.
    let rest = std::iter::successors(next, next_token)
        .take_while(|token| token.kind().is_trivia() && !(is_white(token) && ends_line(token)));
    let rest: Vec<SyntaxToken> = rest.collect();
    let line_end = rest.last().map_or(end, |token| token.text_range().end());
    let next = token_at(root, line_end).filter(|token| token.text_range().start() >= line_end);
    let is_last = next.as_ref().is_none_or(|next| is_white(next) && ends_line(next));

    let begins = previous_token(&first).is_none_or(|white| is_white(&white) && ends_line(&white));
    let start = comments_above(&node).filter(|_| begins).last().unwrap_or(first);
    let white = previous_token(&start).filter(is_white);
    let blanks = white.as_ref().map_or(0, |white| {
        let text = white.text();
        text.len() - text.rfind(['\n', '\r']).map_or(0, |at| at + 1)
    });
    let start = start.text_range().start() - TextSize::from(blanks as u32);
    if begins && !is_last && rest.iter().all(is_white) {
        // The next item moves to the start of the deleted one.
        return TextRange::new(start + TextSize::from(blanks as u32), line_end);
    }
    if !(begins && is_last) {
        return TextRange::new(start, end);
    }
    let line = next.map_or(0, |white| white.text().find('\n').map_or(white.text().len(), |at| at + 1));
    TextRange::new(start, line_end + TextSize::from(line as u32))
}

/// The data of a core that other declarations read: an edit of a program does not change it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CoreInterface {
    /// The shell that it implements.
    pub shell: Option<TypeRef>,
    /// Whether it defines operations.
    pub defines_operations: bool,
}

/// Returns the [`CoreInterface`] of a core.
#[salsa::tracked(returns(ref))]
pub fn core_interface<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> Option<CoreInterface> {
    let data = core(db, decl)?;
    Some(CoreInterface { shell: data.shell.clone(), defines_operations: !data.operations.is_empty() })
}

/// Returns the data of a deployment without the fields of its activities: an edit of a period or a priority does not change
/// the result.
#[salsa::tracked(returns(as_ref))]
pub(crate) fn deployment_interface<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> Option<Deployment> {
    let data = deployment(db, decl)?;
    let without_fields = |it: &Arc<Activity>| {
        let Activity { name, instances, completeness, .. } = it.as_ref();
        let (name, instances, completeness) = (name.clone(), instances.clone(), *completeness);
        Arc::new(Activity { name, instances, fields: Vec::new(), completeness })
    };
    Some(Deployment { activities: data.activities.iter().map(without_fields).collect(), ..data.clone() })
}

macro_rules! data_of {
    ($($name:ident: $ty:ident;)*) => {$(
        #[doc = concat!("Returns the data of a declaration of kind `", stringify!($name), "`; `None` for another kind.")]
        pub fn $name<'db>(db: &'db dyn ModelDb, decl: Decl<'db>) -> Option<&'db crate::item_tree::$ty> {
            match data(db, decl).as_deref() {
                Some(Data::$ty(it)) => Some(it),
                _ => None,
            }
        }
    )*};
}

data_of! {
    codel: Codel;
    shell: Shell;
    core: Core;
    component: Component;
    architecture: Architecture;
    deployment: Deployment;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Database, Workspace};

    /// Returns the name of the declaration at each of `ranges`.
    fn at(text: &str, ranges: &[(u32, u32)]) -> Vec<String> {
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text.to_owned())]);
        let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
        let range = |&(start, end): &(u32, u32)| TextRange::new(start.into(), end.into());
        let found = ranges.iter().map(|it| declaration_at(&db, file, range(it)));
        found.map(|it| it.map_or_else(|| "none".to_owned(), |it| it.name(&db).to_string())).collect()
    }

    #[test]
    fn finds_the_declaration_at_a_range() {
        let text = "shell A { }core B(A) { } /* C */ library l { codel d(): int }";
        // At the end of a declaration, only if no other declaration begins there.
        assert_eq!(at(text, &[(0, 0), (11, 11), (24, 24), (25, 25)]), ["A", "B", "B", "none"]);
        assert_eq!(
            at(text, &[(6, 7), (10, 12), (11, 15), (24, 25), (59, 59)]),
            ["A", "none", "B", "none", "d"]
        );
        assert_eq!(at("", &[(0, 0)]), ["none"]);
    }

    #[test]
    fn an_edit_of_an_activity_shares_the_others() {
        let mut db = Database::default();
        let text = "deployment D {\n activity a { period = 1 }\n activity b { period = 1 }\n activity c { period = 1 }\n}";
        let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text.to_owned())]);
        let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
        let activities = |db: &Database| {
            let of = declarations(db, file).all[0];
            let ids = deployment(db, of).unwrap().activities.iter();
            ids.map(|it| (it.clone(), Location::Source(of, it.name.id).range(db))).collect::<Vec<_>>()
        };
        let before = activities(&db);
        file.set_text(&mut db, text.replacen("period = 1", "period = 20", 1).into());
        let after = activities(&db);
        let shared: Vec<bool> = before.iter().zip(&after).map(|(a, b)| Arc::ptr_eq(&a.0, &b.0)).collect();
        assert_eq!(shared, [false, true, true]);
        let names: Vec<&str> =
            after.iter().map(|(_, range)| &file.text(&db)[Range::<usize>::from(*range)]).collect();
        assert_eq!(names, ["a", "b", "c"]);
    }

    #[test]
    fn a_copy_of_a_file_in_another_database_shares_its_trees() {
        let db = Database::default();
        let text = "shell A { }\nshell B { }\n".to_owned();
        let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
        let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
        let first = |db: &dyn ModelDb, file| data(db, declarations(db, file).all[0]).clone().unwrap();
        let known = first(&db, file);
        let other = Database::default();
        let copy = file.copied(&db, &other, "shell A { }\nshell C { }\n".into());
        assert!(Arc::ptr_eq(&known, &first(&other, copy)));
        assert_eq!(declarations(&other, copy).all[1].name(&other).as_str(), "C");
        assert_eq!(declarations(&db, file).all[1].name(&db).as_str(), "B");
    }
}
