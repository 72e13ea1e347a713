//! What is wrong in a model: a file for each code, with its page, its messages and its fixes.
//!
//! The header of such a file is the page of `mauve explain CODE`, and the models in it are tests: a line that ends with
//! `// error` (or `warning`, `hint`) has that diagnostic, and no other line has.

use std::path::{Component, Path};

use mauve_timing::Time;
use rustc_hash::FxHashMap;

pub use mauve_hir::Severity;
use mauve_hir::item_tree::{FeatureKind, Kind, Name, NameRef, SourceId, TypeRef};
use mauve_hir::{
    Decl, FeatureOf, File, Location, ModelDb, Names, Project, Type, Workspace, config_file, config_of,
    declaration_facts, declarations, file_outside, include_candidates, include_rings, includes, item_tree_of,
    names_of, not_checked, parse, project_facts, project_files, projects, root_file, similar,
};
use mauve_wcrt::{
    Query, TimingFact, WhatIfField, facts_if, priority_facts, system_of, table_facts, timing_facts,
};

pub mod reasons;
mod render;

pub use render::render;
pub use syntax_error::{message as syntax_error_message, tree_of};

/// A kind of diagnostic.
#[derive(Debug, PartialEq, Eq)]
pub struct Code {
    /// Its stable name, such as `deadline-missed`.
    pub name: &'static str,
    /// How bad it is, unless `mauve.toml` says otherwise.
    pub severity: Severity,
    /// Is what it marks there for nothing, so that an editor may show it faded?
    pub unused: bool,
}

impl Code {
    /// Is it an error in a text, and not in what its figures are?
    pub fn is_of_text(&self) -> bool {
        self.severity == Severity::Error && *self != deadline_missed::DEADLINE_MISSED
    }
}

/// Something wrong, at a place.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Diagnostic<'db> {
    /// What kind of thing.
    pub code: &'static Code,
    /// Where.
    pub at: Location<'db>,
    /// What was found, what was expected, what to do.
    pub message: String,
    /// Other places that matter.
    pub related: Vec<(Location<'db>, String)>,
    /// What would mend it.
    pub fixes: Vec<Fix<'db>>,
}

/// An edit that mends something.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Fix<'db> {
    /// For the user to choose by.
    pub title: String,
    /// What is replaced, and by what.
    pub edits: Vec<(Location<'db>, String)>,
}

