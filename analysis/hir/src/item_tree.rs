//! The declarations of a file, without ranges: the input of all later queries.
//!
//! An item tree has no ranges, so a comment or a blank line does not change it. Each element that a diagnostic may point
//! at has a [`SourceId`], numbered in the order of the declaration's text; `source_map` maps it to its current range.

#![allow(missing_docs, reason = "most fields and variants have the names of the language's terms")]

use std::borrow::Borrow;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use mauve_syntax::SyntaxKind;
pub use mauve_syntax::keywords::{ActivityField, CallStatus, Direction, HookKind, MethodKind, PortStatus};
use rustc_hash::{FxHashMap, FxHashSet};
use serde::{Deserialize, Serialize};

use crate::completeness::Completeness;

/// A name, or another short text, as written in the file. Cheap to clone.
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Deserialize, Serialize, salsa::SalsaValue)]
#[serde(from = "String", into = "String")]
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

impl From<Name> for String {
    fn from(name: Name) -> String {
        name.to_string()
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

/// An element of a declaration that has a range; 0 is its name. Ids increase in the order of the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, salsa::SalsaValue)]
pub struct SourceId(pub u32);

/// The declarations of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ItemTree {
    /// The declarations without their content.
    pub outline: Arc<Outline>,
    /// The content of each declaration.
    pub data: Vec<Arc<Data>>,
}

/// The declarations of a file without their content: the names that other files see. An edit in a declaration does not change
/// it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Outline {
    /// The paths of the `include` lines; `None` if the path is missing.
    pub includes: Vec<Option<String>>,
    /// The names of its `library` blocks.
    pub libraries: Vec<Name>,
    /// In the order of the text.
    pub declarations: Vec<Declaration>,
    /// Whether all declarations are known, each with its library: an unrecognised text between declarations may be a
    /// declaration, and a missing brace may be the end of a library.
    pub completeness: Completeness,
    /// The kinds of the declarations, each in a library, whose name is missing or unknown because of an error in the header.
    pub unnamed: Vec<(Option<Name>, Kind)>,
    /// The names, each in a library, that an unrecognised text, an incomplete declaration or two merged declarations may
    /// declare; `None` for any name. A library that may declare a name hides the declarations of other libraries.
    pub possible_names: Vec<(Option<Name>, Option<Name>)>,
    /// Whether all includes and libraries are known: an incomplete line may be one of them.
    pub include_completeness: Completeness,
}

impl Outline {
    /// Returns the outline of a text that may declare anything.
    pub(crate) fn unknown() -> Arc<Outline> {
        let completeness = Completeness::Incomplete;
        Arc::new(Outline { completeness, include_completeness: completeness, ..Outline::default() })
    }
}

/// The key of a declaration, by which other declarations refer to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declaration {
    /// The library that contains it; `None` outside libraries.
    pub library: Option<Name>,
    /// Its name; empty if missing.
    pub name: Name,
    pub kind: Kind,
    pub expansion: Expansion,
}

/// What a declaration adds to the size of a project.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Expansion {
    /// The number of its own features, or that of its connections, settings or activities, rounded up: one more of these rarely
    /// changes it.
    pub own: usize,
    /// The paths of the declarations that it includes.
    pub included: Vec<Vec<Name>>,
    /// The paths of the components of its instances.
    pub instances: Vec<Vec<Name>>,
}

impl Expansion {
    /// Counts of connections, settings and activities are rounded up to multiples of this one. A project may have very many
    /// small shells.
    const UNIT: usize = 8;

    pub(crate) fn of(data: &Data) -> Expansion {
        fn paths<'a>(types: impl IntoIterator<Item = &'a TypeRef>) -> Vec<Vec<Name>> {
            types.into_iter().map(|it| it.path.clone()).collect()
        }
        let (own, included) = match data {
            Data::Shell(it) => (it.features.len(), paths(&it.bases)),
            Data::Architecture(it) => {
                let own = it.connections.len() + it.operations.len() + it.settings.len();
                (own.next_multiple_of(Expansion::UNIT), paths(it.imports.iter().flatten()))
            }
            Data::Component(it) => (0, paths(&it.shell)),
            Data::Deployment(it) => {
                (it.activities.len().next_multiple_of(Expansion::UNIT), paths(&it.targets))
            }
            Data::Use | Data::Codel(_) | Data::Core(_) => return Expansion::default(),
        };
        let instances = match data {
            Data::Architecture(it) => paths(it.instances.iter().filter_map(|it| it.component.as_ref())),
            _ => Vec::new(),
        };
        Expansion { own, included, instances }
    }
}

