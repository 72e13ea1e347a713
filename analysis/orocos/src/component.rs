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
//! | `component/header.rs` | the declaration of the class |
//! | `component/source.rs` | its constructor, its hooks, its state machine |
//! | `component/program.rs` | the statements of its programs |
//! | `component/expression.rs` | expressions, evaluated as MAUVE says |
//! | `component/layout.rs` | lines that are not too long |

mod expression;
mod header;
mod layout;
mod program;
mod source;

use std::cell::RefCell;

use mauve_model::item_tree::{
    Core, Direction, Expr, Feature, FeatureKind, HookKind, MethodKind, Parameter, Part, Program, Statement,
    Variable,
};
use mauve_model::{
    Callee, Decl, File, Meaning, ModelDb, Place, Project, Type, Typing, Value, VariableKind, core, core_of,
    external_types, features_of, shell_of, type_of, typing_of, values_of_shell,
};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::cpp_name::CppNames;
use crate::cpp_type::{cpp_type, parameter_type};
use crate::escape::comment;
use crate::library::{Libraries, Library};
use crate::package::{GeneratedFile, Owner};

/// The classes of a library's components.
pub(crate) fn component_files<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    libraries: &Libraries<'db>,
    library: &Library<'db>,
) -> Vec<GeneratedFile> {
    let classes = library.components.iter().filter_map(|(component, name)| {
        Class::new(Model { db, project, libraries }, library, *component, name)
    });
    let files = classes.flat_map(|class| {
        let file = |end: &str, text| GeneratedFile {
            path: format!("{0}/{0}-component.{end}", class.name),
            text,
            owner: Owner::Generator,
        };
        [file("hpp", header::text(&class)), file("cpp", source::text(&class))]
    });
    files.collect()
}

/// Where all of this is read.
#[derive(Clone, Copy)]
struct Model<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    libraries: &'a Libraries<'db>,
}

/// A component as a class: what it has, and how that is called in C++.
struct Class<'a, 'db> {
    model: Model<'a, 'db>,
    library: &'a Library<'db>,
    component: Decl<'db>,
    core: Decl<'db>,
    data: &'db Core,
    typing: &'db Typing<'db>,
    /// Its name.
    name: String,
    /// The shells, those that others extend first, each with its features in the order of the text.
    shells: Vec<(Decl<'db>, Vec<Member<'db>>)>,
    /// The variables and handlers of the core, and those of its machine, by their numbers in the typing.
    variables: FxHashMap<usize, String>,
    /// What the components that execute required operations write their `out` and `inout` parameters to.
    slots: Vec<Slot<'db>>,
    /// What it executes.
    programs: Vec<Routine<'db>>,
    by_key: FxHashMap<Key, usize>,
    /// The state machine, if it has one.
    machine: Option<Machine>,
    /// The parameter of the constructor.
    instance: String,
    /// Variables that something reads, or gets a reference to.
    read: FxHashSet<usize>,
    /// Variables that are named at all.
    named: FxHashSet<usize>,
    /// Variables by where they are declared.
    by_part: FxHashMap<Part, usize>,
    /// All names that are taken in the class.
    names: CppNames,
    lines: RefCell<FxHashMap<File, Vec<usize>>>,
}

/// A feature of the shell.
struct Member<'db> {
    shell: Decl<'db>,
    index: usize,
    data: &'db Feature,
    /// Its name in C++: that of what programs read.
    name: String,
    /// What is read there; of an operation, what it gives.
    ty: Type,
    /// Of a constant: the property that it is frozen from.
    property: Option<String>,
    /// Of an input port: what its last `read` gave, where a program asks for that.
    status: Option<String>,
    /// Of an operation: which way its parameters go, and what they are.
    parameters: Vec<(Direction, Type)>,
    /// Of a property or a constant: the value that it has unless it is given another.
    value: Option<Value>,
}

/// Where the values of an operation that is executed elsewhere come back to: as long as it may be under way, it is there.
struct Slot<'db> {
    /// The handler of the call, by its number in the typing; nothing where its result is dropped.
    handler: Option<usize>,
    shell: Decl<'db>,
    index: usize,
    parameter: usize,
    ty: Type,
    name: String,
}

/// The names of a state machine.
struct Machine {
    /// The enumeration of its states.
    states: String,
    /// Its values, in the order of the states.
    values: Vec<String>,
    /// The state that the machine is in.
    current: String,
    initial: usize,
}

