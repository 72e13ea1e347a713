//! Random components of the complete language, as data: their text in MAUVE, an interpreter, and the C++ of a program that
//! runs what was generated from the text.
//!
//! | file | is |
//! |---|---|
//! | `mod.rs` | what components are made of |
//! | `text.rs` | their text in MAUVE, which `../model.rs` writes |
//! | `random.rs` | makes them, well typed |
//! | `interpreter.rs` | what they do in a run, line by line |
//! | `rig.rs` | the C++ around generated packages: codels, and the program that runs the components |
//!
//! None of it knows the analyser or the generator.

#![allow(missing_docs, reason = "what the fields of a model are is said in the reference of the language")]

mod interpreter;
mod random;
mod rig;
mod text;

pub use interpreter::expected_run;
pub use random::random_library;
pub use rig::{codels_source, program_source};
pub use text::library_text;

/// How many periods a run has.
pub const TICKS: usize = 40;

/// Types whose values can be computed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ty {
    Int,
    /// `uint8`
    Byte,
    Float,
    Double,
    Bool,
    Text,
    /// Of `read` and `status`.
    PortStatus,
    /// Of `collect`.
    CallStatus,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Of an `int` or a `uint8`.
    Int(i64),
    Float(f32),
    Double(f64),
    Bool(bool),
    Text(String),
    /// As RTT numbers them.
    Status(i64),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    In,
    Out,
    InOut,
}

/// Of a codel or an operation.
#[derive(Debug, Clone)]
pub struct Signature {
    pub name: String,
    pub parameters: Vec<(Way, Ty)>,
    pub result: Option<Ty>,
}

/// What a name in a program stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// By its number in its program.
    Local(usize),
    Parameter(usize),
    Machine(usize),
    Core(usize),
    Property(usize),
}

#[derive(Debug, Clone)]
pub struct Variable {
    pub place: Location,
    pub name: String,
    pub ty: Ty,
}

#[derive(Debug, Clone)]
pub struct Expr {
    pub ty: Ty,
    pub form: Form,
}

#[derive(Debug, Clone)]
pub enum Form {
    Literal(Value),
    Variable(Variable),
    Unary(&'static str, Box<Expr>),
    Binary(Box<Expr>, &'static str, Box<Expr>),
    /// By its number in the library.
    Codel(usize, Vec<Expr>),
    /// One of one's own operations.
    Own(usize, Vec<Expr>),
    Read(usize, Variable),
    Status(usize),
    /// Of a handler, with what its results go to.
    Collect(usize, Vec<Variable>),
}

#[derive(Debug, Clone)]
pub enum Statement {
    Local(Variable, Option<Expr>),
    Assign(Variable, Expr),
    Call(Expr),
    Write(usize, Expr),
    /// A handler, unless the call is dropped; a required operation, and what it is given.
    Send(Option<usize>, usize, Vec<Expr>),
    If(Expr, Vec<Statement>, Vec<Statement>),
    Block(Vec<Statement>),
    Return(Option<Expr>),
}

#[derive(Debug, Clone)]
pub struct Program {
    pub body: Vec<Statement>,
    pub locals: usize,
}

#[derive(Debug, Clone)]
pub struct Property {
    pub name: String,
    pub ty: Ty,
    pub is_constant: bool,
    pub bounds: Option<(Value, Value)>,
    pub default: Value,
    /// What the run sets it to, first and later.
    pub first: Value,
    pub later: Value,
}

#[derive(Debug, Clone)]
pub struct Port {
    pub name: String,
    pub ty: Ty,
    /// Of an input: its buffer, 0 without one, below 0 if it is not connected.
    pub size: i64,
}

/// What another component provides.
#[derive(Debug, Clone)]
pub struct Required {
    pub signature: Signature,
    pub is_connected: bool,
}

#[derive(Debug, Clone)]
pub struct Transition {
    pub name: String,
    pub guard: Option<Expr>,
    pub target: usize,
    pub effect: Option<Program>,
}

#[derive(Debug, Clone)]
pub struct State {
    pub name: String,
    pub entry: Option<Program>,
    pub run: Option<Program>,
    pub handle: Option<Program>,
    pub exit: Option<Program>,
    pub transitions: Vec<Transition>,
}

#[derive(Debug, Clone, Default)]
pub struct Component {
    pub name: String,
    pub properties: Vec<Property>,
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
    /// Those that it provides, and how it does that.
    pub provided: Vec<(Signature, Vec<String>, Program)>,
    pub required: Vec<Required>,
    /// Its handlers, each with the number of a required operation.
    pub handlers: Vec<(String, usize)>,
    /// The variables of the core.
    pub core: Vec<(Variable, Option<Expr>)>,
    pub configure: Option<Program>,
    pub start: Option<Program>,
    pub stop: Option<Program>,
    pub cleanup: Option<Program>,
    /// Of a core without a state machine.
    pub update: Option<Program>,
    /// The variables of the state machine.
    pub machine: Vec<(Variable, Option<Expr>)>,
    pub states: Vec<State>,
    pub initial: usize,
    /// What decides what happens in its run.
    pub seed: u64,
}

#[derive(Debug, Clone)]
pub struct Library {
    pub codels: Vec<Signature>,
    pub components: Vec<Component>,
}
