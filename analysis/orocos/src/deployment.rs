//! A deployment with all names and values resolved, from which `script.rs`, `launch.rs` and `standalone/program.rs` generate.

use std::collections::BTreeSet;

use mauve_hir::item_tree::Name;
use mauve_hir::{
    Decl, FeatureOf, Flat, FlatInstance, Hosts, Integer, Location, ModelDb, Type, Value, ValueInEffect,
    closure, core as core_data, core_of, deployment, file_and_line, hosts_of, platform_of, values_in_effect,
};
use mauve_timing::{CpuSet, Needs, Order, Time};
use mauve_wcrt::{Priority, ResolvedActivity, system_of};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::component::{is_set_from_text, ports_of_introspection};
use crate::cpp_name::{file_name, script_name, task_name};
use crate::library::{Model, topological_order};

/// The period of a background activity without a period.
///
/// The paper executes such a component "sporadically": when it has work to do. RTT runs a component without a period
/// once at its start, and then only when it is triggered. New data on an input alone must not be what does: a state
/// machine also waits for operations, and for what its own codels find. To run again at once, without a pause, would
/// keep a CPU busy with nothing. So it runs again soon after each run: the pause is a period that is counted from the
/// run before.
const BACKGROUND_PERIOD: Time = Time::from_nanos(10_000_000);

pub(crate) const BACKGROUND: &str = "A background activity without a period: it runs again 10 ms after it \
    began, or when it has ended. Set `period` in its activity to change that.";

/// A deployment, with run-time names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RunnableDeployment {
    pub(crate) name: String,
    /// The name in the model, with its library: `guide.Museum`.
    pub(crate) qualified: String,
    /// The host whose part it is; none: all of it.
    pub(crate) host: Option<Name>,
    pub(crate) package: String,
    pub(crate) description: String,
    /// The packages of its components, those that others call first.
    pub(crate) packages: Vec<String>,
    /// The instances, in the order of the text.
    pub(crate) tasks: Vec<DeployedTask>,
    /// The connections between ports, in the order of the text: source, target and buffer size; `None` if it holds
    /// the last value only.
    pub(crate) connections: Vec<([String; 2], Option<u32>)>,
    /// Required and provided operation.
    pub(crate) operations: Vec<[String; 2]>,
    /// The numbers of the tasks, those that provide operations before those that require them.
    order: Vec<usize>,
    /// The topics, if ports are streamed.
    pub(crate) streams: Option<TopicStreams>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DeployedTask {
    pub(crate) name: String,
    /// The class: `motion::Guidance`.
    pub(crate) class: String,
    /// The properties whose values differ from the defaults of the class: names, values, and whether scripts can set
    /// them only from a string.
    pub(crate) values: Vec<(String, Value, bool)>,
    pub(crate) has_values: bool,
    /// The task of its activity, with the CPUs that a script can set.
    pub(crate) activity: mauve_timing::Task,
    /// The inputs whose data release it, if some do.
    pub(crate) triggers: Vec<String>,
    /// Whether it needs data at each of them.
    pub(crate) needs_all: bool,
    /// The number of its activity, in the order of threads.
    place: usize,
}

impl RunnableDeployment {
    /// The instances, in the order in which they are loaded, configured and started.
    pub(crate) fn in_order(&self) -> impl DoubleEndedIterator<Item = &DeployedTask> {
        self.order.iter().filter_map(|&number| self.tasks.get(number))
    }

    /// The instances by thread, in the order of the text: those that one thread executes, in that order.
    pub(crate) fn threads(&self) -> Vec<Vec<&DeployedTask>> {
        let mut threads: Vec<Vec<&DeployedTask>> = Vec::new();
        let mut numbers: FxHashMap<u32, usize> = FxHashMap::default();
        for task in &self.tasks {
            let new = threads.len();
            let number = task.activity.thread.map_or(new, |thread| *numbers.entry(thread).or_insert(new));
            match threads.get_mut(number) {
                Some(thread) => thread.push(task),
                None => threads.push(vec![task]),
            }
        }
        threads.iter_mut().for_each(|thread| thread.sort_by_key(|task| task.place));
        threads
    }
}

/// Whether the instances of a thread have releases of their own.
pub(crate) fn is_queue(thread: &[&DeployedTask]) -> bool {
    thread.iter().any(|task| task.activity.order != Order::List)
}

