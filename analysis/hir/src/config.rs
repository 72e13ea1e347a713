//! `mauve.toml`: the configuration of a workspace.

mod cpp;
pub mod keys;

use std::collections::BTreeMap;
use std::ops::Range;

use mauve_timing::{Level, Rounding, Time, TimeError};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use self::keys::{Entries, Key, Kind, REQUIRED_OF_OTHER, SECTIONS, SEVERITIES, Section};
use crate::completeness::Completeness;
use crate::item_tree::Name;
use crate::severity::Severity;

/// The content of a `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Config {
    /// `[project] root` or `roots`: paths from the configuration's folder.
    pub roots: Vec<(String, Range<usize>)>,
    /// `[timing] tables`: globs from the configuration's folder.
    pub tables: Vec<(String, Range<usize>)>,
    /// `[timing.deployment.…]`, by the name of the deployment: its own tables, instead of `tables`.
    pub deployment_tables: BTreeMap<String, DeploymentTables>,
    /// `[timing] significance`: the displayed and checked level.
    pub significance: Option<Level>,
    /// The range of the significance.
    pub significance_span: Option<Range<usize>>,
    /// `[assume] codel`: the execution time of a codel without an entry in the tables.
    pub assume: Option<Time>,
    /// `[platform] cpus`.
    pub cpus: Option<u32>,
    /// `[platform] rt_throttling`: whether Linux reserves 50 ms of each second for other tasks. If absent, it does not, and
    /// reports show this assumption.
    pub rt_throttling: Option<bool>,
    /// `[[platform.other]]`: real-time work that is not in the model.
    pub others: Vec<OtherConfig>,
    /// `[clocks] synchronised`: instances whose activities have one clock, with their ranges.
    pub synchronised: Vec<(String, Range<usize>)>,
    /// `[types.…]`: types that no message package declares.
    pub types: BTreeMap<Name, ExternalType>,
    /// `[generate] out`: the folder of the generated packages, from the configuration's folder.
    pub out: Option<(String, Range<usize>)>,
    /// `[generate] ros_streams`: whether outputs, and unconnected inputs, are also ROS topics. By default, they are.
    pub ros_streams: Option<bool>,
    /// `[generate] introspection`: whether generated components have ports with their state and execution times. By default,
    /// they have.
    pub introspection: Option<bool>,
    /// `[generate] maintainer` of the generated packages.
    pub maintainer: Option<Maintainer>,
    /// `[generate] license` of the generated packages.
    pub license: Option<String>,
    /// `[lints]`: the severity of each diagnostic, `None` to hide it, with the range of its code.
    pub lints: BTreeMap<String, (Option<Severity>, Range<usize>)>,
    /// `[deployment.…]`, by the name of the deployment.
    pub deployments: BTreeMap<String, DeploymentConfig>,
    /// `[chains]`: read, and not analysed.
    pub chains: Vec<Chain>,
    /// The errors.
    pub errors: Vec<Mistake>,
    /// Whether the values that response times depend on are known: a misplaced key may belong to a missing header.
    pub completeness: Completeness,
}

/// A C++ type that no message package declares.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ExternalType {
    /// Its name in C++, such as `ArRobot*`; empty if missing or invalid.
    pub cpp: String,
    /// The header that declares it, as in an `#include`.
    pub header: Option<String>,
}

/// `[deployment.Sea]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeploymentConfig {
    /// The range of its name.
    pub span: Range<usize>,
    /// `accept`: the instances whose deadlines need no proof.
    pub accepted: Vec<Acceptance>,
}

/// `[timing.deployment.Sea]`
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeploymentTables {
    /// The range of its name.
    pub span: Range<usize>,
    /// `tables`: globs from the configuration's folder.
    pub tables: Vec<(String, Range<usize>)>,
}

/// `[[platform.other]]`: an entry without errors has every value but the optional ones.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OtherConfig {
    /// Its name in reports.
    pub name: Option<String>,
    /// Its priority, 1 to 99.
    pub priority: Option<u32>,
    /// The least time between two of its releases, greater than 0.
    pub period: Option<Time>,
    /// The greatest execution time of a release.
    pub time: Option<Time>,
    /// The CPUs that it may run on, a bit each, with their range; if absent, all.
    pub cpus: Option<(u64, Range<usize>)>,
    /// The greatest delay of a release; if absent, 0.
    pub jitter: Option<Time>,
}

