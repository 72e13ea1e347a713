//! Code lenses above declarations: what can be done with them. The level, the Orocos packages, the architecture and the drawings of a
//! deployment; the chains of an architecture; the instances and the state machine of a component, and the activity that it makes late;
//! the implementation of a codel. Other figures are in hints.

use std::path::PathBuf;

use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::TIGHT_SLACK;
use mauve_diagnostics::supported;
use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{Decl, File, Location, ModelDb, Project, declarations, is_model, target_of};
use mauve_syntax::TextRange;
use mauve_timing::{CpuSet, Level, Status};
use mauve_wcrt::chains::chains_of;
use mauve_wcrt::{ActivityReport, Footing, Query, response_times, support};

use crate::connections::deployments;
use crate::implementation::codel_file;
use crate::occurrences::each_once;
use crate::project::instances_by_component;

/// A code lens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodeLens {
    /// The name of the declaration below it.
    pub range: TextRange,
    /// Its title.
    pub title: String,
    /// The action of a click.
    pub action: LensAction,
}

/// The action of a click on a lens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LensAction {
    /// Lets the user choose a level; this one is shown.
    ChooseSignificance(Level),
    /// Generates the packages of this deployment, given by its qualified name.
    Generate(String),
    /// Shows these locations. There may be none.
    Show(Vec<(File, TextRange)>),
    /// Opens this file, if it exists.
    Open(PathBuf),
    /// Shows a drawing of the declaration.
    Draw(LensDrawing),
}

/// A drawing of a declaration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LensDrawing {
    /// Of a deployment: its instances and connections.
    Architecture,
    /// Of a deployment: the schedule behind a response time.
    Schedule,
    /// Of a component.
    StateMachine,
    /// Of an architecture: how long data takes in its deployments.
    Chains,
    /// Of a deployment: its figures beside those with other values.
    WhatIf,
}

/// Returns the lenses of a file, in text order; without a project, those that need none.
///
/// ```
/// use mauve_hir::{Database, Workspace, projects};
///
/// let model = "component P(S, C)\narchitecture A { instance pilot: P }";
/// let db = Database::default();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/robot.mal".into(), model.to_owned())]);
/// let file = workspace.file(&db, "/robot.mal".as_ref()).unwrap();
/// let lenses = mauve_ide::code_lenses(&db, Some(projects(&db, workspace)[0]), file);
/// assert_eq!(lenses[0].title, "used in 1 instance");
/// ```
pub fn code_lenses(db: &dyn ModelDb, project: Option<Project<'_>>, file: File) -> Vec<CodeLens> {
    if !is_model(file.path(db)) {
        return Vec::new();
    }
    let mut found = Vec::new();
    for &decl in declarations(db, file).all.iter().filter(|decl| !decl.name(db).is_empty()) {
        let range = Location::name_of(decl).range(db);
        let mut add = |title: String, action| found.push(CodeLens { range, title, action });
        match decl.kind(db) {
            Kind::Deployment => {
                if let Some(project) = project {
                    let Query { level, .. } = Query::shown(db, project, decl);
                    let supported = support(db, project, decl, level).map(supported);
                    let title = supported.unwrap_or_else(|| format!("Level {level}"));
                    add(format!("{title} ▾"), LensAction::ChooseSignificance(level));
                }
                add("Generate Orocos".to_owned(), LensAction::Generate(decl.qualified(db)));
                if let Some(target) = project.and_then(|project| target_of(db, project, decl)) {
                    let place = (target.file(db), Location::name_of(target).range(db));
                    add("Architecture".to_owned(), LensAction::Show(vec![place]));
                    add("Graph".to_owned(), LensAction::Draw(LensDrawing::Architecture));
                    add("Schedule".to_owned(), LensAction::Draw(LensDrawing::Schedule));
                    add("What if…".to_owned(), LensAction::Draw(LensDrawing::WhatIf));
                }
            }
            Kind::Component => {
                let (title, places) = instances(db, project, decl);
                add(title, LensAction::Show(places));
                add("State machine".to_owned(), LensAction::Draw(LensDrawing::StateMachine));
                let late = project.and_then(|project| late(db, project, decl));
                late.into_iter().for_each(|(title, place)| add(title, LensAction::Show(vec![place])));
            }
            Kind::Codel => {
                let file = project.and_then(|project| codel_file(db, project, decl));
                if let Some((file, name)) = file.as_ref().and_then(|file| Some((file, file.file_name()?))) {
                    add(name.display().to_string(), LensAction::Open(file.clone()));
                }
            }
            Kind::Architecture => {
                let titles = project.map_or_else(Vec::new, |project| chains(db, project, decl));
                titles.into_iter().for_each(|title| add(title, LensAction::Draw(LensDrawing::Chains)));
            }
            Kind::Use | Kind::Shell | Kind::Core => {}
        }
    }
    found
}

