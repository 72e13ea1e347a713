//! The fields of an activity, each written down once: what its value is, what it means, and what holds without it.
//!
//! The grammar has the names ([`ActivityField`]). Reading a value, completion, hovers, the messages and the order of fields
//! follow the table; `diagnostics/tests/tables.rs` writes the lists of the highlighters and the table of the reference from it.

use mauve_syntax::keywords::{ActivityField, BACKGROUND};
use mauve_timing::{CpuSet, Needs, Order, Rounding, Time, TimeError, Unit};

use crate::item_tree::{BinaryOperator, Expr, Field, Literal, Name, NameRef, SourceId, UnaryOperator};
use crate::values::whole_number;

/// A field of an activity.
#[derive(Debug)]
pub struct FieldEntry {
    /// Its name.
    pub field: ActivityField,
    /// Its valid values.
    pub kind: FieldKind,
    /// What holds without the field; `None` if an activity must have it.
    pub default: Option<&'static str>,
    /// Whether it has an effect on real-time activities only.
    pub only_real_time: bool,
    /// The other names that newcomers give it.
    pub other_names: &'static [&'static str],
    /// A valid value.
    pub example: &'static str,
    /// The values in a few words, for a list.
    pub values: &'static str,
    /// What it means, in sentences.
    pub meaning: &'static str,
}

/// The valid values of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldKind {
    /// A bit for each CPU.
    Cpus,
    /// A list of CPUs, or the name of a set of `mauve.toml`.
    CpuList,
    /// 1 to 99, or `background`.
    Priority,
    /// A time in milliseconds, rounded up.
    Time,
    /// A time in milliseconds greater than 0, rounded down.
    PositiveTime,
    /// A number of releases per second.
    Rate,
    /// A number of releases.
    Count,
    /// The name of an input port, or `any` or `all` with a list of some.
    Ports,
    /// A list of instances.
    Instances,
    /// The name of a thread: any; or the id of a thread of `[platform] threads`, as a text.
    Thread,
    /// `fifo`, `any` or `rounds`.
    Order,
    /// `true` or `false`.
    Truth,
}

/// The value of a field.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs, reason = "see `FieldKind`")]
pub enum FieldValue {
    Cpus(CpuSet),
    CpuSet(NameRef),
    Priority(u32),
    Background,
    /// A time, and whether it is exact.
    Time(Time, bool),
    Count(u32),
    Ports(Vec<NameRef>, Needs),
    Instances,
    Thread(Name),
    DeclaredThread(Name),
    Order(Order),
    Truth(bool),
}

/// The greatest number of ports that release an activity: a release notes each in a bit of one word.
const MOST_TRIGGERS: usize = 64;

/// The greatest number of releases in a period.
pub const GREATEST_BURST: u32 = 1000;

