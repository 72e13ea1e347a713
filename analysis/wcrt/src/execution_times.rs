//! The execution times of a deployment at one level: of the codels that its instances may call, and of the programs with times
//! of their own.

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, ModelDb, ProgramId, Project, behaviour_of, core_of, ros2_of, uses_of};
use mauve_timing::{Level, Time};
use rustc_hash::FxHashSet;

use crate::reason::Timed;
use crate::system::system_of;
use crate::table_set::tables_of_host;
use crate::timetable::{Lookup, timetable_of};

/// The execution times of a deployment at one level.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ExecutionTimes<'db> {
    /// The codels that its components may call, sorted by their qualified names; `None` where the time is unknown.
    pub codels: Vec<(Decl<'db>, Option<Time>)>,
    /// The programs of its components that have times of their own in the tables, sorted by the qualified names of the
    /// components.
    pub programs: Vec<(Decl<'db>, ProgramId, Time)>,
    /// The waits of these codels that the tables have, in the same order.
    pub waits: Vec<(Decl<'db>, Time)>,
    /// The accesses to ports of its components that have times in the tables, in the order of the components.
    pub accesses: Vec<(Decl<'db>, Name, Time)>,
    /// The topics of ROS 2, `INSTANCE.PORT`, whose samples have times in the tables, in the order of the instances.
    pub topics: Vec<(Name, Time)>,
    /// The time of dispatch and context switches in each period; 0 where it is unknown.
    pub overhead: Time,
}

/// Returns the execution times of a deployment, of one host if it has several, from its timing tables and `[assume]`.
pub fn execution_times<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    host: Option<usize>,
    level: Level,
) -> ExecutionTimes<'db> {
    let times = timetable_of(db, tables_of_host(db, project, deployment, host));
    let known = |found: Lookup<'db>| found.time().filter(|_| times.incomplete.is_none());
    let activities = &system_of(db, project, deployment).activities;
    let here = activities.iter().filter(|it| host.is_none() || it.host == host);
    let components: FxHashSet<Decl<'db>> = here.filter_map(|it| it.component).collect();
    let components = sorted(db, components);
    let cores =
        || components.iter().filter_map(|&component| Some((component, core_of(db, project, component)?)));
    let codels = cores().flat_map(|(_, core)| &uses_of(db, project, core).codels).copied().collect();
    let codels = sorted(db, codels);
    let wait = |&codel: &Decl<'db>| Some((codel, known(times.time(&Timed::Wait(codel), level))?));
    let waits = codels.iter().filter_map(wait).filter(|(_, wait)| *wait > Time::ZERO).collect();
    let mut accesses = Vec::new();
    for &component in &components {
        let mut ports: Vec<&Name> = times.timed_ports(component).collect();
        ports.sort();
        for port in ports {
            let time = known(times.time(&Timed::Access(component, port.clone()), level));
            accesses.extend(time.map(|time| (component, port.clone(), time)));
        }
    }
    let topics = ros2_of(db, project, deployment).topics.iter();
    let topics = topics.filter(|it| host.is_none_or(|host| it.host == host)).filter_map(|it| {
        let topic: Name = format!("{}.{}", it.port.0, it.port.1).into();
        Some((topic.clone(), known(times.time(&Timed::Topic(topic), level))?))
    });
    let mut programs = Vec::new();
    for (component, core) in cores() {
        let behaviour = behaviour_of(db, project, core);
        for program in behaviour.programs.iter().chain(&behaviour.operations) {
            let time = known(times.time(&Timed::Program(component, program.id.in_table()), level));
            programs.extend(time.map(|time| (component, program.id.clone(), time)));
        }
    }
    ExecutionTimes {
        codels: codels.into_iter().map(|codel| (codel, known(times.codel_time(db, codel, level)))).collect(),
        programs,
        waits,
        accesses,
        topics: topics.collect(),
        overhead: times.overhead(level).filter(|_| times.incomplete.is_none()).unwrap_or_default(),
    }
}

fn sorted<'db>(db: &'db dyn ModelDb, all: FxHashSet<Decl<'db>>) -> Vec<Decl<'db>> {
    let mut all: Vec<Decl<'db>> = all.into_iter().collect();
    all.sort_by_cached_key(|decl| decl.qualified(db));
    all
}
