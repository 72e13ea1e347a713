//! Sample files: the execution times of all imported runs, in a compact form.
//!
//! ```text
//! MAUVE samples 1⏎
//! begin of run 0 · series 0 · executions of 0 · series 1 · executions of 1 · executions of 0 · … · end of run 0
//! begin of run 1 · …
//! ```
//!
//! A file only grows. A run is valid from the block that ends it, so that neither a crash nor a full disk damages a run that was
//! imported before: readers ignore a run without its end, and the next writer removes it. Files may be a stranger's: no length in
//! them is trusted.

mod block;
mod encoding;
mod error;
mod overlap;
mod writer;

use std::collections::HashSet;
use std::fs::File;
use std::io::{self, BufRead as _, BufReader, Read as _, Seek as _, SeekFrom};
use std::ops::ControlFlow;
use std::path::Path;

use sha2::{Digest as _, Sha256};

use crate::trace::Totals;
use block::{BlockKind, SampleBlock};
use encoding::{Bytes, Codec, Has, put};

pub use encoding::SampledExecution;
pub use error::{Damage, SamplesError};
pub use writer::SamplesWriter;

/// The first line of a sample file.
const MAGIC: &[u8] = b"MAUVE samples 1\n";

/// What the head of an end of a run begins with. A file that has it behind a damaged block has lost a valid run.
const END_MARK: &[u8] = b"\0end of run\xff";

/// Runs that a file may have. A recording in chunks has one in a few seconds.
const MOST_RUNS: usize = 1 << 20;

/// Returns whether executions of this instance are those of `mauve measure`: of a codel alone, with warm or with cold caches. No
/// instance of a model has such a name.
///
/// ```
/// assert!(mauve_pwcet::samples::is_alone("(alone warm)"));
/// ```
pub fn is_alone(instance: &str) -> bool {
    instance.starts_with("(alone ")
}

/// An imported trace.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Run {
    /// Where it comes from, as the user wrote it.
    pub source: String,
    /// When it was imported, in seconds since the epoch.
    pub date: u64,
    /// What the trace had, and what of it was not used.
    pub summary: Totals,
    /// The number of executions in the file.
    pub executions: u64,
    /// The SHA-256 of its executions: equal for the same trace.
    fingerprint: [u8; 32],
}

impl Run {
    /// Returns a digest of its executions in hexadecimal: the same for the same trace.
    pub fn digest(&self) -> String {
        hexadecimal(&self.fingerprint[..8])
    }

    fn is_same(&self, other: &Run) -> bool {
        self.executions > 0 && self.executions == other.executions && self.fingerprint == other.fingerprint
    }
}

/// The number of a [`SampleSeries`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SeriesId(u32);

/// The executions of one codel or program in one instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SampleSeries {
    /// Its number.
    pub id: SeriesId,
    /// The key in a timing table: of a codel, or of a program, which has a `/`.
    pub key: String,
    /// The instance; empty if it is unknown.
    pub instance: String,
    /// The number of executions.
    pub count: u64,
    /// The least execution time in nanoseconds.
    pub least: u64,
    /// The greatest execution time in nanoseconds.
    pub greatest: u64,
}

/// Where the executions of a series are.
#[derive(Debug, Clone, Copy)]
struct SamplePart {
    /// Of the body.
    offset: u64,
    length: usize,
    count: u64,
    has: Has,
    run: u32,
    least: u64,
    greatest: u64,
}

