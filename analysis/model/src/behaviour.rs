//! From a core to what one period of it executes: states, edges, and for each program its codels.
//!
//! Times are not known here, so that a changed table re-runs none of this, and a changed program only its own core.

mod program;

use rustc_hash::{FxHashMap, FxHashSet};

use program::Scope;

use crate::ModelDb;
use crate::fact::{
    CorePart, CoreReason, Defined, Fact, FactKind, Reason, Unreachable, repeated, unresolved_type,
};
use crate::item_tree::{
    Core, FeatureKind, HookKind, Kind, Machine, MethodKind, Name, NameRef, Part, Program, State, Transition,
    Variable,
};
use crate::names::{Features, Names, features_of, names_of, similar};
use crate::program_id::ProgramId;
use crate::project::Project;
use crate::source::{Decl, Place, core};
use crate::values::Value;

/// What a core executes each period.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Behaviour<'db> {
    /// The states that the initial one reaches, in the order of the text.
    pub states: Vec<Name>,
    /// The index of the initial one.
    pub initial: usize,
    /// What one period may do (paper, eq. 6, as generated code does it).
    pub edges: Vec<Edge>,
    /// The programs that the edges execute.
    pub programs: Vec<TimedProgram<'db>>,
    /// The operations that the core defines, which its programs may call.
    pub operations: Vec<TimedProgram<'db>>,
    /// The operations, each after those that it calls.
    pub order: Vec<usize>,
    /// Why the core cannot be analysed; then the rest is not to be used.
    pub refusals: Vec<Refusal<'db>>,
    /// What is wrong in the core.
    pub facts: Vec<Fact<'db>>,
}

/// One way through a period: from a state to a state, executing these programs one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edge {
    /// Index of the state in which the period starts.
    pub source: usize,
    /// Index of the state in which the next one starts.
    pub target: usize,
    /// The transition that fires; none where the machine stays.
    pub transition: Option<Name>,
    /// Indices of the programs, in the order of execution.
    pub programs: Vec<usize>,
}

/// A program with a key of its own in a timing table.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct TimedProgram<'db> {
    /// Which program: its key behind `Component/`.
    pub id: ProgramId,
    /// What it costs at most.
    pub cost: Cost<'db>,
}

/// The cost of a program along its worst path, by codels.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub enum Cost<'db> {
    /// One execution of a codel.
    Codel(Decl<'db>),
    /// One execution of an operation that the core itself provides: an index into [`Behaviour::operations`].
    Operation(usize),
    /// All of these.
    Sum(Vec<Cost<'db>>),
    /// The greatest of these.
    Greatest(Vec<Cost<'db>>),
}

/// Why something is not analysed.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Refusal<'db> {
    /// Why.
    pub reason: Reason<'db>,
    /// Where the reason stands.
    pub at: Place<'db>,
    /// Does a diagnostic of its own say so already?
    pub reported: bool,
}

impl<'db> Refusal<'db> {
    /// A reason that another diagnostic reports at its place.
    pub(crate) fn reported(reason: Reason<'db>, at: Place<'db>) -> Refusal<'db> {
        Refusal { reason, at, reported: true }
    }

    /// What a fact reports.
    pub(crate) fn of_fact(project: Project<'db>, fact: &Fact<'db>) -> Refusal<'db> {
        Refusal::reported(Reason::Error(project, Box::new(fact.clone())), fact.at.clone())
    }
}

/// The name of the one state of a core that has `update` instead of a state machine.
pub(crate) const UPDATE_STATE: &str = "update";

/// Reads a core.
#[salsa::tracked(returns(ref))]
pub fn behaviour_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Behaviour<'db> {
    let Some(data) = core(db, of) else { return Behaviour::default() };
    let names = names_of(db, project);
    let shell = names.resolve_type(db, of, Kind::Shell, data.shell.as_ref());
    // What an unknown shell provides may be called.
    let none = Features { lost: true, ..Features::default() };
    let features = shell.as_ref().map_or(&none, |&shell| features_of(db, project, shell));
    let mut reader = Reader {
        db,
        project,
        of,
        names,
        features,
        core: data,
        states: FxHashMap::default(),
        methods: FxHashMap::default(),
        scope: Scope::default(),
        variables_lost: !data.whole || data.machines.iter().any(|machine| !machine.whole),
        statement: None,
        program_whole: true,
        found: Behaviour::default(),
    };
    if let Err(unresolved) = &shell {
        reader.found.facts.extend(unresolved_type(of, Kind::Shell, data.shell.as_ref(), unresolved));
        reader.refuse_here(CoreReason::UnknownShell);
    } else if features.lost || features.cycle {
        reader.refuse_here(CoreReason::IncompleteShell(features.incomplete(names)));
    }
    if !data.whole {
        reader.refuse_here(CoreReason::SyntaxError(CorePart::Core));
    }
    reader.read();
    reader.found
}

