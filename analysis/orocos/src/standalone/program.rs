//! The main of a deployment: it gives the runtime what a script gives the deployer of Orocos, the response times, and the
//! execution times.
//!
//! ```text
//! robot.instance("pilot", "motion", "motion::Pilot");
//! robot.connect("laser.scan", "pilot.scan");
//! robot.activity("pilot", 100000000, 10, 0x1, 0, 80000000, 7400000);
//! ```

use mauve_hir::{Decl, Value, hosts_of};
use mauve_timing::{CpuSet, Order, Time};
use mauve_wcrt::observed::{ExpectedChain, ExpectedEnd, expected_chains};
use mauve_wcrt::{ExecutionTimes, Query, execution_times, response_times};
use rustc_hash::FxHashMap;

use super::cpu_set::cpu_set;
use super::topics;
use crate::deployment::{BACKGROUND, DeployedTask, RunnableDeployment, is_queue};
use crate::escape::cpp_string;
use crate::generated_file::generated_from;
use crate::library::Model;
use crate::origin::comment_lines;
use crate::template::{filled, lines};
use crate::trace::{codel_key, port_key, program_key};

/// Chains that are not declared, and are followed.
const MOST_CHAINS: usize = 10;

/// Returns the main of a deployment, or of what one host has of it; with the topics of a host, by its index.
pub(super) fn main_file<'db>(
    model: Model<'_, 'db>,
    of: Decl<'db>,
    deployed: &RunnableDeployment,
    topics_of: Option<usize>,
) -> String {
    let Model { db, project, .. } = model;
    let report = response_times(db, project, of, Query::shown(db, project, of));
    // A program executes a queue, which no bound for rounds is about.
    let bounds = report.activities.iter().rev().map(|it| {
        let is_rounds = it.task.order == Order::Rounds;
        (it.instance.to_string(), it.response.filter(|_| !is_rounds))
    });
    let bounds: FxHashMap<String, Option<Time>> = bounds.collect();
    let level = Query::shown(db, project, of).level;
    let hosts = hosts_of(db, project.workspace(db));
    let host = hosts.all.iter().position(|it| Some(&it.name) == deployed.host.as_ref());
    let times = execution_times(db, project, of, host, level);
    let unknown = times.codels.iter().filter(|(_, time)| time.is_none());
    let unknown: Vec<String> = unknown.map(|(codel, _)| codel.qualified(db)).collect();
    let about = deployed.description.trim_end_matches('.');
    let on_host = deployed.host.as_ref().map_or_else(String::new, |host| format!(" on host {host}"));
    let instances = deployed.in_order().map(|DeployedTask { name, class, .. }| {
        let package = class.split("::").next().unwrap_or_default();
        call("instance", &[name, package, class].map(cpp_string))
    });
    let values = deployed.tasks.iter().flat_map(|task| {
        task.values.iter().map(|(property, value, _)| {
            call("value", &[cpp_string(&task.name), cpp_string(property), value_text(value)])
        })
    });
    let connections = deployed.connections.iter().map(|([from, to], buffer)| {
        let ends = [from, to].map(|end| cpp_string(end)).into_iter();
        call("connect", &ends.chain(buffer.map(|size| size.to_string())).collect::<Vec<_>>())
    });
    let operations = deployed.operations.iter();
    let operations = operations.map(|both| call("operation", &both.each_ref().map(|end| cpp_string(end))));
    let threads = deployed.threads();
    let activities = threads.iter().flat_map(|thread| {
        let all = thread.iter().flat_map(|task| activity(task, bounds.get(&task.name).copied()));
        let first = thread.first().map_or("", |first| &first.name);
        let others = thread.iter().skip(1);
        let run_in = if is_queue(thread) { "queue_in" } else { "run_in" };
        all.chain(others.map(move |it| call(run_in, &[cpp_string(&it.name), cpp_string(first)])))
    });
    let is_here = |cpus: CpuSet| host.is_none() || hosts.host(cpus) == host;
    let here = report.others().iter().filter(|it| it.cpus.is_some_and(is_here));
    let others = here.map(|other| {
        let [period, time] =
            [other.period, other.greatest_cost()].map(|it| it.unwrap_or_default().as_nanos());
        let [period, time] = [period, time.saturating_mul(other.burst.max(1))].map(|it| it.to_string());
        let priority = other.priority.real_time().unwrap_or_default().to_string();
        let (_, cpus) = hosts.local(other.cpus.unwrap_or_default());
        let name = other.name.split('@').next().unwrap_or_default();
        let arguments = [cpp_string(name), period, time, priority, cpu_set(cpus)];
        call("other_work", &arguments)
    });
    let ros2 = topics_of.map(|host| topics::calls(model, of, deployed, host, &bounds)).unwrap_or_default();
    let mut chains = expected_chains(db, project, of, Query::shown(db, project, of), MOST_CHAINS);
    // Another host's recording has the rest of a chain.
    let is_here = |instance: &str| deployed.tasks.iter().any(|it| it.name == instance);
    chains.retain(|chain| chain.steps.iter().all(|step| is_here(&step.instance)));
    let about_times = format!(
        "Execution times in ns at the significance level {level}, for the virtual clock and for stubs."
    );
    let filled_in = [
        ("generated", generated_from(&deployed.package)),
        ("description", comment("", &format!("{about}{on_host}, without Orocos."))),
        ("deployment", cpp_string(&deployed.qualified)),
        ("instances", lines(instances)),
        ("values", lines(values)),
        ("connections", lines(connections)),
        ("operations", lines(operations)),
        ("activities", lines(activities)),
        ("headers", ros2.headers),
        ("gateway", ros2.gateway),
        ("topics", ros2.topics),
        ("others", lines(others)),
        ("chains", lines(chains.iter().flat_map(chain))),
        ("level", comment("  ", &about_times)),
        ("times", known_times(model, &times)),
        (
            "unknown",
            match unknown.as_slice() {
                [] => String::new(),
                all => comment("  ", &format!("These codels have no execution time: {}.", all.join(", "))),
            },
        ),
    ];
    filled(include_str!("../../templates/main.cpp"), &filled_in)
}

