//! The execution times of deployments: timing tables, joined, with the names in them resolved. A deployment has those of
//! `[timing] tables` in `mauve.toml`, or its own ones ([`TableSet`]).

mod refuted;
mod unknown_keys;

pub use refuted::{observed_in, observed_responses};

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use globset::{GlobBuilder, GlobMatcher};
use mauve_timing::{
    Entry, Excess, Level, Measured, Overhead, Table, TableError, TableErrorKind, TableSection, Time, Times,
    extrapolated_from,
};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::fact::{ChangedOrigin, TimingFact, TimingFactKind};
use crate::reason::{
    IncompleteTable, PREFIX_OF_TOPICS, PatternError, StrayEntry, TableFault, TableFilesError, TableLevels,
    Timed, UnusableTime, WrongProgram,
};
use crate::table_set::{TableSet, all_tables_of, checked_sets, table_sets};
use mauve_hir::item_tree::{FeatureKind, HookKind, Kind, Name};
use mauve_hir::{
    CONFIG_FILE, Decl, File, Located, Location, Mistake, ModelDb, OwnerOfTables, ProgramId, ProgramKey,
    Project, Workspace, all_roots, behaviour_of, config_file, config_of, core_of, declarations, errors_in,
    features_of, is_core_for, names_of, normalised, owner_of_tables, ros2_of, shell_of, similar, uses_of,
};

/// Reads a table.
#[salsa::tracked(returns(ref))]
pub fn table(db: &dyn ModelDb, file: File) -> Table {
    let mut table = Table::parse(file.text(db));
    let conflicts = mauve_syntax::conflicts(file.text(db));
    if table.lost && !conflicts.is_empty() {
        let error = |(span, names)| TableError { span, kind: TableErrorKind::Conflict(names) };
        table.errors = conflicts.into_iter().map(error).collect();
    }
    table
}

/// The tables of the configuration, in the order of their paths, and the errors in their patterns.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableFiles {
    /// The tables.
    pub files: Vec<File>,
    /// Errors in patterns, with the spans of the patterns.
    pub errors: Vec<(TableFilesError, Range<usize>)>,
}

/// Finds all tables of a workspace, for whatever deployments.
#[salsa::tracked(returns(ref))]
pub fn table_files(db: &dyn ModelDb, workspace: Workspace) -> TableFiles {
    without_observed(db, files_named(db, workspace, config_of(db, workspace).all_tables()))
}

/// A pattern of tables such as `*.toml` does not name the files that `mauve trace import` writes beside samples.
fn without_observed(db: &dyn ModelDb, mut found: TableFiles) -> TableFiles {
    let is_table = |file: &File| !file.path(db).to_string_lossy().ends_with(OBSERVED_SUFFIX);
    found.files.retain(is_table);
    found
}

/// A count of exceedances is a finding if its probability is less.
pub const IMPROBABLE: f64 = 1e-3;

/// What the names of files with what recordings showed end with.
const OBSERVED_SUFFIX: &str = ".observed.toml";

/// Returns the files of a set of tables, sorted by their paths.
pub fn files_of<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>) -> &'db [File] {
    &files_in(db, tables, false).files
}

/// Finds all files of `[timing] observed`, for whatever deployments.
#[salsa::tracked(returns(ref))]
pub fn observed_files(db: &dyn ModelDb, workspace: Workspace) -> TableFiles {
    files_named(db, workspace, config_of(db, workspace).all_observed())
}

/// Finds the files of `[platform] threads`.
#[salsa::tracked(returns(ref))]
pub fn thread_files(db: &dyn ModelDb, workspace: Workspace) -> TableFiles {
    files_named(db, workspace, config_of(db, workspace).threads.iter())
}

/// Returns the files that are read beside the models and `mauve.toml`: tables, what recordings showed, and threads; and the errors in
/// the patterns that name them.
pub fn input_files(
    db: &dyn ModelDb,
    workspace: Workspace,
) -> (impl Iterator<Item = File> + Clone, impl Iterator<Item = &(TableFilesError, Range<usize>)>) {
    let all = [table_files(db, workspace), observed_files(db, workspace), thread_files(db, workspace)];
    (all.into_iter().flat_map(|it| it.files.iter().copied()), all.into_iter().flat_map(|it| &it.errors))
}

/// Returns the files of a set of tables, or those with what recordings showed that count beside them.
fn files_in<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>, is_observed: bool) -> &'db TableFiles {
    let (section, host) = (tables.section(db).clone(), tables.host(db).clone());
    files_of_section(db, tables.project(db).workspace(db), section, host, is_observed)
}

/// Finds the files that count: those of the host if it has any, otherwise those of the section of a deployment, or the general
/// ones without a section.
#[salsa::tracked(returns(ref))]
fn files_of_section(
    db: &dyn ModelDb,
    workspace: Workspace,
    section: Option<Name>,
    host: Option<Name>,
    is_observed: bool,
) -> TableFiles {
    let config = config_of(db, workspace);
    let either = |tables, observed| -> &[Located] { if is_observed { observed } else { tables } };
    let host = host.and_then(|name| config.hosts.iter().find(|it| name == *it.name));
    let of_host = host.map(|it| either(&it.tables, &it.observed)).filter(|it| !it.is_empty());
    let of_section = || match section {
        Some(section) => {
            let found = config.deployment_tables.iter().find(|it| section == *it.name);
            found.map_or(&[] as &[_], |it| either(&it.tables, &it.observed))
        }
        None => either(&config.tables, &config.observed),
    };
    let found = files_named(db, workspace, of_host.unwrap_or_else(of_section).iter());
    if is_observed { found } else { without_observed(db, found) }
}

