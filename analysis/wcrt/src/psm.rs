//! The periodic state machine of a component at a significance level: its behaviour with the times of a timetable.

use std::collections::BTreeMap;
use std::sync::Arc;

use mauve_timing::{Demand, Entry, Level, StateMachine, Time, Waits};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::reason::{MOST_REASONS, Reason, Refusal, Timed, TooLong, UnusableTime};
use crate::sends::sends_of_operation;
use crate::table_set::TableSet;
use crate::timetable::{Lookup, Timetable, table, times_of, timetable_of};
use mauve_hir::item_tree::Name;
use mauve_hir::{
    Assumption, Behaviour, Cost, CostGraph, Decl, Edges, Execution, Location, ModelDb, Passage, PassageEnd,
    PeriodEdge, Product, ProgramId, Project, TimedProgram, Written, behaviour_of, closure, codel, component,
    core_of, errors_in, features_of, fold, is_core_for, passages_of, product_of, shell_of, uses_of,
};

/// A component's periodic state machine (paper, Def. 3 and 4).
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Psm<'db> {
    /// The names of the states, by number.
    pub states: Vec<Name>,
    /// The number of the initial one.
    pub initial: usize,
    /// The machine that the analysis reads: that of `product`, in the same order. Waits are included.
    pub machine: StateMachine,
    /// The states together with the values of variables; none for a machine without programs.
    pub product: Option<Arc<Product<'db>>>,
    /// What of it codels wait; `None` if they do not.
    pub waits: Option<Arc<Waits>>,
    /// The transition and the programs of each edge.
    pub edges: Arc<Edges>,
    /// The programs with their times: 0 where no edge executes them.
    pub programs: Vec<(ProgramId, Time)>,
    /// The programs that the greatest edge executes, by index, each with its time there.
    pub greatest: Vec<(usize, Time)>,
    /// Its own operations that programs may call, likewise; no time where none was needed.
    pub operations: Vec<(ProgramId, Option<Time>)>,
    /// Dispatch and context switches, in each edge: that of the wake-up that the job begins with, none where another instance of the
    /// thread has it.
    pub overhead: Time,
    /// The context switches of the waits in the greatest edge: to leave the CPU and to return, for each.
    pub switches: Time,
    /// The component's own time, for the classic method, where a table has one.
    pub component_time: Option<Time>,
    /// Why the tables' time cannot be used, where it cannot.
    pub unusable_component_time: Option<UnusableTime<'db>>,
    /// Codels whose time is that of `[assume]`, with it.
    pub assumed: Vec<(String, Time)>,
    /// Whether one of its times is extrapolated at this level.
    pub is_extrapolated: bool,
}

/// What a program takes along its worst paths: each figure is that of the path with the greatest one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TakenPaths {
    /// The execution time.
    execution: Time,
    /// The time that codels wait.
    wait: Time,
    /// Both together.
    total: Time,
    /// How often codels wait; `None` if that is unknown.
    waits: Option<u64>,
}

impl TakenPaths {
    const NOTHING: TakenPaths =
        TakenPaths { execution: Time::ZERO, wait: Time::ZERO, total: Time::ZERO, waits: Some(0) };

    fn executing(execution: Time) -> TakenPaths {
        TakenPaths { execution, total: execution, ..TakenPaths::NOTHING }
    }

    /// Returns what one after the other takes; `None` if that is too long.
    fn then(self, other: TakenPaths) -> Option<TakenPaths> {
        Some(TakenPaths {
            execution: self.execution.checked_add(other.execution)?,
            wait: self.wait.checked_add(other.wait)?,
            total: self.total.checked_add(other.total)?,
            waits: self.waits.zip(other.waits).and_then(|(one, other)| one.checked_add(other)),
        })
    }

    /// Returns the greatest figures of the two.
    fn or(self, other: TakenPaths) -> TakenPaths {
        TakenPaths {
            execution: self.execution.max(other.execution),
            wait: self.wait.max(other.wait),
            total: self.total.max(other.total),
            waits: self.waits.zip(other.waits).map(|(one, other)| one.max(other)),
        }
    }
}

/// The periodic state machine of a component, and what of it codels wait.
struct Machines {
    machine: StateMachine,
    waits: Option<Arc<Waits>>,
    /// See [`Psm::switches`].
    switches: Time,
}

/// What the jobs of a component execute.
struct ExecutedJobs {
    machines: Machines,
    /// The longest time of each program.
    programs: Vec<Time>,
    /// See [`Psm::greatest`].
    greatest: Vec<(usize, Time)>,
}

/// The state machine of a component, or why it has none.
pub(crate) type PsmResult<'db> = Result<Psm<'db>, Vec<Refusal<'db>>>;

