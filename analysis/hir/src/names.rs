//! Resolution of the names of declarations in a project.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::completeness::Completeness;
use crate::item_tree::{Kind, Name, TypeRef};
use crate::project::{Project, includes, is_model, project_files};
use crate::source::{Decl, declarations};
use crate::{File, ModelDb, Problem};

/// The declarations of a project by library, kind and name.
#[derive(Debug, Clone, Default, PartialEq, Eq, salsa::SalsaValue)]
pub struct Names<'db> {
    /// In the order of the project's files and their texts.
    pub all: Vec<Decl<'db>>,
    by_name: FxHashMap<(Option<Name>, Kind, Name), Vec<Decl<'db>>>,
    in_any_library: FxHashMap<(Kind, Name), Vec<Decl<'db>>>,
    /// For each library, the libraries and message packages that it uses.
    uses: FxHashMap<Option<Name>, Vec<Name>>,
    libraries: FxHashSet<Name>,
    /// See [`crate::item_tree::Outline::unnamed`]: such a declaration may have any name.
    unnamed: FxHashSet<(Option<Name>, Kind)>,
    /// See [`crate::item_tree::Outline::possible_names`].
    possible_names: FxHashSet<(Option<Name>, Option<Name>)>,
    /// Whether all files are known: a missing or unreadable file may declare any name.
    pub completeness: Completeness,
    /// The first file whose text is unknown, or whose [`crate::item_tree::Outline::completeness`] is incomplete.
    pub incomplete_file: Option<File>,
}

/// Returns the names of a project. A change *in* a declaration does not change the result.
#[salsa::tracked(returns(ref))]
pub fn names_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Names<'db> {
    let mut names = Names::default();
    for &file in project_files(db, project) {
        let declarations = declarations(db, file);
        let are_included = includes(db, project.workspace(db), file).iter().all(Option::is_some);
        let is_read = Completeness::of(are_included && file.problem(db).is_none());
        names.completeness &= declarations.include_completeness & is_read;
        names.possible_names.extend(declarations.possible_names.iter().cloned());
        names.unnamed.extend(declarations.unnamed.iter().cloned());
        names.libraries.extend(declarations.libraries.iter().filter(|name| !name.is_empty()).cloned());
        // An outdated text may lack any declaration.
        if declarations.completeness.is_incomplete() || matches!(file.problem(db), Some(Problem::Unknown(_)))
        {
            names.incomplete_file.get_or_insert(file);
        }
        for &decl in &declarations.all {
            let library = decl.library(db).clone();
            let name = decl.name(db).clone();
            if decl.kind(db) == Kind::Use {
                names.uses.entry(library).or_default().push(name);
                continue;
            }
            names.all.push(decl);
            if !name.is_empty() {
                names.in_any_library.entry((decl.kind(db), name.clone())).or_default().push(decl);
                names.by_name.entry((library, decl.kind(db), name)).or_default().push(decl);
            }
        }
    }
    // If the salvaged name is declared elsewhere, the broken declaration's own name is unknown.
    if !names.possible_names.is_empty() {
        let declared: FxHashSet<Option<&Name>> = names.all.iter().map(|it| Some(it.name(db))).collect();
        let salvaged = names.possible_names.iter().filter(|(_, name)| declared.contains(&name.as_ref()));
        let any_name: Vec<(Option<Name>, Option<Name>)> =
            salvaged.map(|(of, _)| (of.clone(), None)).collect();
        names.possible_names.extend(any_name);
    }
    names
}

/// Why the declaration of an unresolved name may exist nevertheless.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum MayHide {
    MissingFile,
    SyntaxError,
}

/// Why a name is unresolved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
pub enum Unresolved {
    /// No declaration of the kind has the name.
    Unknown,
    /// Several libraries declare it.
    Ambiguous,
    /// A library declares it twice; another fact reports that at the second declaration.
    Repeated,
    /// The name itself is missing; a syntax error reports that.
    Missing,
    /// A missing file or a text with syntax errors may declare it; another fact reports that.
    Incomplete,
}