/// Finds the tables that patterns name.
fn files_named<'a>(
    db: &dyn ModelDb,
    workspace: Workspace,
    patterns: impl Iterator<Item = &'a (String, Range<usize>)> + Clone,
) -> TableFiles {
    let mut files: BTreeMap<&Path, File> = BTreeMap::new();
    let mut errors = Vec::new();
    let config = workspace.folder(db).join(CONFIG_FILE);
    for (pattern, span) in patterns.clone() {
        let glob = match table_pattern(workspace.folder(db), pattern) {
            Ok(glob) => glob,
            Err(error) => {
                errors.push((TableFilesError::Pattern(pattern.clone(), error), span.clone()));
                continue;
            }
        };
        let known = workspace.files(db).iter().filter(|(path, _)| **path != config);
        let mut named = known.filter(|(path, _)| glob.is_match(path)).map(|(_, file)| *file).peekable();
        if named.peek().is_none() {
            errors.push((TableFilesError::NoSuchFile(pattern.clone()), span.clone()));
        }
        for file in named {
            match file.problem(db).as_ref().filter(|_| file.is_outside(db)) {
                Some(problem) => {
                    errors.push((TableFilesError::Unreadable(problem.message().to_owned()), span.clone()));
                }
                None => _ = files.insert(file.path(db).as_path(), file),
            }
        }
    }
    if let Some((_, span)) = patterns.clone().next() {
        let unreadable = workspace.unreadable(db).iter();
        errors.extend(unreadable.map(|why| (TableFilesError::NotAllKnown(why.clone()), span.clone())));
    }
    TableFiles { files: files.into_values().collect(), errors }
}

/// Compiles a pattern of tables, which is relative to the configuration's folder. `*` and `?` do not cross folders,
/// `**` does.
///
/// # Errors
///
/// The pattern is invalid, is too long, or chooses between names.
pub fn table_pattern(folder: &Path, pattern: &str) -> Result<GlobMatcher, PatternError> {
    if has_choice(pattern) {
        return Err(PatternError::Choice);
    }
    if pattern.len() > LONGEST_PATTERN {
        return Err(PatternError::TooLong);
    }
    // The folder is a path, not a pattern: its special characters are escaped.
    let mut escaped = globset::escape(&folder.to_string_lossy());
    // Bytes that are no letters match any.
    while escaped.contains("\u{fffd}\u{fffd}") {
        escaped = escaped.replace("\u{fffd}\u{fffd}", "\u{fffd}");
    }
    let escaped = PathBuf::from(escaped.replace('\u{fffd}', "*"));
    let absolute = normalised(&escaped.join(pattern));
    let absolute = absolute.to_string_lossy();
    // A backslash is a letter of a folder's name; `[*]` is a star.
    let glob = GlobBuilder::new(&absolute).literal_separator(true).backslash_escape(false).build();
    Ok(glob.map_err(|error| PatternError::Invalid(error.to_string()))?.compile_matcher())
}

/// The maximal length in bytes: no system has longer paths.
pub const LONGEST_PATTERN: usize = 4096;

/// Returns whether a pattern has alternatives, so that a missing table remains unnoticed. (`[x]` is the letter `x`.)
fn has_choice(pattern: &str) -> bool {
    let mut letters = pattern.chars();
    while let Some(letter) = letters.next() {
        match letter {
            // `[!` and `[^` exclude letters.
            '[' if letters.next().is_none_or(|letter| matches!(letter, '!' | '^')) => return true,
            '[' if letters.next() != Some(']') => return true,
            '{' | '}' => return true,
            _ => {}
        }
    }
    false
}

/// Returns the pattern of tables that matches only this path.
pub fn pattern_of_path(path: &str) -> String {
    globset::escape(path)
}

/// An entry of one table. It has no location: a comment in a table changes no time.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct TimeSlot {
    file: File,
    levels: Arc<[Level]>,
    /// None where the entry has an error.
    times: Option<Times>,
    /// Of a wait, how often a call waits.
    waits: Option<u64>,
    /// Whether the times are those of a measurement.
    is_measured: bool,
    /// Whether a comment says that the times are assumed.
    is_assumed: bool,
    /// Whether a measurement says that executions depend on earlier ones.
    is_dependent: bool,
    /// The least strict level at which a measurement is extrapolated.
    extrapolated_from: Option<Level>,
}

/// The times in timing tables.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Timetable<'db> {
    pub(crate) slots: FxHashMap<Timed<'db>, Vec<TimeSlot>>,
    /// Subjects without an entry that an ambiguous or unknown key may refer to, with the entry of that key.
    pub(crate) unclear: FxHashMap<Timed<'db>, UnusableTime<'db>>,
    /// The entries of components for programs that they do not have: such an entry may be for any of their programs, so that the
    /// component is not analysed.
    pub(crate) wrong_programs: FxHashMap<Decl<'db>, UnusableTime<'db>>,
    /// Entries of unknown codels by the name of the codel: they may belong to a codel of that name in another library,
    /// even if it has a time.
    pub(crate) strays: FxHashMap<Name, StrayEntry>,
    overhead: Option<(File, Arc<[Level]>, Overhead)>,
    /// What recordings refuted.
    refuted: FxHashMap<Timed<'db>, UnusableTime<'db>>,
    /// The programs and the ports of each component that some entry is, or may be, for.
    of_components: FxHashMap<Decl<'db>, FxHashSet<Timed<'db>>>,
    /// The levels of all tables, from the most probable down; none where no time depends on a level.
    pub levels: Vec<Level>,
    /// The levels that only some tables have, each with the name of a table that does not.
    pub partial_levels: Vec<(Level, String)>,
    /// The tables in which some time depends on the level.
    pub(crate) with_levels: Vec<TableLevels>,
    pub(crate) assume: Option<Time>,
    /// Why the tables are incomplete, so that every time may be longer: nothing is analysed.
    pub incomplete: Option<IncompleteTable>,
}

