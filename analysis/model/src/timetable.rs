//! The execution times of a project: its timing tables, joined, with the names in them resolved.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

use globset::GlobBuilder;
use mauve_timing::{Entry, Level, Table, Time, Times};
use rustc_hash::FxHashMap;

use crate::behaviour::behaviour_of;
use crate::diagnostics::{self, Diagnostic};
use crate::item_tree::{Kind, Name};
use crate::names::{names_of, similar};
use crate::project::{Project, config_file, config_of, projects};
use crate::psm::core_of;
use crate::source::{Decl, Place};
use crate::{File, ModelDb, Workspace, normalised};

/// A table's content.
#[salsa::tracked(returns(ref))]
pub fn table(db: &dyn ModelDb, file: File) -> Table {
    Table::parse(file.text(db))
}

/// The tables that the configuration names, in the order of their paths; and what is wrong with those names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableFiles {
    /// The tables.
    pub files: Vec<File>,
    /// Patterns that name none, or are none.
    pub errors: Vec<(String, Range<usize>)>,
}

/// Finds the tables of a workspace.
#[salsa::tracked(returns(ref))]
pub fn table_files(db: &dyn ModelDb, workspace: Workspace) -> TableFiles {
    let mut files = BTreeMap::new();
    let mut errors = Vec::new();
    for (pattern, span) in &config_of(db, workspace).tables {
        let absolute = normalised(&workspace.folder(db).join(pattern));
        let Some(absolute) = absolute.to_str() else { continue };
        let glob = match GlobBuilder::new(absolute).literal_separator(true).build() {
            Ok(glob) => glob.compile_matcher(),
            Err(error) => {
                errors.push((format!("`{pattern}` is not a pattern of paths: {error}"), span.clone()));
                continue;
            }
        };
        let before = files.len();
        let known = workspace.files(db).iter();
        files.extend(
            known.filter(|(path, _)| glob.is_match(path)).map(|(path, file)| (path.as_path(), *file)),
        );
        if files.len() == before {
            let message = format!("`{pattern}` names no timing table: no such file");
            errors.push((message, span.clone()));
        }
    }
    TableFiles { files: files.into_values().collect(), errors }
}

/// Where a time stands: a table, a section of it, an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
struct Slot {
    file: File,
    section: Section,
    index: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Section {
    Codel,
    Program,
    Component,
}

/// The times of a project.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Timetable<'db> {
    codels: FxHashMap<Decl<'db>, Vec<Slot>>,
    /// By component and the key behind `Component/`.
    programs: FxHashMap<(Decl<'db>, String), Vec<Slot>>,
    components: FxHashMap<Decl<'db>, Vec<Slot>>,
    overhead: Option<File>,
    tables: Vec<File>,
    assume: Option<Time>,
    /// Something was lost that may make every time longer: nothing is analysed.
    pub lost: Option<(String, Place<'db>)>,
    /// Components that an entry which means nothing may have been for.
    doubtful: FxHashMap<Decl<'db>, (String, Place<'db>)>,
    /// What is wrong in the tables and in how they are named.
    pub diagnostics: Vec<Diagnostic<'db>>,
}

/// What a table says of a time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lookup {
    /// This.
    Known(Time),
    /// This, by `[assume]`: no table has it.
    Assumed(Time),
    /// Nothing.
    Absent,
    /// Something, but not at this level.
    OtherLevels(String),
    /// Something that cannot be used; why, in the user's words. It is reported where it stands.
    Unusable(String),
}

/// Joins the tables of a project.
#[salsa::tracked(returns(ref))]
pub fn timetable_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Timetable<'db> {
    let workspace = project.workspace(db);
    let found = table_files(db, workspace);
    let config = config_of(db, workspace);
    let mut times = Timetable { tables: found.files.clone(), assume: config.assume, ..Timetable::default() };
    if let Some(file) = config_file(db, workspace) {
        let at = |span: &Range<usize>| Place::Range(file, span.start as u32, span.end as u32);
        if config.lost
            && let Some((message, span)) = config.errors.first()
        {
            times.lost = Some((format!("mauve.toml: {message}"), at(span)));
        }
        for (message, span) in &found.errors {
            times.diagnostics.push(diagnostics::invalid_configuration::report(at(span), message.clone()));
            times.lost.get_or_insert_with(|| (format!("mauve.toml: {message}"), at(span)));
        }
    }
    for &file in &found.files {
        times.add(db, project, file);
    }
    times.report_repeated(db);
    times
}

