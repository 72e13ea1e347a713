//! The paths that people look at: `named_paths` in the `architecture.yaml` of CARET.
//!
//! ```yaml
//! named_paths:
//! - path_name: target
//!   node_chain:
//!   - { node_name: /eye, publish_topic_name: /seen, subscribe_topic_name: UNDEFINED }
//!   - { node_name: /hand, publish_topic_name: UNDEFINED, subscribe_topic_name: /seen }
//! ```
//!
//! Its writer: tier4/caret_analyze at 679f1ec9, `architecture_exporter.py`.

use super::problem::{ExpectedValue, FileProblem};
use super::value::{ValueReader, is_null};
use super::yaml::{Lookup, NodeId, parse};

/// A path of data from node to node.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NamedPath {
    /// Its name.
    pub name: String,
    /// Its nodes, in the order in which they pass the data on.
    pub nodes: Vec<PathNode>,
}

/// A node of a path.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PathNode {
    /// Its name, with its namespace.
    pub node: String,
    /// The topic by which it gets the data; none where the path begins.
    pub subscribes: Option<String>,
    /// The topic by which it passes the data on; none where the path ends.
    pub publishes: Option<String>,
}

/// The topic of a node without one.
const UNDEFINED: &str = "UNDEFINED";

/// Reads the paths of an `architecture.yaml`, and what is wrong in them.
pub fn read_named_paths(text: &str) -> (Vec<NamedPath>, Vec<FileProblem>) {
    let yaml = parse(text);
    let mut reader = ValueReader { yaml: &yaml, problems: Vec::new() };
    let paths = yaml.root().map_or_else(Vec::new, |root| items(&mut reader, root, "named_paths"));
    let paths: Vec<NamedPath> = paths.into_iter().filter_map(|it| path(&mut reader, it)).collect();
    let (problems, _) = reader.finish(|_| true);
    (paths, problems)
}

/// Returns the items of a list; none if it is absent or null.
fn items(reader: &mut ValueReader<'_>, mapping: NodeId, key: &str) -> Vec<NodeId> {
    let yaml = reader.yaml;
    let Lookup::Found(list) = yaml.find(mapping, key) else { return Vec::new() };
    match yaml.items(list) {
        Some(items) => items.to_vec(),
        None if is_null(yaml, list) => Vec::new(),
        None => {
            reader.wrong_kind(key, ExpectedValue::List, yaml.range(list));
            Vec::new()
        }
    }
}

fn path(reader: &mut ValueReader<'_>, item: NodeId) -> Option<NamedPath> {
    let name = reader.text(item, "path_name").known()?.clone();
    // An error in the path may hide nodes.
    let nodes = items(reader, item, "node_chain").into_iter().map(|it| path_node(reader, it));
    let nodes = nodes.collect::<Option<_>>().filter(|_| !reader.yaml.is_open(item))?;
    Some(NamedPath { name, nodes })
}

fn path_node(reader: &mut ValueReader<'_>, item: NodeId) -> Option<PathNode> {
    let mut topic = |key: &str| reader.text(item, key).known().filter(|it| *it != UNDEFINED).cloned();
    let [subscribes, publishes] = ["subscribe_topic_name", "publish_topic_name"].map(&mut topic);
    Some(PathNode { node: reader.text(item, "node_name").known()?.clone(), subscribes, publishes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_have_nodes_and_topics() {
        let text = "\
named_paths:
- path_name: target
  node_chain:
  - node_name: /eye
    publish_topic_name: /seen
    subscribe_topic_name: UNDEFINED
  - {node_name: /arm/hand, publish_topic_name: UNDEFINED, subscribe_topic_name: /seen}
- path_name: empty
  node_chain:
executors: []
";
        let (paths, problems) = read_named_paths(text);
        assert_eq!(problems, []);
        let node = |node: &str, subscribes: Option<&str>, publishes: Option<&str>| PathNode {
            node: node.to_owned(),
            subscribes: subscribes.map(str::to_owned),
            publishes: publishes.map(str::to_owned),
        };
        let [target, empty] = paths.as_slice() else { panic!("{paths:?}") };
        assert_eq!(target.name, "target");
        assert_eq!(target.nodes, [node("/eye", None, Some("/seen")), node("/arm/hand", Some("/seen"), None)]);
        assert_eq!((empty.name.as_str(), empty.nodes.len()), ("empty", 0));
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (text, paths, problems) in [
            ("", 0, 0),
            ("nodes: []\n", 0, 0),
            ("named_paths: ~\n", 0, 0),
            ("named_paths: 3\n", 0, 1),
            ("named_paths: [{path_name: [1], node_chain: []}]\n", 0, 1),
            ("named_paths: [{path_name: a, node_chain: [{node_name: {}}]}]\n", 0, 1),
            ("named_paths: [{path_name: a, node_chain: [", 0, 1),
        ] {
            let (found, wrong) = read_named_paths(text);
            assert_eq!((found.len(), wrong.len()), (paths, problems), "{text}: {wrong:?}");
        }
    }
}