struct Reader<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    names: &'db Names<'db>,
    features: &'a Features<'db>,
    core: &'db Core,
    /// The first state of each name.
    states: FxHashMap<&'db Name, usize>,
    /// The programs of the methods that have been read.
    methods: FxHashMap<(&'db Name, MethodKind), usize>,
    scope: Scope,
    /// May the declaration of a variable have been lost, in the core or in the program that is being read?
    variables_lost: bool,
    /// The call that the last statement is: its name, all of it, its first argument.
    statement: Option<(Part, Part, Option<Part>)>,
    /// Was nothing lost in the program that is being read?
    program_whole: bool,
    found: Behaviour<'db>,
}

impl<'db> Reader<'_, 'db> {
    fn at(&self, part: Part) -> Place<'db> {
        Place::Part(self.of, part)
    }

    /// The core is not analysed, because of what a diagnostic elsewhere in it says.
    fn refuse_here(&mut self, why: CoreReason) {
        let reason = Reason::Core { core: self.of, why };
        let refusal = Refusal::reported(reason, Place::name_of(self.of));
        // Said once, as far as anybody reads.
        if !self.found.refusals.iter().take(64).any(|known| *known == refusal) {
            self.found.refusals.push(refusal);
        }
    }

    /// The core is not analysed, because of what an error elsewhere may have taken. Where another reason is known, such
    /// as that error, this one only follows from it.
    fn refuse_in_doubt(&mut self, why: CoreReason) {
        if self.found.refusals.is_empty() {
            self.refuse_here(why);
        }
    }

    /// Reports a mistake that keeps the core from being analysed.
    fn refuse(&mut self, at: Place<'db>, kind: FactKind<'db>) {
        self.refuse_for(Fact::new(at, kind));
    }

    /// See [`Reader::refuse`].
    fn refuse_for(&mut self, fact: Fact<'db>) {
        self.found.refusals.push(Refusal::of_fact(self.project, &fact));
        self.found.facts.push(fact);
    }

    /// Reports what keeps no core from being analysed.
    fn report(&mut self, at: Place<'db>, kind: FactKind<'db>) {
        self.found.facts.push(Fact::new(at, kind));
    }

    fn read(&mut self) {
        self.core.variables.iter().for_each(|variable| self.scope.push(&variable.name.name));
        self.core.handlers.iter().for_each(|handler| self.scope.push(&handler.name.name));
        self.duplicates_of_core();
        self.initial_values(&self.core.variables);
        self.operations();
        self.hooks();
        match (self.core.machines.as_slice(), self.update()) {
            ([machine], None) => self.machine(machine),
            ([], Some(update)) => {
                let cost = self.program(update);
                self.found.states.push(UPDATE_STATE.into());
                self.found.programs.push(TimedProgram { id: ProgramId::UPDATE, cost });
                self.found.edges.push(Edge { source: 0, target: 0, transition: None, programs: vec![0] });
            }
            // Where there is an error, it may have hidden that.
            ([], None) if !self.core.whole => {}
            ([], None) => self.refuse(Place::name_of(self.of), FactKind::NoBehaviour),
            ([.., last], None) => {
                self.refuse(self.at(last.part), FactKind::TwoBehaviours { machines: true });
            }
            ([machine, ..], Some(_)) => {
                self.refuse(self.at(machine.part), FactKind::TwoBehaviours { machines: false });
            }
        }
    }

    fn update(&self) -> Option<&'db Program> {
        self.core.hooks.iter().find(|hook| hook.kind == HookKind::Update).map(|hook| &hook.program)
    }

    fn duplicates_of_core(&mut self) {
        let of = self.of;
        let variables = self.core.variables.iter().map(|it| (&it.name, Defined::Variable));
        let handlers = self.core.handlers.iter().map(|it| (&it.name, Defined::Handler));
        self.found.facts.extend(repeated(of, variables.chain(handlers)));
        let operations = self.core.operations.iter().map(|it| (&it.name, Defined::Operation));
        repeated(of, operations).into_iter().for_each(|it| self.refuse_for(it));
        let mut seen = FxHashSet::default();
        for hook in &self.core.hooks {
            if !seen.insert(hook.kind) {
                let (at, duplicate) = (self.at(hook.part), FactKind::DuplicateHook(hook.kind));
                match hook.kind {
                    HookKind::Update => self.refuse(at, duplicate),
                    _ => self.report(at, duplicate),
                }
            }
        }
    }

    /// The hooks that no period executes: their calls are looked at, their times count nothing. But one with an error may
    /// have swallowed what a period executes.
    fn hooks(&mut self) {
        for hook in self.core.hooks.iter().filter(|hook| hook.kind != HookKind::Update) {
            self.program(&hook.program);
        }
    }

    /// What variables begin with is computed once: their calls are looked at, their times count nothing.
    fn initial_values(&mut self, variables: &[Variable]) {
        for value in variables.iter().filter_map(|variable| variable.value.as_ref()) {
            self.expr(value, &mut Vec::new());
        }
    }

    fn operations(&mut self) {
        for operation in &self.core.operations {
            let depth = self.scope.names.len();
            operation.parameters.iter().for_each(|parameter| self.scope.push(&parameter.name.name));
            // An operation that cannot be read refuses whoever calls it, and the core is refused for all of them: it
            // executes in the core's own thread.
            let cost = self.program(&operation.program);
            self.scope.truncate(depth);
            let id = ProgramId::Operation(operation.name.name.clone());
            self.found.operations.push(TimedProgram { id, cost });
        }
        self.order_operations();
        for operation in &self.core.operations {
            let name = &operation.name.name;
            let declared = self.features.by_name.get(name).into_iter().flatten();
            if name.is_empty() || declared.into_iter().any(|it| it.kind == FeatureKind::Provided) {
                continue;
            }
            // Its name is another one to whoever calls it: a codel's, perhaps.
            if !self.features.lost {
                let at = self.at(operation.name.part);
                self.refuse(at, FactKind::UndeclaredOperation { name: name.clone() });
            }
        }
        let defined: FxHashSet<&Name> = self.core.operations.iter().map(|it| &it.name.name).collect();
        let whole = self.core.whole && !self.features.lost;
        for (name, found) in self.features.by_name.iter().filter(|(name, _)| whole && !defined.contains(name))
        {
            if let Some(declared) = found.first().filter(|feature| feature.kind == FeatureKind::Provided) {
                let (core, name, declared) = (self.of, name.clone(), declared.clone());
                self.report(Place::name_of(core), FactKind::UndefinedOperation { core, name, declared });
            }
        }
    }

    /// Callees before callers; what is left over calls itself.
    fn order_operations(&mut self) {
        let calls: Vec<Vec<usize>> = self.found.operations.iter().map(|it| operations_in(&it.cost)).collect();
        let (order, in_ring) = ordered(&calls);
        for (operation, _) in self.core.operations.iter().zip(in_ring).filter(|(_, in_ring)| *in_ring) {
            let NameRef { name, part } = &operation.name;
            self.refuse(self.at(*part), FactKind::RecursiveOperation { name: name.clone() });
        }
        self.found.order = order;
    }

    fn machine(&mut self, machine: &'db Machine) {
        if !machine.whole || machine.states.iter().any(|state| !state.whole) {
            self.refuse_here(CoreReason::SyntaxError(CorePart::Machine));
        }
        machine.variables.iter().for_each(|variable| self.scope.push(&variable.name.name));
        self.initial_values(&machine.variables);
        let variables = machine.variables.iter().map(|it| (&it.name, Defined::Variable));
        self.found.facts.extend(repeated(self.of, variables));
        let states = machine.states.iter().map(|it| (&it.name, Defined::State));
        repeated(self.of, states).into_iter().for_each(|it| self.refuse_for(it));
        let initial: Vec<usize> =
            (0..machine.states.len()).filter(|&it| machine.states[it].initial).collect();
        let start = match initial.as_slice() {
            [one] => *one,
            [] => {
                if machine.whole {
                    let first = machine.states.first().map(|it| (it.name.name.clone(), it.start));
                    self.refuse(self.at(machine.part), FactKind::NoInitialState { first });
                }
                return;
            }
            [first, second, ..] => {
                let (first, second) = (&machine.states[*first].name, &machine.states[*second].name);
                let initial = machine.states.iter().filter(|it| it.initial);
                let kind = FactKind::SeveralInitialStates {
                    first: (first.name.clone(), first.part),
                    second: second.name.clone(),
                    all: initial.map(|it| (it.name.name.clone(), it.start)).collect(),
                };
                self.refuse(self.at(second.part), kind);
                return;
            }
        };
        for (index, state) in machine.states.iter().enumerate() {
            self.states.entry(&state.name.name).or_insert(index);
        }
        let mut edges = Vec::new();
        for index in 0..machine.states.len() {
            self.state(machine, index, &mut edges);
        }
        self.unreachable(machine, start);
        self.keep_reachable(machine, start, edges);
    }

    /// Warns of states that no transition leads to, were it ever taken.
    fn unreachable(&mut self, machine: &Machine, start: usize) {
        if !self.found.refusals.is_empty() {
            return;
        }
        let reached = reachable(&leads_to(machine), start);
        for (state, _) in machine.states.iter().zip(reached).filter(|(_, reached)| !reached) {
            let NameRef { name, part } = &state.name;
            self.report(self.at(*part), FactKind::UnreachableState { name: name.clone() });
        }
    }

    /// The edges out of a state: its transitions in the order of the text, then staying.
    fn state(&mut self, machine: &'db Machine, index: usize, edges: &mut Vec<Edge>) {
        let state = &machine.states[index];
        let transitions = state.transitions.iter().map(|it| (&it.name, Defined::Transition));
        repeated(self.of, transitions).into_iter().for_each(|it| self.refuse_for(it));
        let mut seen = FxHashSet::default();
        for method in &state.methods {
            if !seen.insert(method.kind) {
                self.refuse(self.at(method.part), FactKind::DuplicateMethod(method.kind));
            }
        }
        // The `entry` of the initial state runs once at the start, of another state with a transition to it; a program
        // is read all the same.
        self.method(state, MethodKind::Entry);
        let run = self.method(state, MethodKind::Run);
        let exit = self.method(state, MethodKind::Exit);
        let handle = self.method(state, MethodKind::Handle);
        // `run`, then each guard up to the one that holds.
        let mut before: Vec<usize> = run.into_iter().collect();
        let mut fires_always: Option<&Transition> = None;
        for transition in &state.transitions {
            if !transition.whole {
                self.refuse_here(CoreReason::SyntaxError(CorePart::Transition));
            }
            let mut value = None;
            if let Some(guard) = &transition.guard {
                if !guard.whole {
                    self.refuse_here(CoreReason::SyntaxError(CorePart::Guard));
                }
                let mut costs = Vec::new();
                value = self.expr(&guard.condition, &mut costs);
                let (state, transition) = (state.name.name.clone(), transition.name.name.clone());
                self.push_program(&mut before, ProgramId::Guard { state, transition }, Cost::Sum(costs));
            }
            let mut own = Vec::new();
            if let Some(effect) = &transition.effect {
                let cost = self.program(effect);
                let (state, transition) = (state.name.name.clone(), transition.name.name.clone());
                self.push_program(&mut own, ProgramId::Effect { state, transition }, cost);
            }
            let target = self.target(machine, transition);
            // What comes after a transition without a guard never happens, but it is read all the same.
            if let Some(always) = fires_always {
                let (name, first) = (transition.name.name.clone(), always.name.name.clone());
                if transition.whole && always.whole && !name.is_empty() {
                    let kind = match always.guard {
                        None => FactKind::NeverTaken { name, first, first_at: self.at(always.name.part) },
                        Some(_) => FactKind::UnreachableCode(Unreachable::Behind(first)),
                    };
                    self.report(self.at(transition.name.part), kind);
                }
                continue;
            }
            if value == Some(Value::Bool(false)) {
                let at = self.at(transition.name.part);
                self.report(at, FactKind::UnreachableCode(Unreachable::Guard));
                continue;
            }
            let mut programs = before.clone();
            programs.extend(exit);
            programs.extend(own);
            if let Some(target) = target {
                programs.extend(self.method(&machine.states[target], MethodKind::Entry));
                let transition = Some(transition.name.name.clone());
                edges.push(Edge { source: index, target, transition, programs });
            }
            if transition.guard.is_none() || value == Some(Value::Bool(true)) {
                fires_always = Some(transition);
            }
        }
        if fires_always.is_none() {
            before.extend(handle);
            edges.push(Edge { source: index, target: index, transition: None, programs: before });
        }
    }

    fn push_program(&mut self, programs: &mut Vec<usize>, id: ProgramId, cost: Cost<'db>) {
        programs.push(self.found.programs.len());
        self.found.programs.push(TimedProgram { id, cost });
    }

    /// The index of a method's program, read when it is first met.
    fn method(&mut self, state: &'db State, kind: MethodKind) -> Option<usize> {
        let method = state.methods.iter().find(|method| method.kind == kind)?;
        let name = &state.name.name;
        if let Some(&known) = self.methods.get(&(name, kind)) {
            return Some(known);
        }
        let cost = self.program(&method.program);
        self.methods.insert((name, kind), self.found.programs.len());
        let id = ProgramId::Method { state: name.clone(), kind };
        self.found.programs.push(TimedProgram { id, cost });
        Some(self.found.programs.len() - 1)
    }

    fn target(&mut self, machine: &'db Machine, transition: &Transition) -> Option<usize> {
        let Some(target) = &transition.target else {
            self.refuse_here(CoreReason::SyntaxError(CorePart::Transition));
            return None;
        };
        let found = self.states.get(&target.name).copied();
        if found.is_none() {
            let near = similar(&target.name, machine.states.iter().map(|state| &state.name.name));
            let name = target.name.clone();
            self.refuse(self.at(target.part), FactKind::UnresolvedState { name, near });
        }
        found
    }

    /// States that the initial one does not reach are left out: no period of theirs ever happens.
    fn keep_reachable(&mut self, machine: &Machine, start: usize, edges: Vec<Edge>) {
        let mut targets = vec![Vec::new(); machine.states.len()];
        edges.iter().for_each(|edge| targets[edge.source].push(edge.target));
        let reached = reachable(&targets, start);
        let mut number = vec![0; machine.states.len()];
        for (index, state) in machine.states.iter().enumerate().filter(|(index, _)| reached[*index]) {
            number[index] = self.found.states.len();
            self.found.states.push(state.name.name.clone());
        }
        self.found.initial = number[start];
        let kept = edges.into_iter().filter(|edge| reached[edge.source]);
        self.found.edges = kept
            .map(|edge| Edge { source: number[edge.source], target: number[edge.target], ..edge })
            .collect();
    }
}

