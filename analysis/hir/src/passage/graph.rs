//! The flow graph of a core: what its programs do with data, in the order of execution, without the followed input.
//!
//! A node is a read, a write, a call, an assignment or a branch. All nodes of a job are after those before them; the last node of
//! a job names the state of the next one. A *slot* is a variable that may carry data, a *cell* one whose value decides branches:
//! a bool or a status. Called operations are part of the programs that call them.

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::behaviour::{Behaviour, Edge};
use crate::body::{BodyId, Code, CoreScope, code_of, core_scope};
use crate::builtin::Builtin;
use crate::features::features_of;
use crate::infer::{Inference, VariableOf, directions_of, inference_of, shared_variables};
use crate::item_tree::{
    BinaryOperator, CallStatus, Core, Direction, Expr, Kind, Literal, Name, NameRef, PortStatus, SourceId,
    Statement, UnaryOperator, is_logic, spine,
};
use crate::names::resolve_type;
use crate::program_id::ProgramId;
use crate::project::Project;
use crate::resolve::{Binding, Callee, VariableId};
use crate::source::{Decl, codel, core};
use crate::types::{Type, type_of};

use super::types::PassageEnd;

/// A set of slots.
pub(super) type Slots = u128;
/// A set of the values that a cell may have: `false` and `true`, or the statuses.
pub(super) type Values = u8;

/// The slots of shared variables; those from here on are parameters, local variables and results of calls.
pub(super) const SHARED_SLOTS: u32 = 96;
/// The cells of shared variables and ports.
const SHARED_CELLS: u8 = 28;
const CELLS: u8 = 42;
const MAX_NODES: usize = 100_000;
/// The most nodes, each for each sink.
const MAX_FLOWS: usize = 4_000_000;
const MAX_CALLS: usize = 64;
/// The most executions of operations in all programs: each may call the next one twice.
const MAX_OPERATIONS: usize = 10_000;

pub(super) const FALSE: Values = 1;
pub(super) const TRUE: Values = 2;
const BOOL: Values = FALSE | TRUE;
pub(super) const ANY: Values = 7;
/// The first of three statuses: `no_data`, or `failure`.
pub(super) const NO_DATA: Values = 1;
pub(super) const NEW_DATA: Values = 4;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub(super) enum Operand {
    Known(Values),
    Cell(u8),
}

/// Returns the bits of a cell among those of all cells: 3 each.
pub(super) fn bits(cell: u8) -> u128 {
    u128::from(ANY) << shift(cell)
}

pub(super) fn shift(cell: u8) -> u32 {
    u32::from(cell) * 3
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) enum Step {
    /// Does what its `from`, `to` and `value` say.
    #[default]
    Plain,
    /// Continues at the first successor if both may be equal, at the second one if they may differ.
    Branch(Operand, Operand),
    /// The end of a job. The next one begins in this state.
    End(usize),
    /// Reads a source, a port or the results of an operation. The cell gets the status.
    Read(Option<u8>),
}

/// What a core does at one point of a job.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct Node {
    pub(super) step: Step,
    /// If any of these carries data, each of `to` does afterwards; otherwise none of them does.
    pub(super) from: Slots,
    pub(super) to: Slots,
    /// What a cell becomes.
    pub(super) value: Option<(u8, Operand)>,
    /// It takes data from here: an index in [`Graph::sources`].
    pub(super) source: Option<u16>,
    /// It gives what `from` carries to here: an index in [`Graph::sinks`].
    pub(super) sink: Option<u16>,
    /// Of a branch on a condition at `at` of a job's programs: the successor where it holds.
    pub(super) holds: Option<u8>,
    pub(super) at: SourceId,
    /// The call in the program that does it: of an operation, or itself.
    pub(super) call: SourceId,
    /// Its program: an index in [`Graph::places`].
    pub(super) place: u32,
    pub(super) next: [Option<u32>; 2],
}

/// A program of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
pub(super) struct Place {
    /// The state in which the job begins.
    pub(super) state: usize,
    /// Its edge; none for the first programs, which the edges of the state share.
    pub(super) edge: Option<usize>,
    /// The state in which that edge ends.
    pub(super) target: Option<usize>,
    /// The number of programs before it.
    pub(super) before: usize,
    /// Its index in [`Behaviour::programs`], and of the operations behind these.
    pub(super) program: usize,
}

