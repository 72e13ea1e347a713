//! The files of an imported system: a component for each callback, connections for what they publish, and a deployment.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use mauve_diagnostics::all_of;
use mauve_hir::ros2_files::{NamedPath, PathNode};
use mauve_pwcet::trace::{ROS2_LIBRARY, RecordedThread, Ros2Callback, Ros2Release, ros2_identifier};
use mauve_timing::Time;

use super::control::ControlThread;
use super::names::{camel_case, comment, unique};
use super::recorded::{MOST_WRITES, System, released_by};
use super::threads::{self, THREADS};
use super::unknown;

/// The file beside the sample file, with the greatest times.
const OBSERVED: &str = "recorded.observed.toml";

/// Returns the files of a project, with their names.
pub(super) fn files(system: &System<'_>) -> Vec<(&'static str, String)> {
    let (model, chains) = Model::of(system);
    let threads = model.new_threads();
    let own = (system.threads.file.is_some() || !threads.is_empty()).then_some(&system.threads.path);
    let paths: Vec<String> =
        own.into_iter().chain(system.controllers.iter().map(|it| &it.0)).cloned().collect();
    let mut files = vec![
        ("mauve.toml", configuration(system, &paths) + &chains),
        ("system.mal", model.text()),
        ("timing.toml", times(system)),
        ("README.md", about(system)),
    ];
    let written = threads::written(&threads, cpus(system));
    files.extend(Some((THREADS, written)).filter(|_| !threads.is_empty()));
    files
}

/// Returns the number of CPUs.
fn cpus(system: &System<'_>) -> u32 {
    let managers = system.controllers.iter().flat_map(|it| &it.1.managers);
    let all = managers.flat_map(|it| it.controllers.iter().map(|it| &it.affinity).chain([&it.affinity]));
    let last = all.filter_map(|it| it.known()?.iter().last()).max();
    system.graph.last_cpu.max(system.threads.last_cpu()).max(last).map_or(1, |it| it.min(127) + 1)
}

fn configuration(system: &System<'_>, threads: &[String]) -> String {
    let cpus = cpus(system);
    let paths: toml_edit::Array = threads.iter().map(String::as_str).collect();
    let threads = if threads.is_empty() { String::new() } else { format!("threads = {paths}\n") };
    let observed =
        if system.has_recording() { format!("observed = [\"{OBSERVED}\"]\n") } else { String::new() };
    format!(
        r#"# A system of ROS 2: see README.md.

[project]
root = "system.mal"

[timing]
tables = ["timing.toml"]
{observed}
[platform]
# At least these.
cpus = {cpus}
{threads}
# What the topics carry: a recording does not say it.
[types.Message]
cpp = "std::vector<unsigned char>"
header = "vector"
"#
    )
}

fn about(system: &System<'_>) -> String {
    let mut text = "# A system of ROS 2\n\n".to_owned();
    for line in unknown::lines(system) {
        let _ = writeln!(text, "- {line}");
    }
    text + "\n`system.mal` has two deployments, or one of them: `Recorded` has the priorities of the recording, `Isolated` a thread for each \
            callback group. It says each assumption at its activity. Another `mauve import` adds executions, and keeps these files.\n"
}

fn times(system: &System<'_>) -> String {
    let mut text = "# Observed, not proved: the greatest times of a recording. `mauve pwcet` computes bounds from its executions.\n\
                    unit = \"us\"\n\n[codel]\n"
        .to_owned();
    for (_, callback, times) in system.executed() {
        let (whole, part) = (times.greatest / 1000, times.greatest % 1000);
        let of = if callback.elapsed > 0 { "elapsed" } else { "CPU time" };
        let (name, count) = (&callback.name, times.count);
        let _ = writeln!(
            text,
            "\"{ROS2_LIBRARY}.{name}\" = {whole}.{part:03}  # assumed: {of}, the greatest of {count}"
        );
    }
    text
}

/// A component of the model.
struct Part<'a> {
    callback: &'a Ros2Callback,
    component: String,
    /// The input ports, with what they are connected to.
    inputs: Vec<(String, PartSource)>,
    /// The same for what another callback of its node keeps for it.
    kept: Vec<(String, PartSource)>,
    /// The output ports, with their topics and the number of writes.
    outputs: Vec<(String, &'a str, u64)>,
    /// The deadline in nanoseconds: of a timer its period, which it passes on to what it releases; 0 if it is unknown.
    deadline: u64,
    thread: Option<String>,
}

/// An output port.
struct PartSource {
    /// The part that has it; `None` for [`OUTSIDE`].
    part: Option<usize>,
    port: String,
}

