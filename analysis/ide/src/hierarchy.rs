//! What hierarchies are made of: something with its place, and how it is known when an editor asks about it later. Texts
//! change between two questions; names stay, or what is asked about is no longer there.

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, File, ModelDb, declarations};
use mauve_syntax::TextRange;

use crate::definition::of_declaration;
use crate::document_symbols::SymbolKind;

/// A node of a hierarchy of calls or of types.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HierarchyItem {
    /// What it is called.
    pub name: String,
    /// What it is.
    pub kind: SymbolKind,
    /// What it is part of, in a few words; may be empty.
    pub detail: String,
    /// Where it stands.
    pub file: File,
    /// All of it.
    pub range: TextRange,
    /// Its name.
    pub name_range: TextRange,
    /// Finds it again in the file, whatever has been edited there: to be given back as it is.
    pub id: String,
}

pub(crate) fn item_of(db: &dyn ModelDb, decl: Decl<'_>, kind: SymbolKind) -> Option<HierarchyItem> {
    let at = of_declaration(db, decl)?;
    Some(HierarchyItem {
        name: decl.name(db).to_string(),
        kind,
        detail: decl.library(db).as_ref().map(|library| format!("library {library}")).unwrap_or_default(),
        file: at.file,
        range: at.range,
        name_range: at.name,
        id: id_of(db, decl),
    })
}

pub(crate) fn id_of(db: &dyn ModelDb, decl: Decl<'_>) -> String {
    let library = decl.library(db).as_ref().map_or("-", Name::as_str);
    format!("{} {library} {} {}", decl.kind(db), decl.name(db), decl.nth(db))
}

pub(crate) fn declaration_of<'db, 'a>(
    db: &'db dyn ModelDb,
    file: File,
    id: &'a str,
) -> Option<(Decl<'db>, Vec<&'a str>)> {
    let mut words = id.split(' ');
    let (kind, library) = (words.next()?, words.next()?);
    let (name, nth) = (words.next()?, words.next()?.parse::<u32>().ok()?);
    let is_it = |decl: &Decl<'db>| {
        decl.kind(db) != Kind::Use
            && decl.kind(db).to_string() == kind
            && decl.library(db).as_ref().map_or("-", Name::as_str) == library
            && decl.name(db) == name
            && decl.nth(db) == nth
    };
    let found = declarations(db, file).all.iter().copied().find(is_it)?;
    Some((found, words.collect()))
}
