//! Random simulations: the schedules obey the rules of the scheduler, and no job takes longer than the bounds.
//!
//! `MAUVE_SIMULATED_JOBS=10000000 cargo test --release -p mauve-timing --test main simulation:: -- --nocapture` simulates
//! more jobs, and prints the greatest ratio of a simulated response time to its bound.

use std::time::Instant;

use mauve_tests::search;
use mauve_timing::{
    Bound, Calls, CpuSet, Demand, Edge, Executed, Lock, LockUser, Method, Needs, Options, PortWriter,
    Protocol, Random, Schedule, SimulationOptions, StateMachine, Task, TaskOperation, TaskTrigger, Tasks,
    Time, Waits,
};

/// The jobs that are compared with bounds, where the environment does not say otherwise.
const JOBS: u64 = 200_000;

struct Systems {
    random: Random,
}

impl Systems {
    fn new(seed: u64) -> Systems {
        Systems { random: Random::new(seed) }
    }

    /// A number in a range.
    fn from(&mut self, least: u64, greatest: u64) -> u64 {
        least + self.random.up_to(greatest - least)
    }

    /// A ring with chords and self-loops.
    fn machine(&mut self, greatest: u64) -> StateMachine {
        let states = self.from(1, 4) as u32;
        let spread = [1, 4, 100][self.from(0, 2) as usize];
        let mut edges = Vec::new();
        for source in 0..states {
            edges.push((source, (source + 1) % states));
            for _ in 0..self.from(0, 2) {
                edges.push((source, self.from(0, u64::from(states) - 1) as u32));
            }
        }
        let edges = edges.into_iter().map(|(source, target)| {
            let cost = self.from(greatest / spread, greatest);
            Edge { source, target, cost: Time::from_nanos(cost) }
        });
        StateMachine::new(states, edges.collect()).unwrap()
    }

    /// Activities whose greatest jobs together use about `percent` of each CPU.
    fn set(&mut self, cpus: u64, percent: u64) -> Tasks {
        let count = self.from(2, 6) * cpus;
        let activities = (0..count).map(|_| {
            let period = [10, 20, 50, 100, 1000, 7, 13, 31][self.from(0, 7) as usize] * self.from(1, 3);
            let share = self.from(0, 2 * percent * cpus / count);
            let everywhere = (1 << cpus) - 1;
            let mask = if cpus == 1 { 1 } else { self.from(1, everywhere) };
            let priority = self.from(1, 1 + count) as u32;
            let deadline = Some(Time::from_nanos(self.from(period / 2, period)));
            let machine = self.machine(period * share / 100);
            Task {
                deadline,
                cpus: Some(CpuSet(mask.into())),
                ..Task::new(priority, Time::from_nanos(period), machine)
            }
        });
        Tasks::new(activities.collect())
    }

    /// Lets some activities wait, for about as long as they execute.
    fn wait(&mut self, set: &mut Tasks) {
        for activity in set.activities_mut() {
            let Demand::Machine { machine, .. } = &activity.demand else { panic!("known") };
            let wait = |edge: &Edge| Time::from_nanos(self.from(0, 1 + edge.cost.as_nanos()));
            let waits: Vec<Time> = machine.edges().iter().map(wait).collect();
            let times = [Some(1), Some(2), Some(4), None][self.from(0, 3) as usize];
            if self.from(0, 1) == 0 {
                (activity.demand, activity.waits) =
                    Waits::with_demand(machine.clone(), &waits, times, None).unwrap();
            }
        }
    }

    /// Adds one to three locks of the activities on a CPU.
    fn share(&mut self, set: &mut Tasks, cpu: u64) {
        let on_cpu = |task: &Task| task.cpus == Some(CpuSet::of(cpu as u32));
        let on_cpu: Vec<usize> =
            (0..set.activities().len()).filter(|&it| on_cpu(&set.activities()[it])).collect();
        for _ in 0..self.from(1, 3) {
            let mut users = Vec::new();
            for &task in &on_cpu {
                let Demand::Machine { machine, .. } = &set.activities()[task].demand else { panic!("known") };
                let held = self.from(0, machine.greatest_cost().as_nanos());
                if self.from(0, 2) == 0 {
                    users.push(LockUser { task, held: Some(Time::from_nanos(held)) });
                }
            }
            let protocol = Protocol::ALL[self.from(0, 2) as usize];
            set.locks.push(Lock { name: "lock".into(), protocol, users });
        }
    }

