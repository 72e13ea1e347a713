//! Data that is followed through a recording: the greatest observed latency of each chain, and what connections lost.
//!
//! From an instant on, a change is seen by the executions of the source that begin later. So when an effect shows a newer sample than
//! all effects before it, a change just after the begin of the sample that they showed has waited until then:
//!
//! ```text
//! sample 1   change          sample 2      effect of sample 1    effect of sample 2
//!    |---------|----------------|-----------------|-------------------|
//!              |<------------------- observed ----------------------->|
//! ```
//!
//! An observed latency may be too low, and is never too high: each write and each effect counts as if it carried the newest datum that
//! its instance has read, a read of an unknown datum as if that were the newest one of all, and nothing counts while what the chain
//! assumes does not hold, or where the recording has a gap. The runtime for Linux does the same while it runs (`src/chains.cpp`).

use std::collections::{BTreeMap, VecDeque};

use mauve_pwcet::trace::{self, NameId, Outcome, Span, SpanKind, SpanNames};

use super::{
    ExpectedChain, ExpectedConnection, ExpectedDeployment, ExpectedEnd, Greatest, ObservedChain,
    ObservedConnection,
};

/// The writes of a connection that are remembered. Older ones count as the newest.
const MOST_WRITES: usize = 1 << 12;

/// An execution of a source: its number, from 1, and its begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
struct Sample {
    number: u64,
    at: u64,
}

/// What happened last in an instance of a chain.
#[derive(Debug, Clone, Default)]
struct FollowedStep {
    carried: Sample,
    /// The latest writes, by number, with what they carried.
    written: VecDeque<(u64, Sample)>,
    /// The number of the value that was read last.
    last_read: u64,
    /// The number of writes.
    writes: u64,
    has_begun: bool,
    /// So many periods must end before what is assumed holds again: variables may keep what was not as assumed for one more.
    doubts: u32,
    /// The number of periods since `carried` was read, and the most until it was written; none after that.
    since_read: Option<u32>,
    most_periods: u32,
}

/// A chain while it is followed.
#[derive(Debug, Clone, Default)]
struct FollowedChain {
    steps: Vec<FollowedStep>,
    newest: Sample,
    shown: Sample,
    valid_from: u64,
    /// The end of the last span whose place in time is known.
    now: u64,
    greatest: Option<Greatest>,
    late: u64,
}

/// A connection while it is followed.
#[derive(Debug, Clone, Default)]
struct FollowedConnection {
    observed: ObservedConnection,
    last_read: Option<u64>,
}

/// What the spans of a name mean.
#[derive(Debug, Clone, Copy)]
enum ChainRole {
    /// For a step of a chain.
    Step { chain: usize, step: usize, what: StepRole },
    /// A write of a connection, or a read.
    Connection(usize),
}

#[derive(Debug, Clone, Copy)]
enum StepRole {
    Period,
    /// The instance is configured, started or stopped.
    Restart,
    /// In another state than those that are assumed.
    OtherState,
    Answer,
    Enters,
    Leaves,
}

/// Follows the data of a recording.
#[derive(Debug, Default)]
pub(super) struct ChainObserver {
    chains: Vec<FollowedChain>,
    connections: Vec<FollowedConnection>,
    roles: BTreeMap<NameId, Vec<ChainRole>>,
}

impl ChainObserver {
    pub(super) fn new(chains: &[ExpectedChain], connections: &[ExpectedConnection]) -> ChainObserver {
        let followed = |it: &ExpectedChain| FollowedChain {
            steps: vec![FollowedStep::default(); it.steps.len()],
            ..FollowedChain::default()
        };
        ChainObserver {
            chains: chains.iter().map(followed).collect(),
            connections: vec![FollowedConnection::default(); connections.len()],
            roles: BTreeMap::new(),
        }
    }

    pub(super) fn span(&mut self, expected: &ExpectedDeployment, span: &Span, names: &SpanNames) {
        let roles = self.roles.entry(span.name);
        let roles = roles.or_insert_with(|| roles_of(expected, names.get(span.name)));
        for role in roles.iter() {
            match *role {
                ChainRole::Connection(connection) => {
                    let size = expected.connections.get(connection).and_then(|it| it.buffer);
                    let found = self.connections.get_mut(connection);
                    found.into_iter().for_each(|it| it.access(span, size.is_some()));
                }
                ChainRole::Step { chain, step, what } => {
                    let bound = expected.chains.get(chain).and_then(|it| it.bound.or(it.limit));
                    let found = self.chains.get_mut(chain);
                    found.into_iter().for_each(|it| it.span(step, what, span, bound));
                }
            }
        }
    }

