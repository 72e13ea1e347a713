//! Deployments of random models: their scripts, executed by Lua, do what the models say.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use expect_test::expect_file;
use mauve_hir::item_tree::BinaryOperator;
use mauve_hir::{Database, Value, Workspace, projects};
use mauve_orocos::{GeneratedPackage, packages};
use mauve_tests::deployer::{Argument, Call, run};
use mauve_tests::model::{Architecture, Declaration, Deployment, Expr, Form, Model, Shell};
use mauve_tests::{Random, models, plain, random_model, search, texts_in};

/// The packages of a model that has nothing wrong.
fn generated(folder: PathBuf, texts: Vec<(PathBuf, String)>) -> Vec<GeneratedPackage> {
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, folder, texts);
    let [project] = projects(&db, workspace).as_slice() else { panic!("several projects") };
    packages(&db, *project, None).unwrap_or_else(|problems| panic!("{problems:#?}"))
}

/// The text of a file in one of them.
fn text(packages: &[GeneratedPackage], path: &str) -> String {
    let mut files = packages.iter().flat_map(|package| &package.files);
    files.find(|file| file.path == path).expect(path).text.clone()
}

fn script(model: &Model) -> String {
    text(&generated("/".into(), model.texts()), "scripts/Deployed.lua")
}

/// The calls of a script that succeeds.
fn calls(script: &str) -> Vec<Call> {
    let (calls, error) = run(script, "");
    assert_eq!(error, None, "{script}");
    calls
}

/// What a model says of its deployment.
struct System<'a> {
    /// By their names as they are written, with the libraries that they stand in.
    shells: BTreeMap<String, &'a Shell>,
    components: BTreeMap<String, (Option<&'a str>, &'a str)>,
    architectures: BTreeMap<&'a str, &'a Architecture>,
    deployment: &'a Deployment,
}

impl<'a> System<'a> {
    fn of(model: &'a Model) -> System<'a> {
        let all = model.files.iter().flat_map(|file| &file.libraries);
        let all: Vec<_> =
            all.flat_map(|(library, all)| all.iter().map(move |it| (library.as_deref(), it))).collect();
        let found = all.iter().find_map(|(_, it)| match it {
            Declaration::Deployment(deployment) => Some(deployment),
            _ => None,
        });
        let mut system = System {
            shells: BTreeMap::new(),
            components: BTreeMap::new(),
            architectures: BTreeMap::new(),
            deployment: found.expect("a deployment"),
        };
        for (library, declaration) in all {
            let whole = |name: &str| library.map_or(name.to_owned(), |library| format!("{library}.{name}"));
            match declaration {
                Declaration::Shell(shell) => drop(system.shells.insert(whole(&shell.name), shell)),
                Declaration::Component(name, shell, _) => {
                    system.components.insert(whole(name), (library, shell));
                }
                Declaration::Architecture(it) => drop(system.architectures.insert(&it.name, it)),
                _ => {}
            }
        }
        system
    }

    /// The architecture that is deployed, and what it imports.
    fn architectures(&self) -> Vec<&'a Architecture> {
        let mut found = vec![self.architectures[plain(&self.deployment.targets[0])]];
        let mut next = 0;
        while let Some(&architecture) = found.get(next) {
            found.extend(architecture.imports.iter().map(|it| self.architectures[plain(it)]));
            next += 1;
        }
        found
    }

    /// Library and name of a component, by the name that an architecture has for it; and its shell.
    fn component(&self, name: &str) -> (String, String) {
        let (whole, (library, shell)) = resolved(&self.components, None, name);
        (whole.clone(), resolved(&self.shells, *library, shell).0.clone())
    }

