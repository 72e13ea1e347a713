//! Tasks whose clocks are synchronised: the windows that begin at their actual releases, instead of a simultaneous release of all.
//!
//! A task with an [`offset`](crate::Task::offset) O is nominally released at O, O + T, O + 2·T, … on the clock that all such tasks
//! share, and at most J later. Take a window of hp(i) and i that begins at the instant s of this clock, when nothing of them is
//! unfinished. The jobs in it are those that are nominally released from s − J on. The first one is so at s − J + d, where d is
//! the delay (O + J − s) mod T: a window of length t has ⌈(t + J − d)/T⌉ jobs. Without an offset, d is 0.
//!
//! Only the instants s ≡ O + J (mod T) of these tasks matter. Any other s can be moved to the next of them: no job is lost, since
//! none has its nominal release between s − J and s' − J; from the later start, each length of window has as many jobs or more;
//! and the own job is released at the same instant. So each job ends at the same instant or later.
//!
//! **Several clocks.** The offsets of a clock only exclude schedules. So the windows of one clock, which forget the offsets of the
//! others, contain all schedules, and their bound holds: of those of all clocks, the least.
//!
//! The states of the machines are still any: a window bounds all paths, also those that no run takes at s.

use std::cmp::Ordering;
use std::collections::BTreeSet;

use crate::lane::{Lane, LaneMember, Members};
use crate::lane_analysis::LaneResponse;
use crate::time::least_common_multiple;
use crate::{Bound, Method, Options, Priority, Time};

/// The maximum product of the number of instants and the square of the number of members, which is about the number of visited
/// members if a fixed point takes few steps.
const MOST_VISITS: u64 = 1 << 20;

/// The same for [`Method::Best`]: some 10 ms.
const FEWER_VISITS: u64 = 1 << 17;

const BRIEF_VISITS: u64 = 1 << 15;

/// The instants at which windows of a lane may begin.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Starts {
    /// Any: at some instant, all tasks are released together as if they had no offsets.
    Any,
    /// These, ascending.
    Known(Vec<u64>),
    /// They are too many.
    TooMany,
}

/// Returns the instants of a clock at which windows of these members may begin. Members with a priority below `least` begin none: they delay
/// none of the others, so their windows do not count against the limit.
fn starts(members: &Members<'_, '_>, least: Priority, clock: u32, options: &Options) -> Starts {
    let counted =
        || (0..members.len()).map(|place| members.get(place)).filter(|it| it.task.priority >= least);
    let with_offset: Vec<&LaneMember<'_>> = counted().filter(|member| is_of(member, clock)).collect();
    if with_offset.len() < 2 {
        return Starts::Any;
    }
    let most = match (options.is_brief, options.method) {
        (true, _) => BRIEF_VISITS,
        (false, Method::Best) => FEWER_VISITS,
        (false, _) => MOST_VISITS,
    };
    let count = counted().count() as u64;
    let most = most / count.saturating_mul(count);
    let common = with_offset.iter().try_fold(1, |all, member| least_common_multiple(all, member.period));
    let Some(common) = common else { return Starts::TooMany };
    let all = with_offset.iter().try_fold(0u64, |all, member| all.checked_add(common / member.period));
    // Several tasks have releases at the same instants.
    if all.is_none_or(|all| all / with_offset.len() as u64 > most) {
        return Starts::TooMany;
    }
    let mut starts: Vec<u64> = Vec::new();
    for member in &with_offset {
        let first = last_release(member) % member.period;
        starts.extend((0..common / member.period).map(|lap| first + lap * member.period));
        starts.sort_unstable();
        starts.dedup();
        if starts.len() as u64 > most {
            return Starts::TooMany;
        }
    }
    let is_simultaneous = |start: &u64| with_offset.iter().all(|member| delay(member, *start) == 0);
    if starts.iter().any(is_simultaneous) { Starts::Any } else { Starts::Known(starts) }
}

fn is_of(member: &LaneMember<'_>, clock: u32) -> bool {
    member.task.instant().is_some() && member.task.clock == clock
}

/// The last instant, modulo T, at which a job may be released.
fn last_release(member: &LaneMember<'_>) -> u64 {
    let offset = member.task.instant().unwrap_or_default().as_nanos();
    let sum = u128::from(offset) + u128::from(member.jitter);
    (sum % u128::from(member.period)) as u64
}

