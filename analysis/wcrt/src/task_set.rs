//! A deployment at one level as `timing` analyses and simulates it, made of a model or of an exported file.

use std::borrow::Cow;
use std::sync::Arc;

use mauve_timing::{Executed, Level, Method, PortWriter, Slice, Task, TaskTrigger, Tasks};

use crate::gateway::gateway_psm;
use crate::locks::{LocksOfDeployment, locks_of};
use crate::psm::{OtherTimes, Psm, PsmResult, psm_in_thread};
use crate::reason::{Reason, Refusal};
use crate::report::{ActivityReport, Query};
use crate::sends::all_writes_of;
use crate::served::{Served, served_in};
use crate::system::{ResolvedActivity, System, Trigger, TriggerSource, others_of, system_of};
use crate::table_set::{TableSet, tables_of};
use crate::threads::is_throttled;
use crate::timetable::incomplete_tables;
use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Hosts, ModelDb, PeriodEdge, Project, hosts_of};

/// A deployment at one level.
#[derive(Debug, Clone)]
pub struct DeployedTasks<'db> {
    /// Its tasks.
    pub tasks: Tasks,
    /// The state machine of each activity, where it is known.
    pub(crate) psms: Vec<Option<Cow<'db, Psm<'db>>>>,
    /// The names of the operations of the tasks.
    pub(crate) operations: Vec<Name>,
    /// The reports without figures, one for each activity. Their reasons are why the activity itself is not analysed.
    pub(crate) reports: Vec<ActivityReport<'db>>,
    /// The section of its timing tables.
    pub(crate) times: Option<Name>,
    pub(crate) not_analysed: Vec<Refusal<'db>>,
    /// The hosts of its CPUs.
    pub hosts: Arc<Hosts>,
}

impl<'db> DeployedTasks<'db> {
    /// Returns a deployment of a model, for [`Method::Psm`].
    pub fn simulated(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>, level: Level) -> Self {
        let query = Query { level, method: Method::Psm };
        DeployedTasks::of_model(db, tables_of(db, project, of), system_of(db, project, of), query)
    }

    pub(crate) fn of_model(
        db: &'db dyn ModelDb,
        tables: TableSet<'db>,
        system: &System<'db>,
        query: Query,
    ) -> Self {
        let project = tables.project(db);
        let psms = psms_of(db, system, query.level);
        let executed = Executables::of(db, project, system, psms, query.level, &|_| None);
        let tasks = executed.tasks(db, project, system, query.method);
        let known: Vec<Option<&'db Psm<'db>>> =
            executed.psms.iter().map(|psm| psm.and_then(|psm| psm.as_ref().ok())).collect();
        let activities = system.activities.iter().zip(tasks.activities()).zip(&known).enumerate();
        let reports = activities.map(|(index, ((resolved, task), psm))| ActivityReport {
            task: task.clone(),
            instance: resolved.instance.clone(),
            component_name: resolved.component_name.clone(),
            component: resolved.component,
            thread: resolved.thread_name.clone(),
            wakes: resolved.wakes,
            at: Some(resolved.at.clone()),
            unknown_priority: resolved.unknown_priority.clone(),
            reasons: executed.refusals_of(resolved, index, query.method).collect(),
            own: psm.map(|psm| psm.machine.greatest_cost()),
            assumed: psm.map_or_else(Vec::new, |psm| psm.assumed.clone()),
            is_extrapolated: psm.is_some_and(|psm| psm.is_extrapolated),
            ..ActivityReport::default()
        });
        DeployedTasks {
            reports: reports.collect(),
            psms: known.into_iter().map(|psm| psm.map(Cow::Borrowed)).collect(),
            operations: executed.served.connections.into_iter().map(|it| it.operation).collect(),
            times: tables.section(db).clone(),
            not_analysed: system.not_analysed.clone(),
            hosts: hosts_of(db, project.workspace(db)).clone(),
            tasks,
        }
    }

    /// Returns the initial state of each activity's machine.
    pub fn initial_states(&self) -> Vec<Option<u32>> {
        let initial = |psm: &Option<Cow<'_, Psm<'_>>>| u32::try_from(psm.as_ref()?.start()).ok();
        self.psms.iter().map(initial).collect()
    }

    /// Returns the edge that a slice executes, with its state machine; none where it executes a call or real-time throttling.
    pub fn edge(&self, slice: &Slice) -> Option<(&Psm<'db>, &PeriodEdge)> {
        let Executed::Edge(edge) = slice.executed else { return None };
        let psm = self.psms.get(slice.activity)?.as_deref()?;
        Some((psm, psm.edges.all.get(psm.text_edge(edge)?)?))
    }

    /// Returns the edges of the machine of an activity that begin and end in these states.
    pub fn edges_within(&self, activity: usize, states: &[&str]) -> Option<Vec<usize>> {
        let psm = self.psms.get(activity)?.as_deref()?;
        let is_in = |state| states.contains(&psm.state(state));
        let within = |index: &usize| {
            let edge = psm.text_edge(*index).and_then(|it| psm.edges.all.get(it));
            edge.is_some_and(|edge| is_in(edge.source) && is_in(edge.target))
        };
        Some((0..psm.machine.edges().len()).filter(within).collect())
    }

