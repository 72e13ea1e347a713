//! Random systems: no greatest response time exceeds a bound.

use std::cmp::Ordering;
use std::fmt;

use mauve_tests::search;
use mauve_timing::{Method, Protocol};

use super::explore::{OPERATIONS, Outcome, explore, schedule_above};
use super::scheduler::keeps_priorities;
use super::suspended::{self, LOCKS};
use super::system::{Bounds, Calls, METHODS, Served, Shared, System, Task, simple, task};

/// The number of systems of each kind, unless the environment says otherwise; and of kinds with larger systems.
const SYSTEMS: u64 = 5000;
const FEWER_SYSTEMS: u64 = 250;

/// A kind of random systems.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    /// One CPU, with this number of tasks.
    OneCpu(u64),
    /// One CPU, with machines whose paths matter: the windows have several jobs of tasks with very different edges.
    Paths,
    /// Two or three CPUs; no task waits while a CPU of its mask executes a task of lower priority.
    SeveralCpus,
    /// Three CPUs, with different masks of several CPUs that share CPUs; see [`super::scheduler::Scheduler`].
    LinkedCpus,
    /// One CPU, with release jitter.
    Jitter,
    /// One to three CPUs, with release jitter.
    JitterOnSeveralCpus,
    /// One CPU or two, with operations.
    Operations(Calls),
    /// One CPU, with offsets.
    Offsets,
    /// One CPU, with offsets on two clocks.
    Clocks,
    /// One to three CPUs, with offsets, release jitter and sometimes an operation.
    OffsetsOnSeveralCpus,
    /// One CPU, with waits, and sometimes release jitter.
    Waits,
    /// Two or three CPUs, with waits.
    WaitsOnSeveralCpus,
    /// One CPU, with locks.
    Locks,
    /// One CPU, with locks and waits, sometimes with offsets or release jitter.
    LocksAndWaits,
    /// Two or three CPUs, with locks that are mostly used on one of them, and sometimes waits.
    LocksOnSeveralCpus,
    /// One CPU, with ceilings that jobs take within each other, sometimes with waits, release jitter or a thread.
    Nested,
    /// One CPU or two, with a task of unknown demand, mostly with a lock: it waits within it, and holds it for long.
    Refused,
    /// One CPU, or two, throttled, with tasks in the background, and locks or waits.
    Throttled,
    /// One CPU or two, with operations, and locks or waits, sometimes with throttling or a thread.
    CallsWithMore(Calls),
    /// One CPU, with a thread of several tasks, sometimes with release jitter or offsets.
    Threads,
    /// One to three CPUs, with a thread of several tasks, and operations, waits or locks.
    ThreadsWithMore,
    /// One CPU, with tasks that are released at any distance, sometimes in bursts or with release jitter.
    Sporadic,
    /// One to three CPUs, with such tasks, and sometimes a thread or an operation.
    SporadicWithMore,
    /// Two or three CPUs that each task may use, sometimes with release jitter.
    AllCpus,
    /// The same, with tasks on one of them, waits, a thread or tasks that are released at any distance.
    AllCpusWithMore,
}

/// Returns a system of one of all kinds.
pub(crate) fn system_of_any_kind(random: &mut Random) -> System {
    const KINDS: [Kind; 26] = [
        Kind::OneCpu(2),
        Kind::OneCpu(4),
        Kind::Paths,
        Kind::SeveralCpus,
        Kind::LinkedCpus,
        Kind::Jitter,
        Kind::JitterOnSeveralCpus,
        Kind::Operations(Calls::BetweenPeriods),
        Kind::Offsets,
        Kind::Clocks,
        Kind::OffsetsOnSeveralCpus,
        Kind::Waits,
        Kind::WaitsOnSeveralCpus,
        Kind::Locks,
        Kind::LocksAndWaits,
        Kind::LocksOnSeveralCpus,
        Kind::Nested,
        Kind::Refused,
        Kind::Throttled,
        Kind::CallsWithMore(Calls::BetweenPeriods),
        Kind::Threads,
        Kind::ThreadsWithMore,
        Kind::Sporadic,
        Kind::SporadicWithMore,
        Kind::AllCpus,
        Kind::AllCpusWithMore,
    ];
    let kind = KINDS[random.below(KINDS.len() as u64) as usize];
    random.system(kind)
}

/// SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }

    pub(crate) fn within(&mut self, least: u64, greatest: u64) -> u64 {
        least + self.below(greatest - least + 1)
    }

    pub(crate) fn one_in(&mut self, number: u64) -> bool {
        self.below(number) == 0
    }

    /// Returns one of `tasks` tasks, which have together about the given number of CPUs.
    fn task(&mut self, tasks: u64, cpus: u64, most_states: u64) -> Task {
        let period = self.within(2, 10 - tasks);
        let states = self.within(1, most_states) as u32;
        // A single greatest cost may be far above the share of the task, as long as it cannot repeat.
        let greatest = self.within(1, 2 * period * cpus / tasks);
        let state = |random: &mut Random| random.below(u64::from(states)) as u32;
        let mut edges: Vec<(u32, u32, u64)> =
            (0..states).map(|source| (source, state(self), self.within(0, greatest))).collect();
        for _ in 0..self.below(u64::from(states) + 1) {
            edges.push((state(self), state(self), self.within(0, greatest)));
        }
        // Few priorities, so that some are equal.
        task(self.below(tasks + 1) as u32, period, &edges)
    }

    /// Returns a task whose path has a ring, and other edges that are mostly cheaper.
    fn machine(&mut self, tasks: u64) -> Task {
        let period = self.within(2, 4);
        let states = if tasks == 2 { self.within(2, 4) } else { self.within(2, 3) } as u32;
        let mut edges: Vec<(u32, u32, u64)> = Vec::new();
        for source in 0..states {
            edges.push((source, (source + 1) % states, self.within(0, 2 * period / (tasks - 1))));
            if self.one_in(2) {
                edges.push((source, self.below(u64::from(states)) as u32, self.within(0, period / 2)));
            }
        }
        task(self.within(1, 2) as u32, period, &edges)
    }

    /// Returns a task of less utilisation, for systems with operations. The count of its calls depends on the deadlines.
    fn light_task(&mut self, tasks: u64) -> Task {
        let period = self.within(3, if tasks == 2 { 14 } else { 9 });
        let states = self.within(1, 4 - tasks) as u32;
        let edges: Vec<_> = (0..states)
            .flat_map(|source| (0..states).map(move |target| (source, target)))
            .map(|(source, target)| (source, target, self.within(1, period.div_ceil(5))))
            .collect();
        let jitter = if self.one_in(8) { self.within(1, period) } else { 0 };
        let deadline = self.within(period / 3, 3 * period / 2);
        task(self.below(tasks + 1) as u32, period, &edges).jitter(jitter).deadline(deadline)
    }

    fn system(&mut self, kind: Kind) -> System {
        match kind {
            Kind::OneCpu(tasks) => {
                let most_states = if tasks < 4 { 4 } else { 2 };
                let mut system = self.tasks(tasks, 1, most_states);
                system.jobs_may_end_early = self.one_in(4);
                system
            }
            Kind::Paths => {
                let tasks = self.within(2, 3);
                let mut machines: Vec<_> = (1..tasks).map(|_| self.machine(tasks)).collect();
                let cost = self.within(1, 2);
                machines.push(simple(0, self.within(4, 11), cost));
                System::new(machines)
            }
            Kind::SeveralCpus | Kind::LinkedCpus => loop {
                let most = if self.one_in(4) { 4 } else { 3 };
                let tasks = self.within(if kind == Kind::LinkedCpus { 3 } else { 2 }, most);
                let cpus = if kind == Kind::LinkedCpus { 3 } else { self.within(2, 3) };
                let mut system = self.tasks(tasks, 2, 5 - tasks);
                self.place(&mut system, cpus);
                system.jobs_may_end_early = self.one_in(2);
                if self.one_in(12) {
                    system.tasks[0].is_unknown = true;
                }
                if keeps_priorities(&system) == (kind == Kind::SeveralCpus) {
                    return system;
                }
            },
            Kind::Jitter | Kind::JitterOnSeveralCpus => {
                let tasks = self.within(1, 3);
                let cpus = if kind == Kind::Jitter { 1 } else { self.within(2, 3) };
                let mut system = self.tasks(tasks, cpus.min(2), 4 - tasks);
                for task in &mut system.tasks {
                    task.jitter = match self.below(4) {
                        0 => 0,
                        1 => self.within(0, 2 * task.period),
                        _ => self.within(1, task.period),
                    };
                }
                if cpus > 1 {
                    self.place(&mut system, cpus);
                }
                system.jobs_may_end_early = self.one_in(4);
                system
            }
            Kind::Offsets => {
                let tasks = self.within(2, 3);
                let mut system = self.tasks(tasks, 1, 4 - tasks);
                if self.one_in(2) {
                    system.tasks[0] = self.machine(tasks);
                }
                self.synchronise(&mut system);
                system.jobs_may_end_early = self.one_in(4);
                system
            }
            Kind::Clocks => {
                let tasks = self.within(3, 4);
                let mut system = self.tasks(tasks, 1, 1);
                self.synchronise(&mut system);
                for (place, task) in system.tasks.iter_mut().enumerate() {
                    task.clock = if self.one_in(4) { self.below(2) as usize } else { place / 2 };
                    task.jitter = if self.one_in(6) { self.within(1, task.period) } else { 0 };
                }
                system
            }
            Kind::OffsetsOnSeveralCpus => {
                let tasks = self.within(2, 3);
                let cpus = self.within(1, 3);
                let mut system = self.tasks(tasks, cpus.min(2), 4 - tasks);
                self.synchronise(&mut system);
                self.place(&mut system, cpus);
                for task in &mut system.tasks {
                    task.jitter = if self.one_in(2) { self.within(0, task.period) } else { 0 };
                }
                system.jobs_may_end_early = self.one_in(4);
                let calls = if self.one_in(2) { Calls::AtNextPeriod } else { Calls::BetweenPeriods };
                let served: Vec<_> = (0..u64::from(self.one_in(3))).map(|_| self.served(tasks)).collect();
                system.serving(calls, &served)
            }
            Kind::Operations(calls) => {
                let tasks = if self.one_in(3) { 3 } else { 2 };
                let cpus = if self.one_in(4) { 2 } else { 1 };
                let mut system = System::new((0..tasks).map(|_| self.light_task(tasks)).collect());
                if cpus > 1 {
                    self.place(&mut system, cpus);
                }
                let operations = if self.one_in(4) { OPERATIONS } else { 1 };
                let served: Vec<_> = (0..operations).map(|_| self.served(tasks)).collect();
                system.jobs_may_end_early = self.one_in(8);
                system.serving(calls, &served)
            }
            Kind::Waits => {
                let tasks = self.within(1, 3);
                let mut system = self.tasks(tasks, 1, 4 - tasks);
                self.wait(&mut system);
                if self.one_in(4) {
                    self.delay_releases(&mut system);
                }
                system.jobs_may_end_early = self.one_in(4);
                system
            }
            Kind::WaitsOnSeveralCpus => loop {
                let tasks = self.within(2, 3);
                let cpus = self.within(2, 3);
                let mut system = self.tasks(tasks, 2, 4 - tasks);
                self.place(&mut system, cpus);
                self.wait(&mut system);
                if keeps_priorities(&system) || self.one_in(2) {
                    return system;
                }
            },
            Kind::Locks => {
                let tasks = self.within(2, 4);
                let mut system = self.tasks(tasks, 1, if tasks == 4 { 1 } else { 2 });
                if self.one_in(4) {
                    system.tasks.iter_mut().for_each(|task| task.is_background = task.priority == 0);
                }
                self.share(&mut system, tasks);
                if self.one_in(6) {
                    self.delay_releases(&mut system);
                }
                system.jobs_may_end_early = self.one_in(4);
                system
            }
            Kind::LocksAndWaits => {
                let tasks = self.within(2, 3);
                let mut system = self.tasks(tasks, 1, 4 - tasks);
                if self.one_in(4) {
                    self.synchronise(&mut system);
                }
                self.share(&mut system, tasks);
                self.wait(&mut system);
                if self.one_in(6) {
                    self.delay_releases(&mut system);
                }
                system
            }
            Kind::LocksOnSeveralCpus => {
                let tasks = if self.one_in(8) { 4 } else { 3 };
                let cpus = if self.one_in(4) { 3 } else { 2 };
                let mut system = self.tasks(tasks, 2, 1);
                self.place(&mut system, cpus);
                self.share(&mut system, tasks);
                let users = system.locks.iter().flat_map(|lock| &lock.users);
                for &(user, _) in users.filter(|_| !self.one_in(8)) {
                    system.tasks[user].cpus = 1;
                }
                if self.one_in(3) {
                    self.wait(&mut system);
                }
                system
            }
            Kind::Nested => {
                let tasks = self.within(2, 3);
                let mut system = self.tasks(tasks, 1, 2);
                match self.below(3) {
                    0 => self.wait(&mut system),
                    1 => self.delay_releases(&mut system),
                    _ => {}
                }
                self.share_ceilings(&mut system, tasks);
                if self.one_in(4) {
                    self.join(&mut system);
                }
                system
            }
            Kind::Refused => {
                let tasks = self.within(2, 3);
                let mut system = self.tasks(tasks, 1, 1);
                if self.one_in(3) {
                    self.place(&mut system, 2);
                }
                match self.below(3) {
                    0 => self.share_ceilings(&mut system, tasks),
                    _ => self.share(&mut system, tasks),
                }
                if self.one_in(3) {
                    self.wait(&mut system);
                }
                let unknown = self.below(tasks) as usize;
                // Mostly of the least priority, and sometimes without the first lock: then others have bounds.
                if self.one_in(2) {
                    system.locks[0].users.retain(|(user, _)| *user != unknown);
                }
                let task = &mut system.tasks[unknown];
                (task.is_unknown, task.nests) = (true, false);
                task.priority = if self.one_in(6) { task.priority } else { 0 };
                task.is_background = task.priority == 0 && self.one_in(2);
                (task.waits, task.times) = (vec![self.within(1, 6); task.edges.len()], Some(1));
                task.edges.iter_mut().for_each(|edge| edge.2 = edge.2.min(3));
                self.raise_above_background(&mut system);
                system
            }
            Kind::Throttled => {
                let tasks = self.within(2, 3);
                let mut system = self.tasks(tasks, 1, 1);
                if self.one_in(6) {
                    self.place(&mut system, 2);
                    system.tasks.iter_mut().filter(|it| it.cpus == 3).for_each(|it| it.cpus = 1);
                }
                match self.below(4) {
                    0 => self.share_ceilings(&mut system, tasks),
                    1 => self.wait(&mut system),
                    _ => self.share(&mut system, tasks),
                }
                if self.one_in(6) {
                    self.wait(&mut system);
                }
                self.throttle(&mut system);
                system
            }
            Kind::CallsWithMore(calls) => {
                let tasks = self.within(2, 3);
                let mut system = System::new((0..tasks).map(|_| self.light_task(tasks)).collect());
                if self.one_in(4) {
                    self.place(&mut system, 2);
                }
                let mut served = self.served(tasks);
                match self.below(3) {
                    0 => (served.time, served.wait) = (served.time + 1, 1),
                    1 => self.wait(&mut system),
                    _ => self.share(&mut system, tasks),
                }
                if self.one_in(6) && tasks == 2 && system.tasks.iter().all(|it| it.cpus == 1) {
                    self.throttle(&mut system);
                } else if self.one_in(4) {
                    self.join(&mut system);
                }
                system.serving(calls, &[served])
            }
            Kind::Threads => {
                let tasks = self.within(2, 4);
                let mut system = self.tasks(tasks, 1, if tasks == 4 { 1 } else { 2 });
                match self.below(4) {
                    0 => self.synchronise(&mut system),
                    1 => self.delay_releases(&mut system),
                    _ => {}
                }
                self.join(&mut system);
                system.jobs_may_end_early = self.one_in(4);
                system
            }
            Kind::ThreadsWithMore => {
                let what = self.below(3);
                // With four, one that waits may delay one of lower priority that is in no thread.
                let tasks = self.within(2, if what == 1 { 4 } else { 3 });
                let cpus = if tasks == 4 { 1 } else { self.within(1, 3) };
                let mut system = self.tasks(tasks, cpus.min(2), 4 - tasks.min(3));
                match what {
                    0 => {
                        system = System::new((0..tasks).map(|_| self.light_task(tasks)).collect());
                        let calls = [Calls::AtNextPeriod, Calls::BetweenPeriods][self.below(2) as usize];
                        system = system.serving(calls, &[self.served(tasks)]);
                    }
                    1 => self.wait(&mut system),
                    _ => self.share(&mut system, tasks),
                }
                self.place(&mut system, cpus);
                self.join(&mut system);
                system
            }
            Kind::Sporadic => {
                let tasks = self.within(1, 3);
                let mut system = self.tasks(tasks, 1, 4 - tasks);
                if self.one_in(3) {
                    self.delay_releases(&mut system);
                }
                self.release_at_any_distance(&mut system);
                system.jobs_may_end_early = self.one_in(4);
                system
            }
            Kind::SporadicWithMore => {
                let tasks = 3;
                let cpus = self.within(1, 3);
                let mut system = self.tasks(tasks, cpus.min(2), 1);
                self.place(&mut system, cpus);
                if self.one_in(2) {
                    let calls = [Calls::AtNextPeriod, Calls::BetweenPeriods][self.below(2) as usize];
                    system = System::new((0..tasks).map(|_| self.light_task(tasks)).collect());
                    system = system.serving(calls, &[self.served(tasks)]);
                } else {
                    self.join(&mut system);
                }
                self.release_at_any_distance(&mut system);
                system
            }
            Kind::AllCpus => {
                let tasks = self.within(3, 4);
                let mut system = self.tasks(tasks, 2, 5 - tasks);
                self.use_all(&mut system);
                if self.one_in(4) {
                    self.delay_releases(&mut system);
                }
                system.jobs_may_end_early = self.one_in(2);
                system
            }
            Kind::AllCpusWithMore => {
                let mut system = self.tasks(3, 2, 1);
                self.use_all(&mut system);
                match self.below(4) {
                    0 => self.wait(&mut system),
                    1 => self.join(&mut system),
                    2 => self.release_at_any_distance(&mut system),
                    _ => system.tasks.push(self.task(3, 1, 1)),
                }
                system
            }
        }
    }

    /// Lets all tasks use the same CPUs, and gives most of them priorities of their own.
    fn use_all(&mut self, system: &mut System) {
        let (cpus, has_order) = (if self.one_in(6) { 0b111 } else { 0b11 }, !self.one_in(4));
        for (place, task) in (0..).zip(&mut system.tasks) {
            task.cpus = cpus;
            task.priority = if has_order { 4 - place } else { task.priority };
        }
    }

    /// Lets one thread execute the jobs of several tasks, in any order.
    fn join(&mut self, system: &mut System) {
        let mates = self.within(2, system.tasks.len() as u64) as usize;
        let first = system.tasks[0].clone();
        for task in &mut system.tasks[..mates] {
            // What they ask for stays about the same, if the thread has a longer period.
            let period = first.period.max(task.period);
            task.edges.iter_mut().for_each(|edge| edge.2 = (edge.2 * first.period / period).max(1));
            task.edges.iter_mut().for_each(|edge| edge.2 = edge.2.div_ceil(mates as u64));
            (task.priority, task.period, task.deadline) = (first.priority, first.period, first.deadline);
            (task.jitter, task.offset, task.cpus, task.thread) =
                (first.jitter, first.offset, first.cpus, Some(1));
        }
        for lock in &mut system.locks {
            for (user, held) in &mut lock.users {
                *held = system.tasks[*user].greatest_cost().min(*held);
            }
        }
        let turn = self.below(system.tasks.len() as u64) as usize;
        if system.operations.is_empty() && system.locks.is_empty() {
            system.tasks.rotate_left(turn);
        }
    }

    /// Releases one task or two at any distance, sometimes in bursts.
    fn release_at_any_distance(&mut self, system: &mut System) {
        let mut left = 2;
        for task in &mut system.tasks {
            if left > 0 && task.thread.is_none() && !self.one_in(3) {
                let burst = [1, 1, 2, 3][self.below(4) as usize];
                task.edges.iter_mut().for_each(|edge| edge.2 = edge.2.div_ceil(burst));
                (task.burst, task.offset) = (Some(burst), None);
                left -= 1;
            }
            task.deadline = self.within(task.period, 3 * task.period);
        }
    }

    fn delay_releases(&mut self, system: &mut System) {
        for task in &mut system.tasks {
            task.jitter = if self.one_in(2) { self.within(1, task.period) } else { 0 };
        }
    }

    /// Lets most jobs wait, for a part of what they executed or more.
    fn wait(&mut self, system: &mut System) {
        for task in &mut system.tasks {
            if self.one_in(3) {
                continue;
            }
            let is_more = self.one_in(2);
            for edge in &mut task.edges {
                let wait = if is_more { self.within(0, task.period) } else { self.below(edge.2) };
                edge.2 = if is_more { self.within(1, edge.2) } else { edge.2 - wait };
                task.waits.push(wait);
            }
            task.times = [Some(1), Some(1), Some(2), None][self.below(4) as usize];
        }
    }

    /// Adds one lock or two.
    fn share(&mut self, system: &mut System, tasks: u64) {
        for _ in 0..self.within(1, LOCKS as u64) {
            let mut users: Vec<(usize, u64)> = Vec::new();
            while users.len() < 2 {
                let is_user = |random: &mut Random| random.one_in(2);
                users = (0..tasks as usize).filter(|_| is_user(self)).map(|user| (user, 0)).collect();
            }
            for (user, held) in &mut users {
                *held = self.within(1, system.tasks[*user].greatest_cost().min(4));
            }
            *system = system.clone().sharing(Protocol::ALL[self.below(3) as usize], &users);
        }
    }

    /// Adds two ceilings that most users take within each other. A job may hold each until it has left both.
    fn share_ceilings(&mut self, system: &mut System, tasks: u64) {
        system.locks.clear();
        while system.locks.len() < LOCKS {
            self.share(system, tasks);
        }
        system.locks.truncate(LOCKS);
        system.locks.iter_mut().for_each(|lock| lock.protocol = Protocol::Ceiling);
        let is_on_one_cpu = system.is_on_one_cpu();
        let may_wait = |system: &System, place: usize| {
            let locks = system.locks.iter().filter(|lock| lock.users.iter().any(|(user, _)| *user == place));
            // While real-time tasks are throttled, another in the background may have the second lock.
            locks.count() == LOCKS
        };
        for place in 0..system.tasks.len() {
            system.tasks[place].nests = is_on_one_cpu && may_wait(system, place) && !self.one_in(4);
        }
        // The time of the lower ceiling contains that of the higher one.
        let ceiling = |lock: &Shared| lock.users.iter().map(|(user, _)| system.tasks[*user].priority).max();
        let ceilings: Vec<_> = system.locks.iter().map(ceiling).collect();
        for (lower, higher) in [(0, 1), (1, 0)].into_iter().filter(|(a, b)| ceilings[*a] <= ceilings[*b]) {
            let above = system.locks[higher].users.clone();
            for (user, held) in &mut system.locks[lower].users {
                let of_higher = above.iter().find(|(other, _)| other == user).map_or(0, |(_, held)| *held);
                *held = of_higher.max(*held);
            }
        }
    }

    /// Tasks of the least priority are in the background, where one is: others have a greater priority.
    fn raise_above_background(&mut self, system: &mut System) {
        if system.tasks.iter().any(|task| task.is_background) {
            let real_time = system.tasks.iter_mut().filter(|task| !task.is_background);
            real_time.for_each(|task| task.priority = task.priority.max(1));
        }
    }

    /// Adds throttling of the first CPU, and lets tasks of the least priority be in the background.
    fn throttle(&mut self, system: &mut System) {
        for task in &mut system.tasks {
            task.is_background = task.priority == 0 || self.one_in(3);
            task.priority = if task.is_background { 0 } else { task.priority };
        }
        self.raise_above_background(system);
        // See `TakenWhileThrottled` in the crate `wcrt`.
        let in_background: Vec<usize> =
            (0..system.tasks.len()).filter(|&place| system.tasks[place].is_background).collect();
        let users = || system.locks.iter().flat_map(|lock| &lock.users);
        let is_woken = users().any(|(user, _)| in_background.contains(user));
        // With four tasks, a state has no room for two times of each.
        if is_woken || system.tasks.len() > 2 {
            system.tasks.iter_mut().for_each(|task| task.nests = false);
        }
        let (time, period) = (self.within(1, 3), self.within(6, 12));
        system.tasks.push(simple(9, period, time).throttling());
    }

    /// Gives most tasks an offset, and a period that has a common divisor with those of the others.
    fn synchronise(&mut self, system: &mut System) {
        for task in &mut system.tasks {
            let period = [4, 6, 8, 12][self.below(4) as usize];
            for edge in &mut task.edges {
                edge.2 = (edge.2 * period / task.period).max(1);
            }
            (task.period, task.deadline) = (period, period);
            task.offset = if self.one_in(6) { None } else { Some(self.below(period)) };
        }
    }

    fn tasks(&mut self, tasks: u64, cpus: u64, most_states: u64) -> System {
        System::new((0..tasks).map(|_| self.task(tasks, cpus, most_states)).collect())
    }

    /// Gives each task a random set of CPUs.
    fn place(&mut self, system: &mut System, cpus: u64) {
        for task in &mut system.tasks {
            task.cpus = self.within(1, (1 << cpus) - 1);
        }
    }

    fn served(&mut self, tasks: u64) -> Served {
        let provider = self.below(tasks);
        let client = (provider + self.within(1, tasks - 1)) % tasks;
        let sends = if self.one_in(6) { 2 } else { 1 };
        Served {
            provider: provider as usize,
            client: client as usize,
            sends,
            time: if self.one_in(3) { 2 } else { 1 },
            wait: 0,
        }
    }
}