impl DeployedTask {
    /// Returns the period of its activity; a default one where it has none.
    pub(crate) fn period(&self) -> Time {
        self.activity.period.unwrap_or(BACKGROUND_PERIOD)
    }

    /// Returns this period in seconds, as scripts write it.
    pub(crate) fn seconds(&self) -> String {
        seconds(self.period())
    }
}

/// Ports that are streamed to ROS topics: outputs, and inputs without a connection.
///
/// An input with two writers has a queue for each of them, and reads both values as new. Also, any ROS node could
/// write to an input that the model connects to one component only.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct TopicStreams {
    /// The packages to import for their types.
    pub(crate) packages: BTreeSet<String>,
    /// Port and topic.
    pub(crate) topics: Vec<[String; 2]>,
    /// The ports that show the state and the execution times of components.
    pub(crate) shown: Vec<[String; 2]>,
    /// Ports whose types are not messages.
    pub(crate) left_out: Vec<String>,
}

impl TopicStreams {
    /// Port and topic, of all ports that are streamed.
    pub(crate) fn all_topics(&self) -> impl Iterator<Item = &[String; 2]> {
        self.topics.iter().chain(&self.shown)
    }
}

/// Resolves a deployment of a library, or what one of its hosts has of it: its instances, and the connections between them.
/// `task_name` returns the name that an instance has at run time. `None` if its architecture is incomplete.
pub(crate) fn deployed<'db>(
    model: Model<'_, 'db>,
    of: Decl<'db>,
    host: Option<usize>,
    task_name: fn(&str) -> String,
) -> Option<RunnableDeployment> {
    let Model { db, project, libraries, library } = model;
    let (flat, target) = mauve_hir::deployed(db, project, of)?;
    let activities = Activities::new(model, of, flat);
    let hosts = hosts_of(db, project.workspace(db));
    let is_here = |instance: &Name| host.is_none() || hosts.of(instance) == host;
    let instances = flat.instances.iter().filter(|it| is_here(&it.name));
    let tasks: Vec<DeployedTask> = instances
        .filter_map(|it| {
            Some(DeployedTask { name: task_name(&it.name), ..task(model, of, &activities, it)? })
        })
        .collect();
    let end =
        |(instance, feature): &(Name, Name)| format!("{}.{}", task_name(instance), script_name(feature));
    let links = flat.links.iter().filter(|it| is_here(&it.source.0) && is_here(&it.target.0));
    let connections = links.clone().filter(|link| !link.operation);
    let operations = links.filter(|link| link.operation);
    let used: FxHashSet<&str> =
        tasks.iter().filter_map(|task| Some(task.class.split_once("::")?.0)).collect();
    let packages = libraries.all.iter().map(|library| library.package.clone());
    let with_streams = model.config().ros_streams != Some(false);
    // If two tasks have one name, the first counts.
    let numbers: FxHashMap<&str, usize> =
        tasks.iter().enumerate().rev().map(|(number, task)| (task.name.as_str(), number)).collect();
    let number = |instance: &Name| numbers.get(task_name(instance).as_str()).copied();
    let mut required: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); tasks.len()];
    for link in operations.clone() {
        if let (Some(requires), Some(provides)) = (number(&link.target.0), number(&link.source.0)) {
            required[requires].insert(provides);
        }
    }
    // In a script, the last instance of a thread executes the others: it starts after them, and stops before.
    let mut last: FxHashMap<u32, usize> = FxHashMap::default();
    for (index, task) in tasks.iter().enumerate() {
        let Some(thread) = task.activity.thread else { continue };
        let last = last.entry(thread).or_insert(index);
        if tasks.get(*last).is_some_and(|other| other.place < task.place) {
            *last = index;
        }
    }
    for (index, task) in tasks.iter().enumerate() {
        let last = task.activity.thread.and_then(|thread| last.get(&thread).copied());
        if let Some(last) = last.filter(|last| *last != index) {
            required[index].remove(&last);
            required[last].insert(index);
        }
    }
    Some(RunnableDeployment {
        name: file_name(of.name(db)),
        qualified: of.qualified(db),
        host: host.and_then(|it| hosts.all.get(it)).map(|it| it.name.clone()),
        package: library.package.clone(),
        description: format!(
            "Deployment `{}` of architecture `{}` ({}).",
            of.qualified(db),
            target.qualified(db),
            file_and_line(db, model.workspace(), &Location::name_of(of)),
        ),
        packages: packages.filter(|package| used.contains(package.as_str())).collect(),
        order: topological_order(&required),
        connections: connections.map(|link| ([end(&link.source), end(&link.target)], link.buffer)).collect(),
        operations: operations.clone().map(|link| [end(&link.target), end(&link.source)]).collect(),
        streams: with_streams.then(|| streams(model, flat)),
        tasks,
    })
}