/// The instance that writes what no callback of the recording publishes, and its component.
const OUTSIDE: [&str; 2] = ["outside", "Outside"];

/// The ports between two callbacks of a node.
const KEPT: &str = "kept";

/// Its port for requests, and for what the recording does not say.
const REQUESTS: &str = "requests";

/// What says that callbacks have one thread.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum ThreadKey {
    Executor(usize),
    Group(usize),
    Thread(RecordedThread),
}

struct Model<'a> {
    parts: Vec<Part<'a>>,
    /// The ports of [`OUTSIDE`].
    outside: BTreeSet<String>,
    control: Vec<ControlThread>,
    system: &'a System<'a>,
}

impl<'a> Model<'a> {
    /// Returns the model, and the chains for its configuration.
    fn of(system: &'a System<'a>) -> (Model<'a>, String) {
        let mut names = BTreeSet::from([OUTSIDE[1].to_owned()]);
        let mut parts: Vec<Part<'a>> = Vec::new();
        for (_, callback, _) in system.executed() {
            let mut outputs: Vec<(String, &str, u64)> = Vec::new();
            for (publisher, messages) in &callback.publishes {
                let Some(publisher) = system.graph.publishers.get(*publisher) else { continue };
                let is_known = |it: &str| it == callback.name || outputs.iter().any(|of| of.0 == it);
                let name = unique(&ros2_identifier(&publisher.topic), is_known);
                outputs.push((name, &publisher.topic, messages.most));
            }
            let component = unique(&camel_case(&callback.name), |it| names.contains(it));
            names.insert(component.clone());
            let (inputs, kept) = (Vec::new(), Vec::new());
            parts.push(Part { callback, component, inputs, kept, outputs, deadline: 0, thread: None });
        }
        let inputs: Vec<_> = parts.iter().map(|it| it.inputs_from(&parts, system)).collect();
        parts.iter_mut().zip(inputs).for_each(|(part, inputs)| part.inputs = inputs);
        let all = parts.iter().flat_map(|it| &it.inputs);
        let outside = all.filter(|it| it.1.part.is_none()).map(|it| it.1.port.clone()).collect();
        names.extend(system.executed().map(|it| it.1.name.clone()).chain([OUTSIDE[0].to_owned()]));
        let control = system.controllers.iter().flat_map(|it| ControlThread::of(&it.1, &mut names)).collect();
        let mut model = Model { parts, outside, control, system };
        model.set_deadlines();
        model.set_threads();
        let mut names = BTreeSet::new();
        let chains = system.paths.iter().map(|path| model.chain(path, &mut names)).collect();
        (model, chains)
    }

    /// Returns the section of a chain. A node that gets data by one callback and passes it on by another one keeps it: the first has an
    /// output for the second.
    fn chain(&mut self, path: &NamedPath, names: &mut BTreeSet<String>) -> String {
        let name = comment(&path.name);
        let mut steps: Vec<usize> = Vec::new();
        for node in &path.nodes {
            let [receiver, sender] = [self.receiver(node), self.sender(node)];
            if receiver.is_none() && node.subscribes.is_some() || sender.is_none() && node.publishes.is_some()
            {
                let node = comment(&node.node);
                return format!(
                    "\n# The path {name} gives no chain: the recording has not both callbacks of {node}.\n"
                );
            }
            let sender = sender.filter(|it| receiver != Some(*it));
            if let (Some(receiver), Some(sender)) = (receiver, sender) {
                self.keep(receiver, sender);
            }
            steps.extend(receiver.into_iter().chain(sender));
        }
        let [first, through @ .., last] = steps.as_slice() else {
            return format!("\n# The path {name} gives no chain: it has fewer than two callbacks.\n");
        };
        let instance = |step: &usize| self.parts.get(*step).map_or("", |it| it.callback.name.as_str());
        let [from, to] = [first, last].map(instance);
        let own = unique(&ros2_identifier(&path.name), |it| names.contains(it));
        names.insert(own.clone());
        let through: Vec<String> = through.iter().map(|it| format!("\"{}\"", instance(it))).collect();
        format!(
            "\n# With a limit, such as `latency = \"500 ms\"`, `mauve check` compares it.\n[chains.\"{own}\"]\nfrom = \"{from}.{from}\"\n\
             to = \"{to}.{to}\"\nthrough = [{}]\n",
            through.join(", ")
        )
    }