/// The time of something in the tables.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lookup<'db> {
    /// A table has this time.
    Known(Time),
    /// `[assume]` gives this time: no table has one.
    Assumed(Time),
    /// No table has a time.
    Absent,
    /// The entry cannot be used, or has no time at the level.
    Unusable(UnusableTime<'db>),
}

/// Joins tables, without locations: a comment in a table changes nothing.
#[salsa::tracked(returns(ref))]
pub fn timetable_of<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>) -> Timetable<'db> {
    joined(db, tables).0.clone()
}

/// Returns the part of the timetable that the state machine of a component reads: a changed time of another codel does not
/// change the result.
#[salsa::tracked(returns(ref))]
pub(crate) fn times_of<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
) -> Timetable<'db> {
    let (all, project) = (timetable_of(db, tables), tables.project(db));
    let core = core_of(db, project, component);
    let codels = || core.into_iter().flat_map(|core| &uses_of(db, project, core).codels).copied();
    let of_component = all.of_components.get(&component).into_iter().flatten().cloned();
    let of_codels = codels().flat_map(|codel| [Timed::Codel(codel), Timed::Wait(codel)]);
    let read: Vec<Timed<'db>> = of_codels.chain(of_component).chain([Timed::Component(component)]).collect();
    let wrong = all.wrong_programs.get(&component).map(|wrong| (component, wrong.clone()));
    let stray = |codel: Decl<'db>| all.strays.get_key_value(codel.name(db));
    Timetable {
        slots: part(&all.slots, &read),
        unclear: part(&all.unclear, &read),
        wrong_programs: wrong.into_iter().collect(),
        refuted: part(&all.refuted, &read),
        strays: codels().filter_map(stray).map(|(name, stray)| (name.clone(), stray.clone())).collect(),
        overhead: all.overhead.clone(),
        with_levels: all.with_levels.clone(),
        assume: all.assume,
        ..Timetable::default()
    }
}

/// Returns the entries of `all` for the subjects in `read`.
fn part<'db, T: Clone>(all: &FxHashMap<Timed<'db>, T>, read: &[Timed<'db>]) -> FxHashMap<Timed<'db>, T> {
    if all.is_empty() {
        return FxHashMap::default();
    }
    read.iter().filter_map(|of| Some((of.clone(), all.get(of)?.clone()))).collect()
}

/// Returns the errors in the tables of a project, each once, in no particular order.
pub fn table_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TimingFact<'db>> {
    let mut found: Vec<TimingFact<'db>> = Vec::new();
    let mut known: FxHashMap<&Location<'db>, Vec<&TimingFact<'db>>> = FxHashMap::default();
    // A table may be one of several deployments.
    for fact in checked_sets(db, project).into_iter().flat_map(|tables| &joined(db, tables).1) {
        let here = known.entry(&fact.at).or_default();
        if !here.contains(&fact) {
            here.push(fact);
            found.push(fact.clone());
        }
    }
    found
}

/// Returns the levels of all tables of a project, in no particular order.
pub fn levels_of_tables<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> impl Iterator<Item = Level> {
    table_sets(db, project).iter().flat_map(|&tables| timetable_of(db, tables).levels.iter().copied())
}

/// Returns the levels that all tables of a deployment have, from the most probable down; none where no time depends on a level.
pub fn levels_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, deployment: Decl<'db>) -> Vec<Level> {
    let all = all_tables_of(db, project, deployment);
    let mut levelled = all.iter().map(|&it| timetable_of(db, it)).filter(|it| !it.with_levels.is_empty());
    let mut found = levelled.next().map_or_else(Vec::new, |it| it.levels.clone());
    for other in levelled {
        found.retain(|it| other.levels.contains(it));
    }
    found
}

/// Returns why the tables are incomplete. A query that reads only this is not run again for every other change of a table.
#[salsa::tracked(returns(ref))]
pub(crate) fn incomplete_tables<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>) -> Option<IncompleteTable> {
    timetable_of(db, tables).incomplete.clone()
}

#[salsa::tracked(returns(ref), no_eq)]
fn joined<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>) -> (Timetable<'db>, Vec<TimingFact<'db>>) {
    let project = tables.project(db);
    let workspace = project.workspace(db);
    let (found, observed) = (files_in(db, tables, false), files_in(db, tables, true));
    let config = config_of(db, workspace);
    let times = Timetable { assume: config.assume, ..Timetable::default() };
    let mut builder = TimetableBuilder {
        db,
        project,
        times,
        facts: Vec::new(),
        locations: FxHashMap::default(),
        programs: FxHashMap::default(),
        unknown: Vec::new(),
    };
    if let Some(file) = config_file(db, workspace) {
        if config.completeness.is_incomplete()
            && let Some(Mistake { kind, .. }) = config.errors.iter().min_by_key(|it| it.span.start)
        {
            builder.incomplete(file, TableFault::Configuration(kind.clone()));
        }
        for (error, _) in found.errors.iter().chain(&observed.errors) {
            builder.incomplete(file, TableFault::Files(error.clone()));
        }
        if let Some(fault) = unclear_section(db, tables) {
            builder.incomplete(file, fault);
        }
    }
    let host = tables.host(db).as_ref();
    let tables: Vec<(File, &Table)> = found.files.iter().map(|&file| (file, table(db, file))).collect();
    for &(file, table) in &tables {
        builder.table(file, table);
    }
    builder.observed(&observed.files, host);
    builder.unknown_keys();
    builder.report_repeated();
    builder.times.index_programs();
    let all: BTreeSet<Level> = tables.iter().flat_map(|(_, table)| table.levels.iter().copied()).collect();
    for level in all.into_iter().rev() {
        match tables.iter().find(|(_, table)| !table.covers(level)) {
            None => builder.times.levels.push(level),
            Some((without, _)) => builder.times.partial_levels.push((level, file_name(db, *without))),
        }
    }
    (builder.times, builder.facts)
}

