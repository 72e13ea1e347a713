//! Unknown keys of timing tables: the times that they leave in question, and their facts.
//!
//! An entry with an unknown key has no effect; after a correction of the key, it gives the time of another subject. So the
//! possible subjects of the corrected key are in question if they have no entry. A subject with an entry would have a second
//! time after the correction, which is an error. In question are
//!
//! - a codel, a component or a program whose key or name is at most [`MOST_CHANGES`] letters away: the key may be misspelt,
//!   in its library, its component or its program; and the suggestion of the message;
//! - the codels, components and programs of the library that the key names, or of all libraries if it names none: one of them
//!   may have been renamed;
//! - a subject with exactly this key, if the entry is in the wrong section;
//! - programs of a state machine with exactly the key of this program, in any component: the component may have been renamed;
//! - a codel of this name in another library, also with an entry of its own: a call may refer to it by mistake.
//!
//! All other subjects keep their times: no correction of the key can name them.
//!
//! Consequences: a codel without an entry does not have the time of `[assume]`, a program does not have the sum of its
//! codels, a component has no response time by the classic method. A codel without an entry and without `[assume]` has no
//! time anyway; the codel nearest to a misspelt key is in question, so that the key is one mistake and not two.

use std::collections::BTreeMap;

use mauve_timing::TableSection;
use mauve_timing::table_keys::OVERHEAD;
use mauve_timing::toml_key::key_named;

use super::{TimetableBuilder, UnknownKey, may_replace};
use crate::fact::TimingFactKind;
use crate::reason::{StrayEntry, TableFault, Timed, UnusableTime, WrongProgram};
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, Location, ProgramId, ProgramKey, declarations, names_of, project_files, similar};
use mauve_syntax::is_within;

/// A misspelt key has at most so many letters more, less, changed or swapped.
const MOST_CHANGES: usize = 2;

/// With more unknown keys, the tables are of another project: everything is in question.
const MOST_UNKNOWN: usize = 256;

impl<'db> TimetableBuilder<'db> {
    /// Puts in question what the unknown keys may be for, and reports them. All tables are read.
    pub(crate) fn unknown_keys(&mut self) {
        let unknown = std::mem::take(&mut self.unknown);
        if let Some(first) = unknown.get(MOST_UNKNOWN) {
            self.incomplete(first.file, TableFault::ManyUnknownKeys(unknown.len()));
        } else {
            unknown.iter().for_each(|it| self.question(it));
        }
        let unknown: Vec<&UnknownKey<'db>> = unknown.iter().filter(|it| !it.is_reported).collect();
        let rest = self.report_libraries(&unknown);
        rest.into_iter().for_each(|it| self.report_key(it));
    }

