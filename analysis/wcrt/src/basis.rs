//! What the figures of a deployment rest on: the execution times of its codels, measured or assumed, and what is counted as nothing.

use std::collections::BTreeSet;

use mauve_hir::item_tree::Name;
use mauve_hir::{
    Decl, Execution, File, ModelDb, Project, behaviour_of, core_of, features_of, shell_of, value_size,
};
use mauve_timing::{Level, Measured};
use rustc_hash::FxHashSet;

use crate::reason::Timed;
use crate::sensitivity::executed_times;
use crate::system::system_of;
use crate::table_set::TableSet;
use crate::timetable::{Lookup, files_of, table, timetable_of};

/// Values of ports with more bytes, or of variable size, are not copied for nothing.
const SMALL_VALUE: u64 = 256;

/// What the figures of a deployment rest on at one level.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Basis {
    /// The number of times of codels and programs that its activities execute.
    pub times: usize,
    /// How many of them `mauve pwcet` has estimated from measurements.
    pub measured: usize,
    /// How many of the measured ones are extrapolated at this level: of a fitted tail, which no execution confirms.
    pub extrapolated: usize,
    /// How many of them are assumed: those of `[assume]`, and entries that say `# assumed`.
    pub assumed: usize,
    /// The number of codels with a wait.
    pub waits: usize,
    /// The number of gateways to ROS 2: how long they wait for locks of the middleware is not known.
    pub gateways: usize,
    /// The ports whose reads and writes are counted as nothing although their values are large or of variable size.
    pub ports: Vec<String>,
}

impl Basis {
    /// Adds that of another deployment.
    pub fn add(&mut self, other: Basis) {
        self.times += other.times;
        self.measured += other.measured;
        self.extrapolated += other.extrapolated;
        self.assumed += other.assumed;
        self.waits += other.waits;
        self.gateways += other.gateways;
        self.ports.extend(other.ports);
    }
}

/// Returns what the figures of a deployment rest on.
pub fn basis_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    level: Level,
) -> Basis {
    let activities = system_of(db, project, deployment).activities.iter();
    let gateways = activities.filter(|it| it.gateway.is_some()).count();
    let ports = unmeasured_ports(db, project, deployment);
    let mut basis = Basis { ports, gateways, ..Basis::default() };
    let executed = executed_times(db, project, deployment, level).iter();
    for (of, tables) in executed.flat_map(|it| it.tables.iter().map(|tables| (&it.of, *tables))) {
        let times = timetable_of(db, tables);
        match of {
            Timed::Codel(codel) => {
                let wait = times.time(&Timed::Wait(*codel), level);
                basis.waits +=
                    usize::from(matches!(wait, Lookup::Known(wait) if wait > mauve_timing::Time::ZERO));
            }
            // Its times are those of reads and writes.
            Timed::Access(..) | Timed::Topic(_) => continue,
            _ => {}
        }
        basis.times += 1;
        match origin_of(db, tables, of, level) {
            Origin::Measured => {
                basis.measured += 1;
                basis.extrapolated += usize::from(times.is_extrapolated(of, level));
            }
            Origin::Assumed => basis.assumed += 1,
            Origin::Given => {}
        }
    }
    basis
}

/// Where a time comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// `mauve pwcet` has estimated it from measurements.
    Measured,
    /// That of `[assume]`, or an entry that says `# assumed`.
    Assumed,
    /// Any other entry.
    Given,
}

/// Returns where the time of a codel or a program comes from.
pub fn origin_of<'db>(db: &'db dyn ModelDb, tables: TableSet<'db>, of: &Timed<'db>, level: Level) -> Origin {
    let times = timetable_of(db, tables);
    let found = match of {
        Timed::Codel(codel) => times.codel_time(db, *codel, level),
        of => times.time(of, level),
    };
    match found {
        Lookup::Known(_) if times.is_measured(of) => Origin::Measured,
        Lookup::Known(_) if times.is_assumed(of) => Origin::Assumed,
        Lookup::Assumed(_) => Origin::Assumed,
        _ => Origin::Given,
    }
}

/// Returns the record of a measured time, if the table has it, and the table of a time.
pub fn record_of<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    of: &Timed<'db>,
) -> (Option<&'db Measured>, Option<File>) {
    let key = of.key(db);
    // A table may leave the library out.
    let is_its = |it: &&Measured| it.key == key || key.ends_with(&format!(".{}", it.key));
    let mut records = files_of(db, tables).iter().flat_map(|&file| &table(db, file).measured);
    (records.find(is_its), timetable_of(db, tables).table_of(of))
}

/// Returns the ports that the activities of a deployment read or write, with values that are large or of variable size, and for
/// which no table has a time: `Camera.frame`, each once.
pub(crate) fn unmeasured_ports<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Vec<String> {
    let mut seen = FxHashSet::default();
    let mut found = Vec::new();
    for activity in &system_of(db, project, deployment).activities {
        let Some(component) = activity.executed().filter(|it| seen.insert((*it, activity.tables))) else {
            continue;
        };
        let times = timetable_of(db, activity.tables);
        let ports = large_ports(db, project, component).iter();
        let without_time = ports.filter(|port| !times.has_entry(&Timed::Access(component, (*port).clone())));
        found.extend(without_time.map(|port| format!("{}.{port}", component.name(db))));
    }
    found
}

/// Returns the ports that a component reads or writes, with values that are large or of variable size, in the order of their names.
#[salsa::tracked(returns(ref))]
fn large_ports<'db>(db: &'db dyn ModelDb, project: Project<'db>, component: Decl<'db>) -> Vec<Name> {
    let (Some(core), Some(shell)) = (core_of(db, project, component), shell_of(db, project, component))
    else {
        return Vec::new();
    };
    let behaviour = behaviour_of(db, project, core);
    let executions = behaviour.executed().flat_map(|it| it.cost.executions());
    let port = |it: &Execution<'db>| if let Execution::Access(port) = it { Some(port.clone()) } else { None };
    let ports: BTreeSet<Name> = executions.filter_map(port).collect();
    let features = features_of(db, project, shell);
    let is_large = |port: &Name| {
        let ty = features.get(port).map(|feature| feature.ty(db, project));
        ty.is_some_and(|ty| value_size(db, project, &ty).is_none_or(|size| size > SMALL_VALUE))
    };
    ports.into_iter().filter(is_large).collect()
}
