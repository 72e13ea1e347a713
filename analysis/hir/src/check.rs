//! The facts of a declaration and of a project, without response times; and the errors that prevent its analysis.

use crate::db::{File, Workspace};
use crate::project::{Project, config_of, is_model, project_files, projects, roots_exist};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::behaviour_of;
use crate::declared::DeclaredIn;
use crate::fact::{Checker, Defined, Fact, FactKind, ModelRefusal, repeated};
use crate::features::{features_of, is_core_for, shell_of};
use crate::flow::flow_facts;
use crate::infer::inference_of_core;
use crate::item_tree::{FeatureKind, Kind, Name};
use crate::names::names_of;
use crate::ros2::check::facts_of;
use crate::size::too_large;
use crate::source::{Decl, Location, component, shell};

/// Returns the facts about the declarations of a project together: duplicates, and the size limit.
#[salsa::tracked(returns(ref))]
pub fn project_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<Fact<'db>> {
    let mut found = duplicates(db, project);
    found.extend(
        too_large(db, project).map(|with| Fact::new(Location::name_of(with), FactKind::TooLarge { with })),
    );
    found
}

/// Returns the facts of a declaration. For a deployment, they exclude the facts of its activities, which the analysis
/// reports.
#[salsa::tracked(returns(ref))]
pub fn declaration_facts<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
) -> Box<[Fact<'db>]> {
    let mut checker = Checker { db, project, of: decl, found: Vec::new() };
    match decl.kind(db) {
        Kind::Core => {
            checker.found.extend(behaviour_of(db, project, decl).facts.iter().cloned());
            checker.found.extend(inference_of_core(db, project, decl).facts().cloned());
            checker.found.extend(flow_facts(db, project, decl).iter().cloned());
        }
        Kind::Architecture => {
            checker.names_in_architecture();
            checker.connections();
            checker.settings();
        }
        Kind::Deployment => {
            checker.names_in_deployment();
            checker.settings();
            checker.unset_and_unconnected();
            // What is written in `mauve.toml` is reported there: see `configured`.
            let facts = facts_of(db, project, decl).iter();
            checker.found.extend(facts.filter(|it| !matches!(it.at, Location::Range(..))).cloned());
        }
        Kind::Component => checker.component(),
        Kind::Shell => checker.shell(),
        Kind::Use => checker.package(),
        Kind::Codel => {}
    }
    // A deployment has no names or types of its own; a field of an activity does not change its facts.
    if decl.kind(db) != Kind::Deployment {
        checker.names_and_types();
    }
    checker.found.into_boxed_slice()
}

/// Returns the errors in a declaration as refusals: its dependents are not analysed, whatever severity `mauve.toml` sets. For
/// a deployment, the errors exclude those of its activities.
#[salsa::tracked(returns(ref))]
pub fn errors_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    decl: Decl<'db>,
) -> Vec<ModelRefusal<'db>> {
    let refusals = |found: &[Fact<'db>]| {
        let errors = found.iter().filter(|fact| fact.is_error());
        errors.map(|fact| ModelRefusal::of_fact(project, fact)).collect()
    };
    if decl.kind(db) != Kind::Core {
        return refusals(declaration_facts(db, project, decl));
    }
    // Only checks that report errors: the others depend on other declarations.
    let mut checker = Checker { db, project, of: decl, found: behaviour_of(db, project, decl).facts.clone() };
    checker.found.extend(inference_of_core(db, project, decl).facts().cloned());
    checker.void_values_and_parameters(&DeclaredIn::of(db, decl));
    refusals(&checker.found)
}

impl<'db> Checker<'db> {
    fn component(&mut self) {
        let (db, project) = (self.db, self.project);
        let Some(data) = component(db, self.of) else { return };
        let [own_shell, own_core] = [data.shell.as_ref(), data.core.as_ref()];
        let at = own_core.map_or(Location::name_of(self.of), |it| self.at(it.id));
        match (self.resolve(Kind::Shell, own_shell), self.resolve(Kind::Core, own_core)) {
            (Ok(shell), Ok(core)) if is_core_for(db, project, core, shell) => {
                self.undefined_operations(&at, shell, core);
            }
            (Ok(shell), Ok(core)) => self.report_at(at, FactKind::WrongShell { core, shell }),
            (Err(_), Err(_))
                if self.resolve(Kind::Core, own_shell).is_ok()
                    && self.resolve(Kind::Shell, own_core).is_ok() =>
            {
                if let Some(core) = own_shell {
                    self.report(core.id, FactKind::CoreBeforeShell { core: core.clone() });
                }
            }
            _ if data.completeness.is_complete() => {
                self.resolve_or_report(Kind::Shell, own_shell);
                self.resolve_or_report(Kind::Core, own_core);
            }
            _ => {}
        }
    }

