//! Missions of small systems whose executions take longer than their times now and then: jobs are late no more often than
//! `lateness` says, even if an opponent chooses releases and edges after it has seen how long executions took. Late jobs are queued.
//!
//! `MAUVE_LATENESS=2000 cargo test --release -p mauve-timing --test main lateness:: -- --nocapture` tries more systems, and prints how
//! often jobs are late as a part of the bound.

use std::collections::VecDeque;

use mauve_timing::{
    CpuSet, Edge, Excess, Executions, Lateness, Random, StateMachine, Task, Tasks, Time, lateness,
};

/// The systems, where the environment does not say otherwise.
const SYSTEMS: u64 = 60;
/// The missions of each system, and their length.
const MISSIONS: u64 = 300;
const LENGTH: u64 = 1500;

struct System {
    tasks: Tasks,
    /// Of each task, the excess of each edge.
    excesses: Vec<Excess>,
    executions: Vec<Executions>,
    /// Of each task, the first excess of its edges.
    first: Vec<usize>,
    /// Of each task, whether the opponent chooses among edges and releases.
    is_opposed: bool,
    /// Whether all executions of a mission take long together.
    is_dependent: bool,
}

impl System {
    fn random(random: &mut Random) -> System {
        let (mut tasks, mut excesses, mut executions, mut first) = (vec![], vec![], vec![], vec![]);
        for priority in (1..=1 + random.up_to(2)).rev() {
            let period = 12 + random.up_to(30);
            let states = 1 + random.up_to(1) as u32;
            let mut ends: Vec<(u32, u32)> = (0..states).map(|it| (it, (it + 1) % states)).collect();
            (0..random.up_to(2)).for_each(|_| ends.push((0, random.up_to(u64::from(states) - 1) as u32)));
            let edges = ends.iter().map(|&(source, target)| Edge {
                source,
                target,
                cost: Time::from_nanos(1 + random.up_to(period / 3)),
            });
            let machine = StateMachine::new(states, edges.collect()).unwrap();
            first.push(excesses.len());
            executions.push((0..ends.len()).map(|edge| vec![(excesses.len() + edge, 1)]).collect());
            for _ in &ends {
                let often = 10_f64.powi(-(1 + random.up_to(2) as i32)) / 2.0;
                let seldom = often / 10.0;
                let step = |excess, probability| (Time::from_nanos(excess), probability);
                let (some, more) = (1 + random.up_to(3), 5 + random.up_to(40));
                excesses
                    .push(Excess { steps: vec![step(0, often), step(some, seldom), step(some + more, 0.0)] });
            }
            let task = Task::new(priority as u32, Time::from_nanos(period), machine);
            tasks.push(Task {
                deadline: Some(Time::from_nanos(period * (2 + random.up_to(2)) / 3)),
                jitter: Time::from_nanos(random.up_to(3)),
                is_sporadic: random.up_to(2) == 0,
                cpus: Some(CpuSet::of(0)),
                ..task
            });
        }
        System {
            tasks: Tasks::new(tasks),
            excesses,
            executions,
            first,
            is_opposed: random.up_to(1) == 0,
            is_dependent: false,
        }
    }

    fn lateness(&self, task: usize) -> Option<Lateness> {
        lateness(&self.tasks, task, &self.excesses, &self.executions, &|| ()).ok()
    }