impl<'db> Psm<'db> {
    /// A machine without programs.
    pub(crate) fn of_machine(states: Vec<Name>, machine: StateMachine, edges: Edges) -> Psm<'db> {
        Psm {
            states,
            initial: 0,
            machine,
            product: None,
            waits: None,
            edges: Arc::new(edges),
            programs: Vec::new(),
            greatest: Vec::new(),
            operations: Vec::new(),
            overhead: Time::ZERO,
            switches: Time::ZERO,
            component_time: None,
            unusable_component_time: None,
            assumed: Vec::new(),
            is_extrapolated: false,
        }
    }

    /// Returns the name of a state.
    pub fn state(&self, number: usize) -> &str {
        self.states.get(number).map_or("", Name::as_str)
    }

    /// Returns the demand of a task that executes it, with its waits.
    pub(crate) fn demand(&self) -> (Demand, Option<Arc<Waits>>) {
        let wait = self.waits.as_ref().map_or(Time::ZERO, |waits| waits.greatest(&self.machine));
        // A component whose time is too long with its waits has a bound of the whole machine all the same.
        let whole = self.component_time.map(|time| time.checked_add(wait).unwrap_or(time));
        (Demand::Machine { machine: self.machine.clone(), whole }, self.waits.clone())
    }

    /// Returns its machine without waits.
    pub fn executed(&self) -> &StateMachine {
        self.waits.as_ref().map_or(&self.machine, |waits| &waits.executed)
    }

    /// Returns the edge of `edges` that an edge of the machine belongs to.
    pub fn text_edge(&self, edge: usize) -> Option<usize> {
        match &self.product {
            Some(product) => product.edges.get(edge).map(|it| it.edge as usize),
            None => (edge < self.edges.all.len()).then_some(edge),
        }
    }

    /// Returns the state of the text of a state of the machine.
    pub fn text_state(&self, number: usize) -> usize {
        let product = self.product.as_ref().map(|it| it.states.get(number));
        product.map_or(number, |it| it.map_or(0, |it| it.state as usize))
    }

    /// Returns the values of variables in a state of the machine: `count = 3`.
    pub fn values_in(&self, number: usize) -> String {
        self.product.as_ref().map_or_else(String::new, |it| it.values_in(number))
    }

    /// Returns the name of a state of the machine: `Planning (count = 3)`.
    pub fn state_with_values(&self, number: usize) -> String {
        let state = self.state(self.text_state(number));
        match self.values_in(number).as_str() {
            "" => state.to_owned(),
            values => format!("{state} ({values})"),
        }
    }

    /// Returns whether the values of variables are followed.
    pub fn has_values(&self) -> bool {
        self.product.as_ref().is_some_and(|it| it.has_values())
    }

    /// Returns the number of the initial state of the machine.
    pub fn start(&self) -> usize {
        self.product.as_ref().map_or(self.initial, |it| it.initial)
    }

    /// Returns the index of the longest edge of the machine for each of `edges`; none where no period executes it.
    pub fn longest_edges(&self) -> Vec<Option<usize>> {
        let mut longest = vec![None; self.edges.all.len()];
        for index in 0..self.machine.edges().len() {
            if let Some(known) = self.text_edge(index).and_then(|it| longest.get_mut(it)) {
                let time = |index: usize| self.machine.edges().get(index).map(|edge| edge.cost);
                *known = known.filter(|known| time(*known) >= time(index)).or(Some(index));
            }
        }
        longest
    }

    /// Returns the time of the longest edge of the machine for each of `edges`; none where no period executes it.
    pub fn longest_times(&self) -> impl Iterator<Item = Option<Time>> {
        self.longest_edges().into_iter().map(|index| Some(self.machine.edges().get(index?)?.cost))
    }

    /// Returns how long the edge of this index waits.
    pub fn wait_of(&self, edge: usize) -> Option<Time> {
        self.machine.edges().get(edge)?.cost.checked_sub(self.executed().edges().get(edge)?.cost)
    }

    /// Returns the programs that an edge executes, in order.
    pub fn programs_of<'a>(&'a self, edge: &'a PeriodEdge) -> impl Iterator<Item = &'a ProgramId> {
        self.edges.programs(edge).filter_map(|index| self.programs.get(index)).map(|(program, _)| program)
    }
}

/// The periodic state machine of a component in a thread of its own with the times of these tables, or why it has none.
pub fn psm_of<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    level: Level,
) -> &'db Result<Psm<'db>, Vec<Refusal<'db>>> {
    psm_in_thread(db, tables, component, level, true)
}

/// [`psm_of`], for an instance whose jobs begin with the wake-up of its thread or not: see [`ResolvedActivity::wakes`].
///
/// [`ResolvedActivity::wakes`]: crate::ResolvedActivity::wakes
#[salsa::tracked(returns(ref))]
pub fn psm_in_thread<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    level: Level,
    wakes: bool,
) -> Result<Psm<'db>, Vec<Refusal<'db>>> {
    psm_with(db, tables, component, level, wakes, &|_| None)
}

/// Returns what a job takes up to the end of the write of each passage of a component, at most, in the order of
/// [`mauve_hir::Passages::all`]; none where all of the job counts.
#[salsa::tracked(returns(ref))]
pub(crate) fn write_costs<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    of: Decl<'db>,
    level: Level,
    wakes: bool,
    assumption: Assumption<'db>,
) -> Vec<Option<Time>> {
    let project = tables.project(db);
    let Some(core) = core_of(db, project, of) else { return Vec::new() };
    let Ok(behaviour) = behaviour_behind(db, project, of) else { return Vec::new() };
    let mut evaluator = PsmEvaluator::new(db, of, behaviour, times_of(db, tables, of), level, &|_| None);
    let programs = evaluator.programs();
    let Some(overhead) = evaluator.overhead(wakes) else { return Vec::new() };
    let is_call = |end: &PassageEnd<'db>| matches!(end, PassageEnd::Operation(_));
    let cost = |passage: &Passage<'db>| {
        let is_whole = passage.to_handle || is_call(&passage.from) || is_call(&passage.to);
        let mut written = passage.written.iter().filter(|_| !is_whole);
        let first = evaluator.until(&programs, overhead, written.next()?);
        written.fold(first, |most, it| Some(most?.max(evaluator.until(&programs, overhead, it)?)))
    };
    passages_of(db, project, core, assumption).all.iter().map(cost).collect()
}

