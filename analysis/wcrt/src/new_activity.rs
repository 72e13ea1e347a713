//! Values for an activity that a deployment lacks: an affinity that the CPUs allow, a priority that no other activity of
//! that CPU has, and the period of its neighbours.

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, ModelDb, PLACES, Project, deployed, deployment, hosts_of};
use mauve_timing::{CpuSet, Priority, Time};
use rustc_hash::FxHashMap;

use crate::reason::{ActivityField, Reason};
use crate::report::Query;
use crate::response::response_times;
use crate::system::{ResolvedActivity, System, system_of};

/// The period where no activity of the deployment has one.
const DEFAULT_PERIOD: Time = Time::from_nanos(100_000_000);

/// Values for the activity of an instance.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct NewActivity {
    /// The instance.
    pub instance: Name,
    /// The CPU, as a mask; none where the project has one CPU and no activity names it.
    pub affinity: Option<CpuSet>,
    /// The lowest priority that no activity on this CPU has.
    pub priority: u32,
    /// The most frequent period of the connected instances, otherwise of all.
    pub period: Time,
}

impl NewActivity {
    /// Returns the fields with their values, in the usual order.
    pub fn fields(&self) -> Vec<(ActivityField, String)> {
        let affinity = self.affinity.map(|cpus| (ActivityField::Affinity, cpus.0.to_string()));
        let others = [
            (ActivityField::Priority, self.priority.to_string()),
            (ActivityField::Period, self.period.number()),
        ];
        affinity.into_iter().chain(others).collect()
    }
}

/// Returns values for all instances of a deployment that have no activity, in their order.
#[salsa::tracked(returns(ref))]
pub fn missing_activities<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<NewActivity> {
    let has_none = |it: &&ResolvedActivity<'_>| it.refusals.iter().any(|it| it.reason == Reason::NoActivity);
    let instances = system_of(db, project, of).activities.iter().filter(has_none);
    let instances: Vec<Name> = instances.map(|it| it.instance.clone()).collect();
    new_activities(db, project, of, &instances)
}

/// Returns values for `instances` that have no activity in a deployment. All may be added: their priorities differ.
pub fn new_activities<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    instances: &[Name],
) -> Vec<NewActivity> {
    let (system, hosts) = (system_of(db, project, of), hosts_of(db, project.workspace(db)));
    let data = deployment(db, of);
    let has_affinity = data.is_some_and(|it| {
        it.activities.iter().any(|it| PLACES.iter().any(|place| it.field(*place).is_some()))
    });
    // Without an affinity, an activity may run on all CPUs, which is not analysed.
    let is_written = has_affinity || system.cpus.len() > 1;
    let mut cpus = cpus_of(db, project, of, system);
    let periods: FxHashMap<&Name, Time> =
        system.activities.iter().filter_map(|it| Some((&it.instance, period_of(it)?))).collect();
    let all = most_frequent(system.activities.iter().filter_map(period_of));
    let mut near: FxHashMap<&Name, Vec<Time>> = FxHashMap::default();
    for link in deployed(db, project, of).map_or(&[][..], |(flat, _)| &flat.links) {
        let ends = [(&link.source.0, &link.target.0), (&link.target.0, &link.source.0)];
        for (instance, other) in ends {
            near.entry(instance).or_default().extend(periods.get(other));
        }
    }
    let new = instances.iter().map(|instance| {
        let period = near.get(instance).and_then(|periods| most_frequent(periods.iter().copied())).or(all);
        let host = hosts.of(instance);
        let of_host = cpus.iter_mut().filter(|it| host.is_none() || hosts.host(it.cpu) == host);
        let (affinity, priority) = next_place(of_host);
        NewActivity {
            instance: instance.clone(),
            affinity: affinity.filter(|_| is_written).map(|cpu| hosts.local(cpu).1),
            priority,
            period: period.unwrap_or(DEFAULT_PERIOD),
        }
    });
    new.collect()
}

/// Returns the period of an activity, unless data releases it.
fn period_of(activity: &ResolvedActivity<'_>) -> Option<Time> {
    activity.period.filter(|_| activity.is_periodic())
}

/// A CPU of a deployment.
struct CpuRoom {
    cpu: CpuSet,
    /// In billionths, rounded.
    utilisation: u64,
    /// The number of real-time activities that may run there.
    count: usize,
    /// A bit for each priority that one of them has.
    priorities: u128,
}

fn cpus_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    system: &System<'db>,
) -> Vec<CpuRoom> {
    let known = &response_times(db, project, of, Query::shown(db, project, of)).cpus;
    let of_cpu = |cpu: CpuSet| {
        let utilisation = known.iter().find(|it| it.cpus.meets(cpu));
        // Of CPUs that activities use alternatively, each has its part.
        let utilisation = utilisation.map(|it| it.utilisation.as_f64() / f64::from(it.cpus.len()));
        let mut of_cpu =
            CpuRoom { cpu, utilisation: (utilisation.unwrap_or(0.0) * 1e9) as u64, count: 0, priorities: 0 };
        for activity in system.activities.iter().filter(|it| it.cpus.is_none_or(|cpus| cpus.meets(cpu))) {
            of_cpu.count += usize::from(activity.priority != Priority::Background);
            of_cpu.priorities |= activity.priority.real_time().map_or(0, |priority| 1_u128 << priority);
        }
        of_cpu
    };
    system.cpus.each().map(of_cpu).collect()
}

