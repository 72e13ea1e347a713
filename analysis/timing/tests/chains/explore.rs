//! Every schedule of a small system, with what has reached each variable and port.
//!
//! The world changes once, at any instant after all tasks began; all that is sampled from then on is new. The state holds what is new,
//! and for each state the most time since the change is kept: what follows from a state does not depend on this time. Statements take
//! no time. Those after a `Compute` are executed at the end of its time, or, if no write follows before the next one, when the job goes
//! on. The input of a task is empty when its first job starts, unless data releases it: it does so after the start of the job before,
//! or if some is left in the buffer at its end, at once, or a period after the last release. At one instant, statements on one CPU are
//! in order, and those of different CPUs in any order.

use std::collections::hash_map::Entry;

use mauve_timing::Needs;
use rustc_hash::FxHashMap;

use super::core::{Statement, VARIABLES};
use super::system::{System, Task};

/// What a value comes from, ascending.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
enum Value {
    /// A constant, or nothing.
    Constant,
    /// Sampled before the change.
    Old,
    /// Sampled after it.
    New,
}

const TASKS: usize = 4;
const MOST_BUFFERED: usize = 3;
const NONE: u8 = u8::MAX;

/// More are not explored.
const MOST_STATES: usize = 20_000;

#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
struct TaskState {
    /// The time until its next nominal release; with a trigger, until a period after the last one.
    until: u8,
    /// With a trigger, the time until a period after the release before the last one; 0 for one release in a period.
    older: u8,
    /// With a trigger: whether data arrived since the last job started, or is left in the buffer.
    has_data: bool,
    /// The same at the second port, if it has one.
    has_other: bool,
    /// If a nominal release was not a release yet, 1 more than the time until it must be; else 0.
    late: u8,
    /// The number of jobs that are released and have not ended.
    jobs: u8,
    state: u8,
    /// The edge of the current job, or [`NONE`].
    edge: u8,
    at: u8,
    /// The time of the statement that is left.
    left: u8,
    /// Whether it executed until this instant, to the end of a statement.
    is_ending: bool,
    /// Whether its first job has started.
    has_begun: bool,
    variables: [Value; VARIABLES],
}

/// The input of a task.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
struct Port {
    /// Those in the buffer, the oldest first.
    values: [Value; MOST_BUFFERED],
    /// Their number; of a register, 1 until it is read.
    length: u8,
    /// What was read last; of a register, what was written last.
    last: Value,
}

const EMPTY: Port = Port { values: [Value::Constant; MOST_BUFFERED], length: 0, last: Value::Constant };

#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
struct State {
    tasks: [TaskState; TASKS],
    ports: [Port; TASKS],
    /// What the last effect shows.
    shown: Value,
    is_changed: bool,
    /// Whether an effect has shown something new.
    is_seen: bool,
    /// The task of a job whose response is measured, and the number of its jobs that end before.
    measured: Option<(u8, u8)>,
}

/// Where a CPU is at an instant.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
enum Stage {
    Ending(usize),
    Choosing,
    Starting(usize),
    Executing(usize),
    Idle,
}

/// The greatest times that any schedule has.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Greatest {
    /// From the change to the first effect that shows it.
    pub(crate) reaction: u64,
    /// From the change to the last instant at which what is shown is older than it.
    pub(crate) age: u64,
    /// From the change to an effect that shows data from before it.
    pub(crate) age_at_write: u64,
}

/// Explores all schedules. No time is counted above `most`: it stands for all that are greater. `None` if they are too many.
pub(crate) fn explore(system: &System, most: u64) -> Option<Greatest> {
    all_schedules(system, most, false).map(|it| it.greatest)
}

/// The same for the response times of the tasks; the world does not change.
pub(crate) fn greatest_responses(system: &System, most: u64) -> Option<[u64; TASKS]> {
    all_schedules(system, most, true).map(|it| it.responses)
}