/// The delay of a task in a window that begins at `start`.
fn delay(member: &LaneMember<'_>, start: u64) -> u64 {
    let (last, start) = (last_release(member), start % member.period);
    if last >= start { last - start } else { member.period - (start - last) }
}

impl Lane<'_, '_> {
    /// Lets the windows of the lane begin at this instant of a clock, of `starts`; with `None`, at any.
    pub(crate) fn begin_at(&mut self, start: Option<(u64, u32)>, starts: usize) {
        (self.start, self.starts) = (start, (starts as u64).max(1));
        for place in 0..self.members.len() {
            let member = self.members.at(place);
            let at = start.filter(|(_, clock)| is_of(member, *clock));
            member.delay = at.map_or(0, |(start, _)| delay(member, start));
        }
    }

    /// Lets the windows of the task at `place` begin at this instant of a clock, one of those that [`Lane::synchronise`] analysed.
    pub(crate) fn begin_at_again(&mut self, start: (u64, u32), place: usize) {
        let starts = match starts(&self.members, self.priority(place), start.1, self.options) {
            Starts::Known(starts) => starts.len(),
            Starts::Any | Starts::TooMany => 1,
        };
        self.begin_at(Some(start), starts);
    }

    /// Replaces what was `found` for windows that begin at any instant by what is found for those that begin at an actual release,
    /// where that is less.
    pub(crate) fn synchronise(&mut self, found: &mut [LaneResponse]) {
        // A window that ends does so no later if it begins at a known instant.
        let ends = |found: &LaneResponse| found.busy.is_some_and(|busy| busy.ends);
        let priorities: BTreeSet<Priority> =
            found.iter().filter(|it| ends(it)).map(|it| self.priority(it.place)).collect();
        let members = (0..self.members.len()).map(|place| self.members.get(place).task);
        let clocks: BTreeSet<u32> =
            members.filter(|task| task.instant().is_some()).map(|task| task.clock).collect();
        for (priority, clock) in priorities.iter().flat_map(|it| clocks.iter().map(|clock| (*it, *clock))) {
            let is_of = |found: &&mut LaneResponse| ends(found) && self.priority(found.place) == priority;
            let group: Vec<&mut LaneResponse> = found.iter_mut().filter(is_of).collect();
            self.synchronise_group(priority, clock, group);
        }
    }

    /// [`Lane::synchronise`] for the tasks of one priority, in the order of their places, and the releases of one clock.
    fn synchronise_group(&mut self, priority: Priority, clock: u32, group: Vec<&mut LaneResponse>) {
        let starts = match starts(&self.members, priority, clock, self.options) {
            Starts::Any => return,
            Starts::Known(starts) => starts,
            Starts::TooMany => {
                group.into_iter().for_each(|found| found.response.is_exhausted = true);
                return;
            }
        };
        // Each with the greatest that is found for a known instant.
        let mut open: Vec<(&mut LaneResponse, Option<LaneResponse>)> =
            group.into_iter().map(|found| (found, None)).collect();
        for &start in &starts {
            if open.is_empty() {
                break;
            }
            self.begin_at(Some((start, clock)), starts.len());
            // Ascending, as the places are.
            let tasks: Vec<usize> = open.iter().map(|(found, _)| found.task).collect();
            let mut of_start = self.analyse(|member| tasks.binary_search(&member.index).is_ok()).into_iter();
            open.retain_mut(|(known, greatest)| {
                let Some(mut of_start) = of_start.next() else { return false };
                // It counts from the start of the window, which is no release of the task.
                of_start.response.first_job = None;
                let (Some(time), Some(known_time)) = (bound(&of_start), bound(known)) else {
                    known.response.is_exhausted = true;
                    return false;
                };
                match time.cmp(&known_time) {
                    Ordering::Less => {
                        if greatest.as_ref().and_then(bound) < Some(time) {
                            *greatest = Some(of_start);
                        }
                    }
                    // Nothing less will be found. This window keeps the offsets.
                    Ordering::Equal => **known = of_start,
                    Ordering::Greater => known.response.is_exhausted |= of_start.response.is_exhausted,
                }
                time < known_time
            });
        }
        self.begin_at(None, 1);
        for (known, greatest) in open {
            if let Some(greatest) = greatest {
                *known = greatest;
            }
        }
    }
}

