//! Appends runs to a sample file.

use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use super::block::{self, BlockKind, LONGEST_BODY, LONGEST_HEAD};
use super::encoding::{Codec, Has, SampledExecution, put, put_text};
use super::overlap::Firsts;
use super::{END_MARK, Index, MAGIC, Run, SamplesError, SeriesId, put_summary};
use crate::trace::Totals;

/// Executions in a block: about 30 kB.
const BLOCK: u64 = 1 << 12;

/// The bytes of all blocks that are not yet written. Bounds the memory with many series.
const BUFFERED: usize = 16 << 20;

/// Appends runs to a sample file, which no other process can write at the same time.
///
/// All that is written before [`SamplesWriter::commit`] is ignored by readers; without it, it is removed again.
#[derive(Debug)]
pub struct SamplesWriter {
    path: PathBuf,
    file: File,
    index: Index,
    ids: HashMap<(String, String), SeriesId>,
    /// Key and instance of each series.
    names: Vec<(String, String)>,
    /// Whether this writer has made the file, which goes again if no run is committed.
    is_new: bool,
    removed: u64,
    /// Of all runs in the file; read when it is first needed.
    firsts: Option<Firsts>,
    run: Option<OpenRun>,
}

#[derive(Debug, Default)]
struct OpenRun {
    source: String,
    date: u64,
    /// By series.
    blocks: Vec<OpenBlock>,
    buffered: usize,
    executions: u64,
    /// Of all executions in their order.
    hash: Sha256,
    hashed: Vec<u8>,
    /// The number of series in the file before the run.
    known: usize,
    /// The number of series that the run has.
    used: u32,
    firsts: Firsts,
    /// A run of the file whose first execution this one has.
    overlapped: Option<usize>,
}

#[derive(Debug, Default)]
struct OpenBlock {
    /// The number of the series in the run.
    number: Option<u32>,
    count: u64,
    has: Has,
    least: u64,
    greatest: u64,
    body: Vec<u8>,
    codec: Codec,
}

