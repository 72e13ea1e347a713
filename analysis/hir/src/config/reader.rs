//! Reads a `mauve.toml`.

use std::collections::BTreeMap;
use std::ops::Range;

use mauve_timing::{CpuSet, Level, Protocol, Rounding, Time, TimeError, Unit};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::keys::{
    self, BESIDE_PERIOD, BESIDE_SIGNIFICANCE, CPU_LIST, Entries, Key, KeyKind, OLD_CHAIN, REQUIRED_OF_LOCK,
    REQUIRED_OF_OTHER, SECTIONS, SEVERITIES, Section,
};
use super::{
    Acceptance, Chain, ClockConfig, Config, CpuSetConfig, DeploymentTables, HostConfig, LinkConfig, Located,
    LockConfig, Mistake, MistakeKind, OtherConfig, Required, TopicConfig, toml_key,
};
use crate::completeness::Completeness;
use crate::item_tree::Name;
use crate::severity::Severity;

/// Reads a `mauve.toml`. An error does not affect the other keys.
pub(crate) fn read(text: &str) -> Config {
    let mut config = Config::default();
    let mut reader = ConfigReader { text, errors: Vec::new(), completeness: Completeness::Complete };
    match DeTable::parse(text) {
        Ok(document) => reader.document(&mut config, document.get_ref()),
        Err(error) => {
            for (at, names) in mauve_syntax::conflicts(text) {
                reader.incomplete(MistakeKind::Conflict(names), at);
            }
            let at = error.span().unwrap_or(0..text.len().min(1));
            if reader.errors.is_empty() {
                reader.incomplete(MistakeKind::NotToml(error.message().to_owned()), at);
            }
        }
    }
    Config { errors: reader.errors, completeness: reader.completeness, ..config }
}

struct ConfigReader<'t> {
    text: &'t str,
    errors: Vec<Mistake>,
    completeness: Completeness,
}

type TomlKey<'a> = Spanned<std::borrow::Cow<'a, str>>;
type Value<'a> = Spanned<DeValue<'a>>;

