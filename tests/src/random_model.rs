//! The generator of random models without errors.
//!
//! They are [`Model`]s, so that a test can seed a mistake and know its location.

use std::collections::{BTreeMap, HashSet};

use crate::Random;
use crate::model::*;

/// The contents of a random model.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// The number of standalone components. They are in one library `machines`, compute with values that C++ has
    /// too, hide names by others, and may have warnings. None: a project without warnings, which has several files
    /// and libraries, messages, shells with bases, and a deployed system.
    pub components: Option<usize>,
    /// The greatest number of statements of a block, in standalone components.
    pub statements: usize,
    /// May the right operand of `&&` and `||` be a condition that joins a constant and a call? The analysis counts the
    /// call for both values of the condition.
    pub constant_operands: bool,
    /// May statements follow one that returns? Compilers warn of some of them.
    pub unreachable_code: bool,
}

impl Options {
    /// A project.
    pub const PROJECT: Options =
        Options { components: None, statements: 5, constant_operands: true, unreachable_code: true };

    /// Standalone components.
    pub const fn components(count: usize) -> Options {
        Options { components: Some(count), ..Options::PROJECT }
    }
}

/// Returns the project of a seed.
pub fn random_model(seed: u64) -> Model {
    random_model_of(seed, Options::PROJECT)
}

/// Returns the model of a seed that contains what `options` say, with timing tables for its codels and some programs.
pub fn random_model_of(seed: u64, options: Options) -> Model {
    let maker = Maker {
        random: Random::of_seed(seed),
        options,
        taken: HashSet::new(),
        common: Vec::new(),
        uses: Vec::new(),
        built: Vec::new(),
        recent: Vec::new(),
    };
    match options.components {
        None => maker.model(),
        Some(count) => maker.components(count),
    }
}

/// A type without the package before it.
pub fn plain(ty: &str) -> &str {
    ty.rsplit(['.', ':']).next().unwrap_or(ty)
}

