//! The schedule behind a response time: when the tasks are released, and which paths they take, in the window that gives it.
//!
//! On one CPU, a bound of [`Method::Exact`](crate::Method::Exact) is attained by this schedule if its budget was enough, and no
//! operations or release jitter of tasks with an offset are in it. (Of tasks that data releases, the releases are as
//! early as the bound for them allows: their writers may never write so.) Otherwise the schedule may stay below the bound. So it does where
//! jobs wait, which they do here after all that they execute, and where locks delay the activity: no lower priority is in the
//! schedule.

use crate::time::greatest_common_divisor;
use crate::{Bound, Breakdown, Options, Script, ScriptedTask, Task, Tasks, Time, worst_trace};

/// A schedule in which an activity responds as late as its analysis knows.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WorstCase {
    /// The job of the activity that responds late; from 1.
    pub job: u64,
    /// The response time that the analysis gives.
    pub bound: Time,
    /// The releases and paths.
    pub script: Script,
    /// The length of a simulation that contains the window and the release of the job after it.
    pub length: Time,
}

/// Why no schedule behind a response time is known.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NoWorstCase {
    /// There is no response time.
    NoResponse,
    /// The response time holds for any offsets: the window in which it occurs does not keep those of synchronised clocks.
    OtherOffsets,
}

impl Tasks {
    /// Returns the schedule behind the response time of an activity. To cancel, `interrupt` unwinds.
    ///
    /// # Errors
    ///
    /// The activity has no response time, or that of a window which does not keep the offsets of the tasks in it.
    ///
    /// ```
    /// use mauve_timing::*;
    ///
    /// let task = |priority, period, cost| {
    ///     Task::new(priority, Time::from_nanos(period), StateMachine::single(Time::from_nanos(cost)))
    /// };
    /// let set = Tasks::new(vec![task(2, 10, 4), task(1, 30, 11)]);
    /// let options = Options { method: Method::Exact, is_brief: false };
    /// let worst = set.worst_case(1, &options, &|| ()).unwrap();
    /// let simulated = SimulationOptions { script: Some(worst.script), ..SimulationOptions::new(1, worst.length) };
    /// let late = set.simulate(&simulated, &|| ()).statistics[1].unwrap().greatest;
    /// assert_eq!((worst.bound, late), (Time::from_nanos(19), Some(Time::from_nanos(19))));
    /// ```
    pub fn worst_case(
        &self,
        activity: usize,
        options: &Options,
        interrupt: &dyn Fn(),
    ) -> Result<WorstCase, NoWorstCase> {
        self.window_of(activity, options, interrupt).unwrap_or(Err(NoWorstCase::NoResponse))
    }

    fn window_of(
        &self,
        activity: usize,
        options: &Options,
        interrupt: &dyn Fn(),
    ) -> Option<Result<WorstCase, NoWorstCase>> {
        let analysis = self.response_times(options, interrupt);
        let response = analysis.responses.get(activity)?;
        let (Bound::Response(bound), Some(window)) = (&response.bound, &response.window) else { return None };
        let all = analysis.tasks.all();
        let of = all.get(activity)?;
        let mut breakdown = Breakdown::new(all, options, interrupt);
        let (late, interfering) = breakdown.paths(activity, response.rule, window)?;
        let in_window = || interfering.iter().filter_map(|it| all.get(it.task)).chain([of]);
        // The window keeps the offsets of its clock.
        let is_kept = |task: &Task| window.start.is_some() && task.clock == window.clock;
        if !may_start_together(&in_window().filter(|task| !is_kept(task)).collect::<Vec<_>>()) {
            return Some(Err(NoWorstCase::OtherOffsets));
        }
        // A job that is nominally released before the window is late, and released at its start.
        let start = in_window().map(|task| task.jitter).max()?;
        let first = |task: &Task, delay: Time| start.checked_add(delay)?.checked_sub(task.jitter);
        let mut tasks = vec![None; all.len()];
        let own = of.demand.machine();
        let own = own.and_then(|machine| worst_trace(machine, usize::try_from(late.job).ok()?));
        let own = (activity, window.delay, own.unwrap_or_default());
        let scripted = interfering.into_iter().map(|it| (it.task, it.delay, it.edges));
        for (task, delay, edges) in scripted.chain([own]) {
            let of = all.get(task)?;
            let arrivals = of.arrivals.clone();
            *tasks.get_mut(task)? = Some(ScriptedTask { first: first(of, delay)?, edges, arrivals });
        }
        let after = first(of, window.delay)?.checked_add(of.period?.checked_mul(late.job / of.burst())?)?;
        let end = start.checked_add(Time::from_nanos(late.length))?;
        let script = Script { start, tasks, last: activity };
        Some(Ok(WorstCase { job: late.job, bound: *bound, script, length: end.max(after) }))
    }
}

