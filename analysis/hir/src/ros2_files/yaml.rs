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

/// The maximum number of values, keys included; and of values in the place of aliases.
const MAX_NODES: usize = 200_000;

/// The first document of a YAML file.
#[derive(Debug, Default)]
pub(super) struct Yaml {
    /// The keys and values in the order of the text; the value of the document is the first one.
    pub(super) nodes: Vec<YamlNode>,
    /// The problems of the text.
    pub(super) problems: Vec<FileProblem>,
}

/// The index of a key or a value in [`Yaml::nodes`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct NodeId(pub(super) usize);

/// A key or a value.
#[derive(Debug)]
pub(super) struct YamlNode {
    pub(super) kind: NodeKind,
    /// Its place, without its anchor and its tag. Empty for a value that is not written: behind the colon.
    pub(super) range: Range<usize>,
    /// Whether it has a tag, such as `!!str`.
    pub(super) is_tagged: bool,
    /// Whether it is a collection in brackets.
    pub(super) is_flow: bool,
    /// Whether the text ends, or has an error, within this collection.
    is_open: bool,
    /// The number of values in it, with values in the place of aliases.
    size: usize,
}

#[derive(Debug)]
pub(super) enum NodeKind {
    Scalar(String, ScalarStyle),
    Sequence(Vec<NodeId>),
    Mapping(Vec<[NodeId; 2]>),
    /// The value that it refers to, which is not an alias.
    Alias(NodeId),
}

/// What a mapping says of a key.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Lookup {
    Absent,
    /// Readers disagree because of this place, or the text has an error.
    Unknown(Range<usize>),
    Found(NodeId),
}

/// Parses the first document of a YAML file. The tree has the values before the first error.
pub(super) fn parse(text: &str) -> Yaml {
    let mut builder = Builder { text, ..Builder::default() };
    builder.yaml.nodes.reserve((text.len() / 16).min(MAX_NODES));
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
                let length = text.get(at..).and_then(|rest| rest.chars().next()).map_or(0, char::len_utf8);
                Err((FileProblemKind::Syntax(error.info().to_owned()), at..at + length))
            }
        };
        if let Err((kind, range)) = read {
            builder.yaml.problems.push(FileProblem { kind, range });
            break;
        }
    }
    let is_break = |c: char| matches!(c, '\u{85}' | '\u{2028}' | '\u{2029}');
    let is_alone = |at: usize| !text[at..].starts_with("\r\n");
    if let Some((at, it)) = text.match_indices(|c| c == '\r' || is_break(c)).find(|it| is_alone(it.0)) {
        let problem = FileProblem { kind: FileProblemKind::UncertainLines, range: at..at + it.len() };
        builder.yaml.problems.push(problem);
    }
    builder.yaml.check_keys();
    builder.yaml
}

impl Yaml {
    pub(super) fn root(&self) -> Option<NodeId> {
        (!self.nodes.is_empty()).then_some(NodeId(0))
    }

    pub(super) fn node(&self, id: NodeId) -> &YamlNode {
        &self.nodes[id.0]
    }

    pub(super) fn range(&self, id: NodeId) -> Range<usize> {
        self.node(id).range.clone()
    }

    /// Returns the value that an alias refers to; any other value itself.
    fn resolve(&self, id: NodeId) -> &YamlNode {
        match self.node(id).kind {
            NodeKind::Alias(target) => self.node(target),
            _ => self.node(id),
        }
    }

    /// Returns the keys and values of a mapping; `None` of any other value, and with a tag.
    pub(super) fn mapping(&self, id: NodeId) -> Option<&[[NodeId; 2]]> {
        match self.resolve(id) {
            YamlNode { kind: NodeKind::Mapping(entries), is_tagged: false, .. } => Some(entries),
            _ => None,
        }
    }

    /// Returns whether the text ends, or has an error, within this list or mapping.
    pub(super) fn is_open(&self, id: NodeId) -> bool {
        self.resolve(id).is_open
    }