impl<'db> Diagnostic<'db> {
    fn new(code: &'static Code, at: Location<'db>, message: impl Into<String>) -> Diagnostic<'db> {
        Diagnostic { code, at, message: message.into(), related: Vec::new(), fixes: Vec::new() }
    }

    /// Adds a related location.
    fn related(mut self, at: &Location<'db>, message: impl Into<String>) -> Diagnostic<'db> {
        self.related.push((at.clone(), message.into()));
        self
    }

    fn fix(mut self, title: impl Into<String>, at: Location<'db>, text: String) -> Diagnostic<'db> {
        self.fixes.push(Fix { title: title.into(), edits: vec![(at, text)] });
        self
    }

    /// Says where `path`, written in `of`, may be found: in a library that is not used, in a file that is not included,
    /// under a similar name.
    fn look_elsewhere(
        mut self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
        of: Decl<'db>,
        kind: Kind,
        path: &[Name],
    ) -> Diagnostic<'db> {
        let names = names_of(db, project);
        let Some(name) = path.last() else { return self };
        let library = of.library(db).as_ref();
        let mut outside = None;
        let advice = advice(db, names, library, kind, path).or_else(|| {
            let file = file_outside(db, project, kind, name)?;
            let shown = file.path(db).strip_prefix(project.workspace(db).folder(db)).unwrap_or(file.path(db));
            outside = Some(file);
            Some((format!("{} declares one, and is not included", shown.display()), None))
        });
        if let Some((advice, to_use)) = advice {
            self.message += &format!("; {advice}");
            return match (to_use, outside) {
                (Some(library), _) => self.add_use(of, &library),
                (None, Some(file)) => self.add_include(db, of.file(db), file),
                (None, None) => self,
            };
        }
        self.did_you_mean(names.similar(db, library, kind, path))
    }

    /// Offers to write that the library of `of` uses another one, or a message package.
    fn add_use(self, of: Decl<'db>, name: &str) -> Diagnostic<'db> {
        self.fix(format!("Add `use {name}`"), Location::Above(of), format!("use {name}\n  "))
    }

    /// Offers to include `file` in `into`.
    fn add_include(self, db: &'db dyn ModelDb, into: File, file: File) -> Diagnostic<'db> {
        let Some(path) = path_from(into.path(db), file.path(db)).filter(|path| !path.contains(['"', '\\']))
        else {
            return self;
        };
        let line = format!("include \"{path}\"");
        let text = match item_tree_of(db, into).includes.is_empty() {
            true => format!("{line}\n"),
            false => format!("\n{line}"),
        };
        self.fix(format!("Add `{line}`"), Location::Includes(into), text)
    }

    /// Offers to put an item at the end of `of`, on a line of its own.
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

    /// Offers to remove what `part` of `of` is part of.
    fn remove(self, title: impl Into<String>, of: Decl<'db>, id: SourceId) -> Diagnostic<'db> {
        self.fix(title, Location::Item(of, id), String::new())
    }

    /// Suggests `near` instead of the marked name, and offers to write it.
    fn did_you_mean(mut self, near: Option<Name>) -> Diagnostic<'db> {
        let Some(near) = near else { return self };
        self.message += &format!("; did you mean `{near}`?");
        let at = self.at.clone();
        self.fix(format!("Change to `{near}`"), at, near.to_string())
    }
}

/// What to do about `path`, written in `library`, that is not found: a library to use, with its name, or one that is
/// misspelt.
fn advice<'db>(
    db: &'db dyn ModelDb,
    names: &Names<'db>,
    library: Option<&Name>,
    kind: Kind,
    path: &[Name],
) -> Option<(String, Option<Name>)> {
    match path {
        [name] => {
            let of = names.anywhere(kind, name).iter().find_map(|decl| decl.library(db).as_ref())?;
            library.map(|_| (format!("library `{of}` has one: add `use {of}`"), Some(of.clone())))
        }
        [of, name] if !names.has_library(of) => {
            let of = similar(of, names.libraries())?;
            let is_there = !names.in_library(Some(&of), kind, name).is_empty();
            is_there.then(|| (format!("did you mean `{of}.{name}`?"), None))
        }
        _ => None,
    }
}

/// Another part of the declaration in which `at` is.
fn beside<'db>(at: &Location<'db>, id: SourceId) -> Location<'db> {
    match at {
        Location::Source(of, _) => Location::Source(*of, id),
        other => other.clone(),
    }
}

/// The path of a file as the file `from` writes it.
fn path_from(from: &Path, to: &Path) -> Option<String> {
    let (from, to): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (from.parent()?.components().collect(), to.components().collect());
    let same = from.iter().zip(&to).take_while(|(from, to)| from == to).count();
    let up = from.iter().skip(same).map(|_| Some(".."));
    let down = to.iter().skip(same).map(|part| part.as_os_str().to_str());
    let parts: Option<Vec<&str>> = up.chain(down).collect();
    Some(parts?.join("/"))
}

macro_rules! code {
    ($name:ident, $severity:ident, $text:literal) => {
        pub(super) static $name: Code = Code { name: $text, severity: Severity::$severity, unused: false };
    };
    ($name:ident, $severity:ident, $text:literal, Unused) => {
        pub(super) static $name: Code = Code { name: $text, severity: Severity::$severity, unused: true };
    };
}

macro_rules! codes {
    ($($module:ident::$name:ident;)*) => {
        $(pub(crate) mod $module;)*

        /// All kinds of diagnostic, with the sources of their pages.
        static CODES: &[(&Code, &str)] =
            &[$((&$module::$name, include_str!(concat!(stringify!($module), ".rs")))),*];
    };
}