/// The counts of one test.
#[derive(Default)]
struct Totals {
    explored: u64,
    too_many_states: u64,
    too_large: u64,
    /// Systems in which two tasks have equal priorities.
    tied: u64,
    /// Systems in which a CPU has a utilisation of exactly 1.
    full: u64,
    bounds: u64,
    without_bound: u64,
    /// Those of them that have none because of a lock.
    refused: u64,
    /// Bounds that are the greatest response time, by method.
    attained: [u64; 4],
    /// Bounds that are later than the period.
    late: u64,
    /// Tasks on several CPUs that have a bound and wait for others; and those whose bound is attained as well.
    waiting_on_several_cpus: u64,
    attained_on_several_cpus: u64,
    /// Those whose bound counts what all of several CPUs execute.
    on_all_cpus: u64,
    /// Tasks whose greatest response is later than a bound would be without jitter, bursts, threads and operations.
    later_than_plain: u64,
    /// Bounds that are claimed to be the greatest response time.
    claimed_exact: u64,
    /// Bounds that are less than without offsets.
    less_by_offsets: u64,
    /// Bounds in which waits of other tasks count as jitter, and those of them that are attained.
    with_late: [u64; 2],
    /// Bounds in which locks delay the task, and those of them that are attained.
    with_blocking: [u64; 2],
}