    /// A shell with what it extends.
    fn shells_of(&self, shell: &str) -> Vec<&'a Shell> {
        let mut found = vec![self.shells[shell]];
        for base in &self.shells[shell].bases {
            let library = shell.split_once('.').map(|(library, _)| library);
            found.extend(self.shells_of(resolved(&self.shells, library, base).0));
        }
        found
    }

    /// What must be executed, by function, in any order.
    fn calls(&self) -> BTreeSet<String> {
        let mut calls = BTreeSet::new();
        let mut add = |function: &str, arguments: &[Argument]| {
            calls.insert(format!("{function} {arguments:?}"));
        };
        let text = |text: &str| Argument::Text(text.to_owned());
        let architectures = self.architectures();
        let instances = architectures.iter().flat_map(|it| &it.instances);
        for (name, component) in instances {
            let (component, shell) = self.component(component);
            add("load", &[text(&called(name)), text(&component.replace('.', "::"))]);
            let shells = self.shells_of(&shell);
            for port in shells.iter().flat_map(|it| &it.ports) {
                let whole = (name.clone(), port.name.clone());
                let mut connections = architectures.iter().flat_map(|it| &it.connections);
                let is_connected = connections.any(|link| link.target == whole);
                if !is_connected && !["Device", "Grid"].contains(&plain(&port.ty)) {
                    add("stream", &[text(&end(&whole)), text(&format!("{name}/{}", port.name))]);
                }
            }
            for (feature, ty, value) in self.values(name, &shells) {
                // Scripts know no other whole numbers than two.
                match &value {
                    Value::Int(number) if !["int", "uint32"].contains(&ty.as_str()) => {
                        add(
                            "mauve_set",
                            &[text(&called(name)), text(&called(&feature)), text(&number.to_string())],
                        );
                    }
                    _ => add("set", &[text(&called(name)), text(&called(&feature)), argument(value)]),
                }
            }
            add("configure", &[text(&called(name))]);
            add("start", &[text(&called(name))]);
        }
        for link in architectures.iter().flat_map(|it| &it.connections) {
            let size = link.buffer.as_ref().map_or(0.0, |size| size.parse().unwrap());
            let ty = if size == 0.0 { "DATA" } else { "CIRCULAR_BUFFER" };
            add(
                "connect",
                &[text(&end(&link.source)), text(&end(&link.target)), text(ty), Argument::Number(size)],
            );
            if let Some((instance, port)) = end(&link.target).split_once('.').filter(|_| size > 0.0) {
                add("mauve_has_buffer", &[text(instance), text(port)]);
            }
        }
        for link in architectures.iter().flat_map(|it| &it.operations) {
            add("connectOperations", &[text(&end(&link.target)), text(&end(&link.source))]);
        }
        for activity in &self.deployment.activities {
            let field = |name: &str| Some(activity.fields.iter().find(|(it, _)| it == name)?.1.as_str());
            let seconds = field("period").map_or(0.01, |period| period.parse::<f64>().unwrap() / 1000.0);
            let (priority, scheduler) = match field("priority").unwrap() {
                "background" => (0, "ORO_SCHED_OTHER"),
                priority => (priority.parse().unwrap(), "ORO_SCHED_RT"),
            };
            let name = text(&called(&activity.instance));
            add(
                "setActivity",
                &[
                    name.clone(),
                    Argument::Number(seconds),
                    Argument::Number(priority.into()),
                    text(scheduler),
                ],
            );
            if priority == 0 {
                add("setWaitPeriodPolicy", &[name.clone(), text("ORO_WAIT_REL")]);
            }
            let mask_of = |text: &str| match text.strip_prefix("0x") {
                Some(digits) => i32::from_str_radix(digits, 16).unwrap(),
                None => text.parse().unwrap(),
            };
            let all = self.deployment.activities.iter().flat_map(|it| &it.fields);
            let named = all.filter(|(name, _)| name == "affinity").fold(0, |all, (_, it)| all | mask_of(it));
            // In real time each is where it was analysed: on the CPUs that others name, or on the first one.
            let mask = match field("affinity").map(mask_of) {
                Some(mask) => mask,
                None if priority == 0 => 0,
                None => named.max(1),
            };
            if mask != 0 {
                add("setCpuAffinity", &[name.clone(), Argument::Number(mask.into())]);
            }
            add("mauve_runs_as", &[name, Argument::Number(priority.into()), Argument::Number(mask.into())]);
        }
        calls
    }

    /// The values that are not those of the class: what is set, and what rests on that.
    fn values(&self, instance: &str, shells: &[&'a Shell]) -> Vec<(String, String, Value)> {
        let mut set: BTreeMap<&str, &Expr> = BTreeMap::new();
        let architectures = self.architectures();
        let settings =
            architectures.iter().rev().flat_map(|it| &it.settings).chain(&self.deployment.settings);
        for setting in settings.filter(|it| it.instance == instance) {
            set.insert(&setting.feature, &setting.value);
        }
        let values: Vec<_> = shells.iter().flat_map(|it| &it.values).collect();
        let by_name = |name: &str| values.iter().find(|it| it.name == name).and_then(|it| it.value.as_ref());
        let mut found = Vec::new();
        for value in &values {
            // Random values name a constant alone, or none.
            let mut expr = value.value.as_ref();
            let mut is_set = false;
            let mut name = value.name.as_str();
            loop {
                if let Some(own) = set.get(name) {
                    (expr, is_set) = (Some(*own), true);
                    break;
                }
                match expr.map(|it| &it.form) {
                    Some(Form::Name(other)) => (name, expr) = (other, by_name(other)),
                    _ => break,
                }
            }
            if let Some(known) = expr.filter(|_| is_set).and_then(literal) {
                found.push((
                    value.name.clone(),
                    plain(&value.ty).to_owned(),
                    as_kept(known, plain(&value.ty)),
                ));
            }
        }
        found
    }
}