impl ConfigReader<'_> {
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
    fn wrong_value(&mut self, key: &str, at: Range<usize>, expected: impl Into<String>) {
        let (key, expected) = (key.to_owned(), expected.into());
        self.incomplete(MistakeKind::WrongValue { key, expected, error: None }, at);
    }

    /// Reports a section that lacks a key. With an error since there were `errors`, it lacks none: an unknown key may be a
    /// misspelt one.
    fn missing_key(&mut self, errors: usize, key: Option<&'static str>, header: String, at: Range<usize>) {
        if let Some(key) = key.filter(|_| self.errors.len() == errors) {
            self.incomplete(MistakeKind::MissingKey { key, header }, at);
        }
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
                    if section.name == "ros2" {
                        config.ros2.get_or_insert_default().span = key.span();
                    }
                    for (key, value) in values {
                        self.entry(config, section, key, value);
                    }
                }
            }
        }
        self.cpus_of_others(config);
        if let Some(required) = config.required.as_ref().filter(|_| config.significance.is_some()) {
            self.wrong_value("required", required.span.clone(), BESIDE_SIGNIFICANCE);
        }
        let mut seen = BTreeMap::new();
        for (clock, (instance, span)) in config.on_clocks() {
            if *seen.entry(instance).or_insert(clock) != clock {
                self.incomplete(MistakeKind::SecondClock(instance.clone()), span.clone());
            }
        }
    }

    fn entry(&mut self, config: &mut Config, section: &Section, key: &TomlKey<'_>, value: &Value<'_>) {
        if let Some(at) = self.multiline_string(value) {
            return self.incomplete(MistakeKind::SeveralLines(key.get_ref().to_string()), at);
        }
        let name = key.get_ref();
        let header = || format!("{}.{}", section.name, toml_key(name));
        let wrong = || section.entries.expected(section.name, name);
        match (&section.entries, value.get_ref().as_table()) {
            (Entries::Keys(keys), _) => self.key(config, section.name, keys, key, value),
            (Entries::Clocks(known, keys), Some(entries)) if known.iter().all(|it| it.name != name) => {
                let mut clock =
                    ClockConfig { name: name.to_string(), span: key.span(), ..ClockConfig::default() };
                self.keys(&mut clock, &header(), keys, entries);
                let missing = Some("instances").filter(|it| !entries.contains_key(*it));
                self.missing_key(self.errors.len(), missing, format!("[{}]", header()), key.span());
                config.clocks.push(clock);
            }
            (Entries::Clocks(keys, _), _) => self.key(config, section.name, keys, key, value),
            (Entries::Types(keys), Some(entries)) => {
                let ty = config.types.entry(name.as_ref().into()).or_default();
                self.keys(ty, &header(), keys, entries);
            }
            (Entries::Deployments(keys), Some(entries)) => {
                let deployment = config.deployments.entry(name.to_string()).or_default();
                deployment.span = key.span();
                self.keys(deployment, &header(), keys, entries);
            }
            (Entries::Locks(keys), Some(entries)) => self.lock(config, &header(), keys, key, entries),
            (Entries::Hosts(keys), Some(entries)) => {
                let (name, span) = (name.to_string(), key.span());
                let mut host = HostConfig { name, span, ..HostConfig::default() };
                self.keys(&mut host, &header(), keys, entries);
                config.hosts.push(host);
            }
            (Entries::Links(keys), Some(entries)) => {
                let (name, span) = (name.to_string(), key.span());
                let mut link = LinkConfig { name, span, ..LinkConfig::default() };
                self.keys(&mut link, &header(), keys, entries);
                config.links.push(link);
            }
            (Entries::Chains(keys), Some(entries)) => {
                config.chains.push(self.chain(&header(), keys, key, entries));
            }
            (Entries::Chains(keys), None) => match list_chain(keys, key, value) {
                Some(chain) => config.chains.push(chain),
                None => self.wrong_value(name, value.span(), wrong()),
            },
            (Entries::Lints, _) => match severity(value) {
                Some(severity) => _ = config.lints.insert(name.to_string(), (severity, key.span())),
                None => self.wrong_value(name, value.span(), wrong()),
            },
            (_, None) => self.wrong_value(name, value.span(), wrong()),
        }
    }

    /// Reads the keys of a section.
    fn keys<T>(&mut self, into: &mut T, section: &str, keys: &[Key<T>], entries: &DeTable<'_>) {
        for (key, value) in entries {
            self.key(into, section, keys, key, value);
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
        let header = format!("{section}.{name}");
        match (&found.kind, value.get_ref()) {
            (KeyKind::Others(field, keys, _), DeValue::Array(entries)) => {
                for entry in entries.iter() {
                    match entry.get_ref().as_table() {
                        Some(values) => self.other(field(into), &header, keys, entry.span(), values),
                        None => self.wrong_value(name, entry.span(), found.kind.expected(name)),
                    }
                }
                return;
            }
            (KeyKind::CpuSets(field, _), DeValue::Table(sets)) => {
                for (name, value) in sets {
                    match cpus(value.get_ref()) {
                        Some(cpus) => {
                            let set = CpuSetConfig { span: name.span(), cpus: (cpus, value.span()) };
                            field(into).insert(name.get_ref().to_string(), set);
                        }
                        None => self.wrong_value(name.get_ref(), value.span(), CPU_LIST),
                    }
                }
                return;
            }
            (KeyKind::Gateway(field, keys), DeValue::Table(values)) => {
                field(into).span = key.span();
                return self.keys(field(into), &header, keys, values);
            }
            (KeyKind::Topics(field, keys), DeValue::Table(topics)) => {
                for (port, value) in topics {
                    let mut topic = TopicConfig {
                        port: (port.get_ref().to_string(), port.span()),
                        ..TopicConfig::default()
                    };
                    match value.get_ref() {
                        DeValue::Table(values) => {
                            let header = format!("{header}.{}", toml_key(port.get_ref()));
                            self.keys(&mut topic, &header, keys, values);
                        }
                        DeValue::String(name) => topic.name = Some((name.to_string(), value.span())),
                        _ => self.wrong_value(
                            port.get_ref(),
                            value.span(),
                            found.kind.expected(port.get_ref()),
                        ),
                    }
                    field(into).push(topic);
                }
                return;
            }
            (KeyKind::DeploymentTables(field, keys, _), DeValue::Table(deployments)) => {
                for (name, value) in deployments {
                    match value.get_ref().as_table() {
                        Some(values) => self.deployment_tables(field(into), &header, keys, name, values),
                        None => self.wrong_value(
                            name.get_ref(),
                            value.span(),
                            found.kind.expected(name.get_ref()),
                        ),
                    }
                }
                return;
            }
            _ => {}
        }
        if let Err(error) = found.kind.read(into, value) {
            // No response time depends on a string in a wrong format, nor on a missing root.
            self.completeness &= Completeness::of(match found.kind {
                KeyKind::Models(_) | KeyKind::Names { .. } => true,
                KeyKind::Text { .. } => value.get_ref().is_str(),
                _ => false,
            });
            let expected = found.kind.expected_instead(name, value.get_ref().is_str(), error.is_some());
            self.error(MistakeKind::WrongValue { key: name.to_string(), expected, error }, value.span());
        }
    }

    /// An entry of `[[platform.other]]`: every error leaves an unknown interference.
    fn other(
        &mut self,
        into: &mut Vec<OtherConfig>,
        section: &str,
        keys: &[Key<OtherConfig>],
        span: Range<usize>,
        values: &DeTable<'_>,
    ) {
        let mut other = OtherConfig::default();
        let errors = self.errors.len();
        self.keys(&mut other, section, keys, values);
        let has = |name: &str| values.contains_key(name) || name == "period" && values.contains_key("rate");
        if let Some((_, rate)) = other.period.and(values.get_key_value("rate")) {
            self.wrong_value("rate", rate.span(), BESIDE_PERIOD);
        }
        let missing = REQUIRED_OF_OTHER.into_iter().find(|&name| !has(name));
        let at = values.iter().next().map_or(span, |(key, _)| key.span());
        self.missing_key(errors, missing, format!("[[{section}]]"), at);
        if let Some((name, at)) = other.name.as_ref().zip(values.get("name"))
            && into.iter().any(|known| known.name.as_ref() == Some(name) && on_one_host(known, &other))
        {
            let (name, section) = (name.clone(), section.to_owned());
            self.error(MistakeKind::RepeatedName { name, section }, at.span());
        }
        self.completeness &= Completeness::of(self.errors.len() == errors);
        into.push(other);
    }

    /// `[timing.deployment.Sea]`: every error leaves the tables of a deployment unknown.
    fn deployment_tables(
        &mut self,
        into: &mut BTreeMap<String, DeploymentTables>,
        section: &str,
        keys: &[Key<DeploymentTables>],
        name: &TomlKey<'_>,
        values: &DeTable<'_>,
    ) {
        let section = format!("{section}.{}", toml_key(name.get_ref()));
        let mut found = DeploymentTables { span: name.span(), ..DeploymentTables::default() };
        let errors = self.errors.len();
        self.keys(&mut found, &section, keys, values);
        let missing = Some("tables").filter(|it| !values.contains_key(*it));
        self.missing_key(errors, missing, format!("[{section}]"), name.span());
        into.insert(name.get_ref().to_string(), found);
    }

    /// `[locks.bus]`: every error leaves an unknown blocking.
    fn lock(
        &mut self,
        config: &mut Config,
        header: &str,
        keys: &[Key<LockConfig>],
        name: &TomlKey<'_>,
        values: &DeTable<'_>,
    ) {
        let mut lock =
            LockConfig { name: name.get_ref().to_string(), span: name.span(), ..LockConfig::default() };
        let errors = self.errors.len();
        self.keys(&mut lock, header, keys, values);
        let missing = REQUIRED_OF_LOCK.into_iter().find(|&key| !values.contains_key(key));
        self.missing_key(errors, missing, format!("[{header}]"), name.span());
        self.completeness &= Completeness::of(self.errors.len() == errors);
        config.locks.push(lock);
    }

    /// `[chains.avoid]`
    fn chain(
        &mut self,
        header: &str,
        keys: &[Key<Chain>],
        name: &TomlKey<'_>,
        entries: &DeTable<'_>,
    ) -> Chain {
        let mut chain = Chain { name: name.get_ref().to_string(), span: name.span(), ..Chain::default() };
        for (key, value) in entries {
            let is_old = OLD_CHAIN.iter().any(|it| it.name == key.get_ref());
            let before = chain.latency.take();
            self.key(&mut chain, header, if is_old { &OLD_CHAIN } else { keys }, key, value);
            // The old keys are limits of the latency too.
            chain.latency = before.into_iter().chain(chain.latency).min();
        }
        chain
    }

    /// Reports CPUs of `[[platform.other]]` and `[platform.cpu_sets]` that the computer, or a host, does not have, and unknown hosts.
    fn cpus_of_others(&mut self, config: &Config) {
        let mut check = |(named, span): &(CpuSet, Range<usize>), cpus: Option<u32>, section: String| {
            let cpus = cpus.filter(|it| !(*named - CpuSet::first_few(*it)).is_empty())?;
            self.incomplete(MistakeKind::NoSuchCpu { named: *named, cpus, section }, span.clone());
            Some(())
        };
        for set in config.cpu_sets.values() {
            check(&set.cpus, config.cpus, "platform".to_owned());
        }
        for other in &config.others {
            let Some(named) = &other.cpus else { continue };
            let is_its = |it: &&HostConfig| other.host.as_ref().is_none_or(|(host, _)| *host == it.name);
            let of_host = |it: &HostConfig| {
                check(named, it.cpus.or(config.cpus), format!("host.{}", toml_key(&it.name)))
            };
            match config.hosts.as_slice() {
                [] => _ = check(named, config.cpus, "platform".to_owned()),
                hosts => _ = hosts.iter().filter(is_its).find_map(of_host),
            }
        }
        let known = || config.hosts.iter().map(|it| it.name.as_str());
        for (host, span) in config.others.iter().filter_map(|it| it.host.as_ref()) {
            if !known().any(|it| it == host) {
                let near = mauve_syntax::similar(host, known()).map(Name::from);
                let kind = MistakeKind::NoSuchHost(host.clone());
                self.errors.push(Mistake { kind, span: span.clone(), near });
                self.completeness = Completeness::Incomplete;
            }
        }
    }
}

