//! The actions of a component in a run with random inputs, line by line: `tests/orocos/rig` prints those of the
//! generated one.

use std::collections::VecDeque;

use super::interpreter::{Interpreter, Key, Step, Stop, World};
use super::{Component, Library, TICKS, Value, bounds};
use crate::model::{Operation, Signature, State};

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

    fn value(&mut self, ty: &str) -> Value {
        match ty {
            "int" => Value::Int(self.below(21) as i64 - 10),
            "uint8" => Value::Int(self.below(6) as i64),
            "float" => Value::Float((self.below(41) as f32 - 20.0) / 4.0),
            "double" => Value::Double((self.below(41) as f64 - 20.0) / 4.0),
            "bool" => Value::Bool(self.below(2) == 1),
            _ => {
                let texts = ["", "a", "left/\"wheel\"", "\\n", "??/", "é\n\t"];
                Value::Text(texts[self.below(6) as usize].to_owned())
            }
        }
    }
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
        Value::Unknown => panic!("all values of a run are known"),
    }
}

fn list(values: &[Value]) -> String {
    values.iter().map(show).collect::<Vec<_>>().join(", ")
}

/// A connection.
#[derive(Default)]
struct Channel {
    size: i64,
    fresh: VecDeque<Value>,
    last: Option<Value>,
}

/// A call of a required operation.
struct Call {
    /// The index of the operation.
    required: usize,
    arguments: Vec<Value>,
    results: Option<Vec<Value>>,
}

/// An operation that the rig has called.
struct Asked {
    arguments: Vec<Value>,
    answer: Option<Answer>,
}

#[derive(Clone)]
enum Answer {
    Results(Vec<Value>),
    /// The component does not run.
    Refusal,
}

/// The actions of the rig, and its record.
struct Rig<'a> {
    it: &'a Component,
    lines: Vec<String>,
    random: Drawn,
    results: Drawn,
    properties: Vec<Value>,
    /// The values of the constants since the component was configured.
    frozen: Vec<Value>,
    channels: Vec<Channel>,
    status: Vec<i64>,
    outputs: Vec<Vec<Value>>,
    calls: Vec<Call>,
    waiting: VecDeque<usize>,
    handlers: Vec<Option<usize>>,
    /// The last calls that were sent for the handlers, and those of the required operations that were sent for none.
    last: Vec<Option<usize>>,
    last_dropped: Vec<Option<usize>>,
    asked: Vec<Option<Asked>>,
    queue: VecDeque<usize>,
}

#[derive(PartialEq)]
enum Life {
    Unconfigured,
    Stopped,
    Running,
}

struct Run<'a> {
    it: &'a Component,
    interpreter: Interpreter<'a, Rig<'a>>,
    life: Life,
    state: Option<&'a State>,
}

/// Returns the lines of a run; none where its result is undefined.
pub fn expected_run(library: &Library, component: &Component) -> Option<Vec<String>> {
    let it = component;
    let values = it.shell.values.iter().zip(&it.scenario.values);
    let rig = Rig {
        it,
        lines: vec![format!("== {}", it.name)],
        random: Drawn(it.scenario.seed),
        results: Drawn(!it.scenario.seed),
        properties: values.map(|(of, (first, _))| first.clone().converted(&of.ty)).collect(),
        frozen: it.shell.values.iter().map(|of| it.default(&of.name)).collect(),
        channels: it
            .scenario
            .buffers
            .iter()
            .map(|size| Channel { size: *size, ..Channel::default() })
            .collect(),
        status: vec![0; it.inputs().count()],
        outputs: vec![Vec::new(); it.outputs().count()],
        calls: Vec::new(),
        waiting: VecDeque::new(),
        handlers: vec![None; it.core.handlers.len()],
        last: vec![None; it.core.handlers.len()],
        last_dropped: vec![None; it.shell.required.len()],
        asked: it.shell.provided.iter().map(|_| None).collect(),
        queue: VecDeque::new(),
    };
    let interpreter = Interpreter::new(rig, it, &library.codels);
    let mut run = Run { it, interpreter, life: Life::Unconfigured, state: it.initial_state() };
    for tick in 0..TICKS {
        run.tick(tick).ok()?;
    }
    // As the rig ends.
    if run.life == Life::Running {
        run.interpreter.hook("stop").ok()?;
    }
    Some(run.interpreter.world.lines)
}

