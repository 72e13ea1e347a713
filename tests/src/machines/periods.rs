//! The maximal cost of each period of a component, by executing every path: conditions of integer and Boolean literals
//! have their values, and any other condition is true or false.

use std::collections::{BTreeMap, BTreeSet};

use super::interpreter::{Interpreter, Key, Step, World};
use super::path::Path;
use super::{Component, Library, Value};
use crate::model::{Model, Signature};

/// How many paths through the periods of one state are tried.
const MOST_PATHS: usize = 1 << 14;

/// The times of timing tables, at the level that their last column has.
#[derive(Debug, Clone, Default)]
pub struct Times {
    pub(super) codels: BTreeMap<String, u64>,
    pub(super) programs: BTreeMap<String, u64>,
    /// Of each period.
    pub(super) overhead: u64,
}

impl Times {
    /// Returns the key of a program in a table.
    pub(super) fn key(component: &str, Key { state, name, keyword }: Key<'_>) -> String {
        let key = match (state, name) {
            ("", "") => keyword.to_owned(),
            ("", operation) => operation.to_owned(),
            (state, "") => format!("{state}.{keyword}"),
            (state, transition) => format!("{state}.{transition}.{keyword}"),
        };
        format!("machines.{component}/{key}")
    }

    /// Returns the times in the tables of a model.
    pub fn of(model: &Model) -> Times {
        let mut times = Times::default();
        for (header, entries) in model.tomls.iter().flat_map(|toml| &toml.sections) {
            let number = |value: &str| {
                let last = value.trim_matches(['[', ']']).rsplit(", ").next();
                last.and_then(|it| it.parse::<u64>().ok())
            };
            let entries = entries
                .iter()
                .filter_map(|(key, value)| Some((key.trim_matches('"').to_owned(), number(value)?)));
            match header.as_str() {
                "codel" => times.codels.extend(entries),
                "program" => times.programs.extend(entries),
                "overhead" => times.overhead += entries.map(|(_, time)| time).sum::<u64>(),
                _ => {}
            }
        }
        times
    }
}

/// A path through a period, in which only literals have values.
struct Literals<'a>(Path<'a>);

impl World for Literals<'_> {
    fn literal(&self, value: Value) -> Value {
        match value {
            Value::Bool(_) | Value::Int(_) => value,
            _ => Value::Unknown,
        }
    }

    fn stored(&self, _: Value) -> Value {
        Value::Unknown
    }

    fn undefined(&self) -> Step<Value> {
        Ok(Value::Unknown)
    }

    fn choose(&mut self) -> bool {
        self.0.choose()
    }

    fn property(&self, _: &str) -> Value {
        Value::Unknown
    }

    fn begin(&mut self, _: Key<'_>) {
        self.0.begin();
    }

    fn end(&mut self, key: Key<'_>) {
        self.0.end(key);
    }

    fn codel(&mut self, codel: &Signature, _: &[Value]) -> Vec<Value> {
        self.0.codel(codel);
        codel.results().map(|_| Value::Unknown).collect()
    }

    fn read(&mut self, _: &str) -> (Value, Option<Value>) {
        (Value::Unknown, None)
    }

    fn status(&mut self, _: &str) -> Value {
        Value::Unknown
    }

    fn write(&mut self, _: &str, _: Value) {}

    fn send(&mut self, _: Option<&str>, _: &Signature, _: Vec<Value>) {}

    fn collect(&mut self, _: &str) -> (Value, Vec<Value>) {
        (Value::Unknown, Vec::new())
    }
}

/// Returns the greatest cost of each edge that periods take, by `source transition target`; none where there are too many
/// paths.
pub fn edges(library: &Library, component: &Component, times: &Times) -> Option<BTreeMap<String, u64>> {
    let mut greatest: BTreeMap<String, u64> = BTreeMap::new();
    let mut open = vec![component.initial_state()];
    let mut reached = BTreeSet::from([component.initial_state().map(|it| it.name.as_str())]);
    while let Some(state) = open.pop() {
        let mut choices = Vec::new();
        for tries in 0.. {
            if tries > MOST_PATHS {
                return None;
            }
            let path = Path::new(component, times, choices);
            let mut interpreter = Interpreter::new(Literals(path), component, &library.codels);
            let fired = match state {
                Some(state) => interpreter.period(state).ok()?,
                None => interpreter.hook("update").ok().map(|_| None)?,
            };
            let source = state.map_or("update", |it| &it.name);
            let (name, target) = fired.map_or(("stay", source), |it| (&it.name, &it.target));
            let Literals(path) = interpreter.world;
            let cost = greatest.entry(format!("{source} {name} {target}")).or_default();
            *cost = path.cost.max(*cost);
            if let Some(transition) = fired
                && reached.insert(Some(&transition.target))
            {
                open.push(Some(component.state(&transition.target)));
            }
            match path.next() {
                Some(next) => choices = next,
                None => break,
            }
        }
    }
    Some(greatest)
}
