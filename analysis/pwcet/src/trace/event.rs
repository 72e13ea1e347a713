//! An event of a generated package, as `babeltrace2` prints it:
//!
//! ```text
//! [1795402383.698441889] host:(17723) mauve_nav:codel: { cpu_id = 0 }, { vtid = 17726 }, { instance = "p", codel = "nav.plan", phase = 0, cpu_ns = 19229 }
//! ```
//!
//! The host, the process, the contexts and their order depend on the session; the payload is that of the tracepoint provider. The
//! parser borrows from the line and allocates nothing.

use super::names::{SpanKind, SpanName, access_key};
use super::{Outcome, Scheduling};

/// A begin or an end of a span.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct SpanEvent<'a> {
    /// In nanoseconds since the epoch.
    pub(super) time: u64,
    /// The host and the process, as far as the session records them.
    pub(super) process: &'a [u8],
    pub(super) process_id: Option<u64>,
    pub(super) thread: u64,
    pub(super) cpu: Option<u32>,
    pub(super) kind: SpanKind,
    /// The fields that name the span, as they are printed; [`name`] reads them.
    pub(super) text: &'a [u8],
    pub(super) is_end: bool,
    /// The CPU time that the thread had used, in nanoseconds.
    pub(super) cpu_ns: u64,
    /// Of the begin of a period.
    pub(super) scheduling: Option<Scheduling>,
    /// Of the begin of a period that a message has released: when that was published.
    pub(super) release: Option<u64>,
    /// Of a codel, how often the thread had given up the CPU by its own will; of a lock, how often while it waited for the lock. None
    /// in recordings of earlier versions.
    pub(super) waits: Option<u64>,
    /// Of a lock, for how long the thread had it, and for how long it waited for it. Then `cpu_ns` is the CPU time meanwhile.
    pub(super) lock: Option<(u64, u64)>,
    /// Of the end of an access or of a codel. None in recordings of earlier versions.
    pub(super) outcome: Option<Outcome>,
}

/// An event of `ros2_tracing`, or of CARET.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Ros2Event<'a> {
    /// In nanoseconds since the epoch.
    pub(super) time: u64,
    /// The host and the process, as far as the session records them.
    pub(super) process: &'a [u8],
    pub(super) process_id: Option<u64>,
    pub(super) thread: u64,
    pub(super) cpu: Option<u32>,
    /// Without its provider.
    pub(super) name: &'a [u8],
    groups: &'a [u8],
}

impl<'a> Ros2Event<'a> {
    /// Returns a number, or an address.
    pub(super) fn number(&self, name: &str) -> Option<u64> {
        let value = self.field(name)?;
        match value.strip_prefix(b"0x") {
            Some(digits) => u64::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok(),
            None => number(value),
        }
    }

    /// Returns the host.
    pub(super) fn host(&self) -> &'a [u8] {
        host(self.process)
    }

    /// Returns a text.
    pub(super) fn text(&self, name: &str) -> Option<String> {
        unescaped(self.field(name)?)
    }

    fn field(&self, name: &str) -> Option<&'a [u8]> {
        let mut fields = EventFields { rest: self.groups };
        fields.find(|field| field.name == name.as_bytes()).map(|field| field.value)
    }
}

/// The event `sched_switch` of Linux.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct SwitchEvent<'a> {
    /// In nanoseconds since the epoch.
    pub(super) time: u64,
    /// The host.
    pub(super) host: &'a [u8],
    pub(super) cpu: u32,
    /// The thread that leaves the CPU.
    pub(super) previous: u64,
    /// The thread that gets it.
    pub(super) next: u64,
    /// Of that one, the priority of the real-time scheduler; 0 without one.
    pub(super) priority: u32,
}

