//! The figures of two states as a drawing: of each activity and of the chains that changed, a bar beside its deadline, before as an
//! outline and after as filled. What got worse is first.
//!
//! ```text
//! Pioneer at 1e-4: 8 → 9 of 9 deadlines met
//! with hokuyo.priority=12
//!
//!   guidance ██████████░░░░░░░░░░│░░░  ✓ 113 → 53 / 100 ms  met now
//!   hokuyo   ██████████▓▓        │     ✓ 50 → 60 / 100 ms   later
//!
//!   CPU 1 utilisation: 99.4 %
//! ```

use std::fmt::Write as _;

use mauve_timing::Unit;

use crate::comparison::{Compared, Comparison, Figure, FigureChange};
use crate::drawing::{Drawing, drawn_name};
use crate::svg::{Anchor, Svg, fitted, text_width};
use crate::text_canvas::{cells, in_columns, padded};
use mauve_diagnostics::figure::HintStatus;

impl Comparison {
    /// Returns the rows of a drawing: all activities, then the chains that changed or have a limit.
    pub fn drawn_rows(&self) -> Vec<&Compared> {
        let has_limit = |it: &Option<Figure>| it.as_ref().is_some_and(|it| it.limit.is_some());
        let is_drawn = |it: &&Compared| it.change() != FigureChange::Same || has_limit(&it.after);
        let mut rows: Vec<&Compared> = self.activities.iter().collect();
        rows.extend(self.chains.iter().filter(is_drawn));
        rows
    }

    /// Returns the utilisation of each CPU before and after.
    pub fn utilisations(&self) -> Vec<(String, [String; 2])> {
        let share = |it: Option<&String>| it.map_or_else(|| "–".to_owned(), String::clone);
        let both = self.beside(|it| &it.cpus).into_iter();
        let mut all: Vec<_> = both.map(|(cpu, shares)| (cpu.to_owned(), shares.map(share))).collect();
        all.sort();
        all
    }

    /// Returns `Pioneer at 1e-4: 8 → 9 of 9 deadlines met`.
    pub fn title(&self) -> String {
        let Some(state) = self.state() else { return String::new() };
        format!("{} at {}: {}", drawn_name(&state.deployment), self.level(), self.verdict())
    }
}

impl Compared {
    /// Returns the colour of its figure.
    pub fn status(&self) -> HintStatus {
        self.after.as_ref().map_or(HintStatus::Unknown, |it| it.hint)
    }

    /// Returns how it was called, and what happened to it: `was eye, later`.
    pub fn words(&self) -> String {
        let was = self.was().map(|was| format!("was {}", drawn_name(was)));
        let words = Some(self.change().words().to_owned()).filter(|it| !it.is_empty());
        was.into_iter().chain(words).collect::<Vec<_>>().join(", ")
    }
}

/// The most rows of a drawing.
const MOST_ROWS: usize = 100;

/// Draws the figures of two states beside each other, the second one with these values. In SVG, a row is a group with `data-row`, its
/// index in [`Comparison::drawn_rows`]; the worst change is first.
pub fn draw_comparison(of: &Comparison, values: &[String], drawing: Drawing) -> String {
    let mut rows: Vec<(usize, &Compared)> = of.drawn_rows().into_iter().enumerate().collect();
    rows.sort_by_key(|(_, it)| it.change());
    let shown = rows.get(..MOST_ROWS).unwrap_or(&rows);
    let mut below: Vec<String> = Vec::new();
    if rows.len() > shown.len() {
        below.push(format!("and {} more", rows.len() - shown.len()));
    }
    below.extend(of.unproved());
    below.extend(of.utilisations().into_iter().map(|(cpu, [before, after])| match before == after {
        true => format!("{cpu} utilisation: {after}"),
        false => format!("{cpu} utilisation: {before} → {after}"),
    }));
    let with = if values.is_empty() { String::new() } else { format!("with {}", values.join(", ")) };
    match drawing {
        Drawing::Svg | Drawing::Narrow => svg(&of.title(), &with, shown, &below),
        Drawing::Text(_) | Drawing::Dot => text(&of.title(), &with, shown, &below, drawing.columns()),
    }
}

