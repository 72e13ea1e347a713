//! The control loop of ros2_control and its controllers: `controllers.yaml`.
//!
//! ```yaml
//! controller_manager:
//!   ros__parameters:
//!     update_rate: 1000
//!     thread_priority: 98
//!     cpu_affinity: [2]
//!     body_controller: { type: body_controllers/BodyController }
//! body_controller:
//!   ros__parameters:
//!     update_rate: 250
//! ```
//!
//! Names, types and defaults are those of ros-controls/ros2_control at 53b9999d (master) and 9ffbf97f (jazzy):
//! `controller_manager/src/ros2_control_node.cpp`, `controller_manager_parameters.yaml`, `controller_manager.cpp`,
//! `controller_interface/src/controller_interface_base.cpp`; and of ros-controls/realtime_tools at 0e0bca04,
//! `async_function_handler.hpp`. The file is one of parameters, as `rcl_yaml_param_parser` reads them (ros2/rcl at c19dab55): it knows
//! no aliases, and a number in quotes is a text. Of several sections for a node, the last one with a parameter counts (ros2/rclcpp at
//! a0a2a067, `parameter_map.cpp`).

use std::ops::Range;

use mauve_syntax::similar;
use mauve_timing::CpuSet;

use super::problem::{ExpectedValue, FileProblem, FileProblemKind};
use super::value::{ValueReader, YamlValue, cpu, cpus};
use super::yaml::{Lookup, NodeId, NodeKind, Yaml, parse};
use crate::completeness::Completeness;

/// The `update_rate` of a controller manager without one, in Hz.
pub const DEFAULT_UPDATE_RATE: u32 = 100;

/// The priority of a control loop, and of an asynchronous controller, without one.
pub const DEFAULT_THREAD_PRIORITY: u8 = 50;

/// The most sections of nodes, and the most controllers of a manager.
const MAX_NODES: usize = 500;

/// The most parameters.
const MAX_PARAMETERS: usize = 10_000;

/// The longest name of a node, in bytes.
const MAX_NAME: usize = 1000;

/// The keys of `async_parameters`. The affinity of hardware has another name, `affinity`.
const ASYNC_PARAMETERS: [&str; 7] = [
    "thread_priority",
    "cpu_affinity",
    "scheduling_policy",
    "execution_rate",
    "wait_until_initial_trigger",
    "print_warnings",
    "thread_name",
];

/// The words for true and false, as `rcl_yaml_param_parser` has them.
const WORDS: [[&str; 11]; 2] = [
    ["N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"],
    ["Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"],
];

/// A `controllers.yaml`.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct ControllersFile {
    /// The controller managers, in the order of the file.
    pub managers: Vec<ControllerManager>,
    /// What is wrong.
    pub problems: Vec<FileProblem>,
    /// Whether its readers take the file, and read these values.
    pub completeness: Completeness,
}

/// A controller manager: its thread is the control loop, with the policy `SCHED_FIFO`.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct ControllerManager {
    /// The absolute name, such as `/controller_manager`; it may have wildcards: `/**/controller_manager`.
    pub name: String,
    /// The place of its parameters, in bytes.
    pub range: Range<usize>,
    /// `update_rate` in Hz; see [`DEFAULT_UPDATE_RATE`].
    pub update_rate: YamlValue<u32>,
    /// `thread_priority`, from 1 to 99; see [`DEFAULT_THREAD_PRIORITY`].
    pub thread_priority: YamlValue<u8>,
    /// `cpu_affinity`: Linux's CPUs, from 0; absent: those of the process.
    pub affinity: YamlValue<CpuSet>,
    /// Its controllers, in the order of the file.
    pub controllers: Vec<Controller>,
}

impl ControllerManager {
    /// Returns the namespace of its controllers.
    pub fn namespace(&self) -> &str {
        self.name.strip_suffix("/controller_manager").unwrap_or_default()
    }
}

