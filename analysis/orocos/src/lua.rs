//! The same deployment for those who deploy with Lua: `rttlua -i D.lua`. It does what `ops.rs` does, in the same order.

use mauve_model::Value;

use crate::deployment::{Activity, BACKGROUND, Deployed, STREAMS, Task, comment_lines};
use crate::escape::lua_string;

/// What every script begins with.
const PRELUDE: &str = r#"
require("rttlib")

local deployer = rtt.getTC()
if deployer:getName() ~= "Deployer" then
  deployer = assert(deployer:getPeer("Deployer"), "there is no Deployer")
end

local function import(package)
  assert(deployer:import(package), "cannot import " .. package)
end

local function load(name, class)
  assert(deployer:loadComponent(name, class), "cannot load " .. name .. ", a " .. class)
end

local function task(name)
  return assert(deployer:getPeer(name), "there is no " .. name)
end

local function set(name, property, value)
  local found = assert(task(name):getProperty(property), name .. " has no " .. property)
  found:set(value)
end
"#;

/// The script of a deployment.
pub(crate) fn script(deployed: &Deployed) -> String {
    let mut script = Script { text: String::new() };
    script.comment(&deployed.description);
    script.comment("Generated from the model: what is changed here is lost.");
    script.text += PRELUDE;
    script.imports(deployed);
    script.tasks(&deployed.tasks);
    script.connections(deployed);
    script.activities(&deployed.tasks);
    script.streams(deployed);
    script.start(&deployed.order);
    script.text
}

struct Script {
    text: String,
}

impl Script {
    fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    fn comment(&mut self, text: &str) {
        comment_lines(text).iter().for_each(|line| self.line(&format!("-- {line}")));
    }

    /// An empty line, and what the next ones are about.
    fn section(&mut self, about: &str) {
        self.text.push('\n');
        self.comment(about);
    }

    fn call(&mut self, function: &str, arguments: &[&str]) {
        self.line(&format!("{function}({})", arguments.join(", ")));
    }

    fn imports(&mut self, deployed: &Deployed) {
        if let Some(streams) = &deployed.streams {
            self.section("ROS, and the types of the messages.");
            for package in ["rtt_ros", "rtt_rosnode", "rtt_roscomm"] {
                self.call("import", &[&lua_string(package)]);
            }
            streams.packages.iter().for_each(|it| self.call("import", &[&lua_string(it)]));
        }
        self.section("The components.");
        deployed.packages.iter().for_each(|it| self.call("import", &[&lua_string(it)]));
    }

    fn tasks(&mut self, tasks: &[Task]) {
        self.section("The instances.");
        for Task { name, class, .. } in tasks {
            self.call("load", &[&lua_string(name), &lua_string(class)]);
        }
        if tasks.iter().any(|task| !task.values.is_empty()) {
            self.section("Values that the model sets, and those that rest on them.");
        }
        for task in tasks {
            for (property, value) in &task.values {
                self.call("set", &[&lua_string(&task.name), &lua_string(property), &literal(value)]);
            }
        }
    }

    fn connections(&mut self, deployed: &Deployed) {
        if !deployed.connections.is_empty() {
            self.section(
                "The connections: from an output to an input, which keeps the last value or so many.",
            );
            self.text += CONNECT;
        }
        for ([from, to], buffer) in &deployed.connections {
            let [from, to] = [from, to].map(|end| lua_string(end));
            match buffer {
                None => self.call("connect", &[&from, &to]),
                Some(size) => self.call("connect", &[&from, &to, &size.to_string()]),
            }
        }
        if !deployed.operations.is_empty() {
            self.section("The operations: who requires it, who provides it.");
        }
        for ends in &deployed.operations {
            let [required, provided] = ends.each_ref().map(|end| lua_string(end));
            self.line(&format!("assert(deployer:connectOperations({required}, {provided}))"));
        }
    }

    fn activities(&mut self, tasks: &[Task]) {
        self.section(
            "How they run: period in seconds, priority, scheduler; and on which CPUs, a bit for each.",
        );
        for Task { name, activity, .. } in tasks {
            let Activity { period, assumed, affinity, .. } = activity;
            if *assumed {
                self.comment(BACKGROUND);
            }
            let (priority, scheduler) = activity.scheduling();
            let arguments = format!("{}, {period}, {priority}, rtt.globals.{scheduler}", lua_string(name));
            self.line(&format!("assert(deployer:setActivity({arguments}))"));
            if let Some(mask) = affinity {
                self.line(&format!("task({}):setCpuAffinity({mask})", lua_string(name)));
            }
        }
    }

    fn streams(&mut self, deployed: &Deployed) {
        let Some(streams) = &deployed.streams else { return };
        if !streams.topics.is_empty() || !streams.left_out.is_empty() {
            self.section(STREAMS);
        }
        if !streams.topics.is_empty() {
            self.line("local ros = rtt.provides(\"ros\"):provides(\"comm\")");
        }
        for [port, topic] in &streams.topics {
            self.line(&format!("deployer:stream({}, ros:topic({}))", lua_string(port), lua_string(topic)));
        }
        for port in &streams.left_out {
            self.comment(&format!("Not {port}: no message has its type."));
        }
    }

    fn start(&mut self, order: &[String]) {
        self.section("All are configured, and only if that succeeds for all, they start: who provides operations before \
             who requires them.");
        self.line("local order = {");
        order.iter().for_each(|name| self.line(&format!("  {},", lua_string(name))));
        self.line("}");
        self.text += START;
    }
}

const CONNECT: &str = r#"local function connect(from, to, size)
  local policy = rtt.Variable("ConnPolicy")
  if size then
    policy.type = rtt.globals.CIRCULAR_BUFFER
    policy.size = size
  else
    policy.type = rtt.globals.DATA
  end
  assert(deployer:connect(from, to, policy), "cannot connect " .. from .. " to " .. to)
end

"#;

const START: &str = r#"
local failed = {}
for _, name in ipairs(order) do
  if not task(name):configure() then
    failed[#failed + 1] = name
  end
end
assert(#failed == 0, "nothing starts, because these cannot be configured: " .. table.concat(failed, ", "))

for _, name in ipairs(order) do
  assert(task(name):start(), name .. " does not start")
end
"#;

fn literal(value: &Value) -> String {
    match value {
        Value::String(text) => lua_string(text),
        other => other.text(),
    }
}
