//! The keys of `mauve.toml`: their documentation, valid values, and fields of [`Config`]. The reader, completion, hovers and the JSON
//! schema (written by `tests/schemas.rs`) follow this table: a new key is one entry here.

use std::ops::Range;

use mauve_timing::toml_key::{ANY_NAME, TomlKey, ValueKind};
use mauve_timing::{CpuSet, Protocol, Time};

use super::cpp::is_cpp_type;
use super::value::SpannedValue;
use super::{
    Acceptance, Chain, ClockConfig, Config, CpuSetConfig, DeploymentConfig, DeploymentTables, ExternalType,
    HostConfig, LinkConfig, Located, LockConfig, OtherConfig, Required, Ros2Config, TopicConfig, is_header,
    maintainer_of,
};
use crate::activity_field::GREATEST_BURST;
use crate::severity::Severity;

/// A key of `mauve.toml`.
pub type Key = TomlKey<KeyKind>;

/// The field of the configuration that stores a value. A value in a table is stored in the last of its entries.
pub type ConfigField<V> = fn(&mut Config) -> &mut V;

/// CPUs, with their range in bytes.
pub type LocatedCpus = Option<(CpuSet, Range<usize>)>;

/// The valid values of a key, and the field that stores them.
pub enum KeyKind {
    /// A table, or a list of them.
    Table(KeyTable),
    /// The path of a model, or a list of them.
    Models(ConfigField<Vec<Located>>),
    /// The path of a timing table, or a list of them; a path may have wildcards.
    Tables(ConfigField<Vec<Located>>),
    /// The key of a codel, or a list of them.
    Codels(ConfigField<Vec<Located>>),
    /// A protocol of a lock.
    Protocol(ConfigField<Option<Protocol>>),
    /// The name of an instance, or a list of them.
    Instances(ConfigField<Vec<Located>>),
    /// A table of instances, each with a reason, or with a reason and the greatest response time.
    Reasons(ConfigField<Vec<Acceptance>>),
    /// The significance level.
    Level,
    /// A probability per mission.
    Required(ConfigField<Option<Required>>),
    /// A time with its unit.
    Time(ConfigField<Option<Time>>),
    /// A time greater than 0 with its unit, exact to the nanosecond.
    Period(ConfigField<Option<Time>>),
    /// A number of releases per second with its unit; stored as the time between two.
    Rate(ConfigField<Option<Time>>),
    /// A name, or also a list of them, each with so many parts, joined by points.
    Names {
        /// Stores them.
        store: fn(&mut Config, Vec<Located>),
        /// The least and the greatest number of parts.
        parts: (usize, usize),
        /// Whether it may be a list.
        is_list: bool,
        /// The valid values, as a predicate of the key.
        expected: &'static str,
        /// The suggestions of completion.
        suggestions: Suggestions,
    },
    /// A list of CPUs, numbered from 1; the field may need the key.
    Cpus(fn(&mut Config, Located) -> &mut LocatedCpus),
    /// A severity ([`SEVERITIES`]).
    Severity,
    /// An integer between two bounds, inclusive.
    Integer(u32, u32, ConfigField<Option<u32>>),
    /// `true` or `false`.
    Boolean(ConfigField<Option<bool>>),
    /// One of two words; the field is whether it is the second one.
    Either(&'static [&'static str; 2], ConfigField<bool>),
    /// The path of a folder.
    Folder(ConfigField<Option<Located>>),
    /// A string in a particular format.
    Text {
        /// Stores a string; `None` if it does not have the format.
        store: fn(&mut Config, Located) -> Option<()>,
        /// The valid values, as a predicate of the key.
        expected: &'static str,
        /// A regular expression for the schema, which may match more.
        pattern: &'static str,
        /// The suggestions of completion.
        usual: &'static [&'static str],
    },
}

