//! Random systems: no time is above its bound.

use mauve_tests::search;
use mauve_timing::{ChainRule, Needs, Time};

use super::core::{
    Core, Edge, Statement,
    Statement::{Clear, Compute, Merge, Move, Read, ReadOrSkip, Write},
    looping,
};
use super::explore::{Greatest, explore, greatest_responses};
use super::system::{System, Task, task};
use crate::reachability::random::{Random, systems_or};

/// The number of systems of each kind, unless the environment says otherwise.
const SYSTEMS: u64 = 500;

/// A kind of random systems.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    OneCpu,
    SeveralCpus,
    Jitter,
    Buffers,
    Synchronised,
    /// Data releases some of the tasks.
    Triggers,
    /// Data at any or at all of two ports releases the task that a chain reaches, or begins with.
    SeveralTriggers,
    /// Chains that data releases, whose steps share CPUs with each other and with other tasks.
    Transactions,
    /// Data releases tasks less often than they may be.
    Released,
    /// One thread executes two or three of the tasks.
    Threads,
    /// Tasks on a CPU each that read at their start and write at their end.
    Apart,
    /// The same with synchronised clocks, and no jitter.
    ApartAndSynchronised,
}

impl Random {
    /// Returns a program that mostly writes what it reads, or any.
    fn program(&mut self, is_any: bool) -> Vec<Statement> {
        let mut program = Vec::new();
        if is_any {
            for _ in 0..self.within(1, 5) {
                let statement = self.statement();
                program.push(statement);
            }
        } else {
            if self.one_in(4) {
                program.push(Compute(1));
            }
            program.push(if self.one_in(3) { ReadOrSkip(0) } else { Read(0) });
            if self.one_in(4) {
                let statement = self.statement();
                program.push(statement);
            }
            if self.one_in(2) {
                program.push(Compute(self.within(1, 2) as u8));
            }
            program.push(Write(0));
            if self.one_in(3) {
                let statement = self.statement();
                program.push(statement);
            }
        }
        let is_timed = |it: &Statement| matches!(it, Compute(_));
        if !program.iter().any(is_timed) || program.iter().any(|it| matches!(it, ReadOrSkip(_))) {
            program.push(Compute(1));
        }
        program
    }

    fn statement(&mut self) -> Statement {
        let [one, other] = [0, 0].map(|_| self.below(2) as usize);
        match self.below(9) {
            0 => Compute(1),
            1..4 => Read(one),
            4 => ReadOrSkip(one),
            5 => Move(one, 1 - one),
            6 => Merge(one, 1 - one),
            7 if self.one_in(3) => Clear(one),
            _ => Write(other),
        }
    }

    fn core(&mut self) -> Core {
        let states = if self.one_in(2) { 1 } else { self.within(2, 3) };
        let mut edges: Vec<Edge> = Vec::new();
        let any = |random: &mut Random| random.below(states) as usize;
        for source in (0..states as usize).chain((0..self.below(3)).map(|_| 0)) {
            let target = any(self);
            let is_any = self.one_in(8);
            edges.push(Edge { source, target, program: self.program(is_any) });
        }
        Core { edges }
    }

    /// Returns tasks that execute on a CPU each.
    fn apart(&mut self, is_synchronised: bool) -> System {
        let task = |random: &mut Random, cpu: usize| {
            let period = random.within(2, 5);
            let cost = random.within(1, period.min(3) - 1);
            let core = looping(&[&[Read(0), Compute(cost as u8), Write(0)]]);
            let task = task(cpu, random.below(3) as u32, period as u8, core);
            match is_synchronised {
                true => task.offset(random.below(period) as u8),
                false => task.jitter(random.below(period - cost + 1) as u8),
            }
        };
        let count = self.within(1, 3) as usize;
        System::new((0..count).map(|cpu| task(self, cpu)).collect())
    }

