//! The locks of `mauve.toml`: which activities take them, and for how long.

use std::collections::BTreeSet;
use std::ops::Range;

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Decl, File, Location, ModelDb, Project, all_roots, config_file, config_of, names_of, platform_of, similar,
};
use mauve_timing::{Blocking, CpuSet, Level, Lock, LockUser, Priority, Protocol, Time};
use rustc_hash::FxHashMap;

use crate::fact::{Recorded, TimingFact, TimingFactKind};
use crate::psm::{OtherTimes, codels_of};
use crate::reason::{LockReason, Reason, Refusal, Timed};
use crate::system::{ResolvedActivity, System};
use crate::timetable::{Lookup, Timetable, observed_files, observed_in, timetable_of};

/// A lock of `mauve.toml`, with the codels that its keys name.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct DeclaredLock<'db> {
    /// Its name.
    pub name: Name,
    /// Its protocol.
    pub protocol: Protocol,
    /// For how long a codel holds it; if absent, for its whole time.
    pub held: Option<Time>,
    /// The codels that take it.
    pub codels: Vec<Decl<'db>>,
}

/// The locks of `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct DeclaredLocks<'db> {
    /// In the order of the text.
    pub all: Vec<DeclaredLock<'db>>,
    /// The lock and the key of a codel that is unknown: any codel may take that lock.
    pub unknown: Option<(Name, String)>,
    /// The codels that take a lock, as recordings showed, without a section that declares it.
    pub undeclared: Vec<(Decl<'db>, Name)>,
    /// The errors.
    pub facts: Vec<TimingFact<'db>>,
    /// The indices of the locks that a codel takes.
    of_codels: FxHashMap<Decl<'db>, Vec<usize>>,
}

impl<'db> DeclaredLocks<'db> {
    /// Returns the locks that a codel takes, each with its index.
    fn of_codel(&self, codel: Decl<'db>) -> impl Iterator<Item = (usize, &DeclaredLock<'db>)> {
        let indices = self.of_codels.get(&codel).into_iter().flatten();
        indices.filter_map(|index| Some((*index, self.all.get(*index)?)))
    }
}

/// Returns the locks of the configuration, as they are in a project.
#[salsa::tracked(returns(ref))]
pub fn declared_locks<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> DeclaredLocks<'db> {
    let workspace = project.workspace(db);
    let config = config_of(db, workspace);
    let mut found = DeclaredLocks::default();
    let names = names_of(db, project);
    for lock in &config.locks {
        let Some(protocol) = lock.protocol else { continue };
        let mut codels = Vec::new();
        for (key, span) in &lock.codels {
            codels.extend_from_slice(names.by_key(Kind::Codel, key));
            if let Some(fact) = unknown_codel(db, project, Some(&lock.name), (key, span)) {
                found.unknown.get_or_insert_with(|| (lock.name.as_str().into(), key.clone()));
                found.facts.extend(fact);
            }
        }
        codels.sort_by_cached_key(|codel| codel.qualified(db));
        codels.dedup();
        for codel in &codels {
            found.of_codels.entry(*codel).or_default().push(found.all.len());
        }
        let (name, held) = (lock.name.as_str().into(), lock.held);
        found.all.push(DeclaredLock { name, protocol, held, codels });
    }
    for &file in &observed_files(db, workspace).files {
        compare(db, project, file, &mut found);
    }
    found
}

/// Returns, for a key of a lock or of `[timing] dependent` that names no codel of any project, the error, unless what is missing may
/// declare the codel, which is an error of its own.
pub(crate) fn unknown_codel<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    lock: Option<&str>,
    (key, span): (&str, &Range<usize>),
) -> Option<Option<TimingFact<'db>>> {
    let (workspace, names) = (project.workspace(db), names_of(db, project));
    let projects = all_roots(db, workspace).iter().map(|&root| Project::new(db, workspace, root));
    let is_in = |it| !names_of(db, it).by_key(Kind::Codel, key).is_empty();
    if [project].into_iter().chain(projects).any(is_in) {
        return None;
    }
    if names.may_declare(Kind::Codel, key) {
        return Some(None);
    }
    let known = names.all.iter().filter(|decl| decl.kind(db) == Kind::Codel).take(500);
    let known: Vec<Name> = known.map(|decl| decl.qualified(db).into()).collect();
    let near = similar(key, &known);
    let (lock, codel) = (lock.map(Name::from), key.to_owned());
    let at = |file| Location::of_span(file, span);
    let kind = TimingFactKind::UnknownConfiguredCodel { lock, codel, near };
    Some(config_file(db, workspace).map(|file| TimingFact::new(at(file), kind)))
}

