//! Random components whose programs count and switch modes.

use super::{Component, Library, Scenario, Times};
use crate::Random;
use crate::model::{
    Block, Core, Declaration, Expr, File, Form, Machine, Model, Operation, Parameter, Port, Program, Shell,
    Signature, State, Statement, Toml, Transition, Value, Variable,
};

/// Variables that programs share, with their types.
const SHARED: [(&str, &str); 6] = [
    ("count", "int"),
    ("turn", "int"),
    ("left", "int"),
    ("busy", "bool"),
    ("ready", "bool"),
    ("seen", "port_status"),
];

/// Returns a library with a component, and what its codels and some of its programs cost.
pub fn counting(seed: u64) -> (Library, Times, Model) {
    let mut maker =
        Maker { random: Random::of_seed(seed), names: Vec::new(), locals: 0, calls: true, depth: 0 };
    let codels = codels();
    let core = maker.core();
    let shell = Shell {
        name: "S".to_owned(),
        values: vec![Value {
            keyword: "property",
            name: "limit".to_owned(),
            ty: "int".to_owned(),
            interval: None,
            bounds: None,
            value: Some(Expr::literal("int", "1")),
        }],
        ports: vec![Port { is_input: true, name: "source".to_owned(), ty: "int".to_owned() }],
        provided: core.operations.iter().map(|it| it.signature.clone()).collect(),
        ..Shell::default()
    };
    let scenario = Scenario { seed, values: Vec::new(), buffers: Vec::new(), connected: Vec::new() };
    let component = Component { name: "K".to_owned(), shell: shell.clone(), core: core.clone(), scenario };
    let costs: Vec<(String, u64)> = codels
        .iter()
        .map(|it| (format!("machines.{}", it.name), 1 + maker.random.below(60) as u64))
        .collect();
    let mut programs: Vec<(String, u64)> = Vec::new();
    for key in ["update", "note", "Idle.run", "Busy.entry", "Idle.go.guard"] {
        let exists = match key.split_once('.') {
            None if key == "update" => core.machines.is_empty(),
            None => !core.operations.is_empty(),
            Some(_) => !core.machines.is_empty(),
        };
        if exists && maker.chance(12) {
            programs.push((format!("machines.K/{key}"), maker.random.below(90) as u64));
        }
    }
    let section = |all: &[(String, u64)]| {
        all.iter().map(|(key, time)| (format!("\"{key}\""), time.to_string())).collect::<Vec<_>>()
    };
    let unit = vec![("unit".to_owned(), "\"ms\"".to_owned())];
    let sections = vec![
        (String::new(), unit),
        ("codel".to_owned(), section(&costs)),
        ("program".to_owned(), section(&programs)),
    ];
    let all = codels.iter().cloned().map(Declaration::Codel);
    let all = all.chain([
        Declaration::Shell(shell),
        Declaration::Core(core),
        Declaration::Component("K".to_owned(), "S".to_owned(), "C".to_owned()),
    ]);
    let libraries = vec![(Some("machines".to_owned()), all.collect())];
    let file = File { path: "/machines.mal".to_owned(), includes: Vec::new(), libraries };
    let times =
        Times { codels: costs.into_iter().collect(), programs: programs.into_iter().collect(), overhead: 0 };
    let config = Toml {
        path: "/mauve.toml".to_owned(),
        sections: vec![
            ("project".to_owned(), vec![("root".to_owned(), "\"machines.mal\"".to_owned())]),
            ("timing".to_owned(), vec![("tables".to_owned(), "[\"times.toml\"]".to_owned())]),
        ],
    };
    let table = Toml { path: "/times.toml".to_owned(), sections };
    let model = Model { files: vec![file], tomls: vec![config, table], semicolons: true, ..Model::default() };
    (Library { codels, components: vec![component] }, times, model)
}

