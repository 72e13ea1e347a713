//! An architecture as a drawing: a box for each instance with its ports, and a line for each connection. For a deployment, boxes
//! have the colour of their deadline's status. A chain that is lit has its own colour; its boxes are marked by `»` in characters.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use mauve_diagnostics::figure::HintStatus;
use mauve_diagnostics::utilisation;
use mauve_hir::ModelDb;
use mauve_hir::item_tree::{FeatureKind, Name};
use mauve_timing::{CpuSet, Status, Unit};
use mauve_wcrt::ActivityReport;
use rustc_hash::FxHashMap;

use crate::drawing::{Drawing, dot_head, dot_text, drawn_name, too_large};
use crate::graph::{Graph, GraphEdge, GraphNode};
use crate::lanes::{NetEnd, draw_lanes, lanes_of};
use crate::layout::{
    Area, BoxSide, BoxSize, CELLS, Diagram, LineEnds, PIXELS, PlacedBox, PlacedLine, Placement, PortSlot,
    Spacing, place,
};
use crate::svg::{Anchor, Attributes, Svg, fitted, number, path_through, text_width};
use crate::text_canvas::{TextCanvas, cells, padded};

/// Draws a graph.
///
/// In SVG, each box is a group with `data-instance`, and each line a group with `data-source` and `data-target`, which hold the
/// numbers of instances, and `data-edge`, which holds the number of the connection. `data-place` holds the file and the line of
/// the declaration.
pub fn draw_graph(db: &dyn ModelDb, graph: &Graph<'_>, drawing: Drawing) -> String {
    let interrupt = || db.unwind_if_revision_cancelled();
    let graph = &with_drawn_names(graph.clone());
    let drawn = match drawing {
        Drawing::Dot => Some(dot(graph)),
        Drawing::Svg => svg(graph, &interrupt),
        Drawing::Narrow => narrow_svg(graph, &interrupt),
        Drawing::Text(columns) => text(graph, columns, &interrupt),
    };
    drawn.unwrap_or_else(|| {
        let content = format!("{} instances and {} connections", graph.nodes.len(), graph.edges.len());
        too_large(drawing, &graph.title, &content, "mauve graph")
    })
}

/// Returns the graph with the names that a drawing shows.
fn with_drawn_names<'db>(mut graph: Graph<'db>) -> Graph<'db> {
    for node in &mut graph.nodes {
        if let Some(host) = &node.host {
            node.component = format!("{} on {host}", node.component).into();
        }
    }
    let of_nodes = graph.nodes.iter_mut().flat_map(|node| {
        let ports = node.ports.iter_mut().map(|port| &mut port.name);
        [&mut node.instance, &mut node.component].into_iter().chain(ports)
    });
    let of_edges = graph.edges.iter_mut().flat_map(|edge| [&mut edge.source.1, &mut edge.target.1]);
    of_nodes.chain(of_edges).for_each(|name| *name = drawn_name(name).into());
    graph
}

