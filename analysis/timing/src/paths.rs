//! Paths through a machine: the totals of all that matter, and one path with given totals.

use std::rc::Rc;

use crate::cycle_mean::Adjacency;
use crate::{StateMachine, Time, worst_trace};

/// The budget of the paths of one machine, in computed values.
const BUDGET_OF_PATHS: u64 = 1 << 20;

/// The maximum number of request functions of one machine.
const MOST_PATHS: usize = 128;

/// The maximum number of jobs of a path.
pub(crate) const LONGEST: usize = 10_000;

/// The maximum number of edges × jobs that a search for a path visits.
const MOST_CHOICES: usize = 10_000_000;

/// The request functions of a machine for up to n jobs, as a tree.
pub(crate) struct Requests {
    /// The root is the first.
    pub(crate) nodes: Vec<PathNode>,
}

pub(crate) struct PathNode {
    /// The totals of the first 1, 2, …, n edges.
    pub(crate) totals: Vec<u64>,
    pub(crate) children: Option<[usize; 2]>,
    pub(crate) leaves: usize,
}

impl Requests {
    fn new(mut functions: Vec<Vec<u64>>) -> Requests {
        // Neighbours are similar.
        functions.sort_unstable_by(|a, b| b.cmp(a));
        let mut requests = Requests { nodes: Vec::new() };
        requests.add(&functions);
        requests
    }

    fn add(&mut self, functions: &[Vec<u64>]) -> usize {
        let index = self.nodes.len();
        let mut totals = functions.first().cloned().unwrap_or_default();
        for function in functions {
            totals.iter_mut().zip(function).for_each(|(total, value)| *total = (*total).max(*value));
        }
        self.nodes.push(PathNode { totals, children: None, leaves: functions.len() });
        if functions.len() > 1 {
            let (left, right) = functions.split_at(functions.len() / 2);
            let children = [self.add(left), self.add(right)];
            self.nodes[index].children = Some(children);
        }
        index
    }

    /// Returns the demand of the first `jobs` jobs; of all, if there are fewer.
    pub(crate) fn demand(&self, node: usize, jobs: u64) -> u64 {
        let totals = &self.nodes[node].totals;
        let last = usize::try_from(jobs).unwrap_or(usize::MAX).min(totals.len());
        last.checked_sub(1).and_then(|last| totals.get(last)).copied().unwrap_or(0)
    }
}

/// The paths of a machine: the totals of their first 1, 2, …, n edges, by the state where they end. A path that another with
/// the same end exceeds nowhere is left out: whatever continues it continues the other.
pub(crate) struct MachinePaths {
    successors: Adjacency,
    jobs: usize,
    ending_at: Vec<Vec<Vec<u64>>>,
    spent: u64,
    /// No paths of this length or a greater one are computed. It depends on the machine only.
    too_long: Option<usize>,
    /// The last result.
    requests: Option<(usize, Rc<Requests>)>,
}

impl MachinePaths {
    pub(crate) fn new(machine: &StateMachine) -> MachinePaths {
        let successors = Adjacency::new(machine);
        let ending_at = vec![vec![Vec::new()]; successors.states()];
        let too_long = (successors.states() > MOST_PATHS).then_some(1);
        MachinePaths { successors, jobs: 0, ending_at, spent: 0, too_long, requests: None }
    }

    /// Returns the request functions of `jobs` ≥ 1 jobs, without those that another exceeds nowhere; `None` if there are too
    /// many.
    pub(crate) fn requests(&mut self, jobs: u64, interrupt: &dyn Fn()) -> Option<Rc<Requests>> {
        let jobs = usize::try_from(jobs).ok()?;
        while self.too_long.is_none() && self.jobs < jobs {
            interrupt();
            self.extend();
        }
        if self.too_long.is_some_and(|too_long| jobs >= too_long) {
            return None;
        }
        if let Some((_, requests)) = self.requests.as_ref().filter(|(of, _)| *of == jobs) {
            return Some(requests.clone());
        }
        let functions = self.ending_at.iter().flatten().map(|totals| totals[..jobs].to_vec());
        let requests = Rc::new(Requests::new(greatest(functions.collect())));
        self.requests = Some((jobs, requests.clone()));
        Some(requests)
    }

