//! Checks of topics, hosts and links. Without `[ros2]` and `[host.…]`, there is nothing to check.

use std::ops::Range;

use rustc_hash::FxHashSet;

use super::{Ros2, Topic, TopicOrigin, TopicType, ends_of_link, pairs_of_link, ros2_of};
use crate::config::{Config, TopicConfig};
use crate::fact::{Fact, FactKind, InvalidName, Quality, Ros2Fact, Unmapped};
use crate::flat::{Flat, deployed};
use crate::hosts::hosts_of;
use crate::item_tree::{FeatureKind, Name};
use crate::messages::package;
use crate::msg::BUILT_IN_TYPES;
use crate::names::similar;
use crate::project::{Project, config_file, config_of, platform_of};
use crate::source::{Decl, Location, deployment};
use crate::types::Type;
use crate::{ModelDb, Workspace};

/// Messages nested deeper than this may contain themselves.
const DEEPEST: usize = 16;

/// The most bytes of the name of a topic with its prefix `rt`.
const LONGEST_NAME: usize = 255;

/// Returns whether `mauve.toml` has topics or hosts. A query, so that other changes of that file invalidate no deployment.
#[salsa::tracked(returns(copy))]
pub(crate) fn has_ros2_or_hosts(db: &dyn ModelDb, workspace: Workspace) -> bool {
    let config = config_of(db, workspace);
    config.ros2.is_some() || !config.hosts.is_empty()
}

/// Returns the facts about the topics and hosts of a deployment: in models, and in `mauve.toml`.
#[salsa::tracked(returns(ref))]
pub(crate) fn facts_of<'db>(db: &'db dyn ModelDb, project: Project<'db>, of: Decl<'db>) -> Vec<Fact<'db>> {
    if !has_ros2_or_hosts(db, project.workspace(db)) {
        return Vec::new();
    }
    let Some((flat, _)) = deployed(db, project, of) else { return Vec::new() };
    let config = config_of(db, project.workspace(db));
    let ros2 = ros2_of(db, project, of);
    let mut checker = TopicChecker { db, project, of, config, flat, ros2, found: Vec::new() };
    checker.entries();
    checker.topics();
    checker.pairs();
    checker.hosts();
    checker.links();
    checker.found
}

/// Returns the facts that concern `mauve.toml` alone.
pub(crate) fn facts_of_configuration<'db>(db: &'db dyn ModelDb, workspace: Workspace) -> Vec<Fact<'db>> {
    let (config, Some(file)) = (config_of(db, workspace), config_file(db, workspace)) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    let mut report = |span: &Range<usize>, fact| {
        found.push(Fact::new(Location::of_span(file, span), FactKind::Ros2(fact)));
    };
    let ros2 = config.ros2.as_ref();
    let names = ros2.into_iter().flat_map(|it| &it.topics).filter_map(|it| it.name.as_ref());
    for (name, span) in names.chain(ros2.and_then(|it| it.namespace.as_ref())) {
        if let Some(why) = invalid_name(name) {
            let fixed = valid_name(name).filter(|fixed| fixed != name);
            report(span, Ros2Fact::InvalidName { name: name.as_str().into(), why, fixed });
        }
    }
    for topic in ros2.into_iter().flat_map(|it| &it.topics).filter(|it| !it.port.0.contains('.')) {
        report(&topic.port.1, Ros2Fact::NoPort { key: topic.port.0.as_str().into() });
    }
    let mut seen: Vec<(&str, &str)> = Vec::new();
    for host in &config.hosts {
        if host.name.contains('@') || host.name == "ros2" {
            report(&host.span, Ros2Fact::NameOfGateway { name: host.name.as_str().into(), is_host: true });
        }
        for (instance, span) in &host.activities {
            match seen.iter().find(|(known, _)| known == instance) {
                Some((_, first)) => report(
                    span,
                    Ros2Fact::TwoHosts { instance: instance.as_str().into(), first: (*first).into() },
                ),
                None => seen.push((instance, &host.name)),
            }
        }
    }
    let mut joined: Vec<([usize; 2], &str)> = Vec::new();
    for link in &config.links {
        let name = Name::from(link.name.as_str());
        if let Some(ends) = ends_of_link(config, &link.name) {
            let is_it = |(it, _): &&([usize; 2], &str)| *it == ends || *it == [ends[1], ends[0]];
            match joined.iter().find(is_it) {
                Some((_, first)) => report(&link.span, Ros2Fact::SecondLink { name, first: (*first).into() }),
                None => joined.push((ends, &link.name)),
            }
            continue;
        }
        let pairs = pairs_of_link(config, &link.name).map(|it| it.map(|host| name_of_host(config, host)));
        if let [first, second, ..] = pairs.collect::<Vec<_>>().as_slice() {
            report(&link.span, Ros2Fact::AmbiguousLink { name, pairs: [first.clone(), second.clone()] });
            continue;
        }
        let hosts = || config.hosts.iter().map(|it| it.name.as_str());
        let pairs = hosts().flat_map(|a| hosts().filter(move |b| a != *b).map(move |b| format!("{a}-{b}")));
        let near = similar(&link.name, &pairs.map(Name::from).collect::<Vec<_>>());
        report(&link.span, Ros2Fact::InvalidLink { name, near });
    }
    if config.ptp.is_none() {
        let hosts = hosts_of(db, workspace);
        for (clock, (instance, span)) in config.on_clocks() {
            let others = config.on_clocks().filter(|(it, _)| *it == clock).map(|(_, (it, _))| it);
            let host = hosts.of(instance);
            let before = others.take_while(|it| *it != instance);
            let Some(other) = before.into_iter().find(|it| hosts.of(it) != host) else { continue };
            if let (Some(host), Some(of_other)) = (host, hosts.of(other)) {
                let hosts = [of_other, host].map(|it| name_of_host(config, it));
                let (instance, other) = (instance.as_str().into(), other.as_str().into());
                report(span, Ros2Fact::ClockAcross { instance, other, hosts });
            }
        }
    }
    found
}