/// The kinds of declaration; each is a namespace.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize, salsa::SalsaValue,
)]
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

/// The content of a declaration.
#[derive(Debug, Clone, PartialEq, Eq)]
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
    /// Returns the signatures of its codel, features or operations.
    pub(crate) fn signatures(&self) -> Vec<SignatureOf<'_>> {
        fn of_feature(it: &Feature) -> SignatureOf<'_> {
            SignatureOf {
                may_be_void: it.kind.is_operation(),
                ..SignatureOf::of(&it.parameters, it.ty.as_ref())
            }
        }
        match self {
            Data::Codel(it) => vec![SignatureOf::of(&it.parameters, it.result.as_ref())],
            Data::Shell(it) => it.features.iter().map(of_feature).collect(),
            Data::Core(it) => {
                it.operations.iter().map(|it| SignatureOf::of(&it.parameters, it.result.as_ref())).collect()
            }
            Data::Use | Data::Component(_) | Data::Architecture(_) | Data::Deployment(_) => Vec::new(),
        }
    }

    /// Returns the types of the values that it declares, each with whether `void` is allowed.
    pub fn types(&self) -> Vec<(&TypeRef, bool)> {
        let variables = match self {
            Data::Core(core) => core.all_variables().collect(),
            _ => Vec::new(),
        };
        types_of(self.signatures(), variables.into_iter()).collect()
    }
}

/// The parameters of a codel, an operation or another feature, and its result or its type.
pub(crate) struct SignatureOf<'a> {
    pub(crate) parameters: &'a [Parameter],
    ty: Option<&'a TypeRef>,
    may_be_void: bool,
}

impl<'a> SignatureOf<'a> {
    /// Returns the signature of a codel or an operation.
    pub(crate) fn of(parameters: &'a [Parameter], result: Option<&'a TypeRef>) -> SignatureOf<'a> {
        SignatureOf { parameters, ty: result, may_be_void: true }
    }
}

/// Returns the types in signatures and of variables; as [`Data::types`].
pub(crate) fn types_of<'a>(
    signatures: Vec<SignatureOf<'a>>,
    variables: impl Iterator<Item = &'a Variable>,
) -> impl Iterator<Item = (&'a TypeRef, bool)> {
    let in_signature = |it: SignatureOf<'a>| {
        let parameters = it.parameters.iter().filter_map(|parameter| Some((parameter.ty.as_ref()?, false)));
        parameters.chain(it.ty.map(|ty| (ty, it.may_be_void)))
    };
    let of_variables = variables.filter_map(|it| Some((it.ty.as_ref()?, false)));
    signatures.into_iter().flat_map(in_signature).chain(of_variables)
}

/// The path of a type, shell, component, …, as written: one or several segments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TypeRef {
    /// Its segments; the last is empty if it is missing.
    pub path: Vec<Name>,
    /// Its source.
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

/// The occurrence of a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NameRef {
    pub name: Name,
    /// Its source.
    pub id: SourceId,
}

/// `codel f(…): T`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Codel {
    pub parameters: Vec<Parameter>,
    pub result: Option<TypeRef>,
    /// Whether it has no syntax error; otherwise its parameters and its result are unknown.
    pub completeness: Completeness,
}

/// A parameter of a codel or an operation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// The direction of the value.
    pub direction: Direction,
    pub name: NameRef,
    pub ty: Option<TypeRef>,
}

/// `shell S { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shell {
    /// The shells that it extends.
    pub bases: Vec<TypeRef>,
    /// Properties, ports and operations.
    pub features: Vec<Feature>,
    /// Whether no error hides an item of it.
    pub completeness: Completeness,
}

/// A property, constant, port or operation of a shell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Feature {
    pub kind: FeatureKind,
    pub name: NameRef,
    /// Its type, or the result type of an operation.
    pub ty: Option<TypeRef>,
    /// The parameters of an operation.
    pub parameters: Vec<Parameter>,
    /// The range of allowed values of a constant or a property.
    pub interval: Option<Interval>,
    /// The default value of a constant or a property.
    pub value: Option<Expr>,
    /// Whether its name and, for an operation, its signature have no syntax error.
    pub completeness: Completeness,
}

/// `[low; high]`, both ends included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interval {
    pub low: Expr,
    pub high: Expr,
    /// The interval with its brackets.
    pub id: SourceId,
}