/// Which program.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Key {
    Hook(HookKind),
    Operation(usize),
    Method(usize, MethodKind),
    Guard(usize, usize),
    Effect(usize, usize),
}

/// A program as a member function.
struct Routine<'db> {
    /// Its name in C++.
    function: String,
    /// What it is in the model: `state Waiting, run`.
    what: String,
    /// Where it stands there.
    at: Part,
    /// State, transition and program, as traces name them.
    span: [String; 3],
    /// What it gives.
    gives: Type,
    parameters: &'db [Parameter],
    body: Body<'db>,
}

/// A parameter of an operation of one's own.
struct CppParameter {
    /// Its number in the typing, where something uses it.
    index: Option<usize>,
    name: String,
    /// With its type.
    declared: String,
}

enum Body<'db> {
    Program(&'db Program),
    Guard(&'db Expr),
}

impl<'a, 'db> Class<'a, 'db> {
    fn new(
        model: Model<'a, 'db>,
        library: &'a Library<'db>,
        component: Decl<'db>,
        name: &str,
    ) -> Option<Class<'a, 'db>> {
        let Model { db, project, .. } = model;
        let of = core_of(db, project, component)?;
        let data = core(db, of)?;
        let mut names = CppNames::of_component();
        names.declare(name);
        names.declare(&library.package);
        let macros = ["MAUVE_TRACE_COMPONENT", "MAUVE_TRACE_PROGRAM", "MAUVE_TRACE_CODEL"];
        macros.iter().for_each(|it| drop(names.declare(it)));
        // A member would hide a type of its own name.
        for external in external_types(db, project.workspace(db)).values() {
            let words = external.cpp.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            words.filter(|word| !word.is_empty()).for_each(|word| drop(names.declare(word)));
        }
        let mut class = Class {
            model,
            library,
            component,
            core: of,
            data,
            typing: typing_of(db, project, of),
            name: name.to_owned(),
            shells: Vec::new(),
            variables: FxHashMap::default(),
            slots: Vec::new(),
            programs: Vec::new(),
            by_key: FxHashMap::default(),
            machine: None,
            instance: String::new(),
            read: FxHashSet::default(),
            named: FxHashSet::default(),
            by_part: FxHashMap::default(),
            names,
            lines: RefCell::default(),
        };
        class.features(shell_of(db, project, component)?);
        class.variables();
        class.uses();
        class.programs();
        class.instance = class.names.clone().declare("name");
        Some(class)
    }

    fn features(&mut self, shell: Decl<'db>) {
        let Model { db, project, .. } = self.model;
        let features = features_of(db, project, shell);
        let values = values_of_shell(db, project, shell);
        for &shell in features.shells.iter().rev() {
            let own = features.by_name.values().flatten().filter(|feature| feature.shell == shell);
            let mut own: Vec<_> = own.filter_map(|feature| Some((feature, feature.data(db)?))).collect();
            own.sort_by_key(|(feature, _)| feature.index);
            let members = own.into_iter().map(|(feature, data)| {
                let ty = |ty| type_of(db, project, shell, ty);
                let name = self.names.declare(&data.name.name);
                let parameters =
                    data.parameters.iter().map(|it| (it.direction, ty(it.ty.as_ref()))).collect();
                Member {
                    shell,
                    index: feature.index,
                    data,
                    name,
                    ty: ty(data.ty.as_ref()),
                    property: None,
                    status: None,
                    parameters,
                    value: values.get(&data.name.name).cloned(),
                }
            });
            let members = members.collect();
            self.shells.push((shell, members));
        }
        for member in self.shells.iter_mut().flat_map(|(_, members)| members) {
            if member.data.kind == FeatureKind::Constant {
                member.property = Some(self.names.declare(&format!("{}_property", member.data.name.name)));
            }
        }
    }

    fn variables(&mut self) {
        for (index, variable) in self.typing.variables.iter().enumerate() {
            self.by_part.insert(variable.name.part, index);
            if matches!(variable.kind, VariableKind::Core | VariableKind::Machine | VariableKind::Handler) {
                self.variables.insert(index, self.names.declare(&variable.name.name));
            }
        }
    }

    /// What programs ask for: names, the statuses of ports, places for what operations give.
    fn uses(&mut self) {
        let mut targets: FxHashSet<Part> = FxHashSet::default();
        let mut statuses: FxHashSet<(Decl<'db>, usize)> = FxHashSet::default();
        let mut dropped: Vec<(Decl<'db>, usize)> = Vec::new();
        let (data, typing) = (self.data, self.typing);
        let feature = |part: &Part| match typing.values.get(part) {
            Some(Meaning::Feature(shell, index)) => Some((*shell, *index)),
            _ => None,
        };
        for statement in statements(data) {
            match statement {
                Statement::Assign(target, _) => drop(targets.insert(target.part)),
                Statement::Expr(Expr::Call { callee, arguments, .. })
                    if typing.callees.get(&callee.part) == Some(&Callee::Send) =>
                {
                    dropped.extend(arguments.first().and_then(Expr::part).as_ref().and_then(feature));
                }
                _ => {}
            }
        }
        for expr in expressions(data) {
            if let Expr::Call { callee, arguments, .. } = expr
                && typing.callees.get(&callee.part) == Some(&Callee::Status)
            {
                statuses.extend(arguments.first().and_then(Expr::part).as_ref().and_then(feature));
            }
        }
        for (part, meaning) in &typing.values {
            if let Meaning::Variable(index) = meaning {
                self.named.insert(*index);
                if !targets.contains(part) {
                    self.read.insert(*index);
                }
            }
        }
        for member in self.shells.iter_mut().flat_map(|(_, members)| members) {
            if statuses.contains(&(member.shell, member.index)) {
                member.status = Some(self.names.declare(&format!("{}_status", member.data.name.name)));
            }
        }
        let mut slots = Vec::new();
        for (index, variable) in typing.variables.iter().enumerate() {
            let Type::Handle(operation) = &variable.ty else { continue };
            let member = self.members().find(|it| it.data.name.name == *operation);
            slots.extend(member.map(|member| (Some(index), member, &variable.name.name)));
        }
        for (shell, index) in dropped {
            let is_there = slots
                .iter()
                .any(|(handler, it, _)| handler.is_none() && (it.shell, it.index) == (shell, index));
            let member = self.member(shell, index).filter(|_| !is_there);
            slots.extend(member.map(|member| (None, member, &member.data.name.name)));
        }
        let mut names = self.names.clone();
        let slots = slots.into_iter().flat_map(|(handler, member, name)| {
            let parameters = member.parameters.iter().zip(&member.data.parameters).enumerate();
            let back = parameters.filter(|(_, ((direction, _), _))| *direction != Direction::In);
            back.map(move |(parameter, ((_, ty), data))| {
                let wanted = format!("{name}_{}", data.name.name);
                (
                    Slot {
                        handler,
                        shell: member.shell,
                        index: member.index,
                        parameter,
                        ty: ty.clone(),
                        name: String::new(),
                    },
                    wanted,
                )
            })
        });
        let slots: Vec<_> = slots.collect();
        let slots = slots.into_iter().map(|(slot, wanted)| Slot { name: names.declare(&wanted), ..slot });
        self.slots = slots.collect();
        self.names = names;
    }

    fn programs(&mut self) {
        let data = self.data;
        for hook in &data.hooks {
            let gives = match hook.kind {
                HookKind::Configure | HookKind::Start => Type::Bool,
                HookKind::Update | HookKind::Stop | HookKind::Cleanup => Type::Void,
            };
            let word = hook.kind.keyword();
            let span = ["", "", word].map(str::to_owned);
            let what = (word.to_owned(), hook.part);
            let body = Body::Program(&hook.program);
            self.routine(Key::Hook(hook.kind), &format!("{word}_program"), what, span, gives, body);
        }
        for (index, operation) in data.operations.iter().enumerate() {
            let name = &operation.name.name;
            let declared = self.members().find(|it| it.data.name.name == *name);
            // It has the name of the feature.
            let function = declared.map(|member| member.name.clone());
            let gives = match (&operation.result, declared) {
                (None, Some(member)) => member.ty.clone(),
                (result, _) => type_of(self.model.db, self.model.project, self.core, result.as_ref()),
            };
            let span = ["", name, "operation"].map(str::to_owned);
            let function = function.unwrap_or_else(|| self.names.declare(name));
            self.by_key.insert(Key::Operation(index), self.programs.len());
            self.programs.push(Routine {
                function,
                what: format!("provide {name}"),
                at: operation.name.part,
                span,
                gives,
                parameters: &operation.parameters,
                body: Body::Program(&operation.program),
            });
        }
        let Some(machine) = data.machines.first() else { return };
        for (number, state) in machine.states.iter().enumerate() {
            let name = &state.name.name;
            for method in &state.methods {
                let word = method.kind.keyword();
                let what = (format!("state {name}, {word}"), method.part);
                let span = [name, "", word].map(str::to_owned);
                let body = Body::Program(&method.program);
                let key = Key::Method(number, method.kind);
                self.routine(key, &format!("{word}_{name}"), what, span, Type::Void, body);
            }
            for (index, transition) in state.transitions.iter().enumerate() {
                let own = &transition.name.name;
                let what =
                    |part: &str| (format!("state {name}, transition {own}, {part}"), transition.name.part);
                let span = |part: &str| [name, own, part].map(str::to_owned);
                if let Some(guard) = &transition.guard {
                    let (function, body) = (format!("guard_{name}_{own}"), Body::Guard(&guard.condition));
                    let key = Key::Guard(number, index);
                    self.routine(key, &function, what("guard"), span("guard"), Type::Bool, body);
                }
                if let Some(effect) = &transition.effect {
                    let (function, body) = (format!("effect_{name}_{own}"), Body::Program(effect));
                    let key = Key::Effect(number, index);
                    self.routine(key, &function, what("effect"), span("effect"), Type::Void, body);
                }
            }
        }
        let mut values = CppNames::default();
        self.machine = Some(Machine {
            states: self.names.declare("State"),
            values: machine.states.iter().map(|state| values.declare(&state.name.name)).collect(),
            current: self.names.declare("current_state"),
            initial: machine.states.iter().position(|state| state.initial).unwrap_or_default(),
        });
    }

    fn routine(
        &mut self,
        key: Key,
        function: &str,
        (what, at): (String, Part),
        span: [String; 3],
        gives: Type,
        body: Body<'db>,
    ) {
        let function = self.names.declare(function);
        self.by_key.insert(key, self.programs.len());
        self.programs.push(Routine { function, what, at, span, gives, parameters: &[], body });
    }

    // What is asked of it.

    /// All features.
    fn members(&self) -> impl Iterator<Item = &Member<'db>> {
        self.shells.iter().flat_map(|(_, members)| members)
    }

    fn member(&self, shell: Decl<'db>, index: usize) -> Option<&Member<'db>> {
        self.members().find(|member| member.shell == shell && member.index == index)
    }

    /// A program, if it is there.
    fn program(&self, key: Key) -> Option<&Routine<'db>> {
        self.by_key.get(&key).and_then(|index| self.programs.get(*index))
    }

    /// A type in C++; everything here is generated from models of which all types are known.
    fn cpp(&self, ty: &Type) -> String {
        let Model { db, project, .. } = self.model;
        match ty {
            Type::Handle(operation) => {
                let member = self.members().find(|it| it.data.name.name == *operation);
                format!("RTT::SendHandle<{}>", member.map_or_else(String::new, |it| self.signature(it)))
            }
            ty => cpp_type(db, project.workspace(db), ty).unwrap_or_else(|| "void*".to_owned()),
        }
    }

    /// The type of an operation: `bool(double, ::nav_msgs::Path&)`.
    fn signature(&self, operation: &Member<'db>) -> String {
        let parameter = |(direction, ty): &(Direction, Type)| parameter_type(&self.cpp(ty), ty, *direction);
        let parameters: Vec<String> = operation.parameters.iter().map(parameter).collect();
        format!("{}({})", self.cpp(&operation.ty), parameters.join(", "))
    }

    /// A program's parameters, whose names are then taken.
    fn parameters(&self, of: &Routine<'db>, names: &mut CppNames) -> Vec<CppParameter> {
        let Model { db, project, .. } = self.model;
        let mut parameter = |it: &Parameter| {
            let ty = type_of(db, project, self.core, it.ty.as_ref());
            let cpp = parameter_type(&self.cpp(&ty), &ty, it.direction);
            let index = self.variable_at(it.name.part).filter(|index| self.named.contains(index));
            let name = names.declare(&it.name.name);
            // Compilers warn of those that nothing uses.
            let declared =
                if index.is_some() { format!("{cpp} {name}") } else { format!("{cpp} /*{name}*/") };
            CppParameter { index, name, declared }
        };
        of.parameters.iter().map(&mut parameter).collect()
    }

    /// The number of the variable that is declared there.
    fn variable_at(&self, part: Part) -> Option<usize> {
        self.by_part.get(&part).copied()
    }

    /// Its name in tables and traces: `motion.Guidance`.
    fn qualified(&self) -> String {
        self.component.qualified(self.model.db)
    }

    /// Where something stands: `components/guidance.mal:25`.
    fn at(&self, of: Decl<'db>, part: Part) -> String {
        let Model { db, project, .. } = self.model;
        let file = of.file(db);
        let path = file.path(db);
        let folder = project.workspace(db).folder(db);
        // What lies outside of the workspace is elsewhere on each machine.
        let relative = path.strip_prefix(folder).ok().or(path.file_name().map(AsRef::as_ref));
        let shown = relative.map_or_else(String::new, |path| path.display().to_string());
        let mut lines = self.lines.borrow_mut();
        let lines = lines.entry(file).or_insert_with(|| {
            file.text(db).bytes().enumerate().filter(|(_, it)| *it == b'\n').map(|(at, _)| at).collect()
        });
        let start = usize::from(Place::Part(of, part).range(db).start());
        comment(&format!("{shown}:{}", lines.partition_point(|at| *at < start) + 1))
    }

    /// What stands there in the model.
    fn source(&self, of: Decl<'db>, part: Part) -> String {
        let db = self.model.db;
        let range = Place::Part(of, part).range(db);
        comment(of.file(db).text(db).get(std::ops::Range::<usize>::from(range)).unwrap_or_default())
    }

    /// `core GuidanceCore: components/guidance.mal:33`
    fn declared(&self, of: Decl<'db>) -> String {
        let db = self.model.db;
        format!("{} {}: {}", of.kind(db), of.name(db), self.at(of, Part(0)))
    }

    /// The variables of the core or of its machine, with their numbers and names in C++.
    fn variables_of(&self, all: &'db [Variable]) -> Vec<(usize, &'db Variable, &str)> {
        let found = all.iter().filter_map(|variable| {
            let index = self.variable_at(variable.name.part)?;
            Some((index, variable, self.variables.get(&index)?.as_str()))
        });
        found.collect()
    }

    fn type_of_variable(&self, index: usize) -> Type {
        self.typing.variables.get(index).map_or(Type::Unknown, |variable| variable.ty.clone())
    }
}

/// The statements of a core, those within others too.
fn statements(core: &Core) -> Vec<&Statement> {
    let mut open: Vec<&Statement> = core.programs().into_iter().flat_map(|it| &it.statements).collect();
    let mut found = Vec::new();
    while let Some(statement) = open.pop() {
        found.push(statement);
        match statement {
            Statement::If { then, otherwise, .. } => {
                open.extend(then.iter().chain(otherwise.iter().flatten()))
            }
            Statement::Block(inner) => open.extend(inner),
            Statement::Variable(_) | Statement::Return(..) | Statement::Assign(..) | Statement::Expr(_) => {}
        }
    }
    found
}

/// The expressions in a core, those within others too.
fn expressions(core: &Core) -> Vec<&Expr> {
    let machines = || core.machines.iter();
    let variables = core.variables.iter().chain(machines().flat_map(|machine| &machine.variables));
    let mut open: Vec<&Expr> = variables.filter_map(|variable| variable.value.as_ref()).collect();
    let transitions = machines().flat_map(|machine| &machine.states).flat_map(|state| &state.transitions);
    open.extend(transitions.filter_map(|transition| Some(&transition.guard.as_ref()?.condition)));
    for statement in statements(core) {
        match statement {
            Statement::Variable(variable) => open.extend(&variable.value),
            Statement::If { condition, .. } => open.push(condition),
            Statement::Return(_, value) => open.extend(value),
            Statement::Assign(_, value) | Statement::Expr(value) => open.push(value),
            Statement::Block(_) => {}
        }
    }
    let mut found = Vec::new();
    while let Some(expr) = open.pop() {
        found.push(expr);
        match expr {
            Expr::Lost(inner) | Expr::Unary(_, inner, _) => open.push(inner),
            Expr::Binary(_, lhs, rhs, _) => open.extend([lhs.as_ref(), rhs.as_ref()]),
            Expr::Call { arguments, .. } => open.extend(arguments),
            Expr::Missing | Expr::Literal(..) | Expr::Name(_) => {}
        }
    }
    found
}
