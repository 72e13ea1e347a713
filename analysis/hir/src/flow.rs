//! Data flow through a core: variables read before assignment, unused variables, lost writes, unreachable code, and states
//! without a path back to the initial state.
//!
//! The paths are those of the state machine (`behaviour.rs`): each period executes `run` and the guards, then either `exit`,
//! the effect of a transition and `entry`, or `handle`. A variable that a path may assign counts as assigned, because guards
//! may know which branch was taken; a port counts as written only if every path writes it.
//!
//! The data flow through each program is known from `programs.rs`; here, only what is between programs.

mod indices;
mod lost_writes;
mod operations;
mod program;
mod programs;

use std::cell::{LazyCell, OnceCell};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::behaviour_of;
use crate::body::{BodyId, ProgramIn, core_scope};
use crate::fact::{Fact, FactKind};
use crate::features::core_of;
use crate::flat::flat_of;
use crate::graph::{predecessors_by, reachable};
use crate::infer::{
    CoreInference, VariableKind, VariableOf, inference_of_core, shared_variables, total_completeness,
};
use crate::item_tree::{HookKind, Kind, MethodKind, Name, NameRef, SourceId};
use crate::names::names_of;
use crate::project::Project;
use crate::source::{Decl, Location, architecture};
use crate::structure::{StateStructure, Structure, TransitionStructure, structure_of, successors};

use self::indices::Indices;
use self::lost_writes::lost_writes;
use self::operations::effects_of;
use self::program::{OperationEffects, ProgramFlow};
use self::programs::{CoreFlow, groups_of, unused_variable};

/// Returns the facts about the data flow in a core.
#[salsa::tracked(returns(ref))]
pub(crate) fn flow_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Fact<'db>> {
    let (Some(core), Some(scope)) = (structure_of(db, of), core_scope(db, of)) else { return Vec::new() };
    let effects = effects_of(db, project, of, scope);
    let groups = groups_of(db, project, of, &effects);
    let mut flow = Flow {
        db,
        project,
        of,
        core,
        effects: &effects,
        programs: CoreFlow::new(core, scope, &groups),
        variables: shared_variables(db, project, of),
        assigned_anywhere: OnceCell::new(),
        found: Vec::new(),
    };
    flow.found.extend(groups.iter().flat_map(|group| &group.unreachable).cloned());
    // The missing statements of an incomplete program, an unresolved name, or an expression with an error may assign or read.
    let is_error =
        |fact: &Fact<'db>| fact.is_error() && !matches!(fact.kind, FactKind::DuplicateDefinition { .. });
    if total_completeness(db, project, of).is_complete() {
        let inference = inference_of_core(db, project, of);
        if !inference.is_unresolved() && !inference.facts().any(is_error) {
            flow.found.extend(groups.iter().flat_map(|group| &group.local).cloned());
            flow.reads_before_assignment();
            flow.unused_variables(&inference);
        }
        flow.lost_writes();
        flow.no_path_back();
    }
    flow.found
}

/// Returns the output ports that are the source of a connection with a buffer, by the core that writes them.
#[salsa::tracked(returns(ref))]
fn buffered_ports<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> FxHashSet<(Decl<'db>, Name)> {
    let mut buffered = FxHashSet::default();
    for of in names_of(db, project).of_kind(db, Kind::Architecture) {
        let Some(data) = architecture(db, of) else { continue };
        for connection in data.connections.iter().filter(|connection| connection.buffer.is_some()) {
            let Some(source) = &connection.source else { continue };
            let instance = flat_of(db, project, of).instance(&source.instance.name);
            let core = instance.and_then(|it| it.component).and_then(|it| core_of(db, project, it));
            buffered.extend(core.zip(source.feature.as_ref().map(|feature| feature.name.clone())));
        }
    }
    buffered
}

struct Flow<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    core: &'db Structure,
    /// Those of each operation.
    effects: &'a [OperationEffects],
    programs: CoreFlow<'a, 'db>,
    /// The shared variables. An index is the number of a variable.
    variables: &'db [VariableOf],
    /// The variables that any program may assign; a condition may know of it.
    assigned_anywhere: OnceCell<Indices>,
    found: Vec<Fact<'db>>,
}