/// The fields, in the order in which an activity usually has them.
#[rustfmt::skip] // rustfmt would put each field of an entry on its own line.
pub static ACTIVITY_FIELDS: [FieldEntry; ActivityField::ALL.len()] = [
    FieldEntry { field: ActivityField::Instances, kind: FieldKind::Instances, default: Some("the instance of its name"), only_real_time: false,
        other_names: &["instance", "components", "tasks"], example: "[imu, gps]",
        values: "the instances that one thread executes in order, such as [imu, gps]",
        meaning: "The instances that the activity executes in its thread, one after another in each period, such as `[imu, gps]`. \
                  Its name is any." },
    FieldEntry { field: ActivityField::Thread, kind: FieldKind::Thread, default: Some("a thread of its own"), only_real_time: true,
        other_names: &["group", "callback_group", "executor", "queue", "work_queue"], example: "control",
        values: "the name of the thread that executes it, and other activities with this thread",
        meaning: "The thread that executes the activity, and all others with a thread of this name: one job after another, each with \
                  the releases of its own activity, such as the callbacks of an executor. They have one priority and the same CPUs. \
                  A text is the id of a callback group, or the name of another thread, in the files of `[platform] threads`: its priority and its \
                  CPUs are written there. Of the callbacks of a group, those suffice that no other one of the node has: \
                  `\"/nav@Timer(100000000)\"`." },
    FieldEntry { field: ActivityField::Order, kind: FieldKind::Order, default: Some("`fifo`"), only_real_time: true,
        other_names: &["policy", "scheduling"], example: "any",
        values: "the order of the jobs in the thread: fifo, any, or rounds",
        meaning: "The order in which the thread executes the jobs of its activities: `fifo`, the job that was released first; `any`; or \
                  `rounds`, one job of each activity that has one, those without a trigger first, and then again, as the \
                  `SingleThreadedExecutor` of rclcpp. Only with `thread`." },
    FieldEntry { field: ActivityField::Affinity, kind: FieldKind::Cpus, default: Some("any CPU"), only_real_time: false,
        other_names: &["cpu", "core", "cores", "mask"], example: "1",
        values: "the CPUs as a mask: 1 is CPU 1, 2 is CPU 2, 3 is both",
        meaning: "The CPUs on which the activity may run, as a bit mask: 1 is CPU 1, 2 is CPU 2, 3 is both, 4 is CPU 3. With 0, \
                  or without affinity: any CPU." },
    FieldEntry { field: ActivityField::Cpus, kind: FieldKind::CpuList, default: Some("what `affinity` says"), only_real_time: false,
        other_names: &["cpuset", "cpu_set"], example: "[1, 2]",
        values: "the CPUs as a list, such as [1, 2], or a set of mauve.toml",
        meaning: "The CPUs on which the activity may run, as a list, such as `[1, 2]`, or as the name of a set of \
                  `[platform.cpu_sets]` in mauve.toml; instead of `affinity`." },
    FieldEntry { field: ActivityField::Priority, kind: FieldKind::Priority, default: None, only_real_time: false,
        other_names: &["prio"], example: "10",
        values: "1 to 99, the highest is 99; or background",
        meaning: "The priority of the activity, from 1 (lowest) to 99 (highest), or `background`. An activity preempts all \
                  activities of lower priority on its CPU." },
    FieldEntry { field: ActivityField::Preemptive, kind: FieldKind::Truth, default: Some("`true`"), only_real_time: true,
        other_names: &["preemptible", "preempt"], example: "false",
        values: "whether a job that has begun may be preempted: true or false",
        meaning: "Whether other activities may preempt a job that has begun. With `false`, it has priority 99 until its end, such as a \
                  frame on a bus. The activity runs on one CPU then, and its codels wait for nothing." },
    FieldEntry { field: ActivityField::Trigger, kind: FieldKind::Ports, default: Some("its clock"), only_real_time: false,
        other_names: &["event", "event_port", "on", "port"], example: "scan",
        values: "the input port whose data releases it, or any or all of several: any [scan, odometry]",
        meaning: "The input port of the instance whose data releases the activity, instead of a clock: `scan`; the first data at \
                  one of several ports: `any [scan, odometry]`; or data at each of them: `all [left, right]`." },
    FieldEntry { field: ActivityField::Least, kind: FieldKind::PositiveTime, default: Some("what `period` says"), only_real_time: false,
        other_names: &["min", "gap", "interarrival"], example: "30",
        values: "the least time between two releases by data, in milliseconds",
        meaning: "The least time between two releases by data in milliseconds, which generated code enforces. Data that arrives \
                  earlier releases the activity at its end. Only with `trigger`." },
    FieldEntry { field: ActivityField::Period, kind: FieldKind::PositiveTime, default: None, only_real_time: false,
        other_names: &[], example: "100",
        values: "in milliseconds",
        meaning: "The period of the activity in milliseconds, such as `100`, `2.5` or `1000/30`: the time between two releases." },
    FieldEntry { field: ActivityField::Rate, kind: FieldKind::Rate, default: Some("what `period` says"), only_real_time: false,
        other_names: &["frequency", "freq", "hz"], example: "30 Hz",
        values: "releases per second, such as 30 Hz, instead of a period",
        meaning: "The number of releases per second, such as `30 Hz`, instead of the period; the period is rounded down to a \
                  nanosecond." },
    FieldEntry { field: ActivityField::Burst, kind: FieldKind::Count, default: Some("1"), only_real_time: false,
        other_names: &[], example: "3",
        values: "the greatest number of releases by data in a period",
        meaning: "The greatest number of releases by data in any time of the length of `least`, `period` or `rate`, from 1 to \
                  1000. Only with `trigger`." },
    FieldEntry { field: ActivityField::Deadline, kind: FieldKind::PositiveTime, default: Some("the period"), only_real_time: true,
        other_names: &["dl"], example: "50",
        values: "in milliseconds",
        meaning: "The deadline of the activity in milliseconds after its release. It may exceed the period: late jobs queue. \
                  Without a deadline, the period is the deadline." },
    FieldEntry { field: ActivityField::Jitter, kind: FieldKind::Time, default: Some("0"), only_real_time: true,
        other_names: &[], example: "0.5",
        values: "in milliseconds",
        meaning: "The release jitter of the activity in milliseconds: a release may be late by as much. The response time \
                  counts from the nominal release. Without jitter: 0." },
    FieldEntry { field: ActivityField::Offset, kind: FieldKind::Time, default: Some("0"), only_real_time: true,
        other_names: &[], example: "2",
        values: "in milliseconds, less than the period; only with a synchronised clock",
        meaning: "The offset of the activity in milliseconds, less than the period: the distance of its releases from the \
                  multiples of the period. Has an effect only if `[clocks] synchronised` in mauve.toml names the instance. \
                  Without offset: 0." },
];

