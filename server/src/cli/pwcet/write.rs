//! Writes the estimates into a timing table.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use mauve_diagnostics::table_error_message;
use mauve_pwcet::TailModel;
use mauve_timing::{Kept, Measured as Record, NewEntry, Time, Times, UpdateError, digest_of, update_table};

use super::date::today;
use super::{Estimates, Measured};
use crate::disk;
use crate::replace::replace;

/// Writes all times into the table at `path`, or none. Returns messages about what was written, and what was kept.
pub(super) fn write(
    path: &Path,
    samples: &[PathBuf],
    fingerprints: &[String],
    estimates: &Estimates,
    replaces: bool,
) -> Result<Vec<String>, String> {
    let shown = path.display();
    let old = match path.try_exists() {
        Ok(true) => Some(read(path).map_err(|error| format!("cannot read `{shown}`: {error}"))?),
        Ok(false) => None,
        Err(error) => return Err(format!("cannot read `{shown}`: {error}")),
    };
    let files: Vec<String> = samples.iter().map(|it| relative(it, path)).collect();
    let bytes = samples.iter().filter_map(|it| it.metadata().ok()).map(|it| it.len()).sum();
    let origin = Origin { files, bytes, samples: fingerprints.join(" "), table: path };
    let found = estimates.measurements.iter();
    let mut entries: Vec<NewEntry> =
        found.filter_map(|it| Some(origin.entry(estimates, it, it.times.as_ref()?))).collect();
    entries.sort_by(|a, b| a.record.key.cmp(&b.record.key));
    let text = old.as_deref().unwrap_or_default();
    let updated = update_table(text, &estimates.levels, &entries, replaces).map_err(|error| match error {
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
                "`{shown}` has entries at other levels, which stay: use --levels {levels}, or another table; the table was not changed"
            )
        }
    })?;
    if old.as_ref() != Some(&updated.text) {
        put(path, &updated.text).map_err(|error| format!("{error}; the table was not changed"))?;
    }
    let kept = updated.kept.iter().map(|kept| match kept {
        Kept::ByHand { key, entry } if key == entry => {
            format!("`{shown}` keeps the time of `{key}`, which was written by hand: --replace overwrites it")
        }
        Kept::ByHand { key, entry } => format!(
            "`{shown}` keeps the time of `{entry}`, which was written by hand, for `{key}`: --replace overwrites it"
        ),
        Kept::Edited { key } => format!(
            "`{shown}` keeps the time of `{key}`, which was edited after its measurement: --replace overwrites it"
        ),
    });
    let written = entries.len() - updated.kept.len();
    let done = match written {
        1 => format!("`{shown}` has the measured times of 1 key"),
        written => format!("`{shown}` has the measured times of {written} keys"),
    };
    Ok(kept.chain([done]).collect())
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

/// Writes a file, or replaces it as a whole.
pub(super) fn put(path: &Path, text: &str) -> Result<(), String> {
    let written = match path.canonicalize() {
        Ok(real) => replace(&real, text),
        Err(_) => File::create_new(path).and_then(|mut file| {
            let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all());
            // A part of a table would look like a table.
            written.inspect_err(|_| drop(std::fs::remove_file(path)))
        }),
    };
    written.map_err(|error| format!("cannot write `{}`: {error}", path.display()))
}

/// Where all times come from.
struct Origin<'a> {
    files: Vec<String>,
    bytes: u64,
    samples: String,
    table: &'a Path,
}

impl Origin<'_> {
    fn entry(&self, estimates: &Estimates, it: &Measured, times: &[Time]) -> NewEntry {
        let source = estimates.budgets.as_ref().and_then(|it_has| it_has.source(&it.measurement.key));
        let source = source.and_then(|path| Some((path, disk::read(path, disk::LONGEST).ok()?)));
        NewEntry {
            record: Record {
                key: it.measurement.key.clone(),
                span: 0..0,
                executions: it.measurement.count() as u64,
                greatest: Time::from_nanos(it.measurement.greatest()),
                times: Times::PerLevel(times.to_vec()),
                method: match estimates.options.model {
                    TailModel::GeneralisedPareto => {
                        "generalised Pareto, 95 % upper confidence bound".to_owned()
                    }
                    TailModel::Exponential => "exponential, 95 % upper confidence bound".to_owned(),
                },
                date: today(),
                samples: self.samples.chars().take(16).collect(),
                files: self.files.clone(),
                bytes: self.bytes,
                source: source.as_ref().map(|(path, _)| relative(path, self.table)),
                source_digest: source.as_ref().map(|(_, content)| digest_of(content)),
                warnings: it.remarks(),
            },
        }
    }
}
