//! Every schedule of a small system with waits, locks or throttling, one nanosecond after the other.
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
//! - A job that *nests* takes a second lock before it leaves the first, and leaves them in any order. The time of a lock is that of the
//!   locks with a ceiling that is no lower, without a gap. No job of equal priority preempts one that has a ceiling then, as under
//!   SCHED_FIFO.
//! - A task of unknown demand waits within its locks, and holds them for as long as its job lasts.
//! - While a task of throttling has a job, no real-time task executes on its CPU, and the background does. A job of the background with
//!   a lock that gives it a real-time priority may execute then or not.
//! - A job sends calls at any instant at which it has a CPU. The provider executes them before the edge of its next job, or between two
//!   jobs, and takes locks and waits meanwhile as in a job.

use std::collections::VecDeque;
use std::fmt::Write;

use mauve_timing::Protocol;
use rustc_hash::FxHashMap;

use super::explore::{MOST_UNENDED, OPERATIONS, Outcome, Seen, TASKS};
use super::scheduler::Scheduler;
use super::system::{Calls, System};

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
    Ready,
    Waiting,
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
    /// 2 bits.
    status: Status,
    /// The locks that it has, a bit for each.
    locks: u8,
    /// 1 more than the lock that it takes as soon as it has a CPU and the lock is free; 0 for none. 2 bits.
    wants: u8,
    /// For how long it may still hold each lock; of a job that nests, any lock with a ceiling that is no lower. 4 bits each; only one
    /// of them where no job nests.
    hold: [u8; LOCKS],
    /// Whether it is a call, executed between two jobs. Only in systems with operations.
    is_call: bool,
}

impl TaskState {
    /// `None` if a counter is too great.
    fn pack(&self, any_nests: bool) -> Option<u128> {
        let [first, second] = self.hold;
        let (hold, second) = if any_nests { (first, second) } else { (first.max(second), 0) };
        let is_small = self.to_release < 32 && self.machine < 4 && self.jobs < 8 && self.remaining < 32;
        if !is_small || self.wait >= 16 || self.times >= 4 || hold >= 16 || second >= 16 {
            return None;
        }
        let bits = u64::from(self.to_release) << 27
            | u64::from(self.machine) << 25
            | u64::from(self.jobs) << 22
            | u64::from(self.is_released) << 21
            | u64::from(self.remaining) << 16
            | u64::from(self.wait) << 12
            | u64::from(self.times) << 10
            | (self.status as u64) << 8
            | u64::from(self.locks) << 6
            | u64::from(self.wants) << 4
            | u64::from(hold);
        Some(u128::from(if any_nests { bits << 4 | u64::from(second) } else { bits }))
    }

    fn unpack(mut packed: u128, any_nests: bool) -> TaskState {
        let mut part = |bits: u32| {
            let part = (packed & ((1 << bits) - 1)) as u8;
            packed >>= bits;
            part
        };
        let second = if any_nests { part(4) } else { 0 };
        let (first, wants, locks, status) = (part(4), part(2), part(LOCKS as u32), part(2));
        let hold = if any_nests || locks & 2 == 0 { [first, second] } else { [0, first] };
        let (times, wait, remaining) = (part(2), part(4), part(5));
        let (is_released, jobs, machine, to_release) = (part(1) == 1, part(3), part(2), part(5));
        let status = [Status::Idle, Status::Ready, Status::Waiting][usize::from(status)];
        TaskState {
            to_release,
            machine,
            jobs,
            is_released,
            remaining,
            wait,
            times,
            status,
            locks,
            wants,
            hold,
            is_call: false,
        }
    }
}

/// How a state is packed.
#[derive(Clone, Copy)]
struct Layout {
    tasks: usize,
    operations: usize,
    any_nests: bool,
    /// Of a task.
    bits: u32,
}

impl Layout {
    fn of(system: &System) -> Layout {
        let any_nests = system.tasks.iter().any(|task| task.nests);
        let operations = system.operations.len();
        let bits = 32 + if any_nests { 4 } else { 0 } + u32::from(operations > 0);
        Layout { tasks: system.tasks.len(), operations, any_nests, bits }
    }
}

#[derive(Clone, Copy, PartialEq, Default)]
struct State {
    tasks: [TaskState; TASKS],
    /// For each operation, the calls that wait, 3 bits, and those that the job of the client may still send, 2 bits.
    calls: [(u8, u8); OPERATIONS],
}

