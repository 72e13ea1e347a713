//! The diagnostics of models: one file per code, with its page, its messages and its fixes.
//!
//! The header of such a file is the page of `mauve explain CODE`, and the models in it are tests: exactly the lines that end
//! with `// error` (or `warning`, `hint`) have that diagnostic.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mauve_syntax::TextSize;
use mauve_timing::Time;
use rustc_hash::{FxHashMap, FxHashSet};

pub use mauve_hir::Severity;
use mauve_hir::item_tree::{FeatureKind, Kind, Name, NameRef, SourceId, TypeRef};
use mauve_hir::{
    Config, Decl, FeatureOf, File, Location, ModelDb, Project, Type, Workspace, config_file, config_of,
    declaration_facts, declarations, file_groups, file_outside, files_in_group, include_candidates,
    include_rings, includes, is_model, line_of, names_of, not_checked, parse, project_facts, project_files,
    projects, relative_path, root_file, similar, unused_facts,
};
use mauve_wcrt::{
    Query, TimingFact, declared_locks, dependent_facts, missing_time_facts, priority_facts, required_facts,
    system_of, table_facts, thread_facts, timing_facts, trigger_facts,
};

pub mod activity_figure;
pub mod figure;
mod foreign_syntax;
mod reasons;
mod render;
mod support;

pub use configuration::time_error as time_error_message;
pub use execution_times::{
    check_assumption, check_name, measurement_kinds, measurement_refusal, measurement_warning, no_bound,
    origins, refusal_kind, warning_kind,
};
pub use proof::{exceeded, is_lowered, is_missing_proof, missing_proof};
pub use render::render;
pub use support::{
    late_at_most, miss_conditions, miss_rule, not_independent, probability_rounded_up, supported,
};
pub use syntax_error::{message as syntax_error_message, tree_of};
pub use table_error::table_error_message;
pub use task_set_error::task_set_error_message;

/// A kind of diagnostic.
#[derive(Debug, PartialEq, Eq)]
pub struct Code {
    /// Its stable name, such as `deadline-missed`.
    pub name: &'static str,
    /// Its default severity, which `mauve.toml` may change.
    pub severity: Severity,
    /// Whether the marked text is unnecessary, so that an editor may fade it.
    pub unused: bool,
    /// Whether its only fix writes what the text means already, or corrects a name to the only similar one.
    ///
    /// Fixes that invent a value (`missing-field`), choose between two texts (`operation-definition`) or delete declarations
    /// (`unused-variable`) are left to the user. So are all in `mauve.toml` and in tables: a corrected entry may accept a missed
    /// deadline, or hide a diagnostic.
    mechanical: bool,
}

impl Code {
    const fn new(name: &'static str, severity: Severity) -> Code {
        Code { name, severity, unused: false, mechanical: false }
    }

    const fn unused(self) -> Code {
        Code { unused: true, ..self }
    }

    const fn mechanical(self) -> Code {
        Code { mechanical: true, ..self }
    }

    /// Returns whether it is an error in a text, instead of a missed deadline or a chain that is too slow.
    pub fn is_of_text(&self) -> bool {
        self.severity == Severity::Error && ![&DEADLINE_MISSED, &CHAIN_LATE].contains(&self)
    }
}

/// A diagnostic: an error, a warning or a hint at a location.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Diagnostic<'db> {
    /// Its code.
    pub code: &'static Code,
    /// The marked location.
    pub at: Location<'db>,
    /// The finding, its reason, and how to correct it.
    pub message: String,
    /// Related locations, each with a message.
    pub related: Vec<(Location<'db>, String)>,
    /// The quick fixes.
    pub fixes: Vec<Fix<'db>>,
    /// For a missing proof that `mauve.toml` accepts, the reason.
    pub accepted: Option<String>,
    /// The mistake behind it, if other diagnostics may have the same: see `cause.rs`.
    cause: Option<Cause>,
}

/// A quick fix.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Fix<'db> {
    /// Its title in a menu.
    pub title: String,
    /// The locations to replace, each with the new text.
    pub edits: Vec<(Location<'db>, String)>,
}

/// The characters of a message. Names may have tens of thousands, and a message is sent and shown many times.
const MOST_CHARACTERS: usize = 2_000;

