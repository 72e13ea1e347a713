//! `mauve.toml`: the configuration of a workspace.

mod cpp;
pub mod keys;
mod reader;
mod value;

pub(crate) use reader::read;

use std::collections::BTreeMap;
use std::ops::Range;

use mauve_timing::{CpuSet, Level, Protocol, Rounding, Time, TimeError, Unit};

use crate::completeness::Completeness;
use crate::item_tree::Name;
use crate::severity::Severity;

/// A string, and its range in bytes.
pub type Located = (String, Range<usize>);

/// The content of a `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Config {
    /// `[project] root` or `roots`: paths from the configuration's folder.
    pub roots: Vec<(String, Range<usize>)>,
    /// `[timing] tables`: globs from the configuration's folder.
    pub tables: Vec<(String, Range<usize>)>,
    /// `[timing.deployment.…]`, in the order of their names: the tables of a deployment, instead of `tables`.
    pub deployment_tables: Vec<DeploymentTables>,
    /// `[timing] observed`: globs of files with what recordings showed, from the configuration's folder.
    pub observed: Vec<(String, Range<usize>)>,
    /// `[locks.…]`, in the order of their names.
    pub locks: Vec<LockConfig>,
    /// `[timing] significance`: the displayed and checked level.
    pub significance: Option<Level>,
    /// The range of the significance.
    pub significance_span: Option<Range<usize>>,
    /// `[timing] required`: how often executions may exceed their times, which chooses the level instead.
    pub required: Option<Required>,
    /// `[timing] dependent`: codels whose executions depend on earlier ones.
    pub dependent: Vec<(String, Range<usize>)>,
    /// `[assume] codel`: the execution time of a codel without an entry in the tables.
    pub assume: Option<Time>,
    /// `[platform] cpus`.
    pub cpus: Option<u32>,
    /// `[platform.cpu_sets]`, in the order of their names.
    pub cpu_sets: Vec<CpuSetConfig>,
    /// `[platform] threads`: globs, from the configuration's folder, of the files that set up the threads of the executor.
    pub threads: Vec<Located>,
    /// `[platform] rt_throttling`: whether Linux reserves 50 ms of each second for other tasks. If absent, it does not, and
    /// reports show this assumption.
    pub rt_throttling: Option<bool>,
    /// `[[platform.other]]`: real-time work that is not in the model.
    pub others: Vec<OtherConfig>,
    /// `[clocks] synchronised`: instances whose activities have one clock, with their ranges.
    pub synchronised: Vec<(String, Range<usize>)>,
    /// `[clocks.NAME]`: more clocks.
    pub clocks: Vec<ClockConfig>,
    /// `[types.…]`: types that no message package declares, in the order of their names.
    pub types: Vec<ExternalType>,
    /// `[generate] out`: the folder of the generated packages, from the configuration's folder.
    pub out: Option<(String, Range<usize>)>,
    /// `[generate] ros_streams`: whether outputs, and unconnected inputs, are also ROS topics. By default, they are.
    pub ros_streams: Option<bool>,
    /// `[generate] introspection`: whether generated components have ports with their state and execution times. By default,
    /// they have.
    pub introspection: Option<bool>,
    /// `[generate] maintainer` of the generated packages.
    pub maintainer: Option<Maintainer>,
    /// `[generate] license` of the generated packages.
    pub license: Option<String>,
    /// `[lints]`: the severity of each diagnostic, `None` to hide it, with the range of its code.
    pub lints: BTreeMap<String, (Option<Severity>, Range<usize>)>,
    /// `[deployment.…]`, in the order of their names.
    pub deployments: Vec<DeploymentConfig>,
    /// `[chains]`
    pub chains: Vec<Chain>,
    /// `[ros2]`, if the section is there.
    pub ros2: Option<Ros2Config>,
    /// `[host.…]`: the computers that the activities run on, in the order of their names; none: all run on one.
    pub hosts: Vec<HostConfig>,
    /// `[link.…]`: networks between hosts.
    pub links: Vec<LinkConfig>,
    /// `[clocks] ptp`: by how much the clocks of two hosts differ, at most; if absent, they are not synchronised.
    pub ptp: Option<Time>,
    /// The errors.
    pub errors: Vec<Mistake>,
    /// Whether the values that response times depend on are known: a misplaced key may belong to a missing header.
    pub completeness: Completeness,
}