/// Returns titles such as `5 chains: 3 have a latency, 1 late`, one for each deployment of an architecture where they differ.
fn chains<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<String> {
    let own =
        deployments(db, project).into_iter().filter(|(_, flat)| flat.architectures.first() == Some(&of));
    let title = |(deployment, _): (Decl<'db>, _)| {
        let chains = chains_of(db, project, deployment, Query::shown(db, project, deployment));
        let known = chains.all.iter().filter(|it| it.latency.is_some()).count();
        let late = chains.all.iter().filter(|it| it.latency.is_some() && !it.is_within_limit());
        let late = match late.count() {
            0 => String::new(),
            late => format!(", {late} late"),
        };
        let title = match chains.all.len() + chains.left_out {
            0 => return None,
            1 if known == 1 => format!("1 chain with a latency{late}"),
            1 => "1 chain without a latency".to_owned(),
            all => format!("{all} chains: {known} have a latency{late}"),
        };
        Some((title, deployment.name(db)))
    };
    let titles: Vec<(String, &Name)> = own.filter_map(title).collect();
    match titles.first() {
        Some((first, _)) if titles.iter().all(|(title, _)| title == first) => vec![first.clone()],
        _ => titles.into_iter().map(|(title, name)| format!("{name}: {title}")).collect(),
    }
}

/// Returns the latest of the activities that miss their deadlines because of a component or in it, as a title such as
/// `delays navigation: ✗ 1080 / 1000 ms`, and its place: an edit of the component may be the cause.
fn late(db: &dyn ModelDb, project: Project<'_>, of: Decl<'_>) -> Option<(String, (File, TextRange))> {
    let reports = deployments(db, project);
    let reports =
        reports.iter().map(|(it, _)| response_times(db, project, *it, Query::shown(db, project, *it)));
    let late = reports.flat_map(|report| {
        let own: Vec<&ActivityReport<'_>> =
            report.activities.iter().filter(|it| it.component == Some(of)).collect();
        let cpus = |it: &ActivityReport<'_>| it.cpus.unwrap_or(CpuSet::ALL);
        let delays = move |it: &ActivityReport<'_>| {
            own.iter().any(|own| own.priority >= it.priority && cpus(own).meets(cpus(it)))
        };
        let is_late = |it: &&ActivityReport<'_>| {
            matches!(it.verdict, Status::Missed | Status::Unbounded | Status::NoBound)
        };
        report.activities.iter().filter(is_late).filter(move |it| delays(it))
    });
    // Without a bound before with one.
    let latest = late.max_by(|one, other| {
        let part = |it: &ActivityReport<'_>| it.used().unwrap_or(f64::INFINITY);
        part(one).total_cmp(&part(other))
    })?;
    let at = latest.at.as_ref()?;
    let what = if latest.component == Some(of) { "" } else { "delays " };
    let figure = figure(db, latest, Footing::Known, TIGHT_SLACK);
    Some((format!("{what}{}: {}", latest.instance, figure.text()), (at.file(db), at.range(db))))
}

/// Returns a title such as `used in 2 instances`, and the instances; each location counts once.
fn instances<'db>(
    db: &'db dyn ModelDb,
    project: Option<Project<'db>>,
    of: Decl<'db>,
) -> (String, Vec<(File, TextRange)>) {
    let places = project.and_then(|project| instances_by_component(db, project).get(&of));
    let places = places.into_iter().flatten();
    let places = each_once(places.map(|(_, place)| (place.file(db), place.range(db))));
    let title = match places.len() {
        0 => "not used in any instance".to_owned(),
        1 => "used in 1 instance".to_owned(),
        count => format!("used in {count} instances"),
    };
    (title, places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Fixture, project_with};
    use expect_test::{Expect, expect};

    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, .. } = Fixture::new(fixture);
        let mut shown = String::new();
        for CodeLens { range, title, action } in code_lenses(&db, project_with(&db, workspace, file), file) {
            let action = match action {
                LensAction::ChooseSignificance(level) => format!(" -> choose instead of {level}"),
                LensAction::Generate(deployment) => format!(" -> generate {deployment}"),
                LensAction::Draw(drawing) => format!(" -> draw {drawing:?}"),
                LensAction::Open(path) => format!(" -> open {}", path.display()),
                LensAction::Show(places) => {
                    let place = |(file, range): &(File, TextRange)| {
                        format!(" -> {} {:?} {}", file.path(&db).display(), range, &file.text(&db)[*range])
                    };
                    places.iter().map(place).collect()
                }
            };
            shown += &format!("{}: {title}{action}\n", &file.text(&db)[range]);
        }
        expected.assert_eq(&shown);
    }

    const TABLES: &str = "
