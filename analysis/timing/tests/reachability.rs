//! No schedule is later than a bound: small systems are run in every way, one nanosecond after the other.
//!
//! Nothing here knows of critical instants, of request bounds or of busy windows. A state of the system is, for each
//! task, the time to its next release, the state of its machine, how many jobs wait, and how much of the first of them
//! is still to execute; in each nanosecond one of the most urgent tasks that have work executes, whichever of them. All
//! offsets, all initial states of the machines and all their paths are tried, and, in some systems, jobs that end
//! early. A job takes 1 ns at least.
//!
//! `MAUVE_ORACLE_SYSTEMS=100000 cargo test --release -p mauve-timing --test reachability` tries more systems.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use mauve_timing::{
    Analysis, Bound, Demand, Edge, Method, Options, StateMachine, Task, Time, response_times,
};
use rustc_hash::FxHashSet;

/// The random systems of each test, where the environment does not say otherwise.
const SYSTEMS: u64 = 2000;

/// A system with more states than this is left out.
const MOST_STATES: usize = 100_000;

fn task(priority: u32, period: u64, states: u32, edges: &[(u32, u32, u64)]) -> Task {
    let edge = |&(source, target, cost): &(u32, u32, u64)| Edge {
        source,
        target,
        cost: Time::from_nanos(cost.max(1)),
    };
    let machine = StateMachine::new(states, edges.iter().map(edge).collect()).unwrap();
    Task {
        name: String::new(),
        priority,
        period: Time::from_nanos(period),
        deadline: Time::from_nanos(period),
        jitter: Time::ZERO,
        cpus: 1,
        demand: Demand::Machine { machine, whole: None },
    }
}

fn psm(tasks: &[Task]) -> Analysis {
    response_times(tasks, &Options { method: Method::Psm, horizon: None, is_brief: false }, &|| ())
}

fn bounds(tasks: &[Task]) -> Vec<Option<u64>> {
    let bound = |bound: &Bound| match bound {
        Bound::Response(time) => Some(time.as_nanos()),
        _ => None,
    };
    psm(tasks).responses.iter().map(|response| bound(&response.bound)).collect()
}

/// One task, for the exploration: (target, cost) by state.
struct Explored {
    priority: u32,
    period: u64,
    /// No job may take longer.
    bound: u64,
    successors: Vec<Vec<(u32, u64)>>,
}

impl Explored {
    fn new(task: &Task, bound: u64) -> Explored {
        let Demand::Machine { machine, .. } = &task.demand else { panic!("known") };
        let mut successors = vec![Vec::new(); machine.states() as usize];
        for edge in machine.edges() {
            successors[edge.source as usize].push((edge.target, edge.cost.as_nanos()));
        }
        Explored { priority: task.priority, period: task.period.as_nanos(), bound, successors }
    }
}

/// The state of one task, in 16 bits.
#[derive(Clone, Copy, PartialEq)]
struct TaskState {
    /// Until the next release; 0 just before it. 5 bits.
    to_release: u64,
    /// Of the machine, after the edge of the job that executes. 2 bits.
    state: u32,
    /// Released and not ended. 4 bits.
    jobs: u64,
    /// What the first of them has still to execute; 0 where it has not begun, and its edge is open. 5 bits.
    remaining: u64,
}

const TASKS: usize = 4;

type SystemState = [TaskState; TASKS];

fn pack(system: &SystemState, tasks: usize) -> u64 {
    system[..tasks].iter().fold(0, |packed, task| {
        assert!(task.to_release < 32 && task.state < 4 && task.jobs < 16 && task.remaining < 32);
        packed << 16 | task.to_release << 11 | u64::from(task.state) << 9 | task.jobs << 5 | task.remaining
    })
}

fn unpack(mut packed: u64, tasks: usize) -> SystemState {
    let mut system = [TaskState { to_release: 0, state: 0, jobs: 0, remaining: 0 }; TASKS];
    for task in system[..tasks].iter_mut().rev() {
        *task = TaskState {
            to_release: packed >> 11 & 31,
            state: (packed >> 9 & 3) as u32,
            jobs: packed >> 5 & 15,
            remaining: packed & 31,
        };
        packed >>= 16;
    }
    system
}

struct Exploration<'a> {
    tasks: &'a [Explored],
    jobs_may_end_early: bool,
    seen: FxHashSet<u64>,
    open: Vec<u64>,
    /// The greatest response of each task so far.
    greatest: Vec<u64>,
}

