//! The findings of a workspace: the diagnostics of all its projects, each once, with its severity; shown or suppressed.
//!
//! ```text
//! facts of a declaration ─→ diagnostics_in (a file) ─┬────────────→ findings_of ─→ the file's list in an editor
//! facts of the project ───→ of_project ──────────────┴→ gathered ─↗
//! ```
//!
//! Each query is about one file, so that an edit renders, sorts and compares only the findings of the files that it concerns. The
//! findings of most files depend on no other text: salsa does not verify those of closed files after an edit.

use super::*;

/// A diagnostic with its severity, and its project if the projects of the workspace differ.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Finding<'db> {
    /// The diagnostic. An edit shares those that it does not change.
    pub diagnostic: Arc<Diagnostic<'db>>,
    /// Its severity according to `mauve.toml`.
    pub severity: Severity,
    /// The first project that has it; `None` if all projects with the file have it.
    pub only_in: Option<Project<'db>>,
}

/// Why a finding is not shown.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum Suppression {
    /// A comment at its location has this reason.
    Comment(String),
    /// `mauve.toml` accepts the missing proof for this reason.
    Accepted(String),
}

/// Findings, sorted by file and location: those that are shown, and those that the user suppresses.
#[derive(Debug, Clone, Default, PartialEq, Eq, salsa::SalsaValue)]
pub struct Findings<'db> {
    /// Those that are shown.
    pub shown: Vec<Finding<'db>>,
    /// The others, each with the reason.
    pub suppressed: Vec<(Finding<'db>, Suppression)>,
}

/// Returns all diagnostics of a project, including those of its timing, in no particular order.
pub fn project_diagnostics<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> impl Iterator<Item = &'db Arc<Diagnostic<'db>>> {
    let own = project_files(db, project).iter().flat_map(move |&file| own_diagnostics(db, project, file));
    own.chain(gathered(db, project).values().flatten())
}

/// Returns the number of errors in the models, the tables and the configuration of a project, without missed deadlines and
/// with their default severity. With an error, no deployment of the project is proved.
pub fn errors_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> usize {
    let config = config_diagnostics(db, project.workspace(db));
    let all = project_diagnostics(db, project).map(Arc::as_ref).chain(&config);
    all.filter(|diagnostic| diagnostic.code.is_of_text()).count()
}

/// Returns the first of [`errors_of`] a project, by path and place.
pub fn first_error<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Option<Diagnostic<'db>> {
    let of_project = project_diagnostics(db, project).map(|it| Diagnostic::clone(it));
    let all = of_project.chain(config_diagnostics(db, project.workspace(db)));
    let place = |it: &Diagnostic<'db>| {
        (it.at.file(db).path(db), it.at.range(db).start(), it.code.name, it.message.clone())
    };
    all.filter(|it| it.code.is_of_text()).min_by_key(place)
}

/// Returns the sum of [`errors_of`] all projects of these workspaces, counting each error of a workspace once.
pub fn errors_of_text(db: &dyn ModelDb, workspaces: &[Workspace]) -> usize {
    let files = workspaces.iter().flat_map(|&it| checked_files(db, it).iter().map(move |&file| (it, file)));
    let all = files.flat_map(|(workspace, file)| diagnostics_at(db, workspace, file, Extent::All));
    all.filter(|(_, diagnostic, _)| diagnostic.code.is_of_text()).count()
}

/// Returns the findings of a workspace that are shown, each once, sorted by file and location.
pub fn workspace_diagnostics<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<Finding<'db>> {
    let all = checked_files(db, workspace).iter().flat_map(|&file| &file_findings(db, workspace, file).shown);
    all.cloned().collect()
}

/// Returns the findings of a workspace, with those that comments and `mauve.toml` suppress.
pub fn workspace_findings<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Findings<'db> {
    let mut all = Findings::default();
    for &file in checked_files(db, workspace) {
        let Findings { shown, suppressed } = file_findings(db, workspace, file);
        all.shown.extend_from_slice(shown);
        all.suppressed.extend_from_slice(suppressed);
    }
    all
}

/// Returns the files that may have findings, sorted by their paths: the models of the projects, those that no root includes, the
/// tables and the configuration.
#[salsa::tracked(returns(ref))]
pub fn checked_files(db: &dyn ModelDb, workspace: Workspace) -> Vec<File> {
    let models = projects_by_file(db, workspace).keys().chain(models_not_included(db, workspace)).copied();
    let inputs = mauve_wcrt::input_files(db, workspace).0;
    let mut all: Vec<File> = models.chain(inputs).chain(config_file(db, workspace)).collect();
    all.sort_by_cached_key(|file| file.path(db).clone());
    all.dedup();
    all
}