/// A sample file, opened for reading.
///
/// ```
/// use mauve_pwcet::samples::{SampledExecution, Samples, SamplesWriter};
/// use mauve_pwcet::trace::Totals;
///
/// let path = std::env::temp_dir().join(format!("mauve-doc-{}.samples", std::process::id()));
/// let mut writer = SamplesWriter::open(&path)?;
/// writer.begin("monday.csv", 1_700_000_000)?;
/// let plan = writer.series("nav.plan", "pilot")?;
/// for execution in [1200, 1300] {
///     writer.add(plan, SampledExecution { execution, elapsed: None, end: None, run: 0 })?;
/// }
/// writer.commit(&Totals::default())?;
///
/// let mut samples = Samples::open(&path)?;
/// let plan = samples.series()[0].clone();
/// assert_eq!((plan.key.as_str(), plan.count, plan.greatest), ("nav.plan", 2, 1300));
/// assert_eq!(samples.executions(plan.id)?[0].execution, 1200);
/// # std::fs::remove_file(&path).unwrap();
/// # Ok::<(), mauve_pwcet::samples::SamplesError>(())
/// ```
#[derive(Debug)]
pub struct Samples {
    file: File,
    index: Index,
}

/// What a file has, without the executions.
#[derive(Debug, Default)]
struct Index {
    runs: Vec<Run>,
    series: Vec<SampleSeries>,
    /// For each series, in the order in which they were recorded.
    parts: Vec<Vec<SamplePart>>,
    /// The end of the last valid run.
    end: u64,
    /// The size of the file when it was read.
    size: u64,
}

impl Samples {
    /// Opens a file, and reads which runs and series it has.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is not a sample file, or is damaged.
    pub fn open(path: &Path) -> Result<Samples, SamplesError> {
        // A pipe would wait for its writer.
        if !path.metadata()?.is_file() {
            return Err(SamplesError::NotSamples);
        }
        let mut file = File::open(path)?;
        let index = Index::read(&mut file)?;
        if index.end == 0 {
            // It may also have a part of the first line.
            return Err(if file.metadata()?.len() == 0 {
                SamplesError::Empty
            } else {
                SamplesError::NotSamples
            });
        }
        Ok(Samples { file, index })
    }

    /// Returns the runs in the order in which they were imported.
    pub fn runs(&self) -> &[Run] {
        &self.index.runs
    }

    /// Returns the sum of what all runs had, and of what was not used of them.
    pub fn summary(&self) -> Totals {
        let mut sum = Totals::default();
        self.index.runs.iter().for_each(|run| sum.add(&run.summary));
        sum
    }

    /// Returns the size of the file in bytes when it was opened.
    pub fn size(&self) -> u64 {
        self.index.size
    }

    /// Returns how many bytes at the end of the file are no complete run: an import under way, one that did not end, or damage.
    pub fn incomplete_bytes(&self) -> u64 {
        self.index.size.saturating_sub(self.index.end)
    }

    /// Returns the index of the first run of `other` that this file has, too.
    pub fn common_run(&self, other: &Samples) -> Option<usize> {
        let of = |run: &Run| (run.executions > 0).then_some((run.executions, run.fingerprint));
        let known: HashSet<_> = self.index.runs.iter().filter_map(of).collect();
        other.index.runs.iter().position(|run| of(run).is_some_and(|it| known.contains(&it)))
    }

    /// Returns the series in the order in which they appeared.
    pub fn series(&self) -> &[SampleSeries] {
        &self.index.series
    }

    /// Returns the SHA-256 of the fingerprints of all runs, in hexadecimal: it changes when a run is added. Reads nothing.
    pub fn fingerprint(&self) -> String {
        let mut hash = Sha256::new();
        self.index.runs.iter().for_each(|run| hash.update(run.fingerprint));
        hexadecimal(&hash.finalize())
    }

    /// Returns the executions of a series in the order in which they were recorded. Does not read those of others.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or is damaged.
    pub fn executions(&mut self, series: SeriesId) -> Result<Vec<SampledExecution>, SamplesError> {
        let parts = self.index.parts.get(series.0 as usize).ok_or(SamplesError::UnknownSeries)?;
        let mut all = Vec::new();
        let take = &mut |execution| {
            all.push(execution);
            ControlFlow::Continue(())
        };
        parts.iter().try_for_each(|part| part.read(&mut self.file, take))?;
        Ok(all)
    }
}

