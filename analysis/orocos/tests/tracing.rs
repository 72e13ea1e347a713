//! Traced code, recorded by LTTng: what the spans of a package's header say, and what is left of them without tracing.

#![cfg(target_os = "linux")]

use std::collections::BTreeSet;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use expect_test::expect;
use mauve_hir::{Database, Workspace, projects};
use mauve_orocos::packages;
use mauve_tests::{Event, Recorder, Span, spans};

/// One is called as a parameter of a macro is.
const PACKAGES: [&str; 2] = ["motion", "program"];

const WARNINGS: [&str; 4] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// The tracing of two packages, and a component of each that somebody wrote by hand.
fn generate(folder: &Path) {
    let library = |name: &str| {
        format!(
            "library {name} {{ shell S {{ }} core C(S) {{ update = {{ }} }} component Guidance(S, C) }}\n"
        )
    };
    let model = PACKAGES.map(library).concat();
    let db = Database::default();
    let workspace = Workspace::of_texts(&db, "/".into(), [(PathBuf::from("/robot.mal"), model)]);
    let packages = packages(&db, projects(&db, workspace)[0], None).expect("a model without mistakes");
    for package in packages {
        let is_tracing = |path: &str| {
            path.ends_with("-trace.hpp") || path.ends_with("-lock.hpp") || path.starts_with("tracing/")
        };
        let files = package.files.into_iter().filter(|file| is_tracing(&file.path));
        let files: Vec<(String, String)> = files.map(|file| (file.path, file.text)).collect();
        assert_eq!(files.len(), 4, "{files:?}");
        mauve_tests::write(&folder.join(package.name), &files);
    }
}

fn compile(compiler: &str, folder: &Path, arguments: &[&str]) {
    let run = Command::new(compiler).args(WARNINGS).args(arguments).current_dir(folder).output();
    let run = run.unwrap_or_else(|error| panic!("{compiler} does not run: {error}"));
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && said.is_empty(), "{compiler} {arguments:?}: {said}");
}

fn source(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tracing").join(name).display().to_string()
}

/// An object of the component, at -O0.
fn component(compiler: &str, folder: &Path, package: &str, options: &[&str]) -> String {
    let object = format!("{package}.o");
    let header = format!("-DTRACE_HEADER=<{package}/{package}-trace.hpp>");
    let lock = format!("-DLOCK_HEADER=<{package}/{package}-lock.hpp>");
    let namespace = format!("-DLOCK_NAMESPACE={package}");
    let (include, source) = (format!("-I{package}/include"), source("component.cpp"));
    let mut arguments = vec!["-std=c++14", "-O0", "-fPIC", "-c", &header, &include, &source, "-o", &object];
    if options.contains(&"-DMAUVE_TRACING") {
        arguments.extend([lock.as_str(), &namespace]);
    }
    arguments.extend(options);
    compile(compiler, folder, &arguments);
    object
}

/// Builds both packages and the program that loads them, which then runs.
fn deployer(recorder: &Recorder, c: &str, cpp: &str, taskset: Option<&str>) -> Deployer {
    let folder = recorder.folder();
    generate(folder);
    for package in PACKAGES {
        let object = component(cpp, folder, package, &["-DMAUVE_TRACING"]);
        let provider = format!("{package}/tracing/{package}-tp.c");
        let include = format!("-I{package}/tracing");
        // LTTng's macros, which are expanded here, are no ISO C.
        compile(c, folder, &["-Wno-pedantic", "-O2", "-fPIC", "-c", &include, &provider, "-o", "tp.o"]);
        let library = format!("lib{package}.so");
        compile(
            cpp,
            folder,
            &["-shared", "-Wl,-z,defs", &object, "tp.o", "-o", &library, "-llttng-ust", "-ldl"],
        );
    }
    let main = source("deployer.cpp");
    compile(cpp, folder, &["-std=c++14", "-rdynamic", &main, "-o", "deployer", "-ldl", "-pthread"]);
    let program = folder.join("deployer");
    let mut command = match taskset {
        Some(cpu) => {
            let mut command = recorder.command("taskset");
            command.args(["-c", cpu]).arg(program);
            command
        }
        None => recorder.command(program),
    };
    command.args(PACKAGES.map(|package| format!("./lib{package}.so")));
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the deployer runs");
    let out = BufReader::new(child.stdout.take().expect("its output"));
    let mut deployer = Deployer { child, out, clock_reads: 0, new_clock_reads: 0 };
    deployer.answer();
    deployer
}

