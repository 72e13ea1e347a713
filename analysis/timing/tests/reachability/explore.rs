//! Every schedule of a small system, one nanosecond after the other.
//!
//! A state of the system holds, for each task, the time to its next nominal release, the state of its machine, how many
//! jobs have not ended, and how much of the executing one remains; for each operation, how many calls wait and how many
//! the client's job may still send. Of a task that is released at any distance, it holds the ages of its last jobs. A thread of several
//! tasks executes one job of each in turn. All initial states of the machines are starts, and all instants of each clock; tasks with an
//! offset share a clock.

use std::collections::VecDeque;
use std::fmt::Write;

use rustc_hash::FxHashMap;

use super::scheduler::Scheduler;
use super::suspended;
use super::system::{Calls, System};

/// A system with more states than this is dropped.
pub(crate) const MOST_STATES: usize = 30_000;

/// The most unended jobs of a task without a bound: releases beyond them are lost, and the task is ready all the same.
pub(crate) const MOST_UNENDED: u8 = 3;

pub(crate) const TASKS: usize = 4;

/// The most ages of jobs, of a task that is released at any distance.
const AGES: usize = 4;

/// No job, or one that no more matters.
const NO_AGE: u8 = 63;
pub(crate) const OPERATIONS: usize = 2;

#[derive(Clone, Copy, PartialEq, Default)]
struct TaskState {
    /// The time to the next nominal release; 0 just before it. 5 bits.
    to_release: u8,
    /// Of the machine, after the edge of the job that executes. 2 bits.
    machine: u8,
    /// Nominally released and not ended. 4 bits.
    jobs: u8,
    /// Whether the first of them is released. It may be late by the jitter, and those behind it wait for it in any case.
    is_released: bool,
    /// What the job or call that executes has still to execute; 0 if none has begun. 6 bits.
    remaining: u8,
    /// Whether it is a call, executed between two jobs.
    is_call: bool,
    /// Of a task that is released at any distance: the time since its last nominal releases, the last one first. 6 bits each.
    ages: [u8; AGES],
}

#[derive(Clone, Copy, PartialEq, Default)]
struct OperationState {
    /// Sent, and not begun by the provider. 4 bits.
    waiting: u8,
    /// How many more the executing job of the client may send. 2 bits.
    unsent: u8,
}

#[derive(Clone, Copy, PartialEq, Default)]
struct State {
    tasks: [TaskState; TASKS],
    operations: [OperationState; OPERATIONS],
}

impl State {
    /// Returns the state as a number; `None` if a counter is too great for it.
    fn pack(&self, tasks: &[ExploredTask], operations: usize) -> Option<u128> {
        let mut packed: u128 = 0;
        for (task, of) in self.tasks.iter().zip(tasks) {
            if task.to_release >= 32 || task.machine >= 4 || task.jobs >= 16 || task.remaining >= 64 {
                return None;
            }
            let bits = u32::from(task.to_release) << 14
                | u32::from(task.machine) << 12
                | u32::from(task.jobs) << 8
                | u32::from(task.remaining) << 2
                | u32::from(task.is_released) << 1
                | u32::from(task.is_call);
            packed = packed << 19 | u128::from(bits);
            for age in task.ages.iter().filter(|_| of.burst.is_some()) {
                packed = packed << 6 | u128::from(*age);
            }
        }
        for operation in &self.operations[..operations] {
            if operation.waiting >= 16 || operation.unsent >= 4 {
                return None;
            }
            packed = packed << 6 | u128::from(operation.waiting << 2 | operation.unsent);
        }
        Some(packed)
    }

    fn unpack(mut packed: u128, tasks: &[ExploredTask], operations: usize) -> State {
        let mut state = State::default();
        for operation in state.operations[..operations].iter_mut().rev() {
            *operation = OperationState { waiting: packed as u8 >> 2 & 15, unsent: packed as u8 & 3 };
            packed >>= 6;
        }
        for (task, of) in state.tasks[..tasks.len()].iter_mut().zip(tasks).rev() {
            let mut ages = [0; AGES];
            for age in ages.iter_mut().rev().filter(|_| of.burst.is_some()) {
                *age = packed as u8 & 63;
                packed >>= 6;
            }
            let bits = packed as u32;
            *task = TaskState {
                to_release: (bits >> 14 & 31) as u8,
                machine: (bits >> 12 & 3) as u8,
                jobs: (bits >> 8 & 15) as u8,
                remaining: (bits >> 2 & 63) as u8,
                is_released: bits >> 1 & 1 == 1,
                is_call: bits & 1 == 1,
                ages,
            };
            packed >>= 19;
        }
        state
    }
}