    fn of_node(&self, node: &PathNode) -> impl Iterator<Item = (usize, &Part<'a>)> {
        let graph = self.system.graph;
        let is_of =
            |part: &Part<'_>| part.callback.node.and_then(|it| graph.nodes.get(it)) == Some(&node.node);
        self.parts.iter().enumerate().filter(move |(_, part)| is_of(part))
    }

    fn receiver(&self, node: &PathNode) -> Option<usize> {
        let release = Ros2Release::Subscription(node.subscribes.clone()?);
        self.of_node(node).find(|(_, part)| part.callback.release == release).map(|it| it.0)
    }

    /// The callback that publishes: the receiver, if it does; otherwise the first one of the node.
    fn sender(&self, node: &PathNode) -> Option<usize> {
        let topic = node.publishes.as_deref()?;
        let publishes = |part: &Part<'_>| part.outputs.iter().any(|it| it.1 == topic);
        let receiver = self.receiver(node).filter(|it| self.parts.get(*it).is_some_and(publishes));
        receiver.or_else(|| self.of_node(node).find(|(_, part)| publishes(part)).map(|it| it.0))
    }

    /// Connects two callbacks of a node, unless they are.
    fn keep(&mut self, receiver: usize, sender: usize) {
        if self.parts.get(sender).is_none_or(|it| it.kept.iter().any(|it| it.1.part == Some(receiver))) {
            return;
        }
        let [mut output, mut input] = [KEPT.to_owned(), KEPT.to_owned()];
        if let Some(part) = self.parts.get_mut(receiver) {
            output = unique(KEPT, |it| part.has_name(it));
            part.outputs.push((output.clone(), "", 1));
        }
        if let Some(part) = self.parts.get_mut(sender) {
            input = unique(&input, |it| part.has_name(it));
            part.kept.push((input, PartSource { part: Some(receiver), port: output }));
        }
    }

