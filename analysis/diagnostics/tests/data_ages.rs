//! Random cores are executed by an interpreter that knows nothing of the analysis: it tries each choice of each condition, and lets
//! data arrive before each read and at the end of each job. One datum, or one read, is marked; a value has the number of the newest
//! mark that it comes from: 0 before it, 1 the marked one, 2 newer ones. The most jobs until it is written, the most jobs until the
//! last write of it, and whether a write of less follows are never more than the analysis claims, and nearly always as much; nearly
//! all that it claims to take for ever does. A counter and the flags have their values from the start, and keep them in a restart,
//! unless a hook sets them, or the counter is a variable of the state machine. A client may call an operation between two jobs.
//!
//! `MAUVE_CORES` is the number of projects, of 20 cores each.

use std::collections::{HashSet, VecDeque};
use std::fmt::Write as _;

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Assumption, Database, Decl, Passage, PassageEnd, Workspace, names_of, passages_of, projects,
};
use mauve_tests::{Random, search};

/// The cores of a project.
const CORES: usize = 20;
/// More jobs than most cores with a bound need; none is observed for longer.
const FOR_EVER: u8 = 12;
/// The most states of an execution.
const STATES: usize = 4_000;

const LIBRARY: &str = "
codel sense(): int
codel plan(in from: int): int
codel mix(in one: int, in other: int): int
codel fill(out to: int): void
codel tune(inout it: int, in by: int): void
codel grab(in from: int, out to: int): bool
codel ready(): bool
codel level(): int
codel drive(in order: int): void
shell S { input port a: int  input port b: int  output port q: int  provide poke(): void  provide bump(inout it: int): void }
";

#[derive(Debug, Clone)]
enum Data {
    Var(usize),
    Constant,
    Sense,
    Plan(Box<Data>),
    Mix(Box<Data>, Box<Data>),
    Plus(Box<Data>, Box<Data>),
}

#[derive(Debug, Clone)]
enum Condition {
    /// `read(port, variable) == status`
    Read(usize, usize, u8),
    Status(usize, u8),
    Flag(usize),
    Ready,
    /// A condition on numbers.
    Unknown,
    /// `n == 2`, `n < 2`
    Count(&'static str, i8),
    Not(Box<Condition>),
    And(Box<Condition>, Box<Condition>),
    Or(Box<Condition>, Box<Condition>),
}

#[derive(Debug, Clone)]
enum Statement {
    Read(usize, usize),
    Write(Data),
    Assign(usize, Data),
    Local(Data, Vec<Statement>),
    Fill(usize),
    Tune(usize, Data),
    /// `flag = grab(data, variable)`
    Grab(usize, Data, usize),
    Drive(Data),
    SetFlag(usize, Option<Condition>),
    /// `n = 3;`
    SetCount(i8),
    /// `n = n + 1;`
    AddCount(i8),
    /// `poke();`
    Poke,
    /// `bump(n);`, or of a variable: adds 1 below 2, otherwise it becomes 0.
    Bump(Option<usize>),
    If(Condition, Vec<Statement>, Vec<Statement>),
    Return,
}

type Program = Vec<Statement>;

#[derive(Debug, Clone, Default)]
struct StateOf {
    entry: Program,
    run: Program,
    handle: Program,
    exit: Program,
    /// The guard, the effect and the target of each.
    transitions: Vec<(Option<Condition>, Program, usize)>,
}

/// A core with `update` has one state without transitions.
#[derive(Debug, Clone)]
struct Core {
    is_machine: bool,
    states: Vec<StateOf>,
    /// Whether the counter is a variable of the state machine.
    is_own_count: bool,
    /// `configure`, `start` and `stop`.
    hooks: [Program; 3],
    operation: Program,
}

const HOOKS: [&str; 3] = ["configure", "start", "stop"];

const VARIABLES: [&str; 3] = ["x", "y", "t"];
const LOCAL: usize = 2;
const PORTS: [&str; 2] = ["a", "b"];
const STATUSES: [&str; 3] = ["no_data", "old_data", "new_data"];

struct Generator {
    random: Random,
    /// Whether a local variable is in scope.
    has_local: bool,
    /// Whether the core has a counter.
    counts: bool,
    /// Whether programs may call operations.
    calls: bool,
}

impl Generator {
    fn chance(&mut self, percent: usize) -> bool {
        self.random.below(100) < percent
    }