/// `[ros2]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ros2Config {
    /// The range of the name of the section.
    pub span: Range<usize>,
    /// `domain`; if absent, 0.
    pub domain: Option<u32>,
    /// `discovery`: whether other computers are found; if absent, they are not.
    pub is_on_subnet: bool,
    /// `namespace`, such as `/uav`; if absent, none.
    pub namespace: Option<Located>,
    /// `gateway`
    pub gateway: GatewayConfig,
    /// `topics`: those of `instance.port`, in the order of the text.
    pub topics: Vec<TopicConfig>,
}

/// `gateway = { priority = 20, period = "1 ms", cpus = [1] }`
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct GatewayConfig {
    /// The range of the key.
    pub span: Range<usize>,
    /// Its priority, 2 to 99: that of the threads of the middleware is one less.
    pub priority: Option<u32>,
    /// Its period.
    pub period: Option<Time>,
    /// The CPUs that it may run on, with their range.
    pub cpus: Option<(CpuSet, Range<usize>)>,
}

/// `"pilot.command" = { name = "/cmd_vel", reliability = "best-effort", depth = 1 }`, or its name alone.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TopicConfig {
    /// `instance.port`, with its range.
    pub port: Located,
    /// `name`: absolute, or below the namespace; if absent, `instance/port`.
    pub name: Option<Located>,
    /// `reliability`: whether samples may be lost.
    pub is_best_effort: bool,
    /// `durability`: whether those who join late get the last samples.
    pub is_transient_local: bool,
    /// `depth`: how many samples are kept; if absent, 1.
    pub depth: Option<u32>,
    /// `max_bytes`: the greatest size of a sample; if absent, 1 MiB.
    pub max_bytes: Option<u32>,
}

/// `[host.eyes]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct HostConfig {
    /// Its name.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// `activities`: the instances that run on it, with their ranges.
    pub activities: Vec<Located>,
    /// `cpus`
    pub cpus: Option<u32>,
    /// `tables`: its timing tables, instead of those of `[timing]`; globs from the configuration's folder.
    pub tables: Vec<Located>,
    /// `observed`: globs of files with what its recordings showed, instead of those of `[timing]`.
    pub observed: Vec<Located>,
}

/// `[link."eyes-brain"]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LinkConfig {
    /// Its name: two hosts, joined by `-`.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// `latency`: the most time from a write on one host to its arrival on the other.
    pub latency: Option<Time>,
}

/// A C++ type that no message package declares.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ExternalType {
    /// Its name.
    pub name: Name,
    /// Its name in C++, such as `ArRobot*`; empty if missing or invalid.
    pub cpp: String,
    /// The header that declares it, as in an `#include`.
    pub header: Option<String>,
}

/// `[deployment.Sea]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeploymentConfig {
    /// The name of the deployment.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// `accept`: the instances whose deadlines need no proof.
    pub accepted: Vec<Acceptance>,
    /// `required`, instead of `[timing] required`.
    pub required: Option<Required>,
}

/// `"1e-6 per hour"`, `"1e-6 per 8 h"`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Required {
    /// The greatest probability that an execution of the mission exceeds its time.
    pub probability: Level,
    /// The length of the mission.
    pub mission: Time,
    /// Both, as they are written.
    pub written: String,
    /// Their range.
    pub span: Range<usize>,
}

impl Required {
    /// Reads a probability per mission.
    fn parse(text: &str, span: Range<usize>) -> Option<Required> {
        let (probability, mission) = text.split_once(" per ")?;
        let mission = mission.trim();
        let (count, unit) = mission.split_at(mission.find(char::is_alphabetic)?);
        let seconds = match unit {
            "h" | "hour" | "hours" => 3600,
            "min" => 60,
            "s" => 1,
            _ => return None,
        };
        let count = if count.is_empty() { "1" } else { count.trim() };
        let mission = Time::parse(count, Unit::Seconds, Rounding::Up).ok()?.checked_mul(seconds)?;
        let probability = Level::from_f64(probability.trim().parse().ok()?)?;
        let written = text.trim().to_owned();
        (mission > Time::ZERO).then_some(Required { probability, mission, written, span })
    }
}

