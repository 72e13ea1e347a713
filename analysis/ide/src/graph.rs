//! The graph of an architecture: its instances and their connections; for a deployment, with utilisations and response times.
//! In plain data, as DOT and as SVG.

use std::collections::{BTreeMap, VecDeque};
use std::fmt::Write as _;

use mauve_diagnostics::reasons::reason;
use mauve_diagnostics::times_of;
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Decl, File, FlatInstance, Location, ModelDb, Project, Workspace, architecture, declaration_at,
    declarations, flat_of, is_model, names_of, target_of,
};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::{Status, Time, Utilisation};
use mauve_wcrt::{ActivityReport, Query, Report, Verdict, psm_of, response_times, tables_of};

use crate::drawing::{Drawing, dot_text, svg_arrow, svg_head, svg_text};
use crate::project::projects_with;

/// A graph of instances and connections.
#[derive(Debug, Clone)]
pub struct Graph<'db> {
    /// Its title.
    pub title: String,
    /// The instances, those of imported architectures first.
    pub nodes: Vec<GraphNode<'db>>,
    /// The connections between these instances.
    pub edges: Vec<GraphEdge<'db>>,
    /// The response times, for a deployment.
    pub report: Option<&'db Report<'db>>,
    /// The reasons why something may be missing.
    pub missing: Vec<String>,
}

/// An instance in a graph.
#[derive(Debug, Clone)]
pub struct GraphNode<'db> {
    /// Its name.
    pub instance: Name,
    /// Its component: the declared name, or as written if it is unknown.
    pub component: Name,
    /// Its declaration.
    pub at: Location<'db>,
    /// Its activity, for a deployment.
    pub activity: Option<&'db ActivityReport<'db>>,
    /// The utilisation of its activity, if known; 1 is a full CPU.
    pub load: Option<f64>,
}

/// A connection in a graph.
#[derive(Debug, Clone)]
pub struct GraphEdge<'db> {
    /// The number of the source instance, and its port or operation.
    pub source: (usize, Name),
    /// The number of the target instance, and its port or operation.
    pub target: (usize, Name),
    /// Whether it connects operations instead of ports.
    pub operation: bool,
    /// Its declaration.
    pub at: Location<'db>,
}

/// Selects deployments or architectures of a file's projects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GraphsOf<'a> {
    /// By name, `library.Name` or `Name`.
    Name(&'a str),
    /// The one at this offset of the file.
    At(TextSize),
    /// The deployments of the file, otherwise its architectures. For a file without any, such as a timing table, those of its
    /// projects.
    File,
}

/// Returns the selected deployments or architectures, each with each project that has it; at least one.
///
/// # Errors
///
/// The reason why there is none, for the user.
pub fn selected_graphs<'db>(
    db: &'db dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    selection: GraphsOf<'_>,
) -> Result<Vec<(Project<'db>, Decl<'db>)>, String> {
    let projects = projects_with(db, workspaces, file);
    if projects.is_empty() {
        return Err("this file is not part of any project".to_owned());
    }
    let kinds = [Kind::Deployment, Kind::Architecture];
    let is_graph = |decl: &Decl<'db>| kinds.contains(&decl.kind(db));
    let of_projects = |is_it: &dyn Fn(&Decl<'db>) -> bool| -> Vec<(Project<'db>, Decl<'db>)> {
        let all = |&project: &Project<'db>| names_of(db, project).all.iter().map(move |&of| (project, of));
        projects.iter().flat_map(all).filter(|(_, of)| is_it(of)).collect()
    };
    // Offsets in a table or in `mauve.toml` are not offsets in a model.
    let own = if is_model(file.path(db)) { declarations(db, file).all.as_slice() } else { &[] };
    let found = match selection {
        GraphsOf::Name(name) => {
            let found =
                of_projects(&|of| is_graph(of) && (*of.name(db) == *name || of.qualified(db) == name));
            if found.is_empty() {
                let what = format!("no deployment or architecture `{name}`");
                return Err(format!("{what} in the projects of this file"));
            }
            found
        }
        GraphsOf::At(offset) if is_model(file.path(db)) => {
            let at = declaration_at(db, file, TextRange::empty(offset)).filter(is_graph);
            of_projects(&|of| Some(*of) == at)
        }
        GraphsOf::At(_) | GraphsOf::File => {
            let has = |kind| own.iter().any(|of| of.kind(db) == kind);
            match kinds.into_iter().find(|&kind| has(kind)) {
                Some(kind) => of_projects(&|of| of.kind(db) == kind && of.file(db) == file),
                None => {
                    let all = kinds.into_iter().map(|kind| of_projects(&|of| of.kind(db) == kind));
                    all.into_iter().find(|all| !all.is_empty()).unwrap_or_default()
                }
            }
        }
    };
    if found.is_empty() { Err("no deployment or architecture here".to_owned()) } else { Ok(found) }
}