/// Pairs of fields that an activity cannot have together: both say the same, or the second one has no meaning beside the first.
pub const EXCLUSIVE_FIELDS: [[ActivityField; 2]; 7] = [
    [ActivityField::Affinity, ActivityField::Cpus],
    [ActivityField::Period, ActivityField::Rate],
    [ActivityField::Least, ActivityField::Period],
    [ActivityField::Least, ActivityField::Rate],
    [ActivityField::Trigger, ActivityField::Offset],
    [ActivityField::Trigger, ActivityField::Instances],
    [ActivityField::Thread, ActivityField::Instances],
];

/// The fields that only an activity with another field has, each with that one.
pub const DEPENDENT_FIELDS: [[ActivityField; 2]; 3] = [
    [ActivityField::Least, ActivityField::Trigger],
    [ActivityField::Burst, ActivityField::Trigger],
    [ActivityField::Order, ActivityField::Thread],
];

/// The fields that say the time between two releases.
pub const PERIODS: [ActivityField; 3] = [ActivityField::Period, ActivityField::Rate, ActivityField::Least];

/// The fields that say where an activity may run.
pub const PLACES: [ActivityField; 2] = [ActivityField::Affinity, ActivityField::Cpus];

/// Returns the entry of a field.
pub fn field_entry(field: ActivityField) -> &'static FieldEntry {
    &ACTIVITY_FIELDS[field as usize]
}

/// Returns the field that an unknown name is probably meant for.
pub fn similar_field(name: &str) -> Option<ActivityField> {
    let renamed = ACTIVITY_FIELDS.iter().find(|it| it.other_names.contains(&name)).map(|it| it.field);
    renamed.or_else(|| ActivityField::from_keyword(mauve_syntax::similar(name, ActivityField::KEYWORDS)?))
}

/// Returns the fields that say the same as this one, with itself: an activity has one of them.
pub fn same_fields(field: &ActivityField) -> &[ActivityField] {
    let sets = [PERIODS.as_slice(), PLACES.as_slice()];
    sets.into_iter().find(|set| set.contains(field)).unwrap_or(std::slice::from_ref(field))
}

/// Why a field cannot have a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum InvalidValue {
    /// It is not of the kind of the field.
    OtherKind(FieldKind),
    /// It is no list, as this text is.
    NoList(FieldKind, Name),
    /// It is a list of CPUs and no mask; with the name of the field.
    NoMask(SourceId),
    /// It is not less than this period.
    NotBelow(Time),
    /// It exceeds the period of the thread in its file.
    AbovePeriod(Time),
    /// It is not a time.
    NoTime(NoTime),
    /// The files of `[platform] threads` have no thread of this id; with a similar id.
    UnknownThread(Name, Option<Name>),
    /// The thread of the activity has the value, in a file of `[platform] threads`.
    OfThread,
    /// `mauve.toml` has no CPU set of this name; with a similar name.
    UnknownCpuSet(Name, Option<Name>),
    /// Its CPUs are numbered from 0.
    CpuZero,
    /// The shell, of this name, has no input port of this name; with a similar name.
    NoInputPort(Name, Name, Option<Name>),
}

