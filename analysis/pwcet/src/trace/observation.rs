//! What a recording showed of each codel, program, port and lock: how often, the greatest time, and the greatest wait.
//!
//! An execution was off the CPU for the difference of its elapsed and its CPU time. A part of that is explained: the thread waited for
//! a lock that the recording has, or periods of instances with a higher priority executed on its CPU. If the thread never gave up the
//! CPU by its own will, the rest was preemption by something else, and the codel did not wait. Otherwise the rest counts as a wait. It
//! may be too long, by what the recording does not have. The part of a wait in which a higher priority executes on the same CPU is not
//! in it: that is interference, which a bound counts for itself.

use std::collections::BTreeMap;

use super::{NameId, Span, SpanKind, SpanName, SpanNames};

/// The periods that are remembered, to say who preempted others.
const REMEMBERED: usize = 1 << 10;

/// The executions of one instance that are remembered until its period ends.
const MOST_OPEN: usize = 1 << 14;

/// Where the recording does not say whether a thread waited, less is not suspicious: interrupts take that long.
const UNSUSPICIOUS: u64 = 50_000;

/// What a recording showed of one codel, program, port or lock in one instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeenName {
    /// What it is.
    pub name: SpanName,
    /// How many executions were recorded.
    pub executions: u64,
    /// The greatest CPU time of one.
    pub greatest: u64,
    /// How the executions of a codel waited.
    pub wait: Wait,
    /// Of the jobs of an instance: the response times that at most 1/2, 1/10, 1/100, … of them exceed, as far as there are so many
    /// jobs. They are up to 2 % too long.
    pub later: Vec<u64>,
}

/// How the executions of a codel waited.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Wait {
    /// The executions that waited, or may have.
    pub executions: u64,
    /// The greatest time that one of them was off the CPU, as far as nothing explains it.
    pub greatest: u64,
    /// How often one of them waited, at most; 0 where the recording does not say that. Locks that it has are not in it.
    pub times: u64,
    /// The recording does not say whether executions waited: something that it does not have may have preempted them.
    pub is_unknown: bool,
}

impl Wait {
    /// Adds how other executions waited.
    pub fn add(&mut self, other: &Wait) {
        self.executions += other.executions;
        self.greatest = self.greatest.max(other.greatest);
        self.times = self.times.max(other.times);
        self.is_unknown |= other.is_unknown;
    }
}

/// Takes the spans of a recording, in their order. Its memory does not grow with the length of the recording.
///
/// ```
/// use std::ops::ControlFlow;
/// use mauve_pwcet::trace::{SpanNames, Observation, Span, TraceReader, Visitor};
///
/// struct Waits(Observation);
///
/// impl Visitor for Waits {
///     fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
///         self.0.add(span, names);
///         ControlFlow::Continue(())
///     }
/// }
///
/// let text = "codel,execution_ns,elapsed_ns,time_ns,waits\nrobot.grab,60000,8060000,9000000,1\nrobot.look,100,90100,9000000,0\n";
/// let (mut reader, mut waits) = (TraceReader::default(), Waits(Observation::default()));
/// reader.read_csv(text.as_bytes(), None, &mut waits).unwrap();
/// let [grab, look] = &waits.0.finish(reader.names())[..] else { panic!() };
/// assert_eq!((grab.greatest, grab.wait.greatest, look.wait.greatest), (60_000, 8_000_000, 0));
/// ```
#[derive(Debug, Default)]
pub struct Observation {
    seen: BTreeMap<NameId, (u64, u64, Wait)>,
    /// The executions of codels, by instance, whose periods have not ended: how they were scheduled is not known.
    open: BTreeMap<String, Vec<OpenExecution>>,
    recent: Vec<RecordedPeriod>,
    next_recent: usize,
    /// How many jobs of an instance responded within times that are up to 2 % too long, if releases are recorded: at most 4096
    /// numbers.
    within: BTreeMap<NameId, BTreeMap<u64, u64>>,
    /// The CPU time per second of other threads.
    work: BTreeMap<String, u64>,
    /// How the program was built, if the recording says it.
    pub build: Option<String>,
}

/// An execution of a codel that was off the CPU.
#[derive(Debug, Clone, Copy)]
struct OpenExecution {
    name: NameId,
    begin: Option<u64>,
    end: Option<u64>,
    off_cpu: u64,
    blocked: u64,
    waits: Option<u64>,
}

