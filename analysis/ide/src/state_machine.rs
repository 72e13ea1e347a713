//! A component's state machine as a drawing: a box for each state, and a line for the transitions between each pair, with their
//! execution times. The periods with the greatest total are emphasised.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use mauve_diagnostics::times_of;
use mauve_hir::{Location, ModelDb, Workspace, file_and_line};
use mauve_timing::{Level, Time, Unit};
#[cfg(doc)]
use mauve_wcrt::TableSet;

use crate::drawing::{Drawing, dot_head, dot_text, drawn_name, too_large};
use crate::layout::{Area, BoxSize, CELLS, Diagram, LineEnds, PIXELS, Placement, Spacing, place};
use crate::machine_view::{MachineEdge, MachineView};
use crate::svg::{Anchor, Attributes, Svg, path_through, text_width, tip_of};
use crate::text_canvas::{TextCanvas, cells, padded};

/// What a drawing of a state machine says besides its states and edges.
#[derive(Debug, Clone, Copy)]
pub struct MachineTitle<'a> {
    /// The component.
    pub component: &'a str,
    /// The level of the times.
    pub level: Level,
    /// Their timing tables: see [`TableSet::section`].
    pub times: Option<&'a str>,
}

impl MachineTitle<'_> {
    fn text(&self, view: &MachineView<'_>) -> String {
        let assumed = view.psm.is_some_and(|psm| !psm.assumed.is_empty());
        let component = drawn_name(self.component);
        let times = match view.psm {
            Some(_) if assumed => "execution times per period in ms, some of them assumed",
            Some(_) => "execution times per period in ms",
            None => "execution times unknown",
        };
        format!("{component} at {}{}: {times}", self.level, times_of(self.times))
    }
}

/// Draws a state machine. One line shows all edges from one state to another, each with its time.
///
/// In SVG, boxes have `data-state`, lines `data-source` and `data-target`, with the numbers of states, and texts of edges
/// `data-edge`, with the number of the edge. `data-place` holds the file and the line of the declaration. What belongs to the
/// worst trace has the class `worst`.
pub fn draw_state_machine<'db>(
    db: &'db dyn ModelDb,
    workspace: Workspace,
    title: MachineTitle<'_>,
    view: &MachineView<'db>,
    drawing: Drawing,
) -> String {
    let interrupt = || db.unwind_if_revision_cancelled();
    let place_of = |at: &Location<'db>| {
        interrupt();
        file_and_line(db, workspace, at)
    };
    let machine = DrawnMachine::new(title.text(view), view, place_of);
    let drawn = match drawing {
        Drawing::Dot => Some(machine.dot(&drawn_name(title.component))),
        Drawing::Svg | Drawing::Narrow => machine.svg(&interrupt),
        Drawing::Text(columns) => machine.text(columns, &interrupt),
    };
    drawn.unwrap_or_else(|| {
        let content = format!("{} states and {} transitions", machine.states.len(), view.edges.len());
        too_large(drawing, &machine.title, &content, "mauve psm")
    })
}

struct DrawnMachine {
    title: String,
    states: Vec<DrawnState>,
    /// By source and target.
    arrows: Vec<Arrow>,
}

struct DrawnState {
    name: String,
    is_initial: bool,
    is_worst: bool,
    place: String,
}

struct Arrow {
    source: usize,
    target: usize,
    edges: Vec<DrawnEdge>,
}

/// The edge with the greatest time of each transition, with its number.
type ByTransition<'a, 'db> = BTreeMap<&'a str, (usize, &'a MachineEdge<'db>)>;

/// The edges of one transition between two states.
struct DrawnEdge {
    /// The number of the one with the greatest time.
    edge: usize,
    /// `done: 3`.
    label: String,
    /// `label`, wide enough for usual times: a drawing keeps its shape while times change.
    widest: String,
    is_worst: bool,
    place: String,
}

