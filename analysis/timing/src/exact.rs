//! The greatest response over all combinations of paths of the interfering machines (combinatorial abstraction refinement:
//! M. Stigge and W. Yi, "Combinatorial Abstraction Refinement for Feasibility Analysis of Static Priorities", Real-Time Systems
//! 51, 2015).
//!
//! M(n) takes the greatest total of n edges for each n, from another path each time. A machine executes one path. With one path
//! for each machine of hp(i), f(q) = least t with t = Mᵢ(q) + Σ rⱼ(t), where the request function rⱼ(t) is the total of the
//! first ⌈(t + Jⱼ)/Tⱼ⌉ edges of the path. On one CPU, the greatest response over all combinations is attained: the paths of
//! different machines are independent, and every task may release its first job at the start of the window.
//!
//! There are too many combinations, so they are grouped. The request functions of a machine that no other exceeds everywhere
//! are the leaves of a tree, in which a node is the pointwise maximum of its children; the root is M. A combination of nodes
//! bounds all combinations of leaves below. The search refines the combination with the greatest bound, until that consists of
//! leaves, or is not above the response of some combination of leaves. When the budget is exhausted, the greatest bound so
//! far holds.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::rc::Rc;

use crate::lane::{BusyJob, BusyWindow, JobCounts, Lane};
use crate::paths::Requests;
use crate::{Method, NoBoundReason};

/// The result of the search for one task.
pub(crate) struct Exact {
    pub(crate) busy: BusyWindow,
    /// Whether no combination remains that may respond later; otherwise the budget is exhausted.
    pub(crate) is_complete: bool,
    /// What the members of hp(i) contribute: the place, the number of jobs, and their time.
    pub(crate) contributions: Vec<(usize, u64, u64)>,
    /// The totals of the first 1, 2, … edges of the combined paths, by place. The other members have M(1), M(2), ….
    pub(crate) totals: Vec<(usize, Vec<u64>)>,
}

/// Searches the busy window of the member at `place`; `bound` is one that is known, and that ends.
///
/// `budget` counts visited members and values of request functions. The error is that of a demand which cannot be computed, or
/// `Budget` if nothing better than `bound` was found.
pub(crate) fn busy_window(
    lane: &mut Lane<'_, '_>,
    place: usize,
    bound: BusyWindow,
    budget: u64,
) -> Result<Exact, NoBoundReason> {
    let base = JobCounts::new(lane.members.len());
    let mut search = PathSearch { place, bound, lane, method: Method::Psm, base, varied: Vec::new(), budget };
    let mut fixed = Vec::new();
    let mut is_bounded_only = false;
    let members = search.lane.members.len() as u64;
    search.budget = search.budget.checked_sub(members).ok_or(NoBoundReason::Budget)?;
    for other in search.lane.interfering(place) {
        let member = search.lane.members.at(other);
        let jobs = member.jobs_released(bound.last.length)?;
        let has_one_function = member.machine.greatest_repeats() || jobs <= 1;
        let requests = if has_one_function { None } else { member.requests(jobs) };
        is_bounded_only |= !has_one_function && requests.is_none();
        match requests {
            Some(requests) if requests.nodes.len() > 1 => {
                let values = requests.nodes.len() as u64 * jobs;
                search.budget = search.budget.checked_sub(values).ok_or(NoBoundReason::Budget)?;
                search.varied.push((other, requests));
            }
            // One function is the maximum: it is M.
            Some(_) | None => fixed.push(other),
        }
    }
    if search.varied.is_empty() {
        let found = Exact { busy: bound, is_complete: true, contributions: Vec::new(), totals: Vec::new() };
        return if is_bounded_only { Err(NoBoundReason::Budget) } else { Ok(found) };
    }
    if is_bounded_only {
        search.method = Method::Ibf;
    }
    // The order of the tasks must not matter where the budget ends: those with equal keys are interchangeable.
    let members = &search.lane.members;
    search.varied.sort_by(|(one, of_one), (other, of_other)| {
        let key = |place: usize| {
            let member = members.get(place);
            let jobs = member.jobs_released(bound.last.length).ok();
            (Reverse(member.task.priority), member.period, member.jitter, member.task.cpus(), jobs)
        };
        let totals =
            |requests: &Requests| requests.nodes.iter().map(|node| node.totals.clone()).collect::<Vec<_>>();
        key(*one).cmp(&key(*other)).then_with(|| totals(of_one).cmp(&totals(of_other)))
    });
    for other in fixed {
        search.base.include(other, &mut search.lane.members, search.method);
    }
    let mut found = search.run()?;
    found.is_complete &= !is_bounded_only;
    Ok(found)
}