impl Controller {
    /// Returns whether it may have a thread of its own. The control loop does not execute it then, unless `is_async` is unknown.
    pub fn has_thread(&self) -> bool {
        !matches!(self.is_async, YamlValue::Absent | YamlValue::Known { value: false, .. })
    }
}

/// A controller.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Controller {
    /// The name, without a namespace.
    pub name: String,
    /// The place of its name in the parameters of the manager, or of the type in its own section.
    pub name_range: Range<usize>,
    /// The place of its own parameters, if the file has some.
    pub parameters: Option<Range<usize>>,
    /// `update_rate` in Hz; absent, and 0: that of the manager.
    pub update_rate: YamlValue<u32>,
    /// `is_async`; absent: false.
    pub is_async: YamlValue<bool>,
    /// `async_parameters.thread_priority`, else `thread_priority`, from 1 to 99; see [`DEFAULT_THREAD_PRIORITY`].
    pub thread_priority: YamlValue<u8>,
    /// `async_parameters.cpu_affinity`: Linux's CPUs, from 0; absent: those of the process.
    pub affinity: YamlValue<CpuSet>,
}

/// The parameters of one or several nodes.
struct NodeSection {
    /// The absolute name of the node, perhaps with wildcards.
    pattern: String,
    parameters: NodeId,
    /// The index of the first section with this name: the reader merges them there.
    first: usize,
}

/// Reads a `controllers.yaml`.
pub fn read_controllers(text: &str) -> ControllersFile {
    let yaml = parse(text);
    let mut reader = ValueReader { yaml: &yaml, problems: Vec::new() };
    let mut sections = Vec::new();
    if let Some(root) = yaml.root() {
        if yaml.mapping(root).is_none() {
            reader.wrong_kind("", ExpectedValue::Mapping, yaml.range(root));
        }
        collect_sections(&mut reader, root, "", &mut sections);
        sections.sort_by_key(|it| it.first);
    }
    let sizes = sections.iter().filter_map(|it| yaml.mapping(it.parameters)).map(<[_]>::len);
    if sizes.sum::<usize>() > MAX_PARAMETERS {
        reader.problem(FileProblemKind::TooLarge, 0..0);
        sections.clear();
    }
    for alias in yaml.nodes.iter().filter(|it| matches!(it.kind, NodeKind::Alias(_))) {
        reader.problem(FileProblemKind::Alias, alias.range.clone());
    }
    let mut managers: Vec<&NodeSection> = Vec::new();
    let is_manager = |it: &&NodeSection| it.pattern.ends_with("/controller_manager");
    for section in sections.iter().filter(is_manager) {
        if !managers.iter().any(|it| applies(&section.pattern, &it.pattern) == Some(true)) {
            managers.retain(|it| applies(&it.pattern, &section.pattern) != Some(true));
            managers.push(section);
        }
    }
    if managers.is_empty() {
        // A section of all nodes may have the parameters of the manager.
        let has_types = |it: &&NodeSection| it.pattern == "/**" && !types(&yaml, it.parameters).is_empty();
        managers.extend(sections.iter().find(has_types));
    }
    let managers = managers.into_iter().map(|own| manager(&mut reader, &sections, own)).collect();
    // A node may have several sections, also with the same name.
    let (problems, completeness) = reader.finish(|it| {
        let is_inside = |section: &NodeSection| yaml.range(section.parameters).contains(&it.range.start);
        !matches!(it.kind, FileProblemKind::RepeatedKey(_)) || sections.iter().any(is_inside)
    });
    ControllersFile { managers, problems, completeness }
}