/// A line of `babeltrace2`.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum BabeltraceLine<'a> {
    Event(SpanEvent<'a>),
    /// An event of `ros2_tracing`, or of CARET.
    Ros2(Ros2Event<'a>),
    /// A CPU goes from one thread to another.
    Switch(SwitchEvent<'a>),
    /// An event of another provider.
    Foreign,
    /// An event of a generated package without the context `vtid`.
    WithoutThread,
    /// Something else.
    Malformed,
}

/// Reads a line without its line feed.
pub(super) fn parse(line: &[u8]) -> BabeltraceLine<'_> {
    event(line).unwrap_or(BabeltraceLine::Malformed)
}

fn event(line: &[u8]) -> Option<BabeltraceLine<'_>> {
    let (time, rest) = time(line.strip_prefix(b"[")?)?;
    let rest = rest.strip_prefix(b"] ")?;
    // No name of a host, a process, a provider or an event has this.
    let header = find(rest, b": {")?;
    let (header, groups) = (rest.get(..header)?, rest.get(header + 2..)?);
    let (process, name) = match header.iter().rposition(|byte| *byte == b' ') {
        Some(space) => (header.get(..space)?, header.get(space + 1..)?),
        None => (&b""[..], header),
    };
    let of_ros = name.strip_prefix(b"ros2:").or_else(|| name.strip_prefix(b"ros2_caret:"));
    if let Some(name) = of_ros {
        return Some(ros2_event(time, process, name, groups));
    }
    if name == b"sched_switch" {
        return Some(switch(time, process, groups).map_or(BabeltraceLine::Foreign, BabeltraceLine::Switch));
    }
    let Some(name) = name.strip_prefix(b"mauve_") else { return Some(BabeltraceLine::Foreign) };
    let kind = match name.get(name.iter().position(|byte| *byte == b':')? + 1..)? {
        b"component" => SpanKind::Period,
        b"program" => SpanKind::Program,
        b"codel" => SpanKind::Codel,
        b"access" => SpanKind::Access,
        b"lock" => SpanKind::Lock,
        _ => return Some(BabeltraceLine::Foreign),
    };

    let mut fields = EventFields { rest: groups };
    let (mut thread, mut process_id, mut cpu) = (None, None, None);
    // The payload begins with the field `instance`, after the contexts.
    let text = loop {
        let before = fields.rest;
        let field = fields.next()?;
        match field.name {
            b"vtid" => thread = Some(number(field.value)?),
            b"vpid" => process_id = Some(number(field.value)?),
            b"cpu_id" => cpu = u32::try_from(number(field.value)?).ok(),
            b"instance" if field.value.starts_with(b"\"") => break before,
            _ => {}
        }
    };
    let (phase, text) = loop {
        let before = fields.rest.len();
        let field = fields.next()?;
        if field.name == b"phase" {
            break (field.value, text.get(..text.len() - before)?);
        }
    };
    let is_end = match phase {
        b"0" => false,
        b"1" => true,
        _ => return None,
    };
    let cpu_ns = fields.number("cpu_ns")?;
    let (mut scheduling_of, mut waits, mut lock, mut outcome) = (None, None, None, None);
    match kind {
        SpanKind::Period if !is_end => scheduling_of = scheduling(&mut fields),
        SpanKind::Codel => {
            waits = fields.number("waits");
            outcome = fields.number("outcome").and_then(Outcome::of_number);
        }
        SpanKind::Access => outcome = fields.number("outcome").and_then(Outcome::of_number),
        SpanKind::Lock => {
            lock = Some((fields.number("elapsed_ns")?, fields.number("blocked_ns")?));
            waits = fields.number("waits");
        }
        _ => {}
    }
    let Some(thread) = thread else { return Some(BabeltraceLine::WithoutThread) };
    Some(BabeltraceLine::Event(SpanEvent {
        time,
        process,
        process_id,
        thread,
        cpu,
        kind,
        text,
        is_end,
        cpu_ns,
        scheduling: scheduling_of,
        release: None,
        waits,
        lock,
        outcome,
    }))
}

fn ros2_event<'a>(time: u64, process: &'a [u8], name: &'a [u8], groups: &'a [u8]) -> BabeltraceLine<'a> {
    let event = Ros2Event { time, process, process_id: None, thread: 0, cpu: None, name, groups };
    let Some(thread) = event.number("vtid") else { return BabeltraceLine::WithoutThread };
    let cpu = event.number("cpu_id").and_then(|it| u32::try_from(it).ok());
    BabeltraceLine::Ros2(Ros2Event { thread, process_id: event.number("vpid"), cpu, ..event })
}

