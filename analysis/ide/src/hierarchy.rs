//! Items of call and type hierarchies, and how an item is found again after an edit: by name.

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, File, ModelDb, declarations};
use mauve_syntax::TextRange;

use crate::definition::of_declaration;
use crate::document_symbols::SymbolKind;
use crate::occurrences::kind_of;

/// A node of a hierarchy of calls or of types.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HierarchyItem {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: SymbolKind,
    /// Its container, as a short text; may be empty.
    pub detail: String,
    /// Its file.
    pub file: File,
    /// Its full range.
    pub range: TextRange,
    /// The range of its name.
    pub name_range: TextRange,
    /// A key that finds the item again after edits; clients send it back unchanged.
    pub id: String,
}

pub(crate) fn item_of(db: &dyn ModelDb, decl: Decl<'_>) -> Option<HierarchyItem> {
    let at = of_declaration(db, decl)?;
    Some(HierarchyItem {
        name: decl.name(db).to_string(),
        kind: kind_of(decl.kind(db)),
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

/// Returns the declaration of an item with this id, and what follows in the id: the name of an item in the declaration.
pub(crate) fn declaration_of<'db, 'a>(
    db: &'db dyn ModelDb,
    file: File,
    id: &'a str,
) -> Option<(Decl<'db>, &'a str)> {
    let mut all = declarations(db, file).all.iter().filter(|decl| decl.kind(db) != Kind::Use);
    all.find_map(|&decl| {
        let rest = id.strip_prefix(&id_of(db, decl))?;
        (rest.is_empty() || rest.starts_with(' ')).then(|| (decl, rest.trim_start()))
    })
}
