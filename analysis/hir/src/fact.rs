//! Errors and warnings of a model as facts: what was found, with names, types, figures and locations. The messages,
//! severities and fixes are in `mauve-diagnostics`.

use crate::features::FeatureOf;
pub use crate::features::Incomplete;
pub use crate::names::MayHide;
use crate::names::Unresolved;
use rustc_hash::FxHashMap;

use crate::builtin::Builtin;
use crate::item_tree::{
    BinaryOperator, FeatureKind, HookKind, Kind, MethodKind, Name, NameRef, SourceId, TypeRef, UnaryOperator,
};
use crate::link::Link;
use crate::project::Project;
use crate::source::{Decl, Location};
use crate::types::{Signature, Type, Wrong};
pub use crate::values::NoValue;
use crate::values::Value;

/// Something wrong, at a location.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Fact<'db> {
    /// Where.
    pub at: Location<'db>,
    /// What.
    pub kind: FactKind<'db>,
}

impl<'db> Fact<'db> {
    pub(crate) fn new(at: Location<'db>, kind: FactKind<'db>) -> Fact<'db> {
        Fact { at, kind }
    }

    /// Returns whether it is an error, on which no analysis may rest, and not a warning or a hint. What is not listed is an
    /// error: the safe side for a new fact. `diagnostics` asserts that this is the severity of the fact's code.
    pub fn is_error(&self) -> bool {
        use FactKind as K;
        !matches!(
            self.kind,
            K::ContinuedLine { .. }
                | K::HeaderColon
                | K::LostWrite { .. }
                | K::MissingElse { .. }
                | K::NeverTaken { .. }
                | K::NotStronglyConnected { .. }
                | K::ReadBeforeAssignment { .. }
                | K::ReservedName { .. }
                | K::UnconnectedInput { .. }
                | K::UnconnectedOperation { .. }
                | K::UnknownPackage { .. }
                | K::UnknownType { .. }
                | K::UnreachableCode(_)
                | K::UnreachableState { .. }
                | K::UnusedCodel { .. }
                | K::UnusedDeclaration { .. }
                | K::UnusedProperty { .. }
                | K::UnusedVariable { .. }
        )
    }
}

