//! The description of a small system, and the analyser's bounds for it.

use std::fmt;

use mauve_timing::{
    Bound, Demand, Edge, Method, Operation, Options, Priority, Response, SetAnalysis, StateMachine, Tasks,
    Time,
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
    /// The nominal instant of the first release, on the clock that all tasks with an offset share.
    pub(crate) offset: Option<u64>,
    pub(crate) cpus: u64,
    /// (source, target, execution time); an execution time of 0 counts as 1 ns.
    pub(crate) edges: Vec<(u32, u32, u64)>,
    /// Whether the analyser is told that the demand is unknown.
    pub(crate) is_unknown: bool,
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
    Task { priority, period, deadline: period, jitter: 0, offset: None, cpus: 1, edges, is_unknown: false }
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

    pub(crate) fn offset(self, offset: u64) -> Task {
        Task { offset: Some(offset), ..self }
    }

    pub(crate) fn cpus(self, cpus: u64) -> Task {
        Task { cpus, ..self }
    }

    pub(crate) fn unknown(self) -> Task {
        Task { is_unknown: true, ..self }
    }

    pub(crate) fn states(&self) -> u32 {
        self.edges.iter().map(|&(source, target, _)| source.max(target) + 1).max().unwrap_or(1)
    }

    pub(crate) fn greatest_cost(&self) -> u64 {
        self.edges.iter().map(|edge| edge.2).max().unwrap_or(0)
    }

    fn demand(&self) -> Demand {
        let edge =
            |&(source, target, cost): &(u32, u32, u64)| Edge { source, target, cost: Time::from_nanos(cost) };
        let machine = StateMachine::new(self.states(), self.edges.iter().map(edge).collect()).unwrap();
        if self.is_unknown { Demand::Unknown } else { Demand::Machine { machine, whole: None } }
    }

    fn activity(&self) -> mauve_timing::Task {
        mauve_timing::Task {
            priority: Priority::RealTime(self.priority),
            period: Some(Time::from_nanos(self.period)),
            deadline: Some(Time::from_nanos(self.deadline)),
            jitter: Time::from_nanos(self.jitter),
            offset: self.offset.map(Time::from_nanos),
            cpus: Some(self.cpus),
            demand: self.demand(),
            ..mauve_timing::Task::default()
        }
    }
}

/// An operation of `provider`: each job of `client` sends at most `sends` calls, and each call executes for `time`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Served {
    pub(crate) provider: usize,
    pub(crate) client: usize,
    pub(crate) sends: u64,
    pub(crate) time: u64,
}

/// When a provider executes the calls that it has received.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Calls {
    /// At the start of its next job, before the edge of the job.
    AtNextPeriod,
    /// Either so, or between two jobs. The release of a job does not preempt a call: both execute in one thread.
    BetweenPeriods,
}

/// A system: its tasks, their operations, and the freedom of its schedules.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct System {
    pub(crate) tasks: Vec<Task>,
    pub(crate) operations: Vec<Served>,
    pub(crate) calls: Calls,
    /// Whether a job or call may execute for less than its time, 1 ns at least.
    pub(crate) jobs_may_end_early: bool,
}

impl System {
    pub(crate) fn new(tasks: Vec<Task>) -> System {
        System { tasks, operations: Vec::new(), calls: Calls::AtNextPeriod, jobs_may_end_early: false }
    }

    pub(crate) fn serving(mut self, calls: Calls, operations: &[Served]) -> System {
        self.operations = operations.to_vec();
        self.calls = calls;
        self
    }

    pub(crate) fn early(self) -> System {
        System { jobs_may_end_early: true, ..self }
    }

    pub(crate) fn is_on_one_cpu(&self) -> bool {
        self.tasks.iter().all(|task| task.cpus == self.tasks[0].cpus && task.cpus.is_power_of_two())
    }

    /// Whether every window can begin with every combination of states. All tasks start within their first periods here, so the
    /// first job of one, which begins in a state that is never entered again, does not meet a job of another that was released
    /// long after its nominal instant. With offsets, what precedes such a late job is not free either.
    pub(crate) fn attains_every_combination(&self) -> bool {
        let has_jitter = self.tasks.iter().any(|task| task.jitter > 0);
        !has_jitter || !self.has_offsets() && self.tasks.iter().all(Task::is_strongly_connected)
    }

    pub(crate) fn has_offsets(&self) -> bool {
        self.tasks.iter().any(|task| task.offset.is_some())
    }

    /// Returns the system with every phase of each task.
    pub(crate) fn without_offsets(&self) -> System {
        let tasks = self.tasks.iter().map(|task| Task { offset: None, ..task.clone() }).collect();
        System { tasks, ..self.clone() }
    }

    /// Returns the system without jitter and operations; `None` if it has none.
    pub(crate) fn without_jitter_and_operations(&self) -> Option<System> {
        let tasks = self.tasks.iter().map(|task| Task { jitter: 0, ..task.clone() }).collect();
        let plain = System { tasks, operations: Vec::new(), ..self.clone() };
        (plain != *self).then_some(plain)
    }

    /// Returns the analysis of the system by one method.
    pub(crate) fn analyse(&self, method: Method) -> SetAnalysis {
        let operation = |served: &Served| Operation {
            provider: served.provider,
            client: served.client,
            sends: served.sends,
            time: Time::from_nanos(served.time),
            during: None,
        };
        let mut set = Tasks::new(self.tasks.iter().map(Task::activity).collect());
        set.operations = self.operations.iter().map(operation).collect();
        set.response_times(&Options { method, horizon: None, is_brief: false }, &|| ())
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
        let by_method = [classic, psm, ibf, exact].map(|all| all.iter().map(bound).collect());
        Bounds { by_method, is_exact }
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
            if let Some(offset) = task.offset {
                write!(f, ".offset({offset})")?;
            }
            if task.cpus != 1 {
                write!(f, ".cpus({:#b})", task.cpus)?;
            }
            writeln!(f, "{},", if task.is_unknown { ".unknown()" } else { "" })?;
        }
        write!(f, "])")?;
        if !self.operations.is_empty() {
            write!(f, "\n.serving(Calls::{:?}, &{:?})", self.calls, self.operations)?;
        }
        f.write_str(if self.jobs_may_end_early { "\n.early()" } else { "" })
    }
}
