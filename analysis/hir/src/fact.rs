//! Errors, warnings and hints as facts, with names, types, figures and locations. `mauve-diagnostics` has their messages,
//! severities and fixes.

use crate::features::FeatureOf;
pub use crate::features::Incomplete;
pub use crate::names::MayHide;
use crate::names::{Unresolved, resolve_type};
use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::builtin::Builtin;
use crate::item_tree::{FeatureKind, HookKind, Kind, MethodKind, Name, NameRef, SourceId, TypeRef};
use crate::link::Link;
use crate::project::Project;
pub use crate::ros2_fact::{InvalidName, Quality, Ros2Fact, Unmapped};
use crate::source::{Decl, Location};
pub use crate::types::OperatorError;
use crate::types::{Signature, Type};
pub use crate::values::NoValue;
use crate::values::Value;

/// An error, a warning or a hint, at a location.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Fact<'db> {
    /// The location.
    pub at: Location<'db>,
    /// The kind.
    pub kind: FactKind<'db>,
    /// Whether it may follow from a syntax error: it prevents the analysis, but is not reported.
    pub is_follow_up: bool,
}

impl<'db> Fact<'db> {
    pub(crate) fn new(at: Location<'db>, kind: FactKind<'db>) -> Fact<'db> {
        Fact { at, kind, is_follow_up: false }
    }

    /// Returns whether it is an error, on which no analysis may depend, instead of a warning or a hint. Kinds that are not
    /// listed are errors, which is safe for a new kind. `diagnostics` asserts that the severity of the fact's code agrees.
    pub fn is_error(&self) -> bool {
        use FactKind as K;
        if let K::Ros2(fact) = &self.kind {
            return fact.is_error();
        }
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

/// The kinds of facts. Each variant belongs to one diagnostic code, except [`FactKind::Operation`].
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum FactKind<'db> {
    /// Several declarations have the name.
    AmbiguousName { kind: Kind, name: Name },
    /// A call has a wrong number of arguments.
    ArgumentCount { callee: Name, takes: Takes, found: usize },
    /// The type of an argument differs from the type of its parameter.
    ArgumentType { callee: Name, parameter: ParameterName, expected: Type, found: Type },
    /// The type of a value differs from the type of its target.
    AssignmentType { name: Name, expected: Type, found: Type },
    /// A required operation is called like a function; with the data to send it instead, if available.
    BlockingCall { name: Name, send: Option<SendInstead> },
    /// A condition is not of type `bool`.
    ConditionType { found: Type },
    /// Two definitions of the same kind have the same name.
    DuplicateDefinition { what: Defined, name: Name, first: Location<'db> },
    /// A core has two programs for one hook.
    DuplicateHook(HookKind),
    /// A state has two programs for one method.
    DuplicateMethod(MethodKind),
    /// No state is initial; with the first state and the source for its `initial`.
    NoInitialState { first: Option<(Name, SourceId)> },
    /// Several states are initial: the first two, and all of them, each with the source of its `initial`.
    SeveralInitialStates { first: (Name, SourceId), second: Name, all: Vec<(Name, SourceId)> },
    /// Every path overwrites a write to a port in the same period.
    LostWrite { port: Name },
    /// An `if` without an `else`; with the source of the end of its first block.
    MissingElse { end: SourceId },
    /// A transition after one without a guard.
    NeverTaken { name: Name, first: Name, first_at: Location<'db> },
    /// A statement without a call or an assignment.
    NoEffect,
    /// The target of an assignment is not assignable: an `in` parameter, or a feature of this kind.
    NotAssignable { name: Name, is: Option<FeatureKind> },
    /// States without a path back to the initial state.
    NotStronglyConnected { initial: Name, states: Vec<(Name, Location<'db>)> },
    /// The signature of a definition differs from the declaration in the shell: both signatures, and the text of the declared
    /// one for this core, with the source to replace.
    OperationDefinition {
        name: Name,
        declared: Signature,
        defined: Signature,
        declared_at: Location<'db>,
        fixed: Option<(SourceId, String)>,
    },
    /// An operation or a literal has no type, or no value.
    Operation(OperatorError),
    /// An output argument is not a variable.
    OutArgument { callee: Name, parameter: ParameterName },
    /// A built-in function is called with a port of the wrong direction.
    PortDirection { function: Builtin, port: Name, is: FeatureKind },
    /// A variable is read before its first assignment.
    ReadBeforeAssignment { name: Name, declared: Location<'db> },
    /// An operation calls itself.
    RecursiveOperation { name: Name },
    /// The type of a `return` differs from the result type of its program.
    ReturnType { of: ProgramName, expected: Type, found: Type },
    /// An operation may end without a `return`.
    MissingReturn { name: Name, expected: Type },
    /// The shell does not provide this operation.
    UndeclaredOperation { name: Name },
    /// The core does not define this operation.
    UndefinedOperation { core: Decl<'db>, name: Name, declared: FeatureOf<'db> },
    /// Code that no path reaches.
    UnreachableCode(Unreachable),
    /// An unreachable state.
    UnreachableState { name: Name },
    /// The unresolved name of a codel or operation; with the number of arguments of its call, and the built-in function whose
    /// misspelling it may be: one that takes the first argument.
    UnresolvedCodel { core: Decl<'db>, name: Name, arguments: usize, builtin: Option<Builtin> },
    /// The first argument of a built-in function is of the wrong kind, and no codel has the name of the function.
    NotBuiltin {
        function: Builtin,
        /// The first argument, if it is a variable (`None`) or a feature of this kind.
        first: Option<(Name, Option<FeatureKind>)>,
        /// The arguments, if the second belongs to the first place.
        swapped: Option<[NameRef; 2]>,
        /// The handler of the first argument, or the operation of that handler.
        instead: Option<NameRef>,
    },
    /// A callee is neither a codel nor an operation, but a variable, or a feature of this kind; with the definition that it
    /// shadows.
    NotCallable { name: Name, is: Option<FeatureKind>, hides: Option<Hidden> },
    /// The operation of a handler is not a required operation.
    UnresolvedOperation { name: Name, shell: Name, near: Option<Name> },
    /// The unresolved target of a transition, or a state of this instance in `mauve.toml`.
    UnresolvedState { name: Name, instance: Option<Name>, near: Option<Name> },
    /// The unresolved name of a value.
    UnresolvedVariable { name: Name, near: Option<Name> },
    /// The unresolved first argument of a built-in function.
    UnresolvedOperand { function: Builtin, name: Name, near: Option<Name> },
    /// A port is used as a value; `is_status`: beside a port status.
    PortAsValue { name: Name, kind: FeatureKind, is_status: bool },
    /// An operation, or a codel, is used as a value; `takes_nothing`: a codel without parameters.
    NotCalled { name: Name, is_operation: bool, takes_nothing: bool },
    /// The unresolved name of a shell, core, component or architecture.
    UnresolvedType { of: Decl<'db>, kind: Kind, ty: TypeRef },
    /// A variable or handler that no program reads.
    UnusedVariable { is_handler: bool, name: Name, is_removable: bool },
    /// A core without `update` and without a state machine.
    NoBehaviour,
    /// A core with a second behaviour.
    TwoBehaviours { machines: bool },
    /// An invalid size of a buffer, as written.
    BufferSize { size: Name },
    /// A topic of ROS 2, a host or a link is wrong.
    Ros2(Ros2Fact),
    /// A line that continues the initial value of a variable; with the white space before it, unless there is a comment.
    ContinuedLine { name: Name, white: Option<SourceId> },
    /// The source and the target of a connection have different types: the name, the type and the declaration of both.
    ConnectionType { ends: [(String, Type, Location<'db>); 2] },
    /// A component names its core before its shell.
    CoreBeforeShell { core: TypeRef },
    /// A property or constant of an instance is set twice.
    DuplicateValue { instance: Name, name: Name, first: Location<'db> },
    /// The lower bound of an interval exceeds its upper bound.
    EmptyInterval { ends: [Value; 2] },
    /// The header of a core ends with a colon.
    HeaderColon,
    /// An architecture imports itself, directly or indirectly.
    ImportCycle { architecture: Name },
    /// A shell extends itself, directly or indirectly.
    InheritanceCycle { shell: Name },
    /// An interval of a type that is not numeric.
    IntervalType { found: Type },
    /// A property or constant of an instance has no value.
    MissingValue { instance: Name, kind: FeatureKind, name: Name, declared: Location<'db> },
    /// An expression that must be constant is not.
    NotConstant(NotConstant),
    /// An instance in `mauve.toml` that no deployment has.
    NotDeployed { instance: Name, near: Option<Name> },
    /// A name in a chain of `mauve.toml` is neither a codel nor an instance.
    UnresolvedEnd { name: Name, near: Option<Name> },
    /// An instance in `mauve.toml` that the deployment of its section does not have.
    NotInDeployment { deployment: Name, instance: Name, near: Option<Name> },
    /// A connection between operations with different signatures.
    OperationSignature { provided: (Name, Signature), required: (Name, Signature) },
    /// A section of `mauve.toml` that names the timing tables of several deployments, with their qualified names.
    AmbiguousDeployment { name: Name, candidates: Vec<String> },
    /// A section of `mauve.toml` by the name of a deployment whose timing tables another section has, by its qualified name.
    SecondTables { deployment: String },
    /// A deployment in `mauve.toml` that no project of the workspace has.
    UnresolvedDeployment { name: Name, near: Option<Name> },
    /// A name refers to a feature of a wrong kind.
    OtherFeature { expected: EndKind, name: Name, instance: Name, found: FeatureKind, shell: Name },
    /// A value outside the interval of its property or constant; with the location of the interval.
    OutsideInterval { name: Name, value: Value, interval: [Value; 2], declared: Option<Location<'db>> },
    /// A name that is reserved in generated code.
    ReservedName { name: Name, is: Reserved },
    /// A connection whose source and target are swapped: the instance and the feature of both.
    SwappedEnds { kind: EndKind, source: [NameRef; 2], target: [NameRef; 2] },
    /// The declaration with which the project exceeds the size limit.
    TooLarge { with: Decl<'db> },
    /// An input port with two connections; `of` or its imports contain the second.
    TwoWriters { of: Decl<'db>, first: Box<Link<'db>>, second: Box<Link<'db>> },
    /// Input ports of an instance without a connection.
    UnconnectedInput { instance: Name, ports: Vec<Name> },
    /// A required operation of an instance without a connection.
    UnconnectedOperation { instance: Name, name: Name, declared: Location<'db> },
    /// A `use` of a name that is neither a library nor a message package.
    UnknownPackage { name: Name },
    /// An unresolved type.
    UnknownType { of: Decl<'db>, ty: TypeRef },
    /// The unresolved name of a feature of an instance.
    UnresolvedFeature { expected: EndKind, name: Name, instance: Name, shell: Name, near: Option<Name> },
    /// The unresolved name of an instance of an architecture.
    UnresolvedInstance { name: Name, architecture: Name, near: Option<Name> },
    /// A codel that no program calls.
    UnusedCodel { codel: Decl<'db> },
    /// A declaration that no deployment uses.
    UnusedDeclaration { kind: Kind, name: Name },
    /// A property or constant that no core reads.
    UnusedProperty { kind: FeatureKind, name: Name },
    /// A variable, parameter or feature of type `void`.
    VoidValue,
    /// A connection whose source should be a target (`is_source`), or whose target should be a source.
    WrongEnd { kind: EndKind, is_source: bool, instance: Name, name: Name },
    /// The core of a component implements another shell than the component's.
    WrongShell { core: Decl<'db>, shell: Decl<'db> },
}

/// The expected arguments of a call with a wrong number of arguments.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum Takes {
    /// One argument for each parameter of a codel or an operation.
    Arguments(usize),
    /// The port, and the variable or value, of `read`, `write` or `status`.
    Port(Builtin),
    /// The operation of `send`, and `values` values.
    Send { operation: Name, values: usize },
    /// The handler of `collect`, and no or `values` variables.
    Collect { values: usize },
}

/// The parameter of an argument.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum ParameterName {
    /// A parameter, or a port.
    Named(Name),
    /// The result of an operation, for `collect`.
    Result,
}

/// The data to replace a blocking call, whose result is unused, with `send`.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct SendInstead {
    /// A handler for the operation.
    pub handler: Name,
    /// The call.
    pub call: SourceId,
    /// Its first argument.
    pub first: Option<SourceId>,
}

/// The kinds of definitions with unique names.
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

/// The kind of definition that a callee that cannot be called shadows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Hidden {
    Codel,
    Builtin,
}

/// The program around a `return`.
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
    /// Every path before the code returns.
    BehindReturn,
    /// The condition of the other branch always has this value.
    Branch(bool),
    /// The guard is always false.
    Guard,
    /// The guard of this earlier transition is always true.
    Behind(Name),
}

/// Why an expression is not constant.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum NotConstant {
    /// It calls this codel or operation.
    Call(Name),
    /// It contains this name, but names are not allowed here.
    NotNameable(Name),
    /// The value of this property or constant depends on itself.
    Cycle(Name),
    /// It contains this name, which is not a property or constant of the shell.
    NotOfShell(Name),
}

/// The kind of feature that an endpoint of a connection or a setting must name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum EndKind {
    Port,
    Operation,
    Value,
}

impl EndKind {
    /// Returns whether a feature of this kind is allowed.
    pub(crate) fn takes(self, kind: FeatureKind) -> bool {
        match self {
            EndKind::Port => kind.is_port(),
            EndKind::Operation => kind.is_operation(),
            EndKind::Value => kind.is_value(),
        }
    }
}

/// Why a name is reserved in generated code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum Reserved {
    Cpp,
    GeneratedPort,
    GeneratedProperty,
}

/// Why a core or an architecture is not analysed, and the location of the reason.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct ModelRefusal<'db> {
    /// The reason.
    pub reason: ModelReason<'db>,
    /// The location of the reason. Another fact reports it there.
    pub at: Location<'db>,
}

impl<'db> ModelRefusal<'db> {
    /// Returns the refusal for an error that a fact reports.
    pub(crate) fn of_fact(project: Project<'db>, fact: &Fact<'db>) -> ModelRefusal<'db> {
        ModelRefusal { reason: ModelReason::Error(project, Box::new(fact.clone())), at: fact.at.clone() }
    }
}

/// Why a core or an architecture is not analysed.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum ModelReason<'db> {
    /// An error, reported in this project.
    Error(Project<'db>, Box<Fact<'db>>),
    /// An incomplete or erroneous core.
    Core { core: Decl<'db>, why: CoreReason },
    /// A syntax error in the architecture may hide an instance.
    SyntaxErrorIn(Decl<'db>),
    /// The project is too large.
    TooLarge,
    /// The architecture has an unresolved import.
    UnknownImport { architecture: Decl<'db>, import: TypeRef },
}

/// Why a core is not analysed.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum CoreReason {
    /// A call is unresolved, and an error may hide the codel's declaration.
    CodelNotFound(Name, MayHide),
    /// An operation may be missing in its shell.
    IncompleteShell(Incomplete),
    /// A name is unresolved, and a syntax error may hide the variable's declaration.
    MayBeDeclared(Name),
    /// A call is unresolved, and may call an operation of the shell, which is incomplete.
    MayBeOperation(Name),
    /// A called codel is declared twice.
    RepeatedCodel(Name),
    /// It has a syntax error.
    SyntaxError(CorePart),
    /// A called operation is not defined.
    UndefinedOperation(Name),
    /// Its shell is unknown.
    UnknownShell,
}

/// The element of a core that contains a syntax error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
#[allow(missing_docs)]
pub enum CorePart {
    Core,
    Machine,
    Transition,
    Guard,
    Program,
}

/// Collects the facts of a declaration. The modules of the checks add methods to it.
pub(crate) struct Checker<'db> {
    pub(crate) db: &'db dyn ModelDb,
    pub(crate) project: Project<'db>,
    pub(crate) of: Decl<'db>,
    pub(crate) found: Vec<Fact<'db>>,
}

impl<'db> Checker<'db> {
    pub(crate) fn at(&self, id: SourceId) -> Location<'db> {
        Location::Source(self.of, id)
    }

    pub(crate) fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.report_at(self.at(id), kind);
    }

    pub(crate) fn report_at(&mut self, at: Location<'db>, kind: FactKind<'db>) {
        self.found.push(Fact::new(at, kind));
    }

    /// Resolves the name of a shell, core, component or architecture that the declaration contains.
    pub(crate) fn resolve(&self, kind: Kind, ty: Option<&TypeRef>) -> Result<Decl<'db>, Unresolved> {
        resolve_type(self.db, self.project, self.of, kind, ty)
    }

    /// [`Checker::resolve`], which reports an unresolved name, unless another fact reports the reason.
    pub(crate) fn resolve_or_report(&mut self, kind: Kind, ty: Option<&TypeRef>) -> Option<Decl<'db>> {
        let found = self.resolve(kind, ty);
        if let Err(why) = &found {
            self.found.extend(unresolved_type(self.of, kind, ty, why));
        }
        found.ok()
    }
}

/// Returns a fact for each of `names`, all in `of`, that equals an earlier one.
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

/// Returns the fact for an unresolved name of a shell, core, component or architecture; `None` if another fact reports the
/// reason.
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
