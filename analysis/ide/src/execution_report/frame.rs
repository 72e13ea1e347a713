//! The parts that all plots have: the figure, the frame with its axes, and the marks of data, which legends show as well.

use std::fmt::Write as _;

use super::figures::{self, TimeUnit};
use crate::chart::Axis;
use crate::svg::{Anchor, Svg};

/// The width of all plots. On a narrow screen, a letter is 10 wide: margins have room for these.
pub(super) const WIDTH: f64 = 560.0;
pub(super) const LETTER: f64 = 9.5;

/// The rectangle of the values.
#[derive(Clone, Copy)]
pub(super) struct PlotFrame {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

impl PlotFrame {
    pub(super) fn new(height: f64, right: f64) -> PlotFrame {
        PlotFrame { left: 70.0, right: WIDTH - right, top: 32.0, bottom: height - 52.0 }
    }

    pub(super) fn horizontal(&self) -> (f64, f64) {
        (self.left, self.right)
    }

    pub(super) fn vertical(&self) -> (f64, f64) {
        (self.bottom, self.top)
    }
}

/// The title of an axis, and the positions and the labels of its ticks.
pub(super) type Ticks = (String, Vec<(f64, String)>);

/// A plot with its legend.
pub(super) struct ReportPlot {
    frame: PlotFrame,
    title: String,
    pub(super) svg: Svg,
    /// The mark of each entry, as SVG of 28 × 14, and its text.
    legend: Vec<(String, String)>,
}

impl ReportPlot {
    /// Returns a plot with its grid and its axes only.
    pub(super) fn new(
        frame: PlotFrame,
        title: String,
        (x_title, x_ticks): Ticks,
        (y_title, y_ticks): Ticks,
    ) -> ReportPlot {
        let PlotFrame { left, right, bottom, .. } = frame;
        let mut svg = Svg::default();
        let grid: String = y_ticks.iter().map(|(y, _)| format!("M{left:.1} {y:.1}H{right:.1}")).collect();
        let marks: String = x_ticks.iter().map(|(x, _)| format!("M{x:.1} {bottom:.1}v4")).collect();
        svg.path("grid", &grid);
        svg.path("axis", &format!("M{left:.1} {bottom:.1}H{right:.1}{marks}"));
        let class = |ticks: usize, index: usize, most: usize| match ticks > most && index % 2 == 1 {
            true => "alt",
            false => "",
        };
        for (index, (x, label)) in x_ticks.iter().enumerate() {
            svg.text(class(x_ticks.len(), index, 4), (*x, bottom + 19.0), Anchor::Middle, label);
        }
        for (index, (y, label)) in y_ticks.iter().enumerate() {
            let class = class(y_ticks.len(), index, 7);
            svg.text_with(class, (left - 8.0, *y), Anchor::End, &[("dy", &".35em")], label);
        }
        svg.text("name", (right, bottom + 42.0), Anchor::End, &x_title);
        svg.text("name", (4.0, 14.0), Anchor::Start, &y_title);
        ReportPlot { frame, title, svg, legend: Vec::new() }
    }

    /// Draws lines or shapes, each of a class.
    pub(super) fn paths(&mut self, paths: &[(&str, String)]) {
        paths.iter().for_each(|(class, lines)| self.svg.path(class, lines));
    }

    /// Draws a line from the top to the bottom.
    pub(super) fn vertical(&mut self, class: &str, x: f64) {
        let PlotFrame { top, bottom, .. } = self.frame;
        self.svg.path(class, &format!("M{x:.1} {top:.1}V{bottom:.1}"));
    }

    /// Adds an entry to the legend.
    pub(super) fn explain(&mut self, mark: impl Into<String>, text: impl Into<String>) {
        self.legend.push((mark.into(), text.into()));
    }