/// The first read of each variable that may be read before its assignment.
type Unassigned = FxHashMap<usize, SourceId>;

impl<'a, 'db> Flow<'a, 'db> {
    fn at(&self, id: SourceId) -> Location<'db> {
        Location::Source(self.of, id)
    }

    fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.found.push(Fact::new(self.at(id), kind));
    }

    fn hook(&self, kind: HookKind) -> Option<&'a ProgramFlow> {
        self.programs.get(self.core.hook(kind)?, ProgramIn::Whole)
    }

    /// Returns whether another variable of its scope has its name. Another fact reports them, and does not say which of them a name
    /// should mean.
    fn is_repeated(&self, index: usize, variable: &VariableOf) -> bool {
        let is_of_machine = variable.kind == VariableKind::Machine;
        let is_in_scope = |it: &VariableOf| (it.kind == VariableKind::Machine) == is_of_machine;
        let repeats = |it: &VariableOf| is_in_scope(it) && it.name.name == variable.name.name;
        self.variables.iter().enumerate().any(|(other, it)| other != index && repeats(it))
    }

    /// Reports shared variables that are read before their assignment. Operations, `stop` and `cleanup` are not checked:
    /// they may be executed late, and then other programs may have assigned every shared variable.
    fn reads_before_assignment(&mut self) {
        let mut unassigned = Unassigned::default();
        let start = self.assigned_at_start(&mut unassigned);
        self.execute(self.hook(HookKind::Update), &mut start.clone(), &mut unassigned);
        self.machine(&start, &mut unassigned);
        let mut unassigned: Vec<(usize, SourceId)> = unassigned.into_iter().collect();
        unassigned.sort_by_key(|(_, id)| *id);
        for (number, id) in unassigned {
            let variable = self.variables.get(number).filter(|it| !self.is_repeated(number, it));
            let Some(NameRef { name, id: declared }) = variable.map(|it| &it.name) else { continue };
            let kind = FactKind::ReadBeforeAssignment { name: name.clone(), declared: self.at(*declared) };
            self.report(id, kind);
        }
    }

    /// Adds the variables that a program reads before their assignment, and those that it assigns.
    fn execute(&self, program: Option<&ProgramFlow>, assigned: &mut Indices, unassigned: &mut Unassigned) {
        let Some(program) = program else { return };
        for read in &program.reads {
            let may_be_known = read.is_conditional && self.assigned_anywhere().contains(read.variable);
            if !assigned.contains(read.variable) && !may_be_known {
                let first = unassigned.entry(read.variable).or_insert(read.id);
                *first = (*first).min(read.id);
            }
        }
        assigned.add(&program.assigns);
    }

    fn assigned_anywhere(&self) -> &Indices {
        self.assigned_anywhere.get_or_init(|| {
            let mut anywhere = Indices::default();
            let programs = self.programs.all().filter(|(program, _)| !matches!(program, ProgramIn::Guard(_)));
            programs.for_each(|(_, program)| anywhere.add(&program.assigns));
            anywhere
        })
    }

    /// Returns the variables that are assigned before the first period.
    fn assigned_at_start(&self, unassigned: &mut Unassigned) -> Indices {
        let mut assigned = Indices::default();
        let handlers = self.variables.iter().enumerate().filter(|(_, it)| it.kind == VariableKind::Handler);
        handlers.for_each(|(index, _)| assigned.insert(index));
        for body in [BodyId::CoreValues, BodyId::MachineValues] {
            self.execute(self.programs.get(body, ProgramIn::Whole), &mut assigned, unassigned);
        }
        for kind in [HookKind::Configure, HookKind::Start] {
            self.execute(self.hook(kind), &mut assigned, unassigned);
        }
        // Other components may have called the operations before the first period, and guards may know that.
        self.effects.iter().for_each(|operation| assigned.add(&operation.assigns));
        assigned
    }

    /// Checks the programs of a state machine, each with the variables that are assigned before the `entry` of its state: a
    /// forward data flow analysis with intersection at states. `start`: the variables assigned before the first period.
    fn machine(&self, start: &Indices, unassigned: &mut Unassigned) {
        // The variables that may be unassigned at all: the sets below are small if there are few. Bit `n` is for the nth.
        let numbers = 0..self.variables.len();
        let open: Vec<usize> = numbers.filter(|&number| !start.contains(number)).collect();
        if open.is_empty() {
            return;
        }
        let of_open = |assigned: &Indices| {
            let mut found = Indices::default();
            let assigned = open.iter().enumerate().filter(|(_, number)| assigned.contains(**number));
            assigned.for_each(|(bit, _)| found.insert(bit));
            found
        };
        let states = self.programs.states();
        let transfers: Vec<Vec<(usize, Indices)>> =
            states.iter().enumerate().map(|(index, state)| self.transfers(index, state, of_open)).collect();
        let mut before: Vec<Indices> = vec![Indices::before(open.len()); states.len()];
        let initial = states.iter().position(|state| state.initial);
        if let Some(before) = initial.and_then(|initial| before.get_mut(initial)) {
            *before = Indices::default();
        }
        // A variable that may be unassigned in a state may be unassigned in its successors.
        let mut worklist: Vec<usize> = (0..states.len()).collect();
        while let Some(source) = worklist.pop() {
            for (target, assigned) in transfers.get(source).into_iter().flatten() {
                let (Some(mut from), Some(to)) = (before.get(source).cloned(), before.get_mut(*target))
                else {
                    continue;
                };
                let old = to.clone();
                from.add(assigned);
                to.intersect(&from);
                if *to != old {
                    worklist.push(*target);
                }
            }
        }
        let all = Indices::before(self.variables.len());
        for (index, (state, before)) in states.iter().zip(before).enumerate() {
            let mut assigned = all.clone();
            let open = open.iter().enumerate().filter(|(bit, _)| !before.contains(*bit));
            open.for_each(|(_, number)| assigned.remove(*number));
            self.state(index, state, &mut assigned, unassigned);
        }
    }

    /// Returns the target of each transition of a state, with the variables that may be assigned up to there.
    fn transfers(
        &self,
        index: usize,
        state: &StateStructure,
        of_open: impl Fn(&Indices) -> Indices,
    ) -> Vec<(usize, Indices)> {
        let get = |program| self.programs.of_state(index, program);
        let mut own = Indices::default();
        for program in state.methods_and_guards() {
            get(program).into_iter().for_each(|program| own.add(&program.assigns));
        }
        let transfer = |(number, transition): (usize, &TransitionStructure)| {
            let target = self.programs.target(transition)?;
            let mut assigned = own.clone();
            get(ProgramIn::Effect(number as u32))
                .into_iter()
                .for_each(|effect| assigned.add(&effect.assigns));
            Some((target, of_open(&assigned)))
        };
        state.transitions.iter().enumerate().filter_map(transfer).collect()
    }

    /// Checks the programs of a state, in the order of their first possible execution.
    fn state(
        &self,
        index: usize,
        state: &StateStructure,
        assigned: &mut Indices,
        unassigned: &mut Unassigned,
    ) {
        let get = |program| self.programs.of_state(index, program);
        let method = |kind| self.programs.method(index, kind);
        let transitions = 0..state.transitions.len() as u32;
        self.execute(method(MethodKind::Entry), assigned, unassigned);
        self.execute(method(MethodKind::Run), assigned, unassigned);
        for number in transitions.clone() {
            self.execute(get(ProgramIn::Guard(number)), assigned, unassigned);
        }
        self.execute(method(MethodKind::Handle), assigned, unassigned);
        self.execute(method(MethodKind::Exit), assigned, unassigned);
        for number in transitions {
            self.execute(get(ProgramIn::Effect(number)), &mut assigned.clone(), unassigned);
        }
    }

    fn unused_variables(&mut self, inference: &CoreInference<'db>) {
        let mut used = Indices::default();
        self.programs.groups().for_each(|group| used.add(&group.used));
        // Lazy, because most cores have no unused variables.
        let named = LazyCell::new(|| {
            let all = inference.bindings().filter_map(|(_, binding)| binding.shared_variable());
            all.collect::<FxHashSet<usize>>()
        });
        let mut found = Vec::new();
        for (index, variable) in self.variables.iter().enumerate() {
            if !used.contains(index) && !self.is_repeated(index, variable) {
                found.extend(unused_variable(self.of, variable, named.contains(&index)));
            }
        }
        self.found.extend(found);
    }

    fn lost_writes(&mut self) {
        let lost = lost_writes(self.core, &self.programs);
        // The connections matter only to a core with such writes.
        let buffered = (!lost.is_empty()).then(|| buffered_ports(self.db, self.project));
        for (id, port) in lost {
            if !buffered.is_some_and(|buffered| buffered.contains(&(self.of, port.clone()))) {
                self.report(*id, FactKind::LostWrite { port: port.clone() });
            }
        }
    }

    /// Reports the states from which no path leads back to the initial state.
    fn no_path_back(&mut self) {
        let behaviour = behaviour_of(self.db, self.project, self.of);
        let [machine] = self.core.machines.as_slice() else { return };
        let all = self.programs.states();
        let Some(initial) = all.iter().position(|state| state.initial) else { return };
        if !behaviour.refusals.is_empty() {
            return;
        }
        let back = reachable(&predecessors_by(&successors(all, self.programs.indices())), [initial]);
        // Another fact reports the unreachable states.
        let entered = LazyCell::new(|| behaviour.states.iter().collect::<FxHashSet<&Name>>());
        let states: Vec<(Name, Location<'db>)> = all
            .iter()
            .zip(back)
            .filter(|(state, back)| !back && entered.contains(&state.name.name))
            .map(|(state, _)| (state.name.name.clone(), self.at(state.name.id)))
            .collect();
        if !states.is_empty() {
            let initial = all[initial].name.name.clone();
            self.report(machine.id, FactKind::NotStronglyConnected { initial, states });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Fact, FactKind};
    use crate::item_tree::Kind;
    use crate::{Database, Workspace, declaration_facts, declarations, projects};

    /// Returns the facts about reads and writes in a core whose state machine has 70 states, one after the other. `programs`:
    /// the content of some states.
    fn facts(programs: &[(usize, &str)]) -> Vec<String> {
        let mut text = "shell S { output port p: int }\ncore C(S) { var v: int; statemachine {\n".to_owned();
        for state in 0..70 {
            let initial = if state == 0 { "initial " } else { "" };
            let own = programs.iter().find(|(of, _)| *of == state).map_or("", |(_, program)| program);
            let next = (state + 1) % 70;
            text += &format!("{initial}state A{state} {{ {own} transition t to A{next} {{ }} }}\n");
        }
        text += "} }\n";
        let db = Database::default();
        let workspace = Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
        let file = workspace.file(&db, "/a.mal".as_ref()).unwrap();
        let project = projects(&db, workspace)[0];
        let core = declarations(&db, file).all.iter().find(|decl| decl.kind(&db) == Kind::Core).unwrap();
        let show = |fact: &Fact<'_>| match &fact.kind {
            FactKind::ReadBeforeAssignment { name, .. } => Some(format!("reads {name}")),
            FactKind::LostWrite { port } => Some(format!("loses {port}")),
            FactKind::UnusedVariable { name, .. } => Some(format!("does not use {name}")),
            _ => None,
        };
        declaration_facts(&db, project, *core).iter().filter_map(show).collect()
    }

    #[test]
    fn an_assignment_in_an_earlier_group_of_states_counts() {
        let reads = (60, "run = { write(p, v); }");
        assert_eq!(facts(&[reads]), ["reads v"]);
        assert!(facts(&[(3, "entry = { v = 1; }"), reads]).is_empty());
        assert_eq!(facts(&[reads, (65, "entry = { v = 1; }")]), ["reads v"]);
        assert_eq!(facts(&[]), ["does not use v"]);
    }

    #[test]
    fn an_entry_in_the_next_group_overwrites_an_exit() {
        for state in 25..35 {
            let exit = (state, "exit = { write(p, 1); }");
            assert_eq!(
                facts(&[exit, (state + 1, "entry = { write(p, 2); }")]),
                ["does not use v", "loses p"]
            );
        }
    }
}
