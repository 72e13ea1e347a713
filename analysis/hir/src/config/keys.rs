//! The keys of `mauve.toml`: their documentation, valid values, and fields of [`Config`]. The reader, completion and the JSON
//! schema (written by `tests/schemas.rs`) follow this table: a new key is one entry here.

use std::collections::BTreeMap;
use std::ops::Range;

use mauve_timing::{CpuSet, Level, Protocol, Time};

use super::cpp::is_cpp_type;
use super::{
    Acceptance, Chain, ClockConfig, Config, CpuSetConfig, DeploymentConfig, DeploymentTables, ExternalType,
    GatewayConfig, HostConfig, LinkConfig, Located, LockConfig, OtherConfig, Required, Ros2Config,
    TopicConfig, is_header, maintainer_of,
};
use crate::activity_field::GREATEST_BURST;
use crate::severity::Severity;

/// A section of `mauve.toml`. Completion shows `summary`, the schema `documentation`.
#[allow(missing_docs)]
pub struct Section {
    pub name: &'static str,
    pub summary: &'static str,
    pub entries: Entries,
    pub documentation: &'static str,
}

/// The entries of a section.
pub enum Entries {
    /// Keys with fixed names.
    Keys(&'static [Key<Config>]),
    /// A section for each type, such as `[types.ArRobotPtr]`, with these keys.
    Types(&'static [Key<ExternalType>]),
    /// A section for each deployment, such as `[deployment.Sea]`, with these keys.
    Deployments(&'static [Key<DeploymentConfig>]),
    /// A section for each lock, such as `[locks.bus]`, with these keys.
    Locks(&'static [Key<LockConfig>]),
    /// A section for each host, such as `[host.eyes]`, with these keys.
    Hosts(&'static [Key<HostConfig>]),
    /// A section for each link, such as `[link."eyes-brain"]`, with these keys.
    Links(&'static [Key<LinkConfig>]),
    /// Keys, and a section for each clock, such as `[clocks.base]`, with the others.
    Clocks(&'static [Key<Config>], &'static [Key<ClockConfig>]),
    /// A section for each chain, such as `[chains.avoid]`, with these keys; or a list of ports.
    Chains(&'static [Key<Chain>]),
    /// A severity ([`SEVERITIES`]) for each diagnostic code.
    Lints,
}

/// A key, whose value is stored in a `T`. `default` and `examples` are JSON.
#[allow(missing_docs)]
pub struct Key<T: 'static> {
    pub name: &'static str,
    pub kind: KeyKind<T>,
    pub default: Option<&'static str>,
    pub examples: &'static str,
    pub documentation: &'static str,
}

/// The field of the configuration that stores a value.
pub type Field<T, V> = fn(&mut T) -> &mut V;

/// The valid values of a key, and the field that stores them.
pub enum KeyKind<T> {
    /// The path of a model, or a list of them.
    Models(Field<T, Vec<Located>>),
    /// The path of a timing table, or a list of them; a path may have wildcards.
    Tables(Field<T, Vec<Located>>),
    /// The key of a codel, or a list of them.
    Codels(Field<T, Vec<Located>>),
    /// A protocol of a lock.
    Protocol(fn(&mut T) -> &mut Option<Protocol>),
    /// The name of an instance, or a list of them.
    Instances(Field<T, Vec<Located>>),
    /// A table of instances, each with a reason, or with a reason and the greatest response time.
    Reasons(Field<T, Vec<Acceptance>>),
    /// A significance level.
    Level(fn(&mut T, Level, Range<usize>)),
    /// A probability per mission.
    Required(Field<T, Option<Required>>),
    /// A time with its unit.
    Time(fn(&mut T) -> &mut Option<Time>),
    /// A time greater than 0 with its unit, exact to the nanosecond.
    Period(fn(&mut T) -> &mut Option<Time>),
    /// A number of releases per second with its unit; stored as the time between two.
    Rate(fn(&mut T) -> &mut Option<Time>),
    /// A name, or also a list of them, each with so many parts, joined by points.
    Names {
        /// Stores them.
        store: fn(&mut T, Vec<Located>),
        /// The least and the greatest number of parts.
        parts: (usize, usize),
        /// Whether it may be a list.
        is_list: bool,
        /// The valid values, as a predicate of the key.
        expected: &'static str,
        /// The suggestions of completion.
        suggestions: Suggestions,
    },
    /// A list of CPUs, numbered from 1.
    Cpus(Field<T, Option<(CpuSet, Range<usize>)>>),
    /// A table of named lists of CPUs, and the note of completion.
    CpuSets(Field<T, BTreeMap<String, CpuSetConfig>>, &'static str),
    /// A list of tables with these keys, such as `[[platform.other]]`, and the note of completion.
    Others(Field<T, Vec<OtherConfig>>, &'static [Key<OtherConfig>], &'static str),
    /// A section for each deployment, such as `[timing.deployment.Sea]`, with these keys, and the note of completion.
    DeploymentTables(
        Field<T, BTreeMap<String, DeploymentTables>>,
        &'static [Key<DeploymentTables>],
        &'static str,
    ),
    /// A table with these keys, such as that of the gateway.
    Gateway(Field<T, GatewayConfig>, &'static [Key<GatewayConfig>]),
    /// A table of ports, each with the name of its topic or a table with these keys.
    Topics(Field<T, Vec<TopicConfig>>, &'static [Key<TopicConfig>]),
    /// An integer between two bounds, inclusive.
    Integer(u32, u32, fn(&mut T) -> &mut Option<u32>),
    /// `true` or `false`.
    Boolean(fn(&mut T) -> &mut Option<bool>),
    /// The path of a folder.
    Folder(Field<T, Option<Located>>),
    /// A string in a particular format.
    Text {
        /// Stores a string; `None` if it does not have the format.
        store: fn(&mut T, &str) -> Option<()>,
        /// The valid values, as a predicate of the key.
        expected: &'static str,
        /// A regular expression for the schema, which may match more.
        pattern: &'static str,
        /// The suggestions of completion.
        usual: &'static [&'static str],
    },
}

/// The severities of `[lints]`; `None` hides the diagnostic.
pub const SEVERITIES: [(&str, Option<Severity>); 4] = [
    ("allow", None),
    ("hint", Some(Severity::Hint)),
    ("warn", Some(Severity::Warning)),
    ("error", Some(Severity::Error)),
];

/// The sections, in the order of messages and completion.
#[rustfmt::skip] // rustfmt would put each field on its own line.
pub static SECTIONS: [Section; 14] = [
    Section { name: "project", summary: "the roots of the models", entries: Entries::Keys(&[
        Key { name: "root", kind: KeyKind::Models(|it| &mut it.roots), default: None, examples: r#"["robot.mal"]"#,
            documentation: "The model that includes all others, from the folder of mauve.toml." },
        Key { name: "roots", kind: KeyKind::Models(|it| &mut it.roots), default: None,
            examples: r#"[["robot.mal", "bench.mal"]]"#,
            documentation: "Several such models, each with its own project." },
    ]), documentation: "What is looked at. Without it, every model that no other one includes is the root of a project." },
    Section { name: "timing", summary: "where execution times stand", entries: Entries::Keys(&[
        Key { name: "tables", kind: KeyKind::Tables(|it| &mut it.tables), default: None, examples: r#"[["timing/*.toml"]]"#,
            documentation: "The timing tables, from the folder of mauve.toml; `*` stands for any part of a name." },
        Key { name: "observed", kind: KeyKind::Tables(|it| &mut it.observed), default: None,
            examples: r#"[["robot.observed.toml"]]"#,
            documentation: "What recordings showed, from the folder of mauve.toml: the files that `mauve trace import` writes \
                            beside the samples. A time that a recording refuted is an error until it is mended." },
        Key { name: "significance", kind: KeyKind::Level(|it, level, span| {
                (it.significance, it.significance_span) = (Some(level), Some(span));
            }), default: Some("1e-4"), examples: "[1e-4]",
            documentation: "The significance level that is shown and checked: with which probability one execution of a codel \
                            may take longer than its time." },
        Key { name: "required", kind: KeyKind::Required(|it| &mut it.required), default: None,
            examples: r#"["1e-6 per hour", "1e-6 per 8 h"]"#,
            documentation: "The greatest probability that any execution of a mission of this length exceeds its time. It chooses the \
                            significance level of each deployment, instead of `significance`: with it, the number of executions of the mission \
                            times the level is at most this." },
        Key { name: "dependent", kind: KeyKind::Codels(|it| &mut it.dependent), default: None, examples: r#"[["navigation.astar"]]"#,
            documentation: "Codels, as in timing tables, whose execution time depends on that of earlier executions: probabilities of \
                            misses do not multiply theirs." },
        Key { name: "deployment",
            kind: KeyKind::DeploymentTables(|it| &mut it.deployment_tables, &DEPLOYMENT_TABLES, "a deployment's own timing tables"),
            default: None, examples: r#"[{ "Sea": { "tables": ["timing/sea/*.toml"] } }]"#,
            documentation: "Timing tables of one deployment, by its name: its times were measured on another computer. The \
                            deployment uses them instead of `tables`, and no other deployment does." },
    ]), documentation: "Execution times." },
    Section { name: "types", summary: "types that no message package declares", entries: Entries::Types(&[
        Key { name: "cpp", kind: KeyKind::Text {
                store: |it, text| is_cpp_type(text).then(|| text.clone_into(&mut it.cpp)),
                expected: r#"is a C++ type, such as "ArRobot*""#,
                pattern: "^[A-Za-z_:][A-Za-z0-9_:<>, *]*$", usual: &[],
            }, default: None, examples: r#"["ArRobot*"]"#, documentation: "The type in C++, and nothing else." },
        Key { name: "header", kind: KeyKind::Text {
                store: |it, text| is_header(text).then(|| it.header = Some(text.to_owned())),
                expected: "is the relative path of a C++ header, such as \"Aria/Aria.h\"; no part of it begins with `.` or `-`",
                pattern: "^[A-Za-z0-9_+][A-Za-z0-9_+.-]*(/[A-Za-z0-9_+][A-Za-z0-9_+.-]*)*$", usual: &[],
            }, default: None, examples: r#"["Aria/Aria.h"]"#,
            documentation: "The header that declares it, as an #include names it." },
    ]), documentation: "Types that no message package declares, and what they are in C++." },
    Section { name: "generate", summary: "where generated sources go", entries: Entries::Keys(&[
        Key { name: "out", kind: KeyKind::Folder(|it| &mut it.out), default: None, examples: r#"["generated"]"#,
            documentation: "The folder that they go to." },
        Key { name: "ros_streams", kind: KeyKind::Boolean(|it| &mut it.ros_streams), default: Some("true"), examples: "[false]",
            documentation: "Are outputs of deployed components, and inputs that nothing is connected to, ROS topics too, \
                            instance/port? When left out, they are." },
        Key { name: "introspection", kind: KeyKind::Boolean(|it| &mut it.introspection), default: Some("true"),
            examples: "[false]",
            documentation: "Have components ports that show their state and their execution times? When left out, they have." },
        Key { name: "maintainer", kind: KeyKind::Text {
                store: |it, text| maintainer_of(text).map(|maintainer| it.maintainer = Some(maintainer)),
                expected: r#"is a name and an address, such as "Ada Lovelace <ada@example.org>""#,
                pattern: r"^\s*[^<]*[^<\s][^<]*<\s*[A-Za-z0-9_%+.-]+@[A-Za-z0-9.-]*[.][A-Za-z0-9]{2,}\s*>\s*$",
                usual: &["Name <name@example.org>"],
            }, default: None, examples: r#"["Ada Lovelace <ada@example.org>"]"#,
            documentation: "Whom the packages name as their maintainer." },
        Key { name: "license", kind: KeyKind::Text {
                store: |it, text| (!text.trim().is_empty()).then(|| it.license = Some(text.to_owned())),
                expected: r#"names a licence, such as "BSD""#,
                pattern: r"\S", usual: &["Apache-2.0", "BSD-3-Clause", "MIT"],
            }, default: None, examples: r#"["BSD-3-Clause"]"#, documentation: "The licence that the packages name." },
    ]), documentation: "Generated sources: `mauve generate`." },
    Section { name: "lints", summary: "how bad a diagnostic is", entries: Entries::Lints,
        documentation: "How bad a diagnostic is here: \"error\", \"warn\", \"hint\", or \"allow\" not to show it at all." },
    Section { name: "assume", summary: "times that the tables lack", entries: Entries::Keys(&[
        Key { name: "codel", kind: KeyKind::Time(|it| &mut it.assume), default: None, examples: r#"["5 ms", "250 us"]"#,
            documentation: "The execution time of every codel that no table has, with its unit: ns, us, ms or s." },
    ]), documentation: "What is assumed where nothing is known; shown wherever it is used." },
    Section { name: "platform", summary: "what the programs run on", entries: Entries::Keys(&[
        Key { name: "cpus", kind: KeyKind::Integer(1, CpuSet::MOST, |it| &mut it.cpus), default: None, examples: "[2]",
            documentation: "How many CPUs there are: those that an activity without an affinity may use. When left out, those \
                            that affinities name." },
        Key { name: "cpu_sets", kind: KeyKind::CpuSets(|it| &mut it.cpu_sets, "names of CPUs"), default: None,
            examples: r#"[{ "big": [5, 6] }]"#, documentation: "Names of lists of CPUs, numbered from 1, which `cpus` of an \
                            activity may have." },
        Key { name: "rt_throttling", kind: KeyKind::Boolean(|it| &mut it.rt_throttling), default: None, examples: "[false]",
            documentation: "Does Linux keep 50 ms of each second from real-time tasks (kernel.sched_rt_runtime_us)? When left \
                            out, it does not, and that is shown as an assumption." },
        Key { name: "other",
            kind: KeyKind::Others(|it| &mut it.others, &OTHER, "real-time work that is not in the model"), default: None,
            examples: r#"[[{ "name": "network interrupt", "priority": 50, "period": "1 ms", "time": "50 us" }]]"#,
            documentation: "Real-time work that is not in the model, such as interrupt threads and drivers: it interferes with \
                            the activities of every deployment." },
    ]), documentation: "The machine that the robot runs on." },
    Section { name: "clocks", summary: "which releases keep their distance", entries: Entries::Clocks(&[
        Key { name: "synchronised", kind: KeyKind::Instances(|it| &mut it.synchronised), default: None,
            examples: r#"[["hokuyo", "p3dx_driver"]]"#, documentation: "Instances whose activities have one clock: each is released at its offset in every \
                            period, counted from one instant. Without this, the phases of their releases are unknown." },
        Key { name: "ptp", kind: KeyKind::Time(|it| &mut it.ptp), default: None, examples: r#"["20 us"]"#,
            documentation: "By how much the clocks of two hosts differ, at most, with its unit: ns, us, ms or s. It counts as jitter \
                            of activities whose clock spans hosts. Without it, no clock does." },
    ], &[
        Key { name: "instances", kind: KeyKind::Instances(|it| &mut it.instances), default: None,
            examples: r#"[["camera", "tracker"]]"#, documentation: "Instances whose activities have this clock, as those of \
                            `synchronised` have theirs. Nothing is known of the phases of two clocks." },
    ]), documentation: "Activities whose releases keep their distance; with a section for each further clock, such as \
                        [clocks.camera]." },
    Section { name: "deployment", summary: "what is accepted of a deployment", entries: Entries::Deployments(&[
        Key { name: "accept", kind: KeyKind::Reasons(|it| &mut it.accepted), default: None,
            examples: r#"[{ "planner": "measured by hand" }, { "planner": { "until": "30 ms", "reason": "measured by hand" } }]"#,
            documentation: "Instances whose deadlines need no proof, each with the reason. `mauve check` does not fail for \
                            them, shows the reason, and never calls their deadlines met. With `until`, only while the response time is at \
                            most that long." },
        Key { name: "required", kind: KeyKind::Required(|it| &mut it.required), default: None, examples: r#"["1e-9 per 8 h"]"#,
            documentation: "The same as `[timing] required`, for this deployment only." },
    ]), documentation: "What is accepted of a deployment, by its name." },
    Section { name: "locks", summary: "locks that codels take", entries: Entries::Locks(&[
        Key { name: "codels", kind: KeyKind::Codels(|it| &mut it.codels), default: None,
            examples: r#"[["drivers.imu_read", "drivers.gps_read"]]"#,
            documentation: "The codels that take the lock, as in timing tables." },
        Key { name: "protocol", kind: KeyKind::Protocol(|it| &mut it.protocol), default: None, examples: r#"["inheritance"]"#,
            documentation: "What keeps a codel that holds the lock from being preempted: \"inheritance\" (PTHREAD_PRIO_INHERIT, \
                            `mauve::Lock`), \"ceiling\" (PTHREAD_PRIO_PROTECT), or \"none\" (`std::mutex`)." },
        Key { name: "held", kind: KeyKind::Time(|it| &mut it.held), default: None, examples: r#"["0.2 ms"]"#,
            documentation: "For how long a codel executes while it holds the lock, at most, with its unit: ns, us, ms or s; it \
                            does not wait meanwhile. When left out, a codel holds the lock for its whole time." },
    ]), documentation: "Locks that several codels take, by their names: they delay activities of higher priority." },
    Section { name: "chains", summary: "how long data may take", entries: Entries::Chains(&CHAIN),
        documentation: "How long data may take from a sensor to an actuator, by the name of the chain." },
    Section { name: "ros2", summary: "topics of ROS 2", entries: Entries::Keys(&[
        Key { name: "domain", kind: KeyKind::Integer(0, 232, |it| &mut ros2(it).domain), default: Some("0"), examples: "[0]",
            documentation: "The domain. The variable ROS_DOMAIN_ID takes precedence." },
        Key { name: "discovery", kind: KeyKind::Text {
                store: |it, text| {
                    ros2(it).is_on_subnet = text == "subnet";
                    matches!(text, "localhost" | "subnet").then_some(())
                },
                expected: r#"is "localhost" or "subnet""#, pattern: "^(localhost|subnet)$", usual: &["localhost", "subnet"],
            }, default: Some("\"localhost\""), examples: r#"["localhost", "subnet"]"#,
            documentation: "Whom the robot finds, and who finds it: programs of this computer, or of the local network." },
        Key { name: "namespace", kind: KeyKind::Names { store: |it, names| ros2(it).namespace = names.into_iter().next(),
                parts: (1, 1), is_list: false, expected: r#"is a namespace, such as "/uav""#, suggestions: Suggestions::Words(&[]) },
            default: None, examples: r#"["/uav"]"#, documentation: "What stands before the names of all topics but absolute ones." },
        Key { name: "gateway", kind: KeyKind::Gateway(|it| &mut ros2(it).gateway, &GATEWAY), default: None,
            examples: r#"[{ "priority": 20, "period": "1 ms", "cpus": [1] }]"#,
            documentation: "The activity that moves samples between the ports and the topics. The threads of the middleware have its \
                            CPUs, and a priority one lower." },
        Key { name: "topics", kind: KeyKind::Topics(|it| &mut ros2(it).topics, &TOPIC), default: None,
            examples: r#"[{ "camera.frame": "/image_raw", "pilot.command": { "name": "/cmd_vel", "reliability": "best-effort" } }]"#,
            documentation: "The topics of ports, each with its name or with its properties. Ports without a connection whose types are \
                            messages are topics, /namespace/instance/port, without an entry." },
    ]), documentation: "Topics of ROS 2: `mauve run --ros2`, `mauve generate --ros2`." },
    Section { name: "host", summary: "a computer of the robot", entries: Entries::Hosts(&[
        Key { name: "activities", kind: KeyKind::Instances(|it| &mut it.activities), default: None,
            examples: r#"[["camera", "tracker"]]"#, documentation: "The instances that run on it." },
        Key { name: "cpus", kind: KeyKind::Integer(1, CpuSet::MOST, |it| &mut it.cpus), default: None, examples: "[4]",
            documentation: "How many CPUs it has." },
        Key { name: "tables", kind: KeyKind::Tables(|it| &mut it.tables), default: None, examples: r#"[["eyes.toml"]]"#,
            documentation: "The timing tables that were measured on it, instead of those of `[timing]`." },
        Key { name: "observed", kind: KeyKind::Tables(|it| &mut it.observed), default: None, examples: r#"[["eyes.observed.toml"]]"#,
            documentation: "What recordings on it showed, instead of those of `[timing]`." },
    ]), documentation: "The computers that the robot runs on, by their names. Priorities and CPUs are those of each. Without \
                        any, all runs on one." },
    Section { name: "link", summary: "a network between two hosts", entries: Entries::Links(&[
        Key { name: "latency", kind: KeyKind::Time(|it| &mut it.latency), default: None, examples: r#"["2 ms"]"#,
            documentation: "The most time from a write on one host until Cyclone DDS has received it on the other, with all that delays \
                            its thread there: an assumption." },
    ]), documentation: "What the network between two hosts takes, by their names, such as [link.\"eyes-brain\"]." },
];

fn ros2(config: &mut Config) -> &mut Ros2Config {
    config.ros2.get_or_insert_default()
}

/// The keys of `[ros2] gateway`.
#[rustfmt::skip]
static GATEWAY: [Key<GatewayConfig>; 3] = [
    Key { name: "priority", kind: KeyKind::Integer(2, 99, |it| &mut it.priority), default: None, examples: "[20]",
        documentation: "Its priority, as that of an activity, 2 to 99." },
    Key { name: "period", kind: KeyKind::Period(|it| &mut it.period), default: None, examples: r#"["1 ms"]"#,
        documentation: "Its period, with its unit: ns, us, ms or s." },
    Key { name: "cpus", kind: KeyKind::Cpus(|it| &mut it.cpus), default: None, examples: "[[1]]",
        documentation: "The CPUs that it may run on, numbered from 1. When left out, all." },
];

/// The keys of a topic of `[ros2] topics`.
#[rustfmt::skip]
static TOPIC: [Key<TopicConfig>; 5] = [
    Key { name: "name", kind: KeyKind::Names { store: |it, names| it.name = names.into_iter().next(), parts: (1, 1), is_list: false,
            expected: "is the name of a topic, such as \"/image_raw\"", suggestions: Suggestions::Words(&[]) }, default: None,
        examples: r#"["/image_raw"]"#, documentation: "Its name; below the namespace unless it begins with `/`." },
    Key { name: "reliability", kind: KeyKind::Text {
            store: |it, text| {
                it.is_best_effort = text == "best-effort";
                matches!(text, "reliable" | "best-effort").then_some(())
            },
            expected: r#"is "reliable" or "best-effort""#, pattern: "^(reliable|best-effort)$", usual: &["reliable", "best-effort"],
        }, default: Some("\"reliable\""), examples: r#"["best-effort"]"#, documentation: "Whether samples that are lost are sent again." },
    Key { name: "durability", kind: KeyKind::Text {
            store: |it, text| {
                it.is_transient_local = text == "transient-local";
                matches!(text, "volatile" | "transient-local").then_some(())
            },
            expected: r#"is "volatile" or "transient-local""#, pattern: "^(volatile|transient-local)$",
            usual: &["volatile", "transient-local"],
        }, default: Some("\"volatile\""), examples: r#"["transient-local"]"#,
        documentation: "Whether those who join late get the last samples." },
    Key { name: "depth", kind: KeyKind::Integer(1, 1000, |it| &mut it.depth), default: Some("1"), examples: "[1]",
        documentation: "How many samples are kept, and moved in a period of the gateway at most." },
    Key { name: "max_bytes", kind: KeyKind::Integer(1, 1 << 30, |it| &mut it.max_bytes), default: Some("1048576"), examples: "[2000000]",
        documentation: "The greatest size of a sample: greater ones are dropped and counted." },
];

/// The keys of `[chains.…]`.
#[rustfmt::skip]
static CHAIN: [Key<Chain>; 6] = [
    Key { name: "from", kind: KeyKind::Names { store: |it, names| it.from = names.into_iter().next(), parts: (1, 2),
            is_list: false, expected: END, suggestions: Suggestions::ChainEnds }, default: None, examples: r#"["drivers.hokuyo_sweep"]"#,
        documentation: "Where the data comes from: a codel, a port `instance.port`, or an instance." },
    Key { name: "to", kind: KeyKind::Names { store: |it, names| it.to = names.into_iter().next(), parts: (1, 2),
            is_list: false, expected: END, suggestions: Suggestions::ChainEnds }, default: None, examples: r#"["drivers.aria_drive"]"#,
        documentation: "Where the data has its effect: a codel, a port `instance.port`, or an instance." },
    Key { name: "through", kind: KeyKind::Names { store: |it, names| it.through = names, parts: (1, 2), is_list: true,
            expected: "is a list of instances or ports on the way, such as [\"guidance\", \"switch.command\"]",
            suggestions: Suggestions::ChainWay }, default: None, examples: r#"[["guidance", "switch"]]"#,
        documentation: "Instances or ports on the way, in order, where several ways lead from one end to the other." },
    Key { name: "while", kind: KeyKind::Names { store: |it, names| it.states = names, parts: (2, 2), is_list: true,
            expected: "is a list of states, such as [\"guidance.Steering\"]", suggestions: Suggestions::ChainStates },
        default: None, examples: r#"[["guidance.Steering", "switch.Automatic"]]"#,
        documentation: "The states, as `instance.State`, in which the data is meant to be passed on: the latency holds while the \
                        instances are in them." },
    Key { name: "answers", kind: KeyKind::Names { store: |it, names| it.answers = names, parts: (1, 2), is_list: true,
            expected: "is a list of codels or input ports, such as [\"drivers.hokuyo_sweep\"]",
            suggestions: Suggestions::ChainAnswers }, default: None, examples: r#"[["drivers.hokuyo_sweep"]]"#,
        documentation: "Codels that are assumed to return `true`, and input ports, as `instance.port`, that are assumed to have \
                        new data at each read: the latency holds while they do." },
    Key { name: "latency", kind: KeyKind::Period(|it| &mut it.latency), default: None, examples: r#"["300 ms"]"#,
        documentation: "The greatest latency that is allowed, with its unit: ns, us, ms or s." },
];

const END: &str = "is a codel, a port or an instance, such as \"hokuyo.scan\"";

/// The keys of `[chains.…]` that older versions documented.
#[rustfmt::skip]
pub static OLD_CHAIN: [Key<Chain>; 3] = [
    Key { name: "path", kind: KeyKind::Names { store: Chain::set_path, parts: (1, 2), is_list: true,
            expected: r#"is a list of ports, such as ["hokuyo.scan", "guidance.command"]"#, suggestions: Suggestions::ChainWay },
        default: None, examples: r#"[["hokuyo.scan", "guidance.command"]]"#, documentation: "Write `from`, `through` and `to` instead." },
    Key { name: "reaction", kind: KeyKind::Period(|it| &mut it.latency), default: None, examples: r#"["300 ms"]"#,
        documentation: "Write `latency` instead." },
    Key { name: "age", kind: KeyKind::Period(|it| &mut it.latency), default: None, examples: r#"["300 ms"]"#,
        documentation: "Write `latency` instead." },
];

/// The keys that a section `[locks.…]` must have.
pub const REQUIRED_OF_LOCK: [&str; 2] = ["codels", "protocol"];

/// The keys that an entry of `[[platform.other]]` must have.
pub const REQUIRED_OF_OTHER: [&str; 4] = ["name", "priority", "period", "time"];

/// The keys of `[[platform.other]]`.
#[rustfmt::skip]
static OTHER: [Key<OtherConfig>; 9] = [
    Key { name: "name", kind: KeyKind::Text {
            store: |it, text| is_name(text).then(|| it.name = Some(text.to_owned())),
            expected: r#"is a name on one line, such as "network interrupt""#,
            pattern: r"^[^\u0000-\u0020\u007f-\u00a0][^\u0000-\u001f\u007f-\u009f]*$", usual: &["network interrupt"],
        }, default: None, examples: r#"["network interrupt"]"#, documentation: "Its name in reports. No two have the same." },
    Key { name: "priority", kind: KeyKind::Integer(1, 99, |it| &mut it.priority), default: None, examples: "[50]",
        documentation: "Its priority, as that of an activity; 99 is the highest." },
    Key { name: "period", kind: KeyKind::Period(|it| &mut it.period), default: None, examples: r#"["1 ms"]"#,
        documentation: "The least time between two of its releases, with its unit: ns, us, ms or s; also a quotient, such as \
                        \"1000/30 ms\"." },
    Key { name: "rate", kind: KeyKind::Rate(|it| &mut it.rate), default: None, examples: r#"["30 Hz"]"#,
        documentation: "The greatest number of its releases per second, instead of `period`." },
    Key { name: "burst", kind: KeyKind::Integer(1, GREATEST_BURST, |it| &mut it.burst), default: Some("1"), examples: "[3]",
        documentation: "The greatest number of its releases in any time of the length of the period." },
    Key { name: "time", kind: KeyKind::Time(|it| &mut it.time), default: None, examples: r#"["50 us"]"#,
        documentation: "The greatest execution time of a release, with its unit: ns, us, ms or s." },
    Key { name: "cpus", kind: KeyKind::Cpus(|it| &mut it.cpus), default: None, examples: "[[1], [1, 2]]",
        documentation: "The CPUs that it may run on, numbered from 1. When left out, all." },
    Key { name: "jitter", kind: KeyKind::Time(|it| &mut it.jitter), default: Some("\"0 ms\""), examples: r#"["0.1 ms"]"#,
        documentation: "By how much a release may be late, with its unit: ns, us, ms or s." },
    Key { name: "host", kind: KeyKind::Names { store: |it, names| it.host = names.into_iter().next(), parts: (1, 1), is_list: false,
            expected: "is the name of a host, such as \"eyes\"", suggestions: Suggestions::Hosts },
        default: None, examples: r#"["eyes"]"#, documentation: "The host that it executes on. When left out, each." },
];

/// The keys of `[timing.deployment.…]`.
#[rustfmt::skip]
static DEPLOYMENT_TABLES: [Key<DeploymentTables>; 2] = [
    Key { name: "tables", kind: KeyKind::Tables(|it| &mut it.tables), default: None, examples: r#"[["timing/sea/*.toml"]]"#,
        documentation: "All timing tables of the deployment, from the folder of mauve.toml." },
    Key { name: "observed", kind: KeyKind::Tables(|it| &mut it.observed), default: None, examples: r#"[["sea.observed.toml"]]"#,
        documentation: "What recordings on its computer showed, from the folder of mauve.toml." },
];

/// Returns whether this is a name for a report: on one line, and without a space in front.
fn is_name(text: &str) -> bool {
    !text.is_empty() && !text.starts_with([' ', '\u{a0}']) && !text.contains(char::is_control)
}

/// What is wrong with a rate beside a period, as a predicate of its key.
pub(super) const BESIDE_PERIOD: &str = "cannot be beside `period`: delete one";

/// The same of `required`.
pub(super) const BESIDE_SIGNIFICANCE: &str =
    "chooses the level, and cannot be beside `significance`: delete one";

/// The valid values of a list of CPUs, as a predicate of its key.
pub(super) const CPU_LIST: &str = "is a list of CPUs, numbered from 1 to 128, such as [1, 2]";

impl Entries {
    /// Returns the valid values of an entry of `section`, as a predicate of its `key`.
    pub(super) fn expected(&self, section: &str, key: &str) -> String {
        let with = |keys: &str| format!("is a section: `[{section}.{key}]` with {keys}");
        match self {
            Entries::Keys(_) | Entries::Types(_) => with("`cpp` and `header`"),
            Entries::Clocks(..) => with("`instances`"),
            Entries::Deployments(_) => with("`accept` or `required`"),
            Entries::Locks(_) => with("`codels` and `protocol`"),
            Entries::Hosts(_) => with("`activities`"),
            Entries::Links(_) => with("`latency`"),
            Entries::Chains(_) => with("`from` and `to`"),
            Entries::Lints => {
                r#"has an invalid severity: expected "allow", "hint", "warn" or "error""#.to_owned()
            }
        }
    }
}

impl<T> KeyKind<T> {
    /// Returns the valid values, as a predicate of the `key`.
    pub(super) fn expected(&self, key: &str) -> String {
        let text = match self {
            KeyKind::Models(_) => "is a path, or a list of paths",
            KeyKind::Tables(_) => "is a list of paths, which may have `*`",
            KeyKind::Codels(_) => "is a list of codels",
            KeyKind::Protocol(_) => r#"is "inheritance", "ceiling" or "none""#,
            KeyKind::Instances(_) => "is a list of instances",
            KeyKind::Reasons(_) => {
                "is a table of instances, each with a reason that is not empty, such as { planner = \"measured by hand\" } or { planner = { until = \"30 ms\", reason = \"measured by hand\" } }"
            }
            KeyKind::Level(_) => "is a number between 0 and 1, such as 1e-4",
            KeyKind::Required(_) => {
                "is a probability per mission, such as \"1e-6 per hour\" or \"1e-6 per 8 h\", with h, min or s"
            }
            KeyKind::Time(_) => "is a time with its unit, such as \"5 ms\"",
            KeyKind::Period(_) => "is a time greater than 0 with its unit, such as \"10 ms\"",
            KeyKind::Rate(_) => "is a number of releases per second greater than 0, such as \"30 Hz\"",
            KeyKind::CpuSets(..) => {
                "is a table of CPU sets, such as { big = [5, 6] }, with CPUs numbered from 1 to 128"
            }
            KeyKind::Cpus(_) => CPU_LIST,
            KeyKind::Others(..) => return format!("is a list of sections, such as `[[platform.{key}]]`"),
            KeyKind::DeploymentTables(..) => {
                "is a section of a deployment, such as `[timing.deployment.Sea]` with `tables`"
            }
            KeyKind::Gateway(..) => "is a table, such as { priority = 20, period = \"1 ms\", cpus = [1] }",
            KeyKind::Topics(..) => {
                "is a table of ports, each with the name of its topic, such as { \"camera.frame\" = \"/image_raw\" }"
            }
            KeyKind::Integer(from, to, _) => return format!("is a whole number from {from} to {to}"),
            KeyKind::Boolean(_) => "is true or false",
            KeyKind::Folder(_) => "is the path of a folder",
            KeyKind::Text { expected, .. } | KeyKind::Names { expected, .. } => expected,
        };
        text.to_owned()
    }

    /// Returns what a wrong value should be: less than all that is valid where the type of the value, or the reason why it
    /// is no time, says the rest.
    pub(super) fn expected_instead(&self, key: &str, is_string: bool, has_reason: bool) -> String {
        match self {
            KeyKind::Text { .. } if !is_string => "is a string".to_owned(),
            KeyKind::Time(_) if has_reason => "is a time such as \"5 ms\"".to_owned(),
            KeyKind::Period(_) if has_reason => "is a time such as \"10 ms\"".to_owned(),
            _ => self.expected(key),
        }
    }

    /// Returns what completion offers as its value.
    fn suggestions(&self) -> Suggestions {
        match self {
            KeyKind::Models(_) => Suggestions::Models,
            KeyKind::Tables(_) => Suggestions::Tables,
            KeyKind::Instances(_) => Suggestions::Instances,
            KeyKind::Codels(_) => Suggestions::Codels,
            KeyKind::Protocol(_) => Suggestions::Strings(&["inheritance", "ceiling", "none"]),
            KeyKind::Level(_) => Suggestions::Levels,
            KeyKind::Required(_) => Suggestions::Strings(&["1e-6 per hour"]),
            KeyKind::Boolean(_) => Suggestions::Words(&["true", "false"]),
            KeyKind::Time(_) => Suggestions::Strings(&["5 ms"]),
            KeyKind::Period(_) => Suggestions::Strings(&["10 ms"]),
            KeyKind::Rate(_) => Suggestions::Strings(&["30 Hz"]),
            KeyKind::Folder(_) => Suggestions::Strings(&["generated"]),
            KeyKind::Text { usual, .. } => Suggestions::Strings(usual),
            KeyKind::Names { suggestions, .. } => *suggestions,
            KeyKind::Integer(..)
            | KeyKind::Reasons(_)
            | KeyKind::Cpus(_)
            | KeyKind::CpuSets(..)
            | KeyKind::Others(..)
            | KeyKind::Gateway(..)
            | KeyKind::Topics(..)
            | KeyKind::DeploymentTables(..) => Suggestions::Words(&[]),
        }
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

/// A header that completion offers.
#[derive(Debug)]
pub struct Header {
    /// With its brackets, such as `[[platform.other]]`.
    pub label: String,
    /// What stands there.
    pub summary: &'static str,
    /// The name of a section that a file has only once.
    pub only_once: Option<&'static str>,
}

/// Returns the headers: of the sections, of the lists in them, and of the deployments in them.
pub fn headers() -> Vec<Header> {
    let section = |it: &Section| {
        let is_named = !matches!(it.entries, Entries::Keys(_) | Entries::Clocks(..) | Entries::Lints);
        let label = if is_named { format!("[{}.Name]", it.name) } else { format!("[{}]", it.name) };
        Header { label, summary: it.summary, only_once: Some(it.name).filter(|_| !is_named) }
    };
    let mut headers: Vec<Header> = SECTIONS.iter().map(section).collect();
    let all = SECTIONS.iter().flat_map(|section| {
        let keys = if let Entries::Keys(keys) = section.entries { keys } else { &[] };
        keys.iter().map(move |key| (format!("{}.{}", section.name, key.name), &key.kind))
    });
    let mut in_sections: Vec<(String, &str)> = Vec::new();
    for (name, kind) in all {
        match kind {
            KeyKind::Others(_, _, summary) => in_sections.insert(0, (format!("[[{name}]]"), summary)),
            KeyKind::DeploymentTables(_, _, summary) => in_sections.push((format!("[{name}.Name]"), summary)),
            KeyKind::CpuSets(_, summary) => in_sections.push((format!("[{name}]"), summary)),
            KeyKind::Gateway(..) => {
                in_sections.push((format!("[{name}]"), "the activity that moves samples"))
            }
            KeyKind::Topics(..) => in_sections.push((format!("[{name}]"), "the topics of ports")),
            _ => {}
        }
    }
    in_sections.push(("[clocks.Name]".to_owned(), "activities with a clock of their own"));
    let in_sections = in_sections.into_iter();
    headers.extend(in_sections.map(|(label, summary)| Header { label, summary, only_once: None }));
    headers
}

/// A key, without what it is stored in.
#[allow(missing_docs)]
pub struct KeyBelow {
    pub name: &'static str,
    /// What completion offers as its values.
    pub suggestions: Suggestions,
    pub documentation: &'static str,
    pub default: Option<&'static str>,
}

/// Returns the keys below a header, such as `platform.other` or `types.ArRobotPtr`.
pub fn keys_below(header: &str) -> Vec<KeyBelow> {
    fn one<T>(key: &'static Key<T>) -> KeyBelow {
        let Key { name, documentation, default, .. } = *key;
        KeyBelow { name, suggestions: key.kind.suggestions(), documentation, default }
    }
    fn all<T>(keys: &'static [Key<T>]) -> Vec<KeyBelow> {
        keys.iter().map(one).collect()
    }
    let (section, rest) = header.split_once('.').unwrap_or((header, ""));
    let (name, below) = rest.split_once('.').unwrap_or((rest, ""));
    match section_named(section).map(|it| &it.entries) {
        Some(Entries::Keys(keys)) if rest.is_empty() => {
            // The sections of deployments have headers of their own.
            let keys = keys.iter().filter(|it| !matches!(it.kind, KeyKind::DeploymentTables(..)));
            keys.map(one).collect()
        }
        Some(Entries::Keys(keys)) => match keys.iter().find(|it| it.name == name).map(|it| &it.kind) {
            Some(KeyKind::Others(_, keys, _)) if below.is_empty() => all(keys),
            Some(KeyKind::DeploymentTables(_, keys, _)) if !below.is_empty() => all(keys),
            Some(KeyKind::Gateway(_, keys)) if below.is_empty() => all(keys),
            Some(KeyKind::Topics(_, keys)) if !below.is_empty() => all(keys),
            _ => Vec::new(),
        },
        Some(Entries::Clocks(keys, _)) if rest.is_empty() => all(keys),
        Some(Entries::Clocks(_, keys)) => all(keys),
        Some(Entries::Types(keys)) if !rest.is_empty() => all(keys),
        Some(Entries::Locks(keys)) if !rest.is_empty() => all(keys),
        Some(Entries::Hosts(keys)) if !rest.is_empty() => all(keys),
        Some(Entries::Links(keys)) if !rest.is_empty() => all(keys),
        Some(Entries::Chains(keys)) if !rest.is_empty() => all(keys),
        Some(Entries::Deployments(keys)) if !rest.is_empty() && !rest.ends_with(".accept") => all(keys),
        _ => Vec::new(),
    }
}

/// Returns the section of that name.
pub fn section_named(name: &str) -> Option<&'static Section> {
    SECTIONS.iter().find(|section| section.name == name)
}

/// Returns the keys whose values are lists of strings, like those of chains.
pub fn list_keys() -> impl Iterator<Item = &'static str> {
    let keys = SECTIONS.iter().filter_map(|section| match &section.entries {
        Entries::Keys(keys) | Entries::Clocks(keys, _) => Some(keys.iter()),
        _ => None,
    });
    let is_list =
        |kind: &KeyKind<_>| matches!(kind, KeyKind::Models(_) | KeyKind::Tables(_) | KeyKind::Instances(_));
    keys.flatten().filter(move |key| is_list(&key.kind)).map(|key| key.name)
}