codes! {
    syntax_error::SYNTAX_ERROR;
    unreadable_file::UNREADABLE_FILE;
    unresolved_include::UNRESOLVED_INCLUDE;
    include_cycle::INCLUDE_CYCLE;
    not_included::NOT_INCLUDED;
    unresolved_shell::UNRESOLVED_SHELL;
    unresolved_core::UNRESOLVED_CORE;
    unresolved_component::UNRESOLVED_COMPONENT;
    unresolved_architecture::UNRESOLVED_ARCHITECTURE;
    unresolved_instance::UNRESOLVED_INSTANCE;
    unresolved_feature::UNRESOLVED_FEATURE;
    connection_direction::CONNECTION_DIRECTION;
    unresolved_codel::UNRESOLVED_CODEL;
    unresolved_variable::UNRESOLVED_VARIABLE;
    no_effect::NO_EFFECT;
    unresolved_state::UNRESOLVED_STATE;
    unreachable_state::UNREACHABLE_STATE;
    never_taken::NEVER_TAKEN;
    ambiguous_name::AMBIGUOUS_NAME;
    duplicate_definition::DUPLICATE_DEFINITION;
    duplicate_hook::DUPLICATE_HOOK;
    duplicate_activity::DUPLICATE_ACTIVITY;
    duplicate_field::DUPLICATE_FIELD;
    initial_state::INITIAL_STATE;
    update_or_statemachine::UPDATE_OR_STATEMACHINE;
    wrong_shell::WRONG_SHELL;
    undeclared_operation::UNDECLARED_OPERATION;
    undefined_operation::UNDEFINED_OPERATION;
    recursive_operation::RECURSIVE_OPERATION;
    blocking_call::BLOCKING_CALL;
    inheritance_cycle::INHERITANCE_CYCLE;
    import_cycle::IMPORT_CYCLE;
    too_large::TOO_LARGE;
    deployment_target::DEPLOYMENT_TARGET;
    missing_activity::MISSING_ACTIVITY;
    missing_field::MISSING_FIELD;
    unknown_field::UNKNOWN_FIELD;
    invalid_field::INVALID_FIELD;
    deadline_exceeds_period::DEADLINE_EXCEEDS_PERIOD;
    deadline_missed::DEADLINE_MISSED;
    missing_time::MISSING_TIME;
    not_analysed::NOT_ANALYSED;
    invalid_configuration::INVALID_CONFIGURATION;
    invalid_table::INVALID_TABLE;
    unknown_timing_key::UNKNOWN_TIMING_KEY;
    unresolved_operation::UNRESOLVED_OPERATION;
    argument_count::ARGUMENT_COUNT;
    argument_type::ARGUMENT_TYPE;
    out_argument::OUT_ARGUMENT;
    assignment_type::ASSIGNMENT_TYPE;
    return_type::RETURN_TYPE;
    condition_type::CONDITION_TYPE;
    operator_type::OPERATOR_TYPE;
    invalid_type::INVALID_TYPE;
    port_direction::PORT_DIRECTION;
    not_assignable::NOT_ASSIGNABLE;
    connection_type::CONNECTION_TYPE;
    two_writers::TWO_WRITERS;
    operation_signature::OPERATION_SIGNATURE;
    buffer_size::BUFFER_SIZE;
    operation_definition::OPERATION_DEFINITION;
    missing_value::MISSING_VALUE;
    outside_interval::OUTSIDE_INTERVAL;
    empty_interval::EMPTY_INTERVAL;
    constant_expression::CONSTANT_EXPRESSION;
    read_before_assignment::READ_BEFORE_ASSIGNMENT;
    not_strongly_connected::NOT_STRONGLY_CONNECTED;
    lost_write::LOST_WRITE;
    unconnected_operation::UNCONNECTED_OPERATION;
    unconnected_input::UNCONNECTED_INPUT;
    equal_priorities::EQUAL_PRIORITIES;
    priority_inversion::PRIORITY_INVERSION;
    stale_data::STALE_DATA;
    unused_codel::UNUSED_CODEL;
    unused_variable::UNUSED_VARIABLE;
    unused_property::UNUSED_PROPERTY;
    unused_declaration::UNUSED_DECLARATION;
    unreachable_code::UNREACHABLE_CODE;
    reserved_name::RESERVED_NAME;
    missing_else::MISSING_ELSE;
    header_colon::HEADER_COLON;
    continued_line::CONTINUED_LINE;
    unknown_type::UNKNOWN_TYPE;
    unknown_package::UNKNOWN_PACKAGE;
}

mod configuration;
mod timing_facts;
mod timing_reasons;
mod types;

use timing_facts::timing_diagnostic;
use timing_reasons::enumerated;
pub use timing_reasons::{PROSE, cpu_names, reasons_of, timing_reason, unusable_time};
pub use types::type_name;