/// Why a value is not a time in milliseconds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoTime {
    /// It is an integer that exceeds INT.
    TooLarge(Name),
    /// It is in hexadecimal.
    Hexadecimal,
    /// It is negative.
    Negative,
    /// It is an expression.
    NotALiteral,
    /// It cannot be read.
    Unreadable(TimeError),
}

impl FieldKind {
    /// Returns the valid values in words.
    pub fn expected(self) -> &'static str {
        match self {
            FieldKind::Cpus => "a bit mask of CPUs: 1 is CPU 1, 2 is CPU 2, 3 is both",
            FieldKind::CpuList => {
                "a list of CPUs from 1 to 128, such as `[1, 2]`, or the name of a CPU set of mauve.toml"
            }
            FieldKind::Priority => "a whole number from 1 to 99, or `background`",
            FieldKind::Time => "a time in milliseconds",
            FieldKind::PositiveTime => "a time in milliseconds greater than 0",
            FieldKind::Rate => "a number of releases per second greater than 0, such as `30 Hz`",
            FieldKind::Count => "a whole number from 1 to 1000",
            FieldKind::Ports => {
                "the name of an input port, or `any` or `all` with a list of some, such as `any [scan, odometry]`"
            }
            FieldKind::Instances => "a list of instances, such as `[imu, gps]`",
            FieldKind::Thread => "the name of a thread, or its id in `[platform] threads` as a text",
            FieldKind::Order => "`fifo`, `any` or `rounds`",
            FieldKind::Truth => "`true` or `false`",
        }
    }

    /// Returns whether the values are times.
    pub fn is_time(self) -> bool {
        matches!(self, FieldKind::Time | FieldKind::PositiveTime)
    }

    /// Reads the value of a field.
    ///
    /// # Errors
    ///
    /// A field of this kind cannot have the value.
    pub fn read(self, Field { name, value, list, word, .. }: &Field) -> Result<FieldValue, InvalidValue> {
        let found = match (self, list) {
            (FieldKind::Ports, Some(list)) => ports(list, word.as_deref()),
            _ if word.is_some() => None,
            (FieldKind::CpuList, Some(list)) => cpus(list)?.map(FieldValue::Cpus),
            (FieldKind::CpuList, None) => match integer(value) {
                Some(cpu) => return Err(InvalidValue::NoList(self, format!("[{cpu}]").into())),
                None => value.as_name().cloned().map(FieldValue::CpuSet),
            },
            (FieldKind::Instances, Some(list)) => {
                let are_names = !list.is_empty() && list.iter().all(|it| it.as_name().is_some());
                are_names.then_some(FieldValue::Instances)
            }
            (FieldKind::Instances, None) => {
                let wrong = |it: &NameRef| Err(InvalidValue::NoList(self, format!("[{}]", it.name).into()));
                value.as_name().map_or(Ok(None), wrong)?
            }
            (FieldKind::Cpus, Some(_)) => return Err(InvalidValue::NoMask(name.id)),
            (_, Some(_)) => None,
            (FieldKind::Cpus, _) => affinity(value).map(FieldValue::Cpus),
            (FieldKind::Priority, _) => match (value, integer(value)) {
                (Expr::Name(it), _) if it.name == BACKGROUND => Some(FieldValue::Background),
                (_, Some(priority @ 1..=99)) => Some(FieldValue::Priority(priority)),
                _ => None,
            },
            (FieldKind::Count, _) => {
                integer(value).filter(|it| (1..=GREATEST_BURST).contains(it)).map(FieldValue::Count)
            }
            (FieldKind::Ports, _) => {
                value.as_name().map(|port| FieldValue::Ports(vec![port.clone()], Needs::Any))
            }
            (FieldKind::Time, _) => Some(time(value, Rounding::Up).map_err(InvalidValue::NoTime)?),
            (FieldKind::PositiveTime, _) => {
                Some(time(value, Rounding::Down).map_err(InvalidValue::NoTime)?).filter(is_positive)
            }
            (FieldKind::Rate, _) => period_of(value).filter(is_positive),
            (FieldKind::Thread, _) => match value {
                Expr::Literal(Literal::String(id), _) => Some(FieldValue::DeclaredThread(id.clone())),
                _ => value.as_name().map(|it| FieldValue::Thread(it.name.clone())),
            },
            (FieldKind::Order, _) => value.as_name().and_then(|it| order(&it.name)),
            (FieldKind::Truth, _) => match value {
                Expr::Literal(Literal::Bool(truth), _) => Some(FieldValue::Truth(*truth)),
                _ => None,
            },
        };
        found.ok_or(InvalidValue::OtherKind(self))
    }
}

