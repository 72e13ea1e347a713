//! What a recording of `ros2_tracing` says of a system of ROS 2, with or without the events of CARET and of the scheduler.
//!
//! A callback becomes a codel, and an instance of the same name: `filter_node_on_points`, `drive_node_timer_100ms`. Names come from
//! the node, the topic or the period, never from an address, so that two recordings of one system have the same ones. Where several
//! callbacks would have one name, the later ones have a number.
//!
//! With the events of the scheduler, an execution takes the CPU time of its thread. Without them, it takes the time from its begin to
//! its end: that is longer where the thread was preempted or waited, and never shorter.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};

use super::RecordedThread;
use super::error::TraceError;
use super::event::{Ros2Event, SwitchEvent};
use super::names::NameId;

/// The library of the codels that callbacks are.
pub const ROS2_LIBRARY: &str = "ros";

// They bound the memory that a hostile recording needs.
const MOST_ENTITIES: usize = 1 << 15;
const MOST_THREADS: usize = 1 << 16;
const MOST_OF_CALLBACK: usize = 1 << 8;
const MOST_HOSTS: usize = 1 << 8;
const LONGEST_NAME: usize = 1 << 10;
const MOST_INTERVALS: usize = 1 << 6;

/// The number of the threads that Linux executes where it has nothing to execute.
const IDLE: u64 = 0;

/// A message that is older in nanoseconds was published by another clock.
const LONGEST_AGE: u64 = 10_000_000_000;

/// What a recording says of a system of ROS 2.
#[derive(Debug, Default)]
pub struct Ros2Graph {
    /// The nodes with their namespaces, such as `/arm/driver`, in the order in which they were made.
    pub nodes: Vec<String>,
    /// The callbacks, in the order in which they were made.
    pub callbacks: Vec<Ros2Callback>,
    /// The publishers, in the order in which they were made.
    pub publishers: Vec<Ros2Publisher>,
    /// The callback groups, in the order in which executors got them; only with the events of CARET.
    pub groups: Vec<Ros2Group>,
    /// The types of the executors, such as `multi_threaded_executor`; only with the events of CARET.
    pub executors: Vec<String>,
    /// Executions of callbacks that were made before the recording began.
    pub unknown: u64,
    /// The greatest number of a CPU on which a callback began, from 0.
    pub last_cpu: Option<u32>,
    /// The last message of each topic, and the least time between two messages.
    topics: HashMap<String, (u64, Option<u64>)>,
    handles: HashMap<Handle, usize>,
    /// What threads execute now.
    open: HashMap<RecordedThread, OpenCallback>,
    /// The last executions of threads.
    busy: HashMap<RecordedThread, Busy>,
    /// When the messages that threads have just taken were published.
    taken: HashMap<RecordedThread, u64>,
    /// The publishers of the messages that threads have just passed on within their processes.
    within: HashMap<RecordedThread, usize>,
    hosts: HashMap<Vec<u8>, u32>,
    /// By host and thread.
    clocks: HashMap<(u32, u64), ThreadClock>,
    /// The thread that each CPU of a host executes.
    running: HashMap<(u32, u32), u64>,
    /// The names of callbacks, each with the last number behind it.
    names: HashMap<String, u32>,
    /// The callbacks before this one have a name.
    named: usize,
}

/// A callback of a node.
#[derive(Debug, Clone, Default)]
pub struct Ros2Callback {
    /// Its name; empty until it, or a later one, was executed.
    pub name: String,
    /// The index of its node, if the recording says it.
    pub node: Option<usize>,
    /// What releases it.
    pub release: Ros2Release,
    /// The function, as far as the compiler names it.
    pub symbol: String,
    /// The index of its callback group.
    pub group: Option<usize>,
    /// What it publishes, by the index of the publisher.
    pub publishes: BTreeMap<usize, Ros2Messages>,
    /// The threads that execute it.
    pub threads: BTreeSet<RecordedThread>,
    /// The greatest priority of the real-time scheduler that these had; 0 without one, `None` if the recording does not say it.
    pub priority: Option<u32>,
    /// How often it began.
    pub executions: u64,
    /// How many executions have an elapsed time, and no CPU time.
    pub elapsed: u64,
    /// The most time from its release to its begin in which neither another callback that it waits for was executed, nor a thread of its
    /// priority or a higher one, as far as the recording says that: of messages, and of what wakes the thread up. The releases of a
    /// timer are the latest ones that agree with its begins.
    pub late: u64,
    /// When it was made.
    made: u64,
    /// The next release of a timer.
    next: Option<u64>,
    /// The least time between two begins.
    pub least_gap: Option<u64>,
    /// The most begins within a second; of more than 256, 256.
    pub in_second: usize,
    /// The last begins within a second.
    begins: VecDeque<u64>,
    pub(super) ids: Option<[NameId; 2]>,
}

/// What releases a callback.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Ros2Release {
    /// A timer with this period in nanoseconds.
    Timer(u64),
    /// Messages of a topic.
    Subscription(String),
    /// Requests of a service.
    Service(String),
    /// The recording does not say it.
    #[default]
    Unknown,
}

/// What a callback publishes with one publisher.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Ros2Messages {
    /// The number of messages.
    pub all: u64,
    /// The most messages of one execution.
    pub most: u64,
}

/// A publisher of a node.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Ros2Publisher {
    /// The index of its node, if the recording says it.
    pub node: Option<usize>,
    /// Its topic.
    pub topic: String,
    /// How many messages no known callback published.
    pub outside: u64,
}

/// A callback group.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Ros2Group {
    /// Its type, such as `mutually_exclusive`.
    pub kind: String,
    /// Its executor, or what collects groups for one.
    owner: Option<Handle>,
    /// Its last executions.
    busy: Busy,
}