    fn variable(&mut self) -> usize {
        self.random.below(if self.has_local { 3 } else { 2 })
    }

    fn data(&mut self, depth: usize) -> Data {
        match self.random.below(if depth == 0 { 7 } else { 11 }) {
            0..=4 => Data::Var(self.variable()),
            5 => Data::Constant,
            6 => Data::Sense,
            7..=8 => Data::Plan(Box::new(self.data(depth - 1))),
            9 => Data::Mix(Box::new(self.data(depth - 1)), Box::new(self.data(depth - 1))),
            _ => Data::Plus(Box::new(self.data(depth - 1)), Box::new(self.data(depth - 1))),
        }
    }

    fn port(&mut self) -> usize {
        usize::from(self.chance(25))
    }

    fn condition(&mut self, depth: usize) -> Condition {
        match self.random.below(if depth == 0 { 7 } else { 10 }) {
            _ if self.counts && self.chance(25) => {
                let operator = ["==", "!=", "<", "<="][self.random.below(4)];
                Condition::Count(operator, self.random.below(4) as i8)
            }
            0..=1 => Condition::Read(self.port(), self.variable(), 2),
            2 => Condition::Read(self.port(), self.variable(), self.random.below(3) as u8),
            3 => Condition::Status(self.port(), self.random.below(3) as u8),
            4 => Condition::Flag(self.random.below(2)),
            5 => Condition::Ready,
            6 => Condition::Unknown,
            7 => Condition::Not(Box::new(self.condition(depth - 1))),
            8 => Condition::And(Box::new(self.condition(depth - 1)), Box::new(self.condition(depth - 1))),
            _ => Condition::Or(Box::new(self.condition(depth - 1)), Box::new(self.condition(depth - 1))),
        }
    }

    fn program(&mut self, most: usize, depth: usize) -> Program {
        (0..self.random.below(most + 1)).map(|_| self.statement(depth)).collect()
    }

    fn statement(&mut self, depth: usize) -> Statement {
        match self.random.below(if depth == 0 { 14 } else { 19 }) {
            _ if self.counts && self.chance(12) => match self.random.below(5) {
                0..=1 => Statement::SetCount(self.random.below(4) as i8),
                2 => Statement::AddCount(-1),
                _ => Statement::AddCount(1),
            },
            _ if self.counts && depth > 0 && self.chance(12) => self.every(depth),
            _ if self.calls && self.chance(12) => match self.random.below(3) {
                0 => Statement::Bump(Some(self.variable())),
                1 if self.counts => Statement::Bump(None),
                _ => Statement::Poke,
            },
            0..=3 => Statement::Read(self.port(), self.variable()),
            4..=6 => Statement::Write(self.data(1)),
            7..=8 => Statement::Assign(self.variable(), self.data(1)),
            9 => Statement::Fill(self.variable()),
            10 => Statement::Tune(self.variable(), self.data(0)),
            11 => Statement::Grab(self.random.below(2), self.data(0), self.variable()),
            12 => Statement::Drive(self.data(0)),
            13 => {
                let value = if self.chance(60) { Some(self.condition(1)) } else { None };
                Statement::SetFlag(self.random.below(2), value)
            }
            14 if !self.has_local => {
                let value = self.data(1);
                self.has_local = true;
                let block = self.program(2, depth - 1);
                self.has_local = false;
                Statement::Local(value, block)
            }
            15 if self.chance(20) => Statement::Return,
            _ => {
                let condition = self.condition(1);
                Statement::If(condition, self.program(2, depth - 1), self.program(1, depth - 1))
            }
        }
    }

    /// `if n == 0 then { …; n = 3; } else { n = n - 1; … }`, or up to a limit.
    fn every(&mut self, depth: usize) -> Statement {
        let (limit, up) = (1 + self.random.below(3) as i8, self.chance(50));
        let (held, reset, step) = if up { (limit, 0, 1) } else { (0, limit, -1) };
        let mut then = self.program(2, depth - 1);
        then.push(Statement::SetCount(reset));
        let otherwise = [vec![Statement::AddCount(step)], self.program(1, depth - 1)].concat();
        Statement::If(Condition::Count("==", held), then, otherwise)
    }

