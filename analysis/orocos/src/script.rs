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
use mauve_timing::CpuSet;

use crate::deployment::{BACKGROUND, DeployedTask, RunnableDeployment, TopicStreams, is_queue};
use crate::escape::lua_string;
use crate::generated_file::generated_from;
use crate::origin::comment_lines;
use crate::template::{filled, flag, lines};

pub(crate) fn script(deployed: &RunnableDeployment) -> String {
    if let Some(queue) = deployed.threads().iter().find(|thread| is_queue(thread)) {
        return refusal(deployed, queue);
    }
    let streams = deployed.streams.as_ref();
    let with_values = deployed.in_order().filter(|task| task.has_values);
    let operations = deployed.operations.iter().map(|[required, provided]| {
        let call = format!("deployer:connectOperations({}, {})", lua_string(required), lua_string(provided));
        step(&call, &connecting(required, provided))
    });
    let configured = deployed.in_order().map(|DeployedTask { name, .. }| {
        step(&format!("task({}):configure()", lua_string(name)), &format!("configure {name}"))
    });
    let instances = deployed.in_order();
    let instances = instances
        .map(|DeployedTask { name, class, .. }| format!("load({}, {})", lua_string(name), lua_string(class)));
    let values = [
        ("generated", generated_from(&deployed.package)),
        ("description", comment(&deployed.description)),
        ("ros", streams.map_or_else(String::new, ros_packages)),
        ("packages", lines(deployed.packages.iter().map(|it| import(it)))),
        ("instances", lines(instances)),
        ("set", lines(deployed.tasks.iter().flat_map(set_values))),
        ("read", lines(with_values.map(|task| format!("read({})", lua_string(&task.name))))),
        ("connections", connections(deployed)),
        ("operations", lines(operations)),
        ("triggers", lines(deployed.tasks.iter().flat_map(triggers))),
        ("activities", lines(deployed.threads().iter().flat_map(|thread| activities(thread)))),
        ("topics", flag(streams.is_some_and(|it| it.all_topics().next().is_some()))),
        ("streams", streams.map_or_else(String::new, streamed)),
        ("configured", lines(configured)),
        ("order", lines(deployed.in_order().map(|task| format!("  {},", lua_string(&task.name))))),
    ];
    filled(include_str!("../templates/deployment.lua"), &values)
}

/// Returns the script of a deployment with a queue, which Orocos would execute in another order: it runs nothing.
fn refusal(deployed: &RunnableDeployment, queue: &[&DeployedTask]) -> String {
    let names: Vec<&str> = queue.iter().map(|task| task.name.as_str()).collect();
    let message = format!(
        "Cannot execute {} in the order of their releases: no thread of Orocos does. Use `mauve run`, or `mauve \
         generate --standalone`.\nNothing runs.",
        names.join(", ")
    );
    format!(
        "-- {}\n--\n{}\n\nerror({}, 0)\n",
        generated_from(&deployed.package),
        comment(&deployed.description),
        lua_string(&message)
    )
}

/// Returns a step, with the message if it fails.
fn step(call: &str, what: &str) -> String {
    format!("worked({call}, {})", lua_string(what))
}

fn comment(text: &str) -> String {
    lines(comment_lines(text).iter().map(|line| format!("-- {line}")))
}

fn import(package: &str) -> String {
    format!("import({})", lua_string(package))
}

fn connecting(one: &str, other: &str) -> String {
    format!("connect {one} and {other}")
}

/// Returns the imports of ROS and of the types of messages.
fn ros_packages(streams: &TopicStreams) -> String {
    let packages = streams.packages.iter().map(String::as_str);
    lines(["rtt_ros", "rtt_rosnode", "rtt_roscomm"].into_iter().chain(packages).map(import))
}

fn set_values(task: &DeployedTask) -> impl Iterator<Item = String> {
    task.values.iter().map(|(property, value, from_text)| {
        let (name, known) = (lua_string(&task.name), lua_string(property));
        if !from_text {
            return format!("set({name}, {known}, {})", literal(value));
        }
        let call = format!("task({name}):mauve_set({known}, {})", lua_string(&value.text()));
        step(&call, &format!("set {property} of {}", task.name))
    })
}

fn connections(deployed: &RunnableDeployment) -> String {
    lines(deployed.connections.iter().map(|([from, to], buffer)| {
        let size = buffer.map_or("nil".to_owned(), |size| size.to_string());
        let [from, to, what] = [from, to, &connecting(from, to)].map(|it| lua_string(it));
        format!("connect({from}, {to}, {size}, {what})")
    }))
}

