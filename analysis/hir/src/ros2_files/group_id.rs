//! The id of a callback group: its node, and its callbacks.
//!
//! ```text
//! /ns/node@Subscription(/topic)@Timer(100000000)
//! ```
//!
//! The executors write it (`create_callback_group_id`): that of Agnocast (autowarefoundation/agnocast at 501e554b,
//! `agnocastlib/src/cie_client_utils.cpp`) sorts the callbacks as texts, that of callback_isolated_executor
//! (autowarefoundation/callback_isolated_executor at 2c7f10fa, `cie_thread_configurator/src/util.cpp`) does not. Ids are compared as
//! texts, so the order of the callbacks is kept here. Readers remove `@Waitable` at the end, which older executors wrote.

use std::fmt;
use std::str::FromStr;

/// The id of a callback group.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct GroupId {
    /// The namespace of the node: `/`, or `/ns`.
    pub namespace: String,
    /// The name of the node.
    pub node: String,
    /// Its callbacks, in the order of the id.
    pub callbacks: Vec<GroupCallback>,
    /// Whether the id is `/ns/node/*`: each callback group of the node that has no entry of its own.
    pub is_wildcard: bool,
}

/// A callback in the id of a callback group.
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub enum GroupCallback {
    /// The messages of a topic.
    Subscription(String),
    /// The requests of a service.
    Service(String),
    /// The responses of a service.
    Client(String),
    /// A timer with its period in nanoseconds.
    Timer(u64),
}

/// The text is not an id of a callback group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InvalidGroupId;

impl GroupId {
    /// Returns the id of the node, without callbacks.
    #[must_use]
    pub fn of_node(&self) -> GroupId {
        GroupId { callbacks: Vec::new(), is_wildcard: false, ..self.clone() }
    }

    /// Returns whether a group is one of the same node, with all these callbacks and perhaps more. So a few callbacks can name a group,
    /// without the services of its parameters.
    ///
    /// ```
    /// use mauve_hir::ros2_files::GroupId;
    /// let id = |text: &str| text.parse::<GroupId>().unwrap();
    /// assert!(id("/eye@Service(/eye/get_parameters)@Timer(1000)").includes(&id("/eye@Timer(1000)")));
    /// assert!(!id("/eye@Timer(1000)").includes(&id("/hand@Timer(1000)")));
    /// ```
    pub fn includes(&self, few: &GroupId) -> bool {
        let is_same_node = (&self.namespace, &self.node) == (&few.namespace, &few.node);
        let has = |it: &GroupCallback| self.callbacks.contains(it);
        is_same_node && !few.callbacks.is_empty() && few.callbacks.iter().all(has)
    }

    /// Returns the id with its callbacks in the order of Agnocast's executor.
    #[must_use]
    pub fn sorted(mut self) -> GroupId {
        self.callbacks.sort_by_cached_key(ToString::to_string);
        self
    }
}

/// Returns an id without `@Waitable` at its end.
pub(super) fn without_waitables(mut id: &str) -> &str {
    while let Some(rest) = id.strip_suffix("@Waitable") {
        id = rest;
    }
    id
}

impl FromStr for GroupId {
    type Err = InvalidGroupId;

    fn from_str(text: &str) -> Result<GroupId, InvalidGroupId> {
        let mut parts = without_waitables(text).split('@');
        let node = parts.next().ok_or(InvalidGroupId)?;
        let (node, is_wildcard) = node.strip_suffix("/*").map_or((node, false), |node| (node, true));
        let (namespace, name) = node.rsplit_once('/').ok_or(InvalidGroupId)?;
        let callbacks = parts.map(str::parse).collect::<Result<Vec<_>, _>>()?;
        let is_valid = is_token(name) && (namespace.is_empty() || is_name(namespace));
        if !is_valid || is_wildcard && !callbacks.is_empty() {
            return Err(InvalidGroupId);
        }
        let namespace = if namespace.is_empty() { "/" } else { namespace }.to_owned();
        Ok(GroupId { namespace, node: name.to_owned(), callbacks, is_wildcard })
    }
}

impl FromStr for GroupCallback {
    type Err = InvalidGroupId;

    fn from_str(text: &str) -> Result<GroupCallback, InvalidGroupId> {
        let (kind, of) = text.strip_suffix(')').and_then(|it| it.split_once('(')).ok_or(InvalidGroupId)?;
        let name = || Some(of.to_owned()).filter(|it| is_name(it)).ok_or(InvalidGroupId);
        match kind {
            "Subscription" => Ok(GroupCallback::Subscription(name()?)),
            "Service" => Ok(GroupCallback::Service(name()?)),
            "Client" => Ok(GroupCallback::Client(name()?)),
            "Timer" => {
                let period = of.parse().map_err(|_| InvalidGroupId)?;
                let callback = GroupCallback::Timer(period);
                Some(callback).filter(|it| it.to_string() == text).ok_or(InvalidGroupId)
            }
            _ => Err(InvalidGroupId),
        }
    }
}

