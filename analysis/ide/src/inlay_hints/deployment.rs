//! Hints of a deployment: the response time and the deadline of each activity, how many deadlines are met, and the utilisation
//! of each CPU.

use std::collections::HashMap;

use mauve_hir::item_tree::Kind;
use mauve_hir::{Decl, File, Location, ModelDb, Project, config_file, names_of, node_around};
use mauve_syntax::ast::{self, AstNode as _};
use mauve_syntax::{TextRange, TextSize};
use mauve_timing::{CpuLoad, CpuSet, Status};
use mauve_wcrt::{
    ActivityReport, Deadlines, Footing, Query, Report, ResolvedActivity, response_times, system_of,
};

use super::earlier::{EarlierFigures, FigureOwner};
use super::figures::with_earlier;
use super::label::Texts;
use super::{HintOf, HintOptions, HintSubject, InlayHint, ShownHint, beside, end_of_line};
use crate::cpu_budget::cpu_status;
use crate::threads::{ThreadAt, threads_with_activities};
use mauve_diagnostics::activity_figure::figure;
use mauve_diagnostics::figure::{HintStatus, MOST_CHARACTERS};

/// The maximum number of CPUs that have hints: those with the greatest utilisation.
const MOST_CPUS: usize = 4;

/// The room for the older figure of one of the hints on the line of a deployment.
const SHARED_ROOM: usize = 24;

pub(super) fn of_deployment<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    options: HintOptions,
    found: &mut Vec<HintOf>,
) {
    if !options.response_times && !options.loads {
        return;
    }
    let name = Location::name_of(deployment);
    let Some(node) = node_around(db, deployment.file(db), name.range(db)) else { return };
    let query = Query::shown(db, project, deployment);
    let report = response_times(db, project, deployment, query);
    let text = deployment.file(db).text(db);
    let activities = &system_of(db, project, deployment).activities;
    let nodes = node.children().filter_map(ast::Activity::cast);
    let named = |it: ast::Activity| Some((it.name_ref()?.syntax().text_range().start(), it));
    let nodes: HashMap<TextSize, ast::Activity> = nodes.filter_map(named).collect();
    let offset_of = |resolved: &ResolvedActivity<'_>| {
        // A duplicate, or an instance without an activity, has a diagnostic instead; a gateway is not in this file.
        let at = resolved.at.range_in(db, deployment.file(db))?;
        match nodes.get(&at.start()) {
            Some(activity) => beside(text, activity.syntax()),
            // An instance in a list.
            None => (resolved.at != name).then_some(at.end()),
        }
    };
    let offsets: Vec<Option<TextSize>> = activities.iter().map(offset_of).collect();
    let figures = report.activities.iter().zip(report.footings());
    let shown = figures.map(|(activity, footing)| ShownHint::of(db, activity, footing, options.tight_slack));
    let shown: Vec<ShownHint> = shown.collect();
    let is_real_time = |it: &ActivityReport<'_>| it.verdict != Status::Background;
    if let Some(offset) = beside(text, &node)
        && report.activities.iter().any(is_real_time)
    {
        let mut add = |subject: HintSubject, shown: ShownHint, load: Option<u32>| {
            let (figure, explained_at) = (shown.figure(), Some(name.range(db).start()));
            let hint = InlayHint::new(offset, shown.texts, MOST_CHARACTERS, shown.status, explained_at);
            let hint = InlayHint { load, ..hint };
            found.push(HintOf { hint, subject: Some(subject), figure, room: SHARED_ROOM });
        };
        if options.response_times {
            add(HintSubject::Deadlines, of_all(report, &shown, query), None);
        }
        for (cpus, shown, load) in loads(report, options.tight_slack).filter(|_| options.loads) {
            add(HintSubject::Cpus(cpus), shown, Some(load));
        }
    }
    if !options.response_times {
        return;
    }
    for ((resolved, shown), offset) in activities.iter().zip(shown).zip(offsets) {
        let Some(offset) = offset else { continue };
        let subject = HintSubject::Activity(resolved.instance.clone());
        found.push(shown.at(text, offset, subject, resolved.at.range(db).start()));
    }
}

