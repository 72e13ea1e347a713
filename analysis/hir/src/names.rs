//! What a name means in a project.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::completeness::Completeness;
use crate::item_tree::{Kind, Name, TypeRef};
use crate::project::{Project, includes, is_model, project_files};
use crate::source::{Decl, declarations};
use crate::{File, ModelDb, Problem};

/// The declarations of a project by library, kind and name.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Names<'db> {
    /// In the order of the project's files and their texts.
    pub all: Vec<Decl<'db>>,
    by_name: FxHashMap<(Option<Name>, Kind, Name), Vec<Decl<'db>>>,
    in_any_library: FxHashMap<(Kind, Name), Vec<Decl<'db>>>,
    /// For each library, the libraries and message packages that it uses.
    uses: FxHashMap<Option<Name>, Vec<Name>>,
    libraries: FxHashSet<Name>,
    /// Where a declaration has no name: any name of its kind may be meant.
    nameless: FxHashSet<(Option<Name>, Kind)>,
    /// See [`crate::item_tree::ItemTree::possible_names`].
    possible_names: FxHashSet<(Option<Name>, Option<Name>)>,
    /// Whether all files are known: one that is missing or unreadable may declare anything.
    pub completeness: Completeness,
    /// The first file whose text is unknown, or in which a declaration or its library is.
    pub incomplete_file: Option<File>,
}

/// The names of a project. A change *in* a declaration does not change them.
#[salsa::tracked(returns(ref))]
pub fn names_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Names<'db> {
    let mut names = Names {
        all: Vec::new(),
        by_name: FxHashMap::default(),
        in_any_library: FxHashMap::default(),
        uses: FxHashMap::default(),
        libraries: FxHashSet::default(),
        nameless: FxHashSet::default(),
        possible_names: FxHashSet::default(),
        completeness: Completeness::Complete,
        incomplete_file: None,
    };
    for &file in project_files(db, project) {
        let declarations = declarations(db, file);
        let are_included = includes(db, project.workspace(db), file).iter().all(Option::is_some);
        let is_read = Completeness::of(are_included && file.problem(db).is_none());
        names.completeness &= declarations.include_completeness & is_read;
        names.possible_names.extend(declarations.possible_names.iter().cloned());
        names.libraries.extend(declarations.libraries.iter().filter(|name| !name.is_empty()).cloned());
        // Of a text that may be another, any declaration may be.
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
            if name.is_empty() {
                names.nameless.insert((library, decl.kind(db)));
            } else {
                names.in_any_library.entry((decl.kind(db), name.clone())).or_default().push(decl);
                names.by_name.entry((library, decl.kind(db), name)).or_default().push(decl);
            }
        }
    }
    // If the salvaged name is declared elsewhere, the broken declaration's own name is unknown.
    let declared: FxHashSet<&Name> = if names.possible_names.is_empty() {
        FxHashSet::default()
    } else {
        names.all.iter().map(|it| it.name(db)).collect()
    };
    let is_declared = |name: &Option<Name>| name.as_ref().is_some_and(|name| declared.contains(name));
    let more: Vec<Option<Name>> =
        names.possible_names.iter().filter(|(_, name)| is_declared(name)).map(|(of, _)| of.clone()).collect();
    names.possible_names.extend(more.into_iter().map(|of| (of, None)));
    names
}

/// What may hide the declaration of a name that is not found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum MayHide {
    MissingFile,
    SyntaxError,
}

/// Why a name is not resolved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unresolved {
    /// No declaration of that kind has the name.
    Unknown,
    /// Several libraries have it.
    Ambiguous,
    /// One library has it twice. That is reported already, where the second stands.
    Repeated,
    /// The name itself is missing; that is reported already.
    Missing,
    /// A missing file or a damaged text may declare it. That is reported already.
    Incomplete,
}

