//! The releases of one activity: as recorded, or the latest ones that agree with the recording.
//!
//! A trace of LTTng has the begins b₀, b₁, … of the periods, not their releases. The releases are r₀ + k·T, since the activity
//! catches up missed periods one by one, and no period begins before its release. So r₀ ≤ b_k − k·T for each k, and the least of
//! these is the latest possible r₀: the response times with it are lower bounds of the true ones, and one of them above R is no
//! false alarm. A segment is a sequence of periods without a missing one; each has an r₀ of its own.

use std::collections::VecDeque;

/// With more releases in a gap, gaps are not compared.
const MOST_IN_GAP: u64 = 1 << 12;

/// The periods of a segment. RTT rounds its period to nanoseconds: the drift in a segment is at most 1 ns each, see [`Segment::close`].
const LONGEST_SEGMENT: i64 = 10_000;

/// With as many missing periods, the activity was stopped, if releases are not recorded: then nothing says that it was not.
const STOPPED: u64 = 10;

/// A recorded release may differ from the period by this part of it, or by these nanoseconds: timers wake up late.
const TOLERANCE: i64 = 1000;
const LEAST_TOLERANCE: i64 = 10_000;

/// No time is later (the year 2116): the sum of two of them is still a number.
pub(super) const LATEST: i64 = i64::MAX / 2;

/// A period that was recorded. Times are in nanoseconds, and not later than [`LATEST`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RecordedJob {
    pub(super) begin: i64,
    pub(super) end: i64,
    pub(super) execution: i64,
    pub(super) release: Option<i64>,
}

/// The greatest response time, and its job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Longest<C> {
    pub(super) response: i64,
    pub(super) job: RecordedJob,
    /// What the caller has found in the time of this job.
    pub(super) cause: C,
}

/// What was found of the releases of an activity.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct FoundReleases<C> {
    pub(super) longest: Option<Longest<C>>,
    /// Periods whose response time is above the limit: at least so many, where releases are not recorded.
    pub(super) late: u64,
    /// The greatest difference of the delays from release to begin in one segment.
    pub(super) jitter: Option<i64>,
    /// Missing periods, and the time of the first.
    pub(super) skipped: u64,
    pub(super) first_skipped: Option<i64>,
    /// Times without periods, that end with the activity at work again, and the end of the first one.
    pub(super) pauses: u64,
    pub(super) first_pause: Option<i64>,
    /// Recorded releases by data before the end of a gap, the first one, and the least time from the one that began its gap.
    pub(super) in_gap: u64,
    pub(super) first_in_gap: Option<i64>,
    pub(super) least_gap: Option<i64>,
    /// Releases that are not those of the period, where they are recorded.
    irregular: u64,
    /// Segments whose periods begin too early, in which a period cannot begin before its release.
    early: u64,
    /// The sum of the times from begin to begin, or from release to release, and their number.
    time: i128,
    intervals: u64,
}

#[derive(Debug, Clone)]
struct Segment<C> {
    jobs: i64,
    first_offset: i64,
    least: i64,
    greatest: i64,
    last: RecordedJob,
    /// The job with the greatest end relative to its release.
    longest: (i64, RecordedJob, C),
}

/// See the module.
#[derive(Debug)]
pub(super) struct Releases<C> {
    period: i64,
    /// How often data releases the activity in a period at most, where no clock does. Then a job is released when it begins, unless
    /// its release is recorded, and none is missing.
    burst: Option<u64>,
    /// The last releases by data, as many as may be in a period.
    recent: VecDeque<i64>,
    /// The response time that no job exceeds, if it is known.
    limit: Option<i64>,
    segment: Option<Segment<C>>,
    /// A job that is late by a period or more, and did not wait for its predecessor: what follows says whether it was delayed, or
    /// periods are missing before it.
    pending: Option<RecordedJob>,
    found: FoundReleases<C>,
}

impl<C: Clone + Default> Releases<C> {
    pub(super) fn new(period: u64, burst: Option<u64>, limit: Option<u64>) -> Releases<C> {
        let signed = |time: u64| i64::try_from(time).unwrap_or(LATEST).min(LATEST);
        let limit = limit.map(signed);
        Releases {
            period: signed(period).max(1),
            burst,
            recent: VecDeque::new(),
            limit,
            segment: None,
            pending: None,
            found: FoundReleases::default(),
        }
    }

    /// Takes the next period. `cause` gives what happened from a release to an end.
    pub(super) fn job(&mut self, job: RecordedJob, cause: &mut dyn FnMut(i64, i64) -> C) {
        if let (Some(burst), Some(release)) = (self.burst, job.release) {
            self.compare_gap(burst, release);
        }
        let Some(pending) = self.pending.take() else { return self.next(job, cause) };
        // A delayed job is followed by the one whose release has passed meanwhile.
        if job.release.is_none() && job.begin - pending.begin < self.period / 2 {
            self.accept(pending, cause);
        } else {
            self.skip(pending, cause);
        }
        self.next(job, cause);
    }