/// Returns why the deployments that use these tables may need other ones: a section by an unknown name may be that of any
/// deployment without a section, and one by an ambiguous name is that of one of several deployments.
fn unclear_section<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>) -> Option<TableFault> {
    let project = tables.project(db);
    let owner = |name: &str| owner_of_tables(db, project, name);
    if let Some(name) = tables.section(db) {
        let is_ambiguous = matches!(owner(name), OwnerOfTables::Several(_));
        return is_ambiguous.then(|| TableFault::AmbiguousDeployment(name.to_string()));
    }
    let mut sections = config_of(db, project.workspace(db)).deployment_tables.iter();
    let unknown = sections.find(|it| owner(&it.name) == OwnerOfTables::Missing)?;
    Some(TableFault::UnknownDeployment(unknown.name.clone()))
}

/// An entry whose key names nothing.
pub(crate) struct UnknownKey<'db> {
    pub(crate) entry: &'db Entry,
    /// The key of the codel or the component: of `Component/update` under `[program]`, and of `Component.port` under `[access]`,
    /// `Component`.
    pub(crate) key: String,
    pub(crate) section: TableSection,
    pub(crate) file: File,
    /// Whether the component is known and only its program is not, which is reported already.
    pub(crate) is_reported: bool,
}

impl<'db> UnknownKey<'db> {
    fn kind(&self) -> Kind {
        match self.section {
            TableSection::Codel | TableSection::Wait => Kind::Codel,
            _ => Kind::Component,
        }
    }

    fn at(&self) -> Location<'db> {
        Location::of_span(self.file, &self.entry.key_span)
    }

    fn library(&self) -> Option<Name> {
        self.key.rsplit_once('.').map(|(library, _)| library.into())
    }

    fn last(&self) -> &str {
        self.key.rsplit('.').next().unwrap_or(&self.key)
    }

    fn stray(&self) -> StrayEntry {
        StrayEntry { key: self.entry.key.clone(), table: self.file }
    }
}

pub(crate) struct TimetableBuilder<'db> {
    pub(crate) db: &'db dyn ModelDb,
    pub(crate) project: Project<'db>,
    pub(crate) times: Timetable<'db>,
    facts: Vec<TimingFact<'db>>,
    locations: FxHashMap<Timed<'db>, Vec<(Location<'db>, String)>>,
    /// For each component with an entry for a program, how many of its programs have each key.
    programs: FxHashMap<Decl<'db>, FxHashMap<ProgramId, usize>>,
    pub(crate) unknown: Vec<UnknownKey<'db>>,
}

impl<'db> TimetableBuilder<'db> {
    pub(crate) fn incomplete(&mut self, file: File, error: TableFault) {
        self.times.incomplete.get_or_insert(IncompleteTable { file, error });
    }

    pub(crate) fn report(&mut self, at: Location<'db>, kind: TimingFactKind<'db>) {
        self.facts.push(TimingFact::new(at, kind));
    }

    /// An error that leaves every time unknown.
    fn fault(&mut self, at: Location<'db>, error: TableFault) {
        self.incomplete(at.file(self.db), error.clone());
        self.report(at, TimingFactKind::InvalidTable(error));
    }

    fn table(&mut self, file: File, table: &'db Table) {
        let at = |span: &Range<usize>| Location::of_span(file, span);
        if table.depends_on_level() {
            self.times.with_levels.push(TableLevels { table: file, levels: table.levels.clone() });
        }
        if let Some(problem) = file.problem(self.db) {
            self.fault(at(&(0..0)), TableFault::Unreadable(problem.message().to_owned()));
        }
        // A value with an error may contain the entries behind it; a repeated key may be a misspelt one.
        for error in &table.errors {
            self.fault(at(&error.span), TableFault::Invalid(error.kind.clone()));
        }
        if table.lost {
            return;
        }
        let levels: Arc<[Level]> = table.levels.as_slice().into();
        if table.overhead != Overhead::default() {
            if let Some((first, ..)) = self.times.overhead {
                self.fault(at(&table.overhead_span), TableFault::SecondOverhead(first));
            }
            self.times.overhead = Some((file, levels.clone(), table.overhead.clone()));
        }
        let measured: FxHashMap<&str, &Measured> =
            table.measured.iter().map(|record| (record.key.as_str(), record)).collect();
        let [codels, programs, components, waits, accesses] = table.sections();
        let sections = [codels, components, waits, accesses, programs].into_iter();
        for (section, entry) in sections.flat_map(|(of, all)| all.iter().map(move |it| (of, it))) {
            let record = measured.get(entry.key.as_str()).copied();
            let slot = TimeSlot {
                file,
                levels: levels.clone(),
                times: entry.value.clone(),
                waits: entry.waits,
                is_measured: record.map(|it| &it.times) == entry.value.as_ref(),
                is_assumed: entry.is_assumed,
                is_dependent: record.is_some_and(Measured::is_dependent),
                extrapolated_from: record
                    .and_then(|it| it.warnings.iter().find_map(|it| extrapolated_from(it))),
            };
            match section {
                TableSection::Program => self.program(entry, slot, at(&entry.key_span)),
                TableSection::Access => self.access(entry, slot, at(&entry.key_span)),
                TableSection::Component => _ = self.add(entry, &entry.key, section, slot, Timed::Component),
                TableSection::Wait => _ = self.add(entry, &entry.key, section, slot, Timed::Wait),
                TableSection::Codel | TableSection::Overhead => {
                    self.add(entry, &entry.key, section, slot, Timed::Codel);
                }
            }
        }
        for record in &table.measured {
            let mut entries = table.codels.iter().chain(&table.programs);
            let entry = entries.find(|entry| entry.key == record.key);
            let is_edited = entry.is_some_and(|entry| entry.value.as_ref() != Some(&record.times));
            // An edited time is one by hand: a new measurement does not replace it.
            if !is_edited {
                self.measured(file, record, at(&record.span));
            }
        }
    }

