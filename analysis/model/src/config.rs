//! `mauve.toml`: what the user says about a workspace.

mod cpp;

use std::collections::BTreeMap;
use std::ops::Range;

use mauve_timing::{Level, Rounding, Time};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use self::cpp::is_cpp_type;
use crate::diagnostics::{Severity, codes};
use crate::item_tree::Name;

/// What `mauve.toml` says.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Config {
    /// `[project] root` or `roots`: paths from the configuration's folder.
    pub roots: Vec<(String, Range<usize>)>,
    /// `[timing] tables`: globs from the configuration's folder.
    pub tables: Vec<(String, Range<usize>)>,
    /// `[timing] significance`: the level that is shown and checked.
    pub significance: Option<Level>,
    /// Where that stands.
    pub significance_span: Option<Range<usize>>,
    /// `[assume] codel`: the time of a codel that no table has.
    pub assume: Option<Time>,
    /// `[platform] cpus`.
    pub cpus: Option<u32>,
    /// `[platform] rt_throttling`: Linux keeps 50 ms of each second from real-time tasks. Where it is not said: it does
    /// not, and that is shown as an assumption.
    pub rt_throttling: Option<bool>,
    /// `[clocks] synchronised`: instances that are released together, and where that is said.
    pub synchronised: Vec<(String, Range<usize>)>,
    /// `[types.…]`: types that no message package declares.
    pub types: BTreeMap<Name, ExternalType>,
    /// `[generate] out`: the folder of the generated packages, from the configuration's folder.
    pub out: Option<(String, Range<usize>)>,
    /// `[generate] ros_streams`: are outputs, and inputs that nothing is connected to, ROS topics too? Where it is not said, they are.
    pub ros_streams: Option<bool>,
    /// `[generate] introspection`: have generated components ports that show their state and their execution times? Where it is
    /// not said, they have.
    pub introspection: Option<bool>,
    /// `[generate] maintainer`: whom the generated packages name, and how to reach them.
    pub maintainer: Option<Maintainer>,
    /// `[generate] license` of the generated packages.
    pub license: Option<String>,
    /// `[lints]`: how bad a diagnostic is here; nothing where it is not shown.
    pub lints: BTreeMap<&'static str, Option<Severity>>,
    /// `[chains]`: named, and not analysed yet.
    pub chains: Vec<Chain>,
    /// What is wrong.
    pub errors: Vec<Mistake>,
    /// Was something lost that response times may rest on? Whatever is in the wrong place says that a header was lost.
    pub lost: bool,
}

/// A type of C++ that no message package declares.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ExternalType {
    /// What it is called in C++, such as `ArRobot*`; empty where that is not said, or is no type's name.
    pub cpp: String,
    /// The header that declares it, as an `#include` names it.
    pub header: Option<String>,
}

/// `Ada Lovelace <ada@example.org>`
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Maintainer {
    pub name: String,
    pub email: String,
}

/// Something wrong in a `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// What is wrong.
    pub message: String,
    /// Where.
    pub span: Range<usize>,
    /// What may have been meant there.
    pub near: Option<Name>,
}

/// `scan-to-wheels = ["hokuyo.scan", "guidance.command"]`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chain {
    /// Its name.
    pub name: String,
    /// Where that stands.
    pub span: Range<usize>,
    /// `instance.port`, each with its place.
    pub ends: Vec<(String, Range<usize>)>,
}

impl Config {
    /// The level that is shown: `[timing] significance`, otherwise 10⁻⁴.
    pub fn level(&self) -> Level {
        self.significance.unwrap_or(Level::TEN_TO_MINUS_FOUR)
    }
}

/// Reads a `mauve.toml`. Whatever is wrong in it is an error at its place, and the rest is read all the same.
pub(crate) fn read(text: &str) -> Config {
    let mut reader = Reader { config: Config::default(), text };
    match DeTable::parse(text) {
        Ok(document) => reader.document(document.get_ref()),
        Err(error) => {
            let at = error.span().unwrap_or(0..text.len().min(1));
            reader.lost(error.message().to_owned(), at);
        }
    }
    reader.config
}

struct Reader<'t> {
    config: Config,
    text: &'t str,
}

type Key<'a> = Spanned<std::borrow::Cow<'a, str>>;
type Value<'a> = Spanned<DeValue<'a>>;