/// `[clocks.base]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ClockConfig {
    /// Its name.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// `instances`: those whose activities have this clock, with their ranges.
    pub instances: Vec<(String, Range<usize>)>,
}

impl Config {
    /// Returns the instances whose activities have a clock in common, each with the number of its clock: 0 for `synchronised`.
    pub fn on_clocks(&self) -> impl Iterator<Item = (u32, &(String, Range<usize>))> {
        let named = (1..).zip(&self.clocks);
        let named = named.flat_map(|(number, clock)| clock.instances.iter().map(move |it| (number, it)));
        self.synchronised.iter().map(|it| (0, it)).chain(named)
    }

    /// Returns the name of the clock of this number; none for `synchronised`.
    pub fn clock_name(&self, number: u32) -> Option<&str> {
        let index = usize::try_from(number.checked_sub(1)?).ok()?;
        self.clocks.get(index).map(|clock| clock.name.as_str())
    }
}

/// `[locks.bus]`: an entry without errors has codels and a protocol.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LockConfig {
    /// Its name.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// `codels`: the keys of the codels that take it, as in timing tables.
    pub codels: Vec<(String, Range<usize>)>,
    /// `protocol`
    pub protocol: Option<Protocol>,
    /// `held`: for how long a codel executes while it holds the lock; if absent, for its whole time.
    pub held: Option<Time>,
}

/// `[timing.deployment.Sea]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeploymentTables {
    /// The name of the deployment.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// `tables`: globs from the configuration's folder.
    pub tables: Vec<(String, Range<usize>)>,
    /// `observed`: globs of files with what recordings showed.
    pub observed: Vec<(String, Range<usize>)>,
}

/// `big = [5, 6]` in `[platform.cpu_sets]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CpuSetConfig {
    /// Its name.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// Its CPUs, with their range.
    pub cpus: Option<(CpuSet, Range<usize>)>,
}

/// `[[platform.other]]`: an entry without errors has every value but the optional ones.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OtherConfig {
    /// Its name in reports, with its range.
    pub name: Option<Located>,
    /// Its priority, 1 to 99.
    pub priority: Option<u32>,
    /// The least time between two of its releases, greater than 0.
    pub period: Option<Time>,
    /// The same, as a number of releases per second.
    pub rate: Option<Time>,
    /// The greatest number of releases in a period; if absent, 1.
    pub burst: Option<u32>,
    /// The greatest execution time of each release.
    pub time: Option<Time>,
    /// The CPUs that it may run on, a bit each, with their range; if absent, all.
    pub cpus: Option<(CpuSet, Range<usize>)>,
    /// The greatest delay of a release; if absent, 0.
    pub jitter: Option<Time>,
    /// `host`: the only host that has it; if absent, each has it.
    pub host: Option<Located>,
}

/// `planner = "measured by hand"`, or `planner = { until = "30 ms", reason = "measured by hand" }`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Acceptance {
    /// The instance.
    pub instance: String,
    /// The range of the instance.
    pub span: Range<usize>,
    /// Why its deadline needs no proof; never empty.
    pub reason: String,
    /// The greatest response time with which it needs none; if absent, any, or none at all.
    pub until: Option<Time>,
}

impl Acceptance {
    /// Returns whether a missing proof is accepted with this bound of the response time; `None` for no bound.
    pub fn holds(&self, response: Option<Time>) -> bool {
        self.until.is_none_or(|until| response.is_some_and(|response| response <= until))
    }
}

/// `Ada Lovelace <ada@example.org>`
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Maintainer {
    pub name: String,
    pub email: String,
}

/// An error in a `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// The kind.
    pub kind: MistakeKind,
    /// The range, in bytes.
    pub span: Range<usize>,
    /// A similar name that is valid there.
    pub near: Option<Name>,
}