/// Returns a text with a capital letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Returns whether a character is a control character, changes the text direction, or is invisible: a terminal obeys it, and a reader
/// is deceived by it.
pub fn is_obeyed(letter: char) -> bool {
    let is_hidden = matches!(letter,
        '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}'
        | '\u{fff9}'..='\u{fffb}' | '\u{fffe}' | '\u{ffff}' | '\u{e0000}'..='\u{e007f}');
    (letter.is_control() && letter != '\t') || is_hidden
}

/// Returns a text of at most `most` characters, without its middle where it is longer.
pub fn shortened(text: &str, most: usize) -> String {
    let length = text.chars().count();
    if length <= most {
        return text.to_owned();
    }
    let tail = most.saturating_sub(1) / 2;
    let head: String = text.chars().take(most.saturating_sub(1 + tail)).collect();
    let tail: String = text.chars().skip(length - tail).collect();
    format!("{head}…{tail}")
}

/// The declaration in which a reported name is written.
#[derive(Clone, Copy)]
struct Scope<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
}

impl<'db> Diagnostic<'db> {
    fn new(code: &'static Code, at: Location<'db>, message: impl Into<String>) -> Diagnostic<'db> {
        Diagnostic {
            code,
            at,
            message: shortened(&message.into(), MOST_CHARACTERS),
            related: Vec::new(),
            fixes: Vec::new(),
            accepted: None,
            cause: None,
        }
    }

    fn caused_by(mut self, cause: Option<Cause>) -> Diagnostic<'db> {
        self.cause = cause;
        self
    }

    fn related(mut self, at: &Location<'db>, message: impl Into<String>) -> Diagnostic<'db> {
        self.related.push((at.clone(), shortened(&message.into(), MOST_CHARACTERS)));
        self
    }

    fn fix(mut self, title: impl Into<String>, at: Location<'db>, text: String) -> Diagnostic<'db> {
        let title = shortened(&title.into(), MOST_CHARACTERS);
        self.fixes.push(Fix { title, edits: vec![(at, text)] });
        self
    }

    /// Adds a suggestion for the unresolved `path`: a library to use, a file to include, or `near`, a similar name.
    fn look_elsewhere(
        mut self,
        scope: Scope<'db>,
        (kind, path): (Kind, &[Name]),
        near: Option<Name>,
    ) -> Diagnostic<'db> {
        let Scope { db, project, of } = scope;
        let Some(name) = path.last() else { return self };
        let has_one =
            || names_of(db, project).anywhere(kind, name).iter().find_map(|it| it.library(db).as_ref());
        let library = match path {
            [library, _, ..] => Some(library),
            _ => has_one(),
        };
        if let Some(found) = library.and_then(|it| misspelt_name::of_letter_case(db, project, it, &self)) {
            return found;
        }
        if path.len() == 1
            && of.library(db).is_some()
            && let Some(library) = has_one()
        {
            self.message += &format!("; library `{library}` has one: add `use {library}`");
            let found = self.caused_by(Some(Cause::NotUsed(of.library(db).clone(), library.clone())));
            return match scope.misspelt_use(library) {
                Some(at) => found.fix(format!("Change to `use {library}`"), at, library.to_string()),
                None => found.add_use(of, library),
            };
        }
        if let Some(file) = file_outside(db, project, kind, name) {
            let path = file.path(db);
            let shown = path.strip_prefix(project.workspace(db).folder(db)).unwrap_or(path);
            self.message += &format!("; {} declares one, and is not included", shown.display());
            return self.caused_by(Some(Cause::NotIncluded(file))).add_include(db, of.file(db), file);
        }
        self.did_you_mean(near)
    }

    /// Adds a fix that adds a `use` of a library or a message package.
    fn add_use(self, of: Decl<'db>, name: &str) -> Diagnostic<'db> {
        self.fix(format!("Add `use {name}`"), Location::Above(of), format!("use {name}\n  "))
    }

    /// Adds a fix that includes `file` in `into`.
    fn add_include(self, db: &'db dyn ModelDb, into: File, file: File) -> Diagnostic<'db> {
        let Some(path) = path_from(into.path(db), file.path(db)).filter(|path| !path.contains(['"', '\\']))
        else {
            return self;
        };
        let line = format!("include \"{path}\"");
        let text = match into.outline(db).includes.is_empty() {
            true => format!("{line}\n"),
            false => format!("\n{line}"),
        };
        self.fix(format!("Add `{line}`"), Location::Includes(into), text)
    }

    /// Adds a fix that adds an item at the end of `of`, on its own line.
    fn add_item(
        self,
        db: &'db dyn ModelDb,
        of: Decl<'db>,
        title: impl Into<String>,
        item: &str,
    ) -> Diagnostic<'db> {
        let indentation = if of.library(db).is_some() { "    " } else { "  " };
        let lines: Vec<String> = item.lines().map(|line| format!("\n{indentation}{line}")).collect();
        self.fix(title, Location::End(of), lines.concat())
    }

    /// Adds a fix that removes the item of `of` that contains `id`.
    fn remove(self, title: impl Into<String>, of: Decl<'db>, id: SourceId) -> Diagnostic<'db> {
        self.fix(title, Location::Item(of, id), String::new())
    }

    /// Offers to replace what is reported.
    fn writing(self, written: Option<&str>) -> Diagnostic<'db> {
        let Some(written) = written else { return self };
        let at = self.at.clone();
        self.fix(format!("Write `{written}`"), at, written.to_owned())
    }

    /// Suggests `near` instead of the marked name, with a fix.
    fn did_you_mean(mut self, near: Option<Name>) -> Diagnostic<'db> {
        let Some(near) = near else { return self };
        self.message += &format!("; did you mean `{near}`?");
        let at = self.at.clone();
        self.fix(format!("Change to `{near}`"), at, near.to_string())
    }
}

