//! The behaviour of random components, by an interpreter that follows the reference of the language.
//!
//! | file | content |
//! |---|---|
//! | `mod.rs` | standalone components, and values |
//! | `interpreter.rs` | executes programs in a `World` |
//! | `run.rs` | the world of a run with random inputs: the actions of a component, line by line |
//! | `periods.rs` | the world of every path through a period: the cost of each transition |
//! | `counters.rs` | components whose programs count and switch modes |
//! | `walks.rs` | the world of the steps between concrete values of variables, and what each costs |
//! | `rig.rs` | the C++ around generated packages: codels, and the program that runs the components |
//!
//! These files depend neither on the analyser nor on the generator.

mod counters;
mod interpreter;
mod path;
mod periods;
mod rig;
mod run;
mod walks;

use crate::model::{Core, Declaration, Expr, File, Form, Model, Port, Program, Shell, Signature, State};
use crate::{Options, Random, random_model_of};

pub use counters::counting;
pub use periods::{Times, edges};
pub use rig::{codels_source, program_source};
pub use run::expected_run;
pub use walks::{Step as WalkStep, Walk, walk};

/// How many periods a run has.
pub const TICKS: usize = 40;

/// A value of a variable, or of an expression.
#[derive(Debug, Clone, PartialEq, PartialOrd)]
pub enum Value {
    /// Of an `int` or a `uint8`.
    Int(i64),
    /// Of a `float`.
    Float(f32),
    /// Of a `double`.
    Double(f64),
    /// Of a `bool`.
    Bool(bool),
    /// Of a `string`.
    Text(String),
    /// Of `read`, `status` and `collect`, as RTT numbers them.
    Status(i64),
    /// It depends on what codels, ports and other components give.
    Unknown,
}

/// A standalone component.
#[derive(Debug, Clone)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Component {
    pub name: String,
    pub shell: Shell,
    pub core: Core,
    /// The events of its run.
    pub scenario: Scenario,
}

/// The events of a component's run.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// The seed of its inputs and of what codels return.
    pub seed: u64,
    /// The values of each property and constant, at first and later.
    pub values: Vec<(Value, Value)>,
    /// Of each input its buffer, 0 without one, below 0 if it is not connected.
    pub buffers: Vec<i64>,
    /// Whether each required operation is connected.
    pub connected: Vec<bool>,
}

/// Components, and the codels that they call.
#[derive(Debug, Clone)]
#[allow(missing_docs, reason = "the words of the grammar")]
pub struct Library {
    pub codels: Vec<Signature>,
    pub components: Vec<Component>,
}

/// Returns a library of components that do nothing undefined in their runs.
pub fn random_library(seed: u64, components: usize) -> Library {
    let options = Options { unreachable_code: false, ..Options::components(4 * components) };
    let mut library = Library::of(&random_model_of(seed, options), seed);
    let all = std::mem::take(&mut library.components);
    let defined = all.into_iter().filter(|it| expected_run(&library, it).is_some());
    library.components = defined.take(components).collect();
    assert_eq!(library.components.len(), components, "too few runs are defined");
    library
}

impl Library {
    /// Returns the standalone components of a model.
    pub fn of(model: &Model, seed: u64) -> Library {
        let mut random = Random::of_seed(!seed >> 1);
        let declarations = &model.files[0].libraries[0].1;
        let mut library = Library { codels: Vec::new(), components: Vec::new() };
        let (mut shells, mut cores) = (Vec::new(), Vec::new());
        for declaration in declarations {
            match declaration {
                Declaration::Codel(codel) => library.codels.push(codel.clone()),
                Declaration::Shell(shell) => shells.push(shell),
                Declaration::Core(core) => cores.push(core),
                Declaration::Component(name, shell, core) => {
                    let shell = (*shells.iter().find(|it| it.name == *shell).unwrap()).clone();
                    let core = (*cores.iter().find(|it| it.name == *core).unwrap()).clone();
                    let scenario = Scenario::random(&mut random, &shell);
                    library.components.push(Component { name: name.clone(), shell, core, scenario });
                }
                _ => {}
            }
        }
        library
    }

    /// Its text.
    pub fn text(&self) -> String {
        let codels = self.codels.iter().cloned().map(Declaration::Codel);
        let components = self.components.iter().flat_map(|Component { name, shell, core, .. }| {
            let component = Declaration::Component(name.clone(), shell.name.clone(), core.name.clone());
            [Declaration::Shell(shell.clone()), Declaration::Core(core.clone()), component]
        });
        let libraries = vec![(Some("machines".to_owned()), codels.chain(components).collect())];
        let file = File { path: "/machines.mal".to_owned(), includes: Vec::new(), libraries };
        Model { files: vec![file], semicolons: true, ..Model::default() }.written().files.swap_remove(0).1
    }
}

