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
//! A whole number is an `int` to RTT. It is converted for properties of type `uint`, `float` and `double`; with the typekit of
//! `rtt_roscomm` also for `short`, `int8`, `uint8` and `uint16`, which RTT itself does not know; for `char`, `long`, `int64`,
//! `uint64` and `size_t` it is not, and no other text would be. Such a statement is an error, which ends the script before
//! anything starts.

use mauve_model::Value;

use crate::deployment::{Activity, BACKGROUND, Deployed, STREAMS, Task, comment_lines};
use crate::escape::ops_string;

/// The script of a deployment.
pub(crate) fn script(deployed: &Deployed) -> String {
    let mut script = Script { text: String::new(), tasks: &deployed.tasks };
    script.comment(&deployed.description);
    script.comment("Generated from the model: what is changed here is lost.");
    script.imports(deployed);
    script.tasks();
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

    fn imports(&mut self, deployed: &Deployed) {
        if let Some(streams) = &deployed.streams {
            self.section("ROS, and the types of the messages.");
            self.line("import(\"rtt_ros\")");
            self.line("import(\"rtt_rosnode\")");
            self.line("import(\"rtt_roscomm\")");
            streams.packages.iter().for_each(|it| self.line(&format!("import({})", ops_string(it))));
        }
        self.section("The components.");
        deployed.packages.iter().for_each(|it| self.line(&format!("import({})", ops_string(it))));
    }

    fn tasks(&mut self) {
        self.section("The instances.");
        for Task { name, class, .. } in self.tasks {
            self.line(&format!("loadComponent({}, {})", ops_string(name), ops_string(class)));
        }
        if self.tasks.iter().any(|task| !task.values.is_empty()) {
            self.section("Values that the model sets, and those that rest on them.");
        }
        for task in self.tasks {
            for (property, value) in &task.values {
                self.line(&format!("{}.{property} = {}", task.name, literal(value)));
            }
        }
    }

    fn connections(&mut self, deployed: &Deployed) {
        let mut buffers: Vec<Option<u32>> = deployed.connections.iter().map(|(_, buffer)| *buffer).collect();
        buffers.sort_unstable();
        buffers.dedup();
        if buffers.is_empty() && deployed.operations.is_empty() {
            return;
        }
        self.section("The connections: from an output to an input, which keeps the last value or so many.");
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
        self.line("var bool connected = true");
        for ([from, to], buffer) in &deployed.connections {
            let [from, to] = [from, to].map(|end| ops_string(end));
            let policy = self.policy(*buffer);
            self.line(&format!("connected = connect({from}, {to}, {policy}) && connected"));
        }
        if !deployed.operations.is_empty() {
            self.section("The operations: who requires it, who provides it.");
        }
        for ends in &deployed.operations {
            let [required, provided] = ends.each_ref().map(|end| ops_string(end));
            self.line(&format!("connected = connectOperations({required}, {provided}) && connected"));
        }
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
        self.section(
            "How they run: period in seconds, priority, scheduler; and on which CPUs, a bit for each.",
        );
        for Task { name, activity, .. } in self.tasks {
            let Activity { period, assumed, affinity, .. } = activity;
            if *assumed {
                self.comment(BACKGROUND);
            }
            let (priority, scheduler) = activity.scheduling();
            self.line(&format!("setActivity({}, {period}, {priority}, {scheduler})", ops_string(name)));
            if let Some(mask) = affinity {
                // Numbers without a sign are marked.
                let unsigned = if i32::try_from(*mask).is_ok() { "" } else { "u" };
                self.line(&format!("{name}.setCpuAffinity({mask}{unsigned})"));
            }
        }
    }

    fn streams(&mut self, deployed: &Deployed) {
        let Some(streams) = &deployed.streams else { return };
        if !streams.topics.is_empty() || !streams.left_out.is_empty() {
            self.section(STREAMS);
        }
        for [port, topic] in &streams.topics {
            self.line(&format!("stream({}, ros.comm.topic({}))", ops_string(port), ops_string(topic)));
        }
        for port in &streams.left_out {
            self.comment(&format!("Not {port}: no message has its type."));
        }
    }

    fn start(&mut self, deployed: &Deployed) {
        let is_connected = !deployed.connections.is_empty() || !deployed.operations.is_empty();
        self.section("All are configured, and only if that succeeds for all, they start: who provides operations before \
             who requires them. What fails says so in the log.");
        self.line("var bool configured = true");
        for name in &deployed.order {
            self.line(&format!("configured = {name}.configure() && configured"));
        }
        self.text.push('\n');
        let condition = if is_connected { "connected && configured" } else { "configured" };
        self.line(&format!("if ( {condition} ) then {{"));
        deployed.order.iter().for_each(|name| self.line(&format!("  {name}.start()")));
        self.line("}");
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