/// The kinds of feature of a shell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FeatureKind {
    Constant,
    Property,
    Input,
    Output,
    Required,
    Provided,
}

impl FeatureKind {
    /// Returns whether it is a port.
    pub fn is_port(self) -> bool {
        matches!(self, FeatureKind::Input | FeatureKind::Output)
    }

    /// Returns whether it is an operation.
    pub fn is_operation(self) -> bool {
        matches!(self, FeatureKind::Required | FeatureKind::Provided)
    }

    /// Returns whether it is a constant or a property.
    pub fn is_value(self) -> bool {
        matches!(self, FeatureKind::Constant | FeatureKind::Property)
    }
}

/// `core C(S) { … }`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Core {
    /// The shell that it implements.
    pub shell: Option<TypeRef>,
    pub variables: Vec<Variable>,
    pub handlers: Vec<Handler>,
    /// The operations that it defines; lowering shares the unchanged ones.
    pub operations: Vec<Arc<Operation>>,
    /// `configure`, `start`, `update`, `stop`, `cleanup`; lowering shares the unchanged ones.
    pub hooks: Vec<Arc<Hook>>,
    /// Its state machines: at most one; more are an error.
    pub machines: Vec<Machine>,
    /// The optional colon after its header.
    pub colon: Option<SourceId>,
    /// Whether no error hides an item of it.
    pub completeness: Completeness,
}

/// `handler h: operation`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Handler {
    pub name: NameRef,
    /// The required operation whose results it collects.
    pub operation: Option<TypeRef>,
}

impl Core {
    /// Returns the variables that its programs share: its own, and those of its state machines.
    pub(crate) fn shared_variables(&self) -> impl Iterator<Item = &Variable> {
        self.variables.iter().chain(self.machines.iter().flat_map(|machine| &machine.variables))
    }

    /// Returns the states of its state machines.
    pub fn states(&self) -> impl Iterator<Item = &State> {
        self.machines.iter().flat_map(|machine| &machine.states).map(Arc::as_ref)
    }

    /// Returns the state that a name refers to: the first.
    pub fn state(&self, name: &str) -> Option<&State> {
        self.states().find(|state| *state.name.name == *name)
    }

    /// Returns the operation of that name that it defines: the first.
    pub fn operation(&self, name: &str) -> Option<&Operation> {
        self.operations.iter().map(Arc::as_ref).find(|operation| *operation.name.name == *name)
    }

    /// Returns all programs: of operations, hooks, methods and transitions.
    pub fn programs(&self) -> Vec<&Program> {
        let mut programs: Vec<&Program> = self.operations.iter().map(|it| &it.program).collect();
        programs.extend(self.hooks.iter().map(|hook| &hook.program));
        for state in self.states() {
            programs.extend(state.methods.iter().map(|method| &method.program));
            programs.extend(state.transitions.iter().filter_map(|transition| transition.effect.as_ref()));
        }
        programs
    }

    /// Returns whether it has two behaviours, or defines an operation or a hook twice.
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
    pub name: NameRef,
    pub ty: Option<TypeRef>,
    pub value: Option<Expr>,
    /// A token at the beginning of a line that continues the value, although the user may have intended a new statement; and
    /// the white space before the token, unless there is a comment.
    pub continued: Option<(SourceId, Option<SourceId>)>,
}

/// `provide f(…): T = { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Operation {
    pub name: NameRef,
    pub parameters: Vec<Parameter>,
    pub result: Option<TypeRef>,
    /// The signature: the text between its name and the `=`.
    pub signature: SourceId,
    /// Whether the signature has no syntax error; otherwise its parameters and its result are unknown.
    pub signature_completeness: Completeness,
    /// Incomplete if the signature is.
    pub program: Program,
}

/// `update = { … }` and the like.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hook {
    pub kind: HookKind,
    /// The keyword.
    pub id: SourceId,
    pub program: Program,
}

/// `statemachine { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Machine {
    /// The keyword.
    pub id: SourceId,
    pub variables: Vec<Variable>,
    /// Its states; lowering shares the unchanged ones.
    pub states: Vec<Arc<State>>,
    /// Whether no error hides an item of it, or the name of a state.
    pub completeness: Completeness,
}

impl Machine {
    /// Returns the index of the first state of each name.
    pub fn state_indices(&self) -> FxHashMap<&Name, usize> {
        first_indices(self.states.iter().map(|state| &state.name.name))
    }
}

