//! Threads that execute jobs of several periods, in the order of their releases, in rounds or in any order, and jobs that are not
//! preempted: every schedule of a small system, one nanosecond after the other, with release jitter and bursts.
//!
//! A step releases jobs nominally, then in fact, chooses what the CPUs execute, and executes it for 1 ns.

use std::collections::HashSet;
use std::fmt;

use mauve_timing::{
    Bound, CpuSet, Demand, Edge, Method, Options, Order, Priority, StateMachine, Tasks, Time,
};

use super::random::{Random, systems_or};

/// A system with more states than this is dropped.
const MOST_STATES: usize = 40_000;

/// A job that is not released yet.
const NOT_RELEASED: u8 = u8::MAX;

/// A task whose jobs execute for each of two times in turn.
#[derive(Clone, Debug)]
struct QueuedTask {
    priority: u32,
    period: u8,
    jitter: u8,
    /// For a task that is released at any distance.
    burst: Option<u8>,
    costs: [u8; 2],
    in_thread: bool,
    is_not_preempted: bool,
}

/// Tasks, of which one thread executes some.
#[derive(Clone, Debug)]
struct QueuedSystem {
    order: Order,
    cpus: u8,
    tasks: Vec<QueuedTask>,
}

impl QueuedSystem {
    fn set(&self) -> Tasks {
        let task = |of: &QueuedTask| {
            let edge = |source: u32, cost: u8| Edge {
                source,
                target: 1 - source,
                cost: Time::from_nanos(cost.into()),
            };
            let edges = vec![edge(0, of.costs[0]), edge(1, of.costs[1])];
            mauve_timing::Task {
                priority: Priority::RealTime(of.priority),
                period: Some(Time::from_nanos(of.period.into())),
                deadline: Some(Time::from_nanos(of.period.into())),
                jitter: Time::from_nanos(of.jitter.into()),
                burst: of.burst.unwrap_or_default().into(),
                is_sporadic: of.burst.is_some(),
                thread: of.in_thread.then_some(1),
                order: if of.in_thread { self.order } else { Order::List },
                is_not_preempted: of.is_not_preempted,
                cpus: Some(CpuSet::first_few(self.cpus.into())),
                demand: Demand::Machine { machine: StateMachine::new(2, edges).unwrap(), whole: None },
                ..mauve_timing::Task::default()
            }
        };
        Tasks::new(self.tasks.iter().map(task).collect())
    }

    fn bounds(&self, method: Method) -> Vec<Option<u64>> {
        let found = self.set().response_times(&Options { method, is_brief: false }, &|| ());
        let bound = |bound: &Bound| match bound {
            Bound::Response(time) => Some(time.as_nanos()),
            _ => None,
        };
        found.responses.iter().map(|it| bound(&it.bound)).collect()
    }
}

#[derive(Clone, PartialEq, Eq, Hash, Default)]
struct TaskState {
    /// The index of the time of the next job.
    next: u8,
    /// What the job that has begun has still to execute.
    remaining: u8,
    /// Since the last nominal releases; that of a periodic task is less than its period.
    ages: Vec<u8>,
    /// Whether the round of the thread has a job of it.
    in_round: bool,
    /// Since the nominal and the real release of each unended job.
    jobs: Vec<(u8, u8)>,
}

type State = Vec<TaskState>;

impl QueuedSystem {
    /// Returns the greatest response time of each task; `None` if there are too many states.
    fn greatest(&self, limits: &[u64]) -> Option<Vec<u64>> {
        let mut greatest = vec![0; self.tasks.len()];
        let mut open = self.starts();
        let mut seen: HashSet<State> = open.iter().cloned().collect();
        while let Some(state) = open.pop() {
            for next in self.after(state, limits, &mut greatest) {
                if seen.insert(next.clone()) {
                    open.push(next);
                }
            }
            if seen.len() > MOST_STATES {
                return None;
            }
        }
        Some(greatest)
    }