struct PathSearch<'s, 'l, 'a> {
    lane: &'s mut Lane<'l, 'a>,
    place: usize,
    /// The known bound: no f(q) is later than that of its last job.
    bound: BusyWindow,
    /// How the members that are not varied are bounded.
    method: Method,
    /// The counts of these members in the least window.
    base: JobCounts,
    /// The members whose paths are combined, with their request functions.
    varied: Vec<(usize, Rc<Requests>)>,
    budget: u64,
}

/// A node for each of the varied members, and the busy window with them.
#[derive(Clone)]
struct Combination {
    response: u64,
    nodes: Vec<usize>,
    worst: BusyJob,
    last: BusyJob,
    first_job: u64,
    /// Whether the iteration ended at the known bound, before its own fixed point.
    is_capped: bool,
}

impl PathSearch<'_, '_, '_> {
    fn run(&mut self) -> Result<Exact, NoBoundReason> {
        let roots = vec![0; self.varied.len()];
        let root = self.evaluate(roots)?;
        // The greatest first; among equals, the first found, so that the same model gives the same figures.
        let mut open = BinaryHeap::from([(root.response, Reverse(0usize))]);
        let mut all = vec![root];
        let mut greatest_leaf: Option<Combination> = None;
        let is_above = |response: u64, leaf: &Option<Combination>| {
            leaf.as_ref().is_none_or(|leaf| response > leaf.response)
        };
        while let Some((response, Reverse(index))) = open.pop() {
            if !is_above(response, &greatest_leaf) {
                break;
            }
            let top = all[index].clone();
            let Some(split) = self.split(&top) else {
                greatest_leaf = Some(top);
                break;
            };
            let below = self.leaf_below(&top);
            let mut refined = vec![below];
            let (varied, children) = split;
            refined.extend(children.into_iter().map(|child| {
                let mut nodes = top.nodes.clone();
                nodes[varied] = child;
                nodes
            }));
            for (number, nodes) in refined.into_iter().enumerate() {
                match self.evaluate(nodes) {
                    Ok(found) if number == 0 => {
                        if is_above(found.response, &greatest_leaf) {
                            greatest_leaf = Some(found);
                        }
                    }
                    Ok(found) => {
                        if is_above(found.response, &greatest_leaf) {
                            open.push((found.response, Reverse(all.len())));
                            all.push(found);
                        }
                    }
                    // The combination on top bounds all that is open.
                    Err(NoBoundReason::Budget) => return self.conclude(&top, false),
                    Err(reason) => return Err(reason),
                }
            }
        }
        match greatest_leaf {
            Some(leaf) => self.conclude(&leaf, true),
            None => Err(NoBoundReason::Budget),
        }
    }

    /// Chooses the member with the most leaves, and returns the children of its node.
    fn split(&self, of: &Combination) -> Option<(usize, [usize; 2])> {
        let node = |varied: usize| Some(&self.varied.get(varied)?.1.nodes[of.nodes[varied]]);
        let with_children = (0..of.nodes.len()).filter_map(|varied| Some((varied, node(varied)?.children?)));
        with_children.max_by_key(|&(varied, _)| (node(varied).map(|it| it.leaves), Reverse(varied)))
    }

    /// Returns the leaf with the greatest demand in the window, for each node.
    fn leaf_below(&self, of: &Combination) -> Vec<usize> {
        let leaf = |(&(place, ref requests), &node): (&(usize, Rc<Requests>), &usize)| {
            let jobs = self.lane.members.get(place).jobs_released(of.worst.length).unwrap_or(u64::MAX);
            let mut node = node;
            while let Some([left, right]) = requests.nodes[node].children {
                node = if requests.demand(left, jobs) >= requests.demand(right, jobs) { left } else { right };
            }
            node
        };
        self.varied.iter().zip(&of.nodes).map(leaf).collect()
    }

    fn conclude(&mut self, found: &Combination, is_complete: bool) -> Result<Exact, NoBoundReason> {
        if found.is_capped && !is_complete {
            // The demand in the window is greater than it: there is nothing that explains it.
            return Err(NoBoundReason::Budget);
        }
        let busy = BusyWindow {
            // That of a later job may have another combination.
            first_job: if found.worst.job == 1 { found.first_job } else { self.bound.first_job },
            worst: found.worst,
            last: found.last,
            ends: true,
        };
        let (mut contributions, mut totals) = (Vec::new(), Vec::new());
        if self.lane.lists_interference {
            let length = found.worst.length;
            let mut counts = self.base.clone();
            counts.raise(length, &mut self.lane.members, self.method)?;
            contributions = counts.contributions().collect();
            for ((place, requests), &node) in self.varied.iter().zip(&found.nodes) {
                let jobs = self.lane.members.get(*place).jobs_released(length)?;
                contributions.push((*place, jobs, requests.demand(node, jobs)));
                totals.push((*place, requests.nodes[node].totals.clone()));
            }
        }
        Ok(Exact { busy, is_complete, contributions, totals })
    }

    fn evaluate(&mut self, nodes: Vec<usize>) -> Result<Combination, NoBoundReason> {
        let member = self.lane.members.get(self.place);
        let (jitter, has_mates) = (member.jitter, !member.thread.is_empty());
        let longest = self.bound.last.length;
        let mut counts = self.base.clone();
        let none = BusyJob { job: 1, length: 0 };
        let mut found =
            Combination { response: 0, nodes, worst: none, last: none, first_job: 0, is_capped: false };
        for job in 1..=self.bound.last.job {
            // Nominal, counted from J before the window.
            let member = self.lane.members.get(self.place);
            let (release, next_release) = (member.release(job)?, member.release(job + 1)?);
            let own = self.lane.demand(self.place, job, false)?;
            let mut window = found.last.length.max(own);
            let length = loop {
                (self.lane.interrupt)();
                let visited = counts.present() + self.varied.len() as u64 + 1;
                self.budget = self.budget.checked_sub(visited).ok_or(NoBoundReason::Budget)?;
                let rises_until = counts.raise(window, &mut self.lane.members, self.method)?;
                let blocking = self.lane.blocking(self.place, job, window)?;
                let mut demand = u128::from(own) + counts.total() + u128::from(blocking);
                for ((place, requests), &node) in self.varied.iter().zip(&found.nodes) {
                    let jobs = self.lane.members.get(*place).jobs_released(window)?;
                    demand += u128::from(requests.demand(node, jobs));
                }
                let demand = u64::try_from(demand).map_err(|_| NoBoundReason::Overflow)?;
                if demand <= window {
                    break window;
                }
                window = demand.max(rises_until);
                if window >= longest {
                    // No combination of paths is later, only the maximum of some.
                    found.is_capped = true;
                    break longest;
                }
            };
            let response = length.saturating_add(jitter).saturating_sub(release);
            if job == 1 {
                found.first_job = length;
            }
            found.last = BusyJob { job, length };
            if response > found.response {
                (found.response, found.worst) = (response, found.last);
            }
            // A thread may go on after the end of this job. In a window that has ended, no later job of the bound is worse.
            let ends = !has_mates && length.saturating_add(jitter) <= next_release;
            if ends || length >= longest {
                break;
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{machine, simple, task};
    use crate::{Bound, Options, Response, Task, response_times};

    fn analyse(tasks: &[Task], method: Method) -> Response {
        let options = Options { method, is_brief: false };
        response_times(tasks, &options, &|| ()).responses.swap_remove(0)
    }

    /// The bounds by jobs, by execution and by paths.
    fn bounds(tasks: &[Task]) -> [u64; 3] {
        [Method::Psm, Method::Ibf, Method::Exact].map(|method| match analyse(tasks, method).bound {
            Bound::Response(time) => time.as_nanos(),
            bound => panic!("{bound:?}"),
        })
    }

    /// By paths: the first job, the job of the window, the method, and whether the budget was exhausted.
    fn story(tasks: &[Task]) -> (u64, u64, Method, bool) {
        let found = analyse(tasks, Method::Exact);
        let first_job = found.first_job.unwrap().as_nanos();
        (first_job, found.window.unwrap().job, found.method, found.is_exhausted)
    }

    #[test]
    fn equal_priorities_interfere_and_lower_ones_do_not() {
        let varied = || machine(3, &[(0, 1, 2), (1, 1, 1), (1, 2, 1), (2, 0, 4), (2, 2, 2)]);
        for priority in [1, 2] {
            let tasks = [simple(1, 5, 1), task(priority, 3, varied()), task(0, 3, varied())];
            assert_eq!(bounds(&tasks), [10, 9, 8]);
            assert_eq!(story(&tasks), (8, 1, Method::Exact, false));
        }
    }

    #[test]
    fn simple_tasks_have_one_path() {
        let tasks = [simple(1, 20, 3), simple(2, 5, 1), simple(2, 10, 2)];
        assert_eq!(bounds(&tasks), [7; 3]);
        assert_eq!(story(&tasks), (7, 1, Method::Exact, false));
    }

    #[test]
    fn a_later_job_of_the_window_is_the_worst() {
        let late = machine(4, &[(0, 3, 0), (1, 1, 0), (2, 0, 1), (3, 3, 1), (2, 1, 3), (3, 2, 3), (0, 3, 2)]);
        let tasks = [simple(1, 3, 2), task(1, 8, late)];
        assert_eq!(bounds(&tasks), [6; 3]);
        assert_eq!(story(&tasks), (5, 3, Method::Exact, false));
    }

    #[test]
    fn the_first_of_equally_late_jobs_is_the_worst() {
        let varied = machine(3, &[(0, 0, 1), (1, 0, 3), (2, 1, 0), (2, 1, 2), (1, 1, 2)]);
        let alternating = machine(2, &[(0, 1, 4), (1, 0, 4), (0, 1, 2)]);
        let tasks = [simple(0, 7, 2), task(2, 6, varied), task(1, 13, alternating)];
        assert_eq!(bounds(&tasks)[2], 11);
        assert_eq!(story(&tasks), (11, 1, Method::Exact, false));
    }

    #[test]
    fn an_end_of_the_first_job_that_is_earlier_by_paths() {
        let hp = machine(4, &[(0, 1, 5), (1, 2, 4), (2, 0, 0), (3, 3, 0), (0, 2, 2), (3, 0, 5), (3, 3, 3)]);
        let tasks = [simple(0, 14, 1), task(1, 4, hp)];
        assert_eq!(bounds(&tasks)[2], 15);
        assert_eq!(story(&tasks), (15, 1, Method::Exact, false));
    }

    #[test]
    fn a_maximum_of_some_paths_is_no_result() {
        let hp = machine(3, &[(0, 1, 2), (1, 2, 1), (2, 1, 0), (1, 0, 0)]);
        let tasks = [simple(0, 24, 4), task(0, 4, hp), simple(1, 2, 1)];
        assert_eq!(bounds(&tasks), [20, 20, 18]);
        let one = machine(4, &[(0, 3, 3), (1, 0, 0), (2, 3, 3), (3, 3, 4), (0, 1, 1), (2, 0, 1)]);
        let other = machine(3, &[(0, 1, 0), (1, 1, 1), (2, 0, 0), (0, 0, 1), (0, 2, 2)]);
        let tasks = [simple(1, 14, 0), task(1, 5, one), task(1, 6, other)];
        assert_eq!(bounds(&tasks)[2], 35);
    }

    #[test]
    fn a_task_of_too_many_paths_is_bounded_and_not_varied() {
        let varied = machine(3, &[(0, 1, 2), (1, 1, 1), (1, 2, 1), (2, 0, 4), (2, 2, 2)]);
        let ring: Vec<_> = (0..129).map(|state| (state, (state + 1) % 129, u64::from(state == 0))).collect();
        let bounded = || task(2, 4, machine(129, &ring));
        let tasks = [simple(1, 50, 4), bounded()];
        assert_eq!((bounds(&tasks), story(&tasks)), ([5; 3], (5, 1, Method::Ibf, true)));
        let tasks = [simple(1, 50, 1), task(2, 3, varied.clone()), bounded()];
        assert_eq!(bounds(&tasks), [15, 12, 11]);
        assert_eq!(story(&tasks), (11, 1, Method::Exact, true));
        // The same demand of few paths.
        let once = machine(2, &[(0, 1, 1), (1, 1, 0)]);
        let tasks = [simple(1, 50, 1), task(2, 3, varied), task(2, 4, once)];
        assert_eq!(bounds(&tasks), [15, 12, 11]);
        assert_eq!(story(&tasks), (11, 1, Method::Exact, false));
    }
}