/// Returns the index of the first occurrence of each name.
pub(crate) fn first_indices<'a>(
    names: impl ExactSizeIterator<Item = &'a Name> + DoubleEndedIterator,
) -> FxHashMap<&'a Name, usize> {
    names.enumerate().rev().map(|(index, name)| (name, index)).collect()
}

/// `state S { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// Its name; empty if missing.
    pub name: NameRef,
    /// Whether it is the initial state.
    pub initial: bool,
    /// The text before the keyword `state`: `initial`, or an empty range.
    pub start: SourceId,
    /// `entry`, `run`, `handle`, `exit`.
    pub methods: Box<[StateMethod]>,
    /// Its transitions, in the order of the text, in which their guards are evaluated.
    pub transitions: Box<[Transition]>,
    /// Whether no error hides an item of it.
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
pub struct StateMethod {
    pub kind: MethodKind,
    /// The keyword.
    pub id: SourceId,
    pub program: Program,
}

/// `transition t if … to S { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    pub name: NameRef,
    /// Its guard; `None` if it always fires.
    pub guard: Option<Guard>,
    pub target: Option<NameRef>,
    pub effect: Option<Program>,
    /// Whether it has no syntax error outside its guard and effect.
    pub completeness: Completeness,
}

/// `if …` of a transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Guard {
    pub condition: Expr,
    /// Whether it has no syntax error.
    pub completeness: Completeness,
}

/// `{ … }`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Program {
    pub statements: Box<[Statement]>,
    /// Whether it declares variables.
    pub declares: bool,
    /// Whether it has no syntax error.
    pub completeness: Completeness,
}

/// A statement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Statement {
    Variable(Variable),
    If {
        /// The keyword.
        id: SourceId,
        condition: Expr,
        then: Box<[Statement]>,
        /// The end of the first block: an empty range.
        end: SourceId,
        otherwise: Option<Box<[Statement]>>,
    },
    Block(Box<[Statement]>),
    /// The source is the keyword.
    Return(SourceId, Option<Expr>),
    Assign(NameRef, Expr),
    Expr(Expr),
}

impl Statement {
    /// Returns the source of its first element; `None` for an empty block or a missing expression.
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
pub enum Expr {
    /// The expression is missing or not recognised.
    Missing,
    /// An operand or argument is missing: the names in it count, its value is unknown.
    Incomplete(Box<Expr>),
    Literal(Literal, SourceId),
    Name(NameRef),
    Call {
        callee: NameRef,
        arguments: Box<[Expr]>,
        id: SourceId,
    },
    Unary(UnaryOperator, Box<Expr>, SourceId),
    Binary(BinaryOperator, Box<Expr>, Box<Expr>, SourceId),
}

impl Expr {
    /// Returns the name, where the expression is one.
    pub fn as_name(&self) -> Option<&NameRef> {
        match self {
            Expr::Name(name) => Some(name),
            _ => None,
        }
    }

    /// Returns the source of the expression, without parentheses around it.
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

pub(crate) fn is_logic(operator: BinaryOperator) -> bool {
    matches!(operator, BinaryOperator::And | BinaryOperator::Or)
}

/// An operator of a left-deep expression, its right operand and its source.
pub(crate) type Operator<'a> = (BinaryOperator, &'a Expr, SourceId);

/// Returns the first operand of an expression, and its operators, the last one first: a long sum is no deep recursion.
pub(crate) fn spine(expr: &Expr, is_part: impl Fn(BinaryOperator) -> bool) -> (&Expr, Vec<Operator<'_>>) {
    let (mut first, mut operators) = (expr, Vec::new());
    while let Expr::Binary(operator, left, right, id) = first
        && is_part(*operator)
    {
        operators.push((*operator, right.as_ref(), *id));
        first = left;
    }
    (first, operators)
}

/// A literal; numbers as written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Literal {
    Int(Name),
    Float(Name),
    String(Name),
    Bool(bool),
    PortStatus(PortStatus),
    CallStatus(CallStatus),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnaryOperator {
    Not,
    Minus,
}

impl UnaryOperator {
    /// Returns the operator as written.
    pub fn text(self) -> &'static str {
        match self {
            UnaryOperator::Not => "!",
            UnaryOperator::Minus => "-",
        }
    }
}

