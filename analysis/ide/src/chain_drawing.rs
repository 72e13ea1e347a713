//! Chains as a drawing: a bar for each, stacked by the components that data passes through, or the reasons why it has none. In
//! characters, each component has its own row.
//!
//! ```text
//! Pioneer: chains, latency in ms
//! avoid: ✗ ≤ 526 / 500 ms
//!   hokuyo   ░░░░░░░░██
//!   guidance           ░░░░░░░░░░██
//! ```

use std::fmt::Write as _;

use mauve_diagnostics::{chain_reason, times_of};
use mauve_hir::{Decl, File, Location, ModelDb, Project, config_file, config_of, deployed, file_and_line};
use mauve_syntax::TextRange;
use mauve_timing::{ChainPart, Time, Unit};
use mauve_wcrt::chains::{ChainReport, chains_of};
use mauve_wcrt::{Query, response_times};

use crate::drawing::{Drawing, drawn_name};
use crate::svg::{Anchor, Svg, fitted, text_width};
use crate::text_canvas::{cells, in_columns, in_width, padded};
use mauve_diagnostics::figure::{HintStatus, chain_figure};

/// The chains of a deployment as they are drawn.
#[derive(Debug, Clone)]
pub struct DrawnChains<'db> {
    /// The title.
    pub title: String,
    /// The chains.
    pub all: Vec<DrawnChain<'db>>,
    /// The number of chains that are left out, because they are too many.
    pub left_out: usize,
}

/// A chain as it is drawn.
#[derive(Debug, Clone)]
pub struct DrawnChain<'db> {
    /// Its name.
    pub name: String,
    /// `✓ ≤ 526 / 600 ms`
    pub figure: String,
    /// The colour of the figure.
    pub status: HintStatus,
    /// Its name in `mauve.toml`, if it is declared.
    pub declared: Option<(File, TextRange)>,
    /// Its greatest latency.
    pub latency: Option<Time>,
    /// Its limit.
    pub limit: Option<Time>,
    /// Its components, if it has a latency.
    pub steps: Vec<DrawnStep<'db>>,
    /// Why it has no latency.
    pub reasons: Vec<String>,
}

/// A component in a chain.
#[derive(Debug, Clone)]
pub struct DrawnStep<'db> {
    /// Its instance.
    pub instance: String,
    /// What it adds to the latency.
    pub part: ChainPart,
    /// All of that.
    pub total: Time,
    /// The connection to it; of the first one, its activity.
    pub at: Option<Location<'db>>,
    /// The file and the line of that.
    pub place: String,
}

/// Returns the chains of a deployment as they are drawn, of several only that called `name`. Slack below `tight_slack` percent of the
/// limit is little.
pub fn drawn_chains<'db>(
    db: &'db dyn ModelDb,
    (project, of, query): (Project<'db>, Decl<'db>, Query),
    name: Option<&str>,
    tight_slack: u32,
) -> DrawnChains<'db> {
    let chains = chains_of(db, project, of, query);
    let report = response_times(db, project, of, query);
    let (config, file) = (config_of(db, project.workspace(db)), config_file(db, project.workspace(db)));
    let links = deployed(db, project, of).map_or(&[] as &[_], |(flat, _)| &flat.links);
    let drawn = |chain: &ChainReport<'db>| {
        let forms = chain_figure((chain.latency, chain.limit), "no bound", tight_slack);
        let steps = chain.steps.iter().map(|step| {
            let link = step.connection.and_then(|index| links.get(index)).map(|link| link.at.clone());
            let activity = || report.activities.get(step.activity?)?.at.clone();
            let at = link.or_else(activity);
            let place =
                at.as_ref().map(|at| file_and_line(db, project.workspace(db), at)).unwrap_or_default();
            DrawnStep { instance: step.instance.to_string(), part: step.part, total: step.total(), at, place }
        });
        let declared = chain.declared.and_then(|index| {
            let span = config.chains.get(index)?.span.clone();
            let [start, end] = [span.start, span.end].map(u32::try_from);
            Some((file?, TextRange::new(start.ok()?.into(), end.ok()?.into())))
        });
        DrawnChain {
            name: chain.name.to_string(),
            figure: forms.text().to_owned(),
            status: forms.status,
            declared,
            latency: chain.latency,
            limit: chain.limit,
            steps: steps.filter(|_| chain.latency.is_some()).collect(),
            reasons: chain.reasons.iter().map(|reason| chain_reason(db, chain, reason)).collect(),
        }
    };
    let shown = chains.all.iter().filter(|chain| name.is_none_or(|name| chain.name == name));
    let times = times_of(report.times.as_deref());
    DrawnChains {
        title: format!("{} at {}{times}: latency of chains", drawn_name(of.name(db)), query.level),
        all: shown.map(drawn).collect(),
        left_out: chains.left_out,
    }
}

