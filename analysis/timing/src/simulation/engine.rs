//! The simulation itself: from one event to the next. An event is a release, the end of a wait, or an instant at which an executing
//! activity sends a call, begins to wait, takes or leaves a lock, or ends a part of a job.

use std::cmp::Reverse;
use std::collections::binary_heap::PeekMut;
use std::collections::{BinaryHeap, VecDeque};
use std::rc::Rc;
use std::sync::Arc;

use super::random::Random;
use super::{Calls, Executed, Job, Schedule, SimulationOptions, Slice, Statistics};
use crate::response_time::linked;
use crate::{Arrivals, CpuSet, Edge, Needs, Order, Protocol, StateMachine, Task, TaskKind, Tasks, Time};

/// The longest simulation. A sum of two instants within it does not overflow.
const LONGEST: u64 = 1 << 63;

/// Twice the highest priority, and 1: that of a job that is not preempted.
const HIGHEST: u64 = 199;

/// The most calls of one operation that one job sends.
const MOST_CALLS: u64 = 1000;

/// The most jobs of a burst.
const MOST_OF_BURST: u64 = 1000;

/// How often a job waits at most, where that is unknown.
const MOST_WAITS: u64 = 3;

/// The events between two calls of `interrupt`.
const UNINTERRUPTED: u64 = 1 << 16;

impl Tasks {
    /// Simulates one schedule. The same options give the same schedule, on every machine. To cancel, `interrupt` unwinds.
    pub fn simulate(&self, options: &SimulationOptions, interrupt: &dyn Fn()) -> Schedule {
        let mut engine = Engine::new(self, options);
        let mut events = 0;
        while events < options.most_events && engine.step() {
            events += 1;
            if events % UNINTERRUPTED == 0 {
                interrupt();
            }
        }
        if events < options.most_events {
            engine.now = engine.length;
        }
        engine.finish(self)
    }
}

/// The thread of a task. Where several tasks have one thread, only one of them has a part at a time.
#[derive(Default)]
struct SimulatedThread {
    /// The index of the task.
    task: usize,
    kind: TaskKind,
    /// Twice its priority, and 1 unless it waits for others of equal priority.
    own_priority: u64,
    /// The same, or the greater one that it has while it holds a lock.
    priority: u64,
    period: u64,
    deadline: u64,
    jitter: u64,
    /// The greatest number of releases in a period; none for a periodic task.
    burst: Option<usize>,
    /// The nominal instants of its last releases, as many as in a burst at most; of a sporadic task only.
    recent: VecDeque<u64>,
    /// Those of its unfinished jobs; of a sporadic task only.
    nominals: VecDeque<u64>,
    /// Whether it is released as often as possible.
    is_scripted: bool,
    /// With a script: its first nominal release, and how often data releases it.
    arrivals: Option<(u64, Arc<Arrivals>)>,
    /// What releases it, if its writers do.
    trigger: Option<SimulatedTrigger>,
    /// The ports that it writes: the task that reads each, the number of the port, and the writes of a job.
    writes: Vec<(usize, usize, u64)>,
    /// All tasks of its thread, in their order; empty if the thread has no others.
    mates: Rc<[usize]>,
    order: Order,
    is_not_preempted: bool,
    /// Whether it has a job in the round of its thread.
    is_in_round: bool,
    /// The instants at which its unfinished jobs were released; in a queue only.
    queued: VecDeque<u64>,
    /// The CPUs on which it may run, a bit for each index of [`Engine::cpus`].
    cpus: CpuSet,
    /// The index of its group.
    group: usize,
    /// The edges of its machine by their source.
    steps: Vec<Vec<EdgeStep>>,
    /// The edges of the next jobs, the first at the end; then they are random.
    scripted: Vec<EdgeStep>,
    /// The operations that it sends.
    sends: Vec<Sends>,
    /// The locks that it takes, each with the time for which it holds it at most.
    locks: Vec<(usize, u64)>,
    /// How often a job waits at most.
    most_waits: u64,
    /// For the phase and the jitter.
    release_choices: Random,
    /// For edges, execution times and calls.
    job_choices: Random,
    /// The state of the machine.
    state: usize,
    /// The nominal instant of the next release.
    next_release: u64,
    /// The nominal instant of the release of the first unfinished job of a periodic task; of the next release if there is none.
    nominal: u64,
    released: u64,
    finished: u64,
    /// Calls to execute: the index of the operation.
    calls: VecDeque<usize>,
    /// The number of calls that the current job still executes before its edge; none if the job did not start.
    calls_of_job: Option<usize>,
    /// What it executes.
    part: Option<JobPart>,
    /// What the current part does: its remaining time at that instant, ascending.
    stops: Vec<(u64, PartStop)>,
    /// Its place among the activities of equal priority that are ready.
    ready_since: u64,
    /// The CPU that it last used.
    last_cpu: Option<u32>,
    is_running: bool,
    /// The sum of its response times.
    total: u128,
    statistics: Statistics,
    /// The indices of its unfinished jobs in the schedule.
    open: VecDeque<usize>,
}

/// The ports whose data releases a task.
struct SimulatedTrigger {
    needs: Needs,
    /// Whether data has come at each of them since the start of the last job.
    has_data: Vec<bool>,
    /// Whether a job is released, or will be, and has not started.
    is_pending: bool,
}

/// The current part of a job.
struct JobPart {
    executed: Executed,
    /// The execution time that remained at `since`.
    remaining: u64,
    since: u64,
    /// The start of the current slice.
    slice: u64,
    /// Whether it is an edge that has not started.
    is_new: bool,
}