/// All kinds of diagnostic.
pub fn codes() -> impl Iterator<Item = &'static Code> {
    CODES.iter().map(|(code, _)| *code)
}

/// The page of a diagnostic, in Markdown: what `mauve explain` shows.
///
/// ```
/// assert!(mauve_diagnostics::page("deadline-missed").is_some_and(|page| page.starts_with("# deadline-missed")));
/// ```
pub fn page(name: &str) -> Option<String> {
    let (_, source) = CODES.iter().find(|(code, _)| code.name == name)?;
    let lines = source.lines().take_while(|line| line.starts_with("//!"));
    Some(
        lines
            .map(|line| line.trim_start_matches("//!").strip_prefix(' ').unwrap_or("").to_owned() + "\n")
            .collect(),
    )
}

/// Everything that is wrong in a project, its timing included, in no particular order.
#[salsa::tracked(returns(ref))]
pub fn project_diagnostics<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Box<[Diagnostic<'db>]> {
    let mut found: Vec<Diagnostic<'db>> = Vec::new();
    for &file in project_files(db, project) {
        found.extend(file_diagnostics(db, project.workspace(db), file).iter().cloned());
        for &decl in declarations(db, file).all.iter().filter(|decl| decl.kind(db) == Kind::Use) {
            found.extend(declaration_diagnostics(db, project, decl).iter().cloned());
        }
    }
    let names = names_of(db, project);
    found.extend(project_facts(db, project).iter().map(|fact| render(db, project, fact)));
    for &decl in &names.all {
        // Where nothing is wrong, nothing is kept.
        if decl.kind(db) == Kind::Deployment || !declaration_facts(db, project, decl).is_empty() {
            found.extend(declaration_diagnostics(db, project, decl).iter().cloned());
        }
    }
    let mut in_tables = timing_diagnostics(db, project, table_facts(db, project));
    in_tables.sort_by_key(|it| match it.at {
        Location::Range(file, start, _) => (file.path(db).clone(), start, it.message.clone()),
        _ => Default::default(),
    });
    found.extend(in_tables);
    found.into_boxed_slice()
}

/// What is wrong in a file by itself: its text, its syntax, its includes.
#[salsa::tracked(returns(ref))]
pub fn file_diagnostics<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    file: File,
) -> Box<[Diagnostic<'db>]> {
    let mut found = Vec::new();
    // What is none of the project's is wrong where it is included.
    let is_elsewhere = |file: File| file.is_outside(db) && workspace.included(db).contains(file.path(db));
    if let Some(problem) = file.problem(db).as_ref().filter(|_| !is_elsewhere(file)) {
        let end = file.text(db).len() as u32;
        found.push(unreadable_file::report(Location::Range(file, end, end), problem.message()));
    }
    // What a file lacks because its text ends too early is no mistake of its own.
    for error in parse(db, file).errors().iter().filter(|_| file.problem(db).is_none()) {
        let at = Location::Range(file, error.range.start().into(), error.range.end().into());
        found.push(syntax_error::report(parse(db, file), file, error, at));
    }
    let tree = item_tree_of(db, file);
    let rings = include_rings(db, workspace);
    let in_ring = |target: File| rings.get(&file).is_some_and(|ring| rings.get(&target) == Some(ring));
    let mut cycle = false;
    let errors = parse(db, file).errors();
    for (index, (path, target)) in tree.includes.iter().zip(includes(db, workspace, file)).enumerate() {
        let at = Location::Include(file, index as u32);
        let refused = target.filter(|target| is_elsewhere(*target)).and_then(|it| it.problem(db).as_ref());
        if let Some(problem) = refused {
            found.push(unreadable_file::report(at, problem.message()));
            continue;
        }
        match (path, target) {
            // A path with a syntax error in it is one mistake.
            (Some(_), None) if errors.iter().any(|it| it.range.intersect(at.range(db)).is_some()) => {}
            (Some(path), None) => found.push(missing_include(db, workspace, file, at, path)),
            // One warning for a file, however many of its includes are part of the ring.
            (Some(path), Some(target)) if in_ring(*target) && !std::mem::replace(&mut cycle, true) => {
                found.push(include_cycle::report(at, path));
            }
            _ => {}
        }
    }
    found.into_boxed_slice()
}