impl fmt::Display for Totals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} systems ({} fully loaded, {} with equal priorities; dropped: {} with too many states, {} with \
             too great counters); {} tasks with a bound, {} without ({} because of locks); bounds attained:",
            self.explored,
            self.full,
            self.tied,
            self.too_many_states,
            self.too_large,
            self.bounds,
            self.without_bound,
            self.refused
        )?;
        for (method, attained) in METHODS.iter().zip(self.attained) {
            write!(f, " {method} {attained}")?;
        }
        write!(
            f,
            " ({} claimed); {} less because of offsets; {} later than the period; {} on all of several CPUs; {} with several CPUs that wait, {} of \
             these attained; {} later because of jitter, bursts, threads, operations, waits or locks; {} with waits as jitter, {} of these attained; {} delayed \
             by locks, {} of these attained",
            self.claimed_exact,
            self.less_by_offsets,
            self.late,
            self.on_all_cpus,
            self.waiting_on_several_cpus,
            self.attained_on_several_cpus,
            self.later_than_plain,
            self.with_late[0],
            self.with_late[1],
            self.with_blocking[0],
            self.with_blocking[1]
        )
    }
}

impl Totals {
    /// Counts a system, and panics if a greatest response time contradicts a bound.
    fn add(&mut self, system: &System, bounds: &Bounds, greatest: &[Option<u64>]) {
        self.explored += 1;
        let mut priorities: Vec<u32> = system.tasks.iter().map(|task| task.priority).collect();
        priorities.sort_unstable();
        self.tied += u64::from(priorities.windows(2).any(|pair| pair[0] == pair[1]));
        let loads = system.analyse(Method::Psm).cpus;
        self.full +=
            u64::from(loads.iter().any(|load| load.utilisation.compare_with_one() == Ordering::Equal));
        let plain = system.plain();
        let plain_bounds = plain.map(|plain| plain.bounds(Method::Psm));
        let of_any_phase = system.has_offsets().then(|| system.without_offsets().bounds(Method::Exact));
        for (place, task) in system.tasks.iter().enumerate() {
            let Some(greatest) = greatest[place] else {
                self.without_bound += 1;
                continue;
            };
            self.bounds += 1;
            for (method, bound) in bounds.of(place).into_iter().enumerate() {
                if let Some(bound) = bound {
                    assert!(
                        greatest <= bound,
                        "a response of task {place} takes {greatest}, but its bound by {} is {bound}, in\n{system}\n{}",
                        METHODS[method],
                        schedule_of(system, place, bound)
                    );
                    self.attained[method] += u64::from(greatest == bound);
                }
            }
            if system.is_on_one_cpu()
                && system.operations.is_empty()
                && !system.has_waits_or_locks()
                && bounds.is_exact[place]
                && system.attains_every_combination()
                && let Some(exact) = bounds.exact(place)
            {
                self.claimed_exact += 1;
                assert_eq!(
                    greatest, exact,
                    "no response of task {place} takes as long as the exact one, in\n{system}"
                );
            }
            let is_attained = u64::from(bounds.exact(place) == Some(greatest));
            for (counts, is_it) in [
                (&mut self.with_late, bounds.has_late[place]),
                (&mut self.with_blocking, bounds.has_blocking[place]),
            ] {
                counts[0] += u64::from(is_it);
                counts[1] += u64::from(is_it) * is_attained;
            }
            let tightest = bounds.exact(place).or(bounds.greatest(place));
            self.late += u64::from(tightest > Some(task.period));
            self.on_all_cpus += u64::from(bounds.is_on_all_cpus[place]);
            if !task.cpus.is_power_of_two() && greatest > task.greatest_cost() {
                self.waiting_on_several_cpus += 1;
                self.attained_on_several_cpus += u64::from(tightest == Some(greatest));
            }
            if let Some(of_any_phase) = &of_any_phase {
                // Without a bound, infinite.
                let of = [bounds.exact(place), of_any_phase[place]];
                let [with, without] = of.map(|bound| bound.unwrap_or(u64::MAX));
                assert!(with <= without, "offsets made a bound greater in\n{system}");
                self.less_by_offsets += u64::from(with < without);
            }
            if let Some(bounds) = &plain_bounds {
                self.later_than_plain += u64::from(bounds[place].is_some_and(|bound| greatest > bound));
            }
        }
    }
}

