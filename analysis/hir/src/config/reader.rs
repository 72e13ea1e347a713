//! Reads a `mauve.toml`.

use std::collections::BTreeMap;
use std::ops::Range;

use mauve_timing::toml_key::{ANY_NAME, key_named};
use mauve_timing::{CpuSet, Level, Protocol, Rounding, Time, TimeError, Unit};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::keys::{Key, KeyKind, KeyTable, SECTIONS, SEVERITIES};
use super::value::{SpannedValue, cpus, integer, names, number, strings};
use super::{Acceptance, Config, HostConfig, Located, Mistake, MistakeKind, OtherConfig, Required, toml_key};
use crate::completeness::Completeness;
use crate::item_tree::Name;

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

type SpannedKey<'a> = Spanned<std::borrow::Cow<'a, str>>;

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
    fn multiline_string(&self, value: &SpannedValue<'_>) -> Option<Range<usize>> {
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

    /// Reports an unknown name.
    fn unknown<'k>(
        &mut self,
        name: &str,
        span: Range<usize>,
        known: impl Iterator<Item = &'k str>,
        kind: MistakeKind,
    ) {
        let near = mauve_syntax::similar(name, known).map(Name::from);
        self.errors.push(Mistake { kind, span, near });
        self.completeness = Completeness::Incomplete;
    }

    fn document(&mut self, config: &mut Config, document: &DeTable<'_>) {
        for (key, value) in document {
            let name = key.get_ref();
            match (value.get_ref().as_table(), SECTIONS.iter().find(|it| it.name == name)) {
                (None, _) => self.incomplete(MistakeKind::OutsideSections(name.to_string()), key.span()),
                (Some(values), Some(Key { kind: KeyKind::Table(table), .. })) => {
                    self.table(config, name, table, (name.to_string(), key.span()), values);
                }
                (Some(_), _) => {
                    let known = || SECTIONS.iter().map(|section| section.name);
                    let (section, expected) = (name.to_string(), known().collect());
                    let kind = MistakeKind::UnknownSection { section, expected };
                    self.unknown(name, key.span(), known(), kind);
                }
            }
        }
        self.others(config);
        let mut seen = BTreeMap::new();
        for (clock, (instance, span)) in config.on_clocks() {
            if *seen.entry(instance).or_insert(clock) != clock {
                self.incomplete(MistakeKind::SecondClock(instance.clone()), span.clone());
            }
        }
    }

    /// Reads a table below its header.
    fn table(
        &mut self,
        config: &mut Config,
        header: &str,
        table: &KeyTable,
        (name, span): Located,
        entries: &DeTable<'_>,
    ) {
        let errors = self.errors.len();
        (table.open)(config, (name, span.clone()));
        for (key, value) in entries {
            match self.multiline_string(value) {
                Some(at) => self.incomplete(MistakeKind::SeveralLines(key.get_ref().to_string()), at),
                None => self.key(config, header, table, key, value),
            }
        }
        if let Some([one, other, expected]) = table.apart
            && let (Some(one_value), Some(other)) = (entries.get(one), entries.get(other))
            && !self.errors.iter().any(|it| it.span == one_value.span() || it.span == other.span())
        {
            self.wrong_value(one, one_value.span(), expected);
        }
        let has = |name: &str| entries.contains_key(name) || name == "period" && entries.contains_key("rate");
        // With another error, it lacks none: an unknown key may be a misspelt one.
        let missing = table.required.iter().find(|it| !has(it)).filter(|_| self.errors.len() == errors);
        if let Some(key) = missing {
            let first = entries.iter().next().filter(|_| table.is_list);
            let at = first.map_or(span, |(key, _)| key.span());
            let header = if table.is_list { format!("[[{header}]]") } else { format!("[{header}]") };
            self.incomplete(MistakeKind::MissingKey { key, header }, at);
        }
        // Each error in other work leaves an unknown interference.
        self.completeness &= Completeness::of(!table.is_list || self.errors.len() == errors);
    }

    /// Reads the value of a key in a table.
    fn key(
        &mut self,
        config: &mut Config,
        section: &str,
        table: &KeyTable,
        key: &SpannedKey<'_>,
        value: &SpannedValue<'_>,
    ) {
        let name = key.get_ref();
        let may_be = |it: &&Key| it.name == name || table.keys.len() == 1 || value.get_ref().is_table();
        let Some(found) = key_named(table.keys, name).filter(may_be) else {
            let known = || table.keys.iter().map(|key| key.name).filter(|it| *it != ANY_NAME);
            let (section, expected) = (section.to_owned(), known().collect());
            let kind = MistakeKind::UnknownKey { key: name.to_string(), section, expected };
            return self.unknown(name, key.span(), known(), kind);
        };
        let header = format!("{section}.{}", toml_key(name));
        let is_string = |value: &SpannedValue<'_>| value.get_ref().is_str();
        let expected = |value, has_reason| found.kind.expected(section, name, is_string(value), has_reason);
        match (&found.kind, value.get_ref()) {
            (KeyKind::Table(table), DeValue::Table(entries)) if !table.is_list => {
                self.table(config, &header, table, (name.to_string(), key.span()), entries);
            }
            (KeyKind::Table(table), DeValue::Array(all)) if table.is_list => {
                for entry in all.iter() {
                    match entry.get_ref().as_table() {
                        Some(it) => self.table(config, &header, table, (name.to_string(), entry.span()), it),
                        None => self.wrong_value(name, entry.span(), expected(entry, false)),
                    }
                }
            }
            _ => {
                let Err(error) = found.kind.read(config, key, value) else { return };
                // No response time depends on a string in a wrong format, nor on a missing root.
                self.completeness &= Completeness::of(match found.kind {
                    KeyKind::Models(_) | KeyKind::Names { .. } => true,
                    KeyKind::Text { .. } | KeyKind::Either(..) => is_string(value),
                    _ => false,
                });
                let (key, expected) = (name.to_string(), expected(value, error.is_some()));
                self.error(MistakeKind::WrongValue { key, expected, error }, value.span());
            }
        }
    }

    /// Reports CPUs of `[[platform.other]]` and `[platform.cpu_sets]` that the computer, or a host, does not have, unknown hosts, and work
    /// with the name of earlier work.
    fn others(&mut self, config: &Config) {
        let mut check = |(named, span): &(CpuSet, Range<usize>), cpus: Option<u32>, section: String| {
            let cpus = cpus.filter(|it| !(*named - CpuSet::first_few(*it)).is_empty())?;
            self.incomplete(MistakeKind::NoSuchCpu { named: *named, cpus, section }, span.clone());
            Some(())
        };
        for cpus in config.cpu_sets.iter().filter_map(|it| it.cpus.as_ref()) {
            check(cpus, config.cpus, "platform".to_owned());
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
                self.unknown(host, span.clone(), known(), MistakeKind::NoSuchHost(host.clone()));
            }
        }
        for (index, other) in config.others.iter().enumerate() {
            let is_same = |it: &OtherConfig| {
                let names = it.name.as_ref().zip(other.name.as_ref());
                names.is_some_and(|(one, other)| one.0 == other.0) && on_one_host(it, other)
            };
            let twice = other.name.as_ref().filter(|_| config.others.iter().take(index).any(is_same));
            if let Some((name, span)) = twice {
                let (name, section) = (name.clone(), "platform.other".to_owned());
                self.incomplete(MistakeKind::RepeatedName { name, section }, span.clone());
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

impl KeyKind {
    /// Stores a value.
    ///
    /// # Errors
    ///
    /// The value is invalid. With the error of a time that cannot be read.
    fn read(
        &self,
        into: &mut Config,
        key: &SpannedKey<'_>,
        value: &SpannedValue<'_>,
    ) -> Result<(), Option<TimeError>> {
        let at = || (key.get_ref().to_string(), key.span());
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
            KeyKind::Level => {
                let level = number(found).and_then(Level::from_f64);
                into.significance = Some(level.ok_or(None)?);
                into.significance_span = Some(value.span());
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
                *field(into) = Some(Some(time).filter(|time| *time > Time::ZERO).ok_or(None)?);
            }
            KeyKind::Rate(field) => {
                let number = text.and_then(|text| text.strip_suffix("Hz")).ok_or(None)?;
                let (above, below) = number.split_once('/').unwrap_or((number, "1"));
                let time = Time::quotient(below, above, Unit::Seconds, Rounding::Down).ok();
                *field(into) = Some(time.filter(|time| *time > Time::ZERO).ok_or(None)?);
            }
            KeyKind::Cpus(field) => {
                let cpus = cpus(found).ok_or(None)?;
                *field(into, at()) = Some((cpus, value.span()));
            }
            KeyKind::Table(table) => (table.otherwise)(into, at(), value).ok_or(None)?,
            KeyKind::Severity => {
                let severity = SEVERITIES.iter().find(|(name, _)| Some(*name) == text).ok_or(None)?.1;
                into.lints.insert(key.get_ref().to_string(), (severity, key.span()));
            }
            KeyKind::Integer(from, to, field) => {
                let number = integer(found).filter(|it| (from..=to).contains(&it));
                *field(into) = Some(number.ok_or(None)?);
            }
            KeyKind::Boolean(field) => *field(into) = Some(found.as_bool().ok_or(None)?),
            KeyKind::Folder(field) => *field(into) = Some((text.ok_or(None)?.to_owned(), value.span())),
            KeyKind::Either(words, field) => {
                let index = words.iter().position(|it| Some(*it) == text);
                *field(into) = index.ok_or(None)? == 1;
            }
            KeyKind::Text { store, .. } => {
                store(into, (text.ok_or(None)?.to_owned(), value.span())).ok_or(None)?;
            }
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
