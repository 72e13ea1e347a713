//! The script of a deployment in Lua, which OCL's deployer executes: `deployer-gnulinux -s D.lua`, or `rttlua -i D.lua`.
//!
//! ```text
//! load("hokuyo", "drivers::Hokuyo")
//! set("hokuyo", "device", "/dev/ttyACM0")
//! connect("hokuyo.scan", "guidance.scan", nil, "connect hokuyo.scan and guidance.scan")
//! worked(deployer:setActivity("hokuyo", 0.1, 9, rtt.globals.ORO_SCHED_RT), "create the activity of hokuyo")
//! ```
//!
//! RTT's deployer reports most failures only by a result. So each step is checked; the first one that fails is an error, with
//! which the script ends: nothing after it is executed, and nothing runs. The deployer then tells by its exit code.

use mauve_hir::Value;

use crate::deployment::{
    Activity, BACKGROUND, CONNECTIONS, Deployed, OPERATIONS, PROVIDERS_FIRST, SET, Task,
};
use crate::escape::lua_string;
use crate::generated_file::generated_from;
use crate::origin::comment_lines;

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

-- Next to the source folder of a package, the deployer takes that folder for the installed package:
-- the second path names the installed one.
local function import(package)
  local is_there = deployer:import(package) or deployer:import("gnulinux/" .. package)
  worked(is_there, "import package " .. package .. ": build it, and source its workspace")
end

local function load(name, class)
  local is_loaded = deployer:loadComponent(name, class)
  worked(is_loaded, "load " .. name .. ", a " .. class .. ": rebuild its package")
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
    instances(&mut script, deployed);
    values(&mut script, deployed);
    connections(&mut script, deployed);
    activities(&mut script, deployed);
    streams(&mut script, deployed);
    start(&mut script, deployed);
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

    /// Writes an empty line and a comment about the next lines.
    fn section(&mut self, about: &str) {
        self.text.push('\n');
        self.comment(about);
    }

    /// Writes a step, and the message if it fails.
    fn step(&mut self, call: &str, what: &str) {
        self.line(&format!("worked({call}, {})", lua_string(what)));
    }
}

fn instances(script: &mut Script, deployed: &Deployed) {
    if let Some(streams) = &deployed.streams {
        script.section("Imports ROS and the types of the messages.");
        script.comment(
            "Topics need rtt_ros_integration. Without them: `[generate] ros_streams = false` in mauve.toml.",
        );
        let packages = streams.packages.iter().map(String::as_str);
        let packages = ["rtt_ros", "rtt_rosnode", "rtt_roscomm"].into_iter().chain(packages);
        packages.for_each(|it| script.line(&format!("import({})", lua_string(it))));
    }
    script.section("Creates the components.");
    deployed.packages.iter().for_each(|it| script.line(&format!("import({})", lua_string(it))));
    script.section(&format!("{PROVIDERS_FIRST} The deployer stops them in reverse order."));
    for Task { name, class, .. } in deployed.in_order() {
        script.line(&format!("load({}, {})", lua_string(name), lua_string(class)));
    }
}

fn values(script: &mut Script, deployed: &Deployed) {
    if deployed.tasks.iter().any(|task| !task.values.is_empty()) {
        script.section(SET);
    }
    for task in &deployed.tasks {
        let name = lua_string(&task.name);
        for (property, value, from_text) in &task.values {
            let known = lua_string(property);
            if *from_text {
                let call = format!("task({name}):mauve_set({known}, {})", lua_string(&value.text()));
                script.step(&call, &format!("set {property} of {}", task.name));
            } else {
                script.line(&format!("set({name}, {known}, {})", literal(value)));
            }
        }
    }
    let mut with_values = deployed.in_order().filter(|task| task.has_values).peekable();
    if with_values.peek().is_some() {
        script.section(
            "Reads property values of this launch: NAME.cpf in the folder MAUVE_VALUES, for each instance with \
             properties.",
        );
        script.text += READ;
    }
    with_values.for_each(|task| script.line(&format!("read({})", lua_string(&task.name))));
}