impl Place {
    /// Returns whether it is an operation that a client calls before the job.
    pub(super) fn is_called(&self, behaviour: &Behaviour<'_>) -> bool {
        self.program >= behaviour.programs.len() && self.program != usize::MAX
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct Graph<'db> {
    pub(super) nodes: Vec<Node>,
    /// The first node of a job, by state.
    pub(super) starts: Vec<u32>,
    pub(super) places: Vec<Place>,
    pub(super) sources: Vec<PassageEnd<'db>>,
    pub(super) sinks: Vec<PassageEnd<'db>>,
    /// For each codel that is a sink, whether it passes what it takes to a handle.
    pub(super) to_handle: Vec<bool>,
    /// The codel that a node calls.
    pub(super) calls: FxHashMap<u32, Decl<'db>>,
    /// The ports whose statuses are in cells.
    pub(super) statuses: FxHashMap<u8, Name>,
    /// The values that each shared cell may have.
    pub(super) domains: Vec<Values>,
    /// The bits of the cells whose values matter before each node.
    pub(super) live: Vec<u128>,
    /// The core has more variables or calls than are followed.
    pub(super) too_large: bool,
}

/// Where a variable is.
#[derive(Debug, Clone, Copy, Default)]
struct Storage {
    slot: Slots,
    cell: Option<u8>,
    /// The values that it may have.
    values: Values,
}

/// The value of an expression.
#[derive(Debug, Clone, Copy)]
struct Computed {
    from: Slots,
    operand: Operand,
}

/// Nodes, each with which of its successors is not known yet.
type Exits = Vec<(u32, usize)>;

/// A program under lowering.
struct Frame {
    result: Storage,
    returned: Exits,
}

pub(super) struct Builder<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    core: &'db Core,
    scope: &'db CoreScope,
    behaviour: &'a Behaviour<'db>,
    shared: &'db [VariableOf],
    through_handles: bool,
    /// The external types of handles.
    is_handle: Box<dyn Fn(&Type) -> bool + 'db>,
    graph: Graph<'db>,
    open: Exits,
    /// The group of bodies of the current program.
    group: u32,
    inference: &'db Inference<'db>,
    variables: FxHashMap<VariableId, Storage>,
    statuses: FxHashMap<Name, Option<u8>>,
    /// The index of the state of each name in the core's text.
    states: FxHashMap<&'db Name, usize>,
    sources: FxHashMap<PassageEnd<'db>, u16>,
    sinks: FxHashMap<PassageEnd<'db>, u16>,
    /// The number of used slots of shared variables, and the first free slot and cell above those.
    shared_slots: u32,
    slots: u32,
    cells: u8,
    frames: Vec<Frame>,
    /// The operations that were executed.
    operations: usize,
    /// The call of an operation that the current program executes.
    call: Option<SourceId>,
}

