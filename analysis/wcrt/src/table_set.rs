//! Which timing tables count for a deployment: those of `[timing] tables` in `mauve.toml`, or its own ones.

#![allow(missing_docs, reason = "salsa writes constructors without any")]

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Decl, ModelDb, OwnerOfTables, Project, config_of, hosts_of, names_of, owner_of_tables,
    section_with_tables, toml_key,
};
use rustc_hash::FxHashSet;

/// The timing tables that count for a deployment: those of `[timing] tables`, or its own ones.
#[salsa::interned(debug)]
pub struct TableSet<'db> {
    /// The project of the deployment.
    #[returns(copy)]
    pub project: Project<'db>,
    /// The name in the header `[timing.deployment.NAME]` of its own tables; none for those of `[timing] tables`.
    #[returns(ref)]
    pub section: Option<Name>,
    /// The host with tables or recordings of its own, `[host.NAME]`, which count instead of those.
    #[returns(ref)]
    pub host: Option<Name>,
}

/// Returns the timing tables of a deployment. Those of its own section replace the others: the times of two computers in one
/// sum could give a bound that is too low.
#[salsa::tracked(returns(copy))]
pub fn tables_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, deployment: Decl<'db>) -> TableSet<'db> {
    TableSet::new(db, project, section_with_tables(db, project, deployment).map(Name::from), None)
}

/// Returns the timing tables of a host for a deployment: its own ones, if it has any. They replace the others, for the same reason; so
/// do its own recordings.
pub fn tables_of_host<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    host: Option<usize>,
) -> TableSet<'db> {
    let hosts = hosts_of(db, project.workspace(db));
    let of_deployment = tables_of(db, project, deployment);
    match host.and_then(|it| hosts.all.get(it)).filter(|it| it.has_times) {
        Some(host) => TableSet::new(db, project, of_deployment.section(db).clone(), Some(host.name.clone())),
        None => of_deployment,
    }
}

/// Returns all timing tables of a deployment: one set for each host that has tables of its own, and one for the others.
pub fn all_tables_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Vec<TableSet<'db>> {
    let hosts = &hosts_of(db, project.workspace(db)).all;
    let mut found: Vec<TableSet<'db>> =
        (0..hosts.len()).map(|it| tables_of_host(db, project, deployment, Some(it))).collect();
    let mut seen = FxHashSet::default();
    found.retain(|it| seen.insert(*it));
    match found.is_empty() {
        true => vec![tables_of(db, project, deployment)],
        false => found,
    }
}

/// Returns the timing tables of the deployments of a project, those of `[timing] tables` first; only these without any
/// deployment. For everything that belongs to no deployment, the times of all of them are shown.
#[salsa::tracked(returns(ref))]
pub fn table_sets<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TableSet<'db>> {
    let general = TableSet::new(db, project, None, None);
    let workspace = project.workspace(db);
    let hosts = hosts_of(db, workspace).all.iter().any(|it| it.has_times);
    if config_of(db, workspace).deployment_tables.is_empty() && !hosts {
        return vec![general];
    }
    let used: FxHashSet<TableSet<'db>> = used_sets(db, project).collect();
    let all = checked_sets(db, project).into_iter();
    all.filter(|it| used.contains(it) || used.is_empty() && *it == general).collect()
}

fn used_sets<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> impl Iterator<Item = TableSet<'db>> {
    let deployments = names_of(db, project).of_kind(db, Kind::Deployment);
    deployments.flat_map(move |it| all_tables_of(db, project, it))
}

/// Returns the timing tables that are checked in a project: those of `[timing] tables`, those of sections, except sections for
/// deployments of other projects, and those of hosts.
pub(crate) fn checked_sets<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> Vec<TableSet<'db>> {
    let sections = config_of(db, project.workspace(db)).deployment_tables.iter().map(|it| &it.name);
    let checked = sections.filter(|name| owner_of_tables(db, project, name) != OwnerOfTables::Elsewhere);
    let sections = checked.map(|name| Some(Name::from(name.as_str())));
    let sections = std::iter::once(None).chain(sections);
    let of_deployments = sections.map(|section| TableSet::new(db, project, section, None));
    let hosts = hosts_of(db, project.workspace(db)).all.iter().filter(|it| it.has_times);
    let of_hosts = hosts.flat_map(|host| {
        let mut sets: Vec<_> =
            used_sets(db, project).filter(|it| *it.host(db) == Some(host.name.clone())).collect();
        if sets.is_empty() {
            sets.push(TableSet::new(db, project, None, Some(host.name.clone())));
        }
        sets
    });
    let mut seen = FxHashSet::default();
    of_deployments.chain(of_hosts).filter(|it| seen.insert(*it)).collect()
}