impl Reader<'_> {
    /// An error in a value that no response time rests on; but one over several lines may have swallowed others.
    fn error(&mut self, message: String, at: Range<usize>) {
        self.config.lost |= self.spans_lines(&at);
        self.config.errors.push(Mistake { message, span: at, near: None });
    }

    fn spans_lines(&self, at: &Range<usize>) -> bool {
        self.text.get(at.clone()).is_some_and(|text| text.contains('\n'))
    }

    /// Where a value has a text over several lines.
    fn long_text(&self, value: &Value<'_>) -> Option<Range<usize>> {
        match value.get_ref() {
            DeValue::String(_) => Some(value.span()).filter(|span| self.spans_lines(span)),
            DeValue::Array(values) => values.iter().find_map(|value| self.long_text(value)),
            DeValue::Table(table) => table.iter().find_map(|(_, value)| self.long_text(value)),
            _ => None,
        }
    }

    /// An error that may hide something that makes response times longer.
    fn lost(&mut self, message: String, at: Range<usize>) {
        self.config.lost = true;
        self.error(message, at);
    }

    /// A key or a section that is none of those that are `known`.
    fn unknown(&mut self, what: String, key: &Key<'_>, known: &[&str]) {
        let near = mauve_syntax::similar(key.get_ref(), known.iter().copied()).map(Name::from);
        let expected = match known {
            [rest @ .., last] if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            _ => known.concat(),
        };
        let message = format!("unknown {what}: expected {expected}");
        self.config.errors.push(Mistake { message, span: key.span(), near });
        self.config.lost = true;
    }

    fn document(&mut self, document: &DeTable<'_>) {
        for (key, value) in document {
            let Some(section) = value.get_ref().as_table() else {
                self.lost(
                    format!("unknown key `{}`: expected a section such as `[timing]`", key.get_ref()),
                    key.span(),
                );
                continue;
            };
            match key.get_ref().as_ref() {
                "project" => self.each(section, Reader::project),
                "timing" => self.each(section, Reader::timing),
                "assume" => self.each(section, Reader::assume),
                "platform" => self.each(section, Reader::platform),
                "clocks" => self.each(section, Reader::clocks),
                "chains" => self.each(section, Reader::chain),
                "types" => self.each(section, Reader::ty),
                "generate" => self.each(section, Reader::generate),
                "lints" => self.each(section, Reader::lint),
                name => {
                    let known = [
                        "project", "timing", "types", "generate", "lints", "assume", "platform", "clocks",
                        "chains",
                    ];
                    self.unknown(format!("section `[{name}]`"), key, &known);
                }
            }
        }
    }

    fn each(&mut self, section: &DeTable<'_>, read: fn(&mut Self, &str, &Key<'_>, &Value<'_>)) {
        for (key, value) in section {
            match self.long_text(value) {
                Some(at) => {
                    let message = format!(
                        "a text in `{}` spans several lines, and may contain other keys: write it on one line",
                        key.get_ref()
                    );
                    self.lost(message, at);
                }
                None => read(self, key.get_ref(), key, value),
            }
        }
    }

    fn project(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        match name {
            "root" | "roots" => match strings(value) {
                Some(roots) => self.config.roots.extend(roots),
                None => self.error(format!("`{name}` is a path, or a list of paths"), value.span()),
            },
            _ => {
                self.unknown(format!("key `{name}` in [project]"), key, &["root", "roots"]);
            }
        }
    }

    fn timing(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        match name {
            "tables" => match strings(value) {
                Some(tables) => self.config.tables.extend(tables),
                None => self.lost("`tables` is a list of paths, which may have `*`".to_owned(), value.span()),
            },
            "significance" => match number(value).and_then(Level::from_f64) {
                Some(level) => {
                    self.config.significance = Some(level);
                    self.config.significance_span = Some(value.span());
                }
                None => {
                    self.lost(
                        "`significance` is a number between 0 and 1, such as 1e-4".to_owned(),
                        value.span(),
                    );
                }
            },
            _ => {
                self.unknown(format!("key `{name}` in [timing]"), key, &["tables", "significance"]);
            }
        }
    }

    fn assume(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        if name != "codel" {
            self.unknown(format!("key `{name}` in [assume]"), key, &["codel"]);
            return;
        }
        let time = value.get_ref().as_str().map(|text| Time::parse_with_unit(text, Rounding::Up));
        match time {
            Some(Ok(time)) => self.config.assume = Some(time),
            Some(Err(error)) => {
                self.lost(format!("`codel` is a time such as \"5 ms\": {error}"), value.span())
            }
            None => self.lost("`codel` is a time with its unit, such as \"5 ms\"".to_owned(), value.span()),
        }
    }

    fn platform(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        match name {
            "cpus" => match value
                .get_ref()
                .as_integer()
                .and_then(|it| u32::from_str_radix(it.as_str(), it.radix()).ok())
            {
                Some(cpus @ 1..=64) => self.config.cpus = Some(cpus),
                _ => self.lost("`cpus` is a whole number from 1 to 64".to_owned(), value.span()),
            },
            "rt_throttling" => match value.get_ref().as_bool() {
                Some(throttling) => self.config.rt_throttling = Some(throttling),
                None => self.lost("`rt_throttling` is true or false".to_owned(), value.span()),
            },
            _ => {
                self.unknown(format!("key `{name}` in [platform]"), key, &["cpus", "rt_throttling"]);
            }
        }
    }

    /// `scan-to-wheels = ["hokuyo.scan", "guidance.command"]`
    fn chain(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        let is_end = |(end, _): &(String, Range<usize>)| {
            let mut parts = end.split('.');
            parts.by_ref().take(2).all(|part| !part.is_empty()) && end.contains('.') && parts.next().is_none()
        };
        // `tables = ["t.toml"]` looks like one.
        let may_be_chain = !matches!(name, "tables" | "root" | "roots" | "synchronised");
        let ends = strings(value).filter(|_| may_be_chain && value.get_ref().is_array());
        match ends.filter(|ends| ends.iter().all(is_end)) {
            Some(ends) => self.config.chains.push(Chain { name: name.to_owned(), span: key.span(), ends }),
            None => {
                let message =
                    format!("`{name}` is a list of ports, such as [\"hokuyo.scan\", \"guidance.command\"]");
                self.lost(message, value.span());
            }
        }
    }

    /// `ArRobotPtr = { cpp = "ArRobot*", header = "Aria.h" }`
    fn ty(&mut self, name: &str, _: &Key<'_>, value: &Value<'_>) {
        let Some(entries) = value.get_ref().as_table() else {
            let message = format!("`{name}` is a section: `[types.{name}]` with `cpp` and `header`");
            self.lost(message, value.span());
            return;
        };
        for (key, value) in entries {
            let known = matches!(key.get_ref().as_ref(), "cpp" | "header");
            if !known {
                self.unknown(format!("key `{}` in [types.{name}]", key.get_ref()), key, &["cpp", "header"]);
            } else if !value.get_ref().is_str() {
                self.lost(format!("`{}` is a text", key.get_ref()), value.span());
            }
        }
        let mut text = |key: &str, fits: fn(&str) -> bool, what: &str| {
            let value = entries.get(key)?;
            let text = value.get_ref().as_str()?;
            if fits(text) {
                return Some(text.to_owned());
            }
            self.error(format!("`{key}` is {what}"), value.span());
            None
        };
        let cpp = text("cpp", is_cpp_type, "a type in C++ and nothing else, such as \"ArRobot*\"");
        let header = text(
            "header",
            is_header,
            "a header as an #include names it, such as \"Aria/Aria.h\": a relative path, no part of which begins with \
             `.` or `-`",
        );
        self.config.types.insert(name.into(), ExternalType { cpp: cpp.unwrap_or_default(), header });
    }

    fn generate(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        let text = value.get_ref().as_str();
        match name {
            "out" if text.is_some() => self.config.out = text.map(|text| (text.to_owned(), value.span())),
            "out" => self.lost("`out` is the path of a folder".to_owned(), value.span()),
            "ros_streams" => match value.get_ref().as_bool() {
                Some(streams) => self.config.ros_streams = Some(streams),
                None => self.lost("`ros_streams` is true or false".to_owned(), value.span()),
            },
            "introspection" => match value.get_ref().as_bool() {
                Some(introspection) => self.config.introspection = Some(introspection),
                None => self.lost("`introspection` is true or false".to_owned(), value.span()),
            },
            "maintainer" => match text.map(maintainer_of) {
                Some(Some(maintainer)) => self.config.maintainer = Some(maintainer),
                Some(None) => self.error(
                    "`maintainer` is a name and an address, such as \"Ada Lovelace <ada@example.org>\""
                        .to_owned(),
                    value.span(),
                ),
                None => self.lost("`maintainer` is a text".to_owned(), value.span()),
            },
            "license" => match text {
                Some(license) if !license.trim().is_empty() => self.config.license = Some(license.to_owned()),
                Some(_) => self.error("`license` names a licence, such as \"BSD\"".to_owned(), value.span()),
                None => self.lost("`license` is a text".to_owned(), value.span()),
            },
            _ => {
                let known = ["out", "ros_streams", "introspection", "maintainer", "license"];
                self.unknown(format!("key `{name}` in [generate]"), key, &known);
            }
        }
    }

    /// `lost-write = "warn"`
    fn lint(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        let severity = match value.get_ref().as_str() {
            Some("allow") => None,
            Some("hint") => Some(Severity::Hint),
            Some("warn") => Some(Severity::Warning),
            Some("error") => Some(Severity::Error),
            _ => {
                let message = format!("`{name}` in [lints] is \"allow\", \"hint\", \"warn\" or \"error\"");
                self.lost(message, value.span());
                return;
            }
        };
        match codes().find(|code| code.name == name) {
            Some(code) => {
                self.config.lints.insert(code.name, severity);
            }
            None => {
                let near = mauve_syntax::similar(name, codes().map(|code| code.name)).map(Name::from);
                let message = format!("no diagnostic `{name}` (`mauve explain all` lists them)");
                self.config.errors.push(Mistake { message, span: key.span(), near });
            }
        }
    }

    fn clocks(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        match (name, strings(value)) {
            ("synchronised", Some(instances)) => {
                self.config.synchronised.extend(instances);
            }
            ("synchronised", None) => {
                self.lost("`synchronised` is a list of instances".to_owned(), value.span())
            }
            _ => self.unknown(format!("key `{name}` in [clocks]"), key, &["synchronised"]),
        }
    }
}

