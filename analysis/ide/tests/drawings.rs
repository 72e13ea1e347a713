//! Drawings of random models, checked from the geometry of their SVG: no text covers another text, a line or the border of a box;
//! each line ends at the border of its boxes; no line crosses a box.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use mauve_diagnostics::figure::TIGHT_SLACK;
use mauve_hir::item_tree::Kind;
use mauve_hir::{Database, Workspace, names_of, projects};
use mauve_ide::{Drawing, MachineTitle, draw_graph, draw_state_machine, graph, state_machine};
use mauve_timing::Level;
use mauve_wcrt::{Query, first_tables};

/// The same numbers on each machine.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % end.max(1)
    }

    fn name(&mut self, number: usize) -> String {
        const WORDS: [&str; 8] =
            ["laser", "map", "pose", "command", "x", "odometry", "obstacle_distance", "WWWWMMMM"];
        format!("{}_{number}", WORDS[self.below(WORDS.len())])
    }
}

/// Returns a model with instances that are connected at random, each with a random state machine; and its timing table.
fn random_model(random: &mut Random) -> (String, String) {
    let count = random.below(14) + 1;
    let mut model = "codel work(): int\n".to_owned();
    let mut instances: Vec<(String, Vec<String>, Vec<String>)> = Vec::new();
    for number in 0..count {
        let inputs: Vec<String> =
            (0..random.below(5)).map(|port| format!("in_{}", random.name(port))).collect();
        let outputs: Vec<String> =
            (0..random.below(4)).map(|port| format!("out_{}", random.name(port))).collect();
        let _ = write!(model, "shell S{number} {{");
        for name in &inputs {
            let _ = write!(model, " input port {name}: int ");
        }
        for name in &outputs {
            let _ = write!(model, " output port {name}: int ");
        }
        let _ = write!(model, "}}\ncore C{number}(S{number}) {{ statemachine {{\n");
        let states: Vec<String> = (0..random.below(7) + 1).map(|state| random.name(state)).collect();
        for (index, state) in states.iter().enumerate() {
            let initial = if index == 0 { "initial " } else { "" };
            let _ = write!(model, "  {initial}state {state} {{ run = {{ work(); }}");
            for transition in 0..random.below(4) {
                let target = &states[random.below(states.len())];
                let _ = write!(model, " transition t{transition} if (work() > {transition}) to {target}");
            }
            // Each state can be reached.
            let next = &states[(index + 1) % states.len()];
            let _ = writeln!(model, " transition next if (work() > 9) to {next} }}");
        }
        let instance = random.name(number);
        let _ = writeln!(model, "}} }}\ncomponent Component_{instance}(S{number}, C{number})");
        instances.push((instance, inputs, outputs));
    }
    model += "architecture A {\n";
    for (instance, ..) in &instances {
        let _ = writeln!(model, "  instance {instance}: Component_{instance}");
    }
    for (instance, inputs, _) in &instances {
        for input in inputs {
            let (source, _, outputs) = &instances[random.below(count)];
            if !outputs.is_empty() {
                let _ = writeln!(
                    model,
                    "  connection {source}.{} -> {instance}.{input}",
                    outputs[random.below(outputs.len())]
                );
            }
        }
    }
    model += "}\ndeployment D {\n  architecture A\n";
    for (priority, (instance, ..)) in instances.iter().enumerate() {
        let period = (random.below(20) + 1) * 10;
        let _ = writeln!(model, "  activity {instance} {{ priority = {} period = {period} }}", priority + 1);
    }
    (model + "}\n", format!("codel.work = {}\n", [1, 7, 1000][random.below(3)]))
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Area {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Area {
    fn overlaps(self, other: Area) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }

    fn contains(self, other: Area) -> bool {
        self.left <= other.left
            && self.top <= other.top
            && self.right >= other.right
            && self.bottom >= other.bottom
    }

    fn has_on_border(self, (x, y): (f64, f64)) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() < 0.11;
        let is_beside = (near(x, self.left) || near(x, self.right)) && y >= self.top && y <= self.bottom;
        let is_below = (near(y, self.bottom) || near(y, self.top)) && x >= self.left && x <= self.right;
        is_beside || is_below
    }
}

/// The points of a line, and the numbers of its boxes.
type Wire = (Vec<(f64, f64)>, (usize, usize));

/// What an SVG document draws.
#[derive(Debug, Default)]
struct Drawn {
    size: (f64, f64),
    frames: Vec<Area>,
    /// The texts with the number of the box that they are in.
    texts: Vec<(String, Area, Option<usize>)>,
    wires: Vec<Wire>,
}

