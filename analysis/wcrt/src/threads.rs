//! The threads of `[platform] threads`: priorities and CPUs that stand in the files of the callback-isolated executor of ROS 2, and in
//! those of ros2_control.
//!
//! An activity with `thread = "ID"` has those of its thread, so that they are written once, where the robot reads them. Every edit of
//! such a file changes the figures.

use std::ops::Range;

use mauve_hir::item_tree::{Activity, Field, Name};
use mauve_hir::ros2_files::{
    ControllersFile, DEFAULT_THREAD_PRIORITY, DEFAULT_UPDATE_RATE, FileProblem, FileProblemKind, GroupId,
    ThreadEntry, ThreadPlace, ThreadPolicy, ThreadsFile, YamlValue, read_controllers,
};
use mauve_hir::{FieldKind, FieldValue, File, Location, ModelDb, Workspace, config_file, platform_of};
use mauve_syntax::keywords::ActivityField;
use mauve_timing::{CpuSet, Priority, Time};
use rustc_hash::FxHashMap;

use crate::fact::{TimingFact, TimingFactKind};
use crate::reason::{IncompleteTable, TableFault, ThreadReason};
use crate::timetable::thread_files;

/// A file of threads: one of the two has some.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct ThreadFile {
    /// A `threads.yaml`.
    pub threads: ThreadsFile,
    /// A `controllers.yaml`.
    pub controllers: ControllersFile,
}

/// Reads a file of threads.
#[salsa::tracked(returns(ref))]
pub fn threads_in(db: &dyn ModelDb, file: File) -> ThreadFile {
    let threads = db.trees().read_threads(file, file.text(db));
    if threads.groups.is_empty() && threads.others.is_empty() {
        let controllers = read_controllers(file.text(db));
        if !controllers.managers.is_empty() {
            return ThreadFile { controllers, ..ThreadFile::default() };
        }
    }
    ThreadFile { threads, ..ThreadFile::default() }
}

impl ThreadFile {
    fn problems(&self) -> impl Iterator<Item = &FileProblem> {
        self.threads.problems.iter().chain(&self.controllers.problems)
    }

    /// Returns the place of a thread: its whole entry, and what says which it is. For a control loop, that is its rate.
    pub fn ranges(&self, place: ThreadPlace) -> Option<[&Range<usize>; 2]> {
        let managers = &self.controllers.managers;
        let entry = match place {
            ThreadPlace::Group(index) => self.threads.groups.get(index)?,
            ThreadPlace::Other(index) => self.threads.others.get(index)?,
            ThreadPlace::Manager(index) => {
                let it = managers.get(index)?;
                return Some([&it.range, it.update_rate.range().unwrap_or(&it.range)]);
            }
            ThreadPlace::Controller(manager, index) => {
                let it = managers.get(manager)?.controllers.get(index)?;
                return Some([it.parameters.as_ref().unwrap_or(&it.name_range), &it.name_range]);
            }
        };
        Some([&entry.range, entry.id.range().unwrap_or(&entry.range)])
    }
}

/// What the files of threads say of a thread. It has no location: a comment in a file changes no figure.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct DeclaredThread {
    /// Its file.
    pub file: File,
    /// Its place in the file.
    pub place: ThreadPlace,
    /// Its id without `@Waitable`, or its name. `/ns/node/*` is that of each callback group of the node without an entry of its own.
    pub id: Name,
    /// The id, if it is one of a callback group.
    group: Option<GroupId>,
    /// Its priority: in the background with the policies that are not for real time.
    pub priority: Priority,
    /// Whether threads of its priority take turns.
    pub(crate) is_round_robin: bool,
    /// Linux's CPUs from 0, which are CPUs from 1 here; empty for any.
    pub cpus: CpuSet,
    /// The period of a control loop, or of a controller.
    pub(crate) period: Option<Time>,
    /// By how much its releases may be late.
    pub(crate) jitter: Time,
    /// Why its priority is not known.
    pub(crate) doubt: Option<ThreadReason>,
}

/// What all files of threads of a workspace say.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct DeclaredThreads {
    /// In the order of the files; of each, those of callback groups first.
    pub all: Vec<DeclaredThread>,
    by_id: FxHashMap<Name, usize>,
    /// The callback groups, in the order of their nodes.
    by_node: Vec<usize>,
    /// Why threads may be missing.
    pub(crate) fault: Option<IncompleteTable>,
    /// Whether they count on the throttling of real-time threads; none where they do not say it.
    is_throttled: Option<bool>,
}

