//! What a file declares, without a place in it: the form that every later query reads.
//!
//! No range stands here, so a comment or a blank line changes nothing. What a diagnostic may point at has a [`SourceId`],
//! a number in the order of the declaration's text, and `source_map` knows where that is now.

use std::borrow::Borrow;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

pub use mauve_syntax::keywords::{CallStatus, Direction, HookKind, MethodKind, PortStatus};
use rustc_hash::FxHashSet;

use crate::completeness::Completeness;

/// A name, or another short text, as it stands in the file. Cheap to clone.
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Default, salsa::SalsaValue)]
pub struct Name(Arc<str>);

impl Name {
    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Deref for Name {
    type Target = str;

    fn deref(&self) -> &str {
        &self.0
    }
}

impl Borrow<str> for Name {
    fn borrow(&self) -> &str {
        &self.0
    }
}

impl From<&str> for Name {
    fn from(text: &str) -> Name {
        Name(text.into())
    }
}

impl From<String> for Name {
    fn from(text: String) -> Name {
        Name(text.into())
    }
}

impl PartialEq<str> for Name {
    fn eq(&self, other: &str) -> bool {
        *self.0 == *other
    }
}

impl PartialEq<&str> for Name {
    fn eq(&self, other: &&str) -> bool {
        *self.0 == **other
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", &*self.0)
    }
}

/// Something in a declaration that can be pointed at; 0 is its name. Names are numbered in the order of the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, salsa::SalsaValue)]
pub struct SourceId(pub u32);

/// The declarations of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ItemTree {
    /// The paths of the `include` lines; none where it is missing.
    pub includes: Vec<Option<String>>,
    /// The libraries that it has a block of.
    pub libraries: Vec<Name>,
    /// In the order of the text.
    pub declarations: Vec<Declaration>,
    /// Whether all declarations are known, each with its library. More than a stray word between them that fits nowhere may
    /// be one, and a missing brace may be the end of a library.
    pub completeness: Completeness,
    /// What text that is no declaration, an incomplete one, or two that have run together may declare: a name in a
    /// library, or any name. Where its own library lacks such a name, it is not looked for elsewhere.
    pub possible_names: Vec<(Option<Name>, Option<Name>)>,
    /// Whether all includes and libraries are known: a half-typed line may be one.
    pub include_completeness: Completeness,
}

/// A declaration, and how it is known from elsewhere.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declaration {
    /// The library around it, if any.
    pub library: Option<Name>,
    /// Empty while it is missing.
    pub name: Name,
    /// What it is.
    pub kind: Kind,
    /// What stands in it.
    pub data: Arc<Data>,
}

/// The kinds of declaration; each is a namespace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Kind {
    Use,
    Codel,
    Shell,
    Core,
    Component,
    Architecture,
    Deployment,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kind::Use => "use",
            Kind::Codel => "codel",
            Kind::Shell => "shell",
            Kind::Core => "core",
            Kind::Component => "component",
            Kind::Architecture => "architecture",
            Kind::Deployment => "deployment",
        })
    }
}

/// What stands in a declaration.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Data {
    Use,
    Codel(Codel),
    Shell(Shell),
    Core(Core),
    Component(Component),
    Architecture(Architecture),
    Deployment(Deployment),
}

impl Data {
    /// The types of values that it names, each with whether it may be `void`.
    pub fn types(&self) -> Vec<(&TypeRef, bool)> {
        fn of_parameters(parameters: &[Parameter]) -> impl Iterator<Item = (&TypeRef, bool)> {
            parameters.iter().filter_map(|parameter| Some((parameter.ty.as_ref()?, false)))
        }
        let mut types = Vec::new();
        match self {
            Data::Codel(codel) => {
                types.extend(of_parameters(&codel.parameters));
                types.extend(codel.result.as_ref().map(|ty| (ty, true)));
            }
            Data::Shell(shell) => {
                for feature in &shell.features {
                    types.extend(of_parameters(&feature.parameters));
                    types.extend(feature.ty.as_ref().map(|ty| (ty, feature.kind.is_operation())));
                }
            }
            Data::Core(core) => {
                for operation in &core.operations {
                    types.extend(of_parameters(&operation.parameters));
                    types.extend(operation.result.as_ref().map(|ty| (ty, true)));
                }
                types.extend(core.all_variables().filter_map(|it| Some((it.ty.as_ref()?, false))));
            }
            Data::Use | Data::Component(_) | Data::Architecture(_) | Data::Deployment(_) => {}
        }
        types
    }
}