/// What is wrong. Each variant belongs to one code.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum FactKind<'db> {
    /// Several declarations have the name.
    AmbiguousName { kind: Kind, name: Name },
    /// A call has another number of arguments than what it calls takes.
    ArgumentCount { callee: Name, takes: Takes, found: usize },
    /// An argument has another type than its parameter.
    ArgumentType { callee: Name, parameter: ParameterName, expected: Type, found: Type },
    /// A value has another type than what it is assigned to.
    AssignmentType { name: Name, expected: Type, found: Type },
    /// A required operation is called like a function. With what is needed to send it instead, where that is known.
    BlockingCall { name: Name, send: Option<SendInstead> },
    /// A condition is neither true nor false.
    ConditionType { found: Type },
    /// Two definitions of one kind have one name.
    DuplicateDefinition { what: Defined, name: Name, first: Location<'db> },
    /// A core has two programs for one hook.
    DuplicateHook(HookKind),
    /// A state has two programs for one method.
    DuplicateMethod(MethodKind),
    /// No state is initial. The first state, and where `initial` belongs before it.
    NoInitialState { first: Option<(Name, SourceId)> },
    /// Several states are initial: the first two, and all that are, each with the location of its `initial`.
    SeveralInitialStates { first: (Name, SourceId), second: Name, all: Vec<(Name, SourceId)> },
    /// Every path overwrites in the same period what is written to the port.
    LostWrite { port: Name },
    /// An `if` without an `else`; the location of the end of its first block.
    MissingElse { end: SourceId },
    /// A transition behind one that has no guard.
    NeverTaken { name: Name, first: Name, first_at: Location<'db> },
    /// A statement that neither calls nor assigns.
    NoEffect,
    /// Something that no program may assign to.
    NotAssignable { name: Name, is: NotAssignable },
    /// No path leads back to the initial state from these.
    NotStronglyConnected { initial: Name, states: Vec<(Name, Location<'db>)> },
    /// An operation is defined with another signature than its shell declares: both, and the declared one as it
    /// may be written here, with the location of the one to replace.
    OperationDefinition {
        name: Name,
        declared: Signature,
        defined: Signature,
        declared_at: Location<'db>,
        fixed: Option<(SourceId, String)>,
    },
    /// An operator does not take its operands.
    UnaryOperator { operator: UnaryOperator, operand: Type },
    /// An operator does not take its operands.
    BinaryOperator { operator: BinaryOperator, operands: [Type; 2] },
    /// A constant expression has no value.
    NoValue(NoValue),
    /// An argument that something comes back to is no variable.
    OutArgument { callee: Name, parameter: ParameterName },
    /// A built-in function takes a port of the other direction.
    PortDirection { function: Builtin, port: Name, is: FeatureKind },
    /// A variable is read before anything is assigned to it.
    ReadBeforeAssignment { name: Name, declared: Location<'db> },
    /// An operation calls itself.
    RecursiveOperation { name: Name },
    /// A program gives back another type than it must.
    ReturnType { of: ProgramName, expected: Type, found: Type },
    /// An operation may end without a `return`.
    MissingReturn { name: Name, expected: Type },
    /// The shell does not provide this operation.
    UndeclaredOperation { name: Name },
    /// The core does not define this operation.
    UndefinedOperation { core: Decl<'db>, name: Name, declared: FeatureOf<'db> },
    /// Code that no path reaches.
    UnreachableCode(Unreachable),
    /// A state that no transition leads to.
    UnreachableState { name: Name },
    /// The unresolved name of a codel or operation.
    UnresolvedCodel { core: Decl<'db>, name: Name },
    /// A built-in function is called with another first argument than it takes, and no codel has its name.
    NotBuiltin(Builtin),
    /// What is called is neither a codel nor an operation, and hides what has the same name.
    NotCallable { name: Name, is: NotCallable, hides: Option<Hidden> },
    /// A handler for something that is no required operation.
    UnresolvedOperation { name: Name, shell: Name, near: Option<Name> },
    /// The target of a transition that no state is.
    UnresolvedState { name: Name, near: Option<Name> },
    /// The unresolved name of a value.
    UnresolvedVariable { name: Name, near: Option<Name> },
    /// The unresolved first argument of a built-in function.
    UnresolvedOperand { function: Builtin, name: Name, near: Option<Name> },
    /// A port is used as a value.
    PortAsValue { name: Name, kind: FeatureKind },
    /// An operation, or a codel, is used as a value.
    NotCalled { name: Name, is_operation: bool },
    /// The unresolved name of a shell, core, component or architecture.
    UnresolvedType { of: Decl<'db>, kind: Kind, ty: TypeRef },
    /// No program reads it.
    UnusedVariable { is_handler: bool, name: Name, is_removable: bool },
    /// A core without `update` and without a state machine.
    NoBehaviour,
    /// A core with a second behaviour.
    TwoBehaviours { machines: bool },
    /// A buffer of a size that none can have, as it is written.
    BufferSize { size: Name },
    /// A line that is part of the value before it, with the white space between the two, where nothing else stands there.
    ContinuedLine { name: Name, white: Option<SourceId> },
    /// The source of a connection has another type than its target: the name, the type and the declaration of both.
    ConnectionType { ends: [(String, Type, Location<'db>); 2] },
    /// A component names its core before its shell.
    CoreBeforeShell { core: TypeRef },
    /// A property or constant of an instance gets a second value.
    DuplicateValue { instance: Name, name: Name, first: Location<'db> },
    /// The first end of an interval is greater than the second.
    EmptyInterval { ends: [Value; 2] },
    /// The header of a core ends with a colon.
    HeaderColon,
    /// An architecture imports itself, over others or directly.
    ImportCycle { architecture: Name },
    /// A shell extends itself, over others or directly.
    InheritanceCycle { shell: Name },
    /// An interval of what is no number.
    IntervalType { found: Type },
    /// A property or constant of an instance has no value.
    MissingValue { instance: Name, kind: FeatureKind, name: Name, declared: Location<'db> },
    /// An expression that must be constant is not.
    NotConstant(NotConstant),
    /// An instance that `mauve.toml` names, and no deployment has.
    NotDeployed { instance: Name, near: Option<Name> },
    /// A connection between operations with different signatures, as they are shown.
    OperationSignature { provided: (Name, Signature), required: (Name, Signature) },
    /// The name of a feature refers to one of another kind.
    OtherFeature { expected: EndKind, name: Name, instance: Name, found: FeatureKind, shell: Name },
    /// A value outside the interval of what it is for, and where that is declared.
    OutsideInterval { name: Name, value: Value, interval: [Value; 2], declared: Option<Location<'db>> },
    /// A name that has another meaning in generated code.
    ReservedName { name: Name, is: Reserved },
    /// A connection that leads from where it should end to where it should start. The instance and the feature of both ends.
    SwappedEnds { kind: EndKind, source: [NameRef; 2], target: [NameRef; 2] },
    /// The declaration with which a project becomes too large to be analysed.
    TooLarge { with: Decl<'db> },
    /// An input port with two connections, of which the second stands in `of` or in what that imports.
    TwoWriters { of: Decl<'db>, first: Box<Link<'db>>, second: Box<Link<'db>> },
    /// No connection leads to input ports of an instance.
    UnconnectedInput { instance: Name, ports: Vec<Name> },
    /// No connection leads to a required operation of an instance.
    UnconnectedOperation { instance: Name, name: Name, declared: Location<'db> },
    /// A `use` of something that is neither a library nor a message package.
    UnknownPackage { name: Name },
    /// A type that is not declared anywhere.
    UnknownType { of: Decl<'db>, ty: TypeRef },
    /// The name of a feature that an instance does not have.
    UnresolvedFeature { expected: EndKind, name: Name, instance: Name, shell: Name, near: Option<Name> },
    /// The name of an instance that an architecture does not have.
    UnresolvedInstance { name: Name, architecture: Name, near: Option<Name> },
    /// A codel that no program calls.
    UnusedCodel { codel: Decl<'db> },
    /// A declaration that no deployment leads to.
    UnusedDeclaration { kind: Kind, name: Name },
    /// A property or constant that no core reads.
    UnusedProperty { kind: FeatureKind, name: Name },
    /// Something that holds a value has the type `void`.
    VoidValue,
    /// A connection that starts where it should end (`is_source`), or ends where it should start.
    WrongEnd { kind: EndKind, is_source: bool, instance: Name, name: Name },
    /// The core of a component is for another shell than the component's.
    WrongShell { core: Decl<'db>, shell: Decl<'db> },
}

/// What a call takes, where the number of its arguments is wrong.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum Takes {
    /// As many arguments as a codel or an operation has parameters.
    Arguments(usize),
    /// The port, and the variable or value, of `read`, `write` or `status`.
    Port(Builtin),
    /// The operation of `send`, and so many values.
    Send { operation: Name, values: usize },
    /// The handler of `collect`, and none or so many variables.
    Collect { values: usize },
}

/// The parameter that an argument is for.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum ParameterName {
    /// A parameter, or a port, of this name.
    Named(Name),
    /// The result of an operation, which `collect` gives back.
    Result,
}

/// How a blocking call may be sent instead, where nothing takes its result.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct SendInstead {
    /// A handler for the operation.
    pub handler: Name,
    /// The whole call.
    pub call: SourceId,
    /// Its first argument.
    pub first: Option<SourceId>,
}

/// The kinds of definition that may exist only once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Defined {
    Variable,
    Handler,
    Operation,
    State,
    Transition,
    Feature,
    Parameter,
    Instance,
    Declaration(Kind),
}

/// Why a name cannot be assigned to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum NotAssignable {
    InParameter,
    Property,
    Constant,
    OutputPort,
    InputPort,
}

/// What is called although it cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum NotCallable {
    Variable,
    Port,
    Property,
}

/// What has the name of something that cannot be called, and is hidden by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Hidden {
    Codel,
    Builtin,
}

/// The program that a `return` stands in.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum ProgramName {
    Hook(HookKind),
    Method(MethodKind),
    Effect,
    Operation(Name),
}

/// Why code is never executed.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Unreachable {
    /// Every path before it returns.
    BehindReturn,
    /// The condition of the other branch always has this value.
    Branch(bool),
    /// The guard is always false.
    Guard,
    /// The guard of this transition before it is always true.
    Behind(Name),
}

/// Why an expression is not constant.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum NotConstant {
    /// It calls this.
    Call(Name),
    /// It names this, where nothing may be named.
    NotNameable(Name),
    /// The value of this one depends on itself.
    Cycle(Name),
    /// It names this, which is no constant of the shell.
    NotOfShell(Name),
}

/// What the end of a connection, or the name before a value, must stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum EndKind {
    Port,
    Operation,
    Value,
}

impl EndKind {
    /// Returns whether it is a feature of this kind.
    pub(crate) fn takes(self, kind: FeatureKind) -> bool {
        match self {
            EndKind::Port => kind.is_port(),
            EndKind::Operation => kind.is_operation(),
            EndKind::Value => kind.is_value(),
        }
    }
}

/// What else has the name of something in generated code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Reserved {
    Cpp,
    GeneratedPort,
    GeneratedProperty,
}

/// Why a core or an architecture is not analysed, and the location of the reason.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Refusal<'db> {
    /// Why.
    pub reason: Reason<'db>,
    /// The location of the reason. Another fact reports it there.
    pub at: Location<'db>,
}

impl<'db> Refusal<'db> {
    /// Returns the refusal for an error that a fact reports.
    pub(crate) fn of_fact(project: Project<'db>, fact: &Fact<'db>) -> Refusal<'db> {
        Refusal { reason: Reason::Error(project, Box::new(fact.clone())), at: fact.at.clone() }
    }
}

/// Why a core or an architecture is not analysed.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum Reason<'db> {
    /// An error, which is reported in this project.
    Error(Project<'db>, Box<Fact<'db>>),
    /// Something in a core cannot be used.
    Core { core: Decl<'db>, why: CoreReason },
    /// An instance may be missing in the architecture, which has a syntax error.
    SyntaxErrorIn(Decl<'db>),
    /// The project is too large.
    TooLarge,
    /// The architecture imports one that is not found.
    UnknownImport { architecture: Decl<'db>, import: TypeRef },
}

/// Why a core is not analysed.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum CoreReason {
    /// The codel that it calls is not found, and may be declared all the same.
    CodelNotFound(Name, MayHide),
    /// An operation may be missing in its shell.
    IncompleteShell(Incomplete),
    /// The variable may be declared where there is an error.
    MayBeDeclared(Name),
    /// What it calls may be an operation of its shell, which has an error.
    MayBeOperation(Name),
    /// The codel that it calls is declared twice.
    RepeatedCodel(Name),
    /// It has a syntax error.
    SyntaxError(CorePart),
    /// It calls the operation and does not define it.
    UndefinedOperation(Name),
    /// Its shell is unknown.
    UnknownShell,
}

/// The part of a core that a syntax error stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum CorePart {
    Core,
    Machine,
    Transition,
    Guard,
    Program,
}

/// Returns a fact for each name in `of` that an earlier one of `names` has as well.
pub(crate) fn repeated<'db, 'a>(
    of: Decl<'db>,
    names: impl Iterator<Item = (&'a NameRef, Defined)>,
) -> Vec<Fact<'db>> {
    let mut seen: FxHashMap<&Name, SourceId> = FxHashMap::default();
    let mut found = Vec::new();
    for (NameRef { name, id }, what) in names.filter(|(name, _)| !name.name.is_empty()) {
        let first = *seen.entry(name).or_insert(*id);
        if first != *id {
            let kind = FactKind::DuplicateDefinition {
                what,
                name: name.clone(),
                first: Location::Source(of, first),
            };
            found.push(Fact::new(Location::Source(of, *id), kind));
        }
    }
    found
}

/// Returns the fact that a name of a shell, core, component or architecture is not resolved; none where the reason is
/// reported already.
pub fn unresolved_type<'db>(
    of: Decl<'db>,
    kind: Kind,
    ty: Option<&TypeRef>,
    why: &Unresolved,
) -> Option<Fact<'db>> {
    let ty = ty?;
    let fact = match why {
        Unresolved::Unknown => FactKind::UnresolvedType { of, kind, ty: ty.clone() },
        Unresolved::Ambiguous => FactKind::AmbiguousName { kind, name: ty.to_string().into() },
        Unresolved::Repeated | Unresolved::Missing | Unresolved::Incomplete => return None,
    };
    Some(Fact::new(Location::Source(of, ty.id), fact))
}

impl From<Wrong> for FactKind<'_> {
    fn from(wrong: Wrong) -> Self {
        match wrong {
            Wrong::Unary(operator, operand) => FactKind::UnaryOperator { operator, operand },
            Wrong::Binary(operator, operands) => FactKind::BinaryOperator { operator, operands },
            Wrong::NoValue(why) => FactKind::NoValue(why),
        }
    }
}