/// Returns whether a host has both.
fn on_one_host(one: &OtherConfig, other: &OtherConfig) -> bool {
    let [one, other] = [one, other].map(|it| it.host.as_ref().map(|(host, _)| host));
    one.is_none() || other.is_none() || one == other
}

/// `"measured by hand"`, or `{ until = "30 ms", reason = "measured by hand" }`
fn acceptance(value: &DeValue<'_>) -> Result<(String, Option<Time>), Option<TimeError>> {
    let reason = |value: &DeValue<'_>| {
        let text = value.as_str().map(str::trim).filter(|text| !text.is_empty());
        text.map(str::to_owned).ok_or(None)
    };
    let Some(fields) = value.as_table() else { return Ok((reason(value)?, None)) };
    let field = |name: &str| fields.get(name).map(|it| it.get_ref()).ok_or(None);
    // Another key may be a misspelt one.
    if fields.len() != 2 {
        return Err(None);
    }
    let until = Time::parse_with_unit(field("until")?.as_str().ok_or(None)?, Rounding::Exact)?;
    Ok((reason(field("reason")?)?, Some(until)))
}

/// `scan-to-wheels = ["hokuyo.scan", "guidance.command"]`
fn list_chain(keys: &[Key<Chain>], key: &TomlKey<'_>, value: &Value<'_>) -> Option<Chain> {
    let name = key.get_ref();
    // `tables = ["t.toml"]` has the form of a chain.
    let is_key = keys::list_keys().chain(keys.iter().map(|key| key.name)).any(|key| key == name);
    let may_be_chain = value.get_ref().is_array() && !is_key;
    let ends = names(value, (2, 2)).filter(|_| may_be_chain)?;
    let mut chain = Chain { name: name.to_string(), span: key.span(), ..Chain::default() };
    chain.set_path(ends);
    Some(chain)
}

