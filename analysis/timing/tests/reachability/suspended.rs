//! Every schedule of a small system with waits and locks, one nanosecond after the other.
//!
//! At each instant, before the nanosecond that follows, tasks take *steps* that take no time, in any order: jobs are released, a
//! job that waits ends its wait, and a job that has a CPU begins, begins to wait, or takes a lock. So the releases of one instant
//! may have any of these between them: a job takes a lock, and in the same instant one of higher priority preempts it.
//!
//! - A job waits for less than the time of its edge, as often as its task may, and before, between and after what it executes.
//! - A job takes a lock that it uses as often as it likes, leaves it at any instant before its time is over, and has it left when
//!   it waits or ends. If another job has the lock, it is blocked until that leaves it; whoever has a CPU then is the next to take
//!   it.
//! - A job that has a lock has the priority that the protocol gives it. Jobs of equal priority take turns in any way.

use std::collections::VecDeque;
use std::fmt::Write;

use mauve_timing::Protocol;
use rustc_hash::FxHashMap;

use super::explore::{MOST_UNENDED, Outcome, Seen, TASKS};
use super::scheduler::Scheduler;
use super::system::System;

/// A system with more states than this is dropped.
pub(crate) const MOST_STATES: usize = 40_000;

/// The most locks of a system.
pub(crate) const LOCKS: usize = 2;

/// The counter of waits that may be any number.
const ANY_NUMBER: u8 = 3;

#[derive(Clone, Copy, PartialEq, Debug, Default)]
enum Status {
    /// No job has begun.
    #[default]
    Idle,
    /// Begun, without a lock.
    Ready,
    Waiting,
    /// It takes this lock as soon as it has a CPU and the lock is free.
    Wants(u8),
    Holds(u8),
}

#[derive(Clone, Copy, PartialEq, Default)]
struct TaskState {
    /// The time to the next nominal release, which is due at 0. 5 bits.
    to_release: u8,
    /// Of the machine, after the edge of the job that has begun. 2 bits.
    machine: u8,
    /// Nominally released and not ended. 3 bits.
    jobs: u8,
    /// Whether the first of them is released.
    is_released: bool,
    /// What the job that has begun has still to execute. 5 bits.
    remaining: u8,
    /// For how long it may still wait. 4 bits.
    wait: u8,
    /// How often it may still wait, or [`ANY_NUMBER`]. 2 bits.
    times: u8,
    /// 3 bits.
    status: Status,
    /// For how long it may still hold its lock. 4 bits.
    hold: u8,
}

impl TaskState {
    /// `None` if a counter is too great.
    fn pack(&self) -> Option<u128> {
        let status = match self.status {
            Status::Idle => 0,
            Status::Ready => 1,
            Status::Waiting => 2,
            Status::Wants(lock) => 3 + lock,
            Status::Holds(lock) => 5 + lock,
        };
        let parts = [
            (self.to_release, 5),
            (self.machine, 2),
            (self.jobs, 3),
            (u8::from(self.is_released), 1),
            (self.remaining, 5),
            (self.wait, 4),
            (self.times, 2),
            (status, 3),
            (self.hold, 4),
        ];
        let packed =
            |all, (part, bits): (u8, u32)| (part < 1 << bits).then(|| all << bits | u128::from(part));
        parts.into_iter().try_fold(0, packed)
    }

    fn unpack(mut packed: u128) -> TaskState {
        let mut part = |bits: u32| {
            let part = (packed & ((1 << bits) - 1)) as u8;
            packed >>= bits;
            part
        };
        let (hold, status, times, wait, remaining) = (part(4), part(3), part(2), part(4), part(5));
        let (is_released, jobs, machine, to_release) = (part(1) == 1, part(3), part(2), part(5));
        let status = match status {
            0 => Status::Idle,
            1 => Status::Ready,
            2 => Status::Waiting,
            3 | 4 => Status::Wants(status - 3),
            _ => Status::Holds(status - 5),
        };
        TaskState { to_release, machine, jobs, is_released, remaining, wait, times, status, hold }
    }
}

/// The bits of a task in a packed state.
const BITS: u32 = 29;

type State = [TaskState; TASKS];

