//! A simulated schedule in the trace event format, which <https://ui.perfetto.dev> and `chrome://tracing` open.
//!
//! A CPU is a process, and each activity that may use it is a thread of it. A slice is a complete event (`X`), named after the
//! state of the machine; a release and a missed deadline are instants (`i`); the way of data is arrows (`s`, `f`). Times are in microseconds with three decimals, so
//! that they are exact.

use std::collections::HashSet;

use mauve_timing::{CpuSet, Executed, Slice, TaskKind, Time};
use serde_json::{Value, json};

use super::simulation::Simulation;
use crate::trace_events::{arrow, line, process, thread};

/// Returns the document: an event a line.
pub(super) fn text(it: &Simulation<'_>) -> String {
    let mut events: Vec<String> = Vec::new();
    let mut used = CpuSet::NONE;
    for (index, activity) in it.deployment.tasks.activities().iter().enumerate() {
        if it.schedule.statistics.get(index).copied().flatten().is_none() {
            continue;
        }
        let cpus = activity.cpus.unwrap_or_default();
        used |= cpus;
        for cpu in cpus.iter() {
            let Some(priority) = activity.priority.real_time() else { continue };
            let name = format!("{} (priority {priority})", activity.name);
            // Higher priorities are above.
            let (pid, tid) = place(it, cpu, index);
            events.extend(thread(pid, tid, &name, -i64::from(priority)));
        }
    }
    for cpu in used.iter() {
        events.extend(process(cpu + 1, &it.deployment.hosts.names(CpuSet::of(cpu))));
    }
    let tasks = &it.deployment.tasks;
    // Other work, which may change its CPU, and throttling.
    let mut named: HashSet<(u32, usize)> = HashSet::new();
    for slice in &it.schedule.slices {
        if let Some(task) = tasks.all().get(slice.activity)
            && tasks.kind(slice.activity) != TaskKind::Activity
            && named.insert(place(it, slice.cpu, slice.activity))
        {
            let order = task.priority.real_time().map_or(-1000, |priority| -i64::from(priority));
            let (pid, tid) = place(it, slice.cpu, slice.activity);
            events.extend(thread(pid, tid, &tasks.name(slice.activity), order));
        }
        let length = slice.end.checked_sub(slice.start).unwrap_or_default();
        let times = [("ts", nanos(slice.start)), ("dur", nanos(length))];
        let (name, args) = described(it, slice);
        let (pid, tid) = place(it, slice.cpu, slice.activity);
        let event = json!({ "ph": "X", "name": name, "cat": "job", "pid": pid, "tid": tid, "args": args });
        events.push(line(&times, &event));
    }
    for job in &it.schedule.jobs {
        let first = tasks.activities().get(job.activity).and_then(|it| it.cpus?.first());
        let (pid, tid) = place(it, first.unwrap_or_default(), job.activity);
        let mut instant = |name: &str, at: Time| {
            let args = json!({ "job": job.number });
            let event = json!({ "ph": "i", "s": "t", "name": name, "cat": name, "pid": pid, "tid": tid, "args": args });
            events.push(line(&[("ts", nanos(at))], &event));
        };
        instant("release", job.release);
        if job.is_missed {
            instant("deadline missed", job.deadline);
        }
    }
    let of_job = |activity: usize, job: u64| {
        move |slice: &&Slice| {
            slice.activity == activity && slice.job == job && matches!(slice.executed, Executed::Edge(_))
        }
    };
    // The first slice of the job that reads, and the last one of the job that writes.
    let ends = it.passes().iter().flat_map(|pass| {
        let read = it.schedule.slices.iter().find(of_job(pass.task, pass.reads));
        [read, it.schedule.slices.iter().rfind(of_job(pass.task, pass.writes))]
    });
    let mut ends: Vec<&Slice> = ends.flatten().collect();
    ends.dedup();
    let chain = it.way.as_ref().map_or("", |found| &found.chain);
    for (id, pair) in ends.windows(2).enumerate() {
        let [from, to] = pair else { continue };
        let at = |slice: &Slice| {
            let (pid, tid) = place(it, slice.cpu, slice.activity);
            (pid, tid, nanos(slice.start))
        };
        events.extend(arrow(id as u64, chain, [at(from), at(to)]));
    }
    format!("{{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n{}\n]}}\n", events.join(",\n"))
}

/// Returns the numbers of the process and of the thread of an activity on a CPU. Each thread has a number of its own, and none
/// that of a process: viewers take such a thread for the main one.
fn place(it: &Simulation<'_>, cpu: u32, activity: usize) -> (u32, usize) {
    let most_cpus = CpuSet::MOST as usize;
    let threads = it.report.activities.len() + it.report.others().len() + most_cpus;
    (cpu + 1, 1 + most_cpus + cpu as usize * threads + activity)
}

/// The name of a slice, and its arguments.
fn described(it: &Simulation<'_>, slice: &Slice) -> (String, Value) {
    match (it.deployment.edge(slice), it.deployment.call(slice)) {
        (Some((psm, edge)), _) => {
            let programs: Vec<String> = psm.programs_of(edge).map(ToString::to_string).collect();
            let transition = edge.transition.as_ref().map(|name| name.as_str());
            let args = json!({
                "job": slice.job,
                "target": psm.state(edge.target),
                "transition": transition,
                "programs": programs.join(", "),
            });
            (psm.state(edge.source).to_owned(), args)
        }
        (None, Some((operation, client))) => (
            format!("{operation} for {client}"),
            json!({ "job": slice.job, "operation": operation.as_str(), "client": client }),
        ),
        (None, None) => (it.deployment.tasks.name(slice.activity), json!({})),
    }
}

fn nanos(time: Time) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}