fn all_schedules(system: &System, most: u64, measures: bool) -> Option<Exploration<'_>> {
    let mut exploration = Exploration {
        system,
        most,
        measures,
        responses: [0; TASKS],
        greatest: Greatest::default(),
        known: FxHashMap::default(),
        open: Vec::new(),
        instants: FxHashMap::default(),
    };
    exploration.begin();
    while let Some(state) = exploration.open.pop() {
        if exploration.known.len() > if measures { MOST_STATES / 2 } else { MOST_STATES } {
            return None;
        }
        let time = exploration.known[&state];
        exploration.releases(state, 0, time);
    }
    Some(exploration)
}

struct Exploration<'a> {
    system: &'a System,
    most: u64,
    /// Whether each job is measured, in place of a change.
    measures: bool,
    responses: [u64; TASKS],
    greatest: Greatest,
    /// The most time since the change, by state.
    known: FxHashMap<State, u64>,
    open: Vec<State>,
    /// The same within the current instant.
    instants: FxHashMap<(State, [Stage; TASKS]), u64>,
}

impl Exploration<'_> {
    /// All phases of the clocks.
    fn begin(&mut self) {
        let task = TaskState {
            until: 0,
            older: 0,
            has_data: false,
            has_other: false,
            late: 0,
            jobs: 0,
            state: 0,
            edge: NONE,
            at: 0,
            left: 0,
            is_ending: false,
            has_begun: false,
            variables: [Value::Constant; VARIABLES],
        };
        let state = State {
            tasks: [task; TASKS],
            ports: [EMPTY; TASKS],
            shown: Value::Constant,
            is_changed: false,
            is_seen: false,
            measured: None,
        };
        let mut states = vec![state];
        for (place, task) in self.system.tasks.iter().enumerate() {
            let phases = task.offset.map_or(0..task.period, |offset| offset..offset + 1);
            let mate = self.mate(place);
            let phases = if task.trigger.is_some() || mate.is_some() { 0..1 } else { phases };
            let with = |state: &State, until: u8| {
                let mut state = *state;
                state.tasks[place].until = mate.map_or(until, |mate| state.tasks[mate].until);
                state
            };
            states = phases.flat_map(|until| states.iter().map(move |state| with(state, until))).collect();
            if self.measures && task.trigger.is_some() {
                // The first job may need no data.
                let mut first = states.clone();
                first.iter_mut().for_each(|state| {
                    let of = &mut state.tasks[place];
                    (of.has_data, of.has_other) = (true, true);
                });
                states.extend(first);
            }
        }
        for state in states {
            self.enter(state, 0);
        }
    }

    /// Returns the first task of the thread that executes this one; none if this one is the first, or has no thread.
    fn mate(&self, place: usize) -> Option<usize> {
        self.system.tasks[..place]
            .iter()
            .position(|it| it.is_in_thread && self.system.tasks[place].is_in_thread)
    }

    /// Enters a state between two instants.
    fn enter(&mut self, state: State, time: u64) {
        let time = time.min(self.most);
        if state.is_changed && state.shown != Value::New {
            self.greatest.age = self.greatest.age.max(time);
        }
        if state.is_changed && !state.is_seen {
            self.greatest.reaction = self.greatest.reaction.max(time);
        }
        match self.known.entry(state) {
            Entry::Occupied(known) if *known.get() >= time => {}
            entry => {
                entry.insert_entry(time);
                self.open.push(state);
            }
        }
    }

    /// Releases each task from `place` on that must or may be.
    fn releases(&mut self, mut state: State, place: usize, time: u64) {
        let Some(task) = self.system.tasks.get(place) else { return self.instant(state, time) };
        if let Some(mate) = self.mate(place) {
            let TaskState { until, late, .. } = state.tasks[mate];
            let of = &mut state.tasks[place];
            of.jobs = of.jobs.saturating_add(u8::from((of.until == 0 || of.late > 0) && late == 0));
            (of.until, of.late) = (until, late);
            return self.releases(state, place + 1, time);
        }
        let of = &mut state.tasks[place];
        let is_released = match task.trigger {
            Some(_) => trigger(of, task, self.needs(place)),
            None => of.until == 0,
        };
        if task.trigger.is_none() && is_released {
            of.until = task.period;
            of.late = task.jitter + 1;
        }
        for (state, time) in self.measured(state, place, is_released, time) {
            self.late_release(state, place, time);
        }
    }

    /// Returns a state, and the same where the job that is released now nominally is measured, each with its time.
    fn measured(&self, state: State, place: usize, is_released: bool, time: u64) -> Vec<(State, u64)> {
        let is_measured = self.measures && is_released && state.measured.is_none();
        let measured = State { measured: Some((place as u8, state.tasks[place].jobs)), ..state };
        [(state, time)].into_iter().chain(is_measured.then_some((measured, 0))).collect()
    }

    /// Releases a task now, or later within its jitter.
    fn late_release(&mut self, mut state: State, place: usize, time: u64) {
        let of = &mut state.tasks[place];
        if of.late > 1 {
            let mut later = state;
            later.tasks[place].late -= 1;
            self.releases(later, place + 1, time);
        }
        let of = &mut state.tasks[place];
        if of.late > 0 {
            // Of a task without a bound, releases beyond the last number are lost.
            (of.late, of.jobs) = (0, of.jobs.saturating_add(1));
        }
        self.releases(state, place + 1, time);
    }

    /// Executes the statements of an instant in all orders, and then for 1.
    fn instant(&mut self, state: State, time: u64) {
        let mut stages = [Stage::Idle; TASKS];
        for task in &self.system.tasks {
            stages[task.cpu] = Stage::Choosing;
        }
        for (place, task) in self.system.tasks.iter().enumerate() {
            if state.tasks[place].is_ending {
                stages[task.cpu] = Stage::Ending(place);
            }
        }
        self.instants.clear();
        let mut open = Vec::new();
        self.add(&mut open, state, stages, time);
        while let Some((state, stages)) = open.pop() {
            let time = self.instants[&(state, stages)];
            let next = |cpu: &usize| !matches!(stages[*cpu], Stage::Executing(_) | Stage::Idle);
            let mut cpus: Vec<usize> = (0..TASKS).filter(next).collect();
            // The order of what no other CPU sees does not matter.
            if let Some(first) = cpus.iter().find(|cpu| !self.is_seen_elsewhere(&state, **cpu, stages[**cpu]))
            {
                cpus = vec![*first];
            }
            cpus.iter().for_each(|cpu| self.step(&mut open, state, stages, *cpu, time));
            if cpus.is_empty() {
                self.execute(state, &stages, 0, time);
            }
        }
    }

    fn add(
        &mut self,
        open: &mut Vec<(State, [Stage; TASKS])>,
        state: State,
        stages: [Stage; TASKS],
        time: u64,
    ) {
        match self.instants.entry((state, stages)) {
            Entry::Occupied(known) if *known.get() >= time => {}
            entry => {
                entry.insert_entry(time);
                open.push((state, stages));
            }
        }
    }

    /// Whether the next statement of a CPU reads or writes a port between two CPUs, or another CPU may release a task on it.
    fn is_seen_elsewhere(&self, state: &State, cpu: usize, stage: Stage) -> bool {
        let of_chain = self.system.tasks[..self.system.chain].windows(2);
        let releases = |from: &Task, to: &Task| to.trigger.is_some() && to.cpu == cpu && from.cpu != cpu;
        let second = self.system.second.map(|(reader, _)| [self.system.chain, reader]);
        if of_chain.clone().any(|pair| releases(&pair[0], &pair[1]))
            || second.is_some_and(|pair| releases(&self.system.tasks[pair[0]], &self.system.tasks[pair[1]]))
        {
            return true;
        }
        let (Stage::Ending(place) | Stage::Starting(place)) = stage else { return false };
        let tasks =
            &self.system.tasks[..self.system.second.map_or(self.system.chain, |_| self.system.chain + 1)];
        let of = state.tasks[place];
        let edge = &self.system.tasks[place].core.edges[usize::from(of.edge)];
        let other = match edge.program.get(usize::from(of.at)) {
            Some(Statement::Read(_) | Statement::ReadOrSkip(_)) => place.checked_sub(1),
            Some(Statement::Write(_)) => Some(self.written(place)),
            _ => None,
        };
        place < tasks.len() && other.and_then(|it| tasks.get(it)).is_some_and(|it| it.cpu != tasks[place].cpu)
    }

    /// Lets the world change now, if it has not, and all tasks began. Changes after a sample, and before all others, are enough: a
    /// later one up to the next sample is seen as late as that.
    fn add_changed(&mut self, open: &mut Vec<(State, [Stage; TASKS])>, state: State, stages: [Stage; TASKS]) {
        let has_begun = state.tasks[..self.system.tasks.len()].iter().all(|task| task.has_begun);
        if !self.measures && !state.is_changed && has_begun {
            self.add(open, State { is_changed: true, ..state }, stages, 0);
        }
    }

    /// The next thing that happens on a CPU at an instant.
    fn step(
        &mut self,
        open: &mut Vec<(State, [Stage; TASKS])>,
        state: State,
        mut stages: [Stage; TASKS],
        cpu: usize,
        time: u64,
    ) {
        match stages[cpu] {
            Stage::Ending(place) => {
                let mut ended = state;
                let of = &mut ended.tasks[place];
                of.is_ending = false;
                let edge = &self.system.tasks[place].core.edges[usize::from(of.edge)];
                let rest = &edge.program[usize::from(of.at)..];
                if rest.is_empty() {
                    (of.state, of.edge, of.at) = (edge.target as u8, NONE, 0);
                    of.jobs -= 1;
                    match &mut ended.measured {
                        Some((task, 0)) if usize::from(*task) == place => {
                            self.responses[place] = self.responses[place].max(time);
                            return;
                        }
                        Some((task, before)) if usize::from(*task) == place => *before -= 1,
                        _ => {}
                    }
                    of.has_data |= self.system.tasks[place].buffer.is_some() && ended.ports[place].length > 0;
                }
                let is_timed = |statement: &Statement| matches!(statement, Statement::Compute(_));
                let has_write = |rest: &[Statement]| rest.iter().any(|it| matches!(it, Statement::Write(_)));
                let now = rest.iter().position(is_timed).unwrap_or(rest.len());
                if now > 0 {
                    self.statement(open, state, stages, place, time);
                }
                if now == 0 || now < rest.len() && !has_write(&rest[..now]) {
                    stages[cpu] = Stage::Choosing;
                    self.add_triggered(open, ended, stages, place, time);
                }
            }
            Stage::Choosing => {
                let system = self.system;
                let tasks = system.tasks.iter().enumerate();
                let is_ready =
                    |place: usize| state.tasks[place].jobs > 0 && !waits_for_thread(system, &state, place);
                let ready = || tasks.clone().filter(|(place, it)| it.cpu == cpu && is_ready(*place));
                let Some(highest) = ready().map(|(_, task)| task.priority).max() else {
                    stages[cpu] = Stage::Idle;
                    return self.add(open, state, stages, time);
                };
                for (place, task) in ready().filter(|(_, task)| task.priority == highest) {
                    stages[cpu] = Stage::Starting(place);
                    let of = state.tasks[place];
                    if of.edge != NONE {
                        self.add(open, state, stages, time);
                        continue;
                    }
                    let edges = task.core.edges.iter().enumerate();
                    for (edge, _) in edges.filter(|(_, edge)| edge.source == usize::from(of.state)) {
                        let mut started = state;
                        let of = &mut started.tasks[place];
                        (of.edge, of.at) = (edge as u8, 0);
                        (of.has_data, of.has_other) = (false, false);
                        if !std::mem::replace(&mut of.has_begun, true) {
                            if task.trigger.is_none() {
                                started.ports[place] = EMPTY;
                            }
                            self.add_changed(open, started, stages);
                        }
                        self.add(open, started, stages, time);
                    }
                }
            }
            Stage::Starting(place) => {
                let of = state.tasks[place];
                let program = &self.system.tasks[place].core.edges[usize::from(of.edge)].program;
                let Statement::Compute(cost) = program[usize::from(of.at)] else {
                    return self.statement(open, state, stages, place, time);
                };
                let mut state = state;
                if of.left == 0 {
                    state.tasks[place].left = cost;
                }
                stages[cpu] = Stage::Executing(place);
                self.add(open, state, stages, time);
            }
            Stage::Executing(_) | Stage::Idle => {}
        }
    }

    /// Executes a statement that takes no time.
    fn statement(
        &mut self,
        open: &mut Vec<(State, [Stage; TASKS])>,
        mut state: State,
        stages: [Stage; TASKS],
        place: usize,
        time: u64,
    ) {
        let task = &self.system.tasks[place];
        let program = &task.core.edges[usize::from(state.tasks[place].edge)].program;
        let statement = program[usize::from(state.tasks[place].at)];
        state.tasks[place].at += 1;
        match statement {
            Statement::Compute(_) => unreachable!("it takes time"),
            Statement::Move(from, to) => {
                let variables = &mut state.tasks[place].variables;
                variables[to] = variables[from];
            }
            Statement::Merge(from, to) => {
                let variables = &mut state.tasks[place].variables;
                variables[to] = variables[to].max(variables[from]);
            }
            Statement::Clear(variable) => state.tasks[place].variables[variable] = Value::Constant,
            Statement::Write(variable) => {
                let value = state.tasks[place].variables[variable];
                self.write(&mut state, place, value, time);
                // Nothing older is left anywhere.
                if state.is_seen && !has_older(&state, self.system) {
                    return;
                }
                return self.add_triggered(open, state, stages, self.written(place), time);
            }
            Statement::Read(variable) | Statement::ReadOrSkip(variable) => {
                if place <= self.system.first {
                    let now = match (state.is_changed, self.measures) {
                        (_, true) => Value::Constant,
                        (true, _) => Value::New,
                        (false, _) => Value::Old,
                    };
                    state.tasks[place].variables[variable] = now;
                    if place == self.system.first {
                        self.add_changed(open, state, stages);
                    }
                } else {
                    let (value, is_new) = read(&mut state.ports[place], task.buffer.is_some());
                    state.tasks[place].variables[variable] = value;
                    if !is_new && matches!(statement, Statement::ReadOrSkip(_)) {
                        state.tasks[place].at = program.len() as u8 - 1;
                    }
                }
            }
        }
        self.add(open, state, stages, time);
    }

    /// Adds a state, with the release of the task at `place` if its data releases it now.
    fn add_triggered(
        &mut self,
        open: &mut Vec<(State, [Stage; TASKS])>,
        mut state: State,
        mut stages: [Stage; TASKS],
        place: usize,
        time: u64,
    ) {
        let task = self.system.tasks.get(place).filter(|task| task.trigger.is_some());
        let Some(task) = task.filter(|task| trigger(&mut state.tasks[place], task, self.needs(place))) else {
            return self.add(open, state, stages, time);
        };
        let (jitter, before) = (task.jitter, stages);
        if !matches!(stages[task.cpu], Stage::Ending(_)) {
            stages[task.cpu] = Stage::Choosing;
        }
        for (mut state, time) in self.measured(state, place, true, time) {
            if jitter > 0 {
                let mut later = state;
                later.tasks[place].late -= 1;
                self.add(open, later, before, time);
            }
            let of = &mut state.tasks[place];
            // Of a task without a bound, releases beyond the last number are lost.
            (of.late, of.jobs) = (0, of.jobs.saturating_add(1));
            self.add(open, state, stages, time);
        }
    }

    /// Returns what releases a task with two ports.
    fn needs(&self, place: usize) -> Option<Needs> {
        self.system.second.filter(|(reader, _)| *reader == place).map(|(_, needs)| needs)
    }

    /// Returns the task that reads what this one writes; of the last one in the chain, one that does not read it.
    fn written(&self, place: usize) -> usize {
        let second = self.system.second.filter(|_| place == self.system.chain);
        second.map_or(place + 1, |(reader, _)| reader)
    }

    fn write(&mut self, state: &mut State, place: usize, value: Value, time: u64) {
        if place + 1 < self.system.chain {
            let size = self.system.tasks[place + 1].buffer;
            state.tasks[place + 1].has_data = self.system.tasks[place + 1].trigger.is_some();
            return write(&mut state.ports[place + 1], size, value);
        }
        if place >= self.system.chain {
            if let Some((reader, _)) = self.system.second.filter(|_| place == self.system.chain) {
                state.tasks[reader].has_other = true;
            }
            return;
        }
        state.shown = value;
        if state.is_changed && value == Value::Old {
            self.greatest.age_at_write = self.greatest.age_at_write.max(time);
        }
        state.is_seen |= value == Value::New;
    }

    /// Executes what the CPUs from `cpu` on chose for 1.
    fn execute(&mut self, mut state: State, stages: &[Stage; TASKS], cpu: usize, time: u64) {
        let Some(stage) = stages.get(cpu) else {
            for (place, _) in self.system.tasks.iter().enumerate() {
                let of = &mut state.tasks[place];
                (of.until, of.older) = (of.until.saturating_sub(1), of.older.saturating_sub(1));
            }
            return self
                .enter(state, if state.is_changed || state.measured.is_some() { time + 1 } else { 0 });
        };
        if let Stage::Executing(place) = *stage {
            let of = &mut state.tasks[place];
            of.left -= 1;
            if self.system.is_early && of.left > 0 {
                self.execute(state, stages, cpu + 1, time);
                state.tasks[place].left = 0;
            }
            let of = &mut state.tasks[place];
            if of.left == 0 {
                (of.at, of.is_ending) = (of.at + 1, true);
            }
        }
        self.execute(state, stages, cpu + 1, time);
    }
}