impl SamplesWriter {
    /// Opens a sample file, or makes it. Removes what an import has left that did not end.
    ///
    /// # Errors
    ///
    /// The file cannot be read or written, is not a sample file, is damaged, or another process writes it.
    pub fn open(path: &Path) -> Result<SamplesWriter, SamplesError> {
        let mut options = OpenOptions::new();
        options.read(true).write(true);
        let (mut file, is_new) = match options.open(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                (options.create_new(true).open(path)?, true)
            }
            file => (file?, false),
        };
        // A pipe or a device has no end.
        if !file.metadata()?.is_file() {
            return Err(SamplesError::NotSamples);
        }
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(SamplesError::Locked),
            // A file system without locks.
            Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) => return Err(SamplesError::Io(error)),
        }
        let index = Index::read(&mut file)?;
        let names: Vec<(String, String)> =
            index.series.iter().map(|it| (it.key.clone(), it.instance.clone())).collect();
        let ids = names.iter().cloned().zip(index.series.iter().map(|it| it.id)).collect();
        let removed = index.size.saturating_sub(index.end);
        let mut writer = SamplesWriter {
            path: path.to_owned(),
            file,
            index,
            ids,
            names,
            is_new,
            removed,
            firsts: None,
            run: None,
        };
        writer.abort()?;
        // If the disk is full, a new file goes again.
        if writer.index.end == 0 {
            writer.file.write_all(MAGIC)?;
            writer.index.end = MAGIC.len() as u64;
        }
        Ok(writer)
    }

    /// Returns how many bytes of an import that did not end were removed when the file was opened.
    pub fn removed_bytes(&self) -> u64 {
        self.removed
    }

    /// Returns the runs in the file.
    pub fn runs(&self) -> &[Run] {
        &self.index.runs
    }

    /// Begins a run: `source` is shown to users, `date` is in seconds since the epoch. Ends one that was not committed.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn begin(&mut self, source: &str, date: u64) -> Result<(), SamplesError> {
        if self.firsts.is_none() {
            self.firsts = Some(Firsts::read(&mut self.file, &self.index)?);
        }
        self.abort()?;
        let mut head = Vec::new();
        put_text(&mut head, source);
        put(&mut head, date);
        block::write(&mut self.file, BlockKind::Begin, &head, b"")?;
        let (source, known) = (source.to_owned(), self.names.len());
        self.run = Some(OpenRun { source, date, known, ..OpenRun::default() });
        Ok(())
    }

    /// Returns the series of a key and an instance; declares it if it is new. Only within a run.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn series(&mut self, key: &str, instance: &str) -> Result<SeriesId, SamplesError> {
        let name = (key.to_owned(), instance.to_owned());
        if let Some(id) = self.ids.get(&name) {
            return Ok(*id);
        }
        let id = SeriesId(u32::try_from(self.names.len()).map_err(|_| SamplesError::TooMany)?);
        let mut head = Vec::new();
        put_text(&mut head, key);
        put_text(&mut head, instance);
        if head.len() > LONGEST_HEAD {
            return Err(SamplesError::LongName);
        }
        block::write(&mut self.file, BlockKind::Series, &head, b"")?;
        self.names.push(name.clone());
        self.ids.insert(name, id);
        Ok(id)
    }

    /// Appends an execution; its run is the one that is open.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn add(&mut self, series: SeriesId, execution: SampledExecution) -> Result<(), SamplesError> {
        let Some(run) = &mut self.run else { return Ok(()) };
        let index = series.0 as usize;
        let (key, instance) = self.names.get(index).ok_or(SamplesError::UnknownSeries)?;
        if run.blocks.len() <= index {
            run.blocks.resize_with(index + 1, OpenBlock::default);
        }
        let Some(open) = run.blocks.get_mut(index) else { return Ok(()) };
        // The hash does not depend on the series of earlier runs.
        if open.number.is_none() {
            run.firsts.add(series, &execution, 0);
        }
        run.overlapped = run.overlapped.or_else(|| self.firsts.as_ref()?.run_of(series, &execution));
        let number = *open.number.get_or_insert_with(|| {
            put_text(&mut run.hashed, key);
            put_text(&mut run.hashed, instance);
            run.used += 1;
            run.used
        });
        run.hashed.extend(number.to_le_bytes());
        run.hashed.extend(execution.execution.to_le_bytes());
        run.hashed.extend(execution.end.unwrap_or(u64::MAX).to_le_bytes());
        if run.hashed.len() > 1 << 13 {
            run.hash.update(&run.hashed);
            run.hashed.clear();
        }
        run.executions += 1;

        let has = Has::of(&execution);
        if open.count > 0 && (open.has != has || open.count == BLOCK || open.body.len() > LONGEST_BODY - 64) {
            run.buffered -= open.body.len();
            open.write(&mut self.file, series)?;
        }
        if open.count == 0 {
            (open.has, open.least, open.greatest) = (has, u64::MAX, 0);
        }
        let before = open.body.len();
        open.codec.put(&mut open.body, &execution);
        open.count += 1;
        open.least = open.least.min(execution.execution);
        open.greatest = open.greatest.max(execution.execution);
        run.buffered += open.body.len() - before;
        if run.buffered > BUFFERED {
            self.write_blocks()?;
        }
        Ok(())
    }

    /// Ends the run: it is on the disk, and valid, when this returns.
    ///
    /// # Errors
    ///
    /// The file cannot be written, or has the same executions. Then the run is removed.
    pub fn commit(&mut self, summary: &Totals) -> Result<(), SamplesError> {
        let result = self.try_commit(summary);
        if result.is_err() {
            // The first error says what is wrong; a reader ignores the run in any case.
            let _ = self.abort();
        }
        result
    }

    fn try_commit(&mut self, summary: &Totals) -> Result<(), SamplesError> {
        self.write_blocks()?;
        let Some(run) = &mut self.run else { return Ok(()) };
        run.hash.update(&run.hashed);
        run.hashed.clear();
        let fingerprint: [u8; 32] = run.hash.clone().finalize().into();
        let (source, date, executions) = (run.source.clone(), run.date, run.executions);
        let new = Run { source, date, summary: *summary, executions, fingerprint };
        if let Some(run) = self.index.runs.iter().position(|it| it.is_same(&new)) {
            return Err(SamplesError::Duplicate { run });
        }
        let overlapped = match run.overlapped {
            Some(run) => Some(run),
            None => run.firsts.begin_in(&mut self.file, &self.index.runs)?,
        };
        if let Some(run) = overlapped {
            return Err(SamplesError::Overlap { run });
        }
        self.file.seek(SeekFrom::End(0))?;
        let mut head = END_MARK.to_vec();
        head.extend(fingerprint);
        put(&mut head, executions);
        put_summary(&mut head, *summary);
        // What the end makes valid must be on the disk before it.
        self.sync()?;
        block::write(&mut self.file, BlockKind::End, &head, b"")?;
        self.sync()?;
        if let Some((all, run)) = self.firsts.as_mut().zip(self.run.take()) {
            all.extend(run.firsts, self.index.runs.len());
        }
        self.index.runs.push(new);
        self.index.end = self.file.stream_position()?;
        Ok(())
    }

    /// Removes the run that is open.
    fn abort(&mut self) -> Result<(), SamplesError> {
        if let Some(run) = self.run.take() {
            self.names.truncate(run.known);
            self.ids.retain(|_, id| (id.0 as usize) < run.known);
        }
        let end = self.index.end;
        self.file.set_len(end)?;
        self.file.seek(SeekFrom::Start(end)).map(drop).map_err(SamplesError::Io)
    }

    fn write_blocks(&mut self) -> Result<(), SamplesError> {
        let Some(run) = &mut self.run else { return Ok(()) };
        for (index, open) in run.blocks.iter_mut().enumerate().filter(|(_, open)| open.count > 0) {
            let series = SeriesId(u32::try_from(index).map_err(|_| SamplesError::TooMany)?);
            open.write(&mut self.file, series)?;
        }
        run.buffered = 0;
        Ok(())
    }

    fn sync(&mut self) -> Result<(), SamplesError> {
        self.file.sync_data().map_err(SamplesError::Io)
    }
}

impl Drop for SamplesWriter {
    fn drop(&mut self) {
        let _ = self.abort();
        if self.is_new && self.index.runs.is_empty() {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

impl OpenBlock {
    /// Writes the block, and begins the next one.
    fn write(&mut self, file: &mut File, series: SeriesId) -> Result<(), SamplesError> {
        let mut head = Vec::new();
        for value in [u64::from(series.0), self.count, self.has.bits(), self.least, self.greatest] {
            put(&mut head, value);
        }
        block::write(file, BlockKind::Data, &head, &self.body)?;
        // With many series, what each has allocated would add up.
        self.body = Vec::new();
        (self.count, self.codec) = (0, Codec::default());
        Ok(())
    }
}