fn switch<'a>(time: u64, process: &'a [u8], groups: &'a [u8]) -> Option<SwitchEvent<'a>> {
    let (mut cpu, mut previous, mut next, mut priority) = (None, None, None, 0);
    for field in (EventFields { rest: groups }) {
        match field.name {
            b"cpu_id" => cpu = u32::try_from(number(field.value)?).ok(),
            b"prev_tid" => previous = number(field.value),
            b"next_tid" => next = number(field.value),
            // Linux's own number less 100: -2 for priority 1, and -100 for 99.
            b"next_prio" => priority = field.value.strip_prefix(b"-").and_then(number).unwrap_or(0),
            _ => {}
        }
    }
    let priority = u32::try_from(priority.saturating_sub(1)).ok().filter(|it| *it < 100).unwrap_or(0);
    Some(SwitchEvent { time, host: host(process), cpu: cpu?, previous: previous?, next: next?, priority })
}

/// Returns the host of `host:(process)`.
fn host(process: &[u8]) -> &[u8] {
    process.split(|byte| *byte == b':').next().unwrap_or_default()
}

/// Reads the scheduling of a thread. None in recordings of earlier versions, and where the system did not say it.
fn scheduling(fields: &mut EventFields<'_>) -> Option<Scheduling> {
    // A negative priority is unknown.
    let priority = u32::try_from(fields.number("priority")?).ok()?;
    Some(Scheduling { priority, cpus: fields.number("cpus")? })
}

/// Reads the names of a span in the text of its event. Returns `None` if the provider is not that of a generated package.
pub(super) fn name(kind: SpanKind, text: &[u8]) -> Option<SpanName> {
    let mut fields = EventFields { rest: text };
    let mut field = |name: &str| {
        let field = fields.next().filter(|field| field.name == name.as_bytes())?;
        unescaped(field.value)
    };
    let instance = field("instance")?;
    let key = match kind {
        SpanKind::Period => String::new(),
        SpanKind::Codel => field("codel")?,
        SpanKind::Access => access_key(&field("port")?),
        // The reader knows the codel.
        SpanKind::Lock => field("lock")?,
        SpanKind::Program => {
            let component = field("component")?;
            let (state, transition, program) = (field("state")?, field("transition")?, field("program")?);
            program_key(&component, &state, &transition, &program)
        }
    };
    Some(SpanName { kind, key, instance })
}

/// Returns the key of a program in a timing table.
fn program_key(component: &str, state: &str, transition: &str, program: &str) -> String {
    match (state, transition, program) {
        // The provider writes the name of an operation as that of a transition without a state.
        ("-", name, "operation") => format!("{component}/{name}"),
        ("-", _, hook) => format!("{component}/{hook}"),
        (state, "-", method) => format!("{component}/{state}.{method}"),
        (state, transition, kind) => format!("{component}/{state}.{transition}.{kind}"),
    }
}

/// `name = value`; the value of a text has its quotes.
struct EventField<'a> {
    name: &'a [u8],
    value: &'a [u8],
}

/// The fields of `{ a = 1, b = "x" }, { c = { d = 2 } }`, without those inside of structures.
struct EventFields<'a> {
    rest: &'a [u8],
}

impl EventFields<'_> {
    /// Reads the next field, a number of this name.
    fn number(&mut self, name: &str) -> Option<u64> {
        let field = self.next().filter(|field| field.name == name.as_bytes())?;
        number(field.value)
    }
}

impl<'a> Iterator for EventFields<'a> {
    type Item = EventField<'a>;

    fn next(&mut self) -> Option<EventField<'a>> {
        let begin = self.rest.iter().position(|byte| !b" ,{}".contains(byte))?;
        let rest = self.rest.get(begin..)?;
        // A name has no space.
        let (name, value) = rest.split_at_checked(rest.iter().position(|byte| *byte == b' ')?)?;
        let value = value.strip_prefix(b" = ")?;
        let (value, rest) = value.split_at_checked(value_length(value)?)?;
        self.rest = rest;
        Some(EventField { name, value })
    }
}

/// Returns the length of the value at the beginning of `bytes`.
fn value_length(bytes: &[u8]) -> Option<usize> {
    match bytes.first()? {
        b'"' => text_length(bytes),
        b'{' | b'[' => {
            let (mut depth, mut at) = (0_u32, 0);
            loop {
                match bytes.get(at)? {
                    b'"' => at += text_length(bytes.get(at..)?)? - 1,
                    b'{' | b'[' => depth += 1,
                    b'}' | b']' => depth -= 1,
                    _ => {}
                }
                at += 1;
                if depth == 0 {
                    return Some(at);
                }
            }
        }
        _ => bytes.iter().position(|byte| *byte == b',' || *byte == b' '),
    }
}

