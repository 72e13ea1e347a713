//! Exports models as task sets and state machines ([`mauve_timing::task_set`]), and reads them.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use mauve_timing::task_set::{
    Activity, Assumed, Called, Component, Edge, Machine, NotAnalysed, Other, Program, State, TaskSet,
};
use mauve_timing::{Level, Method, Task, Time};

use crate::psm::{Psm, PsmResult, psm_of};
use crate::reason::{Prose, Reason, Refusal, UnknownPriority};
use crate::report::ActivityReport;
use crate::served::{Served, served_in};
use crate::system::{Connected, ResolvedActivity, System, system_of};
use crate::table_set::{TableSet, tables_of};
use crate::task_set::{DeployedTasks, psms_of};
use crate::timetable::timetable_of;
use mauve_hir::{Decl, Edges, ModelDb, ProgramId, Project, config_of, platform_of};

/// Returns the task set of a deployment, at all levels of its tables; `prose` renders reasons.
pub fn task_set_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    prose: &Prose,
) -> TaskSet {
    let message = |reason: &Reason<'db>| one_line(&(prose.reason)(db, reason));
    let (system, tables) = (system_of(db, project, deployment), tables_of(db, project, deployment));
    let levels = levels_of(db, tables);
    let psms: Vec<Psms<'db>> = levels.iter().map(|&level| psms_of(db, tables, system, level)).collect();
    let served: Vec<Served<'db>> =
        levels.iter().map(|&level| served_in(db, tables, system, level, &|_| None)).collect();
    let activity = |(index, resolved): (usize, &ResolvedActivity<'db>)| {
        let of_operations = served.iter().map(|served| {
            let refusals = served.refusals.get(&index).into_iter().flatten();
            refusals.map(|refusal| message(&refusal.reason)).collect()
        });
        let of_operations = grouped(&levels, of_operations.collect(), false);
        let psms: Psms<'db> = psms.iter().map(|psms| psms.get(index).copied().flatten()).collect();
        let always = resolved.refusals.iter().map(|it| always(message(&it.reason)));
        Activity {
            instance: resolved.instance.to_string(),
            component: resolved.component_name.to_string(),
            affinity: resolved.cpus,
            priority: resolved.priority,
            period: resolved.period,
            deadline: resolved.deadline,
            jitter: resolved.jitter,
            offset: resolved.offset,
            not_analysed: always.chain(refusals_of(&levels, &psms, &message)).chain(of_operations).collect(),
            doubt: resolved.unknown_priority.as_ref().map(prose.unknown_priority),
            machine: machine_of(&psms),
        }
    };
    let workspace = project.workspace(db);
    let platform = platform_of(db, workspace);
    TaskSet {
        name: deployment.name(db).to_string(),
        times: section_of(db, tables),
        significance: config_of(db, workspace).level(),
        cpus: system.cpus,
        rt_throttling: platform.rt_throttling,
        not_analysed: system.not_analysed.iter().map(|it| message(&it.reason)).collect(),
        other: platform.others.iter().filter_map(|it| other_of(it, system.cpus)).collect(),
        operations: operations_of(system, &served),
        activities: system.activities.iter().enumerate().map(activity).collect(),
        levels,
    }
}

/// Returns other work as it is in files. Without CPUs, it may run on `all`.
fn other_of(it: &Task, all: u64) -> Option<Other> {
    Some(Other {
        name: it.name.to_string(),
        cpus: it.cpus.unwrap_or(all),
        priority: it.priority.real_time()?,
        period: it.period?,
        jitter: it.jitter,
        time: it.greatest_cost()?,
    })
}

/// Returns the operations of all levels. One that takes no time at a level is not among those of that level.
fn operations_of(system: &System<'_>, served: &[Served<'_>]) -> Vec<Called> {
    let mut found: Vec<Called> = Vec::new();
    // The number of each operation, by what identifies it; a connection may be there twice.
    let mut numbers: HashMap<(&Connected, Option<usize>, usize), usize> = HashMap::new();
    let instance =
        |index: usize| system.activities.get(index).map_or_else(String::new, |it| it.instance.to_string());
    for (column, served) in served.iter().enumerate() {
        let mut of_level: Vec<usize> = Vec::new();
        let mut seen: HashMap<(&Connected, Option<usize>), usize> = HashMap::new();
        for (operation, connected) in served.operations.iter().zip(&served.connections) {
            let during = operation.during.and_then(|during| of_level.get(during)).copied();
            let occurrence = seen.entry((connected, during)).or_default();
            let number = *numbers.entry((connected, during, *occurrence)).or_insert(found.len());
            *occurrence += 1;
            if number == found.len() {
                found.push(Called {
                    operation: connected.operation.to_string(),
                    provider: instance(operation.provider),
                    client: instance(operation.client),
                    sends: operation.sends,
                    during,
                    time: Vec::new(),
                });
            }
            of_level.push(number);
            if let Some(called) = found.get_mut(number) {
                called.time.resize(column, Time::ZERO);
                called.time.push(operation.time);
            }
        }
    }
    found.iter_mut().for_each(|called| called.time.resize(served.len(), Time::ZERO));
    found
}