    /// Reports what makes a measurement outdated or doubtful. A file that is not here may be on another computer.
    fn measured(&mut self, file: File, record: &Measured, at: Location<'db>) {
        let found = self.project.workspace(self.db).measured_files(self.db);
        let folder = file.path(self.db).parent().unwrap_or(file.path(self.db));
        let on_disk = |path: &String| found.get(&normalised(&folder.join(path)));
        let lengths: Option<u64> = record.files.iter().map(|path| on_disk(path).map(|it| it.length)).sum();
        let source = record.source.as_ref().zip(record.source_digest.as_ref());
        let changed_source = source.filter(|(path, digest)| {
            on_disk(path).and_then(|it| it.digest.as_ref()).is_some_and(|now| now != *digest)
        });
        let key = || record.key.clone();
        if lengths.is_some_and(|bytes| bytes != record.bytes) && !record.files.is_empty() {
            let changed = ChangedOrigin::Samples(record.files.clone());
            self.report(at.clone(), TimingFactKind::OutdatedMeasurement { key: key(), changed });
        }
        if let Some((path, _)) = changed_source {
            let changed = ChangedOrigin::Source(path.clone());
            self.report(at.clone(), TimingFactKind::OutdatedMeasurement { key: key(), changed });
        }
        // Whether a time is extrapolated depends on the level: the verdict at a level says it.
        let mut warnings = record.warnings.clone();
        warnings.retain(|it| extrapolated_from(it).is_none());
        if !warnings.is_empty() {
            self.report(at, TimingFactKind::DoubtfulMeasurement { key: key(), warnings });
        }
    }

    /// Enters the time of the declaration that `key` names, and returns the declaration. Notes an unknown key, and reports an
    /// ambiguous one.
    fn add(
        &mut self,
        entry: &'db Entry,
        key: &str,
        section: TableSection,
        slot: TimeSlot,
        of: impl Fn(Decl<'db>) -> Timed<'db>,
    ) -> Option<Decl<'db>> {
        let (db, file) = (self.db, slot.file);
        let at = Location::of_span(file, &entry.key_span);
        let unknown = UnknownKey { entry, key: key.to_owned(), section, file, is_reported: false };
        let kind = unknown.kind();
        let found = names_of(db, self.project).by_key(kind, key);
        match found {
            [] if is_known_elsewhere(db, self.project, kind, key) => {}
            [] => self.unknown.push(unknown),
            [one] => {
                let of = of(*one);
                self.locations.entry(of.clone()).or_default().push((at, entry.key.clone()));
                self.times.slots.entry(of).or_default().push(slot);
                return Some(*one);
            }
            [first, rest @ ..] => {
                // Two declarations of one name in one library are another error.
                if rest.iter().any(|other| other.library(db) != first.library(db)) {
                    let (key, first) = (key.to_owned(), *first);
                    self.report(at, TimingFactKind::AmbiguousTimingKey { key, first });
                }
                let ambiguous = UnusableTime::AmbiguousKey(StrayEntry { key: key.to_owned(), table: file });
                self.times.unclear.extend(found.iter().map(|&decl| (of(decl), ambiguous.clone())));
            }
        }
        None
    }

    /// Enters the time of an access to a port: `Component.port`.
    fn access(&mut self, entry: &'db Entry, slot: TimeSlot, at: Location<'db>) {
        let (db, file) = (self.db, slot.file);
        let (component, port) = entry.key.rsplit_once('.').unwrap_or((&entry.key, ""));
        let names = names_of(db, self.project);
        if let Some(topic) = entry.key.strip_prefix(PREFIX_OF_TOPICS)
            && names.by_key(Kind::Component, component).is_empty()
        {
            let topics = topics_of(db, self.project);
            let of = Timed::Topic(topic.into());
            if topics.contains(topic) {
                self.locations.entry(of.clone()).or_default().push((at, entry.key.clone()));
                self.times.slots.entry(of).or_default().push(slot);
                return;
            }
            if !topics.is_empty() {
                return self.unknown_topic(entry, topic, topics, slot.file);
            }
        }
        let port = Name::from(port);
        let of = |decl| Timed::Access(decl, port.clone());
        let Some(component) = self.add(entry, component, TableSection::Access, slot, of) else { return };
        let ports = self.ports_of(component);
        if ports.contains(&port) {
            return;
        }
        // It may be the time of any port of the component.
        let stray = StrayEntry { key: entry.key.clone(), table: file };
        let accesses = ports.iter().map(|port| Timed::Access(component, port.clone()));
        self.put_in_question(accesses, &stray);
        // An error in a shell, which is reported, may hide the port.
        let shell = shell_of(db, self.project, component);
        let features = shell.map(|shell| features_of(db, self.project, shell));
        let is_known = features.is_some_and(|features| {
            (features.completeness & features.value_completeness).is_complete()
                && features.shells.iter().all(|&shell| {
                    let is_complete = declarations(db, shell.file(db)).completeness.is_complete();
                    is_complete && errors_in(db, self.project, shell).is_empty()
                })
        });
        if !is_known || names_of(db, self.project).may_miss_names() {
            return;
        }
        let near = similar(&port, &ports);
        let prefix = entry.key.get(..entry.key.len() - port.len()).unwrap_or_default();
        let fixed = near.as_ref().map(|near| format!("{prefix}{near}"));
        let fixed = fixed.filter(|fixed| may_replace(db, file, entry, fixed));
        self.report(at, TimingFactKind::UnknownTimedPort { component, port, near, fixed });
    }

