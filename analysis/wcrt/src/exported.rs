//! Exports models as task sets for files ([`mauve_timing::task_set`]), and reads them.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use mauve_timing::task_set::{
    EdgeEntry, LockEntry, LockUserEntry, NotAnalysed, Number, Numbers, OperationEntry, TaskEntry, TaskSet,
    TaskSetError, TriggerEntry, WriterEntry,
};
use mauve_timing::{Demand, Level, Lock, Method, Needs, Order, Priority, Task, TaskTrigger, Time, Unit};

use crate::locks::{LocksOfDeployment, locks_of};
use crate::psm::{Psm, PsmResult, psm_of};
use crate::reason::{ActivityField, Prose, Reason, Refusal};
use crate::report::ActivityReport;
use crate::served::{Served, served_in};
use crate::system::{Connected, ResolvedActivity, System, others_of, system_of};
use crate::table_set::{TableSet, tables_of};
use crate::task_set::{DeployedTasks, psms_of, triggers_of};
use crate::threads::is_throttled;
use crate::timetable::{levels_of, timetable_of};
use mauve_hir::{Decl, Edges, ModelDb, Project, config_of};

/// Returns the task set of a deployment, at all levels of its tables; `prose` renders reasons.
pub fn task_set_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    prose: Prose,
) -> TaskSet {
    let message = |reason: &Reason<'db>| one_line(&prose(db, reason));
    let (system, tables) = (system_of(db, project, deployment), tables_of(db, project, deployment));
    let (levels, set) = set_of(db, tables, levels_of(db, project, deployment));
    let psms: Vec<Psms<'db>> = levels.iter().map(|&level| psms_of(db, system, level)).collect();
    let served: Vec<Served<'db>> =
        levels.iter().map(|&level| served_in(db, project, system, level, &|_| None)).collect();
    let locks: Vec<LocksOfDeployment<'db>> =
        levels.iter().map(|&level| locks_of(db, project, system, level, &|_| None)).collect();
    let task = |(index, resolved): (usize, &ResolvedActivity<'db>)| {
        let of_operations = served.iter().zip(&locks).map(|(served, locks)| {
            let of_index = [served.refusals.get(&index), locks.refusals.get(&index)];
            let refusals = of_index.into_iter().flatten().flatten();
            refusals.map(|refusal| message(&refusal.reason)).collect()
        });
        let of_operations = grouped(&levels, of_operations.collect(), false);
        let psms: Psms<'db> = psms.iter().map(|psms| psms.get(index).copied().flatten()).collect();
        let always = resolved.refusals.iter().map(|it| always(message(&it.reason)));
        TaskEntry {
            component: resolved.component_name.to_string(),
            deadline: resolved.deadline.map(Number::from),
            thread: resolved.thread.and(resolved.thread_name.as_ref()).map(ToString::to_string),
            order: Some(resolved.order).filter(|order| *order != Order::List),
            preemptive: resolved.is_not_preempted.then_some(false),
            wake_up: wake_up(&psms).filter(|_| resolved.is_not_preempted),
            offset: resolved.offset.map(Number::from),
            clock: Some(resolved.clock).filter(|clock| *clock > 0).map(|clock| Number::Whole(clock.into())),
            not_analysed: always.chain(refusals_of(&levels, &psms, &message)).chain(of_operations).collect(),
            ..scheduled(&resolved.task, executed(&psms))
        }
    };
    let other = |it: &Task| {
        let time = Numbers::of_times(&[it.greatest_cost()]);
        scheduled(it, TaskEntry { time, ..TaskEntry::default() })
    };
    let workspace = project.workspace(db);
    TaskSet {
        name: Some(deployment.name(db).to_string()),
        significance: Some(config_of(db, workspace).level()),
        rt_throttling: is_throttled(db, workspace),
        not_analysed: system.not_analysed.iter().map(|it| message(&it.reason)).collect(),
        task: system.activities.iter().enumerate().map(task).collect(),
        other: others_of(db, project.workspace(db), system.cpus).iter().map(other).collect(),
        operation: operations_of(system, &served),
        lock: exported_locks(system, &locks),
        trigger: triggers_of(db, project, system)
            .iter()
            .filter_map(|it| exported_trigger(system, it))
            .collect(),
        ..set
    }
}

