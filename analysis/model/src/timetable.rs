//! The execution times of a project: its timing tables, joined, with the names in them resolved.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use globset::{GlobBuilder, GlobMatcher};
use mauve_timing::{Entry, Level, Overhead, Table, Time, Times};
use rustc_hash::FxHashMap;

use crate::behaviour::behaviour_of;
use crate::config::Mistake;
use crate::diagnostics::{Diagnostic, invalid_table, unknown_timing_key};
use crate::item_tree::{FeatureKind, HookKind, Kind, Name};
use crate::names::{features_of, names_of, similar};
use crate::program_id::{ProgramId, ProgramKey};
use crate::project::{CONFIG_FILE, Project, all_roots, config_file, config_of};
use crate::psm::{core_of, is_core_for, shell_of};
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
    let mut files: BTreeMap<&Path, File> = BTreeMap::new();
    let mut errors = Vec::new();
    let config = workspace.folder(db).join(CONFIG_FILE);
    for (pattern, span) in &config_of(db, workspace).tables {
        let glob = match table_pattern(workspace.folder(db), pattern) {
            Ok(glob) => glob,
            Err(why) => {
                errors.push((format!("`{}`: {why}", shortened(pattern)), span.clone()));
                continue;
            }
        };
        let known = workspace.files(db).iter().filter(|(path, _)| **path != config);
        let named = known.filter(|(path, _)| glob.is_match(path));
        let named: Vec<File> = named.map(|(_, file)| *file).collect();
        if named.is_empty() {
            errors.push((format!("`{pattern}` names no timing table: no such file"), span.clone()));
        }
        for file in named {
            match file.problem(db).as_ref().filter(|_| file.is_outside(db)) {
                Some(problem) => errors.push((problem.message().to_owned(), span.clone())),
                None => _ = files.insert(file.path(db).as_path(), file),
            }
        }
    }
    if let Some((_, span)) = config_of(db, workspace).tables.first() {
        let unreadable = workspace.unreadable(db).iter();
        errors
            .extend(unreadable.map(|why| (format!("not all timing tables are known: {why}"), span.clone())));
    }
    TableFiles { files: files.into_values().collect(), errors }
}

/// What paths a pattern of `[timing] tables` names, from the configuration's folder. `*` and `?` do not cross folders,
/// `**` does.
///
/// # Errors
///
/// The pattern is none, is too long, or chooses between names: why, in words for the user.
pub fn table_pattern(folder: &Path, pattern: &str) -> Result<GlobMatcher, String> {
    if has_choice(pattern) {
        let why =
            "`{` and `[` choose between names, and a file may be missing: write a pattern for each name";
        return Err(why.to_owned());
    }
    // No system has longer paths.
    if pattern.len() > LONGEST_PATTERN {
        return Err(format!("a pattern has at most {LONGEST_PATTERN} bytes"));
    }
    // The folder is a path, whatever letters it has: only the pattern is one.
    let escaped = PathBuf::from(globset::escape(&folder.to_string_lossy()));
    let absolute = normalised(&escaped.join(pattern));
    let absolute = absolute.to_string_lossy();
    // A backslash is a letter of a folder's name; `[*]` is a star.
    let glob = GlobBuilder::new(&absolute).literal_separator(true).backslash_escape(false).build();
    let not_one = |error| format!("this is not a pattern of paths: {error}");
    Ok(glob.map_err(not_one)?.compile_matcher())
}

const LONGEST_PATTERN: usize = 4096;

/// The beginning of a text, where all of it would be too long for a message.
fn shortened(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(80) {
        Some((end, _)) => Cow::Owned(format!("{}…", text.get(..end).unwrap_or_default())),
        None => Cow::Borrowed(text),
    }
}

/// Does a pattern choose between names, so that a missing table goes unnoticed? (`[x]` is the letter `x`.)
fn has_choice(pattern: &str) -> bool {
    let mut letters = pattern.chars();
    while let Some(letter) = letters.next() {
        match letter {
            // `[!` and `[^` begin what is left out.
            '[' if letters.next().is_none_or(|letter| matches!(letter, '!' | '^')) => return true,
            '[' if letters.next() != Some(']') => return true,
            '{' | '}' => return true,
            _ => {}
        }
    }
    false
}