impl SamplePart {
    /// Reads the executions until `take` breaks.
    fn read(
        &self,
        file: &mut File,
        take: &mut dyn FnMut(SampledExecution) -> ControlFlow<()>,
    ) -> Result<(), SamplesError> {
        let damaged = |damage| SamplesError::Damaged { offset: self.offset, damage };
        file.seek(SeekFrom::Start(self.offset))?;
        let body = block::read_body(file, self.length)?;
        let body = body.map_err(damaged)?;
        let (mut bytes, mut codec) = (Bytes(&body), Codec::default());
        for _ in 0..self.count {
            let execution = codec.take(&mut bytes, self.has, self.run).ok_or(damaged(Damage::Content))?;
            if take(execution).is_break() {
                break;
            }
        }
        Ok(())
    }
}

impl Index {
    /// Reads the heads of all blocks. A file that is new, or ends in its first line, has no end.
    fn read(file: &mut File) -> Result<Index, SamplesError> {
        let size = file.metadata()?.len();
        file.seek(SeekFrom::Start(0))?;
        let mut reader = BufReader::new(&mut *file);
        let mut magic = Vec::new();
        reader.by_ref().take(MAGIC.len() as u64).read_to_end(&mut magic)?;
        if magic.len() < MAGIC.len() && MAGIC.starts_with(&magic) {
            return Ok(Index::default());
        }
        if magic != MAGIC {
            let version = MAGIC.len() - 2;
            let is_ours = magic.get(..version) == MAGIC.get(..version);
            return Err(if is_ours { SamplesError::LaterVersion } else { SamplesError::NotSamples });
        }

        let mut offset = MAGIC.len() as u64;
        let mut index = Index { end: offset, size, ..Index::default() };
        // What the run has that is not yet ended.
        let mut open = UnendedRun::default();
        let damage = loop {
            if offset == size {
                break Damage::Truncated;
            }
            let block = match block::read_head(&mut reader)? {
                Ok(block) => block,
                Err(damage) => break damage,
            };
            let length = block.length();
            if length > size - offset {
                break Damage::Truncated;
            }
            let body = offset + block.body_offset();
            match index.take(&block, body, &mut open) {
                Some(true) => {
                    index.end = offset + length;
                    index.add(std::mem::take(&mut open));
                    if index.runs.len() >= MOST_RUNS {
                        return Err(SamplesError::TooMany);
                    }
                }
                Some(false) => {}
                None => break Damage::Content,
            }
            offset += length;
            let skipped = i64::try_from(length - block.body_offset()).unwrap_or(i64::MAX);
            reader.seek_relative(skipped)?;
        };
        // A run that was not completed may end anywhere. A complete one behind the damage would be lost.
        if offset < size && contains_end(reader, offset)? {
            return Err(SamplesError::Damaged { offset, damage });
        }
        Ok(index)
    }

    /// Takes a block. Returns whether it ends a run; none if its content is not valid.
    fn take(&mut self, block: &SampleBlock, body: u64, open: &mut UnendedRun) -> Option<bool> {
        let mut head = Bytes(&block.head);
        match block.kind {
            BlockKind::Begin => {
                if open.run.is_some() {
                    return None;
                }
                open.run = Some((head.text()?.to_owned(), head.number()?));
            }
            BlockKind::Series => {
                open.run.as_ref()?;
                let id = SeriesId(u32::try_from(self.series.len() + open.series.len()).ok()?);
                let (key, instance) = (head.text()?.to_owned(), head.text()?.to_owned());
                open.series.push(SampleSeries { id, key, instance, count: 0, least: 0, greatest: 0 });
            }
            BlockKind::Data => {
                open.run.as_ref()?;
                let series = usize::try_from(head.number()?).ok()?;
                let count = head.number()?;
                let has = Has::of_bits(head.number()?)?;
                let (least, greatest) = (head.number()?, head.number()?);
                let is_known = series < self.series.len() + open.series.len();
                // Each execution has a byte at least.
                if !is_known || count == 0 || count > block.body as u64 || least > greatest {
                    return None;
                }
                let run = self.runs.len().try_into().ok()?;
                let part = SamplePart { offset: body, length: block.body, count, has, run, least, greatest };
                open.parts.push((series, part));
            }
            BlockKind::End => {
                let (source, date) = open.run.take()?;
                head.0 = head.0.strip_prefix(END_MARK)?;
                let (fingerprint, rest) = head.0.split_first_chunk::<32>()?;
                head.0 = rest;
                let executions = head.number()?;
                let summary = read_summary(&mut head)?;
                if executions != open.parts.iter().map(|(_, part)| part.count).sum::<u64>() {
                    return None;
                }
                self.runs.push(Run { source, date, summary, executions, fingerprint: *fingerprint });
                return Some(true);
            }
        }
        Some(false)
    }