/// Returns a schedule in which a response of the task at `place` takes longer than `limit`.
fn schedule_of(system: &System, place: usize, limit: u64) -> String {
    // Not above any greater limit: the others are above no bound.
    let mut limits: Vec<_> = system.tasks.iter().map(|task| Some(14 * task.period)).collect();
    limits[place] = Some(limit);
    schedule_above(system, &limits)
}

/// Returns the number of systems of each kind, of `number` in a full search.
pub(crate) fn systems_or(number: u64) -> u64 {
    search::cases("MAUVE_ORACLE_SYSTEMS", number)
}

fn explore_random_systems(kind: Kind, seed: u64) -> Totals {
    let is_larger = matches!(
        kind,
        Kind::Nested
            | Kind::Refused
            | Kind::Throttled
            | Kind::CallsWithMore(_)
            | Kind::Threads
            | Kind::ThreadsWithMore
            | Kind::Sporadic
            | Kind::SporadicWithMore
            | Kind::AllCpus
            | Kind::AllCpusWithMore
    );
    let systems = systems_or(match kind {
        // A fifth of the others is too few to count rare cases; these are explored in no time.
        Kind::Threads => 5 * FEWER_SYSTEMS,
        _ if is_larger => FEWER_SYSTEMS,
        _ => SYSTEMS,
    });
    let mut random = Random(seed + (search::seed() << 8));
    let mut totals = Totals::default();
    for tried in 0.. {
        if totals.explored == systems {
            break;
        }
        assert!(tried < 50 * systems, "too few systems can be explored: {totals}");
        let system = random.system(kind);
        let bounds = system.all_bounds();
        bounds.check_order(&system);
        totals.refused += bounds.refused;
        let limits: Vec<_> = (0..system.tasks.len()).map(|place| bounds.greatest(place)).collect();
        if limits.iter().all(Option::is_none) {
            totals.without_bound += limits.len() as u64;
            continue;
        }
        match explore(&system, &limits) {
            Outcome::Greatest(greatest) => totals.add(&system, &bounds, &greatest),
            Outcome::Above { task } => panic!(
                "a response of task {task} takes longer than its bound {:?}, in\n{system}\n{}",
                limits[task],
                schedule_above(&system, &limits)
            ),
            Outcome::TooManyStates => totals.too_many_states += 1,
            Outcome::TooLarge => totals.too_large += 1,
        }
    }
    println!("{kind:?}: {totals}");
    totals
}

