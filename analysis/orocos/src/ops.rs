//! The script that the deployer of OCL runs: `deployer-gnulinux -s D.ops`.
//!
//! ```text
//! loadComponent("hokuyo", "drivers::Hokuyo")
//! hokuyo.device = "/dev/ttyACM0"
//! connected = connect("hokuyo.scan", "guidance.scan", last_value) && connected
//! setActivity("hokuyo", 0.1, 9, ORO_SCHED_RT)
//! ```
//!
//! Each statement is parsed when all before it have been executed, one a line; what one gives stops nothing. A comment has its
//! own line: behind a statement it would swallow the end of it.
//!
//! RTT's deployer goes on where an import, a component or a connection fails, and reads what it does not know as a mistake of
//! the script, with which the script ends. So each step is checked and says what is missing; steps that would crash without
//! those before them stand in blocks; and the last statement only has a meaning where all has succeeded: the deployer tells
//! by its exit code whether a script did.
//!
//! A whole number is an `int` to RTT, which it converts for properties of type `uint`, `float` and `double`, and for none of the
//! other whole numbers: those are set from a text, by the component itself.

use std::collections::{BTreeMap, BTreeSet};

use mauve_hir::Value;
use rustc_hash::FxHashSet;

use crate::deployment::{
    ACTIVITIES, Activity, BACKGROUND, CONFIGURED, CONNECTIONS, Deployed, LOADED, NOTHING_STARTS, ROS, SET,
    STARTED, STREAMS, Script, TOPICS, Task, VALUES, connecting, pinning, reading, scheduling, streaming,
};
use crate::escape::ops_string;

/// The first lines of every script. Packages are also imported by the path below the target's name: if the deployer
/// runs next to the source folder of a package, RTT takes that folder for the installed package.
const PRELUDE: &str = r#"
require("print")
require("os")

bool worked(bool has_worked, string what) {
  if ( !has_worked ) then {
    print.err("Cannot " + what)
  }
  return has_worked
}
bool imported(string package) {
  var bool is_there = import(package)
  if ( !is_there ) then {
    is_there = import("gnulinux/" + package)
  }
  return worked(is_there, "import package " + package + ": build it, and source its workspace")
}
bool loaded(string name, string class) {
  return worked(loadComponent(name, class), "load " + name + ", a " + class + ": rebuild its package")
}
var bool ready = true
"#;

pub(crate) fn script(deployed: &Deployed) -> String {
    let mut script = Script::new(deployed, "//", PRELUDE);
    imports(&mut script, deployed);
    tasks(&mut script, deployed);
    values(&mut script, deployed);
    connections(&mut script, deployed);
    activities(&mut script, deployed);
    streams(&mut script, deployed);
    start(&mut script, deployed);
    script.text
}

/// Writes a step, and the message if it fails.
fn step(script: &mut Script, indent: &str, call: &str, what: &str) {
    script.line(&format!("{indent}ready = worked({call}, {}) && ready", ops_string(what)));
}

fn imports(script: &mut Script, deployed: &Deployed) {
    let import = |script: &mut Script, package: &str| {
        script.line(&format!("ready = imported({}) && ready", ops_string(package)));
    };
    if deployed.streams.is_some() {
        script.section(ROS);
        deployed.ros_packages().into_iter().for_each(|it| import(script, it));
        script.line("if ( !ready ) then {");
        script.line(&format!("  print.err({})", ops_string(TOPICS)));
        script.line("}");
    }
    script.section("Creates the components.");
    deployed.packages.iter().for_each(|it| import(script, it));
}

fn tasks(script: &mut Script, deployed: &Deployed) {
    script.section(LOADED);
    for Task { name, class, .. } in deployed.in_order() {
        script.line(&format!("ready = loaded({}, {}) && ready", ops_string(name), ops_string(class)));
    }
    script.line("if ( !ready ) then {");
    script.line(&format!("  print.err({})", ops_string(NOTHING_STARTS)));
    script.line("}");
    if deployed.tasks.iter().any(|task| !task.values.is_empty()) {
        script.section(SET);
    }
    for task in &deployed.tasks {
        for (property, value, from_text) in &task.values {
            if *from_text {
                let text = ops_string(&value.text());
                script.line(&format!(
                    "ready = {}.mauve_set({}, {text}) && ready",
                    task.name,
                    ops_string(property)
                ));
            } else {
                script.line(&format!("{}.{property} = {}", task.name, literal(value)));
            }
        }
    }
}

fn values(script: &mut Script, deployed: &Deployed) {
    let names = deployed.with_values();
    if names.is_empty() {
        return;
    }
    script.section(VALUES);
    script.line("var string values = os.getenv(\"MAUVE_VALUES\")");
    for name in &names {
        step(script, "", &format!("loadService({}, \"marshalling\")", ops_string(name)), &reading(name));
    }
    script.line("if ( values != \"\" ) then {");
    for name in &names {
        let call = format!("{name}.marshalling.updateProperties(values + \"/{name}.cpf\")");
        step(script, "  ", &call, &reading(name));
    }
    script.line("}");
}

