//! A probability on a logarithmic axis over a time, as SVG: the levels of tables, a curve, a deadline.

use std::fmt::Write as _;

use mauve_timing::{Time, Unit};

use crate::drawing::{Drawing, number, svg_head, svg_line, svg_text, text_width};
use crate::execution_report::{Axis, step};

/// What is drawn.
pub(crate) struct Plot<'a> {
    pub(crate) title: String,
    /// The label of the axis of times.
    pub(crate) axis: &'a str,
    /// The label of the axis of probabilities.
    pub(crate) upright: &'a str,
    /// In descending order of probability.
    pub(crate) points: Vec<PlotPoint>,
    /// The width of its axis of times, [`plot_width`].
    pub(crate) width: f64,
    /// A vertical line.
    pub(crate) deadline: Option<Time>,
    /// The level at which the lines are compared: a horizontal line. The times of several lines may differ much: their axis is
    /// logarithmic.
    pub(crate) level: Option<f64>,
    /// Stairs: how they look, what they are, and their points in descending order of probability. Between two of them, no smaller
    /// probability is known than that of the first.
    pub(crate) lines: Vec<PlotLine>,
}

pub(crate) type PlotLine = (&'static str, String, Vec<(Time, f64)>);

/// A point with a label. In the SVG, each has `data-level` with its index.
pub(crate) struct PlotPoint {
    pub(crate) time: Time,
    pub(crate) probability: f64,
    pub(crate) label: String,
    /// What it says in a tooltip.
    pub(crate) title: String,
    /// Whether it stands out.
    pub(crate) is_shown: bool,
}

const LEFT: f64 = 92.0;
const TOP: f64 = 56.0;

/// The width of the axis of times in a drawing.
pub(crate) fn plot_width(drawing: Drawing) -> f64 {
    if drawing == Drawing::Narrow { 340.0 } else { 560.0 }
}

/// The least probability that is drawn: sums of doubles do not support less.
const LEAST: f64 = 1e-13;

impl Plot<'_> {
    pub(crate) fn svg(&self) -> String {
        let all = || self.lines.iter().flat_map(|it| &it.2).copied();
        let decades = all().map(|(_, it)| -it.max(LEAST).log10()).fold(1.0, f64::max).ceil();
        let height = (decades * 34.0).clamp(170.0, 420.0);
        let times = all().map(|it| it.0).chain(self.deadline);
        let greatest = times.map(|it| it.as_f64(Unit::Milliseconds)).fold(0.0, f64::max);
        let right = LEFT + self.width;
        // At most ten marks.
        let step = step(greatest / (self.width / 62.0).floor());
        let end = if greatest > 0.0 { (greatest * 1.12 / step).ceil() * step } else { 1.0 };
        let least = all().map(|it| it.0.as_f64(Unit::Milliseconds)).filter(|it| *it > 0.0);
        let ends = (LEFT, right);
        let axis = match self.level {
            Some(_) => Axis::logarithmic((least.fold(f64::INFINITY, f64::min) / 1.2, greatest * 1.2), ends),
            None => Axis::linear((0.0, end), 0.0, ends),
        };
        let x = |time: Time| axis.at(time.as_f64(Unit::Milliseconds));
        let y = |probability: f64| TOP + height * (-probability.log10() / decades).clamp(0.0, 1.0);
        let legend = self.legend(TOP + height + 70.0);
        let width = (right + 60.0).max(text_width(&self.title, 14.0, true) + 48.0);
        let legends = self.lines.iter().map(|it| LEFT + 64.0 + text_width(&it.1, 12.0, false));
        let width = legends.fold(width, f64::max);
        let bottom = TOP + height + 64.0 + 20.0 * legend.len() as f64;
        let mut out = svg_head((width, bottom), "x=\"24\" y=\"30\"", &self.title);
        out += &grid(decades, (right, height), &axis, end / step);
        let below = (LEFT + self.width / 2.0, TOP + height + 44.0);
        out += &svg_line("soft", below, " text-anchor=\"middle\"", self.axis);
        let _ = writeln!(
            out,
            "<text class=\"soft\" transform=\"translate(26 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            number(TOP + height / 2.0),
            svg_text(self.upright),
        );
        if let Some(deadline) = self.deadline {
            let (x, top, bottom) = (number(x(deadline)), number(TOP), number(TOP + height));
            let _ = writeln!(out, "<path class=\"deadline\" d=\"M{x} {top}V{bottom}\"/>");
        }
        if let Some(level) = self.level {
            let [from, y, to] = [LEFT, y(level), right].map(number);
            let _ = writeln!(out, "<path class=\"limit\" d=\"M{from} {y}H{to}\"/>");
        }
        for (class, words, points) in &self.lines {
            let to = |(time, probability): &(Time, f64)| {
                format!("H{}V{}", number(x(*time)), number(y(*probability)))
            };
            let curve: String = points.iter().map(to).collect();
            // What was observed ends with the greatest. Compared lines have nothing in common.
            let is_short = *class == "seen" || self.level.is_some();
            let end = if is_short { String::new() } else { format!("H{}", number(right)) };
            let start = points.first().filter(|_| self.level.is_some()).map_or(LEFT, |(time, _)| x(*time));
            let _ = writeln!(
                out,
                "<path class=\"{class}\" d=\"M{} {}{curve}{end}\"><title>{}</title></path>",
                number(start),
                number(TOP),
                svg_text(words),
            );
        }
        for (index, point) in self.points.iter().enumerate() {
            let (at, down) = (x(point.time), y(point.probability));
            // To the left of the curve, where there is room.
            let has_room = at - LEFT > text_width(&point.label, 12.0, true) + 16.0;
            let (label_x, anchor) = if has_room { (at - 9.0, "end") } else { (at + 9.0, "start") };
            // One label at a height, and for a time.
            let is_near = |(other, it): (usize, &PlotPoint)| {
                let is_same = it.time == point.time || (y(it.probability) - down).abs() < 14.0;
                (other > index || it.is_shown) && is_same
            };
            let is_hidden = !point.is_shown && self.points.iter().enumerate().any(is_near);
            let label = if is_hidden { String::new() } else { svg_text(&point.label) };
            let shown = if point.is_shown { " worst" } else { "" };
            let _ = writeln!(
                out,
                "<g class=\"level{shown}\" data-level=\"{index}\"><title>{}</title><circle class=\"tip\" cx=\"{}\" cy=\"{}\" \
                 r=\"4.5\"/><text x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\">{label}</text></g>",
                svg_text(&point.title),
                number(at),
                number(down),
                number(label_x),
                number(down - 6.0),
            );
        }
        out.extend(legend);
        out + "</svg>\n"
    }

    /// Returns a row for each line, where there are several.
    fn legend(&self, top: f64) -> Vec<String> {
        let lines = self.lines.iter().map(|(class, words, _)| (*class, words.as_str()));
        let deadline = self.deadline.map(|_| ("deadline", "deadline"));
        let row = |(number, (class, words)): (u32, (&str, &str))| {
            let y = top + 20.0 * f64::from(number);
            format!(
                "<path class=\"{class}\" d=\"M{LEFT} {y}h30\"/><text class=\"soft\" x=\"{}\" y=\"{y}\" dy=\"4\">{}</text>\n",
                LEFT + 40.0,
                svg_text(words),
            )
        };
        let rows = lines.chain(deadline).filter(|_| self.lines.len() > 1);
        (0..).zip(rows).map(row).collect()
    }
}

/// Returns lines for the decades of probability, and for at most so many times.
fn grid(decades: f64, (right, height): (f64, f64), axis: &Axis, most: f64) -> String {
    let mut out = String::new();
    for decade in 0..=decades as u32 {
        let at = number(TOP + height * f64::from(decade) / decades);
        let label = if decade == 0 { "1".to_owned() } else { format!("1e-{decade}") };
        let _ = writeln!(
            out,
            "<path class=\"grid\" d=\"M{} {at}H{}\"/><text class=\"soft\" x=\"{}\" y=\"{at}\" dy=\"4\" \
             text-anchor=\"end\">{label}</text>",
            number(LEFT),
            number(right),
            number(LEFT - 10.0),
        );
    }
    for value in axis.ticks(most.round() as usize, 1.0).0 {
        let _ = writeln!(
            out,
            "<path class=\"grid\" d=\"M{x} {}V{}\"/><text class=\"soft\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            number(TOP),
            number(TOP + height),
            number(TOP + height + 20.0),
            Time::from_nanos((value * 1e6).round() as u64).number(),
            x = number(axis.at(value)),
        );
    }
    out
}
