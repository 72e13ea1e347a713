//! Changes of single values in a file, as edits of its text that change no other byte.
//!
//! A change is confirmed: the edited text is parsed again, and must have the new values, and all other keys and values as before.
//! Otherwise it is refused. A value behind an anchor that has aliases belongs to several entries: its change is refused.

use std::ops::Range;

use mauve_timing::CpuSet;
use saphyr_parser::ScalarStyle;

use super::controllers::read_controllers;
use super::threads::{ThreadEntry, ThreadPlace, ThreadPolicy, read_threads};
use super::yaml::{Lookup, NodeId, NodeKind, Yaml, YamlNode, parse};

/// An edit of a text: a range in bytes, and the text instead. Several edits are in the order of the text, and do not overlap.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct YamlEdit {
    /// The range that is replaced; empty for an insertion.
    pub range: Range<usize>,
    /// The new text.
    pub text: String,
}

/// Why a change is refused.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum EditRefusal {
    /// The file has no such entry, or the entry is an alias.
    NoSuchEntry,
    /// The text is not YAML, or readers disagree on its keys.
    Incomplete,
    /// Aliases refer to the value at this place, or other nodes have this parameter too: other entries would change.
    Shared(Range<usize>),
    /// The value at this place is written in a form that is not edited: a block text, a comment within a list, a tag.
    Layout(Range<usize>),
    /// The new policy needs a new priority, or a new nice value.
    LevelNeeded,
    /// A value that the file cannot have.
    InvalidValue,
    /// The edited text would have other keys or values.
    NotConfirmed,
}

/// A change of a thread; `None`: as before.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct ThreadChange {
    /// The policy, in a `threads.yaml`; not a change to `SCHED_DEADLINE`.
    pub policy: Option<ThreadPolicy>,
    /// The priority, or the nice value, as the policy has it.
    pub level: Option<i8>,
    /// Linux's CPUs, from 0. Empty, in a `threads.yaml`: those of the process.
    pub affinity: Option<CpuSet>,
}

/// Applies edits to the text that they are for.
pub fn apply_edits(text: &str, edits: &[YamlEdit]) -> String {
    let (mut edited, mut at) = (String::with_capacity(text.len()), 0);
    for edit in edits {
        edited.push_str(text.get(at..edit.range.start).unwrap_or_default());
        edited.push_str(&edit.text);
        at = edit.range.end;
    }
    edited.push_str(text.get(at..).unwrap_or_default());
    edited
}

/// Returns the edits that change a thread.
///
/// # Errors
///
/// The change is refused.
pub fn change_thread(
    text: &str,
    place: ThreadPlace,
    change: &ThreadChange,
) -> Result<Vec<YamlEdit>, EditRefusal> {
    let yaml = parse(text);
    if !yaml.problems.is_empty() {
        return Err(EditRefusal::Incomplete);
    }
    let mut editor = Editor { text, yaml, changes: Vec::new() };
    match place {
        ThreadPlace::Group(index) => editor.thread(read_threads(text).groups.get(index), change)?,
        ThreadPlace::Other(index) => editor.thread(read_threads(text).others.get(index), change)?,
        ThreadPlace::Manager(manager) => editor.control(manager, None, change)?,
        ThreadPlace::Controller(manager, controller) => editor.control(manager, Some(controller), change)?,
    }
    editor.confirm()
}

/// A new value of a key.
enum NewValue {
    /// A text or a number, in the quotes of the old value.
    Word(String),
    /// A list of CPUs. `may_be_number`: one CPU stays a number, if the old value is one.
    Cpus { cpus: CpuSet, may_be_number: bool },
}

/// The keys behind which keys are inserted.
const RELATED: &str = "id/name/policy/priority/nice/affinity/update_rate/thread_priority/cpu_affinity";

struct Change {
    /// The value that is replaced, or behind which a key is inserted.
    node: NodeId,
    is_insertion: bool,
    edit: YamlEdit,
    /// The new key and value, as [`Editor::tokens`] has them.
    tokens: Vec<String>,
}

struct Editor<'t> {
    text: &'t str,
    yaml: Yaml,
    changes: Vec<Change>,
}

