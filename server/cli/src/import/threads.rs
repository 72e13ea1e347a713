//! The threads of an imported system: the entries of a `threads.yaml`, or a new one with an entry for each callback group.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Write as _;

use mauve_hir::ros2_files::{GroupId, ThreadEntry, ThreadsFile};
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
    /// The ids of the recorded groups, as Agnocast's executor writes them, by their index.
    recorded: BTreeMap<usize, GroupId>,
    /// The groups of the file, or the recorded ones.
    groups: Vec<GroupId>,
    /// Those with a callback, by its id.
    having: HashMap<String, Vec<usize>>,
    /// The nodes with an entry for all other groups.
    wildcards: HashSet<String>,
    /// How many callbacks with an id the recording has.
    counts: HashMap<String, usize>,
}

impl Threads {
    pub(super) fn new(graph: &Ros2Graph, path: String, file: Option<ThreadsFile>) -> Threads {
        let mut members: BTreeMap<usize, Vec<&Ros2Callback>> = BTreeMap::new();
        for callback in &graph.callbacks {
            members.entry(callback.group.unwrap_or(usize::MAX)).or_default().push(callback);
        }
        members.remove(&usize::MAX);
        // Those that were never executed are in the id, too.
        let id = |(group, all): (usize, Vec<&Ros2Callback>)| {
            Some((group, group_of(graph, &all).filter(|it| it.callbacks().count() == all.len())?))
        };
        let recorded: BTreeMap<usize, GroupId> = members.into_iter().filter_map(id).collect();
        let groups: Vec<GroupId> = match &file {
            Some(file) => file.groups.iter().filter_map(|it| it.group.clone()).collect(),
            None => recorded.values().cloned().collect(),
        };
        let mut having: HashMap<String, Vec<usize>> = HashMap::new();
        for (index, group) in groups.iter().enumerate() {
            for callback in group.callbacks() {
                let of = having.entry(format!("{}@{callback}", group.node())).or_default();
                of.extend(Some(index).filter(|it| of.last() != Some(it)));
            }
        }
        let mut counts: HashMap<String, usize> = HashMap::new();
        for id in graph.callbacks.iter().filter_map(|it| group_of(graph, &[it])) {
            *counts.entry(id.text().to_string()).or_default() += 1;
        }
        let wildcards = groups.iter().filter(|it| it.is_wildcard()).map(|it| it.node().to_owned()).collect();
        Threads { path, file, recorded, groups, having, wildcards, counts }
    }

    /// Returns the recorded id of the group of a callback.
    pub(super) fn recorded(&self, callback: &Ros2Callback) -> Option<&GroupId> {
        self.recorded.get(&callback.group?)
    }

    /// Returns the id of the thread of a callback: with this callback alone, where no other group of its node has one like it. None where
    /// a group may have it that the file does not have.
    pub(super) fn id(&self, graph: &Ros2Graph, callback: &Ros2Callback) -> Option<String> {
        let own = group_of(graph, &[callback])?;
        let recorded = self.recorded(callback);
        let is_recorded = |it: &GroupId| recorded.is_some() && sorted(it).as_ref() == recorded;
        let having = self.having.get(own.text().as_str());
        let mut having = having.into_iter().flatten().filter_map(|it| self.groups.get(*it));
        let found = match (having.next(), having.next()) {
            (None, _) => self.wildcards.contains(own.node()).then(|| recorded.cloned().unwrap_or(own)),
            (Some(only), None) => {
                let count = only.callbacks().filter(|it| own.callbacks().next() == Some(it)).count();
                let is_it = self.counts.get(own.text().as_str()).is_none_or(|all| *all <= count);
                (is_it || is_recorded(only)).then_some(own)
            }
            (Some(first), Some(second)) => {
                let mut all = [first, second].into_iter().chain(having);
                all.find(|it| is_recorded(it)).cloned()
            }
        };
        found.map(|it| it.text().to_string())
    }

    /// Returns the greatest number of a CPU in the file, from 0.
    pub(super) fn last_cpu(&self) -> Option<u32> {
        let entries = self.file.iter().flat_map(|it| it.groups.iter().chain(&it.others));
        entries.filter_map(|it: &ThreadEntry| it.affinity.known()?.iter().last()).max()
    }
}

/// Returns the id of a group with these callbacks of one node.
fn group_of(graph: &Ros2Graph, callbacks: &[&Ros2Callback]) -> Option<GroupId> {
    let node = graph.nodes.get(callbacks.first()?.node?)?;
    let released = callbacks.iter().filter_map(|it| match &it.release {
        Ros2Release::Timer(period) => Some(format!("Timer({period})")),
        Ros2Release::Subscription(topic) => Some(format!("Subscription({topic})")),
        Ros2Release::Service(service) => Some(format!("Service({service})")),
        Ros2Release::Unknown => None,
    });
    let released: Vec<String> = released.collect();
    GroupId::sorted(node, released.iter().map(String::as_str)).filter(|_| !released.is_empty())
}

/// Returns the id with the callbacks in the order of Agnocast's executor.
fn sorted(id: &GroupId) -> Option<GroupId> {
    GroupId::sorted(id.node(), id.callbacks())
}

