//! A probability on a logarithmic axis over a time, as SVG: the levels of tables, a curve, a deadline.

use std::fmt::Write as _;

use mauve_timing::{Time, Unit};

use crate::drawing::{number, svg_head, svg_text, text_width};
use crate::execution_report::step;

/// What is drawn.
pub(crate) struct Plot<'a> {
    pub(crate) title: String,
    /// The label of the axis of times.
    pub(crate) axis: &'a str,
    /// The stairs, in descending order of probability: between two points, no smaller probability is known than that of the first.
    pub(crate) points: Vec<PlotPoint>,
    /// A vertical line.
    pub(crate) deadline: Option<Time>,
    /// A second curve, in descending order of probability.
    pub(crate) curve: &'a [(Time, f64)],
}

/// A point of the stairs. In the SVG, each has `data-level` with its index.
pub(crate) struct PlotPoint {
    pub(crate) time: Time,
    pub(crate) probability: f64,
    pub(crate) label: String,
    /// What it says in a tooltip.
    pub(crate) title: String,
    /// Whether it stands out.
    pub(crate) is_shown: bool,
}

const LEFT: f64 = 86.0;
const TOP: f64 = 56.0;
const WIDTH: f64 = 560.0;

/// The least probability that is drawn: sums of doubles do not support less.
const LEAST: f64 = 1e-13;

impl Plot<'_> {
    pub(crate) fn svg(&self) -> String {
        let probabilities =
            self.points.iter().map(|it| it.probability).chain(self.curve.iter().map(|it| it.1));
        let decades = probabilities.map(|it| -it.max(LEAST).log10()).fold(1.0, f64::max).ceil();
        let height = (decades * 34.0).clamp(170.0, 420.0);
        let times =
            self.points.iter().map(|it| it.time).chain(self.deadline).chain(self.curve.iter().map(|it| it.0));
        let greatest = times.map(|it| it.as_f64(Unit::Milliseconds)).fold(0.0, f64::max);
        // At most ten marks.
        let step = step(greatest / 9.0);
        let end = if greatest > 0.0 { (greatest * 1.12 / step).ceil() * step } else { 1.0 };
        let x = |time: Time| LEFT + WIDTH * time.as_f64(Unit::Milliseconds) / end;
        let y = |probability: f64| TOP + height * (-probability.log10() / decades).clamp(0.0, 1.0);
        let size =
            ((LEFT + WIDTH + 60.0).max(text_width(&self.title, 14.0, true) + 48.0), TOP + height + 64.0);
        let mut out = svg_head(size, "x=\"24\" y=\"30\"", &self.title);
        for decade in 0..=decades as u32 {
            let at = number(y(10_f64.powi(-(decade as i32))));
            let label = if decade == 0 { "1".to_owned() } else { format!("1e-{decade}") };
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M{} {at}H{}\"/><text class=\"soft\" x=\"{}\" y=\"{at}\" dy=\"4\" \
                 text-anchor=\"end\">{label}</text>",
                number(LEFT),
                number(LEFT + WIDTH),
                number(LEFT - 10.0),
            );
        }
        for tick in 0..=(end / step).round() as u32 {
            let value = Time::from_nanos((f64::from(tick) * step * 1e6).round() as u64);
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M{x} {}V{}\"/><text class=\"soft\" x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                number(TOP),
                number(TOP + height),
                number(TOP + height + 20.0),
                value.number(),
                x = number(x(value)),
            );
        }
        let _ = writeln!(
            out,
            "<text class=\"soft\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            number(LEFT + WIDTH / 2.0),
            number(TOP + height + 44.0),
            svg_text(self.axis),
        );
        if let Some(deadline) = self.deadline {
            let _ = writeln!(
                out,
                "<path class=\"deadline\" d=\"M{at} {}V{}\"/><text class=\"soft\" x=\"{at}\" y=\"{}\" text-anchor=\"middle\">deadline</text>",
                number(TOP),
                number(TOP + height),
                number(TOP - 6.0),
                at = number(x(deadline)),
            );
        }
        let stairs: Vec<(Time, f64)> = self.points.iter().map(|it| (it.time, it.probability)).collect();
        for (class, points) in [("curve", stairs.as_slice()), ("wire call", self.curve)] {
            let mut curve = String::new();
            for (time, probability) in points {
                if curve.is_empty() {
                    curve = format!("M{} {}", number(LEFT), number(TOP));
                }
                let _ = write!(curve, "H{}V{}", number(x(*time)), number(y(*probability)));
            }
            if !curve.is_empty() {
                let _ = writeln!(out, "<path class=\"{class}\" d=\"{curve}H{}\"/>", number(LEFT + WIDTH));
            }
        }
        for (index, point) in self.points.iter().enumerate() {
            let (at, down) = (x(point.time), y(point.probability));
            // To the left of the curve, where there is room.
            let has_room = at - LEFT > text_width(&point.label, 12.0, true) + 16.0;
            let (label_x, anchor) = if has_room { (at - 9.0, "end") } else { (at + 9.0, "start") };
            let shown = if point.is_shown { " worst" } else { "" };
            let _ = writeln!(
                out,
                "<g class=\"level{shown}\" data-level=\"{index}\"><title>{}</title><circle class=\"tip\" cx=\"{}\" cy=\"{}\" \
                 r=\"4.5\"/><text x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\">{}</text></g>",
                svg_text(&point.title),
                number(at),
                number(down),
                number(label_x),
                number(down - 6.0),
                svg_text(&point.label),
            );
        }
        out + "</svg>\n"
    }
}
