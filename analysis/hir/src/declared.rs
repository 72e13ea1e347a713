//! Checks of declared names and types: reserved names, unknown and invalid types, unused declarations.

use std::borrow::Cow;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{CoreScope, core_scope};
use crate::completeness::Completeness;
use crate::fact::{Checker, Defined, Fact, FactKind, Reserved, repeated};
use crate::features::{FeatureOf, features_of, shell_of};
use crate::flat::{flat_of, target_of};
use crate::infer::uses_of;
use crate::item_tree::{Data, Kind, Name, NameRef, SignatureOf, SourceId, TypeRef, Variable, types_of};
use crate::messages::used_packages;
use crate::names::names_of;
use crate::project::{Project, file_groups, files_in_group};
use crate::settings::names_in_values;
use crate::source::{Decl, Location, data, declarations, shell};
use crate::structure::{Structure, local_variables_of, structure_of};
use crate::types::{self, Type};

impl<'db> Checker<'db> {
    /// Reports values of type `void` and repeated parameters: the errors in the types and names of a declaration.
    pub(crate) fn void_values_and_parameters(&mut self, declared: &DeclaredIn<'db>) {
        let library = self.of.library(self.db).as_ref();
        for (ty, may_be_void) in declared.types() {
            if !may_be_void && types::resolved(self.db, self.project, library, &ty.path) == Some(Type::Void) {
                self.report(ty.id, FactKind::VoidValue);
            }
        }
        for SignatureOf { parameters, .. } in declared.signatures() {
            self.found.extend(repeated(self.of, parameters.iter().map(|it| (&it.name, Defined::Parameter))));
        }
    }

    /// Checks the names and types of a declaration.
    pub(crate) fn names_and_types(&mut self) {
        let (db, project, of) = (self.db, self.project, self.of);
        let declared = DeclaredIn::of(db, of);
        self.void_values_and_parameters(&declared);
        for ty in has_types(db, of).then(|| unknown_types(db, project, of)).into_iter().flatten() {
            let first = first_unknown(db, project).get(&(of.library(db).clone(), ty.path.clone()));
            if first == Some(&of) && self.is_mistake(ty) {
                self.report(ty.id, FactKind::UnknownType { of, ty: ty.clone() });
            }
        }
        let own = NameRef { name: of.name(db).clone(), id: SourceId(0) };
        let own = matches!(of.kind(db), Kind::Codel | Kind::Component).then_some((&own, None));
        for (NameRef { name, id }, reserved) in own.into_iter().chain(declared.names()) {
            let reserved = reserved.filter(|(names, _)| names.contains(&name.as_str())).map(|(_, what)| what);
            if let Some(is) = reserved.or_else(|| is_cpp(name).then_some(Reserved::Cpp)) {
                self.report(*id, FactKind::ReservedName { name: name.clone(), is });
            }
        }
        if let DeclaredIn::Core(core) = &declared {
            core.structure.colon.into_iter().for_each(|colon| self.report(colon, FactKind::HeaderColon));
            for variable in core.variables() {
                if let Some((token, white)) = variable.continued {
                    let name = variable.name.name.clone();
                    self.report(token, FactKind::ContinuedLine { name, white });
                }
            }
        }
    }

    /// Returns whether an unresolved type is an error of its own: not if a missing file may declare it, or if its name is
    /// incomplete.
    fn is_mistake(&self, ty: &TypeRef) -> bool {
        let (db, project) = (self.db, self.project);
        if names_of(db, project).completeness.is_incomplete() || ty.path.iter().any(|id| id.is_empty()) {
            return false;
        }
        match ty.path.as_slice() {
            [] => false,
            // Another error may hide a `use`.
            [_] if names_of(db, project).may_miss_uses(self.of.library(db)) => false,
            // An unknown package, which is reported, may declare it.
            [_] => {
                let mut used = used_packages(db, project).get(self.of.library(db)).into_iter().flatten();
                used.all(|name| types::is_known_package(db, project, name))
            }
            _ => true,
        }
    }

    /// Checks the package of a `use`.
    pub(crate) fn package(&mut self) {
        let (db, project, name) = (self.db, self.project, self.of.name(self.db));
        if !types::is_known_package(db, project, name) && names_of(db, project).completeness.is_complete() {
            self.report_at(Location::name_of(self.of), FactKind::UnknownPackage { name: name.clone() });
        }
    }
}

/// Names that generated code uses, and their purpose.
type ReservedNames = Option<(&'static [&'static str], Reserved)>;

const PORTS: ReservedNames = Some((&["state", "tick"], Reserved::GeneratedPort));
const PROPERTIES: ReservedNames = Some((
    &["period", "priority", "deadline", "affinity", "shell", "core", "statemachine"],
    Reserved::GeneratedProperty,
));