impl DrawnMachine {
    fn new<'db>(
        title: String,
        view: &MachineView<'db>,
        place_of: impl Fn(&Location<'db>) -> String,
    ) -> DrawnMachine {
        let place_of = |at: &Option<Location<'db>>| at.as_ref().map(&place_of).unwrap_or_default();
        let mut arrows: BTreeMap<(usize, usize), ByTransition<'_, 'db>> = BTreeMap::new();
        for (number, edge) in view.edges.iter().enumerate() {
            let of_pair = arrows.entry((edge.source, edge.target)).or_default();
            let name = edge.transition.as_ref().map_or("", |name| name.as_str());
            let greatest = of_pair.entry(name).or_insert((number, edge));
            if edge.time > greatest.1.time {
                *greatest = (number, edge);
            }
        }
        let at_state = |state: usize| view.states.get(state).map_or(&None, |state| &state.at);
        let worst = |number: usize| view.worst_trace.contains(&number);
        let in_worst = |state: usize| {
            let edges = view.worst_trace.iter().filter_map(|&edge| view.edges.get(edge));
            edges.into_iter().any(|edge| edge.source == state)
        };
        let drawn = |(name, (number, edge)): (&str, (usize, &MachineEdge<'db>))| {
            let unknown = if view.psm.is_some() { "never" } else { "?" };
            let (name, time) = (drawn_name(name), edge.time.map_or_else(|| unknown.to_owned(), milliseconds));
            let label =
                |time: &str| if name.is_empty() { time.to_owned() } else { format!("{name}: {time}") };
            DrawnEdge {
                edge: number,
                label: label(&time),
                widest: label(&format!("{time:0>7}")),
                is_worst: worst(number),
                // A period without a transition has the place of its state.
                place: place_of(if edge.at.is_some() { &edge.at } else { at_state(edge.source) }),
            }
        };
        DrawnMachine {
            title,
            states: (view.states.iter().enumerate())
                .map(|(number, state)| DrawnState {
                    name: drawn_name(&state.name),
                    is_initial: state.initial,
                    is_worst: in_worst(number),
                    place: place_of(&state.at),
                })
                .collect(),
            arrows: (arrows.into_iter())
                .map(|((source, target), edges)| Arrow {
                    source,
                    target,
                    edges: edges.into_iter().map(drawn).collect(),
                })
                .collect(),
        }
    }

    fn dot(&self, component: &str) -> String {
        let mut out = dot_head(component, &self.title, "rounded");
        for state in &self.states {
            let bold = if state.is_initial { " [penwidth=2]" } else { "" };
            let _ = writeln!(out, "  {}{bold};", dot_text(&state.name));
        }
        for arrow in &self.arrows {
            let name =
                |state: usize| dot_text(self.states.get(state).map_or("", |state| state.name.as_str()));
            let labels: Vec<&str> = arrow.edges.iter().map(|edge| edge.label.as_str()).collect();
            let bold = if arrow.is_worst() { ", penwidth=2" } else { "" };
            let label = dot_text(&labels.join("\n")).replace('\n', "\\n");
            let _ =
                writeln!(out, "  {} -> {} [label={label}{bold}];", name(arrow.source), name(arrow.target));
        }
        out + "}\n"
    }

    /// Places the states. `size` returns the size of a state, and `label` that of the label of an arrow.
    fn place(
        &self,
        spacing: Spacing,
        row: f64,
        size: impl Fn(&DrawnState) -> (f64, f64),
        label: impl Fn(&Arrow) -> (f64, f64),
        interrupt: &dyn Fn(),
    ) -> Option<Placement> {
        let mut diagram = Diagram::default();
        for state in &self.states {
            let (width, height) = size(state);
            diagram.boxes.push(BoxSize { width, height, row, ..BoxSize::default() });
        }
        let mut port = |number: usize| {
            let ports = diagram.boxes.get_mut(number).map(|it| &mut it.ports);
            ports.map_or(0, |ports| {
                ports.push(None);
                ports.len() - 1
            })
        };
        for arrow in &self.arrows {
            let source = (arrow.source, port(arrow.source));
            let target = (arrow.target, port(arrow.target));
            diagram.lines.push(LineEnds { source, target, label: Some(label(arrow)) });
        }
        place(&diagram, spacing, interrupt)
    }

    fn svg(&self, interrupt: &dyn Fn()) -> Option<String> {
        const ROW: f64 = 15.0;
        let size = |state: &DrawnState| {
            let width = text_width(&state.name, 13.0, true) + 32.0;
            ((width / 8.0).ceil() * 8.0, 38.0)
        };
        let label = |arrow: &Arrow| {
            let widths = arrow.edges.iter().map(|edge| text_width(&edge.widest, 12.0, true));
            (widths.fold(0.0, f64::max).ceil(), arrow.edges.len() as f64 * ROW)
        };
        let spacing = Spacing { boxes: 30.0, lines: 14.0, turns: 10.0, label: 3.0, ..PIXELS };
        let placement = self.place(spacing, 14.0, size, label, interrupt)?;
        let mut svg = Svg::default();
        for (arrow, line) in self.arrows.iter().zip(&placement.lines) {
            let worst = if arrow.is_worst() { " worst" } else { "" };
            let ends: Attributes<'_> = &[("data-source", &arrow.source), ("data-target", &arrow.target)];
            svg.group(&format!("link{worst}"), ends, "");
            svg.path("wire", &path_through(&line.points));
            svg.path("tip", &tip_of(&line.points));
            svg.end();
            let Some(area) = line.label else { continue };
            for (row, edge) in arrow.edges.iter().enumerate() {
                let class = if edge.is_worst { "label worst" } else { "label" };
                let at = (area.x + area.width / 2.0, area.y + (row as f64 + 1.0) * ROW - 3.5);
                let data: Attributes<'_> = &[("data-edge", &edge.edge), ("data-place", &edge.place)];
                svg.text_with(class, at, Anchor::Middle, data, &edge.label);
            }
        }
        for ((index, state), placed) in self.states.iter().enumerate().zip(&placement.boxes) {
            let Area { x, y, width, height } = placed.area;
            let (initial, said) =
                if state.is_initial { (" initial", ", the initial state") } else { ("", "") };
            let worst = if state.is_worst { " worst" } else { "" };
            let data: Attributes<'_> = &[("data-state", &index), ("data-place", &state.place)];
            svg.group(&format!("box{initial}{worst}"), data, &format!("{}{said}", state.name));
            svg.rect_with("frame", placed.area.into(), &[("rx", &12)], "");
            let at = (x + width / 2.0, y + height / 2.0 + 4.5);
            svg.text("name", at, Anchor::Middle, &state.name);
            svg.end();
        }
        let width = placement.width.max(text_width(&self.title, 14.0, true) + 2.0 * spacing.margin);
        Some(svg.document((width, placement.height), (spacing.margin, 30.0), &self.title))
    }

    /// Draws the states and the arrows between them; lists them where they do not fit.
    fn text(&self, columns: Option<usize>, interrupt: &dyn Fn()) -> Option<String> {
        let size = |state: &DrawnState| (cells(&self.shown(state)) + 4.0, 3.0);
        let label = |arrow: &Arrow| {
            let widths = arrow.edges.iter().map(|edge| cells(&edge.label));
            (widths.fold(0.0, f64::max) + 2.0, arrow.edges.len() as f64)
        };
        let spacing = Spacing { ends: 2.0, ..CELLS };
        let placement = self.place(spacing, 1.0, size, label, interrupt)?;
        if columns.is_some_and(|columns| placement.width > columns as f64) {
            return Some(format!("{}\n\n{}\n{}\n", self.title, self.list(), self.legend()));
        }
        let mut canvas = TextCanvas::of(&placement)?;
        for (arrow, line) in self.arrows.iter().zip(&placement.lines) {
            canvas.tip(&line.points, false);
            let Some(area) = line.label else { continue };
            for (row, edge) in arrow.edges.iter().enumerate() {
                let mark = if edge.is_worst { "*" } else { "" };
                canvas.text(area.x + 1.0, area.y + row as f64, &format!("{}{mark}", edge.label));
            }
        }
        for (state, placed) in self.states.iter().zip(&placement.boxes) {
            let Area { x, y, width, height } = placed.area;
            let name = self.shown(state);
            canvas.text(x + ((width - cells(&name)) / 2.0).floor(), y + (height / 2.0).floor(), &name);
        }
        Some(format!("{}\n\n{}\n{}\n", self.title, canvas.finish(), self.legend()))
    }

    /// Lists the states, each with its arrows: `  asked: 0  ▸ Planning`.
    fn list(&self) -> String {
        let labels = self.arrows.iter().flat_map(|arrow| &arrow.edges);
        let width = labels.map(|edge| cells(&edge.label) as usize + 1).max().unwrap_or_default();
        let mut out = String::new();
        for (number, state) in self.states.iter().enumerate() {
            let _ = writeln!(out, "{}", self.shown(state));
            for arrow in self.arrows.iter().filter(|arrow| arrow.source == number) {
                for edge in &arrow.edges {
                    let label = format!("{}{}", edge.label, if edge.is_worst { "*" } else { "" });
                    let target = self.states.get(arrow.target).map_or("", |it| it.name.as_str());
                    let to =
                        if arrow.target == number { "◂ stays".to_owned() } else { format!("▸ {target}") };
                    let _ = writeln!(out, "    {}  {to}", padded(&label, width));
                }
            }
        }
        out
    }

    fn legend(&self) -> &'static str {
        match self.arrows.iter().any(Arrow::is_worst) {
            true => "> the initial state   * in the periods with the greatest total",
            false => "> the initial state",
        }
    }