    /// Spans may be missing until then.
    pub(super) fn lose(&mut self, until: u64) {
        self.chains.iter_mut().for_each(|it| it.lose(until));
        self.connections.iter_mut().for_each(|it| it.last_read = None);
    }

    /// Ends a recording. The next recording numbers its values anew.
    pub(super) fn end_recording(&mut self) {
        for chain in &mut self.chains {
            let steps = chain
                .steps
                .iter()
                .map(|it| FollowedStep { most_periods: it.most_periods, ..FollowedStep::default() });
            let (greatest, late) = (chain.greatest, chain.late);
            *chain = FollowedChain { steps: steps.collect(), greatest, late, ..FollowedChain::default() };
        }
        self.connections.iter_mut().for_each(|it| it.last_read = None);
    }

    pub(super) fn finish(self) -> (Vec<ObservedChain>, Vec<ObservedConnection>) {
        let of = |FollowedChain { steps, greatest, late, .. }: FollowedChain| {
            let releases = steps.iter().map(|step| step.most_periods.saturating_add(1));
            ObservedChain { greatest, late, releases: releases.collect() }
        };
        let connections = self.connections.into_iter().map(|it| it.observed);
        (self.chains.into_iter().map(of).collect(), connections.collect())
    }
}

/// Returns what spans of this name mean, in the order in which they are to be taken.
fn roles_of(expected: &ExpectedDeployment, name: &trace::SpanName) -> Vec<ChainRole> {
    let mut roles = Vec::new();
    for (chain, it) in expected.chains.iter().enumerate() {
        for (step, it) in it.steps.iter().enumerate().filter(|(_, it)| it.instance == name.instance) {
            let mut add = |what| roles.push(ChainRole::Step { chain, step, what });
            let is = |end: &ExpectedEnd| end.kind == name.kind && end.key == name.key;
            let program = name.key.rsplit_once('/').map_or("", |(_, program)| program);
            match name.kind {
                SpanKind::Period => add(StepRole::Period),
                SpanKind::Program => match program.split_once('.') {
                    Some((state, _)) if !it.states.is_empty() && !it.states.iter().any(|it| it == state) => {
                        add(StepRole::OtherState);
                    }
                    None if ["configure", "start", "stop", "cleanup"].contains(&program) => {
                        add(StepRole::Restart);
                    }
                    _ => {}
                },
                _ => {}
            }
            let ends = [
                (it.answers.iter().any(is), StepRole::Answer),
                (is(&it.from), StepRole::Enters),
                (is(&it.to), StepRole::Leaves),
            ];
            ends.into_iter().filter(|(is_it, _)| *is_it).for_each(|(_, what)| add(what));
        }
    }
    for (connection, it) in expected.connections.iter().enumerate().filter(|_| name.kind == SpanKind::Access)
    {
        let is = |(instance, key): &(String, String)| *instance == name.instance && *key == name.key;
        roles.extend(it.ends.iter().filter(|it| is(it)).map(|_| ChainRole::Connection(connection)));
    }
    roles
}

impl FollowedChain {
    fn span(&mut self, step: usize, what: StepRole, span: &Span, bound: Option<u64>) {
        let (Some(begin), Some(end)) = (span.begin, span.end) else {
            // Its place in time is unknown.
            return self.lose(self.now);
        };
        self.now = self.now.max(end);
        match what {
            StepRole::Period => {
                let Some(step) = self.steps.get_mut(step) else { return };
                if !std::mem::replace(&mut step.has_begun, true) {
                    self.valid_from = self.valid_from.max(begin);
                }
                if step.doubts > 0 {
                    step.doubts -= 1;
                    self.valid_from = self.valid_from.max(end);
                }
                step.since_read = step.since_read.map(|periods| periods.saturating_add(1));
            }
            StepRole::Restart => {
                self.lose(end);
                self.steps.get_mut(step).into_iter().for_each(|it| it.has_begun = false);
            }
            StepRole::OtherState => self.doubt(step),
            StepRole::Answer => {
                if matches!(span.outcome, Some(Outcome::False | Outcome::NoData | Outcome::OldData)) {
                    self.doubt(step);
                }
            }
            StepRole::Enters if step == 0 => {
                self.newest = Sample { number: self.newest.number + 1, at: begin };
                let newest = self.newest;
                self.steps.first_mut().into_iter().for_each(|it| it.take(newest));
            }
            StepRole::Enters if span.outcome == Some(Outcome::NewData) => self.read(step, span.number),
            StepRole::Leaves => self.leaves(step, span, end, bound),
            StepRole::Enters => {}
        }
    }

