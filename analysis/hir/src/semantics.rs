//! Maps a position in a text to its semantics. Editor features use only this module to resolve names.

use std::cell::RefCell;
use std::collections::BTreeMap;

use mauve_syntax::SyntaxKind::{
    BLOCK, CORE, HANDLER, HOOK, METHOD, OPERATION_DEFINITION, STATE_MACHINE, TRANSITION, VAR,
};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{SyntaxNode, TextRange, TextSize};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::body::core_scope;
use crate::builtin::Builtin;
use crate::completeness::Completeness;
use crate::features::{Features, features_of, shell_of, written_shell};
use crate::graph::closure;
use crate::infer::{CoreInference, VariableKind, VariableOf, expression_types, inference_of_core};
use crate::item_tree::{Feature, FeatureKind, HookKind, Kind, Name, SourceId, TypeRef};
use crate::names::names_of;
use crate::project::Project;
use crate::ranges::DeclarationMap;
use crate::resolve::{
    Binding, CallError, Callee, LocalScope, ResolvedCall, Resolver, SharedNames, VariableId,
};
use crate::source::{Decl, declaration_at, declaration_map, shell};
use crate::types::{Type, type_of};
use crate::{File, ModelDb};

/// The resolved names and types in one core.
pub struct Semantics<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    /// The core.
    pub core: Decl<'db>,
    /// The inferred types, names and calls of its programs.
    pub inference: CoreInference<'db>,
    map: &'db DeclarationMap,
}

impl<'db> Semantics<'db> {
    /// Returns the semantics of the core that encloses `range`, if there is one.
    pub fn at(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        file: File,
        range: TextRange,
    ) -> Option<Semantics<'db>> {
        let core = declaration_at(db, file, range).filter(|decl| decl.kind(db) == Kind::Core)?;
        Semantics::of_core(db, project, core)
    }

    /// Returns the semantics of a core.
    pub fn of_core(db: &'db dyn ModelDb, project: Project<'db>, core: Decl<'db>) -> Option<Semantics<'db>> {
        let map = declaration_map(db, core)?;
        Some(Semantics { db, project, core, inference: inference_of_core(db, project, core), map })
    }

    /// Returns the number of the element with exactly this range.
    pub fn id(&self, range: TextRange) -> Option<SourceId> {
        self.map.source_at(range)
    }

    /// Returns the binding of a name.
    pub fn binding(&self, name: &ast::NameRef) -> Option<Binding<'db>> {
        self.inference.binding(self.id(name.syntax().text_range())?)
    }

    /// Returns the callee of a call.
    pub fn callee(&self, call: &ast::CallExpr) -> Option<Callee<'db>> {
        self.inference.callee(self.id(call.name_ref()?.syntax().text_range())?)
    }

    /// Returns the type of an expression without brackets around it, or of a variable by one of its names.
    pub fn type_of(&self, expression: &SyntaxNode) -> Option<&'db Type> {
        let id = self.id(expression.text_range())?;
        let types = |group| expression_types(self.db, self.project, self.core, group).get(&id);
        self.inference.groups_at(id).find_map(types).or_else(|| {
            let id = self.inference.variable_at(id)?;
            self.inference.variable(id).map(|variable| &variable.ty)
        })
    }

    /// Returns the variables in scope in `list`, a block or a node around blocks, innermost first, each name once. A block's
    /// variables behind `end` are not in scope.
    fn variables_in(&self, list: &SyntaxNode, end: TextSize) -> Vec<(VariableId, &'db VariableOf)> {
        let by_source: FxHashMap<SourceId, (VariableId, &'db VariableOf)> =
            self.inference.variables().map(|it| (it.1.name.id, it)).collect();
        let named = |name: Option<ast::Name>| by_source.get(&self.id(name?.syntax().text_range())?).copied();
        let mut all: Vec<(VariableId, &'db VariableOf)> = Vec::new();
        for node in list.ancestors() {
            match node.kind() {
                BLOCK | STATE_MACHINE | CORE => {
                    // All variables of the core and the machine are in scope, and of a block the preceding ones.
                    let is_block = node.kind() == BLOCK;
                    let is_seen = |child: &SyntaxNode| !is_block || child.text_range().end() <= end;
                    let is_variable = |child: &SyntaxNode| matches!(child.kind(), VAR | HANDLER);
                    let variables = node.children().filter(|child| is_variable(child) && is_seen(child));
                    all.extend(variables.filter_map(|it| named(it.children().find_map(ast::Name::cast))));
                }
                OPERATION_DEFINITION => {
                    let parameters = ast::OperationDefinition::cast(node).and_then(|it| it.param_list());
                    let parameters = parameters.iter().flat_map(ast::ParamList::params);
                    all.extend(parameters.filter_map(|parameter| named(parameter.name())));
                }
                _ => {}
            }
        }
        // The variables of the state machine are in scope in all programs.
        if list.ancestors().any(|node| node.kind() == CORE) {
            all.extend(self.inference.variables().filter(|(_, it)| it.kind == VariableKind::Machine));
        }
        let mut seen: FxHashSet<&Name> = FxHashSet::default();
        all.retain(|(_, it)| !it.name.name.is_empty() && seen.insert(&it.name.name));
        all
    }

    /// Returns the result type of the program around `list`; none outside programs.
    fn result_in(&self, list: &SyntaxNode) -> Option<Type> {
        let node = list
            .ancestors()
            .find(|it| matches!(it.kind(), OPERATION_DEFINITION | HOOK | METHOD | TRANSITION))?;
        if let Some(operation) = ast::OperationDefinition::cast(node.clone()) {
            let id = operation.name().and_then(|name| self.id(name.syntax().text_range()));
            return Some(id.and_then(|id| self.result_of(id)).unwrap_or(Type::Void));
        }
        let hook = ast::Hook::cast(node).and_then(|hook| HookKind::from_keyword(hook.own_token()?.text()));
        let gives_bool = matches!(hook, Some(HookKind::Configure | HookKind::Start));
        Some(if gives_bool { Type::Bool } else { Type::Void })
    }

    /// Returns the result type of an operation that the core defines, by the location of its name.
    fn result_of(&self, name: SourceId) -> Option<Type> {
        let scope = core_scope(self.db, self.core).as_ref()?;
        let operation = scope.operations.iter().find(|it| it.name.id == name)?;
        if let Some(own) = &operation.result {
            return Some(type_of(self.db, self.project, self.core, Some(own)));
        }
        let declared = self.features()?.get(&operation.name.name);
        declared.filter(|it| it.kind == FeatureKind::Provided).map(|it| it.ty(self.db, self.project))
    }

    fn features(&self) -> Option<&'db Features<'db>> {
        let shell = shell_of(self.db, self.project, self.core)?;
        Some(features_of(self.db, self.project, shell))
    }

    /// Resolves a call of `name` with `first` as its first argument, in a place where `visible` is in scope.
    fn resolve_call(
        &self,
        visible: &VisibleScope<'db>,
        name: &Name,
        first: Option<&Name>,
    ) -> Option<ResolvedCall<'db>> {
        let core = core_scope(self.db, self.core).as_ref()?;
        let SharedNames { operations, handlers, .. } = self.inference.shared_names().clone();
        let mut shared = SharedNames { operations, handlers, ..SharedNames::default() };
        let mut scope = LocalScope::default();
        for (id, variable) in visible.variables.iter().rev() {
            if variable.kind == VariableKind::Machine && !visible.in_machine {
                shared.machine.insert(variable.name.name.clone(), *id);
            } else {
                scope.push(&variable.name.name, *id);
            }
        }
        let features = self.features().unwrap_or_else(Features::unknown);
        let resolver = Resolver {
            db: self.db,
            project: self.project,
            of: self.core,
            codels: RefCell::default(),
            features,
            core,
            shared: &shared,
            scope,
            is_in_machine: false,
            variables: Completeness::Incomplete,
        };
        Some(resolver.resolve_call(name, first))
    }
}