/// `planner = "measured by hand"`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Acceptance {
    /// The instance.
    pub instance: String,
    /// The range of the instance.
    pub span: Range<usize>,
    /// Why its deadline needs no proof; never empty.
    pub reason: String,
}

/// `Ada Lovelace <ada@example.org>`
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Maintainer {
    pub name: String,
    pub email: String,
}

/// An error in a `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// The kind.
    pub kind: MistakeKind,
    /// The range, in bytes.
    pub span: Range<usize>,
    /// A similar name that is valid there.
    pub near: Option<Name>,
}

/// The kinds of errors in a `mauve.toml`.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs, reason = "the documentation of a variant says what its fields are")]
pub enum MistakeKind {
    /// The file cannot be read, for this reason.
    Unreadable(String),
    /// The text is not TOML: the error of the parser.
    NotToml(String),
    /// A section has an unknown name; with the valid names.
    UnknownSection { section: String, expected: Vec<&'static str> },
    /// A key has an unknown name; with its section, such as `types.ArRobotPtr`, and the valid names there.
    UnknownKey { key: String, section: String, expected: Vec<&'static str> },
    /// A key is outside all sections.
    OutsideSections(String),
    /// The value of this key contains a string over several lines.
    SeveralLines(String),
    /// The section with this header lacks this key.
    MissingKey { key: &'static str, header: String },
    /// Two entries of this section have this name.
    RepeatedName { name: String, section: String },
    /// An entry names these CPUs, a bit each, and `[platform] cpus` has this many.
    NoSuchCpu { named: u64, cpus: u32 },
    /// The value of a key is invalid; with the valid values.
    WrongValue { key: String, expected: ExpectedValue },
}

/// The valid values of a key of `mauve.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExpectedValue {
    /// A path, or a list of paths.
    Paths,
    /// A list of paths with wildcards.
    PathPatterns,
    /// A list of instances.
    Instances,
    /// A significance level.
    Level,
    /// A time with its unit; with the error of an invalid time.
    Time(Option<TimeError>),
    /// A time greater than 0 with its unit; with the error of an invalid time.
    Period(Option<TimeError>),
    /// A list of CPUs, numbered from 1 to 64.
    Cpus,
    /// A list of tables, with the header of one.
    Tables,
    /// A name on one line, without a space in front.
    Name,
    /// An integer between two bounds, inclusive.
    Integer(u32, u32),
    /// `true` or `false`.
    Boolean,
    /// The path of a folder.
    Folder,
    /// A string.
    Text,
    /// A type in C++.
    CppType,
    /// A header, as in an `#include`.
    Header,
    /// The name and the address of a maintainer.
    Maintainer,
    /// The name of a licence.
    License,
    /// A section that declares a type.
    TypeSection,
    /// A section of a deployment.
    DeploymentSection,
    /// A section with the tables of a deployment.
    DeploymentTables,
    /// A table of instances, each with a reason.
    Reasons,
    /// A list of ports, for a chain.
    Ports,
    /// A severity, for a diagnostic.
    Severity,
}

/// `scan-to-wheels = ["hokuyo.scan", "guidance.command"]`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chain {
    /// Its name.
    pub name: String,
    /// The range of its name.
    pub span: Range<usize>,
    /// `instance.port`, each with its range.
    pub ends: Vec<(String, Range<usize>)>,
}

impl Config {
    /// Returns the patterns of all tables: of those for every deployment, then of those of single deployments.
    pub fn all_tables(&self) -> impl Iterator<Item = &(String, Range<usize>)> + Clone {
        self.tables.iter().chain(self.deployment_tables.values().flat_map(|it| &it.tables))
    }

    /// Returns the displayed level: `[timing] significance`, otherwise 10⁻⁴.
    pub fn level(&self) -> Level {
        self.significance.unwrap_or(Level::TEN_TO_MINUS_FOUR)
    }
}

/// Reads a `mauve.toml`. An error does not affect the other keys.
pub(crate) fn read(text: &str) -> Config {
    let mut config = Config::default();
    let mut reader = Reader { text, errors: Vec::new(), completeness: Completeness::Complete };
    match DeTable::parse(text) {
        Ok(document) => reader.document(&mut config, document.get_ref()),
        Err(error) => {
            let at = error.span().unwrap_or(0..text.len().min(1));
            reader.incomplete(MistakeKind::NotToml(error.message().to_owned()), at);
        }
    }
    Config { errors: reader.errors, completeness: reader.completeness, ..config }
}

struct Reader<'t> {
    text: &'t str,
    errors: Vec<Mistake>,
    completeness: Completeness,
}