/// Returns why a name of a topic, absolute or below the namespace, or a namespace, is invalid by the rules of ROS 2.
fn invalid_name(name: &str) -> Option<InvalidName> {
    let is_sign = |it: char| it.is_ascii_alphanumeric() || it == '_' || it == '/';
    if name.is_empty() || name == "/" {
        return Some(InvalidName::Empty);
    }
    if name.contains('~') {
        return Some(InvalidName::Tilde);
    }
    if let Some(sign) = name.chars().find(|it| !is_sign(*it)) {
        return Some(InvalidName::Character(sign));
    }
    let parts = name.strip_prefix('/').unwrap_or(name);
    if name.contains("//") {
        Some(InvalidName::DoubleSlash)
    } else if name.ends_with('/') {
        Some(InvalidName::EndsWithSlash)
    } else if parts.split('/').any(|it| it.starts_with(|it: char| it.is_ascii_digit())) {
        Some(InvalidName::Digit)
    } else {
        ("rt/".len() + parts.len() > LONGEST_NAME).then_some(InvalidName::TooLong)
    }
}

/// Returns the valid name that an invalid one most likely means.
fn valid_name(name: &str) -> Option<String> {
    let sign = |it: char| if it.is_ascii_alphanumeric() || it == '_' || it == '/' { it } else { '_' };
    let start = if name.starts_with('/') { "/" } else { "" };
    let parts: Vec<String> =
        name.split('/').filter(|it| !it.is_empty()).map(|it| it.chars().map(sign).collect()).collect();
    let fixed = format!("{start}{}", parts.join("/"));
    (!name.contains('~') && invalid_name(&fixed).is_none()).then_some(fixed)
}

fn name_of_host(config: &Config, host: usize) -> Name {
    config.hosts.get(host).map_or_else(Name::default, |it| it.name.as_str().into())
}

/// Returns why a message cannot be a topic.
fn unmapped(
    db: &dyn ModelDb,
    workspace: Workspace,
    (of, name): (&str, &str),
    path: &mut Vec<String>,
    checked: &mut FxHashSet<(String, String)>,
) -> Option<Unmapped> {
    let field = || path.join(".");
    if checked.contains(&(of.to_owned(), name.to_owned())) {
        return None;
    }
    if path.len() > DEEPEST {
        return Some(Unmapped::Recursive { field: field() });
    }
    let Some(found) = package(db, workspace, &of.into()) else {
        return Some(Unmapped::NoPackage { field: field(), package: of.into() });
    };
    let Some(message) = found.messages.get(name) else {
        return Some(Unmapped::NoSuchMessage { field: field(), ty: format!("{of}/{name}") });
    };
    for it in &message.fields {
        path.push(it.name.to_string());
        match it.element() {
            "wstring" => return Some(Unmapped::WideString { field: path.join(".") }),
            // These are of ROS 1.
            ty @ ("time" | "duration") => {
                return Some(Unmapped::NoSuchMessage { field: path.join("."), ty: ty.to_owned() });
            }
            ty if BUILT_IN_TYPES.contains(&ty) => {}
            ty => {
                let nested = ty.split_once('/').unwrap_or((of, ty));
                if let Some(why) = unmapped(db, workspace, nested, path, checked) {
                    return Some(why);
                }
            }
        }
        path.pop();
    }
    checked.insert((of.to_owned(), name.to_owned()));
    None
}