/// Returns the length of a text with both quotes. A quote inside of it has a `\` before it.
fn text_length(bytes: &[u8]) -> Option<usize> {
    let mut at = 1;
    loop {
        match bytes.get(at)? {
            b'"' => return Some(at + 1),
            b'\\' => at += 2,
            _ => at += 1,
        }
    }
}

/// Returns a text without its quotes and escapes. No name in a model needs an escape, so that control characters stay escaped.
fn unescaped(value: &[u8]) -> Option<String> {
    let inner = value.strip_prefix(b"\"")?.strip_suffix(b"\"")?;
    let mut text = String::from_utf8_lossy(inner).into_owned();
    if text.contains('\\') {
        for quoted in ['\'', '"', '?'] {
            text = text.replace(&format!("\\{quoted}"), &quoted.to_string());
        }
        text = text.replace("\\\\", "\\");
    }
    Some(text)
}

/// Reads `1795402383.698441889` as nanoseconds; returns them with what follows.
pub(super) fn time(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let point =
        bytes.iter().position(|byte| !byte.is_ascii_digit()).filter(|it| bytes.get(*it) == Some(&b'.'))?;
    let seconds = number(bytes.get(..point)?)?;
    let (nanoseconds, rest) = bytes.get(point + 1..)?.split_at_checked(9)?;
    Some((seconds.checked_mul(1_000_000_000)?.checked_add(number(nanoseconds)?)?, rest))
}

/// Reads a number of decimal digits.
pub(super) fn number(digits: &[u8]) -> Option<u64> {
    if digits.is_empty() || digits.len() > 20 {
        return None;
    }
    let digit = |byte: &u8| byte.is_ascii_digit().then(|| u64::from(byte - b'0'));
    digits.iter().try_fold(0_u64, |value, byte| value.checked_mul(10)?.checked_add(digit(byte)?))
}

