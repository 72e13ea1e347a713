//! The states of a core together with the values of its small variables: counters, modes, flags.
//!
//! ```text
//! update = { if count == 0 { plan(); count = 9; } else { count = count - 1; } }
//!     count = 0 → count = 9: plan()        count = 9 → count = 8: nothing        …
//! ```
//!
//! The programs of a period are interpreted from each state and valuation that the generated code may reach. A value that is not
//! known (the result of a codel, what a port has, an integer that overflows or is far from each literal) is any: a condition on it
//! takes both branches. So each execution of a period is an edge of the product, and costs at most what the edge does. Independent
//! of times.
//!
//! The number of states, edges and steps is limited. Beyond a limit, the variable with the most values may have any, and so on.

mod followed;

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::{Behaviour, Edge, behaviour_of};
use crate::body::{BodyId, Code, CoreScope, code_of, core_scope};
use crate::builtin::Builtin;
use crate::cost::Cost;
use crate::infer::{Inference, VariableOf, directions_of, inference_of, shared_variables};
use crate::item_tree::{
    BinaryOperator, CallStatus, Core, Direction, Expr, HookKind, Literal, MethodKind, Name, NameRef,
    PortStatus, SourceId, Statement, UnaryOperator, Variable, is_logic, spine,
};
use crate::program_id::ProgramId;
use crate::project::Project;
use crate::resolve::{Binding, Callee, VariableId};
use crate::source::{Decl, core};
use crate::types::{Type, type_of};
use crate::values::{Value, whole_number};

use followed::{followed_of, is_small, shared};

/// The most states, and edges.
const MAX_STATES: usize = 4096;
const MAX_EDGES: usize = 1 << 16;
/// The most statements, operands and paths that one attempt interprets.
const MAX_STEPS: usize = 400_000;
/// The most of all attempts: the last one begins below it.
const MAX_ALL_STEPS: usize = 1_000_000;

/// The states of a core together with the values of its followed variables, without times.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Product<'db> {
    /// The reachable ones; the first one is initial.
    pub states: Vec<ProductState>,
    /// In the order of their sources.
    pub edges: Vec<ProductEdge>,
    /// What edges cost; each refers to earlier ones only.
    pub costs: Vec<ProductCost<'db>>,
    /// The values that each followed variable may have.
    pub values: Vec<(SourceId, String)>,
}

/// A state and the values at the start of a period.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProductState {
    /// An index in [`Behaviour::states`].
    pub state: usize,
    /// `count = 3, busy = true`: the variables whose value differs between states.
    pub values: String,
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

/// The cost of some executions. Parts are shared: as a tree, it may be exponentially large.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum ProductCost<'db> {
    /// One codel, access or call that is sent, or nothing.
    One(Cost<'db>),
    /// The sum of two.
    Sum(u32, u32),
    /// The maximum of two.
    Greatest(u32, u32),
    /// One execution of a program: an index in [`Behaviour::programs`].
    Program(usize, u32),
    /// One execution of an operation: an index in [`Behaviour::operations`].
    Operation(usize, u32),
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

/// Returns the product of a core; none if it follows no variable, or is not analysed.
#[salsa::tracked(returns(ref))]
pub fn product_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<Arc<Product<'db>>> {
    interpreted_of(db, project, of).as_ref().map(|it| it.product.clone())
}