    /// A program that sets the counter and flags.
    fn hook(&mut self) -> Program {
        let mut set = || match self.random.below(4) {
            0 => Statement::SetFlag(self.random.below(2), None),
            1 => Statement::AddCount(1),
            2 => Statement::Bump(None),
            _ => Statement::SetCount(self.random.below(4) as i8),
        };
        let (then, after) = (set(), set());
        match self.random.below(3) {
            0 => vec![then],
            1 => vec![Statement::If(
                Condition::Count("==", self.random.below(3) as i8),
                vec![then],
                vec![after],
            )],
            _ => Vec::new(),
        }
    }

    fn core(&mut self) -> Core {
        self.counts = self.chance(50);
        self.calls = false;
        let mut core = Core {
            is_machine: self.chance(60),
            states: Vec::new(),
            is_own_count: self.chance(30),
            hooks: Default::default(),
            operation: Vec::new(),
        };
        if self.chance(15) {
            core.hooks = [self.hook(), self.hook(), self.hook()];
        }
        if self.chance(10) {
            core.operation = if self.chance(60) { self.hook() } else { self.program(2, 1) };
            self.calls = true;
        }
        if !core.is_machine {
            let run = (0..=self.random.below(4)).map(|_| self.statement(2)).collect();
            return Core { states: vec![StateOf { run, ..StateOf::default() }], ..core };
        }
        let count = 1 + self.random.below(3);
        let states = (0..count).map(|index| {
            let mut state = StateOf { run: self.program(2, 1), ..StateOf::default() };
            if self.chance(30) {
                state.entry = self.program(1, 1);
            }
            if self.chance(50) {
                state.handle = self.program(2, 1);
            }
            if self.chance(20) {
                state.exit = self.program(1, 1);
            }
            // Each state is reached from the one before it.
            for number in 0..usize::from(index + 1 < count) + self.random.below(2) {
                let target = if number == 0 { (index + 1) % count } else { self.random.below(count) };
                let guard = if self.chance(75) { Some(self.condition(1)) } else { None };
                let effect = if self.chance(30) { self.program(1, 0) } else { Vec::new() };
                state.transitions.push((guard, effect, target));
            }
            state
        });
        Core { states: states.collect(), ..core }
    }
}

fn data(of: &Data) -> String {
    match of {
        Data::Var(index) => VARIABLES[*index].to_owned(),
        Data::Constant => "0".to_owned(),
        Data::Sense => "sense()".to_owned(),
        Data::Plan(inner) => format!("plan({})", data(inner)),
        Data::Mix(one, other) => format!("mix({}, {})", data(one), data(other)),
        Data::Plus(one, other) => format!("({} + {})", data(one), data(other)),
    }
}

fn condition(of: &Condition) -> String {
    match of {
        Condition::Read(port, variable, status) => {
            let status = STATUSES[usize::from(*status)];
            format!("(read({}, {}) == {status})", PORTS[*port], VARIABLES[*variable])
        }
        Condition::Status(port, status) => {
            format!("(status({}) != {})", PORTS[*port], STATUSES[usize::from(*status)])
        }
        Condition::Flag(index) => format!("f{index}"),
        Condition::Ready => "ready()".to_owned(),
        Condition::Unknown => "(level() < 3)".to_owned(),
        Condition::Count(operator, value) => format!("(n {operator} {value})"),
        Condition::Not(inner) => format!("!{}", condition(inner)),
        Condition::And(one, other) => format!("({} && {})", condition(one), condition(other)),
        Condition::Or(one, other) => format!("({} || {})", condition(one), condition(other)),
    }
}

fn program(of: &[Statement]) -> String {
    let all: Vec<String> = of.iter().map(statement).collect();
    format!("{{ {} }}", all.join(" "))
}

fn statement(of: &Statement) -> String {
    match of {
        Statement::Read(port, variable) => format!("read({}, {});", PORTS[*port], VARIABLES[*variable]),
        Statement::Write(value) => format!("write(q, {});", data(value)),
        Statement::Assign(variable, value) => format!("{} = {};", VARIABLES[*variable], data(value)),
        Statement::Local(value, inner) => {
            let inner = program(inner);
            format!("{{ var t: int = {}; {inner} }}", data(value))
        }
        Statement::Fill(variable) => format!("fill({});", VARIABLES[*variable]),
        Statement::Tune(variable, by) => format!("tune({}, {});", VARIABLES[*variable], data(by)),
        Statement::Grab(flag, from, to) => format!("f{flag} = grab({}, {});", data(from), VARIABLES[*to]),
        Statement::Drive(order) => format!("drive({});", data(order)),
        Statement::SetFlag(flag, None) => format!("f{flag} = true;"),
        Statement::SetFlag(flag, Some(value)) => format!("f{flag} = {};", condition(value)),
        Statement::SetCount(value) => format!("n = {value};"),
        Statement::AddCount(by) => format!("n = n {} 1;", if *by < 0 { "-" } else { "+" }),
        Statement::Poke => "poke();".to_owned(),
        Statement::Bump(variable) => format!("bump({});", variable.map_or("n", |it| VARIABLES[it])),
        Statement::If(held, then, otherwise) => {
            format!("if {} then {} else {}", condition(held), program(then), program(otherwise))
        }
        Statement::Return => "return;".to_owned(),
    }
}

impl Core {
    /// Programs outside of a state machine do not know its variables.
    fn counts_in_machine(&self) -> bool {
        let others =
            format!("{}{}", program(&self.operation), self.hooks.each_ref().map(|it| program(it)).concat());
        self.is_machine && self.is_own_count && !["n = ", "(n ", "(n)"].iter().any(|it| others.contains(it))
    }
}

fn text(core: &Core, name: &str) -> String {
    let mut out = format!(
        "core {name}(S) {{ var x: int = 0 var y: int = 0 var f0: bool = false var f1: bool = false\n
        provide bump(inout it: int) = {{ if it < 2 then {{ it = it + 1; }} else {{ it = 0; }} }}\n"
    );
    let _ = writeln!(out, "provide poke() = {}", program(&core.operation));
    for (name, hook) in HOOKS.iter().zip(&core.hooks).filter(|(_, it)| !it.is_empty()) {
        let _ = writeln!(out, "{name} = {}", program(hook));
    }
    out += if core.counts_in_machine() { "" } else { "var n: int = 0\n" };
    if !core.is_machine {
        let _ = writeln!(out, "update = {} }}", program(&core.states[0].run));
        return out;
    }
    out += if core.counts_in_machine() { "statemachine { var n: int = 0\n" } else { "statemachine {\n" };
    for (index, state) in core.states.iter().enumerate() {
        let _ = writeln!(out, "{} state S{index} {{", if index == 0 { "initial" } else { "" });
        let methods =
            [("entry", &state.entry), ("run", &state.run), ("handle", &state.handle), ("exit", &state.exit)];
        // A program that is not there does what an empty one does.
        for (name, method) in methods.into_iter().filter(|(_, it)| index % 2 == 0 || !it.is_empty()) {
            let _ = writeln!(out, "  {name} = {}", program(method));
        }
        for (number, (guard, effect, target)) in state.transitions.iter().enumerate() {
            let guard = guard.as_ref().map_or(String::new(), |guard| format!("if {}", condition(guard)));
            let effect = if effect.is_empty() && target % 2 == 0 { String::new() } else { program(effect) };
            let _ = writeln!(out, "  transition t{number} {guard} to S{target} {effect}");
        }
        out += "}\n";
    }
    out += "} }\n";
    out
}

/// What is observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    /// How long one datum takes.
    Latest,
    /// How old what was read becomes.
    Age,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    A,
    Sense,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sink {
    Q,
    Drive,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct World {
    state: usize,
    variables: [u8; 3],
    flags: [bool; 2],
    count: i8,
    statuses: [u8; 2],
    /// The number of the value of port `a`; none before the first.
    port: Option<u8>,
    is_unread: bool,
    /// The jobs since the mark.
    since: Option<u8>,
    is_written: bool,
}

#[derive(Debug, Default, Clone, Copy)]
struct Observed {
    /// The most jobs until a write; none if there was none.
    most: Option<u8>,
    for_ever: bool,
    overwritten: bool,
    is_complete: bool,
}

struct Assumed<'a> {
    states: &'a [bool],
    ready: bool,
    new_b: bool,
}

/// What a component does next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Next {
    First,
    Again,
    Job,
}

