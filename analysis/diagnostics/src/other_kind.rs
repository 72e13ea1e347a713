//! Names that refer to a declaration of another kind than the text needs: a core where a component belongs.

use super::*;
use mauve_hir::{core_of, first_target_of, shell_of};

impl<'db> Scope<'db> {
    /// Returns the kind of the declaration that `path` refers to, and the related declaration of `kind`: the
    /// component of that core. Returns `None` if `path` refers to nothing, or if a declaration of `kind` has the name elsewhere.
    pub(super) fn of_another_kind(self, kind: Kind, path: &[Name]) -> Option<(Kind, Option<Name>)> {
        let Scope { db, project, of } = self;
        let names = names_of(db, project);
        let library = of.library(db).as_ref();
        if !names.anywhere(kind, path.last()?).is_empty() {
            return None;
        }
        let others = [Kind::Component, Kind::Core, Kind::Shell, Kind::Architecture, Kind::Deployment];
        let resolve = |other: Kind| names.resolve(db, library, other, path).ok();
        let (other, found) = others.into_iter().find_map(|other| Some((other, resolve(other)?)))?;
        let all = |kind: Kind| names.of_kind(db, kind);
        let with_core = || all(Kind::Component).filter(|it| core_of(db, project, *it) == Some(found));
        let with_shell = |kind: Kind| all(kind).filter(|it| shell_of(db, project, *it) == Some(found));
        let related: Vec<Decl<'db>> = match (kind, other) {
            (Kind::Component, Kind::Core) => with_core().collect(),
            (Kind::Component | Kind::Core, Kind::Shell) => with_shell(kind).collect(),
            (Kind::Shell, Kind::Component) => shell_of(db, project, found).into_iter().collect(),
            (Kind::Shell, Kind::Core) => {
                let of_components = with_core().filter_map(|it| shell_of(db, project, it));
                shell_of(db, project, found).into_iter().chain(of_components).take(1).collect()
            }
            (Kind::Core, Kind::Component) => core_of(db, project, found).into_iter().collect(),
            (Kind::Architecture, Kind::Deployment) => {
                first_target_of(db, project, found).into_iter().collect()
            }
            _ => Vec::new(),
        };
        let name = match related.as_slice() {
            [one] => self.written_in(*one),
            _ => None,
        };
        Some((other, name))
    }

    /// Returns how the name of `decl` is written here: with its library where that is needed.
    pub(super) fn written_in(self, decl: Decl<'db>) -> Option<Name> {
        let Scope { db, project, of } = self;
        let (name, library) = (decl.name(db), of.library(db).as_ref());
        let resolved = names_of(db, project).resolve(db, library, decl.kind(db), std::slice::from_ref(name));
        if resolved == Ok(decl) {
            return Some(name.clone());
        }
        decl.library(db).as_ref().map(|library| format!("{library}.{name}").into())
    }

    /// Returns the name of the only declaration that is called like `path`, with its library: the library in `path` is wrong.
    pub(super) fn in_right_library(self, kind: Kind, path: &[Name]) -> Option<Name> {
        let [_, name] = path else { return None };
        match names_of(self.db, self.project).anywhere(kind, name) {
            [one] => self.written_in(*one),
            _ => None,
        }
    }
}