/// Which of the findings in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Extent {
    /// All findings.
    All,
    /// Those that are known from the diagnostics of the file and its declarations.
    Own,
    /// The same, where the others are not known yet.
    First,
}

/// Returns the extent that has all findings in a file. Queries should not depend on it, because any edit may change it.
pub fn extent_of(db: &dyn ModelDb, workspace: Workspace, file: File) -> Extent {
    let Some(projects) = projects_by_file(db, workspace).get(&file) else { return Extent::All };
    let has_others = projects.iter().any(|&project| gathered(db, project).contains_key(&file));
    match has_others || !models_not_included(db, workspace).is_empty() {
        true => Extent::All,
        false => Extent::Own,
    }
}

/// Returns the findings in a file of a workspace.
pub fn file_findings<'db>(db: &'db dyn ModelDb, workspace: Workspace, file: File) -> &'db Findings<'db> {
    findings_of(db, workspace, file, extent_of(db, workspace, file))
}

/// Returns the findings in a file of a workspace, those of an extent.
#[salsa::tracked(returns(ref))]
pub fn findings_of<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    file: File,
    extent: Extent,
) -> Findings<'db> {
    let config = config_of(db, workspace);
    let severity = |code: &Code| severity_set(config, code).unwrap_or(Some(code.severity));
    let mut used: FxHashSet<usize> = FxHashSet::default();
    // Each with its start, by which they are sorted.
    let (mut shown, mut suppressed) = (Vec::new(), Vec::new());
    for (start, diagnostic, only_in) in diagnostics_at(db, workspace, file, extent) {
        let of = diagnostic.at.file(db);
        let comment = allow::allows(db, of).at(db, of, start, diagnostic.code);
        used.extend(comment.map(|(index, _)| index));
        let Some(severity) = severity(diagnostic.code) else { continue };
        let accepted = diagnostic.accepted.clone().map(Suppression::Accepted);
        let suppression = accepted.or(comment.map(|(_, reason)| Suppression::Comment(reason.to_owned())));
        let finding = Finding { diagnostic, severity, only_in };
        match suppression {
            Some(why) => suppressed.push((start, (finding, why))),
            None => shown.push((start, finding)),
        }
    }
    if let Some(severity) = severity(&UNUSED_ALLOW)
        && extent != Extent::First
        && !models_not_included(db, workspace).contains(&file)
    {
        let allows = allow::allows(db, file).all.iter().enumerate();
        let unused = allows.filter(|(index, _)| !used.contains(index));
        shown.extend(unused.map(|(_, allow)| {
            let diagnostic = Arc::new(unused_allow::report(file, allow));
            (diagnostic.at.range(db).start(), Finding { diagnostic, severity, only_in: None })
        }));
    }
    shown.sort_by_key(|(start, finding)| (*start, finding.diagnostic.code.name));
    suppressed.sort_by_key(|(start, (finding, _))| (*start, finding.diagnostic.code.name));
    Findings {
        shown: shown.into_iter().map(|(_, finding)| finding).collect(),
        suppressed: suppressed.into_iter().map(|(_, finding)| finding).collect(),
    }
}

/// Returns the diagnostics of a file of a project and of its declarations. Some of them may be located in another file.
#[salsa::tracked(returns(ref))]
fn diagnostics_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
) -> Box<[Arc<Diagnostic<'db>>]> {
    let mut found = file_diagnostics(db, project.workspace(db), file).to_vec();
    for &decl in &declarations(db, file).all {
        // Without facts, there is no need for a query result.
        if decl.kind(db) == Kind::Deployment || !declaration_facts(db, project, decl).is_empty() {
            found.extend(declaration_diagnostics(db, project, decl).iter().cloned());
        }
    }
    follow_up::remove_on_broken_lines(db, project.workspace(db), &mut found);
    found.into_boxed_slice()
}

/// Returns whether [`gathered`] has a diagnostic of [`diagnostics_in`] this file.
fn is_gathered(db: &dyn ModelDb, diagnostic: &Diagnostic<'_>, file: File) -> bool {
    diagnostic.cause.is_some() || diagnostic.at.file(db) != file
}

fn own_diagnostics<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
) -> impl Iterator<Item = &'db Arc<Diagnostic<'db>>> {
    diagnostics_in(db, project, file).iter().filter(move |it| !is_gathered(db, it, file))
}