macro_rules! binary_operators {
($($name:ident $kind:ident $text:literal,)*) => {
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BinaryOperator {
$($name,)*
}

impl BinaryOperator {
/// Returns the operator as written.
pub fn text(self) -> &'static str {
match self {
$(BinaryOperator::$name => $text,)*
}
}

pub(crate) fn from_kind(kind: SyntaxKind) -> Option<BinaryOperator> {
match kind {
$(SyntaxKind::$kind => Some(BinaryOperator::$name),)*
_ => None,
}
}
}
};
}

binary_operators! {
Or PIPE2 "||",
And AMP2 "&&",
Equal EQ2 "==",
NotEqual NEQ "!=",
Less LT "<",
LessOrEqual LTEQ "<=",
Greater GT ">",
GreaterOrEqual GTEQ ">=",
Add PLUS "+",
Subtract MINUS "-",
Multiply STAR "*",
Divide SLASH "/",
Remainder PERCENT "%",
}

/// `component C(S, K)`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Component {
    pub shell: Option<TypeRef>,
    pub core: Option<TypeRef>,
    /// Whether it has no syntax error; otherwise the first type may be the shell or the core.
    pub completeness: Completeness,
}

/// `architecture A { … }`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Architecture {
    /// The architectures that it imports; `None` if the name is missing.
    pub imports: Vec<Option<TypeRef>>,
    /// Its own instances.
    pub instances: Vec<Instance>,
    /// Connections between ports.
    pub connections: Vec<Connection>,
    /// Connections between operations.
    pub operations: Vec<Connection>,
    /// Values of properties and constants.
    pub settings: Vec<Setting>,
    /// Whether all instances are known.
    pub completeness: Completeness,
    /// Whether all connections are known, with their endpoints.
    pub connection_completeness: Completeness,
}

/// `instance i: C`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instance {
    pub name: NameRef,
    pub component: Option<TypeRef>,
}

/// `connection a.b -> c.d`, `operation a.b -> c.d`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Connection {
    /// Its source; `None` if incomplete.
    pub source: Option<Endpoint>,
    /// Its target; `None` if incomplete.
    pub target: Option<Endpoint>,
    /// The size of its circular buffer, as written.
    pub buffer: Option<(Name, SourceId)>,
}

/// `instance.feature`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    pub instance: NameRef,
    /// The port, property or operation of the instance.
    pub feature: Option<NameRef>,
}

impl Endpoint {
    /// Returns the names of its instance and its feature, if it is complete.
    pub(crate) fn names(&self) -> Option<(Name, Name)> {
        Some((self.instance.name.clone(), self.feature.as_ref()?.name.clone()))
    }
}

/// `property a.b = …`, `constant a.b = …`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The property or constant.
    pub endpoint: Option<Endpoint>,
    pub value: Expr,
}

/// `deployment D { … }`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Deployment {
    /// The deployed architectures: exactly one, otherwise an error.
    pub targets: Vec<TypeRef>,
    pub activities: Vec<Arc<Activity>>,
    /// Values of properties and constants.
    pub settings: Vec<Setting>,
    /// Whether all activities are known.
    pub completeness: Completeness,
}

/// `activity i { … }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Activity {
    /// Its name, empty if missing: that of the instance, unless it has a list of instances.
    pub name: NameRef,
    /// The instances that it executes: those of its list, otherwise the one that it is named after.
    pub instances: Vec<NameRef>,
    /// `period = …` and the like.
    pub fields: Vec<Field>,
    /// Whether all its fields are known.
    pub completeness: Completeness,
}

impl Activity {
    /// Returns whether it executes this instance.
    pub fn executes(&self, instance: &str) -> bool {
        self.instances.iter().any(|it| it.name == *instance)
    }

    /// Returns the value of a field: the first one.
    pub fn field(&self, field: ActivityField) -> Option<&Field> {
        self.fields.iter().find(|it| it.name.name == field.keyword())
    }
}

/// `period = 100`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name: any word; later queries check it.
    pub name: NameRef,
    /// Its value; missing where it is a list.
    pub value: Expr,
    /// The elements of `[…]`.
    pub list: Option<Vec<Expr>>,
    /// The word before the list: `any` or `all`.
    pub word: Option<Name>,
    /// The source of the value, with the unit of a rate.
    pub value_id: SourceId,
}

impl Field {
    /// Returns the names that are its value, or in its list.
    pub fn names(&self) -> impl Iterator<Item = &NameRef> {
        let listed = self.list.as_deref().unwrap_or(std::slice::from_ref(&self.value));
        listed.iter().filter_map(|it| it.as_name())
    }
}