fn find(bytes: &[u8], wanted: &[u8]) -> Option<usize> {
    bytes.windows(wanted.len()).position(|it| it == wanted)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(line: &str) -> (SpanEvent<'_>, SpanName) {
        match parse(line.as_bytes()) {
            BabeltraceLine::Event(event) => {
                let name = name(event.kind, event.text).unwrap();
                (event, name)
            }
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn an_event_has_its_fields() {
        let line = "[1795402383.698441889] vm:(18040) mauve_x:program: { cpu_id = 1 }, { vtid = 17726, vpid = 17723, procname = \"a\\\", b = {\" }, { instance = \"p\", component = \"lib.Pilot\", state = \"Moving\", transition = \"lost\", program = \"guard\", phase = 1, cpu_ns = 17627 }";
        let (event, name) = read(line);
        assert_eq!(event.time, 1_795_402_383_698_441_889);
        assert_eq!(
            (event.process, event.process_id, event.thread),
            (b"vm:(18040)".as_slice(), Some(17723), 17726)
        );
        assert_eq!((event.cpu, event.is_end, event.cpu_ns), (Some(1), true, 17627));
        let expected = SpanName {
            kind: SpanKind::Program,
            key: "lib.Pilot/Moving.lost.guard".to_owned(),
            instance: "p".to_owned(),
        };
        assert_eq!(name, expected);
    }

    #[test]
    fn a_period_has_the_scheduling_of_its_thread() {
        let period = |rest: &str| {
            let line = format!(
                "[1.000000000] mauve_x:component: {{ vtid = 3 }}, {{ instance = \"a\", phase = {rest} }}"
            );
            read(&line).0.scheduling
        };
        let found = Scheduling { priority: 42, cpus: 6 };
        assert_eq!(period("0, cpu_ns = 5, priority = 42, cpus = 6"), Some(found));
        assert_eq!(period("0, cpu_ns = 5, priority = -1, cpus = 0"), None);
        assert_eq!(period("0, cpu_ns = 5"), None);
        assert_eq!(period("1, cpu_ns = 5, priority = 42, cpus = 6"), None);
    }

    #[test]
    fn codels_have_waits_and_locks_have_both_ends() {
        let line = |event: &str, fields: &str| {
            format!("[1.000000000] mauve_x:{event}: {{ vtid = 3 }}, {{ {fields} }}")
        };
        let codel = "instance = \"a\", codel = \"f\", phase = 1, cpu_ns = 5";
        assert_eq!(read(&line("codel", &format!("{codel}, waits = 7"))).0.waits, Some(7));
        // Of an earlier version.
        assert_eq!(read(&line("codel", codel)).0.waits, None);
        let access = line("access", "instance = \"a\", port = \"lib.C.p\", phase = 0, cpu_ns = 5");
        let (event, name) = read(&access);
        assert_eq!(
            (event.is_end, name.key.as_str(), name.kind),
            (false, "(access) lib.C.p", SpanKind::Access)
        );
        let lock = "instance = \"-\", lock = \"bus\", phase = 1, cpu_ns = 5, elapsed_ns = 9, blocked_ns = 4, waits = 1";
        let lock = line("lock", lock);
        let (event, name) = read(&lock);
        assert_eq!((event.cpu_ns, event.lock, event.waits), (5, Some((9, 4)), Some(1)));
        assert_eq!(name.key, "bus");
        assert_eq!(parse(lock.replace("blocked_ns", "other").as_bytes()), BabeltraceLine::Malformed);
    }

    #[test]
    fn programs_have_the_keys_of_timing_tables() {
        for (state, transition, program, key) in [
            ("-", "-", "update", "C/update"),
            ("-", "reset", "operation", "C/reset"),
            ("S", "-", "run", "C/S.run"),
            ("S", "t", "effect", "C/S.t.effect"),
        ] {
            assert_eq!(program_key("C", state, transition, program), key);
        }
    }

    #[test]
    fn contexts_are_optional_and_in_any_order() {
        let (event, name) = read(
            "[0.000000007] mauve_x:codel: { vtid = 3, x = { a = \"}\", b = [ 1, 2 ] } }, { instance = \"a\\\\b\\'\", codel = \"f\", phase = 0, cpu_ns = 0 }",
        );
        assert_eq!(
            (event.time, event.process, event.process_id, event.thread, event.cpu),
            (7, b"".as_slice(), None, 3, None)
        );
        assert_eq!(name.instance, "a\\b'");
    }

    #[test]
    fn other_lines_are_told_apart() {
        for (line, expected) in [
            ("[1.000000000] vm lttng_ust_statedump:start: { cpu_id = 1 }, { }", BabeltraceLine::Foreign),
            ("[1.000000000] vm mauve_x:other: { cpu_id = 1 }, { }", BabeltraceLine::Foreign),
            (
                "[1.000000000] vm mauve_x:codel: { cpu_id = 1 }, { instance = \"a\", codel = \"f\", phase = 0, cpu_ns = 1 }",
                BabeltraceLine::WithoutThread,
            ),
            ("", BabeltraceLine::Malformed),
            ("[??:??:??.?????????] vm a:b: { }", BabeltraceLine::Malformed),
            (
                "[1.000000000] vm mauve_x:codel: { vtid = 1 }, { instance = \"a\", codel = \"f\", phase = 2, cpu_ns = 1 }",
                BabeltraceLine::Malformed,
            ),
            (
                "[1.000000000] vm mauve_x:codel: { vtid = 1 }, { instance = \"a\", codel = \"f",
                BabeltraceLine::Malformed,
            ),
        ] {
            assert_eq!(parse(line.as_bytes()), expected, "{line}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            parse(&bytes);
        }

        #[test]
        fn any_damage_is_read_without_a_panic(
            at in 0_usize..180, length in 0_usize..20, with in "[\\[\\]{}\", =\\\\0-9a]{0,6}",
        ) {
            let line = "[1795402383.698441889] vm mauve_x:codel: { cpu_id = 0 }, { vtid = 17726, vpid = 17723 }, { instance = \"a\", codel = \"lib.work\", phase = 0, cpu_ns = 19229 }";
            let mut damaged = line.to_owned();
            let at = at.min(line.len());
            damaged.replace_range(at..(at + length).min(line.len()), &with);
            if let BabeltraceLine::Event(event) = parse(damaged.as_bytes()) {
                name(event.kind, event.text);
            }
        }
    }
}