/// Returns whether each job of a component that writes this port executes no codel or operation after that, and accesses no port that
/// takes time.
#[salsa::tracked]
pub(crate) fn ends_with_write<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    of: Decl<'db>,
    level: Level,
    port: Name,
) -> bool {
    let Ok(behaviour) = behaviour_behind(db, tables.project(db), of) else { return false };
    let mut evaluator = PsmEvaluator::new(db, of, behaviour, times_of(db, tables, of), level, &|_| None);
    let programs = behaviour.programs.iter().map(|program| evaluator.after_write(&program.cost, &port));
    let programs: Vec<AfterWrite> = programs.collect();
    let whole =
        |before: AfterWrite, index: usize| before.then(programs.get(index).copied().unwrap_or_default());
    behaviour.edges.sums(AfterWrite::default(), whole).iter().all(|it| !it.goes_on)
}

/// What a part of a job does, with regard to a port.
#[derive(Clone, Copy, Default)]
struct AfterWrite {
    /// It may write the port.
    writes: bool,
    /// It may take time.
    takes_time: bool,
    /// It may take time after it has written the port.
    goes_on: bool,
}

impl AfterWrite {
    fn or(self, other: AfterWrite) -> AfterWrite {
        AfterWrite {
            writes: self.writes || other.writes,
            takes_time: self.takes_time || other.takes_time,
            goes_on: self.goes_on || other.goes_on,
        }
    }

    fn then(self, other: AfterWrite) -> AfterWrite {
        let goes_on = self.writes && other.takes_time;
        AfterWrite { goes_on: goes_on || self.goes_on || other.goes_on, ..self.or(other) }
    }
}

/// The times of codels and programs that replace those of the tables; `None` where the tables count.
pub(crate) type OtherTimes<'a, 'db> = &'a dyn Fn(&Timed<'db>) -> Option<Time>;

/// [`psm_in_thread`], where `what_if` replaces times of the tables.
pub(crate) fn psm_with<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    of: Decl<'db>,
    level: Level,
    wakes: bool,
    what_if: OtherTimes<'_, 'db>,
) -> Result<Psm<'db>, Vec<Refusal<'db>>> {
    let behaviour = behaviour_behind(db, tables.project(db), of)?;
    let times = times_of(db, tables, of);
    if let Some(unusable) = times.wrong_programs.get(&of) {
        return Err(vec![Refusal::new(Reason::Table(unusable.clone()), Location::name_of(of))]);
    }
    let project = tables.project(db);
    let Some(core) = core_of(db, project, of) else { return Err(Vec::new()) };
    PsmEvaluator::new(db, of, behaviour, times, level, what_if).psm(product_of(db, project, core), wakes)
}

/// Returns what a component executes, without times, or why that is not known.
fn behaviour_behind<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
) -> Result<&'db Behaviour<'db>, Vec<Refusal<'db>>> {
    let refuse = |reason, at| Err(vec![Refusal::new(reason, at)]);
    let at = Location::name_of(of);
    if component(db, of).is_some_and(|data| data.completeness.is_incomplete()) {
        return refuse(Reason::Damaged(of), at);
    }
    let Some(shell) = shell_of(db, project, of) else {
        return refuse(Reason::UnknownShell { project, component: of }, at);
    };
    let Some(core) = core_of(db, project, of) else {
        return refuse(Reason::UnknownCore { project, component: of }, at);
    };
    if !is_core_for(db, project, core, shell) {
        return refuse(Reason::CoreOfOtherShell(of), at);
    }
    let behaviour = behaviour_of(db, project, core);
    if !behaviour.refusals.is_empty() {
        // A few reasons suffice, and every activity that executes the component repeats them.
        return Err(behaviour.refusals.iter().take(MOST_REASONS).map(Refusal::of_model).collect());
    }
    let features = features_of(db, project, shell);
    if features.completeness.is_incomplete() || features.cycle {
        return refuse(Reason::IncompleteShell { project, shell }, Location::name_of(shell));
    }
    let errors = errors_behind(db, project, of, shell, core);
    if errors.is_empty() { Ok(behaviour) } else { Err(errors) }
}

/// Returns whether the programs of a component are known, and so the calls that they send.
#[salsa::tracked]
pub(crate) fn is_readable<'db>(db: &'db dyn ModelDb, project: Project<'db>, component: Decl<'db>) -> bool {
    behaviour_behind(db, project, component).is_ok()
}

/// Returns the codels that a component may execute in its thread; `None` if its programs are not known.
#[salsa::tracked(returns(ref))]
pub(crate) fn codels_of<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
) -> Option<Vec<Decl<'db>>> {
    let behaviour = behaviour_behind(db, project, component).ok()?;
    let mut codels: Vec<Decl<'db>> = behaviour.executed().flat_map(|program| program.cost.codels()).collect();
    codels.sort_by_cached_key(|codel| codel.qualified(db));
    codels.dedup();
    Some(codels)
}

/// What a component executes for each call of an operation that it provides.
pub(crate) struct ExecutedOperation<'db> {
    /// The execution time, with the overhead of a job, which a call between two periods has. Or why it is unknown.
    pub(crate) time: Result<Time, Vec<Refusal<'db>>>,
    /// Whether its codels wait: that is in the time.
    pub(crate) waits: bool,
    /// The greatest number of calls that it sends to each required operation.
    pub(crate) sends: Vec<(Name, u64)>,
}

/// Returns what a component executes for each call of the operation `name`; none if its programs are not known. `what_if`
/// replaces times of the tables.
pub(crate) fn operation_with<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    of: Decl<'db>,
    name: &Name,
    level: Level,
    what_if: OtherTimes<'_, 'db>,
) -> Option<ExecutedOperation<'db>> {
    let project = tables.project(db);
    if !is_readable(db, project, of) {
        return None;
    }
    let behaviour = behaviour_of(db, project, core_of(db, project, of)?);
    let is_it = |program: &TimedProgram<'db>| matches!(&program.id, ProgramId::Operation(it) if it == name);
    let index = behaviour.operations.iter().position(is_it)?;
    let times = times_of(db, tables, of);
    let (time, waits) = PsmEvaluator::new(db, of, behaviour, times, level, what_if).operation(index);
    Some(ExecutedOperation { time, waits, sends: sends_of_operation(behaviour, index) })
}