/// Whether the thread of a task has jobs that it executes before those of this one.
fn waits_for_thread(system: &System, state: &State, place: usize) -> bool {
    let jobs = |mate: usize| state.tasks[mate].jobs;
    let is_before = |mate: usize| {
        jobs(mate) > jobs(place) || jobs(mate) == jobs(place) && (mate < place) != system.is_reversed
    };
    let mut mates = (0..system.tasks.len()).filter(|it| *it != place && system.tasks[*it].is_in_thread);
    system.tasks[place].is_in_thread && mates.any(is_before)
}

/// Lets data release a task nominally, if it may be now.
fn trigger(of: &mut TaskState, task: &Task, needs: Option<Needs>) -> bool {
    let has_data = match needs {
        None => of.has_data,
        Some(Needs::Any | Needs::Each) => of.has_data || of.has_other,
        Some(Needs::All) => of.has_data && of.has_other,
    };
    let is_early = if task.trigger == Some(2) { of.older > 0 } else { of.until > 0 };
    let has_started = of.late == 0 && of.jobs == u8::from(of.edge != NONE);
    if !has_data || is_early || !has_started {
        return false;
    }
    of.older = if task.trigger == Some(2) { of.until } else { 0 };
    (of.until, of.late) = (task.period, task.jitter + 1);
    true
}

