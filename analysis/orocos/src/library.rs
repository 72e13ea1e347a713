//! The packages of a project, one for each library with generated files, and their dependencies.

use std::collections::BTreeSet;
use std::sync::Arc;

use mauve_diagnostics::{Diagnostic, Severity, file_findings, project_diagnostics, severity_set};
use mauve_hir::item_tree::{Direction, Kind, Name, Parameter, TypeRef};
use mauve_hir::{
    Callee, Config, Decl, FeatureOf, Location, ModelDb, Project, Type, Workspace, catalogue_of, closure,
    codel, component, config_file, config_of, core, core_of, deployed, external_types, features_of,
    inference_of_core, names_of, shell_of, type_of,
};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::cpp_name::{CppNames, file_name};
use crate::cpp_type::cpp_type;
use crate::generated_file::STANDALONE;

/// Names that no package can have: packages that generated ones depend on, except messages, the namespace of the runtime without
/// Orocos, the folder of standalone programs, and names that CMake reserves: `project(CMAKE)` would set `CMAKE_VERSION`.
const OTHER_PACKAGES: [&str; 10] = [
    "rtt",
    "mauve",
    "ocl",
    "rtt_ros",
    "rtt_roscomm",
    "rtt_rosnode",
    "genmsg",
    STANDALONE,
    "CMAKE",
    "PROJECT",
];

/// A problem that prevents generation.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct GenerationProblem<'db> {
    /// What is wrong.
    pub kind: ProblemKind,
    /// Where.
    pub at: Location<'db>,
}

/// The kinds of problems that prevent the generation of packages.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum ProblemKind {
    /// A diagnostic of the models or of `mauve.toml` is an error; this is its message.
    Diagnostic(String),
    /// The paths of two names differ in case only.
    SamePath {
        /// The kind of artifact with these names.
        of: Artifact,
        /// The name that is declared first.
        first: String,
        /// The other name.
        second: String,
    },
    /// The declaration of a component is incomplete.
    IncompleteComponent,
    /// The table of a type in `mauve.toml` does not name its type in C++.
    UnmappedType(Name),
    /// The C++ type of this type, as written in the model, is unknown.
    UnknownType(String),
    /// Components of libraries call codels of each other's packages.
    CyclicPackages {
        /// One of these packages.
        package: String,
        /// The packages that it calls and that call it.
        others: Vec<String>,
    },
}

/// The artifacts that have a folder or a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Artifact {
    /// A folder.
    Package,
    /// A file.
    Codel,
    /// A folder.
    Component,
    /// A file.
    Deployment,
}

#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct Library<'db> {
    /// Its name in C++ and on the disk: namespace, folder, package.
    pub(crate) package: String,
    /// The codels in the order of the texts, each with its name in the namespace.
    pub(crate) codels: Vec<(Decl<'db>, String)>,
    pub(crate) components: Vec<(Decl<'db>, String)>,
    /// In the order of the texts.
    pub(crate) deployments: Vec<Decl<'db>>,
    /// The numbers of the other libraries whose codels its components call.
    pub(crate) calls: BTreeSet<usize>,
    /// The numbers of the other libraries whose components its deployments run.
    pub(crate) runs: BTreeSet<usize>,
}

/// The libraries of a project with generated packages.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(crate) struct Libraries<'db> {
    /// The libraries; called libraries come before their callers.
    pub(crate) all: Vec<Library<'db>>,
    /// For each codel and component, the number of its library and its name in the namespace.
    places: FxHashMap<Decl<'db>, (usize, String)>,
}

impl<'db> Libraries<'db> {
    /// Returns the library of a codel or a component, and its name in the namespace.
    pub(crate) fn of(&self, decl: Decl<'db>) -> Option<(&Library<'db>, &str)> {
        let (index, name) = self.places.get(&decl)?;
        Some((self.all.get(*index)?, name))
    }

    /// Returns the fully qualified C++ name of a codel or a component: `::motion::clearance`.
    pub(crate) fn qualified(&self, decl: Decl<'db>) -> Option<String> {
        self.of(decl).map(|(library, name)| format!("::{}::{name}", library.package))
    }

