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
//! no aliases, and a number in quotes is a text. Of several sections for a node, the last one with a parameter counts.

use std::ops::Range;

use mauve_timing::CpuSet;

use super::problem::{ExpectedValue, FileProblem, FileProblemKind};
use super::value::{ValueReader, YamlValue, cpus, integer};
use super::yaml::{Lookup, NodeId, NodeKind, Yaml, parse};
use crate::completeness::Completeness;

/// The `update_rate` of a controller manager without one, in Hz.
pub const DEFAULT_UPDATE_RATE: u32 = 100;

/// The priority of a control loop, and of an asynchronous controller, without one.
pub const DEFAULT_THREAD_PRIORITY: u8 = 50;

/// The most sections of nodes, and the most controllers of a manager.
const MAX_NODES: usize = 1000;

/// The longest name of a node, in bytes.
const MAX_NAME: usize = 1000;

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

/// A controller.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Controller {
    /// The name, without a namespace.
    pub name: String,
    /// The place of its name in the parameters of the manager, or as a section.
    pub name_range: Range<usize>,
    /// The place of its own parameters, if the file has some.
    pub parameters: Option<Range<usize>>,
    /// `type`; absent: only its section shows that it is a controller.
    pub class: YamlValue<String>,
    /// `update_rate` in Hz; absent, and 0: that of the manager.
    pub update_rate: YamlValue<u32>,
    /// `is_async`; absent: false.
    pub is_async: YamlValue<bool>,
    /// `async_parameters.scheduling_policy`; absent: synchronized.
    pub scheduling: YamlValue<AsyncScheduling>,
    /// `async_parameters.thread_priority`, from 1 to 99; see [`DEFAULT_THREAD_PRIORITY`].
    pub thread_priority: YamlValue<u8>,
    /// `async_parameters.cpu_affinity`: Linux's CPUs, from 0; absent: those of the process.
    pub affinity: YamlValue<CpuSet>,
}

/// What starts an asynchronous controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum AsyncScheduling {
    /// The control loop.
    Synchronized,
    /// A loop of its own; controllers refuse it.
    Detached,
}

/// The parameters of one or several nodes.
struct NodeSection {
    /// The name of the node, perhaps with wildcards.
    pattern: String,
    key: NodeId,
    parameters: NodeId,
}

/// Reads a `controllers.yaml`.
pub fn read_controllers(text: &str) -> ControllersFile {
    let yaml = parse(text);
    let mut reader = ValueReader { yaml: &yaml, problems: Vec::new() };
    let mut sections = Vec::new();
    if let Some(root) = yaml.root() {
        if yaml.is_mapping(root) {
            collect_sections(&mut reader, root, "", &mut sections);
        } else {
            reader.wrong_kind("", ExpectedValue::Mapping, yaml.node(root).range.clone());
        }
    }
    for alias in yaml.nodes().iter().filter(|it| matches!(it.kind, NodeKind::Alias(_))) {
        reader.problem(FileProblemKind::Alias, alias.range.clone());
    }
    let managers = manager_sections(&yaml, &sections).into_iter();
    let managers = managers.map(|section| manager(&mut reader, &sections, section)).collect();
    let mut problems = reader.problems;
    problems.extend(yaml.problems);
    problems.sort_by_key(|it| it.range.start);
    // A value in a section for several nodes is read once for each of them.
    problems.dedup();
    let completeness = Completeness::of(!problems.iter().any(|it| it.kind.is_error()));
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
    for &(key, value) in yaml.entries(mapping) {
        let range = || yaml.node(key).range.clone();
        // A doubt about the key is a problem of its own.
        let Some(text) = yaml.key(key) else { continue };
        let is_mapping = yaml.is_mapping(value) && !matches!(yaml.node(value).kind, NodeKind::Alias(_));
        if !is_mapping {
            reader.wrong_kind(text, ExpectedValue::Mapping, range());
        } else if sections.len() >= MAX_NODES || name.len() + text.len() > MAX_NAME {
            reader.problem(FileProblemKind::TooLarge, range());
            return;
        } else if text == "ros__parameters" {
            sections.push(NodeSection { pattern: name.to_owned(), key, parameters: value });
        } else {
            let name = format!("{name}/{}", text.trim_matches('/'));
            collect_sections(reader, value, &name, sections);
        }
    }
}

/// Returns the sections of controller managers. A section for several nodes is one if the file has none for a single manager.
fn manager_sections<'s>(yaml: &Yaml, sections: &'s [NodeSection]) -> Vec<&'s NodeSection> {
    let is_manager = |it: &&NodeSection| it.pattern.ends_with("/controller_manager");
    let mut found: Vec<&NodeSection> = sections.iter().filter(is_manager).collect();
    if found.is_empty() {
        let has_types =
            |it: &&NodeSection| it.pattern.ends_with('*') && !types(yaml, it.parameters).is_empty();
        found.extend(sections.iter().find(has_types));
    }
    let all = found.clone();
    found.retain(|one| !all.iter().any(|it| it.pattern != one.pattern && matches(&one.pattern, &it.pattern)));
    let mut names = Vec::new();
    found.retain(|one| {
        !names.contains(&&one.pattern) && {
            names.push(&one.pattern);
            true
        }
    });
    found
}