    /// Returns a chain whose first task alone has a clock, and other tasks of any priority.
    fn transaction(&mut self) -> System {
        let chain = self.within(2, 3) as usize;
        let count = if self.one_in(6) { chain } else { self.within(chain as u64 + 1, 4) as usize };
        let (cpus, period) = (self.within(1, 2), self.within(4, 9));
        let task = |random: &mut Random, place: usize| {
            let is_other = place >= chain;
            let cost = Compute(if random.one_in(3) { 2 } else { 1 });
            let core = match random.below(12) {
                _ if is_other => looping(&[&[cost]]),
                0 => random.core(),
                1 => looping(&[&[Read(0), cost, Write(0), Compute(1)]]),
                2 => looping(&[&[Read(0), cost, Write(0)], &[Read(0), Compute(1), Write(0)]]),
                _ => looping(&[&[Read(0), cost, Write(0)]]),
            };
            let of_step = if random.one_in(2) { period } else { random.within(1, period + 1) };
            let period = if is_other {
                random.within(2, 6)
            } else if place == 0 {
                period
            } else {
                of_step
            };
            let is_triggered = place > 0 && !is_other && !random.one_in(8);
            let task = task(random.below(cpus) as usize, random.below(4) as u32, period as u8, core);
            Task {
                jitter: if random.one_in(5) { random.below(period.min(3)) as u8 } else { 0 },
                buffer: (is_triggered && random.one_in(20)).then_some(1),
                trigger: is_triggered.then(|| if random.one_in(20) { 2 } else { 1 }),
                ..task
            }
        };
        let tasks = (0..count).map(|place| task(self, place)).collect();
        System { chain, is_early: self.one_in(3), ..System::new(tasks) }
    }

    fn chain(&mut self, kind: Kind) -> System {
        if kind == Kind::Transactions {
            return self.transaction();
        }
        if matches!(kind, Kind::Apart | Kind::ApartAndSynchronised) {
            return self.apart(kind == Kind::ApartAndSynchronised);
        }
        let count = if self.one_in(12) { 1 } else { self.within(2, 3) };
        let cpus = if kind == Kind::OneCpu { 1 } else { 3 };
        let has_jitter = kind == Kind::Jitter || kind != Kind::OneCpu && self.one_in(5);
        let (is_common, common) = (self.one_in(3), self.within(2, 5));
        let has_buffer = |random: &mut Random| match kind {
            Kind::Buffers => !random.one_in(4),
            Kind::Synchronised | Kind::Triggers | Kind::SeveralTriggers | Kind::Threads => random.one_in(4),
            _ => false,
        };
        let task = |random: &mut Random| {
            let core = random.core();
            let period = if is_common { common } else { random.within(2, 5) } as u8;
            let task = task(random.below(cpus) as usize, random.below(4) as u32, period, core);
            let has_offset = kind == Kind::Synchronised && !random.one_in(8);
            Task {
                jitter: if has_jitter { random.below(u64::from(period).min(3)) as u8 } else { 0 },
                offset: has_offset.then(|| random.below(u64::from(period)) as u8),
                buffer: has_buffer(random).then(|| random.within(1, 3) as u8),
                ..task
            }
        };
        let mut tasks: Vec<Task> = (0..count).map(|_| task(self)).collect();
        let mut chain = if count > 1 && self.one_in(4) { tasks.len() - 1 } else { tasks.len() };
        let mut first = 0;
        if kind == Kind::Triggers {
            for task in tasks[..chain].iter_mut().skip(1) {
                if self.one_in(4) {
                    continue;
                }
                task.trigger = Some(if self.one_in(5) { 2 } else { 1 });
                if self.one_in(2) {
                    task.core = looping(&[&[Read(0), Compute(1), Write(0)]]);
                }
            }
            first = usize::from(chain > 1 && self.one_in(6));
        }
        if kind == Kind::Threads {
            let [one, other] = [0, 1].map(|_| self.below(tasks.len() as u64) as usize);
            let like = tasks[one].clone();
            for place in (0..tasks.len()).filter(|it| *it <= one.max(other) && *it >= one.min(other)) {
                let of = tasks[place].clone();
                if place == one || place == other || self.one_in(2) {
                    tasks[place] =
                        Task { core: of.core, buffer: of.buffer, is_in_thread: true, ..like.clone() };
                }
            }
        }
        let is_reversed = kind == Kind::Threads && self.one_in(2);
        let mut second = None;
        if kind == Kind::Released {
            return self.released();
        }
        if kind == Kind::SeveralTriggers {
            while tasks.len() < 3 {
                tasks.push(task(self));
            }
            chain = 2;
            first = usize::from(self.one_in(4));
            let of_reader = &mut tasks[1];
            of_reader.trigger = Some(if self.one_in(5) { 2 } else { 1 });
            if self.one_in(2) {
                of_reader.core = looping(&[&[Read(0), Compute(1), Write(0)]]);
            }
            // It reads no port.
            let writes: &[Statement] =
                if self.one_in(3) { &[Write(0), Compute(1)] } else { &[Compute(1), Write(0)] };
            tasks[2].core = looping(&[writes]);
            tasks[2].buffer = None;
            second = Some((1, if self.one_in(2) { Needs::Any } else { Needs::All }));
        }
        System { tasks, first, chain, is_reversed, is_early: self.one_in(3), second }
    }
}

