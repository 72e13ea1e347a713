//! The flow graph of a core: what its programs do with data, in the order of execution, without the followed input.
//!
//! A node is a read, a write, a call, an assignment or a branch. All nodes of a job are after those before them; the last node of
//! a job names the state of the next one. A *slot* is a variable that may carry data, a *cell* one whose value decides branches:
//! a bool or a status. Called operations are part of the programs that call them.
//!
//! Each program is that of the program graph, once for each edge that executes it.
//!
//! Where decisions count, the data of a condition goes to a slot of the condition, and from there to each write and call that it
//! controls: those that the program executes in one of its branches only. That of a guard which holds goes to the slot of the state, and from there
//! to what the jobs write until the next transition. What a controlled call returns does not carry the decision.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

use crate::ModelDb;
use crate::behaviour::Behaviour;
use crate::body::{BodyId, CoreScope, ProgramIn, core_scope};
use crate::builtin::Builtin;
use crate::features::features_of;
use crate::infer::{VariableOf, inference_of, shared_variables};
use crate::item_tree::{BinaryOperator, Direction, Kind, Name, Parameter, SourceId, TypeRef, UnaryOperator};
use crate::names::resolve_type;
use crate::program_graph::{Action, Call, ProgramGraph, Term, graph_of};
use crate::project::Project;
use crate::resolve::{Callee, VariableId};
use crate::source::{Decl, codel};
use crate::types::{Type, type_of};

use super::types::PassageEnd;

/// A set of slots.
pub(super) type Slots = u128;
/// A set of the values that a cell may have: `false` and `true`, or the statuses.
pub(super) type CellValues = u8;

/// The slots of shared variables; those from here on are parameters, local variables and results of calls.
pub(super) const SHARED_SLOTS: u32 = 96;
/// The slot of what decided the last transition, if decisions count.
const STATE: Slots = 1;
/// The cells of shared variables and ports.
const SHARED_CELLS: u8 = 28;
const CELLS: u8 = 42;
const MAX_NODES: usize = 100_000;
/// The most nodes, each for each sink.
const MAX_FLOWS: usize = 4_000_000;
const MAX_CALLS: usize = 64;
/// The most executions of operations in all programs: each may call the next one twice.
const MAX_OPERATIONS: usize = 10_000;

pub(super) const FALSE: CellValues = 1;
pub(super) const TRUE: CellValues = 2;
const BOOL: CellValues = FALSE | TRUE;
pub(super) const ANY: CellValues = 7;
/// The first of three statuses: `no_data`, or `failure`.
pub(super) const NO_DATA: CellValues = 1;
pub(super) const NEW_DATA: CellValues = 4;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub(super) enum NodeOperand {
    Known(CellValues),
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
pub(super) enum NodeStep {
    /// Does what its `from`, `to` and `value` say.
    #[default]
    Plain,
    /// Continues at the first successor if both may be equal, at the second one if they may differ.
    Branch(NodeOperand, NodeOperand),
    /// The end of a job. The next one begins in this state.
    End(usize),
    /// Reads a source, a port or the results of an operation. The cell gets the status.
    Read(Option<u8>),
}

/// What a core does at one point of a job.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct JobNode {
    pub(super) step: NodeStep,
    /// If any of these carries data, each of `to` does afterwards; otherwise none of them does.
    pub(super) from: Slots,
    pub(super) to: Slots,
    /// What a cell becomes.
    pub(super) value: Option<(u8, NodeOperand)>,
    /// It takes data from here: an index in [`JobGraph::sources`].
    pub(super) source: Option<u16>,
    /// It gives what `from` carries to here: an index in [`JobGraph::sinks`].
    pub(super) sink: Option<u16>,
    /// Of a branch on a condition at `at` of a job's programs: the successor where it holds.
    pub(super) holds: Option<u8>,
    pub(super) at: SourceId,
    /// The call in the program that does it: of an operation, or itself.
    pub(super) call: SourceId,
    /// Its program: an index in [`JobGraph::places`].
    pub(super) place: u32,
    pub(super) next: [Option<u32>; 2],
}

/// A program of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, salsa::SalsaValue)]
pub(super) struct JobPlace {
    /// The state in which the job begins.
    pub(super) state: usize,
    /// Its edge; none for the first programs, which the edges of the state share.
    pub(super) edge: Option<usize>,
    /// The state in which that edge ends.
    pub(super) target: Option<usize>,
    /// The number of programs before it.
    pub(super) before: usize,
    /// Its index in [`Behaviour::programs`], and of the operations behind these; none at the beginning and at the end of a job.
    pub(super) program: Option<usize>,
}

