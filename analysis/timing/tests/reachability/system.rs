//! The description of a small system, and the analyser's bounds for it.

use std::fmt;
use std::sync::Arc;

use mauve_timing::{
    Blocking, Bound, CpuRule, CpuSet, Demand, Edge, Lock, LockUser, Method, Options, Priority, Protocol,
    Response, SetAnalysis, StateMachine, TaskOperation, Tasks, Time, Waits, Window,
};

/// The methods of the analyser, from the least to the most precise.
pub(crate) const METHODS: [Method; 4] = [Method::Classic, Method::Psm, Method::Ibf, Method::Exact];

/// A periodic task; times in nanoseconds.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Task {
    pub(crate) priority: u32,
    pub(crate) period: u64,
    pub(crate) deadline: u64,
    pub(crate) jitter: u64,
    /// For a task that is released at any distance: the greatest number of releases in a window of a period.
    pub(crate) burst: Option<u64>,
    /// The thread that executes its jobs, in each period one after another with those of the other tasks of this number.
    pub(crate) thread: Option<u32>,
    /// The nominal instant of the first release on its clock: 0 or 1.
    pub(crate) offset: Option<u64>,
    pub(crate) clock: usize,
    pub(crate) cpus: u64,
    /// (source, target, execution time); an execution time of 0 counts as 1 ns.
    pub(crate) edges: Vec<(u32, u32, u64)>,
    /// For how long a job waits in all, for each edge; empty if it never waits.
    pub(crate) waits: Vec<u64>,
    /// How often a job waits, at most; `None` for any number.
    pub(crate) times: Option<u64>,
    /// Whether the analyser is told that the demand is unknown.
    pub(crate) is_unknown: bool,
    /// Whether it is in the background; its priority is 0 then, and greater for all tasks that are not.
    pub(crate) is_background: bool,
    /// Whether it takes its locks within each other; all of them are ceilings then.
    pub(crate) nests: bool,
    /// Whether it is real-time throttling of its CPU: its priority is greater than all others.
    pub(crate) is_throttling: bool,
}

impl Task {
    /// Whether every state is reached from every other.
    fn is_strongly_connected(&self) -> bool {
        let states = self.edges.iter().map(|&(source, ..)| source);
        states.clone().all(|start| {
            let mut reached = std::collections::BTreeSet::from([start]);
            while let Some(&(_, target, _)) = self
                .edges
                .iter()
                .find(|(source, target, _)| reached.contains(source) && !reached.contains(target))
            {
                reached.insert(target);
            }
            states.clone().all(|state| reached.contains(&state))
        })
    }
}

/// Returns a task on CPU 0, without jitter, whose deadline is its period.
pub(crate) fn task(priority: u32, period: u64, edges: &[(u32, u32, u64)]) -> Task {
    let edges = edges.iter().map(|&(source, target, cost)| (source, target, cost.max(1))).collect();
    Task {
        priority,
        period,
        deadline: period,
        jitter: 0,
        burst: None,
        thread: None,
        offset: None,
        clock: 0,
        cpus: 1,
        edges,
        waits: Vec::new(),
        times: None,
        is_unknown: false,
        is_background: false,
        nests: false,
        is_throttling: false,
    }
}

/// Returns a task each of whose jobs executes for `cost`.
pub(crate) fn simple(priority: u32, period: u64, cost: u64) -> Task {
    task(priority, period, &[(0, 0, cost)])
}

impl Task {
    pub(crate) fn deadline(self, deadline: u64) -> Task {
        Task { deadline, ..self }
    }

    pub(crate) fn jitter(self, jitter: u64) -> Task {
        Task { jitter, ..self }
    }

    /// It is released at any distance, at most `burst` times in a window of a period.
    pub(crate) fn burst(self, burst: u64) -> Task {
        Task { burst: Some(burst), ..self }
    }

    pub(crate) fn thread(self, thread: u32) -> Task {
        Task { thread: Some(thread), ..self }
    }

    pub(crate) fn offset(self, offset: u64) -> Task {
        Task { offset: Some(offset), ..self }
    }

    pub(crate) fn clock(self, clock: usize) -> Task {
        Task { clock, ..self }
    }

    pub(crate) fn cpus(self, cpus: u64) -> Task {
        Task { cpus, ..self }
    }

    /// A job waits for a time of its edge at most, `times` times at most.
    pub(crate) fn waits(self, waits: &[u64], times: Option<u64>) -> Task {
        Task { waits: waits.to_vec(), times, ..self }
    }

    pub(crate) fn unknown(self) -> Task {
        Task { is_unknown: true, ..self }
    }

