//! Periodic state machines: one edge per period, each with its execution time (paper, definitions 3 and 4).

use std::hash::{Hash, Hasher};
use std::sync::{Arc, OnceLock};

use crate::Time;
use crate::cycle_mean::{self, Adjacency, CycleMean};

/// One period of a machine, which goes from `source` to `target`.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Edge {
    /// The state at the start of the period.
    pub source: u32,
    /// The state at its end; it may be `source`.
    pub target: u32,
    /// The greatest execution time of the period (paper, eq. 6).
    pub cost: Time,
}

/// A periodic state machine (PSM): states 0, 1, …, and at least one edge out of each.
///
/// A busy window may begin in any state, so the caller omits states that the initial one does not reach. Parallel
/// edges are allowed; the one of greatest cost is used.
///
/// ```
/// use mauve_timing::{Edge, StateMachine, Time};
///
/// // A heavy edge that must leave its state before it can come again.
/// let edge = |source, target, cost| Edge { source, target, cost: Time::from_nanos(cost) };
/// let machine = StateMachine::new(2, vec![edge(0, 0, 1), edge(0, 1, 9), edge(1, 0, 2)])?;
/// assert_eq!(machine.greatest_edge(), 1);
/// let mean = machine.greatest_cycle_mean();
/// assert_eq!((mean.cost.as_nanos(), mean.length), (11, 2));
/// # Ok::<(), mauve_timing::MachineError>(())
/// ```
#[derive(Clone, Debug)]
pub struct StateMachine {
    states: u32,
    // Shared: each activity of the component has a copy of the machine.
    edges: Arc<MachineEdges>,
}

/// The edges of a machine, with what follows from them.
#[derive(Debug)]
struct MachineEdges {
    all: Box<[Edge]>,
    greatest_cost: Time,
    /// Whether an edge of the greatest cost can be taken in every period.
    greatest_repeats: bool,
    /// λ, from its first use on.
    mean: OnceLock<CycleMean>,
}

impl MachineEdges {
    fn new(all: Box<[Edge]>) -> MachineEdges {
        let greatest_cost = all.iter().map(|edge| edge.cost).max().unwrap_or_default();
        let repeats = |edge: &Edge| edge.cost == greatest_cost && edge.source == edge.target;
        MachineEdges { greatest_cost, greatest_repeats: all.iter().any(repeats), all, mean: OnceLock::new() }
    }
}

impl PartialEq for StateMachine {
    fn eq(&self, other: &StateMachine) -> bool {
        self.states == other.states
            && (Arc::ptr_eq(&self.edges, &other.edges) || self.edges() == other.edges())
    }
}

impl Eq for StateMachine {}

impl Hash for StateMachine {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        (self.states, self.edges()).hash(hasher);
    }
}

impl StateMachine {
    /// The most states that a machine may have, 2²⁴.
    pub const MAX_STATES: u32 = 1 << 24;

    /// Creates a machine of `states` states, 1 to [`MAX_STATES`](Self::MAX_STATES).
    ///
    /// The ends of all `edges` are below `states`, and every state is the source of one.
    pub fn new(states: u32, edges: Vec<Edge>) -> Result<StateMachine, MachineError> {
        if states == 0 {
            return Err(MachineError::NoState);
        }
        if states > StateMachine::MAX_STATES || u32::try_from(edges.len()).is_err() {
            return Err(MachineError::TooLarge);
        }
        let mut has_edge = vec![false; states as usize];
        let mut greatest = Time::ZERO;
        for (index, edge) in edges.iter().enumerate() {
            if edge.source >= states || edge.target >= states {
                return Err(MachineError::NoSuchState { edge: index });
            }
            has_edge[edge.source as usize] = true;
            greatest = greatest.max(edge.cost);
        }
        if let Some(state) = has_edge.iter().position(|&has_edge| !has_edge) {
            return Err(MachineError::DeadEnd { state: state as u32 });
        }
        // A cycle that visits every state once must have a total.
        if greatest.checked_mul(u64::from(states)).is_none() {
            return Err(MachineError::TooLarge);
        }
        Ok(StateMachine { states, edges: Arc::new(MachineEdges::new(edges.into())) })
    }