/// Returns the steps that let data release an instance.
fn triggers(task: &DeployedTask) -> impl Iterator<Item = String> {
    let (name, what) = (lua_string(&task.name), format!("let data release {}", task.name));
    let (least, burst) = (task.seconds(), task.activity.burst.max(1));
    let calls = task.triggers.iter().map(move |port| {
        format!("task({name}):mauve_released_by({}, {least}, {burst}, {})", lua_string(port), task.needs_all)
    });
    calls.map(move |call| step(&call, &what))
}

/// Returns the steps that give the instances of a thread their activities: the last one executes the others before itself.
fn activities(thread: &[&DeployedTask]) -> Vec<String> {
    let Some((last, others)) = thread.split_last() else { return Vec::new() };
    let mut all = activity(last);
    for other in others {
        let (master, slave) = (lua_string(&last.name), lua_string(&other.name));
        let what = format!("execute {} in the thread of {}", other.name, last.name);
        all.push(step(&format!("deployer:setMasterSlaveActivity({master}, {slave})"), &what));
        all.push(step(&format!("task({master}):mauve_executes({slave})"), &what));
    }
    all.extend(thread.iter().filter(|task| task.activity.is_not_preempted).map(|task| {
        let call = format!("task({}):mauve_is_not_preempted()", lua_string(&task.name));
        step(&call, &format!("give {} the highest priority", task.name))
    }));
    all.extend(thread.iter().map(|task| {
        let priority = task.activity.priority.real_time().unwrap_or_default();
        let mask = task.activity.cpus.and_then(mask).unwrap_or_default();
        let call = format!("task({}):mauve_runs_as({priority}, {mask})", lua_string(&task.name));
        step(&call, &format!("start {}", task.name))
    }));
    all
}

/// Returns the steps that give an instance a thread.
fn activity(task: &DeployedTask) -> Vec<String> {
    let DeployedTask { name, activity, .. } = task;
    let mut all = Vec::new();
    if activity.period.is_none() && task.triggers.is_empty() {
        all.push(comment(BACKGROUND));
    }
    let real_time = activity.priority.real_time();
    let scheduler = if real_time.is_some() { "ORO_SCHED_RT" } else { "ORO_SCHED_OTHER" };
    // What data releases has no period.
    let period = if task.triggers.is_empty() { task.seconds() } else { "0.0".to_owned() };
    let priority = real_time.unwrap_or_default();
    let (quoted, what) = (lua_string(name), format!("create the activity of {name}"));
    let arguments = format!("{quoted}, {period}, {priority}, rtt.globals.{scheduler}");
    all.push(step(&format!("deployer:setActivity({arguments})"), &what));
    if real_time.is_none() {
        let call = format!("deployer:setWaitPeriodPolicy({quoted}, rtt.globals.ORO_WAIT_REL)");
        all.push(step(&call, &what));
    }
    if let Some(cpus) = activity.cpus {
        let what = format!("set the CPU affinity of {name}: do these CPUs exist?");
        let call = mask(cpus).map_or_else(
            || {
                let numbers: Vec<String> = cpus.iter().map(|cpu| cpu.to_string()).collect();
                format!("mauve_runs_on({})", lua_string(&numbers.join(", ")))
            },
            |mask| format!("setCpuAffinity({mask})"),
        );
        all.push(step(&format!("task({quoted}):{call}"), &what));
    }
    all
}

/// Returns the mask of these CPUs, if Orocos has a bit for each: it has 32.
fn mask(cpus: CpuSet) -> Option<u32> {
    u32::try_from(cpus.0).ok()
}

/// Returns the topics of ports, and comments about the ports that have none.
fn streamed(streams: &TopicStreams) -> String {
    let topics = streams.all_topics().map(|[port, topic]| {
        let call = format!("deployer:stream({}, ros:topic({}))", lua_string(port), lua_string(topic));
        step(&call, &format!("create topic {topic}: is roscore running?"))
    });
    let left_out = streams.left_out.iter();
    let left_out =
        left_out.map(|port| comment(&format!("{port} is not streamed: its type is not a message.")));
    lines(topics.chain(left_out))
}

fn literal(value: &Value) -> String {
    match value {
        Value::String(text) => lua_string(text),
        other => other.text(),
    }
}
