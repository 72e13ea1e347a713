//! The threads of the callback-isolated executor of ROS 2: `threads.yaml`.
//!
//! ```yaml
//! rt_throttling: { runtime_us: 950000, period_us: 1000000 }
//! callback_groups:
//!   - id: /node@Timer(100000000)
//!     policy: SCHED_FIFO
//!     priority: 90
//!     affinity: [0]
//! non_ros_threads: []
//! ```
//!
//! Its readers, written by others: autowarefoundation/agnocast at 501e554b (the nice value is in `priority`), at 78036f67
//! (`nice`; `/node/*`), a later one (only decimal integers; `kernel_threads`, `irqs`), and
//! autowarefoundation/callback_isolated_executor at a3e5102e (a thread of `non_ros_threads` has an `id`, not a `name`). Each refuses the
//! whole file because of one wrong value. A value on which they disagree is unknown here, with a problem. They ignore unknown
//! keys, and keys of another policy: `priority` under `SCHED_OTHER` in the newer ones.

use std::ops::Range;

use mauve_timing::CpuSet;
use rustc_hash::{FxHashMap, FxHashSet};

use super::group_id::{GroupId, without_waitables};
use super::problem::{ExpectedValue, FileProblem, FileProblemKind};
use super::value::{ValueReader, YamlValue, cpus, is_null};
use super::yaml::{Lookup, NodeId, Yaml, parse};
use crate::completeness::Completeness;

/// A `threads.yaml`.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct ThreadsFile {
    /// `rt_throttling.runtime_us`: how long `SCHED_FIFO` and `SCHED_RR` may execute in a period, in microseconds; -1: always. Readers
    /// compare it with the setting of the kernel, and set nothing.
    pub throttling_runtime: YamlValue<i32>,
    /// `rt_throttling.period_us`, in microseconds.
    pub throttling_period: YamlValue<i32>,
    /// `callback_groups`, in the order of the file.
    pub groups: Vec<ThreadEntry>,
    /// `non_ros_threads`, in the order of the file.
    pub others: Vec<ThreadEntry>,
    /// What is wrong.
    pub problems: Vec<FileProblem>,
    /// Whether readers take the file, and read these values.
    pub completeness: Completeness,
}

/// A thread in a file, by its index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, salsa::SalsaValue)]
pub enum ThreadPlace {
    /// In `callback_groups` of a `threads.yaml`.
    Group(usize),
    /// In `non_ros_threads` of a `threads.yaml`.
    Other(usize),
    /// The control loop of a manager in a `controllers.yaml`.
    Manager(usize),
    /// An asynchronous controller in a `controllers.yaml`: the indices of its manager, and of the controller.
    Controller(usize, usize),
}

/// A thread of a callback group, or one without callbacks.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct ThreadEntry {
    /// The place of the entry, in bytes.
    pub range: Range<usize>,
    /// `id`, or `name`; never absent.
    pub id: YamlValue<String>,
    /// The id, if it is one of a callback group.
    pub group: Option<GroupId>,
    /// `domain_id` of a callback group; absent: that of the reader.
    pub domain: YamlValue<u32>,
    /// `policy`; never absent.
    pub policy: YamlValue<ThreadPolicy>,
    /// The priority from 1 to 99 of `SCHED_FIFO` and `SCHED_RR`, and the nice value from -20 to 19 of `SCHED_OTHER`, `SCHED_BATCH` and
    /// `SCHED_IDLE`; absent with `SCHED_DEADLINE`.
    pub level: YamlValue<i8>,
    /// `affinity`: Linux's CPUs, from 0. Absent, and the empty set (`[]`, `~`): the thread keeps the CPUs of its process.
    pub affinity: YamlValue<CpuSet>,
}

/// A scheduling policy of Linux.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum ThreadPolicy {
    /// `SCHED_OTHER`.
    Other,
    /// `SCHED_BATCH`.
    Batch,
    /// `SCHED_IDLE`.
    Idle,
    /// `SCHED_FIFO`.
    Fifo,
    /// `SCHED_RR`.
    RoundRobin,
    /// `SCHED_DEADLINE`.
    Deadline,
}