fn order(word: &str) -> Option<FieldValue> {
    match word {
        "fifo" => Some(FieldValue::Order(Order::Fifo)),
        "any" => Some(FieldValue::Order(Order::Any)),
        "rounds" => Some(FieldValue::Order(Order::Rounds)),
        _ => None,
    }
}

fn is_positive(value: &FieldValue) -> bool {
    matches!(value, FieldValue::Time(time, _) if *time > Time::ZERO)
}

/// Returns the ports of `any [scan, odometry]`, each once; `None` where it is no such list.
fn ports(list: &[Expr], word: Option<&str>) -> Option<FieldValue> {
    let needs = match word? {
        "any" => Needs::Any,
        "all" => Needs::All,
        _ => return None,
    };
    let mut ports: Vec<NameRef> = Vec::new();
    for port in list {
        let port = port.as_name()?;
        if !ports.iter().any(|it| it.name == port.name) {
            ports.push(port.clone());
        }
    }
    (1..=MOST_TRIGGERS).contains(&ports.len()).then_some(FieldValue::Ports(ports, needs))
}

/// Returns the CPUs in a list of numbers; `None` where it is no such list.
fn cpus(list: &[Expr]) -> Result<Option<CpuSet>, InvalidValue> {
    let numbers: Vec<Option<u32>> = list.iter().map(integer).collect();
    if numbers.contains(&Some(0)) {
        return Err(InvalidValue::CpuZero);
    }
    let cpu = |number: Option<u32>| {
        number.filter(|it| (1..=CpuSet::MOST).contains(it)).map(|it| CpuSet::of(it - 1))
    };
    let cpus: Option<CpuSet> = numbers.into_iter().map(cpu).collect();
    Ok(cpus.filter(|_| !list.is_empty()))
}

/// Returns the CPUs that an affinity names; `None` where `value` is not a literal of at most 128 bits, more than other integers
/// have.
fn affinity(value: &Expr) -> Option<CpuSet> {
    let Expr::Literal(Literal::Int(text), _) = value else { return None };
    let bits = match text.strip_prefix("0x").or(text.strip_prefix("0X")) {
        Some(digits) => u128::from_str_radix(digits, 16),
        None => text.parse(),
    };
    bits.ok().map(CpuSet)
}

/// Returns the text of a number without a sign.
pub fn number(value: &Expr) -> Option<&Name> {
    match value {
        Expr::Literal(Literal::Int(text) | Literal::Float(text), _) => Some(text),
        _ => None,
    }
}

fn integer(value: &Expr) -> Option<u32> {
    let Expr::Literal(Literal::Int(text), _) = value else { return None };
    u32::try_from(whole_number(text)?).ok()
}

/// Reads a number of milliseconds, or a quotient of two numbers, rounded to a nanosecond.
fn time(value: &Expr, rounding: Rounding) -> Result<FieldValue, NoTime> {
    let Expr::Binary(BinaryOperator::Divide, above, below, _) = value else {
        let text = decimal(value)?;
        let time = Time::parse(text, Unit::Milliseconds, Rounding::Exact).map_err(NoTime::Unreadable)?;
        return Ok(FieldValue::Time(time, true));
    };
    quotient(decimal(above)?, decimal(below)?, Unit::Milliseconds, rounding)
}

/// Returns the period of a rate: of `100/3`, three hundredths of a second.
fn period_of(rate: &Expr) -> Option<FieldValue> {
    let (above, below) = match rate {
        Expr::Binary(BinaryOperator::Divide, above, below, _) => (decimal(above).ok()?, decimal(below).ok()?),
        rate => (decimal(rate).ok()?, "1"),
    };
    quotient(below, above, Unit::Seconds, Rounding::Down).ok()
}

fn quotient(above: &str, below: &str, unit: Unit, rounding: Rounding) -> Result<FieldValue, NoTime> {
    let read = |rounding| Time::quotient(above, below, unit, rounding);
    let time = read(rounding).map_err(NoTime::Unreadable)?;
    Ok(FieldValue::Time(time, read(Rounding::Exact).is_ok()))
}