    fn starts(&self) -> Vec<State> {
        let mut all: Vec<State> = vec![Vec::new()];
        for task in &self.tasks {
            let phases = if task.burst.is_some() { 1 } else { task.period };
            all = all
                .into_iter()
                .flat_map(|state| {
                    (0..phases).flat_map(move |age| {
                        let state = state.clone();
                        (0..2).map(move |next| {
                            let ages = if task.burst.is_some() { Vec::new() } else { vec![age] };
                            let of_task = TaskState { next, ages, ..TaskState::default() };
                            state.iter().cloned().chain([of_task]).collect()
                        })
                    })
                })
                .collect();
        }
        all
    }

    fn after(&self, state: State, limits: &[u64], greatest: &mut [u64]) -> Vec<State> {
        let mut states = vec![state];
        for (index, task) in self.tasks.iter().enumerate() {
            states = states.into_iter().flat_map(|state| task.nominal_releases(index, state)).collect();
        }
        for (index, task) in self.tasks.iter().enumerate() {
            states = states.into_iter().flat_map(|state| task.real_releases(index, state)).collect();
        }
        if self.order == Order::Rounds {
            states.extend(states.clone().into_iter().filter_map(|state| self.looked(state)));
        }
        let mut found = Vec::new();
        for state in states {
            for executing in self.choices(&state) {
                found.push(self.execute(state.clone(), &executing, limits, greatest));
            }
        }
        found
    }

    /// Begins a round, with all that is released.
    fn looked(&self, mut state: State) -> Option<State> {
        let mut has_job = false;
        for (_, of) in self.tasks.iter().zip(&mut state).filter(|(task, _)| task.in_thread) {
            if of.in_round || of.remaining > 0 {
                return None;
            }
            of.in_round = of.jobs.first().is_some_and(|job| job.1 != NOT_RELEASED);
            has_job |= of.in_round;
        }
        Some(state).filter(|_| has_job)
    }

    /// Returns the sets of tasks that may execute.
    fn choices(&self, state: &State) -> Vec<Vec<usize>> {
        let is_ready = |task: &usize| state[*task].jobs.first().is_some_and(|job| job.1 != NOT_RELEASED);
        let (of_thread, alone): (Vec<usize>, Vec<usize>) =
            (0..self.tasks.len()).filter(is_ready).partition(|task| self.tasks[*task].in_thread);
        let begun = of_thread.iter().copied().find(|task| state[*task].remaining > 0);
        let since = |task: usize| state[task].jobs[0].1;
        let oldest = of_thread.iter().map(|task| since(*task)).max();
        let mut next: Vec<Option<usize>> = match (begun, self.order) {
            (Some(begun), _) => vec![Some(begun)],
            (None, Order::Any) => of_thread.into_iter().map(Some).collect(),
            // Where no round has begun, one does.
            (None, Order::Rounds) => {
                let has_round = of_thread.iter().any(|task| state[*task].in_round);
                let of_round = of_thread.into_iter().filter(|task| state[*task].in_round == has_round);
                let (clocks, data): (Vec<_>, Vec<_>) =
                    of_round.partition(|task| self.tasks[*task].burst.is_none());
                let first = if clocks.is_empty() { data } else { clocks };
                first.into_iter().map(Some).collect()
            }
            (None, _) => {
                of_thread.into_iter().filter(|task| Some(since(*task)) == oldest).map(Some).collect()
            }
        };
        if next.is_empty() {
            next.push(None);
        }
        let rank = |task: &usize| {
            let has_begun = self.tasks[*task].is_not_preempted && state[*task].remaining > 0;
            if has_begun { u32::MAX } else { self.tasks[*task].priority }
        };
        let mut found = Vec::new();
        for of_thread in next {
            let ready: Vec<usize> = alone.iter().copied().chain(of_thread).collect();
            let most = usize::from(self.cpus).min(ready.len());
            for set in 0..1u32 << ready.len() {
                let is_in = |place: usize| set >> place & 1 == 1;
                let (executing, waiting): (Vec<_>, Vec<_>) = (0..ready.len()).partition(|it| is_in(*it));
                let rank = |places: Vec<usize>| places.into_iter().map(|it| rank(&ready[it]));
                let least = rank(executing.clone()).min();
                let is_valid = executing.len() == most && rank(waiting).all(|it| Some(it) <= least);
                if is_valid {
                    found.push(executing.into_iter().map(|it| ready[it]).collect());
                }
            }
        }
        found
    }