#[derive(Debug, Clone, Copy)]
struct RecordedPeriod {
    begin: u64,
    end: u64,
    execution: u64,
    lane: Option<OnlyCpu>,
}

/// The CPU of a thread that may use no other one, and its priority there.
#[derive(Debug, Clone, Copy)]
struct OnlyCpu {
    cpu: u32,
    priority: u32,
}

impl Observation {
    /// Takes a span.
    pub fn add(&mut self, span: &Span, names: &SpanNames) {
        let name = names.get(span.name);
        if name.kind == SpanKind::Period {
            self.period(span, &name.instance);
            return;
        }
        let (executions, greatest, wait) = self.seen.entry(span.name).or_default();
        *executions += 1;
        *greatest = (*greatest).max(span.execution);
        wait.is_unknown |= name.kind == SpanKind::Codel && span.waits.is_none();
        if name.kind != SpanKind::Codel || span.waits == Some(0) {
            return;
        }
        let off_cpu = span.elapsed.map_or(0, |elapsed| elapsed.saturating_sub(span.execution));
        let Span { name: id, begin, end, blocked, waits, .. } = *span;
        let open = OpenExecution { name: id, begin, end, off_cpu, blocked, waits };
        // Most executions are of a known instance, and need no text of their own.
        match self.open.get_mut(&name.instance) {
            Some(all) => {
                all.push(open);
                if all.len() >= MOST_OPEN {
                    self.close(&name.instance, None);
                }
            }
            None => _ = self.open.insert(name.instance.clone(), vec![open]),
        }
    }

    /// Takes the work of threads that are not those of instances.
    pub fn add_work(&mut self, thread: &str, cpu: u64, elapsed: u64) {
        let per_second = u128::from(cpu) * 1_000_000_000 / u128::from(elapsed.max(1));
        let greatest = self.work.entry(thread.to_owned()).or_default();
        *greatest = (*greatest).max(u64::try_from(per_second).unwrap_or(u64::MAX));
    }

    /// Returns the CPU time in nanoseconds that threads which are not those of instances used in a second, by name.
    pub fn work(&self) -> &BTreeMap<String, u64> {
        &self.work
    }

    /// Ends a recording. The times of the next one are by a clock of its own.
    pub fn end_recording(&mut self) {
        let instances: Vec<String> = self.open.keys().cloned().collect();
        instances.iter().for_each(|instance| self.close(instance, None));
        self.recent.clear();
        self.next_recent = 0;
    }

    /// Returns what was observed, in the order of the names of the recording.
    pub fn finish(mut self, names: &SpanNames) -> Vec<SeenName> {
        self.end_recording();
        let seen = |(id, (executions, greatest, wait))| {
            let name: &SpanName = names.get(id);
            let later = self.within.get(&id).map(|within| later(within, executions)).unwrap_or_default();
            SeenName { name: name.clone(), executions, greatest, wait, later }
        };
        std::mem::take(&mut self.seen).into_iter().map(seen).collect()
    }

    fn period(&mut self, span: &Span, instance: &str) {
        let lane = span.scheduling.zip(span.cpu).and_then(|(it, cpu)| {
            let is_only = it.cpus.count_ones() == 1 && it.cpus.trailing_zeros() == cpu;
            is_only.then_some(OnlyCpu { cpu, priority: it.priority })
        });
        self.close(instance, lane);
        if let Some((release, end)) = span.release.zip(span.end) {
            let response = end.saturating_sub(release);
            let (jobs, greatest, _) = self.seen.entry(span.name).or_default();
            (*jobs, *greatest) = (*jobs + 1, response.max(*greatest));
            // Seven binary digits are kept.
            let rest = response.checked_ilog2().unwrap_or(0).saturating_sub(6);
            let within = self.within.entry(span.name).or_default();
            *within.entry(response | ((1 << rest) - 1)).or_default() += 1;
        }
        let Some((begin, end)) = span.begin.zip(span.end) else { return };
        let period = RecordedPeriod { begin, end, execution: span.execution, lane };
        match self.recent.get_mut(self.next_recent) {
            Some(place) => *place = period,
            None => self.recent.push(period),
        }
        self.next_recent = (self.next_recent + 1) % REMEMBERED;
    }

