//! The activities of a deployment: one for each instance of its architecture.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Deref;
use std::sync::Arc;

use mauve_pwcet::trace::ros2_identifier;
use mauve_timing::{CpuSet, Needs, Order, Priority, Task, Time};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::fact::{TimingFact, TimingFactKind};
use crate::gateway::Gateway;
use crate::psm::codels_of;
use crate::reason::{ActivityField, MOST_REASONS, NoSuchCpu, Reason, Refusal, ThreadReason, UnknownPriority};
use crate::serving::{Serving, errors_and_items, serving_of};
use crate::table_set::{TableSet, all_tables_of, tables_of_host};
#[cfg(doc)]
use crate::threads::DeclaredThreads;
use crate::threads::{DeclaredThread, declared_id, declared_threads, place_of_thread, threads_in};
use crate::timetable::incomplete_tables;
use mauve_hir::fact::{self, Fact, FactKind, unresolved_type};
use mauve_hir::item_tree::{Activity, Deployment, Expr, FeatureKind, Field, Kind, Name, NameRef, SourceId};
use mauve_hir::ros2_files::{ThreadPlace, timer_period};
use mauve_hir::{
    ACTIVITY_FIELDS, DEPENDENT_FIELDS, Decl, EXCLUSIVE_FIELDS, FeatureOf, FieldEntry, FieldValue, Flat,
    FlatInstance, GatewayConfig, Hosts, InvalidValue, Link, Location, ModelDb, PERIODS, PLACES, Project,
    Topic, Unresolved, Workspace, architecture, config_file, config_of, declarations, deployment,
    field_entry, flat_of, hosts_of, incomplete_file, number, platform_of, resolve_path, resolve_type,
    ros2_of, same_fields, similar, similar_field, too_large,
};

/// The activities of a deployment.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct System<'db> {
    /// In the order of the deployment; instances without an activity last.
    pub activities: Vec<ResolvedActivity<'db>>,
    /// The CPUs: those of `mauve.toml`, otherwise those that an activity names. With hosts, they and those of the activities have
    /// the numbers of [`mauve_hir::Hosts`].
    pub cpus: CpuSet,
    /// The connected operations.
    pub connected: Vec<Connected>,
    /// Why nothing is analysed: an activity may be missing, or a time that makes every bound longer.
    pub not_analysed: Vec<Refusal<'db>>,
    /// The callbacks of threads of files that no activity has, and that are assumed to be never executed: each with the id of its thread. For
    /// `/ns/node/*`, which other groups may have, none.
    pub never_executed: Vec<(Name, Option<Name>)>,
    /// The facts about the deployment.
    pub facts: Vec<TimingFact<'db>>,
}

/// A connected operation: who executes it, and who sends calls to it. The activities are indices into
/// [`System::activities`].
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Connected {
    /// The activity that executes it.
    pub provider: usize,
    /// Its name in the shell of the provider.
    pub operation: Name,
    /// The activity that sends calls.
    pub client: usize,
    /// Its name in the shell of the client.
    pub required: Name,
}

/// The input ports whose data releases an activity.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Trigger {
    /// Their names, at least one.
    pub ports: Vec<Name>,
    /// Which of them need new data.
    pub needs: Needs,
    /// What writes each of them; none where that is not known, or waits in a buffer.
    pub sources: Vec<Option<Vec<TriggerSource>>>,
}

/// What writes a port whose data releases an activity.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct TriggerSource {
    /// The index of its activity in [`System::activities`].
    pub activity: usize,
    /// The port that it writes; none for a gateway, which writes once in a period.
    pub port: Option<Name>,
}

/// An activity, or an instance that has none: its task and its place in the text. It is read as its task.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct ResolvedActivity<'db> {
    /// Its task, of unknown demand. The deadline is the period where it is omitted; the offset is unknown unless its clock is
    /// synchronised.
    pub task: Task,
    /// The instance.
    pub instance: Name,
    /// The name of its component as the architecture writes it.
    pub component_name: Name,
    /// Its component, if it is known.
    pub component: Option<Decl<'db>>,
    /// The name of the instance in its activity; the deployment where there is no activity.
    pub at: Location<'db>,
    /// The written offset of its releases in the period, less than the period.
    pub written_offset: Option<Time>,
    /// Whether its releases are at whole nanoseconds; otherwise its clock is not synchronised.
    pub is_exact: bool,
    /// What data releases it; `None` where its clock does. Its task is sporadic then.
    pub trigger: Option<Trigger>,
    /// The name of the activity; that of the instance, unless the activity executes several instances in one thread.
    pub activity: Name,
    /// The name of the thread that executes its jobs and those of others.
    pub thread_name: Option<Name>,
    /// Its thread in the files of `[platform] threads`, which have its priority and its CPUs: the index in [`DeclaredThreads::all`], and the
    /// field that names it.
    pub declared_thread: Option<(usize, SourceId)>,
    /// Whether its jobs begin with the wake-up of their thread, and so have its overhead: unless an earlier instance of the thread has. A
    /// thread wakes up once for a job of each, and the first one delays all others. (A call of an operation, a wait and a lock may wake it once
    /// more: each has an overhead of its own.)
    pub wakes: bool,
    /// Why it is not analysed.
    pub refusals: Vec<Refusal<'db>>,
    /// Why its priority counts as unknown although one is written.
    pub unknown_priority: Option<UnknownPriority>,
    /// Whether it is a gateway to ROS 2, and which.
    pub gateway: Option<Gateway<'db>>,
    /// The host that it runs on, by its index in [`mauve_hir::Hosts::all`]; none without hosts.
    pub host: Option<usize>,
    /// The timing tables of its host.
    pub tables: TableSet<'db>,
}

impl Deref for ResolvedActivity<'_> {
    type Target = Task;

    fn deref(&self) -> &Task {
        &self.task
    }
}

impl<'db> ResolvedActivity<'db> {
    /// Returns the component whose state machine it executes, if it is known; none in the background.
    pub(crate) fn executed(&self) -> Option<Decl<'db>> {
        self.component.filter(|_| self.priority != Priority::Background)
    }

    fn refuse(&mut self, reason: Reason<'db>, at: Location<'db>) {
        self.refusals.push(Refusal::new(reason, at));
    }

    /// Enters the value of a field, unless it names something that is to be resolved.
    fn set(&mut self, field: ActivityField, value: &FieldValue) {
        match *value {
            FieldValue::Thread(ref thread) => self.thread_name = Some(thread.clone()),
            FieldValue::Order(order) => self.task.order = order,
            FieldValue::Truth(is_preemptive) => self.task.is_not_preempted = !is_preemptive,
            FieldValue::Cpus(cpus) => self.task.cpus = Some(cpus),
            FieldValue::Priority(priority) => self.task.priority = Priority::RealTime(priority),
            FieldValue::Background => self.task.priority = Priority::Background,
            FieldValue::Count(burst) => self.task.burst = u64::from(burst),
            FieldValue::Time(time, is_exact) => match field {
                ActivityField::Deadline => self.task.deadline = Some(time),
                ActivityField::Jitter => self.task.jitter = time,
                ActivityField::Offset => {
                    self.written_offset = Some(time);
                    self.is_exact &= is_exact;
                }
                _ => {
                    self.task.period = Some(time);
                    self.is_exact &= is_exact;
                }
            },
            FieldValue::CpuSet(_)
            | FieldValue::Ports(..)
            | FieldValue::Instances
            | FieldValue::DeclaredThread(_) => {}
        }
    }

    /// Makes the value of a field unknown.
    fn forget(&mut self, field: ActivityField) {
        match field {
            ActivityField::Affinity | ActivityField::Cpus => self.task.cpus = None,
            ActivityField::Priority => self.task.priority = Priority::Unknown,
            ActivityField::Period | ActivityField::Rate | ActivityField::Least => self.task.period = None,
            ActivityField::Deadline => self.task.deadline = None,
            ActivityField::Preemptive => self.task.is_not_preempted = true,
            // The refusal is enough: nothing else is derived from them.
            ActivityField::Instances
            | ActivityField::Thread
            | ActivityField::Order
            | ActivityField::Trigger
            | ActivityField::Burst
            | ActivityField::Jitter
            | ActivityField::Offset => {}
        }
    }

    /// Makes the priority and the CPUs unknown. Keeps the reason where a priority is written.
    fn forget_priority(&mut self, why: UnknownPriority) {
        if matches!(self.priority, Priority::RealTime(_)) {
            self.unknown_priority = Some(why);
        }
        (self.task.priority, self.task.cpus) = (Priority::Unknown, None);
    }
}