/// The kinds of errors in a `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum MistakeKind {
    /// The file cannot be read, for this reason.
    Unreadable(String),
    /// The text is not TOML: the error of the parser.
    NotToml(String),
    /// A region that git has marked because it could not merge the texts of these names.
    Conflict([String; 2]),
    /// A section has an unknown name; with the valid names.
    UnknownSection { section: String, expected: Vec<&'static str> },
    /// A key has an unknown name; with its section, such as `types.ArRobotPtr`, and the valid names there.
    UnknownKey { key: String, section: String, expected: Vec<&'static str> },
    /// A key is outside all sections.
    OutsideSections(String),
    /// The value of this key contains a string over several lines.
    SeveralLines(String),
    /// The section with this header lacks this key.
    MissingKey { key: &'static str, header: String },
    /// Two entries of this section have this name.
    RepeatedName { name: String, section: String },
    /// An instance is on a clock already.
    SecondClock(String),
    /// An entry names these CPUs, a bit each, and `cpus` of this section has this many.
    NoSuchCpu { named: CpuSet, cpus: u32, section: String },
    /// An entry names a host that has no section.
    NoSuchHost(String),
    /// The value of a key is invalid; with the valid values as a predicate, and the error of an invalid time.
    WrongValue { key: String, expected: String, error: Option<TimeError> },
}

/// `[chains.NAME]`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Chain {
    /// Its name.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// `from`: a codel, an output port or an instance, with its range.
    pub from: Option<(String, Range<usize>)>,
    /// `to`, likewise.
    pub to: Option<(String, Range<usize>)>,
    /// `through`: instances or ports on the way, in order.
    pub through: Vec<(String, Range<usize>)>,
    /// `while`: `instance.State`.
    pub states: Vec<(String, Range<usize>)>,
    /// `answers`: codels that are assumed to return `true`, and input ports, `instance.port`, that are assumed to have new data.
    pub answers: Vec<(String, Range<usize>)>,
    /// `latency`: its limit.
    pub latency: Option<Time>,
}

impl Chain {
    /// Returns what it names on its way: `from`, `through` and `to`, each with its range.
    pub fn ends(&self) -> impl Iterator<Item = &(String, Range<usize>)> {
        self.from.iter().chain(&self.through).chain(&self.to)
    }
}

impl Config {
    /// Returns the patterns of all tables: of those for every deployment, then of those of single deployments, then of those of hosts.
    pub fn all_tables(&self) -> impl Iterator<Item = &(String, Range<usize>)> + Clone {
        let of_hosts = self.hosts.iter().flat_map(|it| &it.tables);
        let of_deployments = self.deployment_tables.iter().flat_map(|it| &it.tables);
        self.tables.iter().chain(of_deployments).chain(of_hosts)
    }

    /// Returns the patterns of all files that are read beside the models: of tables, of what recordings showed, and of threads.
    pub fn all_patterns(&self) -> impl Iterator<Item = &(String, Range<usize>)> + Clone {
        self.all_tables().chain(self.all_observed()).chain(&self.threads)
    }

    /// Returns the patterns of all files with what recordings showed.
    pub fn all_observed(&self) -> impl Iterator<Item = &(String, Range<usize>)> + Clone {
        let of_deployments = self.deployment_tables.iter().flat_map(|it| &it.observed);
        let of_hosts = self.hosts.iter().flat_map(|it| &it.observed);
        self.observed.iter().chain(of_deployments).chain(of_hosts)
    }

    /// Returns whether it chooses levels by how often executions may exceed their times.
    pub fn has_required(&self) -> bool {
        self.required.is_some() || self.deployments.iter().any(|it| it.required.is_some())
    }

    /// Returns the displayed level: `[timing] significance`, otherwise 10⁻⁴.
    pub fn level(&self) -> Level {
        self.significance.unwrap_or(Level::TEN_TO_MINUS_FOUR)
    }
}

/// Returns whether the text is a valid path in an `#include <…>`, relative to the compiler's include folders.
fn is_header(text: &str) -> bool {
    let is_sign = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '+' | '.');
    let is_segment = |id: &str| !id.is_empty() && !id.starts_with(['.', '-']) && id.chars().all(is_sign);
    text.split('/').all(is_segment)
}

