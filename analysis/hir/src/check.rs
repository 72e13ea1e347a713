//! The facts of a declaration and of a project, without response times; and the errors that prevent its analysis.

use crate::db::{File, Workspace};
use crate::project::{Project, config_of, is_model, project_files, projects, roots_exist};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::behaviour_of;
use crate::fact::{Defined, Fact, FactKind, Refusal, repeated, unresolved_type};
use crate::features::{features_of, is_core_for, shell_of};
use crate::flat;
use crate::flow::flow_facts;
use crate::infer::inference_of_core;
use crate::item_tree::{FeatureKind, Kind, Name, TypeRef};
use crate::names::names_of;
use crate::size::too_large;
use crate::source::{Decl, Location, component, shell};
use crate::{declared, settings, wiring};

/// Returns the facts about the declarations of a project together: duplicates, and the size limit.
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
    let mut found = Vec::new();
    match decl.kind(db) {
        Kind::Core => {
            found.extend(behaviour_of(db, project, decl).facts.iter().cloned());
            found.extend(inference_of_core(db, project, decl).facts().cloned());
            found.extend(flow_facts(db, project, decl).iter().cloned());
        }
        Kind::Architecture => {
            found.extend(flat::check_architecture(db, project, decl));
            found.extend(wiring::check_architecture(db, project, decl));
            found.extend(settings::check_settings(db, project, decl));
        }
        Kind::Deployment => {
            found.extend(flat::check_settings(db, project, decl));
            found.extend(settings::check_settings(db, project, decl));
            found.extend(wiring::check_deployment(db, project, decl));
        }
        Kind::Component => found.extend(component_facts(db, project, decl)),
        Kind::Shell => found.extend(shell_facts(db, project, decl)),
        Kind::Use => found.extend(declared::check_use(db, project, decl)),
        Kind::Codel => {}
    }
    found.extend(declared::check(db, project, decl));
    found.into_boxed_slice()
}

/// Returns the errors in a declaration as refusals: its dependents are not analysed, whatever severity `mauve.toml` sets. For
/// a deployment, the errors exclude those of its activities.
#[salsa::tracked(returns(ref))]
pub fn errors_in<'db>(db: &'db dyn ModelDb, project: Project<'db>, decl: Decl<'db>) -> Vec<Refusal<'db>> {
    let refusals = |found: &[Fact<'db>]| {
        let errors = found.iter().filter(|fact| fact.is_error());
        errors.map(|fact| Refusal::of_fact(project, fact)).collect()
    };
    if decl.kind(db) != Kind::Core {
        return refusals(declaration_facts(db, project, decl));
    }
    // Only checks that report errors: the others depend on other declarations.
    let behaviour = behaviour_of(db, project, decl).facts.iter();
    let inference = inference_of_core(db, project, decl);
    let all: Vec<Fact<'db>> =
        behaviour.chain(inference.facts()).cloned().chain(declared::errors(db, project, decl)).collect();
    refusals(&all)
}

fn component_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>, decl: Decl<'db>) -> Vec<Fact<'db>> {
    let Some(data) = component(db, decl) else { return Vec::new() };
    let names = names_of(db, project);
    let resolve = |kind, ty: &Option<TypeRef>| names.resolve_type(db, decl, kind, ty.as_ref());
    match (resolve(Kind::Shell, &data.shell), resolve(Kind::Core, &data.core)) {
        (Ok(shell), Ok(core)) if is_core_for(db, project, core, shell) => {
            let at = data.core.as_ref().map(|it| Location::Source(decl, it.id));
            at.map_or_else(Vec::new, |at| undefined_operations(db, project, at, shell, core))
        }
        (Ok(shell), Ok(core)) => {
            let at = data.core.as_ref().map_or(Location::name_of(decl), |it| Location::Source(decl, it.id));
            vec![Fact::new(at, FactKind::WrongShell { core, shell })]
        }
        (Err(_), Err(_))
            if resolve(Kind::Core, &data.shell).is_ok() && resolve(Kind::Shell, &data.core).is_ok() =>
        {
            let swapped = |core: &TypeRef| {
                Fact::new(Location::Source(decl, core.id), FactKind::CoreBeforeShell { core: core.clone() })
            };
            data.shell.iter().map(swapped).collect()
        }
        (shell, core) => {
            let unresolved = [(Kind::Shell, &data.shell, shell), (Kind::Core, &data.core, core)];
            let fact = |(kind, ty, why): (_, &Option<TypeRef>, Result<_, _>)| {
                unresolved_type(decl, kind, ty.as_ref(), &why.err()?)
            };
            unresolved.into_iter().filter(|_| data.completeness.is_complete()).filter_map(fact).collect()
        }
    }
}

/// Returns the facts for operations that the shell of a component provides and its core does not define. The check of the
/// core reports the operations of the core's own shell.
fn undefined_operations<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    at: Location<'db>,
    shell: Decl<'db>,
    core: Decl<'db>,
) -> Vec<Fact<'db>> {
    let own = shell_of(db, project, core).filter(|own| *own != shell);
    let Some(own) = own else { return Vec::new() };
    let of_core = features_of(db, project, own);
    let others = features_of(db, project, shell).by_name.iter();
    let others = others.filter(|(name, _)| of_core.get(name).is_none());
    let provided = others.filter_map(|(name, found)| {
        let declared = found.first().filter(|it| it.kind == FeatureKind::Provided)?.clone();
        Some(Fact::new(at.clone(), FactKind::UndefinedOperation { core, name: name.clone(), declared }))
    });
    provided.collect()
}

fn shell_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>, decl: Decl<'db>) -> Vec<Fact<'db>> {
    let Some(data) = shell(db, decl) else { return Vec::new() };
    let mut found = Vec::new();
    for base in &data.bases {
        if let Err(why) = names_of(db, project).resolve_type(db, decl, Kind::Shell, Some(base)) {
            found.extend(unresolved_type(decl, Kind::Shell, Some(base), &why));
        }
    }
    if features_of(db, project, decl).cycle {
        let shell = decl.name(db).clone();
        found.push(Fact::new(Location::name_of(decl), FactKind::InheritanceCycle { shell }));
    }
    found.extend(repeated(decl, data.features.iter().map(|feature| (&feature.name, Defined::Feature))));
    found.extend(clashes(db, project, decl));
    found.extend(settings::check_shell(db, project, decl));
    found
}

/// Returns the facts for features of the same name that a shell inherits from different shells.
fn clashes<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Fact<'db>> {
    let mut found = Vec::new();
    for (name, features) in &features_of(db, project, of).by_name {
        let Some(first) = features.first() else { continue };
        let Some(other) = features.iter().find(|other| other.shell != first.shell) else { continue };
        // A feature of the shell itself is the one to rename.
        let at = if first.shell == of { first.name(db) } else { Some(Location::name_of(of)) };
        if let (Some(at), Some(other)) = (at, other.name(db)) {
            let (what, name) = (Defined::Feature, name.clone());
            found.push(Fact::new(at, FactKind::DuplicateDefinition { what, name, first: other }));
        }
    }
    found
}

/// Returns the facts for declarations with the same library, kind and name, in all files.
fn duplicates<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<Fact<'db>> {
    let mut first: FxHashMap<(&Option<Name>, Kind, &Name), Decl<'db>> = FxHashMap::default();
    let mut found = Vec::new();
    for &decl in names_of(db, project).all.iter().filter(|decl| !decl.name(db).is_empty()) {
        let kind = decl.kind(db);
        let first = *first.entry((decl.library(db), kind, decl.name(db))).or_insert(decl);
        if first != decl {
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