    fn set_deadlines(&mut self) {
        let own = |part: &Part<'_>| match part.callback.release {
            Ros2Release::Timer(period) => period,
            _ if part.has_outside() => part.seen(self.system).0,
            _ => 0,
        };
        let mut known: Vec<u64> = self.parts.iter().map(own).collect();
        for _ in 0..self.parts.len() {
            let next = |(part, own): (&Part<'_>, &u64)| {
                let of = part.inputs.iter().filter_map(|it| known.get(it.1.part?)).filter(|it| **it > 0);
                if *own > 0 { *own } else { of.min().copied().unwrap_or(0) }
            };
            let next: Vec<u64> = self.parts.iter().zip(&known).map(next).collect();
            if next == known {
                break;
            }
            known = next;
        }
        self.parts.iter_mut().zip(known).for_each(|(part, deadline)| part.deadline = deadline);
    }

    /// Callbacks of one group have one thread; those of an executor with a single one, or of one recorded thread, too.
    fn set_threads(&mut self) {
        let graph = self.system.graph;
        let mut threads: BTreeMap<ThreadKey, Vec<usize>> = BTreeMap::new();
        for (place, part) in self.parts.iter().enumerate() {
            let callback = part.callback;
            let executor = callback.group.and_then(|it| graph.executor_of(it));
            let key = match (
                executor.filter(|it| graph.has_one_thread(*it)),
                callback.group,
                callback.threads.first(),
            ) {
                (Some(executor), ..) => ThreadKey::Executor(executor),
                (_, Some(group), _) => ThreadKey::Group(group),
                (.., Some(thread)) if callback.threads.len() == 1 => ThreadKey::Thread(*thread),
                _ => continue,
            };
            threads.entry(key).or_default().push(place);
        }
        let mut names = BTreeSet::new();
        for places in threads.values().filter(|it| it.len() > 1) {
            let of = |place: &usize| self.parts.get(*place).and_then(|it| graph.nodes.get(it.callback.node?));
            let node = places.first().and_then(of).map_or("thread", String::as_str);
            let name = unique(&ros2_identifier(node), |it| names.contains(it));
            names.insert(name.clone());
            for place in places {
                if let Some(part) = self.parts.get_mut(*place) {
                    part.thread = Some(name.clone());
                }
            }
        }
    }

    fn text(&self) -> String {
        let mut text = format!("// A system of ROS 2: see README.md.\n\nlibrary {ROS2_LIBRARY} {{\n");
        for part in &self.parts {
            part.write(&mut text, self.system);
        }
        text.extend(self.control.iter().map(ControlThread::component));
        let [outside, component] = OUTSIDE;
        if !self.outside.is_empty() {
            let ports = self.outside.iter().map(|it| format!("output port {it}: Message"));
            let writes = self.outside.iter().map(|it| format!("write({it}, data);"));
            let [ports, writes] =
                [ports.collect::<Vec<_>>().join("  "), writes.collect::<Vec<_>>().join(" ")];
            let _ = writeln!(
                text,
                "  // What no callback of the recording publishes or requests.\n  shell {component}Shell {{ {ports} }}\n  \
                 core {component}Core({component}Shell) {{ var data: Message  update = {{ {writes} }} }}\n  \
                 component {component}({component}Shell, {component}Core)\n"
            );
        }
        text += "  architecture System {\n";
        for part in &self.parts {
            let _ = writeln!(text, "    instance {}: {}", part.callback.name, part.component);
        }
        text.extend(self.control.iter().map(ControlThread::instance));
        if !self.outside.is_empty() {
            let _ = writeln!(text, "    instance {outside}: {component}");
        }
        text.push('\n');
        for part in &self.parts {
            for (port, source) in part.all_inputs() {
                let from =
                    source.part.and_then(|it| self.parts.get(it)).map_or(outside, |it| &it.callback.name);
                let _ =
                    writeln!(text, "    connection {from}.{} -> {}.{port}", source.port, part.callback.name);
            }
        }
        text += "  }\n";
        let recorded = |part: &Part<'_>| match self.system.has_thread(part.callback) {
            true => part.callback.priority.unwrap_or(0),
            // It waits until one of the threads of its executor is free.
            false => 0,
        };
        // Without any, nothing in it has a bound.
        if self.parts.iter().any(|part| recorded(part) > 0) {
            self.deployment(&mut text, "Recorded", "The priorities of the recording.", recorded);
        }
        let ids: Vec<Option<String>> = self.parts.iter().map(|it| self.thread_id(it)).collect();
        if ids.iter().any(Option::is_some) {
            let _ = writeln!(
                text,
                "\n  // A thread for each callback group, with the priority and the CPUs of {}: `mauve tune` searches for better ones.\n  \
                 // The order is that of a `SingleThreadedExecutor`.\n  deployment Isolated {{\n    architecture System",
                comment(&self.system.threads.path)
            );
            for (part, id) in self.parts.iter().zip(ids) {
                let place = id.map(|it| format!(" thread = \"{it}\"  order = rounds"));
                text += &part.activity(place, self.system);
            }
            self.end_deployment(&mut text);
        } else if self.parts.is_empty() || self.parts.iter().any(|part| recorded(part) == 0) {
            let what = "A thread with a priority for each callback group: `mauve tune` searches for better priorities, and for CPUs.";
            let ranks = self.ranks();
            self.deployment(&mut text, "Isolated", what, |part| {
                ranks.get(part.thread_name()).copied().unwrap_or(1)
            });
        }
        text + "}\n"
    }

    /// Returns the id of the thread of a part in the file of threads.
    fn thread_id(&self, part: &Part<'_>) -> Option<String> {
        self.system.threads.id(self.system.graph, part.callback)
    }

    /// Returns the threads of a new file, with their priorities.
    fn new_threads(&self) -> BTreeMap<String, u32> {
        let ranks = self.ranks();
        let mut found: BTreeMap<String, u32> = BTreeMap::new();
        for part in self.parts.iter().filter(|_| self.system.threads.file.is_none()) {
            let Some(id) = self.system.threads.recorded(part.callback) else { continue };
            let rank = ranks.get(part.thread_name()).copied().unwrap_or(1);
            let of = found.entry(id.text().to_string()).or_default();
            *of = (*of).max(rank);
        }
        found
    }

    /// Returns a priority for each thread: the shorter its deadlines, the higher.
    fn ranks(&self) -> BTreeMap<&str, u32> {
        let mut deadlines: BTreeMap<&str, u64> = BTreeMap::new();
        for part in &self.parts {
            let of = deadlines.entry(part.thread_name()).or_insert(u64::MAX);
            *of = (*of).min(if part.deadline > 0 { part.deadline } else { u64::MAX });
        }
        let mut all: Vec<(&str, u64)> = deadlines.into_iter().collect();
        all.sort_by_key(|it| std::cmp::Reverse(it.1));
        all.into_iter().zip(1..).map(|((name, _), rank)| (name, rank.min(98))).collect()
    }

    fn deployment(&self, text: &mut String, name: &str, what: &str, priority: impl Fn(&Part<'_>) -> u32) {
        let _ = writeln!(text, "\n  // {what}\n  deployment {name} {{\n    architecture System");
        // A thread has one priority.
        let mut priorities: BTreeMap<&str, u32> = BTreeMap::new();
        for part in &self.parts {
            let of = priorities.entry(part.thread_name()).or_default();
            *of = (*of).max(priority(part));
        }
        for part in &self.parts {
            let priority = priorities.get(part.thread_name()).copied().unwrap_or(0);
            let thread =
                part.thread.as_ref().map_or(String::new(), |it| format!(" thread = {it}  order = any "));
            let place = (priority > 0).then(|| format!("{thread} priority = {priority}"));
            *text += &part.activity(place, self.system);
        }
        self.end_deployment(text);
    }

    fn end_deployment(&self, text: &mut String) {
        text.extend(self.control.iter().map(ControlThread::activity));
        if !self.outside.is_empty() {
            let _ = writeln!(text, "    activity {} {{ priority = background }}", OUTSIDE[0]);
        }
        *text += "  }\n";
    }
}

