//! The plots of one codel, as SVG in a figure. Styles are classes of `style.css`, so that one drawing serves light and dark pages, paper,
//! and narrow screens: these show texts larger, and leave out every second label (`alt`).

use std::fmt::Write as _;

use mauve_pwcet::{CurvePoint, Estimate, EstimateOptions};

use super::figures::{self, TimeUnit};
use super::frame::{
    BAND, BARS, BOUND, BUDGET, DOTS, FIT, HIGH_WATER, IDENTITY, LETTER, MEAN, PlotFrame, RANGE, RECORD, RUNS,
    ReportPlot, THRESHOLD, Ticks, count_ticks, diamond, dots, line, time_ticks, triangle,
};
use super::samples::{RecordedPart, histogram, parts, ranks};
use crate::chart::Axis;
use crate::svg::Anchor;

/// What the plots of a codel show.
pub(super) struct Plotted<'a> {
    /// The codel and its instance, escaped.
    pub(super) name: String,
    pub(super) unit: TimeUnit,
    /// In the order of recording.
    pub(super) executions: &'a [u64],
    pub(super) ascending: Vec<u64>,
    /// The indices of the executions that begin a run.
    pub(super) runs: &'a [usize],
}

/// Draws the executions in the order in which they were recorded.
pub(super) fn recording(of: &Plotted<'_>) -> String {
    const PARTS: usize = 280;
    let count = of.executions.len();
    let frame = PlotFrame::new(270.0, 26.0);
    let (least, greatest) = ends(&of.ascending);
    // From 0 unless that hides the variation.
    let low = if least < 0.4 * greatest { 0.0 } else { least };
    let x = Axis::linear((0.5, count as f64 + 0.5), 0.0, frame.horizontal());
    let y = Axis::linear((low, greatest), 0.05, frame.vertical());
    let title = format!("Execution times of {} in the order of recording", of.name);
    let executions = count_ticks("execution", &x, 5.0, count);
    let mut plot = ReportPlot::new(frame, title, executions, time_ticks("time", &y, 5.0, &of.unit));
    shade_runs(&mut plot, of, &frame, &x);
    let found = parts(of.executions, PARTS);
    let at = |index: usize| x.at(index as f64 + 1.0);
    let middle = |part: &RecordedPart| x.at(part.first as f64 + 0.5 + part.count as f64 / 2.0);
    let records: Vec<(f64, f64)> =
        found.iter().filter_map(|part| Some((at(part.record?), y.at(part.greatest as f64)))).collect();
    if count <= 2 * PARTS {
        let points = of.executions.iter().enumerate().map(|(index, &time)| (at(index), y.at(time as f64)));
        plot.paths(&[("dots", dots(points))]);
        plot.explain(DOTS, "execution");
    } else {
        let bar = |part: &RecordedPart| {
            // A line of equal times has a length too.
            let (from, to) = (y.at(part.least as f64) + 0.4, y.at(part.greatest as f64) - 0.4);
            format!("M{:.1} {from:.1}V{to:.1}", middle(part))
        };
        plot.paths(&[("range", found.iter().map(bar).collect())]);
        let size = count.div_ceil(PARTS);
        plot.explain(RANGE, format!("least to greatest of about {} executions", figures::count(size)));
    }
    if count >= 200 {
        let means = parts(of.executions, 40).into_iter().map(|part| (middle(&part), y.at(part.mean)));
        plot.paths(&[("mean", line(means))]);
        plot.explain(MEAN, "mean of each fortieth");
    }
    let mut steps = String::new();
    for (x, y) in &records {
        let _ =
            if steps.is_empty() { write!(steps, "M{x:.1} {y:.1}") } else { write!(steps, "H{x:.1}V{y:.1}") };
    }
    let steps = format!("{steps}H{:.1}", frame.right);
    plot.paths(&[("record", steps), ("records", dots(records.into_iter()))]);
    plot.explain(RECORD, format!("high-water mark so far, at the end {}", of.unit.bound(greatest)));
    let note = "Executions in recorded order: trends, phases and start-up are visible here.";
    plot.figure("recording", "Recording.", note)
}

/// More runs are too narrow for a drawing.
const MOST_RUNS: usize = 40;