impl TableSet<'_> {
    /// Returns what they are called for a user: the name of their deployment, or `host eyes`; none for those of `[timing] tables`.
    pub fn label(self, db: &dyn ModelDb) -> Option<String> {
        let of_host = self.host(db).as_ref().map(|host| format!("host {host}"));
        of_host.or_else(|| self.section(db).as_ref().map(Name::to_string))
    }

    /// Returns the header of the section of `mauve.toml` that has them.
    pub fn header(self, db: &dyn ModelDb) -> String {
        match (self.host(db), self.section(db)) {
            (Some(host), _) => format!("[host.{}]", toml_key(host)),
            (None, Some(name)) => format!("[timing.deployment.{}]", toml_key(name)),
            (None, None) => "[timing]".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use mauve_hir::{Database, Workspace, projects};
    use mauve_timing::Time;

    use super::*;
    use crate::{Query, TimingFactKind, required_facts, response_times, table_facts, tables_in};

    const MODEL: &str = "codel look(): int\ncodel think(): int\nshell S { }
        core Ke(S) { update = { look(); } }\ncore Kb(S) { update = { think(); look(); } }\ncomponent Eye(S, Ke)\ncomponent Brain(S, Kb)
        architecture A { instance eye: Eye  instance brain: Brain }
        deployment D { architecture A  activity eye { priority = 1 period = 100 }  activity brain { priority = 1 period = 100 } }";

    /// Calls `of` with the deployment of two hosts: that of `eye` has tables of its own.
    fn with<R>(
        config: &str,
        eyes: &str,
        texts: &[(&str, &str)],
        of: impl FnOnce(&Database, Project<'_>, Decl<'_>) -> R,
    ) -> R {
        let db = Database::default();
        let config = format!(
            "{config}\n[host.eyes]\ncpus = 1\nactivities = [\"eye\"]\ntables = [\"eyes.toml\"]\n{eyes}\n[host.head]\ncpus = 1\nactivities = [\"brain\"]\n"
        );
        let files = [("/m.mal", MODEL), ("/mauve.toml", &config)].into_iter().chain(texts.iter().copied());
        let workspace =
            Workspace::of_texts(&db, "/".into(), files.map(|(path, text)| (path.into(), text.to_owned())));
        let project = projects(&db, workspace)[0];
        let deployment = names_of(&db, project).anywhere(Kind::Deployment, "D")[0];
        of(&db, project, deployment)
    }

    #[test]
    fn required_chooses_a_level_that_only_a_host_has() {
        let texts = [
            ("/t.toml", "codel.look = 1\ncodel.think = 2\n"),
            ("/eyes.toml", "levels = [1e-3, 1e-6]\ncodel.look = [3, 9]\n"),
        ];
        let shown = |required: &str| {
            let config = format!("timing.tables = [\"t.toml\"]\ntiming.required = \"{required}\"");
            with(&config, "", &texts, |db, project, of| {
                let query = Query::shown(db, project, of);
                let eye = response_times(db, project, of, query).activities[0].response;
                (query.level.to_string(), eye, required_facts(db, project).len())
            })
        };
        let ms = |ms: u64| Some(Time::from_nanos(ms * 1_000_000));
        // 36,000 executions an hour, 10 a second.
        assert_eq!(shown("0.9 per 1 s"), ("1e-3".into(), ms(3), 0));
        assert_eq!(shown("0.9 per hour"), ("1e-6".into(), ms(9), 0));
        assert_eq!(shown("1e-6 per hour"), ("1e-6".into(), ms(9), 1));
    }

    #[test]
    fn recordings_of_the_deployment_or_of_the_host_refute_its_times() {
        let observed = "unit = \"ms\"\n[codel.look]\nexecutions = 10\ngreatest = 50\n";
        let table = "codel.look = 10\ncodel.think = 2\n";
        let texts = [
            ("/t.toml", table),
            ("/eyes.toml", table),
            ("/robot.observed.toml", observed),
            ("/other.observed.toml", "unit = \"ms\"\n"),
        ];
        // Which hosts have no figure, and how many entries are refuted.
        let refuted = |config: &str, eyes: &str| {
            with(&format!("timing.tables = [\"t.toml\"]\n{config}"), eyes, &texts, |db, project, of| {
                let report = response_times(db, project, of, Query::shown(db, project, of));
                let facts = table_facts(db, project);
                let is_it = |it: &&crate::TimingFact<'_>| {
                    matches!(it.kind, TimingFactKind::Recorded(crate::Recorded::RefutedTime { .. }))
                };
                let unknown = report.activities.iter().filter(|it| it.response.is_none());
                (
                    unknown.map(|it| it.instance.to_string()).collect::<Vec<_>>().join(" "),
                    facts.iter().filter(is_it).count(),
                )
            })
        };
        let own = "observed = [\"robot.observed.toml\"]";
        let other = "observed = [\"other.observed.toml\"]";
        assert_eq!(refuted("", ""), (String::new(), 0));
        assert_eq!(refuted(&format!("timing.{own}"), ""), ("eye brain".into(), 2));
        let section = format!("[timing.deployment.D]\ntables = [\"t.toml\"]\n{own}");
        assert_eq!(refuted(&section, ""), ("eye brain".into(), 2));
        // A host with recordings of its own has these alone.
        assert_eq!(refuted(&section, other), ("brain".into(), 1));
        assert_eq!(refuted("", own), ("eye".into(), 1));
    }

    #[test]
    fn required_needs_a_level_that_all_hosts_have() {
        let texts = [
            ("/t.toml", "levels = [1e-3, 1e-6]\ncodel.look = [1, 2]\ncodel.think = [2, 3]\n"),
            ("/eyes.toml", "levels = [1e-4]\ncodel.look = [3]\n"),
        ];
        let config = "timing.tables = [\"t.toml\"]\ntiming.required = \"1e-6 per hour\"";
        assert_eq!(with(config, "", &texts, |db, project, _| required_facts(db, project).len()), 1);
    }

    #[test]
    fn work_of_one_host_is_not_that_of_another() {
        let texts = [
            ("/t.toml", "codel.look = 1\ncodel.think = 2\n"),
            ("/eyes.toml", "codel.look = 3\n"),
            ("/eyes.observed.toml", "unit = \"ms\"\n[work.lidar]\nper_second = 100\n"),
        ];
        let elsewhere = |host: &str| {
            let other =
                "[[platform.other]]\nname = \"lidar\"\npriority = 50\nperiod = \"1 s\"\ntime = \"100 ms\"\n";
            let config = format!("timing.tables = [\"t.toml\"]\n{other}{host}");
            with(&config, "observed = [\"eyes.observed.toml\"]", &texts, |db, project, _| {
                let is_it = |it: &crate::TimingFact<'_>| {
                    matches!(it.kind, TimingFactKind::Recorded(crate::Recorded::WorkElsewhere { .. }))
                };
                table_facts(db, project).iter().any(is_it)
            })
        };
        assert_eq!([elsewhere(""), elsewhere("host = \"eyes\"")], [false, false]);
        assert!(elsewhere("host = \"head\""));
    }

    #[test]
    fn a_component_has_the_times_of_its_host() {
        let texts = [("/t.toml", "codel.look = 1\ncodel.think = 2\n"), ("/eyes.toml", "codel.look = 3\n")];
        with("timing.tables = [\"t.toml\"]", "", &texts, |db, project, of| {
            let component = |name: &str| names_of(db, project).anywhere(Kind::Component, name)[0];
            let labels = |name: &str| -> Vec<Option<String>> {
                tables_in(db, project, of, component(name)).into_iter().map(|it| it.label(db)).collect()
            };
            assert_eq!((labels("Eye"), labels("Brain")), (vec![Some("host eyes".into())], vec![None]));
        });
    }
}