/// Returns the text of a decimal number.
fn decimal(value: &Expr) -> Result<&str, NoTime> {
    if let Expr::Literal(Literal::Int(text), _) = value {
        if integer(value).is_none() {
            return Err(NoTime::TooLarge(text.clone()));
        }
        if text.starts_with("0x") || text.starts_with("0X") {
            return Err(NoTime::Hexadecimal);
        }
    }
    let not_a_number = match value {
        Expr::Unary(UnaryOperator::Minus, ..) => NoTime::Negative,
        _ => NoTime::NotALiteral,
    };
    number(value).map(Name::as_str).ok_or(not_a_number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_field_has_its_entry() {
        for field in ActivityField::ALL {
            assert_eq!(field_entry(field).field, field);
        }
    }

    /// Reads the field of an activity.
    fn read(field: &str) -> Result<FieldValue, InvalidValue> {
        let db = crate::Database::default();
        let text = format!("deployment D {{ activity a {{ {field} }} }}");
        let workspace = crate::Workspace::of_texts(&db, "/".into(), [("/a.mal".into(), text)]);
        let of = crate::declarations(&db, workspace.files(&db).values().next().copied().unwrap()).all[0];
        let activity = &crate::deployment(&db, of).unwrap().activities[0];
        let kind = field_entry(ActivityField::from_keyword(&activity.fields[0].name.name).unwrap()).kind;
        kind.read(&activity.fields[0])
    }

    #[test]
    fn each_example_is_valid() {
        for FieldEntry { field, example, .. } in &ACTIVITY_FIELDS {
            let text = format!("{} = {example}", field.keyword());
            assert!(read(&text).is_ok(), "{text}");
        }
    }

    #[test]
    fn rates_and_quotients_are_rounded_to_the_safe_side() {
        let time = |text: &str| match read(text) {
            Ok(FieldValue::Time(time, is_exact)) => (time.as_nanos(), is_exact),
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!(time("rate = 30 Hz"), (33_333_333, false));
        assert_eq!(time("rate = 40"), (25_000_000, true));
        assert_eq!(time("rate = 12.5 Hz"), (80_000_000, true));
        assert_eq!(time("rate = 100/3 Hz"), (30_000_000, true));
        assert_eq!(time("period = 1000/30"), (33_333_333, false));
        assert_eq!(time("least = 50/7"), (7_142_857, false));
        assert_eq!(time("deadline = 2/3"), (666_666, false));
        // An earlier deadline and a greater jitter are the safe sides.
        assert_eq!(time("jitter = 2/3"), (666_667, false));
        assert_eq!(time("jitter = 0/3"), (0, true));
    }

    #[test]
    fn invalid_values() {
        for text in ["rate = 0 Hz", "rate = 2000000000.0 Hz", "rate = [1]", "rate = 1 + 1", "rate = -3"] {
            assert_eq!(read(text), Err(InvalidValue::OtherKind(FieldKind::Rate)), "{text}");
        }
        for text in ["cpus = \"2\"", "cpus = []", "cpus = [129]", "cpus = [1, big]", "cpus = [1.5]"] {
            assert_eq!(read(text), Err(InvalidValue::OtherKind(FieldKind::CpuList)), "{text}");
        }
        assert_eq!(read("cpus = [1, 0]"), Err(InvalidValue::CpuZero));
        assert_eq!(read("cpus = [3, 1]"), Ok(FieldValue::Cpus(CpuSet(0b101))));
        assert!(matches!(read("affinity = [1]"), Err(InvalidValue::NoMask(_))));
        assert_eq!(read("cpus = 2"), Err(InvalidValue::NoList(FieldKind::CpuList, "[2]".into())));
        for text in ["instances = 1", "instances = []", "instances = [1]"] {
            assert_eq!(read(text), Err(InvalidValue::OtherKind(FieldKind::Instances)), "{text}");
        }
        for text in ["burst = 0", "burst = 1001", "burst = 1.5", "burst = all"] {
            assert_eq!(read(text), Err(InvalidValue::OtherKind(FieldKind::Count)), "{text}");
        }
        assert!(read("period = 1/0").is_err() && read("period = 1/1000000000").is_err());
    }
}
