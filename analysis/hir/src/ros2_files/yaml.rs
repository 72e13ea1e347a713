//! A YAML file as a tree, with the place of each value in bytes.
//!
//! The text is untrusted. The depth and the number of values are limited, and an alias is a reference to its value, never a copy: a
//! tree is as large as its text. What readers disagree on, such as a key that a mapping has twice, gives no value.

use std::ops::Range;

use rustc_hash::{FxHashMap, FxHashSet};
use saphyr_parser::{Event, Parser, ScalarStyle, Span};

use super::problem::{FileProblem, FileProblemKind};

/// The maximum nesting of values.
const MAX_DEPTH: usize = 64;

/// The maximum number of values, keys included.
const MAX_NODES: usize = 200_000;

/// The first document of a YAML file.
#[derive(Debug, Default)]
pub(super) struct Yaml {
    nodes: Vec<YamlNode>,
    /// The problems of the text.
    pub(super) problems: Vec<FileProblem>,
}

/// The index of a value in [`Yaml`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NodeId(usize);

/// A key or a value.
#[derive(Debug)]
pub(super) struct YamlNode {
    pub(super) kind: NodeKind,
    /// Its place, without its anchor and its tag. Empty for a value that is not written: behind the colon.
    pub(super) range: Range<usize>,
    /// Whether it has a tag, such as `!!str`.
    pub(super) is_tagged: bool,
}

#[derive(Debug)]
pub(super) enum NodeKind {
    Scalar {
        text: String,
        style: ScalarStyle,
    },
    Sequence {
        items: Vec<NodeId>,
        is_flow: bool,
    },
    Mapping {
        entries: Vec<(NodeId, NodeId)>,
        is_flow: bool,
        /// Whether the text ends, or has an error, in the mapping: it may have other keys.
        is_open: bool,
    },
    /// The value that it refers to, which is no alias.
    Alias(NodeId),
}

/// What a mapping says of a key.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Lookup {
    Absent,
    /// Something at this place prevents an answer.
    Unknown(Range<usize>),
    Found(NodeId),
}

/// Parses the first document of a YAML file. The tree has what is before the first error.
pub(super) fn parse(text: &str) -> Yaml {
    let mut builder = Builder { text, ..Builder::default() };
    if !text.is_ascii() {
        builder.offsets = text.char_indices().map(|(offset, _)| offset).collect();
    }
    let mut has_document = false;
    for event in Parser::new_from_str(text) {
        let read = match event {
            Ok((Event::DocumentStart(_), span)) if has_document => {
                Err((FileProblemKind::SecondDocument, builder.range(span)))
            }
            Ok((event, span)) => {
                has_document |= matches!(event, Event::DocumentStart(_));
                builder.event(event, span)
            }
            Err(error) => {
                let at = builder.offset(error.marker().index());
                let end =
                    text.get(at..).and_then(|rest| rest.chars().next()).map_or(at, |it| at + it.len_utf8());
                Err((FileProblemKind::Syntax(error.info().to_owned()), at..end))
            }
        };
        if let Err((kind, range)) = read {
            builder.yaml.problems.push(FileProblem { kind, range });
            break;
        }
    }
    builder.check_keys();
    builder.yaml
}

impl Yaml {
    /// Returns the value of the document.
    pub(super) fn root(&self) -> Option<NodeId> {
        (!self.nodes.is_empty()).then_some(NodeId(0))
    }

    pub(super) fn node(&self, id: NodeId) -> &YamlNode {
        &self.nodes[id.0]
    }

    /// Returns all keys and values in the order of the text.
    pub(super) fn nodes(&self) -> &[YamlNode] {
        &self.nodes
    }

    /// Returns the value that an alias refers to; any other value itself.
    pub(super) fn resolve(&self, id: NodeId) -> &YamlNode {
        match self.node(id).kind {
            NodeKind::Alias(target) => self.node(target),
            _ => self.node(id),
        }
    }

    /// Returns the mapping with this range.
    pub(super) fn mapping_at(&self, range: &Range<usize>) -> Option<NodeId> {
        let is_it = |it: &YamlNode| it.range == *range && matches!(it.kind, NodeKind::Mapping { .. });
        self.nodes.iter().position(is_it).map(NodeId)
    }

