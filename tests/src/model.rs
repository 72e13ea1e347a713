//! A model as a value: a generator makes it, a test seeds a mistake in it, and it is written as texts.
//!
//! It has the grammar without semantics: names and types are texts, and any of them may be wrong. Marks ([`marked`]) in
//! a name, a type or an expression enclose an expected location: [`Model::written`] removes the marks and returns their
//! locations.

use std::fmt::{self, Display, Formatter, Write as _};
use std::ops::Range;
use std::path::PathBuf;

/// A workspace: models, `mauve.toml` and timing tables.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// The models; the first is the root.
    pub files: Vec<File>,
    /// `mauve.toml`, then the tables.
    pub tomls: Vec<Toml>,
    /// Do items end with `;` where they may?
    pub semicolons: bool,
    /// Do lines end with `\r\n`?
    pub crlf: bool,
}

/// A model file: its includes, and its libraries in text order; a library without a name has the declarations outside
/// libraries.
#[derive(Clone, Debug, Default)]
pub struct File {
    /// Absolute.
    pub path: String,
    /// As `include` writes them.
    pub includes: Vec<String>,
    /// By library.
    pub libraries: Vec<(Option<String>, Vec<Declaration>)>,
}

/// A TOML file: sections by header, the first without one, of keys and values.
#[derive(Clone, Debug, Default)]
pub struct Toml {
    /// Absolute.
    pub path: String,
    /// As they are written.
    pub sections: Vec<(String, Vec<(String, String)>)>,
}

#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub enum Declaration {
    Use(String),
    Codel(Signature),
    Shell(Shell),
    Core(Core),
    /// Name, shell, core.
    Component(String, String, String),
    Architecture(Architecture),
    Deployment(Deployment),
}

/// A codel or an operation.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Signature {
    pub name: String,
    pub parameters: Vec<Parameter>,
    pub result: String,
}

#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Parameter {
    /// `in `, `out `, `inout `, or nothing, which is `in`.
    pub direction: &'static str,
    pub name: String,
    pub ty: String,
}

impl Parameter {
    /// Whether the caller gives it a value.
    pub fn is_given(&self) -> bool {
        self.direction != "out "
    }

    /// Whether the callee gives it a value.
    pub fn returns(&self) -> bool {
        matches!(self.direction, "out " | "inout ")
    }
}

impl Signature {
    /// The type of its result, where it has one.
    pub fn returned(&self) -> Option<&str> {
        Some(self.result.as_str()).filter(|it| !matches!(*it, "" | "void"))
    }

    /// The types of all that it returns: of its result, then of parameters.
    pub fn results(&self) -> impl Iterator<Item = &str> {
        let parameters = self.parameters.iter().filter(|it| it.returns());
        self.returned().into_iter().chain(parameters.map(|it| it.ty.as_str()))
    }
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Shell {
    pub name: String,
    pub bases: Vec<String>,
    pub values: Vec<Value>,
    pub ports: Vec<Port>,
    pub required: Vec<Signature>,
    pub provided: Vec<Signature>,
}

/// A property or a constant.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Value {
    pub keyword: &'static str,
    pub name: String,
    pub ty: String,
    /// As it is written, with its brackets.
    pub interval: Option<String>,
    /// The ends of the interval.
    pub bounds: Option<(i32, i32)>,
    pub value: Option<Expr>,
}

#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Port {
    pub is_input: bool,
    pub name: String,
    pub ty: String,
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Core {
    pub name: String,
    pub shell: String,
    pub variables: Vec<Variable>,
    /// Name and operation.
    pub handlers: Vec<(String, String)>,
    pub operations: Vec<Operation>,
    pub hooks: Vec<Program>,
    pub machines: Vec<Machine>,
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Variable {
    pub name: String,
    pub ty: String,
    pub value: Option<Expr>,
}

/// An operation with its program.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Operation {
    pub signature: Signature,
    pub body: Block,
}

/// A hook of a core or a method of a state.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Program {
    pub keyword: String,
    pub body: Block,
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Machine {
    /// `statemachine`.
    pub keyword: String,
    pub variables: Vec<Variable>,
    pub states: Vec<State>,
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct State {
    pub is_initial: bool,
    pub name: String,
    pub methods: Vec<Program>,
    pub transitions: Vec<Transition>,
    /// Behind the transitions.
    pub later_methods: Vec<Program>,
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Transition {
    pub name: String,
    pub guard: Option<Expr>,
    pub target: String,
    pub effect: Option<Block>,
}

/// The statements of a program.
pub type Block = Vec<Statement>;

#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub enum Statement {
    Variable(Variable),
    Assign(String, Expr),
    Expr(Expr),
    If(Expr, Block, Option<Block>),
    Block(Block),
    /// The keyword, and the value.
    Return(String, Option<Expr>),
}

/// An expression and its type, as a port or a parameter writes it: `status` of a port, `call` of a handler, and `int`
/// also where a `double` is asked for.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Expr {
    pub ty: String,
    pub form: Form,
}