/// Returns the diagnostics that depend on several files: of the facts of the project, of times that are missing, of tables.
#[salsa::tracked(returns(ref))]
fn of_project<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Box<[Arc<Diagnostic<'db>>]> {
    let facts = project_facts(db, project).iter().chain(unused_facts(db, project));
    let mut found: Vec<Arc<Diagnostic<'db>>> = facts.map(|fact| render(db, project, fact).into()).collect();
    let missing = missing_time_facts(db, project);
    found.extend(timing_diagnostics(db, project, missing));
    let of_locks = declared_locks(db, project).facts.iter().cloned();
    let of_config = of_locks.chain(required_facts(db, project)).chain(dependent_facts(db, project));
    let of_config = of_config.chain(thread_facts(db, project.workspace(db)));
    let of_tables: Vec<TimingFact<'db>> = table_facts(db, project).into_iter().chain(of_config).collect();
    let mut in_tables = timing_diagnostics(db, project, &of_tables);
    in_tables.sort_by_key(|it| match it.at {
        Location::Range(file, start, _) => (file.path(db).clone(), start, it.message.clone()),
        _ => Default::default(),
    });
    found.extend(in_tables);
    follow_up::remove_on_broken_lines(db, project.workspace(db), &mut found);
    found.into_boxed_slice()
}

/// Returns, by their files, the diagnostics of a project that are not known from their file alone: those of [`of_project`], those
/// in other files than their declarations, and one for each cause that several files may have.
#[salsa::tracked(returns(ref))]
fn gathered<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> FxHashMap<File, Vec<Arc<Diagnostic<'db>>>> {
    let in_files = file_groups(db, project).flat_map(|group| gathered_in_group(db, project, group));
    let mut all: Vec<_> = in_files.chain(of_project(db, project)).cloned().collect();
    // With an error nothing is proved, and its correction may give a chain its latency.
    let is_chain = |it: &Arc<Diagnostic<'db>>| *it.code == CHAIN_BROKEN;
    let own = || project_files(db, project).iter().flat_map(|&file| own_diagnostics(db, project, file));
    if all.iter().any(is_chain) && own().chain(&all).any(|it| it.code.is_of_text()) {
        all.retain(|it| !is_chain(it));
    }
    let mut by_file: FxHashMap<File, Vec<Arc<Diagnostic<'db>>>> = FxHashMap::default();
    for diagnostic in cause::one_for_each_cause(db, all) {
        by_file.entry(diagnostic.at.file(db)).or_default().push(diagnostic);
    }
    by_file
}

/// Returns the diagnostics in a group of files that [`gathered`] has.
#[salsa::tracked(returns(ref))]
fn gathered_in_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    group: u32,
) -> Vec<Arc<Diagnostic<'db>>> {
    let found = files_in_group(db, project, group).iter().flat_map(|&file| {
        diagnostics_in(db, project, file).iter().filter(move |diagnostic| is_gathered(db, diagnostic, file))
    });
    found.cloned().collect()
}

/// Returns the projects that contain each model.
#[salsa::tracked(returns(ref))]
fn projects_by_file<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> FxHashMap<File, Vec<Project<'db>>> {
    let mut found: FxHashMap<File, Vec<Project<'db>>> = FxHashMap::default();
    for &project in projects(db, workspace) {
        for &file in project_files(db, project) {
            found.entry(file).or_default().push(project);
        }
    }
    found
}

/// Returns the models that no root includes.
#[salsa::tracked(returns(ref))]
fn models_not_included(db: &dyn ModelDb, workspace: Workspace) -> FxHashSet<File> {
    not_checked(db, workspace).into_iter().collect()
}

/// Returns the files that are not included and whose declarations are missing, each with whether that is an error.
#[salsa::tracked(returns(ref))]
fn missing_files(db: &dyn ModelDb, workspace: Workspace) -> FxHashMap<File, bool> {
    let gathered =
        projects(db, workspace).iter().flat_map(|&project| gathered(db, project).values().flatten());
    let mut missing: FxHashMap<File, bool> = FxHashMap::default();
    for diagnostic in gathered {
        if let Some(Cause::NotIncluded(file)) = diagnostic.cause {
            *missing.entry(file).or_default() |= diagnostic.code.severity == Severity::Error;
        }
    }
    missing
}