/// Shades every second run.
fn shade_runs(plot: &mut ReportPlot, of: &Plotted<'_>, frame: &PlotFrame, x: &Axis) {
    let count = of.executions.len();
    let starts = of.runs.iter().copied().filter(|&start| 0 < start && start < count);
    let edges: Vec<usize> = std::iter::once(0).chain(starts).chain([count]).collect();
    let runs = edges.len() - 1;
    if !(2..=MOST_RUNS).contains(&runs) {
        return;
    }
    for run in edges.windows(2).skip(1).step_by(2) {
        let [from, to] = run else { continue };
        let (from, to) = (x.at(*from as f64 + 0.5), x.at(*to as f64 + 0.5));
        plot.svg.rect("run", [from, frame.top, to - from, frame.bottom - frame.top]);
    }
    plot.explain(RUNS, format!("every second of {runs} runs"));
}

fn ends(ascending: &[u64]) -> (f64, f64) {
    let end = |time: Option<&u64>| time.copied().unwrap_or_default() as f64;
    (end(ascending.first()), end(ascending.last()))
}

/// Draws the density as a histogram.
pub(super) fn density(of: &Plotted<'_>, estimate: Option<&Estimate>) -> Option<String> {
    let found = histogram(&of.ascending)?;
    let frame = PlotFrame::new(270.0, 26.0);
    let end = found.start + found.width * found.counts.len() as f64;
    let share = |count: usize| 100.0 * count as f64 / of.ascending.len() as f64;
    let tallest = found.counts.iter().copied().max().unwrap_or_default();
    let x = Axis::linear((found.start, end), 0.02, frame.horizontal());
    let y = Axis::linear((0.0, share(tallest) * 1.05), 0.0, frame.vertical());
    let (percentages, decimals) = y.ticks(4.0, 1.0);
    let y_ticks = percentages.into_iter().map(|it| (y.at(it), format!("{it:.decimals$}\u{a0}%"))).collect();
    let title = format!("Histogram of the execution times of {}", of.name);
    let times = time_ticks("execution time", &x, 5.0, &of.unit);
    let mut plot = ReportPlot::new(frame, title, times, ("share of executions".to_owned(), y_ticks));
    let base = frame.bottom;
    let mut bars = format!("M{:.1} {base:.1}", x.at(found.start));
    for (index, &count) in found.counts.iter().enumerate() {
        let end = x.at(found.start + found.width * (index + 1) as f64);
        let _ = write!(bars, "V{:.1}H{end:.1}", y.at(share(count)));
    }
    plot.paths(&[("bar", format!("{bars}V{base:.1}z"))]);
    let width = of.unit.time(found.width);
    plot.explain(BARS, format!("{} of {width}", figures::counted(found.counts.len(), "bin")));
    let mut vertical = |class: &str, mark, time: f64, text: String| {
        if x.has(time) {
            plot.vertical(class, x.at(time));
        }
        plot.explain(mark, text);
    };
    if let Some(threshold) = estimate.map(|it| it.tail.threshold) {
        let text = format!("threshold of the tail, {}", of.unit.time(threshold));
        vertical("threshold", THRESHOLD, threshold, text);
    }
    let (_, greatest) = ends(&of.ascending);
    if found.above == 0 {
        vertical("hwm", HIGH_WATER, greatest, format!("high-water mark, {}", of.unit.bound(greatest)));
    }
    let note = if found.above > 0 {
        format!(
            "{} longer than {} ({}\u{a0}%) {} to the right of this plot, up to {}.",
            figures::counted(found.above, "execution"),
            of.unit.time(end),
            figures::rounded(share(found.above)),
            if found.above == 1 { "is" } else { "are" },
            of.unit.bound(greatest)
        )
    } else {
        "Several peaks suggest several modes.".to_owned()
    };
    Some(plot.figure("density", "Density.", &note))
}