    /// Adds what a run has that is now complete.
    fn add(&mut self, run: UnendedRun) {
        self.parts.resize_with(self.series.len() + run.series.len(), Vec::new);
        self.series.extend(run.series);
        for (series, part) in run.parts {
            let Some((known, parts)) = self.series.get_mut(series).zip(self.parts.get_mut(series)) else {
                continue;
            };
            known.least = if parts.is_empty() { part.least } else { known.least.min(part.least) };
            known.greatest = known.greatest.max(part.greatest);
            known.count += part.count;
            parts.push(part);
        }
    }
}

/// A run whose end has not been read: without it, nothing of the run counts.
#[derive(Debug, Default)]
struct UnendedRun {
    run: Option<(String, u64)>,
    /// The series that it declares.
    series: Vec<SampleSeries>,
    /// Its blocks of executions, with the numbers of their series.
    parts: Vec<(usize, SamplePart)>,
}

/// Returns whether there is a valid end of a run behind an offset.
fn contains_end(mut reader: BufReader<&mut File>, mut offset: u64) -> io::Result<bool> {
    while let Some(mark) = find_mark(&mut reader, offset)? {
        reader.seek(SeekFrom::Start(mark.saturating_sub(block::PREFIX as u64)))?;
        if block::read_head(&mut reader)?.is_ok_and(|block| block.kind == BlockKind::End) {
            return Ok(true);
        }
        offset = mark + 1;
    }
    Ok(false)
}

/// Returns the next offset of [`END_MARK`].
fn find_mark(reader: &mut BufReader<&mut File>, mut offset: u64) -> io::Result<Option<u64>> {
    reader.seek(SeekFrom::Start(offset))?;
    let mut bytes: Vec<u8> = Vec::new();
    loop {
        let part = reader.fill_buf()?;
        if part.is_empty() {
            return Ok(None);
        }
        let count = part.len();
        bytes.extend_from_slice(part);
        reader.consume(count);
        if let Some(at) = bytes.windows(END_MARK.len()).position(|it| it == END_MARK) {
            return Ok(Some(offset + at as u64));
        }
        let searched = bytes.len().saturating_sub(END_MARK.len() - 1);
        bytes.drain(..searched);
        offset += searched as u64;
    }
}

fn put_summary(head: &mut Vec<u8>, mut it: Totals) {
    it.counts().into_iter().for_each(|count| put(head, *count));
    for time in [it.first, it.last] {
        put(head, u64::from(time.is_some()));
        put(head, time.unwrap_or(0));
    }
}