/// Returns whether the name is a keyword of C++.
fn is_cpp(name: &str) -> bool {
    #[rustfmt::skip]
    const WORDS: &[&str] = &[
        "alignas", "alignof", "and", "and_eq", "asm", "auto", "bitand", "bitor", "bool", "break", "case", "catch",
        "char", "char16_t", "char32_t", "class", "compl", "const", "const_cast", "constexpr", "continue", "decltype",
        "default", "delete", "do", "double", "dynamic_cast", "else", "enum", "explicit", "export", "extern", "false",
        "float", "for", "friend", "goto", "if", "inline", "int", "long", "mutable", "namespace", "new", "noexcept",
        "not", "not_eq", "nullptr", "operator", "or", "or_eq", "private", "protected", "public", "register",
        "reinterpret_cast", "return", "short", "signed", "sizeof", "static", "static_assert", "static_cast", "struct",
        "switch", "template", "this", "thread_local", "throw", "true", "try", "typedef", "typeid", "typename",
        "union", "unsigned", "using", "virtual", "void", "volatile", "wchar_t", "while", "xor", "xor_eq",
    ];
    WORDS.binary_search(&name).is_ok()
}

/// What the checks of names and types read of a declaration: for a core, not its programs.
pub(crate) enum DeclaredIn<'db> {
    Core(DeclaredInCore<'db>),
    Other(&'db Data),
    Nothing,
}

pub(crate) struct DeclaredInCore<'db> {
    structure: &'db Structure,
    scope: &'db CoreScope,
    /// The variables that its programs declare, by group of bodies.
    local: Vec<Cow<'db, Arc<[Variable]>>>,
}

impl DeclaredInCore<'_> {
    fn variables(&self) -> impl Iterator<Item = &Variable> {
        self.structure.shared_variables().chain(self.local.iter().flat_map(|group| group.iter()))
    }
}

impl<'db> DeclaredIn<'db> {
    pub(crate) fn of(db: &'db dyn ModelDb, of: Decl<'db>) -> DeclaredIn<'db> {
        if of.kind(db) != Kind::Core {
            return data(db, of).as_deref().map_or(DeclaredIn::Nothing, DeclaredIn::Other);
        }
        match (structure_of(db, of), core_scope(db, of)) {
            (Some(structure), Some(scope)) => {
                let local = local_variables_of(db, of);
                DeclaredIn::Core(DeclaredInCore { structure, scope, local })
            }
            _ => DeclaredIn::Nothing,
        }
    }

    fn signatures(&self) -> Vec<SignatureOf<'_>> {
        match self {
            DeclaredIn::Core(core) => {
                let heads = core.scope.operations.iter();
                heads.map(|it| SignatureOf::of(&it.parameters, it.result.as_ref())).collect()
            }
            DeclaredIn::Other(data) => data.signatures(),
            DeclaredIn::Nothing => Vec::new(),
        }
    }

    /// Returns the types of values, as [`Data::types`].
    fn types(&self) -> Vec<(&TypeRef, bool)> {
        let variables = match self {
            DeclaredIn::Core(core) => core.variables().collect(),
            _ => Vec::new(),
        };
        types_of(self.signatures(), variables.into_iter()).collect()
    }

    /// Returns the names that generated C++ contains, with the reserved names for their kind.
    fn names(&self) -> Vec<(&NameRef, ReservedNames)> {
        let parameters = self.signatures().into_iter().flat_map(|it| it.parameters);
        let mut names: Vec<(&NameRef, ReservedNames)> = parameters.map(|it| (&it.name, None)).collect();
        match self {
            DeclaredIn::Other(Data::Shell(shell)) => {
                names.extend(shell.features.iter().map(|feature| match feature.kind {
                    kind if kind.is_port() => (&feature.name, PORTS),
                    kind if kind.is_value() => (&feature.name, PROPERTIES),
                    _ => (&feature.name, None),
                }));
            }
            DeclaredIn::Core(core) => {
                names.extend(core.variables().map(|it| (&it.name, None)));
                names.extend(core.structure.handlers.iter().map(|handler| (&handler.name, None)));
                names.extend(core.structure.states().map(|state| (&state.name, None)));
            }
            _ => {}
        }
        names
    }
}

fn has_types<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> bool {
    matches!(of.kind(db), Kind::Codel | Kind::Shell | Kind::Core)
}

/// Returns the unresolved types in a declaration, each at its first occurrence.
#[salsa::tracked(returns(ref))]
fn unknown_types<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<TypeRef> {
    let declared = DeclaredIn::of(db, of);
    let library = of.library(db).as_ref();
    let mut types: Vec<&TypeRef> = declared.types().into_iter().map(|(ty, _)| ty).collect();
    types.sort_by_key(|ty| ty.id);
    let mut seen = FxHashSet::default();
    types.retain(|ty| seen.insert(&ty.path));
    types.retain(|ty| types::resolved(db, project, library, &ty.path).is_none());
    types.into_iter().cloned().collect()
}

