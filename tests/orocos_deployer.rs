//! Runs a deployment in the deployer of a real Orocos: the output of its components is that of the model. Then with faults: no
//! component starts, and the log has the reason.
//!
//! What all generated components have in common is looked at with the runtime for Linux, too. Orocos is in no package registry:
//! the others run where `MAUVE_RTT_PREFIX` names a folder with RTT and OCL, and `tests/run` says
//! in its last lines whether they did. What can be tested without is in `deployment_scripts.rs`. They need two CPUs, and root, who
//! may run threads in real time.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::{FileOwner, packages};
use mauve_tests::orocos::{COMPILERS, build, component_library, configure, is_real, rtt, run};
use mauve_tests::{scratch, texts_in, write};

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/orocos/yard")
}

/// Generates the packages, and gives the folder.
fn generate(name: &str) -> PathBuf {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &format!("deployer_{name}"));
    let db = Database::default();
    let texts = texts_in(&source()).into_iter();
    let texts = texts.map(|(path, text)| (Path::new("/").join(path.file_name().unwrap()), text));
    let workspace = Workspace::of_texts(&db, "/".into(), texts);
    let codels = std::fs::read_to_string(source().join("codels.cpp")).unwrap();
    for package in packages(&db, projects(&db, workspace)[0], None).expect("a model without mistakes") {
        let mut codels = Some(codels.clone());
        let files = package.files.iter().map(|file| {
            let text = match file.owner {
                FileOwner::Generator => file.text.clone(),
                // All stubs are in the first one.
                FileOwner::User { .. } => codels.take().unwrap_or_default(),
            };
            (format!("{}/{}", package.name, file.path), text)
        });
        write(&folder, &files.collect::<Vec<_>>());
    }
    folder
}

/// Builds and installs the packages with a compiler, once.
fn installed(compiler: &str) -> PathBuf {
    let folder = generate(compiler);
    let prefix = folder.join("prefix");
    for package in ["yard", "deploy"] {
        let built = folder.join("build").join(package);
        let mut configuration = configure(&folder.join(package), &built, compiler, &[&prefix]);
        configuration.args([
            format!("-DCMAKE_INSTALL_PREFIX={}", prefix.display()),
            "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror".to_owned(),
            "-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON".to_owned(),
        ]);
        run(&mut configuration);
        run(build(&built).args(["--target", "install"]));
    }
    folder
}

/// The folder of the packages as gcc builds them.
fn gcc() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| installed(COMPILERS[0]))
}

/// The result of a deployer.
struct Run {
    /// The output of components, by component.
    said: BTreeMap<String, Vec<String>>,
    /// All of it, with the log.
    log: String,
    code: Option<i32>,
}

impl Run {
    fn count(&self, who: &str) -> usize {
        self.said.get(who).map_or(0, Vec::len)
    }
}

/// How the deployer is started.
struct Deployer<'a> {
    folder: &'a Path,
    program: &'a str,
    environment: &'a [(&'a str, &'a str)],
    /// Before the deployer, such as what takes its rights.
    wrapper: &'a [&'a str],
    /// Where it runs.
    directory: PathBuf,
}