#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub enum Form {
    /// A literal, or any text that need not be taken apart.
    Literal(String),
    Name(String),
    Call(String, Vec<Expr>),
    Unary(&'static str, Box<Expr>),
    Binary(Box<Expr>, &'static str, Box<Expr>),
    Parens(Box<Expr>),
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Architecture {
    pub name: String,
    pub imports: Vec<String>,
    /// Name and component.
    pub instances: Vec<(String, String)>,
    pub connections: Vec<Link>,
    pub operations: Vec<Link>,
    pub settings: Vec<Setting>,
}

/// A connection of ports or operations; one of ports may have a buffer, with the text between its brackets.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Link {
    pub source: (String, String),
    pub buffer: Option<String>,
    pub target: (String, String),
}

/// A value of an instance's property or constant.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Setting {
    pub keyword: &'static str,
    pub instance: String,
    pub feature: String,
    pub value: Expr,
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Deployment {
    pub name: String,
    pub targets: Vec<String>,
    pub activities: Vec<Activity>,
    pub settings: Vec<Setting>,
}

#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Activity {
    pub instance: String,
    /// Names and values.
    pub fields: Vec<(String, String)>,
}

const OPEN: char = '⟦';
const CLOSE: char = '⟧';

/// The text between marks: where something is expected.
pub fn marked(text: &str) -> String {
    format!("{OPEN}{text}{CLOSE}")
}

/// The texts of a model, and the marked locations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// Paths and texts: the models, beginning with the root, then `mauve.toml` and the tables.
    pub files: Vec<(String, String)>,
    /// Paths, and bytes of the texts.
    pub marks: Vec<(String, Range<usize>)>,
}

impl Model {
    /// Its texts, by their paths.
    pub fn texts(&self) -> Vec<(PathBuf, String)> {
        self.written().files.into_iter().map(|(path, text)| (path.into(), text)).collect()
    }

    /// Returns its texts, and the marked locations.
    pub fn written(&self) -> Written {
        let models = self.files.iter().map(|file| {
            let mut writer =
                Writer { text: String::new(), depth: 0, end: if self.semicolons { ";" } else { "" } };
            writer.file(file);
            let text = if self.crlf { writer.text.replace('\n', "\r\n") } else { writer.text };
            (file.path.clone(), text)
        });
        let tomls = self.tomls.iter().map(|toml| {
            let mut text = String::new();
            for (header, entries) in &toml.sections {
                text += &if header.is_empty() { String::new() } else { format!("[{header}]\n") };
                entries.iter().for_each(|(key, value)| {
                    let _ = writeln!(text, "{key} = {value}");
                });
            }
            (toml.path.clone(), text)
        });
        let mut written = Written { files: Vec::new(), marks: Vec::new() };
        for (path, text) in models.chain(tomls) {
            let mut plain = String::with_capacity(text.len());
            let mut start = 0;
            for letter in text.chars() {
                match letter {
                    OPEN => start = plain.len(),
                    CLOSE => written.marks.push((path.clone(), start..plain.len())),
                    letter => plain.push(letter),
                }
            }
            written.files.push((path, plain));
        }
        written
    }
}

impl Expr {
    /// Returns an expression that is only a text.
    pub fn literal(ty: &str, text: impl Into<String>) -> Expr {
        Expr { ty: ty.to_owned(), form: Form::Literal(text.into()) }
    }

    /// The same text, between marks.
    pub fn marked(&self) -> Expr {
        let inner = match &self.form {
            Form::Parens(inner) => inner,
            _ => self,
        };
        Expr::literal(&self.ty, marked(&inner.to_string()))
    }
}

/// How tightly an operator binds.
fn level(operator: &str) -> u8 {
    match operator {
        "||" => 1,
        "&&" => 2,
        "==" | "!=" => 3,
        "<" | "<=" | ">" | ">=" => 4,
        "+" | "-" => 5,
        _ => 6,
    }
}