/// Returns the gateway of `mauve.toml`, and where it is written; none without `[ros2]` and `[host.…]`. A query, so that other changes
/// of that file invalidate no deployment without topics.
#[salsa::tracked(returns(ref))]
fn gateway_of(db: &dyn ModelDb, workspace: Workspace) -> Option<(GatewayConfig, Location<'_>)> {
    let config = config_of(db, workspace);
    let gateway = config.ros2.as_ref().map(|it| it.gateway.clone()).unwrap_or_default();
    let ros2 = config.ros2.iter().map(|it| &it.span);
    let spans = [&gateway.span].into_iter().filter(|it| !it.is_empty()).chain(ros2);
    let span = spans.chain(config.hosts.iter().map(|it| &it.span)).next()?;
    let at = Location::of_span(config_file(db, workspace)?, span);
    Some((gateway, at))
}

/// Reads a deployment.
#[salsa::tracked(returns(ref))]
pub fn system_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> System<'db> {
    deployment(db, of).map_or_else(System::default, |data| read(db, project, of, data))
}

/// Reads the deployment that `of` declares, with `data` in it: its own, or that of a what-if question.
pub(crate) fn read<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    data: &Deployment,
) -> System<'db> {
    let hosts = hosts_of(db, project.workspace(db));
    let mut reader =
        SystemReader { db, project, of, hosts, covered: BTreeMap::new(), found: System::default() };
    reader.deployment(data);
    let is_declared = |it: &Arc<Activity>| it.field(ActivityField::Thread).and_then(declared_id).is_some();
    let threads = declared_threads(db, project.workspace(db)).fault.as_ref();
    let threads = threads.filter(|_| data.activities.iter().any(is_declared));
    let tables =
        all_tables_of(db, project, of).into_iter().filter_map(|it| incomplete_tables(db, it).as_ref());
    for tables in tables.chain(threads) {
        let at = Location::Range(tables.file, 0, 0);
        reader.not_analysed(Reason::IncompleteTables(tables.clone()), at);
    }
    if let Some(file) = incomplete_file(db, project) {
        let problem = file.problem(db).as_ref().map(|problem| problem.message().to_owned());
        reader.not_analysed(Reason::DamagedFile { file, problem }, Location::Range(file, 0, 0));
    }
    reader.found
}

struct SystemReader<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    hosts: &'db Hosts,
    /// The ids by which activities name threads in files, by the index of the thread; of a whole node, its own.
    covered: BTreeMap<usize, Vec<Name>>,
    found: System<'db>,
}

impl<'db> SystemReader<'db> {
    fn deployment(&mut self, data: &Deployment) {
        let (db, project, of) = (self.db, self.project, self.of);
        if data.completeness.is_incomplete() {
            self.not_analysed(Reason::DamagedDeployment(of), Location::name_of(of));
        }
        if let Some(at) = too_large(db, project) {
            self.not_analysed(Reason::Model(fact::ModelReason::TooLarge), Location::name_of(at));
            return;
        }
        let own = std::slice::from_ref(of.name(db));
        let found = resolve_path(db, project, of.library(db).as_ref(), Kind::Deployment, own);
        if found == Err(Unresolved::Repeated) {
            self.not_analysed(Reason::DeclaredTwice(of), Location::name_of(of));
        }
        let target = match data.targets.as_slice() {
            [target] => {
                let found = resolve_type(db, project, of, Kind::Architecture, Some(target));
                let unresolved = |why| unresolved_type(of, Kind::Architecture, Some(target), why);
                if let Some(Fact { at, kind, .. }) = found.as_ref().err().and_then(unresolved) {
                    self.report(at, TimingFactKind::Unresolved(kind));
                }
                found.ok()
            }
            _ if data.completeness.is_incomplete() => None,
            [_, second, ..] => {
                self.report(self.at(second.id), TimingFactKind::SecondTarget);
                None
            }
            [] => {
                self.report(Location::name_of(of), TimingFactKind::NoTarget);
                None
            }
        };
        let entries = entries(data);
        match target {
            Some(target) => {
                self.activities(target, &entries);
                self.errors(target);
            }
            None => {
                self.not_analysed(Reason::NoArchitecture(of), Location::name_of(of));
                entries.iter().for_each(|entry| self.entry(None, entry));
            }
        }
        self.gateways();
        if let Some(target) = target.filter(|_| self.found.activities.iter().any(|it| it.trigger.is_some())) {
            self.trigger_sources(target);
        }
        self.cpus(&entries);
        self.threads(data);
        self.below_undeclared();
    }

