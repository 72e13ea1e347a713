//! The steps of a component between concrete values of its variables: periods with their costs, calls of its operations, restarts.
//! Codels, ports and other components give each of a few values.

use std::collections::BTreeMap;

use super::interpreter::{Interpreter, Key, Stop, World};
use super::path::Path;
use super::{Component, Library, Times, Value};
use crate::model::{Signature, State};

/// How many paths are tried in all, and how many from one place by one kind of step.
const MOST_PATHS: usize = 1 << 13;
const MOST_OF_STEP: usize = 1 << 8;

/// Where a component is at the start of a period, by number: its state, and its variables with their values.
#[derive(Debug, Clone, Default)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Walk {
    pub places: Vec<(String, Vec<(String, String)>)>,
    /// Those after a start.
    pub starts: Vec<usize>,
    pub steps: Vec<Step>,
}

/// A step from one place to another. Of equal ones, the longest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// The place before.
    pub source: usize,
    /// The transition that the period takes, or `stay`; none for a call between two periods.
    pub transition: Option<String>,
    /// The place after.
    pub target: usize,
    /// What the period costs.
    pub cost: u64,
}

/// A path in which codels, ports and other components choose among a few values.
struct FewValues<'a> {
    path: Path<'a>,
    property: i64,
}

impl FewValues<'_> {
    fn value(&mut self, ty: &str) -> Value {
        match ty {
            "int" => {
                let number = [2, 0, 1, -1][usize::from(self.choose()) * 2 + usize::from(self.choose())];
                Value::Int(number)
            }
            "bool" => Value::Bool(self.choose()),
            _ => Value::Unknown,
        }
    }

    fn any_status(&mut self) -> i64 {
        i64::from(self.choose()) * (1 + i64::from(self.choose()))
    }
}

impl World for FewValues<'_> {
    fn literal(&self, value: Value) -> Value {
        value
    }

    fn stored(&self, value: Value) -> Value {
        value
    }

    fn undefined(&self) -> Result<Value, Stop> {
        Err(Stop::Undefined)
    }

    fn choose(&mut self) -> bool {
        self.path.choose()
    }

    fn property(&self, _: &str) -> Value {
        Value::Int(self.property)
    }

    fn begin(&mut self, _: Key<'_>) {
        self.path.begin();
    }

    fn end(&mut self, key: Key<'_>) {
        self.path.end(key);
    }

    fn codel(&mut self, codel: &Signature, _: &[Value]) -> Vec<Value> {
        self.path.codel(codel);
        codel.results().map(|ty| self.value(ty)).collect()
    }

    fn read(&mut self, _: &str) -> (Value, Option<Value>) {
        let status = self.any_status();
        let value = (status > 0).then(|| self.value("int"));
        (Value::Status(status), value)
    }

    fn status(&mut self, _: &str) -> Value {
        Value::Status(self.any_status())
    }

    fn write(&mut self, _: &str, _: Value) {}

    fn send(&mut self, _: Option<&str>, _: &Signature, _: Vec<Value>) {}

    fn collect(&mut self, _: &str) -> (Value, Vec<Value>) {
        (Value::Unknown, Vec::new())
    }
}

type Values<'a> = Vec<(&'a str, Value)>;

/// A path that executes a step.
type Run<'a> = Interpreter<'a, FewValues<'a>>;

struct Walker<'a> {
    library: &'a Library,
    component: &'a Component,
    times: &'a Times,
    property: i64,
    paths: usize,
    places: Vec<(Option<&'a State>, Values<'a>)>,
    numbers: BTreeMap<String, usize>,
    found: Walk,
}