/// Returns the class of a box: `met`, `tight`, `missed` or `unknown`; nothing for an instance without a deadline.
fn status_of(node: &GraphNode<'_>) -> &'static str {
    let has_deadline = node.activity.is_some_and(|it| it.verdict != Status::Background);
    node.status.filter(|_| has_deadline).map_or("", HintStatus::name)
}

/// Returns `✓ 53 / 100 ms · 29.7 %`, the figure and the utilisation; nothing without an activity.
fn with_load(node: &GraphNode<'_>) -> String {
    let load = node.load.map(|load| format!(" · {}", percentage(load)));
    format!("{}{}", node.figure, load.unwrap_or_default())
}

/// Returns `priority 9 · 100 ms · CPU 1`, for the title of a box: elsewhere, the deployment is beside the drawing.
fn settings_of(graph: &Graph<'_>, activity: &ActivityReport<'_>) -> String {
    let priority = activity.priority.real_time().map(|priority| format!("priority {priority}"));
    let period = activity.period.map(|period| format!("{} ms", period.number()));
    let cpus = activity.cpus.filter(|cpus| !cpus.is_empty()).map(|it| cpus_of(graph, it));
    [priority, period, cpus].into_iter().flatten().collect::<Vec<_>>().join(" · ")
}

/// Returns a utilisation in percent, at most seven letters long.
fn percentage(load: f64) -> String {
    if load < 9.995 { format!("{:.1} %", load * 100.0) } else { "> 999 %".to_owned() }
}

fn is_incoming(kind: FeatureKind) -> bool {
    matches!(kind, FeatureKind::Input | FeatureKind::Provided)
}

fn dot(graph: &Graph<'_>) -> String {
    // Several connections between two instances share one line.
    let mut lines: BTreeMap<(usize, usize, bool), Vec<&str>> = BTreeMap::new();
    for edge in &graph.edges {
        let names = lines.entry((edge.source.0, edge.target.0, edge.operation)).or_default();
        names.push(edge.source.1.as_str());
    }
    let mut out = dot_head(&graph.title, &graph.title, "filled");
    for (index, node) in graph.nodes.iter().enumerate() {
        let fill = match status_of(node) {
            "met" => "#e8f5e9",
            "tight" => "#fff4dd",
            "missed" => "#fdecea",
            "unknown" => "#f3f3f3",
            _ => "#eef3f8",
        };
        let below = node.activity.map(|_| format!("\\n{}", with_load(node))).unwrap_or_default();
        let label = format!("\"{}: {}{below}\"", node.instance, node.component);
        let lit = if node.is_lit { ", penwidth=3" } else { "" };
        let _ = writeln!(out, "  {index} [label={label}, fillcolor={}{lit}];", dot_text(fill));
    }
    let hosts: BTreeSet<&Name> = graph.nodes.iter().filter_map(|it| it.host.as_ref()).collect();
    for (number, host) in hosts.into_iter().enumerate() {
        let here = graph.nodes.iter().enumerate().filter(|(_, it)| it.host.as_ref() == Some(host));
        let here: Vec<String> = here.map(|(index, _)| index.to_string()).collect();
        let (label, here) = (dot_text(host), here.join("; "));
        let _ = writeln!(out, "  subgraph cluster_{number} {{ label={label}; {here}; }}");
    }
    for ((source, target, operation), names) in lines {
        let style = if operation { ", style=dashed" } else { "" };
        let _ = writeln!(out, "  {source} -> {target} [label={}{style}];", dot_text(&names.join(", ")));
    }
    out + "}\n"
}

/// The ports of each instance, and the lines between them. `size` returns the size of an instance without its ports.
fn diagram(
    graph: &Graph<'_>,
    size: impl Fn(&GraphNode<'_>, &[(Name, bool)]) -> BoxSize,
) -> (Diagram, Vec<Vec<(Name, bool)>>) {
    // The declared ports, then those that only connections have, such as those of unknown components.
    let mut ports: Vec<Vec<(Name, bool)>> = Vec::new();
    let mut known: FxHashMap<(usize, Name), usize> = FxHashMap::default();
    for (number, node) in graph.nodes.iter().enumerate() {
        ports.push(node.ports.iter().map(|port| (port.name.clone(), is_incoming(port.kind))).collect());
        for (index, port) in node.ports.iter().enumerate() {
            known.entry((number, port.name.clone())).or_insert(index);
        }
    }
    let mut number_of = |end: &(usize, Name), is_incoming: bool| {
        let Some(ports) = ports.get_mut(end.0) else { return (end.0, 0) };
        let port = *known.entry(end.clone()).or_insert(ports.len());
        if port == ports.len() {
            ports.push((end.1.clone(), is_incoming));
        }
        (end.0, port)
    };
    let lines = graph.edges.iter().map(|edge| {
        // A required operation is the source, a provided one the target.
        LineEnds {
            source: number_of(&edge.source, false),
            target: number_of(&edge.target, true),
            label: None,
        }
    });
    let lines: Vec<LineEnds> = lines.collect();
    let boxes = graph.nodes.iter().zip(&ports).map(|(node, ports)| {
        let side =
            |(_, is_incoming): &(Name, bool)| Some(if *is_incoming { BoxSide::Left } else { BoxSide::Right });
        BoxSize { ports: ports.iter().map(side).collect(), ..size(node, ports) }
    });
    (Diagram { boxes: boxes.collect(), lines }, ports)
}

/// The width of the part of a box with figures: it does not depend on them, so that a drawing keeps its shape while times change.
const FIGURES: f64 = 168.0;
/// The width of a utilisation.
const LOAD: f64 = 56.0;

fn svg(graph: &Graph<'_>, interrupt: &dyn Fn()) -> Option<String> {
    let has_figures = graph.report.is_some();
    let head = if has_figures { 76.0 } else { 50.0 };
    let (diagram, ports) = diagram(graph, |node, ports| {
        let component = text_width(&node.component, 12.0, false) + if has_figures { LOAD } else { 0.0 };
        let names = text_width(&node.instance, 13.0, true).max(component);
        let port = ports.iter().map(|(name, _)| text_width(name, 12.0, false)).fold(0.0, f64::max);
        let width = (names + 28.0).max(2.0 * port + 44.0).max(if has_figures { FIGURES } else { 120.0 });
        BoxSize {
            width: (width / 8.0).ceil() * 8.0,
            height: head + 6.0,
            head: Some(head),
            row: 20.0,
            foot: 6.0,
            ports: Vec::new(),
        }
    });
    let placement = place(&diagram, PIXELS, interrupt)?;
    let legend = if has_figures { 34.0 } else { 0.0 };
    let size = (placement.width.max(title_width(graph)), placement.height + legend);
    let mut svg = drawn(graph, &placement, |svg, placed, node| {
        svg_box(svg, node, placed, ports.get(node.1).map_or(&[], Vec::as_slice))
    });
    if has_figures {
        let words = "R / D in ms, CPU utilisation; the bar shows R as a part of D";
        svg.text("soft", (PIXELS.margin, size.1 - 18.0), Anchor::Start, words);
    }
    Some(svg.document(size, (PIXELS.margin, 30.0), &graph.title))
}

fn title_width(graph: &Graph<'_>) -> f64 {
    text_width(&graph.title, 14.0, true) + 2.0 * PIXELS.margin
}

/// What is drawn as a box: the graph, and the number of the instance.
type DrawnInstance<'a, 'db> = (&'a Graph<'db>, usize, &'a GraphNode<'db>);

/// The lines and boxes of a drawing.
fn drawn(
    graph: &Graph<'_>,
    placement: &Placement,
    draw: impl Fn(&mut Svg, &PlacedBox, DrawnInstance<'_, '_>),
) -> Svg {
    let mut svg = Svg::default();
    for (index, (edge, line)) in graph.edges.iter().zip(&placement.lines).enumerate() {
        let call = if edge.operation { " call" } else { "" };
        let lit = if edge.is_lit { " worst" } else { "" };
        let data: Attributes<'_> = &[
            ("data-edge", &index),
            ("data-source", &edge.source.0),
            ("data-target", &edge.target.0),
            ("data-place", &edge.place),
        ];
        let title = format!("{} → {}", end_name(graph, &edge.source), end_name(graph, &edge.target));
        svg.group(&format!("link{lit}"), data, &title);
        svg.path(&format!("wire{call}"), &path_through(&line.points));
        svg.end();
    }
    for ((index, node), placed) in graph.nodes.iter().enumerate().zip(&placement.boxes) {
        draw(&mut svg, placed, (graph, index, node));
    }
    svg
}

/// The distances of a narrow drawing: between boxes, between the ends of lines, and between lanes.
const NARROW: Spacing = Spacing { boxes: 5.0, ends: 7.0, lines: 9.0, margin: 14.0, ..PIXELS };

/// The width of a verdict in a narrow drawing.
const VERDICT: f64 = 132.0;

/// For a narrow part of a window: the boxes are the rows, with lanes for lines beside them. The names of ports are in their titles.
fn narrow_svg(graph: &Graph<'_>, interrupt: &dyn Fn()) -> Option<String> {
    let sizes = diagram(graph, |_, _| BoxSize { width: 100.0, height: 30.0, ..BoxSize::default() }).0;
    let rows = rows_of(graph, &place(&sizes, PIXELS, interrupt)?);
    let names = graph.nodes.iter().map(|it| text_width(&it.instance, 13.0, true)).fold(0.0, f64::max);
    let width = names + 20.0 + if graph.report.is_some() { VERDICT + 10.0 } else { 0.0 };
    let right = NARROW.margin + width;
    let mut boxes = vec![PlacedBox::default(); graph.nodes.len()];
    let mut ports = vec![Vec::new(); graph.nodes.len()];
    let (mut nets, mut places) = (BTreeMap::<_, Vec<NetEnd>>::new(), FxHashMap::default());
    let mut below = PIXELS.top + NARROW.margin;
    for (instance, ends) in &rows {
        let count = (ends.len() + 1) as f64;
        let height = (NARROW.ends * count).max(27.0);
        boxes[*instance].area = Area { x: NARROW.margin, y: below, width, height };
        for (index, end) in ends.iter().enumerate() {
            let y = below + height * (index + 1) as f64 / count;
            nets.entry(end.2).or_default().push(NetEnd { row: places.len(), tip: end.3 });
            places.insert((*instance, *end), (places.len(), y));
            let tip = if end.0 { 3.5 } else { -3.5 };
            ports[*instance].push((y, tip, end.1));
        }
        below += height + NARROW.boxes;
    }
    let lanes = lanes_of(nets.values())?;
    let mut lane_of = vec![0.0; places.len()];
    for (spans, lane) in lanes.iter().zip(1..) {
        let ends = spans.iter().flat_map(|span| span.2);
        ends.for_each(|end| lane_of[end.row] = right + 4.0 + NARROW.lines * f64::from(lane));
    }
    let lines = graph.edges.iter().map(|edge| {
        let [from, to] = ends_of(edge).map(|end| places.get(&end).copied());
        let points = from.zip(to).map(|((row, from), (_, to))| {
            vec![(right, from), (lane_of[row], from), (lane_of[row], to), (right, to)]
        });
        PlacedLine { points: points.unwrap_or_default(), label: None }
    });
    let placement = Placement { boxes, lines: lines.collect(), ..Placement::default() };
    let width = right + NARROW.lines * (lanes.len() + 1) as f64;
    let size = (width.max(title_width(graph)), below + NARROW.margin);
    let draw = |svg: &mut Svg, placed: &PlacedBox, instance: DrawnInstance<'_, '_>| {
        let Area { x, y, width, height } = placed.area;
        svg_group(svg, instance, placed.area);
        let y = y + height / 2.0;
        svg.text("name", (x + 10.0, y + 4.5), Anchor::Start, &instance.2.instance);
        svg_verdict(svg, instance.2, (x + width - 10.0 - VERDICT, y + 0.5), VERDICT);
        for (y, tip, name) in &ports[instance.1] {
            svg_port(svg, "", (right, *y), *tip, name);
        }
        svg.end();
    };
    Some(drawn(graph, &placement, draw).document(size, (PIXELS.margin, 30.0), &graph.title))
}

fn end_name(graph: &Graph<'_>, (number, feature): &(usize, Name)) -> String {
    graph.nodes.get(*number).map(|node| format!("{}.{feature}", node.instance)).unwrap_or_default()
}

/// Opens the group of a box, with its frame.
fn svg_group(svg: &mut Svg, (graph, index, node): DrawnInstance<'_, '_>, area: Area) {
    let lit = if node.is_lit { " passed" } else { "" };
    let figures = node.activity.map(|it| format!(", {}, {}", node.figure, settings_of(graph, it)));
    let title = format!("{}: {}{}", node.instance, node.component, figures.unwrap_or_default());
    let data: Attributes<'_> = &[("data-instance", &index), ("data-place", &node.place)];
    svg.group(&format!("box {}{lit}", status_of(node)), data, &title);
    svg.rect_with("frame", area.into(), &[("rx", &7)], "");
}

/// The verdict of a box, with a bar of the response time as a part of the deadline: from a position on, in a width.
fn svg_verdict(svg: &mut Svg, node: &GraphNode<'_>, (left, y): (f64, f64), width: f64) {
    let Some(activity) = node.activity else { return };
    let is_short = text_width(&node.figure, 12.0, true) > width;
    let verdict = if is_short { &node.short } else { &node.figure };
    svg.text("figure status", (left, y), Anchor::Start, &fitted(verdict, width, 12.0, true));
    let times = [activity.response, activity.deadline].map(|it| it.map(|it| it.as_f64(Unit::Milliseconds)));
    if let [Some(response), Some(deadline)] = times
        && activity.verdict != Status::Background
    {
        let part = (response / deadline.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        for (class, part) in [("track", 1.0), ("filled", part)] {
            svg.rect_with(class, [left, y + 7.0, width * part, 4.0], &[("rx", &2)], "");
        }
    }
}

/// A triangle on the border of a box, in the direction of the data.
fn svg_port(svg: &mut Svg, free: &str, (x, y): (f64, f64), tip: f64, name: &str) {
    let [a, b] = [x - tip, x + tip].map(number);
    let [top, y, bottom] = [y - 0.9 * tip, y, y + 0.9 * tip].map(number);
    svg.titled_path(&format!("port{free}"), &format!("M{a} {top}L{b} {y}L{a} {bottom}z"), name);
}

fn svg_box(svg: &mut Svg, instance: DrawnInstance<'_, '_>, placed: &PlacedBox, ports: &[(Name, bool)]) {
    let Area { x, y, width, .. } = placed.area;
    let (node, left) = (instance.2, x + 14.0);
    svg_group(svg, instance, placed.area);
    svg.text("name", (left, y + 22.0), Anchor::Start, &node.instance);
    svg.text("soft", (left, y + 39.0), Anchor::Start, &node.component);
    if let Some(load) = node.load {
        svg.text("figure", (x + width - 14.0, y + 39.0), Anchor::End, &percentage(load));
    }
    svg_verdict(svg, node, (left, y + 58.0), width - 28.0);
    for slot in &placed.slots {
        let Some((name, is_incoming)) = ports.get(slot.port) else { continue };
        let (border, inside, anchor) = match slot.side {
            BoxSide::Left => (x, x + 12.0, Anchor::Start),
            BoxSide::Right => (x + width, x + width - 12.0, Anchor::End),
        };
        let to_right = *is_incoming == (slot.side == BoxSide::Left);
        let tip = if to_right { 5.0 } else { -5.0 };
        let free = if slot.has_line { "" } else { " free" };
        svg_port(svg, free, (border, slot.y), tip, name);
        svg.text("label", (inside, slot.y + 4.0), anchor, name);
    }
    svg.end();
}

fn text(graph: &Graph<'_>, columns: Option<usize>, interrupt: &dyn Fn()) -> Option<String> {
    let rows_of = |node: &GraphNode<'_>| -> Vec<String> {
        let lit = if node.is_lit { "» " } else { "" };
        let name = format!("{lit}{}: {}", node.instance, node.component);
        std::iter::once(name).chain(node.activity.map(|_| with_load(node))).collect()
    };
    let (diagram, ports) = diagram(graph, |node, ports| {
        let rows = rows_of(node);
        let widest = rows.iter().map(|row| cells(row)).fold(0.0, f64::max);
        let port = ports.iter().map(|(name, _)| cells(name)).fold(0.0, f64::max);
        let head = rows.len() as f64 + 1.0;
        BoxSize {
            width: (widest + 4.0).max(2.0 * port + 6.0),
            height: head + 1.0,
            head: Some(head),
            row: 1.0,
            foot: 1.0,
            ports: Vec::new(),
        }
    });
    let placement = place(&diagram, CELLS, interrupt)?;
    if let Some(columns) = columns.filter(|columns| placement.width > *columns as f64)
        && let Some(drawn) = narrow(graph, &placement, columns)
    {
        return Some(drawn);
    }
    let mut canvas = TextCanvas::of(&placement)?;
    for (line, edge) in placement.lines.iter().zip(&graph.edges) {
        canvas.tip(&line.points, edge.operation);
    }
    for ((node, placed), ports) in graph.nodes.iter().zip(&placement.boxes).zip(&ports) {
        let Area { x, y, width, .. } = placed.area;
        for (row, text) in rows_of(node).iter().enumerate() {
            canvas.text(x + 2.0, y + 1.0 + row as f64, text);
        }
        for PortSlot { port, side, y, .. } in &placed.slots {
            let Some((name, _)) = ports.get(*port) else { continue };
            let at = match side {
                BoxSide::Left => x + 2.0,
                BoxSide::Right => x + width - 2.0 - cells(name),
            };
            canvas.text(at, *y, name);
        }
    }
    Some(format!("{}\n\n{}", graph.title, canvas.finish()))
}

/// The end of a net at an instance: whether data leaves, the port, the net, and the tip of its arrow.
type PortEnd<'a> = (bool, &'a Name, &'a (usize, Name), Option<&'static str>);

