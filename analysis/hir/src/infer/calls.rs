//! Resolves calls, and checks their arguments against the parameters of the callee.

use super::context::NameRole;
use super::*;

impl<'db> InferenceContext<'_, 'db> {
    /// Resolves and checks a call, and returns the type of its result. `statement`: the call, if it is a statement, whose
    /// result is ignored.
    pub(super) fn call(&mut self, callee: &NameRef, arguments: &[Expr], statement: Option<SourceId>) -> Type {
        let first = first_name(arguments).map(|first| &first.name);
        let resolved = self.resolver.resolve_call(&callee.name, first);
        match resolved.callee {
            Ok(found) => {
                self.callees.insert(callee.id, found);
                self.resolved_call(found, callee, arguments, resolved.has_operand)
            }
            Err(error) => {
                self.found.unresolved = true;
                for (index, argument) in arguments.iter().enumerate() {
                    match argument {
                        Expr::Name(name)
                            if index == 0
                                && (resolved.has_operand || self.is_wrong_operand(callee, &error, name)) =>
                        {
                            _ = self.bind(name);
                        }
                        // If `read` is misspelt, a port is correct here.
                        Expr::Name(name) => _ = self.value(name, NameRole::Value),
                        argument => _ = self.expr(argument),
                    }
                }
                self.unresolved_call(error, callee, arguments, statement);
                Type::Unknown
            }
        }
    }

    fn resolved_call(
        &mut self,
        found: Callee<'db>,
        callee: &NameRef,
        arguments: &[Expr],
        has_operand: bool,
    ) -> Type {
        match found {
            Callee::Codel(of) => {
                let data = codel(self.db, of).filter(|it| it.completeness.is_complete());
                let signature = data.map(|it| self.signature(of, &it.parameters, it.result.as_ref()));
                let (parameters, result) = signature.map(|it| (it.parameters, it.result)).unzip();
                self.call_arguments(callee, parameters, arguments, has_operand);
                result.unwrap_or(Type::Unknown)
            }
            Callee::Operation(index) => {
                let Some(operation) = self.resolver.core.operations.get(index) else { return Type::Unknown };
                let own = self.signature(self.of, &operation.parameters, operation.result.as_ref());
                let is_complete = operation.completeness.is_complete();
                self.call_arguments(callee, is_complete.then_some(own.parameters), arguments, has_operand);
                match (&operation.result, self.declared(&callee.name, FeatureKind::Provided)) {
                    _ if !is_complete => Type::Unknown,
                    (None, Some((declared, _))) => declared.result,
                    (None, None) if self.resolver.features.completeness.is_incomplete() => Type::Unknown,
                    (None, None) => Type::Void,
                    (Some(_), _) => own.result,
                }
            }
            Callee::Builtin(builtin @ (Builtin::Read | Builtin::Write | Builtin::Status)) => {
                self.port(builtin, callee, arguments)
            }
            Callee::Builtin(Builtin::Send) => self.send(callee, arguments),
            Callee::Builtin(Builtin::Collect) => self.collect(callee, arguments),
        }
    }

    fn unresolved_call(
        &mut self,
        error: CallError,
        callee: &NameRef,
        arguments: &[Expr],
        statement: Option<SourceId>,
    ) {
        let NameRef { name, id } = callee;
        let kind = match error {
            CallError::Undefined => {
                let undefined = CoreReason::UndefinedOperation(name.clone());
                return self.problem(NameProblem::Reported(undefined));
            }
            CallError::Required => {
                let handlers = &self.resolver.core.handlers;
                let handler = handlers
                    .iter()
                    .find(|handler| handler.operation.as_ref().and_then(|it| it.path.last()) == Some(name));
                let send = handler.zip(statement).map(|(handler, call)| SendInstead {
                    handler: handler.name.name.clone(),
                    call,
                    first: arguments.first().and_then(Expr::id),
                });
                FactKind::BlockingCall { name: name.clone(), send }
            }
            CallError::NotCallable(is) => {
                if is.is_none() {
                    self.bind(callee);
                }
                FactKind::NotCallable { name: name.clone(), is, hides: self.hidden_by(name) }
            }
            CallError::UnresolvedOperand(function) => {
                return self.unresolved_operand(function, first_name(arguments));
            }
            CallError::Unresolved(Unresolved::Ambiguous) => {
                FactKind::AmbiguousName { kind: Kind::Codel, name: name.clone() }
            }
            CallError::Unresolved(Unresolved::Repeated) => {
                return self.problem(NameProblem::Reported(CoreReason::RepeatedCodel(name.clone())));
            }
            CallError::Unresolved(Unresolved::Incomplete) => {
                let not_found =
                    CoreReason::CodelNotFound(name.clone(), names_of(self.db, self.project).may_hide());
                return self.problem(NameProblem::Hidden(not_found));
            }
            // Another fact reports the shell that may declare the operation.
            CallError::Unresolved(_) if self.resolver.features.completeness.is_incomplete() => {
                return self.problem(NameProblem::Hidden(CoreReason::MayBeOperation(name.clone())));
            }
            // So is a port without a name, which may be the operand.
            CallError::Unresolved(_)
                if Builtin::of_name(name).is_some()
                    && self.resolver.features.value_completeness.is_incomplete() =>
            {
                return self.problem(NameProblem::Hidden(CoreReason::MayBeOperation(name.clone())));
            }
            CallError::Unresolved(_) => match Builtin::of_name(name) {
                Some(builtin) => self.not_builtin(builtin, arguments),
                None => FactKind::UnresolvedCodel {
                    core: self.of,
                    name: name.clone(),
                    arguments: arguments.len(),
                    builtin: self.misspelt_builtin(name, first_name(arguments)),
                },
            },
        };
        self.error(*id, kind);
    }

    /// Returns whether `first` is the wrong first argument of a built-in function, which is reported at the function.
    fn is_wrong_operand(&self, callee: &NameRef, error: &CallError, first: &NameRef) -> bool {
        matches!(error, CallError::Unresolved(Unresolved::Unknown))
            && self.resolver.features.completeness.is_complete()
            && Builtin::of_name(&callee.name).is_some()
            && self.resolver.resolve_name(&first.name).is_some()
    }

    /// Returns the fact for a call of a built-in function with a wrong first argument.
    fn not_builtin(&self, function: Builtin, arguments: &[Expr]) -> FactKind<'db> {
        let Some(name) = first_name(arguments) else {
            return FactKind::NotBuiltin { function, first: None, swapped: None, instead: None };
        };
        let first = self.resolver.resolve_name(&name.name).map(|binding| match binding {
            Binding::Variable(_) => (name.name.clone(), None),
            Binding::Feature(feature) => (name.name.clone(), Some(feature.kind)),
        });
        let swapped = match arguments {
            [_, Expr::Name(second)] if self.resolver.is_operand(function, &second.name) => {
                Some([name.clone(), second.clone()])
            }
            _ => None,
        };
        let handlers = &self.resolver.core.handlers;
        let operation = |handler: &Handler| Some(handler.operation.as_ref()?.path.last()?.clone());
        let instead = match function.operand() {
            Operand::Handler => {
                let mut of_it = handlers.iter().filter(|it| operation(it).as_ref() == Some(&name.name));
                of_it.next().filter(|_| of_it.next().is_none()).map(|it| it.name.name.clone())
            }
            Operand::Operation => handlers.iter().find(|it| it.name.name == name.name).and_then(operation),
            Operand::Port(_) => None,
        };
        let instead = instead.map(|instead| NameRef { name: instead, id: name.id });
        FactKind::NotBuiltin { function, first, swapped, instead }
    }

    /// Returns the built-in function that `name` may be a misspelling of, and that takes the argument `first`.
    fn misspelt_builtin(&self, name: &Name, first: Option<&NameRef>) -> Option<Builtin> {
        let takes = |it: &Builtin| first.is_some_and(|first| self.resolver.is_operand(*it, &first.name));
        let fitting: Vec<Name> = Builtin::ALL.into_iter().filter(takes).map(|it| it.name().into()).collect();
        Builtin::of_name(&similar(name, &fitting)?)
    }

    /// Returns the definition that a name shadows although the name cannot be called.
    fn hidden_by(&self, name: &Name) -> Option<Hidden> {
        match self.resolver.resolve_codel(name) {
            Err(Unresolved::Unknown) => Builtin::of_name(name).map(|_| Hidden::Builtin),
            _ => Some(Hidden::Codel),
        }
    }

    fn unresolved_operand(&mut self, function: Builtin, first: Option<&NameRef>) {
        let Some(NameRef { name, id }) = first else { return };
        let features = self.resolver.features.by_name.iter();
        let fitting = features.filter(|(_, found)| found.iter().any(|it| function.takes(it.kind)));
        let is_handler = function.operand() == Operand::Handler;
        let handlers = self.resolver.core.handlers.iter().map(|it| &it.name.name).filter(|_| is_handler);
        let near = similar(name, fitting.map(|(name, _)| name).chain(handlers));
        self.error(*id, FactKind::UnresolvedOperand { function, name: name.clone(), near });
    }

    /// Reports a wrong number of arguments; returns `is_correct`.
    fn check_count(&mut self, callee: &NameRef, takes: Takes, is_correct: bool, found: usize) -> bool {
        if !is_correct && self.completeness.is_complete() {
            let kind = FactKind::ArgumentCount { callee: callee.name.clone(), takes, found };
            self.report(callee.id, kind);
        }
        is_correct
    }

    /// Checks the arguments of a call of a codel or an operation, whose `parameters` are unknown if its signature has an error.
    fn call_arguments(
        &mut self,
        callee: &NameRef,
        parameters: Option<Vec<(Direction, Name, Type)>>,
        arguments: &[Expr],
        has_operand: bool,
    ) {
        let parameters = parameters.filter(|all| {
            let takes = Takes::Arguments(all.len());
            self.check_count(callee, takes, all.len() == arguments.len(), arguments.len())
        });
        let parameters = parameters.into_iter().flatten();
        let parameters: Vec<ParameterOf> =
            parameters.map(|(direction, name, ty)| (direction, ParameterName::Named(name), ty)).collect();
        let operands = usize::from(has_operand).min(arguments.len());
        let (operand, arguments) = arguments.split_at(operands);
        let (of_operand, parameters) = parameters.split_at(operands.min(parameters.len()));
        // The operand of a built-in function is not a call without parentheses.
        let program = (self.body, self.program);
        let problems = self.found.problems.get(&program).map_or(0, Vec::len);
        self.arguments(&callee.name, of_operand, operand);
        if let Some(all) = self.found.problems.get_mut(&program) {
            all.truncate(problems);
        }
        self.arguments(&callee.name, parameters, arguments);
    }

    /// Checks arguments against the parameters, as far as these are known.
    fn arguments(&mut self, callee: &Name, parameters: &[ParameterOf], arguments: &[Expr]) {
        for (index, argument) in arguments.iter().enumerate() {
            match parameters.get(index) {
                Some((Direction::In, name, ty)) => {
                    self.check(argument, ty, |expected, found| FactKind::ArgumentType {
                        callee: callee.clone(),
                        parameter: name.clone(),
                        expected,
                        found,
                    })
                }
                Some((_, name, ty)) => self.output(callee, name.clone(), ty, argument),
                None => _ = self.expr(argument),
            }
        }
    }

    fn output(&mut self, callee: &Name, parameter: ParameterName, expected: &Type, argument: &Expr) {
        let Some(id) = argument.id() else {
            _ = self.expr(argument);
            return;
        };
        let no_variable = FactKind::OutArgument { callee: callee.clone(), parameter: parameter.clone() };
        let Expr::Name(name) = argument else {
            self.expr(argument);
            self.report(id, no_variable);
            return;
        };
        match self.value(name, NameRole::Target) {
            Some(Binding::Variable(variable)) => {
                let Some(variable) = self.variable(variable) else { return };
                if matches!(variable.kind, VariableKind::Handler | VariableKind::Parameter(Direction::In)) {
                    self.report(id, no_variable);
                } else if !variable.ty.is(expected) {
                    let (callee, expected, found) = (callee.clone(), expected.clone(), variable.ty.clone());
                    self.report(id, FactKind::ArgumentType { callee, parameter, expected, found });
                }
            }
            Some(Binding::Feature(feature)) if !feature.kind.is_operation() => self.report(id, no_variable),
            // Another fact reports that the operation is not called.
            Some(Binding::Feature(_)) | None => {}
        }
    }

    /// `read(port, variable)`, `write(port, value)`, `status(port)`
    fn port(&mut self, function: Builtin, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some(Expr::Name(port)) = arguments.first() else { return Type::Unknown };
        let mut ty = Type::Unknown;
        if let Some(&feature) = self.resolver.features.get(&port.name) {
            self.bindings.insert(port.id, Binding::Feature(feature));
            ty = feature.ty(self.db, self.project);
            if function.operand() != Operand::Port(feature.kind) {
                let kind = FactKind::PortDirection { function, port: port.name.clone(), is: feature.kind };
                self.report(port.id, kind);
            }
        }
        let count = if function == Builtin::Status { 1 } else { 2 };
        let is_correct =
            self.check_count(callee, Takes::Port(function), arguments.len() == count, arguments.len());
        for argument in arguments.iter().skip(1) {
            match function {
                Builtin::Read if is_correct => {
                    self.output(&callee.name, ParameterName::Named(port.name.clone()), &ty, argument);
                }
                Builtin::Write if is_correct => self.assigned(&port.name, &ty, argument),
                _ => _ = self.expr(argument),
            }
        }
        match function {
            Builtin::Write => Type::Void,
            // One mistake gives one diagnostic.
            _ if !is_correct => Type::Unknown,
            _ => Type::PortStatus,
        }
    }

    /// `send(operation, in and inout arguments…)`
    fn send(&mut self, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some((Expr::Name(operation), rest)) = arguments.split_first() else { return Type::Unknown };
        let Some((signature, _)) = self.declared(&operation.name, FeatureKind::Required) else {
            self.arguments(&operation.name, &[], rest);
            return Type::Unknown;
        };
        if let Some(&feature) = self.resolver.features.get(&operation.name) {
            self.bindings.insert(operation.id, Binding::Feature(feature));
        }
        let inputs = signature.parameters.into_iter().filter(|(direction, ..)| *direction != Direction::Out);
        let inputs: Vec<ParameterOf> =
            inputs.map(|(_, name, ty)| (Direction::In, ParameterName::Named(name), ty)).collect();
        let takes = Takes::Send { operation: operation.name.clone(), values: inputs.len() };
        let is_correct = self.check_count(callee, takes, rest.len() == inputs.len(), rest.len());
        self.arguments(&operation.name, if is_correct { &inputs } else { &[] }, rest);
        Type::Handle(operation.name.clone())
    }

    /// `collect(handler)`, `collect(handler, result and out variables…)`
    fn collect(&mut self, callee: &NameRef, arguments: &[Expr]) -> Type {
        let Some((Expr::Name(handler), rest)) = arguments.split_first() else { return Type::Unknown };
        self.bind(handler);
        let index = self.resolver.shared.handlers.get(&handler.name);
        let of = index.and_then(|&index| self.resolver.core.handlers.get(index));
        let operation = of.and_then(|it| it.operation.as_ref()?.path.last());
        let declared = operation.and_then(|name| self.declared(name, FeatureKind::Required));
        let Some((signature, _)) = declared else {
            self.arguments(&callee.name, &[], rest);
            return Type::CallStatus;
        };
        let result = Some(signature.result).filter(|result| *result != Type::Void);
        let result = result.map(|ty| (Direction::Out, ParameterName::Result, ty));
        let outputs = signature.parameters.into_iter().filter(|(direction, ..)| *direction != Direction::In);
        let outputs = outputs.map(|(_, name, ty)| (Direction::Out, ParameterName::Named(name), ty));
        let outputs: Vec<ParameterOf> = result.into_iter().chain(outputs).collect();
        let takes = Takes::Collect { values: outputs.len() };
        let is_correct = rest.is_empty() || rest.len() == outputs.len();
        let is_correct = self.check_count(callee, takes, is_correct, rest.len());
        self.arguments(&callee.name, if is_correct { &outputs } else { &[] }, rest);
        Type::CallStatus
    }
}

/// The direction in which an argument is passed, its parameter, and the type of the parameter.
type ParameterOf = (Direction, ParameterName, Type);

/// Returns the first argument if it is a name.
fn first_name(arguments: &[Expr]) -> Option<&NameRef> {
    match arguments.first() {
        Some(Expr::Name(name)) => Some(name),
        _ => None,
    }
}
