//! The data flow through each program, for each group of bodies: an edit of one group does not invalidate the others.
//!
//! Local variables and statements that no path comes to concern no other program: their facts are here.

use std::borrow::Cow;
use std::cell::{LazyCell, OnceCell};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::body::{BodyId, ByProgram, CoreScope, InitialValue, ProgramIn, by_group, core_scope, of_program};
use crate::fact::{Fact, FactKind};
use crate::infer::{Inference, VariableKind, VariableOf, inference_of, shared_variables};
use crate::item_tree::{MethodKind, Name, NameRef, SourceId};
use crate::program_graph::graphs_of_group;
use crate::project::Project;
use crate::source::{Decl, Location};
use crate::structure::{StateStructure, Structure, TransitionStructure, indices_of};
use crate::types::Type;

use super::indices::Indices;
use super::operations::effects_of;
use super::program::{OperationEffects, ProgramFlow, Read};

/// The data flow through the programs of a group of bodies.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct GroupFlow<'db> {
    /// The statements that no path comes to.
    pub(super) unreachable: Vec<Fact<'db>>,
    /// The facts about parameters and local variables.
    pub(super) local: Vec<Fact<'db>>,
    /// The shared variables that a program reads, or whose values a call needs as output arguments.
    pub(super) used: Indices,
    programs: ByProgram<ProgramFlow>,
}

/// The data flow through all programs of a core.
pub(super) struct CoreFlow<'a, 'db> {
    scope: &'db CoreScope,
    groups: &'a [Cow<'db, GroupFlow<'db>>],
    /// The states of its only state machine.
    states: Vec<&'db StateStructure>,
    indices: OnceCell<FxHashMap<&'db Name, usize>>,
}

impl<'a, 'db> CoreFlow<'a, 'db> {
    pub(super) fn new(
        core: &'db Structure,
        scope: &'db CoreScope,
        groups: &'a [Cow<'db, GroupFlow<'db>>],
    ) -> CoreFlow<'a, 'db> {
        let states = core.machine().map_or_else(Vec::new, |(_, states)| states);
        CoreFlow { scope, groups, states, indices: OnceCell::new() }
    }

    pub(super) fn groups(&self) -> impl Iterator<Item = &'a GroupFlow<'db>> {
        self.groups.iter().map(Cow::as_ref)
    }

    pub(super) fn get(&self, body: BodyId, program: ProgramIn) -> Option<&'a ProgramFlow> {
        let (group, index) = self.scope.place(body)?;
        of_program(&self.groups.get(group)?.programs, index, program)
    }

    /// Returns a program of a state of the only state machine of the core.
    pub(super) fn of_state(&self, index: usize, program: ProgramIn) -> Option<&'a ProgramFlow> {
        self.get(BodyId::State(0, index as u32), program)
    }

    /// Returns the method of a state of the only state machine of the core.
    pub(super) fn method(&self, index: usize, kind: MethodKind) -> Option<&'a ProgramFlow> {
        self.of_state(index, self.states.get(index)?.method(kind)?)
    }

    /// Returns all programs and guards.
    pub(super) fn all(&self) -> impl Iterator<Item = &'a (ProgramIn, ProgramFlow)> {
        self.groups().flat_map(|group| &group.programs).flatten()
    }

    /// Returns the states of the only state machine of the core.
    pub(super) fn states(&self) -> &[&'db StateStructure] {
        &self.states
    }

    /// Returns the index of the first state of each name.
    pub(super) fn indices(&self) -> &FxHashMap<&'db Name, usize> {
        self.indices.get_or_init(|| indices_of(&self.states))
    }

    /// Returns the index of the state that a transition leads to.
    pub(super) fn target(&self, transition: &TransitionStructure) -> Option<usize> {
        self.indices().get(&transition.target.as_ref()?.name).copied()
    }
}

/// Returns the data flow of each group of bodies of a core.
pub(super) fn groups_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    effects: &[OperationEffects],
) -> Vec<Cow<'db, GroupFlow<'db>>> {
    let of_group = |group| flow_of_group(db, project, of, group);
    by_group(db, of, || flow_in(db, project, of, effects, 0), of_group)
}

/// Returns the data flow of one of several groups of bodies.
#[salsa::tracked(returns(ref))]
fn flow_of_group<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    group: u32,
) -> GroupFlow<'db> {
    let Some(scope) = core_scope(db, of) else { return GroupFlow::default() };
    flow_in(db, project, of, &effects_of(db, project, of, scope), group)
}