impl Component {
    fn inputs(&self) -> impl Iterator<Item = &Port> {
        self.shell.ports.iter().filter(|it| it.is_input)
    }

    fn outputs(&self) -> impl Iterator<Item = &Port> {
        self.shell.ports.iter().filter(|it| !it.is_input)
    }

    fn hook(&self, keyword: &str) -> Option<&Program> {
        self.core.hooks.iter().find(|it| it.keyword == keyword)
    }

    fn states(&self) -> &[State] {
        self.core.machines.first().map_or(&[], |machine| &machine.states)
    }

    fn state(&self, name: &str) -> &State {
        self.states().iter().find(|it| it.name == name).unwrap()
    }

    fn initial_state(&self) -> Option<&State> {
        self.states().iter().find(|it| it.is_initial)
    }

    /// Returns the value of a property or constant that nothing has set.
    fn default(&self, name: &str) -> Value {
        let value = self.shell.values.iter().find(|it| it.name == name).unwrap();
        match &value.value {
            Some(Expr { form: Form::Name(other), .. }) => self.default(other),
            Some(expr) => Value::of(expr).unwrap().converted(&value.ty),
            None => Value::nothing(&value.ty),
        }
    }
}

impl Scenario {
    fn random(random: &mut Random, shell: &Shell) -> Scenario {
        let values = shell.values.iter().map(|it| (Value::random(random, it), Value::random(random, it)));
        let values = values.collect();
        let inputs = shell.ports.iter().filter(|it| it.is_input);
        let buffers = inputs.map(|_| [-1, 0, 0, 0, 1, 3][random.below(6)]).collect();
        let connected = shell.required.iter().map(|_| random.below(100) < 85).collect();
        Scenario { seed: random.below(1 << 40) as u64, values, buffers, connected }
    }
}

/// The ends of an interval.
fn bounds(interval: &str) -> (f64, f64) {
    let ends = interval.trim_matches(['[', ']']).split_once("; ").unwrap();
    (ends.0.parse().unwrap(), ends.1.parse().unwrap())
}

impl Value {
    /// Returns a value for a property or constant. Some of them are outside of their bounds.
    fn random(random: &mut Random, of: &crate::model::Value) -> Value {
        let (low, high) = of.interval.as_deref().map_or((0.0, 9.0), bounds);
        let is_outside = of.interval.is_some() && random.below(100) < 12;
        let number =
            if is_outside { high + 1.0 } else { low + random.below((high - low) as usize + 1) as f64 };
        match of.ty.as_str() {
            "int" | "uint8" => Value::Int(number as i64),
            "float" => Value::Float(number as f32),
            "double" => Value::Double(number),
            "bool" => Value::Bool(number > 4.0),
            _ => Value::Text((*random.of(&["", "left", "\"\\", "a\n\t??/", "é"])).to_owned()),
        }
    }

    /// Returns what a variable without a first value holds.
    fn nothing(ty: &str) -> Value {
        match ty {
            "int" | "uint8" => Value::Int(0),
            "float" => Value::Float(0.0),
            "double" => Value::Double(0.0),
            "bool" => Value::Bool(false),
            "string" => Value::Text(String::new()),
            _ => Value::Status(0),
        }
    }

    /// Returns the value of a literal of type `ty`.
    fn of_literal(ty: &str, text: &str) -> Value {
        match ty {
            "int" | "uint8" => Value::Int(match text.strip_prefix("0x") {
                Some(digits) => i64::from_str_radix(digits, 16).unwrap(),
                None => text.parse().unwrap(),
            }),
            "float" => Value::Float(text.parse().unwrap()),
            "double" => Value::Double(text.parse().unwrap()),
            "bool" => Value::Bool(text == "true"),
            "string" => {
                let mut out = String::new();
                let mut letters = text[1..text.len() - 1].chars();
                while let Some(letter) = letters.next() {
                    out.extend(match letter {
                        '\\' => letters.next().map(|it| match it {
                            'n' => '\n',
                            't' => '\t',
                            it => it,
                        }),
                        letter => Some(letter),
                    });
                }
                Value::Text(out)
            }
            _ => Value::Status(match text {
                "failure" => -1,
                "no_data" | "not_ready" => 0,
                "old_data" | "success" => 1,
                _ => 2,
            }),
        }
    }

    /// Returns the value of an expression of literals.
    fn of(expr: &Expr) -> Option<Value> {
        interpreter::constant(expr)
    }

    /// Converts it to where a `ty` is expected.
    fn converted(self, ty: &str) -> Value {
        match (self, ty) {
            (Value::Int(number), "double") => Value::Double(number as f64),
            (Value::Int(number), "float") => Value::Float(number as f32),
            (Value::Float(number), "double") => Value::Double(f64::from(number)),
            (Value::Double(number), "float") => Value::Float(number as f32),
            (value, _) => value,
        }
    }
}
