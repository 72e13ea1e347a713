//! Runs that have executions in common: a part of a recording, and the whole of it.
//!
//! Two intervals of one recording overlap if and only if the first execution of one of them is in the other. An execution is known
//! by its series, its end and its time; executions without an end are not compared.

use std::collections::HashMap;
use std::fs::File;
use std::ops::ControlFlow;

use super::{Index, Run, SampledExecution, SamplesError, SeriesId};

/// The first executions of each series in each run.
#[derive(Debug, Default)]
pub(super) struct Firsts {
    runs: HashMap<(SeriesId, u64, u64), usize>,
}

impl Firsts {
    /// Reads those of a file: the first block of each series in each run.
    pub(super) fn read(file: &mut File, index: &Index) -> Result<Firsts, SamplesError> {
        let mut firsts = Firsts::default();
        for (series, parts) in index.series.iter().zip(&index.parts) {
            let mut run = None;
            for part in parts.iter().filter(|part| part.has.end) {
                if run.replace(part.run) != Some(part.run) {
                    part.read(file, &mut |it| {
                        firsts.add(series.id, &it, it.run as usize);
                        ControlFlow::Break(())
                    })?;
                }
            }
        }
        Ok(firsts)
    }

    /// Returns the run that begins with this execution.
    pub(super) fn run_of(&self, series: SeriesId, it: &SampledExecution) -> Option<usize> {
        self.runs.get(&(series, it.end?, it.execution)).copied()
    }

    /// Adds the first execution of a series in a run.
    pub(super) fn add(&mut self, series: SeriesId, it: &SampledExecution, run: usize) {
        if let Some(end) = it.end {
            self.runs.entry((series, end, it.execution)).or_insert(run);
        }
    }

    /// Adds those of a run that was added to the file.
    pub(super) fn extend(&mut self, run: Firsts, index: usize) {
        self.runs.extend(run.runs.into_keys().map(|key| (key, index)));
    }

    /// Returns the run of the file in which this run begins. Only runs of its time are read.
    pub(super) fn begin_in(&self, file: &mut File, runs: &[Run]) -> Result<Option<usize>, SamplesError> {
        let begins = || self.runs.keys().map(|(_, end, _)| *end);
        let (Some(least), Some(greatest)) = (begins().min(), begins().max()) else { return Ok(None) };
        let is_of_time = |run: &Run| {
            let (first, last) = (run.summary.first.unwrap_or(0), run.summary.last.unwrap_or(u64::MAX));
            first <= greatest && least <= last
        };
        let candidates: Vec<bool> = runs.iter().map(is_of_time).collect();
        if !candidates.contains(&true) {
            return Ok(None);
        }
        let index = Index::read(file)?;
        let mut found = None;
        for (series, parts) in index.series.iter().zip(&index.parts) {
            for part in parts.iter().filter(|it| it.has.end && candidates.get(it.run as usize) == Some(&true))
            {
                part.read(file, &mut |it| match self.run_of(series.id, &it) {
                    Some(_) => {
                        found = Some(it.run as usize);
                        ControlFlow::Break(())
                    }
                    None => ControlFlow::Continue(()),
                })?;
                if found.is_some() {
                    return Ok(found);
                }
            }
        }
        Ok(None)
    }
}
