//! The lines of tables are at most as wide as the terminals that most people have, whatever the names of a model.

use mauve_tests::{mauve, models, scratch, test_name, write};

use crate::MAUVE;

/// Names end in this, so that each has about 30 letters.
const ROBOT: &str = "
library museum_N {
codel look_N(out scan: int): bool
codel plan_N(in scan: int): int
codel drive_N(in order: int): void
shell Eye { output port scan_N: int }
shell Brain { input port scan_N: int  output port order_N: int }
shell Wheels { input port order_N: int }
core EyeCore(Eye) { var seen: int; update = { if (look_N(seen)) then { write(scan_N, seen); } else {} } }
core BrainCore(Brain) { var seen: int; update = { read(scan_N, seen); write(order_N, plan_N(seen)); } }
core WheelsCore(Wheels) { var wanted: int; update = { read(order_N, wanted); drive_N(wanted); } }
component Camera_N(Eye, EyeCore)
component Planner_N(Brain, BrainCore)
component Base_N(Wheels, WheelsCore)
architecture A {
  instance camera_N: Camera_N  instance planner_N: Planner_N  instance base_N: Base_N
  connection camera_N.scan_N -> planner_N.scan_N  connection planner_N.order_N -> base_N.order_N
}
deployment Robot_N {
  architecture A
  activity camera_N { priority = 1  period = 10  affinity = 1 }
  activity planner_N { priority = 2  period = 20  deadline = 10  affinity = 1 }
  activity base_N { priority = 3  period = 30  deadline = 5  affinity = 1 }
}
}
";

const CONFIG: &str = "
timing.tables = [\"times.toml\"]
platform.rt_throttling = false
lints.chain-broken = \"allow\"
[chains.steer_N]
from = \"look_N\"
to = \"drive_N\"
latency = \"200 ms\"
[deployment.Robot_N.accept]
camera_N = \"the camera loses one picture in a hundred, which the planner of this robot tolerates while it drives slowly\"
";

const TIMES: &str = "levels = [1e-3, 1e-4]\n[codel]\nlook_N = [2, 3]\nplan_N = 3\ndrive_N = 5\n";

const SAMPLES: &str = "codel,execution_ns,instance,elapsed_ns,time_ns\n\
    museum_N.look_N,4000000,camera_N,,\nmuseum_N.look_N,4100000,camera_N,,\nmuseum_N.plan_N,1000000,planner_N,,\n";

#[test]
fn no_line_of_a_table_is_wider_than_120_columns() {
    let folder = scratch(env!("CARGO_TARGET_TMPDIR"), &test_name());
    let named = |text: &str| text.replace("_N", "_of_a_second_museum_bot");
    let [robot, config, times, trace] = [ROBOT, CONFIG, TIMES, SAMPLES].map(named);
    let answered = config.replace("latency =", &named("answers = [\"look_N\"]\nlatency ="));
    let late = robot.replace("period = 20", "period = 25");
    for (name, config, robot) in
        [("long", &config, &robot), ("answered", &answered, &robot), ("late", &config, &late)]
    {
        let files =
            [("robot.mal", robot), ("mauve.toml", config), ("times.toml", &times), ("trace.csv", &trace)];
        write(&folder.join(name), &files.map(|(path, text)| (path, text.as_str())));
    }
    let sample = models().join("p3dx");
    let sample = sample.to_str().unwrap();
    let camera = named("camera_N");
    let (set, steer) = (format!("{camera}.period=11"), named("steer_N"));
    let commands = [
        "check PATH",
        "chains PATH",
        "wcrt PATH",
        "wcrt PATH --sensitivity",
        "wcrt PATH --probability",
        "wcrt PATH --significance all",
        "simulate PATH",
        "psm PATH",
        "tune PATH --priorities",
        "tune PATH --cpus --slack",
        "tune PATH --periods",
    ];
    let of_long = [
        "diff PATH late",
        "trace check trace.csv PATH",
        "trace import trace.csv -o PATH/samples",
        "chains PATH --chain STEER",
        "wcrt PATH --set SET",
        "wcrt PATH --explain CAMERA",
        "wcrt PATH --certificate PATH/certificate",
        "verify PATH/certificate",
    ];
    let paths = ["long", "answered"]
        .iter()
        .flat_map(|path| commands.iter().chain(&of_long).map(move |it| (*path, *it)));
    for (path, command) in paths.chain(commands.iter().map(|it| (sample, *it))) {
        let command = command.replace("trace.csv", "long/trace.csv");
        let words = command.split(' ').map(|word| match word {
            "STEER" => steer.clone(),
            "SET" => set.clone(),
            "CAMERA" => camera.clone(),
            word => word.replace("PATH", path),
        });
        let words: Vec<String> = words.collect();
        let found = mauve(MAUVE, &folder, &words.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(found.out.lines().count() > 1 && found.code != 2, "{command}: {} {}", found.out, found.err);
        for line in found.out.lines() {
            // Excerpts and patches have the lines of files, and their messages are in one line.
            let is_quoted =
                line.trim_start().starts_with(|it: char| it.is_ascii_digit() || "+-@|".contains(it))
                    || ["error[", "warning[", "hint["].iter().any(|start| line.starts_with(start));
            let is_word = line.trim_start().split(' ').count() == 1;
            assert!(
                line.chars().count() <= 120 || is_word || is_quoted,
                "{command} in {path}:\n{}",
                found.out
            );
        }
    }
}