    fn at(&self, id: SourceId) -> Location<'db> {
        Location::Source(self.of, id)
    }

    fn report(&mut self, at: Location<'db>, kind: TimingFactKind<'db>) {
        self.found.facts.push(TimingFact::new(at, kind));
    }

    fn not_analysed(&mut self, reason: Reason<'db>, at: Location<'db>) {
        self.found.not_analysed.push(Refusal::new(reason, at));
    }

    fn activities(&mut self, target: Decl<'db>, entries: &[ActivityEntry<'_>]) {
        let flat = flat_of(self.db, self.project, target);
        self.found.not_analysed.extend(flat.refusals.iter().map(Refusal::of_model));
        if flat.cycle {
            self.not_analysed(Reason::ImportsItself(target), Location::name_of(target));
        }
        let mut first_of: FxHashMap<&Name, (SourceId, &Activity)> = FxHashMap::default();
        // Instances whose activity has a misspelt name: that is one mistake.
        let mut misspelt: FxHashSet<Name> = FxHashSet::default();
        let named: FxHashSet<&Name> = entries.iter().filter_map(|it| Some(&it.instance?.name)).collect();
        let mut strays = Vec::new();
        let mut twice = self.repeated_names(flat, entries, &mut misspelt);
        for entry in entries {
            let Some(NameRef { name, id }) = entry.instance else {
                self.entry(None, entry);
                continue;
            };
            let first = first_of.insert(name, (*id, entry.activity));
            let instance = flat.instance(name);
            // The incomplete architecture may have this instance: that is no second mistake.
            if instance.is_none() && flat.refusals.is_empty() {
                // Another activity of an instance that has one would be the next mistake.
                let without = flat.instances.iter().map(|instance| &instance.name);
                let near = similar(name, without.filter(|it| !named.contains(it)));
                let at = self.at(*id);
                misspelt.extend(near.clone());
                let missing = Reason::NoSuchInstance { architecture: target, instance: name.clone() };
                strays.push(Refusal::new(missing, at.clone()));
                let (name, architecture) = (name.clone(), target.name(self.db).clone());
                let unresolved = FactKind::UnresolvedInstance { name, architecture, near };
                self.report(at, TimingFactKind::Unresolved(unresolved));
            }
            self.entry(instance, entry);
            if let Some((first, activity)) = first {
                let in_list = std::ptr::eq(activity, entry.activity);
                let (at, first) = (self.at(*id), self.at(first));
                let instance = name.clone();
                self.report(at.clone(), TimingFactKind::DuplicateActivity { instance, first, in_list });
                twice.entry(name).or_insert(Refusal::new(Reason::SecondActivity(name.clone()), at));
            }
        }
        // Which of the two counts is unknown.
        for resolved in &mut self.found.activities {
            if let Some(refusal) = twice.get(&resolved.instance) {
                resolved.refusals.push(refusal.clone());
                resolved.forget_priority(UnknownPriority::TwoActivities);
            }
        }
        // One activity too many and one too few are one mistake, which is reported.
        let missing = flat.instances.iter().filter(|it| !first_of.contains_key(&it.name)).count();
        let right = first_of.keys().filter(|name| flat.instance(name).is_some()).count();
        let is_renamed = missing == 1 && entries.len().saturating_sub(right) == 1;
        // An incomplete list may have any of them.
        let has_damaged_list = entries.iter().any(|it| it.has_damaged_list());
        let mut without: FxHashSet<&Name> = FxHashSet::default();
        for instance in &flat.instances {
            if first_of.contains_key(&instance.name) || !without.insert(&instance.name) {
                continue;
            }
            let at = Location::name_of(self.of);
            // Where an activity is unknown, it may be this one; also in a text outside all declarations.
            let are_known = self.found.not_analysed.is_empty()
                && declarations(self.db, self.of.file(self.db)).completeness.is_complete();
            if !misspelt.contains(&instance.name) && !is_renamed && !has_damaged_list && are_known {
                let instance = instance.name.clone();
                self.report(at.clone(), TimingFactKind::MissingActivity { of: self.of, instance });
            }
            let mut resolved = self.resolved(&instance.name, at.clone(), Some(instance));
            resolved.refuse(Reason::NoActivity, at);
            self.found.activities.push(resolved);
        }
        // Only now: missing activities are reported in a deployment with such an activity too.
        self.found.not_analysed.extend(strays);
        self.served(serving_of(self.db, self.project, target));
    }

    /// Reports the names of activities with a list that another activity has, or an instance that the activity does not execute.
    /// Returns the refusals of the instances of these activities.
    fn repeated_names<'a>(
        &mut self,
        flat: &Flat<'db>,
        entries: &[ActivityEntry<'a>],
        misspelt: &mut FxHashSet<Name>,
    ) -> FxHashMap<&'a Name, Refusal<'db>> {
        let mut refused = FxHashMap::default();
        let mut first_of: FxHashMap<&Name, &Activity> = FxHashMap::default();
        for entry in entries.iter().filter(|it| it.number == 0) {
            let (activity, name) = (entry.activity, &entry.activity.name.name);
            let before = first_of.insert(name, activity);
            // Two activities of one instance are reported at the instance.
            let before = before.filter(|it| entry.is_list() || it.field(ActivityField::Instances).is_some());
            let of_other = flat.instance(name).filter(|_| !activity.executes(name));
            let at = self.at(activity.name.id);
            let first = match (before, of_other.and_then(|it| it.declaration(self.db))) {
                (Some(before), _) if !before.instances.iter().any(|it| activity.executes(&it.name)) => {
                    self.at(before.name.id)
                }
                (None, Some(declared)) => declared,
                _ => continue,
            };
            let instance = name.clone();
            misspelt.insert(name.clone());
            self.report(at.clone(), TimingFactKind::DuplicateActivity { instance, first, in_list: false });
            for activity in before.into_iter().chain([activity]) {
                let refusal = Refusal::new(Reason::SecondActivity(name.clone()), at.clone());
                refused.extend(activity.instances.iter().map(|it| (&it.name, refusal.clone())));
            }
        }
        refused
    }

    /// Refuses the instances that an item with an error declares, connects or sets a value of: their component may be wrong.
    /// Any other error in an architecture may hide an instance, and refuses all.
    fn errors(&mut self, target: Decl<'db>) {
        let (db, project) = (self.db, self.project);
        let flat = flat_of(db, project, target);
        let mut of_instance: FxHashMap<&Name, Vec<Refusal<'db>>> = FxHashMap::default();
        for &decl in flat.architectures.iter().chain([&self.of]) {
            for (error, item) in errors_and_items(db, project, decl) {
                let refusal = Refusal::new(Reason::ErrorIn(decl, error.reason.clone()), error.at.clone());
                let named = item.map_or_else(Vec::new, |item| item.instances);
                if named.is_empty() || named.iter().any(|name| flat.instance(name).is_none()) {
                    self.found.not_analysed.push(refusal);
                } else {
                    named.iter().for_each(|name| of_instance.entry(name).or_default().push(refusal.clone()));
                }
            }
        }
        for resolved in &mut self.found.activities {
            let Some(refusals) = of_instance.get(&resolved.instance) else { continue };
            resolved.refusals.extend(refusals.iter().take(MOST_REASONS).cloned());
        }
        self.found.not_analysed.truncate(MOST_REASONS);
    }

    fn resolved(
        &self,
        name: &Name,
        at: Location<'db>,
        instance: Option<&FlatInstance<'db>>,
    ) -> ResolvedActivity<'db> {
        let component = instance.and_then(|instance| instance.component);
        let written = || {
            let (declared, index) = instance?.declared;
            architecture(self.db, declared)?.instances.get(index)?.component.as_ref()?.path.last().cloned()
        };
        let component_name = component.map(|component| component.name(self.db).clone()).or_else(written);
        let host = self.hosts.of(name);
        ResolvedActivity {
            task: Task { name: name.as_str().into(), ..Task::default() },
            instance: name.clone(),
            component_name: component_name.unwrap_or_default(),
            component,
            at,
            written_offset: None,
            is_exact: true,
            trigger: None,
            activity: name.clone(),
            thread_name: None,
            declared_thread: None,
            wakes: true,
            refusals: Vec::new(),
            unknown_priority: None,
            gateway: None,
            host,
            tables: tables_of_host(self.db, self.project, self.of, host),
        }
    }

    /// Reads an instance of an activity. The facts about the fields are those of the first one.
    fn entry(&mut self, instance: Option<&FlatInstance<'db>>, entry: &ActivityEntry<'_>) {
        let known = self.found.facts.len();
        self.activity(instance, entry);
        if entry.number > 0 {
            self.found.facts.truncate(known);
        }
    }

    fn activity(&mut self, instance: Option<&FlatInstance<'db>>, entry: &ActivityEntry<'_>) {
        let activity = entry.activity;
        let NameRef { name, id } = entry.instance.unwrap_or(&activity.name);
        let at = self.at(*id);
        let mut found = self.resolved(name, at.clone(), instance);
        found.activity = activity.name.name.clone();
        found.task.thread = entry.thread;
        found.thread_name = entry.thread.map(|_| activity.name.name.clone());
        found.wakes = entry.number == 0;
        found.task.cpus = Some(CpuSet::NONE);
        let is_repeated = instance.is_some_and(|instance| instance.repeated);
        match instance {
            None => found.refuse(Reason::UnknownInstance, at.clone()),
            Some(_) if is_repeated => found.refuse(Reason::SeveralInstances, at.clone()),
            Some(instance) if instance.component.is_none() => {
                let (project, name) = (self.project, instance.name.clone());
                let at = Location::name_of(instance.declared.0);
                found.refuse(Reason::UnknownComponent { project, instance: name }, at);
            }
            Some(_) => {}
        }
        let of_instance = found.refusals.len();
        let mut fields = WrittenFields::default();
        for field in &activity.fields {
            self.field((&mut found, instance), &mut fields, activity, field);
        }
        self.conflicts(&mut found, &fields);
        let thread = self.declared_thread(&mut found, activity, &fields);
        let is_supplied = thread.is_some();
        let has_wrong_field = found.refusals.len() > of_instance;
        if found.priority == Priority::Background && !has_wrong_field && !is_supplied {
            for &FieldEntry { field, .. } in ACTIVITY_FIELDS.iter().filter(|it| it.only_real_time) {
                let Some(written) = fields.written.get(&field) else { continue };
                let (of, id, instance) = (self.of, written.name.id, found.activity.clone());
                self.report(self.at(id), TimingFactKind::BackgroundField { of, id, field, instance });
            }
        }
        self.offset(&mut found, activity, &fields);
        if activity.completeness.is_incomplete() && found.refusals.is_empty() {
            found.refuse(Reason::DamagedActivity, at.clone());
        }
        let has_period = thread.flatten().is_some_and(|it| it.period.is_some());
        let of_thread = |field| {
            let has_place = field == ActivityField::Priority || PLACES.contains(&field);
            is_supplied && has_place || has_period && PERIODS.contains(&field)
        };
        let is_missing = |field| !fields.written.contains_key(&field) && !of_thread(field);
        // Where the period is missing, the priority may have its value; where an affinity names no CPU, the affinity may be
        // the priority. A field that is unknown may be any of the missing fields.
        let has_no_period = PERIODS.into_iter().all(is_missing);
        let lacks_period = found.priority != Priority::Background && has_no_period;
        let is_uncertain =
            lacks_period || is_missing(ActivityField::Priority) || fields.has_misplaced || instance.is_none();
        let is_incomplete = activity.completeness.is_incomplete() || fields.has_unknown;
        if is_incomplete && PLACES.into_iter().all(is_missing) {
            found.task.cpus = None;
        }
        // An error may be in the priority of a real-time activity. Of two instances of one name, one has no activity of
        // its own: its activity may be any.
        let may_be_real_time =
            found.priority == Priority::Background && (is_incomplete || has_wrong_field) || is_repeated;
        if may_be_real_time {
            found.forget_priority(UnknownPriority::SeveralInstances);
        }
        let lacking = match found.priority {
            Priority::Unknown => Some(ActivityField::Priority),
            Priority::RealTime(_) if found.period.is_none() => Some(ActivityField::Period),
            Priority::RealTime(_) | Priority::Background => None,
        };
        if let Some(field) = lacking {
            let is_missing = if field == ActivityField::Period { has_no_period } else { is_missing(field) };
            if is_missing && !is_incomplete {
                self.report(at.clone(), self.missing_field(activity, field));
            }
            // Why a written field cannot be used is a reason already.
            if is_missing || found.refusals.is_empty() {
                found.refuse(Reason::NoField(field), at);
            }
        }
        if is_uncertain {
            found.forget_priority(match lacks_period {
                true => UnknownPriority::PriorityAsPeriod,
                false => UnknownPriority::AffinityAsPriority,
            });
        }
        self.deadline(&mut found, &fields);
        self.found.activities.push(found);
    }

    fn missing_field(&self, activity: &Activity, field: ActivityField) -> TimingFactKind<'db> {
        let (of, name) = (self.of, (activity.name.name.clone(), activity.name.id));
        if field == ActivityField::Period {
            let priority = activity.field(ActivityField::Priority).map(|priority| priority.value_id);
            let has_trigger = activity.field(ActivityField::Trigger).is_some();
            return TimingFactKind::MissingPeriod { of, activity: name, priority, has_trigger };
        }
        let free = self.free_priority(activity);
        let period = PERIODS.into_iter().find_map(|it| activity.field(it)).map(|period| period.name.id);
        TimingFactKind::MissingPriority { of, activity: name, free, period }
    }

    fn deadline(&mut self, found: &mut ResolvedActivity<'db>, fields: &WrittenFields<'_>) {
        let Some(written) = fields.written.get(&ActivityField::Deadline) else {
            found.task.deadline = found.period;
            return;
        };
        let Some(deadline) = found.deadline else {
            if found.refusals.is_empty() {
                found.refuse(Reason::UnusableField(ActivityField::Deadline), found.at.clone());
            }
            return;
        };
        let of_period = PERIODS.into_iter().find_map(|it| fields.written.get(&it));
        if let Some((of_period, period)) = of_period.zip(found.period)
            && deadline > period
            && found.refusals.is_empty()
        {
            let (at, period_at) = (self.at(written.value_id), self.at(of_period.value_id));
            let written =
                number(&of_period.value).filter(|_| of_period.name.name == ActivityField::Period.keyword());
            let written = written.cloned().unwrap_or_else(|| period.number().into());
            self.report(at, TimingFactKind::DeadlineExceedsPeriod { deadline, period, written, period_at });
        }
    }

    /// Reports fields that exclude each other, and fields that only a trigger gives a meaning.
    fn conflicts(&mut self, found: &mut ResolvedActivity<'db>, fields: &WrittenFields<'_>) {
        let mut reported: FxHashSet<ActivityField> = FxHashSet::default();
        for pair in EXCLUSIVE_FIELDS {
            let [Some(one), Some(other)] = pair.map(|it| fields.written.get(&it)) else { continue };
            let is_in_order = one.name.id < other.name.id;
            let [first, second] = if is_in_order { [one, other] } else { [other, one] };
            let [other, field] = if is_in_order { pair } else { [pair[1], pair[0]] };
            found.refuse(Reason::UnusableField(field), self.at(second.name.id));
            pair.into_iter().for_each(|it| found.forget(it));
            if pair.iter().all(|it| !reported.contains(it)) {
                let (of, id, first) = (self.of, second.name.id, self.at(first.name.id));
                self.report(self.at(id), TimingFactKind::ConflictingFields { of, id, field, other, first });
            }
            reported.extend(pair);
        }
        for [field, other] in DEPENDENT_FIELDS {
            let Some(written) = fields.written.get(&field) else { continue };
            if fields.written.contains_key(&other) {
                continue;
            }
            let (of, id) = (self.of, written.name.id);
            found.refuse(Reason::UnusableField(field), self.at(id));
            found.forget(field);
            // An unknown field may be the other one.
            if !fields.has_unknown && reported.insert(field) {
                self.report(self.at(id), TimingFactKind::FieldWithoutOther { of, id, field });
            }
        }
    }

    /// Enters the priority and the CPUs of a thread of `[platform] threads`, and the period that a control loop gives. Returns the thread, if the
    /// activity names one: then it has no fields for them, but those of a what-if question, which are at its name.
    fn declared_thread(
        &mut self,
        found: &mut ResolvedActivity<'db>,
        activity: &Activity,
        fields: &WrittenFields<'_>,
    ) -> Option<Option<&'db DeclaredThread>> {
        let written = fields.written.get(&ActivityField::Thread)?;
        let id = declared_id(written)?;
        let all = declared_threads(self.db, self.project.workspace(self.db));
        let index = all.find(&id);
        let Some((index, thread)) = index.and_then(|it| Some((it, all.all.get(it)?))) else {
            (found.task.priority, found.task.cpus) = (Priority::Unknown, None);
            found.thread_name = Some(id.clone());
            let at = self.at(written.value_id);
            found.refuse(Reason::UnusableField(ActivityField::Thread), at.clone());
            if all.fault.is_none() {
                let near = similar(&id, all.all.iter().map(|it| &it.id));
                let unknown = InvalidValue::UnknownThread(id, near);
                self.report(at, TimingFactKind::InvalidField(ActivityField::Thread, unknown));
            }
            return Some(None);
        };
        self.covered.entry(index).or_default().push(id.clone());
        // An id has the periods of its timers, which are the same on the robot.
        let timers = id.split('@').skip(1).filter_map(timer_period).filter(|it| *it > 0);
        let timers = timers.min().map(Time::from_nanos).filter(|_| thread.is_group());
        if !fields.written.contains_key(&ActivityField::Order) {
            found.task.order = Order::Any;
        }
        if let Some(trigger) = found.trigger.as_mut().filter(|it| thread.is_group() && it.needs == Needs::Any)
        {
            trigger.needs = Needs::Each;
        }
        found.thread_name = Some(thread.name_for(id));
        found.declared_thread = Some((index, written.value_id));
        for field in [ActivityField::Priority].into_iter().chain(PLACES) {
            let own = fields.written.get(&field).filter(|it| it.name.id != activity.name.id);
            if let Some(own) = own {
                found.refuse(Reason::UnusableField(field), self.at(own.value_id));
                self.report(
                    self.at(own.value_id),
                    TimingFactKind::InvalidField(field, InvalidValue::OfThread),
                );
            }
        }
        if !fields.written.contains_key(&ActivityField::Priority) {
            found.task.priority = thread.priority;
            if let Some(doubt) = &thread.doubt {
                found.refuse(Reason::Thread(doubt.clone()), found.at.clone());
            }
        }
        if PLACES.iter().all(|it| !fields.written.contains_key(it)) {
            found.task.cpus = Some(thread.cpus);
        }
        found.task.jitter = found.task.jitter.max(thread.jitter);
        // A shorter period is safe.
        let of_period = PERIODS.into_iter().find_map(|it| fields.written.get(&it));
        let timers = timers.filter(|_| found.trigger.is_none());
        if let Some(period) = thread.period.or(timers).filter(|of| found.period.is_none_or(|it| it > *of)) {
            if let Some(written) = of_period {
                found.refuse(Reason::UnusableField(ActivityField::Period), self.at(written.value_id));
                let longer = InvalidValue::AbovePeriod(period);
                self.report(
                    self.at(written.value_id),
                    TimingFactKind::InvalidField(ActivityField::Period, longer),
                );
            }
            found.task.period = Some(period);
        }
        Some(Some(thread))
    }

    /// Returns whether a port whose data releases an activity is an input. Another fact reports why the features of its shell are
    /// unknown.
    fn trigger(
        &mut self,
        found: &mut ResolvedActivity<'db>,
        instance: Option<&FlatInstance<'db>>,
        port: &NameRef,
    ) -> bool {
        let (db, project) = (self.db, self.project);
        let implementation = instance.and_then(|it| it.implementation(db, project));
        let shell = implementation.and_then(|it| it.shell.as_ref());
        let kind = shell.and_then(|(_, features)| features.get(&port.name)).map(|it| it.kind);
        if kind == Some(FeatureKind::Input) {
            return true;
        }
        let at = self.at(port.id);
        found.refuse(Reason::UnusableField(ActivityField::Trigger), at.clone());
        if let Some((shell, features)) = shell
            && (features.completeness & features.value_completeness).is_complete()
        {
            let is_input = |it: &[FeatureOf<'db>]| it.iter().any(|it| it.kind == FeatureKind::Input);
            let inputs = features.by_name.iter().filter(|(_, found)| is_input(found)).map(|(name, _)| name);
            let near = similar(&port.name, inputs);
            let wrong = InvalidValue::NoInputPort(port.name.clone(), shell.name(db).clone(), near);
            self.report(at, TimingFactKind::InvalidField(ActivityField::Trigger, wrong));
        }
        false
    }

    /// Resolves the name of a CPU set.
    fn cpu_set(&mut self, found: &mut ResolvedActivity<'db>, fields: &mut WrittenFields<'_>, set: &NameRef) {
        let platform = platform_of(self.db, self.project.workspace(self.db));
        found.task.cpus = platform.cpu_sets.get(&set.name).copied();
        if found.cpus.is_some() {
            return;
        }
        // The value may be that of another field.
        fields.has_misplaced = true;
        found.refuse(Reason::UnusableField(ActivityField::Cpus), self.at(set.id));
        if platform.is_complete {
            let near = similar(&set.name, platform.cpu_sets.keys());
            let unknown = InvalidValue::UnknownCpuSet(set.name.clone(), near);
            self.report(self.at(set.id), TimingFactKind::InvalidField(ActivityField::Cpus, unknown));
        }
    }

    /// Checks the offset, and whether the clock is synchronised. An invalid configuration may lack the instance.
    fn offset(&mut self, found: &mut ResolvedActivity<'db>, activity: &Activity, fields: &WrittenFields<'_>) {
        let workspace = self.project.workspace(self.db);
        let platform = platform_of(self.db, workspace);
        let Some(written) = fields.written.get(&ActivityField::Offset) else { return };
        if let Some((offset, period)) = found.written_offset.zip(found.period)
            && offset >= period
        {
            found.written_offset = None;
            let at = self.at(written.value_id);
            found.refuse(Reason::UnusableField(ActivityField::Offset), at.clone());
            self.report(
                at,
                TimingFactKind::InvalidField(ActivityField::Offset, InvalidValue::NotBelow(period)),
            );
        }
        let is_reported = found.priority == Priority::Background || !found.refusals.is_empty();
        let clock = |of: &NameRef| platform.clocks.get(of.name.as_str());
        let first = activity.instances.first().and_then(clock);
        let other = activity.instances.iter().find(|it| clock(it).is_none() || clock(it) != first);
        if (other.is_some() || !found.is_exact) && !is_reported && platform.is_complete {
            let (of, id, instance) = (self.of, written.name.id, other.map(|it| it.name.clone()));
            let activity = activity.name.name.clone();
            self.report(self.at(id), TimingFactKind::NotSynchronised { of, id, activity, instance });
        }
    }

    fn field<'a>(
        &mut self,
        (found, of_instance): (&mut ResolvedActivity<'db>, Option<&FlatInstance<'db>>),
        fields: &mut WrittenFields<'a>,
        activity: &Activity,
        written: &'a Field,
    ) {
        let at = self.at(written.name.id);
        let Some(field) = ActivityField::from_keyword(&written.name.name) else {
            let name = written.name.name.clone();
            found.refuse(Reason::UnknownField(name.clone()), at.clone());
            let near = match similar_field(&name) {
                Some(ActivityField::Affinity) if written.list.is_some() => Some(ActivityField::Cpus),
                near => near,
            };
            let near = near.filter(|near| activity.field(*near).is_none());
            if near == Some(ActivityField::Preemptive) {
                found.forget(ActivityField::Preemptive);
            }
            self.report(at, TimingFactKind::UnknownField { name, near });
            fields.has_unknown = true;
            return;
        };
        let value = self.at(written.value_id);
        found.task.is_sporadic |= field == ActivityField::Trigger;
        let refusal = if let Some(first) = fields.written.insert(field, written) {
            let (of, id, instance) = (self.of, written.name.id, found.activity.clone());
            let first = self.at(first.name.id);
            let kind = TimingFactKind::DuplicateField { of, id, field, instance: instance.clone(), first };
            self.report(at.clone(), kind);
            Some((Reason::SecondField { field, instance }, at))
        } else {
            // A half-typed value is a syntax error, which another diagnostic reports.
            let is_damaged = written.value == Expr::Missing && written.list.is_none();
            is_damaged.then(|| (Reason::DamagedField(field), value.clone()))
        };
        if let Some((reason, at)) = refusal {
            found.refuse(reason, at);
            found.forget(field);
            return;
        }
        match field_entry(field).kind.read(written) {
            Ok(FieldValue::Ports(mut ports, needs)) => {
                ports.retain(|port| self.trigger(found, of_instance, port));
                // The refusal of a port is enough.
                let ports: Vec<Name> = ports.into_iter().map(|port| port.name).collect();
                let sources = vec![None; ports.len()];
                found.trigger = Some(Trigger { ports, needs, sources }).filter(|it| !it.ports.is_empty());
            }
            Ok(FieldValue::CpuSet(set)) => self.cpu_set(found, fields, &set),
            Ok(read) => found.set(field, &read),
            Err(why) => {
                fields.has_misplaced |= field == ActivityField::Priority || PLACES.contains(&field);
                if field == ActivityField::Preemptive {
                    found.forget(field);
                }
                found.refuse(Reason::UnusableField(field), value.clone());
                self.report(value, TimingFactKind::InvalidField(field, why));
            }
        }
    }

    /// A priority below those of all other activities that may run where `activity` does; the lowest that none of them has, where
    /// one has 1 already.
    fn free_priority(&self, activity: &Activity) -> u32 {
        let platform = platform_of(self.db, self.project.workspace(self.db));
        let written = |of: &Activity| platform.cpus_of(of).map(|(_, cpus)| cpus);
        let cpus = |of: &Activity| written(of).filter(|cpus| !cpus.is_empty()).unwrap_or(CpuSet::ALL);
        let others = deployment(self.db, self.of).into_iter().flat_map(|data| &data.activities);
        let others = others.filter(|other| cpus(other).meets(cpus(activity)));
        let priority = |of: &Arc<Activity>| {
            let field = ActivityField::Priority;
            match field_entry(field).kind.read(of.field(field)?) {
                Ok(FieldValue::Priority(priority)) => Some(priority),
                _ => None,
            }
        };
        let taken: FxHashSet<u32> = others.filter_map(priority).collect();
        let below = taken.iter().min().map_or(1, |least| least.saturating_sub(1)).min(99);
        (below.max(1)..=99).find(|priority| !taken.contains(priority)).unwrap_or(1)
    }

    /// Enters the threads that execute several activities. Refuses activities of one thread that it could not execute.
    fn threads(&mut self, data: &Deployment) {
        let mut threads: BTreeMap<Name, Vec<usize>> = BTreeMap::new();
        for (index, activity) in self.found.activities.iter().enumerate() {
            if let (Some(name), None) = (&activity.thread_name, activity.thread) {
                threads.entry(name.clone()).or_default().push(index);
            }
        }
        for members in threads.into_values() {
            let [first, others @ ..] = members.as_slice() else { continue };
            if others.is_empty() {
                let alone = &mut self.found.activities[*first];
                (alone.task.order, alone.thread_name) = (Order::List, None);
                continue;
            }
            for index in &members {
                let task = &mut self.found.activities[*index].task;
                task.thread = u32::try_from(data.activities.len() + first).ok();
                task.order = if task.order == Order::List { Order::Fifo } else { task.order };
            }
            for other in others {
                let [one, it] = [first, other].map(|it| &self.found.activities[*it].task);
                let differing = [
                    (ActivityField::Order, one.order != it.order),
                    (ActivityField::Priority, one.priority != it.priority),
                    (ActivityField::Cpus, one.cpus != it.cpus),
                    (ActivityField::Preemptive, one.is_not_preempted != it.is_not_preempted),
                ];
                if let Some((field, _)) = differing.into_iter().find(|(_, differs)| *differs) {
                    self.other_in_thread(data, [*first, *other], field);
                }
            }
        }
    }

    /// Refuses two activities of a thread, with different values of a field.
    fn other_in_thread(&mut self, data: &Deployment, indices: [usize; 2], field: ActivityField) {
        let [first, other] = indices.map(|it| &self.found.activities[it]);
        let is_known = first.refusals.is_empty() && other.refusals.is_empty();
        let (first_at, thread) = (first.at.clone(), other.thread_name.clone().unwrap_or_default());
        let written = data.activities.iter().find(|it| it.executes(&other.instance));
        let written = written.and_then(|of| same_fields(&field).iter().find_map(|it| of.field(*it)));
        let at = written.map_or(other.at.clone(), |it| self.at(it.value_id));
        for index in indices {
            let activity = &mut self.found.activities[index];
            activity.refuse(Reason::UnusableField(ActivityField::Thread), activity.at.clone());
        }
        if is_known {
            self.report(at, TimingFactKind::OtherInThread { thread, field, first: first_at });
        }
    }

    /// Enters the connected operations. Refuses the activities that may also provide an operation whose connection is unknown.
    fn served(&mut self, serving: &Serving) {
        let mut numbers: FxHashMap<Name, usize> = FxHashMap::default();
        for (number, resolved) in self.found.activities.iter_mut().enumerate() {
            numbers.entry(resolved.instance.clone()).or_insert(number);
            let may_provide = resolved.component.is_some() && serving.providing.contains(&resolved.instance);
            if serving.may_serve && may_provide {
                resolved.refuse(Reason::MayServe, resolved.at.clone());
            }
        }
        self.found.connected = serving
            .connected
            .iter()
            .filter_map(|((provider, operation), (client, required))| {
                Some(Connected {
                    provider: *numbers.get(provider)?,
                    operation: operation.clone(),
                    client: *numbers.get(client)?,
                    required: required.clone(),
                })
            })
            .collect();
    }

    /// Enters what writes the ports whose data releases activities.
    fn trigger_sources(&mut self, target: Decl<'db>) {
        let (db, project) = (self.db, self.project);
        let (flat, ros2) = (flat_of(db, project, target), ros2_of(db, project, self.of));
        if !flat.refusals.is_empty() || flat.link_completeness.is_incomplete() {
            return;
        }
        let numbers: FxHashMap<Name, usize> =
            self.found.activities.iter().map(|it| it.instance.clone()).zip(0..).collect();
        for activity in self.found.activities.iter_mut() {
            let Some(trigger) = &mut activity.trigger else { continue };
            let of_port = |port: &Name| {
                let is_it = |end: &(Name, Name)| end.0 == activity.instance && end.1 == *port;
                let links = flat.links.iter().filter(|link| !link.operation && is_it(&link.target));
                let mut links = links.filter(|link| ros2.across(link).is_none()).peekable();
                let topic = ros2.topic(&activity.instance, port);
                if links.peek().is_none() && topic.is_none() {
                    return None;
                }
                let of_link = |link: &Link<'db>| {
                    let activity = *numbers.get(&link.source.0).filter(|_| link.buffer.is_none())?;
                    Some(TriggerSource { activity, port: Some(link.source.1.clone()) })
                };
                let of_topic = |topic: &Topic| {
                    let activity = *numbers.get(&ros2.gateway(topic.host)).filter(|_| topic.depth <= 1)?;
                    Some(TriggerSource { activity, port: None })
                };
                links.map(of_link).chain(topic.map(of_topic)).collect()
            };
            trigger.sources = trigger.ports.iter().map(of_port).collect();
        }
    }

    /// Adds the gateway of each host that has topics. Its CPUs are checked like those of an activity.
    fn gateways(&mut self) {
        let (db, project, of) = (self.db, self.project, self.of);
        let found = ros2_of(db, project, of);
        let Some((written, at)) = gateway_of(db, project.workspace(db)).as_ref() else { return };
        if let Some(host) = self.hosts.all.iter().find(|it| it.cpus.is_empty()) {
            self.not_analysed(Reason::CpusOfHost(host.name.clone()), at.clone());
        }
        let hosts: BTreeSet<usize> = found.topics.iter().map(|it| it.host).collect();
        for host in hosts {
            let mut resolved = self.resolved(&found.gateway(host), at.clone(), None);
            resolved.component_name = "gateway".into();
            resolved.gateway = Some(Gateway { deployment: of, host });
            resolved.host = Some(host).filter(|it| *it < self.hosts.all.len());
            resolved.tables = tables_of_host(db, project, of, resolved.host);
            resolved.task.cpus = Some(written.cpus.as_ref().map_or(CpuSet::NONE, |(cpus, _)| *cpus));
            (resolved.task.period, resolved.task.deadline) = (written.period, written.period);
            match written.priority {
                Some(priority) => resolved.task.priority = Priority::RealTime(priority),
                None => {
                    resolved.task.priority = Priority::Unknown;
                    resolved.refuse(Reason::NoField(ActivityField::Priority), at.clone());
                }
            }
            if written.period.is_none() {
                resolved.refuse(Reason::NoField(ActivityField::Period), at.clone());
            }
            self.found.activities.push(resolved);
        }
    }

    /// Returns the threads that no activity has, unless `[[platform.other]]` says how much they execute. Those of the middleware have a
    /// priority one less than the gateway, on its CPUs. Those of `[platform] threads` count if an activity has one of these.
    fn undeclared(&mut self, others: &[Task]) -> Vec<Undeclared<'db>> {
        let hosts = self.hosts;
        let is_declared = |name: &str, priority: Option<u32>, cpus: CpuSet| {
            let is_it = |it: &&Task| *it.name == *name && it.priority.real_time() >= priority;
            let declared: CpuSet = others.iter().filter(is_it).filter_map(|it| it.cpus).collect();
            priority.is_some() && (cpus - declared).is_empty()
        };
        let (mut found, mut of_timers) = (Vec::new(), Vec::new());
        for gateway in self.found.activities.iter().filter(|it| it.gateway.is_some()) {
            let Some(own) = gateway.priority.real_time() else { continue };
            let (priority, cpus) = (own.saturating_sub(1), gateway.cpus.unwrap_or(CpuSet::ALL));
            if !is_declared(&hosts.on(gateway.host, "recv"), Some(priority), cpus) {
                let reason = Reason::Middleware(priority);
                found.push(Undeclared { priority: Some(priority), cpus, reason, fact: None });
            }
        }
        let on_hosts =
            || (0..hosts.all.len().max(1)).map(|host| Some(host).filter(|_| !hosts.all.is_empty()));
        let declared = declared_threads(self.db, self.project.workspace(self.db)).all.iter().enumerate();
        for (index, thread) in declared.filter(|_| !self.covered.is_empty()) {
            if thread.priority == Priority::Background {
                continue;
            }
            // The whole thread, or timers of it.
            let lacking: Vec<Option<Name>> = match self.covered.get(&index) {
                Some(covered) => {
                    let (timers, others) = callbacks_without_activity(thread, covered);
                    self.found.never_executed.extend(others);
                    let controllers = self.controllers_without_codel(index, thread);
                    timers.into_iter().chain(controllers).map(Some).collect()
                }
                None => vec![None],
            };
            let priority = thread.priority.real_time();
            for (timer, host) in lacking.iter().flat_map(|timer| on_hosts().map(move |host| (timer, host))) {
                let cpus =
                    if thread.cpus.is_empty() { self.found.cpus } else { hosts.numbered(host, thread.cpus) };
                if timer.is_some() || !is_declared(&hosts.on(host, &thread.id), priority, cpus) {
                    let (id, timer, is_timer) = (thread.id.clone(), timer.clone(), timer.is_some());
                    let reason =
                        ThreadReason::NoActivity { id: id.clone(), timer: timer.clone(), file: thread.file };
                    // A repeated id is another mistake.
                    let at = place_of_thread(self.db, thread);
                    let at = at.filter(|_| thread.doubt != Some(ThreadReason::Repeated));
                    let (of, has_priority) = (self.of, priority.is_some());
                    let fact = TimingFactKind::ThreadWithoutActivity { of, id, timer, has_priority };
                    let fact = at.map(|at| TimingFact::new(at, fact));
                    let into = if is_timer { &mut of_timers } else { &mut found };
                    into.push(Undeclared { priority, cpus, reason: Reason::Thread(reason), fact });
                }
            }
        }
        // The first one is the reason: a whole thread rather than a timer.
        found.extend(of_timers);
        found
    }

    /// Returns the codels that the component of a control loop does not have, although its file has their controllers. A component where
    /// none has the name that `mauve import` gives it may have any.
    fn controllers_without_codel(&self, index: usize, thread: &DeclaredThread) -> Vec<Name> {
        let ThreadPlace::Manager(manager) = thread.place else { return Vec::new() };
        let Some(manager) = threads_in(self.db, thread.file).controllers.managers.get(manager) else {
            return Vec::new();
        };
        let is_loop = |it: &&ResolvedActivity<'_>| it.declared_thread.is_some_and(|it| it.0 == index);
        let components = self.found.activities.iter().filter(is_loop).filter_map(|it| it.component);
        let codels = components.filter_map(|it| codels_of(self.db, self.project, it).as_deref()).flatten();
        let known: FxHashSet<&Name> = codels.map(|it| it.name(self.db)).collect();
        let in_loop = manager.controllers.iter().filter(|it| !it.has_thread());
        let all: Vec<Name> = in_loop
            .map(|it| ros2_identifier(&format!("{}/{}_update", manager.namespace(), it.name)).into())
            .collect();
        let are_named = all.iter().any(|it| known.contains(it));
        all.into_iter().filter(|it| are_named && !known.contains(it)).collect()
    }

    /// Refuses the activities that threads without an activity delay, and those of `SCHED_RR` that take turns.
    fn below_undeclared(&mut self) {
        let others = others_of(self.db, self.project.workspace(self.db), self.found.cpus);
        let threads = self.undeclared(&others);
        for activity in self.found.activities.iter_mut().filter(|it| it.gateway.is_none()) {
            let cpus = activity.cpus.unwrap_or(CpuSet::ALL);
            let own = activity.priority;
            let is_delayed = |it: &Undeclared<'db>| {
                let is_below = own.real_time().is_none_or(|own| it.priority.is_none_or(|of| own <= of));
                is_below && own != Priority::Background && cpus.meets(it.cpus)
            };
            if let Some(first) = threads.iter().find(|it| is_delayed(it)) {
                activity.refuse(first.reason.clone(), activity.at.clone());
            }
        }
        let mut facts: Vec<TimingFact<'db>> = Vec::new();
        for thread in threads {
            // A thread has one on each host.
            facts.extend(thread.fact.filter(|it| !facts.contains(it)));
        }
        self.found.facts.extend(facts);
        for (index, priority) in self.taking_turns(&others) {
            let activity = &mut self.found.activities[index];
            let at = activity.at.clone();
            activity.refuse(Reason::Thread(ThreadReason::SharedRoundRobin(priority)), at);
        }
    }

    /// Returns the activities of `SCHED_RR` that take turns with another thread of their priority: the slices are not analysed.
    fn taking_turns(&self, others: &[Task]) -> Vec<(usize, u32)> {
        let all = &self.found.activities;
        let mut found = Vec::new();
        for (index, activity) in all.iter().enumerate() {
            let thread = self.thread_of(activity).filter(|it| it.is_round_robin);
            let (Some(thread), Some(priority)) = (thread, activity.priority.real_time()) else { continue };
            let shares = |it: &Task| {
                let meets = it.cpus.unwrap_or(CpuSet::ALL).meets(activity.cpus.unwrap_or(CpuSet::ALL));
                it.priority == activity.priority && meets
            };
            let index_of = |it: &ResolvedActivity<'db>| it.declared_thread.map(|(index, _)| index);
            let is_other = |it: &&ResolvedActivity<'db>| index_of(it) != index_of(activity);
            if thread.is_wildcard()
                || all.iter().filter(is_other).any(|it| shares(it))
                || others.iter().any(shares)
            {
                found.push((index, priority));
            }
        }
        found
    }

    fn thread_of(&self, activity: &ResolvedActivity<'db>) -> Option<&'db DeclaredThread> {
        let (index, _) = activity.declared_thread?;
        declared_threads(self.db, self.project.workspace(self.db)).all.get(index)
    }

    fn cpus(&mut self, entries: &[ActivityEntry<'_>]) {
        let platform = platform_of(self.db, self.project.workspace(self.db));
        let named: CpuSet = self.found.activities.iter().filter_map(|it| it.cpus).collect();
        // An unreadable affinity may name one more CPU. An activity that may run there too is not delayed more than without it.
        let all = match platform.cpus {
            _ if !self.hosts.all.is_empty() => self.hosts.all.iter().map(|it| it.cpus).collect(),
            Some(cpus) => CpuSet::first_few(cpus),
            None if named.is_empty() => CpuSet::of(0),
            None => named,
        };
        self.found.cpus = all;
        for (index, resolved) in self.found.activities.iter_mut().enumerate() {
            let activity = entries.get(index).map(|it| it.activity);
            // The instances of one thread have one clock.
            let clocks = activity.into_iter().flat_map(|it| &it.instances);
            let clocks: BTreeSet<Option<&u32>> =
                clocks.map(|it| platform.clocks.get(it.name.as_str())).collect();
            let clock = clocks.first().copied().flatten().filter(|_| clocks.len() == 1);
            resolved.task.clock = clock.copied().unwrap_or_default();
            // What synchronises clocks of several hosts moves releases. Nothing else compares times of two hosts.
            let mates = || platform.clocks.iter().filter(|(_, it)| Some(*it) == clock);
            let is_across = || mates().any(|(name, _)| self.hosts.of(name) != resolved.host);
            if let Some(drift) = platform.ptp.filter(|_| is_across()) {
                resolved.task.jitter = resolved.task.jitter.checked_add(drift).unwrap_or(drift);
            }
            let is_released = clock.is_some() && resolved.is_exact && !resolved.is_sporadic;
            let is_released = is_released && resolved.priority != Priority::Background;
            resolved.task.offset = is_released.then(|| resolved.written_offset.unwrap_or_default());
            let Some(named) = resolved.cpus else { continue };
            let of_host = resolved.host.and_then(|it| self.hosts.all.get(it)).map_or(all, |it| it.cpus);
            let cpus = if named.is_empty() { of_host } else { self.hosts.numbered(resolved.host, named) };
            resolved.task.cpus = Some(cpus);
            let at = resolved.at.clone();
            let of_thread = activity.into_iter().flat_map(|it| &it.instances);
            if of_thread.map(|it| self.hosts.of(&it.name)).any(|it| it != resolved.host) {
                resolved.refuse(Reason::SeveralHosts, at.clone());
            }
            if resolved.host.is_none() && !self.hosts.all.is_empty() {
                resolved.refuse(Reason::NoHost, at);
                resolved.forget_priority(UnknownPriority::NoHost);
                continue;
            }
            if resolved.priority == Priority::Background {
                continue;
            }
            if of_host.is_empty() {
                // It is the reason of all.
                resolved.forget_priority(UnknownPriority::NoHost);
            } else if cpus.len() < named.len() {
                resolved.refuse(Reason::NoCpuOfHost, at);
                resolved.forget_priority(UnknownPriority::NoSuchCpu);
            } else if !(cpus - all).is_empty() {
                let missing = NoSuchCpu { named: cpus, available: all };
                let affinity = activity.and_then(|of| PLACES.into_iter().find_map(|it| of.field(it)));
                let value = affinity.map_or(at.clone(), |it| Location::Source(self.of, it.value_id));
                self.found.facts.push(TimingFact::new(value, TimingFactKind::NoSuchCpu(missing)));
                resolved.refuse(Reason::NoSuchCpu(missing), at);
                // The value may be a mistyped affinity, or that of another field.
                resolved.forget_priority(UnknownPriority::NoSuchCpu);
            }
        }
    }
}

/// A thread that no activity has, and that may delay others.
struct Undeclared<'db> {
    /// None for one above all.
    priority: Option<u32>,
    cpus: CpuSet,
    reason: Reason<'db>,
    /// What is reported in its file.
    fact: Option<TimingFact<'db>>,
}

