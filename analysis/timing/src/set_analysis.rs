//! The response times of [`Tasks`].

use std::sync::Arc;

use crate::operations::with_rounds;
use crate::releases::follows_writers;
use crate::response_times;
use crate::{
    Analysis, Blocking, Bound, CpuLoad, CycleMean, Method, Options, Response, Task, Tasks, Utilisation,
};

/// The response times of [`Tasks`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SetAnalysis {
    /// One for each task.
    pub responses: Vec<Response>,
    /// For each operation, the number of calls that each job of its provider counts; `None` where a response time that it
    /// depends on has no bound: then the provider is not analysed.
    pub calls: Vec<Option<u64>>,
    /// What locks do to each task; empty without locks.
    pub blocking: Vec<Blocking>,
    /// The CPUs that are used.
    pub cpus: Vec<CpuLoad>,
    /// The analysed tasks, each with the calls that it executes.
    pub tasks: Arc<Tasks>,
    /// The utilisation by each task alone, rounded; empty where no CPU is overloaded.
    shares: Vec<f64>,
}

impl Tasks {
    /// Computes the response times. To cancel, `interrupt` unwinds.
    pub fn response_times(&self, options: &Options, interrupt: &dyn Fn()) -> SetAnalysis {
        let (all, blocking, calls) = if self.operations.is_empty() && !follows_writers(self) {
            let (all, blocking) = self.clone().with_blocking();
            (all, blocking, Vec::new())
        } else {
            with_rounds(self, options, interrupt)
        };
        let Analysis { responses, cpus } = response_times(&all, options, interrupt);
        let is_overloaded = responses.iter().any(|it| matches!(it.bound, Bound::Unbounded { .. }));
        let overloading = all.iter().filter(|_| is_overloaded);
        let shares = overloading.map(|task| share(task, options.method)).collect();
        let Tasks { activities, others, .. } = *self;
        let (operations, locks) = (self.operations.clone(), self.locks.clone());
        let tasks = Tasks { all, activities, others, operations, locks, triggers: self.triggers.clone() };
        SetAnalysis { responses, calls, blocking, cpus, tasks: Arc::new(tasks), shares }
    }
}

impl Tasks {
    /// Returns the utilisation of its CPUs by each real-time task alone, rounded; none where the demand is unknown.
    pub fn shares(&self, method: Method) -> impl Iterator<Item = Option<f64>> {
        self.all.iter().map(move |task| task.is_known().then(|| share(task, method)))
    }
}

impl SetAnalysis {
    /// Returns the utilisation by a task alone, rounded; none where no CPU is overloaded, and where the demand is unknown.
    pub fn share(&self, task: usize) -> Option<f64> {
        self.tasks.all.get(task).filter(|it| it.is_known())?;
        self.shares.get(task).copied()
    }

    /// Returns the utilisation of the CPUs of a task by it and those of higher or equal priority, rounded: for a message. The
    /// analysis itself compares exactly.
    pub fn utilisation_above(&self, task: usize) -> Option<f64> {
        let of = self.tasks.all.get(task)?;
        let tasks = self.tasks.all.iter().zip(&self.shares);
        let above = tasks.filter(|(it, _)| it.priority >= of.priority && it.cpus().meets(of.cpus()));
        Some(above.map(|(_, share)| share).sum())
    }
}