impl<'a> Run<'a> {
    fn rig(&mut self) -> &mut Rig<'a> {
        &mut self.interpreter.world
    }

    fn tick(&mut self, tick: usize) -> Step<()> {
        let it = self.it;
        self.rig().line(format!("tick {tick}"));
        if tick == 3 {
            let values = it.shell.values.iter().zip(&it.scenario.values);
            self.rig().properties = values.map(|(of, (_, later))| later.clone().converted(&of.ty)).collect();
        }
        self.live()?;
        self.rig().give_inputs();
        self.rig().call_operations();
        if self.rig().random.below(2) == 0 {
            self.rig().serve();
        }
        self.step()?;
        self.rig().record();
        Ok(())
    }

    /// Configures, starts, stops and cleans the component up, as the rig draws it.
    fn live(&mut self) -> Step<()> {
        if self.life == Life::Running {
            if self.rig().random.below(10) != 0 {
                return Ok(());
            }
            self.life = Life::Stopped;
            self.interpreter.hook("stop")?;
            self.rig().line("stop true".to_owned());
            if self.rig().random.below(2) == 0 {
                self.life = Life::Unconfigured;
                self.interpreter.hook("cleanup")?;
                self.rig().line("cleanup true".to_owned());
            }
            return Ok(());
        }
        if self.life == Life::Unconfigured {
            if self.rig().random.below(3) == 0 {
                return Ok(());
            }
            let is_configured = self.configure()?;
            if is_configured {
                self.life = Life::Stopped;
            }
            self.rig().line(format!("configure {is_configured}"));
        }
        if self.life == Life::Stopped {
            let is_started = self.start()?;
            if is_started {
                self.life = Life::Running;
            }
            self.rig().line(format!("start {is_started}"));
        }
        Ok(())
    }

    fn configure(&mut self) -> Step<bool> {
        let rig = self.rig();
        if !rig.are_in_bounds() {
            return Ok(false);
        }
        rig.frozen.clone_from(&rig.properties);
        rig.status.fill(0);
        rig.handlers.fill(None);
        self.interpreter.initialise_core()?;
        Ok(self.interpreter.hook("configure")? != Some(Value::Bool(false)))
    }

    fn start(&mut self) -> Step<bool> {
        self.interpreter.initialise_machine()?;
        if self.interpreter.hook("start")? == Some(Value::Bool(false)) {
            return Ok(false);
        }
        self.state = self.it.initial_state();
        if let Some(state) = self.state {
            self.interpreter.method(state, "entry")?;
        }
        Ok(true)
    }

    /// Executes a period as the component's engine does.
    fn step(&mut self) -> Step<()> {
        let it = self.it;
        while let Some(index) = self.rig().queue.pop_front() {
            let mut arguments =
                self.rig().asked[index].as_ref().map_or(Vec::new(), |it| it.arguments.clone());
            let answer = match self.life {
                Life::Running => {
                    let operation = operation(it, &it.shell.provided[index]);
                    let result = self.interpreter.operation(operation, &mut arguments)?;
                    let parameters = operation.signature.parameters.iter().zip(arguments);
                    let returned = parameters.filter(|(it, _)| it.returns()).map(|(_, value)| value);
                    Answer::Results(result.into_iter().chain(returned).collect())
                }
                Life::Unconfigured | Life::Stopped => Answer::Refusal,
            };
            if let Some(asked) = &mut self.rig().asked[index] {
                asked.answer = Some(answer);
            }
        }
        if self.life != Life::Running {
            return Ok(());
        }
        self.rig().line(format!("> component {}", it.name));
        match self.state {
            None => drop(self.interpreter.hook("update")?),
            Some(state) => {
                if let Some(transition) = self.interpreter.period(state)? {
                    self.state = Some(it.state(&transition.target));
                }
            }
        }
        self.rig().line(format!("< component {}", it.name));
        Ok(())
    }
}

/// The program of a provided operation.
fn operation<'a>(it: &'a Component, provided: &Signature) -> &'a Operation {
    it.core.operations.iter().find(|it| it.signature.name == provided.name).unwrap()
}

