//! The states of a core together with the values of its small variables: counters, modes, flags.
//!
//! ```text
//! update = { if count == 0 { plan(); count = 9; } else { count = count - 1; } }
//!     count = 0 → count = 9: plan()        count = 9 → count = 8: nothing        …
//! ```
//!
//! The programs of a period are executed from each state and valuation that the generated code may reach. A value that is not
//! known (the result of a codel, what a port has, an integer that overflows or is far from each literal) is any: a condition on it
//! takes both branches. So each execution of a period is an edge of the product, and costs at most what the edge does. Independent
//! of times. A core without followed variables has one valuation.
//!
//! The number of states, edges and combined outcomes is limited. Beyond a limit, the variable with the most values may have any, and
//! so on.

mod followed;
mod outcomes;

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::{Behaviour, Edge, behaviour_of};
use crate::body::{BodyId, ByProgram, OperationHead, Place, ProgramIn, core_scope, of_program};
use crate::cost::{Cost, Costs, Execution, NOTHING};
use crate::infer::{VariableOf, inference_of, shared_variables};
use crate::item_tree::{HookKind, MethodKind, Parameter, SourceId, TypeRef};
use crate::program_graph::{ProgramGraph, graph_of, graphs_of_group};
use crate::program_id::ProgramId;
use crate::project::Project;
use crate::resolve::VariableId;
use crate::source::Decl;
use crate::structure::structure_of;
use crate::types::{Type, type_of};

use followed::{Followed, followed_of, is_small, shared};
use outcomes::{ANY, Outcomes, Program, ReducedOperation, Reduction, Valuation};

/// The most states, and edges.
const MAX_STATES: usize = 4096;
const MAX_EDGES: usize = 1 << 16;
/// The most outcomes that one attempt combines.
const MAX_COMBINED: usize = 200_000;
/// The most of all attempts: the last one begins below it.
const MAX_ALL_COMBINED: usize = 500_000;

/// The states of a core together with the values of its followed variables, without times.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Product<'db> {
    /// The reachable ones.
    pub states: Vec<ProductState>,
    /// The index of the initial one.
    pub initial: usize,
    /// In the order of their sources.
    pub edges: Vec<ProductEdge>,
    /// What edges cost; each refers to earlier ones only.
    pub costs: Vec<Cost<'db>>,
    /// The values that each followed variable may have.
    pub values: Vec<(SourceId, String)>,
    /// The variables whose value differs between states: the name, the type, and the index in a valuation.
    shown: Vec<(String, Type, usize)>,
    valuations: Vec<Valuation>,
}

/// A state and the values at the start of a period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProductState {
    /// An index in [`Behaviour::states`].
    pub state: usize,
    valuation: u32,
}

/// A possible execution of one period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProductEdge {
    /// Index of the product state at the start of the period.
    pub source: usize,
    /// Index of the one at the start of the next period.
    pub target: usize,
    /// Its edge without values: an index in [`crate::Edges::all`].
    pub edge: usize,
    /// An index in [`Product::costs`].
    pub cost: u32,
}

impl Product<'_> {
    /// Returns the values of the variables that differ between states: `count = 3, busy = true`.
    pub fn values_in(&self, state: usize) -> String {
        let valuation = self.states.get(state).and_then(|it| self.valuations.get(it.valuation as usize));
        let known = self.shown.iter().filter_map(|(name, ty, index)| {
            let value = *valuation?.get(*index)?;
            (value != ANY).then(|| format!("{name} = {}", written(value, ty)))
        });
        known.collect::<Vec<_>>().join(", ")
    }

    /// Returns whether it follows the values of variables.
    pub fn has_values(&self) -> bool {
        !self.valuations.is_empty()
    }
}

/// The product of a core, and what its values decide.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct Interpreted<'db> {
    pub(crate) product: Arc<Product<'db>>,
    /// Whether a condition holds in all jobs from a state of the product, where it is the same in all of them.
    pub(crate) decided: FxHashMap<(u32, SourceId), bool>,
}

impl Interpreted<'_> {
    /// Returns the states of the product after a job that begins in one and executes an edge.
    pub(crate) fn after(&self, source: u32, edge: usize) -> impl Iterator<Item = u32> {
        let all = &self.product.edges;
        let from = all.partition_point(|it| it.source < source as usize);
        let own = all.iter().skip(from).take_while(move |it| it.source == source as usize);
        own.filter(move |it| it.edge == edge).map(|it| it.target as u32)
    }
}