    fn options(&mut self, length: u64) -> SimulationOptions {
        SimulationOptions {
            simultaneous: self.from(0, 3) == 0,
            least_time: [0, 50, 100, 100][self.from(0, 3) as usize],
            heavy: [0, 30, 90][self.from(0, 2) as usize],
            ..SimulationOptions::new(self.random.bits(), Time::from_nanos(length))
        }
    }
}

fn jobs_wanted() -> u64 {
    search::cases("MAUVE_SIMULATED_JOBS", JOBS)
}

#[test]
fn no_response_exceeds_its_bound() {
    compare("one CPU", &|systems| {
        let percent = systems.from(30, 90);
        systems.set(1, percent)
    });
}

#[test]
fn no_response_on_several_cpus_exceeds_its_bound() {
    compare("several CPUs, jitter", &|systems| {
        let (cpus, percent) = (systems.from(2, 3), systems.from(20, 60));
        let mut set = systems.set(cpus, percent);
        for activity in set.activities_mut() {
            let period = activity.period.unwrap().as_nanos();
            if systems.from(0, 2) == 0 {
                activity.jitter = Time::from_nanos(systems.from(0, 2 * period));
            }
        }
        set
    });
}

/// Data releases some of the activities, also each other in circles, less often than they may be.
#[test]
fn no_response_of_what_follows_its_writers_exceeds_its_bound() {
    compare("releases by data", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(20, 70));
        let mut set = systems.set(cpus, percent);
        let count = set.activities().len() as u64;
        for task in 0..count as usize {
            if count < 2 || systems.from(0, 1) == 0 {
                continue;
            }
            let faster = systems.from(1, 6);
            let is_late = systems.from(0, 3) == 0;
            let activity = &mut set.activities_mut()[task];
            let period = activity.period.unwrap().as_nanos();
            (activity.is_sporadic, activity.burst) = (true, systems.from(1, 4) / 3);
            activity.period = Some(Time::from_nanos((period / faster).max(1)));
            activity.jitter = Time::from_nanos(if is_late { systems.from(0, period) } else { 0 });
            let mut port = || {
                let writers = 1 + systems.from(0, 3) / 3;
                let writer = |systems: &mut Systems| PortWriter {
                    task: systems.from(0, count - 1) as usize,
                    writes: systems.from(1, 4).div_ceil(2),
                };
                Some((0..writers).map(|_| writer(systems)).collect())
            };
            let ports: Vec<Option<Vec<PortWriter>>> =
                if period % 2 == 0 { vec![port()] } else { vec![port(), port()] };
            let needs = [Needs::Any, Needs::All, Needs::Each][systems.from(0, 2) as usize];
            set.triggers.push(TaskTrigger { task, needs, ports });
        }
        set
    });
}

#[test]
fn no_response_with_offsets_exceeds_its_bound() {
    compare("offsets", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(30, 80));
        let mut set = systems.set(cpus, percent);
        for activity in set.activities_mut() {
            let period = [100, 200, 300, 400][systems.from(0, 3) as usize];
            let greatest = period * systems.from(1, 2 * percent) / 300;
            activity.demand = Demand::Machine { machine: systems.machine(greatest), whole: None };
            activity.period = Some(Time::from_nanos(period));
            activity.jitter = Time::from_nanos([0, 0, 20][systems.from(0, 2) as usize]);
            activity.offset =
                (systems.from(0, 4) > 0).then(|| Time::from_nanos(systems.from(0, period / 10 - 1) * 10));
        }
        set
    });
}

