//! What a recording does not say, and what the figures of an import are: lines for a terminal and for the project.

use std::collections::BTreeSet;

use mauve_pwcet::trace::{Ros2Callback, Ros2Release};

use super::recorded::System;
use crate::text::counted;

/// Returns a line for each thing that is not known.
pub(super) fn lines(system: &System<'_>) -> Vec<String> {
    let graph = system.graph;
    let mut lines = Vec::new();
    lines.extend(system.has_recording().then(|| match system.has_elapsed() {
        true => "times are elapsed ones, from begin to end, with what preempted the thread meanwhile: the recording lacks the events \
                 sched_switch of these threads. They are observed, not proved"
            .to_owned(),
        false => "times are CPU times of the threads, by the events sched_switch. They are observed, not proved".to_owned(),
    }));
    let shared = system.executed().filter(|(_, it, _)| !system.has_thread(it)).count();
    if shared > 0 {
        lines.push(format!(
            "not analysed as it is: {} that any of several threads executes, as with a multi-threaded executor. The project gives each \
             callback group a thread, as the callback-isolated executor does",
            counted(shared, "callback"),
        ));
    }
    let count = |is_counted: &dyn Fn(&Ros2Release, Option<u32>) -> bool| {
        system.executed().filter(|(_, it, _)| is_counted(&it.release, it.priority)).count()
    };
    let background = count(&|_, priority| priority.unwrap_or(0) == 0);
    let of_file = system.threads.file.as_ref().map(|_| format!("in {}", system.threads.path));
    lines.extend(match background {
        0 => None,
        all if all == system.executed().count() => Some(format!(
            "no callback has a known real-time priority. Those of `Isolated` are {}",
            of_file.as_deref().unwrap_or("by the deadlines: `mauve tune` searches for better ones")
        )),
        some => Some(format!(
            "{} without a known real-time priority: in the background in `Recorded`, where they have no bound",
            counted(some, "callback")
        )),
    });
    let without = system.executed().filter(|(_, it, _)| system.threads.id(graph, it).is_none());
    let without: Vec<&str> = without.map(|(_, it, _)| it.name.as_str()).collect();
    if system.threads.file.is_some() && !without.is_empty() {
        lines.push(format!(
            "in the background in `Isolated`: {}, for which {} has no entry, or several",
            without.join(", "),
            system.threads.path,
        ));
    }
    if !system.controllers.is_empty() {
        let files: Vec<&str> = system.controllers.iter().map(|it| it.0.as_str()).collect();
        lines.push(format!(
            "not known: the times of the codels of {}, which timing.toml lacks; other controllers that are loaded; asynchronous hardware, \
             whose threads are in the URDF. A control loop has each controller in each cycle, also one with a lower rate: it is due no \
             more often",
            files.join(", "),
        ));
    }
    let services = count(&|release, _| matches!(release, Ros2Release::Service(_)));
    if services > 0 {
        lines.push(format!(
            "assumed: requests of {} come no closer together than in the recording",
            counted(services, "service")
        ));
    }
    let unknown = system.executed().filter_map(|(_, it, _)| match &it.release {
        Ros2Release::Subscription(topic) if !system.knows_writers(it) => Some(topic.as_str()),
        _ => None,
    });
    let topics: BTreeSet<&str> = unknown.collect();
    if !topics.is_empty() {
        lines.push(format!(
            "assumed: messages of {} come no closer together than in the recording: not all of them are published by its callbacks",
            Vec::from_iter(topics).join(", "),
        ));
    }
    if system.executed().any(|(_, it, _)| it.late > 0) {
        lines.push(
            "assumed: a callback that waits for no other one begins no later than in the recording"
                .to_owned(),
        );
    }
    if system.paths.is_empty() {
        let silent: Vec<&str> =
            system.executed().filter(|(_, it, _)| keeps(system, it)).map(|it| it.1.name.as_str()).collect();
        if !silent.is_empty() {
            lines.push(format!(
                "no chain goes through {}: what another callback of the node publishes may depend on it, which an `architecture.yaml` of \
                 CARET says by `named_paths`",
                silent.join(", "),
            ));
        }
    }
    let idle = graph.callbacks.iter().filter(|it| it.executions == 0).count();
    if idle > 0 {
        lines.push(format!(
            "not in the project: {} that the recording never executed",
            counted(idle, "callback")
        ));
    }
    let cut = graph.callbacks.iter().filter(|it| it.executions > 0 && !system.times.contains_key(&it.name));
    let cut: Vec<&str> = cut.map(|it| it.name.as_str()).collect();
    if !cut.is_empty() {
        lines.push(format!("not in the project: {}, without a complete execution", cut.join(", ")));
    }
    if graph.unknown > 0 {
        lines.push(format!(
            "not in the project: {} of callbacks that were made before the recording began. Start it before the nodes",
            counted(usize::try_from(graph.unknown).unwrap_or(usize::MAX), "execution"),
        ));
    }
    lines
}

/// Whether a callback publishes nothing, in a node that publishes.
fn keeps(system: &System<'_>, callback: &Ros2Callback) -> bool {
    let publishes =
        |(_, it, _): (usize, &Ros2Callback, _)| it.node == callback.node && !it.publishes.is_empty();
    // Parameters and the time are of no chain.
    let is_data = matches!(&callback.release, Ros2Release::Subscription(topic) if topic != "/parameter_events" && topic != "/clock");
    is_data && callback.publishes.is_empty() && system.executed().any(publishes)
}