impl Editor<'_> {
    fn thread(&mut self, entry: Option<&ThreadEntry>, change: &ThreadChange) -> Result<(), EditRefusal> {
        let entry = entry.ok_or(EditRefusal::NoSuchEntry)?;
        let mapping = self.mapping_at(Some(&entry.range))?;
        let old = entry.policy.known().copied();
        let policy = change.policy.or(old);
        let class = |it: ThreadPolicy| (it.has_priority(), it.has_nice());
        let has_new_class = change.policy.is_some_and(|new| old.map(class) != Some(class(new)));
        if has_new_class && change.level.is_none() {
            return Err(EditRefusal::LevelNeeded);
        }
        if let Some(policy) = change.policy {
            self.set(mapping, "policy", &NewValue::Word(policy.name().to_owned()))?;
        }
        if let Some(level) = change.level {
            let value = NewValue::Word(level.to_string());
            let has = |key| self.yaml.find(mapping, key) != Lookup::Absent;
            if policy.is_some_and(ThreadPolicy::has_priority) && (1..=99).contains(&level) {
                self.set(mapping, "priority", &value)?;
            } else if policy.is_some_and(ThreadPolicy::has_nice) && (-20..=19).contains(&level) {
                let in_nice = has_new_class || has("nice");
                // Older readers have the nice value in `priority`.
                if !in_nice || has_new_class && has("priority") {
                    self.set(mapping, "priority", &value)?;
                }
                if in_nice {
                    self.set(mapping, "nice", &value)?;
                }
            } else {
                return Err(EditRefusal::InvalidValue);
            }
        }
        match change.affinity {
            Some(cpus) => self.set(mapping, "affinity", &NewValue::Cpus { cpus, may_be_number: false }),
            None => Ok(()),
        }
    }

    fn control(
        &mut self,
        manager: usize,
        controller: Option<usize>,
        change: &ThreadChange,
    ) -> Result<(), EditRefusal> {
        let file = read_controllers(self.text);
        let manager = file.managers.get(manager).ok_or(EditRefusal::NoSuchEntry)?;
        let controller = match controller {
            Some(index) => Some(manager.controllers.get(index).ok_or(EditRefusal::NoSuchEntry)?),
            None => None,
        };
        let (own, old, keys) = match controller {
            None => {
                let old = [manager.thread_priority.range(), manager.affinity.range()];
                (Some(&manager.range), old, ["thread_priority", "cpu_affinity"])
            }
            Some(it) => {
                let keys = ["async_parameters.thread_priority", "async_parameters.cpu_affinity"];
                (it.parameters.as_ref(), [it.thread_priority.range(), it.affinity.range()], keys)
            }
        };
        let mapping = self.mapping_at(own)?;
        let is_valid = change.level.is_none_or(|level| (1..=99).contains(&level))
            && change.affinity.is_none_or(|cpus| !cpus.is_empty());
        if !is_valid || change.policy.is_some() {
            return Err(EditRefusal::InvalidValue);
        }
        let level = change.level.map(|level| NewValue::Word(level.to_string()));
        let cpus = change.affinity.map(|cpus| NewValue::Cpus { cpus, may_be_number: controller.is_none() });
        for ((key, old), new) in keys.into_iter().zip(old).zip([level, cpus]) {
            let Some(new) = new else { continue };
            if let Some(old) = old.filter(|old| own.is_none_or(|own| !contains(own, old))) {
                return Err(EditRefusal::Shared(old.clone()));
            }
            self.set(mapping, key, &new)?;
        }
        Ok(())
    }

    fn mapping_at(&self, range: Option<&Range<usize>>) -> Result<NodeId, EditRefusal> {
        let mut nodes = self.yaml.nodes.iter();
        let index = nodes.position(|it| Some(&it.range) == range && matches!(it.kind, NodeKind::Mapping(_)));
        index.map(NodeId).ok_or(EditRefusal::NoSuchEntry)
    }

    /// Sets the value of a key of a mapping.
    fn set(&mut self, mapping: NodeId, key: &str, value: &NewValue) -> Result<(), EditRefusal> {
        let parent = key.split_once('.').map(|(parent, rest)| (self.yaml.find(mapping, parent), rest));
        match (self.yaml.find(mapping, key), parent) {
            (Lookup::Found(node), _) => self.replace(node, value),
            (Lookup::Unknown(range), _) => Err(EditRefusal::Layout(range)),
            (Lookup::Absent, Some((Lookup::Found(parent), rest))) => self.insert(parent, rest, value),
            (Lookup::Absent, _) => self.insert(mapping, key, value),
        }
    }

    fn replace(&mut self, id: NodeId, value: &NewValue) -> Result<(), EditRefusal> {
        use ScalarStyle::{DoubleQuoted, Folded, Literal, SingleQuoted};
        let node = self.yaml.node(id);
        let range = node.range.clone();
        self.check_shared(&range, true)?;
        let source = self.text.get(range.clone()).unwrap_or_default();
        let (mut text, mut tokens) = value.text();
        match (&node.kind, value) {
            _ if node.is_tagged => return Err(EditRefusal::Layout(range)),
            (NodeKind::Scalar(_, Literal | Folded), _) => return Err(EditRefusal::Layout(range)),
            (NodeKind::Scalar(_, SingleQuoted), NewValue::Word(word)) => text = format!("'{word}'"),
            (NodeKind::Scalar(_, DoubleQuoted), NewValue::Word(word)) => text = format!("\"{word}\""),
            (NodeKind::Scalar(..), NewValue::Cpus { cpus, may_be_number: true }) if cpus.is_one() => {
                text = text.trim_matches(['[', ']']).to_owned();
                tokens = vec![format!("={text}")];
            }
            (NodeKind::Scalar(..) | NodeKind::Alias(_), _) if range.is_empty() => text.insert(0, ' '),
            (NodeKind::Scalar(..) | NodeKind::Alias(_), _) => {}
            (NodeKind::Sequence(_), NewValue::Cpus { cpus, .. }) if !source.contains('#') => {
                if !node.is_flow && cpus.is_empty() {
                    // A list in brackets must be indented more than its key.
                    text.insert(0, ' ');
                } else if !node.is_flow {
                    let items: Vec<_> = cpus.iter().map(|cpu| format!("- {cpu}")).collect();
                    text = items.join(&self.line(range.start, range.start));
                }
            }
            _ => return Err(EditRefusal::Layout(range)),
        }
        self.changes.push(Change { node: id, is_insertion: false, edit: YamlEdit { range, text }, tokens });
        Ok(())
    }

    /// Inserts a key into a mapping: in its own line behind a key of the same group, or in braces behind the last one.
    fn insert(&mut self, mapping: NodeId, key: &str, value: &NewValue) -> Result<(), EditRefusal> {
        let range = self.yaml.range(mapping);
        self.check_shared(&range, false)?;
        let is_flow = self.yaml.node(mapping).is_flow;
        let entries = self.yaml.mapping(mapping).unwrap_or_default();
        let is_related = |it: &&[NodeId; 2]| {
            self.yaml.key(it[0]).is_some_and(|it| RELATED.split('/').any(|key| key == it))
        };
        let near = entries.iter().rfind(is_related).filter(|_| !is_flow).or(entries.last());
        let Some(&[near_key, near]) = near else { return Err(EditRefusal::Layout(range)) };
        let quote = match self.yaml.node(near_key).kind {
            NodeKind::Scalar(_, ScalarStyle::DoubleQuoted) => "\"",
            NodeKind::Scalar(_, ScalarStyle::SingleQuoted) => "'",
            _ => "",
        };
        let (text, mut tokens) = value.text();
        tokens.insert(0, format!("={key}"));
        let text = format!("{quote}{key}{quote}: {text}");
        let end = self.yaml.range(near_key).end.max(self.yaml.range(near).end);
        let edit = if is_flow {
            YamlEdit { range: end..end, text: format!(", {text}") }
        } else {
            let line = self.text.get(end..).unwrap_or_default().lines().next().unwrap_or_default();
            let behind = line.trim_start_matches([' ', '\t']);
            if !behind.is_empty() && !behind.starts_with('#') {
                return Err(EditRefusal::Layout(self.yaml.range(near)));
            }
            let end = end + line.len();
            YamlEdit { range: end..end, text: self.line(end, range.start) + &text }
        };
        self.changes.push(Change { node: near, is_insertion: true, edit, tokens });
        Ok(())
    }

    /// Returns the line break at this place, or that of the file, with the spaces up to the column of another place.
    fn line(&self, at: usize, column: usize) -> String {
        let end = self.text.get(at..).and_then(|it| it.find('\n')).map(|it| at + it);
        let end = end.or_else(|| self.text.find('\n')).unwrap_or_default();
        let is_crlf = self.text.get(..end).is_some_and(|it| it.ends_with('\r'));
        let before = self.text.get(..column).and_then(|it| it.rsplit('\n').next()).unwrap_or_default();
        format!("{}{}", if is_crlf { "\r\n" } else { "\n" }, " ".repeat(before.chars().count()))
    }

    /// Refuses a place in a value that aliases refer to; and a value with such a value inside, if it is replaced.
    fn check_shared(&self, place: &Range<usize>, is_replaced: bool) -> Result<(), EditRefusal> {
        let target = |it: &YamlNode| match it.kind {
            NodeKind::Alias(target) => Some(self.yaml.range(target)),
            _ => None,
        };
        let is_shared = |it: &Range<usize>| contains(it, place) || is_replaced && contains(place, it);
        let shared = self.yaml.nodes.iter().filter_map(target).find(is_shared);
        shared.map_or(Ok(()), |range| Err(EditRefusal::Shared(range)))
    }

    /// Returns the edits, if the edited text has the new values, and all others as before.
    fn confirm(mut self) -> Result<Vec<YamlEdit>, EditRefusal> {
        // A key is inserted behind a new value at the same place.
        self.changes.sort_by_key(|it| (it.edit.range.start, it.is_insertion));
        let edits: Vec<_> = self.changes.iter().map(|it| it.edit.clone()).collect();
        let mut wanted = Vec::new();
        self.tokens(NodeId(0), &mut wanted);
        let text = apply_edits(self.text, &edits);
        let edited = Editor { yaml: parse(&text), text: &text, changes: Vec::new() };
        let mut found = Vec::new();
        edited.tokens(NodeId(0), &mut found);
        let is_confirmed = edited.yaml.problems.is_empty() && found == wanted;
        is_confirmed.then_some(edits).ok_or(EditRefusal::NotConfirmed)
    }

    /// Collects the keys and values of a value, with the changes.
    fn tokens(&self, id: NodeId, into: &mut Vec<String>) {
        let replacement = self.changes.iter().find(|it| it.node == id && !it.is_insertion);
        match (replacement, &self.yaml.node(id).kind) {
            (Some(change), _) => into.extend_from_slice(&change.tokens),
            (None, NodeKind::Scalar(text, _)) => into.push(format!("={text}")),
            (None, NodeKind::Alias(_)) => {
                into.extend(self.text.get(self.yaml.range(id)).map(str::to_owned));
            }
            (None, NodeKind::Sequence(items)) => {
                into.push("[".to_owned());
                items.iter().for_each(|it| self.tokens(*it, into));
                into.push("]".to_owned());
            }
            (None, NodeKind::Mapping(entries)) => {
                into.push("{".to_owned());
                entries.as_flattened().iter().for_each(|it| self.tokens(*it, into));
                into.push("}".to_owned());
            }
        }
        for change in self.changes.iter().filter(|it| it.node == id && it.is_insertion) {
            into.extend_from_slice(&change.tokens);
        }
    }
}

