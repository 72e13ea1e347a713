//! The tree of the last text of a YAML file, for the next one: most edits of priorities and CPUs change a number.
//!
//! The parser takes most of the time that such an edit costs. A tree is used again where only the digits of a plain value differ: the
//! rest of the text has the same values then, and those behind it move. A number that is a key, or is in one, is parsed again, as the
//! length of keys is limited.

use std::ops::Range;
use std::sync::Arc;

use saphyr_parser::ScalarStyle;

use super::threads::{ThreadsFile, threads_of};
use super::yaml::{NodeId, NodeKind, Yaml, parse};

/// A text with its tree.
#[derive(Debug)]
pub(crate) struct KeptYaml {
    text: Arc<str>,
    yaml: Yaml,
}

impl KeptYaml {
    /// Parses a text, or changes the tree of the previous one.
    pub(crate) fn new(text: Arc<str>, previous: Option<KeptYaml>) -> KeptYaml {
        let again = previous.and_then(|mut it| it.yaml.replace_number(&it.text, &text).then_some(it.yaml));
        let yaml = again.unwrap_or_else(|| parse(&text));
        KeptYaml { text, yaml }
    }

    /// Reads a `threads.yaml`.
    pub(crate) fn threads(&self) -> ThreadsFile {
        threads_of(&self.yaml)
    }
}

/// Returns the numbers that differ between two texts, and nothing else does: their places.
fn changed_number(old: &str, new: &str) -> Option<[Range<usize>; 2]> {
    let same = |one: &mut dyn Iterator<Item = (u8, u8)>| one.take_while(|(one, other)| one == other).count();
    let start = same(&mut old.bytes().zip(new.bytes()));
    let least = old.len().min(new.len());
    let end = same(&mut old.bytes().rev().zip(new.bytes().rev())).min(least - start);
    let digits = |bytes: &mut dyn Iterator<Item = u8>| bytes.take_while(u8::is_ascii_digit).count();
    let first = start - digits(&mut old.as_bytes().get(..start)?.iter().rev().copied());
    let behind = digits(&mut old.as_bytes().get(old.len() - end..)?.iter().copied());
    let number = |text: &str| {
        let range = first..text.len() - end + behind;
        let digits = text.get(range.clone())?;
        (!digits.is_empty() && digits.bytes().all(|it| it.is_ascii_digit())).then_some(range)
    };
    Some([number(old)?, number(new)?])
}

impl Yaml {
    /// Makes this tree of a text that of a new one, if only a number has changed. Returns whether it has.
    fn replace_number(&mut self, old: &str, new: &str) -> bool {
        let Some([before, after]) = changed_number(old, new).filter(|_| self.problems.is_empty()) else {
            return false;
        };
        let is_number = |kind: &NodeKind| matches!(kind, NodeKind::Scalar(_, ScalarStyle::Plain));
        let found = self.nodes.iter().position(|it| it.range == before && is_number(&it.kind));
        let is_safe = |[key, _]: &[NodeId; 2]| {
            Some(key.0) != found && matches!(self.node(*key).kind, NodeKind::Scalar(..))
        };
        let are_safe = |kind: &NodeKind| !matches!(kind, NodeKind::Mapping(all) if !all.iter().all(is_safe));
        if !self.nodes.iter().all(|it| are_safe(&it.kind)) {
            return false;
        }
        let Some(node) = found.and_then(|it| self.nodes.get_mut(it)) else { return false };
        node.kind = NodeKind::Scalar(new[after.clone()].to_owned(), ScalarStyle::Plain);
        for range in self.nodes.iter_mut().map(|it| &mut it.range) {
            for end in [&mut range.start, &mut range.end] {
                if *end >= before.end {
                    *end = *end - before.end + after.end;
                }
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Whether the tree of the first text was used for the second one, which then has the tree of its own.
    fn is_used(old: &str, new: &str) -> bool {
        let mut yaml = parse(old);
        let is_used = yaml.replace_number(old, new);
        if is_used {
            assert_eq!(format!("{yaml:?}"), format!("{:?}", parse(new)), "{old:?} {new:?}");
        }
        is_used
    }

    #[test]
    fn a_number_is_replaced_and_nothing_else() {
        for (old, new) in [
            ("a: 1\nb: [2, 3]\n", "a: 10\nb: [2, 3]\n"),
            ("a: 1\nb: [2, 3]\n", "a: 1\nb: [23, 3]\n"),
            ("a: 12", "a: 2"),
            ("- {p: &x 11 }\n- *x\n-\n", "- {p: &x 1 }\n- *x\n-\n"),
            ("ä: 99 # 1\nb:\n", "ä: 100 # 1\nb:\n"),
            ("a: !!int 5\nb: {c, d: }\n", "a: !!int 57\nb: {c, d: }\n"),
        ] {
            assert!(is_used(old, new), "{old:?} {new:?}");
            assert!(is_used(new, old), "{old:?} {new:?}");
        }
        for (old, new) in [
            ("a: 1\n", "a: x\n"),
            ("a: 1\n", "a: \n"),
            ("a: \n", "a: 1\n"),
            ("a: 1\n", "a: 1.\n"),
            ("1: a\n", "2: a\n"),
            ("{1: 2}: a\n", "{1: 3}: a\n"),
            ("a: '1'\n", "a: '2'\n"),
            ("a: x1\n", "a: x2\n"),
            ("a: 1\n  2\n", "a: 1\n  3\n"),
            ("a: b # 1\n", "a: b # 2\n"),
            ("a: |1\n  x\n", "a: |2\n  x\n"),
            ("a: 1\na: 2\n", "a: 1\na: 3\n"),
            ("a: 1\n[\n", "a: 2\n[\n"),
        ] {
            assert!(!is_used(old, new), "{old:?} {new:?}");
        }
    }

    /// Any text, and mostly one without an error.
    fn text() -> impl Strategy<Value = String> {
        const PARTS: &str =
            "[a-c]: |[0-9]{1,3}|- |\n *|\\{|\\}|\\[|\\]|, |#[0-9]|&x |\\*x|é|'[0-9]'|\\? |!t ";
        const VALUES: &str = "[0-9]{1,3}|\\[[0-9]{1,2}, [0-9]\\]|\\{p: [0-9]{1,2} , q: \\}|'[0-9]'|&x [0-9]{2}|!t [0-9]{2}|x[0-9]\
                              |[0-9]\n  [0-9]|\n  - [0-9]{1,2}\n  -|\n- [0-9]|é # [0-9]|\n  a: [0-9]{1,2}";
        let any = proptest::collection::vec(PARTS, 1..24).prop_map(|it| it.concat());
        let lines = proptest::collection::vec(VALUES, 1..6).prop_map(|values| {
            let line = |(number, value): (usize, &String)| format!("k{number}: {value}\n");
            values.iter().enumerate().map(line).collect::<String>()
        });
        prop_oneof![1 => any, 3 => lines]
    }

    proptest! {
        #[test]
        fn an_edited_tree_is_that_of_its_text(
            old in text(), at in any::<proptest::sample::Index>(), digits in "[0-9]{0,2}", removed in 0..2_usize,
        ) {
            let places: Vec<usize> = old.match_indices(|it: char| it.is_ascii_digit()).map(|it| it.0).collect();
            if places.is_empty() {
                return Ok(());
            }
            let start = *at.get(&places);
            let new = format!("{}{digits}{}", &old[..start], &old[start + removed..]);
            is_used(&old, &new);
        }
    }
}