    pub(crate) fn background(self) -> Task {
        Task { is_background: true, ..self }
    }

    pub(crate) fn throttling(self) -> Task {
        Task { is_throttling: true, ..self }
    }

    pub(crate) fn states(&self) -> u32 {
        self.edges.iter().map(|&(source, target, _)| source.max(target) + 1).max().unwrap_or(1)
    }

    pub(crate) fn greatest_cost(&self) -> u64 {
        self.edges.iter().map(|edge| edge.2).max().unwrap_or(0)
    }

    fn demand(&self) -> (Demand, Option<Arc<Waits>>) {
        let edge =
            |&(source, target, cost): &(u32, u32, u64)| Edge { source, target, cost: Time::from_nanos(cost) };
        let machine = StateMachine::new(self.states(), self.edges.iter().map(edge).collect()).unwrap();
        if self.is_unknown {
            return (Demand::Unknown, None);
        }
        let waits: Vec<Time> = self.waits.iter().map(|&wait| Time::from_nanos(wait)).collect();
        Waits::with_demand(machine, &waits, self.times, None).unwrap()
    }

    fn activity(&self) -> mauve_timing::Task {
        let (demand, waits) = self.demand();
        mauve_timing::Task {
            priority: match self.is_background {
                true => Priority::Background,
                false if self.is_throttling => Priority::Unknown,
                false => Priority::RealTime(self.priority),
            },
            is_throttling: self.is_throttling,
            period: Some(Time::from_nanos(self.period)),
            deadline: Some(Time::from_nanos(self.deadline)),
            jitter: Time::from_nanos(self.jitter),
            burst: self.burst.unwrap_or_default(),
            is_sporadic: self.burst.is_some(),
            thread: self.thread,
            offset: self.offset.map(Time::from_nanos),
            clock: self.clock as u32,
            cpus: Some(CpuSet(self.cpus.into())),
            demand,
            waits,
            ..mauve_timing::Task::default()
        }
    }
}

/// An operation of `provider`: each job of `client` sends at most `sends` calls, and each call executes for `time`, less what it waits.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Served {
    pub(crate) provider: usize,
    pub(crate) client: usize,
    pub(crate) sends: u64,
    pub(crate) time: u64,
    pub(crate) wait: u64,
}

/// When a provider executes the calls that it has received.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Calls {
    /// At the start of its next job, before the edge of the job.
    AtNextPeriod,
    /// Either so, or between two jobs. The release of a job does not preempt a call: both execute in one thread.
    BetweenPeriods,
}

/// A lock.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Shared {
    pub(crate) protocol: Protocol,
    /// The tasks that take it, each with the time for which it executes at most until it leaves it.
    pub(crate) users: Vec<(usize, u64)>,
}

impl Shared {
    fn lock(&self) -> Lock {
        let user = |&(task, held): &(usize, u64)| LockUser { task, held: Some(Time::from_nanos(held)) };
        Lock { name: "lock".into(), protocol: self.protocol, users: self.users.iter().map(user).collect() }
    }
}

/// A system: its tasks, their operations and locks, and the freedom of its schedules.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct System {
    pub(crate) tasks: Vec<Task>,
    pub(crate) operations: Vec<Served>,
    pub(crate) calls: Calls,
    pub(crate) locks: Vec<Shared>,
    /// Whether a job or call may execute for less than its time, 1 ns at least.
    pub(crate) jobs_may_end_early: bool,
}

impl System {
    pub(crate) fn new(tasks: Vec<Task>) -> System {
        System {
            tasks,
            operations: Vec::new(),
            calls: Calls::AtNextPeriod,
            locks: Vec::new(),
            jobs_may_end_early: false,
        }
    }

    /// Adds a lock.
    pub(crate) fn sharing(mut self, protocol: Protocol, users: &[(usize, u64)]) -> System {
        self.locks.push(Shared { protocol, users: users.to_vec() });
        self
    }

    pub(crate) fn has_waits_or_locks(&self) -> bool {
        let has_waits = self.tasks.iter().any(|task| !task.waits.is_empty() || task.is_throttling);
        !self.locks.is_empty() || has_waits || self.operations.iter().any(|it| it.wait > 0)
    }

    pub(crate) fn serving(mut self, calls: Calls, operations: &[Served]) -> System {
        self.operations = operations.to_vec();
        self.calls = calls;
        self
    }

    pub(crate) fn early(self) -> System {
        System { jobs_may_end_early: true, ..self }
    }

