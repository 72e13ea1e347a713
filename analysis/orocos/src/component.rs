//! The C++ class of a component: `<Component>/<Component>-component.hpp` and `.cpp`.
//!
//! ```text
//! component Guidance(GuidanceShell, GuidanceCore)
//!     → class Guidance : public RTT::TaskContext, with a member for each feature of the shell and each variable of the core,
//!       and a private member function for each program: run_Steering(), guard_Steering_boxed_in(), …
//! ```
//!
//! | file | makes |
//! |---|---|
//! | `component.rs` | what the class has, and how it is called in C++ |
//! | `component/files.rs` | the files of all classes |
//! | `component/header.rs` | the declaration of the class |
//! | `component/source.rs` | its constructor, its hooks, its state machine |
//! | `component/program.rs` | the statements of its programs |
//! | `component/expression.rs` | expressions, evaluated as MAUVE says |
//! | `component/code.rs` | the text of an expression, with its type and its value |
//! | `component/obvious.rs` | what compilers would warn of, and is meant |
//! | `component/layout.rs` | lines that are not too long |

mod code;
mod expression;
mod files;
mod header;
mod layout;
mod obvious;
mod program;
mod source;

use std::cell::Cell;

use mauve_hir::item_tree::{
    Core, Direction, Expr, Feature, FeatureKind, HookKind, Machine, Name, Parameter, Program, SourceId,
    Statement, Variable,
};
use mauve_hir::{
    Binding, Builtin, Callee, CoreInference, Decl, Integer, Location, ProgramId, Type, Value, VariableId,
    VariableKind, core, core_of, external_types, inference_of_core, shell_of, values_of_shell,
};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::cpp_name::CppNames;
use crate::cpp_type::{cpp_type, is_large, operation_parameter_type};
use crate::escape::comment;
use crate::library::Model;
use crate::origin::origin;

pub(crate) use files::component_files;
pub(crate) use source::ports_of_introspection;

/// A component as a class, with the names that its features and variables have in C++.
struct Class<'a, 'db> {
    model: Model<'a, 'db>,
    component: Decl<'db>,
    core: Decl<'db>,
    data: &'db Core,
    inference: CoreInference<'db>,
    name: String,
    /// The features, those of extended shells first.
    members: Vec<Member<'db>>,
    /// The numbers of the features in `members`, by their place in the model, and of the first one of each name.
    by_feature: FxHashMap<(Decl<'db>, usize), usize>,
    by_name: FxHashMap<&'db Name, usize>,
    /// The names of the variables and handlers of the core and of its machine.
    variables: FxHashMap<VariableId, String>,
    sent: Vec<SentOperation<'db>>,
    /// The numbers of these, by the handler and the operation.
    sent_numbers: FxHashMap<(Option<VariableId>, Decl<'db>, usize), usize>,
    programs: Vec<Routine<'db>>,
    by_id: FxHashMap<ProgramId, usize>,
    machine: Option<StateMachine<'db>>,
    /// Whether ports show its state and its execution times.
    introspection: bool,
    /// The output ports whose values vary in size, each with a variable of the core that is written to it.
    samples: Vec<(String, VariableId)>,
    instance: String,
    /// Variables that a program reads, or passes by reference.
    read: FxHashSet<VariableId>,
    named: FxHashSet<VariableId>,
    by_source: FxHashMap<SourceId, VariableId>,
    names: CppNames<'static>,
    /// Whether a condition is always true, or never.
    is_obvious: Cell<bool>,
}

/// A feature of the shell.
struct Member<'db> {
    shell: Decl<'db>,
    index: usize,
    data: &'db Feature,
    name: String,
    /// The type of its value; for an operation, the type of the result.
    ty: Type,
    /// For a constant: the property from which its value is frozen.
    property: Option<String>,
    /// For an input port: the variable for the status of its last `read`, if a program uses it.
    status: Option<String>,
    parameters: Vec<(Direction, Type)>,
    /// For a property or a constant: its default.
    value: Option<Value>,
}

impl Member<'_> {
    /// Returns the name of the property that scripts set.
    fn property(&self) -> &str {
        self.property.as_ref().unwrap_or(&self.name)
    }
}

/// A required operation that a program sends, with one handler or without any.
struct SentOperation<'db> {
    /// `None` if the result is discarded.
    handler: Option<VariableId>,
    shell: Decl<'db>,
    index: usize,
    /// The variables that the owner of the operation writes its `out` and `inout` parameters to, with the numbers of these
    /// parameters. They live as long as a call may be running.
    ///
    /// Of two calls with the same slots, the owner writes those of the second one after all of the first one, since it
    /// executes calls in order. Nothing reads them before the second one has ended, as its handle has replaced the first
    /// one's.
    slots: Vec<(usize, Type, String)>,
    /// The last call, if the operation has `inout` parameters.
    last_call: Option<LastCall>,
}