/// Why a job ends early.
enum Stop {
    Return,
    /// The run is excluded.
    Excluded,
}

/// Executes one job with one sequence of choices.
struct Run<'a> {
    core: &'a Core,
    world: World,
    mode: Mode,
    ends: (Source, Sink),
    assumed: &'a Assumed<'a>,
    picks: &'a mut Vec<(usize, usize)>,
    next: usize,
    observed: &'a mut Observed,
    source_state: usize,
    /// Before the first job: nothing is marked yet.
    is_start: bool,
}

impl Run<'_> {
    fn pick(&mut self, of: usize) -> usize {
        if self.next == self.picks.len() {
            self.picks.push((0, of));
        }
        self.next += 1;
        self.picks[self.next - 1].0
    }

    fn mark(&mut self) -> Result<(), Stop> {
        self.world.since = Some(0);
        if self.assumed.states[self.source_state] && !self.is_start { Ok(()) } else { Err(Stop::Excluded) }
    }

    /// Data may arrive.
    fn arrivals(&mut self) -> Result<(), Stop> {
        let is_marked = self.world.since.is_some();
        let can_mark = self.mode == Mode::Latest && !is_marked;
        let number = match (self.ends.0, self.mode) {
            (Source::A, _) => match self.pick(if can_mark { 3 } else { 2 }) {
                0 => return Ok(()),
                1 => u8::from(is_marked && self.mode == Mode::Latest) * 2,
                _ => {
                    self.mark()?;
                    1
                }
            },
            (Source::Sense, _) => {
                if can_mark && self.pick(2) == 1 {
                    self.mark()?;
                }
                return Ok(());
            }
        };
        (self.world.port, self.world.is_unread) = (Some(number), true);
        Ok(())
    }

    /// The number of what a source gives.
    fn taken(&mut self, arrived: u8) -> Result<u8, Stop> {
        if self.mode == Mode::Latest {
            return Ok(arrived);
        }
        if self.world.since.is_some() {
            return Ok(2);
        }
        if self.pick(2) == 1 {
            self.mark()?;
            return Ok(1);
        }
        Ok(0)
    }

    fn read(&mut self, port: usize, variable: usize) -> Result<u8, Stop> {
        let status = if port == 0 && self.ends.0 == Source::A {
            self.arrivals()?;
            match self.world.port {
                None => 0,
                Some(number) => {
                    self.world.variables[variable] = self.taken(number)?;
                    1 + u8::from(std::mem::take(&mut self.world.is_unread))
                }
            }
        } else {
            let is_new = port == 1 && self.assumed.new_b && self.world.since.is_some();
            let status = if is_new { 2 } else { self.pick(3) as u8 };
            if status > 0 {
                self.world.variables[variable] = 0;
            }
            status
        };
        self.world.statuses[port] = status;
        Ok(status)
    }

    fn data(&mut self, of: &Data) -> Result<u8, Stop> {
        Ok(match of {
            Data::Var(index) => self.world.variables[*index],
            Data::Constant => 0,
            Data::Sense => {
                if self.ends.0 != Source::Sense {
                    return Ok(0);
                }
                self.arrivals()?;
                let arrived = u8::from(self.world.since.is_some());
                self.taken(arrived)?
            }
            Data::Plan(inner) => self.data(inner)?,
            Data::Mix(one, other) | Data::Plus(one, other) => {
                let one = self.data(one)?;
                one.max(self.data(other)?)
            }
        })
    }

    fn condition(&mut self, of: &Condition) -> Result<bool, Stop> {
        Ok(match of {
            Condition::Read(port, variable, status) => self.read(*port, *variable)? == *status,
            Condition::Status(port, status) => self.world.statuses[*port] != *status,
            Condition::Flag(index) => self.world.flags[*index],
            Condition::Ready => (self.assumed.ready && self.world.since.is_some()) || self.pick(2) == 1,
            Condition::Unknown => self.pick(2) == 1,
            Condition::Count("==", value) => self.world.count == *value,
            Condition::Count("!=", value) => self.world.count != *value,
            Condition::Count("<", value) => self.world.count < *value,
            Condition::Count(_, value) => self.world.count <= *value,
            Condition::Not(inner) => !self.condition(inner)?,
            Condition::And(one, other) => self.condition(one)? && self.condition(other)?,
            Condition::Or(one, other) => self.condition(one)? || self.condition(other)?,
        })
    }

    fn write(&mut self, number: u8) {
        let World { since: Some(since), is_written, .. } = self.world else { return };
        match self.mode {
            Mode::Latest if is_written => self.observed.overwritten |= number == 0,
            Mode::Latest if number > 0 => {
                self.observed.most = self.observed.most.max(Some(since.max(1)));
                self.world.is_written = true;
            }
            Mode::Age if number == 1 => {
                self.observed.most = self.observed.most.max(Some(since));
                self.observed.for_ever |= since >= FOR_EVER;
            }
            _ => {}
        }
    }

    fn program(&mut self, of: &[Statement]) -> Result<(), Stop> {
        match self.block(of) {
            Err(Stop::Return) => Ok(()),
            other => other,
        }
    }

    fn block(&mut self, of: &[Statement]) -> Result<(), Stop> {
        of.iter().try_for_each(|statement| self.statement(statement))
    }

    fn statement(&mut self, of: &Statement) -> Result<(), Stop> {
        match of {
            Statement::Read(port, variable) => drop(self.read(*port, *variable)?),
            Statement::Write(value) => {
                let value = self.data(value)?;
                if self.ends.1 == Sink::Q {
                    self.write(value);
                }
            }
            Statement::Drive(order) => {
                let order = self.data(order)?;
                if self.ends.1 == Sink::Drive {
                    self.write(order);
                }
            }
            Statement::Assign(variable, value) => self.world.variables[*variable] = self.data(value)?,
            Statement::Local(value, inner) => {
                self.world.variables[LOCAL] = self.data(value)?;
                let result = self.block(inner);
                self.world.variables[LOCAL] = 0;
                result?;
            }
            Statement::Fill(variable) => self.world.variables[*variable] = 0,
            Statement::Tune(variable, by) => {
                let by = self.data(by)?;
                let it = &mut self.world.variables[*variable];
                *it = by.max(*it);
            }
            Statement::Grab(flag, from, to) => {
                let from = self.data(from)?;
                self.world.variables[*to] = from;
                self.world.flags[*flag] = self.pick(2) == 1;
            }
            Statement::SetFlag(flag, None) => self.world.flags[*flag] = true,
            Statement::SetFlag(flag, Some(value)) => self.world.flags[*flag] = self.condition(value)?,
            Statement::SetCount(value) => self.world.count = *value,
            // Far from all numbers of the text, only the sign matters.
            Statement::AddCount(by) => self.world.count = (self.world.count + by).clamp(-100, 100),
            Statement::Poke => {
                let local = std::mem::take(&mut self.world.variables[LOCAL]);
                self.program(&self.core.operation)?;
                self.world.variables[LOCAL] = local;
            }
            Statement::Bump(None) => {
                self.world.count = if self.world.count < 2 { self.world.count + 1 } else { 0 };
            }
            Statement::Bump(Some(variable)) => {
                if self.pick(2) == 1 {
                    self.world.variables[*variable] = 0;
                }
            }
            Statement::If(held, then, otherwise) => {
                let branch = if self.condition(held)? { then } else { otherwise };
                self.block(branch)?;
            }
            Statement::Return => {
                self.world.variables[LOCAL] = 0;
                return Err(Stop::Return);
            }
        }
        Ok(())
    }

    /// Stops the component if it has run, may configure it again, and starts it with the entry of the initial state.
    fn start(&mut self, core: &Core, is_first: bool) -> Result<(), Stop> {
        let [configure, start, stop] = &core.hooks;
        if !is_first {
            self.program(stop)?;
        }
        if is_first || self.pick(2) == 1 {
            (self.world.variables, self.world.flags, self.world.count) = ([0; 3], [false; 2], 0);
            self.program(configure)?;
        }
        if core.counts_in_machine() {
            self.world.count = 0;
        }
        self.program(start)?;
        self.world.state = 0;
        self.program(&core.states[0].entry)
    }

    fn job(&mut self, core: &Core) -> Result<(), Stop> {
        let state = &core.states[self.world.state];
        // A client may call the operation before, also twice.
        for _ in 0..2 {
            if core.operation.is_empty() || self.pick(2) == 0 {
                break;
            }
            self.program(&core.operation)?;
        }
        self.program(&state.run)?;
        let mut fired = None;
        for transition in &state.transitions {
            let fires = match &transition.0 {
                Some(guard) => self.condition(guard)?,
                None => true,
            };
            if fires {
                fired = Some(transition);
                break;
            }
        }
        match fired {
            Some((_, effect, target)) => {
                self.program(&state.exit)?;
                self.program(effect)?;
                self.program(&core.states[*target].entry)?;
                self.world.state = *target;
            }
            None => self.program(&state.handle)?,
        }
        self.arrivals()?;
        if self.world.since.is_some() && !self.assumed.states[self.world.state] {
            return Err(Stop::Excluded);
        }
        Ok(())
    }
}