/// A table of keys.
pub struct KeyTable {
    /// Its header with brackets, and what completion says of it; none if that of its names counts.
    pub header: Option<(&'static str, &'static str)>,
    /// Its keys.
    pub keys: &'static [Key],
    /// The keys that it must have; a `rate` counts as a `period`.
    pub required: &'static [&'static str],
    /// Two keys that exclude each other, and what a message says of the first one.
    pub(super) apart: Option<[&'static str; 3]>,
    /// Whether it is a list of tables, such as `[[platform.other]]`.
    pub is_list: bool,
    /// Adds an entry for a table with this name.
    pub(super) open: fn(&mut Config, Located),
    /// Stores a value that is no table; `None` if it is invalid.
    pub(super) otherwise: fn(&mut Config, Located, &SpannedValue<'_>) -> Option<()>,
    /// The valid values, as a predicate of the key; `{}` stands for its header.
    expected: &'static str,
}

/// A key without a default, examples and documentation: what the keys below have in common.
const KEY: Key =
    Key { name: ANY_NAME, kind: KeyKind::Severity, default: None, examples: "", documentation: "" };

/// A table without keys: what the tables below have in common.
const TABLE: KeyTable = KeyTable {
    header: None,
    keys: &[],
    required: &[],
    apart: None,
    is_list: false,
    open: |_, _| {},
    otherwise: |_, _, _| None,
    expected: "",
};

/// The severities of `[lints]`; `None` hides the diagnostic.
pub const SEVERITIES: [(&str, Option<Severity>); 4] = [
    ("allow", None),
    ("hint", Some(Severity::Hint)),
    ("warn", Some(Severity::Warning)),
    ("error", Some(Severity::Error)),
];

/// The sections, in the order of messages and completion.
#[rustfmt::skip] // rustfmt would put each field on its own line.
pub static SECTIONS: [Key; 14] = [
    Key { name: "project", kind: KeyKind::Table(KeyTable { header: Some(("[project]", "the roots of the models")), keys: &[
        Key { name: "root", kind: KeyKind::Models(|it| &mut it.roots), examples: r#"["robot.mal"]"#,
            documentation: "The model that includes all others, from the folder of mauve.toml.", ..KEY },
        Key { name: "roots", kind: KeyKind::Models(|it| &mut it.roots), examples: r#"[["robot.mal", "bench.mal"]]"#,
            documentation: "Several such models, each with its own project.", ..KEY },
    ], ..TABLE }), documentation: "What is looked at. Without it, every model that no other one includes is the root of a project.", ..KEY },
    Key { name: "timing", kind: KeyKind::Table(KeyTable { header: Some(("[timing]", "where execution times stand")), keys: &[
        Key { name: "tables", kind: KeyKind::Tables(|it| &mut it.tables), examples: r#"[["timing/*.toml"]]"#,
            documentation: "The timing tables, from the folder of mauve.toml; `*` stands for any part of a name.", ..KEY },
        Key { name: "observed", kind: KeyKind::Tables(|it| &mut it.observed), examples: r#"[["robot.observed.toml"]]"#,
            documentation: "What recordings showed, from the folder of mauve.toml: the files that `mauve trace import` writes \
                            beside the samples. A time that a recording refuted is an error until it is mended.", ..KEY },
        Key { name: "significance", kind: KeyKind::Level, default: Some("1e-4"), examples: "[1e-4]",
            documentation: "The significance level that is shown and checked: with which probability one execution of a codel \
                            may take longer than its time." },
        Key { name: "required", kind: KeyKind::Required(|it| &mut it.required), examples: r#"["1e-6 per hour", "1e-6 per 8 h"]"#,
            documentation: "The greatest probability that any execution of a mission of this length exceeds its time. It chooses the \
                            significance level of each deployment, instead of `significance`: with it, the number of executions of the mission \
                            times the level is at most this.", ..KEY },
        Key { name: "dependent", kind: KeyKind::Codels(|it| &mut it.dependent), examples: r#"[["navigation.astar"]]"#,
            documentation: "Codels, as in timing tables, whose execution time depends on that of earlier executions: probabilities of \
                            misses do not multiply theirs.", ..KEY },
        Key { name: "deployment",
            kind: KeyKind::Table(KeyTable {
                header: Some(("[timing.deployment.Name]", "a deployment's own timing tables")), expected: OF_DEPLOYMENT,
                keys: &[Key { kind: KeyKind::Table(KeyTable {
                    open: |it, (name, span)| it.deployment_tables.push(DeploymentTables { name, span, ..DeploymentTables::default() }),
                    expected: OF_DEPLOYMENT, keys: &DEPLOYMENT_TABLES, required: &["tables"], ..TABLE
                }), ..KEY }], ..TABLE
            }), examples: r#"[{ "Sea": { "tables": ["timing/sea/*.toml"] } }]"#,
                documentation: "Timing tables of one deployment, by its name: its times were measured on another computer. The \
                            deployment uses them instead of `tables`, and no other deployment does.", ..KEY },
    ], apart: Some(["required", "significance", BESIDE_SIGNIFICANCE]), ..TABLE }), documentation: "Execution times.", ..KEY },
    Key { name: "types", kind: KeyKind::Table(KeyTable { header: Some(("[types.Name]", "types that no message package declares")), keys: &[
        Key { kind: KeyKind::Table(KeyTable {
        open: |it, (name, _)| it.types.push(ExternalType { name: name.into(), ..ExternalType::default() }),
        expected: "is a section: `[{}]` with `cpp` and `header`", keys: &[
        Key { name: "cpp", kind: KeyKind::Text {
                store: |it, (text, _)| is_cpp_type(&text).then(|| last(&mut it.types).cpp = text),
                expected: r#"is a C++ type, such as "ArRobot*""#,
                pattern: "^[A-Za-z_:][A-Za-z0-9_:<>, *]*$", usual: &[],
            }, examples: r#"["ArRobot*"]"#, documentation: "The type in C++, and nothing else.", ..KEY },
        Key { name: "header", kind: KeyKind::Text {
                store: |it, (text, _)| is_header(&text).then(|| last(&mut it.types).header = Some(text)),
                expected: "is the relative path of a C++ header, such as \"Aria/Aria.h\"; no part of it begins with `.` or `-`",
                pattern: "^[A-Za-z0-9_+][A-Za-z0-9_+.-]*(/[A-Za-z0-9_+][A-Za-z0-9_+.-]*)*$", usual: &[],
            }, examples: r#"["Aria/Aria.h"]"#, documentation: "The header that declares it, as an #include names it.", ..KEY },
    ], ..TABLE }), ..KEY }], ..TABLE }), examples: r#"[{ "ArRobotPtr": { "cpp": "ArRobot*", "header": "Aria.h" } }]"#,
        documentation: "Types that no message package declares, and what they are in C++.", ..KEY },
    Key { name: "generate", kind: KeyKind::Table(KeyTable { header: Some(("[generate]", "where generated sources go")), keys: &[
        Key { name: "out", kind: KeyKind::Folder(|it| &mut it.out), examples: r#"["generated"]"#,
            documentation: "The folder that they go to.", ..KEY },
        Key { name: "ros_streams", kind: KeyKind::Boolean(|it| &mut it.ros_streams), default: Some("true"), examples: "[false]",
            documentation: "Are outputs of deployed components, and inputs that nothing is connected to, ROS topics too, \
                            instance/port? When left out, they are." },
        Key { name: "introspection", kind: KeyKind::Boolean(|it| &mut it.introspection), default: Some("true"),
            examples: "[false]",
            documentation: "Have components ports that show their state and their execution times? When left out, they have." },
        Key { name: "maintainer", kind: KeyKind::Text {
                store: |it, (text, _)| maintainer_of(&text).map(|maintainer| it.maintainer = Some(maintainer)),
                expected: r#"is a name and an address, such as "Ada Lovelace <ada@example.org>""#,
                pattern: r"^\s*[^<]*[^<\s][^<]*<\s*[A-Za-z0-9_%+.-]+@[A-Za-z0-9.-]*[.][A-Za-z0-9]{2,}\s*>\s*$",
                usual: &["Name <name@example.org>"],
            }, examples: r#"["Ada Lovelace <ada@example.org>"]"#, documentation: "Whom the packages name as their maintainer.", ..KEY },
        Key { name: "license", kind: KeyKind::Text {
                store: |it, (text, _)| (!text.trim().is_empty()).then(|| it.license = Some(text)),
                expected: r#"names a licence, such as "BSD""#,
                pattern: r"\S", usual: &["Apache-2.0", "BSD-3-Clause", "MIT"],
            }, examples: r#"["BSD-3-Clause"]"#, documentation: "The licence that the packages name.", ..KEY },
    ], ..TABLE }), documentation: "Generated sources: `mauve generate`.", ..KEY },
    Key { name: "lints", kind: KeyKind::Table(KeyTable { header: Some(("[lints]", "how bad a diagnostic is")), keys: &[
        Key { kind: KeyKind::Severity, ..KEY },
    ], ..TABLE }), examples: r#"[{ "lost-write": "error", "missing-else": "allow" }]"#,
        documentation: "How bad a diagnostic is here: \"error\", \"warn\", \"hint\", or \"allow\" not to show it at all.", ..KEY },
    Key { name: "assume", kind: KeyKind::Table(KeyTable { header: Some(("[assume]", "times that the tables lack")), keys: &[
        Key { name: "codel", kind: KeyKind::Time(|it| &mut it.assume), examples: r#"["5 ms", "250 us"]"#,
            documentation: "The execution time of every codel that no table has, with its unit: ns, us, ms or s.", ..KEY },
    ], ..TABLE }), documentation: "What is assumed where nothing is known; shown wherever it is used.", ..KEY },
    Key { name: "platform", kind: KeyKind::Table(KeyTable { header: Some(("[platform]", "what the programs run on")), keys: &[
        Key { name: "cpus", kind: KeyKind::Integer(1, CpuSet::MOST, |it| &mut it.cpus), examples: "[2]",
            documentation: "How many CPUs there are: those that an activity without an affinity may use. When left out, those \
                            that affinities name.", ..KEY },
        Key { name: "cpu_sets", kind: KeyKind::Table(KeyTable { header: Some(("[platform.cpu_sets]", "names of CPUs")),
            expected: "is a table of CPU sets, such as { big = [5, 6] }, with CPUs numbered from 1 to 128", keys: &[
                Key { kind: KeyKind::Cpus(cpus_of_set), ..KEY },
            ], ..TABLE }), examples: r#"[{ "big": [5, 6] }]"#, documentation: "Names of lists of CPUs, numbered from 1, which `cpus` of an \
                            activity may have.", ..KEY },
        Key { name: "threads", kind: KeyKind::Tables(|it| &mut it.threads), examples: r#"[["threads.yaml"]]"#,
            documentation: "The files that set up the threads of ROS 2, from the folder of mauve.toml: `threads.yaml` of the \
                            callback-isolated executor, `controllers.yaml` of ros2_control. An activity with `thread = \"ID\"` has the priority and the CPUs of this thread there.", ..KEY },
        Key { name: "rt_throttling", kind: KeyKind::Boolean(|it| &mut it.rt_throttling), examples: "[false]",
            documentation: "Does Linux keep 50 ms of each second from real-time tasks (kernel.sched_rt_runtime_us)? When left \
                            out, it does not, and that is shown as an assumption.", ..KEY },
        Key { name: "other",
            kind: KeyKind::Table(KeyTable {
                header: Some(("[[platform.other]]", "real-time work that is not in the model")), keys: &OTHER, is_list: true,
                open: |it, _| it.others.push(OtherConfig::default()), expected: "is a list of sections, such as `[[{}]]`",
                required: &["name", "priority", "period", "time"], apart: Some(["rate", "period", BESIDE_PERIOD]), ..TABLE
            }), examples: r#"[[{ "name": "network interrupt", "priority": 50, "period": "1 ms", "time": "50 us" }]]"#,
                documentation: "Real-time work that is not in the model, such as interrupt threads and drivers: it interferes with \
                            the activities of every deployment.", ..KEY },
    ], ..TABLE }), documentation: "The machine that the robot runs on.", ..KEY },
    Key { name: "clocks", kind: KeyKind::Table(KeyTable { header: Some(("[clocks]", "which releases keep their distance")), keys: &[
        Key { name: "synchronised", kind: KeyKind::Instances(|it| &mut it.synchronised), examples: r#"[["hokuyo", "p3dx_driver"]]"#,
            documentation: "Instances whose activities have one clock: each is released at its offset in every \
                            period, counted from one instant. Without this, the phases of their releases are unknown.", ..KEY },
        Key { name: "ptp", kind: KeyKind::Time(|it| &mut it.ptp), examples: r#"["20 us"]"#,
            documentation: "By how much the clocks of two hosts differ, at most, with its unit: ns, us, ms or s. It counts as jitter \
                            of activities whose clock spans hosts. Without it, no clock does.", ..KEY },
        Key { kind: KeyKind::Table(KeyTable {
            header: Some(("[clocks.Name]", "activities with a clock of their own")),
            open: |it, (name, span)| it.clocks.push(ClockConfig { name, span, ..ClockConfig::default() }),
            expected: "is a section: `[{}]` with `instances`", required: &["instances"], keys: &[
        Key { name: "instances", kind: KeyKind::Instances(|it| &mut last(&mut it.clocks).instances), examples: r#"[["camera", "tracker"]]"#,
            documentation: "Instances whose activities have this clock, as those of \
                            `synchronised` have theirs. Nothing is known of the phases of two clocks.", ..KEY },
        ], ..TABLE }), ..KEY },
    ], ..TABLE }), documentation: "Activities whose releases keep their distance; with a section for each further clock, such as \
                        [clocks.camera].", ..KEY },
    Key { name: "deployment", kind: KeyKind::Table(KeyTable { header: Some(("[deployment.Name]", "what is accepted of a deployment")), keys: &[
        Key { kind: KeyKind::Table(KeyTable {
        open: |it, (name, span)| it.deployments.push(DeploymentConfig { name, span, ..DeploymentConfig::default() }),
        expected: "is a section: `[{}]` with `accept` or `required`", keys: &[
        Key { name: "accept", kind: KeyKind::Reasons(|it| &mut last(&mut it.deployments).accepted),
            examples: r#"[{ "planner": "measured by hand" }, { "planner": { "until": "30 ms", "reason": "measured by hand" } }]"#,
            documentation: "Instances whose deadlines need no proof, each with the reason. `mauve check` does not fail for \
                            them, shows the reason, and never calls their deadlines met. With `until`, only while the response time is at \
                            most that long.", ..KEY },
        Key { name: "required", kind: KeyKind::Required(|it| &mut last(&mut it.deployments).required), examples: r#"["1e-9 per 8 h"]"#,
            documentation: "The same as `[timing] required`, for this deployment only.", ..KEY },
    ], ..TABLE }), ..KEY }], ..TABLE }), examples: r#"[{ "Sea": { "accept": { "planner": "measured by hand" } } }]"#,
        documentation: "What is accepted of a deployment, by its name.", ..KEY },
    Key { name: "locks", kind: KeyKind::Table(KeyTable { header: Some(("[locks.Name]", "locks that codels take")), keys: &[
        Key { kind: KeyKind::Table(KeyTable {
        open: |it, (name, span)| it.locks.push(LockConfig { name, span, ..LockConfig::default() }),
        expected: "is a section: `[{}]` with `codels` and `protocol`", required: &["codels", "protocol"], keys: &[
        Key { name: "codels", kind: KeyKind::Codels(|it| &mut last(&mut it.locks).codels),
            examples: r#"[["drivers.imu_read", "drivers.gps_read"]]"#,
            documentation: "The codels that take the lock, as in timing tables.", ..KEY },
        Key { name: "protocol", kind: KeyKind::Protocol(|it| &mut last(&mut it.locks).protocol), examples: r#"["inheritance"]"#,
            documentation: "What keeps a codel that holds the lock from being preempted: \"inheritance\" (PTHREAD_PRIO_INHERIT, \
                            `mauve::Lock`), \"ceiling\" (PTHREAD_PRIO_PROTECT), or \"none\" (`std::mutex`).", ..KEY },
        Key { name: "held", kind: KeyKind::Time(|it| &mut last(&mut it.locks).held), examples: r#"["0.2 ms"]"#,
            documentation: "For how long a codel executes while it holds the lock, at most, with its unit: ns, us, ms or s; it \
                            does not wait meanwhile. When left out, a codel holds the lock for its whole time.", ..KEY },
    ], ..TABLE }), ..KEY }], ..TABLE }), examples: r#"[{ "bus": { "codels": ["imu_read", "gps_read"], "protocol": "inheritance" } }]"#,
        documentation: "Locks that several codels take, by their names: they delay activities of higher priority.", ..KEY },
    Key { name: "chains", kind: KeyKind::Table(KeyTable { header: Some(("[chains.Name]", "how long data may take")), keys: &[
        Key { kind: KeyKind::Table(KeyTable {
            open: |it, (name, span)| it.chains.push(Chain { name, span, ..Chain::default() }),
            expected: "is a section: `[{}]` with `from` and `to`", keys: &CHAIN, ..TABLE
        }), ..KEY },
    ], ..TABLE }), examples: r#"[{ "avoid": { "from": "hokuyo.scan", "to": "pilot", "latency": "300 ms" } }]"#,
        documentation: "How long data may take from a sensor to an actuator, by the name of the chain.", ..KEY },
    Key { name: "ros2", kind: KeyKind::Table(KeyTable { header: Some(("[ros2]", "topics of ROS 2")),
        open: |it, (_, span)| ros2(it).span = span, keys: &[
        Key { name: "domain", kind: KeyKind::Integer(0, 232, |it| &mut ros2(it).domain), default: Some("0"), examples: "[0]",
            documentation: "The domain. The variable ROS_DOMAIN_ID takes precedence." },
        Key { name: "discovery", kind: KeyKind::Either(&["localhost", "subnet"], |it| &mut ros2(it).is_on_subnet), default: Some("\"localhost\""), examples: r#"["localhost", "subnet"]"#,
            documentation: "Whom the robot finds, and who finds it: programs of this computer, or of the local network." },
        Key { name: "namespace", kind: KeyKind::Names { store: |it, names| ros2(it).namespace = names.into_iter().next(),
                parts: (1, 1), is_list: false, expected: r#"is a namespace, such as "/uav""#, suggestions: Suggestions::Words(&[]) },
            examples: r#"["/uav"]"#, documentation: "What stands before the names of all topics but absolute ones.", ..KEY },
        Key { name: "gateway", kind: KeyKind::Table(KeyTable {
                header: Some(("[ros2.gateway]", "the activity that moves samples")), keys: &GATEWAY,
                open: |it, (_, span)| ros2(it).gateway.span = span,
                expected: "is a table, such as { priority = 20, period = \"1 ms\", cpus = [1] }", ..TABLE
            }), examples: r#"[{ "priority": 20, "period": "1 ms", "cpus": [1] }]"#,
                documentation: "The activity that moves samples between the ports and the topics: one on each host, all with these values. \
                            The threads of the middleware have its CPUs, and a priority one lower.", ..KEY },
        Key { name: "topics", kind: KeyKind::Table(KeyTable {
                header: Some(("[ros2.topics]", "the topics of ports")), expected: OF_TOPICS,
                keys: &[Key { kind: KeyKind::Table(KeyTable {
                    open: |it, port| ros2(it).topics.push(TopicConfig { port, ..TopicConfig::default() }),
                    otherwise: named_topic, expected: OF_TOPICS, keys: &TOPIC, ..TABLE
                }), ..KEY }], ..TABLE
            }), examples: r#"[{ "camera.frame": "/image_raw", "pilot.command": { "name": "/cmd_vel", "reliability": "best-effort" } }]"#,
                documentation: "The topics of ports, each with its name or with its properties. Ports without a connection whose types are \
                            messages are topics, /namespace/instance/port, without an entry.", ..KEY },
    ], ..TABLE }), documentation: "Topics of ROS 2: `mauve run --ros2`, `mauve generate --ros2`.", ..KEY },
    Key { name: "host", kind: KeyKind::Table(KeyTable { header: Some(("[host.Name]", "a computer of the robot")), keys: &[
        Key { kind: KeyKind::Table(KeyTable {
        open: |it, (name, span)| it.hosts.push(HostConfig { name, span, ..HostConfig::default() }),
        expected: "is a section: `[{}]` with `activities`", keys: &[
        Key { name: "activities", kind: KeyKind::Instances(|it| &mut last(&mut it.hosts).activities),
            examples: r#"[["camera", "tracker"]]"#, documentation: "The instances that run on it.", ..KEY },
        Key { name: "cpus", kind: KeyKind::Integer(1, CpuSet::MOST, |it| &mut last(&mut it.hosts).cpus), examples: "[4]",
            documentation: "How many CPUs it has.", ..KEY },
        Key { name: "tables", kind: KeyKind::Tables(|it| &mut last(&mut it.hosts).tables), examples: r#"[["eyes.toml"]]"#,
            documentation: "The timing tables that were measured on it, instead of those of `[timing]`.", ..KEY },
        Key { name: "observed", kind: KeyKind::Tables(|it| &mut last(&mut it.hosts).observed), examples: r#"[["eyes.observed.toml"]]"#,
            documentation: "What recordings on it showed, instead of those of `[timing]`.", ..KEY },
    ], ..TABLE }), ..KEY }], ..TABLE }), examples: r#"[{ "eyes": { "activities": ["camera", "tracker"], "cpus": 4 } }]"#,
        documentation: "The computers that the robot runs on, by their names. Priorities and CPUs are those of each. Without \
                        any, all runs on one.", ..KEY },
    Key { name: "link", kind: KeyKind::Table(KeyTable { header: Some(("[link.Name]", "a network between two hosts")), keys: &[
        Key { kind: KeyKind::Table(KeyTable {
        open: |it, (name, span)| it.links.push(LinkConfig { name, span, ..LinkConfig::default() }),
        expected: "is a section: `[{}]` with `latency`", keys: &[
        Key { name: "latency", kind: KeyKind::Time(|it| &mut last(&mut it.links).latency), examples: r#"["2 ms"]"#,
            documentation: "The most time from a write on one host until Cyclone DDS has received it on the other, with all that delays \
                            its thread there: an assumption.", ..KEY },
    ], ..TABLE }), ..KEY }], ..TABLE }), examples: r#"[{ "eyes-brain": { "latency": "2 ms" } }]"#,
        documentation: "What the network between two hosts takes, by their names, such as [link.\"eyes-brain\"].", ..KEY },
];

const OF_DEPLOYMENT: &str = "is a section of a deployment, such as `[timing.deployment.Sea]` with `tables`";

const OF_TOPICS: &str =
    "is a table of ports, each with the name of its topic, such as { \"camera.frame\" = \"/image_raw\" }";

/// Returns the entry that the reader is in, which is the last one.
fn last<T: Default>(entries: &mut Vec<T>) -> &mut T {
    entries.extend(entries.is_empty().then(T::default));
    let last = entries.len() - 1;
    &mut entries[last]
}

fn ros2(config: &mut Config) -> &mut Ros2Config {
    config.ros2.get_or_insert_default()
}

fn topic(config: &mut Config) -> &mut TopicConfig {
    last(&mut ros2(config).topics)
}

fn cpus_of_set(config: &mut Config, (name, span): Located) -> &mut LocatedCpus {
    config.cpu_sets.push(CpuSetConfig { name, span, cpus: None });
    &mut last(&mut config.cpu_sets).cpus
}

/// `"camera.frame" = "/image_raw"`
fn named_topic(config: &mut Config, port: Located, value: &SpannedValue<'_>) -> Option<()> {
    let name = value.get_ref().as_str().map(|name| (name.to_owned(), value.span()));
    let is_name = name.is_some();
    ros2(config).topics.push(TopicConfig { port, name, ..TopicConfig::default() });
    is_name.then_some(())
}

/// The keys of `[ros2] gateway`.
#[rustfmt::skip]
static GATEWAY: [Key; 3] = [
    Key { name: "priority", kind: KeyKind::Integer(2, 99, |it| &mut ros2(it).gateway.priority), examples: "[20]",
        documentation: "Its priority, as that of an activity, 2 to 99.", ..KEY },
    Key { name: "period", kind: KeyKind::Period(|it| &mut ros2(it).gateway.period), examples: r#"["1 ms"]"#,
        documentation: "Its period, with its unit: ns, us, ms or s.", ..KEY },
    Key { name: "cpus", kind: KeyKind::Cpus(|it, _| &mut ros2(it).gateway.cpus), examples: "[[1]]",
        documentation: "The CPUs that it may run on, numbered from 1: the same numbers on each host. When left out, all of its host.", ..KEY },
];

/// The keys of a topic of `[ros2] topics`.
#[rustfmt::skip]
static TOPIC: [Key; 5] = [
    Key { name: "name", kind: KeyKind::Names { store: |it, names| topic(it).name = names.into_iter().next(), parts: (1, 1), is_list: false,
            expected: "is the name of a topic, such as \"/image_raw\"", suggestions: Suggestions::Words(&[]) },
                examples: r#"["/image_raw"]"#, documentation: "Its name; below the namespace unless it begins with `/`.", ..KEY },
    Key { name: "reliability", kind: KeyKind::Either(&["reliable", "best-effort"], |it| &mut topic(it).is_best_effort), default: Some("\"reliable\""), examples: r#"["best-effort"]"#,
        documentation: "Whether samples that are lost are sent again." },
    Key { name: "durability", kind: KeyKind::Either(&["volatile", "transient-local"], |it| &mut topic(it).is_transient_local), default: Some("\"volatile\""), examples: r#"["transient-local"]"#,
        documentation: "Whether those who join late get the last samples." },
    Key { name: "depth", kind: KeyKind::Integer(1, 1000, |it| &mut topic(it).depth), default: Some("1"), examples: "[1]",
        documentation: "How many samples are kept, and moved in a period of the gateway at most." },
    Key { name: "max_bytes", kind: KeyKind::Integer(1, 1 << 30, |it| &mut topic(it).max_bytes), default: Some("1048576"), examples: "[2000000]",
        documentation: "The greatest size of a sample: greater ones are dropped and counted." },
];

/// The keys of `[chains.…]`.
#[rustfmt::skip]
static CHAIN: [Key; 6] = [
    Key { name: "from", kind: KeyKind::Names { store: |it, names| last(&mut it.chains).from = names.into_iter().next(), parts: (1, 2),
            is_list: false, expected: END, suggestions: Suggestions::ChainEnds }, examples: r#"["drivers.hokuyo_sweep"]"#,
                documentation: "Where the data comes from: a codel, a port `instance.port`, or an instance.", ..KEY },
    Key { name: "to", kind: KeyKind::Names { store: |it, names| last(&mut it.chains).to = names.into_iter().next(), parts: (1, 2),
            is_list: false, expected: END, suggestions: Suggestions::ChainEnds }, examples: r#"["drivers.aria_drive"]"#,
                documentation: "Where the data has its effect: a codel, a port `instance.port`, or an instance.", ..KEY },
    Key { name: "through", kind: KeyKind::Names { store: |it, names| last(&mut it.chains).through = names, parts: (1, 2), is_list: true,
            expected: "is a list of instances or ports on the way, such as [\"guidance\", \"switch.command\"]",
            suggestions: Suggestions::ChainWay }, examples: r#"[["guidance", "switch"]]"#,
                documentation: "Instances or ports on the way, in order, where several ways lead from one end to the other.", ..KEY },
    Key { name: "while", kind: KeyKind::Names { store: |it, names| last(&mut it.chains).states = names, parts: (2, 2), is_list: true,
            expected: "is a list of states, such as [\"guidance.Steering\"]", suggestions: Suggestions::ChainStates },
        examples: r#"[["guidance.Steering", "switch.Automatic"]]"#,
            documentation: "The states, as `instance.State`, in which the chain is intended to work: the latency holds while the \
                        instances are in them.", ..KEY },
    Key { name: "answers", kind: KeyKind::Names { store: |it, names| last(&mut it.chains).answers = names, parts: (1, 2), is_list: true,
            expected: "is a list of codels or input ports, such as [\"drivers.hokuyo_sweep\"]",
            suggestions: Suggestions::ChainAnswers }, examples: r#"[["drivers.hokuyo_sweep"]]"#,
                documentation: "Codels that are assumed to return `true`, and input ports, as `instance.port`, that are assumed to have \
                        new data at each read: the latency holds while they do.", ..KEY },
    Key { name: "latency", kind: KeyKind::Period(|it| &mut last(&mut it.chains).latency), examples: r#"["300 ms"]"#,
        documentation: "The greatest latency that is allowed, with its unit: ns, us, ms or s.", ..KEY },
];

const END: &str = "is a codel, a port or an instance, such as \"hokuyo.scan\"";

/// The keys of `[[platform.other]]`.
#[rustfmt::skip]
static OTHER: [Key; 9] = [
    Key { name: "name", kind: KeyKind::Text {
            store: |it, name| is_name(&name.0).then(|| last(&mut it.others).name = Some(name)),
            expected: r#"is a name on one line, such as "network interrupt""#,
            pattern: r"^[^\u0000-\u0020\u007f-\u00a0][^\u0000-\u001f\u007f-\u009f]*$", usual: &["network interrupt"],
        }, examples: r#"["network interrupt"]"#, documentation: "Its name in reports. No two have the same.", ..KEY },
    Key { name: "priority", kind: KeyKind::Integer(1, 99, |it| &mut last(&mut it.others).priority), examples: "[50]",
        documentation: "Its priority, as that of an activity; 99 is the highest.", ..KEY },
    Key { name: "period", kind: KeyKind::Period(|it| &mut last(&mut it.others).period), examples: r#"["1 ms"]"#,
        documentation: "The least time between two of its releases, with its unit: ns, us, ms or s; also a quotient, such as \
                        \"1000/30 ms\".", ..KEY },
    Key { name: "rate", kind: KeyKind::Rate(|it| &mut last(&mut it.others).rate), examples: r#"["30 Hz"]"#,
        documentation: "The greatest number of its releases per second, instead of `period`.", ..KEY },
    Key { name: "burst", kind: KeyKind::Integer(1, GREATEST_BURST, |it| &mut last(&mut it.others).burst), default: Some("1"), examples: "[3]",
        documentation: "The greatest number of its releases in any time of the length of the period." },
    Key { name: "time", kind: KeyKind::Time(|it| &mut last(&mut it.others).time), examples: r#"["50 us"]"#,
        documentation: "The greatest execution time of a release, with its unit: ns, us, ms or s.", ..KEY },
    Key { name: "cpus", kind: KeyKind::Cpus(|it, _| &mut last(&mut it.others).cpus), examples: "[[1], [1, 2]]",
        documentation: "The CPUs that it may run on, numbered from 1. When left out, all.", ..KEY },
    Key { name: "jitter", kind: KeyKind::Time(|it| &mut last(&mut it.others).jitter), default: Some("\"0 ms\""), examples: r#"["0.1 ms"]"#,
        documentation: "By how much a release may be late, with its unit: ns, us, ms or s." },
    Key { name: "host", kind: KeyKind::Names { store: |it, names| last(&mut it.others).host = names.into_iter().next(), parts: (1, 1), is_list: false,
            expected: "is the name of a host, such as \"eyes\"", suggestions: Suggestions::Hosts },
        examples: r#"["eyes"]"#, documentation: "The host that it executes on. When left out, each.", ..KEY },
];

/// The keys of `[timing.deployment.…]`.
#[rustfmt::skip]
static DEPLOYMENT_TABLES: [Key; 2] = [
    Key { name: "tables", kind: KeyKind::Tables(|it| &mut last(&mut it.deployment_tables).tables), examples: r#"[["timing/sea/*.toml"]]"#,
        documentation: "All timing tables of the deployment, from the folder of mauve.toml.", ..KEY },
    Key { name: "observed", kind: KeyKind::Tables(|it| &mut last(&mut it.deployment_tables).observed),
        examples: r#"[["sea.observed.toml"]]"#,
        documentation: "What recordings on its computer showed, from the folder of mauve.toml.", ..KEY },
];

/// Returns whether this is a name for a report: on one line, and without a space in front.
fn is_name(text: &str) -> bool {
    !text.is_empty() && !text.starts_with([' ', '\u{a0}']) && !text.contains(char::is_control)
}

/// What is wrong with a rate beside a period, as a predicate of its key.
const BESIDE_PERIOD: &str = "cannot be beside `period`: delete one";

/// The same of `required`.
const BESIDE_SIGNIFICANCE: &str = "chooses the level, and cannot be beside `significance`: delete one";

impl KeyKind {
    /// Returns what a wrong value of a key in a section should be, as a predicate of the key: less than all that is valid where the type
    /// of the value, or the reason why it is no time, says the rest.
    pub(super) fn expected(&self, section: &str, key: &str, is_string: bool, has_reason: bool) -> String {
        match self {
            KeyKind::Table(table) => table.expected.replace("{}", &format!("{section}.{key}")),
            KeyKind::Integer(from, to, _) => format!("is a whole number from {from} to {to}"),
            KeyKind::Text { .. } | KeyKind::Either(..) if !is_string => "is a string".to_owned(),
            KeyKind::Either([one, other], _) => format!("is \"{one}\" or \"{other}\""),
            KeyKind::Time(_) if has_reason => "is a time such as \"5 ms\"".to_owned(),
            KeyKind::Period(_) if has_reason => "is a time such as \"10 ms\"".to_owned(),
            _ => self.shown().0.to_owned(),
        }
    }

    /// Returns what completion offers as its value.
    pub fn suggestions(&self) -> Suggestions {
        self.shown().1
    }

    /// Returns the valid values as a predicate of a key, and what completion offers.
    #[rustfmt::skip] // A line for each kind.
    fn shown(&self) -> (&'static str, Suggestions) {
        use Suggestions::{Strings, Words};
        match self {
            KeyKind::Table(table) => (table.expected, Words(&[])),
            KeyKind::Models(_) => ("is a path, or a list of paths", Suggestions::Models),
            KeyKind::Tables(_) => ("is a list of paths, which may have `*`", Suggestions::Tables),
            KeyKind::Codels(_) => ("is a list of codels", Suggestions::Codels),
            KeyKind::Protocol(_) => (r#"is "inheritance", "ceiling" or "none""#, Strings(&["inheritance", "ceiling", "none"])),
            KeyKind::Instances(_) => ("is a list of instances", Suggestions::Instances),
            KeyKind::Reasons(_) => (
                "is a table of instances, each with a reason that is not empty, such as { planner = \"measured by hand\" } or \
                 { planner = { until = \"30 ms\", reason = \"measured by hand\" } }",
                Words(&[]),
            ),
            KeyKind::Level => ("is a number between 0 and 1, such as 1e-4", Suggestions::Levels),
            KeyKind::Required(_) => (
                r#"is a probability per mission, such as "1e-6 per hour" or "1e-6 per 8 h", with h, min or s"#,
                Strings(&["1e-6 per hour"]),
            ),
            KeyKind::Time(_) => (r#"is a time with its unit, such as "5 ms""#, Strings(&["5 ms"])),
            KeyKind::Period(_) => (r#"is a time greater than 0 with its unit, such as "10 ms""#, Strings(&["10 ms"])),
            KeyKind::Rate(_) => (r#"is a number of releases per second greater than 0, such as "30 Hz""#, Strings(&["30 Hz"])),
            KeyKind::Cpus(_) => ("is a list of CPUs, numbered from 1 to 128, such as [1, 2]", Words(&[])),
            KeyKind::Severity => (
                r#"has an invalid severity: expected "allow", "hint", "warn" or "error""#,
                Strings(&["allow", "hint", "warn", "error"]),
            ),
            KeyKind::Integer(..) => ("is a whole number", Words(&[])),
            KeyKind::Boolean(_) => ("is true or false", Words(&["true", "false"])),
            KeyKind::Either(words, _) => ("is one of two words", Strings(*words)),
            KeyKind::Folder(_) => ("is the path of a folder", Strings(&["generated"])),
            KeyKind::Text { expected, usual, .. } => (expected, Strings(usual)),
            KeyKind::Names { expected, suggestions, .. } => (expected, *suggestions),
        }
    }
}

impl ValueKind for KeyKind {
    fn keys(&self) -> &'static [Key] {
        if let KeyKind::Table(table) = self { table.keys } else { &[] }
    }

    fn header(&self) -> Option<(&'static str, &'static str)> {
        if let KeyKind::Table(table) = self { table.header } else { None }
    }
}

/// What completion offers as the value of a key.
#[derive(Debug, Clone, Copy)]
pub enum Suggestions {
    /// The models of the project.
    Models,
    /// Its other files.
    Tables,
    /// The instances of its architectures.
    Instances,
    /// The codels that its cores call.
    Codels,
    /// The ends of chains: its codels, ports and instances.
    ChainEnds,
    /// Its instances and their ports.
    ChainWay,
    /// The states of its instances.
    ChainStates,
    /// Its codels, and the input ports of its instances.
    ChainAnswers,
    /// The significance levels of its tables.
    Levels,
    /// The hosts of the configuration.
    Hosts,
    /// These words.
    Words(&'static [&'static str]),
    /// These words in quotes.
    Strings(&'static [&'static str]),
}
