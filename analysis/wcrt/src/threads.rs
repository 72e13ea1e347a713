//! The threads of `[platform] threads`: priorities and CPUs that stand in the files of the callback-isolated executor of ROS 2.
//!
//! An activity with `thread = "ID"` has those of its thread, so that they are written once, where the robot reads them. Every edit of
//! such a file changes the figures.

use std::ops::Range;

use mauve_hir::item_tree::{Activity, Name};
use mauve_hir::ros2_files::{
    GroupId, ThreadEntry, ThreadPlace, ThreadPolicy, ThreadsFile, YamlValue, read_threads,
};
use mauve_hir::{
    FieldKind, FieldValue, File, Location, ModelDb, Workspace, config_file, config_of, platform_of,
};
use mauve_syntax::keywords::ActivityField;
use mauve_timing::{CpuSet, Priority};
use rustc_hash::FxHashMap;

use crate::fact::{TimingFact, TimingFactKind};
use crate::reason::{IncompleteTable, TableFault, TableFilesError, ThreadReason};
use crate::timetable::{TableFiles, files_named, observed_files, table_files};

/// Finds the files of `[platform] threads`.
#[salsa::tracked(returns(ref))]
pub fn thread_files(db: &dyn ModelDb, workspace: Workspace) -> TableFiles {
    files_named(db, workspace, config_of(db, workspace).threads.iter())
}

/// Returns the files that are read beside the models and `mauve.toml`: tables, what recordings showed, and threads; and the errors in
/// the patterns that name them.
pub fn input_files(
    db: &dyn ModelDb,
    workspace: Workspace,
) -> (impl Iterator<Item = File> + Clone, impl Iterator<Item = &(TableFilesError, Range<usize>)>) {
    let all = [table_files(db, workspace), observed_files(db, workspace), thread_files(db, workspace)];
    (all.into_iter().flat_map(|it| it.files.iter().copied()), all.into_iter().flat_map(|it| &it.errors))
}

/// Reads a file of threads.
#[salsa::tracked(returns(ref))]
pub fn threads_in(db: &dyn ModelDb, file: File) -> ThreadsFile {
    read_threads(file.text(db))
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
    /// Why its priority is not known.
    pub(crate) doubt: Option<ThreadReason>,
}

/// What all files of threads of a workspace say.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct DeclaredThreads {
    /// In the order of the files; of each, those of callback groups first.
    pub all: Vec<DeclaredThread>,
    by_id: FxHashMap<Name, usize>,
    /// The threads of each node.
    by_node: FxHashMap<Name, Vec<usize>>,
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
/// assert_eq!(found.find("/eye@Timer(1000000)").unwrap().priority.real_time(), Some(90));
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
        let Some(thread) = found.all.get(index) else { continue };
        if let Some(group) = &thread.group {
            found.by_node.entry(group.of_node().to_string().into()).or_default().push(index);
        }
        // Which of two counts is not known.
        let Some(first) = found.by_id.insert(thread.id.clone(), index) else { continue };
        for index in [first, index] {
            let Some(thread) = found.all.get_mut(index) else { continue };
            (thread.priority, thread.doubt) = (Priority::Unknown, Some(ThreadReason::Repeated));
        }
    }
    found
}

fn declared(file: File, place: ThreadPlace, entry: &ThreadEntry) -> Option<DeclaredThread> {
    let id = id_of_thread(entry.id.known()?);
    let policy = entry.policy.known();
    let (priority, doubt) = match policy {
        Some(ThreadPolicy::Fifo | ThreadPolicy::RoundRobin) => {
            (entry.priority.known().map_or(Priority::Unknown, |it| Priority::RealTime((*it).into())), None)
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
        doubt,
    })
}

/// Returns an id without what readers ignore.
pub(crate) fn id_of_thread(id: &str) -> Name {
    id.parse().map_or_else(|_| id.into(), |group: GroupId| group.to_string().into())
}

/// Returns why readers refuse a file, or read other values, and where; with other settings of the kernel than can be analysed.
fn faults(db: &dyn ModelDb, file: File) -> Vec<(TableFault, Range<usize>)> {
    let read = threads_in(db, file);
    let unreadable =
        file.problem(db).as_ref().map(|it| (TableFault::Unreadable(it.message().to_owned()), 0..0));
    let problems = read.problems.iter().filter(|it| it.kind.is_error());
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
        let others = threads_in(db, file).problems.iter().filter(|it| !it.kind.is_error());
        found.extend(
            others.map(|it| TimingFact::new(at(&it.range), TimingFactKind::ThreadFile(it.kind.clone()))),
        );
    }
    found
}

/// Returns the place of the id of a declared thread: there, an activity with it has its diagnostics.
pub fn place_of_thread<'db>(db: &'db dyn ModelDb, workspace: Workspace, id: &str) -> Option<Location<'db>> {
    let (file, place) = declared_threads(db, workspace).find(id)?.at();
    let entry = threads_in(db, file).entry(place)?;
    Some(Location::of_span(file, entry.id.range().unwrap_or(&entry.range)))
}

/// Returns whether Linux keeps 50 ms of each second from real-time tasks, as `mauve.toml` or the files of threads say; none where neither
/// does. Where they differ, it does.
pub fn is_throttled(db: &dyn ModelDb, workspace: Workspace) -> Option<bool> {
    let of_platform = platform_of(db, workspace).rt_throttling;
    of_platform.max(declared_threads(db, workspace).is_throttled)
}

impl DeclaredThread {
    /// Returns the place of the thread, in its file.
    pub fn at(&self) -> (File, ThreadPlace) {
        (self.file, self.place)
    }

    /// Returns whether several threads may have the entry.
    pub(crate) fn is_wildcard(&self) -> bool {
        self.group.as_ref().is_some_and(|it| it.is_wildcard)
    }
}

impl DeclaredThreads {
    /// Returns the thread with this id; of a callback group, otherwise the only one of its node with all its callbacks, then that of all
    /// groups of the node.
    pub fn find(&self, id: &str) -> Option<&DeclaredThread> {
        if let Some(index) = self.by_id.get(id) {
            return self.all.get(*index);
        }
        let id: GroupId = id.parse().ok()?;
        let of_node = self.by_node.get(id.of_node().to_string().as_str()).into_iter().flatten();
        let of_node = of_node.filter_map(|index| self.all.get(*index));
        let mut having = of_node.clone().filter(|it| it.group.as_ref().is_some_and(|of| of.includes(&id)));
        match (having.next(), having.next()) {
            (None, _) => of_node.clone().find(|it| it.is_wildcard()),
            (only, None) => only,
            _ => None,
        }
    }

    /// Returns the name of the thread of an activity: those that one entry names have one. The groups of `/ns/node/*` have one each.
    pub fn thread_of(&self, activity: &Activity) -> Option<Name> {
        match FieldKind::Thread.read(activity.field(ActivityField::Thread)?).ok()? {
            FieldValue::DeclaredThread(id) => {
                let id = id_of_thread(&id);
                let entry = self.find(&id).filter(|it| !it.is_wildcard());
                Some(entry.map_or(id, |it| it.id.clone()))
            }
            FieldValue::Thread(name) => Some(name),
            _ => None,
        }
    }
}