impl Drawn {
    fn of(svg: &str) -> Drawn {
        let mut drawn = Drawn::default();
        let mut ends = (0, 0);
        let mut in_box = None;
        for tag in svg.split("</style>").last().unwrap().split('<').skip(1) {
            let (tag, content) = tag.split_once('>').unwrap();
            let attributes = attributes(tag);
            let number = |name: &str| attributes.get(name).map_or(0.0, |value| value.parse::<f64>().unwrap());
            let class = attributes.get("class").map(String::as_str).unwrap_or_default();
            if tag.starts_with("g ") {
                in_box = class.starts_with("box").then_some(drawn.frames.len());
                ends = (number("data-source") as usize, number("data-target") as usize);
            } else if class == "frame" {
                let (left, top) = (number("x"), number("y"));
                let (right, bottom) = (left + number("width"), top + number("height"));
                drawn.frames.push(Area { left, top, right, bottom });
            } else if class.starts_with("wire") {
                drawn.wires.push((points(&attributes["d"]), ends));
            } else if tag.starts_with("text") && !content.is_empty() {
                let size = if class == "name" {
                    13.0
                } else if class == "heading" {
                    14.0
                } else {
                    12.0
                };
                let letters = content.replace("&gt;", ">").replace("&lt;", "<");
                let bold = if ["name", "heading", "figure status"].contains(&class) { 1.1 } else { 1.0 };
                let width: f64 = letters.chars().map(|letter| width(letter) * size * bold).sum();
                let (x, bottom) = (number("x"), number("y") + 0.2 * size);
                let left = match attributes.get("text-anchor").map(String::as_str) {
                    Some("middle") => x - width / 2.0,
                    Some("end") => x - width,
                    _ => x,
                };
                let area = Area { left, top: bottom - size, right: left + width, bottom };
                drawn.texts.push((letters, area, in_box));
            }
            if tag == "/g" {
                in_box = None;
            }
        }
        let head = attributes(svg.split('>').next().unwrap());
        drawn.size = (head["width"].parse().unwrap(), head["height"].parse().unwrap());
        drawn
    }

    fn check(&self) {
        let all = Area { left: 0.0, top: 0.0, right: self.size.0, bottom: self.size.1 };
        for (index, frame) in self.frames.iter().enumerate() {
            assert!(all.contains(*frame), "{frame:?} is not inside the drawing");
            for other in &self.frames[index + 1..] {
                assert!(!frame.overlaps(*other), "{frame:?} overlaps {other:?}");
            }
        }
        for (index, (text, area, in_box)) in self.texts.iter().enumerate() {
            assert!(all.contains(*area), "`{text}` {area:?} is not inside the drawing");
            for (number, frame) in self.frames.iter().enumerate() {
                match *in_box == Some(number) {
                    true => assert!(frame.contains(*area), "`{text}` leaves its box: {area:?} in {frame:?}"),
                    false => {
                        assert!(!frame.overlaps(*area), "`{text}` overlaps a box: {area:?} and {frame:?}")
                    }
                }
            }
            for (other, other_area, _) in &self.texts[index + 1..] {
                assert!(!area.overlaps(*other_area), "`{text}` overlaps `{other}`: {area:?} {other_area:?}");
            }
        }
        for (points, (source, target)) in &self.wires {
            for (point, number) in [(points.first(), source), (points.last(), target)] {
                let (point, frame) = (*point.unwrap(), self.frames[*number]);
                assert!(frame.has_on_border(point), "{point:?} is not on the border of {frame:?}");
            }
            for pair in points.windows(2) {
                let ((ax, ay), (bx, by)) = (pair[0], pair[1]);
                // A little less than the line: its ends touch borders.
                let line = Area {
                    left: ax.min(bx) + 0.2,
                    top: ay.min(by) + 0.2,
                    right: (ax.max(bx) - 0.2).max(ax.min(bx) + 0.3),
                    bottom: (ay.max(by) - 0.2).max(ay.min(by) + 0.3),
                };
                for frame in &self.frames {
                    assert!(!frame.overlaps(line), "a line crosses a box: {line:?} and {frame:?}");
                }
                for (text, area, _) in &self.texts {
                    assert!(!area.overlaps(line), "a line crosses `{text}`: {line:?} and {area:?}");
                }
            }
        }
    }
}

/// The widths of letters in DejaVu Sans, the widest of the usual fonts, rounded up to a few classes; of a letter of height 1.
fn width(letter: char) -> f64 {
    match letter {
        ' ' | 'i' | 'j' | 'l' | '.' | ',' | ':' | '·' => 0.34,
        'f' | 't' | 'r' | '(' | ')' => 0.42,
        'm' | 'w' | 'M' | 'W' | '%' => 0.99,
        '✓' | '✗' | '≤' | '>' | '…' => 0.9,
        'A'..='Z' => 0.72,
        _ => 0.64,
    }
}

fn attributes(tag: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut rest = tag;
    while let Some((before, after)) = rest.split_once("=\"") {
        let (value, next) = after.split_once('"').unwrap();
        let name = before.rsplit(' ').next().unwrap();
        found.insert(name.to_owned(), value.to_owned());
        rest = next;
    }
    found
}

/// Returns the points of a path, including the control points of its corners.
fn points(path: &str) -> Vec<(f64, f64)> {
    let numbers = path.split(['M', 'L', 'Q', ' ']).filter(|it| !it.is_empty());
    let numbers: Vec<f64> = numbers.map(|it| it.parse().unwrap()).collect();
    numbers.chunks(2).map(|pair| (pair[0], pair[1])).collect()
}

