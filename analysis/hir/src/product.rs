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
use std::hash::BuildHasher as _;
use std::sync::Arc;

use hashbrown::HashTable;
use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::{Behaviour, Fired, behaviour_of};
use crate::body::{BodyId, ByProgram, OperationHead, Place, ProgramIn, by_group, core_scope, of_program};
use crate::cost::{Cost, Costs, Execution, NOTHING};
use crate::infer::{VariableOf, inference_of, shared_variables};
use crate::item_tree::{HookKind, Parameter, SourceId, TypeRef};
use crate::program_graph::{ProgramGraph, graph_of, graphs_of_group};
use crate::project::Project;
use crate::resolve::VariableId;
use crate::source::Decl;
use crate::structure::structure_of;
use crate::types::{Type, type_of};

use followed::{FollowedVariables, followed_of, is_small, shared};
use outcomes::{
    ANY, OnlyPath, Outcomes, ProgramOutcome, ReducedOperation, ReducedProgram, Reduction, Valuation,
};

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
    valuations: ValuationTable,
}

/// A state and the values at the start of a period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProductState {
    /// An index in [`Behaviour::states`].
    pub state: u32,
    valuation: u32,
}

/// A possible execution of one period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProductEdge {
    /// Index of the product state at the start of the period.
    pub source: u32,
    /// Index of the one at the start of the next period.
    pub target: u32,
    /// Its edge without values: an index in [`crate::Edges::all`].
    pub edge: u32,
    /// An index in [`Product::costs`].
    pub cost: u32,
}

impl ProductEdge {
    /// Returns the indices of the product states at its ends.
    pub fn ends(&self) -> (usize, usize) {
        (self.source as usize, self.target as usize)
    }
}

impl Product<'_> {
    /// Returns the values of the variables that differ between states: `count = 3, busy = true`.
    pub fn values_in(&self, state: usize) -> String {
        let valuation = self.states.get(state).map(|it| self.valuations.get(it.valuation));
        let known = self.shown.iter().filter_map(|(name, ty, index)| {
            let value = *valuation?.get(*index)?;
            (value != ANY).then(|| format!("{name} = {}", written(value, ty)))
        });
        known.collect::<Vec<_>>().join(", ")
    }

    /// Returns whether it follows the values of variables.
    pub fn has_values(&self) -> bool {
        self.valuations.len > 0
    }
}

/// The product of a core, and what its jobs execute.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub(crate) struct Explored<'db> {
    pub(crate) product: Arc<Product<'db>>,
    /// What jobs execute that has conditions, by the state of the product in which they begin: a program, and the valuation before it.
    executed: Box<[(u32, u32)]>,
    /// For each state of the product, the end of its part of `executed`.
    ends: Box<[u32]>,
    valuations: ValuationTable,
    /// The variables that are not followed, since they have too many values.
    widened: Vec<VariableId>,
}

/// A product with what its values decide.
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
        let from = all.partition_point(|it| it.source < source);
        let own = all.iter().skip(from).take_while(move |it| it.source == source);
        own.filter(move |it| it.edge as usize == edge).map(|it| it.target)
    }
}

/// Returns the product with what its values decide; none if it follows no variable. Only passages need it: an edit that moves a
/// condition in the text changes this, and not the product.
#[salsa::tracked(returns(ref))]
pub(crate) fn interpreted_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<Arc<Interpreted<'db>>> {
    let explored = explored_of(db, project, of).as_ref()?;
    let behaviour = behaviour_of(db, project, of);
    let ExecutedPrograms { programs, .. } =
        ExecutedPrograms::new(db, project, of, behaviour, followed_of(db, project, of));
    let mut decided: FxHashMap<(u32, SourceId), Option<bool>> = FxHashMap::default();
    let (mut begin, mut steps) = (0, 0);
    for (state, &end) in (0..).zip(&explored.ends) {
        db.unwind_if_revision_cancelled();
        for &(program, valuation) in explored.executed.get(begin..end as usize).unwrap_or_default() {
            let values = explored.valuations.get(valuation);
            let Some((program, indices)) = programs.get(program as usize) else { continue };
            let outcomes = program.outcomes(&explored.widened, &projected(values, indices), &mut steps);
            for &(condition, holds) in &outcomes.decided {
                let known = decided.entry((state, condition)).or_insert(holds);
                *known = known.filter(|it| holds == Some(*it));
            }
        }
        begin = end as usize;
    }
    db.note_nodes(steps);
    let decided = decided.into_iter().filter_map(|(key, holds)| Some((key, holds?))).collect();
    Some(Arc::new(Interpreted { product: explored.product.clone(), decided }))
}

