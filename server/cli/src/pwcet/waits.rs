//! The waits that recordings showed, which no execution time contains: of the file that `mauve trace import` writes beside a sample
//! file.

use std::collections::BTreeMap;
use std::path::PathBuf;

use mauve_projects::disk;
use mauve_timing::{Observed, ObservedTimes, Table, Unit, entry_for};

use crate::text::{duration, wait_entry};

/// Returns a message for each codel that waited longer than `table` says, with the line to write.
pub(super) fn messages(samples: &[PathBuf], table: &Table, unit: Unit) -> Vec<String> {
    let mut codels: BTreeMap<String, ObservedTimes> = BTreeMap::new();
    for path in samples {
        let Ok(text) = disk::read(&path.with_extension("observed.toml"), disk::LONGEST) else { continue };
        for (codel, it) in Observed::parse(&String::from_utf8_lossy(&text)).0.codels {
            codels.entry(codel).or_default().add(&it);
        }
    }
    let known = |codel: &str| entry_for(&table.waits, codel, false)?.value.as_ref();
    codels.retain(|codel, it| it.wait > known(codel).map_or(0, |it| it.greatest().as_nanos()));
    let message = |(codel, it): (&String, &ObservedTimes)| {
        let (time, line) = (duration(it.wait), wait_entry(codel, it.wait, it.times, unit));
        match it.is_wait_known {
            true => format!(
                "`{codel}` waited for up to {time}, which is in no execution time: in a timing table in {unit}, [wait] {line}"
            ),
            false => format!(
                "`{codel}` was off the CPU for up to {time}, which is in no execution time: the recording does not say whether it \
                 waited; if it did, a timing table in {unit} needs [wait] {line}"
            ),
        }
    };
    codels.iter().map(message).collect()
}