/// Returns what is read from a port, and whether it is new data.
fn read(port: &mut Port, is_buffer: bool) -> (Value, bool) {
    if port.length == 0 {
        return (port.last, false);
    }
    if is_buffer {
        port.last = std::mem::replace(&mut port.values[0], Value::Constant);
        port.values.rotate_left(1);
    }
    port.length -= 1;
    (port.last, true)
}

/// Writes to a port: to a register, or to a buffer of this size, from which it drops the oldest value if it is full.
fn write(port: &mut Port, buffer: Option<u8>, value: Value) {
    match buffer {
        Some(size) if port.length >= size => {
            port.values[..usize::from(size)].rotate_left(1);
            port.values[usize::from(size) - 1] = value;
        }
        Some(_) => {
            port.values[usize::from(port.length)] = value;
            port.length += 1;
        }
        None => (port.last, port.length) = (value, 1),
    }
}

fn has_older(state: &State, system: &System) -> bool {
    let (chain, is_buffer) = (system.chain, |place: usize| system.tasks[place].buffer.is_some());
    let first = system.first;
    let in_variables =
        state.tasks[first..chain].iter().any(|task| task.variables.iter().any(|it| *it != Value::New));
    let of_port = |(place, port): (usize, &Port)| {
        let buffered = if is_buffer(place) { usize::from(port.length) } else { 0 };
        port.last != Value::New || port.values[..buffered].iter().any(|it| *it != Value::New)
    };
    let in_ports = state.ports[..chain].iter().enumerate().skip(first + 1).any(of_port);
    state.shown != Value::New || in_variables || in_ports
}