impl Display for Expr {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let of = |expr: &Expr| match &expr.form {
            Form::Binary(_, operator, _) => level(operator),
            // `- -1`, and `a - -1`, are read by people as `--`.
            Form::Unary(..) => 7,
            _ => 8,
        };
        let within = |f: &mut Formatter<'_>, expr: &Expr, least: u8| match of(expr) < least {
            true => write!(f, "({expr})"),
            false => write!(f, "{expr}"),
        };
        match &self.form {
            Form::Literal(text) | Form::Name(text) => f.write_str(text),
            Form::Parens(inner) => write!(f, "({inner})"),
            Form::Unary(operator, inner) => {
                f.write_str(operator)?;
                within(f, inner, 8)
            }
            Form::Binary(left, operator, right) => {
                let own = level(operator);
                // Comparisons by order are not chained.
                within(f, left, if own == 4 { own + 1 } else { own })?;
                write!(f, " {operator} ")?;
                within(f, right, own + 1)
            }
            Form::Call(callee, arguments) => {
                write!(f, "{callee}(")?;
                for (index, argument) in arguments.iter().enumerate() {
                    write!(f, "{}{argument}", if index == 0 { "" } else { ", " })?;
                }
                f.write_str(")")
            }
        }
    }
}

impl Display for Signature {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}(", self.name)?;
        for (index, Parameter { direction, name, ty }) in self.parameters.iter().enumerate() {
            write!(f, "{}{direction}{name}: {ty}", if index == 0 { "" } else { ", " })?;
        }
        f.write_str(")")?;
        if self.result.is_empty() { Ok(()) } else { write!(f, ": {}", self.result) }
    }
}

struct Writer {
    text: String,
    depth: usize,
    /// The end of an item.
    end: &'static str,
}

impl Writer {
    fn line(&mut self, line: impl Display) {
        let _ = writeln!(self.text, "{:1$}{line}", "", 2 * self.depth);
    }

    fn item(&mut self, item: impl Display) {
        let end = self.end;
        self.line(format_args!("{item}{end}"));
    }

    fn within(&mut self, head: impl Display, body: impl FnOnce(&mut Writer)) {
        self.line(format_args!("{head} {{"));
        self.depth += 1;
        body(self);
        self.depth -= 1;
        self.line("}");
    }

    fn file(&mut self, file: &File) {
        for include in &file.includes {
            self.line(format_args!("include {include}"));
        }
        for (library, declarations) in &file.libraries {
            let all = |writer: &mut Writer| declarations.iter().for_each(|it| writer.declaration(it));
            match library {
                Some(library) => self.within(format_args!("library {library}"), all),
                None => all(self),
            }
        }
    }

    fn declaration(&mut self, declaration: &Declaration) {
        match declaration {
            Declaration::Use(name) => self.line(format_args!("use {name}")),
            Declaration::Codel(signature) => self.line(format_args!("codel {signature}")),
            Declaration::Shell(shell) => {
                let extends = if shell.bases.is_empty() { "" } else { " extends " };
                let head = format!("shell {}{extends}{}", shell.name, shell.bases.join(", "));
                self.within(head, |it| it.shell(shell));
            }
            Declaration::Core(core) => {
                self.within(format_args!("core {}({})", core.name, core.shell), |it| it.core(core));
            }
            Declaration::Component(name, shell, core) => {
                self.line(format_args!("component {name}({shell}, {core})"));
            }
            Declaration::Architecture(architecture) => {
                self.within(format_args!("architecture {}", architecture.name), |it| {
                    it.architecture(architecture)
                });
            }
            Declaration::Deployment(deployment) => {
                self.within(format_args!("deployment {}", deployment.name), |it| it.deployment(deployment));
            }
        }
    }

    fn shell(&mut self, shell: &Shell) {
        for Value { keyword, name, ty, interval, value, .. } in &shell.values {
            let interval = interval.as_ref().map_or(String::new(), |interval| format!(" {interval}"));
            let value = value.as_ref().map_or(String::new(), |value| format!(" = {value}"));
            self.item(format_args!("{keyword} {name}: {ty}{interval}{value}"));
        }
        for Port { is_input, name, ty } in &shell.ports {
            let way = if *is_input { "input" } else { "output" };
            self.item(format_args!("{way} port {name}: {ty}"));
        }
        shell.required.iter().for_each(|it| self.item(format_args!("require {it}")));
        shell.provided.iter().for_each(|it| self.item(format_args!("provide {it}")));
    }

