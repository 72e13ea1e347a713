//! The cost of each program along its worst path, as executions of codels. Independent of times: a changed timing table
//! invalidates no cost, a changed program only its own cost.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::hash::Hash;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::body::{ByProgram, by_group};
use crate::builtin::Builtin;
use crate::completeness::Completeness;
use crate::item_tree::{Name, SourceId};
use crate::program_graph::{Action, Call, Node, ProgramGraph, graphs_of_group};
use crate::project::Project;
use crate::resolve::Callee;
use crate::source::Decl;

/// The cost of some executions: of one, or of others, by their index. Parts are shared: as a tree, it may be exponentially large.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum CostOf<E> {
    /// No execution.
    Nothing,
    /// One execution.
    One(E),
    /// The sum of two.
    Sum(u32, u32),
    /// The maximum of two.
    Greatest(u32, u32),
    /// One execution of a program that costs this: an index in [`crate::Behaviour::programs`].
    Program(usize, u32),
    /// One execution of an operation that costs this: an index in [`crate::Behaviour::operations`].
    Operation(usize, u32),
}

/// The cost of executions that tables may have times of.
pub type Cost<'db> = CostOf<Execution<'db>>;

/// What has a time of its own.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum Execution<'db> {
    /// One execution of a codel.
    Codel(Decl<'db>),
    /// One call sent to this required operation. It takes no time of the sender.
    Send(Name),
    /// One read or write of this port, which copies a value.
    Access(Name),
    /// One execution of an operation along its worst path: an index into [`crate::Behaviour::operations`].
    Operation(usize),
}

impl<E> CostOf<E> {
    /// Returns it with other executions and other indices of its parts.
    fn with<F>(&self, one: impl Fn(&E) -> CostOf<F>, number: impl Fn(u32) -> u32) -> CostOf<F> {
        match self {
            CostOf::Nothing => CostOf::Nothing,
            CostOf::One(own) => one(own),
            CostOf::Sum(one, other) => CostOf::Sum(number(*one), number(*other)),
            CostOf::Greatest(one, other) => CostOf::Greatest(number(*one), number(*other)),
            CostOf::Program(index, inner) => CostOf::Program(*index, number(*inner)),
            CostOf::Operation(index, inner) => CostOf::Operation(*index, number(*inner)),
        }
    }
}

/// The cost of an execution.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct CostGraph<'db> {
    /// Each part refers to earlier ones only. Those without parts are in the order of the text.
    pub parts: Vec<Cost<'db>>,
    /// The index of the whole.
    pub root: u32,
}

impl Default for CostGraph<'_> {
    fn default() -> Self {
        CostGraph { parts: vec![Cost::Nothing], root: NOTHING }
    }
}

impl<'db> CostGraph<'db> {
    /// Returns a value of the whole; `of` computes that of each part from those of earlier ones.
    pub fn folded<V: Clone>(&self, of: impl FnMut(&Cost<'db>, &[V]) -> V) -> Option<V> {
        fold(&self.parts, of).get(self.root as usize).cloned()
    }

    /// Returns what it executes, each once, in the order of the text.
    pub fn executions(&self) -> impl Iterator<Item = &Execution<'db>> {
        self.parts.iter().filter_map(|it| if let Cost::One(one) = it { Some(one) } else { None })
    }

    /// Returns the codels that it executes, each once, without those of operations.
    pub fn codels(&self) -> impl Iterator<Item = Decl<'db>> {
        self.executions().filter_map(|it| if let Execution::Codel(codel) = it { Some(*codel) } else { None })
    }

    /// Returns the operations that it executes, each once, as indices into [`crate::Behaviour::operations`].
    pub fn operations(&self) -> impl Iterator<Item = usize> {
        self.executions()
            .filter_map(|it| if let Execution::Operation(index) = it { Some(*index) } else { None })
    }

    /// Returns the required operations that it sends calls to, each once, without those of the operations that it executes.
    pub fn sends(&self) -> BTreeSet<&Name> {
        self.executions()
            .filter_map(|it| if let Execution::Send(name) = it { Some(name) } else { None })
            .collect()
    }
}

/// Returns a value of each part of a cost; `of` computes it from those of earlier parts.
pub fn fold<E, V>(parts: &[CostOf<E>], mut of: impl FnMut(&CostOf<E>, &[V]) -> V) -> Vec<V> {
    let mut values: Vec<V> = Vec::with_capacity(parts.len());
    for part in parts {
        let value = of(part, &values);
        values.push(value);
    }
    values
}

/// The index of [`CostOf::Nothing`].
pub(crate) const NOTHING: u32 = 0;

/// Costs under construction: equal ones have one index.
#[derive(Debug)]
pub(crate) struct Costs<E> {
    pub(crate) parts: Vec<CostOf<E>>,
    numbers: FxHashMap<CostOf<E>, u32>,
    /// The sums, apart: most costs are sums.
    sums: FxHashMap<(u32, u32), u32>,
}

impl<E: Clone + Eq + Hash> Costs<E> {
    pub(crate) fn new() -> Costs<E> {
        let numbers = FxHashMap::from_iter([(CostOf::Nothing, NOTHING)]);
        Costs { parts: vec![CostOf::Nothing], numbers, sums: FxHashMap::default() }
    }

    pub(crate) fn add(&mut self, cost: CostOf<E>) -> u32 {
        let next = self.parts.len() as u32;
        if let CostOf::Sum(one, other) = cost {
            return *self.sums.entry((one, other)).or_insert_with(|| {
                self.parts.push(cost);
                next
            });
        }
        *self.numbers.entry(cost).or_insert_with_key(|cost| {
            self.parts.push(cost.clone());
            next
        })
    }