    /// Returns the numbers of the libraries that a deployment needs.
    pub(crate) fn needed_by(&self, deployment: Decl<'db>) -> BTreeSet<usize> {
        let own = self.all.iter().position(|library| library.deployments.contains(&deployment));
        let others = |it: usize| {
            let library = self.all.get(it).into_iter();
            library.flat_map(|library| library.calls.union(&library.runs).copied())
        };
        closure(own, others).into_iter().collect()
    }
}

/// Returns the problems that prevent generation from a project: errors in its models and its `mauve.toml`, and
/// unknown C++ types. Missed deadlines and missing times do not prevent it: times are measured in the generated code. Errors are
/// sorted by file and location.
pub fn problems<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<GenerationProblem<'db>> {
    let workspace = project.workspace(db);
    let own = project_diagnostics(db, project).cloned();
    let found = errors(db, workspace, own.chain(configured(db, workspace)));
    if found.is_empty() { libraries(db, project).1.clone() } else { found }
}

/// Returns the errors of the `mauve.toml` of a workspace. [`problems`] has them too, but a workspace without a valid root has no project.
pub fn configuration_problems<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
) -> Vec<GenerationProblem<'db>> {
    errors(db, workspace, configured(db, workspace))
}

/// Returns the diagnostics of the `mauve.toml` of a workspace.
fn configured<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> impl Iterator<Item = Arc<Diagnostic<'db>>> {
    let shown =
        config_file(db, workspace).into_iter().flat_map(move |it| &file_findings(db, workspace, it).shown);
    shown.map(|it| it.diagnostic.clone())
}

/// Returns the errors of some diagnostics, each once, sorted by file and location.
fn errors<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    diagnostics: impl Iterator<Item = Arc<Diagnostic<'db>>>,
) -> Vec<GenerationProblem<'db>> {
    let config = config_of(db, workspace);
    let mut found: Vec<GenerationProblem<'db>> = Vec::new();
    let mut seen: FxHashSet<GenerationProblem<'db>> = FxHashSet::default();
    for diagnostic in diagnostics {
        let here = severity_set(config, diagnostic.code).flatten();
        let is_error = diagnostic.code.severity == Severity::Error || here == Some(Severity::Error);
        let kind = ProblemKind::Diagnostic(diagnostic.message.clone());
        let problem = GenerationProblem { kind, at: diagnostic.at.clone() };
        let is_late = matches!(diagnostic.code.name, "deadline-missed" | "chain-late");
        if is_error && !is_late && seen.insert(problem.clone()) {
            found.push(problem);
        }
    }
    // Otherwise, the first one would depend on the order in which files were read.
    found.sort_by_cached_key(|it| (it.at.file(db).path(db).clone(), it.at.range(db).start()));
    found
}

/// Returns the libraries of a project, and the problems that prevent their generation.
#[salsa::tracked(returns(ref))]
pub(crate) fn libraries<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> (Libraries<'db>, Vec<GenerationProblem<'db>>) {
    let mut reader = LibraryReader { db, project, problems: Vec::new(), reported: FxHashSet::default() };
    let libraries = reader.libraries();
    (libraries, reader.problems)
}

struct LibraryReader<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    problems: Vec<GenerationProblem<'db>>,
    reported: FxHashSet<GenerationProblem<'db>>,
}

