//! Begins and ends → spans, thread by thread.
//!
//! Spans of a thread are brackets. They are not balanced where a recording starts or ends inside of a span, where events were
//! discarded, and where a session was stopped for a while. A begin must never be matched with an end that is not its own: what is
//! open in a thread is dropped there, and counted. So an execution time that is reported is one of a span that was recorded
//! completely, under one assumption: within the span no event of its thread was lost without a report of the tracer.

use std::collections::{HashMap, VecDeque};

use super::event::SpanEvent;
use super::names::{NameId, SpanKind};
use super::{RecordedThread, Span, Totals, is_suspicious};

/// Spans deeper than these are not nested by a generated package: a thread's begins lack their ends.
const DEEPEST: usize = 256;

/// So many threads are remembered while no span of them is open, or as many as have one.
const MOST_THREADS: usize = 1 << 14;

/// A time in which events were discarded, in nanoseconds, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LostTime {
    pub(super) begin: u64,
    pub(super) end: u64,
}

/// The threads of a trace, with their open spans.
#[derive(Debug, Default)]
pub(super) struct Nesting {
    threads: HashMap<RecordedThread, ThreadState>,
    /// More threads than this are forgotten where no span of them is open.
    most_threads: usize,
    /// Whether spans of threads that are not remembered may have been dropped.
    has_dropped: bool,
    /// Gaps that no event has reached yet, by their begins.
    gaps: VecDeque<LostTime>,
    /// Until then, events were discarded.
    lossy_until: Option<u64>,
    /// The time of the last event.
    last: u64,
}

#[derive(Debug)]
struct ThreadState {
    open: Vec<OpenSpan>,
    /// Why an end may lack its begin here.
    missing: Missing,
    last_time: u64,
    last_cpu: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Missing {
    Nothing,
    /// The recording starts inside of spans.
    Start,
    /// Spans were dropped, and counted, before their ends.
    Dropped,
}

#[derive(Debug)]
struct OpenSpan {
    kind: SpanKind,
    time: u64,
    cpu_ns: u64,
    waits: Option<u64>,
    /// How often the thread waited for locks since the begin.
    lock_waits: u64,
    /// What is known of the span.
    span: Span,
}

impl Nesting {
    /// Announces discarded events, before the events at that time and later are given.
    pub(super) fn lose(&mut self, gap: LostTime, summary: &mut Totals) {
        let gap = LostTime { begin: gap.begin, end: gap.end.max(gap.begin) };
        let at = self.gaps.partition_point(|it| it.begin <= gap.begin);
        self.gaps.insert(at, gap);
        // A gap that is reported late.
        self.enter_gaps(self.last, summary);
    }

    /// Announces discarded events at an unknown time: nothing that is open is complete.
    pub(super) fn lose_now(&mut self, summary: &mut Totals) {
        self.lose(LostTime { begin: self.last, end: self.last }, summary);
    }

    /// Takes the next event. Returns the span that it ends.
    pub(super) fn event(
        &mut self,
        event: &SpanEvent<'_>,
        thread: RecordedThread,
        name: NameId,
        summary: &mut Totals,
    ) -> Option<Span> {
        self.last = self.last.max(event.time);
        if self.gaps.front().is_some_and(|gap| gap.begin <= event.time) {
            self.enter_gaps(event.time, summary);
        }
        if self.lossy_until.is_some_and(|until| until < event.time) {
            self.lossy_until = None;
        }
        let is_lossy = self.lossy_until.is_some();
        if self.threads.len() > self.most_threads.max(MOST_THREADS) {
            self.threads.retain(|_, state| !state.open.is_empty());
            // So that the next search is paid by the threads that are new until then.
            self.most_threads = 2 * self.threads.len();
        }
        let missing = if self.has_dropped { Missing::Dropped } else { Missing::Start };
        let state = self.threads.entry(thread).or_insert(ThreadState {
            open: Vec::new(),
            missing,
            last_time: 0,
            last_cpu: 0,
        });

        let runs_back = event.time < state.last_time || event.cpu_ns < state.last_cpu;
        state.last_time = event.time;
        state.last_cpu = event.cpu_ns;
        // With nothing open it may be a new thread with the number of one that has ended.
        if runs_back && !state.open.is_empty() {
            summary.clock_errors += state.drop();
        }
        if is_lossy {
            // What begins in a gap may have lost its end.
            if !event.is_end {
                summary.dropped += 1;
            }
            state.missing = Missing::Dropped;
            return None;
        }
        if !event.is_end {
            let SpanEvent { cpu, scheduling, release, .. } = *event;
            let begin = Some(event.time);
            let span =
                Span { name, thread: Some(thread), cpu, begin, scheduling, release, ..Span::default() };
            state.begin(event, span, summary);
            return None;
        }
        state.end(event, name, summary)
    }