/// Returns the diagnostics in a file, each once for all projects, with its start and [`Finding::only_in`]; whatever severity
/// `mauve.toml` gives them.
fn diagnostics_at<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    file: File,
    extent: Extent,
) -> Vec<(TextSize, Arc<Diagnostic<'db>>, Option<Project<'db>>)> {
    // A table belongs to all projects. No project contains the configuration, but diagnostics of each may be there.
    let containing = projects_by_file(db, workspace).get(&file).map(Vec::as_slice);
    let is_table = containing.is_none() && mauve_wcrt::input_files(db, workspace).0.any(|it| it == file);
    let having = if is_table { projects(db, workspace) } else { containing.unwrap_or_default() };
    let mut found: Vec<(TextSize, &'db Arc<Diagnostic<'db>>, Vec<Project<'db>>)> = Vec::new();
    let mut index: FxHashMap<(TextSize, &'static str, &'db str), usize> = FxHashMap::default();
    for &project in containing.unwrap_or(projects(db, workspace)) {
        let own = containing.is_some().then(|| own_diagnostics(db, project, file));
        let gathered = (extent == Extent::All).then(|| gathered(db, project).get(&file));
        let gathered = gathered.flatten().into_iter().flatten();
        for diagnostic in own.into_iter().flatten().chain(gathered) {
            let start = diagnostic.at.range(db).start();
            let key = (start, diagnostic.code.name, diagnostic.message.as_str());
            let at = *index.entry(key).or_insert(found.len());
            match found.get_mut(at) {
                Some((.., owners)) if owners.last() == Some(&project) => {}
                Some((.., owners)) => owners.push(project),
                None => found.push((start, diagnostic, vec![project])),
            }
        }
    }
    let mut findings = Vec::new();
    for (start, diagnostic, owners) in found {
        let only_in = owners.first().copied().filter(|_| owners.len() < having.len());
        // A declaration that one project does not use may be used by another.
        let is_used =
            diagnostic.code.unused && diagnostic.code.severity == Severity::Hint && only_in.is_some();
        if !is_used {
            findings.push((start, diagnostic.clone(), only_in));
        }
    }
    let of_text = |diagnostic: Diagnostic<'db>| (diagnostic.at.range(db).start(), Arc::new(diagnostic), None);
    let not_included = models_not_included(db, workspace);
    if !not_included.is_empty() {
        // A missing include is reported once: where a name is missing, otherwise in the file.
        let missing = missing_files(db, workspace);
        let in_file = |cause: &Option<Cause>| match cause {
            Some(Cause::NotIncluded(file)) => {
                missing.get(file) == Some(&false) && not_included.contains(file)
            }
            _ => false,
        };
        findings.retain(|(_, diagnostic, _)| !in_file(&diagnostic.cause));
        if not_included.contains(&file) && missing.get(&file) != Some(&true) {
            findings.push(of_text(not_included::report(file)));
        }
    }
    if config_file(db, workspace) == Some(file) {
        findings.extend(config_diagnostics(db, workspace).into_iter().map(of_text));
    }
    findings
}

/// Returns the diagnostics of `mauve.toml`.
fn config_diagnostics<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<Diagnostic<'db>> {
    let Some(file) = config_file(db, workspace) else { return Vec::new() };
    let config = config_of(db, workspace);
    let at = |span: &std::ops::Range<usize>| Location::of_span(file, span);
    let mut found: Vec<Diagnostic<'db>> = Vec::new();
    for mauve_hir::Mistake { kind, span, near } in &config.errors {
        let report = invalid_configuration::report(at(span), configuration::mistake(kind));
        found.push(report.did_you_mean(near.clone()));
    }
    for (name, (_, span)) in config.lints.iter().filter(|(name, _)| code_named(name).is_none()) {
        let near = mauve_syntax::similar(name, codes().map(|code| code.name)).map(Name::from);
        let message = format!("no diagnostic `{name}` (`mauve explain all` lists them)");
        found.push(invalid_configuration::report(at(span), message).did_you_mean(near));
    }
    for (error, span) in mauve_wcrt::input_files(db, workspace).1 {
        found.push(invalid_configuration::report(at(span), table_reasons::table_files_error(error)));
    }
    for (path, span) in &config.roots {
        if root_file(db, workspace, path).is_none() {
            found.push(invalid_configuration::report(at(span), format!("no file `{path}` in this folder")));
        }
    }
    let named = mauve_hir::check_configuration(db, workspace);
    found.extend(named.iter().map(|(project, fact)| render(db, *project, fact)));
    // The right key may exist beside the misspelt one: a second one is no TOML.
    let is_readable = |fix: &Fix<'db>| {
        let [(at, text)] = fix.edits.as_slice() else { return true };
        let mut fixed = file.text(db).to_string();
        fixed.replace_range(std::ops::Range::<usize>::from(at.range(db)), text);
        toml::de::DeTable::parse(&fixed).is_ok()
    };
    for diagnostic in &mut found {
        diagnostic.fixes.retain(is_readable);
    }
    found
}