/// The ends of a connection, each with the number of its instance.
fn ends_of<'a>(edge: &'a GraphEdge<'_>) -> [(usize, PortEnd<'a>); 2] {
    let GraphEdge { source, target, .. } = edge;
    let tip = if edge.operation { "◃" } else { "◂" };
    [(source.0, (true, &source.1, source, None)), (target.0, (false, &target.1, source, Some(tip)))]
}

/// Returns the rows of a graph in few columns: the numbers of the instances, in the order of the columns of the wide drawing, and the
/// ends of their nets. A port has an end for each source that writes to it.
fn rows_of<'a>(graph: &'a Graph<'_>, wide: &Placement) -> Vec<(usize, BTreeSet<PortEnd<'a>>)> {
    let mut rows: Vec<_> = (0..graph.nodes.len()).map(|number| (number, BTreeSet::new())).collect();
    for (number, end) in graph.edges.iter().flat_map(ends_of) {
        if let Some((_, ends)) = rows.get_mut(number) {
            ends.insert(end);
        }
    }
    let at = |number: usize| wide.boxes.get(number).map_or((0.0, 0.0), |it| (it.area.x, it.area.y));
    rows.sort_by(|(one, _), (other, _)| at(*one).partial_cmp(&at(*other)).unwrap_or(Ordering::Equal));
    rows
}