/// Returns the values of some variables in a valuation.
fn projected(values: &[i32], indices: &[usize]) -> Valuation {
    indices.iter().map(|index| values.get(*index).copied().unwrap_or(ANY)).collect()
}

/// Returns the product of a core; without states if the core is not analysed.
#[salsa::tracked(returns(ref))]
pub fn product_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Arc<Product<'db>> {
    let behaviour = behaviour_of(db, project, of);
    if !behaviour.refusals.is_empty() {
        return Arc::default();
    }
    let found = explored_of(db, project, of).as_ref().map(|it| it.product.clone());
    found.unwrap_or_else(|| Arc::new(without_values(behaviour)))
}

/// Returns the product with what its jobs execute; none if it follows no variable, or the core is not analysed.
#[salsa::tracked(returns(ref))]
fn explored_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<Arc<Explored<'db>>> {
    let followed = followed_of(db, project, of);
    let behaviour = (!followed.variables.is_empty()).then(|| behaviour_of(db, project, of))?;
    if !behaviour.refusals.is_empty() || behaviour.states.is_empty() {
        return None;
    }
    let executed = ExecutedPrograms::new(db, project, of, behaviour, followed);
    let fired = behaviour.fired();
    let shared = shared_variables(db, project, of);
    let (mut combined, mut widened) = (0, Vec::new());
    while combined < MAX_ALL_COMBINED {
        let mut explorer = Explorer {
            db,
            behaviour,
            shared,
            of: &executed,
            fired: &fired,
            widened: &widened,
            valuations: Valuations::new(executed.variables.len()),
            outcomes: Vec::new(),
            numbers: FxHashMap::default(),
            calls: FxHashMap::default(),
            only: OnlyPath::default(),
            next: Vec::new(),
            open: Vec::new(),
            executed: Vec::new(),
            costs: Costs::new(),
            seen: Vec::new(),
            of_programs: vec![Vec::new(); behaviour.programs.len()],
            combined: 0,
            is_too_large: false,
        };
        let found = explorer.product();
        db.note_nodes(explorer.only.steps);
        if let Some(found) = found {
            return Some(Arc::new(found));
        }
        combined += explorer.combined;
        let is_kept = |id: &VariableId| followed.variables.contains(id) && !widened.contains(id);
        let seen = explorer.seen.iter().filter(|(id, _)| is_kept(id));
        let most = seen.max_by_key(|(id, seen)| (seen.known.len(), Reverse(*id)))?.0;
        widened.push(most);
    }
    None
}

/// Returns the product of a core that follows no variable: the edges of its behaviour, each along the worst paths of its programs.
fn without_values<'db>(behaviour: &Behaviour<'db>) -> Product<'db> {
    let mut costs = Costs::new();
    let mut programs: Vec<Option<u32>> = vec![None; behaviour.programs.len()];
    for index in behaviour.edges.executed() {
        if let (Some(program), Some(known)) = (behaviour.programs.get(index), programs.get_mut(index))
            && known.is_none()
        {
            let parts = costs.include(&program.cost.parts, |it| Cost::One(it.clone()));
            let cost = parts.get(program.cost.root as usize).copied().unwrap_or(NOTHING);
            *known = Some(costs.add(Cost::Program(index, cost)));
        }
    }
    let mut sums = behaviour.edges.sums(NOTHING, |sum, index| {
        programs.get(index).copied().flatten().map_or(sum, |cost| costs.sum(sum, cost))
    });
    let edges = (0..).zip(behaviour.edges.all.iter().zip(sums.drain(..)));
    let edges = edges.map(|(edge, (ends, cost))| ProductEdge {
        source: ends.source as u32,
        target: ends.target as u32,
        edge,
        cost,
    });
    let edges = edges.collect();
    let states = 0..behaviour.states.len() as u32;
    costs.parts.shrink_to_fit();
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
        let inference = inference_of(db, project, of, group);
        let parameter = |it: &Parameter| (inference.local(group, it.name.id), is_small(it.ty.as_ref()));
        Some(ReducedOperation {
            graph: graph_of(db, project, of, body, ProgramIn::Whole)?.clone(),
            parameters: head.parameters.iter().map(parameter).collect(),
            is_result_small: is_small(head.result.as_ref()),
        })
    };
    (0..).zip(&scope.operations).map_while(operation).collect()
}