impl<'db> LibraryReader<'db> {
    fn libraries(&mut self) -> Libraries<'db> {
        let (db, project) = (self.db, self.project);
        let mut order: Vec<Option<Name>> = Vec::new();
        let mut declared: FxHashMap<Option<Name>, Vec<Decl<'db>>> = FxHashMap::default();
        for &decl in &names_of(db, project).all {
            if matches!(decl.kind(db), Kind::Codel | Kind::Component | Kind::Deployment) {
                let library = decl.library(db);
                let all = declared.entry(library.clone()).or_default();
                if all.is_empty() {
                    order.push(library.clone());
                }
                all.push(decl);
            }
        }
        // The package of declarations outside libraries gets a name that no library has.
        order.sort_by_key(Option::is_none);
        let mut names = CppNames::of_packages();
        catalogue_of(db, project.workspace(db)).keys().for_each(|package| {
            names.take(package);
            names.take(&format!("rtt_{package}"));
        });
        OTHER_PACKAGES.iter().for_each(|package| names.take(package));
        let mut all: Vec<Library<'db>> = Vec::new();
        for library in &order {
            let name = library.as_ref().map_or_else(|| root_name(db, project), ToString::to_string);
            let package = names.declare(&file_name(&name));
            let mut inner = CppNames::of_namespace();
            inner.take(&package);
            external_types(db, project.workspace(db)).values().for_each(|it| inner.take_type(&it.cpp));
            let mut of_kind = |kind: Kind| -> Vec<(Decl<'db>, String)> {
                let all = declared.get(library).into_iter().flatten().filter(|decl| decl.kind(db) == kind);
                all.map(|&decl| (decl, inner.declare(&file_name(decl.name(db))))).collect()
            };
            let (codels, components) = (of_kind(Kind::Codel), of_kind(Kind::Component));
            let deployments = of_kind(Kind::Deployment).into_iter().map(|(decl, _)| decl).collect();
            let (calls, runs) = (BTreeSet::new(), BTreeSet::new());
            all.push(Library { package, codels, components, deployments, calls, runs });
        }
        let place = |all: &[Library<'db>]| -> FxHashMap<Decl<'db>, (usize, String)> {
            let all = all.iter().enumerate();
            let named =
                all.flat_map(|(index, it)| it.codels.iter().chain(&it.components).map(move |it| (index, it)));
            named.map(|(index, (decl, name))| (*decl, (index, name.clone()))).collect()
        };
        let places = place(&all);
        for (index, library) in all.iter_mut().enumerate() {
            let number = |decl: Decl<'db>| Some(places.get(&decl)?.0).filter(|other| *other != index);
            for &(component, _) in &library.components {
                library.calls.extend(self.codels_of(component).into_iter().filter_map(number));
            }
            for &deployment in &library.deployments {
                library.runs.extend(self.components_of(deployment).into_iter().filter_map(number));
            }
        }
        self.check_files(&all);
        all.iter().for_each(|library| self.check_types(library));
        let all = self.ordered(all);
        Libraries { places: place(&all), all }
    }