    /// Notes the time of a topic that no deployment has: it may be that of any of the `topics`.
    fn unknown_topic(&mut self, entry: &'db Entry, topic: &str, topics: &BTreeSet<Name>, file: File) {
        let (db, project) = (self.db, self.project);
        let others = other_projects(db, project);
        if others.into_iter().any(|other| topics_of(db, other).contains(topic)) {
            return;
        }
        let stray = StrayEntry { key: entry.key.clone(), table: file };
        self.put_in_question(topics.iter().cloned().map(Timed::Topic), &stray);
        if names_of(db, project).may_miss_names() {
            return;
        }
        let near = similar(topic, topics);
        let fixed = near.as_ref().map(|near| format!("{PREFIX_OF_TOPICS}{near}"));
        let fixed = fixed.filter(|fixed| may_replace(db, file, entry, fixed));
        let (topic, known) = (topic.into(), topics.iter().cloned().collect());
        let at = Location::of_span(file, &entry.key_span);
        self.report(at, TimingFactKind::UnknownTopic { topic, near, fixed, known });
    }

    /// Returns the ports of a component, as far as they are known.
    pub(crate) fn ports_of(&self, component: Decl<'db>) -> Vec<Name> {
        let shell = shell_of(self.db, self.project, component);
        let features = shell.map(|shell| features_of(self.db, self.project, shell));
        let all = features.into_iter().flat_map(|features| &features.by_name);
        let mut ports: Vec<Name> = all
            .filter(|(_, features)| features.iter().any(|it| it.kind.is_port()))
            .map(|(name, _)| name.clone())
            .collect();
        ports.sort();
        ports
    }

    fn program(&mut self, entry: &'db Entry, slot: TimeSlot, at: Location<'db>) {
        let (db, file) = (self.db, slot.file);
        let Some(ProgramKey { component, program }) = ProgramKey::parse(&entry.key) else {
            self.fault(at, TableFault::NoProgramKey(entry.key.clone()));
            return;
        };
        let of = |decl| Timed::Program(decl, program.clone());
        let named = self.add(entry, component, TableSection::Program, slot, of);
        // No period executes these hooks, but they may be measured.
        let is_hook = matches!(program, ProgramId::Hook(kind) if kind != HookKind::Update);
        let last = component.rsplit('.').next().unwrap_or(component);
        let namesakes = names_of(db, self.project).anywhere(Kind::Component, last).to_vec();
        let addressed: Vec<Decl<'db>> = named.map_or_else(|| namesakes.clone(), |named| vec![named]);
        let wrong = addressed.into_iter().find_map(|component| {
            let count = self.count_of(component, &program);
            (count != 1 && !(count == 0 && is_hook)).then_some((component, count))
        });
        let Some((found, count)) = wrong else { return };
        let programs = self.programs_of(found);
        let name = found.name(db);
        let wrong = WrongProgram { component: found, program: program.clone(), is_repeated: count > 0 };
        // The key of a transition alone is neither that of its guard nor that of its program.
        let keys: Vec<Name> = programs.iter().map(|it| it.to_string().into()).collect();
        let key = program.to_string();
        let longer = keys.iter().find(|it| it.strip_prefix(&*key).is_some_and(|rest| rest.starts_with('.')));
        let near = longer.cloned().or_else(|| similar(&key, &keys));
        let near_of = |component: &str| {
            let program = near.as_deref()?.into();
            Some(ProgramKey { component, program }.to_string())
        };
        // A core with an error may have the program after the correction.
        if named.is_some() && self.is_read(found, &key) {
            let fixed = near_of(component).filter(|fixed| may_replace(db, file, entry, fixed));
            let near = near_of(name).map(Name::from);
            self.report(at, TimingFactKind::UnknownProgram { program: wrong.clone(), near, fixed });
        }
        // The entry may be that of another component of this name.
        let stray = StrayEntry { key: entry.key.clone(), table: file };
        for namesake in namesakes {
            let unusable = UnusableTime::WrongProgram(stray.clone(), wrong.clone());
            self.times.wrong_programs.insert(namesake, unusable);
        }
        if named.is_some() {
            let (key, section) = (component.to_owned(), TableSection::Program);
            self.unknown.push(UnknownKey { entry, key, section, file, is_reported: true });
        }
    }

    /// Returns how many programs of a component have this key.
    fn count_of(&mut self, component: Decl<'db>, program: &ProgramId) -> usize {
        if let Some(counts) = self.programs.get(&component) {
            return counts.get(program).copied().unwrap_or_default();
        }
        let mut counts: FxHashMap<ProgramId, usize> = FxHashMap::default();
        for program in self.programs_of(component) {
            *counts.entry(program).or_default() += 1;
        }
        let count = counts.get(program).copied().unwrap_or_default();
        self.programs.insert(component, counts);
        count
    }

    pub(crate) fn programs_of(&self, component: Decl<'db>) -> Vec<ProgramId> {
        let core = core_of(self.db, self.project, component);
        let known = core.map(|core| behaviour_of(self.db, self.project, core));
        let programs = known.into_iter().flat_map(|it| it.programs.iter().chain(&it.operations));
        programs.map(|it| it.id.in_table()).collect()
    }

    /// Returns whether the programs of a component are known. An operation that the shell provides may be missing.
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