/// One CPU: the bounds are not vacuous, and the difficult cases occur.
fn explore_one_cpu(tasks: u64) {
    let totals = explore_random_systems(Kind::OneCpu(tasks), tasks);
    assert!(totals.attained[1] * 2 > totals.bounds && totals.late * 50 > totals.bounds);
    assert!(totals.full * 500 > totals.explored && totals.tied * 10 > totals.explored);
}

#[test]
fn no_schedule_of_two_tasks_is_above_a_bound() {
    explore_one_cpu(2);
}

#[test]
fn no_schedule_of_three_tasks_is_above_a_bound() {
    explore_one_cpu(3);
}

#[test]
fn no_schedule_of_four_tasks_is_above_a_bound() {
    explore_one_cpu(4);
}

#[test]
fn no_schedule_of_machines_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Paths, 11);
    // The methods differ.
    let [classic, psm, _, exact] = totals.attained;
    assert!(classic < psm && psm < totals.bounds && exact * 4 > totals.bounds * 3);
    assert!(totals.late * 20 > totals.bounds && totals.full * 500 > totals.explored);
}

#[test]
fn no_schedule_on_several_cpus_is_above_a_bound() {
    let totals = explore_random_systems(Kind::SeveralCpus, 5);
    assert!(totals.attained[3] * 4 > totals.bounds && totals.late * 50 > totals.bounds);
    assert!(totals.waiting_on_several_cpus * 20 > totals.explored);
    assert!(totals.attained_on_several_cpus * 50 > totals.explored);
    assert!(totals.full * 500 > totals.explored && totals.tied * 10 > totals.explored);
    assert!(totals.without_bound > 0);
}