impl ThreadPolicy {
    /// All policies.
    pub const ALL: [ThreadPolicy; 6] = {
        use ThreadPolicy::{Batch, Deadline, Fifo, Idle, Other, RoundRobin};
        [Other, Batch, Idle, Fifo, RoundRobin, Deadline]
    };

    /// The names of [`ThreadPolicy::ALL`].
    pub const NAMES: [&'static str; 6] =
        ["SCHED_OTHER", "SCHED_BATCH", "SCHED_IDLE", "SCHED_FIFO", "SCHED_RR", "SCHED_DEADLINE"];

    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// Returns whether its threads have a priority.
    pub fn has_priority(self) -> bool {
        matches!(self, ThreadPolicy::Fifo | ThreadPolicy::RoundRobin)
    }

    /// Returns whether its threads have a nice value.
    pub fn has_nice(self) -> bool {
        matches!(self, ThreadPolicy::Other | ThreadPolicy::Batch | ThreadPolicy::Idle)
    }
}

const SECTIONS: [&str; 4] = ["callback_groups", "non_ros_threads", "rt_throttling", "hardware_info"];
/// Sections that only the newest readers have.
const UNREAD_SECTIONS: [&str; 2] = ["kernel_threads", "irqs"];
const KEYS: [&str; 8] = ["id", "policy", "priority", "nice", "affinity", "runtime", "period", "deadline"];

/// Reads a `threads.yaml`.
pub fn read_threads(text: &str) -> ThreadsFile {
    threads_of(&parse(text))
}

/// Reads the tree of a `threads.yaml`.
pub(super) fn threads_of(yaml: &Yaml) -> ThreadsFile {
    let mut reader = ValueReader { yaml, problems: Vec::new() };
    let mut file = ThreadsFile::default();
    if let Some(root) = yaml.root().filter(|root| !is_null(yaml, *root)) {
        if yaml.mapping(root).is_none() {
            reader.wrong_kind("", ExpectedValue::Mapping, yaml.range(root));
        }
        reader.unknown_keys(root, |key| SECTIONS.contains(&key) || UNREAD_SECTIONS.contains(&key));
        for name in UNREAD_SECTIONS {
            if let Lookup::Found(section) = yaml.find(root, name) {
                reader.problem(FileProblemKind::UnreadSection(name), yaml.range(section));
            }
        }
        if let Lookup::Found(section) = yaml.find(root, "rt_throttling")
            && yaml.mapping(section).is_none()
        {
            reader.wrong_kind("rt_throttling", ExpectedValue::Mapping, yaml.range(section));
        }
        file.throttling_runtime =
            reader.integer(root, "rt_throttling.runtime_us", -1..=i32::MAX.into(), false);
        file.throttling_period = reader.integer(root, "rt_throttling.period_us", 1..=i32::MAX.into(), false);
        file.groups = section(&mut reader, root, "callback_groups");
        file.others = section(&mut reader, root, "non_ros_threads");
    }
    (file.problems, file.completeness) = reader.finish(|_| true);
    file
}

/// Reads a list of threads; none if it is absent or null.
fn section(reader: &mut ValueReader<'_>, root: NodeId, name: &'static str) -> Vec<ThreadEntry> {
    let yaml = reader.yaml;
    // A doubt about the keys of the root is a problem of its own.
    let Lookup::Found(node) = yaml.find(root, name) else { return Vec::new() };
    if yaml.items(node).is_none() && !is_null(yaml, node) {
        reader.wrong_kind(name, ExpectedValue::List, yaml.range(node));
    }
    let is_group = name == "callback_groups";
    let items = yaml.items(node).unwrap_or_default();
    let entries: Vec<_> = items.iter().map(|item| entry(reader, *item, is_group)).collect();
    let mut seen: FxHashMap<&str, FxHashSet<Option<u32>>> = FxHashMap::default();
    for one in &entries {
        let YamlValue::Known { value: id, range } = &one.id else { continue };
        let domains = seen.entry(if is_group { without_waitables(id) } else { id }).or_default();
        let domain = one.domain.known().copied();
        // The domain of an entry without one is unknown: that of the reader.
        if domains.contains(&domain) || domains.contains(&None) || domain.is_none() && !domains.is_empty() {
            reader.problem(FileProblemKind::RepeatedId(id.clone()), range.clone());
        }
        domains.insert(domain);
    }
    entries
}

fn entry(reader: &mut ValueReader<'_>, item: NodeId, is_group: bool) -> ThreadEntry {
    let (yaml, range) = (reader.yaml, reader.yaml.range(item));
    if yaml.mapping(item).is_none() {
        reader.wrong_kind("", ExpectedValue::Mapping, range.clone());
    }
    let of_section = if is_group { "domain_id" } else { "name" };
    reader.unknown_keys(item, |key| key == of_section || KEYS.contains(&key));
    let has_name = !is_group && matches!(yaml.find(item, "name"), Lookup::Found(_));
    if has_name && yaml.find(item, "id") != Lookup::Absent {
        reader.problem(FileProblemKind::NameAndId, range.clone());
    }
    let id = reader.text(item, if has_name { "name" } else { "id" });
    let id = required(reader, id, if is_group { "id" } else { "name" }, &range);
    let group = id.known().filter(|_| is_group).and_then(|id| id.parse().ok());
    if let (YamlValue::Known { value, range }, None, true) = (&id, &group, is_group) {
        reader.problem(FileProblemKind::UnusualId(value.clone()), range.clone());
    }
    let domain = match is_group {
        true => reader.integer(item, "domain_id", 0..=u32::MAX.into(), false),
        false => YamlValue::Absent,
    };
    let policy = reader.named(item, "policy", (&ThreadPolicy::NAMES, &ThreadPolicy::ALL));
    let policy = required(reader, policy, "policy", &range);
    let level = match policy.known() {
        Some(policy) if policy.has_priority() => {
            let value = reader.integer(item, "priority", 1..=99, false);
            required(reader, value, "priority", &range)
        }
        Some(policy) if policy.has_nice() => nice(reader, item, &range),
        Some(_) => {
            deadline(reader, item, &range);
            YamlValue::Absent
        }
        None => YamlValue::Unknown(range.clone()),
    };
    let affinity = reader.value(item, "affinity", ExpectedValue::Cpus, |yaml, node| {
        if is_null(yaml, node) { Some(CpuSet::NONE) } else { cpus(yaml, node, false) }
    });
    ThreadEntry { range, id, group, domain, policy, level, affinity }
}

/// Reports wrong parameters of `SCHED_DEADLINE`, in nanoseconds.
fn deadline(reader: &mut ValueReader<'_>, item: NodeId, entry: &Range<usize>) {
    let values = ["runtime", "period", "deadline"].map(|key| {
        let value: YamlValue<i64> = reader.integer(item, key, 0..=i64::MAX, false);
        required(reader, value, key, entry)
    });
    if let [Some(runtime), Some(period), Some(deadline)] = values.each_ref().map(YamlValue::known)
        && !(1024 <= *runtime && runtime <= deadline && deadline <= period)
    {
        reader.problem(FileProblemKind::InvalidDeadline, entry.clone());
    }
}

/// Reports a value that is missing in the entry at this place: it is unknown, and not absent.
fn required<T>(
    reader: &mut ValueReader<'_>,
    value: YamlValue<T>,
    key: &'static str,
    entry: &Range<usize>,
) -> YamlValue<T> {
    if value.range().is_some() {
        return value;
    }
    reader.problem(FileProblemKind::MissingKey(key), entry.clone());
    YamlValue::Unknown(entry.clone())
}

/// Reads the nice value: newer readers want it in `nice`, older ones in `priority`.
fn nice(reader: &mut ValueReader<'_>, item: NodeId, entry: &Range<usize>) -> YamlValue<i8> {
    let mut nice = reader.integer(item, "nice", -20..=19, false);
    if nice.range().is_none() {
        nice = reader.integer(item, "priority", -20..=19, false);
        if let Some(range) = nice.range() {
            reader.problem(FileProblemKind::NiceInPriority, range.clone());
        }
    }
    required(reader, nice, "nice", entry)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "\
rt_throttling:
  runtime_us: 950000
  period_us: 1000000
callback_groups:
  - id: /cie_tutorial_node@Timer(100000000)
    policy: SCHED_FIFO
    priority: 90
    affinity: [0, 3]
  - {id: '/n@Timer(1)@Waitable', domain_id: 7, policy: \"SCHED_RR\", priority: '1', affinity: ~}
  - id: /cie_tutorial_node@Timer(1000000000)
    policy: SCHED_OTHER
    nice: -5
  - id: /n@Subscription(/t)
    policy: SCHED_DEADLINE
    runtime: 2000
    period: 5000000000
    deadline: 4000
non_ros_threads:
  - name: logger
    policy: SCHED_BATCH
    priority: 19
  - id: worker
    policy: SCHED_IDLE
    nice: 0
    affinity: []
";

    fn known<T: Clone>(value: &YamlValue<T>) -> T {
        value.known().expect("a value").clone()
    }

    #[test]
    fn threads_have_policies_levels_and_cpus() {
        let file = read_threads(FILE);
        let kinds: Vec<_> = file.problems.iter().map(|it| &it.kind).collect();
        assert_eq!(kinds, [&FileProblemKind::NiceInPriority]);
        assert!(file.completeness.is_complete());
        assert_eq!((known(&file.throttling_runtime), known(&file.throttling_period)), (950_000, 1_000_000));
        let [first, second, third, fourth] = file.groups.as_slice() else { panic!("{:?}", file.groups) };
        assert_eq!(known(&first.id), "/cie_tutorial_node@Timer(100000000)");
        assert_eq!(first.group.as_ref().unwrap().text().to_string(), known(&first.id));
        assert_eq!((known(&first.policy), known(&first.level)), (ThreadPolicy::Fifo, 90));
        assert_eq!(known(&first.affinity), CpuSet::of(0) | CpuSet::of(3));
        assert_eq!(&first.domain, &YamlValue::Absent);
        assert_eq!((known(&second.policy), known(&second.level)), (ThreadPolicy::RoundRobin, 1));
        assert_eq!((known(&second.affinity), known(&second.domain)), (CpuSet::NONE, 7));
        assert_eq!((known(&third.policy), known(&third.level)), (ThreadPolicy::Other, -5));
        assert_eq!(&third.affinity, &YamlValue::Absent);
        assert_eq!((known(&fourth.policy), &fourth.level), (ThreadPolicy::Deadline, &YamlValue::Absent));
        let [logger, worker] = file.others.as_slice() else { panic!("{:?}", file.others) };
        assert_eq!((known(&logger.id), known(&logger.level)), ("logger".to_owned(), 19));
        assert_eq!((known(&worker.id), known(&worker.level)), ("worker".to_owned(), 0));
        let source = |value: &YamlValue<i8>| &FILE[value.range().unwrap().clone()];
        assert_eq!([source(&first.level), source(&second.level)], ["90", "'1'"]);
        assert_eq!(&FILE[second.range.clone()][..4], "{id:");
        assert_eq!(&FILE[first.affinity.range().unwrap().clone()], "[0, 3]");
    }

    /// Reads a file with one group, and returns it with the kinds of problems.
    fn group(entry: &str) -> (ThreadEntry, Vec<FileProblemKind>, bool) {
        let file = read_threads(&format!("callback_groups:\n  - {entry}\n"));
        let kinds = file.problems.into_iter().map(|it| it.kind).collect();
        (file.groups.into_iter().next().unwrap(), kinds, file.completeness.is_complete())
    }

    #[test]
    fn wrong_values_are_unknown_and_never_absent() {
        for priority in [
            "0",
            "100",
            "-1",
            "090",
            "0x5A",
            "9.0",
            "high",
            "~",
            "",
            "[90]",
            "+9",
            "1_0",
            "!!int 9",
            "|\n      9",
        ] {
            let (entry, kinds, is_complete) =
                group(&format!("id: /n\n    policy: SCHED_FIFO\n    priority: {priority}"));
            let expected = ExpectedValue::Integer(1, 99);
            assert_eq!(
                kinds,
                [FileProblemKind::WrongKind { key: "priority".to_owned(), expected }],
                "{priority}"
            );
            assert!(matches!(entry.level, YamlValue::Unknown(_)) && !is_complete, "{priority}");
        }
        for affinity in ["0", "0-3", "[128]", "[-1]", "[0, x]", "[[0]]", "[01]", "{}", "'~'", "all"] {
            let (entry, kinds, is_complete) =
                group(&format!("{{id: /n, policy: SCHED_FIFO, priority: 9, affinity: {affinity}}}"));
            assert_eq!((kinds.len(), is_complete), (1, false), "{affinity}");
            assert!(matches!(entry.affinity, YamlValue::Unknown(_)), "{affinity}");
        }
        for entry in [
            "id: /n",
            "{id: /n, policy: SCHED_NORMAL, priority: 9}",
            "{id: /n, policy: [], priority: 9}",
            "text",
        ] {
            let (entry, kinds, is_complete) = group(entry);
            assert_eq!((kinds.len(), is_complete), (1, false));
            assert!(
                matches!(entry.policy, YamlValue::Unknown(_)) && matches!(entry.level, YamlValue::Unknown(_))
            );
        }
        for (entry, missing) in [
            ("{id: /n, policy: SCHED_RR, nice: 9}", "priority"),
            ("{id: /n, policy: SCHED_IDLE}", "nice"),
            ("{policy: SCHED_RR, priority: 9}", "id"),
            ("{id: /n, policy: SCHED_DEADLINE, runtime: 9999, period: 99999}", "deadline"),
        ] {
            let (_, kinds, is_complete) = group(entry);
            assert_eq!((kinds, is_complete), (vec![FileProblemKind::MissingKey(missing)], false), "{entry}");
        }
        let (_, kinds, _) =
            group("{id: /n, policy: SCHED_DEADLINE, runtime: 3000, period: 5000, deadline: 2000}");
        assert_eq!(kinds, [FileProblemKind::InvalidDeadline]);
        // A value of a key that is there twice.
        let (entry, kinds, _) = group("{id: /n, policy: SCHED_RR, priority: 9, priority: 8}");
        assert!(matches!(entry.level, YamlValue::Unknown(_)));
        assert_eq!(kinds, [FileProblemKind::RepeatedKey("priority".to_owned())]);
        let (entry, kinds, _) = group("{id: /n, policy: SCHED_RR, <<: {priority: 8}}");
        assert!(
            matches!(entry.level, YamlValue::Unknown(_)) && matches!(entry.affinity, YamlValue::Unknown(_))
        );
        assert_eq!(kinds, [FileProblemKind::UncertainKeys]);
    }

    #[test]
    fn keys_of_other_policies_and_unknown_keys_are_no_errors() {
        let (entry, kinds, is_complete) =
            group("{id: /n, policy: SCHED_OTHER, nice: 1, priority: 50, runtime: x, prio: 3, name: x}");
        let unknown = ["prio", "name"].map(|it| FileProblemKind::UnknownKey(it.to_owned()));
        assert_eq!((kinds, is_complete), (unknown.to_vec(), true));
        assert_eq!(entry.level.known(), Some(&1));
        let (entry, kinds, is_complete) = group("{id: my_group, policy: SCHED_RR, priority: 50, nice: 99}");
        assert_eq!((kinds, is_complete), (vec![FileProblemKind::UnusualId("my_group".to_owned())], true));
        assert_eq!(entry.level.known(), Some(&50));
        let (entry, kinds, _) = group("{id: /ns/n/*, policy: SCHED_RR, priority: 50}");
        assert!(kinds.is_empty() && entry.group.unwrap().is_wildcard());
    }

    #[test]
    fn an_id_has_one_entry() {
        let twice = |one: &str, other: &str| {
            let rest = "policy: SCHED_IDLE, nice: 0";
            let file = read_threads(&format!("callback_groups: [{{{one}, {rest}}}, {{{other}, {rest}}}]"));
            file.problems.iter().any(|it| matches!(it.kind, FileProblemKind::RepeatedId(_)))
        };
        assert!(twice("id: /n", "id: /n") && twice("id: /n", "id: /n@Waitable"));
        assert!(twice("id: /n, domain_id: 1", "id: /n") && twice("id: /n", "id: /n, domain_id: 1"));
        assert!(!twice("id: /n, domain_id: 1", "id: /n, domain_id: 2") && !twice("id: /n", "id: /m"));
        let file = read_threads("non_ros_threads:\n- {name: a, id: a, policy: SCHED_IDLE, nice: 0}\n");
        assert_eq!(
            file.problems.iter().map(|it| &it.kind).collect::<Vec<_>>(),
            [&FileProblemKind::NameAndId]
        );
    }

    #[test]
    fn sections_may_be_absent_or_null() {
        for text in [
            "",
            "# none\n",
            "~\n",
            "{}\n",
            "callback_groups:\nnon_ros_threads: ~\n",
            "hardware_info: {model: x}\n",
        ] {
            let file = read_threads(text);
            assert_eq!(
                (file.problems.len(), file.groups.len(), file.completeness.is_complete()),
                (0, 0, true),
                "{text}"
            );
        }
        for text in [
            "callback_groups: {}\n",
            "callback_groups: x\n",
            "rt_throttling: 1\n",
            "- a\n",
            "text",
            "callback_groups: []\n---\n",
        ] {
            let file = read_threads(text);
            assert_eq!((file.problems.len(), file.completeness.is_complete()), (1, false), "{text}");
        }
        let file = read_threads("kernel_threads: [{comm: x}]\ngroups: []\n");
        let kinds: Vec<_> = file.problems.into_iter().map(|it| it.kind).collect();
        let unknown = FileProblemKind::UnknownKey("groups".to_owned());
        assert_eq!(kinds, [FileProblemKind::UnreadSection("kernel_threads"), unknown]);
        assert!(file.completeness.is_complete());
    }

    #[test]
    fn what_is_before_a_syntax_error_is_read() {
        let file = read_threads(&format!("{FILE}  - id: [\n"));
        assert!(file.completeness.is_incomplete());
        assert_eq!(file.groups.len(), 4);
        assert_eq!(file.groups[0].level.known(), Some(&90));
        let file = read_threads(
            "callback_groups:\n  - id: /n\n    policy: SCHED_RR\n    priority: 3\n    affinity [0]\n    x: y\n",
        );
        assert!(file.completeness.is_incomplete());
        assert!(file.groups.iter().all(|it| it.affinity != YamlValue::Absent), "{file:?}");
        let file = read_threads("callback_groups: [{id: /n, policy: SCHED_RR, priority: 3, affinity: [0, ");
        assert!(matches!(file.groups[0].affinity, YamlValue::Unknown(_)), "{file:?}");
    }

    #[test]
    fn entries_may_be_shared_by_aliases() {
        let text = "x: &p 40\ncallback_groups:\n- &e {id: /a, policy: SCHED_RR, priority: *p}\nnon_ros_threads:\n- *e\n";
        let file = read_threads(text);
        assert_eq!((file.groups[0].level.known(), file.others[0].level.known()), (Some(&40), Some(&40)));
        assert_eq!(&text[file.groups[0].level.range().unwrap().clone()], "*p");
        assert_eq!(&text[file.others[0].range.clone()], "*e");
        // Entries by aliases are not copied without a limit.
        let text =
            format!("x: &l {{{}}}\ncallback_groups: [{}]\n", "k: 1, ".repeat(50_000), "*l, ".repeat(50_000));
        assert!(read_threads(&text).completeness.is_incomplete());
    }
}