/// Returns the graph of an architecture, or of a deployment with its response times. `None` for other declarations, and for a
/// deployment whose architecture is unknown.
pub fn graph<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    query: Query,
) -> Option<Graph<'db>> {
    let (target, report) = match of.kind(db) {
        Kind::Architecture => (of, None),
        Kind::Deployment => (target_of(db, project, of)?, Some(response_times(db, project, of, query))),
        _ => return None,
    };
    let flat = flat_of(db, project, target);
    let mut number: BTreeMap<&Name, usize> = BTreeMap::new();
    let nodes = flat.instances.iter().enumerate().filter_map(|(index, instance)| {
        number.entry(&instance.name).or_insert(index);
        node(db, project, of, instance, report, query)
    });
    let nodes: Vec<GraphNode<'db>> = nodes.collect();
    let edges = flat.links.iter().filter_map(|link| {
        let end = |(instance, feature): &(Name, Name)| Some((*number.get(instance)?, feature.clone()));
        let (source, target) = (end(&link.source)?, end(&link.target)?);
        Some(GraphEdge { source, target, operation: link.operation, at: link.at.clone() })
    });
    let mut missing: Vec<String> = flat.refusals.iter().map(|refusal| reason(db, &refusal.reason)).collect();
    if flat.link_completeness.is_incomplete() {
        missing.push("a connection has an error".to_owned());
    }
    let title = match report {
        None => of.name(db).to_string(),
        Some(report) => format!(
            "{} at {}{}: response times and deadlines in ms, CPU utilisation",
            of.name(db),
            query.level,
            times_of(report.times.as_deref())
        ),
    };
    Some(Graph { title, nodes, edges: edges.collect(), report, missing })
}

fn node<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    instance: &FlatInstance<'db>,
    report: Option<&'db Report<'db>>,
    query: Query,
) -> Option<GraphNode<'db>> {
    let (declared, index) = instance.declared;
    let data = architecture(db, declared)?.instances.get(index)?;
    let written = data.component.as_ref().and_then(|component| component.path.last());
    let component = instance.component.map(|component| component.name(db).clone());
    let activity = report
        .and_then(|report| report.activities.iter().find(|activity| activity.instance == instance.name));
    let load = activity.filter(|activity| activity.verdict != Verdict::Background).and_then(|activity| {
        let psm = psm_of(db, tables_of(db, project, of), instance.component?, query.level).as_ref().ok()?;
        let mean = psm.machine.greatest_cycle_mean();
        Some(Utilisation::new([(mean, activity.period?)]).as_f64())
    });
    Some(GraphNode {
        instance: instance.name.clone(),
        component: component.or_else(|| written.cloned()).unwrap_or_default(),
        at: Location::Source(declared, data.name.id),
        activity,
        load,
    })
}

impl GraphNode<'_> {
    /// Returns the response time and the utilisation as a short text; empty without an activity.
    pub fn verdict(&self) -> String {
        let Some(activity) = self.activity else { return String::new() };
        let deadline = activity.deadline.map(Time::number).unwrap_or_default();
        let verdict = match (activity.verdict, activity.response) {
            (Verdict::RealTime(Status::Met), Some(response)) => {
                format!("R {} ≤ {deadline}", response.number())
            }
            (Verdict::RealTime(Status::Missed), Some(response)) => {
                format!("R {} > {deadline} ✗", response.number())
            }
            (Verdict::Background, _) => "not real-time".to_owned(),
            (verdict, _) => verdict.name().replace('-', " "),
        };
        match self.load {
            Some(load) => format!("{verdict} · {:.1} %", load * 100.0),
            None => verdict,
        }
    }

    fn fill(&self) -> &'static str {
        match self.activity.map(|activity| activity.verdict) {
            Some(Verdict::RealTime(Status::Met)) => "#e8f5e9",
            Some(Verdict::RealTime(Status::NotAnalysed)) => "#f3f3f3",
            Some(Verdict::RealTime(_)) => "#fdecea",
            Some(Verdict::Background) | None => "#eef3f8",
        }
    }
}

