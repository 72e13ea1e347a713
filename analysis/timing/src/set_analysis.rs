//! The response times of an [`ActivitySet`].

use std::sync::Arc;

use crate::operations::Calls;
use crate::{
    ActivitySet, Bound, CpuLoad, CycleMean, Demand, Method, Options, Response, SetTasks, Task, Utilisation,
    response_times,
};

/// The response times of an [`ActivitySet`]. The tasks in it are numbered as the activities are; a number behind theirs is
/// other real-time work, or real-time throttling.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SetAnalysis {
    /// One for each activity; none for those in the background.
    pub responses: Vec<Option<Response>>,
    /// Of each activity without a bound because its CPU is overloaded: the utilisation of the CPU by it and those of higher or
    /// equal priority, rounded. The analysis itself compares exactly.
    pub overloads: Vec<Option<f64>>,
    /// The utilisation by each activity alone, rounded; none where no CPU is overloaded, and where the demand is unknown.
    pub shares: Vec<Option<f64>>,
    /// For each operation, the number of calls that each job of its provider counts; `None` where a response time that it
    /// depends on has no bound: then the provider is not analysed.
    pub calls: Vec<Option<u64>>,
    /// The CPUs that are used.
    pub cpus: Vec<CpuLoad>,
    /// The analysed tasks, for a [`Breakdown`](crate::Breakdown) of the response times.
    pub tasks: Arc<SetTasks>,
}

impl ActivitySet {
    /// Computes the response times. To cancel, `interrupt` unwinds.
    pub fn response_times(&self, options: &Options, interrupt: &dyn Fn()) -> SetAnalysis {
        let mut set = self.tasks();
        let mut calls = Vec::new();
        if !self.operations.is_empty() {
            let counted = Calls::new(&self.operations, &self.activities, &set, options, interrupt);
            (set.tasks, calls) = (counted.tasks, counted.counts);
        }
        let tasks = &set.tasks;
        let analysis = response_times(tasks, options, interrupt);
        let mut found = SetAnalysis {
            calls,
            responses: vec![None; self.activities.len()],
            overloads: vec![None; self.activities.len()],
            shares: vec![None; self.activities.len()],
            cpus: analysis.cpus,
            tasks: Arc::default(),
        };
        let mut shares = None;
        for (task, mut response) in analysis.responses.into_iter().enumerate() {
            match &mut response.bound {
                Bound::NotAnalysed { because } => because.iter_mut().for_each(|it| *it = set.activity(*it)),
                Bound::Unbounded { .. } => {
                    let shares = shares.get_or_insert_with(|| shares_of(tasks, options.method));
                    if let (Some(overload), Some(of)) =
                        (found.overloads.get_mut(set.activity(task)), tasks.get(task))
                    {
                        *overload = Some(utilisation_above(tasks, shares, of));
                    }
                }
                Bound::Response(_) | Bound::NoBound(_) => {}
            }
            if let Some(known) = found.responses.get_mut(set.activity(task)) {
                *known = Some(response);
            }
        }
        for (task, share) in shares.into_iter().flatten().enumerate() {
            let is_known = tasks.get(task).is_some_and(|it| it.demand != Demand::Unknown);
            if let Some(known) = found.shares.get_mut(set.activity(task)) {
                *known = Some(share).filter(|_| is_known);
            }
        }
        found.tasks = Arc::new(set);
        found
    }
}

/// Returns the utilisation of a CPU by each task, for a message: the analysis itself compares exactly.
fn shares_of(tasks: &[Task], method: Method) -> Vec<f64> {
    let share = |task: &Task| {
        let Demand::Machine { machine, whole } = &task.demand else { return 0.0 };
        let mean = match method {
            Method::Psm | Method::Ibf | Method::Exact | Method::Best => machine.greatest_cycle_mean(),
            Method::Classic => {
                CycleMean { cost: machine.greatest_cost().max(whole.unwrap_or_default()), length: 1 }
            }
        };
        Utilisation::new([(mean, task.period)]).as_f64()
    };
    tasks.iter().map(share).collect()
}

