//! The chains and the connections of a deployment, as far as a recording shows them.

use mauve_hir::item_tree::Name;
use mauve_hir::{Decl, Flat, Link, ModelDb, PassageEnd, Project, config_of, deployed};
use mauve_pwcet::trace::{SpanKind, access_key, port_of};
use mauve_timing::Time;

use crate::chains::{ChainReport, ChainStepReport, chains_of};
use crate::report::Query;

/// A chain, as far as a recording shows it.
#[derive(Debug, Clone, Default)]
pub struct ExpectedChain {
    /// Its name.
    pub name: String,
    /// The greatest latency, in nanoseconds.
    pub bound: Option<u64>,
    /// The limit that is declared, in nanoseconds.
    pub limit: Option<u64>,
    /// The instances that data passes through.
    pub steps: Vec<ExpectedStep>,
}

/// An instance of a chain.
#[derive(Debug, Clone)]
pub struct ExpectedStep {
    /// Its name.
    pub instance: String,
    /// Where data enters.
    pub from: ExpectedEnd,
    /// Where data leaves.
    pub to: ExpectedEnd,
    /// N, where it has a bound.
    pub releases: Option<u32>,
    /// The states that it is assumed to stay in; empty for all.
    pub states: Vec<String>,
    /// The codels that are assumed to return `true`, and the ports that are assumed to have new data.
    pub answers: Vec<ExpectedEnd>,
}

/// A port or a codel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExpectedEnd {
    /// An access or a codel.
    pub kind: SpanKind,
    /// Its key in a recording.
    pub key: String,
}

impl ExpectedEnd {
    /// Returns `codel nav.plan` or `port nav.Pilot.goal`.
    pub fn text(&self) -> String {
        port_of(&self.key).map_or_else(|| format!("codel {}", self.key), |port| format!("port {port}"))
    }
}

/// A connection between ports.
#[derive(Debug, Clone)]
pub struct ExpectedConnection {
    /// `source -> target`.
    pub name: String,
    /// The instances and the keys of both ports in a recording.
    pub ends: [(String, String); 2],
    /// The size of its buffer.
    pub buffer: Option<u32>,
}

/// Returns the chains of a deployment that a recording can show: the declared ones, or without any, at most so many from sources to
/// sinks that have a bound.
pub fn expected_chains<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    query: Query,
    most: usize,
) -> Vec<ExpectedChain> {
    let Some((flat, _)) = deployed(db, project, deployment) else { return Vec::new() };
    let chains = chains_of(db, project, deployment, query);
    let model = ChainModel { db, project, flat };
    let is_shown = |it: &&ChainReport<'db>| match chains.declared {
        0 => it.latency.is_some(),
        _ => it.declared.is_some(),
    };
    chains.all.iter().filter(is_shown).filter_map(|chain| model.chain(chain)).take(most).collect()
}

/// Returns the connections between the ports of a deployment.
pub(super) fn expected_connections<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
) -> Vec<ExpectedConnection> {
    let Some((flat, _)) = deployed(db, project, deployment) else { return Vec::new() };
    let model = ChainModel { db, project, flat };
    let links = flat.links.iter().filter(|link| !link.operation);
    let connection = |link: &Link<'db>| {
        let end =
            |(instance, port): &(Name, Name)| Some((instance.to_string(), model.port(instance, port)?.key));
        Some(ExpectedConnection {
            name: link.to_string(),
            ends: [end(&link.source)?, end(&link.target)?],
            buffer: link.buffer,
        })
    };
    links.filter_map(connection).collect()
}

struct ChainModel<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    flat: &'db Flat<'db>,
}

impl<'db> ChainModel<'db> {
    fn chain(&self, chain: &ChainReport<'db>) -> Option<ExpectedChain> {
        let declared = chain
            .declared
            .and_then(|index| config_of(self.db, self.project.workspace(self.db)).chains.get(index));
        let step = |step: &ChainStepReport<'db>| {
            let instance = step.instance.to_string();
            let [from, to] = step.passage.each_ref().map(|end| self.end(&step.instance, end));
            let states = declared.into_iter().flat_map(|it| &it.states);
            let states = states.filter_map(|(text, _)| text.strip_prefix(&*instance)?.strip_prefix('.'));
            let answers = declared.into_iter().flat_map(|it| &it.answers).map(|(text, _)| {
                let port = text.strip_prefix(&*instance).and_then(|it| it.strip_prefix('.'));
                let port = port.and_then(|port| self.port(&step.instance, port));
                port.unwrap_or_else(|| ExpectedEnd { kind: SpanKind::Codel, key: text.clone() })
            });
            Some(ExpectedStep {
                from: from?,
                to: to?,
                releases: step.releases,
                states: states.map(str::to_owned).collect(),
                answers: answers.collect(),
                instance,
            })
        };
        let steps: Vec<ExpectedStep> = chain.steps.iter().map(step).collect::<Option<_>>()?;
        let is_followed = steps.iter().zip(steps.iter().skip(1));
        // A recording does not show which data a decision is from.
        let is_followed = chain.ends.is_some()
            && !steps.is_empty()
            && !chain.steps.iter().any(|it| it.decides)
            && is_followed
                .map(|(one, next)| [one.to.kind, next.from.kind])
                .all(|it| it == [SpanKind::Access; 2]);
        is_followed.then(|| ExpectedChain {
            name: chain.name.to_string(),
            bound: chain.latency.map(Time::as_nanos),
            limit: chain.limit.map(Time::as_nanos),
            steps,
        })
    }

    /// A recording does not show what operations carry.
    fn end(&self, instance: &Name, end: &PassageEnd<'db>) -> Option<ExpectedEnd> {
        match end {
            PassageEnd::Port(port) => self.port(instance, port),
            PassageEnd::Codel(codel) => {
                Some(ExpectedEnd { kind: SpanKind::Codel, key: codel.qualified(self.db) })
            }
            PassageEnd::Operation(_) => None,
        }
    }

    fn port(&self, instance: &str, port: &str) -> Option<ExpectedEnd> {
        let component = self.flat.instance(instance)?.component?;
        let key = access_key(&format!("{}.{port}", component.qualified(self.db)));
        Some(ExpectedEnd { kind: SpanKind::Access, key })
    }
}