    /// Returns the keys and values of a mapping; none of any other value.
    pub(super) fn entries(&self, id: NodeId) -> &[(NodeId, NodeId)] {
        match &self.resolve(id).kind {
            NodeKind::Mapping { entries, .. } => entries,
            _ => &[],
        }
    }

    /// Returns whether a value is a mapping, without a tag.
    pub(super) fn is_mapping(&self, id: NodeId) -> bool {
        matches!(self.resolve(id), YamlNode { kind: NodeKind::Mapping { .. }, is_tagged: false, .. })
    }

    /// Returns the items of a list; `None` for any other value, and with a tag.
    pub(super) fn items(&self, id: NodeId) -> Option<&[NodeId]> {
        match self.resolve(id) {
            YamlNode { kind: NodeKind::Sequence { items, .. }, is_tagged: false, .. } => Some(items),
            _ => None,
        }
    }

    /// Returns the text of a scalar of one line; `None` for a value with a tag, and for a block scalar (`|`, `>`).
    pub(super) fn text(&self, id: NodeId) -> Option<&str> {
        match self.resolve(id) {
            YamlNode { is_tagged: false, kind: NodeKind::Scalar { text, style }, .. } => {
                (!matches!(style, ScalarStyle::Literal | ScalarStyle::Folded)).then_some(text)
            }
            _ => None,
        }
    }

    /// Returns whether a value is a text without quotes.
    pub(super) fn is_plain(&self, id: NodeId) -> bool {
        matches!(self.resolve(id).kind, NodeKind::Scalar { style: ScalarStyle::Plain, .. })
    }

    /// Returns the value of a key of a mapping. `a.b` is also the value of `b` in the mapping `a`.
    pub(super) fn find(&self, mapping: NodeId, name: &str) -> Lookup {
        let mut found = Vec::new();
        let doubt = self.collect(mapping, name, &mut found);
        match (found.as_slice(), doubt) {
            ([], None) => Lookup::Absent,
            ([one], None) => Lookup::Found(*one),
            // The text has an error behind the key.
            ([one], Some((_, true))) => Lookup::Found(*one),
            ([], Some((range, _))) => Lookup::Unknown(range),
            ([.., last], _) => Lookup::Unknown(self.node(*last).range.clone()),
        }
    }

    /// Collects the values of a name. Returns why there may be others, and whether the reason is the end of the text that is read.
    fn collect(&self, mapping: NodeId, name: &str, found: &mut Vec<NodeId>) -> Option<(Range<usize>, bool)> {
        let node = self.resolve(mapping);
        let NodeKind::Mapping { entries, is_open, .. } = &node.kind else { return None };
        let mut doubt = is_open.then(|| (node.range.clone(), true));
        for &(key, value) in entries {
            match self.key(key) {
                None => doubt = Some((self.node(key).range.clone(), false)),
                Some(key) if key == name => found.push(value),
                Some(key) => {
                    let rest = name.strip_prefix(key).and_then(|rest| rest.strip_prefix('.'));
                    if let Some(other) = rest.and_then(|rest| self.collect(value, rest, found)) {
                        doubt = doubt.filter(|it| !it.1).or(Some(other));
                    }
                }
            }
        }
        doubt
    }

    /// Returns the text of a key; `None` for a key on which readers disagree.
    pub(super) fn key(&self, id: NodeId) -> Option<&str> {
        let is_alias = matches!(self.node(id).kind, NodeKind::Alias(_));
        self.text(id).filter(|text| !is_alias && !(*text == "<<" && self.is_plain(id)))
    }
}

#[derive(Default)]
struct Builder<'t> {
    text: &'t str,
    /// The offset of each character; empty if each is one byte.
    offsets: Vec<usize>,
    yaml: Yaml,
    /// The collections around the current place, with the key of a mapping that waits for its value.
    open: Vec<(NodeId, Option<NodeId>)>,
    anchors: FxHashMap<usize, NodeId>,
}

type Stop = (FileProblemKind, Range<usize>);