/// The features of a shell and of its base shells by name, each with the shell that declares it.
pub type FeaturesByName<'db> = BTreeMap<Name, (Decl<'db>, &'db Feature)>;

/// The most likely callee of a call in incomplete text.
#[derive(Debug, Clone, Copy)]
pub enum LikelyCallee<'db> {
    /// A codel.
    Codel(Decl<'db>),
    /// An operation that this shell provides.
    Provided(Decl<'db>, &'db Feature),
    /// A built-in function.
    Builtin(Builtin),
}

/// The names in scope at one point of a core or of a shell, for an editor.
///
/// The text is usually incomplete. The analysis refuses a name that a missing declaration may hide; an editor uses the
/// existing declaration.
pub struct VisibleScope<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    /// The core or the shell.
    decl: Option<Decl<'db>>,
    /// The variables, innermost first, each name once.
    pub variables: Vec<(VariableId, &'db VariableOf)>,
    /// The features of the core's shell, or of the shell itself.
    pub features: FeaturesByName<'db>,
    /// The result type of the program; none outside programs.
    pub result: Option<Type>,
    semantics: Option<Semantics<'db>>,
    /// Whether the point is in the state machine, whose variables hide callees.
    in_machine: bool,
}

impl<'db> VisibleScope<'db> {
    /// Returns the names in scope in `list`, a node of `decl`; a block's variables behind `end` are not in scope.
    pub fn at(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        decl: Option<Decl<'db>>,
        list: &SyntaxNode,
        end: TextSize,
    ) -> VisibleScope<'db> {
        let decl = decl.filter(|decl| matches!(decl.kind(db), Kind::Core | Kind::Shell));
        let semantics = decl.filter(|decl| decl.kind(db) == Kind::Core);
        let semantics = semantics.and_then(|core| Semantics::of_core(db, project, core));
        let shell = decl.and_then(|decl| likely_shell_of(db, project, decl));
        VisibleScope {
            db,
            project,
            decl,
            variables: semantics.as_ref().map_or_else(Vec::new, |it| it.variables_in(list, end)),
            features: shell.map(|shell| likely_features_of(db, project, shell)).unwrap_or_default(),
            result: semantics.as_ref().and_then(|it| it.result_in(list)),
            semantics,
            in_machine: list.ancestors().any(|node| node.kind() == STATE_MACHINE),
        }
    }

    /// Returns the variable of that name.
    pub fn variable(&self, name: &str) -> Option<&'db VariableOf> {
        self.variables.iter().map(|(_, it)| *it).find(|it| it.name.name == *name)
    }

    /// Returns the core if it defines the operation `name`.
    pub fn definer_of(&self, name: &str) -> Option<Decl<'db>> {
        let core = self.semantics.as_ref()?.core;
        let operations = &core_scope(self.db, core).as_ref()?.operations;
        operations.iter().any(|it| it.name.name == *name).then_some(core)
    }

    /// Returns the type of the variable or of the feature `name`.
    pub fn type_of_name(&self, name: &str) -> Option<Type> {
        self.variable(name).map(|variable| variable.ty.clone()).or_else(|| {
            let (shell, feature) = self.features.get(name)?;
            Some(type_of(self.db, self.project, *shell, feature.ty.as_ref()))
        })
    }

    /// Returns the type that `ty`, written here, refers to.
    pub fn type_of_written(&self, ty: &ast::Type) -> Option<Type> {
        let path = ty.name_refs().map(|it| it.syntax().text().to_string().into()).collect();
        Some(type_of(self.db, self.project, self.decl?, Some(&TypeRef { path, id: SourceId(0) })))
    }

    /// Returns the most likely callee of `name` with `first` as its first argument: the result of the resolver,
    /// otherwise an operation that the core does not define yet, a codel of an unused library, or a built-in function.
    pub fn resolve_call(&self, name: &str, first: Option<&str>) -> Option<LikelyCallee<'db>> {
        let semantics = self.semantics.as_ref()?;
        match semantics.resolve_call(self, &name.into(), first.map(Name::from).as_ref())?.callee {
            Ok(Callee::Codel(of)) => return Some(LikelyCallee::Codel(of)),
            Ok(Callee::Builtin(builtin)) => return Some(LikelyCallee::Builtin(builtin)),
            Err(CallError::NotCallable(_)) => return None,
            Ok(Callee::Operation(_)) | Err(_) => {}
        }
        let provided = self.features.get(name).filter(|(_, it)| it.kind == FeatureKind::Provided);
        let codel = || likely_declaration(self.db, self.project, semantics.core, Kind::Codel, &[name.into()]);
        provided
            .map(|&(shell, feature)| LikelyCallee::Provided(shell, feature))
            .or_else(|| codel().map(LikelyCallee::Codel))
            .or_else(|| Builtin::of_name(name).map(LikelyCallee::Builtin))
    }
}