/// Returns the programs of one of several groups of bodies with their outcomes so far. An edit keeps those of other groups.
#[salsa::tracked(returns(ref))]
fn programs_of_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> ByProgram<Arc<ReducedProgram<'db>>> {
    programs_in(db, project, of, group)
}

fn programs_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> ByProgram<Arc<ReducedProgram<'db>>> {
    let FollowedVariables { variables, farthest, .. } = followed_of(db, project, of);
    let followed = variables.iter().copied().collect();
    let operations = operations_of(db, project, of);
    let reduction = Reduction { followed: &followed, farthest: *farthest, operations };
    let all = graphs_of_group(db, project, of, group).iter();
    let program = |(id, graph): &(ProgramIn, Arc<ProgramGraph<'db>>)| {
        (*id, Arc::new(ReducedProgram::new(*id, graph, &reduction)))
    };
    all.map(|body| body.iter().map(program).collect()).collect()
}

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
struct SeenValues {
    known: FxHashSet<i32>,
    any: bool,
}

/// Valuations of the same variables, one after the other: most are small, and a product has thousands.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct ValuationTable {
    /// The number of variables.
    width: usize,
    len: usize,
    values: Vec<i32>,
}

impl ValuationTable {
    fn new(width: usize) -> ValuationTable {
        ValuationTable { width, ..ValuationTable::default() }
    }

    fn push(&mut self, values: &[i32]) -> u32 {
        self.values.extend_from_slice(values);
        self.len += 1;
        self.len as u32 - 1
    }

    fn get(&self, number: u32) -> &[i32] {
        let begin = number as usize * self.width;
        self.values.get(begin..begin + self.width).unwrap_or_default()
    }
}

/// The valuations of the followed variables so far, each once.
#[derive(Default)]
struct Valuations {
    table: ValuationTable,
    numbers: HashTable<u32>,
    scratch: Vec<i32>,
}

impl Valuations {
    fn new(width: usize) -> Valuations {
        Valuations { table: ValuationTable::new(width), ..Valuations::default() }
    }

    fn number(&mut self, values: &[i32]) -> u32 {
        let table = &mut self.table;
        let hash = FxBuildHasher.hash_one(values);
        if let Some(&known) = self.numbers.find(hash, |it| table.get(*it) == values) {
            return known;
        }
        let number = table.push(values);
        self.numbers.insert_unique(hash, number, |it| FxBuildHasher.hash_one(table.get(*it)));
        number
    }

    /// Returns a valuation after changes.
    fn changed<'a>(
        &mut self,
        before: u32,
        changes: impl Iterator<Item = (&'a usize, &'a i32)> + Clone,
    ) -> u32 {
        if changes.clone().all(|(index, value)| self.values(before).get(*index) == Some(value)) {
            return before;
        }
        let mut values = std::mem::take(&mut self.scratch);
        values.clear();
        values.extend_from_slice(self.values(before));
        changes.for_each(|(index, value)| values.get_mut(*index).into_iter().for_each(|it| *it = *value));
        let number = self.number(&values);
        self.scratch = values;
        number
    }

    fn values(&self, number: u32) -> &[i32] {
        self.table.get(number)
    }
}

/// A path through programs: whether the last one, a guard, holds, the valuation, and the cost: an index in [`Product::costs`].
#[derive(Clone, Copy)]
struct ProductPath {
    holds: bool,
    values: u32,
    cost: u32,
}

/// A program, and the index of each of its variables in a valuation.
type Used<'db> = (Arc<ReducedProgram<'db>>, Box<[usize]>);

/// Where the component executes programs between jobs, by their index; none that it does not have.
#[derive(Clone, Copy)]
struct Hooks {
    core_values: Option<u32>,
    configure: Option<u32>,
    machine_values: Option<u32>,
    start: Option<u32>,
    entry: Option<u32>,
    stop: Option<u32>,
    cleanup: Option<u32>,
}