/// The pattern of `[timing] tables` that names one path and no other.
pub fn pattern_of_path(path: &str) -> String {
    globset::escape(path)
}

/// What an entry of a table is for.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
enum Of<'db> {
    Codel(Decl<'db>),
    /// By [`ProgramId::in_table`].
    Program(Decl<'db>, ProgramId),
    Component(Decl<'db>),
}

/// What one table says of one thing. No place stands here: a comment in a table changes no time.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
struct Slot {
    file: File,
    levels: Arc<[Level]>,
    /// None where the entry has an error.
    times: Option<Times>,
}

/// The times of a project.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Timetable<'db> {
    slots: FxHashMap<Of<'db>, Vec<Slot>>,
    /// What an entry that means several things may have been for, and why: used where nothing else gives a time.
    doubts: FxHashMap<Of<'db>, String>,
    /// Components that have an entry for a program that they do not have: it may be for any of their programs.
    doubtful: FxHashMap<Decl<'db>, String>,
    /// An entry for something that is not declared: it may be for any codel that has no other time.
    stray_codel: Option<String>,
    /// Those entries by the name of the codel: they may be for one of that name in another library, whatever its time.
    strays: FxHashMap<Name, String>,
    /// An entry that may be for any component without a time of its own.
    stray_component: Option<String>,
    overhead: Option<(File, Arc<[Level]>, Overhead)>,
    /// The levels at which all times hold, from the most probable down.
    levels: Vec<Level>,
    /// Levels that only some tables have, each with a table that does not.
    partial: Vec<(Level, String)>,
    /// The tables in which some time depends on the level, with their levels.
    with_levels: Vec<(String, Vec<Level>)>,
    assume: Option<Time>,
    /// Something was lost that may make every time longer: nothing is analysed.
    pub lost: Option<(String, File)>,
}

/// What the tables say of a time.
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

/// The times of a project: its tables, joined. No place stands in them: a comment in a table changes nothing.
#[salsa::tracked(returns(ref))]
pub fn timetable_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Timetable<'db> {
    joined(db, project).0.clone()
}

/// What is wrong in the tables.
pub(crate) fn table_diagnostics<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> &'db [Diagnostic<'db>] {
    &joined(db, project).1
}

#[salsa::tracked(returns(ref), no_eq)]
fn joined<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> (Timetable<'db>, Vec<Diagnostic<'db>>) {
    let workspace = project.workspace(db);
    let found = table_files(db, workspace);
    let config = config_of(db, workspace);
    let times = Timetable { assume: config.assume, ..Timetable::default() };
    let mut joining = Joining { db, project, times, diagnostics: Vec::new(), places: FxHashMap::default() };
    if let Some(file) = config_file(db, workspace) {
        if config.lost
            && let Some(Mistake { message, .. }) = config.errors.iter().min_by_key(|it| it.span.start)
        {
            joining.lost(file, message);
        }
        for (message, _) in &found.errors {
            joining.lost(file, message);
        }
    }
    let mut tables = Vec::new();
    for &file in &found.files {
        let table = table(db, file);
        tables.push(table);
        joining.table(file, table);
    }
    joining.report_repeated();
    let all: BTreeSet<Level> = tables.iter().flat_map(|table| table.levels.iter().copied()).collect();
    for (table, &file) in tables.iter().zip(&found.files) {
        if table.depends_on_level() {
            joining.times.with_levels.push((file_name(db, file), table.levels.clone()));
        }
    }
    for level in all.into_iter().rev() {
        match tables.iter().position(|table| !table.covers(level)).and_then(|index| found.files.get(index)) {
            None => joining.times.levels.push(level),
            Some(without) => joining.times.partial.push((level, file_name(db, *without))),
        }
    }
    (joining.times, joining.diagnostics)
}