/// The last call with the slots of an `inout` parameter. While it is running, the provider may read and write them,
/// so no other call is sent with them. A handler cannot track this: it may be reassigned, and there may be none.
struct LastCall {
    handle: String,
    /// The function that returns whether it is running.
    is_under_way: String,
}

struct StateMachine<'db> {
    data: &'db Machine,
    /// The index of the first state of each name.
    numbers: FxHashMap<&'db Name, usize>,
    /// The enumeration of its states.
    states: String,
    /// Its values, in the order of the states.
    values: Vec<String>,
    /// The variable that holds the current state.
    current: String,
    /// The function that writes it to the state port, if there is one.
    show: Option<String>,
    initial: usize,
}

/// A program as a member function.
struct Routine<'db> {
    function: String,
    /// For a provided operation: the function that other components call.
    called: Option<String>,
    program: ProgramId,
    at: SourceId,
    result: Type,
    parameters: &'db [Parameter],
    body: Body<'db>,
}

struct CppParameter {
    /// `None` if no program uses it.
    index: Option<VariableId>,
    name: String,
    /// Its type and, where a program uses it, its name.
    declared: String,
    /// Its type and its name.
    named: String,
    is_large: bool,
}

enum Body<'db> {
    Program(&'db Program),
    Guard(&'db Expr),
}

impl<'a, 'db> Class<'a, 'db> {
    fn new(model: Model<'a, 'db>, component: Decl<'db>, name: &str) -> Option<Class<'a, 'db>> {
        let Model { db, project, .. } = model;
        db.unwind_if_revision_cancelled();
        let of = core_of(db, project, component)?;
        let data = core(db, of)?;
        let mut names = CppNames::of_component();
        names.declare(name);
        names.declare(&model.library.package);
        let macros = ["MAUVE_TRACE_COMPONENT", "MAUVE_TRACE_PROGRAM", "MAUVE_TRACE_CODEL"];
        macros.iter().for_each(|it| drop(names.declare(it)));
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
            self.by_feature.entry((feature.shell, feature.index as usize)).or_insert(number);
            self.by_name.entry(&data.name.name).or_insert(number);
            self.members.push(Member {
                shell: feature.shell,
                index: feature.index as usize,
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
        let statuses: FxHashSet<(Decl<'db>, usize)> = statuses.collect();
        for member in &mut self.members {
            if statuses.contains(&(member.shell, member.index)) {
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
                is_called.then_some(arguments.as_slice())
            }
            _ => None,
        }
    }

    /// Returns the feature that the first argument of a built-in function names.
    fn feature_in(&self, arguments: &[Expr]) -> Option<(Decl<'db>, usize)> {
        match self.inference.binding(arguments.first()?.id()?)? {
            Binding::Feature(feature) => Some((feature.shell, feature.index as usize)),
            Binding::Variable(_) => None,
        }
    }

    fn member_in(&self, arguments: &[Expr]) -> Option<&Member<'db>> {
        let (shell, index) = self.feature_in(arguments)?;
        self.member(shell, index)
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
        let mut dropped: Vec<&Member<'db>> = Vec::new();
        let mut seen: FxHashSet<(Decl<'db>, usize)> = FxHashSet::default();
        for statement in self.data.statements() {
            match statement {
                Statement::Assign(target, value) if self.arguments_of(Builtin::Send, value).is_some() => {
                    handlers.extend(self.inference.variable_at(target.id));
                }
                Statement::Expr(value) => {
                    let arguments = self.arguments_of(Builtin::Send, value);
                    let member = arguments.and_then(|it| self.member_in(it));
                    dropped.extend(member.filter(|it| seen.insert((it.shell, it.index))));
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
            let (shell, index) = (member.shell, member.index);
            let operation = SentOperation { handler, shell, index, slots: Vec::new(), last_call };
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
        self.sent_numbers = numbers.map(|(number, it)| ((it.handler, it.shell, it.index), number)).collect();
        self.names = names;
    }

    fn programs(&mut self) {
        let data = self.data;
        for hook in &data.hooks {
            let result = match hook.kind {
                HookKind::Configure | HookKind::Start => Type::Bool,
                HookKind::Update | HookKind::Stop | HookKind::Cleanup => Type::Void,
            };
            self.routine(ProgramId::Hook(hook.kind), hook.id, result, Body::Program(&hook.program));
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
                body: Body::Program(&operation.program),
            });
        }
        let Some(machine) = data.machines.first() else { return };
        for declared in &machine.states {
            let state = || declared.name.name.clone();
            for method in &declared.methods {
                let id = ProgramId::Method { state: state(), kind: method.kind };
                self.routine(id, method.id, Type::Void, Body::Program(&method.program));
            }
            for it in &declared.transitions {
                let (transition, at) = (|| it.name.name.clone(), it.name.id);
                if let Some(guard) = &it.guard {
                    let id = ProgramId::Guard { state: state(), transition: transition() };
                    self.routine(id, at, Type::Bool, Body::Guard(&guard.condition));
                }
                if let Some(effect) = &it.effect {
                    let id = ProgramId::Effect { state: state(), transition: transition() };
                    self.routine(id, at, Type::Void, Body::Program(effect));
                }
            }
        }
        let mut values = CppNames::of_namespace();
        self.machine = Some(StateMachine {
            data: machine,
            numbers: machine.state_indices(),
            states: self.names.declare("State"),
            values: machine.states.iter().map(|state| values.declare(&state.name.name)).collect(),
            current: self.names.declare("current_state"),
            show: self.introspection.then(|| self.names.declare("show_state")),
            initial: machine.states.iter().position(|state| state.initial).unwrap_or_default(),
        });
    }

    fn routine(&mut self, program: ProgramId, at: SourceId, result: Type, body: Body<'db>) {
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

    fn member(&self, shell: Decl<'db>, index: usize) -> Option<&Member<'db>> {
        self.members.get(*self.by_feature.get(&(shell, index))?)
    }

    /// Returns what a `send` of an operation needs, with this handler or without any.
    fn sent_by(&self, handler: Option<VariableId>, operation: &Member<'db>) -> Option<&SentOperation<'db>> {
        self.sent.get(*self.sent_numbers.get(&(handler, operation.shell, operation.index))?)
    }

    fn named_member(&self, name: &Name) -> Option<&Member<'db>> {
        self.members.get(*self.by_name.get(name)?)
    }

    fn member_of_handle(&self, ty: &Type) -> Option<&Member<'db>> {
        match ty {
            Type::Handle(operation) => self.named_member(operation),
            _ => None,
        }
    }

    /// Records that a condition may be constant.
    fn note(&self, is_obvious: bool) {
        self.is_obvious.set(self.is_obvious.get() || is_obvious);
    }

    fn set_from_text(&self) -> Vec<&Member<'db>> {
        self.members.iter().filter(|it| it.data.kind.is_value() && is_set_from_text(&it.ty)).collect()
    }

    fn program(&self, id: &ProgramId) -> Option<&Routine<'db>> {
        self.by_id.get(id).and_then(|index| self.programs.get(*index))
    }

    /// Returns a type in C++. All types are known: models with unknown types are refused before.
    fn cpp(&self, ty: &Type) -> String {
        match ty {
            Type::Handle(_) => {
                let signature = self.member_of_handle(ty).map(|it| self.signature(it));
                format!("RTT::SendHandle<{}>", signature.unwrap_or_default())
            }
            ty => cpp_type(self.model.db, self.model.workspace(), ty).unwrap_or_else(|| "void*".to_owned()),
        }
    }

    /// The type of an operation: `bool(double, ::nav_msgs::Path&)`.
    fn signature(&self, operation: &Member<'db>) -> String {
        let parameter =
            |(direction, ty): &(Direction, Type)| operation_parameter_type(&self.cpp(ty), *direction);
        let parameters: Vec<String> = operation.parameters.iter().map(parameter).collect();
        format!("{}({})", self.cpp(&operation.ty), parameters.join(", "))
    }

    /// Returns the parameters of a program, and declares their names.
    fn parameters(&self, of: &Routine<'db>, names: &mut CppNames<'_>) -> Vec<CppParameter> {
        let types = self.model.parameters(self.core, of.parameters);
        let parameter = |(it, (direction, ty)): (&Parameter, (Direction, Type))| {
            let cpp = operation_parameter_type(&self.cpp(&ty), direction);
            let index = self.variable_at(it.name.id).filter(|index| self.named.contains(index));
            let name = names.declare(&it.name.name);
            let named = format!("{cpp} {name}");
            // Compilers warn about unused named parameters.
            let declared = if index.is_some() { named.clone() } else { format!("{cpp} /*{name}*/") };
            CppParameter { index, name, declared, named, is_large: is_large(&ty) }
        };
        of.parameters.iter().zip(types).map(parameter).collect()
    }

    fn variable_at(&self, id: SourceId) -> Option<VariableId> {
        self.by_source.get(&id).copied()
    }

    /// Returns a location as comments show it: `components/guidance.mal:25`.
    fn at(&self, of: Decl<'db>, id: SourceId) -> String {
        origin(self.model.db, self.model.workspace(), &Location::Source(of, id))
    }

    /// Returns the text of the model at a location.
    fn source(&self, of: Decl<'db>, id: SourceId) -> String {
        let db = self.model.db;
        let range = Location::Source(of, id).range(db);
        comment(of.file(db).text(db).get(std::ops::Range::<usize>::from(range)).unwrap_or_default())
    }

    /// `core GuidanceCore: components/guidance.mal:33`
    fn declared(&self, of: Decl<'db>) -> String {
        let db = self.model.db;
        format!("{} {}: {}", of.kind(db), of.name(db), self.at(of, SourceId(0)))
    }

    /// The variables of the core or of its machine, with their numbers and names in C++.
    fn variables_of(&self, all: &'db [Variable]) -> Vec<(VariableId, &'db Variable, &str)> {
        let found = all.iter().filter_map(|variable| {
            let index = self.variable_at(variable.name.id)?;
            Some((index, variable, self.variables.get(&index)?.as_str()))
        });
        found.collect()
    }

    fn type_of_variable(&self, id: VariableId) -> Type {
        self.inference.variable(id).map_or(Type::Unknown, |variable| variable.ty.clone())
    }
}

/// Returns whether RTT's scripts cannot set a property of this type: the only integers they know are `int` and `uint`.
pub(crate) fn is_set_from_text(ty: &Type) -> bool {
    matches!(ty, Type::Integer(integer) if !matches!(integer, Integer::Int | Integer::Uint32))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use expect_test::{Expect, expect};
    use mauve_hir::{Database, Workspace, projects};

    use crate::packages;

    /// The text of a component's file, of a model's only project.
    fn generated(texts: Vec<(PathBuf, String)>, end: &str) -> Vec<(String, String)> {
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let project = projects(&db, workspace)[0];
        let packages = packages(&db, project, None).unwrap();
        let files = packages.into_iter().flat_map(|package| package.files);
        let files = files.filter(|file| file.path.ends_with(end));
        files.map(|file| (file.path, file.text)).collect()
    }

    /// What stands in the file of a model's one component from a line that has `from` to an empty line.
    fn shown(model: &str, end: &str, from: &[&str]) -> String {
        let texts = mauve_tests::fixture(model).into_iter().map(|(path, text)| (path.into(), text));
        let files = generated(texts.collect(), end);
        let [(_, text)] = files.as_slice() else { panic!("{files:?}") };
        let mut shown = String::new();
        for from in from {
            let begin = text.find(from).unwrap_or_else(|| panic!("no {from} in {text}"));
            let begin = text[..begin].rfind('\n').map_or(0, |line| line + 1);
            let rest = &text[begin..];
            shown += &rest[..rest.find("\n\n").map_or(rest.len(), |end| end + 1)];
        }
        shown
    }

    fn check(model: &str, end: &str, from: &[&str], expected: Expect) {
        expected.assert_eq(&shown(model, end, from));
    }

    /// The program `update` of a core with some of everything.
    fn check_update(program: &str, expected: Expect) {
        let model = format!(
            "library lab {{
  codel count(in n: int): int
  codel tick(inout n: int): int
  codel two(in a: int, in b: int): int
  codel flag(): bool
  codel tell(in text: string, out other: string): void
  shell S {{
    property limit: double = 1
    input port goal: int
    output port next: double
    provide halt(): bool
  }}
  core C(S) {{
    var n: int = 1
    var m: int = 1
    var x: double = 0
    var f: float = 0
    var u: uint8 = 0
    var w: uint32 = 0
    var z: size_t = 0
    var b: bool = true
    var t: string = \"\"
    provide halt() = {{ n = 0; return b; }}
    update = {{ {program} }}
  }}
  component K(S, C)
}}"
        );
        let shown = shown(&model, "component.cpp", &["void K::update_program"]);
        let lines: Vec<&str> = shown.lines().collect();
        let lines: Vec<String> =
            lines[2..lines.len() - 1].iter().map(|line| format!("{}\n", &line[2..])).collect();
        expected.assert_eq(&lines.concat());
    }

    #[test]
    fn a_state_machine_is_a_switch() {
        check(
            "library motion {
  codel look(): bool
  shell S { provide reset(): void }
  core C(S) {
    var seen: int = 3
    var gap: double
    provide reset() = { index = 0; }
    start = { return look(); }
    statemachine {
      var index: int = seen + 1
      initial state Waiting {
        entry = { seen = 0; }
        run = { }
        exit = { seen = 1; }
        transition go if look() to Moving { index = 2; }
        transition again if index > 3 to Waiting
        handle = { gap = 0; }
      }
      state Moving {
        transition done to Waiting
        transition never if (gap > 1) to Moving
      }
    }
  }
  component Walker(S, C)
}",
            "component.cpp",
            &["Walker::configureHook", "Walker::startHook", "Walker::updateHook", "guard_Waiting_again() {"],
            expect![[r#"
                bool Walker::configureHook() {
                  seen = 3;
                  gap = {};
                  return true;
                }
                bool Walker::startHook() {
                  if (!mauve_may_start()) return false;
                  index = seen + 1;
                  if (!start_program()) {
                    RTT::log(RTT::Error) << getName() << ": the program start returned false" << RTT::endlog();
                    return false;
                  }
                  current_state = State::Waiting;
                  entry_Waiting();
                  show_state();
                  mauve_started();
                  return true;
                }
                void Walker::updateHook() {
                  if (!mauve_begin()) return;
                  MAUVE_TRACE_COMPONENT(getName());
                  switch (current_state) {
                    case State::Waiting:
                      run_Waiting();
                      if (guard_Waiting_go()) {
                        exit_Waiting();
                        effect_Waiting_go();
                        current_state = State::Moving;
                      } else if (guard_Waiting_again()) {
                        exit_Waiting();
                        current_state = State::Waiting;
                        entry_Waiting();
                      } else {
                        handle_Waiting();
                      }
                      break;
                    case State::Moving:
                      current_state = State::Waiting;
                      entry_Waiting();
                      // transition never is never taken: model.mal:21
                      break;
                  }
                  show_state();
                  mauve_end();
                }
                bool Walker::guard_Waiting_again() {
                  MAUVE_TRACE_PROGRAM(getName(), "motion.Walker", "Waiting", "again", "guard");
                  return index > 3;
                }
            "#]],
        );
    }

    #[test]
    fn a_shell_is_checked_and_frozen() {
        let model = "library motion {
  shell Base { property name: string = \"arm\" + \"_1\" }
  shell S extends Base {
    // In metres.
    property gap: double [0; 2 * width] = 0.5
    property led: uint8 [0; 7] = 3
    constant width: double = 0.38 + 0.1
    property class: string
    input port scan: LaserScan
    output port to: float
  }
  core C(S) {
    var echoes: LaserScan
    var spare: int
    update = { if (read(scan, echoes) == new_data && status(scan) != no_data) then { write(to, 0.1); } else { } }
  }
  component K(S, C)
  use sensor_msgs
}";
        check(
            model,
            "component.hpp",
            &["class K", " protected", "shell S", "core C"],
            expect![[r#"
                class K : public MauveTask {
                 public:
                  explicit K(const std::string& name_);
                 protected:
                  bool configureHook() override;
                  bool startHook() override;
                  void updateHook() override;
                  void stopHook() override;
                  // shell S: model.mal:3
                  // property gap: double [0; 2 * width]: model.mal:5
                  double gap = 0.5;
                  // property led: uint8 [0; 7]: model.mal:6
                  std::uint8_t led = 3;
                  // constant width: double: model.mal:7
                  double width_property = 0.48;
                  double width = 0.48;  // the value that configureHook() found
                  // property class: string: model.mal:8
                  std::string class_{};
                  // input port scan: LaserScan: model.mal:9
                  RTT::InputPort<::sensor_msgs::LaserScan> scan;
                  RTT::FlowStatus scan_status = RTT::NoData;  // of the last read
                  // output port to: float: model.mal:10
                  RTT::OutputPort<float> to;
                  // core C: model.mal:12
                  ::sensor_msgs::LaserScan echoes{};  // model.mal:13
                  // spare: unused, model.mal:14
            "#]],
        );
        let from = ["K::K(", "K::configureHook", "K::update_program"];
        check(
            model,
            "component.cpp",
            &from,
            expect![[r#"
                K::K(const std::string& name_)
                    : MauveTask(name_) {
                  addProperty("name", name).doc("property name: string");
                  addProperty("gap", gap).doc("property gap: double [0; 2 * width]");
                  addProperty("led", led).doc("property led: uint8 [0; 7]");
                  addProperty("width", width_property).doc("constant width: double");
                  addProperty("class", class_).doc("property class: string");
                  addPort("scan", scan).doc("input port scan: LaserScan");
                  addPort("to_", to).doc("output port to: float");
                  addOperation("mauve_set", &K::mauve_set, this, RTT::ClientThread)
                      .doc("Sets properties of types that scripts cannot set.").arg("property", "")
                      .arg("text", "a whole number");
                  mauve_add_period_port("period");
                }
                bool K::configureHook() {
                  // property gap: double [0; 2 * width]: model.mal:5
                  if (!(gap >= 0.0 && gap <= 2 * width_property)) {
                    RTT::log(RTT::Error) << getName() << ": property gap is " << gap << ", and must be in [0; "
                                         << 2 * width_property << "]" << RTT::endlog();
                    return false;
                  }
                  // property led: uint8 [0; 7]: model.mal:6
                  if (!(led <= 7)) {
                    RTT::log(RTT::Error) << getName() << ": property led is " << static_cast<int>(led)
                                         << ", and must be in [0; 7]" << RTT::endlog();
                    return false;
                  }
                  // Constants keep their present values from here on.
                  width = width_property;
                  scan_status = RTT::NoData;
                  echoes = {};
                  return true;
                }
                void K::update_program() {
                  MAUVE_TRACE_PROGRAM(getName(), "motion.K", "", "", "update");
                  if ((scan_status = scan.read(echoes)) == RTT::NewData && scan_status != RTT::NoData) {
                    to.write(0.1f);
                  }
                }
            "#]],
        );
    }

    #[test]
    fn operations_are_provided_sent_and_collected() {
        let model = "library motion {
  shell S {
    require plan(in goal: int, out cost: double, inout way: string): int
    require land(): void
    provide reset(in hard: bool, in text: string, out was: int): bool
  }
  core C(S) {
    var n: int = 1
    var x: double = 0
    var t: string = \"\"
    handler planning: plan
    handler landing: land
    provide reset(in hard: bool, in text: string, out was: int) = { was = n; t = text; return true; }
    update = {
      planning = send(plan, n, t);
      send(plan, n + 1, t);
      landing = send(land);
      if (collect(planning, n, x, t) == success) then { reset(true, t, n); }
      else if (collect(planning) != failure) then { n = 1; } else { }
    }
  }
  component K(S, C)
}";
        let header = ["// shell S", "// core C", "// The results of", "// Calls with", "  bool is_planning"];
        check(
            model,
            "component.hpp",
            &header,
            expect![[r#"
                  // shell S: model.mal:2
                  // require plan(in goal: int, out cost: double, inout way: string): int: model.mal:3
                  RTT::OperationCaller<int(int, double&, std::string&)> plan;
                  // require land(): void: model.mal:4
                  RTT::OperationCaller<void()> land;
                  // core C: model.mal:7
                  int n = 1;                                                  // model.mal:8
                  double x = 0.0;                                             // model.mal:9
                  std::string t = "";                                         // model.mal:10
                  RTT::SendHandle<int(int, double&, std::string&)> planning;  // model.mal:11
                  RTT::SendHandle<void()> landing;                            // model.mal:12
                  // The results of operations that were sent, until they are collected.
                  double planning_cost{};
                  std::string planning_way{};
                  double plan_cost{};
                  std::string plan_way{};
                  // Calls with inout arguments: the next call is sent only after the last one has ended.
                  RTT::SendHandle<int(int, double&, std::string&)> planning_last_call;
                  RTT::SendHandle<int(int, double&, std::string&)> plan_last_call;
                  bool is_planning_under_way();
                  bool is_plan_under_way();
                  void update_program();
                  bool reset(bool /*hard*/, std::string text, int& was);
                  bool call_reset(bool hard, std::string text, int& was);
                };
            "#]],
        );
        let source =
            ["K::K(", "K::configureHook", "K::is_plan_under_way", "K::update_program", "K::reset(bool"];
        check(
            model,
            "component.cpp",
            &source,
            expect![[r#"
                K::K(const std::string& name)
                    : MauveTask(name),
                      plan("plan"),
                      land("land") {
                  this->requires()->addOperationCaller(plan);
                  this->requires()->addOperationCaller(land);
                  addOperation("reset", &K::call_reset, this, RTT::OwnThread)
                      .doc("provide reset(in hard: bool, in text: string, out was: int): bool")
                      .arg("hard", "in bool").arg("text", "in string").arg("was", "out int");
                  mauve_add_period_port("period");
                }
                bool K::configureHook() {
                  n = 1;
                  x = 0.0;
                  t = "";
                  planning = decltype(planning)();
                  landing = decltype(landing)();
                  return true;
                }
                bool K::is_plan_under_way() {
                  int dropped{};
                  double dropped_2{};
                  std::string dropped_3{};
                  return mauve_collect(plan_last_call, dropped, dropped_2, dropped_3) == RTT::SendNotReady;
                }
                void K::update_program() {
                  MAUVE_TRACE_PROGRAM(getName(), "motion.K", "", "", "update");
                  if (!is_planning_under_way()) {
                    planning_way = t;
                    planning_last_call = planning = mauve_send(plan, n, planning_cost, planning_way);
                  }
                  if (!is_plan_under_way()) {
                    plan_way = t;
                    plan_last_call = mauve_send(plan, n + 1, plan_cost, plan_way);
                  }
                  landing = mauve_send(land);
                  if (mauve_collect(planning, n, x, t) == RTT::SendSuccess) {
                    const auto t_before = t;
                    reset(true, t_before, n);
                  } else {
                    int dropped{};
                    double dropped_2{};
                    std::string dropped_3{};
                    if (mauve_collect(planning, dropped, dropped_2, dropped_3) > RTT::SendFailure) {
                      n = 1;
                    }
                  }
                }
                bool K::reset(bool /*hard*/, std::string text, int& was) {
                  MAUVE_TRACE_PROGRAM(getName(), "motion.K", "", "reset", "operation");
                  was = n;
                  t = text;
                  return true;
                }
            "#]],
        );
    }

    #[test]
    fn what_is_left_to_cpp_is_evaluated_from_left_to_right() {
        check_update(
            "n = two(count(1), count(2));",
            expect![[r#"
            const auto count_result = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(1));
            const auto count_result_2 = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(2));
            n = MAUVE_TRACE_CODEL(getName(), "lab.two", ::lab::two(count_result, count_result_2));
        "#]],
        );
        check_update(
            "n = n + tick(n);",
            expect![[r#"
            const auto n_before = n;
            n = n_before + MAUVE_TRACE_CODEL(getName(), "lab.tick", ::lab::tick(n));
        "#]],
        );
        check_update(
            "n = tick(n) + n;",
            expect![[r#"
            const auto tick_result = MAUVE_TRACE_CODEL(getName(), "lab.tick", ::lab::tick(n));
            n = tick_result + n;
        "#]],
        );
        check_update(
            "n = m + tick(n);",
            expect![[r#"
            n = m + MAUVE_TRACE_CODEL(getName(), "lab.tick", ::lab::tick(n));
        "#]],
        );
        check_update(
            "b = halt() == (n < 3);",
            expect![[r#"
            const auto halt_result = halt();
            b = halt_result == (n < 3);
        "#]],
        );
        check_update(
            "b = read(goal, n) == status(goal);",
            expect![[r#"
            const auto read_result = (goal_status = goal.read(n));
            b = read_result == goal_status;
        "#]],
        );
        check_update(
            "tell(t, t); tell(t + t, t);",
            expect![[r#"
            const auto t_before = t;
            MAUVE_TRACE_CODEL(getName(), "lab.tell", ::lab::tell(t_before, t));
            MAUVE_TRACE_CODEL(getName(), "lab.tell", ::lab::tell(t + t, t));
        "#]],
        );
        check_update(
            "b = b && two(count(1), count(2)) > 3 && n > 1 || flag();",
            expect![[r#"
            bool both = b;
            if (both) {
              const auto count_result = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(1));
              const auto count_result_2 = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(2));
              both = MAUVE_TRACE_CODEL(getName(), "lab.two", ::lab::two(count_result, count_result_2)) > 3;
            }
            b = (both && n > 1) || MAUVE_TRACE_CODEL(getName(), "lab.flag", ::lab::flag());
        "#]],
        );
        check_update(
            "if b then { n = 1; } else if (two(count(1), n) > 3) then { n = 2; } else if b then { n = 3; } else { }",
            expect![[r#"
                if (b) {
                  n = 1;
                } else {
                  const auto count_result = MAUVE_TRACE_CODEL(getName(), "lab.count", ::lab::count(1));
                  if (MAUVE_TRACE_CODEL(getName(), "lab.two", ::lab::two(count_result, n)) > 3) {
                    n = 2;
                  } else if (b) {
                    n = 3;
                  }
                }
            "#]],
        );
    }

    #[test]
    fn numbers_are_those_of_the_model() {
        check_update(
            "n = 010; n = -2147483648; n = 0x1F; x = 3; x = 1e21; x = 7 / 2; f = 0.1; z = 3;",
            expect![[r#"
            n = 10;
            n = std::numeric_limits<int>::min();
            n = 31;
            x = 3.0;
            x = 1e21;
            x = 7 / 2;
            f = 0.1f;
            z = 3u;
        "#]],
        );
        check_update(
            "f = f * 0.5 + 1; f = n; f = f * (1.0 / 3.0); x = x * 2 + n; u = u + 1; u = -u;",
            expect![[r#"
            f = f * 0.5f + 1.0f;
            f = static_cast<float>(n);
            f = f * static_cast<float>(1.0 / 3.0);
            x = x * 2.0 + n;
            u = static_cast<std::uint8_t>(u + 1);
            u = static_cast<std::uint8_t>(-u);
        "#]],
        );
        check_update(
            "b = w < n; b = w < 3; b = z > n; b = u > n; b = n * 2 < x;",
            expect![[r#"
            b = static_cast<std::int64_t>(w) < static_cast<std::int64_t>(n);
            b = w < 3u;
            b = n < 0 || z > static_cast<std::uint64_t>(n);
            b = u > n;
            b = n * 2 < x;
        "#]],
        );
        check_update(
            "n = n - (n - 1) - -n; x = -(-x); b = (n < 3) == b; b = !b == b; b = b || b && !(n < 3);",
            expect![[r#"
            n = n - (n - 1) - -n;
            x = -(-x);
            b = (n < 3) == b;
            b = (!b) == b;
            b = b || (b && !(n < 3));
        "#]],
        );
        check_update(
            "t = \"a\" + t; b = \"a\" == \"b\"; t = t;",
            expect![[r#"
            t = std::string("a") + t;
            b = std::string("a") == "b";
            static_cast<void>(t);
        "#]],
        );
    }

    #[test]
    fn names_hide_what_they_hide_in_the_model() {
        check_update(
            "var n: int = n + 1; { var n: int = n; m = n; { var State: string = t; t = State; } } var x: int; x = n; write(next, limit);",
            expect![[r#"
                int n_ = n + 1;
                {
                  int n_0_ = n_;
                  m = n_0_;
                  {
                    std::string State = t;
                    t = State;
                  }
                }
                int x_{};
                static_cast<void>(x_);
                x_ = n_;
                next.write(limit);
            "#]],
        );
    }

    #[test]
    fn variables_of_the_machine_hide_no_codel_outside_of_it() {
        check(
            "library l {
  codel go(): int
  shell S { provide ask(): int }
  core C(S) {
    var n: int = 0;
    provide ask(): int = { return go(); }
    statemachine { var go: int = 3; initial state A { run = { n = go; } } }
  }
  component K(S, C)
}",
            "component.cpp",
            &["int K::ask", "K::run_A"],
            expect![[r#"
                int K::ask() {
                  MAUVE_TRACE_PROGRAM(getName(), "l.K", "", "ask", "operation");
                  return MAUVE_TRACE_CODEL(getName(), "l.go", ::l::go());
                }
                void K::run_A() {
                  MAUVE_TRACE_PROGRAM(getName(), "l.K", "A", "", "run");
                  n = go;
                }
            "#]],
        );
    }

    #[test]
    fn what_is_always_true_is_no_warning() {
        let model = "library l { shell S { } core C(S) { var n: int = 1  var b: bool = true  update = { b = CONDITION; } } component K(S, C) }";
        for (condition, is_obvious) in [
            ("n == n", true),
            ("n + 1 == 1 + n", true),
            ("n >= -2147483648", true),
            ("n > 3 && n < 2", true),
            ("n < 3 || n > 2", true),
            ("b || !b", true),
            ("n > 2 && n < 5", false),
            ("n == 1 || n == 2", false),
            ("n > 3 && b", false),
        ] {
            let texts = vec![("/model.mal".into(), model.replace("CONDITION", condition))];
            let files = generated(texts, "component.cpp");
            assert_eq!(files[0].1.contains("#pragma GCC diagnostic ignored"), is_obvious, "{condition}");
        }
    }

    /// All of a text but its literals and comments.
    fn code_of(text: &str) -> String {
        let mut code = String::new();
        for line in text.lines() {
            let mut in_literal = false;
            let line = line.replace("\\\\", "").replace("\\\"", "");
            for (index, part) in line.split('"').enumerate() {
                in_literal = index % 2 == 1;
                if !in_literal {
                    code += part.split("//").next().unwrap();
                }
                if !in_literal && part.contains("//") {
                    break;
                }
            }
            assert!(!in_literal || line.contains("//"), "{line}");
            code.push('\n');
        }
        code
    }

    #[test]
    fn every_model_becomes_code() {
        let random = (0..150).map(|seed| {
            let files = mauve_tests::random_model(seed).written().files;
            files.into_iter().map(|(path, text)| (path.into(), text)).collect()
        });
        let mut sample: Vec<(PathBuf, String)> = Vec::new();
        let mut open = vec![mauve_tests::models().join("p3dx")];
        while let Some(folder) = open.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    open.push(path);
                } else if path.extension().is_some_and(|it| it == "mal" || it == "toml") {
                    let text = std::fs::read_to_string(&path).unwrap();
                    sample.push((
                        PathBuf::from("/")
                            .join(path.strip_prefix(mauve_tests::models().join("p3dx")).unwrap()),
                        text,
                    ));
                }
            }
        }
        for texts in random.chain([sample]) {
            for (path, text) in
                ["component.hpp", "component.cpp"].into_iter().flat_map(|end| generated(texts.clone(), end))
            {
                let code = code_of(&text);
                // What has no meaning would be a `{}`: only variables are that, where hooks give them their first values.
                let at = code.find("::updateHook()").unwrap_or_default();
                let (hooks, programs) = code.split_at(at);
                for (open, close) in [('(', ')'), ('{', '}'), ('[', ']')] {
                    let count = |c: char| code.matches(c).count();
                    assert_eq!(count(open), count(close), "{path}\n{text}");
                }
                assert!(text.lines().all(|line| line.chars().count() <= 100), "{path}\n{text}");
                assert!(
                    !code.contains("void*")
                        && !hooks.replace("= {};\n", "").contains("= {}")
                        && !programs.contains("= {}")
                        && !code.contains("({})"),
                    "{path}\n{text}"
                );
                assert!(
                    !text.contains(" \n") && !text.contains("\n\n\n") && !text.contains("{\n\n}"),
                    "{path}\n{text}"
                );
            }
        }
    }
}