    fn doubt(&mut self, step: usize) {
        let Some(step) = self.steps.get_mut(step) else { return };
        (step.doubts, step.since_read) = (2, None);
    }

    /// Spans may be missing until then: all that was read may be the newest.
    fn lose(&mut self, until: u64) {
        self.valid_from = self.valid_from.max(until);
        self.newest = Sample { number: self.newest.number + 1, at: self.valid_from };
        for step in &mut self.steps {
            step.carried = self.newest;
            step.since_read = None;
        }
    }

    /// Takes the value of a read: without its number, that of the last write, unless an earlier read took it.
    fn read(&mut self, step: usize, number: Option<u64>) {
        let before = step.checked_sub(1).and_then(|before| self.steps.get(before));
        let (Some(before), Some(last_read)) = (before, self.steps.get(step).map(|it| it.last_read)) else {
            return;
        };
        let number = number.or_else(|| before.written.back().map(|it| it.0).filter(|it| *it > last_read));
        let found = number.and_then(|number| before.written.iter().rev().find(|it| it.0 == number));
        let sample = found.map_or(self.newest, |(_, sample)| *sample);
        if let Some(step) = self.steps.get_mut(step) {
            step.last_read = number.unwrap_or(last_read);
            step.take(sample);
        }
    }

    fn leaves(&mut self, index: usize, span: &Span, end: u64, bound: Option<u64>) {
        let is_last = index + 1 == self.steps.len();
        let Some(step) = self.steps.get_mut(index).filter(|it| it.carried.number > 0) else { return };
        step.most_periods = step.most_periods.max(step.since_read.take().unwrap_or_default());
        step.writes += 1;
        let number = span.number.unwrap_or(step.writes);
        if step.written.len() >= MOST_WRITES {
            step.written.pop_front();
        }
        step.written.push_back((number, step.carried));
        let shown = step.carried;
        if !is_last || shown.number <= self.shown.number {
            return;
        }
        let from = self.shown.at.max(self.valid_from);
        self.shown = shown;
        let is_as_assumed = self.steps.iter().all(|it| it.has_begun && it.doubts == 0);
        if !is_as_assumed || from >= shown.at {
            return;
        }
        let time = end.saturating_sub(from);
        self.late += u64::from(bound.is_some_and(|bound| time > bound));
        Greatest::raise(&mut self.greatest, time, Some(end));
    }
}

impl FollowedStep {
    fn take(&mut self, sample: Sample) {
        if sample > self.carried {
            self.carried = sample;
            self.since_read = self.since_read.or(Some(0));
        }
    }
}