/// Returns the steps of a component from its first start on, up to a limit.
pub fn walk(library: &Library, component: &Component, times: &Times, property: i64) -> Walk {
    let (numbers, places, found) = (BTreeMap::new(), Vec::new(), Walk::default());
    let mut walker = Walker { library, component, times, property, paths: 0, places, numbers, found };
    let initial = component.initial_state();
    // Nothing of it depends on the values before.
    for (values, _, _) in walker.after(&[], &|run| {
        run.initialise_core()?;
        run.hook("configure")?;
        start(run, initial)
    }) {
        walker.start(values);
    }
    let mut next = 0;
    while let Some((state, values)) = walker.places.get(next).cloned() {
        if walker.paths > MOST_PATHS {
            break;
        }
        let source = next;
        next += 1;
        let jobs = walker.after(&values, &|run| match state {
            Some(state) => run.period(state),
            None => run.hook("update").map(|_| None),
        });
        for (values, fired, cost) in jobs {
            let target = fired.map_or(state, |it| Some(component.state(&it.target)));
            let transition = Some(fired.map_or("stay", |it| it.name.as_str()).to_owned());
            let target = walker.place(target, values);
            walker.found.steps.push(Step { source, transition, target, cost });
        }
        for operation in &component.core.operations {
            let called = walker.after(&values, &|run| {
                let types = operation.signature.parameters.iter();
                let mut given: Vec<Value> = types.map(|it| run.world.value(&it.ty)).collect();
                run.operation(operation, &mut given).map(|_| None::<()>)
            });
            for (values, _, cost) in called {
                let target = walker.place(state, values);
                walker.found.steps.push(Step { source, transition: None, target, cost });
            }
        }
        let restarted = walker.after(&values, &|run| {
            run.hook("stop")?;
            start(run, initial)
        });
        restarted.into_iter().for_each(|(values, _, _)| walker.start(values));
    }
    walker.found
}

fn start<'a>(run: &mut Run<'a>, initial: Option<&'a State>) -> Result<Option<()>, Stop> {
    run.initialise_machine()?;
    run.hook("start")?;
    initial.map_or(Ok(()), |state| run.method(state, "entry"))?;
    Ok(None)
}

impl<'a> Walker<'a> {
    /// Returns what each path of a step leads to from these values, and its cost.
    fn after<T>(
        &mut self,
        values: &[(&'a str, Value)],
        step: &dyn Fn(&mut Run<'a>) -> Result<Option<T>, Stop>,
    ) -> Vec<(Values<'a>, Option<T>, u64)> {
        let (mut found, mut choices) = (Vec::new(), Vec::new());
        for _ in 0..MOST_OF_STEP {
            self.paths += 1;
            let path = Path::new(self.component, self.times, choices);
            let path = FewValues { path, property: self.property };
            let mut run = Interpreter::new(path, self.component, &self.library.codels);
            if !values.is_empty() {
                run.set_values(values.to_vec());
            }
            let result = step(&mut run);
            let values = run.values();
            // Of an undefined step, nothing is known.
            if let Ok(result) = result {
                found.push((values, result, run.world.path.cost));
            }
            match run.world.path.next() {
                Some(next) => choices = next,
                None => break,
            }
        }
        found
    }

    fn place(&mut self, state: Option<&'a State>, values: Values<'a>) -> usize {
        let name = state.map_or("update", |it| &it.name).to_owned();
        let key = format!("{name} {values:?}");
        if let Some(number) = self.numbers.get(&key) {
            return *number;
        }
        let shown = values.iter().map(|(name, value)| ((*name).to_owned(), written(value)));
        self.found.places.push((name, shown.collect()));
        self.places.push((state, values));
        self.numbers.insert(key, self.places.len() - 1);
        self.places.len() - 1
    }

    fn start(&mut self, values: Values<'a>) {
        let place = self.place(self.component.initial_state(), values);
        if !self.found.starts.contains(&place) {
            self.found.starts.push(place);
        }
    }
}

/// A value as a model writes it.
fn written(value: &Value) -> String {
    match value {
        Value::Int(number) => number.to_string(),
        Value::Bool(value) => value.to_string(),
        Value::Status(status) => {
            ["no_data", "old_data", "new_data"].get(*status as usize).copied().unwrap_or_default().to_owned()
        }
        other => format!("{other:?}"),
    }
}