    fn shown(&self, state: &DrawnState) -> String {
        if state.is_initial { format!("> {}", state.name) } else { state.name.clone() }
    }
}

impl Arrow {
    fn is_worst(&self) -> bool {
        self.edges.iter().any(|edge| edge.is_worst)
    }
}

/// Times in a picture are in milliseconds: its title says so.
fn milliseconds(time: Time) -> String {
    time.as_f64(Unit::Milliseconds).to_string()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use expect_test::expect;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};
    use mauve_wcrt::first_tables;

    use crate::machine_view::state_machine;

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
        drawn_after(drawing, |_| ())
    }

    fn drawn_after(drawing: Drawing, then: impl FnOnce(&Database)) -> String {
        let db = Database::default();
        let texts = mauve_tests::fixture(MODEL).into_iter().map(|(path, text)| (PathBuf::from(path), text));
        let workspace = Workspace::of_texts(&db, "/".into(), texts);
        let project = projects(&db, workspace)[0];
        let pilot = names_of(&db, project).anywhere(Kind::Component, "Pilot")[0];
        let level = Level::TEN_TO_MINUS_FOUR;
        let view = state_machine(&db, first_tables(&db, project, pilot), pilot, level);
        let title = MachineTitle { component: "Pilot", level, times: None };
        then(&db);
        draw_state_machine(&db, workspace, title, &view, drawing)
    }

    #[test]
    fn an_edit_cancels_a_drawing() {
        for drawing in [Drawing::Svg, Drawing::Text(None), Drawing::Dot] {
            let cancelled = || drawn_after(drawing, |db| salsa::Database::cancellation_token(db).cancel());
            let cancelled = std::panic::AssertUnwindSafe(cancelled);
            assert!(salsa::Cancelled::catch(cancelled).is_err(), "{drawing:?} is drawn to its end");
        }
    }

    #[test]
    fn a_state_machine_is_drawn_as_dot() {
        expect![[r#"
            digraph "Pilot" {
              label="Pilot at 1e-4: execution times per period in ms, some of them assumed"; labelloc=t; rankdir=LR; node [shape=box, style=rounded];
              "Waiting" [penwidth=2];
              "Moving";
              "Waiting" -> "Waiting" [label="1.5"];
              "Waiting" -> "Moving" [label="go: 1.5", penwidth=2];
              "Moving" -> "Waiting" [label="done: 3", penwidth=2];
            }
        "#]]
        .assert_eq(&drawn(Drawing::Dot));
    }

    #[test]
    fn states_are_listed_in_few_columns() {
        expect![[r#"
            Pilot at 1e-4: execution times per period in ms, some of them assumed

            > Waiting
                1.5       ◂ stays
                go: 1.5*  ▸ Moving
            Moving
                done: 3*  ▸ Waiting

            > the initial state   * in the periods with the greatest total
        "#]]
        .assert_eq(&drawn(Drawing::Text(Some(20))));
    }

    #[test]
    fn a_state_machine_is_drawn_as_svg() {
        let svg = drawn(Drawing::Svg);
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        for label in [">1.5<", ">go: 1.5<", ">done: 3<", ">Waiting<", ">Moving<"] {
            assert!(svg.contains(label), "{label} in {svg}");
        }
    }
}
