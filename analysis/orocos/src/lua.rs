//! The same deployment for those who deploy with Lua: `rttlua -i D.lua`. It does what `ops.rs` does, in the same order.

use mauve_hir::Value;

use crate::deployment::{
    ACTIVITIES, Activity, BACKGROUND, Deployed, LOADED, STARTED, STREAMS, TOPICS, Task, VALUES, connecting,
    pinning, scheduling, streaming,
};
use crate::escape::lua_string;
use crate::origin::{comment_lines, generated_from};

/// What every script begins with.
const PRELUDE: &str = r#"
require("rttlib")

local deployer = rtt.getTC()
if deployer:getName() ~= "Deployer" then
  deployer = assert(deployer:getPeer("Deployer"), "there is no Deployer")
end

local function worked(has_worked, what)
  if not has_worked then
    error("Cannot " .. what .. "\nNothing runs.", 0)
  end
end

-- Beside the folder of a package, the deployer takes that for what is installed of it.
local function import(package)
  local is_there = deployer:import(package) or deployer:import("gnulinux/" .. package)
  worked(is_there, "import package " .. package .. ": build it, and source its workspace")
end

local function load(name, class)
  local is_loaded = deployer:loadComponent(name, class)
  worked(is_loaded, "load " .. name .. ", a " .. class .. ": build its package anew")
end

local function task(name)
  return assert(deployer:getPeer(name), "there is no " .. name)
end

local function set(name, property, value)
  local found = assert(task(name):getProperty(property), name .. " has no " .. property)
  found:set(value)
end
"#;

pub(crate) fn script(deployed: &Deployed) -> String {
    let mut script = Script { text: String::new() };
    script.comment(&generated_from(&deployed.package));
    script.comment(&deployed.description);
    script.text += PRELUDE;
    script.imports(deployed);
    script.tasks(deployed);
    script.values(deployed);
    script.connections(deployed);
    script.activities(&deployed.tasks);
    script.streams(deployed);
    script.start(deployed);
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

    /// A step, and what cannot be done where it fails.
    fn step(&mut self, call: &str, what: &str) {
        self.call("worked", &[call, &lua_string(what)]);
    }

    fn imports(&mut self, deployed: &Deployed) {
        if deployed.streams.is_some() {
            self.section("ROS, and the types of the messages.");
            self.comment(TOPICS);
            deployed.ros_packages().iter().for_each(|it| self.call("import", &[&lua_string(it)]));
        }
        self.section("The components.");
        deployed.packages.iter().for_each(|it| self.call("import", &[&lua_string(it)]));
    }

    fn tasks(&mut self, deployed: &Deployed) {
        self.section(LOADED);
        for Task { name, class, .. } in deployed.in_order() {
            self.call("load", &[&lua_string(name), &lua_string(class)]);
        }
        if deployed.tasks.iter().any(|task| !task.values.is_empty()) {
            self.section("Values that the model sets, and those that rest on them.");
        }
        for task in &deployed.tasks {
            for (property, value, from_text) in &task.values {
                let [name, property] = [&task.name, property].map(|text| lua_string(text));
                if *from_text {
                    let call = format!("task({name}):mauve_set({property}, {})", lua_string(&value.text()));
                    self.step(&call, &format!("set {} of {}", property.trim_matches('"'), task.name));
                } else {
                    self.call("set", &[&name, &property, &literal(value)]);
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
        self.text += READ;
        for name in names {
            self.call("read", &[&lua_string(name)]);
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
            let what = lua_string(&connecting(from, to));
            let [from, to] = [from, to].map(|end| lua_string(end));
            match buffer {
                None => self.call("connect", &[&from, &to, "nil", &what]),
                Some(size) => self.call("connect", &[&from, &to, &size.to_string(), &what]),
            }
        }
        if !deployed.operations.is_empty() {
            self.section("The operations: who requires it, who provides it.");
        }
        for [required, provided] in &deployed.operations {
            let call =
                format!("deployer:connectOperations({}, {})", lua_string(required), lua_string(provided));
            self.step(&call, &connecting(required, provided));
        }
    }

    fn activities(&mut self, tasks: &[Task]) {
        self.section(ACTIVITIES);
        for Task { name, activity, .. } in tasks {
            let Activity { period, assumed, affinity, .. } = activity;
            if *assumed {
                self.comment(BACKGROUND);
            }
            let (priority, scheduler) = activity.scheduling();
            let quoted = lua_string(name);
            let arguments = format!("{quoted}, {period}, {priority}, rtt.globals.{scheduler}");
            self.step(&format!("deployer:setActivity({arguments})"), &scheduling(name));
            if activity.priority.is_none() {
                let arguments = format!("{quoted}, rtt.globals.ORO_WAIT_REL");
                self.step(&format!("deployer:setWaitPeriodPolicy({arguments})"), &scheduling(name));
            }
            let mask = affinity.unwrap_or_default();
            if affinity.is_some() {
                self.step(&format!("task({quoted}):setCpuAffinity({mask})"), &pinning(name));
            }
            let call = format!("task({quoted}):mauve_runs_as({priority}, {mask})");
            self.step(&call, &format!("start {name}"));
        }
    }

    fn streams(&mut self, deployed: &Deployed) {
        let Some(streams) = &deployed.streams else { return };
        let topics: Vec<&[String; 2]> = streams.topics.iter().chain(&streams.shown).collect();
        if !topics.is_empty() || !streams.left_out.is_empty() {
            self.section(STREAMS);
        }
        if !topics.is_empty() {
            self.line("local ros = rtt.provides(\"ros\"):provides(\"comm\")");
        }
        for [port, topic] in topics {
            let call = format!("deployer:stream({}, ros:topic({}))", lua_string(port), lua_string(topic));
            self.step(&call, &streaming(topic));
        }
        for port in &streams.left_out {
            self.comment(&format!("Not {port}: no message has its type."));
        }
    }

    fn start(&mut self, deployed: &Deployed) {
        self.section("Where all that has worked, all are configured.");
        for name in &deployed.order {
            self.step(&format!("task({}):configure()", lua_string(name)), &format!("configure {name}"));
        }
        self.section(STARTED);
        self.line("local order = {");
        deployed.order.iter().for_each(|name| self.line(&format!("  {},", lua_string(name))));
        self.line("}");
        self.text += START;
    }
}

const READ: &str = r#"local values = os.getenv("MAUVE_VALUES") or ""

local function read(name)
  local what = "use the values in " .. name .. ".cpf"
  worked(deployer:loadService(name, "marshalling"), what)
  if values ~= "" then
    local marshalling = task(name):provides("marshalling")
    worked(marshalling:updateProperties(values .. "/" .. name .. ".cpf"), what)
  end
end

"#;

const CONNECT: &str = r#"local function connect(from, to, size, what)
  local policy = rtt.Variable("ConnPolicy")
  if size then
    policy.type = rtt.globals.CIRCULAR_BUFFER
    policy.size = size
  else
    policy.type = rtt.globals.DATA
  end
  worked(deployer:connect(from, to, policy), what)
end

"#;

const START: &str = r#"
local function stop(last)
  for index = last, 1, -1 do
    task(order[index]):stop()
  end
end

if os.getenv("MAUVE_START") ~= "false" then
  for index, name in ipairs(order) do
    if not task(name):start() then
      stop(index - 1)
      worked(false, "start " .. name)
    end
  end
end
"#;

fn literal(value: &Value) -> String {
    match value {
        Value::String(text) => lua_string(text),
        other => other.text(),
    }
}
