//! The execution times of a codel, or of all codels of an activity, at the significance levels of the timing tables: how probable it
//! is that an execution exceeds a time. As data and as a drawing.

use std::fmt::Write as _;

use mauve_diagnostics::{times_of, unusable_time};
use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, File, ModelDb, Project, names_of};
use mauve_syntax::TextSize;
use mauve_timing::{Level, Measured, Time, Unit};
use mauve_wcrt::{
    Lookup, ResolvedActivity, TableSet, Timed, executed_times, files_of, level_shown, system_of, table,
    table_sets, timetable_of,
};

use crate::drawing::Drawing;
use crate::occurrences::{Definition, names_at};
use crate::probability_plot::{PlotPoint, ProbabilityPlot, plot_width};

/// The execution times of a codel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exceedance {
    /// The name of the codel.
    pub codel: String,
    /// The name in the header `[timing.deployment.NAME]` of the tables; none for those of `[timing] tables`.
    pub times: Option<String>,
    /// The execution times at the levels of the tables and at the level that editors show, in descending order of probability.
    pub levels: Vec<(Level, Time)>,
    /// The level that editors show.
    pub shown: Level,
    /// Whether `[assume]` gives the times: no table has one.
    pub is_assumed: bool,
    /// What was measured: when, how often, how, and what is doubtful.
    pub evidence: Vec<String>,
    /// Why times are missing.
    pub reasons: Vec<String>,
}

/// Selects a codel of a project.
#[derive(Debug, Clone, Copy)]
pub enum CodelOf<'a> {
    /// By its name, `library.name` or `name`.
    Name(&'a str),
    /// The one at this offset of the file: its declaration, a call, or its entry in a timing table.
    At(TextSize),
}

/// Returns the selected codel.
pub fn selected_codel<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    file: File,
    selection: CodelOf<'_>,
) -> Option<Decl<'db>> {
    match selection {
        CodelOf::Name(name) => {
            names_of(db, project).of_kind(db, Kind::Codel).find(|of| of.is_called(db, name))
        }
        CodelOf::At(offset) => {
            names_at(db, project, file, offset).into_iter().find_map(|found| match found.definition {
                Definition::Declaration(of) if of.kind(db) == Kind::Codel => Some(of),
                _ => None,
            })
        }
    }
}

/// Returns the execution times of a codel in the first timing tables of the project that have one.
pub fn exceedance<'db>(db: &'db dyn ModelDb, project: Project<'db>, codel: Decl<'db>) -> Exceedance {
    let all = table_sets(db, project).iter().map(|&tables| in_tables(db, tables, codel));
    let mut all: Vec<Exceedance> = all.collect();
    let first = all.iter().position(|it| !it.levels.is_empty() && !it.is_assumed).unwrap_or_default();
    if first < all.len() {
        return all.swap_remove(first);
    }
    in_tables(db, TableSet::new(db, project, None, None), codel)
}

/// An activity, and the codels that it executes, at least one.
pub type ActivityCodels<'db> = (&'db ResolvedActivity<'db>, Vec<Decl<'db>>);

/// Returns the activities of all deployments that execute codels.
pub fn activity_codels<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<ActivityCodels<'db>> {
    let of_deployment = |deployment: Decl<'db>| {
        let executed = executed_times(db, project, deployment, level_shown(db, project));
        let activities = system_of(db, project, deployment).activities.iter().enumerate();
        activities.map(move |(index, activity)| {
            let own = executed.iter().filter(|it| it.activities().binary_search(&index).is_ok());
            let codel = |of: &Timed<'db>| if let Timed::Codel(codel) = of { Some(*codel) } else { None };
            (activity, own.filter_map(|it| codel(&it.of)).collect())
        })
    };
    let all = names_of(db, project).of_kind(db, Kind::Deployment).flat_map(of_deployment);
    all.filter(|(_, codels): &ActivityCodels<'db>| !codels.is_empty()).collect()
}

/// Returns the execution times of the codels of an activity, the longest one at the shown level first.
pub fn exceedances_of(db: &dyn ModelDb, (activity, codels): &ActivityCodels<'_>) -> Vec<Exceedance> {
    let mut all: Vec<_> = codels.iter().map(|codel| in_tables(db, activity.tables, *codel)).collect();
    all.sort_by_key(|it| std::cmp::Reverse(it.time(it.shown)));
    for Exceedance { codel, evidence, reasons, .. } in &mut all {
        evidence.iter_mut().chain(reasons).for_each(|text| *text = format!("{codel}: {text}"));
    }
    all
}