/// Returns a file with these threads and their priorities. Each has one CPU, which has others only if there are more threads than CPUs.
pub(super) fn written(threads: &BTreeMap<String, u32>, cpus: u32) -> String {
    let mut text = "# A thread for each callback group that was executed, for the callback-isolated executor of ROS 2. The order in an id is that\n\
                    # of Agnocast's; the prerun of another executor says how it writes them. The shorter the deadlines of a group, the higher\n\
                    # its priority; each has one CPU. `mauve tune` searches for better priorities and CPUs.\ncallback_groups:\n"
        .to_owned();
    for ((id, priority), cpu) in threads.iter().zip((0..cpus).cycle()) {
        let _ = write!(
            text,
            "  - id: {id}\n    policy: SCHED_FIFO\n    priority: {priority}\n    affinity: [{cpu}]\n"
        );
    }
    text + "non_ros_threads: []\n"
}

#[cfg(test)]
mod tests {
    use mauve_hir::ros2_files::read_threads;
    use mauve_pwcet::trace::Ros2Group;

    use super::*;

    /// A node `/eye` with these callbacks, each with its group.
    fn graph(callbacks: &[(Ros2Release, Option<usize>)]) -> Ros2Graph {
        let mut graph = Ros2Graph::default();
        graph.nodes.push("/eye".to_owned());
        for (release, group) in callbacks {
            let mut callback = Ros2Callback::default();
            (callback.node, callback.release, callback.group) = (Some(0), release.clone(), *group);
            graph.callbacks.push(callback);
        }
        graph.groups = vec![Ros2Group::default(); 3];
        graph
    }

    fn timer(group: Option<usize>) -> (Ros2Release, Option<usize>) {
        (Ros2Release::Timer(1000), group)
    }

    fn topic(name: &str, group: Option<usize>) -> (Ros2Release, Option<usize>) {
        (Ros2Release::Subscription(name.to_owned()), group)
    }

    /// The ids of all callbacks; `-` for none.
    fn ids(graph: &Ros2Graph, file: Option<&str>) -> Vec<String> {
        let threads = Threads::new(graph, THREADS.to_owned(), file.map(read_threads));
        graph.callbacks.iter().map(|it| threads.id(graph, it).unwrap_or_else(|| "-".to_owned())).collect()
    }

    #[test]
    fn a_callback_names_its_group_where_no_other_has_one_like_it() {
        let graph = graph(&[
            timer(Some(0)),
            topic("/a", Some(0)),
            timer(Some(1)),
            topic("/b", Some(1)),
            topic("not a name", Some(2)),
        ]);
        let groups = ["/eye@Subscription(/a)@Timer(1000)", "/eye@Subscription(/b)@Timer(1000)"];
        assert_eq!(
            ids(&graph, None),
            [groups[0], "/eye@Subscription(/a)", groups[1], "/eye@Subscription(/b)", "-"]
        );
        // Another executor has another order.
        let file = "callback_groups:\n- {id: /eye@Timer(1000)@Subscription(/a), policy: SCHED_IDLE, nice: 0, affinity: [2, 3]}\n\
                    - {id: /eye@Timer(1000)@Subscription(/b), policy: SCHED_IDLE, nice: 0}\n";
        let own = ["/eye@Timer(1000)@Subscription(/a)", "/eye@Timer(1000)@Subscription(/b)"];
        assert_eq!(
            ids(&graph, Some(file)),
            [own[0], "/eye@Subscription(/a)", own[1], "/eye@Subscription(/b)", "-"]
        );
        assert_eq!(Threads::new(&graph, String::new(), Some(read_threads(file))).last_cpu(), Some(3));
    }

    #[test]
    fn without_recorded_groups_the_entries_say_it() {
        let graph = graph(&[timer(None), topic("/a", None)]);
        assert_eq!(ids(&graph, None), ["-", "-"]);
        let file = |id: &str| {
            format!(
                "callback_groups:\n- {{id: {id}, policy: SCHED_IDLE, nice: 0}}\n- {{id: /hand/*, policy: SCHED_IDLE, nice: 0}}\n"
            )
        };
        assert_eq!(ids(&graph, Some(&file("/eye@Subscription(/b)@Timer(1000)"))), ["/eye@Timer(1000)", "-"]);
        // Which of two timers is in a group without an entry?
        let two = self::graph(&[timer(None), timer(None)]);
        assert_eq!(ids(&two, Some(&file("/eye@Timer(1000)"))), ["-", "-"]);
        assert_eq!(ids(&two, Some(&file("/eye@Timer(1000)@Timer(1000)"))), ["/eye@Timer(1000)"; 2]);
        let two = self::graph(&[timer(Some(0)), timer(Some(1)), topic("/a", Some(1))]);
        assert_eq!(ids(&two, Some(&file("/eye@Timer(1000)"))), ["/eye@Timer(1000)", "-", "-"]);
        assert_eq!(ids(&graph, Some(&file("/eye/*"))), ["/eye@Timer(1000)", "/eye@Subscription(/a)"]);
    }

    #[test]
    fn each_thread_of_a_new_file_has_a_cpu() {
        let threads = ["/a@Timer(1)", "/b@Timer(2)", "/c@Timer(3)"].map(|id| (id.to_owned(), 9));
        let file = read_threads(&written(&threads.into(), 2));
        assert!(file.problems.is_empty(), "{:?}", file.problems);
        let cpus = file.groups.iter().filter_map(|it| it.affinity.known()?.iter().next());
        assert_eq!(cpus.collect::<Vec<_>>(), [0, 1, 0]);
    }
}