    fn execute(&self, mut state: State, executing: &[usize], limits: &[u64], greatest: &mut [u64]) -> State {
        let begins = |task: &usize| {
            self.tasks[*task].in_thread && !state[*task].in_round && state[*task].remaining == 0
        };
        if executing.iter().any(begins) {
            state = self.looked(state.clone()).unwrap_or(state);
        }
        for (index, of) in state.iter_mut().enumerate() {
            let task = &self.tasks[index];
            let is_executing = executing.contains(&index);
            if is_executing && of.remaining == 0 {
                of.in_round = false;
                of.remaining = task.costs[usize::from(of.next)];
                of.next = 1 - of.next;
            }
            of.remaining -= u8::from(is_executing);
            for (nominal, real) in &mut of.jobs {
                *nominal += 1;
                *real += u8::from(*real != NOT_RELEASED);
            }
            if let Some((oldest, _)) = of.jobs.first() {
                let oldest = u64::from(*oldest);
                let ends = is_executing && of.remaining == 0;
                let is_late = oldest > limits[index] || oldest == limits[index] && !ends;
                assert!(!is_late, "a job of task {index} is later than {}, in {self:?}", limits[index]);
                if ends {
                    greatest[index] = greatest[index].max(oldest);
                    of.jobs.remove(0);
                }
            }
            of.ages.iter_mut().for_each(|age| *age += 1);
            of.ages.retain(|age| task.burst.is_none() || *age < task.period);
        }
        state
    }
}

impl QueuedTask {
    fn nominal_releases(&self, index: usize, mut state: State) -> Vec<State> {
        let of = &mut state[index];
        let Some(burst) = self.burst else {
            if of.ages[0] == self.period {
                of.ages[0] = 0;
                of.jobs.push((0, NOT_RELEASED));
            }
            return vec![state];
        };
        let mut found = vec![state];
        while let Some(last) = found.last().filter(|it| it[index].ages.len() < usize::from(burst)) {
            let mut next = last.clone();
            next[index].ages.push(0);
            next[index].jobs.push((0, NOT_RELEASED));
            found.push(next);
        }
        found
    }

    fn real_releases(&self, index: usize, state: State) -> Vec<State> {
        let is_forced =
            |state: &State| state[index].jobs.iter().any(|job| job.1 == NOT_RELEASED && job.0 >= self.jitter);
        let mut found = vec![state];
        while let Some(last) = found.last() {
            let Some(place) = last[index].jobs.iter().position(|job| job.1 == NOT_RELEASED) else { break };
            let mut next = last.clone();
            next[index].jobs[place].1 = 0;
            found.push(next);
        }
        found.retain(|state| !is_forced(state));
        found
    }
}

/// What an exploration of random systems found.
#[derive(Default)]
struct Totals {
    systems: u64,
    bounds: u64,
    attained: u64,
    /// Bounds that are less than those in any order, or with preemption.
    less: u64,
    late: u64,
}

impl fmt::Display for Totals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Totals { systems, bounds, attained, less, late } = self;
        write!(f, "{systems} systems, {bounds} bounds, {attained} attained, {less} less, {late} later than T")
    }
}

fn random_task(random: &mut Random, tasks: u64) -> QueuedTask {
    let period = random.within(2, 11 - tasks) as u8;
    let most = u64::from(period) * 3 / (2 * tasks);
    let mut cost = || random.within(1, most.max(1)) as u8;
    let first = cost();
    let costs = [first, if first % 2 == 0 { cost() } else { first }];
    let jitter = if random.one_in(3) { random.within(1, u64::from(period)) as u8 } else { 0 };
    let burst = if random.one_in(4) { Some(random.within(1, 2) as u8) } else { None };
    let priority = random.within(1, 2) as u32;
    QueuedTask { priority, period, jitter, burst, costs, in_thread: false, is_not_preempted: false }
}