/// Returns, for each unresolved type, the first declaration of the project that names it: a missing `use` is reported once.
#[salsa::tracked(returns(ref))]
fn first_unknown<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> FxHashMap<(Option<Name>, Vec<Name>), Decl<'db>> {
    let mut first = FxHashMap::default();
    for &decl in names_of(db, project).all.iter().filter(|&&decl| has_types(db, decl)) {
        for ty in unknown_types(db, project, decl) {
            first.entry((decl.library(db).clone(), ty.path.clone())).or_insert(decl);
        }
    }
    first
}

/// The definitions that the programs and deployments of a project use.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
struct Usage<'db> {
    codels: FxHashSet<Decl<'db>>,
    features: FxHashSet<FeatureOf<'db>>,
    /// The shells that a core implements.
    with_core: FxHashSet<Decl<'db>>,
    /// The declarations that a deployment uses, directly or indirectly; `None` without deployments.
    deployed: Option<FxHashSet<Decl<'db>>>,
    /// Whether all uses are known.
    completeness: Completeness,
}

/// Returns the definitions that a project uses.
#[salsa::tracked(returns(ref))]
fn usage_of<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Usage<'db> {
    let names = names_of(db, project);
    let are_known = names.incomplete_file.is_none() && !names.may_miss_names();
    let mut usage = Usage { completeness: Completeness::of(are_known), ..Usage::default() };
    for group in file_groups(db, project) {
        let used = usage_in_group(db, project, group);
        usage.codels.extend(&used.codels);
        usage.features.extend(&used.features);
        usage.with_core.extend(&used.with_core);
        usage.completeness &= used.completeness;
    }
    for of in names.of_kind(db, Kind::Deployment) {
        let deployed = usage.deployed.get_or_insert_default();
        let Some(target) = target_of(db, project, of) else {
            usage.completeness = Completeness::Incomplete;
            continue;
        };
        let flat = flat_of(db, project, target);
        usage.completeness &= Completeness::of(flat.refusals.is_empty());
        deployed.extend(&flat.architectures);
        for instance in &flat.instances {
            deployed.extend(instance.component);
            let implementation = instance.implementation(db, project);
            let core = implementation.and_then(|it| it.core);
            let features = instance.features(db, project);
            usage.completeness &= Completeness::of(core.is_some() && features.is_some());
            deployed.extend(core);
            deployed.extend(features.into_iter().flat_map(|features| &features.shells));
        }
    }
    usage
}

/// Returns the definitions that the cores and shells of a group of files use.
#[salsa::tracked(returns(ref))]
fn usage_in_group<'db>(db: &'db dyn ModelDb, project: Project<'db>, group: u32) -> Usage<'db> {
    let mut usage = Usage::default();
    for &of in files_in_group(db, project, group).iter().flat_map(|&file| &declarations(db, file).all) {
        match of.kind(db) {
            Kind::Core => {
                let uses = uses_of(db, project, of);
                usage.codels.extend(&uses.codels);
                usage.features.extend(&uses.features);
                let shell = shell_of(db, project, of);
                usage.completeness &= Completeness::of(shell.is_some()) & uses.completeness;
                if let Some(shell) = shell {
                    usage.with_core.extend(&features_of(db, project, shell).shells);
                }
            }
            Kind::Shell => {
                let features = features_of(db, project, of);
                let named = shell(db, of).map_or_else(Vec::new, names_in_values);
                usage.features.extend(named.into_iter().filter_map(|name| features.get(name)));
            }
            _ => {}
        }
    }
    usage
}

/// Returns the facts about unused declarations, properties and constants of a project. Not among the facts of the declarations:
/// an edit of one program may change the uses of any declaration, and would concern the facts of all of them.
#[salsa::tracked(returns(ref))]
pub fn unused_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<Fact<'db>> {
    let usage = usage_of(db, project);
    if usage.completeness.is_incomplete() {
        return Vec::new();
    }
    let is_unused = |of: &Decl<'db>| match (of.kind(db), &usage.deployed) {
        (Kind::Codel, _) => !usage.codels.contains(of),
        (Kind::Shell | Kind::Core | Kind::Component | Kind::Architecture, Some(deployed)) => {
            !deployed.contains(of)
        }
        _ => false,
    };
    let mut found = Vec::new();
    for &of in &names_of(db, project).all {
        let name = of.name(db);
        if !name.is_empty() && is_unused(&of) {
            let kind = match of.kind(db) {
                Kind::Codel => FactKind::UnusedCodel { codel: of },
                kind => FactKind::UnusedDeclaration { kind, name: name.clone() },
            };
            found.push(Fact::new(Location::name_of(of), kind));
        }
        let has_core = usage.with_core.contains(&of);
        let Some(data) = has_core.then(|| shell(db, of)).flatten() else { continue };
        for (index, feature) in data.features.iter().enumerate() {
            let NameRef { name, id } = &feature.name;
            let known = FeatureOf { shell: of, index: index as u32, kind: feature.kind };
            if feature.kind.is_value() && !name.is_empty() && !usage.features.contains(&known) {
                let kind = FactKind::UnusedProperty { kind: feature.kind, name: name.clone() };
                found.push(Fact::new(Location::Source(of, *id), kind));
            }
        }
    }
    found
}