/// Returns the errors in the declarations that a component executes: erroneous text may contain a call.
fn errors_behind<'db>(
    db: &'db dyn ModelDb,
    project: Project<'db>,
    component: Decl<'db>,
    shell: Decl<'db>,
    core: Decl<'db>,
) -> Vec<Refusal<'db>> {
    let shells = features_of(db, project, shell).shells.iter().filter(|&&base| base != shell);
    let declared = [component, core, shell].into_iter().chain(shells.copied());
    let mut codels: Vec<Decl<'db>> = uses_of(db, project, core).codels.iter().copied().collect();
    codels.sort_by(|a, b| a.name(db).cmp(b.name(db)));
    let is_damaged = |of: &&Decl<'db>| codel(db, **of).is_some_and(|data| data.completeness.is_incomplete());
    let damaged = codels.iter().filter(is_damaged);
    let damaged = damaged.map(|&of| Refusal::new(Reason::Damaged(of), Location::name_of(of)));
    let errors = declared.chain(codels.iter().copied()).flat_map(|decl| errors_in(db, project, decl));
    errors.map(Refusal::of_model).chain(damaged).take(MOST_REASONS).collect()
}

/// What a part of a cost takes that has no parts.
type OfPart<'c, 'a, 'db> = &'c dyn Fn(&mut PsmEvaluator<'a, 'db>, &Execution<'db>) -> Option<TakenPaths>;

struct PsmEvaluator<'a, 'db> {
    db: &'db dyn ModelDb,
    component: Decl<'db>,
    behaviour: &'db Behaviour<'db>,
    times: &'db Timetable<'db>,
    level: Level,
    what_if: OtherTimes<'a, 'db>,
    operations: Vec<Option<TakenPaths>>,
    /// What the codels so far take.
    codels: FxHashMap<Decl<'db>, Option<TakenPaths>>,
    refusals: Vec<Refusal<'db>>,
    missing: BTreeMap<String, Refusal<'db>>,
    assumed: BTreeMap<String, Time>,
    is_extrapolated: bool,
}

impl<'a, 'db> PsmEvaluator<'a, 'db> {
    fn new(
        db: &'db dyn ModelDb,
        component: Decl<'db>,
        behaviour: &'db Behaviour<'db>,
        times: &'db Timetable<'db>,
        level: Level,
        what_if: OtherTimes<'a, 'db>,
    ) -> PsmEvaluator<'a, 'db> {
        PsmEvaluator {
            db,
            component,
            behaviour,
            times,
            level,
            what_if,
            operations: vec![None; behaviour.operations.len()],
            codels: FxHashMap::default(),
            refusals: Vec::new(),
            missing: BTreeMap::new(),
            assumed: BTreeMap::new(),
            is_extrapolated: false,
        }
    }

    /// Returns the time of an operation of the core, and of the dispatch and the context switches for it; and whether it waits.
    fn operation(mut self, index: usize) -> (Result<Time, Vec<Refusal<'db>>>, bool) {
        self.evaluate_operations(vec![index]);
        let taken = self.operations.get(index).copied().flatten();
        let time = taken.and_then(|taken| self.with_switches(&taken));
        // Between two periods, a call wakes the thread, also for an operation that takes no time.
        let overhead = taken.and_then(|_| self.overhead(true));
        let sum = time.zip(overhead).and_then(|(time, overhead)| time.checked_add(overhead));
        if taken.is_some() && overhead.is_some() && sum.is_none() {
            self.refuse(Reason::TooLong(TooLong::Program));
        }
        self.refusals.extend(std::mem::take(&mut self.missing).into_values());
        (sum.ok_or(self.refusals), taken.is_some_and(|taken| taken.wait > Time::ZERO))
    }

    /// Returns the overhead of a job that begins with the wake-up of its thread or does not, and refuses the component where it is
    /// unknown.
    fn overhead(&mut self, wakes: bool) -> Option<Time> {
        let overhead = self.times.overhead(self.level);
        if overhead.is_none() {
            match self.times.without_level(self.level) {
                // One warning reports this for the level.
                Some(table) => self.refuse(Reason::NoOverhead { level: self.level, table: table.clone() }),
                None => self.refuse(Reason::TooLong(TooLong::Overhead)),
            }
        }
        overhead.map(|it| if wakes { it } else { Time::ZERO })
    }

    /// Returns what each program takes that an edge executes.
    fn programs(&mut self) -> Vec<Option<TakenPaths>> {
        let behaviour = self.behaviour;
        // Only programs of edges need a time: unreachable states, and transitions after one without a guard, are
        // never executed.
        let mut used = vec![false; behaviour.programs.len()];
        behaviour.edges.executed().for_each(|index| used[index] = true);
        self.operations_of(&used);
        let programs = behaviour.programs.iter().zip(used);
        programs.map(|(program, used)| if used { self.program(program) } else { None }).collect()
    }

    /// Returns what a job takes up to the end of a write at most; none if that is not known.
    fn until(
        &mut self,
        programs: &[Option<TakenPaths>],
        overhead: Time,
        written: &Written<'db>,
    ) -> Option<Time> {
        let behaviour = self.behaviour;
        let edge = behaviour.edges.all.get(written.edge)?;
        let mut executed = behaviour.edges.programs(edge);
        let mut sum = TakenPaths::executing(overhead);
        for _ in 0..written.programs {
            sum = sum.then(programs.get(executed.next()?).copied().flatten()?)?;
        }
        let last = executed.next()?;
        let timed = Timed::Program(self.component, behaviour.programs.get(last)?.id.in_table());
        // A table has the time of the whole program only.
        let part = match self.times.time(&timed, self.level) {
            Lookup::Absent => self.cost(&written.part)?,
            _ => programs.get(last).copied().flatten()?,
        };
        self.with_switches(&sum.then(part)?)
    }

    /// Returns what a program does with regard to a port. What the operations do that it executes is not known.
    fn after_write(&mut self, cost: &CostGraph<'db>, port: &Name) -> AfterWrite {
        let found = cost.folded(|part, known: &[AfterWrite]| {
            let of = |index: &u32| known.get(*index as usize).copied().unwrap_or_default();
            match part {
                Cost::Nothing | Cost::One(Execution::Send(_)) => AfterWrite::default(),
                Cost::One(Execution::Access(used)) => {
                    let takes_time = self.access(used) != Some(TakenPaths::NOTHING);
                    AfterWrite { writes: used == port, takes_time, goes_on: false }
                }
                Cost::Sum(one, other) => of(one).then(of(other)),
                Cost::Greatest(one, other) => of(one).or(of(other)),
                _ => AfterWrite { takes_time: true, ..AfterWrite::default() },
            }
        });
        found.unwrap_or_default()
    }

    /// Returns the context switches of the waits; none if they take too long. To leave the CPU is one, to return another, for each wait:
    /// a wait lasts until the thread would run again at once. If it is unknown how often codels wait, the waits have to contain them.
    fn switches_of(&self, taken: &TakenPaths) -> Option<Time> {
        let Some(waits) = taken.waits.filter(|waits| *waits > 0) else { return Some(Time::ZERO) };
        self.times.switches(self.level)?.checked_mul(waits)
    }

    /// Returns what takes so long, with the context switches of its waits; none if that is too long.
    fn with_switches(&self, taken: &TakenPaths) -> Option<Time> {
        taken.total.checked_add(self.switches_of(taken)?)
    }

    fn psm(mut self, product: &Arc<Product<'db>>, wakes: bool) -> Result<Psm<'db>, Vec<Refusal<'db>>> {
        let behaviour = self.behaviour;
        let programs = self.programs();
        let overhead = self.overhead(wakes);
        for too_long in self.too_long(&programs, overhead) {
            self.refuse(Reason::TooLong(TooLong::Edge(too_long.clone())));
        }
        self.refusals.extend(std::mem::take(&mut self.missing).into_values());
        if !self.refusals.is_empty() {
            return Err(self.refusals);
        }
        let overhead = overhead.unwrap_or_default();
        let ExecutedJobs { machines, programs, greatest } = self.executed(product, overhead)?;
        let whole = self.times.time(&Timed::Component(self.component), self.level);
        let component_time = whole.time();
        let unusable_component_time = if let Lookup::Unusable(why) = whole { Some(why) } else { None };
        let id = |program: &TimedProgram<'db>| program.id.clone();
        let operations = self.operations.into_iter().map(|it| it.map(|it| it.execution));
        Ok(Psm {
            states: behaviour.states.clone(),
            initial: behaviour.initial,
            machine: machines.machine,
            product: Some(product.clone()),
            waits: machines.waits,
            switches: machines.switches,
            edges: behaviour.edges.clone(),
            programs: behaviour.programs.iter().map(id).zip(programs).collect(),
            greatest,
            operations: behaviour.operations.iter().map(id).zip(operations).collect(),
            overhead,
            component_time,
            unusable_component_time,
            assumed: self.assumed.into_iter().collect(),
            is_extrapolated: self.is_extrapolated,
        })
    }

    /// Returns the machine whose states have values of variables.
    fn executed(
        &mut self,
        product: &Product<'db>,
        overhead: Time,
    ) -> Result<ExecutedJobs, Vec<Refusal<'db>>> {
        // It also has programs that no period executes.
        let (assumed, is_extrapolated) = (self.assumed.clone(), self.is_extrapolated);
        let costs = self.parts(&product.costs);
        (self.assumed, self.is_extrapolated) = (assumed, is_extrapolated);
        let cost = |of: u32| costs.get(of as usize).copied().flatten();
        let taken = product.edges.iter().map(|edge| TakenPaths::executing(overhead).then(cost(edge.cost)?));
        let too_long = || {
            let reason = Reason::TooLong(TooLong::Program);
            vec![Refusal::new(reason, Location::name_of(self.component))]
        };
        let taken = taken.collect::<Option<Vec<TakenPaths>>>().ok_or_else(too_long)?;
        let ends: Vec<(usize, usize)> = product.edges.iter().map(|edge| edge.ends()).collect();
        let machines = self.machines(product.states.len(), &ends, &taken)?;
        let mut programs = vec![Time::ZERO; self.behaviour.programs.len()];
        for (index, node) in (0..).zip(&product.costs) {
            if let (Cost::Program(program, _), Some(taken)) = (node, cost(index))
                && let Some(longest) = programs.get_mut(*program)
            {
                *longest = (*longest).max(taken.execution);
            }
        }
        let root = product.edges.get(machines.machine.greatest_edge()).map(|edge| edge.cost);
        let total = |it: u32| cost(it).map(|it| it.total);
        let executed = root.into_iter().flat_map(|root| longest_of(&product.costs, &total, root));
        let greatest = executed.filter_map(|index| match product.costs.get(index as usize) {
            Some(Cost::Program(program, _)) => Some((*program, cost(index)?.execution)),
            _ => None,
        });
        Ok(ExecutedJobs { greatest: greatest.collect(), machines, programs })
    }

    /// Returns what each part of a cost takes, where an edge needs it.
    fn parts(&mut self, parts: &[Cost<'db>]) -> Vec<Option<TakenPaths>> {
        let behaviour = self.behaviour;
        let mut timed = |it: &TimedProgram<'db>| self.in_table(&it.id).time();
        let programs: Vec<Option<Time>> = behaviour.programs.iter().map(&mut timed).collect();
        let operations: Vec<Option<Time>> = behaviour.operations.iter().map(&mut timed).collect();
        // What each takes, and what codels wait in it: they count where a table has the time of a program, but none of its codels.
        type Both = (Option<TakenPaths>, Option<TakenPaths>);
        let found = fold(parts, |part, known: &[Both]| {
            let of = |index: &u32| known.get(*index as usize).copied().unwrap_or_default();
            let both = |one: &u32, other: &u32, join: fn(TakenPaths, TakenPaths) -> Option<TakenPaths>| {
                let (one, other) = (of(one), of(other));
                let joined = |one: Option<TakenPaths>, other: Option<TakenPaths>| join(one?, other?);
                (joined(one.0, other.0), joined(one.1, other.1))
            };
            let program = |time: Option<&Option<Time>>, inner: &u32| {
                let (all, waits) = of(inner);
                let timed = time.copied().flatten().map(|time| TakenPaths::executing(time).then(waits?));
                (timed.unwrap_or(all), waits)
            };
            match part {
                Cost::Sum(one, other) => both(one, other, TakenPaths::then),
                Cost::Greatest(one, other) => both(one, other, |one, other| Some(one.or(other))),
                Cost::Program(index, inner) => program(programs.get(*index), inner),
                Cost::Operation(index, inner) => program(operations.get(*index), inner),
                Cost::Nothing => (Some(TakenPaths::NOTHING), Some(TakenPaths::NOTHING)),
                Cost::One(one) => (self.part(one), self.wait_in(one)),
            }
        });
        found.into_iter().map(|(all, _)| all).collect()
    }

    /// Returns the machine of edges with these ends that take so much, and their waits.
    fn machines(
        &self,
        states: usize,
        ends: &[(usize, usize)],
        taken: &[TakenPaths],
    ) -> Result<Machines, Vec<Refusal<'db>>> {
        let machine = |costs: &[Time]| {
            let edges = ends.iter().zip(costs).map(|(&(source, target), &cost)| mauve_timing::Edge {
                source: source as u32,
                target: target as u32,
                cost,
            });
            StateMachine::new(states as u32, edges.collect()).map_err(|error| {
                vec![Refusal::new(Reason::NoMachine(error), Location::name_of(self.component))]
            })
        };
        let with_switches = |it: &TakenPaths| {
            let too_long = Refusal::new(Reason::TooLong(TooLong::Program), Location::name_of(self.component));
            self.with_switches(it).ok_or_else(|| vec![too_long])
        };
        let totals = taken.iter().map(with_switches).collect::<Result<Vec<Time>, _>>()?;
        let all = machine(&totals)?;
        if taken.iter().all(|it| it.waits == Some(0)) {
            return Ok(Machines { machine: all, waits: None, switches: Time::ZERO });
        }
        // If a wait may contain an unknown number of context switches, which preempt others, it counts as execution.
        let no_switches = self.times.switches(self.level) == Some(Time::ZERO);
        let executed = taken.iter().zip(&totals).map(|(it, total)| match it.waits {
            None if !no_switches => *total,
            _ => total.checked_sub(it.total).and_then(|own| own.checked_add(it.execution)).unwrap_or(*total),
        });
        let executed: Vec<Time> = executed.collect();
        let times = taken.iter().map(|it| it.waits).reduce(|one, other| Some(one?.max(other?))).flatten();
        let greatest = taken.get(all.greatest_edge()).and_then(|it| self.switches_of(it));
        let waits = Some(Arc::new(Waits { executed: machine(&executed)?, times }));
        Ok(Machines { machine: all, waits, switches: greatest.unwrap_or_default() })
    }

    /// Returns the program of each edge at which the sum of `overhead` and of what the programs take is too long.
    fn too_long(&self, times: &[Option<TakenPaths>], overhead: Option<Time>) -> Vec<&'db ProgramId> {
        let behaviour = self.behaviour;
        // The error is none if a time is unknown.
        let add = |sum: Result<TakenPaths, Option<&'db ProgramId>>, index: usize| {
            let sum = sum?;
            let time = times.get(index).copied().flatten();
            let (program, time) = behaviour.programs.get(index).zip(time).ok_or(None)?;
            sum.then(time).ok_or(Some(&program.id))
        };
        let sums = behaviour.edges.sums(overhead.map(TakenPaths::executing).ok_or(None), add);
        sums.into_iter().filter_map(|sum| sum.err().flatten()).collect()
    }

    /// Evaluates the operations that these programs call, over others or directly: callees first, so that no chain of
    /// calls is ever followed down.
    fn operations_of(&mut self, used: &[bool]) {
        let behaviour = self.behaviour;
        if behaviour.operations.is_empty() {
            return;
        }
        let costs = behaviour.programs.iter().zip(used).filter(|(_, used)| **used);
        self.evaluate_operations(costs.flat_map(|(program, _)| program.cost.operations()).collect());
    }

    /// Evaluates these operations and those that they call.
    fn evaluate_operations(&mut self, needed: Vec<usize>) {
        let behaviour = self.behaviour;
        let called = |index: usize| behaviour.operations.get(index).map(|it| it.cost.operations());
        let needed: FxHashSet<usize> =
            closure(needed, |index| called(index).into_iter().flatten()).into_iter().collect();
        for &index in behaviour.order.iter().filter(|index| needed.contains(*index)) {
            if let Some(operation) = behaviour.operations.get(index) {
                self.operations[index] = self.program(operation);
            }
        }
    }

    fn refuse(&mut self, reason: Reason<'db>) {
        self.add(Refusal::new(reason, Location::name_of(self.component)));
    }

    /// Adds a refusal once: several edges may have one reason.
    fn add(&mut self, refusal: Refusal<'db>) {
        if !self.refusals.contains(&refusal) {
            self.refusals.push(refusal);
        }
    }

    /// Returns the time of a subject of the tables.
    fn time(&mut self, of: &Timed<'db>) -> Lookup<'db> {
        match (self.what_if)(of) {
            Some(time) => Lookup::Known(time),
            None => {
                self.is_extrapolated |= self.times.is_extrapolated(of, self.level);
                self.times.time(of, self.level)
            }
        }
    }

    /// Returns the time of a whole program in the tables.
    fn in_table(&mut self, program: &ProgramId) -> Lookup<'db> {
        self.time(&Timed::Program(self.component, program.in_table()))
    }

    fn program(&mut self, program: &TimedProgram<'db>) -> Option<TakenPaths> {
        match self.in_table(&program.id) {
            Lookup::Known(time) | Lookup::Assumed(time) => self.with_waits(time, &program.cost),
            Lookup::Absent => self.cost(&program.cost),
            Lookup::Unusable(why) => {
                self.refuse(Reason::Table(why));
                None
            }
        }
    }

    /// Returns what a program takes that executes for this time: its codels need no times, but they may wait.
    fn with_waits(&mut self, execution: Time, cost: &CostGraph<'db>) -> Option<TakenPaths> {
        let TakenPaths { wait, waits, .. } = self.waits_in(cost)?;
        let total = execution.checked_add(wait);
        if total.is_none() {
            self.refuse(Reason::TooLong(TooLong::Program));
        }
        Some(TakenPaths { execution, wait, total: total?, waits })
    }

    /// Returns the waits along the worst paths of a program.
    fn waits_in(&mut self, cost: &CostGraph<'db>) -> Option<TakenPaths> {
        self.folded(cost, &|evaluator, part| evaluator.wait_in(part))
    }

    /// Returns the waits in a part that has no parts.
    fn wait_in(&mut self, part: &Execution<'db>) -> Option<TakenPaths> {
        match part {
            Execution::Codel(codel) => self.wait(*codel),
            Execution::Operation(index) => {
                let taken = self.operations.get(*index).copied().flatten()?;
                Some(TakenPaths { execution: Time::ZERO, total: taken.wait, ..taken })
            }
            _ => Some(TakenPaths::NOTHING),
        }
    }

    /// Returns the wait of a call of a codel.
    fn wait(&mut self, codel: Decl<'db>) -> Option<TakenPaths> {
        match self.time(&Timed::Wait(codel)) {
            Lookup::Absent | Lookup::Known(Time::ZERO) => Some(TakenPaths::NOTHING),
            Lookup::Known(wait) | Lookup::Assumed(wait) => {
                Some(TakenPaths { execution: Time::ZERO, wait, total: wait, waits: self.times.waits(codel) })
            }
            Lookup::Unusable(why) => {
                self.add(Refusal::new(Reason::Table(why), Location::name_of(codel)));
                None
            }
        }
    }

    /// Returns what a read or a write of a port takes: nothing, unless a table says so.
    fn access(&mut self, port: &Name) -> Option<TakenPaths> {
        match self.time(&Timed::Access(self.component, port.clone())) {
            Lookup::Absent => Some(TakenPaths::NOTHING),
            Lookup::Known(time) | Lookup::Assumed(time) => Some(TakenPaths::executing(time)),
            Lookup::Unusable(why) => {
                self.refuse(Reason::Table(why));
                None
            }
        }
    }

    fn cost(&mut self, cost: &CostGraph<'db>) -> Option<TakenPaths> {
        self.folded(cost, &|evaluator, part| evaluator.part(part))
    }

    /// Returns what a part takes that has no parts.
    fn part(&mut self, part: &Execution<'db>) -> Option<TakenPaths> {
        match part {
            Execution::Codel(codel) => self.codel(*codel),
            Execution::Operation(index) => self.operations.get(*index).copied().flatten(),
            Execution::Access(port) => self.access(port),
            _ => Some(TakenPaths::NOTHING),
        }
    }

    /// Returns what a cost takes whose parts take what `of` returns. All parts are visited, so that all missing times are reported
    /// together.
    fn folded(&mut self, cost: &CostGraph<'db>, of: OfPart<'_, 'a, 'db>) -> Option<TakenPaths> {
        let mut is_too_long = false;
        let found = cost.folded(|part, known: &[Option<TakenPaths>]| {
            let known = |index: &u32| known.get(*index as usize).copied().flatten();
            match part {
                Cost::Sum(one, other) => {
                    let both = known(one).zip(known(other));
                    let sum = both.and_then(|(one, other)| one.then(other));
                    is_too_long |= both.is_some() && sum.is_none();
                    sum
                }
                Cost::Greatest(one, other) => Some(known(one)?.or(known(other)?)),
                Cost::Nothing => Some(TakenPaths::NOTHING),
                Cost::One(one) => of(self, one),
                Cost::Program(_, inner) | Cost::Operation(_, inner) => known(inner),
            }
        });
        if is_too_long {
            self.refuse(Reason::TooLong(TooLong::Program));
        }
        found.flatten()
    }

    fn codel(&mut self, codel: Decl<'db>) -> Option<TakenPaths> {
        if let Some(&taken) = self.codels.get(&codel) {
            return taken;
        }
        let (time, wait) = (self.look_up(codel), self.wait(codel));
        let taken = time.zip(wait).and_then(|(time, wait)| {
            let taken = TakenPaths::executing(time).then(wait);
            if taken.is_none() {
                self.refuse(Reason::TooLong(TooLong::Program));
            }
            taken
        });
        self.codels.insert(codel, taken);
        taken
    }

    fn look_up(&mut self, codel: Decl<'db>) -> Option<Time> {
        let name = codel.qualified(self.db);
        if let Some(time) = (self.what_if)(&Timed::Codel(codel)) {
            return Some(time);
        }
        self.is_extrapolated |= self.times.is_extrapolated(&Timed::Codel(codel), self.level);
        let refusal = |reason| Refusal::new(reason, Location::name_of(codel));
        match self.times.codel_time(self.db, codel, self.level) {
            Lookup::Known(time) => return Some(time),
            Lookup::Assumed(time) => {
                self.assumed.insert(name, time);
                return Some(time);
            }
            Lookup::Absent => _ = self.missing.insert(name, refusal(Reason::NoTime(codel))),
            Lookup::Unusable(why @ UnusableTime::OtherLevels(..)) => {
                self.missing.insert(name, refusal(Reason::Table(why)));
            }
            Lookup::Unusable(why) => self.add(refusal(Reason::Table(why))),
        }
        None
    }
}

