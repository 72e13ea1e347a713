//! `mauve measure`: codels alone, with inputs that were written and with recorded ones; beside it `mauve run --codels` with another
//! timing table. One robot is built for all of this.
//!
//! `tests/run` installs CMake and the compilers; without them these tests fail with a message.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mauve_pwcet::samples::Samples;
use mauve_tests::orocos::{RUNS_ONCE, run};
use mauve_tests::write;

use crate::MAUVE;
use crate::standalone::{folder, has_real_time, text};

const ROBOT: &str = "\
library robot {
  use geometry_msgs
  codel aim(in at: Point, in weight: int, inout last: double): double
  codel look(in base: Base): int
  codel open(out base: Base): bool
  codel later(in x: double): double
  codel crash(): void
  codel leave(): void
  codel stuck(): void
  shell PilotShell { }
  core PilotCore(PilotShell) {
    var base: Base; var at: Point; var last: double = 0.0; var n: int = 0
    configure = { return open(base); }
    update = { n = look(base); aim(at, n, last); }
  }
  component Pilot(PilotShell, PilotCore)
  architecture Robot { instance pilot: Pilot }
  deployment Bench {
    architecture Robot
    activity pilot { affinity = 1  priority = 10  period = 10 }
  }
}
";

const CONFIGURATION: &str = "\
timing = { tables = [\"times.toml\"] }
platform = { cpus = 1, rt_throttling = false }
[types]
Base = { cpp = \"std::shared_ptr<int>\", header = \"memory\" }
";

const TIMES: &str = "unit = \"ms\"\n[codel]\n\"robot.aim\" = 1\n\"robot.look\" = 1\n\"robot.open\" = 1\n";

const AIM: &str = "\
#include <robot/robot-codels.hpp>

namespace robot {

// Its time depends on its input; with another `last` it fails.
double aim(const ::geometry_msgs::Point& at, int weight, double& last) {
  volatile double sum = last;
  for (int turn = 0; turn < 1000 * weight; ++turn) sum = sum + at.x * 1e-3;
  last += 1;
  return sum;
}

}  // namespace robot
";

const LOOK: &str = "#include <robot/robot-codels.hpp>\n\nnamespace robot {\n\nint look(const std::shared_ptr<int>& base) { return ++*base % 3; }\n\n}\n";

const OPEN: &str = "\
#include <robot/robot-codels.hpp>

namespace robot {

bool open(std::shared_ptr<int>& base) {
  base = std::make_shared<int>(0);
  return true;
}

}
";

fn mauve(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(MAUVE);
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).envs(RUNS_ONCE);
    let output = command.env("XDG_CACHE_HOME", folder.join("cache")).output().unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

fn robot(name: &str) -> PathBuf {
    let folder = folder(name);
    write(&folder, &[("robot.mal", ROBOT), ("mauve.toml", CONFIGURATION), ("times.toml", TIMES)]);
    run(Command::new(MAUVE).arg("generate").arg(&folder).arg("--out").arg(folder.join("src")));
    let source = |name: &str, text: &str| (format!("src/robot/src/codels/{name}.cpp"), text.to_owned());
    write(&folder, &[source("aim", AIM), source("look", LOOK), source("open", OPEN)]);
    folder
}

/// The message of a command that fails.
fn refused(folder: &Path, inputs: &str, codel: &str) -> String {
    write(folder, &[("in.toml", inputs)]);
    let arguments =
        ["measure", codel, "--codels", "src", "-n", "10", "-o", "no.samples", "--inputs", "in.toml"];
    let (code, out, err) = mauve(folder, &arguments);
    assert_eq!((code, out.as_str()), (2, ""), "{err}");
    assert!(!folder.join("no.samples").exists());
    err
}

/// A codel that ends the program, or never returns, is named; nothing of it is imported, and no process and no file is left.
#[test]
fn orocos_a_codel_that_does_not_return_is_named() {
    let folder = robot("alone-stuck");
    for (name, body) in [
        ("crash", "volatile int* none = nullptr; *none = 1;"),
        ("leave", "std::exit(0);"),
        ("stuck", "for (;;) pause();"),
    ] {
        let text = format!(
            "#include <cstdlib>\n#include <unistd.h>\n#include <robot/robot-codels.hpp>\nnamespace robot {{\nvoid {name}() {{ {body} }}\n}}\n"
        );
        write(&folder, &[(format!("src/robot/src/codels/{name}.cpp"), text)]);
    }
    let arguments = |codel: &'static str| {
        ["measure", "robot.open", codel, "--codels", "src", "-n", "300", "-o", "r.samples"]
    };
    for (codel, status) in [("robot.crash", "signal: 11"), ("robot.leave", "exit status: 0")] {
        let (code, out, err) = mauve(&folder, &arguments(codel));
        assert_eq!((code, out.as_str()), (2, ""), "{err}");
        let message = format!("\nmeasuring {codel}\nmauve: the program ended early ({status}");
        assert!(
            err.contains(&message)
                && err.contains("in the codel that it named last: `r.samples` gets nothing"),
            "{err}"
        );
    }
    let mut command = Command::new(MAUVE);
    command.args(arguments("robot.stuck")).current_dir(&folder).stdin(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.env("XDG_CACHE_HOME", folder.join("cache")).envs(RUNS_ONCE).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let said = lines.find(|it| it.contains("has not returned")).unwrap();
    assert!(said.starts_with("robot.stuck has not returned for 5 s: it waits for something"), "{said}");
    // Only this process: a terminal signals the program, too.
    run(Command::new("kill").arg("-INT").arg(child.id().to_string()));
    let said: Vec<String> = lines.collect();
    assert_eq!(said, ["mauve: the measurement was ended by a signal: `r.samples` gets nothing of it"]);
    assert_eq!(child.wait().unwrap().code(), Some(2));
    let program = format!("{}", folder.join("cache").display());
    let processes = std::fs::read_dir("/proc").unwrap().flatten();
    let commands = processes.filter_map(|it| std::fs::read(it.path().join("cmdline")).ok());
    assert!(!commands.map(|it| text(&it)).any(|it| it.starts_with(&program)), "a process is left");
    let cache =
        Command::new("find").arg(folder.join("cache")).args(["-name", "measured-*"]).output().unwrap();
    assert_eq!(text(&cache.stdout), "");
    assert!(!folder.join("r.samples").exists());
}

/// Nothing is built for these.
#[test]
fn orocos_inputs_are_checked_before_anything_is_built() {
    let folder = robot("alone-inputs");
    let aim = |inputs: &str| refused(&folder, &format!("[\"robot.aim\"]\n{inputs}"), "robot.aim");
    let missing = aim("weight = [1]\nlast = [0]\n");
    assert!(
        missing.contains("`robot.aim` has no value for `at`")
            && missing.contains("record it with `mauve run --codels src --trace DIR --inputs`, then measure with --inputs DIR/inputs.toml")
            && missing.trim_end().ends_with(
                "[\"robot.aim\"]\nat = [{ x = 0.0, y = 0.0, z = 0.0 }]\nweight = [0]\nlast = [0.0]"
            ),
        "{missing}"
    );
    let point = "{ x = 1, y = 2.5, z = nan }";
    for (inputs, message) in [
        (
            format!("at = [{point}]\nweight = [1, 2]\nlast = [0, 1, 2]\n"),
            "of `robot.aim`, `weight` and `last` have different numbers of values",
        ),
        (format!("at = [{point}]\nweight = [1]\nlast = [0]\nspeed = [1]\n"), "has no input `speed`"),
        (
            format!("at = [{point}]\nweight = [1.5]\nlast = [0]\n"),
            "`weight[0]` is not an integer from -2147483648 to",
        ),
        (format!("at = [{point}]\nweight = [2147483648]\nlast = [0]\n"), "`weight[0]` is not an integer"),
        (format!("at = [{point}]\nweight = [1]\nlast = [\"0\"]\n"), "`last[0]` is not a number"),
        ("at = [{ x = 1, y = 2 }]\nweight = [1]\nlast = [0]\n".to_owned(), "has no value for `at[0].z`"),
        (
            "at = [{ x = 1, y = 2, z = 3, w = 4 }]\nweight = [1]\nlast = [0]\n".to_owned(),
            "has no input `at[0].w`",
        ),
        ("at = [1]\nweight = [1]\nlast = [0]\n".to_owned(), "`at[0]` is not a table of fields"),
        ("at = []\nweight = [1]\nlast = [0]\n".to_owned(), "has no value for `at`"),
        ("at = [\n".to_owned(), "`in.toml` is not a file of inputs"),
        (
            format!("at = [{point}]\nweight = [{}]\nlast = [0]\n", "1, ".repeat(20_000)),
            "`robot.aim` has 20000 rows, more values than a program should have",
        ),
    ] {
        let said = aim(&inputs);
        assert!(said.contains(message), "{said}");
    }
    let opaque = refused(&folder, "", "robot.look");
    assert!(
        opaque.contains("values of its parameter `base`, of type Base, exist only in the robot"),
        "{opaque}"
    );
    let stub = refused(&folder, "[\"robot.later\"]\nx = [1]\n", "robot.later");
    assert!(stub.contains("later.cpp` is the stub that `mauve generate` wrote"), "{stub}");
    // Where the executions cannot be added, nothing is executed.
    std::os::unix::fs::symlink(folder.join("elsewhere"), folder.join("link.samples")).unwrap();
    write(&folder, &[("text.samples", "mine")]);
    for (file, message) in [("link.samples", "is a link"), ("text.samples", "`text.samples` is not")] {
        let (code, _, err) = mauve(&folder, &["measure", "robot.open", "--codels", "src", "-o", file]);
        assert!(code == 2 && err.contains(message), "{err}");
    }
    let unknown = refused(&folder, "", "robot.am");
    assert!(
        unknown.contains("the model has no codel `robot.am`; it has: robot.aim, robot.look"),
        "{unknown}"
    );
    assert!(!folder.join("cache").exists());
}

#[test]
fn orocos_a_codel_is_measured_alone_and_in_the_robot() {
    let folder = robot("alone");
    // In the robot: its inputs are recorded, with a table that changed after `generate`.
    write(&folder, &[("times.toml", TIMES.replace("aim\" = 1", "aim\" = 2").as_str())]);
    let arguments = [
        "run",
        ".",
        "--codels",
        "src",
        "--for",
        "1500ms",
        "--trace",
        "rec",
        "--inputs",
        "--allow-non-realtime",
    ];
    let (code, out, err) = mauve(&folder, &arguments[..if has_real_time() { 9 } else { 10 }]);
    assert!(code == 0 || code == 1, "{out}{err}");
    let next = format!(
        "recorded in {0}; next: mauve trace import {0} -o robot.samples",
        folder.join("rec").display()
    );
    assert!(out.lines().last().unwrap_or_default().starts_with(&next), "{out}");
    assert!(err.contains("the inputs of `robot.look` are not recorded: values of `base`"), "{err}");
    let inputs = std::fs::read_to_string(folder.join("rec/inputs.toml")).unwrap();
    let table: toml::Table = inputs.parse().unwrap();
    let aim = table["robot.aim"].as_table().unwrap();
    let rows = |name: &str| aim[name].as_array().unwrap();
    // Some of 150 calls, spread over the run: `last` counts them.
    assert!((64..=128).contains(&rows("last").len()), "{inputs}");
    assert_eq!(rows("last")[0].as_float(), Some(0.0));
    assert!(rows("last").last().unwrap().as_float().unwrap() >= 120.0, "{inputs}");
    assert!(rows("weight").iter().all(|it| (0..3).contains(&it.as_integer().unwrap())), "{inputs}");
    assert_eq!(rows("at")[0], toml::Value::Table("x = 0.0\ny = 0.0\nz = 0.0\n".parse().unwrap()));
    let (code, _, err) = mauve(&folder, &["trace", "import", "rec", "-o", "r.samples"]);
    assert_eq!(code, 0, "{err}");

    // Alone.
    let arguments = [
        "measure",
        "robot.aim",
        "robot.open",
        "--codels",
        "src",
        "--inputs",
        "rec/inputs.toml",
        "-n",
        "2000",
        "-o",
        "r.samples",
    ];
    let (code, out, err) = mauve(&folder, &arguments);
    assert_eq!(code, 0, "{out}{err}");
    assert!(err.contains("\nmeasuring robot.aim\nmeasuring robot.open\n"), "{err}");
    assert!(err.contains("on CPU ") && err.contains("before each execution with cold caches"), "{err}");
    assert!(
        out.contains("robot.aim: alone ")
            && out.contains(", in the robot ")
            && out.ends_with(" (greatest)\n"),
        "{out}"
    );
    let mut samples = Samples::open(&folder.join("r.samples")).unwrap();
    let counts = |key: &str| {
        let all = samples.series().iter().filter(|it| it.key == key);
        all.map(|it| (it.instance.clone(), it.count)).collect::<Vec<_>>()
    };
    let alone = [("(alone warm)".to_owned(), 2000), ("(alone cold)".to_owned(), 200)];
    // It runs before the threads of activities do: no recording has it.
    assert_eq!(counts("robot.open"), alone);
    let aim = counts("robot.aim");
    assert_eq!(aim[1..], alone);
    assert_eq!(aim[0].0, "pilot");
    // The time follows the inputs: with weight 0 there is nothing to do.
    let warm =
        samples.series().iter().find(|it| it.key == "robot.aim" && it.instance == "(alone warm)").unwrap();
    let mut times: Vec<u64> = samples.executions(warm.id).unwrap().iter().map(|it| it.execution).collect();
    times.sort_unstable();
    assert!(times[1900] > 4 * times[100], "{} {}", times[100], times[1900]);

    // With written inputs, into another file.
    write(
        &folder,
        &[(
            "in.toml",
            "[\"robot.aim\"]\nat = [{ x = 1, y = inf, z = -0.5 }]\nweight = [1, 2]\nlast = [0.5]\n",
        )],
    );
    let arguments =
        ["measure", "robot.aim", "--codels", "src", "--inputs", "in.toml", "-n", "200", "-o", "w.samples"];
    let (code, out, err) = mauve(&folder, &arguments);
    assert_eq!(code, 0, "{out}{err}");
    assert!(!out.contains("in the robot"), "{out}");

    // The table says that nothing of it was measured in the robot.
    let (_, out, err) = mauve(&folder, &["pwcet", "r.samples", "--levels", "1e-2", "-o", "new.toml"]);
    assert!(err.contains("robot.aim: alone "), "{out}{err}");
}