/// The last intervals of executions.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Busy(VecDeque<[u64; 2]>);

/// What an address in a process is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Handle {
    kind: HandleKind,
    origin: u32,
    process: u64,
    address: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum HandleKind {
    Node,
    Publisher,
    Timer,
    Subscription,
    /// The object of rclcpp that has a subscription of rcl.
    SubscriptionObject,
    Service,
    Callback,
    Group,
    /// An executor, or what collects groups for one.
    Executor,
}

/// The CPU time of a thread.
#[derive(Debug, Clone, Copy, Default)]
struct ThreadClock {
    used: u64,
    /// Since when it has a CPU.
    since: Option<u64>,
    /// When a thread of its priority or a higher one last had its CPU.
    displaced: [u64; 2],
    priority: Option<u32>,
}

/// A callback that a thread executes.
#[derive(Debug, Clone)]
struct OpenCallback {
    callback: usize,
    begin: u64,
    /// The CPU time of its thread at the begin, if that is known.
    used: Option<u64>,
    /// The number of messages, by publisher.
    published: BTreeMap<usize, u64>,
}

/// A callback begins or ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CallbackEvent {
    pub(super) callback: usize,
    pub(super) is_end: bool,
    /// A time that grows by the execution time from the begin to the end.
    pub(super) cpu_ns: u64,
    /// Of a begin by a message: when that was published, by the clock of its publisher.
    pub(super) release: Option<u64>,
}

impl Ros2Graph {
    /// Returns the index of the executor of a group, if the recording says it.
    pub fn executor_of(&self, group: usize) -> Option<usize> {
        self.index(self.groups.get(group)?.owner?)
    }

    /// Returns whether an executor has one thread.
    pub fn has_one_thread(&self, executor: usize) -> bool {
        self.executors.get(executor).is_some_and(|it| it.contains("single_threaded") || it.contains("static"))
    }

    /// Returns the least time between two messages of a topic, if the recording has two.
    pub fn least_gap(&self, topic: &str) -> Option<u64> {
        self.topics.get(topic)?.1
    }

    /// Takes an event. Returns the callback that begins or ends.
    pub(super) fn event(
        &mut self,
        event: &Ros2Event<'_>,
        thread: RecordedThread,
    ) -> Result<Option<CallbackEvent>, TraceError> {
        match event.name {
            b"callback_start" => return Ok(self.execution(event, thread, false)),
            b"callback_end" => return Ok(self.execution(event, thread, true)),
            b"rmw_take" if event.number("taken") == Some(1) => {
                self.take(event.number("source_timestamp"), thread)
            }
            b"dispatch_subscription_callback" => self.take(event.number("source_stamp"), thread),
            b"rcl_publish" => _ = self.publish(event, thread, false),
            b"rclcpp_intra_publish" => _ = self.publish(event, thread, true),
            _ => _ = self.made(event, thread),
        }
        let parts = [self.nodes.len(), self.callbacks.len(), self.publishers.len(), self.groups.len()];
        let count = parts.iter().sum::<usize>() + self.executors.len();
        match count > MOST_ENTITIES || self.handles.len() > 4 * MOST_ENTITIES {
            true => Err(TraceError::TooManyNames),
            false => Ok(None),
        }
    }

    /// Takes what was made, or joined. `None` where a field is missing, or unknown.
    fn made(&mut self, event: &Ros2Event<'_>, thread: RecordedThread) -> Option<()> {
        let handle = |kind: HandleKind, field: &str| {
            let RecordedThread { origin, process, .. } = thread;
            Some(Handle { kind, origin, process, address: event.number(field)? })
        };
        let text = |field: &str| Some(event.text(field)?.chars().take(LONGEST_NAME).collect::<String>());
        let node = |graph: &Self| graph.index(handle(HandleKind::Node, "node_handle")?);
        let timer = || handle(HandleKind::Timer, "timer_handle");
        let subscription = || handle(HandleKind::Subscription, "subscription_handle");
        let service = || handle(HandleKind::Service, "service_handle");
        let group = || handle(HandleKind::Group, "callback_group_addr");
        let collector = || handle(HandleKind::Executor, "entities_collector_addr");
        let executor = || handle(HandleKind::Executor, "executor_addr");
        match event.name {
            b"rcl_node_init" => {
                let (namespace, name) = (text("namespace")?, text("node_name")?);
                self.handles.insert(handle(HandleKind::Node, "node_handle")?, self.nodes.len());
                self.nodes.push(format!("{}/{name}", namespace.trim_end_matches('/')));
            }
            b"rcl_publisher_init" => {
                let publisher = handle(HandleKind::Publisher, "publisher_handle")?;
                let (node, topic) = (node(self), text("topic_name")?);
                self.handles.insert(publisher, self.publishers.len());
                self.publishers.push(Ros2Publisher { node, topic, ..Ros2Publisher::default() });
            }
            b"rcl_timer_init" => {
                self.callback(timer()?, (None, event.time), Ros2Release::Timer(event.number("period")?));
            }
            b"rcl_subscription_init" => {
                let of = (node(self), event.time);
                self.callback(subscription()?, of, Ros2Release::Subscription(text("topic_name")?));
            }
            b"rcl_service_init" => {
                let of = (node(self), event.time);
                self.callback(service()?, of, Ros2Release::Service(text("service_name")?));
            }
            b"rclcpp_timer_link_node" => {
                let (of, node) = (self.index(timer()?)?, node(self)?);
                self.callbacks.get_mut(of)?.node = Some(node);
            }
            b"rclcpp_subscription_init" => {
                self.same(handle(HandleKind::SubscriptionObject, "subscription")?, subscription()?)?;
            }
            b"rclcpp_timer_callback_added" => {
                self.same(handle(HandleKind::Callback, "callback")?, timer()?)?
            }
            b"rclcpp_subscription_callback_added" => {
                let object = handle(HandleKind::SubscriptionObject, "subscription")?;
                self.same(handle(HandleKind::Callback, "callback")?, object)?;
            }
            b"rclcpp_service_callback_added" => {
                self.same(handle(HandleKind::Callback, "callback")?, service()?)?;
            }
            b"rclcpp_callback_register" => {
                let of = self.index(handle(HandleKind::Callback, "callback")?)?;
                self.callbacks.get_mut(of)?.symbol = text("symbol")?;
            }
            b"construct_executor" | b"construct_static_executor" => {
                let kind = text("executor_type_name")?;
                let all = [executor(), collector()];
                self.handles.extend(all.into_iter().flatten().map(|it| (it, self.executors.len())));
                self.executors.push(kind);
            }
            b"executor_entity_collector_to_executor" => self.same(collector()?, executor()?)?,
            b"add_callback_group"
            | b"add_callback_group_static_executor"
            | b"callback_group_to_executor_entity_collector" => {
                let (kind, owner) = (text("group_type_name")?, executor().or_else(collector));
                let group = self.group(group()?);
                *self.groups.get_mut(group)? = Ros2Group { kind, owner, busy: Busy::default() };
            }
            b"callback_group_add_timer" => self.join(timer()?, group()?)?,
            b"callback_group_add_subscription" => self.join(subscription()?, group()?)?,
            b"callback_group_add_service" => self.join(service()?, group()?)?,
            _ => {}
        }
        Some(())
    }

