//! The gateway to ROS 2: an activity of each host with topics, which moves samples between the ports and the topics. It has no
//! component: its period, priority and CPUs are those of `[ros2] gateway`, and its execution time is the sum of those of its topics.
//!
//! ```text
//! dispatch and context switches + Σ depth × [access] "ros2.INSTANCE.PORT"
//! ```

use std::sync::Arc;

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Edge, Edges, Location, ModelDb, Project, config_file, ros2_of};
use mauve_timing::{Level, StateMachine};

use crate::psm::Psm;
use crate::reason::{Reason, Refusal, Timed, TooLong};
use crate::table_set::TableSet;
use crate::timetable::{Lookup, timetable_of};

/// Which gateway an activity is: that of a deployment on a host, by its index in [`mauve_hir::Ros2::hosts`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct Gateway<'db> {
    /// The deployment.
    pub deployment: Decl<'db>,
    /// The host; 0 without any.
    pub host: usize,
}

/// Returns what a gateway moves in a period: the key of each topic of its host behind `ros2.`, and the number of its samples.
pub(crate) fn moved<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Gateway<'db>,
) -> impl Iterator<Item = (Name, u64)> {
    let topics = ros2_of(db, project, of.deployment).topics.iter();
    let topics = topics.filter(move |it| it.host == of.host);
    topics.map(|it| (format!("{}.{}", it.port.0, it.port.1).into(), u64::from(it.depth.max(1))))
}

/// Returns the state machine of a gateway, one state with one edge, or why its time is not known.
#[salsa::tracked(returns(ref))]
pub(crate) fn gateway_psm<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    deployment: Decl<'db>,
    host: usize,
    level: Level,
) -> Result<Psm<'db>, Vec<Refusal<'db>>> {
    let times = timetable_of(db, tables);
    let workspace = tables.project(db).workspace(db);
    let at = config_file(db, workspace).map(|file| Location::Range(file, 0, 0));
    let refuse = |reason| Err(vec![Refusal { reason, at: at.clone() }]);
    let Some(overhead) = times.overhead(level) else {
        return match times.without_level(level) {
            Some(table) => refuse(Reason::NoOverhead { level, table: table.clone() }),
            None => refuse(Reason::TooLong(TooLong::Overhead)),
        };
    };
    let (mut cost, mut assumed) = (overhead, Vec::new());
    for (topic, samples) in moved(db, tables.project(db), Gateway { deployment, host }) {
        let of = Timed::Topic(topic);
        let time = match (times.time(&of, level), times.assume) {
            (Lookup::Known(time) | Lookup::Assumed(time), _) => time,
            (Lookup::Absent, Some(time)) => {
                assumed.push((of.key(db), time));
                time
            }
            (Lookup::Absent, None) => return refuse(Reason::NoTopicTime(of.key(db))),
            (Lookup::Unusable(why), _) => return refuse(Reason::Table(why)),
        };
        let sum = time.checked_mul(samples).and_then(|time| cost.checked_add(time));
        let Some(sum) = sum else { return refuse(Reason::TooLong(TooLong::Program)) };
        cost = sum;
    }
    let edge = Edge { source: 0, target: 0, transition: None, first: 0, then: Vec::new() };
    Ok(Psm {
        states: vec!["Moving".into()],
        initial: 0,
        machine: StateMachine::single(cost),
        product: None,
        waits: None,
        edges: Arc::new(Edges { all: vec![edge], first: vec![Vec::new()] }),
        programs: Vec::new(),
        greatest: Vec::new(),
        operations: Vec::new(),
        overhead,
        component_time: None,
        unusable_component_time: None,
        assumed,
    })
}

#[cfg(test)]
mod tests {
    use mauve_hir::item_tree::Kind;
    use mauve_hir::{Database, Workspace, names_of, projects};
    use mauve_timing::{Method, Time};

    use crate::{Query, response_times};

    /// The names and response times of a deployment with a gateway, or with an activity by hand in its place.
    fn responses(gateway: bool, table: &str) -> Vec<(String, Option<u64>)> {
        let db = Database::default();
        let (instance, activity, topics) = match gateway {
            true => ("", "", "topics = { \"a.o\" = { name = \"/o\", depth = 3 } }"),
            false => (
                "instance ros2: Cb",
                "activity ros2 { priority = 20 period = 10 affinity = 1 }",
                "namespace = \"/x\"",
            ),
        };
        let model = format!(
            "codel a(): int\ncodel b(): int\nshell S {{ output o: double }}\nshell N {{ }}
            core Ka(S) {{ update = {{ a(); }} }}\ncore Kb(N) {{ update = {{ b(); }} }}
            component Ca(S, Ka)\ncomponent Cb(N, Kb)\narchitecture A {{ instance a: Ca {instance} }}
            deployment D {{ architecture A activity a {{ priority = 1 period = 40 affinity = 1 }} {activity} }}"
        );
        let config = format!(
            "timing.tables = [\"t.toml\"]\n[[platform.other]]\nname = \"recv\"\npriority = 19\nperiod = \"1 s\"\ntime = \"1 us\"\ncpus = [2]\n[ros2]\ngateway = {{ priority = 20, period = \"10 ms\", cpus = [1] }}\n{topics}\n"
        );
        let files = [("/m.mal", model), ("/mauve.toml", config), ("/t.toml", table.to_owned())];
        let workspace = Workspace::of_texts(&db, "/".into(), files.map(|(path, text)| (path.into(), text)));
        let project = projects(&db, workspace)[0];
        let of = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        let query =
            Query { level: mauve_timing::Level::TEN_TO_MINUS_FOUR, method: Method::Best, horizon: None };
        let report = response_times(&db, project, of, query);
        let all = report.activities.iter();
        all.map(|it| (it.instance.to_string(), it.response.map(Time::as_nanos))).collect()
    }

    #[test]
    fn a_gateway_delays_like_an_activity_with_the_same_time() {
        let table = "codel.a = 7\n[overhead]\ndispatch = 1\n[access]\n\"ros2.a.o\" = 1\n";
        let found = responses(true, table);
        assert_eq!(found, responses(false, "codel.a = 7\ncodel.b = 3\n[overhead]\ndispatch = 1\n"));
        assert_eq!(found, [("a".into(), Some(16_000_000)), ("ros2".into(), Some(4_000_000))]);
        // Without its time, it is not analysed, and delays an unknown time.
        assert_eq!(responses(true, "codel.a = 7\n"), [("a".into(), None), ("ros2".into(), None)]);
    }
}
