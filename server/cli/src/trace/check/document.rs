//! A recording beside its model as one JSON document.
//!
//! ```json
//! {
//!   "deployment": "Robot", "unit": "ms", "significance": 0.0001, "traces": ["recording"], "fails": true,
//!   "recording": {
//!     "begin_ns": 1795402383698441889, "end_ns": 1795402393698441889, "events": 4000, "lost_events": 0, "incomplete": 0,
//!     "measured": true, "periods": true, "releases": false, "programs": true, "scheduling": true
//!   },
//!   "instances": [
//!     {
//!       "instance": "pilot", "component": "lib.Pilot", "verdict": "fails", "periods": 100, "interval": 100.01, "period": 100,
//!       "response": 71.2, "response_at_ns": 1795402384000000000, "response_is_lower_bound": true, "bound": 60, "deadline": 100,
//!       "jitter": 12.5, "execution": 41.1, "overhead": 0.012, "greatest_edge": 45,
//!       "priority": 2, "priorities": [{ "priority": 2, "periods": 100 }],
//!       "affinity": 1, "affinities": [{ "affinity": 1, "periods": 100 }], "cpus": [{ "affinity": 1, "periods": 100 }],
//!       "pauses": 0,
//!       "edges": [{ "source": "Idle", "transition": "go", "target": "Moving", "observed": 3, "possible": 3 }],
//!       "codels_not_observed": ["lib.plan"]
//!     }
//!   ],
//!   "times": [
//!     {
//!       "key": "lib.work", "kind": "codel", "time": 3, "executions": 5000, "exceeded": 0, "expected": 0.5, "probability": 1, "fails_at": null,
//!       "longest": 2.7, "longest_at_ns": 1795402384000000000, "instance": "pilot"
//!     }
//!   ],
//!   "chains": [{ "chain": "avoid", "latency": 412, "latency_at_ns": 1795402384000000000, "bound": 526, "limit": 600 }],
//!   "connections": [{ "connection": "laser.scan -> pilot.scan", "written": 1000, "read": 500, "unread": 499 }],
//!   "findings": [
//!     { "instance": "pilot", "code": "response", "count": 2, "at_ns": 1795402384000000000, "message": "…" }
//!   ]
//! }
//! ```
//!
//! - `verdict`: `as-modelled`, `fails` or `not-observed`.
//! - `recording`: whether the recording has periods, their releases, programs, and the priorities and CPUs of threads. `incomplete`
//!   counts executions that were not recorded completely.
//! - A figure that the recording or the model does not have is null. Times with `_ns` are those of the recording, in nanoseconds.
//! - `edges`: how often each edge of the state machine was executed; `possible` also counts periods in which another edge with the
//!   same programs may have been executed. `transition` is null where the machine stays in its state.
//! - `latency`: the greatest one observed, at least. `unread`: values that were overwritten, or dropped from a full buffer, before they were read.
//! - `expected`: the number of executions that exceed the time on average, at this level; `probability`: that of as many as
//!   `exceeded` or more; `fails_at`: the level of the tables at which so many are improbable (below 0.001), which is a finding.

use mauve_projects::analysis_document;
use mauve_projects::json::object;
use mauve_pwcet::trace::{SpanKind, port_of};
use mauve_timing::{CpuSet, Time};
use mauve_wcrt::observed::{ExpectedInstance, IMPROBABLE, ObservedInstance};
use serde::Serialize;
use serde_json::{Value, json};

use super::checked::Checked;
use super::findings::{code, instance, message};