fn workspace(db: &Database, model: &str, table: &str) -> Workspace {
    let texts = [
        ("/model.mal", model),
        ("/mauve.toml", "timing.tables = [\"t.toml\"]\n[platform]\ncpus = 1\nrt_throttling = false\n"),
        ("/t.toml", table),
    ];
    let texts = texts.map(|(path, text)| (PathBuf::from(path), text.to_owned()));
    Workspace::of_texts(db, "/".into(), texts)
}

/// Checks the drawings of the deployments, architectures and components of a workspace; returns their number.
fn check_all(db: &Database, workspace: Workspace) -> usize {
    let mut count = 0;
    for &project in projects(db, workspace) {
        for &of in names_of(db, project).all.iter() {
            let query = Query::shown(db, project, of);
            let svg = match of.kind(db) {
                Kind::Deployment | Kind::Architecture => {
                    let Some(graph) = graph(db, project, of, query, TIGHT_SLACK) else { continue };
                    let drawn = Drawn::of(&draw_graph(db, &graph, Drawing::Svg));
                    assert_eq!(drawn.frames.len(), graph.nodes.len());
                    assert_eq!(drawn.wires.len(), graph.edges.len());
                    drawn
                }
                Kind::Component => {
                    let level = Level::TEN_TO_MINUS_FOUR;
                    let view = state_machine(db, first_tables(db, project, of), of, level);
                    let title = MachineTitle { component: of.name(db), level, times: None };
                    let drawn = Drawn::of(&draw_state_machine(db, workspace, title, &view, Drawing::Svg));
                    assert_eq!(drawn.frames.len(), view.states.len());
                    drawn
                }
                _ => continue,
            };
            svg.check();
            count += 1;
        }
    }
    count
}

#[test]
fn random_drawings_cover_nothing() {
    let mut random = Random(3);
    let mut count = 0;
    for _ in 0..100 {
        let (model, table) = random_model(&mut random);
        let db = Database::default();
        let workspace = workspace(&db, &model, &table);
        count += check_all(&db, workspace);
    }
    assert!(count > 400, "{count} drawings");
}

#[test]
fn drawings_of_the_robot_cover_nothing() {
    let folder = mauve_tests::models().join("p3dx");
    let db = Database::default();
    let mut texts = Vec::new();
    let mut folders = vec![folder.clone()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.extension().and_then(|it| it.to_str()) {
                None => folders.push(path),
                Some("mal" | "toml") => texts.push((path.clone(), std::fs::read_to_string(&path).unwrap())),
                Some(_) => {}
            }
        }
    }
    let workspace = Workspace::of_texts(&db, folder, texts);
    assert!(check_all(&db, workspace) > 12);
}

/// A drawing keeps its shape while figures change: an edit moves no box.
#[test]
fn boxes_keep_their_places_when_times_change() {
    let (model, _) = random_model(&mut Random(11));
    let frames = |table: &str| {
        let db = Database::default();
        let workspace = workspace(&db, &model, table);
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let graph =
            graph(&db, project, deployment, Query::shown(&db, project, deployment), TIGHT_SLACK).unwrap();
        let svg = draw_graph(&db, &graph, Drawing::Svg);
        assert!(svg.contains("✓") || svg.contains("✗") || svg.contains("?"), "{svg}");
        Drawn::of(&svg).frames
    };
    assert_eq!(frames("codel.work = 1"), frames("codel.work = 12345.678"));
    assert_eq!(frames("codel.work = 1"), frames(""));
}

#[test]
fn the_checks_find_faults() {
    let svg = |body: &str| format!("<svg width=\"100\" height=\"100\"><style></style>{body}</svg>\n");
    let fails = |body: &str| std::panic::catch_unwind(|| Drawn::of(&svg(body)).check()).is_err();
    let frame = "<g class=\"box\" data-instance=\"0\"><rect class=\"frame\" x=\"10\" y=\"10\" width=\"40\" height=\"40\"/></g>";
    let wire = |path: &str| {
        format!(
            "{frame}<g class=\"link\" data-source=\"0\" data-target=\"0\"><path class=\"wire\" d=\"{path}\"/></g>"
        )
    };
    assert!(!fails(&wire("M50 20L60 20L60 60L5 60L5 20L10 20")));
    assert!(fails(&wire("M52 20L60 20L60 60L5 60L5 20L10 20")), "a line that begins beside its box");
    assert!(fails(&wire("M50 20L10 20")), "a line through a box");
    assert!(fails(&format!("{frame}{frame}")), "two boxes at one place");
    assert!(
        fails(&format!("{frame}<text class=\"label\" x=\"45\" y=\"20\">covers</text>")),
        "a text on a border"
    );
    let two =
        "<text class=\"label\" x=\"5\" y=\"80\">one</text><text class=\"label\" x=\"9\" y=\"84\">two</text>";
    assert!(fails(two), "a text on another");
}