fn comment(indent: &str, text: &str) -> String {
    lines(comment_lines(text).iter().map(|line| format!("{indent}// {line}")))
}

/// Returns a call of the runtime.
fn call(function: &str, arguments: &[String]) -> String {
    format!("  robot.{function}({});", arguments.join(", "))
}

/// Returns a value as the runtime reads it: a number as C++ writes it, `true` or `false`, or a string as it is.
fn value_text(value: &Value) -> String {
    match value {
        Value::String(text) if text.contains('\0') => {
            format!("std::string({}, {})", cpp_string(text), text.len())
        }
        Value::String(text) => cpp_string(text),
        other => cpp_string(&other.text()),
    }
}

fn activity(task: &DeployedTask, bound: Option<Option<Time>>) -> Vec<String> {
    let (activity, priority) = (&task.activity, task.activity.priority.real_time());
    let nanoseconds =
        |time: Option<Time>| time.map_or("mauve::no_bound".to_owned(), |it| it.as_nanos().to_string());
    let arguments = [
        cpp_string(&task.name),
        task.period().as_nanos().to_string(),
        priority.unwrap_or_default().to_string(),
        activity.cpus.map_or("0".to_owned(), cpu_set),
        activity.offset.unwrap_or_default().as_nanos().to_string(),
        nanoseconds(priority.and(activity.deadline)),
        nanoseconds(bound.flatten()),
    ];
    let about = activity.period.is_none().then(|| comment("  ", BACKGROUND));
    let released_by = task.triggers.iter().map(|port| {
        let (burst, needs_all) = (activity.burst.max(1).to_string(), task.needs_all.to_string());
        call("release_by", &[cpp_string(&task.name), cpp_string(port), burst, needs_all])
    });
    let not_preempted = activity.is_not_preempted.then(|| call("not_preempted", &[cpp_string(&task.name)]));
    about.into_iter().chain([call("activity", &arguments)]).chain(released_by).chain(not_preempted).collect()
}

/// Returns the calls for a chain.
fn chain(chain: &ExpectedChain) -> Vec<String> {
    let end = |end: &ExpectedEnd| cpp_string(&end.text());
    let bound = chain.bound.map_or("mauve::no_bound".to_owned(), |bound| bound.to_string());
    let limit = chain.limit.unwrap_or_default().to_string();
    let mut all = vec![call("chain", &[cpp_string(&chain.name), bound, limit])];
    for step in &chain.steps {
        let instance = || cpp_string(&step.instance);
        all.push(call("step", &[instance(), end(&step.from), end(&step.to)]));
        all.extend(step.states.iter().map(|it| call("assume_state", &[instance(), cpp_string(it)])));
        all.extend(step.answers.iter().map(|it| call("assume_answer", &[instance(), end(it)])));
    }
    all
}

/// Returns the execution times that are known.
fn known_times<'db>(model: Model<'_, 'db>, times: &ExecutionTimes<'db>) -> String {
    let codels = times.codels.iter().filter_map(|(codel, time)| {
        Some(call("codel_time", &[codel_key(model.db, *codel), (*time)?.as_nanos().to_string()]))
    });
    let waits = times
        .waits
        .iter()
        .map(|(codel, time)| call("codel_wait", &[codel_key(model.db, *codel), time.as_nanos().to_string()]));
    let programs = times.programs.iter().map(|(component, program, time)| {
        let key = program_key(model.db, *component, program);
        call("program_time", &[key, time.as_nanos().to_string()])
    });
    let accesses = times.accesses.iter().map(|(component, port, time)| {
        call("access_time", &[port_key(model.db, *component, port), time.as_nanos().to_string()])
    });
    let overhead =
        (times.overhead > Time::ZERO).then(|| call("overhead", &[times.overhead.as_nanos().to_string()]));
    lines(codels.chain(waits).chain(programs).chain(accesses).chain(overhead))
}
