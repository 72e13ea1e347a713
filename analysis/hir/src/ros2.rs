//! The topics of ROS 2 of a deployment: which port is which topic, with its type and its quality of service; and the host of each
//! instance.
//!
//! ```toml
//! [ros2]
//! gateway = { priority = 20, period = "1 ms", cpus = [1] }
//! topics = { "camera.frame" = "/image_raw" }
//! ```

pub(crate) mod check;

use std::fmt;

use mauve_timing::Time;
use rustc_hash::FxHashSet;

use crate::ModelDb;
use crate::config::{Config, TopicConfig};
use crate::flat::{Flat, deployed};
use crate::hosts::{Hosts, hosts_of};
use crate::item_tree::{FeatureKind, Name};
use crate::link::Link;
use crate::project::{Project, config_of};
use crate::source::Decl;
use crate::types::{Integer, Type};

/// The greatest size of a sample, where `max_bytes` is not written.
const MAX_BYTES: u32 = 1 << 20;

/// What a deployment exchanges by ROS 2, and on which hosts its instances run.
#[derive(Debug, Clone, PartialEq, Eq, Default, salsa::SalsaValue)]
pub struct Ros2 {
    /// The topics, in the order of the instances and their ports. A connection between hosts has two: that of its output, and that of
    /// its input.
    pub topics: Vec<Topic>,
    /// Whether hosts find each other: `discovery` is `"subnet"`.
    pub is_on_subnet: bool,
    /// The names of the hosts, in their order; empty: there is one computer, without a name.
    pub hosts: Vec<Name>,
    /// The most time that the network between two hosts takes, by their indices: an assumption. Of two for one pair, the greatest counts.
    pub latencies: Vec<([usize; 2], Time)>,
}

/// A port that is a topic.
#[derive(Debug, Clone, PartialEq, Eq, salsa::SalsaValue)]
pub struct Topic {
    /// The instance, and its port.
    pub port: (Name, Name),
    /// Whether the robot publishes it: the port is an output.
    pub is_published: bool,
    /// Its absolute name, such as `/uav/camera/frame`.
    pub name: Name,
    /// The type of its samples.
    pub ty: TopicType,
    /// The number of samples that are kept, and moved in a period of the gateway at most; at least 1.
    pub depth: u32,
    /// Whether samples may be lost.
    pub is_best_effort: bool,
    /// Whether those who join late get the last samples.
    pub is_transient_local: bool,
    /// The greatest size of a sample, in bytes.
    pub max_bytes: u32,
    /// The index of its host in [`Ros2::hosts`]; 0 without any.
    pub host: usize,
    /// Why it is a topic.
    pub origin: TopicOrigin,
}

/// The type of the samples of a topic.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct TopicType {
    /// The package, such as `sensor_msgs`.
    pub package: Name,
    /// The message, such as `LaserScan`.
    pub message: Name,
    /// Whether the port has the type of its only field `data`: a `double` is a `std_msgs/Float64`.
    pub is_wrapped: bool,
}

/// Why a port is a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum TopicOrigin {
    /// `[ros2] topics` names it: the index of its entry.
    Written(usize),
    /// Nothing is connected to it.
    Unconnected,
    /// This connection, by its index in [`Flat::links`], leads to another host.
    AcrossHosts(usize),
}

impl Ros2 {
    /// Returns the topic of a port.
    pub fn topic(&self, instance: &str, port: &str) -> Option<&Topic> {
        self.topics.iter().find(|it| it.port.0 == instance && it.port.1 == port)
    }

    /// Returns the topics of a host.
    pub fn topics_of(&self, host: usize) -> impl Iterator<Item = &Topic> {
        self.topics.iter().filter(move |it| it.host == host)
    }

    /// Returns the name of the gateway of a host, that of its activity: `ros2`, or `ros2@eyes`.
    pub fn gateway(&self, host: usize) -> Name {
        match self.hosts.get(host) {
            Some(host) => format!("ros2@{host}").into(),
            None => "ros2".into(),
        }
    }