    fn compare_gap(&mut self, burst: u64, release: i64) {
        if burst > MOST_IN_GAP {
            return;
        }
        self.recent.push_back(release);
        if self.recent.len() as u64 > burst
            && let Some(before) = self.recent.pop_front()
            && release.saturating_sub(before) < self.period
        {
            let gap = release.saturating_sub(before);
            self.found.in_gap += 1;
            self.found.first_in_gap.get_or_insert(release);
            self.found.least_gap = Some(self.found.least_gap.map_or(gap, |least| least.min(gap)));
        }
    }

    /// Ends the segment: periods may be missing for another reason.
    pub(super) fn interrupt(&mut self, cause: &mut dyn FnMut(i64, i64) -> C) {
        self.recent.clear();
        if let Some(pending) = self.pending.take() {
            self.skip(pending, cause);
        }
        self.close();
    }

    /// Returns the release of the last job, as far as it is known; none while it is open whether periods are missing before it.
    pub(super) fn last_release(&self) -> Option<i64> {
        let segment = self.segment.as_ref().filter(|_| self.pending.is_none())?;
        segment.last.release.or(Some(segment.least + self.nominal(segment.jobs - 1)))
    }

    /// Returns what was found. Ends the recording.
    pub(super) fn finish(mut self, cause: &mut dyn FnMut(i64, i64) -> C) -> FoundReleases<C> {
        self.interrupt(cause);
        self.found
    }

    fn next(&mut self, job: RecordedJob, cause: &mut dyn FnMut(i64, i64) -> C) {
        let Some(segment) = &self.segment else { return self.accept(job, cause) };
        let last = segment.last;
        if self.burst.is_some() {
            self.note_interval(job.begin - last.begin);
            self.close();
            return self.accept(job, cause);
        }
        if let (Some(release), Some(before)) = (job.release, last.release) {
            let interval = release - before;
            let tolerance = (self.period / TOLERANCE).clamp(LEAST_TOLERANCE.min(self.period / 4), i64::MAX);
            let periods = (interval + self.period / 2) / self.period;
            let rest = (interval - periods.saturating_mul(self.period)).abs();
            if periods == 1 && rest <= tolerance {
                return self.accept(job, cause);
            }
            if rest > tolerance || periods < 1 {
                self.found.irregular += 1;
                self.note_interval(interval);
                self.close();
                return self.accept(job, cause);
            }
            return self.skip(job, cause);
        }
        let release = segment.least + self.nominal(segment.jobs);
        let late = job.begin.saturating_sub(release);
        // The latency of earlier jobs may be less than the least one so far: a little less than a period is one, too.
        let is_late = late >= self.period - self.period / 16 && self.limit.is_none_or(|limit| late > limit);
        let waited = job.begin.saturating_sub(last.end.max(release));
        if is_late && waited >= self.period / 2 {
            self.pending = Some(job);
        } else {
            self.accept(job, cause);
        }
    }

    /// Adds a job before which periods are missing.
    fn skip(&mut self, job: RecordedJob, cause: &mut dyn FnMut(i64, i64) -> C) {
        if let Some(segment) = &self.segment {
            let release = segment.least + self.nominal(segment.jobs);
            let (from, to) = match job.release.zip(segment.last.release) {
                Some((to, from)) => (from + self.period, to),
                None => (release, job.begin),
            };
            let missing = ((to - from + self.period / 2) / self.period).max(1);
            let interval = job.begin - segment.last.begin;
            let is_recorded = job.release.is_some() && segment.last.release.is_some();
            if missing as u64 >= STOPPED && !is_recorded {
                self.found.pauses += 1;
                self.found.first_pause.get_or_insert(job.begin);
            } else {
                self.found.skipped += missing as u64;
                self.found.first_skipped.get_or_insert(release);
                self.note_interval(interval);
            }
        }
        self.close();
        self.accept(job, cause);
    }

    /// Returns the time of so many periods.
    fn nominal(&self, periods: i64) -> i64 {
        periods.saturating_mul(self.period).min(LATEST)
    }

    fn note_interval(&mut self, interval: i64) {
        self.found.time += i128::from(interval);
        self.found.intervals += 1;
    }