/// Returns the location of another source in the declaration that contains `at`.
fn beside<'db>(at: &Location<'db>, id: SourceId) -> Location<'db> {
    match at {
        Location::Source(of, _) => Location::Source(*of, id),
        other => other.clone(),
    }
}

/// Returns the path of a file relative to the folder of the file `from`.
fn path_from(from: &Path, to: &Path) -> Option<String> {
    let path = relative_path(from.parent()?, to);
    let parts: Option<Vec<&str>> = path.components().map(|part| part.as_os_str().to_str()).collect();
    Some(parts?.join("/"))
}

macro_rules! codes {
    ($($module:ident: $name:ident = $severity:ident $text:literal $($flag:ident)*;)*) => {
        $(
            pub(crate) mod $module;
            static $name: Code = Code::new($text, Severity::$severity)$(.$flag())*;
        )*

        /// All codes, with the sources of their pages.
        static CODES: &[(&Code, &str)] =
            &[$((&$name, include_str!(concat!(stringify!($module), ".rs")))),*];
    };
}

// Each code has a file with its page and its messages. `[lints]` of `mauve.toml` may set another severity than this one.
codes! {
    syntax_error: SYNTAX_ERROR = Error "syntax-error" mechanical;
    unreadable_file: UNREADABLE_FILE = Error "unreadable-file";
    unresolved_include: UNRESOLVED_INCLUDE = Error "unresolved-include" mechanical;
    include_cycle: INCLUDE_CYCLE = Warning "include-cycle";
    not_included: NOT_INCLUDED = Warning "not-included";
    unresolved_shell: UNRESOLVED_SHELL = Error "unresolved-shell" mechanical;
    unresolved_core: UNRESOLVED_CORE = Error "unresolved-core" mechanical;
    unresolved_component: UNRESOLVED_COMPONENT = Error "unresolved-component" mechanical;
    unresolved_architecture: UNRESOLVED_ARCHITECTURE = Error "unresolved-architecture" mechanical;
    unresolved_instance: UNRESOLVED_INSTANCE = Error "unresolved-instance" mechanical;
    unresolved_feature: UNRESOLVED_FEATURE = Error "unresolved-feature" mechanical;
    connection_direction: CONNECTION_DIRECTION = Error "connection-direction" mechanical;
    unresolved_codel: UNRESOLVED_CODEL = Error "unresolved-codel" mechanical;
    unresolved_variable: UNRESOLVED_VARIABLE = Error "unresolved-variable" mechanical;
    no_effect: NO_EFFECT = Error "no-effect";
    unresolved_state: UNRESOLVED_STATE = Error "unresolved-state" mechanical;
    unreachable_state: UNREACHABLE_STATE = Warning "unreachable-state" unused;
    never_taken: NEVER_TAKEN = Warning "never-taken" unused;
    ambiguous_name: AMBIGUOUS_NAME = Error "ambiguous-name";
    duplicate_definition: DUPLICATE_DEFINITION = Error "duplicate-definition";
    duplicate_hook: DUPLICATE_HOOK = Error "duplicate-hook";
    duplicate_activity: DUPLICATE_ACTIVITY = Error "duplicate-activity";
    duplicate_field: DUPLICATE_FIELD = Error "duplicate-field";
    conflicting_fields: CONFLICTING_FIELDS = Error "conflicting-fields";
    initial_state: INITIAL_STATE = Error "initial-state";
    update_or_statemachine: UPDATE_OR_STATEMACHINE = Error "update-or-statemachine";
    wrong_shell: WRONG_SHELL = Error "wrong-shell";
    undeclared_operation: UNDECLARED_OPERATION = Error "undeclared-operation";
    undefined_operation: UNDEFINED_OPERATION = Error "undefined-operation";
    recursive_operation: RECURSIVE_OPERATION = Error "recursive-operation";
    blocking_call: BLOCKING_CALL = Error "blocking-call";
    inheritance_cycle: INHERITANCE_CYCLE = Error "inheritance-cycle";
    import_cycle: IMPORT_CYCLE = Error "import-cycle";
    too_large: TOO_LARGE = Error "too-large";
    deployment_target: DEPLOYMENT_TARGET = Error "deployment-target";
    missing_activity: MISSING_ACTIVITY = Error "missing-activity";
    missing_field: MISSING_FIELD = Error "missing-field";
    unknown_field: UNKNOWN_FIELD = Error "unknown-field" mechanical;
    invalid_field: INVALID_FIELD = Error "invalid-field";
    deadline_exceeds_period: DEADLINE_EXCEEDS_PERIOD = Hint "deadline-exceeds-period";
    unused_deadline: UNUSED_DEADLINE = Warning "unused-deadline";
    unused_jitter: UNUSED_JITTER = Warning "unused-jitter";
    unused_offset: UNUSED_OFFSET = Warning "unused-offset";
    never_triggered: NEVER_TRIGGERED = Error "never-triggered";
    unread_trigger: UNREAD_TRIGGER = Warning "unread-trigger";
    deadline_missed: DEADLINE_MISSED = Error "deadline-missed";
    chain_late: CHAIN_LATE = Error "chain-late";
    chain_broken: CHAIN_BROKEN = Warning "chain-broken";
    starved_background: STARVED_BACKGROUND = Warning "starved-background";
    overloading_times: OVERLOADING_TIMES = Warning "overloading-times";
    missing_time: MISSING_TIME = Warning "missing-time";
    not_analysed: NOT_ANALYSED = Warning "not-analysed";
    invalid_configuration: INVALID_CONFIGURATION = Error "invalid-configuration";
    invalid_table: INVALID_TABLE = Error "invalid-table";
    unknown_timing_key: UNKNOWN_TIMING_KEY = Warning "unknown-timing-key";
    refuted_time: REFUTED_TIME = Error "refuted-time";
    waiting_codel: WAITING_CODEL = Error "waiting-codel";
    brief_wait: BRIEF_WAIT = Warning "brief-wait";
    undeclared_lock: UNDECLARED_LOCK = Error "undeclared-lock";
    work_elsewhere: WORK_ELSEWHERE = Error "work-elsewhere";
    unmeasured_access: UNMEASURED_ACCESS = Warning "unmeasured-access";
    outdated_measurement: OUTDATED_MEASUREMENT = Hint "outdated-measurement";
    doubtful_measurement: DOUBTFUL_MEASUREMENT = Hint "doubtful-measurement";
    unresolved_operation: UNRESOLVED_OPERATION = Error "unresolved-operation" mechanical;
    argument_count: ARGUMENT_COUNT = Error "argument-count";
    argument_type: ARGUMENT_TYPE = Error "argument-type";
    out_argument: OUT_ARGUMENT = Error "out-argument";
    assignment_type: ASSIGNMENT_TYPE = Error "assignment-type";
    return_type: RETURN_TYPE = Error "return-type";
    condition_type: CONDITION_TYPE = Error "condition-type";
    operator_type: OPERATOR_TYPE = Error "operator-type";
    invalid_type: INVALID_TYPE = Error "invalid-type";
    port_direction: PORT_DIRECTION = Error "port-direction";
    not_assignable: NOT_ASSIGNABLE = Error "not-assignable";
    connection_type: CONNECTION_TYPE = Error "connection-type";
    two_writers: TWO_WRITERS = Error "two-writers";
    operation_signature: OPERATION_SIGNATURE = Error "operation-signature";
    buffer_size: BUFFER_SIZE = Error "buffer-size";
    operation_definition: OPERATION_DEFINITION = Error "operation-definition";
    missing_value: MISSING_VALUE = Error "missing-value";
    outside_interval: OUTSIDE_INTERVAL = Error "outside-interval";
    empty_interval: EMPTY_INTERVAL = Error "empty-interval";
    constant_expression: CONSTANT_EXPRESSION = Error "constant-expression";
    read_before_assignment: READ_BEFORE_ASSIGNMENT = Warning "read-before-assignment";
    not_strongly_connected: NOT_STRONGLY_CONNECTED = Warning "not-strongly-connected";
    lost_write: LOST_WRITE = Warning "lost-write";
    unconnected_operation: UNCONNECTED_OPERATION = Warning "unconnected-operation";
    unconnected_input: UNCONNECTED_INPUT = Hint "unconnected-input";
    equal_priorities: EQUAL_PRIORITIES = Warning "equal-priorities";
    not_deadline_monotonic: NOT_DEADLINE_MONOTONIC = Warning "not-deadline-monotonic";
    stale_data: STALE_DATA = Hint "stale-data";
    may_be_overwritten: MAY_BE_OVERWRITTEN = Hint "may-be-overwritten";
    buffer_stays_full: BUFFER_STAYS_FULL = Warning "buffer-stays-full";
    never_read: NEVER_READ = Hint "never-read";
    invalid_topic: INVALID_TOPIC = Error "invalid-topic";
    across_hosts: ACROSS_HOSTS = Error "across-hosts";
    missing_link: MISSING_LINK = Hint "missing-link";
    unused_codel: UNUSED_CODEL = Hint "unused-codel" unused;
    unused_variable: UNUSED_VARIABLE = Hint "unused-variable" unused;
    unused_property: UNUSED_PROPERTY = Hint "unused-property" unused;
    unused_declaration: UNUSED_DECLARATION = Hint "unused-declaration" unused;
    unused_allow: UNUSED_ALLOW = Warning "unused-allow";
    unreachable_code: UNREACHABLE_CODE = Hint "unreachable-code" unused;
    reserved_name: RESERVED_NAME = Hint "reserved-name";
    missing_else: MISSING_ELSE = Hint "missing-else" mechanical;
    header_colon: HEADER_COLON = Hint "header-colon" mechanical;
    continued_line: CONTINUED_LINE = Hint "continued-line" mechanical;
    misspelt_name: MISSPELT_NAME = Warning "misspelt-name" mechanical;
    unknown_type: UNKNOWN_TYPE = Hint "unknown-type" mechanical;
    unknown_package: UNKNOWN_PACKAGE = Hint "unknown-package";
}