    /// Returns the ends of a connection that leads to another host, its output first; it is no connection of one program.
    pub fn across(&self, link: &Link<'_>) -> Option<[&Topic; 2]> {
        let [(writer, output), (reader, input)] = [&link.source, &link.target];
        let ends = [self.topic(writer, output)?, self.topic(reader, input)?];
        // An input with two connections has the name of one output: the other one does not reach it.
        let is_topic = ends[0].is_published && !ends[1].is_published && ends[0].name == ends[1].name;
        let is_across = self.is_on_subnet && ends[0].host != ends[1].host;
        (!link.operation && is_across && is_topic).then_some(ends)
    }

    /// Returns the most time that a sample takes from one host to another, if that is known: an assumption.
    pub fn latency(&self, one: usize, other: usize) -> Option<Time> {
        let is_it = |ends: &[usize; 2]| *ends == [one, other] || *ends == [other, one];
        self.latencies.iter().filter(|(ends, _)| is_it(ends)).map(|(_, latency)| *latency).max()
    }
}

impl TopicType {
    /// Returns the type of samples of a port: a message, or the message of `std_msgs` that wraps a plain value.
    pub fn of(ty: &Type) -> Option<TopicType> {
        let wrapping = match ty {
            Type::Message(package, message) => {
                let (package, message) = (package.clone(), message.clone());
                return Some(TopicType { package, message, is_wrapped: false });
            }
            Type::Bool => "Bool",
            Type::Integer(Integer::Int) => "Int32",
            Type::Integer(Integer::Short) => "Int16",
            Type::Integer(Integer::Int8) => "Int8",
            Type::Integer(Integer::Long | Integer::Int64) => "Int64",
            Type::Integer(Integer::Uint8) => "UInt8",
            Type::Integer(Integer::Uint16) => "UInt16",
            Type::Integer(Integer::Uint32) => "UInt32",
            Type::Integer(Integer::Uint64) => "UInt64",
            Type::Float => "Float32",
            Type::Double => "Float64",
            Type::String => "String",
            _ => return None,
        };
        Some(TopicType { package: "std_msgs".into(), message: wrapping.into(), is_wrapped: true })
    }
}

/// As the tools of ROS 2 write it: `sensor_msgs/msg/LaserScan`.
impl fmt::Display for TopicType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/msg/{}", self.package, self.message)
    }
}

/// Returns the topics and hosts of a deployment; nothing without `[ros2]` and `[host.…]`.
#[salsa::tracked(returns(ref))]
pub fn ros2_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, deployment: Decl<'db>) -> Ros2 {
    let workspace = project.workspace(db);
    let (config, hosts) = (config_of(db, workspace), hosts_of(db, workspace));
    let names = hosts.all.iter().map(|it| it.name.clone()).collect();
    let (Some(section), Some((flat, _))) = (&config.ros2, deployed(db, project, deployment)) else {
        return Ros2 { hosts: names, ..Ros2::default() };
    };
    let latencies = config.links.iter().filter_map(|it| Some((ends_of_link(config, &it.name)?, it.latency?)));
    let mut found = Ros2 {
        is_on_subnet: section.is_on_subnet,
        hosts: names,
        topics: Vec::new(),
        latencies: latencies.collect(),
    };
    let links = flat.links.iter().filter(|link| !link.operation);
    let connected: FxHashSet<&(Name, Name)> = links.flat_map(|it| [&it.source, &it.target]).collect();
    for instance in flat.instances.iter().filter(|it| !it.repeated) {
        let features = instance.features(db, project);
        for feature in features.into_iter().flat_map(|it| it.by_name.values()).filter_map(|it| it.first()) {
            if !feature.kind.is_port() {
                continue;
            }
            let Some(data) = feature.data(db) else { continue };
            let port = (instance.name.clone(), data.name.name.clone());
            let Some(ty) = TopicType::of(&feature.ty(db, project)) else { continue };
            let full = format!("{}.{}", port.0, port.1);
            let written = config.ros2.iter().flat_map(|it| &it.topics).position(|it| it.port.0 == full);
            let is_across = |it: &Link<'_>| {
                let is_end = !it.operation && (it.source == port || it.target == port);
                is_end && hosts.of(&it.source.0) != hosts.of(&it.target.0)
            };
            let across = flat.links.iter().position(is_across);
            let is_free = || !connected.contains(&port) && !ty.is_wrapped;
            let origin = match (across, written) {
                (Some(link), _) => Some(TopicOrigin::AcrossHosts(link)),
                (None, Some(index)) => Some(TopicOrigin::Written(index)),
                (None, None) => is_free().then_some(TopicOrigin::Unconnected),
            };
            let Some(origin) = origin else { continue };
            let written = written.and_then(|index| config.ros2.as_ref()?.topics.get(index));
            let named = named_port(flat, origin, &port);
            let mut topic = topic((config, hosts), &port, named, feature.kind, ty, written, origin);
            // What a connection keeps on one host, it keeps between two.
            if across.is_some() && written.is_none_or(|it| it.depth.is_none()) {
                let buffers = flat.links.iter().filter(|it| is_across(it)).filter_map(|it| it.buffer);
                topic.depth = topic.depth.max(buffers.max().unwrap_or_default());
            }
            found.topics.push(topic);
        }
    }
    found
}

