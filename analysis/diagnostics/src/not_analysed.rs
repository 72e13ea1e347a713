//! # not-analysed
//!
//! The analysis does not cover an activity, for the reason in the message. Activities that it may preempt are not analysed
//! either: a bound without its interference could be too low.
//!
//! ```mauve
//! codel search(): bool
//! shell S { provide plan(): bool }
//! shell R { require plan(): bool }
//! core C(S) { provide plan() = { return search(); }  update = { } }
//! core E(R) { handler h: plan  update = { h = send(plan); } }
//! component Planner(S, C)
//! component Pilot(R, E)
//! architecture A {
//!   instance planner: Planner
//!   instance pilot: Pilot
//!   operation planner.plan -> pilot.plan
//! }
//! deployment D {
//!   architecture A
//!   activity planner { priority = 1 period = 10 }   // warning
//!   activity pilot { priority = background }
//! }
//! //- /mauve.toml
//! assume.codel = "1 ms"
//! ```
//!
//! A `background` activity has no period: nothing bounds the number of calls that it sends to `plan`, which `planner` executes
//! in its own time. A period for `pilot` bounds it.

use super::*;
use mauve_hir::ros2_files::timer_period;
use mauve_wcrt::Refusal;

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    instance: &str,
    reasons: &[Refusal<'db>],
) -> Diagnostic<'db> {
    let reasons: Vec<String> = reasons.iter().map(|it| timing_reason(db, &it.reason)).collect();
    Diagnostic::new(&NOT_ANALYSED, at, format!("`{instance}` is not analysed: {}", reasons.join("; ")))
}

/// A thread of a file, or this timer of it, that no activity of the deployment has.
pub(super) fn thread_without_activity<'db>(
    at: Location<'db>,
    deployment: &str,
    id: &str,
    timer: Option<&str>,
    has_priority: bool,
) -> Diagnostic<'db> {
    let what = match (timer, has_priority) {
        (Some(codel), _) if timer_period(codel).is_none() => {
            "call a codel of this name in the component of its activity, for the controller of the file".to_owned()
        }
        (Some(timer), _) => {
            let node = id.split('@').next().unwrap_or_default();
            format!("add an activity with `thread = \"{node}@{timer}\"`")
        }
        (None, true) => format!(
            "give its callbacks activities with `thread = \"{id}\"`, or declare `[[platform.other]]` with `name = \"{id}\"`, \
             this priority, its CPUs and how much it executes"
        ),
        (None, false) => "use SCHED_FIFO, for which bounds are known".to_owned(),
    };
    let subject = timer.map_or("this thread".to_owned(), |timer| format!("`{timer}` of this thread"));
    let message = format!("no activity of {deployment} has {subject}, and what it may delay is not analysed: {what}");
    Diagnostic::new(&NOT_ANALYSED, at, message)
}
