//! The structure of a core: its states and transitions, and everything else but its programs and guards.
//!
//! A core is edited mostly in a program. What is known of a core between its programs, such as its edges, is computed from its
//! structure and from what other queries know of each program, so that such an edit does not compute it anew.

#![allow(missing_docs, reason = "most fields have the names of the language's terms")]

use std::borrow::Cow;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::body::{Body, BodyId, Place, ProgramIn, ScopedCode, bodies_of, by_group, core_scope, statements};
use crate::completeness::Completeness;
use crate::item_tree::{
    Handler, HookKind, Machine, MethodKind, Name, NameRef, SourceId, State, Statement, TypeRef, Variable,
    first_indices,
};
use crate::source::{Decl, core};

/// The structure of a core.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Structure {
    /// The shell that it implements.
    pub shell: Option<TypeRef>,
    pub variables: Vec<Variable>,
    pub handlers: Vec<Handler>,
    /// The names of its operations.
    pub operations: Vec<NameRef>,
    /// The hooks and their keywords.
    pub hooks: Vec<(HookKind, SourceId)>,
    pub machines: Vec<MachineStructure>,
    /// The optional colon after its header.
    pub colon: Option<SourceId>,
    /// The states of all its state machines, by group of bodies.
    states: Vec<Arc<Vec<StateStructure>>>,
    /// Whether no error hides an item of it.
    pub completeness: Completeness,
}

/// The structure of a state machine, without its states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MachineStructure {
    /// The keyword.
    pub id: SourceId,
    pub variables: Vec<Variable>,
    /// Whether no error hides an item of it, or the name of a state.
    pub completeness: Completeness,
}

/// The structure of a state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StateStructure {
    /// Its name; empty if missing.
    pub name: NameRef,
    /// Whether it is the initial state.
    pub initial: bool,
    /// See [`State::start`].
    pub start: SourceId,
    /// The kinds of its methods and their keywords.
    pub methods: Vec<(MethodKind, SourceId)>,
    pub transitions: Vec<TransitionStructure>,
    /// Whether no error hides an item of it.
    pub completeness: Completeness,
}

/// The structure of a transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TransitionStructure {
    pub name: NameRef,
    /// Whether it has a guard; otherwise it always fires.
    pub has_guard: bool,
    pub target: Option<NameRef>,
    pub has_effect: bool,
    /// Whether it has no syntax error outside its guard and effect.
    pub completeness: Completeness,
}

/// Returns the structure of a core: an edit of a program does not change it.
#[salsa::tracked(returns(as_ref))]
pub fn structure_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Option<Structure> {
    let core = core(db, of)?;
    let machine = |it: &Machine| MachineStructure {
        id: it.id,
        variables: it.variables.clone(),
        completeness: it.completeness,
    };
    let states = by_group(db, of, || states_in(db, of, 0), |group| states_of_group(db, of, group));
    Some(Structure {
        shell: core.shell.clone(),
        variables: core.variables.clone(),
        handlers: core.handlers.clone(),
        operations: core.operations.iter().map(|it| it.name.clone()).collect(),
        hooks: core.hooks.iter().map(|it| (it.kind, it.id)).collect(),
        machines: core.machines.iter().map(machine).collect(),
        colon: core.colon,
        states: states.into_iter().map(|group| group.into_owned()).collect(),
        completeness: core.completeness,
    })
}

/// Returns the states in one of several groups of bodies.
#[salsa::tracked(returns(ref))]
fn states_of_group<'db>(db: &'db dyn ModelDb, of: Decl<'db>, group: u32) -> Arc<Vec<StateStructure>> {
    states_in(db, of, group)
}

fn states_in<'db>(db: &'db dyn ModelDb, of: Decl<'db>, group: u32) -> Arc<Vec<StateStructure>> {
    let Some(scope) = core_scope(db, of) else { return Arc::default() };
    let bodies = bodies_of(db, of, scope, group);
    let state = |(_, body): &(BodyId, Body)| match body {
        Body::State(state) => Some(StateStructure::of(state)),
        _ => None,
    };
    Arc::new(bodies.iter().filter_map(state).collect())
}

/// Returns the variables that the programs of a core declare, by group of bodies.
pub(crate) fn local_variables_of<'db>(db: &'db dyn ModelDb, of: Decl<'db>) -> Vec<Cow<'db, Arc<[Variable]>>> {
    by_group(db, of, || local_variables_in(db, of, 0), |group| local_variables_of_group(db, of, group))
}

