//! Writes the estimates into a timing table.

use std::fs::File;
use std::path::{Path, PathBuf};

use mauve_diagnostics::table_error_message;
use mauve_projects::disk;
use mauve_projects::replace::{folder_of, put};
use mauve_pwcet::rounded_up;
use mauve_pwcet::samples::Samples;
use mauve_pwcet::trace::port_of;
use mauve_timing::{
    EXTRAPOLATED, KeptEntry, Level, Measured as Record, Table, Time, Times, UpdateError, digest_of,
    entry_of_key, update_table,
};

use super::estimates::{Estimates, MeasuredEntry, OVER_BUDGET};
use crate::date::today;

/// What was written.
pub(super) struct WrittenTable {
    /// Messages about what was written, and what was kept.
    pub(super) messages: Vec<String>,
    /// Whether the table has a time that an execution exceeded.
    pub(super) is_exceeded: bool,
}

/// Writes all times into the table at `path`, or none.
pub(super) fn write(
    path: &Path,
    samples: &[PathBuf],
    files: &[Samples],
    estimates: &Estimates,
    replaces: bool,
) -> Result<WrittenTable, String> {
    let shown = path.display();
    // Another run that writes this table waits; a file system without locks has none.
    let _lock = File::open(folder_of(path)).and_then(|folder| folder.lock().map(|()| folder));
    let old = match path.try_exists() {
        Ok(true) => Some(read(path).map_err(|error| format!("cannot read `{shown}`: {error}"))?),
        Ok(false) => None,
        Err(error) => return Err(format!("cannot read `{shown}`: {error}")),
    };
    let text = old.as_deref().unwrap_or_default();
    let table = Table::parse(text);
    let fingerprints: Vec<String> = files.iter().map(Samples::fingerprint).collect();
    let origin = TableOrigin {
        files: samples.iter().map(|it| relative(it, path)).collect(),
        bytes: files.iter().map(Samples::size).sum(),
        samples: digest_of(fingerprints.join(" ").as_bytes()),
        table: path,
        old: &table,
    };
    let found = estimates.measurements.iter();
    let mut records: Vec<Record> =
        found.filter_map(|it| Some(origin.record(estimates, it, &estimates.table_times(it)?))).collect();
    records.sort_by(|a, b| a.key.cmp(&b.key));
    let levels = estimates.needed_levels();
    let updated = update_table(text, &levels, &records, replaces).map_err(|error| match error {
        UpdateError::Invalid(error) => {
            let line = text[..error.span.start.min(text.len())].lines().count().max(1);
            format!(
                "`{shown}`, line {line}: {}; the table was not changed",
                table_error_message(&error.kind)
            )
        }
        UpdateError::OtherLevels(levels) => {
            let levels = levels.iter().map(|it| it.to_string()).collect::<Vec<_>>().join(",");
            format!(
                "`{shown}` has times at other levels, which stay: use --levels {levels}, or another table; the table was not changed"
            )
        }
    })?;
    let written = records.len() - updated.kept.len();
    if written > 0 && old.as_ref() != Some(&updated.text) {
        put(path, &updated.text).map_err(|error| format!("{error}; the table was not changed"))?;
    }
    let mut messages = Vec::new();
    let exceeded = exceeded(&table, estimates, &updated.kept);
    messages.extend(exceeded.iter().map(|(key, entry, greatest)| {
        format!(
            "`{shown}`: the time of `{entry}` is too short: an execution of `{key}` took {}",
            Time::from_nanos(rounded_up(*greatest as f64))
        )
    }));
    messages.extend(partly(path, estimates));
    messages.extend(kept(path, &updated.kept));
    let levels = levels.iter().map(Level::to_string).collect::<Vec<_>>().join(",");
    let assumed = match updated.assumed {
        0 => String::new(),
        1 => "; 1 of them was assumed".to_owned(),
        count => format!("; {count} of them were assumed"),
    };
    messages.push(match written {
        0 => format!("`{shown}` was not changed: no time could be written"),
        1 => format!("`{shown}` has the measured time of 1 codel or port, at {levels}{assumed}"),
        written => {
            format!("`{shown}` has the measured times of {written} codels and ports, at {levels}{assumed}")
        }
    });
    Ok(WrittenTable { messages, is_exceeded: !exceeded.is_empty() })
}

/// Names the codels whose times are not written, since they have them at some levels only: an entry has all levels of its table.
fn partly(path: &Path, estimates: &Estimates) -> Option<String> {
    let time = |it: &MeasuredEntry, level: &usize| it.time(*level).is_some();
    let is_partial = |it: &&MeasuredEntry| {
        !it.is_short_access()
            && estimates.needed.iter().any(|level| time(it, level))
            && estimates.table_times(it).is_none()
    };
    let partial: Vec<&MeasuredEntry> = estimates.measurements.iter().filter(is_partial).collect();
    let (all, others): (Vec<usize>, Vec<usize>) =
        estimates.needed.iter().partition(|level| partial.iter().all(|it| time(it, level)));
    let of = |levels: &[usize]| {
        let levels = levels.iter().filter_map(|&level| estimates.levels.get(level));
        levels.map(Level::to_string).collect::<Vec<_>>().join(",")
    };
    let names = partial.iter().map(|it| format!("`{}`", it.name)).collect::<Vec<_>>().join(", ");
    let instead =
        if all.is_empty() { String::new() } else { format!(", or write a table with --levels {}", of(&all)) };
    let have = if partial.len() == 1 { "has" } else { "have" };
    (!partial.is_empty()).then(|| {
        format!(
            "`{}` gets no time of {names}, which {have} none at {}: measure more{instead}",
            path.display(),
            of(&others)
        )
    })
}