/// Returns the names of controllers in the parameters of a manager: those with a type.
fn types(yaml: &Yaml, parameters: NodeId) -> Vec<(&str, NodeId)> {
    let is_controller = |(key, value): &(NodeId, NodeId)| {
        let name = yaml.key(*key)?;
        let dotted = name.strip_suffix(".type").filter(|name| !name.contains('.'));
        let nested = || (yaml.find(*value, "type") != Lookup::Absent).then_some(name);
        dotted.or_else(nested).map(|name| (name, *key))
    };
    yaml.entries(parameters).iter().filter_map(is_controller).collect()
}

/// Returns whether a name of nodes with wildcards (`*`: one part, `**`: any parts) is that of a node.
fn matches(pattern: &str, name: &str) -> bool {
    let parts =
        |text: &'_ str| text.split('/').filter(|it| !it.is_empty()).map(str::to_owned).collect::<Vec<_>>();
    let (pattern, name) = (parts(pattern), parts(name));
    let (mut at, mut of_name, mut star) = (0, 0, None);
    while of_name < name.len() {
        match (pattern.get(at), &mut star) {
            (Some(part), _) if part == "**" => {
                star = Some((at, of_name));
                at += 1;
            }
            (Some(part), _) if part == "*" || *part == name[of_name] => {
                at += 1;
                of_name += 1;
            }
            (_, Some((star, from))) => {
                *from += 1;
                (at, of_name) = (*star + 1, *from);
            }
            _ => return false,
        }
    }
    pattern[at..].iter().all(|part| part == "**")
}

/// The sections that set parameters of a node, in the order of the file; `false`: perhaps.
type Sections<'s> = Vec<(&'s NodeSection, bool)>;

fn sections_of<'s>(sections: &'s [NodeSection], name: &str) -> Sections<'s> {
    let has_wildcard = name.contains('*');
    let last = |text: &'_ str| text.rsplit('/').next().map(str::to_owned);
    let applies = |it: &'s NodeSection| match matches(&it.pattern, name) {
        true => Some((it, true)),
        false => (has_wildcard && last(&it.pattern) == last(name)).then_some((it, false)),
    };
    sections.iter().filter_map(applies).collect()
}

/// Returns a parameter of a node: that of the last section that has it.
fn parameter<T>(sections: &Sections<'_>, mut read: impl FnMut(NodeId) -> YamlValue<T>) -> YamlValue<T> {
    for (section, is_certain) in sections.iter().rev() {
        let found = read(section.parameters);
        match found.range() {
            Some(range) if !is_certain => return YamlValue::Unknown(range.clone()),
            Some(_) => return found,
            None => {}
        }
    }
    YamlValue::Absent
}

fn manager(reader: &mut ValueReader<'_>, sections: &[NodeSection], own: &NodeSection) -> ControllerManager {
    let yaml = reader.yaml;
    let of_manager = sections_of(sections, &own.pattern);
    let namespace = own.pattern.strip_suffix("/controller_manager").unwrap_or(&own.pattern);
    let mut names: Vec<(&str, NodeId)> = Vec::new();
    for (section, _) in &of_manager {
        names.extend(types(yaml, section.parameters));
    }
    names.sort_by_key(|it| it.0);
    names.dedup_by_key(|it| it.0);
    for section in sections {
        let Some((of, name)) = section.pattern.rsplit_once('/') else { continue };
        let has = |key| yaml.find(section.parameters, key) != Lookup::Absent;
        let is_controller = of == namespace && !name.contains('*') && name != "controller_manager";
        if is_controller
            && names.binary_search_by_key(&name, |it| it.0).is_err()
            && ["update_rate", "is_async", "async_parameters"].into_iter().any(has)
        {
            let range = yaml.node(section.key).range.clone();
            reader.problem(FileProblemKind::ControllerWithoutType(name.to_owned()), range);
            names.push((name, section.key));
            names.sort_by_key(|it| it.0);
        }
    }
    if names.len() > MAX_NODES {
        reader.problem(FileProblemKind::TooLarge, yaml.node(own.parameters).range.clone());
        names.truncate(MAX_NODES);
    }
    names.sort_by_key(|it| yaml.node(it.1).range.start);
    let update_rate =
        parameter(&of_manager, |it| reader.integer(it, "update_rate", 1..=i32::MAX.into(), true));
    let thread_priority = parameter(&of_manager, |it| reader.integer(it, "thread_priority", 1..=99, true));
    let affinity = parameter(&of_manager, |it| {
        reader.value(it, "cpu_affinity", ExpectedValue::Cpus, |yaml, node| {
            let one = || integer(yaml, node, true).and_then(|it| u32::try_from(it).ok()).map(CpuSet::of);
            cpus(yaml, node, true).or_else(one).filter(|it| !it.is_empty())
        })
    });
    let controllers = names
        .into_iter()
        .map(|(name, key)| {
            controller(reader, &of_manager, &sections_of(sections, &format!("{namespace}/{name}")), name, key)
        })
        .collect();
    let range = yaml.node(own.parameters).range.clone();
    ControllerManager {
        name: own.pattern.clone(),
        range,
        update_rate,
        thread_priority,
        affinity,
        controllers,
    }
}