    /// Decides what the open executions of an instance were, whose thread was scheduled like this.
    fn close(&mut self, instance: &str, lane: Option<OnlyCpu>) {
        let Some(open) = self.open.get_mut(instance) else { return };
        for it in std::mem::take(open) {
            // Both may be the same time: the thread was preempted while it waited for the lock.
            let explained = it.blocked.max(self.preemption(&it, lane));
            let rest = it.off_cpu.saturating_sub(explained);
            if it.waits.is_none() && rest <= UNSUSPICIOUS {
                continue;
            }
            if let Some((.., wait)) = self.seen.get_mut(&it.name) {
                // What is explained completely was no wait of its own.
                let times = if rest > 0 { it.waits.unwrap_or(0) } else { 0 };
                wait.add(&Wait { executions: 1, greatest: rest, times, is_unknown: false });
            }
        }
    }

    /// Returns for how long periods of a higher priority executed on this CPU during an execution, at least.
    fn preemption(&self, it: &OpenExecution, lane: Option<OnlyCpu>) -> u64 {
        let (Some(lane), Some(begin), Some(end)) = (lane, it.begin, it.end) else { return 0 };
        let of = |period: &RecordedPeriod| {
            let is_other = period.lane.is_some_and(|of| of.cpu == lane.cpu && of.priority > lane.priority);
            if !is_other || period.end <= begin || period.begin >= end {
                return 0;
            }
            // What it executed outside of this time is not known: as much as fits.
            let overlap = period.end.min(end) - period.begin.max(begin);
            let outside = (period.end - period.begin).saturating_sub(overlap);
            period.execution.min(period.end - period.begin).saturating_sub(outside)
        };
        self.recent.iter().map(of).fold(0, u64::saturating_add)
    }
}

