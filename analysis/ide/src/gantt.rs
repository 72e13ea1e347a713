//! A simulated schedule as a Gantt chart, in SVG or in characters: a lane for each activity, with its releases, its deadlines and what it executes.

use std::cmp::Reverse;
use std::fmt::Write as _;

use mauve_diagnostics::figure::met;
use mauve_diagnostics::shortened;
use mauve_timing::{CpuSet, Job, LeftOut, Pass, Schedule, Slice, Time};
use mauve_wcrt::DeployedTasks;
use rustc_hash::FxHashMap;

use crate::chart::Axis;
use crate::drawing::Drawing;
use crate::occurrences::grouped;
use crate::svg::{Anchor, Svg, path_through, tip_of};
use crate::text_canvas::{cells, in_columns, padded};
use crate::worst_schedule::{WorstOf, to_micros};

/// Draws a schedule. The lanes are in the order of CPUs, then of priorities. A slice has the name of the state that it
/// executes where that fits, and a title with its job, its path and its times; `data-activity` holds the index of its activity.
/// The way of data through it, if any, is a line from its arrival in a lane to its write there, and on in the next one. Of the job
/// that it was made for, if any, the release, the deadline and the end are lines with their names; less slack than so many percent of the
/// deadline is little.
/// To cancel, `interrupt` unwinds.
pub fn draw_schedule(
    title: &str,
    deployment: &DeployedTasks<'_>,
    (schedule, way, worst): (&Schedule, &[Pass], Option<(&WorstOf, u32)>),
    drawing: Drawing,
    interrupt: &dyn Fn(),
) -> String {
    let lanes = lanes(deployment, schedule);
    let job = worst.and_then(|(it, tight_slack)| Some((it.job(schedule)?, tight_slack)));
    let chart = Chart::new(&lanes, deployment, (schedule, way, job), drawing == Drawing::Narrow);
    match drawing {
        Drawing::Svg | Drawing::Narrow => chart.draw(title, interrupt),
        Drawing::Text(_) | Drawing::Dot => chart.text(title, drawing.columns()),
    }
}

/// A row of the chart.
struct TaskLane<'a> {
    /// The index of the task: see [`Slice::activity`].
    activity: usize,
    name: String,
    /// Its name where there is little room.
    shown: String,
    /// None for throttling.
    priority: Option<u32>,
    cpus: CpuSet,
    jobs: Vec<&'a Job>,
    slices: Vec<&'a Slice>,
}

fn lanes<'a>(deployment: &DeployedTasks<'_>, schedule: &'a Schedule) -> Vec<TaskLane<'a>> {
    let tasks = &deployment.tasks;
    // Other work and throttling have no statistics.
    let is_simulated = |index: usize| match schedule.statistics.get(index) {
        Some(statistics) => statistics.is_some(),
        None => schedule.slices.iter().any(|slice| slice.activity == index),
    };
    let jobs = grouped(schedule.jobs.iter().map(|it| (it.activity, it)));
    let slices = grouped(schedule.slices.iter().map(|it| (it.activity, it)));
    let mut jobs: FxHashMap<usize, Vec<&Job>> = jobs.into_iter().collect();
    let mut slices: FxHashMap<usize, Vec<&Slice>> = slices.into_iter().collect();
    let simulated = tasks.all().iter().enumerate().filter(|(index, _)| is_simulated(*index));
    let mut lanes: Vec<TaskLane<'_>> = simulated
        .map(|(activity, task)| TaskLane {
            activity,
            name: shortened(&tasks.name(activity), 2 * MOST_LETTERS),
            shown: shortened(&tasks.name(activity), MOST_LETTERS),
            priority: task.priority.real_time(),
            cpus: task.cpus.unwrap_or_default(),
            jobs: jobs.remove(&activity).unwrap_or_default(),
            slices: slices.remove(&activity).unwrap_or_default(),
        })
        .collect();
    lanes.sort_by_key(|lane| {
        let priority = lane.priority.unwrap_or(u32::MAX);
        (lane.cpus.first(), lane.cpus, Reverse(priority), lane.activity)
    });
    lanes
}

impl TaskLane<'_> {
    /// Returns its priority as a text; empty for throttling.
    fn priority(&self) -> String {
        self.priority.map_or_else(String::new, |priority| priority.to_string())
    }
}