/// Returns the time as a part of the limit, if it has both.
fn part(figure: Option<&Figure>) -> Option<f64> {
    let figure = figure?;
    let [time, limit] = [figure.time?, figure.limit?].map(|it| it.as_f64(Unit::Milliseconds));
    Some(if limit > 0.0 { time / limit } else { f64::from(time > 0.0) * MOST_PART })
}

/// Longer bars are cut.
const MOST_PART: f64 = 1.3;

const WIDTH: f64 = 420.0;
const MARGIN: f64 = 16.0;
const PLOT: f64 = WIDTH - 2.0 * MARGIN;
/// The right part of a bar's line is for words.
const BARS: f64 = PLOT - 116.0;
const BAR: f64 = 10.0;
const LINE: f64 = 17.0;

fn svg(title: &str, with: &str, rows: &[(usize, &Compared)], below: &[String]) -> String {
    let mut svg = Svg::default();
    let mut y = 48.0;
    let soft = |svg: &mut Svg, y: f64, line: &str| {
        svg.text("soft", (MARGIN, y), Anchor::Start, &fitted(line, PLOT, 12.0, false));
    };
    if !with.is_empty() {
        soft(&mut svg, y, with);
        y += LINE + 4.0;
    }
    for &row in rows {
        y = svg_row(&mut svg, row, y);
    }
    y += 4.0;
    for line in below {
        soft(&mut svg, y, line);
        y += LINE;
    }
    // What the bars mean.
    svg.group("box", &[], "");
    let mut x = MARGIN;
    let bar = "M0 -8h16v8h-16z";
    let signs = [("outline", bar, "before"), ("filled", bar, "now"), ("deadline", "M8 -10v12", "deadline")];
    for (class, sign, what) in signs {
        svg.entry((x, y), &[(class, sign)], (22.0, "mark"), what);
        x += 34.0 + text_width(what, 11.0, false);
    }
    svg.end();
    svg.document((WIDTH, y + 14.0), (MARGIN, 26.0), &fitted(title, PLOT, 14.0, true))
}

/// Draws a row; returns where the next one begins.
fn svg_row(svg: &mut Svg, (index, row): (usize, &Compared), mut y: f64) -> f64 {
    let (name, figure, words) = (row.name(), row.figure(), row.words());
    let (top, right) = (y - LINE, WIDTH - MARGIN);
    let said = if words.is_empty() { String::new() } else { format!(", {words}") };
    let fields = row.fields().into_iter().map(|field| format!("; {field}")).collect::<String>();
    let title = format!("{}: {figure}{said}{fields}", drawn_name(name));
    let (name, figure) = (fitted(&drawn_name(name), PLOT, 13.0, true), fitted(&figure, PLOT, 12.0, true));
    let mut parts = Svg::default();
    parts.text("name", (MARGIN, y), Anchor::Start, &name);
    // In a line of its own, if it has no room beside the name.
    if text_width(&name, 13.0, true) + text_width(&figure, 12.0, true) + 8.0 > PLOT {
        y += LINE;
    }
    parts.text("figure status", (right, y), Anchor::End, &figure);
    let bars = [row.before.as_ref(), row.after.as_ref()].map(part);
    let has_bar = bars.iter().any(Option::is_some);
    if has_bar || !words.is_empty() {
        y += 8.0;
        if has_bar {
            svg_bars(&mut parts, bars, y);
        }
        y += BAR;
        if !words.is_empty() {
            let words = fitted(&words, PLOT - BARS - 8.0, 11.0, false);
            parts.text("mark", (right, y - 1.0), Anchor::End, &words);
        }
    }
    svg.group(&format!("box {}", row.status().name()), &[("data-row", &index)], &title);
    // All of the row can be pointed at.
    svg.rect_with("row", [MARGIN / 2.0, top, WIDTH - MARGIN, y + 7.0 - top], &[("rx", &3)], "");
    svg.markup(parts.elements().trim_end());
    svg.end();
    y + LINE + 7.0
}