impl<'db> Timetable<'db> {
    fn add(&mut self, db: &'db dyn ModelDb, project: Project<'db>, file: File) {
        let table = table(db, file);
        let name = file_name(db, file);
        if let Some(problem) = file.problem(db) {
            let at = Place::Range(file, 0, 0);
            self.diagnostics.push(diagnostics::invalid_table::report(at.clone(), problem.clone()));
            self.lost.get_or_insert_with(|| (format!("{name}: {problem}"), at));
        }
        for error in &table.errors {
            let at = Place::Range(file, error.span.start as u32, error.span.end as u32);
            if table.lost {
                self.lost.get_or_insert_with(|| (format!("{name}: {}", error.message), at.clone()));
            }
            self.diagnostics.push(diagnostics::invalid_table::report(at, error.message.clone()));
        }
        if table.lost {
            return;
        }
        if table.overhead != mauve_timing::Overhead::default() {
            if let Some(first) = self.overhead {
                let message = format!("[overhead] stands in {} already: write it once", file_name(db, first));
                let at = Place::Range(file, 0, 0);
                self.diagnostics.push(diagnostics::invalid_table::report(at.clone(), message.clone()));
                self.lost.get_or_insert((format!("{name}: {message}"), at));
            }
            self.overhead = Some(file);
        }
        for (index, entry) in table.codels.iter().enumerate() {
            self.codel(db, project, Slot { file, section: Section::Codel, index }, entry);
        }
        for (index, entry) in table.programs.iter().enumerate() {
            self.program(db, project, Slot { file, section: Section::Program, index }, entry);
        }
        for (index, entry) in table.components.iter().enumerate() {
            let slot = Slot { file, section: Section::Component, index };
            for component in self.component(db, project, file, entry, &entry.key, Kind::Component) {
                self.components.entry(component).or_default().push(slot);
            }
        }
    }

    fn codel(&mut self, db: &'db dyn ModelDb, project: Project<'db>, slot: Slot, entry: &Entry) {
        for codel in self.component(db, project, slot.file, entry, &entry.key, Kind::Codel) {
            self.codels.entry(codel).or_default().push(slot);
        }
    }

    /// The declarations that a key of a table names: one, or none with the reason reported, or all that it may mean.
    fn component(
        &mut self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
        file: File,
        entry: &Entry,
        key: &str,
        kind: Kind,
    ) -> Vec<Decl<'db>> {
        let names = names_of(db, project);
        let at = Place::Range(file, entry.key_span.start as u32, entry.key_span.end as u32);
        let found = match key.rsplit_once('.') {
            Some((library, name)) => names.in_library(Some(&library.into()), kind, &name.into()).to_vec(),
            None => names.anywhere(db, kind, key),
        };
        match found.as_slice() {
            [] if is_known_elsewhere(db, project, kind, key) => Vec::new(),
            [] => {
                let all: Vec<(Name, Decl<'db>)> = names
                    .all
                    .iter()
                    .filter(|decl| decl.kind(db) == kind)
                    .flat_map(|&decl| [(decl.qualified(db).into(), decl), (decl.name(db).clone(), decl)])
                    .collect();
                let near = similar(key, all.iter().map(|(name, _)| name));
                let meant = all.iter().find(|(name, _)| Some(name) == near.as_ref()).map(|(_, decl)| *decl);
                if kind == Kind::Component
                    && let Some(meant) = meant
                {
                    let why = format!("{}: the key `{}` may be meant for it", file_name(db, file), entry.key);
                    self.doubtful.insert(meant, (why, at.clone()));
                }
                self.diagnostics.push(diagnostics::unknown_timing_key::report(
                    at,
                    &kind.to_string(),
                    key,
                    near,
                ));
                Vec::new()
            }
            [_] => found,
            [first, ..] => {
                let hint = first.qualified(db);
                self.diagnostics.push(diagnostics::unknown_timing_key::ambiguous(at.clone(), key, &hint));
                for &decl in &found {
                    let why = format!("{}: the key `{key}` means several of that name", file_name(db, file));
                    self.doubtful.insert(decl, (why, at.clone()));
                }
                Vec::new()
            }
        }
    }