    /// Returns the operation whose call a slice executes, and its client; none where it executes an edge.
    pub fn call(&self, slice: &Slice) -> Option<(&Name, &str)> {
        let Executed::Operation(operation) = slice.executed else { return None };
        let client = self.tasks.activities().get(self.tasks.operations.get(operation)?.client)?;
        Some((self.operations.get(operation)?, &client.name))
    }
}

pub(crate) fn psms_of<'db>(
    db: &'db dyn ModelDb,
    system: &System<'db>,
    level: Level,
) -> Vec<Option<&'db PsmResult<'db>>> {
    // If the tables are incomplete, every time may be longer.
    let of = |it: &ResolvedActivity<'db>| match (incomplete_tables(db, it.tables), it.gateway) {
        (Some(_), _) => None,
        (None, Some(of)) => Some(gateway_psm(db, it.tables, of.deployment, of.host, level)),
        (None, None) => Some(psm_in_thread(db, it.tables, it.executed()?, level, it.wakes)),
    };
    system.activities.iter().map(of).collect()
}

/// Returns who writes the data that releases the activities of a deployment.
pub(crate) fn triggers_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
) -> Vec<TaskTrigger> {
    let writer = |source: &TriggerSource| {
        let TriggerSource { activity: task, port } = source;
        let component = system.activities.get(*task)?.component;
        let writes = match port {
            Some(port) => all_writes_of(db, project, component?, port)?.into(),
            None => 1,
        };
        Some(PortWriter { task: *task, writes })
    };
    let of_port = |port: &Option<Vec<TriggerSource>>| port.as_ref()?.iter().map(writer).collect();
    let of_activity = |(task, activity): (usize, &ResolvedActivity<'db>)| {
        let Trigger { needs, sources, .. } = activity.trigger.as_ref()?;
        Some(TaskTrigger { task, needs: *needs, ports: sources.iter().map(of_port).collect() })
    };
    system.activities.iter().enumerate().filter_map(of_activity).collect()
}

/// What the activities of a deployment execute.
pub(crate) struct Executables<'a, 'db> {
    /// The state machine of each activity.
    psms: Vec<Option<&'a PsmResult<'db>>>,
    served: Served<'db>,
    locks: LocksOfDeployment<'db>,
}

impl<'a, 'db> Executables<'a, 'db> {
    /// Returns these state machines with the operations and locks of a deployment, where other times replace those of the tables.
    pub(crate) fn of(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        system: &System<'db>,
        psms: Vec<Option<&'a PsmResult<'db>>>,
        level: Level,
        what_if: OtherTimes<'_, 'db>,
    ) -> Self {
        let served = served_in(db, project, system, level, what_if);
        let locks = locks_of(db, project, system, level, what_if);
        Executables { psms, served, locks }
    }

    /// Returns the tasks of a deployment whose activities execute this.
    pub(crate) fn tasks(
        &self,
        db: &'db dyn ModelDb,
        project: Project<'db>,
        system: &System<'db>,
        method: Method,
    ) -> Tasks {
        let activities = system.activities.iter().zip(&self.psms).enumerate();
        let activities = activities.map(|(index, (activity, psm))| {
            let psm = psm.and_then(|psm| psm.as_ref().ok());
            let (demand, waits) = psm.map(Psm::demand).unwrap_or_default();
            let wake_up = psm.filter(|_| activity.is_not_preempted).map(|psm| psm.overhead);
            let wake_up = wake_up.unwrap_or_default();
            let task = Task { demand, waits, wake_up, ..activity.task.clone() };
            let mut calls = self.served.operations.iter().zip(&self.served.waits);
            let waits = calls.any(|(it, waits)| *waits && it.provider == index);
            if waits { task.waiting_in_calls() } else { task }
        });
        let mut tasks = Tasks::new(activities.collect());
        tasks.operations.clone_from(&self.served.operations);
        tasks.locks.clone_from(&self.locks.all);
        tasks.triggers = triggers_of(db, project, system);
        for (index, activity) in system.activities.iter().enumerate() {
            if self.refusals_of(activity, index, method).next().is_some() {
                tasks.refuse(index);
            }
        }
        let is_throttled = is_throttled(db, project.workspace(db)) == Some(true);
        tasks.with_platform(others_of(db, project.workspace(db), system.cpus), is_throttled)
    }

    /// Returns why the activity of this index cannot be analysed.
    fn refusals_of<'b>(
        &'b self,
        activity: &'b ResolvedActivity<'db>,
        index: usize,
        method: Method,
    ) -> impl Iterator<Item = Refusal<'db>> + use<'a, 'b, 'db> {
        let psm = self.psms.get(index).copied().flatten();
        let of_component = psm.and_then(|psm| psm.as_ref().err()).into_iter().flatten();
        let unusable = psm.filter(|_| method == Method::Classic).and_then(|psm| psm.as_ref().ok());
        let unusable = unusable.and_then(|psm| psm.unusable_component_time.clone());
        let unusable = unusable.map(|why| Refusal::new(Reason::ComponentTime(why), activity.at.clone()));
        let of_operations = self.served.refusals.get(&index).into_iter().flatten();
        let of_locks = self.locks.refusals.get(&index).into_iter().flatten();
        let of_activity = activity.refusals.iter().chain(of_component).chain(of_operations).chain(of_locks);
        of_activity.cloned().chain(unusable)
    }
}