impl Exceedance {
    /// Returns the time at a level.
    pub fn time(&self, level: Level) -> Option<Time> {
        self.levels.iter().find(|it| it.0 == level).map(|it| it.1)
    }
}

fn in_tables<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>, codel: Decl<'db>) -> Exceedance {
    let table = timetable_of(db, tables);
    let shown = level_shown(db, tables.project(db));
    let mut known = table.levels.clone();
    if !known.contains(&shown) {
        known.push(shown);
    }
    known.sort_unstable_by(|a, b| b.cmp(a));
    let mut found = Exceedance {
        codel: codel.qualified(db),
        times: tables.label(db),
        levels: Vec::new(),
        shown,
        is_assumed: false,
        evidence: measurements(db, tables, codel).collect(),
        reasons: Vec::new(),
    };
    for level in known {
        match table.codel_time(db, codel, level) {
            Lookup::Known(time) => found.levels.push((level, time)),
            Lookup::Assumed(time) => {
                found.levels.push((level, time));
                found.is_assumed = true;
            }
            Lookup::Absent => found.reasons.push(format!("no time at {level}")),
            Lookup::Unusable(why) => found.reasons.push(unusable_time(db, &why)),
        }
    }
    found.reasons.dedup();
    found
}

/// Returns the measurements of a codel in words, by its key with or without the library.
pub(crate) fn measurements<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    codel: Decl<'db>,
) -> impl Iterator<Item = String> {
    let all = files_of(db, tables).iter().flat_map(|&file| &table(db, file).measured);
    let of_codel = all.filter(move |it| it.key == codel.qualified(db) || it.key == **codel.name(db));
    of_codel.map(|Measured { date, executions, greatest, method, warnings, .. }| {
        let plural = if *executions == 1 { "" } else { "s" };
        let method = if method.is_empty() { String::new() } else { format!("\nmethod: {method}") };
        let warnings =
            if warnings.is_empty() { String::new() } else { format!("\nwarnings: {}", warnings.join(", ")) };
        format!(
            "measured on {date}: {executions} execution{plural}, the longest {greatest}{method}{warnings}"
        )
    })
}

/// Draws the execution times of a codel, or those of the codels of an instance beside each other. In SVG, each level of one codel
/// has `data-level` with its index.
pub fn draw_exceedance(instance: Option<&str>, all: &[Exceedance], drawing: Drawing) -> String {
    match drawing {
        Drawing::Text(_) | Drawing::Dot => all.iter().map(text).collect::<Vec<_>>().join("\n"),
        Drawing::Svg | Drawing::Narrow => svg(instance, all, plot_width(drawing)),
    }
}

fn title(of: &Exceedance) -> String {
    let assumed = if of.is_assumed { ", assumed" } else { "" };
    format!(
        "{}{}: probability that an execution exceeds a time{assumed}",
        of.codel,
        times_of(of.times.as_deref())
    )
}

fn text(of: &Exceedance) -> String {
    const WIDTH: f64 = 50.0;
    let greatest = of.levels.iter().map(|(_, time)| time.as_f64(Unit::Milliseconds)).fold(0.0, f64::max);
    let mut out = format!("{}\n\n", title(of));
    for (level, time) in &of.levels {
        let part = time.as_f64(Unit::Milliseconds) / greatest.max(f64::MIN_POSITIVE);
        let bar = "█".repeat((part * WIDTH).round() as usize);
        let mark = if *level == of.shown { " (current level)" } else { "" };
        let _ = writeln!(out, "{:>8}  {bar} {time}{mark}", level.to_string());
    }
    out.extend(of.reasons.iter().map(|reason| format!("{reason}\n")));
    out
}

/// How lines look beside each other.
const LINES: [&str; 10] = [
    "curve", "curve c1", "curve c2", "curve c3", "curve c4", "curve c5", "curve c6", "curve c7", "curve c8",
    "curve c9",
];