/// What a deployment says of its instances, by their names.
struct Activities<'db> {
    /// The first of each name.
    resolved: FxHashMap<&'db Name, (usize, &'db ResolvedActivity<'db>)>,
    /// The first affinity that is written.
    affinities: FxHashMap<&'db Name, Option<CpuSet>>,
    /// The properties and constants that are set, by the deployment or by an architecture.
    settings: FxHashMap<&'db Name, FxHashSet<&'db Name>>,
}

impl<'db> Activities<'db> {
    fn new(model: Model<'_, 'db>, of: Decl<'db>, flat: &'db Flat<'db>) -> Activities<'db> {
        let Model { db, project, .. } = model;
        let resolved = system_of(db, project, of).activities.iter().enumerate().rev();
        let resolved = resolved.map(|(place, it)| (&it.instance, (place, it))).collect();
        let data = deployment(db, of);
        let platform = platform_of(db, project.workspace(db));
        let mut affinities = FxHashMap::default();
        for activity in data.into_iter().flat_map(|data| &data.activities) {
            let cpus = platform.cpus_of(activity).map(|(_, cpus)| cpus);
            for instance in &activity.instances {
                affinities.entry(&instance.name).or_insert(cpus);
            }
        }
        let own = data.into_iter().flat_map(|data| &data.settings).filter_map(|it| it.endpoint.as_ref());
        let own = own.filter_map(|it| Some((&it.instance.name, &it.feature.as_ref()?.name)));
        let flat = flat.settings.iter().map(|(instance, name)| (instance, name));
        let mut settings: FxHashMap<&Name, FxHashSet<&Name>> = FxHashMap::default();
        for (instance, name) in own.chain(flat) {
            settings.entry(instance).or_default().insert(name);
        }
        Activities { resolved, affinities, settings }
    }
}

fn task<'db>(
    model: Model<'_, 'db>,
    of: Decl<'db>,
    activities: &Activities<'db>,
    instance: &FlatInstance<'db>,
) -> Option<DeployedTask> {
    let Model { db, project, .. } = model;
    db.unwind_if_revision_cancelled();
    let component = instance.component?;
    let class = model.libraries.qualified(component)?.trim_start_matches("::").to_owned();
    let in_effect = values_in_effect(db, project, of).get(&instance.name)?;
    let set = set_values(db, activities.settings.get(&instance.name), in_effect);
    let features = model.features(component).into_iter();
    let by_feature: FxHashMap<FeatureOf<'db>, &ValueInEffect<'db>> =
        in_effect.iter().map(|it| (it.declared, it)).collect();
    let values = features.filter_map(|feature| by_feature.get(feature).copied());
    let value = |it: &ValueInEffect<'db>| {
        let data = it.declared.data(db)?;
        let ty = model.type_of(it.declared.shell, data.ty.as_ref());
        Some((script_name(&it.name), it.value.clone()?, is_set_from_text(&ty)))
    };
    let &(place, resolved) = activities.resolved.get(&instance.name)?;
    Some(DeployedTask {
        name: instance.name.to_string(),
        class,
        values: values.filter(|it| set.contains(&it.name)).filter_map(value).collect(),
        has_values: !in_effect.is_empty(),
        activity: activity(hosts_of(db, project.workspace(db)), activities, resolved),
        triggers: resolved.trigger.iter().flat_map(|it| &it.ports).map(|port| script_name(port)).collect(),
        needs_all: resolved.trigger.as_ref().is_some_and(|it| it.needs == Needs::All),
        place,
    })
}

