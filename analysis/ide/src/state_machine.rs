//! A component's periodic state machine as a drawing: states, and the greatest execution time between each pair of them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use mauve_diagnostics::times_of;
use mauve_timing::{Level, Time, Unit};
use mauve_wcrt::Psm;
#[cfg(doc)]
use mauve_wcrt::TableSet;

use crate::drawing::{Drawing, dot_text, svg_arrow, svg_head, svg_text};

/// Draws `psm`, the state machine of `component` at `level` with the timing tables of `times` ([`TableSet::section`]), with the initial state and the greatest edges in bold. Of several
/// edges between two states, draws the greatest, with the names of all transitions. In SVG, `data-state`, `data-source` and
/// `data-target` hold the numbers of states, so that a client can handle clicks.
pub fn draw_state_machine(
    component: &str,
    level: Level,
    times: Option<&str>,
    psm: &Psm<'_>,
    drawing: Drawing,
) -> String {
    let title = title(component, level, times, psm);
    let mut arrows: BTreeMap<(usize, usize), Arrow> = BTreeMap::new();
    for (edge, described) in psm.machine.edges().iter().zip(&psm.edges.all) {
        let arrow = arrows.entry((edge.source as usize, edge.target as usize)).or_default();
        arrow.cost = arrow.cost.max(edge.cost);
        arrow.names.push(described.transition.as_ref().map_or("", |name| name.as_str()));
    }
    match drawing {
        Drawing::Dot => dot(component, &title, psm, &arrows),
        Drawing::Svg => svg(&title, psm, &arrows),
    }
}

#[derive(Default)]
struct Arrow<'a> {
    cost: Time,
    /// The names of the transitions; empty if the state stays the same.
    names: Vec<&'a str>,
}

impl Arrow<'_> {
    fn label(&self) -> String {
        let mut names: Vec<&str> = self.names.iter().copied().filter(|name| !name.is_empty()).collect();
        names.dedup();
        let names = names.join(", ");
        // Times on the arrows of a picture are in milliseconds: its title says so.
        let cost = self.cost.as_f64(Unit::Milliseconds);
        if names.is_empty() { cost.to_string() } else { format!("{names}: {cost}") }
    }
}

fn dot(component: &str, title: &str, psm: &Psm<'_>, arrows: &BTreeMap<(usize, usize), Arrow<'_>>) -> String {
    let mut out = format!("digraph {} {{\n", dot_text(component));
    let _ = writeln!(
        out,
        "  label={}; labelloc=t; rankdir=LR; node [shape=box, style=rounded];",
        dot_text(title)
    );
    for (index, state) in psm.states.iter().enumerate() {
        let bold = if index == psm.initial { " [penwidth=2]" } else { "" };
        let _ = writeln!(out, "  {}{bold};", dot_text(state));
    }
    for ((source, target), arrow) in arrows {
        let name = |state: &usize| dot_text(psm.states.get(*state).map_or("", |name| name.as_str()));
        let _ = writeln!(out, "  {} -> {} [label={}];", name(source), name(target), dot_text(&arrow.label()));
    }
    out + "}\n"
}

fn title(component: &str, level: Level, times: Option<&str>, psm: &Psm<'_>) -> String {
    let assumed = if psm.assumed.is_empty() { "" } else { ", some of them assumed" };
    format!("{component} at {level}{}: execution times per period in ms{assumed}", times_of(times))
}

