//! Cores are executed by an interpreter that knows nothing of the analyser: every way through a period. Conditions of
//! literals have their value, those with calls are true or false as they please. No period costs more than its edge of the
//! state machine says, and each edge is attained: what programs cost is safe, and it is exact. Where conditions depend on
//! flags that programs set, an edge may cost more than any period does, and never less.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use proptest::prelude::*;

/// Milliseconds of the codels `c0`, `c1`, …; those from [`WITH_ARGUMENT`] on have one argument.
const CODELS: [u64; 6] = [1, 2, 5, 11, 23, 47];
const WITH_ARGUMENT: usize = 3;
const OPERATIONS: usize = 3;
const FLAGS: usize = 2;

#[derive(Debug, Clone)]
enum Number {
    Literal(i64),
    Codel(usize, Option<Box<Number>>),
    Sum(Box<Number>, Box<Number>),
}

#[derive(Debug, Clone)]
enum Condition {
    Literal(bool),
    Flag(usize),
    Compare(Number, Number),
    Not(Box<Condition>),
    And(Box<Condition>, Box<Condition>),
    Or(Box<Condition>, Box<Condition>),
}

#[derive(Debug, Clone)]
enum Statement {
    Call(Number),
    Assign(Number),
    Local(Option<Number>),
    /// One of the operations behind the one that this stands in, where there is one.
    Operation(usize),
    Set(usize, bool),
    Block(Vec<Statement>),
    If(Condition, Vec<Statement>, Option<Vec<Statement>>),
    Return,
}

#[derive(Debug, Clone)]
struct Transition {
    guard: Option<Condition>,
    target: usize,
    effect: Option<Vec<Statement>>,
}

#[derive(Debug, Clone)]
struct State {
    entry: Option<Vec<Statement>>,
    run: Option<Vec<Statement>>,
    handle: Option<Vec<Statement>>,
    exit: Option<Vec<Statement>>,
    transitions: Vec<Transition>,
}

#[derive(Debug, Clone)]
struct Core {
    operations: Vec<Vec<Statement>>,
    states: Vec<State>,
    /// Times of whole programs: which of all keys (by its number, modulo how many there are), and how long.
    overrides: Vec<(usize, u64)>,
    overhead: u64,
}

// The text.

impl Number {
    fn text(&self) -> String {
        match self {
            Number::Literal(value) => value.to_string(),
            Number::Codel(codel, None) => format!("c{codel}()"),
            Number::Codel(codel, Some(argument)) => format!("c{codel}({})", argument.text()),
            Number::Sum(left, right) => format!("({} + {})", left.text(), right.text()),
        }
    }
}

impl Condition {
    fn text(&self) -> String {
        match self {
            Condition::Literal(value) => value.to_string(),
            Condition::Flag(flag) => format!("b{flag}"),
            Condition::Compare(left, right) => format!("{} > {}", left.text(), right.text()),
            Condition::Not(inner) => format!("!({})", inner.text()),
            Condition::And(left, right) => format!("({}) && ({})", left.text(), right.text()),
            Condition::Or(left, right) => format!("({}) || ({})", left.text(), right.text()),
        }
    }
}

/// The operation that is meant where those from `first` on may be called.
fn operation(raw: usize, first: usize) -> Option<usize> {
    (first < OPERATIONS).then(|| first + raw % (OPERATIONS - first))
}

fn block_text(block: &[Statement], first: usize) -> String {
    let mut out = String::from("{ ");
    for (index, statement) in block.iter().enumerate() {
        let _ = match statement {
            Statement::Call(number) | Statement::Assign(number) => write!(out, "v = {}; ", number.text()),
            Statement::Local(None) => write!(out, "var w{index}: int; "),
            Statement::Local(Some(number)) => write!(out, "var w{index}: int = {}; ", number.text()),
            Statement::Set(flag, value) => write!(out, "b{flag} = {value}; "),
            Statement::Operation(raw) => match operation(*raw, first) {
                Some(operation) => write!(out, "op{operation}(); "),
                None => Ok(()),
            },
            Statement::Block(inner) => write!(out, "{} ", block_text(inner, first)),
            Statement::If(condition, then, otherwise) => {
                let then = block_text(then, first);
                let otherwise = otherwise.as_deref().map(|it| format!("else {}", block_text(it, first)));
                write!(out, "if ({}) then {then} {} ", condition.text(), otherwise.unwrap_or_default())
            }
            Statement::Return => write!(out, "return; "),
        };
    }
    out + "}"
}