mod allow;
mod cause;
mod chain_reasons;
mod configuration;
mod execution_times;
mod findings;
mod follow_up;
mod lists;
mod mechanical;
mod of_chains;
mod other_kind;
mod proof;
mod statement;
mod table_error;
mod table_reasons;
mod task_set_error;
mod timing_facts;
mod types;

use cause::Cause;
pub use chain_broken::help_of_chain;
pub use chain_reasons::{
    chain_reason, connection_reason, not_lasting, overwrite, reasons_of_chain, steps_apart,
};
pub use findings::{
    Extent, Finding, Findings, Suppression, checked_files, errors_of, errors_of_text, extent_of,
    file_findings, findings_of, first_error, project_diagnostics, workspace_diagnostics, workspace_findings,
};
pub use lists::{all_of, each_once, enumerated, grouped, known_utilisation, utilisation};
pub use reasons::{EXHAUSTED, model_reason, reasons_of, short_reason, timing_reason};
pub use table_reasons::{file_problem, times_of, unusable_time};
use timing_facts::timing_diagnostic;
pub use types::type_name;

/// Codes that were renamed, each with its present name. `[lints]`, `--deny` and `mauve explain` accept the old names.
const RENAMED: &[(&str, &str)] = &[("priority-inversion", "not-deadline-monotonic")];