    /// Returns the tasks of each thread, in their order.
    pub(crate) fn threads(&self) -> Vec<Vec<usize>> {
        let mut threads: Vec<Vec<usize>> = Vec::new();
        for (place, task) in self.tasks.iter().enumerate() {
            let is_it = |thread: &&mut Vec<usize>| {
                task.thread.is_some() && self.tasks[thread[0]].thread == task.thread
            };
            match threads.iter_mut().find(is_it) {
                Some(thread) => thread.push(place),
                None => threads.push(vec![place]),
            }
        }
        threads
    }

    /// Whether no task is before this one in its thread. The jitter of the first one is that of the thread.
    pub(crate) fn is_first_of_thread(&self, place: usize) -> bool {
        self.threads().iter().any(|thread| thread[0] == place)
    }

    pub(crate) fn is_on_one_cpu(&self) -> bool {
        self.tasks.iter().all(|task| task.cpus == self.tasks[0].cpus && task.cpus.is_power_of_two())
    }

    /// Whether every window can begin with every combination of states. All tasks start within their first periods here, so the
    /// first job of one, which begins in a state that is never entered again, does not meet a job of another that was released
    /// long after its nominal instant. With offsets, what precedes such a late job is not free either.
    pub(crate) fn attains_every_combination(&self) -> bool {
        let has_jitter = self.tasks.iter().any(|task| task.jitter > 0);
        let has_one_clock = self.tasks.iter().all(|task| task.clock == 0);
        let are_free = || !self.has_offsets() && self.tasks.iter().all(Task::is_strongly_connected);
        has_one_clock && (!has_jitter || are_free())
    }

    pub(crate) fn has_offsets(&self) -> bool {
        self.tasks.iter().any(|task| task.offset.is_some())
    }

    /// Returns the system with every phase of each task.
    pub(crate) fn without_offsets(&self) -> System {
        let tasks = self.tasks.iter().map(|task| Task { offset: None, ..task.clone() }).collect();
        System { tasks, ..self.clone() }
    }

    /// Returns the system without jitter, bursts, threads, operations, waits and locks; `None` if it has none.
    pub(crate) fn plain(&self) -> Option<System> {
        let plain = |task: &Task| Task {
            jitter: 0,
            burst: None,
            thread: None,
            waits: Vec::new(),
            times: None,
            nests: false,
            is_throttling: false,
            ..task.clone()
        };
        let tasks = self.tasks.iter().map(plain).collect();
        let plain = System { tasks, operations: Vec::new(), locks: Vec::new(), ..self.clone() };
        (plain != *self).then_some(plain)
    }

    /// Returns its tasks as the analysis has them.
    pub(crate) fn set(&self) -> Tasks {
        let operation = |served: &Served| TaskOperation {
            provider: served.provider,
            client: served.client,
            sends: served.sends,
            time: Time::from_nanos(served.time),
            ..TaskOperation::default()
        };
        let mut set = Tasks::new(self.tasks.iter().map(Task::activity).collect());
        set.operations = self.operations.iter().map(operation).collect();
        set.locks = self.locks.iter().map(Shared::lock).collect();
        for served in self.operations.iter().filter(|it| it.wait > 0) {
            let provider = &mut set.activities_mut()[served.provider];
            *provider = provider.clone().waiting_in_calls();
        }
        let unknown = self.tasks.iter().enumerate().filter(|(_, task)| task.is_unknown);
        unknown.for_each(|(task, _)| set.refuse(task));
        set
    }

    /// Returns the analysis of the system by one method.
    pub(crate) fn analyse(&self, method: Method) -> SetAnalysis {
        self.set().response_times(&Options { method, is_brief: false }, &|| ())
    }

    /// Returns the bound of each task by one method.
    pub(crate) fn bounds(&self, method: Method) -> Vec<Option<u64>> {
        self.responses(method).iter().map(bound).collect()
    }

    fn responses(&self, method: Method) -> Vec<Response> {
        self.analyse(method).responses
    }

    /// Returns the bounds by every method.
    pub(crate) fn all_bounds(&self) -> Bounds {
        let [classic, psm, ibf, exact] = METHODS.map(|method| self.responses(method));
        let is_exact = exact.iter().map(is_exact).collect();
        let has_reason = |blocking: &&Blocking| !matches!(blocking, Blocking::Time(..));
        let refused = self.analyse(Method::Psm).blocking.iter().filter(has_reason).count() as u64;
        let has = |holds: &dyn Fn(&Window) -> bool| {
            exact.iter().map(|it| it.window.as_ref().is_some_and(holds)).collect()
        };
        let is_on_all_cpus: Vec<bool> =
            exact.iter().map(|it| matches!(it.rule, CpuRule::Global(_))).collect();
        let mut has_late: Vec<bool> = has(&|window| !window.late.is_empty());
        has_late.iter_mut().zip(&is_on_all_cpus).for_each(|(late, on_all)| *late &= !on_all);
        let has_blocking = has(&|window| window.blocking > Time::ZERO);
        let by_method = [classic, psm, ibf, exact].map(|all| all.iter().map(bound).collect());
        Bounds { by_method, is_exact, is_on_all_cpus, has_late, has_blocking, refused }
    }
}