type TomlKey<'a> = Spanned<std::borrow::Cow<'a, str>>;
type Value<'a> = Spanned<DeValue<'a>>;

impl Reader<'_> {
    /// Reports an error in a value that no response time depends on. A value over several lines may contain other keys.
    fn error(&mut self, kind: MistakeKind, at: Range<usize>) {
        self.completeness &= Completeness::of(!self.spans_lines(&at));
        self.errors.push(Mistake { kind, span: at, near: None });
    }

    fn spans_lines(&self, at: &Range<usize>) -> bool {
        self.text.get(at.clone()).is_some_and(|text| text.contains('\n'))
    }

    /// Returns the range of a string over several lines in a value.
    fn multiline_string(&self, value: &Value<'_>) -> Option<Range<usize>> {
        match value.get_ref() {
            DeValue::String(_) => Some(value.span()).filter(|span| self.spans_lines(span)),
            DeValue::Array(values) => values.iter().find_map(|value| self.multiline_string(value)),
            DeValue::Table(table) => table.iter().find_map(|(_, value)| self.multiline_string(value)),
            _ => None,
        }
    }

    /// Reports an error that may hide a value that increases response times.
    fn incomplete(&mut self, kind: MistakeKind, at: Range<usize>) {
        self.completeness = Completeness::Incomplete;
        self.error(kind, at);
    }

    /// Reports an invalid value of a key that response times may depend on.
    fn wrong_value(&mut self, key: &TomlKey<'_>, value: &Value<'_>, expected: ExpectedValue) {
        self.incomplete(MistakeKind::WrongValue { key: key.get_ref().to_string(), expected }, value.span());
    }

    /// Reports an unknown key or section, not in `expected`.
    fn unknown(&mut self, key: &TomlKey<'_>, known: impl Iterator<Item = &'static str>, kind: MistakeKind) {
        let near = mauve_syntax::similar(key.get_ref(), known).map(Name::from);
        self.errors.push(Mistake { kind, span: key.span(), near });
        self.completeness = Completeness::Incomplete;
    }

    fn document(&mut self, config: &mut Config, document: &DeTable<'_>) {
        for (key, value) in document {
            let name = key.get_ref();
            match (value.get_ref().as_table(), keys::section_named(name)) {
                (None, _) => self.incomplete(MistakeKind::OutsideSections(name.to_string()), key.span()),
                (_, None) => {
                    let known = || SECTIONS.iter().map(|section| section.name);
                    let (section, expected) = (name.to_string(), known().collect());
                    self.unknown(key, known(), MistakeKind::UnknownSection { section, expected });
                }
                (Some(values), Some(section)) => {
                    for (key, value) in values {
                        self.entry(config, section, key, value);
                    }
                }
            }
        }
        self.cpus_of_others(config);
    }

    fn entry(&mut self, config: &mut Config, section: &Section, key: &TomlKey<'_>, value: &Value<'_>) {
        if let Some(at) = self.multiline_string(value) {
            return self.incomplete(MistakeKind::SeveralLines(key.get_ref().to_string()), at);
        }
        match &section.entries {
            Entries::Keys(keys) => self.key(config, section.name, keys, key, value),
            Entries::Types(keys) => self.ty(config, keys, key, value),
            Entries::Deployments(keys) => self.deployment(config, keys, key, value),
            Entries::Chains => self.chain(config, key, value),
            Entries::Lints => self.lint(config, key, value),
        }
    }

    /// Reads the value of a key of `section`, which has `keys`.
    fn key<T>(&mut self, into: &mut T, section: &str, keys: &[Key<T>], key: &TomlKey<'_>, value: &Value<'_>) {
        let name = key.get_ref();
        let Some(found) = keys.iter().find(|key| key.name == name) else {
            let known = || keys.iter().map(|key| key.name);
            let (section, expected) = (section.to_owned(), known().collect());
            let kind = MistakeKind::UnknownKey { key: name.to_string(), section, expected };
            return self.unknown(key, known(), kind);
        };
        if let Kind::Others(field, keys, _) = &found.kind {
            return self.others(field(into), &format!("{section}.{name}"), keys, (key, value));
        }
        if let Kind::DeploymentTables(field, keys, _) = &found.kind {
            return self.deployment_tables(field(into), &format!("{section}.{name}"), keys, (key, value));
        }
        if let Err(expected) = found.kind.read(into, value) {
            // No response time depends on a string in a wrong format, nor on a missing root.
            self.completeness &= Completeness::of(match found.kind {
                Kind::Models(_) => true,
                Kind::Text { .. } => value.get_ref().is_str(),
                _ => false,
            });
            self.error(MistakeKind::WrongValue { key: name.to_string(), expected }, value.span());
        }
    }

    /// `[[platform.other]]`: every error leaves an unknown interference.
    fn others(
        &mut self,
        into: &mut Vec<OtherConfig>,
        section: &str,
        keys: &[Key<OtherConfig>],
        (key, value): (&TomlKey<'_>, &Value<'_>),
    ) {
        let Some(entries) = value.get_ref().as_array() else {
            return self.wrong_value(key, value, ExpectedValue::Tables);
        };
        for entry in entries.iter() {
            let Some(values) = entry.get_ref().as_table() else {
                self.wrong_value(key, entry, ExpectedValue::Tables);
                continue;
            };
            let mut other = OtherConfig::default();
            let errors = self.errors.len();
            for (key, value) in values {
                self.key(&mut other, section, keys, key, value);
            }
            // An unknown key may be a misspelt one.
            if self.errors.len() == errors
                && let Some(missing) = REQUIRED_OF_OTHER.into_iter().find(|&name| !values.contains_key(name))
            {
                let at = values.iter().next().map_or(entry.span(), |(key, _)| key.span());
                self.errors.push(Mistake {
                    kind: MistakeKind::MissingKey { key: missing, header: format!("[[{section}]]") },
                    span: at,
                    near: None,
                });
            }
            if let Some((name, at)) = other.name.as_ref().zip(values.get("name"))
                && into.iter().any(|known| known.name.as_ref() == Some(name))
            {
                let (name, section) = (name.clone(), section.to_owned());
                self.error(MistakeKind::RepeatedName { name, section }, at.span());
            }
            self.completeness &= Completeness::of(self.errors.len() == errors);
            into.push(other);
        }
    }

    /// `[timing.deployment.Sea]`: every error leaves the tables of a deployment unknown.
    fn deployment_tables(
        &mut self,
        into: &mut BTreeMap<String, DeploymentTables>,
        section: &str,
        keys: &[Key<DeploymentTables>],
        (key, value): (&TomlKey<'_>, &Value<'_>),
    ) {
        let Some(deployments) = value.get_ref().as_table() else {
            return self.wrong_value(key, value, ExpectedValue::DeploymentTables);
        };
        for (name, value) in deployments {
            let section = format!("{section}.{}", toml_key(name.get_ref()));
            let Some(values) = value.get_ref().as_table() else {
                self.wrong_value(name, value, ExpectedValue::DeploymentTables);
                continue;
            };
            let mut found = DeploymentTables { span: name.span(), ..DeploymentTables::default() };
            let errors = self.errors.len();
            for (key, value) in values {
                self.key(&mut found, &section, keys, key, value);
            }
            // An unknown key may be a misspelt one.
            if self.errors.len() == errors && !values.contains_key("tables") {
                let header = format!("[{section}]");
                self.incomplete(MistakeKind::MissingKey { key: "tables", header }, name.span());
            }
            into.insert(name.get_ref().to_string(), found);
        }
    }

    /// Reports CPUs of `[[platform.other]]` that `[platform] cpus` does not have.
    fn cpus_of_others(&mut self, config: &Config) {
        let Some(cpus @ ..64) = config.cpus else { return };
        for (named, span) in config.others.iter().filter_map(|other| other.cpus.clone()) {
            if named >> cpus != 0 {
                self.incomplete(MistakeKind::NoSuchCpu { named, cpus }, span);
            }
        }
    }

    /// `scan-to-wheels = ["hokuyo.scan", "guidance.command"]`
    fn chain(&mut self, config: &mut Config, key: &TomlKey<'_>, value: &Value<'_>) {
        let name = key.get_ref();
        let is_end = |(end, _): &(String, Range<usize>)| {
            let mut names = end.split('.');
            names.by_ref().take(2).all(|name| !name.is_empty()) && end.contains('.') && names.next().is_none()
        };
        // `tables = ["t.toml"]` has the form of a chain.
        let may_be_chain = value.get_ref().is_array() && keys::list_keys().all(|key| key != name);
        let ends = strings(value).filter(|ends| may_be_chain && ends.iter().all(is_end));
        match ends {
            Some(ends) => config.chains.push(Chain { name: name.to_string(), span: key.span(), ends }),
            None => self.wrong_value(key, value, ExpectedValue::Ports),
        }
    }

    /// `ArRobotPtr = { cpp = "ArRobot*", header = "Aria.h" }`
    fn ty(&mut self, config: &mut Config, keys: &[Key<ExternalType>], key: &TomlKey<'_>, value: &Value<'_>) {
        let name = key.get_ref();
        let Some(entries) = value.get_ref().as_table() else {
            return self.wrong_value(key, value, ExpectedValue::TypeSection);
        };
        let ty = config.types.entry(name.as_ref().into()).or_default();
        for (key, value) in entries {
            self.key(ty, &format!("types.{}", toml_key(name)), keys, key, value);
        }
    }

    /// `Sea.accept = { planner = "measured by hand" }`
    fn deployment(
        &mut self,
        config: &mut Config,
        keys: &[Key<DeploymentConfig>],
        key: &TomlKey<'_>,
        value: &Value<'_>,
    ) {
        let name = key.get_ref();
        let Some(entries) = value.get_ref().as_table() else {
            return self.wrong_value(key, value, ExpectedValue::DeploymentSection);
        };
        let deployment = config.deployments.entry(name.to_string()).or_default();
        deployment.span = key.span();
        for (key, value) in entries {
            self.key(deployment, &format!("deployment.{}", toml_key(name)), keys, key, value);
        }
    }

    /// `lost-write = "warn"`
    fn lint(&mut self, config: &mut Config, key: &TomlKey<'_>, value: &Value<'_>) {
        let name = key.get_ref();
        let severity = value.get_ref().as_str().and_then(|text| SEVERITIES.iter().find(|it| it.0 == text));
        let Some((_, severity)) = severity else {
            return self.wrong_value(key, value, ExpectedValue::Severity);
        };
        config.lints.insert(name.to_string(), (*severity, key.span()));
    }
}

