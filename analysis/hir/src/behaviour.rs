//! From a core to what one period of it executes: states, edges, and for each program its codels.
//!
//! What the programs cost and what their names refer to is known body by body; this puts the bodies together. Times are not
//! known here, so that a changed table re-runs none of this, and a changed program only its own core.

use crate::cost::{Cost, Costs, costs_of, operations_in};
use std::borrow::Cow;
use std::rc::Rc;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{BodyId, ProgramIn, core_scope};
use crate::completeness::Completeness;
use crate::fact::{
    CorePart, CoreReason, Defined, Fact, FactKind, Reason, Refusal, Unreachable, repeated, unresolved_type,
};
use crate::features::{Features, features_of};
use crate::graph::{reachable, topological_order};
use crate::infer::{NameProblem, inference_of};
use crate::item_tree::{
    Core, FeatureKind, HookKind, Kind, Machine, MethodKind, Name, NameRef, SourceId, State, Transition,
};
use crate::names::{names_of, similar};
use crate::program_id::ProgramId;
use crate::project::Project;
use crate::source::{Decl, Location, core};

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
    pub cost: Arc<Cost<'db>>,
}

/// The name of the one state of a core that has `update` instead of a state machine.
const UPDATE_STATE: &str = "update";

/// Reads a core.
#[salsa::tracked(returns(ref))]
pub fn behaviour_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Behaviour<'db> {
    let Some(data) = core(db, of) else { return Behaviour::default() };
    let names = names_of(db, project);
    let shell = names.resolve_type(db, of, Kind::Shell, data.shell.as_ref());
    // What an unknown shell provides may be called.
    let none = Features { completeness: Completeness::Incomplete, ..Features::default() };
    let features = shell.as_ref().map_or(&none, |&shell| features_of(db, project, shell));
    let mut reader = Reader {
        db,
        project,
        of,
        features,
        core: data,
        states: FxHashMap::default(),
        methods: FxHashMap::default(),
        costs: costs_of(db, project, of).into(),
        found: Behaviour::default(),
    };
    if let Err(unresolved) = &shell {
        reader.found.facts.extend(unresolved_type(of, Kind::Shell, data.shell.as_ref(), unresolved));
        reader.refuse_here(CoreReason::UnknownShell);
    } else if features.completeness.is_incomplete() || features.cycle {
        reader.refuse_here(CoreReason::IncompleteShell(features.incomplete(names)));
    }
    if data.completeness.is_incomplete() {
        reader.refuse_here(CoreReason::SyntaxError(CorePart::Core));
    }
    reader.read();
    reader.found
}

struct Reader<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    features: &'a Features<'db>,
    core: &'db Core,
    /// The first state of each name.
    states: FxHashMap<&'db Name, usize>,
    /// The programs of the methods that have been read.
    methods: FxHashMap<(&'db Name, MethodKind), usize>,
    /// What its programs cost, by group of bodies.
    costs: Rc<[Cow<'db, Costs<'db>>]>,
    found: Behaviour<'db>,
}