//- /mauve.toml
timing.tables = [\"t.toml\"]
[project]
root = \"robot.mal\"
//- /t.toml
levels = [1e-3, 1e-4, 1e-5]
codel.plan = [1, 2, 90]
codel.drive = 20
";

    #[test]
    fn what_stands_above_declarations() {
        let robot = "
/* 🦀 é */ codel plan(): int  codel drive(): int
shell S { }
core C(S) { update = { plan(); } }  core E(S) { update = { drive(); } }
component P(S, C)  component Q(S, E)  component Unused(S, E)
architecture A { instance a: P  instance b: Q }
deployment D {
  architecture A
  activity a { priority = 3 period = 100 }
  activity b { priority = 2 period = 100 deadline = 10 }
}
//- /robot.mal
include \"model.mal\"
architecture B { import A  instance c: P }
";
        check(
            &format!("{robot}{TABLES}"),
            expect![[r#"
                P: used in 2 instances -> /robot.mal 56..57 c -> /model.mal 223..224 a
                P: State machine -> draw StateMachine
                P: delays b: ✗ 22 / 10 ms -> /model.mal 331..332 b
                Q: used in 1 instance -> /model.mal 238..239 b
                Q: State machine -> draw StateMachine
                Q: b: ✗ 22 / 10 ms -> /model.mal 331..332 b
                Unused: not used in any instance
                Unused: State machine -> draw StateMachine
                D: at 1e-4, about 3.6 executions an hour may exceed their times ▾ -> choose instead of 1e-4
                D: Generate Orocos -> generate D
                D: Architecture -> /model.mal 210..211 A
                D: Graph -> draw Architecture
                D: Schedule -> draw Schedule
                D: What if… -> draw WhatIf
            "#]],
        );
    }

    #[test]
    fn an_architecture_has_its_chains() {
        let robot = "
codel look(out n: int): void  codel use(in n: int): void
shell S { output port seen: int }  shell T { input port goal: int }
core C(S) { var n: int = 0  update = { look(n); write(seen, n); } }
core E(T) { var n: int = 0  update = { read(goal, n); use(n); } }
component P(S, C)  component Q(T, E)
architecture A { instance a: P  instance b: Q  connection a.seen -> b.goal }
deployment D { architecture A  activity a { priority = 2 period = 10 }  activity b { priority = 1 period = 40 } }
deployment E { architecture A  activity a { priority = 2 period = 10 }  activity b { priority = background } }
//- /mauve.toml
assume.codel = \"1 ms\"
[chains.c]
from = \"a\"
to = \"b\"
latency = \"20 ms\"
";
        let Fixture { db, workspace, file, .. } = Fixture::new(robot);
        let lenses = code_lenses(&db, project_with(&db, workspace, file), file);
        let titles = lenses.iter().filter(|it| it.action == LensAction::Draw(LensDrawing::Chains));
        let titles: Vec<&str> = titles.map(|it| it.title.as_str()).collect();
        assert_eq!(titles, ["D: 2 chains: 2 have a latency, 1 late", "E: 2 chains: 0 have a latency"]);
    }

    #[test]
    fn the_file_of_a_codel_is_where_the_generator_puts_it() {
        let robot = "library parts { /* 🦀 é */ codel plan(): int }\ncodel drive(): int\n//- /mauve.toml\n";
        check(
            robot,
            expect![[r#"
                plan: plan.cpp -> open /generated/parts/src/codels/plan.cpp
            "#]],
        );
        check(
            &format!("{robot}generate.out = \"../cpp\""),
            expect![[r#"
                plan: plan.cpp -> open /cpp/parts/src/codels/plan.cpp
            "#]],
        );
    }

    #[test]
    fn a_deployment_that_is_not_known_claims_nothing() {
        check(
            "deployment D { architecture A activity a { priority = 1 period = 10 } activity b { priority = } }",
            expect![[r#"
                D: Level 1e-4 ▾ -> choose instead of 1e-4
                D: Generate Orocos -> generate D
            "#]],
        );
        check(
            "library l { deployment D { } } component",
            expect![[r#"
                D: Level 1e-4 ▾ -> choose instead of 1e-4
                D: Generate Orocos -> generate l.D
            "#]],
        );
    }
}