#[test]
fn no_response_with_operations_exceeds_its_bound() {
    compare("operations", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(10, 40));
        let mut set = systems.set(cpus, percent);
        let last = set.activities().len() as u64 - 1;
        for number in 0..3 {
            let (provider, client) = (systems.from(0, last) as usize, systems.from(0, last) as usize);
            // The last one is sent while the first one is executed.
            let during = (number == 2).then_some(0);
            let client = during.map_or(client, |first: usize| {
                let earlier: &Vec<TaskOperation> = &set.operations;
                earlier[first].provider
            });
            let (sends, time) = (systems.from(0, 2), Time::from_nanos(systems.from(0, 3)));
            // The client may send in some jobs only, or when its last call has been executed.
            let every = if during.is_none() { systems.from(0, 3) } else { 0 };
            let pending = (during.is_none() && systems.from(0, 1) == 0).then(|| systems.from(1, 2));
            set.operations.push(TaskOperation {
                provider,
                client,
                sends,
                every,
                starting: 0,
                pending,
                time,
                during,
            });
        }
        set
    });
}

#[test]
fn no_response_with_waits_exceeds_its_bound() {
    compare("waits", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(20, 60));
        let mut set = systems.set(cpus, percent);
        systems.wait(&mut set);
        set
    });
}

#[test]
fn no_response_with_locks_exceeds_its_bound() {
    compare("locks", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(20, 70));
        let mut set = systems.set(cpus, percent);
        systems.share(&mut set, cpus - 1);
        set
    });
}

#[test]
fn no_response_with_locks_and_waits_exceeds_its_bound() {
    compare("locks and waits", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(10, 40));
        let mut set = systems.set(cpus, percent);
        systems.share(&mut set, 0);
        systems.wait(&mut set);
        set
    });
}

/// Lets threads execute the jobs of two or three activities each.
fn join(systems: &mut Systems, set: &mut Tasks) {
    for (number, mates) in (0..).zip(set.activities_mut().chunks_mut(3)) {
        let first = mates[0].clone();
        let count = systems.from(2, 3) as usize;
        for activity in mates.iter_mut().take(count) {
            let Demand::Machine { machine, .. } = &activity.demand else { panic!("known") };
            let edge = |edge: &Edge| {
                let cost = u128::from(edge.cost.as_nanos()) * u128::from(first.period.unwrap().as_nanos());
                let cost = cost / u128::from(activity.period.unwrap().as_nanos());
                Edge { cost: Time::from_nanos(cost as u64), ..edge.clone() }
            };
            let edges = machine.edges().iter().map(edge).collect();
            let machine = StateMachine::new(machine.states(), edges).unwrap();
            *activity = Task {
                demand: Demand::Machine { machine, whole: None },
                thread: Some(number),
                ..first.clone()
            };
        }
    }
}

#[test]
fn no_response_of_threads_exceeds_its_bound() {
    compare("threads", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(20, 80));
        let mut set = systems.set(cpus, percent);
        for activity in set.activities_mut() {
            let jitter = systems.from(0, activity.period.unwrap().as_nanos());
            activity.jitter = Time::from_nanos([0, 0, jitter][systems.from(0, 2) as usize]);
        }
        join(systems, &mut set);
        let last = set.activities().len() as u64 - 1;
        match systems.from(0, 3) {
            0 => systems.wait(&mut set),
            1 => {
                let (provider, client) = (systems.from(0, last) as usize, systems.from(0, last) as usize);
                let time = Time::from_nanos(systems.from(1, 3));
                set.operations.push(TaskOperation {
                    provider,
                    client,
                    sends: 1,
                    time,
                    ..TaskOperation::default()
                });
            }
            _ => {}
        }
        set
    });
}