/// Draws the bars before and after, in a scale that ends the deadline at one place.
fn svg_bars(svg: &mut Svg, [before, after]: [Option<f64>; 2], y: f64) {
    let limit = BARS / MOST_PART;
    svg.rect("track", [MARGIN, y, limit, BAR]);
    let mut bar = |class: &str, part: f64, by: f64| {
        svg.rect(class, [MARGIN, y - by, (limit * part.min(MOST_PART)).max(1.0), BAR + 2.0 * by]);
    };
    after.into_iter().for_each(|part| bar("filled", part, 0.0));
    before.into_iter().filter(|_| before != after).for_each(|part| bar("outline", part, 2.0));
    svg.path("deadline", &format!("M{:.1} {:.1}v{}", MARGIN + limit, y - 4.0, BAR + 8.0));
    // A cut bar goes on.
    if before.into_iter().chain(after).any(|part| part > MOST_PART) {
        svg.path("tip", &format!("M{:.1} {:.1}l-6 -4v8z", MARGIN + BARS + 8.0, y + BAR / 2.0));
    }
}

fn text(
    title: &str,
    with: &str,
    rows: &[(usize, &Compared)],
    below: &[String],
    columns: Option<usize>,
) -> String {
    const LIMIT: f64 = 20.0;
    let most = (LIMIT * MOST_PART) as usize;
    let column = |part: f64| ((LIMIT * part).ceil() as usize).min(most);
    let bars = |row: &Compared| {
        let [before, after] = [row.before.as_ref(), row.after.as_ref()].map(part);
        let [one, other] = [before, after].map(|it| it.map_or(0, column));
        let both = if before.is_some() { one.min(other) } else { other };
        let cell = |index: usize| match index {
            _ if index < both => '█',
            _ if index < one => '░',
            _ if index < other => '▓',
            _ => ' ',
        };
        let mut bar: Vec<char> = (0..most).map(cell).collect();
        bar.insert(LIMIT as usize, if before.or(after).is_some() { '│' } else { ' ' });
        let is_cut = before.into_iter().chain(after).any(|part| part > MOST_PART);
        bar.push(if is_cut { '▸' } else { ' ' });
        bar.into_iter().collect::<String>()
    };
    let names = rows.iter().map(|(_, row)| cells(&drawn_name(row.name())) as usize).max().unwrap_or_default();
    let figures = rows.iter().map(|(_, row)| cells(&row.figure()) as usize).max().unwrap_or_default();
    let words = rows.iter().map(|(_, row)| cells(&row.words()) as usize).max().unwrap_or_default();
    // The figures before the bars.
    let has_bars = columns.is_none_or(|columns| names + most + figures + words + 9 <= columns);
    let mut out = in_columns(title, columns, "  ") + "\n";
    if !with.is_empty() {
        let _ = writeln!(out, "{}", in_columns(with, columns, "  "));
    }
    out.push('\n');
    for (_, row) in rows {
        let (name, figure) = (padded(&drawn_name(row.name()), names), padded(&row.figure(), figures));
        let bars = if has_bars { bars(row) + "  " } else { " ".to_owned() };
        let line = format!("  {name} {bars}{figure}  {}", row.words());
        let _ = writeln!(out, "{}", line.trim_end());
    }
    out.push('\n');
    out.extend(below.iter().map(|line| in_columns(&format!("  {line}"), columns, "    ") + "\n"));
    if has_bars { out + "\n█ now  ░ before  ▓ more than before  │ deadline\n" } else { out }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::Figures;
    use crate::fixture::Fixture;
    use crate::what_if::what_if;
    use expect_test::expect;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{names_of, projects};
    use mauve_wcrt::Query;

    const MODEL: &str = "//- /mauve.toml
timing.tables = [\"t.toml\"]
//- /t.toml
codel.look = 4
codel.plan = 10
//- /m.mal
shell S { } codel look(): int codel plan(): int
core Look(S) { update = { look(); } } core Plan(S) { update = { plan(); } }
component Eye(S, Look) component Planner(S, Plan)
architecture A { instance eye: Eye instance planner: Planner instance spare: Planner }
deployment D { architecture A
  activity eye { affinity = 1 priority = 3 period = 10 }
  activity planner { affinity = 1 priority = 2 period = 20 }
  activity spare { affinity = 2 priority = 1 period = 100 }
}";

    fn compared(values: &[&str]) -> Comparison {
        let fixture = Fixture::new(MODEL);
        let db = &fixture.db;
        let project = projects(db, fixture.workspace)[0];
        let of = names_of(db, project).anywhere(Kind::Deployment, "D")[0];
        let values: Vec<String> = values.iter().map(ToString::to_string).collect();
        what_if(db, (project, of, Query::shown(db, project, of)), &values).unwrap()
    }

    fn text(of: &Comparison) -> String {
        draw_comparison(of, &["eye.priority=1".to_owned()], Drawing::Text(None))
    }

    #[test]
    fn what_got_worse_is_first() {
        let worse = compared(&["eye.priority=1", "plan=7ms"]);
        expect![[r#"
            D at 1e-4: 3 → 2 of 3 deadlines met
            with eye.priority=1

              eye     ████████▓▓▓▓▓▓▓▓▓▓▓▓│▓▓       ✗ 4 → 11 / 10 ms   no longer met
              planner ███████░░░░░░░░░░░  │         ✓ 18 → 7 / 20 ms   earlier
              spare   ██                  │         ✓ 10 → 7 / 100 ms  earlier

              CPU 1 utilisation: 90.0 % → 75.0 %
              CPU 2 utilisation: 10.0 % → 7.0 %

            █ now  ░ before  ▓ more than before  │ deadline
        "#]]
        .assert_eq(&text(&worse));
        let better = compared(&["eye.period=20", "spare.period=200"]);
        expect![[r#"
            D at 1e-4: 3 of 3 deadlines met, as before
            with eye.priority=1

              eye     ████░░░░            │         ✓ 4 / 10 → ✓ 4 / 20 ms      relaxed
              spare   █░                  │         ✓ 10 / 100 → ✓ 10 / 200 ms  relaxed
              planner ██████████████░░░░  │         ✓ 18 → 14 / 20 ms           earlier

              CPU 1 utilisation: 90.0 % → 70.0 %
              CPU 2 utilisation: 10.0 % → 5.0 %

            █ now  ░ before  ▓ more than before  │ deadline
        "#]]
        .assert_eq(&text(&better));
    }

    #[test]
    fn bars_have_one_deadline() {
        let svg =
            draw_comparison(&compared(&["eye.priority=1"]), &["eye.priority=1".to_owned()], Drawing::Svg);
        let from = svg.find("<text class=\"soft\"").unwrap();
        expect![[r#"
            <text class="soft" x="16" y="48">with eye.priority=1</text>
            <g class="box missed" data-row="0"><title>eye: ✗ 4 → 14 / 10 ms, no longer met; priority 3 → 1</title>
            <rect class="row" x="8" y="52" width="404" height="42" rx="3"/>
            <text class="name" x="16" y="69">eye</text>
            <text class="figure status" x="404" y="69" text-anchor="end">✗ 4 → 14 / 10 ms</text>
            <rect class="track" x="16" y="77" width="209.2" height="10"/>
            <rect class="filled" x="16" y="77" width="272" height="10"/>
            <rect class="outline" x="16" y="75" width="83.7" height="14"/>
            <path class="deadline" d="M225.2 73.0v18"/>
            <path class="tip" d="M296.0 82.0l-6 -4v8z"/>
            <text class="mark" x="404" y="86" text-anchor="end">no longer met</text>
            </g>
            <g class="box met" data-row="1"><title>planner: ✓ 18 → 10 / 20 ms, earlier</title>
            <rect class="row" x="8" y="94" width="404" height="42" rx="3"/>
            <text class="name" x="16" y="111">planner</text>
            <text class="figure status" x="404" y="111" text-anchor="end">✓ 18 → 10 / 20 ms</text>
            <rect class="track" x="16" y="119" width="209.2" height="10"/>
            <rect class="filled" x="16" y="119" width="104.6" height="10"/>
            <rect class="outline" x="16" y="117" width="188.3" height="14"/>
            <path class="deadline" d="M225.2 115.0v18"/>
            <text class="mark" x="404" y="128" text-anchor="end">earlier</text>
            </g>
            <g class="box met" data-row="2"><title>spare: ✓ 10 / 100 ms</title>
            <rect class="row" x="8" y="136" width="404" height="42" rx="3"/>
            <text class="name" x="16" y="153">spare</text>
            <text class="figure status" x="404" y="153" text-anchor="end">✓ 10 / 100 ms</text>
            <rect class="track" x="16" y="161" width="209.2" height="10"/>
            <rect class="filled" x="16" y="161" width="20.9" height="10"/>
            <path class="deadline" d="M225.2 157.0v18"/>
            </g>
            <text class="soft" x="16" y="199">CPU 1 utilisation: 90.0 %</text>
            <text class="soft" x="16" y="216">CPU 2 utilisation: 10.0 %</text>
            <g class="box">
            <g transform="translate(16 233)">
            <path class="outline" d="M0 -8h16v8h-16z"/>
            <text class="mark" x="22" y="0">before</text>
            </g>
            <g transform="translate(87.4 233)">
            <path class="filled" d="M0 -8h16v8h-16z"/>
            <text class="mark" x="22" y="0">now</text>
            </g>
            <g transform="translate(146.5 233)">
            <path class="deadline" d="M8 -10v12"/>
            <text class="mark" x="22" y="0">deadline</text>
            </g>
            </g>
            </svg>
        "#]].assert_eq(&svg[from..]);
    }

    #[test]
    fn names_are_escaped_and_long_bars_are_cut() {
        let mut it = compared(&["look=100ms"]);
        for figure in it.activities.iter_mut().flat_map(|it| [&mut it.before, &mut it.after]).flatten() {
            figure.name = "<a & \"b\">".into();
        }
        let svg = draw_comparison(&it, &["<x>".to_owned()], Drawing::Svg);
        assert!(svg.contains("&lt;a &amp; &quot;b&quot;&gt;") && svg.contains("with &lt;x&gt;"), "{svg}");
        assert!(!svg.contains("<a ") && !svg.contains("NaN"), "{svg}");
        it.activities = std::iter::repeat_n(it.activities, 60).flatten().collect();
        let svg = draw_comparison(&it, &[], Drawing::Svg);
        assert!(svg.matches("data-row").count() == 100 && svg.contains("and 80 more"), "{svg}");
        it.after.as_mut().unwrap().errors = 2;
        let text = draw_comparison(&it, &[], Drawing::Text(None));
        assert!(text.contains("\n  not proved: the project has 2 errors\n"), "{text}");
        let nothing = draw_comparison(&Comparison::of(None, None), &[], Drawing::Svg);
        assert!(nothing.ends_with("</svg>\n"), "{nothing}");
    }

    #[test]
    fn figures_survive_a_client() {
        let of = compared(&["eye.priority=1"]);
        let before = of.before.clone().unwrap();
        let kept = serde_json::to_string(&before).unwrap();
        assert_eq!(serde_json::from_str::<Figures>(&kept).unwrap(), before);
        for wrong in ["", "[]", "{}", &kept.replace("\"met\"", "\"fine\"")] {
            assert!(serde_json::from_str::<Figures>(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn tight_slack_is_that_of_the_user() {
        let of = compared(&[]).after.unwrap();
        let shown = |percent| {
            let figures = of.clone().with_tight_slack(percent);
            figures.activities.iter().map(|it| format!("{} {}", it.shown, it.hint.name())).collect::<Vec<_>>()
        };
        assert_eq!(shown(10)[1], "✓ 18 / 20 ms met");
        assert_eq!(shown(11)[1], "! 18 / 20 ms tight");
    }
}