impl<'a> Part<'a> {
    /// Returns an input for each output of its topic, and for what comes from elsewhere.
    fn inputs_from(&self, all: &[Part<'a>], system: &System<'_>) -> Vec<(String, PartSource)> {
        let mut inputs: Vec<(String, PartSource)> = Vec::new();
        let topic = match &self.callback.release {
            Ros2Release::Timer(_) => return inputs,
            Ros2Release::Subscription(topic) => topic.as_str(),
            Ros2Release::Service(_) | Ros2Release::Unknown => REQUESTS,
        };
        let mut add = |part: Option<usize>, port: &str| {
            let is_known = |it: &str| self.has_name(it) || inputs.iter().any(|input| input.0 == it);
            let name = unique(&ros2_identifier(topic), is_known);
            inputs.push((name, PartSource { part, port: port.to_owned() }));
        };
        for (from, part) in all.iter().enumerate() {
            part.outputs.iter().filter(|it| it.1 == topic).for_each(|it| add(Some(from), &it.0));
        }
        if !system.knows_writers(self.callback) {
            add(None, &unique(&ros2_identifier(topic), |_| false));
        }
        inputs
    }

    fn all_inputs(&self) -> impl Iterator<Item = &(String, PartSource)> {
        self.inputs.iter().chain(&self.kept)
    }

    /// Whether a port has this name, or its codel, which a port would hide.
    fn has_name(&self, name: &str) -> bool {
        let mut ports = self.all_inputs().map(|it| &it.0).chain(self.outputs.iter().map(|it| &it.0));
        self.callback.name == name || ports.any(|it| it == name)
    }

    /// Whether something that the recording does not have releases it.
    fn has_outside(&self) -> bool {
        self.inputs.iter().any(|it| it.1.part.is_none())
    }

    /// Returns the least distance and the burst that the recording shows: regular begins have no burst.
    fn seen(&self, system: &System<'_>) -> (u64, u64) {
        let second = 1_000_000_000;
        let in_second = self.callback.in_second as u64;
        let gap = self.callback.least_gap.map(|gap| gap.min(self.least_gap(system).unwrap_or(gap)));
        match gap {
            // So many in a second that they are counted one by one, or hardly more than their least distance allows.
            Some(gap) if in_second >= 256 || gap.saturating_mul(in_second * 2) > second => (gap.max(1), 1),
            _ => (second, in_second.max(1)),
        }
    }

    /// Returns the least time between two messages of its topic.
    fn least_gap(&self, system: &System<'_>) -> Option<u64> {
        match &self.callback.release {
            Ros2Release::Subscription(topic) => system.graph.least_gap(topic),
            _ => None,
        }
    }

    /// The name of its thread.
    fn thread_name(&self) -> &str {
        self.thread.as_deref().unwrap_or(&self.callback.name)
    }

    /// Returns its activity. `place`: the fields that say with which priority it is executed; none in the background.
    fn activity(&self, place: Option<String>, system: &System<'_>) -> String {
        let name = &self.callback.name;
        let Some(place) = place else { return format!("    activity {name} {{ priority = background }}\n") };
        let (mut fields, mut assumed) = (place, Vec::new());
        match self.callback.release {
            Ros2Release::Timer(period) => {
                fields += &format!("  period = {}", Time::from_nanos(period.max(1)).number())
            }
            _ => self.triggered(&mut fields, &mut assumed, system),
        }
        if self.callback.late > 0 {
            let late = self.callback.late.div_ceil(1_000).saturating_mul(1_000);
            fields += &format!("  jitter = {}", Time::from_nanos(late).number());
            assumed.push("`jitter`");
        }
        let is = if assumed.len() == 1 { "is" } else { "are" };
        let why = format!("  // {} {is} assumed, by the recording.", all_of(&assumed));
        let why = if assumed.is_empty() { "" } else { &why };
        format!("    activity {name} {{{fields} }}{why}\n")
    }

    /// Writes the fields of an activity that messages release, and which of them are assumed.
    fn triggered(&self, text: &mut String, assumed: &mut Vec<&str>, system: &System<'_>) {
        let ports: Vec<&str> = self.inputs.iter().map(|it| it.0.as_str()).collect();
        match ports.as_slice() {
            [port] => _ = write!(text, "  trigger = {port}"),
            ports => _ = write!(text, "  trigger = any [{}]", ports.join(", ")),
        }
        let (least, burst) = match self.has_outside() {
            true => self.seen(system),
            // Messages are a little closer together than the timer's period.
            false => {
                let most = (self.deadline / 10 * 9).max(1_000);
                let least = self.least_gap(system).unwrap_or(most).clamp(1_000, most);
                (least / 1_000 * 1_000, 1)
            }
        };
        let _ = write!(text, "  least = {}", Time::from_nanos(least).number());
        assumed.push("`least`");
        if burst > 1 {
            let _ = write!(text, "  burst = {burst}");
            assumed.push("`burst`");
        }
        if self.deadline > 0 && self.deadline != least {
            let _ = write!(text, "  deadline = {}", Time::from_nanos(self.deadline).number());
        }
    }

    /// Writes its codel, shell, core and component.
    fn write(&self, text: &mut String, system: &System<'_>) {
        let Part { callback, component, outputs, .. } = self;
        let inputs: Vec<_> = self.all_inputs().collect();
        let name = &callback.name;
        let node = callback.node.and_then(|it| system.graph.nodes.get(it));
        let node = node.map_or("an unknown node", String::as_str);
        let _ = writeln!(text, "  // {}: {}", comment(node), comment(&released_by(&callback.release)));
        if !callback.symbol.is_empty() {
            let _ = writeln!(text, "  // {}", comment(&callback.symbol));
        }
        for (publisher, messages) in &callback.publishes {
            let topic = system.graph.publishers.get(*publisher).map_or("", |it| it.topic.as_str());
            if messages.all < callback.executions {
                let (topic, all, of) = (comment(topic), messages.all, callback.executions);
                let _ = writeln!(
                    text,
                    "  // {of} executions published {all} messages of {topic}; here, each publishes."
                );
            }
        }
        let ins = inputs.iter().map(|it| format!("in {}: Message", it.0));
        let outs = outputs.iter().map(|it| format!("out {}: Message", it.0));
        let _ = writeln!(text, "  codel {name}({}): void", ins.chain(outs).collect::<Vec<_>>().join(", "));
        let ports = inputs.iter().map(|it| format!("input port {}: Message", it.0));
        let ports = ports.chain(outputs.iter().map(|it| format!("output port {}: Message", it.0)));
        let ports: Vec<String> = ports.collect();
        let _ = writeln!(text, "  shell {component}Shell {{ {} }}", ports.join("  "));
        let _ = writeln!(text, "  core {component}Core({component}Shell) {{");
        let all = inputs.iter().map(|it| &it.0).chain(outputs.iter().map(|it| &it.0));
        let mut variables: Vec<String> = Vec::new();
        for port in all {
            let is_known = |it: &str| self.has_name(it) || variables.iter().any(|known| known == it);
            variables.push(unique(&format!("{port}_data"), is_known));
        }
        for variable in &variables {
            let _ = writeln!(text, "    var {variable}: Message");
        }
        let reads =
            inputs.iter().zip(&variables).map(|(it, variable)| format!("read({}, {variable});", it.0));
        let call = format!("{name}({});", variables.join(", "));
        let of_outputs = variables.iter().skip(inputs.len());
        let writes = outputs.iter().zip(of_outputs).flat_map(|((port, _, most), variable)| {
            let times = usize::try_from((*most).clamp(1, MOST_WRITES)).unwrap_or(1);
            std::iter::repeat_n(format!("write({port}, {variable});"), times)
        });
        let statements: Vec<String> = reads.chain([call]).chain(writes).collect();
        let _ = writeln!(text, "    update = {{ {} }}\n  }}", statements.join(" "));
        let _ = writeln!(text, "  component {component}({component}Shell, {component}Core)\n");
    }
}

#[cfg(test)]
mod tests {
    use mauve_diagnostics::first_error;
    use mauve_hir::ros2_files::read_controllers;
    use mauve_hir::{Database, Workspace, projects};
    use mauve_pwcet::trace::{Ros2Graph, Ros2Messages, Ros2Publisher};
    use proptest::prelude::*;