/// Draws a graph in few columns: a row for each instance, and below it one for each of its ports with connections.
fn narrow(graph: &Graph<'_>, wide: &Placement, columns: usize) -> Option<String> {
    let order = rows_of(graph, wide);
    let drawn = |with_components: bool| {
        let name_of = |node: &GraphNode<'_>| {
            let lit = if node.is_lit { "» " } else { "" };
            let component = if with_components { format!(": {}", node.component) } else { String::new() };
            format!("{lit}{}{component}", node.instance)
        };
        let names = graph.nodes.iter().map(|node| cells(&name_of(node))).fold(0.0, f64::max);
        let (mut rows, mut nets) = (Vec::new(), BTreeMap::<&(usize, Name), Vec<NetEnd>>::new());
        for (number, ends) in &order {
            let Some(node) = graph.nodes.get(*number) else { continue };
            let name = padded(&name_of(node), names as usize);
            rows.push(format!("{name}  {}", with_load(node)).trim_end().to_owned());
            for (_, port, net, tip) in ends {
                nets.entry(net).or_default().push(NetEnd { row: rows.len(), tip: *tip });
                rows.push(format!("  {port}"));
            }
        }
        draw_lanes(&rows, nets.values())
    };
    let (mut text, width) = drawn(true)?;
    if width > columns as f64 {
        text = drawn(false)?.0;
    }
    // It may be below the edge of the terminal.
    let worst = graph.nodes.iter().filter(|it| it.activity.is_some()).min_by(|a, b| worst_first(a, b));
    let worst = worst.map(|it| format!(": {} {}", it.instance, it.figure)).unwrap_or_default();
    Some(format!("{}{worst}\n\n{text}", name_and_level(graph)))
}