impl Builder<'_> {
    /// Returns the offset of a character by its index: the parser counts characters.
    fn offset(&self, index: usize) -> usize {
        let offset = if self.offsets.is_empty() { Some(&index) } else { self.offsets.get(index) };
        offset.copied().unwrap_or(self.text.len()).min(self.text.len())
    }

    fn range(&self, span: Span) -> Range<usize> {
        let start = self.offset(span.start.index());
        start..self.offset(span.end.index()).max(start)
    }

    fn event(&mut self, event: Event<'_>, span: Span) -> Result<(), Stop> {
        let (kind, anchor, tag) = match event {
            Event::Scalar(text, style, anchor, tag) => {
                (NodeKind::Scalar { text: text.into_owned(), style }, anchor, tag)
            }
            Event::Alias(anchor) => match self.anchors.get(&anchor) {
                Some(target) => (NodeKind::Alias(*target), 0, None),
                None => return Err((FileProblemKind::UncertainKeys, self.range(span))),
            },
            Event::SequenceStart(anchor, tag) => {
                (NodeKind::Sequence { items: Vec::new(), is_flow: false }, anchor, tag)
            }
            Event::MappingStart(anchor, tag) => {
                let kind = NodeKind::Mapping { entries: Vec::new(), is_flow: false, is_open: true };
                (kind, anchor, tag)
            }
            Event::SequenceEnd | Event::MappingEnd => {
                self.close(self.offset(span.start.index()));
                return Ok(());
            }
            _ => return Ok(()),
        };
        let mut range = self.range(span);
        if self.yaml.nodes.len() >= MAX_NODES {
            return Err((FileProblemKind::TooLarge, range));
        }
        if self.open.len() >= MAX_DEPTH {
            return Err((FileProblemKind::TooDeep, range));
        }
        let is_tagged = tag.is_some();
        let has_properties = anchor > 0 || is_tagged;
        if has_properties {
            range.start = self.after_properties(&range);
        }
        if let NodeKind::Scalar { text, style: ScalarStyle::Plain } = &kind
            && text.is_empty()
        {
            let start = if has_properties { range.start } else { self.place_of_empty(range.start) };
            range = start..start;
        }
        let node = self.add(kind, range, is_tagged);
        if anchor > 0 {
            self.anchors.insert(anchor, node);
        }
        Ok(())
    }

    /// Returns the offset behind the anchor and the tag at the start of a range.
    fn after_properties(&self, range: &Range<usize>) -> usize {
        let mut rest = self.text.get(range.clone()).unwrap_or_default();
        loop {
            let is_end = |c: char| c.is_whitespace() || ",[]{}".contains(c);
            let length = match rest.chars().next() {
                Some('&' | '!') => rest.find(is_end).unwrap_or(rest.len()),
                Some('#') => rest.find('\n').unwrap_or(rest.len()),
                Some(first) if first.is_whitespace() => first.len_utf8(),
                _ => return range.end - rest.len(),
            };
            rest = &rest[length..];
        }
    }

    /// Returns the place of a value that is not written: the parser gives that of its colon, or of the next token.
    fn place_of_empty(&self, at: usize) -> usize {
        let has_colon = self.text.get(at..).is_some_and(|rest| rest.starts_with(':'));
        match self.open.last().and_then(|(_, key)| *key) {
            _ if has_colon => at + 1,
            Some(key) => self.yaml.node(key).range.end,
            None => at,
        }
    }

    /// Adds a node to the innermost open collection.
    fn add(&mut self, mut kind: NodeKind, mut range: Range<usize>, is_tagged: bool) -> NodeId {
        let id = NodeId(self.yaml.nodes.len());
        let source = self.text.get(range.clone()).unwrap_or_default();
        let is_collection = match &mut kind {
            NodeKind::Sequence { is_flow, .. } => {
                *is_flow = source.starts_with('[');
                // Without indentation, a list has the place of its first item.
                let before = self.text.get(..range.start).unwrap_or_default().trim_end();
                if !*is_flow && !source.starts_with('-') && before.ends_with('-') {
                    range.start = before.len() - 1;
                }
                true
            }
            NodeKind::Mapping { is_flow, .. } => {
                *is_flow = source.starts_with('{');
                true
            }
            NodeKind::Scalar { style: ScalarStyle::Literal | ScalarStyle::Folded, .. } => false,
            NodeKind::Scalar { style: ScalarStyle::SingleQuoted | ScalarStyle::DoubleQuoted, .. } => {
                range.end = range.start + length_of_quoted(source);
                false
            }
            _ => {
                range.end = range.start + source.trim_end().len();
                false
            }
        };
        self.yaml.nodes.push(YamlNode { kind, range, is_tagged });
        if let Some((parent, key)) = self.open.last_mut() {
            match (&mut self.yaml.nodes[parent.0].kind, key.take()) {
                (NodeKind::Sequence { items, .. }, _) => items.push(id),
                (NodeKind::Mapping { entries, .. }, Some(key)) => entries.push((key, id)),
                _ => *key = Some(id),
            }
        }
        if is_collection {
            self.open.push((id, None));
        }
        id
    }

    /// Closes the innermost collection: its end is that of its last value, or its bracket.
    fn close(&mut self, bracket: usize) {
        let Some((id, _)) = self.open.pop() else { return };
        let end = |id: &NodeId| self.yaml.node(*id).range.end;
        let node = self.yaml.node(id);
        let (is_flow, last) = match &node.kind {
            NodeKind::Sequence { items, is_flow } => (*is_flow, items.last().map(end)),
            NodeKind::Mapping { entries, is_flow, .. } => {
                (*is_flow, entries.last().map(|(key, value)| end(key).max(end(value))))
            }
            _ => return,
        };
        let end = if is_flow { bracket + 1 } else { last.unwrap_or(bracket) };
        let node = &mut self.yaml.nodes[id.0];
        node.range.end = end.clamp(node.range.start, self.text.len());
        if let NodeKind::Mapping { is_open, .. } = &mut node.kind {
            *is_open = false;
        }
    }

    /// Reports keys that a mapping has twice, and keys on which readers disagree.
    fn check_keys(&mut self) {
        let mut problems = Vec::new();
        for node in &self.yaml.nodes {
            let NodeKind::Mapping { entries, .. } = &node.kind else { continue };
            let mut seen = FxHashSet::default();
            for (key, _) in entries {
                let kind = match self.yaml.key(*key) {
                    None => FileProblemKind::UncertainKeys,
                    Some(text) if !seen.insert(text) => FileProblemKind::RepeatedKey(text.to_owned()),
                    Some(_) => continue,
                };
                problems.push(FileProblem { kind, range: self.yaml.node(*key).range.clone() });
            }
        }
        self.yaml.problems.extend(problems);
    }
}