/// What a name means in a library: what is there, or what only one other has.
fn resolved<'s, T>(all: &'s BTreeMap<String, T>, library: Option<&str>, name: &str) -> (&'s String, &'s T) {
    let name = name.replace("::", ".");
    let own = library.map(|library| format!("{library}.{name}"));
    let found = own.and_then(|own| all.get_key_value(&own)).or_else(|| all.get_key_value(&name));
    found.or_else(|| all.iter().find(|(whole, _)| plain(whole) == name)).expect(&name)
}

/// As it is called in a script: the words that models of the generator use and scripts have a use of their own for.
fn called(name: &str) -> String {
    let words = ["to", "entry", "start", "initial", "state"];
    if words.contains(&name) { format!("{name}_") } else { name.to_owned() }
}

fn end((instance, feature): &(String, String)) -> String {
    format!("{}.{}", called(instance), called(feature))
}

/// A value as Lua passes it on.
fn argument(value: Value) -> Argument {
    match value {
        Value::Bool(value) => Argument::Bool(value),
        Value::Int(value) => Argument::Number(value.into()),
        Value::Double(value) => Argument::Number(value),
        Value::String(text) => Argument::Text(text),
    }
}

fn as_kept(value: Value, ty: &str) -> Value {
    match (value, ty) {
        (Value::Int(value), "double" | "float") => Value::Double(value.into()),
        (value, _) => value,
    }
}

/// The value of an expression; none where the model does not work it out.
fn literal(expr: &Expr) -> Option<Value> {
    use Value::{Bool, Double, Int, String as Text};
    Some(match &expr.form {
        Form::Literal(text) if text.starts_with('"') => {
            let inner = &text[1..text.len() - 1];
            let mut found = String::new();
            let mut letters = inner.chars();
            while let Some(letter) = letters.next() {
                found.push(match letter {
                    '\\' => match letters.next() {
                        Some('n') => '\n',
                        Some('t') => '\t',
                        other => other?,
                    },
                    letter => letter,
                });
            }
            Text(found)
        }
        Form::Literal(text) if text == "true" || text == "false" => Bool(text == "true"),
        Form::Literal(text) => match text.strip_prefix("0x") {
            Some(digits) => Int(i32::from_str_radix(digits, 16).unwrap()),
            None => text.parse().map(Int).unwrap_or_else(|_| Double(text.parse().unwrap())),
        },
        Form::Parens(inner) => literal(inner)?,
        Form::Unary(operator, inner) => match (*operator, literal(inner)?) {
            ("-", Int(value)) => Int(-value),
            ("-", Double(value)) => Double(-value),
            ("!", Bool(value)) => Bool(!value),
            _ => panic!("{expr}"),
        },
        Form::Binary(left, operator, right) => match (literal(left)?, *operator, literal(right)?) {
            (Int(left), "+", Int(right)) => Int(left + right),
            (Int(left), "*", Int(right)) => Int(left * right),
            (Int(left), "<", Int(right)) => Bool(left < right),
            (Double(left), "+", Double(right)) => Double(left + right),
            (Double(left), "/", Int(right)) => Double(left / f64::from(right)),
            (Text(left), "+", Text(right)) => {
                let joins =
                    Value::String(String::new()).binary(BinaryOperator::Add, &Value::String(String::new()));
                joins.unwrap()?;
                Text(left + &right)
            }
            _ => panic!("{expr}"),
        },
        Form::Name(_) | Form::Call(..) => panic!("{expr}"),
    })
}

