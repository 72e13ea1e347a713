//! The interference in the window of a response time, by task. It is computed on request: the lists of all tasks together
//! grow with the square of their number.

use crate::response_time::{Curve, jobs_released};
use crate::{Demand, Interference, Options, Task, Time, Window};

/// Lists the interference of tasks.
///
/// In a window of length t, each task of hp(i) interferes with Mⱼ(⌈t/Tⱼ⌉); with a horizon H, with Mⱼ(⌈min(t, H)/Tⱼ⌉) in the
/// window of a first job.
///
/// ```
/// use mauve_timing::*;
///
/// let task = |name: &str, priority, period, cost| Task {
///     name: name.to_owned(),
///     priority,
///     period: Time::from_nanos(period),
///     deadline: Time::from_nanos(period),
///     jitter: Time::ZERO,
///     cpus: 1,
///     demand: Demand::Machine { machine: StateMachine::single(Time::from_nanos(cost)), whole: None },
/// };
/// let tasks = [task("laser", 2, 10, 4), task("pilot", 1, 30, 11)];
/// let options = Options { method: Method::Psm, horizon: None, is_brief: false };
/// let pilot = &response_times(&tasks, &options, &|| ()).responses[1];
/// let laser = Breakdown::new(&tasks, &options, &|| ()).of(1, pilot.window.as_ref(), pilot.first_job)[0];
/// assert_eq!((laser.task, laser.jobs, laser.time), (0, 2, Time::from_nanos(8)));
/// ```
pub struct Breakdown<'a> {
    tasks: &'a [Task],
    options: &'a Options,
    interrupt: &'a dyn Fn(),
    /// The demand of each task, from its first use on.
    curves: Vec<Option<Curve<'a>>>,
}

impl<'a> Breakdown<'a> {
    /// Creates a breakdown of the response times of `tasks`, analysed with `options`. To cancel, `interrupt` unwinds.
    pub fn new(tasks: &'a [Task], options: &'a Options, interrupt: &'a dyn Fn()) -> Breakdown<'a> {
        Breakdown { tasks, options, interrupt, curves: tasks.iter().map(|_| None).collect() }
    }

    /// Returns the interference of each task of hp(`of`), in the order of the tasks, in the window of the response time of
    /// `of`; without a window, until its first job ends; without either, none.
    pub fn of(&mut self, of: usize, window: Option<&Window>, first_job: Option<Time>) -> Vec<Interference> {
        let (length, horizon) = match (window, first_job) {
            (Some(window), _) => (window.length, None),
            (None, Some(first_job)) => (first_job, self.options.horizon),
            (None, None) => return Vec::new(),
        };
        let Some((task, cpu)) = self.tasks.get(of).and_then(|task| Some((task, task.known()?))) else {
            return Vec::new();
        };
        (self.interrupt)();
        let mut found = Vec::new();
        for (index, (other, curve)) in self.tasks.iter().zip(&mut self.curves).enumerate() {
            let Demand::Machine { machine, .. } = &other.demand else { continue };
            if index == of || other.priority < task.priority || other.known() != Some(cpu) {
                continue;
            }
            let curve =
                curve.get_or_insert_with(|| Curve::new(other, machine, self.options.method, self.interrupt));
            let jobs = jobs_released(length.as_nanos(), other.period.as_nanos(), horizon);
            // The analysis computed it before.
            if let Ok(time) = curve.demand(jobs) {
                found.push(Interference { task: index, jobs, time: Time::from_nanos(time) });
            }
        }
        found
    }
}