    /// Takes the times of a lock that a thread leaves. Returns the innermost open codel of the thread.
    pub(super) fn leave_lock(&mut self, thread: RecordedThread, waits: u64, blocked: u64) -> Option<NameId> {
        let open = &mut self.threads.get_mut(&thread)?.open;
        for it in open.iter_mut() {
            it.lock_waits = it.lock_waits.saturating_add(waits);
            it.span.blocked = it.span.blocked.saturating_add(blocked);
        }
        open.iter().rev().find(|it| it.kind == SpanKind::Codel).map(|it| it.span.name)
    }

    /// Ends the trace: open spans are cut.
    pub(super) fn finish(&mut self, summary: &mut Totals) {
        summary.cut_at_end += self.forget_threads();
    }

    /// Begins the gaps up to a time.
    fn enter_gaps(&mut self, time: u64, summary: &mut Totals) {
        while let Some(gap) = self.gaps.front().copied().filter(|gap| gap.begin <= time) {
            self.gaps.pop_front();
            self.drop_all(summary);
            self.lossy_until = self.lossy_until.max(Some(gap.end));
        }
    }

    fn drop_all(&mut self, summary: &mut Totals) {
        summary.dropped += self.forget_threads();
        self.has_dropped = true;
    }

    /// Returns the number of their open spans. A table that once had many threads costs as much to empty later: it goes too.
    fn forget_threads(&mut self) -> u64 {
        std::mem::take(&mut self.threads).into_values().map(|state| state.open.len() as u64).sum()
    }
}

impl ThreadState {
    /// Opens a span.
    fn begin(&mut self, event: &SpanEvent<'_>, span: Span, summary: &mut Totals) {
        // No period begins within another span.
        if (event.kind == SpanKind::Period && !self.open.is_empty()) || self.open.len() >= DEEPEST {
            summary.unbalanced += self.drop();
        }
        if event.kind == SpanKind::Period {
            self.missing = Missing::Nothing;
        }
        let SpanEvent { kind, time, cpu_ns, waits, .. } = *event;
        self.open.push(OpenSpan { kind, time, cpu_ns, waits, lock_waits: 0, span });
    }

    /// Closes the innermost span, if the event is its end. Returns the span.
    fn end(&mut self, event: &SpanEvent<'_>, name: NameId, summary: &mut Totals) -> Option<Span> {
        match self.open.pop() {
            Some(begin) if begin.span.name == name && begin.kind == event.kind => {
                let (execution, elapsed) = (event.cpu_ns - begin.cpu_ns, event.time - begin.time);
                if is_suspicious(execution, elapsed) {
                    summary.suspicious += 1;
                }
                let (end, outcome) = (Some(event.time), event.outcome);
                let waits = begin
                    .waits
                    .zip(event.waits)
                    .map(|(before, after)| after.saturating_sub(before).saturating_sub(begin.lock_waits));
                Some(Span { end, elapsed: Some(elapsed), execution, waits, outcome, ..begin.span })
            }
            // The begin of this end, or the end of that begin, is missing: which of both is unknown.
            Some(begin) => {
                self.open.push(begin);
                summary.unbalanced += self.drop();
                None
            }
            None => {
                match self.missing {
                    Missing::Nothing => summary.unbalanced += 1,
                    Missing::Start => summary.cut_at_start += 1,
                    Missing::Dropped => {}
                }
                None
            }
        }
    }

