//! Executes programs in a [`World`], which decides what their variables hold and what calls return.

use super::{Component, Value};
use crate::model::{
    Block, Expr, Form, Operation, Program, Signature, State, Statement, Transition, Variable,
};

/// Why a program ends before its last statement.
pub(super) enum Stop {
    Return(Option<Value>),
    /// Its result is undefined: an integer overflows, a number is divided by zero. Such a run has no expected lines.
    Undefined,
}

pub(super) type Step<T> = Result<T, Stop>;

/// A program of a component; missing parts are empty.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Key<'a> {
    /// The state that has it.
    pub(super) state: &'a str,
    /// The transition or the operation that has it.
    pub(super) name: &'a str,
    /// `run`, `guard`, `operation`, …
    pub(super) keyword: &'a str,
}

/// The environment of the programs of a component.
pub(super) trait World {
    /// The value of a literal.
    fn literal(&self, value: Value) -> Value;
    /// Returns the value of a variable after the assignment of `value`.
    fn stored(&self, value: Value) -> Value;
    /// The result of an operator that is undefined for its operands.
    fn undefined(&self) -> Step<Value>;
    /// Whether a condition with an unknown value holds.
    fn choose(&mut self) -> bool;
    /// A property or constant of the shell.
    fn property(&self, name: &str) -> Value;
    fn begin(&mut self, program: Key<'_>);
    fn end(&mut self, program: Key<'_>);
    /// Calls a codel with its `in` and `inout` arguments. Returns its result, then what its parameters return.
    fn codel(&mut self, codel: &Signature, arguments: &[Value]) -> Vec<Value>;
    /// The status, and the value where there is one.
    fn read(&mut self, port: &str) -> (Value, Option<Value>);
    fn status(&mut self, port: &str) -> Value;
    fn write(&mut self, port: &str, value: Value);
    fn send(&mut self, handler: Option<&str>, operation: &Signature, arguments: Vec<Value>);
    /// The status, and the results where there are some.
    fn collect(&mut self, handler: &str) -> (Value, Vec<Value>);
}

/// A variable under execution.
#[derive(Debug, Clone)]
struct Held<'a> {
    name: &'a str,
    ty: &'a str,
    value: Value,
}

/// The variables that one execution of a program sees, beside those of the core.
#[derive(Debug, Default)]
struct Frame<'a> {
    /// Parameters and local variables, the innermost last.
    variables: Vec<Held<'a>>,
    /// Whether the variables of the state machine hide those of the core. Outside of the machine, those of the core
    /// hide them.
    in_machine: bool,
}

/// Executes the programs of one component.
pub(super) struct Interpreter<'a, W> {
    pub(super) world: W,
    component: &'a Component,
    codels: &'a [Signature],
    core: Vec<Held<'a>>,
    machine: Vec<Held<'a>>,
}

