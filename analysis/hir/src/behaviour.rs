//! The behaviour of a core: its states, the edges of one period, and the cost of each program.
//!
//! Combines the inference and the costs of the bodies. A behaviour has no times: a changed timing table invalidates no
//! behaviour, a changed program only that of its core.

use std::borrow::Cow;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{BodyId, CoreScope, Place, ProgramIn, core_scope, groups_of, of_program};
use crate::completeness::Completeness;
use crate::cost::{CostGraph, Execution, ProgramCost, ProgramCosts, costs_of};
use crate::fact::{
    CorePart, CoreReason, Defined, Fact, FactKind, ModelReason, ModelRefusal, Unreachable, repeated,
    unresolved_type,
};
use crate::features::{Features, features_of};
use crate::graph::{reachable, successors_by, topological_order};
use crate::infer::{NameProblem, Problems, inference_of};
use crate::item_tree::{FeatureKind, HookKind, Kind, MethodKind, Name, NameRef, SourceId};
use crate::names::{names_of, resolve_type, similar};
use crate::program_id::ProgramId;
use crate::project::Project;
use crate::source::{Decl, Location, declarations};
use crate::structure::{
    MachineStructure, StateStructure, Structure, TransitionStructure, indices_of, structure_of, successors,
};

/// The programs that a core executes in each period.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Behaviour<'db> {
    /// The states reachable from the initial state, in the order of the text.
    pub states: Vec<Name>,
    /// The index of the initial state.
    pub initial: usize,
    /// The possible executions of one period (paper, eq. 6), as in generated code.
    pub edges: Arc<Edges>,
    /// The programs that the edges execute.
    pub programs: Vec<TimedProgram<'db>>,
    /// What a component executes when it is configured and when it starts, before the first period.
    pub starting: Vec<Arc<CostGraph<'db>>>,
    /// The operations that the core defines.
    pub operations: Vec<TimedProgram<'db>>,
    /// The operations in topological order, callees first.
    pub order: Vec<usize>,
    /// The ports that programs outside of periods access: hooks, such as `start`, and the entry of the initial state.
    pub accessed_by_hooks: Vec<Name>,
    /// The reasons why the core is not analysed; if there are any, the other fields must not be used for the analysis.
    pub refusals: Vec<ModelRefusal<'db>>,
    /// The errors and warnings of the core.
    pub facts: Vec<Fact<'db>>,
}

impl<'db> Behaviour<'db> {
    /// Returns the programs that a thread may execute, with repetitions: those of the edges, and every operation, because the
    /// connections say which are called, and may be incomplete.
    pub fn executed(&self) -> impl Iterator<Item = &TimedProgram<'db>> {
        self.edges.executed().filter_map(|index| self.programs.get(index)).chain(&self.operations)
    }

    /// Returns which edges the jobs of each state execute. The edges are in the order of the states, and of their guards.
    pub(crate) fn fired(&self) -> Vec<Fired> {
        let mut edges = self.edges.all.iter().enumerate().peekable();
        let of_state = |(state, first): (usize, &Vec<usize>)| {
            let of_guard = |program: &usize| {
                let ProgramId::Guard { transition, .. } = &self.programs.get(*program)?.id else {
                    return None;
                };
                let fires =
                    |edge: &PeriodEdge| edge.source == state && edge.transition.as_ref() == Some(transition);
                edges.next_if(|(_, edge)| fires(edge)).map(|(index, _)| index)
            };
            let by_guards = first.iter().map(of_guard).collect();
            let otherwise = edges.next_if(|(_, edge)| edge.source == state).map(|(index, _)| index);
            Fired { by_guards, otherwise }
        };
        self.edges.first.iter().enumerate().map(of_state).collect()
    }
}