fn svg(instance: Option<&str>, all: &[Exceedance], width: f64) -> String {
    // Beside each other, all of them say their times in the legend.
    let labelled = if let [of] = all { of.levels.as_slice() } else { &[] };
    let points = labelled.iter().map(|(level, time)| PlotPoint {
        time: *time,
        probability: level.as_f64(),
        label: format!("{time} at {level}"),
        title: format!("{time} at {level}: an execution takes longer with a probability of at most {level}"),
        is_shown: all.iter().any(|of| of.shown == *level),
    });
    let of_codels = |it| format!("{it}: probability that an execution of a codel exceeds a time");
    let lines = all.iter().zip(LINES.iter().cycle()).map(|(of, class)| {
        let time = of.time(of.shown).map_or_else(|| "no time".to_owned(), |time| time.to_string());
        let assumed = if of.is_assumed { ", assumed" } else { "" };
        let stairs = of.levels.iter().map(|(level, time)| (*time, level.as_f64()));
        (*class, format!("{}: {time} at {}{assumed}", of.codel, of.shown), stairs.collect())
    });
    ProbabilityPlot {
        title: instance.map(of_codels).or(all.first().map(title)).unwrap_or_default(),
        axis: "execution time in ms",
        upright: "probability of a longer execution",
        points: points.collect(),
        width,
        deadline: None,
        level: all.get(1).map(|of| of.shown.as_f64()),
        lines: lines.collect(),
    }
    .svg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::step;
    use crate::fixture::{Fixture, project_of};
    use expect_test::expect;

    const MODEL: &str = "
codel se$0e(): int
codel unknown(): int
//- /mauve.toml
timing.tables = [\"t.toml\"]
//- /t.toml
levels = [1e-3, 1e-4, 1e-9]
codel.see = [20, 23, 30.5]
";

    fn of(selection: impl Fn(TextSize) -> CodelOf<'static>) -> Option<Exceedance> {
        let Fixture { db, workspace, file, offset } = Fixture::new(MODEL);
        let project = project_of(&db, workspace, file);
        let codel = selected_codel(&db, project, file, selection(offset))?;
        Some(exceedance(&db, project, codel))
    }

    #[test]
    fn times_at_all_levels() {
        let found = of(CodelOf::At).unwrap();
        expect![[r#"
            see: probability that an execution exceeds a time

                1e-3  █████████████████████████████████ 20 ms
                1e-4  ██████████████████████████████████████ 23 ms (current level)
                1e-9  ██████████████████████████████████████████████████ 30.5 ms
        "#]]
        .assert_eq(&draw_exceedance(None, std::slice::from_ref(&found), Drawing::Text(None)));
        let svg = draw_exceedance(None, std::slice::from_ref(&found), Drawing::Svg);
        for part in ["30.5 ms at 1e-9", "class=\"level worst\" data-level=\"1\"", "execution time in ms"] {
            assert!(svg.contains(part), "{part} in {svg}");
        }
        assert!(!svg.contains("NaN"));
    }

    const ROBOT: &str = "
codel see(): int
codel plan(): int
codel clean(): int
shell S { }
core C(S) { update = { see(); plan(); } }
component K(S, C)
architecture A { instance eye: K }
deployment D { architecture A  activity eye { priority = 1 period = 100 } }
//- /mauve.toml
timing.tables = [\"t.toml\"]
//- /t.toml
levels = [1e-3, 1e-4, 1e-9]
codel = { see = [20, 23, 30.5], plan = 0.4, clean = 7 }
$0";

    /// Returns the position of a tick by its label, as it is drawn.
    fn tick(svg: &str, axis: char, label: &str) -> f64 {
        let anchor = if axis == 'x' { "middle" } else { "end" };
        let before = svg.split(&format!(" text-anchor=\"{anchor}\">{label}</text>")).next().unwrap();
        let value = before.rsplit(&format!(" {axis}=\"")).next().unwrap();
        value.split('"').next().unwrap().parse().unwrap()
    }

    /// Returns the height of a path with horizontal and vertical parts at a place.
    fn height_at(path: &str, at: f64) -> f64 {
        let (mut x, mut y) = (0.0, 0.0);
        for part in path.replace('H', "\nH").replace('V', "\nV").lines() {
            let value = |text: &str| text.parse::<f64>().unwrap();
            match part.split_at(1) {
                ("M", start) => (x, y) = start.split_once(' ').map(|(x, y)| (value(x), value(y))).unwrap(),
                ("H", to) if x <= at && at <= value(to) => return y,
                ("H", to) => x = value(to),
                (_, to) => y = value(to),
            }
        }
        panic!("{path} does not reach {at}")
    }

    #[test]
    fn codels_of_an_activity_are_compared() {
        let Fixture { db, workspace, file, .. } = Fixture::new(ROBOT);
        let project = project_of(&db, workspace, file);
        let [eye] = &activity_codels(&db, project)[..] else { panic!("one activity") };
        let all = exceedances_of(&db, eye);
        expect![[r#"
            see: probability that an execution exceeds a time

                1e-3  █████████████████████████████████ 20 ms
                1e-4  ██████████████████████████████████████ 23 ms (current level)
                1e-9  ██████████████████████████████████████████████████ 30.5 ms

            plan: probability that an execution exceeds a time

                1e-3  ██████████████████████████████████████████████████ 0.4 ms
                1e-4  ██████████████████████████████████████████████████ 0.4 ms (current level)
                1e-9  ██████████████████████████████████████████████████ 0.4 ms
        "#]]
        .assert_eq(&draw_exceedance(Some(&eye.0.instance), &all, Drawing::Text(None)));
        let svg = draw_exceedance(Some(&eye.0.instance), &all, Drawing::Svg);
        // By the ticks, as a reader does.
        let (one, ten) = (tick(&svg, 'x', "1"), tick(&svg, 'x', "10"));
        let x = |time: f64| one + (ten - one) * time.log10();
        let (top, third) = (tick(&svg, 'y', "1"), tick(&svg, 'y', "1e-3"));
        let y = |level: f64| top + (third - top) * level.log10() / -3.0;
        let curve = |class: &str| {
            svg.split(&format!("<path class=\"{class}\" d=\"")).nth(1).unwrap().split('"').next().unwrap()
        };
        for (time, level) in [(20.1, 1e-3), (22.9, 1e-3), (23.1, 1e-4), (30.4, 1e-4)] {
            let found = height_at(curve("curve"), x(time));
            assert!((found - y(level)).abs() < 0.1, "{found} is not {} at {time} ms", y(level));
        }
        let places = [("curve", 20.0, 30.5), ("curve c1", 0.4, 0.4)];
        for (class, first, last) in places {
            let path = curve(class);
            let start: f64 = path.trim_start_matches('M').split(' ').next().unwrap().parse().unwrap();
            let end: f64 = path.rsplit('H').next().unwrap().split('V').next().unwrap().parse().unwrap();
            assert!((start - x(first)).abs() < 0.1 && (end - x(last)).abs() < 0.1, "{path}");
        }
        let level =
            curve("limit").trim_start_matches('M').split(['H', ' ']).nth(1).unwrap().parse::<f64>().unwrap();
        assert!((level - y(1e-4)).abs() < 0.1, "{level}");
        let names: Vec<_> =
            svg.split("x=\"40\" y=\"0\">").skip(1).filter_map(|it| it.split('<').next()).collect();
        assert_eq!(names, ["see: 23 ms at 1e-4", "plan: 0.4 ms at 1e-4"]);
    }

    #[test]
    fn without_times_there_are_reasons() {
        let found = of(|_| CodelOf::Name("unknown")).unwrap();
        assert!(found.levels.is_empty());
        expect![[r#"
            unknown: probability that an execution exceeds a time

            no time at 1e-3
            no time at 1e-4
            no time at 1e-9
        "#]]
        .assert_eq(&draw_exceedance(None, std::slice::from_ref(&found), Drawing::Text(None)));
        let svg = draw_exceedance(None, std::slice::from_ref(&found), Drawing::Svg);
        assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{svg}");
        assert_eq!(of(|_| CodelOf::Name("missing")), None);
        assert_eq!(of(|_| CodelOf::At(0.into())), None);
    }

    #[test]
    fn marks_are_round() {
        let step_of = |greatest: f64| step(greatest / 9.0);
        assert_eq!([0.0, 0.9, 9.0, 9.5, 30.5, 1234.0].map(step_of), [1.0, 0.1, 1.0, 2.0, 5.0, 200.0]);
    }
}