/// The result of an exploration.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Outcome {
    /// The greatest response time of each task that has a limit.
    Greatest(Vec<Option<u64>>),
    /// A job of this task has not ended after its limit.
    Above {
        /// The index of the task.
        task: usize,
    },
    /// There are more than [`MOST_STATES`] states.
    TooManyStates,
    /// A counter of a state is too great to be stored: of waiting calls, of unended jobs, or of the remaining time.
    TooLarge,
}

/// Explores every schedule of a system until a job takes longer than the limit of its task. A task without a limit may
/// take any time.
pub(crate) fn explore(system: &System, limits: &[Option<u64>]) -> Outcome {
    if system.has_waits_or_locks() {
        return suspended::explore(system, limits);
    }
    Exploration::new(&Model::new(system, limits)).run()
}

/// Returns the greatest response time of each task. Panics if they cannot be found.
pub(crate) fn greatest_responses(system: &System) -> Vec<u64> {
    let limits: Vec<_> = system.tasks.iter().map(|task| Some(14 * task.period)).collect();
    match explore(system, &limits) {
        Outcome::Greatest(greatest) => greatest.into_iter().flatten().collect(),
        outcome => panic!("{outcome:?}"),
    }
}

/// Returns a shortest schedule in which a job takes longer than the limit of its task, one line for each nanosecond.
pub(crate) fn schedule_above(system: &System, limits: &[Option<u64>]) -> String {
    if system.has_waits_or_locks() {
        return suspended::schedule_above(system, limits);
    }
    let model = Model::new(system, limits);
    let mut exploration = Exploration::new(&model);
    exploration.before = Some(FxHashMap::default());
    let outcome = exploration.run();
    let mut states = Vec::new();
    let mut last = exploration.expanded;
    while let Some(packed) = last {
        states.push(packed);
        last = exploration.before.as_ref().and_then(|before| before.get(&packed).copied());
    }
    let mut text = format!("{outcome:?} in the nanosecond after the last of these states:\n");
    for (time, &packed) in states.iter().rev().enumerate() {
        let state = State::unpack(packed, &model.tasks, system.operations.len());
        let _ = write!(text, "{time:4}");
        for task in &state.tasks[..system.tasks.len()] {
            let executes = match (task.remaining, task.is_call) {
                (0, _) => String::new(),
                (remaining, true) => format!(", a call for {remaining}"),
                (remaining, false) => format!(", one for {remaining}"),
            };
            let _ = write!(text, " | release in {}, {} jobs{executes}", task.to_release, task.jobs);
        }
        for operation in &state.operations[..system.operations.len()] {
            let _ = write!(text, " | {} calls wait, {} to send", operation.waiting, operation.unsent);
        }
        text.push('\n');
    }
    text
}

/// The states that were reached: a hash table with linear probing, which is faster than that of the standard library
/// where neither is optimised.
pub(crate) struct Seen {
    /// Each state plus 1; 0 where there is none.
    slots: Vec<u128>,
    pub(crate) count: usize,
}

impl Seen {
    pub(crate) fn new() -> Seen {
        Seen { slots: vec![0; 1 << 8], count: 0 }
    }

    /// Adds a state, and returns whether it is new.
    pub(crate) fn insert(&mut self, packed: u128) -> bool {
        if self.count * 2 >= self.slots.len() {
            let larger = vec![0; self.slots.len() * 4];
            for slot in std::mem::replace(&mut self.slots, larger) {
                if slot != 0 {
                    let (place, _) = self.find(slot);
                    self.slots[place] = slot;
                }
            }
        }
        let (place, is_new) = self.find(packed + 1);
        self.slots[place] = packed + 1;
        self.count += usize::from(is_new);
        is_new
    }

