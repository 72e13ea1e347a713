//! Makes random components, well typed: values are computed with, names hide each other, the order of calls can be told.

use super::*;
use crate::Random;

/// Names of variables, also those that C++ and RTT use otherwise.
const NAMES: [&str; 24] = [
    "a",
    "b",
    "c",
    "x",
    "n",
    "gain",
    "level",
    "class",
    "new",
    "state",
    "log",
    "run",
    "start",
    "update",
    "to",
    "double_",
    "_low",
    "two__words",
    "std",
    "RTT",
    "value",
    "result",
    "read",
    "send",
];
const CODELS: [&str; 20] = [
    "measure", "plan", "turn", "halt", "gain", "level", "new", "sweep", "result", "drive", "fit", "sense",
    "start", "grow", "value", "class", "pick", "tell", "ask", "log",
];
/// Codels that give a value of the type that they change: what is computed first can be told by them.
const CHANGING: [(&str, Ty); 3] = [("count", Ty::Int), ("shift", Ty::Double), ("join", Ty::Text)];
const STATES: [&str; 8] = ["Waiting", "Moving", "entry", "state", "default", "Blind", "run", "initial"];
const TYPES: [Ty; 9] =
    [Ty::Int, Ty::Int, Ty::Double, Ty::Double, Ty::Bool, Ty::Text, Ty::Byte, Ty::Float, Ty::Int];
const TEXTS: [&str; 5] = ["", "left", "\"\\", "a\n\t??/", "é"];

/// A library of components that do nothing undefined in their runs.
pub fn random_library(seed: u64, components: usize) -> Library {
    let mut random = Random::of_seed(seed);
    let mut library = Library { codels: codels(&mut random), components: Vec::new() };
    while library.components.len() < components {
        let name = format!("K{}", library.components.len());
        let mut maker = Maker::new(&mut random, &library.codels);
        let component = maker.component(name);
        if expected_run(&library, &component).is_some() {
            library.components.push(component);
        }
    }
    library
}

fn codels(random: &mut Random) -> Vec<Signature> {
    let all = CODELS.iter().enumerate().map(|(index, name)| {
        let mut signature = signature(random, name, 4);
        // Of each type there is one that needs nothing.
        if let Some(ty) = TYPES.get(2..).and_then(|types| types.get(index)) {
            signature.result = Some(*ty);
            if index % 2 == 0 {
                signature.parameters.clear();
            }
        }
        signature
    });
    let changing = CHANGING.iter().map(|(name, ty)| Signature {
        name: (*name).to_owned(),
        parameters: vec![(Way::InOut, *ty)],
        result: Some(*ty),
    });
    all.chain(changing).collect()
}

fn signature(random: &mut Random, name: &str, most: usize) -> Signature {
    let ways = [Way::In, Way::In, Way::In, Way::Out, Way::InOut];
    let count = random.below(most);
    let parameters = (0..count).map(|_| (*random.of(&ways), *random.of(&TYPES))).collect();
    let result = (random.below(4) > 0).then(|| *random.of(&TYPES));
    Signature { name: name.to_owned(), parameters, result }
}

/// What a program gives, and how.
#[derive(Clone, Copy, PartialEq)]
enum Gives {
    Nothing,
    /// A hook that may leave it out.
    Success,
    Value(Ty),
}

struct Maker<'a> {
    random: &'a mut Random,
    codels: &'a [Signature],
    it: Component,
    /// What can be named, the outermost first.
    scope: Vec<Variable>,
    /// How many variables the program has so far.
    locals: usize,
    /// Own operations from this one on may be called.
    operations: usize,
    gives: Gives,
    /// May calls stand in expressions?
    calls: bool,
    /// Is what is made a part of the machine?
    in_machine: bool,
    /// What was named last.
    recent: Vec<Location>,
}