fn share(task: &Task, method: Method) -> f64 {
    let Some(machine) = task.executed() else { return 0.0 };
    let mean = match (method, task.demand.own(method)) {
        (Method::Classic, Some(cost)) if task.waits.is_none() => CycleMean { cost, length: 1 },
        (Method::Classic, _) => CycleMean { cost: machine.greatest_cost(), length: 1 },
        _ => machine.greatest_cycle_mean(),
    };
    Utilisation::new(task.mean_of_jobs(mean)).as_f64()
}
#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::machine;
    use crate::{Breakdown, CpuSet, Demand, Priority, StateMachine, THROTTLING, TaskKind, Time};

    const MS: u64 = 1_000_000;

    fn ms(time: u64) -> Time {
        Time::from_nanos(time * MS)
    }

    fn activity(name: &str, priority: Priority, cpus: u128, cost: u64) -> Task {
        let task = Task::new(1, ms(100), StateMachine::single(ms(cost)));
        Task { name: name.into(), priority, cpus: Some(CpuSet(cpus)), ..task }
    }

    /// Two activities on CPU 0, an activity and other work on CPU 1, and one of unknown demand on CPU 2.
    fn activities() -> Vec<Task> {
        let real_time = Priority::RealTime;
        vec![
            activity("log", Priority::Background, 1, 90),
            activity("drive", real_time(2), 1, 20),
            activity("plan", real_time(1), 1, 40),
            Task { demand: Demand::Unknown, ..activity("arm", real_time(1), 4, 0) },
            activity("lift", real_time(1), 2, 10),
        ]
    }

    fn with_network(activities: Vec<Task>, is_throttled: bool) -> Tasks {
        let network = Task::new(5, ms(30), StateMachine::single(ms(5)));
        let network = Task { name: "network".into(), cpus: Some(CpuSet(2)), ..network };
        Tasks::new(activities).with_platform(vec![network], is_throttled)
    }

    fn options(method: Method) -> Options {
        Options { method, is_brief: false }
    }

    fn bound(response: &Response) -> Option<Time> {
        match response.bound {
            Bound::Response(time) => Some(time),
            _ => None,
        }
    }

    #[test]
    fn other_work_and_throttling_delay_activities() {
        let found = with_network(activities(), true).response_times(&options(Method::Psm), &|| ());
        let bounds: Vec<Option<Time>> = found.responses.iter().map(bound).collect();
        // Throttling takes 50 ms. The second job of `drive` delays `plan`, and three of the other work delay `lift`.
        assert_eq!(bounds[..5], [None, Some(ms(70)), Some(ms(130)), None, Some(ms(75))]);
        assert_eq!(found.responses[0].bound, Bound::Background);
        assert_eq!(found.responses[3].bound, Bound::NotAnalysed { because: vec![3] });
        assert!((0..5).all(|task| found.share(task).is_none()));
        let cpus: Vec<CpuSet> = found.cpus.iter().map(|load| load.cpus).collect();
        assert_eq!(cpus, [CpuSet(1), CpuSet(2)]);

        let lift = &found.responses[4];
        let options = options(Method::Psm);
        let mut breakdown = Breakdown::new(found.tasks.all(), &options, &|| ());
        let parts = breakdown.of(4, lift.rule, lift.window.as_ref(), lift.first_job);
        let parts: Vec<_> =
            parts.iter().map(|part| (found.tasks.name(part.task), part.jobs, part.time)).collect();
        let expected = [("network (platform)", 3, ms(15)), (THROTTLING, 1, ms(50))];
        assert_eq!(parts, expected.map(|(name, jobs, time)| (name.to_owned(), jobs, time)));
    }

    #[test]
    fn without_throttling_all_time_is_for_activities() {
        let found = with_network(activities(), false).response_times(&options(Method::Psm), &|| ());
        let bounds: Vec<Option<Time>> = found.responses.iter().map(bound).collect();
        assert_eq!(bounds[..5], [None, Some(ms(20)), Some(ms(60)), None, Some(ms(15))]);
    }

    #[test]
    fn kinds_and_names() {
        let set = with_network(activities(), true);
        let names: Vec<String> = (0..8).map(|task| set.name(task)).collect();
        assert_eq!(names[..5], ["log", "drive", "plan", "arm", "lift"]);
        assert_eq!(names[5..], ["network (platform)", THROTTLING, THROTTLING]);
        let kinds: Vec<TaskKind> = (4..8).map(|task| set.kind(task)).collect();
        assert_eq!(kinds, [TaskKind::Activity, TaskKind::Other, TaskKind::Throttling, TaskKind::Throttling]);
        assert_eq!(set.activities(), activities());
    }

    #[test]
    fn what_is_unknown_is_the_worst() {
        let mut set = Tasks::new(activities());
        (set.activities_mut()[2].priority, set.activities_mut()[4].cpus) = (Priority::Unknown, None);
        let found = set.response_times(&options(Method::Psm), &|| ());
        // `plan` may have the highest priority, and `lift` may run on the CPU of `drive`, which has a higher one.
        assert_eq!(bound(&found.responses[1]), Some(ms(60)));
        assert_eq!(bound(&found.responses[2]), Some(ms(40)));
        assert_eq!(bound(&found.responses[4]), Some(ms(10)));
    }

    #[test]
    fn the_utilisation_of_an_overloaded_cpu() {
        let edge = |source, target, cost: u64| (source, target, cost * MS);
        // The mean is 70 ms, and the greatest edge 100 ms.
        let plan = machine(2, &[edge(0, 1, 100), edge(1, 0, 40)]);
        let mut activities = activities();
        activities[2].demand = Demand::Machine { machine: plan, whole: Some(ms(110)) };
        activities[1] = activity("drive", Priority::RealTime(2), 1, 40);
        activities.push(activity("below", Priority::RealTime(0), 1, 10));
        let set = with_network(activities, false);
        let rounded = |value: Option<f64>| value.map(|value| (value * 1000.0).round());
        let found = set.response_times(&options(Method::Psm), &|| ());
        let is_unbounded = |task: &usize| matches!(found.responses[*task].bound, Bound::Unbounded { .. });
        assert_eq!((0..6).filter(is_unbounded).collect::<Vec<_>>(), [2, 5]);
        assert_eq!([2, 5].map(|it| rounded(found.utilisation_above(it))), [Some(1100.0), Some(1200.0)]);
        let shares: Vec<Option<f64>> = (0..6).map(|task| rounded(found.share(task))).collect();
        assert_eq!(shares, [None, Some(400.0), Some(700.0), None, Some(100.0), Some(100.0)]);
        let found = set.response_times(&options(Method::Classic), &|| ());
        assert_eq!([2, 5].map(|it| rounded(found.utilisation_above(it))), [Some(1500.0), Some(1600.0)]);
        assert_eq!(rounded(found.share(2)), Some(1100.0));
    }
}