    fn index(&self, handle: Handle) -> Option<usize> {
        self.handles.get(&handle).copied()
    }

    /// Gives a new handle the index of a known one.
    fn same(&mut self, new: Handle, known: Handle) -> Option<()> {
        let of = self.index(known)?;
        self.handles.insert(new, of);
        Some(())
    }

    /// Enters a callback. What was made again at the same address is the same one.
    fn callback(&mut self, handle: Handle, (node, made): (Option<usize>, u64), release: Ros2Release) {
        let known = self.index(handle).and_then(|it| self.callbacks.get(it));
        if known.is_none_or(|it| it.release != release || node.is_some_and(|node| it.node != Some(node))) {
            self.handles.insert(handle, self.callbacks.len());
            self.callbacks.push(Ros2Callback { node, made, release, ..Ros2Callback::default() });
        }
    }

    fn group(&mut self, handle: Handle) -> usize {
        let next = self.groups.len();
        let of = *self.handles.entry(handle).or_insert(next);
        if of == next {
            self.groups.push(Ros2Group::default());
        }
        of
    }

    fn join(&mut self, callback: Handle, group: Handle) -> Option<()> {
        let of = self.index(callback)?;
        let group = self.group(group);
        self.callbacks.get_mut(of)?.group = Some(group);
        Some(())
    }

    fn execution(
        &mut self,
        event: &Ros2Event<'_>,
        thread: RecordedThread,
        is_end: bool,
    ) -> Option<CallbackEvent> {
        let RecordedThread { origin, process, .. } = thread;
        let handle =
            Handle { kind: HandleKind::Callback, origin, process, address: event.number("callback")? };
        let Some(callback) = self.index(handle) else {
            self.unknown += u64::from(!is_end);
            return None;
        };
        self.name(callback);
        let now = self.clock_at(event, thread.thread);
        if is_end {
            let open = self.open.remove(&thread).filter(|open| open.callback == callback);
            let begin = open.as_ref().map_or(event.time, |open| open.begin);
            let used = now
                .zip(open.as_ref().and_then(|open| open.used))
                .and_then(|(now, then)| now.used.checked_sub(then));
            self.callbacks.get_mut(callback)?.elapsed += u64::from(open.is_some() && used.is_none());
            let used = used.unwrap_or(event.time.saturating_sub(begin));
            let cpu_ns = begin.saturating_add(used);
            if self.busy.len() >= MOST_THREADS {
                self.busy.clear();
            }
            let group = self.callbacks.get(callback).and_then(|it| self.groups.get_mut(it.group?));
            let of_thread = self.busy.entry(thread).or_default();
            group
                .map(|it| &mut it.busy)
                .into_iter()
                .chain([of_thread])
                .for_each(|it| it.add([begin, event.time]));
            return Some(CallbackEvent { callback, is_end, cpu_ns, release: None });
        }
        if self.open.len() >= MOST_THREADS {
            self.open.clear();
        }
        let used = now.map(|it| it.used);
        self.open
            .insert(thread, OpenCallback { callback, begin: event.time, used, published: BTreeMap::new() });
        let of = self.callbacks.get_mut(callback)?;
        of.executions += 1;
        of.priority = of.priority.max(now.and_then(|it| it.priority));
        if of.threads.len() < MOST_OF_CALLBACK {
            of.threads.insert(thread);
        }
        of.begins(event.time);
        self.last_cpu = self.last_cpu.max(event.cpu);
        let published =
            self.taken.remove(&thread).filter(|_| matches!(of.release, Ros2Release::Subscription(_)));
        // Of another computer, the clock may be any. What was published before it was made is kept for those that come late.
        let is_valid =
            |it: &u64| *it >= of.made && event.time.checked_sub(*it).is_some_and(|age| age < LONGEST_AGE);
        let release = published.filter(is_valid);
        let late = [of.released(event.time, release), event.time];
        let displaced = now.map_or([0; 2], |it| it.displaced);
        let idle = idle(late, [&displaced]).min(idle(late, self.busy_with(callback, thread)));
        let of = self.callbacks.get_mut(callback)?;
        of.late = of.late.max(idle);
        Some(CallbackEvent { callback, is_end, cpu_ns: event.time, release })
    }

