//! The computers of a robot. Each numbers its CPUs from 1; the analysis gives each a range of its own, so that nothing on one
//! delays anything on another.
//!
//! ```text
//! [host.brain] cpus = 2    CPUs 1 and 2 of brain ─→ CPUs 0 and 1 of the analysis
//! [host.eyes]  cpus = 4    CPU 1 of eyes         ─→ CPU 2 of the analysis
//! ```

use std::sync::Arc;

use mauve_timing::CpuSet;
use rustc_hash::FxHashMap;

use crate::item_tree::Name;
use crate::project::config_of;
use crate::{ModelDb, Workspace};

/// The hosts of a workspace.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Hosts {
    /// In the order of their names; empty: there is one computer, without a name.
    pub all: Vec<Host>,
    of_instances: FxHashMap<String, usize>,
}

/// A computer.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct Host {
    /// Its name.
    pub name: Name,
    /// Its CPUs, in the numbers of the analysis; none where their number is unknown, or there are more than
    /// [`CpuSet::MOST`] together.
    pub cpus: CpuSet,
    /// Whether it has timing tables, or recordings, of its own.
    pub has_times: bool,
}

/// Returns the hosts of `mauve.toml`.
#[salsa::tracked(returns(ref))]
pub fn hosts_of(db: &dyn ModelDb, workspace: Workspace) -> Arc<Hosts> {
    let config = config_of(db, workspace);
    let mut found = Hosts::default();
    let mut first = 0_u32;
    for host in &config.hosts {
        let count = host.cpus.or(config.cpus).unwrap_or_default();
        let end = first.saturating_add(count);
        let cpus = match end <= CpuSet::MOST {
            true => CpuSet::first_few(end) - CpuSet::first_few(first),
            false => CpuSet::NONE,
        };
        first = end;
        for (instance, _) in &host.activities {
            found.of_instances.entry(instance.clone()).or_insert(found.all.len());
        }
        let has_times = !host.tables.is_empty() || !host.observed.is_empty();
        found.all.push(Host { name: host.name.as_str().into(), cpus, has_times });
    }
    Arc::new(found)
}

impl Hosts {
    /// Returns the host of an instance, by its index.
    pub fn of(&self, instance: &str) -> Option<usize> {
        self.of_instances.get(instance).copied()
    }

    /// Returns CPUs of a host in the numbers of the analysis: those that it lacks are left out. Without hosts, the same.
    pub fn numbered(&self, host: Option<usize>, cpus: CpuSet) -> CpuSet {
        let Some(host) = host.and_then(|it| self.all.get(it)) else { return cpus };
        let Some(first) = host.cpus.first() else { return CpuSet::NONE };
        CpuSet(cpus.0 << first) & host.cpus
    }

    /// Returns the CPUs of each host in a set of the analysis, in the numbers of the host, with its name; without hosts, the set.
    pub fn parts(&self, cpus: CpuSet) -> Vec<(Option<&Name>, CpuSet)> {
        if self.all.is_empty() {
            return vec![(None, cpus)];
        }
        let part = |host: &'_ Host| CpuSet((cpus & host.cpus).0 >> host.cpus.first().unwrap_or_default());
        let parts = self.all.iter().map(|host| (Some(&host.name), part(host)));
        parts.filter(|(_, cpus)| !cpus.is_empty()).collect()
    }

    /// Returns the name on a host of what each has: `recv@eyes`; without hosts, the name alone.
    pub fn on(&self, host: Option<usize>, name: &str) -> String {
        let host = host.and_then(|it| self.all.get(it));
        host.map_or_else(|| name.to_owned(), |host| format!("{name}@{}", host.name))
    }

    /// Returns the names of CPUs of the analysis for a user: `CPU 1`, `CPUs 1 and 2 of eyes`.
    pub fn names(&self, cpus: CpuSet) -> String {
        let name = |(host, cpus): (Option<&Name>, CpuSet)| match host {
            Some(host) => format!("{cpus} of {host}"),
            None => cpus.to_string(),
        };
        let names: Vec<String> = self.parts(cpus).into_iter().map(name).collect();
        if names.is_empty() { cpus.to_string() } else { names.join(" and ") }
    }

    /// Returns CPUs of one host in its own numbers, with its name: those of the first of several.
    pub fn local(&self, cpus: CpuSet) -> (Option<&Name>, CpuSet) {
        self.parts(cpus).into_iter().next().unwrap_or_default()
    }

    /// Returns the host of CPUs of the analysis, by its index.
    pub fn host(&self, cpus: CpuSet) -> Option<usize> {
        self.all.iter().position(|it| it.cpus.meets(cpus))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Database;

    fn hosts(toml: &str) -> Arc<Hosts> {
        let db = Database::default();
        let texts = [("/mauve.toml".into(), toml.to_owned())];
        hosts_of(&db, Workspace::of_texts(&db, "/".into(), texts)).clone()
    }

    #[test]
    fn each_host_has_a_range_of_its_own() {
        let found = hosts(
            "[host.brain]\ncpus = 2\nactivities = [\"b\"]\n[host.eyes]\ncpus = 4\nactivities = [\"e\"]\n",
        );
        assert_eq!((found.of("b"), found.of("e"), found.of("x")), (Some(0), Some(1), None));
        assert_eq!(found.numbered(Some(1), CpuSet(0b1_0001)), CpuSet(0b100));
        assert_eq!(found.numbered(Some(0), CpuSet::ALL), CpuSet(0b11));
        let names =
            found.parts(CpuSet(0b1110)).into_iter().map(|(name, cpus)| (name.unwrap().as_str(), cpus.0));
        assert_eq!(names.collect::<Vec<_>>(), [("brain", 0b10), ("eyes", 0b11)]);
        assert_eq!(found.names(CpuSet(0b1110)), "CPU 2 of brain and CPUs 1 and 2 of eyes");
        assert_eq!(hosts("").parts(CpuSet(5)), [(None, CpuSet(5))]);
    }

    #[test]
    fn cpus_that_are_unknown_or_too_many_are_none() {
        let found = hosts(
            "[host.a]\nactivities = []\n[host.b]\ncpus = 100\nactivities = []\n[host.c]\ncpus = 100\nactivities = []\n",
        );
        assert_eq!(found.all.iter().map(|it| it.cpus.len()).collect::<Vec<_>>(), [0, 100, 0]);
        assert_eq!(found.numbered(Some(2), CpuSet(1)), CpuSet::NONE);
        let shared = hosts("[platform]\ncpus = 2\n[host.a]\nactivities = []\n[host.b]\nactivities = []\n");
        assert_eq!(shared.all.iter().map(|it| it.cpus.0).collect::<Vec<_>>(), [0b11, 0b1100]);
    }
}