fn connections(script: &mut Script, deployed: &Deployed) {
    let buffers: BTreeSet<Option<u32>> = deployed.connections.iter().map(|(_, buffer)| *buffer).collect();
    let tasks: FxHashSet<&str> = deployed.tasks.iter().map(|task| task.name.as_str()).collect();
    let policies: BTreeMap<Option<u32>, String> =
        buffers.into_iter().map(|buffer| (buffer, policy(&tasks, buffer))).collect();
    if !policies.is_empty() {
        script.section(CONNECTIONS);
    }
    for (buffer, policy) in &policies {
        script.line(&format!("var ConnPolicy {policy} = ConnPolicy()"));
        match buffer {
            None => script.line(&format!("{policy}.type = DATA")),
            Some(size) => {
                script.line(&format!("{policy}.type = CIRCULAR_BUFFER"));
                script.line(&format!("{policy}.size = {size}"));
            }
        }
    }
    for ([from, to], buffer) in &deployed.connections {
        let policy = policies.get(buffer).map_or("", String::as_str);
        let call = format!("connect({}, {}, {policy})", ops_string(from), ops_string(to));
        step(script, "", &call, &connecting(from, to));
    }
    if deployed.operations.is_empty() {
        return;
    }
    script.section(
        "Connects the operations: required operation, provided operation. The deployer would \
         crash here if one were missing.",
    );
    script.line("if ( ready ) then {");
    for [required, provided] in &deployed.operations {
        let call = format!("connectOperations({}, {})", ops_string(required), ops_string(provided));
        step(script, "  ", &call, &connecting(required, provided));
    }
    script.line("}");
}

/// Returns the variable of a connection policy: a name that no task has, since its members would be parsed as
/// properties of the task.
fn policy(tasks: &FxHashSet<&str>, buffer: Option<u32>) -> String {
    let mut name = buffer.map_or("last_value".to_owned(), |size| format!("last_{size}"));
    while tasks.contains(name.as_str()) {
        name.push('_');
    }
    name
}

fn activities(script: &mut Script, deployed: &Deployed) {
    script.section(ACTIVITIES);
    for Task { name, activity, .. } in &deployed.tasks {
        let Activity { assumed, affinity, .. } = activity;
        if *assumed {
            script.comment(BACKGROUND);
        }
        let period = activity.seconds();
        let (priority, scheduler) = activity.scheduling();
        let call = format!("setActivity({}, {period}, {priority}, {scheduler})", ops_string(name));
        step(script, "", &call, &scheduling(name));
        if activity.priority.is_none() {
            let call = format!("setWaitPeriodPolicy({}, ORO_WAIT_REL)", ops_string(name));
            step(script, "", &call, &scheduling(name));
        }
        // Numbers without a sign are marked.
        let mask = affinity.unwrap_or_default();
        let mask = format!("{mask}{}", if i32::try_from(mask).is_ok() { "" } else { "u" });
        if affinity.is_some() {
            step(script, "", &format!("{name}.setCpuAffinity({mask})"), &pinning(name));
        }
        script.line(&format!("ready = {name}.mauve_runs_as({priority}, {mask}) && ready"));
    }
}

fn streams(script: &mut Script, deployed: &Deployed) {
    let Some(streams) = &deployed.streams else { return };
    if !streams.topics.is_empty() || !streams.left_out.is_empty() {
        script.section(STREAMS);
    }
    let topics: Vec<&[String; 2]> = streams.topics.iter().chain(&streams.shown).collect();
    // If the first step fails, the others fail for the same reason.
    let (first, others) = topics.split_at(topics.len().min(1));
    for topics in [first, others].into_iter().filter(|topics| !topics.is_empty()) {
        script.line("if ( ready ) then {");
        for [port, topic] in topics {
            let call = format!("stream({}, ros.comm.topic({}))", ops_string(port), ops_string(topic));
            step(script, "  ", &call, &streaming(topic));
        }
        script.line("}");
    }
    script.left_out(streams);
}

fn start(script: &mut Script, deployed: &Deployed) {
    script.section(CONFIGURED);
    script.line("if ( ready ) then {");
    for Task { name, .. } in deployed.in_order() {
        step(script, "  ", &format!("{name}.configure()"), &format!("configure {name}"));
    }
    script.line("}");
    script.section(STARTED);
    script.line("var bool starts = os.getenv(\"MAUVE_START\") != \"false\"");
    for Task { name, .. } in deployed.in_order() {
        script.line("if ( ready && starts ) then {");
        step(script, "  ", &format!("{name}.start()"), &format!("start {name}"));
        script.line("}");
    }
    script.line("var bool stopped = false");
    script.line("if ( !ready ) then {");
    for Task { name, .. } in deployed.in_order().rev() {
        script.line(&format!("  stopped = {name}.stop()"));
    }
    script.line(&format!("  print.err({})", ops_string(NOTHING_STARTS)));
    script.line("}");
    let Some(first) = deployed.in_order().next() else { return };
    script.section(
        "The last line is an error unless all steps succeeded: a script cannot report a failure to the \
         deployer in another way.",
    );
    script.line("if ( ready ) then {");
    script.line(&format!("  aliasPeer(\"this\", {}, \"all_is_well\")", ops_string(&first.name)));
    script.line("}");
    script.line("all_is_well.getPeriod()");
}

fn literal(value: &Value) -> String {
    match value {
        Value::String(text) => ops_string(text),
        // The parser reads the sign separately from the number, which is too large without it.
        Value::Int(i32::MIN) => "-2147483647 - 1".to_owned(),
        other => other.text(),
    }
}