struct Deployer {
    child: Child,
    out: BufReader<std::process::ChildStdout>,
    clock_reads: u64,
    /// Since the answer before.
    new_clock_reads: u64,
}

impl Drop for Deployer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Deployer {
    fn tell(&mut self, line: &str) -> u64 {
        writeln!(self.child.stdin.as_ref().expect("its input"), "{line}").expect("it reads");
        self.answer()
    }

    fn answer(&mut self) -> u64 {
        let mut line = String::new();
        self.out.read_line(&mut line).expect("it answers");
        let mut numbers = line.split_whitespace();
        let mut number = || numbers.next().and_then(|it| it.parse::<u64>().ok());
        let value = number().unwrap_or_else(|| panic!("the deployer says {line:?}"));
        let reads = number().expect("a count");
        self.new_clock_reads = reads - self.clock_reads;
        self.clock_reads = reads;
        value
    }
}

/// A line for each span of a package: its name, indented as far as it is nested.
fn outline(all: &[Span], package: &str) -> String {
    let mut out = String::new();
    for span in all.iter().filter(|span| span.begin.provider == format!("mauve_{package}")) {
        let values = ["component", "codel", "state", "transition", "program"];
        let values: Vec<&str> =
            values.iter().filter_map(|name| span.begin.fields.get(*name)).map(String::as_str).collect();
        let line = format!("{}{} {}", "  ".repeat(span.depth), span.begin.name, values.join("/"));
        out += line.trim_end();
        out.push('\n');
    }
    out
}