    fn codels_of(&self, component: Decl<'db>) -> Vec<Decl<'db>> {
        let core = core_of(self.db, self.project, component);
        let Some(core) = core else { return Vec::new() };
        let codel = |callee| if let Callee::Codel(codel) = callee { Some(codel) } else { None };
        inference_of_core(self.db, self.project, core).callees().filter_map(codel).collect()
    }

    fn components_of(&self, of: Decl<'db>) -> Vec<Decl<'db>> {
        let flat = deployed(self.db, self.project, of).map(|(flat, _)| &flat.instances);
        flat.into_iter().flatten().filter_map(|instance| instance.component).collect()
    }

    /// Reports names that are distinct in C++, but not on a file system that ignores case.
    fn check_files(&mut self, all: &[Library<'db>]) {
        let db = self.db;
        let first = |library: &Library<'db>| {
            let named = library.codels.iter().chain(&library.components).map(|(decl, _)| *decl);
            named.chain(library.deployments.iter().copied()).next()
        };
        let packages =
            all.iter().filter_map(|it| Some((it.package.clone(), it.package.as_str(), first(it)?)));
        self.check_case(Artifact::Package, packages);
        for library in all {
            // Sources have the names in C++, exported analyses those of the model.
            let in_cpp = |(decl, name): &(Decl<'db>, String)| (name.clone(), decl.name(db).as_str(), *decl);
            let in_model = |decl: Decl<'db>| (file_name(decl.name(db)), decl.name(db).as_str(), decl);
            self.check_case(Artifact::Codel, library.codels.iter().map(in_cpp));
            self.check_case(Artifact::Component, library.components.iter().map(in_cpp));
            let components = library.components.iter().map(|(decl, _)| in_model(*decl));
            self.check_case(Artifact::Component, components);
            self.check_case(Artifact::Deployment, library.deployments.iter().copied().map(in_model));
        }
    }

    /// Reports names that differ in case only; `named` has each file name, the name in the model, and its location.
    fn check_case<'n>(&mut self, of: Artifact, named: impl Iterator<Item = (String, &'n str, Decl<'db>)>) {
        let mut seen: FxHashMap<String, &str> = FxHashMap::default();
        for (file, name, decl) in named {
            let file = file.to_ascii_lowercase();
            let Some(first) = seen.get(&file) else {
                seen.insert(file, name);
                continue;
            };
            let (first, second) = ((*first).to_owned(), name.to_owned());
            self.report(ProblemKind::SamePath { of, first, second }, Location::name_of(decl));
        }
    }

    fn check_types(&mut self, library: &Library<'db>) {
        let (db, project) = (self.db, self.project);
        db.unwind_if_revision_cancelled();
        for &(codel, _) in &library.codels {
            types_of_codel(db, codel).into_iter().for_each(|(of, ty)| self.check_type(of, ty));
        }
        for &(component, _) in &library.components {
            let types = types_of_component(db, project, component);
            types.into_iter().for_each(|(of, ty)| self.check_type(of, ty));
            if component_is_broken(db, component) {
                self.report(ProblemKind::IncompleteComponent, Location::name_of(component));
            }
        }
    }

    fn check_type(&mut self, of: Decl<'db>, ty: &TypeRef) {
        let found = type_of(self.db, self.project, of, Some(ty));
        if cpp_type(self.db, self.project.workspace(self.db), &found).is_some() {
            return;
        }
        let kind = match found {
            Type::External(name) => ProblemKind::UnmappedType(name),
            _ => ProblemKind::UnknownType(ty.to_string()),
        };
        self.report(kind, Location::Source(of, ty.id));
    }

    fn report(&mut self, kind: ProblemKind, at: Location<'db>) {
        let problem = GenerationProblem { kind, at };
        if self.reported.insert(problem.clone()) {
            self.problems.push(problem);
        }
    }

    /// Sorts libraries so that called ones come first, and reports cyclic calls, which no build system can build.
    fn ordered(&mut self, all: Vec<Library<'db>>) -> Vec<Library<'db>> {
        let calls: Vec<BTreeSet<usize>> = all.iter().map(|library| library.calls.clone()).collect();
        let numbers = topological_order(&calls);
        let mut positions = vec![0; all.len()];
        for (position, &index) in numbers.iter().enumerate() {
            positions[index] = position;
        }
        for &index in &numbers {
            self.report_cycle(&all, index, &positions);
        }
        let renumbered = |library: &Library<'db>| {
            let [calls, runs] =
                [&library.calls, &library.runs].map(|all| all.iter().map(|&old| positions[old]).collect());
            Library { calls, runs, ..library.clone() }
        };
        numbers.iter().filter_map(|&index| all.get(index)).map(renumbered).collect()
    }

    /// Reports a library that comes before others that it calls.
    fn report_cycle(&mut self, all: &[Library<'db>], index: usize, positions: &[usize]) {
        let Some(library) = all.get(index) else { return };
        let later = library.calls.iter().filter(|&&other| positions[other] > positions[index]);
        let others: Vec<String> = later.filter_map(|&it| Some(all.get(it)?.package.clone())).collect();
        if let Some((component, _)) = library.components.first().filter(|_| !others.is_empty()) {
            let kind = ProblemKind::CyclicPackages { package: library.package.clone(), others };
            self.report(kind, Location::name_of(*component));
        }
    }
}

/// The input for the files of a package.
#[derive(Clone, Copy)]
pub(crate) struct Model<'a, 'db> {
    pub(crate) db: &'db dyn ModelDb,
    pub(crate) project: Project<'db>,
    pub(crate) libraries: &'a Libraries<'db>,
    /// The library of the package.
    pub(crate) library: &'a Library<'db>,
}

impl<'db> Model<'_, 'db> {
    pub(crate) fn workspace(&self) -> Workspace {
        self.project.workspace(self.db)
    }

    pub(crate) fn config(&self) -> &'db Config {
        config_of(self.db, self.workspace())
    }

    pub(crate) fn type_of(&self, of: Decl<'db>, ty: Option<&TypeRef>) -> Type {
        type_of(self.db, self.project, of, ty)
    }

    /// Returns the directions and types of parameters that are declared in `of`.
    pub(crate) fn parameters(&self, of: Decl<'db>, all: &[Parameter]) -> Vec<(Direction, Type)> {
        all.iter().map(|it| (it.direction, self.type_of(of, it.ty.as_ref()))).collect()
    }

    /// Returns the features of a component in the order of the text, those of the shells that its shell extends first.
    pub(crate) fn features(&self, component: Decl<'db>) -> Vec<&'db FeatureOf<'db>> {
        let Some(shell) = shell_of(self.db, self.project, component) else { return Vec::new() };
        let features = features_of(self.db, self.project, shell);
        let mut all: Vec<&FeatureOf<'db>> = features.by_name.values().flatten().collect();
        let shells = features.shells.iter().rev().enumerate().rev();
        let numbers: FxHashMap<Decl<'db>, usize> = shells.map(|(number, shell)| (*shell, number)).collect();
        all.sort_by_cached_key(|it| (numbers.get(&it.shell), it.index));
        all
    }
}

/// Returns the libraries that a deployment needs, or all libraries of a project, in build order.
pub(crate) fn models<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Option<Decl<'db>>,
) -> Result<Vec<Model<'db, 'db>>, Vec<GenerationProblem<'db>>> {
    let found = problems(db, project);
    if !found.is_empty() {
        return Err(found);
    }
    let (libraries, _) = libraries(db, project);
    let needed = deployment.map(|deployment| libraries.needed_by(deployment));
    let is_needed = |index: &usize| needed.as_ref().is_none_or(|needed| needed.contains(index));
    let all = libraries.all.iter().enumerate().filter(|(index, _)| is_needed(index));
    Ok(all.map(|(_, library)| Model { db, project, libraries, library }).collect())
}