/// The codels of one program of a component along its worst path, and its own operations, with their times, in the
/// order of execution: where the time of the program comes from. Empty where a table has that time. `program` is an index
/// of [`Psm::programs`].
pub fn worst_path<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    level: Level,
    program: usize,
) -> Vec<(String, Time)> {
    let project = tables.project(db);
    let Some(core) = core_of(db, project, component) else { return Vec::new() };
    let Ok(psm) = psm_of(db, tables, component, level) else { return Vec::new() };
    let (behaviour, times) = (behaviour_of(db, project, core), times_of(db, tables, component));
    let is_in_table =
        |it: &ProgramId| times.time(&Timed::Program(component, it.in_table()), level) != Lookup::Absent;
    if behaviour.programs.get(program).is_none_or(|it| is_in_table(&it.id)) {
        return Vec::new();
    }
    let mut evaluator = PsmEvaluator::new(db, component, behaviour, times, level, &|_| None);
    let product = product_of(db, project, core);
    let costs = evaluator.parts(&product.costs);
    let cost = |of: u32| costs.get(of as usize).copied().flatten();
    let Some(edge) = product.edges.get(psm.machine.greatest_edge()) else { return Vec::new() };
    // That of the program in the greatest edge, if it is there.
    let total = |it: u32| cost(it).map(|it| it.total);
    let executed = longest_of(&product.costs, &total, edge.cost).into_iter();
    let of_program = |index: u32| match product.costs.get(index as usize) {
        Some(Cost::Program(it, inner)) if *it == program => Some(*inner),
        _ => None,
    };
    let mut all = (0..product.costs.len() as u32).filter_map(of_program);
    let Some(inner) = executed.filter_map(of_program).next().or_else(|| all.next()) else {
        return Vec::new();
    };
    let execution = |it: u32| cost(it).map(|it| it.execution);
    let named = |index: u32| {
        let name = match product.costs.get(index as usize)? {
            Cost::One(Execution::Codel(codel)) => codel.qualified(db),
            Cost::One(Execution::Access(port)) => port.to_string(),
            Cost::One(Execution::Operation(index)) | Cost::Operation(index, _) => {
                psm.operations.get(*index)?.0.to_string()
            }
            _ => return None,
        };
        Some((name, execution(index)?))
    };
    longest_of(&product.costs, &execution, inner).into_iter().filter_map(named).collect()
}