/// Returns the product of a core; without states if the core is not analysed.
#[salsa::tracked(returns(ref))]
pub fn product_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Arc<Product<'db>> {
    let behaviour = behaviour_of(db, project, of);
    if !behaviour.refusals.is_empty() || behaviour.states.is_empty() {
        return Arc::default();
    }
    let found = explored(db, project, of, false).map(|it| it.product);
    found.unwrap_or_else(|| Arc::new(without_values(behaviour)))
}

/// Returns the product with what it decides; none if it follows no variable. Only passages need it: an edit that moves a condition in
/// the text changes this, and not the product.
#[salsa::tracked(returns(ref))]
pub(crate) fn interpreted_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<Arc<Interpreted<'db>>> {
    if !product_of(db, project, of).has_values() {
        return None;
    }
    explored(db, project, of, true).map(Arc::new)
}

/// Returns the product of a core that follows no variable: the edges of its behaviour, each along the worst paths of its programs.
fn without_values<'db>(behaviour: &Behaviour<'db>) -> Product<'db> {
    let mut costs = Costs::new();
    let mut programs: Vec<Option<u32>> = vec![None; behaviour.programs.len()];
    for index in behaviour.edges.executed() {
        if let (Some(program), Some(known)) = (behaviour.programs.get(index), programs.get_mut(index))
            && known.is_none()
        {
            let cost = costs.include(&program.cost.parts, program.cost.root, |it| Cost::One(it.clone()));
            *known = Some(costs.add(Cost::Program(index, cost)));
        }
    }
    let mut sums = behaviour.edges.sums(NOTHING, |sum, index| {
        programs.get(index).copied().flatten().map_or(sum, |cost| costs.sum(sum, cost))
    });
    let edges = behaviour.edges.all.iter().zip(sums.drain(..)).enumerate();
    let edges = edges.map(|(index, (edge, cost))| ProductEdge {
        source: edge.source,
        target: edge.target,
        edge: index,
        cost,
    });
    let edges = edges.collect();
    let states = 0..behaviour.states.len();
    Product {
        states: states.map(|state| ProductState { state, valuation: 0 }).collect(),
        initial: behaviour.initial,
        edges,
        costs: costs.parts,
        ..Product::default()
    }
}

/// The operations of a core, as its programs execute them.
#[salsa::tracked(returns(ref))]
fn operations_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Vec<ReducedOperation<'db>> {
    let Some(scope) = core_scope(db, of) else { return Vec::new() };
    let is_small = |ty: Option<&TypeRef>| is_small(&type_of(db, project, of, ty));
    let operation = |(index, head): (u32, &OperationHead)| {
        let body = BodyId::Operation(index);
        let group = scope.group(body)?;
        let variables = &inference_of(db, project, of, group).variables;
        let parameter = |it: &Parameter| {
            let index = variables.partition_point(|variable| variable.name.id < it.name.id) as u32;
            (VariableId { group: Some(group), index }, is_small(it.ty.as_ref()))
        };
        Some(ReducedOperation {
            graph: graph_of(db, project, of, body, ProgramIn::Whole)?.clone(),
            parameters: head.parameters.iter().map(parameter).collect(),
            is_result_small: is_small(head.result.as_ref()),
        })
    };
    (0..).zip(&scope.operations).map_while(operation).collect()
}

/// Returns the programs of a group of bodies with their outcomes so far. An edit keeps those of other groups.
#[salsa::tracked(returns(ref))]
fn programs_of_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> ByProgram<Arc<Program<'db>>> {
    let Followed { variables, farthest, .. } = followed_of(db, project, of);
    let followed = variables.iter().copied().collect();
    let operations = operations_of(db, project, of);
    let reduction = Reduction { followed: &followed, farthest: *farthest, operations };
    let all = graphs_of_group(db, project, of, group).iter();
    let program = |(id, graph): &(ProgramIn, Arc<ProgramGraph<'db>>)| {
        (*id, Arc::new(Program::new(*id, graph, &reduction)))
    };
    all.map(|body| body.iter().map(program).collect()).collect()
}

