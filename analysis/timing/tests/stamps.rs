//! Stamped data in simulated schedules: no effect comes later after a change, and none is older, than the bounds of its chain.
//!
//! A job reads at its start and writes at its end, as its edge says; a variable carries the value from one job to the next. What the
//! first task reads is the instant itself.
//!
//! `MAUVE_STAMPED_JOBS=10000000 cargo test --release -p mauve-timing --test main stamps:: -- --nocapture` simulates more jobs, and
//! prints the greatest and the average of the greatest observed latencies as parts of their bounds.

use std::collections::VecDeque;

use mauve_tests::search;
use mauve_timing::{
    Bound, ChainBuffer, ChainStep, CpuSet, Edge, Executed, Method, Options, Random, Schedule,
    SimulationOptions, StateMachine, Task, Tasks, Time,
};

/// The jobs of each kind of system, where the environment does not say otherwise.
const JOBS: u64 = 20_000;

/// A machine whose edges read and write.
struct Program {
    machine: StateMachine,
    reads: Vec<bool>,
    writes: Vec<bool>,
}

/// The most jobs of a machine after any job, up to one where `step` says that all has happened, from this flag on. None where a
/// cycle avoids it.
fn most_jobs(program: &Program, step: &dyn Fn(bool, usize) -> Option<bool>, flag: bool) -> Option<u32> {
    fn from(
        program: &Program,
        step: &dyn Fn(bool, usize) -> Option<bool>,
        at: (u32, bool),
        open: &mut Vec<(u32, bool)>,
    ) -> Option<u32> {
        if open.contains(&at) {
            return None;
        }
        open.push(at);
        let mut most = Some(0);
        for (index, edge) in
            program.machine.edges().iter().enumerate().filter(|(_, edge)| edge.source == at.0)
        {
            let after = match step(at.1, index) {
                None => Some(0),
                Some(flag) => from(program, step, (edge.target, flag), open),
            };
            most = most.zip(after).map(|(most, after)| most.max(1 + after));
        }
        open.pop();
        most
    }
    (0..program.machine.states())
        .try_fold(0, |most, state| Some(most.max(from(program, step, (state, flag), &mut Vec::new())?)))
}

impl Program {
    fn random(random: &mut Random, greatest: u64) -> Program {
        loop {
            let states = 1 + [0, 0, 1, 2][random.up_to(3) as usize];
            let mut ends = Vec::new();
            for source in 0..states {
                ends.push((source, (source + 1) % states));
                (0..random.up_to(1))
                    .for_each(|_| ends.push((source, random.up_to(u64::from(states) - 1) as u32)));
            }
            let edges = ends.iter().map(|&(source, target)| Edge {
                source,
                target,
                cost: Time::from_nanos(1 + random.up_to(greatest)),
            });
            let machine = StateMachine::new(states, edges.collect()).unwrap();
            let mut any = |percent| ends.iter().map(|_| random.up_to(99) < percent).collect();
            let (reads, writes) = (any(70), any(70));
            let program = Program { machine, reads, writes };
            if program.releases().is_some() {
                return program;
            }
        }
    }

    /// N: after the arrival, jobs until one writes what was read since.
    fn releases(&self) -> Option<u32> {
        let step = |has_read: bool, edge: usize| {
            let has_read = has_read || self.reads[edge];
            (!(has_read && self.writes[edge])).then_some(has_read)
        };
        most_jobs(self, &step, false)
    }

    /// D: after a job that reads, jobs without a read up to the last one that writes what was read. A cycle of them would let N be
    /// infinite.
    fn periods(&self) -> u32 {
        fn from(program: &Program, state: u32) -> u32 {
            let edges = program.machine.edges().iter().enumerate();
            let later = edges.filter(|(edge, it)| it.source == state && !program.reads[*edge]);
            let writes = later.map(|(edge, it)| match from(program, it.target) {
                0 => u32::from(program.writes[edge]),
                later => 1 + later,
            });
            writes.max().unwrap_or_default()
        }
        let edges = self.machine.edges().iter().zip(&self.reads).filter(|(_, reads)| **reads);
        edges.map(|(edge, _)| from(self, edge.target)).max().unwrap_or_default()
    }

    /// The most jobs until the next one that does this.
    fn until(&self, does: &[bool]) -> Option<u32> {
        most_jobs(self, &|_, edge| (!does[edge]).then_some(false), false)
    }
}

/// Tasks, a task for each step of a chain first, and what they do.
struct System {
    tasks: Tasks,
    programs: Vec<Program>,
    buffers: Vec<Option<u32>>,
}

#[derive(Clone, Copy)]
struct Kind {
    name: &'static str,
    cpus: u64,
    has_buffers: bool,
    is_synchronised: bool,
    has_jitter: bool,
}