impl<'a, W: World> Interpreter<'a, W> {
    /// Its variables have their values from before the component is configured.
    pub(super) fn new(world: W, component: &'a Component, codels: &'a [Signature]) -> Interpreter<'a, W> {
        let held = |it: &'a Variable| {
            let value = it.value.as_ref().and_then(constant).unwrap_or_else(|| Value::nothing(&it.ty));
            Held { name: &it.name, ty: &it.ty, value: world.stored(value.converted(&it.ty)) }
        };
        let core = component.core.variables.iter().map(held).collect();
        let machine = component.core.machines.iter().flat_map(|it| &it.variables).map(held).collect();
        Interpreter { world, component, codels, core, machine }
    }

    /// Returns the variables of the core, then those of the state machine, with their values.
    pub(super) fn values(&self) -> Vec<(&'a str, Value)> {
        self.core.iter().chain(&self.machine).map(|it| (it.name, it.value.clone())).collect()
    }

    /// Gives all these variables values.
    pub(super) fn set_values(&mut self, values: Vec<(&'a str, Value)>) {
        let all = self.core.iter_mut().chain(&mut self.machine);
        all.zip(values).for_each(|(held, (_, value))| held.value = value);
    }

    /// Computes the initial values of the core's variables.
    pub(super) fn initialise_core(&mut self) -> Step<()> {
        for (index, variable) in self.component.core.variables.iter().enumerate() {
            let value = self.first_value(variable, &mut Frame::default())?;
            self.core[index].value = self.world.stored(value);
        }
        Ok(())
    }

    /// Computes the initial values of the state machine's variables.
    pub(super) fn initialise_machine(&mut self) -> Step<()> {
        let component = self.component;
        for (index, variable) in component.core.machines.iter().flat_map(|it| &it.variables).enumerate() {
            let mut frame = Frame { in_machine: true, ..Frame::default() };
            let value = self.first_value(variable, &mut frame)?;
            self.machine[index].value = self.world.stored(value);
        }
        Ok(())
    }

    /// Executes the hook, if it exists, and returns its result.
    pub(super) fn hook(&mut self, keyword: &str) -> Step<Option<Value>> {
        let Some(program) = self.component.hook(keyword) else { return Ok(None) };
        self.program(Key { keyword, ..Key::default() }, &program.body, &mut Frame::default())
    }

    /// Executes a method of a state, where there is one.
    pub(super) fn method(&mut self, state: &'a State, keyword: &str) -> Step<()> {
        let mut methods = state.methods.iter().chain(&state.later_methods);
        let Some(Program { body, .. }) = methods.find(|it| it.keyword == keyword) else { return Ok(()) };
        let key = Key { state: &state.name, name: "", keyword };
        self.program(key, body, &mut Frame { in_machine: true, ..Frame::default() }).map(drop)
    }

    /// Executes one period of the state machine in `state`. Returns the transition that fires.
    pub(super) fn period(&mut self, state: &'a State) -> Step<Option<&'a Transition>> {
        self.method(state, "run")?;
        for transition in &state.transitions {
            if self.fires(state, transition)? {
                self.method(state, "exit")?;
                if let Some(effect) = &transition.effect {
                    let key = Key { state: &state.name, name: &transition.name, keyword: "effect" };
                    self.program(key, effect, &mut Frame { in_machine: true, ..Frame::default() })?;
                }
                self.method(self.component.state(&transition.target), "entry")?;
                return Ok(Some(transition));
            }
        }
        self.method(state, "handle")?;
        Ok(None)
    }

    fn fires(&mut self, state: &'a State, transition: &'a Transition) -> Step<bool> {
        let Some(guard) = &transition.guard else { return Ok(true) };
        let key = Key { state: &state.name, name: &transition.name, keyword: "guard" };
        self.world.begin(key);
        let fires = self.condition(guard, &mut Frame { in_machine: true, ..Frame::default() })?;
        self.world.end(key);
        Ok(fires)
    }

    /// Executes an operation of the component. Afterwards, `arguments` has the values of its output parameters.
    pub(super) fn operation(
        &mut self,
        operation: &'a Operation,
        arguments: &mut [Value],
    ) -> Step<Option<Value>> {
        let Operation { signature, body } = operation;
        let parameters = signature.parameters.iter().zip(arguments.iter());
        let held = parameters.map(|(it, value)| Held {
            name: &it.name,
            ty: &it.ty,
            value: self.world.stored(value.clone()),
        });
        let mut frame = Frame { variables: held.collect(), in_machine: false };
        let key = Key { state: "", name: &signature.name, keyword: "operation" };
        let result = self.program(key, body, &mut frame)?;
        for (argument, held) in arguments.iter_mut().zip(frame.variables) {
            *argument = held.value;
        }
        let result = result.zip(signature.returned()).map(|(result, ty)| result.converted(ty));
        Ok(result.map(|it| self.world.stored(it)))
    }

    fn program(&mut self, key: Key<'_>, body: &'a Block, frame: &mut Frame<'a>) -> Step<Option<Value>> {
        self.world.begin(key);
        let parameters = frame.variables.len();
        let result = match self.block(body, frame) {
            Ok(()) => None,
            Err(Stop::Return(value)) => value,
            Err(Stop::Undefined) => return Err(Stop::Undefined),
        };
        frame.variables.truncate(parameters);
        self.world.end(key);
        Ok(result)
    }

    fn block(&mut self, block: &'a Block, frame: &mut Frame<'a>) -> Step<()> {
        let outer = frame.variables.len();
        block.iter().try_for_each(|statement| self.statement(statement, frame))?;
        frame.variables.truncate(outer);
        Ok(())
    }

    fn statement(&mut self, statement: &'a Statement, frame: &mut Frame<'a>) -> Step<()> {
        match statement {
            Statement::Variable(variable) => {
                let value = self.first_value(variable, frame)?;
                let value = self.world.stored(value);
                frame.variables.push(Held { name: &variable.name, ty: &variable.ty, value });
            }
            Statement::Assign(handler, Expr { form: Form::Call(callee, arguments), .. })
                if callee == "send" =>
            {
                self.send(Some(handler), arguments, frame)?;
            }
            Statement::Assign(name, value) => {
                let value = self.expr(value, frame)?;
                self.assign(name, value, frame);
            }
            Statement::Expr(Expr { form: Form::Call(callee, arguments), .. }) => {
                self.call(callee, arguments, frame)?;
            }
            Statement::Expr(expr) => drop(self.expr(expr, frame)?),
            Statement::If(condition, then, otherwise) => {
                let holds = self.condition(condition, frame)?;
                let branch = if holds { Some(then) } else { otherwise.as_ref() };
                branch.map_or(Ok(()), |branch| self.block(branch, frame))?;
            }
            Statement::Block(inner) => self.block(inner, frame)?,
            Statement::Return(_, value) => {
                let value = value.as_ref().map(|value| self.expr(value, frame)).transpose()?;
                return Err(Stop::Return(value));
            }
        }
        Ok(())
    }

    fn first_value(&mut self, variable: &'a Variable, frame: &mut Frame<'a>) -> Step<Value> {
        Ok(match &variable.value {
            Some(value) => self.expr(value, frame)?.converted(&variable.ty),
            None => Value::nothing(&variable.ty),
        })
    }

    fn condition(&mut self, condition: &'a Expr, frame: &mut Frame<'a>) -> Step<bool> {
        let value = self.expr(condition, frame)?;
        Ok(self.holds(&value))
    }

    fn holds(&mut self, value: &Value) -> bool {
        match value {
            Value::Bool(holds) => *holds,
            _ => self.world.choose(),
        }
    }

    /// The variable that `name` refers to.
    fn held<'b>(&'b mut self, name: &str, frame: &'b mut Frame<'a>) -> Option<&'b mut Held<'a>> {
        let (first, second) = match frame.in_machine {
            true => (&mut self.machine, &mut self.core),
            false => (&mut self.core, &mut self.machine),
        };
        let mut all = frame.variables.iter_mut().rev().chain(first).chain(second);
        all.find(|it| it.name == name)
    }

    fn value_of(&mut self, name: &str, frame: &mut Frame<'a>) -> Value {
        match self.held(name, frame) {
            Some(held) => held.value.clone(),
            None => self.world.property(name),
        }
    }

    fn assign(&mut self, name: &str, value: Value, frame: &mut Frame<'a>) {
        let value = self.world.stored(value);
        let Some(held) = self.held(name, frame) else { panic!("no variable `{name}`") };
        held.value = value.converted(held.ty);
    }

    fn expr(&mut self, expr: &'a Expr, frame: &mut Frame<'a>) -> Step<Value> {
        match &expr.form {
            Form::Literal(text) => Ok(self.world.literal(Value::of_literal(&expr.ty, text))),
            Form::Name(name) => Ok(self.value_of(name, frame)),
            Form::Parens(inner) => self.expr(inner, frame),
            Form::Unary(_, inner) => {
                let value = self.expr(inner, frame)?;
                negated(value, &expr.ty).map_or_else(|| self.world.undefined(), Ok)
            }
            Form::Binary(left, operator @ ("&&" | "||"), right) => {
                let left = self.expr(left, frame)?;
                match self.holds(&left) == (*operator == "&&") {
                    true => self.expr(right, frame),
                    false => Ok(Value::Bool(*operator == "||")),
                }
            }
            Form::Binary(left, operator, right) => {
                let (left, right) = (self.expr(left, frame)?, self.expr(right, frame)?);
                binary(left, operator, right, &expr.ty).map_or_else(|| self.world.undefined(), Ok)
            }
            Form::Call(callee, arguments) => {
                let result = self.call(callee, arguments, frame)?;
                Ok(result.unwrap_or_else(|| panic!("`{callee}` returns nothing")))
            }
        }
    }

    fn call(&mut self, callee: &str, arguments: &'a [Expr], frame: &mut Frame<'a>) -> Step<Option<Value>> {
        let (component, codels) = (self.component, self.codels);
        match (callee, arguments) {
            ("read", [port, target]) => {
                let (status, value) = self.world.read(name_in(port));
                if let Some(value) = value {
                    self.assign(name_in(target), value, frame);
                }
                Ok(Some(status))
            }
            ("status", [port]) => Ok(Some(self.world.status(name_in(port)))),
            ("write", [port, value]) => {
                let port = name_in(port);
                let ty = component.outputs().find(|it| it.name == port).map_or("", |it| &it.ty);
                let value = self.expr(value, frame)?;
                self.world.write(port, value.converted(ty));
                Ok(None)
            }
            ("send", _) => self.send(None, arguments, frame).map(|()| None),
            ("collect", [handler, targets @ ..]) => {
                let (status, results) = self.world.collect(name_in(handler));
                for (target, value) in targets.iter().zip(results) {
                    self.assign(name_in(target), value, frame);
                }
                Ok(Some(status))
            }
            _ => match component.core.operations.iter().find(|it| it.signature.name == *callee) {
                Some(operation) => self.call_operation(operation, arguments, frame),
                None => {
                    let Some(codel) = codels.iter().find(|it| it.name == *callee) else {
                        panic!("no codel `{callee}`")
                    };
                    self.call_codel(codel, arguments, frame)
                }
            },
        }
    }

    /// The arguments of a call. A variable that the callee changes is given by reference: its value is the one when all
    /// other arguments have been computed.
    fn given(
        &mut self,
        signature: &'a Signature,
        arguments: &'a [Expr],
        frame: &mut Frame<'a>,
    ) -> Step<Vec<Value>> {
        let mut given = Vec::new();
        for (parameter, argument) in signature.parameters.iter().zip(arguments) {
            given.push(match parameter.returns() {
                true => Value::Unknown,
                false => self.expr(argument, frame)?.converted(&parameter.ty),
            });
        }
        for (index, parameter) in signature.parameters.iter().enumerate() {
            if parameter.returns() {
                given[index] = self.value_of(name_in(&arguments[index]), frame);
            }
        }
        Ok(given)
    }

    fn call_operation(
        &mut self,
        operation: &'a Operation,
        arguments: &'a [Expr],
        frame: &mut Frame<'a>,
    ) -> Step<Option<Value>> {
        let mut given = self.given(&operation.signature, arguments, frame)?;
        let result = self.operation(operation, &mut given)?;
        for ((parameter, argument), value) in operation.signature.parameters.iter().zip(arguments).zip(given)
        {
            if parameter.returns() {
                self.assign(name_in(argument), value, frame);
            }
        }
        Ok(result)
    }

    fn call_codel(
        &mut self,
        codel: &'a Signature,
        arguments: &'a [Expr],
        frame: &mut Frame<'a>,
    ) -> Step<Option<Value>> {
        let given = codel.parameters.iter().zip(self.given(codel, arguments, frame)?);
        let given: Vec<Value> = given.filter(|(it, _)| it.is_given()).map(|(_, value)| value).collect();
        let mut results = self.world.codel(codel, &given).into_iter();
        let result = codel.returned().and_then(|_| results.next());
        let changed = codel.parameters.iter().zip(arguments).filter(|(it, _)| it.returns());
        for ((_, argument), value) in changed.zip(results) {
            self.assign(name_in(argument), value, frame);
        }
        Ok(result)
    }

    fn send(&mut self, handler: Option<&str>, arguments: &'a [Expr], frame: &mut Frame<'a>) -> Step<()> {
        let component = self.component;
        let name = name_in(&arguments[0]);
        let Some(operation) = component.shell.required.iter().find(|it| it.name == name) else {
            panic!("no operation `{name}`")
        };
        let mut given = Vec::new();
        let mut arguments = arguments[1..].iter();
        for parameter in &operation.parameters {
            given.push(match parameter.is_given().then(|| arguments.next()).flatten() {
                Some(argument) => self.expr(argument, frame)?.converted(&parameter.ty),
                None => Value::nothing(&parameter.ty),
            });
        }
        self.world.send(handler, operation, given);
        Ok(())
    }
}