fn read_summary(head: &mut Bytes<'_>) -> Option<Totals> {
    let mut summary = Totals::default();
    for count in summary.counts() {
        *count = head.number()?;
    }
    for time in [&mut summary.first, &mut summary.last] {
        let is_known = head.number()? == 1;
        *time = Some(head.number()?).filter(|_| is_known);
    }
    Some(summary)
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::sync::atomic::{AtomicU32, Ordering};

    use proptest::prelude::*;

    use super::*;

    /// A file that goes with the test.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new() -> Scratch {
            static COUNT: AtomicU32 = AtomicU32::new(0);
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let name = format!("mauve-samples-{}-{number}", std::process::id());
            let path = std::env::temp_dir().join(name);
            let _ = std::fs::remove_file(&path);
            Scratch(path)
        }

        fn of(bytes: &[u8]) -> Scratch {
            let scratch = Scratch::new();
            std::fs::write(&scratch.0, bytes).unwrap();
            scratch
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = std::fs::remove_file(&self.0);
        }
    }

    const NAMES: [(&str, &str); 3] = [("f", "a"), ("C/S.run", "a"), ("f", "")];

    type Row = (usize, u64, Option<u64>, Option<u64>);

    fn execution(row: &Row, run: u32) -> SampledExecution {
        SampledExecution { execution: row.1, elapsed: row.2, end: row.3, run }
    }

    fn write(path: &Path, source: &str, rows: &[Row]) -> Result<(), SamplesError> {
        let mut writer = SamplesWriter::open(path)?;
        begin(&mut writer, source, rows);
        writer.commit(&Totals { events: rows.len() as u64, first: Some(7), ..Totals::default() })
    }

    fn begin(writer: &mut SamplesWriter, source: &str, rows: &[Row]) {
        writer.begin(source, 1_700_000_000).unwrap();
        for row in rows {
            let (key, instance) = NAMES[row.0];
            let series = writer.series(key, instance).unwrap();
            writer.add(series, execution(row, 9)).unwrap();
        }
    }

    /// The executions of each of [`NAMES`].
    fn all(samples: &mut Samples) -> Vec<Vec<SampledExecution>> {
        let series = samples.series().to_vec();
        NAMES
            .iter()
            .map(|(key, instance)| {
                let found = series.iter().find(|it| it.key == *key && it.instance == *instance);
                let Some(found) = found else { return Vec::new() };
                let all = samples.executions(found.id).unwrap();
                assert_eq!(found.count, all.len() as u64);
                let values = || all.iter().map(|it| it.execution);
                assert_eq!((found.least, found.greatest), (values().min().unwrap(), values().max().unwrap()));
                all
            })
            .collect()
    }

    fn rows() -> impl Strategy<Value = Vec<Row>> {
        let time = prop_oneof![0_u64..100_000, any::<u64>()];
        let optional = proptest::option::of(time.clone());
        proptest::collection::vec((0_usize..3, time, optional.clone(), optional), 1..60)
    }

    /// A part of a recording, then all of it, or the other way round; and two recordings that are alike, but later.
    #[test]
    fn parts_of_a_recording_do_not_count_twice() {
        let rows = |range: std::ops::Range<u64>| -> Vec<Row> {
            range.map(|it| (it as usize % 3, 1000 + it * 7919 % 100, None, Some(50 * it))).collect()
        };
        let write = |path: &Path, rows: &[Row]| {
            let mut writer = SamplesWriter::open(path)?;
            begin(&mut writer, "run", rows);
            let (first, last) = (rows.first().and_then(|it| it.3), rows.last().and_then(|it| it.3));
            writer.commit(&Totals { first, last, ..Totals::default() })
        };
        for (first, second) in
            [(0..100, 0..300), (0..300, 0..100), (0..300, 200..300), (0..300, 150..400), (150..400, 0..300)]
        {
            let file = Scratch::new();
            write(&file.0, &rows(first.clone())).unwrap();
            let before = std::fs::read(&file.0).unwrap();
            let found = write(&file.0, &rows(second.clone()));
            assert!(matches!(found, Err(SamplesError::Overlap { run: 0 })), "{first:?} {second:?} {found:?}");
            assert_eq!(std::fs::read(&file.0).unwrap(), before);
            write(&file.0, &rows(500..700)).unwrap();
            assert!(matches!(write(&file.0, &rows(600..900)), Err(SamplesError::Overlap { run: 1 })));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        #[test]
        fn executions_are_read_as_they_were_written(runs in proptest::collection::vec(rows(), 1..4)) {
            let file = Scratch::new();
            let mut expected = vec![Vec::new(); NAMES.len()];
            let mut committed = 0;
            for (number, rows) in runs.iter().enumerate() {
                match write(&file.0, &format!("run {number}"), rows) {
                    Ok(()) => {
                        rows.iter().for_each(|row| expected[row.0].push(execution(row, committed)));
                        committed += 1;
                    }
                    Err(SamplesError::Duplicate { .. }) => prop_assert!(runs[..number].contains(rows)),
                    Err(error) => panic!("{error:?}"),
                }
            }
            let mut samples = Samples::open(&file.0).unwrap();
            prop_assert_eq!(samples.runs().len(), committed as usize);
            prop_assert_eq!(samples.runs()[0].executions, runs[0].len() as u64);
            prop_assert_eq!(samples.runs()[0].summary.events, runs[0].len() as u64);
            prop_assert_eq!(all(&mut samples), expected);
        }

        #[test]
        fn damaged_files_are_read_without_a_panic(at in 0_usize..1000, bytes in proptest::collection::vec(any::<u8>(), 1..20)) {
            let mut file = two_runs().0;
            for (index, byte) in bytes.iter().enumerate() {
                let length = file.len();
                file[(16 + at + index) % length] = *byte;
            }
            let file = Scratch::of(&file);
            if let Ok(mut samples) = Samples::open(&file.0) {
                for series in samples.series().to_vec() {
                    let _ = samples.executions(series.id);
                }
            }
        }
    }

    /// A file with two runs, and the ends of both.
    fn two_runs() -> (Vec<u8>, [u64; 2]) {
        let file = Scratch::new();
        let first = [(0, 5, Some(6), Some(7)), (1, 8, None, None), (0, 9, Some(10), Some(11))];
        write(&file.0, "first", &first).unwrap();
        let middle = std::fs::metadata(&file.0).unwrap().len();
        write(&file.0, "second", &[(2, 1, None, None), (0, 2, None, Some(3))]).unwrap();
        let bytes = std::fs::read(&file.0).unwrap();
        let end = bytes.len() as u64;
        (bytes, [middle, end])
    }

    #[test]
    fn a_truncated_file_has_the_runs_that_are_complete() {
        let (bytes, ends) = two_runs();
        for length in 0..=bytes.len() {
            let file = Scratch::of(&bytes[..length]);
            let runs = ends.iter().filter(|end| **end <= length as u64).count();
            match Samples::open(&file.0) {
                Ok(mut samples) => {
                    assert_eq!(samples.runs().len(), runs, "{length}");
                    let counts: Vec<usize> = all(&mut samples).iter().map(Vec::len).collect();
                    assert_eq!(counts, [[0, 0, 0], [2, 1, 0], [3, 1, 1]][runs], "{length}");
                }
                Err(SamplesError::Empty) => assert_eq!(length, 0),
                Err(SamplesError::NotSamples) => assert!(length < MAGIC.len(), "{length}"),
                Err(error) => panic!("{length}: {error:?}"),
            }
            // The next import goes on from there.
            write(&file.0, "next", &[(1, 77, None, None)]).unwrap();
            let samples = Samples::open(&file.0).unwrap();
            assert_eq!(samples.runs().len(), runs + 1, "{length}");
            assert_eq!(samples.runs()[runs].source, "next");
        }
    }

    #[test]
    fn damage_before_a_complete_run_is_an_error() {
        let (bytes, ends) = two_runs();
        for at in MAGIC.len()..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 4;
            let file = Scratch::of(&damaged);
            let opened = Samples::open(&file.0);
            let runs = opened.map(|mut samples| {
                let runs = samples.runs().len();
                let is_readable =
                    samples.series().to_vec().iter().all(|it| samples.executions(it.id).is_ok());
                (runs, is_readable)
            });
            match runs {
                // Damage in a body is noticed when it is read.
                Ok((2, false)) | Err(SamplesError::Damaged { .. }) => {}
                // The end of the last run is damaged: it looks like a run that did not end.
                Ok((1, true)) => assert!(at as u64 >= ends[0], "{at}"),
                other => panic!("{at}: {other:?}"),
            }
        }
    }

    #[test]
    fn a_run_that_is_not_committed_is_removed() {
        let file = Scratch::new();
        write(&file.0, "first", &[(0, 5, None, None)]).unwrap();
        let before = std::fs::read(&file.0).unwrap();
        let mut writer = SamplesWriter::open(&file.0).unwrap();
        let rows: Vec<Row> = (0..20_000).map(|it| (it % 3, it as u64, None, None)).collect();
        begin(&mut writer, "second", &rows);
        assert!(std::fs::metadata(&file.0).unwrap().len() > before.len() as u64);
        assert_eq!(Samples::open(&file.0).unwrap().runs().len(), 1);
        // The next run declares its series again.
        begin(&mut writer, "third", &[(1, 6, None, None)]);
        writer.commit(&Totals::default()).unwrap();
        let mut samples = Samples::open(&file.0).unwrap();
        assert_eq!(all(&mut samples).iter().map(Vec::len).collect::<Vec<_>>(), [1, 1, 0]);
        begin(&mut writer, "fourth", &rows);
        let length = || std::fs::metadata(&file.0).unwrap().len();
        let with_four = length();
        drop(writer);
        assert!(length() < with_four);
        assert_eq!(Samples::open(&file.0).unwrap().runs().len(), 2);
    }

    #[test]
    fn the_same_executions_are_imported_once() {
        let file = Scratch::new();
        let rows = [(0, 5, None, Some(1)), (1, 5, None, Some(2))];
        // The series have other numbers in this file.
        write(&file.0, "other", &[(2, 1, None, None), (1, 1, None, None)]).unwrap();
        write(&file.0, "first", &rows).unwrap();
        let length = std::fs::metadata(&file.0).unwrap().len();
        match write(&file.0, "again", &rows) {
            Err(SamplesError::Duplicate { run }) => assert_eq!(run, 1),
            other => panic!("{other:?}"),
        }
        assert_eq!(std::fs::metadata(&file.0).unwrap().len(), length);
        write(&file.0, "later", &[(0, 5, None, Some(3)), (1, 5, None, Some(4))]).unwrap();
    }

    #[test]
    fn other_files_are_refused() {
        for (bytes, is_ours) in
            [(b"codel,execution_ns\n".as_slice(), false), (b"MAUVE samples 2\n", true), (b"x", false)]
        {
            let file = Scratch::of(bytes);
            for error in [Samples::open(&file.0).map(drop), SamplesWriter::open(&file.0).map(drop)] {
                match error {
                    Err(SamplesError::LaterVersion) => assert!(is_ours),
                    Err(SamplesError::NotSamples) => assert!(!is_ours),
                    other => panic!("{other:?}"),
                }
            }
            assert_eq!(std::fs::read(&file.0).unwrap(), bytes);
        }
        let file = Scratch::new();
        let writer = SamplesWriter::open(&file.0).unwrap();
        assert!(matches!(SamplesWriter::open(&file.0), Err(SamplesError::Locked)));
        drop(writer);
        // Nothing was committed.
        assert!(!file.0.exists());
    }

    #[test]
    fn executions_are_compact() {
        let file = Scratch::new();
        // A codel of 100 µs each 10 ms, with jitter and preemption as they are.
        let mut random = 1_u64;
        let mut below = |bound: u64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 33) % bound
        };
        let row = |number: u64| {
            let execution = 100_000 + below(8000);
            let elapsed = execution + 300 + below(500);
            let end = 1_700_000_000_000_000_000 + number * 10_000_000 + elapsed + below(50_000);
            (0, execution, Some(elapsed), Some(end))
        };
        let rows: Vec<Row> = (0..100_000).map(row).collect();
        write(&file.0, "run", &rows).unwrap();
        let each = std::fs::metadata(&file.0).unwrap().len() as f64 / rows.len() as f64;
        assert!(each < 8.0, "{each} bytes for an execution");
    }
}
