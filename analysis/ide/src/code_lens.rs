//! Code lenses above declarations: how many deadlines of a deployment are met, the other levels, the command that generates
//! its Orocos packages; the instances of a component; the implementation of a codel.
//!
//! [`code_lenses`] returns their positions at once; [`resolve_code_lens`] computes a title when the editor shows the lens.

use std::collections::HashMap;
use std::path::PathBuf;

use mauve_diagnostics::times_of;
use mauve_hir::item_tree::Kind;
use mauve_hir::{
    Decl, File, Location, ModelDb, Project, Workspace, architecture, config_of, declarations, is_model,
    names_of, resolve_type, source_map,
};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::Level;
use mauve_wcrt::{Deadlines, Query, response_times};

use crate::implementation::codel_file;
use crate::levels::known_levels;
use crate::project::{each_once, in_projects, projects_with};

/// A code lens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CodeLens {
    /// The name of the declaration below it.
    pub range: TextRange,
    /// Its kind.
    pub kind: LensKind,
}

/// The kind of a lens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LensKind {
    /// The deadlines of a deployment.
    Deadlines,
    /// A deployment at another level.
    AtLevel(Level),
    /// The Orocos packages of a deployment.
    Generate,
    /// The instances of a component.
    Instances,
    /// The file of a codel.
    Implementation,
}

/// A resolved lens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lens {
    /// Its title.
    pub title: String,
    /// The action of a click, if it has one.
    pub action: Option<LensAction>,
}

/// The action of a click on a lens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LensAction {
    /// Sets the current level.
    SetSignificance(Level),
    /// Generates the packages of this deployment, given by its qualified name.
    Generate(String),
    /// Shows these locations.
    Show(Vec<(File, TextRange)>),
    /// Opens these files, if they exist.
    Open(Vec<PathBuf>),
}

/// Returns the lenses of a file, in text order.
///
/// ```
/// use mauve_hir::{Database, Workspace};
///
/// let model = "component P(S, C)\narchitecture A { instance pilot: P }";
/// let db = Database::default();
/// let workspace = Workspace::of_texts(&db, "/".into(), [("/robot.mal".into(), model.to_owned())]);
/// let file = workspace.file(&db, "/robot.mal".as_ref()).unwrap();
/// let lenses = mauve_ide::code_lenses(&db, &[workspace], file);
/// let lens = mauve_ide::resolve_code_lens(&db, &[workspace], file, lenses[0]).unwrap();
/// assert_eq!(lens.title, "used in 1 instance");
/// ```
pub fn code_lenses(db: &dyn ModelDb, workspaces: &[Workspace], file: File) -> Vec<CodeLens> {
    if !is_model(file.path(db)) {
        return Vec::new();
    }
    let mut others: Option<Vec<Level>> = None;
    let mut found = Vec::new();
    for &decl in declarations(db, file).all.iter().filter(|decl| !decl.name(db).is_empty()) {
        let range = Location::name_of(decl).range(db);
        let mut add = |kind| found.push(CodeLens { range, kind });
        match decl.kind(db) {
            Kind::Deployment => {
                add(LensKind::Deadlines);
                let others = others.get_or_insert_with(|| other_levels(db, workspaces, file));
                others.iter().for_each(|&level| add(LensKind::AtLevel(level)));
                add(LensKind::Generate);
            }
            Kind::Component => add(LensKind::Instances),
            Kind::Codel => add(LensKind::Implementation),
            Kind::Use | Kind::Shell | Kind::Core | Kind::Architecture => {}
        }
    }
    found
}

/// Returns the title and the action of a lens, or `None` if it has nothing to show.
pub fn resolve_code_lens(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    lens: CodeLens,
) -> Option<Lens> {
    // The declarations are in text order.
    let index = source_map(db, file).declarations.partition_point(|map| map.range.end() < lens.range.end());
    let decl = *declarations(db, file).all.get(index)?;
    match lens.kind {
        LensKind::Deadlines => deadlines(db, workspaces, decl),
        LensKind::AtLevel(level) => {
            Some(Lens { title: format!("at {level}"), action: Some(LensAction::SetSignificance(level)) })
        }
        LensKind::Generate => {
            let action = Some(LensAction::Generate(decl.qualified(db)));
            Some(Lens { title: "Generate Orocos".to_owned(), action })
        }
        LensKind::Instances => instances(db, workspaces, decl),
        LensKind::Implementation => {
            let projects = projects_with(db, workspaces, file);
            let mut files: Vec<PathBuf> =
                projects.into_iter().filter_map(|project| codel_file(db, project, decl)).collect();
            files.dedup();
            let title = files.first()?.file_name()?.display().to_string();
            Some(Lens { title, action: Some(LensAction::Open(files)) })
        }
    }
}

/// Returns the levels next to the current one, the less probable last.
fn other_levels(db: &dyn ModelDb, workspaces: &[Workspace], file: File) -> Vec<Level> {
    let projects = projects_with(db, workspaces, file);
    let Some(&first) = projects.first() else { return Vec::new() };
    let shown = Query::shown(db, first).level;
    // In descending order of probability.
    let levels = known_levels(db, workspaces);
    let before = levels.iter().rev().find(|level| **level > shown);
    let after = levels.iter().find(|level| **level < shown);
    before.into_iter().chain(after).copied().collect()
}