/// Executes all jobs of a core, with all choices.
fn observe(core: &Core, mode: Mode, ends: (Source, Sink), assumed: &Assumed<'_>) -> Observed {
    let mut observed = Observed::default();
    let mut seen: HashSet<(World, Next)> = HashSet::new();
    let mut open = VecDeque::new();
    for start in 0..9 {
        let world = World {
            state: 0,
            variables: [0; 3],
            flags: [false; 2],
            count: 0,
            statuses: [(start % 3) as u8, (start / 3) as u8],
            port: None,
            is_unread: false,
            since: None,
            is_written: false,
        };
        seen.insert((world, Next::First));
        open.push_back((world, Next::First));
    }
    while let Some((mut world, next)) = open.pop_front() {
        if seen.len() > STATES {
            return observed;
        }
        if let Some(since) = &mut world.since {
            *since = (*since + 1).min(FOR_EVER);
        }
        let mut picks: Vec<(usize, usize)> = Vec::new();
        loop {
            let source_state = world.state;
            // What an excluded run shows does not count.
            let mut shown = observed;
            let mut run = Run {
                core,
                world,
                mode,
                ends,
                assumed,
                picks: &mut picks,
                next: 0,
                observed: &mut shown,
                source_state,
                is_start: next != Next::Job,
            };
            let result = if next == Next::Job { run.job(core) } else { run.start(core, next == Next::First) };
            let is_kept = result.is_ok();
            let mut after = run.world;
            if is_kept {
                observed = shown;
            }
            if mode == Mode::Latest && after.since == Some(FOR_EVER) && !after.is_written && is_kept {
                observed.for_ever = true;
            } else if is_kept {
                if after.is_written {
                    after.since = Some(1);
                }
                let is_alive = after.since.is_none() || mode == Mode::Latest || after.variables.contains(&1);
                // It may be stopped and started again.
                for next in [Next::Job, Next::Again] {
                    let may_be = is_alive && !(next == Next::Again && after.since.is_some());
                    if may_be && seen.insert((after, next)) {
                        open.push_back((after, next));
                    }
                }
            }
            // The next sequence of choices.
            while picks.last().is_some_and(|(pick, of)| pick + 1 == *of) {
                picks.pop();
            }
            match picks.last_mut() {
                Some((pick, _)) => *pick += 1,
                None => break,
            }
        }
    }
    observed.is_complete = true;
    observed
}