    /// Returns when others were executed that a callback waits for: of its group, or of its thread, where it has only one.
    fn busy_with(&self, callback: usize, thread: RecordedThread) -> impl Iterator<Item = &[u64; 2]> {
        let of = self.callbacks.get(callback);
        let group = of.and_then(|it| it.group);
        let has_one = group.and_then(|it| self.executor_of(it)).is_some_and(|it| self.has_one_thread(it));
        let is_exclusive = |it: &&Ros2Group| !has_one && !it.kind.contains("reentrant");
        let found = match group.and_then(|it| self.groups.get(it)).filter(is_exclusive) {
            Some(group) => Some(&group.busy),
            None if of.is_some_and(|it| it.threads.iter().all(|it| *it == thread)) => self.busy.get(&thread),
            None => None,
        };
        found.into_iter().flat_map(|it| &it.0)
    }

    /// A thread has taken a message that was published then: it executes its callback next.
    fn take(&mut self, published: Option<u64>, thread: RecordedThread) {
        if self.taken.len() >= MOST_THREADS {
            self.taken.clear();
        }
        self.taken.extend(published.filter(|it| *it > 0).map(|it| (thread, it)));
    }

    /// A message that goes to other nodes of the process, and to other processes, has both events, one after the other.
    fn publish(&mut self, event: &Ros2Event<'_>, thread: RecordedThread, is_within: bool) -> Option<()> {
        let RecordedThread { origin, process, .. } = thread;
        let address = event.number("publisher_handle")?;
        let publisher = self.index(Handle { kind: HandleKind::Publisher, origin, process, address })?;
        let last = self.within.remove(&thread);
        if is_within {
            if self.within.len() >= MOST_THREADS {
                self.within.clear();
            }
            self.within.insert(thread, publisher);
        } else if last == Some(publisher) {
            return None;
        }
        let of = self.publishers.get_mut(publisher)?;
        match self.topics.get_mut(&of.topic) {
            Some((last, least)) => {
                let gap = event.time.saturating_sub(*last);
                (*last, *least) = (event.time, Some(least.map_or(gap, |it| it.min(gap))));
            }
            None => _ = self.topics.insert(of.topic.clone(), (event.time, None)),
        }
        let open = self.open.get_mut(&thread).filter(|it| it.published.len() < MOST_OF_CALLBACK);
        let callback = open.and_then(|open| {
            let messages = open.published.entry(publisher).or_default();
            *messages += 1;
            Some((self.callbacks.get_mut(open.callback)?, *messages))
        });
        match callback {
            Some((callback, messages)) => {
                let of = callback.publishes.entry(publisher).or_default();
                (of.all, of.most) = (of.all + 1, of.most.max(messages));
            }
            None => of.outside += 1,
        }
        Some(())
    }

    /// Names a callback, and those that were made before it and can be named: the order of executions gives no names.
    fn name(&mut self, callback: usize) {
        for of in self.callbacks.iter_mut().take(callback + 1).skip(self.named) {
            let node = of.node.and_then(|it| self.nodes.get(it)).map_or("", String::as_str);
            let base = callback_name(node, &of.release);
            let mut number = self.names.get(&base).copied().unwrap_or(1);
            of.name.clone_from(&base);
            while self.names.contains_key(&of.name) {
                number += 1;
                of.name = format!("{base}_{number}");
            }
            self.names.insert(base, number);
            self.names.entry(of.name.clone()).or_insert(1);
        }
        self.named = self.named.max(callback + 1);
    }

    /// Returns the number of a host. `None` for more hosts than are kept apart: their CPU times are unknown.
    fn host(&mut self, name: &[u8]) -> Option<u32> {
        if let Some(host) = self.hosts.get(name) {
            return Some(*host);
        }
        let next = u32::try_from(self.hosts.len()).ok().filter(|_| self.hosts.len() < MOST_HOSTS)?;
        self.hosts.insert(name.to_owned(), next);
        Some(next)
    }

    /// Takes the CPU from one thread, and gives it to another.
    pub(super) fn switch(&mut self, event: &SwitchEvent<'_>) {
        let Some(host) = self.host(event.host) else { return };
        if self.clocks.len() >= MOST_THREADS || self.running.len() >= MOST_THREADS {
            (self.clocks, self.running) = Default::default();
            self.open.values_mut().for_each(|open| open.used = None);
        }
        let mut before = None;
        if let Some(clock) = self.clocks.get_mut(&(host, event.previous)) {
            before = clock.priority.zip(clock.since).filter(|_| event.previous != IDLE);
            if let Some(since) = clock.since.take() {
                clock.used = clock.used.saturating_add(event.time.saturating_sub(since));
            }
        }
        let clock = self.clocks.entry((host, event.next)).or_default();
        (clock.since, clock.priority) = (Some(event.time), Some(event.priority));
        if let Some((_, since)) = before.filter(|it| it.0 >= event.priority) {
            clock.displaced = [since, event.time];
        }
        self.running.insert((host, event.cpu), event.next);
    }

    /// Returns the clock of a thread at its event; its `used` counts until now. `None` unless the scheduler says that the thread has this
    /// CPU: within a container, its number is that of another thread outside.
    fn clock_at(&mut self, event: &Ros2Event<'_>, thread: u64) -> Option<ThreadClock> {
        let host = self.host(event.host())?;
        self.running.get(&(host, event.cpu?)).filter(|it| **it == thread)?;
        let clock = self.clocks.get(&(host, thread))?;
        let used = clock.used.checked_add(event.time.checked_sub(clock.since?)?)?;
        Some(ThreadClock { used, ..*clock })
    }
}