fn system(random: &mut Random, kind: Kind) -> System {
    let mut from = |least: u64, greatest: u64| least + random.up_to(greatest - least);
    let steps = from(1, 4) as usize;
    let count = steps + from(0, 2) as usize;
    let periods: Vec<u64> = (0..count)
        .map(|_| match kind.is_synchronised {
            true => [100, 200, 300, 400][from(0, 3) as usize],
            false => [10, 20, 50, 100, 7, 13, 31][from(0, 6) as usize] * 10,
        })
        .collect();
    let mut tasks = Vec::new();
    for &period in &periods {
        tasks.push((
            period,
            from(1, count as u64 + 1) as u32,
            from(0, kind.cpus - 1) as u32,
            from(0, period - 1),
            from(0, 2 * period),
        ));
    }
    let percent = from(30, 85) * kind.cpus / count as u64;
    let buffers =
        (0..steps).map(|_| (kind.has_buffers && from(0, 2) > 0).then(|| from(1, 4) as u32)).collect();
    let is_late: Vec<bool> = (0..count).map(|_| kind.has_jitter && from(0, 1) == 0).collect();
    let at: Vec<bool> = (0..count).map(|_| kind.is_synchronised && from(0, 5) > 0).collect();
    let programs: Vec<Program> =
        periods.iter().map(|period| Program::random(random, period * percent / 100)).collect();
    let tasks = tasks.into_iter().zip(&programs).enumerate().map(
        |(index, ((period, priority, cpu, offset, jitter), program))| Task {
            cpus: Some(CpuSet::of(cpu)),
            deadline: None,
            offset: at[index].then_some(Time::from_nanos(offset / 10 * 10)),
            jitter: if is_late[index] { Time::from_nanos(jitter) } else { Time::ZERO },
            ..Task::new(priority, Time::from_nanos(period), program.machine.clone())
        },
    );
    System { tasks: Tasks::new(tasks.collect()), programs, buffers }
}

/// The chain of a system; none where a response time has no bound.
fn chain(system: &System) -> Option<Vec<ChainStep>> {
    let options = Options { method: Method::Best, is_brief: true };
    let analysis = system.tasks.response_times(&options, &|| ());
    let mut steps: Vec<ChainStep> = Vec::new();
    for (task, buffer) in system.buffers.iter().enumerate() {
        let program = &system.programs[task];
        let Bound::Response(response) = analysis.responses[task].bound else { return None };
        let buffer = buffer
            .filter(|_| task > 0)
            .map(|size| ChainBuffer { size, reads: program.until(&program.reads) });
        steps.push(ChainStep {
            task,
            releases: program.releases()?,
            periods: Some(program.periods()),
            write: response,
            response,
            gap: program.until(&program.writes),
            buffer,
            writes: Some(1),
            ..ChainStep::default()
        });
    }
    Some(steps)
}

/// A job: its start, its end, and its edge.
struct Ran {
    start: u64,
    end: Option<u64>,
    edge: usize,
}

fn jobs_of(schedule: &Schedule, task: usize) -> Vec<Ran> {
    let mut found: Vec<Ran> = Vec::new();
    let ends: Vec<Option<Time>> =
        schedule.jobs.iter().filter(|job| job.activity == task).map(|job| job.end).collect();
    for slice in schedule.slices.iter().filter(|slice| slice.activity == task) {
        let Executed::Edge(edge) = slice.executed else { continue };
        if slice.job as usize > found.len() {
            let end = ends[slice.job as usize - 1].map(Time::as_nanos);
            found.push(Ran { start: slice.start.as_nanos(), end, edge });
        }
    }
    found
}

/// Returns what a task writes, with its instants, of what was written to it.
fn written(jobs: &[Ran], program: &Program, mut read: impl FnMut(u64) -> Option<u64>) -> Vec<(u64, u64)> {
    let mut carried = None;
    let mut found = Vec::new();
    for job in jobs {
        if program.reads[job.edge] {
            carried = read(job.start).or(carried);
        }
        if let (true, Some(stamp), Some(end)) = (program.writes[job.edge], carried, job.end) {
            found.push((end, stamp));
        }
    }
    found
}