/// The width of the part with the times, in pixels.
const PLOT: f64 = 1200.0;
/// The width of a narrow drawing.
const NARROW: f64 = 440.0;
/// The height of the name of a group of CPUs.
const HEADING: f64 = 24.0;
/// The height above the lanes: the title, and the times.
const TOP: f64 = 64.0;
/// The height of the name of an instant.
const INSTANT: f64 = 17.0;

/// The number of colours of CPUs; from the ninth CPU on again.
const COLOURS: u32 = 8;
const LATE: &str = "late";
const THROTTLED: &str = "throttled";

/// The class of the slices of a CPU.
fn colour(cpu: u32) -> String {
    format!("cpu{}", cpu % COLOURS)
}

struct Chart<'a, 'db> {
    lanes: &'a [TaskLane<'a>],
    deployment: &'a DeployedTasks<'db>,
    schedule: &'a Schedule,
    way: &'a [Pass],
    /// What the schedule was made for, and how little slack is tight.
    job: Option<(&'a Job, u32)>,
    /// The height above the lanes.
    top: f64,
    /// The times, until the end of the schedule or the deadline after it.
    times: Axis,
    end: Time,
    /// The height of a lane, and the size of its texts.
    lane: f64,
    font: f64,
    /// Where the times begin, and where they end.
    left: f64,
    right: f64,
}