impl JobPlace {
    /// Returns whether it is an operation that a client calls before the job.
    pub(super) fn is_called(&self, behaviour: &Behaviour<'_>) -> bool {
        self.program.is_some_and(|program| program >= behaviour.programs.len())
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub(super) struct JobGraph<'db> {
    pub(super) nodes: Vec<JobNode>,
    /// The first node of a job, by state.
    pub(super) starts: Vec<u32>,
    pub(super) places: Vec<JobPlace>,
    pub(super) sources: Vec<PassageEnd<'db>>,
    pub(super) sinks: Vec<PassageEnd<'db>>,
    /// For each codel that is a sink, whether it passes what it takes to a handle.
    pub(super) to_handle: Vec<bool>,
    /// The codel that a node calls.
    pub(super) calls: FxHashMap<u32, Decl<'db>>,
    /// The ports whose statuses are in cells.
    pub(super) statuses: FxHashMap<u8, Name>,
    /// The values that each shared cell may have.
    pub(super) domains: Vec<CellValues>,
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
    values: CellValues,
}

/// The value of an expression.
#[derive(Debug, Clone, Copy)]
struct Computed {
    from: Slots,
    operand: NodeOperand,
}

/// Nodes, each with which of its successors is not known yet.
type Exits = Vec<(u32, usize)>;

/// The program whose nodes are added: its graph, and the places of its registers.
struct ProgramFrame<'db> {
    graph: &'db ProgramGraph<'db>,
    registers: Vec<Storage>,
    /// The first free slot and cell above them.
    top: (u32, u8),
}

/// Where a program ends: where a guard holds, and elsewhere.
#[derive(Default)]
struct Ends {
    holds: Exits,
    others: Exits,
}

pub(super) struct Builder<'a, 'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    scope: &'db CoreScope,
    behaviour: &'a Behaviour<'db>,
    shared: &'db [VariableOf],
    through_handles: bool,
    decides: bool,
    /// The external types of handles.
    is_handle: Box<dyn Fn(&Type) -> bool + 'db>,
    graph: JobGraph<'db>,
    open: Exits,
    /// The places of shared variables.
    variables: FxHashMap<VariableId, Storage>,
    statuses: FxHashMap<Name, Option<u8>>,
    sources: FxHashMap<PassageEnd<'db>, u16>,
    sinks: FxHashMap<PassageEnd<'db>, u16>,
    /// The number of used slots of shared variables, and the first free slot and cell above those.
    shared_slots: u32,
    slots: u32,
    cells: u8,
    /// The number of operations that the current program is in, and of those that were executed.
    depth: usize,
    operations: usize,
    /// The call of an operation that the current program executes.
    call: Option<SourceId>,
    /// The slots of what decides that the current node is executed, and that of the condition before a branch; those of the conditions
    /// of a guard, behind it.
    control: Slots,
    deciding: Slots,
}

impl<'a, 'db> Builder<'a, 'db> {
    pub(super) fn new(
        db: &'db dyn ModelDb,
        project: Project<'db>,
        of: Decl<'db>,
        behaviour: &'a Behaviour<'db>,
        through_handles: bool,
        decides: bool,
    ) -> Option<Builder<'a, 'db>> {
        let scope = core_scope(db, of).as_ref()?;
        let shell = resolve_type(db, project, of, Kind::Shell, scope.shell.as_ref()).ok()?;
        let features = features_of(db, project, shell);
        // What a port has is data, even of an external type.
        let ports = features.by_name.values().flatten().filter(|it| it.kind.is_port());
        let of_ports: Vec<Type> = ports.map(|it| it.ty(db, project)).collect();
        let is_handle = move |ty: &Type| matches!(ty, Type::External(_)) && !of_ports.contains(ty);
        Some(Builder {
            db,
            project,
            of,
            scope,
            behaviour,
            shared: shared_variables(db, project, of),
            through_handles,
            decides,
            is_handle: Box::new(is_handle),
            graph: JobGraph::default(),
            open: Vec::new(),
            variables: FxHashMap::default(),
            statuses: FxHashMap::default(),
            sources: FxHashMap::default(),
            sinks: FxHashMap::default(),
            shared_slots: u32::from(decides),
            control: if decides { STATE } else { 0 },
            deciding: 0,
            slots: SHARED_SLOTS,
            cells: SHARED_CELLS,
            depth: 0,
            operations: 0,
            call: None,
        })
    }