/// The states that each state of a machine leads to, were every transition taken.
pub(crate) fn leads_to(machine: &Machine) -> Vec<Vec<usize>> {
    // The first of each name.
    let states = machine.states.iter().enumerate().rev();
    let number: FxHashMap<&Name, usize> = states.map(|(number, it)| (&it.name.name, number)).collect();
    let targets = |state: &State| {
        let targets = state.transitions.iter().filter_map(|it| it.target.as_ref());
        targets.filter_map(|target| number.get(&target.name).copied()).collect()
    };
    machine.states.iter().map(|state| targets(state)).collect()
}

/// Which nodes are reached from `start`.
pub(crate) fn reachable(leads_to: &[Vec<usize>], start: usize) -> Vec<bool> {
    let mut reached = vec![false; leads_to.len()];
    let mut open = vec![start];
    while let Some(node) = open.pop() {
        if !std::mem::replace(&mut reached[node], true) {
            open.extend(&leads_to[node]);
        }
    }
    reached
}

pub(crate) fn operations_in(cost: &Cost<'_>) -> Vec<usize> {
    match cost {
        Cost::Codel(_) => Vec::new(),
        Cost::Operation(index) => vec![*index],
        Cost::Sum(costs) | Cost::Greatest(costs) => costs.iter().flat_map(operations_in).collect(),
    }
}

