//! The names of a file: a model, `mauve.toml`, or a timing table.

use mauve_hir::{File, ModelDb, Project, declarations, is_model, source_map};
use mauve_syntax::TextSize;
use mauve_syntax::ast::{self, AstNode as _};

use super::toml::in_toml;
use super::{Definition, FoundName, in_declaration, located, occurrences_of, outside_declarations};

/// Returns the names at `offset` according to `project`: one, or several in tables, where a key may have several meanings.
pub(crate) fn names_at<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    offset: TextSize,
) -> Vec<FoundName<'db>> {
    let is_here = |found: &FoundName<'db>| found.range.contains_inclusive(offset);
    let mut found: Vec<FoundName<'db>> = match is_model(file.path(db)) {
        true => {
            let mut declarations = declarations(db, file).all.iter().zip(&source_map(db, file).declarations);
            let around = declarations.find(|(_, map)| map.range.contains_inclusive(offset));
            let mut all = around.map_or_else(Vec::new, |(&decl, _)| in_declaration(db, project, decl));
            all.retain(is_here);
            if all.is_empty() {
                all = outside_declarations(db, project, file);
                all.retain(is_here);
            }
            all
        }
        false => in_toml(db, project, file).names.iter().filter(|it| is_here(it)).cloned().collect(),
    };
    // When two names touch at the cursor, prefers the right one.
    let start = found.iter().map(|found| found.range.start()).max();
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
    let last = ty.segments().last()?.syntax().text_range();
    let names = names_at(db, project, file, last.start()).into_iter();
    names.filter(|name| name.range == last).map(|name| name.definition).next()
}

pub(crate) fn names_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, file: File) -> Vec<FoundName<'db>> {
    let mut found = match is_model(file.path(db)) {
        true => {
            let mut found = outside_declarations(db, project, file);
            let all = declarations(db, file).all.iter();
            found.extend(all.flat_map(|&decl| in_declaration(db, project, decl)));
            found
        }
        false => in_toml(db, project, file).names.clone(),
    };
    found.sort_by_key(|found| (found.range.start(), found.range.end()));
    found
}

/// Returns the names of a file that refer to a definition, in text order.
pub(crate) fn names_of_definition<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    definition: &Definition<'db>,
) -> Vec<FoundName<'db>> {
    let is_it = |found: &FoundName<'db>| found.definition == *definition;
    let mut found: Vec<FoundName<'db>> = match is_model(file.path(db)) {
        true => {
            let mut found = outside_declarations(db, project, file);
            found.retain(is_it);
            for &decl in &declarations(db, file).all {
                let all = occurrences_of(db, project, decl).iter();
                found.extend(located(db, decl, all.filter(|it| it.definition == *definition)));
            }
            found
        }
        false => in_toml(db, project, file).names.iter().filter(|it| is_it(it)).cloned().collect(),
    };
    found.sort_by_key(|found| (found.range.start(), found.range.end()));
    found
}