/// Returns the hints of activities in other files than models: of the gateways that a `mauve.toml` declares, and of threads in a file
/// of `[platform] threads`.
pub(super) fn in_other_file(
    db: &dyn ModelDb,
    projects: &[Project<'_>],
    file: File,
    options: HintOptions,
    earlier: &EarlierFigures,
) -> Vec<HintOf> {
    let mut found = Vec::new();
    let text = file.text(db);
    let hint = |name: &str, shown: ShownHint, at: TextRange| {
        let subject = HintSubject::Activity(name.into());
        shown.at(text, end_of_line(text, at.end()), subject, at.start())
    };
    for &project in projects.iter().filter(|_| options.response_times) {
        let threads = threads_with_activities(db, project, file);
        let of_deployments: Vec<&[ThreadAt<'_>]> =
            threads.chunk_by(|one, other| one.deployment == other.deployment).collect();
        for of in &of_deployments {
            let Some(deployment) = of.first().map(|it| it.deployment) else { continue };
            let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
            let last = earlier.of(&FigureOwner::of(db, project, deployment));
            let figures: Vec<_> = report.activities.iter().zip(report.footings()).collect();
            for (id, index) in of.iter().flat_map(|it| it.activities.iter().map(|index| (it.id, *index))) {
                let Some((activity, footing)) = figures.get(index) else { continue };
                let shown = ShownHint::of(db, activity, *footing, options.tight_slack);
                let mut shown = with_earlier(hint(&activity.instance, shown, id), last);
                if of_deployments.len() > 1 {
                    let name = format!("{}.{}", deployment.name(db), activity.instance);
                    let subject = HintSubject::Activity(name.into());
                    shown.iter_mut().for_each(|it| it.subject = Some(subject.clone()));
                }
                found.extend(shown);
            }
        }
    }
    let has_it = |project: &&Project<'_>| config_file(db, project.workspace(db)) == Some(file);
    for &project in projects.iter().filter(has_it).filter(|_| options.response_times) {
        for deployment in names_of(db, project).of_kind(db, Kind::Deployment) {
            let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
            for (activity, footing) in report.activities.iter().zip(report.footings()) {
                let Some(at) = activity.at.as_ref().and_then(|at| at.range_in(db, file)) else { continue };
                // With hosts, `D@left` and `D@right`.
                let name = activity.instance.replacen("ros2", deployment.name(db), 1);
                found.push(hint(&name, ShownHint::of(db, activity, footing, options.tight_slack), at));
            }
        }
    }
    found
}

impl ShownHint {
    /// What the hint of an activity shows: its response time and its deadline, or why there is no response time.
    fn of<'db>(
        db: &'db dyn ModelDb,
        activity: &ActivityReport<'db>,
        footing: Footing,
        tight_slack: u32,
    ) -> ShownHint {
        let forms = figure(db, activity, footing, tight_slack);
        let missing = (activity.verdict != Status::NotAnalysed).then_some(0);
        ShownHint { texts: Texts::of_forms(&forms), status: forms.status, missing }
    }
}

/// Returns how many deadlines of a deployment are met.
fn of_all(report: &Report<'_>, activities: &[ShownHint], query: Query) -> ShownHint {
    let Deadlines { met, unknown, all } = report.deadlines();
    let figure = format!("{met} of {all} met");
    let texts = match unknown {
        0 => Texts::of([format!("{figure} at {}", query.level), figure.clone(), format!("{met}/{all}")]),
        _ => Texts::of([
            format!("{figure}, {unknown} not analysed"),
            format!("{figure}, {unknown} unknown"),
            format!("{met}/{all}"),
        ]),
    };
    let worst = activities.iter().map(|it| it.status).min_by_key(|it| it.rank());
    ShownHint { texts, status: worst.unwrap_or(HintStatus::Met), missing: Some(unknown) }
}

/// Returns the greatest utilisations, with the CPUs, in the order of the CPUs.
fn loads(report: &Report<'_>, tight_slack: u32) -> impl Iterator<Item = (CpuSet, ShownHint, u32)> {
    let unknown = report.deadlines().unknown;
    let percent = |cpu: &CpuLoad| cpu.utilisation.as_f64() * 100.0 / f64::from(cpu.cpus.len().max(1));
    let mut greatest: Vec<&CpuLoad> = report.cpus.iter().collect();
    greatest.sort_by(|one, other| percent(other).total_cmp(&percent(one)));
    greatest.truncate(MOST_CPUS);
    greatest.sort_by_key(|cpu| (cpu.cpus.len(), cpu.cpus));
    greatest.into_iter().map(move |cpu| {
        let percent = percent(cpu);
        // Rounded up: the colour is that of the number.
        let load = percent.ceil() as u32;
        let names = report.hosts.names(cpu.cpus);
        let names = if cpu.cpus.len() > 1 && names.chars().count() > 12 {
            format!("{} CPUs", cpu.cpus.len())
        } else {
            names
        };
        let at_least = if cpu.complete { "" } else { "≥ " };
        let text = format!("{names} {at_least}{percent:.1} %");
        let status = cpu_status(cpu, tight_slack).1;
        let words = |before: &str, what: &str| {
            Texts::of([
                format!("{before}{names} {what} ({at_least}{percent:.1} %)"),
                format!("{before}{text}"),
            ])
        };
        let texts = match status {
            HintStatus::Missed => words("✗ ", "overloaded"),
            HintStatus::Tight => words("", "nearly full"),
            _ => Texts::of([text]),
        };
        let missing = Some(if cpu.complete { 0 } else { unknown });
        (cpu.cpus, ShownHint { texts, status, missing }, load)
    })
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use super::*;
    use crate::fixture::{Fixture, project_of};
    use crate::inlay_hints::{EarlierFigures, inlay_hints, table_hints};

    /// The offset of the gateway in `mauve.toml` is within a letter of two bytes here, for one of two comments above it.
    const ROBOT: &str = "//- /robot.mal
use std_msgs
/* éééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééééé */ codel say(): String
shell S { output port state: String }
core C(S) { update = { write(state, say()); } }
component Driver(S, C)
architecture A { instance driver: Driver }
deployment D {
  architecture A
  activity driver { priority = 1  period = 100  cpus = [1] }
}
//- /mauve.toml
";

    /// Returns the hints of the model and those of `mauve.toml`, each behind its line.
    fn shown(more: &str, config: &str) -> (String, String) {
        let fixture =
            Fixture::new(&ROBOT.replace("//- /mauve.toml\n", &format!("{more}//- /mauve.toml\n{config}")));
        let (db, options) = (&fixture.db, HintOptions::default());
        let shown = |path: &str| {
            let file = fixture.workspace.file(db, path.as_ref()).unwrap();
            let (text, project) = (file.text(db), project_of(db, fixture.workspace, file));
            let all = TextRange::up_to(TextSize::of(&**text));
            let mut hints = inlay_hints(db, project, file, all, options, &EarlierFigures::default());
            hints.extend(table_hints(db, &[project], file, all, options, &EarlierFigures::default(), None).0);
            let shown = hints.iter().map(|hint| {
                let line = text[..usize::from(hint.offset)].lines().last().unwrap().trim();
                format!("{line} ⟨{}⟩\n", hint.label)
            });
            shown.collect()
        };
        (shown("/robot.mal"), shown("/mauve.toml"))
    }

    const GATEWAY: &str = "platform.rt_throttling = false\nassume.codel = \"1 ms\"\n[ros2]\n\
                           gateway = { priority = 20, period = \"5 ms\", cpus = [2] }\n";

    #[test]
    fn the_hint_of_a_gateway_is_in_its_file() {
        let expected = expect![[r#"
            core C(S) { update = { write(state, say()); } } ⟨1 ms · assumed⟩
            deployment D { ⟨2 of 2 met at 1e-4⟩
            deployment D { ⟨CPU 1 1.0 %⟩
            deployment D { ⟨CPU 2 20.0 %⟩
            activity driver { priority = 1  period = 100  cpus = [1] } ⟨✓ 1 / 100 ms · assumed⟩
        "#]];
        for comment in ["# é\n", "# éééééééééééééééééééééééééé\n"] {
            let (in_model, in_config) = shown("", &format!("{comment}{GATEWAY}"));
            expected.assert_eq(&in_model);
            assert_eq!(
                in_config,
                "gateway = { priority = 20, period = \"5 ms\", cpus = [2] } ⟨✓ 1 / 5 ms · assumed⟩\n"
            );
        }
    }

    #[test]
    fn the_gateways_of_two_deployments_have_their_names() {
        let sea = "deployment Sea { architecture A\n activity driver { priority = 1  period = 100  cpus = [2] }\n}\n";
        expect![[r#"
            gateway = { priority = 20, period = "5 ms", cpus = [2] } ⟨D: ✓ 1 / 5 ms · assumed⟩
            gateway = { priority = 20, period = "5 ms", cpus = [2] } ⟨Sea: ✓ 1 / 5 ms · assumed⟩
        "#]]
        .assert_eq(&shown(sea, GATEWAY).1);
    }
}