impl Exploration<'_> {
    /// The greatest response of each task; `None` where there are too many states. Panics above a bound.
    fn run(tasks: &[Explored], jobs_may_end_early: bool) -> Option<Vec<u64>> {
        let mut exploration = Exploration {
            tasks,
            jobs_may_end_early,
            seen: FxHashSet::default(),
            open: Vec::new(),
            greatest: vec![0; tasks.len()],
        };
        let starts: u64 = tasks.iter().map(|task| task.period * task.successors.len() as u64).product();
        if starts > MOST_STATES as u64 {
            return None;
        }
        exploration.start(unpack(0, tasks.len()), 0);
        while let Some(packed) = exploration.open.pop() {
            if exploration.seen.len() > MOST_STATES {
                return None;
            }
            exploration.release(unpack(packed, tasks.len()));
        }
        Some(exploration.greatest)
    }

    /// Every offset and initial state of `place` and those after it.
    fn start(&mut self, mut system: SystemState, place: usize) {
        if place == self.tasks.len() {
            return self.reach(system);
        }
        for to_release in 0..self.tasks[place].period {
            for state in 0..self.tasks[place].successors.len() as u32 {
                system[place] = TaskState { to_release, state, jobs: 0, remaining: 0 };
                self.start(system, place + 1);
            }
        }
    }

    fn reach(&mut self, system: SystemState) {
        let packed = pack(&system, self.tasks.len());
        if self.seen.insert(packed) {
            self.open.push(packed);
        }
    }

    /// The jobs that are due, then one nanosecond.
    fn release(&mut self, mut system: SystemState) {
        for (task, now) in self.tasks.iter().zip(&mut system) {
            if now.to_release == 0 {
                now.jobs += 1;
                now.to_release = task.period;
            }
            now.to_release -= 1;
        }
        let ready = (0..self.tasks.len()).filter(|&place| system[place].jobs > 0);
        let Some(priority) = ready.clone().map(|place| self.tasks[place].priority).max() else {
            return self.reach(system);
        };
        for place in ready.filter(|&place| self.tasks[place].priority == priority) {
            if system[place].remaining > 0 {
                self.execute(system, place);
                continue;
            }
            let tasks = self.tasks;
            for &(target, cost) in &tasks[place].successors[system[place].state as usize] {
                let mut begun = system;
                begun[place].state = target;
                begun[place].remaining = cost;
                self.execute(begun, place);
            }
        }
    }

    fn execute(&mut self, mut system: SystemState, place: usize) {
        system[place].remaining -= 1;
        if system[place].remaining > 0 {
            self.pass(system, None);
            if !self.jobs_may_end_early {
                return;
            }
            system[place].remaining = 0;
        }
        self.pass(system, Some(place));
    }

    /// The end of the nanosecond, at which the first job of `ended` ends.
    fn pass(&mut self, mut system: SystemState, ended: Option<usize>) {
        for (place, task) in self.tasks.iter().enumerate() {
            let now = &mut system[place];
            if now.jobs == 0 {
                continue;
            }
            // Of the first job: the last one was released at the latest release, each before it a period earlier.
            let age = task.period - now.to_release + (now.jobs - 1) * task.period;
            if ended == Some(place) {
                self.greatest[place] = self.greatest[place].max(age);
                assert!(age <= task.bound, "task {place} took {age}, and its bound is {}", task.bound);
                now.jobs -= 1;
            } else {
                assert!(
                    age < task.bound,
                    "task {place} is not done after {age}, and its bound is {}",
                    task.bound
                );
            }
        }
        self.reach(system);
    }
}

/// The greatest responses over all schedules, checked against the bounds; every task must have one.
fn explore(tasks: &[Task], jobs_may_end_early: bool) -> Option<Vec<u64>> {
    let bounds = bounds(tasks);
    let explored: Vec<Explored> =
        tasks.iter().zip(bounds).map(|(task, bound)| Explored::new(task, bound.expect("a bound"))).collect();
    Exploration::run(&explored, jobs_may_end_early)
}

#[test]
fn paths_that_do_not_start_together_with_the_greatest_edge() {
    let tasks = [
        task(2, 4, 3, &[(0, 0, 1), (1, 1, 2), (2, 2, 1), (0, 1, 0), (1, 2, 3), (2, 0, 1)]),
        task(1, 8, 1, &[(0, 0, 2)]),
    ];
    assert_eq!(bounds(&tasks), [Some(3), Some(7)]);
    assert_eq!(explore(&tasks, true), Some(vec![3, 6]));
}

#[test]
fn an_edge_that_is_longer_than_the_period() {
    let tasks = [
        task(2, 3, 3, &[(0, 1, 2), (1, 1, 1), (1, 2, 1), (2, 0, 4), (2, 2, 2)]),
        task(1, 5, 1, &[(0, 0, 1)]),
    ];
    assert_eq!(bounds(&tasks), [Some(4), Some(10)]);
    assert_eq!(explore(&tasks, true), Some(vec![4, 8]));
}

