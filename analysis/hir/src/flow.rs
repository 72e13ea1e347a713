//! How values flow through a core: what is read before anything is assigned to it, what is overwritten before it is read,
//! what is never executed, and from where a machine never gets back.
//!
//! The paths are those of the machine (`behaviour.rs`): each period runs `run`, the guards, then `exit`, the program and the
//! `entry` of a transition, or `handle`. What a path may assign counts as assigned, since guards tell which branch was
//! taken; what it must write counts as written.

use std::cell::LazyCell;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ModelDb;
use crate::behaviour::{behaviour_of, leads_to};
use crate::body::statements;
use crate::builtin::Builtin;
use crate::fact::{Fact, FactKind, Unreachable};
use crate::features::core_of;
use crate::flat::flat_of;
use crate::graph::{reachable, topological_order};
use crate::infer::{CoreInference, VariableKind, VariableOf, inference_of_core, returns};
use crate::item_tree::{
    BinaryOperator, Core, Direction, Expr, HookKind, Kind, Machine, MethodKind, Name, NameRef, Operation,
    Program, SourceId, State, Statement, Transition,
};
use crate::names::names_of;
use crate::project::Project;
use crate::resolve::{Callee, VariableId};
use crate::source::{Decl, Location, architecture, core};
use crate::types::Type;

/// What is wrong with the flow of values in a core.
#[salsa::tracked(returns(ref))]
pub(crate) fn flow_facts<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Fact<'db>> {
    let Some(data) = core(db, of) else { return Vec::new() };
    let inference = &inference_of_core(db, project, of);
    let mut flow = Flow {
        db,
        of,
        core: data,
        inference,
        variables: inference.variables().collect(),
        operations: Vec::new(),
        ever: Variables::default(),
        conditions: 0,
        given: FxHashSet::default(),
        read: FxHashSet::default(),
        late: FxHashMap::default(),
        found: Vec::new(),
    };
    flow.unreachable();
    // The missing part of an incomplete program may assign or read, and so may an unresolved name.
    if data.total_completeness().is_complete() {
        if !inference.is_unresolved() {
            flow.assignments();
            flow.unused();
        }
        flow.lost_writes(buffered_ports(db, project));
        flow.no_way_back(project);
    }
    flow.found
}