/// Returns the timers of a thread that are not `covered`, which execute all the same, and what is assumed to be never executed: its other
/// callbacks, and other groups of its entry.
fn callbacks_without_activity(
    thread: &DeclaredThread,
    covered: &[Name],
) -> (Vec<Name>, Vec<(Name, Option<Name>)>) {
    let (mut timers, mut others) = (Vec::new(), Vec::new());
    if thread.is_wildcard() {
        others.push((thread.id.clone(), None));
    }
    let mut covered: Vec<&str> = covered.iter().flat_map(|id| id.split('@').skip(1)).collect();
    for callback in thread.callbacks() {
        // Of two timers of one period, each needs an activity.
        match covered.iter().position(|it| *it == callback) {
            Some(index) => _ = covered.swap_remove(index),
            None if timer_period(callback).is_some() => timers.push(callback.into()),
            None => others.push((thread.id.clone(), Some(callback.into()))),
        }
    }
    (timers, others)
}

/// Returns the real-time work that is not in the model. Without CPUs, it may run on `all`. Without a host, each has it.
pub(crate) fn others_of(db: &dyn ModelDb, workspace: Workspace, all: CpuSet) -> Vec<Task> {
    let (platform, hosts) = (platform_of(db, workspace), hosts_of(db, workspace));
    let on = |host: Option<usize>| {
        let name = host.and_then(|it| Some(&hosts.all.get(it)?.name));
        let of_host = platform.others.iter().filter(move |(_, only)| only.is_none() || only.as_ref() == name);
        of_host.map(move |(it, _)| Task {
            name: hosts.on(host, &it.name).into(),
            cpus: Some(match (host, it.cpus) {
                (None, cpus) => cpus.unwrap_or(all),
                (host, cpus) => hosts.numbered(host, cpus.unwrap_or(CpuSet::ALL)),
            }),
            ..it.clone()
        })
    };
    match hosts.all.len() {
        0 => on(None).collect(),
        hosts => {
            (0..hosts).flat_map(|host| on(Some(host))).filter(|it| it.cpus != Some(CpuSet::NONE)).collect()
        }
    }
}