    /// Adds the parts of other costs, whose executions cost what `one` returns; returns their indices.
    pub(crate) fn include<F>(&mut self, parts: &[CostOf<F>], one: impl Fn(&F) -> CostOf<E>) -> Vec<u32> {
        let mut numbers: Vec<u32> = Vec::with_capacity(parts.len());
        for part in parts {
            let number = |index: u32| numbers.get(index as usize).copied().unwrap_or(NOTHING);
            let number = self.add(part.with(&one, number));
            numbers.push(number);
        }
        numbers
    }

    pub(crate) fn sum(&mut self, one: u32, other: u32) -> u32 {
        match (one, other) {
            (NOTHING, it) | (it, NOTHING) => it,
            _ => self.add(CostOf::Sum(one, other)),
        }
    }

    pub(crate) fn greatest(&mut self, one: u32, other: u32) -> u32 {
        match (one, other) {
            (NOTHING, it) | (it, NOTHING) => it,
            _ if one == other => one,
            _ => self.add(CostOf::Greatest(one, other)),
        }
    }
}

impl<'db> Call<'db> {
    /// Returns what the call itself costs; an operation costs what it executes.
    pub(crate) fn cost(&self) -> Cost<'db> {
        Cost::One(match self.callee {
            Some(Callee::Codel(codel)) => Execution::Codel(codel),
            Some(Callee::Operation(index)) => Execution::Operation(index),
            Some(Callee::Builtin(Builtin::Send)) => Execution::Send(self.operand.clone()),
            // Ports are lock-free (paper, Property 2), but copy values.
            Some(Callee::Builtin(Builtin::Read | Builtin::Write)) => Execution::Access(self.operand.clone()),
            Some(Callee::Builtin(Builtin::Status | Builtin::Collect)) | None => return Cost::Nothing,
        })
    }
}

/// The cost of a program or guard of a body.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct ProgramCost<'db> {
    pub(crate) completeness: Completeness,
    pub(crate) cost: Arc<CostGraph<'db>>,
    /// The value of a constant guard.
    pub(crate) constant: Option<bool>,
}

/// The costs of the programs of a group of bodies.
pub(crate) type ProgramCosts<'db> = ByProgram<ProgramCost<'db>>;

/// Returns the costs of the programs of a core, by group of bodies.
pub(crate) fn costs_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<Cow<'db, ProgramCosts<'db>>> {
    by_group(db, of, || costs_in(db, project, of, 0), |group| costs_of_group(db, project, of, group))
}

/// Returns the costs of the programs of one of several groups of bodies.
#[salsa::tracked(returns(ref))]
fn costs_of_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> ProgramCosts<'db> {
    costs_in(db, project, of, group)
}

fn costs_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> ProgramCosts<'db> {
    let cost = |graph: &ProgramGraph<'db>| ProgramCost {
        completeness: graph.completeness,
        cost: Arc::new(worst_cost(graph)),
        constant: graph.constant,
    };
    let all = graphs_of_group(db, project, of, group).iter();
    all.map(|body| body.iter().map(|(program, graph)| (*program, cost(graph))).collect()).collect()
}

/// Returns the cost along the longest path of a program.
pub(crate) fn worst_cost<'db>(graph: &ProgramGraph<'db>) -> CostGraph<'db> {
    longest(graph, |costs, node, after| {
        Some(match (node.action.is_return(), after) {
            (true, _) => NOTHING,
            (false, [Some(one), Some(other)]) => costs.greatest(one, other),
            (false, [one, other]) => one.or(other)?,
        })
    })
}

/// Returns the cost of a program up to the end of the last of these calls, along the worst path to it.
pub(crate) fn cost_until<'db>(graph: &ProgramGraph<'db>, until: &[SourceId]) -> CostGraph<'db> {
    longest(graph, |costs, node, after| {
        let is_end = matches!(node.action, Action::Call(_)) && until.contains(&node.at);
        let ends = after.into_iter().chain([is_end.then_some(NOTHING)]).flatten();
        ends.reduce(|one, other| costs.greatest(one, other))
    })
}

/// Returns the cost along the longest path, from the last node to the first: each costs what it does itself, and what `join` returns
/// for what is after it. `None` for a node that no such path comes to.
fn longest<'db>(
    graph: &ProgramGraph<'db>,
    join: impl Fn(&mut Costs<Execution<'db>>, &Node<'db>, [Option<u32>; 2]) -> Option<u32>,
) -> CostGraph<'db> {
    let mut costs = Costs::new();
    let reached = graph.reached();
    let own = graph.nodes.iter().zip(&reached).map(|(node, reached)| match &node.action {
        Action::Call(call) if *reached => costs.add(call.cost()),
        _ => NOTHING,
    });
    let own: Vec<u32> = own.collect();
    let mut found: Vec<Option<u32>> = vec![None; graph.nodes.len()];
    let nodes = graph.nodes.iter().enumerate().rev();
    for (index, node) in nodes.filter(|(index, _)| reached.get(*index) == Some(&true)) {
        let after = node.successors().map(|next| found.get(next? as usize).copied().flatten());
        let after = join(&mut costs, node, after);
        let sum = after.zip(own.get(index)).map(|(after, own)| costs.sum(*own, after));
        if let Some(cost) = found.get_mut(index) {
            *cost = sum;
        }
    }
    costs.parts.shrink_to_fit();
    let root = found.get(graph.start as usize).copied().flatten().unwrap_or(NOTHING);
    CostGraph { parts: costs.parts, root }
}