impl<'a> Deployer<'a> {
    fn new(folder: &'a Path) -> Deployer<'a> {
        let directory = folder.join("prefix");
        Deployer { folder, program: DEPLOYER, environment: &[], wrapper: &[], directory }
    }

    /// Runs it until `done`, or for some seconds; then it is interrupted, as a person would.
    fn run(&self, done: &dyn Fn(&str) -> bool) -> Run {
        let output = self.folder.join("output");
        let file = std::fs::File::create(&output).unwrap();
        let is_deployer = self.program == DEPLOYER;
        let mut words: Vec<String> = self.wrapper.iter().map(|&it| it.to_owned()).collect();
        words.push(rtt().join("bin").join(self.program).display().to_string());
        let options: &[&str] = if is_deployer { &["-l", "warning", "-s"] } else { &["-i"] };
        words.extend(options.iter().map(|&it| it.to_owned()));
        words.push(script(self.folder).display().to_string());
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).current_dir(&self.directory);
        command.stdin(Stdio::piped()).stdout(file.try_clone().unwrap()).stderr(file);
        let path = format!(
            "{}:{}",
            self.folder.join("prefix/lib/orocos").display(),
            rtt().join("lib/orocos").display()
        );
        command.env("RTT_COMPONENT_PATH", path).env("OROCOS_TARGET", "gnulinux");
        command.env("LUA_PATH", format!("{};;", rtt().join("share/lua/5.1/?.lua").display()));
        for name in ["MAUVE_START", "MAUVE_VALUES", "MAUVE_ALLOW_NON_REALTIME", "LD_LIBRARY_PATH"] {
            command.env_remove(name);
        }
        let mut deployer = command.envs(self.environment.iter().copied()).spawn().unwrap();
        let said = || std::fs::read_to_string(&output).unwrap_or_default();
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(20)
            && !done(&said())
            && deployer.try_wait().unwrap().is_none()
        {
            // The deployer is another process: only its output tells its state.
            std::thread::sleep(Duration::from_millis(50));
        }
        // A signal ends a deployer in order only when its scripts have ended.
        std::thread::sleep(Duration::from_millis(500));
        // Lua's prompt ends with its input.
        drop(deployer.stdin.take());
        if is_deployer && deployer.try_wait().unwrap().is_none() {
            run(Command::new("kill").args(["-INT", &deployer.id().to_string()]));
        }
        let begin = Instant::now();
        let code = loop {
            if let Some(status) = deployer.try_wait().unwrap() {
                break status.code();
            }
            assert!(begin.elapsed() < Duration::from_secs(20), "it does not end\n{}", said());
            // The standard library waits for a process without a limit, or not at all.
            std::thread::sleep(Duration::from_millis(20));
        };
        let log = said();
        let mut by_name: BTreeMap<String, Vec<String>> = BTreeMap::new();
        // Some lines begin with the prompt of Lua.
        let lines = log.lines().map(|line| line.trim_start_matches("> "));
        for line in lines.filter_map(|line| line.strip_prefix("@ ")) {
            let (who, what) = line.split_once(' ').unwrap();
            by_name.entry(who.to_owned()).or_default().push(what.to_owned());
        }
        Run { said: by_name, log, code }
    }
}

/// The programs of OCL that execute a script.
const DEPLOYER: &str = "deployer-gnulinux";
const LUA: &str = "rttlua-gnulinux";

/// The script of the deployment in a folder.
fn script(folder: &Path) -> PathBuf {
    folder.join("prefix/share/deploy/scripts/Real.lua")
}

/// Returns whether a component has written a number of lines.
fn many(who: &'static str, count: usize) -> impl Fn(&str) -> bool {
    move |log| log.lines().filter(|line| line.starts_with(&format!("@ {who} "))).count() >= count
}

/// Returns the expected output of a component, as long as the observed one. It interprets only these few lines of the
/// model.
fn expected(who: &str, count: usize) -> Vec<String> {
    let label = "a \"b\" \\ c";
    match who {
        "giver" => {
            let mut lines = vec!["configure 4".to_owned(), "start 4".to_owned()];
            lines.extend((1..).map(|n| format!("tick {n}")).take(count - 4));
            lines.extend(["stop 4", "cleanup 4"].map(str::to_owned));
            lines
        }
        "add" => (1..=count).map(|n| format!("{label} {n}")).collect(),
        "done" => (1..=5).map(|n| format!("none {n}")).collect(),
        // After each answer it is in its first state again.
        "taker" => {
            let turns = (0..).flat_map(|n| [format!("got {n}"), format!("asks {n}")]);
            turns.skip(1).take(count).collect()
        }
        "read" => {
            let line = "a line that is longer than what a short text has room for";
            (1..=count).map(|n| format!("{line} {n}")).collect()
        }
        "watcher" => (1..=5).map(|n| format!("runs {n}")).collect(),
        "scalars" => {
            vec!["65 -300 -2147483647 -128 2147483647 200 65535 7 2147483647 9 0.5 -2.25 1 größer".to_owned()]
        }
        _ => panic!("{who} says something"),
    }
}

fn assert_as_the_model(run: &Run) {
    for (who, lines) in &run.said {
        assert_eq!(*lines, expected(who, lines.len()), "{who}\n{}", run.log);
    }
    let who: Vec<&str> = run.said.keys().map(String::as_str).collect();
    assert_eq!(who, ["add", "done", "giver", "read", "scalars", "taker", "watcher"], "{}", run.log);
}