impl<T> Kind<T> {
    /// Stores a value, or returns the valid values.
    fn read(&self, into: &mut T, value: &Value<'_>) -> Result<(), ExpectedValue> {
        let found = value.get_ref();
        let text = found.as_str();
        match self {
            Kind::Models(field) => field(into).extend(strings(value).ok_or(ExpectedValue::Paths)?),
            Kind::Tables(field) => field(into).extend(strings(value).ok_or(ExpectedValue::PathPatterns)?),
            Kind::Instances(field) => field(into).extend(strings(value).ok_or(ExpectedValue::Instances)?),
            Kind::Reasons(field) => {
                let reasons = found.as_table().ok_or(ExpectedValue::Reasons)?;
                for (instance, reason) in reasons {
                    let text = reason.get_ref().as_str().map(str::trim).filter(|text| !text.is_empty());
                    field(into).push(Acceptance {
                        instance: instance.get_ref().to_string(),
                        span: instance.span(),
                        reason: text.ok_or(ExpectedValue::Reasons)?.to_owned(),
                    });
                }
            }
            Kind::Level(store) => {
                let level = number(found).and_then(Level::from_f64);
                store(into, level.ok_or(ExpectedValue::Level)?, value.span());
            }
            Kind::Time(field) => {
                let text = text.ok_or(ExpectedValue::Time(None))?;
                let time = Time::parse_with_unit(text, Rounding::Up);
                *field(into) = Some(time.map_err(|error| ExpectedValue::Time(Some(error)))?);
            }
            Kind::Period(field) => {
                let text = text.ok_or(ExpectedValue::Period(None))?;
                let time = Time::parse_with_unit(text, Rounding::Exact);
                let time = time.map_err(|error| ExpectedValue::Period(Some(error)))?;
                *field(into) = Some(time).filter(|time| *time > Time::ZERO);
                field(into).ok_or(ExpectedValue::Period(None))?;
            }
            Kind::Cpus(field) => {
                let cpus = cpus(found).ok_or(ExpectedValue::Cpus)?;
                *field(into) = Some((cpus, value.span()));
            }
            // The reader reports the errors in these one by one.
            Kind::Others(..) => return Err(ExpectedValue::Tables),
            Kind::DeploymentTables(..) => return Err(ExpectedValue::DeploymentTables),
            Kind::Integer(from, to, field) => {
                let number = integer(found).filter(|it| (from..=to).contains(&it));
                *field(into) = Some(number.ok_or(ExpectedValue::Integer(*from, *to))?);
            }
            Kind::Boolean(field) => *field(into) = Some(found.as_bool().ok_or(ExpectedValue::Boolean)?),
            Kind::Folder(field) => {
                *field(into) = Some((text.ok_or(ExpectedValue::Folder)?.to_owned(), value.span()));
            }
            Kind::Text { store, expected, .. } => {
                store(into, text.ok_or(ExpectedValue::Text)?).ok_or(*expected)?;
            }
        }
        Ok(())
    }
}

