//! The text of a library in MAUVE: the library as a [`Model`], which writes itself.

use super::*;
use crate::model::{self, Declaration, File, Model};

impl Ty {
    pub(super) fn text(self) -> &'static str {
        match self {
            Ty::Int => "int",
            Ty::Byte => "uint8",
            Ty::Float => "float",
            Ty::Double => "double",
            Ty::Bool => "bool",
            Ty::Text => "string",
            Ty::PortStatus | Ty::CallStatus => unreachable!("nothing is declared with it"),
        }
    }
}

impl Value {
    /// As it is written where a `ty` is meant.
    pub(super) fn text(&self, ty: Ty) -> String {
        match self {
            Value::Int(number) => number.to_string(),
            Value::Float(number) => format!("{number:?}"),
            Value::Double(number) => format!("{number:?}"),
            Value::Bool(value) => value.to_string(),
            Value::Text(text) => {
                let mut out = String::from("\"");
                for c in text.chars() {
                    match c {
                        '"' | '\\' => out.extend(['\\', c]),
                        '\n' => out += "\\n",
                        '\t' => out += "\\t",
                        c => out.push(c),
                    }
                }
                out + "\""
            }
            Value::Status(status) if ty == Ty::PortStatus => {
                ["no_data", "old_data", "new_data"][*status as usize].to_owned()
            }
            Value::Status(status) => match status {
                ..0 => "failure".to_owned(),
                0 => "not_ready".to_owned(),
                1.. => "success".to_owned(),
            },
        }
    }
}

fn declaration(signature: &Signature, names: &[String]) -> model::Signature {
    let of = |(index, (way, ty)): (usize, &(Way, Ty))| model::Parameter {
        direction: match way {
            Way::In => "in ",
            Way::Out => "out ",
            Way::InOut => "inout ",
        },
        name: names.get(index).cloned().unwrap_or(format!("a{index}")),
        ty: ty.text().to_owned(),
    };
    model::Signature {
        name: signature.name.clone(),
        parameters: signature.parameters.iter().enumerate().map(of).collect(),
        result: signature.result.map_or("void", Ty::text).to_owned(),
    }
}

/// A library `machines` with all of it.
pub fn library_text(library: &Library) -> String {
    let codels = library.codels.iter().map(|codel| Declaration::Codel(declaration(codel, &[])));
    let components = library.components.iter().flat_map(|component| {
        let texts = Texts { codels: &library.codels, component };
        let (name, shell, core) = (&component.name, texts.shell(), texts.core());
        let whole = Declaration::Component(name.clone(), shell.name.clone(), core.name.clone());
        [Declaration::Shell(shell), Declaration::Core(core), whole]
    });
    let libraries = vec![(Some("machines".to_owned()), codels.chain(components).collect())];
    let file = File { path: "/machines.mal".to_owned(), includes: Vec::new(), libraries };
    Model { files: vec![file], semicolons: true, ..Model::default() }.written().files.swap_remove(0).1
}

fn name(name: &str) -> model::Expr {
    model::Expr { ty: String::new(), form: model::Form::Name(name.to_owned()) }
}

fn parens(inner: model::Expr) -> model::Expr {
    model::Expr { ty: String::new(), form: model::Form::Parens(Box::new(inner)) }
}

struct Texts<'a> {
    codels: &'a [Signature],
    component: &'a Component,
}