/// Returns the types that the declaration of a codel names, with the codel.
pub(crate) fn types_of_codel<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Vec<(Decl<'db>, &'db TypeRef)> {
    let data = codel(db, of).into_iter();
    data.flat_map(|it| types(of, &it.parameters, it.result.as_ref())).collect()
}

/// Returns the types that a component names in its shells and in its core, each with its declaration.
pub(crate) fn types_of_component<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
) -> Vec<(Decl<'db>, &'db TypeRef)> {
    let shell = shell_of(db, project, component).into_iter();
    let features = shell.flat_map(|shell| features_of(db, project, shell).by_name.values().flatten());
    let features = features.filter_map(|it| Some((it.shell, it.data(db)?)));
    let mut all: Vec<_> = features.flat_map(|(of, it)| types(of, &it.parameters, it.ty.as_ref())).collect();
    if let Some((of, data)) = core_of(db, project, component).and_then(|of| Some((of, core(db, of)?))) {
        all.extend(data.all_variables().flat_map(|it| types(of, &[], it.ty.as_ref())));
        all.extend(data.operations.iter().flat_map(|it| types(of, &it.parameters, it.result.as_ref())));
    }
    all
}

fn types<'db>(
    of: Decl<'db>,
    parameters: &'db [Parameter],
    ty: Option<&'db TypeRef>,
) -> impl Iterator<Item = (Decl<'db>, &'db TypeRef)> {
    parameters.iter().filter_map(|it| it.ty.as_ref()).chain(ty).map(move |ty| (of, ty))
}