    /// Creates the machine of a classical task: one state and one edge of `cost`.
    pub fn single(cost: Time) -> StateMachine {
        StateMachine {
            states: 1,
            edges: Arc::new(MachineEdges::new(Box::new([Edge { source: 0, target: 0, cost }]))),
        }
    }

    /// Returns the machine with `time` more in every edge; `None` if that is too long.
    pub(crate) fn with_added(&self, time: Time) -> Option<StateMachine> {
        if time == Time::ZERO {
            return Some(self.clone());
        }
        let longer = |edge: &Edge| Some(Edge { cost: edge.cost.checked_add(time)?, ..edge.clone() });
        let edges: Option<Vec<Edge>> = self.edges().iter().map(longer).collect();
        StateMachine::new(self.states, edges?).ok()
    }

    /// Returns the number of states, at least 1.
    pub fn states(&self) -> u32 {
        self.states
    }

    /// The edges, in the order in which they were given.
    pub fn edges(&self) -> &[Edge] {
        &self.edges.all
    }

    /// Returns the index of the first edge of greatest cost.
    pub fn greatest_edge(&self) -> usize {
        let greatest = self.greatest_cost();
        self.edges().iter().position(|edge| edge.cost == greatest).unwrap_or_default()
    }

    /// The cost of [`greatest_edge`](Self::greatest_edge).
    pub fn greatest_cost(&self) -> Time {
        self.edges.greatest_cost
    }

    /// Returns λ, the greatest mean cost of a cycle: the worst average cost of a period in the long run.
    ///
    /// The result is exact; with several greatest cycles, it is any of them.
    pub fn greatest_cycle_mean(&self) -> CycleMean {
        self.interruptible_cycle_mean(&|| ())
    }

    /// [`greatest_cycle_mean`](Self::greatest_cycle_mean); the first call calls `interrupt` regularly, which may unwind.
    pub(crate) fn interruptible_cycle_mean(&self, interrupt: &dyn Fn()) -> CycleMean {
        if self.greatest_repeats() {
            return CycleMean { cost: self.greatest_cost(), length: 1 };
        }
        *self.edges.mean.get_or_init(|| cycle_mean::greatest(&Adjacency::new(self), interrupt))
    }

    /// Whether an edge of the greatest cost can be taken in every period.
    pub(crate) fn greatest_repeats(&self) -> bool {
        self.edges.greatest_repeats
    }
}

/// Why states and edges do not make a machine.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum MachineError {
    /// It has no state.
    NoState,
    /// The edge with this index starts or ends at a state that does not exist.
    NoSuchState {
        /// The index of the edge.
        edge: usize,
    },
    /// This state has no outgoing edge.
    DeadEnd {
        /// The state.
        state: u32,
    },
    /// More than 2²⁴ states or 2³² edges, or as many times the greatest cost as there are states exceeds 2⁶⁴ ns.
    TooLarge,
}

impl Adjacency {
    pub(crate) fn new(machine: &StateMachine) -> Adjacency {
        // A counting sort: how many start before each state, then each edge to the next free place of its state.
        let mut first = vec![0u32; machine.states as usize + 2];
        for edge in machine.edges() {
            first[edge.source as usize + 2] += 1;
        }
        for state in 2..first.len() {
            first[state] += first[state - 1];
        }
        let mut arcs = vec![(0, 0); machine.edges().len()];
        for edge in machine.edges() {
            let next = &mut first[edge.source as usize + 1];
            arcs[*next as usize] = (edge.target, edge.cost.as_nanos());
            *next += 1;
        }
        first.pop();
        Adjacency { first, arcs }
    }

