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

use std::str::FromStr;

use crate::item_tree::Name;

/// The id of a callback group. Ids are compared as texts.
///
/// ```
/// use mauve_hir::ros2_files::GroupId;
/// let id: GroupId = "/ns/eye@Subscription(/image)@Timer(1000)@Waitable".parse().unwrap();
/// assert_eq!(id.text().as_str(), "/ns/eye@Subscription(/image)@Timer(1000)");
/// assert_eq!(id.node(), "/ns/eye");
/// assert!(id.callbacks().eq(["Subscription(/image)", "Timer(1000)"]));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, salsa::SalsaValue)]
pub struct GroupId {
    /// Without `@Waitable` at its end.
    text: Name,
    /// The length of its node.
    node: usize,
}

/// The text is not an id of a callback group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InvalidGroupId;

impl GroupId {
    /// Returns the id of a group of a node, with its callbacks in the order of Agnocast's executor; none if there is no such id.
    pub fn sorted<'a>(node: &str, callbacks: impl IntoIterator<Item = &'a str>) -> Option<GroupId> {
        let mut callbacks: Vec<&str> = callbacks.into_iter().collect();
        callbacks.sort_unstable();
        // A recording may have any text.
        let is_valid = is_name(node) && callbacks.iter().all(|it| is_callback(it));
        let text = [&[node], callbacks.as_slice()].concat().join("@");
        is_valid.then(|| GroupId { text: text.into(), node: node.len() })
    }

    /// Returns the id as an executor writes it.
    pub fn text(&self) -> &Name {
        &self.text
    }

    /// Returns its node with the namespace.
    pub fn node(&self) -> &str {
        &self.text[..self.node]
    }

    /// Returns its callbacks, in the order of the id.
    pub fn callbacks(&self) -> impl Iterator<Item = &str> {
        self.text[self.node..].split('@').skip(1)
    }

    /// Returns whether the id is `/ns/node/*`: each callback group of the node that has no entry of its own.
    pub fn is_wildcard(&self) -> bool {
        self.text.ends_with("/*")
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
        let has = |it| self.callbacks().any(|own| own == it);
        self.node() == few.node() && few.callbacks().next().is_some() && few.callbacks().all(has)
    }
}

/// Returns the period of a callback in the id of a group, in nanoseconds; none of what is no timer.
pub fn timer_period(callback: &str) -> Option<u64> {
    callback.strip_prefix("Timer(")?.strip_suffix(')')?.parse().ok()
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
        let text = without_waitables(text);
        let (group, callbacks) = text.split_once('@').map_or((text, None), |(node, rest)| (node, Some(rest)));
        let node = group.strip_suffix("/*").unwrap_or(group);
        let are_valid = callbacks.is_none_or(|all| node == group && all.split('@').all(is_callback));
        let is_valid = is_name(node) && are_valid;
        is_valid.then(|| GroupId { text: text.into(), node: node.len() }).ok_or(InvalidGroupId)
    }
}

/// Returns whether the text is a callback in an id: `Kind(/name)`, or `Timer(period)`, in nanoseconds.
fn is_callback(text: &str) -> bool {
    let Some((kind, of)) = text.strip_suffix(')').and_then(|it| it.split_once('(')) else { return false };
    match kind {
        "Subscription" | "Service" | "Client" => is_name(of),
        "Timer" => of.parse().is_ok_and(|period: u64| of == "0" || period > 0 && !of.starts_with(['0', '+'])),
        _ => false,
    }
}

/// Returns whether the text is an absolute name of ROS 2.
fn is_name(text: &str) -> bool {
    let is_token = |it: &str| !it.is_empty() && it.bytes().all(|it| it.is_ascii_alphanumeric() || it == b'_');
    text.strip_prefix('/').is_some_and(|rest| rest.split('/').all(is_token))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_ids_of_executors_are_read() {
        let id: GroupId =
            "/a/b/node@Timer(100000000)@Subscription(/a/topic)@Waitable@Waitable".parse().unwrap();
        assert_eq!((id.node(), id.is_wildcard()), ("/a/b/node", false));
        assert!(id.callbacks().eq(["Timer(100000000)", "Subscription(/a/topic)"]));
        // The callbacks are sorted as texts.
        let callbacks = ["Timer(20)", "Timer(100)", "Client(/c)", "Service(/s)"];
        let id = GroupId::sorted("/n", callbacks).unwrap();
        assert_eq!(id.text().as_str(), "/n@Client(/c)@Service(/s)@Timer(100)@Timer(20)");
        assert_eq!(GroupId::sorted("/n", ["Timer(1)@Timer(2)"]), None);
        assert_eq!(GroupId::sorted("n", callbacks).or(GroupId::sorted("/n@Timer(1)", callbacks)), None);
        assert!("/ns/node/*".parse::<GroupId>().unwrap().is_wildcard());
        assert_eq!("/node".parse::<GroupId>().unwrap().callbacks().count(), 0);
        assert_eq!("/node@Timer(0)".parse::<GroupId>().unwrap().callbacks().count(), 1);
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

    fn callbacks() -> impl Strategy<Value = Vec<String>> {
        let named = |kind: &'static str| name().prop_map(move |it| format!("{kind}({it})"));
        let timer = any::<u64>().prop_map(|it| format!("Timer({it})"));
        let callback = prop_oneof![named("Subscription"), named("Service"), named("Client"), timer];
        prop::collection::vec(callback, 0..6)
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(node in name(), mut callbacks in callbacks(), waitables in 0_usize..3) {
            let id = GroupId::sorted(&node, callbacks.iter().map(String::as_str)).unwrap();
            prop_assert_eq!(format!("{}{}", id.text().as_str(), "@Waitable".repeat(waitables)).parse(), Ok(id.clone()));
            callbacks.sort();
            prop_assert!(id.node() == node && id.callbacks().eq(callbacks));
        }

        #[test]
        fn what_is_read_is_written(text in "(/[ab/*]{0,3}){1,2}(@(Timer|Client|Waitable|Subscription)[(]?[/a0-9]{0,3}[)]?){0,3}") {
            if let Ok(id) = text.parse::<GroupId>() {
                prop_assert_eq!(id.text().as_str(), without_waitables(&text));
                prop_assert!(id.text().starts_with(id.node()));
            }
        }
    }
}