fn unpack(packed: u128, tasks: usize) -> State {
    let mut state = State::default();
    for (place, now) in state[..tasks].iter_mut().enumerate() {
        *now = TaskState::unpack(packed >> (BITS * place as u32) & ((1 << BITS) - 1));
    }
    state
}

/// As [`super::explore::explore`].
pub(crate) fn explore(system: &System, limits: &[Option<u64>]) -> Outcome {
    Exploration::new(system, limits).run()
}

/// As [`super::explore::schedule_above`], with a line for each step.
pub(crate) fn schedule_above(system: &System, limits: &[Option<u64>]) -> String {
    let mut exploration = Exploration::new(system, limits);
    exploration.before = Some(FxHashMap::default());
    exploration.most_states *= 50;
    let outcome = exploration.run();
    let mut states = Vec::new();
    let mut last = exploration.expanded;
    while let Some(packed) = last {
        states.push(unpack(packed, system.tasks.len()));
        last = exploration.before.as_ref().and_then(|before| before.get(&packed).copied());
    }
    let mut text = format!("{outcome:?} in the nanosecond after the last of these states:\n");
    for state in states.iter().rev() {
        for now in &state[..system.tasks.len()] {
            let late = if now.jobs > 0 && !now.is_released { " (late)" } else { "" };
            let _ = write!(text, " | release in {}, {} jobs{late}", now.to_release, now.jobs);
            if now.status != Status::Idle {
                let TaskState { status, hold, remaining, wait, .. } = now;
                let _ = write!(text, ", {status:?} for {hold}, {remaining} to execute, {wait} to wait");
            }
        }
        text.push('\n');
    }
    text
}

/// An edge: its target, what it executes and for how long it waits.
struct Edge {
    target: u8,
    cost: u8,
    wait: u8,
}

/// A task, as the exploration reads it.
struct ExploredTask {
    priority: u32,
    period: u8,
    jitter: u64,
    limit: Option<u64>,
    times: u8,
    /// By state.
    successors: Vec<Vec<Edge>>,
    /// For each lock, how long it is held; 0 for those that it does not take.
    held: [u8; LOCKS],
}

struct Exploration<'a> {
    system: &'a System,
    tasks: Vec<ExploredTask>,
    /// The tasks of each thread, in their order.
    threads: Vec<Vec<usize>>,
    /// The protocol of each lock, with the highest priority of its users.
    locks: Vec<(Protocol, u32)>,
    /// By the priorities that the tasks have.
    schedulers: FxHashMap<[u32; TASKS], Scheduler>,
    seen: Seen,
    most_states: usize,
    open: VecDeque<u128>,
    /// The states after the one that is expanded.
    next: Vec<State>,
    greatest: Vec<u64>,
    /// For a schedule, the state before each state; the states are then expanded in the order of their distance.
    before: Option<FxHashMap<u128, u128>>,
    expanded: Option<u128>,
}