impl Core {
    fn programs(&self) -> Vec<String> {
        let mut keys: Vec<String> = (0..self.operations.len()).map(|index| format!("op{index}")).collect();
        for (index, state) in self.states.iter().enumerate() {
            let methods = [
                ("entry", &state.entry),
                ("run", &state.run),
                ("handle", &state.handle),
                ("exit", &state.exit),
            ];
            let there = methods.iter().filter(|(_, program)| program.is_some());
            keys.extend(there.map(|(name, _)| format!("s{index}.{name}")));
            for (number, transition) in state.transitions.iter().enumerate() {
                keys.extend(transition.guard.iter().map(|_| format!("s{index}.t{number}.guard")));
                keys.extend(transition.effect.iter().map(|_| format!("s{index}.t{number}.effect")));
            }
        }
        keys
    }

    fn overrides(&self) -> BTreeMap<String, u64> {
        let keys = self.programs();
        self.overrides.iter().map(|&(raw, time)| (keys[raw % keys.len()].clone(), time)).collect()
    }

    fn fixture(&self) -> String {
        let mut out = String::new();
        for codel in 0..CODELS.len() {
            let parameter = if codel < WITH_ARGUMENT { "" } else { "in x: int" };
            let _ = writeln!(out, "codel c{codel}({parameter}): int");
        }
        let provided: Vec<String> =
            (0..OPERATIONS).map(|index| format!("provide op{index}(): void")).collect();
        let _ = writeln!(out, "shell S {{ {} }}\ncore K(S) {{\n  var v: int = 0", provided.join(" "));
        for flag in 0..FLAGS {
            let _ = writeln!(out, "  var b{flag}: bool = false");
        }
        for (index, operation) in self.operations.iter().enumerate() {
            let _ = writeln!(out, "  provide op{index}() = {}", block_text(operation, index + 1));
        }
        out += "  statemachine {\n";
        for (index, state) in self.states.iter().enumerate() {
            let _ = writeln!(out, "    {}state s{index} {{", if index == 0 { "initial " } else { "" });
            for (number, transition) in state.transitions.iter().enumerate() {
                let guard = transition.guard.as_ref().map(|guard| format!("if ({}) ", guard.text()));
                let effect = transition.effect.as_deref().map(|effect| block_text(effect, 0));
                let _ = writeln!(
                    out,
                    "      transition t{number} {}to s{} {}",
                    guard.unwrap_or_default(),
                    transition.target % self.states.len(),
                    effect.unwrap_or_default()
                );
            }
            let methods = [
                ("entry", &state.entry),
                ("run", &state.run),
                ("handle", &state.handle),
                ("exit", &state.exit),
            ];
            for (name, program) in methods {
                if let Some(program) = program {
                    let _ = writeln!(out, "      {name} = {}", block_text(program, 0));
                }
            }
            out += "    }\n";
        }
        out += "  }\n}\ncomponent C(S, K)\n//- /mauve.toml\ntiming.tables = [\"t.toml\"]\n//- /t.toml\n[codel]\n";
        for (codel, time) in CODELS.iter().enumerate() {
            let _ = writeln!(out, "c{codel} = {time}");
        }
        out += "[program]\n";
        for (key, time) in self.overrides() {
            let _ = writeln!(out, "\"C/{key}\" = {time}");
        }
        let _ = writeln!(out, "[overhead]\ndispatch = {}", self.overhead);
        out
    }
}

// The interpreter.

/// One period under way: which way the next conditions go, and what it has cost.
struct Period<'a> {
    core: &'a Core,
    overrides: &'a BTreeMap<String, u64>,
    /// For each free condition so far, whether it was true; those that come later are false.
    ways: Vec<bool>,
    met: usize,
    cost: u64,
    flags: [bool; FLAGS],
}