fn explore_random(
    number: u64,
    seed: u64,
    make: impl Fn(&mut Random) -> (QueuedSystem, QueuedSystem),
) -> Totals {
    let mut random = Random(seed + (mauve_tests::search::seed() << 8));
    let mut totals = Totals::default();
    while totals.systems < systems_or(number) {
        let (system, looser) = make(&mut random);
        let bounds = [Method::Psm, Method::Exact].map(|method| system.bounds(method));
        let known: Option<Vec<u64>> = bounds[1].iter().copied().collect();
        let Some(limits) = known.filter(|it| it.iter().all(|limit| *limit < 100)) else { continue };
        let Some(greatest) = system.greatest(&limits) else { continue };
        totals.systems += 1;
        for (index, limit) in limits.iter().enumerate() {
            assert!(Some(*limit) <= bounds[0][index], "{system:?}");
            let loose = looser.bounds(Method::Exact)[index];
            assert!(loose.is_none_or(|loose| *limit <= loose), "{system:?}");
            totals.bounds += 1;
            totals.attained += u64::from(greatest[index] == *limit);
            totals.less += u64::from(loose.is_some_and(|loose| *limit < loose));
            totals.late += u64::from(*limit > system.tasks[index].period.into());
        }
    }
    println!("{totals}");
    totals
}

fn thread_of(random: &mut Random, order: Order) -> QueuedSystem {
    let tasks = random.within(2, 3);
    let mut tasks: Vec<QueuedTask> = (0..tasks).map(|_| random_task(random, tasks)).collect();
    let queued = if tasks.len() == 3 && random.one_in(2) { 3 } else { 2 };
    let not_preempted = random.one_in(8);
    for task in &mut tasks[..queued] {
        (task.in_thread, task.priority) = (true, 1);
        task.is_not_preempted = not_preempted;
    }
    for task in &mut tasks[queued..] {
        task.priority = random.below(3) as u32;
    }
    let cpus = if random.one_in(5) && !not_preempted { 2 } else { 1 };
    QueuedSystem { order, cpus, tasks }
}

#[test]
fn no_schedule_of_a_queue_is_above_a_bound() {
    let totals = explore_random(1000, 41, |random| {
        let system = thread_of(random, Order::Fifo);
        let looser = QueuedSystem { order: Order::Any, ..system.clone() };
        (system, looser)
    });
    assert!(totals.attained * 2 > totals.bounds && totals.less * 20 > totals.bounds);
    assert!(totals.late * 20 > totals.bounds);
}

/// Rounds have many schedules.
#[test]
fn no_schedule_of_rounds_is_above_a_bound() {
    let totals = explore_random(200, 44, |random| {
        let system = thread_of(random, Order::Rounds);
        let looser = QueuedSystem { order: Order::Any, ..system.clone() };
        (system, looser)
    });
    assert!(totals.attained * 3 > totals.bounds && totals.less * 50 > totals.bounds);
    assert!(totals.late * 20 > totals.bounds);
}

#[test]
fn no_schedule_of_a_thread_in_any_order_is_above_a_bound() {
    let totals = explore_random(1000, 42, |random| {
        let system = thread_of(random, Order::Any);
        (system.clone(), system)
    });
    assert!(totals.attained * 2 > totals.bounds && totals.late * 20 > totals.bounds);
}

#[test]
fn no_schedule_of_jobs_that_are_not_preempted_is_above_a_bound() {
    let totals = explore_random(1000, 43, |random| {
        let tasks = random.within(2, 3);
        let mut tasks: Vec<QueuedTask> = (0..tasks).map(|_| random_task(random, tasks)).collect();
        for task in &mut tasks {
            (task.priority, task.is_not_preempted) = (random.within(1, 3) as u32, !random.one_in(3));
        }
        // The same with a job that is only at the highest priority for others.
        let system = QueuedSystem { order: Order::List, cpus: 1, tasks };
        (system.clone(), system)
    });
    assert!(totals.attained * 2 > totals.bounds && totals.late * 20 > totals.bounds);
}