const MESSAGES: [(&str, &str); 12] = [
    ("geometry_msgs", "PoseStamped"),
    ("geometry_msgs", "Twist"),
    ("geometry_msgs", "TwistStamped"),
    ("geometry_msgs", "Point"),
    ("std_msgs", "Float32"),
    ("std_msgs", "Header"),
    ("std_msgs", "String"),
    ("sensor_msgs", "LaserScan"),
    ("sensor_msgs", "Imu"),
    ("nav_msgs", "Odometry"),
    ("nav_msgs", "Path"),
    ("nav_msgs", "OccupancyGrid"),
];
const PACKAGES: [&str; 4] = ["geometry_msgs", "std_msgs", "sensor_msgs", "nav_msgs"];
const EXTERNAL: [&str; 2] = ["Device", "Grid"];
/// With values that can be written down.
const SCALARS: [&str; 6] = ["int", "int", "double", "double", "bool", "string"];
/// The types of standalone components.
const PLAIN: [&str; 9] = ["int", "int", "double", "double", "bool", "string", "uint8", "float", "int"];
/// Names, also those that are keywords elsewhere.
const WORDS: [&str; 30] = [
    "scan", "goal", "pose", "speed", "gap", "map", "next", "target", "order", "route", "here", "wanted",
    "found", "index", "silence", "heading", "mode", "level", "limit", "radius", "way", "to", "port", "entry",
    "start", "from", "initial", "use", "input", "library",
];
/// Names of variables that C++ or RTT use otherwise, and that hide each other.
const RESERVED: [&str; 24] = [
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
const RESERVED_CODELS: [&str; 20] = [
    "measure", "plan", "turn", "halt", "gain", "level", "new", "sweep", "result", "drive", "fit", "sense",
    "start", "grow", "value", "class", "pick", "tell", "ask", "log",
];
const RESERVED_STATES: [&str; 8] =
    ["Waiting", "Moving", "entry", "state", "default", "Blind", "run", "initial"];
/// Codels that return a value of the type of the variable that they change: they reveal the order of evaluation.
const CHANGING: [(&str, &str); 3] = [("count", "int"), ("shift", "double"), ("join", "string")];
const VERBS: [&str; 12] = [
    "plan",
    "steer",
    "drive",
    "measure",
    "estimate",
    "turn",
    "halt",
    "sweep",
    "filter",
    "match_scan",
    "reset",
    "choose",
];
const STATES: [&str; 10] =
    ["Waiting", "Moving", "Planning", "Turning", "Arrived", "Blind", "Manual", "entry", "state", "Stopped"];
const NOUNS: [&str; 10] =
    ["Laser", "Driver", "Guidance", "Control", "Planner", "Mapper", "Switch", "Teleop", "Camera", "Arm"];

/// A variable, a parameter, a property or a constant.
#[derive(Clone)]
struct Known {
    name: String,
    ty: String,
    /// Whether it has a value.
    readable: bool,
    writable: bool,
}

/// The names in scope of a program.
#[derive(Clone, Default)]
struct Scope {
    variables: Vec<Known>,
    /// Codels and operations of one's own.
    calls: Vec<Signature>,
    inputs: Vec<Port>,
    /// The ports that this program may still write, once each.
    outputs: Vec<Port>,
    /// Handlers and their operations.
    handlers: Vec<(String, Signature)>,
    /// The names that the innermost block declares.
    block: Vec<String>,
    /// The variables of the core, which the core's own operations may change.
    shared: Vec<String>,
    /// The core's own operations.
    own: Vec<String>,
    /// The result of an early `return`.
    returns: Returns,
}

#[derive(Clone, Default)]
enum Returns {
    /// No early `return`.
    #[default]
    Never,
    Nothing,
    /// Whether a hook succeeds.
    Success,
    Value(String),
}

impl Scope {
    fn add(&mut self, name: &str, ty: &str, readable: bool, writable: bool) {
        let (name, ty) = (name.to_owned(), plain(ty).to_owned());
        // It hides what has its name.
        self.variables.retain(|it| it.name != name);
        self.calls.retain(|it| it.name != name);
        self.variables.push(Known { name, ty, readable, writable });
    }

    /// Gives the program the ports of a shell.
    fn connect(&mut self, features: &Shell) {
        let (inputs, outputs) = features.ports.iter().cloned().partition(|it| it.is_input);
        (self.inputs, self.outputs) = (inputs, outputs);
    }

    /// Returns the names in scope of the last statement of `body`: without those that variables of `body` hide.
    fn after(&self, body: &Block) -> Scope {
        let mut scope = self.clone();
        for statement in body {
            if let Statement::Variable(Variable { name, .. }) = statement {
                scope.variables.retain(|it| it.name != *name);
                scope.calls.retain(|it| it.name != *name);
            }
        }
        scope
    }

    fn of(&self, ty: &str, fits: impl Fn(&Known) -> bool) -> Vec<String> {
        let all = self.variables.iter().filter(|it| it.ty == plain(ty) && fits(it));
        all.map(|it| it.name.clone()).collect()
    }
}

/// A component and all features of its shell.
#[derive(Clone, Default)]
struct Built {
    /// As it is called from elsewhere.
    name: String,
    features: Shell,
    /// The keys of its programs.
    programs: Vec<String>,
}

struct Maker {
    random: Random,
    options: Options,
    /// Names of the library that is made.
    taken: HashSet<String>,
    /// Codels of the library that every other uses.
    common: Vec<Signature>,
    /// Message packages that the library uses.
    uses: Vec<&'static str>,
    built: Vec<Built>,
    /// The variables that were named last.
    recent: Vec<String>,
}

impl Maker {
    fn chance(&mut self, percent: usize) -> bool {
        self.random.below(100) < percent
    }

    /// Whether standalone components are made. Only they may have warnings.
    fn stands_alone(&self) -> bool {
        self.options.components.is_some()
    }

    fn word(&mut self, words: &[&'static str]) -> &'static str {
        self.random.of::<&str>(words)
    }

    /// A name that is new in the library.
    fn name(&mut self, words: &[&str]) -> String {
        let word = *self.random.of(words);
        let number = (0..).find(|number| !self.taken.contains(&numbered(word, *number)));
        let name = numbered(word, number.unwrap_or_default());
        self.taken.insert(name.clone());
        name
    }

    /// A name of a variable that is new in the library.
    fn variable_name(&mut self) -> String {
        if self.stands_alone() { self.name(&RESERVED) } else { self.name(&WORDS) }
    }

    /// A name for a member of a core: one of those that may be hidden, or a new one.
    fn member_name(&mut self, hidden: &mut Vec<String>) -> String {
        match hidden.len() {
            count if count > 0 && self.chance(60) => hidden.swap_remove(self.random.below(count)),
            _ => self.variable_name(),
        }
    }

    /// A name for a variable of a block; it may hide one outside of the block.
    fn local_name(&mut self, scope: &mut Scope) -> String {
        let name = match self.hideable(scope) {
            hidden if !hidden.is_empty() && self.chance(40) => self.random.of(&hidden).clone(),
            _ => self.variable_name(),
        };
        scope.block.push(name.clone());
        name
    }

    /// The names that a variable of the innermost block may hide.
    fn hideable(&self, scope: &Scope) -> Vec<String> {
        let variables = scope.variables.iter().map(|it| &it.name);
        let all = variables.chain(scope.calls.iter().map(|it| &it.name));
        all.filter(|name| self.stands_alone() && !scope.block.contains(name)).cloned().collect()
    }

    /// Returns one of some variables; in standalone components, often one that was named just before: the order of
    /// evaluation is visible if a statement both reads and changes a variable.
    fn pick(&mut self, mut names: Vec<String>) -> String {
        if self.stands_alone() {
            let recent: Vec<String> = names.iter().filter(|it| self.recent.contains(it)).cloned().collect();
            if !recent.is_empty() && self.chance(50) {
                names = recent;
            }
        }
        let name = self.random.of(&names).clone();
        self.recent.insert(0, name.clone());
        self.recent.truncate(3);
        name
    }

    /// A type as the library can write it.
    fn spelled(&mut self, ty: &str) -> String {
        let Some((package, _)) = MESSAGES.iter().find(|(_, message)| *message == ty) else {
            return ty.to_owned();
        };
        match self.random.below(4) {
            0 => format!("{package}::{ty}"),
            1 => format!("{package}.{ty}"),
            _ if self.uses.contains(package) => ty.to_owned(),
            _ => format!("{package}.{ty}"),
        }
    }

    fn scalar(&mut self) -> String {
        if self.stands_alone() { self.word(&PLAIN).to_owned() } else { self.word(&SCALARS).to_owned() }
    }

    fn message(&mut self) -> &'static str {
        if self.chance(15) { self.word(&EXTERNAL) } else { self.random.of(&MESSAGES).1 }
    }

    /// One of the types of a library, or a scalar.
    fn ty(&mut self, types: &[&'static str]) -> String {
        if self.stands_alone() {
            self.scalar()
        } else if self.chance(45) {
            let ty = self.random.of(types);
            self.spelled(ty)
        } else if self.chance(8) {
            self.word(&["float", "uint8", "int16"]).to_owned()
        } else {
            self.scalar()
        }
    }

    // The libraries.

    fn model(mut self) -> Model {
        let mut model = Model { semicolons: self.chance(50), crlf: self.chance(15), ..Model::default() };
        let mut root = File { path: "/robot.mal".to_owned(), ..File::default() };
        let mut codels = Vec::new();
        let base = self.common(&mut model, &mut root, &mut codels);
        let libraries = 2 + self.random.below(3);
        for number in 0..libraries {
            self.library(number, &base, &mut model, &mut root, &mut codels);
        }
        let timed = codels;
        let system = self.system();
        let library = self.chance(50).then(|| "robot".to_owned());
        if library.is_some() {
            let uses = (0..libraries).map(|number| Declaration::Use(format!("part{number}")));
            root.libraries.push((library, uses.chain(system.declarations).collect()));
        } else if self.chance(50) {
            let path = "/system.mal".to_owned();
            root.includes.push("\"system.mal\"".to_owned());
            model.files.push(File {
                path,
                includes: Vec::new(),
                libraries: vec![(None, system.declarations)],
            });
        } else {
            root.libraries.push((None, system.declarations));
        }
        model.files.insert(0, root);
        model.tomls = self.tomls(system.cpus, &timed);
        model
    }

    /// A library of standalone components.
    fn components(mut self, count: usize) -> Model {
        let codels = self.codels(&[]);
        let mut all: Vec<Declaration> = codels.iter().cloned().map(Declaration::Codel).collect();
        for number in 0..count {
            self.taken = codels.iter().map(|codel| codel.name.clone()).collect();
            self.recent.clear();
            let name = format!("K{number}");
            let mut shell = Shell { name: format!("{name}Shell"), ..Shell::default() };
            self.features(&mut shell, &[]);
            for _ in 0..self.random.below(3) {
                let operation = self.name(&VERBS);
                shell.required.push(self.signature(operation, &[], &["in ", "in ", "out ", "inout "]));
            }
            let core = self.core(&name, &shell, &codels, &[]);
            let programs = programs_of(&core);
            let component = Declaration::Component(name.clone(), shell.name.clone(), core.name.clone());
            self.built.push(Built { name: format!("machines.{name}"), features: shell.clone(), programs });
            all.extend([Declaration::Shell(shell), Declaration::Core(core), component]);
        }
        let keys: Vec<String> = codels.iter().map(|codel| format!("machines.{}", codel.name)).collect();
        let libraries = vec![(Some("machines".to_owned()), all)];
        let file = File { path: "/robot.mal".to_owned(), includes: Vec::new(), libraries };
        let tomls = self.tomls(1, &keys);
        Model { files: vec![file], tomls, semicolons: self.chance(50), crlf: false }
    }

    /// A library of codels and a shell that the others may extend.
    fn common(&mut self, model: &mut Model, root: &mut File, codels: &mut Vec<String>) -> Shell {
        self.uses = PACKAGES.to_vec();
        let types: Vec<&'static str> = (0..3).map(|_| self.message()).collect();
        let made = self.codels(&types);
        codels.extend(made.iter().map(|codel| format!("common.{}", codel.name)));
        let ty = self.scalar();
        let base = Shell {
            name: "Base".to_owned(),
            values: vec![self.value("frame", "property", "string"), self.value("scale", "constant", &ty)],
            ..Shell::default()
        };
        let mut all: Vec<Declaration> =
            PACKAGES.iter().map(|it| Declaration::Use((*it).to_owned())).collect();
        all.extend(made.iter().cloned().map(Declaration::Codel));
        all.push(Declaration::Shell(base.clone()));
        self.common = made;
        root.includes.push("\"parts/common.mal\"".to_owned());
        let path = "/parts/common.mal".to_owned();
        model.files.push(File {
            path,
            includes: Vec::new(),
            libraries: vec![(Some("common".to_owned()), all)],
        });
        base
    }

    /// A library with some components, in one file or two.
    fn library(
        &mut self,
        number: usize,
        base: &Shell,
        model: &mut Model,
        root: &mut File,
        codels: &mut Vec<String>,
    ) {
        let library = format!("part{number}");
        self.taken = self.common.iter().map(|codel| codel.name.clone()).collect();
        self.taken.extend(["frame".to_owned(), "scale".to_owned()]);
        self.uses = PACKAGES.iter().copied().filter(|_| self.random.below(3) > 0).collect();
        let mut uses: Vec<Declaration> = vec![Declaration::Use("common".to_owned())];
        uses.extend(self.uses.iter().map(|it| Declaration::Use((*it).to_owned())));
        let types: Vec<&'static str> = (0..2).map(|_| self.message()).collect();
        let made = self.codels(&types);
        codels.extend(made.iter().map(|codel| format!("{library}.{}", codel.name)));
        let (mut first, mut second) = (uses, Vec::new());
        first.extend(made.iter().cloned().map(Declaration::Codel));
        for _ in 0..1 + self.random.below(2) {
            let noun = self.name(&NOUNS);
            let shell = self.shell(&noun, base, &types, &mut first);
            let features = shell.clone();
            let core = self.core(&noun, &features.1, &made, &types);
            let programs = programs_of(&core);
            second.push(Declaration::Core(core));
            second.push(Declaration::Component(noun.clone(), format!("{noun}Shell"), format!("{noun}Core")));
            first.push(Declaration::Shell(shell.0));
            self.built.push(Built { name: format!("{library}.{noun}"), features: features.1, programs });
        }
        root.includes.push(format!("\"parts/{library}.mal\""));
        let mut file = File { path: format!("/parts/{library}.mal"), ..File::default() };
        if self.chance(40) {
            file.includes = vec![format!("\"{library}_shells.mal\""), "\"../parts/common.mal\"".to_owned()];
            let path = format!("/parts/{library}_shells.mal");
            let libraries = vec![(Some(library.clone()), first)];
            model.files.push(File { path, includes: Vec::new(), libraries });
            file.libraries = vec![(Some(library), second)];
        } else {
            first.extend(second);
            file.libraries = vec![(Some(library), first)];
        }
        model.files.push(file);
    }

    /// Some codels; among them one that makes a value of each of these types out of nothing.
    fn codels(&mut self, types: &[&'static str]) -> Vec<Signature> {
        let mut codels = Vec::new();
        for ty in types {
            let name = self.name(&["make", "open", "create", "fresh"]);
            let ty = self.spelled(ty);
            let seed = Parameter { direction: "in ", name: "seed".to_owned(), ty: "int".to_owned() };
            codels.push(if self.chance(50) {
                Signature { name, parameters: vec![seed], result: ty }
            } else {
                let out = Parameter { direction: "out ", name: "made".to_owned(), ty };
                Signature { name, parameters: vec![seed, out], result: "bool".to_owned() }
            });
        }
        let names = RESERVED_CODELS.map(str::to_owned).to_vec();
        let mut names = if self.stands_alone() { names } else { Vec::new() };
        let count = if self.stands_alone() { names.len() } else { 2 + self.random.below(4) };
        for _ in 0..count {
            let name = names.pop().unwrap_or_else(|| self.name(&VERBS));
            codels.push(self.signature(name, types, &["", "in ", "in ", "out ", "inout "]));
        }
        let changing = CHANGING.iter().filter(|_| self.stands_alone());
        codels.extend(changing.map(|(name, ty)| {
            let (name, result) = ((*name).to_owned(), (*ty).to_owned());
            let changed = Parameter { direction: "inout ", name: "it".to_owned(), ty: result.clone() };
            Signature { name, parameters: vec![changed], result }
        }));
        codels
    }

    fn signature(&mut self, name: String, types: &[&'static str], ways: &[&'static str]) -> Signature {
        let count = self.random.below(4);
        let mut parameters: Vec<Parameter> = Vec::new();
        for number in 0..count {
            let ty = self.ty(types);
            let name = numbered(WORDS[self.random.below(WORDS.len())], number);
            if parameters.iter().all(|it| it.name != name) {
                parameters.push(Parameter { direction: self.word(ways), name, ty });
            }
        }
        let result = if self.chance(30) { "void".to_owned() } else { self.ty(types) };
        Signature { name, parameters, result }
    }

    // Shells.

    /// A shell, and all that it has with its bases.
    fn shell(
        &mut self,
        noun: &str,
        base: &Shell,
        types: &[&'static str],
        declarations: &mut Vec<Declaration>,
    ) -> (Shell, Shell) {
        let mut shell = Shell { name: format!("{noun}Shell"), ..Shell::default() };
        self.features(&mut shell, types);
        let mut all = shell.clone();
        if self.chance(40) {
            shell.bases.push(if self.chance(50) { "Base".to_owned() } else { "common.Base".to_owned() });
            all.values.extend(base.values.iter().cloned());
        }
        if self.chance(30) {
            let mut own = Shell { name: format!("{noun}Base"), ..Shell::default() };
            self.features(&mut own, types);
            shell.bases.push(own.name.clone());
            all.values.extend(own.values.iter().cloned());
            all.ports.extend(own.ports.iter().cloned());
            all.provided.extend(own.provided.iter().cloned());
            declarations.push(Declaration::Shell(own));
        }
        // Operations that another component provides and that can be called without waiting.
        if self.chance(60) {
            let provided: Vec<Signature> =
                self.built.iter().flat_map(|it| it.features.provided.clone()).collect();
            if !provided.is_empty() {
                let mut required = self.random.of(&provided).clone();
                required.name = self.name(&VERBS);
                let parameters = required.parameters.iter_mut();
                parameters.for_each(|it| it.ty = self.spelled(plain(&it.ty)));
                required.result = self.spelled(plain(&required.result));
                shell.required.push(required.clone());
                all.required.push(required);
            }
        }
        (shell, all)
    }

    fn features(&mut self, shell: &mut Shell, types: &[&'static str]) {
        for _ in 0..self.random.below(4) {
            let keyword = self.word(&["property", "property", "constant"]);
            let ty = if self.chance(6) { "uint8".to_owned() } else { self.scalar() };
            let name = self.variable_name();
            let mut value = self.value(&name, keyword, &ty);
            // A value may name a constant of the shell, inherited or not.
            let known =
                shell.values.iter().find(|it| it.keyword == "constant" && it.ty == ty && it.value.is_some());
            if let Some(constant) = known.filter(|_| value.bounds.is_none() && value.value.is_some()) {
                value.value = Some(variable(&constant.name, &ty));
            }
            shell.values.push(value);
        }
        for _ in 0..1 + self.random.below(4) {
            // Components exchange values, often of a type that is already used.
            let outputs = self.built.iter().flat_map(|it| it.features.ports.iter()).filter(|it| !it.is_input);
            let known: Vec<String> = outputs.map(|port| plain(&port.ty).to_owned()).collect();
            let is_input = self.chance(50);
            let known = known.into_iter().filter(|it| self.can_make(it, types)).collect::<Vec<_>>();
            let ty = match is_input && !known.is_empty() {
                true => self.random.of(&known).clone(),
                false => plain(&self.ty(types)).to_owned(),
            };
            let (ty, name) = (self.spelled(&ty), self.name(&WORDS));
            shell.ports.push(Port { is_input, name, ty });
        }
        for _ in 0..self.random.below(3) {
            let name = self.name(&VERBS);
            let ways: &[&str] = if self.chance(60) { &["", "in "] } else { &["in ", "out ", "inout "] };
            let signature = self.signature(name, types, ways);
            shell.provided.push(signature);
        }
    }

    /// Returns whether the library has a codel that makes a value of this type.
    fn can_make(&self, ty: &str, types: &[&'static str]) -> bool {
        SCALARS.contains(&ty)
            || types.contains(&ty)
            || self.common.iter().any(|codel| {
                plain(&codel.result) == ty
                    || codel.parameters.iter().any(|it| it.name == "made" && plain(&it.ty) == ty)
            })
    }

    fn value(&mut self, name: &str, keyword: &'static str, ty: &str) -> Value {
        let number = matches!(ty, "int" | "double" | "uint8" | "float");
        let bounds = (number && self.chance(60)).then(|| {
            let low =
                if ty == "uint8" { self.random.below(5) as i32 } else { self.random.below(100) as i32 - 50 };
            (low, low + 1 + self.random.below(50) as i32)
        });
        let interval = bounds.map(|(low, high)| match ty {
            "double" | "float" if self.chance(60) => {
                format!("[{low}.0; {high}.{}]", if high < 0 { 0 } else { 5 })
            }
            _ => format!("[{low}; {high}]"),
        });
        let value = (self.chance(75) || self.stands_alone()).then(|| self.constant(ty, bounds));
        Value { keyword, name: name.to_owned(), ty: ty.to_owned(), interval, bounds, value }
    }

    /// A value that is known beforehand, within the bounds.
    fn constant(&mut self, ty: &str, bounds: Option<(i32, i32)>) -> Expr {
        let (low, high) = bounds.unwrap_or((0, 40));
        let number = low + self.random.below((high - low + 1) as usize) as i32;
        let int = |number: i32| match number {
            0.. => Expr::literal("int", number.to_string()),
            _ => unary("-", Expr::literal("int", (-number).to_string())),
        };
        let real = |number: i32| match number {
            0.. => Expr::literal("double", format!("{number}.0")),
            _ => unary("-", Expr::literal("double", format!("{}.0", -number))),
        };
        let form = self.random.below(5);
        match (ty, form) {
            ("double", 0) => int(number),
            ("double", 1) => binary("double", real(number - 1), "+", Expr::literal("double", "1e0")),
            ("double", 2) => binary("double", real(2 * number), "/", int(2)),
            ("double" | "float", _) => real(number),
            ("int", 0) => binary("int", int(number - 3), "+", int(3)),
            ("int", 1) => binary("int", binary("int", int(2), "*", int(number / 2)), "+", int(number % 2)),
            ("int", 2) if number >= 0 => Expr::literal("int", format!("0x{number:X}")),
            ("int" | "uint8" | "int16", _) => int(number),
            ("bool", 0) => unary("!", Expr::literal("bool", "false")),
            ("bool", 1) => binary("bool", int(number), "<", int(7)),
            ("bool", _) => Expr::literal("bool", self.word(&["true", "false"])),
            ("string", 0) => binary(
                "string",
                Expr::literal("string", "\"/dev\""),
                "+",
                Expr::literal("string", "\"/tty0\""),
            ),
            (_, 4) if self.stands_alone() => Expr::literal("string", "\"a\\n\\t??/\""),
            _ => {
                let text = self.word(&["\"\"", "\"odom\"", "\"a \\\"b\\\" \\\\ \\n\"", "\"größer // 3\""]);
                Expr::literal("string", text)
            }
        }
    }

    // Cores.

    fn core(&mut self, noun: &str, features: &Shell, codels: &[Signature], types: &[&'static str]) -> Core {
        let mut core = Core { name: format!("{noun}Core"), shell: features.name.clone(), ..Core::default() };
        let mut scope = Scope { calls: codels.to_vec(), ..Scope::default() };
        scope.calls.extend(self.common.iter().cloned());
        features.values.iter().for_each(|it| scope.add(&it.name, &it.ty, true, false));
        let mut hidden = self.hidden(&mut scope);
        if self.stands_alone() {
            scope.connect(features);
        }
        // Messages come from ports, and go to ports.
        let mut wanted: Vec<String> = features.ports.iter().map(|it| plain(&it.ty).to_owned()).collect();
        let results = features.required.iter().map(|it| plain(&it.result).to_owned());
        wanted.extend(results.filter(|it| it != "void"));
        wanted.extend(codels.iter().flat_map(|it| &it.parameters).map(|it| plain(&it.ty).to_owned()));
        wanted.push(self.scalar());
        wanted.push(self.scalar());
        // Values that `configure` or `start` set first: no value that is computed earlier may depend on them.
        let mut setting: Block = Vec::new();
        let mut before = scope.clone();
        // Of standalone components, initial values have no calls, and some variables have no first value.
        let sets = !self.stands_alone() || self.chance(50);
        let calls = if self.stands_alone() { std::mem::take(&mut before.calls) } else { Vec::new() };
        for ty in wanted {
            let is_there = core.variables.iter().any(|it| plain(&it.ty) == ty);
            if is_there && self.chance(80) || !self.can_make(&ty, types) && !is_simple(&ty) {
                continue;
            }
            let name = self.member_name(&mut hidden);
            let is_set = !is_simple(&ty) || self.chance(20);
            let value = match is_set {
                true => None,
                false => Some(self.expr(&before, &ty, 1).unwrap_or_else(|| self.constant(&ty, None))),
            };
            before.add(&name, &ty, !is_set || self.stands_alone(), true);
            scope.add(&name, &ty, true, true);
            setting.extend(self.making(&before, &name, &ty).filter(|_| is_set && sets));
            scope.shared.push(name.clone());
            core.variables.push(Variable { name, ty: self.spelled(&ty), value });
        }
        let first_values = before.clone();
        before.calls.extend(calls);
        let mut sends = Block::new();
        let mut required: Vec<&Signature> = features.required.iter().collect();
        if self.stands_alone() {
            // An operation may have two handlers.
            required.extend(features.required.iter().filter(|_| self.chance(20)));
        }
        for operation in required {
            let handler = self.name(&["request", "answer", "pending"]);
            core.handlers.push((handler.clone(), operation.name.clone()));
            if let Some(send) = self.send(&scope, &handler, operation) {
                sends.push(send);
                scope.handlers.push((handler, operation.clone()));
            }
        }
        for operation in &features.provided {
            if let Some(operation) = self.operation(&scope, operation) {
                scope.calls.push(operation.signature.clone());
                scope.own.push(operation.signature.name.clone());
                core.operations.push(operation);
            }
        }
        let mut set = setting;
        let in_configure = self.chance(40);
        let mut first = if in_configure { std::mem::take(&mut set) } else { Block::new() };
        if self.stands_alone() {
            before = scope.clone();
        }
        before.returns = Returns::Success;
        if in_configure || self.chance(30) {
            first.extend(self.block(&mut before, 2, 1));
            first.extend(self.succeeded(&before, &first));
            core.hooks.push(Program { keyword: "configure".to_owned(), body: first });
        }
        set.extend(sends);
        if !set.is_empty() || self.chance(30) {
            if self.stands_alone() && self.goes_on(&set) {
                set.extend(self.block(&mut before, 3, 2));
            }
            set.extend(self.succeeded(&before, &set));
            core.hooks.push(Program { keyword: "start".to_owned(), body: set });
        }
        for keyword in ["stop", "cleanup"] {
            if self.chance(30) {
                let body = self.block(&mut scope.clone(), 2, 1);
                core.hooks.push(Program { keyword: keyword.to_owned(), body });
            }
        }
        scope.connect(features);
        if self.chance(45) {
            let mut body = self.fresh(&mut core, &mut scope);
            body.extend(self.block(&mut scope, 5, 3));
            if self.chance(20) {
                body.push(Statement::Return("return".to_owned(), None));
            }
            core.hooks.push(Program { keyword: "update".to_owned(), body });
        } else {
            core.machines.push(self.machine(scope, &first_values, hidden));
        }
        core
    }

    /// Some names that variables of a core hide. They leave the scope.
    fn hidden(&mut self, scope: &mut Scope) -> Vec<String> {
        let all = self.hideable(scope);
        let hidden: Vec<String> = all.into_iter().filter(|_| self.chance(20)).collect();
        scope.variables.retain(|it| !hidden.contains(&it.name));
        scope.calls.retain(|it| !hidden.contains(&it.name));
        hidden
    }

    /// How a hook with these statements ends.
    fn succeeded(&mut self, scope: &Scope, body: &Block) -> Option<Statement> {
        let scope = scope.after(body);
        match self.stands_alone() {
            true if !self.goes_on(body) || self.chance(50) => None,
            true => self.early_return(&scope),
            false => self.returned("bool", &scope),
        }
    }

    /// Whether statements may follow these.
    fn goes_on(&self, block: &Block) -> bool {
        self.options.unreachable_code || !returns(block)
    }

    /// Variables whose first value is read from a port, and the reads.
    fn fresh(&mut self, core: &mut Core, scope: &mut Scope) -> Block {
        let mut reads = Block::new();
        for port in scope.inputs.clone() {
            if self.chance(40) {
                let name = self.variable_name();
                let arguments = vec![variable(&port.name, "port"), variable(&name, plain(&port.ty))];
                let form = Form::Call("read".to_owned(), arguments);
                reads.push(Statement::Expr(Expr { ty: "status".to_owned(), form }));
                scope.add(&name, &port.ty, true, true);
                core.variables.push(Variable { name, ty: port.ty.clone(), value: None });
            }
        }
        reads
    }

    /// Gives a variable its first value.
    fn making(&mut self, scope: &Scope, name: &str, ty: &str) -> Option<Statement> {
        if is_simple(ty) {
            return Some(Statement::Assign(name.to_owned(), self.constant(ty, None)));
        }
        let makes = |codel: &&Signature| match codel.parameters.as_slice() {
            [seed] => seed.name == "seed" && plain(&codel.result) == ty,
            [seed, made] => seed.name == "seed" && made.name == "made" && plain(&made.ty) == ty,
            _ => false,
        };
        let codel = scope.calls.iter().find(makes)?;
        let seed = self.constant("int", None);
        Some(match codel.parameters.len() {
            1 => Statement::Assign(name.to_owned(), call(codel, vec![seed])),
            _ => Statement::Expr(call(codel, vec![seed, variable(name, ty)])),
        })
    }

    fn send(&mut self, scope: &Scope, handler: &str, operation: &Signature) -> Option<Statement> {
        let mut arguments = vec![variable(&operation.name, "operation")];
        for parameter in operation.parameters.iter().filter(|it| it.direction != "out ") {
            arguments.push(self.argument(scope, &parameter.ty, 1)?);
        }
        let call = Expr { ty: "handler".to_owned(), form: Form::Call("send".to_owned(), arguments) };
        let is_dropped = self.stands_alone() && self.chance(25);
        Some(if is_dropped { Statement::Expr(call) } else { Statement::Assign(handler.to_owned(), call) })
    }

    fn operation(&mut self, scope: &Scope, declared: &Signature) -> Option<Operation> {
        let mut scope = scope.clone();
        let mut signature = declared.clone();
        let mut body = Block::new();
        for Parameter { direction, name, ty } in &mut signature.parameters {
            if self.stands_alone() {
                *name = self.local_name(&mut scope);
            }
            if self.stands_alone() && *direction == "out " {
                body.push(Statement::Assign(name.clone(), self.constant(ty, None)));
            }
            self.taken.insert(name.clone());
            let is_set = *direction != "out " || self.stands_alone();
            scope.add(name, ty, is_set, matches!(*direction, "out " | "inout "));
        }
        if signature.result == "void" && self.chance(50) {
            signature.result.clear();
        }
        scope.returns = match declared.result.as_str() {
            "void" => Returns::Nothing,
            result => Returns::Value(result.to_owned()),
        };
        body.extend(self.block(&mut scope, 3, 2));
        let is_open = self.goes_on(&body);
        let end = if is_open { self.returned(&declared.result, &scope.after(&body)) } else { None };
        let ends = end.is_some() || !is_open;
        body.extend(end);
        // Where no value of the type can be had, there is one way left.
        if declared.result != "void" && !ends {
            let made = "made_here";
            body.push(Statement::Variable(Variable {
                name: made.to_owned(),
                ty: declared.result.clone(),
                value: None,
            }));
            body.push(self.making(&scope, made, plain(&declared.result))?);
            let value = variable(made, plain(&declared.result));
            body.push(Statement::Return("return".to_owned(), Some(value)));
        }
        Some(Operation { signature, body })
    }

    /// A `return` within a program.
    fn early_return(&mut self, scope: &Scope) -> Option<Statement> {
        let value = match &scope.returns {
            Returns::Never => return None,
            Returns::Nothing => None,
            // Most components go on.
            Returns::Success if self.chance(60) => Some(Expr::literal("bool", "true")),
            Returns::Success => Some(self.condition(scope)),
            Returns::Value(ty) => Some(self.argument(scope, ty, 2)?),
        };
        Some(Statement::Return("return".to_owned(), value))
    }

    /// How a program that gives such a value ends.
    fn returned(&mut self, ty: &str, scope: &Scope) -> Option<Statement> {
        let end = |value| Statement::Return("return".to_owned(), value);
        if ty == "void" {
            return self.chance(30).then(|| end(None));
        }
        let value = self.argument(scope, ty, 2)?;
        if self.chance(30) {
            let other = self.argument(scope, ty, 1)?;
            let condition = self.condition(scope);
            return Some(Statement::If(condition, vec![end(Some(value))], Some(vec![end(Some(other))])));
        }
        Some(end(Some(value)))
    }

    fn machine(&mut self, mut scope: Scope, before: &Scope, mut hidden: Vec<String>) -> Machine {
        let mut machine = Machine { keyword: "statemachine".to_owned(), ..Machine::default() };
        // Its variables may hide those of the core.
        hidden.extend(scope.shared.iter().filter(|_| self.stands_alone() && self.chance(20)).cloned());
        // Their initial values do not use the names that they hide.
        let mut before = before.clone();
        before.variables.retain(|it| !hidden.contains(&it.name));
        for _ in 0..self.random.below(4) {
            let (name, ty) = (self.member_name(&mut hidden), self.scalar());
            let value = self.expr(&before, &ty, 1).filter(|_| !self.stands_alone() || self.chance(75));
            machine.variables.push(Variable { name: name.clone(), ty: ty.clone(), value });
            if self.stands_alone() {
                before.add(&name, &ty, true, true);
            }
            scope.add(&name, &ty, true, true);
        }
        // In one period one `run`, one `handle` or effect, one `entry` and one `exit` are executed: a port that only one
        // of these writes is written once.
        let mut of_phase = vec![Vec::new(); 4];
        for port in std::mem::take(&mut scope.outputs) {
            of_phase[self.random.below(4)].push(port.clone());
            if self.stands_alone() {
                of_phase.iter_mut().for_each(|ports| ports.push(port.clone()));
            }
        }
        let mut names: Vec<&str> =
            if self.stands_alone() { RESERVED_STATES.to_vec() } else { STATES.to_vec() };
        let count = 1 + self.random.below(4);
        let states: Vec<String> =
            (0..count).map(|_| names.remove(self.random.below(names.len())).to_owned()).collect();
        scope.returns = Returns::Nothing;
        let initial = if self.stands_alone() { self.random.below(count) } else { 0 };
        for (number, name) in states.iter().enumerate() {
            let mut state = State { is_initial: number == initial, name: name.clone(), ..State::default() };
            for (phase, keyword) in ["run", "handle", "entry", "exit"].into_iter().enumerate() {
                if phase == 0 && !self.stands_alone() || self.chance(50) {
                    let mut scope = Scope { outputs: of_phase[phase].clone(), ..scope.clone() };
                    let body = self.block(&mut scope, 3, 2);
                    let program = Program { keyword: keyword.to_owned(), body };
                    match keyword {
                        "handle" | "exit" if self.stands_alone() => state.later_methods.push(program),
                        _ => state.methods.push(program),
                    }
                }
            }
            // A ring, and some shortcuts before it.
            let extra = self.random.below(3);
            for index in 0..=extra {
                let is_last = index == extra;
                let is_next = is_last && !self.stands_alone();
                let target = if is_next { (number + 1) % count } else { self.random.below(count) };
                let is_guarded = !is_last && !self.stands_alone() || self.chance(85);
                let guard = is_guarded.then(|| self.condition(&scope));
                if self.stands_alone() && self.chance(20) {
                    continue;
                }
                let mut inner = Scope { outputs: of_phase[1].clone(), ..scope.clone() };
                let effect = self.chance(40).then(|| self.block(&mut inner, 2, 1));
                let name = ["go", "to", "done", "back", "if_ready"][index];
                let target = states[target].clone();
                state.transitions.push(Transition { name: name.to_owned(), guard, target, effect });
            }
            machine.states.push(state);
        }
        machine
    }

    // Programs.

    /// Returns some statements; their declarations are out of scope after them, their writes are recorded.
    fn block(&mut self, scope: &mut Scope, size: usize, depth: usize) -> Block {
        let mut inner = Scope { block: Vec::new(), ..scope.clone() };
        let mut block = Block::new();
        let size = if self.stands_alone() { self.options.statements } else { size };
        for _ in 0..1 + self.random.below(size) {
            if !self.goes_on(&block) {
                break;
            }
            block.extend(self.statement(&mut inner, depth));
        }
        scope.outputs = inner.outputs;
        block
    }

    fn statement(&mut self, scope: &mut Scope, depth: usize) -> Vec<Statement> {
        if self.stands_alone() && self.chance(5) {
            return self.early_return(scope).into_iter().collect();
        }
        let found = match self.random.below(12) {
            0 => {
                let ty = self.scalar();
                let name = self.local_name(scope);
                let value = self.argument(scope, &ty, 2);
                scope.add(&name, &ty, true, true);
                return vec![Statement::Variable(Variable { name, ty, value })];
            }
            1 => {
                let messages: Vec<String> = scope.variables.iter().map(|it| it.ty.clone()).collect();
                if messages.is_empty() {
                    return Vec::new();
                }
                let ty = self.random.of(&messages).clone();
                let name = self.local_name(scope);
                let Some(value) = self.making(scope, &name, &ty) else { return Vec::new() };
                scope.add(&name, &ty, true, true);
                let declared = Variable { name, ty: self.spelled(&ty), value: None };
                return vec![Statement::Variable(declared), value];
            }
            2 | 3 => self.assignment(scope),
            4 | 5 => {
                let calls = scope.calls.clone();
                (!calls.is_empty())
                    .then(|| self.random.of(&calls).clone())
                    .and_then(|callee| self.call(scope, &callee, 2).map(Statement::Expr))
            }
            6 => self.read(scope).map(Statement::Expr),
            7 | 8 => self.write(scope),
            9 if depth > 0 => {
                let body = self.block(scope, 2, depth - 1);
                Some(Statement::Block(body))
            }
            10 if depth > 0 => {
                let condition = self.condition(scope);
                let (mut then, mut otherwise) = (scope.clone(), scope.clone());
                let yes = self.block(&mut then, 3, depth - 1);
                let no = self.chance(80).then(|| self.block(&mut otherwise, 2, depth - 1));
                let is_left =
                    |scope: &Scope, port: &Port| scope.outputs.iter().any(|it| it.name == port.name);
                scope.outputs.retain(|port| is_left(&then, port) && is_left(&otherwise, port));
                Some(Statement::If(condition, yes, no))
            }
            _ => {
                let handlers = scope.handlers.clone();
                (!handlers.is_empty()).then(|| self.random.of(&handlers).clone()).and_then(
                    |(handler, operation)| match self.chance(50) {
                        true => self.send(scope, &handler, &operation),
                        false => self.collect(scope, &handler, &operation).map(Statement::Expr),
                    },
                )
            }
        };
        found.into_iter().collect()
    }

    fn assignment(&mut self, scope: &Scope) -> Option<Statement> {
        let targets: Vec<&Known> = scope.variables.iter().filter(|it| it.writable).collect();
        if targets.is_empty() {
            return None;
        }
        let names = targets.iter().map(|it| it.name.clone()).collect();
        let name = self.pick(names);
        let ty = scope.variables.iter().find(|it| it.name == name)?.ty.clone();
        let value = self.argument(scope, &ty, 3)?;
        Some(Statement::Assign(name, value))
    }

    fn read(&mut self, scope: &Scope) -> Option<Expr> {
        let inputs = scope.inputs.clone();
        let port = if inputs.is_empty() { return None } else { self.random.of(&inputs) };
        let targets = scope.of(&port.ty, |it| it.writable);
        let target = if targets.is_empty() { return None } else { self.pick(targets) };
        let arguments = vec![variable(&port.name, "port"), variable(&target, plain(&port.ty))];
        Some(Expr { ty: "status".to_owned(), form: Form::Call("read".to_owned(), arguments) })
    }

    fn write(&mut self, scope: &mut Scope) -> Option<Statement> {
        let outputs = scope.outputs.clone();
        let port = if outputs.is_empty() { return None } else { self.random.of(&outputs) };
        let value = self.argument(scope, &port.ty, 2)?;
        scope.outputs.retain(|it| it.name != port.name || self.stands_alone());
        let arguments = vec![variable(&port.name, "port"), value];
        Some(Statement::Expr(Expr { ty: "void".to_owned(), form: Form::Call("write".to_owned(), arguments) }))
    }

    fn collect(&mut self, scope: &Scope, handler: &str, operation: &Signature) -> Option<Expr> {
        let mut arguments = vec![variable(handler, "handler")];
        let result = (operation.result != "void").then_some(&operation.result);
        let outputs = operation.parameters.iter().filter(|it| matches!(it.direction, "out " | "inout "));
        let mut outputs: Vec<&String> = result.into_iter().chain(outputs.map(|it| &it.ty)).collect();
        // The values need not be fetched.
        if self.chance(20) {
            outputs.clear();
        }
        for ty in outputs {
            let mut targets = scope.of(ty, |it| it.writable);
            let is_taken = |name: &str| arguments.iter().any(|it: &Expr| it.to_string() == name);
            targets.retain(|name| !self.stands_alone() || !is_taken(name));
            if targets.is_empty() {
                return None;
            }
            arguments.push(variable(&self.pick(targets), plain(ty)));
        }
        Some(Expr { ty: "call".to_owned(), form: Form::Call("collect".to_owned(), arguments) })
    }

    fn call(&mut self, scope: &Scope, callee: &Signature, depth: usize) -> Option<Expr> {
        let mut arguments = Vec::new();
        let mut targets: Vec<String> = Vec::new();
        for Parameter { direction, ty, .. } in &callee.parameters {
            arguments.push(match *direction {
                "" | "in " => self.argument(scope, ty, depth.saturating_sub(1))?,
                direction => {
                    let fits = |it: &Known| it.writable && (direction == "out " || it.readable);
                    let mut all = scope.of(ty, fits);
                    all.retain(|it| !targets.contains(it));
                    // An operation of a component that runs is not given what it may change by itself.
                    let is_own = self.stands_alone() && scope.own.contains(&callee.name);
                    all.retain(|it| !is_own || !scope.shared.contains(it));
                    if all.is_empty() {
                        return None;
                    }
                    targets.push(self.pick(all));
                    variable(&targets[targets.len() - 1], plain(ty))
                }
            });
        }
        Some(call(callee, arguments))
    }

    /// A value where such a type is asked for: of the type, or one that becomes it.
    fn argument(&mut self, scope: &Scope, ty: &str, depth: usize) -> Option<Expr> {
        match plain(ty) {
            "double" | "float" if self.chance(25) => self.expr(scope, "int", depth),
            ty => self.expr(scope, ty, depth),
        }
    }

    fn condition(&mut self, scope: &Scope) -> Expr {
        let condition = self.expr(scope, "bool", 3).unwrap_or_else(|| Expr::literal("bool", "true"));
        if self.chance(60) { parens(condition) } else { condition }
    }

    fn expr(&mut self, scope: &Scope, ty: &str, depth: usize) -> Option<Expr> {
        let ty = plain(ty);
        if depth > 0
            && self.stands_alone()
            && self.chance(12)
            && let Some(both) = self.changed_beside(scope, ty)
        {
            return Some(both);
        }
        if depth > 0 && self.chance(60) {
            let composed = match ty {
                "int" | "double" | "bool" | "string" => self.composed(scope, ty, depth - 1),
                "float" | "uint8" if self.stands_alone() => self.of_small_type(scope, ty),
                _ => None,
            };
            if let Some(composed) = composed {
                return Some(if self.chance(10) { parens(composed) } else { composed });
            }
        }
        let known = scope.of(ty, |it| it.readable);
        if !known.is_empty() && self.chance(75) {
            return Some(variable(&self.pick(known), ty));
        }
        let callees: Vec<Signature> =
            scope.calls.iter().filter(|it| plain(&it.result) == ty).cloned().collect();
        if depth > 0 && !callees.is_empty() && self.chance(50) {
            let callee = self.random.of(&callees).clone();
            if let Some(call) = self.call(scope, &callee, depth - 1) {
                return Some(call);
            }
        }
        match ty {
            "float" | "double" if self.stands_alone() => {
                Some(Expr::literal(ty, self.word(&["0.5", "0.1", "3.0", "1e-3", "0.0", "1.5e3"])))
            }
            "uint8" if self.stands_alone() => Some(Expr::literal(ty, self.random.below(6).to_string())),
            "float" => Some(Expr::literal("float", "2.5")),
            "uint8" | "int16" => Some(Expr::literal(ty, self.random.below(100).to_string())),
            "int" | "double" | "bool" | "string" => {
                let literal = self.constant(ty, None);
                Some(literal)
            }
            _ => known.first().map(|name| variable(name, ty)),
        }
    }

    /// A variable, and beside it a call that changes it.
    fn changed_beside(&mut self, scope: &Scope, ty: &str) -> Option<Expr> {
        let (name, _) = CHANGING.iter().find(|(_, of)| *of == ty)?;
        let codel = scope.calls.iter().find(|it| it.name == *name)?.clone();
        let call = self.call(scope, &codel, 0)?;
        let Form::Call(_, arguments) = &call.form else { return None };
        let changed = arguments[0].clone();
        let (left, right) = if self.chance(70) { (changed, call) } else { (call, changed) };
        Some(binary(ty, left, "+", right))
    }

    /// Returns an expression with a variable of type `float` or `uint8`, without another type.
    fn of_small_type(&mut self, scope: &Scope, ty: &str) -> Option<Expr> {
        let known = scope.of(ty, |it| it.readable);
        let left = if known.is_empty() { return None } else { variable(&self.pick(known), ty) };
        if ty == "uint8" {
            let operator = self.word(&["%", "/", "+", "*"]);
            return Some(binary(
                ty,
                left,
                operator,
                Expr::literal(ty, (1 + self.random.below(3)).to_string()),
            ));
        }
        if self.chance(10) {
            return Some(unary("-", left));
        }
        let right = self.expr(scope, ty, 0)?;
        let operator = self.word(&["+", "-", "*"]);
        Some(if self.chance(50) {
            binary(ty, left, operator, right)
        } else {
            binary(ty, right, operator, left)
        })
    }

    /// A variable of type `narrow` and one of type `wide`.
    fn of_two_types(&mut self, scope: &Scope, narrow: &str, wide: &str) -> Option<Expr> {
        let [small, great] = [narrow, wide].map(|ty| scope.of(ty, |it| it.readable));
        if small.is_empty() || great.is_empty() {
            return None;
        }
        let (left, right) = (variable(&self.pick(small), narrow), variable(&self.pick(great), wide));
        Some(binary(wide, left, self.word(&["+", "-"]), right))
    }

    fn composed(&mut self, scope: &Scope, ty: &str, depth: usize) -> Option<Expr> {
        let number = |it: &mut Maker, scope: &Scope| -> Option<Expr> {
            let ty = if it.chance(60) { "int" } else { "double" };
            it.expr(scope, ty, depth)
        };
        if self.stands_alone() && self.chance(15) {
            return match ty {
                "int" if self.chance(50) => self.of_two_types(scope, "uint8", ty),
                "int" => Some(binary(ty, self.expr(scope, ty, depth)?, "%", Expr::literal(ty, "50"))),
                "double" => self.of_two_types(scope, "float", ty),
                _ => None,
            };
        }
        Some(match ty {
            "int" => match self.random.below(6) {
                0 => unary("-", self.expr(scope, "int", depth)?),
                1 => {
                    let divisor = Expr::literal("int", (1 + self.random.below(9)).to_string());
                    binary("int", self.expr(scope, "int", depth)?, self.word(&["/", "%"]), divisor)
                }
                _ => {
                    let operator = self.word(&["+", "-", "*"]);
                    binary("int", self.expr(scope, "int", depth)?, operator, self.expr(scope, "int", depth)?)
                }
            },
            "double" => {
                let (one, other) = (self.expr(scope, "double", depth)?, number(self, scope)?);
                let operator = self.word(&["+", "-", "*"]);
                if self.chance(50) {
                    binary("double", one, operator, other)
                } else {
                    binary("double", other, operator, one)
                }
            }
            "string" => {
                binary("string", self.expr(scope, "string", depth)?, "+", self.expr(scope, "string", depth)?)
            }
            _ => match self.random.below(8) {
                0 => unary("!", self.expr(scope, "bool", depth)?),
                1 | 2 => {
                    let operator = self.word(&["&&", "||"]);
                    let (left, right) = (self.expr(scope, ty, depth)?, self.expr(scope, ty, depth)?);
                    if !self.options.constant_operands && joins_constant(&right) {
                        return None;
                    }
                    binary(ty, left, operator, right)
                }
                3 | 4 => {
                    let operator = self.word(&["<", "<=", ">", ">=", "==", "!="]);
                    binary("bool", number(self, scope)?, operator, number(self, scope)?)
                }
                5 => {
                    let ty = self.word(&["bool", "string"]);
                    let operator = self.word(&["==", "!="]);
                    binary("bool", self.expr(scope, ty, depth)?, operator, self.expr(scope, ty, depth)?)
                }
                6 => {
                    let status = if self.chance(50) { self.read(scope)? } else { self.status(scope)? };
                    let literal = Expr::literal("status", self.word(&["no_data", "old_data", "new_data"]));
                    binary("bool", status, self.word(&["==", "!="]), literal)
                }
                _ => {
                    let handlers = scope.handlers.clone();
                    let (handler, operation) =
                        if handlers.is_empty() { return None } else { self.random.of(&handlers) };
                    let status = self.collect(scope, handler, operation)?;
                    let literal = Expr::literal("call", self.word(&["failure", "not_ready", "success"]));
                    binary("bool", status, self.word(&["==", "!="]), literal)
                }
            },
        })
    }

    fn status(&mut self, scope: &Scope) -> Option<Expr> {
        let inputs = scope.inputs.clone();
        let port = if inputs.is_empty() { return None } else { self.random.of(&inputs) };
        let form = Form::Call("status".to_owned(), vec![variable(&port.name, "port")]);
        Some(Expr { ty: "status".to_owned(), form })
    }

    // The deployed system.

    fn system(&mut self) -> System {
        let built = self.built.clone();
        self.taken.clear();
        let mut architectures: Vec<Architecture> = Vec::new();
        // The instances in order: a provider comes before a caller.
        let mut instances: Vec<(String, Built, bool)> = Vec::new();
        let mut written: HashSet<(String, String)> = HashSet::new();
        let parts = if self.chance(50) { 2 } else { 1 };
        for part in 0..parts {
            let mut architecture =
                Architecture { name: format!("Architecture{part}"), ..Architecture::default() };
            if part > 0 {
                architecture.imports.push("Architecture0".to_owned());
            }
            let all: Vec<Built> = if parts == 1 {
                built.clone()
            } else if part == 0 {
                built[..built.len().div_ceil(2)].to_vec()
            } else {
                built[built.len().div_ceil(2)..].to_vec()
            };
            for component in all {
                for _ in 0..if self.chance(20) { 2 } else { 1 } {
                    let name =
                        self.name(&["laser", "base", "arm", "switch", "head", "map", "goal", "instance"]);
                    architecture.instances.push((name.clone(), component.name.clone()));
                    self.connect(&mut architecture, &name, &component, &mut instances);
                    instances.push((name, component.clone(), false));
                }
            }
            // Inputs that are still open.
            for index in 0..instances.len() {
                let (name, component, _) = instances[index].clone();
                for port in component.features.ports.iter().filter(|it| it.is_input) {
                    let end = (name.clone(), port.name.clone());
                    let sources: Vec<(String, String)> = instances
                        .iter()
                        .flat_map(|(name, component, _)| {
                            let outputs = component.features.ports.iter();
                            let outputs =
                                outputs.filter(|it| !it.is_input && plain(&it.ty) == plain(&port.ty));
                            outputs.map(|it| (name.clone(), it.name.clone()))
                        })
                        .collect();
                    if !sources.is_empty() && self.chance(75) && written.insert(end.clone()) {
                        let buffer = self.chance(25).then(|| (1 + self.random.below(9)).to_string());
                        let source = self.random.of(&sources).clone();
                        architecture.connections.push(Link { source, buffer, target: end });
                    }
                }
            }
            architectures.push(architecture);
        }
        let mut deployment = Deployment {
            name: "Deployed".to_owned(),
            targets: vec![format!("Architecture{}", parts - 1)],
            ..Deployment::default()
        };
        // Values that the shells leave open, and some others.
        for (name, component, _) in &instances {
            for value in &component.features.values {
                if value.value.is_none() || self.chance(15) {
                    let setting = Setting {
                        keyword: value.keyword,
                        instance: name.clone(),
                        feature: value.name.clone(),
                        value: self.constant(&value.ty, value.bounds),
                    };
                    if self.chance(50) {
                        deployment.settings.push(setting);
                    } else {
                        architectures[parts - 1].settings.push(setting);
                    }
                }
            }
        }
        let cpus = 1 + self.random.below(3);
        deployment.activities = self.activities(&instances, cpus);
        let architectures = architectures.into_iter().map(Declaration::Architecture);
        let declarations = architectures.chain([Declaration::Deployment(deployment)]).collect();
        System { declarations, cpus }
    }

    /// Connects what an instance requires to one that provides it.
    fn connect(
        &mut self,
        architecture: &mut Architecture,
        name: &str,
        component: &Built,
        instances: &mut [(String, Built, bool)],
    ) {
        for required in &component.features.required {
            let key = |it: &Signature| {
                let of = |it: &Parameter| {
                    (it.name.clone(), plain(&it.ty).to_owned(), it.direction.trim() == "out")
                };
                (it.parameters.iter().map(of).collect::<Vec<_>>(), plain(&it.result).to_owned())
            };
            let found = instances.iter_mut().find_map(|(instance, other, serves)| {
                let provided = other.features.provided.iter().find(|it| key(it) == key(required))?;
                *serves = true;
                Some((instance.clone(), provided.name.clone()))
            });
            if let Some(source) = found {
                let target = (name.to_owned(), required.name.clone());
                architecture.operations.push(Link { source, buffer: None, target });
            }
        }
    }

    /// The shorter the deadline, the higher the priority; activities that serve others are not real-time.
    fn activities(&mut self, instances: &[(String, Built, bool)], cpus: usize) -> Vec<Activity> {
        let mut rows: Vec<(usize, usize, usize, String, bool)> = Vec::new();
        for (name, _, serves) in instances {
            let period = *self.random.of(&[50, 100, 200, 500, 1000]);
            let deadline = if self.chance(40) { period - 10 } else { period };
            let background = *serves || self.chance(10);
            rows.push((deadline, period, self.random.below(cpus), name.clone(), background));
        }
        rows.sort();
        let mut priority = 96;
        let mut activities = Vec::new();
        for (deadline, period, cpu, instance, background) in rows {
            priority -= 1 + self.random.below(3);
            let (mask, hex) = (1 << cpu, self.chance(20));
            let affinity = if hex { format!("0x{mask:x}") } else { format!("{mask}") };
            let period_text = if self.chance(20) { format!("{period}.0") } else { period.to_string() };
            let mut fields: Vec<(String, String)> = Vec::new();
            let mut field = |name: &str, value: String| fields.push((name.to_owned(), value));
            field("priority", if background { "background".to_owned() } else { priority.to_string() });
            if !background || self.chance(50) {
                field("period", period_text);
                if (deadline != period || self.chance(50)) && !background {
                    field("deadline", deadline.to_string());
                }
            }
            if cpus > 1 || self.chance(60) {
                field("affinity", affinity);
            }
            let turn = self.random.below(fields.len());
            fields.rotate_left(turn);
            activities.push(Activity { instance, fields });
        }
        let turn = self.random.below(activities.len());
        activities.rotate_left(turn);
        activities
    }

    fn tomls(&mut self, cpus: usize, codels: &[String]) -> Vec<Toml> {
        let entry = |key: &str, value: String| (key.to_owned(), value);
        let types = EXTERNAL.iter().map(|ty| {
            let of_type = vec![entry("cpp", format!("\"{ty}*\"")), entry("header", "\"robot.h\"".to_owned())];
            (format!("types.{ty}"), of_type)
        });
        let mut sections: Vec<(String, Vec<(String, String)>)> = vec![
            ("project".to_owned(), vec![entry("root", "\"robot.mal\"".to_owned())]),
            (
                "timing".to_owned(),
                vec![
                    entry("tables", "[\"timing/*.toml\"]".to_owned()),
                    entry("significance", "1e-4".to_owned()),
                ],
            ),
            (
                "platform".to_owned(),
                vec![entry("cpus", cpus.to_string()), entry("rt_throttling", "false".to_owned())],
            ),
        ];
        sections.extend(types);
        // The times of random messages are those of codels.
        let lints = vec![entry("unmeasured-access", "\"allow\"".to_owned())];
        sections.push(("lints".to_owned(), lints));
        let config = Toml { path: "/mauve.toml".to_owned(), sections };
        let mut times: Vec<(String, String)> = codels
            .iter()
            .map(|codel| {
                let time = 1 + self.random.below(8);
                let value =
                    if self.chance(50) { time.to_string() } else { format!("[{time}, {}]", time + 2) };
                (format!("\"{codel}\""), value)
            })
            .collect();
        let mut programs = BTreeMap::new();
        for component in &self.built.clone() {
            for program in &component.programs {
                if self.chance(10) {
                    let time = 1 + self.random.below(90);
                    programs.insert(format!("\"{}/{program}\"", component.name), time.to_string());
                }
            }
        }
        let unit = if self.stands_alone() { "ms" } else { "us" };
        let head = || vec![entry("unit", format!("\"{unit}\"")), entry("levels", "[1e-3, 1e-4]".to_owned())];
        let second = times.split_off(times.len() / 2);
        let mut tables = vec![Toml {
            path: "/timing/a.toml".to_owned(),
            sections: vec![(String::new(), head()), ("codel".to_owned(), times)],
        }];
        let mut rest = vec![("codel".to_owned(), second)];
        if !programs.is_empty() {
            rest.push(("program".to_owned(), programs.into_iter().collect()));
        }
        if self.chance(40) {
            rest.push(("overhead".to_owned(), vec![entry("dispatch", "2".to_owned())]));
        }
        if self.chance(50) {
            rest.insert(0, (String::new(), head()));
            tables.push(Toml { path: "/timing/b.toml".to_owned(), sections: rest });
        } else {
            let more = std::mem::take(&mut rest[0].1);
            tables[0].sections[1].1.extend(more);
            tables[0].sections.extend(rest.into_iter().skip(1));
        }
        tables.insert(0, config);
        tables
    }
}

struct System {
    declarations: Vec<Declaration>,
    cpus: usize,
}

/// The keys that the core's programs have in a timing table.
fn programs_of(core: &Core) -> Vec<String> {
    let mut keys: Vec<String> = core.operations.iter().map(|it| it.signature.name.clone()).collect();
    keys.extend(core.hooks.iter().filter(|it| it.keyword == "update").map(|_| "update".to_owned()));
    for state in core.machines.iter().flat_map(|it| &it.states) {
        let methods = state.methods.iter().chain(&state.later_methods);
        keys.extend(methods.map(|it| format!("{}.{}", state.name, it.keyword)));
        for Transition { name, guard, effect, .. } in &state.transitions {
            keys.extend(guard.iter().map(|_| format!("{}.{name}.guard", state.name)));
            keys.extend(effect.iter().map(|_| format!("{}.{name}.effect", state.name)));
        }
    }
    keys
}

fn numbered(word: &str, number: usize) -> String {
    if number == 0 { word.to_owned() } else { format!("{word}{number}") }
}

/// Returns whether the type has literals.
fn is_simple(ty: &str) -> bool {
    matches!(ty, "int" | "double" | "bool" | "string" | "float" | "uint8" | "int16")
}

/// Whether every path through the block returns.
fn returns(block: &Block) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Return(..) => true,
        Statement::Block(inner) => returns(inner),
        Statement::If(_, then, Some(otherwise)) => returns(then) && returns(otherwise),
        _ => false,
    })
}

fn operands(expr: &Expr) -> Vec<&Expr> {
    match &expr.form {
        Form::Literal(_) | Form::Name(_) => Vec::new(),
        Form::Call(_, arguments) => arguments.iter().collect(),
        Form::Unary(_, inner) | Form::Parens(inner) => vec![inner],
        Form::Binary(left, _, right) => vec![left, right],
    }
}

/// Whether the expression names and calls nothing.
fn is_constant(expr: &Expr) -> bool {
    !matches!(expr.form, Form::Name(_) | Form::Call(..)) && operands(expr).into_iter().all(is_constant)
}

/// Whether `&&` or `||` join a constant and another condition in the expression.
fn joins_constant(expr: &Expr) -> bool {
    let joins = matches!(expr.form, Form::Binary(_, "&&" | "||", _)) && !is_constant(expr);
    joins && operands(expr).into_iter().any(is_constant) || operands(expr).into_iter().any(joins_constant)
}

fn variable(name: &str, ty: &str) -> Expr {
    Expr { ty: ty.to_owned(), form: Form::Name(name.to_owned()) }
}

fn call(callee: &Signature, arguments: Vec<Expr>) -> Expr {
    Expr { ty: plain(&callee.result).to_owned(), form: Form::Call(callee.name.clone(), arguments) }
}

fn parens(inner: Expr) -> Expr {
    Expr { ty: inner.ty.clone(), form: Form::Parens(Box::new(inner)) }
}

fn unary(operator: &'static str, inner: Expr) -> Expr {
    Expr { ty: inner.ty.clone(), form: Form::Unary(operator, Box::new(inner)) }
}

fn binary(ty: &str, left: Expr, operator: &'static str, right: Expr) -> Expr {
    Expr { ty: ty.to_owned(), form: Form::Binary(Box::new(left), operator, Box::new(right)) }
}