/// Returns the utilisation of its CPU by a task and those of higher or equal priority.
fn utilisation_above(tasks: &[Task], shares: &[f64], of: &Task) -> f64 {
    let above =
        tasks.iter().zip(shares).filter(|(task, _)| task.priority >= of.priority && task.cpus & of.cpus != 0);
    above.map(|(_, share)| share).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task_set::{Other, Priority};
    use crate::testing::machine;
    use crate::{Activity, StateMachine, THROTTLING, Time};

    const MS: u64 = 1_000_000;

    fn ms(time: u64) -> Time {
        Time::from_nanos(time * MS)
    }

    fn activity(name: &str, priority: Priority, cpus: u64, cost: u64) -> Activity {
        Activity {
            name: name.to_owned(),
            priority,
            period: Some(ms(100)),
            deadline: Some(ms(100)),
            jitter: Time::ZERO,
            offset: None,
            cpus: Some(cpus),
            demand: Demand::Machine { machine: StateMachine::single(ms(cost)), whole: None },
        }
    }

    /// Two activities on CPU 0, an activity and other work on CPU 1, and one of unknown demand on CPU 2.
    fn deployment() -> ActivitySet {
        let real_time = Priority::RealTime;
        ActivitySet {
            activities: vec![
                activity("log", Priority::Background, 1, 90),
                activity("drive", real_time(2), 1, 20),
                activity("plan", real_time(1), 1, 40),
                Activity { demand: Demand::Unknown, ..activity("arm", real_time(1), 4, 0) },
                activity("lift", real_time(1), 2, 10),
            ],
            others: vec![Other {
                name: "network".to_owned(),
                priority: 5,
                period: ms(30),
                jitter: Time::ZERO,
                time: ms(5),
                cpus: 2,
            }],
            throttled: true,
            ..ActivitySet::default()
        }
    }

    fn options(method: Method) -> Options {
        Options { method, horizon: None, is_brief: false }
    }

    fn bound(response: &Option<Response>) -> Option<Time> {
        match response.as_ref()?.bound {
            Bound::Response(time) => Some(time),
            _ => None,
        }
    }

    #[test]
    fn other_work_and_throttling_delay_activities() {
        let set = deployment();
        let found = set.response_times(&options(Method::Psm), &|| ());
        let bounds: Vec<Option<Time>> = found.responses.iter().map(bound).collect();
        // Throttling takes 50 ms. The second job of `drive` delays `plan`, and three of the other work delay `lift`.
        assert_eq!(bounds, [None, Some(ms(70)), Some(ms(130)), None, Some(ms(75))]);
        assert_eq!(found.responses[0], None);
        let of_unknown = found.responses[3].as_ref().map(|response| &response.bound);
        assert_eq!(of_unknown, Some(&Bound::NotAnalysed { because: vec![3] }));
        assert_eq!((found.shares, found.overloads), (vec![None; 5], vec![None; 5]));
        let masks: Vec<u64> = found.cpus.iter().map(|load| load.mask).collect();
        assert_eq!(masks, [1, 2]);

        let lift = found.responses[4].as_ref().unwrap();
        let options = options(Method::Psm);
        let mut breakdown = found.tasks.breakdown(&options, &|| ());
        let parts = breakdown.of(3, lift.rule, lift.window.as_ref(), lift.first_job);
        let parts: Vec<_> =
            parts.iter().map(|part| (found.tasks.name(part.task), part.jobs, part.time)).collect();
        assert_eq!(parts, [("network (platform)", 3, ms(15)), (THROTTLING, 1, ms(50))]);
    }

    #[test]
    fn without_throttling_all_time_is_for_activities() {
        let set = ActivitySet { throttled: false, ..deployment() };
        let found = set.response_times(&options(Method::Psm), &|| ());
        let bounds: Vec<Option<Time>> = found.responses.iter().map(bound).collect();
        assert_eq!(bounds, [None, Some(ms(20)), Some(ms(60)), None, Some(ms(15))]);
    }

    #[test]
    fn numbers_and_names() {
        let set = deployment();
        let names: Vec<String> = (0..8).map(|number| set.name(number)).collect();
        let of_activities = ["log", "drive", "plan", "arm", "lift"];
        assert_eq!(names[..5], of_activities);
        assert_eq!(names[5..], ["network (platform)", THROTTLING, THROTTLING]);
        let others: Vec<bool> = (0..8).map(|number| set.other(number).is_some()).collect();
        assert_eq!(others, [false, false, false, false, false, true, false, false]);

        let tasks = set.response_times(&options(Method::Psm), &|| ()).tasks;
        let of_activities: Vec<Option<usize>> = (0..6).map(|activity| tasks.task(activity)).collect();
        assert_eq!(of_activities, [None, Some(0), Some(1), Some(2), Some(3), Some(4)]);
        let activities: Vec<usize> = (0..8).map(|task| tasks.activity(task)).collect();
        assert_eq!(activities, [1, 2, 3, 4, 5, 6, 7, usize::MAX]);
        let names: Vec<&str> = (0..8).map(|task| tasks.name(task)).collect();
        assert_eq!(names, ["", "", "", "", "network (platform)", THROTTLING, THROTTLING, ""]);
    }

    #[test]
    fn what_is_unknown_is_the_worst() {
        let mut set = ActivitySet { others: Vec::new(), throttled: false, ..deployment() };
        (set.activities[2].priority, set.activities[4].cpus) = (Priority::Unknown, None);
        let found = set.response_times(&options(Method::Psm), &|| ());
        // `plan` may have the highest priority, and `lift` may run on the CPU of `drive`, which has a higher one.
        assert_eq!(bound(&found.responses[1]), Some(ms(60)));
        assert_eq!(bound(&found.responses[2]), Some(ms(40)));
        assert_eq!(bound(&found.responses[4]), Some(ms(10)));
    }

    #[test]
    fn the_utilisation_of_an_overloaded_cpu() {
        let edge = |source, target, cost: u64| (source, target, cost * MS);
        let mut set = ActivitySet { throttled: false, ..deployment() };
        // The mean is 70 ms, and the greatest edge 100 ms.
        let plan = machine(2, &[edge(0, 1, 100), edge(1, 0, 40)]);
        set.activities[2].demand = Demand::Machine { machine: plan, whole: Some(ms(110)) };
        let drive = Demand::Machine { machine: StateMachine::single(ms(40)), whole: None };
        set.activities[1].demand = drive;
        set.activities.push(activity("below", Priority::RealTime(0), 1, 10));
        let rounded = |values: Vec<Option<f64>>| -> Vec<Option<f64>> {
            values.into_iter().map(|value| value.map(|value| (value * 1000.0).round())).collect()
        };
        let found = set.response_times(&options(Method::Psm), &|| ());
        assert_eq!(rounded(found.overloads), [None, None, Some(1100.0), None, None, Some(1200.0)]);
        let shares = [None, Some(400.0), Some(700.0), None, Some(100.0), Some(100.0)];
        assert_eq!(rounded(found.shares), shares);
        let found = set.response_times(&options(Method::Classic), &|| ());
        assert_eq!(rounded(found.overloads), [None, None, Some(1500.0), None, None, Some(1600.0)]);
        assert_eq!(rounded(found.shares)[2], Some(1100.0));
    }
}