    /// Executes a mission unit by unit. Returns which tasks were late.
    fn mission(&self, random: &mut Random) -> Vec<bool> {
        struct Running {
            next: u64,
            nominal: u64,
            state: u32,
            /// The nominal release of each open job, and what is left of it, if it has begun.
            open: VecDeque<(u64, Option<u64>)>,
            late: bool,
        }
        let all = self.tasks.all();
        let period = |task: usize| all[task].period.unwrap().as_nanos();
        let mut running: Vec<Running> = (0..all.len())
            .map(|task| {
                let nominal = random.up_to(period(task) - 1);
                let next = nominal + random.up_to(all[task].jitter.as_nanos());
                Running { next, nominal, state: 0, open: VecDeque::new(), late: false }
            })
            .collect();
        let common = random.up_to(999_999) as f64 / 1e6;
        // Whether an execution in this busy interval took longer than its time.
        let mut is_long = false;
        for now in 0..LENGTH {
            for (task, it) in running.iter_mut().enumerate() {
                let waits = self.is_opposed && all[task].is_sporadic && !is_long && random.up_to(19) > 0;
                if it.next <= now && !waits {
                    if all[task].is_sporadic {
                        it.nominal = it.nominal.max(now.saturating_sub(all[task].jitter.as_nanos()));
                    }
                    it.open.push_back((it.nominal, None));
                    it.nominal += period(task);
                    it.next = it.nominal + random.up_to(all[task].jitter.as_nanos());
                }
            }
            let chosen = (0..all.len()).find(|&task| !running[task].open.is_empty());
            let Some(task) = chosen else {
                is_long = false;
                continue;
            };
            let it = &mut running[task];
            let (nominal, left) = it.open.front_mut().unwrap();
            let left = left.get_or_insert_with(|| {
                let machine = all[task].demand.machine().unwrap();
                let edges: Vec<usize> = (0..machine.edges().len())
                    .filter(|&it2| machine.edges()[it2].source == it.state)
                    .collect();
                let riskiest = edges.iter().max_by(|a, b| {
                    let of =
                        |edge: usize| self.excesses[self.first[task] + edge].steps[usize::from(is_long)].1;
                    of(**a).total_cmp(&of(**b))
                });
                let edge = match self.is_opposed {
                    true => *riskiest.unwrap(),
                    false => edges[random.up_to(edges.len() as u64 - 1) as usize],
                };
                it.state = machine.edges()[edge].target;
                let drawn = if self.is_dependent { common } else { random.up_to(999_999) as f64 / 1e6 };
                let steps = &self.excesses[self.first[task] + edge].steps;
                let exceeded = steps.iter().take_while(|(_, probability)| drawn < *probability).count();
                is_long |= exceeded > 0;
                machine.edges()[edge].cost.as_nanos()
                    + if exceeded == 0 { 0 } else { steps[exceeded].0.as_nanos() }
            });
            *left = left.saturating_sub(1);
            if *left == 0 {
                it.late |= now + 1 - *nominal > all[task].deadline.unwrap().as_nanos();
                it.open.pop_front();
            }
        }
        for (it, task) in running.iter_mut().zip(all) {
            let is_open =
                |(nominal, _): &(u64, Option<u64>)| nominal + task.deadline.unwrap().as_nanos() <= LENGTH;
            it.late |= it.open.iter().any(is_open);
        }
        running.iter().map(|it| it.late).collect()
    }

    /// In how many missions each task was late.
    fn late(&self, missions: u64, random: &mut Random) -> Vec<u64> {
        let mut late = vec![0; self.tasks.all().len()];
        for _ in 0..missions {
            self.mission(random)
                .into_iter()
                .zip(&mut late)
                .for_each(|(is_late, count)| *count += u64::from(is_late));
        }
        late
    }
}

/// So many of `missions` would be late with a probability below 1e-6, if each is late with the probability of the bound.
fn most(missions: u64, bound: f64) -> f64 {
    let mean = missions as f64 * bound;
    mean + 5.0 * mean.sqrt() + 5.0
}

#[test]
fn no_mission_is_late_more_often_than_the_bound_says() {
    let systems = std::env::var("MAUVE_LATENESS").map_or(SYSTEMS, |it| it.parse().unwrap());
    let mut random = Random::new(20_261_127);
    let (mut bounds, mut parts, mut useful) = (0, 0.0, 0);
    for number in 0..systems {
        let system = System::random(&mut random);
        let late = system.late(MISSIONS, &mut random);
        for (task, late) in late.into_iter().enumerate() {
            let Some(found) = system.lateness(task) else { continue };
            let bound = found.within(Time::from_nanos(LENGTH));
            assert!(
                (late as f64) <= most(MISSIONS, bound),
                "system {number}, task {task}: {late} of {MISSIONS}, {found:?}"
            );
            bounds += 1;
            if bound < 1.0 {
                useful += 1;
                parts += late as f64 / MISSIONS as f64 / bound;
            }
        }
    }
    println!(
        "{bounds} bounds, {useful} below 1: late in {:.3} of the bound on average",
        parts / f64::from(useful)
    );
    assert!(bounds > systems / 3 && u64::try_from(useful).unwrap() > systems / 10);
}

/// Two of priority 1 and 2, each long once in 1,000 executions: at once only if they depend on each other.
#[test]
fn dependent_executions_are_late_more_often_than_independent_ones_could_be() {
    let task = |priority, period, cost| {
        Task::new(priority, Time::from_nanos(period), StateMachine::single(Time::from_nanos(cost)))
    };
    let excess = || Excess { steps: vec![(Time::ZERO, 1e-3), (Time::from_nanos(4), 0.0)] };
    let mut system = System {
        tasks: Tasks::new(vec![task(2, 100, 20), task(1, 100, 74)]),
        excesses: vec![excess(), excess()],
        executions: vec![vec![vec![(0, 1)]], vec![vec![(1, 1)]]],
        first: vec![0, 1],
        is_opposed: false,
        is_dependent: false,
    };
    let bound = system.lateness(1).unwrap().within(Time::from_nanos(LENGTH));
    let mut random = Random::new(7);
    let late = |system: &System, random: &mut Random| system.late(20_000, random)[1] as f64 / 20_000.0;
    assert!(bound < 2e-4 && late(&system, &mut random) <= bound + 2e-4, "{bound}");
    system.is_dependent = true;
    let dependent = late(&system, &mut random);
    assert!(dependent > 3.0 * bound, "{dependent} {bound}");
    // Without independence: the 30 executions of a mission, each with 1e-3.
    assert!(dependent < 30e-3);
}