    /// Adds a job of the segment.
    fn accept(&mut self, job: RecordedJob, cause: &mut dyn FnMut(i64, i64) -> C) {
        if self.segment.as_ref().is_some_and(|segment| segment.jobs >= LONGEST_SEGMENT) {
            let last = self.segment.as_ref().map(|segment| segment.last);
            self.close();
            if let Some(last) = last {
                self.note_interval(job.begin - last.begin);
            }
        }
        if let Some(last) = self.segment.as_ref().map(|segment| segment.last) {
            let recorded = job.release.zip(last.release).map(|(release, before)| release - before);
            self.note_interval(recorded.unwrap_or(job.begin - last.begin));
        }
        let index = self.segment.as_ref().map_or(0, |segment| segment.jobs);
        let nominal = self.nominal(index);
        let least = job.release.map(|release| release - nominal);
        // A recorded release is what it is: the job counts from it, as if it were the nominal one.
        let shift = least.zip(self.segment.as_ref()).map_or(0, |(least, segment)| least - segment.least);
        let offset = (job.begin - nominal).saturating_sub(shift);
        let segment = self.segment.get_or_insert_with(|| Segment {
            jobs: 0,
            first_offset: offset,
            least: least.unwrap_or(offset),
            greatest: offset,
            last: job,
            longest: (i64::MIN, job, C::default()),
        });
        segment.jobs += 1;
        if least.is_none() {
            segment.least = segment.least.min(offset);
        }
        segment.greatest = segment.greatest.max(offset);
        segment.last = job;
        let end = (job.end - nominal).saturating_sub(shift);
        if end > segment.longest.0 {
            segment.longest = (end, job, cause(job.release.unwrap_or(segment.least + nominal), job.end));
        }
        let is_late = self.limit.is_some_and(|limit| end.saturating_sub(segment.least) > limit);
        self.found.late += u64::from(is_late);
    }

    fn close(&mut self) {
        let Some(segment) = self.segment.take() else { return };
        let is_recorded = segment.last.release.is_some();
        // The period of RTT may be 1 ns less than that of the model.
        let drift = if is_recorded { 0 } else { segment.jobs - 1 };
        let range = segment.greatest.saturating_sub(segment.least);
        let last_offset = segment.last.begin - self.nominal(segment.jobs - 1);
        let early = segment.first_offset.saturating_sub(last_offset);
        if !is_recorded && segment.jobs > 1 && early > self.period.max(self.limit.unwrap_or(0)) {
            self.found.early += 1;
            return;
        }
        self.found.jitter = self.found.jitter.max(Some(range).filter(|_| self.burst.is_none()));
        let (end, job, cause) = segment.longest;
        let response = end.saturating_sub(segment.least);
        // What may be drift is no response time.
        let is_drift = self.limit.is_some_and(|limit| response > limit && response - drift <= limit);
        let response = if is_drift { response - drift } else { response };
        if self.found.longest.as_ref().is_none_or(|longest| longest.response < response) {
            self.found.longest = Some(Longest { response, job, cause });
        }
    }
}

impl<C> FoundReleases<C> {
    /// Returns the mean time from begin to begin, if it is not the period.
    pub(super) fn other_period(&self, period: u64) -> Option<u64> {
        let missing = self.skipped.saturating_add(self.irregular);
        // A few missing periods are no period; with a short recording, half of them may be.
        let is_often = |least: u64, share: u64| self.intervals >= least && missing * share >= self.intervals;
        let is_other = self.early > 0 || is_often(20, 10) || is_often(5, 2);
        let mean = self.interval()?;
        (is_other && mean != period).then_some(mean)
    }

