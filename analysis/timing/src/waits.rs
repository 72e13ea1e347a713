//! Waits as jitter: another bound for tasks that are delayed by jobs that wait.
//!
//! Elsewhere, a wait counts as execution (*suspension-oblivious*). That is sound: at every instant of a busy window some job
//! executes or waits, and both count. Here, the waits of a task of hp(i) do not count, but the jobs of it may execute late: a job
//! with a response time of at most Rⱼ executes in the Rⱼ after its nominal release, so that at most ⌈(t + Rⱼ)/Tⱼ⌉ jobs execute in a
//! window of length t, for M'ⱼ of this number, with M' the demand without waits. The window begins when neither i nor those of hp(i)
//! that do not wait have unfinished work. From then on at every instant one of these is ready, so that the CPU executes hp(i) or i,
//! or i waits, which counts as execution of i (J.-J. Chen et al., "Many suspensions, many problems", Real-Time Systems 55, 2019:
//! suspension as jitter; Rⱼ − Cⱼ, which they use as jitter, is sound only if all jobs execute for Cⱼ).
//!
//! Neither of the two bounds is better than the other. The lesser counts, for each task.

use crate::lane::{JobCounts, Lane};
use crate::lane_analysis::{HigherLoad, LaneResponse, MOST_EXACT, compare};
use crate::{Bound, CpuRule, Method, Time, Utilisation};

/// The maximum number of passes. Another one makes bounds less only where tasks of equal priority wait.
const MOST_PASSES: u32 = 4;

impl Lane<'_, '_> {
    /// Replaces what was `found` by what is found with waits as jitter, where that is less. Not if tasks may run on several CPUs.
    pub(crate) fn count_waits_as_jitter(&mut self, found: &mut [LaneResponse]) {
        let places = 0..self.members.len();
        let is_one_cpu = matches!(self.rule, CpuRule::Cpu(_))
            && places.clone().all(|place| self.members.get(place).task.cpus().is_one());
        let has_waits = places.clone().any(|place| self.members.get(place).task.waits.is_some());
        if !is_one_cpu || !has_waits {
            return;
        }
        for _ in 0..MOST_PASSES {
            found.iter().for_each(|found| self.make_late(found));
            if !self.find_lesser(found) {
                break;
            }
        }
        places.for_each(|place| self.members.at(place).late = None);
    }

    /// Lets the waits of this task count as jitter, if its response time is known.
    fn make_late(&mut self, found: &LaneResponse) {
        let member = self.members.at(found.place);
        // While one task of a thread waits, the next one has unfinished work, and does not execute.
        let waits_alone = member.task.waits.is_some() && member.task.thread.is_none();
        if let (Bound::Response(time), true) = (&found.response.bound, waits_alone) {
            member.late = Some(time.as_nanos());
        }
    }

    /// Returns whether anything less was found.
    fn find_lesser(&mut self, found: &mut [LaneResponse]) -> bool {
        let mut of_place: Vec<Option<&mut LaneResponse>> = (0..self.members.len()).map(|_| None).collect();
        for found in found {
            let place = found.place;
            of_place[place] = Some(found);
        }
        let method = self.options.method.min(Method::Psm);
        let wanted: Vec<bool> = of_place.iter().map(Option::is_some).collect();
        let (mut is_less, mut exact_left) = (false, MOST_EXACT);
        self.walk(&self.by_priority(&wanted), &wanted, method, &mut |lane, place, counts: &mut JobCounts| {
            let known = of_place[place].as_mut()?;
            let is_of_thread = lane.members.get(place).task.thread.is_some();
            if is_of_thread || lane.late_members(place).is_empty() {
                return None;
            }
            let load = lane.load_of(place, &mut exact_left);
            let lesser = lane.by_jobs(place, counts, method, load);
            let time = bound(&lesser)?;
            if bound(known).is_none_or(|known| time < known) {
                let (is_exhausted, first_job) = (known.response.is_exhausted, known.response.first_job);
                known.response = lesser.response;
                known.response.is_exhausted = is_exhausted;
                known.response.first_job = known.response.first_job.into_iter().chain(first_job).min();
                lane.make_late(known);
                is_less = true;
            }
            None
        });
        is_less
    }

    /// Compares the utilisation by hp(i) of the member at `place`, with and without it, with 1.
    fn load_of(&self, place: usize, exact_left: &mut u32) -> HigherLoad {
        let others = self.interfering(place).into_iter();
        let mut utilisation = Utilisation::sum(others.map(|it| self.members.get(it).interfering_share()));
        let others = compare(&utilisation, None, exact_left);
        utilisation.push(self.members.get(place).share);
        HigherLoad { others, all: compare(&utilisation, None, exact_left), several_cpus: false }
    }
}

fn bound(found: &LaneResponse) -> Option<Time> {
    if let Bound::Response(time) = found.response.bound { Some(time) } else { None }
}