/// What a part does at an instant. Of one instant, the greatest comes first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum PartStop {
    /// It sends a call of the operation with this index.
    Send(usize),
    /// It writes the port with this index of those that it writes.
    Write(usize),
    /// It takes the lock with this index.
    Take(usize),
    /// It waits for this time.
    Wait(u64),
    /// It leaves the lock with this index.
    Leave(usize),
}

struct Sends {
    operation: usize,
    most: u64,
    /// So many jobs send no more than one.
    every: u64,
    /// The number of jobs that send none, since an earlier one did.
    resting: u64,
    /// The operation whose execution sends them; none for each job.
    during: Option<usize>,
}

/// An edge.
#[derive(Clone, Copy)]
struct EdgeStep {
    edge: usize,
    target: usize,
    /// What it executes.
    cost: u64,
    /// For how long it waits.
    wait: u64,
}

impl EdgeStep {
    /// The edge with this index of the machine of a task.
    fn new(index: usize, edge: &Edge, task: &Task) -> EdgeStep {
        let executed = task.executed().and_then(|machine| machine.edges().get(index)).unwrap_or(edge);
        let (all, cost) = (edge.cost.as_nanos(), executed.cost.as_nanos());
        EdgeStep { edge: index, target: edge.target as usize, cost, wait: all.saturating_sub(cost) }
    }
}

/// Returns the edges of the machine of a task by their source.
fn steps_of(machine: &StateMachine, task: &Task) -> Vec<Vec<EdgeStep>> {
    let mut of_state: Vec<Vec<EdgeStep>> = vec![Vec::new(); machine.states() as usize];
    for (index, edge) in machine.edges().iter().enumerate() {
        of_state[edge.source as usize].push(EdgeStep::new(index, edge, task));
    }
    of_state
}

/// Chooses one of the edges of a state, which is never without one: with a probability of `heavy` percent the first one of
/// greatest cost.
fn random_step(steps: &[EdgeStep], heavy: u32, random: &mut Random) -> EdgeStep {
    if heavy > 0 && random.up_to(99) < u64::from(heavy) {
        let demand = |step: &EdgeStep| step.cost + step.wait;
        let heaviest = |best: EdgeStep, it: &EdgeStep| if demand(it) > demand(&best) { *it } else { best };
        return steps.iter().fold(steps[0], heaviest);
    }
    if let [only] = steps { *only } else { steps[random.up_to(steps.len() as u64 - 1) as usize] }
}

/// A CPU that an activity may use.
struct EngineCpu {
    number: u32,
    /// The index of the task that it executes.
    running: Option<usize>,
    /// The instant at which its task sends a call or ends a part, unless it is preempted. `u64::MAX` without a task.
    event: u64,
}

/// CPUs that masks link, with the tasks that use them.
struct CpuGroup {
    /// Its CPUs, a bit for each index of [`Engine::cpus`].
    cpus: CpuSet,
    /// The tasks with unfinished work, by descending priority; those of equal priority in the order in which they became ready.
    ready: Vec<usize>,
}

/// A lock.
struct EngineLock {
    protocol: Protocol,
    /// The greatest priority of its users.
    ceiling: u64,
    holder: Option<usize>,
    /// Those that wait until it is free.
    blocked: Vec<usize>,
}

struct Engine<'a> {
    options: &'a SimulationOptions,
    length: u64,
    now: u64,
    threads: Vec<SimulatedThread>,
    /// For each operation its provider, if that is simulated, the execution time of a call, and the most calls that are pending.
    operations: Vec<(Option<usize>, u64, Option<u64>)>,
    locks: Vec<EngineLock>,
    cpus: Vec<EngineCpu>,
    groups: Vec<CpuGroup>,
    /// The groups to assign to CPUs again, a bit for each.
    changed: u128,
    /// The instant of the next release of each task, with its index.
    releases: BinaryHeap<Reverse<(u64, usize)>>,
    /// The ends of the waits, each with the index of the task.
    ends_of_waits: BinaryHeap<Reverse<(u64, usize)>>,
    /// How often a task became ready.
    became_ready: u64,
    slices: Vec<Slice>,
    jobs: Vec<Job>,
}