/// The first task of a thread has its overhead. The part that executes after the last one, such as the switch to the next thread, delays
/// others no more than that.
#[test]
fn no_response_exceeds_its_bound_where_a_thread_ends_with_its_overhead() {
    const OVERHEAD: u64 = 4;
    let longer = |task: &mut Task| {
        let Demand::Machine { machine, .. } = &task.demand else { panic!("known") };
        let longer = |edge: &Edge| Edge {
            cost: edge.cost.checked_add(Time::from_nanos(OVERHEAD)).unwrap(),
            ..edge.clone()
        };
        let edges = machine.edges().iter().map(longer).collect();
        let machine = StateMachine::new(machine.states(), edges).unwrap();
        task.demand = Demand::Machine { machine, whole: None };
    };
    let with_overhead = |set: &Tasks, is_first: bool| {
        let mut set = set.clone();
        let threads: Vec<Option<u32>> = set.activities().iter().map(|it| it.thread).collect();
        for (index, task) in set.activities_mut().iter_mut().enumerate() {
            let thread =
                threads[index].map(|it| threads.iter().enumerate().filter(move |of| *of.1 == Some(it)));
            let mate = thread.and_then(|mut it| if is_first { it.next() } else { it.next_back() });
            if mate.is_some_and(|(mate, _)| mate == index) {
                longer(task);
            }
        }
        set
    };
    let system = |systems: &mut Systems| {
        let (cpus, percent) = (systems.from(1, 3), systems.from(20, 70));
        let mut set = systems.set(cpus, percent);
        for activity in set.activities_mut() {
            let jitter = systems.from(0, activity.period.unwrap().as_nanos());
            activity.jitter = Time::from_nanos([0, 0, jitter][systems.from(0, 2) as usize]);
        }
        join(systems, &mut set);
        set
    };
    let (analysed, simulated) =
        (|set: &Tasks| with_overhead(set, true), |set: &Tasks| with_overhead(set, false));
    compare_as("threads and their overhead", &system, &analysed, &simulated);
}

/// Threads, then operations, locks, waits and throttling, each of them or not.
#[test]
fn no_response_with_all_of_these_exceeds_its_bound() {
    compare("locks, waits, operations, threads, throttling", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(10, 40));
        let mut set = systems.set(cpus, percent);
        let has: [bool; 4] = std::array::from_fn(|_| systems.from(0, 1) == 0);
        if has[0] {
            join(systems, &mut set);
        }
        if has[1] {
            let last = set.activities().len() as u64 - 1;
            let (provider, client) = (systems.from(0, last) as usize, systems.from(0, last) as usize);
            let time = Time::from_nanos(systems.from(1, 3));
            set.operations.push(TaskOperation {
                provider,
                client,
                sends: 1,
                time,
                ..TaskOperation::default()
            });
        }
        systems.share(&mut set, 0);
        if has[2] {
            systems.wait(&mut set);
        }
        if has[3] {
            let machine = StateMachine::single(Time::from_nanos(systems.from(1, 5)));
            let throttling = Task::new(90, Time::from_nanos(systems.from(30, 90)), machine);
            let mut all = set.activities().to_vec();
            all.push(Task { is_throttling: true, ..throttling });
            let (operations, locks) = (set.operations, set.locks);
            set = Tasks::new(all);
            (set.operations, set.locks) = (operations, locks);
        }
        set
    });
}

/// Deadlines are up to three periods.
#[test]
fn no_response_to_data_exceeds_its_bound() {
    compare("sporadic", &|systems| {
        let (cpus, percent) = (systems.from(1, 2), systems.from(20, 80));
        let mut set = systems.set(cpus, percent);
        for activity in set.activities_mut() {
            let period = activity.period.unwrap().as_nanos();
            activity.is_sporadic = systems.from(0, 2) > 0;
            activity.deadline = Some(Time::from_nanos(systems.from(period / 2, 3 * period)));
            let jitter = systems.from(0, period);
            activity.jitter = Time::from_nanos([0, 0, jitter][systems.from(0, 2) as usize]);
            if activity.is_sporadic && systems.from(0, 1) == 0 {
                activity.burst = systems.from(2, 4);
                activity.period = Some(Time::from_nanos(period * activity.burst));
            }
        }
        set
    });
}