impl<'a, 'db> Chart<'a, 'db> {
    fn new(
        lanes: &'a [TaskLane<'a>],
        deployment: &'a DeployedTasks<'db>,
        (schedule, way, job): (&'a Schedule, &'a [Pass], Option<(&'a Job, u32)>),
        is_narrow: bool,
    ) -> Chart<'a, 'db> {
        let (lane, font) = match lanes.len() {
            ..=16 => (if is_narrow { 28.0 } else { 36.0 }, 13.0),
            17..=40 => (26.0, 12.0),
            _ => (18.0, 11.0),
        };
        let longest = lanes.iter().map(|lane| lane.shown.chars().count()).max().unwrap_or_default();
        let left = if is_narrow { 44.0 } else { 64.0 } + 0.6 * font * longest as f64;
        let right = left + if is_narrow { (NARROW - left - 40.0).max(240.0) } else { PLOT };
        let top = TOP + job.map_or(0.0, |_| 2.0 * INSTANT);
        // A deadline that is much later would leave no room for the response.
        let latest = Time::from_nanos(schedule.end.as_nanos().saturating_mul(3));
        let end =
            job.map(|(job, _)| job.deadline).filter(|it| *it <= latest).unwrap_or_default().max(schedule.end);
        let times = times_until(end, (left, right));
        Chart { lanes, deployment, schedule, way, job, top, times, end, lane, font, left, right }
    }

    fn draw(&self, title: &str, interrupt: &dyn Fn()) -> String {
        let groups = self.groups().count();
        let bottom = self.top + self.lane * self.lanes.len() as f64 + HEADING * groups as f64 + 8.0;
        let width = self.right + 40.0;
        let mut svg = Svg::default();
        self.axis(&mut svg, bottom);
        let (mut y, mut index) = (self.top, 0);
        let mut middles: FxHashMap<usize, f64> = FxHashMap::default();
        for lanes in self.groups() {
            let cpus = self.deployment.hosts.names(lanes[0].cpus);
            svg.text("name", (20.0, y + HEADING - 7.0), Anchor::Start, &cpus);
            y += HEADING;
            for lane in lanes {
                self.lane(&mut svg, lane, y, index % 2 == 0, interrupt);
                middles.insert(lane.activity, y + self.lane * 0.72 - 5.0);
                y += self.lane;
                index += 1;
            }
        }
        self.way(&mut svg, &middles);
        self.instants(&mut svg, bottom);
        let mut below = self.legend(&mut svg, (bottom + 44.0, width)) + 22.0;
        // Letters of a sans-serif font are at most 0.6 as wide as high on average.
        let columns = Some((width / (0.6 * 12.0)) as usize);
        for note in in_columns(&self.left_out(), columns, "").lines() {
            svg.text("soft", (20.0, below + 4.0), Anchor::Start, note);
            below += 20.0;
        }
        svg.document((width, below), (20.0, 26.0), &format!("{title}; times in ms"))
    }

    /// Draws the way of data as a line through the middles of the lanes. Where it leaves one, it has the time since the change.
    fn way(&self, svg: &mut Svg, middles: &FxHashMap<usize, f64>) {
        let Some(change) = self.way.first().map(|pass| pass.arrival) else { return };
        let place = |pass: &Pass| Some((self.x(pass.arrival), self.x(pass.write), *middles.get(&pass.task)?));
        let Some(places) = self.way.iter().map(place).collect::<Option<Vec<_>>>() else { return };
        let points: Vec<_> = places.iter().flat_map(|&(from, to, y)| [(from, y), (to, y)]).collect();
        svg.group("worst", &[], "");
        svg.path("wire", &path_through(&points));
        svg.path("tip", &tip_of(&points));
        for (pass, (from, to, y)) in self.way.iter().zip(places) {
            let passed = to_micros(pass.write.checked_sub(change).unwrap_or_default());
            svg.circle("tip", (from, y), 3.5);
            svg.text("mark worst", (to - 4.0, y - self.lane * 0.3), Anchor::End, &passed.to_string());
        }
        svg.end();
    }

    /// Lines where the job that the schedule was made for is released, has its deadline and ends, each with its name.
    fn instants(&self, svg: &mut Svg, bottom: f64) {
        let Some((job, tight_slack)) = self.job else { return };
        let since = |time: Time| to_micros(time.checked_sub(job.nominal).unwrap_or_default());
        let name = |what: &str, time: Time| match job.nominal {
            Time::ZERO => format!("{what} {time}"),
            _ => format!("{what} {time}, {} after the release", since(time)),
        };
        let deadline = match job.deadline > self.end {
            true => name("deadline", job.deadline) + " →",
            false => name("deadline", job.deadline),
        };
        let status = |end: Time| match job.is_missed {
            true => "missed",
            false => met(since(end), since(job.deadline), tight_slack).1.name(),
        };
        let instants = [
            Some((job.nominal, format!("release {}", job.nominal), "")),
            Some((job.deadline, deadline, "")),
            job.end.map(|end| (end, name("end", to_micros(end)), status(end))),
        ];
        for (index, (time, name, status)) in instants.into_iter().flatten().enumerate() {
            let (x, y) = (self.x(time), TOP - 24.0 + INSTANT * (index as f64 + 1.0));
            let is_left = x < (self.left + self.right) / 2.0;
            let (at, anchor) = if is_left { (x + 5.0, Anchor::Start) } else { (x - 5.0, Anchor::End) };
            svg.group(&format!("instant {status}"), &[], "");
            svg.path("limit", &format!("M{x:.1} {:.1}V{bottom:.1}", y - 10.0));
            svg.text("status mark", (at, y), anchor, &name);
            svg.end();
        }
    }

    /// Draws the schedule in characters, the times in columns of one length.
    fn text(&self, title: &str, columns: Option<usize>) -> String {
        const MOST: usize = 100;
        /// Of the last mark of the axis.
        const LABEL: usize = 7;
        let end = self.schedule.end.as_nanos().max(1);
        let longest = self.lanes.iter().map(|lane| cells(&lane.shown) as usize).max().unwrap_or_default();
        let left = longest + 6;
        let plot = columns.map_or(MOST, |columns| columns.saturating_sub(left + LABEL).clamp(20, MOST));
        let column = |time: Time| (u128::from(time.as_nanos()) * plot as u128 / u128::from(end)) as usize;
        let mut out = in_columns(&format!("{title}; times in ms"), columns, "  ") + "\n";
        // The marks of the axis, where they do not touch.
        let mut axis = String::new();
        for time in marks(&times_until(self.schedule.end, (0.0, 1.0)), self.schedule.end) {
            let start = left + column(time);
            if start > cells(&axis) as usize {
                axis = format!("{}│{}", padded(&axis, start), time.number());
            }
        }
        let _ = writeln!(out, "{axis}");
        for lanes in self.groups() {
            let _ = writeln!(out, "{}", self.deployment.hosts.names(lanes[0].cpus));
            for lane in lanes {
                let mut row = vec![' '; plot + 1];
                let mut fill = |from: Time, to: Time, letter: char| {
                    // What is shorter than a column is shown, too.
                    let (from, to) = (column(from), column(to).max(column(from) + 1));
                    row.iter_mut().take(to).skip(from).for_each(|cell| *cell = letter);
                };
                for job in &lane.jobs {
                    fill(job.release, job.end.unwrap_or(self.schedule.end), '·');
                }
                for slice in &lane.slices {
                    fill(slice.start, slice.end, '█');
                }
                for job in lane.jobs.iter().filter(|job| job.is_missed) {
                    fill(job.deadline, job.end.unwrap_or(self.schedule.end), '!');
                }
                for pass in self.way.iter().filter(|pass| pass.task == lane.activity) {
                    for (at, letter) in [(pass.arrival, '●'), (pass.write, '◆')] {
                        row.iter_mut().skip(column(at)).take(1).for_each(|cell| *cell = letter);
                    }
                }
                let (name, priority) = (&lane.shown, lane.priority());
                let row: String = row.into_iter().collect();
                let row = format!("  {}{priority:>3} {row}", padded(name, longest));
                let _ = writeln!(out, "{}", row.trim_end());
            }
        }
        out += "█ executes  · waits  ! after its deadline; the number is the priority\n";
        if !self.way.is_empty() {
            out += "● data arrives  ◆ it is written\n";
        }
        let left_out = self.left_out();
        if left_out.is_empty() { out } else { out + &in_columns(&left_out, columns, "  ") + "\n" }
    }

    /// Returns the lanes by their CPUs.
    fn groups(&self) -> impl Iterator<Item = &'a [TaskLane<'a>]> {
        self.lanes.chunk_by(|one, other| one.cpus == other.cpus)
    }