impl Random {
    /// Returns tasks whose writers release them less often than their least distance says, mostly on one CPU.
    fn released(&mut self) -> System {
        let cpus = if self.one_in(3) { 2 } else { 1 };
        let count = self.within(2, 3);
        let mut tasks: Vec<Task> = Vec::new();
        for place in 0..count {
            let writes: &[Statement] = match self.below(4) {
                0 => &[Read(0), Write(0), Compute(1), Write(0)],
                1 => &[Read(0), Compute(2), Write(0)],
                _ => &[Read(0), Compute(1), Write(0)],
            };
            let core = if self.one_in(4) { self.core() } else { looping(&[writes]) };
            let is_triggered = place > 0 && (place == 1 || self.one_in(2));
            let period = if is_triggered { self.within(1, 3) } else { self.within(3, 7) };
            let of = task(self.below(cpus) as usize, self.below(4) as u32, period as u8, core);
            let jitter = if self.one_in(4) { self.within(1, 2).min(period - 1) as u8 } else { 0 };
            let trigger = is_triggered.then(|| if self.one_in(6) { 2 } else { 1 });
            tasks.push(Task { jitter, trigger, ..of });
        }
        let has_second = count == 3 && tasks[2].trigger.is_none();
        let second = has_second.then(|| (1, if self.one_in(2) { Needs::Any } else { Needs::All }));
        let chain = if has_second { 2 } else { tasks.len() };
        System { tasks, first: 0, chain, is_reversed: false, is_early: self.one_in(3), second }
    }
}

/// What was found in the systems of one kind.
#[derive(Default, Debug)]
struct Totals {
    tried: u64,
    explored: u64,
    too_many: u64,
    /// Bounds that a schedule attains: of the reaction, the age until replaced, and the age at a write; each with their number.
    attained: [[u64; 2]; 3],
    /// Chains of one, two and three tasks.
    steps: [u64; 3],
    less_by_priority: u64,
    /// Bounds of the reaction that are attained, and all, where they are less since the steps do not delay each other.
    apart: [u64; 2],
    with_earlier_write: u64,
    /// With one buffer that costs no time, and others; each with the number of attained bounds of the reaction.
    buffers: [[u64; 2]; 2],
    /// Bounds of the reaction that are attained, and all: where data releases the task that it reaches, and where the time between such
    /// releases counts.
    triggers: [[u64; 2]; 2],
    /// Bounds of the reaction that are attained, and all: where data at any of two ports releases a task, and at both.
    needs: [[u64; 2]; 2],
    /// Chains with data that a later task of a thread reads in the same job, and that an earlier one reads in the next.
    in_thread: [u64; 2],
}