impl Period<'_> {
    fn choose(&mut self) -> bool {
        if self.met == self.ways.len() {
            self.ways.push(false);
        }
        self.met += 1;
        self.ways[self.met - 1]
    }

    /// What it gives, where no codel has a say in it.
    fn number(&mut self, number: &Number) -> Option<i64> {
        match number {
            Number::Literal(value) => Some(*value),
            Number::Codel(codel, argument) => {
                if let Some(argument) = argument {
                    self.number(argument);
                }
                self.cost += CODELS[*codel];
                None
            }
            Number::Sum(left, right) => {
                let (left, right) = (self.number(left), self.number(right));
                Some(left? + right?)
            }
        }
    }

    fn condition(&mut self, condition: &Condition) -> bool {
        match condition {
            Condition::Literal(value) => *value,
            Condition::Flag(flag) => self.flags[*flag],
            Condition::Compare(left, right) => match (self.number(left), self.number(right)) {
                (Some(left), Some(right)) => left > right,
                _ => self.choose(),
            },
            Condition::Not(inner) => !self.condition(inner),
            Condition::And(left, right) => self.condition(left) && self.condition(right),
            Condition::Or(left, right) => self.condition(left) || self.condition(right),
        }
    }

    /// Whether it came to the end, and not to a `return`.
    fn block(&mut self, block: &[Statement], first: usize) -> bool {
        block.iter().all(|statement| match statement {
            Statement::Call(number) | Statement::Assign(number) | Statement::Local(Some(number)) => {
                self.number(number);
                true
            }
            Statement::Local(None) => true,
            Statement::Operation(raw) => {
                if let Some(index) = operation(*raw, first) {
                    self.program(
                        &format!("op{index}"),
                        Some(&self.core.operations[index].clone()),
                        index + 1,
                    );
                }
                true
            }
            Statement::Set(flag, value) => {
                self.flags[*flag] = *value;
                true
            }
            Statement::Block(inner) => self.block(inner, first),
            Statement::If(condition, then, otherwise) => {
                if self.condition(condition) {
                    self.block(then, first)
                } else {
                    self.block(otherwise.as_deref().unwrap_or_default(), first)
                }
            }
            Statement::Return => false,
        })
    }

    /// Executes what has this key: a table may give another time for it as a whole.
    fn timed<T>(&mut self, key: &str, execute: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.cost;
        let result = execute(self);
        if let Some(time) = self.overrides.get(key) {
            self.cost = before + time;
        }
        result
    }

    fn program(&mut self, key: &str, program: Option<&Vec<Statement>>, first: usize) {
        let Some(program) = program else { return };
        self.timed(key, |period| period.block(program, first));
    }

    /// The transition that fired, and the state after it.
    fn execute(&mut self, index: usize) -> (Option<usize>, usize) {
        let core = self.core;
        let state = &core.states[index];
        self.cost += core.overhead;
        self.program(&format!("s{index}.run"), state.run.as_ref(), 0);
        for (number, transition) in state.transitions.iter().enumerate() {
            let key = format!("s{index}.t{number}");
            let fires = transition
                .guard
                .as_ref()
                .is_none_or(|guard| self.timed(&format!("{key}.guard"), |period| period.condition(guard)));
            if fires {
                let target = transition.target % core.states.len();
                self.program(&format!("s{index}.exit"), state.exit.as_ref(), 0);
                self.program(&format!("{key}.effect"), transition.effect.as_ref(), 0);
                self.program(&format!("s{target}.entry"), core.states[target].entry.as_ref(), 0);
                return (Some(number), target);
            }
        }
        self.program(&format!("s{index}.handle"), state.handle.as_ref(), 0);
        (None, index)
    }
}

/// The greatest cost of each way out of each state that can be reached; `None` where there are too many ways to try.
fn edges(core: &Core) -> Option<BTreeMap<String, u64>> {
    let overrides = core.overrides();
    let mut greatest: BTreeMap<String, u64> = BTreeMap::new();
    let start = (0, [false; FLAGS]);
    let mut reached = BTreeSet::from([start]);
    let mut open = vec![start];
    while let Some((state, flags)) = open.pop() {
        let mut ways = Vec::new();
        for tries in 0.. {
            if tries > 1 << 14 {
                return None;
            }
            let mut period = Period { core, overrides: &overrides, ways, met: 0, cost: 0, flags };
            let (transition, target) = period.execute(state);
            let name = transition.map_or("stay".to_owned(), |number| format!("t{number}"));
            let cost = greatest.entry(format!("s{state} {name} s{target}")).or_default();
            *cost = period.cost.max(*cost);
            if reached.insert((target, period.flags)) {
                open.push((target, period.flags));
            }
            // The next ways: the last that was false is true, what comes behind it is open again.
            ways = period.ways;
            while ways.last() == Some(&true) {
                ways.pop();
            }
            match ways.last_mut() {
                Some(last) => *last = true,
                None => break,
            }
        }
    }
    Some(greatest)
}

// Random cores.

fn number() -> impl Strategy<Value = Number> {
    let leaf = prop_oneof![
        (0..3i64).prop_map(Number::Literal),
        (0..WITH_ARGUMENT).prop_map(|codel| Number::Codel(codel, None))
    ];
    leaf.prop_recursive(2, 4, 2, |inner| {
        prop_oneof![
            (WITH_ARGUMENT..CODELS.len(), inner.clone())
                .prop_map(|(codel, argument)| Number::Codel(codel, Some(Box::new(argument)))),
            (inner.clone(), inner).prop_map(|(left, right)| Number::Sum(Box::new(left), Box::new(right))),
        ]
    })
}

/// One that is true or false as it pleases, or as a flag is.
fn free(flags: bool) -> impl Strategy<Value = Condition> {
    let call = (0..WITH_ARGUMENT).prop_map(|codel| Number::Codel(codel, None));
    let leaf = prop_oneof![
        2 => (number(), call).prop_map(|(left, right)| Condition::Compare(left, right)),
        if flags { 1 } else { 0 } => (0..FLAGS).prop_map(Condition::Flag),
    ];
    joined(leaf)
}