/// The kinds of parts, in the order in which they pass: the class, the letter, and what the legend says.
const KINDS: [(&str, char, &str); 4] = [
    ("wait", '░', "waits for a release"),
    ("buffer", '▓', "in the buffer"),
    ("periods", '▒', "periods before the write"),
    ("run", '█', "runs until the write"),
];

/// Returns the parts that are not 0, each with its kind.
fn parts_of(part: &ChainPart) -> impl Iterator<Item = ((&'static str, char, &'static str), Time)> {
    let times = [part.wait, part.buffer, part.periods, part.run];
    KINDS.into_iter().zip(times).filter(|(_, time)| *time > Time::ZERO)
}

impl DrawnStep<'_> {
    /// `guidance: waits for a release ≤ 100 ms, runs until the write ≤ 53 ms`
    pub fn description(&self) -> String {
        let parts = parts_of(&self.part).map(|((_, _, what), time)| format!("{what} ≤ {time}"));
        let parts: Vec<String> = parts.collect();
        let lost = if self.part.stays_full { "; the buffer stays full" } else { "" };
        let by_data = if self.part.by_data { "; released by data" } else { "" };
        format!("{}: {}{lost}{by_data}", self.instance, parts.join(", "))
    }
}

/// The most chains in a drawing, and the most reasons of each.
const MOST_ROWS: usize = 100;
const MOST_REASONS: usize = 2;

/// Draws chains, in one scale. In SVG, a chain is a group with `data-chain`, its index, and a component of it one with `data-hop`, its
/// index among those of all chains, and `data-place`, the file and the line of its declaration.
pub fn draw_chains(chains: &DrawnChains<'_>, drawing: Drawing) -> String {
    let DrawnChains { title, all, left_out } = chains;
    let shown = all.get(..MOST_ROWS).unwrap_or(all);
    let longest = shown.iter().flat_map(|it| [it.latency, it.limit]).flatten().max().unwrap_or_default();
    let more = (all.len() - shown.len()).saturating_add(*left_out);
    let more = if more == 0 { String::new() } else { format!("and {more} more") };
    match drawing {
        Drawing::Svg | Drawing::Narrow => svg(title, shown, longest, &more),
        Drawing::Text(_) | Drawing::Dot => text(title, shown, longest, &more, drawing.columns()),
    }
}

const WIDTH: f64 = 400.0;
const MARGIN: f64 = 16.0;
const PLOT: f64 = WIDTH - 2.0 * MARGIN;
const BAR: f64 = 18.0;
/// The height of a line of text, and of one of small names.
const LINE: f64 = 17.0;
const NAME: f64 = 13.0;