    fn program(&mut self, db: &'db dyn ModelDb, project: Project<'db>, slot: Slot, entry: &Entry) {
        let at = Place::Range(slot.file, entry.key_span.start as u32, entry.key_span.end as u32);
        let Some((component, program)) = entry.key.split_once('/') else {
            let message = "the key of a program is `Component/update`, `Component/state.run`, \
                           `Component/state.transition.guard`, `Component/state.transition.effect` or \
                           `Component/operation`";
            self.diagnostics.push(diagnostics::invalid_table::report(at.clone(), message.to_owned()));
            let why = format!("{}: `{}` is not the key of a program", file_name(db, slot.file), entry.key);
            self.lost.get_or_insert((why, at));
            return;
        };
        for component in self.component(db, project, slot.file, entry, component, Kind::Component) {
            let known = core_of(db, project, component).map(|core| behaviour_of(db, project, core));
            let keys: Vec<Name> = known.map_or_else(Vec::new, |behaviour| {
                behaviour
                    .programs
                    .iter()
                    .chain(&behaviour.operations)
                    .map(|it| it.key.as_str().into())
                    .collect()
            });
            if !keys.iter().any(|key| key == program) {
                let near = similar(program, &keys);
                let near = near.map(|near| format!("{}/{near}", component.name(db)).into());
                let what = format!("program of {}", component.name(db));
                self.diagnostics.push(diagnostics::unknown_timing_key::report(
                    at.clone(),
                    &what,
                    program,
                    near,
                ));
                let why = format!("{}: `{}` is no program of it", file_name(db, slot.file), entry.key);
                self.doubtful.insert(component, (why, at.clone()));
            }
            self.programs.entry((component, program.to_owned())).or_default().push(slot);
        }
    }