/// Returns what the files of threads say.
///
/// ```
/// use mauve_hir::{Database, Workspace};
/// let db = Database::default();
/// let threads = "callback_groups:\n  - {id: /eye@Timer(1000000), policy: SCHED_FIFO, priority: 90, affinity: [0]}\n";
/// let files = [("/mauve.toml", "platform.threads = \"threads.yaml\""), ("/threads.yaml", threads)];
/// let files = files.map(|(path, text)| (path.into(), text.to_owned()));
/// let workspace = Workspace::of_texts(&db, "/".into(), files);
/// let found = mauve_wcrt::declared_threads(&db, workspace);
/// assert_eq!(found.all[found.find("/eye@Timer(1000000)").unwrap()].priority.real_time(), Some(90));
/// ```
#[salsa::tracked(returns(ref))]
pub fn declared_threads(db: &dyn ModelDb, workspace: Workspace) -> DeclaredThreads {
    let mut found = DeclaredThreads::default();
    let files = thread_files(db, workspace);
    if let (Some((error, _)), Some(config)) = (files.errors.first(), config_file(db, workspace)) {
        found.fault = Some(IncompleteTable { file: config, error: TableFault::Files(error.clone()) });
    }
    for &file in &files.files {
        let read = threads_in(db, file);
        let fault = faults(db, file).into_iter().next();
        found.fault = found.fault.take().or(fault.map(|(error, _)| IncompleteTable { file, error }));
        found.all.extend(of_controllers(file, &read.controllers));
        let read = &read.threads;
        if let (Some(runtime), Some(period)) =
            (read.throttling_runtime.known(), read.throttling_period.known())
        {
            let is_throttled = *runtime >= 0 && runtime < period;
            found.is_throttled = Some(is_throttled || found.is_throttled == Some(true));
        }
        let of = |place: fn(usize) -> ThreadPlace| move |(index, it)| declared(file, place(index), it);
        found.all.extend(read.groups.iter().enumerate().filter_map(of(ThreadPlace::Group)));
        found.all.extend(read.others.iter().enumerate().filter_map(of(ThreadPlace::Other)));
    }
    for index in 0..found.all.len() {
        let Some(id) = found.all.get(index).map(|it| it.id.clone()) else { continue };
        // Which of two counts is not known.
        let Some(first) = found.by_id.insert(id, index) else { continue };
        for index in [first, index] {
            let Some(thread) = found.all.get_mut(index) else { continue };
            (thread.priority, thread.doubt) = (Priority::Unknown, Some(ThreadReason::Repeated));
        }
    }
    let node = |index: &usize| found.all.get(*index)?.group.as_ref().map(GroupId::node);
    let mut by_node: Vec<usize> = (0..found.all.len()).filter(|it| node(it).is_some()).collect();
    by_node.sort_by_key(node);
    found.by_node = by_node;
    found
}

fn declared(file: File, place: ThreadPlace, entry: &ThreadEntry) -> Option<DeclaredThread> {
    let id = entry.id.known()?.as_str();
    let id = entry.group.as_ref().map_or_else(|| id.into(), |group| group.text().clone());
    let policy = entry.policy.known();
    let (priority, doubt) = match policy {
        Some(ThreadPolicy::Fifo | ThreadPolicy::RoundRobin) => {
            let level = entry.level.known().and_then(|it| u32::try_from(*it).ok());
            (level.map_or(Priority::Unknown, Priority::RealTime), None)
        }
        Some(ThreadPolicy::Other | ThreadPolicy::Batch | ThreadPolicy::Idle) => (Priority::Background, None),
        Some(ThreadPolicy::Deadline) => (Priority::Unknown, Some(ThreadReason::Deadline)),
        None => (Priority::Unknown, None),
    };
    Some(DeclaredThread {
        file,
        place,
        id,
        group: entry.group.clone(),
        priority,
        is_round_robin: policy == Some(&ThreadPolicy::RoundRobin),
        cpus: entry.affinity.known().copied().unwrap_or(CpuSet::NONE),
        period: None,
        jitter: Time::ZERO,
        doubt,
    })
}

