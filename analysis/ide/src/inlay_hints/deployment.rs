//! Hints of a deployment: the response time and the deadline of each activity, how many deadlines are met, and the utilisation
//! of each CPU.

use std::collections::HashMap;

use mauve_hir::{Decl, Location, ModelDb, Project, node_around};
use mauve_syntax::TextSize;
use mauve_syntax::ast::{self, AstNode as _};
use mauve_timing::{CpuLoad, CpuSet, Status};
use mauve_wcrt::{ActivityReport, Deadlines, Query, Report, ResolvedActivity, response_times, system_of};

use super::label::Texts;
use super::{HintOf, HintOptions, HintSubject, InlayHint, ShownHint, beside};
use crate::cpu_budget::cpu_status;
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
    let shown = activity_hints(db, project, deployment, options.tight_slack);
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
            add(HintSubject::Deadlines, of_all(report, shown, query), None);
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
        found.push(shown.clone().at(text, offset, subject, resolved.at.range(db).start()));
    }
}

/// Returns what the hints of the activities of a deployment show, wherever they are: the response time and the deadline, or why there is
/// no response time.
#[salsa::tracked(returns(ref))]
pub(super) fn activity_hints<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    tight_slack: u32,
) -> Box<[ShownHint]> {
    let report = response_times(db, project, deployment, Query::shown(db, project, deployment));
    let figures = report.activities.iter().zip(report.footings()).map(|(activity, footing)| {
        let forms = figure(db, activity, footing, tight_slack);
        let missing = (activity.verdict != Status::NotAnalysed).then_some(0);
        ShownHint { texts: Texts::of_forms(&forms), status: forms.status, missing }
    });
    figures.collect()
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