impl NewValue {
    /// Returns the text, and the tokens.
    fn text(&self) -> (String, Vec<String>) {
        match self {
            NewValue::Word(word) => (word.clone(), vec![format!("={word}")]),
            NewValue::Cpus { cpus, .. } => {
                let cpus: Vec<_> = cpus.iter().map(|cpu| cpu.to_string()).collect();
                let tokens = cpus.iter().map(|cpu| format!("={cpu}"));
                let tokens = ["[".to_owned()].into_iter().chain(tokens).chain(["]".to_owned()]);
                (format!("[{}]", cpus.join(", ")), tokens.collect())
            }
        }
    }
}

fn contains(outer: &Range<usize>, inner: &Range<usize>) -> bool {
    outer.start <= inner.start && inner.end <= outer.end
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Changes the first group of a file.
    fn changed(text: &str, change: &ThreadChange) -> Result<String, EditRefusal> {
        change_thread(text, ThreadPlace::Group(0), change).map(|edits| apply_edits(text, &edits))
    }

    fn fifo(level: i8) -> ThreadChange {
        ThreadChange { policy: Some(ThreadPolicy::Fifo), level: Some(level), affinity: None }
    }

    fn affinity(cpus: &[u32]) -> ThreadChange {
        ThreadChange { affinity: Some(cpus.iter().copied().collect()), ..ThreadChange::default() }
    }

    #[test]
    fn values_are_replaced_and_missing_keys_inserted_in_the_style_of_the_entry() {
        for (before, change, after) in [
            (
                "callback_groups:\n  - id: /n # the node\n    policy: SCHED_OTHER # not yet\n    nice: 0\n\n# end\n",
                fifo(90),
                "callback_groups:\n  - id: /n # the node\n    policy: SCHED_FIFO # not yet\n    nice: 0\n    priority: 90\n\n# end\n",
            ),
            (
                "callback_groups: [{id: /n, policy: \"SCHED_OTHER\", 'priority': '0', }]",
                fifo(9),
                "callback_groups: [{id: /n, policy: \"SCHED_FIFO\", 'priority': '9', }]",
            ),
            (
                "{\"callback_groups\": [{\"id\": \"/n\", \"policy\": \"SCHED_OTHER\", \"nice\": 0}]}",
                fifo(9),
                "{\"callback_groups\": [{\"id\": \"/n\", \"policy\": \"SCHED_FIFO\", \"nice\": 0, \"priority\": 9}]}",
            ),
            (
                "callback_groups:\r\n- policy: SCHED_RR\r\n  priority: 3 # \u{e9}\r\n  id: /n\r\n  x: |\r\n    y\r\n",
                affinity(&[1, 2]),
                "callback_groups:\r\n- policy: SCHED_RR\r\n  priority: 3 # \u{e9}\r\n  id: /n\r\n  affinity: [1, 2]\r\n  x: |\r\n    y\r\n",
            ),
            (
                "callback_groups:\n- id: /n\n  policy: SCHED_RR\n  priority: 3\n  affinity:",
                affinity(&[1]),
                "callback_groups:\n- id: /n\n  policy: SCHED_RR\n  priority: 3\n  affinity: [1]",
            ),
            (
                "callback_groups:\n- affinity: # none\n  policy: SCHED_RR\n  priority: 3\n  id: /n",
                affinity(&[0]),
                "callback_groups:\n- affinity: [0] # none\n  policy: SCHED_RR\n  priority: 3\n  id: /n",
            ),
            (
                "callback_groups:\n- id: /n\n  policy: SCHED_RR\n  affinity: # two\n  - 1\n  - 2 # last\n  priority: 3\n",
                affinity(&[3, 4, 5]),
                "callback_groups:\n- id: /n\n  policy: SCHED_RR\n  affinity: # two\n  - 3\n  - 4\n  - 5 # last\n  priority: 3\n",
            ),
            (
                "callback_groups:\n- id: /n\n  policy: SCHED_RR\n  affinity:\n  - 1\n  priority: 3\n",
                affinity(&[]),
                "callback_groups:\n- id: /n\n  policy: SCHED_RR\n  affinity:\n   []\n  priority: 3\n",
            ),
            (
                "x: &p 3\ncallback_groups:\n- {id: /n, policy: SCHED_RR, priority: *p }\n",
                ThreadChange { level: Some(4), ..ThreadChange::default() },
                "x: &p 3\ncallback_groups:\n- {id: /n, policy: SCHED_RR, priority: 4 }\n",
            ),
            (
                "callback_groups:\n- id: /n\n  policy: SCHED_FIFO\n  priority: &p 3\n",
                ThreadChange { policy: Some(ThreadPolicy::Other), level: Some(-3), affinity: None },
                "callback_groups:\n- id: /n\n  policy: SCHED_OTHER\n  priority: &p -3\n  nice: -3\n",
            ),
            (
                "callback_groups:\n- id: /n\n  policy: SCHED_OTHER\n  priority: 0\n",
                ThreadChange { level: Some(5), ..ThreadChange::default() },
                "callback_groups:\n- id: /n\n  policy: SCHED_OTHER\n  priority: 5\n",
            ),
            (
                "callback_groups:\n- id: /n\n  policy: SCHED_OTHER\n  nice: 0\n  priority: 50\n",
                ThreadChange { level: Some(5), ..ThreadChange::default() },
                "callback_groups:\n- id: /n\n  policy: SCHED_OTHER\n  nice: 5\n  priority: 50\n",
            ),
        ] {
            assert_eq!(changed(before, &change).as_deref(), Ok(after), "{before}");
        }
    }

    #[test]
    fn what_cannot_be_changed_alone_is_refused() {
        let level = ThreadChange { level: Some(4), ..ThreadChange::default() };
        let rest = "id: /n, policy: SCHED_RR";
        for (text, change, is_expected) in [
            (format!("callback_groups: [{{{rest}, priority: &p 3}}]\nx: *p\n"), &level, "Shared"),
            (format!("callback_groups: [&e {{{rest}, priority: 3}}]\nx: *e\n"), &level, "Shared"),
            (format!("callback_groups: &s\n- {{{rest}, priority: 3}}\nnon_ros_threads: *s\n"), &level, "Shared"),
            (format!("callback_groups: &s\n- {{{rest}, priority: 3}}\nx: *s\n"), &affinity(&[1]), "Shared"),
            (format!("x: &e {{{rest}, priority: 3}}\ncallback_groups: [*e]\n"), &level, "NoSuchEntry"),
            (format!("callback_groups: [{{{rest}, priority: 3, affinity: [&c 1]}}]\nx: *c\n"), &affinity(&[1]), "Shared"),
            (format!("callback_groups: [{{{rest}, priority: 3, priority: 4}}]\n"), &level, "Incomplete"),
            (format!("callback_groups: [{{{rest}, priority: !!int 3}}]\n"), &level, "Layout"),
            (format!("callback_groups: [{{{rest}, priority: [3]}}]\n"), &level, "Layout"),
            ("callback_groups:\n- id: /n\n  policy: SCHED_RR\n  priority: |-\n    3\n".to_owned(), &level, "Layout"),
            ("callback_groups:\n- id: /n\n  policy: SCHED_RR\n  priority: 3\n  affinity:\n  - 1 # x\n  - 2\n".to_owned(), &affinity(&[1]), "Layout"),
            (format!("callback_groups: [{{{rest}, priority: 3}}]\n--- x\n"), &level, "Incomplete"),
            (format!("callback_groups: [{{{rest}, priority: 3}}\n"), &level, "Incomplete"),
            (format!("callback_groups: [{{{rest}, priority: 3}}]\n"), &fifo(0), "InvalidValue"),
            (format!("callback_groups: [{{{rest}, priority: 3}}]\n"), &fifo(100), "InvalidValue"),
            ("callback_groups: [{id: /n, policy: SCHED_IDLE, nice: 3}]\n".to_owned(), &ThreadChange { level: None, ..fifo(1) }, "LevelNeeded"),
            ("callback_groups: []\n".to_owned(), &level, "NoSuchEntry"),
        ] {
            let refusal = format!("{:?}", changed(&text, change));
            assert!(refusal.starts_with(&format!("Err({is_expected}")), "{text}: {refusal}");
        }
    }

    #[test]
    fn control_loops_and_controllers_are_changed() {
        let (manager, controller) = (ThreadPlace::Manager(0), ThreadPlace::Controller(0, 0));
        let changed = |text: &str, place, level, cpu| {
            let change = ThreadChange { level, affinity: Some(CpuSet::of(cpu)), policy: None };
            change_thread(text, place, &change).map(|edits| apply_edits(text, &edits))
        };
        let text = "controller_manager:\n  ros__parameters:\n    update_rate: 1000  # Hz\n    cpu_affinity: 2\n    c:\n      type: a/C\n\nc:\n  ros__parameters:\n    is_async: true\n    async_parameters:\n      thread_priority: 40\n";
        let text = changed(text, manager, Some(98), 3).unwrap();
        let text = changed(&text, controller, Some(41), 1).unwrap();
        assert_eq!(
            text,
            "controller_manager:\n  ros__parameters:\n    update_rate: 1000  # Hz\n    cpu_affinity: 3\n    thread_priority: 98\n    c:\n      type: a/C\n\nc:\n  ros__parameters:\n    is_async: true\n    async_parameters:\n      thread_priority: 41\n      cpu_affinity: [1]\n"
        );
        // Without a mapping for them, the keys have dots.
        let text = "controller_manager: {ros__parameters: {c: {type: a/C}}}\nc:\n  ros__parameters: {is_async: true}\n";
        let after = changed(text, controller, Some(3), 1).unwrap();
        assert!(after.ends_with(
            "{is_async: true, async_parameters.thread_priority: 3, async_parameters.cpu_affinity: [1]}\n"
        ));
        let file = read_controllers(&after);
        let controller = &file.managers[0].controllers[0];
        assert_eq!(
            (controller.thread_priority.known(), controller.affinity.known()),
            (Some(&3), Some(&CpuSet::of(1)))
        );
        let none = ThreadChange { affinity: Some(CpuSet::NONE), ..ThreadChange::default() };
        assert_eq!(change_thread(text, manager, &none), Err(EditRefusal::InvalidValue));
        assert_eq!(changed(text, manager, Some(100), 1), Err(EditRefusal::InvalidValue));
        assert_eq!(changed(text, ThreadPlace::Controller(0, 1), Some(1), 1), Err(EditRefusal::NoSuchEntry));
        // The parameter of another section counts.
        for text in [
            "controller_manager: {ros__parameters: {update_rate: 9}}\n/**: {ros__parameters: {thread_priority: 7}}\n",
            "controller_manager: {ros__parameters: {thread_priority: 9}}\n/**: {ros__parameters: {thread_priority: 7}}\n",
        ] {
            let refused = changed(text, manager, Some(8), 1);
            assert!(matches!(refused, Err(EditRefusal::Shared(_))), "{refused:?}");
        }
    }

    /// A random thread, and how it is written.
    #[derive(Debug, Clone)]
    struct Written {
        policy: usize,
        level: u8,
        cpus: Vec<u32>,
        /// Of `affinity`: absent, null, in brackets, in lines, in lines with comments.
        form: u8,
        /// In lines, in braces, in braces over several lines, as JSON.
        style: u8,
        quote: u8,
        /// Of the level: none, an anchor, an anchor with an alias behind it, an alias.
        anchor: u8,
        /// Of a nice value: in `nice`, in `priority`, in both.
        nice: u8,
        order: u8,
        noise: u8,
    }

    fn written() -> impl Strategy<Value = Written> {
        let looks = (0..5_u8, 0..4_u8, 0..3_u8, 0..4_u8, 0..3_u8, any::<u8>(), any::<u8>());
        let parts = (0..5_usize, 0..127_u8, prop::collection::btree_set(0..12_u32, 1..4), looks);
        parts.prop_map(|(policy, level, cpus, (form, style, quote, anchor, nice, order, noise))| Written {
            policy,
            level,
            cpus: cpus.into_iter().collect(),
            form,
            style,
            quote,
            anchor,
            nice,
            order,
            noise,
        })
    }

    /// What a thread is: its id, policy, priority or nice value, and CPUs.
    type Meaning = (String, ThreadPolicy, i8, CpuSet);

    impl Written {
        fn policy(&self) -> ThreadPolicy {
            ThreadPolicy::ALL[self.policy]
        }

        fn level(&self) -> i8 {
            match self.policy().has_priority() {
                true => 1 + (self.level % 99).cast_signed(),
                false => (self.level % 40).cast_signed() - 20,
            }
        }

        fn meaning(&self, id: &str) -> Meaning {
            let cpus = if self.form < 2 { CpuSet::NONE } else { self.cpus.iter().copied().collect() };
            (id.to_owned(), self.policy(), self.level(), cpus)
        }

        fn has(&self, bit: u8) -> bool {
            self.noise & 1 << bit != 0
        }

        /// Writes the thread, and notes the places of its values.
        fn write(&self, id: &str, text: &mut String, line_break: &str, places: &mut Vec<Range<usize>>) {
            let is_json = self.style == 3;
            let quoted = |word: &str| match self.quote {
                _ if is_json => format!("\"{word}\""),
                0 => word.to_owned(),
                1 => format!("'{word}'"),
                _ => format!("\"{word}\""),
            };
            let key = |name: &str| if is_json { format!("\"{name}\"") } else { name.to_owned() };
            let level = match self.anchor {
                1 => format!("&l{} \u{0}{}\u{1}", &id[2..], self.level()),
                2 => format!("&l{} \u{0}{}\u{1}", &id[2..], self.level()),
                3 => format!("\u{0}*k{}\u{1}", &id[2..]),
                _ => format!("\u{0}{}\u{1}", self.level()),
            };
            let name = if self.policy().has_priority() || self.nice == 1 { "priority" } else { "nice" };
            let mut values = vec![
                ("id", quoted(id)),
                ("policy", format!("\u{0}{}\u{1}", quoted(self.policy().name()))),
                (name, level),
            ];
            if name == "nice" && self.nice == 2 {
                values.push(("priority", format!("\u{0}{}\u{1}", self.level())));
            }
            let items: Vec<_> = self.cpus.iter().map(ToString::to_string).collect();
            let in_lines = self.style == 0;
            match self.form {
                0 => {}
                1 if self.has(6) && in_lines => values.push(("affinity", "\u{0}\u{1}".to_owned())),
                1 => values.push(("affinity", "\u{0}~\u{1}".to_owned())),
                3 | 4 if in_lines => {
                    let comment = if self.form == 4 { " # \u{fc}" } else { "" };
                    let items = items.join(&format!("{comment}{line_break}      - "));
                    values.push(("affinity", format!("{line_break}      \u{0}- {items}\u{1}")));
                }
                _ => values.push(("affinity", format!("\u{0}[{}]\u{1}", items.join(" , ")))),
            }
            if self.has(0) {
                let value = if in_lines {
                    format!("|{line_break}      a: 1{line_break}      # b")
                } else {
                    "{a: [1]}".to_owned()
                };
                values.push(("unkn\u{f6}wn", value));
            }
            if self.has(1) {
                values.push(("other", "x".to_owned()));
            }
            let rotation = usize::from(self.order) % values.len();
            values.rotate_left(rotation);
            let comment = if self.has(2) { "  # \u{1f980} {" } else { "" };
            let entries: Vec<_> = values
                .iter()
                .map(|(name, value)| {
                    format!(
                        "{}:{}{value}",
                        key(name),
                        if value.starts_with("\u{0}\u{1}") || value.starts_with(['\r', '\n']) {
                            ""
                        } else {
                            " "
                        }
                    )
                })
                .collect();
            let with_marks = match self.style {
                0 => {
                    let is_block = |it: &&String| !it.contains('|');
                    let lines: Vec<_> = entries
                        .iter()
                        .map(|it| format!("{it}{}", if is_block(&it) { comment } else { "" }))
                        .collect();
                    let blank = if self.has(3) { line_break } else { "" };
                    lines.join(&format!("{blank}{line_break}    "))
                }
                2 => format!(
                    "{{ {}{}}}",
                    entries.join(&format!(" ,{line_break}      ")),
                    if self.has(4) { " , " } else { " " }
                ),
                _ => format!("{{{}}}", entries.join(", ")),
            };
            // The marks are the places of values.
            for c in with_marks.chars() {
                match c {
                    '\u{0}' => places.push(text.len()..0),
                    '\u{1}' => places.last_mut().unwrap().end = text.len(),
                    c => text.push(c),
                }
            }
            text.push_str(comment);
            text.push_str(line_break);
        }
    }

    /// Returns a file with these threads, and the places of their values.
    fn file(groups: &[Written], others: &[Written], is_crlf: bool) -> (String, Vec<Vec<Range<usize>>>) {
        let line_break = if is_crlf { "\r\n" } else { "\n" };
        let (mut text, mut all) = (String::new(), Vec::new());
        let (mut before, mut behind) = (String::new(), String::new());
        for (index, it) in groups.iter().chain(others).enumerate() {
            if it.anchor == 3 {
                before.push_str(&format!("k{index}: &k{index} {}{line_break}", it.level()));
            }
            if it.anchor == 2 {
                behind.push_str(&format!("l{index}: *l{index}{line_break}"));
            }
        }
        text.push_str(&before);
        let mut index = 0;
        for (section, entries) in [("callback_groups", groups), ("non_ros_threads", others)] {
            text.push_str(&format!(
                "{section}:{}{line_break}",
                if entries.is_empty() { " []" } else { " # \u{e9}" }
            ));
            for it in entries {
                let mut places = Vec::new();
                text.push_str("  - ");
                it.write(&format!("/n{index}"), &mut text, line_break, &mut places);
                all.push(places);
                index += 1;
            }
        }
        text.push_str(&behind);
        if text.len() % 3 == 0 {
            text.truncate(text.trim_end().len());
        }
        (text, all)
    }

    fn meaning(entry: &ThreadEntry) -> Meaning {
        let id = entry.id.known().expect("an id").clone();
        let cpus = entry.affinity.known().copied().unwrap_or_default();
        (id, *entry.policy.known().expect("a policy"), *entry.level.known().expect("a level"), cpus)
    }

    fn meanings(text: &str) -> Vec<Meaning> {
        let file = read_threads(text);
        assert!(file.completeness.is_complete(), "{:?} of {text}", file.problems);
        file.groups.iter().chain(&file.others).map(meaning).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn a_change_changes_the_values_of_one_entry(
            groups in prop::collection::vec(written(), 1..4), others in prop::collection::vec(written(), 0..3), is_crlf in any::<bool>(),
            index in any::<prop::sample::Index>(), policy in prop::option::of(0..5_usize), level in prop::option::weighted(0.8, 0..127_u8),
            cpus in prop::option::of(prop::collection::btree_set(0..12_u32, 0..4)),
        ) {
            let (text, places) = file(&groups, &others, is_crlf);
            let all: Vec<_> = groups.iter().chain(&others).collect();
            let mut wanted: Vec<_> = all.iter().enumerate().map(|(index, it)| it.meaning(&format!("/n{index}"))).collect();
            prop_assert_eq!(&meanings(&text), &wanted);
            let index = index.index(all.len());
            let old = all[index];
            let new_policy = policy.map(|it| ThreadPolicy::ALL[it]);
            let written = Written { policy: policy.unwrap_or(old.policy), level: level.unwrap_or(0), ..old.clone() };
            let level = level.map(|_| written.level());
            let cpus: Option<CpuSet> = cpus.map(|it| it.into_iter().collect());
            let change = ThreadChange { policy: new_policy, level, affinity: cpus };
            let place = match index.checked_sub(groups.len()) {
                None => ThreadPlace::Group(index),
                Some(index) => ThreadPlace::Other(index),
            };
            let is_other_class = written.policy().has_priority() != old.policy().has_priority();
            match change_thread(&text, place, &change) {
                Ok(edits) => {
                    prop_assert!(!is_other_class || level.is_some());
                    let it = &mut wanted[index];
                    *it = (it.0.clone(), new_policy.unwrap_or(it.1), level.unwrap_or(it.2), cpus.unwrap_or(it.3));
                    let (mut after, mut at) = (String::new(), 0);
                    for edit in &edits {
                        prop_assert!(edit.range.is_empty() || places[index].contains(&edit.range), "{:?} of\n{}", edit, text);
                        after = after + &text[at..edit.range.start] + &edit.text;
                        at = edit.range.end;
                    }
                    after += &text[at..];
                    prop_assert_eq!(&meanings(&after), &wanted, "{}", after);
                }
                Err(EditRefusal::LevelNeeded) => prop_assert!(is_other_class && level.is_none()),
                Err(EditRefusal::Shared(_)) => prop_assert!(old.anchor == 2 && level.is_some()),
                Err(EditRefusal::Layout(_)) => prop_assert!(old.form == 4 && old.style == 0 && cpus.is_some()),
                Err(refusal) => prop_assert!(false, "{:?} of\n{}", refusal, text),
            }
        }
    }
}