    use super::super::recorded::Times;
    use super::super::threads::Threads;
    use super::*;

    /// A callback for each entry: its node, what releases it, and the topics that it publishes.
    fn graph(entries: &[(&str, Ros2Release, Vec<&str>)]) -> Ros2Graph {
        let mut graph = Ros2Graph::default();
        for (number, (node, release, topics)) in entries.iter().enumerate() {
            let known = graph.nodes.iter().position(|it| it == node);
            let node = known.unwrap_or_else(|| {
                graph.nodes.push((*node).to_owned());
                graph.nodes.len() - 1
            });
            let mut callback = Ros2Callback::default();
            (callback.node, callback.release) = (Some(node), release.clone());
            callback.name = format!("{}_{number}", ros2_identifier(graph.nodes[node].as_str()));
            (callback.executions, callback.symbol) = (3, "a\n*/ \"b\u{202e}\u{2028}\r".to_owned());
            for topic in topics {
                let messages = Ros2Messages { all: 3, most: 1 };
                callback.publishes.insert(graph.publishers.len(), messages);
                let publisher = Ros2Publisher {
                    node: Some(node),
                    topic: (*topic).to_owned(),
                    ..Ros2Publisher::default()
                };
                graph.publishers.push(publisher);
            }
            graph.callbacks.push(callback);
        }
        graph
    }