/// `"warn"`
fn severity(value: &Value<'_>) -> Option<Option<Severity>> {
    let text = value.get_ref().as_str()?;
    SEVERITIES.iter().find(|(name, _)| *name == text).map(|(_, severity)| *severity)
}

impl<T> KeyKind<T> {
    /// Stores a value.
    ///
    /// # Errors
    ///
    /// The value is invalid. With the error of a time that cannot be read.
    fn read(&self, into: &mut T, value: &Value<'_>) -> Result<(), Option<TimeError>> {
        let found = value.get_ref();
        let text = found.as_str();
        match self {
            KeyKind::Models(field)
            | KeyKind::Tables(field)
            | KeyKind::Instances(field)
            | KeyKind::Codels(field) => {
                field(into).extend(strings(value).ok_or(None)?);
            }
            KeyKind::Names { store, parts, is_list, .. } => {
                let found = names(value, *parts).filter(|_| *is_list || value.get_ref().is_str());
                store(into, found.ok_or(None)?);
            }
            KeyKind::Reasons(field) => {
                let reasons = found.as_table().ok_or(None)?;
                for (instance, value) in reasons {
                    let (reason, until) = acceptance(value.get_ref())?;
                    let (instance, span) = (instance.get_ref().to_string(), instance.span());
                    field(into).push(Acceptance { instance, span, reason, until });
                }
            }
            KeyKind::Protocol(field) => {
                let protocol = Protocol::ALL.into_iter().find(|it| Some(it.name()) == text);
                *field(into) = Some(protocol.ok_or(None)?);
            }
            KeyKind::Level(store) => {
                let level = number(found).and_then(Level::from_f64);
                store(into, level.ok_or(None)?, value.span());
            }
            KeyKind::Required(field) => {
                *field(into) = Some(Required::parse(text.ok_or(None)?, value.span()).ok_or(None)?);
            }
            KeyKind::Time(field) => {
                let text = text.ok_or(None)?;
                *field(into) = Some(Time::parse_with_unit(text, Rounding::Up)?);
            }
            KeyKind::Period(field) => {
                let text = text.ok_or(None)?;
                let time = match text.split_once('/') {
                    Some((above, below)) => quotient(above, below)?,
                    None => Time::parse_with_unit(text, Rounding::Exact)?,
                };
                *field(into) = Some(time).filter(|time| *time > Time::ZERO);
                field(into).ok_or(None)?;
            }
            KeyKind::Rate(field) => {
                let number = text.and_then(|text| text.strip_suffix("Hz")).ok_or(None)?;
                let (above, below) = number.split_once('/').unwrap_or((number, "1"));
                let time = Time::quotient(below, above, Unit::Seconds, Rounding::Down).ok();
                *field(into) = Some(time.filter(|time| *time > Time::ZERO).ok_or(None)?);
            }
            KeyKind::Cpus(field) => {
                let cpus = cpus(found).ok_or(None)?;
                *field(into) = Some((cpus, value.span()));
            }
            // The reader reads the entries of these one by one.
            KeyKind::Others(..)
            | KeyKind::CpuSets(..)
            | KeyKind::DeploymentTables(..)
            | KeyKind::Gateway(..)
            | KeyKind::Topics(..) => return Err(None),
            KeyKind::Integer(from, to, field) => {
                let number = integer(found).filter(|it| (from..=to).contains(&it));
                *field(into) = Some(number.ok_or(None)?);
            }
            KeyKind::Boolean(field) => *field(into) = Some(found.as_bool().ok_or(None)?),
            KeyKind::Folder(field) => *field(into) = Some((text.ok_or(None)?.to_owned(), value.span())),
            KeyKind::Text { store, .. } => store(into, text.ok_or(None)?).ok_or(None)?,
        }
        Ok(())
    }
}

