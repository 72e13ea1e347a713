//! What components do in a run, line by line: an interpreter that follows the reference of the language, and the rig.

use std::collections::VecDeque;

use super::*;

/// Numbers that look random: those of `tests/orocos/rig/recorder.cpp`.
struct Drawn(u64);

impl Drawn {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) % bound
    }

    fn value(&mut self, ty: Ty) -> Value {
        match ty {
            Ty::Int => Value::Int(self.below(21) as i64 - 10),
            Ty::Byte => Value::Int(self.below(6) as i64),
            Ty::Float => Value::Float((self.below(41) as f32 - 20.0) / 4.0),
            Ty::Double => Value::Double((self.below(41) as f64 - 20.0) / 4.0),
            Ty::Bool => Value::Bool(self.below(2) == 1),
            Ty::Text => {
                let texts = ["", "a", "left/\"wheel\"", "\\n", "??/", "é\n\t"];
                Value::Text(texts[self.below(6) as usize].to_owned())
            }
            Ty::PortStatus | Ty::CallStatus => unreachable!("nobody draws one"),
        }
    }
}

/// What a variable without a value holds; nobody sees it.
fn nothing(ty: Ty) -> Value {
    match ty {
        Ty::Int | Ty::Byte => Value::Int(0),
        Ty::Float => Value::Float(0.0),
        Ty::Double => Value::Double(0.0),
        Ty::Bool => Value::Bool(false),
        Ty::Text => Value::Text(String::new()),
        Ty::PortStatus | Ty::CallStatus => Value::Status(0),
    }
}

/// What a variable holds before the component is configured: its first value, where that is known beforehand.
fn at_first((variable, first): &(Variable, Option<Expr>)) -> Value {
    let known = first.as_ref().and_then(known);
    known.map_or_else(|| nothing(variable.ty), |value| convert(value, variable.ty))
}

/// The value of an expression of nothing but literals.
fn known(expr: &Expr) -> Option<Value> {
    let value = match &expr.form {
        Form::Literal(value) => value.clone(),
        Form::Unary(_, inner) => negated(known(inner)?, expr.ty).ok()?,
        Form::Binary(left, operator @ ("&&" | "||"), right) => {
            let (left, right) = (known(left)?, known(right)?);
            if left == Value::Bool(*operator == "&&") { right } else { left }
        }
        Form::Binary(left, operator, right) => binary(known(left)?, operator, known(right)?, expr.ty).ok()?,
        _ => return None,
    };
    Some(convert(value, expr.ty))
}

fn negated(value: Value, ty: Ty) -> Step<Value> {
    Ok(match value {
        Value::Bool(value) => Value::Bool(!value),
        Value::Int(number) => whole(-number, ty)?,
        Value::Float(number) => Value::Float(-number),
        Value::Double(number) => Value::Double(-number),
        other => other,
    })
}

fn show(value: &Value) -> String {
    match value {
        Value::Int(number) | Value::Status(number) => number.to_string(),
        Value::Float(number) => format!("f{:08x}", number.to_bits()),
        Value::Double(number) => format!("d{:016x}", number.to_bits()),
        Value::Bool(value) => value.to_string(),
        Value::Text(text) => {
            let mut out = String::from("\"");
            for byte in text.bytes() {
                match byte {
                    b'"' | b'\\' => out += &format!("\\x{byte:02x}"),
                    b' '..=b'~' => out.push(byte as char),
                    _ => out += &format!("\\x{byte:02x}"),
                }
            }
            out + "\""
        }
    }
}

fn list(values: &[Value]) -> String {
    values.iter().map(show).collect::<Vec<_>>().join(", ")
}

/// A value where a `ty` is asked for.
fn convert(value: Value, ty: Ty) -> Value {
    match (value, ty) {
        (Value::Int(number), Ty::Double) => Value::Double(number as f64),
        (Value::Int(number), Ty::Float) => Value::Float(number as f32),
        (Value::Float(number), Ty::Double) => Value::Double(f64::from(number)),
        (Value::Double(number), Ty::Float) => Value::Float(number as f32),
        (value, _) => value,
    }
}