impl<'db> Names<'db> {
    /// Returns the declarations of a kind, in the order of the files.
    pub fn of_kind(
        &self,
        db: &'db dyn ModelDb,
        kind: Kind,
    ) -> impl Iterator<Item = Decl<'db>> + use<'_, 'db> {
        self.all.iter().copied().filter(move |decl| decl.kind(db) == kind)
    }

    /// Returns the declarations of this kind and name in `library`; more than one is an error.
    pub fn in_library(&self, library: Option<&Name>, kind: Kind, name: &Name) -> &[Decl<'db>] {
        self.by_name.get(&(library.cloned(), kind, name.clone())).map_or(&[], Vec::as_slice)
    }

    /// Returns the declarations of this kind and name, in any library.
    pub fn anywhere(&self, kind: Kind, name: &str) -> &[Decl<'db>] {
        self.in_any_library.get(&(kind, name.into())).map_or(&[], Vec::as_slice)
    }

    /// Resolves a key of a timing table, `library.name` or `name`; more than one result is an error.
    pub fn by_key(&self, kind: Kind, key: &str) -> &[Decl<'db>] {
        match key.rsplit_once('.') {
            Some((library, name)) => self.in_library(Some(&library.into()), kind, &name.into()),
            // Declarations outside libraries take precedence: they have no other key.
            None => match self.in_library(None, kind, &key.into()) {
                [] => self.anywhere(kind, key),
                outside => outside,
            },
        }
    }

    /// Resolves `path`, written in `library`: in that library, then in the libraries that it uses. Outside libraries, all
    /// libraries are visible.
    pub fn resolve(
        &self,
        db: &'db dyn ModelDb,
        library: Option<&Name>,
        kind: Kind,
        path: &[Name],
    ) -> Result<Decl<'db>, Unresolved> {
        let found: Vec<Decl<'db>> = match path {
            [name] => match self.in_library(library, kind, name) {
                [] => {
                    let visible = self.visible(library);
                    visible.flat_map(|it| self.in_library(Some(it), kind, name)).copied().collect()
                }
                own => own.to_vec(),
            },
            [of, name] => self.in_library(Some(of), kind, name).to_vec(),
            _ => Vec::new(),
        };
        // A name that a missing file or an unnamed declaration may declare is not looked up in other libraries, and its
        // absence is not reported.
        let own = |decl: &Decl<'db>| decl.library(db).as_ref() == library;
        let may_be_in = |library: Option<&Name>, name: &Name| {
            let of = library.cloned();
            self.has_unnamed(library, kind)
                || self.possible_names.contains(&(of.clone(), None))
                || self.possible_names.contains(&(of, Some(name.clone())))
        };
        let may_be_visible = |name: &Name| self.visible(library).any(|it| may_be_in(Some(it), name));
        let hidden = match path {
            [name] if name.is_empty() || found.iter().any(own) => false,
            [name] => {
                self.completeness.is_incomplete()
                    || may_be_in(library, name)
                    || found.is_empty() && may_be_visible(name)
            }
            [of, name] => {
                found.is_empty() && (self.completeness.is_incomplete() || may_be_in(Some(of), name))
            }
            _ => false,
        };
        match found.as_slice() {
            _ if hidden => Err(Unresolved::Incomplete),
            [decl] => Ok(*decl),
            [] if path.is_empty() || path.iter().any(|id| id.is_empty()) => Err(Unresolved::Missing),
            // An error between two declarations may hide the declaration.
            [] if self.incomplete_file.is_some() => Err(Unresolved::Incomplete),
            [] => Err(Unresolved::Unknown),
            [first, rest @ ..] if rest.iter().all(|it| it.library(db) == first.library(db)) => {
                Err(Unresolved::Repeated)
            }
            _ => Err(Unresolved::Ambiguous),
        }
    }

    /// Returns the other libraries visible in `library`: those that it uses; outside libraries, all.
    pub fn visible<'a>(&'a self, library: Option<&Name>) -> Box<dyn Iterator<Item = &'a Name> + 'a> {
        match library {
            None => Box::new(self.libraries.iter()),
            Some(_) => {
                let used = self.uses.get(&library.cloned()).map_or(&[] as &[Name], Vec::as_slice);
                let once: FxHashSet<&Name> = used.iter().filter(|name| Some(*name) != library).collect();
                Box::new(once.into_iter())
            }
        }
    }

    /// Returns whether the project has a library of this name.
    pub fn has_library(&self, name: &Name) -> bool {
        self.libraries.contains(name)
    }

    /// Returns the libraries of the project, in no particular order.
    pub fn libraries(&self) -> impl Iterator<Item = &Name> {
        self.libraries.iter()
    }

    /// Returns whether the name of a declaration of this kind in `library` is unknown.
    pub(crate) fn has_unnamed(&self, library: Option<&Name>, kind: Kind) -> bool {
        !self.unnamed.is_empty() && self.unnamed.contains(&(library.cloned(), kind))
    }

    /// Returns whether a missing file or a text with syntax errors may declare names.
    pub fn may_miss_names(&self) -> bool {
        self.completeness.is_incomplete() || !self.possible_names.is_empty() || !self.unnamed.is_empty()
    }

    /// Returns whether a text with syntax errors may contain a `use` of `library`.
    pub(crate) fn may_miss_uses(&self, library: &Option<Name>) -> bool {
        self.incomplete_file.is_some() || self.possible_names.iter().any(|(of, _)| of == library)
    }

    /// Returns whether a missing file or a text with syntax errors may declare what a key of a timing table names,
    /// `library.name` or `name`.
    pub fn may_declare(&self, kind: Kind, key: &str) -> bool {
        let of: Option<Name> = key.rsplit_once('.').map(|(library, _)| library.into());
        self.completeness.is_incomplete()
            || self.incomplete_file.is_some()
            || match &of {
                Some(library) if self.has_library(library) => {
                    self.unnamed.contains(&(of.clone(), kind))
                        || self.possible_names.iter().any(|(it, _)| *it == of)
                }
                _ => self.may_miss_names(),
            }
    }

    /// Returns the reason for [`Unresolved::Incomplete`].
    pub fn may_hide(&self) -> MayHide {
        if self.completeness.is_incomplete() { MayHide::MissingFile } else { MayHide::SyntaxError }
    }

    /// Returns the path of this kind, visible in `library`, that `path` is most likely a misspelling of.
    pub fn similar(
        &self,
        db: &'db dyn ModelDb,
        library: Option<&Name>,
        kind: Kind,
        path: &[Name],
    ) -> Option<Name> {
        match path {
            [name] => similar(name, self.visible_of_kind(db, library, kind).map(|decl| decl.name(db))),
            [of, name] => {
                let in_it = self.of_kind(db, kind).filter(|decl| decl.library(db).as_ref() == Some(of));
                let near = similar(name, in_it.map(|decl| decl.name(db)))?;
                Some(format!("{of}.{near}").into())
            }
            _ => None,
        }
    }

    /// Returns the declarations of a kind that a name in `library` may refer to.
    pub fn visible_of_kind<'a>(
        &'a self,
        db: &'db dyn ModelDb,
        library: Option<&'a Name>,
        kind: Kind,
    ) -> impl Iterator<Item = Decl<'db>> + use<'a, 'db> {
        let visible: FxHashSet<Option<&Name>> = self.visible(library).map(Some).chain([library]).collect();
        self.of_kind(db, kind).filter(move |decl| visible.contains(&decl.library(db).as_ref()))
    }
}

