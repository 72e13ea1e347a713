//! The last lines of `mauve pwcet`: the commands that measure the missing times, to copy.
//!
//! ```text
//! Next:
//! Record the robot for longer, above all for nav.look:
//!   mauve run --codels ./src --for 50min --trace more --inputs
//!   mauve trace import more -o robot.samples
//! Execute alone what runs rarely in the robot:
//!   mauve measure nav.plan --codels ./src --inputs more/inputs.toml -n 8000 -o robot.samples
//! ```
//!
//! Executions alone do not say how long those in the robot are, so they help only where the robot has too few for a fit.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use mauve_pwcet::counted_from;
use mauve_pwcet::samples::{SampledExecution, Samples, SeriesId, is_alone};
use mauve_pwcet::trace::{ROS2_LIBRARY, SpanKind};
use mauve_timing::Level;

use super::estimates::{Estimates, MeasuredEntry};
use super::table::{MOST_EXECUTIONS, wrapped};
use crate::text::argument;

/// So many executions give a tail that does not change much with more of them.
const ENOUGH: u64 = 5000;

/// The default of `mauve measure`; and how long it should take, in nanoseconds: with 1.2 µs each, it takes the greatest number.
const USUAL_EXECUTIONS: u64 = 100_000;
const LONGEST_RUN: f64 = 120e9;

/// Where executions depend on each other, they count for fewer; and of so many executions alone, one has cold caches.
const MARGIN: u64 = 2;
const OF_COLD: u64 = 100;

/// Returns the commands that give the times that are missing, and shorter ones than those far beyond all executions.
pub(super) fn next(estimates: &Estimates, samples: &[PathBuf], files: &mut [Samples]) -> String {
    // How long the robot is to be recorded, and for what.
    let mut robot: Option<(u64, &str)> = None;
    let mut alone: BTreeMap<u64, Vec<&str>> = BTreeMap::new();
    let mut is_too_strict = false;
    for it in estimates.measurements.iter().filter(|it| !it.is_short_access()) {
        match remedy(estimates, it) {
            None => {}
            Some((true, needed)) => alone.entry(executions_alone(it, needed)).or_default().push(&it.name),
            Some((_, more)) if more > MOST_EXECUTIONS => is_too_strict = true,
            Some((_, more)) => {
                let seconds = gap(files, &it.measurement.key).map(|gap| (gap * more as f64 / 1e9) as u64 + 1);
                robot = robot.max(Some((seconds.unwrap_or(0), &it.name)));
            }
        }
    }
    let is_of_ros2 = |key: &str| key.split_once('.').is_some_and(|(library, _)| library == ROS2_LIBRARY);
    if (robot.is_some() || !alone.is_empty())
        && estimates.measurements.iter().all(|it| is_of_ros2(&it.measurement.key))
    {
        let text = "Record the system for longer, and add its executions:\n  mauve import RECORDING -o DIR\n";
        return format!("\nNext:\n{text}");
    }
    let project = estimates.budgets.as_ref();
    let mut out = String::new();
    // In no recording: of a state that was never entered.
    let is_unmeasured = |key: &&String| estimates.measurements.iter().all(|it| it.measurement.key != **key);
    let codels = project.iter().flat_map(|it| it.greatest.keys().filter(|key| it.sources.contains_key(*key)));
    let unmeasured: Vec<&str> = codels.filter(is_unmeasured).map(String::as_str).collect();
    if !unmeasured.is_empty() {
        out += &wrapped("No execution was recorded of: ", &unmeasured);
        alone.entry(USUAL_EXECUTIONS).or_default().extend(unmeasured);
    }
    let inputs = |names: &[&str], option: &'static str| {
        let has_inputs = |name: &&str| project.is_some_and(|it| it.with_inputs.contains(*name));
        if names.iter().any(has_inputs) { option } else { "" }
    };
    let recorded = inputs(&alone.values().flatten().copied().collect::<Vec<_>>(), " --inputs");
    // The packages: the folder of a package has src/codels/, which has the source.
    let source = project.and_then(|it| it.sources.values().next());
    let here = std::env::current_dir().unwrap_or_default();
    let of_here = |it: &Path| argument(&Path::new(".").join(it.strip_prefix(&here).unwrap_or(it)));
    let packages = source.and_then(|it| it.ancestors().nth(4)).map_or("DIR".to_owned(), of_here);
    let to = samples.first().map_or("SAMPLES".to_owned(), |it| argument(it));
    if robot.is_some() || !recorded.is_empty() {
        let (what, minutes) = match robot {
            None => ("what the codels below are given:".to_owned(), 1),
            Some((0, _)) => ("the robot for longer:".to_owned(), 10),
            Some((seconds, name)) => {
                (format!("the robot for longer, above all for {name}:"), seconds.div_ceil(60))
            }
        };
        let run = format!("mauve run --codels {packages} --for {minutes}min --trace more{recorded}");
        let _ = writeln!(out, "Record {what}\n  {run}\n  mauve trace import more -o {to}");
    }
    if !alone.is_empty() {
        out += "Execute alone what runs rarely in the robot:\n";
    }
    for (count, names) in alone {
        let (inputs, names) = (inputs(&names, " --inputs more/inputs.toml"), names.join(" "));
        let _ = writeln!(out, "  mauve measure {names} --codels {packages}{inputs} -n {count} -o {to}");
    }
    if is_too_strict {
        out += "Strict levels need millions of executions: leave them out (--levels)\n";
    }
    if out.is_empty() { out } else { format!("\nNext:\n{out}") }
}