fn connections(script: &mut Script, deployed: &Deployed) {
    let connecting = |one: &str, other: &str| format!("connect {one} and {other}");
    if !deployed.connections.is_empty() {
        script.section(CONNECTIONS);
        script.text += CONNECT;
    }
    for ([from, to], buffer) in &deployed.connections {
        let size = buffer.map_or("nil".to_owned(), |size| size.to_string());
        let [from, to, what] = [from, to, &connecting(from, to)].map(|it| lua_string(it));
        script.line(&format!("connect({from}, {to}, {size}, {what})"));
    }
    if !deployed.operations.is_empty() {
        script.section(OPERATIONS);
    }
    for [required, provided] in &deployed.operations {
        let call = format!("deployer:connectOperations({}, {})", lua_string(required), lua_string(provided));
        script.step(&call, &connecting(required, provided));
    }
}

fn activities(script: &mut Script, deployed: &Deployed) {
    script.section(
        "Creates the activities: period in seconds, priority, scheduler, and CPUs, one bit for each. Each \
         component then checks its thread.",
    );
    for Task { name, activity, .. } in &deployed.tasks {
        let Activity { assumed, affinity, .. } = activity;
        if *assumed {
            script.comment(BACKGROUND);
        }
        let scheduler = if activity.priority.is_some() { "ORO_SCHED_RT" } else { "ORO_SCHED_OTHER" };
        let (period, priority) = (activity.seconds(), activity.priority.unwrap_or_default());
        let (quoted, what) = (lua_string(name), format!("create the activity of {name}"));
        let arguments = format!("{quoted}, {period}, {priority}, rtt.globals.{scheduler}");
        script.step(&format!("deployer:setActivity({arguments})"), &what);
        if activity.priority.is_none() {
            let arguments = format!("{quoted}, rtt.globals.ORO_WAIT_REL");
            script.step(&format!("deployer:setWaitPeriodPolicy({arguments})"), &what);
        }
        let mask = affinity.unwrap_or_default();
        if affinity.is_some() {
            let what = format!("set the CPU affinity of {name}: do these CPUs exist?");
            script.step(&format!("task({quoted}):setCpuAffinity({mask})"), &what);
        }
        script.step(&format!("task({quoted}):mauve_runs_as({priority}, {mask})"), &format!("start {name}"));
    }
}

fn streams(script: &mut Script, deployed: &Deployed) {
    let Some(streams) = &deployed.streams else { return };
    let mut topics = streams.topics.iter().chain(&streams.shown).peekable();
    if topics.peek().is_some() || !streams.left_out.is_empty() {
        script.section(
            "Streams outputs, and inputs without a connection, to topics. On a connected input, a topic would \
             be a second writer.",
        );
    }
    if topics.peek().is_some() {
        script.line("local ros = rtt.provides(\"ros\"):provides(\"comm\")");
    }
    for [port, topic] in topics {
        let call = format!("deployer:stream({}, ros:topic({}))", lua_string(port), lua_string(topic));
        script.step(&call, &format!("create topic {topic}: is roscore running?"));
    }
    for port in &streams.left_out {
        script.comment(&format!("{port} is not streamed: its type is not a message."));
    }
}

fn start(script: &mut Script, deployed: &Deployed) {
    script.section("If all steps succeeded, configures the instances.");
    for Task { name, .. } in deployed.in_order() {
        script.step(&format!("task({}):configure()", lua_string(name)), &format!("configure {name}"));
    }
    script.section(
        "Starts the instances, providers of operations first, unless MAUVE_START is false. If one fails to \
         start, all are stopped again.",
    );
    script.line("local order = {");
    deployed.in_order().for_each(|task| script.line(&format!("  {},", lua_string(&task.name))));
    script.line("}");
    script.text += START;
}

fn literal(value: &Value) -> String {
    match value {
        Value::String(text) => lua_string(text),
        other => other.text(),
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