/// Parses `Ada Lovelace <ada@example.org>`.
fn maintainer_of(text: &str) -> Option<Maintainer> {
    let (name, rest) = text.trim().split_once('<')?;
    let (name, email) = (name.trim(), rest.strip_suffix('>')?.trim());
    let (user, host) = email.split_once('@')?;
    // The format that catkin requires.
    let are_labels = |text: &str, signs: &str| {
        let is_sign = |c: char| c.is_ascii_alphanumeric() || signs.contains(c);
        text.split('.').all(|id| !id.is_empty() && id.chars().all(is_sign))
    };
    let (_, domain) = host.rsplit_once('.')?;
    let is_domain = domain.len() > 1 && domain.chars().all(|c| c.is_ascii_alphabetic());
    let is_address = are_labels(user, "-_%+") && are_labels(host, "-") && is_domain;
    let is_valid = is_address && !name.is_empty() && !name.contains(char::is_control);
    is_valid.then(|| Maintainer { name: name.to_owned(), email: email.to_owned() })
}

/// Returns a name as a key of TOML.
///
/// ```
/// assert_eq!(mauve_hir::toml_key("Sea"), "Sea");
/// assert_eq!(mauve_hir::toml_key("boats.Sea"), r#""boats.Sea""#);
/// ```
pub fn toml_key(name: &str) -> String {
    let is_bare = |it: char| it.is_ascii_alphanumeric() || it == '_' || it == '-';
    match !name.is_empty() && name.chars().all(is_bare) {
        true => name.to_owned(),
        false => format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\"")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the errors in a text, and whether the configuration is incomplete.
    fn mistakes(text: &str) -> (Vec<MistakeKind>, bool) {
        let config = read(text);
        (config.errors.into_iter().map(|mistake| mistake.kind).collect(), config.completeness.is_incomplete())
    }

    #[test]
    fn all_keys_are_read() {
        let config = read(
            "[project]\nroot = \"a.mal\"\n[timing]\ntables = [\"t/*.toml\"]\nsignificance = 1e-6\n[timing.deployment.D]\ntables = \"d.toml\"\n\
             [types.X]\ncpp = \"X*\"\nheader = \"x/X.h\"\n[generate]\nout = \"g\"\nros_streams = false\nlicense = \"BSD\"\n\
             maintainer = \"A B <a@b.org>\"\n[assume]\ncodel = \"5 ms\"\n[platform]\ncpus = 2\nrt_throttling = true\n\
             [clocks]\nsynchronised = [\"a\", \"b\"]\nbase = { instances = [\"c\"] }\n[deployment.D]\naccept = { a = \" by hand \" }\n[chains]\nc = { from = \"a.x\" }\n[lints]\nlost-write = \"warn\"\n",
        );
        assert_eq!(config.errors, []);
        assert!(config.completeness.is_complete());
        assert_eq!(config.roots[0].0, "a.mal");
        assert_eq!(config.level().to_string(), "1e-6");
        assert_eq!(config.assume, Some(Time::from_nanos(5_000_000)));
        assert_eq!((config.cpus, config.rt_throttling), (Some(2), Some(true)));
        let [ExternalType { name, cpp, header }] = config.types.as_slice() else { panic!("one type") };
        assert_eq!((name.as_str(), cpp.as_str(), header.as_deref()), ("X", "X*", Some("x/X.h")));
        assert_eq!((config.ros_streams, config.license.as_deref()), (Some(false), Some("BSD")));
        assert_eq!(
            config.maintainer,
            Some(Maintainer { name: "A B".to_owned(), email: "a@b.org".to_owned() })
        );
        assert_eq!(config.deployment_tables[0].tables[0].0, "d.toml");
        assert_eq!(
            config.all_tables().map(|(pattern, _)| pattern).collect::<Vec<_>>(),
            ["t/*.toml", "d.toml"]
        );
        let [accepted] = config.deployments[0].accepted.as_slice() else { panic!("one acceptance") };
        assert_eq!((accepted.instance.as_str(), accepted.reason.as_str()), ("a", "by hand"));
        assert!(accepted.holds(None) && accepted.holds(Some(Time::from_nanos(u64::MAX))));
        let clocks: Vec<(u32, &str)> =
            config.on_clocks().map(|(clock, (name, _))| (clock, name.as_str())).collect();
        assert_eq!(clocks, [(0, "a"), (0, "b"), (1, "c")]);
        assert_eq!([0, 1, 2].map(|number| config.clock_name(number)), [None, Some("base"), None]);
    }

    #[test]
    fn an_acceptance_may_have_a_ceiling() {
        let of = |value: &str| read(&format!("deployment.D.accept = {{ a = {value} }}"));
        let config = of("{ until = '30 ms', reason = ' by hand ' }");
        let [accepted] = config.deployments[0].accepted.as_slice() else { panic!("one acceptance") };
        assert_eq!((accepted.reason.as_str(), config.errors.len()), ("by hand", 0));
        let ms = |time: u64| Some(Time::from_nanos(time * 1_000_000));
        assert!(accepted.holds(ms(30)) && !accepted.holds(ms(31)) && !accepted.holds(None));
        for value in [
            "{ reason = 'x' }",
            "{ until = '30 ms' }",
            "{ until = '30 ms', reason = '' }",
            "{ until = 30, reason = 'x' }",
            "{ until = '30', reason = 'x' }",
            "{ until = '30 ms', raeson = 'x' }",
            "{ until = '30 ms', reason = 'x', more = 1 }",
            "3",
        ] {
            let config = of(value);
            let accepted = config.deployments.first().map_or(0, |it| it.accepted.len());
            assert_eq!((config.errors.len(), accepted), (1, 0), "{value}");
        }
    }

    #[test]
    fn values_for_generated_code_are_valid() {
        for cpp in ["int; } evil", "X\n#include", "std::vector<int", "a>b<", "", "*", "x(\"y\")", "int x, y"]
        {
            let text = format!("[types.X]\ncpp = {cpp:?}\n");
            assert_eq!((mistakes(&text).0.len(), read(&text).types[0].cpp.as_str()), (1, ""), "{cpp}");
        }
        for header in [
            "a.h>\n#error",
            "\"",
            "",
            "a b.h",
            "/etc/passwd",
            "../a.h",
            "a/../b.h",
            "./a.h",
            "a//b.h",
            "a/",
            "-a.h",
        ] {
            let text = format!("[types.X]\nheader = {header:?}\n");
            assert_eq!(
                (mistakes(&text).0.len(), read(&text).types[0].header.is_none()),
                (1, true),
                "{header}"
            );
        }
        for maintainer in [
            "",
            "a@b.org",
            "A <a@b>",
            "A <a@b.c>",
            "A <a<b@c.org>",
            "A\n<a@b.org>B",
            "A <a..b@c.org>",
            "A <a@b.1x>",
        ] {
            let (found, is_incomplete) = mistakes(&format!("[generate]\nmaintainer = {maintainer:?}\n"));
            assert!(found.len() == 1 && !is_incomplete, "{maintainer:?}: {found:?}");
        }
        let text = "[types.X]\ncpp = \"std::map<int, const ns::T *>\"\n";
        assert_eq!(mistakes(text), (Vec::new(), false));
        for header in ["map", "a-b/c++/d_e.1.hpp"] {
            assert_eq!(mistakes(&format!("[types.X]\nheader = {header:?}\n")), (Vec::new(), false));
        }
    }

    #[test]
    fn chains_have_their_keys() {
        const AVOID: &str = "[chains.avoid]\nfrom = 'l.sweep'\nto = 'base'\nthrough = ['guide', 'mux.out']\n\
                             while = ['guide.Steering']\nanswers = 'l.sweep'\nlatency = '300 ms'\n";
        let config = read(AVOID);
        let [chain] = config.chains.as_slice() else { panic!("one chain") };
        let names = |all: &[(String, Range<usize>)]| all.iter().map(|it| it.0.clone()).collect::<Vec<_>>();
        assert_eq!((config.errors.len(), chain.name.as_str()), (0, "avoid"));
        assert_eq!(
            chain.ends().map(|(it, _)| it.as_str()).collect::<Vec<_>>(),
            ["l.sweep", "guide", "mux.out", "base"]
        );
        assert_eq!(
            (names(&chain.states), names(&chain.answers)),
            (vec!["guide.Steering".into()], vec!["l.sweep".into()])
        );
        assert_eq!(chain.latency, Some(Time::from_nanos(300_000_000)));
        // A wrong name changes no response time; a limit without a unit may be any.
        for (key, value) in [
            ("from", "''"),
            ("from", "['a.x']"),
            ("to", "'a.b.c'"),
            ("through", "['a', 1]"),
            ("while", "['guide']"),
            ("answers", "['.']"),
            ("latency", "'0 ms'"),
            ("latency", "300"),
            ("form", "'a'"),
        ] {
            let (found, is_incomplete) = mistakes(&format!("[chains.c]\n{key} = {value}\n"));
            assert_eq!(
                (found.len(), is_incomplete),
                (1, matches!(key, "latency" | "form")),
                "{key} = {value}: {found:?}"
            );
        }
        for chain in ["c = 'a.x'", "c = ['a']", "through = ['a.x']", "c = 1"] {
            assert_eq!(mistakes(&format!("[chains]\n{chain}\n")).0.len(), 1, "{chain}");
        }
    }

    #[test]
    fn what_may_hide_a_longer_time_makes_it_incomplete() {
        let (found, is_incomplete) = mistakes("[platfrm]\nrt_throttling = true\n");
        assert!(
            is_incomplete
                && matches!(found.as_slice(), [MistakeKind::UnknownSection { section, .. }] if section == "platfrm"),
            "{found:?}"
        );
        let text = "[platform]\ncpus = 0\n";
        let expected = "is a whole number from 1 to 128".to_owned();
        let kind = MistakeKind::WrongValue { key: "cpus".to_owned(), expected, error: None };
        assert_eq!(mistakes(text), (vec![kind], true));
        assert_eq!(&text[read(text).errors[0].span.clone()], "0");
        let (found, is_incomplete) = mistakes("[timing\ntables = []\n");
        assert!(is_incomplete && found.len() == 1);
    }

    #[test]
    fn a_text_over_several_lines_may_have_swallowed_others() {
        for key in ["generate.out", "generate.license", "generate.maintainer", "project.root", "types.X.cpp"]
        {
            let text = format!("{key} = \"\"\"gen\n[platform]\nrt_throttling = true\n\"\"\"\n");
            let (found, is_incomplete) = mistakes(&text);
            assert!(is_incomplete && found.len() == 1, "{key}: {found:?}");
        }
        let (found, is_incomplete) = mistakes("project.roots = [\n\"a.mal\",\n5,\n]\n");
        assert!(is_incomplete && found.len() == 1, "{found:?}");
        assert_eq!(mistakes("project.roots = [\n\"a.mal\",\n\"b.mal\",\n]\n"), (Vec::new(), false));
    }

    #[test]
    fn other_real_time_work() {
        const LAN: &str =
            "[[platform.other]]\nname = \"lan\"\npriority = 50\nperiod = \"1 ms\"\ntime = \"50 us\"\n";
        let config = read(&format!("{LAN}cpus = [1, 3]\njitter = \"0.1 ms\"\n"));
        assert_eq!((config.errors, config.completeness), (Vec::new(), Completeness::Complete));
        let [other] = config.others.as_slice() else { panic!("one") };
        assert_eq!((other.name.as_ref().map(|it| it.0.as_str()), other.priority), (Some("lan"), Some(50)));
        assert_eq!(other.cpus.as_ref().map(|(cpus, _)| *cpus), Some(CpuSet(0b101)));
        let nanos = [other.period, other.time, other.jitter].map(|time| time.map(Time::as_nanos));
        assert_eq!(nanos, [Some(1_000_000), Some(50_000), Some(100_000)]);
        assert_eq!(read(LAN).others[0].cpus, None);
        // Whatever is wrong, an interference is unknown.
        for (old, new) in [
            ("name = \"lan\"\n", ""),
            ("priority = 50\n", ""),
            ("period = \"1 ms\"\n", ""),
            ("time = \"50 us\"\n", ""),
            ("\"lan\"", "\" \""),
            ("\"lan\"", "\"a\\u001bb\""),
            ("50\n", "0\n"),
            ("50\n", "100\n"),
            ("\"1 ms\"", "\"0 ms\""),
            ("\"1 ms\"", "1"),
            ("\"1 ms\"", "\"0.1 ns\""),
            ("\"50 us\"", "50"),
            ("time", "tiem"),
            ("[[platform.other]]", "[[platform.othr]]"),
            ("[[platform.other]]", "[platform.other]"),
            ("priority", "cpus = []\npriority"),
            ("priority", "cpus = [0]\npriority"),
            ("priority", "cpus = [129]\npriority"),
            ("priority", "cpus = 1\npriority"),
        ] {
            assert!(LAN.contains(old), "{old}");
            let (found, is_incomplete) = mistakes(&LAN.replacen(old, new, 1));
            assert!(is_incomplete && found.len() == 1, "{old:?} -> {new:?}: {found:?}");
        }
        let (found, is_incomplete) = mistakes(&format!("{LAN}{LAN}"));
        assert!(is_incomplete && matches!(found.as_slice(), [MistakeKind::RepeatedName { .. }]), "{found:?}");
        let (found, is_incomplete) = mistakes(&format!("platform.cpus = 2\n{LAN}cpus = [3]\n"));
        let no_such_cpu = |cpus, section: &str| MistakeKind::NoSuchCpu {
            named: CpuSet(4),
            cpus,
            section: section.to_owned(),
        };
        assert_eq!((found, is_incomplete), (vec![no_such_cpu(2, "platform")], true));
        // Each host has its own CPUs, and work on one of them only.
        let hosts = "[host.a]\nactivities = []\ncpus = 4\n[host.b]\nactivities = []\ncpus = 1\n";
        let of = |host: &str| mistakes(&format!("platform.cpus = 2\n{LAN}cpus = [3]\n{host}\n{hosts}"));
        assert_eq!(of(""), (vec![no_such_cpu(1, "host.b")], true));
        assert_eq!(of("host = \"a\""), (Vec::new(), false));
        assert_eq!(of("host = \"b\""), (vec![no_such_cpu(1, "host.b")], true));
        assert_eq!(of("host = \"c\""), (vec![MistakeKind::NoSuchHost("c".into())], true));
        let twice = |one: &str, other: &str| mistakes(&format!("{LAN}{one}\n{LAN}{other}\n{hosts}"));
        assert_eq!(twice("host = \"a\"", "host = \"b\""), (Vec::new(), false));
        for (one, other) in [("", "host = \"b\""), ("host = \"a\"", "host = \"a\"")] {
            assert!(matches!(twice(one, other).0.as_slice(), [MistakeKind::RepeatedName { .. }]));
        }
        assert!(mistakes("platform.other = [1]").1 && mistakes("platform.other = 1").1);
    }

    #[test]
    fn tables_of_a_deployment() {
        // Whatever is wrong, a deployment would have the times of another computer.
        for text in [
            "[timing.deployment.D]\n",
            "[timing.deployment.D]\ntable = \"d.toml\"\n",
            "[timing.deployment.D]\ntables = 1\n",
            "[timing.deployment.D]\ntables = [1]\n",
            "[timing]\ndeployment = [\"d.toml\"]\n",
            "[timing.deployment]\nD = \"d.toml\"\n",
            "[timing.deployment.l.D]\ntables = \"d.toml\"\n",
            "[timing.deployments.D]\ntables = \"d.toml\"\n",
        ] {
            let (found, is_incomplete) = mistakes(text);
            assert!(is_incomplete && found.len() == 1, "{text}: {found:?}");
        }
        let text = "[timing.deployment.\"l.D\"]\ntables = []\n";
        assert_eq!(mistakes(text), (Vec::new(), false));
        assert_eq!(read(text).deployment_tables[0].tables, []);
    }

    #[test]
    fn a_section_without_its_header_makes_it_incomplete() {
        for section in
            ["[project]", "[types.X]", "[generate]", "[lints]", "[chains]", "[clocks]", "[deployment.D]"]
        {
            for key in [
                "rt_throttling = true",
                "tables = [\"t.toml\"]",
                "codel = \"5 ms\"",
                "cpus = 1",
                "platform.rt_throttling = true",
                "x.rt_throttling = true",
                "cpp.x = 1",
            ] {
                let (found, is_incomplete) = mistakes(&format!("{section}\n{key}\n"));
                assert!(is_incomplete, "{section} {key}: {found:?}");
            }
        }
    }
}