    fn core(&mut self, core: &Core) {
        core.variables.iter().for_each(|it| self.variable(it));
        core.handlers.iter().for_each(|(name, of)| self.item(format_args!("handler {name}: {of}")));
        for Operation { signature, body } in &core.operations {
            self.within(format_args!("provide {signature} ="), |it| it.block(body));
        }
        core.hooks.iter().for_each(|it| self.program(it));
        for machine in &core.machines {
            self.within(&machine.keyword, |it| {
                machine.variables.iter().for_each(|variable| it.variable(variable));
                machine.states.iter().for_each(|state| it.state(state));
            });
        }
    }

    fn variable(&mut self, Variable { name, ty, value }: &Variable) {
        let value = value.as_ref().map_or(String::new(), |value| format!(" = {value}"));
        self.item(format_args!("var {name}: {ty}{value}"));
    }

    fn program(&mut self, program: &Program) {
        self.within(format_args!("{} =", program.keyword), |it| it.block(&program.body));
    }

    fn state(&mut self, state: &State) {
        let initial = if state.is_initial { "initial " } else { "" };
        self.within(format_args!("{initial}state {}", state.name), |it| {
            state.methods.iter().for_each(|method| it.program(method));
            for Transition { name, guard, target, effect } in &state.transitions {
                let guard = guard.as_ref().map_or(String::new(), |guard| format!(" if {guard}"));
                let head = format!("transition {name}{guard} to {target}");
                match effect {
                    Some(effect) => it.within(head, |it| it.block(effect)),
                    None => it.line(head),
                }
            }
            state.later_methods.iter().for_each(|method| it.program(method));
        });
    }

    fn block(&mut self, block: &Block) {
        for statement in block {
            match statement {
                Statement::Variable(variable) => self.variable(variable),
                Statement::Assign(target, value) => self.line(format_args!("{target} = {value};")),
                Statement::Expr(expr) => self.line(format_args!("{expr};")),
                Statement::Block(inner) => {
                    self.line("{");
                    self.depth += 1;
                    self.block(inner);
                    self.depth -= 1;
                    self.line("}");
                }
                Statement::If(condition, then, otherwise) => {
                    self.within(format_args!("if {condition} then"), |it| it.block(then));
                    self.otherwise(otherwise.as_ref());
                }
                Statement::Return(keyword, None) => self.line(format_args!("{keyword};")),
                Statement::Return(keyword, Some(value)) => self.line(format_args!("{keyword} {value};")),
            }
        }
    }

    /// On the line of the preceding brace; a lone `if` there has no braces around it.
    fn otherwise(&mut self, otherwise: Option<&Block>) {
        let Some(otherwise) = otherwise else { return };
        self.text.truncate(self.text.trim_end().len());
        self.text += " else ";
        let (head, body, last) = match otherwise.as_slice() {
            [Statement::If(condition, then, last)] => {
                (format!("if {condition} then {{\n"), then, last.as_ref())
            }
            _ => ("{\n".to_owned(), otherwise, None),
        };
        self.text += &head;
        self.depth += 1;
        self.block(body);
        self.depth -= 1;
        self.line("}");
        self.otherwise(last);
    }

    fn architecture(&mut self, architecture: &Architecture) {
        architecture.imports.iter().for_each(|it| self.item(format_args!("import {it}")));
        architecture.instances.iter().for_each(|(name, of)| self.item(format_args!("instance {name}: {of}")));
        for (keyword, links) in
            [("connection", &architecture.connections), ("operation", &architecture.operations)]
        {
            for Link { source: (a, b), buffer, target: (c, d) } in links {
                let buffer = buffer.as_ref().map_or(String::new(), |size| format!("[{size}] "));
                self.item(format_args!("{keyword} {a}.{b} -> {buffer}{c}.{d}"));
            }
        }
        architecture.settings.iter().for_each(|it| self.setting(it));
    }

    fn deployment(&mut self, deployment: &Deployment) {
        deployment.targets.iter().for_each(|it| self.line(format_args!("architecture {it}")));
        for Activity { instance, fields } in &deployment.activities {
            let fields: Vec<String> =
                fields.iter().map(|(name, value)| format!("{name} = {value}{}", self.end)).collect();
            self.line(format_args!("activity {instance} {{ {} }}", fields.join(" ")));
        }
        deployment.settings.iter().for_each(|it| self.setting(it));
    }

    fn setting(&mut self, Setting { keyword, instance, feature, value }: &Setting) {
        self.item(format_args!("{keyword} {instance}.{feature} = {value}"));
    }
}