    /// Returns the items of a list; `None` of any other value, and with a tag.
    pub(super) fn items(&self, id: NodeId) -> Option<&[NodeId]> {
        match self.resolve(id) {
            YamlNode { kind: NodeKind::Sequence(items), is_tagged: false, .. } => Some(items),
            _ => None,
        }
    }

    /// Returns the text of a scalar; `None` with a tag, and for a block scalar (`|`, `>`).
    pub(super) fn text(&self, id: NodeId) -> Option<&str> {
        match self.resolve(id) {
            YamlNode { kind: NodeKind::Scalar(text, style), is_tagged: false, .. } => {
                (!matches!(style, ScalarStyle::Literal | ScalarStyle::Folded)).then_some(text)
            }
            _ => None,
        }
    }

    /// Returns the text of a scalar without quotes.
    pub(super) fn plain(&self, id: NodeId) -> Option<&str> {
        let is_plain = matches!(self.resolve(id).kind, NodeKind::Scalar(_, ScalarStyle::Plain));
        self.text(id).filter(|_| is_plain)
    }

    /// Returns the text of a key; `None` for a key on which readers disagree.
    pub(super) fn key(&self, id: NodeId) -> Option<&str> {
        let is_alias = matches!(self.node(id).kind, NodeKind::Alias(_));
        self.text(id).filter(|_| !is_alias && self.plain(id) != Some("<<"))
    }

    /// Returns the value of a key of a mapping. `a.b` is also the value of `b` in the mapping `a`.
    pub(super) fn find(&self, mapping: NodeId, name: &str) -> Lookup {
        // The first one, and the last one of several.
        let mut found = [None; 2];
        let doubt = self.collect(mapping, name, &mut found);
        match (found, doubt) {
            ([None, _], None) => Lookup::Absent,
            ([None, _], Some((range, _))) => Lookup::Unknown(range),
            // An error behind the key does not concern it.
            ([Some(one), None], None | Some((_, true))) => Lookup::Found(one),
            ([Some(last), None] | [_, Some(last)], _) => Lookup::Unknown(self.range(last)),
        }
    }

    /// Collects the values of a name. Returns why there may be others, and whether the reason is the end of the text that is read.
    fn collect(
        &self,
        mapping: NodeId,
        name: &str,
        found: &mut [Option<NodeId>; 2],
    ) -> Option<(Range<usize>, bool)> {
        let Some(entries) = self.mapping(mapping) else { return Some((self.range(mapping), false)) };
        let mut doubt = self.resolve(mapping).is_open.then(|| (self.range(mapping), true));
        for &[key, value] in entries {
            let Some(text) = self.key(key) else {
                doubt = Some((self.range(key), false));
                continue;
            };
            let rest = name.strip_prefix(text);
            if rest == Some("") {
                found[usize::from(found[0].is_some())] = Some(value);
            } else if let Some(rest) = rest.and_then(|rest| rest.strip_prefix('.')) {
                let of_value = self.collect(value, rest, found);
                doubt = doubt.filter(|it| !it.1 || of_value.is_none()).or(of_value);
            }
        }
        doubt
    }

    /// Reports keys that a mapping has twice, and keys on which readers disagree.
    fn check_keys(&mut self) {
        let (mut problems, mut seen) = (Vec::new(), FxHashSet::default());
        for node in &self.nodes {
            let NodeKind::Mapping(entries) = &node.kind else { continue };
            seen.clear();
            for [key, _] in entries {
                let kind = match self.key(*key) {
                    None => FileProblemKind::UncertainKeys,
                    Some(text) if !seen.insert(text) => FileProblemKind::RepeatedKey(text.to_owned()),
                    Some(_) => continue,
                };
                problems.push(FileProblem { kind, range: self.range(*key) });
            }
        }
        self.problems.extend(problems);
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
    /// The number of values in the place of aliases.
    of_aliases: usize,
}

impl Builder<'_> {
    /// Returns the offset of a character by its index: the parser counts characters.
    fn offset(&self, index: usize) -> usize {
        let offset = if self.offsets.is_empty() { Some(&index) } else { self.offsets.get(index) };
        offset.map_or(self.text.len(), |it| *it.min(&self.text.len()))
    }