/// Returns the numbers of `waits_for`, each after those that it waits for, otherwise ascending. In a cycle, the lowest number
/// comes first.
pub(crate) fn topological_order(waits_for: &[BTreeSet<usize>]) -> Vec<usize> {
    let mut waiting: Vec<Vec<usize>> = vec![Vec::new(); waits_for.len()];
    let mut open: Vec<usize> = vec![0; waits_for.len()];
    for (one, others) in waits_for.iter().enumerate() {
        for &other in others.iter().filter(|&&other| other != one) {
            let Some(waiting) = waiting.get_mut(other) else { continue };
            waiting.push(one);
            open[one] += 1;
        }
    }
    let mut left: BTreeSet<usize> = (0..waits_for.len()).collect();
    let mut ready: BTreeSet<usize> = left.iter().copied().filter(|&it| open[it] == 0).collect();
    let mut order = Vec::with_capacity(waits_for.len());
    while let Some(next) = ready.pop_first().or_else(|| left.first().copied()) {
        if !left.remove(&next) {
            continue;
        }
        order.push(next);
        for &one in &waiting[next] {
            open[one] -= 1;
            if open[one] == 0 {
                ready.insert(one);
            }
        }
    }
    order
}

fn component_is_broken(db: &dyn ModelDb, of: Decl<'_>) -> bool {
    component(db, of)
        .is_none_or(|data| data.completeness.is_incomplete() || data.shell.is_none() || data.core.is_none())
}

/// Returns the package name for declarations outside libraries: the name of the project's root.
fn root_name(db: &dyn ModelDb, project: Project<'_>) -> String {
    let stem = project.root(db).path(db).file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let name: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let name = name.trim_matches('_').to_ascii_lowercase();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("robot_{name}") }
}

#[cfg(test)]
mod tests {
    use mauve_hir::{Database, Workspace, projects};

    use super::topological_order;
    use crate::{Artifact, GeneratedPackage, ProblemKind, packages};