#[test]
fn no_schedule_on_linked_cpus_is_above_a_bound() {
    let totals = explore_random_systems(Kind::LinkedCpus, 6);
    assert!(totals.attained[3] * 4 > totals.bounds && totals.late * 50 > totals.bounds);
    assert!(totals.waiting_on_several_cpus * 10 > totals.explored);
    assert!(totals.attained_on_several_cpus * 50 > totals.explored);
    assert!(totals.tied * 10 > totals.explored && totals.without_bound > 0);
}

#[test]
fn no_schedule_with_jitter_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Jitter, 7);
    assert!(totals.attained[3] * 2 > totals.bounds && totals.late * 20 > totals.bounds);
    assert!(totals.later_than_plain * 10 > totals.explored && totals.tied * 10 > totals.explored);
    assert!(totals.full * 500 > totals.explored);
}

#[test]
fn no_schedule_with_jitter_on_several_cpus_is_above_a_bound() {
    let totals = explore_random_systems(Kind::JitterOnSeveralCpus, 8);
    assert!(totals.attained[3] * 4 > totals.bounds && totals.late * 20 > totals.bounds);
    assert!(totals.later_than_plain * 10 > totals.explored && totals.tied * 10 > totals.explored);
    assert!(totals.attained_on_several_cpus * 100 > totals.explored);
}

#[test]
fn no_schedule_with_calls_at_the_next_period_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Operations(Calls::AtNextPeriod), 9);
    assert!(totals.attained[3] * 10 > totals.bounds && totals.late * 100 > totals.bounds);
    assert!(totals.later_than_plain * 10 > totals.explored);
}

#[test]
fn no_schedule_with_calls_between_periods_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Operations(Calls::BetweenPeriods), 10);
    assert!(totals.attained[3] * 10 > totals.bounds && totals.late * 100 > totals.bounds);
    assert!(totals.later_than_plain * 10 > totals.explored);
}

#[test]
fn no_schedule_with_offsets_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Offsets, 12);
    assert!(totals.attained[3] * 2 > totals.bounds && totals.late * 50 > totals.bounds);
    assert!(totals.less_by_offsets * 10 > totals.bounds && totals.claimed_exact * 2 > totals.bounds);
}

#[test]
fn no_schedule_of_two_clocks_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Clocks, 24);
    assert!(totals.attained[3] * 2 > totals.bounds && totals.less_by_offsets * 20 > totals.bounds);
}

#[test]
fn no_schedule_with_offsets_and_jitter_is_above_a_bound() {
    let totals = explore_random_systems(Kind::OffsetsOnSeveralCpus, 13);
    assert!(totals.attained[3] * 4 > totals.bounds && totals.late * 50 > totals.bounds);
    assert!(totals.less_by_offsets * 20 > totals.bounds);
}

#[test]
fn no_schedule_with_waits_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Waits, 14);
    assert!(totals.attained[3] * 4 > totals.bounds * 3 && totals.later_than_plain * 4 > totals.bounds);
    assert!(totals.with_late[0] * 20 > totals.bounds && totals.with_late[1] * 3 > totals.with_late[0]);
    assert!(totals.late * 20 > totals.bounds && totals.tied * 10 > totals.explored);
}