impl Busy {
    fn add(&mut self, interval: [u64; 2]) {
        if self.0.len() >= MOST_INTERVALS {
            self.0.pop_front();
        }
        self.0.push_back(interval);
    }
}

/// Returns the time between two instants in which nothing was executed, as far as it is known.
fn idle<'a>([from, to]: [u64; 2], busy: impl IntoIterator<Item = &'a [u64; 2]>) -> u64 {
    let busy = busy.into_iter().map(|[begin, end]| (*end).min(to).saturating_sub((*begin).max(from)));
    busy.fold(to.saturating_sub(from), u64::saturating_sub)
}

impl Ros2Callback {
    /// Returns when what begins now was released.
    fn released(&mut self, now: u64, published: Option<u64>) -> u64 {
        match self.release {
            Ros2Release::Timer(period) if period > 0 => {
                // A timer leaves out what it missed, and one that was stopped begins anew.
                let next = self.next.filter(|next| now.saturating_sub(*next) < period).unwrap_or(now);
                // Begins before it: the earlier ones were later than they seemed.
                self.late = self.late.saturating_add(next.saturating_sub(now)).min(period);
                self.next = Some(next.min(now).saturating_add(period));
                next.min(now)
            }
            _ => published.unwrap_or(now),
        }
    }

    fn begins(&mut self, now: u64) {
        if let Some(gap) = self.begins.back().map(|last| now.saturating_sub(*last)) {
            self.least_gap = Some(self.least_gap.map_or(gap, |it| it.min(gap)));
        }
        let is_old = |it: &u64| now.saturating_sub(*it) >= 1_000_000_000;
        while self.begins.len() >= MOST_OF_CALLBACK
            || self.begins.len() > 1 && self.begins.front().is_some_and(is_old)
        {
            self.begins.pop_front();
        }
        self.begins.push_back(now);
        let in_second = self.begins.iter().rev().take_while(|it| !is_old(it)).count();
        self.in_second = self.in_second.max(in_second);
    }
}

/// Returns an identifier for a callback.
fn callback_name(node: &str, release: &Ros2Release) -> String {
    let what = match release {
        Ros2Release::Timer(period) => format!("timer_{}", short_time(*period)),
        Ros2Release::Subscription(topic) => format!("on_{}", ros2_identifier(topic)),
        Ros2Release::Service(name) => {
            // Most services are named after their node.
            format!("serve_{}", ros2_identifier(name.strip_prefix(node).unwrap_or(name)))
        }
        Ros2Release::Unknown => "callback".to_owned(),
    };
    match ros2_identifier(node).as_str() {
        "" => what,
        node => format!("{node}_{what}"),
    }
}

/// Returns a name of ROS 2 as an identifier: `/arm/joint_states` is `arm_joint_states`.
pub fn ros2_identifier(name: &str) -> String {
    let name: String =
        name.trim_matches('/').chars().map(|it| if it.is_ascii_alphanumeric() { it } else { '_' }).collect();
    match name.starts_with(|first: char| first.is_ascii_digit()) {
        true => format!("_{name}"),
        false => name,
    }
}