fn controller(
    reader: &mut ValueReader<'_>,
    of_manager: &Sections<'_>,
    sections: &Sections<'_>,
    name: &str,
    key: NodeId,
) -> Controller {
    let yaml = reader.yaml;
    let class = parameter(of_manager, |it| reader.text(it, &format!("{name}.type")));
    let mut elsewhere = None;
    for (section, _) in of_manager {
        match yaml.find(section.parameters, &format!("{name}.params_file")) {
            Lookup::Absent => {}
            Lookup::Unknown(range) => elsewhere = Some(range),
            Lookup::Found(node) => elsewhere = Some(yaml.node(node).range.clone()),
        }
    }
    if let Some(range) = &elsewhere {
        reader.problem(FileProblemKind::ParametersElsewhere, range.clone());
    }
    let update_rate = parameter(sections, |it| reader.integer(it, "update_rate", 0..=i32::MAX.into(), true));
    let is_async = parameter(sections, |it| reader.value(it, "is_async", ExpectedValue::Bool, boolean));
    let scheduling = parameter(sections, |it| {
        let values = [AsyncScheduling::Synchronized, AsyncScheduling::Detached];
        reader.named(it, "async_parameters.scheduling_policy", (&["synchronized", "detached"], &values))
    });
    if let YamlValue::Known { value: AsyncScheduling::Detached, range } = &scheduling {
        reader.problem(FileProblemKind::DetachedController, range.clone());
    }
    let mut thread_priority =
        parameter(sections, |it| reader.integer(it, "async_parameters.thread_priority", 1..=99, true));
    if is_async.range().is_some() && thread_priority.range().is_none() {
        thread_priority = parameter(sections, |it| reader.integer(it, "thread_priority", 1..=99, true));
        if let Some(range) = thread_priority.range() {
            reader.problem(FileProblemKind::DeprecatedPriority, range.clone());
        }
    }
    let affinity = parameter(sections, |it| {
        reader.value(it, "async_parameters.cpu_affinity", ExpectedValue::Cpus, |yaml, node| {
            cpus(yaml, node, true).filter(|it| !it.is_empty())
        })
    });
    let own = sections.iter().rev().find(|it| it.1 && !it.0.pattern.ends_with('*'));
    Controller {
        name: name.to_owned(),
        name_range: yaml.node(key).range.clone(),
        parameters: own.map(|it| yaml.node(it.0.parameters).range.clone()),
        class,
        update_rate: unless(update_rate, &elsewhere),
        is_async: unless(is_async, &elsewhere),
        scheduling: unless(scheduling, &elsewhere),
        thread_priority: unless(thread_priority, &elsewhere),
        affinity: unless(affinity, &elsewhere),
    }
}

/// Returns an unknown value if another file may have it.
fn unless<T>(value: YamlValue<T>, elsewhere: &Option<Range<usize>>) -> YamlValue<T> {
    match elsewhere {
        Some(range) => YamlValue::Unknown(range.clone()),
        None => value,
    }
}

/// Returns a truth value as `rcl_yaml_param_parser` has it.
fn boolean(yaml: &Yaml, id: NodeId) -> Option<bool> {
    let text = yaml.text(id).filter(|_| yaml.is_plain(id))?;
    match text {
        "Y" | "y" | "yes" | "Yes" | "YES" | "true" | "True" | "TRUE" | "on" | "On" | "ON" => Some(true),
        "N" | "n" | "no" | "No" | "NO" | "false" | "False" | "FALSE" | "off" | "Off" | "OFF" => Some(false),
        _ => None,
    }
}

impl ControllersFile {
    /// Returns the file without places and problems, to compare values.
    pub(super) fn placeless(self) -> Vec<ControllerManager> {
        let controller = |it: Controller| Controller {
            name: it.name,
            name_range: 0..0,
            parameters: it.parameters.map(|_| 0..0),
            class: it.class.placeless(),
            update_rate: it.update_rate.placeless(),
            is_async: it.is_async.placeless(),
            scheduling: it.scheduling.placeless(),
            thread_priority: it.thread_priority.placeless(),
            affinity: it.affinity.placeless(),
        };
        let manager = |it: ControllerManager| ControllerManager {
            name: it.name,
            range: 0..0,
            update_rate: it.update_rate.placeless(),
            thread_priority: it.thread_priority.placeless(),
            affinity: it.affinity.placeless(),
            controllers: it.controllers.into_iter().map(controller).collect(),
        };
        self.managers.into_iter().map(manager).collect()
    }
}