/// An instance that an activity executes.
struct ActivityEntry<'a> {
    activity: &'a Activity,
    /// None where its list names none.
    instance: Option<&'a NameRef>,
    /// Its place among the instances of the activity.
    number: usize,
    /// The number of the thread that executes several instances.
    thread: Option<u32>,
}

impl ActivityEntry<'_> {
    fn is_list(&self) -> bool {
        self.activity.field(ActivityField::Instances).is_some()
    }

    fn has_damaged_list(&self) -> bool {
        self.activity.field(ActivityField::Instances).is_some_and(|it| it.list.is_none())
    }
}

/// Returns what the activities execute, in the order of the text.
fn entries(data: &Deployment) -> Vec<ActivityEntry<'_>> {
    let mut entries = Vec::new();
    let named = data.activities.iter().filter(|it| !it.name.name.is_empty());
    for (thread, activity) in (0..).zip(named) {
        let thread = Some(thread).filter(|_| activity.instances.len() > 1);
        let none = activity.instances.is_empty().then_some(None);
        let instances = activity.instances.iter().map(Some).chain(none).enumerate();
        entries.extend(instances.map(|(number, instance)| ActivityEntry {
            activity,
            instance,
            number,
            thread,
        }));
    }
    entries
}

#[derive(Default)]
struct WrittenFields<'a> {
    /// The last field of each name.
    written: FxHashMap<ActivityField, &'a Field>,
    /// Whether an activity cannot have one of the fields: it may be a misspelt one.
    has_unknown: bool,
    /// Whether an affinity or a priority has a value that it cannot have: it may be that of another field.
    has_misplaced: bool,
}

/// Returns the first activity of each instance that a deployment has an activity for.
pub(crate) fn activities_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> FxHashMap<&'db Name, &'db Activity> {
    let all = deployment(db, of).map_or(&[] as &[Arc<Activity>], |data| &data.activities);
    let executed = |it: &'db Arc<Activity>| it.instances.iter().map(|instance| (&instance.name, &**it));
    all.iter().rev().flat_map(executed).collect()
}

pub(crate) fn written_field<'db>(
    db: &'db dyn ModelDb,
    deployment: Decl<'db>,
    instance: &Name,
    field: ActivityField,
) -> Option<&'db Field> {
    let activities = &mauve_hir::deployment(db, deployment)?.activities;
    activities.iter().find(|it| it.executes(instance))?.field(field)
}