fn short_time(nanoseconds: u64) -> String {
    for (unit, name) in [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")] {
        if nanoseconds > 0 && nanoseconds.is_multiple_of(unit) {
            return format!("{}{name}", nanoseconds / unit);
        }
    }
    format!("{nanoseconds}ns")
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use proptest::prelude::*;

    use super::super::event::{BabeltraceLine, parse};
    use super::super::{Span, SpanKind, SpanNames, Totals, TraceReader, Visitor};
    use super::*;

    /// The executions of codels, with their instance, begin and time.
    #[derive(Default)]
    struct Executions(Vec<(String, u64, u64)>);

    impl Visitor for Executions {
        fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
            let name = names.get(span.name);
            if name.kind == SpanKind::Codel {
                assert_eq!(name.key, format!("ros.{}", name.instance));
                self.0.push((name.instance.clone(), span.begin.unwrap() % 1_000_000_000, span.execution));
            }
            ControlFlow::Continue(())
        }
    }

    /// Writes an event of process 7 and thread 7, as `babeltrace2` does.
    fn event(time: u64, name: &str, fields: &str) -> String {
        let provider =
            if name.contains("group") || name.contains("executor") { "ros2_caret" } else { "ros2" };
        format!(
            "[7.{time:09}] vm {provider}:{name}: {{ cpu_id = 1 }}, {{ vpid = 7, procname = \"n\", vtid = 7 }}, {{ {fields} }}\n"
        )
    }

    fn switch(time: u64, previous: u64, next: u64, priority: i32) -> String {
        format!(
            "[7.{time:09}] vm sched_switch: {{ cpu_id = 1 }}, {{ prev_comm = \"n\", prev_tid = {previous}, prev_prio = 20, \
             prev_state = 0, next_comm = \"m\", next_tid = {next}, next_prio = {priority} }}\n"
        )
    }

    fn read(text: &str) -> (Vec<(String, u64, u64)>, TraceReader, Totals) {
        let (mut reader, mut found) = (TraceReader::default(), Executions::default());
        reader.read_lines(text.as_bytes(), &mut found).unwrap();
        let totals = reader.finish();
        (found.0, reader, totals)
    }

    /// A node with a timer that publishes, and one that this reaches.
    fn made() -> String {
        [
            event(1, "rcl_node_init", "node_handle = 0xA1, rmw_handle = 0x0, node_name = \"eye\", namespace = \"/arm\""),
            event(2, "rcl_node_init", "node_handle = 0xA2, rmw_handle = 0x0, node_name = \"hand\", namespace = \"/\""),
            event(3, "rcl_publisher_init", "publisher_handle = 0xB1, node_handle = 0xA1, rmw_publisher_handle = 0x0, topic_name = \"/seen\", queue_depth = 1"),
            event(4, "rcl_timer_init", "timer_handle = 0xC1, period = 5000000"),
            event(5, "rclcpp_timer_callback_added", "timer_handle = 0xC1, callback = 0xD1"),
            event(6, "rclcpp_callback_register", "callback = 0xD1, symbol = \"Eye::look()\""),
            event(7, "rclcpp_timer_link_node", "timer_handle = 0xC1, node_handle = 0xA1"),
            event(8, "rcl_subscription_init", "subscription_handle = 0xC2, node_handle = 0xA2, rmw_subscription_handle = 0x0, topic_name = \"/seen\", queue_depth = 1"),
            event(9, "rclcpp_subscription_init", "subscription_handle = 0xC2, subscription = 0xE2"),
            event(10, "rclcpp_subscription_callback_added", "subscription = 0xE2, callback = 0xD2"),
            event(11, "rcl_service_init", "service_handle = 0xC3, node_handle = 0xA2, rmw_service_handle = 0x0, service_name = \"/hand/open\""),
            event(12, "rclcpp_service_callback_added", "service_handle = 0xC3, callback = 0xD3"),
            event(13, "construct_executor", "executor_addr = 0xF1, executor_type_name = \"single_threaded_executor\""),
            event(14, "callback_group_add_timer", "callback_group_addr = 0xF2, timer_handle = 0xC1"),
            event(15, "add_callback_group", "executor_addr = 0xF1, callback_group_addr = 0xF2, group_type_name = \"mutually_exclusive\""),
        ]
        .concat()
    }

    fn start(time: u64, callback: u64) -> String {
        event(time, "callback_start", &format!("callback = 0xD{callback}, is_intra_process = 0"))
    }

    fn end(time: u64, callback: u64) -> String {
        event(time, "callback_end", &format!("callback = 0xD{callback}"))
    }

    #[test]
    fn callbacks_have_their_nodes_and_what_they_publish() {
        let publish =
            |time| event(time, "rcl_publish", "publisher_handle = 0xB1, message = 0x1, timestamp = 5");
        let text = made()
            + &[
                start(100, 2),
                end(130, 2),
                start(200, 1),
                publish(240),
                publish(245),
                end(250, 1),
                publish(300),
            ]
            .concat()
            + &[start(5200, 1), publish(5230), end(5270, 1), start(6000, 9), end(6100, 9)].concat();
        let (found, reader, totals) = read(&text);
        let of = |name: &str, begin, time| (name.to_owned(), begin, time);
        assert_eq!(
            found,
            [
                of("hand_on_seen", 100, 30),
                of("arm_eye_timer_5ms", 200, 50),
                of("arm_eye_timer_5ms", 5200, 70)
            ]
        );
        let graph = reader.ros2();
        assert_eq!(graph.nodes, ["/arm/eye", "/hand"]);
        let [eye, hand, open] = &graph.callbacks[..] else { panic!() };
        assert_eq!((eye.node, eye.group, eye.symbol.as_str()), (Some(0), Some(0), "Eye::look()"));
        let messages = BTreeMap::from([(0, Ros2Messages { all: 3, most: 2 })]);
        assert_eq!((&eye.publishes, eye.executions, eye.elapsed), (&messages, 2, 2));
        assert_eq!((eye.least_gap, eye.priority, eye.threads.len()), (Some(5000), None, 1));
        assert_eq!(
            (hand.node, hand.group, &hand.release),
            (Some(1), None, &Ros2Release::Subscription("/seen".to_owned()))
        );
        // It never executed.
        assert_eq!((open.name.as_str(), open.executions), ("", 0));
        assert_eq!((graph.publishers[0].outside, eye.in_second, graph.last_cpu), (1, 2, Some(1)));
        assert_eq!((graph.least_gap("/seen"), graph.least_gap("/other")), (Some(5), None));
        assert_eq!((graph.unknown, graph.executors.len(), graph.executor_of(0)), (1, 1, Some(0)));
        assert_eq!(graph.groups[0].kind, "mutually_exclusive");
        assert_eq!((totals.events, totals.spans, totals.unbalanced), (6, 6, 0));
    }

    /// Other threads execute meanwhile: the CPU time is less.
    #[test]
    fn the_scheduler_says_the_cpu_time() {
        let text = [
            &made(),
            &switch(90, 1, 7, -41),
            &start(100, 1),
            &switch(120, 7, 3, 20),
            &switch(150, 3, 7, -41),
            &end(160, 1),
        ];
        let text = text.map(String::as_str).concat();
        let (found, reader, _) = read(&text);
        assert_eq!(found, [("arm_eye_timer_5ms".to_owned(), 100, 30)]);
        assert_eq!((reader.ros2().callbacks[0].elapsed, reader.ros2().callbacks[0].priority), (0, Some(40)));
        // In a container, a thread outside has the number 7: it is on another CPU, or has none.
        for other in [
            text.replace("sched_switch: { cpu_id = 1 }", "sched_switch: { cpu_id = 0 }"),
            text.replace("[7.000000090]", "[7.000000190]"),
        ] {
            let (found, reader, _) = read(&other);
            assert_eq!(found, [("arm_eye_timer_5ms".to_owned(), 100, 60)]);
            assert_eq!(reader.ros2().callbacks[0].elapsed, 1);
        }
    }

    /// The times of the begins, and of the messages before them.
    #[derive(Default)]
    struct Releases(Vec<(u64, Option<u64>)>);

    impl Visitor for Releases {
        fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
            if names.get(span.name).kind == SpanKind::Period {
                self.0.push((span.begin.unwrap(), span.release));
            }
            ControlFlow::Continue(())
        }
    }

    #[test]
    fn a_message_releases_when_it_was_published() {
        let at = |time: u64| 7_000_000_000 + time;
        let take = |time, published: u64, taken| {
            let fields = format!(
                "rmw_subscription_handle = 0x1, message = 0x2, source_timestamp = {published}, taken = {taken}"
            );
            event(time, "rmw_take", &fields)
        };
        let text = made()
            + &[take(90, at(50), 1), start(100, 2), end(130, 2)].concat()
            // A second of two begins, a message of another clock, and a take of nothing.
            + &[start(200, 2), end(210, 2), take(220, at(999), 1), start(230, 2), end(240, 2)].concat()
            + &[take(250, at(240), 0), start(260, 2), end(270, 2), take(280, at(275), 1), start(290, 1), end(300, 1)].concat();
        let (mut reader, mut found) = (TraceReader::default(), Releases::default());
        reader.read_lines(text.as_bytes(), &mut found).unwrap();
        let none = [200, 230, 260, 290].map(|begin| (at(begin), None));
        assert_eq!(found.0, [[(at(100), Some(at(50)))].as_slice(), &none].concat());
    }

    #[test]
    fn a_begin_is_late_unless_it_waited_for_a_callback_or_a_thread() {
        let late = |events: &[String]| {
            let (_, reader, _) = read(&(made() + &events.concat()));
            reader.ros2().callbacks[..2].iter().map(|it| it.late).collect::<Vec<_>>()
        };
        let ms = |time: u64| time * 1_000_000;
        let timer =
            |at: &[u64]| at.iter().map(|at| start(ms(*at), 1) + &end(ms(*at) + 1000, 1)).collect::<Vec<_>>();
        // Period 5: the second begin is 2 late, and so was the first one if the third one is not.
        assert_eq!(late(&timer(&[100, 107, 110])), [ms(2), 0]);
        assert_eq!(late(&timer(&[100, 103, 108])), [ms(2), 0]);
        // It left one out, and was 1 late then; or it was stopped.
        assert_eq!(late(&timer(&[100, 111, 115])), [ms(1), 0]);
        assert_eq!(late(&timer(&[100, 111, 116])), [0, 0]);
        let take = |at, published: u64| {
            event(
                at,
                "rmw_take",
                &format!("message = 0x2, source_timestamp = {}, taken = 1", 7_000_000_000 + published),
            )
        };
        let message = [take(ms(20), ms(17)), start(ms(20), 2), end(ms(24), 2)].concat();
        assert_eq!(late(std::slice::from_ref(&message)), [0, ms(3)]);
        // It was kept for those that come late.
        assert_eq!(late(&[take(ms(20), 3), start(ms(20), 2), end(ms(21), 2)]), [0, 0]);
        // One thread executes both: the timer waited for the message until 24.
        let both = [&timer(&[18])[..], std::slice::from_ref(&message), &timer(&[25])].concat();
        assert_eq!(late(&both), [ms(1), ms(3) - 1000]);
        // Both waited for the thread, and the message first: it was idle for 1 before that, and for 1 after it.
        let idle =
            [&timer(&[18])[..], &[take(ms(24), ms(22)), start(ms(24), 2), end(ms(26), 2)], &timer(&[27])]
                .concat();
        assert_eq!(late(&idle), [ms(2), ms(2)]);
        // With several threads, only callbacks of one group wait for each other.
        let other = |text: &str| text.replace("vtid = 7", "vtid = 8");
        let several = [&timer(&[18])[..], &[other(&message)], &timer(&[25])].concat();
        let apart = |it: &String| it.replace("single_threaded", "multi_threaded");
        let (_, reader, _) = read(&apart(&(made() + &several.concat())));
        assert_eq!(reader.ros2().callbacks[0].late, ms(2));
        // Those of a reentrant group do not.
        let overlap = [other(&start(ms(18), 1)), other(&end(ms(24), 1)), start(ms(25), 1), end(ms(26), 1)];
        for (kind, expected) in [("mutually_exclusive", ms(1)), ("reentrant", ms(2))] {
            let text = apart(&(made() + &overlap.concat())).replace("mutually_exclusive", kind);
            assert_eq!(read(&text).1.ros2().callbacks[0].late, expected, "{kind}");
        }
        // Another thread had the CPU of the timer, with a higher, a lower or no priority, or it was idle.
        let rest = ms(1) - 5;
        for (other, priorities, expected) in
            [(3, [-60, -41], rest), (3, [20, -41], ms(2)), (3, [20, 20], rest), (0, [20, 20], ms(2))]
        {
            let [of_other, own] = priorities;
            let last = [switch(ms(22), 7, other, of_other), switch(ms(24) + 5, other, 7, own)];
            let last = last.into_iter().chain([start(ms(25), 1), end(ms(26), 1)]);
            let first = [switch(ms(17), 1, 7, own)].into_iter().chain(timer(&[18]));
            assert_eq!(late(&first.chain(last).collect::<Vec<_>>()), [expected, 0]);
        }
        // It has another period.
        assert_eq!(late(&timer(&[100, 101, 102, 103])), [ms(5), 0]);
    }

    /// It goes to nodes of the process, and to others.
    #[test]
    fn a_message_with_two_events_is_one() {
        let publish =
            |time, event_name: &str| event(time, event_name, "publisher_handle = 0xB1, message = 0x1");
        let text = made()
            + &start(100, 1)
            + &publish(110, "rclcpp_intra_publish")
            + &publish(111, "rcl_publish")
            + &publish(150, "rclcpp_intra_publish")
            + &publish(170, "rclcpp_intra_publish")
            + &end(180, 1);
        let (_, reader, _) = read(&text);
        let messages = BTreeMap::from([(0, Ros2Messages { all: 3, most: 3 })]);
        assert_eq!(
            (&reader.ros2().callbacks[0].publishes, reader.ros2().least_gap("/seen")),
            (&messages, Some(20))
        );
    }

    #[test]
    fn names_depend_on_what_was_made_first() {
        for (node, release, name) in [
            ("/arm/eye", Ros2Release::Timer(33_333_333), "arm_eye_timer_33333333ns"),
            ("/eye", Ros2Release::Timer(2_500_000), "eye_timer_2500us"),
            ("/eye", Ros2Release::Timer(0), "eye_timer_0ns"),
            ("/eye", Ros2Release::Subscription("/a/b-c".to_owned()), "eye_on_a_b_c"),
            ("/eye", Ros2Release::Service("/eye/get".to_owned()), "eye_serve_get"),
            ("", Ros2Release::Unknown, "callback"),
            ("/3d", Ros2Release::Unknown, "_3d_callback"),
        ] {
            assert_eq!(callback_name(node, &release), name);
        }
        // The second timer of this period executes first.
        let second = event(16, "rcl_timer_init", "timer_handle = 0xC5, period = 5000000")
            + &event(17, "rclcpp_timer_callback_added", "timer_handle = 0xC5, callback = 0xD5")
            + &event(18, "rclcpp_timer_link_node", "timer_handle = 0xC5, node_handle = 0xA1");
        let (found, ..) =
            read(&(made() + &second + &[start(20, 5), end(21, 5), start(30, 1), end(32, 1)].concat()));
        let names: Vec<&str> = found.iter().map(|it| it.0.as_str()).collect();
        assert_eq!(names, ["arm_eye_timer_5ms_2", "arm_eye_timer_5ms"]);
    }

    #[test]
    fn many_callbacks_of_one_name_are_named_at_once() {
        let of = |it: u64| Ros2Callback {
            release: Ros2Release::Timer(1_000_000 * (1 + it / 20_000)),
            ..Ros2Callback::default()
        };
        let mut graph = Ros2Graph { callbacks: (0..30_000).map(of).collect(), ..Ros2Graph::default() };
        graph.name(29_999);
        let names = [0, 1, 19_999, 20_000, 29_999].map(|it| graph.callbacks[it].name.as_str());
        assert_eq!(names, ["timer_1ms", "timer_1ms_2", "timer_1ms_20000", "timer_2ms", "timer_2ms_10000"]);
    }

    /// Each counts by itself, and those beyond the limit have elapsed times: one thread number of two hosts is not one thread.
    #[test]
    fn many_hosts_are_not_mixed() {
        let of_host = |text: &str, host: usize| text.replace("] vm ", &format!("] h{host} "));
        let hosts: String = (0..MOST_HOSTS).map(|it| of_host(&switch(20, 1, 2, 20), it)).collect();
        let last =
            [&made(), &switch(90, 1, 7, 20), &start(100, 1), &end(160, 1)].map(String::as_str).concat();
        let other = of_host(&switch(120, 7, 3, 20), 1000) + &of_host(&switch(140, 3, 7, 20), 1000);
        let text = hosts + &last.replace(&start(100, 1), &(start(100, 1) + &other));
        let (found, reader, _) = read(&text);
        assert_eq!((found[0].2, reader.ros2().callbacks[0].elapsed), (60, 1));
    }

    #[test]
    fn executors_of_later_versions_collect_their_groups() {
        let text = event(
            1,
            "callback_group_to_executor_entity_collector",
            "entities_collector_addr = 0x1, callback_group_addr = 0x2, group_type_name = \"reentrant\"",
        ) + &event(
            2,
            "construct_executor",
            "executor_addr = 0x3, executor_type_name = \"multi_threaded_executor\"",
        ) + &event(
            3,
            "executor_entity_collector_to_executor",
            "executor_addr = 0x3, entities_collector_addr = 0x1",
        );
        let (_, reader, _) = read(&text);
        assert_eq!(reader.ros2().executor_of(0), Some(0));
    }

    proptest! {
        /// Whatever fields are missing, or twice.
        #[test]
        fn any_order_of_events_is_read(picks in proptest::collection::vec((0..24_usize, 0..4_u64), 0..60)) {
            let all = made() + &[start(20, 1), start(21, 2), end(22, 1), end(23, 2), switch(24, 7, 7, -2), switch(25, 0, 1, 0)].concat();
            let lines: Vec<&str> = all.lines().collect();
            let text: String = picks.iter().map(|(line, thread)| {
                let line = lines[line % lines.len()].replace("vtid = 7", &format!("vtid = {}", 6 + thread));
                line + "\n"
            }).collect();
            for (name, _, time) in read(&text).0 {
                prop_assert!(!name.is_empty() && time < 1_000, "{name}: {time} in {text}");
            }
        }
    }

    #[test]
    fn memory_is_bounded() {
        let mut reader = TraceReader::default();
        let text: String = (0..MOST_ENTITIES as u64 + 2)
            .map(|it| event(it, "rcl_timer_init", &format!("timer_handle = {it}, period = 1")))
            .collect();
        let result = reader.read_lines(text.as_bytes(), &mut Executions::default());
        assert!(matches!(result, Err(TraceError::TooManyNames)));
        let line = "[7.000000001] vm ros2:callback_start: { cpu_id = 1 }, { }, { callback = 0xD1 }";
        assert_eq!(parse(line.as_bytes()), BabeltraceLine::WithoutThread);
    }
}