/// Takes the lowest free priority on the CPU with the lowest utilisation, otherwise with the fewest activities.
fn next_place<'a>(cpus: impl Iterator<Item = &'a mut CpuRoom>) -> (Option<CpuSet>, u32) {
    let Some(cpu) = cpus.min_by_key(|cpu| (cpu.utilisation, cpu.count)) else { return (None, 1) };
    let priority = (1..=99).find(|priority| cpu.priorities & (1 << priority) == 0).unwrap_or(1);
    cpu.priorities |= 1 << priority;
    cpu.count += 1;
    (Some(cpu.cpu), priority)
}

/// Returns the most frequent of some periods, the first of several.
fn most_frequent(periods: impl Iterator<Item = Time>) -> Option<Time> {
    let mut counts: Vec<(Time, usize)> = Vec::new();
    for period in periods {
        match counts.iter_mut().find(|(known, _)| *known == period) {
            Some((_, count)) => *count += 1,
            None => counts.push((period, 1)),
        }
    }
    let most = counts.iter().map(|(_, count)| *count).max()?;
    counts.iter().find(|(_, count)| *count == most).map(|(period, _)| *period)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};

    /// Returns the fields of the new activities of instances `c` and `d`; `a`, `b` and `c` are connected in this order.
    fn proposed(platform: &str, activities: &str) -> Vec<String> {
        let model = format!(
            "codel work(): int
            shell S {{ input port i: int  output port o: int }}
            core K(S) {{ update = {{ work(); }} }}
            component C(S, K)
            architecture R {{
              instance a: C  instance b: C  instance c: C  instance d: C
              connection a.o -> b.i  connection b.o -> c.i
            }}
            deployment D {{ architecture R {activities} }}"
        );
        let config = format!("assume.codel = \"5 ms\"\nplatform.rt_throttling = false\n{platform}");
        let db = Database::default();
        let files = [("/robot.mal".into(), model), ("/mauve.toml".into(), config)];
        let project = projects(&db, Workspace::of_texts(&db, "/".into(), files))[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let shown = |new: &NewActivity| {
            let fields =
                new.fields().into_iter().map(|(field, value)| format!(" {}={value}", field.keyword()));
            format!("{}{}", new.instance, fields.collect::<String>())
        };
        missing_activities(&db, project, of).iter().map(shown).collect()
    }

    #[test]
    fn the_cpu_with_the_lowest_utilisation_and_the_lowest_free_priority() {
        let two = "activity a { affinity = 1 priority = 1 period = 20 }
                   activity b { affinity = 2 priority = 2 period = 10 }";
        // CPU 1: 25 %, CPU 2: 50 %. The period of c is that of b; a has the first of the two periods.
        let expected = ["c affinity=1 priority=2 period=10", "d affinity=1 priority=3 period=20"];
        assert_eq!(proposed("", two), expected);
        let expected = ["c affinity=4 priority=1 period=10", "d affinity=4 priority=2 period=20"];
        assert_eq!(proposed("platform.cpus = 3", two), expected);
        // Two CPUs that `a` may use have 12.5 % each, the third one has 20 %.
        let shared = "activity a { affinity = 3 priority = 1 period = 20 }
                      activity b { affinity = 4 priority = 2 period = 25 }";
        assert_eq!(proposed("", shared)[0], "c affinity=1 priority=2 period=25");
    }

    #[test]
    fn the_most_frequent_period() {
        // Nothing is connected to d.
        let three = "activity a { priority = 1 period = 40 } activity b { priority = 2 period = 20 }
                     activity c { priority = 3 period = 20 }";
        assert_eq!(proposed("", three), ["d priority=4 period=20"]);
    }

    #[test]
    fn an_affinity_only_where_it_matters() {
        let two = "activity a { priority = 1 period = 20 } activity b { priority = background }";
        assert_eq!(proposed("", two), ["c priority=2 period=20", "d priority=3 period=20"]);
        let expected = ["c affinity=1 priority=2 period=20", "d affinity=2 priority=2 period=20"];
        assert_eq!(proposed("platform.cpus = 2", two), expected);
        // Both CPUs have 50 %: the first one of two activities, the second one of one.
        let equal = "activity a { affinity = 1 priority = 1 period = 20 }
                     activity b { affinity = 1 priority = 2 period = 20 }
                     activity c { affinity = 2 priority = 1 period = 10 }";
        assert_eq!(proposed("", equal), ["d affinity=2 priority=2 period=20"]);
        let one = "activity a { affinity = 1 priority = 1 period = 20 } activity b { priority = background }";
        assert_eq!(proposed("", one)[0], "c affinity=1 priority=2 period=20");
        assert_eq!(
            proposed("", "activity a { priority = background } activity b { priority = background }"),
            ["c priority=1 period=100", "d priority=2 period=100",]
        );
    }
}