/// The edges that the jobs of a state execute.
#[derive(Debug)]
pub(crate) struct Fired {
    /// For each of the programs that its edges execute first, the edge that it fires if it is a guard and holds.
    pub(crate) by_guards: Vec<Option<usize>>,
    /// The edge of the jobs in which no guard holds.
    pub(crate) otherwise: Option<usize>,
}

/// The possible executions of one period.
///
/// The edges of a state execute its `run` and its guards, up to the guard of the transition that fires. So a state has one
/// list of these programs, and each of its edges executes the first ones of the list: with a copy for each edge, the size
/// would be quadratic in the number of transitions.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Edges {
    /// In the order of the states; those of a state in the order of its transitions.
    pub all: Vec<PeriodEdge>,
    /// For each state, the indices of the programs that its edges execute first.
    pub first: Vec<Vec<usize>>,
}

impl Edges {
    /// Returns the indices of the programs of an edge, in the order of execution.
    pub fn programs<'a>(&'a self, edge: &'a PeriodEdge) -> impl Iterator<Item = usize> + use<'a> {
        let first = self.first.get(edge.source).map_or(&[] as &[usize], Vec::as_slice);
        first.iter().take(edge.first).chain(&edge.then).copied()
    }

    /// Returns, for each edge, `zero` to which `add` has added its [`Edges::programs`]. What the edges of a state share is added
    /// once.
    pub fn sums<S: Copy>(&self, zero: S, mut add: impl FnMut(S, usize) -> S) -> Vec<S> {
        let mut of_first = |first: &Vec<usize>| {
            let mut sums = vec![zero];
            sums.extend(first.iter().scan(zero, |sum, &index| {
                *sum = add(*sum, index);
                Some(*sum)
            }));
            sums
        };
        let first: Vec<Vec<S>> = self.first.iter().map(&mut of_first).collect();
        let sum = |edge: &PeriodEdge| {
            let of_source = first.get(edge.source);
            let first = of_source.and_then(|sums| sums.get(edge.first).or(sums.last())).copied();
            edge.then.iter().copied().fold(first.unwrap_or(zero), &mut add)
        };
        self.all.iter().map(sum).collect()
    }

    /// Returns the indices of the programs that any edge executes, with repetitions: by state, then by edge.
    pub fn executed(&self) -> impl Iterator<Item = usize> {
        self.first.iter().flatten().chain(self.all.iter().flat_map(|edge| &edge.then)).copied()
    }
}

/// A possible execution of one period: its source and target states, and its sequence of programs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PeriodEdge {
    /// Index of the state at the start of the period.
    pub source: usize,
    /// Index of the state at the start of the next period.
    pub target: usize,
    /// The transition that fires; `None` if the machine stays in the state.
    pub transition: Option<Name>,
    /// The number of programs that it executes of the source state's list in [`Edges::first`].
    pub first: usize,
    /// The indices of the programs that it executes after these.
    pub then: Vec<usize>,
}

/// A program that a timing table may name.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct TimedProgram<'db> {
    /// Its key in a timing table, after `Component/`.
    pub id: ProgramId,
    /// Its worst-case cost.
    pub cost: Arc<CostGraph<'db>>,
    pub(crate) place: Place,
}

/// The name of the only state of a core with `update` instead of a state machine.
const UPDATE_STATE: &str = "update";

/// Returns the behaviour of a core.
#[salsa::tracked(returns(ref))]
pub fn behaviour_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Behaviour<'db> {
    let Some(core) = structure_of(db, of) else { return Behaviour::default() };
    let shell = resolve_type(db, project, of, Kind::Shell, core.shell.as_ref());
    let features =
        shell.as_ref().map_or_else(|_| Features::unknown(), |&shell| features_of(db, project, shell));
    let mut context = BehaviourContext {
        db,
        project,
        of,
        features,
        core,
        states: Vec::new(),
        indices: FxHashMap::default(),
        methods: FxHashMap::default(),
        groups: known_of(db, project, of),
        found: Behaviour::default(),
    };
    if let Err(unresolved) = &shell {
        context.found.facts.extend(unresolved_type(of, Kind::Shell, core.shell.as_ref(), unresolved));
        context.refuse_once(CoreReason::UnknownShell);
    } else if features.completeness.is_incomplete() || features.cycle {
        context.refuse_once(CoreReason::IncompleteShell(features.incomplete(names_of(db, project))));
    }
    if core.completeness.is_incomplete() {
        context.refuse_once(CoreReason::SyntaxError(CorePart::Core));
    }
    context.core();
    let mut found = context.found;
    // A project keeps these while it is open.
    found.states.shrink_to_fit();
    found.programs.shrink_to_fit();
    found
}