struct TopicChecker<'db> {
    db: &'db dyn ModelDb,
    project: Project<'db>,
    of: Decl<'db>,
    config: &'db Config,
    flat: &'db Flat<'db>,
    ros2: &'db Ros2,
    found: Vec<Fact<'db>>,
}

impl<'db> TopicChecker<'db> {
    fn report(&mut self, at: Location<'db>, fact: Ros2Fact) {
        let fact = Fact::new(at, FactKind::Ros2(fact));
        if !self.found.contains(&fact) {
            self.found.push(fact);
        }
    }

    /// Returns the entry of a port in `[ros2] topics`.
    fn entry(&self, (instance, port): &(Name, Name)) -> Option<&'db TopicConfig> {
        let is_it = |it: &&TopicConfig| {
            it.port.0.split_once('.').is_some_and(|(of, name)| *instance == of && *port == name)
        };
        self.config.ros2.as_ref()?.topics.iter().find(is_it)
    }

    fn in_config(&self, span: &Range<usize>) -> Location<'db> {
        let file = config_file(self.db, self.project.workspace(self.db));
        file.map_or(Location::name_of(self.of), |file| Location::of_span(file, span))
    }

    /// Returns the location of the activity of an instance, otherwise that of the deployment.
    fn at_activity(&self, instance: &str) -> Location<'db> {
        let activities = deployment(self.db, self.of).into_iter().flat_map(|it| &it.activities);
        let mut instances = activities.flat_map(|it| &it.instances);
        let found = instances.find(|it| it.name == *instance);
        found.map_or(Location::name_of(self.of), |it| Location::Source(self.of, it.id))
    }

    /// Returns the location of a topic: its entry, otherwise the activity of its instance.
    fn at(&self, port: &(Name, Name)) -> Location<'db> {
        match self.entry(port) {
            Some(entry) => self.in_config(&entry.port.1),
            None => self.at_activity(&port.0),
        }
    }

    fn host(&self, instance: &str) -> Option<usize> {
        hosts_of(self.db, self.project.workspace(self.db)).of(instance)
    }

    /// Checks the ports that `[ros2] topics` names. Other checks report those that do not exist.
    fn entries(&mut self) {
        for entry in self.config.ros2.iter().flat_map(|it| &it.topics) {
            let Some((instance, port)) = entry.port.0.split_once('.') else { continue };
            let port = (Name::from(instance), Name::from(port));
            let Some(feature) = self.flat.feature(self.db, self.project, &port) else { continue };
            if !feature.kind.is_port() {
                continue;
            }
            let at = self.in_config(&entry.port.1);
            let ty = feature.ty(self.db, self.project);
            if TopicType::of(&ty).is_none() {
                let port = entry.port.0.as_str().into();
                self.report(at.clone(), Ros2Fact::NoMessage { port, ty });
            }
            let mut links = self.flat.links.iter().filter(|it| !it.operation && it.target == port);
            let local = links.find(|it| self.host(&it.source.0) == self.host(&it.target.0));
            if let Some(link) = local.filter(|_| feature.kind == FeatureKind::Input) {
                let port = entry.port.0.as_str().into();
                self.report(at, Ros2Fact::ConnectedInput { port, link: link.to_string() });
            }
        }
    }

    /// Checks each topic: its type and its name.
    fn topics(&mut self) {
        let workspace = self.project.workspace(self.db);
        let mut checked = FxHashSet::default();
        for topic in &self.ros2.topics {
            let TopicType { package, message, .. } = &topic.ty;
            if let Some(why) = unmapped(self.db, workspace, (package, message), &mut Vec::new(), &mut checked)
            {
                let port = Name::from(format!("{}.{}", topic.port.0, topic.port.1));
                let fact = Ros2Fact::Unmapped { port, message: topic.ty.to_string(), why };
                self.report(self.at(&topic.port), fact);
            }
            // An invalid name of `mauve.toml` is reported there.
            if invalid_name(&topic.name) == Some(InvalidName::TooLong) {
                let name = topic.name.clone();
                let fact = Ros2Fact::InvalidName { name, why: InvalidName::TooLong, fixed: None };
                self.report(self.at(&topic.port), fact);
            }
        }
        let gateway = self.config.ros2.as_ref().filter(|_| !self.ros2.topics.is_empty());
        let gateway = gateway.map(|it| (it, &it.gateway));
        if let Some((section, gateway)) = gateway {
            let span = if gateway.span.is_empty() { &section.span } else { &gateway.span };
            let lacking = [("priority", gateway.priority.is_none()), ("period", gateway.period.is_none())];
            if let Some((key, _)) = lacking.into_iter().find(|(_, lacks)| *lacks) {
                self.report(self.in_config(span), Ros2Fact::NoGateway { key });
            }
        }
        let named = self.flat.instances.iter().find(|it| it.name == *"ros2");
        if let Some(at) = named.filter(|_| gateway.is_some()).and_then(|it| it.declaration(self.db)) {
            self.report(at, Ros2Fact::NameOfGateway { name: "ros2".into(), is_host: false });
        }
    }

    /// Checks the ports of each topic against each other.
    fn pairs(&mut self) {
        let full = |it: &Topic| format!("{}.{}", it.port.0, it.port.1);
        for (index, topic) in self.ros2.topics.iter().enumerate() {
            let is_same =
                |it: &Topic| (&it.ty.package, &it.ty.message) == (&topic.ty.package, &topic.ty.message);
            let mut earlier =
                self.ros2.topics.iter().take(index).filter(|it| it.name == topic.name).peekable();
            if let Some(first) = earlier.peek().filter(|it| !is_same(it)) {
                let ports = [first, topic].map(|it| (full(it), it.ty.to_string()));
                let fact = Ros2Fact::TwoTypes { topic: topic.name.clone(), ports };
                self.report(self.at(&topic.port), fact);
                continue;
            }
            let leads_across = |it: &Topic| matches!(it.origin, TopicOrigin::AcrossHosts(_));
            let is_second = |it: &&Topic| {
                it.is_published && topic.is_published && (leads_across(it) || leads_across(topic))
            };
            if let Some(first) = earlier.clone().find(is_second) {
                let outputs = [first, topic].map(full);
                self.report(
                    self.at(&topic.port),
                    Ros2Fact::TwoOutputs { topic: topic.name.clone(), outputs },
                );
            }
            for earlier in earlier.filter(|it| is_same(it) && it.is_published != topic.is_published) {
                let (writer, reader) = if topic.is_published { (topic, earlier) } else { (earlier, topic) };
                let property = if writer.is_best_effort && !reader.is_best_effort {
                    Quality::Reliability
                } else if reader.is_transient_local && !writer.is_transient_local {
                    Quality::Durability
                } else {
                    continue;
                };
                let (topic, at) = (topic.name.clone(), self.at(&reader.port));
                let (writer, reader) = (full(writer), full(reader));
                self.report(at, Ros2Fact::Quality { topic, writer, reader, property });
            }
        }
    }

    /// Checks that each instance has a host, and that the host has its CPUs.
    fn hosts(&mut self) {
        if self.config.hosts.is_empty() {
            return;
        }
        for instance in self.flat.instances.iter().filter(|it| !it.repeated) {
            if self.host(&instance.name).is_none() {
                let fact = Ros2Fact::NoHost { instance: instance.name.clone() };
                self.report(self.at_activity(&instance.name), fact);
            }
        }
        let platform = platform_of(self.db, self.project.workspace(self.db));
        for activity in deployment(self.db, self.of).into_iter().flat_map(|it| &it.activities) {
            let hosts: Vec<_> =
                activity.instances.iter().filter_map(|it| Some((it, self.host(&it.name)?))).collect();
            let mut pairs = hosts.iter().zip(hosts.iter().skip(1));
            if let Some((&(one, first), &(other, second))) = pairs.find(|((_, a), (_, b))| a != b) {
                let instances = [one, other].map(|it| it.name.clone());
                let hosts = [first, second].map(|it| name_of_host(self.config, it));
                let at = Location::Source(self.of, other.id);
                self.report(at, Ros2Fact::ActivityAcross { instances, hosts });
            }
            let Some((field, cpus)) = platform.cpus_of(activity) else { continue };
            let too_few = hosts.iter().find_map(|&(instance, host)| {
                let host = self.config.hosts.get(host)?;
                let has = host.cpus?;
                let is_missing = !(cpus - mauve_timing::CpuSet::first_few(has)).is_empty();
                is_missing.then(|| (instance.name.clone(), Name::from(host.name.as_str()), has))
            });
            if let Some((instance, host, cpus)) = too_few {
                let at = Location::Source(self.of, field.name.id);
                self.report(at, Ros2Fact::NoCpuOfHost { instance, host, cpus });
            }
        }
        // Each host with topics has a gateway, with the same CPUs.
        let gateway = self.config.ros2.as_ref().and_then(|it| it.gateway.cpus.as_ref());
        for (index, host) in self.config.hosts.iter().enumerate() {
            let Some(((named, span), cpus)) = gateway.zip(host.cpus) else { continue };
            let is_missing = !(*named - mauve_timing::CpuSet::first_few(cpus)).is_empty();
            if is_missing && self.ros2.topics.iter().any(|it| it.host == index) {
                let (instance, host) = (self.ros2.gateway(index), Name::from(host.name.as_str()));
                self.report(self.in_config(span), Ros2Fact::NoCpuOfHost { instance, host, cpus });
            }
        }
    }

    /// Checks the connections across hosts.
    fn links(&mut self) {
        // Once for all connections.
        let mut is_hidden = false;
        let mut joined: FxHashSet<[usize; 2]> =
            self.config.links.iter().filter_map(|it| ends_of_link(self.config, &it.name)).collect();
        for link in &self.flat.links {
            let hosts = (self.host(&link.source.0), self.host(&link.target.0));
            let (Some(from), Some(to)) = hosts else { continue };
            if from == to {
                continue;
            }
            let (at, text) = (link.at.clone(), link.to_string());
            let hosts = [from, to].map(|it| name_of_host(self.config, it));
            if link.operation {
                self.report(at, Ros2Fact::OperationAcross { link: text, hosts });
                continue;
            }
            let Some(ros2) = &self.config.ros2 else {
                self.report(at, Ros2Fact::NoRos2 { link: text, hosts });
                continue;
            };
            if !ros2.is_on_subnet && !is_hidden {
                is_hidden = true;
                let fact = Ros2Fact::NotOnSubnet { link: text.clone(), hosts: hosts.clone() };
                self.report(self.in_config(&ros2.span), fact);
            }
            let ty = self.flat.feature(self.db, self.project, &link.source);
            let ty = ty.map_or(Type::Unknown, |it| it.ty(self.db, self.project));
            if TopicType::of(&ty).is_none() {
                let fact = Ros2Fact::NoMessageAcross { link: text.clone(), hosts: hosts.clone(), ty };
                self.report(at.clone(), fact);
            }
            if !joined.contains(&[from, to]) && !joined.contains(&[to, from]) {
                joined.insert([from, to]);
                self.report(at, Ros2Fact::NoLink { hosts, link: text });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Arc;

    use salsa::Setter as _;

    use super::*;
    use crate::msg::{Package, read_message};
    use crate::{Database, check_configuration, declaration_facts, names_of, projects, ros2_catalogue};

    fn workspace(db: &Database, toml: &str, model: &str) -> Workspace {
        let texts = [("/mauve.toml", toml), ("/robot.mal", model)];
        Workspace::of_texts(db, "/".into(), texts.map(|(path, text)| (path.into(), text.to_owned())))
    }

    fn deployment_in(db: &Database, workspace: Workspace) -> (Project<'_>, Decl<'_>) {
        let project = projects(db, workspace)[0];
        (project, names_of(db, project).of_kind(db, crate::item_tree::Kind::Deployment).next().unwrap())
    }

    #[test]
    fn names_of_ros_2() {
        use InvalidName as N;
        for (name, expected) in [
            ("/uav/camera/frame_2", None),
            ("scan", None),
            ("_a/b", None),
            ("", Some(N::Empty)),
            ("/", Some(N::Empty)),
            ("/a b", Some(N::Character(' '))),
            ("/é", Some(N::Character('é'))),
            ("/a//b", Some(N::DoubleSlash)),
            ("/a/", Some(N::EndsWithSlash)),
            ("/a/2", Some(N::Digit)),
            ("~/a", Some(N::Tilde)),
        ] {
            assert_eq!(invalid_name(name), expected, "{name}");
        }
        assert_eq!(invalid_name(&format!("/{}", "a".repeat(252))), None);
        assert_eq!(invalid_name(&format!("/{}", "a".repeat(253))), Some(N::TooLong));
        for (name, fixed) in [
            ("/a//b-c/", Some("/a/b_c")),
            ("a/", Some("a")),
            ("/é", Some("/_")),
            ("/2", None),
            ("~/a/", None),
            ("//", None),
        ] {
            assert_eq!(valid_name(name).as_deref(), fixed, "{name}");
        }
    }

    #[test]
    fn every_message_of_the_catalogue_is_mapped_but_wide_strings() {
        let db = Database::default();
        let workspace = workspace(&db, "[ros2]\n", "");
        for (of, package) in ros2_catalogue() {
            for (name, message) in &package.messages {
                let why = unmapped(&db, workspace, (of, name), &mut Vec::new(), &mut FxHashSet::default());
                let is_wide = message.fields.iter().any(|it| it.element() == "wstring");
                assert_eq!(why.is_some(), is_wide, "{of}/{name}: {why:?}");
            }
        }
    }

    #[test]
    fn what_cannot_be_mapped_names_its_field() {
        let mut db = Database::default();
        let workspace = workspace(&db, "[ros2]\n", "");
        let messages = [
            ("Wide", "int32 a\nwstring[3] text"),
            ("Outer", "Wide[] inner"),
            ("Ring", "int32 a\nLink next"),
            ("Link", "Ring back"),
            ("Old", "time stamp"),
            ("Lost", "far_msgs/Thing thing"),
            ("Near", "Thing thing"),
        ];
        let messages: BTreeMap<Name, _> =
            messages.into_iter().map(|(name, text)| (name.into(), read_message(text))).collect();
        // Each has two of the next: without a record of those that were checked, there would be 2^40.
        let deep = (0..15).map(|it| {
            (Name::from(format!("D{it}")), read_message(&format!("D{0}[] a\nD{0} b\nD{0} c\nD{0} d", it + 1)))
        });
        let end = [(Name::from("D15"), read_message("int8 a"))];
        let messages = messages.into_iter().chain(deep).chain(end).collect();
        let package = Arc::new(Package { name: "my_msgs".into(), messages });
        workspace
            .set_packages(&mut db)
            .to(Arc::new([(Name::from("my_msgs"), package)].into_iter().collect()));
        let of = |name: &str| {
            unmapped(&db, workspace, ("my_msgs", name), &mut Vec::new(), &mut FxHashSet::default())
        };
        let field = |it: &str| it.to_owned();
        assert_eq!(of("Outer"), Some(Unmapped::WideString { field: field("inner.text") }));
        let no_message =
            |it: &str, ty: &str| Some(Unmapped::NoSuchMessage { field: field(it), ty: ty.to_owned() });
        assert_eq!(of("Old"), no_message("stamp", "time"));
        assert_eq!(of("Near"), no_message("thing", "my_msgs/Thing"));
        assert_eq!(
            of("Lost"),
            Some(Unmapped::NoPackage { field: field("thing"), package: "far_msgs".into() })
        );
        assert!(
            matches!(of("Ring"), Some(Unmapped::Recursive { field }) if field.starts_with("next.back.next"))
        );
        assert_eq!(of("D0"), None);
    }

    const MODEL: &str = "
        shell S { output port out: int } shell T { input port into: int }
        core C(S) { update = { } } core E(T) { update = { } }
        component Eye(S, C) component Brain(T, E)
        architecture A { instance eye: Eye instance brain: Brain connection eye.out -> brain.into }
        deployment D { architecture A activity eye { priority = 1 period = 9 } activity brain { priority = 2 period = 9 } }";

    #[test]
    fn without_topics_and_hosts_nothing_is_checked() {
        let db = Database::default();
        let workspace = workspace(&db, "[clocks]\nsynchronised = [\"eye\", \"brain\"]\n", MODEL);
        assert_eq!(check_configuration(&db, workspace), []);
        for project in projects(&db, workspace) {
            for &decl in &names_of(&db, *project).all {
                let facts = declaration_facts(&db, *project, decl).iter();
                assert!(facts.into_iter().all(|it| !matches!(it.kind, FactKind::Ros2(_))));
            }
        }
    }

    #[test]
    fn an_output_leads_to_several_hosts() {
        let db = Database::default();
        let hosts = "[ros2]\ndiscovery = \"subnet\"\n[host.a]\nactivities = [\"eye\"]\n[host.b]\nactivities = [\"brain\"]\n[host.c]\nactivities = [\"arm\"]\n";
        let model = MODEL.replace(
            "eye.out -> brain.into",
            "eye.out -> brain.into instance arm: Brain connection eye.out -> [4] arm.into",
        );
        let workspace = workspace(&db, hosts, &model);
        let (project, of) = deployment_in(&db, workspace);
        let ros2 = ros2_of(&db, project, of);
        let links = &deployed(&db, project, of).unwrap().0.links;
        let ends = |link: usize| {
            ros2.across(&links[link]).map(|ends| ends.map(|it| (it.port.0.to_string(), it.depth)))
        };
        let [eye, brain, arm] =
            [("eye", 4), ("brain", 1), ("arm", 4)].map(|(it, depth)| (it.to_owned(), depth));
        assert_eq!([ends(0), ends(1)], [Some([eye.clone(), brain]), Some([eye, arm])]);
    }

    #[test]
    fn the_longest_of_several_links_counts() {
        let db = Database::default();
        let config = "[ros2]\n[host.eyes]\nactivities = [\"eye\"]\n[host.head]\nactivities = [\"brain\"]
            [link.eyes-head]\nlatency = \"2 ms\"\n[link.head-eyes]\nlatency = \"500 ms\"\n";
        let workspace = workspace(&db, config, MODEL);
        let (project, of) = deployment_in(&db, workspace);
        let ros2 = ros2_of(&db, project, of);
        let longest = Some(mauve_timing::Time::from_nanos(500_000_000));
        assert_eq!([ros2.latency(0, 1), ros2.latency(1, 0)], [longest; 2]);
        let second = Ros2Fact::SecondLink { name: "head-eyes".into(), first: "eyes-head".into() };
        assert!(
            check_configuration(&db, workspace).iter().any(|it| it.1.kind == FactKind::Ros2(second.clone()))
        );
    }

    #[test]
    fn a_connection_leads_from_its_own_output() {
        let db = Database::default();
        // Both outputs are one topic, which is an error; their connections are two.
        let config = "[ros2]\ndiscovery = \"subnet\"\ntopics = { \"eye.out\" = \"/x\", \"lid.out\" = \"/x\" }
            [host.eyes]\nactivities = [\"eye\"]\n[host.lids]\nactivities = [\"lid\"]\n[host.head]\nactivities = [\"brain\", \"arm\"]\n";
        let model = MODEL.replace(
            "connection eye.out -> brain.into",
            "connection eye.out -> brain.into instance lid: Eye instance arm: Brain connection lid.out -> arm.into",
        );
        let workspace = workspace(&db, config, &model);
        let (project, of) = deployment_in(&db, workspace);
        let (ros2, links) = (ros2_of(&db, project, of), &deployed(&db, project, of).unwrap().0.links);
        for (link, writer, reader) in [(0, "eye", "brain"), (1, "lid", "arm")] {
            let found = ros2.across(&links[link]).unwrap().map(|it| it.port.0.as_str());
            assert_eq!(found, [writer, reader]);
        }
        let outputs = ["eye.out".to_owned(), "lid.out".to_owned()];
        let two = Ros2Fact::TwoOutputs { topic: "/x".into(), outputs };
        assert!(facts_of(&db, project, of).iter().any(|it| it.kind == FactKind::Ros2(two.clone())));
    }

    #[test]
    fn a_link_joins_hosts_whose_names_have_dashes() {
        let hosts = "[host.a-b]\nactivities = []\n[host.c]\nactivities = []\n";
        let config = crate::config::read(hosts);
        assert_eq!(ends_of_link(&config, "a-b-c"), Some([0, 1]));
        assert_eq!(ends_of_link(&config, "c-a-b"), Some([1, 0]));
        for name in ["", "-", "a-b", "c-c", "a-b-c-"] {
            assert_eq!(ends_of_link(&config, name), None, "{name}");
        }
        let several = format!("{hosts}[host.a]\nactivities = []\n[host.b-c]\nactivities = []\n");
        assert_eq!(ends_of_link(&crate::config::read(&several), "a-b-c"), None);
    }
}