/// Returns the properties and constants of an instance that are set, and those whose default depends on one of them: the
/// constructor of the class has computed that default before.
fn set_values<'db>(
    db: &'db dyn ModelDb,
    settings: Option<&FxHashSet<&'db Name>>,
    values: &'db [ValueInEffect<'db>],
) -> FxHashSet<&'db Name> {
    let Some(settings) = settings else { return FxHashSet::default() };
    let mut dependents: FxHashMap<&Name, Vec<&Name>> = FxHashMap::default();
    for it in values {
        let default = it.declared.data(db).and_then(|data| data.value.as_ref());
        for name in default.into_iter().flat_map(|default| default.names()) {
            dependents.entry(name).or_default().push(&it.name);
        }
    }
    let set = values.iter().map(|it| &it.name).filter(|it| settings.contains(it));
    closure(set, |name| dependents.get(name).into_iter().flatten().copied()).into_iter().collect()
}

fn activity(
    hosts: &Hosts,
    activities: &Activities<'_>,
    resolved: &ResolvedActivity<'_>,
) -> mauve_timing::Task {
    let affinity = activities.affinities.get(&resolved.instance).copied().flatten();
    // An activity without an affinity runs on the CPUs of the analysis.
    let of_analysis = resolved.cpus.map(|cpus| hosts.local(cpus).1);
    let affinity =
        if resolved.priority == Priority::Background { affinity } else { of_analysis.or(affinity) };
    let cpus = affinity.filter(|cpus| !cpus.is_empty());
    mauve_timing::Task { cpus, ..resolved.task.clone() }
}

/// Returns seconds, such as `0.1` for 100 ms: exact, and always with a point.
fn seconds(time: Time) -> String {
    let nanos = time.as_nanos();
    let text = format!("{}.{:09}", nanos / 1_000_000_000, nanos % 1_000_000_000);
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

fn streams<'db>(model: Model<'_, 'db>, flat: &Flat<'db>) -> TopicStreams {
    let Model { db, project, .. } = model;
    let introspection = model.config().introspection != Some(false);
    let connections = flat.links.iter().filter(|link| !link.operation);
    let connected: FxHashSet<_> = connections.map(|link| (&link.target.0, &link.target.1)).collect();
    let mut streams = TopicStreams::default();
    for instance in &flat.instances {
        let Some(component) = instance.component else { continue };
        let features = model.features(component);
        let features: Vec<_> = features.iter().filter_map(|it| Some((it, it.data(db)?))).collect();
        if introspection {
            let names: Vec<String> = features.iter().map(|(_, it)| script_name(&it.name.name)).collect();
            let [state, period] = ports_of_introspection(&names);
            let core = core_of(db, project, component).and_then(|of| core_data(db, of));
            let has_machine = core.is_some_and(|core| !core.machines.is_empty());
            for port in has_machine.then_some(state).into_iter().chain([period]) {
                let [task, topic] = [task_name(&instance.name), instance.name.to_string()];
                streams.shown.push([format!("{task}.{port}"), format!("{topic}/{port}")]);
                streams.packages.insert("rtt_std_msgs".to_owned());
            }
        }
        for (port, data) in features.into_iter().filter(|(port, _)| port.kind.is_port()) {
            let name = &data.name.name;
            if connected.contains(&(&instance.name, name)) {
                continue;
            }
            let ty = model.type_of(port.shell, data.ty.as_ref());
            let end = format!("{}.{}", task_name(&instance.name), script_name(name));
            let Some(package) = topic_package(&ty) else {
                streams.left_out.push(end);
                continue;
            };
            streams.packages.insert(format!("rtt_{package}"));
            streams.topics.push([end, format!("{}/{name}", instance.name)]);
        }
    }
    streams
}

/// Returns the message package whose typekit streams values of a type.
pub(crate) fn topic_package(ty: &Type) -> Option<String> {
    match ty {
        Type::Message(package, _) => Some(package.to_string()),
        // Its messages wrap plain numbers, strings and Booleans.
        Type::Integer(Integer::Char) => None,
        Type::Bool | Type::Integer(_) | Type::Float | Type::Double | Type::String => {
            Some("std_msgs".to_owned())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_are_exact() {
        let of = |nanos| seconds(Time::from_nanos(nanos));
        assert_eq!([of(100_000_000), of(1), of(1_000_000_000)], ["0.1", "0.000000001", "1.0"]);
        assert_eq!(of(33_333_333), "0.033333333");
        assert_eq!(of(u64::MAX), "18446744073.709551615");
    }
}