    /// Returns the plot with its caption, a note in HTML, and its legend.
    pub(super) fn figure(self, class: &str, caption: &str, note: &str) -> String {
        let entry = |(mark, text): &(String, String)| {
            format!(
                "<li><svg viewBox=\"0 0 28 14\" width=\"28\" height=\"14\" aria-hidden=\"true\">{mark}</svg>{text}</li>"
            )
        };
        let entries: String = self.legend.iter().map(entry).collect();
        let (title, height, svg) = (self.title, self.frame.bottom + 52.0, self.svg.elements());
        format!(
            "<figure class=\"{class}\">\n<figcaption><b>{caption}</b> {note}</figcaption>\n\
             <svg class=\"plot\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\"><title>{title}</title>\n{svg}</svg>\n\
             <ul class=\"legend\">{entries}</ul>\n</figure>\n"
        )
    }
}

/// Returns the ticks of an axis of times of this kind.
pub(super) fn time_ticks(kind: &str, axis: &Axis, most: f64, unit: &TimeUnit) -> Ticks {
    let (ticks, decimals) = axis.ticks(most, unit.nanoseconds);
    let label = |time: f64| {
        let value = time / unit.nanoseconds;
        // Differences of neighbours may need more than four digits.
        if value >= 100_000.0 {
            format!("{value:.0e}")
        } else if axis.is_logarithmic() || value.abs() >= 10_000.0 {
            figures::significant(value)
        } else {
            format!("{value:.decimals$}")
        }
    };
    let scale = if axis.is_logarithmic() { ", logarithmic" } else { "" };
    let ticks = ticks.into_iter().map(|time| (axis.at(time), label(time))).collect();
    (format!("{kind} in {}{scale}", unit.name), ticks)
}

/// Returns the ticks of an axis that counts executions.
pub(super) fn count_ticks(kind: &str, axis: &Axis, most: f64, greatest: usize) -> Ticks {
    let (unit, scale) = match greatest {
        ..20_000 => (1.0, ""),
        20_000..20_000_000 => (1e3, ", in thousands"),
        _ => (1e6, ", in millions"),
    };
    let (ticks, decimals) = axis.ticks(most, unit);
    let label = |it: f64| (axis.at(it), format!("{:.decimals$}", it / unit));
    (format!("{kind}{scale}"), ticks.into_iter().map(label).collect())
}

/// Returns a line through points.
pub(super) fn line(points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut path = String::new();
    for (x, y) in points {
        let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { 'M' } else { 'L' });
    }
    path
}

/// Returns dots: lines without a length, whose ends are round.
pub(super) fn dots(points: impl Iterator<Item = (f64, f64)>) -> String {
    points.fold(String::new(), |mut path, (x, y)| {
        let _ = write!(path, "M{x:.1} {y:.1}h0");
        path
    })
}

pub(super) fn diamond((x, y): (f64, f64)) -> String {
    format!("M{:.1} {y:.1}l4.5 -4.5l4.5 4.5l-4.5 4.5z", x - 4.5)
}

pub(super) fn triangle((x, y): (f64, f64)) -> String {
    format!("M{x:.1} {:.1}l5 8.5h-10z", y - 5.0)
}

pub(super) const DOTS: &str = "<path class=\"dots\" d=\"M4 7h0M14 7h0M24 7h0\"/>";
pub(super) const RANGE: &str =
    "<path class=\"range\" d=\"M5 3v8M8 5v7M11 2v10M14 4v8M17 3v8M20 5v6M23 2v10\"/>";
pub(super) const MEAN: &str = "<path class=\"mean\" d=\"M2 7h24\"/>";
pub(super) const RECORD: &str = "<path class=\"record\" d=\"M2 10h10V5h14\"/>";
pub(super) const RUNS: &str = "<rect class=\"run\" x=\"2\" y=\"1\" width=\"24\" height=\"12\"/>";
pub(super) const BARS: &str = "<path class=\"bar\" d=\"M5 13v-6h6v-4h6v7h6v3z\"/>";
pub(super) const FIT: &str = "<path class=\"fit\" d=\"M2 7h24\"/>";
pub(super) const BAND: &str = "<path class=\"band\" d=\"M2 2h24v10h-24z\"/>";
pub(super) const HIGH_WATER: &str = "<path class=\"hwm\" d=\"M2 7h24\"/>";
pub(super) const THRESHOLD: &str = "<path class=\"threshold\" d=\"M2 7h24\"/>";
pub(super) const BOUND: &str = "<path class=\"bound\" d=\"M9.5 7l4.5 -4.5l4.5 4.5l-4.5 4.5z\"/>";
pub(super) const BUDGET: &str = "<path class=\"budget\" d=\"M14 2l5 8.5h-10z\"/>";
pub(super) const IDENTITY: &str = "<path class=\"identity\" d=\"M2 7h24\"/>";