fn missing_include<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    file: File,
    at: Location<'db>,
    path: &str,
) -> Diagnostic<'db> {
    let candidates = include_candidates(db, workspace, file, path);
    let looked: Vec<String> = candidates.iter().map(|path| path.display().to_string()).collect();
    let beside = candidates.first().and_then(|path| path.parent());
    let here = workspace.files(db).keys().filter(|known| known.parent() == beside && *known != file.path(db));
    let here: Vec<Name> = here.filter_map(|known| Some(known.file_name()?.to_str()?.into())).collect();
    let (folder, name) = path.rsplit_once('/').map_or(("", path), |(folder, name)| (folder, name));
    let near = similar(name, &here);
    let near = near.map(|near| if folder.is_empty() { near } else { format!("{folder}/{near}").into() });
    unresolved_include::report(at, path, &looked, near)
}

/// What is wrong in one declaration.
#[salsa::tracked(returns(ref))]
pub fn declaration_diagnostics<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
) -> Box<[Diagnostic<'db>]> {
    let mut found = Vec::new();
    let system = (decl.kind(db) == Kind::Deployment).then(|| system_of(db, project, decl));
    if let Some(system) = system {
        found.extend(timing_diagnostics(db, project, &system.facts));
    }
    found.extend(declaration_facts(db, project, decl).iter().map(|fact| render(db, project, fact)));
    if let Some(system) = system {
        let facts = priority_facts(db, project, decl, &system.activities);
        found.extend(timing_diagnostics(db, project, &facts));
        let facts = timing_facts(db, project, decl, Query::shown(db, project));
        found.extend(timing_diagnostics(db, project, &facts));
    }
    found.into_boxed_slice()
}

/// Returns what is wrong with the activities of a deployment that has these values in them.
pub fn diagnostics_if<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    what_if: &[WhatIfField],
) -> Vec<Diagnostic<'db>> {
    timing_diagnostics(db, project, &facts_if(db, project, deployment, what_if))
}

/// The diagnostics of facts of the timing side.
fn timing_diagnostics<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    facts: &[TimingFact<'db>],
) -> Vec<Diagnostic<'db>> {
    facts.iter().filter_map(|fact| timing_diagnostic(db, project, fact)).collect()
}

/// How many errors the models, the tables and the configuration of a project have, missed deadlines aside, whatever severity
/// `mauve.toml` gives them. No deployment of the project is proved while there is one.
pub fn errors_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> usize {
    let config = config_diagnostics(db, project.workspace(db));
    let all = project_diagnostics(db, project).iter().chain(&config);
    all.filter(|diagnostic| diagnostic.code.is_of_text()).count()
}

/// [`errors_of`] over all projects of a workspace, each error once.
pub fn errors_of_text(db: &dyn ModelDb, workspace: Workspace) -> usize {
    let found = all_findings(db, workspace, |_| true);
    found.iter().filter(|(diagnostic, _)| diagnostic.code.is_of_text()).count()
}

/// A diagnostic, and the root of the project that has it where the projects of the workspace differ.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Finding<'db> {
    /// What is wrong.
    pub diagnostic: Diagnostic<'db>,
    /// How bad it is here: `mauve.toml` may say.
    pub severity: Severity,
    /// The project that has it; none where every project that has the file has it.
    pub only_in: Option<Project<'db>>,
}

/// Everything that is wrong in a workspace, each thing once, by file and place.
pub fn workspace_diagnostics<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<Finding<'db>> {
    findings(db, workspace, |_| true)
}

/// What of that stands in one file. What every project found is known from the last check; nothing is made of the rest.
pub fn diagnostics_of_file<'db>(db: &'db dyn ModelDb, workspace: Workspace, file: File) -> Vec<Finding<'db>> {
    findings(db, workspace, |of| of == file)
}