/// Returns the state machine of a component, at all levels of these tables; `prose` renders reasons.
pub fn exported_component<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    prose: &Prose,
) -> Component {
    let message = |reason: &Reason<'db>| one_line(&(prose.reason)(db, reason));
    let levels = levels_of(db, tables);
    let incomplete = timetable_of(db, tables).incomplete.as_ref();
    let psm = |&level: &Level| incomplete.is_none().then(|| psm_of(db, tables, component, level));
    let psms: Psms<'db> = levels.iter().map(psm).collect();
    let incomplete = incomplete.map(|tables| always(message(&Reason::IncompleteTables(tables.clone()))));
    Component {
        name: component.qualified(db),
        times: section_of(db, tables),
        not_analysed: incomplete.into_iter().chain(refusals_of(&levels, &psms, &message)).collect(),
        machine: machine_of(&psms),
        levels,
    }
}

type Psms<'db> = Vec<Option<&'db PsmResult<'db>>>;

fn section_of<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>) -> Option<String> {
    tables.section(db).as_deref().map(one_line)
}

/// Returns the levels of tables; if no time depends on a level, that of `mauve.toml`, and not the one
/// that an editor shows.
fn levels_of<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>) -> Vec<Level> {
    match timetable_of(db, tables).levels.as_slice() {
        [] => vec![config_of(db, tables.project(db).workspace(db)).level()],
        levels => levels.to_vec(),
    }
}

/// Replaces line breaks, since reasons contain file names, which may contain any character.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn always(reason: String) -> NotAnalysed {
    NotAnalysed { reason, levels: None, classic_only: false }
}

fn refusals_of<'db>(
    levels: &[Level],
    psms: &Psms<'db>,
    message: &dyn Fn(&Reason<'db>) -> String,
) -> Vec<NotAnalysed> {
    let refused = |psm: &Option<&PsmResult<'db>>| -> Vec<String> {
        let Some(Err(refusals)) = psm else { return Vec::new() };
        refusals.iter().map(|refusal| message(&refusal.reason)).collect()
    };
    let component_time = |psm: &Option<&PsmResult<'db>>| -> Vec<String> {
        let Some(Ok(Psm { unusable_component_time: Some(why), .. })) = psm else { return Vec::new() };
        vec![message(&Reason::ComponentTime(why.clone()))]
    };
    let mut found = grouped(levels, psms.iter().map(refused).collect(), false);
    found.extend(grouped(levels, psms.iter().map(component_time).collect(), true));
    found
}

fn grouped(levels: &[Level], reasons: Vec<Vec<String>>, classic_only: bool) -> Vec<NotAnalysed> {
    let mut groups: Vec<(Vec<String>, Vec<Level>)> = Vec::new();
    for (reasons, level) in reasons.into_iter().zip(levels).filter(|(reasons, _)| !reasons.is_empty()) {
        match groups.iter_mut().find(|(known, _)| *known == reasons) {
            Some((_, group)) => group.push(*level),
            None => groups.push((reasons, vec![*level])),
        }
    }
    let of_group = |(reasons, group): (Vec<String>, Vec<Level>)| {
        let group = (group.len() < levels.len()).then_some(group);
        reasons.into_iter().map(move |reason| NotAnalysed { reason, levels: group.clone(), classic_only })
    };
    groups.into_iter().flat_map(of_group).collect()
}

