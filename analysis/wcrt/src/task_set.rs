//! A deployment at one level as `timing` analyses it, made of a model or of an exported file.

use mauve_timing::task_set::{Other, TaskSet};
use mauve_timing::{Activity, ActivitySet, Demand, Level, Method};

use crate::psm::{Executed, psm_of};
use crate::reason::{Reason, Refusal, UnknownPriority};
use crate::report::{ActivityReport, Query};
use crate::served::{Served, served_in};
use crate::system::{ResolvedActivity, System};
use crate::table_set::TableSet;
use crate::timetable::incomplete_tables;
use mauve_hir::item_tree::Name;
use mauve_hir::{ModelDb, OtherWork, Project, platform_of};

pub(crate) struct Deployed<'db> {
    pub(crate) times: Option<Name>,
    pub(crate) set: ActivitySet,
    /// The reports without figures, by the index of the activity. Their reasons are why the activity itself is not analysed.
    pub(crate) reports: Vec<ActivityReport<'db>>,
    /// The names of the operations of the set.
    pub(crate) operations: Vec<Name>,
    pub(crate) not_analysed: Vec<Refusal<'db>>,
}

impl<'db> Deployed<'db> {
    pub(crate) fn of_model(
        db: &'db dyn ModelDb,
        tables: TableSet<'db>,
        system: &System<'db>,
        query: Query,
    ) -> Deployed<'db> {
        let psms = psms_of(db, tables, system, query.level);
        let served = served_in(db, tables, system, query.level, &|_| None);
        let set = activity_set(db, tables.project(db), system, &psms, &served, query.method);
        let activities = set.activities.iter().zip(&system.activities).zip(&psms).enumerate();
        let reports = activities.map(|(index, ((activity, resolved), psm))| ActivityReport {
            component_name: resolved.component_name.clone(),
            component: resolved.component,
            at: Some(resolved.at.clone()),
            unknown_priority: resolved.unknown_priority.clone(),
            reasons: refusals_of(resolved, *psm, &served, index, query.method).collect(),
            own: psm.and_then(|psm| psm.as_ref().ok()).map(|psm| psm.machine.greatest_cost()),
            assumed: psm.and_then(|psm| psm.as_ref().ok()).map_or_else(Vec::new, |psm| psm.assumed.clone()),
            ..ActivityReport::without_figures(activity)
        });
        let reports = reports.collect();
        Deployed {
            times: tables.section(db).clone(),
            reports,
            set,
            operations: served.connections.into_iter().map(|it| it.operation).collect(),
            not_analysed: system.not_analysed.clone(),
        }
    }

    /// Returns none where the file has no times at the level.
    pub(crate) fn of_file(file: &TaskSet, query: Query) -> Option<Deployed<'db>> {
        let column = file.column(query.level)?;
        let set = file.activities_at(column, query.method);
        let stated = |reason: &String| Refusal { reason: Reason::Stated(reason.clone()), at: None };
        let reports = set.activities.iter().zip(&file.activities).map(|(activity, written)| {
            let refusals = written.not_analysed.iter().filter(|it| it.holds(query.level, query.method));
            let machine = written.machine.as_ref().filter(|machine| machine.is_known(column));
            let assumed = machine.into_iter().flat_map(|machine| &machine.assumed);
            ActivityReport {
                component_name: written.component.as_str().into(),
                unknown_priority: written.doubt.as_deref().map(|it| UnknownPriority::Stated(it.into())),
                reasons: refusals.map(|it| stated(&it.reason)).collect(),
                own: machine.and_then(|machine| machine.state_machine(column)).map(|it| it.greatest_cost()),
                assumed: assumed.map(|it| (it.codel.clone(), it.time)).collect(),
                ..ActivityReport::without_figures(activity)
            }
        });
        Some(Deployed {
            times: file.times.as_deref().map(Into::into),
            reports: reports.collect(),
            set,
            operations: file.operations.iter().map(|called| called.operation.as_str().into()).collect(),
            not_analysed: file.not_analysed.iter().map(stated).collect(),
        })
    }
}

pub(crate) fn psms_of<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    system: &System<'db>,
    level: Level,
) -> Vec<Executed<'db, 'db>> {
    // If the tables are incomplete, every time may be longer.
    let timed = incomplete_tables(db, tables).is_none();
    let executed = |it: &ResolvedActivity<'db>| it.executed().filter(|_| timed);
    system.activities.iter().map(|it| Some(psm_of(db, tables, executed(it)?, level))).collect()
}

pub(crate) fn activity_set<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
    psms: &[Executed<'_, 'db>],
    served: &Served<'db>,
    method: Method,
) -> ActivitySet {
    let activities = system.activities.iter().zip(psms).enumerate();
    let activities = activities.map(|(index, (activity, &executed))| Activity {
        name: activity.instance.to_string(),
        priority: activity.priority,
        period: activity.period,
        deadline: activity.deadline,
        jitter: activity.jitter,
        offset: activity.phase(),
        cpus: activity.cpus,
        demand: match executed {
            Some(Ok(psm)) if refusals_of(activity, executed, served, index, method).next().is_none() => {
                Demand::Machine { machine: psm.machine.clone(), whole: psm.component_time }
            }
            _ => Demand::Unknown,
        },
    });
    let throttled = platform_of(db, project.workspace(db)).rt_throttling == Some(true);
    let others = others_of(db, project, system);
    ActivitySet { activities: activities.collect(), operations: served.operations.clone(), others, throttled }
}

/// Returns the real-time work that is not in the model. Without CPUs, it may run on all.
pub(crate) fn others_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
) -> Vec<Other> {
    let others = platform_of(db, project.workspace(db)).others.iter();
    let other = |it: &OtherWork| Other {
        name: it.name.clone(),
        cpus: it.cpus.unwrap_or(system.cpus),
        priority: it.priority,
        period: it.period,
        jitter: it.jitter,
        time: it.time,
    };
    others.map(other).collect()
}

fn refusals_of<'a, 'db>(
    activity: &'a ResolvedActivity<'db>,
    psm: Executed<'a, 'db>,
    served: &'a Served<'db>,
    index: usize,
    method: Method,
) -> impl Iterator<Item = Refusal<'db>> + use<'a, 'db> {
    let of_component = psm.and_then(|psm| psm.as_ref().err()).into_iter().flatten();
    let unusable = psm.filter(|_| method == Method::Classic).and_then(|psm| psm.as_ref().ok());
    let unusable = unusable.and_then(|psm| psm.unusable_component_time.clone());
    let unusable = unusable.map(|why| Refusal::new(Reason::ComponentTime(why), activity.at.clone()));
    let of_operations = served.refusals.get(&index).into_iter().flatten();
    activity.refusals.iter().chain(of_component).chain(of_operations).cloned().chain(unusable)
}