/// Draws the probabilities of longer executions: observed, fitted, and the bounds of the levels.
pub(super) fn tail(of: &Plotted<'_>, estimate: &Estimate, budget: Option<(usize, f64)>) -> String {
    let frame = PlotFrame::new(410.0, 112.0);
    let count = estimate.count as f64;
    let strictest = estimate.levels.iter().map(|it| it.level).fold(1.0 / count, f64::min);
    // With room for the mark of the strictest level.
    let lowest = 10_f64.powf((strictest.log10() - 0.35).max(-300.0));
    let y = Axis::logarithmic((lowest, 1.0), frame.vertical());
    let curve: Vec<_> = estimate.curve.iter().filter(|it| it.probability >= strictest * 0.99).collect();
    let greatest = estimate.greatest as f64;
    let x = times_of_tail(estimate, &curve, budget, &frame);
    let title = format!(
        "Exceedance probabilities of {}: observed executions, the fitted tail, and the bounds of the levels",
        of.name
    );
    let times = time_ticks("execution time", &x, 6.0, &of.unit);
    let mut plot = ReportPlot::new(frame, title, times, powers_of_ten(&y, lowest));
    plot.explain(DOTS, "observed");
    let at = |time: f64, probability: f64| (x.at(time), y.at(probability));
    let edge = curve.iter().map(|it| at(it.upper, it.probability));
    let band = edge.clone().chain(curve.iter().rev().map(|it| at(it.lower, it.probability)));
    let fit = line(curve.iter().map(|it| at(it.point, it.probability)));
    plot.paths(&[("band", line(band) + "z"), ("edge", line(edge)), ("fit", fit)]);
    plot.explain(FIT, "fitted tail");
    plot.explain(BAND, "its 95\u{a0}% confidence band");
    for (class, mark, time, text) in [
        ("threshold", THRESHOLD, estimate.tail.threshold, "threshold of the tail"),
        ("hwm", HIGH_WATER, greatest, "high-water mark"),
    ] {
        plot.vertical(class, x.at(time));
        plot.explain(mark, format!("{text}, {}", of.unit.time(time)));
    }
    let observed = ranks(of.ascending.len(), 180).into_iter().filter_map(|rank| {
        let time = of.ascending.get(of.ascending.len().checked_sub(rank)?)?;
        Some(at(*time as f64, rank as f64 / count))
    });
    plot.paths(&[("dots", dots(observed))]);
    let budget = budget.filter(|(_, time)| x.has(*time));
    let budget = budget.and_then(|(level, time)| Some(triangle(at(time, estimate.levels.get(level)?.level))));
    if let Some(mark) = budget {
        plot.paths(&[("budget", mark)]);
        plot.explain(BUDGET, "budget");
    }
    level_marks(&mut plot, &frame, of, estimate, at);
    plot.explain(BOUND, "95\u{a0}% upper bound of a level");
    let note = format!(
        "Probability that an execution takes longer than a time. An event that is rarer than 3/n = {} may be missing from \
         these executions.",
        figures::rate(3.0 / count)
    );
    plot.figure("tail", "Tail.", &note)
}

/// Returns the marks of an axis of probabilities from 1 to the lowest one.
fn powers_of_ten(y: &Axis, lowest: f64) -> Ticks {
    let every = (-lowest.log10() / 12.0).ceil().max(1.0) as i32;
    let powers = (0..=-(lowest.log10().ceil() as i32)).step_by(every as usize);
    let tick = |power: i32| {
        let label = if power == 0 { "1".to_owned() } else { format!("1e-{power}") };
        (y.at(10_f64.powi(-power)), label)
    };
    ("exceedance probability".to_owned(), powers.map(tick).collect())
}

/// Returns the axis of times: logarithmic where the bounds are far beyond what was observed.
fn times_of_tail(
    estimate: &Estimate,
    curve: &[&CurvePoint],
    budget: Option<(usize, f64)>,
    frame: &PlotFrame,
) -> Axis {
    let bounds = estimate.levels.iter().filter_map(|it| it.bound.ok()).chain(curve.iter().map(|it| it.upper));
    let (least, greatest) = (estimate.least as f64, estimate.greatest as f64);
    let mut high = bounds.filter(|it| it.is_finite()).fold(greatest, f64::max);
    // A much longer budget would leave no room for the tail.
    if let Some((_, budget)) = budget.filter(|(_, time)| *time <= 1.5 * high) {
        high = high.max(budget);
    }
    if high > 8.0 * greatest {
        Axis::logarithmic((least.max(1.0), high * 1.05), frame.horizontal())
    } else {
        Axis::linear((least, high), 0.02, frame.horizontal())
    }
}