fn bound(found: &LaneResponse) -> Option<Time> {
    if let Bound::Response(time) = found.response.bound { Some(time) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, brute_force_demand, machine, machines};
    use crate::{Analysis, Breakdown, Demand, Response, StateMachine, Task, response_times};
    use proptest::prelude::*;

    fn task(priority: u32, period: u64, offset: Option<u64>, machine: StateMachine) -> Task {
        Task { offset: offset.map(Time::from_nanos), ..testing::task(priority, period, machine) }
    }

    fn simple(priority: u32, period: u64, offset: u64, cost: u64) -> Task {
        task(priority, period, Some(offset), StateMachine::single(Time::from_nanos(cost)))
    }

    fn options(method: Method) -> Options {
        Options { method, is_brief: false }
    }

    fn analyse(tasks: &[Task], method: Method) -> Analysis {
        response_times(tasks, &options(method), &|| ())
    }

    fn bound(response: &Response) -> Option<u64> {
        if let Bound::Response(time) = response.bound { Some(time.as_nanos()) } else { None }
    }

    fn bounds(tasks: &[Task]) -> Vec<Option<u64>> {
        analyse(tasks, Method::Psm).responses.iter().map(bound).collect()
    }

    fn without_offsets(tasks: &[Task]) -> Vec<Task> {
        tasks.iter().map(|task| Task { offset: None, ..task.clone() }).collect()
    }

    #[test]
    fn tasks_that_never_meet() {
        let tasks = [simple(2, 10, 0, 4), simple(1, 10, 5, 4)];
        assert_eq!(bounds(&tasks), [Some(4), Some(4)]);
        assert_eq!(bounds(&without_offsets(&tasks)), [Some(4), Some(8)]);
        let window = analyse(&tasks, Method::Psm).responses.swap_remove(1).window.unwrap();
        assert_eq!((window.start, window.delay), (Some(Time::from_nanos(5)), Time::ZERO));
    }

    #[test]
    fn a_window_that_begins_before_the_own_release() {
        // From 0 to 6 the first task, and 1 of the second; its job of 6 is released at 5, within this window.
        let tasks = [simple(2, 20, 0, 6), simple(1, 20, 5, 2)];
        assert_eq!(bounds(&tasks), [Some(6), Some(3)]);
        let response = analyse(&tasks, Method::Psm).responses.swap_remove(1);
        let window = response.window.unwrap();
        assert_eq!((window.start, window.delay), (Some(Time::ZERO), Time::from_nanos(5)));
        assert_eq!((window.length, response.first_job), (Time::from_nanos(8), None));
    }

    #[test]
    fn one_clock_alone_has_any_phase() {
        let mut tasks = vec![simple(2, 10, 0, 4), simple(1, 10, 5, 4)];
        tasks[0].offset = None;
        assert_eq!(bounds(&tasks), [Some(4), Some(8)]);
        // The third task may be released with either.
        tasks[0].offset = Some(Time::ZERO);
        tasks.push(task(3, 20, None, StateMachine::single(Time::from_nanos(1))));
        assert_eq!(bounds(&tasks), [Some(5), Some(5), Some(1)]);
    }

    /// What two clocks release may meet, each with all releases of the other.
    #[test]
    fn tasks_of_several_clocks() {
        let of = |clocks: [u32; 4]| {
            let tasks =
                [simple(4, 20, 0, 3), simple(3, 20, 10, 4), simple(2, 20, 0, 2), simple(1, 20, 10, 2)];
            let with = |(task, clock): (Task, u32)| Task { clock, ..task };
            let tasks: Vec<Task> = tasks.into_iter().zip(clocks).map(with).collect();
            let window =
                |task: usize| analyse(&tasks, Method::Psm).responses.swap_remove(task).window.unwrap();
            (bounds(&tasks), window(3).start.map(|start| (start.as_nanos(), window(3).clock)))
        };
        let all = |bounds: [u64; 4]| bounds.map(Some).to_vec();
        assert_eq!(of([0; 4]), (all([3, 4, 5, 6]), Some((10, 0))));
        assert_eq!(of([0, 1, 2, 3]), (all([3, 7, 9, 11]), None));
        // Of the last task, the windows of its own clock count, or those of the other one.
        assert_eq!(of([1, 0, 0, 1]), (all([3, 7, 5, 8]), Some((10, 1))));
        assert_eq!(of([0, 0, 1, 1]), (all([3, 4, 6, 8]), Some((10, 0))));
    }

    #[test]
    fn a_late_release_meets_the_next_task() {
        let mut tasks = [simple(2, 10, 0, 4), simple(1, 10, 5, 3)];
        tasks[0].jitter = Time::from_nanos(3);
        // Released at 3, it ends at 7: the second task, released at 5, ends at 10.
        assert_eq!(bounds(&tasks), [Some(7), Some(5)]);
        // Here the next job, which is not late, preempts it from 10 to 14.
        tasks[1] = simple(1, 10, 5, 4);
        assert_eq!(bounds(&tasks), [Some(7), Some(10)]);
    }

    /// Its period would make the common one too long.
    #[test]
    fn a_task_that_delays_nobody_changes_nothing() {
        let mut tasks = vec![simple(3, 10, 0, 4), simple(2, 10, 5, 4)];
        let before = bounds(&tasks);
        tasks.push(simple(1, 999_983, 0, 1));
        assert_eq!(bounds(&tasks)[..2], before);
    }

    #[test]
    fn a_hyperperiod_that_is_too_long() {
        let tasks = [simple(2, (1 << 61) - 1, 0, 4), simple(1, 1 << 61, 5, 4)];
        let found = analyse(&tasks, Method::Psm).responses;
        assert_eq!((bound(&found[1]), found[1].is_exhausted), (Some(8), true));
        let tasks = [simple(2, (1 << 61) - 1, 0, 4), simple(1, 3, 1, 1)];
        let found = analyse(&tasks, Method::Psm).responses;
        assert_eq!((bound(&found[1]), found[1].is_exhausted), (Some(5), true));
        let tasks = [simple(2, 9_999_991, 0, 4), simple(1, 9_999_973, 5, 4)];
        let found = analyse(&tasks, Method::Psm).responses;
        assert_eq!((bound(&found[1]), found[1].is_exhausted), (Some(8), true));
    }

    #[test]
    fn paths_in_a_window_of_two_instants() {
        let heavy_first = machine(2, &[(0, 1, 5), (1, 0, 1)]);
        let tasks = [task(2, 10, Some(0), heavy_first), simple(1, 20, 2, 7)];
        let found = [Method::Classic, Method::Psm, Method::Ibf, Method::Exact]
            .map(|method| bound(&analyse(&tasks, method).responses[1]));
        // 5 until 5, own 5 until 10, then 1 or 5, and own 2.
        assert_eq!(found, [Some(15), Some(11), Some(11), Some(11)]);
    }

    fn starts_of(tasks: &[Task], options: Options) -> Starts {
        let mut lanes = crate::response_time::Lanes::new(tasks, &options, &|| ());
        let places: Vec<usize> = (0..lanes.members.len()).collect();
        starts(&Members { all: &mut lanes.members, places: &places }, Priority::RealTime(0), 0, &options)
    }

    #[test]
    fn windows_begin_at_the_last_releases() {
        let mut tasks =
            [simple(1, 4, 1, 1), simple(1, 6, 2, 1), task(1, 5, None, StateMachine::single(Time::ZERO))];
        assert_eq!(starts_of(&tasks, options(Method::Psm)), Starts::Known(vec![1, 2, 5, 8, 9]));
        // An offset and a jitter may be longer than the period.
        tasks[0].offset = Some(Time::from_nanos(9));
        tasks[0].jitter = Time::from_nanos(10);
        assert_eq!(starts_of(&tasks, options(Method::Psm)), Starts::Known(vec![2, 3, 7, 8, 11]));
        // Both are released at 8.
        tasks[0].jitter = Time::from_nanos(11);
        assert_eq!(starts_of(&tasks, options(Method::Psm)), Starts::Any);
        assert_eq!(starts_of(&tasks[1..], options(Method::Psm)), Starts::Any);
    }

    #[test]
    fn the_number_of_instants_is_bounded() {
        // The greatest number is 2¹⁸ for two tasks; 2¹⁵ for the best method, and 2¹³ in a brief analysis.
        let number = |first, second, options| match starts_of(
            &[simple(1, first, 0, 1), simple(1, second, 1, 1)],
            options,
        ) {
            Starts::Known(starts) => Some(starts.len()),
            Starts::Any | Starts::TooMany => None,
        };
        let brief = Options { is_brief: true, ..options(Method::Best) };
        assert_eq!(number(4, 200_002, options(Method::Exact)), Some(100_003));
        assert_eq!(number(4, 200_002, options(Method::Best)), None);
        assert_eq!(number(4, 40_002, options(Method::Best)), Some(20_003));
        assert_eq!(number(4, 20_002, brief), None);
        assert_eq!(number(4, 2_002, brief), Some(1_003));
        assert_eq!(number(4, 800_002, options(Method::Exact)), None);
    }

    #[test]
    fn a_window_at_an_instant_is_reported_if_it_is_shorter() {
        let window = |tasks: &[Task], task: usize| {
            let window = analyse(tasks, Method::Psm).responses.swap_remove(task).window.unwrap();
            (window.start.map(Time::as_nanos), window.delay.as_nanos())
        };
        let tasks = [simple(2, 10, 0, 4), simple(1, 10, 5, 4)];
        assert_eq!((window(&tasks, 0), window(&tasks, 1)), ((None, 0), (Some(5), 0)));
        // Of equal ones, the first.
        let tasks = [simple(1, 12, 0, 4), simple(1, 24, 16, 3)];
        assert_eq!((window(&tasks, 0), window(&tasks, 1)), ((Some(0), 0), (Some(12), 4)));
    }

    #[test]
    fn a_search_at_one_instant_that_ends_early() {
        let idle = [(0, 1, 0), (1, 1, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 0), (0, 1, 0), (2, 2, 0)];
        let first = [(0, 2, 2), (1, 2, 1), (2, 1, 3), (3, 2, 3), (3, 3, 3), (0, 1, 4), (1, 0, 3)];
        let second = [(0, 0, 3), (1, 1, 4), (2, 0, 4), (1, 0, 1), (2, 0, 1), (1, 2, 5), (0, 1, 1)];
        let third = [(0, 0, 0), (1, 1, 0), (2, 2, 0), (3, 1, 0), (2, 2, 0), (0, 3, 0), (2, 3, 0)];
        let tasks = [
            task(0, 24, Some(2), machine(3, &idle)),
            task(1, 12, Some(5), machine(4, &first)),
            task(2, 6, None, machine(3, &second)),
            task(0, 12, None, machine(4, &third)),
        ];
        let options = Options { is_brief: true, ..options(Method::Exact) };
        let found = response_times(&tasks, &options, &|| ()).responses.swap_remove(0);
        // At any instant, the search is complete.
        assert_eq!((bound(&found), found.method, found.is_exhausted), (Some(36), Method::Exact, true));
        let found = response_times(&without_offsets(&tasks), &options, &|| ()).responses.swap_remove(0);
        assert_eq!((bound(&found), found.method, found.is_exhausted), (Some(36), Method::Exact, false));
    }

    /// M(0), M(1), … as far as the tests need them.
    fn demands(task: &Task) -> Vec<u64> {
        let Demand::Machine { machine, .. } = &task.demand else { panic!("known") };
        let most = |jobs| (0..machine.states()).map(|state| brute_force_demand(machine, state, jobs)).max();
        let small: Vec<u64> = (0..9).map(|jobs| most(jobs).unwrap()).collect();
        let mut bound = crate::TraceBound::new(machine);
        let demand = |jobs: usize| {
            small.get(jobs).copied().unwrap_or_else(|| bound.demand(jobs as u64).unwrap().as_nanos())
        };
        (0..400).map(demand).collect()
    }

    /// The definition: windows from every instant of the common period, the nominal releases one by one, every t from 1 on, and
    /// every own job.
    fn greatest_of_all_windows(tasks: &[Task], index: usize, common: u64) -> u64 {
        let task = &tasks[index];
        let demands: Vec<Vec<u64>> = tasks.iter().map(demands).collect();
        let hp = (0..tasks.len()).filter(|&other| other != index && tasks[other].priority >= task.priority);
        let hp: Vec<usize> = hp.collect();
        // The first nominal release from `start` − J on, and the number of those before `end`; relative to the start.
        let first = |task: &Task, start: i64| {
            let (period, jitter) = (task.period.unwrap().as_nanos() as i64, task.jitter.as_nanos() as i64);
            task.offset.map_or(-jitter, |offset| {
                (-jitter..)
                    .find(|at| (start + at - offset.as_nanos() as i64).rem_euclid(period) == 0)
                    .unwrap()
            })
        };
        let mut greatest = 0;
        for start in 0..common as i64 {
            let firsts: Vec<i64> = tasks.iter().map(|task| first(task, start)).collect();
            let jobs = |other: usize, end: i64| {
                let (mut at, mut jobs) = (firsts[other], 0);
                while at < end {
                    (at, jobs) = (at + tasks[other].period.unwrap().as_nanos() as i64, jobs + 1);
                }
                jobs
            };
            let (mut job, mut end) = (1, 1);
            loop {
                end = (end..)
                    .find(|&end| {
                        let others = hp.iter().map(|&other| demands[other][jobs(other, end)]);
                        demands[index][job].max(1) + others.sum::<u64>() == end as u64
                    })
                    .unwrap();
                let period = task.period.unwrap().as_nanos() as i64;
                let released = firsts[index] + (job as i64 - 1) * period;
                greatest = greatest.max(end - released);
                if end <= released + period {
                    break;
                }
                job += 1;
            }
        }
        greatest as u64
    }

    fn any_tasks() -> impl Strategy<Value = Vec<Task>> {
        let period = prop::sample::select(&[2u64, 3, 4, 6, 8, 12, 24][..]);
        let offset = prop_oneof![4 => (0..24u64).prop_map(Some), 1 => Just(None)];
        let jitter = prop_oneof![3 => Just(0u64), 1 => 0..10u64];
        let any = (0..3u32, period, offset, jitter, 1..6u64).prop_flat_map(
            |(priority, period, offset, jitter, costs)| {
                machines(3, costs).prop_map(move |machine| Task {
                    jitter: Time::from_nanos(jitter),
                    ..task(priority, period, offset.map(|offset| offset % period), machine)
                })
            },
        );
        proptest::collection::vec(any, 2..5)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn equals_the_greatest_of_the_windows_of_all_instants(tasks in any_tasks()) {
            let with_offset = tasks.iter().filter(|task| task.offset.is_some());
            let common = with_offset.map(|task| task.period.unwrap().as_nanos()).try_fold(1, least_common_multiple).unwrap();
            let any_phase = analyse(&without_offsets(&tasks), Method::Psm).responses;
            for (index, response) in analyse(&tasks, Method::Psm).responses.iter().enumerate() {
                let of_any = bound(&any_phase[index]);
                let Some(of_any) = of_any.filter(|&bound| bound < 200) else {
                    prop_assert!(bound(response) <= of_any && bound(response).is_some() == of_any.is_some());
                    continue;
                };
                // At full load, a window may have no end.
                if any_phase[index].window.as_ref().is_none_or(|it| it.job < 30) {
                    let load = &analyse(&tasks, Method::Psm).cpus[0].utilisation;
                    if load.compare_with_one().is_lt() {
                        let expected = greatest_of_all_windows(&tasks, index, common);
                        prop_assert_eq!(bound(response), Some(expected.min(of_any)));
                    }
                }
            }
        }

        #[test]
        fn each_method_is_never_above_the_one_before(tasks in any_tasks()) {
            let methods = [Method::Classic, Method::Psm, Method::Ibf, Method::Exact];
            let found = methods.map(|method| analyse(&tasks, method));
            for (before, after) in found.iter().zip(&found[1..]) {
                for (before, after) in before.responses.iter().zip(&after.responses) {
                    let infinite = |response: &Response| bound(response).unwrap_or(u64::MAX);
                    prop_assert!(infinite(after) <= infinite(before));
                }
            }
        }

        #[test]
        fn the_story_of_each_method_adds_up(tasks in any_tasks()) {
            for method in [Method::Classic, Method::Psm, Method::Ibf, Method::Exact, Method::Best] {
                let options = options(method);
                for (index, response) in analyse(&tasks, method).responses.iter().enumerate() {
                    let Some(window) = &response.window else { continue };
                    let mut breakdown = Breakdown::new(&tasks, &options, &|| ());
                    let parts = breakdown.of(index, response.rule, Some(window), response.first_job);
                    let interference: u64 = parts.iter().map(|part| part.time.as_nanos()).sum();
                    prop_assert_eq!(window.own.as_nanos().max(1) + interference, window.length.as_nanos());
                    let released = (window.job - 1) * tasks[index].period.unwrap().as_nanos() + window.delay.as_nanos();
                    let end = window.length.as_nanos() + tasks[index].jitter.as_nanos();
                    prop_assert_eq!(bound(response), Some(end - released));
                }
            }
        }
    }
}