    fn extend(&mut self) {
        let mut next: Vec<Vec<Vec<u64>>> = vec![Vec::new(); self.ending_at.len()];
        for (state, paths) in self.ending_at.iter().enumerate() {
            for &(target, cost) in self.successors.of(state) {
                for path in paths {
                    // M is not less, and fits.
                    let total = path.last().copied().unwrap_or(0).saturating_add(cost);
                    let mut path = path.clone();
                    path.push(total);
                    next[target as usize].push(path);
                }
            }
        }
        let jobs = self.jobs + 1;
        let candidates: usize = next.iter().map(Vec::len).sum();
        self.spent += (candidates * jobs) as u64;
        for paths in &mut next {
            *paths = greatest(std::mem::take(paths));
        }
        let kept: usize = next.iter().map(Vec::len).sum();
        if kept > MOST_PATHS || self.spent > BUDGET_OF_PATHS {
            self.too_long = Some(jobs);
        } else {
            (self.ending_at, self.jobs) = (next, jobs);
        }
    }
}

/// Returns the functions that no other exceeds everywhere.
fn greatest(mut functions: Vec<Vec<u64>>) -> Vec<Vec<u64>> {
    // A function that is nowhere less than another is before it.
    functions.sort_unstable_by(|a, b| b.cmp(a));
    let mut kept: Vec<Vec<u64>> = Vec::new();
    for function in functions {
        let is_below = |other: &Vec<u64>| other.iter().zip(&function).all(|(other, value)| other >= value);
        if !kept.iter().any(is_below) {
            kept.push(function);
        }
    }
    kept
}

/// The path of an interfering task in a window.
pub(crate) struct TaskPath {
    /// The index of the task.
    pub(crate) task: usize,
    /// See [`Window::delay`](crate::Window::delay).
    pub(crate) delay: Time,
    /// The edges of its jobs; empty if no path is known.
    pub(crate) edges: Vec<usize>,
}

/// Returns a path whose first 1, 2, …, n edges have these totals; if there is none, one whose n edges have M(n).
pub(crate) fn path(machine: &StateMachine, totals: &[u64]) -> Vec<usize> {
    with_totals(machine, totals).or_else(|| worst_trace(machine, totals.len())).unwrap_or_default()
}

fn with_totals(machine: &StateMachine, totals: &[u64]) -> Option<Vec<usize>> {
    let states = machine.states() as usize;
    let visited = machine.edges().len().checked_mul(totals.len())?;
    if totals.len() > LONGEST || visited > MOST_CHOICES {
        return None;
    }
    // For each number of edges and each state, the last edge of a path to it.
    let mut reached = vec![true; states];
    let mut last: Vec<Vec<Option<usize>>> = Vec::with_capacity(totals.len());
    let mut before = 0u64;
    for &total in totals {
        let mut next = vec![None; states];
        for (index, edge) in machine.edges().iter().enumerate() {
            let is_next = before.checked_add(edge.cost.as_nanos()) == Some(total);
            if reached[edge.source as usize] && is_next {
                next[edge.target as usize].get_or_insert(index);
            }
        }
        reached = next.iter().map(Option::is_some).collect();
        last.push(next);
        before = total;
    }
    let mut state = reached.iter().position(|&is_reached| is_reached)?;
    let mut path = Vec::with_capacity(totals.len());
    for last in last.iter().rev() {
        let index = last[state]?;
        path.push(index);
        state = machine.edges().get(index)?.source as usize;
    }
    path.reverse();
    Some(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::machine;

    #[test]
    fn too_many_paths_are_refused() {
        let each = |states: u32| (0..states).map(|state| (state, state, 1)).collect::<Vec<_>>();
        let paths = |states: u32| MachinePaths::new(&machine(states, &each(states))).requests(1, &|| ());
        assert!(paths(128).is_some());
        assert!(paths(129).is_none());
        // 2 · (1 + 2 + … + n) values are less than 2²⁰ up to n = 1023.
        let mut paths = MachinePaths::new(&machine(2, &[(0, 1, 1), (1, 0, 2)]));
        assert!(paths.requests(1023, &|| ()).is_some());
        assert!(paths.requests(1024, &|| ()).is_none());
        assert!(paths.requests(1023, &|| ()).is_some());
    }

    #[test]
    fn totals_of_too_many_jobs() {
        let loops = |states: u32| -> Vec<(u32, u32, u64)> {
            (0..states).map(|state| (state, state, u64::from(state) + 1)).collect()
        };
        let ones = |jobs: u64| (1..=jobs).collect::<Vec<u64>>();
        let two = machine(2, &loops(2));
        assert_eq!(path(&two, &ones(10_000)), vec![0; 10_000]);
        assert!(path(&two, &ones(10_001)).is_empty());
        assert!(path(&machine(1001, &loops(1001)), &ones(10_000)).is_empty());
    }
}