    /// One thing with two times: an error at each but the first, and neither counts.
    fn report_repeated(&mut self, db: &'db dyn ModelDb) {
        let slots = self.codels.values().chain(self.programs.values()).chain(self.components.values());
        for slots in slots.filter(|slots| slots.len() > 1) {
            let Some((first, rest)) = slots.split_first() else { continue };
            for slot in rest {
                let (at, key) = slot.place(db);
                let first = (first.place(db).0, file_name(db, first.file));
                self.diagnostics.push(diagnostics::invalid_table::repeated(at, &key, first));
            }
        }
        let key = |it: &Diagnostic<'db>| match it.at {
            Place::Range(file, start, _) => (file.path(db).clone(), start, it.message.clone()),
            _ => Default::default(),
        };
        self.diagnostics.sort_by_key(key);
    }

    /// The time of one execution of a codel.
    pub fn codel_time(&self, db: &'db dyn ModelDb, codel: Decl<'db>, level: Level) -> Lookup {
        let what = || format!("codel `{}`", codel.qualified(db));
        if let Some((why, _)) = self.doubtful.get(&codel) {
            return Lookup::Unusable(why.clone());
        }
        match (self.time(db, self.codels.get(&codel), level, what), self.assume) {
            (Lookup::Absent, Some(time)) => Lookup::Assumed(time),
            (found, _) => found,
        }
    }

    /// The time of a program as a whole.
    pub fn program_time(
        &self,
        db: &'db dyn ModelDb,
        component: Decl<'db>,
        key: &str,
        level: Level,
    ) -> Lookup {
        let what = || format!("`{}/{key}`", component.name(db));
        self.time(db, self.programs.get(&(component, key.to_owned())), level, what)
    }

    /// The time of a component as a whole, for the classic method.
    pub fn component_time(&self, db: &'db dyn ModelDb, component: Decl<'db>, level: Level) -> Lookup {
        let what = || format!("component `{}`", component.name(db));
        self.time(db, self.components.get(&component), level, what)
    }

    /// Why a component is not analysed whatever its codels take.
    pub fn doubt(&self, component: Decl<'db>) -> Option<&(String, Place<'db>)> {
        self.doubtful.get(&component)
    }

    /// Dispatch and two context switches, for each job; nothing where they have no time at this level.
    pub fn overhead(&self, db: &'db dyn ModelDb, level: Level) -> Option<Time> {
        let Some(file) = self.overhead else { return Some(Time::ZERO) };
        let table = table(db, file);
        let dispatch = table.time(&table.overhead.dispatch, level)?;
        let switch = table.time(&table.overhead.context_switch, level)?;
        switch.checked_mul(2)?.checked_add(dispatch)
    }

    /// Is there no time for anything?
    pub fn is_empty(&self) -> bool {
        self.codels.is_empty() && self.programs.is_empty() && self.assume.is_none()
    }

    /// The levels at which every table holds, from the most probable down; none where no time depends on a level.
    pub fn levels(&self, db: &'db dyn ModelDb) -> Vec<Level> {
        let tables: Vec<&Table> = self.tables.iter().map(|&file| table(db, file)).collect();
        let all: BTreeSet<Level> = tables.iter().flat_map(|table| table.levels.iter().copied()).collect();
        all.into_iter().rev().filter(|&level| tables.iter().all(|table| table.covers(level))).collect()
    }

    fn time(
        &self,
        db: &'db dyn ModelDb,
        slots: Option<&Vec<Slot>>,
        level: Level,
        what: impl Fn() -> String,
    ) -> Lookup {
        let slot = match slots.map_or(&[] as &[Slot], Vec::as_slice) {
            [] => return Lookup::Absent,
            [slot] => slot,
            [first, second, ..] => {
                let (first, second) = (file_name(db, first.file), file_name(db, second.file));
                return Lookup::Unusable(format!("{} has two times, in {first} and {second}", what()));
            }
        };
        let table = table(db, slot.file);
        let name = file_name(db, slot.file);
        let Some(times) = slot.entry(table).and_then(|entry| entry.value.as_ref()) else {
            return Lookup::Unusable(format!("the time of {} in {name} has an error", what()));
        };
        match (table.time(times, level), times) {
            (Some(time), _) => Lookup::Known(time),
            (None, Times::Always(_)) => Lookup::Absent,
            (None, Times::PerLevel(_)) => {
                let levels: Vec<String> = table.levels.iter().map(Level::to_string).collect();
                let levels = levels.join(", ");
                Lookup::OtherLevels(format!(
                    "no time for {} at {level}: {name} has the levels {levels}",
                    what()
                ))
            }
        }
    }
}

impl Slot {
    fn entry(self, table: &Table) -> Option<&Entry> {
        match self.section {
            Section::Codel => table.codels.get(self.index),
            Section::Program => table.programs.get(self.index),
            Section::Component => table.components.get(self.index),
        }
    }

    fn place<'db>(self, db: &'db dyn ModelDb) -> (Place<'db>, String) {
        let entry = self.entry(table(db, self.file));
        let span = entry.map_or(0..0, |entry| entry.key_span.clone());
        let at = Place::Range(self.file, span.start as u32, span.end as u32);
        (at, entry.map_or_else(String::new, |entry| entry.key.clone()))
    }
}

/// A table may serve several projects of a workspace: a key is unknown only where none of them has it.
fn is_known_elsewhere<'db>(db: &'db dyn ModelDb, project: Project<'db>, kind: Kind, key: &str) -> bool {
    let others = projects(db, project.workspace(db)).iter().filter(|&&other| other != project);
    others.into_iter().any(|&other| match key.rsplit_once('.') {
        Some((library, name)) => {
            !names_of(db, other).in_library(Some(&library.into()), kind, &name.into()).is_empty()
        }
        None => !names_of(db, other).anywhere(db, kind, key).is_empty(),
    })
}

fn file_name(db: &dyn ModelDb, file: File) -> String {
    file.path(db).file_name().map_or_else(String::new, |name| Path::new(name).display().to_string())
}