/// Returns the declaration that `path`, written in `from`, most likely refers to. It is the declaration that the resolver
/// finds; otherwise one with that name in the same library; otherwise any with that name.
pub fn likely_declaration<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    from: Decl<'db>,
    kind: Kind,
    path: &[Name],
) -> Option<Decl<'db>> {
    let (names, library) = (names_of(db, project), from.library(db).as_ref());
    names.resolve(db, library, kind, path).ok().or_else(|| {
        let found = match path {
            [name] => names.anywhere(kind, name),
            [of, name] => names.in_library(Some(of), kind, name),
            _ => &[],
        };
        found.iter().find(|it| it.library(db).as_ref() == library).or(found.first()).copied()
    })
}

/// Returns the shell of a core or of a component as [`likely_declaration`] finds it; a shell itself.
pub fn likely_shell_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Option<Decl<'db>> {
    if of.kind(db) == Kind::Shell {
        return Some(of);
    }
    likely_declaration(db, project, of, Kind::Shell, &written_shell(db, of)?.path)
}

/// Returns the features of a shell and of its base shells as [`likely_declaration`] finds them, each name once.
pub fn likely_features_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> FeaturesByName<'db> {
    let bases_of = |of: Decl<'db>| {
        let bases = shell(db, of).into_iter().flat_map(|data| &data.bases);
        bases.filter_map(move |it| likely_declaration(db, project, of, Kind::Shell, &it.path))
    };
    let mut found = BTreeMap::new();
    for of in closure([of], bases_of) {
        let features = shell(db, of).into_iter().flat_map(|data| &data.features);
        for feature in features.filter(|it| !it.name.name.is_empty()) {
            found.entry(feature.name.name.clone()).or_insert((of, feature));
        }
    }
    found
}