impl Totals {
    fn add(&mut self, system: &System) {
        self.tried += 1;
        let Some(bounds) = system.bounds(true) else { return };
        let most = 1 + bounds.latency.max(bounds.age_at_write.unwrap_or(0));
        let Some(found) = explore(system, most) else {
            self.too_many += 1;
            return;
        };
        self.explored += 1;
        let Greatest { reaction, age, age_at_write } = found;
        let age = Some(bounds.latency).filter(|_| bounds.keeps).map(|bound| (age, bound));
        let at_write = bounds.age_at_write.map(|bound| (age_at_write, bound));
        let all = [Some((reaction, bounds.latency)), age, at_write];
        for (place, (found, bound)) in all.into_iter().enumerate().filter_map(|(it, all)| Some((it, all?))) {
            assert!(found <= bound, "{place}: {found} is above {bound}, {bounds:?} of\n{system:?}");
            self.attained[place][0] += u64::from(found == bound);
            self.attained[place][1] += 1;
        }
        let without = system.bounds(false).unwrap().latency;
        assert!(bounds.latency <= without, "priorities made a bound greater in\n{system:?}");
        self.less_by_priority += u64::from(bounds.latency < without);
        self.apart[0] += u64::from(bounds.is_apart && reaction == bounds.latency);
        self.apart[1] += u64::from(bounds.is_apart);
        self.with_earlier_write += u64::from(bounds.has_earlier_write);
        let parts = &bounds.found.parts;
        let mut buffers =
            parts.iter().zip(&system.tasks[system.first..]).skip(1).filter(|(_, task)| task.buffer.is_some());
        if let (Some((part, _)), None) = (buffers.next(), buffers.next()) {
            let [all, attained] = &mut self.buffers[usize::from(part.buffer > Time::ZERO)];
            *all += 1;
            *attained += u64::from(reaction == bounds.latency);
        }
        self.steps[system.chain - system.first - 1] += 1;
        for (number, rule) in [ChainRule::SameJob, ChainRule::NextJob].into_iter().enumerate() {
            self.in_thread[number] += u64::from(parts.iter().any(|part| part.rule == rule));
        }
        if let Some((_, needs)) = system.second {
            let [attained, all] = &mut self.needs[usize::from(needs == Needs::All)];
            *attained += u64::from(reaction == bounds.latency);
            *all += 1;
        }
        let by_data = parts.iter().any(|part| part.by_data);
        let with_releases = system.tasks[system.first..]
            .iter()
            .zip(parts)
            .any(|(task, part)| task.trigger.is_some() && (!part.by_data || part.periods > Time::ZERO));
        for (number, is_of) in [by_data, with_releases].into_iter().enumerate() {
            self.triggers[number][0] += u64::from(is_of && reaction == bounds.latency);
            self.triggers[number][1] += u64::from(is_of);
        }
    }
}

fn explore_random_chains(kind: Kind, seed: u64) -> Totals {
    let systems = systems_or(SYSTEMS);
    let mut random = Random(seed + (search::seed() << 8));
    let mut totals = Totals::default();
    while totals.explored < systems {
        assert!(totals.tried < 100 * systems, "too few systems can be explored: {totals:?}");
        totals.add(&random.chain(kind));
    }
    println!("{kind:?}: {totals:?}");
    totals
}

#[test]
fn no_data_on_one_cpu_is_older_than_a_bound() {
    let totals = explore_random_chains(Kind::OneCpu, 1);
    assert!(totals.less_by_priority * 10 > totals.explored, "{totals:?}");
}

#[test]
fn no_data_on_several_cpus_is_older_than_a_bound() {
    explore_random_chains(Kind::SeveralCpus, 2);
}

#[test]
fn no_data_with_jitter_is_older_than_a_bound() {
    explore_random_chains(Kind::Jitter, 3);
}

#[test]
fn no_data_in_buffers_is_older_than_a_bound() {
    explore_random_chains(Kind::Buffers, 4);
}

#[test]
fn no_data_of_synchronised_clocks_is_older_than_a_bound() {
    explore_random_chains(Kind::Synchronised, 5);
}

#[test]
fn no_data_that_releases_tasks_is_older_than_a_bound() {
    let totals = explore_random_chains(Kind::Triggers, 9);
    let [[attained, all], [_, with_releases]] = totals.triggers;
    assert!(
        attained * 10 > all && all * 3 > totals.explored && with_releases * 20 > totals.explored,
        "{totals:?}"
    );
}

