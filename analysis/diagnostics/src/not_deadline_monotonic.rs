//! # not-deadline-monotonic
//!
//! On one CPU, an activity with a shorter deadline has a lower priority than one with a longer deadline. Where deadlines are
//! not longer than periods, priorities in the order of deadlines are the best fixed priorities (Leung and Whitehead, 1982).
//!
//! ```mauve
//! shell ControlShell { }
//! core ControlCore(ControlShell) { update = { } }
//! component Control(ControlShell, ControlCore)
//! architecture Robot { instance guidance: Control  instance control: Control  instance log: Control }
//! deployment Bench {
//!   architecture Robot
//!   activity guidance { priority = 6 period = 100 affinity = 1 }
//!   activity control { priority = 5 period = 50 affinity = 1 }   // warning
//!   activity log { priority = 4 period = 10 affinity = 2 }
//! }
//! ```
//!
//! Only the activities that are out of order are reported: the fewest whose priorities must change.
//!
//! Fix: give the activity a free priority that is in order. An editor also offers to swap the two priorities, and to set all
//! priorities by deadline, with the response times that result. `mauve tune --priorities` searches for all
//! priorities together. This code was called `priority-inversion`.

use super::*;
use mauve_wcrt::DeadlineAndPriority;

pub(super) fn report<'db>(
    at: Location<'db>,
    activity: &DeadlineAndPriority,
    other: &DeadlineAndPriority,
    other_at: &Location<'db>,
    free: Option<u32>,
) -> Diagnostic<'db> {
    let is_shorter = activity.deadline < other.deadline;
    let (deadline, less, priority, more) =
        if is_shorter { ("shorter", "<", "lower", "<") } else { ("longer", ">", "higher", ">") };
    let message = format!(
        "`{}` has a {deadline} deadline than `{}` ({} {less} {}) but a {priority} priority ({} {more} {})",
        activity.instance,
        other.instance,
        without_unit(activity.deadline, other.deadline),
        other.deadline,
        activity.priority,
        other.priority,
    );
    let found = Diagnostic::new(&NOT_DEADLINE_MONOTONIC, at.clone(), message);
    let found = found.related(other_at, format!("the priority of `{}`", other.instance));
    match free {
        Some(free) => {
            found.fix(format!("Give {} priority {free}", activity.instance), at, free.to_string())
        }
        None => found,
    }
}

/// Returns a time for the left side of a comparison with `other`: without its unit, where that has the same one.
fn without_unit(time: Time, other: Time) -> String {
    let (time, other) = (time.to_string(), other.to_string());
    match (time.split_once(' '), other.split_once(' ')) {
        (Some((figure, unit)), Some((_, same))) if unit == same => figure.to_owned(),
        _ => time,
    }
}