/// Draws a graph. In SVG, `data-instance`, `data-source` and `data-target` hold the numbers of instances.
pub fn draw_graph(graph: &Graph<'_>, drawing: Drawing) -> String {
    // Several connections between two instances share one line.
    let mut lines: BTreeMap<(usize, usize, bool), Vec<&str>> = BTreeMap::new();
    for edge in &graph.edges {
        let names = lines.entry((edge.source.0, edge.target.0, edge.operation)).or_default();
        names.push(edge.source.1.as_str());
    }
    match drawing {
        Drawing::Dot => dot(graph, &lines),
        Drawing::Svg => svg(graph, &lines),
    }
}

type Lines<'a> = BTreeMap<(usize, usize, bool), Vec<&'a str>>;

fn dot(graph: &Graph<'_>, lines: &Lines<'_>) -> String {
    let mut out = format!("digraph {} {{\n", dot_text(&graph.title));
    let _ = writeln!(
        out,
        "  label={}; labelloc=t; rankdir=LR; node [shape=box, style=filled];",
        dot_text(&graph.title)
    );
    for (index, node) in graph.nodes.iter().enumerate() {
        let verdict = node.verdict();
        let below = if verdict.is_empty() { String::new() } else { format!("\\n{verdict}") };
        let label = format!("\"{}: {}{below}\"", node.instance, node.component);
        let _ = writeln!(out, "  {index} [label={label}, fillcolor={}];", dot_text(node.fill()));
    }
    for ((source, target, operation), names) in lines {
        let style = if *operation { ", style=dashed" } else { "" };
        let _ = writeln!(out, "  {source} -> {target} [label={}{style}];", dot_text(&names.join(", ")));
    }
    out + "}\n"
}

const BOX: (f64, f64) = (210.0, 56.0);
const GAP: (f64, f64) = (130.0, 44.0);

/// Places the nodes in columns, sources to the left of targets except in cycles.
fn svg(graph: &Graph<'_>, lines: &Lines<'_>) -> String {
    let columns = columns(graph.nodes.len(), lines);
    let mut heights: Vec<usize> = Vec::new();
    let mut places: Vec<(f64, f64)> = Vec::new();
    for &column in &columns {
        heights.resize(heights.len().max(column + 1), 0);
        let row = heights.get(column).copied().unwrap_or_default();
        if let Some(height) = heights.get_mut(column) {
            *height += 1;
        }
        places.push((30.0 + column as f64 * (BOX.0 + GAP.0), 60.0 + row as f64 * (BOX.1 + GAP.1)));
    }
    let width = 60.0 + heights.len().max(1) as f64 * (BOX.0 + GAP.0) - GAP.0;
    let height = 90.0 + heights.iter().max().copied().unwrap_or(1) as f64 * (BOX.1 + GAP.1);
    let mut out = svg_head((width, height), "x=\"30\" y=\"28\"", &graph.title);
    for (&(source, target, operation), names) in lines {
        let (Some(&(x1, y1)), Some(&(x2, y2))) = (places.get(source), places.get(target)) else { continue };
        let dashed = if operation { " stroke-dasharray=\"5 4\"" } else { "" };
        // Forward arrows go from side to side, backward arrows below the boxes.
        let (path, (x, y)) = if x2 > x1 {
            let (x1, y1, y2) = (x1 + BOX.0, y1 + BOX.1 / 2.0, y2 + BOX.1 / 2.0);
            let bend = (x2 - x1) / 2.0;
            let path = format!(
                "M{x1:.1} {y1:.1} C{:.1} {y1:.1} {:.1} {y2:.1} {x2:.1} {y2:.1}",
                x1 + bend,
                x2 - bend
            );
            (path, ((x1 + x2) / 2.0, (y1 + y2) / 2.0 - 4.0))
        } else {
            let (x1, y1) = (x1 + BOX.0 / 2.0 + 16.0, y1 + BOX.1);
            let (x2, y2) = (x2 + BOX.0 / 2.0 - 16.0, y2 + BOX.1);
            let low = y1.max(y2) + 0.9 * GAP.1;
            let path = format!("M{x1:.1} {y1:.1} C{x1:.1} {low:.1} {x2:.1} {low:.1} {x2:.1} {y2:.1}");
            (path, ((x1 + x2) / 2.0, low - 8.0))
        };
        out += &svg_arrow(&path, (source, target), dashed);
        let label = svg_text(&names.join(", "));
        let _ = writeln!(
            out,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" font-size=\"11\" fill=\"#234\">{label}</text>"
        );
    }
    for (index, (node, (x, y))) in graph.nodes.iter().zip(&places).enumerate() {
        let _ = writeln!(
            out,
            "<rect data-instance=\"{index}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{}\" height=\"{}\" rx=\"8\" fill=\"{}\" \
             stroke=\"#456\"/>\n\
             <text data-instance=\"{index}\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}: {}</text>\n\
             <text data-instance=\"{index}\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"11\">{}</text>",
            BOX.0,
            BOX.1,
            node.fill(),
            x + BOX.0 / 2.0,
            y + 23.0,
            svg_text(&node.instance),
            svg_text(&node.component),
            x + BOX.0 / 2.0,
            y + 42.0,
            svg_text(&node.verdict())
        );
    }
    out + "</svg>\n"
}