/// Why a program ends before its end.
enum Stop {
    Return(Option<Value>),
    /// It does what a language does not say: a whole number overflows, a division by zero. Such a component proves nothing.
    Undefined,
}

type Step<T> = Result<T, Stop>;

/// A connection.
#[derive(Default)]
struct Channel {
    size: i64,
    fresh: VecDeque<Value>,
    last: Option<Value>,
}

/// A call of a required operation.
struct Call {
    required: usize,
    arguments: Vec<Value>,
    /// The result, then what comes back.
    results: Option<Vec<Value>>,
}

/// An operation that the rig has asked for.
struct Asked {
    arguments: Vec<Value>,
    answer: Option<Answer>,
}

/// What it has got.
#[derive(Clone)]
enum Answer {
    Results(Vec<Value>),
    /// The component does not run.
    Refusal,
}

#[derive(Default)]
struct Frame {
    locals: Vec<Value>,
    parameters: Vec<Value>,
}

#[derive(PartialEq)]
enum Life {
    Unconfigured,
    Stopped,
    Running,
}

struct Run<'a> {
    codels: &'a [Signature],
    it: &'a Component,
    lines: Vec<String>,
    random: Drawn,
    results: Drawn,
    life: Life,
    properties: Vec<Value>,
    frozen: Vec<Value>,
    core: Vec<Value>,
    machine: Vec<Value>,
    state: usize,
    channels: Vec<Channel>,
    status: Vec<i64>,
    outputs: Vec<Vec<Value>>,
    calls: Vec<Call>,
    waiting: VecDeque<usize>,
    handlers: Vec<Option<usize>>,
    /// The last calls that were sent for the handlers; those of the required operations that were sent for none.
    last: Vec<Option<usize>>,
    last_dropped: Vec<Option<usize>>,
    asked: Vec<Option<Asked>>,
    queue: VecDeque<usize>,
}

/// The lines of a run; nothing where it comes to something that no language defines.
pub fn expected_run(library: &Library, component: &Component) -> Option<Vec<String>> {
    let it = component;
    let mut run = Run {
        codels: &library.codels,
        it,
        lines: vec![format!("== {}", it.name)],
        random: Drawn(it.seed),
        results: Drawn(!it.seed),
        life: Life::Unconfigured,
        properties: it.properties.iter().map(|it| convert(it.first.clone(), it.ty)).collect(),
        frozen: it.properties.iter().map(|it| convert(it.default.clone(), it.ty)).collect(),
        core: it.core.iter().map(at_first).collect(),
        machine: it.machine.iter().map(at_first).collect(),
        state: it.initial,
        channels: it.inputs.iter().map(|it| Channel { size: it.size, ..Channel::default() }).collect(),
        status: vec![0; it.inputs.len()],
        outputs: vec![Vec::new(); it.outputs.len()],
        calls: Vec::new(),
        waiting: VecDeque::new(),
        handlers: vec![None; it.handlers.len()],
        last: vec![None; it.handlers.len()],
        last_dropped: vec![None; it.required.len()],
        asked: it.provided.iter().map(|_| None).collect(),
        queue: VecDeque::new(),
    };
    for tick in 0..TICKS {
        run.tick(tick).ok()?;
    }
    // As the rig ends.
    if run.life == Life::Running {
        run.hook(&it.stop, "stop").ok()?;
    }
    Some(run.lines)
}