fn shown(call: &Call) -> String {
    format!("{} {:?}", call.function, call.arguments)
}

/// What is generated from the model in `tests/arm` stands beside it, and what is from the sample robot in `tests/p3dx`.
#[test]
fn scripts_as_people_read_them() {
    let arm = generated(folder("arm"), texts_in(&folder("arm")));
    for path in ["scripts/D.lua", "launch/D.launch"] {
        expect_file![format!("arm/{path}")].assert_eq(&text(&arm, path));
    }
    let p3dx = generated(models().join("p3dx"), texts_in(&models().join("p3dx")));
    for path in ["scripts/P3dxDeployment.lua", "launch/P3dxDeployment.launch"] {
        expect_file![format!("p3dx/{path}")].assert_eq(&text(&p3dx, path));
    }
}

#[test]
fn orocos_without_ros_nothing_of_it_is_there() {
    let with_streams = texts_in(&folder("arm"));
    let mut without = with_streams.clone();
    let config = without.iter_mut().find(|(path, _)| path.ends_with("mauve.toml")).unwrap();
    config.1 += "[generate]\nros_streams = false\n";
    let script = text(&generated(folder("arm"), without), "scripts/D.lua");
    assert!(!script.contains("ros"), "{script}");
    let script_with = text(&generated(folder("arm"), with_streams), "scripts/D.lua");
    let others = calls(&script_with).into_iter();
    let others = others.filter(|call| call.function != "stream" && !call.text(0).starts_with("rtt_"));
    assert_eq!(calls(&script), others.collect::<Vec<_>>());
}

#[test]
fn a_library_without_deployments_has_no_scripts() {
    let packages = generated("/".into(), vec![("/a.mal".into(), "library a { codel f(): int }".to_owned())]);
    assert_eq!(packages.len(), 1);
    assert!(!packages[0].files.iter().any(|file| file.path.starts_with("scripts/")));
}

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name)
}

/// The number of random models in a full search.
const MODELS: u64 = 300;

#[test]
fn orocos_scripts_do_what_their_models_say() {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for seed in search::seeds("MAUVE_MODELS", MODELS) {
        let model = random_model(seed);
        let script = script(&model);
        let calls = calls(&script);
        for call in &calls {
            *seen.entry(call.function.clone()).or_default() += 1;
        }
        let is_plain = |call: &&Call| {
            let shows = call.function == "stream"
                && [".state", ".period"].iter().any(|it| call.text(0).ends_with(it));
            !["import", "loadService"].contains(&call.function.as_str()) && !shows
        };
        let executed: BTreeSet<String> = calls.iter().filter(is_plain).map(shown).collect();
        assert_eq!(
            executed.len(),
            calls.iter().filter(is_plain).count(),
            "seed {seed}: something is done twice\n{script}"
        );
        let expected = System::of(&model).calls();
        let missing: Vec<_> = expected.difference(&executed).collect();
        let more: Vec<_> = executed.difference(&expected).collect();
        assert!(missing.is_empty() && more.is_empty(), "seed {seed}: {missing:#?} {more:#?}\n{script}");
    }
    // Nothing of it is rare.
    let rare: Vec<_> = seen.iter().filter(|(_, count)| (**count as u64) < search::share(40)).collect();
    assert!(rare.is_empty() && seen.len() == 15, "{seen:?}");
}