    /// Returns the place of a slot's value, and whether it is empty.
    fn find(&self, value: u128) -> (usize, bool) {
        // Tasks that are alike must not cancel each other.
        let high = ((value >> 64) as u64).rotate_left(23);
        let folded = (value as u64 ^ high).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut place = (folded >> 32) as usize & (self.slots.len() - 1);
        loop {
            let slot = self.slots[place];
            if slot == value || slot == 0 {
                return (place, slot == 0);
            }
            place = (place + 1) & (self.slots.len() - 1);
        }
    }
}

/// A task, as the exploration reads it.
struct ExploredTask {
    period: u8,
    jitter: u64,
    /// For a task that is released at any distance.
    burst: Option<usize>,
    limit: Option<u64>,
    /// (target, execution time) by state.
    successors: Vec<Vec<(u8, u8)>>,
}

/// A system, as the exploration reads it.
struct Model<'a> {
    system: &'a System,
    tasks: Vec<ExploredTask>,
    /// The tasks of each thread, in their order.
    threads: Vec<Vec<usize>>,
    scheduler: Scheduler,
}

impl<'a> Model<'a> {
    fn new(system: &'a System, limits: &[Option<u64>]) -> Model<'a> {
        assert!(system.tasks.len() <= TASKS && system.operations.len() <= OPERATIONS);
        let explored = system.tasks.iter().zip(limits).enumerate().map(|(place, (task, &limit))| {
            let mut successors = vec![Vec::new(); task.states() as usize];
            for &(source, target, cost) in &task.edges {
                successors[source as usize].push((target as u8, u8::try_from(cost).unwrap()));
            }
            let period = u8::try_from(task.period).unwrap();
            let jitter = if system.is_first_of_thread(place) { task.jitter } else { 0 };
            let burst = task.burst.map(|burst| burst as usize);
            ExploredTask { period, jitter, burst, limit, successors }
        });
        let tasks: Vec<_> = explored.collect();
        let sporadic = tasks.iter().filter(|it| it.burst.is_some_and(|burst| burst <= AGES)).count();
        assert!(tasks.len() * 19 + sporadic * 6 * AGES + system.operations.len() * 6 < 128);
        Model { system, tasks, threads: system.threads(), scheduler: Scheduler::new(system) }
    }

    /// Whether `task` may begin its next job, in the order of its thread.
    fn is_turn(&self, state: &State, task: usize) -> bool {
        let is_it = |thread: &&Vec<usize>| thread.len() > 1 && thread.contains(&task);
        let Some(thread) = self.threads.iter().find(is_it) else { return true };
        let jobs = |place: usize| state.tasks[thread[place]].jobs;
        match thread.iter().position(|&it| it == task).unwrap() {
            0 => jobs(0) == jobs(thread.len() - 1),
            place => jobs(place - 1) < jobs(place),
        }
    }

    /// Returns the sets of tasks that are ready: of each thread one, which goes on or begins something.
    fn ready(&self, state: &State) -> Vec<u8> {
        let mut sets = vec![0];
        for thread in &self.threads {
            let goes_on = thread.iter().copied().find(|&task| state.tasks[task].remaining > 0);
            let begins = |&task: &usize| match goes_on {
                Some(other) => other == task,
                None => {
                    state.tasks[task].is_released && self.is_turn(state, task)
                        || self.has_call_between_jobs(state, task)
                }
            };
            let ready: Vec<u8> = thread.iter().copied().filter(begins).map(|task| 1 << task).collect();
            if !ready.is_empty() {
                sets = sets.iter().flat_map(|set| ready.iter().map(move |task| set | task)).collect();
            }
        }
        sets
    }

    fn serves(&self, provider: usize, operation: usize) -> bool {
        self.system.operations[operation].provider == provider
    }

    /// Whether `task` may execute a call that waits before its next job begins.
    fn has_call_between_jobs(&self, state: &State, task: usize) -> bool {
        self.system.calls == Calls::BetweenPeriods
            && (0..self.system.operations.len())
                .any(|operation| state.operations[operation].waiting > 0 && self.serves(task, operation))
    }
}

struct Exploration<'a> {
    model: &'a Model<'a>,
    seen: Seen,
    open: VecDeque<u128>,
    /// The states after the one that is expanded.
    next: Vec<State>,
    greatest: Vec<u64>,
    /// For a schedule, the state before each state; the states are then expanded in the order of their distance.
    before: Option<FxHashMap<u128, u128>>,
    expanded: Option<u128>,
}