    fn report_repeated(&mut self) {
        let db = self.db;
        let locations = std::mem::take(&mut self.locations);
        let firsts = locations.values().filter_map(|all| all.split_first());
        let repeated = firsts.flat_map(|((first, _), rest)| rest.iter().map(move |it| (it, first)));
        let mut repeated: Vec<(&(Location<'db>, String), &Location<'db>)> = repeated.collect();
        // The first one becomes the reason: the order does not depend on that of the map.
        repeated.sort_by_cached_key(|((_, key), first)| (format!("`{key}`"), file_name(db, first.file(db))));
        for ((at, key), first) in repeated {
            self.incomplete(at.file(db), TableFault::Repeated(key.clone(), first.file(db)));
            self.report(at.clone(), TimingFactKind::RepeatedTime { key: key.clone(), first: first.clone() });
        }
    }
}

impl Lookup<'_> {
    /// Returns the time, if there is one.
    pub fn time(&self) -> Option<Time> {
        match self {
            Lookup::Known(time) | Lookup::Assumed(time) => Some(*time),
            Lookup::Absent | Lookup::Unusable(_) => None,
        }
    }
}

impl<'db> Timetable<'db> {
    fn index_programs(&mut self) {
        for of in self.slots.keys().chain(self.unclear.keys()).chain(self.refuted.keys()) {
            if let Timed::Program(component, _) | Timed::Access(component, _) = of {
                self.of_components.entry(*component).or_default().insert(of.clone());
            }
        }
    }

    /// Returns the time of one execution of a codel.
    pub fn codel_time(&self, db: &'db dyn ModelDb, codel: Decl<'db>, level: Level) -> Lookup<'db> {
        let timed = Timed::Codel(codel);
        if let Some(stray) = self.strays.get(codel.name(db)) {
            return Lookup::Unusable(UnusableTime::Stray(stray.clone(), timed));
        }
        match (self.time(&timed, level), self.assume) {
            (Lookup::Absent, Some(time)) => Lookup::Assumed(time),
            (found, _) => found,
        }
    }

    /// Returns the time of dispatch and two context switches, for each wake-up of a thread; none where they have no time at this level.
    pub fn overhead(&self, level: Level) -> Option<Time> {
        let Some((_, levels, overhead)) = &self.overhead else { return Some(Time::ZERO) };
        let dispatch = overhead.dispatch.at(levels, level)?;
        let switch = overhead.context_switch.at(levels, level)?;
        switch.checked_mul(2)?.checked_add(dispatch)
    }

    /// Returns the time of two context switches, for a wait or a blocking; none where it has no time at this level.
    pub(crate) fn switches(&self, level: Level) -> Option<Time> {
        let Some((_, levels, overhead)) = &self.overhead else { return Some(Time::ZERO) };
        overhead.context_switch.at(levels, level)?.checked_mul(2)
    }

    /// Returns how often a call of a codel waits, at most, if a table has that.
    pub(crate) fn waits(&self, codel: Decl<'db>) -> Option<u64> {
        self.slots.get(&Timed::Wait(codel))?.first()?.waits
    }

    /// Returns the ports of a component that some entry is, or may be, for.
    pub(crate) fn timed_ports(&self, component: Decl<'db>) -> impl Iterator<Item = &Name> {
        let of_component = self.of_components.get(&component).into_iter().flatten();
        of_component.filter_map(|of| if let Timed::Access(_, port) = of { Some(port) } else { None })
    }

    /// Returns whether a table has an entry, or may have.
    pub(crate) fn has_entry(&self, of: &Timed<'db>) -> bool {
        self.slots.contains_key(of) || self.unclear.contains_key(of) || self.refuted.contains_key(of)
    }

    /// Returns whether the times of an entry are those of a measurement.
    pub(crate) fn is_measured(&self, of: &Timed<'db>) -> bool {
        self.slots.get(of).is_some_and(|slots| slots.iter().all(|slot| slot.is_measured))
    }

    /// Returns whether a measured time of a level is extrapolated.
    pub(crate) fn is_extrapolated(&self, of: &Timed<'db>, level: Level) -> bool {
        let is_it =
            |slot: &TimeSlot| slot.is_measured && slot.extrapolated_from.is_some_and(|from| level <= from);
        self.slots.get(of).is_some_and(|slots| slots.iter().any(is_it))
    }

    /// Returns whether an entry says that its times are assumed.
    pub(crate) fn is_assumed(&self, of: &Timed<'db>) -> bool {
        self.slots.get(of).is_some_and(|slots| slots.iter().any(|slot| slot.is_assumed))
    }

    /// Returns whether a measurement says that executions depend on earlier ones.
    pub(crate) fn is_dependent(&self, of: &Timed<'db>) -> bool {
        self.slots.get(of).is_some_and(|slots| slots.iter().any(|slot| slot.is_dependent))
    }

    /// Returns the table that has the time.
    pub(crate) fn table_of(&self, of: &Timed<'db>) -> Option<File> {
        self.slots.get(of)?.first().map(|slot| slot.file)
    }

    /// Returns how many executions that may exceed their times each entry stands for, none where its time holds at every level, and
    /// how many there are in each job: those of the overhead, at most. (In a thread, only the first instance has them.)
    pub(crate) fn levelled(&self) -> (FxHashMap<Timed<'db>, u64>, u64) {
        let depends = |times: &Times| u64::from(matches!(times, Times::PerLevel(_)));
        let overhead = self.overhead.as_ref().map(|(_, _, overhead)| overhead);
        let dispatch = overhead.map_or(0, |it| depends(&it.dispatch));
        // Two switches for a job and for each of its waits, and as many for a lower priority that holds a lock meanwhile.
        let switches = 4 * overhead.map_or(0, |it| depends(&it.context_switch));
        let of_slot = |slot: &TimeSlot| {
            let of_waits = slot.waits.unwrap_or(0).saturating_mul(switches);
            slot.times.as_ref().map_or(0, depends).saturating_add(of_waits)
        };
        let of_slots = |slots: &[TimeSlot]| slots.iter().map(of_slot).max().unwrap_or(0);
        let entries = self.slots.iter().map(|(of, slots)| (of.clone(), of_slots(slots)));
        (entries.collect(), dispatch + switches)
    }

    /// Returns what an execution may take beyond the time of its entry at a level, by the rarer levels of its table; `None` without a time
    /// at the level.
    pub(crate) fn excess(&self, of: &Timed<'db>, level: Level) -> Option<Excess> {
        let [slot] = self.slots.get(of)?.as_slice() else { return None };
        let base = slot.times.as_ref()?.at(&slot.levels, level)?;
        let mut rarer: Vec<Level> = slot.levels.iter().copied().filter(|it| *it <= level).collect();
        rarer.sort_by(|a, b| b.cmp(a));
        let step = |level: Level| {
            let time = slot.times.as_ref()?.at(&slot.levels, level)?;
            Some((time.checked_sub(base).unwrap_or_default(), level.as_f64()))
        };
        Some(Excess { steps: rarer.into_iter().map(step).collect::<Option<_>>()? })
    }

    /// Returns whether no codel or program has a time.
    pub(crate) fn is_empty(&self) -> bool {
        self.slots.is_empty() && self.assume.is_none()
    }

    pub(crate) fn without_level(&self, level: Level) -> Option<&TableLevels> {
        self.with_levels.iter().find(|table| !table.levels.contains(&level))
    }

    /// Returns the time of a subject of the tables, without that of `[assume]`.
    pub(crate) fn time(&self, of: &Timed<'db>, level: Level) -> Lookup<'db> {
        if let Some(refuted) = self.refuted.get(of) {
            return Lookup::Unusable(refuted.clone());
        }
        let slot = match self.slots.get(of).map_or(&[] as &[TimeSlot], Vec::as_slice) {
            [] => return self.unclear.get(of).cloned().map_or(Lookup::Absent, Lookup::Unusable),
            [slot] => slot,
            [first, second, ..] => {
                return Lookup::Unusable(UnusableTime::TwoTimes(of.clone(), [first.file, second.file]));
            }
        };
        let Some(times) = &slot.times else {
            return Lookup::Unusable(UnusableTime::Damaged(of.clone(), slot.file));
        };
        let other_levels = || {
            let table = TableLevels { table: slot.file, levels: slot.levels.to_vec() };
            Lookup::Unusable(UnusableTime::OtherLevels(of.clone(), level, table))
        };
        times.at(&slot.levels, level).map_or_else(other_levels, Lookup::Known)
    }
}