/// Resolves `path`, written in `library`, with [`Names::resolve`].
pub fn resolve_path<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    library: Option<&Name>,
    kind: Kind,
    path: &[Name],
) -> Result<Decl<'db>, Unresolved> {
    resolved(db, project, library.cloned(), kind, path.to_vec())
}

/// A query for each name: a new declaration invalidates only the queries that use its name.
#[salsa::tracked(returns(copy))]
fn resolved<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    library: Option<Name>,
    kind: Kind,
    path: Vec<Name>,
) -> Result<Decl<'db>, Unresolved> {
    names_of(db, project).resolve(db, library.as_ref(), kind, &path)
}

/// Resolves the name of a shell, core, component or architecture, written in `from`, with [`Names::resolve`].
pub fn resolve_type<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    from: Decl<'db>,
    kind: Kind,
    ty: Option<&TypeRef>,
) -> Result<Decl<'db>, Unresolved> {
    resolve_path(db, project, from.library(db).as_ref(), kind, &ty.ok_or(Unresolved::Missing)?.path)
}

/// Returns [`Names::incomplete_file`] of a project.
#[salsa::tracked(returns(copy))]
pub fn incomplete_file<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Option<File> {
    names_of(db, project).incomplete_file
}

/// Returns [`Names::may_miss_names`] of a project.
#[salsa::tracked(returns(copy))]
pub(crate) fn may_miss_names<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> bool {
    names_of(db, project).may_miss_names()
}

/// Returns the name in `names` that `name` is most likely a misspelling of.
pub fn similar<'a>(name: &str, names: impl IntoIterator<Item = &'a Name>) -> Option<Name> {
    mauve_syntax::similar(name, names.into_iter().map(Name::as_str)).map(Name::from)
}

/// Returns, for each declared name outside a project, the first file of the workspace that declares it.
#[salsa::tracked(returns(ref))]
fn declared_outside<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> FxHashMap<(Kind, Name), File> {
    let inside: FxHashSet<File> = project_files(db, project).iter().copied().collect();
    let mut outside = FxHashMap::default();
    for (path, &file) in project.workspace(db).files(db).iter() {
        if is_model(path) && !inside.contains(&file) {
            for decl in &declarations(db, file).all {
                outside.entry((decl.kind(db), decl.name(db).clone())).or_insert(file);
            }
        }
    }
    outside
}

/// Returns a file of the workspace that declares `name` and that the project does not include.
pub fn file_outside<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    kind: Kind,
    name: &Name,
) -> Option<File> {
    declared_outside(db, project).get(&(kind, name.clone())).copied()
}