/// Returns the product with what it decides. An edit that moves a condition in the text changes this only, and not the product.
#[salsa::tracked(returns(ref))]
pub(crate) fn interpreted_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Option<Arc<Interpreted<'db>>> {
    let followed = followed_of(db, project, of);
    let behaviour = (!followed.variables.is_empty()).then(|| behaviour_of(db, project, of))?;
    if !behaviour.refusals.is_empty() || behaviour.states.is_empty() {
        return None;
    }
    let (core, all) = (core(db, of)?, shared_variables(db, project, of));
    let mut interpreter = Interpreter {
        db,
        project,
        of,
        core,
        scope: core_scope(db, of).as_ref()?,
        behaviour,
        shared: all,
        indices: shared(all).map(|(id, it)| (it.name.id, id)).collect(),
        states: core.machines.first().map_or_else(FxHashMap::default, |it| it.state_indices()),
        followed: followed.variables.iter().copied().collect(),
        by_operations: &followed.by_operations,
        farthest: followed.farthest,
        aliases: FxHashMap::default(),
        group: 0,
        inference: inference_of(db, project, of, 0),
        costs: Vec::new(),
        numbers: FxHashMap::default(),
        seen: FxHashMap::default(),
        job: None,
        decided: FxHashMap::default(),
        steps: 0,
        most_steps: 0,
    };
    while interpreter.steps < MAX_ALL_STEPS {
        if let Some(found) = interpreter.product() {
            return Some(Arc::new(found));
        }
        let seen = interpreter.seen.iter().filter(|(id, _)| interpreter.followed.contains(id));
        let widened = *seen.max_by_key(|(id, seen)| (seen.known.len(), Reverse(**id)))?.0;
        interpreter.followed.remove(&widened);
    }
    None
}

/// The known values of variables: those that are not here may have any.
type Values = BTreeMap<VariableId, i32>;

/// What paths end with, with the values then, and their cost: an index in [`Product::costs`].
type Paths<E> = Vec<(E, Values, u32)>;

/// Where a component is next, with the values then, and the edge that it executes, with its cost.
type Next = (Place, Values, Option<(usize, u32)>);

/// The value of an expression; `None` if it may be any.
type Known = Option<i32>;

/// How a statement ends: by a `return` with this value, if there is one.
type Ended = Option<Known>;

/// Where a component is between two periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Place {
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

const NOTHING: u32 = 0;

struct Interpreter<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    core: &'db Core,
    scope: &'db CoreScope,
    behaviour: &'db Behaviour<'db>,
    shared: &'db [VariableOf],
    /// The shared variables, by the source of their name.
    indices: FxHashMap<SourceId, VariableId>,
    /// The index of the state of each name in the core's text.
    states: FxHashMap<&'db Name, usize>,
    followed: FxHashSet<VariableId>,
    by_operations: &'a [VariableId],
    /// See [`Followed::farthest`](followed::Followed::farthest).
    farthest: i32,
    /// The variables behind the parameters that operations change.
    aliases: FxHashMap<VariableId, VariableId>,
    /// The group of bodies of the current program.
    group: u32,
    inference: &'db Inference<'db>,
    costs: Vec<ProductCost<'db>>,
    numbers: FxHashMap<ProductCost<'db>, u32>,
    seen: FxHashMap<VariableId, Seen>,
    /// The number of the state and values from which a job is interpreted.
    job: Option<usize>,
    /// Whether the conditions of each job hold; none where one may, and may not.
    decided: FxHashMap<(usize, SourceId), Option<bool>>,
    steps: usize,
    /// The limit of this attempt.
    most_steps: usize,
}

fn one<E>(end: E, values: Values) -> Paths<E> {
    vec![(end, values, NOTHING)]
}

fn ends<E, F>(paths: Paths<E>, end: impl Fn(E) -> F) -> Paths<F> {
    paths.into_iter().map(|(it, values, cost)| (end(it), values, cost)).collect()
}

fn set(values: &mut Values, id: VariableId, value: Known) {
    match value {
        Some(value) => _ = values.insert(id, value),
        None => _ = values.remove(&id),
    }
}