impl Rig<'_> {
    fn line(&mut self, text: String) {
        self.lines.push(text);
    }

    fn are_in_bounds(&self) -> bool {
        self.it.shell.values.iter().zip(&self.properties).all(|(of, value)| {
            let Some((low, high)) = of.interval.as_deref().map(bounds) else { return true };
            let number = match value {
                Value::Int(number) => *number as f64,
                Value::Float(number) => f64::from(*number),
                Value::Double(number) => *number,
                _ => return true,
            };
            (low..=high).contains(&number)
        })
    }

    fn give_inputs(&mut self) {
        for (port, channel) in self.it.inputs().zip(&mut self.channels) {
            for _ in 0..self.random.below(3) {
                let value = self.random.value(&port.ty);
                if channel.size >= 0 {
                    if channel.fresh.len() as i64 >= channel.size.max(1) {
                        channel.fresh.pop_front();
                    }
                    channel.fresh.push_back(value);
                }
            }
        }
    }

    fn call_operations(&mut self) {
        for (index, signature) in self.it.shell.provided.iter().enumerate() {
            if self.asked[index].is_none() && self.random.below(4) == 0 {
                let parameters = signature.parameters.iter();
                let arguments = parameters.map(|it| match it.is_given() {
                    true => self.random.value(&it.ty),
                    false => Value::nothing(&it.ty),
                });
                self.asked[index] = Some(Asked { arguments: arguments.collect(), answer: None });
                self.queue.push_back(index);
            }
        }
    }

    /// Answers the calls of required operations as the other component does.
    fn serve(&mut self) {
        while let Some(call) = self.waiting.pop_front() {
            let signature = &self.it.shell.required[self.calls[call].required];
            let given = signature.parameters.iter().zip(&self.calls[call].arguments);
            let given: Vec<Value> =
                given.filter(|(it, _)| it.is_given()).map(|(_, value)| value.clone()).collect();
            let results = self.draw_results(signature);
            self.line(format!("served {}({}) -> {}", signature.name, list(&given), list(&results)));
            self.calls[call].results = Some(results);
        }
    }

    fn draw_results(&mut self, signature: &Signature) -> Vec<Value> {
        signature.results().map(|ty| self.results.value(ty)).collect()
    }

    /// Records what has been written, and what operations have returned.
    fn record(&mut self) {
        for (index, port) in self.it.outputs().enumerate() {
            for value in std::mem::take(&mut self.outputs[index]) {
                self.line(format!("out {} {}", port.name, show(&value)));
            }
        }
        for (index, Signature { name, .. }) in self.it.shell.provided.iter().enumerate() {
            let Some(asked) = &self.asked[index] else { continue };
            let Some(answer) = asked.answer.clone() else {
                self.line(format!("waits for {name}"));
                continue;
            };
            self.line(match answer {
                Answer::Results(results) => format!("done {name} 1 -> {}", list(&results)),
                Answer::Refusal => format!("refused {name}"),
            });
            self.asked[index] = None;
        }
    }

    fn span(&mut self, sign: char, Key { state, name, keyword }: Key<'_>) {
        let component = &self.it.name;
        self.line(format!("{sign} {component} machines.{component}: {keyword}, {state}, {name}"));
    }

    fn input(&self, name: &str) -> usize {
        self.it.inputs().position(|it| it.name == name).unwrap()
    }

    fn handler(&self, name: &str) -> usize {
        self.it.core.handlers.iter().position(|(handler, _)| handler == name).unwrap()
    }
}

impl World for Rig<'_> {
    fn literal(&self, value: Value) -> Value {
        value
    }

    fn stored(&self, value: Value) -> Value {
        value
    }

    fn undefined(&self) -> Step<Value> {
        Err(Stop::Undefined)
    }

    fn choose(&mut self) -> bool {
        panic!("all values of a run are known")
    }

    fn property(&self, name: &str) -> Value {
        let index = self.it.shell.values.iter().position(|it| it.name == name).unwrap();
        let values = match self.it.shell.values[index].keyword {
            "constant" => &self.frozen,
            _ => &self.properties,
        };
        values[index].clone()
    }

    fn begin(&mut self, program: Key<'_>) {
        self.span('>', program);
    }

    fn end(&mut self, program: Key<'_>) {
        self.span('<', program);
    }

    fn codel(&mut self, codel: &Signature, arguments: &[Value]) -> Vec<Value> {
        self.line(format!("> {} codel machines.{}", self.it.name, codel.name));
        let results = self.draw_results(codel);
        self.line(format!("{}({}) -> {}", codel.name, list(arguments), list(&results)));
        results
    }

    fn read(&mut self, port: &str) -> (Value, Option<Value>) {
        let index = self.input(port);
        let channel = &mut self.channels[index];
        let status = match channel.fresh.pop_front() {
            Some(value) => {
                channel.last = Some(value);
                2
            }
            None => i64::from(channel.last.is_some()),
        };
        self.status[index] = status;
        (Value::Status(status), channel.last.clone())
    }

    fn status(&mut self, port: &str) -> Value {
        Value::Status(self.status[self.input(port)])
    }

    fn write(&mut self, port: &str, value: Value) {
        let index = self.it.outputs().position(|it| it.name == port).unwrap();
        self.outputs[index].push(value);
    }

    fn send(&mut self, handler: Option<&str>, operation: &Signature, arguments: Vec<Value>) {
        let handler = handler.map(|it| self.handler(it));
        let required = self.it.shell.required.iter().position(|it| it.name == operation.name).unwrap();
        let last = match handler {
            Some(handler) => &mut self.last[handler],
            None => &mut self.last_dropped[required],
        };
        // What goes both ways is where the last call of the handler, or of those without one, has it.
        let is_under_way = last.is_some_and(|call| self.calls[call].results.is_none());
        if is_under_way && operation.parameters.iter().any(|it| it.is_given() && it.returns()) {
            return;
        }
        *last = self.it.scenario.connected[required].then(|| {
            self.calls.push(Call { required, arguments, results: None });
            self.waiting.push_back(self.calls.len() - 1);
            self.calls.len() - 1
        });
        if let Some(handler) = handler {
            self.handlers[handler] = *last;
        }
    }

    fn collect(&mut self, handler: &str) -> (Value, Vec<Value>) {
        match self.handlers[self.handler(handler)].map(|call| self.calls[call].results.clone()) {
            None => (Value::Status(-1), Vec::new()),
            Some(None) => (Value::Status(0), Vec::new()),
            Some(Some(results)) => (Value::Status(1), results),
        }
    }
}
