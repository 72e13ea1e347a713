//! The interference in the window of a response time, by task. It is computed on request: the lists of all tasks together
//! grow with the square of their number.

use crate::lane::{Lane, Member, Members};
use crate::response_time::{members, members_of_all};
use crate::{CpuRule, Interference, Method, Options, Task, Time, Window};

/// Lists the interference of tasks.
///
/// In a window of length t, each task of hp(i) interferes with Mⱼ(⌈(t + Jⱼ)/Tⱼ⌉), or with what another
/// [`Method`] counts; with a horizon H, in the window of a first job, with the jobs of min(t, H).
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
///     offset: None,
///     cpus: 1,
///     demand: Demand::Machine { machine: StateMachine::single(Time::from_nanos(cost)), whole: None },
/// };
/// let tasks = [task("laser", 2, 10, 4), task("pilot", 1, 30, 11)];
/// let options = Options { method: Method::Exact, horizon: None, is_brief: false };
/// let pilot = &response_times(&tasks, &options, &|| ()).responses[1];
/// let mut breakdown = Breakdown::new(&tasks, &options, &|| ());
/// let laser = breakdown.of(1, pilot.rule, pilot.window.as_ref(), pilot.first_job)[0];
/// assert_eq!((laser.task, laser.jobs, laser.time), (0, 2, Time::from_nanos(8)));
/// ```
pub struct Breakdown<'a> {
    options: &'a Options,
    interrupt: &'a dyn Fn(),
    members: Vec<Member<'a>>,
    tasks: &'a [Task],
}

impl<'a> Breakdown<'a> {
    /// Creates a breakdown of the response times of `tasks`, analysed with `options`. To cancel, `interrupt` unwinds.
    pub fn new(tasks: &'a [Task], options: &'a Options, interrupt: &'a dyn Fn()) -> Breakdown<'a> {
        Breakdown { options, interrupt, members: members(tasks, options, interrupt), tasks }
    }

    /// Returns the interference of each task of hp(`of`), in the order of the tasks, in the window of its response time;
    /// without a window, until its first job ends; without either, none. The arguments are those of its
    /// [`Response`](crate::Response).
    pub fn of(
        &mut self,
        of: usize,
        rule: CpuRule,
        window: Option<&Window>,
        first_job: Option<Time>,
    ) -> Vec<Interference> {
        let (length, method, horizon) = match (window, first_job) {
            (Some(window), _) => (window.length, window.method, None),
            (None, Some(first_job)) => {
                (first_job, Method::Psm.min(self.options.method), self.options.horizon)
            }
            (None, None) => return Vec::new(),
        };
        if length == Time::ZERO {
            return Vec::new();
        }
        let Some(task) = self.members.iter().find(|member| member.index == of).map(|member| member.task)
        else {
            return Vec::new();
        };
        (self.interrupt)();
        // The members of the lane that was analysed: its budget depends on their number.
        let is_in = |other: &Task| {
            let is_counted = matches!(rule, CpuRule::Cpu(_)) || other.priority >= task.priority;
            other.cpus & rule.mask() != 0 && is_counted
        };
        let places: Vec<usize> = (0..self.members.len()).filter(|&it| is_in(self.members[it].task)).collect();
        let is_by_paths = method == Method::Exact;
        // The other methods have found the window: they need no budget.
        let members_of_all = if is_by_paths { members_of_all(self.tasks, &self.members) } else { 1 };
        let mut lane = Lane {
            rule,
            members: Members { all: &mut self.members, places: &places },
            options: self.options,
            interrupt: self.interrupt,
            members_of_all,
            start: None,
            starts: 1,
            lists_interference: true,
        };
        if let Some(start) = window.and_then(|window| window.start) {
            lane.begin_at_again(start.as_nanos());
        }
        let found = if is_by_paths {
            by_paths(of, &mut lane)
        } else {
            let others = 0..lane.members.len();
            let others = others.filter_map(|place| {
                let member = lane.members.at(place);
                let delays = member.index != of && member.task.priority >= task.priority;
                // The analysis computed it before.
                let it = member.contribution(length.as_nanos(), method, horizon).ok()?;
                let interference =
                    Interference { task: member.index, jobs: it.jobs, time: Time::from_nanos(it.time) };
                Some(interference).filter(|it| delays && it.jobs > 0)
            });
            others.collect()
        };
        lane.begin_at(None, 1);
        found
    }
}

/// Searches the combination of paths again.
fn by_paths(of: usize, lane: &mut Lane<'_, '_>) -> Vec<Interference> {
    let found = lane.analyse(|member| member.index == of);
    let interference = found.into_iter().next().map_or_else(Vec::new, |found| found.interference).into_iter();
    let interference = interference.map(|(place, jobs, time)| Interference {
        task: lane.members.get(place).index,
        jobs,
        time: Time::from_nanos(time),
    });
    let mut interference: Vec<Interference> = interference.collect();
    interference.sort_unstable_by_key(|it| it.task);
    interference
}