/// Of each period, the thread executes the jobs in its order, and none of the next period before.
#[test]
fn a_thread_executes_its_jobs_one_after_another() {
    let mut systems = Systems::new(5);
    let mut executed = 0;
    for _ in 0..40 {
        let mut set = systems.set(2, 60);
        join(&mut systems, &mut set);
        let schedule = set.simulate(&systems.options(2_000), &|| ());
        let threads: Vec<Option<u32>> = set.activities().iter().map(|it| it.thread).collect();
        for thread in threads.iter().flatten() {
            let is_of_thread = |activity: usize| threads[activity] == Some(*thread);
            let slices = schedule.slices.iter().filter(|slice| is_of_thread(slice.activity));
            let order: Vec<(u64, usize)> = slices.map(|slice| (slice.job, slice.activity)).collect();
            assert!(order.is_sorted(), "{order:?}");
            executed += order.len();
            let releases = schedule.jobs.iter().filter(|job| is_of_thread(job.activity));
            let releases: Vec<_> = releases.map(|job| (job.number, job.nominal, job.release)).collect();
            assert!(releases.iter().all(|one| releases.iter().all(|it| it.0 != one.0 || it == one)));
        }
    }
    assert!(executed > 1000, "{executed}");
}

/// No window of a period has more releases than a burst, and some windows have as many.
#[test]
fn releases_of_a_burst() {
    let ns = Time::from_nanos;
    let burst = Task { burst: 3, ..Task::new(1, ns(100), StateMachine::single(ns(10))) };
    let alone = Task { is_sporadic: true, ..Task::new(2, ns(50), StateMachine::single(ns(1))) };
    let set = Tasks::new(vec![burst, alone]);
    let schedule = set.simulate(&SimulationOptions::new(1, ns(100_000)), &|| ());
    for (activity, burst, period) in [(0, 3, 100), (1, 1, 50)] {
        let jobs = schedule.jobs.iter().filter(|job| job.activity == activity);
        let releases: Vec<u64> = jobs.map(|job| job.release.as_nanos()).collect();
        let distances: Vec<u64> = releases.windows(burst + 1).map(|it| it[burst] - it[0]).collect();
        assert_eq!(distances.iter().min(), Some(&period));
        assert!(distances.iter().any(|distance| *distance > 2 * period) && distances.len() > 500);
    }
}

/// Compares the responses of random systems with their bounds.
fn compare(what: &str, system: &dyn Fn(&mut Systems) -> Tasks) {
    compare_as(what, system, &Tasks::clone, &Tasks::clone);
}

/// Compares the bounds of a system as it is analysed with the responses of it as it is simulated.
fn compare_as(
    what: &str,
    system: &dyn Fn(&mut Systems) -> Tasks,
    analysed: &dyn Fn(&Tasks) -> Tasks,
    simulated: &dyn Fn(&Tasks) -> Tasks,
) {
    let methods = [Method::Classic, Method::Psm, Method::Ibf, Method::Exact];
    // The greatest ratio of a response to its bound, and the number of compared activities, by method.
    let mut greatest = [(0.0_f64, 0_u64, 0_u64); 4];
    let mut systems = Systems::new(1 + (search::seed() << 8));
    let (wanted, mut jobs, mut seed) = (jobs_wanted(), 0, search::seed() << 20);
    let first = seed;
    let mut simulating = std::time::Duration::ZERO;
    while jobs < wanted {
        seed += 1;
        let system = system(&mut systems);
        let (set, simulated) = (analysed(&system), simulated(&system));
        let bounds =
            methods.map(|method| set.response_times(&Options { method, is_brief: false }, &|| ()).responses);
        for _ in 0..5 {
            let mut options = systems.options(2_000);
            options.keeps_schedule = false;
            options.calls = [Calls::AtJobs, Calls::BetweenJobs][systems.from(0, 1) as usize];
            let start = Instant::now();
            let schedule = simulated.simulate(&options, &|| ());
            simulating += start.elapsed();
            for (activity, statistics) in schedule.statistics.iter().enumerate() {
                let statistics = statistics.unwrap();
                jobs += statistics.jobs;
                let Some(found) = statistics.greatest else { continue };
                for (bounds, (ratio, compared, reached)) in bounds.iter().zip(&mut greatest) {
                    let Bound::Response(bound) = bounds[activity].bound else { continue };
                    assert!(
                        found <= bound,
                        "system {seed}, activity {activity}: {found} > {bound}\n{set:?}\n{options:?}"
                    );
                    *ratio = ratio.max(found.as_nanos() as f64 / bound.as_nanos() as f64);
                    *compared += 1;
                    *reached += u64::from(found == bound);
                    let deadline = set.activities()[activity].deadline.unwrap();
                    assert!(bound > deadline || statistics.misses == 0, "system {seed}, activity {activity}");
                }
            }
        }
    }
    println!(
        "{what}: {jobs} jobs of {} systems, {:.1} million jobs/s",
        seed - first,
        jobs as f64 / simulating.as_secs_f64() / 1e6
    );
    for (method, (ratio, compared, reached)) in methods.iter().zip(greatest) {
        println!(
            "{what}, {method}: greatest ratio {ratio:.4}; {compared} responses compared, {reached} equal to their bound"
        );
        // Otherwise nothing was compared, or every bound is too long.
        assert!(ratio > 0.99 && compared * 200 > wanted, "{method}");
    }
}