/// Returns the port that gives a topic its name: the output of a connection between hosts.
fn named_port<'a>(flat: &'a Flat<'_>, origin: TopicOrigin, port: &'a (Name, Name)) -> &'a (Name, Name) {
    match origin {
        TopicOrigin::AcrossHosts(link) => flat.links.get(link).map_or(port, |link| &link.source),
        _ => port,
    }
}

fn topic(
    (config, hosts): (&Config, &Hosts),
    port: &(Name, Name),
    named: &(Name, Name),
    kind: FeatureKind,
    ty: TopicType,
    written: Option<&TopicConfig>,
    origin: TopicOrigin,
) -> Topic {
    let full = format!("{}.{}", named.0, named.1);
    let topics = config.ros2.iter().flat_map(|it| &it.topics);
    let name = topics.filter(|it| it.port.0 == full).find_map(|it| it.name.as_ref());
    let name = name.map_or_else(|| format!("{}/{}", named.0, named.1), |(name, _)| name.clone());
    let namespace =
        config.ros2.as_ref().and_then(|it| it.namespace.as_ref()).map(|(it, _)| it.trim_matches('/'));
    let name = match (name.starts_with('/'), namespace.unwrap_or_default()) {
        (true, _) => name,
        (false, "") => format!("/{name}"),
        (false, namespace) => format!("/{namespace}/{name}"),
    };
    Topic {
        port: port.clone(),
        is_published: kind == FeatureKind::Output,
        name: name.into(),
        ty,
        depth: written.and_then(|it| it.depth).unwrap_or(1),
        is_best_effort: written.is_some_and(|it| it.is_best_effort),
        is_transient_local: written.is_some_and(|it| it.is_transient_local),
        max_bytes: written.and_then(|it| it.max_bytes).unwrap_or(MAX_BYTES),
        host: hosts.of(&port.0).unwrap_or_default(),
        origin,
    }
}

/// Returns the hosts that a link such as `eyes-brain` joins; none if it may join two pairs, such as `a-b-c`.
fn ends_of_link(config: &Config, name: &str) -> Option<[usize; 2]> {
    let mut pairs = pairs_of_link(config, name);
    pairs.next().filter(|_| pairs.next().is_none())
}

fn pairs_of_link(config: &Config, name: &str) -> impl Iterator<Item = [usize; 2]> {
    let host = |name: &str| config.hosts.iter().position(|it| it.name == name);
    let pairs =
        name.match_indices('-').filter_map(move |(at, _)| Some([host(&name[..at])?, host(&name[at + 1..])?]));
    pairs.filter(|[one, other]| one != other)
}