/// An early end of the exploration.
type Step = Result<(), Outcome>;

impl<'a> Exploration<'a> {
    fn new(model: &'a Model<'a>) -> Exploration<'a> {
        Exploration {
            model,
            seen: Seen::new(),
            open: VecDeque::new(),
            next: Vec::new(),
            greatest: vec![0; model.tasks.len()],
            before: None,
            expanded: None,
        }
    }

    fn run(&mut self) -> Outcome {
        match self.expand_all() {
            Ok(()) => {
                let limits = self.model.tasks.iter().map(|task| task.limit);
                Outcome::Greatest(
                    limits.zip(&self.greatest).map(|(limit, &greatest)| limit.map(|_| greatest)).collect(),
                )
            }
            Err(outcome) => outcome,
        }
    }

    fn expand_all(&mut self) -> Step {
        let phases = |place: usize| match self.model.tasks[place].burst {
            None if self.model.system.is_first_of_thread(place) => self.model.tasks[place].period,
            _ => 1,
        };
        let tasks = self.model.tasks.iter().enumerate();
        let starts = tasks.map(|(place, task)| usize::from(phases(place)) * task.successors.len());
        if starts.product::<usize>() > MOST_STATES {
            return Err(Outcome::TooManyStates);
        }
        // Each instant of the clocks that tasks with an offset share, from some on more than once.
        let with_offset = self.model.system.tasks.iter().filter(|task| task.offset.is_some());
        let [first, second] = [0, 1].map(|clock| {
            with_offset.clone().filter(|task| task.clock == clock).map(|task| task.period).product::<u64>()
        });
        for now in (0..first).flat_map(|one| (0..second).map(move |other| [one, other])) {
            self.start(State::default(), 0, now)?;
        }
        let (tasks, operations) = (&self.model.tasks, self.model.system.operations.len());
        loop {
            let next = if self.before.is_some() { self.open.pop_front() } else { self.open.pop_back() };
            let Some(packed) = next else { return Ok(()) };
            self.expanded = Some(packed);
            self.expand(State::unpack(packed, tasks, operations))?;
        }
    }

    /// Adds every phase and initial state of `place` and the tasks after it. The clocks of the tasks with an offset show `now`.
    fn start(&mut self, mut state: State, place: usize, now: [u64; 2]) -> Step {
        let Some(task) = self.model.tasks.get(place) else { return self.reach(&state) };
        let offset = self.model.system.tasks[place].offset;
        let thread = self.model.threads.iter().find(|thread| thread.contains(&place)).unwrap();
        for to_release in 0..if task.burst.is_some() { 1 } else { task.period } {
            let release = now[self.model.system.tasks[place].clock] + u64::from(to_release);
            if offset.is_some_and(|offset| release % u64::from(task.period) != offset) {
                continue;
            }
            if thread[0] != place && state.tasks[thread[0]].to_release != to_release {
                continue;
            }
            for machine in 0..task.successors.len() as u8 {
                let ages = if task.burst.is_some() { [NO_AGE; AGES] } else { [0; AGES] };
                state.tasks[place] = TaskState { to_release, machine, ages, ..TaskState::default() };
                self.start(state, place + 1, now)?;
            }
        }
        Ok(())
    }

    fn reach(&mut self, state: &State) -> Step {
        let packed = state.pack(&self.model.tasks, self.model.system.operations.len());
        let packed = packed.ok_or(Outcome::TooLarge)?;
        if self.seen.insert(packed) {
            if self.seen.count > MOST_STATES {
                return Err(Outcome::TooManyStates);
            }
            if let (Some(before), Some(expanded)) = (&mut self.before, self.expanded) {
                before.insert(packed, expanded);
            }
            self.open.push_back(packed);
        }
        Ok(())
    }

    /// Reaches the states after a state. Where there is one and no release is due, follows it without storing it.
    fn expand(&mut self, mut state: State) -> Step {
        loop {
            self.next.clear();
            self.nominal_releases(state)?;
            let tasks = self.model.tasks.len();
            match self.next[..] {
                [only] if self.before.is_none() && only.tasks[..tasks].iter().all(|it| it.to_release > 0) => {
                    state = only;
                }
                _ => break,
            }
        }
        let next = std::mem::take(&mut self.next);
        for state in &next {
            self.reach(state)?;
        }
        self.next = next;
        Ok(())
    }

    fn nominal_releases(&mut self, mut state: State) -> Step {
        let model = self.model;
        for thread in &model.threads {
            let is_full = |&place: &usize| {
                model.tasks[place].limit.is_none() && state.tasks[place].jobs >= MOST_UNENDED
            };
            let is_lost = thread.iter().any(is_full);
            for &place in thread {
                let (task, now) = (&model.tasks[place], &mut state.tasks[place]);
                if let Some(burst) = task.burst {
                    for (index, age) in now.ages.iter_mut().enumerate() {
                        // At the end of this nanosecond. That of a job that has ended matters up to a period.
                        let is_open = index < usize::from(now.jobs);
                        *age = (*age + 1).min(NO_AGE);
                        if is_open && *age == NO_AGE && task.limit.is_some() {
                            return Err(Outcome::TooLarge);
                        }
                        if !is_open && (*age > task.period || index >= burst) {
                            *age = NO_AGE;
                        }
                    }
                    continue;
                }
                if now.to_release == 0 {
                    now.jobs += u8::from(!is_lost);
                    now.to_release = task.period;
                }
                now.to_release -= 1;
            }
        }
        self.sporadic_releases(state, 0)
    }

    /// Tasks that are released at any distance are released now, or not.
    fn sporadic_releases(&mut self, mut state: State, place: usize) -> Step {
        let is_any = |place: &usize| self.model.tasks[*place].burst.is_some();
        let Some(place) = (place..self.model.tasks.len()).find(is_any) else {
            return self.releases(state, 0);
        };
        self.sporadic_releases(state, place + 1)?;
        let task = &self.model.tasks[place];
        let now = &mut state.tasks[place];
        let burst = task.burst.unwrap_or(1);
        if now.ages[burst - 1] <= task.period || task.limit.is_none() && now.jobs >= MOST_UNENDED {
            return Ok(());
        }
        if usize::from(now.jobs) == AGES {
            return Err(Outcome::TooLarge);
        }
        now.ages.rotate_right(1);
        now.ages[0] = 1;
        now.jobs += 1;
        self.sporadic_releases(state, place)
    }

    /// The first jobs that have not ended are released, now or later, and at the end of their jitter now.
    fn releases(&mut self, mut state: State, place: usize) -> Step {
        for (place, task) in self.model.tasks.iter().enumerate().skip(place) {
            let now = &mut state.tasks[place];
            if now.jobs == 0 || now.is_released {
                continue;
            }
            if age(now, task) - 1 < task.jitter {
                let later = state;
                self.releases(later, place + 1)?;
            }
            state.tasks[place].is_released = true;
        }
        self.schedule(&state)
    }

    /// Executes any set of ready tasks that the scheduler allows.
    fn schedule(&mut self, state: &State) -> Step {
        let model = self.model;
        for ready in model.ready(state) {
            for &executing in model.scheduler.choices(ready) {
                self.begin(*state, executing, 0, 0)?;
            }
        }
        Ok(())
    }

    /// The tasks from `place` on that execute begin a job or a call if none has begun; those in `begun` began a job.
    fn begin(&mut self, state: State, executing: u8, place: usize, begun: u8) -> Step {
        let model = self.model;
        let tasks = model.tasks.len();
        let idle = |place: &usize| executing >> place & 1 == 1 && state.tasks[*place].remaining == 0;
        let Some(place) = (place..tasks).find(idle) else {
            return self.send(state, executing, begun, 0, true);
        };
        let now = state.tasks[place];
        if now.is_released && model.is_turn(&state, place) {
            for &(target, cost) in &model.tasks[place].successors[usize::from(now.machine)] {
                let mut state = state;
                state.tasks[place].machine = target;
                state.tasks[place].remaining = cost;
                for (operation, served) in model.system.operations.iter().enumerate() {
                    if served.client == place {
                        state.operations[operation].unsent = served.sends as u8;
                    }
                }
                self.begin(state, executing, place + 1, begun | 1 << place)?;
            }
        }
        if model.has_call_between_jobs(&state, place) {
            for (operation, served) in model.system.operations.iter().enumerate() {
                if served.provider == place && state.operations[operation].waiting > 0 {
                    let mut state = state;
                    state.operations[operation].waiting -= 1;
                    state.tasks[place].remaining = served.time as u8;
                    state.tasks[place].is_call = true;
                    self.begin(state, executing, place + 1, begun)?;
                }
            }
        }
        Ok(())
    }

    /// The jobs of the clients send any number of calls, before (`is_before`) or after the nanosecond.
    fn send(&mut self, state: State, executing: u8, begun: u8, operation: usize, is_before: bool) -> Step {
        let model = self.model;
        let Some(served) = model.system.operations.get(operation) else {
            return if is_before {
                self.receive(state, executing, begun)
            } else {
                self.pass(state, executing)
            };
        };
        // What a job sends before any nanosecond but its first, it sends after the one before.
        let senders = if is_before { begun } else { executing };
        let mut state = state;
        self.send(state, executing, begun, operation + 1, is_before)?;
        if senders >> served.client & 1 == 1 && !state.tasks[served.client].is_call {
            while state.operations[operation].unsent > 0 {
                state.operations[operation].unsent -= 1;
                state.operations[operation].waiting += 1;
                self.send(state, executing, begun, operation + 1, is_before)?;
            }
        }
        Ok(())
    }

    /// A job that begins executes all calls that wait, then its edge.
    fn receive(&mut self, mut state: State, executing: u8, begun: u8) -> Step {
        for (operation, served) in self.model.system.operations.iter().enumerate() {
            if begun >> served.provider & 1 == 1 {
                let waiting = std::mem::take(&mut state.operations[operation].waiting);
                let calls = u64::from(waiting) * served.time;
                let remaining = &mut state.tasks[served.provider].remaining;
                *remaining = u8::try_from(u64::from(*remaining) + calls).map_err(|_| Outcome::TooLarge)?;
            }
        }
        self.execute(state, executing, 0)
    }

    fn execute(&mut self, mut state: State, executing: u8, place: usize) -> Step {
        for place in place..self.model.tasks.len() {
            if executing >> place & 1 == 0 {
                continue;
            }
            state.tasks[place].remaining -= 1;
            if state.tasks[place].remaining > 0 && self.model.system.jobs_may_end_early {
                let mut ended = state;
                ended.tasks[place].remaining = 0;
                self.execute(ended, executing, place + 1)?;
            }
        }
        self.send(state, executing, 0, 0, false)
    }

    /// The end of the nanosecond: what has no more to execute ends.
    fn pass(&mut self, mut state: State, executing: u8) -> Step {
        for (place, task) in self.model.tasks.iter().enumerate() {
            let now = &mut state.tasks[place];
            let has_ended = executing >> place & 1 == 1 && now.remaining == 0;
            if now.jobs > 0
                && let Some(limit) = task.limit
            {
                let age = age(now, task);
                let is_end = has_ended && !now.is_call;
                if age > limit || age == limit && !is_end {
                    return Err(Outcome::Above { task: place });
                }
                if is_end {
                    self.greatest[place] = self.greatest[place].max(age);
                }
            }
            if !has_ended {
                continue;
            }
            if !std::mem::take(&mut now.is_call) {
                now.jobs -= 1;
                now.is_released = false;
                for (operation, served) in self.model.system.operations.iter().enumerate() {
                    if served.client == place {
                        state.operations[operation].unsent = 0;
                    }
                }
            }
        }
        self.next.push(state);
        Ok(())
    }
}

/// Returns the time from the nominal release of the first unended job to the end of this nanosecond.
fn age(now: &TaskState, task: &ExploredTask) -> u64 {
    if task.burst.is_some() {
        return u64::from(now.ages[usize::from(now.jobs) - 1]);
    }
    // The last one was released at the latest nominal release, and each before it a period earlier.
    u64::from(task.period) - u64::from(now.to_release) + u64::from(now.jobs - 1) * u64::from(task.period)
}