/// Returns whether executions of the codel alone give a time, or a shorter one, and how many; otherwise, how many more in the robot.
fn remedy(estimates: &Estimates, it: &MeasuredEntry) -> Option<(bool, u64)> {
    let Some(lack) = estimates.lack(it) else {
        let strictest = estimates.needed_levels().into_iter().min().map(Level::as_f64)?;
        let more = (MARGIN * counted_from(strictest)).saturating_sub(it.measurement.count() as u64);
        return (estimates.kinds(it).contains(&"far-bound") && more > 0).then_some((false, more));
    };
    let was_alone = it.measurement.instances.iter().any(|it| is_alone(&it.instance));
    let helps = is_alone(&lack.instance) || lack.kind == "too-few-executions" && !was_alone;
    Some(if helps && it.kind() == SpanKind::Codel {
        (true, (MARGIN * OF_COLD).saturating_mul(lack.needed))
    } else {
        // Enough, if they did not depend on each other: twice as many.
        let all = if lack.more > 0 { lack.needed } else { it.measurement.count() as u64 };
        (false, (MARGIN - 1).saturating_mul(all).saturating_add(lack.more))
    })
}

/// Returns how often a codel is to be executed alone. A long one is executed less often, and has a fitted tail.
fn executions_alone(it: &MeasuredEntry, needed: u64) -> u64 {
    let all = || it.measurement.instances.iter().flat_map(|it| &it.executions);
    let mean = all().map(|it| *it as f64).sum::<f64>() / all().count().max(1) as f64;
    needed.max(USUAL_EXECUTIONS).min(((LONGEST_RUN / mean.max(1200.0)) as u64).max(ENOUGH))
}

/// Returns the mean time between two executions in the robot, in nanoseconds: in the instance that executes this most rarely. `None`
/// if the samples do not have it.
fn gap(files: &mut [Samples], key: &str) -> Option<f64> {
    let mut greatest: Option<f64> = None;
    for file in files {
        let series = file.series().iter().filter(|it| it.key == key && !is_alone(&it.instance));
        for id in series.map(|it| it.id).collect::<Vec<SeriesId>>() {
            let executions = file.executions(id).ok()?;
            let span = |run: &[SampledExecution]| run.last()?.end?.checked_sub(run.first()?.end?);
            let spans = executions.chunk_by(|one, other| one.run == other.run).filter_map(span);
            let mean = spans.sum::<u64>() as f64 / executions.len() as f64;
            greatest = Some(greatest.unwrap_or(0.0).max(mean)).filter(|it| *it > 0.0);
        }
    }
    greatest
}