#[test]
fn orocos_deployer_runs_what_the_model_says() {
    if !is_real() {
        return;
    }
    for compiler in COMPILERS {
        let folder = if compiler == COMPILERS[0] { gcc().to_owned() } else { installed(compiler) };
        for program in [DEPLOYER, LUA] {
            let run = Deployer { program, ..Deployer::new(&folder) }.run(&many("giver", 100));
            assert_as_the_model(&run);
            assert!(run.count("giver") >= 100 && run.count("taker") > 10, "{}", run.log);
            assert_eq!(run.code, Some(0), "{}", run.log);
            assert!(!run.log.to_lowercase().contains("error"), "{}", run.log);
            println!(
                "{compiler}, {program}: {} lines as the model says",
                run.said.values().flatten().count()
            );
        }
    }
}

/// Nothing has started; the log says all of `says`; the deployer says so by its exit code.
fn assert_refused(run: &Run, says: &[&str]) {
    for says in says {
        assert!(run.log.contains(says), "nobody says {says}:\n{}", run.log);
    }
    let started = run.said.get("giver").into_iter().flatten().any(|line| line.starts_with("start"));
    assert!(!started && run.count("taker") == 0 && run.count("watcher") == 0, "{}", run.log);
    assert_eq!(run.code, Some(255), "{}", run.log);
}

#[test]
fn orocos_deployer_starts_nothing_that_is_not_as_analysed() {
    if !is_real() {
        return;
    }
    let over = |log: &str| log.contains("Nothing runs.");
    let deployer = Deployer::new(gcc());
    let says = ["giver is not scheduled as analysed: ", "SCHED_FIFO", "Nothing runs."];

    // Without rights.
    let without_rights =
        ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "--bounding-set", "-sys_nice"];
    let without = Deployer { wrapper: &without_rights, ..Deployer::new(gcc()) };
    assert_refused(&without.run(&over), &says);

    // Unless that is allowed: then it is said again when they run.
    let allowed = [("MAUVE_ALLOW_NON_REALTIME", "true")];
    let run = Deployer { environment: &allowed, ..without }.run(&many("giver", 50));
    assert_as_the_model(&run);
    let warnings = run.log.matches("giver is not scheduled as analysed").count();
    assert!(warnings >= 2 && run.log.contains("The response times do not hold"), "{}", run.log);

    // A CPU that is not there, and a priority that RTT lowers.
    let path = script(gcc());
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, says) in [
        (
            "setCpuAffinity(1)",
            "setCpuAffinity(1073741824)",
            "Cannot set the CPU affinity of giver: do these CPUs exist?",
        ),
        (" 20, ", " 120, ", "giver is not scheduled as analysed: its priority is 99 instead of 120"),
        ("(20, ", "(120, ", "giver is not scheduled as analysed: its priority is 20 instead of 120"),
    ] {
        let mut changed = text.replace(from, to);
        if to == " 120, " {
            changed = changed.replace("(20, ", "(120, ");
        }
        assert_ne!(changed, text, "no {from}");
        std::fs::write(&path, changed).unwrap();
        let run = deployer.run(&over);
        std::fs::write(&path, &text).unwrap();
        assert_refused(&run, &[says]);
    }
}