/// What a component executes.
struct ExecutedPrograms<'db> {
    /// The shared variables that are followed; a valuation has their values.
    variables: Vec<VariableId>,
    /// The indices of those that operations assign, which clients may call between two periods.
    by_operations: Vec<usize>,
    programs: Vec<Used<'db>>,
    hooks: Hooks,
    /// For each program of the behaviour, its index in `programs`.
    of_jobs: Vec<Option<u32>>,
}

impl<'db> ExecutedPrograms<'db> {
    fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        of: Decl<'db>,
        behaviour: &Behaviour<'db>,
        followed: &FollowedVariables,
    ) -> ExecutedPrograms<'db> {
        let variables: Vec<VariableId> =
            followed.variables.iter().copied().filter(|it| it.group.is_none()).collect();
        let by_operations = followed.by_operations.iter();
        let by_operations =
            by_operations.filter_map(|it| variables.iter().position(|own| own == it)).collect();
        let mut programs: Vec<Used<'db>> = Vec::new();
        let mut numbers: FxHashMap<Place, u32> = FxHashMap::default();
        let scope = core_scope(db, of).as_ref();
        let of_group = |group| programs_of_group(db, project, of, group);
        let groups = by_group(db, of, || programs_in(db, project, of, 0), of_group);
        let mut find = |place: Place| {
            if let Some(&known) = numbers.get(&place) {
                return Some(known);
            }
            let (group, index) = scope?.place(place.0)?;
            let program = of_program(groups.get(group)?.as_ref(), index, place.1)?.clone();
            let index = |variable: &VariableId| variables.iter().position(|it| it == variable);
            let indices = program.variables().iter().filter_map(index).collect();
            programs.push((program, indices));
            numbers.insert(place, programs.len() as u32 - 1);
            Some(programs.len() as u32 - 1)
        };
        let of_jobs = behaviour.programs.iter().map(|it| find(it.place)).collect();
        let structure = structure_of(db, of);
        let mut hook = |kind| find((structure?.hook(kind)?, ProgramIn::Whole));
        let (configure, start) = (hook(HookKind::Configure), hook(HookKind::Start));
        let (stop, cleanup) = (hook(HookKind::Stop), hook(HookKind::Cleanup));
        let hooks = Hooks {
            core_values: find((BodyId::CoreValues, ProgramIn::Whole)),
            configure,
            machine_values: find((BodyId::MachineValues, ProgramIn::Whole)),
            start,
            entry: structure.as_ref().and_then(|it| find(it.initial_entry()?)),
            stop,
            cleanup,
        };
        ExecutedPrograms { variables, by_operations, programs, hooks, of_jobs }
    }
}

struct Explorer<'a, 'db> {
    db: &'db dyn ModelDb,
    behaviour: &'db Behaviour<'db>,
    shared: &'db [VariableOf],
    of: &'a ExecutedPrograms<'db>,
    /// See [`Behaviour::fired`].
    fired: &'a [Fired],
    widened: &'a [VariableId],
    valuations: Valuations,
    /// The outcomes of programs that may have several, with the index of each of their costs in [`Product::costs`]; and their
    /// indices, by program and valuation.
    outcomes: Vec<(Arc<Outcomes>, Vec<u32>)>,
    numbers: FxHashMap<(u32, u32), u32>,
    /// The costs of calls, by program and call.
    calls: FxHashMap<(u32, u32), u32>,
    /// The path through the current program, if it is the only one; otherwise its paths.
    only: OnlyPath,
    next: Vec<ProductPath>,
    /// The paths of the current job.
    open: Vec<ProductPath>,
    executed: Vec<(u32, u32)>,
    costs: Costs<Execution<'db>>,
    seen: Vec<(VariableId, SeenValues)>,
    /// The costs of programs of jobs, by program of the behaviour: that of an execution, and that of its program.
    of_programs: Vec<Vec<(u32, u32)>>,
    combined: usize,
    is_too_large: bool,
}