impl<'db> Names<'db> {
    /// Returns all declarations of a kind, in the order of the files.
    pub fn of_kind(
        &self,
        db: &'db dyn ModelDb,
        kind: Kind,
    ) -> impl Iterator<Item = Decl<'db>> + use<'_, 'db> {
        self.all.iter().copied().filter(move |decl| decl.kind(db) == kind)
    }

    /// All declarations of this kind and name in that library; more than one is an error.
    pub fn in_library(&self, library: Option<&Name>, kind: Kind, name: &Name) -> &[Decl<'db>] {
        self.by_name.get(&(library.cloned(), kind, name.clone())).map_or(&[], Vec::as_slice)
    }

    /// All declarations of this kind and name, in any library.
    pub fn anywhere(&self, kind: Kind, name: &str) -> &[Decl<'db>] {
        self.in_any_library.get(&(kind, name.into())).map_or(&[], Vec::as_slice)
    }

    /// What a key of a timing table, `library.name` or `name`, means; more than one is an error.
    pub fn by_key(&self, kind: Kind, key: &str) -> &[Decl<'db>] {
        match key.rsplit_once('.') {
            Some((library, name)) => self.in_library(Some(&library.into()), kind, &name.into()),
            // What stands outside libraries has no other key.
            None => match self.in_library(None, kind, &key.into()) {
                [] => self.anywhere(kind, key),
                outside => outside,
            },
        }
    }

    /// What `path`, written in `library`, means: looked up there, then in the libraries that it uses. What stands
    /// outside any library sees everything.
    pub fn resolve(
        &self,
        db: &'db dyn ModelDb,
        library: Option<&Name>,
        kind: Kind,
        path: &[Name],
    ) -> Result<Decl<'db>, Unresolved> {
        let found: Vec<Decl<'db>> = match path {
            [name] => {
                let own = self.in_library(library, kind, name);
                match own {
                    [] => self
                        .visible(library)
                        .flat_map(|it| self.in_library(Some(it), kind, name))
                        .copied()
                        .collect(),
                    own => own.to_vec(),
                }
            }
            [of, name] => self.in_library(Some(of), kind, name).to_vec(),
            _ => Vec::new(),
        };
        // What a missing file may declare, or a declaration without a name may be, is not looked for elsewhere; and its
        // absence is no second mistake.
        let own = |decl: &Decl<'db>| decl.library(db).as_ref() == library;
        let may_be = |name: &Name| {
            let own = library.cloned();
            self.nameless.contains(&(own.clone(), kind))
                || self.possible_names.contains(&(own.clone(), None))
                || self.possible_names.contains(&(own, Some(name.clone())))
        };
        let hidden = match path {
            [name] if name.is_empty() || found.iter().any(own) => false,
            [name] => self.completeness.is_incomplete() || may_be(name),
            [of, _] if found.is_empty() => {
                self.completeness.is_incomplete() || self.nameless.contains(&(Some(of.clone()), kind))
            }
            _ => false,
        };
        match found.as_slice() {
            _ if hidden => Err(Unresolved::Incomplete),
            [decl] => Ok(*decl),
            [] if path.is_empty() || path.iter().any(|id| id.is_empty()) => Err(Unresolved::Missing),
            // The error between two declarations may hide it.
            [] if self.incomplete_file.is_some() => Err(Unresolved::Incomplete),
            [] => Err(Unresolved::Unknown),
            [first, rest @ ..] if rest.iter().all(|it| it.library(db) == first.library(db)) => {
                Err(Unresolved::Repeated)
            }
            _ => Err(Unresolved::Ambiguous),
        }
    }

    /// [`Names::resolve`] for the name of a type, shell, core, component or architecture.
    pub fn resolve_type(
        &self,
        db: &'db dyn ModelDb,
        from: Decl<'db>,
        kind: Kind,
        ty: Option<&TypeRef>,
    ) -> Result<Decl<'db>, Unresolved> {
        let Some(ty) = ty else { return Err(Unresolved::Missing) };
        self.resolve(db, from.library(db).as_ref(), kind, &ty.path)
    }

    /// The libraries whose declarations are seen in `library`, beside its own: those that it uses, or, outside libraries, all.
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

    /// Does the project have a library of this name?
    pub fn has_library(&self, name: &Name) -> bool {
        self.libraries.contains(name)
    }

    /// The libraries of the project.
    pub fn libraries(&self) -> impl Iterator<Item = &Name> {
        self.libraries.iter()
    }

    /// Returns whether a missing file or a damaged text may declare names.
    pub(crate) fn may_miss_names(&self) -> bool {
        self.completeness.is_incomplete() || !self.possible_names.is_empty() || !self.nameless.is_empty()
    }

    /// What may hide the declaration of a name that is not found ([`Unresolved::Incomplete`]).
    pub fn may_hide(&self) -> MayHide {
        if self.completeness.is_incomplete() { MayHide::MissingFile } else { MayHide::SyntaxError }
    }

    /// The path of this kind, as it may be written in `library`, that `path` may be a misspelling of.
    pub fn similar(
        &self,
        db: &'db dyn ModelDb,
        library: Option<&Name>,
        kind: Kind,
        path: &[Name],
    ) -> Option<Name> {
        let (of, name) = match path {
            [name] => (None, name),
            [of, name] => (Some(of), name),
            _ => return None,
        };
        let visible: FxHashSet<Option<&Name>> = match of {
            Some(of) => FxHashSet::from_iter([Some(of)]),
            None => self.visible(library).map(Some).chain([library]).collect(),
        };
        let is_seen =
            |decl: &&Decl<'db>| decl.kind(db) == kind && visible.contains(&decl.library(db).as_ref());
        let near = similar(name, self.all.iter().filter(is_seen).map(|decl| decl.name(db)))?;
        Some(of.map_or_else(|| near.clone(), |of| format!("{of}.{near}").into()))
    }
}

/// The one of `names` that `name` may be a misspelling of.
pub fn similar<'a>(name: &str, names: impl IntoIterator<Item = &'a Name>) -> Option<Name> {
    mauve_syntax::similar(name, names.into_iter().map(Name::as_str)).map(Name::from)
}

/// What files of the workspace that are not part of a project declare.
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

/// A file that declares `name` and is not included.
pub fn file_outside<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    kind: Kind,
    name: &Name,
) -> Option<File> {
    declared_outside(db, project).get(&(kind, name.clone())).copied()
}