impl<'db> Interpreter<'_, 'db> {
    /// Returns the product; none if it is beyond a limit.
    fn product(&mut self) -> Option<Interpreted<'db>> {
        self.most_steps = self.steps + MAX_STEPS;
        (self.costs, self.numbers) = (vec![ProductCost::One(Cost::default())], FxHashMap::default());
        self.seen.clear();
        self.decided.clear();
        let start = (Place::Unconfigured, Values::new());
        let (mut numbers, mut all) = (FxHashMap::from_iter([(start.clone(), 0)]), vec![start]);
        let mut edges: BTreeMap<(usize, usize, usize), u32> = BTreeMap::new();
        let (mut next, mut running) = (0, 0);
        while let Some((place, values)) = all.get(next).cloned() {
            self.db.unwind_if_revision_cancelled();
            let mut found: Vec<Next> = Vec::new();
            for (place, paths) in self.hooks(place, &values) {
                found.extend(paths.into_iter().map(|(_, values, _)| (place, values, None)));
            }
            if let Place::Running(state) = place {
                running += 1;
                self.job = Some(next);
                found.extend(self.job(state, values).into_iter().map(|((edge, target), values, cost)| {
                    (Place::Running(target), values, Some((edge, cost)))
                }));
                self.job = None;
            }
            for (place, mut values, executed) in found {
                // Clients may call operations between two periods.
                self.by_operations.iter().for_each(|id| _ = values.remove(id));
                let entry = (place, values);
                let number = *numbers.entry(entry.clone()).or_insert(all.len());
                if number == all.len() {
                    all.push(entry);
                }
                if let Some((edge, cost)) = executed {
                    let known = edges.get(&(next, edge, number)).copied().unwrap_or(cost);
                    edges.insert((next, edge, number), self.greatest(known, cost));
                }
            }
            next += 1;
            if running > MAX_STATES || edges.len() > MAX_EDGES || self.steps > self.most_steps {
                return None;
            }
        }
        Some(self.finished(&all, edges))
    }

    fn finished(
        &mut self,
        all: &[(Place, Values)],
        edges: BTreeMap<(usize, usize, usize), u32>,
    ) -> Interpreted<'db> {
        let is_running = |(place, _): &&(Place, Values)| matches!(place, Place::Running(_));
        let running: Vec<&(Place, Values)> = all.iter().filter(is_running).collect();
        let mut followed: Vec<_> = shared(self.shared).collect();
        followed.retain(|(id, _)| self.followed.contains(id));
        for (id, _) in &followed {
            running.iter().for_each(|(_, values)| self.see(*id, values.get(id).copied()));
        }
        let first = running.first().map(|(_, values)| values);
        let differs = |id: &VariableId| {
            running.iter().any(|(_, values)| values.get(id) != first.and_then(|first| first.get(id)))
        };
        let shown: Vec<_> = followed.iter().filter(|(id, _)| differs(id)).collect();
        let state = |(place, values): &&(Place, Values)| {
            let Place::Running(state) = *place else { return None };
            let known = shown.iter().filter_map(|(id, it)| {
                Some(format!("{} = {}", it.name.name, written(*values.get(id)?, &it.ty)))
            });
            Some(ProductState { state, values: known.collect::<Vec<_>>().join(", ") })
        };
        let number: Vec<usize> = all
            .iter()
            .scan(0, |next, it| Some(std::mem::replace(next, *next + usize::from(is_running(&it)))))
            .collect();
        let edge = |((source, edge, target), cost): ((usize, usize, usize), u32)| {
            Some(ProductEdge { source: *number.get(source)?, target: *number.get(target)?, edge, cost })
        };
        let values =
            followed.iter().filter_map(|(id, it)| Some((it.name.id, described(self.seen.get(id)?, &it.ty))));
        let product = Product {
            states: running.iter().filter_map(state).collect(),
            edges: edges.into_iter().filter_map(edge).collect(),
            values: values.collect(),
            costs: std::mem::take(&mut self.costs),
        };
        let decided = self
            .decided
            .drain()
            .filter_map(|((job, condition), holds)| Some(((*number.get(job)? as u32, condition), holds?)));
        Interpreted { decided: decided.collect(), product: Arc::new(product) }
    }

    /// Returns where a component may be after a hook, and the values then. Hooks may return false.
    fn hooks(&mut self, place: Place, values: &Values) -> Vec<(Place, Paths<()>)> {
        let (core, now) = (self.core, one((), values.clone()));
        let hook = |kind| ProgramId::Hook(kind);
        match place {
            Place::Unconfigured => {
                let configured = self.initial(BodyId::CoreValues, &core.variables, now);
                let configured = self.execute(&hook(HookKind::Configure), configured);
                vec![(Place::Stopped, configured.clone()), (Place::Unconfigured, configured)]
            }
            Place::Stopped => {
                let cleaned = self.execute(&hook(HookKind::Cleanup), now.clone());
                let variables = core.machines.first().map_or(&[][..], |it| &it.variables);
                let started = self.initial(BodyId::MachineValues, variables, now);
                let started = self.execute(&hook(HookKind::Start), started);
                let initial = self.behaviour.initial;
                let state = self.behaviour.states.get(initial).cloned().unwrap_or_default();
                let entry = ProgramId::Method { state, kind: MethodKind::Entry };
                let running = self.execute(&entry, started.clone());
                let place = Place::Running(initial);
                vec![(place, running), (Place::Stopped, started), (Place::Unconfigured, cleaned)]
            }
            Place::Running(_) => vec![(Place::Stopped, self.execute(&hook(HookKind::Stop), now))],
        }
    }

    /// Executes a program, if the core has it.
    fn execute(&mut self, id: &ProgramId, paths: Paths<()>) -> Paths<()> {
        match code_of(self.core, &self.states, id) {
            Some((body, code)) => {
                self.after(paths, |this, (), values| ends(this.code(body, code, values), |_| ()))
            }
            None => paths,
        }
    }

    /// Gives variables their initial values.
    fn initial(&mut self, body: BodyId, variables: &'db [Variable], mut paths: Paths<()>) -> Paths<()> {
        self.enter(body);
        for variable in variables {
            let Some(&id) = self.indices.get(&variable.name.id) else { continue };
            paths = self.after(paths, |this, (), values| {
                // Without an initial value, it may keep what it had or be reset.
                let value = match &variable.value {
                    Some(value) => this.value(value, values),
                    None => one(None, values),
                };
                this.assigned(id, value)
            });
        }
        paths
    }

    /// Returns the edges that a job may execute, each with the next state and the values then.
    fn job(&mut self, state: usize, values: Values) -> Paths<(usize, usize)> {
        let edges = &self.behaviour.edges;
        let begin = edges.all.partition_point(|edge| edge.source < state);
        let own = edges.all.iter().enumerate().skip(begin);
        let mut own = own.take_while(|(_, edge)| edge.source == state).peekable();
        let (mut open, mut found) = (one((), values), Vec::new());
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
    fn program(&mut self, index: usize, values: Values) -> Paths<bool> {
        let id = self.behaviour.programs.get(index).map(|it| &it.id);
        let Some((body, code)) = id.and_then(|id| code_of(self.core, &self.states, id)) else {
            return one(false, values);
        };
        let mut paths = self.code(body, code, values);
        paths.iter_mut().for_each(|(_, _, cost)| *cost = self.cost(ProductCost::Program(index, *cost)));
        paths
    }

    fn code(&mut self, body: BodyId, code: Code<'db>, values: Values) -> Paths<bool> {
        self.enter(body);
        match code {
            Code::Guard(guard) => self.condition(&guard.condition, values),
            Code::Program(program) => {
                let paths = self.block(&program.statements, values);
                self.after(paths, |_, _, values| one(false, values))
            }
        }
    }

    fn enter(&mut self, body: BodyId) {
        self.group = self.scope.group(body).unwrap_or_default();
        self.inference = inference_of(self.db, self.project, self.of, self.group);
    }

    fn cost(&mut self, cost: ProductCost<'db>) -> u32 {
        let next = self.costs.len() as u32;
        *self.numbers.entry(cost).or_insert_with_key(|cost| {
            self.costs.push(cost.clone());
            next
        })
    }

    fn sum(&mut self, one: u32, other: u32) -> u32 {
        match (one, other) {
            (NOTHING, it) | (it, NOTHING) => it,
            _ => self.cost(ProductCost::Sum(one, other)),
        }
    }

    fn greatest(&mut self, one: u32, other: u32) -> u32 {
        match (one, other) {
            (NOTHING, it) | (it, NOTHING) => it,
            _ if one == other => one,
            _ => self.cost(ProductCost::Greatest(one.min(other), one.max(other))),
        }
    }

    /// Continues each path. Of those with the same end and the same values, the greatest cost counts.
    fn after<E, F: PartialEq>(
        &mut self,
        paths: Paths<E>,
        mut next: impl FnMut(&mut Self, E, Values) -> Paths<F>,
    ) -> Paths<F> {
        let mut found: Paths<F> = Vec::new();
        for (end, values, before) in paths {
            // A program beyond the limit is left at once.
            if self.steps > self.most_steps {
                break;
            }
            for (end, values, cost) in next(self, end, values) {
                self.steps += 1 + found.len() / 8;
                let cost = self.sum(before, cost);
                match found.iter_mut().find(|(it, known, _)| *it == end && *known == values) {
                    Some((_, _, known)) => *known = self.greatest(*known, cost),
                    None => found.push((end, values, cost)),
                }
            }
        }
        found
    }

    fn block(&mut self, statements: &'db [Statement], values: Values) -> Paths<Ended> {
        let mut paths: Paths<Ended> = one(None, values);
        for statement in statements {
            paths = self.after(paths, |this, end, values| match end {
                None => this.statement(statement, values),
                Some(_) => one(end, values),
            });
        }
        let declared = statements.iter().filter_map(Statement::variable);
        let declared: Vec<VariableId> = declared.filter_map(|it| self.local(it.name.id)).collect();
        for (_, values, _) in &mut paths {
            declared.iter().for_each(|id| _ = values.remove(id));
        }
        paths
    }

    fn statement(&mut self, statement: &'db Statement, values: Values) -> Paths<Ended> {
        match statement {
            Statement::If { condition, then, otherwise, .. } => {
                let paths = self.condition(condition, values);
                let otherwise = otherwise.as_deref().unwrap_or_default();
                self.after(paths, |this, holds, it| this.block(if holds { then } else { otherwise }, it))
            }
            Statement::Block(inner) => self.block(inner, values),
            Statement::Variable(_) | Statement::Assign(..) | Statement::Expr(_) | Statement::Return(..) => {
                let paths = match statement.expression() {
                    Some(value) => self.value(value, values),
                    None => one(None, values),
                };
                let target = match statement {
                    Statement::Return(..) => return ends(paths, Some),
                    Statement::Variable(variable) => self.local(variable.name.id),
                    Statement::Assign(target, _) => self.variable(target.id),
                    _ => None,
                };
                match target {
                    Some(id) => ends(self.assigned(id, paths), |()| None),
                    None => self.after(paths, |_, _, values| one(None, values)),
                }
            }
        }
    }

    /// Returns the parameter or local variable that is declared at a source of the current program.
    fn local(&self, declared: SourceId) -> Option<VariableId> {
        let index = self.inference.variables.partition_point(|it| it.name.id < declared);
        self.inference.variables.get(index).filter(|it| it.name.id == declared)?;
        Some(VariableId { group: Some(self.group), index: index as u32 })
    }

    /// Returns the variable that a name refers to.
    fn variable(&self, name: SourceId) -> Option<VariableId> {
        let Some(Binding::Variable(id)) = self.inference.binding(name) else { return None };
        Some(self.aliases.get(&id).copied().unwrap_or(id))
    }

    fn named(&self, expr: &Expr) -> Option<VariableId> {
        if let Expr::Name(name) = expr { self.variable(name.id) } else { None }
    }

    /// Gives a variable the value that each path ends with.
    fn assigned(&mut self, id: VariableId, paths: Paths<Known>) -> Paths<()> {
        self.after(paths, |this, value, mut values| {
            let is_near = |value: &i32| value.unsigned_abs() <= this.farthest.unsigned_abs();
            let value = value.filter(|value| this.followed.contains(&id) && is_near(value));
            this.see(id, value);
            set(&mut values, id, value);
            one((), values)
        })
    }

    fn see(&mut self, id: VariableId, value: Known) {
        let seen = self.seen.entry(id).or_default();
        match value {
            Some(value) => _ = seen.known.insert(value),
            None => seen.any = true,
        }
    }

    fn condition(&mut self, expr: &'db Expr, values: Values) -> Paths<bool> {
        match expr {
            Expr::Unary(UnaryOperator::Not, inner, _) => ends(self.condition(inner, values), |holds| !holds),
            Expr::Binary(BinaryOperator::And | BinaryOperator::Or, ..) => {
                let (first, operands) = spine(expr, is_logic);
                let first = self.condition(first, values);
                operands.into_iter().rev().fold(first, |left, (operator, right, _)| {
                    let deciding = operator == BinaryOperator::Or;
                    self.after(left, |this, holds, values| match holds == deciding {
                        true => one(holds, values),
                        false => this.condition(right, values),
                    })
                })
            }
            _ => {
                let paths = self.value(expr, values);
                self.after(paths, |this, value, values| {
                    let holds = value.map(|it| it != 0);
                    if let Some(key) = this.job.zip(expr.id()) {
                        let known = this.decided.entry(key).or_insert(holds);
                        *known = known.filter(|it| holds == Some(*it));
                    }
                    match holds {
                        Some(holds) => one(holds, values),
                        None => {
                            [true, false].map(|it| (it, this.given(expr, it, values.clone()), NOTHING)).into()
                        }
                    }
                })
            }
        }
    }

    /// Returns the values where a condition whose value was not known holds, or does not.
    fn given(&self, condition: &'db Expr, holds: bool, mut values: Values) -> Values {
        let (name, value) = match condition {
            Expr::Name(_) => (condition, Some(holds.into())),
            Expr::Binary(operator @ (BinaryOperator::Equal | BinaryOperator::NotEqual), left, right, _)
                if holds == (*operator == BinaryOperator::Equal) =>
            {
                match right.as_ref() {
                    Expr::Literal(literal, _) => (left.as_ref(), of_literal(literal)),
                    right => (left.as_ref(), self.named(right).and_then(|id| values.get(&id).copied())),
                }
            }
            _ => return values,
        };
        if let (Some(id), Some(value)) = (self.named(name).filter(|id| self.followed.contains(id)), value) {
            values.insert(id, value);
        }
        values
    }

    fn value(&mut self, expr: &'db Expr, values: Values) -> Paths<Known> {
        self.steps += 1;
        match expr {
            Expr::Missing | Expr::Incomplete(_) => one(None, values),
            Expr::Literal(literal, _) => one(of_literal(literal), values),
            Expr::Name(_) => one(self.named(expr).and_then(|id| values.get(&id).copied()), values),
            Expr::Call { callee, arguments, .. } => self.call(callee, arguments, values),
            Expr::Unary(operator, inner, _) => {
                let operate = |value: i32| match operator {
                    UnaryOperator::Not => Some(i32::from(value == 0)),
                    UnaryOperator::Minus => value.checked_neg(),
                };
                ends(self.value(inner, values), |value| value.and_then(operate))
            }
            Expr::Binary(operator, ..) if is_logic(*operator) => {
                ends(self.condition(expr, values), |holds| Some(holds.into()))
            }
            Expr::Binary(..) => {
                let (first, operands) = spine(expr, |operator| !is_logic(operator));
                let first = self.value(first, values);
                operands.into_iter().rev().fold(first, |left, (operator, right, _)| {
                    self.after(left, |this, left, values| {
                        ends(this.value(right, values), |right| binary(operator, left?, right?))
                    })
                })
            }
        }
    }

    fn call(&mut self, callee: &'db NameRef, arguments: &'db [Expr], values: Values) -> Paths<Known> {
        let Some(callee) = self.inference.callee(callee.id) else { return one(None, values) };
        let directions = directions_of(self.db, self.scope, callee, arguments.len());
        let mut paths: Paths<Vec<Known>> = one(Vec::new(), values);
        let mut changed = Vec::new();
        for (argument, direction) in arguments.iter().zip(directions) {
            let is_value = direction == Direction::In;
            changed.extend(self.named(argument).filter(|_| !is_value));
            paths = self.after(paths, |this, before, values| {
                let value = if is_value { this.value(argument, values) } else { one(None, values) };
                ends(value, |value| before.iter().copied().chain([value]).collect())
            });
        }
        // The first argument of a built-in function, which is no value.
        let operand =
            arguments.first().and_then(|it| if let Expr::Name(it) = it { Some(&it.name) } else { None });
        let operand = || operand.cloned().unwrap_or_default();
        let cost = match callee {
            Callee::Operation(index) => {
                return self.after(paths, |this, given, it| this.operation(index, arguments, &given, it));
            }
            Callee::Codel(codel) => self.cost(ProductCost::One(Cost::Codel(codel))),
            Callee::Builtin(Builtin::Read | Builtin::Write) => {
                self.cost(ProductCost::One(Cost::Access(operand())))
            }
            Callee::Builtin(Builtin::Send) => self.cost(ProductCost::One(Cost::Send(operand()))),
            Callee::Builtin(Builtin::Status | Builtin::Collect) => NOTHING,
        };
        self.after(paths, |this, _, mut values| {
            for id in &changed {
                this.see(*id, None);
                values.remove(id);
            }
            vec![(None, values, cost)]
        })
    }

    /// Executes an operation of the core with these arguments. Parameters that it changes are the variables of the caller.
    fn operation(
        &mut self,
        index: usize,
        arguments: &'db [Expr],
        given: &[Known],
        mut values: Values,
    ) -> Paths<Known> {
        let Some(operation) = self.core.operations.get(index) else { return one(None, values) };
        let is_small = |this: &Self, ty| is_small(&type_of(this.db, this.project, this.of, ty));
        let named: Vec<Option<VariableId>> = arguments.iter().map(|it| self.named(it)).collect();
        let caller = (self.group, self.inference);
        self.enter(BodyId::Operation(index as u32));
        let mut own = Vec::new();
        for ((parameter, given), named) in operation.parameters.iter().zip(given).zip(named) {
            let Some(id) = self.local(parameter.name.id) else { continue };
            match named.filter(|_| parameter.direction != Direction::In) {
                Some(named) => _ = self.aliases.insert(id, named),
                None => {
                    set(&mut values, id, given.filter(|_| is_small(self, parameter.ty.as_ref())));
                    own.push(id);
                }
            }
        }
        let mut paths = self.block(&operation.program.statements, values);
        let is_small = is_small(self, operation.result.as_ref());
        for (_, values, cost) in &mut paths {
            own.iter().for_each(|id| _ = values.remove(id));
            *cost = self.cost(ProductCost::Operation(index, *cost));
        }
        (self.group, self.inference) = caller;
        self.after(paths, |_, end, values| one(end.flatten().filter(|_| is_small), values))
    }
}

/// Returns the result of an operator that is not logical; none if it is undefined in C++.
fn binary(operator: BinaryOperator, left: i32, right: i32) -> Known {
    match Value::Int(left).binary(operator, &Value::Int(right)) {
        Ok(Some(Value::Int(value))) => Some(value),
        Ok(Some(Value::Bool(value))) => Some(value.into()),
        _ => None,
    }
}

fn of_literal(literal: &Literal) -> Known {
    match literal {
        Literal::PortStatus(PortStatus::NoData) | Literal::CallStatus(CallStatus::Failure) => Some(0),
        Literal::PortStatus(PortStatus::OldData) | Literal::CallStatus(CallStatus::NotReady) => Some(1),
        Literal::PortStatus(PortStatus::NewData) | Literal::CallStatus(CallStatus::Success) => Some(2),
        Literal::Bool(value) => Some((*value).into()),
        Literal::Int(text) => whole_number(text),
        Literal::Float(_) | Literal::String(_) => None,
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