impl<'a> Exploration<'a> {
    fn new(system: &'a System, limits: &[Option<u64>]) -> Exploration<'a> {
        assert!(system.tasks.len() <= TASKS && system.locks.len() <= LOCKS && system.operations.is_empty());
        let small = |number: u64| u8::try_from(number).unwrap();
        let explored = system.tasks.iter().zip(limits).enumerate().map(|(index, (task, &limit))| {
            let mut successors: Vec<Vec<Edge>> = (0..task.states()).map(|_| Vec::new()).collect();
            for (place, &(source, target, cost)) in task.edges.iter().enumerate() {
                let wait = small(task.waits.get(place).copied().unwrap_or(0));
                successors[source as usize].push(Edge { target: target as u8, cost: small(cost), wait });
            }
            let mut held = [0; LOCKS];
            for (held, lock) in held.iter_mut().zip(&system.locks) {
                let user = lock.users.iter().find(|(user, _)| *user == index);
                *held = user.map_or(0, |&(_, held)| small(held));
            }
            let times = task.times.map_or(ANY_NUMBER, small);
            assert!(times < ANY_NUMBER || task.times.is_none());
            let (priority, period) = (task.priority, small(task.period));
            assert_eq!(task.burst, None);
            let jitter = if system.is_first_of_thread(index) { task.jitter } else { 0 };
            ExploredTask { priority, period, jitter, limit, times, successors, held }
        });
        let locks = system.locks.iter().map(|lock| {
            let priorities = lock.users.iter().map(|&(user, _)| system.tasks[user].priority);
            (lock.protocol, priorities.max().unwrap_or(0))
        });
        Exploration {
            system,
            tasks: explored.collect(),
            threads: system.threads(),
            locks: locks.collect(),
            schedulers: FxHashMap::default(),
            seen: Seen::new(),
            most_states: MOST_STATES,
            open: VecDeque::new(),
            next: Vec::new(),
            greatest: vec![0; system.tasks.len()],
            before: None,
            expanded: None,
        }
    }

    fn run(&mut self) -> Outcome {
        match self.expand_all() {
            Ok(()) => {
                let limits = self.tasks.iter().map(|task| task.limit);
                Outcome::Greatest(
                    limits.zip(&self.greatest).map(|(limit, &greatest)| limit.map(|_| greatest)).collect(),
                )
            }
            Err(outcome) => outcome,
        }
    }

    fn expand_all(&mut self) -> Result<(), Outcome> {
        // Where releases are lost, the turns of its tasks are not known.
        let is_lost = |thread: &Vec<usize>| thread.iter().any(|&task| self.tasks[task].limit.is_none());
        if self.threads.iter().any(|thread| thread.len() > 1 && is_lost(thread)) {
            return Err(Outcome::TooLarge);
        }
        let phases =
            |place: usize| if self.system.is_first_of_thread(place) { self.tasks[place].period } else { 1 };
        let tasks = self.tasks.iter().enumerate();
        let starts = tasks.map(|(place, task)| usize::from(phases(place)) * task.successors.len());
        if starts.product::<usize>() > MOST_STATES {
            return Err(Outcome::TooManyStates);
        }
        let with_offset = self.system.tasks.iter().filter(|task| task.offset.is_some());
        for now in 0..with_offset.map(|task| task.period).product() {
            self.start(State::default(), 0, now)?;
        }
        loop {
            let next = if self.before.is_some() { self.open.pop_front() } else { self.open.pop_back() };
            let Some(packed) = next else { return Ok(()) };
            self.expanded = Some(packed);
            let state = unpack(packed, self.tasks.len());
            self.next.clear();
            self.steps(&state);
            self.nanosecond(&state)?;
            let next = std::mem::take(&mut self.next);
            next.iter().try_for_each(|state| self.reach(state))?;
            self.next = next;
        }
    }

    /// Adds every phase and initial state of `place` and the tasks after it. The clock of the tasks with an offset shows `now`.
    fn start(&mut self, mut state: State, place: usize, now: u64) -> Result<(), Outcome> {
        let Some(task) = self.tasks.get(place) else { return self.reach(&state) };
        let (period, states) = (task.period, task.successors.len() as u8);
        let offset = self.system.tasks[place].offset;
        for to_release in 0..period {
            let release = now + u64::from(to_release);
            if offset.is_some_and(|offset| release % u64::from(period) != offset) {
                continue;
            }
            let thread = self.threads.iter().find(|thread| thread.contains(&place)).unwrap();
            if thread[0] != place && state[thread[0]].to_release != to_release {
                continue;
            }
            for machine in 0..states {
                state[place] = TaskState { to_release, machine, ..TaskState::default() };
                self.start(state, place + 1, now)?;
            }
        }
        Ok(())
    }

    fn reach(&mut self, state: &State) -> Result<(), Outcome> {
        let mut packed = 0;
        for (place, now) in state[..self.tasks.len()].iter().enumerate() {
            packed |= now.pack().ok_or(Outcome::TooLarge)? << (BITS * place as u32);
        }
        if self.seen.insert(packed) {
            if self.seen.count > self.most_states {
                return Err(Outcome::TooManyStates);
            }
            if let (Some(before), Some(expanded)) = (&mut self.before, self.expanded) {
                before.insert(packed, expanded);
            }
            self.open.push_back(packed);
        }
        Ok(())
    }

    /// Adds the states after each step that takes no time.
    fn steps(&mut self, state: &State) {
        let has_cpu = self.choices(state).iter().fold(0, |all, executing| all | executing);
        for (place, task) in self.tasks.iter().enumerate() {
            let now = &state[place];
            let mut reach = |changed: TaskState| {
                let mut state = *state;
                state[place] = changed;
                self.next.push(state);
            };
            if now.to_release == 0 {
                let is_counted = task.limit.is_some() || now.jobs < MOST_UNENDED;
                let jobs = now.jobs + u8::from(is_counted);
                reach(TaskState { to_release: task.period, jobs, ..*now }.released(task));
                // Nominally, it was released before anything else that it does.
                continue;
            }
            if now.jobs > 0 && !now.is_released {
                reach(TaskState { is_released: true, ..*now });
            }
            if now.status == Status::Waiting {
                let ready = now.ready();
                match now.remaining {
                    0 => {
                        let greatest = &mut self.greatest[place];
                        *greatest = age(now, task).max(*greatest);
                        reach(ready.ended(task));
                    }
                    _ => reach(ready),
                }
            }
            if has_cpu >> place & 1 == 0 {
                continue;
            }
            let lock = |lock: u8| TaskState {
                status: Status::Holds(lock),
                hold: task.held[usize::from(lock)],
                ..*now
            };
            let is_taken = |lock: u8| state.iter().any(|other| other.status == Status::Holds(lock));
            match now.status {
                Status::Idle => {
                    for edge in &task.successors[usize::from(now.machine)] {
                        let (machine, remaining, wait) = (edge.target, edge.cost, edge.wait);
                        let times = if wait == 0 { 0 } else { task.times };
                        reach(TaskState { machine, remaining, wait, times, status: Status::Ready, ..*now });
                    }
                }
                Status::Ready => {
                    now.waiting().into_iter().for_each(&mut reach);
                    for wanted in (0..LOCKS as u8).filter(|&it| task.held[usize::from(it)] > 0) {
                        match is_taken(wanted) {
                            true => reach(TaskState { status: Status::Wants(wanted), ..*now }),
                            false => reach(lock(wanted)),
                        }
                    }
                }
                Status::Wants(wanted) => reach(lock(wanted)),
                Status::Holds(_) | Status::Waiting => {}
            }
        }
    }

    /// Whether a task may begin its next job, in the order of its thread.
    fn is_turn(&self, state: &State, task: usize) -> bool {
        let is_it = |thread: &&Vec<usize>| thread.len() > 1 && thread.contains(&task);
        let Some(thread) = self.threads.iter().find(is_it) else { return true };
        // With those that are due at this instant.
        let jobs = |place: usize| state[thread[place]].jobs + u8::from(state[thread[place]].to_release == 0);
        let is_free = thread.iter().all(|&mate| state[mate].status == Status::Idle);
        let is_next = match thread.iter().position(|&it| it == task).unwrap() {
            0 => jobs(0) == jobs(thread.len() - 1),
            place => jobs(place - 1) < jobs(place),
        };
        is_free && is_next
    }

    /// Returns the sets of tasks that may execute, by the priorities that the tasks have.
    fn choices(&mut self, state: &State) -> &[u8] {
        let mut ready = 0u8;
        let mut priorities = [0; TASKS];
        for (place, task) in self.tasks.iter().enumerate() {
            let is_ready = match state[place].status {
                Status::Idle => state[place].is_released && self.is_turn(state, place),
                Status::Ready | Status::Holds(_) => true,
                Status::Wants(lock) => !state.iter().any(|other| other.status == Status::Holds(lock)),
                Status::Waiting => false,
            };
            ready |= u8::from(is_ready) << place;
            let of_lock = match state[place].status {
                Status::Holds(lock) => match self.locks[usize::from(lock)] {
                    (Protocol::Ceiling, ceiling) => ceiling,
                    (Protocol::Inheritance, _) => {
                        let others = self.tasks.iter().zip(state);
                        let blocked = others.filter(|(_, other)| other.status == Status::Wants(lock));
                        blocked.map(|(other, _)| other.priority).max().unwrap_or(0)
                    }
                    (Protocol::None, _) => 0,
                },
                _ => 0,
            };
            priorities[place] = task.priority.max(of_lock);
        }
        let scheduler = self.schedulers.entry(priorities).or_insert_with(|| {
            let mut system = self.system.clone();
            system.tasks.iter_mut().zip(priorities).for_each(|(task, priority)| task.priority = priority);
            Scheduler::new(&system)
        });
        scheduler.choices(ready)
    }

    /// Adds the states after the next nanosecond, if nothing must happen before.
    fn nanosecond(&mut self, state: &State) -> Result<(), Outcome> {
        for (place, task) in self.tasks.iter().enumerate() {
            let now = &state[place];
            if now.to_release == 0 || now.jobs > 0 && !now.is_released && age(now, task) >= task.jitter {
                return Ok(());
            }
        }
        let choices = self.choices(state).to_vec();
        for executing in choices {
            let decides = |place: usize| matches!(state[place].status, Status::Idle | Status::Wants(_));
            if (0..self.tasks.len()).any(|place| executing >> place & 1 == 1 && decides(place)) {
                continue;
            }
            let is_above = |(task, now): (&ExploredTask, &TaskState)| {
                now.jobs > 0 && task.limit.is_some_and(|limit| age(now, task) >= limit)
            };
            if let Some(task) = self.tasks.iter().zip(state).position(is_above) {
                return Err(Outcome::Above { task });
            }
            let mut after = *state;
            for (place, now) in after[..self.tasks.len()].iter_mut().enumerate() {
                now.to_release -= 1;
                if executing >> place & 1 == 1 {
                    now.remaining -= 1;
                    now.hold -= u8::from(now.hold > 0);
                }
                now.wait -= u8::from(now.status == Status::Waiting);
            }
            self.continue_from(after, executing, 0);
        }
        Ok(())
    }

    /// What `executing` tasks, and those that wait, do at the end of a nanosecond.
    fn continue_from(&mut self, state: State, executing: u8, place: usize) {
        let Some(task) = self.tasks.get(place) else {
            self.next.push(state);
            return;
        };
        let now = state[place];
        let mut after = Vec::with_capacity(4);
        let (mut may_end, has_executed) = (false, executing >> place & 1 == 1);
        if has_executed {
            let free = TaskState { status: Status::Ready, hold: 0, ..now };
            may_end = now.remaining == 0 || self.system.jobs_may_end_early;
            if now.remaining > 0 {
                after.push(free);
                if now.hold > 0 {
                    after.push(now);
                }
            }
            after.extend(free.waiting());
        } else if now.status == Status::Waiting && now.wait == 0 {
            may_end = now.remaining == 0;
            if !may_end {
                after.push(now.ready());
            }
        } else {
            after.push(now);
        }
        if may_end {
            self.greatest[place] = self.greatest[place].max(age(&now, task));
            after.push(now.ended(task));
        }
        for now in after {
            let mut state = state;
            state[place] = now;
            self.continue_from(state, executing, place + 1);
        }
    }
}

impl TaskState {
    /// Begins to wait, if it may.
    fn waiting(&self) -> Option<TaskState> {
        let times = if self.times == ANY_NUMBER { ANY_NUMBER } else { self.times.saturating_sub(1) };
        (self.wait > 0 && self.times > 0).then_some(TaskState { status: Status::Waiting, times, ..*self })
    }

    /// Ends a wait.
    fn ready(&self) -> TaskState {
        let wait = if self.times == 0 { 0 } else { self.wait };
        let times = if self.wait == 0 { 0 } else { self.times };
        TaskState { status: Status::Ready, wait, times, ..*self }
    }

    fn ended(&self, task: &ExploredTask) -> TaskState {
        let TaskState { to_release, machine, jobs, .. } = *self;
        TaskState { to_release, machine, jobs: jobs - 1, ..TaskState::default() }.released(task)
    }

    /// A job is released at the end of its jitter, and nominally without.
    fn released(self, task: &ExploredTask) -> TaskState {
        let is_over = |now: &TaskState| task.jitter == 0 || age(now, task) > task.jitter;
        let is_released = self.is_released || self.jobs > 0 && is_over(&self);
        TaskState { is_released, ..self }
    }
}

/// Returns the time since the nominal release of the first job that has not ended.
fn age(now: &TaskState, task: &ExploredTask) -> u64 {
    let period = u64::from(task.period);
    period - u64::from(now.to_release) + u64::from(now.jobs - 1) * period
}