impl FollowedConnection {
    /// If a recording has no numbers, new data of a register is the last write; the write of new data from a buffer is unknown.
    fn access(&mut self, span: &Span, has_buffer: bool) {
        match span.outcome {
            Some(Outcome::Written | Outcome::Lost) => self.observed.written += 1,
            Some(Outcome::NewData) => {
                self.observed.read += 1;
                let number = span.number.or(Some(self.observed.written).filter(|_| !has_buffer));
                if let Some((last, number)) = self.last_read.zip(number) {
                    self.observed.unread += number.saturating_sub(last.saturating_add(1));
                }
                self.last_read = number;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use mauve_pwcet::trace::{Source, TraceReader};

    use super::super::{ExpectedStep, FindingKind, ObservedDeployment, Observer};
    use super::*;
    use mauve_pwcet::trace::access_key;

    /// `lib.see` in `eye` → `C.out` → `D.seen` → `lib.turn` in `wheel`.
    fn expected() -> ExpectedDeployment {
        let codel = |key: &str| ExpectedEnd { kind: SpanKind::Codel, key: key.to_owned() };
        let port = |key: &str| ExpectedEnd { kind: SpanKind::Access, key: access_key(key) };
        let step = |instance: &str, from, to| ExpectedStep {
            instance: instance.to_owned(),
            from,
            to,
            releases: Some(1),
            states: Vec::new(),
            answers: Vec::new(),
        };
        let end = |instance: &str, key: &str| (instance.to_owned(), access_key(key));
        ExpectedDeployment {
            chains: vec![ExpectedChain {
                name: "look".to_owned(),
                bound: Some(200),
                limit: None,
                steps: vec![
                    step("eye", codel("lib.see"), port("C.out")),
                    step("wheel", port("D.seen"), codel("lib.turn")),
                ],
            }],
            connections: vec![ExpectedConnection {
                name: "eye.out -> wheel.seen".to_owned(),
                ends: [end("eye", "C.out"), end("wheel", "D.seen")],
                buffer: None,
            }],
            ..ExpectedDeployment::default()
        }
    }

    /// Reads the files of a recording, which last no longer.
    fn read(reader: &mut TraceReader, texts: [&String; 2], observer: &mut Observer) {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let (process, count) = (std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let path = |name: &str| std::env::temp_dir().join(format!("mauve-{name}-{process}-{count}.csv"));
        let paths = [path("executions"), path("periods")];
        paths.iter().zip(texts).for_each(|(path, text)| std::fs::write(path, text).unwrap());
        let [executions, periods] = paths.clone();
        let read = reader.read(&Source::Csv { executions, periods: Some(periods) }, observer);
        paths.iter().for_each(|path| std::fs::remove_file(path).unwrap());
        read.unwrap();
    }

    /// Recordings of a text: `eye 100 3` is a period of `eye` from 100 that writes value 3 of its port, `wheel 130 3` one of
    /// `wheel` that reads it, and `wheel 130 old` one that reads nothing new; `no 100` and `state 100` are periods of `eye` in which
    /// `lib.see` fails, and that are in state `S`.
    fn observe(expected: &ExpectedDeployment, recordings: &[&str]) -> ObservedDeployment {
        let (mut reader, mut observer) = (TraceReader::default(), Observer::new(expected.clone()));
        for text in recordings {
            let mut executions =
                "codel,execution_ns,instance,elapsed_ns,time_ns,order,status,number\n".to_owned();
            let mut periods = "instance,begin_ns,end_ns,execution_ns,order\n".to_owned();
            let mut order = 0;
            for period in text.split(", ") {
                let words: Vec<&str> = period.split(' ').collect();
                let at: u64 = words[1].parse().unwrap();
                let number = words.get(2).copied().unwrap_or_default();
                let mut line =
                    |key: &str, instance: &str, (from, to): (u64, u64), status: &str, number: &str| {
                        order += 1;
                        let elapsed = to - from;
                        executions +=
                            &format!("{key},1,{instance},{elapsed},{},{order},{status},{number}\n", at + to);
                    };
                let seen = |status| ("lib.see", "eye", (5, 10), status, "");
                let instance = match words[0] {
                    "wheel" => {
                        let status = if number == "old" { "old_data" } else { "new_data" };
                        line("(access) D.seen", "wheel", (1, 2), status, number.trim_start_matches("old"));
                        line("lib.turn", "wheel", (5, 15), "", "");
                        "wheel"
                    }
                    "no" => {
                        let (key, instance, times, status, number) = seen("false");
                        line(key, instance, times, status, number);
                        "eye"
                    }
                    "state" => {
                        line("C/S.run", "eye", (0, 12), "", "");
                        "eye"
                    }
                    _ => {
                        let (key, instance, times, status, none) = seen("true");
                        line(key, instance, times, status, none);
                        line("(access) C.out", "eye", (11, 12), "written", number);
                        "eye"
                    }
                };
                order += 1;
                periods += &format!("{instance},{at},{},5,{order}\n", at + 20);
            }
            read(&mut reader, [&executions, &periods], &mut observer);
            observer.end_recording();
        }
        observer.finish(reader.names())
    }

    fn latency(expected: &ExpectedDeployment, recordings: &[&str]) -> Option<u64> {
        observe(expected, recordings).chains[0].greatest.map(|it| it.time)
    }

    const ALL: &str = "eye 0 1, wheel 30 1, eye 100 2, wheel 130 2, eye 200 3, eye 300 4, wheel 330 4, eye 400 5, wheel 430 5";

    #[test]
    fn a_change_just_after_a_sample_waits_for_the_effect_of_the_next_one() {
        let observed = observe(&expected(), &[ALL]);
        // The sample at 105 is shown until 345; the third one is never read.
        let greatest = Some(Greatest { time: 345 - 105, at: Some(345) });
        assert_eq!(observed.chains, [ObservedChain { greatest, late: 1, releases: vec![1, 1] }]);
        assert_eq!(observed.connections, [ObservedConnection { written: 5, read: 4, unread: 1 }]);
        let found: Vec<_> =
            observed.findings.iter().filter(|it| matches!(it.kind, FindingKind::Chain { .. })).collect();
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].at, found[0].count), (Some(345), 1));
    }

    #[test]
    fn without_numbers_new_data_of_a_register_is_what_was_written_last() {
        let numbers = |text: &str| {
            let words = text.split(", ").map(|it| it.rsplit_once(' ').unwrap().0);
            words.collect::<Vec<_>>().join(", ")
        };
        assert_eq!(observe(&expected(), &[&numbers(ALL)]).chains, observe(&expected(), &[ALL]).chains);
        assert_eq!(
            observe(&expected(), &[&numbers(ALL)]).connections,
            observe(&expected(), &[ALL]).connections
        );
    }

    #[test]
    fn a_buffer_delays_the_data_that_a_read_has() {
        // Each read has the value that was written before the last one.
        let text = "eye 0 1, wheel 30 1, eye 100 2, eye 200 3, wheel 230 2, eye 300 4, wheel 330 3, eye 400 5, wheel 430 4";
        assert_eq!(latency(&expected(), &[text]), Some(345 - 105));
        // Without a bound that is exceeded, and with what is read as a value that is unknown: the newest one.
        let unknown = text.replace("wheel 230 2", "wheel 230 77").replace("wheel 330 3", "wheel 330 78");
        assert_eq!(latency(&expected(), &[&unknown]), Some(245 - 30));
    }

    #[test]
    fn nothing_counts_before_all_have_begun_and_across_recordings() {
        // The first change that counts is at 230, when `wheel` begins.
        let late = "eye 0 1, eye 100 2, wheel 230 2, eye 300 3, wheel 330 3";
        assert_eq!(latency(&expected(), &[late]), Some(345 - 230));
        assert_eq!(latency(&expected(), &["eye 0 1, wheel 30 1, eye 100 2"]), None);
        let parts = ["eye 0 1, wheel 30 1, eye 100 2", "wheel 130 2, eye 200 3, wheel 230 3"];
        assert_eq!(latency(&expected(), &parts), Some(245 - 200));
        let parts = [ALL, "wheel 5000 1, eye 5100 2, wheel 5130 2, eye 5200 3, wheel 5230 3"];
        assert_eq!(latency(&expected(), &parts), Some(240));
    }

    #[test]
    fn nothing_counts_while_an_assumption_does_not_hold() {
        let text = |what: &str| {
            format!(
                "eye 0 1, wheel 30 1, eye 100 2, wheel 130 2, {what} 200, {what} 300, {what} 400, eye 500 3, wheel 530 3, eye 600 4, wheel 630 4, eye 700 5, wheel 730 5"
            )
        };
        let mut expected = expected();
        for what in ["no", "state"] {
            assert_eq!(latency(&expected, &[&text(what)]), Some(545 - 105), "{what}");
        }
        // One period must pass after the last one in which it did not hold.
        expected.chains[0].steps[0]
            .answers
            .push(ExpectedEnd { kind: SpanKind::Codel, key: "lib.see".to_owned() });
        assert_eq!(latency(&expected, &[&text("no")]), Some(745 - 605));
        expected.chains[0].steps[0].states.push("T".to_owned());
        assert_eq!(latency(&expected, &[&text("state")]), Some(745 - 605));
        expected.chains[0].steps[0].states.push("S".to_owned());
        assert_eq!(latency(&expected, &[&text("state")]), Some(545 - 105));
    }

    #[test]
    fn gaps_and_restarts_end_what_is_followed() {
        let (mut chains, expected) = (ChainObserver::new(&expected().chains, &[]), expected());
        chains.lose(1000);
        assert_eq!(chains.chains[0].valid_from, 1000);
        let name = |key: &str| trace::SpanName {
            kind: SpanKind::Program,
            key: key.to_owned(),
            instance: "wheel".to_owned(),
        };
        assert!(matches!(
            roles_of(&expected, &name("D/stop"))[..],
            [ChainRole::Step { chain: 0, step: 1, what: StepRole::Restart }]
        ));
        assert!(roles_of(&expected, &name("D/update")).is_empty());
    }
}
