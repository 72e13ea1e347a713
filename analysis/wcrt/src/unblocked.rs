//! What has to be assumed of the components on the way of a chain, so that they pass data on: the states that they do not leave, and
//! the codels and ports that answer.

use mauve_hir::item_tree::{Kind, Name};
use mauve_hir::{
    Assumption, Chain, Decl, ModelDb, Passage, Project, Skip, SkipCause, behaviour_of, core_of, deployed,
    names_of, passages_of,
};

use crate::chains::{ChainReason, ChainReport, ChainStepReport};

/// The values of `while` and `answers`, as they are written.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Unblocked {
    pub states: Vec<String>,
    pub answers: Vec<String>,
}

/// The most assumptions that are added for a component.
const MOST_STEPS: usize = 32;

/// Returns what the components of a chain without a latency need besides what `mauve.toml` says; `None` if they need nothing, or no
/// assumption helps.
pub fn unblocked<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    deployment: Decl<'db>,
    config: &Chain,
    chain: &ChainReport<'db>,
) -> Option<Unblocked> {
    let (flat, _) = deployed(db, project, deployment)?;
    let written = |all: &[(String, std::ops::Range<usize>)]| all.iter().map(|(it, _)| it.clone()).collect();
    let mut found = Unblocked { states: written(&config.states), answers: written(&config.answers) };
    let mut blocking: Vec<usize> = Vec::new();
    for reason in &chain.reasons {
        match reason {
            ChainReason::MaySkip { step, .. } | ChainReason::Overwrites { step, .. } => blocking.push(*step),
            _ => return None,
        }
    }
    blocking.dedup();
    for index in blocking {
        let step = chain.steps.get(index)?;
        let core = core_of(db, project, flat.instance(&step.instance)?.component?)?;
        let keeps = index + 1 < chain.steps.len();
        let prefix = format!("{}.", step.instance);
        let own = |all: &[String]| -> Vec<Name> {
            all.iter().filter_map(|it| it.strip_prefix(&prefix)).map(Name::from).collect()
        };
        let named = |name: &String| names_of(db, project).by_key(Kind::Codel, name);
        let all = &behaviour_of(db, project, core).states;
        let written = own(&found.states);
        let states = if written.is_empty() { all.clone() } else { written };
        let codels = found.answers.iter().flat_map(named).copied().collect();
        let ports = own(&found.answers);
        let attempt = Attempt { core, step, keeps, ports_answer: false, states, codels, ports };
        let with_ports = || Attempt { ports_answer: true, ..attempt.clone() }.with_states(db, project);
        let solved = attempt.clone().with_states(db, project).or_else(with_ports)?;
        if solved.states.len() < all.len() {
            found.states.retain(|it| !it.starts_with(&prefix));
            found.states.extend(solved.states.iter().map(|it| format!("{prefix}{it}")));
        }
        // Those before may be written without their libraries.
        let is_new = |it: &&Decl<'db>| found.answers.iter().all(|name| !named(name).contains(it));
        let codels: Vec<String> = solved.codels.iter().filter(is_new).map(|it| it.qualified(db)).collect();
        let ports = solved.ports.iter().map(|it| format!("{prefix}{it}"));
        let ports: Vec<String> = ports.filter(|it| !found.answers.contains(it)).collect();
        found.answers.extend(codels.into_iter().chain(ports));
    }
    Some(found)
}

/// A component on the way of a chain, and what is assumed of it.
#[derive(Clone)]
struct Attempt<'a, 'db> {
    core: Decl<'db>,
    step: &'a ChainStepReport<'db>,
    /// Whether what it wrote must not be overwritten.
    keeps: bool,
    /// Whether other ports may be assumed to have new data: only where nothing else helps.
    ports_answer: bool,
    states: Vec<Name>,
    codels: Vec<Decl<'db>>,
    ports: Vec<Name>,
}

impl<'db> Attempt<'_, 'db> {
    /// Adds what the component needs to pass data on; `None` if that does not help.
    fn solved(mut self, db: &'db dyn ModelDb, project: Project<'db>) -> Option<Self> {
        for _ in 0..MOST_STEPS {
            let passes = |(handles, decides): (bool, bool)| {
                let (states, codels, ports) = (self.states.clone(), self.codels.clone(), self.ports.clone());
                let assumption = Assumption::new(db, states, codels, ports, handles, decides);
                let all = &passages_of(db, project, self.core, assumption).all;
                all.iter().find(|it| [&it.from, &it.to] == [&self.step.passage[0], &self.step.passage[1]])
            };
            let found = Assumption::CARRIERS.into_iter().find_map(passes)?;
            match block(found, self.keeps) {
                None => return Some(self),
                Some(PassageBlock::States(blocking)) => {
                    let count = self.states.len();
                    self.states.retain(|it| !blocking.contains(it));
                    if self.states.is_empty() || self.states.len() == count {
                        return None;
                    }
                }
                Some(PassageBlock::Codel(codel)) if !self.codels.contains(&codel) => self.codels.push(codel),
                Some(PassageBlock::Port(port)) if self.ports_answer && !self.ports.contains(&port) => {
                    self.ports.push(port);
                }
                Some(PassageBlock::Codel(_) | PassageBlock::Port(_)) => return None,
            }
        }
        None
    }

    /// [`Attempt::solved`] with as many states as possible, otherwise with one.
    fn with_states(self, db: &'db dyn ModelDb, project: Project<'db>) -> Option<Self> {
        let one = |state: &Name| Attempt { states: vec![state.clone()], ..self.clone() }.solved(db, project);
        let singly = || self.states.iter().take(MOST_STEPS).find_map(one);
        self.clone().solved(db, project).or_else(singly)
    }
}

/// What keeps data from being passed on.
enum PassageBlock<'db> {
    States(Vec<Name>),
    Codel(Decl<'db>),
    Port(Name),
}

fn block<'db>(passage: &Passage<'db>, keeps: bool) -> Option<PassageBlock<'db>> {
    match &passage.releases {
        Err(Skip { cause: SkipCause::Answer(codel), .. }) => Some(PassageBlock::Codel(*codel)),
        Err(Skip { cause: SkipCause::OtherPort(port), .. }) => Some(PassageBlock::Port(port.clone())),
        Err(skip) if skip.cause == SkipCause::NoWrite => Some(PassageBlock::States(skip.states.clone())),
        // In other states, a condition may hold: each is tried alone.
        Err(_) => Some(PassageBlock::States(Vec::new())),
        Ok(_) => {
            let by = passage.overwritten.as_ref().filter(|_| keeps)?;
            Some(PassageBlock::States(vec![by.state.clone()]))
        }
    }
}