/// Collects the sections of nodes: keys make their names, until `ros__parameters`.
fn collect_sections(
    reader: &mut ValueReader<'_>,
    mapping: NodeId,
    name: &str,
    sections: &mut Vec<NodeSection>,
) {
    let yaml = reader.yaml;
    for &[key, value] in yaml.mapping(mapping).unwrap_or_default() {
        // A doubt about the key is a problem of its own. The reader stops at the first error.
        let Some(text) = yaml.key(key).filter(|_| reader.problems.is_empty()) else { continue };
        let is_alias = matches!(yaml.node(value).kind, NodeKind::Alias(_));
        if is_alias || yaml.mapping(value).is_none() {
            reader.wrong_kind(text, ExpectedValue::Mapping, yaml.range(key));
        } else if sections.len() >= MAX_NODES || name.len() + text.len() > MAX_NAME {
            return reader.problem(FileProblemKind::TooLarge, yaml.range(key));
        } else if text == "ros__parameters" {
            let first = sections.iter().position(|it| it.pattern == name).unwrap_or(sections.len());
            sections.push(NodeSection { pattern: name.to_owned(), parameters: value, first });
        } else {
            collect_sections(reader, value, &format!("{name}/{}", text.trim_matches('/')), sections);
        }
    }
}

/// Returns whether the parameters of a section are those of a node; `Some(false)`: perhaps.
fn applies(pattern: &str, node: &str) -> Option<bool> {
    let last = |it: &'_ str| it.rsplit('/').next().map(str::to_owned).unwrap_or_default();
    let (of_pattern, of_node) = (last(pattern), last(node));
    if [node, "/**"].contains(&pattern) || pattern.strip_prefix("/**/") == Some(&of_node) {
        return Some(true);
    }
    // The namespace of a manager for which the file has a wildcard is unknown.
    let has_wildcard = pattern.contains('*') || node.contains('*');
    (has_wildcard && (of_pattern == of_node || of_pattern.contains('*'))).then_some(false)
}

/// Returns the controllers in the parameters of a manager: those with a type.
fn types(yaml: &Yaml, parameters: NodeId) -> Vec<(&str, NodeId)> {
    let controller = |[key, value]: &[NodeId; 2]| {
        let name = yaml.key(*key)?;
        let is_nested = matches!(yaml.find(*value, "type"), Lookup::Found(_));
        let dotted = name.strip_suffix(".type").filter(|name| !name.contains('.'));
        dotted.or(is_nested.then_some(name)).map(|name| (name, *key))
    };
    yaml.mapping(parameters).unwrap_or_default().iter().filter_map(controller).collect()
}

/// The parameters of a node.
struct Parameters<'s> {
    /// The sections that may have some, in the order of the file, and whether they are certainly of the node.
    sections: Vec<(&'s NodeSection, bool)>,
    /// The place of the name of another file with parameters.
    elsewhere: Option<Range<usize>>,
}

