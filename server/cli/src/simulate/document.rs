//! A simulated schedule as one JSON document.
//!
//! ```json
//! {
//!   "deployment": "Robot", "unit": "ms", "significance": 0.0001, "seed": 1, "end": 1000,
//!   "activities": [
//!     {
//!       "instance": "pilot", "component": "Pilot", "affinity": 1, "priority": 2, "period": 100, "deadline": 100,
//!       "status": "met", "jobs": 10, "unfinished": 0, "misses": 0, "greatest": 52.25, "average": 47.5, "bound": 60,
//!       "reasons": []
//!     }
//!   ],
//!   "jobs": [
//!     { "instance": "pilot", "job": 1, "nominal": 17, "release": 17, "deadline": 117, "end": 64.5, "missed": false }
//!   ],
//!   "slices": [
//!     {
//!       "instance": "pilot", "job": 1, "cpu": 1, "start": 17, "end": 64.5,
//!       "source": "Idle", "transition": "go", "target": "Moving", "programs": ["Idle.run", "Idle.go.guard"],
//!       "operation": null, "client": null
//!     }
//!   ]
//! }
//! ```
//!
//! - `times`: the section with its own timing tables; only where it has one.
//! - `end`: the simulated time, from 0.
//! - `worst`, with `--worst`: `{ "instance": "pilot", "job": 1, "bound": 60, "response": 60 }`, the job of the instance that responds
//!   late, its bound, and its response in this schedule.
//! - `way`, with `--worst-chain`: `{ "chain": "avoid", "latency": 480, "bound": 526, "schedules": 240, "passes": [...] }`, the longest
//!   way of data that was found in so many schedules. Of each instance that it passes, `{ "instance": "laser", "arrival": 20, "reads": 2,
//!   "writes": 3, "write": 45.5 }`: the instant at which data arrives, the jobs that read and write it, and the end of the write.
//! - `status`: `met`; `missed` where a job did not end at its deadline or before; `background` and `not-simulated` for activities
//!   that are left out. Their `jobs`, `unfinished`, `misses`, `greatest` and `average` are null, and `reasons` says why.
//! - `bound`: the worst-case response time; null without one.
//! - `nominal`: the instant from which the response time and the deadline count; `release` is later by the jitter. The `end` of an
//!   unfinished job is null.
//! - `cpu`: the mask with the bit of the CPU, as in `affinity`.
//! - `source`, `transition`, `target`, `programs`: the path of the job; `transition` is null where the machine stays in its
//!   state. Where a slice executes a call of an operation, they are null, `operation` is its name, and `client` is the instance
//!   that sent it; otherwise these are null. `instance`
//!   is null where a slice is real-time throttling.

use mauve_diagnostics::reasons_of;
use mauve_projects::analysis_document::milliseconds;
use mauve_projects::json::object;
use mauve_timing::{CpuSet, Job, LeftOut, Pass, Slice};
use mauve_wcrt::ActivityReport;
use serde::Serialize;

use super::simulation::{Simulation, SimulationRow};

pub(super) fn document(it: &Simulation<'_>) -> impl Serialize + use<> {
    object! {
        deployment: it.name.clone(),
        // The section with its own timing tables, where it has one.
        [times]: it.report.times.as_ref().map(ToString::to_string),
        unit: "ms",
        significance: it.level.as_f64(),
        seed: it.options.seed,
        end: milliseconds(it.schedule.end),
        [worst]: it.worst.as_ref().map(|worst| {
            object! {
                instance: it.instance(worst.activity),
                job: worst.case.job,
                bound: milliseconds(worst.case.bound),
                response: worst.response(&it.schedule).map(milliseconds),
            }
        }),
        [way]: it.way.as_ref().map(|found| {
            object! {
                chain: found.chain.clone(),
                latency: milliseconds(found.way.latency()),
                bound: milliseconds(found.bound),
                schedules: found.way.schedules,
                passes: found.way.passes.iter().map(|pass| pass_document(it, pass)).collect::<Vec<_>>(),
            }
        }),
        activities: it.rows().map(|row| activity_document(it, &row)).collect::<Vec<_>>(),
        jobs: it.schedule.jobs.iter().map(|job| job_document(it, job)).collect::<Vec<_>>(),
        slices: it.schedule.slices.iter().map(|slice| slice_document(it, slice)).collect::<Vec<_>>(),
    }
}

fn pass_document(of: &Simulation<'_>, pass: &Pass) -> impl Serialize + use<> {
    object! {
        instance: of.instance(pass.task),
        arrival: milliseconds(pass.arrival),
        reads: pass.reads,
        writes: pass.writes,
        write: milliseconds(pass.write),
    }
}

fn activity_document(of: &Simulation<'_>, row: &SimulationRow<'_, '_>) -> impl Serialize + use<> {
    let ActivityReport { task, instance, component_name, response, .. } = row.activity;
    let statistics = row.statistics;
    let status = match (statistics, row.left_out) {
        (Some(it), _) if it.misses == 0 => "met",
        (Some(_), _) => "missed",
        (None, Some(LeftOut::Background)) => "background",
        (None, _) => "not-simulated",
    };
    let reasons = if statistics.is_none() { reasons_of(of.db, row.activity) } else { Vec::new() };
    object! {
        instance: instance.to_string(),
        component: component_name.to_string(),
        affinity: task.cpus,
        priority: task.priority.real_time(),
        period: task.period.map(milliseconds),
        deadline: task.deadline.map(milliseconds),
        status: status,
        jobs: statistics.map(|it| it.jobs),
        unfinished: statistics.map(|it| it.unfinished),
        misses: statistics.map(|it| it.misses),
        greatest: statistics.and_then(|it| it.greatest).map(milliseconds),
        average: statistics.and_then(|it| it.average).map(milliseconds),
        bound: response.map(milliseconds),
        reasons: reasons,
    }
}

fn job_document(of: &Simulation<'_>, job: &Job) -> impl Serialize + use<> {
    object! {
        instance: of.instance(job.activity),
        job: job.number,
        nominal: milliseconds(job.nominal),
        release: milliseconds(job.release),
        deadline: milliseconds(job.deadline),
        end: job.end.map(milliseconds),
        missed: job.is_missed,
    }
}

fn slice_document(of: &Simulation<'_>, slice: &Slice) -> impl Serialize + use<> {
    let (edge, call) = (of.deployment.edge(slice), of.deployment.call(slice));
    object! {
        instance: of.instance(slice.activity),
        job: slice.job,
        cpu: CpuSet::of(slice.cpu),
        start: milliseconds(slice.start),
        end: milliseconds(slice.end),
        source: edge.map(|(psm, it)| psm.state(it.source).to_owned()),
        transition: edge.and_then(|(_, it)| it.transition.as_ref()).map(ToString::to_string),
        target: edge.map(|(psm, it)| psm.state(it.target).to_owned()),
        programs: edge.map(|(psm, it)| psm.programs_of(it).map(ToString::to_string).collect::<Vec<_>>()),
        operation: call.map(|(operation, _)| operation.to_string()),
        client: call.map(|(_, client)| client.to_owned()),
    }
}