/// A timetable that is being made, and where its entries stand.
struct Joining<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    times: Timetable<'db>,
    diagnostics: Vec<Diagnostic<'db>>,
    places: FxHashMap<Of<'db>, Vec<(File, Place<'db>, String)>>,
}

impl<'db> Joining<'db> {
    fn lost(&mut self, file: File, why: &str) {
        let name = file_name(self.db, file);
        self.times.lost.get_or_insert_with(|| (format!("{name}: {why}"), file));
    }

    fn report(&mut self, diagnostic: Diagnostic<'db>) {
        self.diagnostics.push(diagnostic);
    }

    fn table(&mut self, file: File, table: &'db Table) {
        let at = |span: &Range<usize>| Place::Range(file, span.start as u32, span.end as u32);
        if let Some(problem) = file.problem(self.db) {
            self.report(invalid_table::report(at(&(0..0)), problem.message().to_owned()));
            self.lost(file, problem.message());
        }
        // A value with an error may have swallowed the entries behind it; one of two of a key may be another's.
        for error in &table.errors {
            self.report(invalid_table::report(at(&error.span), error.message.clone()));
            self.lost(file, &error.message);
        }
        if table.lost {
            return;
        }
        let levels: Arc<[Level]> = table.levels.as_slice().into();
        if table.overhead != Overhead::default() {
            if let Some((first, ..)) = &self.times.overhead {
                let message =
                    format!("[overhead] stands in {} already: write it once", file_name(self.db, *first));
                self.lost(file, &message);
                self.report(invalid_table::report(at(&table.overhead_span), message));
            }
            self.times.overhead = Some((file, levels.clone(), table.overhead.clone()));
        }
        let slot = |entry: &Entry| Slot { file, levels: levels.clone(), times: entry.value.clone() };
        for entry in &table.codels {
            self.add(entry, &entry.key, Kind::Codel, slot(entry), Of::Codel);
        }
        for entry in &table.components {
            self.add(entry, &entry.key, Kind::Component, slot(entry), Of::Component);
        }
        for entry in &table.programs {
            self.program(entry, slot(entry), at(&entry.key_span));
        }
    }

