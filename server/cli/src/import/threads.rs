//! The threads of an imported system: the entries of a `threads.yaml`, or a new one with an entry for each callback group.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use mauve_hir::ros2_files::{GroupCallback, GroupId, ThreadEntry, ThreadsFile};
use mauve_pwcet::trace::{Ros2Callback, Ros2Graph, Ros2Release};

/// The file that is written for a system without one.
pub(super) const THREADS: &str = "threads.yaml";

/// The ids of the threads of callbacks.
#[derive(Debug, Default)]
pub(super) struct Threads {
    /// The path of the file, from the folder of the project.
    pub(super) path: String,
    /// What it says; none if it is to be written.
    pub(super) file: Option<ThreadsFile>,
}

impl Threads {
    /// Returns the id of the thread of a callback. In a file, that is the entry of the recorded group; without one, the only entry of
    /// its node with the callback; without any, the group, if the node has an entry for all others.
    pub(super) fn id(&self, graph: &Ros2Graph, callback: &Ros2Callback) -> Option<String> {
        let recorded = recorded_group(graph, callback);
        let Some(file) = &self.file else { return recorded.map(|it| it.to_string()) };
        let own = group_of(graph, &[callback])?;
        let of_node = |it: &&GroupId| (&it.namespace, &it.node) == (&own.namespace, &own.node);
        let all: Vec<&GroupId> =
            file.groups.iter().filter_map(|it| it.group.as_ref()).filter(of_node).collect();
        let is_it = |it: &&&GroupId| recorded.as_ref().is_some_and(|of| (**it).clone().sorted() == *of);
        let mut having = all.iter().filter(|it| own.callbacks.iter().all(|of| it.callbacks.contains(of)));
        let only = having.next().filter(|_| having.next().is_none());
        let any = || recorded.clone().or(Some(own.clone())).filter(|_| all.iter().any(|it| it.is_wildcard));
        let found = all.iter().find(is_it).or(only.filter(|it| !it.is_wildcard));
        found.map(|it| (*it).clone()).or_else(any).map(|it| it.to_string())
    }

    /// Returns the greatest number of a CPU in the file, from 0.
    pub(super) fn last_cpu(&self) -> Option<u32> {
        let entries = self.file.iter().flat_map(|it| it.groups.iter().chain(&it.others));
        entries.filter_map(|it: &ThreadEntry| it.affinity.known()?.iter().last()).max()
    }
}

/// Returns the id of the group of a callback, as Agnocast's executor writes it: with the callbacks that were never executed.
fn recorded_group(graph: &Ros2Graph, callback: &Ros2Callback) -> Option<GroupId> {
    let group = callback.group?;
    let all: Vec<&Ros2Callback> = graph.callbacks.iter().filter(|it| it.group == Some(group)).collect();
    group_of(graph, &all).filter(|it| it.callbacks.len() == all.len())
}

/// Returns the id of a group with these callbacks of one node.
fn group_of(graph: &Ros2Graph, callbacks: &[&Ros2Callback]) -> Option<GroupId> {
    let node: GroupId = graph.nodes.get(callbacks.first()?.node?)?.parse().ok()?;
    let released = callbacks.iter().filter_map(|it| match &it.release {
        Ros2Release::Timer(period) => Some(GroupCallback::Timer(*period)),
        Ros2Release::Subscription(topic) => Some(GroupCallback::Subscription(topic.clone())),
        Ros2Release::Service(service) => Some(GroupCallback::Service(service.clone())),
        Ros2Release::Unknown => None,
    });
    let id = GroupId { callbacks: released.collect(), ..node }.sorted();
    // A recording may have any text.
    id.to_string().parse().ok().filter(|it| *it == id && !id.callbacks.is_empty())
}

/// Returns a file with these threads and their priorities.
pub(super) fn written(threads: &BTreeMap<String, u32>) -> String {
    let mut text = "# A thread for each callback group that was executed, for the callback-isolated executor of ROS 2. The order in an id is that\n\
                    # of Agnocast's; the prerun of another executor says how it writes them. The shorter the deadlines of a group, the higher\n\
                    # its priority: `mauve tune` searches for better priorities, and for CPUs.\ncallback_groups:\n"
        .to_owned();
    for (id, priority) in threads {
        let _ =
            write!(text, "  - id: {id}\n    policy: SCHED_FIFO\n    priority: {priority}\n    affinity: ~\n");
    }
    text + "non_ros_threads: []\n"
}
