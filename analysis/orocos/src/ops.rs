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

use mauve_hir::Value;

use crate::deployment::{
    ACTIVITIES, Activity, BACKGROUND, Deployed, LOADED, NOTHING_STARTS, STARTED, STREAMS, TOPICS, Task,
    VALUES, connecting, pinning, reading, scheduling, streaming,
};
use crate::escape::ops_string;
use crate::origin::{comment_lines, generated_from};

/// What every script begins with. A package is also looked for below the name of its target: where the deployer is run beside
/// the folder of a package, RTT takes that for what is installed of it.
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
  return worked(loadComponent(name, class), "load " + name + ", a " + class + ": build its package anew")
}
var bool ready = true
"#;

pub(crate) fn script(deployed: &Deployed) -> String {
    let mut script = Script { text: String::new(), tasks: &deployed.tasks };
    script.comment(&generated_from(&deployed.package));
    script.comment(&deployed.description);
    script.text += PRELUDE;
    script.imports(deployed);
    script.tasks(deployed);
    script.values(deployed);
    script.connections(deployed);
    script.activities();
    script.streams(deployed);
    script.start(deployed);
    script.text
}

struct Script<'a> {
    text: String,
    tasks: &'a [Task],
}

impl Script<'_> {
    fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    fn comment(&mut self, text: &str) {
        comment_lines(text).iter().for_each(|line| self.line(&format!("// {line}")));
    }

    /// An empty line, and what the next ones are about.
    fn section(&mut self, about: &str) {
        self.text.push('\n');
        self.comment(about);
    }

    /// A step, and what cannot be done where it fails.
    fn step(&mut self, indent: &str, call: &str, what: &str) {
        self.line(&format!("{indent}ready = worked({call}, {}) && ready", ops_string(what)));
    }

    fn imports(&mut self, deployed: &Deployed) {
        let import = |script: &mut Self, package: &str| {
            script.line(&format!("ready = imported({}) && ready", ops_string(package)));
        };
        if deployed.streams.is_some() {
            self.section("ROS, and the types of the messages.");
            deployed.ros_packages().into_iter().for_each(|it| import(self, it));
            self.line("if ( !ready ) then {");
            self.line(&format!("  print.err({})", ops_string(TOPICS)));
            self.line("}");
        }
        self.section("The components.");
        deployed.packages.iter().for_each(|it| import(self, it));
    }

    fn tasks(&mut self, deployed: &Deployed) {
        self.section(LOADED);
        for Task { name, class, .. } in deployed.in_order() {
            self.line(&format!("ready = loaded({}, {}) && ready", ops_string(name), ops_string(class)));
        }
        self.line("if ( !ready ) then {");
        self.line(&format!("  print.err({})", ops_string(NOTHING_STARTS)));
        self.line("}");
        if self.tasks.iter().any(|task| !task.values.is_empty()) {
            self.section("Values that the model sets, and those that rest on them.");
        }
        for task in self.tasks {
            for (property, value, from_text) in &task.values {
                if *from_text {
                    let text = ops_string(&value.text());
                    self.line(&format!(
                        "ready = {}.mauve_set({}, {text}) && ready",
                        task.name,
                        ops_string(property)
                    ));
                } else {
                    self.line(&format!("{}.{property} = {}", task.name, literal(value)));
                }
            }
        }
    }

    fn values(&mut self, deployed: &Deployed) {
        let names = deployed.with_values();
        if names.is_empty() {
            return;
        }
        self.section(VALUES);
        self.line("var string values = os.getenv(\"MAUVE_VALUES\")");
        for name in &names {
            self.step("", &format!("loadService({}, \"marshalling\")", ops_string(name)), &reading(name));
        }
        self.line("if ( values != \"\" ) then {");
        for name in &names {
            let call = format!("{name}.marshalling.updateProperties(values + \"/{name}.cpf\")");
            self.step("  ", &call, &reading(name));
        }
        self.line("}");
    }

    fn connections(&mut self, deployed: &Deployed) {
        let mut buffers: Vec<Option<u32>> = deployed.connections.iter().map(|(_, buffer)| *buffer).collect();
        buffers.sort_unstable();
        buffers.dedup();
        if !buffers.is_empty() {
            self.section(
                "The connections: from an output to an input, which keeps the last value or so many.",
            );
        }
        for &buffer in &buffers {
            let policy = self.policy(buffer);
            self.line(&format!("var ConnPolicy {policy} = ConnPolicy()"));
            match buffer {
                None => self.line(&format!("{policy}.type = DATA")),
                Some(size) => {
                    self.line(&format!("{policy}.type = CIRCULAR_BUFFER"));
                    self.line(&format!("{policy}.size = {size}"));
                }
            }
        }
        for ([from, to], buffer) in &deployed.connections {
            let policy = self.policy(*buffer);
            let call = format!("connect({}, {}, {policy})", ops_string(from), ops_string(to));
            self.step("", &call, &connecting(from, to));
        }
        if deployed.operations.is_empty() {
            return;
        }
        self.section("The operations: who requires it, who provides it. Where one is missing, the deployer would crash here.");
        self.line("if ( ready ) then {");
        for [required, provided] in &deployed.operations {
            let call = format!("connectOperations({}, {})", ops_string(required), ops_string(provided));
            self.step("  ", &call, &connecting(required, provided));
        }
        self.line("}");
    }

    /// The variable of a policy, which no task may be called, because a member of it would be a property of that.
    fn policy(&self, buffer: Option<u32>) -> String {
        let mut name = buffer.map_or("last_value".to_owned(), |size| format!("last_{size}"));
        while self.tasks.iter().any(|task| task.name == name) {
            name.push('_');
        }
        name
    }

    fn activities(&mut self) {
        self.section(ACTIVITIES);
        for Task { name, activity, .. } in self.tasks {
            let Activity { period, assumed, affinity, .. } = activity;
            if *assumed {
                self.comment(BACKGROUND);
            }
            let (priority, scheduler) = activity.scheduling();
            let call = format!("setActivity({}, {period}, {priority}, {scheduler})", ops_string(name));
            self.step("", &call, &scheduling(name));
            if activity.priority.is_none() {
                let call = format!("setWaitPeriodPolicy({}, ORO_WAIT_REL)", ops_string(name));
                self.step("", &call, &scheduling(name));
            }
            // Numbers without a sign are marked.
            let mask = affinity.unwrap_or_default();
            let mask = format!("{mask}{}", if i32::try_from(mask).is_ok() { "" } else { "u" });
            if affinity.is_some() {
                self.step("", &format!("{name}.setCpuAffinity({mask})"), &pinning(name));
            }
            self.line(&format!("ready = {name}.mauve_runs_as({priority}, {mask}) && ready"));
        }
    }

    fn streams(&mut self, deployed: &Deployed) {
        let Some(streams) = &deployed.streams else { return };
        if !streams.topics.is_empty() || !streams.left_out.is_empty() {
            self.section(STREAMS);
        }
        let topics: Vec<&[String; 2]> = streams.topics.iter().chain(&streams.shown).collect();
        // Where the first one fails, the others would for the same reason.
        let (first, others) = topics.split_at(topics.len().min(1));
        for topics in [first, others].into_iter().filter(|topics| !topics.is_empty()) {
            self.line("if ( ready ) then {");
            for [port, topic] in topics {
                let call = format!("stream({}, ros.comm.topic({}))", ops_string(port), ops_string(topic));
                self.step("  ", &call, &streaming(topic));
            }
            self.line("}");
        }
        for port in &streams.left_out {
            self.comment(&format!("Not {port}: no message has its type."));
        }
    }

    fn start(&mut self, deployed: &Deployed) {
        self.section("Where all that has worked, all are configured.");
        self.line("if ( ready ) then {");
        for name in &deployed.order {
            self.step("  ", &format!("{name}.configure()"), &format!("configure {name}"));
        }
        self.line("}");
        self.section(STARTED);
        self.line("var bool starts = os.getenv(\"MAUVE_START\") != \"false\"");
        for name in &deployed.order {
            self.line("if ( ready && starts ) then {");
            self.step("  ", &format!("{name}.start()"), &format!("start {name}"));
            self.line("}");
        }
        self.line("var bool stopped = false");
        self.line("if ( !ready ) then {");
        for name in deployed.order.iter().rev() {
            self.line(&format!("  stopped = {name}.stop()"));
        }
        self.line(&format!("  print.err({})", ops_string(NOTHING_STARTS)));
        self.line("}");
        let Some(first) = deployed.order.first() else { return };
        self.section(
            "Only then there is what the last line names: a script that fails is one to the deployer, too.",
        );
        self.line("if ( ready ) then {");
        self.line(&format!("  aliasPeer(\"this\", {}, \"all_is_well\")", ops_string(first)));
        self.line("}");
        self.line("all_is_well.getPeriod()");
    }
}

fn literal(value: &Value) -> String {
    match value {
        Value::String(text) => ops_string(text),
        // The parser reads the sign apart from the number, which alone would be too great.
        Value::Int(i32::MIN) => "-2147483647 - 1".to_owned(),
        other => other.text(),
    }
}