/// The name of a type, shell, component, … as it stands: one part or several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TypeRef {
    /// Its parts; the last may be missing while it is typed.
    pub path: Vec<Name>,
    /// Where it stands.
    pub id: SourceId,
}

impl fmt::Display for TypeRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, name) in self.path.iter().enumerate() {
            write!(f, "{}{name}", if index == 0 { "" } else { "." })?;
        }
        Ok(())
    }
}

/// A name that refers to something.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NameRef {
    /// The name.
    pub name: Name,
    /// Where it stands.
    pub id: SourceId,
}

/// `codel f(…): T`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Codel {
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// What it gives.
    pub result: Option<TypeRef>,
    /// Whether all of it is known.
    pub completeness: Completeness,
}

/// A parameter of a codel or an operation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// Which way the value goes.
    pub direction: Direction,
    /// Its name.
    pub name: NameRef,
    /// Its type.
    pub ty: Option<TypeRef>,
}

/// `shell S { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shell {
    /// The shells that it extends.
    pub bases: Vec<TypeRef>,
    /// Properties, ports and operations.
    pub features: Vec<Feature>,
    /// Whether all its items are known.
    pub completeness: Completeness,
}

/// Something that a shell offers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Feature {
    /// What it is.
    pub kind: FeatureKind,
    /// Its name.
    pub name: NameRef,
    /// Its type, or what the operation gives.
    pub ty: Option<TypeRef>,
    /// Of an operation.
    pub parameters: Vec<Parameter>,
    /// Of a constant or a property: the least and the greatest value that it may have.
    pub interval: Option<Interval>,
    /// Of a constant or a property: the value that it has unless it is given another.
    pub value: Option<Expr>,
}

/// `[low; high]`, both ends included.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Interval {
    pub low: Expr,
    pub high: Expr,
    /// All of it.
    pub id: SourceId,
}

/// The kinds of feature of a shell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum FeatureKind {
    Constant,
    Property,
    Input,
    Output,
    Required,
    Provided,
}

impl FeatureKind {
    /// Is it a port?
    pub fn is_port(self) -> bool {
        matches!(self, FeatureKind::Input | FeatureKind::Output)
    }

    /// Is it an operation?
    pub fn is_operation(self) -> bool {
        matches!(self, FeatureKind::Required | FeatureKind::Provided)
    }

    /// Does it have a value: is it a constant or a property?
    pub fn is_value(self) -> bool {
        matches!(self, FeatureKind::Constant | FeatureKind::Property)
    }
}

/// `core C(S) { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Core {
    /// The shell that it is for.
    pub shell: Option<TypeRef>,
    /// Its variables.
    pub variables: Vec<Variable>,
    /// Its handlers.
    pub handlers: Vec<Handler>,
    /// The operations that it provides; one that an edit does not touch is the same one.
    pub operations: Vec<Arc<Operation>>,
    /// `configure`, `start`, `update`, `stop`, `cleanup`; likewise.
    pub hooks: Vec<Arc<Hook>>,
    /// Its state machines: one, or none; more are an error.
    pub machines: Vec<Machine>,
    /// The colon behind its header, which no model needs.
    pub colon: Option<SourceId>,
    /// Whether all its items are known.
    pub completeness: Completeness,
}

/// `handler h: operation`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Handler {
    /// Its name.
    pub name: NameRef,
    /// The required operation whose results it gets.
    pub operation: Option<TypeRef>,
}

impl Core {
    /// Every variable, those in its programs too.
    pub fn all_variables(&self) -> impl Iterator<Item = &Variable> {
        let machines = self.machines.iter().flat_map(|machine| &machine.variables);
        self.variables.iter().chain(machines).chain(self.statements().filter_map(Statement::variable))
    }

    /// Every program of it.
    pub fn programs(&self) -> Vec<&Program> {
        let mut programs: Vec<&Program> = self.operations.iter().map(|it| &it.program).collect();
        programs.extend(self.hooks.iter().map(|hook| &hook.program));
        for state in self.machines.iter().flat_map(|machine| &machine.states) {
            programs.extend(state.methods.iter().map(|method| &method.program));
            programs.extend(state.transitions.iter().filter_map(|transition| transition.effect.as_ref()));
        }
        programs
    }

    /// Returns whether all of it is known, the items of its state machines and its programs too.
    pub(crate) fn total_completeness(&self) -> Completeness {
        let states = || self.machines.iter().flat_map(|machine| &machine.states);
        let transitions = || states().flat_map(|state| &state.transitions);
        let lists = self.machines.iter().map(|it| it.completeness).chain(states().map(|it| it.completeness));
        let guards = transitions().filter_map(|it| it.guard.as_ref()).map(|it| it.completeness);
        let programs = self.programs().into_iter().map(|it| it.completeness);
        let all = lists.chain(transitions().map(|it| it.completeness)).chain(guards).chain(programs);
        self.completeness & all.collect()
    }