    fn left_out(&self) -> String {
        let reasons = [
            (LeftOut::Unknown, "not simulated, and may delay others"),
            (LeftOut::Background, "not simulated, in the background"),
            (LeftOut::Unscripted, "not simulated, since they do not delay it"),
        ];
        let listed = |(reason, what): (LeftOut, &str)| {
            let of_reason = self.schedule.left_out.iter().filter(|(_, why)| *why == reason);
            let names = of_reason.filter_map(|(index, _)| self.deployment.tasks.activities().get(*index));
            let names: Vec<&str> = names.map(|activity| &*activity.name).collect();
            let left = names.len().saturating_sub(MOST_NAMES);
            let more = if left > 0 { format!(" and {left} more") } else { String::new() };
            let shown = names[..names.len() - left].join(", ");
            (!names.is_empty()).then(|| format!("{what}: {shown}{more}"))
        };
        reasons.into_iter().filter_map(listed).collect::<Vec<_>>().join("; ")
    }

    fn x(&self, time: Time) -> f64 {
        self.times.at(time.as_nanos() as f64)
    }

    /// The times above and below the lanes, with a line for each. Names of instants take the place of those above.
    fn axis(&self, svg: &mut Svg, bottom: f64) {
        let mut free = 0.0;
        for time in marks(&self.times, self.end) {
            let (x, label) = (self.x(time), time.number());
            svg.path("grid", &format!("M{x:.1} {:.1}V{bottom:.1}", self.top - 6.0));
            let half = 3.3 * label.chars().count() as f64 + 1.0;
            if x - half < free {
                continue;
            }
            free = x + half;
            if self.job.is_none() {
                svg.text("mark", (x, self.top - 11.0), Anchor::Middle, &label);
            }
            svg.text("mark", (x, bottom + 14.0), Anchor::Middle, &label);
        }
    }

    fn lane(&self, svg: &mut Svg, lane: &TaskLane<'_>, top: f64, is_shaded: bool, interrupt: &dyn Fn()) {
        let base = top + self.lane - 5.0;
        let height = self.lane * 0.56;
        if is_shaded {
            svg.rect("shade", [self.left, top, self.right - self.left, self.lane]);
        }
        let y = base - 0.3 * height;
        svg.group("", &[], &lane.name);
        svg.text_with("", (self.left - 34.0, y), Anchor::End, &[("font-size", &self.font)], &lane.shown);
        svg.end();
        let size = self.font - 1.0;
        svg.text_with("quiet", (self.left - 10.0, y), Anchor::End, &[("font-size", &size)], &lane.priority());
        svg.path("base", &format!("M{:.1} {base:.1}H{:.1}", self.left, self.right));
        self.releases(svg, lane, base);
        self.slices(svg, lane, base, height, interrupt);
        self.misses(svg, lane, base);
    }