impl<'db> Reader<'_, 'db> {
    fn at(&self, id: SourceId) -> Location<'db> {
        Location::Source(self.of, id)
    }

    /// The core is not analysed, because of what another fact reports.
    fn refuse_here(&mut self, why: CoreReason) {
        let refusal = Refusal { reason: Reason::Core { core: self.of, why }, at: Location::name_of(self.of) };
        // Each once; among more than 64, a repetition does no harm.
        if !self.found.refusals.iter().take(64).any(|known| *known == refusal) {
            self.found.refusals.push(refusal);
        }
    }

    /// The core is not analysed, because of what an error elsewhere may hide. Where another reason is known, such as that
    /// error, this one only follows from it.
    fn refuse_hidden(&mut self, why: CoreReason) {
        if self.found.refusals.is_empty() {
            self.refuse_here(why);
        }
    }

    /// Reports an error that keeps the core from being analysed.
    fn refuse(&mut self, fact: Fact<'db>) {
        self.found.refusals.push(Refusal::of_fact(self.project, &fact));
        self.found.facts.push(fact);
    }

    fn refuse_at(&mut self, id: SourceId, kind: FactKind<'db>) {
        let at = self.at(id);
        self.refuse(Fact::new(at, kind));
    }

    fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        let at = self.at(id);
        self.found.facts.push(Fact::new(at, kind));
    }

    fn duplicates<'a>(&self, names: impl Iterator<Item = &'a NameRef>, what: Defined) -> Vec<Fact<'db>> {
        repeated(self.of, names.map(|name| (name, what)))
    }

    fn read(&mut self) {
        self.duplicates_of_core();
        self.resolved(BodyId::CoreValues, ProgramIn::Whole);
        self.operations();
        self.hooks();
        let update = self.core.hooks.iter().position(|hook| hook.kind == HookKind::Update);
        match (self.core.machines.as_slice(), update) {
            ([machine], None) => self.machine(machine),
            ([], Some(update)) => {
                let cost = self.program(BodyId::Hook(update as u32), ProgramIn::Whole);
                self.found.states.push(UPDATE_STATE.into());
                self.found.programs.push(TimedProgram { id: ProgramId::UPDATE, cost });
                self.found.edges.push(Edge { source: 0, target: 0, transition: None, programs: vec![0] });
            }
            // Where there is an error, it may hide one.
            ([], None) if self.core.completeness.is_incomplete() => {}
            ([], None) => self.refuse(Fact::new(Location::name_of(self.of), FactKind::NoBehaviour)),
            ([.., last], None) => self.refuse_at(last.id, FactKind::TwoBehaviours { machines: true }),
            ([machine, ..], Some(_)) => {
                self.refuse_at(machine.id, FactKind::TwoBehaviours { machines: false });
            }
        }
    }

    /// Refuses the core for each unresolved name in a program.
    fn resolved(&mut self, body: BodyId, program: ProgramIn) {
        let group = core_scope(self.db, self.of).as_ref().and_then(|scope| scope.group(body));
        let inference = group.map(|group| inference_of(self.db, self.project, self.of, group));
        let problems = inference.and_then(|inference| inference.problems.get(&(body, program)));
        // Whether the last problem was a hidden name that is the first reason of all.
        let mut is_first = false;
        for problem in problems.into_iter().flatten() {
            let was_first = std::mem::take(&mut is_first);
            match problem {
                // One mistake: what a name does that an error may declare is unknown.
                NameProblem::Error(Fact { kind: FactKind::NoEffect, .. }) if was_first => {}
                NameProblem::Error(fact) => self.refuse(fact.clone()),
                NameProblem::Reported(why) => self.refuse_here(why.clone()),
                NameProblem::Hidden(why) => {
                    is_first = self.found.refusals.is_empty();
                    self.refuse_hidden(why.clone());
                }
            }
        }
    }

    /// The cost of a program, and the value of a guard that is constant.
    fn priced(&mut self, body: BodyId, program: ProgramIn) -> (Arc<Cost<'db>>, Option<bool>) {
        let costs = Rc::clone(&self.costs);
        let group = core_scope(self.db, self.of).as_ref().and_then(|scope| scope.group(body));
        let of_body = group.and_then(|group| costs.get(group as usize)?.get(&body));
        let known = of_body.into_iter().flatten().find(|cost| cost.program == program);
        let Some(known) = known else { return (Arc::default(), None) };
        if known.completeness.is_incomplete() {
            self.refuse_here(match program {
                ProgramIn::Guard(_) => CoreReason::SyntaxError(CorePart::Guard),
                _ => CoreReason::SyntaxError(CorePart::Program),
            });
        }
        self.resolved(body, program);
        self.found.facts.extend(known.facts.iter().cloned());
        (known.cost.clone(), known.decided)
    }

    /// The cost of a program along its worst path.
    fn program(&mut self, body: BodyId, program: ProgramIn) -> Arc<Cost<'db>> {
        self.priced(body, program).0
    }

    fn duplicates_of_core(&mut self) {
        let core = self.core;
        let variables = core.variables.iter().map(|it| (&it.name, Defined::Variable));
        let handlers = core.handlers.iter().map(|it| (&it.name, Defined::Handler));
        self.found.facts.extend(repeated(self.of, variables.chain(handlers)));
        let operations = core.operations.iter().map(|it| &it.name);
        self.duplicates(operations, Defined::Operation).into_iter().for_each(|fact| self.refuse(fact));
        let mut seen = FxHashSet::default();
        for hook in core.hooks.iter().filter(|hook| !seen.insert(hook.kind)) {
            match hook.kind {
                HookKind::Update => self.refuse_at(hook.id, FactKind::DuplicateHook(hook.kind)),
                _ => self.report(hook.id, FactKind::DuplicateHook(hook.kind)),
            }
        }
    }

    /// The hooks that no period executes: their calls are resolved, their times do not count. But one with an error may
    /// have swallowed what a period executes.
    fn hooks(&mut self) {
        for (index, hook) in self.core.hooks.iter().enumerate() {
            if hook.kind != HookKind::Update {
                self.program(BodyId::Hook(index as u32), ProgramIn::Whole);
            }
        }
    }

    fn operations(&mut self) {
        for (index, operation) in self.core.operations.iter().enumerate() {
            // An incomplete operation refuses its callers, and the core is refused for all of them: it
            // executes in the core's own thread.
            let cost = self.program(BodyId::Operation(index as u32), ProgramIn::Whole);
            let id = ProgramId::Operation(operation.name.name.clone());
            self.found.operations.push(TimedProgram { id, cost });
        }
        self.order_operations();
        for operation in &self.core.operations {
            let NameRef { name, id } = &operation.name;
            let mut declared = self.features.by_name.get(name).into_iter().flatten();
            if name.is_empty() || declared.any(|it| it.kind == FeatureKind::Provided) {
                continue;
            }
            // For its callers, its name is that of something else: of a codel, perhaps.
            if self.features.completeness.is_complete() {
                self.refuse_at(*id, FactKind::UndeclaredOperation { name: name.clone() });
            }
        }
        let defined: FxHashSet<&Name> = self.core.operations.iter().map(|it| &it.name.name).collect();
        let is_complete = (self.core.completeness & self.features.completeness).is_complete();
        for (name, found) in
            self.features.by_name.iter().filter(|(name, _)| is_complete && !defined.contains(name))
        {
            if let Some(declared) = found.first().filter(|feature| feature.kind == FeatureKind::Provided) {
                let (name, declared) = (name.clone(), declared.clone());
                let kind = FactKind::UndefinedOperation { core: self.of, name, declared };
                self.found.facts.push(Fact::new(Location::name_of(self.of), kind));
            }
        }
    }

    /// Callees before callers; what is left over calls itself.
    fn order_operations(&mut self) {
        let calls: Vec<Vec<usize>> = self.found.operations.iter().map(|it| operations_in(&it.cost)).collect();
        let (order, in_ring) = topological_order(&calls);
        for (operation, _) in self.core.operations.iter().zip(in_ring).filter(|(_, in_ring)| *in_ring) {
            let name = operation.name.name.clone();
            self.refuse_at(operation.name.id, FactKind::RecursiveOperation { name });
        }
        self.found.order = order;
    }

    fn machine(&mut self, machine: &'db Machine) {
        if machine.completeness.is_incomplete()
            || machine.states.iter().any(|state| state.completeness.is_incomplete())
        {
            self.refuse_here(CoreReason::SyntaxError(CorePart::Machine));
        }
        self.resolved(BodyId::MachineValues, ProgramIn::Whole);
        let variables = self.duplicates(machine.variables.iter().map(|it| &it.name), Defined::Variable);
        self.found.facts.extend(variables);
        let states = self.duplicates(machine.states.iter().map(|it| &it.name), Defined::State);
        states.into_iter().for_each(|fact| self.refuse(fact));
        let Some(start) = self.initial(machine) else { return };
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

    /// The number of the initial state.
    fn initial(&mut self, machine: &Machine) -> Option<usize> {
        let initial: Vec<usize> =
            (0..machine.states.len()).filter(|&it| machine.states[it].initial).collect();
        match initial.as_slice() {
            [one] => return Some(*one),
            [] => {
                if machine.completeness.is_complete() {
                    let first = machine.states.first().map(|it| (it.name.name.clone(), it.start));
                    self.refuse_at(machine.id, FactKind::NoInitialState { first });
                }
            }
            [first, second, ..] => {
                let (first, second) = (&machine.states[*first].name, &machine.states[*second].name);
                let all = initial.iter().map(|&it| &machine.states[it]);
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

    /// Warns of states that no transition leads to, were it ever taken.
    fn unreachable(&mut self, machine: &Machine, start: usize) {
        if !self.found.refusals.is_empty() {
            return;
        }
        let reached = reachable(&leads_to(machine), start);
        for (state, _) in machine.states.iter().zip(reached).filter(|(_, reached)| !reached) {
            let NameRef { name, id } = &state.name;
            self.report(*id, FactKind::UnreachableState { name: name.clone() });
        }
    }

    /// The edges out of a state: its transitions in the order of the text, then staying.
    fn state(&mut self, machine: &'db Machine, index: usize, edges: &mut Vec<Edge>) {
        let state = &machine.states[index];
        let transitions = self.duplicates(state.transitions.iter().map(|it| &it.name), Defined::Transition);
        transitions.into_iter().for_each(|fact| self.refuse(fact));
        let mut seen = FxHashSet::default();
        for method in state.methods.iter().filter(|method| !seen.insert(method.kind)) {
            self.refuse_at(method.id, FactKind::DuplicateMethod(method.kind));
        }
        // The `entry` of the initial state runs once at the start, of another state with a transition to it; a program
        // is read all the same.
        self.method(index, state, MethodKind::Entry);
        let run = self.method(index, state, MethodKind::Run);
        let exit = self.method(index, state, MethodKind::Exit);
        let handle = self.method(index, state, MethodKind::Handle);
        // `run`, then each guard up to the one that holds.
        let mut before: Vec<usize> = run.into_iter().collect();
        let mut fires_always: Option<&Transition> = None;
        for (number, transition) in state.transitions.iter().enumerate() {
            let body = BodyId::State(0, index as u32);
            let (name, number) = (&transition.name.name, number as u32);
            if transition.completeness.is_incomplete() {
                self.refuse_here(CoreReason::SyntaxError(CorePart::Transition));
            }
            let mut decided = None;
            if transition.guard.is_some() {
                let (cost, value) = self.priced(body, ProgramIn::Guard(number));
                decided = value;
                let (state, transition) = (state.name.name.clone(), name.clone());
                self.push_program(&mut before, ProgramId::Guard { state, transition }, cost);
            }
            let mut own = Vec::new();
            if transition.effect.is_some() {
                let cost = self.program(body, ProgramIn::Effect(number));
                let (state, transition) = (state.name.name.clone(), name.clone());
                self.push_program(&mut own, ProgramId::Effect { state, transition }, cost);
            }
            let target = self.target(machine, transition);
            // What comes after a transition without a guard never happens, but it is read all the same.
            if let Some(always) = fires_always {
                self.never_taken(transition, always);
                continue;
            }
            if decided == Some(false) {
                self.report(transition.name.id, FactKind::UnreachableCode(Unreachable::Guard));
                continue;
            }
            let mut programs = before.clone();
            programs.extend(exit);
            programs.extend(own);
            if let Some(target) = target {
                programs.extend(self.method(target, &machine.states[target], MethodKind::Entry));
                edges.push(Edge { source: index, target, transition: Some(name.clone()), programs });
            }
            if transition.guard.is_none() || decided == Some(true) {
                fires_always = Some(transition);
            }
        }
        if fires_always.is_none() {
            before.extend(handle);
            edges.push(Edge { source: index, target: index, transition: None, programs: before });
        }
    }

    /// Reports a transition behind one that always fires.
    fn never_taken(&mut self, transition: &Transition, always: &Transition) {
        let (name, first) = (&transition.name, &always.name);
        if transition.completeness.is_incomplete()
            || always.completeness.is_incomplete()
            || name.name.is_empty()
        {
            return;
        }
        let first_at = self.at(first.id);
        self.report(
            name.id,
            match always.guard {
                None => FactKind::NeverTaken { name: name.name.clone(), first: first.name.clone(), first_at },
                Some(_) => FactKind::UnreachableCode(Unreachable::Behind(first.name.clone())),
            },
        );
    }

    fn push_program(&mut self, programs: &mut Vec<usize>, id: ProgramId, cost: Arc<Cost<'db>>) {
        programs.push(self.found.programs.len());
        self.found.programs.push(TimedProgram { id, cost });
    }

    /// The index of a method's program, read when it is first met.
    fn method(&mut self, index: usize, state: &'db State, kind: MethodKind) -> Option<usize> {
        let number = state.methods.iter().position(|method| method.kind == kind)?;
        let name = &state.name.name;
        if let Some(&known) = self.methods.get(&(name, kind)) {
            return Some(known);
        }
        let cost = self.program(BodyId::State(0, index as u32), ProgramIn::Method(number as u32));
        self.methods.insert((name, kind), self.found.programs.len());
        self.found.programs.push(TimedProgram { id: ProgramId::Method { state: name.clone(), kind }, cost });
        Some(self.found.programs.len() - 1)
    }

    fn target(&mut self, machine: &'db Machine, transition: &Transition) -> Option<usize> {
        let Some(NameRef { name, id }) = &transition.target else {
            self.refuse_here(CoreReason::SyntaxError(CorePart::Transition));
            return None;
        };
        let found = self.states.get(name).copied();
        if found.is_none() {
            let near = similar(name, machine.states.iter().map(|state| &state.name.name));
            self.refuse_at(*id, FactKind::UnresolvedState { name: name.clone(), near });
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