/// The port, handler, operation or variable that an argument names.
fn name_in(argument: &Expr) -> &str {
    match &argument.form {
        Form::Name(name) => name,
        other => panic!("{other:?} is no name"),
    }
}

/// Returns the value of an expression that names and calls nothing.
pub(super) fn constant(expr: &Expr) -> Option<Value> {
    match &expr.form {
        Form::Literal(text) => Some(Value::of_literal(&expr.ty, text)),
        Form::Parens(inner) => constant(inner),
        Form::Unary(_, inner) => negated(constant(inner)?, &expr.ty),
        Form::Binary(left, operator @ ("&&" | "||"), right) => {
            let (left, right) = (constant(left)?, constant(right)?);
            Some(if left == Value::Bool(*operator == "&&") { right } else { left })
        }
        Form::Binary(left, operator, right) => binary(constant(left)?, operator, constant(right)?, &expr.ty),
        Form::Name(_) | Form::Call(..) => None,
    }
}

/// The integer `number` where a `ty` has it.
fn integer(number: i64, ty: &str) -> Option<Value> {
    let all = if ty == "uint8" { 0..=255 } else { i64::from(i32::MIN)..=i64::from(i32::MAX) };
    all.contains(&number).then_some(Value::Int(number))
}

fn negated(value: Value, ty: &str) -> Option<Value> {
    Some(match value {
        Value::Bool(value) => Value::Bool(!value),
        Value::Int(number) => integer(-number, ty)?,
        Value::Float(number) => Value::Float(-number),
        Value::Double(number) => Value::Double(-number),
        other => other,
    })
}