/// Returns whether the text is a part of a name of ROS 2.
fn is_token(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|it| it.is_ascii_alphanumeric() || it == b'_')
}

/// Returns whether the text is an absolute name of ROS 2.
fn is_name(text: &str) -> bool {
    text.strip_prefix('/').is_some_and(|rest| rest.split('/').all(is_token))
}

impl fmt::Display for GroupId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let namespace = self.namespace.strip_suffix('/').unwrap_or(&self.namespace);
        write!(f, "{namespace}/{}{}", self.node, if self.is_wildcard { "/*" } else { "" })?;
        self.callbacks.iter().try_for_each(|callback| write!(f, "@{callback}"))
    }
}

impl fmt::Display for GroupCallback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            GroupCallback::Subscription(topic) => write!(f, "Subscription({topic})"),
            GroupCallback::Service(service) => write!(f, "Service({service})"),
            GroupCallback::Client(service) => write!(f, "Client({service})"),
            GroupCallback::Timer(period) => write!(f, "Timer({period})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_ids_of_executors_are_read() {
        let id: GroupId =
            "/a/b/node@Timer(100000000)@Subscription(/a/topic)@Waitable@Waitable".parse().unwrap();
        assert_eq!((id.namespace.as_str(), id.node.as_str(), id.is_wildcard), ("/a/b", "node", false));
        let subscription = GroupCallback::Subscription("/a/topic".to_owned());
        assert_eq!(id.callbacks, [GroupCallback::Timer(100_000_000), subscription]);
        assert_eq!(id.sorted().to_string(), "/a/b/node@Subscription(/a/topic)@Timer(100000000)");
        // The callbacks are sorted as texts.
        let id: GroupId = "/n@Timer(20)@Timer(100)@Client(/c)@Service(/s)".parse().unwrap();
        assert_eq!(id.namespace, "/");
        assert_eq!(id.sorted().to_string(), "/n@Client(/c)@Service(/s)@Timer(100)@Timer(20)");
        assert!("/ns/node/*".parse::<GroupId>().unwrap().is_wildcard);
        assert_eq!("/node".parse::<GroupId>().unwrap().callbacks, []);
    }

    #[test]
    fn other_texts_are_refused() {
        for text in [
            "",
            "/",
            "node",
            "//node",
            "/node@",
            "/node@@Timer(1)",
            "/node@Timer(01)",
            "/node@Timer(+1)",
            "/node@Timer(-1)",
            "/node@Timer(99999999999999999999)",
            "/node@Timer(1)x",
            "/node@Subscription(topic)",
            "/node@Subscription(/a b)",
            "/node@Subscription()",
            "/node@Waitable@Timer(1)",
            "/node@Guard(/x)",
            "/node/*@Timer(1)",
            "/*",
            "/no de",
            "@Waitable",
        ] {
            assert_eq!(text.parse::<GroupId>(), Err(InvalidGroupId), "{text:?}");
        }
    }

    fn name() -> impl Strategy<Value = String> {
        "(/[a-z_][a-z0-9_]{0,5}){1,3}"
    }

    fn ids() -> impl Strategy<Value = GroupId> {
        let callback = prop_oneof![
            name().prop_map(GroupCallback::Subscription),
            name().prop_map(GroupCallback::Service),
            name().prop_map(GroupCallback::Client),
            any::<u64>().prop_map(GroupCallback::Timer),
        ];
        let namespace = prop_oneof![Just("/".to_owned()), name()];
        let parts = (namespace, "[a-z_][a-z0-9_]{0,8}", prop::collection::vec(callback, 0..6), any::<bool>());
        parts.prop_map(|(namespace, node, callbacks, any)| {
            let is_wildcard = any && callbacks.is_empty();
            GroupId { namespace, node, callbacks, is_wildcard }
        })
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(id in ids(), waitables in 0_usize..3) {
            let text = id.to_string();
            prop_assert_eq!(text.parse::<GroupId>(), Ok(id.clone()));
            prop_assert_eq!(format!("{text}{}", "@Waitable".repeat(waitables)).parse::<GroupId>(), Ok(id.clone()));
            let mut texts: Vec<_> = text.split('@').skip(1).map(str::to_owned).collect();
            texts.sort();
            let sorted = id.sorted().to_string();
            prop_assert_eq!(sorted.split('@').skip(1).map(str::to_owned).collect::<Vec<_>>(), texts);
        }

        #[test]
        fn what_is_read_is_written(text in "(/[ab/*]{0,3}){1,2}(@(Timer|Client|Waitable|Subscription)[(]?[/a0-9]{0,3}[)]?){0,3}") {
            if let Ok(id) = text.parse::<GroupId>() {
                prop_assert_eq!(id.to_string(), without_waitables(&text));
            }
        }
    }
}