/// What is known of the programs of a core, by group of bodies.
struct Groups<'db> {
    scope: Option<&'db CoreScope>,
    costs: Vec<Cow<'db, ProgramCosts<'db>>>,
    /// The unresolved names.
    problems: Vec<&'db Problems<'db>>,
}

fn known_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Groups<'db> {
    let problems = groups_of(db, of).map(|group| &inference_of(db, project, of, group).problems).collect();
    Groups { scope: core_scope(db, of).as_ref(), costs: costs_of(db, project, of), problems }
}

impl<'db> Groups<'db> {
    fn cost(&self, body: BodyId, program: ProgramIn) -> Option<&ProgramCost<'db>> {
        let (group, index) = self.scope?.place(body)?;
        of_program(self.costs.get(group)?, index, program)
    }

    /// Returns the unresolved names in a program.
    fn problems(&self, body: BodyId, program: ProgramIn) -> &'db [NameProblem<'db>] {
        let group = self.scope.and_then(|scope| scope.place(body)).map(|(group, _)| group);
        let of_group = group.and_then(|group| self.problems.get(group));
        of_group.and_then(|problems| problems.get(&(body, program))).map_or(&[], Vec::as_slice)
    }
}

struct BehaviourContext<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    features: &'db Features<'db>,
    core: &'db Structure,
    /// The states of its only state machine.
    states: Vec<&'db StateStructure>,
    /// The first state of each name.
    indices: FxHashMap<&'db Name, usize>,
    /// The programs of methods, by state.
    methods: FxHashMap<(usize, MethodKind), usize>,
    groups: Groups<'db>,
    found: Behaviour<'db>,
}

impl<'db> BehaviourContext<'db> {
    /// Refuses the core for a reason that another fact reports.
    fn refuse_once(&mut self, why: CoreReason) {
        let refusal =
            ModelRefusal { reason: ModelReason::Core { core: self.of, why }, at: Location::name_of(self.of) };
        // Each reason once; after 64 reasons, repetitions are harmless.
        if !self.found.refusals.iter().take(64).any(|earlier| *earlier == refusal) {
            self.found.refusals.push(refusal);
        }
    }

    /// Refuses the core for a declaration that another error may hide, unless there is another reason, such as that error.
    fn refuse_hidden(&mut self, why: CoreReason) {
        if self.found.refusals.is_empty() {
            self.refuse_once(why);
        }
    }

    /// Reports an error, and refuses the core.
    fn refuse(&mut self, fact: Fact<'db>) {
        self.found.refusals.push(ModelRefusal::of_fact(self.project, &fact));
        self.found.facts.push(fact);
    }

    fn refuse_at(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.refuse(Fact::new(Location::Source(self.of, id), kind));
    }

    fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.found.facts.push(Fact::new(Location::Source(self.of, id), kind));
    }

    fn refuse_repeated<'a>(&mut self, names: impl Iterator<Item = &'a NameRef>, what: Defined) {
        repeated(self.of, names.map(|name| (name, what))).into_iter().for_each(|fact| self.refuse(fact));
    }

    fn core(&mut self) {
        self.duplicates_of_core();
        self.name_problems(BodyId::CoreValues, ProgramIn::Whole);
        self.operations();
        self.hooks();
        let core = self.core;
        match (core.machines.as_slice(), core.hook(HookKind::Update)) {
            ([_], None) => self.machine(),
            ([], Some(update)) => {
                self.found.states.push(UPDATE_STATE.into());
                let then = vec![self.add_program(ProgramId::UPDATE, (update, ProgramIn::Whole))];
                let edge = PeriodEdge { source: 0, target: 0, transition: None, first: 0, then };
                self.found.edges = Arc::new(Edges { all: vec![edge], first: vec![Vec::new()] });
            }
            // A syntax error may hide the behaviour.
            ([], None) if self.core.completeness.is_incomplete() => {}
            // The core may end too early.
            ([], None) if declarations(self.db, self.of.file(self.db)).completeness.is_incomplete() => {
                self.refuse_once(CoreReason::SyntaxError(CorePart::Core));
            }
            ([], None) => self.refuse(Fact::new(Location::name_of(self.of), FactKind::NoBehaviour)),
            ([.., last], None) => self.refuse_at(last.id, FactKind::TwoBehaviours { machines: true }),
            ([machine, ..], Some(_)) => {
                self.refuse_at(machine.id, FactKind::TwoBehaviours { machines: false });
            }
        }
    }

    /// Refuses the core for each unresolved name in a program.
    fn name_problems(&mut self, body: BodyId, program: ProgramIn) {
        // Whether the previous problem was a hidden name and the first reason for the refusal.
        let mut is_first = false;
        for problem in self.groups.problems(body, program) {
            let was_first = std::mem::take(&mut is_first);
            match problem {
                // The effect of the hidden name is unknown; it is reported.
                NameProblem::Error(Fact { kind: FactKind::NoEffect, .. }) if was_first => {}
                NameProblem::Error(fact) => self.refuse(fact.clone()),
                NameProblem::Reported(why) => self.refuse_once(why.clone()),
                NameProblem::Hidden(why) => {
                    is_first = self.found.refusals.is_empty();
                    self.refuse_hidden(why.clone());
                }
            }
        }
    }

    /// Returns the worst-case cost of a program. Refuses the core for the program's errors.
    fn cost(&mut self, (body, program): Place) -> Arc<CostGraph<'db>> {
        let Some(found) = self.groups.cost(body, program) else { return Arc::default() };
        let cost = found.cost.clone();
        if found.completeness.is_incomplete() {
            self.refuse_once(match program {
                ProgramIn::Guard(_) => CoreReason::SyntaxError(CorePart::Guard),
                _ => CoreReason::SyntaxError(CorePart::Program),
            });
        }
        self.name_problems(body, program);
        cost
    }

    fn duplicates_of_core(&mut self) {
        let core = self.core;
        let variables = core.variables.iter().map(|it| (&it.name, Defined::Variable));
        let handlers = core.handlers.iter().map(|it| (&it.name, Defined::Handler));
        self.found.facts.extend(repeated(self.of, variables.chain(handlers)));
        self.refuse_repeated(core.operations.iter(), Defined::Operation);
        let mut seen = FxHashSet::default();
        for &(kind, id) in core.hooks.iter().filter(|(kind, _)| !seen.insert(*kind)) {
            match kind {
                HookKind::Update => self.refuse_at(id, FactKind::DuplicateHook(kind)),
                _ => self.report(id, FactKind::DuplicateHook(kind)),
            }
        }
    }

    /// Checks the hooks that no period executes. Their cost does not count, but a syntax error in a hook may hide programs that
    /// a period executes.
    /// Adds the hooks, and the `entry` of the initial state.
    fn hooks(&mut self) {
        for (index, (kind, _)) in self.core.hooks.iter().enumerate() {
            if *kind != HookKind::Update {
                let cost = self.cost((BodyId::Hook(index as u32), ProgramIn::Whole));
                self.add_accesses(&cost);
                let is_starting = matches!(kind, HookKind::Configure | HookKind::Start);
                self.found.starting.extend(is_starting.then_some(cost));
            }
        }
        let entry = self.core.initial_entry().and_then(|(body, program)| self.groups.cost(body, program));
        let entry = entry.map(|it| it.cost.clone());
        entry.iter().for_each(|it| self.add_accesses(it));
        self.found.starting.extend(entry);
    }

    fn add_accesses(&mut self, cost: &CostGraph<'db>) {
        let ports = cost.executions().filter_map(|it| match it {
            Execution::Access(port) => Some(port.clone()),
            _ => None,
        });
        self.found.accessed_by_hooks.extend(ports);
    }

    fn operations(&mut self) {
        for (index, operation) in self.core.operations.iter().enumerate() {
            // An incomplete operation refuses the core: the operation executes in the core's own thread.
            let place = (BodyId::Operation(index as u32), ProgramIn::Whole);
            let cost = self.cost(place);
            let id = ProgramId::Operation(operation.name.clone());
            self.found.operations.push(TimedProgram { id, cost, place });
        }
        self.order_operations();
        for NameRef { name, id } in &self.core.operations {
            let mut declared = self.features.by_name.get(name).into_iter().flatten();
            if name.is_empty() || declared.any(|it| it.kind == FeatureKind::Provided) {
                continue;
            }
            // Its callers may resolve the name to another definition, such as a codel.
            if self.features.completeness.is_complete() {
                self.refuse_at(*id, FactKind::UndeclaredOperation { name: name.clone() });
            }
        }
        let defined: FxHashSet<&Name> = self.core.operations.iter().map(|it| &it.name).collect();
        let is_complete = (self.core.completeness & self.features.completeness).is_complete();
        for (name, found) in
            self.features.by_name.iter().filter(|(name, _)| is_complete && !defined.contains(name))
        {
            if let Some(declared) = found.first().filter(|feature| feature.kind == FeatureKind::Provided) {
                let (name, declared) = (name.clone(), *declared);
                let kind = FactKind::UndefinedOperation { core: self.of, name, declared };
                self.found.facts.push(Fact::new(Location::name_of(self.of), kind));
            }
        }
    }

    /// Orders the operations, callees first, and refuses recursive ones.
    fn order_operations(&mut self) {
        let calls: Vec<Vec<usize>> =
            self.found.operations.iter().map(|it| it.cost.operations().collect()).collect();
        let (order, in_cycle) = topological_order(&calls);
        for (operation, _) in self.core.operations.iter().zip(in_cycle).filter(|(_, in_cycle)| *in_cycle) {
            let name = operation.name.clone();
            self.refuse_at(operation.id, FactKind::RecursiveOperation { name });
        }
        self.found.order = order;
    }

    fn machine(&mut self) {
        let Some((machine, states)) = self.core.machine() else { return };
        self.states = states;
        if self.state_completeness(machine).is_incomplete() {
            self.refuse_once(CoreReason::SyntaxError(CorePart::Machine));
        }
        self.name_problems(BodyId::MachineValues, ProgramIn::Whole);
        let variables = machine.variables.iter().map(|it| (&it.name, Defined::Variable));
        self.found.facts.extend(repeated(self.of, variables));
        let names: Vec<&'db NameRef> = self.states.iter().map(|it| &it.name).collect();
        self.refuse_repeated(names.into_iter(), Defined::State);
        let Some(start) = self.initial(machine) else { return };
        self.indices = indices_of(&self.states);
        let mut edges = Edges::default();
        for index in 0..self.states.len() {
            self.state(machine, index, &mut edges);
        }
        self.unreachable(start);
        self.keep_reachable(start, edges);
    }

    /// Returns whether all states are known: the error in a state may be the beginning of another state.
    fn state_completeness(&self, machine: &MachineStructure) -> Completeness {
        machine.completeness & self.states.iter().map(|state| state.completeness).collect()
    }

    fn initial(&mut self, machine: &MachineStructure) -> Option<usize> {
        let initial: Vec<usize> = (0..self.states.len()).filter(|&it| self.states[it].initial).collect();
        match initial.as_slice() {
            [one] => return Some(*one),
            [] => {
                if machine.completeness.is_complete() {
                    let first = self.states.first().map(|it| (it.name.name.clone(), it.start));
                    self.refuse_at(machine.id, FactKind::NoInitialState { first });
                }
            }
            [first, second, ..] => {
                let (first, second) = (&self.states[*first].name, &self.states[*second].name);
                let all = initial.iter().map(|&it| self.states[it]);
                let kind = FactKind::SeveralInitialStates {
                    first: (first.name.clone(), first.id),
                    second: second.name.clone(),
                    all: all.map(|it| (it.name.name.clone(), it.start)).collect(),
                };
                self.refuse_at(second.id, kind);
            }
        }
        None
    }

    /// Reports states that are unreachable even if every guard holds.
    fn unreachable(&mut self, start: usize) {
        if !self.found.refusals.is_empty() {
            return;
        }
        let reached = reachable(&successors(&self.states, &self.indices), [start]);
        let unreached = self.states.iter().zip(reached).filter(|(_, reached)| !reached);
        let unreached: Vec<&'db NameRef> = unreached.map(|(state, _)| &state.name).collect();
        for NameRef { name, id } in unreached {
            self.report(*id, FactKind::UnreachableState { name: name.clone() });
        }
    }

    /// Adds the edges of a state: its transitions in the order of the text, then the edge that stays in the state.
    fn state(&mut self, machine: &MachineStructure, index: usize, edges: &mut Edges) {
        let state = self.states[index];
        self.refuse_repeated(state.transitions.iter().map(|it| &it.name), Defined::Transition);
        let mut seen = FxHashSet::default();
        for &(kind, id) in state.methods.iter().filter(|(kind, _)| !seen.insert(*kind)) {
            self.refuse_at(id, FactKind::DuplicateMethod(kind));
        }
        // The programs of a state include `entry`, which its incoming edges execute.
        self.method(index, MethodKind::Entry);
        let run = self.method(index, MethodKind::Run);
        let exit = self.method(index, MethodKind::Exit);
        let handle = self.method(index, MethodKind::Handle);
        // `run`, then the guards up to the first that holds.
        let mut before: Vec<usize> = run.into_iter().collect();
        // The greatest number of them that an edge executes.
        let mut executed = 0;
        let mut fires_always: Option<&TransitionStructure> = None;
        for (number, transition) in state.transitions.iter().enumerate() {
            let body = BodyId::State(0, index as u32);
            let (name, number) = (&transition.name.name, number as u32);
            if transition.completeness.is_incomplete() {
                self.refuse_once(CoreReason::SyntaxError(CorePart::Transition));
            }
            let mut constant = None;
            if transition.has_guard {
                let (state, transition) = (state.name.name.clone(), name.clone());
                let id = ProgramId::Guard { state, transition };
                before.push(self.add_program(id, (body, ProgramIn::Guard(number))));
                constant = self.groups.cost(body, ProgramIn::Guard(number)).and_then(|it| it.constant);
            }
            let effect = transition.has_effect.then(|| {
                let (state, transition) = (state.name.name.clone(), name.clone());
                let id = ProgramId::Effect { state, transition };
                self.add_program(id, (body, ProgramIn::Effect(number)))
            });
            let target = self.target(machine, transition);
            // Transitions after one that always fires are checked, but have no edge.
            if let Some(always) = fires_always {
                self.never_taken(transition, always);
                // Transitions after one without a guard are a warning, even if a constant guard precedes both.
                let has_no_guard = !transition.has_guard && transition.completeness.is_complete();
                if always.has_guard && has_no_guard {
                    fires_always = Some(transition);
                }
                continue;
            }
            if constant == Some(false) {
                self.report(transition.name.id, FactKind::UnreachableCode(Unreachable::Guard));
                continue;
            }
            if let Some(target) = target {
                let entry = self.method(target, MethodKind::Entry);
                executed = before.len();
                edges.all.push(PeriodEdge {
                    source: index,
                    target,
                    transition: Some(name.clone()),
                    first: executed,
                    then: exit.into_iter().chain(effect).chain(entry).collect(),
                });
            }
            if !transition.has_guard || constant == Some(true) {
                fires_always = Some(transition);
            }
        }
        if fires_always.is_none() {
            executed = before.len();
            let then = handle.into_iter().collect();
            edges.all.push(PeriodEdge {
                source: index,
                target: index,
                transition: None,
                first: executed,
                then,
            });
        }
        before.truncate(executed);
        before.shrink_to_fit();
        edges.first.push(before);
    }

    /// Reports a transition after one that always fires.
    fn never_taken(&mut self, transition: &TransitionStructure, always: &TransitionStructure) {
        let (name, first) = (&transition.name, &always.name);
        if transition.completeness.is_incomplete()
            || always.completeness.is_incomplete()
            || name.name.is_empty()
        {
            return;
        }
        let first_at = Location::Source(self.of, first.id);
        self.report(
            name.id,
            match always.has_guard {
                false => {
                    FactKind::NeverTaken { name: name.name.clone(), first: first.name.clone(), first_at }
                }
                true => FactKind::UnreachableCode(Unreachable::Behind(first.name.clone())),
            },
        );
    }

    fn add_program(&mut self, id: ProgramId, place: Place) -> usize {
        let cost = self.cost(place);
        self.found.programs.push(TimedProgram { id, cost, place });
        self.found.programs.len() - 1
    }

    /// Returns the index of the program of a method; adds it at the first call.
    fn method(&mut self, index: usize, kind: MethodKind) -> Option<usize> {
        let state = self.states[index];
        let place = state.method(kind)?;
        if let Some(&program) = self.methods.get(&(index, kind)) {
            return Some(program);
        }
        let id = ProgramId::Method { state: state.name.name.clone(), kind };
        let program = self.add_program(id, (BodyId::State(0, index as u32), place));
        self.methods.insert((index, kind), program);
        Some(program)
    }

    fn target(&mut self, machine: &MachineStructure, transition: &TransitionStructure) -> Option<usize> {
        let Some(NameRef { name, id }) = &transition.target else {
            self.refuse_once(CoreReason::SyntaxError(CorePart::Transition));
            return None;
        };
        let found = self.indices.get(name).copied();
        // An error in the core may hide the state, and refuses the core.
        if found.is_none() && (self.core.completeness & self.state_completeness(machine)).is_complete() {
            let near = similar(name, self.states.iter().map(|state| &state.name.name));
            self.refuse_at(*id, FactKind::UnresolvedState { name: name.clone(), instance: None, near });
        }
        found
    }

    /// Adds the states and edges that are reachable from the initial state.
    fn keep_reachable(&mut self, start: usize, edges: Edges) {
        let targets = successors_by(self.states.len(), edges.all.iter().map(|it| (it.source, it.target)));
        let reached = reachable(&targets, [start]);
        let mut number = vec![0; self.states.len()];
        for (index, state) in self.states.iter().enumerate().filter(|(index, _)| reached[*index]) {
            number[index] = self.found.states.len();
            self.found.states.push(state.name.name.clone());
        }
        self.found.initial = number[start];
        let kept = edges.all.into_iter().filter(|edge| reached[edge.source]);
        let renumbered =
            kept.map(|edge| PeriodEdge { source: number[edge.source], target: number[edge.target], ..edge });
        let first = edges.first.into_iter().zip(reached.iter()).filter(|(_, reached)| **reached);
        self.found.edges =
            Arc::new(Edges { all: renumbered.collect(), first: first.map(|(first, _)| first).collect() });
    }
}