impl<'a> Engine<'a> {
    fn new(set: &Tasks, options: &'a SimulationOptions) -> Engine<'a> {
        let kind = |index: usize| set.kind(index);
        let is_simulated =
            |(index, task): &(usize, &Task)| task.is_simulated() || kind(*index) == TaskKind::Throttling;
        let simulated: Vec<(usize, &Task)> = set.all().iter().enumerate().filter(is_simulated).collect();
        // Real-time throttling is on each CPU that something else uses.
        let users = simulated.iter().filter(|(index, _)| kind(*index) != TaskKind::Throttling);
        let users: Vec<CpuSet> = users.map(|(_, task)| task.cpus()).collect();
        let used: CpuSet = users.iter().copied().collect();
        // The bit of a CPU is that of its index, not of its number.
        let indices = |cpus: CpuSet| -> CpuSet {
            (0..)
                .zip(used.iter())
                .filter(|(_, number)| cpus.contains(*number))
                .map(|(index, _)| index)
                .collect()
        };
        let mut engine = Engine {
            options,
            length: options.length.as_nanos().min(LONGEST),
            now: 0,
            threads: Vec::new(),
            operations: Vec::new(),
            locks: Vec::new(),
            cpus: used.iter().map(|number| EngineCpu { number, running: None, event: u64::MAX }).collect(),
            groups: Vec::new(),
            changed: 0,
            releases: BinaryHeap::new(),
            ends_of_waits: BinaryHeap::new(),
            became_ready: 0,
            slices: Vec::new(),
            jobs: Vec::new(),
        };
        let groups = linked(users.into_iter().map(indices));
        engine.groups = groups.map(|group| CpuGroup { cpus: group.cpus, ready: Vec::new() }).collect();
        let mut thread_of = vec![None; set.all().len()];
        for (index, task) in simulated {
            let cpus = indices(task.cpus());
            if cpus.is_empty() || !options.has_part(index) {
                continue;
            }
            thread_of[index] = Some(engine.threads.len());
            let sends = set.operations.iter().enumerate().filter(|(_, operation)| operation.client == index);
            let sends = sends.map(|(operation, it)| {
                let most = it.sends.min(MOST_CALLS);
                Sends { operation, most, every: it.every, resting: 0, during: it.during }
            });
            // The first task of its thread has the choices of its releases.
            let first = set.all().iter().position(|it| it.is_mate(task)).unwrap_or(index);
            engine.add((index, first, kind(index)), task, cpus, sends.collect());
        }
        engine.add_mates(set);
        let provider = |index: usize| thread_of.get(index).copied().flatten();
        let operations = set.operations.iter();
        let operations = operations.map(|it| (provider(it.provider), it.time.as_nanos(), it.pending));
        engine.operations = operations.collect();
        engine.add_locks(set, &thread_of);
        engine.add_triggers(set, &thread_of);
        engine
    }

    /// Enters the tasks that are released when their writers write: those whose writers are all known and simulated.
    fn add_triggers(&mut self, set: &Tasks, thread_of: &[Option<usize>]) {
        let thread = |task: usize| thread_of.get(task).copied().flatten();
        for trigger in set.triggers.iter().filter(|_| self.options.script.is_none()) {
            let ports = trigger.ports.iter().map(|port| {
                port.as_ref()?.iter().map(|it| Some((thread(it.task)?, it.writes.min(MOST_CALLS)))).collect()
            });
            let ports: Option<Vec<Vec<(usize, u64)>>> = ports.collect();
            let Some((reader, ports)) = thread(trigger.task).zip(ports) else { continue };
            self.releases.retain(|Reverse((_, index))| *index != reader);
            let has_data = vec![false; ports.len()];
            let task = &mut self.threads[reader];
            task.next_release = 0;
            task.trigger = Some(SimulatedTrigger { needs: trigger.needs, has_data, is_pending: false });
            for (number, port) in ports.into_iter().enumerate() {
                for (writer, writes) in port {
                    self.threads[writer].writes.push((reader, number, writes));
                }
            }
        }
    }

    /// Enters the tasks of each thread that has several.
    fn add_mates(&mut self, set: &Tasks) {
        let task = |thread: &SimulatedThread| set.all().get(thread.task).filter(|task| task.thread.is_some());
        for index in 0..self.threads.len() {
            let Some(of) = task(&self.threads[index]) else { continue };
            let is_mate = |&other: &usize| task(&self.threads[other]).is_some_and(|it| it.shares_thread(of));
            let mates: Vec<usize> = (0..self.threads.len()).filter(is_mate).collect();
            if mates.len() > 1 && mates.first() == Some(&index) {
                let mates: Rc<[usize]> = mates.into();
                // If one of them waits for others of equal priority, all do.
                let priority = mates.iter().map(|&mate| self.threads[mate].own_priority).min();
                for &mate in mates.iter() {
                    let thread = &mut self.threads[mate];
                    thread.mates = Rc::clone(&mates);
                    thread.own_priority = priority.unwrap_or(thread.own_priority);
                    thread.priority = thread.own_priority;
                }
            }
        }
    }

    fn add_locks(&mut self, set: &Tasks, thread_of: &[Option<usize>]) {
        for (index, lock) in set.locks.iter().enumerate() {
            let mut ceiling = 0;
            for user in &lock.users {
                let Some(thread) = thread_of.get(user.task).copied().flatten() else { continue };
                let task = &mut self.threads[thread];
                ceiling = task.own_priority.max(ceiling);
                task.locks.push((index, user.held.map_or(u64::MAX, Time::as_nanos)));
            }
            self.locks.push(EngineLock {
                protocol: lock.protocol,
                ceiling,
                holder: None,
                blocked: Vec::new(),
            });
        }
    }

    /// Adds a task of known demand on these of the CPUs. Without a deadline, that is the period.
    fn add(
        &mut self,
        (index, first_of_thread, kind): (usize, usize, TaskKind),
        task: &Task,
        cpus: CpuSet,
        sends: Vec<Sends>,
    ) {
        let Some((machine, period)) = task.demand.machine().zip(task.period) else { return };
        let deadline = task.deadline.unwrap_or(period).as_nanos();
        let period = period.as_nanos();
        let seed = Random::new(self.options.seed).bits();
        let seeds = |index: usize| Random::new(seed.wrapping_add(index as u64));
        let mut release_choices = Random::new(seeds(first_of_thread).bits());
        let mut of_jobs = seeds(index);
        of_jobs.bits();
        let mut job_choices = Random::new(of_jobs.bits());
        let any = if self.options.simultaneous { 0 } else { release_choices.up_to(period - 1) };
        let script = self.options.script.as_ref();
        let of_script = script.and_then(|script| script.tasks.get(index)?.as_ref());
        let (phase, jitter) = match (of_script, task.instant()) {
            (Some(scripted), _) => (scripted.first.as_nanos(), 0),
            (None, offset) => {
                let at = |offset: Time| self.options.release_at(offset, period, task.clock);
                (offset.map_or(any, at), task.jitter.as_nanos())
            }
        };
        let mut scripted: Vec<EdgeStep> = of_script.map_or_else(Vec::new, |script| {
            let edges = script.edges.iter().map_while(|&index| Some((index, machine.edges().get(index)?)));
            edges.map(|(index, edge)| EdgeStep::new(index, edge, task)).collect()
        });
        scripted.reverse();
        let waits = script.is_some_and(|script| script.last == index);
        let initial = self.options.initial_states.get(index).copied().flatten();
        let first = scripted.last().and_then(|step| machine.edges().get(step.edge)).map(|edge| edge.source);
        let initial = first.or(initial.filter(|state| *state < machine.states()));
        let states = u64::from(machine.states());
        let state = initial.map_or_else(|| job_choices.up_to(states - 1) as usize, |state| state as usize);
        let first = phase.saturating_add(release_choices.up_to(jitter));
        let first = first.max(self.options.not_before());
        if first < self.length {
            self.releases.push(Reverse((first, self.threads.len())));
        }
        let priority = task.priority.real_time().unwrap_or(u32::MAX);
        let own_priority = u64::from(priority) * 2 + u64::from(!waits);
        self.threads.push(SimulatedThread {
            task: index,
            kind,
            own_priority,
            priority: own_priority,
            period,
            deadline,
            jitter,
            burst: (!task.is_periodic()).then(|| task.burst().min(MOST_OF_BURST) as usize),
            is_scripted: of_script.is_some(),
            order: task.order,
            is_not_preempted: task.is_not_preempted,
            arrivals: of_script.and_then(|it| Some((phase, it.arrivals.clone()?))),
            cpus,
            group: self.groups.iter().position(|group| group.cpus.meets(cpus)).unwrap_or_default(),
            steps: steps_of(machine, task),
            scripted,
            sends,
            most_waits: task.waits.as_ref().and_then(|waits| waits.times).unwrap_or(MOST_WAITS),
            release_choices,
            job_choices,
            state,
            next_release: phase,
            nominal: phase,
            ..SimulatedThread::default()
        });
    }

    /// Goes to the next instant with an event. Returns whether there was one.
    fn step(&mut self) -> bool {
        let release = self.releases.peek().map_or(u64::MAX, |Reverse((at, _))| *at);
        let end_of_wait = self.ends_of_waits.peek().map_or(u64::MAX, |Reverse((at, _))| *at);
        let next = self.cpus.iter().map(|cpu| cpu.event).fold(release.min(end_of_wait), u64::min);
        if next > self.length {
            return false;
        }
        self.now = next;
        for cpu in 0..self.cpus.len() {
            if self.cpus[cpu].event == next {
                self.progress(cpu);
            }
        }
        while self.ends_of_waits.peek().is_some_and(|Reverse((at, _))| *at == next) {
            if let Some(Reverse((_, index))) = self.ends_of_waits.pop() {
                self.end_wait(index);
            }
        }
        while self.releases.peek().is_some_and(|Reverse((at, _))| *at == next) {
            self.release();
        }
        while self.changed != 0 {
            let group = self.changed.trailing_zeros() as usize;
            self.changed &= self.changed - 1;
            self.assign(group);
        }
        true
    }

    /// Releases the next job.
    fn release(&mut self) {
        let Some(mut first) = self.releases.peek_mut() else { return };
        let Reverse((now, index)) = *first;
        let task = &mut self.threads[index];
        let nominal = task.next_release;
        task.next_release = task.release_after(nominal);
        let late = if task.jitter > 0 { task.release_choices.up_to(task.jitter) } else { 0 };
        let next = task.next_release.saturating_add(late).max(now).max(self.options.not_before());
        if next < self.length && task.trigger.is_none() {
            *first = Reverse((next, index));
            drop(first);
        } else {
            PeekMut::pop(first);
        }
        if let Some(trigger) = task.trigger.as_mut().filter(|it| it.needs == Needs::Each) {
            trigger.has_data.fill(false);
            trigger.is_pending = false;
        }
        task.released += 1;
        if task.order == Order::Fifo {
            task.queued.push_back(now);
        }
        if self.options.keeps_schedule && task.kind == TaskKind::Activity {
            task.open.push_back(self.jobs.len());
            self.jobs.push(Job {
                activity: task.task,
                number: task.released,
                nominal: Time::from_nanos(nominal),
                release: Time::from_nanos(now),
                deadline: Time::from_nanos(nominal.saturating_add(task.deadline)),
                end: None,
                is_missed: false,
            });
        }
        if task.part.is_none() {
            self.wake(index);
        }
    }

    /// Writes a port whose data releases a task.
    fn write(&mut self, reader: usize, port: usize) {
        if let Some(has_data) = self.threads[reader].trigger.as_mut().and_then(|it| it.has_data.get_mut(port))
        {
            *has_data = true;
        }
        self.release_by_data(reader);
    }

    /// Releases a task if data has come for its next job, not sooner than its least distance after the job before.
    fn release_by_data(&mut self, index: usize) {
        let task = &mut self.threads[index];
        let Some(trigger) = task.trigger.as_mut().filter(|it| !it.is_pending) else { return };
        let has_come = |it: &bool| *it;
        trigger.is_pending = match trigger.needs {
            Needs::Any => trigger.has_data.iter().any(has_come),
            Needs::All => trigger.has_data.iter().all(has_come),
            // What comes sooner than the least distance does not come.
            Needs::Each => trigger.has_data.iter().any(has_come) && self.now >= task.next_release,
        };
        if trigger.is_pending {
            task.next_release = task.next_release.max(self.now);
            let release = task.next_release.saturating_add(task.release_choices.up_to(task.jitter));
            if release < self.length {
                self.releases.push(Reverse((release, index)));
            }
        }
    }

    /// Notes that a job of a task starts: data from then on is for the next one.
    fn note_start(&mut self, index: usize) {
        let task = &mut self.threads[index];
        let is_start = task.part.as_mut().is_some_and(|it| std::mem::take(&mut it.is_new));
        if let Some(trigger) = task.trigger.as_mut().filter(|it| is_start && it.needs != Needs::Each) {
            trigger.has_data.fill(false);
            trigger.is_pending = false;
        }
    }

    /// Makes a task ready if it has work; otherwise another task of its thread that has some. A thread under way goes on.
    fn wake(&mut self, index: usize) {
        if self.threads[index].mates.iter().any(|&mate| self.threads[mate].part.is_some()) {
            return;
        }
        let next = if self.begin(index) { Some(index) } else { self.begin_mate(index) };
        next.into_iter().for_each(|next| self.make_ready(next));
    }

    /// Begins the next part of another task in the thread of a task. Returns the task.
    fn begin_mate(&mut self, index: usize) -> Option<usize> {
        let mates = Rc::clone(&self.threads[index].mates);
        mates.iter().copied().find(|&mate| mate != index && self.begin(mate))
    }

    /// Whether the thread of a task executes its next job before those of the other tasks of the thread.
    fn is_turn(&self, index: usize) -> bool {
        let task = &self.threads[index];
        let released = |mate: usize| self.threads[mate].queued.front().copied().unwrap_or(u64::MAX);
        match task.order {
            Order::List => {}
            Order::Any => return true,
            Order::Rounds => {
                let is_first = |mate: &SimulatedThread| mate.is_in_round && mate.burst.is_none();
                let is_waiting =
                    task.burst.is_some() && task.mates.iter().any(|&it| is_first(&self.threads[it]));
                return task.is_in_round && !is_waiting;
            }
            Order::Fifo => return task.mates.iter().all(|&mate| released(index) <= released(mate)),
        }
        let place = task.mates.iter().position(|&mate| mate == index);
        let before = place.map(|place| place.checked_sub(1));
        match before {
            None => true,
            Some(Some(before)) => self.threads[task.mates[before]].finished > task.finished,
            Some(None) => task.mates.iter().all(|&mate| self.threads[mate].finished == task.finished),
        }
    }

    fn make_ready(&mut self, index: usize) {
        self.became_ready += 1;
        let task = &mut self.threads[index];
        task.ready_since = self.became_ready;
        let (group, priority) = (task.group, task.priority);
        let ready = &mut self.groups[group].ready;
        let place = ready.partition_point(|&other| self.threads[other].priority >= priority);
        ready.insert(place, index);
        self.changed |= 1 << group;
    }

    /// Begins the next part of a task: a call, or the edge of a job. Returns whether there is one.
    fn begin(&mut self, index: usize) -> bool {
        let mates = Rc::clone(&self.threads[index].mates);
        let is_new_round = self.threads[index].order == Order::Rounds
            && mates.iter().all(|&mate| !self.threads[mate].is_in_round);
        for &mate in mates.iter().filter(|_| is_new_round) {
            let task = &mut self.threads[mate];
            task.is_in_round = task.finished < task.released;
        }
        let is_turn = self.is_turn(index);
        let task = &mut self.threads[index];
        let has_job = task.finished < task.released && is_turn;
        let is_between = task.calls_of_job.is_none();
        let calls = match (task.calls_of_job, self.options.calls) {
            (Some(left), _) => left,
            (None, Calls::AtJobs) if has_job => task.calls.len(),
            (None, Calls::AtJobs) => 0,
            (None, Calls::BetweenJobs) => task.calls.len(),
        };
        let is_activity = task.kind == TaskKind::Activity;
        let least_time = if is_activity { self.options.least_time } else { 100 };
        let mut begin = |executed, cost| {
            let is_new = matches!(executed, Executed::Edge(_));
            task.part = Some(JobPart { executed, remaining: cost, since: self.now, slice: self.now, is_new });
        };
        if calls > 0
            && let Some(operation) = task.calls.pop_front()
        {
            let time = self.operations.get(operation).map_or(0, |(_, time, _)| *time);
            let cost = execution_time(time, least_time, &mut task.job_choices);
            begin(Executed::Operation(operation), cost);
            task.choose_sends(Some(operation), cost);
            if !is_between || self.options.calls == Calls::AtJobs {
                task.calls_of_job = Some(calls - 1);
            }
            return true;
        }
        if !has_job {
            return false;
        }
        task.calls_of_job = Some(0);
        task.is_in_round = false;
        let scripted = task.scripted.pop();
        let (step, least_time) = match scripted {
            Some(step) => (step, 100),
            None => {
                (random_step(&task.steps[task.state], self.options.heavy, &mut task.job_choices), least_time)
            }
        };
        task.state = step.target;
        let cost = execution_time(step.cost, least_time, &mut task.job_choices);
        begin(Executed::Edge(step.edge), cost);
        match scripted {
            Some(step) if step.wait > 0 => task.stops.push((0, PartStop::Wait(step.wait))),
            Some(_) => {}
            None => task.choose_suspensions(cost, step.wait, least_time),
        }
        task.choose_writes(cost);
        task.choose_sends(None, cost);
        true
    }

    /// Brings the task of a CPU to this instant: sends its calls, and ends its part if that has no time left.
    fn progress(&mut self, cpu: usize) {
        let Some(index) = self.cpus[cpu].running else { return };
        let now = self.now;
        let task = &mut self.threads[index];
        let Some(part) = &mut task.part else { return };
        part.remaining -= now - part.since;
        part.since = now;
        let remaining = part.remaining;
        while let Some((at, stop)) = self.threads[index].stops.pop_if(|(at, _)| *at >= remaining) {
            match stop {
                PartStop::Send(operation) => self.send(operation),
                PartStop::Write(port) => {
                    let written = self.threads[index].writes.get(port).copied();
                    written.into_iter().for_each(|(reader, port, _)| self.write(reader, port));
                }
                PartStop::Leave(lock) => self.leave(lock, index),
                PartStop::Take(lock) if self.take(lock, index) => {}
                PartStop::Take(_) => {
                    // It tries again when it continues.
                    self.threads[index].stops.push((at, stop));
                    return self.suspend(index, cpu);
                }
                PartStop::Wait(time) => {
                    self.ends_of_waits.push(Reverse((now.saturating_add(time), index)));
                    return self.suspend(index, cpu);
                }
            }
        }
        if remaining > 0 {
            self.cpus[cpu].event = self.threads[index].event();
            return;
        }
        self.end_slice(index);
        let task = &mut self.threads[index];
        if let Some(JobPart { executed: Executed::Edge(_), .. }) = task.part.take() {
            self.end_job(index);
        }
        if self.threads[index].is_not_preempted {
            self.set_priority(index, self.threads[index].own_priority);
            self.make_unready(index, cpu);
            return self.wake(index);
        }
        if self.begin(index) {
            self.note_start(index);
            self.cpus[cpu].event = self.threads[index].event();
            return;
        }
        match self.begin_mate(index) {
            Some(next) => self.hand_over(index, next, cpu),
            None => self.make_unready(index, cpu),
        }
    }

    /// Lets the thread of a task that executes go on with another of its tasks.
    fn hand_over(&mut self, index: usize, next: usize, cpu: usize) {
        let task = &mut self.threads[index];
        task.is_running = false;
        let (group, since) = (task.group, task.ready_since);
        self.threads[next].ready_since = since;
        let ready = self.groups[group].ready.iter_mut().find(|ready| **ready == index);
        ready.into_iter().for_each(|ready| *ready = next);
        self.start(next, cpu);
    }

    /// Removes a task that executes from those that are ready.
    fn make_unready(&mut self, index: usize, cpu: usize) {
        let task = &mut self.threads[index];
        task.is_running = false;
        let group = task.group;
        self.groups[group].ready.retain(|&other| other != index);
        self.cpus[cpu].running = None;
        self.cpus[cpu].event = u64::MAX;
        self.changed |= 1 << group;
    }

    /// Stops a task within a part.
    fn suspend(&mut self, index: usize, cpu: usize) {
        if self.threads[index].part.as_ref().is_some_and(|part| part.slice < self.now) {
            self.end_slice(index);
        }
        self.make_unready(index, cpu);
    }

    /// A job that has nothing to do after its last wait ends with it.
    fn end_wait(&mut self, index: usize) {
        let task = &mut self.threads[index];
        let has_ended = task.part.as_ref().is_some_and(|part| part.remaining == 0) && task.stops.is_empty();
        if !has_ended {
            return self.make_ready(index);
        }
        task.part = None;
        self.end_job(index);
        self.wake(index);
    }

    /// Takes a lock, or waits for it. Returns whether the task has it.
    fn take(&mut self, lock: usize, index: usize) -> bool {
        let of_lock = &mut self.locks[lock];
        let (protocol, ceiling) = (of_lock.protocol, of_lock.ceiling);
        let Some(holder) = of_lock.holder else {
            of_lock.holder = Some(index);
            if protocol == Protocol::Ceiling {
                self.raise(index, ceiling);
            }
            return true;
        };
        of_lock.blocked.push(index);
        if protocol == Protocol::Inheritance {
            self.raise(holder, self.threads[index].priority);
        }
        false
    }

    /// Leaves a lock. Whoever is blocked tries to take it when it has a CPU.
    fn leave(&mut self, lock: usize, index: usize) {
        let of_lock = &mut self.locks[lock];
        of_lock.holder = None;
        let blocked = std::mem::take(&mut of_lock.blocked);
        let task = &self.threads[index];
        self.set_priority(index, if task.is_not_preempted { HIGHEST } else { task.own_priority });
        for blocked in blocked {
            self.make_ready(blocked);
        }
    }

    fn raise(&mut self, index: usize, priority: u64) {
        self.set_priority(index, self.threads[index].priority.max(priority));
    }

    /// Sets the priority of a task that is ready, before others of equal priority.
    fn set_priority(&mut self, index: usize, priority: u64) {
        let task = &mut self.threads[index];
        if task.priority == priority {
            return;
        }
        task.priority = priority;
        let group = task.group;
        let ready = &mut self.groups[group].ready;
        ready.retain(|&other| other != index);
        let place = ready.partition_point(|&other| self.threads[other].priority > priority);
        ready.insert(place, index);
        self.changed |= 1 << group;
    }

    fn send(&mut self, operation: usize) {
        let Some(&(Some(provider), _, most_pending)) = self.operations.get(operation) else { return };
        let task = &mut self.threads[provider];
        let executed = task.part.as_ref().map(|part| part.executed);
        let calls = task.calls.iter().filter(|it| **it == operation).count();
        let pending = calls as u64 + u64::from(executed == Some(Executed::Operation(operation)));
        // Its client waits for the end of a call before the next one.
        if most_pending.is_some_and(|most| pending >= most) {
            return;
        }
        task.calls.push_back(operation);
        if self.options.calls == Calls::BetweenJobs && self.threads[provider].part.is_none() {
            self.wake(provider);
        }
    }

    /// Ends the first unfinished job of a task.
    fn end_job(&mut self, index: usize) {
        let task = &mut self.threads[index];
        let nominal = task.nominals.pop_front().unwrap_or(task.nominal);
        let response = self.now - nominal;
        let is_missed = response > task.deadline;
        task.nominal = nominal.saturating_add(task.period);
        task.finished += 1;
        task.queued.pop_front();
        task.calls_of_job = None;
        task.total += u128::from(response);
        let statistics = &mut task.statistics;
        statistics.misses += u64::from(is_missed);
        statistics.greatest = statistics.greatest.max(Some(Time::from_nanos(response)));
        if let Some(job) = task.open.pop_front() {
            self.jobs[job].end = Some(Time::from_nanos(self.now));
            self.jobs[job].is_missed = is_missed;
        }
    }

    /// Ends the slice of a task that executes.
    fn end_slice(&mut self, index: usize) {
        if !self.options.keeps_schedule {
            return;
        }
        let task = &self.threads[index];
        if let (Some(part), Some(cpu)) = (&task.part, task.last_cpu) {
            self.slices.push(Slice {
                activity: task.task,
                job: task.finished + 1,
                cpu: self.cpus[cpu as usize].number,
                start: Time::from_nanos(part.slice),
                end: Time::from_nanos(self.now),
                executed: part.executed,
            });
        }
    }

    /// Assigns the ready tasks of a group to its CPUs, in the order of their priority: each takes a CPU of its mask that no
    /// earlier one took, so that it waits only for those. A task keeps its CPU where it can.
    fn assign(&mut self, group: usize) {
        let CpuGroup { cpus, ready } = &self.groups[group];
        let cpus = *cpus;
        let mut next = [None; CpuSet::MOST as usize];
        let idle: CpuSet = cpus.iter().filter(|cpu| self.cpus[*cpu as usize].running.is_none()).collect();
        let mut free = cpus;
        for &index in ready {
            if free.is_empty() {
                break;
            }
            let task = &self.threads[index];
            let possible = task.cpus & free;
            if !possible.is_empty() {
                let cpu = self.choose(task, possible, possible & idle);
                next[cpu as usize] = Some(index);
                free = free - CpuSet::of(cpu);
            }
        }
        let is_changed = |cpu: &u32| self.cpus[*cpu as usize].running != next[*cpu as usize];
        let changed: CpuSet = cpus.iter().filter(is_changed).collect();
        // A task that moves leaves its CPU before it starts on another.
        for cpu in changed.iter().map(|cpu| cpu as usize) {
            if let Some(index) = self.cpus[cpu].running.take() {
                self.preempt(index);
                self.cpus[cpu].event = u64::MAX;
            }
        }
        for cpu in changed.iter().map(|cpu| cpu as usize) {
            if let Some(index) = next[cpu] {
                self.start(index, cpu);
            }
        }
    }

    /// Chooses one of the `possible` CPUs for a task: its own, its last one if that is idle, another `idle` one, or the one with
    /// the task of lowest priority.
    fn choose(&self, task: &SimulatedThread, possible: CpuSet, idle: CpuSet) -> u32 {
        if let Some(last) = task.last_cpu
            && (task.is_running && possible.contains(last) || idle.contains(last))
        {
            return last;
        }
        if let Some(cpu) = idle.first().or(possible.first().filter(|_| possible.is_one())) {
            return cpu;
        }
        let rank = |cpu: &u32| {
            let running = self.cpus[*cpu as usize].running.map(|index| &self.threads[index]);
            running.map(|task| (task.priority, Reverse(task.ready_since)))
        };
        possible.iter().min_by_key(rank).unwrap_or_default()
    }

    fn start(&mut self, index: usize, cpu: usize) {
        if self.threads[index].is_not_preempted {
            self.raise(index, HIGHEST);
        }
        self.note_start(index);
        let task = &mut self.threads[index];
        task.is_running = true;
        task.last_cpu = Some(cpu as u32);
        if let Some(part) = &mut task.part {
            (part.since, part.slice) = (self.now, self.now);
        }
        self.cpus[cpu].running = Some(index);
        self.cpus[cpu].event = task.event();
    }

    fn preempt(&mut self, index: usize) {
        let now = self.now;
        let task = &mut self.threads[index];
        task.is_running = false;
        let Some(part) = &mut task.part else { return };
        part.remaining -= now - part.since;
        part.since = now;
        if part.slice < now {
            self.end_slice(index);
        }
    }

    fn finish(mut self, set: &Tasks) -> Schedule {
        for cpu in 0..self.cpus.len() {
            if let Some(index) = self.cpus[cpu].running {
                self.preempt(index);
            }
        }
        let end = Time::from_nanos(self.now);
        for job in self.jobs.iter_mut().filter(|job| job.end.is_none()) {
            job.is_missed = job.deadline < end;
        }
        self.slices.sort_by_key(|slice| (slice.start, slice.cpu));
        let mut statistics = vec![None; set.activities().len()];
        for task in &self.threads {
            if let Some(statistics) = statistics.get_mut(task.task) {
                *statistics = Some(task.statistics(self.now));
            }
        }
        let activities = set.activities().iter().zip(&statistics).enumerate();
        let left_out = activities.filter(|(_, (_, statistics))| statistics.is_none());
        let left_out = left_out.map(|(index, (task, _))| (index, task.left_out())).collect();
        Schedule { end, statistics, left_out, slices: self.slices, jobs: self.jobs }
    }
}

impl SimulatedThread {
    /// Chooses the calls that a part of this length sends: a job, or the execution of an operation.
    fn choose_sends(&mut self, during: Option<usize>, cost: u64) {
        for sends in self.sends.iter_mut().filter(|sends| sends.during == during) {
            if sends.resting > 0 {
                sends.resting -= 1;
                continue;
            }
            let calls = self.job_choices.up_to(sends.most);
            sends.resting = if calls > 0 { sends.every.saturating_sub(1) } else { 0 };
            for _ in 0..calls {
                self.stops.push((self.job_choices.up_to(cost), PartStop::Send(sends.operation)));
            }
        }
        self.stops.sort_unstable();
    }

