//! A small system: tasks that data passes through, and the analyser's bounds for it.

use mauve_timing::{
    Bound, ChainBuffer, ChainStep, ChainWrite, CpuSet, Demand, Distance, Edge, Method, Needs, NoLatency,
    Options, PortWriter, Priority, SetAnalysis, StateMachine, TaskTrigger, Tasks, Time, TriggerWriter,
    Triggers,
};

use super::core::{Core, Facts, cost};

/// A periodic task; times in nanoseconds.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Task {
    pub(crate) priority: u32,
    pub(crate) period: u8,
    pub(crate) jitter: u8,
    pub(crate) offset: Option<u8>,
    pub(crate) cpu: usize,
    pub(crate) core: Core,
    /// The size of the buffer before it; `None` for a register.
    pub(crate) buffer: Option<u8>,
    /// Whether its input releases it, each period at most; with how many releases in a period, 1 or 2.
    pub(crate) trigger: Option<u8>,
    /// Whether the thread of the system executes it. All of its tasks are equal but for their cores and buffers.
    pub(crate) is_in_thread: bool,
}

/// Returns a task on the CPU of its number.
pub(crate) fn task(cpu: usize, priority: u32, period: u8, core: Core) -> Task {
    Task {
        priority,
        period,
        jitter: 0,
        offset: None,
        cpu,
        core,
        buffer: None,
        trigger: None,
        is_in_thread: false,
    }
}

impl Task {
    pub(crate) fn buffer(self, size: u8) -> Task {
        Task { buffer: Some(size), ..self }
    }

    pub(crate) fn triggered(self) -> Task {
        Task { trigger: Some(1), ..self }
    }

    pub(crate) fn jitter(self, jitter: u8) -> Task {
        Task { jitter, ..self }
    }

    pub(crate) fn offset(self, offset: u8) -> Task {
        Task { offset: Some(offset), ..self }
    }
}

/// A system: each of the first `chain` tasks gets what the one before it writes. The chain begins with task `first`, which reads the
/// world, as do those before it.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct System {
    pub(crate) tasks: Vec<Task>,
    pub(crate) first: usize,
    pub(crate) chain: usize,
    /// Whether the thread executes its tasks from the last one to the first.
    pub(crate) is_reversed: bool,
    /// Whether statements may execute for less than their time.
    pub(crate) is_early: bool,
    /// A task after the chain writes a second port of this task, which data at any or at all of both ports releases.
    pub(crate) second: Option<(usize, Needs)>,
}

/// The bounds of a system, and what they rely on.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Bounds {
    pub(crate) latency: u64,
    pub(crate) age_at_write: Option<u64>,
    /// Whether the latency also bounds the age until replaced.
    pub(crate) keeps: bool,
    pub(crate) found: mauve_timing::ChainLatency,
    /// Whether a write is known to be earlier than the end of its job.
    pub(crate) has_earlier_write: bool,
    /// Whether it is less because the steps do not delay each other.
    pub(crate) is_apart: bool,
}

impl System {
    pub(crate) fn new(tasks: Vec<Task>) -> System {
        System { chain: tasks.len(), tasks, first: 0, is_reversed: false, is_early: false, second: None }
    }

    /// Returns the place among the tasks that are analysed: a thread executes them in their order.
    fn analysed(&self, task: usize) -> usize {
        if self.is_reversed { self.tasks.len() - 1 - task } else { task }
    }

    pub(crate) fn facts(&self) -> Vec<Facts> {
        let tasks = self.tasks[..self.chain].iter().enumerate();
        tasks.map(|(place, task)| task.core.facts(place <= self.first)).collect()
    }

    fn analyse(&self, follows_writers: bool) -> SetAnalysis {
        let tasks = self.tasks.iter().map(|task| {
            let edge = |edge: &super::core::Edge| Edge {
                source: edge.source as u32,
                target: edge.target as u32,
                cost: Time::from_nanos(cost(&edge.program)),
            };
            let edges: Vec<Edge> = task.core.edges.iter().map(edge).collect();
            let states = edges.iter().map(|edge| edge.source.max(edge.target) + 1).max().unwrap();
            mauve_timing::Task {
                priority: Priority::RealTime(task.priority),
                period: Some(Time::from_nanos(task.period.into())),
                jitter: Time::from_nanos(task.jitter.into()),
                is_sporadic: task.trigger.is_some(),
                burst: task.trigger.unwrap_or(1).into(),
                offset: task.offset.map(|offset| Time::from_nanos(offset.into())),
                cpus: Some(CpuSet::of(task.cpu as u32)),
                thread: task.is_in_thread.then_some(0),
                demand: Demand::Machine { machine: StateMachine::new(states, edges).unwrap(), whole: None },
                ..mauve_timing::Task::default()
            }
        });
        let mut tasks: Vec<mauve_timing::Task> = tasks.collect();
        if self.is_reversed {
            tasks.reverse();
        }
        let mut set = Tasks::new(tasks);
        if follows_writers {
            set.triggers = self.triggers();
        }
        set.response_times(&OPTIONS, &|| ())
    }