fn findings<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    is_wanted: impl Fn(File) -> bool,
) -> Vec<Finding<'db>> {
    let lints = &config_of(db, workspace).lints;
    let finding = |(diagnostic, only_in): (Diagnostic<'db>, _)| {
        let severity = lints
            .get(diagnostic.code.name)
            .map_or(Some(diagnostic.code.severity), |(severity, _)| *severity)?;
        Some(Finding { diagnostic, severity, only_in })
    };
    let mut findings: Vec<Finding<'db>> =
        all_findings(db, workspace, is_wanted).into_iter().filter_map(finding).collect();
    findings.sort_by_cached_key(|finding| {
        let at = &finding.diagnostic.at;
        (at.file(db).path(db).clone(), at.range(db).start(), finding.diagnostic.code.name)
    });
    findings
}

/// What is wrong in files that are wanted, whatever severity it has here; with the project that has it, see
/// [`Finding::only_in`].
fn all_findings<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    is_wanted: impl Fn(File) -> bool,
) -> Vec<(Diagnostic<'db>, Option<Project<'db>>)> {
    let projects = projects(db, workspace);
    let mut found: Vec<(Diagnostic<'db>, Vec<Project<'db>>)> = Vec::new();
    let mut index: FxHashMap<(File, u32, &'static str, String), usize> = FxHashMap::default();
    for &project in projects {
        for diagnostic in project_diagnostics(db, project) {
            let file = diagnostic.at.file(db);
            if !is_wanted(file) {
                continue;
            }
            let start = diagnostic.at.range(db).start().into();
            let key = (file, start, diagnostic.code.name, diagnostic.message.clone());
            let at = *index.entry(key).or_insert(found.len());
            match found.get_mut(at) {
                Some((_, having)) if having.last() == Some(&project) => {}
                Some((_, having)) => having.push(project),
                None => found.push((diagnostic.clone(), vec![project])),
            }
        }
    }
    let has_file = |project: &Project<'db>, file: File| {
        let is_table = mauve_wcrt::table_files(db, workspace).files.contains(&file);
        is_table || project_files(db, *project).contains(&file)
    };
    let mut findings = Vec::new();
    for (diagnostic, having) in found {
        let file = diagnostic.at.file(db);
        let everywhere = projects.iter().filter(|project| has_file(project, file)).count() <= having.len();
        let only_in = having.first().copied().filter(|_| !everywhere);
        // What one project does not use is there for another.
        let is_used =
            diagnostic.code.unused && diagnostic.code.severity == Severity::Hint && only_in.is_some();
        if !is_used {
            findings.push((diagnostic, only_in));
        }
    }
    let of_config = config_diagnostics(db, workspace).into_iter();
    let not_included = not_checked(db, workspace).into_iter().map(not_included::report);
    let all = of_config.chain(not_included).filter(|diagnostic| is_wanted(diagnostic.at.file(db)));
    findings.extend(all.map(|diagnostic| (diagnostic, None)));
    findings
}

/// What is wrong in `mauve.toml`.
fn config_diagnostics<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<Diagnostic<'db>> {
    let Some(file) = config_file(db, workspace) else { return Vec::new() };
    let config = config_of(db, workspace);
    let at = |span: &std::ops::Range<usize>| Location::Range(file, span.start as u32, span.end as u32);
    let mut found: Vec<Diagnostic<'db>> = Vec::new();
    for mauve_hir::Mistake { kind, span, near } in &config.errors {
        let report = invalid_configuration::report(at(span), configuration::mistake(kind));
        found.push(report.did_you_mean(near.clone()));
    }
    for (name, (_, span)) in config.lints.iter().filter(|(name, _)| codes().all(|code| code.name != *name)) {
        let near = mauve_syntax::similar(name, codes().map(|code| code.name)).map(Name::from);
        let message = format!("no diagnostic `{name}` (`mauve explain all` lists them)");
        found.push(invalid_configuration::report(at(span), message).did_you_mean(near));
    }
    for (error, span) in &mauve_wcrt::table_files(db, workspace).errors {
        found.push(invalid_configuration::report(at(span), timing_reasons::table_files_error(error)));
    }
    for (path, span) in &config.roots {
        if root_file(db, workspace, path).is_none() {
            found.push(invalid_configuration::report(at(span), format!("no file `{path}` in this folder")));
        }
    }
    for mauve_hir::Chain { name, span, .. } in &config.chains {
        found.push(not_analysed::chain(at(span), name));
    }
    let named = mauve_hir::check_configuration(db, workspace);
    found.extend(named.iter().map(|(project, fact)| render(db, *project, fact)));
    found
}