    /// Chooses when a job that executes for `cost` writes.
    fn choose_writes(&mut self, cost: u64) {
        for (place, (_, _, writes)) in self.writes.iter().enumerate() {
            for _ in 0..*writes {
                self.stops.push((self.job_choices.up_to(cost), PartStop::Write(place)));
            }
        }
    }

    /// Chooses when a job that executes for `cost` takes and leaves a lock, and when it waits, for `wait` in all at most. It does
    /// not wait while it holds a lock.
    fn choose_suspensions(&mut self, cost: u64, wait: u64, least_time: u32) {
        let mut section = (0, 0);
        if !self.locks.is_empty() && cost > 0 {
            let choice = self.job_choices.up_to(self.locks.len() as u64) as usize;
            if let Some(&(lock, held)) = self.locks.get(choice).filter(|(_, held)| *held > 0) {
                let longest = held.min(cost);
                let is_longest = self.job_choices.up_to(1) == 0;
                let held = if is_longest { longest } else { 1 + self.job_choices.up_to(longest - 1) };
                let leaves = self.job_choices.up_to(cost - held);
                section = (leaves, leaves + held);
                self.stops.extend([(section.0, PartStop::Leave(lock)), (section.1, PartStop::Take(lock))]);
            }
        }
        if wait == 0 || self.most_waits == 0 {
            return;
        }
        let waits = 1 + self.job_choices.up_to(self.most_waits.min(MOST_WAITS) - 1);
        let mut left = execution_time(wait, least_time, &mut self.job_choices);
        for number in 1..=waits {
            let time = if number == waits { left } else { self.job_choices.up_to(left) };
            let at = self.job_choices.up_to(cost);
            let at = if section.0 < at && at < section.1 { section.0 } else { at };
            if time > 0 {
                self.stops.push((at, PartStop::Wait(time)));
            }
            left -= time;
        }
    }