/// The speed for ten activities, without the schedule.
#[test]
fn the_speed_for_ten_activities() {
    let mut systems = Systems::new(2);
    let mut activities = Vec::new();
    while activities.len() < 10 {
        activities.extend(systems.set(1, 70).activities().to_vec());
    }
    activities.truncate(10);
    for (index, activity) in activities.iter_mut().enumerate() {
        let period = [10, 20, 50, 100, 100][index % 5] * 1000;
        activity.period = Some(Time::from_nanos(period));
        activity.deadline = activity.period;
        activity.demand = Demand::Machine { machine: systems.machine(period * 7 / 100), whole: None };
    }
    let set = Tasks::new(activities);
    let frequency: f64 = set.activities().iter().map(|it| 1.0 / it.period.unwrap().as_nanos() as f64).sum();
    let length = (jobs_wanted() as f64 / frequency) as u64;
    let options =
        SimulationOptions { keeps_schedule: false, ..SimulationOptions::new(1, Time::from_nanos(length)) };
    let start = Instant::now();
    let schedule = set.simulate(&options, &|| ());
    let jobs: u64 = schedule.statistics.iter().flatten().map(|it| it.jobs).sum();
    println!(
        "{jobs} jobs in {:.2?}: {:.1} million/s",
        start.elapsed(),
        jobs as f64 / start.elapsed().as_secs_f64() / 1e6
    );
    assert!(jobs > jobs_wanted() / 10 * 9);
}

/// The work of each job, from its slices.
fn executed_of(schedule: &Schedule, activity: usize, job: u64) -> Vec<(u64, u64)> {
    let slices = schedule.slices.iter().filter(|slice| (slice.activity, slice.job) == (activity, job));
    slices.map(|slice| (slice.start.as_nanos(), slice.end.as_nanos())).collect()
}