/// Compares locks with what recordings showed. A lock that a codel holds for longer than `held` counts as not declared.
fn compare<'db>(db: &'db dyn ModelDb, project: Project<'db>, file: File, found: &mut DeclaredLocks<'db>) {
    for ((lock, key), times) in &observed_in(db, file).0.locks {
        let held = Time::from_nanos(times.greatest);
        for &codel in names_of(db, project).by_key(Kind::Codel, key) {
            let declared = found.all.iter().find(|it| it.name == lock.as_str() && it.codels.contains(&codel));
            let declared = match declared {
                Some(declared) if declared.held.is_none_or(|declared| held <= declared) => continue,
                Some(declared) => declared.held,
                None => None,
            };
            found.undeclared.push((codel, lock.as_str().into()));
            let at = Location::of_span(file, &times.span);
            let (lock, codel) = (lock.clone(), codel.qualified(db));
            let kind = TimingFactKind::Recorded(Recorded::UndeclaredLock { lock, codel, held, declared });
            found.facts.push(TimingFact::new(at, kind));
        }
    }
}

/// The locks of a deployment at one level.
#[derive(Debug, Clone, Default)]
pub(crate) struct LocksOfDeployment<'db> {
    /// The tasks that take them are activities.
    pub(crate) all: Vec<Lock>,
    /// Why an activity, by its index, cannot be analysed.
    pub(crate) refusals: FxHashMap<usize, Vec<Refusal<'db>>>,
}

/// The activities of a host that take a lock.
#[derive(Default)]
struct LockTakers {
    /// Their indices.
    activities: Vec<usize>,
    cpus: CpuSet,
    /// The highest priority of one.
    ceiling: Option<Priority>,
    /// The first one in the background.
    in_background: Option<usize>,
}

impl LockTakers {
    fn add(&mut self, index: usize, activity: &ResolvedActivity<'_>) {
        self.activities.push(index);
        self.cpus = [self.cpus, activity.task.cpus.unwrap_or(CpuSet::ALL)].into_iter().collect();
        self.ceiling = self.ceiling.max(Some(activity.priority));
        if activity.priority == Priority::Background {
            self.in_background.get_or_insert(index);
        }
    }
}

/// Returns the locks that the activities of a deployment take. `what_if` replaces times of the tables.
pub(crate) fn locks_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    system: &System<'db>,
    level: Level,
    what_if: OtherTimes<'_, 'db>,
) -> LocksOfDeployment<'db> {
    let declared = declared_locks(db, project);
    let mut found = LocksOfDeployment::default();
    if declared.all.is_empty() && declared.unknown.is_none() && declared.undeclared.is_empty() {
        return found;
    }
    let is_throttled = platform_of(db, project.workspace(db)).rt_throttling == Some(true);
    let known_codels = |it: &ResolvedActivity<'db>| codels_of(db, project, it.component?).as_ref();
    // Each host has locks of its own. An activity whose codels are unknown may take any.
    let mut takers: FxHashMap<(usize, Option<usize>), LockTakers> = FxHashMap::default();
    for (index, activity) in system.activities.iter().enumerate().filter(|(_, it)| it.gateway.is_none()) {
        let locks: BTreeSet<usize> = match known_codels(activity) {
            Some(all) => {
                all.iter().flat_map(|codel| declared.of_codel(*codel)).map(|(lock, _)| lock).collect()
            }
            None => (0..declared.all.len()).collect(),
        };
        for lock in locks {
            takers.entry((lock, activity.host)).or_default().add(index, activity);
        }
    }
    for (index, activity) in system.activities.iter().enumerate() {
        let mut refuse = |why: LockReason| {
            let refusal = Refusal::new(Reason::Lock(why), activity.at.clone());
            found.refusals.entry(index).or_default().push(refusal);
        };
        if let Some((lock, codel)) = &declared.unknown {
            refuse(LockReason::UnknownCodel { lock: lock.clone(), codel: codel.clone() });
        }
        for codel in known_codels(activity).into_iter().flatten() {
            let its = || declared.of_codel(*codel);
            let name = || codel.qualified(db);
            for (_, lock) in declared.undeclared.iter().filter(|(it, _)| it == codel) {
                refuse(LockReason::Undeclared { codel: name(), lock: lock.clone() });
            }
            if let [(_, first), (_, second), ..] = its().collect::<Vec<_>>().as_slice() {
                let mut takers = its().filter_map(|(lock, _)| takers.get(&(lock, activity.host)));
                let woken = takers.find_map(|it| it.in_background.filter(|_| is_throttled));
                let (codel, locks) = (name(), [first.name.clone(), second.name.clone()]);
                if its().any(|(_, lock)| lock.protocol != Protocol::Ceiling) {
                    refuse(LockReason::TwoLocks { codel, locks });
                } else if let Some(woken) = woken.and_then(|it| system.activities.get(it)) {
                    refuse(LockReason::TakenWhileThrottled { codel, locks, by: woken.instance.clone() });
                }
            }
            let times = timetable_of(db, activity.tables);
            let wait = times.time(&Timed::Wait(*codel), level);
            let waits = !matches!(wait, Lookup::Absent | Lookup::Known(Time::ZERO));
            if let Some((_, lock)) = its().find(|(_, lock)| waits && lock.held.is_none()) {
                refuse(LockReason::WaitsWithLock { codel: name(), lock: lock.name.clone() });
            }
        }
    }
    let hosts: BTreeSet<Option<usize>> = system.activities.iter().map(|it| it.host).collect();
    let all = declared.all.iter().enumerate();
    for ((index, lock), host) in all.flat_map(|lock| hosts.iter().map(move |host| (lock, *host))) {
        let of_lock = |lock: usize| takers.get(&(lock, host));
        let ceiling = |lock: usize| of_lock(lock).and_then(|it| it.ceiling);
        let held = |activity: &ResolvedActivity<'db>, codel: Decl<'db>| {
            let its = || declared.of_codel(codel);
            let cpus: CpuSet = its().filter_map(|(it, _)| of_lock(it)).map(|it| it.cpus).collect();
            // A job on another CPU may have the next lock.
            let is_free = its().count() < 2 || cpus.is_one();
            let above = its().filter(|(it, _)| *it == index || ceiling(*it) >= ceiling(index));
            let above = above.map(|(_, lock)| lock);
            let held = held_by(db, above, codel, timetable_of(db, activity.tables), level, what_if);
            held.filter(|_| is_free)
        };
        let user = |&task: &usize| {
            let activity = system.activities.get(task)?;
            let its = known_codels(activity).map(|all| all.iter().filter(|it| lock.codels.contains(it)));
            let held = its.and_then(|its| {
                its.map(|codel| held(activity, *codel)).reduce(|one, other| Some(one?.max(other?)))
            });
            Some(LockUser { task, held: held.flatten() })
        };
        let users = of_lock(index).into_iter().flat_map(|it| &it.activities).filter_map(user).collect();
        found.all.push(Lock { name: lock.name.as_str().into(), protocol: lock.protocol, users });
    }
    found
}