/// Returns the length of a text in quotes: the place that the parser gives includes a comment behind it.
fn length_of_quoted(source: &str) -> usize {
    let (bytes, mut at) = (source.as_bytes(), 1);
    while let Some(byte) = bytes.get(at) {
        let is_quote = bytes.first() == Some(byte);
        match byte {
            b'\'' if is_quote && bytes.get(at + 1) == Some(&b'\'') => at += 2,
            b'\\' if bytes.first() == Some(&b'"') => at += 2,
            _ if is_quote => return at + 1,
            _ => at += 1,
        }
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use proptest::prelude::*;

    use super::*;

    /// Returns the source of each scalar and each bracketed collection, in order, and its kind.
    fn sources(text: &str) -> Vec<&str> {
        let yaml = parse(text);
        assert_eq!(yaml.problems, [], "{text}");
        yaml.nodes().iter().map(|it| &text[it.range.clone()]).collect()
    }

    fn kinds(text: &str) -> Vec<FileProblemKind> {
        parse(text).problems.into_iter().map(|it| it.kind).collect()
    }

    #[test]
    fn places_are_bytes_of_values_without_anchors_and_tags() {
        let text = "\u{feff}\u{e9}: \u{1f980} # \u{fc}\r\nb: [1, 'it''s' ]  \r\nc: &\u{e0} !!str\r\n  x\r\nd: *\u{e0}\r\ne:\r\n";
        let found = sources(text);
        assert_eq!(
            found[1..],
            ["\u{e9}", "\u{1f980}", "b", "[1, 'it''s' ]", "1", "'it''s'", "c", "x", "d", "*\u{e0}", "e", ""]
        );
        assert_eq!(found[0], &text[3..text.len() - 2]);
        assert_eq!(
            sources("a: {b: 1 , \"c\": [ ]} # {\n")[2..],
            ["{b: 1 , \"c\": [ ]}", "b", "1", "\"c\"", "[ ]"]
        );
        assert_eq!(
            sources("- a: 1\n  b:\n  - 2\n  - c: 3\n\n# d\n- e \n"),
            [
                "- a: 1\n  b:\n  - 2\n  - c: 3\n\n# d\n- e",
                "a: 1\n  b:\n  - 2\n  - c: 3",
                "a",
                "1",
                "b",
                "- 2\n  - c: 3",
                "2",
                "c: 3",
                "c",
                "3",
                "e",
            ]
        );
        let text = "- 'a''' # 'b'\n- \"\\\"\\\\\" # \"\n- \"\\\\\n \" # c";
        assert_eq!(sources(text)[1..], ["'a'''", "\"\\\"\\\\\"", "\"\\\\\n \""]);
        // A value that is not written is behind its colon, or behind its key.
        let yaml = parse("a: # c\nb: {c, d: , e:}\nf: &x\n? g\n");
        let empty = yaml.nodes().iter().filter(|it| it.range.is_empty()).map(|it| it.range.start);
        assert_eq!(empty.collect::<Vec<_>>(), [2, 12, 16, 21, 28, 32]);
    }

    #[test]
    fn a_key_has_one_value() {
        let text = "a: {b: 1, c.d: 2}\na.e: 3\nf: {g: {h: 4}, g.h: 5}\n'i': ~\n";
        let yaml = parse(text);
        let root = yaml.root().unwrap();
        let found = |name: &str| match yaml.find(root, name) {
            Lookup::Found(id) => &text[yaml.node(id).range.clone()],
            Lookup::Absent => "absent",
            Lookup::Unknown(_) => "unknown",
        };
        assert_eq!(["a.b", "a.c.d", "a.e", "i"].map(found), ["1", "2", "3", "~"]);
        assert_eq!(["a.c", "b", "a.f", "", "a."].map(found), ["absent"; 5]);
        assert_eq!(found("f.g.h"), "unknown");
        assert_eq!(kinds("a: 1\nb: 2\n'a': 3\n"), [FileProblemKind::RepeatedKey("a".to_owned())]);
    }

    #[test]
    fn doubts_give_no_value() {
        for (text, key) in [
            ("a: 1\na: 2\n", "a"),
            ("<<: {a: 1}\nb: 2\n", "a"),
            ("<<: {a: 1}\nb: 2\n", "b"),
            ("x: &k a\n*k : 1\n", "a"),
            ("? [a]\n: 1\n", "a"),
            ("!!str a: 1\n", "a"),
            ("? |\n  a\n: 1\n", "a"),
            ("b: 1\nc: [\n", "a"),
            ("b: {a: 1\nc: 2\n", "c"),
        ] {
            let yaml = parse(text);
            assert_ne!(yaml.problems, [], "{text}");
            assert!(matches!(yaml.find(yaml.root().unwrap(), key), Lookup::Unknown(_)), "{text}");
        }
        // What is before an error is kept.
        let yaml = parse("a: 1\nb: [\n");
        assert!(matches!(yaml.find(yaml.root().unwrap(), "a"), Lookup::Found(_)));
        // A merge key in quotes is a key.
        assert_eq!(kinds("'<<': 1\n"), []);
    }

    #[test]
    fn texts_that_are_not_one_document_have_a_problem() {
        assert_eq!(kinds(""), []);
        assert_eq!(kinds("# nothing\n"), []);
        assert_eq!(kinds("---\na: 1\n...\n"), []);
        assert_eq!(kinds("a: 1\n---\nb: 2\n"), [FileProblemKind::SecondDocument]);
        for text in [
            "a: [1\n",
            "a: b: c\n",
            "a: 'x\n",
            "a: x\0y\n",
            "# \0\na: 1",
            "a: *x\n",
            "{",
            "- a\nb: 1\n",
            "a: \u{feff}\n@",
        ] {
            assert!(matches!(kinds(text)[..], [FileProblemKind::Syntax(_)]), "{text:?}");
        }
    }

    #[test]
    fn sizes_are_limited() {
        let nested = |depth: usize| format!("{}{}", "[".repeat(depth), "]".repeat(depth));
        assert_eq!(kinds(&nested(MAX_DEPTH)), []);
        assert_eq!(kinds(&nested(MAX_DEPTH + 1)), [FileProblemKind::TooDeep]);
        for open in ["[", "{", "- ", "a:\n ", "? ", "{a: ", "[[]"] {
            let start = Instant::now();
            assert_ne!(kinds(&open.repeat(200_000)), [], "{open}");
            assert!(start.elapsed() < Duration::from_secs(2), "{open}: {:?}", start.elapsed());
        }
        assert_eq!(kinds(&"- 1\n".repeat(MAX_NODES)), [FileProblemKind::TooLarge]);
        assert_eq!(parse(&"- 1\n".repeat(2 * MAX_NODES)).nodes().len(), MAX_NODES);
    }

    #[test]
    fn aliases_are_references() {
        let mut laughs = "a0: &a0 lol\n".to_owned();
        for level in 1..1000 {
            let of = vec![format!("*a{}", level - 1); 10].join(", ");
            laughs.push_str(&format!("a{level}: &a{level} [{of}]\n"));
        }
        let start = Instant::now();
        let yaml = parse(&laughs);
        assert!(start.elapsed() < Duration::from_secs(1));
        assert_eq!((yaml.problems.len(), yaml.nodes().len()), (0, 1 + 2 + 999 * 12));
        // A value that contains itself.
        let yaml = parse("a: &a\n  b: *a\n");
        assert!(matches!(yaml.find(yaml.root().unwrap(), "a.b.b.b.b"), Lookup::Found(_)));
        assert_eq!(yaml.find(yaml.root().unwrap(), "a.b.b.c"), Lookup::Absent);
    }

    /// Checks places: within the text, at characters, and within the collection around.
    fn check(text: &str) {
        let yaml = parse(text);
        let is_open = !yaml.problems.is_empty();
        for problem in &yaml.problems {
            assert!(text.get(problem.range.clone()).is_some());
        }
        for node in yaml.nodes() {
            assert!(text.get(node.range.clone()).is_some(), "{:?} of {text:?}", node.range);
            let inner: Vec<NodeId> = match &node.kind {
                NodeKind::Sequence { items, .. } => items.clone(),
                NodeKind::Mapping { entries, .. } => entries.iter().flat_map(|it| [it.0, it.1]).collect(),
                _ => Vec::new(),
            };
            for id in inner.into_iter().filter(|_| !is_open) {
                let inner = &yaml.node(id).range;
                assert!(
                    node.range.start <= inner.start && inner.end <= node.range.end,
                    "{inner:?} of {text:?}"
                );
            }
        }
    }

    const GOOD: &str = "\u{feff}# \u{e9}\r\na: &x {b: 1, \"c\": [2, 'd'], e: }\r\n- f: *x\n  g: |\n    h\n\n  i:\n  - !t j\n  - ? k\n    : l\n...\n%YAML 1.2\n---\n";

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn any_text_is_read(text in any::<String>()) {
            check(&text);
        }

        #[test]
        fn any_text_of_indicators_is_read(text in "[-a:1?,&*!|>'\"%@#{}\\[\\] \n\r\t\0\u{e9}\u{feff}\u{85}.~<]{0,60}") {
            check(&text);
        }

        #[test]
        fn damaged_files_are_read(
            from in 0..GOOD.chars().count(), length in 0_usize..9, with in "[-a:,&*{}\\[\\] \n]{0,4}", to in 0..GOOD.chars().count(),
        ) {
            let mut text: Vec<char> = GOOD.chars().collect();
            let cut: Vec<char> = text.drain(from..(from + length).min(text.len())).collect();
            text.splice(from..from, with.chars());
            let to = to.min(text.len());
            text.splice(to..to, cut);
            check(&text.into_iter().collect::<String>());
        }
    }
}