/// How exact a passage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exactness {
    /// An execution shows each of its figures.
    Exact,
    /// The status of a first read, or what another port had before, excludes the path of a figure.
    Loose,
    /// The execution has too many states.
    Unknown,
}

fn check(
    core: &Core,
    ends: (Source, Sink),
    assumed: &Assumed<'_>,
    passage: Option<&Passage<'_>>,
) -> Result<Exactness, String> {
    let latest = observe(core, Mode::Latest, ends, assumed);
    let Some(passage) = passage else {
        return if latest.most.is_some() {
            Err(format!("left out: {latest:?}"))
        } else {
            Ok(Exactness::Exact)
        };
    };
    let age = observe(core, Mode::Age, ends, assumed);
    let releases = passage.releases.as_ref().ok().map(|it| *it as u8);
    let periods = passage.periods.map(|it| it as u8);
    if releases.is_some_and(|it| latest.for_ever && it <= FOR_EVER || latest.most > Some(it)) {
        return Err(format!("N = {releases:?}, and {latest:?}"));
    }
    if latest.overwritten && passage.overwritten.is_none() {
        return Err(format!("does not keep: {latest:?}"));
    }
    let may_write = age.most.is_some();
    if periods.is_some_and(|it| age.for_ever && it < FOR_EVER || age.most > Some(it)) {
        return Err(format!("D = {periods:?}, and {age:?}"));
    }
    if !latest.is_complete || !age.is_complete {
        return Ok(Exactness::Unknown);
    }
    let is_exact = match releases {
        Some(_) => latest.most == releases || latest.for_ever,
        None => latest.for_ever || latest.most.is_none(),
    };
    // Without a bound, and for what is never written, the values of a counter are not followed for a smaller figure.
    let keeps = releases.is_none() || latest.overwritten == passage.overwritten.is_some();
    let is_age = match periods {
        Some(_) => age.most == periods || !may_write,
        None => age.for_ever || !may_write,
    };
    Ok(if is_exact && keeps && is_age { Exactness::Exact } else { Exactness::Loose })
}