    fn range(&self, span: Span) -> Range<usize> {
        let start = self.offset(span.start.index());
        start..self.offset(span.end.index()).max(start)
    }

    fn event(&mut self, event: Event<'_>, span: Span) -> Result<(), (FileProblemKind, Range<usize>)> {
        let mut range = self.range(span);
        let (kind, anchor, tag) = match event {
            Event::Scalar(text, style, anchor, tag) => {
                (NodeKind::Scalar(text.into_owned(), style), anchor, tag)
            }
            Event::SequenceStart(anchor, tag) => (NodeKind::Sequence(Vec::new()), anchor, tag),
            Event::MappingStart(anchor, tag) => (NodeKind::Mapping(Vec::new()), anchor, tag),
            Event::Alias(anchor) => {
                // A value that contains itself has no size.
                let target = self.anchors.get(&anchor).filter(|it| !self.yaml.node(**it).is_open);
                let Some(target) = target else { return Err((FileProblemKind::TooLarge, range)) };
                self.of_aliases = self.of_aliases.saturating_add(self.yaml.node(*target).size);
                (NodeKind::Alias(*target), 0, None)
            }
            Event::SequenceEnd | Event::MappingEnd => {
                self.close(range.start);
                return Ok(());
            }
            _ => return Ok(()),
        };
        if self.yaml.nodes.len().max(self.of_aliases) >= MAX_NODES || self.open.len() >= MAX_DEPTH {
            return Err((FileProblemKind::TooLarge, range));
        }
        let has_properties = anchor > 0 || tag.is_some();
        if has_properties {
            range.start = self.after_properties(&range);
        }
        let source = self.text.get(range.clone()).unwrap_or_default();
        match &kind {
            NodeKind::Scalar(text, ScalarStyle::Plain) if text.is_empty() => {
                let start = if has_properties { range.start } else { self.place_of_empty(range.start) };
                range = start..start;
            }
            NodeKind::Scalar(_, ScalarStyle::SingleQuoted | ScalarStyle::DoubleQuoted) => {
                range.end = range.start + length_of_quoted(source);
            }
            NodeKind::Scalar(_, ScalarStyle::Plain) => range.end = range.start + source.trim_end().len(),
            NodeKind::Sequence(_) if !source.starts_with(['[', '-']) => {
                // A list without indentation has the place of its first item.
                let before = self.text.get(..range.start).unwrap_or_default().trim_end();
                if before.ends_with('-') {
                    range = before.len() - 1..before.len() - 1;
                }
            }
            _ => {}
        }
        let node = self.add(kind, range, tag.is_some());
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
    fn add(&mut self, kind: NodeKind, range: Range<usize>, is_tagged: bool) -> NodeId {
        let id = NodeId(self.yaml.nodes.len());
        if let Some((parent, key)) = self.open.last_mut() {
            match (&mut self.yaml.nodes[parent.0].kind, key.take()) {
                (NodeKind::Sequence(items), _) => items.push(id),
                (NodeKind::Mapping(entries), Some(key)) => entries.push([key, id]),
                _ => *key = Some(id),
            }
        }
        let is_open = matches!(kind, NodeKind::Sequence(_) | NodeKind::Mapping(_));
        // The parser gives a collection without brackets an empty place.
        let source = self.text.get(range.clone()).unwrap_or_default();
        let is_flow = is_open && source.starts_with(['[', '{']);
        let size = if let NodeKind::Alias(target) = kind { self.yaml.node(target).size } else { 1 };
        self.open.extend(is_open.then_some((id, None)));
        self.yaml.nodes.push(YamlNode { kind, range, is_tagged, is_flow, is_open, size });
        id
    }

    /// Closes the innermost collection: its end is that of its last value, or its bracket.
    fn close(&mut self, bracket: usize) {
        let Some((id, _)) = self.open.pop() else { return };
        let node = self.yaml.node(id);
        let inner = match &node.kind {
            NodeKind::Mapping(entries) => entries.as_flattened(),
            NodeKind::Sequence(items) => items,
            _ => &[],
        };
        let size = inner.iter().fold(1, |sum: usize, it| sum.saturating_add(self.yaml.node(*it).size));
        let last = inner.iter().rev().take(2).map(|it| self.yaml.node(*it).range.end).max();
        let end = if node.is_flow { bracket + 1 } else { last.unwrap_or(bracket) };
        let node = &mut self.yaml.nodes[id.0];
        node.range.end = end.clamp(node.range.start, self.text.len());
        (node.is_open, node.size) = (false, size);
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
        yaml.nodes.iter().map(|it| &text[it.range.clone()]).collect()
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
        let yaml = parse("[1]: 2\n{}: 3\n");
        assert_eq!(
            yaml.nodes.iter().map(|it| it.is_flow).collect::<Vec<_>>(),
            [false, true, false, false, true, false]
        );
        assert_eq!(yaml.nodes[0].range, 0..12);
        // A value that is not written is behind its colon, or behind its key.
        let yaml = parse("a: # c\nb: {c, d: , e:}\nf: &x\n? g\n");
        let empty = yaml.nodes.iter().filter(|it| it.range.is_empty()).map(|it| it.range.start);
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
        // Values before an error are kept.
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
        for text in ["a: 1 # \rb: 2\n", "a: '\u{85}'\n", "a: 1 # \u{2028}", "\r\r\n", "a: 1\r"] {
            assert_eq!(kinds(text), [FileProblemKind::UncertainLines], "{text:?}");
        }
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
        assert_eq!(kinds(&nested(MAX_DEPTH + 1)), [FileProblemKind::TooLarge]);
        for open in ["[", "{", "- ", "a:\n ", "? ", "{a: ", "[[]"] {
            let start = Instant::now();
            assert_ne!(kinds(&open.repeat(200_000)), [], "{open}");
            assert!(start.elapsed() < Duration::from_secs(2), "{open}: {:?}", start.elapsed());
        }
        assert_eq!(kinds(&"- 1\n".repeat(MAX_NODES)), [FileProblemKind::TooLarge]);
        assert_eq!(parse(&"- 1\n".repeat(2 * MAX_NODES)).nodes.len(), MAX_NODES);
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
        assert_eq!(yaml.problems.iter().map(|it| &it.kind).collect::<Vec<_>>(), [&FileProblemKind::TooLarge]);
        assert!(yaml.nodes.len() < 100);
        assert_eq!(kinds("a: &a [*a]\n"), [FileProblemKind::TooLarge]);
        let text = "a: &a {b: &b {c: 1}, d: *b}\ne: *a\n";
        let yaml = parse(text);
        let Lookup::Found(found) = yaml.find(yaml.root().unwrap(), "e.d.c") else { panic!("{yaml:?}") };
        assert_eq!((&text[yaml.range(found)], yaml.problems.len()), ("1", 0));
    }

    /// Checks places: within the text, at characters, and within the collection around.
    fn check(text: &str) {
        let yaml = parse(text);
        let is_open = !yaml.problems.is_empty();
        for problem in &yaml.problems {
            assert!(text.get(problem.range.clone()).is_some());
        }
        for node in &yaml.nodes {
            assert!(text.get(node.range.clone()).is_some(), "{:?} of {text:?}", node.range);
            let inner: Vec<NodeId> = match &node.kind {
                NodeKind::Sequence(items) => items.clone(),
                NodeKind::Mapping(entries) => entries.as_flattened().to_vec(),
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