/// Places the states on a circle, clockwise from the top in text order.
fn svg(title: &str, psm: &Psm<'_>, arrows: &BTreeMap<(usize, usize), Arrow<'_>>) -> String {
    let count = psm.states.len().max(1);
    let radius = if count == 1 { 0.0 } else { (60.0 * count as f64).max(150.0) };
    let (width, height) = (2.0 * radius + 360.0, 2.0 * radius + 220.0);
    let (cx, cy) = (width / 2.0, height / 2.0 + 20.0);
    let place = |state: usize| {
        let angle = std::f64::consts::TAU * state as f64 / count as f64 - std::f64::consts::FRAC_PI_2;
        (cx + radius * angle.cos(), cy + radius * angle.sin())
    };
    let middle = format!("x=\"{cx:.0}\" y=\"24\" text-anchor=\"middle\"");
    let mut out = svg_head((width, height), &middle, title);
    let greatest = arrows.values().map(|arrow| arrow.cost).max().unwrap_or_default();
    for (&(source, target), arrow) in arrows {
        let heavy = if arrow.cost == greatest { " stroke-width=\"2.5\"" } else { "" };
        let (path, (x, y)) = if source == target {
            let (x, y) = place(source);
            (
                format!(
                    "M{:.1} {:.1} C{:.1} {:.1} {:.1} {:.1} {:.1} {:.1}",
                    x - 18.0,
                    y - 20.0,
                    x - 40.0,
                    y - 70.0,
                    x + 40.0,
                    y - 70.0,
                    x + 18.0,
                    y - 20.0
                ),
                (x, y - 64.0),
            )
        } else {
            between(place(source), place(target))
        };
        out += &svg_arrow(&path, (source, target), heavy);
        // A white outline keeps the label readable on lines; not every viewer supports `paint-order`.
        for paint in ["stroke=\"#fff\" stroke-width=\"4\" fill=\"#fff\"", "fill=\"#234\""] {
            let _ = writeln!(
                out,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" {paint}>{}</text>",
                svg_text(&arrow.label())
            );
        }
    }
    for (index, state) in psm.states.iter().enumerate() {
        let (x, y) = place(index);
        let width = 24.0 + 8.0 * state.chars().count() as f64;
        let initial = if index == psm.initial { " stroke-width=\"2.5\"" } else { "" };
        let _ = writeln!(
            out,
            "<rect data-state=\"{index}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{width:.1}\" height=\"40\" rx=\"12\" fill=\"#eef3f8\" \
             stroke=\"#456\"{initial}/>\n<text data-state=\"{index}\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            x - width / 2.0,
            y - 20.0,
            y + 5.0,
            svg_text(state)
        );
    }
    out + "</svg>\n"
}

/// Returns a curve between two boxes, bent to the left so that opposite curves stay apart, and the position of its label.
fn between((x1, y1): (f64, f64), (x2, y2): (f64, f64)) -> (String, (f64, f64)) {
    let (dx, dy) = (x2 - x1, y2 - y1);
    let length = dx.hypot(dy).max(1.0);
    let (nx, ny) = (dy / length, -dx / length);
    let (mx, my) = ((x1 + x2) / 2.0 + 36.0 * nx, (y1 + y2) / 2.0 + 36.0 * ny);
    // From edge to edge of boxes that are about 100 wide and 40 high.
    let edge = |x: f64, y: f64| {
        let (dx, dy) = (mx - x, my - y);
        let scale = (58.0 / dx.abs().max(1e-6)).min(23.0 / dy.abs().max(1e-6)).min(1.0);
        (x + dx * scale, y + dy * scale)
    };
    let ((sx, sy), (tx, ty)) = (edge(x1, y1), edge(x2, y2));
    (format!("M{sx:.1} {sy:.1} Q{mx:.1} {my:.1} {tx:.1} {ty:.1}"), (mx - 8.0 * nx, my - 8.0 * ny + 4.0))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use expect_test::expect;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};
    use mauve_wcrt::{first_tables, psm_of};

    const MODEL: &str = r#"
codel plan(): int
shell S { }
core C(S) {
  statemachine {
    initial state Waiting { transition go if (plan() > 0) to Moving }
    state Moving { run = { plan(); plan(); }  transition done to Waiting }
  }
}
component Pilot(S, C)
//- /mauve.toml
[assume]
codel = "1.5 ms"
"#;

    fn drawn(drawing: Drawing) -> String {
        let db = Database::default();
        let texts = mauve_tests::fixture(MODEL).into_iter().map(|(path, text)| (PathBuf::from(path), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let project = projects(&db, workspace)[0];
        let pilot = names_of(&db, project).anywhere(Kind::Component, "Pilot")[0];
        let psm =
            psm_of(&db, first_tables(&db, project, pilot), pilot, Level::TEN_TO_MINUS_FOUR).as_ref().unwrap();
        draw_state_machine("Pilot", Level::TEN_TO_MINUS_FOUR, None, psm, drawing)
    }

    #[test]
    fn as_dot() {
        expect![[r#"
            digraph "Pilot" {
              label="Pilot at 1e-4: execution times per period in ms, some of them assumed"; labelloc=t; rankdir=LR; node [shape=box, style=rounded];
              "Waiting" [penwidth=2];
              "Moving";
              "Waiting" -> "Waiting" [label="1.5"];
              "Waiting" -> "Moving" [label="go: 1.5"];
              "Moving" -> "Waiting" [label="done: 3"];
            }
        "#]]
        .assert_eq(&drawn(Drawing::Dot));
    }

    #[test]
    fn as_svg() {
        let svg = drawn(Drawing::Svg);
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        for label in [">1.5<", ">go: 1.5<", ">done: 3<", ">Waiting<", ">Moving<"] {
            assert!(svg.contains(label), "{label} in {svg}");
        }
    }
}
