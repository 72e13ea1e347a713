//! The ranges of the sources of a file.
//!
//! A long declaration consists of items, such as the states of a core. The ranges of an item are relative to its start: they are
//! kept while an edit elsewhere moves it.

use std::sync::Arc;

use mauve_syntax::{TextRange, TextSize};

use crate::item_tree::SourceId;

/// The ranges of the sources of a file. Only queries whose results are shown to a user may read it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SourceMap {
    /// For each declaration of the item tree.
    pub declarations: Vec<DeclarationMap>,
    /// For each include of the item tree, its path or, if the path is missing, the line.
    pub includes: Vec<TextRange>,
}

/// The range of a declaration, and the ranges of its sources.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeclarationMap {
    /// The range of the declaration.
    pub range: TextRange,
    sources: Arc<[SourceRun]>,
}

/// Consecutive sources of a declaration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SourceRun {
    /// The first source. There may be none between the end of a run and the next run.
    first: u32,
    /// A range that contains the sources, relative to the start of the declaration.
    range: TextRange,
    /// The range of each source, relative to the start of `range`.
    ranges: Arc<[TextRange]>,
}

impl DeclarationMap {
    pub(crate) fn new(range: TextRange, sources: Arc<[SourceRun]>) -> DeclarationMap {
        DeclarationMap { range, sources }
    }

    /// Returns the range of a source; that of [`SourceId`] 0 is the name or, if that is missing, the keyword.
    pub fn range_of(&self, id: SourceId) -> Option<TextRange> {
        let after = self.sources.partition_point(|run| run.first <= id.0);
        let run = self.sources.get(after.checked_sub(1)?)?;
        let range = run.ranges.get((id.0 - run.first) as usize)?;
        Some(*range + run.range.start() + self.range.start())
    }

    /// Returns the last source with exactly this range.
    pub fn source_at(&self, range: TextRange) -> Option<SourceId> {
        let range = range.checked_sub(self.range.start())?;
        let runs = self.sources.iter().rev().filter(|run| run.range.contains_range(range));
        let source_in = |run: &SourceRun| {
            let range = range - run.range.start();
            let index = run.ranges.iter().rposition(|source| *source == range)?;
            Some(SourceId(run.first + index as u32))
        };
        runs.filter_map(source_in).max()
    }
}

/// The sources of the declaration that is being lowered.
#[derive(Debug, Default)]
pub(crate) struct Sources {
    /// The start of the declaration.
    start: TextSize,
    runs: Vec<SourceRun>,
    /// The first source after these runs.
    first: u32,
    /// The ranges of the sources since then.
    open: Vec<TextRange>,
}

impl Sources {
    /// Returns the sources of a declaration with this start: none yet.
    pub(crate) fn of_declaration(start: TextSize) -> Sources {
        Sources { start, ..Sources::default() }
    }

    /// Adds a source.
    pub(crate) fn add(&mut self, range: TextRange) -> SourceId {
        let id = self.next();
        self.open.push(range);
        SourceId(id)
    }

    /// Returns the next source.
    pub(crate) fn next(&self) -> u32 {
        self.first + self.open.len() as u32
    }

    /// Ends a run of sources, so that the next source is `first`.
    pub(crate) fn begin_at(&mut self, first: u32) {
        let all = self.open.iter().copied().reduce(TextRange::cover);
        if let Some(all) = all {
            self.end_run(all);
        }
        self.first = first;
    }

    /// Ends a run of sources, all of them in `item`. Returns their ranges, relative to its start.
    pub(crate) fn end_run(&mut self, item: TextRange) -> Arc<[TextRange]> {
        let ranges: Arc<[TextRange]> = self.open.drain(..).map(|range| range - item.start()).collect();
        self.add_run(item, ranges.clone());
        ranges
    }

    /// Adds the sources of an item that moved there; `ranges`: relative to its start.
    pub(crate) fn add_run(&mut self, item: TextRange, ranges: Arc<[TextRange]>) {
        let (first, range) = (self.first, item - self.start);
        self.first += ranges.len() as u32;
        self.runs.push(SourceRun { first, range, ranges });
    }

    /// Returns all sources of the declaration.
    pub(crate) fn end(&mut self) -> Arc<[SourceRun]> {
        self.begin_at(self.next());
        self.runs.drain(..).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(start: u32, end: u32) -> TextRange {
        TextRange::new(start.into(), end.into())
    }

    #[test]
    fn a_source_has_its_range_in_each_run() {
        let mut sources = Sources::of_declaration(100.into());
        let name = sources.add(range(105, 110));
        sources.begin_at(32);
        let (keyword, value) = (sources.add(range(120, 124)), sources.add(range(125, 129)));
        let item = sources.end_run(range(118, 130));
        assert_eq!((name.0, keyword.0, value.0, sources.next()), (0, 32, 33, 34));

        // The item is moved by five.
        let mut moved = Sources::of_declaration(100.into());
        moved.add(range(105, 115));
        moved.begin_at(32);
        moved.add_run(range(123, 135), item);
        let last = moved.add(range(140, 141));
        let map = DeclarationMap::new(range(100, 150), moved.end());
        assert_eq!(map.range_of(name), Some(range(105, 115)));
        assert_eq!(map.range_of(keyword), Some(range(125, 129)));
        assert_eq!(map.range_of(value), Some(range(130, 134)));
        assert_eq!(map.range_of(last), Some(range(140, 141)));
        assert_eq!(map.range_of(SourceId(7)), None);
        assert_eq!(map.range_of(SourceId(35)), None);
        assert_eq!(map.source_at(range(130, 134)), Some(value));
        assert_eq!(map.source_at(range(130, 135)), None);
        assert_eq!(map.source_at(range(1, 2)), None);
    }
}