/// Returns whether there is an instant of each clock at which each of its tasks may be released at the latest, so that all of them may
/// be released together.
fn may_start_together(tasks: &[&Task]) -> bool {
    let last = |task: &Task| {
        let offset = u128::from(task.offset?.as_nanos());
        Some((offset + u128::from(task.jitter.as_nanos()), task.period?.as_nanos(), task.clock))
    };
    let all: Vec<(u128, u64, u32)> = tasks.iter().filter_map(|task| last(task)).collect();
    // By the Chinese remainder theorem, it is enough that each two of them may.
    let may = |&(a, a_period, one): &(u128, u64, u32), &(b, b_period, other): &(u128, u64, u32)| {
        let common = greatest_common_divisor(a_period, b_period).max(1);
        one != other || a.abs_diff(b).is_multiple_of(u128::from(common))
    };
    all.iter().enumerate().all(|(index, one)| all[..index].iter().all(|other| may(one, other)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{machine, machines, simple, task};
    use crate::{Lock, LockUser, Method, Protocol, Response, SimulationOptions, Waits};
    use proptest::prelude::*;

    const EXACT: Options = Options { method: Method::Exact, is_brief: false };

    /// The bound of an activity, and the response of the late job in its schedule. No other response is above its bound either.
    fn bound_and_simulated(set: &Tasks, of: usize) -> Option<(u64, u64)> {
        let worst = set.worst_case(of, &EXACT, &|| ()).ok()?;
        let options =
            SimulationOptions { script: Some(worst.script), ..SimulationOptions::new(1, worst.length) };
        let schedule = set.simulate(&options, &|| ());
        let job = schedule.jobs.iter().find(|job| job.activity == of && job.number == worst.job)?;
        let response = job.end?.as_nanos() - job.nominal.as_nanos();
        let responses = set.response_times(&EXACT, &|| ()).responses;
        for (found, statistics) in responses.iter().zip(&schedule.statistics) {
            if let (Bound::Response(bound), Some(statistics)) = (&found.bound, statistics) {
                assert!(statistics.greatest <= Some(*bound), "{schedule:?}");
            }
        }
        Some((worst.bound.as_nanos(), response))
    }

    #[test]
    fn the_paths_of_a_window() {
        let paths = [(0, 0, 1), (1, 1, 2), (2, 2, 1), (0, 1, 0), (1, 2, 3), (2, 0, 1)];
        let hp = task(2, 4, machine(3, &paths));
        let set = Tasks::new(vec![hp, simple(1, 8, 2)]);
        assert_eq!([0, 1].map(|of| bound_and_simulated(&set, of)), [Some((3, 3)), Some((6, 6))]);
    }

    #[test]
    fn a_late_job_of_the_window() {
        // The fifth job is the latest (Lehoczky, RTSS 1990).
        let set = Tasks::new(vec![simple(2, 70, 26), simple(1, 100, 62)]);
        assert_eq!(set.worst_case(1, &EXACT, &|| ()).unwrap().job, 5);
        assert_eq!(bound_and_simulated(&set, 1), Some((118, 118)));
    }

    #[test]
    fn a_thread_and_a_burst() {
        let thread = |cost| Task { thread: Some(1), ..simple(1, 20, cost) };
        let burst = Task { burst: 2, ..simple(0, 40, 3) };
        let set = Tasks::new(vec![simple(2, 10, 2), thread(1), thread(5), burst]);
        let expected = [2, 3, 8, 16].map(|bound| Some((bound, bound)));
        assert_eq!([0, 1, 2, 3].map(|of| bound_and_simulated(&set, of)), expected);
    }

    #[test]
    fn late_releases_and_offsets() {
        let mut activities = vec![simple(2, 10, 2), simple(1, 20, 6), simple(1, 20, 1)];
        activities[0].jitter = Time::from_nanos(3);
        let set = Tasks::new(activities.clone());
        assert_eq!(bound_and_simulated(&set, 1), Some((11, 11)));
        activities[0].jitter = Time::ZERO;
        for (activity, offset) in activities.iter_mut().zip([0, 1, 12]) {
            activity.offset = Some(Time::from_nanos(offset));
        }
        let set = Tasks::new(activities);
        assert_eq!(
            [0, 1, 2].map(|of| bound_and_simulated(&set, of)),
            [Some((2, 2)), Some((7, 7)), Some((1, 1))]
        );
    }

    /// The first job responds in 10 with another path, and the third one with the path that is found first.
    #[test]
    fn two_jobs_that_are_equally_late() {
        let mut late = simple(0, 6, 4);
        late.jitter = Time::from_nanos(1);
        let other = task(0, 12, machine(3, &[(0, 0, 1), (1, 0, 1), (2, 0, 5), (1, 2, 4)]));
        let set = Tasks::new(vec![late, other]);
        assert_eq!(bound_and_simulated(&set, 0), Some((10, 10)));
    }

    #[test]
    fn whatever_may_delay_has_a_part() {
        // 70 activities of one priority: each of them executes once.
        let many = Tasks::new(vec![simple(1, 1000, 1); 70]);
        assert_eq!(bound_and_simulated(&many, 69), Some((70, 70)));
        // More other work than activities.
        let others = vec![simple(50, 100, 2), simple(50, 100, 3)];
        let set = Tasks::new(vec![simple(1, 100, 4)]).with_platform(others, false);
        assert_eq!(bound_and_simulated(&set, 0), Some((9, 9)));
        // 50 ms of each second are not its own.
        let activities = vec![simple(1, 1_000_000_000, 4)];
        let set = Tasks::new(activities).with_platform(Vec::new(), true);
        assert_eq!(bound_and_simulated(&set, 0), Some((50_000_004, 50_000_004)));
    }

    #[test]
    fn nothing_without_a_response_time() {
        let set = Tasks::new(vec![simple(2, 10, 11)]);
        assert_eq!(set.worst_case(0, &EXACT, &|| ()), Err(NoWorstCase::NoResponse));
        assert_eq!(set.worst_case(1, &EXACT, &|| ()), Err(NoWorstCase::NoResponse));
    }

    #[test]
    fn nothing_that_does_not_keep_the_offsets() {
        // Fully loaded: the window of the last activity begins at any instant.
        let mut activities = vec![simple(3, 10, 4), simple(2, 10, 4), simple(1, 10, 2)];
        activities[2].jitter = Time::from_nanos(1);
        for (activity, offset) in activities.iter_mut().zip([0, 5, 0]) {
            activity.offset = Some(Time::from_nanos(offset));
        }
        let set = Tasks::new(activities);
        assert_eq!(set.worst_case(2, &EXACT, &|| ()), Err(NoWorstCase::OtherOffsets));
        assert_eq!(bound_and_simulated(&set, 1), Some((4, 4)));
    }

    fn activities() -> impl Strategy<Value = Vec<Task>> {
        let period = prop::sample::select(&[3u64, 4, 6, 8, 12, 20][..]);
        let jitter = prop_oneof![3 => Just(0u64), 1 => 0..20u64];
        let offset = prop_oneof![2 => Just(None), 1 => (0..20u64).prop_map(Some)];
        let any = (0..3u32, period, jitter, offset, machines(3, 5)).prop_map(
            |(priority, period, jitter, offset, machine)| Task {
                jitter: Time::from_nanos(jitter),
                offset: offset.map(|offset| Time::from_nanos(offset % period)),
                // A job without demand counts as 1 ns in the analysis.
                ..task(priority, period, machine.with_added(Time::from_nanos(1)).unwrap())
            },
        );
        proptest::collection::vec(any, 1..5)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn it_is_below_the_bound_with_waits_and_locks(
            activities in activities(),
            waits in proptest::collection::vec(0..6u64, 4),
            users in proptest::collection::vec((0..4usize, 0..5u64), 2),
            protocol in prop::sample::select(&Protocol::ALL[..]),
        ) {
            let mut activities = activities;
            for (activity, wait) in activities.iter_mut().zip(waits) {
                let machine = activity.demand.machine().unwrap().clone();
                let waits = vec![Time::from_nanos(wait); machine.edges().len()];
                (activity.demand, activity.waits) = Waits::with_demand(machine, &waits, Some(1), None).unwrap();
            }
            let mut users: Vec<LockUser> = users
                .into_iter()
                .filter(|(task, _)| *task < activities.len())
                .map(|(task, held)| LockUser { task, held: Some(Time::from_nanos(held)) })
                .collect();
            users.dedup_by_key(|user| user.task);
            let locks = vec![Lock { name: "lock".into(), protocol, users }];
            let set = Tasks { locks, ..Tasks::new(activities) };
            for of in 0..set.activities().len() {
                if let Some((bound, simulated)) = bound_and_simulated(&set, of) {
                    prop_assert!(simulated <= bound);
                }
            }
        }

        #[test]
        fn it_attains_what_is_exact(activities in activities(), mates in 0..3usize, burst in 1..4u64) {
            let activities = crate::testing::with_thread(activities, mates, burst);
            let is_late = |it: &Task| it.offset.is_some() && it.jitter > Time::ZERO;
            let is_attained = !activities.iter().any(is_late);
            let set = Tasks::new(activities);
            let responses = set.response_times(&EXACT, &|| ()).responses;
            for (of, response) in responses.iter().enumerate() {
                let Some((bound, simulated)) = bound_and_simulated(&set, of) else { continue };
                prop_assert!(simulated <= bound);
                let is_exact =
                    |it: &Response| it.method == Method::Exact && !it.is_exhausted;
                if is_attained && is_exact(response) {
                    prop_assert_eq!(simulated, bound);
                }
            }
        }
    }
}