/// Returns the strings of a string or a list of strings, with their ranges.
fn strings(value: &Value<'_>) -> Option<Vec<(String, Range<usize>)>> {
    let one = |value: &Value<'_>| Some((value.get_ref().as_str()?.to_owned(), value.span()));
    match value.get_ref() {
        DeValue::Array(values) => values.iter().map(one).collect(),
        _ => Some(vec![one(value)?]),
    }
}

/// Returns the CPUs in a list of numbers from 1 to 64, a bit each; `None` for an empty list.
fn cpus(value: &DeValue<'_>) -> Option<u64> {
    let bit = |number: u32| (1..=64).contains(&number).then(|| 1 << (number - 1));
    let numbers = value.as_array().filter(|numbers| !numbers.is_empty())?;
    numbers.iter().try_fold(0, |all, number| Some(all | bit(integer(number.get_ref())?)?))
}

fn integer(value: &DeValue<'_>) -> Option<u32> {
    value.as_integer().and_then(|it| u32::from_str_radix(it.as_str(), it.radix()).ok())
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    let text = match value {
        DeValue::Float(number) => number.as_str(),
        DeValue::Integer(number) => number.as_str(),
        _ => return None,
    };
    text.replace('_', "").parse().ok()
}

/// Returns whether the text is a valid path in an `#include <…>`, relative to the compiler's include folders.
fn is_header(text: &str) -> bool {
    let is_sign = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '+' | '.');
    let is_segment = |id: &str| !id.is_empty() && !id.starts_with(['.', '-']) && id.chars().all(is_sign);
    text.split('/').all(is_segment)
}