impl State {
    fn pack(&self, layout: Layout) -> Option<u128> {
        let Layout { tasks, operations, any_nests, bits } = layout;
        let mut packed = 0;
        for now in self.tasks[..tasks].iter().rev() {
            let task = match operations {
                0 => now.pack(any_nests)?,
                _ => now.pack(any_nests)? << 1 | u128::from(now.is_call),
            };
            packed = packed << bits | task;
        }
        for &(waiting, unsent) in self.calls[..operations].iter().rev() {
            if waiting >= 8 || unsent >= 4 {
                return None;
            }
            packed = packed << 5 | u128::from(waiting << 2 | unsent);
        }
        Some(packed)
    }

    fn unpack(mut packed: u128, layout: Layout) -> State {
        let Layout { tasks, operations, any_nests, bits } = layout;
        let mut state = State::default();
        for calls in &mut state.calls[..operations] {
            *calls = (packed as u8 >> 2 & 7, packed as u8 & 3);
            packed >>= 5;
        }
        for now in &mut state.tasks[..tasks] {
            let task = packed & ((1 << bits) - 1);
            *now = match operations {
                0 => TaskState::unpack(task, any_nests),
                _ => TaskState { is_call: task & 1 == 1, ..TaskState::unpack(task >> 1, any_nests) },
            };
            packed = packed.checked_shr(bits).unwrap_or(0);
        }
        state
    }
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
        states.push(State::unpack(packed, exploration.layout));
        last = exploration.before.as_ref().and_then(|before| before.get(&packed).copied());
    }
    let mut text = format!("{outcome:?} in the nanosecond after the last of these states:\n");
    for state in states.iter().rev() {
        for now in &state.tasks[..system.tasks.len()] {
            let late = if now.jobs > 0 && !now.is_released { " (late)" } else { "" };
            let _ = write!(text, " | release in {}, {} jobs{late}", now.to_release, now.jobs);
            if now.status != Status::Idle {
                let TaskState { status, locks, wants, hold, remaining, wait, is_call, .. } = now;
                let _ = write!(text, ", {status:?}, {remaining} to execute, {wait} to wait");
                let _ = write!(text, ", locks {locks:b} for {hold:?}, wants {wants}");
                text.push_str(if *is_call { ", a call" } else { "" });
            }
        }
        for (waiting, unsent) in &state.calls[..system.operations.len()] {
            let _ = write!(text, " | {waiting} calls wait, {unsent} to send");
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
    nests: bool,
    is_unknown: bool,
    is_background: bool,
    /// Where it is throttling: its CPU.
    throttles: Option<u64>,
}

struct Exploration<'a> {
    system: &'a System,
    layout: Layout,
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
        let layout = Layout::of(system);
        let bits = layout.tasks as u32 * layout.bits + 5 * layout.operations as u32;
        assert!(system.tasks.len() <= TASKS && system.locks.len() <= LOCKS);
        assert!(system.operations.len() <= OPERATIONS && bits <= 128);
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
            ExploredTask {
                priority,
                period,
                jitter,
                limit,
                times,
                successors,
                held,
                nests: task.nests,
                is_unknown: task.is_unknown,
                is_background: task.is_background,
                throttles: task.is_throttling.then_some(task.cpus),
            }
        });
        let locks = system.locks.iter().map(|lock| {
            let priorities = lock.users.iter().map(|&(user, _)| system.tasks[user].priority);
            (lock.protocol, priorities.max().unwrap_or(0))
        });
        Exploration {
            system,
            layout,
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
            let state = State::unpack(packed, self.layout);
            let choices = self.choices(&state);
            self.next.clear();
            self.steps(&state, &choices);
            self.nanosecond(&state, &choices)?;
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
            if thread[0] != place && state.tasks[thread[0]].to_release != to_release {
                continue;
            }
            for machine in 0..states {
                state.tasks[place] = TaskState { to_release, machine, ..TaskState::default() };
                self.start(state, place + 1, now)?;
            }
        }
        Ok(())
    }

    fn reach(&mut self, state: &State) -> Result<(), Outcome> {
        let packed = state.pack(self.layout).ok_or(Outcome::TooLarge)?;
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
    fn steps(&mut self, state: &State, choices: &[u8]) {
        let has_cpu = choices.iter().fold(0, |all, executing| all | executing);
        let mut next = std::mem::take(&mut self.next);
        for (place, task) in self.tasks.iter().enumerate() {
            let now = &state.tasks[place];
            let with = |changed: TaskState| {
                let mut state = *state;
                state.tasks[place] = changed;
                state
            };
            if now.to_release == 0 {
                let is_counted = task.limit.is_some() || now.jobs < MOST_UNENDED;
                let jobs = now.jobs + u8::from(is_counted);
                next.push(with(TaskState { to_release: task.period, jobs, ..*now }.released(task)));
                // Nominally, it was released before anything else that it does.
                continue;
            }
            if now.jobs > 0 && !now.is_released {
                next.push(with(TaskState { is_released: true, ..*now }));
            }
            if now.status == Status::Waiting && now.remaining > 0 {
                next.push(with(now.ready()));
            } else if now.status == Status::Waiting {
                if !now.is_call {
                    self.greatest[place] = age(now, task).max(self.greatest[place]);
                }
                next.extend(self.ends(state, place, now.ready()));
            }
            if has_cpu >> place & 1 == 0 || now.status == Status::Waiting {
                continue;
            }
            if now.status == Status::Idle {
                next.extend(self.begins(state, place));
                continue;
            }
            if now.wants == 0 {
                let may_wait = now.locks == 0 || task.is_unknown;
                next.extend(now.waiting().filter(|_| may_wait).map(with));
                next.extend(self.sends(state, place));
            }
            let may_take = now.wants > 0 || now.locks == 0 || task.nests;
            let is_wanted = |lock: &u8| match now.wants {
                0 => task.held[usize::from(*lock)] > 0 && now.locks >> *lock & 1 == 0,
                wanted => wanted == lock + 1,
            };
            for lock in (0..LOCKS as u8).filter(|lock| may_take && is_wanted(lock)) {
                let (locks, wants) = (now.locks | 1 << lock, lock + 1);
                let mut hold = now.hold;
                for (level, hold) in hold.iter_mut().enumerate() {
                    let begins = *hold == 0 && self.is_within(level, 1 << lock);
                    let counts = task.nests || level == usize::from(lock);
                    *hold = if begins && counts { task.held[level] } else { *hold };
                }
                match is_taken(state, lock) {
                    true if now.wants == 0 => next.push(with(TaskState { wants, ..*now })),
                    true => {}
                    false => next.push(with(TaskState { locks, wants: 0, hold, ..*now })),
                }
            }
        }
        self.next = next;
    }

    /// Whether one of `locks` has a ceiling that is not lower than that of the lock `level`.
    fn is_within(&self, level: usize, locks: u8) -> bool {
        let ceiling = |lock: usize| self.locks.get(lock).map(|(_, ceiling)| *ceiling);
        (0..LOCKS).any(|lock| locks >> lock & 1 == 1 && ceiling(lock) >= ceiling(level))
    }

    /// Returns the job with these of its locks, if it may still hold them.
    fn keeping(&self, place: usize, now: &TaskState, locks: u8) -> Option<TaskState> {
        let mut hold = now.hold;
        for (level, hold) in
            hold.iter_mut().enumerate().filter(|(level, _)| self.tasks[place].held[*level] > 0)
        {
            let counts = self.tasks[place].nests || now.locks >> level & 1 == 1;
            match self.is_within(level, locks) && counts {
                true if *hold == 0 => return None,
                true => {}
                false => *hold = 0,
            }
        }
        Some(TaskState { locks, hold, ..*now })
    }

    /// Returns the states after the job or a call of an idle task that has a CPU begins.
    fn begins(&self, state: &State, place: usize) -> Vec<State> {
        let (task, now, status) = (&self.tasks[place], &state.tasks[place], Status::Ready);
        let operations = || self.system.operations.iter().enumerate();
        let mut next = Vec::new();
        for edge in &task.successors[usize::from(now.machine)] {
            if !now.is_released || !self.is_turn(state, place) {
                break;
            }
            let mut after = *state;
            let (mut remaining, mut wait, machine) = (edge.cost, edge.wait, edge.target);
            for (operation, served) in operations() {
                let (waiting, unsent) = &mut after.calls[operation];
                if served.client == place {
                    *unsent = served.sends as u8;
                }
                if served.provider == place {
                    remaining += *waiting * (served.time - served.wait) as u8;
                    wait += *waiting * served.wait as u8;
                    *waiting = 0;
                }
            }
            let times = if wait > edge.wait { ANY_NUMBER } else { task.times };
            let times = if wait == 0 { 0 } else { times };
            after.tasks[place] = TaskState { machine, remaining, wait, times, status, ..*now };
            next.push(after);
        }
        for (operation, served) in operations() {
            if served.provider == place && self.has_call_between_jobs(state, place, operation) {
                let mut after = *state;
                after.calls[operation].0 -= 1;
                let (remaining, wait) = ((served.time - served.wait) as u8, served.wait as u8);
                let times = if wait == 0 { 0 } else { ANY_NUMBER };
                after.tasks[place] = TaskState { remaining, wait, times, status, is_call: true, ..*now };
                next.push(after);
            }
        }
        next
    }

    fn has_call_between_jobs(&self, state: &State, place: usize, operation: usize) -> bool {
        let thread = self.threads.iter().find(|thread| thread.contains(&place)).unwrap();
        self.system.calls == Calls::BetweenPeriods
            && state.calls[operation].0 > 0
            && thread.iter().all(|&mate| state.tasks[mate].status == Status::Idle)
    }

    /// Returns the states after the job of `place` sends one more call.
    fn sends(&self, state: &State, place: usize) -> Vec<State> {
        let mut after = Vec::new();
        for (operation, served) in self.system.operations.iter().enumerate() {
            let may_send = served.client == place && !state.tasks[place].is_call;
            if may_send && state.calls[operation].1 > 0 {
                let mut state = *state;
                state.calls[operation].0 += 1;
                state.calls[operation].1 -= 1;
                after.push(state);
            }
        }
        after
    }

    /// Returns the states after the job or call of `place` ends, which was `last`: before, the job may send its calls.
    fn ends(&self, state: &State, place: usize, last: TaskState) -> Vec<State> {
        let mut open = vec![*state];
        let mut after: Vec<State> = Vec::new();
        while let Some(mut state) = open.pop() {
            open.extend(self.sends(&state, place));
            for (operation, served) in self.system.operations.iter().enumerate() {
                if served.client == place && !last.is_call {
                    state.calls[operation].1 = 0;
                }
            }
            state.tasks[place] = last.ended(&self.tasks[place]);
            after.push(state);
        }
        after
    }

    /// Whether a task may begin its next job, in the order of its thread.
    fn is_turn(&self, state: &State, task: usize) -> bool {
        let is_it = |thread: &&Vec<usize>| thread.len() > 1 && thread.contains(&task);
        let Some(thread) = self.threads.iter().find(is_it) else { return true };
        // With those that are due at this instant.
        let jobs = |place: usize| {
            state.tasks[thread[place]].jobs + u8::from(state.tasks[thread[place]].to_release == 0)
        };
        let is_free = thread.iter().all(|&mate| state.tasks[mate].status == Status::Idle);
        let is_next = match thread.iter().position(|&it| it == task).unwrap() {
            0 => jobs(0) == jobs(thread.len() - 1),
            place => jobs(place - 1) < jobs(place),
        };
        is_free && is_next
    }

    /// Returns the sets of tasks that may execute, by the priorities that the tasks have.
    fn choices(&mut self, state: &State) -> Vec<u8> {
        let throttling = |(task, now): (&ExploredTask, &TaskState)| {
            let is_active = now.status != Status::Idle || now.is_released;
            task.throttles.filter(|_| is_active)
        };
        let all = || self.tasks.iter().zip(&state.tasks);
        let throttled = all().filter_map(throttling).fold(0, |all, cpu| all | cpu);
        let (mut ready, mut woken, mut throttles) = (0u8, 0u8, 0u8);
        let mut priorities = [0; TASKS];
        let any_nests = self.layout.any_nests;
        for (place, task) in self.tasks.iter().enumerate() {
            let now = &state.tasks[place];
            let has_call = || {
                let mut operations = self.system.operations.iter().enumerate();
                operations.any(|(operation, served)| {
                    served.provider == place && self.has_call_between_jobs(state, place, operation)
                })
            };
            let is_ready = match now.status {
                Status::Idle => now.is_released && self.is_turn(state, place) || has_call(),
                Status::Ready => now.wants == 0 || !is_taken(state, now.wants - 1),
                Status::Waiting => false,
            };
            let mut priority = 2 * task.priority;
            for (lock, (protocol, ceiling)) in self.locks.iter().enumerate() {
                let of_lock = match protocol {
                    _ if now.locks >> lock & 1 == 0 => 0,
                    // Where jobs nest, no job of equal priority preempts it.
                    Protocol::Ceiling => 2 * ceiling + u32::from(any_nests),
                    Protocol::Inheritance => {
                        let blocked = all().filter(|(_, other)| usize::from(other.wants) == lock + 1);
                        blocked.map(|(other, _)| 2 * other.priority).max().unwrap_or(0)
                    }
                    Protocol::None => 0,
                };
                priority = priority.max(of_lock);
            }
            priorities[place] = priority;
            let is_throttled = self.system.tasks[place].cpus & throttled != 0;
            match (task.throttles, is_throttled && is_ready) {
                (Some(_), _) => throttles |= u8::from(is_ready) << place,
                (None, false) => ready |= u8::from(is_ready) << place,
                (None, true) if task.is_background && priority == 2 * task.priority => ready |= 1 << place,
                (None, true) => woken |= u8::from(task.is_background) << place,
            }
        }
        let system = self.system;
        let scheduler = self.schedulers.entry(priorities).or_insert_with(|| {
            let mut system = system.clone();
            system.tasks.iter_mut().zip(priorities).for_each(|(task, priority)| task.priority = priority);
            Scheduler::new(&system)
        });
        let mut choices = scheduler.choices(ready).to_vec();
        if woken > 0 {
            choices.extend_from_slice(scheduler.choices(ready | woken));
        }
        choices.iter_mut().for_each(|choice| *choice |= throttles);
        choices
    }

    /// Adds the states after the next nanosecond, if nothing must happen before.
    fn nanosecond(&mut self, state: &State, choices: &[u8]) -> Result<(), Outcome> {
        for (place, task) in self.tasks.iter().enumerate() {
            let now = &state.tasks[place];
            if now.to_release == 0 || now.jobs > 0 && !now.is_released && age(now, task) >= task.jitter {
                return Ok(());
            }
        }
        for &executing in choices {
            let decides =
                |place: usize| state.tasks[place].status == Status::Idle || state.tasks[place].wants > 0;
            if (0..self.tasks.len()).any(|place| executing >> place & 1 == 1 && decides(place)) {
                continue;
            }
            let is_above = |(task, now): (&ExploredTask, &TaskState)| {
                now.jobs > 0 && task.limit.is_some_and(|limit| age(now, task) >= limit)
            };
            if let Some(task) = self.tasks.iter().zip(&state.tasks).position(is_above) {
                return Err(Outcome::Above { task });
            }
            let mut after = *state;
            for (place, now) in after.tasks[..self.tasks.len()].iter_mut().enumerate() {
                now.to_release -= 1;
                if executing >> place & 1 == 1 {
                    now.remaining -= 1;
                    let passes = u8::from(!self.tasks[place].is_unknown);
                    now.hold = now.hold.map(|hold| hold.saturating_sub(passes));
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
        let now = state.tasks[place];
        let mut after = Vec::with_capacity(4);
        let (mut may_end, has_executed) = (false, executing >> place & 1 == 1);
        let free = TaskState { status: Status::Ready, locks: 0, hold: [0; LOCKS], ..now };
        if has_executed {
            may_end = now.remaining == 0 || self.system.jobs_may_end_early && task.throttles.is_none();
            if now.remaining > 0 {
                after.push(free);
                // It keeps some of its locks.
                let kept = (1..1 << LOCKS).filter(|kept| kept & !now.locks == 0);
                after.extend(kept.filter_map(|kept| self.keeping(place, &now, kept)));
            }
            after.extend(free.waiting());
            if task.is_unknown && now.locks > 0 {
                after.extend(now.waiting());
            }
        } else if now.status == Status::Waiting && now.wait == 0 {
            may_end = now.remaining == 0;
            if !may_end {
                after.push(now.ready());
            }
        } else {
            after.push(now);
        }
        if may_end {
            if !now.is_call {
                self.greatest[place] = self.greatest[place].max(age(&now, task));
            }
            for state in self.ends(&state, place, free) {
                self.continue_from(state, executing, place + 1);
            }
        }
        for now in after {
            let mut state = state;
            state.tasks[place] = now;
            self.continue_from(state, executing, place + 1);
        }
    }
}

/// Whether a job has this lock.
fn is_taken(state: &State, lock: u8) -> bool {
    state.tasks.iter().any(|other| other.locks >> lock & 1 == 1)
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
        let TaskState { to_release, machine, jobs, is_released, is_call, .. } = *self;
        let idle = TaskState { to_release, machine, jobs, ..TaskState::default() };
        match is_call {
            true => TaskState { is_released, ..idle },
            false => TaskState { jobs: jobs - 1, ..idle }.released(task),
        }
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