/// Enters when and where a task runs.
fn scheduled(task: &Task, entry: TaskEntry) -> TaskEntry {
    TaskEntry {
        name: task.name.to_string(),
        period: task.period.map(Number::from),
        jitter: Some(task.jitter).filter(|jitter| *jitter > Time::ZERO).map(Number::from),
        sporadic: task.is_sporadic,
        burst: Some(task.burst()).filter(|burst| *burst > 1).map(Number::Whole),
        priority: match task.priority {
            Priority::RealTime(priority) => Some(Number::Whole(priority.into())),
            Priority::Background => Some(Number::Text("background".to_owned())),
            Priority::Unknown => None,
        },
        cpus: task.cpus.map(Numbers::of_cpus),
        ..entry
    }
}

/// Returns the locks, with the times for which their users hold them at each level. Their users are the same at all levels.
fn exported_locks(system: &System<'_>, at_levels: &[LocksOfDeployment<'_>]) -> Vec<LockEntry> {
    let Some(first) = at_levels.first() else { return Vec::new() };
    let user = |lock: usize, user: usize, task: usize| {
        let held = at_levels.iter().map(|locks| locks.all.get(lock)?.users.get(user)?.held);
        let held = Numbers::of_times(&held.collect::<Vec<_>>());
        Some(LockUserEntry { task: system.activities.get(task)?.instance.to_string(), held })
    };
    let lock = |(index, lock): (usize, &Lock)| LockEntry {
        name: lock.name.to_string(),
        protocol: lock.protocol,
        user: lock.users.iter().enumerate().filter_map(|(at, it)| user(index, at, it.task)).collect(),
    };
    first.all.iter().enumerate().map(lock).collect()
}

/// Returns what releases a task, without ports whose writers are not known; none where nothing follows from the others.
fn exported_trigger(system: &System<'_>, trigger: &TaskTrigger) -> Option<TriggerEntry> {
    let name = |task: usize| system.activities.get(task).map(|it| it.instance.to_string());
    let is_known = trigger.needs == Needs::All || trigger.ports.iter().all(Option::is_some);
    let ports = trigger.ports.iter().flatten().filter(|_| is_known).map(|port| {
        let writer = port.iter().map(|it| Some(WriterEntry { task: name(it.task)?, writes: it.writes }));
        writer.collect()
    });
    let ports: Vec<Vec<WriterEntry>> = ports.collect::<Option<_>>()?;
    (!ports.is_empty()).then_some(TriggerEntry { task: name(trigger.task)?, needs: trigger.needs, ports })
}

/// Returns the operations of all levels. One that takes no time at a level is not among those of that level.
fn operations_of(system: &System<'_>, served: &[Served<'_>]) -> Vec<OperationEntry> {
    let mut found: Vec<(OperationEntry, Vec<Option<Time>>)> = Vec::new();
    // The number of each operation, by what identifies it; a connection may be there twice.
    let mut numbers: HashMap<(&Connected, Option<usize>, usize), usize> = HashMap::new();
    let instance =
        |index: usize| system.activities.get(index).map_or_else(String::new, |it| it.instance.to_string());
    let levels = served.len();
    for (column, served) in served.iter().enumerate() {
        let mut of_level: Vec<usize> = Vec::new();
        let mut seen: HashMap<(&Connected, Option<usize>), usize> = HashMap::new();
        let operations = served.operations.iter().zip(&served.waits).zip(&served.connections);
        for ((operation, waits), connected) in operations {
            let during = operation.during.and_then(|during| of_level.get(during)).copied();
            let occurrence = seen.entry((connected, during)).or_default();
            let number = *numbers.entry((connected, during, *occurrence)).or_insert(found.len());
            *occurrence += 1;
            if number == found.len() {
                let entry = OperationEntry {
                    name: connected.operation.to_string(),
                    provider: instance(operation.provider),
                    client: instance(operation.client),
                    sends: operation.sends,
                    every: Some(operation.every).filter(|every| *every > 1),
                    starting: Some(operation.starting).filter(|starting| *starting > 0),
                    pending: operation.pending,
                    during,
                    time: Numbers::One(Number::Whole(0)),
                    waits: false,
                };
                found.push((entry, vec![Some(Time::ZERO); levels]));
            }
            of_level.push(number);
            if let Some((entry, times)) = found.get_mut(number) {
                entry.waits |= *waits;
                times.get_mut(column).into_iter().for_each(|time| *time = Some(operation.time));
            }
        }
    }
    let timed = |(entry, times): (OperationEntry, Vec<Option<Time>>)| OperationEntry {
        time: Numbers::of_times(&times).unwrap_or(entry.time),
        ..entry
    };
    found.into_iter().map(timed).collect()
}