/// Returns for how long a codel executes within these of its locks without a gap: it may take the next one before it leaves the first.
/// With inheritance or no protocol, it takes one only.
fn held_by<'a, 'db: 'a>(
    db: &'db dyn ModelDb,
    its: impl Iterator<Item = &'a DeclaredLock<'db>>,
    codel: Decl<'db>,
    times: &Timetable<'db>,
    level: Level,
    what_if: OtherTimes<'_, 'db>,
) -> Option<Time> {
    let whole = what_if(&Timed::Codel(codel)).or_else(|| times.codel_time(db, codel, level).time());
    let (mut sum, mut locks, mut has_switches) = (Time::ZERO, 0, false);
    for lock in its {
        sum = sum.checked_add(lock.held.or(whole)?)?;
        locks += 1;
        has_switches |= lock.protocol != Protocol::Ceiling;
    }
    let held = whole.filter(|_| locks > 1).map_or(sum, |whole| whole.min(sum));
    // To it and back, where another activity waits for the lock.
    if has_switches { held.checked_add(times.switches(level)?) } else { Some(held) }
}

/// Returns why an activity has no bound because of a lock; `name` returns the names of activities and other tasks.
pub(crate) fn lock_reason(
    blocking: &Blocking,
    locks: &[Lock],
    name: &dyn Fn(usize) -> Name,
) -> Option<LockReason> {
    let lock = |lock: usize| locks.get(lock).map_or_else(Name::default, |lock| (*lock.name).into());
    Some(match blocking {
        Blocking::Time(..) => return None,
        Blocking::UnknownTime { lock: it, holder, because } => {
            let because = (because != holder).then(|| name(*because));
            LockReason::UnknownTime { lock: lock(*it), holder: name(*holder), because }
        }
        Blocking::SeveralCpus { lock: it } => LockReason::SeveralCpus { lock: lock(*it) },
        Blocking::Migrates { lock: it } => LockReason::Migrates { lock: lock(*it) },
        Blocking::Inversion { lock: it, holder, between } => LockReason::Inversion {
            lock: lock(*it),
            holder: name(*holder),
            between: between.iter().map(|&task| name(task)).collect(),
        },
        Blocking::UnknownWaits { lock: it, waiting } => {
            LockReason::UnknownWaits { lock: lock(*it), waiting: name(*waiting) }
        }
        Blocking::NotPreempted { holder } => LockReason::NotPreempted { holder: name(*holder) },
    })
}
