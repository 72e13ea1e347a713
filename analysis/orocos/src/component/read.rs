//! What a component has: read from its shells, its core and what its programs use.

use std::cell::Cell;

use mauve_hir::item_tree::{Direction, Expr, FeatureKind, HookKind, SourceId, Statement};
use mauve_hir::{
    Binding, Builtin, Callee, Decl, FeatureOf, ProgramId, Type, VariableId, VariableKind, core, core_of,
    external_types, inference_of_core, shell_of, values_of_shell,
};
use rustc_hash::{FxHashMap, FxHashSet};

use super::{Class, ClassMachine, ClassMember, LastCall, Routine, RoutineBody, SentOperation};
use crate::cpp_name::CppNames;
use crate::library::Model;

impl<'a, 'db> Class<'a, 'db> {
    pub(super) fn new(model: Model<'a, 'db>, component: Decl<'db>, name: &str) -> Option<Class<'a, 'db>> {
        let Model { db, project, .. } = model;
        db.unwind_if_revision_cancelled();
        let of = core_of(db, project, component)?;
        let data = core(db, of)?;
        let mut names = CppNames::of_component();
        names.declare(name);
        names.declare(&model.library.package);
        for it in ["COMPONENT", "PROGRAM", "CODEL", "READ", "WRITE"] {
            names.declare(&format!("MAUVE_TRACE_{it}"));
        }
        // A member would hide a type of the same name.
        for external in external_types(db, model.workspace()).values() {
            let words = external.cpp.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            words.filter(|word| !word.is_empty()).for_each(|word| drop(names.declare(word)));
        }
        let mut class = Class {
            model,
            component,
            core: of,
            data,
            inference: inference_of_core(db, project, of),
            name: name.to_owned(),
            members: Vec::new(),
            by_feature: FxHashMap::default(),
            by_name: FxHashMap::default(),
            variables: FxHashMap::default(),
            sent: Vec::new(),
            sent_numbers: FxHashMap::default(),
            programs: Vec::new(),
            by_id: FxHashMap::default(),
            machine: None,
            introspection: model.config().introspection != Some(false),
            samples: Vec::new(),
            instance: String::new(),
            read: FxHashSet::default(),
            named: FxHashSet::default(),
            by_source: FxHashMap::default(),
            names,
            is_obvious: Cell::default(),
        };
        class.features(shell_of(db, project, component)?);
        class.variables();
        class.uses();
        class.programs();
        class.instance = class.names.inner().declare("name");
        Some(class)
    }

    fn features(&mut self, shell: Decl<'db>) {
        let Model { db, project, .. } = self.model;
        let values = values_of_shell(db, project, shell);
        for feature in self.model.features(self.component) {
            let Some(data) = feature.data(db) else { continue };
            let number = self.members.len();
            self.by_feature.entry(*feature).or_insert(number);
            self.by_name.entry(&data.name.name).or_insert(number);
            self.members.push(ClassMember {
                feature: *feature,
                data,
                name: self.names.declare(&data.name.name),
                ty: self.model.type_of(feature.shell, data.ty.as_ref()),
                property: None,
                status: None,
                parameters: self.model.parameters(feature.shell, &data.parameters),
                value: values.get(&data.name.name).cloned(),
            });
        }
        for member in &mut self.members {
            if member.data.kind == FeatureKind::Constant {
                member.property = Some(self.names.declare(&format!("{}_property", member.data.name.name)));
            }
        }
    }

    fn variables(&mut self) {
        for (id, variable) in self.inference.variables() {
            self.by_source.insert(variable.name.id, id);
            if matches!(variable.kind, VariableKind::Core | VariableKind::Machine | VariableKind::Handler) {
                self.variables.insert(id, self.names.declare(&variable.name.name));
            }
        }
    }