/// Parses `Ada Lovelace <ada@example.org>`.
fn maintainer_of(text: &str) -> Option<Maintainer> {
    let (name, rest) = text.trim().split_once('<')?;
    let (name, email) = (name.trim(), rest.strip_suffix('>')?.trim());
    let (user, host) = email.split_once('@')?;
    // The format that catkin requires.
    let are_labels = |text: &str, signs: &str| {
        let is_sign = |c: char| c.is_ascii_alphanumeric() || signs.contains(c);
        text.split('.').all(|id| !id.is_empty() && id.chars().all(is_sign))
    };
    let (_, domain) = host.rsplit_once('.')?;
    let is_domain = domain.len() > 1 && domain.chars().all(|c| c.is_ascii_alphabetic());
    let is_address = are_labels(user, "-_%+") && are_labels(host, "-") && is_domain;
    let is_valid = is_address && !name.is_empty() && !name.contains(char::is_control);
    is_valid.then(|| Maintainer { name: name.to_owned(), email: email.to_owned() })
}

/// Returns a name as a key of TOML.
///
/// ```
/// assert_eq!(mauve_hir::toml_key("Sea"), "Sea");
/// assert_eq!(mauve_hir::toml_key("boats.Sea"), r#""boats.Sea""#);
/// ```
pub fn toml_key(name: &str) -> String {
    let is_bare = |it: char| it.is_ascii_alphanumeric() || it == '_' || it == '-';
    match !name.is_empty() && name.chars().all(is_bare) {
        true => name.to_owned(),
        false => format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\"")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the errors in a text, and whether the configuration is incomplete.
    fn mistakes(text: &str) -> (Vec<MistakeKind>, bool) {
        let config = read(text);
        (config.errors.into_iter().map(|mistake| mistake.kind).collect(), config.completeness.is_incomplete())
    }

    #[test]
    fn reads_all_keys() {
        let config = read(
            "[project]\nroot = \"a.mal\"\n[timing]\ntables = [\"t/*.toml\"]\nsignificance = 1e-6\n[timing.deployment.D]\ntables = \"d.toml\"\n\
             [types.X]\ncpp = \"X*\"\nheader = \"x/X.h\"\n[generate]\nout = \"g\"\nros_streams = false\nlicense = \"BSD\"\n\
             maintainer = \"A B <a@b.org>\"\n[assume]\ncodel = \"5 ms\"\n[platform]\ncpus = 2\nrt_throttling = true\n\
             [clocks]\nsynchronised = [\"a\", \"b\"]\n[deployment.D]\naccept = { a = \" by hand \" }\n[chains]\nc = [\"a.x\"]\n[lints]\nlost-write = \"warn\"\n",
        );
        assert_eq!(config.errors, []);
        assert!(config.completeness.is_complete());
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
        assert_eq!(config.deployment_tables["D"].tables[0].0, "d.toml");
        assert_eq!(
            config.all_tables().map(|(pattern, _)| pattern).collect::<Vec<_>>(),
            ["t/*.toml", "d.toml"]
        );
        let [accepted] = config.deployments["D"].accepted.as_slice() else { panic!("one acceptance") };
        assert_eq!((accepted.instance.as_str(), accepted.reason.as_str()), ("a", "by hand"));
        assert_eq!(config.synchronised.iter().map(|(name, _)| name).collect::<Vec<_>>(), ["a", "b"]);
    }

    #[test]
    fn values_for_generated_code_are_valid() {
        for cpp in ["int; } evil", "X\n#include", "std::vector<int", "a>b<", "", "*", "x(\"y\")", "int x, y"]
        {
            let text = format!("[types.X]\ncpp = {cpp:?}\n");
            assert_eq!((mistakes(&text).0.len(), read(&text).types["X"].cpp.as_str()), (1, ""), "{cpp}");
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
                (mistakes(&text).0.len(), read(&text).types["X"].header.is_none()),
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
            let (found, is_incomplete) = mistakes(&format!("[generate]\nmaintainer = {maintainer:?}\n"));
            assert!(found.len() == 1 && !is_incomplete, "{maintainer:?}: {found:?}");
        }
        let text = "[types.X]\ncpp = \"std::map<int, const ns::T *>\"\n";
        assert_eq!(mistakes(text), (Vec::new(), false));
        for header in ["map", "a-b/c++/d_e.1.hpp"] {
            assert_eq!(mistakes(&format!("[types.X]\nheader = {header:?}\n")), (Vec::new(), false));
        }
    }

    #[test]
    fn what_may_hide_a_longer_time_makes_it_incomplete() {
        let (found, is_incomplete) = mistakes("[platfrm]\nrt_throttling = true\n");
        assert!(
            is_incomplete
                && matches!(found.as_slice(), [MistakeKind::UnknownSection { section, .. }] if section == "platfrm"),
            "{found:?}"
        );
        let text = "[platform]\ncpus = 0\n";
        let kind =
            MistakeKind::WrongValue { key: "cpus".to_owned(), expected: ExpectedValue::Integer(1, 64) };
        assert_eq!(mistakes(text), (vec![kind], true));
        assert_eq!(&text[read(text).errors[0].span.clone()], "0");
        let (found, is_incomplete) = mistakes("[timing\ntables = []\n");
        assert!(is_incomplete && found.len() == 1);
    }

    #[test]
    fn a_text_over_several_lines_may_have_swallowed_others() {
        for key in ["generate.out", "generate.license", "generate.maintainer", "project.root", "types.X.cpp"]
        {
            let text = format!("{key} = \"\"\"gen\n[platform]\nrt_throttling = true\n\"\"\"\n");
            let (found, is_incomplete) = mistakes(&text);
            assert!(is_incomplete && found.len() == 1, "{key}: {found:?}");
        }
        let (found, is_incomplete) = mistakes("project.roots = [\n\"a.mal\",\n5,\n]\n");
        assert!(is_incomplete && found.len() == 1, "{found:?}");
        assert_eq!(mistakes("project.roots = [\n\"a.mal\",\n\"b.mal\",\n]\n"), (Vec::new(), false));
    }

    #[test]
    fn other_real_time_work() {
        const LAN: &str =
            "[[platform.other]]\nname = \"lan\"\npriority = 50\nperiod = \"1 ms\"\ntime = \"50 us\"\n";
        let config = read(&format!("{LAN}cpus = [1, 3]\njitter = \"0.1 ms\"\n"));
        assert_eq!((config.errors, config.completeness), (Vec::new(), Completeness::Complete));
        let [other] = config.others.as_slice() else { panic!("one") };
        assert_eq!((other.name.as_deref(), other.priority), (Some("lan"), Some(50)));
        assert_eq!(other.cpus.as_ref().map(|(cpus, _)| *cpus), Some(0b101));
        let nanos = [other.period, other.time, other.jitter].map(|time| time.map(Time::as_nanos));
        assert_eq!(nanos, [Some(1_000_000), Some(50_000), Some(100_000)]);
        assert_eq!(read(LAN).others[0].cpus, None);
        // Whatever is wrong, an interference is unknown.
        for (old, new) in [
            ("name = \"lan\"\n", ""),
            ("priority = 50\n", ""),
            ("period = \"1 ms\"\n", ""),
            ("time = \"50 us\"\n", ""),
            ("\"lan\"", "\" \""),
            ("\"lan\"", "\"a\\u001bb\""),
            ("50\n", "0\n"),
            ("50\n", "100\n"),
            ("\"1 ms\"", "\"0 ms\""),
            ("\"1 ms\"", "1"),
            ("\"1 ms\"", "\"0.1 ns\""),
            ("\"50 us\"", "50"),
            ("time", "tiem"),
            ("[[platform.other]]", "[[platform.othr]]"),
            ("[[platform.other]]", "[platform.other]"),
            ("priority", "cpus = []\npriority"),
            ("priority", "cpus = [0]\npriority"),
            ("priority", "cpus = [65]\npriority"),
            ("priority", "cpus = 1\npriority"),
        ] {
            assert!(LAN.contains(old), "{old}");
            let (found, is_incomplete) = mistakes(&LAN.replacen(old, new, 1));
            assert!(is_incomplete && found.len() == 1, "{old:?} -> {new:?}: {found:?}");
        }
        let (found, is_incomplete) = mistakes(&format!("{LAN}{LAN}"));
        assert!(is_incomplete && matches!(found.as_slice(), [MistakeKind::RepeatedName { .. }]), "{found:?}");
        let (found, is_incomplete) = mistakes(&format!("platform.cpus = 2\n{LAN}cpus = [3]\n"));
        let kind = MistakeKind::NoSuchCpu { named: 4, cpus: 2 };
        assert_eq!((found, is_incomplete), (vec![kind], true));
        assert!(mistakes("platform.other = [1]").1 && mistakes("platform.other = 1").1);
    }

    #[test]
    fn tables_of_a_deployment() {
        // Whatever is wrong, a deployment would have the times of another computer.
        for text in [
            "[timing.deployment.D]\n",
            "[timing.deployment.D]\ntable = \"d.toml\"\n",
            "[timing.deployment.D]\ntables = 1\n",
            "[timing.deployment.D]\ntables = [1]\n",
            "[timing]\ndeployment = [\"d.toml\"]\n",
            "[timing.deployment]\nD = \"d.toml\"\n",
            "[timing.deployment.l.D]\ntables = \"d.toml\"\n",
            "[timing.deployments.D]\ntables = \"d.toml\"\n",
        ] {
            let (found, is_incomplete) = mistakes(text);
            assert!(is_incomplete && found.len() == 1, "{text}: {found:?}");
        }
        let text = "[timing.deployment.\"l.D\"]\ntables = []\n";
        assert_eq!(mistakes(text), (Vec::new(), false));
        assert_eq!(read(text).deployment_tables["l.D"].tables, []);
    }

    #[test]
    fn a_section_without_its_header_makes_it_incomplete() {
        for section in
            ["[project]", "[types.X]", "[generate]", "[lints]", "[chains]", "[clocks]", "[deployment.D]"]
        {
            for key in [
                "rt_throttling = true",
                "tables = [\"t.toml\"]",
                "codel = \"5 ms\"",
                "cpus = 1",
                "platform.rt_throttling = true",
                "x.rt_throttling = true",
                "cpp.x = 1",
            ] {
                let (found, is_incomplete) = mistakes(&format!("{section}\n{key}\n"));
                assert!(is_incomplete, "{section} {key}: {found:?}");
            }
        }
    }
}