/// Names the entries that stay.
fn kept(path: &Path, all: &[KeptEntry]) -> Option<String> {
    let name = |KeptEntry { key, entry, is_edited, .. }: &KeptEntry| {
        let edited = if *is_edited { " (edited after its measurement)" } else { "" };
        let of = if key == entry { String::new() } else { format!(" (for `{key}`)") };
        format!("`{entry}`{edited}{of}")
    };
    let names = all.iter().map(name).collect::<Vec<_>>().join(", ");
    let (times, them) = if all.len() == 1 { ("the time", "it") } else { ("the times", "them") };
    (!all.is_empty()).then(|| {
        format!("`{}` keeps {times} by hand of {names}: --replace overwrites {them}", path.display())
    })
}

/// Returns the key, the entry and the longest execution of each entry that stays, although the execution took longer than it says
/// at each level.
fn exceeded(table: &Table, estimates: &Estimates, kept: &[KeptEntry]) -> Vec<(String, String, u64)> {
    let mut found = Vec::new();
    for it in &estimates.measurements {
        let key = port_of(&it.measurement.key).unwrap_or(&it.measurement.key);
        let greatest = it.measurement.greatest();
        let entry = match kept.iter().find(|kept| kept.key == key) {
            Some(kept) => kept.times.as_ref().map(|times| (kept.entry.as_str(), times)),
            None if estimates.table_times(it).is_some() => continue,
            // Without an estimate, the table stays as it is.
            None => entry_of_key(table, &it.measurement.key)
                .and_then(|entry| Some((entry.key.as_str(), entry.value.as_ref()?))),
        };
        let Some((entry, times)) = entry else { continue };
        if times.greatest().as_nanos() < greatest {
            found.push((key.to_owned(), entry.to_owned(), greatest));
        }
    }
    found
}

fn read(path: &Path) -> std::io::Result<String> {
    String::from_utf8(disk::read(path, disk::LONGEST)?).map_err(std::io::Error::other)
}

/// Returns a path as it is written in the table: from its folder, if the file is below it or beside it.
fn relative(file: &Path, table: &Path) -> String {
    let [file, table] = [file, table].map(|it| std::path::absolute(it).unwrap_or_else(|_| it.to_owned()));
    let mut up = String::new();
    for folder in table.ancestors().skip(1) {
        if let Ok(below) = file.strip_prefix(folder) {
            return format!("{up}{}", below.display());
        }
        up += "../";
    }
    file.display().to_string()
}

/// Returns the kinds of warnings about a measurement, that of extrapolated times with the least strict level that has one.
fn warnings(estimates: &Estimates, it: &MeasuredEntry) -> Vec<String> {
    let extrapolated = estimates.needed.iter().filter(|&&level| it.is_extrapolated(level));
    let from = extrapolated.filter_map(|&level| estimates.levels.get(level)).max();
    let kinds = estimates.kinds(it).into_iter().filter(|kind| ![OVER_BUDGET, EXTRAPOLATED].contains(kind));
    kinds.map(str::to_owned).chain(from.map(|level| format!("{EXTRAPOLATED}-from-{level}"))).collect()
}

/// Where all times come from.
struct TableOrigin<'a> {
    files: Vec<String>,
    bytes: u64,
    samples: String,
    table: &'a Path,
    old: &'a Table,
}

impl TableOrigin<'_> {
    fn record(&self, estimates: &Estimates, it: &MeasuredEntry, times: &[Time]) -> Record {
        let key = &it.measurement.key;
        let path = estimates.budgets.as_ref().and_then(|budgets| budgets.sources.get(key));
        let source = path.and_then(|path| {
            Some((relative(path, self.table), digest_of(&disk::read(path, disk::LONGEST).ok()?)))
        });
        // The same executions are those of the code of the first estimate.
        let in_table = port_of(key).unwrap_or(key);
        let old = self.old.measured.iter().find(|old| old.key == in_table && old.samples == self.samples);
        let old = old.and_then(|old| old.source.clone().zip(old.source_digest.clone()));
        let source = old.filter(|(old, _)| source.as_ref().is_some_and(|(now, _)| old == now)).or(source);
        Record {
            key: key.clone(),
            span: 0..0,
            executions: it.measurement.count() as u64,
            greatest: Time::from_nanos(it.measurement.greatest()),
            times: Times::PerLevel(times.to_vec()),
            method: "generalised Pareto, 95 % upper confidence bound".to_owned(),
            date: today(),
            samples: self.samples.clone(),
            files: self.files.clone(),
            bytes: self.bytes,
            source: source.as_ref().map(|(path, _)| path.clone()),
            source_digest: source.map(|(_, digest)| digest),
            warnings: warnings(estimates, it),
        }
    }
}