    /// Enters a time for what `key` names, and gives that. Where it names nothing, or several things, that is reported,
    /// and what it may have been for is in doubt.
    fn add(
        &mut self,
        entry: &Entry,
        key: &str,
        kind: Kind,
        slot: Slot,
        of: impl Fn(Decl<'db>) -> Of<'db>,
    ) -> Option<Decl<'db>> {
        let is_program = entry.key != key;
        let db = self.db;
        let names = names_of(db, self.project);
        let file = slot.file;
        let at = Place::Range(file, entry.key_span.start as u32, entry.key_span.end as u32);
        let found = names.by_key(kind, key);
        match found {
            [] if is_known_elsewhere(db, self.project, kind, key) => {}
            [] => {
                let all: Vec<(Name, Decl<'db>)> = names
                    .all
                    .iter()
                    .filter(|decl| decl.kind(db) == kind)
                    // As many as are looked at.
                    .take(500)
                    .flat_map(|&decl| [(decl.qualified(db).into(), decl), (decl.name(db).clone(), decl)])
                    .collect();
                let near = similar(key, all.iter().map(|(name, _)| name));
                // What it may be meant for is not analysed, and says so.
                let stray = format!("`{}` in {}", entry.key, file_name(db, file));
                // It may also stand in the wrong section, below a header that was lost.
                let last = key.rsplit('.').next().unwrap_or(key);
                let names_component = !names.anywhere(Kind::Component, last).is_empty();
                if is_program || ProgramKey::parse(key).is_some() {
                    self.lost(file, &format!("`{}` means nothing", entry.key));
                }
                if kind == Kind::Component || names_component {
                    self.times.stray_component = Some(stray.clone());
                }
                // It stands in the wrong section: a header was lost, or a value is that of another entry.
                let other = if kind == Kind::Codel { Kind::Component } else { Kind::Codel };
                if !is_program && !names.by_key(other, key).is_empty() {
                    self.lost(file, &format!("`{key}` is a {other}: it belongs into [{other}]"));
                }
                // They stand in `[overhead]`, of which the header was lost.
                if matches!(last, "dispatch" | "context_switch") {
                    self.lost(file, &format!("`{key}` belongs into [overhead]"));
                }
                if kind == Kind::Codel {
                    self.times.strays.insert(last.into(), stray.clone());
                }
                self.times.stray_codel = Some(stray);
                // What a missing file declares is not unknown for a second time.
                if names.missing {
                    return None;
                }
                let rest = entry.key.get(key.len()..).unwrap_or_default();
                let fixed = near.as_ref().map(|near| format!("{near}{rest}"));
                let fixed = fixed.filter(|fixed| may_replace(db, file, entry, fixed));
                self.report(unknown_timing_key::report(at, kind, key, near, fixed));
            }
            [one] => {
                let of = of(*one);
                self.places.entry(of.clone()).or_default().push((file, at, entry.key.clone()));
                self.times.slots.entry(of).or_default().push(slot);
                return Some(*one);
            }
            [first, rest @ ..] => {
                // Two declarations of one library: that is reported where the second stands.
                if rest.iter().any(|other| other.library(db) != first.library(db)) {
                    self.report(unknown_timing_key::ambiguous(at, key, &first.qualified(db)));
                }
                for &decl in found {
                    let why = format!("{}: the key `{key}` means several of that name", file_name(db, file));
                    self.times.doubts.insert(of(decl), why);
                }
            }
        }
        None
    }

    fn program(&mut self, entry: &Entry, slot: Slot, at: Place<'db>) {
        let (db, file) = (self.db, slot.file);
        let Some(ProgramKey { component, program }) = ProgramKey::parse(&entry.key) else {
            let message = "the key of a program is `Component/update`, `Component/state.run`, \
                           `Component/state.transition.guard`, `Component/state.transition.effect` or \
                           `Component/operation`";
            self.report(invalid_table::report(at, message.to_owned()));
            self.lost(file, &format!("`{}` is not the key of a program", entry.key));
            return;
        };
        let of = |decl| Of::Program(decl, program.clone());
        let named = self.add(entry, component, Kind::Component, slot, of);
        // Programs that no period executes: measured, and of no weight.
        let is_hook = matches!(program, ProgramId::Hook(kind) if kind != HookKind::Update);
        let last = component.rsplit('.').next().unwrap_or(component);
        let namesakes = names_of(db, self.project).anywhere(Kind::Component, last).to_vec();
        let addressed: Vec<Decl<'db>> = named.map_or_else(|| namesakes.clone(), |named| vec![named]);
        let wrong = addressed.into_iter().find_map(|component| {
            let programs = self.programs_of(component);
            match programs.iter().filter(|it| **it == program).count() {
                0 if is_hook => None,
                1 => None,
                count => Some((component, programs, count)),
            }
        });
        let Some((found, programs, count)) = wrong else { return };
        let name = found.name(db);
        let what = if count == 0 { "no program" } else { "several programs" };
        let why = format!("{name} has {what} `{program}`");
        // The transition alone is neither its guard nor its program.
        let keys: Vec<Name> = programs.iter().map(|it| it.to_string().into()).collect();
        let key = program.to_string();
        let longer = keys.iter().find(|it| it.strip_prefix(&*key).is_some_and(|rest| rest.starts_with('.')));
        let near = longer.cloned().or_else(|| similar(&key, &keys));
        let near_of = |component: &str| {
            let program = near.as_deref()?.into();
            Some(ProgramKey { component, program }.to_string())
        };
        // Where the core is wrong, it may have the program when it is right.
        if named.is_some() && self.is_read(found, &key) {
            let fixed = near_of(component).filter(|fixed| may_replace(db, file, entry, fixed));
            self.report(unknown_timing_key::of_program(at, &why, near_of(name).map(Name::from), fixed));
        }
        // It may be meant for another component of that name.
        for namesake in namesakes {
            self.times.doubtful.insert(namesake, format!("{}: {why}", file_name(db, file)));
        }
    }

    /// A component's programs and operations, as tables name them.
    fn programs_of(&self, component: Decl<'db>) -> Vec<ProgramId> {
        let core = core_of(self.db, self.project, component);
        let known = core.map(|core| behaviour_of(self.db, self.project, core));
        let programs = known.into_iter().flat_map(|it| it.programs.iter().chain(&it.operations));
        programs.map(|it| it.id.in_table()).collect()
    }

    /// Is it known what a component executes, but for operations that it should define?
    fn is_read(&self, component: Decl<'db>, program: &str) -> bool {
        let (db, project) = (self.db, self.project);
        let (Some(core), Some(shell)) = (core_of(db, project, component), shell_of(db, project, component))
        else {
            return false;
        };
        let feature = features_of(db, project, shell).get(program);
        is_core_for(db, project, core, shell)
            && behaviour_of(db, project, core).refusals.is_empty()
            && feature.is_none_or(|feature| feature.kind != FeatureKind::Provided)
    }

    /// One thing with two times: an error at each but the first. The key of either may be meant as another.
    fn report_repeated(&mut self) {
        let db = self.db;
        let places = std::mem::take(&mut self.places);
        let mut repeated: Vec<(File, Diagnostic<'db>)> = Vec::new();
        for places in places.values().filter(|places| places.len() > 1) {
            let Some(((first_file, first, _), rest)) = places.split_first() else { continue };
            for (file, at, key) in rest {
                let first = (first.clone(), file_name(db, *first_file));
                repeated.push((*file, invalid_table::repeated(at.clone(), key, first)));
            }
        }
        // In an order of their own: it says which is the reason.
        repeated.sort_by(|(_, a), (_, b)| a.message.cmp(&b.message));
        for (file, diagnostic) in repeated {
            self.lost(file, &diagnostic.message);
            self.report(diagnostic);
        }
        self.diagnostics.sort_by_key(|it| match it.at {
            Place::Range(file, start, _) => (file.path(db).clone(), start, it.message.clone()),
            _ => Default::default(),
        });
    }
}

impl<'db> Timetable<'db> {
    /// The time of one execution of a codel.
    pub fn codel_time(&self, db: &'db dyn ModelDb, codel: Decl<'db>, level: Level) -> Lookup {
        let what = || format!("codel `{}`", codel.qualified(db));
        let meant = |stray: &str| Lookup::Unusable(format!("{stray} may be meant for {}", what()));
        if let Some(stray) = self.strays.get(codel.name(db)) {
            return meant(stray);
        }
        let found = self.time(db, &Of::Codel(codel), level, what);
        match (found, self.assume, &self.stray_codel) {
            (Lookup::Absent, Some(_), Some(stray)) => meant(stray),
            (Lookup::Absent, Some(time), None) => Lookup::Assumed(time),
            (found, ..) => found,
        }
    }

    /// The time of a program as a whole.
    pub fn program_time(
        &self,
        db: &'db dyn ModelDb,
        component: Decl<'db>,
        program: &ProgramId,
        level: Level,
    ) -> Lookup {
        let of = Of::Program(component, program.in_table());
        self.time(db, &of, level, || format!("`{}/{program}`", component.name(db)))
    }

    /// The time of a component as a whole, for the classic method.
    pub fn component_time(&self, db: &'db dyn ModelDb, component: Decl<'db>, level: Level) -> Lookup {
        let what = || format!("component `{}`", component.name(db));
        match (self.time(db, &Of::Component(component), level, what), &self.stray_component) {
            (Lookup::Absent, Some(stray)) => Lookup::Unusable(format!("{stray} may be meant for {}", what())),
            (found, _) => found,
        }
    }

    /// Why a component is not analysed whatever its codels take.
    pub fn doubt(&self, component: Decl<'db>) -> Option<&str> {
        self.doubtful.get(&component).map(String::as_str)
    }

    /// Dispatch and two context switches, for each job; nothing where they have no time at this level.
    pub fn overhead(&self, level: Level) -> Option<Time> {
        let Some((_, levels, overhead)) = &self.overhead else { return Some(Time::ZERO) };
        let dispatch = at_level(&overhead.dispatch, levels, level)?;
        let switch = at_level(&overhead.context_switch, levels, level)?;
        switch.checked_mul(2)?.checked_add(dispatch)
    }

    /// Is there no time for any codel or program?
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty() && self.assume.is_none()
    }

    /// The levels at which every table holds, from the most probable down; none where no time depends on a level.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The levels that only some tables have, each with the name of one that does not.
    pub fn partial_levels(&self) -> &[(Level, String)] {
        &self.partial
    }

    /// A table that has no times at this level, and which it has; in words for the user.
    pub(crate) fn without_level(&self, level: Level) -> Option<String> {
        let (name, levels) = self.with_levels.iter().find(|(_, levels)| !levels.contains(&level))?;
        Some(format!("{name} has the levels {}", list(levels)))
    }

    fn time(&self, db: &'db dyn ModelDb, of: &Of<'db>, level: Level, what: impl Fn() -> String) -> Lookup {
        let slot = match self.slots.get(of).map_or(&[] as &[Slot], Vec::as_slice) {
            [] => return self.doubts.get(of).map_or(Lookup::Absent, |why| Lookup::Unusable(why.clone())),
            [slot] => slot,
            [first, second, ..] => {
                let (first, second) = (file_name(db, first.file), file_name(db, second.file));
                return Lookup::Unusable(format!("{} has two times, in {first} and {second}", what()));
            }
        };
        let name = file_name(db, slot.file);
        let Some(times) = &slot.times else {
            return Lookup::Unusable(format!("the time of {} in {name} has an error", what()));
        };
        at_level(times, &slot.levels, level).map_or_else(
            || {
                let levels = list(&slot.levels);
                Lookup::OtherLevels(format!(
                    "no time for {} at {level}: {name} has the levels {levels}",
                    what()
                ))
            },
            Lookup::Known,
        )
    }
}

fn list(levels: &[Level]) -> String {
    let levels: Vec<String> = levels.iter().map(Level::to_string).collect();
    levels.join(", ")
}

fn at_level(times: &Times, levels: &[Level], level: Level) -> Option<Time> {
    match times {
        Times::Always(time) => Some(*time),
        Times::PerLevel(times) => times.get(levels.iter().position(|&column| column == level)?).copied(),
    }
}

/// Can `key` be written in place of that of an entry? Only where the whole of that stands in one place, and where the table
/// has no other entry of that key.
fn may_replace(db: &dyn ModelDb, file: File, entry: &Entry, key: &str) -> bool {
    let table = table(db, file);
    let mut all = table.codels.iter().chain(&table.programs).chain(&table.components);
    let length = entry.key_span.len();
    (length == entry.key.len() || length == entry.key.len() + 2) && !all.any(|other| other.key == key)
}

/// A table may serve several projects of a workspace: a key is unknown only where none of them has it.
fn is_known_elsewhere<'db>(db: &'db dyn ModelDb, project: Project<'db>, kind: Kind, key: &str) -> bool {
    let workspace = project.workspace(db);
    let others = all_roots(db, workspace).iter().filter(|&&root| root != project.root(db));
    others.map(|&root| Project::new(db, workspace, root)).any(|other| match key.rsplit_once('.') {
        Some((library, name)) => {
            !names_of(db, other).in_library(Some(&library.into()), kind, &name.into()).is_empty()
        }
        None => !names_of(db, other).anywhere(kind, key).is_empty(),
    })
}

fn file_name(db: &dyn ModelDb, file: File) -> String {
    file.path(db).file_name().map_or_else(String::new, |name| Path::new(name).display().to_string())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_pattern_of_a_path_names_it_and_chooses_nothing(path in "[a\\[\\]{}*?!^-]{1,12}") {
            let pattern = pattern_of_path(&path);
            prop_assert!(!has_choice(&pattern), "{}", pattern);
            let glob = table_pattern("/robot".as_ref(), &pattern).unwrap();
            prop_assert!(glob.is_match(Path::new("/robot").join(&path)), "{}", pattern);
        }
    }
}