#[test]
fn orocos_a_script_ends_where_something_fails() {
    let mut random = Random(7);
    for seed in search::seeds("MAUVE_MODELS", MODELS / 3) {
        let script = script(&random_model(seed));
        let calls = calls(&script);
        let failing = random.of(&calls).key();
        let (executed, error) = run(&script, &failing);
        let error =
            error.unwrap_or_else(|| panic!("seed {seed}: no message says that {failing} failed\n{script}"));
        assert!(error.contains("Cannot ") && error.contains("Nothing runs."), "seed {seed}: {error}");
        let end = calls.iter().position(|call| call.key() == failing).unwrap();
        let (before, after) = executed.split_at(end + 1);
        assert_eq!(before, &calls[..=end], "seed {seed}: {failing}");
        // If a component does not start, the script stops those that it has started.
        let started = calls[..end].iter().rev().filter(|call| call.function == "start");
        let stopped: Vec<String> = started.map(|call| format!("stop {}", call.text(0))).collect();
        assert_eq!(after.iter().map(Call::key).collect::<Vec<_>>(), stopped, "seed {seed}: {failing}");
    }
}

#[test]
fn orocos_who_provides_is_configured_and_started_first() {
    let mut links = 0;
    for seed in search::seeds("MAUVE_MODELS", MODELS) {
        let mut model = random_model(seed);
        // There they stand in that order already.
        for (_, declarations) in model.files.iter_mut().flat_map(|file| &mut file.libraries) {
            for declaration in declarations {
                if let Declaration::Architecture(architecture) = declaration {
                    architecture.instances.reverse();
                }
            }
        }
        let calls = calls(&script(&model));
        let place = |function: &str, task: &str| {
            let found = calls.iter().position(|call| call.function == function && call.text(0) == task);
            found.expect(task)
        };
        for call in calls.iter().filter(|call| call.function == "connectOperations") {
            let [required, provided] = [0, 1].map(|it| call.text(it).split_once('.').unwrap().0);
            for function in ["configure", "start"] {
                assert!(
                    required == provided || place(function, provided) < place(function, required),
                    "seed {seed}"
                );
            }
            links += 1;
        }
        assert!(
            calls.iter().rposition(|it| it.function == "configure")
                < calls.iter().position(|it| it.function == "start")
        );
    }
    assert!(links > search::share(40), "{links}");
}

#[test]
fn a_thread_has_cpus_1_to_32() {
    let robot = |affinity: &str| {
        let db = Database::default();
        let model = format!(
            "codel f(): void\nshell S {{ }}\ncore K(S) {{ update = {{ f(); }} }}\ncomponent C(S, K)\n\
             architecture A {{ instance c: C }}\n\
             deployment D {{ architecture A  activity c {{ affinity = {affinity} priority = 1 period = 10 }} }}\n"
        );
        let workspace = Workspace::of_texts(&db, "/".into(), [("/robot.mal".into(), model)]);
        let made = packages(&db, projects(&db, workspace)[0], None);
        made.map_err(|problems| problems[0].kind.clone()).map(|packages| {
            let script = text(&packages, "scripts/D.lua");
            let lines = script.lines().filter(|line| line.contains("set the CPU affinity"));
            lines.map(str::to_owned).collect::<Vec<_>>()
        })
    };
    let set = |cpus: &str| {
        let what = "\"set the CPU affinity of c: do these CPUs exist?\")";
        Ok(vec![format!("worked(task(\"c\"):setCpuAffinity({cpus}), {what}")])
    };
    assert_eq!(robot("2"), set("2"));
    assert_eq!(robot("0x80000000"), set("2147483648"));
    // Orocos has no bits for these.
    assert_eq!(
        robot("0x300000000"),
        Ok(vec![
            "worked(task(\"c\"):mauve_runs_on(\"32, 33\"), \"set the CPU affinity of c: do these CPUs exist?\")"
                .to_owned()
        ])
    );
}