    const CONTROLLERS: &str = "controller_manager:
  ros__parameters:
    update_rate: 500
    joints: { type: broadcasters/Joints }
    in: { type: controllers/Slow }
    'a\"}': { type: controllers/Odd }
    plan: { type: controllers/Plan }
in: { ros__parameters: { update_rate: 100, is_async: true, async_parameters: { cpu_affinity: [4] } } }
plan: { ros__parameters: { update_rate: 100 } }
arm: { controller_manager: { ros__parameters: { joints: { type: broadcasters/Joints } } } }
";

    #[test]
    fn a_control_loop_executes_its_controllers() {
        let (files, errors) = checked(&Ros2Graph::default(), Vec::new());
        assert_eq!(errors, Vec::<String>::new());
        let model = &files["system.mal"];
        for expected in [
            "update = { controller_manager_read(); joints_update(); a___update(); plan_update(); controller_manager_write(); }",
            "update = { in_update(); }",
            "update = { arm_controller_manager_read(); arm_joints_update(); arm_controller_manager_write(); }",
            "activity controller_manager { thread = \"/controller_manager\" }",
            "activity in_async { thread = \"/in\" }",
            "activity arm_controller_manager { thread = \"/arm/controller_manager\" }",
        ] {
            assert!(model.contains(expected), "{expected}: {model}");
        }
        let config = &files["mauve.toml"];
        assert!(config.contains("cpus = 5") && !config.contains("observed"), "{config}");
    }

    /// Returns the files, and the errors in them.
    fn checked(graph: &Ros2Graph, paths: Vec<NamedPath>) -> (BTreeMap<&'static str, String>, Vec<String>) {
        let mut times = Times::default();
        for callback in &graph.callbacks {
            times.0.entry(callback.name.clone()).or_default();
        }
        let threads = Threads::new(graph, THREADS.to_owned(), None);
        let controllers = vec![("controllers.yaml".to_owned(), read_controllers(CONTROLLERS))];
        let files: BTreeMap<_, _> =
            files(&System { graph, times: times.0, paths, threads, controllers }).into_iter().collect();
        let db = Database::default();
        let texts = ["mauve.toml", "system.mal", "timing.toml"].map(|it| (it, files[it].clone()));
        let texts = texts.into_iter().chain([(OBSERVED, "unit = \"ms\"\n".to_owned())]);
        let texts = texts.chain(files.get(THREADS).map(|it| (THREADS, it.clone())));
        let texts = texts.chain([("controllers.yaml", CONTROLLERS.to_owned())]);
        let workspace =
            Workspace::of_texts(&db, "/".into(), texts.map(|(name, text)| (format!("/{name}").into(), text)));
        let projects = projects(&db, workspace);
        assert_eq!(projects.len(), 1);
        let errors = first_error(&db, projects[0]).into_iter().map(|it| it.message).collect();
        (files, errors)
    }

