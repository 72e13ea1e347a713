//! # deadline-missed
//!
//! The worst-case response time of an activity exceeds its deadline, or is unbounded, at the significance level of
//! `mauve.toml` (1e-4 by default).
//!
//! ```mauve
//! codel work(): int
//! shell S { }
//! core C(S) { update = { work(); } }
//! component Laser(S, C)
//! architecture A { instance front: Laser  instance back: Laser }
//! deployment D {
//!   architecture A
//!   activity front { priority = 2 period = 10 }
//!   activity back { priority = 1 period = 10 deadline = 9 }   // error
//! }
//! //- /mauve.toml
//! [assume]
//! codel = "5 ms"
//! ```
//!
//! Where the utilisation of a CPU exceeds 100 %, the response times of some of its activities are unbounded. That is one
//! message for the CPU, at the unbounded activity with the highest priority: with the activities of higher priority, it overloads the CPU.
//! The other unbounded activities are related locations of the message. Where the execution time of one activity alone exceeds its
//! period, the message is there, and one of its times is probably in another unit than its table says.
//!
//! ```mauve
//! codel work(): int
//! shell S { }
//! core C(S) { update = { work(); } }
//! component Imu(S, C)
//! architecture A { instance imu: Imu  instance log: Imu }
//! deployment D {
//!   architecture A
//!   activity imu { priority = 2 period = 4 }   // error
//!   activity log { priority = 1 period = 1000 }
//! }
//! //- /mauve.toml
//! [timing]
//! tables = ["imu.toml"]
//! //- /imu.toml
//! [codel]
//! work = 220   # warning
//! ```
//!
//! Where the execution time of an activity alone exceeds its deadline, no priority helps: shorten a codel, or lengthen the
//! deadline.
//!
//! A bound is safe, not exact: a job may never take so long. Raise the priority of the activity, lengthen the period of what
//! preempts it, move one of them to another CPU, or shorten a codel. `mauve wcrt --explain INSTANCE` shows the interference.
//! An editor offers such changes, each with the response times that it gives: first other priorities and CPUs, then longer periods
//! and a later deadline, which relax what the model requires. `mauve tune --priorities --cpus` searches for all values together.

use super::figure::{Forms, TIGHT_SLACK};
use super::*;
use mauve_timing::THROTTLING;
use mauve_wcrt::{Missed, Overload, Unbounded, file_name};

pub(super) fn report<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    name: &str,
    deadline: Time,
    missed: &Missed<'db>,
) -> Diagnostic<'db> {
    let message = match missed {
        Missed::Alone { own, wait: Time::ZERO } => format!(
            "`{name}` misses its deadline: its own execution time of {own} exceeds the deadline of {deadline}"
        ),
        Missed::Alone { own, wait } => {
            let execution = own.checked_sub(*wait).unwrap_or_default();
            format!(
                "`{name}` misses its deadline: its own execution time of {execution} and the waits of {wait} exceed the \
                 deadline of {deadline}"
            )
        }
        Missed::Late { response, heaviest, blocking, window } => {
            let of_what = window.map_or_else(String::new, |(job, length)| {
                format!(" in the busy window of {length}, {job} jobs of `{name}`")
            });
            let heaviest = match heaviest {
                None => String::new(),
                Some(it) if it.instance == THROTTLING => format!(
                    "; real-time throttling adds {}{of_what}: set `kernel.sched_rt_runtime_us=-1` and \
                     `[platform] rt_throttling = false`",
                    it.time
                ),
                Some(it) => {
                    let jobs = if it.jobs == 1 { "job" } else { "jobs" };
                    format!("; largest interference: `{}`, {} ({} {jobs}){of_what}", it.instance, it.time, it.jobs)
                }
            };
            let blocking = match *blocking {
                Time::ZERO => String::new(),
                blocking => format!("; lower priorities that hold locks delay it by {blocking}"),
            };
            let figure = Forms::of(*response, deadline, TIGHT_SLACK);
            format!("`{name}` misses its deadline: {}{heaviest}{blocking}", figure.text())
        }
        Missed::NoBound(reasons) => {
            let reasons: Vec<String> = reasons.iter().map(|it| timing_reason(db, &it.reason)).collect();
            format!("`{name}` is not proved to meet its deadline of {deadline}: {}", reasons.join("; "))
        }
    };
    Diagnostic::new(&DEADLINE_MISSED, at, message)
}

/// Returns the key of a measured entry, and how many times its longest execution its time is, where MAUVE's estimate is that far away:
/// then no unit is wrong.
fn far_estimate(db: &dyn ModelDb, at: &Location<'_>) -> Option<(String, u64)> {
    let (found, start) = (mauve_wcrt::table(db, at.file(db)), usize::from(at.range(db).start()));
    let entry = found.entries().find(|it| it.key_span.contains(&start) || it.value_span.contains(&start))?;
    let record = found.measured.iter().find(|it| it.key == entry.key && Some(&it.times) == entry.value.as_ref())?;
    let times = record.times.greatest().as_nanos().checked_div(record.greatest.as_nanos())?;
    (times >= 10).then(|| (entry.key.clone(), times))
}

/// One diagnostic for an overloaded CPU. The other activities without a bound are related locations.
pub(super) fn overloaded<'db>(
    db: &'db dyn ModelDb,
    at: Location<'db>,
    overload: &Overload<'db>,
) -> Diagnostic<'db> {
    let greatest = &overload.greatest;
    let why = match &overload.alone {
        Some((own, period)) => {
            // A wrong unit is wrong by a thousand.
            let is_unit_wrong = own.as_nanos() / 10 >= period.as_nanos();
            let table = overload.table.as_ref().filter(|_| is_unit_wrong);
            let table = table.map(|table| match far_estimate(db, table) {
                Some((key, times)) => format!(": the estimate of `{key}` is {times} times its longest execution: record more of it"),
                None => format!(": is the unit of `{}` right?", file_name(db, table.file(db))),
            });
            let table = table.unwrap_or_default();
            format!("the execution time of `{greatest}` alone, {own}, exceeds its period of {period}{table}")
        }
        None => {
            // Not more than 100 %: alone it would have a bound.
            let share = overload.share.map_or_else(String::new, |it| format!(" ({:.1} %)", it.0 * 100.0));
            format!("`{greatest}` contributes most{share}")
        }
    };
    let cpu = reasons::overloaded(&overload.named, overload.priority, overload.utilisation);
    // The message has the period of the activity that overloads the CPU alone.
    let alone =
        |it: &Unbounded<'db>| it.alone.filter(|_| overload.alone.is_none() || it.instance != *greatest);
    let here = overload.unbounded.iter().find(|it| it.at == at).and_then(|it| Some((&it.instance, alone(it)?)));
    let here = here.map_or_else(String::new, |(name, (own, deadline))| {
        format!("; the execution time of `{name}` alone, {own}, exceeds its deadline of {deadline}")
    });
    let found = Diagnostic::new(&DEADLINE_MISSED, at.clone(), format!("{cpu}; {why}{here}"));
    let others = overload.unbounded.iter().filter(|it| it.at != at);
    others.fold(found, |found, it| {
        let misses = alone(it).map_or_else(String::new, |(own, deadline)| {
            format!(": also, its execution time of {own} alone exceeds its deadline of {deadline}")
        });
        found.related(&it.at, format!("`{}` has no bounded response time{misses}", it.instance))
    })
}