fn bound(response: &Response) -> Option<u64> {
    match response.bound {
        Bound::Response(time) => Some(time.as_nanos()),
        Bound::Background | Bound::Unbounded { .. } | Bound::NoBound(_) | Bound::NotAnalysed { .. } => None,
    }
}

/// Whether the analyser says that the bound is the greatest response time on one CPU.
fn is_exact(response: &Response) -> bool {
    response.method == Method::Exact && !response.is_exhausted
}

/// The bounds of a system.
pub(crate) struct Bounds {
    /// In the order of [`METHODS`], for each task.
    by_method: [Vec<Option<u64>>; 4],
    /// For each task, whether its bound by [`Method::Exact`] is claimed to be the greatest response time.
    pub(crate) is_exact: Vec<bool>,
    /// For each task, whether that bound counts what all of several CPUs execute.
    pub(crate) is_on_all_cpus: Vec<bool>,
    /// For each task, whether waits count as jitter in its window by [`Method::Exact`].
    pub(crate) has_late: Vec<bool>,
    /// For each task, whether jobs of lower priority delay it in that window.
    pub(crate) has_blocking: Vec<bool>,
    /// The number of tasks that locks leave without a bound.
    pub(crate) refused: u64,
}

impl Bounds {
    pub(crate) fn of(&self, task: usize) -> [Option<u64>; 4] {
        [0, 1, 2, 3].map(|method| self.by_method[method][task])
    }

    pub(crate) fn exact(&self, task: usize) -> Option<u64> {
        self.by_method[3][task]
    }

    /// Returns the greatest bound of a task: a greater response exceeds every bound.
    pub(crate) fn greatest(&self, task: usize) -> Option<u64> {
        self.of(task).into_iter().flatten().max()
    }

    /// Panics unless each method is at least as precise as the one before it.
    pub(crate) fn check_order(&self, system: &System) {
        for task in 0..system.tasks.len() {
            let bounds = self.of(task);
            let is_ordered = bounds.is_sorted_by(|coarse, fine| match (coarse, fine) {
                (Some(coarse), Some(fine)) => fine <= coarse,
                (Some(_), None) => false,
                (None, _) => true,
            });
            assert!(
                is_ordered,
                "a more precise method gives task {task} a greater bound: {bounds:?} by {METHODS:?} in\n{system}"
            );
        }
    }
}

/// As the text of a test.
impl fmt::Display for System {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "System::new(vec![")?;
        for task in &self.tasks {
            write!(f, "    task({}, {}, &{:?})", task.priority, task.period, task.edges)?;
            if task.deadline != task.period {
                write!(f, ".deadline({})", task.deadline)?;
            }
            if task.jitter > 0 {
                write!(f, ".jitter({})", task.jitter)?;
            }
            if let Some(burst) = task.burst {
                write!(f, ".burst({burst})")?;
            }
            if let Some(thread) = task.thread {
                write!(f, ".thread({thread})")?;
            }
            if let Some(offset) = task.offset {
                write!(f, ".offset({offset}).clock({})", task.clock)?;
            }
            if !task.waits.is_empty() {
                write!(f, ".waits(&{:?}, {:?})", task.waits, task.times)?;
            }
            if task.cpus != 1 {
                write!(f, ".cpus({:#b})", task.cpus)?;
            }
            f.write_str(if task.is_background { ".background()" } else { "" })?;
            f.write_str(if task.is_throttling { ".throttling()" } else { "" })?;
            f.write_str(if task.nests { ".nested()" } else { "" })?;
            writeln!(f, "{},", if task.is_unknown { ".unknown()" } else { "" })?;
        }
        write!(f, "])")?;
        if !self.operations.is_empty() {
            write!(f, "\n.serving(Calls::{:?}, &{:?})", self.calls, self.operations)?;
        }
        for Shared { protocol, users } in &self.locks {
            write!(f, "\n.sharing(Protocol::{protocol:?}, &{users:?})")?;
        }
        f.write_str(if self.jobs_may_end_early { "\n.early()" } else { "" })
    }
}