#[test]
fn orocos_spans_are_brackets_with_the_cpu_time_of_their_threads() {
    for (c, cpp) in [("gcc", "g++"), ("clang", "clang++")] {
        let mut recorder = Recorder::start();
        let mut deployer = deployer(&recorder, c, cpp, None);
        recorder.record();
        deployer.tell("update 2");
        let all = spans(&recorder.stop()).unwrap_or_else(|error| panic!("{error}"));
        let expected = expect![[r#"
            component
              program Guidance/Waiting/-/run
                codel motion.add
                codel motion.add
                codel motion.nothing
              program Guidance/Waiting/asked/guard
                codel motion.fail
        "#]];
        for package in PACKAGES {
            let outline = outline(&all, package);
            let (first, second) = outline.split_at(outline.len() / 2);
            expected.assert_eq(first);
            assert_eq!(first, second);
            let of_package = all.iter().filter(|it| it.begin.provider.ends_with(package));
            let threads: BTreeSet<u64> = of_package.map(|span| span.begin.thread).collect();
            assert_eq!(threads.len(), 1);
        }
        assert!(all.iter().all(|span| span.begin.field("instance") == "guidance" && span.cpu > 0));
        assert_eq!(deployer.new_clock_reads, 2 * u64::try_from(all.len()).unwrap());
        // Nobody listens any more, so no clock is read.
        deployer.tell("update 2");
        assert_eq!(deployer.new_clock_reads, 0);
    }
}

#[test]
fn orocos_only_spans_that_begin_in_a_session_end_in_it() {
    let mut recorder = Recorder::start();
    let mut deployer = deployer(&recorder, "gcc", "g++", None);
    // One package is within a span when the session begins, and goes on; then the other begins one.
    deployer.tell("open");
    recorder.record();
    deployer.tell("");
    deployer.tell("");
    let all = spans(&recorder.stop()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(outline(&all, PACKAGES[0]), "codel motion.nothing\n");
    assert_eq!(outline(&all, PACKAGES[1]), "component\n  codel motion.nothing\n");
    // The next session ends within a span.
    recorder.record();
    deployer.tell("open");
    let events = recorder.stop();
    assert_eq!(
        events.iter().map(|event| (event.name.as_str(), event.field("phase"))).collect::<Vec<_>>(),
        [("component", "0")]
    );
    assert!(spans(&events).unwrap_err().starts_with("this has no end"));
}

#[test]
fn orocos_times_of_spans_have_no_preemption_in_them() {
    let mut recorder = Recorder::start();
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap().trim();
    let cpu = allowed.split([',', '-']).next().unwrap();
    let mut deployer = deployer(&recorder, "gcc", "g++", Some(cpu));
    let mut competitor = recorder.command("taskset");
    competitor.args(["-c", cpu, "sh", "-c", "while :; do :; done"]);
    let mut competitor = competitor.spawn().unwrap();
    recorder.record();
    let used = deployer.tell("preempted");
    let all = spans(&recorder.stop()).unwrap_or_else(|error| panic!("{error}"));
    competitor.kill().unwrap();
    competitor.wait().unwrap();
    assert_eq!(all.len(), 4);
    for span in &all {
        assert!(span.cpu >= 50_000_000, "{span:?}");
        // The codel does not end before it was preempted for 50 ms.
        assert!(span.elapsed >= span.cpu + 45_000_000, "{span:?}");
    }
    // What the codel says of its own CPU time: that of the program is a bit more.
    let [program, codel] = [&all[2], &all[3]].map(|span| span.cpu);
    assert!(used <= codel && codel <= program && program <= used + 5_000_000, "{used} {codel} {program}");
}

#[test]
fn orocos_locks_say_who_waited_for_them_and_who_had_them() {
    for (c, cpp) in [("gcc", "g++"), ("clang", "clang++")] {
        let mut recorder = Recorder::start();
        let mut deployer = deployer(&recorder, c, cpp, None);
        recorder.record();
        deployer.tell("lock");
        let events = recorder.stop();
        let number = |event: &Event, name: &str| event.field(name).parse::<u64>().unwrap();
        let codels: Vec<&Event> = events.iter().filter(|it| it.name == "codel").collect();
        let [begin, end, ..] = codels[..] else { panic!("{events:#?}") };
        let locks = events.iter().filter(|it| it.name == "lock" && it.provider == end.provider);
        let (of_codel, others): (Vec<&Event>, Vec<&Event>) = locks.partition(|it| it.thread == end.thread);
        let [own] = of_codel[..] else { panic!("{events:#?}") };
        let [other] = others[..] else { panic!("{events:#?}") };
        assert!(other.field("lock") == "bus" && number(other, "blocked_ns") == 0, "{other:?}");
        // It slept with the lock, which is no CPU time; the codel waited for it, which was one wait.
        assert!(number(other, "elapsed_ns") >= 50_000_000 && other.cpu() < 40_000_000, "{other:?}");
        assert!(number(own, "blocked_ns") >= 10_000_000 && number(own, "waits") >= 1, "{own:?}");
        // The codel itself slept, too.
        assert!(number(end, "waits") > number(begin, "waits") + number(own, "waits"), "{end:?} {own:?}");
    }
}

#[test]
fn orocos_without_tracing_nothing_of_it_is_in_objects() {
    let recorder = Recorder::start();
    let folder = recorder.folder();
    generate(folder);
    for compiler in ["g++", "clang++"] {
        let symbols = |options: &[&str]| {
            let object = component(compiler, folder, PACKAGES[0], options);
            let run = Command::new("nm").arg("-a").arg(folder.join(object)).output().expect("nm runs");
            assert!(run.status.success());
            let text = String::from_utf8_lossy(&run.stdout).to_lowercase();
            let is_tracing =
                |line: &&str| ["mauve", "trac", "lttng", "span"].iter().any(|it| line.contains(it));
            (text.lines().count(), text.lines().filter(is_tracing).map(str::to_owned).collect::<Vec<_>>())
        };
        let (count, tracing) = symbols(&[]);
        assert!(count > 10 && tracing.is_empty(), "{compiler}: {tracing:?}");
        let (_, tracing) = symbols(&["-DMAUVE_TRACING"]);
        assert!(tracing.iter().any(|line| line.ends_with("u mauve_motion_codel")), "{compiler}: {tracing:?}");
    }
}