/// `1000/30 ms`, rounded down.
fn quotient(above: &str, below: &str) -> Result<Time, TimeError> {
    let end = below.rfind(|c: char| c.is_ascii_digit()).ok_or(TimeError::NotANumber)? + 1;
    let (below, unit) = below.split_at(end);
    let unit = Unit::parse(unit.trim()).ok_or(TimeError::UnknownUnit)?;
    Time::quotient(above, below, unit, Rounding::Down)
}

/// Returns the strings of a string or a list of strings, with their ranges.
fn strings(value: &Value<'_>) -> Option<Vec<(String, Range<usize>)>> {
    let one = |value: &Value<'_>| Some((value.get_ref().as_str()?.to_owned(), value.span()));
    match value.get_ref() {
        DeValue::Array(values) => values.iter().map(one).collect(),
        _ => Some(vec![one(value)?]),
    }
}

/// Returns the names of [`strings`], if each has so many parts.
fn names(value: &Value<'_>, (least, most): (usize, usize)) -> Option<Vec<Located>> {
    let is_name = |(name, _): &Located| {
        let parts = name.split('.');
        (least..=most).contains(&parts.clone().count()) && parts.into_iter().all(|part| !part.is_empty())
    };
    strings(value).filter(|names| names.iter().all(is_name))
}

/// Returns the CPUs in a list of their numbers, from 1; `None` for an empty list.
fn cpus(value: &DeValue<'_>) -> Option<CpuSet> {
    let cpu = |number: u32| number.checked_sub(1).map(CpuSet::of).filter(|cpu| cpu.is_one());
    let numbers = value.as_array().filter(|numbers| !numbers.is_empty())?;
    numbers.iter().map(|number| cpu(integer(number.get_ref())?)).collect()
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