    /// Drops what is open; returns the number of spans.
    fn drop(&mut self) -> u64 {
        let count = self.open.len() as u64;
        self.open.clear();
        self.missing = Missing::Dropped;
        count
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A begin or an end, without its thread.
    #[derive(Debug, Clone, Copy)]
    struct Step {
        thread: u64,
        name: u32,
        is_end: bool,
        time: u64,
        cpu_ns: u64,
    }

    /// Name 0 is a period.
    fn feed(nesting: &mut Nesting, step: Step, summary: &mut Totals) -> Option<Span> {
        let kind = if step.name == 0 { SpanKind::Period } else { SpanKind::Codel };
        let Step { time, cpu_ns, is_end, .. } = step;
        let event = SpanEvent {
            time,
            process: b"",
            process_id: None,
            thread: step.thread,
            cpu: None,
            kind,
            text: b"",
            is_end,
            cpu_ns,
            scheduling: None,
            release: None,
            waits: None,
            lock: None,
            outcome: None,
        };
        let thread = RecordedThread { origin: 0, process: 0, thread: step.thread };
        nesting.event(&event, thread, NameId(step.name), summary)
    }

    /// Events of one thread, as `+0 time cpu` (a begin of name 0) and `-0 time cpu`.
    fn run(text: &str, gaps: &[LostTime]) -> (Vec<(u32, u64, u64)>, Totals) {
        let (mut nesting, mut summary) = (Nesting::default(), Totals::default());
        for gap in gaps {
            nesting.lose(*gap, &mut summary);
        }
        let mut found = Vec::new();
        for line in text.split(", ") {
            let words: Vec<&str> = line.split(' ').collect();
            let step = Step {
                thread: 1,
                name: words[0][1..].parse().unwrap(),
                is_end: words[0].starts_with('-'),
                time: words[1].parse().unwrap(),
                cpu_ns: words[2].parse().unwrap(),
            };
            let span = feed(&mut nesting, step, &mut summary);
            found.extend(span.map(|span| (span.name.0, span.begin.unwrap(), span.execution)));
        }
        nesting.finish(&mut summary);
        (found, summary)
    }

    #[test]
    fn spans_are_reported_at_their_ends() {
        let (found, summary) = run("+0 1 1, +1 2 2, -1 9 5, +1 10 6, -1 12 8, -0 13 9", &[]);
        assert_eq!(found, [(1, 2, 3), (1, 10, 2), (0, 1, 8)]);
        assert_eq!(summary, Totals::default());
    }

    #[test]
    fn a_trace_that_starts_and_ends_within_spans() {
        let (found, summary) = run("+1 1 1, -1 2 2, -2 3 3, -0 4 4, +0 5 5, +2 6 6, +1 7 7", &[]);
        assert_eq!(found, [(1, 1, 1)]);
        assert_eq!(summary, Totals { cut_at_start: 2, cut_at_end: 3, ..Totals::default() });
    }

    #[test]
    fn an_end_that_is_not_that_of_the_open_span_drops_the_open_spans() {
        let (found, summary) =
            run("+0 1 1, +1 2 2, +2 3 3, -1 4 4, -0 5 5, +0 6 6, +1 7 7, -1 8 8, -0 9 9", &[]);
        assert_eq!(found, [(1, 7, 1), (0, 6, 3)]);
        assert_eq!(summary, Totals { unbalanced: 3, ..Totals::default() });
        // The session was stopped for a while.
        let (found, summary) = run("+0 1 1, +1 2 2, +0 6 6, +1 7 7, -1 8 8, -0 9 9", &[]);
        assert_eq!(found, [(1, 7, 1), (0, 6, 3)]);
        assert_eq!(summary, Totals { unbalanced: 2, ..Totals::default() });
    }

    #[test]
    fn two_executions_are_not_merged_across_discarded_events() {
        // Between them, an end and a begin of the same codel were discarded.
        let text = "+0 1 1, +1 2 2, -1 90 90, -0 91 91, +0 92 92, -0 93 93";
        let (found, summary) = run(text, &[LostTime { begin: 10, end: 80 }]);
        assert_eq!(found, [(0, 92, 1)]);
        assert_eq!(summary, Totals { dropped: 2, ..Totals::default() });
        // The begin and the end of a gap belong to it.
        let (found, _) =
            run("+1 1 1, -1 10 2, +1 80 3, -1 81 4, +1 82 5, -1 83 7", &[LostTime { begin: 10, end: 80 }]);
        assert_eq!(found, [(1, 82, 2)]);
    }

    #[test]
    fn a_clock_that_runs_back_drops_the_open_spans() {
        let (found, summary) = run("+0 1 5, +1 2 6, -1 3 4, -0 4 5, +0 5 6, +1 6 7, -1 5 8, -0 9 9", &[]);
        assert!(found.is_empty());
        assert_eq!(summary, Totals { clock_errors: 4, ..Totals::default() });
        // A new thread has the number of one that has ended.
        let (found, summary) = run("+0 1 500, -0 2 600, +0 3 1, -0 4 2", &[]);
        assert_eq!(found, [(0, 1, 100), (0, 3, 1)]);
        assert_eq!(summary, Totals::default());
    }

    #[test]
    fn an_execution_is_not_longer_than_the_elapsed_time() {
        let (found, summary) = run("+1 0 0, -1 10 15, +1 100000 100, -1 100001 5000000", &[]);
        assert_eq!(found, [(1, 0, 15), (1, 100_000, 4_999_900)]);
        assert_eq!(summary, Totals { suspicious: 1, ..Totals::default() });
    }

    /// With a search in all threads for each event or gap, this takes minutes.
    #[test]
    fn threads_and_gaps_are_not_searched_for_each_other() {
        const THREADS: u64 = 300_000;
        let (mut nesting, mut summary) = (Nesting::default(), Totals::default());
        let mut spans = 0;
        for (is_end, from) in [(false, 0), (true, THREADS)] {
            for thread in 0..THREADS {
                let step = Step { thread, name: 1, is_end, time: from + thread, cpu_ns: from };
                spans += u64::from(feed(&mut nesting, step, &mut summary).is_some());
            }
        }
        assert_eq!((spans, &summary), (THREADS, &Totals::default()));
        for gap in 0..THREADS {
            let at = 3 * THREADS + 2 * gap;
            nesting.lose(LostTime { begin: at, end: at }, &mut summary);
            let step = Step { thread: gap % 5, name: 1, is_end: false, time: at + 1, cpu_ns: THREADS };
            assert!(feed(&mut nesting, step, &mut summary).is_none());
        }
        nesting.finish(&mut summary);
        assert_eq!((summary.dropped, summary.cut_at_end), (THREADS - 1, 1));
    }

    #[test]
    fn begins_without_ends_need_little_memory() {
        let (mut nesting, mut summary) = (Nesting::default(), Totals::default());
        for time in 0..100_000 {
            let step = Step { thread: time / 1000, name: 1, is_end: false, time, cpu_ns: time };
            feed(&mut nesting, step, &mut summary);
        }
        assert!(nesting.threads.values().all(|state| state.open.len() <= DEEPEST));
        for thread in 0..100_000 {
            for is_end in [false, true] {
                let step = Step { thread, name: 1, is_end, time: 100_000 + thread, cpu_ns: 0 };
                feed(&mut nesting, step, &mut summary);
            }
        }
        assert!(nesting.threads.len() <= MOST_THREADS + 1);
    }

    /// A span that was executed: its thread, name, begin, end and execution time.
    type Executed = (u64, u32, u64, u64, u64);

    /// Random brackets of some threads; returns the events in the order of time, and the spans.
    fn execution(choices: &[(u64, u32, u64)]) -> (Vec<Step>, Vec<Executed>) {
        let mut open: [Vec<(u32, u64, u64)>; 3] = Default::default();
        let mut cpu = [0; 3];
        let (mut steps, mut spans) = (Vec::new(), Vec::new());
        let mut time = 0;
        for &(thread, choice, passed) in choices {
            time += 1 + passed;
            let (open, cpu) = (&mut open[thread as usize], &mut cpu[thread as usize]);
            *cpu += passed / 2;
            // Names repeat, so that wrong brackets would fit, too.
            let (name, is_end) = match open.last() {
                None => (0, false),
                Some((name, ..)) if choice < 3 || open.len() == 4 => (*name, true),
                Some(_) => (1 + choice % 2, false),
            };
            steps.push(Step { thread, name, is_end, time, cpu_ns: *cpu });
            if is_end {
                let (name, begin, begin_cpu) = open.pop().unwrap();
                spans.push((thread, name, begin, time, *cpu - begin_cpu));
            } else {
                open.push((name, time, *cpu));
            }
        }
        (steps, spans)
    }

    fn choices() -> impl Strategy<Value = Vec<(u64, u32, u64)>> {
        proptest::collection::vec((0_u64..3, 0_u32..6, 0_u64..20), 0..150)
    }

    fn reported(steps: impl Iterator<Item = Step>, gaps: &[LostTime]) -> (Vec<Executed>, Totals) {
        let (mut nesting, mut summary) = (Nesting::default(), Totals::default());
        let mut gaps: Vec<LostTime> = gaps.to_vec();
        gaps.sort_by_key(|gap| gap.begin);
        let mut gaps = gaps.into_iter().peekable();
        let mut found = Vec::new();
        for step in steps {
            while let Some(gap) = gaps.next_if(|gap| gap.begin <= step.time) {
                nesting.lose(gap, &mut summary);
            }
            let span = feed(&mut nesting, step, &mut summary);
            found.extend(
                span.map(|it| (step.thread, it.name.0, it.begin.unwrap(), it.end.unwrap(), it.execution)),
            );
        }
        nesting.finish(&mut summary);
        (found, summary)
    }

    proptest! {
        /// The spans that were recorded completely are reported, and no others.
        #[test]
        fn spans_outside_of_reported_losses(
            choices in choices(),
            gaps in proptest::collection::vec((0_u64..1500, 0_u64..100), 0..4),
            lost in proptest::collection::vec(any::<bool>(), 150),
            cut in (0_u64..300, 1000_u64..2000),
        ) {
            let (steps, spans) = execution(&choices);
            let gaps: Vec<LostTime> = gaps.iter().map(|&(begin, length)| LostTime { begin, end: begin + length }).collect();
            let in_gap = |time: u64| gaps.iter().any(|gap| (gap.begin..=gap.end).contains(&time));
            let recorded = steps.iter().zip(&lost).filter(|(step, lost)| {
                (cut.0..cut.1).contains(&step.time) && !(in_gap(step.time) && **lost)
            });
            let (found, summary) = reported(recorded.map(|(step, _)| *step), &gaps);
            let is_complete = |&(_, _, begin, end, _): &Executed| {
                begin >= cut.0 && end < cut.1 && !gaps.iter().any(|gap| gap.begin <= end && gap.end >= begin)
            };
            let expected: Vec<Executed> = spans.into_iter().filter(is_complete).collect();
            prop_assert_eq!(found, expected);
            prop_assert_eq!((summary.unbalanced, summary.clock_errors), (0, 0));
        }

        /// Losses that no one reports may give wrong spans, and no panic.
        #[test]
        fn unreported_losses(choices in choices(), lost in proptest::collection::vec(0_u32..8, 150)) {
            let recorded = execution(&choices).0.into_iter().zip(&lost).filter(|(_, lost)| **lost > 0);
            reported(recorded.map(|(step, _)| step), &[]);
        }
    }
}