/// Returns [`SeenName::later`] of so many jobs.
fn later(within: &BTreeMap<u64, u64>, jobs: u64) -> Vec<u64> {
    let shares = [2, 10, 100, 1000, 10_000, 100_000, 1_000_000, 10_000_000];
    let of_share = |share: u64| {
        let mut later = jobs;
        let time = within.iter().find(|(_, count)| {
            later -= **count;
            later <= jobs / share
        });
        time.map(|(time, _)| *time)
    };
    shares.into_iter().filter(|share| *share <= jobs).filter_map(of_share).collect()
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::{TraceReader, Visitor};
    use super::*;

    #[derive(Default)]
    struct Observe(Observation);

    impl Visitor for Observe {
        fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
            self.0.add(span, names);
            ControlFlow::Continue(())
        }

        fn work(&mut self, thread: &str, cpu: u64, elapsed: u64) {
            self.0.add_work(thread, cpu, elapsed);
        }
    }

    /// The waits of each codel: key, executions, greatest, unknown.
    fn observe(executions: &str, periods: &str) -> (Vec<(String, u64, u64, bool)>, Observation) {
        let (mut reader, mut found) = (TraceReader::default(), Observe::default());
        let (executions, periods) = (executions.as_bytes(), periods.as_bytes());
        reader.read_both(executions, periods, &mut found).unwrap();
        let work = Observation { work: found.0.work.clone(), ..Observation::default() };
        let seen = found.0.finish(reader.names());
        let codels = seen.into_iter().filter(|it| it.name.kind == SpanKind::Codel);
        let waits = codels.map(|it| (it.name.key, it.wait.executions, it.wait.greatest, it.wait.is_unknown));
        (waits.collect(), work)
    }

    const PERIODS: &str = "instance,release_ns,begin_ns,end_ns,execution_ns,priority,cpus,cpu,order\n";

    #[test]
    fn preemption_is_no_wait() {
        // `low` is off the CPU for 600 µs. For 400 µs of them `high` executes on its CPU; `other` executes for 100 µs on another CPU.
        let executions = |waits: &str| {
            format!(
                "codel,execution_ns,instance,elapsed_ns,time_ns,order,waits\nf,200000,low,800000,900000,2,{waits}\n"
            )
        };
        let periods = format!(
            "{PERIODS}high,,300000,700000,400000,20,1,0,0\nother,,300000,400000,100000,20,2,1,1\nlow,,50000,950000,250000,10,1,0,3\n"
        );
        assert_eq!(observe(&executions("1"), &periods).0, [("f".to_owned(), 1, 200_000, false)]);
        assert_eq!(observe(&executions("0"), &periods).0, [("f".to_owned(), 0, 0, false)]);
        assert_eq!(observe(&executions(""), &periods).0, [("f".to_owned(), 1, 200_000, true)]);
        // Of a lower priority, or without one CPU, it explains nothing.
        let lower = periods.replace("400000,20,1,0,0", "400000,5,1,0,0");
        assert_eq!(observe(&executions("1"), &lower).0[0].2, 600_000);
        let anywhere = periods.replace("400000,20,1,0,0", "400000,20,3,0,0");
        assert_eq!(observe(&executions("1"), &anywhere).0[0].2, 600_000);
    }

    #[test]
    fn a_period_that_overlaps_explains_what_it_must_have_executed_inside() {
        // `high` waits itself: of its 400 µs, at least 300 are before the codel begins.
        let executions =
            "codel,execution_ns,instance,elapsed_ns,time_ns,order,waits\nf,200000,low,700000,1000000,1,2\n";
        let periods =
            format!("{PERIODS}high,,0,700000,400000,20,1,0,0\nlow,,250000,1000000,250000,10,1,0,3\n");
        // At most 300 µs of it were executed before the codel began, so that at least 100 were executed during the codel.
        assert_eq!(observe(executions, &periods).0[0].2, 500_000 - 100_000);
    }

    #[test]
    fn locks_explain_what_a_codel_waited_for_them() {
        let executions = "codel,execution_ns,instance,elapsed_ns,time_ns,order,waits,blocked_ns\nf,200000,low,700000,1000000,1,1,400000\n\
                          g,200000,low,700000,2000000,2,0,500000\n(lock bus) f,90000,low,95000,990000,3,,\n";
        let (found, _) = observe(executions, PERIODS);
        assert_eq!(found, [("f".to_owned(), 1, 100_000, false), ("g".to_owned(), 0, 0, false)]);
    }

    #[test]
    fn what_is_explained_is_no_wait_that_counts() {
        let times = |executions: &str| {
            let (mut reader, mut found) = (TraceReader::default(), Observe::default());
            let text = format!(
                "codel,execution_ns,instance,elapsed_ns,time_ns,order,waits,blocked_ns\n{executions}"
            );
            reader.read_csv(text.as_bytes(), None, &mut found).unwrap();
            found.0.finish(reader.names())[0].wait.times
        };
        assert_eq!(times("f,100,low,500,1000,1,2,\nf,100,low,300,2000,2,1,\n"), 2);
        assert_eq!(times("f,100,low,500,1000,1,2,400\nf,100,low,300,2000,2,1,\n"), 1);
        assert_eq!(times("f,100,low,90000000,90001000,1,,\n"), 0);
    }

    /// In recordings of earlier versions, a short time off the CPU is not suspicious, and a long one is.
    #[test]
    fn a_recording_without_waits_says_so() {
        let executions = "codel,execution_ns,instance,elapsed_ns,time_ns\nf,60000,a,110000,200000\ng,60000,a,560000,900000\n";
        let (found, _) = observe(executions, PERIODS);
        assert_eq!(found, [("f".to_owned(), 0, 0, true), ("g".to_owned(), 1, 500_000, true)]);
    }

    /// 1,000 jobs respond in 1, 2, … 1,000 µs; others have no release.
    #[test]
    fn response_times_are_remembered_as_shares() {
        let jobs: String = (1..=1000)
            .map(|it| format!("a,{0},{0},{1},1000,,,,\n", it * 1_000_000, it * 1_001_000))
            .collect();
        let periods = format!("{PERIODS}{jobs}b,,1000,9000,1000,,,,\n");
        let (mut reader, mut found) = (TraceReader::default(), Observe::default());
        reader.read_both("codel,execution_ns\n".as_bytes(), periods.as_bytes(), &mut found).unwrap();
        assert!(found.0.within.values().all(|within| within.len() <= 640));
        let seen = found.0.finish(reader.names());
        let [a] = &seen[..] else { panic!("{seen:?}") };
        assert_eq!((a.name.instance.as_str(), a.executions, a.greatest), ("a", 1000, 1_000_000));
        for (time, exact) in a.later.iter().zip([500, 900, 990, 999]) {
            assert!((exact * 1000..exact * 1020).contains(time), "{:?}", a.later);
        }
        assert_eq!(a.later.len(), 4);
    }

    #[test]
    fn work_of_other_threads_is_per_second() {
        let executions =
            "codel,execution_ns,elapsed_ns,time_ns\nf,1,1,100\n\"(work) a,b\",500,2000000000,200\n";
        let (_, observation) = observe(executions, PERIODS);
        assert_eq!(observation.work().iter().collect::<Vec<_>>(), [(&"a,b".to_owned(), &250)]);
    }
}
