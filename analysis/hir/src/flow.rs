//! Data flow through a core: variables read before assignment, unused variables, lost writes, unreachable code, and states
//! without a path back to the initial state.
//!
//! The paths are those of the state machine (`behaviour.rs`): each period executes `run` and the guards, then either `exit`,
//! the effect of a transition and `entry`, or `handle`. A variable that a path may assign counts as assigned, because guards
//! may know which branch was taken; a port counts as written only if every path writes it.

use std::cell::LazyCell;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::{behaviour_of, successors};
use crate::body::statements;
use crate::builtin::Builtin;
use crate::fact::{Defined, Fact, FactKind, Unreachable, repeated};
use crate::features::core_of;
use crate::flat::flat_of;
use crate::graph::{reachable, topological_order};
use crate::infer::{CoreInference, UNKNOWN_DIRECTION, VariableKind, VariableOf, inference_of_core, returns};
use crate::item_tree::{
    BinaryOperator, Core, Direction, Expr, HookKind, Kind, Machine, MethodKind, Name, NameRef, Operation,
    Program, SourceId, State, Statement, Transition,
};
use crate::names::names_of;
use crate::project::Project;
use crate::resolve::Callee;
use crate::source::{Decl, Location, architecture, core};
use crate::types::Type;

/// Returns the facts about the data flow in a core. No query: only the facts of the declaration contain them.
pub(crate) fn flow_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Fact<'db>> {
    let Some(data) = core(db, of) else { return Vec::new() };
    let inference = &inference_of_core(db, project, of);
    let mut flow = Flow {
        db,
        of,
        core: data,
        inference,
        variables: inference.variables().map(|(_, variable)| variable).collect(),
        repeated: FxHashMap::default(),
        operations: Vec::new(),
        assigned_anywhere: Variables::default(),
        conditions: 0,
        outputs: FxHashSet::default(),
        read: FxHashSet::default(),
        unassigned_reads: FxHashMap::default(),
        found: Vec::new(),
    };
    flow.unreachable_code();
    // The missing statements of an incomplete program, an unresolved name, or an expression with an error may assign or read.
    let is_error =
        |fact: &Fact<'db>| fact.is_error() && !matches!(fact.kind, FactKind::DuplicateDefinition { .. });
    if data.total_completeness().is_complete() {
        if !inference.is_unresolved() && !inference.facts().any(is_error) {
            flow.repeated = flow.repeated_variables(project);
            flow.reads_before_assignment();
            flow.unused_variables();
        }
        flow.lost_writes(project);
        flow.no_path_back(project);
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

/// A bit set of indices of variables.
#[derive(Clone, PartialEq, Eq, Default)]
struct Variables(Vec<u64>);

impl Variables {
    fn insert(&mut self, index: usize) {
        if self.0.len() <= index / 64 {
            self.0.resize(index / 64 + 1, 0);
        }
        if let Some(word) = self.0.get_mut(index / 64) {
            *word |= 1 << (index % 64);
        }
    }

    fn remove(&mut self, index: usize) {
        if let Some(word) = self.0.get_mut(index / 64) {
            *word &= !(1 << (index % 64));
        }
    }

    fn contains(&self, index: usize) -> bool {
        self.0.get(index / 64).is_some_and(|word| word & (1 << (index % 64)) != 0)
    }

    fn add(&mut self, others: &Variables) {
        self.0.resize(self.0.len().max(others.0.len()), 0);
        self.0.iter_mut().zip(&others.0).for_each(|(word, other)| *word |= other);
    }

    fn intersect(&mut self, others: &Variables) {
        self.0.truncate(others.0.len());
        self.0.iter_mut().zip(&others.0).for_each(|(word, other)| *word &= other);
    }
}

type Ports<'a> = FxHashSet<&'a Name>;

struct Flow<'a, 'db> {
    db: &'db dyn ModelDb,
    of: Decl<'db>,
    core: &'db Core,
    inference: &'a CoreInference<'db>,
    /// By index.
    variables: Vec<&'db VariableOf>,
    /// For each variable that repeats a name of its scope, the previous variable of that name.
    repeated: FxHashMap<usize, usize>,
    /// The variables that each operation may assign.
    operations: Vec<Variables>,
    /// The variables that any program may assign.
    assigned_anywhere: Variables,
    /// The number of conditions around the current statement.
    conditions: usize,
    /// The variables that are output arguments of calls: a call needs them even if no program reads them.
    outputs: FxHashSet<usize>,
    /// The variables that any program reads.
    read: FxHashSet<usize>,
    /// For each variable that may be read before its assignment, the first such read.
    unassigned_reads: FxHashMap<usize, SourceId>,
    found: Vec<Fact<'db>>,
}

impl<'db> Flow<'_, 'db> {
    fn at(&self, id: SourceId) -> Location<'db> {
        Location::Source(self.of, id)
    }

    fn report(&mut self, id: SourceId, kind: FactKind<'db>) {
        self.found.push(Fact::new(self.at(id), kind));
    }

    fn hook(&self, kind: HookKind) -> Option<&'db Program> {
        self.core.hooks.iter().find(|hook| hook.kind == kind).map(|hook| &hook.program)
    }

    fn unreachable_code(&mut self) {
        for block in self.core.blocks() {
            let end = block.iter().position(|it| returns(std::slice::from_ref(it)));
            if let Some(id) = end.and_then(|end| block.get(end + 1)?.id()) {
                self.report(id, FactKind::UnreachableCode(Unreachable::BehindReturn));
            }
        }
    }

    /// Returns, for each variable that repeats a name of its scope, the previous variable of that name. Another fact reports
    /// the repetition, and does not say which of them a reference should use.
    fn repeated_variables(&self, project: Project<'db>) -> FxHashMap<usize, usize> {
        let parameters = self.core.operations.iter().flat_map(|operation| {
            repeated(self.of, operation.parameters.iter().map(|it| (&it.name, Defined::Parameter)))
        });
        let parameters: Vec<Fact<'db>> = parameters.collect();
        let behaviour = behaviour_of(self.db, project, self.of);
        let facts = behaviour.facts.iter().chain(self.inference.facts()).chain(&parameters);
        let pairs = facts.filter_map(|fact| match (&fact.at, &fact.kind) {
            (
                Location::Source(_, id),
                FactKind::DuplicateDefinition { first: Location::Source(_, first), .. },
            ) => Some((*first, *id)),
            _ => None,
        });
        let indices = LazyCell::new(|| self.indices());
        let (mut previous, mut last) = (FxHashMap::default(), FxHashMap::default());
        for (first, id) in pairs {
            // Not all of them are variables.
            let (Some(&first), Some(&index)) = (indices.get(&first), indices.get(&id)) else { continue };
            previous.insert(index, last.insert(first, index).unwrap_or(first));
        }
        previous
    }

    /// Returns the index of each variable, by the source of its name.
    fn indices(&self) -> FxHashMap<SourceId, usize> {
        let variables = self.variables.iter().enumerate();
        variables.map(|(index, variable)| (variable.name.id, index)).collect()
    }

    fn reads_before_assignment(&mut self) {
        self.operations();
        // Assigned at the start; and, later, by any program: core variables then count as assigned.
        let (mut assigned, mut later) = (Variables::default(), Variables::default());
        for (index, variable) in self.variables.iter().enumerate() {
            let is_of_core = matches!(variable.kind, VariableKind::Core | VariableKind::Machine);
            if variable.has_value && !is_of_core {
                assigned.insert(index);
            }
            if variable.has_value || is_of_core {
                later.insert(index);
            }
        }
        let mut anywhere = Variables::default();
        self.without_reads(|this| {
            for program in this.core.programs() {
                this.block(&program.statements, &mut anywhere);
            }
        });
        self.assigned_anywhere = anywhere;
        // An initial value may depend on the variables before it.
        let indices = self.indices();
        for variable in self.core.shared_variables() {
            if let Some(value) = &variable.value {
                self.expr(value, &mut assigned);
                indices.get(&variable.name.id).into_iter().for_each(|&it| assigned.insert(it));
            }
        }
        // Other components call an operation at any time; `stop` and `cleanup` run last.
        for operation in &self.core.operations {
            self.block(&operation.program.statements, &mut later.clone());
        }
        for kind in [HookKind::Stop, HookKind::Cleanup] {
            self.optional(self.hook(kind), &mut later.clone());
        }
        for kind in [HookKind::Configure, HookKind::Start] {
            self.optional(self.hook(kind), &mut assigned);
        }
        // Other components may have called the operations before the first period, and guards may know that.
        self.operations.iter().for_each(|operation| assigned.add(operation));
        self.optional(self.hook(HookKind::Update), &mut assigned.clone());
        if let [machine] = self.core.machines.as_slice() {
            self.machine(machine, &later, &assigned);
        }
        let mut reads: Vec<(usize, SourceId)> = self.unassigned_reads.drain().collect();
        reads.sort_by_key(|(_, id)| *id);
        for (index, id) in reads {
            let Some(variable) = self.variables.get(index) else { continue };
            let declared = self.at(variable.name.id);
            let name = variable.name.name.clone();
            self.report(id, FactKind::ReadBeforeAssignment { name, declared });
        }
    }

    /// Checks the programs of a state machine, each with the variables that are assigned before the `entry` of its state: a
    /// forward data flow analysis with intersection at states. `all`: all variables of the core and the machine. `start`: those
    /// assigned before the first period.
    fn machine(&mut self, machine: &'db Machine, all: &Variables, start: &Variables) {
        let states = machine.state_indices();
        // The variables that may be unassigned at all: the sets below are small if there are few. Bit `n` is for the nth.
        let open: Vec<usize> =
            (0..self.variables.len()).filter(|&it| all.contains(it) && !start.contains(it)).collect();
        let of_open = |assigned: &Variables| {
            let mut found = Variables::default();
            let assigned = open.iter().enumerate().filter(|(_, index)| assigned.contains(**index));
            assigned.for_each(|(bit, _)| found.insert(bit));
            found
        };
        // For each state, the target of each transition and the variables that may be assigned up to there.
        let mut transfers: Vec<Vec<(usize, Variables)>> = Vec::new();
        for state in &machine.states {
            let mut own = Variables::default();
            let guards = state.transitions.iter().filter_map(|transition| transition.guard.as_ref());
            self.without_reads(|this| {
                state.methods.iter().for_each(|method| this.block(&method.program.statements, &mut own));
                guards.for_each(|guard| this.expr(&guard.condition, &mut own));
            });
            let mut transfer = |transition: &Transition| {
                let target = *states.get(&transition.target.as_ref()?.name)?;
                let mut assigned = own.clone();
                self.without_reads(|this| this.optional(transition.effect.as_ref(), &mut assigned));
                Some((target, of_open(&assigned)))
            };
            transfers.push(state.transitions.iter().filter_map(&mut transfer).collect());
        }
        let mut before: Vec<Variables> = vec![of_open(all); machine.states.len()];
        let initial = machine.states.iter().position(|state| state.initial);
        if let Some(before) = initial.and_then(|initial| before.get_mut(initial)) {
            *before = Variables::default();
        }
        // A variable that may be unassigned in a state may be unassigned in its successors.
        let mut worklist: Vec<usize> = (0..machine.states.len()).collect();
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
        for (state, before) in machine.states.iter().zip(before) {
            let mut assigned = all.clone();
            let unassigned = open.iter().enumerate().filter(|(bit, _)| !before.contains(*bit));
            unassigned.for_each(|(_, index)| assigned.remove(*index));
            self.state(state, &mut assigned);
        }
    }

    /// Checks the programs of a state, in the order of their first possible execution.
    fn state(&mut self, state: &'db State, assigned: &mut Variables) {
        self.optional(state.method(MethodKind::Entry), assigned);
        self.optional(state.method(MethodKind::Run), assigned);
        for guard in state.transitions.iter().filter_map(|transition| transition.guard.as_ref()) {
            self.expr(&guard.condition, assigned);
        }
        self.optional(state.method(MethodKind::Handle), assigned);
        self.optional(state.method(MethodKind::Exit), assigned);
        for transition in &state.transitions {
            self.conditions += usize::from(transition.guard.is_some());
            self.optional(transition.effect.as_ref(), &mut assigned.clone());
            self.conditions -= usize::from(transition.guard.is_some());
        }
    }

    fn optional(&mut self, program: Option<&Program>, assigned: &mut Variables) {
        if let Some(program) = program {
            self.block(&program.statements, assigned);
        }
    }

    /// Runs `collect`, which collects assignments, and discards the reads that it records.
    fn without_reads(&mut self, collect: impl FnOnce(&mut Self)) {
        let saved = (std::mem::take(&mut self.read), std::mem::take(&mut self.unassigned_reads));
        collect(self);
        (self.read, self.unassigned_reads) = saved;
    }

    fn block(&mut self, statements: &[Statement], assigned: &mut Variables) {
        for statement in statements {
            match statement {
                Statement::If { condition, then, otherwise, .. } => {
                    self.expr(condition, assigned);
                    // Both branches start with the same variables; after them, the variables that either assigns count.
                    let mut other = assigned.clone();
                    self.conditions += 1;
                    self.block(then, assigned);
                    self.block(otherwise.as_deref().unwrap_or_default(), &mut other);
                    self.conditions -= 1;
                    assigned.add(&other);
                }
                Statement::Block(inner) => self.block(inner, assigned),
                Statement::Assign(target, value) => {
                    self.expr(value, assigned);
                    self.variable(target.id).into_iter().for_each(|index| assigned.insert(index));
                }
                Statement::Variable(_) | Statement::Return(..) | Statement::Expr(_) => {
                    statement.expression().into_iter().for_each(|value| self.expr(value, assigned));
                }
            }
        }
    }

    /// Returns the index of the variable that a name refers to.
    fn variable(&self, id: SourceId) -> Option<usize> {
        self.inference.variable_at(id).map(|id| self.inference.number(id))
    }

    fn expr(&mut self, expr: &Expr, assigned: &mut Variables) {
        match expr {
            Expr::Missing | Expr::Literal(..) => {}
            Expr::Name(name) => {
                let Some(index) = self.variable(name.id) else { return };
                self.read.extend(with_repeated(&self.repeated, index));
                let ty = self.variables.get(index).map(|variable| &variable.ty);
                // A condition may know of an assignment in an earlier period.
                let may_be_assigned = with_repeated(&self.repeated, index).any(|it| {
                    assigned.contains(it) || self.conditions > 0 && self.assigned_anywhere.contains(it)
                });
                // Whether an unknown type, such as a pointer, has an initial value is unknown.
                if !may_be_assigned && !matches!(ty, None | Some(Type::External(_) | Type::Unknown)) {
                    let first = self.unassigned_reads.entry(index).or_insert(name.id);
                    *first = (*first).min(name.id);
                }
            }
            Expr::Incomplete(inner) | Expr::Unary(_, inner, _) => self.expr(inner, assigned),
            Expr::Binary(operator, lhs, rhs, _) => {
                self.expr(lhs, assigned);
                let is_condition = matches!(operator, BinaryOperator::And | BinaryOperator::Or);
                self.conditions += usize::from(is_condition);
                self.expr(rhs, assigned);
                self.conditions -= usize::from(is_condition);
            }
            Expr::Call { callee, arguments, .. } => self.call(callee.id, arguments, assigned),
        }
    }

    fn call(&mut self, callee: SourceId, arguments: &[Expr], assigned: &mut Variables) {
        let callee = self.inference.callee(callee);
        let count = arguments.len();
        let directions = match callee {
            Some(callee) => self.inference.directions(self.db, self.core, callee, count),
            None => vec![UNKNOWN_DIRECTION; count],
        };
        let mut outputs = Vec::new();
        for (argument, direction) in arguments.iter().zip(directions) {
            match (direction, argument) {
                (Direction::In, argument) => self.expr(argument, assigned),
                (direction, Expr::Name(name)) => {
                    let variable = self.variable(name.id);
                    if direction == Direction::InOut {
                        self.read.extend(variable);
                    }
                    outputs.extend(variable);
                }
                (_, argument) => self.expr(argument, assigned),
            }
        }
        self.outputs.extend(outputs.iter().flat_map(|&index| with_repeated(&self.repeated, index)));
        outputs.into_iter().for_each(|index| assigned.insert(index));
        if let Some(Callee::Operation(index)) = callee
            && let Some(operation) = self.operations.get(index)
        {
            assigned.add(operation);
        }
    }

    /// Computes the variables that each operation may assign, directly or through its callees.
    fn operations(&mut self) {
        let own: Vec<(Vec<usize>, Variables)> =
            self.core.operations.iter().map(|operation| self.calls_and_assigns(operation)).collect();
        let (calls, mut assigns): (Vec<Vec<usize>>, Vec<Variables>) = own.into_iter().unzip();
        for index in topological_order(&calls).0 {
            let callees = calls.get(index).into_iter().flatten();
            let callees: Vec<Variables> =
                callees.filter_map(|callee| assigns.get(*callee).cloned()).collect();
            if let Some(own) = assigns.get_mut(index) {
                callees.iter().for_each(|callee| own.add(callee));
            }
        }
        self.operations = assigns;
    }

    fn calls_and_assigns(&self, operation: &Operation) -> (Vec<usize>, Variables) {
        let (mut called, mut assigned) = (Vec::new(), Variables::default());
        let mut assign = |id| self.variable(id).into_iter().for_each(|index| assigned.insert(index));
        for statement in statements(&operation.program.statements) {
            if let Statement::Assign(target, _) = statement {
                assign(target.id);
            }
            for expr in statement.expression().into_iter().flat_map(Expr::descendants) {
                let Expr::Call { callee, arguments, .. } = expr else { continue };
                // Each argument may be an output argument.
                for argument in arguments {
                    if let Expr::Name(name) = argument {
                        assign(name.id);
                    }
                }
                if let Some(Callee::Operation(index)) = self.inference.callee(callee.id) {
                    called.push(index);
                }
            }
        }
        (called, assigned)
    }

    fn unused_variables(&mut self) {
        let mut found = Vec::new();
        // Lazy, because most cores have no unused variables.
        let named = LazyCell::new(|| {
            let ids = self.inference.bindings().map(|(id, _)| id);
            ids.filter_map(|id| self.variable(id)).collect::<FxHashSet<usize>>()
        });
        let calls = LazyCell::new(|| {
            let all = self.core.all_variables();
            let with_value = all.filter(|it| it.value.as_ref().is_some_and(Expr::may_call));
            with_value.map(|variable| variable.name.id).collect::<FxHashSet<SourceId>>()
        });
        for (index, variable) in self.variables.iter().enumerate() {
            if matches!(variable.kind, VariableKind::Parameter(_)) {
                continue;
            }
            let is_used = self.read.contains(&index) || self.outputs.contains(&index);
            if !is_used && !variable.name.name.is_empty() {
                let NameRef { name, id } = &variable.name;
                let is_removable = !named.contains(&index) && !calls.contains(id);
                let (name, is_handler) = (name.clone(), variable.kind == VariableKind::Handler);
                let kind = FactKind::UnusedVariable { is_handler, name, is_removable };
                found.push(Fact::new(self.at(*id), kind));
            }
        }
        self.found.extend(found);
    }

    fn lost_writes(&mut self, project: Project<'db>) {
        let mut lost = Vec::new();
        let nothing = Ports::default();
        for operation in &self.core.operations {
            self.written(&operation.program, &nothing, &mut lost);
        }
        for hook in self.core.hooks.iter().filter(|hook| hook.kind == HookKind::Update) {
            self.written(&hook.program, &nothing, &mut lost);
        }
        if let [machine] = self.core.machines.as_slice() {
            self.lost_writes_in_machine(machine, &mut lost);
        }
        lost.sort();
        lost.dedup();
        // The connections matter only to a core with such writes.
        let buffered = (!lost.is_empty()).then(|| buffered_ports(self.db, project));
        for (id, port) in lost {
            if !buffered.is_some_and(|buffered| buffered.contains(&(self.of, port.clone()))) {
                self.report(id, FactKind::LostWrite { port: port.clone() });
            }
        }
    }

    fn lost_writes_in_machine(&self, machine: &'db Machine, lost: &mut Vec<(SourceId, &'db Name)>) {
        let nothing = Ports::default();
        let states = machine.state_indices();
        let all = |program: Option<&'db Program>| match program {
            Some(program) => self.written(program, &nothing, &mut Vec::new()),
            None => Ports::default(),
        };
        let entries: Vec<Ports<'db>> =
            machine.states.iter().map(|state| all(state.method(MethodKind::Entry))).collect();
        for state in &machine.states {
            let at_exit = all(state.method(MethodKind::Exit));
            // For each end of the period, the ports written after `run`, and those written after `exit`.
            let mut after_run: Vec<Ports<'db>> = Vec::new();
            let mut after_exit: Vec<Ports<'db>> = Vec::new();
            let mut may_stay = true;
            for transition in &state.transitions {
                let target = transition.target.as_ref().and_then(|target| states.get(&target.name));
                let entry = target.and_then(|&target| entries.get(target)).cloned().unwrap_or_default();
                let mut after = all(transition.effect.as_ref());
                after.extend(&entry);
                if let Some(effect) = &transition.effect {
                    self.written(effect, &entry, lost);
                }
                after_exit.push(after.clone());
                after.extend(&at_exit);
                after_run.push(after);
                if transition.guard.is_none() {
                    may_stay = false;
                    break;
                }
            }
            if may_stay {
                after_run.push(all(state.method(MethodKind::Handle)));
            }
            for (kind, paths) in [(MethodKind::Run, after_run), (MethodKind::Exit, after_exit)] {
                if let Some(program) = state.method(kind) {
                    self.written(program, &on_all_paths(paths), lost);
                }
            }
            for kind in [MethodKind::Entry, MethodKind::Handle] {
                if let Some(program) = state.method(kind) {
                    self.written(program, &nothing, lost);
                }
            }
        }
    }

    /// Returns the ports that every path from the start of `program` writes; the ports in `end` are written after it. Adds to
    /// `lost` the writes that every path overwrites.
    fn written(
        &self,
        program: &'db Program,
        end: &Ports<'db>,
        lost: &mut Vec<(SourceId, &'db Name)>,
    ) -> Ports<'db> {
        self.written_in(&program.statements, end, end.clone(), lost)
    }

    fn written_in(
        &self,
        statements: &'db [Statement],
        end: &Ports<'db>,
        mut after: Ports<'db>,
        lost: &mut Vec<(SourceId, &'db Name)>,
    ) -> Ports<'db> {
        for statement in statements.iter().rev() {
            match statement {
                Statement::Block(inner) => after = self.written_in(inner, end, after, lost),
                Statement::If { then, otherwise, .. } => {
                    let otherwise = otherwise.as_deref().unwrap_or_default();
                    let other = self.written_in(otherwise, end, after.clone(), lost);
                    after = self.written_in(then, end, after, lost);
                    after.retain(|port| other.contains(port));
                }
                Statement::Return(..) => after = end.clone(),
                Statement::Variable(_) | Statement::Assign(..) | Statement::Expr(_) => {
                    self.call_writes(statement.expression(), &mut after, lost);
                }
            }
        }
        after
    }

    /// Adds the ports that `value` writes if it is a call; nested calls are ignored, because they may not be executed.
    fn call_writes(
        &self,
        value: Option<&'db Expr>,
        after: &mut Ports<'db>,
        lost: &mut Vec<(SourceId, &'db Name)>,
    ) {
        let Some(Expr::Call { callee, arguments, .. }) = value else { return };
        match (self.inference.callee(callee.id), arguments.first()) {
            (Some(Callee::Builtin(Builtin::Write)), Some(Expr::Name(port))) if !after.insert(&port.name) => {
                lost.push((callee.id, &port.name));
            }
            // The callees of the operation are ignored: an operation may be recursive, which is an error.
            (Some(Callee::Operation(index)), _) => {
                if let Some(operation) = self.core.operations.get(index) {
                    after.extend(top_level_writes(&operation.program.statements, self.inference));
                }
            }
            _ => {}
        }
    }

    /// Reports the states from which no path leads back to the initial state.
    fn no_path_back(&mut self, project: Project<'db>) {
        let behaviour = behaviour_of(self.db, project, self.of);
        let [machine] = self.core.machines.as_slice() else { return };
        let Some(initial) = machine.states.iter().position(|state| state.initial) else { return };
        if !behaviour.refusals.is_empty() {
            return;
        }
        let mut predecessors = vec![Vec::new(); machine.states.len()];
        for (source, targets) in successors(machine).into_iter().enumerate() {
            targets.into_iter().for_each(|target| predecessors[target].push(source));
        }
        let back = reachable(&predecessors, initial);
        // Another fact reports the unreachable states.
        let entered: FxHashSet<&Name> = behaviour.states.iter().collect();
        let states: Vec<(Name, Location<'db>)> = machine
            .states
            .iter()
            .zip(back)
            .filter(|(state, back)| !back && entered.contains(&state.name.name))
            .map(|(state, _)| (state.name.name.clone(), self.at(state.name.id)))
            .collect();
        if !states.is_empty() {
            let initial = machine.states[initial].name.name.clone();
            self.report(machine.id, FactKind::NotStronglyConnected { initial, states });
        }
    }
}

/// Returns the variable `index` and, if it repeats a name of its scope, the variables of that name before it.
fn with_repeated(repeated: &FxHashMap<usize, usize>, index: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(index), |later| repeated.get(later).copied())
}

fn on_all_paths<'a>(mut paths: Vec<Ports<'a>>) -> Ports<'a> {
    let Some(mut all) = paths.pop() else { return Ports::default() };
    all.retain(|port| paths.iter().all(|path| path.contains(port)));
    all
}

/// Returns the ports that the outermost statements of a program write, up to the first `return`.
fn top_level_writes<'a>(statements: &'a [Statement], inference: &CoreInference<'_>) -> Ports<'a> {
    let mut ports = Ports::default();
    for statement in statements {
        match statement {
            Statement::Expr(Expr::Call { callee, arguments, .. }) => {
                if let (Some(Callee::Builtin(Builtin::Write)), Some(Expr::Name(port))) =
                    (inference.callee(callee.id), arguments.first())
                {
                    ports.insert(&port.name);
                }
            }
            // A branch may return.
            statement if has_return(statement) => break,
            _ => {}
        }
    }
    ports
}

fn has_return(statement: &Statement) -> bool {
    statements(std::slice::from_ref(statement)).any(|statement| matches!(statement, Statement::Return(..)))
}