fn explored<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    decides: bool,
) -> Option<Interpreted<'db>> {
    let followed = followed_of(db, project, of);
    if followed.variables.is_empty() {
        return None;
    }
    let behaviour = behaviour_of(db, project, of);
    let all = shared_variables(db, project, of);
    let mut kept: FxHashSet<VariableId> = followed.variables.iter().copied().collect();
    let (mut combined, mut is_first) = (0, true);
    while combined < MAX_ALL_COMBINED {
        let mut explorer = Explorer {
            db,
            project,
            of,
            behaviour,
            shared: all,
            is_first: std::mem::take(&mut is_first),
            variables: shared(all).map(|(id, _)| id).filter(|id| kept.contains(id)).collect(),
            followed: &kept,
            farthest: followed.farthest,
            by_operations: Vec::new(),
            programs: FxHashMap::default(),
            used: Vec::new(),
            found: Vec::new(),
            costs: Costs::new(),
            seen: FxHashMap::default(),
            decided: decides.then(FxHashMap::default),
            job: None,
            combined: 0,
            is_too_large: false,
        };
        let by_operations = followed.by_operations.iter();
        explorer.by_operations =
            by_operations.filter_map(|it| explorer.variables.iter().position(|own| own == it)).collect();
        if let Some(found) = explorer.product() {
            return Some(found);
        }
        combined += explorer.combined;
        let seen = explorer.seen.iter().filter(|(id, _)| kept.contains(id));
        let widened = *seen.max_by_key(|(id, seen)| (seen.known.len(), Reverse(**id)))?.0;
        kept.remove(&widened);
    }
    None
}

/// What paths end with, with the values then, and their cost: an index in [`Product::costs`].
type Paths<E> = Vec<(E, Valuation, u32)>;

/// Where a component is between two periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Where {
    /// Before `configure`, and after `cleanup`.
    Unconfigured,
    /// Before `start`, and after `stop`.
    Stopped,
    Running(usize),
}

/// The values that a variable gets.
#[derive(Debug, Default)]
struct Seen {
    known: BTreeSet<i32>,
    any: bool,
}

/// A program of this core, with the index of each of its variables in a valuation, and its outcomes by their values.
struct Used<'db> {
    program: Arc<Program<'db>>,
    indices: Vec<usize>,
    outcomes: FxHashMap<Valuation, u32>,
}

/// Outcomes, with the index of each of their costs in [`Product::costs`].
struct UsedOutcomes {
    outcomes: Arc<Outcomes>,
    costs: Vec<u32>,
}

struct Explorer<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    behaviour: &'db Behaviour<'db>,
    shared: &'db [VariableOf],
    /// Whether all variables are followed, as in the programs that the database has.
    is_first: bool,
    /// The shared variables that are followed; a valuation has their values.
    variables: Vec<VariableId>,
    followed: &'a FxHashSet<VariableId>,
    farthest: i32,
    /// The indices of those that operations assign, which clients may call between two periods.
    by_operations: Vec<usize>,
    /// The programs so far; none that the core does not have.
    programs: FxHashMap<Place, Option<usize>>,
    used: Vec<Used<'db>>,
    found: Vec<UsedOutcomes>,
    costs: Costs<Execution<'db>>,
    seen: FxHashMap<VariableId, Seen>,
    /// Whether the conditions of each job hold; none where one may, and may not.
    decided: Option<FxHashMap<(usize, SourceId), Option<bool>>>,
    /// The number of the state and values from which a job is executed.
    job: Option<usize>,
    combined: usize,
    is_too_large: bool,
}

fn ends<E, F>(paths: Paths<E>, end: impl Fn(E) -> F) -> Paths<F> {
    paths.into_iter().map(|(it, values, cost)| (end(it), values, cost)).collect()
}