/// Returns the greatest latency, and the greatest age at a write, of data that is sampled from an instant on.
fn observed(system: &System, schedule: &Schedule) -> Option<(u64, u64)> {
    let all: Vec<Vec<Ran>> = (0..system.buffers.len()).map(|task| jobs_of(schedule, task)).collect();
    let began = all
        .iter()
        .map(|jobs| jobs.first().map(|job| job.start))
        .collect::<Option<Vec<u64>>>()?
        .into_iter()
        .max()?;
    let mut samples = Vec::new();
    let mut effects = written(&all[0], &system.programs[0], |now| {
        samples.push(now);
        Some(now)
    });
    for (task, jobs) in all.iter().enumerate().skip(1) {
        let cpus = [task - 1, task].map(|task| system.tasks.activities()[task].cpus);
        // At one instant, either of two CPUs may be first: the worse for registers is the reader.
        let is_seen = |write: u64, now: u64| write < now || (write == now && cpus[0] == cpus[1]);
        let (mut next, mut queue, size) = (0, VecDeque::new(), system.buffers[task]);
        let writes = effects;
        effects = written(jobs, &system.programs[task], |now| {
            while let Some(&(_, stamp)) = writes.get(next).filter(|(write, _)| is_seen(*write, now)) {
                if queue.len() == size.unwrap_or(1) as usize {
                    queue.pop_front();
                }
                queue.push_back(stamp);
                next += 1;
            }
            queue.pop_front()
        });
    }
    let ages = effects.iter().filter(|(_, stamp)| *stamp >= began).map(|(at, stamp)| at - stamp);
    // A change just after a sample shows in the first effect of a later one.
    let latency = samples.iter().filter(|sample| **sample >= began).filter_map(|sample| {
        let shown = effects.iter().position(|(_, stamp)| stamp > sample)?;
        Some(effects[shown].0 - sample)
    });
    Some((latency.max()?, ages.max()?))
}

fn check(kind: Kind) {
    let wanted = search::cases("MAUVE_STAMPED_JOBS", JOBS);
    let mut random = Random::new((search::seed() << 16) + kind.name.bytes().map(u64::from).sum::<u64>());
    let (mut jobs, mut systems, mut greatest, mut sum, mut of_search) = (0, 0_u32, 0.0_f64, 0.0, 0.0);
    while jobs < wanted {
        let system = system(&mut random, kind);
        let Some(chain) = chain(&system) else { continue };
        let Ok(bound) = system.tasks.latency(&chain, true) else { continue };
        let length = 12 * bound.latency.as_nanos();
        let mut most = 0;
        for _ in 0..3 {
            let options = SimulationOptions {
                simultaneous: random.up_to(3) == 0,
                least_time: [0, 50, 100, 100][random.up_to(3) as usize],
                heavy: [0, 30, 90][random.up_to(2) as usize],
                ..SimulationOptions::new(random.bits(), Time::from_nanos(length))
            };
            let schedule = system.tasks.simulate(&options, &|| ());
            jobs += schedule.jobs.len() as u64;
            let Some((latency, age)) = observed(&system, &schedule) else { continue };
            assert!(
                latency <= bound.latency.as_nanos(),
                "{}: {latency} > {bound:?} of {chain:?}\n{:?}\n{options:?}",
                kind.name,
                system.tasks
            );
            let at_write = bound.age_at_write.map_or(u64::MAX, Time::as_nanos);
            assert!(
                age <= at_write,
                "{}: age {age} > {bound:?} of {chain:?}\n{:?}\n{options:?}",
                kind.name,
                system.tasks
            );
            most = most.max(latency);
        }
        systems += 1;
        let share = most as f64 / bound.latency.as_nanos() as f64;
        greatest = greatest.max(share);
        sum += share;
        if systems % 16 == 1 && !kind.has_buffers {
            let way = system.tasks.longest_way(&chain, &[], 1, &|| ()).unwrap();
            assert!(
                way.latency() <= bound.latency,
                "{}: {way:?} > {bound:?} of {chain:?}\n{:?}",
                kind.name,
                system.tasks
            );
            of_search += way.latency().as_nanos() as f64 / bound.latency.as_nanos() as f64;
        }
    }
    let of_search = of_search / f64::from(systems.div_ceil(16));
    println!(
        "{}: {jobs} jobs of {systems} systems, observed at most {:.1} %, on average {:.1} % of the bound; searched {:.1} %",
        kind.name,
        100.0 * greatest,
        100.0 * sum / f64::from(systems),
        100.0 * of_search
    );
    assert!(greatest > 0.6, "{}: {greatest}", kind.name);
}

const PLAIN: Kind =
    Kind { name: "one CPU", cpus: 1, has_buffers: false, is_synchronised: false, has_jitter: false };

#[test]
fn no_data_takes_longer_than_the_latency_of_its_chain() {
    check(PLAIN);
}

#[test]
fn no_data_takes_longer_on_several_cpus_with_jitter() {
    check(Kind { name: "several CPUs, jitter", cpus: 3, has_jitter: true, ..PLAIN });
}

#[test]
fn no_data_takes_longer_through_buffers() {
    check(Kind { name: "buffers", cpus: 2, has_buffers: true, has_jitter: true, ..PLAIN });
}

#[test]
fn no_data_takes_longer_between_synchronised_tasks() {
    check(Kind { name: "synchronised", cpus: 2, is_synchronised: true, ..PLAIN });
    check(Kind {
        name: "synchronised, buffers, jitter",
        cpus: 2,
        is_synchronised: true,
        has_buffers: true,
        has_jitter: true,
    });
}