/// Returns the code of this present or former name.
///
/// ```
/// let code = mauve_diagnostics::code_named("priority-inversion").map(|code| code.name);
/// assert_eq!(code, Some("not-deadline-monotonic"));
/// ```
pub fn code_named(name: &str) -> Option<&'static Code> {
    let renamed = RENAMED.iter().find(|(old, _)| *old == name).map_or(name, |(_, name)| name);
    codes().find(|code| code.name == renamed)
}

/// Returns the severity that `[lints]` gives a code, by its present or a former name; `None` where it gives none, and
/// `Some(None)` where it allows the code.
pub fn severity_set(config: &Config, code: &Code) -> Option<Option<Severity>> {
    let former = RENAMED.iter().filter(|(_, name)| *name == code.name).map(|(old, _)| *old);
    let mut names = std::iter::once(code.name).chain(former);
    names.find_map(|name| config.lints.get(name)).map(|(severity, _)| *severity)
}

/// Returns all codes.
pub fn codes() -> impl Iterator<Item = &'static Code> {
    CODES.iter().map(|(code, _)| *code)
}

/// Returns the page of a diagnostic for `mauve explain`, in Markdown.
///
/// ```
/// assert!(mauve_diagnostics::page("deadline-missed").is_some_and(|page| page.starts_with("# deadline-missed")));
/// ```
pub fn page(name: &str) -> Option<String> {
    let Some(named) = code_named(name) else { return execution_times::measurement_page(name) };
    let (_, source) = CODES.iter().find(|(code, _)| *code == named)?;
    let lines = source.lines().take_while(|line| line.starts_with("//!"));
    Some(
        lines
            .map(|line| line.trim_start_matches("//!").strip_prefix(' ').unwrap_or("").to_owned() + "\n")
            .collect(),
    )
}