fn codels() -> Vec<Signature> {
    let codel = |name: &str, result: &str, parameters: &[(&'static str, &str)]| Signature {
        name: name.to_owned(),
        result: result.to_owned(),
        parameters: (parameters.iter())
            .map(|(direction, ty)| Parameter { direction, name: "it".to_owned(), ty: (*ty).to_owned() })
            .collect(),
    };
    vec![
        codel("work", "void", &[]),
        codel("plan", "void", &[]),
        codel("move", "void", &[]),
        codel("sense", "bool", &[]),
        codel("pick", "int", &[]),
        codel("bump", "void", &[("inout ", "int")]),
        codel("tell", "bool", &[("out ", "bool")]),
    ]
}

struct Maker {
    random: Random,
    /// The variables in scope.
    names: Vec<(String, String)>,
    locals: usize,
    /// Whether programs may call operations.
    calls: bool,
    depth: usize,
}

impl Maker {
    fn chance(&mut self, percent: usize) -> bool {
        self.random.below(100) < percent
    }

    fn core(&mut self) -> Core {
        let is_machine = self.chance(55);
        let (mut variables, mut of_machine) = (Vec::new(), Vec::new());
        for (name, ty) in SHARED {
            if self.chance(35) {
                continue;
            }
            let value = self.chance(90).then(|| self.literal(ty));
            let variable = Variable { name: name.to_owned(), ty: ty.to_owned(), value };
            if is_machine && self.chance(40) {
                of_machine.push(variable)
            } else {
                variables.push(variable)
            }
            self.names.push((name.to_owned(), ty.to_owned()));
        }
        let mut core = Core { name: "C".to_owned(), shell: "S".to_owned(), variables, ..Core::default() };
        self.calls = false;
        if self.chance(35) {
            let parameters =
                vec![Parameter { direction: "in ", name: "by".to_owned(), ty: "int".to_owned() }];
            let result = if self.chance(50) { "int" } else { "void" }.to_owned();
            self.names.push(("by".to_owned(), "int".to_owned()));
            let few = self.names.clone();
            // Most operations change little: what they change is unknown between two periods.
            self.names.retain(|(_, ty)| ty == "int");
            let kept = 1 + usize::from(self.chance(30));
            self.names.truncate(kept);
            self.names.push(("by".to_owned(), "int".to_owned()));
            let mut body = self.block(2);
            if result == "int" {
                body.push(Statement::Return("return".to_owned(), Some(self.number())));
            }
            self.names = few;
            self.names.retain(|(name, _)| name != "by");
            let signature = Signature { name: "note".to_owned(), parameters, result };
            core.operations.push(Operation { signature, body });
        }
        for keyword in ["configure", "start", "stop"] {
            if self.chance(20) {
                core.hooks.push(Program { keyword: keyword.to_owned(), body: self.block(1) });
            }
        }
        self.calls = !core.operations.is_empty();
        if is_machine {
            core.machines.push(self.machine(of_machine));
        } else {
            let mut body = self.block(4);
            body.extend(self.block(4));
            core.hooks.push(Program { keyword: "update".to_owned(), body });
        }
        core
    }

    fn machine(&mut self, variables: Vec<Variable>) -> Machine {
        let names = ["Idle", "Busy", "Lost"];
        let count = 2 + self.random.below(2);
        let mut states = Vec::new();
        for (index, name) in names.iter().take(count).enumerate() {
            let mut methods = Vec::new();
            for keyword in ["entry", "run", "handle", "exit"] {
                let must = (index == 0 && keyword == "run") || (index == 1 && keyword == "entry");
                if must || self.chance(45) {
                    methods.push(Program { keyword: keyword.to_owned(), body: self.block(2) });
                }
            }
            let mut transitions = Vec::new();
            for transition in ["go", "turn_back"].iter().take(1 + self.random.below(2)) {
                let target = (*self.random.of(&names[..count])).to_owned();
                let target = if index == 0 && *transition == "go" { "Busy".to_owned() } else { target };
                let is_free = index > 0 && self.chance(15);
                let guard = (!is_free).then(|| self.condition(2));
                let effect = self.chance(35).then(|| self.block(1));
                transitions.push(Transition { name: (*transition).to_owned(), guard, target, effect });
            }
            let is_initial = index == 0;
            states.push(State {
                is_initial,
                name: (*name).to_owned(),
                methods,
                transitions,
                later_methods: Vec::new(),
            });
        }
        // Each state is the target of one.
        if count == 3
            && let Some(first) = states.get_mut(1).and_then(|it| it.transitions.first_mut())
        {
            first.target = "Lost".to_owned();
        }
        Machine { keyword: "statemachine".to_owned(), variables, states }
    }

    fn block(&mut self, most: usize) -> Block {
        let scope = self.names.len();
        let count = 1 + self.random.below(most);
        self.depth += 1;
        let block = (0..count).flat_map(|_| self.statement()).collect();
        self.depth -= 1;
        self.names.truncate(scope);
        block
    }

    fn of(&mut self, ty: &str) -> Option<String> {
        let all: Vec<String> =
            self.names.iter().filter(|(_, it)| it == ty).map(|(name, _)| name.clone()).collect();
        (!all.is_empty()).then(|| self.random.of(&all).clone())
    }

    fn variable(&mut self) -> Option<(String, String)> {
        let all: Vec<_> = self.names.iter().filter(|(name, _)| name != "by").cloned().collect();
        (!all.is_empty()).then(|| self.random.of(&all).clone())
    }

    fn statement(&mut self) -> Vec<Statement> {
        let call = |name: &str, arguments: Vec<Expr>| Statement::Expr(called("void", name, arguments));
        match self.random.below(14) {
            0..=2 => vec![call(self.random.of::<&str>(&["work", "plan", "move"]), Vec::new())],
            3..=6 if self.depth < 4 => {
                let condition = self.condition(2);
                let then = self.block(3);
                let otherwise = self.chance(65).then(|| self.block(2));
                vec![Statement::If(condition, then, otherwise)]
            }
            7 if self.depth < 4 => {
                // A counter of every n-th period.
                let Some(name) = self.of("int").filter(|it| it != "by") else { return Vec::new() };
                let is_done = binary("bool", named("int", &name), "<=", Expr::literal("int", "0"));
                let first = Statement::Assign(
                    name.clone(),
                    Expr::literal("int", (1 + self.random.below(4)).to_string()),
                );
                let step = binary("int", named("int", &name), "-", Expr::literal("int", "1"));
                let then = [self.block(2), vec![first]].concat();
                vec![Statement::If(is_done, then, Some(vec![Statement::Assign(name, step)]))]
            }
            8 => match self.of("int").filter(|it| it != "by") {
                Some(name) if self.chance(50) => vec![call("bump", vec![named("int", &name)])],
                Some(name) => vec![Statement::Expr(called(
                    "status",
                    "read",
                    vec![named("int", "source"), named("int", &name)],
                ))],
                None => Vec::new(),
            },
            9 if self.calls => vec![call("note", vec![self.number()])],
            10 => {
                let ty = *self.random.of(&["int", "bool"]);
                self.locals += 1;
                let name = format!("local{}", self.locals);
                let value = Some(self.value(ty));
                self.names.push((name.clone(), ty.to_owned()));
                vec![Statement::Variable(Variable { name, ty: ty.to_owned(), value })]
            }
            11 if self.depth > 1 && self.chance(25) => vec![],
            _ => match self.variable() {
                Some((name, ty)) => {
                    let value = self.value(&ty);
                    vec![Statement::Assign(name, value)]
                }
                None => Vec::new(),
            },
        }
    }

    fn literal(&mut self, ty: &str) -> Expr {
        match ty {
            "int" => Expr::literal("int", self.random.below(4).to_string()),
            "bool" => Expr::literal("bool", *self.random.of(&["true", "false"])),
            _ => Expr::literal("status", *self.random.of(&["no_data", "old_data", "new_data"])),
        }
    }

    fn value(&mut self, ty: &str) -> Expr {
        match ty {
            "int" => self.number(),
            "bool" if self.chance(40) => self.condition(1),
            "port_status" if self.chance(40) => called("status", "status", vec![named("int", "source")]),
            "port_status" => match self.of("int").filter(|it| it != "by") {
                Some(name) if self.chance(30) => {
                    called("status", "read", vec![named("int", "source"), named("int", &name)])
                }
                _ => self.literal(ty),
            },
            _ => self.literal(ty),
        }
    }

    fn number(&mut self) -> Expr {
        let variable = self.of("int").map_or_else(|| Expr::literal("int", "1"), |it| named("int", &it));
        match self.random.below(12) {
            0..=3 => self.literal("int"),
            4 => variable,
            5 if self.depth < 3 => called("int", "pick", Vec::new()),
            6 => named("int", "limit"),
            7 => binary("int", variable, "%", Expr::literal("int", "3")),
            it => {
                let operator = if it < 10 { "-" } else { "+" };
                binary(
                    "int",
                    variable,
                    operator,
                    Expr::literal("int", (1 + self.random.below(2)).to_string()),
                )
            }
        }
    }

    fn condition(&mut self, depth: usize) -> Expr {
        let flag = self.of("bool").map(|it| named("bool", &it));
        match self.random.below(12) {
            0..=4 => {
                let operator = *self.random.of(&["==", "==", "!=", "<", ">=", ">"]);
                let (left, right) = (self.number(), self.literal("int"));
                let left = self.of("int").filter(|_| depth > 0).map_or(left, |it| named("int", &it));
                binary("bool", left, operator, right)
            }
            5 | 6 => flag.unwrap_or_else(|| called("bool", "sense", Vec::new())),
            7 => match (self.of("port_status"), self.of("bool").filter(|_| depth > 1)) {
                (Some(seen), _) => {
                    binary("bool", named("port_status", &seen), "==", self.literal("port_status"))
                }
                (None, Some(flag)) => called("bool", "tell", vec![named("bool", &flag)]),
                (None, None) => called("bool", "sense", Vec::new()),
            },
            8 | 9 if depth > 0 => {
                let operator = *self.random.of(&["&&", "||"]);
                let (left, right) = (self.condition(depth - 1), self.condition(depth - 1));
                binary("bool", left, operator, right)
            }
            10 => {
                let inner = self.condition(depth.saturating_sub(1));
                Expr { ty: "bool".to_owned(), form: Form::Unary("!", Box::new(parens(inner))) }
            }
            _ => called("bool", "sense", Vec::new()),
        }
    }
}

fn parens(inner: Expr) -> Expr {
    Expr { ty: inner.ty.clone(), form: Form::Parens(Box::new(inner)) }
}

fn named(ty: &str, name: &str) -> Expr {
    Expr { ty: ty.to_owned(), form: Form::Name(name.to_owned()) }
}

fn called(ty: &str, name: &str, arguments: Vec<Expr>) -> Expr {
    Expr { ty: ty.to_owned(), form: Form::Call(name.to_owned(), arguments) }
}

fn binary(ty: &str, left: Expr, operator: &'static str, right: Expr) -> Expr {
    let form = Form::Binary(Box::new(parens(left)), operator, Box::new(parens(right)));
    Expr { ty: ty.to_owned(), form }
}