    /// Reports the operations that the shell of a component provides and its core does not define. The check of the core
    /// reports the operations of the core's own shell.
    fn undefined_operations(&mut self, at: &Location<'db>, shell: Decl<'db>, core: Decl<'db>) {
        let (db, project) = (self.db, self.project);
        let Some(own) = shell_of(db, project, core).filter(|own| *own != shell) else { return };
        let of_core = features_of(db, project, own);
        for (name, found) in &features_of(db, project, shell).by_name {
            let declared = found.first().filter(|it| it.kind == FeatureKind::Provided);
            if let Some(declared) = declared.filter(|_| of_core.get(name).is_none()) {
                let (name, declared) = (name.clone(), *declared);
                self.report_at(at.clone(), FactKind::UndefinedOperation { core, name, declared });
            }
        }
    }

    fn shell(&mut self) {
        let Some(data) = shell(self.db, self.of) else { return };
        for base in &data.bases {
            self.resolve_or_report(Kind::Shell, Some(base));
        }
        if features_of(self.db, self.project, self.of).cycle {
            let shell = self.of.name(self.db).clone();
            self.report_at(Location::name_of(self.of), FactKind::InheritanceCycle { shell });
        }
        let features = data.features.iter().map(|feature| (&feature.name, Defined::Feature));
        self.found.extend(repeated(self.of, features));
        self.clashes();
        self.values_of_shell();
    }

    /// Reports the features of the same name that a shell inherits from different shells.
    fn clashes(&mut self) {
        for (name, features) in &features_of(self.db, self.project, self.of).by_name {
            let Some(first) = features.first() else { continue };
            let Some(other) = features.iter().find(|other| other.shell != first.shell) else { continue };
            // A feature of the shell itself is the one to rename.
            let own = Some(Location::name_of(self.of));
            let at = if first.shell == self.of { first.name(self.db) } else { own };
            if let (Some(at), Some(first)) = (at, other.name(self.db)) {
                let (what, name) = (Defined::Feature, name.clone());
                self.report_at(at, FactKind::DuplicateDefinition { what, name, first });
            }
        }
    }
}

/// Returns the facts for declarations with the same library, kind and name, in all files.
fn duplicates<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<Fact<'db>> {
    let mut first: FxHashMap<(&Option<Name>, Kind, &Name), Decl<'db>> = FxHashMap::default();
    let mut found = Vec::new();
    let names = names_of(db, project);
    for &decl in names.all.iter().filter(|decl| !decl.name(db).is_empty()) {
        let kind = decl.kind(db);
        let first = *first.entry((decl.library(db), kind, decl.name(db))).or_insert(decl);
        // If the name of either is unknown, they may have different names.
        if first != decl && !names.has_unnamed(decl.library(db).as_ref(), kind) {
            let (what, name) = (Defined::Declaration(kind), decl.name(db).clone());
            let kind = FactKind::DuplicateDefinition { what, name, first: Location::name_of(first) };
            found.push(Fact::new(Location::name_of(decl), kind));
        }
    }
    found
}

/// Returns the models in a workspace's folder that no root of `mauve.toml` includes, and that are therefore not checked.
pub fn not_checked(db: &dyn ModelDb, workspace: Workspace) -> Vec<File> {
    let projects = projects(db, workspace);
    // A missing include or root, which is reported, may include them.
    let has_missing_files = !roots_exist(db, workspace)
        || projects.iter().any(|&project| names_of(db, project).completeness.is_incomplete());
    if config_of(db, workspace).roots.is_empty() || has_missing_files || !workspace.only(db).is_empty() {
        return Vec::new();
    }
    let checked: FxHashSet<File> =
        projects.iter().flat_map(|&project| project_files(db, project)).copied().collect();
    let files = workspace.files(db).iter();
    let models = files.filter(|(path, _)| is_model(path) && path.starts_with(workspace.folder(db)));
    models.map(|(_, &file)| file).filter(|file| !checked.contains(file)).collect()
}