impl Texts<'_> {
    fn shell(&self) -> model::Shell {
        let it = self.component;
        let value = |property: &Property| {
            let text = |value: &Value| value.text(property.ty);
            let interval = property.bounds.as_ref();
            model::Value {
                keyword: if property.is_constant { "constant" } else { "property" },
                name: property.name.clone(),
                ty: property.ty.text().to_owned(),
                interval: interval.map(|(low, high)| format!("[{}; {}]", text(low), text(high))),
                bounds: None,
                value: Some(model::Expr::literal("", text(&property.default))),
            }
        };
        let port = |port: &Port, is_input| model::Port {
            is_input,
            name: port.name.clone(),
            ty: port.ty.text().to_owned(),
        };
        let inputs = it.inputs.iter().map(|it| port(it, true));
        model::Shell {
            name: format!("{}Shell", it.name),
            bases: Vec::new(),
            values: it.properties.iter().map(value).collect(),
            ports: inputs.chain(it.outputs.iter().map(|it| port(it, false))).collect(),
            required: it.required.iter().map(|it| declaration(&it.signature, &[])).collect(),
            provided: it.provided.iter().map(|(signature, ..)| declaration(signature, &[])).collect(),
        }
    }

    fn core(&self) -> model::Core {
        let it = self.component;
        let handler = |(handler, required): &(String, usize)| {
            (handler.clone(), it.required[*required].signature.name.clone())
        };
        let operation = |(signature, names, program): &(Signature, Vec<String>, Program)| model::Operation {
            signature: declaration(signature, names),
            body: self.block(&program.body),
        };
        let machine = model::Machine {
            keyword: "statemachine".to_owned(),
            variables: self.variables(&it.machine),
            states: it.states.iter().enumerate().map(|(index, of)| self.state(of, index)).collect(),
        };
        model::Core {
            name: format!("{}Core", it.name),
            shell: format!("{}Shell", it.name),
            variables: self.variables(&it.core),
            handlers: it.handlers.iter().map(handler).collect(),
            operations: it.provided.iter().map(operation).collect(),
            hooks: self.programs([
                ("configure", &it.configure),
                ("start", &it.start),
                ("update", &it.update),
                ("stop", &it.stop),
                ("cleanup", &it.cleanup),
            ]),
            machines: if it.update.is_none() { vec![machine] } else { Vec::new() },
        }
    }

    fn variables(&self, variables: &[(Variable, Option<Expr>)]) -> Vec<model::Variable> {
        variables.iter().map(|(variable, first)| self.variable(variable, first.as_ref())).collect()
    }

    fn variable(&self, variable: &Variable, first: Option<&Expr>) -> model::Variable {
        model::Variable {
            name: variable.name.clone(),
            ty: variable.ty.text().to_owned(),
            value: first.map(|it| self.expr(it)),
        }
    }

    fn programs<const N: usize>(&self, all: [(&str, &Option<Program>); N]) -> Vec<model::Program> {
        let some = all.into_iter().filter_map(|(keyword, program)| Some((keyword, program.as_ref()?)));
        some.map(|(keyword, program)| model::Program {
            keyword: keyword.to_owned(),
            body: self.block(&program.body),
        })
        .collect()
    }

    fn state(&self, state: &State, index: usize) -> model::State {
        let transition = |transition: &Transition| model::Transition {
            name: transition.name.clone(),
            guard: transition.guard.as_ref().map(|guard| parens(self.expr(guard))),
            target: self.component.states[transition.target].name.clone(),
            effect: transition.effect.as_ref().map(|effect| self.block(&effect.body)),
        };
        model::State {
            is_initial: index == self.component.initial,
            name: state.name.clone(),
            methods: self.programs([("entry", &state.entry), ("run", &state.run)]),
            transitions: state.transitions.iter().map(transition).collect(),
            later_methods: self.programs([("exit", &state.exit), ("handle", &state.handle)]),
        }
    }

    fn block(&self, block: &[Statement]) -> model::Block {
        block.iter().map(|statement| self.statement(statement)).collect()
    }

    fn statement(&self, statement: &Statement) -> model::Statement {
        let it = self.component;
        match statement {
            Statement::Local(variable, first) => {
                model::Statement::Variable(self.variable(variable, first.as_ref()))
            }
            Statement::Assign(variable, value) => {
                model::Statement::Assign(variable.name.clone(), self.expr(value))
            }
            Statement::Call(call) => model::Statement::Expr(self.expr(call)),
            Statement::Write(port, value) => {
                let port = name(&it.outputs[*port].name);
                model::Statement::Expr(self.call("write", [port], std::slice::from_ref(value)))
            }
            Statement::Send(handler, required, arguments) => {
                let operation = name(&it.required[*required].signature.name);
                let send = self.call("send", [operation], arguments);
                match handler {
                    Some(handler) => model::Statement::Assign(it.handlers[*handler].0.clone(), send),
                    None => model::Statement::Expr(send),
                }
            }
            Statement::If(condition, then, otherwise) => {
                let condition = parens(self.expr(condition));
                model::Statement::If(condition, self.block(then), Some(self.block(otherwise)))
            }
            Statement::Block(inner) => model::Statement::Block(self.block(inner)),
            Statement::Return(value) => {
                model::Statement::Return("return".to_owned(), value.as_ref().map(|it| self.expr(it)))
            }
        }
    }

    fn call(&self, callee: &str, first: impl IntoIterator<Item = model::Expr>, rest: &[Expr]) -> model::Expr {
        let arguments = first.into_iter().chain(rest.iter().map(|it| self.expr(it))).collect();
        model::Expr { ty: String::new(), form: model::Form::Call(callee.to_owned(), arguments) }
    }

    fn expr(&self, expr: &Expr) -> model::Expr {
        let it = self.component;
        let form = match &expr.form {
            Form::Literal(value) => model::Form::Literal(value.text(expr.ty)),
            Form::Variable(variable) => model::Form::Name(variable.name.clone()),
            Form::Unary(operator, inner) => model::Form::Unary(operator, Box::new(self.expr(inner))),
            Form::Binary(left, operator, right) => {
                model::Form::Binary(Box::new(self.expr(left)), operator, Box::new(self.expr(right)))
            }
            Form::Codel(codel, arguments) => return self.call(&self.codels[*codel].name, [], arguments),
            Form::Own(operation, arguments) => {
                return self.call(&it.provided[*operation].0.name, [], arguments);
            }
            Form::Read(port, variable) => {
                return self.call("read", [name(&it.inputs[*port].name), name(&variable.name)], &[]);
            }
            Form::Status(port) => return self.call("status", [name(&it.inputs[*port].name)], &[]),
            Form::Collect(handler, variables) => {
                let handler = name(&it.handlers[*handler].0);
                let variables = variables.iter().map(|it| name(&it.name));
                return self.call("collect", std::iter::once(handler).chain(variables), &[]);
            }
        };
        model::Expr { ty: String::new(), form }
    }
}