/// Checks a schedule without operations against the rules, one nanosecond after the other.
fn check(set: &Tasks, schedule: &Schedule) {
    let end = schedule.end.as_nanos();
    let cpus_of = |activity: usize| set.activities()[activity].cpus.unwrap();
    let priority = |activity: usize| set.activities()[activity].priority;
    // What each CPU executes in each nanosecond.
    let mut cpus = vec![[None; 4]; end as usize];
    for slice in &schedule.slices {
        assert!(cpus_of(slice.activity).contains(slice.cpu), "{slice:?}");
        for now in slice.start.as_nanos()..slice.end.as_nanos() {
            let executes = &mut cpus[now as usize][slice.cpu as usize];
            assert_eq!(*executes, None, "two on one CPU: {slice:?}");
            *executes = Some(slice.activity);
        }
    }
    let mut is_ready = vec![vec![false; end as usize]; set.activities().len()];
    for job in &schedule.jobs {
        let slices = executed_of(schedule, job.activity, job.number);
        let ended = job.end.map_or(end, Time::as_nanos);
        assert!(slices.first().is_none_or(|(start, _)| *start >= job.release.as_nanos()));
        assert!(slices.last().is_none_or(|(_, last)| *last <= ended));
        assert!(job.end.is_none() || slices.last().is_some_and(|(_, last)| *last == ended), "{job:?}");
        is_ready[job.activity][job.release.as_nanos() as usize..ended as usize].fill(true);
        let edges: Vec<usize> = schedule
            .slices
            .iter()
            .filter(|slice| (slice.activity, slice.job) == (job.activity, job.number))
            .map(|slice| match slice.executed {
                Executed::Edge(edge) => edge,
                Executed::Operation(_) => panic!("no operations"),
            })
            .collect();
        assert!(edges.windows(2).all(|pair| pair[0] == pair[1]), "one edge for each job");
        if let (Some(edge), Demand::Machine { machine, .. }) =
            (edges.first(), &set.activities()[job.activity].demand)
        {
            let executed: u64 = slices.iter().map(|(start, end)| end - start).sum();
            assert!(executed <= machine.edges()[*edge].cost.as_nanos());
        }
    }
    for now in 0..end as usize {
        for (activity, is_ready) in is_ready.iter().enumerate() {
            let on = cpus[now].iter().filter(|executes| **executes == Some(activity)).count();
            assert!(on <= 1, "{activity} is on two CPUs at {now}");
            assert!(on == 0 || is_ready[now], "{activity} executes without a job at {now}");
            if on == 0 && is_ready[now] {
                for cpu in cpus_of(activity).iter() {
                    let other = cpus[now][cpu as usize].map(priority);
                    assert!(
                        other >= Some(priority(activity)),
                        "{activity} waits at {now}, CPU {cpu} executes {other:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn schedules_obey_the_scheduler() {
    let mut systems = Systems::new(3);
    for index in 0..400 {
        let cpus = systems.from(1, 4);
        let percent = systems.from(30, 130);
        let mut set = systems.set(cpus, percent);
        if index % 3 == 0 {
            set.activities_mut().iter_mut().for_each(|it| it.jitter = Time::from_nanos(systems.from(0, 30)));
        }
        let schedule = set.simulate(&systems.options(400), &|| ());
        check(&set, &schedule);
        // A job takes the edge that follows that of the job before.
        for activity in 0..set.activities().len() {
            let Demand::Machine { machine, .. } = &set.activities()[activity].demand else { panic!("known") };
            let of_activity = schedule.slices.iter().filter(|slice| slice.activity == activity);
            let mut path: Vec<(u64, usize)> = of_activity
                .map(|slice| match slice.executed {
                    Executed::Edge(edge) => (slice.job, edge),
                    Executed::Operation(_) => panic!("no operations"),
                })
                .collect();
            path.dedup();
            for pair in path.windows(2) {
                assert_eq!(pair[0].0 + 1, pair[1].0);
                assert_eq!(machine.edges()[pair[0].1].target, machine.edges()[pair[1].1].source);
            }
        }
    }
}

#[test]
fn calls_are_sent_and_executed() {
    let mut systems = Systems::new(4);
    for calls in [Calls::AtJobs, Calls::BetweenJobs] {
        let mut executed = 0;
        for _ in 0..200 {
            let cpus = systems.from(1, 3);
            let mut set = systems.set(cpus, 40);
            let last = set.activities().len() as u64 - 1;
            let operation = |systems: &mut Systems| TaskOperation {
                provider: systems.from(0, last) as usize,
                client: systems.from(0, last) as usize,
                sends: systems.from(0, 2),
                time: Time::from_nanos(systems.from(0, 3)),
                ..TaskOperation::default()
            };
            set.operations = (0..2).map(|_| operation(&mut systems)).collect();
            let schedule = set.simulate(&SimulationOptions { calls, ..systems.options(2000) }, &|| ());
            let slices = schedule.slices.iter();
            for slice in slices {
                if let Executed::Operation(operation) = slice.executed {
                    assert_eq!(slice.activity, set.operations[operation].provider);
                    executed += 1;
                }
            }
            for cpu in 0..cpus as u32 {
                let of_cpu: Vec<_> = schedule.slices.iter().filter(|slice| slice.cpu == cpu).collect();
                assert!(of_cpu.windows(2).all(|pair| pair[0].end <= pair[1].start));
            }
        }
        assert!(executed > 1000, "{executed}");
    }
}