/// Returns the entry of a table that the greatest time of a component is from: that of its longest program, or of the longest codel
/// in it. None where the time is assumed.
pub(crate) fn entry_of_greatest_time<'db>(
    db: &'db dyn ModelDb,
    tables: TableSet<'db>,
    component: Decl<'db>,
    level: Level,
) -> Option<Location<'db>> {
    let psm = psm_of(db, tables, component, level).as_ref().ok()?;
    let (times, project) = (timetable_of(db, tables), tables.project(db));
    let entry_of = |of: &Timed<'db>, key: &str| {
        let file = times.table_of(of)?;
        // A key may leave out the library.
        let is_it = |it: &&Entry| {
            key.strip_suffix(it.key.as_str()).is_some_and(|it| it.is_empty() || it.ends_with('.'))
        };
        let span = table(db, file).entries().find(is_it).map_or(0..0, |entry| entry.key_span.clone());
        Some(Location::of_span(file, &span))
    };
    let longest = psm.programs.iter().max_by_key(|(_, time)| *time)?.0.in_table();
    let key = format!("{}/{longest}", component.qualified(db));
    entry_of(&Timed::Program(component, longest), &key).or_else(|| {
        let core = core_of(db, project, component)?;
        let codels = uses_of(db, project, core).codels.iter().copied();
        let timed = codels.filter_map(|codel| match times.codel_time(db, codel, level) {
            Lookup::Known(time) => Some((time, codel.qualified(db), codel)),
            _ => None,
        });
        let (_, key, codel) = timed.max_by(|one, other| (one.0, &one.1).cmp(&(other.0, &other.1)))?;
        entry_of(&Timed::Codel(codel), &key)
    })
}

/// Returns the parts that an execution consists of along its longest path, in the order of execution: programs, or what one of these
/// does.
fn longest_of(parts: &[Cost<'_>], time: &dyn Fn(u32) -> Option<Time>, root: u32) -> Vec<u32> {
    let (mut found, mut open) = (Vec::new(), vec![root]);
    while let Some(index) = open.pop() {
        match parts.get(index as usize) {
            Some(Cost::Sum(one, other)) => open.extend([*other, *one]),
            Some(Cost::Greatest(one, other)) => {
                open.push(if time(*other) > time(*one) { *other } else { *one });
            }
            Some(_) => found.push(index),
            None => {}
        }
    }
    found
}