    /// Does it have two behaviours, or define something twice?
    pub(crate) fn is_double(&self) -> bool {
        let updates = self.hooks.iter().filter(|hook| hook.kind == HookKind::Update).count();
        let (mut names, mut kinds) = (FxHashSet::default(), FxHashSet::default());
        updates + self.machines.len() > 1
            || self.operations.iter().any(|operation| !names.insert(&operation.name.name))
            || self.hooks.iter().any(|hook| !kinds.insert(hook.kind))
    }
}

/// `var n: T = …`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variable {
    /// Its name.
    pub name: NameRef,
    /// Its type.
    pub ty: Option<TypeRef>,
    /// Its first value.
    pub value: Option<Expr>,
    /// A token that begins a line and goes on with the value, where another statement may have been meant; and the white
    /// space before it, where there is no comment.
    pub continued: Option<(SourceId, Option<SourceId>)>,
}

/// `provide f(…): T = { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Operation {
    /// Its name.
    pub name: NameRef,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// What it gives.
    pub result: Option<TypeRef>,
    /// Its parameters and what it gives: all between its name and the `=`.
    pub signature: SourceId,
    /// What it does.
    pub program: Program,
}

/// `update = { … }` and the like.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hook {
    /// Which of them.
    pub kind: HookKind,
    /// The keyword.
    pub id: SourceId,
    /// What it does.
    pub program: Program,
}

/// `statemachine { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Machine {
    /// The keyword.
    pub id: SourceId,
    /// Its variables.
    pub variables: Vec<Variable>,
    /// Its states; one that an edit does not touch is the same one.
    pub states: Vec<Arc<State>>,
    /// Whether all its items are known.
    pub completeness: Completeness,
}

/// `state S { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// Its name; empty while it is missing.
    pub name: NameRef,
    /// Is it where the machine starts?
    pub initial: bool,
    /// What says so, up to the keyword; nothing, right before that, where it does not.
    pub start: SourceId,
    /// `entry`, `run`, `handle`, `exit`.
    pub methods: Vec<Method>,
    /// In the order of the text, which is that of their guards.
    pub transitions: Vec<Transition>,
    /// Whether all its items are known.
    pub completeness: Completeness,
}

impl State {
    /// Returns the program of a method.
    pub fn method(&self, kind: MethodKind) -> Option<&Program> {
        self.methods.iter().find(|method| method.kind == kind).map(|method| &method.program)
    }
}

/// `run = { … }` and the like.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Method {
    /// Which of them.
    pub kind: MethodKind,
    /// The keyword.
    pub id: SourceId,
    /// What it does.
    pub program: Program,
}

/// `transition t if … to S { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    /// Its name.
    pub name: NameRef,
    /// What must hold; nothing: it always fires.
    pub guard: Option<Guard>,
    /// The state that it leads to.
    pub target: Option<NameRef>,
    /// What it does.
    pub effect: Option<Program>,
    /// Whether all of the transition is known, its guard and effect aside.
    pub completeness: Completeness,
}

/// `if …` of a transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Guard {
    /// The condition.
    pub condition: Expr,
    /// Whether all of it is known.
    pub completeness: Completeness,
}

/// `{ … }`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Program {
    /// Its statements.
    pub statements: Vec<Statement>,
    /// Whether all of it is known.
    pub completeness: Completeness,
}

/// A statement.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Statement {
    Variable(Variable),
    If {
        /// The keyword.
        id: SourceId,
        condition: Expr,
        then: Vec<Statement>,
        /// Where the first block ends.
        end: SourceId,
        otherwise: Option<Vec<Statement>>,
    },
    Block(Vec<Statement>),
    /// With its keyword.
    Return(SourceId, Option<Expr>),
    Assign(NameRef, Expr),
    Expr(Expr),
}

impl Statement {
    /// Where it begins; nothing for an empty block, or what is not understood.
    pub fn id(&self) -> Option<SourceId> {
        match self {
            Statement::Variable(variable) => Some(variable.name.id),
            Statement::If { id, .. } | Statement::Return(id, _) => Some(*id),
            Statement::Block(statements) => statements.iter().find_map(Statement::id),
            Statement::Assign(target, _) => Some(target.id),
            Statement::Expr(value) => value.id(),
        }
    }
}

