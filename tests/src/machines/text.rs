//! The text of a library in MAUVE.

use std::fmt::Write as _;

use super::*;

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

fn parameters(signature: &Signature, names: &[String]) -> String {
    let of = |(index, (way, ty)): (usize, &(Way, Ty))| {
        let way = match way {
            Way::In => "in ",
            Way::Out => "out ",
            Way::InOut => "inout ",
        };
        format!("{way}{}: {}", names.get(index).cloned().unwrap_or(format!("a{index}")), ty.text())
    };
    signature.parameters.iter().enumerate().map(of).collect::<Vec<_>>().join(", ")
}

fn declaration(signature: &Signature, names: &[String]) -> String {
    let result = signature.result.map_or("void", Ty::text);
    format!("{}({}): {result}", signature.name, parameters(signature, names))
}

/// A library `machines` with all of it.
pub fn library_text(library: &Library) -> String {
    let mut out = String::from("library machines {\n");
    for codel in &library.codels {
        let _ = writeln!(out, "  codel {}", declaration(codel, &[]));
    }
    for component in &library.components {
        Texts { codels: &library.codels, component }.component(&mut out);
    }
    out + "}\n"
}

struct Texts<'a> {
    codels: &'a [Signature],
    component: &'a Component,
}

impl Texts<'_> {
    fn component(&self, out: &mut String) {
        let it = self.component;
        let _ = writeln!(out, "  shell {}Shell {{", it.name);
        for property in &it.properties {
            let keyword = if property.is_constant { "constant" } else { "property" };
            let bounds = property
                .bounds
                .as_ref()
                .map(|(low, high)| format!(" [{}; {}]", low.text(property.ty), high.text(property.ty)));
            let _ = writeln!(
                out,
                "    {keyword} {}: {}{} = {}",
                property.name,
                property.ty.text(),
                bounds.unwrap_or_default(),
                property.default.text(property.ty)
            );
        }
        for (way, ports) in [("input", &it.inputs), ("output", &it.outputs)] {
            for port in ports {
                let _ = writeln!(out, "    {way} port {}: {}", port.name, port.ty.text());
            }
        }
        for (signature, _, _) in &it.provided {
            let _ = writeln!(out, "    provide {}", declaration(signature, &[]));
        }
        for required in &it.required {
            let _ = writeln!(out, "    require {}", declaration(&required.signature, &[]));
        }
        let _ = writeln!(out, "  }}\n  core {0}Core({0}Shell) {{", it.name);
        self.variables(&it.core, "    ", out);
        for (handler, required) in &it.handlers {
            let _ = writeln!(out, "    handler {handler}: {}", it.required[*required].signature.name);
        }
        for (signature, names, program) in &it.provided {
            let _ = write!(out, "    provide {} = ", declaration(signature, names));
            self.program(program, "    ", out);
        }
        let hooks = [
            ("configure", &it.configure),
            ("start", &it.start),
            ("update", &it.update),
            ("stop", &it.stop),
            ("cleanup", &it.cleanup),
        ];
        for (name, program) in hooks {
            if let Some(program) = program {
                let _ = write!(out, "    {name} = ");
                self.program(program, "    ", out);
            }
        }
        if it.update.is_none() {
            *out += "    statemachine {\n";
            self.variables(&it.machine, "      ", out);
            for (index, state) in it.states.iter().enumerate() {
                self.state(state, index == it.initial, out);
            }
            *out += "    }\n";
        }
        let _ = writeln!(out, "  }}\n  component {0}({0}Shell, {0}Core)", it.name);
    }

    fn variables(&self, variables: &[(Variable, Option<Expr>)], indent: &str, out: &mut String) {
        for (variable, first) in variables {
            let first = first.as_ref().map(|it| format!(" = {}", self.expr(it, 0)));
            let (name, ty) = (&variable.name, variable.ty.text());
            let _ = writeln!(out, "{indent}var {name}: {ty}{};", first.unwrap_or_default());
        }
    }

    fn state(&self, state: &State, is_initial: bool, out: &mut String) {
        let initial = if is_initial { "initial " } else { "" };
        let _ = writeln!(out, "      {initial}state {} {{", state.name);
        let methods = [("entry", &state.entry), ("run", &state.run)];
        let later = [("exit", &state.exit), ("handle", &state.handle)];
        let method = |(name, program): (&str, &Option<Program>), out: &mut String| {
            if let Some(program) = program {
                let _ = write!(out, "        {name} = ");
                self.program(program, "        ", out);
            }
        };
        methods.into_iter().for_each(|it| method(it, out));
        for transition in &state.transitions {
            let guard = transition.guard.as_ref().map(|guard| format!(" if ({})", self.expr(guard, 0)));
            let target = &self.component.states[transition.target].name;
            let _ = write!(
                out,
                "        transition {}{} to {target}",
                transition.name,
                guard.unwrap_or_default()
            );
            match &transition.effect {
                Some(effect) => {
                    out.push(' ');
                    self.program(effect, "        ", out);
                }
                None => out.push('\n'),
            }
        }
        later.into_iter().for_each(|it| method(it, out));
        *out += "      }\n";
    }

    fn program(&self, program: &Program, indent: &str, out: &mut String) {
        self.block(&program.body, indent, out);
        out.push('\n');
    }

    fn block(&self, block: &[Statement], indent: &str, out: &mut String) {
        let inner = format!("{indent}  ");
        *out += "{\n";
        for statement in block {
            *out += &inner;
            self.statement(statement, &inner, out);
            out.push('\n');
        }
        *out += indent;
        *out += "}";
    }

    fn statement(&self, statement: &Statement, indent: &str, out: &mut String) {
        let _ = match statement {
            Statement::Local(variable, None) => write!(out, "var {}: {};", variable.name, variable.ty.text()),
            Statement::Local(variable, Some(first)) => {
                write!(out, "var {}: {} = {};", variable.name, variable.ty.text(), self.expr(first, 0))
            }
            Statement::Assign(variable, value) => write!(out, "{} = {};", variable.name, self.expr(value, 0)),
            Statement::Call(call) => write!(out, "{};", self.expr(call, 0)),
            Statement::Write(port, value) => {
                write!(out, "write({}, {});", self.component.outputs[*port].name, self.expr(value, 0))
            }
            Statement::Send(handler, required, arguments) => {
                let handler = handler.map(|handler| format!("{} = ", self.component.handlers[handler].0));
                let mut all = vec![self.component.required[*required].signature.name.clone()];
                all.extend(arguments.iter().map(|it| self.expr(it, 0)));
                write!(out, "{}send({});", handler.unwrap_or_default(), all.join(", "))
            }
            Statement::If(condition, then, otherwise) => {
                let _ = write!(out, "if ({}) then ", self.expr(condition, 0));
                self.block(then, indent, out);
                *out += " else ";
                match otherwise.as_slice() {
                    [inner @ Statement::If(..)] => self.statement(inner, indent, out),
                    _ => self.block(otherwise, indent, out),
                }
                Ok(())
            }
            Statement::Block(inner) => {
                self.block(inner, indent, out);
                Ok(())
            }
            Statement::Return(None) => write!(out, "return;"),
            Statement::Return(Some(value)) => write!(out, "return {};", self.expr(value, 0)),
        };
    }

    /// In parentheses where it binds less than `least`.
    fn expr(&self, expr: &Expr, least: usize) -> String {
        let list = |all: &[Expr]| all.iter().map(|it| self.expr(it, 0)).collect::<Vec<_>>().join(", ");
        let (binds, text) = match &expr.form {
            Form::Literal(value) => (9, value.text(expr.ty)),
            Form::Variable(variable) => (9, variable.name.clone()),
            Form::Unary(operator, inner) => (7, format!("{operator}{}", self.expr(inner, 8))),
            Form::Binary(left, operator, right) => {
                let binds = match *operator {
                    "||" => 1,
                    "&&" => 2,
                    "==" | "!=" => 3,
                    "<" | "<=" | ">" | ">=" => 4,
                    "+" | "-" => 5,
                    _ => 6,
                };
                // Comparisons do not chain.
                let left_least = if binds == 4 { 5 } else { binds };
                let (left, right) = (self.expr(left, left_least), self.expr(right, binds + 1));
                (binds, format!("{left} {operator} {right}"))
            }
            Form::Codel(codel, arguments) => {
                (9, format!("{}({})", self.codels[*codel].name, list(arguments)))
            }
            Form::Own(operation, arguments) => {
                (9, format!("{}({})", self.component.provided[*operation].0.name, list(arguments)))
            }
            Form::Read(port, variable) => {
                (9, format!("read({}, {})", self.component.inputs[*port].name, variable.name))
            }
            Form::Status(port) => (9, format!("status({})", self.component.inputs[*port].name)),
            Form::Collect(handler, variables) => {
                let mut all = vec![self.component.handlers[*handler].0.clone()];
                all.extend(variables.iter().map(|it| it.name.clone()));
                (9, format!("collect({})", all.join(", ")))
            }
        };
        if binds < least { format!("({text})") } else { text }
    }
}
