//! From a position in a text to its meaning: the only door for editor features, which resolve no name themselves.

use mauve_syntax::SyntaxKind::{BLOCK, CORE, HOOK, METHOD, OPERATION_DEFINITION, STATE_MACHINE, TRANSITION};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{SyntaxNode, TextRange, TextSize};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::body::core_scope;
use crate::completeness::Completeness;
use crate::features::{Features, features_of, shell_of};
use crate::infer::{CoreInference, VariableKind, VariableOf, expression_types, inference_of_core};
use crate::item_tree::{FeatureKind, HookKind, Kind, Name, SourceId};
use crate::names::names_of;
use crate::project::Project;
use crate::resolve::{Binding, Callee, ResolvedCall, Resolver, Scope, VariableId};
use crate::source::{Decl, declaration_at, declaration_map};
use crate::types::{Type, type_of};
use crate::{File, ModelDb};

/// The meaning of what stands in one core.
pub struct Semantics<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    /// The core.
    pub core: Decl<'db>,
    /// What is known of its programs.
    pub inference: CoreInference<'db>,
    /// The source map, backwards.
    ids: FxHashMap<TextRange, SourceId>,
}

impl<'db> Semantics<'db> {
    /// Of the core that stands around `range`; none where no core does.
    pub fn at(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        file: File,
        range: TextRange,
    ) -> Option<Semantics<'db>> {
        let core = declaration_at(db, file, range).filter(|decl| decl.kind(db) == Kind::Core)?;
        Semantics::of_core(db, project, core)
    }

    /// Of a core.
    pub fn of_core(db: &'db dyn ModelDb, project: Project<'db>, core: Decl<'db>) -> Option<Semantics<'db>> {
        let ranges = declaration_map(db, core)?.ranges().enumerate();
        let ids = ranges.map(|(id, range)| (range, SourceId(id as u32))).collect();
        Some(Semantics { db, project, core, inference: inference_of_core(db, project, core), ids })
    }

    /// The number of the part that stands right at `range`.
    pub fn id(&self, range: TextRange) -> Option<SourceId> {
        self.ids.get(&range).copied()
    }

    /// What a name of a value refers to.
    pub fn binding(&self, name: &ast::NameRef) -> Option<Binding<'db>> {
        self.inference.binding(self.id(name.syntax().text_range())?)
    }

    /// What a call calls.
    pub fn callee(&self, call: &ast::CallExpr) -> Option<Callee<'db>> {
        self.inference.callee(self.id(call.name_ref()?.syntax().text_range())?)
    }

    /// The type of an expression without brackets around it, or of a variable by one of its names.
    pub fn type_of(&self, expression: &SyntaxNode) -> Option<&'db Type> {
        let id = self.id(expression.text_range())?;
        let types = |group| expression_types(self.db, self.project, self.core, group).get(&id);
        self.inference.groups_at(id).find_map(types).or_else(|| {
            let id = self.inference.variable_at(id)?;
            self.inference.variable(id).map(|variable| &variable.ty)
        })
    }

    /// The variables that can be named in `list`, a block or what blocks stand in, where those behind `end` cannot.
    pub fn scope_in(&self, list: &SyntaxNode, end: TextSize) -> VisibleScope<'db> {
        let by_source: FxHashMap<SourceId, (VariableId, &'db VariableOf)> =
            self.inference.variables().map(|it| (it.1.name.id, it)).collect();
        let named = |name: Option<ast::Name>| by_source.get(&self.id(name?.syntax().text_range())?).copied();
        let mut all: Vec<(VariableId, &'db VariableOf)> = Vec::new();
        for node in list.ancestors() {
            match node.kind() {
                BLOCK | STATE_MACHINE | CORE => {
                    // A program sees all variables of its core and machine, and those above it in its own block.
                    let is_block = node.kind() == BLOCK;
                    let is_seen = |child: &SyntaxNode| !is_block || child.text_range().end() <= end;
                    all.extend(node.children().filter(is_seen).filter_map(|child| match ast::Handler::cast(
                        child.clone(),
                    ) {
                        Some(handler) => named(handler.name()),
                        None => named(ast::Var::cast(child)?.name()),
                    }));
                }
                OPERATION_DEFINITION => {
                    let parameters = ast::OperationDefinition::cast(node).and_then(|it| it.param_list());
                    let parameters = parameters.iter().flat_map(ast::ParamList::params);
                    all.extend(parameters.filter_map(|parameter| named(parameter.name())));
                }
                _ => {}
            }
        }
        // The variables of the state machine are seen in all programs.
        if list.ancestors().any(|node| node.kind() == CORE) {
            all.extend(self.inference.variables().filter(|(_, it)| it.kind == VariableKind::Machine));
        }
        let mut seen: FxHashSet<&Name> = FxHashSet::default();
        all.retain(|(_, it)| !it.name.name.is_empty() && seen.insert(&it.name.name));
        VisibleScope { variables: all, in_machine: list.ancestors().any(|node| node.kind() == STATE_MACHINE) }
    }

    /// What the program around `list` must give back; none outside programs.
    pub fn result_in(&self, list: &SyntaxNode) -> Option<Type> {
        let node = list
            .ancestors()
            .find(|it| matches!(it.kind(), OPERATION_DEFINITION | HOOK | METHOD | TRANSITION))?;
        if let Some(operation) = ast::OperationDefinition::cast(node.clone()) {
            let id = operation.name().and_then(|name| self.id(name.syntax().text_range()));
            return Some(id.and_then(|id| self.result_of(id)).unwrap_or(Type::Void));
        }
        let hook = ast::Hook::cast(node).and_then(|hook| HookKind::from_keyword(hook.keyword()?.text()));
        let gives_bool = matches!(hook, Some(HookKind::Configure | HookKind::Start));
        Some(if gives_bool { Type::Bool } else { Type::Void })
    }

    /// The type of the result of an operation that the core defines, by the location of its name.
    fn result_of(&self, name: SourceId) -> Option<Type> {
        let scope = core_scope(self.db, self.core).as_ref()?;
        let operation = scope.operations.iter().find(|it| it.name.id == name)?;
        if let Some(own) = &operation.result {
            return Some(type_of(self.db, self.project, self.core, Some(own)));
        }
        let feature = self.features()?.get(&operation.name.name)?;
        let declared = feature.data(self.db).filter(|it| it.kind == FeatureKind::Provided)?;
        Some(type_of(self.db, self.project, feature.shell, declared.ty.as_ref()))
    }

    fn features(&self) -> Option<&'db Features<'db>> {
        let shell = shell_of(self.db, self.project, self.core)?;
        Some(features_of(self.db, self.project, shell))
    }

    /// What a call of `name` with `first` for its first argument calls.
    pub fn resolve_call(
        &self,
        visible: &VisibleScope<'db>,
        name: &Name,
        first: Option<&Name>,
    ) -> Option<ResolvedCall<'db>> {
        let none = Features { completeness: Completeness::Incomplete, ..Features::default() };
        let core = core_scope(self.db, self.core).as_ref()?;
        let (mut scope, mut machine) = (Scope::default(), Scope::default());
        for (id, variable) in visible.variables.iter().rev() {
            let is_behind = variable.kind == VariableKind::Machine && !visible.in_machine;
            let scope = if is_behind { &mut machine } else { &mut scope };
            scope.push(&variable.name.name, *id);
        }
        let (names, features) = (names_of(self.db, self.project), self.features().unwrap_or(&none));
        let (db, of, variables) = (self.db, self.core, Completeness::Incomplete);
        let resolver = Resolver { db, of, names, features, core, scope, machine, variables };
        Some(resolver.resolve_call(name, first))
    }
}

/// The variables that can be named at one point of a program.
pub struct VisibleScope<'db> {
    /// The innermost first, each name once.
    pub variables: Vec<(VariableId, &'db VariableOf)>,
    /// Whether it is in the state machine, whose variables hide what is called.
    in_machine: bool,
}