/// Returns a title such as `8 of 9 activities meet their deadlines at 1e-4`.
fn deadlines(db: &dyn ModelDb, workspaces: &[Workspace], of: Decl<'_>) -> Option<Lens> {
    let mut titles: Vec<(String, Vec<Project<'_>>)> = Vec::new();
    let projects = projects_with(db, workspaces, of.file(db));
    for &project in &projects {
        let query = Query::shown(db, project);
        let report = response_times(db, project, of, query);
        let Deadlines { met, unknown, all } = report.deadlines();
        if all == 0 {
            continue;
        }
        let mut title = match all {
            1 => format!("{met} of 1 activity meets its deadline at {}", query.level),
            _ => format!("{met} of {all} activities meet their deadlines at {}", query.level),
        };
        title += &times_of(report.times.as_deref());
        if unknown > 0 {
            title += &format!(", {unknown} not analysed");
        }
        if report.activities.iter().any(|it| !it.assumed.is_empty()) {
            title += ", times assumed";
        }
        if met > 0 && config_of(db, project.workspace(db)).rt_throttling.is_none() {
            title += ", assumes real-time throttling off";
        }
        if report.assumes_clocks() {
            title += ", assumes synchronised clocks";
        }
        match titles.iter_mut().find(|(known, _)| *known == title) {
            Some((_, having)) => having.push(project),
            None => titles.push((title, vec![project])),
        }
    }
    let differ = titles.len() > 1;
    let titles = titles.into_iter().map(|(title, having)| {
        if differ { format!("{title} ({})", in_projects(db, &having)) } else { title }
    });
    let titles: Vec<String> = titles.collect();
    (!titles.is_empty()).then(|| Lens { title: titles.join(" · "), action: None })
}

/// Returns a title such as `used in 2 instances`; each location counts once.
fn instances(db: &dyn ModelDb, workspaces: &[Workspace], of: Decl<'_>) -> Option<Lens> {
    let projects = projects_with(db, workspaces, of.file(db)).into_iter();
    let places = projects.filter_map(|project| instances_by_component(db, project).get(&of)).flatten();
    let places = each_once(places.map(|place| (place.file(db), place.range(db))));
    let title = match places.len() {
        0 => "not used in any instance".to_owned(),
        1 => "used in 1 instance".to_owned(),
        count => format!("used in {count} instances"),
    };
    Some(Lens { title, action: (!places.is_empty()).then_some(LensAction::Show(places)) })
}

#[salsa::tracked(returns(ref))]
fn instances_by_component<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
) -> HashMap<Decl<'db>, Vec<Location<'db>>> {
    let names = names_of(db, project);
    let mut found: HashMap<Decl<'db>, Vec<Location<'db>>> = HashMap::new();
    for &of in &names.all {
        for instance in architecture(db, of).into_iter().flat_map(|data| &data.instances) {
            let component = resolve_type(db, project, of, Kind::Component, instance.component.as_ref());
            if let Ok(component) = component {
                found.entry(component).or_default().push(Location::Source(of, instance.name.id));
            }
        }
    }
    found
}

/// Returns the lens of a kind above the name that begins at `offset`.
pub fn code_lens_at(
    db: &dyn ModelDb,
    workspaces: &[Workspace],
    file: File,
    offset: TextSize,
    is_it: impl Fn(LensKind) -> bool,
) -> Option<CodeLens> {
    let all = code_lenses(db, workspaces, file);
    all.into_iter().find(|lens| lens.range.start() == offset && is_it(lens.kind))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Fixture;
    use expect_test::{Expect, expect};

    fn check(fixture: &str, expected: Expect) {
        let Fixture { db, workspace, file, .. } = Fixture::new(fixture);
        let mut shown = String::new();
        for lens in code_lenses(&db, &[workspace], file) {
            let Some(Lens { title, action }) = resolve_code_lens(&db, &[workspace], file, lens) else {
                continue;
            };
            let action = match action {
                None => String::new(),
                Some(LensAction::SetSignificance(level)) => format!(" -> set {level}"),
                Some(LensAction::Generate(deployment)) => format!(" -> generate {deployment}"),
                Some(LensAction::Open(paths)) => {
                    paths.iter().map(|path| format!(" -> open {}", path.display())).collect()
                }
                Some(LensAction::Show(places)) => {
                    let place = |(file, range): &(File, TextRange)| {
                        format!(" -> {} {:?} {}", file.path(&db).display(), range, &file.text(&db)[*range])
                    };
                    places.iter().map(place).collect()
                }
            };
            shown += &format!("{}: {title}{action}\n", &file.text(&db)[lens.range]);
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
  activity a { priority = 1 period = 100 }
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
            Q: used in 1 instance -> /model.mal 238..239 b
            Unused: not used in any instance
            D: 1 of 2 activities meet their deadlines at 1e-4, assumes real-time throttling off
            D: at 1e-3 -> set 1e-3
            D: at 1e-5 -> set 1e-5
            D: Generate Orocos -> generate D
        "#]],
        );
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
                D: 0 of 2 activities meet their deadlines at 1e-4, 2 not analysed
                D: Generate Orocos -> generate D
            "#]],
        );
        check(
            "library l { deployment D { } } component",
            expect![[r#"
                D: Generate Orocos -> generate l.D
            "#]],
        );
    }
}
