//! The path of one instance through its state machine, from the programs that its periods executed.
//!
//! A period does not say its state. Several edges may execute the same programs: the last guard of a state without `handle`
//! leaves open whether its transition was taken. So the path is a set of possible states, as in the simulation of a
//! non-deterministic automaton, and an edge counts as observed when the next period leaves no other.

use rustc_hash::FxHashMap;

use super::model::ExpectedMachine;

/// The sequences of programs whose edges are remembered.
const MOST_SEQUENCES: usize = 1 << 12;

/// How often an edge was observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EdgeCount {
    /// Periods that executed this edge.
    pub observed: u64,
    /// Periods that executed this edge or another one with the same programs.
    pub possible: u64,
}

/// A period that no edge explains.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownPath {
    /// The state in which the period began, if it is known.
    pub state: Option<String>,
    /// The programs, in the order of execution.
    pub programs: Vec<String>,
    /// Whether an edge of another state has these programs.
    pub is_of_other_state: bool,
}

/// See the module.
#[derive(Debug)]
pub(super) struct MachinePath {
    /// The states that are possible at the start of the next period; `None` for all.
    states: Option<Vec<usize>>,
    /// The edges that the last period may have executed.
    last: Vec<usize>,
    pub(super) counts: Vec<EdgeCount>,
    edges: FxHashMap<Vec<u32>, Vec<usize>>,
}

impl MachinePath {
    pub(super) fn new(machine: &ExpectedMachine) -> MachinePath {
        MachinePath {
            states: None,
            last: Vec::new(),
            counts: vec![EdgeCount::default(); machine.edges.all.len()],
            edges: FxHashMap::default(),
        }
    }

    /// Makes the state unknown: periods may be missing.
    pub(super) fn forget(&mut self) {
        self.count(None);
        self.states = None;
    }

    /// Takes the programs of the next period. Returns whether no edge has them.
    pub(super) fn period(&mut self, machine: &ExpectedMachine, programs: &[u32]) -> Option<UnknownPath> {
        let edges = self.edges_with(machine, programs);
        let source = |edge: &usize| machine.edges.all.get(*edge).map(|edge| edge.source);
        let is_possible = |edge: &usize| match (&self.states, source(edge)) {
            (Some(states), Some(source)) => states.contains(&source),
            (None, Some(_)) => true,
            (_, None) => false,
        };
        let found: Vec<usize> = edges.iter().copied().filter(is_possible).collect();
        if found.is_empty() {
            let state = match self.states.as_deref() {
                Some([one]) => machine.states.get(*one).cloned(),
                _ => None,
            };
            let name = |program: &u32| machine.programs.get(*program as usize).cloned().unwrap_or_default();
            let is_of_other_state = !edges.is_empty();
            self.forget();
            return Some(UnknownPath {
                state,
                programs: programs.iter().map(name).collect(),
                is_of_other_state,
            });
        }
        let sources: Vec<usize> = found.iter().filter_map(source).collect();
        self.count(Some((machine, &sources)));
        let mut targets: Vec<usize> =
            found.iter().filter_map(|edge| Some(machine.edges.all.get(*edge)?.target)).collect();
        targets.sort_unstable();
        targets.dedup();
        self.states = Some(targets);
        self.last = found;
        None
    }

    /// Counts the edges of the last period: those that lead to the possible states of the next one.
    pub(super) fn count(&mut self, next: Option<(&ExpectedMachine, &[usize])>) {
        let mut last = std::mem::take(&mut self.last);
        if let Some((machine, sources)) = next {
            last.retain(|edge| {
                machine.edges.all.get(*edge).is_some_and(|edge| sources.contains(&edge.target))
            });
        }
        let is_only = last.len() == 1;
        for edge in last {
            if let Some(count) = self.counts.get_mut(edge) {
                count.possible += 1;
                count.observed += u64::from(is_only);
            }
        }
    }

    fn edges_with(&mut self, machine: &ExpectedMachine, programs: &[u32]) -> Vec<usize> {
        if let Some(edges) = self.edges.get(programs) {
            return edges.clone();
        }
        let has_them = |edge: &&mauve_hir::PeriodEdge| {
            machine.edges.programs(edge).eq(programs.iter().map(|program| *program as usize))
        };
        let all = machine.edges.all.iter().enumerate();
        let edges: Vec<usize> = all.filter(|(_, edge)| has_them(edge)).map(|(index, _)| index).collect();
        if self.edges.len() < MOST_SEQUENCES {
            self.edges.insert(programs.to_vec(), edges.clone());
        }
        edges
    }
}