/// Returns the first sentence of a diagnostic's page, without its full stop; empty for an unknown code.
pub fn summary(name: &str) -> String {
    let page = page(name).unwrap_or_default();
    let paragraph = page.split("\n\n").nth(1).unwrap_or_default().replace('\n', " ");
    paragraph.split(". ").next().unwrap_or_default().trim_end_matches('.').to_owned()
}

/// Returns the diagnostics of a file: of its text, its syntax and its includes.
#[salsa::tracked(returns(ref))]
pub fn file_diagnostics<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    file: File,
) -> Box<[Arc<Diagnostic<'db>>]> {
    let mut found = Vec::new();
    // An unreadable file outside the project is reported at its include.
    let is_elsewhere = |file: File| file.is_outside(db) && workspace.included(db).contains(file.path(db));
    if let Some(problem) = file.problem(db).as_ref().filter(|_| !is_elsewhere(file)) {
        let end = file.text(db).len() as u32;
        found.push(unreadable_file::report(Location::Range(file, end, end), problem.message()));
    }
    // Syntax errors at the end of a truncated text are not the user's.
    for error in follow_up::syntax_errors(db, file).iter().filter(|_| file.problem(db).is_none()) {
        let at = Location::Range(file, error.range.start().into(), error.range.end().into());
        found.push(syntax_error::report(parse(db, file), file, error, at));
    }
    let cycles = include_rings(db, workspace);
    let in_cycle = |target: File| cycles.get(&file).is_some_and(|cycle| cycles.get(&target) == Some(cycle));
    let mut cycle = false;
    let errors = parse(db, file).errors();
    for (index, (path, target)) in
        file.outline(db).includes.iter().zip(includes(db, workspace, file)).enumerate()
    {
        let at = Location::Include(file, index as u32);
        let refused = target.filter(|target| is_elsewhere(*target)).and_then(|it| it.problem(db).as_ref());
        if let Some(problem) = refused {
            found.push(unreadable_file::report(at, problem.message()));
            continue;
        }
        match (path, target) {
            // The syntax error in the path is reported.
            (Some(_), None) if errors.iter().any(|it| it.range.intersect(at.range(db)).is_some()) => {}
            (Some(path), None) => found.push(missing_include(db, workspace, file, at, path)),
            // One warning per file, even if several of its includes are in the cycle.
            (Some(path), Some(target)) if in_cycle(*target) && !std::mem::replace(&mut cycle, true) => {
                found.push(include_cycle::report(at, path));
            }
            _ => {}
        }
    }
    found.into_iter().map(Arc::new).collect()
}

/// The files of a workspace, for suggestions at unresolved includes: a search for each of them would be quadratic.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct IncludeFolders {
    by_folder: FxHashMap<PathBuf, Vec<PathBuf>>,
    by_name: FxHashMap<OsString, Vec<PathBuf>>,
}