impl<'a> Maker<'a> {
    fn new(random: &'a mut Random, codels: &'a [Signature]) -> Maker<'a> {
        let gives = Gives::Nothing;
        Maker {
            random,
            codels,
            it: Component::default(),
            scope: Vec::new(),
            locals: 0,
            operations: 0,
            gives,
            calls: false,
            in_machine: false,
            recent: Vec::new(),
        }
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.random.below(100) < percent
    }

    fn ty(&mut self) -> Ty {
        *self.random.of(&TYPES)
    }

    /// A name that is none of these.
    fn name(&mut self, taken: &[String]) -> String {
        loop {
            let name = *self.random.of(&NAMES);
            if !taken.iter().any(|it| it == name) {
                return name.to_owned();
            }
        }
    }

    // Components.

    fn component(&mut self, name: String) -> Component {
        self.it.name = name;
        self.it.seed = self.random.below(1 << 40) as u64;
        self.shell();
        let is_update = self.chance(25);
        let count = if is_update { 0 } else { self.random.below(4) };
        let machine = self.names(count);
        let count = 3 + self.random.below(5);
        let core = self.names(count);
        let first = [Ty::Int, Ty::Double, Ty::Bool];
        self.it.core = self.variables(core, &machine, &first, Location::Core);
        if !self.it.required.is_empty() {
            for index in 0..1 + self.random.below(2) {
                let required = self.random.below(self.it.required.len());
                self.it.handlers.push((format!("h{index}"), required));
            }
        }
        self.it.machine = self.variables(machine, &[], &[], Location::Machine);
        self.in_machine = false;
        let shared = self.scope.len();
        for index in (0..self.it.provided.len()).rev() {
            self.operations = index + 1;
            self.operation(index);
            self.scope.truncate(shared);
        }
        self.operations = 0;
        if self.chance(60) {
            self.it.configure = Some(self.program(Gives::Success));
        }
        if self.chance(60) {
            self.it.start = Some(self.program(Gives::Success));
        }
        if self.chance(60) {
            self.it.stop = Some(self.program(Gives::Nothing));
        }
        if self.chance(60) {
            self.it.cleanup = Some(self.program(Gives::Nothing));
        }
        self.in_machine = true;
        if is_update {
            self.it.update = Some(self.program(Gives::Nothing));
        } else {
            self.machine();
        }
        self.it.clone()
    }

    /// So many, each once.
    fn names(&mut self, count: usize) -> Vec<String> {
        let mut names = Vec::new();
        for _ in 0..count {
            names.push(self.name(&names));
        }
        names
    }

    /// Variables with their first values, the first of them of these types. They and those that are `inner` hide what has
    /// their names, and each sees those before it.
    fn variables(
        &mut self,
        names: Vec<String>,
        inner: &[String],
        types: &[Ty],
        place: fn(usize) -> Location,
    ) -> Vec<(Variable, Option<Expr>)> {
        let outer = self.scope.clone();
        self.scope.retain(|it| !names.contains(&it.name) && !inner.contains(&it.name));
        self.in_machine = true;
        let mut all = Vec::new();
        for (index, name) in names.into_iter().enumerate() {
            let ty = types.get(index).copied().unwrap_or_else(|| *self.random.of(&TYPES));
            // One without a value is nothing, each time that the component is configured or started.
            let first = if self.chance(75) { Some(self.value(ty, 2)) } else { None };
            let variable = Variable { place: place(index), name, ty };
            all.push((variable.clone(), first));
            if !inner.contains(&variable.name) {
                self.scope.push(variable);
            }
        }
        self.scope = outer;
        self.scope.extend(all.iter().map(|(variable, _)| variable.clone()));
        all
    }

    fn literal(&mut self, ty: Ty) -> Value {
        match ty {
            Ty::Int => Value::Int([0, 1, 2, 3, 7, 10][self.random.below(6)]),
            Ty::Byte => Value::Int([0, 1, 2, 5][self.random.below(4)]),
            Ty::Float => Value::Float([0.5, 0.1, 3.0, 1e-3][self.random.below(4)]),
            Ty::Double => Value::Double([0.5, 0.1, 2.0, 1.5e3, 0.0][self.random.below(5)]),
            Ty::Bool => Value::Bool(self.chance(50)),
            Ty::Text => Value::Text((*self.random.of(&TEXTS)).to_owned()),
            Ty::PortStatus => Value::Status(self.random.below(3) as i64),
            Ty::CallStatus => Value::Status(self.random.below(3) as i64 - 1),
        }
    }

    fn shell(&mut self) {
        let mut taken = Vec::new();
        for index in 0..self.random.below(4) {
            let name = self.name(&taken);
            taken.push(name.clone());
            let ty = self.ty();
            let bounds = match ty {
                Ty::Int if self.chance(40) => Some((Value::Int(0), Value::Int(10))),
                Ty::Byte if self.chance(40) => Some((Value::Int(0), Value::Int(5))),
                Ty::Float if self.chance(40) => Some((Value::Float(0.0), Value::Float(3.0))),
                Ty::Double if self.chance(40) => Some((Value::Double(0.0), Value::Double(1500.0))),
                _ => None,
            };
            let default = self.literal(ty);
            let mut first = if self.chance(50) { default.clone() } else { self.literal(ty) };
            if bounds.is_some() && self.chance(30) {
                first = match ty {
                    Ty::Int => Value::Int(11),
                    Ty::Byte => Value::Int(6),
                    Ty::Float => Value::Float(3.25),
                    _ => Value::Double(-0.5),
                };
            }
            let later = self.literal(ty);
            let is_constant = self.chance(40);
            self.scope.push(Variable { place: Location::Property(index), name: name.clone(), ty });
            self.it.properties.push(Property { name, ty, is_constant, bounds, default, first, later });
        }
        for index in 0..1 + self.random.below(3) {
            let size = [-1, 0, 0, 0, 1, 3][self.random.below(6)];
            let ty = self.ty();
            self.it.inputs.push(Port { name: format!("i{index}"), ty, size });
        }
        for index in 0..1 + self.random.below(2) {
            let ty = self.ty();
            self.it.outputs.push(Port { name: format!("o{index}"), ty, size: 0 });
        }
        for index in 0..self.random.below(3) {
            let signature = signature(self.random, &format!("op{index}"), 4);
            let body = Program { body: Vec::new(), locals: 0 };
            self.it.provided.push((signature, Vec::new(), body));
        }
        for index in 0..self.random.below(3) {
            let signature = signature(self.random, &format!("req{index}"), 4);
            let is_connected = self.chance(85);
            self.it.required.push(Required { signature, is_connected });
        }
    }

    fn operation(&mut self, index: usize) {
        let signature = self.it.provided[index].0.clone();
        let mut names = Vec::new();
        for (number, (_, ty)) in signature.parameters.iter().enumerate() {
            let name = self.name(&names);
            names.push(name.clone());
            self.scope.push(Variable { place: Location::Parameter(number), name, ty: *ty });
        }
        let gives = signature.result.map_or(Gives::Nothing, Gives::Value);
        // What only comes out has a value first.
        let mut first = Vec::new();
        let parameters = self.scope.len() - names.len();
        for (number, (way, ty)) in signature.parameters.iter().enumerate() {
            if *way == Way::Out {
                let value = Expr { ty: *ty, form: Form::Literal(self.literal(*ty)) };
                first.push(Statement::Assign(self.scope[parameters + number].clone(), value));
            }
        }
        // An `in` parameter is not assigned.
        let mut program = self.program(gives);
        first.append(&mut program.body);
        program.body = first;
        self.it.provided[index].1 = names;
        self.it.provided[index].2 = program;
    }

    fn machine(&mut self) {
        let count = 1 + self.random.below(4);
        self.it.initial = self.random.below(count);
        for name in STATES.iter().take(count) {
            let mut methods = [None, None, None, None];
            for method in &mut methods {
                if self.chance(65) {
                    *method = Some(self.program(Gives::Nothing));
                }
            }
            let [entry, run, handle, exit] = methods;
            let mut transitions = Vec::new();
            for number in 0..self.random.below(4) {
                self.calls = true;
                let guard = self.chance(85).then(|| self.expr(Ty::Bool, 3));
                let effect = self.chance(50).then(|| self.program(Gives::Nothing));
                let target = self.random.below(count);
                let name = if number == 0 { "to".to_owned() } else { format!("t{number}") };
                transitions.push(Transition { name, guard, target, effect });
            }
            self.it.states.push(State { name: (*name).to_owned(), entry, run, handle, exit, transitions });
        }
    }

    // Programs.

    fn program(&mut self, gives: Gives) -> Program {
        self.gives = gives;
        self.calls = true;
        self.locals = 0;
        let body = self.block(2);
        Program { body, locals: self.locals }
    }

    fn a_return(&mut self) -> Statement {
        Statement::Return(match self.gives {
            Gives::Nothing => None,
            // Mostly a component goes on.
            Gives::Success => {
                let value = Expr { ty: Ty::Bool, form: Form::Literal(Value::Bool(true)) };
                Some(if self.chance(60) { value } else { self.expr(Ty::Bool, 2) })
            }
            Gives::Value(ty) => Some(self.value(ty, 2)),
        })
    }

    fn block(&mut self, depth: usize) -> Vec<Statement> {
        let outer = self.scope.len();
        let mut names = Vec::new();
        let mut out = Vec::new();
        for _ in 0..self.random.below(6) {
            match self.random.below(100) {
                0..12 => self.local(&mut names, &mut out),
                12..36 => {
                    let ty = self.ty();
                    if let Some(variable) = self.assignable(ty, &[]) {
                        let value = self.value(ty, 3);
                        out.push(Statement::Assign(variable, value));
                    }
                }
                36..56 => out.extend(self.a_call(3).map(Statement::Call)),
                56..66 => {
                    let port = self.random.below(self.it.outputs.len());
                    let value = self.value(self.it.outputs[port].ty, 3);
                    out.push(Statement::Write(port, value));
                }
                66..72 => out.extend(self.a_read().map(Statement::Call)),
                72..79 => out.extend(self.a_send()),
                79..81 => out.extend(self.a_collect().map(Statement::Call)),
                81..96 if depth > 0 => {
                    let condition = self.expr(Ty::Bool, 3);
                    let then = self.block(depth - 1);
                    let otherwise = self.block(depth - 1);
                    out.push(Statement::If(condition, then, otherwise));
                }
                96..98 if depth > 0 => out.push(Statement::Block(self.block(depth - 1))),
                98.. if depth < 2 => {
                    out.push(self.a_return());
                    break;
                }
                _ => {}
            }
        }
        // What a program has to give, it gives in its outermost block.
        let is_open = depth == 2 && !matches!(out.last(), Some(Statement::Return(_)));
        let gives_at_the_end = match self.gives {
            Gives::Nothing => false,
            Gives::Success => self.chance(50),
            Gives::Value(_) => true,
        };
        if is_open && gives_at_the_end {
            out.push(self.a_return());
        }
        self.scope.truncate(outer);
        out
    }

    fn local(&mut self, names: &mut Vec<String>, out: &mut Vec<Statement>) {
        let (name, ty) = (self.name(names), self.ty());
        names.push(name.clone());
        // It is not seen in its own value.
        let value = self.value(ty, 2);
        let variable = Variable { place: Location::Local(self.locals), name, ty };
        self.locals += 1;
        if self.chance(80) {
            out.push(Statement::Local(variable.clone(), Some(value)));
            self.scope.push(variable);
        } else {
            out.push(Statement::Local(variable.clone(), None));
            self.scope.push(variable.clone());
            // Without itself.
            let value = Expr { ty, form: Form::Literal(self.literal(ty)) };
            out.push(Statement::Assign(variable, value));
        }
    }

    fn a_send(&mut self) -> Option<Statement> {
        if self.it.handlers.is_empty() {
            return None;
        }
        let handler = self.random.below(self.it.handlers.len());
        let required = self.it.handlers[handler].1;
        let signature = self.it.required[required].signature.clone();
        let ins = signature.parameters.iter().filter(|(way, _)| *way != Way::Out);
        let arguments = ins.map(|(_, ty)| self.value(*ty, 2)).collect();
        Some(Statement::Send(self.chance(75).then_some(handler), required, arguments))
    }

    // Expressions.

    /// The variables that can be named, each once.
    fn visible(&self) -> Vec<Variable> {
        let hides =
            |index: usize, it: &Variable| self.scope[index + 1..].iter().any(|inner| inner.name == it.name);
        let is_inner = |it: &Variable| matches!(it.place, Location::Local(_) | Location::Parameter(_));
        let all = self
            .scope
            .iter()
            .enumerate()
            .filter(|(index, it)| !hides(*index, it) && (is_inner(it) || !self.is_of_machine(&it.name)));
        all.map(|(_, it)| it.clone()).collect()
    }

    fn variable(&mut self, ty: Ty) -> Option<Variable> {
        let mut all = self.visible();
        all.retain(|it| it.ty == ty);
        self.one_of(all)
    }

    /// Outside of the machine, nothing is named that has the name of one of its variables: they have no values before it is
    /// started.
    fn is_of_machine(&self, name: &str) -> bool {
        !self.in_machine && self.it.machine.iter().any(|(variable, _)| variable.name == name)
    }

    /// A variable that is none of these, and can be assigned.
    fn assignable(&mut self, ty: Ty, others: &[Location]) -> Option<Variable> {
        let mut all = self.visible();
        let operation = self.operations.checked_sub(1).map(|index| &self.it.provided[index].0);
        all.retain(|it| {
            let is_assigned = match it.place {
                Location::Property(_) => false,
                Location::Parameter(number) => {
                    operation.is_some_and(|operation| operation.parameters[number].0 != Way::In)
                }
                _ => true,
            };
            it.ty == ty && is_assigned && !others.contains(&it.place)
        });
        self.one_of(all)
    }

    /// Often one that was named just before: what is computed first can be told by variables that are read and changed in
    /// one statement.
    fn one_of(&mut self, mut all: Vec<Variable>) -> Option<Variable> {
        let recent: Vec<Variable> =
            all.iter().filter(|it| self.recent.contains(&it.place)).cloned().collect();
        if !recent.is_empty() && self.chance(50) {
            all = recent;
        }
        let found = (!all.is_empty()).then(|| self.random.of(&all).clone())?;
        self.recent.insert(0, found.place);
        self.recent.truncate(3);
        Some(found)
    }

    /// Something for a place of type `ty`, perhaps of one that it is converted from.
    fn value(&mut self, ty: Ty, depth: usize) -> Expr {
        match ty {
            Ty::Double if self.chance(25) => self.expr(Ty::Int, depth),
            Ty::Double if self.chance(10) => match self.variable(Ty::Float) {
                Some(variable) => Expr { ty: Ty::Float, form: Form::Variable(variable) },
                None => self.expr(ty, depth),
            },
            Ty::Float if self.chance(10) => match self.variable(Ty::Int) {
                Some(variable) => Expr { ty: Ty::Int, form: Form::Variable(variable) },
                None => self.expr(ty, depth),
            },
            _ => self.expr(ty, depth),
        }
    }

    fn expr(&mut self, ty: Ty, depth: usize) -> Expr {
        if depth == 0 || self.chance(25) {
            return self.leaf(ty);
        }
        if self.calls
            && self.chance(12)
            && let Some(pair) = self.changed_beside(ty)
        {
            return pair;
        }
        if self.calls && self.chance(25) {
            let found = match ty {
                Ty::PortStatus => self.a_read(),
                Ty::CallStatus => self.a_collect(),
                _ => self.call_of(Some(ty), depth),
            };
            if let Some(call) = found {
                return call;
            }
        }
        match ty {
            Ty::Int => self.whole(depth),
            Ty::Byte => {
                let Some(variable) = self.variable(Ty::Byte) else { return self.leaf(ty) };
                let left = Expr { ty, form: Form::Variable(variable) };
                let right = Expr { ty, form: Form::Literal(Value::Int(1 + self.random.below(3) as i64)) };
                let operator = ["%", "/", "+", "*"][self.random.below(4)];
                pair(ty, left, operator, right)
            }
            Ty::Float => {
                let Some(variable) = self.variable(Ty::Float) else { return self.leaf(ty) };
                let left = Expr { ty, form: Form::Variable(variable) };
                if self.chance(10) {
                    return Expr { ty, form: Form::Unary("-", Box::new(left)) };
                }
                let right = self.leaf(ty);
                let operator = ["+", "-", "*"][self.random.below(3)];
                if self.chance(50) {
                    pair(ty, left, operator, right)
                } else {
                    pair(ty, right, operator, left)
                }
            }
            Ty::Double => self.number(depth),
            Ty::Text => {
                let (left, right) = (self.expr(ty, depth - 1), self.leaf(ty));
                pair(ty, left, "+", right)
            }
            Ty::Bool => self.condition(depth),
            Ty::PortStatus | Ty::CallStatus => self.leaf(ty),
        }
    }

    /// A variable, and beside it a call that changes it.
    fn changed_beside(&mut self, ty: Ty) -> Option<Expr> {
        let index = CHANGING.iter().position(|(_, it)| *it == ty)?;
        let variable = self.assignable(ty, &[])?;
        let value = Expr { ty, form: Form::Variable(variable) };
        let call = Expr { ty, form: Form::Codel(CODELS.len() + index, vec![value.clone()]) };
        Some(if self.chance(70) { pair(ty, value, "+", call) } else { pair(ty, call, "+", value) })
    }

    fn whole(&mut self, depth: usize) -> Expr {
        let left = self.expr(Ty::Int, depth - 1);
        match self.random.below(9) {
            0 => Expr { ty: Ty::Int, form: Form::Unary("-", Box::new(left)) },
            1..3 => {
                let divisor =
                    Expr { ty: Ty::Int, form: Form::Literal(Value::Int([2, 3, 7][self.random.below(3)])) };
                let operator = if self.chance(50) { "/" } else { "%" };
                pair(Ty::Int, left, operator, divisor)
            }
            3 => {
                let modulus = Expr { ty: Ty::Int, form: Form::Literal(Value::Int(50)) };
                pair(Ty::Int, left, "%", modulus)
            }
            4 => match (self.variable(Ty::Byte), self.variable(Ty::Int)) {
                (Some(byte), Some(whole)) => {
                    let byte = Expr { ty: Ty::Byte, form: Form::Variable(byte) };
                    let whole = Expr { ty: Ty::Int, form: Form::Variable(whole) };
                    pair(Ty::Int, byte, "-", whole)
                }
                _ => left,
            },
            operator => {
                let right = self.expr(Ty::Int, depth - 1);
                pair(Ty::Int, left, ["+", "-", "-", "*"][operator - 5], right)
            }
        }
    }

    fn number(&mut self, depth: usize) -> Expr {
        let left = self.expr(Ty::Double, depth - 1);
        let right = match self.random.below(4) {
            0 => self.expr(Ty::Int, depth - 1),
            1 => match (self.variable(Ty::Double), self.variable(Ty::Float)) {
                (Some(double), Some(float)) => {
                    let double = Expr { ty: Ty::Double, form: Form::Variable(double) };
                    let float = Expr { ty: Ty::Float, form: Form::Variable(float) };
                    return pair(Ty::Double, float, ["+", "*"][self.random.below(2)], double);
                }
                _ => self.expr(Ty::Double, depth - 1),
            },
            _ => self.expr(Ty::Double, depth - 1),
        };
        match self.random.below(10) {
            0 => Expr { ty: Ty::Double, form: Form::Unary("-", Box::new(left)) },
            1 => pair(Ty::Double, left, "/", Expr { ty: Ty::Int, form: Form::Literal(Value::Int(4)) }),
            _ => {
                let operator = ["+", "-", "*"][self.random.below(3)];
                if self.chance(50) {
                    pair(Ty::Double, left, operator, right)
                } else {
                    pair(Ty::Double, right, operator, left)
                }
            }
        }
    }

    fn condition(&mut self, depth: usize) -> Expr {
        let next = depth - 1;
        match self.random.below(12) {
            0 => Expr { ty: Ty::Bool, form: Form::Unary("!", Box::new(self.expr(Ty::Bool, next))) },
            1..3 => pair(Ty::Bool, self.expr(Ty::Bool, next), "&&", self.expr(Ty::Bool, next)),
            3..5 => pair(Ty::Bool, self.expr(Ty::Bool, next), "||", self.expr(Ty::Bool, next)),
            5 => {
                let ty = [Ty::Bool, Ty::Text][self.random.below(2)];
                let operator = ["==", "!="][self.random.below(2)];
                pair(Ty::Bool, self.expr(ty, next), operator, self.expr(ty, next))
            }
            6..8 => {
                let ty = [Ty::PortStatus, Ty::CallStatus][self.random.below(2)];
                let operator = ["==", "!="][self.random.below(2)];
                let wanted = Expr { ty, form: Form::Literal(self.literal(ty)) };
                let call = if ty == Ty::PortStatus { self.a_read() } else { self.a_collect() };
                match call {
                    Some(call) if self.calls && self.chance(60) => pair(Ty::Bool, call, operator, wanted),
                    _ => {
                        let status = Form::Status(self.random.below(self.it.inputs.len()));
                        let wanted =
                            Expr { ty: Ty::PortStatus, form: Form::Literal(self.literal(Ty::PortStatus)) };
                        pair(Ty::Bool, Expr { ty: Ty::PortStatus, form: status }, operator, wanted)
                    }
                }
            }
            _ => {
                let types = [(Ty::Int, Ty::Int), (Ty::Double, Ty::Double), (Ty::Int, Ty::Double)];
                let (left, right) = types[self.random.below(3)];
                let operator = ["<", "<=", ">", ">=", "==", "!="][self.random.below(6)];
                pair(Ty::Bool, self.expr(left, next), operator, self.expr(right, next))
            }
        }
    }

    fn leaf(&mut self, ty: Ty) -> Expr {
        if self.chance(75)
            && let Some(variable) = self.variable(ty)
        {
            return Expr { ty, form: Form::Variable(variable) };
        }
        if ty == Ty::PortStatus && self.chance(70) {
            return Expr { ty, form: Form::Status(self.random.below(self.it.inputs.len())) };
        }
        Expr { ty, form: Form::Literal(self.literal(ty)) }
    }

    fn a_read(&mut self) -> Option<Expr> {
        let port = self.random.below(self.it.inputs.len());
        let variable = self.assignable(self.it.inputs[port].ty, &[])?;
        Some(Expr { ty: Ty::PortStatus, form: Form::Read(port, variable) })
    }

    fn a_collect(&mut self) -> Option<Expr> {
        if self.it.handlers.is_empty() {
            return None;
        }
        let handler = self.random.below(self.it.handlers.len());
        let signature = self.it.required[self.it.handlers[handler].1].signature.clone();
        let outs = signature.parameters.iter().filter(|(way, _)| *way != Way::In).map(|(_, ty)| *ty);
        let mut places = Vec::new();
        let mut variables = Vec::new();
        for ty in signature.result.into_iter().chain(outs) {
            let variable = self.assignable(ty, &places)?;
            places.push(variable.place);
            variables.push(variable);
        }
        Some(Expr { ty: Ty::CallStatus, form: Form::Collect(handler, variables) })
    }

    /// A call whatever it gives.
    fn a_call(&mut self, depth: usize) -> Option<Expr> {
        self.call_of(None, depth)
    }

    /// A call of a codel or of one's own operation, that gives this; or whatever it gives.
    fn call_of(&mut self, ty: Option<Ty>, depth: usize) -> Option<Expr> {
        let visible = self.visible();
        let own: Vec<usize> = (self.operations..self.it.provided.len())
            .filter(|index| ty.is_none_or(|ty| self.it.provided[*index].0.result == Some(ty)))
            .collect();
        if !own.is_empty() && self.chance(30) {
            let index = *self.random.of(&own);
            let signature = self.it.provided[index].0.clone();
            let arguments = self.arguments(&signature, depth, true)?;
            return Some(Expr { ty: signature.result.unwrap_or(Ty::Int), form: Form::Own(index, arguments) });
        }
        let fits = |codel: &Signature| ty.is_none_or(|ty| codel.result == Some(ty));
        let all: Vec<usize> = (0..self.codels.len())
            .filter(|index| fits(&self.codels[*index]))
            .filter(|index| visible.iter().all(|it| it.name != self.codels[*index].name))
            .filter(|index| !self.is_of_machine(&self.codels[*index].name))
            .collect();
        if all.is_empty() {
            return None;
        }
        let index = *self.random.of(&all);
        let signature = self.codels[index].clone();
        let arguments = self.arguments(&signature, depth, false)?;
        Some(Expr { ty: signature.result.unwrap_or(Ty::Int), form: Form::Codel(index, arguments) })
    }

    fn arguments(&mut self, signature: &Signature, depth: usize, is_own: bool) -> Option<Vec<Expr>> {
        let mut places = Vec::new();
        if is_own {
            // What an operation may change by itself is not given to it as well.
            places.extend((0..self.it.core.len()).map(Location::Core));
        }
        let mut arguments = Vec::new();
        for (way, ty) in &signature.parameters {
            arguments.push(match way {
                Way::In => self.value(*ty, depth.saturating_sub(1)),
                Way::Out | Way::InOut => {
                    let variable = self.assignable(*ty, &places)?;
                    places.push(variable.place);
                    Expr { ty: *ty, form: Form::Variable(variable) }
                }
            });
        }
        Some(arguments)
    }
}

fn pair(ty: Ty, left: Expr, operator: &'static str, right: Expr) -> Expr {
    Expr { ty, form: Form::Binary(Box::new(left), operator, Box::new(right)) }
}