/// Returns the variables that the programs of one of several groups of bodies declare.
#[salsa::tracked(returns(ref))]
fn local_variables_of_group<'db>(db: &'db dyn ModelDb, of: Decl<'db>, group: u32) -> Arc<[Variable]> {
    local_variables_in(db, of, group)
}

fn local_variables_in<'db>(db: &'db dyn ModelDb, of: Decl<'db>, group: u32) -> Arc<[Variable]> {
    let Some(scope) = core_scope(db, of) else { return Arc::default() };
    let bodies = bodies_of(db, of, scope, group);
    let code = bodies.iter().flat_map(|(_, body)| body.code());
    let programs = code.filter_map(|(_, code)| match code {
        ScopedCode::Program(program) if program.declares => Some(program),
        _ => None,
    });
    let all = programs.flat_map(|program| statements(&program.statements));
    all.filter_map(Statement::variable).cloned().collect()
}

impl Structure {
    /// Returns its only state machine, with the states; `None` if it has none or several.
    pub(crate) fn machine(&self) -> Option<(&MachineStructure, Vec<&StateStructure>)> {
        match self.machines.as_slice() {
            [machine] => Some((machine, self.states().collect())),
            _ => None,
        }
    }

    /// Returns the states of its state machines.
    pub fn states(&self) -> impl Iterator<Item = &StateStructure> {
        self.states.iter().flat_map(|group| group.iter())
    }

    /// Returns the variables that its programs share: its own, and those of its state machines.
    pub(crate) fn shared_variables(&self) -> impl Iterator<Item = &Variable> {
        self.variables.iter().chain(self.machines.iter().flat_map(|machine| &machine.variables))
    }

    /// Returns where the program of its first hook of this kind is.
    pub(crate) fn hook(&self, kind: HookKind) -> Option<BodyId> {
        let index = self.hooks.iter().position(|(hook, _)| *hook == kind)?;
        Some(BodyId::Hook(index as u32))
    }

    /// Returns where the `entry` of its initial state is, which a component executes when it starts.
    pub(crate) fn initial_entry(&self) -> Option<Place> {
        let (state, index) = self.states().zip(0..).find(|(state, _)| state.initial)?;
        Some((BodyId::State(0, index), state.method(MethodKind::Entry)?))
    }
}

impl StateStructure {
    fn of(state: &State) -> StateStructure {
        let transitions = state.transitions.iter().map(|it| TransitionStructure {
            name: it.name.clone(),
            has_guard: it.guard.is_some(),
            target: it.target.clone(),
            has_effect: it.effect.is_some(),
            completeness: it.completeness,
        });
        StateStructure {
            name: state.name.clone(),
            initial: state.initial,
            start: state.start,
            methods: state.methods.iter().map(|it| (it.kind, it.id)).collect(),
            transitions: transitions.collect(),
            completeness: state.completeness,
        }
    }

    /// Returns where its first method of this kind is.
    pub(crate) fn method(&self, kind: MethodKind) -> Option<ProgramIn> {
        let index = self.methods.iter().position(|(method, _)| *method == kind)?;
        Some(ProgramIn::Method(index as u32))
    }

    /// Returns where its methods and guards are.
    pub(crate) fn methods_and_guards(&self) -> impl Iterator<Item = ProgramIn> {
        let methods = (0..self.methods.len()).map(|index| ProgramIn::Method(index as u32));
        let guarded = self.transitions.iter().enumerate().filter(|(_, transition)| transition.has_guard);
        methods.chain(guarded.map(|(index, _)| ProgramIn::Guard(index as u32)))
    }
}

/// Returns the index of the first state of each name.
pub(crate) fn indices_of<'a>(states: &[&'a StateStructure]) -> FxHashMap<&'a Name, usize> {
    first_indices(states.iter().map(|state| &state.name.name))
}

/// Returns the target states of each state's transitions, including those that never fire.
pub(crate) fn successors(states: &[&StateStructure], indices: &FxHashMap<&Name, usize>) -> Vec<Vec<usize>> {
    let targets = |state: &&StateStructure| {
        let targets = state.transitions.iter().filter_map(|it| it.target.as_ref());
        targets.filter_map(|target| indices.get(&target.name).copied()).collect()
    };
    states.iter().map(targets).collect()
}