    /// The slices, and thin lines where a job is preempted.
    fn slices(&self, svg: &mut Svg, lane: &TaskLane<'_>, base: f64, height: f64, interrupt: &dyn Fn()) {
        let mut preempted = String::new();
        for pair in lane.slices.windows(2) {
            if let [before, after] = pair
                && before.job == after.job
                && before.end < after.start
            {
                let y = base - height / 2.0;
                let _ = write!(preempted, "M{:.1} {y:.1}H{:.1}", self.x(before.end), self.x(after.start));
            }
        }
        svg.path("waits", &preempted);
        let deadline = |slice: &Slice| {
            let first = lane.jobs.first()?.number;
            let index = usize::try_from(slice.job.checked_sub(first)?).ok()?;
            lane.jobs.get(index).map(|job| job.deadline)
        };
        for slice in &lane.slices {
            interrupt();
            let class = if lane.priority.is_none() { THROTTLED.to_owned() } else { colour(slice.cpu) };
            let end = deadline(slice).map_or(slice.end, |deadline| deadline.clamp(slice.start, slice.end));
            let description = self.description(lane, slice);
            svg.group("", &[("data-activity", &lane.activity)], &description);
            let parts = [(slice.start, end, class.as_str()), (end, slice.end, LATE)];
            for (start, end, class) in parts {
                if start == end && (slice.start != slice.end || class == LATE) {
                    continue;
                }
                let (x, width) = (self.x(start), (self.x(end) - self.x(start)).max(0.8));
                svg.rect(&format!("slice {class}"), [x, base - height, width, height]);
            }
            let (label, size) = (self.label(slice), (self.font - 1.5).min(10.5));
            let (x, width) = (self.x(slice.start), self.x(slice.end) - self.x(slice.start));
            // Letters of a sans-serif font are at most 0.6 as wide as high on average.
            if 0.6 * size * label.chars().count() as f64 + 2.0 <= width {
                let at = (x + width / 2.0, base - height / 2.0 + 0.36 * size);
                svg.text_with("inner", at, Anchor::Middle, &[("font-size", &size)], &label);
            }
            svg.end();
        }
    }

    /// Arrows up for the releases, and marks below the line for the deadlines.
    fn releases(&self, svg: &mut Svg, lane: &TaskLane<'_>, base: f64) {
        let (mut arrows, mut marks) = (String::new(), String::new());
        let top = base - self.lane + 9.0;
        for job in &lane.jobs {
            let x = self.x(job.release);
            let _ = write!(arrows, "M{x:.1} {base:.1}V{top:.1}m-2.5 4l2.5 -4l2.5 4");
            if job.deadline <= self.end {
                let _ = write!(marks, "M{:.1} {:.1}v6", self.x(job.deadline), base - 1.0);
            }
        }
        svg.path("release", &arrows);
        svg.path("deadline", &marks);
    }

    /// A red line from each missed deadline to the end of the job.
    fn misses(&self, svg: &mut Svg, lane: &TaskLane<'_>, base: f64) {
        let mut lines = String::new();
        for job in lane.jobs.iter().filter(|job| job.is_missed) {
            let end = self.x(job.end.unwrap_or(self.schedule.end));
            let _ = write!(lines, "M{:.1} {:.1}v6m0 -3H{end:.1}", self.x(job.deadline), base - 1.0);
        }
        svg.path("overrun", &lines);
    }

    /// The name of the state that a slice executes.
    fn label(&self, slice: &Slice) -> String {
        match (self.deployment.edge(slice), self.deployment.call(slice)) {
            (Some((psm, edge)), _) => psm.state(edge.source).to_owned(),
            (None, Some((operation, client))) => format!("{operation} for {client}"),
            (None, None) => String::new(),
        }
    }