/// Returns the machine with the times of each level. States and edges are the same at all levels.
fn machine_of(psms: &Psms<'_>) -> Option<Machine> {
    let at_levels: Vec<Option<&Psm<'_>>> = psms.iter().map(|psm| psm.as_ref()?.as_ref().ok()).collect();
    let shape = at_levels.iter().flatten().next()?;
    let times = |time: &dyn Fn(&Psm<'_>) -> Option<Time>| -> Vec<Option<Time>> {
        at_levels.iter().map(|psm| psm.and_then(time)).collect()
    };
    let key = |index: &usize| shape.programs.get(*index).map(|(program, _)| program.to_string());
    let executed: BTreeSet<usize> = shape.edges.executed().collect();
    let programs = executed.iter().filter_map(|index| {
        let time = times(&|psm| psm.programs.get(*index).map(|(_, time)| *time));
        Some(Program { program: key(index)?, time })
    });
    let edges = shape.machine.edges().iter().zip(&shape.edges.all).enumerate();
    let edges = edges.map(|(index, (edge, described))| Edge {
        source: shape.state(edge.source as usize).to_owned(),
        target: shape.state(edge.target as usize).to_owned(),
        transition: described.transition.as_ref().map(ToString::to_string),
        first: described.first,
        then: described.then.iter().filter_map(key).collect(),
        cost: times(&|psm| psm.machine.edges().get(index).map(|edge| edge.cost)),
    });
    let assumed = shape.assumed.iter().map(|(codel, time)| Assumed { codel: codel.clone(), time: *time });
    let states = shape.states.iter().zip(&shape.edges.first).map(|(state, first)| State {
        state: state.to_string(),
        first: first.iter().filter_map(key).collect(),
    });
    Some(Machine {
        states: states.collect(),
        initial: shape.state(shape.initial).to_owned(),
        overhead: times(&|psm| Some(psm.overhead)),
        component_time: times(&|psm| psm.component_time),
        assumed: assumed.collect(),
        programs: programs.collect(),
        edges: edges.collect(),
    })
}

/// Returns the machine at the level with this index, as for a model; `None` if it has no times there.
pub fn psm_at<'db>(machine: &Machine, column: usize) -> Option<Psm<'db>> {
    let number: HashMap<&str, usize> =
        machine.programs.iter().map(|it| it.program.as_str()).zip(0..).collect();
    let indices = |programs: &[String]| -> Vec<usize> {
        programs.iter().filter_map(|it| number.get(it.as_str()).copied()).collect()
    };
    let state_machine = machine.state_machine(column)?;
    let edge = |(edge, timed): (&Edge, &mauve_timing::Edge)| mauve_hir::Edge {
        source: timed.source as usize,
        target: timed.target as usize,
        transition: edge.transition.as_deref().map(Into::into),
        first: edge.first,
        then: indices(&edge.then),
    };
    let time = |times: &[Option<Time>]| times.get(column).copied().flatten();
    Some(Psm {
        states: machine.states.iter().map(|it| it.state.as_str().into()).collect(),
        initial: machine.states.iter().position(|it| it.state == machine.initial)?,
        edges: Arc::new(Edges {
            all: machine.edges.iter().zip(state_machine.edges()).map(edge).collect(),
            first: machine.states.iter().map(|it| indices(&it.first)).collect(),
        }),
        machine: state_machine,
        programs: machine
            .programs
            .iter()
            .map(|it| (ProgramId::from(it.program.as_str()), time(&it.time).unwrap_or_default()))
            .collect(),
        operations: Vec::new(),
        overhead: time(&machine.overhead)?,
        component_time: time(&machine.component_time),
        unusable_component_time: None,
        assumed: machine.assumed.iter().map(|it| (it.codel.clone(), it.time)).collect(),
    })
}

impl<'db> DeployedTasks<'db> {
    /// Returns the deployment of an exported task set; none where it has no times at the level.
    pub fn of_file(file: &TaskSet, level: Level, method: Method) -> Option<Self> {
        let column = file.column(level)?;
        let tasks = file.tasks_at(level, method)?;
        let psm = |it: &Activity| psm_at(it.machine.as_ref()?, column);
        let psms: Vec<Option<Psm<'db>>> = file.activities.iter().map(psm).collect();
        let stated = |reason: &String| Refusal { reason: Reason::Stated(reason.clone()), at: None };
        let activities = tasks.activities().iter().zip(&file.activities).zip(&psms);
        let reports = activities.map(|((task, written), psm)| {
            let refusals = written.not_analysed.iter().filter(|it| it.holds(level, method));
            ActivityReport {
                task: task.clone(),
                instance: written.instance.as_str().into(),
                component_name: written.component.as_str().into(),
                unknown_priority: written.doubt.as_deref().map(|it| UnknownPriority::Stated(it.into())),
                reasons: refusals.map(|it| stated(&it.reason)).collect(),
                own: psm.as_ref().map(|psm| psm.machine.greatest_cost()),
                assumed: psm.as_ref().map_or_else(Vec::new, |psm| psm.assumed.clone()),
                ..ActivityReport::default()
            }
        });
        Some(DeployedTasks {
            reports: reports.collect(),
            psms: psms.into_iter().map(|psm| psm.map(Cow::Owned)).collect(),
            operations: file.operations.iter().map(|called| called.operation.as_str().into()).collect(),
            times: file.times.as_deref().map(Into::into),
            not_analysed: file.not_analysed.iter().map(stated).collect(),
            tasks,
        })
    }
}