/// An expression.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Expr {
    /// It is not there, or not understood.
    Missing,
    /// A part of it is missing: it names what it names, and its value is unknown.
    Incomplete(Box<Expr>),
    Literal(Literal, SourceId),
    Name(NameRef),
    Call {
        callee: NameRef,
        arguments: Vec<Expr>,
        id: SourceId,
    },
    Unary(UnaryOperator, Box<Expr>, SourceId),
    Binary(BinaryOperator, Box<Expr>, Box<Expr>, SourceId),
}

impl Expr {
    /// Where the whole of it stands, without brackets around it.
    pub fn id(&self) -> Option<SourceId> {
        match self {
            Expr::Missing | Expr::Incomplete(_) => None,
            Expr::Name(name) => Some(name.id),
            Expr::Literal(_, id)
            | Expr::Call { id, .. }
            | Expr::Unary(_, _, id)
            | Expr::Binary(_, _, _, id) => Some(*id),
        }
    }
}

/// A literal, numbers as they stand.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Literal {
    Int(Name),
    Float(Name),
    String(Name),
    Bool(bool),
    PortStatus(PortStatus),
    CallStatus(CallStatus),
}

/// The unary operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum UnaryOperator {
    Not,
    Minus,
}

impl UnaryOperator {
    /// As it is written.
    pub fn text(self) -> &'static str {
        match self {
            UnaryOperator::Not => "!",
            UnaryOperator::Minus => "-",
        }
    }
}

impl BinaryOperator {
    /// As it is written.
    pub fn text(self) -> &'static str {
        match self {
            BinaryOperator::Or => "||",
            BinaryOperator::And => "&&",
            BinaryOperator::Equal => "==",
            BinaryOperator::NotEqual => "!=",
            BinaryOperator::Less => "<",
            BinaryOperator::LessOrEqual => "<=",
            BinaryOperator::Greater => ">",
            BinaryOperator::GreaterOrEqual => ">=",
            BinaryOperator::Add => "+",
            BinaryOperator::Subtract => "-",
            BinaryOperator::Multiply => "*",
            BinaryOperator::Divide => "/",
            BinaryOperator::Remainder => "%",
        }
    }
}

/// The binary operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum BinaryOperator {
    Or,
    And,
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
}

/// `component C(S, K)`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Component {
    /// Its shell.
    pub shell: Option<TypeRef>,
    /// Its core.
    pub core: Option<TypeRef>,
    /// Whether all of it is known; otherwise the shell may stand for the core.
    pub completeness: Completeness,
}

/// `architecture A { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Architecture {
    /// The architectures whose content it takes over; none where the name is missing.
    pub imports: Vec<Option<TypeRef>>,
    /// Its own instances.
    pub instances: Vec<Instance>,
    /// Between ports.
    pub connections: Vec<Connection>,
    /// Between operations.
    pub operations: Vec<Connection>,
    /// Values of properties and constants.
    pub settings: Vec<Setting>,
    /// Whether all instances are known.
    pub completeness: Completeness,
    /// Whether all connections are known, with their ends.
    pub connection_completeness: Completeness,
}

/// `instance i: C`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instance {
    /// Its name.
    pub name: NameRef,
    /// Its component.
    pub component: Option<TypeRef>,
}

/// `connection a.b -> c.d`, `operation a.b -> c.d`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Connection {
    /// Where it starts; none while it is half typed.
    pub source: Option<Endpoint>,
    /// Where it ends.
    pub target: Option<Endpoint>,
    /// The size of its circular buffer, as it stands.
    pub buffer: Option<(Name, SourceId)>,
}

/// `instance.feature`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    /// The instance.
    pub instance: NameRef,
    /// The port, property or operation of it.
    pub feature: Option<NameRef>,
}

/// `property a.b = …`, `constant a.b = …`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Whose.
    pub endpoint: Option<Endpoint>,
    /// The value.
    pub value: Expr,
}

/// `deployment D { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Deployment {
    /// What is deployed: one; none or several are an error.
    pub targets: Vec<TypeRef>,
    /// How its instances run.
    pub activities: Vec<Activity>,
    /// Values of properties and constants.
    pub settings: Vec<Setting>,
    /// Whether all activities are known.
    pub completeness: Completeness,
}

/// `activity i { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Activity {
    /// The instance; its name is empty while it is missing.
    pub instance: NameRef,
    /// `period = …` and the like.
    pub fields: Vec<Field>,
    /// Whether all its fields are known.
    pub completeness: Completeness,
}

/// `period = 100`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Any word; which mean something is checked.
    pub name: NameRef,
    /// As it stands.
    pub value: Expr,
    /// Where the value stands.
    pub value_id: SourceId,
}