pub(super) fn document(it: &Checked<'_>) -> impl Serialize + use<> {
    let summary = &it.summary;
    let observed = &it.observed;
    let instances = it.expected.instances.iter().zip(&observed.instances).enumerate();
    object! {
        deployment: it.name.clone(),
        [times_of]: it.report.times.as_ref().map(ToString::to_string),
        unit: "ms",
        significance: it.level.as_f64(),
        traces: it.traces.clone(),
        fails: !it.is_fine(),
        recording: object! {
            begin_ns: summary.first,
            end_ns: summary.last,
            events: summary.events,
            lost_events: summary.lost_events,
            incomplete: summary.dropped + summary.unbalanced + summary.clock_errors,
            measured: !summary.is_from_tables,
            periods: observed.has_periods,
            releases: observed.has_releases,
            programs: observed.has_programs,
            scheduling: observed.has_scheduling,
        },
        instances: instances.map(|(index, (expected, observed))| of_instance(it, index, expected, observed)).collect::<Vec<_>>(),
        times: observed.times.iter().map(|time| object! {
            key: port_of(&time.key).unwrap_or(&time.key).to_owned(),
            kind: match SpanKind::of(&time.key) {
                SpanKind::Program => "program",
                SpanKind::Access => "port",
                _ => "codel",
            },
            time: milliseconds(time.time),
            executions: time.executions,
            exceeded: time.exceeded,
            expected: time.executions as f64 * it.expected.level,
            probability: time.probability,
            fails_at: time.worst.filter(|it| it.probability < IMPROBABLE).map(|it| it.level),
            longest: milliseconds(time.greatest.map(|it| it.time)),
            longest_at_ns: time.greatest.and_then(|it| it.at),
            instance: Some(time.instance.clone()).filter(|it| !it.is_empty()),
        }).collect::<Vec<_>>(),
        chains: it.expected.chains.iter().zip(&observed.chains).map(|(chain, seen)| object! {
            chain: chain.name.clone(),
            latency: milliseconds(seen.greatest.map(|it| it.time)),
            latency_at_ns: seen.greatest.and_then(|it| it.at),
            bound: milliseconds(chain.bound),
            limit: milliseconds(chain.limit),
        }).collect::<Vec<_>>(),
        connections: it.expected.connections.iter().zip(&observed.connections).map(|(connection, seen)| object! {
            connection: connection.name.clone(),
            written: seen.written,
            read: seen.read,
            unread: seen.unread,
        }).collect::<Vec<_>>(),
        findings: observed.findings.iter().map(|finding| object! {
            instance: instance(it, finding).map(str::to_owned),
            code: code(&finding.kind),
            count: finding.count,
            at_ns: finding.at,
            message: message(it, finding),
        }).collect::<Vec<_>>(),
    }
}

fn of_instance(
    it: &Checked<'_>,
    index: usize,
    expected: &ExpectedInstance,
    observed: &ObservedInstance,
) -> impl Serialize + use<> {
    let fails = it.observed.findings.iter().any(|finding| finding.instance == Some(index));
    let state =
        |machine: &mauve_wcrt::observed::ExpectedMachine, state: usize| machine.states.get(state).cloned();
    let edges = expected.machine.iter().flat_map(|machine| {
        machine.edges.all.iter().zip(&observed.edges).map(|(edge, count)| {
            json!({
                "source": state(machine, edge.source),
                "transition": edge.transition.as_ref().map(ToString::to_string),
                "target": state(machine, edge.target),
                "observed": count.observed,
                "possible": count.possible,
            })
        })
    });
    let on_cpus = |(cpus, periods): (CpuSet, u64)| json!({ "affinity": cpus, "periods": periods });
    object! {
        instance: expected.instance.clone(),
        component: expected.component.clone(),
        verdict: match (observed.is_observed, fails) {
            (false, _) => "not-observed",
            (true, true) => "fails",
            (true, false) => "as-modelled",
        },
        periods: observed.periods,
        interval: milliseconds(observed.interval),
        period: milliseconds(expected.period),
        response: milliseconds(observed.response.map(|it| it.time)),
        response_at_ns: observed.response.and_then(|it| it.at),
        response_is_lower_bound: !it.observed.has_releases,
        bound: milliseconds(expected.response),
        deadline: milliseconds(expected.deadline),
        jitter: milliseconds(observed.jitter),
        execution: milliseconds(observed.execution.map(|it| it.time)),
        // Of a period, besides its codels and ports.
        overhead: milliseconds(observed.overhead),
        greatest_edge: milliseconds(expected.own),
        priority: expected.priority.real_time(),
        priorities: observed.priorities.iter().map(|(priority, it)| json!({ "priority": priority, "periods": it.periods })).collect::<Vec<_>>(),
        affinity: expected.cpus,
        affinities: observed.masks.iter().map(|(cpus, it)| on_cpus((*cpus, it.periods))).collect::<Vec<_>>(),
        cpus: observed.cpus.iter().map(|(cpu, it)| on_cpus((CpuSet::of(*cpu), it.periods))).collect::<Vec<_>>(),
        pauses: observed.pauses,
        edges: edges.collect::<Vec<_>>(),
        codels_not_observed: observed.codels_not_observed.clone(),
    }
}

fn milliseconds(nanoseconds: Option<u64>) -> Option<Value> {
    nanoseconds.map(|time| analysis_document::milliseconds(Time::from_nanos(time)))
}