    /// `pilot, job 3 on CPU 1, 20 to 25 ms: Idle → Moving (go)`
    fn description(&self, lane: &TaskLane<'_>, slice: &Slice) -> String {
        let (name, job) = (&lane.name, slice.job);
        let cpu = self.deployment.hosts.names(CpuSet::of(slice.cpu));
        let times = format!("{} to {}", slice.start.number(), slice.end);
        let Some((psm, edge)) = self.deployment.edge(slice) else {
            return match self.deployment.call(slice) {
                Some((operation, client)) => format!("{name}, {operation} for {client} on {cpu}, {times}"),
                None => format!("{name} on {cpu}, {times}"),
            };
        };
        let transition =
            edge.transition.as_ref().map_or_else(String::new, |transition| format!(" ({transition})"));
        let (source, target) = (psm.state(edge.source), psm.state(edge.target));
        format!("{name}, job {job} on {cpu}, {times}: {source} → {target}{transition}")
    }

    /// Writes what the signs mean, from a height on and in a width. Returns the height of the last row.
    fn legend(&self, svg: &mut Svg, (mut y, width): (f64, f64)) -> f64 {
        let mut x = self.left;
        let mut entry = |sign: &[(&str, &str)], text: &str| {
            let of_entry = 56.0 + 6.6 * text.chars().count() as f64;
            if x > self.left && x + of_entry > width {
                (x, y) = (self.left, y + 20.0);
            }
            svg.entry((x, y), sign, (30.0, "soft"), text);
            x += of_entry;
        };
        entry(&[("release", "M12 1V-11m-2.5 4l2.5 -4l2.5 4")], "release");
        entry(&[("deadline", "M12 -8v8")], "deadline");
        let bar = "M0 -11h24v12h-24z";
        let used =
            self.schedule.slices.iter().filter(|slice| slice.activity < self.schedule.statistics.len());
        let used: CpuSet = used.map(|slice| slice.cpu).collect();
        for cpu in used.iter() {
            let class = format!("slice {}", colour(cpu));
            entry(&[(&class, bar)], &self.deployment.hosts.names(CpuSet::of(cpu)));
        }
        let class = format!("slice {}", colour(used.first().unwrap_or_default()));
        let parts = "M0 -11h8v12h-8zM16 -11h8v12h-8z";
        entry(&[(&class, parts), ("waits", "M8 -5h8")], "preempted");
        if self.schedule.jobs.iter().any(|job| job.is_missed) {
            entry(&[(&format!("slice {LATE}"), bar)], "after the deadline");
        }
        y
    }
}

/// The most activities that a note lists.
const MOST_NAMES: usize = 8;

/// The most letters of a name in a lane.
const MOST_LETTERS: usize = 28;

/// Returns the axis of times until `end`, in nanoseconds.
fn times_until(end: Time, ends: (f64, f64)) -> Axis {
    Axis::linear((0.0, end.as_nanos().max(1) as f64), 0.0, ends)
}