impl<'db> Explorer<'_, 'db> {
    /// Returns the product; none if it is beyond a limit.
    fn product(&mut self) -> Option<Explored<'db>> {
        let start = (Where::Unconfigured, self.valuations.number(&vec![ANY; self.of.variables.len()]));
        let (mut numbers, mut all) = (FxHashMap::from_iter([(start, 0)]), vec![start]);
        // Their ends are indices of places, at first.
        let mut edges: Vec<ProductEdge> = Vec::new();
        let (mut next, mut running) = (0, 0);
        let (mut ends, mut found): (Vec<u32>, _) = (Vec::new(), Vec::new());
        while let Some(&(place, values)) = all.get(next) {
            self.db.unwind_if_revision_cancelled();
            self.hooks(place, values, &mut found);
            if let Where::Running(state) = place {
                self.job(state, values, &mut found);
                ends.push(self.executed.len() as u32);
            }
            let first = edges.len();
            for (place, values, job) in found.drain(..) {
                let entry = (place, self.between_periods(values));
                let target = *numbers.entry(entry).or_insert(all.len() as u32);
                if target as usize == all.len() {
                    all.push(entry);
                    running += usize::from(matches!(place, Where::Running(_)));
                }
                let source = next as u32;
                edges.extend(job.map(|(edge, cost)| ProductEdge { source, target, edge: edge as u32, cost }));
            }
            // Of parallel edges, the greatest cost counts.
            if edges.len() > first + 1 {
                let mut own = edges.split_off(first);
                own.sort_by_key(|it| (it.edge, it.target));
                for edge in own {
                    match edges.last_mut().filter(|it| ProductEdge { cost: edge.cost, ..**it } == edge) {
                        Some(known) => known.cost = self.costs.greatest(known.cost, edge.cost),
                        None => edges.push(edge),
                    }
                }
            }
            next += 1;
            let is_beyond = running > MAX_STATES || edges.len() > MAX_EDGES || self.combined > MAX_COMBINED;
            if is_beyond || self.is_too_large {
                return None;
            }
        }
        let product = Arc::new(self.finished(&all, edges));
        self.valuations.table.values.shrink_to_fit();
        Some(Explored {
            product,
            executed: std::mem::take(&mut self.executed).into(),
            ends: ends.into(),
            valuations: std::mem::take(&mut self.valuations.table),
            widened: self.widened.to_vec(),
        })
    }

    /// Returns a valuation after clients have called operations between two periods.
    fn between_periods(&mut self, values: u32) -> u32 {
        if self.of.by_operations.is_empty() {
            return values;
        }
        self.valuations.changed(values, self.of.by_operations.iter().map(|index| (index, &ANY)))
    }

    fn finished(&mut self, all: &[(Where, u32)], mut edges: Vec<ProductEdge>) -> Product<'db> {
        let state_of = |place: &Where| if let Where::Running(state) = place { Some(*state) } else { None };
        let running: Vec<(usize, u32)> =
            all.iter().filter_map(|(place, values)| Some((state_of(place)?, *values))).collect();
        // The valuations of these states only, in their order.
        let mut numbers: FxHashMap<u32, u32> = FxHashMap::default();
        let mut valuations = ValuationTable::new(self.of.variables.len());
        let mut states = Vec::with_capacity(running.len());
        for (state, values) in running {
            let add = || valuations.push(self.valuations.values(values));
            let valuation = *numbers.entry(values).or_insert_with(add);
            states.push(ProductState { state: state as u32, valuation });
        }
        let declared: FxHashMap<VariableId, &VariableOf> = shared(self.shared).collect();
        let (mut shown, mut values) = (Vec::new(), Vec::new());
        for (index, id) in self.of.variables.iter().enumerate().filter(|(_, id)| !self.widened.contains(id)) {
            let Some(variable) = declared.get(id) else { continue };
            let values_of =
                (0..valuations.len as u32).filter_map(|it| valuations.get(it).get(index).copied());
            let own: BTreeSet<i32> = values_of.collect();
            if own.len() > 1 {
                shown.push((variable.name.name.to_string(), variable.ty.clone(), index));
            }
            own.into_iter().for_each(|value| see(&mut self.seen, *id, value));
            let seen = self.seen.iter().find(|(it, _)| it == id);
            values.extend(seen.map(|(_, seen)| (variable.name.id, described(seen, &variable.ty))));
        }
        let number = |next: &mut u32, (place, _): &(Where, u32)| {
            Some(std::mem::replace(next, *next + u32::from(state_of(place).is_some())))
        };
        let numbers: Vec<u32> = all.iter().scan(0, number).collect();
        for end in edges.iter_mut().flat_map(|it| [&mut it.source, &mut it.target]) {
            *end = numbers.get(*end as usize).copied().unwrap_or_default();
        }
        edges.shrink_to_fit();
        valuations.values.shrink_to_fit();
        let mut costs = std::mem::take(&mut self.costs.parts);
        costs.shrink_to_fit();
        Product { states, initial: 0, edges, costs, values, shown, valuations }
    }

    /// Adds where a component may be after a hook, and the values then. Hooks may return false.
    fn hooks(&mut self, place: Where, values: u32, found: &mut Vec<ProductStep>) {
        let mut add =
            |place, paths: &[ProductPath]| found.extend(paths.iter().map(|it| (place, it.values, None)));
        let mut now = vec![ProductPath { holds: false, values, cost: NOTHING }];
        let Hooks { core_values, configure, machine_values, start, entry, stop, cleanup } = self.of.hooks;
        match place {
            Where::Unconfigured => {
                self.execute(&mut now, core_values, None);
                self.execute(&mut now, configure, None);
                add(Where::Stopped, &now);
                add(Where::Unconfigured, &now);
            }
            Where::Stopped => {
                let mut cleaned = now.clone();
                self.execute(&mut cleaned, cleanup, None);
                self.execute(&mut now, machine_values, None);
                self.execute(&mut now, start, None);
                let mut running = now.clone();
                self.execute(&mut running, entry, None);
                add(Where::Running(self.behaviour.initial), &running);
                add(Where::Stopped, &now);
                add(Where::Unconfigured, &cleaned);
            }
            Where::Running(_) => {
                self.execute(&mut now, stop, None);
                add(Where::Stopped, &now);
            }
        }
    }

    /// Adds the edges that a job may execute, each with the next state and the values then.
    fn job(&mut self, state: usize, values: u32, found: &mut Vec<ProductStep>) {
        let behaviour = self.behaviour;
        let mut open = std::mem::take(&mut self.open);
        open.clear();
        open.push(ProductPath { holds: false, values, cost: NOTHING });
        let mut finish = |this: &mut Self, index: usize, mut paths: Vec<ProductPath>| {
            let Some(edge) = behaviour.edges.all.get(index) else { return paths };
            edge.then.iter().for_each(|&program| this.execute_in_job(&mut paths, program));
            let next = |it: &ProductPath| (Where::Running(edge.target), it.values, Some((index, it.cost)));
            found.extend(paths.iter().map(next));
            paths
        };
        let first = behaviour.edges.first.get(state);
        let Some((first, Fired { by_guards, otherwise })) = first.zip(self.fired.get(state)) else {
            return;
        };
        for (&program, edge) in first.iter().zip(by_guards) {
            self.execute_in_job(&mut open, program);
            if open.iter().any(|it| it.holds) {
                let stays: Vec<ProductPath> = open.iter().filter(|it| !it.holds).copied().collect();
                open.retain(|it| it.holds);
                if let Some(edge) = *edge {
                    open = finish(self, edge, open);
                }
                open.clear();
                open.extend(stays);
            }
        }
        if let Some(edge) = *otherwise {
            open = finish(self, edge, open);
        }
        self.open = open;
    }

    /// Continues each path with a program of a job.
    fn execute_in_job(&mut self, paths: &mut Vec<ProductPath>, program: usize) {
        let used = self.of.of_jobs.get(program).copied().flatten();
        let has_conditions =
            |it: &u32| self.of.programs.get(*it as usize).is_some_and(|it| it.0.has_conditions());
        let deciding = used.filter(has_conditions).into_iter();
        self.executed.extend(deciding.flat_map(|used| paths.iter().map(move |it| (used, it.values))));
        self.execute(paths, used, Some(program));
    }

    /// Continues each path with a program; `of_job` is its index in [`Behaviour::programs`]. Of the paths with the same end and the
    /// same values, the greatest cost counts.
    fn execute(&mut self, paths: &mut Vec<ProductPath>, program: Option<u32>, of_job: Option<usize>) {
        let Some(program) = program else {
            paths.iter_mut().for_each(|it| it.holds = false);
            return;
        };
        let after = |this: &mut Self, before: u32, own: u32| {
            let own = of_job.map_or(own, |index| this.cost_of_program(index, own));
            this.costs.sum(before, own)
        };
        if let [before] = **paths {
            paths.clear();
            self.step(program, before.values, paths);
            self.combined += paths.len() + paths.len() * paths.len() / 16;
            for path in paths {
                path.cost = after(self, before.cost, path.cost);
            }
            return;
        }
        let mut next = std::mem::take(&mut self.next);
        for before in std::mem::take(paths) {
            // A job beyond the limit is left at once.
            if self.combined > MAX_COMBINED {
                break;
            }
            self.step(program, before.values, &mut next);
            for path in next.drain(..) {
                self.combined += 1 + paths.len() / 8;
                let cost = after(self, before.cost, path.cost);
                match paths.iter_mut().find(|it| it.holds == path.holds && it.values == path.values) {
                    Some(known) => known.cost = self.costs.greatest(known.cost, cost),
                    None => paths.push(ProductPath { cost, ..path }),
                }
            }
        }
        self.next = next;
    }

    fn cost_of_program(&mut self, index: usize, own: u32) -> u32 {
        let Some(known) = self.of_programs.get_mut(index) else { return own };
        if let Some((_, cost)) = known.iter().find(|(it, _)| *it == own) {
            return *cost;
        }
        let cost = self.costs.add(Cost::Program(index, own));
        known.push((own, cost));
        cost
    }

    /// Adds the paths of a program from a valuation.
    fn step(&mut self, program: u32, values: u32, found: &mut Vec<ProductPath>) {
        let Some((used, indices)) = self.of.programs.get(program as usize) else { return };
        let before = self.valuations.values(values);
        // Most programs use no followed variable.
        let key = (program, if indices.is_empty() { u32::MAX } else { values });
        let number = match self.numbers.get(&key) {
            Some(known) => *known,
            None => {
                self.only.registers.clear();
                self.only.registers.extend(indices.iter().map(|it| before.get(*it).copied().unwrap_or(ANY)));
                if !indices.is_empty()
                    && let Some(holds) = used.only_path(self.widened, &mut self.only)
                {
                    let mut cost = NOTHING;
                    for &call in &self.only.calls {
                        let own = self.calls.entry((program, call));
                        let own = own.or_insert_with(|| self.costs.add(used.cost_of(call)));
                        cost = self.costs.sum(cost, *own);
                    }
                    self.only.seen.iter().for_each(|&(it, value)| see(&mut self.seen, it, value));
                    let values = self.valuations.changed(values, indices.iter().zip(&self.only.registers));
                    return found.push(ProductPath { holds, values, cost });
                }
                let own = projected(before, indices);
                let outcomes = used.outcomes(self.widened, &own, &mut self.only.steps);
                let costs = self.costs.include(&outcomes.costs, |step| used.cost_of(*step));
                outcomes.seen.iter().for_each(|&(variable, value)| see(&mut self.seen, variable, value));
                self.is_too_large |= outcomes.is_too_large;
                self.outcomes.push((outcomes, costs));
                let number = self.outcomes.len() as u32 - 1;
                self.numbers.insert(key, number);
                number
            }
        };
        let Some((outcomes, costs)) = self.outcomes.get(number as usize) else { return };
        for ProgramOutcome { holds, values: after, cost } in &outcomes.all {
            let cost = costs.get(*cost as usize).copied().unwrap_or(NOTHING);
            let values = self.valuations.changed(values, indices.iter().zip(after));
            found.push(ProductPath { holds: *holds, values, cost });
        }
    }
}

/// Where a component is next, its valuation then, and the edge that it executes, with its cost.
type ProductStep = (Where, u32, Option<(usize, u32)>);

fn see(all: &mut Vec<(VariableId, SeenValues)>, variable: VariableId, value: i32) {
    let place = all.iter().position(|(it, _)| *it == variable).unwrap_or_else(|| {
        all.push((variable, SeenValues::default()));
        all.len() - 1
    });
    match (value, all.get_mut(place)) {
        (ANY, Some((_, seen))) => seen.any = true,
        (value, Some((_, seen))) => _ = seen.known.insert(value),
        (_, None) => {}
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
fn described(seen: &SeenValues, ty: &Type) -> String {
    let known: BTreeSet<i32> = seen.known.iter().copied().collect();
    let all: Vec<String> = known.iter().map(|value| written(*value, ty)).collect();
    match (all.as_slice(), known.first(), known.last()) {
        _ if seen.any => "any".to_owned(),
        ([first, .., last], Some(&low), Some(&high))
            if all.len() > 8 || all.len() > 2 && i64::from(high) - i64::from(low) < all.len() as i64 =>
        {
            format!("{first} … {last}")
        }
        _ => all.join(", "),
    }
}