/// Returns the column of each node: to the right of its predecessors in a walk that starts at the nodes without predecessors.
fn columns(count: usize, lines: &Lines<'_>) -> Vec<usize> {
    let mut targets: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut is_start = vec![true; count];
    for &(source, target, _) in lines.keys().filter(|(source, target, _)| source != target) {
        if let (Some(targets), Some(is_start)) = (targets.get_mut(source), is_start.get_mut(target)) {
            targets.push(target);
            *is_start = false;
        }
    }
    let starts = (0..count).filter(|&node| is_start.get(node) == Some(&true));
    let mut order: Vec<usize> = Vec::new();
    let mut seen = vec![false; count];
    // Cycles without a predecessor need a start as well.
    for start in starts.chain(0..count) {
        let mut waiting = VecDeque::from([start]);
        while let Some(node) = waiting.pop_front() {
            match seen.get_mut(node) {
                Some(seen) if !*seen => *seen = true,
                _ => continue,
            }
            order.push(node);
            waiting.extend(targets.get(node).into_iter().flatten());
        }
    }
    let mut position = vec![0; count];
    for (index, &node) in order.iter().enumerate() {
        if let Some(position) = position.get_mut(node) {
            *position = index;
        }
    }
    let mut columns = vec![0; count];
    for &node in &order {
        let column: usize = columns.get(node).copied().unwrap_or_default();
        for &target in targets.get(node).into_iter().flatten() {
            if position.get(target) > position.get(node)
                && let Some(other) = columns.get_mut(target)
            {
                *other = (*other).max(column + 1);
            }
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};
    use mauve_hir::projects;

    const MODEL: &str = "
codel see(): int  codel plan(): int
shell L { output port scan: int  require stop(): int }
shell P { input port scan: int  input port back: int  output port go: int  provide stop(): int }
core CL(L) { update = { see(); } }  core CP(P) { provide stop(): int = { return 1; } update = { plan(); } }
component Laser(L, CL)  component Pilot(P, CP)
architecture Base { instance laser: Laser }
architecture A {
  import Base
  instance pilot: Pilot  instance spare: Unknown
  connection laser.scan -> pilot.scan
  connection pilot.go -> pilot.back
}
deployment D {
  architecture A
  activity laser { priority = 2 period = 100 }
  activity pilot { priority = 1 period = 100 deadline = 40 }
  activity spare { priority = background }
}
//- /mauve.toml
timing.tables = [\"t.toml\"]
//- /t.toml
codel.see = 20
codel.plan = 30
";

    fn drawn(name: &str, drawing: Drawing) -> String {
        let Fixture { db, workspace, .. } = Fixture::new(MODEL);
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).all.iter().find(|decl| *decl.name(&db) == *name).copied().unwrap();
        let graph = graph(&db, project, of, Query::shown(&db, project)).unwrap();
        draw_graph(&graph, drawing)
    }

    fn check(name: &str, expected: Expect) {
        expected.assert_eq(&drawn(name, Drawing::Dot));
    }

    #[test]
    fn of_an_architecture() {
        check(
            "A",
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
    }

    #[test]
    fn of_a_deployment_with_what_is_known() {
        check(
            "D",
            expect![[r##"
                digraph "D at 1e-4: response times and deadlines in ms, CPU utilisation" {
                  label="D at 1e-4: response times and deadlines in ms, CPU utilisation"; labelloc=t; rankdir=LR; node [shape=box, style=filled];
                  0 [label="laser: Laser\nR 20 ≤ 100 · 20.0 %", fillcolor="#e8f5e9"];
                  1 [label="pilot: Pilot\nR 50 > 40 ✗ · 30.0 %", fillcolor="#fdecea"];
                  2 [label="spare: Unknown\nnot real-time", fillcolor="#eef3f8"];
                  0 -> 1 [label="scan"];
                  1 -> 1 [label="go"];
                }
            "##]],
        );
    }

    #[test]
    fn each_project_has_its_own() {
        let Fixture { db, workspace, .. } = Fixture::new(
            "//- /a.mal\ninclude \"lib.mal\" architecture A { } deployment D { architecture A }\n\
             //- /b.mal\ninclude \"lib.mal\" architecture B { import Shared }\n\
             //- /lib.mal\nlibrary l { architecture Shared { } }\n\
             //- /mauve.toml\ntiming.tables = ['t.toml']\n//- /t.toml\ncodel.deployment = 1\n//- /other.toml\n",
        );
        let selection = |path: &str, of: GraphsOf<'_>| {
            let file = workspace.file(&db, path.as_ref()).unwrap();
            selected_graphs(&db, &[workspace], file, of).map(|found| {
                let shown = |(project, of): (Project<'_>, Decl<'_>)| {
                    format!("{} in {}", of.qualified(&db), project.root(&db).path(&db).display())
                };
                found.into_iter().map(shown).collect::<Vec<_>>().join(", ")
            })
        };
        let ok = |text: &str| Ok(text.to_owned());
        let both = ok("l.Shared in /a.mal, l.Shared in /b.mal");
        assert_eq!(selection("/lib.mal", GraphsOf::File), both);
        assert_eq!(selection("/lib.mal", GraphsOf::At(20.into())), both);
        assert_eq!(selection("/lib.mal", GraphsOf::Name("Shared")), both);
        assert_eq!(selection("/lib.mal", GraphsOf::Name("B")), ok("B in /b.mal"));
        assert_eq!(selection("/a.mal", GraphsOf::File), ok("D in /a.mal"));
        assert_eq!(selection("/a.mal", GraphsOf::At(30.into())), ok("A in /a.mal"));
        for of in [GraphsOf::File, GraphsOf::At(8.into())] {
            assert_eq!(selection("/t.toml", of), ok("D in /a.mal"));
        }
        let why = |path: &str, of| selection(path, of).unwrap_err();
        assert_eq!(why("/lib.mal", GraphsOf::At(2.into())), "no deployment or architecture here");
        assert_eq!(why("/other.toml", GraphsOf::File), "this file is not part of any project");
        let none = "no deployment or architecture `C` in the projects of this file";
        assert_eq!(why("/a.mal", GraphsOf::Name("C")), none);
    }

    #[test]
    fn as_svg() {
        let svg = drawn("D", Drawing::Svg);
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        for label in
            [">laser: Laser<", ">R 20 ≤ 100 · 20.0 %<", ">R 50 &gt; 40 ✗ · 30.0 %<", "data-instance=\"2\""]
        {
            assert!(svg.contains(label), "{label} in {svg}");
        }
    }

    #[test]
    fn rings_have_columns_too() {
        let lines =
            |pairs: &[(usize, usize)]| pairs.iter().map(|&(a, b)| ((a, b, false), vec!["x"])).collect();
        assert_eq!(columns(3, &lines(&[(0, 1), (1, 2), (0, 2)])), [0, 1, 2]);
        assert_eq!(columns(3, &lines(&[(0, 1), (1, 0), (1, 2), (2, 2)])), [0, 1, 2]);
        assert_eq!(columns(0, &lines(&[])), [0; 0]);
    }

    #[test]
    fn the_graph_at_the_cursor() {
        let text = format!(
            "include \"more.mal\"{MODEL}//- /more.mal\nlibrary l {{ architecture M {{ }} }}deployment N {{ }}\n"
        );
        let Fixture { db, workspace, file, .. } = Fixture::new(&text);
        let more = workspace.file(&db, "/more.mal".as_ref()).unwrap();
        let ask = |file: File, of: GraphsOf<'_>| match selected_graphs(&db, &[workspace], file, of) {
            Ok(all) => all.iter().map(|(_, of)| of.name(&db).as_str()).collect::<Vec<_>>().join(", "),
            Err(why) => why,
        };
        let at = |text: &str| GraphsOf::At((file.text(&db).find(text).unwrap() as u32).into());
        assert_eq!(ask(file, GraphsOf::File), "D");
        assert_eq!([ask(file, at("spare: U")), ask(file, at("pilot { pr"))], ["A", "D"]);
        assert_eq!(ask(file, at("core CL")), "no deployment or architecture here");
        // At the end of one; and where another begins.
        let ends = [GraphsOf::At(30.into()), GraphsOf::At(32.into()), GraphsOf::At(48.into())];
        assert_eq!(ends.map(|of| ask(more, of)), ["M", "N", "N"]);
        assert_eq!(["M", "l.M", "N"].map(|name| ask(file, GraphsOf::Name(name))), ["M", "M", "N"]);
        assert_eq!(
            ask(file, GraphsOf::Name("K")),
            "no deployment or architecture `K` in the projects of this file"
        );
        assert_eq!(
            selected_graphs(&db, &[], file, GraphsOf::File),
            Err("this file is not part of any project".to_owned())
        );
    }
}