#[salsa::tracked(returns(ref))]
fn folders_of(db: &dyn ModelDb, workspace: Workspace) -> IncludeFolders {
    let mut folders = IncludeFolders::default();
    for path in workspace.files(db).keys() {
        if let (Some(folder), Some(name)) = (path.parent(), path.file_name()) {
            folders.by_folder.entry(folder.to_owned()).or_default().push(path.clone());
            folders.by_name.entry(name.to_owned()).or_default().push(path.clone());
        }
    }
    folders
}

fn missing_include<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    file: File,
    at: Location<'db>,
    path: &str,
) -> Diagnostic<'db> {
    let candidates = include_candidates(db, workspace, file, path);
    let searched: Vec<String> = candidates.iter().map(|path| path.display().to_string()).collect();
    let beside = candidates.first().and_then(|path| path.parent());
    let folders = folders_of(db, workspace);
    let in_folder = |folder: &Path| folders.by_folder.get(folder).into_iter().flatten();
    let here = beside.into_iter().flat_map(in_folder).filter(|path| *path != file.path(db));
    let here = here.filter_map(|path| path.file_name()?.to_str());
    let (folder, name) = path.rsplit_once('/').map_or(("", path), |(folder, name)| (folder, name));
    let near = mauve_syntax::similar(name, here);
    let near =
        near.map(|near| if folder.is_empty() { near.into() } else { format!("{folder}/{near}").into() });
    let folder = candidates.first().map(PathBuf::as_path).unwrap_or(Path::new(""));
    let inside = in_folder(folder).filter(|path| is_model(path));
    let inside: Vec<String> = inside.filter_map(|it| path_from(file.path(db), it)).collect();
    if !inside.is_empty() {
        return unresolved_include::folder(at, path, &inside);
    }
    let with_extension =
        candidates.iter().any(|it| workspace.files(db).contains_key(&it.with_extension("mal")));
    let moved = || {
        let same = folders.by_name.get(OsStr::new(name)).into_iter().flatten();
        let mut same = same.filter(|it| *it != file.path(db));
        let found = same.next().filter(|_| same.next().is_none())?;
        Some(Name::from(path_from(file.path(db), found)?))
    };
    let near = match with_extension && Path::new(path).extension().is_none() {
        true => Some(format!("{path}.mal").into()),
        false => moved().or(near),
    };
    unresolved_include::report(at, path, &searched, near)
}

/// Returns the diagnostics of a declaration.
#[salsa::tracked(returns(ref))]
pub fn declaration_diagnostics<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
) -> Box<[Arc<Diagnostic<'db>>]> {
    let mut found: Vec<Arc<Diagnostic<'db>>> = Vec::new();
    let system = (decl.kind(db) == Kind::Deployment).then(|| system_of(db, project, decl));
    if let Some(system) = system {
        found.extend(timing_diagnostics(db, project, &system.facts));
    }
    let reported = declaration_facts(db, project, decl).iter().filter(|fact| !fact.is_follow_up);
    found.extend(reported.map(|fact| Arc::new(render(db, project, fact))));
    if let Some(system) = system {
        let facts = timing_facts(db, project, decl, Query::shown(db, project, decl));
        let mut of_priorities = priority_facts(db, project, decl, &system.activities);
        of_priorities.retain(|fact| !proof::is_moot(fact, &facts));
        found.extend(timing_diagnostics(db, project, &of_priorities));
        found.extend(facts.iter().flat_map(|fact| {
            let mut diagnostic = timing_diagnostic(db, project, fact);
            match proof::acceptance(db, project, decl, fact) {
                Ok(accepted) => diagnostic.accepted = accepted,
                Err(ceiling) => diagnostic.message += &format!("; {ceiling}, by mauve.toml"),
            }
            let in_table = overloading_times::in_table(db, decl, fact, &diagnostic);
            std::iter::once(diagnostic).chain(in_table).map(Arc::new)
        }));
        found.extend(timing_diagnostics(db, project, &trigger_facts(db, project, decl)));
        found.extend(of_chains::chain_diagnostics(db, project, decl));
    }
    found.into_boxed_slice()
}

/// Returns the diagnostics of facts of the timing analysis.
pub fn timing_diagnostics<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    facts: &[TimingFact<'db>],
) -> Vec<Arc<Diagnostic<'db>>> {
    facts.iter().map(|fact| Arc::new(timing_diagnostic(db, project, fact))).collect()
}