#[test]
fn orocos_deployer_says_what_is_missing() {
    if !is_real() {
        return;
    }
    let over = |log: &str| log.contains("Nothing runs.") && log.contains("rror");
    let deployer = Deployer::new(gcc());
    // A package that is not there, an operation that is not there, what refuses to be configured or to start.
    let library = gcc().join("prefix/lib/orocos/gnulinux/yard");
    let away = gcc().join("prefix/yard-away");
    std::fs::rename(&library, &away).unwrap();
    let run = deployer.run(&over);
    std::fs::rename(&away, &library).unwrap();
    assert_refused(&run, &["Cannot import package yard: build it, and source its workspace"]);

    let path = script(gcc());
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, says) in [
        ("\"giver.add\"", "\"giver.ad\"", "Cannot connect mal_true_taker.add and giver.add"),
        ("\"giver.class\"", "\"giver.klass\"", "Cannot connect giver.class and "),
        ("yard::Giver", "yard::Givers", "Cannot load giver, a yard::Givers: rebuild its package"),
    ] {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "no {from}");
        std::fs::write(&path, changed).unwrap();
        let run = deployer.run(&over);
        std::fs::write(&path, &text).unwrap();
        assert_refused(&run, &[says, "Nothing runs."]);
    }
    for (refuses, says) in [("configure", "Cannot configure giver"), ("start", "Cannot start giver")] {
        let environment = [("YARD_REFUSES", refuses)];
        let run = Deployer { environment: &environment, ..Deployer::new(gcc()) }.run(&over);
        assert!(run.log.contains(says) && run.log.contains("Nothing runs."), "{}", run.log);
        assert_eq!((run.code, run.count("taker")), (Some(255), 0), "{}", run.log);
        // Components that have started are stopped again.
        assert!(run.count("watcher") < 5, "{}", run.log);
        assert!(!run.said["giver"].iter().any(|line| line.starts_with("tick")), "{}", run.log);
    }
    // Beside the folder of the package, which RTT takes for what is installed of it.
    let beside = Deployer { directory: gcc().to_owned(), ..Deployer::new(gcc()) };
    let run = beside.run(&many("giver", 50));
    assert_as_the_model(&run);
    assert_eq!(run.code, Some(0), "{}", run.log);
    // It can be configured only.
    let environment = [("MAUVE_START", "false")];
    let only = Deployer { environment: &environment, ..Deployer::new(gcc()) };
    let begin = Instant::now();
    let run = only.run(&|_| begin.elapsed() > Duration::from_secs(3));
    assert_eq!((run.code, run.said["giver"][0].as_str()), (Some(0), "configure 4"), "{}", run.log);
    assert!(!run.said["giver"].iter().any(|line| line.starts_with("start")), "{}", run.log);
}

#[test]
fn orocos_deployer_survives_a_codel_that_throws() {
    if !is_real() {
        return;
    }
    // In an operation: who called it gets `failure` and goes on, its owner is in its exception state.
    let environment = [("YARD_THROWS", "operation")];
    let deployer = Deployer { environment: &environment, ..Deployer::new(gcc()) };
    let run = deployer.run(&|log| log.matches("@ taker failure").count() > 20);
    assert!(run.log.contains("on purpose"), "{}", run.log);
    assert_eq!(run.said["add"], ["a \"b\" \\ c 1", "a \"b\" \\ c 2"], "{}", run.log);
    let failures = run.said["taker"].iter().filter(|line| line.starts_with("failure -1")).count();
    assert!(failures > 20, "{}", run.log);
    assert!(run.said["giver"].contains(&"stop 4".to_owned()), "{}", run.log);
    assert_eq!(run.code, Some(0), "{}", run.log);

    // In a period: the same for its owner.
    let environment = [("YARD_THROWS", "update")];
    let deployer = Deployer { environment: &environment, ..Deployer::new(gcc()) };
    let run = deployer.run(&|log| log.matches("@ taker failure").count() > 20);
    assert_eq!(
        run.said["giver"],
        ["configure 4", "start 4", "tick 1", "tick 2", "stop 4", "cleanup 4"],
        "{}",
        run.log
    );
    assert_eq!(run.code, Some(0), "{}", run.log);
}

/// Checks threads, permitted callers, values that scripts cannot set, and displayed values.
#[test]
fn orocos_components_have_the_same_in_common() {
    for compiler in COMPILERS {
        let folder = generate(&format!("task_{compiler}"));
        let built = folder.join("build");
        let mut configuration = configure(&source(), &built, compiler, &[]);
        configuration.args([
            format!("-DPACKAGE={}", folder.join("yard").display()),
            "-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON".to_owned(),
            "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror".to_owned(),
        ]);
        run(&mut configuration);
        run(&mut build(&built));
        let said = run(Command::new(built.join("task")).arg(component_library(&built, "yard-components")));
        let held = said.lines().find_map(|line| line.strip_prefix("= ")).unwrap();
        let (held, all) = held.strip_suffix(" checks hold").unwrap().split_once(" of ").unwrap();
        assert!(held == all && all.parse::<usize>().unwrap() > 25, "{said}");
    }
}