    /// The packages of a model; or what is wrong, and at which word.
    fn generated(model: &str) -> Result<Vec<GeneratedPackage>, Vec<(String, ProblemKind)>> {
        let db = Database::default();
        let texts = mauve_tests::fixture(model).into_iter().map(|(path, text)| (path.into(), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let [project] = projects(&db, workspace)[..] else { panic!("one project") };
        packages(&db, project, None).map_err(|problems| {
            let shown = problems.iter().map(|it| {
                let range = it.at.range(&db);
                let at = &it.at.file(&db).text(&db)[usize::from(range.start())..usize::from(range.end())];
                (at.to_owned(), it.kind.clone())
            });
            shown.collect()
        })
    }

    fn same_path(at: &str, of: Artifact, first: &str, second: &str) -> (String, ProblemKind) {
        let (first, second) = (first.to_owned(), second.to_owned());
        (at.to_owned(), ProblemKind::SamePath { of, first, second })
    }

    #[test]
    fn packages_have_names_that_no_message_package_has() {
        let model = "library tf { codel plan(): int } library action_msgs { codel plan(): int }";
        let names = |config: &str| -> Vec<String> {
            let found = generated(&format!("{model}\n//- /mauve.toml\n{config}")).unwrap();
            found.into_iter().map(|it| it.name).collect()
        };
        // ROS 1 has the first, and ROS 2 the second.
        assert_eq!(names(""), ["tf_", "action_msgs"]);
        assert_eq!(names("[ros2]"), ["tf", "action_msgs_"]);
    }

    #[test]
    fn names_that_differ_in_case_only_are_one_file_somewhere() {
        let model = "library l { codel plan(): int  codel Plan(): int  codel plan_(): int } library L { codel plan(): int }";
        assert_eq!(
            generated(model).unwrap_err(),
            [
                same_path("plan", Artifact::Package, "l", "L"),
                same_path("Plan", Artifact::Codel, "plan", "Plan")
            ]
        );
        let parts = "shell S { } core K(S) { update = { } } component Go(S, K) component GO(S, K) \
            architecture A { instance a: Go } deployment D { architecture A activity a { priority = 1 period = 10 } } \
            deployment d { architecture A activity a { priority = 1 period = 10 } }";
        assert_eq!(
            generated(parts).unwrap_err(),
            [
                same_path("GO", Artifact::Component, "Go", "GO"),
                same_path("d", Artifact::Deployment, "D", "d")
            ]
        );
        // One is called otherwise in C++, and the other in what was analysed.
        let parts = "shell S { } core K(S) { update = { } } component log(S, K) component Log(S, K)";
        assert_eq!(generated(parts).unwrap_err(), [same_path("Log", Artifact::Component, "log", "Log")]);
        let parts = "shell S { } core K(S) { update = { } } component log(S, K) component LOG_(S, K)";
        assert_eq!(generated(parts).unwrap_err(), [same_path("LOG_", Artifact::Component, "log", "LOG_")]);
        // Things of different kinds are in different places.
        let others = "library l { codel go(): int shell S { } core K(S) { update = { go(); } } component Go(S, K) } \
            library m { codel Go(): int }";
        assert_eq!(generated(others).map(|packages| packages.len()), Ok(2));
    }

    #[test]
    fn errors_are_sorted_by_their_files() {
        let of_each =
            |text: &str| (10..50).map(|number| text.replace('#', &number.to_string())).collect::<String>();
        let parts = of_each("//- /part#.mal\nlibrary part# { core K(S#) { update = { } } }\n");
        let root =
            of_each("include \"part#.mal\"\n") + "library shared { " + &of_each("shell S# { } ") + "}\n";
        let found = generated(&format!("{parts}//- /root.mal\n{root}")).unwrap_err();
        assert_eq!(found.iter().map(|(at, _)| at.as_str()).collect::<String>(), of_each("S#"));
    }

    #[test]
    fn numbers_stand_behind_those_that_they_wait_for() {
        let order = |count: usize, waits: &[(usize, usize)]| {
            let of = |one| waits.iter().filter(|it| it.0 == one).map(|it| it.1).collect();
            topological_order(&(0..count).map(of).collect::<Vec<_>>())
        };
        assert_eq!(order(3, &[]), [0, 1, 2]);
        assert_eq!(order(4, &[(0, 2), (2, 3)]), [1, 3, 2, 0]);
        assert_eq!(order(3, &[(0, 1), (1, 0), (2, 2)]), [2, 0, 1]);
    }

    #[test]
    fn no_library_has_the_folder_of_standalone_programs() {
        let packages = generated("library standalone { codel look(): int }").unwrap();
        assert_eq!(packages[0].name, "standalone_");
    }

    #[test]
    fn no_file_has_the_name_of_a_device() {
        let model = "library con { codel aux(): int shell S { } core K(S) { update = { aux(); } } component nul(S, K) } \
            library m { use con architecture A { instance i: nul } \
            deployment prn { architecture A activity i { priority = 1 period = 10 } } }";
        let packages = generated(model).unwrap();
        let files: Vec<(String, &str)> = packages
            .iter()
            .flat_map(|package| package.files.iter().map(move |file| (package.name.as_str(), file)))
            .map(|(package, file)| (format!("{package}/{}", file.path), file.text.as_str()))
            .collect();
        for (path, _) in &files {
            let devices = ["con", "prn", "aux", "nul"];
            assert!(
                !path.split('/').any(|part| devices.contains(&part.split('.').next().unwrap())),
                "{path}"
            );
        }
        let text = |path: &str| files.iter().find(|(it, _)| it == path).unwrap_or_else(|| panic!("{path}")).1;
        for path in ["con_/src/codels/aux_.cpp", "con_/nul_/nul_-component.cpp", "con_/models/nul_.psm.json"]
        {
            text(path);
        }
        for path in ["m/models/prn_.json", "con_/include/con_/con_-codels.hpp"] {
            text(path);
        }
        assert!(text("m/launch/prn_.launch").contains("/scripts/prn_.lua"));
        assert!(text("m/scripts/prn_.lua").contains("\"con_::nul_\""));
        assert!(text("con_/CMakeLists.txt").contains("src/codels/aux_.cpp"));
    }
}