/// The output ports, by the core that writes them, from which a connection with a buffer leads.
#[salsa::tracked(returns(ref))]
fn buffered_ports<'db>(db: &'db dyn ModelDb, project: Project<'db>) -> FxHashSet<(Decl<'db>, Name)> {
    let mut buffered = FxHashSet::default();
    for &of in names_of(db, project).all.iter().filter(|decl| decl.kind(db) == Kind::Architecture) {
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

/// Indices of variables, a bit each.
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

    fn contains(&self, index: usize) -> bool {
        self.0.get(index / 64).is_some_and(|word| word & (1 << (index % 64)) != 0)
    }

    fn add(&mut self, others: &Variables) {
        self.0.resize(self.0.len().max(others.0.len()), 0);
        self.0.iter_mut().zip(&others.0).for_each(|(word, other)| *word |= other);
    }

    /// Drops what is not among `others`.
    fn keep(&mut self, others: &Variables) {
        self.0.truncate(others.0.len());
        self.0.iter_mut().zip(&others.0).for_each(|(word, other)| *word &= other);
    }
}

/// Names of output ports.
type Ports<'a> = FxHashSet<&'a Name>;

struct Flow<'a, 'db> {
    db: &'db dyn ModelDb,
    of: Decl<'db>,
    core: &'db Core,
    inference: &'a CoreInference<'db>,
    /// By number.
    variables: Vec<(VariableId, &'db VariableOf)>,
    /// What each operation may assign.
    operations: Vec<Variables>,
    /// What any program may assign.
    ever: Variables,
    /// How many conditions decide whether the statement that is looked at is executed.
    conditions: usize,
    /// The variables that take the results of calls: a call needs one even if no program reads it.
    given: FxHashSet<usize>,
    /// What any program reads.
    read: FxHashSet<usize>,
    /// Where a variable is first read before it is assigned.
    late: FxHashMap<usize, SourceId>,
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

    // What is never executed

    fn unreachable(&mut self) {
        for block in self.core.blocks() {
            let end = block.iter().position(|it| returns(std::slice::from_ref(it)));
            if let Some(id) = end.and_then(|end| block.get(end + 1)?.id()) {
                self.report(id, FactKind::UnreachableCode(Unreachable::BehindReturn));
            }
        }
    }

    // What is read before it is assigned

    fn assignments(&mut self) {
        self.operations();
        let (mut assigned, mut later) = (Variables::default(), Variables::default());
        for (index, (_, variable)) in self.variables.iter().enumerate() {
            let is_of_core = matches!(variable.kind, VariableKind::Core | VariableKind::Machine);
            if variable.has_value && !is_of_core {
                assigned.insert(index);
            }
            if variable.has_value || is_of_core {
                later.insert(index);
            }
        }
        let mut ever = Variables::default();
        self.quietly(|this| {
            this.core.programs().into_iter().for_each(|program| this.block(&program.statements, &mut ever));
        });
        self.ever = ever;
        // Each may rest on those before it.
        let variables = self.variables.iter().enumerate();
        let index: FxHashMap<SourceId, usize> =
            variables.map(|(index, (_, it))| (it.name.id, index)).collect();
        let machines = self.core.machines.iter().flat_map(|machine| &machine.variables);
        for variable in self.core.variables.iter().chain(machines) {
            if let Some(value) = &variable.value {
                self.expr(value, &mut assigned);
                index.get(&variable.name.id).into_iter().for_each(|&it| assigned.insert(it));
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
        // They may have been called before the first period: guards know.
        self.operations.iter().for_each(|operation| assigned.add(operation));
        self.optional(self.hook(HookKind::Update), &mut assigned.clone());
        if let [machine] = self.core.machines.as_slice() {
            self.machine(machine, &later, &assigned);
        }
        let mut late: Vec<(usize, SourceId)> = self.late.drain().collect();
        late.sort_by_key(|(_, id)| *id);
        for (index, id) in late {
            let Some((_, variable)) = self.variables.get(index) else { continue };
            let declared = self.at(variable.name.id);
            let name = variable.name.name.clone();
            self.report(id, FactKind::ReadBeforeAssignment { name, declared });
        }
    }

    /// What is surely assigned before the `entry` of each state, then all of its programs.
    fn machine(&mut self, machine: &'db Machine, all: &Variables, start: &Variables) {
        let states: FxHashMap<&Name, usize> =
            machine.states.iter().enumerate().rev().map(|(index, state)| (&state.name.name, index)).collect();
        // For each state, where its transitions lead and what may be assigned on the way.
        let mut ways: Vec<Vec<(usize, Variables)>> = Vec::new();
        for state in &machine.states {
            let mut own = Variables::default();
            let guards = state.transitions.iter().filter_map(|transition| transition.guard.as_ref());
            self.quietly(|this| {
                state.methods.iter().for_each(|method| this.block(&method.program.statements, &mut own));
                guards.for_each(|guard| this.expr(&guard.condition, &mut own));
            });
            let mut way = |transition: &Transition| {
                let target = *states.get(&transition.target.as_ref()?.name)?;
                let mut assigned = own.clone();
                self.quietly(|this| this.optional(transition.effect.as_ref(), &mut assigned));
                Some((target, assigned))
            };
            ways.push(state.transitions.iter().filter_map(&mut way).collect());
        }
        let mut before: Vec<Variables> = vec![all.clone(); machine.states.len()];
        let initial = machine.states.iter().position(|state| state.initial);
        if let Some(before) = initial.and_then(|initial| before.get_mut(initial)) {
            before.keep(start);
        }
        // A variable that may be unassigned in a state may be unassigned in its successors.
        let mut open: Vec<usize> = (0..machine.states.len()).collect();
        while let Some(source) = open.pop() {
            for (target, assigned) in ways.get(source).into_iter().flatten() {
                let (Some(mut from), Some(to)) = (before.get(source).cloned(), before.get_mut(*target))
                else {
                    continue;
                };
                let old = to.clone();
                from.add(assigned);
                to.keep(&from);
                if *to != old {
                    open.push(*target);
                }
            }
        }
        for (state, mut assigned) in machine.states.iter().zip(before) {
            self.state(state, &mut assigned);
        }
    }

    /// The programs of a state, in the order in which they may first be executed.
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

    /// Looks at what is assigned without noting what is read.
    fn quietly(&mut self, look: impl FnOnce(&mut Self)) {
        let (read, late) = (std::mem::take(&mut self.read), std::mem::take(&mut self.late));
        look(self);
        (self.read, self.late) = (read, late);
    }

    fn block(&mut self, statements: &[Statement], assigned: &mut Variables) {
        for statement in statements {
            match statement {
                Statement::Variable(variable) => {
                    if let Some(value) = &variable.value {
                        self.expr(value, assigned);
                    }
                }
                Statement::If { condition, then, otherwise, .. } => {
                    self.expr(condition, assigned);
                    // What either branch may assign counts behind them; each begins with what was before.
                    let mut other = assigned.clone();
                    self.conditions += 1;
                    self.block(then, assigned);
                    self.block(otherwise.as_deref().unwrap_or_default(), &mut other);
                    self.conditions -= 1;
                    assigned.add(&other);
                }
                Statement::Block(inner) => self.block(inner, assigned),
                Statement::Return(_, value) => value.iter().for_each(|value| self.expr(value, assigned)),
                Statement::Assign(target, value) => {
                    self.expr(value, assigned);
                    self.variable(target.id).into_iter().for_each(|index| assigned.insert(index));
                }
                Statement::Expr(value) => self.expr(value, assigned),
            }
        }
    }

    /// Returns the variable that a name refers to.
    fn variable(&self, id: SourceId) -> Option<usize> {
        self.inference.variable_at(id).map(|id| self.inference.number(id))
    }

    fn expr(&mut self, expr: &Expr, assigned: &mut Variables) {
        match expr {
            Expr::Missing | Expr::Literal(..) => {}
            Expr::Name(name) => {
                let Some(index) = self.variable(name.id) else { return };
                self.read.insert(index);
                let ty = self.variables.get(index).map(|(_, variable)| &variable.ty);
                // The initial value of an unknown type is unknown: a handle, a pointer.
                // A condition may know of an earlier period.
                let may_be = assigned.contains(index) || self.conditions > 0 && self.ever.contains(index);
                if !may_be && !matches!(ty, None | Some(Type::External(_) | Type::Unknown)) {
                    self.late
                        .entry(index)
                        .and_modify(|first| *first = (*first).min(name.id))
                        .or_insert(name.id);
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
            // What it does with its arguments is unknown.
            None => vec![Direction::InOut; count],
        };
        let mut back = Vec::new();
        for (argument, direction) in arguments.iter().zip(directions) {
            match (direction, argument) {
                (Direction::In, argument) => self.expr(argument, assigned),
                (direction, Expr::Name(name)) => {
                    let variable = self.variable(name.id);
                    if direction == Direction::InOut {
                        self.read.extend(variable);
                    }
                    back.extend(variable);
                }
                (_, argument) => self.expr(argument, assigned),
            }
        }
        self.given.extend(&back);
        back.into_iter().for_each(|index| assigned.insert(index));
        if let Some(Callee::Operation(index)) = callee
            && let Some(operation) = self.operations.get(index)
        {
            assigned.add(operation);
        }
    }

    /// What each operation may assign, itself or by what it calls: callees first.
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
                // An argument may be one that something comes back to.
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

    /// What no program reads.
    fn unused(&mut self) {
        let mut found = Vec::new();
        // Few variables are unused.
        let named = LazyCell::new(|| {
            let ids = self.inference.bindings().map(|(id, _)| id);
            ids.filter_map(|id| self.variable(id)).collect::<FxHashSet<usize>>()
        });
        let calls = LazyCell::new(|| {
            let all = self.core.all_variables();
            let with_value = all.filter(|it| it.value.as_ref().is_some_and(Expr::may_call));
            with_value.map(|variable| variable.name.id).collect::<FxHashSet<SourceId>>()
        });
        for (index, (_, variable)) in self.variables.iter().enumerate() {
            if matches!(variable.kind, VariableKind::Parameter(_)) {
                continue;
            }
            let is_used = self.read.contains(&index) || self.given.contains(&index);
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

    // What is written and lost

    fn lost_writes(&mut self, buffered: &FxHashSet<(Decl<'db>, Name)>) {
        let mut lost = Vec::new();
        let nothing = Ports::default();
        for operation in &self.core.operations {
            self.written(&operation.program, &nothing, &mut lost);
        }
        for hook in self.core.hooks.iter().filter(|hook| hook.kind == HookKind::Update) {
            self.written(&hook.program, &nothing, &mut lost);
        }
        if let [machine] = self.core.machines.as_slice() {
            self.lost_in(machine, &mut lost);
        }
        lost.sort();
        lost.dedup();
        for (id, port) in lost {
            if !buffered.contains(&(self.of, port.clone())) {
                self.report(id, FactKind::LostWrite { port: port.clone() });
            }
        }
    }

    fn lost_in(&self, machine: &'db Machine, lost: &mut Vec<(SourceId, &'db Name)>) {
        let nothing = Ports::default();
        let states: FxHashMap<&Name, &'db State> =
            machine.states.iter().rev().map(|state| (&state.name.name, &**state)).collect();
        let all = |program: Option<&'db Program>| match program {
            Some(program) => self.written(program, &nothing, &mut Vec::new()),
            None => Ports::default(),
        };
        let entries: FxHashMap<&Name, Ports<'db>> =
            states.iter().map(|(name, state)| (*name, all(state.method(MethodKind::Entry)))).collect();
        for state in &machine.states {
            let at_exit = all(state.method(MethodKind::Exit));
            // What each way to end the period writes, behind `run`; and behind `exit`.
            let mut ways: Vec<Ports<'db>> = Vec::new();
            let mut exits: Vec<Ports<'db>> = Vec::new();
            let mut stays = true;
            for transition in &state.transitions {
                let target = transition.target.as_ref().and_then(|target| entries.get(&target.name));
                let entry = target.cloned().unwrap_or_default();
                let mut behind = all(transition.effect.as_ref());
                behind.extend(&entry);
                if let Some(effect) = &transition.effect {
                    self.written(effect, &entry, lost);
                }
                exits.push(behind.clone());
                behind.extend(&at_exit);
                ways.push(behind);
                if transition.guard.is_none() {
                    stays = false;
                    break;
                }
            }
            if stays {
                ways.push(all(state.method(MethodKind::Handle)));
            }
            for (kind, ways) in [(MethodKind::Run, ways), (MethodKind::Exit, exits)] {
                if let Some(program) = state.method(kind) {
                    self.written(program, &of_all(ways), lost);
                }
            }
            for kind in [MethodKind::Entry, MethodKind::Handle] {
                if let Some(program) = state.method(kind) {
                    self.written(program, &nothing, lost);
                }
            }
        }
    }

    /// The ports that every path from the beginning of `program` writes, where those in `end` are written behind it; with
    /// the writes that another one follows on every path.
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
        mut behind: Ports<'db>,
        lost: &mut Vec<(SourceId, &'db Name)>,
    ) -> Ports<'db> {
        for statement in statements.iter().rev() {
            match statement {
                Statement::Block(inner) => behind = self.written_in(inner, end, behind, lost),
                Statement::If { then, otherwise, .. } => {
                    let otherwise = otherwise.as_deref().unwrap_or_default();
                    let other = self.written_in(otherwise, end, behind.clone(), lost);
                    behind = self.written_in(then, end, behind, lost);
                    behind.retain(|port| other.contains(port));
                }
                Statement::Return(..) => behind = end.clone(),
                Statement::Variable(variable) => self.call_writes(variable.value.as_ref(), &mut behind, lost),
                Statement::Assign(_, value) | Statement::Expr(value) => {
                    self.call_writes(Some(value), &mut behind, lost);
                }
            }
        }
        behind
    }

    /// What a call writes that stands for itself: one in a condition may not happen.
    fn call_writes(
        &self,
        value: Option<&'db Expr>,
        behind: &mut Ports<'db>,
        lost: &mut Vec<(SourceId, &'db Name)>,
    ) {
        let Some(Expr::Call { callee, arguments, .. }) = value else { return };
        match (self.inference.callee(callee.id), arguments.first()) {
            (Some(Callee::Builtin(Builtin::Write)), Some(Expr::Name(port))) if !behind.insert(&port.name) => {
                lost.push((callee.id, &port.name));
            }
            // An operation that calls itself is an error: its own writes are not followed further.
            (Some(Callee::Operation(index)), _) => {
                if let Some(operation) = self.core.operations.get(index) {
                    behind.extend(top_level_writes(&operation.program.statements, self.inference));
                }
            }
            _ => {}
        }
    }

    // From where there is no way back

    fn no_way_back(&mut self, project: Project<'db>) {
        let behaviour = behaviour_of(self.db, project, self.of);
        let [machine] = self.core.machines.as_slice() else { return };
        let Some(initial) = machine.states.iter().position(|state| state.initial) else { return };
        if !behaviour.refusals.is_empty() {
            return;
        }
        let mut sources = vec![Vec::new(); machine.states.len()];
        for (source, targets) in leads_to(machine).into_iter().enumerate() {
            targets.into_iter().for_each(|target| sources[target].push(source));
        }
        let back = reachable(&sources, initial);
        // Those that are never entered are reported as that.
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

/// What is in all of these.
fn of_all<'a>(mut ways: Vec<Ports<'a>>) -> Ports<'a> {
    let Some(mut all) = ways.pop() else { return Ports::default() };
    all.retain(|port| ways.iter().all(|way| way.contains(port)));
    all
}

/// The ports that a program writes in its first row of statements, up to a `return`.
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
            // A branch may leave the program.
            statement if has_return(statement) => break,
            _ => {}
        }
    }
    ports
}

fn has_return(statement: &Statement) -> bool {
    statements(std::slice::from_ref(statement)).any(|statement| matches!(statement, Statement::Return(..)))
}