    #[test]
    fn a_node_keeps_data_for_another_callback() {
        let timer = || Ros2Release::Timer(100_000_000);
        let on = |topic: &str| Ros2Release::Subscription(topic.to_owned());
        let graph = graph(&[
            ("/eye", timer(), vec!["/seen"]),
            ("/head", on("/seen"), vec![]),
            ("/head", timer(), vec!["/goal"]),
            ("/hand", on("/goal"), vec![]),
        ]);
        let node = |node: &str, subscribes: &str, publishes: &str| PathNode {
            node: node.to_owned(),
            subscribes: Some(subscribes.to_owned()).filter(|it| !it.is_empty()),
            publishes: Some(publishes.to_owned()).filter(|it| !it.is_empty()),
        };
        let nodes =
            vec![node("/eye", "", "/seen"), node("/head", "/seen", "/goal"), node("/hand", "/goal", "")];
        // Two files may have a path of one name.
        let again = NamedPath { name: "reach".to_owned(), nodes: nodes.clone() };
        let reach = NamedPath { name: "reach".to_owned(), nodes };
        let lost = NamedPath { name: "lost\n[x]".to_owned(), nodes: vec![node("/eye", "", "/other")] };
        let (files, errors) = checked(&graph, vec![reach, lost, again]);
        assert_eq!(errors, Vec::<String>::new());
        let model = &files["system.mal"];
        assert!(model.contains(r#"  // a\u{a}*/ "b\u{202e}\u{2028}"#), "{model}");
        assert!(model.contains("connection head_1.kept -> head_2.kept"), "{model}");
        assert!(model.contains("activity head_2 { priority = 4  period = 100 }"), "{model}");
        let config = &files["mauve.toml"];
        assert!(
            config.contains(
                "from = \"eye_0.eye_0\"\nto = \"hand_3.hand_3\"\nthrough = [\"head_1\", \"head_2\"]"
            ),
            "{config}"
        );
        assert!(config.contains("[chains.\"reach\"]") && config.contains("[chains.\"reach_2\"]"), "{config}");
        assert!(config.contains("# The path lost\\u{a}[x] gives no chain"), "{config}");
    }

    /// Without the events of CARET, the recorded threads say who waits for whom.
    #[test]
    fn callbacks_of_one_thread_wait_for_each_other() {
        let timer = |period: u64| Ros2Release::Timer(period * 1_000_000);
        let mut graph =
            graph(&[("/a", timer(10), vec![]), ("/b", timer(20), vec![]), ("/c", timer(30), vec![])]);
        let thread = |thread| RecordedThread { origin: 0, process: 7, thread };
        for (callback, threads) in graph.callbacks.iter_mut().zip([vec![1], vec![1], vec![1, 2]]) {
            callback.threads = threads.into_iter().map(thread).collect();
            callback.priority = Some(40);
        }
        let (files, errors) = checked(&graph, Vec::new());
        assert_eq!(errors, Vec::<String>::new());
        let model = &files["system.mal"];
        let recorded = model.split("deployment Recorded").nth(1).unwrap().split("deployment").next().unwrap();
        assert!(
            recorded.contains("activity a_0 { thread = a  order = any  priority = 40  period = 10 }"),
            "{model}"
        );
        assert!(
            recorded.contains("activity b_1 { thread = a  order = any  priority = 40  period = 20 }"),
            "{model}"
        );
        // Several threads execute it.
        assert!(recorded.contains("activity c_2 { priority = background }"), "{model}");
    }

    proptest! {
        /// Names of ROS 2 may be keywords here, and a recording may have any text.
        #[test]
        fn any_names_give_a_model(
            entries in proptest::collection::vec((0..9_usize, 0..9_usize, 0..4_u8, proptest::collection::vec(0..9_usize, 0..4)), 1..6),
            groups in proptest::collection::vec(proptest::option::of(0..3_usize), 6),
        ) {
            const NAMES: [&str; 9] = ["/in", "/in_data", "/a_b", "/update", "/read", "/é\"}\n", "/3d", "/void", ""];
            let entries: Vec<_> = entries.into_iter().map(|(node, topic, kind, topics)| {
                let release = match kind {
                    0 => Ros2Release::Timer(topic as u64),
                    1 => Ros2Release::Subscription(NAMES[topic].to_owned()),
                    2 => Ros2Release::Service(NAMES[topic].to_owned()),
                    _ => Ros2Release::Unknown,
                };
                (NAMES[node], release, topics.into_iter().map(|it| NAMES[it]).collect())
            }).collect();
            let mut graph = graph(&entries);
            graph.callbacks.iter_mut().zip(groups).for_each(|(it, group)| it.group = group);
            let (files, errors) = checked(&graph, Vec::new());
            prop_assert!(errors.is_empty(), "{errors:?} in {}", files["system.mal"]);
        }
    }
}