#[test]
fn no_schedule_with_waits_on_several_cpus_is_above_a_bound() {
    let totals = explore_random_systems(Kind::WaitsOnSeveralCpus, 15);
    assert!(totals.attained[3] * 4 > totals.bounds * 3 && totals.later_than_plain * 5 > totals.bounds);
    assert!(totals.waiting_on_several_cpus * 10 > totals.explored);
    assert!(totals.attained_on_several_cpus * 10 > totals.explored);
}

#[test]
fn no_schedule_with_locks_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Locks, 16);
    check_locks(&totals);
    assert!(totals.attained[3] * 4 > totals.bounds * 3 && totals.late * 10 > totals.bounds);
}

#[test]
fn no_schedule_with_locks_and_waits_is_above_a_bound() {
    let totals = explore_random_systems(Kind::LocksAndWaits, 17);
    check_locks(&totals);
    assert!(totals.attained[3] * 2 > totals.bounds && totals.late * 10 > totals.bounds);
    assert!(totals.with_late[1] * 100 > totals.bounds && totals.less_by_offsets * 100 > totals.bounds);
}

#[test]
fn no_schedule_with_locks_on_several_cpus_is_above_a_bound() {
    let totals = explore_random_systems(Kind::LocksOnSeveralCpus, 18);
    check_locks(&totals);
    assert!(totals.attained[3] * 2 > totals.bounds);
}

#[test]
fn no_schedule_with_nested_ceilings_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Nested, 26);
    assert!(totals.with_blocking[0] * 5 > totals.bounds && totals.attained[3] * 2 > totals.bounds);
}

#[test]
fn no_schedule_with_a_refused_task_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Refused, 27);
    assert!(totals.refused * 5 > totals.explored && totals.attained[3] * 2 > totals.bounds);
}

#[test]
fn no_schedule_with_throttling_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Throttled, 28);
    assert!(totals.with_blocking[0] * 10 > totals.bounds && totals.attained[3] * 3 > totals.bounds);
}

#[test]
fn no_schedule_with_calls_that_wait_or_lock_is_above_a_bound() {
    let next = explore_random_systems(Kind::CallsWithMore(Calls::AtNextPeriod), 29);
    let between = explore_random_systems(Kind::CallsWithMore(Calls::BetweenPeriods), 30);
    assert!(next.with_blocking[0] * 20 > next.bounds && between.attained[3] * 10 > between.bounds);
}

#[test]
fn no_schedule_of_threads_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Threads, 20);
    assert!(totals.attained[3] * 4 > totals.bounds * 3 && totals.late * 20 > totals.bounds);
    assert!(totals.claimed_exact * 2 > totals.bounds && totals.later_than_plain * 20 > totals.bounds);
}

#[test]
fn no_schedule_of_threads_with_operations_waits_or_locks_is_above_a_bound() {
    let totals = explore_random_systems(Kind::ThreadsWithMore, 21);
    assert!(totals.attained[3] * 4 > totals.bounds && totals.later_than_plain * 10 > totals.explored);
}

#[test]
fn no_schedule_of_sporadic_tasks_is_above_a_bound() {
    let totals = explore_random_systems(Kind::Sporadic, 22);
    assert!(totals.attained[3] * 4 > totals.bounds * 3 && totals.late * 20 > totals.bounds);
    assert!(totals.claimed_exact * 2 > totals.bounds && totals.later_than_plain * 10 > totals.bounds);
}

#[test]
fn no_schedule_of_sporadic_tasks_on_several_cpus_is_above_a_bound() {
    let totals = explore_random_systems(Kind::SporadicWithMore, 23);
    assert!(totals.attained[3] * 4 > totals.bounds && totals.later_than_plain * 10 > totals.bounds);
}

#[test]
fn no_schedule_on_all_cpus_is_above_a_bound() {
    let totals = explore_random_systems(Kind::AllCpus, 24);
    assert!(totals.on_all_cpus * 5 > totals.bounds && totals.attained_on_several_cpus * 10 > totals.explored);
}

#[test]
fn no_schedule_on_all_cpus_with_more_is_above_a_bound() {
    let totals = explore_random_systems(Kind::AllCpusWithMore, 25);
    assert!(
        totals.on_all_cpus * 10 > totals.bounds && totals.attained_on_several_cpus * 20 > totals.explored
    );
}

/// Locks delay many tasks, for as long as the analysis says, and some have no bound because of them.
fn check_locks(totals: &Totals) {
    let [delayed, attained] = totals.with_blocking;
    assert!(delayed * 4 > totals.bounds && attained * 2 > delayed && totals.refused * 50 > totals.explored);
    assert!(totals.later_than_plain * 3 > totals.bounds && totals.tied * 10 > totals.explored);
}

/// The two explorations find the same without waits and locks.
#[test]
fn the_explorations_agree() {
    let mut random = Random(19);
    for kind in [Kind::OneCpu(2), Kind::SeveralCpus, Kind::LinkedCpus, Kind::Jitter, Kind::Offsets] {
        let mut compared = 0;
        while compared < 100 {
            let system = random.system(kind);
            let limits = system.bounds(Method::Exact);
            let (one, other) = (explore(&system, &limits), suspended::explore(&system, &limits));
            if matches!((&one, &other), (Outcome::Greatest(_), Outcome::Greatest(_))) {
                assert_eq!(one, other, "{kind:?}\n{system}");
                compared += 1;
            }
        }
    }
}