    /// The reversed edges; and one more state, the last, that each state has an edge of cost 0 to, and it itself too.
    pub(crate) fn reversed(machine: &StateMachine) -> Adjacency {
        let zero = |source| (source, machine.states, 0);
        let reversed = machine.edges().iter().map(|edge| (edge.target, edge.source, edge.cost.as_nanos()));
        let mut edges: Vec<(u32, u32, u64)> = reversed.chain((0..=machine.states).map(zero)).collect();
        edges.sort_by_key(|&(source, ..)| source);
        let mut first = vec![0u32];
        for state in 0..=machine.states {
            let end = edges.partition_point(|&(source, ..)| source <= state);
            first.push(u32::try_from(end).unwrap_or(u32::MAX));
        }
        Adjacency { first, arcs: edges.into_iter().map(|(_, target, cost)| (target, cost)).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(source: u32, target: u32, cost: u64) -> Edge {
        Edge { source, target, cost: Time::from_nanos(cost) }
    }

    #[test]
    fn what_is_not_a_machine() {
        assert_eq!(StateMachine::new(0, vec![]), Err(MachineError::NoState));
        assert_eq!(StateMachine::new(1, vec![]), Err(MachineError::DeadEnd { state: 0 }));
        assert_eq!(
            StateMachine::new(2, vec![edge(0, 1, 0), edge(0, 2, 0)]),
            Err(MachineError::NoSuchState { edge: 1 })
        );
        assert_eq!(StateMachine::new(2, vec![edge(0, 1, 0)]), Err(MachineError::DeadEnd { state: 1 }));
        assert_eq!(
            StateMachine::new(2, vec![edge(0, 1, u64::MAX), edge(1, 0, 0)]),
            Err(MachineError::TooLarge)
        );
        assert_eq!(StateMachine::new(u32::MAX, vec![]), Err(MachineError::TooLarge));
    }

    #[test]
    fn the_first_greatest_edge() {
        let machine = StateMachine::new(2, vec![edge(0, 1, 3), edge(1, 0, 5), edge(1, 1, 5)]).unwrap();
        assert_eq!(machine.greatest_edge(), 1);
        assert_eq!(machine.greatest_cost(), Time::from_nanos(5));
        assert_eq!(StateMachine::single(Time::from_nanos(u64::MAX)).greatest_edge(), 0);
    }

    #[test]
    fn arcs_keep_the_order_of_the_edges() {
        let machine =
            StateMachine::new(2, vec![edge(1, 0, 4), edge(0, 1, 3), edge(1, 1, 2), edge(0, 0, 1)]).unwrap();
        let successors = Adjacency::new(&machine);
        assert_eq!(successors.of(0), [(1, 3), (0, 1)]);
        assert_eq!(successors.of(1), [(0, 4), (1, 2)]);
    }

    #[test]
    fn machines_of_the_same_edges_are_equal() {
        use std::hash::{DefaultHasher, Hasher};

        let of = |states, edges: &[Edge]| StateMachine::new(states, edges.to_vec()).unwrap();
        let hash = |machine: &StateMachine| {
            let mut hasher = DefaultHasher::new();
            machine.hash(&mut hasher);
            hasher.finish()
        };
        let edges = [edge(0, 1, 3), edge(1, 0, 5)];
        let machine = of(2, &edges);
        for same in [machine.clone(), of(2, &edges)] {
            assert!(same == machine && hash(&same) == hash(&machine));
        }
        let longer = of(3, &[edge(0, 1, 3), edge(1, 0, 5), edge(2, 0, 0)]);
        for other in [of(2, &[edge(0, 1, 3), edge(1, 0, 4)]), longer, StateMachine::single(Time::ZERO)] {
            assert!(other != machine && hash(&other) != hash(&machine));
        }
    }

    #[test]
    fn time_is_added_to_every_edge() {
        let machine = StateMachine::new(2, vec![edge(0, 1, 3), edge(1, 0, 5)]).unwrap();
        let longer = StateMachine::new(2, vec![edge(0, 1, 5), edge(1, 0, 7)]).unwrap();
        assert_eq!(machine.with_added(Time::from_nanos(2)), Some(longer));
        assert_eq!(machine.with_added(Time::ZERO), Some(machine.clone()));
        // Twice 2⁶³ does not fit, which a machine of two states must.
        assert_eq!(machine.with_added(Time::from_nanos(1 << 63)), None);
        assert_eq!(machine.with_added(Time::from_nanos(u64::MAX)), None);
    }
}