    /// Returns the bounds for the response times of the tasks, and those by the least distance of releases alone.
    pub(crate) fn responses(&self) -> [Vec<Option<u64>>; 2] {
        [true, false].map(|follows_writers| {
            let bound = |response: &mauve_timing::Response| match response.bound {
                Bound::Response(time) => Some(time.as_nanos()),
                _ => None,
            };
            let found = self.analyse(follows_writers).responses;
            (0..self.tasks.len()).map(|task| bound(&found[self.analysed(task)])).collect()
        })
    }

    fn triggers(&self) -> Vec<TaskTrigger> {
        let writer =
            |task: usize| PortWriter { task: self.analysed(task), writes: self.writes_of(task).into() };
        let of_task = |(task, of): (usize, &Task)| {
            of.trigger?;
            let mut ports = vec![of.buffer.is_none().then(|| vec![writer(task - 1)])];
            let second = self.second.filter(|(reader, _)| *reader == task);
            ports.extend(second.map(|_| Some(vec![writer(self.chain)])));
            let needs = second.map(|(_, needs)| needs).unwrap_or_default();
            Some(TaskTrigger { task: self.analysed(task), needs, ports })
        };
        self.tasks.iter().enumerate().filter_map(of_task).collect()
    }

    /// Returns the bounds, if each component passes data on for sure.
    pub(crate) fn bounds(&self, uses_priorities: bool) -> Option<Bounds> {
        let all = self.facts();
        let (last, others) = all[self.first..].split_last()?;
        if others.iter().any(|facts| !facts.keeps) {
            return None;
        }
        let analysis = self.analyse(true);
        let response = |task: usize| match analysis.responses[self.analysed(task)].bound {
            Bound::Response(time) => Some(time),
            _ => None,
        };
        (0..self.tasks.len()).try_for_each(|task| response(task).map(|_| ()))?;
        let mut distances: Vec<Option<Distance>> = Vec::new();
        let mut chain = Vec::new();
        for (task, facts) in all.iter().enumerate() {
            let of = &self.tasks[task];
            let writes = task.checked_sub(1).map(|writer| self.writes_of(writer));
            // The first job may leave a value, which releases another one.
            let may_leave = of.trigger.is_some() && of.buffer.is_some() && !of.core.returns_to_start();
            let writes = writes.filter(|_| !may_leave);
            let by_clock =
                |task: &Task| Distance { each: Time::from_nanos(task.period.into()), late: Time::ZERO };
            let by = |writer: usize, gap: Option<u32>, distance: Option<Distance>| {
                Some(TriggerWriter {
                    task: self.analysed(writer),
                    distance: distance?,
                    response: response(writer)?,
                    gap: gap?,
                    writes,
                    has_buffer: of.buffer.is_some(),
                })
            };
            let mut triggers = Triggers::default();
            if of.trigger.is_some() {
                triggers.writers.push(by(task - 1, all[task - 1].gap, distances[task - 1]));
            }
            if let Some((_, needs)) = self.second.filter(|(reader, _)| *reader == task) {
                let other = &self.tasks[self.chain];
                triggers.needs = needs;
                triggers.writers.push(by(self.chain, other.core.facts(false).gap, Some(by_clock(other))));
            }
            let released = analysis.tasks.release(
                self.analysed(task),
                response(task)?,
                &triggers,
                (task > self.first).then_some(0),
            );
            distances.push(of.trigger.map_or(Some(by_clock(of)), |_| released.distance));
            if task < self.first {
                continue;
            }
            let response = response(task)?;
            let write = |&time: &u64| ChainWrite {
                task: self.analysed(task),
                cost: Time::from_nanos(time),
                response,
            };
            let written: Vec<ChainWrite> = facts.written.iter().map(write).collect();
            let buffer = of.buffer.filter(|_| task > self.first);
            chain.push(ChainStep {
                task: self.analysed(task),
                releases: facts.releases?,
                periods: facts.periods,
                write: analysis.tasks.write_times(&written, &OPTIONS, &|| ()).into_iter().max()?,
                response,
                gap: facts.gap,
                buffer: buffer.map(|size| ChainBuffer { size: size.into(), reads: facts.reads }),
                writes,
                released: of.trigger.map(|_| released),
                is_call: false,
                ends_with_write: of.core.ends_with_write(),
            });
        }
        let mut found = match analysis.tasks.latency(&chain, uses_priorities) {
            Ok(found) => found,
            Err(NoLatency::NotRead(_) | NoLatency::NotPeriodic(_)) => return None,
            Err(other) => panic!("{other:?} of {self:?}"),
        };
        let apart = analysis.tasks.steps_apart(&chain, &OPTIONS, &|| ());
        let apart = apart.map(|chain| analysis.tasks.latency(&chain, uses_priorities).unwrap());
        let is_apart = apart.as_ref().is_some_and(|apart| apart.latency < found.latency);
        if let Some(apart) = apart {
            assert!(apart.latency <= found.latency, "{self:?}");
            found = apart;
        }
        Some(Bounds {
            latency: found.latency.as_nanos(),
            age_at_write: found.age_at_write.map(Time::as_nanos),
            keeps: last.keeps,
            has_earlier_write: chain.iter().any(|step| step.write < step.response),
            is_apart,
            found,
        })
    }

    fn writes_of(&self, task: usize) -> u32 {
        self.tasks[task].core.facts(task <= self.first).writes
    }
}

const OPTIONS: Options = Options { method: Method::Best, is_brief: false };