/// Returns the marks of an axis until `end`: at most 13, with the one at 0.
fn marks(times: &Axis, end: Time) -> Vec<Time> {
    // With a step of a 13th of the time, there would be 14.
    let ticks = times.ticks(12.999, 1.0).0.into_iter();
    let mut marks: Vec<Time> = ticks.map(|tick| Time::from_nanos(tick as u64)).collect();
    marks.dedup();
    marks.retain(|it| *it <= end);
    marks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::expect;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{names_of, projects};
    use mauve_timing::{Level, SimulationOptions, Tasks};

    const MODEL: &str = r#"
codel plan(): int
shell S { }
core C(S) {
  statemachine {
    initial state Waiting { transition go if (plan() > 0) to Moving }
    state Moving { run = { plan(); plan(); }  transition done to Waiting }
  }
}
core K(S) { update = { plan(); } }
component Pilot(S, C)
component Laser(S, K)
architecture A { instance pilot: Pilot  instance laser: Laser  instance spare: Missing  instance logger: Pilot }
deployment D {
  architecture A
  activity pilot { priority = 1 period = 10  deadline = 4 }
  activity laser { priority = 2 period = 5 }
  activity spare { priority = 3 period = 10 }
  activity logger { priority = background }
}
//- /mauve.toml
[assume]
codel = "1.5 ms"
[platform]
rt_throttling = false
"#;

    fn check(drawn: impl FnOnce(DeployedTasks<'_>, &Schedule)) {
        let Fixture { db, workspace, .. } = Fixture::new(MODEL);
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let deployment = DeployedTasks::simulated(&db, project, deployment, Level::TEN_TO_MINUS_FOUR);
        let options = SimulationOptions {
            initial_states: deployment.initial_states(),
            simultaneous: true,
            least_time: 100,
            ..SimulationOptions::new(4, Time::from_nanos(20_000_000))
        };
        let schedule = deployment.tasks.simulate(&options, &|| ());
        drawn(deployment, &schedule);
    }

    #[test]
    fn lanes_have_the_order_of_priorities_and_slices_their_paths() {
        check(|deployment, schedule| {
            let svg = draw_schedule("D", &deployment, (schedule, &[], None), Drawing::Svg, &|| ());
            assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
            let titles = svg.split("<title>").skip(1).filter_map(|rest| rest.split("</title>").next());
            let titles: String = titles.map(|title| format!("{title}\n")).collect();
            expect![[r#"
            laser
            laser, job 1 on CPU 1, 0 to 1.5 ms: update → update
            laser, job 2 on CPU 1, 5 to 6.5 ms: update → update
            laser, job 3 on CPU 1, 10 to 11.5 ms: update → update
            laser, job 4 on CPU 1, 15 to 16.5 ms: update → update
            pilot
            pilot, job 1 on CPU 1, 1.5 to 3 ms: Waiting → Moving (go)
            pilot, job 2 on CPU 1, 11.5 to 14.5 ms: Moving → Waiting (done)
        "#]]
            .assert_eq(&titles);
            for label in [
                ">D; times in ms<",
                ">Moving<",
                ">after the deadline<",
                ">not simulated, and may delay others: spare; not simulated, in the background: logger<",
            ] {
                assert!(svg.contains(label), "{label} in {svg}");
            }
        });
    }

    #[test]
    fn a_schedule_is_drawn_in_characters() {
        let expected = expect![[r#"
            D; times in ms
                       │0        │2        │4        │6        │8        │10       │12       │14       │16       │18       │20
            CPU 1
              laser  2 ███████                  ███████                  ███████                  ███████
              pilot  1 ·······████████                                   ·······█████████████!!
            █ executes  · waits  ! after its deadline; the number is the priority
            not simulated, and may delay others: spare; not simulated, in the background: logger
        "#]];
        check(|deployment, schedule| {
            expected.assert_eq(&draw_schedule(
                "D",
                &deployment,
                (schedule, &[], None),
                Drawing::Text(None),
                &|| (),
            ));
        });
    }

    #[test]
    fn a_drawing_can_be_cancelled() {
        check(|deployment, schedule| {
            let calls = std::cell::Cell::new(0);
            draw_schedule("D", &deployment, (schedule, &[], None), Drawing::Svg, &|| {
                calls.set(calls.get() + 1)
            });
            assert_eq!(calls.get(), schedule.slices.len());
        });
    }

    #[test]
    fn names_are_escaped_and_an_empty_schedule_is_drawn() {
        check(|mut deployment, schedule| {
            for activity in deployment.tasks.activities_mut() {
                activity.name = format!("<&\"{}", "x".repeat(40)).into();
            }
            let svg = draw_schedule("<D>", &deployment, (schedule, &[], None), Drawing::Svg, &|| ());
            assert!(
                svg.contains("&lt;&amp;&quot;xxx") && svg.contains("x…x") && !svg.contains("<&"),
                "{svg}"
            );
            deployment.tasks = Tasks::default();
            let empty = deployment.tasks.simulate(&SimulationOptions::new(1, Time::ZERO), &|| ());
            let svg = draw_schedule("", &deployment, (&empty, &[], None), Drawing::Svg, &|| ());
            assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{svg}");
        });
    }

    #[test]
    fn marks_of_the_axis() {
        let ms = 1_000_000;
        let found = [1000 * ms, 420 * ms, 60 * ms, 13 * ms, 1, 0, u64::MAX].map(|end| {
            let end = Time::from_nanos(end);
            let marks = marks(&times_until(end, (0.0, 1.0)), end);
            marks.get(1).map_or(0, |time| time.as_nanos())
        });
        assert_eq!(found, [100 * ms, 50 * ms, 5 * ms, 2 * ms, 1, 0, 2_000_000_000_000_000_000]);
    }
}