fn flow_in<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    effects: &[OperationEffects],
    group: u32,
) -> GroupFlow<'db> {
    let shared = shared_variables(db, project, of);
    let locals = Locals::new(of, shared.len(), inference_of(db, project, of, group));
    let (mut found, mut used) = (GroupFlow::default(), Indices::default());
    for programs in graphs_of_group(db, project, of, group) {
        let has_guard = |number| programs.iter().any(|(program, _)| *program == ProgramIn::Guard(number));
        let mut flows = Vec::with_capacity(programs.len());
        for (program, graph) in programs {
            let unreachable = graph.unreachable.iter().map(|(why, id)| {
                Fact::new(Location::Source(of, *id), FactKind::UnreachableCode(why.clone()))
            });
            found.unreachable.extend(unreachable);
            graph.used().for_each(|it| used.insert(it.number(shared.len())));
            let is_conditional = matches!(program, ProgramIn::Effect(number) if has_guard(*number));
            let mut flow = ProgramFlow::of(graph, shared.len(), effects, is_conditional);
            found.local.extend(locals.reads_before_assignment(&flow.reads));
            flow.reads = flow
                .reads
                .into_iter()
                .filter(|it| shared.get(it.variable).is_some_and(may_lack_value))
                .collect();
            flow.assigns = flow.assigns.below(shared.len());
            flows.push((*program, flow));
        }
        found.programs.push(flows.into());
    }
    found.local.extend(locals.unused(&used));
    found.used = used.below(shared.len());
    found
}

/// Returns whether the value may be unknown before the first assignment. Whether an unknown type, such as a pointer, has an initial
/// value is unknown.
fn may_lack_value(variable: &VariableOf) -> bool {
    !matches!(variable.ty, Type::External(_) | Type::Unknown)
}

/// The local variables of a group of bodies.
struct Locals<'db> {
    of: Decl<'db>,
    /// The number of the first one.
    first: usize,
    inference: &'db Inference<'db>,
    /// Those that share a name: another fact reports this, and does not say which of them a name should mean.
    repeated: FxHashSet<SourceId>,
}

impl<'db> Locals<'db> {
    fn new(of: Decl<'db>, first: usize, inference: &'db Inference<'db>) -> Locals<'db> {
        let repeated = inference.facts.iter().filter_map(|fact| match (&fact.at, &fact.kind) {
            (
                Location::Source(_, id),
                FactKind::DuplicateDefinition { first: Location::Source(_, first), .. },
            ) => Some([*id, *first]),
            _ => None,
        });
        Locals { of, first, inference, repeated: repeated.flatten().collect() }
    }

    fn reads_before_assignment(&self, reads: &[Read]) -> Vec<Fact<'db>> {
        let mut found = Vec::new();
        for reads in reads.chunk_by(|one, other| one.variable == other.variable) {
            let first = reads.iter().min_by_key(|it| it.id);
            let variable =
                first.and_then(|it| self.inference.variables.get(it.variable.checked_sub(self.first)?));
            let Some((first, variable)) = first.zip(variable) else { continue };
            let NameRef { name, id } = &variable.name;
            if variable.value == InitialValue::None && may_lack_value(variable) && !self.repeated.contains(id)
            {
                let declared = Location::Source(self.of, *id);
                let kind = FactKind::ReadBeforeAssignment { name: name.clone(), declared };
                found.push(Fact::new(Location::Source(self.of, first.id), kind));
            }
        }
        found
    }

    fn unused(&self, used: &Indices) -> Vec<Fact<'db>> {
        // Lazy, because most cores have no unused variables.
        let named = LazyCell::new(|| {
            let bindings = self.inference.bindings();
            bindings.filter_map(|(_, it)| it.local_variable()).collect::<FxHashSet<usize>>()
        });
        let unused = self.inference.variables.iter().enumerate().filter(|(index, it)| {
            let is_parameter = matches!(it.kind, VariableKind::Parameter(_));
            !is_parameter && !used.contains(self.first + index) && !self.repeated.contains(&it.name.id)
        });
        unused.filter_map(|(index, it)| unused_variable(self.of, it, named.contains(&index))).collect()
    }
}

/// Returns the fact about a variable that no program uses, unless its name is missing. `is_named`: whether a program assigns it.
pub(super) fn unused_variable<'db>(
    of: Decl<'db>,
    variable: &VariableOf,
    is_named: bool,
) -> Option<Fact<'db>> {
    let NameRef { name, id } = &variable.name;
    let is_handler = variable.kind == VariableKind::Handler;
    let is_removable = !is_named && variable.value != InitialValue::Calls;
    let kind = FactKind::UnusedVariable { is_handler, name: name.clone(), is_removable };
    (!name.is_empty()).then(|| Fact::new(Location::Source(of, *id), kind))
}
