//! What a recording has: its callbacks, and their times.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use mauve_hir::ros2_files::{ControllersFile, NamedPath};
use mauve_pwcet::trace::{Ros2Callback, Ros2Graph, Ros2Release, Span, SpanKind, SpanNames, Visitor};

use super::threads::Threads;
use crate::text::duration;

/// The most messages of one execution in a model: more are a loop, and count as those that no callback publishes.
pub(super) const MOST_WRITES: u64 = 16;

/// What was recorded.
pub(super) struct System<'a> {
    pub(super) graph: &'a Ros2Graph,
    /// By the name of the callback.
    pub(super) times: BTreeMap<String, CallbackTimes>,
    /// The paths that people look at.
    pub(super) paths: Vec<NamedPath>,
    /// The file of threads that is named, or that is written.
    pub(super) threads: Threads,
    /// The files of ros2_control, with their paths from the folder of the project.
    pub(super) controllers: Vec<(String, ControllersFile)>,
}

/// The execution times of a callback.
#[derive(Debug, Default)]
pub(super) struct CallbackTimes {
    pub(super) count: u64,
    sum: u128,
    pub(super) greatest: u64,
}

impl CallbackTimes {
    pub(super) fn mean(&self) -> u64 {
        u64::try_from(self.sum / u128::from(self.count.max(1))).unwrap_or(u64::MAX)
    }
}

/// Adds up the execution times of callbacks.
#[derive(Debug, Default)]
pub(super) struct Times(pub(super) BTreeMap<String, CallbackTimes>);

impl Visitor for Times {
    fn span(&mut self, span: &Span, names: &SpanNames) -> ControlFlow<()> {
        let name = names.get(span.name);
        if name.kind == SpanKind::Codel {
            // Most executions need no text of their own.
            if !self.0.contains_key(&name.instance) {
                self.0.insert(name.instance.clone(), CallbackTimes::default());
            }
            if let Some(of) = self.0.get_mut(&name.instance) {
                of.count += 1;
                of.sum += u128::from(span.execution);
                of.greatest = of.greatest.max(span.execution);
            }
        }
        ControlFlow::Continue(())
    }
}

impl System<'_> {
    /// Returns the callbacks that were executed completely, with their index and their times.
    pub(super) fn executed(&self) -> impl Iterator<Item = (usize, &Ros2Callback, &CallbackTimes)> {
        let all = self.graph.callbacks.iter().enumerate();
        all.filter_map(|(index, callback)| Some((index, callback, self.times.get(&callback.name)?)))
    }

    /// Whether known callbacks publish all messages that release a callback.
    pub(super) fn knows_writers(&self, callback: &Ros2Callback) -> bool {
        let Ros2Release::Subscription(topic) = &callback.release else { return false };
        let graph = self.graph;
        let is_of_topic =
            |publisher: &usize| graph.publishers.get(*publisher).is_some_and(|it| it.topic == *topic);
        let all = self.executed().flat_map(|(_, it, _)| &it.publishes);
        let all: Vec<_> = all.filter(|it| is_of_topic(it.0)).map(|(_, messages)| messages).collect();
        let messages: u64 = all.iter().map(|it| it.all).sum();
        messages >= callback.executions
            && all.iter().all(|it| it.most <= MOST_WRITES)
            && graph.publishers.iter().all(|it| it.topic != *topic || it.outside == 0)
    }

    /// Whether one thread alone executes a callback.
    pub(super) fn has_thread(&self, callback: &Ros2Callback) -> bool {
        let executor = callback.group.and_then(|it| self.graph.executors.get(self.graph.executor_of(it)?));
        callback.threads.len() == 1 && executor.is_none_or(|it| !it.contains("multi_threaded"))
    }

    /// Whether callbacks were executed.
    pub(super) fn has_recording(&self) -> bool {
        self.executed().next().is_some()
    }

    /// Returns whether only the elapsed time of some executions is known.
    pub(super) fn has_elapsed(&self) -> bool {
        self.executed().any(|(_, callback, _)| callback.elapsed > 0)
    }
}

/// Says what releases a callback.
pub(super) fn released_by(release: &Ros2Release) -> String {
    match release {
        Ros2Release::Timer(period) => format!("timer, {}", duration(*period)),
        Ros2Release::Subscription(topic) => topic.clone(),
        Ros2Release::Service(name) => format!("service {name}"),
        Ros2Release::Unknown => "unknown".to_owned(),
    }
}