/// The value of a binary operator, where it is defined.
fn binary(left: Value, operator: &str, right: Value, ty: &str) -> Option<Value> {
    // Numbers of different types are computed in the wider type.
    let wider = match (&left, &right) {
        (Value::Unknown, _) | (_, Value::Unknown) => return Some(Value::Unknown),
        (Value::Double(_), _) | (_, Value::Double(_)) => "double",
        (Value::Float(_), _) | (_, Value::Float(_)) => "float",
        _ => "int",
    };
    let (left, right) = (left.converted(wider), right.converted(wider));
    match operator {
        "==" | "!=" => return Some(Value::Bool((left == right) == (operator == "=="))),
        "<" => return Some(Value::Bool(left < right)),
        "<=" => return Some(Value::Bool(left <= right)),
        ">" => return Some(Value::Bool(left > right)),
        ">=" => return Some(Value::Bool(left >= right)),
        _ => {}
    }
    match (left, right) {
        (Value::Int(left), Value::Int(right)) => integer(
            match operator {
                "+" => left + right,
                "-" => left - right,
                "*" => left * right,
                "/" => left.checked_div(right)?,
                _ => left.checked_rem(right)?,
            },
            ty,
        ),
        (Value::Float(left), Value::Float(right)) => {
            let value = match operator {
                "+" => left + right,
                "-" => left - right,
                "*" => left * right,
                _ => left / right,
            };
            value.is_finite().then_some(Value::Float(value))
        }
        (Value::Double(left), Value::Double(right)) => {
            let value = match operator {
                "+" => left + right,
                "-" => left - right,
                "*" => left * right,
                _ => left / right,
            };
            value.is_finite().then_some(Value::Double(value))
        }
        // A text that is joined with itself again and again has no end.
        (Value::Text(left), Value::Text(right)) => {
            (left.len() + right.len() <= 60).then(|| Value::Text(left + &right))
        }
        (left, right) => panic!("{left:?} {operator} {right:?}"),
    }
}