/// Returns the state machine of a component, at all levels of these tables, as a task that no deployment executes; `prose`
/// renders reasons.
pub fn exported_component<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    prose: Prose,
) -> TaskSet {
    let message = |reason: &Reason<'db>| one_line(&prose(db, reason));
    let (levels, set) = set_of(db, tables, timetable_of(db, tables).levels.clone());
    let incomplete = timetable_of(db, tables).incomplete.as_ref();
    let psm = |&level: &Level| incomplete.is_none().then(|| psm_of(db, tables, component, level));
    let psms: Psms<'db> = levels.iter().map(psm).collect();
    let incomplete = incomplete.map(|tables| always(message(&Reason::IncompleteTables(tables.clone()))));
    let no_period = always(message(&Reason::NoField(ActivityField::Period)));
    let reasons = refusals_of(&levels, &psms, &message).into_iter().chain([no_period]);
    let name = component.qualified(db);
    let task = TaskEntry {
        name: name.clone(),
        component: component.name(db).to_string(),
        not_analysed: incomplete.into_iter().chain(reasons).collect(),
        ..executed(&psms)
    };
    TaskSet { name: Some(name), task: vec![task], ..set }
}

type Psms<'db> = Vec<Option<&'db PsmResult<'db>>>;

/// Returns the levels of tables, and a set without tasks, whose `levels` are the same. Tables without levels give the level of
/// `mauve.toml`, and a set without `levels`.
fn set_of<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>, levels: Vec<Level>) -> (Vec<Level>, TaskSet) {
    let times = tables.label(db).as_deref().map(one_line);
    let set = TaskSet { times, unit: Unit::Nanoseconds, levels: levels.clone(), ..TaskSet::default() };
    match levels.as_slice() {
        [] => (vec![config_of(db, tables.project(db).workspace(db)).level()], set),
        _ => (levels, set),
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

/// Returns what a task executes, with the times of each level. States and edges are the same at all levels.
fn executed(psms: &Psms<'_>) -> TaskEntry {
    let at_levels: Vec<Option<&Psm<'_>>> = psms.iter().map(|psm| psm.as_ref()?.as_ref().ok()).collect();
    let Some(shape) = at_levels.iter().flatten().next() else { return TaskEntry::default() };
    let times = |time: &dyn Fn(&Psm<'_>) -> Option<Time>| -> Option<Numbers> {
        Numbers::of_times(&at_levels.iter().map(|psm| psm.and_then(time)).collect::<Vec<_>>())
    };
    let state = |number: u32| shape.state_with_values(number as usize);
    let edges = shape.machine.edges().iter().enumerate().filter_map(|(index, edge)| {
        let time = times(&|psm| Some(psm.executed().edges().get(index)?.cost))?;
        let wait = times(&|psm| psm.wait_of(index)).filter(|wait| *wait != Numbers::One(Number::Whole(0)));
        let described = shape.edges.all.get(shape.text_edge(index)?)?;
        let name = described.transition.as_ref().map(ToString::to_string);
        Some(EdgeEntry { from: state(edge.source), to: state(edge.target), time, wait, name })
    });
    let mut edges: Vec<EdgeEntry> = edges.collect();
    let assumed = shape.assumed.iter().map(|(codel, time)| (codel.clone(), (*time).into()));
    let initial = shape.start() as u32;
    let (initial, assumed) = (state(initial), assumed.collect());
    let waits = at_levels.iter().flatten().filter_map(|psm| psm.waits.as_ref());
    // Known where it is known at all levels; it differs if a codel waits at some levels only.
    let waits = waits.map(|waits| waits.times).reduce(|one, other| Some(one?.max(other?))).flatten();
    let classic_time = times(&|psm| psm.component_time);
    let waits = waits.map(Number::Whole);
    let entry = TaskEntry { classic_time, assumed, waits, ..TaskEntry::default() };
    match edges.pop() {
        Some(only) if edges.is_empty() && initial == "update" => {
            TaskEntry { time: Some(only.time), wait: only.wait, ..entry }
        }
        last => {
            edges.extend(last);
            // The first edge begins there, if nothing else is said.
            let initial =
                Some(initial).filter(|initial| edges.first().is_some_and(|edge| edge.from != *initial));
            TaskEntry { machine: Some(edges), initial, ..entry }
        }
    }
}

/// Returns what the wake-up of its thread takes of each job; none where that is nothing.
fn wake_up(psms: &Psms<'_>) -> Option<Numbers> {
    let overhead = |psm: &Option<&PsmResult<'_>>| Some(psm.as_ref()?.as_ref().ok()?.overhead);
    let found = Numbers::of_times(&psms.iter().map(overhead).collect::<Vec<_>>());
    found.filter(|it| *it != Numbers::One(Number::Whole(0)))
}

/// Returns the machine of a task of a file at a level, as for a model, without its programs; `None` if it has no times there.
pub fn psm_at<'db>(set: &TaskSet, task: &TaskEntry, level: Level) -> Option<Psm<'db>> {
    let (Demand::Machine { machine, whole }, waits) = set.demand(task, level) else { return None };
    let states = task.states();
    let initial = task.initial.as_ref().and_then(|initial| states.iter().position(|state| state == initial));
    let names = task.machine.iter().flatten().map(|edge| edge.name.as_deref()).chain([None]);
    let edge = |(edge, name): (&mauve_timing::Edge, Option<&str>)| mauve_hir::PeriodEdge {
        source: edge.source as usize,
        target: edge.target as usize,
        transition: name.map(Into::into),
        first: 0,
        then: Vec::new(),
    };
    let all = machine.edges().iter().zip(names).map(edge).collect();
    let edges = Edges { all, first: vec![Vec::new(); states.len()] };
    let psm = Psm::of_machine(states.into_iter().map(Into::into).collect(), machine, edges);
    Some(Psm { initial: initial.unwrap_or_default(), waits, component_time: whole, ..psm })
}

impl<'db> DeployedTasks<'db> {
    /// Returns the deployment of a task set of a file.
    ///
    /// # Errors
    ///
    /// The file has no times at the level.
    pub fn of_file(file: &TaskSet, level: Level, method: Method) -> Result<Self, TaskSetError> {
        let tasks = file.at(level, method)?;
        let psms: Vec<Option<Psm<'db>>> = file.task.iter().map(|entry| psm_at(file, entry, level)).collect();
        let stated = |reason: &String| Refusal { reason: Reason::Stated(reason.clone()), at: None };
        let activities = tasks.activities().iter().zip(&file.task).zip(&psms);
        let reports = activities.map(|((task, entry), psm)| {
            let refusals = entry.not_analysed.iter().filter(|it| it.holds(level, method));
            ActivityReport {
                task: task.clone(),
                instance: entry.name.as_str().into(),
                component_name: entry.component.as_str().into(),
                thread: entry.thread.as_deref().map(Into::into),
                reasons: refusals.map(|it| stated(&it.reason)).collect(),
                own: psm.as_ref().map(|psm| psm.machine.greatest_cost()),
                assumed: psm.as_ref().map_or_else(Vec::new, |_| file.assumed(entry)),
                ..ActivityReport::default()
            }
        });
        Ok(DeployedTasks {
            reports: reports.collect(),
            psms: psms.into_iter().map(|psm| psm.map(Cow::Owned)).collect(),
            operations: file.operation.iter().map(|it| it.name.as_str().into()).collect(),
            times: file.times.as_deref().map(Into::into),
            not_analysed: file.not_analysed.iter().map(stated).collect(),
            hosts: Arc::default(),
            tasks,
        })
    }
}