/// One of literals only.
fn constant() -> impl Strategy<Value = Condition> {
    let number = || (0..3i64).prop_map(Number::Literal);
    let leaf = prop_oneof![
        any::<bool>().prop_map(Condition::Literal),
        (number(), number()).prop_map(|(left, right)| Condition::Compare(left, right)),
    ];
    joined(leaf)
}

fn joined(leaf: impl Strategy<Value = Condition> + 'static) -> impl Strategy<Value = Condition> {
    leaf.prop_recursive(2, 3, 2, |inner| {
        prop_oneof![
            inner.clone().prop_map(|it| Condition::Not(Box::new(it))),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| Condition::And(Box::new(a), Box::new(b))),
            (inner.clone(), inner).prop_map(|(a, b)| Condition::Or(Box::new(a), Box::new(b))),
        ]
    })
}

/// Without flags, a constant one joins a free one only at the top: what stands behind an operand that is constant, and has
/// codels, is counted for both of its values.
fn condition(flags: bool) -> BoxedStrategy<Condition> {
    if flags {
        return joined(prop_oneof![3 => free(true), 1 => constant()]).boxed();
    }
    let both = || prop_oneof![(free(false), constant()), (constant(), free(false))];
    prop_oneof![
        6 => free(false),
        1 => constant(),
        1 => both().prop_map(|(a, b)| Condition::And(Box::new(a), Box::new(b))),
        1 => both().prop_map(|(a, b)| Condition::Or(Box::new(a), Box::new(b))),
    ]
    .boxed()
}

fn block(flags: bool) -> impl Strategy<Value = Vec<Statement>> {
    let leaf = prop_oneof![
        4 => number().prop_map(Statement::Call),
        2 => number().prop_map(Statement::Assign),
        2 => proptest::option::of(number()).prop_map(Statement::Local),
        2 => (0..OPERATIONS).prop_map(Statement::Operation),
        2 => Just(Statement::Return),
        if flags { 2 } else { 0 } => (0..FLAGS, any::<bool>()).prop_map(|(flag, value)| Statement::Set(flag, value)),
    ];
    let statement = leaf.prop_recursive(2, 6, 2, move |inner| {
        let block = || prop::collection::vec(inner.clone(), 0..4);
        prop_oneof![
            1 => block().prop_map(Statement::Block),
            3 => (condition(flags), block(), proptest::option::of(block()))
                .prop_map(|(condition, then, otherwise)| Statement::If(condition, then, otherwise)),
        ]
    });
    prop::collection::vec(statement, 0..4)
}

fn core(flags: bool) -> impl Strategy<Value = Core> {
    let program = move || proptest::option::of(block(flags));
    let transition = (proptest::option::weighted(0.8, condition(flags)), 0..4usize, program())
        .prop_map(|(guard, target, effect)| Transition { guard, target, effect });
    let transitions = prop::collection::vec(transition, 0..3);
    let state = (program(), program(), program(), program(), transitions)
        .prop_map(|(entry, run, handle, exit, transitions)| State { entry, run, handle, exit, transitions });
    let operations = prop::collection::vec(block(flags), OPERATIONS);
    let overrides = prop::collection::vec((0..100usize, 0..60u64), 0..3);
    (operations, prop::collection::vec(state, 1..4), overrides, 0..3u64).prop_map(
        |(operations, states, overrides, overhead)| Core { operations, states, overrides, overhead },
    )
}

/// The edges of the analyser, in the same words; of parallel ones the greatest.
fn analysed(core: &Core) -> BTreeMap<String, u64> {
    let mut edges: BTreeMap<String, u64> = BTreeMap::new();
    for line in common::machine(&core.fixture(), "C").lines() {
        let (edge, cost) = line.split_once(": ").unwrap();
        let cost = cost.strip_suffix(" ms").unwrap_or_else(|| panic!("{line} in\n{}", core.fixture()));
        let greatest = edges.entry(edge.to_owned()).or_default();
        *greatest = cost.parse::<u64>().unwrap().max(*greatest);
    }
    edges
}

proptest! {
    // More cases come with more cores that have no period.
    #![proptest_config(ProptestConfig { max_global_rejects: 1 << 20, ..ProptestConfig::with_cases(500) })]
    #[test]
    fn each_edge_costs_what_its_worst_period_does(core in core(false)) {
        let expected = edges(&core);
        prop_assume!(expected.is_some());
        prop_assert_eq!(analysed(&core), expected.unwrap(), "{}", core.fixture());
    }

    #[test]
    fn no_period_costs_more_than_its_edge(core in core(true)) {
        let found = analysed(&core);
        for (edge, cost) in edges(&core).unwrap_or_default() {
            prop_assert!(found.get(&edge).is_some_and(|bound| *bound >= cost), "{edge}: {}", core.fixture());
        }
    }
}