/// Draws a mark for the bound of each level, and its time to the right of the plot.
fn level_marks(
    plot: &mut ReportPlot,
    frame: &PlotFrame,
    of: &Plotted<'_>,
    estimate: &Estimate,
    at: impl Fn(f64, f64) -> (f64, f64),
) {
    const HEIGHT: f64 = 20.0;
    let mut levels: Vec<_> =
        estimate.levels.iter().filter_map(|it| Some((it.level, it.bound.ok()?))).collect();
    levels.sort_by(|a, b| b.0.total_cmp(&a.0));
    let marks: Vec<(f64, f64)> = levels.iter().map(|&(level, bound)| at(bound, level)).collect();
    let most = ((frame.bottom - frame.top) / HEIGHT) as usize;
    let every = levels.len().div_ceil(most.max(1)).max(1);
    // Labels move down until they do not overlap, and up where there is no room left.
    let mut labels: Vec<(usize, f64)> =
        marks.iter().enumerate().step_by(every).map(|(index, (_, y))| (index, *y)).collect();
    let mut next = frame.top;
    for (_, y) in &mut labels {
        *y = y.max(next);
        next = *y + HEIGHT;
    }
    let mut next = frame.bottom;
    for (_, y) in labels.iter_mut().rev() {
        *y = y.min(next);
        next = *y - HEIGHT;
    }
    let mut leaders = String::new();
    for (index, label) in &labels {
        let (Some((x, y)), Some(&(level, bound))) = (marks.get(*index), levels.get(*index)) else { continue };
        let _ = write!(leaders, "M{x:.1} {y:.1}H{:.1}L{:.1} {label:.1}", frame.right, frame.right + 6.0);
        plot.svg.markup(&format!(
            "<text class=\"value\" x=\"{:.1}\" y=\"{label:.1}\" dy=\".35em\"><tspan class=\"alt\">{}: </tspan>{}</text>",
            frame.right + 9.0,
            figures::level(level),
            of.unit.bound(bound)
        ));
    }
    plot.paths(&[("leader", leaders), ("bound", marks.into_iter().map(diamond).collect())]);
}

/// Draws the observed excesses against those of the fitted tail.
pub(super) fn quantiles(of: &Plotted<'_>, estimate: &Estimate) -> String {
    let frame = PlotFrame::new(270.0, 26.0);
    let tail = &estimate.tail;
    let points: Vec<(f64, f64)> = ranks(tail.excesses, 180)
        .into_iter()
        .filter_map(|rank| {
            let fitted = tail.model.exceeded_with((rank as f64 - 0.5) / tail.excesses as f64);
            let time = of.ascending.get(of.ascending.len().checked_sub(rank)?)?;
            Some((fitted, (*time as f64 - tail.threshold).max(0.0)))
        })
        .collect();
    let greatest =
        points.iter().fold((0.0_f64, 0.0_f64), |greatest, it| (greatest.0.max(it.0), greatest.1.max(it.1)));
    let x = Axis::linear((0.0, greatest.0), 0.03, frame.horizontal());
    let y = Axis::linear((0.0, greatest.1), 0.03, frame.vertical());
    let title = format!("Observed excesses of {} against the excesses of the fitted tail", of.name);
    let [fitted, observed] = [("fitted excess", &x), ("observed excess", &y)]
        .map(|(kind, axis)| time_ticks(kind, axis, 5.0, &of.unit));
    let mut plot = ReportPlot::new(frame, title, fitted, observed);
    let at = |(fitted, observed): (f64, f64)| (x.at(fitted), y.at(observed));
    let end = x.range().1.min(y.range().1);
    let identity = line([(0.0, 0.0), (end, end)].into_iter().map(at));
    plot.paths(&[("identity", identity), ("dots", dots(points.into_iter().map(at)))]);
    plot.explain(DOTS, format!("{} above the threshold", figures::counted(tail.excesses, "execution")));
    plot.explain(IDENTITY, "observed = fitted");
    let note = "Times above the threshold, against those of the fitted tail. Points far above the line at the right are longer than \
                the fit expects.";
    plot.figure("quantiles", "Fit.", note)
}