impl<'s> Parameters<'s> {
    fn of(node: &str, sections: &'s [NodeSection]) -> Parameters<'s> {
        let found = sections.iter().filter_map(|it| applies(&it.pattern, node).map(|is_its| (it, is_its)));
        Parameters { sections: found.collect(), elsewhere: None }
    }

    /// Returns a parameter: that of the last section that has it.
    fn value<T>(&self, mut read: impl FnMut(NodeId) -> YamlValue<T>) -> YamlValue<T> {
        for (section, is_its) in self.sections.iter().rev() {
            let found = read(section.parameters);
            match found.range() {
                Some(range) if !is_its || self.elsewhere.is_some() => {
                    return YamlValue::Unknown(range.clone());
                }
                Some(_) => return found,
                None => {}
            }
        }
        self.elsewhere.clone().map_or(YamlValue::Absent, YamlValue::Unknown)
    }

    fn integer<T: TryFrom<i64>>(
        &self,
        reader: &mut ValueReader<'_>,
        key: &str,
        (least, most): (i64, i64),
    ) -> YamlValue<T> {
        self.value(|it| reader.integer(it, key, least..=most, true))
    }

    fn cpus(&self, reader: &mut ValueReader<'_>, key: &str, may_be_number: bool) -> YamlValue<CpuSet> {
        let read = |yaml: &Yaml, node| {
            let cpus = cpus(yaml, node, true).filter(|it| !it.is_empty());
            cpus.or_else(|| cpu(yaml, node, true).filter(|_| may_be_number))
        };
        self.value(|it| reader.value(it, key, ExpectedValue::Cpus, read))
    }
}

fn manager(reader: &mut ValueReader<'_>, sections: &[NodeSection], own: &NodeSection) -> ControllerManager {
    let yaml = reader.yaml;
    let parameters = Parameters::of(&own.pattern, sections);
    let namespace = own.pattern.strip_suffix("/controller_manager").unwrap_or(&own.pattern);
    // A manager has many parameters; these are read here.
    const READ: [&str; 3] = ["update_rate", "thread_priority", "cpu_affinity"];
    reader.unknown_keys(own.parameters, |key| READ.contains(&key) || similar(key, READ).is_none());
    let mut names: Vec<_> = parameters.sections.iter().flat_map(|it| types(yaml, it.0.parameters)).collect();
    // The spawner of controllers takes a type from the controller's own section, too.
    names.extend(sections.iter().filter_map(|section| {
        let (of, name) = section.pattern.rsplit_once('/')?;
        let Lookup::Found(class) = yaml.find(section.parameters, "type") else { return None };
        ([namespace, "/**"].contains(&of) && !name.contains('*')).then_some((name, class))
    }));
    names.sort_by_key(|it| (it.0, it.1.0));
    names.dedup_by_key(|it| it.0);
    names.sort_by_key(|it| it.1.0);
    if names.len() > MAX_NODES {
        reader.problem(FileProblemKind::TooLarge, yaml.range(own.parameters));
        names.truncate(MAX_NODES);
    }
    let controllers = names.into_iter().map(|(name, key)| {
        let own = Parameters::of(&format!("{namespace}/{name}"), sections);
        controller(reader, &parameters, own, (name, key))
    });
    let controllers = controllers.collect();
    ControllerManager {
        name: own.pattern.clone(),
        range: yaml.range(own.parameters),
        update_rate: parameters.integer(reader, "update_rate", (1, i32::MAX.into())),
        thread_priority: parameters.integer(reader, "thread_priority", (1, 99)),
        affinity: parameters.cpus(reader, "cpu_affinity", true),
        controllers,
    }
}

fn controller(
    reader: &mut ValueReader<'_>,
    of_manager: &Parameters<'_>,
    mut own: Parameters<'_>,
    (name, key): (&str, NodeId),
) -> Controller {
    let yaml = reader.yaml;
    let file = of_manager.value(|it| match yaml.find(it, &format!("{name}.params_file")) {
        Lookup::Absent => YamlValue::<()>::Absent,
        Lookup::Unknown(range) => YamlValue::Unknown(range),
        Lookup::Found(node) => YamlValue::Unknown(yaml.range(node)),
    });
    own.elsewhere = file.range().cloned();
    if let Some(range) = file.range() {
        reader.problem(FileProblemKind::ParametersElsewhere, range.clone());
    }
    for (section, _) in &own.sections {
        if let Lookup::Found(parameters) = yaml.find(section.parameters, "async_parameters") {
            reader.unknown_keys(parameters, |key| ASYNC_PARAMETERS.contains(&key));
        }
    }
    let mut thread_priority = own.integer(reader, "async_parameters.thread_priority", (1, 99));
    if thread_priority.range().is_none() {
        thread_priority = own.integer(reader, "thread_priority", (1, 99));
        if let Some(range) = thread_priority.range() {
            reader.problem(FileProblemKind::DeprecatedPriority, range.clone());
        }
    }
    // The control loop starts controllers: they cannot be `detached`.
    let _: YamlValue<()> =
        own.value(|it| reader.named(it, "async_parameters.scheduling_policy", (&["synchronized"], &[()])));
    let parameters = own.sections.iter().rfind(|it| it.1 && !it.0.pattern.contains('*'));
    let boolean = |yaml: &Yaml, node| {
        let text = yaml.plain(node)?;
        WORDS.iter().position(|words| words.contains(&text)).map(|it| it > 0)
    };
    Controller {
        name: name.to_owned(),
        name_range: yaml.range(key),
        parameters: parameters.map(|it| yaml.range(it.0.parameters)),
        update_rate: own.integer(reader, "update_rate", (0, i32::MAX.into())),
        is_async: own.value(|it| reader.value(it, "is_async", ExpectedValue::Bool, boolean)),
        thread_priority,
        affinity: own.cpus(reader, "async_parameters.cpu_affinity", false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known<T: Clone>(value: &YamlValue<T>) -> T {
        value.known().expect("a value").clone()
    }

    fn kinds(file: &ControllersFile) -> Vec<&FileProblemKind> {
        file.problems.iter().map(|it| &it.kind).collect()
    }

    const FILE: &str = "\
controller_manager:
  ros__parameters:
    update_rate: 1000  # Hz
    thread_priority: 98
    cpu_affinity: [2]
    joint_state_broadcaster:
      type: joint_state_broadcaster/JointStateBroadcaster
    body_controller:
      type: body_controllers/BodyController
    predictive.type: body_controllers/PredictiveController

body_controller:
  ros__parameters:
    update_rate: 250
    joints: [hip, knee, ankle]

predictive:
  ros__parameters:
    update_rate: 20
    is_async: true
    async_parameters:
      scheduling_policy: synchronized
      thread_priority: 40
    async_parameters.cpu_affinity: [3, 1]
";

    #[test]
    fn the_control_loop_and_its_controllers_are_read() {
        let file = read_controllers(FILE);
        assert_eq!((kinds(&file), file.completeness.is_complete()), (vec![], true));
        let [manager] = file.managers.as_slice() else { panic!("{file:?}") };
        assert_eq!(manager.name, "/controller_manager");
        assert_eq!((known(&manager.update_rate), known(&manager.thread_priority)), (1000, 98));
        assert_eq!(known(&manager.affinity), CpuSet::of(2));
        assert_eq!(&FILE[manager.update_rate.range().unwrap().clone()], "1000");
        assert!(FILE[manager.range.clone()].starts_with("update_rate: 1000"));
        let [broadcaster, body, predictive] = manager.controllers.as_slice() else { panic!("{manager:?}") };
        assert_eq!((broadcaster.name.as_str(), &broadcaster.parameters), ("joint_state_broadcaster", &None));
        assert_eq!(
            (&broadcaster.update_rate, &broadcaster.is_async),
            (&YamlValue::Absent, &YamlValue::Absent)
        );
        assert_eq!(known(&body.update_rate), 250);
        assert!(FILE[body.parameters.clone().unwrap()].starts_with("update_rate: 250"));
        assert_eq!(
            (predictive.name.as_str(), &FILE[predictive.name_range.clone()]),
            ("predictive", "predictive.type")
        );
        assert!(known(&predictive.is_async));
        assert_eq!(
            (known(&predictive.thread_priority), known(&predictive.affinity)),
            (40, CpuSet::of(3) | CpuSet::of(1))
        );
    }

    #[test]
    fn namespaces_and_wildcards_name_nodes() {
        let manager = "ros__parameters: {update_rate: 50, a: {type: p/A}}";
        let own = "ros__parameters: {update_rate: 25}";
        for (text, name, rate) in [
            (
                format!("/ns/controller_manager: {{{manager}}}\n/ns/a: {{{own}}}\n"),
                "/ns/controller_manager",
                "25",
            ),
            (
                format!("ns: {{controller_manager: {{{manager}}}, a: {{{own}}}}}\n"),
                "/ns/controller_manager",
                "25",
            ),
            (
                format!("/ns/controller_manager: {{{manager}}}\na: {{{own}}}\n"),
                "/ns/controller_manager",
                "absent",
            ),
            (
                format!("/**/controller_manager: {{{manager}}}\n/**/a: {{{own}}}\n"),
                "/**/controller_manager",
                "25",
            ),
            (
                format!("/**: {{controller_manager: {{{manager}}}, a: {{{own}}}}}\n"),
                "/**/controller_manager",
                "25",
            ),
            (
                format!("/**/controller_manager: {{{manager}}}\na: {{{own}}}\n"),
                "/**/controller_manager",
                "unknown",
            ),
            (format!("/**: {{{manager}}}\n/a: {{{own}}}\n"), "/**", "unknown"),
            (
                format!("controller_manager: {{{manager}}}\n/*/a: {{{own}}}\n"),
                "/controller_manager",
                "unknown",
            ),
            (format!("controller_manager: {{{manager}}}\n/**: {{{own}}}\n"), "/controller_manager", "25"),
            (format!("/**: {{controller_manager: {{{manager}}}}}\n/**: {{a: {{{own}}}}}\n"), "/**/controller_manager", "25"),
            ("controller_manager: {ros__parameters: {}}\na: {ros__parameters: {type: p/A, update_rate: 7}}\n".to_owned(), "/controller_manager", "7"),
            (format!("/**/controller_manager: {{{manager}}}\n/**/b: {{{own}}}\n"), "/**/controller_manager", "absent"),
            (format!("/**/controller_manager: {{{manager}}}\n/x/*: {{{own}}}\n"), "/**/controller_manager", "unknown"),
            (format!("controller_manager: {{{manager}}}\n/**: {{ros__parameters: {{type: p/A, update_rate: 5}}}}\n"), "/controller_manager", "5"),
            // Sections with one name are one; the last section counts.
            (
                format!("a: {{{own}}}\ncontroller_manager: {{{manager}}}\n/**/a: {{ros__parameters: {{update_rate: 5}}}}\na: {{ros__parameters: {{update_rate: 6}}}}\n"),
                "/controller_manager",
                "5",
            ),
            (
                format!(
                    "controller_manager: {{{manager}}}\na: {{{own}}}\n/**/a: {{ros__parameters: {{update_rate: 5}}}}\n"
                ),
                "/controller_manager",
                "5",
            ),
        ] {
            let file = read_controllers(&text);
            assert_eq!((kinds(&file), file.managers.len()), (vec![], 1), "{text}");
            assert_eq!((file.managers[0].name.as_str(), file.managers[0].controllers.len()), (name, 1));
            let found = match &file.managers[0].controllers[0].update_rate {
                YamlValue::Known { value, .. } => value.to_string(),
                YamlValue::Unknown(_) => "unknown".to_owned(),
                YamlValue::Absent => "absent".to_owned(),
            };
            assert_eq!(found, rate, "{text}");
        }
        let two = format!(
            "/l/controller_manager: {{{manager}}}\n/r/controller_manager: {{{manager}}}\n/**/controller_manager: {{ros__parameters: {{thread_priority: 3}}}}\n"
        );
        let file = read_controllers(&two);
        assert_eq!(file.managers.iter().map(|it| known(&it.thread_priority)).collect::<Vec<_>>(), [3, 3]);
    }

    #[test]
    fn wrong_values_are_unknown_and_never_absent() {
        let manager = |parameters: &str| {
            let file = read_controllers(&format!(
                "controller_manager:\n  ros__parameters: {{{parameters}, a.type: p/A}}\n"
            ));
            let count = file.problems.len();
            assert_eq!(file.completeness.is_complete(), count == 0);
            (file.managers.into_iter().next().unwrap(), count)
        };
        for rate in ["0", "-1", "'100'", "100.0", "0100", "fast", "~", "", "[100]", "1e3"] {
            let (manager, count) = manager(&format!("update_rate: {rate}"));
            assert!(matches!(manager.update_rate, YamlValue::Unknown(_)) && count == 1, "{rate}");
        }
        for cpus in ["[]", "-1", "128", "[a]", "['1']", "'1'", "{a: 1}"] {
            let (manager, count) = manager(&format!("cpu_affinity: {cpus}"));
            assert!(matches!(manager.affinity, YamlValue::Unknown(_)) && count == 1, "{cpus}");
        }
        assert_eq!(known(&manager("cpu_affinity: 0").0.affinity), CpuSet::of(0));
        let controller = |parameters: &str| {
            let file = read_controllers(&format!(
                "controller_manager: {{ros__parameters: {{a.type: p/A}}}}\na: {{ros__parameters: {{{parameters}}}}}\n"
            ));
            let problems = file.problems.into_iter().map(|it| it.kind).collect::<Vec<_>>();
            (file.managers.into_iter().next().unwrap().controllers.remove(0), problems)
        };
        for is_async in ["'true'", "1", "tRue", "[true]"] {
            let (controller, problems) = controller(&format!("is_async: {is_async}"));
            assert!(
                matches!(controller.is_async, YamlValue::Unknown(_)) && problems.len() == 1,
                "{is_async}"
            );
        }
        assert_eq!(
            ["on", "Y", "OFF", "no"].map(|it| known(&controller(&format!("is_async: {it}")).0.is_async)),
            [true, true, false, false]
        );
        let (it, problems) = controller(
            "async_parameters: {scheduling_policy: other, cpu_affinity: 1, thread_priority: 0}, thread_priority: 3",
        );
        assert_eq!(problems.len(), 3);
        assert!(matches!((it.affinity, it.thread_priority), (YamlValue::Unknown(_), YamlValue::Unknown(_))));
        let (it, problems) =
            controller("async_parameters: {scheduling_policy: detached}, thread_priority: 3");
        let (key, expected) = ("async_parameters.scheduling_policy", ExpectedValue::OneOf(&["synchronized"]));
        let refused = FileProblemKind::WrongKind { key: key.to_owned(), expected };
        assert_eq!(problems, [refused, FileProblemKind::DeprecatedPriority]);
        assert_eq!(known(&it.thread_priority), 3);
        let (it, _) = controller("async_parameters: 3");
        assert!(matches!(it.thread_priority, YamlValue::Unknown(_)));
        let (it, problems) = controller("update_rate: 3, update_rate: 4");
        assert!(matches!(it.update_rate, YamlValue::Unknown(_)) && problems.len() == 1);
        let (it, problems) = controller("async_parameters: {affinity: [3], thread_name: x}");
        assert_eq!(
            (it.affinity, problems),
            (YamlValue::Absent, vec![FileProblemKind::UnknownKey("affinity".to_owned())])
        );
        // A manager has parameters that are not read here.
        let keys = "thread_prioritty: 3, cpu_affinitys: 1, lock_memory: true, defaults.allow: true";
        let file = read_controllers(&format!("controller_manager: {{ros__parameters: {{{keys}}}}}\n"));
        let unread: Vec<_> = file.problems.into_iter().map(|it| it.kind).collect();
        let unknown = |it: &str| FileProblemKind::UnknownKey(it.to_owned());
        assert_eq!(unread, [unknown("thread_prioritty"), unknown("cpu_affinitys")]);
        // The values of another file are unknown.
        let file = read_controllers(
            "controller_manager: {ros__parameters: {a: {type: p/A, params_file: x.yaml}}}\n",
        );
        assert!(matches!(file.managers[0].controllers[0].is_async, YamlValue::Unknown(_)));
        assert_eq!(kinds(&file), [&FileProblemKind::ParametersElsewhere]);
    }

    #[test]
    fn files_that_their_reader_refuses_are_incomplete() {
        for text in [
            "x: &a 1\n",
            "controller_manager: 3\n",
            "- a\n",
            "a",
            "a: {ros__parameters: [\n",
            "a: {ros__parameters: }\n",
        ] {
            let file = read_controllers(text);
            assert!(!file.problems.is_empty() && file.completeness.is_incomplete(), "{text}");
        }
        let file = read_controllers("a: {ros__parameters: {x: &x 1, y: *x}}\n");
        assert_eq!(kinds(&file), [&FileProblemKind::Alias]);
        assert_eq!(read_controllers("").managers, []);
        let many: String =
            (0..2 * MAX_NODES).map(|it| format!("n{it}: {{ros__parameters: {{}}}}\n")).collect();
        assert_eq!(kinds(&read_controllers(&many)), [&FileProblemKind::TooLarge]);
    }
}