    /// Returns the nominal instant of the release after that at `nominal`. A sporadic task is often released as early as possible,
    /// and sometimes after a long time.
    fn release_after(&mut self, nominal: u64) -> u64 {
        let Some(burst) = self.burst else { return nominal.saturating_add(self.period) };
        self.nominals.push_back(nominal);
        self.recent.push_back(nominal);
        let first = if self.recent.len() >= burst { self.recent.pop_front() } else { None };
        let earliest = first.map_or(nominal, |first| first.saturating_add(self.period).max(nominal));
        let by_data =
            self.arrivals.as_ref().map(|(first, it)| first.saturating_add(it.release_of(self.released + 2)));
        let earliest = earliest.max(by_data.unwrap_or_default());
        let is_early = self.is_scripted || self.trigger.is_some();
        let choice = if is_early { 0 } else { self.release_choices.up_to(7) };
        let pause = match choice {
            0..=4 => 0,
            5 | 6 => self.release_choices.up_to(self.period / 4),
            _ => self.release_choices.up_to(self.period.saturating_mul(3)),
        };
        earliest.saturating_add(pause)
    }

    /// Returns the instant of its next stop, or of the end of its part, if it executes until then.
    fn event(&self) -> u64 {
        let until = self.stops.last().map_or(0, |(at, _)| *at);
        let remaining = |part: &JobPart| part.remaining.saturating_sub(until);
        self.part.as_ref().map_or(u64::MAX, |part| part.since.saturating_add(remaining(part)))
    }

    fn statistics(&self, end: u64) -> Statistics {
        let unfinished = self.released - self.finished;
        // Each further job has its deadline a period later.
        let first = self.nominal.saturating_add(self.deadline);
        let late = match self.burst {
            Some(_) => {
                self.nominals.iter().filter(|it| it.saturating_add(self.deadline) < end).count() as u64
            }
            None if first < end => (end - first - 1) / self.period + 1,
            None => 0,
        };
        let average = self.total.checked_div(u128::from(self.finished));
        Statistics {
            jobs: self.finished,
            unfinished,
            misses: self.statistics.misses + late.min(unfinished),
            average: average.and_then(|it| u64::try_from(it).ok()).map(Time::from_nanos),
            ..self.statistics
        }
    }
}

/// Returns a random execution time from `least_time` percent of `cost` to `cost`.
fn execution_time(cost: u64, least_time: u32, random: &mut Random) -> u64 {
    if least_time >= 100 {
        return cost;
    }
    let least = (u128::from(cost) * u128::from(least_time)).div_ceil(100) as u64;
    cost - random.up_to(cost - least)
}
