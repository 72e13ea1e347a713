//! Walks through a body: resolves its names, and infers and checks the types of its statements and expressions.

use super::*;

impl<'db> InferenceContext<'_, 'db> {
    pub(super) fn infer(&mut self, body: &Body) {
        match body {
            Body::InitialValues(values) => self.initial_values(values),
            Body::Operation(operation) => self.operation(operation),
            Body::Hook(hook) => {
                let result = match hook.kind {
                    HookKind::Configure | HookKind::Start => Type::Bool,
                    HookKind::Update | HookKind::Stop | HookKind::Cleanup => Type::Void,
                };
                let (code, name) = (ScopedCode::Program(&hook.program), ProgramName::Hook(hook.kind));
                self.code(ProgramIn::Whole, code, name, result);
            }
            Body::State(state) => self.state(state),
        }
    }

    pub(super) fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.found.facts.push(Fact::new(Location::Source(self.of, id), kind));
    }

    pub(super) fn problem(&mut self, problem: NameProblem<'db>) {
        self.found.problems.entry((self.body, self.program)).or_default().push(problem);
    }

    pub(super) fn error(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.problem(NameProblem::Error(Fact::new(Location::Source(self.of, id), kind)));
    }

    /// Returns the number of errors in the program so far, without names that another error may hide.
    fn errors(&self) -> usize {
        let problems = self.found.problems.get(&(self.body, self.program)).into_iter().flatten();
        problems.filter(|problem| !matches!(problem, NameProblem::Hidden(_))).count()
    }

    fn type_of_value(&self, ty: Option<&TypeRef>) -> Type {
        type_of_value(self.db, self.project, self.of, ty)
    }

    fn declare(&mut self, variable: VariableOf) {
        let id = VariableId { group: Some(self.group), index: self.found.variables.len() as u32 };
        self.resolver.scope.push(&variable.name.name, id);
        self.found.variables.push(variable);
    }

    pub(super) fn variable(&self, id: VariableId) -> Option<&VariableOf> {
        let all = if id.group.is_some() { &self.found.variables } else { self.shared };
        all.get(id.index as usize)
    }

    pub(super) fn signature(
        &self,
        of: Decl<'db>,
        parameters: &[Parameter],
        result: Option<&TypeRef>,
    ) -> Signature {
        signature(self.db, self.project, of, parameters, result)
    }

    fn initial_values(&mut self, values: &InitialValues) {
        self.completeness = values.completeness;
        self.program = ProgramIn::Whole;
        values.variables.iter().for_each(|variable| self.initial_value(variable));
    }

    fn initial_value(&mut self, variable: &Variable) {
        if let Some(value) = &variable.value {
            let expected = self.type_of_value(variable.ty.as_ref());
            self.assigned(&variable.name.name, &expected, value);
        }
    }

    fn operation(&mut self, operation: &Operation) {
        let name = &operation.name.name;
        let own = self.signature(self.of, &operation.parameters, operation.result.as_ref());
        let declared = self.declared(name, FeatureKind::Provided);
        let result = match (&operation.result, &declared) {
            (Some(_), _) => own.result.clone(),
            (None, Some((declared, _))) => declared.result.clone(),
            // Another fact reports the missing declaration.
            (None, None) => Type::Unknown,
        };
        let defined = Signature { result: result.clone(), ..own };
        if let Some((declared, declared_at)) = declared
            && operation.program.completeness.is_complete()
            && !defined.is(&declared)
        {
            let fixed = self.as_declared(operation).map(|text| (operation.signature, text));
            let (name, defined) = (name.clone(), defined.clone());
            let kind = FactKind::OperationDefinition { name, declared, defined, declared_at, fixed };
            self.report(operation.name.id, kind);
        }
        for (parameter, (direction, _, ty)) in operation.parameters.iter().zip(defined.parameters) {
            self.declare(VariableOf {
                name: parameter.name.clone(),
                kind: VariableKind::Parameter(direction),
                ty,
                written: parameter.ty.clone(),
                value: if direction == Direction::Out { InitialValue::None } else { InitialValue::Plain },
            });
        }
        let needs_return = result != Type::Void && result != Type::Unknown;
        if needs_return
            && operation.program.completeness.is_complete()
            && !returns(&operation.program.statements)
        {
            let kind = FactKind::MissingReturn { name: name.clone(), expected: result.clone() };
            self.report(operation.name.id, kind);
        }
        let of = ProgramName::Operation(name.clone());
        self.code(ProgramIn::Whole, ScopedCode::Program(&operation.program), of, result);
    }

    fn state(&mut self, state: &State) {
        for (program, code) in state.code() {
            let name = match program {
                ProgramIn::Method(index) => {
                    state.methods.get(index as usize).map(|it| ProgramName::Method(it.kind))
                }
                _ => None,
            };
            self.code(program, code, name.unwrap_or(ProgramName::Effect), Type::Void);
        }
    }

    fn code(&mut self, program: ProgramIn, code: ScopedCode<'_>, name: ProgramName, result: Type) {
        (self.program, self.program_name, self.result) = (program, name, result);
        match code {
            ScopedCode::Program(code) => {
                self.completeness = code.completeness;
                let variables = self.resolver.variables;
                self.resolver.variables &= code.completeness;
                self.block(&code.statements);
                self.resolver.variables = variables;
            }
            ScopedCode::Guard(guard) => {
                self.completeness = guard.completeness;
                self.condition(&guard.condition);
            }
        }
    }

    /// Returns the signature that the shell declares, such as `(in far: double): bool`, if its types resolve to the same
    /// types in this core. The parameters keep the names of `operation`, which its program uses.
    fn as_declared(&self, operation: &Operation) -> Option<String> {
        let feature = self.resolver.features.get(&operation.name.name)?;
        let data = feature.data(self.db)?;
        let of = |decl| self.signature(decl, &data.parameters, data.ty.as_ref());
        let missing = data.parameters.len().checked_sub(operation.parameters.len())?;
        // The values that the program returns would be of a wrong type.
        let own = self.signature(self.of, &operation.parameters, operation.result.as_ref());
        let keeps_result = operation.result.is_none() || own.result == of(self.of).result;
        if !keeps_result
            || !of(self.of).is(&of(feature.shell))
            || operation.parameters.iter().any(|it| it.name.name.is_empty())
        {
            return None;
        }
        let own = operation.parameters.iter().map(|it| &it.name.name);
        let added = data.parameters.iter().skip(data.parameters.len() - missing).map(|it| &it.name.name);
        let names: Vec<&Name> = own.chain(added).collect();
        let mut seen = FxHashSet::default();
        if !names.iter().all(|name| seen.insert(*name)) {
            return None;
        }
        let parameters = data.parameters.iter().zip(names).map(|(declared, name)| {
            Some(format!("{} {name}: {}", declared.direction.keyword(), declared.ty.as_ref()?))
        });
        let parameters: Option<Vec<String>> = parameters.collect();
        Some(format!("({}): {}", parameters?.join(", "), data.ty.as_ref()?))
    }

    /// Returns the signature that the shell declares for an operation, and the location of the declaration, if the signature
    /// is complete.
    pub(super) fn declared(&self, name: &str, kind: FeatureKind) -> Option<(Signature, Location<'db>)> {
        let feature = self.resolver.features.get(name).filter(|feature| feature.kind == kind)?;
        let data = feature.data(self.db).filter(|it| it.completeness.is_complete())?;
        let signature = self.signature(feature.shell, &data.parameters, data.ty.as_ref());
        Some((signature, Location::Source(feature.shell, data.name.id)))
    }

    fn block(&mut self, statements: &[Statement]) {
        let depth = self.resolver.scope.len();
        for statement in statements {
            self.statement(statement);
        }
        self.resolver.scope.truncate(depth);
        let own = statements.iter().filter_map(Statement::variable);
        self.found.facts.extend(repeated(self.of, own.map(|it| (&it.name, Defined::Variable))));
    }

    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Variable(variable) => {
                self.initial_value(variable);
                self.declare(VariableOf {
                    name: variable.name.clone(),
                    kind: VariableKind::Local,
                    ty: self.type_of_value(variable.ty.as_ref()),
                    written: variable.ty.clone(),
                    value: variable.initial_value(),
                });
            }
            Statement::If { id, condition, then, end, otherwise } => {
                self.condition(condition);
                self.block(then);
                match otherwise {
                    Some(otherwise) => self.block(otherwise),
                    None if self.completeness.is_complete() => {
                        self.report(*id, FactKind::MissingElse { end: *end })
                    }
                    None => {}
                }
            }
            Statement::Block(statements) => self.block(statements),
            Statement::Return(id, value) => self.return_statement(*id, value.as_ref()),
            Statement::Assign(target, value) => {
                let expected = self.target(target);
                self.assigned(&target.name, &expected, value);
            }
            Statement::Expr(value) => self.expression_statement(value),
        }
    }

    fn expression_statement(&mut self, value: &Expr) {
        let errors = self.errors();
        match value {
            Expr::Call { callee, arguments, id } => {
                let ty = self.call(callee, arguments, Some(*id));
                if let Some(types) = &mut self.types {
                    types.insert(*id, ty);
                }
            }
            value => _ = self.expr(value),
        }
        // A call without a name or without parentheses. (Another fact reports the name of a codel.)
        if let Some(id) =
            without_call(value).filter(|_| self.errors() == errors && self.completeness.is_complete())
        {
            self.error(id, FactKind::NoEffect);
        }
    }

    fn condition(&mut self, condition: &Expr) {
        let found = self.expr(condition).ty;
        if !found.is(&Type::Bool)
            && let Some(id) = condition.id()
        {
            self.report(id, FactKind::ConditionType { found });
        }
    }

    fn return_statement(&mut self, keyword: SourceId, value: Option<&Expr>) {
        let (found, id) = match value {
            Some(value) => (self.expr(value), value.id().unwrap_or(keyword)),
            None => (Typed::of(Type::Void), keyword),
        };
        let fits = match (value, &self.result) {
            // A call without a result is not allowed either.
            (Some(_), Type::Void) => found.ty == Type::Unknown,
            (_, expected) => found.ty.fits(found.value.as_ref(), expected),
        };
        if !fits && self.completeness.is_complete() {
            let (of, expected) = (self.program_name.clone(), self.result.clone());
            self.report(id, FactKind::ReturnType { of, expected, found: found.ty });
        }
    }

    fn target(&mut self, target: &NameRef) -> Type {
        let is = match self.value(target, NameRole::Target) {
            Some(Binding::Variable(id)) => {
                let Some(variable) = self.variable(id) else { return Type::Unknown };
                if variable.kind != VariableKind::Parameter(Direction::In) {
                    return variable.ty.clone();
                }
                None
            }
            Some(Binding::Feature(feature)) if !feature.kind.is_operation() => Some(feature.kind),
            // Another fact reports that the operation is not called.
            Some(Binding::Feature(_)) | None => return Type::Unknown,
        };
        self.report(target.id, FactKind::NotAssignable { name: target.name.clone(), is });
        Type::Unknown
    }

    pub(super) fn assigned(&mut self, name: &Name, expected: &Type, value: &Expr) {
        self.check(value, expected, |expected, found| FactKind::AssignmentType {
            name: name.clone(),
            expected,
            found,
        });
    }

    /// Infers the type of `value`, and reports `mismatch`, of the expected and the actual type, unless the value fits.
    pub(super) fn check(
        &mut self,
        value: &Expr,
        expected: &Type,
        mismatch: impl FnOnce(Type, Type) -> FactKind<'db>,
    ) {
        let found = self.expr(value);
        if !found.ty.fits(found.value.as_ref(), expected)
            && let Some(id) = value.id()
        {
            self.report(id, mismatch(expected.clone(), found.ty));
        }
    }

    /// Resolves the name of a value. Reports an unresolved name, and a call without parentheses.
    pub(super) fn value(&mut self, name: &NameRef, role: NameRole) -> Option<Binding<'db>> {
        let binding = self.bind(name);
        if name.name.is_empty() {
            return binding;
        }
        match binding {
            Some(Binding::Feature(feature)) if feature.kind.is_operation() => {
                let name_of = name.name.clone();
                let kind = FactKind::NotCalled { name: name_of, is_operation: true, takes_nothing: false };
                self.error(name.id, kind);
            }
            Some(_) => {}
            None => self.unresolved_value(name, role),
        }
        binding
    }

    fn unresolved_value(&mut self, NameRef { name, id }: &NameRef, role: NameRole) {
        match self.resolver.resolve_codel(name) {
            found @ (Ok(_) | Err(Unresolved::Ambiguous | Unresolved::Repeated)) => {
                let data = found.ok().and_then(|of| codel(self.db, of));
                let takes_nothing = data.is_some_and(|it| it.parameters.is_empty());
                let kind = FactKind::NotCalled { name: name.clone(), is_operation: false, takes_nothing };
                self.error(*id, kind);
            }
            // Another fact reports the error that may hide the declaration.
            Err(_)
                if (self.resolver.features.name_completeness() & self.resolver.variables).is_incomplete() =>
            {
                self.problem(NameProblem::Hidden(CoreReason::MayBeDeclared(name.clone())));
            }
            Err(_) => {
                let near = self.similar_value(name, role);
                self.error(*id, FactKind::UnresolvedVariable { name: name.clone(), near });
            }
        }
    }

    /// Returns the name in scope that `name` is most likely a misspelling of, and that may stand in its place.
    fn similar_value(&self, name: &Name, role: NameRole) -> Option<Name> {
        let is_variable = |name: &&Name| match self.resolver.resolve_name(name) {
            Some(Binding::Variable(id)) => self.variable(id).is_some_and(|it| role.takes(it.kind)),
            _ => false,
        };
        let of_core = |it: &&VariableOf| it.kind != VariableKind::Machine;
        let of_machine = |it: &&VariableOf| !of_core(it) && self.resolver.is_in_machine;
        let shared = self.shared.iter().filter(of_core).chain(self.shared.iter().filter(of_machine));
        let names = shared.map(|it| &it.name.name).chain(self.resolver.scope.names());
        let variables = names.filter(is_variable);
        let features = self.resolver.features.by_name.iter().filter(|_| role == NameRole::Value);
        let values = features.filter(|(_, found)| found.iter().any(|it| it.kind.is_value()));
        similar(name, variables.chain(values.map(|(name, _)| name)))
    }

    /// Resolves a name and records its binding, without reports.
    pub(super) fn bind(&mut self, name: &NameRef) -> Option<Binding<'db>> {
        let binding = self.resolver.resolve_name(&name.name);
        match binding {
            Some(binding) => _ = self.bindings.insert(name.id, binding),
            None => self.found.unresolved = true,
        }
        binding
    }

    fn name(&mut self, name: &NameRef) -> Type {
        match self.value(name, NameRole::Value) {
            Some(Binding::Variable(id)) => {
                self.variable(id).map_or(Type::Unknown, |variable| variable.ty.clone())
            }
            Some(Binding::Feature(feature)) if feature.kind.is_value() => feature.ty(self.db, self.project),
            Some(Binding::Feature(feature)) if feature.kind.is_port() => {
                let (name_of, is_status) = (name.name.clone(), false);
                let kind = FactKind::PortAsValue { name: name_of, kind: feature.kind, is_status };
                self.report(name.id, kind);
                Type::Unknown
            }
            // Another fact reports that an operation is not called.
            Some(Binding::Feature(_)) | None => Type::Unknown,
        }
    }

    pub(super) fn expr(&mut self, expr: &Expr) -> Typed {
        let typed = self.infer_expr(expr);
        if let (Some(types), Some(id)) = (&mut self.types, expr.id()) {
            types.insert(id, typed.ty.clone());
        }
        typed
    }

    fn infer_expr(&mut self, expr: &Expr) -> Typed {
        match expr {
            Expr::Missing => Typed::UNKNOWN,
            // The syntax error is reported; type errors may follow from it.
            Expr::Incomplete(inner) => {
                let reported = self.found.facts.len();
                self.expr(inner);
                self.found.facts.truncate(reported);
                Typed::UNKNOWN
            }
            Expr::Literal(literal, id) => self.computed(Typed::literal(literal), *id),
            Expr::Name(name) => Typed::of(self.name(name)),
            Expr::Unary(operator, inner, id) => Typed::least(*operator, inner).unwrap_or_else(|| {
                let inner = self.expr(inner);
                self.computed(inner.unary(*operator), *id)
            }),
            Expr::Binary(operator, lhs, rhs, id) => {
                let reported = self.found.facts.len();
                let (left, right) = (self.expr(lhs), self.expr(rhs));
                if [&left.ty, &right.ty].contains(&&Type::PortStatus) {
                    self.compared_with_status(reported, [lhs, rhs]);
                }
                self.computed(left.binary(*operator, &right), *id)
            }
            Expr::Call { callee, arguments, .. } => Typed::of(self.call(callee, arguments, None)),
        }
    }

    /// Notes that a port beside an operand of type port status, reported as a value, is one whose status is needed.
    fn compared_with_status(&mut self, reported: usize, operands: [&Expr; 2]) {
        let at = |id| Location::Source(self.of, id);
        let operands = operands.map(|it| it.id().map(at));
        for fact in self.found.facts.iter_mut().skip(reported) {
            if let FactKind::PortAsValue { is_status, .. } = &mut fact.kind {
                *is_status |= operands.contains(&Some(fact.at.clone()));
            }
        }
    }

    fn computed(&mut self, found: Result<Typed, OperatorError>, id: SourceId) -> Typed {
        found.unwrap_or_else(|error| {
            self.report(id, FactKind::Operation(error));
            Typed::UNKNOWN
        })
    }
}

/// The role of a name in a program.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum NameRole {
    /// It is read.
    Value,
    /// It is assigned.
    Target,
}

impl NameRole {
    /// Returns whether a variable of this kind may have the role.
    fn takes(self, kind: VariableKind) -> bool {
        match self {
            NameRole::Value => kind != VariableKind::Handler,
            NameRole::Target => kind != VariableKind::Parameter(Direction::In),
        }
    }
}

/// Returns the source of the first value in an expression without calls. (A missing expression is a syntax error.)
fn without_call(expr: &Expr) -> Option<SourceId> {
    let mut values = expr.descendants().filter(|it| matches!(it, Expr::Literal(..) | Expr::Name(_)));
    if expr.may_call() { None } else { values.next()?.id() }
}