impl<'db> Explorer<'_, 'db> {
    /// Returns the product; none if it is beyond a limit.
    fn product(&mut self) -> Option<Interpreted<'db>> {
        let unknown: Valuation = vec![ANY; self.variables.len()].into();
        let start = (Where::Unconfigured, unknown);
        let (mut numbers, mut all) = (FxHashMap::from_iter([(start.clone(), 0)]), vec![start]);
        let mut edges: Vec<((usize, usize, usize), u32)> = Vec::new();
        let (mut next, mut running) = (0, 0);
        while let Some((place, values)) = all.get(next).cloned() {
            self.db.unwind_if_revision_cancelled();
            let mut found: Vec<(Where, Valuation, Option<(usize, u32)>)> = Vec::new();
            for (place, paths) in self.hooks(place, &values) {
                found.extend(paths.into_iter().map(|(_, values, _)| (place, values, None)));
            }
            if let Where::Running(state) = place {
                running += 1;
                self.job = Some(next);
                found.extend(self.job(state, values).into_iter().map(|((edge, target), values, cost)| {
                    (Where::Running(target), values, Some((edge, cost)))
                }));
                self.job = None;
            }
            let first = edges.len();
            for (place, mut values, executed) in found {
                // Clients may call operations between two periods.
                for index in &self.by_operations {
                    values.get_mut(*index).into_iter().for_each(|it| *it = ANY);
                }
                let entry = (place, values);
                let number = *numbers.entry(entry.clone()).or_insert(all.len());
                if number == all.len() {
                    all.push(entry);
                }
                edges.extend(executed.map(|(edge, cost)| ((next, edge, number), cost)));
            }
            // Of parallel edges, the greatest cost counts.
            let mut own = edges.split_off(first);
            own.sort_by_key(|(ends, _)| *ends);
            for (ends, cost) in own {
                match edges.last_mut().filter(|(known, _)| *known == ends) {
                    Some((_, known)) => *known = self.costs.greatest(*known, cost),
                    None => edges.push((ends, cost)),
                }
            }
            next += 1;
            let is_beyond = running > MAX_STATES || edges.len() > MAX_EDGES || self.combined > MAX_COMBINED;
            if is_beyond || self.is_too_large {
                return None;
            }
        }
        Some(self.finished(&all, edges))
    }

    fn finished(
        &mut self,
        all: &[(Where, Valuation)],
        edges: Vec<((usize, usize, usize), u32)>,
    ) -> Interpreted<'db> {
        let state_of = |place: &Where| if let Where::Running(state) = place { Some(*state) } else { None };
        let running = || all.iter().filter_map(|(place, values)| Some((state_of(place)?, values)));
        let declared: FxHashMap<VariableId, &VariableOf> = shared(self.shared).collect();
        let variables = self.variables.iter().enumerate();
        let variables: Vec<_> =
            variables.filter_map(|(index, id)| Some((index, *id, *declared.get(id)?))).collect();
        let mut shown = Vec::new();
        for &(index, id, variable) in &variables {
            let values: BTreeSet<i32> =
                running().filter_map(|(_, values)| values.get(index).copied()).collect();
            if values.len() > 1 {
                shown.push((variable.name.name.to_string(), variable.ty.clone(), index));
            }
            values.into_iter().for_each(|value| self.see(id, value));
        }
        let described = |(_, id, it): &(usize, VariableId, &VariableOf)| {
            Some((it.name.id, described(self.seen.get(id)?, &it.ty)))
        };
        let values = variables.iter().filter_map(described).collect();
        let mut numbers: FxHashMap<&Valuation, u32> = FxHashMap::default();
        let mut valuations = Vec::new();
        let mut states = Vec::new();
        for (state, values) in running() {
            let valuation = *numbers.entry(values).or_insert_with(|| {
                valuations.push(values.clone());
                valuations.len() as u32 - 1
            });
            states.push(ProductState { state, valuation });
        }
        let number: Vec<usize> = all
            .iter()
            .scan(0, |next, (place, _)| {
                Some(std::mem::replace(next, *next + usize::from(state_of(place).is_some())))
            })
            .collect();
        let edge = |((source, edge, target), cost): ((usize, usize, usize), u32)| {
            Some(ProductEdge { source: *number.get(source)?, target: *number.get(target)?, edge, cost })
        };
        let product = Product {
            states,
            initial: 0,
            edges: edges.into_iter().filter_map(edge).collect(),
            costs: std::mem::take(&mut self.costs.parts),
            values,
            shown,
            valuations,
        };
        let decided = self.decided.take().unwrap_or_default().into_iter();
        let decided = decided
            .filter_map(|((job, condition), holds)| Some(((*number.get(job)? as u32, condition), holds?)));
        Interpreted { decided: decided.collect(), product: Arc::new(product) }
    }

    /// Returns where a component may be after a hook, and the values then. Hooks may return false.
    fn hooks(&mut self, place: Where, values: &Valuation) -> Vec<(Where, Paths<()>)> {
        let now: Paths<()> = vec![((), values.clone(), NOTHING)];
        let structure = structure_of(self.db, self.of);
        let hook = |kind| Some((structure?.hook(kind)?, ProgramIn::Whole));
        match place {
            Where::Unconfigured => {
                let configured = self.execute(Some((BodyId::CoreValues, ProgramIn::Whole)), now);
                let configured = self.execute(hook(HookKind::Configure), configured);
                vec![(Where::Stopped, configured.clone()), (Where::Unconfigured, configured)]
            }
            Where::Stopped => {
                let cleaned = self.execute(hook(HookKind::Cleanup), now.clone());
                let started = self.execute(Some((BodyId::MachineValues, ProgramIn::Whole)), now);
                let started = self.execute(hook(HookKind::Start), started);
                let states = structure.and_then(|it| it.machine()).map(|(_, states)| states);
                let entry = states.into_iter().flatten().zip(0..).find(|(state, _)| state.initial);
                let entry = entry.and_then(|(state, index)| {
                    Some((BodyId::State(0, index), state.method(MethodKind::Entry)?))
                });
                let running = self.execute(entry, started.clone());
                let place = Where::Running(self.behaviour.initial);
                vec![(place, running), (Where::Stopped, started), (Where::Unconfigured, cleaned)]
            }
            Where::Running(_) => vec![(Where::Stopped, self.execute(hook(HookKind::Stop), now))],
        }
    }

    /// Executes a program, if the core has it.
    fn execute(&mut self, place: Option<Place>, paths: Paths<()>) -> Paths<()> {
        match place.and_then(|place| self.used_at(place)) {
            Some(program) => self.after(paths, |this, (), values| ends(this.outcomes(program, &values), |_| ())),
            None => paths,
        }
    }

    /// Returns the edges that a job may execute, each with the next state and the values then.
    fn job(&mut self, state: usize, values: Valuation) -> Paths<(usize, usize)> {
        let edges = &self.behaviour.edges;
        let begin = edges.all.partition_point(|edge| edge.source < state);
        let own = edges.all.iter().enumerate().skip(begin);
        let mut own = own.take_while(|(_, edge)| edge.source == state).peekable();
        let (mut open, mut found): (Paths<()>, _) = (vec![((), values, NOTHING)], Vec::new());
        let finish = |this: &mut Self, (index, edge): (usize, &Edge), mut paths: Paths<()>| {
            for &program in &edge.then {
                paths = this.after(paths, |this, (), values| ends(this.program(program, values), |_| ()));
            }
            ends(paths, |()| (index, edge.target))
        };
        for &program in edges.first.get(state).into_iter().flatten() {
            let guarded = match self.behaviour.programs.get(program).map(|it| &it.id) {
                Some(ProgramId::Guard { transition, .. }) => Some(transition),
                _ => None,
            };
            let after = self.after(open, |this, (), values| this.program(program, values));
            let (fires, stays): (Vec<_>, Vec<_>) = after.into_iter().partition(|(holds, _, _)| *holds);
            let is_own =
                |(_, edge): &(usize, &Edge)| guarded.is_some() && edge.transition.as_ref() == guarded;
            if let Some(edge) = own.next_if(is_own) {
                found.extend(finish(self, edge, ends(fires, |_| ())));
            }
            open = ends(stays, |_| ());
        }
        if let Some(edge) = own.next() {
            found.extend(finish(self, edge, open));
        }
        found
    }

    /// Executes a program. Returns whether a guard holds; false for other programs.
    fn program(&mut self, index: usize, values: Valuation) -> Paths<bool> {
        let place = self.behaviour.programs.get(index).map(|it| it.place);
        let Some(program) = place.and_then(|place| self.used_at(place)) else {
            return vec![(false, values, NOTHING)];
        };
        let mut paths = self.outcomes(program, &values);
        paths.iter_mut().for_each(|(_, _, cost)| *cost = self.costs.add(Cost::Program(index, *cost)));
        paths
    }

    fn used_at(&mut self, place: Place) -> Option<usize> {
        if let Some(&found) = self.programs.get(&place) {
            return found;
        }
        let program = self.program_at(place).map(|program| {
            let index = |variable: &VariableId| self.variables.iter().position(|it| it == variable);
            let indices = program.variables().iter().filter_map(index).collect();
            self.used.push(Used { program, indices, outcomes: FxHashMap::default() });
            self.used.len() - 1
        });
        self.programs.insert(place, program);
        program
    }

    fn program_at(&self, (body, program): Place) -> Option<Arc<Program<'db>>> {
        let (db, project, of) = (self.db, self.project, self.of);
        if self.is_first {
            let (group, index) = core_scope(db, of).as_ref()?.place(body)?;
            let all = programs_of_group(db, project, of, group as u32);
            return of_program(all, index, program).cloned();
        }
        let operations = operations_of(db, project, of);
        let reduction = Reduction { followed: self.followed, farthest: self.farthest, operations };
        Some(Arc::new(Program::new(program, graph_of(db, project, of, body, program)?, &reduction)))
    }

    /// Executes a program from a valuation.
    fn outcomes(&mut self, program: usize, values: &Valuation) -> Paths<bool> {
        let Some(used) = self.used.get_mut(program) else { return Vec::new() };
        let own: Valuation = used.indices.iter().map(|it| values.get(*it).copied().unwrap_or(ANY)).collect();
        let number = match used.outcomes.get(&own) {
            Some(&number) => number as usize,
            None => {
                let outcomes = used.program.outcomes(&own);
                let number = self.found.len();
                used.outcomes.insert(own, number as u32);
                self.is_too_large |= outcomes.is_too_large;
                let roots = outcomes.all.iter().map(|it| it.cost);
                let call = |step: &u32| used.program.cost_of(*step);
                let costs = roots.map(|root| self.costs.include(&outcomes.costs, root, call)).collect();
                outcomes.seen.iter().for_each(|&(variable, value)| self.see(variable, value));
                self.found.push(UsedOutcomes { outcomes, costs });
                number
            }
        };
        let (Some(found), Some(used)) = (self.found.get(number), self.used.get(program)) else {
            return Vec::new();
        };
        if let (Some(decided), Some(job)) = (&mut self.decided, self.job) {
            for &(condition, holds) in &found.outcomes.decided {
                let known = decided.entry((job, condition)).or_insert(holds);
                *known = known.filter(|it| holds == Some(*it));
            }
        }
        let path = |(outcome, cost): (&outcomes::Outcome, &u32)| {
            let mut values = values.clone();
            for (index, value) in used.indices.iter().zip(&outcome.values) {
                values.get_mut(*index).into_iter().for_each(|it| *it = *value);
            }
            (outcome.holds, values, *cost)
        };
        found.outcomes.all.iter().zip(&found.costs).map(path).collect()
    }

    /// Continues each path. Of those with the same end and the same values, the greatest cost counts.
    fn after<E, F: PartialEq>(
        &mut self,
        paths: Paths<E>,
        mut next: impl FnMut(&mut Self, E, Valuation) -> Paths<F>,
    ) -> Paths<F> {
        let mut found: Paths<F> = Vec::new();
        for (end, values, before) in paths {
            // A job beyond the limit is left at once.
            if self.combined > MAX_COMBINED {
                break;
            }
            for (end, values, cost) in next(self, end, values) {
                self.combined += 1 + found.len() / 8;
                let cost = self.costs.sum(before, cost);
                match found.iter_mut().find(|(it, known, _)| *it == end && *known == values) {
                    Some((_, _, known)) => *known = self.costs.greatest(*known, cost),
                    None => found.push((end, values, cost)),
                }
            }
        }
        found
    }

    fn see(&mut self, variable: VariableId, value: i32) {
        let seen = self.seen.entry(variable).or_default();
        match value {
            ANY => seen.any = true,
            value => _ = seen.known.insert(value),
        }
    }
}

/// Returns a value as in a text.
fn written(value: i32, ty: &Type) -> String {
    let names = match ty {
        Type::Bool => ["false", "true", ""],
        Type::PortStatus => ["no_data", "old_data", "new_data"],
        Type::CallStatus => ["failure", "not_ready", "success"],
        _ => return value.to_string(),
    };
    usize::try_from(value).ok().and_then(|value| names.get(value)).copied().unwrap_or_default().to_owned()
}

/// `0 … 9`, `true, false`, `1, 4, 7`, `any`.
fn described(seen: &Seen, ty: &Type) -> String {
    let all: Vec<String> = seen.known.iter().map(|value| written(*value, ty)).collect();
    match (all.as_slice(), seen.known.first(), seen.known.last()) {
        _ if seen.any => "any".to_owned(),
        ([first, .., last], Some(&low), Some(&high))
            if all.len() > 8 || all.len() > 2 && i64::from(high) - i64::from(low) < all.len() as i64 =>
        {
            format!("{first} … {last}")
        }
        _ => all.join(", "),
    }
}