/// Returns the control loops of a file, and the asynchronous controllers: they have threads of `SCHED_FIFO`.
///
/// A loop of R Hz, whose cycles take C = 1/R, starts a controller of r Hz in its cycles. Humble does in each k-th, with k = ⌊R/r⌋; the
/// beginnings of two cycles are at least kC − C apart. Later versions (ros2_control at 53b9999d, `controller_manager.cpp`) do when the time
/// since the last start is nearer to 1/r than in the next cycle: at least 1/r − C/2 apart, each time. Both are covered by the period
/// kC − C/2 with a jitter of C. A controller that is not slower than the loop has each cycle.
fn of_controllers(file: File, read: &ControllersFile) -> Vec<DeclaredThread> {
    let mut found = Vec::new();
    for (index, manager) in read.managers.iter().enumerate() {
        let is_uncertain = matches!(manager.update_rate, YamlValue::Unknown(_))
            || manager.controllers.iter().any(|it| matches!(it.is_async, YamlValue::Unknown(_)));
        let thread = |place, id: &str, priority: &YamlValue<u8>, cpus: &YamlValue<CpuSet>| DeclaredThread {
            file,
            place,
            id: id.into(),
            group: None,
            // What a wildcard perhaps says of the rate, the CPUs or the thread of a controller may be worse.
            priority: match priority {
                _ if is_uncertain || matches!(cpus, YamlValue::Unknown(_)) => Priority::Unknown,
                YamlValue::Unknown(_) => Priority::Unknown,
                it => Priority::RealTime(it.known().copied().unwrap_or(DEFAULT_THREAD_PRIORITY).into()),
            },
            is_round_robin: false,
            cpus: cpus.known().copied().unwrap_or(CpuSet::NONE),
            period: None,
            jitter: Time::ZERO,
            doubt: None,
        };
        let rate = manager.update_rate.known().copied().unwrap_or(DEFAULT_UPDATE_RATE).max(1);
        // Rounded down, and to an even number.
        let half_cycle = 500_000_000 / u64::from(rate);
        found.push(DeclaredThread {
            period: Some(Time::from_nanos(2 * half_cycle)),
            ..thread(ThreadPlace::Manager(index), &manager.name, &manager.thread_priority, &manager.affinity)
        });
        for (of, controller) in manager.controllers.iter().enumerate().filter(|it| it.1.has_thread()) {
            let id = format!("{}/{}", manager.namespace(), controller.name);
            let place = ThreadPlace::Controller(index, of);
            let own = controller.update_rate.known().copied().filter(|it| (1..rate).contains(it));
            let halves = own.map_or(2, |own| 2 * u64::from(rate / own) - 1);
            found.push(DeclaredThread {
                period: Some(Time::from_nanos(halves * half_cycle)),
                jitter: Time::from_nanos(2 * half_cycle),
                ..thread(place, &id, &controller.thread_priority, &controller.affinity)
            });
        }
    }
    found
}

/// Returns the id of a thread in a file that a field names, without what readers ignore.
pub(crate) fn declared_id(field: &Field) -> Option<Name> {
    match FieldKind::Thread.read(field) {
        Ok(FieldValue::DeclaredThread(id)) => {
            Some(id.parse().map_or(id, |group: GroupId| group.text().clone()))
        }
        _ => None,
    }
}

/// Returns why readers refuse a file, or read other values, and where; with other settings of the kernel than can be analysed.
fn faults(db: &dyn ModelDb, file: File) -> Vec<(TableFault, Range<usize>)> {
    let file_read = threads_in(db, file);
    let read = &file_read.threads;
    let unreadable =
        file.problem(db).as_ref().map(|it| (TableFault::Unreadable(it.message().to_owned()), 0..0));
    let problems = file_read.problems().filter(|it| it.kind.is_error());
    let problems = problems.map(|it| (TableFault::Threads(it.kind.clone()), it.range.clone()));
    let (runtime, period) = (&read.throttling_runtime, &read.throttling_period);
    let throttling = match (runtime, period.known()) {
        (YamlValue::Known { value, range }, Some(period)) => {
            let is_known = *value < 0 || value >= period || *period == 1_000_000 && *value >= 950_000;
            (!is_known).then(|| (TableFault::Throttling, range.clone()))
        }
        _ => None,
    };
    unreadable.into_iter().chain(problems).chain(throttling).collect()
}

