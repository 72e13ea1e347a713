//! A probability on a logarithmic axis over a time, as SVG: the levels of tables, a curve, a deadline.

use mauve_timing::{Time, Unit};

use crate::chart::{Axis, step};
use crate::drawing::Drawing;
use crate::svg::{Anchor, Svg, number, text_width};

/// What is drawn.
pub(crate) struct ProbabilityPlot<'a> {
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

impl ProbabilityPlot<'_> {
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
        let mut svg = Svg::default();
        self.grid(&mut svg, decades, height, (&axis, end / step));
        if let Some(deadline) = self.deadline {
            let [x, bottom] = [x(deadline), TOP + height].map(number);
            svg.path("deadline", &format!("M{x} {TOP}V{bottom}"));
        }
        if let Some(level) = self.level {
            svg.path("limit", &format!("M{LEFT} {}H{right}", number(y(level))));
        }
        for (class, words, points) in &self.lines {
            let to = |(time, probability): &(Time, f64)| {
                format!("H{}V{}", number(x(*time)), number(y(*probability)))
            };
            let curve: String = points.iter().map(to).collect();
            // What was observed ends with the greatest. Compared lines have nothing in common.
            let is_short = *class == "seen" || self.level.is_some();
            let end = if is_short { String::new() } else { format!("H{right}") };
            let start = points.first().filter(|_| self.level.is_some()).map_or(LEFT, |(time, _)| x(*time));
            svg.titled_path(class, &format!("M{} {TOP}{curve}{end}", number(start)), words);
        }
        for (index, point) in self.points.iter().enumerate() {
            let (at, down) = (x(point.time), y(point.probability));
            // To the left of the curve, where there is room.
            let has_room = at - LEFT > text_width(&point.label, 12.0, true) + 16.0;
            let (label_x, anchor) =
                if has_room { (at - 9.0, Anchor::End) } else { (at + 9.0, Anchor::Start) };
            // One label at a height, and for a time.
            let is_near = |(other, it): (usize, &PlotPoint)| {
                let is_same = it.time == point.time || (y(it.probability) - down).abs() < 14.0;
                (other > index || it.is_shown) && is_same
            };
            let is_hidden = !point.is_shown && self.points.iter().enumerate().any(is_near);
            let label = if is_hidden { "" } else { &point.label };
            let shown = if point.is_shown { " worst" } else { "" };
            svg.group(&format!("level{shown}"), &[("data-level", &index)], &point.title);
            svg.circle("tip", (at, down), 4.5);
            svg.text("", (label_x, down - 6.0), anchor, label);
            svg.end();
        }
        // A row for each line, where there are several.
        let lines = self.lines.iter().map(|(class, words, _)| (*class, words.as_str()));
        let deadline = self.deadline.map(|_| ("deadline", "deadline"));
        let mut below = TOP + height + 74.0;
        for (class, words) in lines.chain(deadline).filter(|_| self.lines.len() > 1) {
            svg.entry((LEFT, below), &[(class, "M0 -4h30")], (40.0, "soft"), words);
            below += 20.0;
        }
        let width = (right + 60.0).max(text_width(&self.title, 14.0, true) + 48.0);
        let legends = self.lines.iter().map(|it| LEFT + 64.0 + text_width(&it.1, 12.0, false));
        svg.document((legends.fold(width, f64::max), below - 10.0), (24.0, 30.0), &self.title)
    }

    /// Draws lines for the decades of probability, and for at most so many times, with the titles of the axes.
    fn grid(&self, svg: &mut Svg, decades: f64, height: f64, (axis, most): (&Axis, f64)) {
        let (right, bottom) = (LEFT + self.width, TOP + height);
        for decade in 0..=decades as u32 {
            let at = TOP + height * f64::from(decade) / decades;
            let label = if decade == 0 { "1".to_owned() } else { format!("1e-{decade}") };
            svg.path("grid", &format!("M{LEFT} {}H{right}", number(at)));
            svg.text_with("soft", (LEFT - 10.0, at), Anchor::End, &[("dy", &4)], &label);
        }
        for value in axis.ticks(most.round(), 1.0).0 {
            let x = axis.at(value);
            svg.path("grid", &format!("M{} {TOP}V{}", number(x), number(bottom)));
            let label = Time::from_nanos((value * 1e6).round() as u64).number();
            svg.text("soft", (x, bottom + 20.0), Anchor::Middle, &label);
        }
        svg.text("soft", (LEFT + self.width / 2.0, bottom + 44.0), Anchor::Middle, self.axis);
        let upright = format!("translate(26 {}) rotate(-90)", number(TOP + height / 2.0));
        svg.group("", &[("transform", &upright)], "");
        svg.text("soft", (0.0, 0.0), Anchor::Middle, self.upright);
        svg.end();
    }
}