    /// Collects what programs use: variables, the statuses of ports, values that vary in size, required operations.
    fn uses(&mut self) {
        let assigned = self.data.statements().filter_map(|statement| match statement {
            Statement::Assign(target, _) => Some(target.id),
            _ => None,
        });
        let assigned: FxHashSet<SourceId> = assigned.collect();
        for (id, binding) in self.inference.bindings() {
            if let Binding::Variable(variable) = binding {
                self.named.insert(variable);
                if !assigned.contains(&id) {
                    self.read.insert(variable);
                }
            }
        }
        let statuses = self.calls_of(Builtin::Status).filter_map(|it| self.feature_in(it));
        let statuses: FxHashSet<FeatureOf<'db>> = statuses.collect();
        for member in &mut self.members {
            if statuses.contains(&member.feature) {
                member.status = Some(self.names.declare(&format!("{}_status", member.data.name.name)));
            }
        }
        self.samples = self.calls_of(Builtin::Write).filter_map(|it| self.sample(it)).collect();
        self.samples.sort();
        self.samples.dedup_by(|second, first| second.0 == first.0);
        self.sent_operations();
    }

    fn calls_of(&self, function: Builtin) -> impl Iterator<Item = &'db [Expr]> {
        let expressions = self.data.expressions().flat_map(Expr::descendants);
        expressions.filter_map(move |expr| self.arguments_of(function, expr))
    }

    fn arguments_of(&self, function: Builtin, expr: &'db Expr) -> Option<&'db [Expr]> {
        match expr {
            Expr::Call { callee, arguments, .. } => {
                let is_called = self.inference.callee(callee.id) == Some(Callee::Builtin(function));
                is_called.then_some(&**arguments)
            }
            _ => None,
        }
    }

    /// Returns the port and the variable of the core of `write(port, variable)`, where its values vary in size.
    fn sample(&self, arguments: &[Expr]) -> Option<(String, VariableId)> {
        let [_, value] = arguments else { return None };
        let member = self.member_in(arguments)?;
        let variable = self.inference.variable_at(value.id()?)?;
        let is_core = self.inference.variable(variable)?.kind == VariableKind::Core;
        let varies = matches!(member.ty, Type::String | Type::Message(..));
        (is_core && varies).then(|| (member.name.clone(), variable))
    }

    fn sent_operations(&mut self) {
        let mut handlers: FxHashSet<VariableId> = FxHashSet::default();
        let mut dropped: Vec<&ClassMember<'db>> = Vec::new();
        let mut seen: FxHashSet<FeatureOf<'db>> = FxHashSet::default();
        for statement in self.data.statements() {
            match statement {
                Statement::Assign(target, value) if self.arguments_of(Builtin::Send, value).is_some() => {
                    handlers.extend(self.inference.variable_at(target.id));
                }
                Statement::Expr(value) => {
                    let arguments = self.arguments_of(Builtin::Send, value);
                    let member = arguments.and_then(|it| self.member_in(it));
                    dropped.extend(member.filter(|it| seen.insert(it.feature)));
                }
                _ => {}
            }
        }
        let handled = self.inference.variables().filter(|(id, _)| handlers.contains(id));
        let handled = handled.filter_map(|(id, variable)| {
            Some((Some(id), self.member_of_handle(&variable.ty)?, &variable.name.name))
        });
        let dropped = dropped.into_iter().map(|member| (None, member, &member.data.name.name));
        let mut names = self.names.clone();
        let mut sent = Vec::new();
        for (handler, member, name) in handled.chain(dropped) {
            let goes_both_ways =
                member.parameters.iter().any(|(direction, _)| *direction == Direction::InOut);
            let last_call = goes_both_ways.then(|| LastCall {
                handle: names.declare(&format!("{name}_last_call")),
                is_under_way: names.declare(&format!("is_{name}_under_way")),
            });
            let operation = SentOperation { handler, feature: member.feature, slots: Vec::new(), last_call };
            sent.push((operation, member, name));
        }
        for (operation, member, name) in &mut sent {
            let parameters = member.parameters.iter().zip(&member.data.parameters).enumerate();
            let results = parameters.filter(|(_, ((direction, _), _))| *direction != Direction::In);
            operation.slots.extend(results.map(|(number, ((_, ty), data))| {
                (number, ty.clone(), names.declare(&format!("{name}_{}", data.name.name)))
            }));
        }
        self.sent = sent.into_iter().map(|(operation, ..)| operation).collect();
        let numbers = self.sent.iter().enumerate().rev();
        self.sent_numbers = numbers.map(|(number, it)| ((it.handler, it.feature), number)).collect();
        self.names = names;
    }

    fn programs(&mut self) {
        let data = self.data;
        for hook in &data.hooks {
            let result = match hook.kind {
                HookKind::Configure | HookKind::Start => Type::Bool,
                HookKind::Update | HookKind::Stop | HookKind::Cleanup => Type::Void,
            };
            self.routine(ProgramId::Hook(hook.kind), hook.id, result, RoutineBody::Program(&hook.program));
        }
        for operation in &data.operations {
            let name = &operation.name.name;
            let declared = self.named_member(name);
            // The parameter has the name of the feature.
            let function = declared.map(|member| member.name.clone());
            let result = match (&operation.result, declared) {
                (None, Some(member)) => member.ty.clone(),
                (result, _) => self.model.type_of(self.core, result.as_ref()),
            };
            let called = function.is_some().then(|| self.names.declare(&format!("call_{name}")));
            let function = function.unwrap_or_else(|| self.names.declare(name));
            self.add(Routine {
                function,
                called,
                program: ProgramId::Operation(name.clone()),
                at: operation.name.id,
                result,
                parameters: &operation.parameters,
                body: RoutineBody::Program(&operation.program),
            });
        }
        let Some(machine) = data.machines.first() else { return };
        for declared in &machine.states {
            let state = || declared.name.name.clone();
            for method in &declared.methods {
                let id = ProgramId::Method { state: state(), kind: method.kind };
                self.routine(id, method.id, Type::Void, RoutineBody::Program(&method.program));
            }
            for it in &declared.transitions {
                let (transition, at) = (|| it.name.name.clone(), it.name.id);
                if let Some(guard) = &it.guard {
                    let id = ProgramId::Guard { state: state(), transition: transition() };
                    self.routine(id, at, Type::Bool, RoutineBody::Guard(&guard.condition));
                }
                if let Some(effect) = &it.effect {
                    let id = ProgramId::Effect { state: state(), transition: transition() };
                    self.routine(id, at, Type::Void, RoutineBody::Program(effect));
                }
            }
        }
        let mut values = CppNames::of_namespace();
        self.machine = Some(ClassMachine {
            data: machine,
            numbers: machine.state_indices(),
            states: self.names.declare("State"),
            values: machine.states.iter().map(|state| values.declare(&state.name.name)).collect(),
            current: self.names.declare("current_state"),
            show: self.introspection.then(|| self.names.declare("show_state")),
            initial: machine.states.iter().position(|state| state.initial).unwrap_or_default(),
        });
    }

    fn routine(&mut self, program: ProgramId, at: SourceId, result: Type, body: RoutineBody<'db>) {
        let function = self.names.declare(&match &program {
            ProgramId::Hook(kind) => format!("{}_program", kind.keyword()),
            ProgramId::Operation(name) => name.to_string(),
            ProgramId::Method { state, kind } => format!("{}_{state}", kind.keyword()),
            ProgramId::Guard { state, transition } => format!("guard_{state}_{transition}"),
            ProgramId::Effect { state, transition } => format!("effect_{state}_{transition}"),
        });
        self.add(Routine { function, called: None, program, at, result, parameters: &[], body });
    }

    fn add(&mut self, routine: Routine<'db>) {
        self.by_id.insert(routine.program.clone(), self.programs.len());
        self.programs.push(routine);
    }
}