/// Returns what is wrong in the files of threads.
pub fn thread_facts<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<TimingFact<'db>> {
    let mut found = Vec::new();
    for &file in &thread_files(db, workspace).files {
        let at = |range: &Range<usize>| Location::of_span(file, range);
        let faults = faults(db, file).into_iter();
        found.extend(
            faults.map(|(fault, range)| TimingFact::new(at(&range), TimingFactKind::InvalidTable(fault))),
        );
        let others = threads_in(db, file).problems().filter(|it| !it.kind.is_error());
        found.extend(
            others.map(|it| TimingFact::new(at(&it.range), TimingFactKind::ThreadFile(it.kind.clone()))),
        );
    }
    // In two files.
    for thread in &declared_threads(db, workspace).all {
        let repeated = FileProblemKind::RepeatedId(thread.id.to_string());
        let is_reported = || threads_in(db, thread.file).problems().any(|it| it.kind == repeated);
        if thread.doubt == Some(ThreadReason::Repeated) && !is_reported() {
            let fault = TimingFactKind::InvalidTable(TableFault::Threads(repeated));
            found.extend(place_of_thread(db, thread).map(|at| TimingFact::new(at, fault)));
        }
    }
    found
}

/// Returns the place of the id of a declared thread: there, an activity with it has its diagnostics.
pub fn place_of_thread<'db>(db: &'db dyn ModelDb, thread: &DeclaredThread) -> Option<Location<'db>> {
    let [_, id] = threads_in(db, thread.file).ranges(thread.place)?;
    Some(Location::of_span(thread.file, id))
}

/// Returns whether Linux keeps 50 ms of each second from real-time tasks, as `mauve.toml` or the files of threads say; none where neither
/// does. Where they differ, it does.
pub fn is_throttled(db: &dyn ModelDb, workspace: Workspace) -> Option<bool> {
    let of_platform = platform_of(db, workspace).rt_throttling;
    of_platform.max(declared_threads(db, workspace).is_throttled)
}

impl DeclaredThread {
    /// Returns the name of the thread of an activity that names this one by an id: those with one entry have one thread. The groups of
    /// `/ns/node/*` have one each.
    pub(crate) fn name_for(&self, id: Name) -> Name {
        if self.is_wildcard() { id } else { self.id.clone() }
    }

    /// Whether it executes the callbacks of a group.
    pub(crate) fn is_group(&self) -> bool {
        self.group.is_some()
    }

    /// Returns the callbacks of its group.
    pub(crate) fn callbacks(&self) -> impl Iterator<Item = &str> {
        self.group.iter().flat_map(GroupId::callbacks)
    }

    /// Returns whether several threads may have the entry.
    pub fn is_wildcard(&self) -> bool {
        self.group.as_ref().is_some_and(GroupId::is_wildcard)
    }
}

impl DeclaredThreads {
    /// Returns the index of the thread with this id; of a callback group, otherwise the only one of its node with all its callbacks, then that of all
    /// groups of the node.
    pub fn find(&self, id: &str) -> Option<usize> {
        if let Some(index) = self.by_id.get(id) {
            return Some(*index);
        }
        let id: GroupId = id.parse().ok()?;
        let group = |index: &usize| self.all.get(*index)?.group.as_ref();
        let node = |index: &usize| group(index).map(GroupId::node);
        let first = self.by_node.partition_point(|it| node(it) < Some(id.node()));
        let of_node = self.by_node.iter().skip(first).take_while(|it| node(it) == Some(id.node()));
        let mut having = of_node.clone().filter(|it| group(it).is_some_and(|of| of.includes(&id)));
        match (having.next(), having.next()) {
            (None, _) => of_node.clone().find(|it| group(it).is_some_and(GroupId::is_wildcard)).copied(),
            (only, None) => only.copied(),
            _ => None,
        }
    }

    /// Returns the name of the thread of an activity, if it names one.
    pub fn thread_of(&self, activity: &Activity) -> Option<Name> {
        let field = activity.field(ActivityField::Thread)?;
        let Some(id) = declared_id(field) else { return field.value.as_name().map(|it| it.name.clone()) };
        let entry = self.find(&id).and_then(|index| self.all.get(index));
        Some(entry.map_or_else(|| id.clone(), |it| it.name_for(id.clone())))
    }
}