/// Returns what the entries of this key in a section are for.
pub fn timed_by<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    section: TableSection,
    key: &str,
) -> Vec<Timed<'db>> {
    let of = |kind, key: &str, timed: &dyn Fn(Decl<'db>) -> Timed<'db>| {
        names_of(db, project).by_key(kind, key).iter().map(|of| timed(*of)).collect()
    };
    match section {
        TableSection::Codel => of(Kind::Codel, key, &Timed::Codel),
        TableSection::Wait => of(Kind::Codel, key, &Timed::Wait),
        TableSection::Component => of(Kind::Component, key, &Timed::Component),
        TableSection::Program => {
            ProgramKey::parse(key).map_or_else(Vec::new, |ProgramKey { component, program }| {
                of(Kind::Component, component, &|of| Timed::Program(of, program.in_table()))
            })
        }
        TableSection::Access => key.rsplit_once('.').map_or_else(Vec::new, |(component, port)| {
            of(Kind::Component, component, &|of| Timed::Access(of, port.into()))
        }),
        TableSection::Overhead => Vec::new(),
    }
}

/// Returns whether `key` can replace the key of an entry: only where that is written as one token, and where the table has no
/// other entry of `key`.
pub(crate) fn may_replace(db: &dyn ModelDb, file: File, entry: &Entry, key: &str) -> bool {
    let sections = table(db, file).sections().into_iter().map(|(_, section)| section);
    let is_in = |section: &&Vec<Entry>| section.iter().any(|other| other.key_span == entry.key_span);
    let mut all = sections.filter(is_in).flatten();
    let length = entry.key_span.len();
    (length == entry.key.len() || length == entry.key.len() + 2) && !all.any(|other| other.key == key)
}

/// Returns whether another project of the workspace, to which the table may belong too, has what `key` names.
fn is_known_elsewhere<'db>(db: &'db dyn ModelDb, project: Project<'db>, kind: Kind, key: &str) -> bool {
    other_projects(db, project).any(|other| !names_of(db, other).by_key(kind, key).is_empty())
}

/// Returns the other projects of the workspace.
fn other_projects<'db>(db: &'db dyn ModelDb, of: Project<'db>) -> impl Iterator<Item = Project<'db>> {
    let workspace = of.workspace(db);
    let others = all_roots(db, workspace).iter().filter(move |&&root| root != of.root(db));
    others.map(move |&root| Project::new(db, workspace, root))
}

/// Returns the topics of the deployments of a project: `INSTANCE.PORT`.
#[salsa::tracked(returns(ref))]
fn topics_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> BTreeSet<Name> {
    let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
    let topics = deployments.flat_map(|it| &ros2_of(db, project, it).topics);
    topics.map(|it| format!("{}.{}", it.port.0, it.port.1).into()).collect()
}

/// Returns the name of a file, for a user.
pub fn file_name(db: &dyn ModelDb, file: File) -> String {
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

    #[test]
    fn a_pattern_is_not_longer_than_a_path() {
        let of = |length: usize| table_pattern("/robot".as_ref(), &"a".repeat(length)).map(|_| ());
        assert_eq!((of(LONGEST_PATTERN), of(LONGEST_PATTERN + 1)), (Ok(()), Err(PatternError::TooLong)));
        assert_eq!(of(2 * LONGEST_PATTERN), Err(PatternError::TooLong));
    }
}
