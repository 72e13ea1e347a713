//! The names of a file: a model, `mauve.toml`, or a timing table.

use mauve_hir::{File, ModelDb, Project, declarations, is_model, source_map};
use mauve_syntax::TextSize;
use mauve_syntax::ast::{self, AstNode as _};

use super::toml::in_toml;
use super::{Definition, FoundName, located, occurrences_of, outside_declarations};

/// Returns the names of a file, those at `at` or of `definition` if one is given, in text order.
fn names<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    at: Option<TextSize>,
    definition: Option<&Definition<'db>>,
) -> Vec<FoundName<'db>> {
    let is_it = |it: &Definition<'db>| definition.is_none_or(|definition| it == definition);
    let is_here = |found: &FoundName<'db>| at.is_none_or(|at| found.range.contains_inclusive(at));
    let is_found = |found: &FoundName<'db>| is_it(&found.definition) && is_here(found);
    let mut found: Vec<FoundName<'db>> = Vec::new();
    if is_model(file.path(db)) {
        found.extend(outside_declarations(db, project, file).into_iter().filter(is_found));
        for (&decl, map) in declarations(db, file).all.iter().zip(&source_map(db, file).declarations) {
            if at.is_none_or(|at| map.range.contains_inclusive(at)) {
                let names = occurrences_of(db, project, decl).iter().filter(|it| is_it(&it.definition));
                found.extend(located(db, decl, names).into_iter().filter(is_here));
            }
        }
    } else {
        found.extend(in_toml(db, project, file).names.iter().filter(|it| is_found(it)).cloned());
    }
    found.sort_by_key(|found| (found.range.start(), found.range.end()));
    found
}

/// Returns the names at `offset` according to `project`: one, or several in tables, where a key may have several meanings.
pub(crate) fn names_at<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    offset: TextSize,
) -> Vec<FoundName<'db>> {
    let mut found = names(db, project, file, Some(offset), None);
    // When two names touch at the cursor, prefers the right one.
    let start = found.last().map(|found| found.range.start());
    found.retain(|found| Some(found.range.start()) == start);
    found
}

/// Returns what a type refers to: the definition of the last name in it.
pub(crate) fn definition_of_type<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    ty: &ast::Type,
) -> Option<Definition<'db>> {
    let last = ty.name_refs().last()?.syntax().text_range();
    let names = names_at(db, project, file, last.start()).into_iter();
    names.filter(|name| name.range == last).map(|name| name.definition).next()
}

/// Returns the names of a file, in text order.
pub(crate) fn names_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, file: File) -> Vec<FoundName<'db>> {
    names(db, project, file, None, None)
}

/// Returns the names of a file that refer to a definition, in text order.
pub(crate) fn names_of_definition<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    definition: &Definition<'db>,
) -> Vec<FoundName<'db>> {
    names(db, project, file, None, Some(definition))
}