impl<'a, 'db> Builder<'a, 'db> {
    pub(super) fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        of: Decl<'db>,
        behaviour: &'a Behaviour<'db>,
        through_handles: bool,
    ) -> Option<Builder<'a, 'db>> {
        let core = core(db, of)?;
        let scope = core_scope(db, of).as_ref()?;
        let shell = resolve_type(db, project, of, Kind::Shell, core.shell.as_ref()).ok()?;
        let features = features_of(db, project, shell);
        // What a port has is data, even of an external type.
        let ports = features.by_name.values().flatten().filter(|it| it.kind.is_port());
        let of_ports: Vec<Type> = ports.map(|it| it.ty(db, project)).collect();
        let is_handle = move |ty: &Type| matches!(ty, Type::External(_)) && !of_ports.contains(ty);
        Some(Builder {
            db,
            project,
            of,
            core,
            scope,
            behaviour,
            shared: shared_variables(db, project, of),
            through_handles,
            is_handle: Box::new(is_handle),
            graph: Graph::default(),
            open: Vec::new(),
            group: 0,
            inference: inference_of(db, project, of, 0),
            variables: FxHashMap::default(),
            statuses: FxHashMap::default(),
            states: core.machines.first().map_or_else(FxHashMap::default, |it| it.state_indices()),
            sources: FxHashMap::default(),
            sinks: FxHashMap::default(),
            shared_slots: 0,
            slots: SHARED_SLOTS,
            cells: SHARED_CELLS,
            frames: Vec::new(),
            operations: 0,
            call: None,
        })
    }

    /// Returns the flow graph of all jobs.
    pub(super) fn build(mut self) -> Graph<'db> {
        let edges = self.behaviour.edges.clone();
        let operations = self.core.operations.len();
        self.graph.too_large = operations.saturating_mul(edges.first.len()) > MAX_OPERATIONS;
        for (state, first) in edges.first.iter().enumerate() {
            let start = self.graph.nodes.len() as u32;
            self.graph.starts.push(start);
            self.place(Place { state, edge: None, target: None, before: 0, program: usize::MAX });
            self.push(Step::Plain, SourceId::default());
            self.open = vec![(start, 0)];
            // Of a core that is too large, the ends are known all the same.
            for operation in
                (0..operations).filter(|_| state == 0 || !self.graph.too_large).collect::<Vec<_>>()
            {
                self.called(operation, state, start);
            }
            // The edges are in the order of the states.
            let begin = edges.all.partition_point(|edge| edge.source < state);
            let own = edges.all.iter().enumerate().skip(begin);
            let mut own = own.take_while(|(_, edge)| edge.source == state).peekable();
            for (before, &program) in first.iter().enumerate() {
                self.place(Place { state, edge: None, target: None, before, program });
                let guarded = match self.behaviour.programs.get(program).map(|it| &it.id) {
                    Some(ProgramId::Guard { transition, .. }) => Some(transition),
                    _ => None,
                };
                let (holds, fails) = self.program(program);
                let fires = own.next_if(|(_, edge)| guarded.is_some() && edge.transition.as_ref() == guarded);
                if let Some((index, edge)) = fires {
                    self.open = holds;
                    self.finish(index, edge);
                }
                self.open = fails;
            }
            if let Some((index, edge)) = own.next() {
                self.finish(index, edge);
            }
            self.open.clear();
        }
        self.graph.too_large |= self.graph.nodes.len() * self.graph.sinks.len() > MAX_FLOWS;
        if !self.graph.too_large {
            self.graph.find_live();
        }
        self.graph
    }

    /// Lets clients call an operation before a job, which begins at `start`, any number of times.
    fn called(&mut self, index: usize, state: usize, start: u32) {
        let Some(operation) = self.core.operations.get(index) else { return };
        let program = self.behaviour.programs.len() + index;
        self.place(Place { state, edge: None, target: None, before: 0, program });
        let any = Operand::Known(ANY);
        // The branch that is first in a search does not call it.
        let (not_called, called) = self.branch(any, Operand::Known(TRUE), operation.name.id);
        self.open = called;
        self.enter(BodyId::Operation(index as u32));
        for parameter in &operation.parameters {
            let Some((id, declared)) = self.local(parameter.name.id) else { continue };
            let storage = self.stack(&declared.ty.clone());
            self.set(storage, Computed { from: 0, operand: any }, parameter.name.id);
            self.variables.insert(id, storage);
        }
        self.body(&operation.program.statements, Storage::default());
        for (node, which) in std::mem::replace(&mut self.open, not_called) {
            let next = self.graph.nodes.get_mut(node as usize).and_then(|it| it.next.get_mut(which));
            next.into_iter().for_each(|next| *next = Some(start));
        }
    }

    fn place(&mut self, place: Place) {
        self.graph.places.push(place);
        (self.slots, self.cells) = (SHARED_SLOTS, SHARED_CELLS);
    }

    /// Executes the last programs of an edge.
    fn finish(&mut self, index: usize, edge: &Edge) {
        for (number, &program) in edge.then.iter().enumerate() {
            let before = edge.first + number;
            let (state, target) = (edge.source, Some(edge.target));
            self.place(Place { state, edge: Some(index), target, before, program });
            self.open = self.program(program).1;
        }
        // Also an edge without such programs has a place: its end leads to other values of counters.
        let (before, target) = (edge.first + edge.then.len(), Some(edge.target));
        self.place(Place { state: edge.source, edge: Some(index), target, before, program: usize::MAX });
        self.emit(Step::End(edge.target), SourceId::default());
        self.open.clear();
    }

    /// Executes a program. Returns where a guard holds, and where it does not, or where another program ends.
    fn program(&mut self, index: usize) -> (Exits, Exits) {
        let Some((body, code)) =
            self.behaviour.programs.get(index).and_then(|it| code_of(self.core, &self.states, &it.id))
        else {
            return (Vec::new(), std::mem::take(&mut self.open));
        };
        self.enter(body);
        match code {
            Code::Guard(guard) => self.condition(&guard.condition),
            Code::Program(program) => {
                self.body(&program.statements, Storage::default());
                (Vec::new(), std::mem::take(&mut self.open))
            }
        }
    }

    fn enter(&mut self, body: BodyId) {
        self.group = self.scope.group(body).unwrap_or_default();
        self.inference = inference_of(self.db, self.project, self.of, self.group);
    }

    fn body(&mut self, statements: &'db [Statement], result: Storage) {
        self.frames.push(Frame { result, returned: Vec::new() });
        self.block(statements);
        if let Some(frame) = self.frames.pop() {
            self.open.extend(frame.returned);
        }
    }

    fn push(&mut self, step: Step, at: SourceId) -> u32 {
        let place = self.graph.places.len().saturating_sub(1) as u32;
        let call = self.call.unwrap_or(at);
        self.graph.nodes.push(Node { step, at, call, place, ..Node::default() });
        self.graph.nodes.len() as u32 - 1
    }

    /// Adds a node after the open ones; none where the program does not come here.
    fn emit(&mut self, step: Step, at: SourceId) -> Option<&mut Node> {
        if self.graph.nodes.len() >= MAX_NODES {
            self.graph.too_large = true;
            self.open.clear();
        }
        if self.open.is_empty() {
            return None;
        }
        let id = self.push(step, at);
        for (node, which) in std::mem::replace(&mut self.open, vec![(id, 0)]) {
            if let Some(next) = self.graph.nodes.get_mut(node as usize).and_then(|it| it.next.get_mut(which))
            {
                *next = Some(id);
            }
        }
        self.graph.nodes.last_mut()
    }

    /// Returns where both operands are equal, and where they differ.
    fn branch(&mut self, left: Operand, right: Operand, at: SourceId) -> (Exits, Exits) {
        if self.emit(Step::Branch(left, right), at).is_none() {
            return (Vec::new(), Vec::new());
        }
        let exits = std::mem::take(&mut self.open);
        let other = exits.iter().map(|(node, _)| (*node, 1)).collect();
        (exits, other)
    }

    /// Does so for a condition, which holds at the successor `holds`. Its variables may differ where a client calls an operation.
    fn decision(&mut self, left: Operand, right: Operand, at: Option<SourceId>, holds: u8) -> (Exits, Exits) {
        let exits = self.branch(left, right, at.unwrap_or_default());
        let is_of_job = self.graph.places.last().is_some_and(|it| !it.is_called(self.behaviour));
        if let Some(node) = exits.0.first().and_then(|(node, _)| self.graph.nodes.get_mut(*node as usize)) {
            node.holds = at.filter(|_| is_of_job).map(|_| holds);
        }
        exits
    }

    fn set(&mut self, to: Storage, value: Computed, at: SourceId) {
        if to.slot != 0 || to.cell.is_some() {
            let operand = match value.operand {
                Operand::Known(values) => Operand::Known(values & to.values),
                Operand::Cell(_) => value.operand,
            };
            let cell = to.cell.map(|cell| (cell, operand));
            if let Some(node) = self.emit(Step::Plain, at) {
                (node.from, node.to, node.value) = (value.from, to.slot, cell);
            }
        }
    }

    fn block(&mut self, statements: &'db [Statement]) {
        let (slots, cells) = (self.slots, self.cells);
        for statement in statements {
            self.statement(statement);
        }
        (self.slots, self.cells) = (slots, cells);
    }

    fn statement(&mut self, statement: &'db Statement) {
        match statement {
            Statement::Variable(variable) => {
                let ty = self.local(variable.name.id).map_or(Type::Unknown, |(_, it)| it.ty.clone());
                let storage = self.stack(&ty);
                let (slots, cells) = (self.slots, self.cells);
                let nothing = Computed { from: 0, operand: Operand::Known(ANY) };
                let value = variable.value.as_ref().map_or(nothing, |value| self.value(value));
                self.set(storage, value, variable.name.id);
                (self.slots, self.cells) = (slots, cells);
                if let Some((id, _)) = self.local(variable.name.id) {
                    self.variables.insert(id, storage);
                }
            }
            Statement::If { condition, then, otherwise, .. } => {
                let (holds, fails) = self.condition(condition);
                self.open = holds;
                self.block(then);
                let after = std::mem::replace(&mut self.open, fails);
                self.block(otherwise.as_deref().unwrap_or_default());
                self.open.extend(after);
            }
            Statement::Block(inner) => self.block(inner),
            Statement::Assign(target, value) => {
                let (slots, cells) = (self.slots, self.cells);
                let value = self.value(value);
                let storage = self.variable(target.id);
                self.set(storage, value, target.id);
                (self.slots, self.cells) = (slots, cells);
            }
            Statement::Return(id, value) => {
                let result = self.frames.last().map(|it| it.result).unwrap_or_default();
                if let Some(value) = value {
                    let value = self.value(value);
                    self.set(result, value, *id);
                }
                let open = std::mem::take(&mut self.open);
                if let Some(frame) = self.frames.last_mut() {
                    frame.returned.extend(open);
                }
            }
            Statement::Expr(value) => {
                let (slots, cells) = (self.slots, self.cells);
                self.value(value);
                (self.slots, self.cells) = (slots, cells);
            }
        }
    }

    /// Returns the parameter or local variable that is declared at a source of the current program.
    fn local(&self, declared: SourceId) -> Option<(VariableId, &'db VariableOf)> {
        let index = self.inference.variables.partition_point(|it| it.name.id < declared);
        let found = self.inference.variables.get(index).filter(|it| it.name.id == declared)?;
        Some((VariableId { group: Some(self.group), index: index as u32 }, found))
    }

    /// Returns where the variable is that a name refers to.
    fn variable(&mut self, name: SourceId) -> Storage {
        let Some(Binding::Variable(id)) = self.inference.binding(name) else { return Storage::default() };
        if let Some(found) = self.variables.get(&id) {
            return *found;
        }
        let Some(variable) = id.group.is_none().then(|| self.shared.get(id.index as usize)).flatten() else {
            return Storage::default();
        };
        let mut storage = Storage::default();
        if self.carries(&variable.ty) {
            storage.slot = 1 << self.shared_slots.min(SHARED_SLOTS - 1);
            self.graph.too_large |= self.shared_slots >= SHARED_SLOTS;
            self.shared_slots += 1;
        }
        if let Some(values) = values_of(&variable.ty) {
            (storage.cell, storage.values) = (self.shared_cell(values), values);
        }
        self.variables.insert(id, storage);
        storage
    }

    fn carries(&self, ty: &Type) -> bool {
        !matches!(ty, Type::Handle(_) | Type::Void) && (self.through_handles || !(self.is_handle)(ty))
    }

    fn shared_cell(&mut self, values: Values) -> Option<u8> {
        let cell = self.graph.domains.len() as u8;
        if cell >= SHARED_CELLS {
            return None;
        }
        self.graph.domains.push(values);
        Some(cell)
    }

    /// Returns the place for a parameter, a local variable or a result, until the end of its block or statement.
    fn stack(&mut self, ty: &Type) -> Storage {
        let mut storage = Storage::default();
        if self.carries(ty) {
            storage.slot = 1_u128.checked_shl(self.slots).unwrap_or(1 << SHARED_SLOTS);
            self.graph.too_large |= self.slots >= Slots::BITS;
            self.slots += 1;
        }
        if let Some(values) = values_of(ty).filter(|_| self.cells < CELLS) {
            (storage.cell, storage.values) = (Some(self.cells), values);
            self.cells += 1;
        }
        storage
    }

    /// Returns the cell with the status of the last read of a port.
    fn status(&mut self, port: &Name) -> Option<u8> {
        if let Some(found) = self.statuses.get(port) {
            return *found;
        }
        let cell = self.shared_cell(ANY);
        self.graph.statuses.extend(cell.map(|cell| (cell, port.clone())));
        self.statuses.insert(port.clone(), cell);
        cell
    }

    /// Returns where a condition holds, and where it does not.
    fn condition(&mut self, expr: &'db Expr) -> (Exits, Exits) {
        let (slots, cells) = (self.slots, self.cells);
        let exits = match expr {
            Expr::Unary(UnaryOperator::Not, inner, _) => {
                let (holds, fails) = self.condition(inner);
                (fails, holds)
            }
            Expr::Binary(BinaryOperator::And | BinaryOperator::Or, ..) => {
                let (first, operands) = spine(expr, is_logic);
                let exits = self.condition(first);
                operands.into_iter().rev().fold(exits, |(holds, fails), (operator, right, _)| {
                    let is_and = operator == BinaryOperator::And;
                    let (open, mut decided) = if is_and { (holds, fails) } else { (fails, holds) };
                    self.open = open;
                    let (holds, fails) = self.condition(right);
                    decided.extend(if is_and { &fails } else { &holds });
                    if is_and { (holds, decided) } else { (decided, fails) }
                })
            }
            Expr::Binary(operator @ (BinaryOperator::Equal | BinaryOperator::NotEqual), left, right, id) => {
                let (left, right) = (self.value(left), self.value(right));
                let holds = u8::from(*operator == BinaryOperator::NotEqual);
                let (equal, differ) = self.decision(left.operand, right.operand, Some(*id), holds);
                if holds == 0 { (equal, differ) } else { (differ, equal) }
            }
            _ => {
                let value = self.value(expr);
                self.decision(value.operand, Operand::Known(TRUE), expr.id(), 0)
            }
        };
        (self.slots, self.cells) = (slots, cells);
        exits
    }

    fn value(&mut self, expr: &'db Expr) -> Computed {
        let unknown = |from| Computed { from, operand: Operand::Known(ANY) };
        match expr {
            Expr::Missing => unknown(0),
            Expr::Incomplete(inner) => unknown(self.value(inner).from),
            Expr::Literal(literal, _) => Computed { from: 0, operand: Operand::Known(value_of(literal)) },
            Expr::Name(name) => {
                let Storage { slot, cell, .. } = self.variable(name.id);
                Computed { from: slot, operand: cell.map_or(Operand::Known(ANY), Operand::Cell) }
            }
            Expr::Call { callee, arguments, id } => self.call(callee, arguments, *id),
            Expr::Unary(UnaryOperator::Minus, inner, _) => unknown(self.value(inner).from),
            Expr::Unary(UnaryOperator::Not, inner, id) => {
                let inner = self.value(inner);
                self.truth(inner.operand, Operand::Known(FALSE), inner.from, *id)
            }
            Expr::Binary(..) => {
                let (first, operands) = spine(expr, |_| true);
                let first = self.value(first);
                let operands = operands.into_iter().rev();
                operands.fold(first, |left, (operator, right, id)| self.operator(operator, left, right, id))
            }
        }
    }

    fn operator(
        &mut self,
        operator: BinaryOperator,
        left: Computed,
        right: &'db Expr,
        at: SourceId,
    ) -> Computed {
        if is_logic(operator) {
            return self.logic(operator, left, right, at);
        }
        let right = self.value(right);
        let from = left.from | right.from;
        match operator {
            BinaryOperator::Equal => self.truth(left.operand, right.operand, from, at),
            BinaryOperator::NotEqual => {
                let equal = self.truth(left.operand, right.operand, from, at);
                self.truth(equal.operand, Operand::Known(FALSE), from, at)
            }
            _ => Computed { from, operand: Operand::Known(ANY) },
        }
    }

    /// Returns whether two operands are equal.
    fn truth(&mut self, left: Operand, right: Operand, from: Slots, at: SourceId) -> Computed {
        let result = self.stack(&Type::Bool);
        let (equal, differ) = self.branch(left, right, at);
        self.open = equal;
        self.set(result, Computed { from, operand: Operand::Known(TRUE) }, at);
        let after = std::mem::replace(&mut self.open, differ);
        self.set(result, Computed { from, operand: Operand::Known(FALSE) }, at);
        self.open.extend(after);
        computed(result)
    }

    /// Evaluates the right operand unless the left one decides.
    fn logic(
        &mut self,
        operator: BinaryOperator,
        left: Computed,
        right: &'db Expr,
        at: SourceId,
    ) -> Computed {
        let result = self.stack(&Type::Bool);
        self.set(result, left, at);
        let operand = computed(result).operand;
        let (holds, fails) = self.branch(operand, Operand::Known(TRUE), at);
        let is_and = operator == BinaryOperator::And;
        let (open, decided) = if is_and { (holds, fails) } else { (fails, holds) };
        self.open = open;
        let right = self.value(right);
        self.set(result, Computed { from: right.from | result.slot, operand: right.operand }, at);
        self.open.extend(decided);
        computed(result)
    }

    fn call(&mut self, callee: &'db NameRef, arguments: &'db [Expr], at: SourceId) -> Computed {
        match self.inference.callee(callee.id) {
            Some(Callee::Codel(codel)) => self.codel(codel, arguments, at),
            Some(Callee::Operation(index)) => self.operation(index, arguments, at),
            Some(Callee::Builtin(builtin)) => self.builtin(builtin, arguments, at),
            None => Computed { from: 0, operand: Operand::Known(ANY) },
        }
    }

    fn codel(&mut self, of: Decl<'db>, arguments: &'db [Expr], at: SourceId) -> Computed {
        let directions = directions_of(self.db, self.scope, Callee::Codel(of), arguments.len());
        let data = codel(self.db, of);
        let (db, project) = (self.db, self.project);
        let ty = |ty: Option<&_>| type_of(db, project, of, ty);
        let result = data.map_or(Type::Unknown, |data| ty(data.result.as_ref()));
        let mut types = data.iter().flat_map(|data| &data.parameters).map(|it| ty(it.ty.as_ref()));
        let has_handle = (self.is_handle)(&result) || types.any(|ty| (self.is_handle)(&ty));
        let result = self.stack(&result);
        let (mut from, mut to) = (0, result.slot);
        let (mut changed, mut takes) = (Vec::new(), false);
        for (argument, direction) in arguments.iter().zip(directions) {
            match (direction, argument) {
                (Direction::In, _) => from |= self.value(argument).from,
                (_, Expr::Name(name)) => {
                    let storage = self.variable(name.id);
                    to |= storage.slot;
                    from |= if direction == Direction::InOut { storage.slot } else { 0 };
                    changed.push(storage);
                }
                _ => {}
            }
            takes |= direction != Direction::Out;
        }
        let source = (to != 0).then(|| self.source(PassageEnd::Codel(of)));
        let sink = takes.then(|| self.sink(PassageEnd::Codel(of), has_handle));
        let value = result.cell.map(|cell| (cell, Operand::Known(result.values)));
        if let Some(node) = self.emit(Step::Plain, at) {
            (node.from, node.to, node.value, node.source, node.sink) = (from, to, value, source, sink);
            let id = self.graph.nodes.len() as u32 - 1;
            self.graph.calls.insert(id, of);
        }
        self.forget(changed, at);
        computed(result)
    }

    /// Executes an operation of the core. Parameters that it changes are the variables of the caller.
    fn operation(&mut self, index: usize, arguments: &'db [Expr], at: SourceId) -> Computed {
        self.operations += 1;
        let fits =
            self.frames.len() < MAX_CALLS && self.operations <= MAX_OPERATIONS && !self.graph.too_large;
        let Some(operation) = self.core.operations.get(index).filter(|_| fits) else {
            self.graph.too_large = true;
            return Computed { from: 0, operand: Operand::Known(ANY) };
        };
        let (db, project, of) = (self.db, self.project, self.of);
        let ty = |ty: Option<&_>| type_of(db, project, of, ty);
        let result = self.stack(&ty(operation.result.as_ref()));
        let mut parameters = Vec::new();
        for (parameter, argument) in operation.parameters.iter().zip(arguments) {
            let storage = match (parameter.direction, argument) {
                (Direction::Out | Direction::InOut, Expr::Name(name)) => self.variable(name.id),
                _ => {
                    let storage = self.stack(&ty(parameter.ty.as_ref()));
                    let value = self.value(argument);
                    self.set(storage, value, at);
                    storage
                }
            };
            parameters.push((parameter.name.id, storage));
        }
        let (group, inference, call) = (self.group, self.inference, self.call);
        self.call = call.or(Some(at));
        self.enter(BodyId::Operation(index as u32));
        for (declared, storage) in parameters {
            if let Some((id, _)) = self.local(declared) {
                self.variables.insert(id, storage);
            }
        }
        self.body(&operation.program.statements, result);
        (self.group, self.inference, self.call) = (group, inference, call);
        computed(result)
    }

    fn builtin(&mut self, builtin: Builtin, arguments: &'db [Expr], at: SourceId) -> Computed {
        let nothing = Computed { from: 0, operand: Operand::Known(ANY) };
        let Some((Expr::Name(operand), rest)) = arguments.split_first() else { return nothing };
        match builtin {
            Builtin::Status => {
                let cell = self.status(&operand.name);
                Computed { from: 0, operand: cell.map_or(Operand::Known(ANY), Operand::Cell) }
            }
            Builtin::Read => {
                let end = PassageEnd::Port(operand.name.clone());
                let cell = self.status(&operand.name);
                self.read(end, cell, rest, at)
            }
            Builtin::Collect => {
                let handler = self.core.handlers.iter().find(|it| it.name.name == operand.name);
                let path = handler.and_then(|it| it.operation.as_ref()).and_then(|it| it.path.last());
                let Some(operation) = path else { return nothing };
                let status = self.stack(&Type::CallStatus);
                self.read(PassageEnd::Operation(operation.clone()), status.cell, rest, at)
            }
            Builtin::Write | Builtin::Send => {
                let from = rest.iter().fold(0, |from, value| from | self.value(value).from);
                let end = match builtin {
                    Builtin::Write => PassageEnd::Port(operand.name.clone()),
                    _ => PassageEnd::Operation(operand.name.clone()),
                };
                let sink = self.sink(end, false);
                if let Some(node) = self.emit(Step::Plain, at) {
                    (node.from, node.sink) = (from, Some(sink));
                }
                nothing
            }
        }
    }

    fn read(&mut self, end: PassageEnd<'db>, cell: Option<u8>, to: &[Expr], at: SourceId) -> Computed {
        let source = self.source(end);
        let names = to.iter().filter_map(|it| if let Expr::Name(name) = it { Some(name.id) } else { None });
        let changed: Vec<Storage> = names.map(|name| self.variable(name)).collect();
        let slots = changed.iter().fold(0, |slots, it| slots | it.slot);
        if let Some(node) = self.emit(Step::Read(cell), at) {
            (node.to, node.source) = (slots, Some(source));
        }
        self.forget(changed, at);
        Computed { from: 0, operand: cell.map_or(Operand::Known(ANY), Operand::Cell) }
    }

    /// Any value may be in these variables from here on.
    fn forget(&mut self, changed: Vec<Storage>, at: SourceId) {
        for storage in changed {
            let value = Computed { from: 0, operand: Operand::Known(ANY) };
            self.set(Storage { slot: 0, ..storage }, value, at);
        }
    }

    fn source(&mut self, end: PassageEnd<'db>) -> u16 {
        let next = self.graph.sources.len() as u16;
        *self.sources.entry(end).or_insert_with_key(|end| {
            self.graph.sources.push(end.clone());
            next
        })
    }

    fn sink(&mut self, end: PassageEnd<'db>, to_handle: bool) -> u16 {
        let next = self.graph.sinks.len() as u16;
        *self.sinks.entry(end).or_insert_with_key(|end| {
            self.graph.sinks.push(end.clone());
            self.graph.to_handle.push(to_handle);
            next
        })
    }
}

fn computed(storage: Storage) -> Computed {
    Computed { from: storage.slot, operand: storage.cell.map_or(Operand::Known(ANY), Operand::Cell) }
}

/// Returns the values of a type whose variables decide branches.
fn values_of(ty: &Type) -> Option<Values> {
    match ty {
        Type::Bool => Some(BOOL),
        Type::PortStatus | Type::CallStatus => Some(ANY),
        _ => None,
    }
}

fn value_of(literal: &Literal) -> Values {
    match literal {
        Literal::Bool(value) => FALSE << u8::from(*value),
        Literal::PortStatus(PortStatus::NoData) | Literal::CallStatus(CallStatus::Failure) => NO_DATA,
        Literal::PortStatus(PortStatus::OldData) | Literal::CallStatus(CallStatus::NotReady) => 2,
        Literal::PortStatus(PortStatus::NewData) | Literal::CallStatus(CallStatus::Success) => NEW_DATA,
        Literal::Int(_) | Literal::Float(_) | Literal::String(_) => ANY,
    }
}