/// Both ports matter: a bound of either kind is attained, and data arrives by which the task does not wait for the other port.
#[test]
fn no_data_that_releases_tasks_at_several_ports_is_older_than_a_bound() {
    let totals = explore_random_chains(Kind::SeveralTriggers, 11);
    let [any, all] = totals.needs;
    assert!(
        [any, all].iter().all(|[attained, of]| attained * 100 > *of && of * 4 > totals.explored),
        "{totals:?}"
    );
}

/// Also where tasks between two steps let one delay the other, and where a job does not end with its write.
#[test]
fn no_data_of_a_transaction_is_older_than_a_bound() {
    let totals = explore_random_chains(Kind::Transactions, 12);
    let [attained, all] = totals.apart;
    assert!(all * 10 > totals.explored && attained * 3 > all, "{totals:?}");
}

/// Response times, also of tasks that no data releases, where data releases some of them less often than their least distance says.
#[test]
fn no_response_of_tasks_that_follow_their_writers_is_above_a_bound() {
    let systems = systems_or(SYSTEMS) / 2;
    let mut random = Random(12 + (search::seed() << 8));
    // Bounds that are attained, all of them, their sum, and that of the found responses: those that are less by the writers, and the others.
    let (mut explored, mut tried, mut less, mut others) = (0, 0, [0; 4], [0; 4]);
    while explored < systems {
        tried += 1;
        assert!(tried < 100 * systems, "too few systems can be explored: {explored}");
        let kind =
            [Kind::Released, Kind::Released, Kind::Triggers, Kind::SeveralTriggers][random.below(4) as usize];
        let system = random.chain(kind);
        let [bounds, by_distance] = system.responses();
        let Some(most) = bounds.iter().flatten().max() else { continue };
        let Some(found) = greatest_responses(&system, most + 1) else { continue };
        explored += 1;
        for (task, bound) in bounds.iter().enumerate() {
            assert!(bound.is_some() || by_distance[task].is_none(), "a bound is lost: {system:?}");
            let Some(bound) = *bound else { continue };
            assert!(found[task] <= bound, "{task}: {} is above {bound} in\n{system:?}", found[task]);
            assert!(by_distance[task].is_none_or(|it| bound <= it), "a greater bound in\n{system:?}");
            let of = if by_distance[task] == Some(bound) { &mut others } else { &mut less };
            let of_task = [u64::from(found[task] == bound), 1, bound, found[task]];
            of.iter_mut().zip(of_task).for_each(|(sum, it)| *sum += it);
        }
    }
    println!("{explored} of {tried} systems; less by their writers: {less:?}, others: {others:?}");
    assert!(less[1] * 5 > explored && less[3] * 3 > less[2], "{less:?} of {explored}");
}

#[test]
fn no_data_within_a_thread_is_older_than_a_bound() {
    let totals = explore_random_chains(Kind::Threads, 10);
    let [same_job, next_job] = totals.in_thread;
    assert!(same_job * 10 > totals.explored && next_job * 10 > totals.explored, "{totals:?}");
}

/// The bounds are the greatest times: of that many kinds.
fn check_equality(kind: Kind, seed: u64, kinds: usize) {
    let totals = explore_random_chains(kind, seed);
    let is_attained = |[attained, all]: &[u64; 2]| attained == all && *all == totals.explored;
    assert!(totals.attained[..kinds].iter().all(is_attained), "{totals:?}");
    assert!(totals.steps.iter().all(|steps| steps * 5 > totals.explored), "{totals:?}");
}

/// But not the age at a write: a job that reads late because of its jitter also writes late.
#[test]
fn the_bounds_of_tasks_apart_are_attained() {
    check_equality(Kind::Apart, 6, 2);
}

#[test]
fn the_bounds_of_synchronised_tasks_apart_are_attained() {
    check_equality(Kind::ApartAndSynchronised, 7, 3);
}

/// Where data may never be written, there is a schedule in which it is not.
#[test]
fn what_may_never_be_written_has_such_a_schedule() {
    let mut random = Random(8);
    let mut without_bound = 0;
    while without_bound < 50 {
        let core = random.core();
        if core.facts(true).releases.is_none() {
            let system = System::new(vec![task(0, 0, 9, core)]);
            assert_eq!(explore(&system, 300).unwrap().reaction, 300, "{system:?}");
            without_bound += 1;
        }
    }
}
