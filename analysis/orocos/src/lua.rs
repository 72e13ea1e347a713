//! The script of a deployment in Lua: `rttlua -i D.lua`. It executes the same steps as that of `ops.rs`, in the same
//! order.

use mauve_hir::Value;

use crate::deployment::{
    ACTIVITIES, Activity, BACKGROUND, CONFIGURED, CONNECTIONS, Deployed, LOADED, ROS, SET, STARTED, STREAMS,
    Script, TOPICS, Task, VALUES, connecting, pinning, scheduling, streaming,
};
use crate::escape::lua_string;

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
    let mut script = Script::new(deployed, "--", PRELUDE);
    imports(&mut script, deployed);
    tasks(&mut script, deployed);
    values(&mut script, deployed);
    connections(&mut script, deployed);
    activities(&mut script, deployed);
    streams(&mut script, deployed);
    start(&mut script, deployed);
    script.text
}

fn write_call(script: &mut Script, function: &str, arguments: &[&str]) {
    script.line(&format!("{function}({})", arguments.join(", ")));
}

/// Writes a step, and the message if it fails.
fn step(script: &mut Script, call: &str, what: &str) {
    write_call(script, "worked", &[call, &lua_string(what)]);
}

fn imports(script: &mut Script, deployed: &Deployed) {
    if deployed.streams.is_some() {
        script.section(ROS);
        script.comment(TOPICS);
        deployed.ros_packages().iter().for_each(|it| write_call(script, "import", &[&lua_string(it)]));
    }
    script.section("Creates the components.");
    deployed.packages.iter().for_each(|it| write_call(script, "import", &[&lua_string(it)]));
}

fn tasks(script: &mut Script, deployed: &Deployed) {
    script.section(LOADED);
    for Task { name, class, .. } in deployed.in_order() {
        write_call(script, "load", &[&lua_string(name), &lua_string(class)]);
    }
    if deployed.tasks.iter().any(|task| !task.values.is_empty()) {
        script.section(SET);
    }
    for task in &deployed.tasks {
        for (property, value, from_text) in &task.values {
            let [name, property] = [&task.name, property].map(|text| lua_string(text));
            if *from_text {
                let call = format!("task({name}):mauve_set({property}, {})", lua_string(&value.text()));
                step(script, &call, &format!("set {} of {}", property.trim_matches('"'), task.name));
            } else {
                write_call(script, "set", &[&name, &property, &literal(value)]);
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
    script.text += READ;
    for name in names {
        write_call(script, "read", &[&lua_string(name)]);
    }
}

fn connections(script: &mut Script, deployed: &Deployed) {
    if !deployed.connections.is_empty() {
        script.section(CONNECTIONS);
        script.text += CONNECT;
    }
    for ([from, to], buffer) in &deployed.connections {
        let what = lua_string(&connecting(from, to));
        let [from, to] = [from, to].map(|end| lua_string(end));
        match buffer {
            None => write_call(script, "connect", &[&from, &to, "nil", &what]),
            Some(size) => write_call(script, "connect", &[&from, &to, &size.to_string(), &what]),
        }
    }
    if !deployed.operations.is_empty() {
        script.section("Connects the operations: required operation, provided operation.");
    }
    for [required, provided] in &deployed.operations {
        let call = format!("deployer:connectOperations({}, {})", lua_string(required), lua_string(provided));
        step(script, &call, &connecting(required, provided));
    }
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
        let quoted = lua_string(name);
        let arguments = format!("{quoted}, {period}, {priority}, rtt.globals.{scheduler}");
        step(script, &format!("deployer:setActivity({arguments})"), &scheduling(name));
        if activity.priority.is_none() {
            let arguments = format!("{quoted}, rtt.globals.ORO_WAIT_REL");
            step(script, &format!("deployer:setWaitPeriodPolicy({arguments})"), &scheduling(name));
        }
        let mask = affinity.unwrap_or_default();
        if affinity.is_some() {
            step(script, &format!("task({quoted}):setCpuAffinity({mask})"), &pinning(name));
        }
        let call = format!("task({quoted}):mauve_runs_as({priority}, {mask})");
        step(script, &call, &format!("start {name}"));
    }
}

fn streams(script: &mut Script, deployed: &Deployed) {
    let Some(streams) = &deployed.streams else { return };
    let topics: Vec<&[String; 2]> = streams.topics.iter().chain(&streams.shown).collect();
    if !topics.is_empty() || !streams.left_out.is_empty() {
        script.section(STREAMS);
    }
    if !topics.is_empty() {
        script.line("local ros = rtt.provides(\"ros\"):provides(\"comm\")");
    }
    for [port, topic] in topics {
        let call = format!("deployer:stream({}, ros:topic({}))", lua_string(port), lua_string(topic));
        step(script, &call, &streaming(topic));
    }
    script.left_out(streams);
}

fn start(script: &mut Script, deployed: &Deployed) {
    script.section(CONFIGURED);
    for Task { name, .. } in deployed.in_order() {
        step(script, &format!("task({}):configure()", lua_string(name)), &format!("configure {name}"));
    }
    script.section(STARTED);
    script.line("local order = {");
    deployed.in_order().for_each(|task| script.line(&format!("  {},", lua_string(&task.name))));
    script.line("}");
    script.text += START;
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