    /// Returns the mean time from begin to begin, without pauses.
    pub(super) fn interval(&self) -> Option<u64> {
        u64::try_from(self.time / i128::from(self.intervals.max(1))).ok().filter(|_| self.intervals > 0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn job(begin: i64, end: i64) -> RecordedJob {
        RecordedJob { begin, end, execution: end - begin, release: None }
    }

    fn found(jobs: &[RecordedJob], limit: Option<u64>) -> FoundReleases<()> {
        let mut releases = Releases::new(100, None, limit);
        jobs.iter().for_each(|job| releases.job(*job, &mut |_, _| ()));
        releases.finish(&mut |_, _| ())
    }

    fn response(found: &FoundReleases<()>) -> Option<i64> {
        found.longest.as_ref().map(|it| it.response)
    }

    #[test]
    fn a_delayed_job_is_caught_up_and_not_missing() {
        let jobs = [job(5, 20), job(105, 120), job(315, 330), job(330, 350), job(405, 420)];
        // At 315, two releases have passed: that of 205 and that of 305.
        let found = found(&jobs, Some(60));
        assert_eq!((found.skipped, found.late), (0, 1));
        assert_eq!(response(&found), Some(125));
        assert_eq!(found.longest.as_ref().map(|it| it.job.begin), Some(315));
    }

    #[test]
    fn a_missing_period_is_no_late_one() {
        let jobs = [job(5, 20), job(105, 120), job(305, 320), job(405, 420), job(505, 521)];
        let found = found(&jobs, Some(60));
        assert_eq!((found.skipped, found.first_skipped, found.late), (1, Some(205), 0));
        assert_eq!((response(&found), found.other_period(100)), (Some(16), None));
    }

    #[test]
    fn a_pause_is_not_counted_as_periods() {
        let jobs = [job(5, 20), job(105, 120), job(5000, 5020), job(5100, 5120)];
        let found = found(&jobs, Some(60));
        assert_eq!((found.skipped, found.pauses, found.first_pause), (0, 1, Some(5000)));
    }

    #[test]
    fn other_periods_are_found() {
        for (period, expected) in [(50, 50), (200, 200), (99, 99), (300, 300)] {
            let jobs: Vec<RecordedJob> = (0..400).map(|k| job(k * period, k * period + 10)).collect();
            let found = found(&jobs, Some(60));
            assert_eq!(found.other_period(100), Some(expected), "{period}");
        }
        let jobs: Vec<RecordedJob> = (0..400).map(|k| job(k * 100 + k % 7, k * 100 + 20)).collect();
        assert_eq!(found(&jobs, Some(60)).other_period(100), None);
    }

    fn released(release: i64, begin: i64, end: i64) -> RecordedJob {
        RecordedJob { release: Some(release), ..job(begin, end) }
    }

    #[test]
    fn recorded_releases_may_be_a_little_late() {
        let mut releases = Releases::new(100_000_000, None, Some(60_000_000));
        for k in 0..200_i64 {
            let release = k * 100_000_000 + k % 2;
            releases.job(released(release, release + 5, release + 20 + k), &mut |_, _| ());
        }
        let found = releases.finish(&mut |_, _| ());
        assert_eq!((found.other_period(100_000_000), found.skipped, response(&found)), (None, 0, Some(219)));
    }

    /// Data releases the jobs: none is missing, and none is early.
    #[test]
    fn jobs_without_a_clock_are_released_when_they_begin() {
        let mut releases = Releases::new(100, Some(1), Some(60));
        let jobs = [job(5, 20), job(105, 170), released(900, 950, 990), job(3000, 3010)];
        jobs.into_iter().for_each(|job| releases.job(job, &mut |_, _| ()));
        let found = releases.finish(&mut |_, _| ());
        assert_eq!((found.skipped, found.pauses, found.late, found.jitter), (0, 0, 2, None));
        assert_eq!((response(&found), found.other_period(100)), (Some(90), None));
    }

    /// At most so many in each 100: a job may begin late, and its release counts.
    #[test]
    fn releases_by_data_keep_their_gap() {
        let jobs =
            [released(0, 5, 30), released(40, 41, 50), released(99, 105, 120), released(140, 150, 160)];
        let found = |burst| {
            let mut releases = Releases::new(100, Some(burst), None);
            jobs.iter().for_each(|job| releases.job(*job, &mut |_, _| ()));
            let found = releases.finish(&mut |_, _| ());
            (found.in_gap, found.first_in_gap, found.least_gap)
        };
        assert_eq!(found(1), (3, Some(40), Some(40)));
        assert_eq!(found(2), (1, Some(99), Some(99)));
        assert_eq!(found(3), (0, None, None));
        assert_eq!(found(u64::MAX), (0, None, None));
    }

    /// Where releases are recorded, nothing else explains that periods are missing.
    #[test]
    fn many_missing_periods_are_missing() {
        let mut releases = Releases::new(100, None, Some(60));
        for k in (0..30).chain(60..90) {
            releases.job(released(k * 100, k * 100 + 5, k * 100 + 20), &mut |_, _| ());
        }
        let found = releases.finish(&mut |_, _| ());
        assert_eq!((found.skipped, found.first_skipped, found.pauses), (30, Some(3000), 0));
    }

    proptest! {
        /// Jobs that catch up: none responds later than in truth, none is missing, and none is late.
        #[test]
        fn observed_responses_are_lower_bounds(
            delays in proptest::collection::vec((0_i64..60, 1_i64..120), 1..60), offset in 0_i64..1000,
        ) {
            let (mut free, mut longest, mut jobs) = (0, 0, Vec::new());
            for (index, (delay, execution)) in delays.iter().enumerate() {
                let release = offset + index as i64 * 100;
                let begin = free.max(release) + delay;
                free = begin + execution;
                longest = longest.max(free - release);
                jobs.push(job(begin, free));
            }
            let found = found(&jobs, Some(longest as u64));
            prop_assert!(response(&found) <= Some(longest));
            prop_assert_eq!((found.skipped, found.pauses, found.late), (0, 0, 0));
            prop_assert_eq!(found.other_period(100), None);
        }
    }
}