/// A string, or a list of them, with their places.
fn strings(value: &Value<'_>) -> Option<Vec<(String, Range<usize>)>> {
    let one = |value: &Value<'_>| Some((value.get_ref().as_str()?.to_owned(), value.span()));
    match value.get_ref() {
        DeValue::Array(values) => values.iter().map(one).collect(),
        _ => Some(vec![one(value)?]),
    }
}

fn number(value: &Value<'_>) -> Option<f64> {
    let text = match value.get_ref() {
        DeValue::Float(number) => number.as_str(),
        DeValue::Integer(number) => number.as_str(),
        _ => return None,
    };
    text.replace('_', "").parse().ok()
}

/// May this stand between the brackets of an `#include`, and name a file that the compiler looks for in its own folders?
fn is_header(text: &str) -> bool {
    let is_sign = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '+' | '.');
    let is_part = |part: &str| !part.is_empty() && !part.starts_with(['.', '-']) && part.chars().all(is_sign);
    text.split('/').all(is_part)
}

/// `Ada Lovelace <ada@example.org>`
fn maintainer_of(text: &str) -> Option<Maintainer> {
    let (name, rest) = text.trim().split_once('<')?;
    let (name, email) = (name.trim(), rest.strip_suffix('>')?.trim());
    let (user, host) = email.split_once('@')?;
    // As the tools of catkin want it.
    let are_parts = |text: &str, signs: &str| {
        let is_sign = |c: char| c.is_ascii_alphanumeric() || signs.contains(c);
        text.split('.').all(|part| !part.is_empty() && part.chars().all(is_sign))
    };
    let (_, end) = host.rsplit_once('.')?;
    let is_end = end.len() > 1 && end.chars().all(|c| c.is_ascii_alphabetic());
    let is_address = are_parts(user, "-_%+") && are_parts(host, "-") && is_end;
    let is_good = is_address && !name.is_empty() && !name.contains(char::is_control);
    is_good.then(|| Maintainer { name: name.to_owned(), email: email.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(text: &str) -> (Vec<String>, bool) {
        let config = read(text);
        let show = |it: &Mistake| format!("{:?}: {}", &text[it.span.clone()], it.message);
        (config.errors.iter().map(show).collect(), config.lost)
    }

    #[test]
    fn everything_that_is_known() {
        let config = read(
            "[project]\nroot = \"a.mal\"\n[timing]\ntables = [\"t/*.toml\"]\nsignificance = 1e-6\n\
             [types.X]\ncpp = \"X*\"\nheader = \"x/X.h\"\n[generate]\nout = \"g\"\nros_streams = false\nlicense = \"BSD\"\n\
             maintainer = \"A B <a@b.org>\"\n[assume]\ncodel = \"5 ms\"\n[platform]\ncpus = 2\nrt_throttling = true\n\
             [clocks]\nsynchronised = [\"a\", \"b\"]\n[chains]\nc = [\"a.x\"]\n[lints]\nlost-write = \"warn\"\n",
        );
        assert_eq!(config.errors, []);
        assert!(!config.lost);
        assert_eq!(config.roots[0].0, "a.mal");
        assert_eq!(config.level().to_string(), "1e-6");
        assert_eq!(config.assume, Some(Time::from_nanos(5_000_000)));
        assert_eq!((config.cpus, config.rt_throttling), (Some(2), Some(true)));
        let ExternalType { cpp, header } = &config.types["X"];
        assert_eq!((cpp.as_str(), header.as_deref()), ("X*", Some("x/X.h")));
        assert_eq!((config.ros_streams, config.license.as_deref()), (Some(false), Some("BSD")));
        assert_eq!(
            config.maintainer,
            Some(Maintainer { name: "A B".to_owned(), email: "a@b.org".to_owned() })
        );
        assert_eq!(config.synchronised.iter().map(|(name, _)| name).collect::<Vec<_>>(), ["a", "b"]);
    }

    #[test]
    fn what_goes_into_generated_code_is_what_it_says_it_is() {
        for cpp in ["int; } evil", "X\n#include", "std::vector<int", "a>b<", "", "*", "x(\"y\")", "int x, y"]
        {
            let text = format!("[types.X]\ncpp = {cpp:?}\n");
            assert_eq!((messages(&text).0.len(), read(&text).types["X"].cpp.as_str()), (1, ""), "{cpp}");
        }
        for header in [
            "a.h>\n#error",
            "\"",
            "",
            "a b.h",
            "/etc/passwd",
            "../a.h",
            "a/../b.h",
            "./a.h",
            "a//b.h",
            "a/",
            "-a.h",
        ] {
            let text = format!("[types.X]\nheader = {header:?}\n");
            assert_eq!(
                (messages(&text).0.len(), read(&text).types["X"].header.is_none()),
                (1, true),
                "{header}"
            );
        }
        for maintainer in [
            "",
            "a@b.org",
            "A <a@b>",
            "A <a@b.c>",
            "A <a<b@c.org>",
            "A\n<a@b.org>B",
            "A <a..b@c.org>",
            "A <a@b.1x>",
        ] {
            let (found, lost) = messages(&format!("[generate]\nmaintainer = {maintainer:?}\n"));
            assert!(found.len() == 1 && !lost, "{maintainer:?}: {found:?}");
        }
        let text = "[types.X]\ncpp = \"std::map<int, const ns::T *>\"\n";
        assert_eq!(messages(text), (Vec::new(), false));
        for header in ["map", "a-b/c++/d_e.1.hpp"] {
            assert_eq!(messages(&format!("[types.X]\nheader = {header:?}\n")), (Vec::new(), false));
        }
    }

    #[test]
    fn what_may_hide_a_longer_time_is_lost() {
        let (found, lost) = messages("[platfrm]\nrt_throttling = true\n");
        assert!(lost && found[0].starts_with("\"platfrm\": unknown section `[platfrm]`"), "{found:?}");
        let (found, lost) = messages("[platform]\ncpus = 0\n");
        assert_eq!((found, lost), (vec!["\"0\": `cpus` is a whole number from 1 to 64".to_owned()], true));
        let (found, lost) = messages("[timing\ntables = []\n");
        assert!(lost && found.len() == 1);
    }

    #[test]
    fn a_text_over_several_lines_may_have_swallowed_others() {
        for key in ["generate.out", "generate.license", "generate.maintainer", "project.root", "types.X.cpp"]
        {
            let text = format!("{key} = \"\"\"gen\n[platform]\nrt_throttling = true\n\"\"\"\n");
            let (found, lost) = messages(&text);
            assert!(lost && found.len() == 1, "{key}: {found:?}");
        }
        let (found, lost) = messages("project.roots = [\n\"a.mal\",\n5,\n]\n");
        assert!(lost && found.len() == 1, "{found:?}");
        assert_eq!(messages("project.roots = [\n\"a.mal\",\n\"b.mal\",\n]\n"), (Vec::new(), false));
    }

    #[test]
    fn a_section_that_lost_its_header_is_lost() {
        for section in ["[project]", "[types.X]", "[generate]", "[lints]", "[chains]", "[clocks]"] {
            for key in [
                "rt_throttling = true",
                "tables = [\"t.toml\"]",
                "codel = \"5 ms\"",
                "cpus = 1",
                "platform.rt_throttling = true",
                "x.rt_throttling = true",
                "cpp.x = 1",
            ] {
                let (found, lost) = messages(&format!("{section}\n{key}\n"));
                assert!(lost, "{section} {key}: {found:?}");
            }
        }
    }
}