fn svg(title: &str, chains: &[DrawnChain<'_>], longest: Time, more: &str) -> String {
    let mut svg = Svg::default();
    let (mut y, mut hop) = (48.0, 0);
    // Writes a line of text of this class, and goes on below it.
    let line = |svg: &mut Svg, class: &str, y: &mut f64, text: &str| {
        svg.text(class, (MARGIN, *y + 12.0), Anchor::Start, text);
        *y += LINE;
    };
    for (index, chain) in chains.iter().enumerate() {
        let title = format!("{}, {}", chain.name, chain.figure);
        svg.group(&format!("box {}", chain.status.name()), &[("data-chain", &index)], &title);
        for text in wrapped(&drawn_name(&chain.name), 13.0, true) {
            line(&mut svg, "name", &mut y, &text);
        }
        line(&mut svg, "figure status", &mut y, &fitted(&chain.figure, PLOT, 12.0, true));
        svg.end();
        y += 4.0;
        if chain.latency.is_some() {
            y += svg_bar(&mut svg, chain, (y, longest), &mut hop);
        }
        for text in shown_reasons(&chain.reasons).iter().flat_map(|reason| wrapped(reason, 12.0, false)) {
            line(&mut svg, "soft", &mut y, &text);
        }
        y += LINE;
    }
    if !more.is_empty() {
        line(&mut svg, "soft", &mut y, more);
        y += LINE / 2.0;
    }
    for (index, (class, _, what)) in KINDS.iter().enumerate() {
        let at = (MARGIN + PLOT / 2.0 * (index % 2) as f64, y + LINE * (index / 2) as f64 + 9.0);
        svg.entry(at, &[(class, "M0 -9h14v10h-14z")], (20.0, "soft"), what);
    }
    svg.document((WIDTH, y + 2.0 * LINE + 8.0), (MARGIN, 28.0), &fitted(title, PLOT, 14.0, true))
}

/// Returns the first reasons, and how many more there are.
fn shown_reasons(all: &[String]) -> Vec<String> {
    let shown = all.get(..MOST_REASONS).filter(|_| all.len() > MOST_REASONS + 1).unwrap_or(all);
    let more = all.len() - shown.len();
    let more = (more > 0).then(|| format!("and {more} more reasons"));
    shown.iter().cloned().chain(more).collect()
}

/// Draws the bar of a chain, with the names of its components below, and its limit; returns the height.
fn svg_bar(svg: &mut Svg, chain: &DrawnChain<'_>, (y, longest): (f64, Time), hop: &mut usize) -> f64 {
    let scale = PLOT / longest.as_f64(Unit::Milliseconds).max(f64::MIN_POSITIVE);
    let width = |time: Time| time.as_f64(Unit::Milliseconds) * scale;
    let (mut x, mut free, mut below) = (MARGIN, [MARGIN; 2], 0);
    for step in &chain.steps {
        svg.group("", &[("data-hop", hop), ("data-place", &step.place)], &step.description());
        *hop += 1;
        // Where the component begins.
        svg.path("base", &format!("M{x:.1} {y:.1}v{}", BAR + 4.0));
        let start = x;
        for ((class, ..), time) in parts_of(&step.part) {
            svg.rect(&format!("slice {class}"), [x, y, width(time).max(0.8), BAR]);
            x += width(time);
        }
        // Below its part, where it has room, otherwise in a second line.
        let label = fitted(&drawn_name(&step.instance), PLOT / 3.0, 11.0, false);
        let length = text_width(&label, 11.0, false);
        let at = (start + 3.0).min(WIDTH - MARGIN - length);
        if let Some((line, free)) = free.iter_mut().enumerate().find(|(_, free)| **free <= at) {
            *free = at + length + 4.0;
            below = below.max(line + 1);
            svg.text("mark", (at, y + BAR + 12.0 + NAME * line as f64), Anchor::Start, &label);
        }
        svg.end();
    }
    if let Some(limit) = chain.limit {
        let at = MARGIN + width(limit);
        if x > at {
            svg.path("overrun", &format!("M{at:.1} {:.1}H{x:.1}", y - 2.0));
        }
        svg.path("deadline", &format!("M{at:.1} {:.1}v{}", y - 4.0, BAR + 8.0));
        let label = format!("limit {limit}");
        // Not over the figure, which is to the left.
        let of_figure = text_width(&chain.figure, 12.0, true) + text_width(&label, 11.0, false);
        svg.text("mark", (at.max(MARGIN + of_figure + 8.0), y - 8.0), Anchor::End, &label);
    }
    BAR + NAME * below as f64 + 4.0
}

/// Returns a text in lines that fit.
fn wrapped(text: &str, size: f64, is_bold: bool) -> Vec<String> {
    let lines = in_width(text, PLOT, "", |it| text_width(it, size, is_bold));
    lines.lines().map(|line| fitted(line, PLOT, size, is_bold)).collect()
}

fn text(title: &str, chains: &[DrawnChain<'_>], longest: Time, more: &str, columns: Option<usize>) -> String {
    /// The most columns of the bars, and those of the time behind them.
    const MOST: usize = 60;
    const TIME: usize = 13;
    let names =
        chains.iter().flat_map(|chain| &chain.steps).map(|step| cells(&drawn_name(&step.instance)) as usize);
    let names = names.max().unwrap_or_default();
    let bars = columns.map_or(MOST, |columns| columns.saturating_sub(names + TIME).clamp(10, MOST));
    let column = |time: Time| {
        (u128::from(time.as_nanos()) * bars as u128).div_ceil(u128::from(longest.as_nanos().max(1))) as usize
    };
    let mut out = format!("{title}\n");
    for chain in chains {
        let name = in_columns(&format!("{}: {}", drawn_name(&chain.name), chain.figure), columns, "  ");
        let _ = writeln!(out, "\n{name}");
        let mut passed = Time::ZERO;
        for step in &chain.steps {
            let mut row = " ".repeat(column(passed));
            for ((_, letter, _), time) in parts_of(&step.part) {
                let before = column(passed);
                passed = passed.checked_add(time).unwrap_or(passed);
                // What is shorter than a column is shown, too.
                row.extend(std::iter::repeat_n(letter, (column(passed) - before).max(1)));
            }
            let name = padded(&drawn_name(&step.instance), names);
            let _ = writeln!(out, "  {name} {row} {}", step.total);
        }
        out.extend(
            chain.reasons.iter().map(|reason| in_columns(&format!("  {reason}"), columns, "    ") + "\n"),
        );
    }
    if !more.is_empty() {
        let _ = writeln!(out, "\n{more}");
    }
    let legend: Vec<String> = KINDS.iter().map(|(_, letter, what)| format!("{letter} {what}")).collect();
    out + "\n" + &in_columns(&legend.join("  "), columns, "") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect;

    fn ms(time: u64) -> Time {
        Time::from_nanos(time * 1_000_000)
    }

    fn draw(all: Vec<DrawnChain<'_>>, left_out: usize, drawing: Drawing) -> String {
        draw_chains(&DrawnChains { title: "Robot: chains".to_owned(), all, left_out }, drawing)
    }

    fn step(instance: &str, [wait, buffer, periods, run]: [u64; 4]) -> DrawnStep<'static> {
        let total = ms(wait + buffer + periods + run);
        let [wait, buffer, periods, run] = [wait, buffer, periods, run].map(ms);
        let part = ChainPart { wait, buffer, periods, run, ..ChainPart::default() };
        DrawnStep { instance: instance.to_owned(), part, total, at: None, place: "robot.mal:7".to_owned() }
    }

    fn chains() -> Vec<DrawnChain<'static>> {
        let avoid = DrawnChain {
            name: "avoid".to_owned(),
            figure: "✗ ≤ 526 / 500 ms".to_owned(),
            status: HintStatus::Missed,
            declared: None,
            latency: Some(ms(526)),
            limit: Some(ms(500)),
            steps: vec![
                step("hokuyo", [100, 0, 0, 53]),
                step("guidance", [100, 0, 100, 20]),
                step("switch", [50, 50, 0, 3]),
                step("p3dx<driver>", [40, 0, 0, 10]),
            ],
            reasons: Vec::new(),
        };
        let manual = DrawnChain {
            name: "joy.commands -> p3dx_driver.aria_drive (through teleop, switch, and a very long list of others)".to_owned(),
            figure: "? may skip".to_owned(),
            status: HintStatus::Unknown,
            declared: None,
            latency: None,
            limit: None,
            steps: Vec::new(),
            reasons: vec!["`switch` may never write `out`: in state `Automatic`, it writes what `guidance` sends".to_owned()],
        };
        let short = DrawnChain {
            name: "stop".to_owned(),
            figure: "✓ ≤ 30 / 100 ms".to_owned(),
            status: HintStatus::Met,
            declared: None,
            latency: Some(ms(30)),
            limit: Some(ms(100)),
            steps: vec![step("bumper", [10, 0, 0, 1]), step("p3dx_driver", [10, 0, 0, 9])],
            reasons: Vec::new(),
        };
        vec![avoid, manual, short]
    }

    #[test]
    fn chains_are_drawn_in_characters() {
        expect![[r#"
            Robot: chains

            avoid: ✗ ≤ 526 / 500 ms
              hokuyo       ░░░░░░░░░░░░██████ 153 ms
              guidance                       ░░░░░░░░░░░▒▒▒▒▒▒▒▒▒▒▒▒██ 220 ms
              switch                                                  ░░░░░░▓▓▓▓▓█ 103 ms
              p3dx<driver>                                                        ░░░░█ 50 ms

            joy.commands -> p3dx_driver.aria_drive (through teleop, switch, and a very long list of others): ? may skip
              `switch` may never write `out`: in state `Automatic`, it writes what `guidance` sends

            stop: ✓ ≤ 30 / 100 ms
              bumper       ░░█ 11 ms
              p3dx_driver    ░█ 19 ms

            and 3 more

            ░ waits for a release  ▓ in the buffer  ▒ periods before the write  █ runs until the write
        "#]].assert_eq(&draw(chains(), 3, Drawing::Text(None)));
    }

    #[test]
    fn bars_and_reasons_fit_the_columns() {
        expect![[r#"
            Robot: chains

            avoid: ✗ ≤ 526 / 500 ms
              hokuyo       ░░░░░███ 153 ms
              guidance             ░░░░░▒▒▒▒█ 220 ms
              switch                         ░░░▓▓█ 103 ms
              p3dx<driver>                        ░░█ 50 ms

            joy.commands -> p3dx_driver.aria_drive (through
              teleop, switch, and a very long list of others):
              ? may skip
              `switch` may never write `out`: in state
                `Automatic`, it writes what `guidance` sends

            stop: ✓ ≤ 30 / 100 ms
              bumper       ░█ 11 ms
              p3dx_driver   ░█ 19 ms

            and 3 more

            ░ waits for a release  ▓ in the buffer  ▒ periods
            before the write  █ runs until the write
        "#]]
        .assert_eq(&draw(chains(), 3, Drawing::Text(Some(50))));
    }

    #[test]
    fn bars_are_stacked_in_one_scale() {
        let svg = draw(chains(), 0, Drawing::Svg);
        let bars = svg.split("<g data-hop=").skip(1).filter_map(|rest| rest.split("</g>").next());
        let bars: String = bars.map(|bar| format!("<g data-hop={bar}</g>\n")).collect();
        expect![[r#"
            <g data-hop="0" data-place="robot.mal:7"><title>hokuyo: waits for a release ≤ 100 ms, runs until the write ≤ 53 ms</title>
            <path class="base" d="M16.0 86.0v22"/>
            <rect class="slice wait" x="16" y="86" width="70" height="18"/>
            <rect class="slice run" x="86" y="86" width="37.1" height="18"/>
            <text class="mark" x="19" y="116">hokuyo</text>
            </g>
            <g data-hop="1" data-place="robot.mal:7"><title>guidance: waits for a release ≤ 100 ms, periods before the write ≤ 100 ms, runs until the write ≤ 20 ms</title>
            <path class="base" d="M123.0 86.0v22"/>
            <rect class="slice wait" x="123" y="86" width="70" height="18"/>
            <rect class="slice periods" x="193" y="86" width="70" height="18"/>
            <rect class="slice run" x="263" y="86" width="14" height="18"/>
            <text class="mark" x="126" y="116">guidance</text>
            </g>
            <g data-hop="2" data-place="robot.mal:7"><title>switch: waits for a release ≤ 50 ms, in the buffer ≤ 50 ms, runs until the write ≤ 3 ms</title>
            <path class="base" d="M277.0 86.0v22"/>
            <rect class="slice wait" x="277" y="86" width="35" height="18"/>
            <rect class="slice buffer" x="311.9" y="86" width="35" height="18"/>
            <rect class="slice run" x="346.9" y="86" width="2.1" height="18"/>
            <text class="mark" x="280" y="116">switch</text>
            </g>
            <g data-hop="3" data-place="robot.mal:7"><title>p3dx&lt;driver&gt;: waits for a release ≤ 40 ms, runs until the write ≤ 10 ms</title>
            <path class="base" d="M349.0 86.0v22"/>
            <rect class="slice wait" x="349" y="86" width="28" height="18"/>
            <rect class="slice run" x="377" y="86" width="7" height="18"/>
            <text class="mark" x="303" y="129">p3dx&lt;driver&gt;</text>
            </g>
            <g data-hop="4" data-place="robot.mal:7"><title>bumper: waits for a release ≤ 10 ms, runs until the write ≤ 1 ms</title>
            <path class="base" d="M16.0 312.0v22"/>
            <rect class="slice wait" x="16" y="312" width="7" height="18"/>
            <rect class="slice run" x="23" y="312" width="0.8" height="18"/>
            <text class="mark" x="19" y="342">bumper</text>
            </g>
            <g data-hop="5" data-place="robot.mal:7"><title>p3dx_driver: waits for a release ≤ 10 ms, runs until the write ≤ 9 ms</title>
            <path class="base" d="M23.7 312.0v22"/>
            <rect class="slice wait" x="23.7" y="312" width="7" height="18"/>
            <rect class="slice run" x="30.7" y="312" width="6.3" height="18"/>
            <text class="mark" x="26.7" y="355">p3dx_driver</text>
            </g>
        "#]].assert_eq(&bars);
        for part in
            ["limit 500 ms", "p3dx&lt;driver&gt;", "class=\"overrun\"", "data-hop=\"5\"", "data-chain=\"2\""]
        {
            assert!(svg.contains(part), "{part} in {svg}");
        }
    }

    #[test]
    fn nothing_and_too_many_are_drawn() {
        let svg = draw(Vec::new(), 0, Drawing::Svg);
        assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{svg}");
        let many: Vec<DrawnChain<'_>> = (0..120).map(|_| chains()[2].clone()).collect();
        let svg = draw(many, 4, Drawing::Svg);
        assert_eq!(svg.matches("data-chain").count(), 100);
        assert!(svg.contains(">and 24 more<"));
    }

    #[test]
    fn long_times_and_times_of_zero_are_drawn() {
        let mut chain = chains().remove(2);
        chain.latency = Some(Time::from_nanos(u64::MAX));
        chain.steps = vec![
            step("a", [0; 4]),
            DrawnStep {
                part: ChainPart {
                    wait: Time::from_nanos(u64::MAX),
                    run: Time::from_nanos(1),
                    ..ChainPart::default()
                },
                ..step("b", [0; 4])
            },
        ];
        for drawing in [Drawing::Svg, Drawing::Text(None)] {
            let drawn = draw(vec![chain.clone()], 0, drawing);
            assert!(!drawn.contains("NaN") && drawn.len() < 100_000, "{drawn}");
        }
    }
}