#[test]
fn full_load_without_an_end_of_the_window() {
    let tasks = [task(1, 3, 2, &[(0, 0, 3), (0, 1, 4), (1, 0, 2), (1, 1, 1)])];
    assert_eq!(bounds(&tasks), [Some(4)]);
    assert_eq!(explore(&tasks, true), Some(vec![4]));
}

#[test]
fn a_bound_that_is_too_low_is_noticed() {
    let tasks = [task(2, 5, 2, &[(0, 1, 1), (1, 0, 2)]), task(1, 9, 1, &[(0, 0, 3)])];
    assert_eq!(bounds(&tasks), [Some(2), Some(5)]);
    for lower in 0..2 {
        let outcome = std::panic::catch_unwind(|| {
            let mut explored = [Explored::new(&tasks[0], 2), Explored::new(&tasks[1], 5)];
            explored[lower].bound -= 1;
            Exploration::run(&explored, false)
        });
        assert!(outcome.is_err());
    }
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }

    fn within(&mut self, least: u64, greatest: u64) -> u64 {
        least + self.below(greatest - least + 1)
    }

    fn task(&mut self, tasks: u64) -> Task {
        let period = self.within(2, 10 - tasks);
        let states = self.within(1, if tasks < 4 { 4 } else { 2 }) as u32;
        // A single greatest cost may be far above the share of the task, as long as it cannot repeat.
        let greatest = self.within(1, 2 * period / tasks);
        let state = |random: &mut Random| random.below(u64::from(states)) as u32;
        let mut edges: Vec<(u32, u32, u64)> =
            (0..states).map(|source| (source, state(self), self.within(0, greatest))).collect();
        for _ in 0..self.below(u64::from(states) + 1) {
            edges.push((state(self), state(self), self.within(0, greatest)));
        }
        // Few priorities, so that some are equal.
        task(self.below(tasks + 1) as u32, period, states, &edges)
    }
}

/// Explores random systems of `tasks` tasks.
fn explore_random_systems(tasks: u64) {
    let systems = std::env::var("MAUVE_ORACLE_SYSTEMS").ok().and_then(|number| number.parse().ok());
    let systems: u64 = systems.unwrap_or(SYSTEMS);
    let mut random = Random(tasks);
    let (mut explored, mut bounds_explored, mut attained, mut late, mut full, mut tied) = (0, 0, 0, 0, 0, 0);
    while explored < systems {
        let mut system: Vec<Task> = (0..tasks).map(|_| random.task(tasks)).collect();
        // A task without a bound does not delay one with a bound.
        let found = bounds(&system);
        let mut has_bound = found.iter().map(|bound| bound.is_some());
        system.retain(|_| has_bound.next().unwrap());
        let found: Vec<u64> = found.into_iter().flatten().collect();
        let fits = |(task, &bound): (&Task, &u64)| bound < 14 * task.period.as_nanos();
        if system.len() < tasks as usize || !system.iter().zip(&found).all(fits) {
            continue;
        }
        let jobs_may_end_early = random.below(4) == 0;
        let outcome = std::panic::catch_unwind(|| explore(&system, jobs_may_end_early));
        let Some(greatest) = outcome.unwrap_or_else(|_| panic!("a bound is too low in {system:#?}")) else {
            continue;
        };
        explored += 1;
        let load = psm(&system).cpus[0].utilisation.compare_with_one();
        full += u64::from(load == std::cmp::Ordering::Equal);
        let mut priorities: Vec<u32> = system.iter().map(|task| task.priority).collect();
        priorities.sort_unstable();
        tied += u64::from(priorities.windows(2).any(|pair| pair[0] == pair[1]));
        for ((task, &bound), &greatest) in system.iter().zip(&found).zip(&greatest) {
            bounds_explored += 1;
            attained += u64::from(bound == greatest);
            late += u64::from(bound > task.period.as_nanos());
        }
    }
    println!(
        "{explored} systems of {tasks} tasks, {full} fully loaded, {tied} with equal priorities; \
         {bounds_explored} bounds, {attained} attained, {late} later than the period"
    );
    // Not vacuous: most bounds are attained, and the difficult cases occur.
    assert!(attained * 2 > bounds_explored && late * 50 > bounds_explored);
    assert!(full * 500 > explored && tied * 10 > explored);
}

#[test]
fn no_schedule_of_two_tasks_is_above_a_bound() {
    explore_random_systems(2);
}

#[test]
fn no_schedule_of_three_tasks_is_above_a_bound() {
    explore_random_systems(3);
}

#[test]
fn no_schedule_of_four_tasks_is_above_a_bound() {
    explore_random_systems(4);
}