/// Of nodes that lead to others: each after all that it leads to, but those that lead to a ring; and which are part of one,
/// or between two.
pub(crate) fn ordered(leads_to: &[Vec<usize>]) -> (Vec<usize>, Vec<bool>) {
    let mut comes_from = vec![Vec::new(); leads_to.len()];
    for (node, others) in leads_to.iter().enumerate() {
        for &other in others {
            comes_from[other].push(node);
        }
    }
    let order = peel(leads_to, &comes_from);
    let mut in_ring = vec![order.len() < leads_to.len(); leads_to.len()];
    // Of what leads to a ring, some only lead to it.
    order.iter().chain(&peel(&comes_from, leads_to)).for_each(|&node| in_ring[node] = false);
    (order, in_ring)
}

/// The nodes that no ring can be reached from, each after all that it leads to.
fn peel(leads_to: &[Vec<usize>], comes_from: &[Vec<usize>]) -> Vec<usize> {
    let mut left: Vec<usize> = leads_to.iter().map(Vec::len).collect();
    let mut order: Vec<usize> = (0..left.len()).filter(|&node| left[node] == 0).collect();
    let mut next = 0;
    while let Some(&node) = order.get(next) {
        next += 1;
        for &before in &comes_from[node] {
            left[before] -= 1;
            if left[before] == 0 {
                order.push(before);
            }
        }
    }
    order
}