impl Run<'_> {
    fn line(&mut self, text: String) {
        self.lines.push(text);
    }

    fn tick(&mut self, tick: usize) -> Step<()> {
        self.line(format!("tick {tick}"));
        let it = self.it;
        if tick == 3 {
            self.properties = it.properties.iter().map(|it| convert(it.later.clone(), it.ty)).collect();
        }
        self.live()?;
        for (index, port) in it.inputs.iter().enumerate() {
            for _ in 0..self.random.below(3) {
                let value = self.random.value(port.ty);
                let channel = &mut self.channels[index];
                if channel.size >= 0 {
                    if channel.fresh.len() as i64 >= channel.size.max(1) {
                        channel.fresh.pop_front();
                    }
                    channel.fresh.push_back(value);
                }
            }
        }
        for (index, (signature, _, _)) in it.provided.iter().enumerate() {
            if self.asked[index].is_none() && self.random.below(4) == 0 {
                let draw = |(way, ty): &(Way, Ty)| {
                    if *way == Way::Out { nothing(*ty) } else { self.random.value(*ty) }
                };
                let arguments = signature.parameters.iter().map(draw).collect();
                self.asked[index] = Some(Asked { arguments, answer: None });
                self.queue.push_back(index);
            }
        }
        if self.random.below(2) == 0 {
            while let Some(call) = self.waiting.pop_front() {
                self.serve(call);
            }
        }
        self.step()?;
        for (index, port) in it.outputs.iter().enumerate() {
            for value in std::mem::take(&mut self.outputs[index]) {
                self.line(format!("out {} {}", port.name, show(&value)));
            }
        }
        for (index, (signature, _, _)) in it.provided.iter().enumerate() {
            let Some(asked) = &self.asked[index] else { continue };
            match asked.answer.clone() {
                None => self.line(format!("waits for {}", signature.name)),
                Some(answer) => {
                    match answer {
                        Answer::Results(results) => {
                            self.line(format!("done {} 1 -> {}", signature.name, list(&results)))
                        }
                        Answer::Refusal => self.line(format!("refused {}", signature.name)),
                    }
                    self.asked[index] = None;
                }
            }
        }
        Ok(())
    }

    /// What the other component does with a call.
    fn serve(&mut self, call: usize) {
        let it = self.it;
        let signature = &it.required[self.calls[call].required].signature;
        let arguments = &self.calls[call].arguments;
        let ins: Vec<Value> = signature
            .parameters
            .iter()
            .zip(arguments)
            .filter(|((way, _), _)| *way != Way::Out)
            .map(|(_, value)| value.clone())
            .collect();
        let results = self.draw_results(signature);
        self.line(format!("served {}({}) -> {}", signature.name, list(&ins), list(&results)));
        self.calls[call].results = Some(results);
    }

    fn draw_results(&mut self, signature: &Signature) -> Vec<Value> {
        let mut results: Vec<Value> =
            signature.result.iter().map(|result| self.results.value(*result)).collect();
        for (way, ty) in &signature.parameters {
            if *way != Way::In {
                results.push(self.results.value(*ty));
            }
        }
        results
    }

    // The life of a component.

    fn live(&mut self) -> Step<()> {
        let it = self.it;
        if self.life == Life::Running {
            if self.random.below(10) != 0 {
                return Ok(());
            }
            self.life = Life::Stopped;
            self.hook(&it.stop, "stop")?;
            self.line("stop true".to_owned());
            if self.random.below(2) == 0 {
                self.life = Life::Unconfigured;
                self.hook(&it.cleanup, "cleanup")?;
                self.line("cleanup true".to_owned());
            }
            return Ok(());
        }
        if self.life == Life::Unconfigured {
            if self.random.below(3) == 0 {
                return Ok(());
            }
            let is_configured = self.configure()?;
            if is_configured {
                self.life = Life::Stopped;
            }
            self.line(format!("configure {is_configured}"));
        }
        if self.life == Life::Stopped {
            let is_started = self.start()?;
            if is_started {
                self.life = Life::Running;
            }
            self.line(format!("start {is_started}"));
        }
        Ok(())
    }

    fn configure(&mut self) -> Step<bool> {
        let it = self.it;
        for (property, value) in it.properties.iter().zip(&self.properties) {
            if let Some((low, high)) = &property.bounds {
                let number = |value: &Value| match value {
                    Value::Int(number) => *number as f64,
                    Value::Float(number) => f64::from(*number),
                    Value::Double(number) => *number,
                    _ => 0.0,
                };
                if number(value) < number(low) || number(value) > number(high) {
                    return Ok(false);
                }
            }
        }
        self.frozen = self.properties.clone();
        self.status.iter_mut().for_each(|status| *status = 0);
        self.handlers.iter_mut().for_each(|handler| *handler = None);
        for (index, (variable, first)) in it.core.iter().enumerate() {
            self.core[index] = match first {
                Some(first) => convert(self.expr(first, &mut Frame::default())?, variable.ty),
                None => nothing(variable.ty),
            };
        }
        Ok(self.hook(&it.configure, "configure")? != Some(Value::Bool(false)))
    }

    fn start(&mut self) -> Step<bool> {
        let it = self.it;
        for (index, (variable, first)) in it.machine.iter().enumerate() {
            self.machine[index] = match first {
                Some(first) => convert(self.expr(first, &mut Frame::default())?, variable.ty),
                None => nothing(variable.ty),
            };
        }
        if self.hook(&it.start, "start")? == Some(Value::Bool(false)) {
            return Ok(false);
        }
        self.state = it.initial;
        if let Some(state) = it.states.get(self.state) {
            self.method(&state.entry, &state.name, "", "entry")?;
        }
        Ok(true)
    }

    /// What the component's engine does in a period.
    fn step(&mut self) -> Step<()> {
        let it = self.it;
        while let Some(operation) = self.queue.pop_front() {
            if self.life != Life::Running {
                if let Some(asked) = &mut self.asked[operation] {
                    asked.answer = Some(Answer::Refusal);
                }
                continue;
            }
            let mut arguments =
                self.asked[operation].as_ref().map(|asked| asked.arguments.clone()).unwrap_or_default();
            let result = self.operation(operation, &mut arguments)?;
            let mut results: Vec<Value> = result.into_iter().collect();
            for ((way, _), value) in it.provided[operation].0.parameters.iter().zip(arguments) {
                if *way != Way::In {
                    results.push(value);
                }
            }
            if let Some(asked) = &mut self.asked[operation] {
                asked.answer = Some(Answer::Results(results));
            }
        }
        if self.life != Life::Running {
            return Ok(());
        }
        self.line(format!("> component {}", it.name));
        if it.update.is_some() {
            self.hook(&it.update, "update")?;
        } else {
            self.period()?;
        }
        self.line(format!("< component {}", it.name));
        Ok(())
    }

    fn period(&mut self) -> Step<()> {
        let it = self.it;
        let state = &it.states[self.state];
        self.method(&state.run, &state.name, "", "run")?;
        for transition in &state.transitions {
            let fires = match &transition.guard {
                None => true,
                Some(guard) => {
                    self.span(true, &state.name, &transition.name, "guard");
                    let fires = self.expr(guard, &mut Frame::default())? == Value::Bool(true);
                    self.span(false, &state.name, &transition.name, "guard");
                    fires
                }
            };
            if fires {
                self.method(&state.exit, &state.name, "", "exit")?;
                self.method(&transition.effect, &state.name, &transition.name, "effect")?;
                self.state = transition.target;
                let target = &it.states[transition.target];
                return self.method(&target.entry, &target.name, "", "entry").map(drop);
            }
        }
        self.method(&state.handle, &state.name, "", "handle").map(drop)
    }

    // Programs.

    fn span(&mut self, begins: bool, state: &str, transition: &str, program: &str) {
        let sign = if begins { '>' } else { '<' };
        let name = &self.it.name;
        let mut what = program.to_owned();
        for part in [state, transition] {
            what += ", ";
            what += part;
        }
        self.line(format!("{sign} {name} machines.{name}: {what}"));
    }

    fn hook(&mut self, program: &Option<Program>, name: &str) -> Step<Option<Value>> {
        self.method(program, "", "", name)
    }

    fn method(
        &mut self,
        program: &Option<Program>,
        state: &str,
        transition: &str,
        name: &str,
    ) -> Step<Option<Value>> {
        let Some(program) = program else { return Ok(None) };
        self.span(true, state, transition, name);
        let mut frame = Frame { locals: vec![Value::Status(0); program.locals], parameters: Vec::new() };
        let result = self.body(program, &mut frame)?;
        self.span(false, state, transition, name);
        Ok(result)
    }

    /// One's own operation; what comes back of its arguments is in their places.
    fn operation(&mut self, operation: usize, arguments: &mut Vec<Value>) -> Step<Option<Value>> {
        let (signature, _, program) = &self.it.provided[operation];
        self.span(true, "", &signature.name, "operation");
        let locals = vec![Value::Status(0); program.locals];
        let mut frame = Frame { locals, parameters: std::mem::take(arguments) };
        let result = self.body(program, &mut frame)?;
        *arguments = frame.parameters;
        self.span(false, "", &signature.name, "operation");
        Ok(result.and_then(|result| Some(convert(result, signature.result?))))
    }

    fn body(&mut self, program: &Program, frame: &mut Frame) -> Step<Option<Value>> {
        match self.block(&program.body, frame) {
            Ok(()) => Ok(None),
            Err(Stop::Return(value)) => Ok(value),
            Err(Stop::Undefined) => Err(Stop::Undefined),
        }
    }

    fn block(&mut self, block: &[Statement], frame: &mut Frame) -> Step<()> {
        block.iter().try_for_each(|statement| self.statement(statement, frame))
    }

    fn statement(&mut self, statement: &Statement, frame: &mut Frame) -> Step<()> {
        match statement {
            Statement::Local(variable, first) => {
                let value = match first {
                    Some(first) => self.expr(first, frame)?,
                    None => nothing(variable.ty),
                };
                self.assign(variable, value, frame);
            }
            Statement::Assign(variable, value) => {
                let value = self.expr(value, frame)?;
                self.assign(variable, value, frame);
            }
            Statement::Call(call) => drop(self.call(call, frame)?),
            Statement::Write(port, value) => {
                let value = self.expr(value, frame)?;
                self.outputs[*port].push(convert(value, self.it.outputs[*port].ty));
            }
            Statement::Send(handler, required, arguments) => {
                let (it, required) = (self.it, *required);
                let parameters = &it.required[required].signature.parameters;
                let mut given = Vec::new();
                let mut arguments = arguments.iter();
                for (way, ty) in parameters {
                    given.push(match way {
                        Way::Out => nothing(*ty),
                        _ => match arguments.next() {
                            Some(argument) => convert(self.expr(argument, frame)?, *ty),
                            None => nothing(*ty),
                        },
                    });
                }
                let last = match handler {
                    Some(handler) => &mut self.last[*handler],
                    None => &mut self.last_dropped[required],
                };
                // What goes both ways is where the last call of the handler, or of those without one, has it.
                let is_under_way = last.is_some_and(|call| self.calls[call].results.is_none());
                if is_under_way && parameters.iter().any(|(way, _)| *way == Way::InOut) {
                    return Ok(());
                }
                *last = it.required[required].is_connected.then(|| {
                    self.calls.push(Call { required, arguments: given, results: None });
                    self.waiting.push_back(self.calls.len() - 1);
                    self.calls.len() - 1
                });
                if let Some(handler) = handler {
                    self.handlers[*handler] = *last;
                }
            }
            Statement::If(condition, then, otherwise) => {
                let branch = if self.expr(condition, frame)? == Value::Bool(true) { then } else { otherwise };
                self.block(branch, frame)?;
            }
            Statement::Block(inner) => self.block(inner, frame)?,
            Statement::Return(value) => {
                let value = value.as_ref().map(|value| self.expr(value, frame)).transpose()?;
                return Err(Stop::Return(value));
            }
        }
        Ok(())
    }

    fn assign(&mut self, variable: &Variable, value: Value, frame: &mut Frame) {
        let value = convert(value, variable.ty);
        match variable.place {
            Location::Local(index) => frame.locals[index] = value,
            Location::Parameter(index) => frame.parameters[index] = value,
            Location::Machine(index) => self.machine[index] = value,
            Location::Core(index) => self.core[index] = value,
            Location::Property(_) => unreachable!("nobody assigns it"),
        }
    }

    fn value_of(&self, variable: &Variable, frame: &Frame) -> Value {
        match variable.place {
            Location::Local(index) => frame.locals[index].clone(),
            Location::Parameter(index) => frame.parameters[index].clone(),
            Location::Machine(index) => self.machine[index].clone(),
            Location::Core(index) => self.core[index].clone(),
            Location::Property(index) if self.it.properties[index].is_constant => self.frozen[index].clone(),
            Location::Property(index) => self.properties[index].clone(),
        }
    }

    // Expressions.

    fn expr(&mut self, expr: &Expr, frame: &mut Frame) -> Step<Value> {
        let value = self.call(expr, frame)?;
        Ok(convert(value.unwrap_or(Value::Status(0)), expr.ty))
    }

    /// A call may give nothing.
    fn call(&mut self, expr: &Expr, frame: &mut Frame) -> Step<Option<Value>> {
        Ok(Some(match &expr.form {
            Form::Literal(value) => value.clone(),
            Form::Variable(variable) => self.value_of(variable, frame),
            Form::Unary(_, inner) => negated(self.expr(inner, frame)?, expr.ty)?,
            Form::Binary(left, operator, right) => {
                let first = self.expr(left, frame)?;
                match (*operator, &first) {
                    ("&&", Value::Bool(false)) | ("||", Value::Bool(true)) => return Ok(Some(first)),
                    ("&&" | "||", _) => return Ok(Some(self.expr(right, frame)?)),
                    _ => {}
                }
                let second = self.expr(right, frame)?;
                binary(first, operator, second, expr.ty)?
            }
            Form::Codel(codel, arguments) => {
                let signature = &self.codels[*codel];
                // What is given by reference is what the variable holds when the codel is called.
                let mut values = Vec::new();
                for ((way, ty), argument) in signature.parameters.iter().zip(arguments) {
                    values.push(match way {
                        Way::In => Some(convert(self.expr(argument, frame)?, *ty)),
                        _ => None,
                    });
                }
                let mut ins = Vec::new();
                for (index, (way, _)) in signature.parameters.iter().enumerate() {
                    match (way, values[index].take(), &arguments[index].form) {
                        (Way::In, Some(value), _) => ins.push(value),
                        (Way::InOut, _, Form::Variable(variable)) => ins.push(self.value_of(variable, frame)),
                        _ => {}
                    }
                }
                let component = &self.it.name;
                self.line(format!("> {component} codel machines.{}", signature.name));
                let results = self.draw_results(signature);
                self.line(format!("{}({}) -> {}", signature.name, list(&ins), list(&results)));
                let mut results = results.into_iter();
                let result = signature.result.and_then(|_| results.next());
                for ((way, _), argument) in signature.parameters.iter().zip(arguments) {
                    if let (Way::Out | Way::InOut, Form::Variable(variable)) = (way, &argument.form)
                        && let Some(value) = results.next()
                    {
                        self.assign(variable, value, frame);
                    }
                }
                return Ok(result);
            }
            Form::Own(operation, arguments) => {
                let signature = &self.it.provided[*operation].0;
                let mut given = Vec::new();
                for ((way, ty), argument) in signature.parameters.iter().zip(arguments) {
                    given.push(match way {
                        Way::In => convert(self.expr(argument, frame)?, *ty),
                        _ => nothing(*ty),
                    });
                }
                for (index, (way, _)) in signature.parameters.iter().enumerate() {
                    if let (Way::Out | Way::InOut, Form::Variable(variable)) = (way, &arguments[index].form) {
                        given[index] = self.value_of(variable, frame);
                    }
                }
                let result = self.operation(*operation, &mut given)?;
                for (index, (way, _)) in signature.parameters.iter().enumerate() {
                    if let (Way::Out | Way::InOut, Form::Variable(variable)) = (way, &arguments[index].form) {
                        self.assign(variable, given[index].clone(), frame);
                    }
                }
                return Ok(result);
            }
            Form::Read(port, variable) => {
                let channel = &mut self.channels[*port];
                let status = if let Some(value) = channel.fresh.pop_front() {
                    channel.last = Some(value);
                    2
                } else {
                    i64::from(channel.last.is_some())
                };
                if let Some(value) = channel.last.clone() {
                    self.assign(variable, value, frame);
                }
                self.status[*port] = status;
                Value::Status(status)
            }
            Form::Status(port) => Value::Status(self.status[*port]),
            Form::Collect(handler, variables) => {
                let call = self.handlers[*handler];
                match call.map(|call| self.calls[call].results.clone()) {
                    None => Value::Status(-1),
                    Some(None) => Value::Status(0),
                    Some(Some(results)) => {
                        for (variable, value) in variables.iter().zip(results) {
                            self.assign(variable, value, frame);
                        }
                        Value::Status(1)
                    }
                }
            }
        }))
    }
}