    /// Returns the flow graph of all jobs.
    pub(super) fn build(mut self) -> JobGraph<'db> {
        let edges = self.behaviour.edges.clone();
        let operations = self.scope.operations.len();
        self.graph.too_large = operations.saturating_mul(edges.first.len()) > MAX_OPERATIONS;
        for (state, (first, fired)) in edges.first.iter().zip(self.behaviour.fired()).enumerate() {
            let start = self.graph.nodes.len() as u32;
            self.graph.starts.push(start);
            self.place(JobPlace { state, edge: None, target: None, before: 0, program: None });
            self.push(NodeStep::Plain, SourceId::default());
            self.open = vec![(start, 0)];
            // Of a core that is too large, the ends are known all the same.
            for operation in
                (0..operations).filter(|_| state == 0 || !self.graph.too_large).collect::<Vec<_>>()
            {
                self.called(operation, state, start);
            }
            for (before, (&program, edge)) in first.iter().zip(fired.by_guards).enumerate() {
                self.place(JobPlace { state, edge: None, target: None, before, program: Some(program) });
                let Ends { holds, others } = self.program(program);
                if let Some(edge) = edge {
                    self.open = holds;
                    let by = std::mem::take(&mut self.deciding);
                    self.decide(by, STATE);
                    self.finish(edge);
                }
                self.open = others;
            }
            fired.otherwise.into_iter().for_each(|edge| self.finish(edge));
            self.open.clear();
        }
        self.graph.too_large |= self.graph.nodes.len() * self.graph.sinks.len() > MAX_FLOWS;
        if !self.graph.too_large {
            self.graph.find_live();
        }
        self.graph.nodes.shrink_to_fit();
        self.graph.places.shrink_to_fit();
        self.graph
    }

    /// Lets clients call an operation before a job, which begins at `start`, any number of times.
    fn called(&mut self, index: usize, state: usize, start: u32) {
        let Some(operation) = self.scope.operations.get(index) else { return };
        let program = self.behaviour.programs.len() + index;
        self.place(JobPlace { state, edge: None, target: None, before: 0, program: Some(program) });
        let any = Computed { from: 0, operand: NodeOperand::Known(ANY) };
        // The branch that is first in a search does not call it.
        let (not_called, called) = self.branch(any.operand, NodeOperand::Known(TRUE), operation.name.id);
        self.open = called;
        let mut bound = Vec::new();
        for parameter in &operation.parameters {
            let ty = type_of(self.db, self.project, self.of, parameter.ty.as_ref());
            let storage = self.stack(&ty);
            self.set(storage, any, parameter.name.id);
            bound.push(storage);
        }
        for (node, which) in self.operation(index, &bound, Storage::default()) {
            let next = self.graph.nodes.get_mut(node as usize).and_then(|it| it.next.get_mut(which));
            next.into_iter().for_each(|next| *next = Some(start));
        }
        self.open = not_called;
    }

    fn place(&mut self, place: JobPlace) {
        self.graph.places.push(place);
        (self.slots, self.cells) = (SHARED_SLOTS, SHARED_CELLS);
    }

    /// Executes the last programs of an edge.
    fn finish(&mut self, index: usize) {
        let Some(edge) = self.behaviour.edges.all.get(index) else { return };
        for (number, &program) in edge.then.iter().enumerate() {
            let before = edge.first + number;
            let (state, target) = (edge.source, Some(edge.target));
            self.place(JobPlace { state, edge: Some(index), target, before, program: Some(program) });
            self.open = self.program(program).others;
        }
        // Also an edge without such programs has a place: its end leads to other values of counters.
        let (before, target) = (edge.first + edge.then.len(), Some(edge.target));
        self.place(JobPlace { state: edge.source, edge: Some(index), target, before, program: None });
        self.emit(NodeStep::End(edge.target), SourceId::default());
        self.open.clear();
    }

    /// Executes a program of a job.
    fn program(&mut self, index: usize) -> Ends {
        let place = self.behaviour.programs.get(index).map(|it| it.place);
        let graph = place.and_then(|(body, program)| graph_of(self.db, self.project, self.of, body, program));
        match graph.zip(place) {
            Some((graph, (body, program))) => {
                let Ends { holds, mut others } =
                    self.execute(graph, body, FxHashMap::default(), Storage::default());
                if matches!(program, ProgramIn::Guard(_)) {
                    return Ends { holds, others };
                }
                others.extend(holds);
                Ends { others, ..Ends::default() }
            }
            None => Ends { others: std::mem::take(&mut self.open), ..Ends::default() },
        }
    }

    /// Executes an operation whose parameters are in these places. Returns where it ends.
    fn operation(&mut self, index: usize, parameters: &[Storage], result: Storage) -> Exits {
        let body = BodyId::Operation(index as u32);
        let graph = graph_of(self.db, self.project, self.of, body, ProgramIn::Whole);
        let Some((graph, operation)) = graph.zip(self.scope.operations.get(index)) else {
            return std::mem::take(&mut self.open);
        };
        let group = self.scope.group(body).unwrap_or_default();
        let inference = inference_of(self.db, self.project, self.of, group);
        let bound = operation.parameters.iter().zip(parameters);
        let local = |it: &Parameter| inference.local(group, it.name.id);
        let bound = bound.map(|(parameter, storage)| (local(parameter), *storage)).collect();
        let Ends { mut holds, others } = self.execute(graph, body, bound, result);
        holds.extend(others);
        holds
    }

    /// Executes a program. Variables that are `bound` have these places.
    fn execute(
        &mut self,
        graph: &'db ProgramGraph<'db>,
        body: BodyId,
        bound: FxHashMap<VariableId, Storage>,
        result: Storage,
    ) -> Ends {
        let (slots, cells) = (self.slots, self.cells);
        let registers = self.registers(graph, body, &bound);
        let conditions = if self.decides { controlled(graph) } else { Vec::new() };
        let conditions: Vec<(u32, Slots, Vec<bool>)> = conditions
            .into_iter()
            .map(|(node, controls)| (node, self.stack(&Type::Unknown).slot, controls))
            .collect();
        let control = self.control;
        let frame = ProgramFrame { graph, registers, top: (self.slots, self.cells) };
        let mut arriving: Vec<Exits> = vec![Vec::new(); graph.nodes.len()];
        if let Some(start) = arriving.get_mut(graph.start as usize) {
            *start = std::mem::take(&mut self.open);
        }
        let (mut ends, mut of_guard) = (Ends::default(), 0);
        for (index, node) in graph.nodes.iter().enumerate() {
            self.open = arriving.get_mut(index).map(std::mem::take).unwrap_or_default();
            if self.open.is_empty() {
                continue;
            }
            if index == graph.start as usize {
                self.decide(0, conditions.iter().fold(0, |all, (_, slot, _)| all | slot));
            }
            let controls = conditions.iter().filter(|(_, _, controls)| controls.get(index) == Some(&true));
            self.control = controls.fold(control, |all, (_, slot, _)| all | slot);
            self.deciding = 0;
            let mut fails = Vec::new();
            match &node.action {
                Action::Nothing => {}
                Action::Branch { condition, .. } => {
                    let own = conditions.iter().find(|(node, ..)| *node as usize == index);
                    if let Some((_, slot, _)) = own {
                        let read = crate::program_graph::registers(&graph.terms, *condition).into_iter();
                        let from = read.fold(0, |from, (register, _)| from | frame.place(register).slot);
                        self.decide(from, *slot);
                        self.deciding = *slot;
                    }
                    (self.open, fails) = self.condition(&frame, *condition, node.at);
                }
                Action::Assign { to, value } => {
                    let nothing = Computed { from: 0, operand: NodeOperand::Known(ANY) };
                    let value = value.map_or(nothing, |value| self.value(&frame, value, node.at));
                    self.set(frame.place(*to), value, node.at);
                }
                Action::Call(call) => self.call_of(&frame, call, node.at),
                Action::Return(value) => {
                    let holds = value.is_some_and(|value| graph.term(value) == Term::Bool(true));
                    if let Some(value) = value {
                        let value = self.value(&frame, *value, node.at);
                        self.set(result, value, node.at);
                    }
                    let open = std::mem::take(&mut self.open);
                    if holds { &mut ends.holds } else { &mut ends.others }.extend(open);
                    of_guard |= if holds { self.control & !control } else { 0 };
                }
            }
            (self.slots, self.cells) = frame.top;
            let [next, other] = node.successors();
            let open = std::mem::take(&mut self.open);
            for (next, exits) in [(next, open), (other, fails)] {
                let place = next.and_then(|next| arriving.get_mut(next as usize));
                place.into_iter().for_each(|it| it.extend(&exits));
            }
        }
        (self.slots, self.cells) = (slots, cells);
        (self.control, self.deciding) = (control, of_guard);
        ends
    }

    /// Lets these slots carry what those carry, and nothing else.
    fn decide(&mut self, from: Slots, to: Slots) {
        if to != 0
            && self.decides
            && let Some(node) = self.emit(NodeStep::Plain, SourceId::default())
        {
            (node.from, node.to) = (from, to);
        }
    }

    /// Returns the places of the registers of a program: those of disjoint blocks share them.
    fn registers(
        &mut self,
        graph: &ProgramGraph<'db>,
        body: BodyId,
        bound: &FxHashMap<VariableId, Storage>,
    ) -> Vec<Storage> {
        let group = self.scope.group(body).unwrap_or_default();
        let locals = &inference_of(self.db, self.project, self.of, group).variables;
        let shared = self.shared;
        let type_of_variable = |id: VariableId| {
            let all = if id.group.is_none() { shared } else { locals };
            all.get(id.index as usize).map(|it| it.ty.clone())
        };
        // The types of results; those of reads are known by the port.
        let mut types: FxHashMap<u32, Type> = FxHashMap::default();
        let mut statuses: FxHashMap<u32, Storage> = FxHashMap::default();
        for node in &graph.nodes {
            match &node.action {
                Action::Call(call) => {
                    if let Some(Callee::Builtin(Builtin::Read | Builtin::Status)) = call.callee {
                        let cell = self.status(&call.operand);
                        statuses.insert(call.result, Storage { slot: 0, cell, values: ANY });
                    }
                    types.insert(call.result, self.result_type(call));
                }
                Action::Assign { to, value: Some(value) } if graph.variable(*to).is_none() => {
                    let ty = match graph.term(*value) {
                        Term::Decided(..) => Some(Type::Bool),
                        Term::Register(register, _) => graph.variable(register).and_then(type_of_variable),
                        _ => None,
                    };
                    types.insert(*to, ty.unwrap_or(Type::Unknown));
                }
                _ => {}
            }
        }
        // The depth of each open register, and the first free slot and cell below it.
        let mut open: Vec<(u32, (u32, u8))> = Vec::new();
        let (mut most, mut found) = ((self.slots, self.cells), Vec::with_capacity(graph.registers.len()));
        for (number, register) in (0..).zip(&graph.registers) {
            let known = register.variable.and_then(|it| bound.get(&it));
            let known = known.or_else(|| statuses.get(&number)).copied();
            let storage = match (known, register.variable) {
                (Some(known), _) => known,
                (None, Some(variable)) if variable.group.is_none() => self.variable(variable),
                (None, variable) => {
                    while let Some((_, before)) = open.pop_if(|(depth, _)| *depth >= register.depth) {
                        (self.slots, self.cells) = before;
                    }
                    open.push((register.depth, (self.slots, self.cells)));
                    let own = variable.and_then(type_of_variable).or_else(|| types.remove(&number));
                    self.stack(&own.unwrap_or(Type::Void))
                }
            };
            most = (most.0.max(self.slots), most.1.max(self.cells));
            found.push(storage);
        }
        (self.slots, self.cells) = most;
        found
    }

    /// Returns the type of the result of a call; `void` where the call is known by what it reads.
    fn result_type(&self, call: &Call<'db>) -> Type {
        let ty = |of, ty: Option<&TypeRef>| type_of(self.db, self.project, of, ty);
        match call.callee {
            Some(Callee::Codel(of)) => {
                codel(self.db, of).map_or(Type::Unknown, |data| ty(of, data.result.as_ref()))
            }
            Some(Callee::Operation(index)) => {
                let head = self.scope.operations.get(index);
                head.map_or(Type::Unknown, |head| ty(self.of, head.result.as_ref()))
            }
            Some(Callee::Builtin(Builtin::Collect)) => Type::CallStatus,
            Some(Callee::Builtin(_)) | None => Type::Void,
        }
    }

    fn push(&mut self, step: NodeStep, at: SourceId) -> u32 {
        let place = self.graph.places.len().saturating_sub(1) as u32;
        let call = self.call.unwrap_or(at);
        self.graph.nodes.push(JobNode { step, at, call, place, ..JobNode::default() });
        self.graph.nodes.len() as u32 - 1
    }

    /// Adds a node after the open ones; none where the program does not come here.
    fn emit(&mut self, step: NodeStep, at: SourceId) -> Option<&mut JobNode> {
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
    fn branch(&mut self, left: NodeOperand, right: NodeOperand, at: SourceId) -> (Exits, Exits) {
        if self.emit(NodeStep::Branch(left, right), at).is_none() {
            return (Vec::new(), Vec::new());
        }
        let exits = std::mem::take(&mut self.open);
        let other = exits.iter().map(|(node, _)| (*node, 1)).collect();
        (exits, other)
    }

    /// Does so for a condition, which holds at the successor `holds`. Its variables may differ where a client calls an operation.
    fn decision(
        &mut self,
        left: NodeOperand,
        right: NodeOperand,
        at: Option<SourceId>,
        holds: u8,
    ) -> (Exits, Exits) {
        let exits = self.branch(left, right, at.unwrap_or_default());
        let is_of_job = self.graph.places.last().is_some_and(|it| !it.is_called(self.behaviour));
        if let Some(node) = exits.0.first().and_then(|(node, _)| self.graph.nodes.get_mut(*node as usize)) {
            node.holds = at.filter(|_| is_of_job).map(|_| holds);
            node.from = self.deciding;
        }
        exits
    }

    fn set(&mut self, to: Storage, value: Computed, at: SourceId) {
        if to.slot != 0 || to.cell.is_some() {
            let operand = match value.operand {
                NodeOperand::Known(values) => NodeOperand::Known(values & to.values),
                NodeOperand::Cell(_) => value.operand,
            };
            let cell = to.cell.map(|cell| (cell, operand));
            if let Some(node) = self.emit(NodeStep::Plain, at) {
                (node.from, node.to, node.value) = (value.from, to.slot, cell);
            }
        }
    }

    /// Returns the place of a shared variable.
    fn variable(&mut self, id: VariableId) -> Storage {
        if let Some(found) = self.variables.get(&id) {
            return *found;
        }
        let Some(variable) = self.shared.get(id.index as usize) else { return Storage::default() };
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

    fn shared_cell(&mut self, values: CellValues) -> Option<u8> {
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
    fn condition(&mut self, frame: &ProgramFrame<'db>, condition: u32, at: SourceId) -> (Exits, Exits) {
        if let Term::Binary(operator @ (BinaryOperator::Equal | BinaryOperator::NotEqual), left, right) =
            frame.graph.term(condition)
        {
            let [left, right] = [left, right].map(|it| self.value(frame, it, at));
            let holds = u8::from(operator == BinaryOperator::NotEqual);
            let (equal, differ) = self.decision(left.operand, right.operand, Some(at), holds);
            return if holds == 0 { (equal, differ) } else { (differ, equal) };
        }
        let value = self.value(frame, condition, at);
        self.decision(value.operand, NodeOperand::Known(TRUE), Some(at), 0)
    }

    fn value(&mut self, frame: &ProgramFrame<'db>, term: u32, at: SourceId) -> Computed {
        let unknown = |from| Computed { from, operand: NodeOperand::Known(ANY) };
        match frame.graph.term(term) {
            Term::Bool(value) => Computed { from: 0, operand: NodeOperand::Known(FALSE << u8::from(value)) },
            Term::Status(value) => Computed { from: 0, operand: NodeOperand::Known(NO_DATA << value) },
            Term::Missing | Term::Other | Term::Feature | Term::Int(_) => unknown(0),
            Term::Register(register, _) => computed(frame.place(register)),
            Term::Incomplete(inner) | Term::Unary(UnaryOperator::Minus, inner) => {
                unknown(self.value(frame, inner, at).from)
            }
            Term::Decided(value, by) => {
                let from = self.value(frame, by, at).from;
                Computed { from, operand: NodeOperand::Known(FALSE << u8::from(value)) }
            }
            Term::Unary(UnaryOperator::Not, inner) => {
                let inner = self.value(frame, inner, at);
                self.truth(inner.operand, NodeOperand::Known(FALSE), inner.from, at)
            }
            Term::Binary(..) => {
                let (first, operands) = frame.graph.spine(term);
                let first = self.value(frame, first, at);
                operands.into_iter().fold(first, |left, (operator, right)| {
                    let right = self.value(frame, right, at);
                    let from = left.from | right.from;
                    match operator {
                        BinaryOperator::Equal => self.truth(left.operand, right.operand, from, at),
                        BinaryOperator::NotEqual => {
                            let equal = self.truth(left.operand, right.operand, from, at);
                            self.truth(equal.operand, NodeOperand::Known(FALSE), from, at)
                        }
                        _ => unknown(from),
                    }
                })
            }
        }
    }

    /// Returns whether two operands are equal.
    fn truth(&mut self, left: NodeOperand, right: NodeOperand, from: Slots, at: SourceId) -> Computed {
        let result = self.stack(&Type::Bool);
        let (equal, differ) = self.branch(left, right, at);
        self.open = equal;
        self.set(result, Computed { from, operand: NodeOperand::Known(TRUE) }, at);
        let after = std::mem::replace(&mut self.open, differ);
        self.set(result, Computed { from, operand: NodeOperand::Known(FALSE) }, at);
        self.open.extend(after);
        computed(result)
    }

    fn call_of(&mut self, frame: &ProgramFrame<'db>, call: &Call<'db>, at: SourceId) {
        match call.callee {
            Some(Callee::Codel(codel)) => self.codel(frame, codel, call, at),
            Some(Callee::Operation(index)) => self.operation_call(frame, index, call, at),
            Some(Callee::Builtin(builtin)) => self.builtin(frame, builtin, call, at),
            None => {}
        }
    }

    fn codel(&mut self, frame: &ProgramFrame<'db>, of: Decl<'db>, call: &Call<'db>, at: SourceId) {
        let data = codel(self.db, of);
        let (db, project) = (self.db, self.project);
        let ty = |ty: Option<&_>| type_of(db, project, of, ty);
        let result = data.map_or(Type::Unknown, |data| ty(data.result.as_ref()));
        let mut types = data.iter().flat_map(|data| &data.parameters).map(|it| ty(it.ty.as_ref()));
        let has_handle = (self.is_handle)(&result) || types.any(|ty| (self.is_handle)(&ty));
        let result = frame.place(call.result);
        let (mut from, mut to) = (0, result.slot);
        let (mut changed, mut takes) = (Vec::new(), false);
        for argument in &call.arguments {
            match (argument.direction, argument.variable) {
                (Direction::In, _) => from |= self.value(frame, argument.value, at).from,
                (direction, Some(variable)) => {
                    let storage = frame.place(variable);
                    to |= storage.slot;
                    from |= if direction == Direction::InOut { storage.slot } else { 0 };
                    changed.push(storage);
                }
                _ => {}
            }
            takes |= argument.direction != Direction::Out;
        }
        let source = (to != 0).then(|| self.source(PassageEnd::Codel(of)));
        let sink = takes.then(|| self.sink(PassageEnd::Codel(of), has_handle));
        let value = result.cell.map(|cell| (cell, NodeOperand::Known(result.values)));
        let (control, mut sink) = (self.control, sink);
        // What it returns carries its arguments only.
        if let Some(node) = sink.filter(|_| control != 0).and_then(|_| self.emit(NodeStep::Plain, at)) {
            (node.from, node.sink) = (from | control, sink.take());
        }
        if let Some(node) = self.emit(NodeStep::Plain, at) {
            (node.from, node.to, node.value, node.source, node.sink) = (from, to, value, source, sink);
            let id = self.graph.nodes.len() as u32 - 1;
            self.graph.calls.insert(id, of);
        }
        self.forget(changed, at);
    }

    /// Executes an operation of the core. Parameters that it changes are the variables of the caller.
    fn operation_call(&mut self, frame: &ProgramFrame<'db>, index: usize, call: &Call<'db>, at: SourceId) {
        self.operations += 1;
        let fits = self.depth < MAX_CALLS && self.operations <= MAX_OPERATIONS && !self.graph.too_large;
        let Some(operation) = self.scope.operations.get(index).filter(|_| fits) else {
            self.graph.too_large = true;
            return;
        };
        let mut bound = Vec::new();
        for (parameter, argument) in operation.parameters.iter().zip(&call.arguments) {
            bound.push(match (parameter.direction, argument.variable) {
                (Direction::Out | Direction::InOut, Some(variable)) => frame.place(variable),
                _ => {
                    let ty = type_of(self.db, self.project, self.of, parameter.ty.as_ref());
                    let storage = self.stack(&ty);
                    let value = self.value(frame, argument.value, at);
                    self.set(storage, value, at);
                    storage
                }
            });
        }
        let outer = self.call;
        self.call = outer.or(Some(at));
        self.depth += 1;
        self.open = self.operation(index, &bound, frame.place(call.result));
        self.depth -= 1;
        self.call = outer;
    }

    fn builtin(&mut self, frame: &ProgramFrame<'db>, builtin: Builtin, call: &Call<'db>, at: SourceId) {
        let operand = &call.operand;
        match builtin {
            Builtin::Status => {}
            Builtin::Read => {
                let cell = self.status(operand);
                self.read(frame, PassageEnd::Port(operand.clone()), cell, call, at);
            }
            Builtin::Collect => {
                let handler = self.scope.handlers.iter().find(|it| it.name.name == *operand);
                let path = handler.and_then(|it| it.operation.as_ref()).and_then(|it| it.path.last());
                if let Some(operation) = path {
                    let status = frame.place(call.result).cell;
                    self.read(frame, PassageEnd::Operation(operation.clone()), status, call, at);
                }
            }
            Builtin::Write | Builtin::Send => {
                let values = call.arguments.iter().skip(1);
                let from = values.fold(0, |from, it| from | self.value(frame, it.value, at).from);
                let from = from | self.control;
                let end = match builtin {
                    Builtin::Write => PassageEnd::Port(operand.clone()),
                    _ => PassageEnd::Operation(operand.clone()),
                };
                let sink = self.sink(end, false);
                if let Some(node) = self.emit(NodeStep::Plain, at) {
                    (node.from, node.sink) = (from, Some(sink));
                }
            }
        }
    }

    fn read(
        &mut self,
        frame: &ProgramFrame<'db>,
        end: PassageEnd<'db>,
        cell: Option<u8>,
        call: &Call<'db>,
        at: SourceId,
    ) {
        let source = self.source(end);
        let changed = call.arguments.iter().skip(1).filter_map(|it| it.variable);
        let changed: Vec<Storage> = changed.map(|variable| frame.place(variable)).collect();
        let slots = changed.iter().fold(0, |slots, it| slots | it.slot);
        if let Some(node) = self.emit(NodeStep::Read(cell), at) {
            (node.to, node.source) = (slots, Some(source));
        }
        self.forget(changed, at);
    }

    /// Any value may be in these variables from here on.
    fn forget(&mut self, changed: Vec<Storage>, at: SourceId) {
        for storage in changed {
            let value = Computed { from: 0, operand: NodeOperand::Known(ANY) };
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

impl ProgramFrame<'_> {
    fn place(&self, register: u32) -> Storage {
        self.registers.get(register as usize).copied().unwrap_or_default()
    }
}

/// Returns the conditions of a program that control a call, or whether a guard holds, each with the nodes that it does: those that all
/// paths from one of its branches come to, and not all from the condition; and what conditions of these nodes control.
fn controlled(graph: &ProgramGraph<'_>) -> Vec<(u32, Vec<bool>)> {
    let count = graph.nodes.len();
    let mut found: Vec<(u32, Vec<bool>)> = Vec::new();
    let mut by: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); count];
    for (wanted, node) in graph.nodes.iter().enumerate() {
        let is_sink = match node.action {
            Action::Call(_) => true,
            Action::Return(value) => value.is_some_and(|it| graph.term(it) == Term::Bool(true)),
            Action::Branch { .. } => false,
            _ => continue,
        };
        // Whether a program may end without it, from each node before it on.
        let mut avoids = vec![true; count];
        avoids[wanted] = false;
        for (index, node) in graph.nodes.iter().enumerate().take(wanted).rev() {
            let after =
                node.successors().map(|it| it.is_none_or(|it| avoids.get(it as usize) != Some(&false)));
            avoids[index] = after[0] || node.successors()[1].is_some() && after[1];
            if matches!(node.action, Action::Branch { .. }) && after[0] != after[1] {
                let outer = by[index].clone();
                by[wanted].extend(outer);
                by[wanted].insert(index as u32);
            }
        }
        for &condition in by[wanted].iter().filter(|_| is_sink) {
            let number = found.iter().position(|(it, _)| *it == condition).unwrap_or_else(|| {
                found.push((condition, vec![false; count]));
                found.len() - 1
            });
            found[number].1[wanted] = true;
        }
    }
    found
}

fn computed(storage: Storage) -> Computed {
    Computed { from: storage.slot, operand: storage.cell.map_or(NodeOperand::Known(ANY), NodeOperand::Cell) }
}

/// Returns the values of a type whose variables decide branches.
fn values_of(ty: &Type) -> Option<CellValues> {
    match ty {
        Type::Bool => Some(BOOL),
        Type::PortStatus | Type::CallStatus => Some(ANY),
        _ => None,
    }
}