    fn question(&mut self, unknown: &UnknownKey<'db>) {
        let (db, project) = (self.db, self.project);
        let names = names_of(db, project);
        let stray = unknown.stray();
        if key_named(&OVERHEAD, unknown.last()).is_some() && unknown.section != TableSection::Program {
            self.incomplete(unknown.file, TableFault::OfOverhead(unknown.key.clone()));
        }
        if unknown.section == TableSection::Codel {
            self.times.strays.insert(unknown.last().into(), stray.clone());
            let near = self.near(unknown);
            let nearest = near.into_iter().flat_map(|near| names.by_key(Kind::Codel, &near)).copied();
            let may_be: Vec<Decl<'db>> = match self.times.assume {
                None => nearest.collect(),
                Some(_) => nearest.chain(self.may_be(unknown, &unknown.key, Kind::Codel)).collect(),
            };
            self.put_in_question(may_be.into_iter().map(Timed::Codel), &stray);
            // A header such as `[codel.x]` is a part of the key.
            let components = names.anywhere(Kind::Component, unknown.last());
            self.put_in_question(components.iter().copied().map(Timed::Component), &stray);
        }
        if unknown.section == TableSection::Wait {
            let may_be = self.may_be(unknown, &unknown.key, Kind::Codel);
            self.put_in_question(may_be.into_iter().map(Timed::Wait), &stray);
        }
        if unknown.section == TableSection::Access {
            for component in self.may_be(unknown, &unknown.key, Kind::Component) {
                let accesses =
                    self.ports_of(component).into_iter().map(|port| Timed::Access(component, port));
                self.put_in_question(accesses, &stray);
            }
        }
        if unknown.section == TableSection::Component {
            let components = self.may_be(unknown, &unknown.key, Kind::Component);
            self.put_in_question(components.into_iter().map(Timed::Component), &stray);
            let codels = names.anywhere(Kind::Codel, unknown.last());
            self.put_in_question(codels.iter().copied().map(Timed::Codel), &stray);
        }
        if let Some(ProgramKey { component, program }) = ProgramKey::parse(&unknown.entry.key) {
            self.question_programs(unknown, component, &program, &stray);
        }
    }

    pub(super) fn put_in_question(
        &mut self,
        may_be: impl IntoIterator<Item = Timed<'db>>,
        stray: &StrayEntry,
    ) {
        for of in may_be {
            let unusable = || UnusableTime::Stray(stray.clone(), of.clone());
            self.times.unclear.entry(of.clone()).or_insert_with(unusable);
        }
    }

    /// Puts the programs in question that the key of a program may be for.
    fn question_programs(
        &mut self,
        unknown: &UnknownKey<'db>,
        component: &str,
        program: &ProgramId,
        stray: &StrayEntry,
    ) {
        let (db, project) = (self.db, self.project);
        let names = names_of(db, project);
        let (whole, key) = (&unknown.entry.key, program.to_string());
        let exact = names.by_key(Kind::Component, component);
        // The key is right, in the wrong section.
        if unknown.section != TableSection::Program
            && let [component] = *exact
            && self.programs_of(component).contains(program)
        {
            return self.put_in_question([Timed::Program(component, program.clone())], stray);
        }
        let possible = self.may_be(unknown, component, Kind::Component);
        for other in names.all.iter().copied().filter(|decl| decl.kind(db) == Kind::Component) {
            let is_possible = possible.contains(&other) || exact.contains(&other);
            let (name, qualified) = (other.name(db), other.qualified(db));
            for id in self.programs_of(other) {
                let its_key = id.to_string();
                let is_same = id == *program && program.state().is_some();
                let is_near = is_possible && is_within(&key, &its_key, MOST_CHANGES);
                let is_it =
                    |component: &str| is_within(whole, &format!("{component}/{its_key}"), MOST_CHANGES);
                if is_same || is_near || is_it(name) || is_it(&qualified) {
                    self.put_in_question([Timed::Program(other, id)], stray);
                }
            }
        }
        // Under [program], the component is in question already.
        if unknown.section != TableSection::Program {
            let without = exact.iter().filter(|it| !self.programs_of(**it).contains(program));
            for component in without.copied().collect::<Vec<_>>() {
                let wrong = WrongProgram { component, program: program.clone(), is_repeated: false };
                let unusable = UnusableTime::WrongProgram(stray.clone(), wrong);
                self.times.wrong_programs.insert(component, unusable);
            }
        }
    }

    /// Returns the declarations of a kind that `key`, all of the unknown key or its component, may be for.
    fn may_be(&self, unknown: &UnknownKey<'db>, key: &str, kind: Kind) -> Vec<Decl<'db>> {
        let db = self.db;
        let library: Option<Name> = key.rsplit_once('.').map(|(library, _)| library.into());
        let last = key.rsplit('.').next().unwrap_or(key);
        let near = self.near(unknown);
        let may_be = |decl: &Decl<'db>| {
            let (name, qualified) = (decl.name(db), decl.qualified(db));
            library.is_none()
                || *decl.library(db) == library
                || near.as_ref().is_some_and(|near| near == name || *near == qualified.as_str())
                || [(key, qualified.as_str()), (key, name.as_str()), (last, name.as_str())]
                    .iter()
                    .any(|(key, name)| is_within(key, name, MOST_CHANGES))
        };
        let declared = names_of(db, self.project).all.iter().copied();
        declared.filter(|decl| decl.kind(db) == kind).filter(may_be).collect()
    }

    /// Returns the key that an unknown key is most likely a misspelling of: of something without an entry, if possible.
    fn near(&self, unknown: &UnknownKey<'db>) -> Option<Name> {
        let (db, kind) = (self.db, unknown.kind());
        let program = ProgramKey::parse(&unknown.entry.key).map(|it| it.program);
        let has_entry = |decl: &Decl<'db>| {
            let of = match (unknown.section, &program) {
                (TableSection::Program, Some(program)) => Timed::Program(*decl, program.clone()),
                (TableSection::Codel, _) => Timed::Codel(*decl),
                (TableSection::Wait, _) => Timed::Wait(*decl),
                // Any of its ports may be meant.
                (TableSection::Access, _) => return false,
                _ => Timed::Component(*decl),
            };
            self.times.slots.contains_key(&of)
        };
        let declared = names_of(db, self.project).all.iter().filter(|decl| decl.kind(db) == kind);
        // `similar` compares with no more names.
        let declared: Vec<Decl<'db>> = declared.take(500).copied().collect();
        let keys = |decl: &Decl<'db>| [Name::from(decl.qualified(db)), decl.name(db).clone()];
        let without: Vec<Name> = declared.iter().filter(|it| !has_entry(it)).flat_map(keys).collect();
        similar(&unknown.key, &without)
            .or_else(|| similar(&unknown.key, &declared.iter().flat_map(keys).collect::<Vec<_>>()))
    }

    /// Reports each library that no model declares once for all keys that name it, and returns the other keys.
    fn report_libraries<'a>(&mut self, unknown: &[&'a UnknownKey<'db>]) -> Vec<&'a UnknownKey<'db>> {
        let (db, names) = (self.db, names_of(self.db, self.project));
        let mut of_library: BTreeMap<Name, Vec<&'a UnknownKey<'db>>> = BTreeMap::new();
        let mut rest = Vec::new();
        for &unknown in unknown {
            match unknown.library().filter(|library| !names.has_library(library)) {
                Some(library) => of_library.entry(library).or_default().push(unknown),
                None => rest.push(unknown),
            }
        }
        for (library, keys) in of_library {
            let is_used = || {
                let files = project_files(db, self.project).iter();
                let mut uses = files.flat_map(|&file| &declarations(db, file).all);
                uses.any(|decl| decl.kind(db) == Kind::Use && *decl.name(db) == library)
            };
            match keys.as_slice() {
                // A missing file may declare the library, or a `use` of it is reported.
                _ if self.may_be_declared() || is_used() => {}
                [] | [_] => rest.extend(keys),
                [first, ..] => {
                    let has_all = |other: &Name| {
                        let is_there = |it: &UnknownKey<'db>| {
                            !names.in_library(Some(other), it.kind(), &it.last().into()).is_empty()
                        };
                        keys.iter().all(|it| is_there(it))
                    };
                    let libraries: Vec<&Name> = names.libraries().collect();
                    let near = similar(&library, libraries).filter(has_all);
                    let written = keys.iter().filter_map(|it| {
                        let span = it.entry.written(0..library.len())?;
                        Some(Location::of_span(it.file, &span))
                    });
                    let written: Vec<Location<'db>> = written.collect();
                    let keys = keys.len();
                    let kind = TimingFactKind::UnknownTimingLibrary { library, keys, near, written };
                    self.report(first.at(), kind);
                }
            }
        }
        rest
    }

    /// Returns whether a missing file or a text with an error, which is reported itself, may declare any name.
    fn may_be_declared(&self) -> bool {
        let names = names_of(self.db, self.project);
        names.may_miss_names() || names.incomplete_file.is_some()
    }

    fn report_key(&mut self, unknown: &UnknownKey<'db>) {
        let (db, names, kind) = (self.db, names_of(self.db, self.project), unknown.kind());
        let key = unknown.key.clone();
        let is_of = |kind| !names.by_key(kind, &key).is_empty();
        let section = match unknown.section {
            TableSection::Program | TableSection::Wait | TableSection::Access => None,
            _ if ProgramKey::parse(&key).is_some() => Some(TableSection::Program),
            TableSection::Codel if is_of(Kind::Component) => Some(TableSection::Component),
            TableSection::Component if is_of(Kind::Codel) => Some(TableSection::Codel),
            _ if key_named(&OVERHEAD, unknown.last()).is_some() => Some(TableSection::Overhead),
            _ => None,
        };
        if let Some(section) = section {
            return self.report(unknown.at(), TimingFactKind::WrongTableSection { key, section });
        }
        // What is missing, which is an error of its own, may declare the name.
        if names.may_declare(kind, &key) {
            return;
        }
        let near = self.near(unknown);
        let rest = unknown.entry.key.get(unknown.key.len()..).unwrap_or_default();
        let fixed = near.as_ref().map(|near| format!("{near}{rest}"));
        let fixed = fixed.filter(|fixed| may_replace(db, unknown.file, unknown.entry, fixed));
        self.report(unknown.at(), TimingFactKind::UnknownTimingKey { kind, key, near, fixed });
    }
}