/// A whole number of the type, if it is one.
fn whole(number: i64, ty: Ty) -> Step<Value> {
    let all = if ty == Ty::Byte { 0..=255 } else { i64::from(i32::MIN)..=i64::from(i32::MAX) };
    if all.contains(&number) { Ok(Value::Int(number)) } else { Err(Stop::Undefined) }
}

fn binary(left: Value, operator: &str, right: Value, ty: Ty) -> Step<Value> {
    // Of two numbers of different types, the wider one.
    let wider = match (&left, &right) {
        (Value::Double(_), _) | (_, Value::Double(_)) => Ty::Double,
        (Value::Float(_), _) | (_, Value::Float(_)) => Ty::Float,
        _ => Ty::Int,
    };
    let finite = |value: Value| match value {
        Value::Float(number) if !number.is_finite() => Err(Stop::Undefined),
        Value::Double(number) if !number.is_finite() => Err(Stop::Undefined),
        value => Ok(value),
    };
    Ok(match (convert(left, wider), convert(right, wider)) {
        (Value::Int(left), Value::Int(right)) => match operator {
            "+" => whole(left + right, ty)?,
            "-" => whole(left - right, ty)?,
            "*" => whole(left * right, ty)?,
            "/" if right != 0 => whole(left / right, ty)?,
            "%" if right != 0 => whole(left % right, ty)?,
            "/" | "%" => return Err(Stop::Undefined),
            _ => Value::Bool(compares(&left, operator, &right)),
        },
        (Value::Float(left), Value::Float(right)) => match operator {
            "+" => finite(Value::Float(left + right))?,
            "-" => finite(Value::Float(left - right))?,
            "*" => finite(Value::Float(left * right))?,
            "/" => finite(Value::Float(left / right))?,
            _ => Value::Bool(compares(&left, operator, &right)),
        },
        (Value::Double(left), Value::Double(right)) => match operator {
            "+" => finite(Value::Double(left + right))?,
            "-" => finite(Value::Double(left - right))?,
            "*" => finite(Value::Double(left * right))?,
            "/" => finite(Value::Double(left / right))?,
            _ => Value::Bool(compares(&left, operator, &right)),
        },
        (Value::Text(left), Value::Text(right)) if operator == "+" => {
            if left.len() + right.len() > 60 {
                return Err(Stop::Undefined);
            }
            Value::Text(left + &right)
        }
        (left, right) => Value::Bool((left == right) == (operator == "==")),
    })
}

fn compares<T: PartialOrd>(left: &T, operator: &str, right: &T) -> bool {
    match operator {
        "==" => left == right,
        "!=" => left != right,
        "<" => left < right,
        "<=" => left <= right,
        ">" => left > right,
        _ => left >= right,
    }
}
