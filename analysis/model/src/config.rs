//! `mauve.toml`: what the user says about a workspace.

use std::collections::BTreeMap;
use std::ops::Range;

use mauve_timing::{Level, Rounding, Time};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

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
    /// `[types.…]`: types that no message package declares, and what they are in C++, where that is said.
    pub types: BTreeMap<Name, String>,
    /// `[generate] out`: the folder of the generated packages, from the configuration's folder.
    pub out: Option<(String, Range<usize>)>,
    /// `[lints]`: how bad a diagnostic is here; nothing where it is not shown.
    pub lints: BTreeMap<&'static str, Option<Severity>>,
    /// `[chains]`: named, and not analysed yet.
    pub chains: Vec<Chain>,
    /// What is wrong.
    pub errors: Vec<Mistake>,
    /// Was something lost that response times may rest on? Whatever is in the wrong place says that a header was lost.
    pub lost: bool,
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
    let mut reader = Reader { config: Config::default() };
    match DeTable::parse(text) {
        Ok(document) => reader.document(document.get_ref()),
        Err(error) => {
            let at = error.span().unwrap_or(0..text.len().min(1));
            reader.lost(error.message().to_owned(), at);
        }
    }
    reader.config
}

struct Reader {
    config: Config,
}

type Key<'a> = Spanned<std::borrow::Cow<'a, str>>;
type Value<'a> = Spanned<DeValue<'a>>;

impl Reader {
    fn error(&mut self, message: String, at: Range<usize>) {
        self.config.errors.push(Mistake { message, span: at, near: None });
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

    fn each(&mut self, section: &DeTable<'_>, read: fn(&mut Reader, &str, &Key<'_>, &Value<'_>)) {
        for (key, value) in section {
            read(self, key.get_ref(), key, value);
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
        let cpp = entries.get("cpp").and_then(|cpp| cpp.get_ref().as_str());
        self.config.types.insert(name.into(), cpp.unwrap_or_default().to_owned());
    }

    fn generate(&mut self, name: &str, key: &Key<'_>, value: &Value<'_>) {
        let text = value.get_ref().as_str();
        match name {
            "out" if text.is_some() => self.config.out = text.map(|text| (text.to_owned(), value.span())),
            "out" => self.lost("`out` is the path of a folder".to_owned(), value.span()),
            _ => {
                self.unknown(format!("key `{name}` in [generate]"), key, &["out"]);
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
             [types.X]\ncpp = \"X*\"\n[assume]\ncodel = \"5 ms\"\n[platform]\ncpus = 2\nrt_throttling = true\n\
             [clocks]\nsynchronised = [\"a\", \"b\"]\n[chains]\nc = [\"a.x\"]\n[lints]\nlost-write = \"warn\"\n",
        );
        assert_eq!(config.errors, []);
        assert!(!config.lost);
        assert_eq!(config.roots[0].0, "a.mal");
        assert_eq!(config.level().to_string(), "1e-6");
        assert_eq!(config.assume, Some(Time::from_nanos(5_000_000)));
        assert_eq!((config.cpus, config.rt_throttling), (Some(2), Some(true)));
        assert_eq!(config.synchronised.iter().map(|(name, _)| name).collect::<Vec<_>>(), ["a", "b"]);
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