/// Returns the names of CPUs, with their host if the graph is of a deployment on several.
fn cpus_of(graph: &Graph<'_>, cpus: CpuSet) -> String {
    graph.report.map_or_else(|| cpus.to_string(), |report| report.hosts.names(cpus))
}

/// The order of instances: missed before not analysed before tight before met, then by the part of the deadline that is used.
fn worst_first(one: &GraphNode<'_>, other: &GraphNode<'_>) -> Ordering {
    let rank = |node: &GraphNode<'_>| node.status.map(HintStatus::rank);
    let used = |node: &GraphNode<'_>| node.activity.and_then(|it| it.used()).unwrap_or(f64::INFINITY);
    rank(one).cmp(&rank(other)).then(used(other).total_cmp(&used(one)))
}

/// Returns the name of a graph and its level: its title without what the figures are.
fn name_and_level<'a>(graph: &'a Graph<'_>) -> &'a str {
    graph.title.split(": ").next().unwrap_or_default()
}

/// Lists the instances of a graph below their CPUs, the worst first: `  pilot  ✗ 50 / 40 ms`.
pub fn instance_tree(graph: &Graph<'_>) -> String {
    let mut groups: BTreeMap<CpuSet, Vec<&GraphNode<'_>>> = BTreeMap::new();
    for node in &graph.nodes {
        groups.entry(node.activity.and_then(|it| it.cpus).unwrap_or_default()).or_default().push(node);
    }
    let mut out = format!("{}\n", name_and_level(graph));
    for (cpus, mut nodes) in groups {
        let load = graph.report.and_then(|report| report.cpus.iter().find(|load| load.cpus == cpus));
        let load = load.map(|load| format!("  {}", utilisation(load))).unwrap_or_default();
        let _ = writeln!(out, "  {}{load}", cpus_of(graph, cpus));
        nodes.sort_by(|one, other| {
            worst_first(one, other).then_with(|| one.instance.as_str().cmp(other.instance.as_str()))
        });
        let longest = nodes.iter().map(|node| node.instance.chars().count()).max().unwrap_or_default();
        for node in nodes {
            let line = format!("    {:longest$}  {}", node.instance.as_str(), node.figure);
            let _ = writeln!(out, "{}", line.trim_end());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};
    use mauve_hir::{names_of, projects};
    use mauve_wcrt::Query;

    use super::*;
    use crate::fixture::Fixture;
    use crate::graph::graph;
    use crate::graph::tests::MODEL;
    use mauve_diagnostics::figure::TIGHT_SLACK;

    fn drawn(name: &str, drawing: Drawing) -> String {
        made(name, |db, graph| draw_graph(db, graph, drawing))
    }

    fn made(name: &str, make: impl Fn(&dyn ModelDb, &Graph<'_>) -> String) -> String {
        let Fixture { db, workspace, .. } = Fixture::new(MODEL);
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).all.iter().find(|decl| *decl.name(&db) == *name).copied().unwrap();
        let graph = graph(&db, project, of, Query::shown(&db, project, of), TIGHT_SLACK).unwrap();
        make(&db, &graph)
    }

    fn check(name: &str, drawing: Drawing, expected: Expect) {
        expected.assert_eq(&drawn(name, drawing));
    }

    #[test]
    fn the_instances_below_their_cpus() {
        expect![[r#"
            D at 1e-4
              CPU 1  50.0 %
                pilot  ✗ 50 / 40 ms
                laser  ✓ 20 / 100 ms
                spare  – not real-time
        "#]]
        .assert_eq(&made("D", |_, graph| instance_tree(graph)));
        expect![[r#"
            A
              no CPU
                laser
                pilot
                spare
        "#]]
        .assert_eq(&made("A", |_, graph| instance_tree(graph)));
    }

    #[test]
    fn of_an_architecture() {
        check(
            "A",
            Drawing::Dot,
            expect![[r##"
                digraph "A" {
                  label="A"; labelloc=t; rankdir=LR; node [shape=box, style=filled];
                  0 [label="laser: Laser", fillcolor="#eef3f8"];
                  1 [label="pilot: Pilot", fillcolor="#eef3f8"];
                  2 [label="spare: Unknown", fillcolor="#eef3f8"];
                  0 -> 1 [label="scan"];
                  1 -> 1 [label="go"];
                }
            "##]],
        );
        check(
            "A",
            Drawing::Text(None),
            expect![[r#"
                A

                                             ┌──────────────┐
                                             │ pilot: Pilot │
                 ┌──────────────┐    ┌──────▸┤ scan      go ├──┐
                 │ laser: Laser │    │    ┌─▸┤ back         │  │
                 │         scan ├────┘    │  │ stop         │  │
                 │         stop │         │  └──────────────┘  │
                 └──────────────┘         │                    │
                                          └────────────────────┘
                ┌────────────────┐
                │ spare: Unknown │
                └────────────────┘
            "#]],
        );
    }

    #[test]
    fn of_a_deployment_with_what_is_known() {
        check(
            "D",
            Drawing::Dot,
            expect![[r##"
                digraph "D at 1e-4: response times and deadlines in ms, CPU utilisation" {
                  label="D at 1e-4: response times and deadlines in ms, CPU utilisation"; labelloc=t; rankdir=LR; node [shape=box, style=filled];
                  0 [label="laser: Laser\n✓ 20 / 100 ms · 20.0 %", fillcolor="#e8f5e9"];
                  1 [label="pilot: Pilot\n✗ 50 / 40 ms · 30.0 %", fillcolor="#fdecea"];
                  2 [label="spare: Unknown\n– not real-time", fillcolor="#eef3f8"];
                  0 -> 1 [label="scan"];
                  1 -> 1 [label="go"];
                }
            "##]],
        );
        check(
            "D",
            Drawing::Text(None),
            expect![[r#"
                D at 1e-4: response times and deadlines in ms, CPU utilisation

                                                     ┌───────────────────────┐
                                                     │ pilot: Pilot          │
                ┌────────────────────────┐           │ ✗ 50 / 40 ms · 30.0 % │
                │ laser: Laser           │   ┌──────▸┤ scan               go ├──┐
                │ ✓ 20 / 100 ms · 20.0 % │   │    ┌─▸┤ back                  │  │
                │                   scan ├───┘    │  │ stop                  │  │
                │                   stop │        │  └───────────────────────┘  │
                └────────────────────────┘        │                             │
                                                  └─────────────────────────────┘
                   ┌─────────────────┐
                   │ spare: Unknown  │
                   │ – not real-time │
                   └─────────────────┘
            "#]],
        );
    }

    #[test]
    fn in_few_columns() {
        check(
            "D",
            Drawing::Text(Some(60)),
            expect![[r#"
                D at 1e-4: pilot ✗ 50 / 40 ms

                laser: Laser    ✓ 20 / 100 ms · 20.0 %
                  scan ───────────────────────────────────┐
                spare: Unknown  – not real-time           │
                pilot: Pilot    ✗ 50 / 40 ms · 30.0 %     │
                  back ◂────────────────────────────────┐ │
                  scan ◂────────────────────────────────┼─┘
                  go ───────────────────────────────────┘
            "#]],
        );
        check(
            "WithCall",
            Drawing::Text(Some(30)),
            expect![[r#"
            WithCall

            spare: Unknown
            laser: Laser
              scan ─────────────┐
              stop ───────────┐ │
            pilot: Pilot      │ │
              back ◂────────┐ │ │
              scan ◂────────┼─┼─┘
              stop ◃────────┼─┘
              go ───────────┘
        "#]],
        );
        let most = |drawn: &str| drawn.lines().map(|line| line.chars().count()).max();
        assert!(most(&drawn("A", Drawing::Text(Some(20)))) <= Some(20));
    }

    #[test]
    fn an_edit_cancels_a_drawing() {
        for drawing in [Drawing::Svg, Drawing::Text(None)] {
            let cancelled = || {
                made("D", |db, graph| {
                    db.cancellation_token().cancel();
                    draw_graph(db, graph, drawing)
                })
            };
            assert!(salsa::Cancelled::catch(cancelled).is_err(), "{drawing:?} is drawn to its end");
        }
    }

    #[test]
    fn calls_are_dashed() {
        assert!(drawn("WithCall", Drawing::Text(None)).contains("▹┤ stop"));
        let svg = drawn("WithCall", Drawing::Svg);
        assert!(svg.contains("<title>laser.stop → pilot.stop</title>\n<path class=\"wire call\""), "{svg}");
    }

    #[test]
    fn the_svg_has_instances_and_connections() {
        let svg = drawn("D", Drawing::Svg);
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        let parts = [
            ">laser</text>",
            ">✓ 20 / 100 ms</text>",
            ">20.0 %</text>",
            "class=\"box missed\" data-instance=\"1\" data-place=\"model.mal:",
            ">✗ 50 / 40 ms</text>",
            "<title>laser.scan → pilot.scan</title>\n<path class=\"wire\"",
        ];
        for part in parts {
            assert!(svg.contains(part), "{part} in {svg}");
        }
    }
}