#[test]
fn data_takes_as_long_through_a_core_as_an_execution_shows() {
    let (mut passages, mut exact, mut loose, mut bounded) = (0, 0, 0, 0);
    for project in search::seeds("MAUVE_CORES", 75) {
        let random = Random::of_seed(project + 1);
        let mut generator = Generator { random, has_local: false, counts: false, calls: false };
        let cores: Vec<Core> = (0..CORES).map(|_| generator.core()).collect();
        let texts: Vec<String> =
            cores.iter().enumerate().map(|(index, core)| text(core, &format!("K{index}"))).collect();
        let db = Database::default();
        let all = format!("{LIBRARY}{}", texts.concat());
        let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), all)]);
        let of = projects(&db, workspace)[0];
        for (index, core) in cores.iter().enumerate() {
            let decl = names_of(&db, of).anywhere(Kind::Core, &format!("K{index}"))[0];
            let codel = |name: &str| names_of(&db, of).anywhere(Kind::Codel, name)[0];
            let is_assumed = generator.chance(40);
            let mut states = vec![true; core.states.len()];
            if is_assumed && core.states.len() > 1 {
                states = states.iter().map(|_| generator.chance(60)).collect();
                states[generator.random.below(core.states.len())] = true;
            }
            let assumed = Assumed {
                states: &states,
                ready: is_assumed && generator.chance(50),
                new_b: is_assumed && generator.chance(50),
            };
            let names = states.iter().enumerate().filter(|(_, it)| **it && states.contains(&false));
            let names: Vec<Name> = names.map(|(index, _)| format!("S{index}").into()).collect();
            let answers: Vec<Decl<'_>> = if assumed.ready { vec![codel("ready")] } else { Vec::new() };
            let new_data: Vec<Name> = if assumed.new_b { vec!["b".into()] } else { Vec::new() };
            let assumption = Assumption::new(&db, names, answers, new_data, false, false);
            let found = passages_of(&db, of, decl, assumption);
            for source in [Source::A, Source::Sense] {
                for sink in [Sink::Q, Sink::Drive] {
                    let from = match source {
                        Source::A => PassageEnd::Port("a".into()),
                        Source::Sense => PassageEnd::Codel(codel("sense")),
                    };
                    let to = match sink {
                        Sink::Q => PassageEnd::Port("q".into()),
                        Sink::Drive => PassageEnd::Codel(codel("drive")),
                    };
                    let passage = found.all.iter().find(|it| it.from == from && it.to == to);
                    let checked = check(core, (source, sink), &assumed, passage);
                    let exactness = checked.unwrap_or_else(|why| {
                        panic!(
                            "project {project}, {source:?} to {sink:?}, states {states:?}, ready {}, b {}: {why}\n{}",
                            assumed.ready, assumed.new_b, texts[index]
                        )
                    });
                    passages += usize::from(passage.is_some());
                    bounded += usize::from(passage.is_some_and(|it| it.releases.is_ok()));
                    exact += usize::from(passage.is_some() && exactness == Exactness::Exact);
                    loose += usize::from(exactness == Exactness::Loose);
                    if exactness == Exactness::Loose && std::env::var_os("MAUVE_SHOW").is_some() {
                        eprintln!("{source:?} to {sink:?}, {passage:?}\n{}", texts[index]);
                    }
                }
            }
        }
    }
    let all = format!("{exact} exact, {loose} loose, {bounded} with a bound, of {passages}");
    assert!(exact * 10 > passages * 8 && loose * 20 < passages && bounded * 20 > passages, "{all}");
    eprintln!("{all}");
}