/// Draws the estimates and the bounds of one or two levels as the sample grows; `None` if it has no parts that are large enough.
pub(super) fn convergence(
    of: &Plotted<'_>,
    estimate: &Estimate,
    options: &EstimateOptions,
) -> Option<String> {
    if estimate.convergence.is_empty() {
        return None;
    }
    let order = |index: &usize| options.levels.get(*index).copied().unwrap_or(1.0);
    let shown = usual_and_strictest(options.levels.len(), order)?;
    let series = |index: usize| -> Vec<(f64, f64, f64)> {
        let parts = estimate.convergence.iter().filter_map(|it| {
            let &(point, upper) = it.levels.get(index)?;
            Some((it.count as f64, point, upper))
        });
        let last = estimate.levels.get(index);
        let last = last.and_then(|it| Some((estimate.count as f64, it.point, it.bound.ok()?)));
        parts.chain(last).filter(|it| it.2.is_finite()).collect()
    };
    let all: Vec<Vec<(f64, f64, f64)>> = shown.iter().map(|&index| series(index)).collect();
    let low = all.iter().flatten().map(|it| it.1).fold(f64::INFINITY, f64::min);
    let high = all.iter().flatten().map(|it| it.2).fold(0.0, f64::max);
    let frame = PlotFrame::new(270.0, 64.0);
    let first = estimate.convergence.first()?.count as f64;
    let x = Axis::linear((first, estimate.count as f64), 0.0, frame.horizontal());
    let y = if high > 8.0 * low && low > 0.0 {
        Axis::logarithmic((low * 0.95, high * 1.05), frame.vertical())
    } else {
        Axis::linear((low, high), 0.06, frame.vertical())
    };
    let used = count_ticks("executions used", &x, 4.0, estimate.count);
    let title = format!("Estimates and bounds of {} from the first executions", of.name);
    let mut plot = ReportPlot::new(frame, title, used, time_ticks("time", &y, 5.0, &of.unit));
    let mut labels: Vec<(f64, String)> = Vec::new();
    for ((points, &index), class) in all.iter().zip(&shown).zip(SERIES) {
        let upper = points.iter().map(|it| (x.at(it.0), y.at(it.2)));
        let point = points.iter().map(|it| (x.at(it.0), y.at(it.1)));
        plot.svg.group(class, &[], "");
        plot.paths(&[
            ("between", line(upper.clone().chain(point.clone().rev())) + "z"),
            ("upper", line(upper.clone())),
            ("point", line(point.clone())),
            ("ends", dots(upper.clone().chain(point))),
        ]);
        plot.svg.end();
        let level = figures::level(order(&index));
        plot.explain(series_mark(class), format!("level {level}: estimate to upper bound"));
        labels.extend(points.last().map(|it| y.at(it.2)).map(|y| (y, level)));
    }
    if let [(first, _), (second, _)] = labels.as_mut_slice()
        && (*first - *second).abs() < 20.0
    {
        // The stricter level has the longer times; both labels stay above the ticks.
        *first = (first.max(*second) + 10.0).min(frame.bottom - 2.0);
        *second = *first - 20.0;
    }
    for (y, level) in labels {
        let at = (frame.right + LETTER, y);
        plot.svg.text_with("value", at, Anchor::Start, &[("dy", &".35em")], &level);
    }
    let note = "Estimates from the first executions only. They are stable if more executions move them within their earlier band.";
    Some(plot.figure("convergence", "Convergence.", note))
}

/// Returns the indices of the level next to 1e-4 and of the strictest one, if that is another.
fn usual_and_strictest(count: usize, level: impl Fn(&usize) -> f64) -> Option<Vec<usize>> {
    let usual = (0..count).min_by(|a, b| {
        let distance = |index| (level(index) / 1e-4).ln().abs();
        distance(a).total_cmp(&distance(b))
    })?;
    let strictest = (0..count).min_by(|a, b| level(a).total_cmp(&level(b)))?;
    Some([usual].into_iter().chain(Some(strictest).filter(|it| *it != usual)).collect())
}

/// The class of each level in the plot of the convergence.
const SERIES: [&str; 2] = ["first", "second"];

/// Returns the entry of a level in the legend.
fn series_mark(class: &str) -> String {
    format!(
        "<g class=\"{class}\"><path class=\"between\" d=\"M2 2h24v10h-24z\"/><path class=\"upper\" d=\"M2 2h24\"/>\
         <path class=\"point\" d=\"M2 12h24\"/></g>"
    )
}
