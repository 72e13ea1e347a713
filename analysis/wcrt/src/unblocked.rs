//! What has to be assumed of the components on the way of a chain, so that they pass data on: the states that they do not leave, and
//! the codels and ports that answer.

use mauve_hir::item_tree::Name;
use mauve_hir::{
    Assumption, Chain, Decl, ModelDb, Passage, Project, Skip, SkipCause, behaviour_of, core_of, deployed,
    passages_of,
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
        let Assumed { states, answers } = assumed(db, project, core, step, keeps, &found)?;
        let prefix = format!("{}.", step.instance);
        let states: Vec<String> = states.iter().map(|it| format!("{prefix}{it}")).collect();
        if states.len() < behaviour_of(db, project, core).states.len() {
            found.states.retain(|it| !it.starts_with(&prefix));
            found.states.extend(states);
        }
        for answer in answers {
            if !found.answers.contains(&answer) {
                found.answers.push(answer);
            }
        }
    }
    Some(found)
}

struct Assumed {
    states: Vec<Name>,
    answers: Vec<String>,
}

/// Returns what a component needs to pass data on, and not to overwrite it if it `keeps` it.
fn assumed<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    core: Decl<'db>,
    step: &ChainStepReport<'db>,
    keeps: bool,
    before: &Unblocked,
) -> Option<Assumed> {
    let prefix = format!("{}.", step.instance);
    let own = |all: &[String]| -> Vec<Name> {
        all.iter().filter_map(|it| it.strip_prefix(&prefix)).map(Name::from).collect()
    };
    let mut states = own(&before.states);
    if states.is_empty() {
        states.clone_from(&behaviour_of(db, project, core).states);
    }
    let mut codels: Vec<Decl<'db>> = Vec::new();
    let mut ports = own(&before.answers);
    let named =
        |name: &String| mauve_hir::names_of(db, project).by_key(mauve_hir::item_tree::Kind::Codel, name);
    codels.extend(before.answers.iter().flat_map(|it| named(it).to_vec()));
    for _ in 0..MOST_STEPS {
        let assumption =
            |handles| Assumption::new(db, states.clone(), codels.clone(), ports.clone(), handles);
        let passes = |handles: bool| {
            let all = &passages_of(db, project, core, assumption(handles)).all;
            all.iter().find(|it| [&it.from, &it.to] == [&step.passage[0], &step.passage[1]])
        };
        let found = passes(false).or_else(|| passes(true))?;
        match block(found, keeps) {
            None => {
                let codels = codels.iter().map(|it| it.qualified(db));
                let ports = ports.iter().map(|it| format!("{prefix}{it}"));
                return Some(Assumed { answers: codels.chain(ports).collect(), states });
            }
            Some(Block::States(blocking)) => {
                let count = states.len();
                states.retain(|it| !blocking.contains(it));
                if states.is_empty() || states.len() == count {
                    return None;
                }
            }
            Some(Block::Codel(codel)) if !codels.contains(&codel) => codels.push(codel),
            Some(Block::Port(port)) if !ports.contains(&port) => ports.push(port),
            Some(Block::Codel(_) | Block::Port(_)) => return None,
        }
    }
    None
}

/// What keeps data from being passed on.
enum Block<'db> {
    States(Vec<Name>),
    Codel(Decl<'db>),
    Port(Name),
}

fn block<'db>(passage: &Passage<'db>, keeps: bool) -> Option<Block<'db>> {
    match &passage.releases {
        Err(Skip { cause: SkipCause::Answer(codel), .. }) => Some(Block::Codel(*codel)),
        Err(Skip { cause: SkipCause::OtherPort(port), .. }) => Some(Block::Port(port.clone())),
        Err(skip) => Some(Block::States(skip.states.clone())),
        Ok(_) => {
            let by = passage.overwritten.as_ref().filter(|_| keeps)?;
            Some(Block::States(vec![by.state.clone()]))
        }
    }
}
